"""What the force panel has around and behind its curves: axes and their lines, gaps, notes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from itertools import groupby, pairwise

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QBrush, QColor, QPainter, QPen, QPolygonF

from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis
from forcelab.gui.figures.shades import mixed, translucent
from forcelab.gui.label.force_lanes import Lane
from forcelab.gui.panel import TimePanel
from forcelab.gui.theme import Colours

__all__ = [
    "curve_colour",
    "curve_ink",
    "paint_axis",
    "paint_gaps",
    "paint_glitches",
    "paint_ground",
    "paint_groups",
    "paint_notes",
]

#: Height of numbers, in pixels.
NUMBER = 10.0
#: So far may an axis' number stand from its value, in pixels.
ASIDE = 3.0
#: Width and height of the mark of a glitch, in pixels.
GLITCH = (9.0, 6.0)
#: The least contrast of a text to its ground (WCAG 2.2).
READ = 4.5


def curve_colour(column: int, theme: Colours) -> QColor:
    """The colour of a channel: it depends on its place in the recording only."""
    return QColor(theme.curves[column % len(theme.curves)])


@cache
def curve_ink(column: int, theme: Colours) -> QColor:
    """The colour of a channel's name and values: its curve's, deepened until it can be read."""
    colour = curve_colour(column, theme)
    inks = (mixed(colour, theme.text, share / 20) for share in range(21))
    return next(ink for ink in inks if text.contrast(ink, QColor(theme.panel)) >= READ)


def paint_notes(
    painter: QPainter, plot: QRectF, notes: Sequence[str], theme: Colours, *, at_left: bool
) -> None:
    """Write what is to be known of the curves into a corner, one line below the other."""
    face, y = text.font(10), plot.top() + 9
    ground = translucent(theme.background, 0.9)
    for note in notes:
        wide = text.width(note, face)
        right = plot.left() + wide + 10 if at_left else plot.right()
        painter.fillRect(QRectF(right - wide - 10, y - 7, wide + 8, 14), ground)
        text.put(painter, right - 6, y, note, face=face, ink=QColor(theme.muted), align=1.0)
        y += 15


def paint_axis(
    painter: QPainter,
    lane: Lane,
    axis: Axis,
    x: float,
    taken: Sequence[QRectF],
    theme: Colours,
) -> None:
    """Draw a lane's vertical axis at `x`, without the numbers that would run into what is taken."""
    painter.setPen(QPen(QColor(theme.frame), 1.0))
    painter.drawLine(QLineF(x - 0.5, lane.top, x - 0.5, lane.bottom))
    face = text.font(NUMBER)
    for value, label in axis.marks(NUMBER, upright=True):
        y = round(axis.at(value)) + 0.5
        painter.setPen(QPen(QColor(theme.frame), 1.0))
        painter.drawLine(QLineF(x - 4, y, x - 1, y))
        wide = text.width(label, face)
        # Moved a little where it would run into a number of the next lane.
        middle = max(min(y, lane.bottom - NUMBER / 2), lane.top + NUMBER / 2)
        place = QRectF(x - 6 - wide, middle - NUMBER / 2, wide, NUMBER)
        inside = abs(middle - y) <= ASIDE and place.bottom() <= lane.bottom
        if inside and not any(place.intersects(other) for other in taken):
            ink = QColor(theme.muted)
            text.put(painter, x - 6, middle, label, face=face, ink=ink, align=1.0)


def paint_groups(
    painter: QPainter, lanes: Sequence[Lane], names: Mapping[str, str], theme: Colours
) -> None:
    """Draw a bracket along the lanes of each sensor, with its name where there is room."""
    face = text.font(NUMBER)
    for group, members in groupby(lanes, key=lambda lane: lane.group):
        strips = list(members)
        top, bottom = strips[0].top + 3, strips[-1].bottom - 3
        if not group:
            continue
        painter.setPen(QPen(QColor(theme.frame), 1.0))
        painter.drawLines(
            [
                QLineF(15.5, top, 15.5, bottom),
                QLineF(15.5, top, 18.0, top),
                QLineF(15.5, bottom, 18.0, bottom),
            ]
        )
        name = names[group]
        if text.width(name, face) > bottom - top:
            name = text.elided_name(group, face, bottom - top)
        middle = (top + bottom) / 2
        ink = QColor(theme.muted)
        text.put_upwards(painter, 8.0, middle, name, face=face, ink=ink, align=0.5)


