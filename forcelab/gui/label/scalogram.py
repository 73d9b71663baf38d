"""The scalogram panel: requests, background jobs, readout and button.

The picture is computed in the background, for the visible span at the screen's resolution. Until
a new one comes, the old one moves with the time axis.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QEvent, QObject, QPointF, QRectF, QSize, Qt, QTimer, Signal
from PySide6.QtGui import (
    QAction,
    QActionGroup,
    QColor,
    QContextMenuEvent,
    QHideEvent,
    QMouseEvent,
    QPainter,
    QResizeEvent,
    QShowEvent,
)
from PySide6.QtWidgets import QMenu, QToolButton, QWidget

from forcelab.demonstration import Demonstration
from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.figures.text import NAMES, signed
from forcelab.gui.jobs import Job, Jobs
from forcelab.gui.label import scalogram_painting as drawing
from forcelab.gui.label import scalogram_painting as scales
from forcelab.gui.label.scalogram_painting import (
    LARGEST,
    MORLET_P,
    SMALLEST,
    Rows,
    ScalogramLayers,
    amount_text,
    colour_range,
)
from forcelab.gui.text import escape_ampersands, thousands
from forcelab.gui.theme import colours, themes
from forcelab.gui.time_panel import TimePanel
from forcelab.jobs import Progress
from forcelab.project.files import DEMONSTRATIONS
from forcelab.signals.channels import channel_map

if TYPE_CHECKING:
    from forcelab.signals.scalogram import Scalogram, Survey


class ScalogramButton(QToolButton):
    """Shows the channel; its menu chooses channel, magnitude or phase, and the range of colours.

    Signals
    -------
    channel_chosen(str), phase_chosen(bool), steady_chosen(bool)
    """

    channel_chosen = Signal(str)
    phase_chosen = Signal(bool)
    steady_chosen = Signal(bool)

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextOnly)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAccessibleName("Channel and kind of the scalogram")
        face = self.font()
        face.setPixelSize(10)
        self.setFont(face)
        self._choices = QMenu(self)
        # What the menu is cleared of goes, but no group would.
        self._channels, self._kinds = QActionGroup(self._choices), QActionGroup(self._choices)
        self.setMenu(self._choices)

    def offer(self, channels: Sequence[str], channel: str, phase: bool, steady: bool) -> None:
        """Say what can be chosen, and what is chosen."""
        room = max(self.width() - 18, 10)
        name = self.fontMetrics().elidedText(channel, NAMES, room)
        # The wide space keeps the name clear of the arrow.
        self.setText(escape_ampersands(name) + "\N{EM SPACE}")
        self.setToolTip(f"{channel}: choose channel, magnitude or phase")
        self.setVisible(bool(channels))
        menu = self._choices
        menu.clear()
        for name in channels:
            action = self._add(escape_ampersands(name), name == channel, self._channels)
            action.triggered.connect(lambda _=False, name=name: self.channel_chosen.emit(name))
        menu.addSeparator()
        magnitude = self._add("Magnitude", not phase, self._kinds)
        magnitude.triggered.connect(lambda: self.phase_chosen.emit(False))
        angle = self._add("Phase", phase, self._kinds)
        angle.triggered.connect(lambda: self.phase_chosen.emit(True))
        menu.addSeparator()
        same = self._add("Same colours for the whole demonstration", steady)
        same.setEnabled(not phase)
        same.triggered.connect(self.steady_chosen)

    def _add(self, name: str, on: bool, group: QActionGroup | None = None) -> QAction:
        """One line of the menu."""
        action = QAction(name, self._choices, checkable=True, checked=on)
        if group is not None:
            group.addAction(action)
        self._choices.addAction(action)
        return action


#: Rows of a long span, whatever the panel's height: its tiles are kept for these.
LONG_RECORDING_ROWS = 100
#: Of recordings of fewer samples nothing is kept: all is computed anew in less than a second.
CACHED_SCALOGRAMS = 1 << 21


@dataclass(frozen=True, slots=True)
class ScalogramRequest:
    """What a picture is wanted of.

    Parameters
    ----------
    demonstration : Demonstration
    channel : str
    span : tuple of two floats
        Seconds.
    rows, columns : int
    phase : bool
        Phases instead of magnitudes.
    folder : Path, optional
        The demonstration's own, where what long spans are put together from is kept; None where
        nothing may be, or need be.
    """

    demonstration: Demonstration
    channel: str
    span: tuple[float, float]
    rows: int
    columns: int
    phase: bool
    folder: Path | None = None


def cache_folder(document: Document) -> Path | None:
    """Where something is kept beside the demonstration; None where nothing may or need be."""
    project, shown = document.project, document.demonstration
    if (
        project is None
        or project.read_only
        or shown is None
        or len(shown.times) < CACHED_SCALOGRAMS
    ):
        return None
    return project.path / DEMONSTRATIONS / document.id


def compute(wish: ScalogramRequest, known: Survey | None) -> Generator[Progress, None, Scalogram]:
    """Compute what is wished for; a job.

    Of a long recording it goes on with the tiles of what is not seen, after the exact picture, so
    that whoever pans or zooms later does not wait for them. One core is left to the window then.
    Its thread keeps its priority: one that waits its turn with Python's lock in its hand would
    hold up the window. In the end they are kept, and the next session begins with them.

    Parameters
    ----------
    wish : Wish
    known : Survey, optional
        Of the channel, from an earlier picture.
    """
    # In the job's thread these imports, most of a second the first time, delay nobody.
    from forcelab.signals.scalogram import LONG, Step, keep, kept, row_scales, scalogram, survey
    from forcelab.signals.wavelets import Morlet

    all_of_it = row_scales(LONG_RECORDING_ROWS, LARGEST, SMALLEST)
    view = known
    if view is None and wish.folder is not None:
        view = kept(wish.folder, wish.demonstration, wish.channel, all_of_it, Morlet(MORLET_P))
    if view is None:
        view = yield from survey(wish.demonstration, wish.channel, LARGEST, Morlet(MORLET_P))
    start, end = wish.span
    scales = row_scales(wish.rows, LARGEST, SMALLEST)
    if (end - start) * view.source.rate > LONG:
        scales = all_of_it
    picture = yield from scalogram(
        view, start, end, scales=scales, columns=wish.columns, phase=wish.phase
    )
    count = view.source.count
    if count > LONG and not wish.phase:
        yield Step(1, 1, "exact picture", picture)  # shown before the next chunk is computed
        tiles = view.tiles(all_of_it)
        for step in tiles.building(tiles.missing(0, count, tiles.told_cell), threads=1):
            yield Step(step.done, step.total, step.text, picture)
        if wish.folder is not None and not view.kept:
            view.kept = True  # tried once: a full disk is not asked again and again
            keep(wish.folder, view, all_of_it)
    return picture


#: Milliseconds for which the span must rest before a picture of it is begun.
LOADING_DELAY_MS = 40


class ScalogramLoader(QObject):
    """Has pictures computed in the background.

    Parameters
    ----------
    jobs : Jobs
        Runs the computing.
    wish : callable
        What is wanted a picture of, when it is begun; None for nothing.

    Attributes
    ----------
    view : Survey or None
        What is known of the channel, for the pictures that come next.
    wanted : bool
        Whether a picture is waited for.
    came : Signal(Scalogram)
        A picture, the coarse one first where there is one.
    refused : Signal(str)
        Why there is none.
    """

    came = Signal(object)
    refused = Signal(str)

    def __init__(
        self, jobs: Jobs, wish: Callable[[], ScalogramRequest | None], parent: QObject
    ) -> None:
        super().__init__(parent)
        self.view: Survey | None = None
        self.wanted = False
        self._jobs, self._wish = jobs, wish
        self._shown: Scalogram | None = None
        self._job: Job | None = None
        self._timer = QTimer(self, singleShot=True, interval=LOADING_DELAY_MS)
        self._timer.timeout.connect(self._begin)

    def ask(self) -> None:
        """Have a picture made of what is seen then."""
        self.wanted = True
        self._timer.start()
        if self.view is not None and self._job is not None:
            # What it computes is out of date, and it would slow down whoever pans and zooms.
            self._job.cancel()
            self._job = None

    def stop(self) -> None:
        """Compute nothing any more."""
        self._timer.stop()
        self.wanted, self._shown = False, None
        if self._job is not None:
            self._job.cancel()
            self._job = None

    def forget(self) -> None:
        """The pictures are of another channel from now on."""
        self.view = None

    def _begin(self) -> None:
        """Start computing."""
        wish = self._wish()
        if wish is None:
            self.stop()
            return

        def done(picture: Scalogram) -> None:
            self.wanted = self._timer.isActive()  # the span may have changed again
            self._emit_picture(picture)

        def failed(error: Exception) -> None:
            self.wanted = self._timer.isActive()
            known = isinstance(error, ForcelabError)
            self.refused.emit(str(error) if known else "The scalogram failed; see the log.")

        def moved(step: object) -> None:
            picture = getattr(step, "picture", None)
            if picture is not None and picture is not self._shown:
                if not picture.coarse:  # what the job goes on with is not seen
                    self.wanted = self._timer.isActive()
                self._emit_picture(picture)

        self._job = self._jobs.run(
            compute(wish, self.view), done, failed, moved, key=f"scalogram {id(self)}"
        )

    def _emit_picture(self, picture: Scalogram) -> None:
        """Give a newer picture away."""
        if picture is not self._shown:
            self._shown, self.view = picture, picture.view
            self.came.emit(picture)


#: Decades beyond the last colour from which on something is a spike: impacts are less.
SPIKE = 0.5


def readout_value(picture: Scalogram, rows: Rows, time: float, y: float) -> str:
    """What is known at a time and a height, such as ``12.3 Hz at 4.250 s: |W| = 0.42``.

    The transform's own measure, without the channel's unit: a tone of 1 N has more the wider the
    wavelet is.
    """
    scale = rows.scale(y)
    k, c = picture.values.shape
    row = math.floor(math.log(scale / rows.smallest) / math.log(rows.largest / rows.smallest) * k)
    column = math.floor((time - picture.start) / (picture.end - picture.start) * c)
    where = f"{rows.hertz(scale):.3g} Hz at {time:.3f} s"
    if not (0 <= row < k and 0 <= column < c) or not np.isfinite(picture.values[row, column]):
        return where
    here = float(picture.values[row, column])
    if picture.phase:
        return "{}: {} rad".format(where, signed(f"{here:.2f}"))
    return f"{where}: |W| = {10.0**here:.3g}"


def readout_note(picture: Scalogram, high: float) -> str:
    """What was approximated or left out in the picture; empty where that is nothing.

    Parameters
    ----------
    picture : Scalogram
    high : float
        Decimal logarithm of the magnitude for the last colour.
    """
    if picture.coarse:
        return "coarse picture; computing the exact one…"
    return ", ".join(filter(None, (_resolution_text(picture), _omitted_text(picture, high))))


def _omitted_text(picture: Scalogram, high: float) -> str:
    """What the colours do not tell apart or show."""
    source, notes = picture.view.source, []
    number = source.left_out(source.place(picture.start), source.place(picture.end))
    if number:
        one, many = (
            "1 glitch left out",
            "{0} glitches left out",
        )
        notes.append(one if number == 1 else many.format(thousands(number)))
    if not picture.phase and np.fmax.reduce(picture.values, axis=None) > high + SPIKE:
        notes.append("spikes share the last colour")
    return ", ".join(notes)


def _resolution_text(picture: Scalogram) -> str:
    """How much of the recording each pixel is about."""
    samples = (picture.end - picture.start) * picture.view.source.rate
    each = samples / picture.values.shape[1]
    if each < 2:
        return ""
    if picture.phase:
        return f"phase every {each:.3g} samples"
    return f"largest of {each:.0f} samples a pixel"


def readout_ends(low: float, high: float, phase: bool) -> tuple[str, str]:
    """What stands beside the legend's ends; `low` and `high` are decimal logarithms."""
    if phase:
        return "\N{MINUS SIGN}\N{GREEK SMALL LETTER PI}", "\N{GREEK SMALL LETTER PI}"
    return amount_text(10.0**low), f"|W| {amount_text(10.0**high)}"


