"""A trained recogniser on a stream: labels as the samples come, with a chosen latency.

The paper's filters on a stream of codes, each a fixed number of steps behind. With as many steps to
look ahead as a filter needs it gives what :mod:`forcelab.recognition.filters` gives offline; with
fewer the median takes the last code that it sees as going on, and a stretch stays unlabelled until
it has proved long enough.

The label of a step rests on the samples up to `latency` seconds after it and on no others. Wavelets
that have not passed by then are known by an early estimate with the end value held, whose expected
error :attr:`OnlineRecogniser.early` tells. The filters take the steps ahead that they need, at most
half of the latency; the wavelets have the rest.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import GAP_PERIODS, Channel, Demonstration
from forcelab.errors import InputError
from forcelab.labels import UNLABELLED
from forcelab.recognition.features import REACH
from forcelab.recognition.filters import threshold
from forcelab.recognition.hsmm import (
    ForwardPass,
    HsmmParameters,
    Use,
    bridged_steps,
    decodable_steps,
)
from forcelab.recognition.live_features import (
    CausalGrid,
    Steps,
    StreamingFeatures,
    StreamingWindows,
)
from forcelab.recognition.live_model import choose_live_model, live_hop, needs_live_model
from forcelab.recognition.recogniser import Recogniser
from forcelab.recognition.task_grammar import TaskGrammar
from forcelab.runtime import one_blas_thread
from forcelab.segment_edits import SLIVER
from forcelab.signals.channels import channel_map
from forcelab.signals.cwt import frequencies
from forcelab.signals.streaming import StreamingCwt, early_error, reaches

Real = NDArray[np.float64]
Codes = NDArray[np.int64]


@dataclass(frozen=True)
class LiveLabels:
    """Steps whose labels are decided, in their order and without a break."""

    times: Real  # (n,); seconds on the clock of the samples
    codes: Codes  # (n,); after the filters; the action with code ``i`` is ``actions[i]``
    probabilities: Real | None  # (n, K); None of a classifier that has none; zero in gaps

    def __len__(self) -> int:
        return len(self.times)


class FixedLag:
    """Decides each step `lag` steps of `step` seconds later.

    The code of a step is what :func:`forcelab.recognition.hsmm.decode` gives it from all steps up
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

    def push(
        self, log_probabilities: NDArray[np.floating], valid: NDArray[np.bool_] | None = None
    ) -> Codes:
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


