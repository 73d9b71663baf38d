"""When Python looks for garbage: between two demonstrations, and not in the midst of a stroke.

A full search goes through every object there is, which with ten thousand segments takes longer
than painting. What reference counts free at once, which is nearly everything, is not concerned.
"""

from __future__ import annotations

import gc

from forcelab.gui.document import Document

__all__ = ["collect_between_demonstrations"]

#: A full search comes after so many of the middle generation, where ten are Python's own choice.
GC_THRESHOLD = 1000


def collect_between_demonstrations(document: Document) -> None:
    """Search in full whenever another demonstration is opened, and else hardly ever."""
    young, middle, _ = gc.get_threshold()
    gc.set_threshold(young, middle, GC_THRESHOLD)
    document.demonstration_changed.connect(_collect)


def _collect() -> None:
    """Search now; what is left is there to stay for a while, and need not be looked at again."""
    gc.unfreeze()
    gc.collect()
    gc.freeze()
