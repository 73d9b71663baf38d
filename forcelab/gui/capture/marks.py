"""Marks made live: which keys are down, and the track that grows from that."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QApplication, QWidget

from forcelab.gui.typing_guard import typing
from forcelab.labels import Segment
from forcelab.vocabulary import Vocabulary

__all__ = ["HeldKeys", "LiveMarks"]


class LiveMarks:
    """The track that held keys make: of several, the last one pressed counts.

    The same rule as :mod:`forcelab.capture.gathering`'s, which makes the track that is stored.

    Attributes
    ----------
    segments : list of Segment
        Those that have ended, in seconds of the host's monotonic clock.
    """

    def __init__(self) -> None:
        self.segments: list[Segment] = []
        self._held: list[str] = []
        self._since = 0.0

    def press(self, action: str, down: bool, now: float) -> None:
        """The key of an action went down or up."""
        self._until(now)
        if action in self._held:
            self._held.remove(action)
        if down:
            self._held.append(action)

    def end(self, now: float) -> None:
        """No key is heard any more."""
        self._until(now)
        self._held.clear()

    def track(self, now: float, since: float = 0.0) -> list[Segment]:
        """All segments that end after a time, with the one that grows."""
        seen = []
        for segment in reversed(self.segments):
            if segment.end <= since:
                break
            seen.append(segment)
        seen.reverse()
        if self._held and now > self._since:
            seen.append(Segment(self._since, now, self._held[-1]))
        return seen

    def _until(self, now: float) -> None:
        if self._held and now > self._since:
            self.segments.append(Segment(self._since, now, self._held[-1]))
        self._since = max(now, self._since)


class HeldKeys(QObject):
    """Hears the keys of actions go down and up, but not where keys are text.

    Parameters
    ----------
    page : QWidget
        Keys count wherever the focus is in its window, while the page can be seen.
    vocabulary : callable
        The actions that there are now.
    mark : callable
        Told an action and whether its key went down; gives whether that counts.
    """

    def __init__(
        self,
        page: QWidget,
        vocabulary: Callable[[], Vocabulary],
        mark: Callable[[str, bool], bool],
    ) -> None:
        super().__init__(page)
        self._page, self._vocabulary, self._mark = page, vocabulary, mark
        self._down: dict[str, str] = {}
        application = QApplication.instance()
        assert isinstance(application, QApplication)
        # A filter on the widget in focus only: one on the application sees every event.
        application.focusChanged.connect(self._follow)
        self._follow(None, application.focusWidget())

    def release_all(self) -> None:
        """Their going up will not be heard."""
        for action in tuple(self._down.values()):
            self._mark(action, False)
        self._down.clear()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Take the keys of actions."""
        kind = event.type()
        if kind == QEvent.Type.KeyPress and isinstance(event, QKeyEvent):
            return self._pressed(event)
        if kind == QEvent.Type.KeyRelease and isinstance(event, QKeyEvent):
            key = _name(event)
            if event.isAutoRepeat() or key not in self._down:
                return key in self._down
            self._mark(self._down.pop(key), False)
            return True
        return False

    def _pressed(self, event: QKeyEvent) -> bool:
        """A key went down; gives whether it marks."""
        key = _name(event)
        plain = event.modifiers() & ~Qt.KeyboardModifier.KeypadModifier
        if plain != Qt.KeyboardModifier.NoModifier or not self._page.isVisible():
            return False
        if typing(QApplication.focusWidget()):
            return False
        if event.isAutoRepeat() or key in self._down:
            return key in self._down
        action = next((a.name for a in self._vocabulary() if key and a.key == key), None)
        if action is None or not self._mark(action, True):
            return False
        self._down[key] = action
        return True

    def _follow(self, old: QWidget | None, now: QWidget | None) -> None:
        """Listen where the keys go now."""
        if old is not None:
            old.removeEventFilter(self)
        if now is None or now.window() is not self._page.window():
            self.release_all()
        else:
            now.installEventFilter(self)


def _name(event: QKeyEvent) -> str:
    """The key as actions name it: not the text, which a release does not carry everywhere."""
    code = event.key()
    return chr(code).lower() if 0x20 < code < 0x7F else ""
