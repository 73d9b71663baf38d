"""What a project tells about its contents and what people decided: frozen values."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from datetime import datetime, timezone
from functools import lru_cache
from typing import Any, Final, Literal, get_args

from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.labels import Interval, Segment, Segments, Track
from forcelab.vocabulary import Vocabulary

AssignmentKind = Literal["blind", "open", "done", "reopened", "removed"]
VerdictKind = Literal["human", "model", "ambiguous", "withdrawn"]

#: Every kind of event of an assignment.
ASSIGNMENT_KINDS: Final[tuple[AssignmentKind, ...]] = get_args(AssignmentKind)

#: Every kind of verdict.
VERDICT_KINDS: Final[tuple[VerdictKind, ...]] = get_args(VerdictKind)


@dataclass(frozen=True, slots=True)
class Assignment:
    """A demonstration that a coder is to label.

    Attributes
    ----------
    demonstration, author : str
        Its id, and the coder.
    blind : bool
        Whether the other tracks and all predictions are hidden until it is done.
    assigned : datetime
        Since when, in UTC.
    done : datetime or None
        When it was marked as done, in UTC.
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
    """Whether a demonstration is not begun by a coder, or assigned, and not marked as done.

    `labelled` is how much of it the coder has labelled, in any measure.
    """
    return not labelled if assignment is None else assignment.done is None


@dataclass(frozen=True, slots=True)
class AssignmentEvent:
    """Something that happened to an assignment, kept for ever.

    Attributes
    ----------
    demonstration, author : str
        Id of the demonstration, and the coder.
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
        One line or several: blanks at their ends go. ``""`` says that what the coder wrote before
        counts no more.
    time : datetime
        When, with its zone.
    """

    demonstration: str
    author: str
    text: str
    time: datetime

    def __post_init__(self) -> None:
        lines = (" ".join(line.split()) for line in self.text.splitlines())
        object.__setattr__(self, "text", "\n".join(lines).strip())


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict(Interval):
    """What somebody says about an interval where a coder's labels and a prediction differ.

    Parameters
    ----------
    author : str
        Who judged.
    coder : str
        Whose labels were judged.
    verdict : "human", "model", "ambiguous" or "withdrawn"
        Who is right; or that it cannot be told; or that what was said before counts no more.
    run : int, optional
        The run that predicted, where there is one.
    time : datetime, optional
        When, in UTC; None for what is said now.
    """

    author: str
    coder: str
    verdict: VerdictKind
    run: int | None = None
    time: datetime | None = None

    @property
    def place(self) -> tuple[str, str, float, float, str | None, str | None]:
        """What the verdict is on: the latest one on the same place counts."""
        return self.demonstration, self.coder, self.start, self.end, self.human, self.predicted


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredVerdict(Verdict):
    """A verdict as it is kept for ever.

    Attributes
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

    Attributes
    ----------
    name : str
        Unique in the project.
    kind : "coder" or "model"
        Fixed for ever by the author's first edit.
    """

    name: str
    kind: AuthorKind


@dataclass(frozen=True, slots=True)
class NewDemonstration:
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
        Keys and looks of the actions that the task does not have yet, where these are free. An
        action of another task looks as it does there.
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
class LabelImport:
    """An author's labels from a file, for a demonstration that is in the project.

    Parameters
    ----------
    demonstration : str
        Its id.
    track : Track
        What is stored.
    before : tuple of Segment
        What the author's track holds until then.
    what : str
        The line of history.
    """

    demonstration: str
    track: Track
    before: Segments
    what: str


@dataclass(frozen=True, slots=True)
class AddResult:
    """What became of a demonstration that was added.

    Attributes
    ----------
    id, name : str
        Those that it has in the project.
    status : "new", "updated" or "unchanged"
        Whether the project has more than before.
    remarks : tuple of str
        A sentence on each thing that is not as the file says.
    """

    id: str
    name: str
    status: Literal["new", "updated", "unchanged"]
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class DemonstrationInfo:
    """A demonstration's row in a list; telling it opens no array.

    Attributes
    ----------
    id, name, task : str
        As in the project; the task may be empty.
    samples : int
        How many it has.
    channels : tuple of Channel
        Names and units.
    rate : float
        Of the uniform grid, in Hz.
    duration : float
        In seconds.
    labelled : mapping of str to float
        For every author with a track, in order of first appearance: seconds covered by a segment.
    videos : tuple of str
        Their names, the main one first.
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
    videos: tuple[str, ...]
    source: str
    edited: Mapping[str, int] = field(default_factory=dict)

    @property
    def authors(self) -> tuple[str, ...]:
        """Every author with a track."""
        return tuple(self.labelled)

    @property
    def has_video(self) -> bool:
        """Whether the project holds a video of it."""
        return bool(self.videos)


@dataclass(frozen=True, slots=True)
class Edit:
    """One change of one track, kept for ever.

    Attributes
    ----------
    id : int
        Grows with every edit of the project.
    demonstration : str
        Its id.
    author : str
        Whose track it is, who made the edit.
    kind : "paint", "import", "predict", "undo" or "redo"
        What made it.
    time : datetime
        When, in UTC.
    what : str
        A line of history for people, such as ``"grab 1.25-1.73 s moved to 1.244"``.
    position : int
        Where in the track the segments were replaced.
    removed, inserted : tuple of Segment
        What was there before, and what came in its place.
    reverts : int or None
        Of undo and redo: the edit that was taken back.
    proposed_by : str or None
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

    Attributes
    ----------
    proposer : str
        The model whose prediction was accepted.
    changed : bool
        Whether the segment was moved, split or merged by hand since.
    """

    proposer: str
    changed: bool = False


def check_length(text: str, noun: str) -> None:
    """Refuse a name or a task that is longer than any file name, and than any list can show."""
    if len(text) > LONGEST_NAME:
        raise InputError(
            f"The {noun} '{text[:30]}...' is longer than {LONGEST_NAME} characters; choose a "
            f"shorter one."
        )


def utc_now() -> datetime:
    """The time now, in UTC."""
    return datetime.now(timezone.utc)


def segments_to_json(segments: Segments) -> list[list[float | str]]:
    """Segments as a JSON list of ``[start, end, action]``; floats keep their exact value."""
    return [[float(s.start), float(s.end), s.action] for s in segments]


def segments_to_text(segments: Segments) -> str:
    """Segments as an edit stores them."""
    return json.dumps(segments_to_json(segments), ensure_ascii=False)


@lru_cache(maxsize=4)  # the latest edit is read for its list and for the time it was stored at
def segments_from_text(text: str) -> Segments:
    """The inverse of :func:`segments_to_text`."""
    return tuple(Segment(start, end, action) for start, end, action in json.loads(text))
