"""Buttons that show their key, and the keys that hold only while the keyboard is near them."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QPushButton

__all__ = ["CTRL", "SHIFT", "KeyedButtons"]

NONE = Qt.KeyboardModifier.NoModifier
CTRL = Qt.KeyboardModifier.ControlModifier
SHIFT = Qt.KeyboardModifier.ShiftModifier


class _Verb(NamedTuple):
    """What a button and its key do."""

    button: QPushButton
    key: Qt.Key
    modifiers: Qt.KeyboardModifier
    do: Callable[[], object]


class KeyedButtons:
    """The buttons of a view and their keys."""

    def __init__(self) -> None:
        self._verbs: list[_Verb] = []

    def add(
        self,
        text: str,
        key: Qt.Key,
        do: Callable[[], object],
        modifiers: Qt.KeyboardModifier = NONE,
    ) -> QPushButton:
        """A new button with a key, a letter or a digit."""
        button = QPushButton()
        button.setMinimumWidth(40)
        button.clicked.connect(lambda _=False: do())
        self._verbs.append(_Verb(button, key, modifiers, do))
        self.name(button, text)
        return button

    def name(self, button: QPushButton, text: str, whole: str = "") -> None:
        """Write a button's text, which may be cut from a whole one, and its key on it."""
        verb = next(verb for verb in self._verbs if verb.button is button)
        held = {SHIFT: "⇧", CTRL: "Ctrl+"}.get(verb.modifiers, "")
        button.setText(f"{text}  [{held}{chr(verb.key)}]".replace("&", "&&"))
        button.setAccessibleName(whole or text)
        button.setToolTip(whole or text)

    def does(self, event: QKeyEvent) -> Callable[[], object] | None:
        """What a key does: nothing where its button cannot be pressed, None where it is no key."""
        modifiers = event.modifiers() & ~Qt.KeyboardModifier.KeypadModifier
        pressed = (Qt.Key(event.key()), modifiers)
        verb = next((v for v in self._verbs if (v.key, v.modifiers) == pressed), None)
        if verb is None:
            return None
        return verb.do if verb.button.isEnabled() else lambda: None
