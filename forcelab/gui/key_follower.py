"""Hears the keys of a window, wherever they go."""

from __future__ import annotations

import shiboken6
from PySide6.QtCore import QObject
from PySide6.QtWidgets import QApplication, QWidget

__all__ = ["KeyFollower", "application"]


def application() -> QApplication:
    """The one that runs.

    Raises
    ------
    RuntimeError
        If there is none yet.
    """
    running = QApplication.instance()
    if not isinstance(running, QApplication):
        raise RuntimeError("keys are bound after the application was made")
    return running


class KeyFollower(QObject):
    """Filters the events of the widget that keys go to, and of that only.

    That is the one in focus, or else the window: it gets what is typed once a field has been left
    with Esc. A filter on the application would see every event.
    """

    _heard: QWidget | None = None

    def follow_keys(self) -> None:
        """Listen from now on."""
        application().focusChanged.connect(self._follow)
        self._follow(None, QApplication.focusWidget())

    def _follow(self, _: QWidget | None, now: QWidget | None) -> None:
        """Listen where the keys go now."""
        if self._heard is not None and shiboken6.isValid(self._heard):
            self._heard.removeEventFilter(self)
        self._heard = QApplication.activeWindow() if now is None else now
        if self._heard is not None:
            self._heard.installEventFilter(self)
