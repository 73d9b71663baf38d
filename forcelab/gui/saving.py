"""Asking where a picture is to be saved."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QCoreApplication
from PySide6.QtWidgets import QFileDialog, QWidget

from forcelab.gui import settings

__all__ = ["ask_picture"]

#: Where the last picture went.
_FOLDER = "pictures/folder"


def ask_picture(parent: QWidget, title: str, name: str) -> Path | None:
    """Let the user name a file for a picture; None where he does not.

    The dialog begins in the folder of the last picture, or else beside the last project.

    Parameters
    ----------
    parent : QWidget
    title : str
        Of the dialog.
    name : str
        Of the file, as it is suggested; without a suffix the file gets ``.svg``.
    """
    kinds = QCoreApplication.translate("forcelab", "Pictures (*.svg *.pdf *.png)")
    chosen, _ = QFileDialog.getSaveFileName(parent, title, str(_folder() / name), kinds)
    if not chosen:
        return None
    path = Path(chosen)
    settings.put(_FOLDER, str(path.parent))
    return path if path.suffix else path.with_suffix(".svg")


def _folder() -> Path:
    """Where the dialog begins."""
    last = settings.text(_FOLDER)
    if last and Path(last).is_dir():
        return Path(last)
    recent = settings.recent_projects()
    return recent[0].parent if recent else Path.home()
