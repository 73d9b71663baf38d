"""A journal's records, sorted by what they are about in one passage through it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.journal import Kind, Record, json_of
from forcelab.capture.reader import PLUGGED, UNPLUGGED
from forcelab.capture.samples import Samples

__all__ = ["Recorded", "Sorted", "sorted_records"]


@dataclass(eq=False)
class Recorded:
    """What was recorded of one device.

    Parameters
    ----------
    samples : Samples
    breaks : list of int
        Samples before which it was plugged in again.
    away : list of (float, float)
        From when to when (host's clock, s) it was unplugged.
    """

    samples: Samples
    breaks: list[int] = field(default_factory=list)
    away: list[tuple[float, float]] = field(default_factory=list)
    _since: float | None = None

    def event(self, what: object, at: float) -> None:
        """It was unplugged or plugged in again."""
        if what == UNPLUGGED and self._since is None:
            self._since = at
        elif what == PLUGGED:
            self.breaks.append(len(self.samples))
            if self._since is not None:
                self.away.append((self._since, at))
            self._since = None

    def end(self) -> None:
        """There are no more records."""
        if self._since is not None:
            self.away.append((self._since, np.inf))
            self._since = None


@dataclass(eq=False)
class Sorted:
    """All that a journal holds.

    Parameters
    ----------
    devices : list of Recorded
    frames : list of ndarray, shape (m, 3)
        Of each camera: arrived, the camera's own stamp, and the file's own stamp of each frame (s).
    marks : list of dict
        Keys of actions that went down or up.
    """

    devices: list[Recorded]
    frames: list[NDArray[np.float64]]
    marks: list[dict[str, Any]]


def sorted_records(records: Iterable[Record], columns: Sequence[int], cameras: int) -> Sorted:
    """Sort records.

    Parameters
    ----------
    records : iterable of Record
        In their order; gone through once.
    columns : sequence of int
        Channels of each device.
    cameras : int
        How many there are.

    Raises
    ------
    InputError
        If a record is not what it says.
    """
    devices = [Recorded(Samples(number)) for number in columns]
    rows: list[list[float]] = [[] for _ in range(cameras)]
    marks = []
    for record in records:
        if record.kind == Kind.BLOCK and record.device < len(devices):
            devices[record.device].samples.add(record.payload)
        elif record.kind == Kind.EVENT and record.device < len(devices):
            event = json_of(record)
            devices[record.device].event(event.get("what"), float(event.get("at", np.nan)))
        elif record.kind == Kind.MARK:
            marks.append(json_of(record))
        elif record.kind == Kind.FRAME and record.device < cameras:
            for stamps in json_of(record)["frames"]:
                rows[record.device] += [np.nan if x is None else float(x) for x in stamps]
    for device in devices:
        device.end()
    return Sorted(devices, [np.array(row).reshape(-1, 3) for row in rows], marks)
