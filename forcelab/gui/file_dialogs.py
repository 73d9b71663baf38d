"""Dialogs that choose files and folders, and where they begin: where the last of a kind ended."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction, QDragEnterEvent, QDragMoveEvent, QDropEvent, QKeySequence
from PySide6.QtWidgets import QAbstractItemView, QFileDialog, QWidget

from forcelab.gui import settings
from forcelab.gui.document import Document
from forcelab.gui.figures.figure import Figure
from forcelab.gui.jobs import Jobs


def last_folder(kind: str) -> Path:
    """The folder where a file of a kind was chosen last; else the one that holds the projects."""
    last = settings.text(f"{kind}/folder")
    if last and Path(last).is_dir():
        return Path(last)
    folders = (path.parent for path in settings.recent_projects() if settings.is_folder(path))
    return next(folders, Path.home())


def with_suffix(path: Path) -> Path:
    """A project's folder with its usual ending.

    So it is known among other folders, and as a command line's word.
    """
    return path if path.suffix else path.with_name(f"{path.name}.forcelab")


def vacant_path(folder: Path, name: str) -> Path:
    """Where a new project may be made in a folder.

    Named like a project that is there, a file dialog would open in that one's folder.
    """
    path, number = folder / f"{name}.forcelab", 1
    while path.exists():
        number += 1
        path = folder / f"{name}-{number}.forcelab"
    return path


def remember_folder(kind: str, folder: Path) -> None:
    """Remember where a file of a kind was chosen."""
    settings.store(f"{kind}/folder", str(folder))


def ask_file(parent: QWidget, title: str, kind: str, filters: str) -> Path | None:
    """Let the user choose a file; None if cancelled.

    The last folder is kept for each `kind` of file, such as ``"video"``.
    """
    name, _ = QFileDialog.getOpenFileName(parent, title, str(last_folder(kind)), filters)
    if name:
        remember_folder(kind, Path(name).parent)
    return Path(name) if name else None


def ask_files(parent: QWidget, title: str, kind: str) -> list[Path]:
    """Let the user choose files, as :func:`ask_file`."""
    names, _ = QFileDialog.getOpenFileNames(parent, title, str(last_folder(kind)))
    if names:
        remember_folder(kind, Path(names[0]).parent)
    return [Path(name) for name in names]


def ask_folder(parent: QWidget, title: str, kind: str) -> Path | None:
    """Let the user choose a folder, as :func:`ask_file`."""
    name = QFileDialog.getExistingDirectory(parent, title, str(last_folder(kind)))
    if name:
        remember_folder(kind, Path(name))
    return Path(name) if name else None


def accept_as_copy(event: QDropEvent) -> list[Path]:
    """The files and folders that are dragged or dropped, accepted as a copy.

    The source deletes what was accepted as a move, which many file managers propose.
    """
    paths = [Path(url.toLocalFile()) for url in event.mimeData().urls() if url.isLocalFile()]
    if paths:
        event.setDropAction(Qt.DropAction.CopyAction)
        event.accept()
    else:
        event.ignore()
    return paths


class FileDrop:
    """A widget that takes dropped files; it comes before Qt's class."""

    def add_files(self, files: Sequence[Path]) -> None:
        """Take what was dropped, if anything."""
        raise NotImplementedError

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        accept_as_copy(event)

    def dragMoveEvent(self, event: QDragMoveEvent) -> None:
        accept_as_copy(event)

    def dropEvent(self, event: QDropEvent) -> None:
        self.add_files(accept_as_copy(event))


def let_remove(view: QAbstractItemView, remove: Callable[[], object]) -> None:
    """Let Delete and the menu of a list of files remove those that are selected."""
    action = QAction("Remove from list", view)
    action.setShortcut(QKeySequence.StandardKey.Delete)
    action.setShortcutContext(Qt.ShortcutContext.WidgetShortcut)
    action.triggered.connect(remove)
    view.addAction(action)
    view.setContextMenuPolicy(Qt.ContextMenuPolicy.ActionsContextMenu)


def ask_picture(parent: QWidget, title: str, name: str) -> Path | None:
    """Let the user name a picture file; None if cancelled. Without a suffix it becomes ``.svg``."""
    kinds = "Pictures (*.svg *.pdf *.png)"
    suggested = str(last_folder("pictures") / name)
    chosen, _ = QFileDialog.getSaveFileName(parent, title, suggested, kinds)
    if not chosen:
        return None
    path = Path(chosen)
    remember_folder("pictures", path.parent)
    return path if path.suffix else path.with_suffix(".svg")


def export_picture(
    figure: Figure, parent: QWidget, title: str, name: str, document: Document, jobs: Jobs
) -> None:
    """Save a figure as :func:`ask_picture` says, in the background, and report the result."""
    path = ask_picture(parent, title, name)
    if path is None:
        return
    saved = f"Saved '{path.name}'."
    jobs.run(
        _saving(figure, path),
        lambda _: document.show_message(saved),
        lambda error: document.show_message(str(error), True),
        key=f"saving {path}",
    )


def _saving(figure: Figure, path: Path) -> Generator[None, None, None]:
    yield
    figure.save(path)
