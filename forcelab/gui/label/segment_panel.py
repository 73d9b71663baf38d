"""Panels on which the edges of the coder's segments are dragged; they lie behind the signals."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QLineF, QPointF, QRectF, Qt, QTimer
from PySide6.QtGui import QColor, QKeyEvent, QMouseEvent, QPainter, QPen

from forcelab.gui.document import Document
from forcelab.gui.figures.colormap import translucent
from forcelab.gui.kit.time_panel import LINE, TimePanel
from forcelab.gui.label.track_gestures import (
    Drag,
    EdgeGesture,
    Gesture,
    Hit,
    MarkGesture,
    MoveGesture,
    adjacent_edge,
    begin_gesture,
    hit,
    snap_targets,
)
from forcelab.gui.theme import colours
from forcelab.labels import Segments
from forcelab.segment_edits import index_at, overlapping

#: A press that moves less than this many pixels is a click.
CLICK_PX = 5.0
#: Moves that nothing attracts are made with one of these held; Alt is kept, though many desktops
#: take it to move windows.
CTRL = Qt.KeyboardModifier.ControlModifier
FREE = CTRL | Qt.KeyboardModifier.AltModifier


class SegmentPanel(TimePanel):
    """A panel on which drags change the coder's track; Esc ends one as if nothing had happened."""

    def __init__(self, document: Document) -> None:
        super().__init__(document)
        self._drag: Drag | None = None
        document.tracks_changed.connect(self._end_stale_drag)
        document.demonstration_changed.connect(self._end_stale_drag)

    def gesture_at(self, event: QMouseEvent) -> Gesture | None:
        """The drag that a press begins; None where it is no drag on the track."""
        raise NotImplementedError

    def point(self, position: QPointF, modifiers: Qt.KeyboardModifier) -> None:
        """Show by pointer and hint what a press would do."""
        raise NotImplementedError

    def click(self, event: QMouseEvent) -> None:
        """What a press does that was no drag."""
        raise NotImplementedError

    def mark(self, event: QMouseEvent) -> None:
        """What follows when a range was marked."""

    def hit(self, time: float, segments: Segments | None = None) -> Hit:
        """What lies under the pointer, of the coder's segments or of others."""
        segments = self.document.editor.segments if segments is None else segments
        return hit(segments, time, self.seconds_per_pixel)

    # Drags

    @property
    def dragging(self) -> bool:
        """Whether a drag is on."""
        return self._drag is not None

    def mousePressEvent(self, event: QMouseEvent) -> None:
        gesture = None
        if event.button() == Qt.MouseButton.LeftButton and self.document.demonstration is not None:
            gesture = self.gesture_at(event)
        if gesture is None:
            super().mousePressEvent(event)
            return
        targets, marked = snap_targets(self.document), self.document.view.range
        self._drag = Drag(gesture, event.position(), targets, self._track, marked)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Go on with a drag; without one, show what a press would do."""
        drag = self._drag
        if drag is None:
            super().mouseMoveEvent(event)
            if not event.buttons() and self.document.demonstration is not None:
                self.point(event.position(), event.modifiers())
            return
        far = abs(event.position().x() - drag.pressed.x()) >= CLICK_PX
        drag.live = drag.live or far
        if drag.live:
            self._continue_drag(drag, event)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End a drag, or a click."""
        drag = self._drag
        if event.button() != Qt.MouseButton.LeftButton or drag is None:
            super().mouseReleaseEvent(event)
            return
        gesture = drag.gesture
        if drag.live:
            self._continue_drag(drag, event)
        self._end_drag()
        if not drag.live:
            self.click(event)
        elif isinstance(gesture, MarkGesture):
            gesture.commit(self.document)
            self.mark(event)
        else:
            index = self.document.selected
            gesture.commit(self.document)
            if isinstance(gesture, EdgeGesture | MoveGesture) and index is not None:
                start, end = gesture.span
                self.document.select(index_at(self.document.editor.segments, (start + end) / 2))
        self.point(event.position(), event.modifiers())

    def leaveEvent(self, event: QEvent) -> None:
        """Offer no snap target any more."""
        if self._drag is None:
            self.document.view.set_hint(None)
        super().leaveEvent(event)

    def keeps(self, event: QKeyEvent) -> bool:
        """Esc is for the drag that is on, whatever else it is bound to."""
        return event.key() == Qt.Key.Key_Escape and self._drag is not None

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Esc cancels a drag."""
        if self.keeps(event):
            self.cancel_drag()
        else:
            super().keyPressEvent(event)

    def cancel_drag(self) -> None:
        """End a drag as if nothing had happened."""
        drag = self._drag
        self._end_drag()
        if drag is None or not drag.live or not isinstance(drag.gesture, MarkGesture):
            return
        if drag.range is None:
            self.document.view.clear_range()
        else:
            self.document.view.set_range(*drag.range)

    @property
    def _track(self) -> tuple[str, str, Segments]:
        """What is dragged on: demonstration, author and segments."""
        return self.document.id, self.document.author, self.document.editor.segments

    def _continue_drag(self, drag: Drag, event: QMouseEvent) -> None:
        gesture = drag.gesture
        free = CTRL if isinstance(gesture, MoveGesture) else FREE
        snapping = self.document.view.snapping and not event.modifiers() & free
        drag.pointer = event.position().x()
        time, scale = self.time_at(drag.pointer), 1 / self.seconds_per_pixel
        target = gesture.follow(time, scale, drag.targets if snapping else None)
        self.document.view.set_hint(target)
        self.document.view.set_peek(gesture.at)
        if isinstance(gesture, MarkGesture):
            gesture.commit(self.document)
        self.update()

    def _end_drag(self) -> None:
        self._drag = None
        self.document.view.set_hint(None)
        self.document.view.set_peek(None)
        self.update()

    def _end_stale_drag(self) -> None:
        """A drag ends if its track is another one now."""
        if self._drag is not None and self._track != self._drag.track:
            self._end_drag()


#: Milliseconds from an edit to the tint that shows it: the track itself is painted first.
TINT_DELAY = 40
#: The opacity of a tint, and the height of the strip that stands for it above a picture.
TINT, STRIP = 0.14, 4.0


class SignalPanel(SegmentPanel):
    """A panel of signals with the coder's segments behind them, whose edges can be dragged.

    A picture covers what is behind it: there a strip above and lines at the edges stand for it.
    """

    pictured = False

    def __init__(self, document: Document) -> None:
        super().__init__(document)
        self._tinted = True
        self._timer = QTimer(self, singleShot=True, interval=TINT_DELAY)
        self._timer.timeout.connect(self.invalidate)
        for changed in (
            document.tracks_changed,
            document.vocabulary_changed,
            document.author_changed,
        ):
            changed.connect(self._tint_later)

    def set_tinted(self, tinted: bool) -> None:
        """Show the segments, or only the signals."""
        self._tinted = tinted
        self.unsetCursor()
        self.invalidate()

    def paint_segments(self, painter: QPainter, plot: QRectF) -> None:
        """Draw the coder's segments in the visible span, as a drag would make them."""
        document, view = self.document, self.document.view
        segments = document.editor.segments
        if self._drag is not None and self._drag.live:
            segments = self._drag.gesture.preview(segments)
        visible = segments[overlapping(segments, view.start, view.end)]
        if not self._tinted or len(visible) > plot.width() / 2:  # a smear tells nothing
            return
        area, axis = self.exposed.intersected(plot), self.axis
        stretch = axis.value(area.left() - LINE), axis.value(area.right() + LINE)
        height = STRIP if self.pictured else plot.height()
        edges = []
        for segment in visible[overlapping(visible, *stretch)]:
            left, right = (
                min(max(axis.at(time), plot.left() - 2), plot.right() + 2)
                for time in (segment.start, segment.end)
            )
            colour = QColor(document.vocabulary[segment.action].colour)
            wash = colour if self.pictured else translucent(colour, TINT)
            painter.fillRect(QRectF(left, plot.top(), right - left, height), wash)
            spots = (round(x) + 0.5 for x in (left, right))
            edges += [QLineF(spot, plot.top(), spot, plot.bottom()) for spot in spots]
        painter.setPen(QPen(translucent(colours().text, 0.5 if self.pictured else 0.25), 1))
        painter.drawLines(edges)

    def gesture_at(self, event: QMouseEvent) -> Gesture | None:
        document, time = self.document, self.time_at(event.position().x())
        if event.modifiers() & FREE & ~CTRL:
            return None
        target = self._edge_at(event.position())
        if target.edge is not None:
            return begin_gesture(document, time, target, time, moving=False)
        edge = None
        if self._shows_segments_at(event.position()) and not event.modifiers() & FREE:
            edge = adjacent_edge(document, time, self.seconds_per_pixel)
        # A range begins exactly at the edge beside it, so that no sliver is left between.
        return None if edge is None else MarkGesture(time, edge.time, document.view.bounds)

    def point(self, position: QPointF, modifiers: Qt.KeyboardModifier) -> None:
        if self._edge_at(position).edge is not None:
            self.setCursor(Qt.CursorShape.SplitHCursor)
        else:
            self.unsetCursor()

    def click(self, event: QMouseEvent) -> None:
        self.document.view.clear_range()
        self.document.view.seek(self.time_at(event.position().x()))

    def _edge_at(self, position: QPointF) -> Hit:
        """The edge of a segment under the pointer, if segments are shown."""
        if not self._shows_segments_at(position):
            return Hit()
        return self.hit(self.time_at(position.x()))

    def _shows_segments_at(self, position: QPointF) -> bool:
        return self._tinted and self.plot.contains(position)

    def _continue_drag(self, drag: Drag, event: QMouseEvent) -> None:
        super()._continue_drag(drag, event)
        self.resetCachedContent()

    def _end_drag(self) -> None:
        super()._end_drag()
        self.resetCachedContent()

    def _tint_later(self) -> None:
        if self._tinted and self.isVisible():
            self._timer.start()
