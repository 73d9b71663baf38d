"""The values at a lane's left edge: how much a curve's height is."""

from __future__ import annotations

import math

from PySide6.QtCore import QLineF, QRectF
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPen

from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis, labels, ticks
from forcelab.gui.theme import colours

__all__ = ["LOW", "lane_marks", "paint_scale", "scale_width"]

#: Heights of the numbers in pixels, in lanes with room and in low ones; below this a lane is low.
SIZE, SMALL, LOW = 9.0, 8.0, 40.0
#: Length of a mark, and from its end to its number, in pixels.
MARK, GAP = 3.0, 3.0


def scale_width() -> int:
    """Pixels that the numbers and their marks need."""
    return math.ceil(text.width("\N{MINUS SIGN}00.00", text.font(SIZE)) + MARK + GAP + 6)


def lane_marks(axis: Axis, size: float) -> tuple[tuple[float, str], ...]:
    """Two values at least with their texts, and those between them where they have room.

    Parameters
    ----------
    axis : Axis
        Of the lane, upwards.
    size : float
        Height of the numbers in pixels.
    """
    span, power = axis.end - axis.start, math.ceil(math.log10(axis.end - axis.start))
    while True:
        for step in (5 * 10.0**power, 2 * 10.0**power, 10.0**power):
            values = ticks(axis.start, axis.end, step)
            if len(values) < 2:
                continue
            texts = labels(values, step)
            marks = tuple(zip(values, texts, strict=True))
            close = step / span * abs(axis.finish - axis.begin) < size + 2
            return (marks[0], marks[-1]) if close else marks
        power -= 1


def paint_scale(painter: QPainter, box: QRectF, axis: Axis) -> None:
    """Draw a lane's values left of its box."""
    size = SIZE if box.height() >= LOW else SMALL
    face = text.font(size)
    painter.save()  # names and values beside it have a font of their own
    half = QFontMetricsF(face).capHeight() / 2 + 1
    painter.setPen(QPen(QColor(colours().frame), 1))
    marks = lane_marks(axis, size)
    left = box.left() - MARK
    painter.drawLines(
        [QLineF(left, y, box.left(), y) for y in (round(axis.at(v)) + 0.5 for v, _ in marks)]
    )
    ink = QColor(colours().muted)
    for value, said in marks:
        y = min(max(axis.at(value), box.top() + half), box.bottom() - half)
        text.put(painter, left - GAP, y, said, face=face, ink=ink, align=1.0)
    painter.restore()
