"""Opening, creating and filling projects, with their dialogs."""

from __future__ import annotations

import os
from pathlib import Path

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QFileDialog, QWidget

from forcelab.errors import ForcelabError
from forcelab.gui import settings
from forcelab.gui.document import Document
from forcelab.gui.file_dialogs import last_folder
from forcelab.gui.jobs import Jobs
from forcelab.gui.preferences import SAMPLE_FOLDER
from forcelab.gui.text import ask
from forcelab.jobs import Progress
from forcelab.project import Project
from forcelab.text import name_alike, tidy_name


class ProjectActions(QObject):
    """Opens projects for a window.

    `author` is the coder of the project that is opened first, or of all if not `remembering`;
    later, and by default, it is the one who labelled in the project last.
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
        self._opens_unasked = False
        document.project_changed.connect(self._do_without_sample)

    def open(self, path: Path, demonstration: str = "") -> bool:
        """Open a project and a demonstration (name or id); returns whether that succeeded.

        By default it is the demonstration that was open last, or the first.
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
        opened = demonstration or (last if last in ids else next(iter(ids), ""))
        return self._document.open_demonstration(opened) if opened else True

    def open_recent(self, path: Path) -> bool:
        """Open a recent project; if it was moved, ask for its place."""
        if self.is_found(path):
            return self.open(path)
        answers = "Locate…", "Remove from list", "Cancel"
        answer = ask(self._window, "Project not found", _not_found(path), "", answers, escape=2)
        if answer == "Remove from list":
            self.forget_recent(path)
        return answer == "Locate…" and self._locate(path)

    def forget_recent(self, path: Path) -> None:
        """Remove a project from the list of recent ones."""
        settings.forget_project(path)
        self.recent_changed.emit()

    def is_found(self, path: Path) -> bool:
        """Whether a recent project is still there; says so if not."""
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
        """Label as the requested coder, or as the last one in this project."""
        project = self._document.project
        people = () if project is None else project.coding.people()
        name = tidy_name(self._author) or settings.coder(path, people)
        if self._remembering:
            self._author = ""
        self._document.set_author(name)
        if (existing := name_alike(name, people)) is not None:
            self._document.show_message(f"'{name}' is a new coder beside '{existing}'.")

    def remember_demonstration(self) -> None:
        """Remember which demonstration is open."""
        project = self._document.project
        if self._remembering and project is not None and self._document.id:
            settings.store(_last_demonstration_key(project.path), self._document.id)

    def make_sample(self, path: Path, *, asked: bool = True) -> None:
        """Make the sample project in the background, if need be, and open it.

        If nobody asked for it (`asked`), it is cancelled when a project is opened.
        """
        from forcelab.sample import making

        def end(_: object) -> None:
            self._opens_unasked = False
            self.sampling.emit(None)

        def ready(_: bool) -> None:
            end(None)
            if self._document.project is None:
                self.open(path)
            else:
                self._document.show_message(f"The sample project is ready: {path}")

        def failed(error: Exception) -> None:
            end(None)
            self._document.show_message(str(error), True)

        self._opens_unasked = not asked
        self.sampling.emit(Progress(0, 1, "making the sample project"))
        job = making(path, os.cpu_count() or 1)
        self._jobs.run(job, ready, failed, progress=self.sampling.emit, key="sample")

    def cancel_sample(self) -> None:
        """Cancel the making of the sample project; nothing of it stays."""
        self._jobs.cancel("sample")
        self.sampling.emit(None)

    def _do_without_sample(self) -> None:
        """Cancel a sample nobody asked for, once there is a project to work in."""
        if self._opens_unasked and self._document.project is not None:
            self._opens_unasked = False
            self.cancel_sample()

    def ask_open(self) -> None:
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
    return (
        f"The project '{path.name}' is no longer in '{path.parent}': it was moved, renamed "
        "or deleted, or its disk "
        "is not connected."
    )


def sample_place() -> Path:
    """Where this user's sample project lies."""
    return SAMPLE_FOLDER.value / "sample.forcelab"


def _last_demonstration_key(project: Path) -> str:
    """The settings key of the demonstration that was open last."""
    return settings.key_of("last", project)
