"""One channel of a demonstration on its uniform grid, read piece by piece.

The same samples as :func:`forcelab.signals.grid.on_grid` gives at the recording's own rate, but
only where they are asked for, so that a view of a long recording costs what it shows.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import GAP_PERIODS, Demonstration
from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.signals.channels import channel_map
from forcelab.signals.grid import MAX_SAMPLES, UNIFORM, measured

__all__ = ["Level", "Source", "open_source"]

Real = NDArray[np.float64]

#: Stamps or samples looked at in one step.
BLOCK = 1 << 19


@dataclass(frozen=True, slots=True)
class Level:
    """How samples are shifted and sized before single precision sees them.

    Parameters
    ----------
    shift : float
        What lies in the middle of them.
    exponent : int
        They are divided by two to this power.
    """

    shift: float
    exponent: int

    @classmethod
    def of(cls, low: float, high: float) -> Level:
        """That of samples from `low` to `high`."""
        largest = max(abs(low), abs(high))
        # Halved before they meet: the sum of two numbers near 1e308 overflows.
        return cls(0.5 * low + 0.5 * high, int(np.frexp(largest)[1]) if largest > 0 else 0)

    def sized(self, values: Real) -> Real:
        """Samples shifted and divided, in place."""
        values -= self.shift
        return np.ldexp(values, -self.exponent, out=values)


@dataclass(frozen=True, eq=False, slots=True)
class Source:
    """A channel on a uniform grid.

    Parameters
    ----------
    demonstration : Demonstration
    channel : str
        A recorded channel, or a recognition channel such as ``"tangential 1"``.
    columns : tuple of int
        The recorded columns it is made of: two for a tangential magnitude, one for any other.
    uniform : bool
        Whether the samples are the grid; otherwise straight lines between them are read.
    rate : float
        Samples a second.
    count : int
        How many samples the grid has.
    """

    demonstration: Demonstration
    channel: str
    columns: tuple[int, ...]
    uniform: bool
    rate: float
    count: int

    def place(self, time: float) -> float:
        """Where on the grid a time lies, in samples from the first."""
        return (time - self.demonstration.start) * self.rate

    def time(self, place: float) -> float:
        """When a place on the grid is, in seconds."""
        return self.demonstration.start + place / self.rate

    def read(self, first: int, last: int) -> tuple[Real, NDArray[np.bool_]]:
        """Read the samples ``first .. last - 1``; beyond the ends the end values hold.

        Returns
        -------
        values : ndarray of float64, shape (last - first,)
            Missing samples are bridged by straight lines, in each recorded column on its own.
        known : ndarray of bool, shape (last - first,)
            False in gaps of the stamps, in long runs of missing samples and beyond the ends.
        """
        inner = max(0, min(first, self.count - 1)), max(1, min(last, self.count))
        parts, known = [], np.ones(inner[1] - inner[0], dtype=bool)
        for column in self.columns:
            if self.uniform:
                part, good = self._recorded(column, *inner)
            else:
                part, good = self._between(column, *inner)
            parts.append(part)
            known &= good
        values = parts[0] if len(parts) == 1 else np.hypot(parts[0], parts[1])
        before, after = max(0, inner[0] - first), max(0, last - inner[1])
        if before or after:
            values = np.pad(values, (before, after), mode="edge")[: last - first]
            known = np.pad(known, (before, after))[: last - first]
        return values, known

    def pieces(self, firsts: NDArray[np.int64], length: int) -> tuple[Real, NDArray[np.bool_]]:
        """Read pieces of one length from each of several samples on, faster than one by one.

        Returns
        -------
        values : ndarray of float64, shape (len(firsts), length)
            As of :meth:`read`.
        known : ndarray of bool, shape (len(firsts),)
            Whether there is anything known in a piece.
        """
        values = np.empty((len(firsts), length))
        whole = np.zeros(len(firsts), dtype=bool)
        if self.uniform and len(self.columns) == 1:
            whole = (firsts >= 0) & (firsts + length <= self.count)
            column = self.demonstration.signals[:, self.columns[0]]
            for row in np.flatnonzero(whole).tolist():
                values[row] = column[firsts[row] : firsts[row] + length]
            whole[whole] = measured(values[whole]).all(axis=1)
        known = whole.copy()
        for row in np.flatnonzero(~whole).tolist():
            first = int(firsts[row])
            values[row], there = self.read(first, first + length)
            known[row] = there.any()
        return values, known

    def _recorded(self, column: int, first: int, last: int) -> tuple[Real, NDArray[np.bool_]]:
        """Recorded samples as they are, bridged from the nearest ones even outside the piece."""
        values = self.demonstration.signals[first:last, column].copy()
        good = measured(values)
        if good.all():
            return values, good
        places, heights = np.flatnonzero(good) + first, values[good]
        before = after = 0  # samples missing beyond the piece, of the runs it begins and ends in
        # Only a piece that begins or ends in a run needs to look for the run's other side.
        if not good[0]:
            left = self._finite(column, first, -1)
            before = first if left is None else first - left - 1
            if left is not None:
                places = np.append(left, places)
                heights = np.append(self.demonstration.signals[left, column], heights)
        if not good[-1]:
            right = self._finite(column, last, 1)
            after = (len(self.demonstration.signals) if right is None else right) - last
            if right is not None:
                places = np.append(places, right)
                heights = np.append(heights, self.demonstration.signals[right, column])
        wanted = np.arange(first, last)
        bridged = np.interp(wanted, places, heights) if places.size else np.zeros(last - first)
        return bridged, ~_long_runs(~good, before, after)

    def _finite(self, column: int, start: int, step: int) -> int | None:
        """The nearest sample that is there before `start`, or from `start` on."""
        signals = self.demonstration.signals
        while start > 0 if step < 0 else start < len(signals):
            end = max(0, start - BLOCK) if step < 0 else min(len(signals), start + BLOCK)
            low, high = min(start, end), max(start, end)
            found = np.flatnonzero(measured(signals[low:high, column]))
            if found.size:
                return low + int(found[-1 if step < 0 else 0])
            start = end
        return None

    def _between(self, column: int, first: int, last: int) -> tuple[Real, NDArray[np.bool_]]:
        """Straight lines between recorded samples, read off at the grid's times."""
        stamps = self.demonstration.times
        wanted = self.demonstration.start + np.arange(first, last) / self.rate
        low = max(0, int(np.searchsorted(stamps, wanted[0], side="right")) - 1)
        high = min(len(stamps), int(np.searchsorted(stamps, wanted[-1])) + 1)
        heights, good = self._recorded(column, low, max(high, low + 1))
        places = stamps[low : low + len(heights)]
        values = np.interp(wanted, places, heights)
        spaces = np.diff(places, append=places[-1])
        if good.all() and spaces.max() <= GAP_PERIODS / self.rate:
            return values, np.ones(len(wanted), dtype=bool)
        # A time belongs to the stamp before it, for as long as a gap lasts at most.
        owner = np.clip(np.searchsorted(places, wanted + 1e-6 / self.rate) - 1, 0, len(places) - 1)
        gap = spaces[owner] > GAP_PERIODS / self.rate
        late = wanted - places[owner] > (1 - 1e-6) / self.rate
        return values, good[owner] & ~(gap & late)


