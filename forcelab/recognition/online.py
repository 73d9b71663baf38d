"""A trained recogniser on a stream: labels as the samples come, with a chosen latency.

A stream is recognised by what recognises a recording. Its samples come in hops of some 20 ms. Once
those of a hop are there, and those that its features may see after it, the last seconds are a
recording that ends there: they are put onto the grid, their features are computed as always, and
the classifier says what it makes of the hop's time steps. Then the decoder goes on, or the filters
go over the latest steps once more, and what the latency does not let wait any longer is decided.

So the label of a sample rests on the samples up to `latency` seconds after it and on no others, and
does not depend on how they come. Wavelets that have not passed by then go on with the end value, as
at the end of a recording, whose expected error :attr:`OnlineRecogniser.early` tells. The filters
take the hops ahead that they need, at most half of the latency; the wavelets have the rest. Where
features or decoder need whole demonstrations, models take their place that have learnt from what a
stream knows (:mod:`forcelab.recognition.live_model`).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import ceil, floor

import numpy as np

from forcelab.arrays import Codes, Flags, Real
from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.labels import UNLABELLED
from forcelab.recognition.features import REACH, RunningSize, wavelet_features
from forcelab.recognition.hsmm import FixedLag, bridged_steps
from forcelab.recognition.live_model import choose_live_model, live_hop, needs_live_model
from forcelab.recognition.recogniser import Recogniser
from forcelab.recognition.settings import Settings
from forcelab.runtime import one_blas_thread
from forcelab.signals.channels import channel_map
from forcelab.signals.conditioning import noise_level
from forcelab.signals.cwt import early_error, frequencies, reaches
from forcelab.signals.grid import SAME_RATE, Grid, measured, on_grid

#: Seconds of samples that wavelets label at once, at least and at most: a tenth of the latency.
HOP, LONGEST_HOP = 0.04, 0.1
#: Error of complete coefficients, relative to the largest of their scale.
TOLERANCE = 1e-5
#: Samples that wavelets see before a hop at most, on the recogniser's grid: those of wider ones,
#: such as of preset released, go on with the first value, which costs no accuracy on the paper's
#: recordings.
MOST_PAST = 5000
#: Seconds after which the noise, by which small magnitudes are floored, is estimated anew.
NOISE_SECONDS = 1.0
#: Samples from whose stamps the device's period is taken where it is not known.
PERIOD_SAMPLES = 64
#: Samples of a demonstration that are pushed at once.
BLOCK = 4096
#: Greatest latency in seconds: the samples of that time are kept in memory.
LONGEST_LATENCY = 600.0


@dataclass(frozen=True)
class LiveLabels:
    """Labels of samples that are decided, in their order; none is left out."""

    times: Real  # (n,); stamps of the samples
    codes: Codes  # (n,); after the filters; the action with code ``i`` is ``actions[i]``
    probabilities: Real | None  # (n, K); None of a classifier that has none; zero in gaps

    def __len__(self) -> int:
        return len(self.times)


@dataclass(frozen=True)
class EarlyScale:
    """A scale that is estimated before its wavelet has passed."""

    scale: float  # in samples
    hertz: float  # the frequency that it answers to most
    seconds: float  # time after which its wavelet would have passed
    error: float  # expected error, root mean square over that of its coefficients (Morlet, p = 5)


@dataclass(frozen=True)
class Budget:
    """What a latency is spent on."""

    hop: float  # seconds of samples that are labelled at once
    ahead: float  # seconds that features see after a time step, wavelets after a hop
    #: seconds from the beginning of a hop to the newest sample that it waits for
    complete: float
    lag: int  # further hops that filters or decoder wait for


def longest_dropped(recogniser: Recogniser) -> float:
    """Seconds up to which the drop heuristic takes out segments, of whichever action most."""
    limits = recogniser.shortest_seconds(recogniser.settings.drop or 0.0)
    return max(limits.values(), default=0.0)


def grid_rate(recogniser: Recogniser, period: float) -> float:
    """Samples a second of the grid on which a device of this period (s) is recognised."""
    same = abs(period * recogniser.rate - 1) < SAME_RATE
    return 1.0 / period if same else recogniser.rate


def budget_of(recogniser: Recogniser, latency: float, period: float) -> Budget:
    """The shares of a latency (s), of samples `period` seconds apart."""
    settings, rate = recogniser.settings, grid_rate(recogniser, period)
    if needs_live_model(settings):
        samples = live_hop(settings, rate)
        hop = samples / rate
        look = choose_live_model(recogniser.live_models, latency - 0.5 * hop).windows.look
        complete = max((samples // 2 + round(look * rate)) / rate, hop - period)
        lag = floor(max(0.0, latency - complete) / hop + 1e-6)
        return Budget(hop, look, complete, lag)
    hop = max(1, round(min(max(HOP, 0.1 * latency), LONGEST_HOP) * rate)) / rate
    after = 0 if settings.median is None else (settings.median - 1) // 2
    need = after / rate + longest_dropped(recogniser)
    spare = max(0.0, latency - hop)
    lag = min(ceil(need / hop), floor(min(spare, 0.5 * latency) / hop + 1e-6))
    ahead = floor((spare - lag * hop) / period + 1e-6) * period
    return Budget(hop, ahead, hop - period + ahead, lag)


@dataclass(frozen=True)
class _Hop:
    """The samples of a hop, and the last seconds as all that it may know of."""

    begin: float  # seconds
    times: Real  # (n,); stamps of the samples
    places: Codes  # (n,); the step of the grid that is nearest to each
    grid: Grid
    channels: Real  # (q, steps of the grid)


@dataclass(frozen=True)
class _Classified:
    """The samples of a hop, and what the classifier makes of its m time steps."""

    times: Real  # (n,); stamps of the samples
    valid: Flags  # (n,)
    step_of: Codes  # (n,); the time step of each sample
    step_times: Real  # (m,)
    step_valid: Flags  # (m,)
    raw: Codes  # (m,)
    probabilities: Real | None  # (m, K)

    def labels(self, codes: Codes) -> LiveLabels:
        """The labels of the samples, given the codes (m,) of the time steps."""
        probabilities = self.probabilities
        if probabilities is not None:
            probabilities = np.where(self.valid[:, None], probabilities[self.step_of], 0.0)
        codes = np.where(self.valid, codes[self.step_of], UNLABELLED)
        return LiveLabels(self.times, codes, probabilities)


class _Stage:
    """Features and classifier of hops, and what decides their labels some hops behind.

    `past`: seconds before a hop that its features see.
    """

    past: float

    def __init__(self) -> None:
        self._waiting: deque[_Classified | None] = deque()  # None of a hop without samples

    def push(self, hop: _Hop | None) -> list[LiveLabels]:
        """Take the next hop, None if it has no samples; give the labels that are decided by now."""
        self._waiting.append(None if hop is None else self._classified(hop))
        return self._labels(ended=False)

    def finish(self) -> list[LiveLabels]:
        """The labels that were waiting."""
        return self._labels(ended=True)

    def _labels(self, ended: bool) -> list[LiveLabels]:
        """The labels of the oldest hops, as far as they are decided."""
        decided = [(self._waiting.popleft(), codes) for codes in self._decided(ended)]
        return [hop.labels(codes) for hop, codes in decided if hop is not None]

    def _classified(self, hop: _Hop) -> _Classified:
        raise NotImplementedError

    def _decided(self, ended: bool) -> Sequence[Codes]:
        """Codes of the oldest hops that are decided by the newest one, or by the end all."""
        raise NotImplementedError


def wavelet_samples(settings: Settings, budget: Budget, rate: float) -> tuple[int, int, int]:
    """Samples before a hop that wavelets see, of it at most, and from its beginning on."""
    before = min(MOST_PAST, max(reaches(settings.scales, settings.mother, TOLERANCE).tolist()))
    hop = ceil((1 + SAME_RATE) * budget.hop * rate) + 1  # the grid's rate is nearly that
    return before, hop, max(round(budget.complete * rate) + 1, hop)


class _WaveletStage(_Stage):
    """Wavelets, classifier and the recogniser's filters."""

    def __init__(self, recogniser: Recogniser, budget: Budget, rate: float) -> None:
        super().__init__()
        settings = recogniser.settings
        self._recogniser, self._budget = recogniser, budget
        self._before, self._hop, self._after = wavelet_samples(settings, budget, rate)
        self.past = self._before / rate
        self._noise, self._noise_age = np.zeros(len(recogniser.channels)), 0  # age: in hops
        # Of what is decided so much that a segment has lasted long enough.
        filtered = (settings.median or 0) / rate + longest_dropped(recogniser)
        self._past: deque[_Classified | None] = deque(maxlen=ceil(filtered / budget.hop) + 1)

    def _classified(self, hop: _Hop) -> _Classified:
        grid, recogniser = hop.grid, self._recogniser
        settings = recogniser.settings
        edges = np.array([hop.begin, hop.begin + self._budget.hop]) - 0.5 / grid.rate
        first, last = np.searchsorted(grid.times, edges).tolist()
        first = min(first, len(grid.times) - 1)
        steps = slice(first, min(max(last, first + 1), first + self._hop))
        if self._noise_age % round(NOISE_SECONDS / self._budget.hop) == 0:
            self._noise = noise_level(hop.channels)
        self._noise_age += 1
        # Always of as many samples, and at as many, so that the transform is planned once: before
        # its beginning a stream has its first value, after its end its last one.
        around = np.arange(steps.start - self._before, steps.start + self._after)
        features = wavelet_features(
            hop.channels[:, np.clip(around, 0, len(grid.times) - 1)],
            settings.scales,
            settings.mother,
            settings.phase,
            self._noise,
            places=slice(self._before, self._before + self._hop),
            tolerance=TOLERANCE,
        )[: steps.stop - first]
        valid = grid.valid[steps]
        raw, probabilities = recogniser.classify(features, valid, with_probabilities=True)
        return _Classified(
            hop.times,
            grid.valid[hop.places],
            np.clip(hop.places - first, 0, len(raw) - 1),
            grid.times[steps],
            valid,
            raw,
            probabilities,
        )

    def _decided(self, ended: bool) -> Sequence[Codes]:
        count = len(self._waiting) - (0 if ended else self._budget.lag)
        if count < 1:
            return []
        hops = [*self._past, *self._waiting]
        sampled = [hop for hop in hops if hop is not None]
        if not sampled:
            codes = np.empty(0, dtype=np.int64)
        else:
            probabilities = [hop.probabilities for hop in sampled if hop.probabilities is not None]
            stages = self._recogniser.filter(
                np.concatenate([hop.raw for hop in sampled]),
                np.concatenate(probabilities) if probabilities else None,
                np.concatenate([hop.step_times for hop in sampled]),
                np.concatenate([hop.step_valid for hop in sampled]),
            )
            codes = stages["filtered"]
        ends = np.cumsum([0 if hop is None else len(hop.raw) for hop in hops])
        done = len(self._past)
        self._past.extend(hops[done : done + count])
        return np.split(codes, ends)[done : done + count]


