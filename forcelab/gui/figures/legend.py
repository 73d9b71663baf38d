"""The legend: a swatch with the key and a name for each action, in columns."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from PySide6.QtCore import QRectF
from PySide6.QtGui import QColor, QPainter

from forcelab.gui.figures import text
from forcelab.gui.figures.canvas import Theme
from forcelab.gui.figures.tracks import Look, paint_look
from forcelab.vocabulary import Vocabulary

__all__ = ["LINE", "Legend", "looks_in_order"]

#: Names longer than this are elided; height of a line; size of a swatch; all in pixels.
ROOM = 190.0
LINE = 20.0
SWATCH, SWATCH_HEIGHT = 22.0, 13.0


def looks_in_order(actions: Iterable[str], vocabulary: Vocabulary) -> dict[str, Look]:
    """How each action is drawn, with the key that paints it: no other number is to be learnt."""
    found = ((name, vocabulary[name]) for name in actions)
    return {name: Look(it.key, QColor(it.colour), it.texture) for name, it in found}


@dataclass(frozen=True)
class Legend:
    """A legend laid out in a width.

    Parameters
    ----------
    looks : mapping of str to Look
        The actions in order.
    room : float
        Width in pixels.
    """

    looks: Mapping[str, Look]
    room: float

    @property
    def columns(self) -> tuple[int, float]:
        """Number of columns, and the width of one."""
        names = [text.shown(name) for name in self.looks]
        column = SWATCH + 7 + min(text.widest(names, text.font()), ROOM) + 20
        return max(1, int((self.room + 20) // column)), column

    @property
    def height(self) -> float:
        """Height in pixels."""
        return math.ceil(len(self.looks) / self.columns[0]) * LINE

    def paint(self, painter: QPainter, left: float, top: float, theme: Theme) -> None:
        """Draw swatches and names."""
        columns, column = self.columns
        for i, (name, look) in enumerate(self.looks.items()):
            x = left + i % columns * column
            y = top + i // columns * LINE
            swatch = QRectF(x, y + (LINE - SWATCH_HEIGHT) / 2, SWATCH, SWATCH_HEIGHT)
            paint_look(painter, swatch, look)
            label = text.elided_name(name, text.font(), ROOM, tuple(self.looks))
            middle, ink = y + LINE / 2, QColor(theme.text)
            text.put(painter, x + SWATCH + 7, middle, label, face=text.font(), ink=ink)
