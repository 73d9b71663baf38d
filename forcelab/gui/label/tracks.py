"""The track panel: tracks of all authors, and the coder's own to paint on."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from weakref import ref

from PySide6.QtCore import QEvent, QPoint, QPointF, Qt, Signal
from PySide6.QtGui import QAction, QContextMenuEvent, QKeyEvent, QMouseEvent, QPainter
from PySide6.QtWidgets import QInputDialog, QMenu, QWidget

from forcelab.gui.document import Document, Snap
from forcelab.gui.figures.text import NAMES
from forcelab.gui.label import segment_commands as verbs
from forcelab.gui.label.actions import action_menu_entries
from forcelab.gui.label.segment_commands import zoom_to
from forcelab.gui.label.swatches import swatch_icon
from forcelab.gui.label.track_gestures import (
    REACH,
    Drag,
    EdgeGesture,
    Hit,
    MarkGesture,
    MoveGesture,
    begin_gesture,
    edge_beside,
    gap_at,
    hit,
    index_at,
    snap,
    snap_targets,
    snapped,
)
from forcelab.gui.label.track_rows import Row, TrackRows, draw_plate, outline, plate_beside
from forcelab.gui.layout import set_enabled_with_reason
from forcelab.gui.text import escape_ampersands, settle_name
from forcelab.gui.theme import colours
from forcelab.labels import Segment, Segments

#: The longest gap that is offered to be filled at first, in seconds.
GAP = 0.1
#: How many letters of a name are shown, about.
LONGEST = 48


def own_menu(
    parent: QWidget, document: Document, time: float, play: Callable[[float, float], None]
) -> QMenu:
    """What can be done on the coder's track at a time in seconds.

    `play` is called with the start and the end of a segment that is to be played.
    """
    menu = QMenu("Segment", parent)
    index, gap = index_at(document.segments, time), gap_at(document.segments, time)
    if index is not None:
        _segment_entries(menu, document, index, time, play)
    elif gap is not None:
        start, end = gap
        fill = menu.addMenu("Fill this gap with")
        _actions(fill, document, lambda name: document.paint(start, end, name))
    menu.addSeparator()
    if document.range is not None:
        fill = menu.addMenu("Fill the range with")
        _actions(fill, document, lambda name: verbs.fill_range(document, name))
        _entry(menu, "Erase the range", lambda: verbs.erase_range(document))
    _entry(
        menu,
        "Fill short gaps…",
        lambda: ask_largest_gap(menu.parentWidget(), document),  # the parent must not be kept alive
        "" if len(document.segments) > 1 else "Gaps lie between two segments.",
    )
    _copies(menu, document, time)
    return menu


def other_menu(
    parent: QWidget,
    document: Document,
    author: str,
    time: float,
    play: Callable[[float, float], None],
) -> QMenu:
    """What can be done on another author's track at a time in seconds."""
    menu = QMenu(author, parent)
    segments = document.others.get(author, ())
    index = index_at(segments, time)
    segment = None if index is None else segments[index]
    if segment is not None:
        label = "Copy this segment to mine"
        _entry(menu, label, lambda: document.copy_from(author, segment.start, segment.end))
    if document.range is not None:
        low, high = document.range
        label = "Copy the range to mine"
        _entry(menu, label, lambda: document.copy_from(author, low, high))
    label = "Copy the whole track to mine"
    _entry(menu, label, lambda: document.copy_from(author, *document.bounds))
    if segment is not None:
        _view_entries(menu, document, segment, play)
    return menu


def range_menu(parent: QWidget, document: Document) -> QMenu:
    """The actions that a marked range can be filled with, or those to begin with; and a new one."""
    menu = QMenu("Fill the range with", parent)
    menu.addSection("Fill with")
    _actions(menu, document, lambda name: verbs.fill_range(document, name))
    names = document.vocabulary.names
    lacking = [name for name in action_menu_entries() if name not in names]
    more = menu.addMenu("More actions") if names and lacking else menu
    for name in lacking:
        _entry(more, shown_name(more, name), partial(verbs.fill_range, document, name))
    _entry(
        menu,
        "Another action…",
        lambda: ask_action(menu.parentWidget(), document),  # as above
    )
    if document.range is not None and _labelled(document, *document.range):
        menu.addSeparator()
        _entry(menu, "Erase the range", lambda: verbs.erase_range(document))
    return menu


