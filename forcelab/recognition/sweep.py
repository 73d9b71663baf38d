"""Sweeps over all segmentations of a stretch of evidence, from its first step on.

With ``h_t(k)`` the score of the best segmentation (or the sum of all) of the steps before ``t``
whose last segment, of action k, ends at ``t``, and ``g_t(k)`` that of those after which k starts
at ``t``, both without the running sum ``C_t(k)`` of k's evidence,

    h_t(k) = max_d [ g_(t-d)(k) + F(k, d) ],
    g_t(k) = max_j [ h_t(j) + C_t(j) + follow(j, k) - C_t(k) ].

As no segment is shorter than some steps, so many steps are independent of each other and made at
once. Where F is a straight line, one maximum stands for all the starts that it is taken of: over a
block of long lengths, and beyond the tabulated lengths over all there are.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from forcelab.recognition.semimarkov import FINE, LENGTHS, Scores

__all__ = ["Algebra", "Best", "Sweep"]

Real = NDArray[np.float64]

#: Numbers handled at once, which stay in the processor's cache.
BLOCK = 2**16
#: Steps handled at once: between more of them sums would grow too far apart for one unit.
STEPS = 64
#: A table has so many lengths at least, so that what lies beyond is looked after seldom.
TABLE = 32
#: Actions have tables of their own where that saves so many additions at once.
WORTH = 10_000


class Algebra(Protocol):
    """How scores of several segmentations become one."""

    def windows(self, starts: Real, table: Real, out: Real) -> Real:
        """Join ``starts[k, t, :] + table[k]``: shape (k, m) of (k, m, W) and (k, W).

        Windows of neighbouring t overlap, mostly in all but one number.
        """
        ...

    def join(self, one: Real, other: Real, out: Real) -> Real:
        """Join two of the same shape."""
        ...

    def running(self, scores: Real) -> Real:
        """Join all up to each column."""
        ...

    def paths(self, follow: Real, sums: Real) -> Real:
        """What :meth:`follow` takes of times with the evidence `sums` (m, K): shape (m, ...)."""
        ...

    def follow(self, ends: Real, paths: Real) -> Real:
        """Join over the action before, j: ``ends[t, j] + paths[t, j, k]``, shape (m, K)."""
        ...


class Best:
    """The best of them."""

    def windows(self, starts: Real, table: Real, out: Real) -> Real:
        """The largest sums."""
        np.add(starts, table[:, None, :], out=out)
        return np.asarray(np.maximum.reduce(out, axis=-1))

    def join(self, one: Real, other: Real, out: Real) -> Real:
        """The larger."""
        return np.maximum(one, other, out=out)

    def running(self, scores: Real) -> Real:
        """The running maximum."""
        return np.maximum.accumulate(scores, axis=1)

    def paths(self, follow: Real, sums: Real) -> Real:
        """Shape (m, K, K)."""
        return np.asarray(sums[:, :, None] + follow - sums[:, None, :])

    def follow(self, ends: Real, paths: Real) -> Real:
        """The largest sums."""
        return np.asarray(np.maximum.reduce(ends[:, :, None] + paths, axis=1))


class _Group:
    """Neighbouring rows whose durations share a table; r of them."""

    def __init__(self, sweep: Sweep, rows: slice, block: int) -> None:
        scores, codes = sweep.scores, np.arange(rows.start, rows.stop)[:, None]
        self.rows = rows
        self.reach = max(int(scores.longest[rows].max()), TABLE)
        least = min(int(scores.shortest[rows].min()), FINE)
        lengths = np.arange(self.reach, least - 1, -1)
        self.table = scores.lasting(codes, lengths)
        self.open = scores.outlasting(codes, np.arange(self.reach, 0, -1))
        # The line that goes on where the table ends, through 0 steps.
        slope = scores.slope[rows][:, None]
        self.end = self.table[:, :1] - slope * self.reach
        self.open_end = self.open[:, :1] - slope * self.reach
        far = max(self.reach - FINE, 0)
        self.near = self.table[:, far:]
        self.windows = _windows(sweep.starts[rows, sweep.margin - self.reach + far :], self.near, 1)
        self.scratch = np.empty((len(codes), block, self.near.shape[1]))
        # Of each block of lengths, longest first, where its line goes through 0 steps.
        self.blocks = (self.table - slope * lengths)[:, :far:LENGTHS]
        levels = sweep.blocks[rows, sweep.margin - self.reach + LENGTHS - 1 :]
        self.far_windows = _windows(levels, self.blocks, LENGTHS) if far else None
        self.far_scratch = np.empty((len(codes), FINE if far else 0, self.blocks.shape[1]))


def _width(reach: int | NDArray[np.int64]) -> NDArray[np.int64]:
    """How many numbers tables up to some lengths hold."""
    return np.minimum(reach, FINE) + np.maximum(np.asarray(reach) - FINE, 0) // LENGTHS


def _windows(line: Real, table: Real, stride: int) -> Real:
    """What a table is added to at each place: shape (k, places, W), of every `stride`-th number."""
    near, far = line.strides
    count = line.shape[1] - stride * (table.shape[1] - 1)
    shape = (len(line), count, table.shape[1])
    return as_strided(line, shape, (near, far, stride * far), writeable=False)


class Sweep:
    """The scores of all segmentations of what was seen so far.

    Rows of its arrays are actions, in an order of its own; columns are the places between steps,
    from :attr:`base` on.

    Parameters
    ----------
    scores : Scores
    algebra : Algebra
    room : int
        Steps that it can hold; :meth:`forget` makes room for more.

    Attributes
    ----------
    order : ndarray of int64, shape (K,)
        The action in each row.
    scores : Scores
        In the order of the rows.
    now, base : int
        Steps seen, and how many of them are forgotten.
    sums : ndarray, shape (K, room + 1)
        C, the evidence before each place.
    ends : ndarray, shape (K, room + 1)
        h: of the action in the row that ends at the place.
    before : dict
        What was found to come before a segment, by its row and start, since places were forgotten.
    blocks : ndarray, shape (K, margin + room + 1)
        g less what the slope adds up to, of the place and those just before it joined.
    slope : ndarray, shape (K,)
        What each step beyond the tables adds.
    starts : ndarray, shape (K, margin + room + 1)
        g: of the action in the row that starts there; before the first place nothing starts, nor
        at it: what goes on from there is looked after apart.
    """

    def __init__(self, scores: Scores, algebra: Algebra, room: int) -> None:
        self._algebra = algebra
        self.order = np.argsort(scores.longest, kind="stable")
        self.scores = scores = scores.of_actions(self.order)
        K = len(self.order)
        self.now = self.base = 0
        self.margin = max(int(scores.longest.max()), TABLE)
        self.sums = np.zeros((K, room + 1))
        self.ends = np.full((K, room + 1), -np.inf)
        self.starts = np.full((K, self.margin + room + 1), -np.inf)
        self.before: dict[tuple[int, int], tuple[int, int]] = {}
        self.slope = scores.slope
        self._slope = self.slope[:, None]
        # Blocks of starts, made up to place `_blocked`.
        self.blocks = np.full_like(self.starts, -np.inf)
        self._blocked = 0
        # Of a first segment up to the margin; beyond, along the slope.
        lengths = np.arange(1, self.margin + 1)
        self._first = scores.start[:, None] + scores.outlasting(np.arange(K)[:, None], lengths)
        # The running maximum of starts, seen along the slope; made up to place `_run`.
        self._running = np.full((K, room + 1), -np.inf)
        self._run = 0
        steps = max(1, BLOCK // (K * int(_width(self.margin))))
        self._steps = min(int(scores.shortest.min()), STEPS, steps)
        self.groups = [_Group(self, rows, self._steps) for rows in self._split(slice(0, K))]

    def _split(self, rows: slice) -> list[slice]:
        """Part rows where tables of their own length are worth it."""
        width = _width(np.maximum(self.scores.longest[rows], TABLE))
        saved = (width[-1] - width) * np.arange(1, len(width) + 1) * self._steps
        best = int(saved.argmax())
        if saved[best] < WORTH:
            return [rows]
        cut = rows.start + best + 1
        return [*self._split(slice(rows.start, cut)), *self._split(slice(cut, rows.stop))]

    def push(self, evidence: Real) -> None:
        """Go on with the evidence of the next steps, shape (m, K), for which there is room."""
        place, m = self.now - self.base + 1, len(evidence)
        sums = self.sums[:, place : place + m]
        np.cumsum(evidence.T[self.order], axis=1, out=sums)
        sums += self.sums[:, place - 1 : place]
        self.ends[:, place : place + m] = self.first(self.now + 1, self.now + m + 1)
        self.now += m
        # What is made for many steps at once must stay small, too.
        part = min(BLOCK // len(self.order) ** 2, FINE) // self._steps * self._steps
        part = max(part, self._steps)
        for first in range(place, place + m, part):
            last = min(first + part, place + m)
            times = np.arange(self.base + first, self.base + last)
            line = self._slope * times
            paths = self._algebra.paths(self.scores.follow, self.sums[:, first:last].T)
            self._long(first, line)
            for done in range(0, last - first, self._steps):
                some = slice(done, min(done + self._steps, last - first))
                self._advance(first + done, line[:, some], paths[some])

    def _advance(self, place: int, line: Real, paths: Real) -> None:
        """Find all that ends, and starts, at `place` and the places after."""
        steps = len(paths)
        after = place + steps
        join = self._algebra.join
        for group in self.groups:
            ends = self.ends[group.rows, place:after]  # so far, that of a first segment
            windows = group.windows[:, place:after]
            found = self._algebra.windows(windows, group.near, group.scratch[:, :steps])
            join(ends, found, ends)
            last = after - 1 - group.reach
            if last > 1:
                if last > self._run:
                    self._run_on(place)
                early = max(place - group.reach - 1, 0)
                far = self._running[group.rows, early:last]
                ends = ends[:, steps - (last - early) :]
                join(ends, far + (group.end + line[group.rows, steps - (last - early) :]), ends)
        starts = self._algebra.follow(self.ends[:, place:after].T, paths)
        self.starts[:, self.margin + place : self.margin + after] = starts.T

    def _long(self, place: int, line: Real) -> None:
        """Find what has lasted more than `FINE` steps when it ends at `place` or soon after."""
        # All that can have begun so long before is known.
        after = place + line.shape[1]
        if after - FINE > self._blocked:
            self._block_on(place)
        for group in self.groups:
            if group.far_windows is None:
                continue
            windows = group.far_windows[:, place:after]
            found = self._algebra.windows(
                windows, group.blocks, group.far_scratch[:, : after - place]
            )
            ends = self.ends[group.rows, place:after]
            self._algebra.join(ends, found + line[group.rows], ends)

    def _block_on(self, place: int) -> None:
        """Join the levels of each block of starts whose last lies before `place`."""
        found, reach = self.level(slice(None), self._blocked - LENGTHS + 1, place), 1
        while reach < LENGTHS:
            one, other = found[:, reach:], found[:, :-reach]
            found, reach = self._algebra.join(one, other, np.empty_like(one)), 2 * reach
        self.blocks[:, self.margin + self._blocked : self.margin + place] = found
        self._blocked = place

    def _run_on(self, place: int) -> None:
        """Make the running maximum up to, not including, `place`."""
        before = max(self._run - 1, 0)
        fresh = slice(self._run, place)
        self._running[:, fresh] = self.level(slice(None), self._run, place)
        self._running[:, before:place] = self._algebra.running(self._running[:, before:place])
        self._run = place

    def level(self, rows: slice | int, first: int, last: int) -> Real:
        """Starts at some places less what the slope adds up to then."""
        times = np.arange(self.base + first, self.base + last)
        starts = self.starts[rows, self.margin + first : self.margin + last]
        return np.asarray(starts - self._slope[rows] * times)

    def far(self, rows: slice | int, place: int) -> Real:
        """The running maximum at a place."""
        if place >= self._run:
            self._run_on(place + 1)
        return np.asarray(self._running[rows, place])

    def first(self, begin: int, end: int) -> Real:
        """The score of a first segment that ends at each time from `begin` on; (K, end - begin)."""
        if end <= self.margin + 1:
            return self._first[:, begin - 1 : end - 1]
        times = np.arange(begin, end)
        known = np.minimum(times, self.margin)
        return np.asarray(self._first[:, known - 1] + self._slope * (times - known))

    @property
    def room(self) -> int:
        """How many more steps it can hold."""
        return self.ends.shape[1] - 1 - (self.now - self.base)

    def forget(self, kept: int) -> None:
        """Make room: keep the last so many places only, which must hold every window."""
        places = self.now - self.base - kept
        if places <= 0:
            return
        self._run_on(self.now - self.base)
        self._block_on(self.now - self.base)
        self.before.clear()
        for line in (self.sums, self.ends, self.starts, self.blocks, self._running):
            line[:, :-places] = line[:, places:].copy()
        self._run -= places
        self._blocked -= places
        self.base += places
