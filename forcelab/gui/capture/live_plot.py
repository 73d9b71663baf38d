"""The live view: one lane a channel over the last seconds, and the tracks below them."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QLineF, QRect, QRectF, QSize, Qt
from PySide6.QtGui import QBrush, QColor, QPainter, QPen
from PySide6.QtWidgets import QSizePolicy

from forcelab.arrays import Real
from forcelab.capture.align import FORCE_NAME
from forcelab.demonstration import GAP_PERIODS, Channel
from forcelab.gui.capture.controller import CaptureController, CaptureState
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import NUMBER, Axis, labels, ticks
from forcelab.gui.figures.colormap import translucent
from forcelab.gui.figures.tracks import FadeOverlay, fade_overlays, paint_track
from forcelab.gui.kit import text_size
from forcelab.gui.kit.plot import PlotView, ValueAxis
from forcelab.gui.kit.traces import Trace, column_edges
from forcelab.gui.label.lanes import (
    LANE_GAP,
    LARGEST_VALUE,
    NAME,
    NAMES_LEFT,
    Lane,
    LaneAxis,
    Values,
    group_of,
    lanes,
    paint_borders,
    paint_groups,
    span_of,
)
from forcelab.gui.label.swatches import style_of
from forcelab.gui.theme import colours
from forcelab.labels import Segment
from forcelab.signals.minmax import Extremes, run_extremes

if TYPE_CHECKING:
    from forcelab.capture.recorder import RecorderState


#: A step between samples of fewer seconds is no gap, however many periods that are.
GAP = 0.02
#: Least span of a lane, so that noise looks like noise: in units of force and torque, of a force in
#: raw counts, and of anything else; share of it that is left free at either end.
SMALLEST_SPANS = {
    "N": 0.2, "mN": 200.0, "kN": 2e-4, "g": 20.0, "kg": 0.02,
    "Nm": 0.01, "N m": 0.01, "Nmm": 10.0, "N mm": 10.0, "mNm": 10.0, "mN m": 10.0,
}  # fmt: skip
COUNTS, LEAST, FREE = 100.0, 0.2, 0.12
#: A lane is scaled down where less than this share of it was needed for so many seconds.
NEEDED, CALM = 0.4, 2.0


def pixel_columns(times: Real, values: Real, edges: Real, holds: bool = False) -> Extremes:
    """The least and the greatest value of each channel in each column, shape (k, c).

    `times` (s) increase, though a little jitter does no harm; `values` have shape (n, c), `edges`
    of columns (s) shape (k + 1,). Where it `holds`, a value holds until the next one, however long
    that takes. NaN where a column holds nothing. A column begins with the sample before it, so that
    its line joins up with its neighbour's; not across a gap.
    """
    n = len(times)
    places = np.maximum.accumulate(np.searchsorted(times, edges))
    first, last = places[:-1], places[1:]
    joined = first > 0
    if not holds:
        period = float(np.median(np.diff(times[-200:]))) if n > 1 else 0.0
        steps = np.diff(times, prepend=-np.inf, append=np.inf)  # before each sample
        joined &= steps[first] <= max(GAP_PERIODS * period, GAP)
    return run_extremes(values, first - joined, last)


def smallest_span(channel: Channel) -> float:
    """The least span of a channel's lane, in its unit: what noise is small in."""
    if not channel.unit and FORCE_NAME.fullmatch(channel.name):
        return COUNTS
    return SMALLEST_SPANS.get(channel.unit, LEAST)


