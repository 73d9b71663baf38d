"""The tracks, painted on with the mouse."""

from __future__ import annotations

from weakref import ref

from PySide6.QtCore import QEvent, QPoint, QPointF, Qt, Signal
from PySide6.QtGui import QContextMenuEvent, QKeyEvent, QMouseEvent, QPainter
from PySide6.QtWidgets import QMenu

from forcelab.gui.document import Document, Snap
from forcelab.gui.label import track_menu
from forcelab.gui.label.segment_verbs import zoom_to
from forcelab.gui.label.snapping import REACH, snap, snapped, targets_of
from forcelab.gui.label.track_gestures import Drag, Marking, MovingEdge, MovingSegment, begun
from forcelab.gui.label.track_hits import Hit, edge_beside, hit, index_at
from forcelab.gui.label.track_painting import beside, outline, put_plate
from forcelab.gui.label.track_rows import Row, TrackRows
from forcelab.gui.theme import colours
from forcelab.labels import Segments

__all__ = ["TrackPanel"]

#: A press that moves less than this many pixels is a click.
CLICK = 5.0

#: A brush that is put down on unlabelled time this near to a segment, in pixels, paints up to it.
JOIN = 16.0

_ALT = Qt.KeyboardModifier.AltModifier
_CTRL = Qt.KeyboardModifier.ControlModifier
#: What moves a whole segment, and what lets nothing attract. Alt is kept for both, though many
#: desktops take it to move windows.
_MOVING = Qt.KeyboardModifier.ShiftModifier | _ALT
_FREE = _CTRL | _ALT


