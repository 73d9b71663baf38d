"""The overview: the whole demonstration, and the visible span as a window to drag."""

from __future__ import annotations

from typing import Literal

import numpy as np
from PySide6.QtCore import QLineF, QPointF, QRect, QRectF, Qt, QTimer
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPen
from PySide6.QtWidgets import QApplication, QSizePolicy

from forcelab.gui.document import Document
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis
from forcelab.gui.figures.colormap import translucent
from forcelab.gui.kit import text_size
from forcelab.gui.kit.time_panel import TimeView
from forcelab.gui.kit.traces import column_edges
from forcelab.gui.label.lanes import Lane, axis_of, span_of, spanning
from forcelab.gui.label.ruler import LONGEST_IN_SECONDS, clock_time
from forcelab.gui.label.traces import ChannelTrace, ForcePanel
from forcelab.gui.label.track_painting import paint_row
from forcelab.gui.theme import colours

#: Height of the overview, and of the strip with the coder's track, in pixels.
HEIGHT = 58
TRACK_HEIGHT = 10.0
#: Milliseconds from an edit to the strip that shows it: the track itself is painted first.
PAUSE = 40
#: A window narrower than this is drawn so wide.
NARROWEST_WINDOW = 3.0
#: How far from an edge of the window it can still be grabbed, in pixels.
HANDLE_REACH = 6.0

Handle = Literal["start", "end", "body", "new"]


class WholeTrace(ChannelTrace):
    """The curve of a channel over the whole demonstration, without dots at its samples."""

    opaque = 0.75

    def samples(self, start: float, end: float, width: float) -> None:
        return None


