"""The scalogram panel.

The picture is computed in the background, for the visible span at the screen's resolution. Until
a new one comes, the old one moves with the time axis.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QObject, QPointF, QRectF, QSize, Qt, QTimer, Signal
from PySide6.QtGui import (
    QAction,
    QActionGroup,
    QColor,
    QContextMenuEvent,
    QHideEvent,
    QMouseEvent,
    QPainter,
    QShowEvent,
)
from PySide6.QtWidgets import QMenu, QToolButton, QWidget

from forcelab.demonstration import Demonstration
from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.figures.text import NAMES, signed
from forcelab.gui.jobs import Jobs
from forcelab.gui.kit import text_size
from forcelab.gui.kit.plot import draw_plate
from forcelab.gui.label.scalogram_painting import (
    FOURIER_FACTOR,
    LARGEST,
    MORLET_P,
    SMALLEST,
    ConeAndMarks,
    FrequencyAxis,
    ScalogramLayers,
    amount_text,
    draw_bar,
)
from forcelab.gui.label.segment_panel import SignalPanel
from forcelab.gui.layout import set_enabled_with_reason
from forcelab.gui.text import escape_ampersands
from forcelab.gui.theme import colours
from forcelab.jobs import Progress
from forcelab.signals.channels import channel_map

if TYPE_CHECKING:
    from forcelab.signals.scalogram import ChannelView, Scalogram


class ScalogramButton(QToolButton):
    """Shows the channel; its menu chooses channel, magnitude or phase, and the range of colours."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextOnly)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAccessibleName("Channel and kind of the scalogram")
        self.use_text_size()
        menu = QMenu(self)
        # What the menu is cleared of goes, but no group would.
        self.channels, self.kinds = QActionGroup(menu), QActionGroup(menu)
        self.setMenu(menu)

    def use_text_size(self) -> None:
        face = self.font()
        face.setPixelSize(round(text_size.pixels(10)))
        self.setFont(face)

    def show_channel(self, channel: str) -> None:
        """Name the channel, and empty the menu, to be filled anew."""
        room = max(self.width() - 18, 10)
        name = self.fontMetrics().elidedText(channel, NAMES, room)
        # The wide space keeps the name clear of the arrow.
        self.setText(escape_ampersands(name) + "\N{EM SPACE}")
        self.setToolTip(f"{channel}: choose channel, magnitude or phase")
        self.setVisible(bool(channel))
        self.menu().clear()

    def add_choice(
        self,
        name: str,
        chosen: bool,
        choose: Callable[[], object],
        group: QActionGroup | None = None,
    ) -> QAction:
        """Add an entry to the menu; one of a group at a time is chosen."""
        action = QAction(name, self.menu(), checkable=True, checked=chosen)
        if group is not None:
            group.addAction(action)
        action.triggered.connect(lambda _checked=False: choose())
        self.menu().addAction(action)
        return action


#: Rows of a long span, whatever the panel's height: its cells stay for these.
LONG_SPAN_ROWS = 100


@dataclass(frozen=True, slots=True)
class ScalogramRequest:
    """The channel, span (s) and resolution of a picture of phases or magnitudes."""

    demonstration: Demonstration
    channel: str
    span: tuple[float, float]
    rows: int
    columns: int
    phase: bool


def compute(
    request: ScalogramRequest, known: ChannelView | None
) -> Generator[Progress, None, Scalogram]:
    """Compute a picture; a job.

    Of a long recording it goes on with what is not visible, after the exact picture, so that later
    panning and zooming need not wait for it. Its thread keeps its priority: one that waits its turn
    with Python's lock in its hand would hold up the window. `known` is the view of the channel from
    an earlier picture.
    """
    # In the job's thread these imports, most of a second the first time, delay nobody.
    from forcelab.signals.scalogram import LONG, Step, open_channel, row_scales, scalogram
    from forcelab.signals.wavelets import Morlet

    view = known
    if view is None:
        view = yield from open_channel(
            request.demonstration, request.channel, LARGEST, Morlet(MORLET_P)
        )
    start, end = request.span
    is_long = (end - start) * view.reader.rate > LONG
    scales = row_scales(LONG_SPAN_ROWS if is_long else request.rows, LARGEST, SMALLEST)
    picture = yield from scalogram(
        view, start, end, scales=scales, columns=request.columns, phase=request.phase
    )
    if view.reader.count > LONG and not request.phase:
        yield Step(1, 1, "exact picture", picture)  # shown before the next block is computed
        cells = view.cells(row_scales(LONG_SPAN_ROWS, LARGEST, SMALLEST))
        for block in cells.missing():
            for step in cells.computing(block):
                yield Step(step.done, step.total, step.text, picture)
    return picture


