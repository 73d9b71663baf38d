"""Sweeps over all segmentations of a stretch of evidence, from its first step on.

With ``h_t(k)`` the score of the best segmentation (or the sum of all) of the steps before ``t``
whose last segment, of action k, ends at ``t``, and ``g_t(k)`` that of those after which k starts
at ``t``, both without the running sum ``C_t(k)`` of k's evidence,

    h_t(k) = max_d [ g_(t-d)(k) + F(k, d) ],
    g_t(k) = max_j [ h_t(j) + C_t(j) + follow(j, k) - C_t(k) ] + change_t.

As no segment is shorter than some steps, so many steps are independent of each other and made at
once. Of the best segmentation more steps are: first as if no segment began and ended among them,
then with those that do, over and over until nothing becomes better, which is soon: hardly ever do
several of the shortest segments follow each other. Where F is a straight line, one maximum stands
for all the starts that it is taken of: over a block of long lengths, and beyond the tabulated
lengths over all there are.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from forcelab.recognition.joining import Algebra
from forcelab.recognition.semimarkov import FINE, LENGTHS, Scores

__all__ = ["Sweep"]

Real = NDArray[np.float64]

#: Numbers handled at once, which stay in the processor's cache.
BLOCK = 2**16
#: Steps handled at once: between more of them sums would grow too far apart for one unit.
STEPS = 64
#: A table has so many lengths at least, so that what lies beyond is looked after seldom; no fewer
#: than steps are found at once by repetition.
TABLE = 32
#: Actions have tables of their own where that saves so many additions at once.
WORTH = 10_000


class _Group:
    """Neighbouring rows whose durations share a table; r of them."""

    def __init__(self, sweep: Sweep, rows: slice, block: int, algebra: Algebra) -> None:
        scores, codes = sweep.scores, np.arange(rows.start, rows.stop)[:, None]
        self.rows = rows
        self.reach = max(int(scores.longest[rows].max()), TABLE)
        least = min(int(scores.shortest[rows].min()), FINE)
        lengths = np.arange(self.reach, least - 1, -1)
        self.table = scores.lasting(codes, lengths)
        self.open = sweep.outlasting[rows, self.reach - 1 :: -1]
        # The line that goes on where the table ends, through 0 steps.
        slope = scores.slope[rows][:, None]
        self.end = self.table[:, :1] - slope * self.reach
        self.open_end = self.open[:, :1] - slope * self.reach
        far = max(self.reach - FINE, 0)
        near = self.table[:, far:]
        self.near = algebra.table(near)
        self.line = sweep.starts[rows, sweep.margin - self.reach + far :]
        self.windows = _windows(self.line, near, 1)
        self.scratch = np.empty((len(codes), block, near.shape[1]))
        # Lengths that may begin and end within a block of steps.
        self.least = least
        width = max(block - least, 0)
        self.short = algebra.table(near[:, -width:]) if width else None
        # Neighbours in memory are the places, as they are in what is added.
        self.short_scratch = np.empty((width, len(codes), width)).transpose(1, 2, 0)
        # Of each block of lengths, longest first, where its line goes through 0 steps.
        blocks = (self.table - slope * lengths)[:, :far:LENGTHS]
        self.blocks = algebra.table(blocks) if far else None
        self.far_line = sweep.blocks[rows, sweep.margin - self.reach + LENGTHS - 1 :]
        self.far_windows = _windows(self.far_line, blocks, LENGTHS) if far else self.windows
        scratch = np.empty((blocks.shape[1], len(codes), FINE if far else 0))
        self.far_scratch = scratch.transpose(1, 2, 0)


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
    whole : ndarray, shape (K,)
        The score of a first segment that ends now, without evidence.
    outlasting : ndarray, shape (K, margin)
        S, of 1, 2, ... steps.
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
        # What a change scores at each place, beside what follows what; asked for while it is new.
        self._changes = np.zeros(room + 1)
        self.starts = np.full((K, self.margin + room + 1), -np.inf)
        self.before: dict[tuple[int, int], tuple[int, int]] = {}
        self.slope = scores.slope
        self._slope = self.slope[:, None]
        # Blocks of starts, made up to place `_blocked`.
        self.blocks = np.full_like(self.starts, -np.inf)
        self._blocked = 0
        # Of a first segment up to the margin; beyond, along the slope.
        lengths = np.arange(1, self.margin + 1)
        self.outlasting = scores.outlasting(np.arange(K)[:, None], lengths)
        self._first = scores.start[:, None] + self.outlasting
        self.whole = np.full(K, -np.inf)
        # The running maximum of starts, seen along the slope; made up to place `_run`.
        self._running = np.full((K, room + 1), -np.inf)
        self._run = 0
        self._least = int(scores.shortest.min())
        steps = max(1, BLOCK // (K * int(_width(self.margin))))
        alone = max(self._least, TABLE) if algebra.repeats else self._least
        self._steps = min(alone, STEPS, steps)
        self._order = algebra.order(scores.follow)
        parts = self._split(slice(0, K))
        self.groups = [_Group(self, rows, self._steps, algebra) for rows in parts]
        # Of so many at once all that has lasted long is known.
        self._part = min(FINE, self.groups[0].reach) // self._steps * self._steps

    def _split(self, rows: slice) -> list[slice]:
        """Part rows where tables of their own length are worth it."""
        width = _width(np.maximum(self.scores.longest[rows], TABLE))
        saved = (width[-1] - width) * np.arange(1, len(width) + 1) * self._steps
        best = int(saved.argmax())
        if saved[best] < WORTH:
            return [rows]
        cut = rows.start + best + 1
        return [*self._split(slice(rows.start, cut)), *self._split(slice(cut, rows.stop))]

    def push(self, evidence: Real, changes: Real | None = None) -> None:
        """Go on with the next steps, for which there is room.

        Parameters
        ----------
        evidence : ndarray, shape (m, K)
        changes : ndarray, shape (m,), optional
            What a change of actions scores right after each of them; nothing by default.
        """
        place, m = self.now - self.base + 1, len(evidence)
        self._changes[place : place + m] = 0.0 if changes is None else changes
        sums = self.sums[:, place : place + m]
        np.add.accumulate(evidence.T[self.order], axis=1, out=sums)
        sums += self.sums[:, place - 1 : place]
        whole = self.first(self.now + 1, self.now + m + 1)
        self.ends[:, place : place + m] = whole
        self.whole = whole[:, -1]
        self.now += m
        for first in range(place, place + m, self._part):
            last = min(first + self._part, place + m)
            line = self._slope * np.arange(self.base + first, self.base + last)
            self._long(first, line)
            for begin in range(first, last, self._steps):
                self._advance(begin, min(begin + self._steps, last))

    def _advance(self, place: int, after: int) -> None:
        """Find all that ends, and starts, from `place` on and before `after`."""
        algebra = self._algebra
        for group in self.groups:
            ends = self.ends[group.rows, place:after]  # so far, those that have lasted long
            windows = group.windows[:, place:after]
            found = algebra.windows(
                group.line[:, place : after + windows.shape[2] - 1],
                windows,
                group.near,
                group.scratch[:, : after - place],
            )
            algebra.join(ends, found, ends)
        self._follow(place, after)
        # A segment that begins and ends among them, two in a row and so on, end so much later at
        # least; until then nothing can have become better.
        for begin in range(place + self._least, after, self._least):
            if not self._short(begin, after):
                break
            self._follow(begin, after)

    def _follow(self, place: int, after: int) -> None:
        """Find all that starts there."""
        found = self._algebra.follow(
            self.ends[:, place:after], self.sums[:, place:after], self._order
        )
        found += self._changes[place:after]
        self.starts[:, self.margin + place : self.margin + after] = found

    def _short(self, place: int, after: int) -> bool:
        """Find what is short and ends there; whether anything becomes better by it."""
        better = False
        for group in self.groups:
            begin = place + group.least - self._least
            if begin >= after:
                continue
            ends = self.ends[group.rows, begin:after]
            width = self._steps - group.least
            windows = group.windows[:, begin:after, -width:]
            skipped = begin + group.windows.shape[2] - width
            line = group.line[:, skipped : skipped + after - begin + width - 1]
            scratch = group.short_scratch[:, : after - begin]
            found = self._algebra.windows(line, windows, group.short, scratch)
            if np.greater(found, ends).any():
                self._algebra.join(ends, found, ends)
                better = True
        return better

    def _long(self, place: int, line: Real) -> None:
        """Find what has lasted more than `FINE` steps when it ends at `place` or soon after."""
        # All that can have begun so long before is known.
        after, join = place + line.shape[1], self._algebra.join
        if after - FINE > self._blocked:
            self._block_on(place)
        for group in self.groups:
            ends = self.ends[group.rows, place:after]
            if group.blocks is not None:
                windows = group.far_windows[:, place:after]
                span = after - place + LENGTHS * (windows.shape[2] - 1)
                found = self._algebra.windows(
                    group.far_line[:, place : place + span],
                    windows,
                    group.blocks,
                    group.far_scratch[:, : after - place],
                )
                join(ends, found + line[group.rows], ends)
            last = after - 1 - group.reach
            if last > 1:
                if last > self._run:
                    self._run_on(place)
                early = max(place - group.reach - 1, 0)
                ends = ends[:, early - last :]
                far = self._running[group.rows, early:last] + group.end
                far += line[group.rows, early - last :]
                join(ends, far, ends)

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
        known = self._first[:, begin - 1 : self.margin]
        beyond = np.arange(max(begin - self.margin, 1), end - self.margin)
        found = self._first[:, -1:] + self._slope * beyond
        return np.concatenate([known, found], axis=1) if known.shape[1] else found

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
        # Nothing starts yet at the places to come.
        self.starts[:, -places:] = -np.inf
        self._run -= places
        self._blocked -= places
        self.base += places
