"""Lanes of channels: how they share the room, their vertical axes, names and values."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QRectF, Qt
from PySide6.QtGui import QBrush, QColor, QFont, QPainter, QPen
from PySide6.QtWidgets import QStyleOptionGraphicsItem, QWidget

from forcelab.demonstration import Channel
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import NUMBER, Axis
from forcelab.gui.figures.colormap import translucent
from forcelab.gui.kit import text_size
from forcelab.gui.kit.plot import ValueAxis
from forcelab.gui.kit.time_panel import TimePanel
from forcelab.gui.kit.traces import curve_ink
from forcelab.gui.theme import colours
from forcelab.signals.minmax import Extremes

#: Names such as fx1, Fx_left, force z 2; and such as x_acc.
_AXIS_LAST = re.compile(r"^(?P<kind>[a-z]+?)[ _.\-]?[xyz](?:[ _.\-]?(?P<sensor>\w+))?$", re.I)
_AXIS_FIRST = re.compile(r"^[xyz][ _.\-](?P<sensor>\w+)$", re.I)
_NUMBERED = re.compile(r"^.*\D[ _.\-]?(?P<sensor>\d+)$")

#: Free pixels above and below a curve in its lane, and between two groups of lanes.
LANE_MARGIN = 4.0
LANE_GAP = 5.0
#: Values beyond this are drawn at the edge: their span would be no number any more.
LARGEST_VALUE = 1e300


@dataclass(frozen=True, slots=True)
class Lane:
    """A strip of the panel with one y axis, from `top` to `bottom` in pixels.

    `channels` are indices into the recording's; `group` is their sensor, empty if it is not known.
    """

    channels: tuple[int, ...]
    group: str
    unit: str
    top: float
    bottom: float

    @property
    def height(self) -> float:
        return self.bottom - self.top

    @property
    def middle(self) -> float:
        return (self.top + self.bottom) / 2


def group_of(name: str) -> str:
    """The sensor of a channel by its name: ``1`` of ``fx1``, ``left`` of ``Fx_left``; or empty."""
    name = name.strip()
    for pattern in (_AXIS_LAST, _AXIS_FIRST, _NUMBERED):
        if match := pattern.match(name):
            return str(match["sensor"] or "").lower()
    return ""


def lanes(
    channels: Sequence[Channel], shown: Iterable[str], height: float, *, overlaid: bool
) -> tuple[Lane, ...]:
    """Share out the height (pixels) of the panel among the shown channels.

    There is one lane for each unit where they are `overlaid`; otherwise one for each channel,
    sensor after sensor.
    """
    names = set(shown)
    keyed: dict[str, list[int]] = {}
    for i, channel in enumerate(channels):
        if channel.name in names:
            keyed.setdefault(channel.unit if overlaid else group_of(channel.name), []).append(i)
    if overlaid:
        strips = [(tuple(members), "") for members in keyed.values()]
    else:
        strips = [((i,), group) for group, members in keyed.items() for i in members]
    breaks = len(keyed) - 1
    each = (height - breaks * LANE_GAP) / max(len(strips), 1)
    result: list[Lane] = []
    top = 0.0
    for members, group in strips:
        if result and (overlaid or result[-1].group != group):
            top += LANE_GAP
        # Whole pixels, on which images of curves lie sharp.
        edges = float(round(top)), float(round(top + each))
        result.append(Lane(members, group, channels[members[0]].unit, *edges))
        top += each
    return tuple(result)


def span_of(extremes: Extremes) -> tuple[float, float] | None:
    """The least and the greatest value of a curve; None where it has none."""
    has_values = ~np.isnan(extremes.low)
    if not has_values.any():
        return None
    return float(extremes.low[has_values].min()), float(extremes.high[has_values].max())


def spanning(ranges: Iterable[tuple[float, float] | None]) -> tuple[float, float] | None:
    """The smallest range that holds all given ranges; None for none."""
    spans = [span for span in ranges if span is not None]
    return (min(low for low, _ in spans), max(high for _, high in spans)) if spans else None


def axis_of(lane: Lane, span: tuple[float, float] | None) -> Axis:
    """The vertical axis of a lane for values from the least to the greatest of `span`, if any."""
    low, high = span if span is not None else (0.0, 1.0)
    low, high = (min(max(value, -LARGEST_VALUE), LARGEST_VALUE) for value in (low, high))
    size = max(abs(low), abs(high))
    if high - low <= 1e-9 * size or size == 0.0:  # a constant lies in the middle of its lane
        low, high = low - (0.1 * size or 1.0), high + (0.1 * size or 1.0)
    margin = min(LANE_MARGIN, lane.height / 6)
    return Axis(low, high, lane.bottom - margin, lane.top + margin)


#: Heights of names and of a line of text, in pixels.
NAME, LINE = 11.0, 14.0
#: Least height of a line of two and of a line alone.
TWO_LINES, ONE_LINE = 11.0, 9.0
#: Where names start, with and without the brackets of groups left of them.
NAMES_BESIDE_BRACKET, NAMES_LEFT = 20.0, 6.0
#: Width of a value at the cursor: names and values end where the axis' numbers may begin.
VALUE_WIDTH = 40.0
#: A value from here on, as a glitch beyond its axis has, is written with a power of ten.
LARGEST_PLAIN = 1e9


def number_format(value: float | None, span: float) -> str:
    """A value with as many decimals as can be told apart on its axis; a dash for none."""
    if value is None:
        return "\N{EN DASH}"
    if not 1e-4 <= span < 1e5 or abs(value) >= LARGEST_PLAIN:
        return text.signed(f"{value:.2e}")
    power = math.floor(math.log10(span))
    decimals = max(3 - power, 0) if power >= 0 else 2 - power
    return text.signed(f"{value:.{decimals}f}")


Values = Mapping[str, float | None]
"""The value of each channel at the cursor; None where there is none."""


class LaneAxis(ValueAxis):
    """The vertical axis of a lane in a gutter of `width` pixels, with names and values beside it.

    In a high lane a value at the cursor stands below the name of its channel, in a low one behind
    it; where there is no room for it in the gutter, it stands at the cursor (:meth:`paint_tag`).
    `numbers` are pixels at the right that the axis' numbers have for themselves.
    """

    def __init__(self, width: float, values: Callable[[], Values], numbers: float = 0.0) -> None:
        self.lane = Lane((), "", "", 0.0, 0.0)
        self._names: dict[int, str] = {}
        self._among: tuple[str, ...] = ()
        self._left, self._values = NAMES_LEFT, values
        super().__init__("left")
        self.set_room(width, numbers)

    def set_room(self, width: float, numbers: float = 0.0) -> None:
        """Have a gutter of another width."""
        self._width, self._right = width, width - numbers
        self.setWidth(width)

    def show_lane(self, lane: Lane, channels: Sequence[Channel]) -> None:
        """Stand beside a lane of these of a recording's channels."""
        self.lane = lane
        self._names = {column: channels[column].name for column in lane.channels}
        self._among = tuple(channel.name for channel in channels)
        self._left = text_size.pixels(NAMES_BESIDE_BRACKET) if lane.group else NAMES_LEFT
        self.setGeometry(QRectF(0, lane.top, self._width, lane.height))
        self.picture = None
        self.update()

    @property
    def tagged(self) -> bool:
        """Whether the values stand at the cursor: the gutter has no room for them.

        In a lane that is lower than a number they stand nowhere.
        """
        return (
            self._lines[0] == 1
            and not self._behind_name
            and self.lane.height > text_size.pixels(NUMBER)
        )

    def taken(self) -> list[QRectF]:
        """Where names and values stand."""
        return [box for *_, box in self.texts({})]

    def paint(
        self, p: QPainter, opt: QStyleOptionGraphicsItem, widget: QWidget | None = None
    ) -> None:
        super().paint(p, opt, widget)
        for line, face, ink, box in self.texts(self._values()):
            text.draw_text(p, box.left(), box.center().y(), line, face=face, ink=ink)

    def paint_tag(self, painter: QPainter, cursor: float, plot: QRectF) -> None:
        """Write the values at the cursor's pixel, each in the colour of its curve."""
        lane, face, line = self.lane, text_size.font(NUMBER), text_size.pixels(NUMBER) + 2
        values = self._values()
        shown = [(column, self._number(column, values)) for column in lane.channels]
        wide = text.widest((number for _, number in shown), face) + 8
        high = len(shown) * line + 2
        left = cursor + 5 if cursor + 5 + wide <= plot.right() else cursor - 5 - wide
        top = max(min(lane.top + 1, plot.bottom() - high), plot.top())
        if len(shown) == 1:  # in a low lane: it covers nothing of the next one's
            high = min(high, lane.height - 1)
            top = lane.middle - high / 2
        painter.fillRect(QRectF(left, top, wide, high), QColor(colours().background))
        for row, (column, number) in enumerate(shown):
            y = top + high * (row + 0.5) / len(shown)
            ink = curve_ink(column, colours())
            text.draw_text(painter, left + wide - 4, y, number, face=face, ink=ink, align=1.0)

    def texts(self, values: Values) -> Iterator[tuple[str, QFont, QColor, QRectF]]:
        """Names, unit and values with the boxes they stand in, in pixels of the axis."""
        lane, right = self.lane, self._right
        rows, line = self._lines
        muted, alone = QColor(colours().muted), len(lane.channels) == 1
        high, value_width = text_size.pixels(NUMBER), text_size.pixels(VALUE_WIDTH)
        size = min(text_size.pixels(NAME), line)
        small, number = text.font(min(high, size)), text.font(high)
        if lane.unit and not alone:
            unit = text.elided(lane.unit, small, value_width)
            wide = text.width(unit, small)
            yield unit, small, muted, QRectF(right - 6 - wide, 2, wide, high)
        for i, column in enumerate(lane.channels):
            y = 1 + line / 2 + i * rows * line
            if y + line / 2 > lane.height + 1:
                break
            face, ink = text.font(size, bold=True), curve_ink(column, colours())
            room = right - self._left - (6 if alone else value_width)
            if text.width(self._names[column], face) > room:
                face = small
            name = text.elided_name(self._names[column], face, room, self._among)
            used = text.width(name, face)
            yield name, face, ink, QRectF(self._left, y - size / 2, used + 3, size)
            shown = self._number(column, values)
            if rows == 2:
                below = QRectF(self._left, y + line - high / 2, value_width, high)
                yield shown, number, QColor(colours().text), below
            elif self._behind_name:
                shown = text.elided(shown, number, value_width)
                wide = text.width(shown, number) if values else value_width
                behind = QRectF(right - 6 - wide, y - high / 2, wide, high)
                yield shown, number, QColor(colours().text), behind
            wide = text.width(lane.unit, small)
            if alone and lane.unit and not self._behind_name and used + 5 + wide <= room:
                box = QRectF(self._left + used + 5, y - size / 2, wide + 3, size)
                yield lane.unit, small, muted, box

    @property
    def _lines(self) -> tuple[int, float]:
        """How many lines of text each channel has room for, and the height of one."""
        room = (self.lane.height - 2) / len(self.lane.channels)
        line, two_lines, one_line = map(text_size.pixels, (LINE, TWO_LINES, ONE_LINE))
        rows = 2 if room >= 2 * two_lines else 1
        return rows, max(min(line, room / rows), two_lines if rows == 2 else one_line)

    @property
    def _behind_name(self) -> bool:
        """Whether the value of a low lane stands behind the name, where unit and axis would be."""
        rows, line = self._lines
        if rows == 2 or len(self.lane.channels) > 1:
            return False
        face = text.font(min(text_size.pixels(NAME), line), bold=True)
        wide = text.width(self._names[self.lane.channels[0]], face)
        return wide <= self._right - 8 - text_size.pixels(VALUE_WIDTH) - self._left

    def _number(self, column: int, values: Values) -> str:
        return number_format(values.get(self._names[column]), self.range[1] - self.range[0])


