"""Who is to label what in a project: assignments, blind ones among them."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from forcelab.project.assignments import Assignments
from forcelab.project.database import Database
from forcelab.project.decisions import Assignment, AssignmentEvent
from forcelab.project.folder import ProjectFolder

__all__ = ["ProjectCoding"]


class ProjectCoding(ProjectFolder):
    """The assignments of a :class:`~forcelab.project.Project`."""

    def __init__(self, path: Path, database: Database) -> None:
        super().__init__(path, database)
        self._assignments = Assignments(database)

    def assign(self, demonstration: str, author: str, blind: bool = True) -> Assignment:
        """Assign a demonstration to a coder.

        What is assigned already keeps its time and whether it is done.

        Parameters
        ----------
        demonstration : str
            Its id.
        author : str
            The coder, who need not have labelled anything yet.
        blind : bool
            Whether the other tracks and all predictions are hidden from the coder until done.

        Raises
        ------
        InputError
            If there is no such demonstration, or the author has no name or is a model.
        """
        return self._assignments.assign(demonstration, author, blind)

    def unassign(self, demonstration: str, author: str) -> None:
        """Take an assignment back; no label changes.

        Raises
        ------
        InputError
            If the demonstration is not assigned to the author.
        """
        self._assignments.unassign(demonstration, author)

    def set_done(self, demonstration: str, author: str, done: bool = True) -> Assignment:
        """Mark an assignment as done, or open it again; both are kept for ever.

        Raises
        ------
        InputError
            If the demonstration is not assigned to the author.
        """
        return self._assignments.set_done(demonstration, author, done)

    def assignments(self, author: str | None = None) -> tuple[Assignment, ...]:
        """The assignments that stand, of everybody or of one coder, the first one first."""
        return self._assignments.all(author)

    def is_blind(self, demonstration: str, author: str) -> bool:
        """Whether the other tracks and all predictions are to be hidden from a coder now."""
        return self._assignments.is_blind(demonstration, author)

    def assignment_events(self) -> tuple[AssignmentEvent, ...]:
        """Everything that ever happened to assignments, the first event first."""
        return self._assignments.events()

    def replay_assignments(self, events: Iterable[AssignmentEvent]) -> None:
        """Let events happen again as they did, with their times, all or nothing.

        Parameters
        ----------
        events : iterable of AssignmentEvent
            The first one first, as from :meth:`assignment_events`.

        Raises
        ------
        InputError
            If a demonstration is not here, or an event befalls what was never assigned.
        """
        self._assignments.replay(events)