class CausalMedian:
    """Running median of `width` over label numbers, which looks at most `ahead` steps ahead."""

    def __init__(self, width: int, ahead: int) -> None:
        after = (width - 1) // 2
        self._width = width
        self._before = width // 2
        self.delay = min(after, ahead)
        self._unseen = after - self.delay
        self._codes: Codes | None = None  # `before` codes of context, then those that wait

    def push(self, codes: Codes) -> Codes:
        """Take codes; give the medians of those that have enough after them."""
        if not len(codes):
            return codes
        if self._codes is None:
            self._codes = np.full(self._before, codes[0])
        self._codes = np.concatenate([self._codes, codes])
        ready = max(0, len(self._codes) - self._before - self.delay)
        if not ready:
            return codes[:0]
        seen = self._before + 1 + self.delay
        across = self._codes.strides[0]
        # Not sliding_window_view, which takes longer than all the rest of this.
        windows = np.ndarray((ready, seen), self._codes.dtype, self._codes, 0, (across, across))
        if self._unseen:
            windows = np.concatenate(
                [windows, np.repeat(windows[:, -1:], self._unseen, axis=1)], axis=1
            )
        ranks = ((self._width - 1) // 2, self._width // 2)
        ordered = np.partition(windows, ranks, axis=1)
        self._codes = self._codes[ready:]
        return (ordered[:, ranks[0]] + ordered[:, ranks[1]] + 1) // 2

    def finish(self) -> Codes:
        """The medians that were waiting; the last code goes on."""
        if self._codes is None or not self.delay:
            return np.empty(0, dtype=np.int64)
        return self.push(np.full(self.delay, self._codes[-1]))


class CausalDrop:
    """Unlabels what is shorter than its code's limit (s); looks `ahead` steps ahead."""

    def __init__(self, limits: Mapping[int, float], period: float, ahead: int) -> None:
        self._limits = np.zeros(max(limits, default=0) + 1)
        for code, seconds in limits.items():
            self._limits[code] = seconds
        self._period = period
        self.delay = min(ahead, self.needed(limits, period))
        self._times = np.empty(0)
        self._codes = np.empty(0, dtype=np.int64)
        # Stretches of one code: the place among what waits where it begins, and when it began.
        self._stretches: list[tuple[int, float]] = []
        self._last = (-np.inf, UNLABELLED - 1)  # time and code of the newest step

    @staticmethod
    def needed(limits: Mapping[int, float], period: float) -> int:
        """Steps ahead with which nothing is missed; some more for stamps that jitter."""
        longest = max(limits.values(), default=0.0)
        return int(np.ceil(1.01 * longest / period)) + 2 if longest > 0 else 0

    def push(self, times: Real, codes: Codes) -> Codes:
        """Take codes with their times; give those that are decided."""
        return self._decide(times, codes, ended=False)

    def finish(self) -> Codes:
        """The codes that were waiting."""
        return self._decide(np.empty(0), np.empty(0, dtype=np.int64), ended=True)

    def _decide(self, times: Real, codes: Codes, ended: bool) -> Codes:
        if len(codes):
            self._append(times, codes)
        n = len(self._codes)
        ready = n if ended else max(0, n - self.delay)
        if not ready:
            return self._codes[:0]
        out = self._codes[:ready].copy()
        ends = [*(place for place, _ in self._stretches[1:]), n]
        gone = 0
        for (begin, start), end in zip(self._stretches, ends, strict=True):
            if begin >= ready:
                break
            gone += end <= ready
            code = int(self._codes[max(0, begin)])
            if end > 0 and 0 <= code < len(self._limits):
                least = start + float(self._limits[code]) - SLIVER
                self._judge(out, max(0, begin), end, least, ended)
        self._times, self._codes = self._times[ready:], self._codes[ready:]
        gone = min(gone, len(self._stretches) - 1)  # the newest may go on
        self._stretches = [(place - ready, start) for place, start in self._stretches[gone:]]
        return out

    def _judge(self, out: Codes, begin: int, end: int, least: float, ended: bool) -> None:
        """Leave unlabelled those of a stretch that do not see it reach the time `least`."""
        n = len(self._times)
        # From here on its end is seen.
        known = min(max(begin, end - self.delay if end < n or ended else n), len(out))
        if end < n or ended:
            last = float(self._times[end - 1])
            following = float(self._times[end]) if end < n else np.inf
            whole = following - last <= GAP_PERIODS * self._period
            if (following if whole else last + self._period) < least:
                out[known:end] = UNLABELLED
        newest = self._times[begin + self.delay : known + self.delay]
        # The earlier a step, the less of what follows it has seen.
        out[begin : begin + int(np.searchsorted(newest, least))] = UNLABELLED

    def _append(self, times: Real, codes: Codes) -> None:
        """Note new codes, and where stretches begin."""
        longest = GAP_PERIODS * self._period
        fresh = (codes[1:] != codes[:-1]) | (times[1:] - times[:-1] > longest)
        begin = len(self._codes)
        if codes[0] != self._last[1] or times[0] - self._last[0] > longest:
            self._stretches.append((begin, float(times[0])))
        for i in fresh.nonzero()[0].tolist():
            self._stretches.append((begin + i + 1, float(times[i + 1])))
        self._last = (float(times[-1]), int(codes[-1]))
        self._times = np.concatenate([self._times, times])
        self._codes = np.concatenate([self._codes, codes])


Prober = Callable[[Real], Real]


def probability_function(classifier: Any) -> Prober | None:
    """The classifier's probability function, of shape (n, classes); None if it has none.

    Of scikit-learn's MLP as it is trained here the sums are done in place: checking its input takes
    it ten times as long as 20 steps do.
    """
    if not hasattr(classifier, "predict_proba"):
        return None
    plain = type(classifier).__name__ == "MLPClassifier" and classifier.activation == "relu"
    if not plain or classifier.out_activation_ not in ("softmax", "logistic"):
        asked: Prober = classifier.predict_proba
        return asked
    layers = list(zip(classifier.coefs_, classifier.intercepts_, strict=True))
    softmax = classifier.out_activation_ == "softmax"

    def probabilities(features: Real) -> Real:
        values = features
        for i, (weights, bias) in enumerate(layers):
            values = values @ weights + bias
            if i < len(layers) - 1:
                np.maximum(values, 0.0, out=values)
        if softmax:
            values -= values.max(axis=1, keepdims=True)
            np.exp(values, out=values)
            return values / values.sum(axis=1, keepdims=True)
        with np.errstate(over="ignore"):  # exp(800) is as good as infinite
            second = 1.0 / (1.0 + np.exp(-values))
        return np.concatenate([1.0 - second, second], axis=1)

    return probabilities


def classify(
    recogniser: Recogniser, features: Real, valid: NDArray[np.bool_], probe: Prober | None
) -> tuple[Codes, Real | None]:
    """Codes of steps (n, f) after the threshold, and their probabilities where there are any.

    Steps that are not valid are unlabelled, with probabilities of zero.
    """
    classifier, at = recogniser.classifier, recogniser.settings.threshold
    whole = len(valid) > 0 and bool(valid.all())
    if probe is not None and whole and len(classifier.classes_) == len(recogniser.actions):
        # Nothing to be left out and an action for each class: nearly always.
        found = probe(features)
        codes = np.argmax(found, axis=1)
        return codes if at is None else threshold(codes, found, at), found
    codes = np.full(len(features), UNLABELLED, dtype=np.int64)
    probabilities = None if probe is None else np.zeros((len(features), len(recogniser.actions)))
    if not valid.any():
        return codes, probabilities
    if probe is None or probabilities is None:
        codes[valid] = classifier.predict(features[valid])
        return codes, None
    found = probe(features[valid])
    probabilities[np.ix_(valid, classifier.classes_)] = found
    codes[valid] = classifier.classes_[np.argmax(found, axis=1)]
    if at is not None:
        codes = threshold(codes, probabilities, at)
    return codes, probabilities


#: Error of complete coefficients, relative to the largest of their scale.
TOLERANCE = 3e-5


@dataclass(frozen=True)
class EarlyScale:
    """A scale that is estimated before its wavelet has passed."""

    scale: float  # in samples
    hertz: float  # the frequency that it answers to most
    seconds: float  # time after which its wavelet would have passed
    error: float  # expected error, root mean square over that of its coefficients (Morlet, p = 5)


@dataclass(frozen=True)
class Budget:
    """The shares of a latency, in steps of the grid."""

    #: grid, features, median, drop: steps that resampling, wavelets or windows, and the two filters
    #: look ahead
    grid: int
    features: int
    median: int
    drop: int
    decoder: int = 0  # steps that the decoder looks ahead, where there is one
    hold: int = 0  # steps from the first one that shares a label to the one that it is made for

    @property
    def total(self) -> int:
        """All of them."""
        filters = self.median + self.drop + self.decoder
        return self.grid + self.features + filters + self.hold


def limits_of(recogniser: Recogniser) -> dict[int, float]:
    """The least seconds of each code that the drop heuristic keeps."""
    share = recogniser.settings.drop
    return {} if share is None else recogniser.shortest_seconds(share)


def longest_gap(recogniser: Recogniser) -> int:
    """Samples of a gap beyond which nothing before counts: twice the widest wavelet or window."""
    settings = recogniser.settings
    if needs_live_model(settings):
        return int(2 * REACH * settings.windows[-1] * recogniser.rate) + 1
    return 2 * int(np.max(reaches(settings.scales, settings.mother, TOLERANCE))) + 1


def budget_of(recogniser: Recogniser, latency: float, period: float, grid: int = 0) -> Budget:
    """The shares of a latency (s), at steps of `period` seconds; resampling takes `grid`."""
    total = max(0, int(np.floor(latency / period + 1e-6)) - grid)
    if needs_live_model(recogniser.settings):
        return _of_part(recogniser, total, period, grid)
    width = recogniser.settings.median
    median = min((width - 1) // 2, total // 2) if width is not None else 0
    need = CausalDrop.needed(limits_of(recogniser), period)
    drop = min(need, max(0, total // 2 - median))
    return Budget(grid, total - median - drop, median, drop)


def _of_part(recogniser: Recogniser, total: int, period: float, grid: int) -> Budget:
    """The shares where a live model is used, at every `hop` steps of the grid.

    Its label goes for the steps around, so that the first of them waits for half a hop longer: less
    than that cannot be had.
    """
    hop = live_hop(recogniser.settings, 1.0 / period)
    rest = max(0, total - hop // 2)
    part = choose_live_model(recogniser.live_models, rest * period)
    look = round(part.windows.look / period)
    return Budget(grid, look, 0, 0, max(0, rest - look) // hop * hop, hop // 2)


Flags = NDArray[np.bool_]


class ModelStages:
    """Everything behind the grid: windows, classifier, decoder, and what waits between them.

    Time steps lie a hop of the grid's steps apart; each label is given to the steps around.
    """

    def __init__(self, recogniser: Recogniser, budget: Budget, period: float) -> None:
        self.budget = budget
        settings = recogniser.settings
        self._hop = hop = live_hop(settings, 1.0 / period)
        part = next(
            one
            for one in recogniser.live_models
            if round(one.windows.look / period) == budget.features
        )
        self._classifier, self._actions = part.classifier, len(recogniser.actions)
        self._windows = StreamingWindows(part.windows, 1.0 / period, hop)
        assert recogniser.grammar is not None
        self._decoder = FixedLag(
            hop * period,
            budget.decoder // hop,
            recogniser.grammar,
            settings.choreography,  # type: ignore[arg-type]  # checked when it was set
        )
        # Steps of the grid that wait for a label, and of which the first is number `_done`.
        self._times, self._valid = np.empty(0), np.empty(0, dtype=bool)
        self._done = 0
        # How many time steps there are, how many are left behind, and of the others their
        # probabilities, and the codes of those that are decided.
        self._asked = self._left = 0
        self._known = np.empty((0, self._actions))
        self._codes = np.empty(0, dtype=np.int64)

    def push(self, times: Real, rows: Real, valid: Flags) -> LiveLabels:
        """Take steps of the grid, `rows` of shape (n, q)."""
        self._times = np.concatenate([self._times, times])
        self._valid = np.concatenate([self._valid, valid])
        self._decode(self._windows.push(rows))
        return self._given((self._left + len(self._codes)) * self._hop - self._done)

    def finish(self) -> LiveLabels:
        """Give the steps that were waiting."""
        self._decode(self._windows.finish())
        self._codes = np.concatenate([self._codes, self._decoder.finish()])
        return self._given(len(self._times))

    def _decode(self, features: Real) -> None:
        """Take time steps."""
        m = len(features)
        if not m:
            return
        # In the middle of the steps around; at the end of a stream perhaps past its last one.
        places = (self._asked + np.arange(m)) * self._hop + self._hop // 2 - self._done
        valid = self._valid[np.minimum(places, len(self._valid) - 1)]
        known = np.zeros((m, self._actions))
        if valid.any():
            found = self._classifier.predict_proba(features[valid])
            known[np.ix_(valid, self._classifier.classes_)] = found
        self._asked += m
        self._known = np.concatenate([self._known, known])
        with np.errstate(divide="ignore"):
            codes = self._decoder.push(np.log(known), valid)
        self._codes = np.concatenate([self._codes, codes])

    def _given(self, count: int) -> LiveLabels:
        """Give up to `count` steps of the grid the labels of the time steps around."""
        count = min(count, len(self._times))
        if count < 1:
            none = np.empty((0, self._actions))
            return LiveLabels(np.empty(0), np.empty(0, dtype=np.int64), none)
        around = (self._done + np.arange(count)) // self._hop - self._left
        # At the end of a stream what lies behind the last time step belongs to it.
        around = np.minimum(around, len(self._codes) - 1)
        valid = self._valid[:count]
        codes = np.where(valid, self._codes[around], UNLABELLED)
        known = np.where(valid[:, None], self._known[around], 0.0)
        times, self._times = self._times[:count], self._times[count:]
        self._valid = self._valid[count:]
        self._done += count
        # The last one stays, in case that it is the last of all.
        gone = min(self._done // self._hop - self._left, len(self._codes) - 1)
        self._codes, self._known = self._codes[gone:], self._known[gone:]
        self._left += gone
        return LiveLabels(times, codes, known)


#: Samples of a demonstration that are pushed at once.
BLOCK = 4096
#: Greatest latency in seconds: the samples of that time are kept in memory.
LONGEST = 600.0


def check_latency(latency: float) -> None:
    """Refuse a latency that is no number of seconds from 0 to :data:`LONGEST`."""
    if not 0 <= latency <= LONGEST:
        raise InputError(
            f"The latency is a number of seconds from 0 to {LONGEST:g}, not {latency:g}."
        )


class OnlineRecogniser:
    """Labels of a stream, `latency` seconds (0 to :data:`LONGEST`) after each step.

    Samples that are waited for because some are missing come on top. `channels` are the columns of
    the samples to come; without a `rate` the stamps of the first ones tell it. Memory and time per
    sample stay the same for ever. Blocks may have any size; labels do not depend on it. Not
    thread-safe.
    """

    def __init__(
        self,
        recogniser: Recogniser,
        latency: float,
        channels: Sequence[Channel],
        rate: float | None = None,
    ) -> None:
        check_latency(latency)
        _check_live(recogniser)
        self._whole = needs_live_model(recogniser.settings)
        self.recogniser = recogniser
        self.latency = latency
        self._channels = channel_map(channels, recogniser.channels)
        self._columns = list(self._channels.recorded)
        self._width = len(channels)
        self._grid = CausalGrid(len(self._columns), recogniser.rate, rate, longest_gap(recogniser))
        self._stages = None if rate is None else self._made()

    @property
    def actions(self) -> tuple[str, ...]:
        """The action of each code."""
        return self.recogniser.actions

    @property
    def budget(self) -> Budget | None:
        """What the latency is spent on; None before the device's period is known."""
        return None if self._stages is None else self._stages.budget

    @property
    def step(self) -> float | None:
        """Seconds between two labels; None before the device's period is known."""
        return None if self._stages is None else self._grid.step

    @property
    def early(self) -> tuple[EarlyScale, ...]:
        """The scales that are estimated, by the recogniser's rate until the device's is known."""
        recogniser = self.recogniser
        if self._whole:
            return ()
        period = 1 / recogniser.rate
        budget = self.budget or budget_of(recogniser, self.latency, period)
        scales, mother = recogniser.settings.scales, recogniser.settings.mother
        hertz = frequencies(scales, recogniser.rate, mother)
        return tuple(
            EarlyScale(float(a), float(hz), need * period, float(early_error(budget.features / a)))
            for a, hz, need in zip(
                scales, hertz, reaches(scales, mother, TOLERANCE).tolist(), strict=True
            )
            if need > budget.features
        )

    def push(self, times: Real, signals: Real) -> LiveLabels:
        """Take samples (n, c) at increasing stamps (n,) (s); give the labels they decide.

        Samples whose stamp is not later than the one before are left out; NaN where one is missing.
        """
        stamps = np.atleast_1d(np.asarray(times, dtype=np.float64))
        values = np.asarray(signals, dtype=np.float64)
        if stamps.ndim != 1 or values.shape != (len(stamps), self._width):
            raise InputError(
                f"A block of {self._width} channels has stamps of shape (n,) and values of shape "
                f"(n, {self._width}), not {stamps.shape} and {values.shape}."
            )
        steps = self._grid.push(stamps, values[:, self._columns])
        if self._stages is None and self._grid.period is not None:
            self._stages = self._made()
        return self._through(steps)

    def finish(self) -> LiveLabels:
        """End the stream: the labels that were waiting, with the last values held.

        A finished recogniser takes no further samples; make another one.
        """
        steps = self._grid.finish()
        if self._stages is None:
            self._stages = self._made()
        first = self._through(steps)
        with one_blas_thread():
            last = self._stages.finish()
        return _joined([first, last])

    def _made(self) -> _Stages | ModelStages:
        budget = budget_of(self.recogniser, self.latency, self._grid.step, self._grid.lag)
        if self._whole:
            return ModelStages(self.recogniser, budget, self._grid.step)
        return _Stages(self.recogniser, budget, self._grid.step)

    def _through(self, steps: Steps) -> LiveLabels:
        if self._stages is None or not len(steps):
            return _nothing(self.recogniser)
        rows = np.ascontiguousarray(self._channels.apply(steps.signals).T)
        with one_blas_thread():
            return self._stages.push(steps.times, rows, steps.valid)


def recognise_with_latency(
    recogniser: Recogniser, demonstration: Demonstration, latency: float
) -> LiveLabels:
    """Recognise a demonstration as if it came live, with a latency in seconds."""
    online = OnlineRecogniser(recogniser, latency, demonstration.channels)
    times, signals = demonstration.times, demonstration.signals
    blocks = [slice(first, first + BLOCK) for first in range(0, len(times), BLOCK)]
    parts = [online.push(times[block], signals[block]) for block in blocks]
    return _joined([*parts, online.finish()])


def _check_live(recogniser: Recogniser) -> None:
    """Refuse a recogniser that needs all of a demonstration and has no live models."""
    settings = recogniser.settings
    if not needs_live_model(settings) or recogniser.live_models:
        return
    if settings.decodes:
        raise InputError(
            f"This recogniser of preset {settings.preset} learnt nothing to follow a stream with; "
            f"train it again."
        )
    raise InputError(
        f"A recogniser of preset {settings.preset} with these settings needs a whole "
        f"demonstration and cannot follow a stream; train one with preset fast, best or paper."
    )


def _nothing(recogniser: Recogniser) -> LiveLabels:
    has = hasattr(recogniser.classifier, "predict_proba")
    probabilities = np.empty((0, len(recogniser.actions))) if has else None
    return LiveLabels(np.empty(0), np.empty(0, dtype=np.int64), probabilities)


def _joined(parts: Sequence[LiveLabels]) -> LiveLabels:
    known = [part.probabilities for part in parts if part.probabilities is not None]
    return LiveLabels(
        np.concatenate([part.times for part in parts]),
        np.concatenate([part.codes for part in parts]),
        np.concatenate(known) if known else None,
    )


class _Stages:
    """Everything behind the grid: features, classifier, filters, and what waits between them."""

    def __init__(self, recogniser: Recogniser, budget: Budget, period: float) -> None:
        settings = recogniser.settings
        self.budget = budget
        self._recogniser = recogniser
        self._probe = probability_function(recogniser.classifier)
        channels = len(recogniser.channels)
        transform = StreamingCwt(
            settings.scales, channels, settings.mother, TOLERANCE, budget.features, together=True
        )
        self._features = StreamingFeatures(channels, transform, budget.features, settings.phase)
        width = settings.median
        self._median = None if width is None else CausalMedian(width, budget.median)
        limits = limits_of(recogniser)
        self._drop = CausalDrop(limits, period, budget.drop) if limits else None
        # Steps that wait for a label: the first `_coded` of them have features and a code, the
        # first `_smooth` a median.
        self._times, self._valid = np.empty(0), np.empty(0, dtype=bool)
        self._probabilities = _nothing(recogniser).probabilities
        self._coded = self._smooth = 0

    def push(self, times: Real, rows: Real, valid: NDArray[np.bool_]) -> LiveLabels:
        """Take steps of the grid."""
        self._times = np.concatenate([self._times, times])
        self._valid = np.concatenate([self._valid, valid])
        return self._decided(self._features.push(rows), ended=False)

    def finish(self) -> LiveLabels:
        """Give the steps that were waiting."""
        return self._decided(self._features.finish(), ended=True)

    def _decided(self, features: Real, ended: bool) -> LiveLabels:
        first, self._coded = self._coded, self._coded + len(features)
        valid = self._valid[first : self._coded]
        codes, probabilities = classify(self._recogniser, features, valid, self._probe)
        if self._probabilities is not None and probabilities is not None:
            self._probabilities = np.concatenate([self._probabilities, probabilities])
        first = self._coded - len(codes)
        if self._median is not None:
            codes = self._median.push(codes)
            if ended:
                codes = np.concatenate([codes, self._median.finish()])
            first, self._smooth = self._smooth, self._smooth + len(codes)
            codes[~self._valid[first : self._smooth]] = UNLABELLED
        if self._drop is not None:
            codes = self._drop.push(self._times[first : first + len(codes)], codes)
            if ended:
                codes = np.concatenate([codes, self._drop.finish()])
        n = len(codes)
        times, self._times = self._times[:n], self._times[n:]
        self._valid = self._valid[n:]
        self._coded -= n
        self._smooth -= n
        if self._probabilities is None:
            return LiveLabels(times, codes, None)
        known, self._probabilities = self._probabilities[:n], self._probabilities[n:]
        return LiveLabels(times, codes, known)
