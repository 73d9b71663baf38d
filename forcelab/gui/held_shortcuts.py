"""Shortcuts of a key that is held: what is to happen once a press happens once."""

from __future__ import annotations

from functools import cache

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QAction, QGuiApplication, QKeyEvent
from PySide6.QtWidgets import QApplication

from forcelab.gui.key_follower import KeyFollower, application

__all__ = ["HeldShortcuts", "held_shortcuts"]

#: A release and a press of one key that are at most this apart, in ms, are one repetition: the X
#: server makes both at the same time.
APART = 1


class HeldShortcuts(KeyFollower):
    """Keeps actions that do not repeat from the repetitions of a held key.

    Qt does that by itself where it knows a press for a repetition. On X11 it often does not, and a
    held Space would start and stop playback thirty times a second.

    Parameters
    ----------
    app : QApplication
        Its keys are watched.
    apart : bool, optional
        Whether repetitions come as unmarked pairs; by default, whether the display is X11.
    """

    def __init__(self, app: QApplication, apart: bool | None = None) -> None:
        super().__init__(app)
        self._apart = QGuiApplication.platformName() == "xcb" if apart is None else apart
        self._released: tuple[int, int] | None = None  # key, ms of the window system
        self._again = False
        if self._apart:
            self.follow_keys()

    def watch(self, action: QAction) -> None:
        """Keep an action from repetitions."""
        if self._apart:
            action.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Note when keys go down and up; take a shortcut away that comes of a repetition."""
        kind = event.type()
        if kind == QEvent.Type.Shortcut:
            return self._again and isinstance(watched, QAction)
        if kind == QEvent.Type.KeyRelease and isinstance(event, QKeyEvent):
            self._released, self._again = (event.key(), event.timestamp()), False
        elif kind == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent):
            self._again = self._repeats(event)
        return False

    def _repeats(self, event: QKeyEvent) -> bool:
        """Whether a press only tells that its key is still down."""
        if event.isAutoRepeat() or self._released is None:
            return event.isAutoRepeat()
        key, at = self._released
        return Qt.Key(key) == event.key() and 0 <= event.timestamp() - at <= APART


@cache
def held_shortcuts() -> HeldShortcuts:
    """The one of this application, which must exist."""
    return HeldShortcuts(application())
