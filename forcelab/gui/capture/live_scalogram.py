"""The live scalogram of one channel, and the choice of the channel."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import (
    QColor,
    QHideEvent,
    QImage,
    QPainter,
    QPaintEvent,
    QPen,
    QPolygonF,
    QShowEvent,
)
from PySide6.QtWidgets import QSizePolicy, QWidget

from forcelab.errors import ForcelabError
from forcelab.gui import settings
from forcelab.gui.capture.controller import CaptureController
from forcelab.gui.capture.live_plot import SECONDS, gutter, live_axis
from forcelab.gui.figures.axes import Axis
from forcelab.gui.jobs import Job, Jobs
from forcelab.gui.label import scalogram_painting as drawing
from forcelab.gui.label.scalogram_painting import FOURIER_FACTOR
from forcelab.gui.theme import colours, themes
from forcelab.gui.widgets import ElidedComboBox

if TYPE_CHECKING:
    from forcelab.capture.device import Device
    from forcelab.capture.recorder import Recorder
    from forcelab.live.scalogram import LiveScalogram, RollingImage


#: The key of its job, and where the channel that was chosen last is remembered.
DRAWING, CHANNEL = "capture: live scalogram", "capture/scalogram"
#: Of the picture: columns over all seconds, and frequencies.
COLUMNS, ROWS = 500, 40


class LiveScalogramView(QWidget):
    """The scalogram of one channel; computed only while it can be seen.

    Its time axis agrees with that of the live view.
    """

    def __init__(self, controller: CaptureController, jobs: Jobs, live_view: QWidget) -> None:
        super().__init__()
        self._controller, self._jobs, self._live_view = controller, jobs, live_view
        #: Empty for none.
        self.channel = settings.text(CHANNEL)
        #: The newest picture.
        self.strip: RollingImage | None = None
        self._problem = ""
        self._tried_rates: tuple[float, ...] = ()
        self._job: Job | None = None
        self._image: tuple[RollingImage, bool, QImage] | None = None
        self.setAccessibleName("Live scalogram")
        self.setToolTip(
            "Right of the line the picture is estimated, as wavelets have not passed yet: "
            "several times a second, each time better."
        )
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.hide()
        controller.ticked.connect(self._ticked)
        controller.changed.connect(self._changed)
        themes().changed.connect(self.update)

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
        """A few rows."""
        return QSize(280, 70)

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._begin()

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self._stop()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the picture where its time is now."""
        with QPainter(self) as painter:
            theme = colours()
            painter.fillRect(self.rect(), QColor(theme.background))
            left, right = gutter(self.fontMetrics()), float(self._live_view.width())
            plot = QRectF(left, 0, max(right - left, 50), self.height() - 2)
            strip = self.strip
            if strip is not None:
                axis = live_axis(self._controller.now, plot)
                self._paint_picture(painter, plot, axis, strip)
                self._paint_gutter(painter, plot, strip)
            line = self._problem or ("" if strip is not None else "Waiting for samples…")
            name = self.channel if not line else f"{self.channel}: {line}"
            corner = plot.topLeft() + QPointF(2, 2)
            drawing.draw_plate(painter, corner, name, theme, plot, quiet=not self._problem)

    def _ticked(self) -> None:
        if self.isVisible():
            if self._problem and self._rates() != self._tried_rates:
                self._begin()  # a device without a rate is known better by now
            self.update()

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
        if self._job is not None or not self.isVisible():
            return
        self._problem = ""
        self._tried_rates = self._rates()
        create = partial(_build_scalogram, self.channel, self._tried_rates)
        job = self._controller.connection.draw_scalogram(create)
        self._job = self._jobs.run(job, self._ended, self._failed, self._set_strip, key=DRAWING)

    def _stop(self) -> None:
        if self._job is not None:
            self._job.cancel()
        # The last picture stays until there is a new one, to be seen at once when shown again.
        self._job = None

    def _forget(self) -> None:
        """The picture is of another channel, or of other devices."""
        self.strip = self._image = None

    def _ended(self, _: None) -> None:
        """The devices were released."""
        self._job = None

    def _failed(self, error: Exception) -> None:
        self._job = None
        self._forget()
        self._problem = str(error) if isinstance(error, ForcelabError) else type(error).__name__
        self.update()

    def _set_strip(self, strip: RollingImage | None) -> None:
        if strip is not None:
            self.strip = strip

    def _paint_picture(
        self, painter: QPainter, plot: QRectF, axis: Axis, strip: RollingImage
    ) -> None:
        dark = colours().dark
        if self._image is None or self._image[0] is not strip or self._image[1] != dark:
            image = drawing.magnitudes(strip.values, strip.low, strip.high, dark)
            self._image = strip, dark, image
        first, last = axis.at(strip.start), axis.at(strip.end)
        painter.save()
        painter.setClipRect(plot)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        painter.drawImage(QRectF(first, plot.top(), last - first, plot.height()), self._image[2])
        self._paint_early(painter, plot, axis, strip)
        painter.restore()

    def _paint_early(
        self, painter: QPainter, plot: QRectF, axis: Axis, strip: RollingImage
    ) -> None:
        """Mark what is estimated: right of a line, below a thin wash."""
        step = plot.height() / len(strip.complete)
        edge = [
            QPointF(min(max(axis.at(at), plot.left()), plot.right()), plot.top() + (i + 0.5) * step)
            for i, at in enumerate(strip.complete.tolist())
        ]
        edge = [QPointF(edge[0].x(), plot.top()), *edge, QPointF(edge[-1].x(), plot.bottom())]
        shape = QPolygonF([*edge, plot.bottomRight(), plot.topRight()])
        wash, line = QColor(colours().background), QColor(colours().text)
        wash.setAlphaF(0.35)
        line.setAlphaF(0.7)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(wash)
        painter.drawPolygon(shape)
        pen = QPen(line, 1.0)
        pen.setDashPattern([4.0, 3.0])
        painter.setPen(pen)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawPolyline(QPolygonF(edge))
        label = "estimated"
        face = painter.fontMetrics()
        room = plot.right() - edge[-1].x()
        if room > face.horizontalAdvance(label) + 16:
            painter.setPen(QColor(colours().text))
            at = QPointF(plot.right() - face.horizontalAdvance(label) - 6, plot.bottom() - 6)
            painter.drawText(at, label)

    def _paint_gutter(self, painter: QPainter, plot: QRectF, strip: RollingImage) -> None:
        """The axis in Hz, and the legend of the colours."""
        half = math.sqrt(strip.hertz[0] / strip.hertz[1])  # rows are as high as their distance
        rows = drawing.Rows(
            plot.top(),
            plot.bottom(),
            1.0 / (FOURIER_FACTOR * strip.hertz[0] * half),
            1.0 / (FOURIER_FACTOR * strip.hertz[-1] / half),
            FOURIER_FACTOR,
            1.0,
        )
        drawing.draw_frequencies(painter, plot.left(), rows, colours(), plot.top() + 6)
        bar = QRectF(8.5, plot.top() + 8.5, 6, plot.height() - 18)
        if bar.height() >= 40:
            ends = drawing.amount_text(10**strip.low), drawing.amount_text(10**strip.high)
            drawing.draw_bar(painter, bar, ends, False, colours())


def _build_scalogram(
    channel: str, rates: Sequence[float], recorder: Recorder, devices: Sequence[Device]
) -> LiveScalogram:
    from forcelab.live.scalogram import LiveScalogram

    return LiveScalogram(recorder, devices, channel, SECONDS, COLUMNS, ROWS, rates)


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
