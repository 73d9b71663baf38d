"""The overview: the whole demonstration, and the visible span as a window to drag."""

from __future__ import annotations

from functools import partial
from typing import Literal

import numpy as np
from PySide6.QtCore import QLineF, QPointF, QRectF, QSize, Qt, QTimer
from PySide6.QtGui import (
    QColor,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPixmap,
)
from PySide6.QtWidgets import QApplication, QSizePolicy

from forcelab.gui.document import Document
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis
from forcelab.gui.figures.colormap import translucent
from forcelab.gui.label.lanes import (
    Curve,
    CurveCanvas,
    Lane,
    axis_of,
    curve_colour,
    paint_glitches,
    span_of,
    spanning,
)
from forcelab.gui.label.ruler import LONGEST_IN_SECONDS, clock_time
from forcelab.gui.label.traces import ForcePanel
from forcelab.gui.label.track_painting import paint_row
from forcelab.gui.theme import colours
from forcelab.gui.time_panel import PixmapCache, TimeWidget

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


class Overview(TimeWidget):
    """The whole demonstration in small, and what can be done with it by mouse.

    Dragging the window pans, dragging its edges zooms, dragging elsewhere shows another span; a
    click centres the window there and moves the cursor.
    """

    def __init__(self, document: Document, force: ForcePanel) -> None:
        super().__init__(document)
        self._source = force.source
        #: The content with the coder's track, which is all that a stroke changes.
        self._picture = PixmapCache()
        #: The span that is being chosen.
        self._band: tuple[float, float] | None = None
        self.setAccessibleName("Overview of the whole demonstration")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setFixedHeight(HEIGHT)
        for changed in (self._source.choices_changed, self._source.data_read):
            changed.connect(self.invalidate)
        self._track_timer = QTimer(self, singleShot=True, interval=PAUSE)
        self._track_timer.timeout.connect(self._tracks_changed)
        for painted in (document.tracks_changed, document.vocabulary_changed):
            painted.connect(self._track_timer.start)
        document.view.span_changed.connect(self._repaint)
        document.view.cursor_moved.connect(self._repaint)
        self._handle: Handle | None = None
        self._press = QPointF()
        self._span = (0.0, 1.0)
        self._dragging = False

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

    def sizeHint(self) -> QSize:
        return QSize(900, HEIGHT)

    # Drawing

    def invalidate(self, *_: object) -> None:
        super().invalidate()
        self._picture.forget()

    def _tracks_changed(self) -> None:
        """Redraw the coder's track."""
        self._picture.forget()
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the cached picture, the window and the cursor."""
        size, ratio = self.size(), self.devicePixelRatioF()
        curves = self._content.picture(size, ratio, None, self._draw)
        picture = self._picture.picture(size, ratio, None, partial(self._draw_with_track, curves))
        with QPainter(self) as painter:
            painter.drawPixmap(0, 0, picture)
            if self.document.demonstration is not None:
                painter.setClipRect(self.plot.adjusted(-1, 0, 1, 0))
                self._paint_window(painter)

    def _draw(self, painter: QPainter) -> None:
        """Draw everything but the track."""
        theme, plot = colours(), self.plot
        painter.fillRect(self.rect(), QColor(theme.panel))
        painter.fillRect(plot, QColor(theme.background))
        if self.document.demonstration is not None:
            self._paint_curves(
                painter, QRectF(plot.left(), 0, plot.width(), HEIGHT - TRACK_HEIGHT - 2)
            )
            low, high = self.document.view.bounds
            face = text.font(10)
            length = f"{high - low:.1f}"
            short = high - low <= LONGEST_IN_SECONDS
            length = f"{length} s" if short else clock_time(high - low)
            lines = ("whole", length)
            for y, line in zip((HEIGHT / 2 - 11, HEIGHT / 2 + 3), lines, strict=True):
                text.draw_text(painter, 6.0, y, line, face=face, ink=QColor(theme.muted))
        painter.setPen(QPen(QColor(theme.panel_edge), 1))
        painter.drawLine(QLineF(0, 0.5, self.width(), 0.5))

    def _draw_with_track(self, curves: QPixmap, painter: QPainter) -> None:
        """Draw the same with the coder's track."""
        painter.drawPixmap(0, 0, curves)
        document, plot = self.document, self.plot
        if document.demonstration is not None:
            strip = QRectF(plot.left(), HEIGHT - TRACK_HEIGHT - 1, plot.width(), TRACK_HEIGHT)
            paint_row(
                painter,
                strip,
                self.axis,
                document.editor.segments,
                vocabulary=document.vocabulary,
                theme=colours(),
                size=8.0,
            )

    def _paint_curves(self, painter: QPainter, box: QRectF) -> None:
        """Draw the envelopes over each other, those of one unit on one scale."""
        source = self._source
        canvas = CurveCanvas(box, painter.device().devicePixelRatioF())
        low, high = self.document.view.bounds
        share = (canvas.edges() - box.left()) / box.width()
        columns = source.columns(low + share * (high - low))
        shown = [i for i, name in enumerate(source.names) if name in source.shown]
        lane = Lane(tuple(shown), "", "", box.top(), box.bottom())
        for unit in {source.channels[i].unit for i in shown}:
            same_unit = [i for i in shown if source.channels[i].unit == unit]
            extremes = [source.envelope(source.names[i]).drawn(columns) for i in same_unit]
            axis = axis_of(lane, spanning(map(span_of, extremes)))
            edges, theme = (box.top(), box.bottom()), colours()
            canvas.draw(
                [
                    Curve(curve, axis, curve_colour(i, theme), edges)
                    for i, curve in zip(same_unit, extremes, strict=True)
                ]
            )
        painter.setOpacity(0.75)
        canvas.paint(painter)
        painter.setOpacity(1.0)
        for i in shown:
            times, upwards = source.glitches(source.names[i], low, high)
            x = box.left() + (times - low) / (high - low) * box.width()
            paint_glitches(painter, x, upwards, (box.top(), box.bottom()), colours())

    def _paint_window(self, painter: QPainter) -> None:
        """Draw the visible span, the span that is being chosen, and the cursor."""
        theme, plot, box = colours(), self.plot, self.window_box
        veil = translucent(theme.panel, 0.6)
        painter.fillRect(QRectF(plot.left(), 1, box.left() - plot.left(), HEIGHT), veil)
        painter.fillRect(QRectF(box.right(), 1, plot.right() - box.right(), HEIGHT), veil)
        accent = QColor(theme.accent)
        frame = QRectF(QPointF(round(box.left()), 0), QPointF(round(box.right()), HEIGHT))
        painter.setPen(QPen(accent, 2))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRect(frame.adjusted(1, 1, -1, -1))
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(accent)
        apart = max(8.0 - frame.width() / 2, 0.0)  # handles of a narrow window stand beside it
        for x in (frame.left() + 1 - apart, frame.right() - 1 + apart):
            painter.drawRoundedRect(QRectF(x - 3, HEIGHT / 2 - 9, 6, 18), 2, 2)
        if self._band is not None:
            wash = translucent(theme.range, 0.25)
            left, right = (self.axis.at(time) for time in self._band)
            painter.fillRect(QRectF(left, 0, right - left, HEIGHT), wash)
        self.paint_cursor(painter, self.axis.at(self.document.view.cursor))

    def _repaint(self, *_: object) -> None:
        if self.isVisible():
            self.update()

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
        whole = self.document.view.end - self.document.view.start >= np.ptp(
            self.document.view.bounds
        )
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
