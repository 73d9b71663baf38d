"""What a project tells about its contents: frozen values, detached from the store."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from datetime import datetime, timezone
from typing import Any, Final, Literal, get_args

from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.labels import Segment, Segments, Track
from forcelab.project.decisions import Note
from forcelab.vocabulary import Vocabulary

__all__ = [
    "EDIT_KINDS",
    "LONGEST_NAME",
    "Added",
    "Author",
    "AuthorKind",
    "DemonstrationInfo",
    "Edit",
    "EditKind",
    "Incoming",
    "Keepable",
    "Origin",
    "check_length",
    "segments_from_json",
    "segments_to_json",
    "utc_now",
]

AuthorKind = Literal["coder", "model"]
EditKind = Literal["paint", "import", "predict", "undo", "redo"]
Keepable = Literal["task", "grid_rate"]

#: Characters of a demonstration's name and of a task.
LONGEST_NAME: Final = 1000
#: Every kind of edit.
EDIT_KINDS: Final[tuple[EditKind, ...]] = get_args(EditKind)


@dataclass(frozen=True, slots=True)
class Author:
    """Who made a track.

    Parameters
    ----------
    name : str
        Unique in the project.
    kind : "coder" or "model"
        A person, or a recogniser's predictions; fixed for ever by the author's first edit.
    """

    name: str
    kind: AuthorKind


@dataclass(frozen=True, slots=True)
class Incoming:
    """A demonstration to add to a project.

    Parameters
    ----------
    demonstration : Demonstration
        Its arrays and its video are copied into the project.
    tracks : tuple of Track
        Coders' labels that came with it, at most one track an author.
    source : str
        Where it was read from, for people.
    labels_from : str
        What the tracks were read from, where that is not the source.
    keep : collection of "task" or "grid_rate"
        What stays as it is where the demonstration is in the project already, because nobody said
        anything about it.
    vocabulary : Vocabulary
        How the actions of the task look, where the task does not have them yet and look and key
        are free.
    truth : mapping, optional
        What no recording tells but whoever simulated it knows, such as the true times of the
        video's frames; anything that JSON can hold. It is kept aside, and nothing is trained or
        scored on it.
    notes : tuple of Note
        What coders wrote about it; those that the project has not got are added to its own.
    """

    demonstration: Demonstration
    tracks: tuple[Track, ...] = ()
    source: str = ""
    labels_from: str = ""
    keep: Collection[Keepable] = ()
    vocabulary: Vocabulary = field(default_factory=Vocabulary)
    truth: Mapping[str, Any] | None = None
    notes: tuple[Note, ...] = ()


@dataclass(frozen=True, slots=True)
class Added:
    """What became of a demonstration that was added.

    Parameters
    ----------
    id : str
        The demonstration's id.
    name : str
        The name it has in the project.
    status : "new", "updated" or "unchanged"
        Whether the project has more than before.
    remarks : tuple of str
        One sentence for each thing that is not as the file says.
    """

    id: str
    name: str
    status: Literal["new", "updated", "unchanged"]
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class DemonstrationInfo:
    """A demonstration's row in a list; telling it opens no array.

    Parameters
    ----------
    id, name, task : str
        As of :class:`~forcelab.demonstration.Demonstration`.
    samples : int
        Number of samples n.
    channels : tuple of Channel
        Names and units of the columns of signals.
    rate : float
        Rate of the uniform grid in Hz.
    duration : float
        Length in seconds.
    labelled : mapping of str to float
        For every author with a track, in order of first appearance: seconds covered by a segment.
    has_video : bool
        Whether the project holds its video.
    source : str
        Where it was read from, as told when it was added.
    edited : mapping of str to int
        For every author with a track the id of its last edit, which grows with each edit of the
        project; 0 where there was none.
    """

    id: str
    name: str
    task: str
    samples: int
    channels: tuple[Channel, ...]
    rate: float
    duration: float
    labelled: Mapping[str, float]
    has_video: bool
    source: str
    edited: Mapping[str, int] = field(default_factory=dict)

    @property
    def authors(self) -> tuple[str, ...]:
        """Every author with a track."""
        return tuple(self.labelled)


@dataclass(frozen=True, slots=True)
class Edit:
    """One change of one track, kept for ever.

    Parameters
    ----------
    id : int
        Grows with every edit of the project.
    demonstration, author : str
        Whose track over what; the author is who made the edit.
    kind : "paint", "import", "predict", "undo" or "redo"
        How it came about.
    time : datetime
        When, in UTC.
    what : str
        A line of history for people, such as ``"grab 1.25-1.73 s moved to 1.244"``.
    position : int
        Where in the track the segments were replaced.
    removed, inserted : tuple of Segment
        What was there before, and what came in its place.
    reverts : int, optional
        For undo and redo: the edit that was taken back.
    proposed_by : str, optional
        The model whose prediction the author accepted with this edit; None for what was painted by
        hand, and for undo and redo.
    """

    id: int
    demonstration: str
    author: str
    kind: EditKind
    time: datetime
    what: str
    position: int
    removed: Segments
    inserted: Segments
    reverts: int | None = None
    proposed_by: str | None = None


@dataclass(frozen=True, slots=True)
class Origin:
    """Where a coder's segment comes from that a model proposed.

    Parameters
    ----------
    proposer : str
        The model whose prediction was accepted.
    changed : bool
        Whether the segment was moved, split or merged by hand since.
    """

    proposer: str
    changed: bool = False


def check_length(text: str, what: str) -> None:
    """Refuse a name or a task that is longer than any file name, and than any list can show.

    Raises
    ------
    InputError
        If it is.
    """
    if len(text) > LONGEST_NAME:
        raise InputError(
            f"The {what} '{text[:30]}...' is longer than {LONGEST_NAME} characters; choose a "
            f"shorter one."
        )


def utc_now() -> datetime:
    """The time now, in UTC."""
    return datetime.now(timezone.utc)


def segments_to_json(segments: Segments) -> list[list[float | str]]:
    """Segments as a JSON list of ``[start, end, action]``; floats keep their exact value."""
    return [[float(s.start), float(s.end), s.action] for s in segments]


def segments_from_json(rows: Iterable[tuple[float, float, str]]) -> Segments:
    """The inverse of :func:`segments_to_json`."""
    return tuple(Segment(start, end, action) for start, end, action in rows)
