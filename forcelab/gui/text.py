"""Names and numbers as menus, buttons and lists show them."""

from __future__ import annotations

from collections.abc import Iterable

from PySide6.QtWidgets import QMessageBox, QWidget

from forcelab.text import name_alike, tidy_name


def escape_ampersands(name: str) -> str:
    """A name for menus and buttons, where a single ampersand would mark a key."""
    return name.replace("&", "&&")


def settle_name(parent: QWidget | None, name: str, known: Iterable[str]) -> str:
    """A tidied name; if it nearly is a known one, the coder is asked which to use."""
    name = tidy_name(name)
    existing = name_alike(name, known)
    if existing is None:
        return name
    box = QMessageBox(parent)
    box.setIcon(QMessageBox.Icon.Question)
    box.setWindowTitle("Nearly the same name")
    box.setText(f"'{existing}' already exists.")
    box.setInformativeText(f"'{name}' would be another name beside it.")
    use = box.addButton(
        f"Use '{escape_ampersands(existing)}'",
        QMessageBox.ButtonRole.AcceptRole,
    )
    other = box.addButton(f"Add '{escape_ampersands(name)}'", QMessageBox.ButtonRole.ActionRole)
    box.setDefaultButton(use)
    box.setEscapeButton(use)
    box.exec()
    chosen = box.clickedButton()
    box.deleteLater()
    return name if chosen is other else existing


def thousands(number: int) -> str:
    """A whole number with thousands separators."""
    return f"{number:,}"
