"""What people decide: who labels what, what is handed on, who is right where tracks differ."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Final, Literal, get_args

__all__ = [
    "ASSIGNMENT_KINDS",
    "VERDICT_KINDS",
    "Assignment",
    "AssignmentEvent",
    "AssignmentKind",
    "Note",
    "StoredVerdict",
    "Verdict",
    "VerdictKind",
    "changed_labels",
    "left_to_label",
]

AssignmentKind = Literal["blind", "open", "done", "reopened", "removed"]
VerdictKind = Literal["human", "model", "ambiguous", "withdrawn"]

#: Every kind of event of an assignment.
ASSIGNMENT_KINDS: Final[tuple[AssignmentKind, ...]] = get_args(AssignmentKind)

#: Every kind of verdict.
VERDICT_KINDS: Final[tuple[VerdictKind, ...]] = get_args(VerdictKind)


@dataclass(frozen=True, slots=True)
class Assignment:
    """A demonstration that a coder is to label.

    Parameters
    ----------
    demonstration, author : str
        Its id, and the coder.
    blind : bool
        Whether the other tracks and all predictions are hidden from the coder until it is done.
    assigned : datetime
        Since when, in UTC.
    done : datetime, optional
        When it was marked as done, in UTC; None while it is not.
    """

    demonstration: str
    author: str
    blind: bool
    assigned: datetime
    done: datetime | None = None

    @property
    def hides(self) -> bool:
        """Whether the other tracks and all predictions are hidden from the coder now."""
        return self.blind and self.done is None


def left_to_label(labelled: float, assignment: Assignment | None) -> bool:
    """Whether a coder still has to label a demonstration.

    Parameters
    ----------
    labelled : float
        How much of it the coder has labelled; any measure of it.
    assignment : Assignment or None
        The coder's own.

    Returns
    -------
    bool
        Whether it is not begun, or assigned, and not marked as done.
    """
    if assignment is None:
        return not labelled
    return assignment.done is None


@dataclass(frozen=True, slots=True)
class AssignmentEvent:
    """Something that happened to an assignment, kept for ever.

    Parameters
    ----------
    demonstration, author : str
        As of :class:`Assignment`.
    kind : "blind", "open", "done", "reopened" or "removed"
        Assigned blind or openly, or made so; done, or not done after all; taken back.
    time : datetime
        When, in UTC.
    """

    demonstration: str
    author: str
    kind: AssignmentKind
    time: datetime


@dataclass(frozen=True, slots=True)
class Note:
    """What a coder hands on about a demonstration, kept for ever.

    Parameters
    ----------
    demonstration, author : str
        Its id, and the coder.
    text : str
        One line: blanks at its ends go, and line breaks become blanks. ``""`` says that what the
        coder wrote before counts no more.
    time : datetime
        When, with its zone.
    """

    demonstration: str
    author: str
    text: str
    time: datetime

    def __post_init__(self) -> None:
        object.__setattr__(self, "text", " ".join(self.text.split()))


@dataclass(frozen=True, slots=True)
class Verdict:
    """What somebody says about a place where a coder's labels and a prediction differ.

    Parameters
    ----------
    demonstration : str
        Its id.
    author : str
        Who judged.
    coder : str
        Whose labels were judged.
    start, end : float
        The place, in seconds, ``start < end``.
    human, predicted : str or None
        The action that coder and model see there; None where it is unlabelled.
    verdict : "human", "model", "ambiguous" or "withdrawn"
        Who is right; or that it cannot be told; or that what was said before counts no more.
    run : int, optional
        The run that predicted, where there is one.
    time : datetime, optional
        When, in UTC; None for what is said now.
    """

    demonstration: str
    author: str
    coder: str
    start: float
    end: float
    human: str | None
    predicted: str | None
    verdict: VerdictKind
    run: int | None = None
    time: datetime | None = None

    @property
    def place(self) -> tuple[str, str, float, float, str | None, str | None]:
        """What the verdict is on: the latest one on the same place counts."""
        return (
            self.demonstration,
            self.coder,
            self.start,
            self.end,
            self.human,
            self.predicted,
        )


@dataclass(frozen=True, slots=True)
class StoredVerdict(Verdict):
    """A verdict as it is kept for ever.

    Parameters
    ----------
    id : int
        Grows with every verdict of the project.
    """

    id: int = 0


def changed_labels(verdict: Verdict) -> bool:
    """Whether a verdict changed the labels: while it counts, the difference is gone.

    Where it is there still, the edit was undone, and the difference is open again.
    """
    return verdict.verdict == "model" and verdict.author == verdict.coder
