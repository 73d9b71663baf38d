"""Texts that are told anew all the while: nothing is laid out where they are the same."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QSizePolicy

__all__ = ["CalmLabel", "show_text"]


class CalmLabel(QLabel):
    """A text of several lines that leaves the width alone as it changes."""

    def __init__(self) -> None:
        super().__init__()
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setWordWrap(True)
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)


def show_text(label: QLabel, text: str) -> None:
    """Show a text; hidden while there is none."""
    if label.text() != text:
        label.setText(text)
        label.setAccessibleName(text)
    if label.isHidden() == bool(text):
        label.setVisible(bool(text))
