"""Keeps the wheel, which scrolls a form, from changing the fields that pass under it."""

from __future__ import annotations

from functools import cache

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtWidgets import QApplication, QWidget

__all__ = ["guard_from_wheel"]


class _WheelGuard(QObject):
    """Leaves the wheel to what is around a field, unless the keyboard is in it."""

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Pass the wheel on."""
        if (
            event.type() == QEvent.Type.Wheel
            and isinstance(watched, QWidget)
            and not watched.hasFocus()
        ):
            event.ignore()
            return True
        return False


@cache
def _guard() -> _WheelGuard:
    """The one of this application, which must exist."""
    return _WheelGuard(QApplication.instance())


def guard_from_wheel(*fields: QWidget) -> None:
    """Let the wheel change fields only while they have the keyboard, which it does not give them.

    Parameters
    ----------
    *fields : QWidget
        Such as spin boxes and combo boxes in an area that scrolls.
    """
    for field in fields:
        field.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        field.installEventFilter(_guard())
