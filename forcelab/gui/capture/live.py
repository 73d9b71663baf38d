"""The live view: one lane a channel over the last seconds, and the tracks that grow with them."""

from __future__ import annotations

import math

import numpy as np
from PySide6.QtCore import QLineF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget

from forcelab.capture.reader import DeviceState
from forcelab.gui.capture.columns import Scale, columns_of, least_span
from forcelab.gui.capture.live_axis import (
    RULER,
    SECONDS,
    column_edges,
    gutter,
    live_axis,
    paint_ruler,
)
from forcelab.gui.capture.live_scale import paint_scale, scale_width
from forcelab.gui.capture.live_tracks import ROW, paint_rows, rows_height
from forcelab.gui.capture.phase import Phase
from forcelab.gui.capture.session import Session
from forcelab.gui.figures.axes import Axis
from forcelab.gui.figures.shades import translucent
from forcelab.gui.label.force_curves import Canvas, Curve
from forcelab.gui.theme import colours, themes
from forcelab.signals.minmax import Extremes

__all__ = ["LiveView"]

#: Pixels: what a lane is higher than its name at least, free space above and below a curve.
ROOM, INSET = 6, 3


class LiveView(QWidget):
    """What comes from the devices, 30 times a second while it can be seen.

    Parameters
    ----------
    session : Session
    """

    def __init__(self, session: Session) -> None:
        super().__init__()
        self._session = session
        self._scales: dict[tuple[int, int], Scale] = {}
        self.setAccessibleName("Live channels")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        session.ticked.connect(self._ticked)
        session.changed.connect(self._changed)
        themes().changed.connect(self.update)

    def sizeHint(self) -> QSize:
        """Room for six lanes."""
        return QSize(520, 6 * 56 + ROW + RULER)

    def minimumSizeHint(self) -> QSize:
        """The least room for the lanes that there are."""
        lanes = sum(len(device.channels) for device in self._devices())
        lane = self.fontMetrics().height() + ROOM
        return QSize(280, max(lanes, 4) * lane + rows_height(self._session) + RULER)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw everything anew: everything has moved."""
        with QPainter(self) as painter:
            painter.fillRect(self.rect(), QColor(colours().background))
            if not self._session.connected:
                self._paint_centred(painter, self._invitation(), colours().muted)
            else:
                self._paint_live(painter)
            if self._session.phase is Phase.COUNTING:
                face = self.font()
                face.setPointSizeF(face.pointSizeF() * 8)
                face.setBold(True)
                painter.setFont(face)
                self._paint_centred(painter, str(self._session.left), colours().accent)
            if self.hasFocus():
                painter.setPen(QPen(QColor(colours().accent), 1))
                painter.setBrush(Qt.BrushStyle.NoBrush)
                painter.drawRect(QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5))

    # Inside

    def _devices(self) -> tuple[DeviceState, ...]:
        state = self._session.state
        return () if state is None else state.devices

    def _ticked(self) -> None:
        if self.isVisible():
            self.update()

    def _changed(self) -> None:
        if not self._session.connected:
            self._scales.clear()
        self.updateGeometry()
        self.update()

    def _invitation(self) -> str:
        """What stands where nothing is connected."""
        if self._session.phase is Phase.CONNECTING:
            return "Connecting…"
        return "Tick the devices at the left and connect them: what they measure is here."

    def _paint_centred(self, painter: QPainter, text: str, colour: str) -> None:
        painter.setPen(QColor(colour))
        box = self.rect().adjusted(24, 24, -24, -24)
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap, text)

    def _paint_live(self, painter: QPainter) -> None:
        devices, windows = self._devices(), self._session.latest(SECONDS)
        lanes = sum(len(device.channels) for device in devices)
        left, below = gutter(self.fontMetrics()), rows_height(self._session) + RULER
        plot = QRectF(left, 0, max(self.width() - left, 50), self.height() - below)
        now = self._session.now
        canvas = Canvas(plot, self.devicePixelRatioF())
        edges = column_edges(now, canvas.width)
        axis = live_axis(now, plot)
        self._paint_begin(painter, plot, axis)
        height = plot.height() / max(lanes, 1)
        lane, curves = 0, []
        for number, (device, (_, times, values)) in enumerate(zip(devices, windows, strict=False)):
            holds = device.rate == 0 and math.isnan(device.residual)
            low, high = columns_of(times, values, edges, holds)
            present = not {"unplugged", "stalled"} & set(device.alarms)  # what is read now
            for column, channel in enumerate(device.channels):
                box = QRectF(plot.left(), lane * height, plot.width(), height)
                colour = QColor(colours().curves[lane % len(colours().curves)])
                scale = self._scales.setdefault((number, column), Scale(least_span(channel)))
                seen_low, seen_high = low[:, column], high[:, column]
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
        paint_rows(painter, self._session, plot, axis, now)
        paint_ruler(painter, plot, self.height())

    def _paint_begin(self, painter: QPainter, plot: QRectF, axis: Axis) -> None:
        """Show since when it is recorded."""
        if not self._session.recording:
            return
        left = max(axis.at(self._session.begun), plot.left())
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
        said = f"{_number(value)} {unit}".strip()
        painter.drawText(gutter, middle | Qt.AlignmentFlag.AlignRight, said)


def _number(value: float) -> str:
    """A reading to a tenth; a dash where there is none."""
    if math.isnan(value):
        return "–"
    # Adding zero takes the sign from what is rounded to nothing.
    return f"{round(value, 1) + 0.0:.1f}".replace("-", "\N{MINUS SIGN}")
