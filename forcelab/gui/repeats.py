"""Keys that are held: their true release, told from those that the keyboard's repetition makes."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QObject, QTimer
from PySide6.QtGui import QGuiApplication, QKeyEvent

__all__ = ["Repeats"]

#: How long a press that makes a release untrue is waited for, in ms; repetitions are 30 apart.
WAIT = 10
#: A release and a press of one key that are less than this apart, in ms, are of no finger.
APART = 5


class Repeats(QObject):
    """Puts releases off until it is sure that the key is up.

    On X11 each repetition is a release and a press of the same time. Qt marks them as repetition
    only if both have come when it looks, and often the press has not.

    Parameters
    ----------
    parent : QObject
        Whose keys they are.
    apart : bool, optional
        Whether repetitions come as unmarked pairs; by default, whether the display is X11.
    """

    def __init__(self, parent: QObject, apart: bool | None = None) -> None:
        super().__init__(parent)
        self._apart = QGuiApplication.platformName() == "xcb" if apart is None else apart
        self._waiting: tuple[int, int, Callable[[], object]] | None = None
        self._timer = QTimer(self, singleShot=True, interval=WAIT)
        self._timer.timeout.connect(self.settle)

    def released(self, event: QKeyEvent, act: Callable[[], object]) -> None:
        """A key seems to be up: act on it as soon as that is sure."""
        self.settle()
        if not self._apart:
            act()
            return
        self._waiting = event.key(), event.timestamp(), act
        self._timer.start()

    def repeats(self, event: QKeyEvent) -> bool:
        """Whether a press only tells that its key is still down."""
        if self._waiting is not None:
            key, at, _ = self._waiting
            again = event.isAutoRepeat() or abs(event.timestamp() - at) < APART
            if key == event.key() and again:
                self._timer.stop()
                self._waiting = None
                return True
        self.settle()
        return event.isAutoRepeat()

    def settle(self) -> None:
        """Act on what was put off."""
        self._timer.stop()
        waiting, self._waiting = self._waiting, None
        if waiting is not None:
            waiting[2]()
