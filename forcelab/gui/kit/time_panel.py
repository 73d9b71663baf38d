"""Panels on the common time axis: one mapping, one cursor, one set of gestures."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import ClassVar

import pyqtgraph as pg
from PySide6.QtCore import QEvent, QLineF, QPointF, QRect, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QHelpEvent, QMouseEvent, QPainter, QPen, QWheelEvent
from PySide6.QtWidgets import QApplication, QSizePolicy, QToolTip

from forcelab.gui.document import Document
from forcelab.gui.figures.axes import Axis
from forcelab.gui.figures.colormap import translucent
from forcelab.gui.kit import text_size
from forcelab.gui.kit.plot import PlotView
from forcelab.gui.theme import colours

#: What one notch of the wheel makes of the visible span.
ZOOM_STEP = 1.25
#: The share of the visible span that one notch pans by.
PAN_STEP = 0.1
#: How many pixels a line takes on either side of its place, and what it blends into.
LINE = 2.0
#: Pixels from where to where something is drawn.
TimeSpan = tuple[float, float]


class TimeView(PlotView):
    """Shows time from left to right, between a gutter and a margin."""

    #: Pixels right of the time axis.
    RIGHT: ClassVar[int] = 8

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.document = document
        # What changes is marked by its panel; Qt would paint again whatever items move in a paint.
        self.setViewportUpdateMode(self.ViewportUpdateMode.NoViewportUpdate)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        document.demonstration_changed.connect(self.invalidate)

    @property
    def gutter(self) -> int:
        """Pixels left of the time axis, for names and vertical axes."""
        return round(text_size.pixels(88))

    @property
    def plot(self) -> QRectF:
        """The area of the time axis, in pixels of the widget."""
        width = max(self.width() - self.gutter - self.RIGHT, 1)
        return QRectF(self.gutter, 0.0, width, self.height())

    def sizeHint(self) -> QSize:
        return QSize(900, 120)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom; with Shift, or by a sideways wheel, pan."""
        angle, view = event.angleDelta(), self.document.view
        notches = (angle.y() or angle.x()) / 120.0
        shifted = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
        if shifted or abs(angle.x()) > abs(angle.y()):
            view.pan(-notches * PAN_STEP * (view.end - view.start))
        else:
            view.zoom(ZOOM_STEP**-notches, self.zoom_centre(event.position().x()))
        event.accept()

    @abstractmethod
    def zoom_centre(self, x: float) -> float:
        """The time (s) that stays in its place when the wheel zooms at a pixel."""

    def paint_cursor(self, painter: QPainter, x: float) -> None:
        """Draw the line of the cursor over the whole height."""
        painter.setPen(QPen(QColor(colours().cursor), 1))
        off_end = self.plot.right() < round(x) + 0.5 < self.plot.right() + 1
        self.paint_upright(painter, x - 1 if off_end else x)

    def paint_upright(self, painter: QPainter, x: float) -> None:
        """Draw a line over the whole height, in the middle of a pixel."""
        x = round(x) + 0.5
        painter.drawLine(QLineF(x, 0, x, self.height()))


