"""Lanes of channels: their layout and axes, and their curves as columns of pixels.

Qt takes 15 ms for six jagged polylines of 3200 points, and 50 ms for six smooth ones of 50; to
fill columns takes 2 ms for either, and is smooth.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from itertools import groupby, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QBrush, QColor, QImage, QPainter, QPen, QPolygonF

from forcelab.demonstration import Channel
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis
from forcelab.gui.figures.colormap import mixed, translucent
from forcelab.gui.theme import Colours
from forcelab.gui.time_panel import TimePanel
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
        result.append(Lane(members, group, channels[members[0]].unit, top, top + each))
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


#: Thickness of curves and side of the squares at samples, in pixels of the widget.
THICKNESS = 1.2
DOT = 3.0
#: A curve that fills less than one in so many pixels of its height is filled pixel by pixel.
THIN = 10

Real = NDArray[np.float64]


class Curve(NamedTuple):
    """A curve: the extremes of each column, its axis to pixels, its colour.

    Nothing is drawn outside of `box`, the top and bottom of its lane in pixels.
    """

    extremes: Extremes
    axis: Axis
    colour: QColor
    box: tuple[float, float]


def fill_columns(
    pixels: NDArray[np.uint32],
    top: Real,
    bottom: Real,
    colours: Sequence[QColor],
    lanes: Sequence[tuple[int, int]],
) -> None:
    """Fill each column of k lanes of an image from one height to another, in place.

    The image has shape (h, w), is contiguous and premultiplied by its alpha. Heights, shape (k, w),
    are in pixels from the top of each lane, not necessarily inside of it; NaN leaves a column as it
    is, and a pixel that is covered in part gets as much of the colour. `lanes` are the first row of
    each and the one after its last; they do not overlap.
    """
    height = np.array([last - first for first, last in lanes])[:, np.newaxis]
    filled = ~np.isnan(top)
    # Clipped while still floats: heights far outside do not fit into whole numbers.
    top = np.clip(np.where(filled, top, height + 1), -2, height + 1)
    bottom = np.clip(np.where(filled, bottom, -2), -2, height + 1)
    first, last = np.ceil(top).astype(np.int16), np.floor(bottom).astype(np.int16)
    begins = np.array([begin for begin, _ in lanes])
    rgb = np.array([colour.rgba() for colour in colours], dtype=np.uint32)
    _fill(pixels, np.maximum(first, 0), np.minimum(last, height), begins, rgb)
    within = last < first  # both ends in one pixel
    _tint(pixels, first - 1, np.where(within, bottom - top, first - top), height, begins, rgb)
    _tint(pixels, last, np.where(within, 0.0, bottom - last), height, begins, rgb)


def _fill(
    pixels: NDArray[np.uint32],
    first: NDArray[np.int16],
    last: NDArray[np.int16],
    begins: NDArray[np.int64],
    rgb: NDArray[np.uint32],
) -> None:
    """Fill each column of each lane from one row up to another, in the quicker of two ways."""
    counts = np.maximum(last.astype(np.int64) - first, 0)
    thick = []
    for i, count in enumerate(counts):
        if (covered := int(count.sum())) == 0:
            continue
        top, end = int(first[i][count > 0].min()), int(last[i].max())
        if covered * THIN >= (end - top) * len(count):
            thick.append(i)
            lane = pixels[begins[i] + top : begins[i] + end]
            # A masked copy goes pixel by pixel; arithmetic takes many at once. As numbers without a
            # sign, rows above the first are far below the last.
            rows = np.arange(top, end, dtype=np.uint16)[:, np.newaxis]
            within = rows - first[i].view(np.uint16) < count.astype(np.uint16)
            change = lane ^ rgb[i]
            change *= within
            lane ^= change
    counts[thick] = 0
    ends = np.cumsum(counts)
    if ends[-1]:
        width = pixels.shape[1]
        above = begins[:, np.newaxis] + first - (ends.reshape(counts.shape) - counts)
        column = np.broadcast_to(np.arange(width), counts.shape)
        # A column's pixels lie a width apart: counted from the first of all pixels that are filled.
        base, lengths = (above * width + column).reshape(-1), counts.reshape(-1)
        places = np.repeat(base, lengths) + np.arange(ends[-1]) * width
        _flat(pixels)[places] = np.repeat(rgb, counts.sum(axis=1))


def _tint(
    pixels: NDArray[np.uint32],
    rows: NDArray[np.int16],
    shares: Real,
    height: NDArray[np.int64],
    begins: NDArray[np.int64],
    rgb: NDArray[np.uint32],
) -> None:
    """Cover a share of one pixel in each column of each lane, where nothing covers more of it.

    All lanes at once: numpy takes longer to begin than it does for the columns of one.
    """
    flat, width = _flat(pixels), pixels.shape[1]
    inside = (rows >= 0) & (rows < height) & (shares > 0.0)
    alpha = np.where(inside, np.minimum(shares * 255.0 + 0.5, 255.0), 0.0).astype(np.uint8)
    places = (np.where(inside, rows, 0) + begins[:, np.newaxis]) * width + np.arange(width)
    thinner = np.flatnonzero(flat[places] >> 24 < alpha)
    shades = np.stack([_shades(colour) for colour in rgb.tolist()]).reshape(-1)
    shade = alpha + 256 * np.arange(len(begins))[:, np.newaxis]
    flat[places.take(thinner)] = shades.take(shade.take(thinner))


def _flat(pixels: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """The pixels row after row, not copied."""
    assert pixels.flags.c_contiguous  # of others a reshape would be a copy
    return pixels.reshape(-1)


@lru_cache(maxsize=64)
def _shades(colour: int) -> NDArray[np.uint32]:
    """A colour at each alpha from 0 to 255, premultiplied by it; shape (256,)."""
    alpha = np.arange(256, dtype=np.uint32)
    shades: NDArray[np.uint32] = alpha << np.uint32(24)
    for place in (16, 8, 0):
        shades |= (np.uint32(colour >> place & 255) * alpha // np.uint32(255)) << np.uint32(place)
    return shades


class CurveCanvas:
    """A transparent image over the plot at the resolution of the screen."""

    def __init__(self, plot: QRectF, ratio: float) -> None:
        self.left, shape = _extent(plot, ratio)
        self.ratio = ratio
        self.pixels = np.zeros(shape, dtype=np.uint32)

    def cleared(self, plot: QRectF, ratio: float) -> CurveCanvas:
        """An empty one: this one if it fits, since new memory costs more than to clear it."""
        if (self.ratio, self.left, self.pixels.shape) != (ratio, *_extent(plot, ratio)):
            return CurveCanvas(plot, ratio)
        self.pixels.fill(0)
        return self

    @property
    def width(self) -> int:
        """Columns of the screen."""
        return self.pixels.shape[1]

    def edges(self) -> Real:
        """The edges of its columns in pixels of the widget, shape (width + 1,)."""
        return (self.left + np.arange(self.width + 1)) / self.ratio

    def draw(self, curves: Sequence[Curve]) -> None:
        """Draw curves; of those in one lane the later ones lie over the earlier ones."""
        left = list(curves)
        while left:
            # One of each lane at a time; lanes do not overlap.
            boxes = [curve.box for curve in left]
            fronts = [i for i, box in enumerate(boxes) if box not in boxes[:i]]
            self._draw_apart([left[i] for i in fronts])
            left = [curve for i, curve in enumerate(left) if i not in fronts]

    def _draw_apart(self, curves: Sequence[Curve]) -> None:
        """Draw curves of different lanes."""
        lanes, tops, bottoms = [], [], []
        half, height = THICKNESS / 2 * self.ratio, len(self.pixels)
        for extremes, axis, _, box in curves:
            first, last = (min(max(round(edge * self.ratio), 0), height) for edge in box)
            scale = (axis.finish - axis.begin) / (axis.end - axis.start) * self.ratio
            zero = axis.begin * self.ratio - axis.start * scale - first
            lanes.append((first, last))
            with np.errstate(over="ignore"):
                tops.append(extremes.high * scale + zero - half)
                bottoms.append(extremes.low * scale + zero + half)
        colours = [curve.colour for curve in curves]
        fill_columns(self.pixels, np.stack(tops), np.stack(bottoms), colours, lanes)

    def dots(
        self, x: Real, values: Real, axis: Axis, colour: QColor, box: tuple[float, float]
    ) -> None:
        """Draw a square at each sample; places in pixels of the widget, shape (n,)."""
        first, last = (max(round(edge * self.ratio), 0) for edge in box)
        finite = np.isfinite(values)
        with np.errstate(over="ignore"):
            share = (values[finite] - axis.start) / (axis.end - axis.start)
            y = (axis.begin + share * (axis.finish - axis.begin)) * self.ratio - first
        places = np.round(x[finite] * self.ratio - self.left - DOT * self.ratio / 2)
        side = round(DOT * self.ratio)
        for across, up in zip(places.tolist(), np.clip(y, -1e6, 1e6).tolist(), strict=True):
            left, top = int(across), round(up - side / 2)
            column = slice(max(left, 0), max(left + side, 0))
            row = slice(first + max(top, 0), min(first + max(top + side, 0), last))
            self.pixels[row, column] = colour.rgba()

    def paint(self, painter: QPainter) -> None:
        height, width = self.pixels.shape
        form = QImage.Format.Format_ARGB32_Premultiplied
        image = QImage(self.pixels.data, width, height, 4 * width, form)
        image.setDevicePixelRatio(self.ratio)
        painter.drawImage(QPointF(self.left / self.ratio, 0.0), image)


def _extent(plot: QRectF, ratio: float) -> tuple[int, tuple[int, int]]:
    """The first pixel of the screen that a plot covers, and its rows and columns of pixels."""
    left = round(plot.left() * ratio)
    across = max(int(np.ceil(plot.right() * ratio)) - left, 1)
    return left, (max(int(np.ceil(plot.height() * ratio)), 1), across)


#: Height of numbers, in pixels.
NUMBER = 10.0
#: So far may an axis' number stand from its value, in pixels.
TICK_OFFSET = 3.0
#: Width and height of the mark of a glitch, in pixels.
GLITCH = (9.0, 6.0)
#: The least contrast of a text to its ground (WCAG 2.2).
READABLE_CONTRAST = 4.5


def curve_colour(column: int, theme: Colours) -> QColor:
    """The colour of a channel: it depends on its place in the recording only."""
    return QColor(theme.curves[column % len(theme.curves)])


@cache
def curve_ink(column: int, theme: Colours) -> QColor:
    """The colour of a channel's name and values: its curve's, deepened until it can be read."""
    colour = curve_colour(column, theme)
    inks = (mixed(colour, theme.text, share / 20) for share in range(21))
    return next(ink for ink in inks if text.contrast(ink, QColor(theme.panel)) >= READABLE_CONTRAST)


def paint_notes(
    painter: QPainter, plot: QRectF, notes: Sequence[str], theme: Colours, *, at_left: bool
) -> None:
    """Write notes on the curves into a corner, one below the other."""
    face, y = text.font(10), plot.top() + 9
    ground = translucent(theme.background, 0.9)
    for note in notes:
        wide = text.width(note, face)
        right = plot.left() + wide + 10 if at_left else plot.right()
        painter.fillRect(QRectF(right - wide - 10, y - 7, wide + 8, 14), ground)
        text.draw_text(painter, right - 6, y, note, face=face, ink=QColor(theme.muted), align=1.0)
        y += 15


def paint_axis(
    painter: QPainter, lane: Lane, axis: Axis, x: float, taken: Sequence[QRectF], theme: Colours
) -> None:
    """Draw a lane's vertical axis at `x`, without the numbers that would overlap `taken` boxes."""
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
        inside = abs(middle - y) <= TICK_OFFSET and place.bottom() <= lane.bottom
        if inside and not any(place.intersects(other) for other in taken):
            ink = QColor(theme.muted)
            text.draw_text(painter, x - 6, middle, label, face=face, ink=ink, align=1.0)


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
        text.draw_text_upwards(painter, 8.0, middle, name, face=face, ink=ink, align=0.5)


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
    """Draw an arrow head at the edge of a lane for each glitch at pixels `x`, towards its value.

    `upwards` are those above the lane's axis; `box` is the lane's top and bottom in pixels.
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
