"""Where human and model differ, and the marks between two bars that say so."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QPainter

from forcelab.gui.figures.axes import Axis
from forcelab.labels import Segments

if TYPE_CHECKING:
    from forcelab.review.differences import Difference, Interval

__all__ = ["agreed_share", "mark_box", "paint_marks"]

#: A mark is at least so wide, in pixels; one as wide as two posts has a post at each end.
NARROWEST = 2.0
POST = 2.0
#: Thickness of the bar of another action and of the line of none, in pixels.
WRONG, MISSED = 4.0, 2.0


def agreed_share(human: Segments, marks: Sequence[Interval]) -> float | None:
    """Share of the time the human labelled that is predicted right; None if that is none."""
    labelled = sum(segment.duration for segment in human)
    wrong = sum(mark.duration for mark in marks)
    return 1.0 - wrong / labelled if labelled > 0 else None


def mark_box(band: QRectF, axis: Axis, mark: Interval) -> QRectF:
    """Where a mark lies in the band between two bars, in pixels; none is too narrow to be seen."""
    left, right = max(axis.at(mark.start), band.left()), min(axis.at(mark.end), band.right())
    if right - left < NARROWEST:
        left = min(max((left + right - NARROWEST) / 2, band.left()), band.right() - NARROWEST)
        right = left + NARROWEST
    return QRectF(left, band.top(), right - left, band.height())


def paint_marks(
    painter: QPainter, band: QRectF, axis: Axis, marks: Sequence[Difference], colour: QColor
) -> None:
    """Draw the marks of differing stretches.

    A wrong action is a thick bar between two posts, a displaced edge a bar without them, what was
    not predicted a thin line: they are told apart without colour.
    """
    middle = band.center().y()
    inside = [mark for mark in marks if mark.end > axis.start and mark.start < axis.end]
    rects = []
    # What is missed first: a narrow wrong action must not be lost beside it.
    for mark in sorted(inside, key=lambda mark: mark.predicted is not None):
        box = mark_box(band, axis, mark)
        if mark.predicted is None:
            rects.append(QRectF(box.left(), middle - MISSED / 2, box.width(), MISSED))
            continue
        rects.append(QRectF(box.left(), middle - WRONG / 2, box.width(), WRONG))
        if mark.kind == "boundary":
            continue
        width = min(POST, box.width() / 2)
        rects.append(QRectF(box.left(), band.top(), width, band.height()))
        rects.append(QRectF(box.right() - width, band.top(), width, band.height()))
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(colour)
    painter.drawRects(rects)
