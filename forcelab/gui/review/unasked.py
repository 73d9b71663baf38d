"""Runs that nobody asked for: they come not too often, and only the last of them stay."""

from __future__ import annotations

from math import inf
from time import monotonic
from typing import TYPE_CHECKING, NamedTuple

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document

if TYPE_CHECKING:
    from forcelab.review.run_result import Outcome

__all__ = ["Unasked"]

#: So many of them stay for each task: enough to compare the last one with those before.
STAYING = 3


class _Run(NamedTuple):
    """A run that came by itself."""

    number: int
    proposer: str
    task: tuple[str | None, ...]


class Unasked:
    """Lets go of older runs that came by themselves, while the window is open.

    After each there is a rest for as long as it took: where a training takes minutes, every edit
    would otherwise be followed by one more, and the machine would do nothing else. A run that
    somebody has judged, or accepted labels from, stays in the project; so does one that is looked
    at.

    Parameters
    ----------
    document : Document
        Whose project keeps the runs.
    """

    def __init__(self, document: Document) -> None:
        self._document = document
        self.forget()

    def forget(self) -> None:
        """Begin anew, as with another project."""
        self._made: list[_Run] = []
        self._began = self._until = -inf

    @property
    def resting(self) -> bool:
        """Whether none may come by itself yet."""
        return monotonic() < self._until

    def begin(self) -> None:
        """Take note that a training begins."""
        self._began = monotonic()

    def end(self) -> None:
        """Take note that it has ended."""
        now = monotonic()
        self._until = now + (now - self._began)

    def trained(self, outcome: Outcome) -> None:
        """Take note of a run, and let go of those that are too old by now."""
        task = (*outcome.tasks, outcome.test_task)
        self._made.append(_Run(outcome.number, outcome.proposer, task))
        for old in [one for one in self._made if one.task == task][:-STAYING]:
            shown = self._document.outcome
            if shown is None or shown.number != old.number:
                self._made.remove(old)
                self._let_go(old)

    def _let_go(self, old: _Run) -> None:
        """Have the project delete a run, unless it was used."""
        if self._document.project is not None:
            try:
                self._document.project.forget_run(old.number, old.proposer)
            except ForcelabError as error:  # it stays, and is told like any other trouble
                self._document.say(str(error), True)