class LaneScale:
    """The span of a lane: grows at once, and shrinks only after a while."""

    def __init__(self, least: float = LEAST) -> None:
        """`least` is the least span, see :func:`smallest_span`."""
        self._least = least
        #: Values at the lane's lower and upper edge.
        self.low, self.high = -1.0, 1.0
        self._fresh = True
        self._needed_at = -np.inf

    def fit(self, low: float, high: float, now: float) -> None:
        """Take in the least and the greatest value in view at `now` (s)."""
        low, high = max(low, -LARGEST_VALUE), min(high, LARGEST_VALUE)
        span = max(high - low, self._least)
        if span >= NEEDED * (self.high - self.low):
            self._needed_at = now
        exceeds = low < self.low or high > self.high
        if self._fresh or exceeds or now - self._needed_at > CALM:
            middle, half = (low + high) / 2, (0.5 + FREE) * span
            if exceeds and not self._fresh and now - self._needed_at <= CALM:
                self.low = min(self.low, middle - half)
                self.high = max(self.high, middle + half)
            else:
                self.low, self.high = middle - half, middle + half
            self._fresh, self._needed_at = False, now


#: Seconds that are shown. Pixels left of them for names, values and numbers, and how many of these
#: are the numbers' alone; right of them, where half of the ruler's last number stands.
SECONDS = 10.0
GUTTER, NUMBERS, RIGHT = 140, 48, 10
#: Pixels: height of the ruler and of a row of labels, the least height of a lane, and what is free
#: above and below its curve.
RULER, ROW_HEIGHT, LEAST_LANE, INSET = 18, 20, 24, 3.0
#: Pixels at least between two numbers of a lane; and from the axes to the lanes, as Qt draws again
#: what is closer to what moves.
BREATH, APART = 4.0, 2


class LivePlot(PlotView):
    """A view of the last seconds; they are drawn anew whenever there may be new samples.

    The x axis of its boxes are seconds before now.
    """

    def __init__(self, controller: CaptureController) -> None:
        super().__init__()
        self._controller = controller
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.scene().sigPrepareForPaint.connect(self.follow)
        controller.ticked.connect(self._ticked)
        controller.changed.connect(self._changed)

    def add_box(self, *, zooms: bool = False, inverted: bool = False) -> pg.ViewBox:
        box = super().add_box(zooms=zooms, inverted=inverted)
        box.setXRange(-SECONDS, 0.0, padding=0)
        return box

    @abstractmethod
    def follow(self) -> None:
        """Take what is newest; before each painting."""

    @abstractmethod
    def _changed(self) -> None:
        """Devices were connected or released, or a recording has begun or ended."""

    def _ticked(self) -> None:
        if self.isVisible():
            self.update(QRect(gutter(), 0, self.width() - gutter(), self.height()))


def gutter() -> int:
    """Pixels left of the seconds."""
    return round(text_size.pixels(GUTTER))


def plot_width(width: float) -> float:
    """Pixels of the seconds in a view of a width."""
    return max(width - gutter() - RIGHT, 50.0)


def _ruler_height() -> int:
    return round(text_size.pixels(RULER))


def _row_height() -> int:
    """Pixels of a row of labels."""
    return round(text_size.pixels(ROW_HEIGHT))


def lane_ticks(low: float, high: float, height: float) -> tuple[float, tuple[float, ...]]:
    """A step, and two of its multiples at least that have room, with those between them.

    `low` and `high` are the ends of a lane's axis, `height` is in pixels.
    """
    power, pixel = math.ceil(math.log10(high - low)), (high - low) / height
    room = min(text_size.pixels(NUMBER) + BREATH, 0.8 * height) * pixel
    while True:
        for step in (5 * 10.0**power, 2 * 10.0**power, 10.0**power):
            values = ticks(low, high, step)
            if len(values) > 1 and values[-1] - values[0] >= room:
                return step, values if step >= room else (values[0], values[-1])
        power -= 1


class LiveAxis(LaneAxis):
    """The axis of a lane: two numbers at least, all of them inside of it, and the latest value."""

    def __init__(self, values: Callable[[], Values]) -> None:
        super().__init__(gutter() - APART, values, text_size.pixels(NUMBERS))
        self.setStyle(hideOverlappingLabels=False, tickLength=3)

    def tickValues(
        self, minVal: float, maxVal: float, size: float
    ) -> list[tuple[float, tuple[float, ...]]]:
        return [lane_ticks(minVal, maxVal, size)]

    def tickStrings(self, values: Sequence[float], scale: float, spacing: float) -> list[str]:
        return list(labels(tuple(values), spacing))

    def generateDrawSpecs(self, p: QPainter) -> Any:
        specs = super().generateDrawSpecs(p)
        for box, *_ in specs[2] if specs is not None else ():
            box.moveTop(min(max(box.top(), 0.0), self.lane.height - box.height()))
        return specs