def ask_action(parent: QWidget | None, document: Document) -> QInputDialog:
    """Ask for an action that is new, and fill the range with it; nothing waits for the answer."""
    dialog = QInputDialog(parent)
    dialog.setWindowTitle("Another action")
    dialog.setLabelText("Fill the range with an action called:")

    def named(text: str) -> None:
        name = settle_name(parent, " ".join(text.split()), document.vocabulary.names)
        if name:
            verbs.fill_range(document, name)

    dialog.textValueSelected.connect(named)
    dialog.finished.connect(dialog.deleteLater)
    dialog.open()
    return dialog


def relabel_menu(menu: QMenu, document: Document, segment: Segment) -> None:
    """Offer the other actions that one of the coder's segments can be given."""

    def relabel(name: str) -> None:
        verbs.for_current_segment(document, segment, lambda now: document.relabel(now, name))

    others = menu.addMenu("Relabel with")
    _actions(others, document, relabel, but=segment.action)


def copy_menu(parent: QWidget, document: Document, time: float) -> QMenu:
    """From whom to copy what lies at a time in seconds: Enter copies from the same as last."""
    menu = QMenu("Copy from another track", parent)
    found = _copies(menu, document, time)
    if found:
        menu.setDefaultAction(found.get(document.copied_from, next(iter(found.values()))))
    return menu


def ask_largest_gap(parent: QWidget | None, document: Document) -> QInputDialog:
    """Ask how long gaps may be that are filled, and fill them; nothing waits for the answer."""
    dialog = QInputDialog(parent)
    dialog.setInputMode(QInputDialog.InputMode.DoubleInput)
    dialog.setWindowTitle("Fill short gaps")
    where = "in the marked range" if document.range else "in the whole demonstration"
    label = f"Fill gaps {where} that last at most so many seconds:"
    dialog.setLabelText(label)
    dialog.setDoubleDecimals(3)
    dialog.setDoubleRange(0.001, 3600.0)
    dialog.setDoubleStep(0.01)
    dialog.setDoubleValue(GAP)
    dialog.doubleValueSelected.connect(lambda longest: verbs.fill_gaps(document, longest))
    dialog.finished.connect(dialog.deleteLater)
    dialog.open()
    return dialog


def _labelled(document: Document, start: float, end: float) -> bool:
    """Whether there is anything of the coder's between two times in seconds."""
    return any(one.start < end and start < one.end for one in document.segments)


def _segment_entries(
    menu: QMenu,
    document: Document,
    index: int,
    time: float,
    play: Callable[[float, float], None],
) -> None:
    """What can be done with one of the coder's segments."""
    segment = document.segments[index]
    # Another window may have edited the track by the time that an entry is chosen.
    on_it = partial(verbs.for_current_segment, document, segment)
    relabel_menu(menu, document, segment)
    _entry(menu, "Split here", lambda: document.split(time))
    _entry(
        menu,
        "Merge with the previous",
        lambda: on_it(lambda now: document.merge(now - 1, now)),
        "" if index > 0 else "This is the first segment.",
    )
    _entry(
        menu,
        "Merge with the next",
        lambda: on_it(lambda now: document.merge(now, now + 1)),
        "" if index + 1 < len(document.segments) else "This is the last segment.",
    )
    _entry(menu, "Delete", lambda: on_it(document.delete))
    _view_entries(menu, document, segment, play)


def _view_entries(
    menu: QMenu, document: Document, segment: Segment, play: Callable[[float, float], None]
) -> None:
    """How a segment can be looked at, whoever's it is."""
    start, end = segment.start, segment.end
    menu.addSeparator()
    _entry(menu, "Play it", partial(play, start, end))
    _entry(menu, "Zoom to it", partial(verbs.zoom_to, document, start, end))


