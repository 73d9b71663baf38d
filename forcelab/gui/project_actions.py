"""Opening, creating and filling projects, with their dialogs."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QFileDialog, QWidget

from forcelab.errors import ForcelabError
from forcelab.gui import settings
from forcelab.gui.document import Document
from forcelab.gui.file_dialogs import ask_files, last_folder, vacant_path, with_suffix
from forcelab.gui.jobs import Jobs
from forcelab.gui.layout import run_dialog
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
    #: The sample project, or one of the coder's own recordings, is open for the first time.
    begun = Signal()
    #: The sample project that was asked for is open.
    sample_opened = Signal()
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

    def open(self, path: Path, demonstration: str = "") -> bool:
        """Open a project and a demonstration (name or id); returns whether that succeeded.

        By default it is the demonstration that was open last, or the first; in the sample project
        the one that waits to be labelled.
        """
        try:
            self._document.open_project(path)
        except ForcelabError as error:
            return self._refuse(str(error))
        self._take_coder(path)
        if self._remembering:
            settings.remember_project(path)
        ids = [info.id for info in self._document.infos]
        last = settings.text(_last_demonstration_key(path)) if self._remembering else ""
        if demonstration or last in ids:
            return self._document.open_demonstration(demonstration or last)
        if not ids:
            return True
        from forcelab.sample import first_to_label  # only where nothing was open before

        first = first_to_label(self._document.infos)
        opened = self._document.open_demonstration(first or ids[0])
        if first:
            self.begun.emit()
        return opened

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
        return self._refuse(_not_found(path))

    def _refuse(self, sentence: str) -> bool:
        """Say why nothing was opened, wherever the coder looks; gives False."""
        self._document.show_message(sentence, True)
        self.refused.emit(sentence)
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
        project = self._document.project
        if self._remembering and project is not None and self._document.id:
            settings.store(_last_demonstration_key(project.path), self._document.id)

    def make_sample(self, path: Path) -> None:
        """Make the sample project in the background, if need be, and open it."""
        from forcelab.sample import make_sample_job

        def ready(_: bool) -> None:
            self.sampling.emit(None)
            if self._document.project is not None:
                self._document.show_message(f"The sample project is ready: {path}")
            elif self.open(path):
                self.sample_opened.emit()

        def failed(error: Exception) -> None:
            self.sampling.emit(None)
            self._refuse(str(error))

        self.sampling.emit(Progress(0, 1, "making the sample project"))
        job = make_sample_job(path, os.cpu_count() or 1)
        self._jobs.run(job, ready, failed, progress=self.sampling.emit, key="sample")

    def cancel_sample(self) -> None:
        """Cancel the making of the sample project; nothing of it stays."""
        self._jobs.cancel("sample")
        self.sampling.emit(None)

    def ask_open(self) -> None:
        chosen = QFileDialog.getExistingDirectory(
            self._window, "Open a project", str(last_folder("project"))
        )
        if chosen:
            self.open(Path(chosen))

    def ask_new(self) -> None:
        """Let the user name a new project's folder."""
        suggested = vacant_path(last_folder("project"), "study")
        chosen, _ = QFileDialog.getSaveFileName(self._window, "New project", str(suggested))
        if not chosen:
            return
        path = with_suffix(Path(chosen))
        try:
            Project.create(path).close()
        except ForcelabError as error:
            self._document.show_message(str(error), True)
            return
        self.open(path)

    def ask_import(self, files: Sequence[Path] = ()) -> None:
        """Let the user choose recordings, and import them in the background.

        While no project is open they are chosen first, and a new one is proposed beside them.
        """
        from forcelab.gui.import_dialog import ImportDialog

        new = self._document.project is None
        if new and not files:
            files = ask_files(self._window, "Recordings", "recordings")
            if not files:
                return
        run_dialog(ImportDialog(self._document, self._jobs, self._window, files, self.open))
        if new and self._document.project is not None:
            self.begun.emit()

    def ask_labels(self) -> None:
        """Let the user choose label files, and import them onto the demonstrations they are of."""
        from forcelab.gui.label_import_dialog import LabelImportDialog

        run_dialog(LabelImportDialog(self._document, self._jobs, self._window))


def _not_found(path: Path) -> str:
    return (
        f"The project '{path.name}' is no longer in '{path.parent}': it was moved, renamed "
        "or deleted, or its disk is not connected."
    )


def sample_place() -> Path:
    """Where this user's sample project lies."""
    return SAMPLE_FOLDER.value / "sample.forcelab"


def _last_demonstration_key(project: Path) -> str:
    """The settings key of the demonstration that was open last."""
    return settings.key_of("last", project)
