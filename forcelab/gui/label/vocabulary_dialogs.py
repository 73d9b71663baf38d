"""Small questions about one action: which key, which colour, which name."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QKeyEvent
from PySide6.QtWidgets import (
    QColorDialog,
    QDialog,
    QDialogButtonBox,
    QInputDialog,
    QLabel,
    QMenu,
    QVBoxLayout,
    QWidget,
)

from forcelab.errors import InputError
from forcelab.gui.label.swatches import swatch_icon
from forcelab.gui.theme import colours
from forcelab.vocabulary import COLOURS, Vocabulary

__all__ = ["KeyDialog", "ask_name", "colour_menu"]


class KeyDialog(QDialog):
    """Waits for the key that shall paint an action; says at once why one cannot.

    Parameters
    ----------
    vocabulary : Vocabulary
    name : str
        The action.

    Attributes
    ----------
    key : str or None
        The one that was accepted; empty for no key any more.
    """

    def __init__(self, vocabulary: Vocabulary, name: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._vocabulary, self._name = vocabulary, name
        self.key: str | None = None
        self.setWindowTitle(f"Key of '{name}'")
        ask = QLabel(f"Press the key that paints '{name}'. Backspace takes its key away.")
        ask.setWordWrap(True)
        self.trouble = QLabel()
        self.trouble.setWordWrap(True)
        self.trouble.setMinimumHeight(2 * self.fontMetrics().height())
        self.trouble.setStyleSheet(f"color: {colours().trouble}")
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Cancel)
        buttons.rejected.connect(self.reject)
        for button in buttons.buttons():
            button.setFocusPolicy(Qt.FocusPolicy.NoFocus)  # keys are for this dialog
        column = QVBoxLayout(self)
        column.addWidget(ask)
        column.addWidget(self.trouble)
        column.addWidget(buttons)
        self.setMinimumWidth(320)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Take the key, or say what is against it."""
        if event.key() == Qt.Key.Key_Escape:
            self.reject()
            return
        key = event.text().strip().lower()
        if event.key() in (Qt.Key.Key_Backspace, Qt.Key.Key_Delete):
            key = ""
        elif not key or not key.isprintable():
            return
        try:
            self._vocabulary.rebound(self._name, key)
        except InputError as error:
            self.trouble.setText(str(error))
            return
        self.key = key
        self.accept()


def ask_name(old: str, parent: QWidget) -> str | None:
    """Ask for another name of an action; None if it shall keep its own."""
    name, given = QInputDialog.getText(
        parent,
        "Rename action",
        f"New name of '{old}':",
        text=old,
    )
    name = " ".join(name.split())
    return name if given and name and name != old else None


def colour_menu(current: str, choose: Callable[[str], object], around: QMenu) -> QMenu:
    """The colours that every viewer tells apart, then any other; below another menu."""
    menu, parent = around.addMenu("Colour"), around.parentWidget()
    names = (
        "Blue",
        "Vermilion",
        "Sky blue",
        "Orange",
        "Bluish green",
        "Yellow",
        "Reddish purple",
        "Black",
    )
    for colour, name in zip(COLOURS, names, strict=True):
        action = menu.addAction(swatch_icon(colour), name)
        action.setEnabled(colour != current)
        action.triggered.connect(lambda _=False, colour=colour: choose(colour))
    menu.addSeparator()
    other = menu.addAction("Other…")

    def ask() -> None:
        chosen = QColorDialog.getColor(QColor(current), parent, "Colour")
        if chosen.isValid():
            choose(chosen.name())

    other.triggered.connect(ask)
    return menu
