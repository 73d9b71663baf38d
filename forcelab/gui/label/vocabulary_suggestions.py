"""The actions of the glossary, offered to whoever begins a vocabulary."""

from __future__ import annotations

from collections.abc import Collection

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QFrame, QLabel, QPushButton, QScrollArea, QVBoxLayout, QWidget

from forcelab.gui.label.vocabulary_model import entries

__all__ = ["Suggestions"]


class Suggestions(QScrollArea):
    """One button for each action that the vocabulary lacks.

    Attributes
    ----------
    chosen : Signal(str)
        An action is to be added.
    dismissed : Signal
        There are enough of them.
    """

    chosen = Signal(str)
    dismissed = Signal()

    def __init__(self) -> None:
        super().__init__()
        page = QWidget()
        column = QVBoxLayout(page)
        self._text = QLabel()
        self._text.setWordWrap(True)
        self.enough = QPushButton("That is all")
        self.enough.setToolTip("Show the chosen actions only; painting does so, too")
        self.enough.clicked.connect(self.dismissed)
        column.addWidget(self._text)
        column.addWidget(self.enough)
        # Below each other: side by side the longer names are cut off in a narrow list.
        self.buttons: dict[str, QPushButton] = {}
        for name, entry in entries().items():
            button = QPushButton(name)
            button.setToolTip(entry.sentence)
            button.clicked.connect(lambda _=False, name=name: self.chosen.emit(name))
            column.addWidget(button)
            self.buttons[name] = button
        column.addStretch(1)
        self.setWidgetResizable(True)
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setWidget(page)
        self.leave_out(())

    def leave_out(self, names: Collection[str]) -> None:
        """Offer no action of these names, which the vocabulary has."""
        for name, button in self.buttons.items():
            button.setVisible(name not in names)
        self.enough.setVisible(bool(names))
        if names:
            self._text.setText("More actions to add:")
        else:
            self._text.setText("No actions yet: add one below, or begin with these.")