#: Milliseconds for which the span must rest before a picture of it is computed.
LOADING_DELAY_MS = 40


class ScalogramLoader(QObject):
    """Computes pictures in the background.

    `request` gives what to compute when a job begins; None for nothing. `view` is that of
    the channel for later pictures; `pending` tells whether a picture is awaited. `loaded` brings a
    picture, a coarse one first where there is one; `refused` says why there is none.
    """

    loaded = Signal(object)
    refused = Signal(str)

    def __init__(
        self, jobs: Jobs, request: Callable[[], ScalogramRequest | None], parent: QObject
    ) -> None:
        super().__init__(parent)
        self.view: ChannelView | None = None
        self.pending = False
        self._jobs, self._request, self._key = jobs, request, f"scalogram {id(self)}"
        self._shown: Scalogram | None = None
        self._timer = QTimer(self, singleShot=True, interval=LOADING_DELAY_MS)
        self._timer.timeout.connect(self._begin)

    def ask(self) -> None:
        """Compute a picture of what is visible when the span has come to rest."""
        self.pending = True
        self._timer.start()
        if self.view is not None:
            # What is computed is out of date, and it would slow down panning and zooming.
            self._jobs.cancel(self._key)

    def stop(self) -> None:
        """Cancel what is computed."""
        self._timer.stop()
        self.pending, self._shown = False, None
        self._jobs.cancel(self._key)

    def _begin(self) -> None:
        request = self._request()
        if request is None:
            self.stop()
            return

        def failed(error: Exception) -> None:
            self.pending = self._timer.isActive()  # the span may have changed again
            expected = isinstance(error, ForcelabError)
            self.refused.emit(str(error) if expected else "The scalogram failed; see the log.")

        def progressed(step: object) -> None:
            if (picture := getattr(step, "picture", None)) is not None:
                self._take(picture)

        job = compute(request, self.view)
        self._jobs.run(job, self._take, failed, progressed, key=self._key)

    def _take(self, picture: Scalogram) -> None:
        """Emit a newer picture; after the exact one the job may go on with what is not visible."""
        if picture is not self._shown:
            if not picture.coarse:
                self.pending = self._timer.isActive()  # as above
            self._shown, self.view = picture, picture.view
            self.loaded.emit(picture)


#: Decades beyond the last colour from which on something is a spike: impacts are less.
SPIKE = 0.5


def readout_value(picture: Scalogram, rate: float, time: float, share: float) -> str:
    """The value at a time and a share of the height, such as ``12.3 Hz at 4.250 s: |W| = 0.42``.

    The transform's own measure, without the channel's unit: a tone of 1 N has more the wider the
    wavelet is.
    """
    hertz = rate / (FOURIER_FACTOR * SMALLEST * (LARGEST / SMALLEST) ** share)
    k, c = picture.values.shape
    row = math.floor(share * k)
    column = math.floor((time - picture.start) / (picture.end - picture.start) * c)
    where = f"{hertz:.3g} Hz at {time:.3f} s"
    if not (0 <= row < k and 0 <= column < c) or not np.isfinite(picture.values[row, column]):
        return where
    value = float(picture.values[row, column])
    if picture.phase:
        return f"{where}: {signed(f'{value:.2f}')} rad"
    return f"{where}: |W| = {10.0**value:.3g}"


def readout_note(picture: Scalogram, high: float) -> str:
    """What was approximated or left out in the picture; empty where that is nothing.

    `high` is the decimal logarithm of the magnitude for the last colour.
    """
    if picture.coarse:
        return "coarse picture; computing the exact one…"
    return ", ".join(filter(None, (_resolution_text(picture), _omitted_text(picture, high))))


def _omitted_text(picture: Scalogram, high: float) -> str:
    """What the colours leave out or do not tell apart."""
    reader, notes = picture.view.reader, []
    number = reader.left_out(reader.place(picture.start), reader.place(picture.end))
    if number:
        notes.append("1 glitch left out" if number == 1 else f"{number:,} glitches left out")
    if not picture.phase and np.fmax.reduce(picture.values, axis=None) > high + SPIKE:
        notes.append("spikes share the last colour")
    return ", ".join(notes)


def _resolution_text(picture: Scalogram) -> str:
    """How much of the recording each pixel stands for."""
    samples = (picture.end - picture.start) * picture.view.reader.rate
    each = samples / picture.values.shape[1]
    if each < 2:
        return ""
    if picture.phase:
        return f"phase every {each:.3g} samples"
    return f"largest of {each:.0f} samples a pixel"


