"""The trainer of the window: what is under way, since when, and what came of it last."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, QTimer, Signal

from forcelab.errors import ForcelabError, InputError
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.review import remembered
from forcelab.gui.review.bar_texts import standing_text
from forcelab.gui.review.edit_count import EditCount
from forcelab.gui.review.runs import LISTING, LOADING, Runs
from forcelab.gui.review.training_jobs import BACKGROUND, Work
from forcelab.gui.review.unasked import Unasked

if TYPE_CHECKING:
    from forcelab.review.run_result import Outcome
    from forcelab.review.training import Step

__all__ = ["Learning"]

#: Training by itself begins when nothing was edited for so many ms.
QUIET = 5000
#: The key of its job.
TRAINING = "training"


class Learning(Runs):
    """Trains on a snapshot of the labels in the background, while the coder goes on.

    The outcome that is reviewed stays until a new one is there.

    Parameters
    ----------
    document : Document
        Gets the outcome, by :meth:`~forcelab.gui.document.Document.set_outcome`.
    jobs : Jobs
    parent : QObject, optional
    work : Work, optional
        What is done in the background.

    Attributes
    ----------
    step : Step or None
        How far it is.
    trail : list of Step
        All steps of the training that is under way or was the last one.
    automatic : bool
        Whether edits are followed by a training.
    """

    losses_changed = Signal()

    def __init__(
        self,
        document: Document,
        jobs: Jobs,
        parent: QObject | None = None,
        *,
        work: Work = BACKGROUND,
    ) -> None:
        super().__init__(document, jobs, work, parent)
        self._counter = EditCount(document, work.edits, self)
        self._counter.counted.connect(self.changed)
        self._counter.edited.connect(self._edited)
        self._quiet = QTimer(self, singleShot=True, interval=QUIET)
        self._quiet.timeout.connect(self._train_by_itself)
        self._unasked = Unasked(document)
        self._forget()
        document.project_changed.connect(self._project_changed)
        document.demonstration_changed.connect(self._demonstration_changed)
        self._project_changed()

    def _forget(self) -> None:
        """Begin with nothing."""
        self._want_nothing()
        self.document.set_training(False)
        self.step: Step | None = None
        self.trail: list[Step] = []
        self.automatic = False
        self.runs = ()
        self._by_itself = False
        self._unasked.forget()

    # How it stands

    @property
    def training(self) -> bool:
        """Whether a training is under way."""
        return self.document.training

    @property
    def edits(self) -> int | None:
        """How many edits were made since what is reviewed was trained; None where nothing is."""
        return self._counter.edits

    @property
    def kept(self) -> bool:
        """Whether the project has the recogniser of what is reviewed; an evaluation keeps none."""
        project, outcome = self.document.project, self.document.outcome
        if project is None or outcome is None:
            return False
        try:
            project.recogniser_path(outcome.recogniser)
        except InputError:
            return False
        return True

    @property
    def stands(self) -> tuple[str, str]:
        """How up to date what is reviewed is, at length and in short."""
        return standing_text(self.edits, self.learnt_from, kept=self.kept, resettled=self.resettled)

    @property
    def _outdated(self) -> bool:
        """Whether a training would find anything new."""
        return bool(self.document.outcome is None or self.edits or self.learnt_from)

    def set_automatic(self, automatic: bool) -> None:
        """Train by itself some seconds after edits, or only when told to."""
        if automatic == self.automatic:
            return
        self.automatic = automatic
        self._keep(automatic)
        if automatic and self.edits:
            self._quiet.start()
        elif not automatic:
            self._quiet.stop()

    def set_task(self, task: str) -> None:
        """Turn to another task: its settings, its choice, and its latest outcome."""
        if task == self.task or self._path is None:
            return
        self.jobs.cancel(LOADING)  # a run of the task before
        self._turn_to(task)
        self._show_latest()

    # Training

    def train(self) -> bool:
        """Begin a training; gives whether it began. Never are there two at once."""
        if self.training:
            self._by_itself = False  # from now on somebody has asked for the one under way
            return False
        self._quiet.stop()
        self._by_itself = False
        if self._path is None or not self.ready:
            self._refuse("There is nothing to train on; import demonstrations first.")
            return False
        self.step, self.trail, self.trouble = None, [], ""
        self._unasked.begin()
        self.document.set_training(True)
        name = " + ".join(task or "no task" for task in self.chosen[0])
        self.jobs.run(
            self._work.train(self._path, self._given(), name, self.trail),
            self._trained,
            self._failed,
            self._progressed,
            key=TRAINING,
        )
        self.changed.emit()
        self.losses_changed.emit()
        return True

    def cancel(self) -> None:
        """Give the training up; what is reviewed stays."""
        self._quiet.stop()
        if not self.training:
            return
        self.jobs.cancel(TRAINING)
        self.step = None
        self.document.set_training(False)
        self.changed.emit()

    def _progressed(self, step: object) -> None:
        """Take note of how far the training is."""
        if self.trail and step is not None and self.step is not self.trail[-1]:
            self.step = self.trail[-1]
            self.changed.emit()
            self.losses_changed.emit()

    def _trained(self, outcome: Outcome) -> None:
        """Put the new outcome in place of the old one."""
        self.step = None
        self._unasked.end()
        self.document.set_training(False)
        if self._by_itself:
            self._unasked.trained(outcome)
        if self.task in (*outcome.tasks, outcome.test_task):
            self.jobs.cancel(LOADING)
            self.document.set_outcome(outcome)
        else:  # the coder has turned to another task meanwhile
            self.document.say(f"The training of '{outcome.title}' is done; its run is in the list.")
        self.changed.emit()
        self.losses_changed.emit()
        self.list_runs()
        if self.automatic and self.edits:
            self._quiet.start()  # what was painted meanwhile

    def _failed(self, error: Exception) -> None:
        """Say why it did not come about."""
        self.step = None
        self.document.set_training(False)
        known = isinstance(error, ForcelabError)
        self._refuse(str(error) if known else "The training failed; the log says more.")

    def _train_by_itself(self) -> None:
        """Train after a pause, if there is something new; the longer it takes, the more seldom."""
        if self._unasked.resting:
            self._quiet.start()
        elif self.automatic and not self.training and self._outdated:
            self._by_itself = self.train()

    # What happens to the document

    def _project_changed(self) -> None:
        """Turn to another project, or to none."""
        for key in (TRAINING, LOADING, LISTING):
            self.jobs.cancel(key)
        self._quiet.stop()
        self._counter.forget()
        self._forget()
        project = self.document.project
        self._path = None if project is None else project.path
        if self._path is not None:
            self.task = next(iter(self.tasks), "")
            self.automatic = remembered.recall_automatic(self._path)
            self.list_runs()
        self.changed.emit()
        self.losses_changed.emit()
        self.runs_changed.emit()

    def _demonstration_changed(self) -> None:
        """Follow to the task of the open demonstration, unless it is in what is reviewed."""
        demonstration, outcome = self.document.demonstration, self.document.outcome
        if demonstration is None:
            return
        if outcome is not None and (
            demonstration.task in (*outcome.tasks, outcome.test_task)
            or outcome.find(demonstration.id) is not None
        ):
            return
        self.set_task(demonstration.task)

    def _edited(self) -> None:
        """Train by itself when it has been quiet for a while."""
        if self.automatic:
            self._quiet.start()