class _ModelStage(_Stage):
    """The live model and the decoder; a hop is one time step."""

    def __init__(self, recogniser: Recogniser, budget: Budget, rate: float) -> None:
        super().__init__()
        assert recogniser.grammar is not None
        use = recogniser.settings.choreography
        self._actions = len(recogniser.actions)
        self._middle = live_hop(recogniser.settings, rate) // 2 / rate
        self._model = next(m for m in recogniser.live_models if m.windows.look == budget.ahead)
        self.past = REACH * max(self._model.windows.windows) + 2 * budget.hop
        self._size = RunningSize(len(recogniser.channels), rate)
        self._sized = -np.inf  # the time of the newest sample that is in it
        self._decoder = FixedLag(budget.hop, budget.lag, recogniser.grammar, use)  # type: ignore[arg-type]  # checked when it was set

    def _classified(self, hop: _Hop) -> _Classified:
        grid, model = hop.grid, self._model
        step = nearest_steps(grid, np.array([hop.begin + self._middle]))
        unsized = int(np.searchsorted(grid.times, self._sized, side="right"))
        features = model.windows.features(hop.channels, grid.rate, step, self._size, unsized)
        newest = min(int(step[0]) + round(model.windows.look * grid.rate), len(grid.times) - 1)
        self._sized = float(grid.times[newest])
        valid, probabilities = grid.valid[step], np.zeros((1, self._actions))
        if valid[0]:
            probabilities[:, model.classifier.classes_] = model.classifier.predict_proba(features)
        own = np.zeros(len(hop.times), dtype=np.int64)
        times, raw = grid.times[step], probabilities.argmax(axis=1)
        return _Classified(hop.times, grid.valid[hop.places], own, times, valid, raw, probabilities)

    def _decided(self, ended: bool) -> Sequence[Codes]:
        if ended:
            return list(self._decoder.finish()[:, None])
        newest = self._waiting[-1]
        probabilities, valid = np.zeros((1, self._actions)), np.zeros(1, dtype=bool)
        if newest is not None and newest.probabilities is not None:
            probabilities, valid = newest.probabilities, newest.step_valid
        with np.errstate(divide="ignore"):  # of a probability of nothing, minus infinity
            logs = np.log(probabilities)
        return list(self._decoder.push(logs, valid)[:, None])