def _actions(
    menu: QMenu, document: Document, chosen: Callable[[str], object], but: str = ""
) -> None:
    """One entry for each action, with its look and its key, which also picks it in the menu."""
    for action in document.vocabulary:
        if action.name == but:
            continue
        name = shown_name(menu, action.name)
        label = f"&{action.key.upper()}  {name}" if action.key else name
        entry = _entry(menu, label, partial(chosen, action.name))
        entry.setIcon(swatch_icon(action.colour, action.texture))
    menu.setEnabled(bool(menu.actions()))


def _copies(menu: QMenu, document: Document, time: float) -> dict[str, QAction]:
    """One entry for each other author to copy from; gives those that would copy something."""
    found = {}
    for author in document.others:
        stretch = verbs.copy_candidates(document, author, time)
        copy = _entry(
            menu,
            f"Copy from {shown_name(menu, author)}",
            partial(document.copy_from, author, *(stretch or ())),
            "" if stretch is not None else "Nothing is labelled there.",
        )
        if stretch is not None:
            found[author] = copy
    return found


def shown_name(menu: QMenu, name: str) -> str:
    """A name as an entry shows it: cut if it is very long, and with its ampersands, if any."""
    metrics = menu.fontMetrics()
    return escape_ampersands(metrics.elidedText(name, NAMES, LONGEST * metrics.averageCharWidth()))


def _entry(menu: QMenu, label: str, done: Callable[[], object], obstacle: str = "") -> QAction:
    """One entry of a menu; `obstacle` says why it cannot be chosen, where it cannot."""
    action = menu.addAction(label)
    set_enabled_with_reason(action, obstacle)
    action.triggered.connect(lambda _checked=False: done())
    return action


#: A press that moves less than this many pixels is a click.
CLICK_PX = 5.0

#: A brush that is put down on unlabelled time this near to a segment, in pixels, paints up to it.
JOIN_PX = 16.0

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
        gesture = begin_gesture(document, time, self._hit(row, time), meant, moving=moving)
        targets = snap_targets(document)
        self._drag = Drag(gesture, event.position(), targets, self._track, document.range)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Go on with a drag; without one, show what a press would do."""
        drag = self._drag
        if drag is None:
            super().mouseMoveEvent(event)
            if not event.buttons():
                self._hover(event.position(), event.modifiers())
            return
        far = abs(event.position().x() - drag.pressed.x()) >= CLICK_PX
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
        elif isinstance(gesture, MarkGesture):
            gesture.commit(self.document)
            if self.document.range is not None:
                # It stays where the menu is shut without a choice.
                said = "Choose an action for the marked range, here or under Actions."
                self.document.say(said)
                self.show_menu(range_menu(self, self.document), event.globalPosition().toPoint())
        else:
            index = self.document.selected
            gesture.commit(self.document)
            if isinstance(gesture, EdgeGesture | MoveGesture) and index is not None:
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
            return other_menu(self, self.document, row.author, time, play)
        found = self._hit(row, time)
        if found.index is not None:
            self.document.select(found.index)
        return own_menu(self, self.document, time, play)

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
        if drag is None or not drag.live or not isinstance(drag.gesture, MarkGesture):
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
        free = _CTRL if isinstance(gesture, MoveGesture) else _FREE
        snapping = self.document.snapping and not event.modifiers() & free
        drag.pointer = event.position().x()
        time, scale = self.time_at(drag.pointer), 1 / self.seconds_per_pixel
        found = gesture.follow(time, scale, drag.targets if snapping else None)
        self.document.set_hint(found)
        self.document.set_peek(gesture.at)
        if isinstance(gesture, MarkGesture):
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
        return snapped(time, 1 / self.seconds_per_pixel, snap_targets(self.document))

    def _joined(self, time: float) -> Snap | None:
        """The edge up to which a brush paints from where it is put down beside a segment."""
        document, pixel = self.document, self.seconds_per_pixel
        if document.action is None or not document.snapping:
            return None
        edge = edge_beside(document.segments, time, JOIN_PX * pixel)
        if edge is None:
            return None
        other = snap(time, 1 / pixel, snap_targets(document))
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
                offered = snap(time, 1 / self.seconds_per_pixel, snap_targets(self.document))
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
            at = plate_beside(bar, words, drag.pointer, own.box)
            draw_plate(painter, at, words, colours(), own.box)
