"""A small picture of a video's motion and the force, put together by a clock."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QLineF, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QWidget

from forcelab.clock import ClockMap
from forcelab.gui.document import Document
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis
from forcelab.gui.figures.shades import translucent
from forcelab.gui.theme import colours, themes
from forcelab.signals.sync import Proposal

__all__ = ["AlignmentPlot"]

#: Height of the times below the curves, in pixels.
NUMBER = 12.0


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
        self.setAccessibleName("Motion of the video and change of the force")
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
            self.document.seek(self._axis(self._box()).value(event.position().x()))

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw everything."""
        c = colours()
        with QPainter(self) as painter:
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
        c, axis = colours(), self._axis(box)
        middle, high = box.center().y(), box.height() / 2.0 - 4.0
        self._paint_times(painter, box, axis)
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
            painter.setPen(QPen(QColor(colour), 1))
            painter.setBrush(translucent(colour, 0.43))
            painter.drawPolygon(_outline(times, values, axis, middle, way * high))
        painter.setPen(QPen(QColor(c.hint), 1.5, Qt.PenStyle.DashLine))
        for tap in self._taps:
            x = axis.at(tap)
            painter.drawLine(QLineF(x, box.top(), x, box.bottom()))
        painter.setPen(QPen(QColor(c.cursor), 1))
        x = axis.at(self.document.cursor)
        painter.drawLine(QLineF(x, box.top(), x, box.bottom()))
        painter.restore()
        left = box.left() + 2.0
        for name, colour in (
            ("up: motion in the video", c.curves[0]),
            ("down: change of the force", c.curves[1]),
            ("dashed: taps", c.hint),
        ):
            left = self._paint_name(painter, left, name, colour)

    def _paint_name(self, painter: QPainter, left: float, name: str, colour: str) -> float:
        """A name with its colour above the curves; gives where the next one stands."""
        metrics = self.fontMetrics()
        side = 0.6 * metrics.ascent()
        painter.fillRect(QRectF(left, 2 + metrics.ascent() - side, side, side), QColor(colour))
        painter.setPen(QColor(colours().text))
        painter.drawText(QPointF(left + 1.6 * side, 2 + metrics.ascent()), name)
        return left + 1.6 * side + metrics.horizontalAdvance(name) + 2.5 * side

    def _paint_times(self, painter: QPainter, box: QRectF, axis: Axis) -> None:
        """Times below, with thin lines upwards."""
        c, face = colours(), text.font(NUMBER)
        y = box.bottom() + 2 + self.fontMetrics().height() / 2
        for time, number in axis.marks(NUMBER, upright=False):
            x = axis.at(time)
            painter.setPen(QPen(QColor(c.grid), 1))
            painter.drawLine(QLineF(x, box.top(), x, box.bottom()))
            label = f"{number} s"
            half = text.width(label, face) / 2  # at the ends they move inwards, not to be cut
            x = min(max(x, half), self.width() - half)
            text.put(painter, x, y, label, face=face, ink=QColor(c.muted), align=0.5)

    def _axis(self, box: QRectF) -> Axis:
        """From seconds on the force clock to pixels."""
        return Axis(*self.document.bounds, box.left(), max(box.right(), box.left() + 1.0))


def _outline(
    times: NDArray[np.float64], values: NDArray[np.float64], axis: Axis, middle: float, high: float
) -> QPolygonF:
    """The largest value of each pixel as the edge of an area that stands on the middle line."""
    wide = max(int(axis.finish - axis.begin), 1)
    share = (times - axis.start) / (axis.end - axis.start)
    pixel = np.floor(share * wide).astype(np.int64)
    inside = (pixel >= 0) & (pixel < wide)
    tops = np.zeros(wide)
    np.maximum.at(tops, pixel[inside], values[inside])
    places = np.arange(wide)
    if inside.any():  # a curve drawn with fewer points than pixels has no holes
        known = np.unique(pixel[inside])
        tops = np.interp(places, known, tops[known], left=0.0, right=0.0)
    edge = [
        QPointF(axis.begin + x + 0.5, middle + high * y)
        for x, y in zip(places.tolist(), tops.tolist(), strict=True)
    ]
    return QPolygonF([QPointF(axis.begin, middle), *edge, QPointF(axis.finish, middle)])