class TimePanel(TimeView):
    """A panel whose horizontal axis is the document's visible span.

    Plots are boxes whose x axis follows the span (:meth:`add_box`); others draw all they show
    behind them (:meth:`paint_content`). Cursor, range, stroke and hint lie above, and what moves
    with them (:meth:`paint_overlay`).
    """

    #: Pixels on either side of the cursor that change when it moves, and whether the gutter does.
    beside_cursor: float = LINE
    gutter_follows: bool = False

    def __init__(self, document: Document) -> None:
        super().__init__(document)
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self._boxes: list[pg.ViewBox] = []
        self._press: QPointF | None = None
        self._marking = False
        self._panning: QPointF | None = None
        #: The stretches of pixels that cursor, hint, range and stroke are drawn on.
        self._drawn_over: tuple[TimeSpan | None, ...] = ()
        document.demonstration_changed.connect(self._follow_span)
        document.view.span_changed.connect(self._follow_span)
        document.view.cursor_moved.connect(self._marks_moved)
        for signal in (
            document.view.range_changed,
            document.stroke_changed,
            document.view.hint_changed,
        ):
            signal.connect(self._marks_moved)

    # Boxes

    def add_box(self, *, zooms: bool = False, inverted: bool = False) -> pg.ViewBox:
        """A box of a plot on the time axis; its place is the panel's to set."""
        box = super().add_box(zooms=zooms, inverted=inverted)
        box.setXRange(self.document.view.start, self.document.view.end, padding=0)
        self._boxes.append(box)
        return box

    def _follow_span(self, *_: object) -> None:
        view = self.document.view
        for box in self._boxes:
            box.setXRange(view.start, view.end, padding=0)
        self.invalidate()

    # Where things are

    @property
    def seconds_per_pixel(self) -> float:
        """How much time one pixel is."""
        return (self.document.view.end - self.document.view.start) / self.plot.width()

    @property
    def axis(self) -> Axis:
        """From seconds to pixels."""
        plot = self.plot
        return Axis(self.document.view.start, self.document.view.end, plot.left(), plot.right())

    def x_at(self, time: float) -> float:
        """The pixel of a time in seconds."""
        return self.gutter + (time - self.document.view.start) / self.seconds_per_pixel

    def time_at(self, x: float) -> float:
        """The time in seconds of a pixel; it may lie outside the demonstration."""
        return self.document.view.start + (x - self.gutter) * self.seconds_per_pixel

    # What a panel draws

    def paint_content(self, painter: QPainter, plot: QRectF) -> None:
        """Draw what only changes with span, size, theme or :meth:`invalidate`."""

    def paint_gutter(self, painter: QPainter, box: QRectF) -> None:
        """Draw names left of the time axis."""

    def paint_overlay(self, painter: QPainter, plot: QRectF) -> None:
        """Draw what changes often: above the content, below the cursor."""

    def paint_background(self, painter: QPainter) -> None:
        if self.document.demonstration is None:
            return
        painter.save()
        painter.setClipRect(self.plot)
        self.paint_content(painter, self.plot)
        painter.restore()
        self.paint_gutter(painter, QRectF(0, 0, self.gutter, self.height()))

    def paint_foreground(self, painter: QPainter) -> None:
        # All that has moved since the last time was marked for this one.
        self._drawn_over = self._marks()
        plot = self.plot
        painter.save()
        painter.setClipRect(plot)
        self._paint_range(painter)
        painter.restore()
        painter.save()
        self.paint_overlay(painter, plot)
        painter.setClipRect(plot)
        self._paint_lines(painter)
        painter.restore()

    def tooltip_at(self, position: QPointF) -> str:
        """What is to be read at a pixel where the pointer rests."""
        return self.toolTip()

    # Qt

    def viewportEvent(self, event: QEvent) -> bool:
        if isinstance(event, QHelpEvent) and event.type() == QEvent.Type.ToolTip:
            QToolTip.showText(event.globalPos(), self.tooltip_at(QPointF(event.pos())), self)
            return True
        return super().viewportEvent(event)

    def zoom_centre(self, x: float) -> float:
        return self.time_at(min(max(x, self.plot.left()), self.plot.right()))

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Begin a click, a marked range (left button) or a pan (middle button)."""
        if event.button() == Qt.MouseButton.LeftButton:
            self._press, self._marking = event.position(), False
        elif event.button() == Qt.MouseButton.MiddleButton:
            self._panning = event.position()
            self.setCursor(Qt.CursorShape.ClosedHandCursor)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        position = event.position()
        if self._panning is not None:
            self.document.view.pan((self._panning.x() - position.x()) * self.seconds_per_pixel)
            self._panning = position
        elif self._press is not None:
            far = abs(position.x() - self._press.x()) >= QApplication.startDragDistance()
            self._marking = self._marking or far
            if self._marking:
                self.document.view.set_range(
                    self.time_at(self._press.x()), self.time_at(position.x())
                )

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """A click seeks and clears the range."""
        if event.button() == Qt.MouseButton.MiddleButton and self._panning is not None:
            self._panning = None
            self.unsetCursor()
        elif event.button() == Qt.MouseButton.LeftButton and self._press is not None:
            if not self._marking:
                self.document.view.clear_range()
                if event.position().x() >= self.plot.left():
                    self.document.view.seek(self.time_at(event.position().x()))
            self._press = None

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """The second press is a press."""
        self.mousePressEvent(event)

    # Inside

    def _paint_range(self, painter: QPainter) -> None:
        """Draw the marked range and the unfinished stroke as bands."""
        document, view, now = self.document, self.document.view, colours()
        if view.range is not None:
            left, right = map(self.x_at, view.range)
            self._band(painter, left, right, QColor(now.range))
        elif view.range_start is not None:
            painter.setPen(QPen(QColor(now.range), 1, Qt.PenStyle.DashLine))
            self.paint_upright(painter, self.x_at(view.range_start))
        stroke = document.stroke
        if stroke is not None:
            listed = stroke.action in document.vocabulary
            colour = document.vocabulary[stroke.action].colour if listed else now.accent
            start, end = sorted((stroke.start, view.cursor))
            self._band(painter, self.x_at(start), self.x_at(end), QColor(colour))

    def _band(self, painter: QPainter, left: float, right: float, colour: QColor) -> None:
        """A translucent band with edges, over the whole height."""
        left = min(max(left, self.plot.left() - 2), self.plot.right() + 2)
        right = min(max(right, self.plot.left() - 2), self.plot.right() + 2)
        band = QRectF(left, 0, right - left, self.height())
        painter.fillRect(band, translucent(colour, 0.16))
        painter.setPen(QPen(colour, 1))
        self.paint_upright(painter, left)
        self.paint_upright(painter, right)

    def _paint_lines(self, painter: QPainter) -> None:
        """Draw the offered snap target, and the cursor."""
        document, now = self.document, colours()
        if document.demonstration is None:
            return
        if document.view.hint is not None:
            painter.setPen(QPen(QColor(now.hint), 1, Qt.PenStyle.DashLine))
            self.paint_upright(painter, self.x_at(document.view.hint.time))
        self.paint_cursor(painter, self.x_at(document.view.cursor))

    def _marks(self) -> tuple[TimeSpan | None, ...]:
        """Where cursor, hint, range and stroke are, in pixels; None where there is none."""
        view, stroke = self.document.view, self.document.stroke
        marked = view.range
        if marked is None and view.range_start is not None:
            marked = (view.range_start, view.range_start)
        times = (
            (view.cursor, view.cursor),
            None if view.hint is None else (view.hint.time, view.hint.time),
            marked,
            None if stroke is None else (stroke.start, view.cursor),
        )
        return tuple(span and (self.x_at(span[0]), self.x_at(span[1])) for span in times)

    def _marks_moved(self, *_: object) -> None:
        """Update what lies under the marks that have moved; the rest of the panel stays."""
        if not self.isVisible():
            return
        before, now = self._drawn_over, self._marks()
        if not before:  # nothing was drawn yet
            return
        for old, new in zip(before, now, strict=True):
            if old == new:
                continue
            around = text_size.pixels(self.beside_cursor) if old is before[0] else LINE
            for span in filter(None, (old, new)):
                self._update_columns(min(span) - around, max(span) + around)
        if before[0] != now[0] and self.gutter_follows:
            self.update(QRect(0, 0, self.gutter, self.height()))

    def _update_columns(self, left: float, right: float) -> None:
        """Update these pixels, over the whole height."""
        first, last = max(math.floor(left), 0), min(math.ceil(right), self.width())
        if first < last:
            self.update(QRect(first, 0, last - first, self.height()))