def paint_ground(
    painter: QPainter, axes: Sequence[tuple[Lane, Axis]], plot: QRectF, theme: Colours
) -> None:
    """Draw what lies behind the curves: lines at the axes' numbers, zero, borders of lanes."""
    for _, axis in axes:
        rows = [axis.at(value) for value, _ in axis.marks(10.0, upright=True) if value]
        painter.setPen(QPen(QColor(theme.grid), 1))
        for row in rows:
            y = round(row) + 0.5
            painter.drawLine(QLineF(plot.left(), y, plot.right(), y))
        if axis.start <= 0.0 <= axis.end:
            painter.setPen(QPen(QColor(theme.frame), 1, Qt.PenStyle.DotLine))
            y = round(axis.at(0.0)) + 0.5
            painter.drawLine(QLineF(plot.left(), y, plot.right(), y))
    painter.setPen(QPen(QColor(theme.panel_edge), 1))
    for (lane, _), (following, _) in pairwise(axes):
        y = round(lane.bottom) + 0.5
        painter.drawLine(QLineF(plot.left(), y, plot.right(), y))
        if following.top > lane.bottom:
            box = QRectF(plot.left(), lane.bottom, plot.width(), following.top - lane.bottom)
            painter.fillRect(box, QColor(theme.panel))


def paint_gaps(
    painter: QPainter, panel: TimePanel, gaps: NDArray[np.float64], plot: QRectF, theme: Colours
) -> None:
    """Hatch the visible gaps, shape (2, g) in seconds; those closer than a pixel become one."""
    document, slope = panel.document, panel.seconds_per_pixel
    first = int(np.searchsorted(gaps[1], document.start))
    last = int(np.searchsorted(gaps[0], document.end))
    if first >= last:
        return
    left, right = plot.left() + (gaps[:, first:last] - document.start) / slope
    left, right = np.maximum(left, plot.left() - 1), np.minimum(right, plot.right() + 1)
    middle = (left + right) / 2
    half = np.maximum((right - left) / 2, 0.5)
    left, right = middle - half, middle + half
    opens = np.flatnonzero(np.append(True, left[1:] > np.maximum.accumulate(right)[:-1] + 1.0))
    ends = np.maximum.accumulate(right)[np.append(opens[1:], len(left)) - 1]
    hatch = QBrush(QColor(theme.frame), Qt.BrushStyle.BDiagPattern)
    wash = QColor(theme.panel)
    for a, b in zip(left[opens].tolist(), ends.tolist(), strict=True):
        box = QRectF(a, plot.top(), b - a, plot.height())
        painter.fillRect(box, wash)
        painter.fillRect(box, hatch)


def paint_glitches(
    painter: QPainter,
    x: NDArray[np.float64],
    upwards: NDArray[np.bool_],
    box: tuple[float, float],
    theme: Colours,
) -> None:
    """Draw an arrow head at the edge of a lane for each glitch, towards where it would be.

    Parameters
    ----------
    painter : QPainter
    x : ndarray, shape (g,)
        Where they are in pixels.
    upwards : ndarray of bool, shape (g,)
        Which are above what the lane shows; the others are below.
    box : tuple of float
        The lane's top and bottom in pixels.
    theme : Colours
    """
    if not len(x):
        return
    wide, high = GLITCH
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(QPen(QColor(theme.background), 1.0))
    painter.setBrush(QColor(theme.trouble))
    # One arrow a pixel is enough, however many there are.
    for at, up in sorted({*zip(np.round(x).tolist(), upwards.tolist(), strict=True)}):
        tip, base = (box[0] + 1, box[0] + 1 + high) if up else (box[1] - 1, box[1] - 1 - high)
        corners = [(at, tip), (at - wide / 2, base), (at + wide / 2, base)]
        painter.drawPolygon(QPolygonF([QPointF(*corner) for corner in corners]))
    painter.restore()
