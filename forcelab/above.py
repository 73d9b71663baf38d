"""What a noun offers and a room above it does: found when it is called.

A demonstration has ``plot()`` although the room that draws it knows demonstrations, not the other
way round. Nothing but what is listed here is reached so.
"""

from __future__ import annotations

from importlib import import_module
from os import PathLike
from typing import Any, Final, Protocol

#: The modules of these functions.
_HOMES: Final = {
    "demonstration_from_frame": "forcelab.formats.data_frame",
    "plot": "forcelab.gui.figures.plots",
}


def call_above(name: str, *arguments: Any) -> Any:
    """Call a function of a room above."""
    return getattr(import_module(_HOMES[name]), name)(*arguments)


class Drawing(Protocol):
    """What ``plot()`` gives: a picture that notebooks show and that can be saved."""

    def _repr_svg_(self) -> str: ...

    def save(self, path: str | PathLike[str]) -> None:
        """Write it as SVG, PDF or PNG, by the suffix; InputError where that cannot be done."""