def paint_notes(painter: QPainter, plot: QRectF, notes: Sequence[str], *, at_left: bool) -> None:
    """Write notes on the curves into a corner, one below the other."""
    face, y, line = text_size.font(10), plot.top() + text_size.pixels(9), text_size.pixels(14)
    ground, ink = translucent(colours().background, 0.9), QColor(colours().muted)
    for note in notes:
        wide = text.width(note, face)
        right = plot.left() + wide + 10 if at_left else plot.right()
        painter.fillRect(QRectF(right - wide - 10, y - line / 2, wide + 8, line), ground)
        text.draw_text(painter, right - 6, y, note, face=face, ink=ink, align=1.0)
        y += line + 1


def paint_borders(painter: QPainter, lanes: Sequence[Lane], plot: QRectF) -> None:
    """Draw a line between two lanes of a sensor, and a stripe between two sensors."""
    painter.setPen(QPen(QColor(colours().panel_edge), 1))
    for lane, following in pairwise(lanes):
        y = round(lane.bottom) + 0.5
        painter.drawLine(QLineF(plot.left(), y, plot.right(), y))
        if following.top > lane.bottom:
            box = QRectF(plot.left(), lane.bottom, plot.width(), following.top - lane.bottom)
            painter.fillRect(box, QColor(colours().panel))


