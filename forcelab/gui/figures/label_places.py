"""Where the names of points stand in a plot: beside their points and across nothing else."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

from PySide6.QtCore import QLineF, QPointF, QRectF
from PySide6.QtGui import QFont

from forcelab.gui.figures import text

__all__ = ["along", "covered", "places"]

#: What is left free between a mark and its text, and boxes along a line, in pixels.
GAP, STEP = 3.0, 4.0


def places(spot: QPointF, label: str, face: QFont, box: QRectF, mark: float) -> Iterator[QRectF]:
    """Boxes around a mark where its label may stand, moved into the plot: the best ones first.

    Parameters
    ----------
    spot : QPointF
        The middle of the mark.
    label : str
    face : QFont
    box : QRectF
        The plot.
    mark : float
        Half the mark's width, in pixels.
    """
    wide, high = text.width(label, face), face.pixelSize() + 2.0
    out, near = mark + GAP, mark
    for left, top in (
        (out, -high / 2),
        (-out - wide, -high / 2),
        (-wide / 2, -out - high),
        (-wide / 2, out),
        (near, -near - high),
        (near, near),
        (-near - wide, -near - high),
        (-near - wide, near),
    ):
        x = min(max(spot.x() + left, box.left() + 2), box.right() - 2 - wide)
        y = min(max(spot.y() + top, box.top() + 2), box.bottom() - 2 - high)
        yield QRectF(x, y, wide, high)


def along(line: Sequence[QPointF]) -> Iterator[QRectF]:
    """Small boxes that cover a polyline, so that no label is written across it."""
    for start, end in pairwise(line):
        length = QLineF(start, end).length()
        for i in range(math.ceil(length / STEP)):
            spot = QLineF(start, end).pointAt(i * STEP / length)
            yield QRectF(spot.x() - STEP / 2, spot.y() - STEP / 2, STEP, STEP)


def covered(place: QRectF, taken: Sequence[QRectF]) -> float:
    """Area of what a label would cover."""
    common = [place.intersected(other) for other in taken]
    return sum(box.width() * box.height() for box in common)
