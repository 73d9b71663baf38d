"""The overview: the visible span of the whole demonstration as a window to take hold of."""

from __future__ import annotations

from typing import Literal

import numpy as np
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QMouseEvent, QWheelEvent
from PySide6.QtWidgets import QApplication

from forcelab.gui.document import Document
from forcelab.gui.label.force import ForcePanel
from forcelab.gui.label.overview_picture import OverviewPicture
from forcelab.gui.panel import ZOOM_STEP

__all__ = ["Overview"]

#: How far from an edge of the window it can still be taken hold of, in pixels.
REACH = 6.0

Handle = Literal["start", "end", "body", "new"]


class Overview(OverviewPicture):
    """The whole demonstration in small, and what can be done with it by mouse.

    Dragging the window pans, dragging its edges zooms, dragging elsewhere shows another span; a
    click centres the window there and moves the cursor.
    """

    def __init__(self, document: Document, force: ForcePanel) -> None:
        super().__init__(document, force)
        self._held: Handle | None = None
        self._press = QPointF()
        self._span = (0.0, 1.0)
        self._moved = False
        self.setMouseTracking(True)

    def time_at(self, x: float) -> float:
        """The time in seconds of a pixel, within the demonstration."""
        low, high = self.document.bounds
        return min(max(self.axis.value(x), low), high)

    def handle_at(self, x: float) -> Handle:
        """What is taken hold of at a pixel."""
        box = self.window_box
        inside = min(REACH, box.width() / 4)
        if box.left() - REACH <= x <= box.left() + inside:
            return "start"
        if box.right() - inside <= x <= box.right() + REACH:
            return "end"
        whole = self.document.end - self.document.start >= np.ptp(self.document.bounds)
        return "body" if box.left() < x < box.right() and not whole else "new"

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Take hold of the window, of one of its edges, or begin another span."""
        if event.button() == Qt.MouseButton.LeftButton and self.document.demonstration is not None:
            self._held = self.handle_at(event.position().x())
            self._press = event.position()
            self._span = (self.document.start, self.document.end)
            self._moved = False
            if self._held == "body":
                self.setCursor(Qt.CursorShape.ClosedHandCursor)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Pan, zoom or choose a span."""
        x = event.position().x()
        if self._held is None:
            self._hint(x)
            return
        far = abs(x - self._press.x()) >= QApplication.startDragDistance()
        self._moved = self._moved or far
        if not self._moved:
            return
        low, high = self.document.bounds
        start, end = self._span
        by = (x - self._press.x()) / self.plot.width() * (high - low)
        if self._held == "body":
            by = min(max(by, low - start), high - end)
            self.document.set_span(start + by, end + by)
        elif self._held == "new":
            first, last = sorted((self.time_at(self._press.x()), self.time_at(x)))
            self._band = (first, last)
            self.update()
        else:
            fixed, free = (end, start) if self._held == "start" else (start, end)
            first, last = sorted((fixed, min(max(free + by, low), high)))
            self.document.set_span(first, last)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Show the chosen span; a click centres the window and moves the cursor."""
        if event.button() != Qt.MouseButton.LeftButton or self._held is None:
            return
        band, self._held, self._band = self._band, None, None
        if not self._moved:
            time, half = self.time_at(event.position().x()), (self._span[1] - self._span[0]) / 2
            low, high = self.document.bounds
            middle = min(max(time, low + half), high - half)
            self.document.set_span(middle - half, middle + half)
            self.document.seek(time)
        elif band is not None:
            self.document.set_span(*band)
        self._hint(event.position().x())
        self.update()

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom about the middle of the window; with Shift, pan by a tenth of it."""
        angle = event.angleDelta()
        notches = (angle.y() or angle.x()) / 120.0
        start, end = self.document.start, self.document.end
        if event.modifiers() & Qt.KeyboardModifier.ShiftModifier:
            self.document.pan(-notches * 0.1 * (end - start))
        else:
            self.document.zoom(ZOOM_STEP**-notches, (start + end) / 2)
        event.accept()

    def _hint(self, x: float) -> None:
        """Let the pointer tell what can be taken hold of."""
        shapes = {
            "start": Qt.CursorShape.SizeHorCursor,
            "end": Qt.CursorShape.SizeHorCursor,
            "body": Qt.CursorShape.OpenHandCursor,
            "new": Qt.CursorShape.CrossCursor,
        }
        self.setCursor(shapes[self.handle_at(x)])
