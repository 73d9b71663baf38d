"""Label files of other programs: a module each, told apart by content."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Final, Literal, Protocol, cast

from forcelab.errors import InputError
from forcelab.formats import file_head, naming_file
from forcelab.formats.signatures import announced_kind, seems_to_be
from forcelab.labels import Track, check_name

__all__ = [
    "LABEL_FORMATS",
    "LabelFormat",
    "LabelOptions",
    "LabelSet",
    "own_stem",
    "read_label_file",
]

#: What the names of label files end in, after that of their recording.
_ENDINGS: Final = (".labels", "_labels", ".segments")


@dataclass(frozen=True, slots=True)
class LabelSet:
    """The labels of one demonstration, as a file of another program has them.

    Parameters
    ----------
    name : str
        What the file calls the demonstration: the id of an observation, else its media file or
        itself, without suffix.
    tracks : tuple of Track
        One per author. Times are seconds of the force clock where the file tells them so; else of
        the clock of its media, which mostly starts when they do.
    duration : float, optional
        Length of the demonstration or its media in seconds, if the file tells it.
    remarks : tuple of str
        One sentence for each thing that was left out or is worth a look.
    media : mapping of str to float
        By the name of each media file that the labels were made on, its time in seconds when that
        of the labels is 0; empty where times are of the force clock.
    """

    name: str
    tracks: tuple[Track, ...]
    duration: float | None = None
    remarks: tuple[str, ...] = ()
    media: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class LabelOptions:
    """How a label file is to be understood where it does not say so itself.

    Parameters
    ----------
    author : str
        Author of the labels, where the file names none.
    tiers : "authors" or "actions"
        Whether each tier is an author, whose annotations are the actions; or each is an action, so
        that all of them together are the author's track.
    offset : float
        Seconds that are added to all times.
    """

    author: str = "coder"
    tiers: Literal["authors", "actions"] = "authors"
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class LabelFormat:
    """A format that labels can be read from."""

    name: str  #: unique
    description: str  #: a few words that may follow "can read"
    module: str  #: reads it; imported when it is needed
    #: first bytes that make it worth importing the module; empty: any that do not announce another
    #: kind of file
    starts: tuple[bytes, ...] = ()


class _Reader(Protocol):
    """The interface of a label format's module."""

    def sniff_labels(self, path: Path, head: bytes) -> bool:
        """Whether the file, whose first 64 KiB are `head`, is of this format."""

    def read_labels(self, path: Path, options: LabelOptions) -> list[LabelSet]:
        """Read the whole file, without the offset; errors are :class:`InputError`."""


#: In the order in which they are tried: any text might be a table.
LABEL_FORMATS: Final[tuple[LabelFormat, ...]] = (
    LabelFormat(
        name="table",
        description="tables of start, end and action (CSV, TSV, Audacity)",
        module="forcelab.formats.label_tables",
    ),
)


def read_label_file(
    path: str | os.PathLike[str], options: LabelOptions | None = None
) -> list[LabelSet]:
    """Read the labels in a file of any label format.

    Parameters
    ----------
    path : path-like
        The file; its format is told by its content.
    options : LabelOptions, optional
        How the file is to be understood where it does not say so itself; its offset is not added
        here, as it is on the force clock.

    Returns
    -------
    list of LabelSet
        One per demonstration in the file; at least one.

    Raises
    ------
    InputError
        If the file cannot be read. The sentence is one line and names the file.
    """
    path, options = Path(path), options or LabelOptions()
    with naming_file(path):
        sets = _reader(path).read_labels(path, options)
        if not any(track.segments for labels in sets for track in labels.tracks):
            raise InputError(f"'{path}' holds no label; there is nothing to import.")
        for labels in sets:
            _check(path, labels)
    return sets


def own_stem(path: str | os.PathLike[str]) -> str:
    """A file's name without suffix, and without what marks it as a label file."""
    stem = Path(path).stem
    for ending in _ENDINGS:
        if stem.lower().endswith(ending) and len(stem) > len(ending):
            return stem[: -len(ending)]
    return stem


def _reader(path: Path) -> _Reader:
    """The module that reads a file; the error says what the file seems to be."""
    head = file_head(path)
    announced = announced_kind(head)
    for format_ in LABEL_FORMATS:
        if head.startswith(format_.starts) if format_.starts else not announced:
            module = cast(_Reader, import_module(format_.module))
            if module.sniff_labels(path, head):
                return module
    readable = "; ".join(format_.description for format_ in LABEL_FORMATS)
    raise InputError(
        f"'{path}' looks like {seems_to_be(head)} without labels; what can be read: {readable}."
    )


def _check(path: Path, labels: LabelSet) -> None:
    """Refuse what cannot be stored: two tracks of one author, names that are none."""
    authors = [track.author for track in labels.tracks]
    if len(set(authors)) < len(authors):
        twice = next(author for author in authors if authors.count(author) > 1)
        raise InputError(f"'{path}' has two tracks of '{twice}' on '{labels.name}'; rename one.")
    for track in labels.tracks:
        for action in track.actions:
            check_name(action)
        for name in (track.author, *track.actions):
            if not name.isascii() and name.encode("utf-8", "ignore").decode() != name:
                raise InputError(f"'{path}': the name {name!a} is not valid Unicode; rename it.")