def _long_runs(lost: NDArray[np.bool_], before: int, after: int) -> NDArray[np.bool_]:
    """Where samples are missing in runs longer than a gap may be.

    A run at either end goes on for `before` or `after` samples beyond it.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], lost, [False]])))
    out = np.zeros_like(lost)
    for first, last in edges.reshape(-1, 2).tolist():
        beyond = (before if first == 0 else 0) + (after if last == len(lost) else 0)
        out[first:last] = last - first + beyond > GAP_PERIODS
    return out


def open_source(demonstration: Demonstration, channel: str) -> Generator[Progress, None, Source]:
    """Find out on which grid a channel lies; a job.

    Parameters
    ----------
    demonstration : Demonstration
    channel : str
        Name of a recorded channel, or of a recognition channel (see
        :func:`~forcelab.signals.channels.channel_map`).

    Raises
    ------
    InputError
        If there is no such channel, or a stray stamp makes the grid too long.
    """
    names = [recorded.name for recorded in demonstration.channels]
    if channel in names:
        columns: tuple[int, ...] = (names.index(channel),)
    else:
        found = channel_map(demonstration.channels, (channel,))
        columns = tuple(found.recorded[place] for place in found.columns[0])
    times, own = demonstration.times, 1.0 / demonstration.period
    n = len(times)
    true = (n - 1) / float(times[-1] - times[0])
    uniform = True
    for start in range(0, n, BLOCK):
        yield Progress(start, n, "looking at the stamps")
        part = times[start : start + BLOCK]
        places = times[0] + np.arange(start, start + len(part)) / true
        if np.max(np.abs(part - places)) > UNIFORM / own:
            uniform = False
            break
    if uniform:
        return Source(demonstration, channel, columns, True, true, n)
    count = int(np.floor((times[-1] - times[0]) * own + 1e-6)) + 1
    if count > MAX_SAMPLES:
        raise InputError(
            f"Demonstration '{demonstration.name}' spans {demonstration.duration:.6g} s, "
            f"{count:.3g} samples at {own:.6g} Hz; remove stray stamps."
        )
    return Source(demonstration, channel, columns, False, own, count)