def paint_groups(painter: QPainter, lanes: Sequence[Lane]) -> None:
    """Draw a bracket along the lanes of each sensor, with its name where there is room."""
    face, left = text_size.font(NUMBER), round(text_size.pixels(15)) + 0.5
    for group, members in groupby(lanes, key=lambda lane: lane.group):
        strips = list(members)
        top, bottom = strips[0].top + 3, strips[-1].bottom - 3
        if not group or bottom - top < text_size.pixels(NUMBER):
            continue
        painter.setPen(QPen(QColor(colours().frame), 1.0))
        painter.drawLines(
            [
                QLineF(left, top, left, bottom),
                QLineF(left, top, left + 2.5, top),
                QLineF(left, bottom, left + 2.5, bottom),
            ]
        )
        # A letter alone is hard to read upwards: an l looks like a dash.
        name = f"sensor {group}" if group.isdigit() or len(group) == 1 else group
        if text.width(name, face) > bottom - top:
            name = text.elided_name(group, face, bottom - top)
        middle = (top + bottom) / 2
        ink = QColor(colours().muted)
        text.draw_text_upwards(painter, left / 2, middle, name, face=face, ink=ink, align=0.5)


def paint_gaps(
    painter: QPainter, panel: TimePanel, gaps: NDArray[np.float64], plot: QRectF
) -> None:
    """Hatch the visible gaps, shape (2, g) in seconds; those closer than a pixel become one."""
    document, slope = panel.document, panel.seconds_per_pixel
    first = int(np.searchsorted(gaps[1], document.view.start))
    last = int(np.searchsorted(gaps[0], document.view.end))
    if first >= last:
        return
    left, right = plot.left() + (gaps[:, first:last] - document.view.start) / slope
    left, right = np.maximum(left, plot.left() - 1), np.minimum(right, plot.right() + 1)
    middle = (left + right) / 2
    half = np.maximum((right - left) / 2, 0.5)
    left, right = middle - half, middle + half
    opens = np.flatnonzero(np.append(True, left[1:] > np.maximum.accumulate(right)[:-1] + 1.0))
    ends = np.maximum.accumulate(right)[np.append(opens[1:], len(left)) - 1]
    hatch = QBrush(QColor(colours().frame), Qt.BrushStyle.BDiagPattern)
    wash = QColor(colours().panel)
    for a, b in zip(left[opens].tolist(), ends.tolist(), strict=True):
        box = QRectF(a, plot.top(), b - a, plot.height())
        painter.fillRect(box, wash)
        painter.fillRect(box, hatch)