def nearest_steps(grid: Grid, times: Real) -> Codes:
    """The step of a grid nearest to each time (s)."""
    steps = np.searchsorted(grid.times, times - 0.5 / grid.rate)
    return np.minimum(steps, len(grid.times) - 1)


def check_latency(latency: float) -> None:
    """Refuse a latency that is no number of seconds from 0 to :data:`LONGEST_LATENCY`."""
    if not 0 <= latency <= LONGEST_LATENCY:
        raise InputError(
            f"The latency is a number of seconds from 0 to {LONGEST_LATENCY:g}, not {latency:g}."
        )


class OnlineRecogniser:
    """Labels of a stream, `latency` seconds (0 to :data:`LONGEST_LATENCY`) after each sample.

    No label comes before all samples of its hop are there. `channels` are the columns of the
    samples to come; without a `rate` the stamps of the first ones tell it. Memory and time per
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
        self.recogniser = recogniser
        self.latency = latency
        self._map = channel_map(channels, recogniser.channels)
        self._columns = list(self._map.recorded)
        self._channels = tuple(channels[column] for column in self._columns)
        self._width = len(channels)
        # The latest samples. The first `_done` of them were in one of the hops so far, of which
        # there were `_hops`, from `_start` (s) on.
        self._times, self._values = np.empty(0), np.empty((0, len(self._columns)))
        self._done = self._hops = 0
        self._start = 0.0
        #: step: seconds between two labels; budget: what the latency is spent on; None before the
        #: device's period is known
        self.step: float | None = None
        self.budget: Budget | None = None
        if rate is not None:
            self._set_period(1.0 / rate)

    @property
    def actions(self) -> tuple[str, ...]:
        """The action of each code."""
        return self.recogniser.actions

    @property
    def early(self) -> tuple[EarlyScale, ...]:
        """The scales that are estimated, by the recogniser's rate until the device's is known."""
        settings, rate = self.recogniser.settings, self.recogniser.rate
        if needs_live_model(settings):
            return ()
        budget = self.budget or budget_of(self.recogniser, self.latency, 1 / rate)
        ahead = budget.ahead * rate
        needs = reaches(settings.scales, settings.mother, TOLERANCE).tolist()
        hertz = frequencies(settings.scales, rate, settings.mother)
        return tuple(
            EarlyScale(float(a), float(hz), need / rate, float(early_error(ahead / a)))
            for a, hz, need in zip(settings.scales, hertz, needs, strict=True)
            if need > ahead
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
        newest = self._times[-1:] if len(self._times) else [-np.inf]
        stamps = np.where(np.isfinite(stamps), stamps, -np.inf)
        later = stamps > np.maximum.accumulate(np.concatenate([newest, stamps]))[:-1]
        values = values[later][:, self._columns]
        values[~measured(values)] = np.nan
        self._times = np.concatenate([self._times, stamps[later]])
        self._values = np.concatenate([self._values, values])
        if self.step is None and len(self._times) >= PERIOD_SAMPLES:
            self._set_period(float(np.median(np.diff(self._times[:PERIOD_SAMPLES]))))
        return self._labels(ended=False)

    def finish(self) -> LiveLabels:
        """End the stream: the labels that were waiting, with the last values held.

        A finished recogniser takes no further samples; make another one.
        """
        if self.step is None:
            steps = np.diff(self._times)
            self._set_period(float(np.median(steps)) if len(steps) else 1.0 / self.recogniser.rate)
        return self._labels(ended=True)

    def _set_period(self, period: float) -> None:
        """Plan hops and features for the device's period (s)."""
        self._rate = rate = grid_rate(self.recogniser, period)
        self.step, self.budget = period, budget_of(self.recogniser, self.latency, period)
        whole = needs_live_model(self.recogniser.settings)
        stage = _ModelStage if whole else _WaveletStage
        self._stage: _Stage = stage(self.recogniser, self.budget, rate)

    def _labels(self, ended: bool) -> LiveLabels:
        """The labels that are decided by the samples so far."""
        parts: list[LiveLabels] = []
        if self.budget is not None and len(self._times):
            for hop in self._complete_hops(self.budget, ended):
                with one_blas_thread():
                    parts += self._stage.push(hop)
            if ended:
                parts += self._stage.finish()
            self._forget(self._start + self._hops * self.budget.hop - self._stage.past)
        return _join_labels([_no_labels(self.recogniser), *parts])

    def _forget(self, before: float) -> None:
        """Samples before this time are needed no more, but for the latest."""
        gone = int(np.searchsorted(self._times, before, side="right")) - 1
        gone = max(0, min(gone, self._done))
        self._times, self._values = self._times[gone:], self._values[gone:]
        self._done -= gone

    def _complete_hops(self, budget: Budget, ended: bool) -> Iterator[_Hop | None]:
        """The hops that have all that they wait for; None for each without samples."""
        assert self.step is not None
        times, half = self._times, 0.5 * self.step
        # So many hops without samples decide all that waits: of a long gap no more are made.
        enough = budget.lag + bridged_steps(budget.hop) + 2
        if not self._hops:
            self._start = float(times[0])
        while self._done < len(times):
            ahead = float(times[self._done]) + half - self._start
            self._hops = max(self._hops, floor(ahead / budget.hop) - enough)
            begin = self._start + self._hops * budget.hop
            newest = begin + budget.complete
            end = int(np.searchsorted(times, newest - half))
            if end == len(times) and not ended:
                return
            # The newest sample itself, if it is not behind a gap.
            end += int(end < len(times) and times[end] < newest + half)
            last = int(np.searchsorted(times, begin + budget.hop - half))
            yield self._hop(begin, slice(self._done, last), end) if last > self._done else None
            self._done, self._hops = max(last, self._done), self._hops + 1

    def _hop(self, begin: float, samples: slice, end: int) -> _Hop:
        """The hop of some samples, from `begin` (s) on, that knows what is before `end`."""
        # From a step of the grid on, so that all hops have the same one.
        past = floor(min(self._stage.past, begin - self._start) * self._rate + 1e-6) / self._rate
        first = int(np.searchsorted(self._times, begin - past, side="right")) - 1
        stamps, values = (part[max(0, first) : end] for part in (self._times, self._values))
        if len(stamps) == 1:  # before its beginning a stream has its first value
            stamps = np.append(stamps - 1 / self._rate, stamps)
            values = np.repeat(values, 2, axis=0)
        seen = Demonstration("stream", "", stamps, values, self._channels)
        grid = on_grid(seen, self.recogniser.rate, start=begin - past)
        # What is missing at the end may become a gap.
        known = np.isfinite(values)
        newest = np.where(known.any(axis=0), known.shape[0] - 1 - known[::-1].argmax(axis=0), -1)
        until = stamps[newest.min()] if newest.min() >= 0 else -np.inf
        grid.valid[grid.times > until + 0.5 / grid.rate] = False
        times = self._times[samples]
        return _Hop(begin, times, nearest_steps(grid, times), grid, self._map.apply(grid.signals))


def recognise_with_latency(
    recogniser: Recogniser, demonstration: Demonstration, latency: float
) -> LiveLabels:
    """Recognise a demonstration as if it came live, with a latency in seconds."""
    online = OnlineRecogniser(recogniser, latency, demonstration.channels)
    times, signals = demonstration.times, demonstration.signals
    blocks = [slice(first, first + BLOCK) for first in range(0, len(times), BLOCK)]
    parts = [online.push(times[block], signals[block]) for block in blocks]
    return _join_labels([*parts, online.finish()])


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


def _no_labels(recogniser: Recogniser) -> LiveLabels:
    has = hasattr(recogniser.classifier, "predict_proba")
    probabilities = np.empty((0, len(recogniser.actions))) if has else None
    return LiveLabels(np.empty(0), np.empty(0, dtype=np.int64), probabilities)


def _join_labels(parts: Sequence[LiveLabels]) -> LiveLabels:
    probabilities = [part.probabilities for part in parts if part.probabilities is not None]
    return LiveLabels(
        np.concatenate([part.times for part in parts]),
        np.concatenate([part.codes for part in parts]),
        np.concatenate(probabilities) if probabilities else None,
    )
