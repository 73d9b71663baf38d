"""The columns of the screen: which samples lie in each, and which blocks of them are looked at.

What is found here serves all channels of a demonstration; :mod:`forcelab.signals.envelope` finds
the extremes of each channel with it, and says why these blocks.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["CHUNK", "DENSE", "FACTOR", "SIZES", "UNIT", "Columns"]

#: Samples in a block of the finest level, and blocks in a block of the next level.
UNIT = 16
FACTOR = 4
#: Samples in a block of each level.
SIZES = tuple(UNIT * FACTOR**k for k in range(8))
#: Samples that are read at once: one block of the coarsest level.
CHUNK = SIZES[-1]
#: Up to so many samples a column are picked one by one rather than found run by run.
PICKED = 32
#: A column holds at least so many blocks of the coarsest level that is used for it.
FEWEST = 4
#: From so many samples a column on, extremes are drawn; below, a line through the samples.
DENSE = 3.0

Real = NDArray[np.float64]
Whole = NDArray[np.int64]


@dataclass(frozen=True, eq=False, slots=True)
class _Ends:
    """The blocks of one level at both ends of columns.

    Parameters
    ----------
    which : ndarray of int64, shape (m,)
        The columns that hold a whole block.
    blocks : ndarray of int64, shape (2 * (f - 1), m)
        Blocks of each, none outside of it, some of them more than once.
    """

    which: Whole
    blocks: Whole

    @classmethod
    def of(cls, firsts: Whole, lasts: Whole, few: int) -> _Ends:
        """The `few` blocks at either end of the runs from `firsts` up to `lasts`."""
        which = np.flatnonzero(firsts < lasts)
        first, final = firsts[which], lasts[which] - 1
        steps = np.arange(few)[:, np.newaxis]
        ends = (np.minimum(first + steps, final), np.maximum(final - steps, first))
        return cls(which, np.concatenate(ends))


class Columns:
    """Which samples lie in each column of the screen; shared by all channels of a demonstration.

    Parameters
    ----------
    times : ndarray of float64, shape (n,)
        Stamps in seconds, strictly increasing; they need not be regular.
    edges : array_like, shape (k + 1,)
        Edges of the columns in seconds, rising; column ``i`` holds the samples with
        ``edges[i] <= time < edges[i + 1]``.
    longest : float
        Neighbouring stamps further apart than this many seconds have a gap between them.

    Attributes
    ----------
    firsts, lasts : ndarray of int64, shape (k,)
        Column ``i`` holds the samples ``firsts[i]`` up to, not including, ``lasts[i]``.
    """

    def __init__(self, times: Real, edges: ArrayLike, longest: float = np.inf) -> None:
        self._times: Real = np.asarray(times)
        self._edges: Real = np.asarray(edges, dtype=np.float64)
        self._longest = longest
        self._adopt(np.searchsorted(self._times, self._edges).astype(np.int64))

    def _adopt(self, bounds: Whole) -> None:
        """Take the first sample of each column, and the one after the last column."""
        self._bounds = bounds
        self.firsts, self.lasts = bounds[:-1], bounds[1:]
        self._restricted: dict[int, Columns] = {}

    def __len__(self) -> int:
        return len(self.firsts)

    @property
    def samples(self) -> int:
        """Samples in all columns together."""
        return int(self._bounds[-1] - self._bounds[0])

    @cached_property
    def full(self) -> Whole:
        """The columns that hold a sample."""
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

    @cached_property
    def picks(self) -> Whole | None:
        """The samples of each column that holds any, one column below the other, shape (s, m).

        A column with fewer than `s` repeats its last one. None where columns hold too many, or
        some hold many more than others.
        """
        first, last = self.firsts[self.full], self.lasts[self.full]
        most = int((last - first).max(initial=0))
        if most > PICKED or most * len(self.full) > 2 * self.samples + len(self.full):
            return None
        return np.minimum(first + np.arange(most)[:, np.newaxis], last - 1)

    def up_to(self, count: int) -> Columns:
        """The same columns with only the first `count` samples of the demonstration in them."""
        if count >= self._bounds[-1]:
            return self
        if count not in self._restricted:
            part = Columns.__new__(Columns)
            part._times, part._edges, part._longest = self._times, self._edges, self._longest
            part._adopt(np.minimum(self._bounds, count))
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
        which = np.flatnonzero((self._bounds > 0) & (self._bounds < len(self._times)))
        after = self._bounds[which]
        left, right = self._times.take(after - 1), self._times.take(after)
        joined = right - left <= self._longest
        share = (self._edges[which] - left) / (right - left)
        return which[joined], after[joined], share[joined]

    @cached_property
    def top(self) -> int:
        """The coarsest level that is looked at, where a pyramid is needed."""
        return max(k for k, size in enumerate(SIZES) if k == 0 or size * FEWEST <= self.crowd)

    @cached_property
    def strict(self) -> _Ends:
        """The samples at both ends of those columns that blocks would reach too far out of."""
        which = self.full
        first, last = self.firsts[which], self.lasts[which]
        opening = self._times.take(first // UNIT * UNIT)
        closing = self._times.take(np.minimum(-(-last // UNIT) * UNIT, len(self._times)) - 1)
        left, right = self._edges[which], self._edges[which + 1]
        far = np.maximum(left - opening, closing - right) > right - left
        ends = _Ends.of(first[far], last[far], UNIT - 1)
        return _Ends(which[far][ends.which], ends.blocks)

    @cached_property
    def runs(self) -> tuple[tuple[Whole, Whole], ...]:
        """For each level up to :attr:`top` the first block of each column and the one after."""
        begin, end = self.firsts // UNIT, -(-self.lasts // UNIT)
        inner = np.union1d(self.strict.which, np.flatnonzero(self.firsts >= self.lasts))
        begin[inner], end[inner] = -(-self.firsts[inner] // UNIT), self.lasts[inner] // UNIT
        found = [(begin, end)]
        for _ in range(self.top):
            begin, end = -(-begin // FACTOR), end // FACTOR
            found.append((begin, end))
        return tuple(found)

    @cached_property
    def ends(self) -> tuple[_Ends, ...]:
        """The blocks of each level below :attr:`top` at both ends of the columns."""
        return tuple(_Ends.of(*run, FACTOR - 1) for run in self.runs[:-1])

    @cached_property
    def run(self) -> tuple[Whole, Whole]:
        """The columns that hold a whole block of level :attr:`top`.

        With them the bounds of their runs, two a column, as :meth:`numpy.ufunc.reduceat` wants.
        """
        begin, end = self.runs[-1]
        which = np.flatnonzero(begin < end)
        return which, np.stack([begin[which], end[which]], axis=1).ravel()
