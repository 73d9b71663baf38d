"""Keys that move about in a view while it has the keyboard."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent

__all__ = ["ARROWS", "ENTER", "plain"]

#: The arrows with their steps of rows and columns, and what opens what they have come to.
ARROWS = {
    Qt.Key.Key_Left: (0, -1),
    Qt.Key.Key_Right: (0, 1),
    Qt.Key.Key_Up: (-1, 0),
    Qt.Key.Key_Down: (1, 0),
}
ENTER = (Qt.Key.Key_Return, Qt.Key.Key_Enter)


def plain(event: QKeyEvent) -> bool:
    """Whether a key is pressed without Ctrl, Alt or Shift; arrows may be those of the keypad."""
    return not event.modifiers() & ~Qt.KeyboardModifier.KeypadModifier