class LiveTrace(Trace):
    """The curve of a channel over the last seconds."""

    def __init__(self, view: LiveView, column: int) -> None:
        super().__init__(view.add_box(), column)
        self._view, self.axis = view, LiveAxis(lambda: view.readings)
        self.axis.linkToView(self.box)
        view.addItem(self.axis)

    def version(self) -> object:
        return self._view.now

    def extremes(self, edges: Real) -> Extremes:
        return self._view.extremes(edges)[self._column]


class LiveView(LivePlot):
    """A lane for each channel of the devices, and below them what is marked and predicted."""

    def __init__(self, controller: CaptureController) -> None:
        #: The time (s, of the host's clock) up to which samples are drawn.
        self.now = 0.0
        #: The latest value of each channel that is read now.
        self.readings: dict[str, float] = {}
        self._state: RecorderState | None = None
        self._channels: tuple[Channel, ...] = ()
        self._lanes: tuple[Lane, ...] = ()
        self.traces: list[LiveTrace] = []  # hidden and used again, as boxes are never removed
        self._scales: dict[int, LaneScale] = {}
        #: Times and values of each device, and whether a value holds until the next one.
        self._windows: list[tuple[Real, Real, bool]] = []
        self._drawn: tuple[object, list[Extremes]] | None = None
        super().__init__(controller)
        self.setAccessibleName("Live channels")
        self._ruler = ValueAxis("bottom")
        self._ruler.setStyle(hideOverlappingLabels=False, maxTextLevel=0, tickLength=-4)
        self._ruler.setRange(-SECONDS, 0.0)
        self.addItem(self._ruler)
        controller.recognition.changed.connect(self._changed)  # it has a row, or none
        self._changed()

    # Where things are

    @property
    def plot(self) -> QRectF:
        """The area of the lanes, in pixels of the widget."""
        below = self._rows_height + _ruler_height()
        return QRectF(gutter(), 0, plot_width(self.width()), max(self.height() - below, 1))

    @property
    def _rows_height(self) -> int:
        """Pixels of all rows: the prediction has one only while a recogniser is chosen."""
        return _row_height() * (2 if self._controller.recognition.selection is not None else 1)

    def sizeHint(self) -> QSize:
        """Room for six lanes."""
        return QSize(520, 6 * 56 + _row_height() + _ruler_height())

    def minimumSizeHint(self) -> QSize:
        """The least room for the present lanes."""
        groups = {group_of(channel.name) for channel in self._channels}
        lane = round(text_size.pixels(LEAST_LANE))
        room = max(len(self._channels), 4) * lane + len(groups) * int(LANE_GAP)
        return QSize(280, room + self._rows_height + _ruler_height())

    def place(self) -> None:
        """Lay out a lane for each channel, with its axis and its curve, and the ruler."""
        plot, names = self.plot, [channel.name for channel in self._channels]
        self._lanes = lanes(self._channels, names, plot.height(), overlaid=False)
        while len(self.traces) < len(self._lanes):
            self.traces.append(LiveTrace(self, len(self.traces)))
        for column, trace in enumerate(self.traces):
            for item in (trace.box, trace.axis):
                item.setVisible(column < len(self._lanes))
        for lane in self._lanes:
            trace = self.traces[lane.channels[0]]
            trace.box.setGeometry(QRectF(plot.left(), lane.top, plot.width(), lane.height))
            trace.axis.set_room(gutter() - APART, text_size.pixels(NUMBERS))
            trace.axis.show_lane(lane, self._channels)
        high = _ruler_height()
        self._ruler.setGeometry(plot.left(), self.height() - high, plot.width(), high)
        self._ruler.setVisible(bool(self._lanes))
        self.now, self._drawn = 0.0, None
        self.invalidate()

    # What comes

    def follow(self) -> None:
        """Read the newest samples, and let the lanes hold them."""
        controller = self._controller
        recorder, state = controller.recorder, controller.state
        if recorder is None or state is None or self.now == controller.now or not self._lanes:
            return
        self.now, self._windows = controller.now, []
        latest: list[float] = []
        for device, (_, times, values) in zip(state.devices, recorder.latest(SECONDS), strict=True):
            holds = device.rate == 0 and math.isnan(device.residual)
            self._windows.append((times, values, holds))
            absent = {"unplugged", "stalled"} & set(device.alarms) or not len(times)
            latest += [math.nan] * values.shape[1] if absent else values[-1].tolist()
        read = zip(self._channels, latest, strict=True)
        self.readings = {channel.name: value for channel, value in read if math.isfinite(value)}
        _, edges = column_edges(self.traces[0].box, self.devicePixelRatioF())
        for lane in self._lanes:
            (column,) = lane.channels
            least = smallest_span(self._channels[column])
            scale = self._scales.setdefault(column, LaneScale(least))
            span = span_of(self.extremes(edges)[column])
            if span is not None:
                scale.fit(*span, self.now)
            free = INSET * (scale.high - scale.low) / max(lane.height - 2 * INSET, 1.0)
            low, high = scale.low - free, scale.high + free
            box = self.traces[column].box
            if box.viewRange()[1] != [low, high]:
                box.setYRange(low, high, padding=0)
                self.resetCachedContent()  # its line at zero is elsewhere

    def extremes(self, edges: Real) -> list[Extremes]:
        """The extremes of each channel between edges in seconds before now, found together."""
        key = edges[0], len(edges), self.now
        if self._drawn is None or self._drawn[0] != key:
            # They stand at multiples of a column's width: a curve moves and does not shimmer.
            step = (edges[-1] - edges[0]) / (len(edges) - 1)
            edges = edges + math.floor(self.now / step) * step
            found = (pixel_columns(*window[:2], edges, window[2]) for window in self._windows)
            pairs = chain.from_iterable(zip(each.low.T, each.high.T, strict=True) for each in found)
            self._drawn = key, [Extremes(*pair) for pair in pairs]
        return self._drawn[1]

    def _ticked(self) -> None:
        super()._ticked()
        state = self._controller.state
        if state is not self._state:
            self._state = state
            self.update()  # with the readings: more often, nobody could read them
        if not self._channels and state is not None:
            self._changed()  # it is known by now how the devices do

    def _changed(self) -> None:
        controller = self._controller
        known = controller.connected and controller.state is not None
        self._channels = controller.connection.channels if known else ()
        if not controller.connected:
            self._scales.clear()
        self.updateGeometry()
        self.place()

    # Drawing

    def paint_background(self, painter: QPainter) -> None:
        """Draw the gutter, lines at zero, and borders of lanes."""
        theme, plot = colours(), self.plot
        if not self._lanes:
            return
        painter.fillRect(QRectF(0, 0, gutter(), self.height()), QColor(theme.panel))
        paint_groups(painter, self._lanes)
        painter.setPen(QPen(QColor(theme.grid), 1))
        for lane in self._lanes:
            low, high = self.traces[lane.channels[0]].box.viewRange()[1]
            if low < 0 < high:
                y = round(lane.bottom + low / (high - low) * lane.height) + 0.5
                painter.drawLine(QLineF(plot.left(), y, plot.right(), y))
        paint_borders(painter, self._lanes, plot)
        face, ink = text_size.font(NUMBER), QColor(theme.muted)
        y = self.height() - text_size.pixels(RULER - 10)
        text.draw_text(painter, gutter() - 20, y, "s", face=face, ink=ink, align=1.0)

    def paint_foreground(self, painter: QPainter) -> None:
        """Draw rows of labels, the countdown, and what to do while nothing is connected."""
        controller, theme, plot = self._controller, colours(), self.plot
        if self._channels:
            axis = Axis(controller.now - SECONDS, controller.now, plot.left(), plot.right())
            self._paint_recording(painter, plot, axis)
            self._paint_rows(painter, plot, axis)
        elif controller.phase is CaptureState.CONNECTING:
            self._paint_centred(painter, "Connecting…", theme.muted)
        elif not controller.connected:
            invitation = "Select devices on the left and press Connect; their signals appear here."
            self._paint_centred(painter, invitation, theme.muted)
        if controller.phase is CaptureState.COUNTDOWN:
            face = self.font()
            face.setPointSizeF(face.pointSizeF() * 8)
            face.setBold(True)
            painter.setFont(face)
            self._paint_centred(painter, str(controller.seconds_left), theme.accent)

    def _paint_centred(self, painter: QPainter, line: str, colour: str) -> None:
        painter.setPen(QColor(colour))
        box = self.rect().adjusted(24, 24, -24, -24)
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap, line)

    def _paint_recording(self, painter: QPainter, plot: QRectF, axis: Axis) -> None:
        """Show since when it is recorded."""
        controller = self._controller
        if not controller.recording or controller.recorder is None:
            return
        left = max(axis.at(controller.recorder.begun), plot.left())
        wash = translucent(colours().trouble, 0.07)
        painter.fillRect(QRectF(left, 0, plot.right() - left, plot.height()), wash)
        if left > plot.left():
            painter.setPen(QPen(QColor(colours().trouble), 1))
            painter.drawLine(QLineF(left, 0, left, plot.height()))

    def _paint_rows(self, painter: QPainter, plot: QRectF, axis: Axis) -> None:
        """Draw the rows of marks and predictions below the lanes."""
        recognition, marks = self._controller.recognition, self._controller.marks
        box = QRectF(plot.left(), plot.bottom() + 1, plot.width(), _row_height() - 2)
        self._paint_row(painter, "Marks", box, axis, marks.track(axis.end, axis.start))
        if recognition.selection is None:
            return
        box, snapshot = box.translated(0, _row_height()), recognition.track.snapshot
        if snapshot is None:
            self._paint_row(painter, "Predicted", box, axis, [])
            return
        segments = [segment for segment in snapshot.segments if segment.end > axis.start]
        fading: tuple[FadeOverlay, ...] = ()
        if snapshot.probability_trace is not None:
            fading = fade_overlays(snapshot.probability_trace, tuple(segments), axis, box)
        self._paint_row(painter, "Predicted", box, axis, segments, fading)
        recognition.record_painted(snapshot.until)
        until = snapshot.until
        if math.isnan(until) and segments:  # begun anew: what was said before stays
            until = segments[-1].end
        left = box.left() if math.isnan(until) else max(axis.at(until), box.left())
        if left < box.right():  # what no label can be known of yet is not unlabelled
            rest = QRectF(left, box.top() + 1, box.right() - left, box.height() - 2)
            painter.fillRect(rest, QColor(colours().panel))
            ink = translucent(colours().muted, 0.5)
            painter.fillRect(rest, QBrush(ink, Qt.BrushStyle.BDiagPattern))

    def _paint_row(
        self,
        painter: QPainter,
        name: str,
        box: QRectF,
        axis: Axis,
        segments: list[Segment],
        fading: tuple[FadeOverlay, ...] = (),
    ) -> None:
        """Draw a row of labels, and into the gutter what they are."""
        vocabulary = self._controller.display_vocabulary
        styles = {s.action: style_of(vocabulary, s.action) for s in segments}
        theme = replace(colours(), text=colours().on_unlabelled)
        painter.save()
        painter.setClipRect(box)
        paint_track(painter, box, axis, segments, styles=styles, theme=theme, fades=fading)
        painter.restore()
        face, ink = text_size.font(NAME), QColor(colours().muted)
        text.draw_text(painter, NAMES_LEFT, box.center().y(), name, face=face, ink=ink)
