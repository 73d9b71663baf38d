"""Least and greatest sample of a channel in every pixel column of the screen.

A curve of more samples than the screen has columns is drawn as one upright line a column, from the
least to the greatest sample whose stamp lies in it; nothing vanishes, however far out one zooms.
`Columns` says which samples lie in each column, for all channels of a demonstration; an `Envelope`
finds the extremes of one channel in them. A pyramid of the extremes of 16, 64, 256, ... samples,
built once, gives a column's extremes at a cost that does not depend on how many samples it holds:
of the coarsest level of which a mean column still holds 16 blocks, all blocks that touch a column
are looked at. They lie next to each other, so that many of them cost less than to pick few.

Below 64 samples a column, its extremes are exactly those of its samples. From there on, every
sample of a column is in its extremes, and at either end less than one block of its neighbours may
be: fewer than 16 samples, or a sixteenth of a mean column, and of less than a column's width in
time. Columns that a block would reach further out of, as across a gap, are looked at sample by
sample at both ends, and between by blocks of one level after the other that lie inside of them. The
pyramid takes 2/16 + 2/64 + ... = 1/6 of the memory of its channel.

Between the samples a curve is a straight line. With the line's values at the edges of the columns
the same upright lines join up to the curve, however few samples there are; across a gap in the
stamps and across a missing sample there is no line.

One glitch of 1e16 would leave nothing to be seen of forces of some newtons: samples that no sensor
can have read count as missing here too, and :attr:`Envelope.glitches` tells where they are.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forcelab.arrays import Real, Whole
from forcelab.jobs import Progress
from forcelab.signals.conditioning import GLITCH, in_short_runs
from forcelab.signals.grid import readings

#: Samples in a block of the finest level, and blocks in a block of the next level.
UNIT = 16
FACTOR = 4
#: Samples in a block of each level.
SIZES = tuple(UNIT * FACTOR**k for k in range(8))
#: Samples that are read at once: one block of the coarsest level.
CHUNK = SIZES[-1]
#: From so many blocks of the finest level a column on, a pyramid is used; and from a coarser level
#: on where a column holds at least so many of its blocks.
FEWEST, FINE = 4, 16
#: From so many samples a column on, extremes are drawn; below, a line through the samples.
DENSE = 3.0


@dataclass(frozen=True, eq=False, slots=True)
class _Ends:
    """The samples, or the blocks of one level, at both ends of columns."""

    numbers: Whole  # (m,), the columns that hold any
    blocks: Whole  # (2 * few, m), those of each, none outside of it, some of them more than once

    @classmethod
    def of(cls, numbers: Whole, firsts: Whole, lasts: Whole, few: int) -> _Ends:
        """The `few` at either end of the runs from `firsts` up to `lasts`."""
        occupied = firsts < lasts
        first, final = firsts[occupied], lasts[occupied] - 1
        steps = np.arange(few)[:, np.newaxis]
        ends = (np.minimum(first + steps, final), np.maximum(final - steps, first))
        return cls(numbers[occupied], np.concatenate(ends))


class Columns:
    """Which samples lie in each column of the screen; shared by all channels of a demonstration.

    `times` (n,): stamps in seconds, strictly increasing; they need not be regular; `edges` (k +
    1,): edges of the columns in seconds, rising; column ``i`` holds the samples with ``edges[i] <=
    time < edges[i + 1]``; `longest`: neighbouring stamps further apart than this many seconds have
    a gap between them; `firsts`, `lasts` (k,): column ``i`` holds the samples ``firsts[i]`` up to,
    not including, ``lasts[i]``.
    """

    def __init__(
        self,
        times: Real,
        edges: ArrayLike,
        longest: float = np.inf,
        *,
        count: int | None = None,
    ) -> None:
        self._times: Real = np.asarray(times)
        self._edges: Real = np.asarray(edges, dtype=np.float64)
        self._longest = longest
        #: The first sample of each column, and the one after the last column.
        self._bounds = np.searchsorted(self._times[:count], self._edges).astype(np.int64)
        self.firsts, self.lasts = self._bounds[:-1], self._bounds[1:]
        self._restricted: dict[int, Columns] = {}

    def __len__(self) -> int:
        return len(self.firsts)

    @property
    def samples(self) -> int:
        return int(self._bounds[-1] - self._bounds[0])

    @cached_property
    def full(self) -> Whole:
        return np.flatnonzero(self.firsts < self.lasts)

    @property
    def crowd(self) -> float:
        """Mean number of samples in a column that holds any; 0 where none does."""
        return self.samples / len(self.full) if len(self.full) else 0.0

    @property
    def dense(self) -> bool:
        """Whether extremes are to be drawn rather than a line through the samples."""
        return self.crowd >= DENSE

    @property
    def pyramid(self) -> bool:
        """Whether a pyramid is needed; without, at most 64 samples a column are looked at."""
        return self.crowd >= FEWEST * UNIT

    def up_to(self, count: int) -> Columns:
        """The same columns with only the first `count` samples of the demonstration in them."""
        if count >= self._bounds[-1]:
            return self
        if count not in self._restricted:
            part = Columns(self._times, self._edges, self._longest, count=count)
            self._restricted[count] = part
        return self._restricted[count]

    @property
    def around(self) -> slice:
        """The samples in all columns, and one on either side."""
        return slice(max(int(self._bounds[0]) - 1, 0), int(self._bounds[-1]) + 1)

    @cached_property
    def crossings(self) -> tuple[Whole, Whole, Real]:
        """The edges that a line between two samples crosses, shape (m,) each.

        Which edges, the sample after each, and the share of the way to it.
        """
        edges = np.flatnonzero((self._bounds > 0) & (self._bounds < len(self._times)))
        after = self._bounds[edges]
        left, right = self._times.take(after - 1), self._times.take(after)
        joined = right - left <= self._longest
        share = (self._edges[edges] - left) / (right - left)
        return edges[joined], after[joined], share[joined]

    @cached_property
    def top(self) -> int:
        """The coarsest level that is looked at, where a pyramid is needed."""
        return max(k for k, size in enumerate(SIZES) if k == 0 or size * FINE <= self.crowd)

    @cached_property
    def narrow(self) -> Whole:
        """The columns that hold samples, but whose blocks would reach too far out of them."""
        numbers, size = self.full, SIZES[self.top]
        opening = self._times.take(self.firsts[numbers] // size * size)
        closing = -(-self.lasts[numbers] // size) * size
        closing = self._times.take(np.minimum(closing, len(self._times)) - 1)
        left, right = self._edges[numbers], self._edges[numbers + 1]
        return numbers[np.maximum(left - opening, closing - right) > right - left]

    @cached_property
    def ends(self) -> tuple[_Ends, ...]:
        """What is looked at one by one at both ends of :attr:`narrow` columns.

        First samples, then the blocks of each level below :attr:`top`.
        """
        numbers = self.narrow
        if not len(numbers):
            return ()
        begin, end = self.firsts[numbers], self.lasts[numbers]
        ends = []
        for few in (UNIT, *[FACTOR] * self.top):
            ends.append(_Ends.of(numbers, begin, end, few - 1))
            begin, end = -(-begin // few), end // few
        return tuple(ends)

    @cached_property
    def run(self) -> tuple[Whole, Whole]:
        """The columns that hold a block of level :attr:`top`, and the bounds of their runs.

        Two a column, as :meth:`numpy.ufunc.reduceat` wants them.
        """
        size = SIZES[self.top]
        begin, end = self.firsts // size, -(-self.lasts // size)
        for inside in (self.narrow, np.flatnonzero(self.firsts >= self.lasts)):
            if len(inside):
                begin[inside] = -(-self.firsts[inside] // size)
                end[inside] = self.lasts[inside] // size
        numbers = np.flatnonzero(begin < end)
        return numbers, np.stack([begin[numbers], end[numbers]], axis=1).ravel()


@dataclass(frozen=True, eq=False, slots=True)
class Extremes:
    """The least and the greatest sample of each of k columns."""

    #: low and high: (k,), or (k, c) of all channels, in the channel's unit; NaN where a column
    #: holds no sample or only missing ones.
    low: Real
    high: Real


def run_extremes(
    values: Real, firsts: Whole, lasts: Whole, limits: tuple[float, float] | None = None
) -> Extremes:
    """The least and the greatest sample of runs of rows, each from one up to, not with, another.

    `values` have shape (n,) or (n, c); what is not finite or beyond `limits` is missing. Runs
    follow each other, though they may overlap and be empty.
    """
    low = np.full((len(firsts), *values.shape[1:]), np.inf)
    high = -low
    full = np.flatnonzero(firsts < lasts)
    if len(full):
        runs = np.stack([firsts[full], lasts[full]], axis=1).ravel()
        first, last = runs[0], runs[-1]
        runs -= first
        # One row more, where the last run ends; what lies between runs is of no interest.
        lows, highs = _present(np.concatenate([values[first:last], values[-1:]]), limits)
        low[full] = np.minimum.reduceat(lows, runs, axis=0)[::2]
        high[full] = np.maximum.reduceat(highs, runs, axis=0)[::2]
    return _without_empty(low, high)


def _without_empty(low: Real, high: Real) -> Extremes:
    """Extremes, NaN where no sample was met."""
    empty = low > high
    low[empty] = high[empty] = np.nan
    return Extremes(low, high)


class Envelope:
    """One channel and the pyramid of its extremes, which :func:`read_envelopes` fills.

    What was read already can be drawn while the rest is read: a reader in another thread raises
    :attr:`filled` after the extremes are there.

    `signals` (n, c): all channels, perhaps mapped into memory; NaN or infinity marks a missing
    sample; `filled`: the pyramid holds the samples before this one; `limits`: samples beyond them
    count as missing; None where none is, and until all was read; `glitches`: which of these samples
    are glitches: not those of long runs, as of a number that stands for a sensor that was not
    there.
    """

    def __init__(self, signals: Real, column: int) -> None:
        # No memmap, which is slow to index; nothing is copied.
        self.values: Real = np.asarray(signals)[:, column]
        self.filled = 0
        self.limits: tuple[float, float] | None = None
        self.glitches: Whole = np.empty(0, dtype=np.int64)
        # For each level the least sample and the negative of the greatest, shape (2, blocks): two
        # least values, found in one go. Made by the first read, in its thread: that takes time.
        self._levels: list[Real] = []

    def __len__(self) -> int:
        return len(self.values)

    @property
    def bytes(self) -> int:
        return sum(level.nbytes for level in self._levels)

    @property
    def range(self) -> tuple[float, float] | None:
        """Least and greatest sample of what was read; None where there is none."""
        return self._outermost() if self.filled else None

    def read(self, start: int) -> None:
        """Read the chunk that starts at sample `start`, a multiple of :data:`CHUNK`."""
        if not self._levels:
            # One block more at the end: a run may end behind the last block.
            counts = [-(-len(self.values) // size) + 1 for size in SIZES]
            self._levels = [np.full((2, count), np.inf) for count in counts]
        values = self.values[start : start + CHUNK]
        padded = np.full(-(-len(values) // UNIT) * UNIT, np.nan)
        padded[: len(values)] = values
        low, high = _present(padded, self.limits)
        lowest = _coarser(np.stack([low, -high], axis=1), UNIT)
        for level, size in zip(self._levels, SIZES, strict=True):
            level[:, start // size : start // size + len(lowest)] = lowest.T
            lowest = _coarser(lowest, FACTOR)
        if start + CHUNK >= len(self) and self.limits is None:
            self._leave_out_glitches()

    def extremes(self, columns: Columns) -> Extremes:
        """The least and the greatest sample of each column.

        `columns`: of the same demonstration. Where they need a pyramid, samples that were not read
        yet are left out.
        """
        if not columns.pyramid:
            return run_extremes(self.values, columns.firsts, columns.lasts, self.limits)
        low, high = np.full(len(columns), np.inf), np.full(len(columns), -np.inf)
        self._from_pyramid(columns.up_to(self.filled), low, high)
        return _without_empty(low, high)

    def _from_pyramid(self, columns: Columns, low: Real, high: Real) -> None:
        if not len(columns.full):
            return
        if columns.ends:
            samples, *ends = columns.ends
            least, greatest = _present(self.values[samples.blocks], self.limits)
            low[samples.numbers], high[samples.numbers] = least.min(axis=0), greatest.max(axis=0)
            for end, level in zip(ends, self._levels, strict=False):
                _lower(low, high, end.numbers, level.take(end.blocks, axis=1).min(axis=1))
        numbers, bounds = columns.run
        if len(numbers):
            level = self._levels[columns.top][:, bounds[0] : bounds[-1] + 1]
            lowest = np.minimum.reduceat(level, bounds - bounds[0], axis=1)[:, ::2]
            _lower(low, high, numbers, lowest)

    def _outermost(self) -> tuple[float, float] | None:
        """Least and greatest value of the pyramid; None where it holds none."""
        low, high = self._levels[-1].min(axis=1).tolist()
        return (low, -high) if low <= -high else None

    def _leave_out_glitches(self) -> None:
        """Count as missing what no sensor can have read, now that all was read."""
        outermost = self._outermost()
        if outermost is None or max(-outermost[0], outermost[1]) <= GLITCH / 2:
            return  # no glitch is as small: as good as always the answer
        values = np.array(self.values)
        finite = readings(values)
        finite = finite[np.isfinite(finite)]
        if not finite.size:
            return
        low, high = float(finite.min()), float(finite.max())
        outlying = np.isfinite(values) & _beyond(values, (low, high))
        if outlying.any():
            self.glitches = np.flatnonzero(in_short_runs(outlying))
            self.limits = (low, high)
        for chunk in np.unique(np.flatnonzero(outlying) // CHUNK).tolist():
            self.read(chunk * CHUNK)


def drawn_together(envelopes: Sequence[Envelope], columns: Columns) -> list[Extremes]:
    """The least and the greatest value of some channels' curves in each column.

    As of :meth:`Envelope.extremes`, with the values of the line through the samples at the edges.
    """
    drawn = []
    for envelope in envelopes:
        extremes, meeting = envelope.extremes(columns), _edge_values(envelope, columns)
        lowest, highest = np.fmin(meeting[:-1], meeting[1:]), np.fmax(meeting[:-1], meeting[1:])
        drawn.append(Extremes(np.fmin(extremes.low, lowest), np.fmax(extremes.high, highest)))
    return drawn


def _edge_values(envelope: Envelope, columns: Columns) -> Real:
    """Where the lines between samples meet the edges of columns, shape (k + 1,)."""
    numbers, after, share = columns.crossings
    left, right = envelope.values[after - 1], envelope.values[after]
    if envelope.limits:
        for side in (left, right):
            side[_beyond(side, envelope.limits)] = np.nan
    meeting = np.full(len(columns) + 1, np.nan)
    meeting[numbers] = _between(left, right, share)
    if columns.pyramid:
        meeting[numbers[np.searchsorted(after, envelope.filled) :]] = np.nan
    return meeting


def read_envelopes(envelopes: Sequence[Envelope]) -> Generator[Progress, None, None]:
    """Fill the pyramids of some channels of one demonstration, passing over its samples once.

    A step is one chunk of one channel, some milliseconds in which numpy lets other threads run.

    `envelopes`: each goes on where it stopped before.
    """
    envelopes = [envelope for envelope in envelopes if envelope.filled < len(envelope)]
    if not envelopes:
        return
    n = len(envelopes[0])
    for start in range(min(envelope.filled for envelope in envelopes), n, CHUNK):
        for envelope in envelopes:
            if envelope.filled <= start:
                envelope.read(start)
                envelope.filled = min(start + CHUNK, n)
                yield Progress(envelope.filled, n, "reading the channels")


def _beyond(values: Real, limits: tuple[float, float]) -> NDArray[np.bool_]:
    """Which values are below the lower of two limits or above the upper one."""
    return np.asarray((values < limits[0]) | (values > limits[1]))


def _present(values: Real, limits: tuple[float, float] | None) -> tuple[Real, Real]:
    """The values for the search of the least and of the greatest: missing ones are never found."""
    missing = ~np.isfinite(values)
    if limits is not None:
        missing |= _beyond(values, limits)
    if not missing.any():
        return values, values
    return np.where(missing, np.inf, values), np.where(missing, -np.inf, values)


def _between(left: Real, right: Real, share: Real) -> Real:
    """Values a share of the way from one sample to the next; NaN where one of them is missing."""
    with np.errstate(invalid="ignore", over="ignore"):
        value = left * (1.0 - share) + right * share
    return np.where(np.isfinite(value), value, np.nan)


def _lower(low: Real, high: Real, numbers: Whole, lowest: Real) -> None:
    """Widen some of the extremes to those of a level, shape (2, m)."""
    low[numbers] = np.minimum(low[numbers], lowest[0])
    high[numbers] = np.maximum(high[numbers], -lowest[1])


def _coarser(values: Real, width: int) -> Real:
    """The least of each `width` neighbours, shape (n, 2); the last may have fewer."""
    if len(values) % width:
        rest = np.broadcast_to(values[-1], (-len(values) % width, 2))
        values = np.concatenate([values, rest])
    parts = values.reshape(-1, width, 2)
    lowest = parts[:, 0].copy()
    for i in range(1, width):  # many times faster than a reduction along a short axis
        np.minimum(lowest, parts[:, i], out=lowest)
    return lowest
