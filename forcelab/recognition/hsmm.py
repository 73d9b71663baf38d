"""The semi-Markov decoder: the most probable sequence of actions, and its marginals.

A segmentation of the steps ``0 .. n`` into segments, neighbours of different actions, scores

    start(k_1) + S(k_1, d_1) + sum_i [ follow(k_i, k_i+1) + F(k_i, d_i) ] + S(k_m, d_m)
        + sum_t evidence(t, action at t) + sum of change(t) wherever the action changes,

the first and the last segment cut off by the ends of the recording: of them is known only that they
last at least so long, S, and of the ones between how long they last, F. Both are log-normal up to a
length that is longer than nearly all, or :data:`MOST` steps, and fall by the same share a step from
there on, or not at all where that is less than usual: so nothing is too long to be, and a step
costs no more the longer the recording is.

With ``h_t(k)`` the score of the best segmentation (or the sum of all) of the steps before ``t``
whose last segment, of action k, ends at ``t``, and ``g_t(k)`` that of those after which k starts at
``t``, both without the running sum ``C_t(k)`` of k's evidence,

    h_t(k) = max_d [ g_(t-d)(k) + F(k, d) ],
    g_t(k) = max_j [ h_t(j) + C_t(j) + follow(j, k) - C_t(k) ] + change_t.

Each step is one addition and one maximum over actions and durations; beyond the longest duration
that is told apart, where F is a straight line, one running maximum stands for all starts.

Sources: Yu, "Hidden semi-Markov models", Artificial Intelligence 174, 2010. Guédon, "Estimating
hidden semi-Markov chains from discrete sequences", J. Comput. Graph. Stat. 12, 2003: segments cut
off by the ends of what was recorded.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from forcelab.arrays import Codes, Flags, Real, Whole
from forcelab.errors import InputError
from forcelab.labels import UNLABELLED
from forcelab.recognition.task_grammar import TaskGrammar
from forcelab.sample_runs import marked_runs

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
#: But never up to more steps, 655 s of the presets' 20 ms: a step costs as many additions.
MOST = 2**15
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
#: Gaps of up to so many seconds are decoded through, as time of which nothing is known: an action
#: seldom begins and ends in one. What is apart farther is decoded each by itself.
BRIDGED = 0.5
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
    shortest: Whole
    longest: Whole

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
            shortest = np.maximum(shortest, np.minimum(usual, MOST).astype(np.int64))
            limit = np.exp(grammar.mean + LOG_NORMAL * grammar.sd) / step
            longest = np.maximum(shortest, np.ceil(np.minimum(limit, MOST)).astype(np.int64))
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

    def change_scores(self, ratios: NDArray[np.floating]) -> Real:
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
        z = (np.log(self.longest * self.step) - self.mean) / self.sd
        fall = -(1.0 + z / self.sd) / self.longest
        return self.emphasis * np.minimum(fall, 0.0)

    def duration_scores(self, steps: Whole) -> Real:
        """F: log probabilities that a segment lasts so many steps (m,), each >= 1; (K, m)."""
        z, logs, beyond = self._durations(steps)
        width = math.sqrt(2 * math.pi) * self.sd[:, None] / UNIT
        scores = self.emphasis * (-0.5 * z**2 - logs - np.log(width)) + beyond
        return np.where(steps >= self.shortest[:, None], scores, -np.inf)

    def survival_scores(self, steps: Whole) -> Real:
        """S: log probabilities that it lasts so many steps (m,) or more; (K, m)."""
        from scipy.special import log_ndtr

        z, _, beyond = self._durations(steps)
        return np.asarray(self.emphasis * log_ndtr(-z) + beyond)

    def _durations(self, steps: Whole) -> tuple[Real, Real, Real]:
        """Durations up to the longest, standardised and in log seconds; the score beyond it."""
        table = np.minimum(steps, self.longest[:, None])
        logs = np.log(table * self.step)
        z = (logs - self.mean[:, None]) / self.sd[:, None]
        return z, logs, self.slope[:, None] * (steps - table)

    def per_place(self) -> HsmmParameters:
        """The parameters for sums over all places of a boundary, of which finer steps have more."""
        return replace(self, follow=self.follow + math.log(self.step / STEP))

    def anywhere(self) -> HsmmParameters:
        """The parameters of a stretch that does not begin with its demonstration."""
        return replace(self, start=np.full_like(self.start, -math.log(len(self.start))))

    def reversed(self) -> HsmmParameters:
        """The parameters of time that runs backwards, from after the last step."""
        return replace(self, follow=self.follow.T.copy(), start=np.zeros_like(self.start))


class ForwardPass:
    """The scores of all segmentations of the steps so far, of which there is room for some.

    Rows of its arrays are actions; columns are the places between steps, from `base` on: `sums` is
    C, `ends` h and `starts`, from column `margin` on, g of the module's docstring. With `best` they
    are of the best segmentations, otherwise the logarithms of the sums over all.
    """

    def __init__(self, parameters: HsmmParameters, room: int, best: bool) -> None:
        K = len(parameters.start)
        self._best, self._parameters = best, parameters
        self.now = self.base = 0
        # No segment is longer than all there will be, and a stream has room for the longest.
        self.margin = max(min(int(parameters.longest.max()), room), 1)
        lengths = np.arange(self.margin, 0, -1)
        self._durations = parameters.duration_scores(lengths)
        self._survivals = parameters.survival_scores(lengths)
        self._slope = parameters.slope
        self._rows = np.arange(K)
        self.sums = np.zeros((K, room + 1))
        self.ends = np.full((K, room + 1), -np.inf)
        self.starts = np.full((K, self.margin + room + 1), -np.inf)
        # Of the best: when the segment that ends at a place began, and what was before it.
        self._begun = np.zeros((K, room + 1), dtype=np.int64)
        self._before = np.zeros((K, room + 1), dtype=np.int64)
        # Of starts so long ago that only the slope counts: the best, seen along the slope, or the
        # sum; and when that was.
        self._far, self._far_begun = np.full(K, -np.inf), np.zeros(K, dtype=np.int64)

    @property
    def room(self) -> int:
        """Number of further steps that it can hold."""
        return self.ends.shape[1] - 1 - (self.now - self.base)

    def push(self, evidence: Real, changes: Real | None = None) -> None:
        """Take evidence (m, K) and scores of changes (m,) of steps for which there is room."""
        follow = self._parameters.follow
        for step, row in enumerate(evidence):
            self.now += 1
            place = self.now - self.base
            self.sums[:, place] = sums = self.sums[:, place - 1] + row
            self._pass_far()
            ends, begun = self._join(self._durations)
            first = self.first(np.array([self.now]))[:, 0]
            if self._best:
                self._begun[:, place] = np.where(first >= ends, 0, begun)
                ends = np.maximum(first, ends)
                after = (ends + sums)[:, None] + follow
                before = after.argmax(axis=0)
                self._before[:, place] = before
                starts = after[before, self._rows]
            else:
                ends = np.logaddexp(first, ends)
                starts = log_sum_exp((ends + sums)[:, None] + follow, axis=0)
            self.ends[:, place] = ends
            change = 0.0 if changes is None else changes[step]
            self.starts[:, self.margin + place] = starts - sums + change

    def _pass_far(self) -> None:
        """Take in the start that has just become too long ago for the table of durations."""
        start = self.now - self.margin - 1
        if start > 0:
            level = self.starts[:, self.now - self.base - 1] - self._slope * start
            if self._best:
                self._far_begun = np.where(level > self._far, start, self._far_begun)
                self._far = np.maximum(level, self._far)
            else:
                self._far = np.logaddexp(level, self._far)

    def _join(self, table: Real) -> tuple[Real, Codes]:
        """Scores (K,) of segments that go on until now, and of the best when they began.

        `table` (K, margin) are the scores of their lengths, the longest first.
        """
        place = self.now - self.base
        scores = self.starts[:, place : place + self.margin] + table
        far = self._far + table[:, 0] + self._slope * (self.now - self.margin)
        if not self._best:
            return np.logaddexp(log_sum_exp(scores, axis=1), far), self._far_begun
        longest = scores.argmax(axis=1)
        near = scores[self._rows, longest]
        begun = np.where(far > near, self._far_begun, self.now - self.margin + longest)
        return np.maximum(near, far), begun

    def first(self, ends: Codes) -> Real:
        """The scores of a first segment that ends at the times `ends` (m,) from 1 on; (K, m)."""
        within = np.minimum(ends, self.margin)
        beyond = self._slope[:, None] * (ends - within)
        start = self._parameters.start[:, None]
        return np.asarray(start + self._survivals[:, self.margin - within] + beyond)

    def best_codes(self, last: int) -> Codes:
        """Codes of the `last` most recent steps of the best segmentation, as if it ended now."""
        codes = np.empty(last, dtype=np.int64)
        scores, begun = self._join(self._survivals)
        whole = self.first(np.array([self.now]))[:, 0]
        begun = np.where(whole >= scores, 0, begun)
        scores = np.maximum(whole, scores) + self.sums[:, self.now - self.base]
        code, end = int(scores.argmax()), self.now
        start = int(begun[code])
        while True:
            begin = self.now - last
            codes[max(start - begin, 0) : end - begin] = code
            if start <= begin:
                return codes
            place, end = start - self.base, start
            code = int(self._before[code, place])
            start = int(self._begun[code, place])

    def forget(self, count: int) -> None:
        """Make room: keep the last `count` places only, which must hold every length told apart."""
        places = self.now - self.base - count
        if places <= 0:
            return
        for line in (self.sums, self.ends, self.starts, self._begun, self._before):
            line[:, :-places] = line[:, places:].copy()
        # Nothing starts yet at the places to come.
        self.starts[:, -places:] = -np.inf
        self.base += places


def log_sum_exp(scores: Real, axis: int) -> Real:
    """The logarithm of the sum of exponentials along an axis; all may be minus infinity."""
    top = np.maximum(scores.max(axis=axis, keepdims=True), np.finfo(np.float64).min)
    with np.errstate(divide="ignore"):
        logs = np.log(np.exp(scores - top).sum(axis=axis))
    return np.asarray(logs + np.squeeze(top, axis))


def decode(
    log_probabilities: NDArray[np.floating],
    valid: Flags,
    step: float,
    grammar: TaskGrammar,
    use: Use = "order",
    changes: NDArray[np.floating] | None = None,
) -> Codes:
    """The best sequence of actions: codes (n,) of log probabilities (n, K).

    A constant added to a step changes nothing. Unlabelled in gaps (not `valid`) and where a step
    holds no number; gaps of up to :data:`BRIDGED` seconds are decoded through, and what lies
    between two longer ones by itself. `step` is in seconds; 0.02 is fine enough. `use` says how
    much of the grammar counts: "none" but a cost of changes, "durations", or with the "order" also
    which action follows which and how demonstrations start. `changes` (n,) are finite log ratios
    in nats of how much likelier than usual a change is near; they count for nothing with "none".
    Of equally good sequences it is always the same one.
    """
    codes = np.full(len(log_probabilities), UNLABELLED, dtype=np.int64)
    runs = prepare_runs(log_probabilities, valid, step, grammar, use, changes)
    for part, scores, evidence, after, known in runs:
        forward = ForwardPass(scores, len(evidence), best=True)
        forward.push(evidence, after)
        codes[part] = np.where(known, forward.best_codes(len(evidence)), UNLABELLED)
    return codes


def prepare_runs(
    log_probabilities: NDArray[np.floating],
    valid: Flags,
    step: float,
    grammar: TaskGrammar,
    use: Use,
    changes: NDArray[np.floating] | None,
) -> Iterator[tuple[slice, HsmmParameters, Real, Real | None, Flags]]:
    """Each stretch between long gaps: its steps, the model, its evidence and scores of changes.

    And which of its steps are known: the others are in short gaps.
    """
    valid = decodable_steps(log_probabilities, valid, grammar)
    if not valid.any():
        return
    scores = HsmmParameters.from_grammar(grammar, step, use)
    known = np.where(valid[:, None], log_probabilities, -np.inf)  # a step that says nothing
    likelier = None if changes is None else np.where(valid, changes, LIKELIER)  # scores 0
    most = bridged_steps(step)
    for first, last in bridged_runs(valid, most):
        part = slice(first, last)
        yield (
            part,
            scores if first <= most else scores.anywhere(),
            scores.evidence(known[part]),
            None if likelier is None else scores.change_scores(likelier[part]),
            valid[part],
        )


def bridged_steps(step: float) -> int:
    """The steps of the longest gap that is decoded through."""
    return math.floor(BRIDGED / step + 1e-9)


def bridged_runs(valid: Flags, most: int) -> list[tuple[int, int]]:
    """First and last (excluded) step of each stretch whose gaps have no more than `most` steps."""
    runs: list[tuple[int, int]] = []
    for first, last in marked_runs(valid).tolist():
        if runs and first - runs[-1][1] <= most:
            first, _ = runs.pop()  # noqa: PLW2901 - the stretch goes on
        runs.append((first, last))
    return runs


def decodable_steps(
    log_probabilities: NDArray[np.floating], valid: Flags, grammar: TaskGrammar
) -> Flags:
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


class FixedLag:
    """Decides each step `lag` steps of `step` seconds later.

    The code of a step is what :func:`decode` gives it from all steps up
    to `lag` after it and none later. Memory and time do not grow with the stream.
    """

    def __init__(
        self,
        step: float,
        lag: int,
        grammar: TaskGrammar,
        use: Use = "order",
    ) -> None:
        if lag < 0:
            raise InputError(f"The decoder can wait for 0 steps or more, not {lag}.")
        self.lag = lag
        self._grammar = grammar
        self._parameters = HsmmParameters.from_grammar(grammar, step, use)
        self._bridged = bridged_steps(step)
        self._forward: ForwardPass | None = None
        self._before = 0  # steps before the first stretch
        self._begun = False
        # Whether each step that waits for a code is no gap; the last of them, as many as the gap
        # that there is now has, are not in the forward pass.
        self._waiting: deque[bool] = deque()
        self._gap = 0

    def push(self, log_probabilities: NDArray[np.floating], valid: Flags | None = None) -> Codes:
        """Take log probabilities (m, K); give the codes that are now decided, in order.

        Steps that are not valid are gaps. Long ones decide all that waits.
        """
        m = len(log_probabilities)
        valid = np.ones(m, dtype=np.bool_) if valid is None else valid
        valid = decodable_steps(log_probabilities, valid, self._grammar)
        if not log_probabilities.size:
            return np.full(m, UNLABELLED, dtype=np.int64)
        evidence = self._parameters.evidence(np.where(valid[:, None], log_probabilities, -np.inf))
        decided: list[int] = []
        for row, is_valid in zip(evidence, valid.tolist(), strict=True):
            self._waiting.append(is_valid)
            if is_valid:
                self._advance(row)
            else:
                self._gap += 1
                if self._forward is None or self._gap > self._bridged:
                    decided += self.finish().tolist()
            if len(self._waiting) > self.lag:
                decided.append(self._oldest())
        return np.array(decided, dtype=np.int64)

    def finish(self) -> Codes:
        """The codes that were waiting: nothing comes any more. What is pushed then is new."""
        valid = np.array(self._waiting, dtype=np.bool_)
        codes = np.full(len(valid), UNLABELLED, dtype=np.int64)
        seen = len(valid) - self._gap
        if self._forward is not None and seen > 0:
            codes[:seen] = np.where(valid[:seen], self._forward.best_codes(seen), UNLABELLED)
        self._before += len(valid)
        self._begun |= self._forward is not None or self._before > self._bridged
        self._forward, self._gap = None, 0
        self._waiting.clear()
        return codes

    def _oldest(self) -> int:
        """The code of the step that has waited longest."""
        seen = len(self._waiting) - self._gap
        if not self._waiting.popleft() or self._forward is None:
            return UNLABELLED
        return int(self._forward.best_codes(seen)[0])

    def _advance(self, evidence: Real) -> None:
        """Take a step, and the gap before it, of which nothing is known."""
        if self._forward is None:
            parameters = self._parameters.anywhere() if self._begun else self._parameters
            # Room for twice what must be kept.
            room = 2 * (int(parameters.longest.max()) + self.lag) + 64
            self._forward, self._begun = ForwardPass(parameters, room, best=True), True
        for row in (*np.zeros((self._gap, len(evidence))), evidence):
            if not self._forward.room:
                # Places that decisions to come look back upon.
                self._forward.forget(self._forward.margin + self.lag + 2)
            self._forward.push(row[None])
        self._gap = 0


def marginals(
    log_probabilities: NDArray[np.floating],
    valid: Flags,
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
    runs = prepare_runs(log_probabilities, valid, step, grammar, use, changes)
    for part, scores, evidence, after, known in runs:
        found = _marginals(evidence, scores.per_place(), after)
        result[part] = np.where(known[:, None], found, 0.0)
    return result


def _marginals(evidence: Real, scores: HsmmParameters, changes: Real | None) -> Real:
    """The marginals of one stretch, given the scores of changes after each step."""
    n = len(evidence)
    forward = ForwardPass(scores, n, best=False)
    backward = ForwardPass(scores.reversed(), n, best=False)
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
    first = forward.first(np.arange(1, n + 1))
    opening = np.concatenate([first[:, :-1] + ended + both, first[:, -1:] + rest[:, :1]], axis=1)
    present = log_sum_exp(opening, axis=1)
    total = log_sum_exp(present, axis=0)
    begun = np.exp(starting + started + both - total)
    since = np.cumsum(begun - np.exp(ending + ended + both - total), axis=1)
    present = np.exp(present - total)[:, None]
    # Sums of differences are off by roundings.
    steps = np.clip(np.concatenate([present, present + since], axis=1).T, 0.0, 1.0)
    return np.asarray(steps / steps.sum(axis=1, keepdims=True))
