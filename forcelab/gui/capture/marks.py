"""Marks made live with the keys of actions, and the legend of these keys."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent, QResizeEvent
from PySide6.QtWidgets import QApplication, QLabel, QWidget

from forcelab.capture.assemble import BRIDGE
from forcelab.gui import settings
from forcelab.gui.capture.controller import CaptureController
from forcelab.gui.figures.text import NAMES
from forcelab.gui.key_events import AutoRepeatFilter, KeyEventFilter, is_typing
from forcelab.gui.shortcuts import keys
from forcelab.vocabulary import Vocabulary


class MarkLegend(QLabel):
    """A sentence and the keys; hidden where the task has no actions with keys.

    Parameters
    ----------
    session : Session
    parent : QWidget, optional
    """

    def __init__(self, session: CaptureController, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setWordWrap(True)
        session.changed.connect(self._show_keys)
        keys().changed.connect(self._show_keys)
        self._show_keys()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Long names have other room."""
        super().resizeEvent(event)
        self._show_keys()

    def _show_keys(self) -> None:
        """Write the keys of the actions that there are now."""
        # A key stays with its action where the line is broken.
        space, room = "\N{NO-BREAK SPACE}", self.contentsRect().width()
        marking = [f"{a.key.upper()}{space}{a.name}" for a in self._session.vocabulary if a.key]
        self.setToolTip("\n".join(marking))
        shown = [self.fontMetrics().elidedText(f"{one}{space}·", NAMES, room) for one in marking]
        how = ["hold a key, or tap to begin and tap to end"]
        if forgets := keys().shown("cancel"):
            how.append(f"{forgets} forgets it")
        told = "Mark: {}. {}".format("; ".join(how), " ".join(shown).rstrip(f"{space}·"))
        self.setText(told if marking else "")
        self.setVisible(bool(marking))


#: Seconds by which an event is heard late at most; beyond that another clock stamps them.
LATE_SECONDS = 1.0


class EventTimes:
    """When keys went down and up, by the window system's stamps: a busy window hears of it late."""

    def __init__(self) -> None:
        self._offset = math.inf  # of the event that was heard soonest

    def at(self, stamp: int, now: float) -> float:
        """When something happened, in seconds of the host's monotonic clock.

        Parameters
        ----------
        stamp : int
            Milliseconds of the window system's clock; 0 where it tells none.
        now : float
            When it was heard, in seconds of the host's monotonic clock.
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
    """Hears the keys of actions go down and up, but not where keys are text.

    An action lasts as long as its key is held. A key that is only tapped (shorter than
    ``settings.hold_ms``, no other one being down) begins its action; the next press ends it, and
    one of another key begins its own there, as in the Label workspace. What is forgotten meanwhile
    (:meth:`forget`) no press and no release ends any more.

    Parameters
    ----------
    page : QWidget
        Keys count wherever the focus is in its window, while the page can be seen.
    vocabulary : callable
        The actions that there are now.
    mark : callable
        Told an action, whether its key went down, and when, in seconds of the host's monotonic
        clock; gives whether that counts.

    Attributes
    ----------
    begun : str or None
        The action that a tap has begun.
    """

    def __init__(
        self,
        page: QWidget,
        vocabulary: Callable[[], Vocabulary],
        mark: Callable[[str, bool, float], bool],
    ) -> None:
        super().__init__(page)
        self._page, self._vocabulary, self._mark = page, vocabulary, mark
        self._down: dict[str, _Press] = {}
        self.begun: str | None = None
        #: The key that began it, how it was pressed, and when it went up.
        self._tapped: tuple[str, _Press, float] | None = None
        self._times = EventTimes()
        self._repeats = AutoRepeatFilter(self)
        self.follow_keys()

    def release_all(self) -> None:
        """Their going up will not be heard; what a tap has begun goes on."""
        for press in tuple(self._down.values()):
            if press.marks:
                self._mark(press.action, False, time.monotonic())
        self._down.clear()

    def forget_begun(self) -> None:
        """What a tap had begun has ended with the recording."""
        self.begun = self._tapped = None

    def forget(self, action: str) -> None:
        """The mark of an action is forgotten: its key, if it is down, marks nothing any more."""
        self._repeats.settle()
        if action == self.begun:
            self.forget_begun()
        for key, press in self._down.items():
            if press.action == action:
                self._down[key] = replace(press, marks=False)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Take the keys of actions."""
        kind = event.type()
        if kind == QEvent.Type.KeyPress and isinstance(event, QKeyEvent):
            return self._pressed(event)
        if kind == QEvent.Type.KeyRelease and isinstance(event, QKeyEvent):
            key, at = _key_name(event), self._times.at(event.timestamp(), time.monotonic())
            if event.isAutoRepeat() or key not in self._down:
                return key in self._down
            self._repeats.released(event, lambda: self._let_up(key, at))
            return True
        return False

    def _let_up(self, key: str, at: float) -> None:
        """End the mark of a key, unless that was done when the keyboard went elsewhere."""
        press = self._down.pop(key, None)
        if press is None or not press.marks:
            return
        if 1000 * (at - press.since) < settings.hold_ms() and not self._down:
            self.begun, self._tapped = press.action, (key, press, at)
        else:
            self._mark(press.action, False, at)

    def _pressed(self, event: QKeyEvent) -> bool:
        """A key went down; gives whether it marks."""
        key, at = _key_name(event), self._times.at(event.timestamp(), time.monotonic())
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
        return action is not None and self._take(key, action, at)

    def _take(self, key: str, action: str, at: float) -> bool:
        """The key of an action went down; gives whether it marks."""
        if self._tapped is not None and self._tapped[0] == key and at - self._tapped[2] <= BRIDGE:
            self._down[key] = self._tapped[1]  # no finger is as fast: it was never let go
            self.forget_begun()
            return True
        ended = self.begun
        self.forget_begun()
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


def _key_name(event: QKeyEvent) -> str:
    """The key as actions name it: not the text, which a release does not carry everywhere."""
    code = event.key()
    return chr(code).lower() if 0x20 < code < 0x7F else ""
