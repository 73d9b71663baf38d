"""What a project tells about its contents: frozen values, detached from the store."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timezone
from typing import Any, Literal

from forcelab.demonstration import Channel
from forcelab.labels import Segment, Segments

__all__ = [
    "Added",
    "Author",
    "AuthorKind",
    "DemonstrationInfo",
    "Edit",
    "EditKind",
    "Recogniser",
    "Run",
    "segments_from_json",
    "segments_to_json",
    "utc_now",
]

AuthorKind = Literal["coder", "model"]
EditKind = Literal["paint", "import", "predict", "undo", "redo"]


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


@dataclass(frozen=True, slots=True)
class Recogniser:
    """A trained recogniser's record; its file is opaque to the store.

    Parameters
    ----------
    id : str
        32 hex digits of the SHA-256 of its file.
    name : str
        For people; need not be unique.
    time : datetime
        When it was added, in UTC.
    settings : dict
        Everything that training was told, as JSON has it.
    seed : int or None
        The random seed, if there was one.
    demonstrations : tuple of str
        Ids of what it was trained on.
    versions : dict of str to str
        Of the program and the libraries.
    """

    id: str
    name: str
    time: datetime
    settings: dict[str, Any]
    seed: int | None
    demonstrations: tuple[str, ...]
    versions: dict[str, str]


@dataclass(frozen=True, slots=True)
class Run:
    """An evaluation or another computation, with everything needed to repeat it.

    Parameters
    ----------
    id : int
        Number in the project.
    kind : str
        Such as ``"evaluate"``.
    time : datetime
        When it was added, in UTC.
    settings, seed, demonstrations, versions
        As of :class:`Recogniser`.
    result : dict
        What came out, as JSON has it.
    """

    id: int
    kind: str
    time: datetime
    settings: dict[str, Any]
    seed: int | None
    demonstrations: tuple[str, ...]
    versions: dict[str, str]
    result: dict[str, Any]


def utc_now() -> datetime:
    """The time now, in UTC."""
    return datetime.now(timezone.utc)


def segments_to_json(segments: Segments) -> str:
    """Segments as JSON ``[[start, end, action], ...]``; floats keep their exact value."""
    rows = [[float(s.start), float(s.end), s.action] for s in segments]
    return json.dumps(rows, ensure_ascii=False)


def segments_from_json(text: str) -> Segments:
    """The inverse of :func:`segments_to_json`."""
    return tuple(Segment(start, end, action) for start, end, action in json.loads(text))
