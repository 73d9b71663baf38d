"""The live view: one lane a channel over the last seconds, and the tracks below them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QBrush, QColor, QFontMetrics, QFontMetricsF, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget

from forcelab.capture.reader import FORCE_NAME, DeviceState
from forcelab.demonstration import GAP_PERIODS, Channel
from forcelab.gui.capture.controller import CaptureController, CaptureState
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis, labels, ticks
from forcelab.gui.figures.colormap import translucent
from forcelab.gui.figures.tracks import FadeOverlay, LabelStyle, fade_overlays, paint_track
from forcelab.gui.label.lanes import Curve, CurveCanvas
from forcelab.gui.label.swatches import style_of
from forcelab.gui.theme import colours, themes
from forcelab.labels import Segment
from forcelab.signals.minmax import Extremes, run_extremes

Real = NDArray[np.float64]

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
        """Take in the least and the greatest value in view, NaN without any, at `now` (s)."""
        if not (np.isfinite(low) and np.isfinite(high)):
            return
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


#: Heights of the numbers in pixels, in lanes with room and in low ones; below this a lane is low.
SIZE, SMALL, LOW = 9.0, 8.0, 40.0
#: Length of a mark, and from its end to its number, in pixels.
MARK, SCALE_GAP = 3.0, 3.0


def scale_width() -> int:
    """Pixels that the numbers and their marks need."""
    return math.ceil(text.width("\N{MINUS SIGN}00.00", text.font(SIZE)) + MARK + SCALE_GAP + 6)


def lane_marks(axis: Axis, size: float) -> tuple[tuple[float, str], ...]:
    """Two values at least with their texts, and those between them where they have room.

    `size` is the height of the numbers in pixels.
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
    for value, label in marks:
        y = min(max(axis.at(value), box.top() + half), box.bottom() - half)
        text.draw_text(painter, left - SCALE_GAP, y, label, face=face, ink=ink, align=1.0)
    painter.restore()


#: Seconds that are shown, and the ruler's height in pixels.
SECONDS, RULER = 10.0, 20


def gutter(metrics: QFontMetrics) -> int:
    """Pixels at the left for names and numbers."""
    return 12 + metrics.horizontalAdvance("opening  −0000.0 Nmm") + scale_width()


def live_axis(now: float, plot: QRectF) -> Axis:
    """From seconds of the host's monotonic clock to pixels."""
    return Axis(now - SECONDS, now, plot.left(), plot.right())


def column_edges(now: float, width: int) -> NDArray[np.float64]:
    """Edges of columns of the screen in seconds.

    They stand at multiples of a column's width, so that a curve moves and does not shimmer.
    """
    step = SECONDS / width
    newest = math.floor(now / step)
    return (newest - width + np.arange(width + 1, dtype=np.float64)) * step


def paint_ruler(painter: QPainter, plot: QRectF, bottom: float) -> None:
    """Seconds before now."""
    painter.setPen(QColor(colours().muted))
    metrics = painter.fontMetrics()
    y = bottom - (RULER - metrics.capHeight()) / 2
    for ago in range(0, int(SECONDS) + 1, 2):
        x = plot.right() - ago / SECONDS * plot.width()
        text = "0 s" if not ago else f"\N{MINUS SIGN}{ago}"
        width = metrics.horizontalAdvance(text)
        left = min(x - width / 2, plot.right() - width - 4)
        painter.drawText(QPointF(left, y), text)


#: Height of a row in pixels.
TRACK_ROW_HEIGHT = 20


def rows_height(controller: CaptureController) -> int:
    """Pixels of all rows: the prediction has one only while a recogniser is chosen."""
    return TRACK_ROW_HEIGHT * (2 if controller.live_model.selection is not None else 1)


def paint_rows(
    painter: QPainter, controller: CaptureController, plot: QRectF, axis: Axis, now: float
) -> None:
    """Draw the rows of marks and predictions below a plot; `now` is in s of the host's clock."""
    marked = controller.marks.track(now, axis.start)
    box = QRectF(plot.left(), plot.bottom() + 1, plot.width(), TRACK_ROW_HEIGHT - 2)
    _paint_row(painter, controller, box, axis, marked, ())
    _paint_row_name(painter, box, "Marks")
    live_model = controller.live_model
    if live_model.selection is None:
        return
    box = box.translated(0, TRACK_ROW_HEIGHT)
    snapshot = live_model.track.snapshot
    if snapshot is None:
        _paint_row(painter, controller, box, axis, [], ())
    else:
        segments = [segment for segment in snapshot.segments if segment.end > axis.start]
        fading: tuple[FadeOverlay, ...] = ()
        if snapshot.probability_trace is not None:
            fading = fade_overlays(snapshot.probability_trace, tuple(segments), axis, box)
        _paint_row(painter, controller, box, axis, segments, fading)
        live_model.record_painted(snapshot.until)
        until = snapshot.until
        if math.isnan(until) and segments:  # begun anew: what was said before stays
            until = segments[-1].end
        _paint_undecided(painter, box, axis, until)
    _paint_row_name(painter, box, "Predicted")


