"""The Review tab: builds the workspace when it is first shown, its commands and status line."""

from __future__ import annotations

from collections.abc import Callable, Generator
from functools import partial
from typing import TYPE_CHECKING, Literal

from PySide6.QtWidgets import QWidget

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.layout import page_layout
from forcelab.gui.review.trainer import MEASURING, RUNNING, TRAINING, Trainer
from forcelab.gui.review.training_backend import training_progress_text
from forcelab.gui.status_bar import BackgroundIndicator

if TYPE_CHECKING:
    from forcelab.gui.label.workspace import LabelWorkspace
    from forcelab.gui.review.workspace import ReviewWorkspace


class TrainingIndicator(BackgroundIndicator):
    """A line in the status bar that leads to the review, while another workspace is in front."""

    def __init__(self, trainer: Trainer) -> None:
        super().__init__()
        self._trainer = trainer
        self.setStyleSheet("padding: 0 0.5em")
        self.setToolTip("Show the review")
        trainer.changed.connect(self.refresh)
        trainer.document.tracks_changed.connect(self.refresh)
        self.refresh()

    def words(self) -> str:
        """How far a training is, or how many edits there were since the last one."""
        trainer = self._trainer
        if trainer.training:
            step = trainer.step
            return f"Training: {'starting' if step is None else training_progress_text(step)}"
        run = trainer.document.review.run
        if trainer.edits is None or run is None:
            return ""
        subject = "Recogniser" if trainer.has_recogniser else f"Run {run.number}"
        return f"{subject}: {trainer.freshness[0]}"


WARM_UP = "warming up"
#: Jobs that the screen is complete without.
BACKGROUND_JOBS = frozenset({TRAINING, MEASURING, WARM_UP})


class ReviewTab(QWidget):
    """Room for the Review workspace; its trainer works whichever workspace is in front."""

    def __init__(self, document: Document, jobs: Jobs, label: LabelWorkspace) -> None:
        super().__init__()
        self.document = document
        self.trainer = Trainer(document, jobs, self)
        self.indicator = TrainingIndicator(self.trainer)
        self._jobs = jobs
        self._label = label
        self._built: ReviewWorkspace | None = None
        self._painting = True  # whether the timeline has the keyboard while this is in front

    @property
    def workspace(self) -> ReviewWorkspace:
        """The workspace, built when it is first needed."""
        if self._built is None:
            # What it needs is not loaded by those who only label.
            from forcelab.gui.review.workspace import ReviewWorkspace

            self._built = ReviewWorkspace(self.document, self._jobs, self.trainer, self._label)
            page_layout(self, self._built)
            self._built.restore_layout()
            self._jobs.run(_warm_up(), lambda _: None, key=WARM_UP)
        return self._built

    def come_to_front(self, front: bool) -> None:
        """Borrow timeline and video, or give them back."""
        self.indicator.set_elsewhere(not front)
        tracks = self._label.tracks
        if front:
            self.workspace.borrow()
            if self._painting:  # or Qt gives the keyboard to whatever comes first
                tracks.setFocus()
            return
        if self.isAncestorOf(tracks):
            self._painting = self.focusWidget() is tracks
        self._label.take_back()

    def remember_layout(self) -> None:
        if self._built is not None:
            self._built.remember_layout()

    def reset_layout(self) -> None:
        if self._built is not None:
            self._built.reset_layout()

    def handlers(self) -> dict[str, Callable[[], object]]:
        document = self.document
        return {
            "train": self.trainer.train,
            "cancel_training": self.trainer.cancel,
            "next_review": lambda: self.workspace.queue.step(1),
            "previous_review": lambda: self.workspace.queue.step(-1),
            "accept": document.review.accept_here,
            "accept_all": document.review.accept_in_view,
            "undo": partial(self._revert, "undo"),
            "redo": partial(self._revert, "redo"),
            "verdict_human": lambda: self.workspace.queue.judge("human"),
            "verdict_model": lambda: self.workspace.queue.judge("model"),
            "verdict_ambiguous": lambda: self.workspace.queue.judge("ambiguous"),
        }

    def obstacles(self) -> dict[str, Callable[[], str]]:
        """Why commands cannot be carried out now, by their id; empty where they can."""
        trainer, idle = self.trainer, "No training is running."
        return {
            "train": lambda: RUNNING if trainer.training_as_asked else trainer.obstacle,
            "cancel_training": lambda: "" if trainer.training else idle,
            "next_review": self._missing_run,
            "previous_review": self._missing_run,
            "undo": partial(self._nothing_to, "undo"),
            "redo": partial(self._nothing_to, "redo"),
        }

    def _missing_run(self) -> str:
        if self.document.review.run is not None:
            return ""
        if self.trainer.training:
            return "A recogniser is being trained; when that is done, there is something to review."
        return "There is nothing to review yet; train first, with F5."

    def _nothing_to(self, kind: Literal["undo", "redo"]) -> str:
        document, project = self.document, self.document.project
        if project is None or (self._built is not None and self._built.queue.history.holds(kind)):
            return ""
        try:
            some = project.tracks.can_revert(document.id, document.author, kind)
        except ForcelabError:  # a busy store; the command itself says so
            return ""
        return "" if some else f"There is nothing to {kind}."

    def _revert(self, kind: Literal["undo", "redo"]) -> None:
        """Undo or redo the latest verdict or edit; verdicts are given by keys in any workspace."""
        editor = self.document.editor
        if self._built is not None:
            self._built.queue.revert(kind)
        elif kind == "undo":
            editor.undo_everywhere()
        else:
            editor.redo_everywhere()


def _warm_up() -> Generator[None, None, None]:
    """Load what training needs, so that it begins at once."""
    from forcelab.process import warm_up
    from forcelab.review.training import review_job

    yield
    warm_up(review_job)
