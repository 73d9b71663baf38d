"""The scalogram's panel: how strong each frequency of one channel is over the visible time.

The picture is computed in the background, for the visible span at the screen's resolution. Until
a new one comes, the old one moves with the time axis.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent, QPointF, QRectF, QSize
from PySide6.QtGui import (
    QColor,
    QContextMenuEvent,
    QHideEvent,
    QMouseEvent,
    QPainter,
    QResizeEvent,
    QShowEvent,
)

from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.label import scalogram_drawing as drawing
from forcelab.gui.label import scalogram_reading as reading
from forcelab.gui.label import scalogram_scales as scales
from forcelab.gui.label.scalogram_asking import Asking
from forcelab.gui.label.scalogram_button import ScalogramButton
from forcelab.gui.label.scalogram_job import Wish, folder_of
from forcelab.gui.label.scalogram_layers import Layers, colour_range
from forcelab.gui.panel import TimePanel
from forcelab.gui.theme import colours, themes
from forcelab.signals.channels import channel_map

if TYPE_CHECKING:
    from forcelab.signals.scalogram import Scalogram

__all__ = ["ScalogramPanel"]

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
        self._layers = Layers()
        self._pointer: QPointF | None = None
        self._trouble = ""
        self._owed = False  # a picture that was not asked for while the window was minimised
        self._asking = Asking(jobs, self._wish, self)
        self._asking.came.connect(self._take)
        self._asking.refused.connect(self._refused)
        self._button = ScalogramButton(self)
        self._button.channel_chosen.connect(self.set_channel)
        self._button.phase_chosen.connect(self.set_phase)
        self._button.steady_chosen.connect(self.set_steady)
        document.span_changed.connect(self._ask)
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
        span = document.start, document.end
        self._layers.paint(painter, plot, *span, smooth=self.settled)
        drawing.draw_cone(painter, plot, rows, now, span=span, bounds=document.bounds)
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
            drawing.plate(painter, plot.topLeft(), self._trouble, colours(), plot)
            return
        note = "" if self.picture is None else reading.note(self.picture, self._range()[1])
        if note:
            drawing.plate(painter, plot.topRight(), note, colours(), plot, quiet=True)
        if self._pointer is not None and plot.contains(self._pointer):
            line = self.value_at(self._pointer.x(), self._pointer.y())
            if line:
                drawing.plate(painter, self._pointer + QPointF(12, 14), line, colours(), plot)

    def value_at(self, x: float, y: float) -> str:
        """What is known at a point of the panel, such as ``12.3 Hz at 4.250 s: 0.42 N``."""
        if self.picture is None:
            return ""
        return reading.value(self.picture, self._rows, self.time_at(x), y)

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

    def _wish(self) -> Wish | None:
        """What a picture is wanted of; None for nothing."""
        demonstration = self.document.demonstration
        low, high = self.document.bounds
        span = max(self.document.start, low), min(self.document.end, high)
        if demonstration is None or not self.isVisible() or span[1] <= span[0]:
            return None
        ratio = self.devicePixelRatioF()
        share = (span[1] - span[0]) / (self.document.end - self.document.start)
        return Wish(
            demonstration,
            self.channel,
            span,
            int(min(max(self.height() * ratio / 2, FEWEST), MOST)),
            max(1, round(self.plot.width() * ratio * share)),
            self._phase,
            folder_of(self.document),
        )

    def _refused(self, sentence: str) -> None:
        """Say why there is no picture."""
        self._trouble = sentence
        self.invalidate()

    def _take(self, picture: Scalogram) -> None:
        """Show a newer picture; the older ones stay below until a fine one covers them."""
        self._trouble, self.picture = "", picture
        low, high = self.document.bounds
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
        return reading.ends(*self._range(), self._phase)

    def _range(self) -> tuple[float, float]:
        """Decimal logarithms of the magnitudes for the first and the last colour."""
        return (-1.0, 0.0) if self.picture is None else colour_range(self.picture, self._steady)
