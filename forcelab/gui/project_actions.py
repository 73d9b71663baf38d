"""Opening, making and filling projects, with their dialogs."""

from __future__ import annotations

import os
from pathlib import Path

from PySide6.QtCore import QObject, QStandardPaths, Qt, Signal
from PySide6.QtWidgets import QFileDialog, QMessageBox, QWidget

from forcelab.errors import ForcelabError
from forcelab.gui import settings
from forcelab.gui.document import Document
from forcelab.gui.file_dialogs import last_folder
from forcelab.gui.jobs import Jobs
from forcelab.jobs import Progress
from forcelab.project import Project
from forcelab.text import name_alike, tidy_name


class ProjectActions(QObject):
    """What opens projects for a window.

    Parameters
    ----------
    document : Document
        In which they are opened.
    jobs : Jobs
        Make the sample project and import recordings.
    window : QWidget
        Over which dialogs appear.
    remembering : bool
        Whether what is opened is kept among the recent projects.
    author : str
        The coder of the project that is opened first, or of all where nothing is remembered; by
        default, as later, the one who labelled in it last.
    """

    sampling = Signal(object)
    refused = Signal(str)
    recent_changed = Signal()

    def __init__(
        self,
        document: Document,
        jobs: Jobs,
        window: QWidget,
        *,
        remembering: bool,
        author: str = "",
    ) -> None:
        super().__init__(window)
        self._document, self._jobs, self._window = document, jobs, window
        self._remembering = remembering
        self._author = author
        self._unasked = False
        document.project_changed.connect(self._do_without_sample)

    def open(self, path: Path, demonstration: str = "") -> bool:
        """Open a project and a demonstration of it; gives whether that could be done.

        Parameters
        ----------
        path : Path
            The project's folder.
        demonstration : str
            Name or id; by default the one that was open last, or the first.
        """
        try:
            self._document.open_project(path)
        except ForcelabError as error:
            self._document.show_message(str(error), True)
            self.refused.emit(str(error))
            return False
        self._take_coder(path)
        if self._remembering:
            settings.remember_project(path)
        ids = [info.id for info in self._document.infos]
        last = settings.text(_last_demonstration_key(path)) if self._remembering else ""
        wanted = demonstration or (last if last in ids else next(iter(ids), ""))
        return self._document.open_demonstration(wanted) if wanted else True

    def open_recent(self, path: Path) -> bool:
        """Open a project that was open before; one that was moved is asked for."""
        if self.is_found(path):
            return self.open(path)
        box = QMessageBox(self._window)
        box.setIcon(QMessageBox.Icon.Question)
        box.setWindowTitle("Project not found")
        box.setTextFormat(Qt.TextFormat.PlainText)
        box.setText(_not_found(path))
        locate = box.addButton("Locate…", QMessageBox.ButtonRole.AcceptRole)
        forget = box.addButton("Remove from list", QMessageBox.ButtonRole.ActionRole)
        box.setEscapeButton(box.addButton(QMessageBox.StandardButton.Cancel))
        box.setDefaultButton(locate)
        box.exec()
        pressed = box.clickedButton()
        box.deleteLater()
        if pressed is forget:
            settings.forget_project(path)
            self.recent_changed.emit()
        return pressed is locate and self._locate(path)

    def is_found(self, path: Path) -> bool:
        """Whether a project that was open before is still there; says so where it is not."""
        if settings.is_folder(path):
            return True
        self.refused.emit(_not_found(path))
        self._document.show_message(_not_found(path), True)
        return False

    def _locate(self, path: Path) -> bool:
        """Let the user choose where a project was moved to, and open it."""
        nearest = next(
            (folder for folder in path.parents if settings.is_folder(folder)), Path.home()
        )
        title = f"Where is '{path.name}' now?"
        chosen = QFileDialog.getExistingDirectory(self._window, title, str(nearest))
        if not chosen or not self.open(Path(chosen)):
            return False
        settings.forget_project(path)
        return True

    def _take_coder(self, path: Path) -> None:
        """Label as who was asked for, or as who labels in this project."""
        project = self._document.project
        known = () if project is None else project.coding.people()
        name = tidy_name(self._author) or settings.coder(path, known)
        if self._remembering:
            self._author = ""
        self._document.set_author(name)
        if (there := name_alike(name, known)) is not None:
            self._document.show_message(f"'{name}' is a new coder beside '{there}'.")

    def remember_demonstration(self) -> None:
        """Keep which demonstration is open, for the next time."""
        project = self._document.project
        if self._remembering and project is not None and self._document.id:
            settings.store(_last_demonstration_key(project.path), self._document.id)

    def make_sample(self, path: Path, *, asked: bool = True) -> None:
        """Make the sample project in the background, unless it is there, and open it.

        Parameters
        ----------
        path : Path
            Its folder.
        asked : bool
            Whether somebody asked for it; where nobody did, it ends when a project is opened.
        """
        from forcelab.sample import making

        def over(_: object) -> None:
            self._unasked = False
            self.sampling.emit(None)

        def made(_: bool) -> None:
            over(None)
            if self._document.project is None:
                self.open(path)
            else:
                self._document.show_message(f"The sample project is ready: {path}")

        def failed(error: Exception) -> None:
            over(None)
            self._document.show_message(str(error), True)

        self._unasked = not asked
        self.sampling.emit(Progress(0, 1, "making the sample project"))
        job = making(path, os.cpu_count() or 1)
        self._jobs.run(job, made, failed, progress=self.sampling.emit, key="sample")

    def cancel_sample(self) -> None:
        """Do without the sample project; nothing of it stays."""
        self._jobs.cancel("sample")
        self.sampling.emit(None)

    def _do_without_sample(self) -> None:
        """End what nobody asked for, once there is a project to work in."""
        if self._unasked and self._document.project is not None:
            self._unasked = False
            self.cancel_sample()

    def ask_open(self) -> None:
        """Let the user choose a project's folder."""
        chosen = QFileDialog.getExistingDirectory(
            self._window, "Open a project", str(last_folder("project"))
        )
        if chosen:
            self.open(Path(chosen))

    def ask_new(self) -> None:
        """Let the user name a new project's folder."""
        # Named like a project that is there, the dialog would open in that one's folder.
        folder, number = last_folder("project"), 1
        suggested = folder / "study.forcelab"
        while suggested.exists():
            number += 1
            suggested = folder / f"study-{number}.forcelab"
        title = "New project"
        chosen, _ = QFileDialog.getSaveFileName(self._window, title, str(suggested))
        if not chosen:
            return
        path = Path(chosen)
        if not path.suffix:  # so that it is known among other folders, and as a command line's word
            path = path.with_name(f"{path.name}.forcelab")
        try:
            Project.create(path).close()
        except ForcelabError as error:
            self._document.show_message(str(error), True)
            return
        self.open(path)

    def ask_import(self, files: tuple[Path, ...] = ()) -> None:
        """Let the user choose recordings, and import them in the background."""
        from forcelab.gui.import_dialog import ImportDialog

        if self._document.project is None:
            self._document.show_message(
                "Open or make a project first; recordings go into it.", True
            )
            return
        dialog = ImportDialog(self._document, self._jobs, self._window, files)
        dialog.exec()
        dialog.deleteLater()


def _not_found(path: Path) -> str:
    """Say that a project is not where it was."""
    return (
        f"The project '{path.name}' is no longer in '{path.parent}': it was moved, renamed "
        "or deleted, or its disk "
        "is not connected."
    )


def sample_place() -> Path:
    """Where the sample project of this user lies."""
    where = QStandardPaths.writableLocation(QStandardPaths.StandardLocation.DocumentsLocation)
    folder = Path(where) if where and Path(where).is_dir() else Path.home()
    return folder / "sample.forcelab"


def _last_demonstration_key(project: Path) -> str:
    """Where the settings keep which demonstration of a project was open last."""
    return settings.key_of("last", project)
