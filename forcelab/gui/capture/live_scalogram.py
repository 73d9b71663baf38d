"""The live scalogram of one channel, and the choice of the channel."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QHideEvent, QPainter, QPen, QPolygonF, QShowEvent
from PySide6.QtWidgets import QWidget

from forcelab.arrays import Real
from forcelab.errors import ForcelabError
from forcelab.gui import settings
from forcelab.gui.capture.controller import CaptureController
from forcelab.gui.capture.live_plot import APART, SECONDS, LivePlot, gutter, plot_width
from forcelab.gui.figures import text
from forcelab.gui.figures.colormap import translucent
from forcelab.gui.jobs import Jobs
from forcelab.gui.kit import text_size
from forcelab.gui.kit.plot import BoxItem, draw_plate
from forcelab.gui.label.scalogram_painting import (
    FOURIER_FACTOR,
    FrequencyAxis,
    ScalogramImage,
    amount_text,
    draw_bar,
)
from forcelab.gui.theme import colours
from forcelab.gui.widgets import ElidedComboBox

if TYPE_CHECKING:
    from forcelab.capture.recorder import Recorder
    from forcelab.live.scalogram import LiveScalogram, RollingImage


#: The key of its job, and where the channel that was chosen last is remembered.
DRAWING, CHANNEL = "capture: live scalogram", "capture/scalogram"
#: Of the picture: columns over all seconds, and frequencies.
COLUMNS, ROWS = 500, 40


class EstimatedRegion(BoxItem):
    """What wavelets have not passed yet: right of a dashed line, below a thin wash."""

    def __init__(self, box: pg.ViewBox) -> None:
        super().__init__(box)
        #: Up to which second before now each row is complete, from the top.
        self.complete: Real = np.zeros(0)

    def paint(self, painter: QPainter, *_: object) -> None:
        plot, theme = self.box.rect(), colours()
        x = np.clip(1.0 + self.complete / SECONDS, 0.0, 1.0) * plot.width()
        y = (np.arange(len(x)) + 0.5) * plot.height() / len(x)
        edge = [QPointF(*point) for point in zip(x.tolist(), y.tolist(), strict=True)]
        edge = [QPointF(edge[0].x(), plot.top()), *edge, QPointF(edge[-1].x(), plot.bottom())]
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(translucent(theme.background, 0.35))
        painter.drawPolygon(QPolygonF([*edge, plot.bottomRight(), plot.topRight()]))
        pen = QPen(translucent(theme.text, 0.7), 1.0)
        pen.setDashPattern([4.0, 3.0])
        painter.setPen(pen)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawPolyline(QPolygonF(edge))
        line, face, right = "estimated", text_size.font(), plot.right() - 6
        if plot.right() - edge[-1].x() > text.width(line, face) + 16:
            y = plot.bottom() - text_size.pixels(11)
            text.draw_text(painter, right, y, line, face=face, ink=QColor(theme.text), align=1.0)


class LiveScalogramView(LivePlot):
    """The scalogram of one channel; computed only while it can be seen.

    Its time axis agrees with that of the live view.
    """

    def __init__(self, controller: CaptureController, jobs: Jobs, live_view: QWidget) -> None:
        super().__init__(controller)
        self._jobs, self._live_view = jobs, live_view
        #: Empty for none.
        self.channel = settings.text(CHANNEL)
        #: The newest picture.
        self.strip: RollingImage | None = None
        self._problem = ""
        self._tried_rates: tuple[float, ...] = ()
        self.box = self.add_box(inverted=True)
        self._image = ScalogramImage()
        self._drawn: RollingImage | None = None  # the picture that is in the image
        self.box.addItem(self._image, ignoreBounds=True)
        self._estimated = EstimatedRegion(self.box)
        self._frequencies = FrequencyAxis(free=6.0)
        self._frequencies.setStyle(tickLength=3)
        self._frequencies.setWidth(gutter() - APART)
        self._frequencies.linkToView(self.box)
        self.addItem(self._frequencies)
        self.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        self.setAccessibleName("Live scalogram")
        self.setToolTip(
            "Right of the line the picture is estimated, as wavelets have not passed yet: "
            "several times a second, each time better."
        )
        self.hide()

    def choose(self, channel: str) -> None:
        """Show a channel, or none."""
        if channel != self.channel:
            self.channel = channel
            settings.store(CHANNEL, channel)
            self._stop()
            self._forget()
            self._changed()
            self._begin()

    # Qt

    def sizeHint(self) -> QSize:
        """High enough to tell octaves apart."""
        return QSize(520, 150)

    def minimumSizeHint(self) -> QSize:
        return QSize(280, 70)

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._begin()

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self._stop()

    # Drawing

    @property
    def plot(self) -> QRectF:
        """The area of the picture: as wide as the live view, which may have a scroll bar."""
        return QRectF(gutter(), 0, plot_width(self._live_view.width()), self.height() - 2)

    def follow(self) -> None:
        """Put the picture where its time is now."""
        strip, plot = self.strip, self.plot
        for item in (self.box, self._frequencies):
            item.setVisible(strip is not None)
        if strip is None:
            return
        self.box.setGeometry(plot)
        self._frequencies.setWidth(gutter() - APART)
        self._frequencies.setGeometry(QRectF(0, 0, gutter() - APART, plot.height()))
        # Rows are as high as their distance.
        half = math.sqrt(strip.hertz[0] / strip.hertz[1])
        top, bottom = (
            -math.log(FOURIER_FACTOR * hertz)
            for hertz in (strip.hertz[0] * half, strip.hertz[-1] / half)
        )
        if strip is not self._drawn:
            self._drawn = strip
            self._image.show_values(strip.values, (strip.low, strip.high))
            self.box.setYRange(top, bottom, padding=0)
        now = self._controller.now
        self._image.setRect(QRectF(strip.start - now, top, strip.end - strip.start, bottom - top))
        self._estimated.complete = strip.complete - now

    def restyle(self) -> None:
        self._drawn = None
        super().restyle()

    def paint_background(self, painter: QPainter) -> None:
        """Draw the gutter with the legend of the colours."""
        painter.fillRect(QRectF(0, 0, gutter(), self.height()), QColor(colours().panel))
        strip, bar = self.strip, QRectF(8.5, 8.5, 6, self.plot.height() - 18)
        if strip is not None and bar.height() >= 40:
            ends = amount_text(10**strip.low), amount_text(10**strip.high)
            draw_bar(painter, bar, ends)

    def paint_foreground(self, painter: QPainter) -> None:
        """Name the channel, and what went wrong."""
        plot, line = self.plot, self._problem
        if self.strip is None:
            line = line or "Waiting for samples…"
        name = f"{self.channel}: {line}" if line else self.channel
        draw_plate(painter, plot.topLeft(), name, plot, quiet=not self._problem)

    # Computing

    def _ticked(self) -> None:
        if self._problem and self._rates() != self._tried_rates:
            self._begin()  # a device without a rate is known better by now
        super()._ticked()

    def _rates(self) -> tuple[float, ...]:
        """Whole samples a second of each device, as measured; 0 where that is not known yet."""
        state = self._controller.state
        return () if state is None else tuple(round(d.rate, 0) for d in state.devices)

    def _changed(self) -> None:
        """Be visible where there is something to show."""
        if not self._controller.connected:
            self._forget()
        self.setVisible(bool(self.channel) and self._controller.connected)

    def _begin(self) -> None:
        if self._jobs.awaits(DRAWING) or not self.isVisible():
            return
        self._problem = ""
        self._tried_rates = self._rates()
        create = partial(_build_scalogram, self.channel, self._tried_rates)
        job = self._controller.connection.draw_scalogram(create)
        self._jobs.run(job, lambda _: None, self._failed, self._set_strip, key=DRAWING)

    def _stop(self) -> None:
        """Draw no more; the last picture stays, to be seen at once when this is shown again."""
        self._jobs.cancel(DRAWING)

    def _forget(self) -> None:
        """The picture is of another channel, or of other devices."""
        self.strip = self._drawn = None
        self.invalidate()

    def _failed(self, error: Exception) -> None:
        self._forget()
        self._problem = str(error) if isinstance(error, ForcelabError) else type(error).__name__
        self.update()

    def _set_strip(self, strip: RollingImage | None) -> None:
        if strip is not None:
            self.strip = strip
            self.invalidate()  # the legend may have other ends


def _build_scalogram(channel: str, rates: Sequence[float], recorder: Recorder) -> LiveScalogram:
    from forcelab.live.scalogram import LiveScalogram

    return LiveScalogram(recorder, channel, SECONDS, COLUMNS, ROWS, rates)


class ScalogramChoice(ElidedComboBox):
    """Offers the channels of the devices that are connected."""

    def __init__(self, controller: CaptureController, view: LiveScalogramView) -> None:
        super().__init__()
        self._controller, self._view = controller, view
        self._offered: tuple[str, ...] | None = None
        self.setAccessibleName("Channel of the live scalogram")
        self.activated.connect(self._chosen)
        controller.changed.connect(self._refresh)
        self._refresh()

    def _refresh(self) -> None:
        """Offer what there is; the chosen one is offered even while nothing is connected."""
        channels = self._controller.connection.channels
        names: tuple[str, ...] = ()
        if channels:
            from forcelab.live.scalogram import channels_to_show

            names = channels_to_show(channels)
        chosen = self._view.channel
        if chosen and chosen not in names:
            names = (*names, chosen)
        if names != self._offered:
            self._offered = names
            self.clear()
            self.addItem("not shown", "")
            for name in names:
                self.addItem(name, name)
        self.setCurrentIndex(self.findData(chosen))

    def _chosen(self, row: int) -> None:
        self._view.choose(str(self.itemData(row)))
