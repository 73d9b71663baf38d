"""Undo in the review: verdicts and edits in one order, newest first."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime
from operator import attrgetter
from typing import Literal

from forcelab.gui.document import Document
from forcelab.project import Project
from forcelab.project.records import StoredVerdict, utc_now
from forcelab.review.differences import Interval
from forcelab.review.verdicts import withdraw

__all__ = ["VerdictHistory"]

_time = attrgetter("time")


@dataclass(frozen=True)
class _Change:
    """A verdict that was given, or withdrawn, in this session.

    Parameters
    ----------
    verdict : StoredVerdict
    withdrawn : bool
        Whether it was withdrawn instead of given.
    edit : int
        The number of the edit that gave the coder's track what the model sees; 0 without one.
    time : datetime
        When it was done, or undone.
    """

    verdict: StoredVerdict
    withdrawn: bool
    edit: int
    time: datetime

    @property
    def place(self) -> Interval:
        """Where it is shown."""
        v = self.verdict
        return Interval(v.demonstration, v.start, v.end, v.human, v.predicted)


class VerdictHistory:
    """The verdicts of this session, undone and redone in order of time with the coder's edits.

    One who judges goes on at once, often to another demonstration, so that edits are looked for
    in the open one and in that of the latest verdict; what changes is shown.
    """

    def __init__(self, document: Document) -> None:
        self._document = document
        self._done: list[_Change] = []
        self._undone: list[_Change] = []
        document.project_changed.connect(self._forget)
        document.author_changed.connect(self._forget)

    def add(self, verdict: StoredVerdict, edit: int = 0) -> None:
        """A verdict was given, with the edit of that number."""
        self._done.append(_Change(verdict, False, edit, utc_now()))
        self._undone.clear()

    def add_withdrawn(self, verdict: StoredVerdict) -> None:
        """A verdict was withdrawn."""
        self._done.append(_Change(verdict, True, 0, utc_now()))
        self._undone.clear()

    def undo(self) -> bool:
        """Take back the latest verdict or the latest edit, whichever is newer, where it is.

        Raises
        ------
        ForcelabError
            If the store cannot be read or written.
        """
        while self._done and self._counts(self._done[-1]) == self._done[-1].withdrawn:
            self._done.pop()  # undone elsewhere
        return self._revert(self._done, self._undone, "undo")

    def redo(self) -> bool:
        """Do again what was undone last, a verdict or an edit.

        Raises
        ------
        ForcelabError
            If the store cannot be read or written.
        """
        document, project = self._document, self._document.project
        while self._undone and self._counts(self._undone[-1]) != self._undone[-1].withdrawn:
            self._undone.pop()  # redone elsewhere
        if self._undone and project is not None and document.id:
            latest = project.history(document.id, document.author, latest=1)
            if latest and latest[0].reverts is None and latest[0].time > self._undone[-1].time:
                self._undone.clear()
        return self._revert(self._undone, self._done, "redo")

    def _revert(
        self, changes: list[_Change], opposite: list[_Change], kind: Literal["undo", "redo"]
    ) -> bool:
        """Undo or redo the latest of a list of verdicts, or a later edit."""
        document, project = self._document, self._document.project
        verb = document.undo if kind == "undo" else document.redo
        if not changes or project is None:
            return verb()
        change = changes[-1]
        places = {document.id, change.verdict.demonstration} - {""}
        tops = (project.revertible(id_, document.author, kind) for id_ in places)
        edit = max((top for top in tops if top is not None), key=_time, default=None)
        together = edit is not None and change.edit in (edit.id, edit.reverts)
        if edit is not None and edit.time > change.time and not together:
            elsewhere = edit.demonstration != document.id
            return (not elsewhere or document.examine(change.place)) and verb()
        if change.edit and not together:
            changes.pop()  # its labels went another way
            return self._revert(changes, opposite, kind)
        if not document.examine(change.place):
            return False
        if not together:
            self._revert_verdict(change, project, kind)
        elif not verb():  # the verdict goes with its edit
            return False
        opposite.append(replace(changes.pop(), time=utc_now()))
        return True

    def _revert_verdict(self, change: _Change, project: Project, kind: str) -> None:
        """Withdraw a verdict, or give it once more."""
        document = self._document
        if change.withdrawn == (kind == "redo"):
            withdraw(project, change.verdict, document.author)
            document.say("The verdict is taken back.")
        else:
            project.add_verdict(replace(change.verdict, id=0))
            document.say("The verdict counts again.")

    def _counts(self, change: _Change) -> bool:
        """Whether what was said counts now, in these words."""
        project, verdict = self._document.project, change.verdict
        return project is not None and any(
            (v.place, v.verdict) == (verdict.place, verdict.verdict)
            for v in project.verdicts(verdict.demonstration)
        )

    def _forget(self) -> None:
        """Another project, or another coder."""
        self._done.clear()
        self._undone.clear()