def _paint_row(
    painter: QPainter,
    controller: CaptureController,
    box: QRectF,
    axis: Axis,
    segments: list[Segment],
    fading: tuple[FadeOverlay, ...],
) -> None:
    vocabulary = controller.display_vocabulary
    styles: dict[str, LabelStyle] = {s.action: style_of(vocabulary, s.action) for s in segments}
    theme = replace(colours(), text=colours().on_unlabelled)
    painter.save()
    painter.setClipRect(box)
    paint_track(painter, box, axis, segments, styles=styles, theme=theme, fades=fading)
    painter.restore()


def _paint_undecided(painter: QPainter, box: QRectF, axis: Axis, until: float) -> None:
    """Hatch what no label can be known of yet: it is not unlabelled."""
    left = box.left() if math.isnan(until) else max(axis.at(until), box.left())
    if left < box.right():
        rest = QRectF(left, box.top() + 1, box.right() - left, box.height() - 2)
        painter.fillRect(rest, QColor(colours().panel))
        ink = translucent(colours().muted, 0.5)
        painter.fillRect(rest, QBrush(ink, Qt.BrushStyle.BDiagPattern))


def _paint_row_name(painter: QPainter, box: QRectF, name: str) -> None:
    """Write what a row shows into the gutter."""
    painter.setPen(QColor(colours().muted))
    room = QRectF(8, box.top(), box.left() - 14, box.height())
    painter.drawText(room, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignLeft, name)


#: Pixels: what a lane is higher than its name at least, free space above and below a curve.
ROOM, INSET = 6, 3


