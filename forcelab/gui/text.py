"""Names and numbers as menus, buttons and lists show them."""

from __future__ import annotations

from collections.abc import Iterable

from PySide6.QtWidgets import QMessageBox, QWidget

from forcelab.text import name_alike, tidy_name


def escape_ampersands(name: str) -> str:
    """A name as an entry of a menu or a button has it: a single ampersand would mark a key."""
    return name.replace("&", "&&")


def settle_name(parent: QWidget | None, name: str, known: Iterable[str]) -> str:
    """A name without needless spaces; where it is nearly one there is, the person chooses.

    Parameters
    ----------
    parent : QWidget or None
        Over which the question appears.
    name : str
        As typed.
    known : iterable of str
        The names there are.
    """
    name = tidy_name(name)
    there = name_alike(name, known)
    if there is None:
        return name
    box = QMessageBox(parent)
    box.setIcon(QMessageBox.Icon.Question)
    box.setWindowTitle("Nearly the same name")
    box.setText(f"There is '{there}' already.")
    box.setInformativeText(f"'{name}' would be another name beside it.")
    use = box.addButton(
        f"Use '{escape_ampersands(there)}'",
        QMessageBox.ButtonRole.AcceptRole,
    )
    other = box.addButton(f"Add '{escape_ampersands(name)}'", QMessageBox.ButtonRole.ActionRole)
    box.setDefaultButton(use)
    box.setEscapeButton(use)
    box.exec()
    chosen = box.clickedButton()
    box.deleteLater()
    return name if chosen is other else there


def thousands(number: int) -> str:
    """A whole number with its thousands apart."""
    return f"{number:,}"
