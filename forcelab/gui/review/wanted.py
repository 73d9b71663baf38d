"""What is trained on and how: of the task that is at hand, as the coder chose it last."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QCoreApplication, QObject, Signal

from forcelab.gui.document import Document
from forcelab.gui.review import remembered
from forcelab.gui.review.training_jobs import Given
from forcelab.gui.review.whose import whose_labels

if TYPE_CHECKING:
    from collections.abc import Sequence

    from forcelab.recognition.choice import Choice
    from forcelab.recognition.settings import Settings

__all__ = ["GROUPS", "MANY", "Wanted", "groups_for", "shown_task"]

#: More demonstrations than `MANY` are left out in so many groups unless somebody chooses otherwise:
#: eighty fits of what eighty demonstrations hold take half an hour, ten of them four minutes.
MANY, GROUPS = 20, 10


def shown_task(task: str) -> str:
    """What a task is called on the screen; demonstrations may be of none."""
    return task or QCoreApplication.translate("forcelab", "no task")


def groups_for(document: Document, tasks: Sequence[str], author: str | None) -> int:
    """In how many groups demonstrations are left out where nobody chose; 0: each by itself.

    Parameters
    ----------
    document : Document
    tasks : sequence of str
        What is trained on.
    author : str or None
        Whose labels count; None where nobody has labelled anything.
    """
    labelled = (author in info.labelled for info in document.infos if info.task in tasks)
    return GROUPS if sum(labelled) > MANY else 0


class Wanted(QObject):
    """Settings and choice of the task at hand, remembered for each task of each project.

    Parameters
    ----------
    document : Document
    parent : QObject, optional

    Attributes
    ----------
    task : str
        Whose settings and choice count. Demonstrations of no task are of the task ``""``, so ask
        :attr:`ready` whether there is one.
    trouble : str
        Why the last training did not come about; empty where it did.
    """

    changed = Signal()

    def __init__(self, document: Document, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.document = document
        self._path: Path | None = None
        self._want_nothing()

    def _want_nothing(self) -> None:
        """Begin with no task."""
        self.task = ""
        self.trouble = ""
        self._settings: Settings | None = None
        self._choice: Choice | None = None

    @property
    def ready(self) -> bool:
        """Whether there is anything of the task."""
        return self._path is not None and self.task in self.tasks

    @property
    def tasks(self) -> tuple[str, ...]:
        """The tasks of the project."""
        return tuple(dict.fromkeys(info.task for info in self.document.infos))

    @property
    def settings(self) -> Settings:
        """How a recogniser is trained."""
        if self._settings is None:
            self._settings = remembered.recall_settings(self._path or Path(), self.task)
        return self._settings

    @property
    def choice(self) -> Choice:
        """What a recogniser is trained on; without an author, the coder's own labels come first."""
        if self._choice is None:
            self._choice = remembered.recall_choice(self._path or Path(), self.task)
        return self._choice

    @property
    def called(self) -> tuple[str, bool]:
        """The preset that the settings began with, and whether they were changed."""
        return remembered.recall_called(self._path or Path(), self.task)

    @property
    def classifier(self) -> str:
        """The classifier that is trained."""
        if self._settings is not None:
            return self._settings.classifier
        values = remembered.recall_values(self._path or Path(), self.task) or {}
        return str(values.get("classifier", remembered.FIRST_CLASSIFIER))

    @property
    def chosen(self) -> tuple[tuple[str, ...], str | None, bool]:
        """The tasks trained on, the one tested on, and whether actions stay apart."""
        tasks, test, _, apart, _ = self._parts
        return tasks, test, apart

    @property
    def whose(self) -> str | None:
        """Whose labels are trained on; None where nobody has labelled anything."""
        tasks, test, author, _, _ = self._parts
        return author or whose_labels(self.document, {*tasks, test})

    @property
    def _parts(self) -> tuple[tuple[str, ...], str | None, str | None, bool, int | None]:
        """The choice as plain values; to build it loads much."""
        choice = self._choice
        if choice is None:
            return remembered.recall_parts(self._path or Path(), self.task)
        return choice.tasks, choice.test_task, choice.author, choice.apart, choice.folds

    def set_settings(self, settings: Settings) -> None:
        """Train like this from now on."""
        self._settings = settings
        self._keep(settings)

    def set_choice(self, choice: Choice) -> None:
        """Train on this from now on."""
        self._choice = choice
        self._keep(choice)

    def _keep(self, given: Settings | Choice | bool) -> None:
        """Remember what was asked for."""
        if self._path is not None:
            remembered.remember(self._path, self.task, given)
        self.trouble = ""
        self.changed.emit()

    def _given(self) -> Given:
        """What gives settings and choice; to build them loads much, so that is left to the job."""
        assert self._path is not None
        task, settings = self.task, self._settings
        values = remembered.recall_values(self._path, task)
        tasks, test, author, apart, folds = self._parts
        if author is None:
            author = self.whose
            self._say_whose(author)
        if folds is None and test is None:
            folds = groups_for(self.document, tasks, author)

        def given() -> tuple[Settings, Choice]:
            from forcelab.recognition.choice import Choice

            made = remembered.settings_of(values, task) if settings is None else settings
            return made, Choice(tasks, test, author, apart, folds=folds)

        return given

    def _say_whose(self, author: str | None) -> None:
        """Say that the labels of somebody else are taken."""
        own = self.document.author
        if author is not None and author != own:
            told = self.tr("{0} has labelled nothing of this; training on the labels of {1}.")
            self.document.say(told.format(own, author))
