"""Labelling by keys: hold or press an action's key while the demonstration plays."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QAbstractItemView, QApplication, QDockWidget, QMenuBar, QWidget

from forcelab.gui.document import Document
from forcelab.gui.key_events import (
    AutoRepeatFilter,
    action_key,
    application,
    is_reserved_key,
    is_typing,
)
from forcelab.gui.label.segment_commands import fill_range
from forcelab.gui.label.track_gestures import (
    is_on_target,
    round_to_sample,
    snap_or_round,
    snap_targets,
)
from forcelab.gui.preferences import HOLD_TIME, REACTION_TIME
from forcelab.gui.shortcuts import keys
from forcelab.segment_edits import SLIVER
from forcelab.vocabulary import KEYS


class Pending(NamedTuple):
    """What was begun and waits for its end: what, how it is ended, and where it began (s)."""

    what: str
    how: str
    start: float


def pending(document: Document) -> Pending | None:
    """The stroke or range that waits for its end, if any, as in "grab from 0.83 s: press 2 ..."."""
    stroke, start = document.stroke, document.view.range_start
    if stroke is not None:
        start, what = stroke.start, stroke.action
        key = document.vocabulary[what].key.upper() if what in document.vocabulary else ""
        how = f"press {key} again to end" if key else ""
    elif start is not None:
        what, key = "range", keys().shown("range_out")
        how = f"press {key} to end" if key else ""
    else:
        return None
    return Pending(what, f" from {start:.2f} s" + (f": {how}" if how else ""), start)


class KeyLabelling(QObject):
    """Turns the keys of actions into segments.

    A key that is pressed

    * fills the marked range, if there is one;
    * ends the stroke that was begun with the same key; one begun with another key it ends too, and
      begins its own there, so that actions that follow each other touch;
    * gives the selected segment its action, if nothing is playing;
    * otherwise begins a stroke at the cursor.

    A key that is released ends what it has begun if it was held (``HOLD_TIME``) and the
    cursor has moved meanwhile. Esc cancels a stroke.

    While playing, the coder reacts to what was seen ``REACTION_TIME`` ago: positions are
    that much before the cursor, times the speed, for releases as well. While paused, it is the
    cursor: as it is where it stands exactly on a sample, a frame or an edge, because then it was
    sent there; anywhere else it snaps like the pointer (:mod:`forcelab.gui.label.track_gestures`).

    Keys count in `window` and in what is inside it, except where keys are text, and only while
    `shown` says that the track can be seen. `pixels_per_second` is the zoom, by which targets are
    near; `clock` gives seconds and never jumps.
    """

    def __init__(
        self,
        document: Document,
        window: QWidget,
        pixels_per_second: Callable[[], float],
        clock: Callable[[], float] = time.monotonic,
        shown: Callable[[], bool] = lambda: True,
    ) -> None:
        super().__init__(window)
        self.document = document
        self.window = window
        self._scale = pixels_per_second
        self._clock = clock
        self._is_shown = shown
        #: The key that began the stroke and is still down: key, when, and where the cursor was.
        self._held: tuple[str, float, float] | None = None
        self._repeats = AutoRepeatFilter(self)
        window.installEventFilter(self)
        # A view such as a list would keep letters for itself: they are taken before it sees them.
        # Following the focus costs nothing; a filter on the application sees every event.
        application().focusChanged.connect(self._follow_focus)
        self._follow_focus(None, QApplication.focusWidget())
        document.demonstration_changed.connect(self.forget_held_key)

    def press(self, key: str) -> bool:
        """Act on a key; gives whether it was an action's key, or could be one and is not."""
        document = self.document
        action = self._action_of(key)
        if action is None or document.demonstration is None:
            return self._report_unknown_key(key)
        self._held = None
        if document.view.range is not None:
            fill_range(document, action)
        elif document.stroke is not None:
            self._press_during_stroke(action, key)
        elif not document.view.playing and document.selected is not None:
            document.editor.relabel(document.selected, action)
        else:
            self._begin_stroke(action, key, self._stroke_position())
        return True

    def cancel(self) -> bool:
        """Cancel the stroke; gives whether there was one."""
        self._held = None
        if self.document.stroke is None:
            return False
        self.document.cancel_stroke()
        return True

    def forget_held_key(self) -> None:
        """Forget the held key, whose release will not arrive; the stroke goes on."""
        self._held = None

    # Qt

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Take the keys of actions, and Esc during a stroke."""
        kind = event.type()
        if kind == QEvent.Type.WindowDeactivate:
            self.forget_held_key()
        elif kind == QEvent.Type.KeyPress and isinstance(event, QKeyEvent):
            return self._key_press(watched, event)
        elif kind == QEvent.Type.KeyRelease and isinstance(event, QKeyEvent):
            # Heard in text fields too: the focus may have gone there while the key was down.
            return not event.isAutoRepeat() and self._key_release(event)
        return False

    def _key_press(self, watched: QObject, event: QKeyEvent) -> bool:
        # A spin box lets letters through that are no numbers; they are no strokes either.
        focus = QApplication.focusWidget()
        if is_typing(focus) or (isinstance(watched, QWidget) and is_typing(watched)):
            return False
        if is_reserved_key(focus, event) or not self._is_shown():
            return False
        if event.key() == Qt.Key.Key_Escape:
            return self.cancel()
        plain = event.modifiers() & ~Qt.KeyboardModifier.KeypadModifier
        if plain != Qt.KeyboardModifier.NoModifier:
            return False
        key = action_key(event)
        if self._repeats.repeats(event):
            return self._action_of(key) is not None
        return self.press(key)

    def _key_release(self, event: QKeyEvent) -> bool:
        """Handle a release, which may be a repeat: the segment ends at the present position."""
        key = action_key(event)
        if self._held is None or self._held[0] != key:
            return False
        released, cursor = self._clock(), self.document.view.cursor
        position = self._stroke_position()
        self._repeats.released(event, lambda: self._key_up(key, released, cursor, position))
        return True

    def _follow_focus(self, _: QWidget | None, focused: QWidget | None) -> None:
        """Filter the keys of the widget that has the focus."""
        if focused is None or not self._in_window(focused):
            self.forget_held_key()
        else:
            focused.installEventFilter(self)  # a second time changes nothing

    def _in_window(self, widget: QWidget | None) -> bool:
        """Whether a widget is in the window, or in a dock that floats."""
        while widget is not None and widget is not self.window:
            separate = widget.isWindow() and not isinstance(widget, QDockWidget)
            if separate or isinstance(widget, QMenuBar):
                return False
            widget = widget.parentWidget()
        return widget is not None

    # Strokes

    def _report_unknown_key(self, key: str) -> bool:
        """Report that no action has this key, if one could; gives whether it was reported."""
        document = self.document
        if document.demonstration is None or not key or key not in KEYS:
            return False
        if not document.vocabulary:
            document.refuse(
                "There is no action for a key to paint: add one under Actions first.", on_track=True
            )
            return False
        if isinstance(QApplication.focusWidget(), QAbstractItemView):
            return False  # letters typed into a list look for its rows
        document.refuse(
            f"No action has the key {key}; the list of actions shows their keys.", on_track=True
        )
        return True

    def _action_of(self, key: str) -> str | None:
        """The action that a key paints."""
        actions = self.document.vocabulary
        return next((action.name for action in actions if key and action.key == key), None)

    def _press_during_stroke(self, action: str, key: str) -> None:
        stroke = self.document.stroke
        assert stroke is not None
        position = self._stroke_position()
        same = stroke.action == action
        if same or abs(position - stroke.start) > SLIVER:
            self.document.end_stroke(position)
        else:
            # Nothing was painted yet: the coder has thought better of the action.
            self.document.cancel_stroke()
        if not same and self.document.stroke is None:
            self._begin_stroke(action, key, position)

    def _begin_stroke(self, action: str, key: str, position: float) -> None:
        self.document.select(None)
        self.document.begin_stroke(action, position)
        self._held = key, self._clock(), self.document.view.cursor

    def _key_up(self, key: str, released: float, cursor: float, position: float) -> None:
        """End the stroke of a key that was held."""
        if self._held is None or self._held[0] != key:
            return
        _, pressed, began = self._held
        self._held = None
        was_held = 1000 * (released - pressed) >= HOLD_TIME.value
        if was_held and cursor != began and self.document.stroke is not None:
            self.document.end_stroke(position)

    def _stroke_position(self) -> float:
        """Where a stroke starts or ends, in seconds."""
        document = self.document
        targets = snap_targets(document)
        if document.view.playing:
            delay = REACTION_TIME.value / 1000 * document.view.speed
            earliest = document.view.bounds[0] if document.stroke is None else document.stroke.start
            # A stroke begun while paused was not late: it must not be turned around.
            time = max(document.view.cursor - delay, min(earliest, document.view.cursor))
            return round_to_sample(time, targets) if document.view.snapping else time
        if not document.view.snapping or is_on_target(document.view.cursor, targets):
            return document.view.cursor
        return snap_or_round(document.view.cursor, self._scale(), targets)
