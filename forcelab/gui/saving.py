"""Asking where a picture is to be saved."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QCoreApplication
from PySide6.QtWidgets import QFileDialog, QWidget

from forcelab.gui.choosing import last_folder, remember_folder

__all__ = ["ask_picture"]


def ask_picture(parent: QWidget, title: str, name: str) -> Path | None:
    """Let the user name a file for a picture; None where he does not.

    The dialog begins in the folder of the last picture, or else beside the last project.

    Parameters
    ----------
    title : str
        Of the dialog.
    name : str
        Of the file, as it is suggested; without a suffix the file gets ``.svg``.
    """
    kinds = QCoreApplication.translate("forcelab", "Pictures (*.svg *.pdf *.png)")
    suggested = str(last_folder("pictures") / name)
    chosen, _ = QFileDialog.getSaveFileName(parent, title, suggested, kinds)
    if not chosen:
        return None
    path = Path(chosen)
    remember_folder("pictures", path.parent)
    return path if path.suffix else path.with_suffix(".svg")
