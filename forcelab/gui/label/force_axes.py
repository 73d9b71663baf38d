"""What the force panel has around its curves: names, axes and their lines, values at the cursor."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache
from itertools import groupby, pairwise

from PySide6.QtCore import QLineF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen

from forcelab.demonstration import Channel
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis
from forcelab.gui.figures.shades import mixed, translucent
from forcelab.gui.label.force_lanes import Lane
from forcelab.gui.theme import Colours

__all__ = [
    "curve_colour",
    "curve_ink",
    "number_of",
    "paint_axis",
    "paint_ground",
    "paint_groups",
    "paint_names",
    "paint_notes",
    "paint_tag",
    "paint_values",
    "tagged",
]

#: Heights of fonts and of a line of text, in pixels.
NAME, NUMBER, LINE = 11.0, 10.0, 14.0
#: Least height of a line of two and of a line alone.
LEAST, SMALLEST = 11.0, 9.0
#: So far may an axis' number stand from its value, in pixels.
ASIDE = 3.0
#: Where names start, with and without the brackets of groups left of them.
BESIDE, ALONE = 20.0, 6.0
#: The least contrast of a text to its ground (WCAG 2.2).
READ = 4.5
#: Width of a value at the cursor: names and values end where the axis' numbers may begin.
VALUE = 40.0


def curve_colour(column: int, theme: Colours) -> QColor:
    """The colour of a channel: it depends on its place in the recording only."""
    return QColor(theme.curves[column % len(theme.curves)])


@cache
def curve_ink(column: int, theme: Colours) -> QColor:
    """The colour of a channel's name and values: its curve's, deepened until it can be read."""
    colour = curve_colour(column, theme)
    inks = (mixed(colour, theme.text, share / 20) for share in range(21))
    return next(ink for ink in inks if text.contrast(ink, QColor(theme.panel)) >= READ)


def number_of(value: float | None, span: float) -> str:
    """A value with as many decimals as can be told apart on its axis; a dash for none."""
    if value is None:
        return "\N{EN DASH}"
    if not 1e-4 <= span < 1e5:
        return text.signed(f"{value:.2e}")
    power = math.floor(math.log10(span))
    decimals = max(3 - power, 0) if power >= 0 else 2 - power
    return text.signed(f"{value:.{decimals}f}")


def _lines(lane: Lane) -> tuple[int, float]:
    """How many lines of text each channel of a lane has room for, and the height of one."""
    room = (lane.height - 2) / len(lane.channels)
    rows = 2 if room >= 2 * LEAST else 1
    return rows, max(min(LINE, room / rows), LEAST if rows == 2 else SMALLEST)


def tagged(lane: Lane, channels: Sequence[Channel], left: float, right: float) -> bool:
    """Whether the values of a lane stand at the cursor: the gutter has no room for them.

    Parameters
    ----------
    lane : Lane
    channels : sequence of Channel
        All channels of the recording.
    left, right : float
        Where names start and where the gutter ends, in pixels.
    """
    return _lines(lane)[0] == 1 and not _behind_name(lane, channels, left, right)


def _behind_name(lane: Lane, channels: Sequence[Channel], left: float, right: float) -> bool:
    """Whether the value of a low lane stands behind the name, where unit and axis would be."""
    rows, line = _lines(lane)
    if rows == 2 or len(lane.channels) > 1:
        return False
    name = channels[lane.channels[0]].name
    return text.width(name, text.font(min(NAME, line), bold=True)) <= right - 8 - VALUE - left


def _spots(lane: Lane, left: float) -> list[tuple[int, float, float, float]]:
    """Channel, left end, height of its name and of its value in a lane; NaN without room."""
    rows, line = _lines(lane)
    first = lane.top + 1 + line / 2
    step = rows * line
    return [
        (column, left, first + i * step, first + i * step + line if rows == 2 else math.nan)
        for i, column in enumerate(lane.channels)
        if first + i * step + line / 2 <= lane.bottom + 1
    ]


def paint_names(
    painter: QPainter,
    lane: Lane,
    channels: Sequence[Channel],
    box: QRectF,
    left: float,
    theme: Colours,
) -> list[QRectF]:
    """Write the names of a lane's channels, and its unit where there is room for it.

    Returns
    -------
    list of QRectF
        What they and the values at the cursor take up.
    """
    size = min(NAME, _lines(lane)[1])
    small = text.font(min(NUMBER, size))
    alone = len(lane.channels) == 1
    behind = _behind_name(lane, channels, left, box.right())
    taken = []
    if not alone and lane.unit:
        wide = text.width(lane.unit, small)
        place = QRectF(box.right() - 6 - wide, lane.top + 2, wide, NUMBER)
        ink = QColor(theme.muted)
        text.put(painter, place.left(), place.center().y(), lane.unit, face=small, ink=ink)
        taken.append(place)
    for column, x, y, below in _spots(lane, left):
        room = box.width() - x - (6 if alone else VALUE)
        face = text.font(size, bold=True)
        name = channels[column].name
        if text.width(name, face) > room:
            face = small
        name = text.elided(name, face, room, middle=True)
        text.put(painter, x, y, name, face=face, ink=curve_ink(column, theme))
        used = text.width(name, face)
        if behind:
            taken.append(QRectF(box.right() - 6 - VALUE, y - NUMBER / 2, VALUE, NUMBER))
        elif alone and lane.unit and used + 5 + text.width(lane.unit, small) <= room:
            text.put(painter, x + used + 5, y, lane.unit, face=small, ink=QColor(theme.muted))
            used += 5 + text.width(lane.unit, small)
        taken.append(QRectF(x, y - size / 2, used + 3, size))
        if not math.isnan(below):
            taken.append(QRectF(x, below - NUMBER / 2, VALUE, NUMBER))
    return taken


def paint_values(
    painter: QPainter,
    lane: Lane,
    axis: Axis,
    channels: Sequence[Channel],
    values: Mapping[str, float | None],
    left: float,
    right: float,
    theme: Colours,
) -> None:
    """Write the values at the cursor below the names or behind them, where they have room."""
    face, ink = text.font(NUMBER), QColor(theme.text)
    behind = _behind_name(lane, channels, left, right)
    for column, x, beside, below in _spots(lane, left):
        shown = number_of(values.get(channels[column].name), axis.end - axis.start)
        if behind:
            shown = text.elided(shown, face, VALUE)
            text.put(painter, right - 6, beside, shown, face=face, ink=ink, align=1.0)
        elif not math.isnan(below):
            text.put(painter, x, below, shown, face=face, ink=ink)


def paint_tag(
    painter: QPainter,
    lane: Lane,
    axis: Axis,
    channels: Sequence[Channel],
    values: Mapping[str, float | None],
    cursor: float,
    plot: QRectF,
    theme: Colours,
) -> None:
    """Write the values of a lane at the cursor, each in the colour of its curve."""
    face = text.font(NUMBER)
    span = axis.end - axis.start
    shown = [(i, number_of(values.get(channels[i].name), span)) for i in lane.channels]
    wide = text.widest((number for _, number in shown), face) + 8
    high = len(shown) * (NUMBER + 2) + 2
    left = cursor + 5 if cursor + 5 + wide <= plot.right() else cursor - 5 - wide
    top = max(min(lane.top + 1, plot.bottom() - high), plot.top())
    if len(shown) == 1:  # in a low lane: it covers nothing of the next one's
        high = min(high, lane.height - 1)
        top = lane.middle - high / 2
    painter.fillRect(QRectF(left, top, wide, high), QColor(theme.background))
    for row, (column, number) in enumerate(shown):
        y = top + high * (row + 0.5) / len(shown)
        ink = curve_ink(column, theme)
        text.put(painter, left + wide - 4, y, number, face=face, ink=ink, align=1.0)


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
            name = text.elided(group, face, bottom - top)
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
