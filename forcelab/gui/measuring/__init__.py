"""How long the window keeps a coder waiting: ``forcelab measure view``.

One file for each thing that is measured, always in the real window. It lives here and not in
:mod:`forcelab.measure`, which keeps the numbers (:mod:`forcelab.measure.latency`), because only the
gui may know Qt, and what is measured must not know who measures it.
"""

from __future__ import annotations

from collections.abc import Generator

from forcelab.jobs import Progress
from forcelab.measure.latency import Latencies

__all__ = ["tabulate"]


def tabulate(*, quick: bool = False) -> Generator[Progress, None, Latencies]:
    """Measure everything: some minutes, and 2 GB of disk for a while.

    With `quick` only recordings of 1e6 samples, and fewer repetitions.

    Yields
    ------
    Progress

    Returns
    -------
    Latencies
    """
    from forcelab.gui.measuring.scenes import measuring  # Qt is loaded only when it measures

    return (yield from measuring(quick=quick))
