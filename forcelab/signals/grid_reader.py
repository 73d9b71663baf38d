"""One channel of a demonstration on its uniform grid, read piece by piece.

The same samples as :func:`forcelab.signals.grid.on_grid` gives at the recording's own rate, but
only where they are asked for, so that a view of a long recording costs what it shows. The whole
channel is looked through for glitches only once a number comes up that may be one.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from forcelab.arrays import Flags, Real
from forcelab.demonstration import GAP_PERIODS, Channel, Demonstration
from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.sample_runs import marked_runs
from forcelab.signals.channels import channel_map
from forcelab.signals.conditioning import GLITCH
from forcelab.signals.grid import MAX_SAMPLES, UNIFORM, measured, readings

#: Stamps or samples looked at in one step.
BLOCK = 1 << 19


@dataclass(frozen=True, eq=False, slots=True)
class GridReader:
    """A channel on a uniform grid."""

    demonstration: Demonstration
    channel: str  # a recorded channel, or a recognition channel such as ``"tangential 1"``
    #: The recorded columns it is made of: two for a tangential magnitude, one for any other.
    columns: tuple[int, ...]
    #: Whether the samples are the grid; otherwise straight lines between them are read.
    uniform: bool
    rate: float  # samples a second
    count: int  # how many samples the grid has
    _glitches: dict[int, NDArray[np.int64]] = field(default_factory=dict, init=False, repr=False)

    def place(self, time: float) -> float:
        """Where on the grid a time lies, in samples from the first."""
        return (time - self.demonstration.start) * self.rate

    def time(self, place: float) -> float:
        """When a place on the grid is, in seconds."""
        return self.demonstration.start + place / self.rate

    def read(self, first: int, last: int) -> tuple[Real, Flags]:
        """Read the samples ``first .. last - 1``; beyond the ends the end values hold.

        Gives `values` (last - first,): missing samples are bridged by straight lines, in each
        recorded column on its own; `known` (last - first,): false in gaps of the stamps, in long
        runs of missing samples and beyond the ends.
        """
        inner = max(0, min(first, self.count - 1)), max(1, min(last, self.count))
        parts, known = [], np.ones(inner[1] - inner[0], dtype=bool)
        for column in self.columns:
            read = self._recorded if self.uniform else self._between
            part, is_measured = read(column, *inner)
            parts.append(part)
            known &= is_measured
        values = parts[0] if len(parts) == 1 else np.hypot(parts[0], parts[1])
        before, after = max(0, inner[0] - first), max(0, last - inner[1])
        if before or after:
            values = np.pad(values, (before, after), mode="edge")[: last - first]
            known = np.pad(known, (before, after))[: last - first]
        return values, known

    def _recorded(self, column: int, first: int, last: int) -> tuple[Real, Flags]:
        """Recorded samples as they are, bridged from the nearest ones even outside the piece."""
        values = self.demonstration.signals[first:last, column].copy()
        is_measured = self._measured(column, first, values)
        if is_measured.all():
            return values, is_measured
        places, heights = np.flatnonzero(is_measured) + first, values[is_measured]
        before = after = 0  # samples missing beyond the piece, of the runs it begins and ends in
        # Only a piece that begins or ends in a run needs to look for the run's other side.
        if not is_measured[0]:
            left = self._finite(column, first, -1)
            before = first if left is None else first - left - 1
            if left is not None:
                places = np.append(left, places)
                heights = np.append(self.demonstration.signals[left, column], heights)
        if not is_measured[-1]:
            right = self._finite(column, last, 1)
            after = (len(self.demonstration.signals) if right is None else right) - last
            if right is not None:
                places = np.append(places, right)
                heights = np.append(heights, self.demonstration.signals[right, column])
        numbers = np.arange(first, last)
        bridged = np.interp(numbers, places, heights) if places.size else np.zeros(last - first)
        return bridged, ~_long_runs(~is_measured, before, after)

    def _measured(self, column: int, first: int, values: Real) -> Flags:
        """Which of the recorded samples from `first` on a sensor can have read."""
        if values.min() >= -GLITCH / 2 and values.max() <= GLITCH / 2:
            # So small that they need not be compared with the channel's usual ones.
            return np.ones(len(values), dtype=bool)
        is_measured = measured(values)
        if np.abs(values, where=is_measured, out=np.zeros(len(values))).max() > GLITCH / 2:
            glitches = self.glitches(column)
            low, high = np.searchsorted(glitches, (first, first + len(values)))
            is_measured[glitches[low:high] - first] = False
        return is_measured

    def glitches(self, column: int) -> NDArray[np.int64]:
        """Which samples of a recorded column are glitches, rising; looked for once."""
        if column not in self._glitches:
            values = self.demonstration.signals[:, column]
            lost = measured(values) & ~np.isfinite(readings(values))
            self._glitches[column] = np.flatnonzero(lost)
        return self._glitches[column]

    def left_out(self, first: float, last: float) -> int:
        """How many glitches there are between two places, as far as they were come across."""
        # Asked for with every paint, while a job may come across more of them.
        span = self.time(first), self.time(last)
        begin, end = np.searchsorted(self.demonstration.times, span).tolist()
        glitches = tuple(self._glitches.values())
        return sum(int(np.diff(np.searchsorted(places, (begin, end)))[0]) for places in glitches)

    def _finite(self, column: int, start: int, step: int) -> int | None:
        """The nearest sample that is there before `start`, or from `start` on."""
        signals = self.demonstration.signals
        while start > 0 if step < 0 else start < len(signals):
            end = max(0, start - BLOCK) if step < 0 else min(len(signals), start + BLOCK)
            low, high = min(start, end), max(start, end)
            places = np.flatnonzero(self._measured(column, low, signals[low:high, column]))
            if places.size:
                return low + int(places[-1 if step < 0 else 0])
            start = end
        return None

    def _between(self, column: int, first: int, last: int) -> tuple[Real, Flags]:
        """Straight lines between recorded samples, read off at the grid's times."""
        stamps = self.demonstration.times
        grid_times = self.demonstration.start + np.arange(first, last) / self.rate
        low = max(0, int(np.searchsorted(stamps, grid_times[0], side="right")) - 1)
        high = min(len(stamps), int(np.searchsorted(stamps, grid_times[-1])) + 1)
        heights, is_measured = self._recorded(column, low, max(high, low + 1))
        places = stamps[low : low + len(heights)]
        values = np.interp(grid_times, places, heights)
        spaces = np.diff(places, append=places[-1])
        if is_measured.all() and spaces.max() <= GAP_PERIODS / self.rate:
            return values, np.ones(len(grid_times), dtype=bool)
        # A time belongs to the stamp before it, for as long as a gap lasts at most.
        owner = np.clip(
            np.searchsorted(places, grid_times + 1e-6 / self.rate) - 1, 0, len(places) - 1
        )
        gap = spaces[owner] > GAP_PERIODS / self.rate
        late = grid_times - places[owner] > (1 - 1e-6) / self.rate
        return values, is_measured[owner] & ~(gap & late)