class TrackPanel(TrackRows):
    """One row for each author; the coder's own, at the top, is painted on with the mouse.

    =========================  ====================================================================
    drag                       paints with the brush; without one marks a range and asks with what
    drag an edge               moves it, and that of a neighbour that touches it; with a brush,
                               from within the segment
    Shift and drag a segment   moves it; so does Alt, which many desktops take for their windows
    Ctrl while dragging        nothing attracts; so does Alt, unless it moves a segment
    Esc while dragging         as if nothing had happened
    click, double click        selects the segment and seeks; zooms to it
    right click                everything else
    =========================  ====================================================================
    """

    #: Somebody wants a stretch to be played: start and end in seconds.
    play_requested = Signal(float, float)

    def __init__(self, document: Document) -> None:
        super().__init__(document)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)  # its menu is for the keyboard, too
        self._drag: Drag | None = None
        #: The menu that was opened last.
        self.menu: QMenu | None = None

    @property
    def dragging(self) -> bool:
        """Whether a drag is on."""
        return self._drag is not None

    # Mouse

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Begin a drag on the coder's row."""
        row = self.row_at(event.position())
        if event.button() != Qt.MouseButton.LeftButton or row is None or not row.own:
            super().mousePressEvent(event)
            return
        document, time = self.document, self.time_at(event.position().x())
        free = bool(event.modifiers() & _FREE)
        meant = self._meant(time, snapping=not free)
        if not free and (joined := self._joined(time)) is not None:
            meant = joined.time
        moving = bool(event.modifiers() & _MOVING)
        gesture = begun(document, time, self._hit(row, time), meant, moving=moving)
        targets = targets_of(document)
        self._drag = Drag(gesture, event.position(), targets, self._track, document.range)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Go on with a drag; without one, show what a press would do."""
        drag = self._drag
        if drag is None:
            super().mouseMoveEvent(event)
            if not event.buttons():
                self._hover(event.position(), event.modifiers())
            return
        far = abs(event.position().x() - drag.pressed.x()) >= CLICK
        drag.live = drag.live or far
        if drag.live:
            self._follow(drag, event)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End a drag, or a click."""
        drag = self._drag
        if event.button() != Qt.MouseButton.LeftButton or drag is None:
            super().mouseReleaseEvent(event)
            return
        gesture = drag.gesture
        if drag.live:
            self._follow(drag, event)
        self._forget_drag()
        if not drag.live:
            self._click(event)
        elif isinstance(gesture, Marking):
            gesture.commit(self.document)
            if self.document.range is not None:
                # It stays where the menu is shut without a choice.
                said = "Choose an action for the marked range, here or under Actions."
                self.document.say(said)
                self.show_menu(
                    track_menu.range_menu(self, self.document), event.globalPosition().toPoint()
                )
        else:
            index = self.document.selected
            gesture.commit(self.document)
            if isinstance(gesture, MovingEdge | MovingSegment) and index is not None:
                start, end = gesture.stretch
                self.document.select(index_at(self.document.segments, (start + end) / 2))
        self._hover(event.position(), event.modifiers())

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Zoom to the segment under the pointer."""
        row, time = self.row_at(event.position()), self.time_at(event.position().x())
        if row is None or event.button() != Qt.MouseButton.LeftButton:
            return
        index = self._hit(row, time).index if row.own else index_at(row.segments, time)
        if index is not None:
            zoom_to(self.document, row.segments[index].start, row.segments[index].end)

    def leaveEvent(self, event: QEvent) -> None:
        """Nothing is offered any more."""
        if self._drag is None:
            self.document.set_hint(None)
        super().leaveEvent(event)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """Open the menu of what is under the pointer; by the keyboard, of what the cursor is on."""
        if self.document.demonstration is None:
            return
        row, time = self.row_at(QPointF(event.pos())), self.time_at(event.pos().x())
        where = event.globalPos()
        if event.reason() == QContextMenuEvent.Reason.Keyboard:
            row, time = self.rows()[0], self.document.cursor
            place = QPointF(self.x_at(time), row.box.bottom())
            where = self.mapToGlobal(place.toPoint())
        if row is not None:
            self.show_menu(self.menu_at(row, time), where)

    def menu_at(self, row: Row, time: float) -> QMenu:
        """The menu of a row at a time in seconds."""
        # A menu must not keep its panel alive: its own end would then be the panel's, which ends
        # the menu a second time.
        here = ref(self)

        def play(start: float, end: float) -> None:
            if (panel := here()) is not None:
                panel.play_requested.emit(start, end)

        if not row.own:
            return track_menu.other_menu(self, self.document, row.author, time, play)
        found = self._hit(row, time)
        if found.index is not None:
            self.document.select(found.index)
        return track_menu.own_menu(self, self.document, time, play)

    def keeps(self, event: QKeyEvent) -> bool:
        """Esc is for the drag that is on, whatever else it is bound to."""
        return event.key() == Qt.Key.Key_Escape and self._drag is not None

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Esc ends a drag as if nothing had happened."""
        if self.keeps(event):
            self.cancel_drag()
        else:
            super().keyPressEvent(event)

    def show_menu(self, menu: QMenu, where: QPoint) -> None:
        """Show a menu, ready for Enter where one entry is the likeliest; nothing waits for it."""
        if self.menu is not None:
            self.menu.close()
        self.menu = menu
        menu.aboutToHide.connect(self._menu_hides)
        menu.popup(where)
        if (likeliest := menu.defaultAction()) is not None:
            menu.setActiveAction(likeliest)

    def _menu_hides(self) -> None:
        """Let go of the menu, once what was chosen in it is done."""
        if self.menu is not None:
            self.menu.deleteLater()
            self.menu = None

    def cancel_drag(self) -> None:
        """End a drag as if nothing had happened."""
        drag = self._drag
        self._forget_drag()
        if drag is None or not drag.live or not isinstance(drag.gesture, Marking):
            return
        if drag.range is None:
            self.document.clear_range()
        else:
            self.document.set_range(*drag.range)

    # Inside

    @property
    def _track(self) -> tuple[str, str, Segments]:
        """What is dragged on: demonstration, author and segments."""
        return self.document.id, self.document.author, self.document.segments

    def _hit(self, row: Row, time: float) -> Hit:
        """What is under the pointer in a row."""
        return hit(row.segments, time, self.seconds_per_pixel)

    def _follow(self, drag: Drag, event: QMouseEvent) -> None:
        """Follow the pointer."""
        gesture = drag.gesture
        free = _CTRL if isinstance(gesture, MovingSegment) else _FREE
        snapping = self.document.snapping and not event.modifiers() & free
        drag.pointer = event.position().x()
        time, scale = self.time_at(drag.pointer), 1 / self.seconds_per_pixel
        found = gesture.follow(time, scale, drag.targets if snapping else None)
        self.document.set_hint(found)
        self.document.set_peek(gesture.at)
        if isinstance(gesture, Marking):
            gesture.commit(self.document)
        self.update()

    def _click(self, event: QMouseEvent) -> None:
        """Select the segment under the pointer, and go there."""
        time = self.time_at(event.position().x())
        there = self._hit(self.rows()[0], time)
        self.document.clear_range()
        meant = self._meant(time, snapping=not event.modifiers() & _FREE)
        index = there.index if there.inside else None
        if index is not None:
            # A key relabels the segment that the cursor is in, however short that is.
            segment = self.document.segments[index]
            meant = min(max(meant, segment.start), segment.end)
        self.document.seek(meant)
        self.document.select(index)

    def _meant(self, time: float, *, snapping: bool) -> float:
        """The time that is taken for a pointed one."""
        low, high = self.document.bounds
        time = min(max(time, low), high)
        if not (snapping and self.document.snapping):
            return time
        return snapped(time, 1 / self.seconds_per_pixel, targets_of(self.document))

    def _joined(self, time: float) -> Snap | None:
        """The edge up to which a brush paints from where it is put down beside a segment."""
        document, pixel = self.document, self.seconds_per_pixel
        if document.action is None or not document.snapping:
            return None
        edge = edge_beside(document.segments, time, JOIN * pixel)
        if edge is None:
            return None
        other = snap(time, 1 / pixel, targets_of(document))
        # Farther away than anything jumps, what is pointed at counts for more.
        pointed = other is not None and other.kind in ("contact", "edge")
        return None if pointed and abs(edge - time) > REACH * pixel else Snap(edge, "edge")

    def _hover(self, position: QPointF, modifiers: Qt.KeyboardModifier) -> None:
        """Show by pointer and hint what a press would do."""
        row = self.row_at(position)
        if row is None or not row.own:
            self.unsetCursor()
            self.document.set_hint(None)
            return
        time = self.time_at(position.x())
        there = self._hit(row, time)
        if self.document.action is not None and not there.inside:
            there = Hit()  # a brush paints beside an edge
        if there.edge is not None:
            self.setCursor(Qt.CursorShape.SplitHCursor)
        elif there.index is not None and modifiers & _MOVING:
            self.setCursor(Qt.CursorShape.SizeAllCursor)
        elif self.document.action is not None:
            self.setCursor(Qt.CursorShape.CrossCursor)
        else:
            self.unsetCursor()
        offered = None
        if self.document.snapping and not modifiers & _FREE and there.edge is None:
            offered = self._joined(time)
            if offered is None:
                offered = snap(time, 1 / self.seconds_per_pixel, targets_of(self.document))
        self.document.set_hint(offered)

    def _forget_drag(self) -> None:
        """No drag is on any more."""
        self._drag = None
        self.document.set_hint(None)
        self.document.set_peek(None)
        self.update()

    def _tracks_changed(self) -> None:
        """Draw anew; a drag ends when what was being dragged may not be there any more."""
        if self._drag is not None and self._track != self._drag.track:
            self._forget_drag()
        super()._tracks_changed()

    def _paint_marked(self, painter: QPainter, own: Row) -> None:
        """Draw what a drag would make of the track and how long that is, or else the selection."""
        drag = self._drag
        if drag is None or not drag.live:
            super()._paint_marked(painter, own)
            return
        gesture = drag.gesture
        after = gesture.preview(own.segments)
        start, end = gesture.stretch
        if after is not own.segments:
            self._paint_row(painter, own, after)
        if end > start:
            bar = self._bar(own.box, start, end)
            outline(painter, bar, colours())
            words = f"{gesture.action} {start:.3f}–{end:.3f} s   {end - start:.3f} s".lstrip()
            at = beside(bar, words, drag.pointer, own.box)
            put_plate(painter, at, words, colours(), own.box)
