"""Marks made live with the keys of actions, and the legend of these keys."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent, QResizeEvent
from PySide6.QtWidgets import QApplication, QLabel, QWidget

from forcelab.capture.live_marks import AUTOREPEAT_SECONDS
from forcelab.gui.capture.controller import CaptureController
from forcelab.gui.figures.text import NAMES
from forcelab.gui.key_events import AutoRepeatFilter, KeyEventFilter, action_key, is_typing
from forcelab.gui.preferences import HOLD_TIME
from forcelab.gui.shortcuts import keys
from forcelab.vocabulary import Vocabulary


class MarkLegend(QLabel):
    """A sentence and the keys; hidden where the task has no actions with keys."""

    def __init__(self, controller: CaptureController, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._controller = controller
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setWordWrap(True)
        controller.changed.connect(self._show_keys)
        keys().changed.connect(self._show_keys)
        self._show_keys()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Elide long names anew."""
        super().resizeEvent(event)
        self._show_keys()

    def _show_keys(self) -> None:
        # A key stays with its action where the line is broken.
        space, room = "\N{NO-BREAK SPACE}", self.contentsRect().width()
        marking = [f"{a.key.upper()}{space}{a.name}" for a in self._controller.vocabulary if a.key]
        self.setToolTip("\n".join(marking))
        elided = [self.fontMetrics().elidedText(f"{key}{space}·", NAMES, room) for key in marking]
        gestures = ["hold a key, or tap to begin and tap to end"]
        if forgets := keys().shown("cancel"):
            gestures.append(f"{forgets} forgets it")
        text = "Mark: {}. {}".format("; ".join(gestures), " ".join(elided).rstrip(f"{space}·"))
        self.setText(text if marking else "")
        self.setVisible(bool(marking))


#: Seconds by which an event is handled late at most; beyond that another clock stamps them.
LATE_SECONDS = 1.0


class EventTimes:
    """When keys went down and up by the window system's stamps; a busy window handles them late."""

    def __init__(self) -> None:
        self._offset = math.inf  # of the event that was handled soonest

    def at(self, stamp: int, now: float) -> float:
        """When something happened, in seconds of the host's monotonic clock.

        `stamp` is in milliseconds of the window system's clock, 0 where it has none; `now` is when
        the event was handled.
        """
        if not stamp:
            return now
        offset = now - stamp / 1000
        if not self._offset <= offset <= self._offset + LATE_SECONDS:
            self._offset = offset
        return stamp / 1000 + self._offset


@dataclass(frozen=True, slots=True)
class _Press:
    """A key that is down: its action, since when (s), and whether letting it go may end a mark."""

    action: str
    since: float
    marks: bool = True


class HeldKeys(KeyEventFilter):
    """Marks with the keys of actions going down and up, but not where keys are text.

    An action lasts as long as its key is held. A key that is only tapped (shorter than
    ``HOLD_TIME``, no other one being down) begins its action; the next press ends it, and
    one of another key begins its own there, as in the Label workspace. What is forgotten meanwhile
    (:meth:`forget`) no press and no release ends any more.
    """

    def __init__(
        self,
        page: QWidget,
        vocabulary: Callable[[], Vocabulary],
        mark: Callable[[str, bool, float], bool],
    ) -> None:
        """Keys count wherever the focus is in the window of the page, while that can be seen.

        `mark` takes an action, whether its key went down, and when, in seconds of the host's
        monotonic clock; it gives whether that counts.
        """
        super().__init__(page)
        self._page, self._vocabulary, self._mark = page, vocabulary, mark
        self._down: dict[str, _Press] = {}
        #: The action that a tap has begun, its key, how that was pressed, and when it went up.
        self.tapped_action: str | None = None
        self._tap: tuple[str, _Press, float] | None = None
        self._times = EventTimes()
        self._repeats = AutoRepeatFilter(self)
        self.follow_keys()

    def release_all(self) -> None:
        """Their going up will not be seen; what a tap has begun goes on."""
        for press in tuple(self._down.values()):
            if press.marks:
                self._mark(press.action, False, time.monotonic())
        self._down.clear()

    def forget_tap(self) -> None:
        """What a tap had begun has ended with the recording."""
        self.tapped_action = self._tap = None

    def forget(self, action: str) -> None:
        """The mark of an action is forgotten: its key, if it is down, marks nothing any more."""
        self._repeats.settle()
        if action == self.tapped_action:
            self.forget_tap()
        for key, press in self._down.items():
            if press.action == action:
                self._down[key] = replace(press, marks=False)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        kind = event.type()
        if kind == QEvent.Type.KeyPress and isinstance(event, QKeyEvent):
            return self._key_down(event)
        if kind == QEvent.Type.KeyRelease and isinstance(event, QKeyEvent):
            key, at = action_key(event), self._times.at(event.timestamp(), time.monotonic())
            if event.isAutoRepeat() or key not in self._down:
                return key in self._down
            self._repeats.released(event, lambda: self._key_up(key, at))
            return True
        return False

    def _key_up(self, key: str, at: float) -> None:
        """End the mark of a key, unless that was done when the keyboard went elsewhere."""
        press = self._down.pop(key, None)
        if press is None or not press.marks:
            return
        if 1000 * (at - press.since) < HOLD_TIME.value and not self._down:
            self.tapped_action, self._tap = press.action, (key, press, at)
        else:
            self._mark(press.action, False, at)

    def _key_down(self, event: QKeyEvent) -> bool:
        """A key went down; gives whether it marks."""
        key, at = action_key(event), self._times.at(event.timestamp(), time.monotonic())
        plain = event.modifiers() & ~Qt.KeyboardModifier.KeypadModifier
        if plain != Qt.KeyboardModifier.NoModifier or not self._page.isVisible():
            return False
        if not self._in_window:
            return False
        if is_typing(QApplication.focusWidget()):
            return False
        if self._repeats.repeats(event) or key in self._down:
            return key in self._down
        action = next((a.name for a in self._vocabulary() if key and a.key == key), None)
        return action is not None and self._begin_mark(key, action, at)

    def _begin_mark(self, key: str, action: str, at: float) -> bool:
        """The key of an action went down; gives whether it marks."""
        if (
            self._tap is not None
            and self._tap[0] == key
            and at - self._tap[2] <= AUTOREPEAT_SECONDS
        ):
            self._down[key] = self._tap[1]  # no finger is as fast: it was never let go
            self.forget_tap()
            return True
        ended = self.tapped_action
        self.forget_tap()
        if ended is not None and self._mark(ended, False, at) and ended == action:
            self._down[key] = _Press(action, at, marks=False)
            return True
        if not self._mark(action, True, at):
            return False
        self._down[key] = _Press(action, at)
        return True

    def _follow(self, old: QWidget | None, now: QWidget | None) -> None:
        """Listen where the keys go now, and in this window only."""
        super()._follow(old, now)
        if not self._in_window:
            self.release_all()

    @property
    def _in_window(self) -> bool:
        """Whether keys go to the page's window."""
        return self._filtered is not None and self._filtered.window() is self._page.window()