def _long_runs(lost: Flags, before: int, after: int) -> Flags:
    """Where samples are missing in runs longer than a gap may be.

    A run at either end goes on for `before` or `after` samples beyond it.
    """
    out = np.zeros_like(lost)
    for first, last in marked_runs(lost).tolist():
        beyond = (before if first == 0 else 0) + (after if last == len(lost) else 0)
        out[first:last] = last - first + beyond > GAP_PERIODS
    return out


def columns_of(channels: Sequence[Channel], channel: str) -> tuple[int, ...]:
    """The recorded columns that a channel is made of."""
    names = [recorded.name for recorded in channels]
    if channel in names:
        return (names.index(channel),)
    mapping = channel_map(channels, (channel,))
    return tuple(mapping.recorded[place] for place in mapping.columns[0])


def open_reader(
    demonstration: Demonstration, channel: str
) -> Generator[Progress, None, GridReader]:
    """Find out on which grid a channel lies; a job.

    `channel`: name of a recorded channel, or of a recognition channel (see
    :func:`~forcelab.signals.channels.channel_map`).
    """
    columns = columns_of(demonstration.channels, channel)
    times, own_rate = demonstration.times, 1.0 / demonstration.period
    n = len(times)
    true = (n - 1) / float(times[-1] - times[0])
    uniform = True
    steps = np.arange(min(n, BLOCK)) / true
    room = np.empty(len(steps))  # used again: new memory takes five times as long as the numbers
    for start in range(0, n, BLOCK):
        yield Progress(start, n, "looking at the stamps")
        part = times[start : start + BLOCK]
        off = np.subtract(part, steps[: len(part)], out=room[: len(part)])
        off -= times[0] + start / true
        if max(off.max(), -off.min()) > UNIFORM / own_rate:
            uniform = False
            break
    if uniform:
        return GridReader(demonstration, channel, columns, True, true, n)
    count = int(np.floor((times[-1] - times[0]) * own_rate + 1e-6)) + 1
    if count > MAX_SAMPLES:
        raise InputError(
            f"Demonstration '{demonstration.name}' spans {demonstration.duration:.6g} s, "
            f"{count:.3g} samples at {own_rate:.6g} Hz; remove stray stamps."
        )
    return GridReader(demonstration, channel, columns, False, own_rate, count)