#: Rows of a picture at least and at most; one for every two pixels of the screen between.
LEAST_ROWS, MOST_ROWS = 24, 160
#: Height of the button above the axis, in pixels.
BUTTON = 24


class ScalogramPanel(SignalPanel):
    """One channel's scalogram on the common time axis.

    `channel` is empty without a demonstration; `picture` is the newest one.
    """

    pictured = True

    def __init__(self, document: Document, jobs: Jobs) -> None:
        self.picture: Scalogram | None = None
        super().__init__(document)
        self.setAccessibleName("Scalogram")
        self.channel = ""
        self._phase = False
        self._steady = True
        self._box = self.add_box(inverted=True)
        self._box.setYRange(math.log(SMALLEST), math.log(LARGEST), padding=0)
        self._layers = ScalogramLayers(self._box)
        self._cone = ConeAndMarks(self._box)
        self._frequencies = FrequencyAxis(free=text_size.pixels(BUTTON) + 8.0)
        self._frequencies.setWidth(self.gutter)
        self._frequencies.linkToView(self._box)
        self.addItem(self._frequencies)
        self._trouble = self._note = ""  # what went wrong, and what was approximated
        self._request_due = False  # a picture that was not asked for while the window was minimised
        self._loader = ScalogramLoader(jobs, self._request, self)
        self._loader.loaded.connect(self._show_picture)
        self._loader.refused.connect(self._show_refusal)
        self._button = ScalogramButton(self)
        document.view.span_changed.connect(self._request_picture)
        document.demonstration_changed.connect(self._demonstration_changed)
        self._demonstration_changed()

    # Choices

    @property
    def channels(self) -> tuple[str, ...]:
        """The channels to choose from: recognition channels, then the recorded ones."""
        demonstration = self.document.demonstration
        if demonstration is None:
            return ()
        names = channel_map(demonstration.channels).names
        rest = (c.name for c in demonstration.channels if c.name not in names)
        return (*names, *rest)

    @property
    def settled(self) -> bool:
        """Whether the newest requested picture is shown."""
        return not self._loader.pending

    def set_channel(self, name: str) -> None:
        if name != self.channel and name in self.channels:
            self.channel = name
            self._reset()

    def set_phase(self, phase: bool) -> None:
        if phase != self._phase:
            self._phase = phase
            self._clear()

    def set_steady(self, steady: bool) -> None:
        """Give colours one range for the whole demonstration, or one for each view."""
        self._steady = steady
        self._update_button()
        self._recolour()

    # Qt

    def sizeHint(self) -> QSize:
        """High enough to tell octaves apart."""
        return QSize(900, 170)

    def minimumSizeHint(self) -> QSize:
        """High enough for the button and a few rows."""
        return QSize(240, 64)

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._request_picture()

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self._loader.stop()

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        self._button.menu().popup(event.globalPos())

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        super().mouseMoveEvent(event)
        self.point_at(event.position())

    # Drawing

    def fit_text(self) -> None:
        self._frequencies.free = text_size.pixels(BUTTON) + 8.0
        self._frequencies.setWidth(self.gutter)
        self._button.use_text_size()
        super().fit_text()

    def place(self) -> None:
        """Put box, axis and button where they belong, and ask for a picture of that size."""
        self._box.setGeometry(self.plot.adjusted(0, 1, 0, -1))
        self._frequencies.setGeometry(QRectF(0, 1, self.gutter, self.height() - 2))
        self._button.setGeometry(2, 2, self.gutter - 6, round(text_size.pixels(BUTTON)))
        self._update_button()
        self._request_picture()

    def invalidate(self, *_: object) -> None:
        """Draw again, with axis and cone for the rate and the recording."""
        is_open, picture = self.document.demonstration is not None, self.picture
        self._note = "" if picture is None else readout_note(picture, self._layers.ends[1])
        for item in (self._box, self._frequencies):
            item.setVisible(is_open)
        if is_open:
            self._layers.set_smooth(self.settled)
            self._cone.bounds, self._cone.rate = self.document.view.bounds, self._rate
            self._cone.update()
            self._frequencies.set_rate(self._rate)
        super().invalidate()

    def paint_content(self, painter: QPainter, plot: QRectF) -> None:
        if self._request_due:
            self._request_picture()  # not every platform says so when a minimised window comes back

    def paint_gutter(self, painter: QPainter, box: QRectF) -> None:
        painter.fillRect(box, QColor(colours().panel))
        above = text_size.pixels(BUTTON)
        bar = QRectF(4.5, above + 10.5, 6, box.bottom() - above - 18)
        ends = self._ends()
        if bar.height() >= 40 and ends is not None:
            draw_bar(painter, bar, ends, phase=self._phase)

    def paint_overlay(self, painter: QPainter, plot: QRectF) -> None:
        """Show the value under the pointer, and what was approximated or went wrong."""
        self.paint_segments(painter, plot)
        if self._trouble:
            draw_plate(painter, plot.topLeft(), self._trouble, plot)
            return
        if self._note:
            draw_plate(painter, plot.topRight(), self._note, plot, quiet=True)

    def readout(self, pointer: QPointF) -> str:
        """The value at a pixel, such as ``12.3 Hz at 4.250 s: |W| = 0.42``."""
        if self.picture is None or self._trouble or not self.plot.contains(pointer):
            return ""
        share = (pointer.y() - self.plot.top() - 1) / (self.plot.height() - 2)
        return readout_value(self.picture, self._rate, self.time_at(pointer.x()), share)

    # Computing

    @property
    def _rate(self) -> float:
        """Samples a second, while there is a demonstration."""
        demonstration, view = self.document.demonstration, self._loader.view
        assert demonstration is not None
        return view.reader.rate if view is not None else 1.0 / demonstration.period

    def _demonstration_changed(self) -> None:
        """Keep the channel where the new demonstration has it, too."""
        names = self.channels
        if self.channel not in names:
            self.channel = names[0] if names else ""
        self._reset()

    def _reset(self) -> None:
        """Drop what belongs to another channel."""
        self._loader.view = None
        self._trouble = ""
        self._clear()

    def _clear(self) -> None:
        """Drop all pictures, also the one that is being computed."""
        self._loader.stop()
        self._layers.clear()
        self.picture = None
        self._update_button()
        self.invalidate()
        self._request_picture()

    def _update_button(self) -> None:
        """Show the channel on the button, and mark in its menu what is chosen."""
        button, phase, steady = self._button, self._phase, self._steady
        button.show_channel(self.channel)
        menu, add = button.menu(), button.add_choice  # the menu is that of the panel, too
        for name in self.channels:
            choose = partial(self.set_channel, name)
            add(escape_ampersands(name), name == self.channel, choose, button.channels)
        menu.addSeparator()
        add("Magnitude", not phase, partial(self.set_phase, False), button.kinds)
        add("Phase", phase, partial(self.set_phase, True), button.kinds)
        menu.addSeparator()
        choose = partial(self.set_steady, not steady)
        same = add("Same colours for the whole demonstration", steady, choose)
        set_enabled_with_reason(same, "Phases always have the same colours." if phase else "")
        menu.addSeparator()
        self.add_picture_entries(menu)

    def _request_picture(self, *_: object) -> None:
        """Request a picture of the visible span, once it has come to rest."""
        # To Qt the panels of a minimised window are visible.
        self._request_due = self.window().isMinimized()
        if self.isVisible() and self.channel and not self._request_due:
            self._loader.ask()
        else:
            self._loader.stop()

    def _request(self) -> ScalogramRequest | None:
        """The request for the visible span; None for nothing."""
        demonstration = self.document.demonstration
        low, high = self.document.view.bounds
        span = max(self.document.view.start, low), min(self.document.view.end, high)
        if demonstration is None or not self.isVisible() or span[1] <= span[0]:
            return None
        ratio = self.devicePixelRatioF()
        share = (span[1] - span[0]) / (self.document.view.end - self.document.view.start)
        return ScalogramRequest(
            demonstration,
            self.channel,
            span,
            int(min(max(self.height() * ratio / 2, LEAST_ROWS), MOST_ROWS)),
            max(1, round(self.plot.width() * ratio * share)),
            self._phase,
        )

    def _show_refusal(self, sentence: str) -> None:
        self._trouble = sentence
        self.invalidate()

    def _show_picture(self, picture: Scalogram) -> None:
        """Show a newer picture; the older ones stay below until a fine one covers them."""
        self._trouble, self.picture = "", picture
        low, high = self.document.view.bounds
        whole = picture.end - picture.start >= 0.999 * (high - low)
        self._layers.take(picture, whole=whole, steady=self._steady)
        self.invalidate()

    def restyle(self) -> None:
        super().restyle()
        self._recolour()

    def _recolour(self) -> None:
        """Draw the same pictures in other colours."""
        self._layers.recolour(self._steady)
        self.invalidate()

    def _ends(self) -> tuple[str, str] | None:
        """The texts at the legend's ends; None where the range is not known."""
        if self._phase:
            return "\N{MINUS SIGN}\N{GREEK SMALL LETTER PI}", "\N{GREEK SMALL LETTER PI}"
        if self._loader.view is None:
            return None
        least, largest = (amount_text(10.0**end) for end in self._layers.ends)
        return least, f"|W| {largest}"
