"""What is trained on and how: of the task that is at hand, as the coder chose it last."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from forcelab.gui.document import Document
from forcelab.gui.review import remembered
from forcelab.gui.review.training_jobs import Given
from forcelab.labels import is_model
from forcelab.recognition.groups import usual_folds

if TYPE_CHECKING:
    from collections.abc import Sequence

    from forcelab.recognition.dataset import Choice
    from forcelab.recognition.settings import Settings

__all__ = ["OWN", "Wanted", "groups_for", "shown_task", "whose_labels"]

#: A coder's own labels are trained on from so many complete demonstrations on, whoever labelled
#: more: with one, as after accepting a single prediction, nothing could be tested.
OWN = 2
#: A demonstration is complete whose labels last so large a share of what another coder labelled of
#: it; of one that nobody else labelled, of its length.
COMPLETE = 0.5


def shown_task(task: str) -> str:
    """What a task is called on the screen; demonstrations may be of none."""
    return task or "no task"


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
    return usual_folds(sum(labelled))


def whose_labels(document: Document, tasks: set[str | None]) -> str | None:
    """The coder's own labels, or those of who labelled most; None where nobody did.

    So whoever looks at a project of others can train at once. The coder's own count from
    :data:`OWN` complete demonstrations on, or where nobody else has more. One that was only begun
    counts where nobody has any complete. Models are no coders.
    """
    own, open_one = document.author, document.demonstration
    begun: Counter[str] = Counter()
    complete: Counter[str] = Counter()
    for info in document.infos:
        if info.task not in tasks:
            continue
        seconds = {a: s for a, s in info.labelled.items() if s and not is_model(a)}
        if open_one is not None and info.id == document.id and document.segments:
            # Which the list may not tell yet.
            seconds[own] = sum(segment.end - segment.start for segment in document.segments)
        begun.update(seconds.keys())
        complete.update(
            author
            for author, labelled in seconds.items()
            if labelled
            >= COMPLETE * max((s for a, s in seconds.items() if a != author), default=info.duration)
        )
    count = complete or begun
    if not count:
        return None
    most, number = min(count.items(), key=lambda one: (-one[1], one[0]))
    return own if count[own] >= min(OWN, number) else most


class Wanted(QObject):
    """Settings and choice of the task at hand, remembered for each task of each project.

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
        self._whose: tuple[tuple[object, ...], str | None] | None = None

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
        if author:
            return author
        # Asked for several times an edit, over hundreds of demonstrations.
        document = self.document
        state = document.infos, document.id, document.segments, document.author, tasks, test
        if self._whose is None or self._whose[0] != state:
            self._whose = state, whose_labels(document, {*tasks, test})
        return self._whose[1]

    @property
    def learnt_from(self) -> str:
        """Whose labels what is reviewed was trained on, if the next training takes another's."""
        outcome = self.document.outcome
        if outcome is None or not self.ready or outcome.author == self.whose:
            return ""
        return outcome.author

    @property
    def resettled(self) -> bool:
        """Whether the next training takes other settings than what is reviewed was trained with."""
        outcome = self.document.outcome
        return outcome is not None and self.ready and outcome.settings != self.settings

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

    def _turn_to(self, task: str) -> None:
        """Have the settings and the choice of another task count."""
        self.task = task
        self._settings = self._choice = None
        self.trouble = ""
        self.changed.emit()

    def dismiss(self) -> None:
        """Take note of the trouble."""
        if self.trouble:
            self.trouble = ""
            self.changed.emit()

    def _refuse(self, sentence: str) -> None:
        """Say what is missing; also where the bar that shows it is not in front."""
        self.trouble = sentence
        self.document.say(sentence, True)
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
            from forcelab.recognition.dataset import Choice

            made = remembered.settings_of(values, task) if settings is None else settings
            return made, Choice(tasks, test, author, apart, folds=folds)

        return given

    def _say_whose(self, author: str | None) -> None:
        """Say that the labels of somebody else are taken."""
        own = self.document.author
        if author is not None and author != own:
            self.document.say(
                f"{own} has labelled fewer than {OWN} demonstrations of this; training on "
                "the labels of "
                f"{author}."
            )
