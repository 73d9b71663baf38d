"""What every format reads: recordings; and how they are to be read."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.labels import Track
from forcelab.project import Note


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """How a foreign file is to be understood where it does not say so itself.

    Parameters
    ----------
    task : str, optional
        Task of the demonstrations read; by default they have none, and importing them once more
        changes no task.
    author : str
        Author of the labels found in the file, where the file names none.
    rate : float, optional
        Samples a second: the stamps of a file that has none, the rate of the uniform grid for
        features of one that has.
    time : str, optional
        Name or 1-based number of the column that holds the stamps; found by itself by default.
    label : str, optional
        Name or 1-based number of the column that holds the labels; found by itself by default.
    counter : str, optional
        Name or 1-based number of the column in which a device counts its samples, `rate` of them a
        second, in place of stamps; one that is plain to see is found by itself.
    leave_out : tuple of str
        Names or 1-based numbers of columns that become no channels; of a bag fields and topics.
    signals : tuple of str
        Names or 1-based numbers of columns that are channels, whatever they look like.
    units : tuple of (str, str)
        Names of channels, each with its unit, of several of a name the last one; where the file
        states one, that counts.
    videos : bool
        Whether videos that lie beside a recording are attached to it: the one that is called as
        it is, and further ones by what follows its name, as ``pull.left.mp4`` is of ``pull.csv``.
    strict : bool
        Refuse what would otherwise be repaired and reported.
    jitter : float
        Seconds by which stamps of a table may be moved so that they increase; 0 for none.
    format : str, optional
        Short name of the files' format, where their content is not to decide it.
    calibration : Path, optional
        A calibration file, for formats that hold counts of a device.
    episodes : tuple of int
        The episodes of a dataset that are read, by number; all by default.
    unpack : Path, optional
        Folder for videos that are packed inside a file, or written of its pictures, there as long
        as they are needed; without one they are left out.

    Raises
    ------
    InputError
        If the rate is not positive, or the jitter below zero.

    Examples
    --------
    >>> options = forcelab.ReadOptions(task="pull", author="Ada", label="label")
    >>> forcelab.read("pull.csv", options)[0].tracks[0].author
    'Ada'
    """

    task: str | None = None
    author: str = "coder"
    rate: float | None = None
    time: str | None = None
    label: str | None = None
    counter: str | None = None
    leave_out: tuple[str, ...] = ()
    signals: tuple[str, ...] = ()
    units: tuple[tuple[str, str], ...] = ()
    videos: bool = False
    strict: bool = False
    jitter: float = 0.0
    format: str | None = None
    calibration: Path | None = None
    episodes: tuple[int, ...] = ()
    unpack: Path | None = None

    def __post_init__(self) -> None:
        if self.rate is not None and not 0 < self.rate < math.inf:
            raise InputError(f"The rate must be positive, not {self.rate} Hz.")
        if not 0 <= self.jitter < math.inf:
            raise InputError(f"The jitter must be 0 s or more, not {self.jitter:g} s.")


#: More episodes than any dataset has.
_MOST_EPISODES = 1_000_000


def parse_episodes(text: str) -> tuple[int, ...]:
    """Numbers of episodes as people write them: ``"0-9, 12"``; none of an empty text.

    Raises
    ------
    InputError
        If it says anything else.
    """
    numbers: list[int] = []
    for part in filter(None, map(str.strip, text.split(","))):
        match = re.fullmatch(r"(\d{1,6})(?:-(\d{1,6}))?", part, re.ASCII)
        first, last = (int(match[1]), int(match[2] or match[1])) if match else (0, -1)
        if last < first:
            raise InputError(f"'{part}' names no episodes; write such as 0-9,12.")
        numbers.extend(range(first, last + 1))
        if len(numbers) > _MOST_EPISODES:
            raise InputError(f"'{text[:30]}' names more than {_MOST_EPISODES:,} episodes.")
    return tuple(numbers)


@dataclass(frozen=True, slots=True)
class Recording:
    """A demonstration as read from a file, with the labels that came with it.

    Parameters
    ----------
    demonstration : Demonstration
        What was recorded.
    tracks : tuple of Track
        One per author; empty where the file holds no labels.
    remarks : tuple of str
        One sentence for each thing that was dropped, repaired or is worth a look.
    source : str
        Where the demonstration came from before it was in the file; empty where nobody knows.
    truth : mapping, optional
        What a simulation knows of it.
    statistics : mapping of str to int
        What a format counted while it read, such as ``"missing_samples"``.
    not_imported : str
        A sentence on what of the file is never imported; shown where the file brings anything new.
    notes : tuple of Note
        What coders wrote about it.
    """

    demonstration: Demonstration
    tracks: tuple[Track, ...] = ()
    remarks: tuple[str, ...] = ()
    source: str = ""
    truth: Mapping[str, Any] | None = None
    statistics: Mapping[str, int] = field(default_factory=dict)
    not_imported: str = ""
    notes: tuple[Note, ...] = ()


#: Bytes that are counted as one: people think of files in megabytes.
_UNIT = 10**6


def reading_progress(path: Path, done: int, size: int) -> Progress:
    """How many of about so many bytes of a file have been read, in megabytes."""
    total = size // _UNIT
    return Progress(min(done // _UNIT, total), total, f"reading {path.name}")


def give_units(recording: Recording, units: Mapping[str, str]) -> Recording:
    """The recording with units of channels that have none; what is not used becomes a remark."""
    channels = recording.demonstration.channels
    names = {channel.name for channel in channels}
    remarks = [
        f"No channel is called '{name}', so that its unit was not used."
        for name in units
        if name not in names
    ]
    remarks += [
        f"'{c.name}' is in {c.unit}, as the file states, not in {units[c.name]}."
        for c in channels
        if c.unit and units.get(c.name, c.unit) != c.unit
    ]
    channels = tuple(replace(c, unit=c.unit or units.get(c.name, "")) for c in channels)
    demonstration = replace(recording.demonstration, channels=channels)
    return replace(recording, demonstration=demonstration, remarks=(*recording.remarks, *remarks))


Use = Literal["signal", "times", "counter", "labels", "video", "left out"]
#: What any column of a table can be made, besides what it is taken for.
ANY_USE: tuple[Use, ...] = ("signal", "times", "counter", "labels", "left out")


@dataclass(frozen=True, slots=True)
class ColumnUse:
    name: str
    unit: str
    use: Use  #: a counter is no signal; where there are no times it stands in for them
    cells: tuple[str, ...]  #: the first ones, as they stand in the file
    choices: tuple[Use, ...] = ANY_USE  #: what it can be made
    size: str = ""  #: rows and columns of what is an array
