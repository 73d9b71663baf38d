"""The runs that a project keeps: which there are, and which of them is reviewed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.review.training_jobs import Kept, Work
from forcelab.gui.review.wanted import Wanted

if TYPE_CHECKING:
    from pathlib import Path

    from forcelab.review.run_result import Outcome

__all__ = ["LISTING", "LOADING", "Runs"]

#: The keys of its jobs.
LOADING, LISTING = "outcome", "runs"


class Runs(Wanted):
    """Lists, shows and removes what was trained before, for the task at hand.

    Parameters
    ----------
    document : Document
        Gets the outcome, by :meth:`~forcelab.gui.document.Document.set_outcome`.
    jobs : Jobs
    work : Work
        What is done in the background.
    parent : QObject, optional

    Attributes
    ----------
    runs : tuple of Kept
        What the project keeps that can be reviewed, the latest first.
    """

    runs_changed = Signal()

    def __init__(
        self, document: Document, jobs: Jobs, work: Work, parent: QObject | None = None
    ) -> None:
        super().__init__(document, parent)
        self.jobs = jobs
        self.runs: tuple[Kept, ...] = ()
        self._work = work
        document.listing_changed.connect(self._listing_changed)

    def show_run(self, number: int) -> None:
        """Review what another run of the project found."""
        if self._path is not None:
            work = self._work.load(self._path, number)
            self.jobs.run(work, self._take, self._failed_to_load, key=LOADING)

    def remove_run(self, number: int) -> None:
        """Remove a run of the project for good; where it is reviewed, the latest one is then."""
        if (path := self._path) is not None:
            # Without a key: the next one that is removed must not keep this one in the project.
            work = self._work.remove(path, number)
            self.jobs.run(work, lambda _: self._removed(path, number), self._failed_to_load)

    def _removed(self, path: Path, number: int) -> None:
        """Take note that a run of a project is gone."""
        if path != self._path:
            return
        shown = self.document.outcome
        if shown is not None and shown.number == number:
            self.jobs.cancel(LOADING)
            self.document.set_outcome(None)
        self.document.say(f"Run {number} was removed.")
        self.list_runs()

    def list_runs(self) -> None:
        """Read in the background which runs there are."""
        if self._path is not None:
            self.jobs.run(
                self._work.listed(self._path), self._listed, self._failed_to_load, key=LISTING
            )

    def _listed(self, runs: tuple[Kept, ...]) -> None:
        """Offer the runs; where nothing is reviewed yet, the latest one is."""
        self.runs = runs
        self.runs_changed.emit()
        if self.document.outcome is None:
            self._show_latest()

    def _show_latest(self) -> None:
        """Review the latest run of the task, or nothing where there is none.

        As with :func:`~forcelab.review.run_result.latest`, one that tested the task's own
        demonstrations comes before one that learnt from them and tested others.
        """
        run = min(
            (run for run in self.runs if self.task in run.tasks),
            key=lambda run: (None, self.task, run.tested).index(run.tested),
            default=None,
        )
        shown = self.document.outcome
        if run is not None and (shown is None or shown.number != run.number):
            self.show_run(run.number)
        elif run is None and shown is not None:
            self.document.set_outcome(None)

    def _take(self, outcome: Outcome) -> None:
        """Review what was read; what is trained next is of the same task."""
        self.document.set_outcome(outcome)
        if outcome.tasks and self.task not in (*outcome.tasks, outcome.test_task):
            self._turn_to(outcome.tasks[0])
        self.changed.emit()

    def _failed_to_load(self, error: Exception) -> None:
        """Say what of the project could not be read."""
        if isinstance(error, ForcelabError):
            self._refuse(str(error))

    def _listing_changed(self) -> None:
        """Read what is reviewed again where it tells of a demonstration that was removed."""
        outcome = self.document.outcome
        if outcome is None or self._path is None:
            return
        there = {info.id for info in self.document.infos}
        if all(one.id in there for one in (*outcome.tested, *outcome.proposals)):
            return
        work = self._work.load(self._path, outcome.number)
        self.jobs.run(work, self._take, self._nothing_left, key=LOADING)

    def _nothing_left(self, error: Exception) -> None:
        """Review nothing where nothing that was tested is left."""
        self.document.set_outcome(None)
        self._failed_to_load(error)
