"""A small picture of a video's motion and the force, put together by a clock."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QLineF, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QWidget

from forcelab.clock import ClockMap
from forcelab.gui.document import Document
from forcelab.gui.theme import colours, themes
from forcelab.signals.synchronising import Proposal

__all__ = ["AlignmentPlot"]


class AlignmentPlot(QWidget):
    """Motion upwards and change of force downwards from a line between them, on the force clock.

    Where the clock is right their peaks meet. A click moves the cursor.
    """

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.document = document
        self._proposal: Proposal | None = None
        self._clock = ClockMap()
        self._taps: tuple[float, ...] = ()
        self._note = ""
        self.setAccessibleName(self.tr("Motion of the video and change of the force"))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        document.cursor_moved.connect(self._repaint)
        themes().changed.connect(self._repaint)

    def sizeHint(self) -> QSize:
        """Room for two curves and an axis."""
        return QSize(480, 9 * self.fontMetrics().height())

    def minimumSizeHint(self) -> QSize:
        """As :meth:`sizeHint`: less cannot be read."""
        return self.sizeHint()

    def show_signals(self, proposal: Proposal | None, note: str = "") -> None:
        """Show what was compared, or a sentence in its place."""
        self._proposal, self._note = proposal, note
        self.update()

    def show_clock(self, clock: ClockMap, taps: tuple[float, ...]) -> None:
        """Put the two together by this clock; `taps` are marked at their force times (s)."""
        self._clock, self._taps = clock, taps
        self.update()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Move the cursor to where the click was."""
        if event.button() == Qt.MouseButton.LeftButton and self._proposal is not None:
            box, (start, end) = self._box(), self.document.bounds
            share = (event.position().x() - box.left()) / max(box.width(), 1.0)
            self.document.seek(start + min(max(share, 0.0), 1.0) * (end - start))

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw everything."""
        c = colours()
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        box = self._box()
        painter.fillRect(self.rect(), QColor(c.panel))
        painter.fillRect(box, QColor(c.background))
        if self._proposal is None:
            painter.setPen(QColor(c.muted))
            flags = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
            painter.drawText(box.adjusted(12, 4, -12, -4), int(flags), self._note)
        else:
            self._paint_signals(painter, box, self._proposal)
        painter.setPen(QPen(QColor(c.frame), 1))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRect(box)
        painter.end()

    def changeEvent(self, event: QEvent) -> None:
        """Another font makes another size."""
        if event.type() == QEvent.Type.FontChange:
            self.updateGeometry()
        super().changeEvent(event)

    def _repaint(self) -> None:
        """Draw again, with what has moved."""
        self.update()

    def _box(self) -> QRectF:
        """The area of the curves; the names stand above it, the axis below."""
        line = self.fontMetrics().height()
        return QRectF(0.5, line + 6.5, self.width() - 1.0, self.height() - 2.0 * line - 11.0)

    def _paint_signals(self, painter: QPainter, box: QRectF, proposal: Proposal) -> None:
        """The curves, the taps, the cursor, the axis and the names."""
        c = colours()
        middle, high = box.center().y(), box.height() / 2.0 - 4.0
        self._paint_axis(painter, box)
        painter.save()
        painter.setClipRect(box)
        painter.setPen(QPen(QColor(c.frame), 1))
        painter.drawLine(QLineF(box.left(), middle, box.right(), middle))
        motion, force = proposal.motion, proposal.force
        seen = self._clock.to_force(motion[0])
        for times, values, colour, way in (
            (seen, motion[1], c.curves[0], -1.0),
            (force[0], force[1], c.curves[1], 1.0),
        ):
            shape = self._outline(times, values, box, middle, way * high)
            painter.setPen(QPen(QColor(colour), 1))
            fill = QColor(colour)
            fill.setAlpha(110)
            painter.setBrush(fill)
            painter.drawPolygon(shape)
        painter.setPen(QPen(QColor(c.hint), 1.5, Qt.PenStyle.DashLine))
        for tap in self._taps:
            x = self._x(tap, box)
            painter.drawLine(QLineF(x, box.top(), x, box.bottom()))
        painter.setPen(QPen(QColor(c.cursor), 1))
        x = self._x(self.document.cursor, box)
        painter.drawLine(QLineF(x, box.top(), x, box.bottom()))
        painter.restore()
        left = box.left() + 2.0
        for text, colour in (
            (self.tr("up: motion in the video"), c.curves[0]),
            (self.tr("down: change of the force"), c.curves[1]),
            (self.tr("dashed: taps"), c.hint),
        ):
            left = self._paint_name(painter, left, text, colour)

    def _paint_name(self, painter: QPainter, left: float, text: str, colour: str) -> float:
        """A name with its colour above the curves; gives where the next one stands."""
        metrics = self.fontMetrics()
        side = 0.6 * metrics.ascent()
        painter.fillRect(QRectF(left, 2 + metrics.ascent() - side, side, side), QColor(colour))
        painter.setPen(QColor(colours().text))
        painter.drawText(QPointF(left + 1.6 * side, 2 + metrics.ascent()), text)
        return left + 1.6 * side + metrics.horizontalAdvance(text) + 2.5 * side

    def _paint_axis(self, painter: QPainter, box: QRectF) -> None:
        """Times below, with thin lines upwards."""
        c = colours()
        start, end = self.document.bounds
        metrics = self.fontMetrics()
        step = _round_step((end - start) * 4.0 * metrics.horizontalAdvance("000.0") / box.width())
        digits = max(0, -math.floor(math.log10(step) + 1e-9))
        tick = math.ceil(start / step) * step
        while tick <= end:
            x = self._x(tick, box)
            painter.setPen(QPen(QColor(c.grid), 1))
            painter.drawLine(QLineF(x, box.top(), x, box.bottom()))
            text = f"{tick:.{digits}f} s"
            wide = metrics.horizontalAdvance(text)
            left = min(max(x - wide / 2.0, 0.0), self.width() - wide)
            painter.setPen(QColor(c.muted))
            painter.drawText(QPointF(left, box.bottom() + 2 + metrics.ascent()), text)
            tick += step

    def _x(self, time: float, box: QRectF) -> float:
        """Where a force time (s) stands."""
        start, end = self.document.bounds
        return box.left() + (time - start) / max(end - start, 1e-9) * box.width()

    def _outline(
        self,
        times: NDArray[np.float64],
        values: NDArray[np.float64],
        box: QRectF,
        middle: float,
        high: float,
    ) -> QPolygonF:
        """The largest value of each pixel as the edge of an area that stands on the middle line."""
        start, end = self.document.bounds
        wide = max(int(box.width()), 1)
        pixel = np.floor((times - start) / max(end - start, 1e-9) * wide).astype(np.int64)
        inside = (pixel >= 0) & (pixel < wide)
        tops = np.zeros(wide)
        np.maximum.at(tops, pixel[inside], values[inside])
        places = np.arange(wide)
        if inside.any():  # a curve drawn with fewer points than pixels has no holes
            known = np.unique(pixel[inside])
            tops = np.interp(places, known, tops[known], left=0.0, right=0.0)
        points = [QPointF(box.left(), middle)]
        points += [
            QPointF(box.left() + x + 0.5, middle + high * y)
            for x, y in zip(places.tolist(), tops.tolist(), strict=True)
        ]
        points.append(QPointF(box.right(), middle))
        return QPolygonF(points)


def _round_step(least: float) -> float:
    """The next of 1, 2, 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(max(least, 1e-6)))
    return next(power * m for m in (1.0, 2.0, 5.0, 10.0) if power * m >= least * (1 - 1e-9))
