"""The semi-Markov decoder: the most probable sequence of actions, and its marginals.

A segmentation of the steps ``0 .. n`` into segments, neighbours of different actions, scores

    start(k_1) + S(k_1, d_1) + sum_i [ follow(k_i, k_i+1) + F(k_i, d_i) ] + S(k_m, d_m)
        + sum_t evidence(t, action at t) + sum of change(t) wherever the action changes,

the first and the last segment cut off by the ends of the recording: of them is known only that they
last at least so long, S, and of the ones between how long they last, F. Both are log-normal up to a
length that is longer than nearly all, and fall by the same share a step from there on: so nothing
is too long to be, and a step costs no more the longer the recording is. Segments of many steps are
told apart in blocks of lengths, the middle one of which gives a block its height; within a block F
falls as it does at the end. All else is exact.

A forward pass covers all segmentations of a stretch of evidence, from its first step on. With
``h_t(k)`` the score of the best segmentation (or the sum of all) of the steps before ``t`` whose
last segment, of action k, ends at ``t``, and ``g_t(k)`` that of those after which k starts at
``t``, both without the running sum ``C_t(k)`` of k's evidence,

    h_t(k) = max_d [ g_(t-d)(k) + F(k, d) ],
    g_t(k) = max_j [ h_t(j) + C_t(j) + follow(j, k) - C_t(k) ] + change_t.

As no segment is shorter than some steps, so many steps are independent of each other and computed
at once. Of the best segmentation more steps are: first as if no segment began and ended among them,
then with those that do, over and over until nothing becomes better, which is soon: hardly ever do
several of the shortest segments follow each other. Where F is a straight line, one maximum stands
for all the starts that it is taken of: over a block of long lengths, and beyond the tabulated
lengths over all there are. The cost is one addition and one maximum for each step, action and
duration that is considered.

Sources: Yu, "Hidden semi-Markov models", Artificial Intelligence 174, 2010. Guédon, "Estimating
hidden semi-Markov chains from discrete sequences", J. Comput. Graph. Stat. 12, 2003: segments cut
off by the ends of what was recorded.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Literal, Protocol

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.labels import UNLABELLED
from forcelab.recognition.task_grammar import TaskGrammar

Real = NDArray[np.float64]

#: Stands for minus infinity where that cannot be subtracted.
SMALLEST = -1e300
#: Logarithms whose exponentials may stand beside each other: of more the smallest were lost.
RANGE = 600.0
#: Sums below this may have lost some.
TINY = 1e-250


class Semiring(Protocol):
    """Joins the scores of several segmentations into one; k rows, of actions.

    `repeats` says whether joining a score twice counts once, so that steps may be found by
    repetition.
    """

    #: Steps that may be found at once by repetition; 1 where joining a score twice counts twice
    repeats: bool

    def table(self, scores: Real) -> Any:
        """Scores by length (k, W), prepared for :meth:`windows`."""
        ...

    def windows(self, line: Real, strided: Real, table: Any, out: Real) -> Real:
        """Join ``strided[k, t, :] + table[k]``: shape (k, m).

        `strided` (k, m, W) are windows of the numbers `line` (k, n), each begun one number after
        the one before; `out` (k, m, W) is overwritten.
        """
        ...

    def join(self, first: Real, second: Real, out: Real) -> Real:
        """Join two of the same shape."""
        ...

    def running(self, scores: Real) -> Real:
        """Join all up to each column."""
        ...

    def order(self, follow: Real) -> Any:
        """Scores of the order of actions (K, K), prepared for :meth:`follow`."""
        ...

    def follow(self, ends: Real, sums: Real, order: Any) -> Real:
        """Join over the action before, j: ``ends[j] + sums[j] + follow[j, k] - sums[k]``.

        Shapes (K, m), as is the result's.
        """
        ...


class MaxPlus:
    """The best of them."""

    repeats = True

    def table(self, scores: Real) -> Real:
        """One to be added to windows."""
        return scores[:, None, :]

    def windows(self, line: Real, strided: Real, table: Real, out: Real) -> Real:  # noqa: ARG002
        """The largest sums."""
        np.add(strided, table, out=out)
        return np.asarray(np.maximum.reduce(out, axis=2))

    def join(self, first: Real, second: Real, out: Real) -> Real:
        """The larger."""
        return np.maximum(first, second, out=out)

    def running(self, scores: Real) -> Real:
        """The running maximum."""
        return np.maximum.accumulate(scores, axis=1)

    def order(self, follow: Real) -> Real:
        """Shape (K, K, 1)."""
        return follow[:, :, None]

    def follow(self, ends: Real, sums: Real, order: Real) -> Real:
        """The largest sums."""
        found: Real = np.maximum.reduce((ends + sums)[:, None, :] + order, axis=0)
        found -= sums
        return found


class LogSumExp:
    """The sum of them, as a logarithm."""

    repeats = False

    def table(self, scores: Real) -> tuple[Real, Real, Real]:
        """The scores, their exponentials and the logarithms that these are relative to."""
        top = np.maximum(scores.max(axis=1, keepdims=True), SMALLEST)
        return scores, np.exp(scores - top), top

    def windows(self, line: Real, strided: Real, table: tuple[Real, Real, Real], out: Real) -> Real:
        """Logarithms of sums of exponentials."""
        scores, raised, top = table
        # Windows overlap: each number is raised once, relative to the largest of them all.
        unit = np.maximum(np.maximum.reduce(line, axis=1, keepdims=True), SMALLEST)
        below = line - unit
        every = np.exp(below)
        across = every.strides[1]
        stride = strided.strides[2] // strided.strides[1]
        strides = (every.strides[0], across, stride * across)
        windows = np.ndarray(strided.shape, every.dtype, every, 0, strides)
        sums = np.einsum("kmw,kw->km", windows, raised)
        if sums.min() < TINY and _underflows(below):
            return self._apart(strided, scores, out)
        with np.errstate(divide="ignore"):
            np.log(sums, out=sums)
        sums += unit + top
        return np.asarray(sums)

    def _apart(self, strided: Real, scores: Real, out: Real) -> Real:
        """The same for numbers too far apart for one unit."""
        np.add(strided, scores[:, None, :], out=out)
        unit = np.maximum(out.max(axis=2, keepdims=True), SMALLEST)
        out -= unit
        np.exp(out, out=out)
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(out.sum(axis=2)) + unit[:, :, 0])

    def join(self, first: Real, second: Real, out: Real) -> Real:
        """The logarithm of the sum."""
        return np.logaddexp(first, second, out=out)

    def running(self, scores: Real) -> Real:
        """Running sums."""
        return np.logaddexp.accumulate(scores, axis=1)

    def order(self, follow: Real) -> tuple[Real, Real]:
        """The logarithms, shape (K, K, 1), and from the column's to the row's action themselves."""
        return follow[:, :, None], np.exp(follow).T.copy()

    def follow(self, ends: Real, sums: Real, order: tuple[Real, Real]) -> Real:
        """Logarithms of sums of exponentials."""
        logs, matrix = order
        before = ends + sums
        unit = np.maximum(np.maximum.reduce(before, axis=0), SMALLEST)
        below = before - unit
        found = matrix @ np.exp(below)
        if found.min() < TINY and _underflows(below):
            every = before[:, None, :] + logs
            unit = np.maximum(every.max(axis=0), SMALLEST)
            found = np.exp(every - unit).sum(axis=0)
        with np.errstate(divide="ignore"):
            np.log(found, out=found)
        found += unit
        found -= sums
        return np.asarray(found)


def _underflows(below: Real) -> bool:
    """Whether logarithms are so small that their exponentials count for nothing by mistake."""
    return bool(((below < -RANGE) & (below > SMALLEST)).any())


#: How much of the choreography is used.
Use = Literal["none", "durations", "order"]

#: Seconds of the step at which the weights are meant; at other steps they are converted, so that
#: finer steps, whose evidence is nearly the same twice, decide no differently.
STEP = 0.02
#: Seconds over which a duration's density is taken for a probability: shorter would make each
#: boundary dearer. From 0.02 to 0.5 s the order hides the difference; durations alone gain by it.
UNIT = 0.5
#: A segment is at least so long, as a share of the median of its action; at least one `STEP`.
SHORTEST = 1 / 8
#: Up to so many sd above the mean of the logarithms durations are log-normal.
LOG_NORMAL = 2.0
#: Such lengths are rounded up to powers of this number of steps, so that actions share tables.
ROUNDING = math.sqrt(2.0)
#: Up to so many steps each length is told apart; from there on so many at once, 6 % or less. At
#: the presets' 20 ms that begins at 2.6 s.
FINE, LENGTHS = 128, 8
#: Exponent of the probabilities of one 20 ms step. Neighbouring steps say nearly the same: 1 would
#: count it many times over.
EVIDENCE = 0.25
#: Exponent of the share of time of each action, by which probabilities are divided.
PRIOR = 0.5
#: Exponent of a duration's probability.
DURATION = 0.7
#: What a change of action costs, in nats, where neither durations nor order are used.
SWITCH = 1.0
#: Smallest probability, relative to the step's largest, that the classifier is believed.
FLOOR = 1e-3
#: Exponent of how much likelier than usual a change is to be near, where that is known (a
#: classifier of few demonstrations is less sure than it might be), and how much likelier it must
#: be, in nats: of a few places near a change the best is taken.
CHANGE, LIKELIER = 1.5, 0.5


@dataclass(frozen=True, eq=False)
class HsmmParameters:
    """The model's parameters at one step length; K actions, all logarithms in nats."""

    step: float  # seconds
    prior: Real  # (K,); what is taken off the log probabilities
    start: Real  # (K,)
    #: (K, K); from the row's action to the column's; minus infinity from an action to itself
    follow: Real
    #: mean, sd: (K,); of the logarithm of durations in seconds
    mean: Real
    sd: Real
    emphasis: float  # exponent of durations; 0 leaves them out
    #: shortest, longest: (K,); fewest steps of a whole segment, and the steps up to which durations
    #: are log-normal
    shortest: NDArray[np.int64]
    longest: NDArray[np.int64]

    @classmethod
    def from_grammar(cls, grammar: TaskGrammar, step: float, use: Use) -> HsmmParameters:
        """The parameters of a grammar at `step` seconds; "order" uses durations as well."""
        if not (step > 0 and math.isfinite(step)):
            raise InputError(f"The decoder's step must be longer than 0 s, not {step} s.")
        if use not in ("none", "durations", "order"):
            raise InputError(f"The decoder uses none, durations or order, not '{use}'.")
        K = len(grammar.actions)
        least = max(1, round(STEP / step))
        shortest = np.full(K, least)
        longest = shortest
        if use != "none":
            usual = SHORTEST * np.exp(grammar.mean) / step
            shortest = np.maximum(shortest, np.minimum(usual, 2**31).astype(np.int64))
            limit = np.exp(grammar.mean + LOG_NORMAL * grammar.sd) / step
            powers = np.ceil(np.log(np.clip(limit, 1.0, 2.0**31)) / math.log(ROUNDING))
            longest = np.maximum(shortest, np.ceil(ROUNDING**powers).astype(np.int64))
            # Whole blocks only: none is partly too short, and a table ends with one.
            shortest -= np.where(shortest > FINE, (shortest - FINE - 1) % LENGTHS, 0)
            blocks = -(-np.maximum(longest - FINE, 0) // LENGTHS)
            longest = np.where(blocks > 0, FINE + LENGTHS * blocks, longest)
        start = np.full(K, -math.log(max(K, 1)))
        follow = np.full((K, K), -SWITCH if use == "none" else -math.log(max(K - 1, 1)))
        if use == "order":
            with np.errstate(divide="ignore"):
                start, follow = np.log(grammar.start), np.log(grammar.follow)
        np.fill_diagonal(follow, -np.inf)
        return cls(
            step,
            PRIOR * np.log(grammar.share),
            start,
            follow,
            grammar.mean,
            grammar.sd,
            0.0 if use == "none" else DURATION,
            shortest,
            longest,
        )

    def evidence(self, log_probabilities: NDArray[np.floating]) -> Real:
        """The score of each step for each action, shape (n, K) as `log_probabilities`; finite.

        Only differences within a step count. A step that rules out every action says nothing.
        """
        logs = np.asarray(log_probabilities, dtype=np.float64)
        top = np.maximum.reduce(logs, axis=1, keepdims=True)
        says = np.isfinite(top)
        every = bool(says.all())
        if not every:
            top, logs = np.where(says, top, 0.0), np.where(says, logs, 0.0)
        below = np.maximum(logs - top, math.log(FLOOR))
        # Steps longer than it takes evidence to be new count once each.
        exponent = min(1.0, EVIDENCE * self.step / STEP)
        below -= self.prior
        below *= exponent
        if not every:
            below[~says[:, 0]] = 0.0
        return below

    def changing(self, ratios: NDArray[np.floating]) -> Real:
        """The score of a change of actions right after each step, given log ratios (n,).

        Zero where durations are not used, as nothing else keeps an action from flickering there.
        """
        above = np.asarray(ratios, dtype=np.float64) - LIKELIER
        scores = (CHANGE if self.emphasis else 0.0) * above
        # After the last one none is left to change to.
        return np.append(0.5 * (scores[:-1] + scores[1:]), 0.0)

    @property
    def slope(self) -> Real:
        """Score of each step beyond the longest, shape (K,); never positive."""
        seconds = self.longest * self.step
        z = (np.log(seconds) - self.mean) / self.sd
        fall = -(1.0 + z / self.sd) / self.longest
        return self.emphasis * np.minimum(fall, 0.0)

    def lasting(self, code: int | NDArray[np.int64], steps: NDArray[np.int64]) -> Real:
        """F: log probability that a segment lasts so many steps (>= 1); shapes broadcast."""
        table = np.minimum(steps, self.longest[code])
        within = (table - FINE - 1) % LENGTHS
        table = np.where(table > FINE, table - within + LENGTHS // 2, table)
        logs = np.log(table * self.step)
        z = (logs - self.mean[code]) / self.sd[code]
        density = -0.5 * z**2 - logs - np.log(math.sqrt(2 * math.pi) * self.sd[code] / UNIT)
        scores = self.emphasis * density + self.slope[code] * (steps - table)
        return np.where(steps >= self.shortest[code], scores, -np.inf)

    def outlasting(self, code: int | NDArray[np.int64], steps: NDArray[np.int64]) -> Real:
        """S: log probability that a segment lasts so many steps or more; shapes broadcast."""
        from scipy.special import log_ndtr

        table = np.minimum(steps, self.longest[code])
        z = (np.log(table * self.step) - self.mean[code]) / self.sd[code]
        return self.emphasis * log_ndtr(-z) + self.slope[code] * (steps - table)

    def per_place(self) -> HsmmParameters:
        """The parameters for sums over all places of a boundary, of which finer steps have more."""
        return replace(self, follow=self.follow + math.log(self.step / STEP))

    def anywhere(self) -> HsmmParameters:
        """The parameters of a stretch that does not begin with its demonstration."""
        return replace(self, start=np.full_like(self.start, -math.log(len(self.start))))

    def of_actions(self, order: NDArray[np.int64]) -> HsmmParameters:
        """The parameters with the actions in another order."""
        return replace(
            self,
            prior=self.prior[order],
            start=self.start[order],
            follow=self.follow[np.ix_(order, order)],
            mean=self.mean[order],
            sd=self.sd[order],
            shortest=self.shortest[order],
            longest=self.longest[order],
        )

    def reversed(self) -> HsmmParameters:
        """The parameters of time that runs backwards, from after the last step."""
        return replace(self, follow=self.follow.T.copy(), start=np.zeros_like(self.start))


#: Numbers handled at once, which stay in the processor's cache.
BLOCK = 2**16
#: Steps handled at once: between more of them sums would grow too far apart for one unit.
STEPS = 64
#: A table has so many lengths at least, so that what lies beyond is looked after seldom; no fewer
#: than steps are found at once by repetition.
TABLE = 32
#: Actions have tables of their own where that saves so many additions at once.
WORTH = 10_000


class _ActionGroup:
    """Neighbouring rows whose durations share a table; r of them."""

    def __init__(self, sweep: ForwardPass, rows: slice, block: int, algebra: Semiring) -> None:
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
    """Number of entries of a table up to some length."""
    return np.minimum(reach, FINE) + np.maximum(np.asarray(reach) - FINE, 0) // LENGTHS


def _windows(line: Real, table: Real, stride: int) -> Real:
    """Every `stride`-th number before each place, to which a table is added: (k, places, W)."""
    near, far = line.strides
    count = line.shape[1] - stride * (table.shape[1] - 1)
    shape = (len(line), count, table.shape[1])
    return as_strided(line, shape, (near, far, stride * far), writeable=False)


class ForwardPass:
    """The scores of all segmentations of the steps so far; :meth:`forget` makes room for more.

    Rows of its arrays are actions, in an order of its own; columns are the places between steps,
    from `base` on: `sums` is C, `ends` h, `starts` g and `outlasting` S of the module's docstring.
    """

    def __init__(self, scores: HsmmParameters, algebra: Semiring, room: int) -> None:
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
        self.groups = [_ActionGroup(self, rows, self._steps, algebra) for rows in parts]
        # Of so many at once all that has lasted long is known.
        self._part = min(FINE, self.groups[0].reach) // self._steps * self._steps

    def _split(self, rows: slice) -> list[slice]:
        """Split rows where tables of their own length are worth it."""
        width = _width(np.maximum(self.scores.longest[rows], TABLE))
        saved = (width[-1] - width) * np.arange(1, len(width) + 1) * self._steps
        best = int(saved.argmax())
        if saved[best] < WORTH:
            return [rows]
        cut = rows.start + best + 1
        return [*self._split(slice(rows.start, cut)), *self._split(slice(cut, rows.stop))]

    def push(self, evidence: Real, changes: Real | None = None) -> None:
        """Take evidence (m, K) and scores of changes (m,) of steps for which there is room."""
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
            first, second = found[:, reach:], found[:, :-reach]
            found, reach = self._algebra.join(first, second, np.empty_like(first)), 2 * reach
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
        """Number of further steps that it can hold."""
        return self.ends.shape[1] - 1 - (self.now - self.base)

    def forget(self, count: int) -> None:
        """Make room: keep the last `count` places only, which must hold every window."""
        places = self.now - self.base - count
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


Codes = NDArray[np.int64]


def decode(
    log_probabilities: NDArray[np.floating],
    valid: NDArray[np.bool_],
    step: float,
    grammar: TaskGrammar,
    use: Use = "order",
    changes: NDArray[np.floating] | None = None,
) -> Codes:
    """The best sequence of actions: codes (n,) of log probabilities (n, K).

    A constant added to a step changes nothing. Unlabelled in gaps (not `valid`) and where a step
    holds no number; what lies between two gaps is decoded by itself. `step` is in seconds; 0.02 is
    fine enough. `use` says how much of the grammar counts: "none" but a cost of changes,
    "durations", or with the "order" also which action follows which and how demonstrations start.
    `changes` (n,) are finite log ratios in nats of how much likelier than usual a change is near;
    they count for nothing with "none". Of equally good sequences it is always the same one.
    """
    codes = np.full(len(log_probabilities), UNLABELLED, dtype=np.int64)
    for part, scores, evidence, after in prepare_runs(
        log_probabilities, valid, step, grammar, use, changes
    ):
        sweep = ForwardPass(scores, MaxPlus(), len(evidence))
        sweep.push(evidence, after)
        codes[part] = best_codes(sweep, len(evidence))
    return codes


def prepare_runs(
    log_probabilities: NDArray[np.floating],
    valid: NDArray[np.bool_],
    step: float,
    grammar: TaskGrammar,
    use: Use,
    changes: NDArray[np.floating] | None,
) -> Iterator[tuple[slice, HsmmParameters, Real, Real | None]]:
    """Each stretch without a gap: its steps, the model, its evidence and its scores of changes."""
    valid = decodable_steps(log_probabilities, valid, grammar)
    if not valid.any():
        return
    scores = HsmmParameters.from_grammar(grammar, step, use)
    for first, last in true_runs(valid):
        yield (
            slice(first, last),
            scores if first == 0 else scores.anywhere(),
            scores.evidence(log_probabilities[first:last]),
            None if changes is None else scores.changing(changes[first:last]),
        )


def decodable_steps(
    log_probabilities: NDArray[np.floating], valid: NDArray[np.bool_], grammar: TaskGrammar
) -> NDArray[np.bool_]:
    """Where there is something to decode, shape (n,); steps that hold no number are gaps."""
    K = len(grammar.actions)
    shape = np.shape(log_probabilities)
    if len(shape) != 2 or shape[1] != K:
        raise InputError(
            f"The decoder knows {K} actions but was given probabilities of shape {shape}; train "
            "the recogniser again."
        )
    if np.shape(valid) != shape[:1]:
        raise InputError(
            f"{shape[0]} steps have probabilities but {len(valid)} are marked valid or not; give "
            "one mark for each step."
        )
    if K == 0:
        return np.zeros(shape[0], dtype=np.bool_)
    missing = np.isnan(log_probabilities)
    return np.asarray(valid & ~missing.any(axis=1) if missing.any() else valid, dtype=np.bool_)


def true_runs(valid: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last (excluded) step of each stretch without a gap."""
    if valid.all():
        return [(0, len(valid))] if len(valid) else []
    edges = np.flatnonzero(np.diff(valid.astype(np.int8), prepend=0, append=0))
    return [(int(first), int(last)) for first, last in edges.reshape(-1, 2)]


def best_codes(sweep: ForwardPass, last: int) -> Codes:
    """Codes of the `last` most recent steps of a best forward pass, as if it ended now."""
    codes = np.empty(last, dtype=np.int64)
    begin, end = sweep.now - last, sweep.now
    row, start = _last_segment(sweep)
    while True:
        codes[max(start - begin, 0) : end - begin] = sweep.order[row]
        if start <= begin:
            return codes
        end = start
        row, start = _previous_segment(sweep, row, start)


def best_code(sweep: ForwardPass, ago: int) -> int:
    """The code of the step that came so many steps ago, 0 being the last, as if it ended now."""
    step = sweep.now - 1 - ago
    row, start = _last_segment(sweep)
    while start > step:
        row, start = _previous_segment(sweep, row, start)
    return int(sweep.order[row])


def _last_segment(sweep: ForwardPass) -> tuple[int, int]:
    """Row and start of the segment that goes on at the last step."""
    now, place = sweep.now, sweep.now - sweep.base
    sums = sweep.sums[:, place]
    whole = sweep.whole + sums
    row = int(whole.argmax())
    found, start = float(whole[row]), 0
    for group in sweep.groups:
        begin = sweep.margin + place - group.reach
        near = sweep.starts[group.rows, begin : sweep.margin + place] + group.open
        near += sums[group.rows, None]
        best = int(near.argmax())
        if near.flat[best] > found:
            found = float(near.flat[best])
            row, start = divmod(best, group.reach)
            row, start = row + group.rows.start, start + now - group.reach
        last = place - group.reach - 1
        if last > 0:
            slope = sweep.slope[group.rows] * now
            far = sweep.far(group.rows, last) + group.open_end[:, 0] + slope + sums[group.rows]
            best = int(far.argmax())
            if far[best] > found:
                found, row = float(far[best]), best + group.rows.start
                start = _far_start(sweep, row, last)
    return row, start


def _previous_segment(sweep: ForwardPass, row: int, start: int) -> tuple[int, int]:
    """Row and start of the segment before the one in `row` that starts at `start`, remembered."""
    # What comes later changes nothing about it, and a stream asks again at every step.
    known = sweep.before.get((row, start))
    if known is None:
        known = sweep.before[row, start] = _find_previous_segment(sweep, row, start)
    return known


def _find_previous_segment(sweep: ForwardPass, row: int, start: int) -> tuple[int, int]:
    """Row and start of the segment before, computed."""
    place = start - sweep.base
    scores = sweep.scores
    ends = sweep.ends[:, place] + sweep.sums[:, place]
    row = int((ends + scores.follow[:, row]).argmax())
    group = next(group for group in sweep.groups if row < group.rows.stop)
    table = group.table[row - group.rows.start]
    begin = sweep.margin + place - group.reach
    near = sweep.starts[row, begin : begin + len(table)] + table
    best = int(near.argmax())
    found, began = float(near[best]), start - group.reach + best
    last = place - group.reach - 1
    if last > 0:
        end = float(group.end[row - group.rows.start, 0] + sweep.slope[row] * start)
        if sweep.far(row, last) + end > found:
            found, began = float(sweep.far(row, last)) + end, _far_start(sweep, row, last)
    first = sweep.first(start, start + 1)[row, 0]
    return row, 0 if first >= found else began


def _far_start(sweep: ForwardPass, row: int, last: int) -> int:
    """The best start at place `last` or before; what is forgotten counts as its last step."""
    level = sweep.level(row, 0, last + 1)
    best = int(level.argmax())
    return sweep.base + (best if level[best] >= sweep.far(row, last) else 0)


def marginals(
    log_probabilities: NDArray[np.floating],
    valid: NDArray[np.bool_],
    step: float,
    grammar: TaskGrammar,
    use: Use = "order",
    changes: NDArray[np.floating] | None = None,
) -> Real:
    """Probability of each action at each step (n, K), given all steps and the grammar.

    Exact: the forward-backward algorithm over segments. Rows sum to 1, and are 0 where nothing is
    decoded. Parameters as of :func:`decode`.
    """
    result = np.zeros(np.shape(log_probabilities))
    for part, scores, evidence, after in prepare_runs(
        log_probabilities, valid, step, grammar, use, changes
    ):
        result[part] = _marginals(evidence, scores.per_place(), after)
    return result


def _marginals(evidence: Real, scores: HsmmParameters, changes: Real | None) -> Real:
    """The marginals of one stretch, given the scores of changes after each step."""
    n = len(evidence)
    forward = ForwardPass(scores, LogSumExp(), n)
    backward = ForwardPass(scores.reversed(), LogSumExp(), n)
    forward.push(evidence, changes)
    # What comes after a step comes, backwards, after the next one.
    backward.push(evidence[::-1], None if changes is None else np.roll(changes[::-1], -1))
    # Each place with what lies before it, and after it; of an action that ends or starts there.
    inner = slice(1, n)
    rest = backward.sums[:, ::-1]
    ending, starting = forward.ends[:, inner], forward.starts[:, forward.margin :][:, inner]
    ended = backward.starts[:, backward.margin :][:, ::-1][:, inner]
    started = backward.ends[:, ::-1][:, inner]
    both = (forward.sums + rest)[:, inner]
    first = forward.first(1, n + 1)
    opening = np.concatenate([first[:, :-1] + ended + both, first[:, -1:] + rest[:, :1]], axis=1)
    present = np.logaddexp.reduce(opening, axis=1)
    total = np.logaddexp.reduce(present)
    begun = np.exp(starting + started + both - total)
    since = np.cumsum(begun - np.exp(ending + ended + both - total), axis=1)
    present = np.exp(present - total)[:, None]
    # Sums of differences are off by roundings.
    steps = np.clip(np.concatenate([present, present + since], axis=1).T, 0.0, 1.0)
    result = np.empty_like(steps)
    result[:, forward.order] = steps / steps.sum(axis=1, keepdims=True)
    return result
