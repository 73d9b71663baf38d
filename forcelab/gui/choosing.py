"""Dialogs that choose files and folders; each begins where the last of its kind was chosen."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtGui import QDropEvent
from PySide6.QtWidgets import QFileDialog, QWidget

from forcelab.gui import settings

__all__ = ["ask_file", "ask_files", "ask_folder", "last_folder", "remember_folder", "take_copies"]


def last_folder(kind: str) -> Path:
    """Where a file of a kind was chosen last; else the folder in which the projects lie."""
    last = settings.text(f"{kind}/folder")
    if last and Path(last).is_dir():
        return Path(last)
    folders = (path.parent for path in settings.recent_projects() if settings.is_folder(path))
    return next(folders, Path.home())


def remember_folder(kind: str, folder: Path) -> None:
    """Keep where a file of a kind was chosen, for the next time."""
    settings.put(f"{kind}/folder", str(folder))


def ask_file(parent: QWidget, title: str, kind: str, filters: str) -> Path | None:
    """Let the user choose a file; None where he does not.

    Parameters
    ----------
    title, filters : str
        Of the dialog.
    kind : str
        Of the file, such as ``"video"``.
    """
    name, _ = QFileDialog.getOpenFileName(parent, title, str(last_folder(kind)), filters)
    if name:
        remember_folder(kind, Path(name).parent)
    return Path(name) if name else None


def ask_files(parent: QWidget, title: str, kind: str) -> list[Path]:
    """Let the user choose files; as :func:`ask_file`."""
    names, _ = QFileDialog.getOpenFileNames(parent, title, str(last_folder(kind)))
    if names:
        remember_folder(kind, Path(names[0]).parent)
    return [Path(name) for name in names]


def ask_folder(parent: QWidget, title: str, kind: str) -> Path | None:
    """Let the user choose a folder; as :func:`ask_file`."""
    name = QFileDialog.getExistingDirectory(parent, title, str(last_folder(kind)))
    if name:
        remember_folder(kind, Path(name))
    return Path(name) if name else None


def take_copies(event: QDropEvent) -> list[Path]:
    """The files and folders that are dragged or dropped, if any; they are answered with "copy".

    Whoever drags deletes what was answered with "move", which many file managers propose.
    """
    paths = [Path(url.toLocalFile()) for url in event.mimeData().urls() if url.isLocalFile()]
    if paths:
        event.setDropAction(Qt.DropAction.CopyAction)
        event.accept()
    else:
        event.ignore()
    return paths