class Overview(TimeView):
    """The whole demonstration in small, and what can be done with it by mouse.

    Dragging the window pans, dragging its edges zooms, dragging elsewhere shows another span; a
    click centres the window there and moves the cursor.
    """

    def __init__(self, document: Document, force: ForcePanel) -> None:
        super().__init__(document)
        self.source = force.source
        self._traces: list[WholeTrace] = []
        #: What the scales were made for.
        self._fitted: object = None
        #: The span that is being chosen.
        self._band: tuple[float, float] | None = None
        self.setAccessibleName("Overview of the whole demonstration")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.source.choices_changed.connect(self.place)
        self.source.data_read.connect(self.invalidate)
        self._track_timer = QTimer(self, singleShot=True, interval=PAUSE)
        self._track_timer.timeout.connect(self.invalidate)
        for painted in (document.tracks_changed, document.vocabulary_changed):
            painted.connect(self._track_timer.start)
        document.view.span_changed.connect(self._repaint)
        document.view.cursor_moved.connect(self._cursor_moved)
        self.scene().sigPrepareForPaint.connect(self._fit)
        self._cursor = 0.0  # where it was drawn, in pixels
        self._handle: Handle | None = None
        self._press = QPointF()
        self._span = (0.0, 1.0)
        self._dragging = False
        self.fit_text()

    # Geometry

    @property
    def axis(self) -> Axis:
        """From seconds to pixels."""
        return Axis(*self.document.view.bounds, self.plot.left(), self.plot.right())

    @property
    def window_box(self) -> QRectF:
        """The visible span, in pixels; narrow ones are drawn wider."""
        left, right = self.axis.at(self.document.view.start), self.axis.at(self.document.view.end)
        spare = max(NARROWEST_WINDOW - (right - left), 0.0) / 2
        return QRectF(left - spare, 0.0, right - left + 2 * spare, self.height())

    @property
    def _track_height(self) -> float:
        return round(text_size.pixels(TRACK_HEIGHT))

    @property
    def _curves_height(self) -> float:
        return self.height() - self._track_height - 2

    # Drawing

    def fit_text(self) -> None:
        self.setFixedHeight(round(text_size.pixels(HEIGHT)))
        self._fitted = None
        super().fit_text()

    def place(self) -> None:
        """Lay the curves of all shown channels over each other."""
        source, plot = self.source, self.plot
        while len(self._traces) < len(source.channels):
            self._traces.append(WholeTrace(source, self.add_box(), len(self._traces)))
        for column, trace in enumerate(self._traces):
            shown = column < len(source.names) and source.names[column] in source.shown
            trace.box.setVisible(shown)
            trace.box.setGeometry(QRectF(plot.left(), 0, plot.width(), self._curves_height))
            trace.box.setXRange(*self.document.view.bounds, padding=0)
        self.invalidate()

    def _fit(self) -> None:
        """Let those of one unit have one scale that holds their values, as far as they are read."""
        source = self.source
        state = source.revision, source.shown, self.width(), self.devicePixelRatioF()
        if self.document.demonstration is None or not self._traces or state == self._fitted:
            return
        self._fitted = state
        edges = column_edges(self._traces[0].box, self.devicePixelRatioF())[1]
        _, extremes = source.extremes(edges)
        shown = [i for i, name in enumerate(source.names) if name in source.shown]
        for unit in {source.channels[i].unit for i in shown}:
            same = [i for i in shown if source.channels[i].unit == unit]
            lane = Lane(tuple(same), "", "", 0.0, self._curves_height)
            axis = axis_of(lane, spanning(span_of(extremes[source.names[i]]) for i in same))
            for i in same:
                box = self._traces[i].box
                box.setYRange(axis.value(self._curves_height), axis.value(0.0), padding=0)

    def paint_background(self, painter: QPainter) -> None:
        """Draw the coder's track, and how long the demonstration is."""
        theme, plot, document = colours(), self.plot, self.document
        painter.fillRect(self.rect(), QColor(theme.panel))
        painter.fillRect(plot, QColor(theme.background))
        if document.demonstration is not None:
            low, high = document.view.bounds
            face, short = text_size.font(10), high - low <= LONGEST_IN_SECONDS
            length = f"{high - low:.1f} s" if short else clock_time(high - low)
            above, below = text_size.pixels(11), text_size.pixels(3)
            middle, ink = self.height() / 2, QColor(theme.muted)
            for y, line in ((middle - above, "whole"), (middle + below, length)):
                text.draw_text(painter, 6.0, y, line, face=face, ink=ink)
            high = self._track_height
            strip = QRectF(plot.left(), self.height() - high - 1, plot.width(), high)
            paint_row(
                painter,
                strip,
                self.axis,
                document.editor.segments,
                vocabulary=document.vocabulary,
                theme=theme,
                size=text_size.pixels(8),
            )
        painter.setPen(QPen(QColor(theme.panel_edge), 1))
        painter.drawLine(QLineF(0, 0.5, self.width(), 0.5))

    def paint_foreground(self, painter: QPainter) -> None:
        """Draw the visible span, the span that is being chosen, and the cursor."""
        if self.document.demonstration is None:
            return
        theme, plot, box = colours(), self.plot, self.window_box
        painter.setClipRect(plot.adjusted(-1, 0, 1, 0))
        veil = translucent(theme.panel, 0.6)
        painter.fillRect(QRectF(plot.left(), 1, box.left() - plot.left(), self.height()), veil)
        painter.fillRect(QRectF(box.right(), 1, plot.right() - box.right(), self.height()), veil)
        accent = QColor(theme.accent)
        frame = QRectF(QPointF(round(box.left()), 0), QPointF(round(box.right()), self.height()))
        painter.setPen(QPen(accent, 2))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRect(frame.adjusted(1, 1, -1, -1))
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(accent)
        apart = max(8.0 - frame.width() / 2, 0.0)  # handles of a narrow window stand beside it
        for x in (frame.left() + 1 - apart, frame.right() - 1 + apart):
            painter.drawRoundedRect(QRectF(x - 3, self.height() / 2 - 9, 6, 18), 2, 2)
        if self._band is not None:
            wash = translucent(theme.range, 0.25)
            left, right = (self.axis.at(time) for time in self._band)
            painter.fillRect(QRectF(left, 0, right - left, self.height()), wash)
        self._cursor = self.axis.at(self.document.view.cursor)
        self.paint_cursor(painter, self._cursor)

    def _repaint(self, *_: object) -> None:
        if self.isVisible():
            self.update()

    def _cursor_moved(self, time: float) -> None:
        """Draw again where the cursor was and is."""
        for x in (self._cursor, self.axis.at(time)) if self.isVisible() else ():
            self.update(QRect(round(x) - 2, 0, 5, self.height()))

    def time_at(self, x: float) -> float:
        """The time in seconds of a pixel, within the demonstration."""
        low, high = self.document.view.bounds
        return min(max(self.axis.value(x), low), high)

    def handle_at(self, x: float) -> Handle:
        """Which part of the window a drag from a pixel would move."""
        box = self.window_box
        inside = min(HANDLE_REACH, box.width() / 4)
        if box.left() - HANDLE_REACH <= x <= box.left() + inside:
            return "start"
        if box.right() - inside <= x <= box.right() + HANDLE_REACH:
            return "end"
        view = self.document.view
        whole = view.end - view.start >= np.ptp(view.bounds)
        return "body" if box.left() < x < box.right() and not whole else "new"

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Begin to drag the window, one of its edges, or another span."""
        if event.button() == Qt.MouseButton.LeftButton and self.document.demonstration is not None:
            self._handle = self.handle_at(event.position().x())
            self._press = event.position()
            self._span = (self.document.view.start, self.document.view.end)
            self._dragging = False
            if self._handle == "body":
                self.setCursor(Qt.CursorShape.ClosedHandCursor)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Pan, zoom or choose a span."""
        x = event.position().x()
        if self._handle is None:
            self._set_pointer(x)
            return
        far = abs(x - self._press.x()) >= QApplication.startDragDistance()
        self._dragging = self._dragging or far
        if not self._dragging:
            return
        low, high = self.document.view.bounds
        start, end = self._span
        shift = (x - self._press.x()) / self.plot.width() * (high - low)
        if self._handle == "body":
            shift = min(max(shift, low - start), high - end)
            self.document.view.set_span(start + shift, end + shift)
        elif self._handle == "new":
            first, last = sorted((self.time_at(self._press.x()), self.time_at(x)))
            self._band = (first, last)
            self.update()
        else:
            fixed, free = (end, start) if self._handle == "start" else (start, end)
            first, last = sorted((fixed, min(max(free + shift, low), high)))
            self.document.view.set_span(first, last)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Show the chosen span; a click centres the window and moves the cursor."""
        if event.button() != Qt.MouseButton.LeftButton or self._handle is None:
            return
        band, self._handle, self._band = self._band, None, None
        if not self._dragging:
            time, half = self.time_at(event.position().x()), (self._span[1] - self._span[0]) / 2
            low, high = self.document.view.bounds
            middle = min(max(time, low + half), high - half)
            self.document.view.set_span(middle - half, middle + half)
            self.document.view.seek(time)
        elif band is not None:
            self.document.view.set_span(*band)
        self._set_pointer(event.position().x())
        self.update()

    def zoom_centre(self, x: float) -> float:
        """Zoom about the middle of the window."""
        return (self.document.view.start + self.document.view.end) / 2

    def _set_pointer(self, x: float) -> None:
        """Show by the pointer what a drag would move."""
        shapes = {
            "start": Qt.CursorShape.SizeHorCursor,
            "end": Qt.CursorShape.SizeHorCursor,
            "body": Qt.CursorShape.OpenHandCursor,
            "new": Qt.CursorShape.CrossCursor,
        }
        self.setCursor(shapes[self.handle_at(x)])