class LiveView(QWidget):
    """Draws what comes from the devices, 30 times a second while it can be seen."""

    def __init__(self, controller: CaptureController) -> None:
        super().__init__()
        self._controller = controller
        self._scales: dict[tuple[int, int], LaneScale] = {}
        self.setAccessibleName("Live channels")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        controller.ticked.connect(self._ticked)
        controller.changed.connect(self._changed)
        themes().changed.connect(self.update)

    def sizeHint(self) -> QSize:
        """Room for six lanes."""
        return QSize(520, 6 * 56 + TRACK_ROW_HEIGHT + RULER)

    def minimumSizeHint(self) -> QSize:
        """The least room for the present lanes."""
        lanes = sum(len(device.channels) for device in self._devices())
        lane = self.fontMetrics().height() + ROOM
        return QSize(280, max(lanes, 4) * lane + rows_height(self._controller) + RULER)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw everything anew: everything has moved."""
        with QPainter(self) as painter:
            painter.fillRect(self.rect(), QColor(colours().background))
            if not self._controller.connected:
                self._paint_centred(painter, self._invitation(), colours().muted)
            else:
                self._paint_live(painter)
            if self._controller.phase is CaptureState.COUNTDOWN:
                face = self.font()
                face.setPointSizeF(face.pointSizeF() * 8)
                face.setBold(True)
                painter.setFont(face)
                self._paint_centred(painter, str(self._controller.seconds_left), colours().accent)
            if self.hasFocus():
                painter.setPen(QPen(QColor(colours().accent), 1))
                painter.setBrush(Qt.BrushStyle.NoBrush)
                painter.drawRect(QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5))

    def _devices(self) -> tuple[DeviceState, ...]:
        state = self._controller.state
        return () if state is None else state.devices

    def _ticked(self) -> None:
        if self.isVisible():
            self.update()

    def _changed(self) -> None:
        if not self._controller.connected:
            self._scales.clear()
        self.updateGeometry()
        self.update()

    def _invitation(self) -> str:
        """The text where nothing is connected."""
        if self._controller.phase is CaptureState.CONNECTING:
            return "Connecting…"
        return "Select devices on the left and press Connect; their signals appear here."

    def _paint_centred(self, painter: QPainter, text: str, colour: str) -> None:
        painter.setPen(QColor(colour))
        box = self.rect().adjusted(24, 24, -24, -24)
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap, text)

    def _paint_live(self, painter: QPainter) -> None:
        devices, recorder = self._devices(), self._controller.recorder
        windows = () if recorder is None else recorder.latest(SECONDS)
        lanes = sum(len(device.channels) for device in devices)
        left, below = gutter(self.fontMetrics()), rows_height(self._controller) + RULER
        plot = QRectF(left, 0, max(self.width() - left, 50), self.height() - below)
        now = self._controller.now
        canvas = CurveCanvas(plot, self.devicePixelRatioF())
        edges = column_edges(now, canvas.width)
        axis = live_axis(now, plot)
        self._paint_begin(painter, plot, axis)
        height = plot.height() / max(lanes, 1)
        lane, curves = 0, []
        for number, (device, (_, times, values)) in enumerate(zip(devices, windows, strict=False)):
            holds = device.rate == 0 and math.isnan(device.residual)
            extremes = pixel_columns(times, values, edges, holds)
            present = not {"unplugged", "stalled"} & set(device.alarms)  # what is read now
            for column, channel in enumerate(device.channels):
                box = QRectF(plot.left(), lane * height, plot.width(), height)
                colour = QColor(colours().curves[lane % len(colours().curves)])
                scale = self._scales.setdefault((number, column), LaneScale(smallest_span(channel)))
                seen_low, seen_high = extremes.low[:, column], extremes.high[:, column]
                if np.isfinite(seen_low).any():
                    scale.fit(float(np.nanmin(seen_low)), float(np.nanmax(seen_high)), now)
                up = Axis(scale.low, scale.high, box.bottom() - INSET, box.top() + INSET)
                self._paint_lane(painter, box, up, lane)
                paint_scale(painter, box, up)
                latest = float(values[-1, column]) if present and len(values) else math.nan
                self._paint_name(painter, box, channel.name, channel.unit, latest, colour)
                room = (box.top() + 1, box.bottom() - 1)
                curves.append(Curve(Extremes(seen_low, seen_high), up, colour, room))
                lane += 1
        canvas.draw(curves)
        canvas.paint(painter)
        paint_rows(painter, self._controller, plot, axis, now)
        paint_ruler(painter, plot, self.height())

    def _paint_begin(self, painter: QPainter, plot: QRectF, axis: Axis) -> None:
        """Show since when it is recorded."""
        recorder = self._controller.recorder
        if not self._controller.recording or recorder is None:
            return
        left = max(axis.at(recorder.begun), plot.left())
        wash = translucent(colours().trouble, 0.07)
        painter.fillRect(QRectF(left, 0, plot.right() - left, plot.height()), wash)
        if left > plot.left():
            painter.setPen(QPen(QColor(colours().trouble), 1))
            painter.drawLine(QLineF(left, 0, left, plot.height()))

    def _paint_lane(self, painter: QPainter, box: QRectF, up: Axis, lane: int) -> None:
        """The line at zero, and the one between two lanes."""
        if lane:
            painter.setPen(QPen(QColor(colours().frame), 1))
            painter.drawLine(QLineF(0, box.top(), box.right(), box.top()))
        if up.start < 0 < up.end:
            painter.setPen(QPen(QColor(colours().grid), 1))
            y = round(up.at(0.0)) + 0.5
            painter.drawLine(QLineF(box.left(), y, box.right(), y))

    def _paint_name(
        self, painter: QPainter, box: QRectF, name: str, unit: str, value: float, colour: QColor
    ) -> None:
        """What a lane shows, and its latest value."""
        gutter = QRectF(8, box.top(), box.left() - scale_width() - 14, box.height())
        painter.fillRect(QRectF(0, box.top() + 3, 3, box.height() - 6), colour)
        painter.setPen(QColor(colours().text))
        middle = Qt.AlignmentFlag.AlignVCenter
        painter.drawText(gutter, middle | Qt.AlignmentFlag.AlignLeft, name)
        painter.setPen(QColor(colours().muted))
        reading = f"{_number(value)} {unit}".strip()
        painter.drawText(gutter, middle | Qt.AlignmentFlag.AlignRight, reading)


def _number(value: float) -> str:
    """A reading to a tenth; a dash where there is none."""
    if math.isnan(value):
        return "–"
    # Adding zero takes the sign from what is rounded to nothing.
    return f"{round(value, 1) + 0.0:.1f}".replace("-", "\N{MINUS SIGN}")
