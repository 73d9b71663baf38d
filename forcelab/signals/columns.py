"""The columns of the screen: which samples lie in each, and which blocks of them are looked at.

What is found here serves all channels of a demonstration; :mod:`forcelab.signals.envelope` finds
the extremes of each channel with it, and says why these blocks.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["CHUNK", "DENSE", "FACTOR", "MANY", "SIZES", "UNIT", "Columns"]

#: Samples in a block of the finest level, and blocks in a block of the next level.
UNIT = 16
FACTOR = 4
#: Samples in a block of each level.
SIZES = tuple(UNIT * FACTOR**k for k in range(8))
#: Samples that are read at once: one block of the coarsest level.
CHUNK = SIZES[-1]
#: Up to so many samples a column are picked one by one rather than found run by run.
PICKED = 32
#: From so many blocks of the finest level a column on, a pyramid is used; and from a coarser level
#: on where a column holds at least so many of its blocks.
FEWEST, FINE = 4, 16
#: Stamps of so many samples do not fit into a processor's cache: to search them is to wait.
MANY = 200_000
#: From so many samples a column on, extremes are drawn; below, a line through the samples.
DENSE = 3.0

Real = NDArray[np.float64]
Whole = NDArray[np.int64]


@dataclass(frozen=True, eq=False, slots=True)
class _Ends:
    """The samples, or the blocks of one level, at both ends of columns.

    Parameters
    ----------
    which : ndarray of int64, shape (m,)
        The columns that hold any.
    blocks : ndarray of int64, shape (2 * few, m)
        Those of each, none outside of it, some of them more than once.
    """

    which: Whole
    blocks: Whole

    @classmethod
    def of(cls, which: Whole, firsts: Whole, lasts: Whole, few: int) -> _Ends:
        """The `few` at either end of the runs from `firsts` up to `lasts`."""
        there = firsts < lasts
        first, final = firsts[there], lasts[there] - 1
        steps = np.arange(few)[:, np.newaxis]
        ends = (np.minimum(first + steps, final), np.maximum(final - steps, first))
        return cls(which[there], np.concatenate(ends))


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
        self._adopt(_found(self._times, self._edges))

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
        return max(k for k, size in enumerate(SIZES) if k == 0 or size * FINE <= self.crowd)

    @cached_property
    def narrow(self) -> Whole:
        """The columns that hold samples, but whose blocks would reach too far out of them."""
        which, size = self.full, SIZES[self.top]
        opening = self._times.take(self.firsts[which] // size * size)
        closing = -(-self.lasts[which] // size) * size
        closing = self._times.take(np.minimum(closing, len(self._times)) - 1)
        left, right = self._edges[which], self._edges[which + 1]
        return which[np.maximum(left - opening, closing - right) > right - left]

    @cached_property
    def ends(self) -> tuple[_Ends, ...]:
        """What is looked at one by one at both ends of :attr:`narrow` columns.

        First samples, then the blocks of each level below :attr:`top`.
        """
        which = self.narrow
        if not len(which):
            return ()
        begin, end = self.firsts[which], self.lasts[which]
        found = []
        for few in (UNIT, *[FACTOR] * self.top):
            found.append(_Ends.of(which, begin, end, few - 1))
            begin, end = -(-begin // few), end // few
        return tuple(found)

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
        which = np.flatnonzero(begin < end)
        return which, np.stack([begin[which], end[which]], axis=1).ravel()


def _found(times: Real, edges: Real) -> Whole:
    """The first sample at or after each edge, as :func:`numpy.searchsorted` has it.

    Of many stamps that are equally far apart it is computed and looked at, in a quarter of the time
    that a search takes.
    """
    n = len(times)
    if n < MANY:
        return np.searchsorted(times, edges).astype(np.int64)
    rate = (n - 1) / (times[-1] - times[0])
    guess = np.clip(np.ceil((edges - times[0]) * rate), 0, n).astype(np.int64)
    after = (guess == n) | (times.take(np.minimum(guess, n - 1)) >= edges)
    before = (guess == 0) | (times.take(np.maximum(guess - 1, 0)) < edges)
    wrong = np.flatnonzero(~(after & before))
    if len(wrong):
        guess[wrong] = np.searchsorted(times, edges[wrong])
    return guess