#: Rows of a picture at least and at most; one for every two pixels of the screen between.
FEWEST, MOST = 24, 160
#: Height of the button above the axis, in pixels.
BUTTON = 24


class ScalogramPanel(TimePanel):
    """One channel's scalogram on the common time axis.

    Attributes
    ----------
    channel : str
        The one that is shown; empty without a demonstration.
    picture : Scalogram or None
        The newest picture.
    """

    def __init__(self, document: Document, jobs: Jobs) -> None:
        self.picture: Scalogram | None = None
        super().__init__(document)
        self.setAccessibleName("Scalogram")
        self.channel = ""
        self._phase = False
        self._steady = True
        self._layers = ScalogramLayers()
        self._pointer: QPointF | None = None
        self._trouble = ""
        self._owed = False  # a picture that was not asked for while the window was minimised
        self._asking = ScalogramLoader(jobs, self._wish, self)
        self._asking.came.connect(self._take)
        self._asking.refused.connect(self._refused)
        self._button = ScalogramButton(self)
        self._button.channel_chosen.connect(self.set_channel)
        self._button.phase_chosen.connect(self.set_phase)
        self._button.steady_chosen.connect(self.set_steady)
        document.view.span_changed.connect(self._ask)
        document.demonstration_changed.connect(self._demonstration_changed)
        themes().changed.connect(self._recolour)
        self._demonstration_changed()

    # What is shown

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
        """Whether what is shown is what was asked for."""
        return not self._asking.wanted

    def set_channel(self, name: str) -> None:
        """Show another channel."""
        if name != self.channel and name in self.channels:
            self.channel = name
            self._forget()

    def set_phase(self, phase: bool) -> None:
        """Show phases, or magnitudes."""
        if phase != self._phase:
            self._phase = phase
            self._drop()

    def set_steady(self, steady: bool) -> None:
        """Give colours one range for the whole demonstration, or one for each view."""
        self._steady = steady
        self._write_button()
        self._recolour()

    # Qt

    def sizeHint(self) -> QSize:
        """Wide, and high enough to tell octaves apart."""
        return QSize(900, 170)

    def minimumSizeHint(self) -> QSize:
        """High enough for the button and a few rows."""
        return QSize(240, 64)

    def showEvent(self, event: QShowEvent) -> None:
        """Compute what is seen now."""
        super().showEvent(event)
        self._ask()

    def hideEvent(self, event: QHideEvent) -> None:
        """Stop computing what nobody sees."""
        super().hideEvent(event)
        self._asking.stop()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Compute for the new size."""
        super().resizeEvent(event)
        self._button.setGeometry(2, 2, self.GUTTER - 6, BUTTON)
        self._write_button()
        self._ask()

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """The same menu as that of the button."""
        self._button.menu().popup(event.globalPos())

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Show the value under the pointer."""
        super().mouseMoveEvent(event)
        self._pointer = event.position()
        self.update()

    def leaveEvent(self, event: QEvent) -> None:
        """Show no value any more."""
        super().leaveEvent(event)
        self._pointer = None
        self.update()

    # Drawing

    def paint_content(self, painter: QPainter, plot: QRectF) -> None:
        """Draw the pictures where their time is now, then the cone and the scales."""
        if self._owed:
            self._ask()  # not every platform says so when a minimised window comes back
        now, rows, document = colours(), self._rows, self.document
        span = document.view.start, document.view.end
        self._layers.paint(painter, plot, *span, smooth=self.settled)
        drawing.draw_cone(painter, plot, rows, now, span=span, bounds=document.view.bounds)
        drawing.draw_marks(painter, plot, [rows.y(scale) for scale in scales.MARKED], now)

    def gutter_shows(self) -> object:
        """The axis in Hz, and what stands at the legend's ends."""
        return self._rows, self._ends(), self._phase

    def paint_gutter(self, painter: QPainter, box: QRectF) -> None:
        """Draw the axis in Hz and the legend of the colours."""
        painter.fillRect(box, QColor(colours().panel))
        drawing.draw_frequencies(painter, box.right(), self._rows, colours(), BUTTON + 8.0)
        bar = QRectF(4.5, BUTTON + 10.5, 6, box.bottom() - BUTTON - 18)
        ends = self._ends()
        if bar.height() >= 40 and ends is not None:
            drawing.draw_bar(painter, bar, ends, self._phase, colours())

    def paint_overlay(self, painter: QPainter, plot: QRectF) -> None:
        """Say what is under the pointer, and what was approximated or went wrong."""
        if self._trouble:
            drawing.draw_plate(painter, plot.topLeft(), self._trouble, colours(), plot)
            return
        note = "" if self.picture is None else readout_note(self.picture, self._range()[1])
        if note:
            drawing.draw_plate(painter, plot.topRight(), note, colours(), plot, quiet=True)
        if self._pointer is not None and plot.contains(self._pointer):
            line = self.value_at(self._pointer.x(), self._pointer.y())
            if line:
                drawing.draw_plate(painter, self._pointer + QPointF(12, 14), line, colours(), plot)

    def value_at(self, x: float, y: float) -> str:
        """What is known at a point of the panel, such as ``12.3 Hz at 4.250 s: 0.42 N``."""
        if self.picture is None:
            return ""
        return readout_value(self.picture, self._rows, self.time_at(x), y)

    # Computing

    @property
    def _rows(self) -> drawing.Rows:
        """The vertical axis, while there is a demonstration."""
        demonstration, view = self.document.demonstration, self._asking.view
        assert demonstration is not None
        rate = view.source.rate if view is not None else 1.0 / demonstration.period
        top, bottom = self.plot.top() + 1, self.plot.bottom() - 1
        return drawing.Rows(
            top, bottom, scales.SMALLEST, scales.LARGEST, scales.FOURIER_FACTOR, rate
        )

    def _demonstration_changed(self) -> None:
        """Keep the channel where the new demonstration has it, too."""
        names = self.channels
        if self.channel not in names:
            self.channel = names[0] if names else ""
        self._forget()

    def _forget(self) -> None:
        """Drop what belongs to another channel."""
        self._asking.forget()
        self._trouble = ""
        self._drop()

    def _drop(self) -> None:
        """Drop all pictures, also the one that is being made."""
        self._asking.stop()
        self._layers.clear()
        self.picture = None
        self._write_button()
        self.invalidate()
        self._ask()

    def _write_button(self) -> None:
        """Print the channel on the button, and mark in its menu what is chosen."""
        self._button.offer(self.channels, self.channel, self._phase, self._steady)

    def _ask(self, *_: object) -> None:
        """Have a picture of what is seen made, once the span has come to rest."""
        # To Qt the panels of a minimised window are visible.
        self._owed = self.window().isMinimized()
        if self.isVisible() and self.channel and not self._owed:
            self._asking.ask()
        else:
            self._asking.stop()

    def _wish(self) -> ScalogramRequest | None:
        """What a picture is wanted of; None for nothing."""
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
            int(min(max(self.height() * ratio / 2, FEWEST), MOST)),
            max(1, round(self.plot.width() * ratio * share)),
            self._phase,
            cache_folder(self.document),
        )

    def _refused(self, sentence: str) -> None:
        """Say why there is no picture."""
        self._trouble = sentence
        self.invalidate()

    def _take(self, picture: Scalogram) -> None:
        """Show a newer picture; the older ones stay below until a fine one covers them."""
        self._trouble, self.picture = "", picture
        low, high = self.document.view.bounds
        whole = picture.end - picture.start >= 0.999 * (high - low)
        self._layers.take(picture, whole=whole, steady=self._steady)
        self.invalidate()

    def _recolour(self) -> None:
        """Make the images anew, from the same pictures."""
        self._layers.recolour(self._steady)
        self.invalidate()

    def _ends(self) -> tuple[str, str] | None:
        """What stands at the ends of the colours' legend; None where nothing is known of them."""
        if not self._phase and self._asking.view is None:
            return None
        return readout_ends(*self._range(), self._phase)

    def _range(self) -> tuple[float, float]:
        """Decimal logarithms of the magnitudes for the first and the last colour."""
        return (-1.0, 0.0) if self.picture is None else colour_range(self.picture, self._steady)
