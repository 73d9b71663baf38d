"""A video's clock, found from where its motion and the force change abruptly together.

Motion and force are compared for every shift between their clocks; three correlations are added
up. Motion is abrupt where it exceeds its running median. It is correlated with the logarithm of
the force's rate of change, once as it is and once above *its* running median; and the logarithm of
the motion is, too. Taps of a finger count where the video has abrupt motion; they make the best
shift exact, and how far the result may be believed is decided last.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from operator import attrgetter

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forcelab.arrays import Real
from forcelab.clock import ClockMap, fit_clock
from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.project.media import name_video
from forcelab.signals.conditioning import bridge
from forcelab.signals.grid import readings
from forcelab.video.motion import measuring_motion

#: Samples a second at which taps are looked for, at most.
TAP_RATE = 500.0
#: Smoothing of the force before that, and of its rate of change, s.
FORCE_SMOOTHING, CHANGE_SMOOTHING = 0.003, 0.02
#: A tap stands out from the running median over this time, s ...
TAP_MEDIAN = 0.3
#: ... by this many times what else stands out within this time of it, s ...
LEAST_CLEARNESS, TAP_SURROUNDINGS = 12.0, 0.25
#: ... and is not much less clear than the clearest of the recording ...
LEAST_RELATIVE_CLEARNESS = 0.25
#: ... and is down to a quarter of its height within this time, s.
LONGEST_TAP = 0.08
#: Samples a second at which the running median is taken.
MEDIAN_RATE = 100.0


@dataclass(frozen=True, slots=True)
class Tap:
    """A short strong pulse from rest."""

    time: float  # of its onset, s on the force clock: where it has a quarter of its height
    height: float  # in the unit of the force
    clearness: float  # how many times higher it is than all else around it


def find_taps(times: Real, force: Real) -> tuple[Tap, ...]:
    """Find the taps in a force recording.

    `times` (n,): s, strictly increasing; `force` (n, c): NaN or infinity marks missing samples.
    They come in order of time.
    """
    from scipy.ndimage import gaussian_filter1d, maximum_filter1d, median_filter

    period = float(np.median(np.diff(times)))
    rate = min(1.0 / period, TAP_RATE)
    grid = np.arange(times[0], times[-1], 1.0 / rate)
    if grid.size < 8:
        return ()
    step = max(1, round(rate / MEDIAN_RATE))
    width = round(TAP_MEDIAN * rate / step) | 1
    power = np.zeros(grid.size)
    for column in force.T:
        smooth = gaussian_filter1d(_read(grid, times, column), max(FORCE_SMOOTHING * rate, 0.5))
        rest = median_filter(smooth[::step], width, mode="nearest")
        power += (smooth - np.interp(grid, grid[::step], rest)) ** 2
    pulse = np.sqrt(power)
    reach, own_reach = round(TAP_SURROUNDINGS * rate), round(0.75 * LONGEST_TAP * rate)
    floor = 6.0 * float(np.median(pulse)) + 1e-9 * float(
        np.max(np.abs(force), initial=0.0, where=np.isfinite(force))
    )
    highest = pulse == maximum_filter1d(pulse, 2 * reach + 1)
    taps = []
    for peak in np.flatnonzero(highest & (pulse > floor)).tolist():
        first, last = max(peak - reach, 0), min(peak + reach, pulse.size)
        below = np.flatnonzero(pulse[first:last] < pulse[peak] / 4) + first
        before, after = below[below < peak], below[below > peak]
        if before.size == 0 or after.size == 0 or after[0] - before[-1] > LONGEST_TAP * rate:
            continue
        around = np.concatenate(
            [pulse[first : max(peak - own_reach, first)], pulse[peak + own_reach : last]]
        )
        usual = float(np.quantile(around, 0.95)) if around.size else 0.0
        clearness = float(pulse[peak]) / max(usual, floor / 6.0)
        if clearness >= LEAST_CLEARNESS:
            taps.append(Tap(float(grid[before[-1] + 1]), float(pulse[peak]), clearness))
    clearest = max((tap.clearness for tap in taps), default=0.0)
    return tuple(tap for tap in taps if tap.clearness >= LEAST_RELATIVE_CLEARNESS * clearest)


def rate_of_change(times: Real, force: Real, rate: float) -> tuple[Real, Real]:
    """The magnitude of the force's rate of change over all channels, on a uniform grid.

    `times` (n,): s, strictly increasing; `force` (n, c): NaN or infinity marks missing samples,
    which straight lines bridge; `rate`: samples a second of the grid. Gives `grid`, `magnitude`
    (m,): s, and the force's unit a second, smoothed by a Gaussian of standard deviation
    :data:`CHANGE_SMOOTHING`.
    """
    from scipy.ndimage import gaussian_filter1d

    grid = np.arange(times[0], times[-1], 1.0 / rate)
    power = np.zeros(grid.size)
    for column in force.T:
        power += (
            gaussian_filter1d(_read(grid, times, column), CHANGE_SMOOTHING * rate, order=1) * rate
        ) ** 2
    return grid, np.sqrt(power)


def _read(grid: Real, times: Real, column: Real) -> Real:
    """A channel at the grid's times, averaged where it has several samples for each of them."""
    from scipy.ndimage import uniform_filter1d

    values = bridge(np.asarray(column, dtype=np.float64))
    count = round((grid[1] - grid[0]) / float(np.median(np.diff(times)))) if grid.size > 1 else 1
    if count > 1:
        values = uniform_filter1d(values, count, mode="nearest")
    return np.interp(grid, times, values)


#: Clocks differ by no more than this share ...
MOST_DRIFT = 1.2e-3
#: ... and rates are tried so closely that neither end is off by more than this, s.
MOST_END_ERROR = 0.02
#: Video and force have at least this share of the shorter one in common.
LEAST_OVERLAP = 0.5
#: Running medians, s: of the motion and of the force's rate of change.
MOTION_MEDIAN, FORCE_MEDIAN = 0.23, 0.6
#: How much the taps count beside the correlations, and how exactly they are met, s.
TAP_WEIGHT, TAP_PRECISION = 0.6, 0.02
#: A tap's strongest motion comes this long after its onset in the force, s.
TAP_CENTRE = 0.03
#: Taps that are looked at, the clearest ones.
MOST_TAPS = 24
#: Another peak of the score counts from this distance on, s.
PEAK_DISTANCE = 0.3


@dataclass(frozen=True, eq=False)
class MotionSignal:
    """A signal on a grid of `rate` samples a second: its abrupt part, and the whole's logarithm."""

    times: Real
    abrupt: Real
    level: Real
    rate: float

    def to_show(self) -> Real:
        """Times and abrupt part, the largest of it 1."""
        top = float(np.max(self.abrupt, initial=0.0))
        return np.stack([self.times, self.abrupt / top if top > 0 else self.abrupt])


@dataclass(frozen=True, slots=True)
class Lag:
    """A shift: its score, the share of it that the next peak has, and its correlation alone."""

    clock: ClockMap
    score: float
    ratio: float
    alike: float


def video_signal(times: Real, energy: Real, rate: float) -> MotionSignal:
    """The video's motion on a grid of `rate` samples a second."""
    from scipy.ndimage import gaussian_filter1d

    middle = 0.5 * (times[1:] + times[:-1])
    grid = np.arange(middle[0], middle[-1], 1.0 / rate)
    abrupt = np.interp(grid, middle, _abrupt_motion(times, energy))
    usual = float(np.median(energy[1:]))
    level = np.log(energy[1:] + 0.1 * usual + 1e-3)
    return MotionSignal(
        grid, gaussian_filter1d(abrupt, 0.015 * rate), np.interp(grid, middle, level), rate
    )


def _abrupt_motion(times: Real, energy: Real) -> Real:
    """By how much the root of the energy exceeds its running median; shape (n - 1,)."""
    from scipy.ndimage import median_filter

    root = np.sqrt(np.maximum(energy[1:], 0.0))
    width = max(round(MOTION_MEDIAN / float(np.median(np.diff(times)))), 3) | 1
    return np.maximum(root - median_filter(root, width, mode="nearest"), 0.0)


def force_signal(times: Real, force: Real, rate: float) -> MotionSignal:
    """The force's rate of change on a grid of `rate` samples a second."""
    from scipy.ndimage import gaussian_filter1d, median_filter

    grid, magnitude = rate_of_change(times, force, rate)
    quiet = float(np.quantile(magnitude, 0.3))
    quiet = quiet if quiet > 0 else float(np.max(magnitude)) * 1e-3 + 1e-12
    level = np.log1p(magnitude / quiet)
    width = round(FORCE_MEDIAN * rate) | 1
    abrupt = np.maximum(level - median_filter(level, width, mode="nearest"), 0.0)
    smooth = 0.015 * rate
    return MotionSignal(
        grid, gaussian_filter1d(abrupt, smooth), gaussian_filter1d(level, smooth), rate
    )


def rates_to_try(length: float) -> tuple[float, ...]:
    """The rates to try, from 1 outwards; 1 alone where the drift of a length (s) cannot be seen."""
    steps = int(MOST_DRIFT * length / 2.0 / (2.0 * MOST_END_ERROR))
    if steps < 2:
        return (1.0,)
    drifts = np.linspace(-MOST_DRIFT, MOST_DRIFT, 2 * steps + 1)
    return tuple(1.0 + drifts[np.argsort(np.abs(drifts))])


def best_shift(
    motion: MotionSignal, force: MotionSignal, taps: tuple[Tap, ...], drift: float
) -> Lag:
    """The best shift for one rate."""
    times = np.arange(motion.times[0] * drift, motion.times[-1] * drift, 1.0 / force.rate)
    abrupt = np.interp(times / drift, motion.times, motion.abrupt)
    level = np.interp(times / drift, motion.times, motion.level)
    pairs = ((abrupt, force.abrupt), (abrupt, force.level), (level, force.level))
    alike, lags = _correlation(pairs)
    shift = force.times[0] - times[0] + lags / force.rate
    score = alike + TAP_WEIGHT * _tap_votes(times, abrupt, taps, shift) if taps else alike
    top = int(np.argmax(score))
    far = np.abs(shift - shift[top]) > PEAK_DISTANCE
    second, peak = float(np.max(score[far], initial=0.0)), float(score[top])
    clock = ClockMap(_vertex(shift, score, top), drift)
    return Lag(clock, peak, second / peak if peak > 0 else 1.0, float(alike[top]))


def _vertex(x: Real, y: Real, top: int) -> float:
    """Where a parabola through the highest value and its neighbours is highest."""
    if 0 < top < y.size - 1:
        bend = y[top - 1] - 2.0 * y[top] + y[top + 1]
        if bend < 0:
            return float(x[top] + 0.5 * (x[1] - x[0]) * (y[top - 1] - y[top + 1]) / bend)
    return float(x[top])


def _correlation(pairs: Sequence[tuple[Real, Real]]) -> tuple[Real, NDArray[np.intp]]:
    """The mean correlation coefficient of pairs over what they have in common, for every shift.

    Gives the values and the shifts in samples for which the first of each pair is to be delayed,
    where there is enough overlap. Coefficients are weighted by the root of the overlap, since
    short ones are high by chance.
    """
    from scipy.fft import irfft, next_fast_len, rfft

    n, m = pairs[0][0].size, pairs[0][1].size
    size = next_fast_len(n + m, real=True)

    def sums(first: NDArray[np.complex128], second: NDArray[np.complex128]) -> Real:
        return np.asarray(irfft(np.conj(first) * second, size))

    total = np.zeros(size)
    for first, second in pairs:
        a, b = (first - first.mean()) / _spread(first), (second - second.mean()) / _spread(second)
        ones_a, fa, squares_a = rfft([np.ones(n), a, a * a], size)
        ones_b, fb, squares_b = rfft([np.ones(m), b, b * b], size)
        count = np.maximum(np.round(sums(ones_a, ones_b)), 1.0)
        mean_a, mean_b = sums(fa, ones_b) / count, sums(ones_a, fb) / count
        power_a = np.maximum(sums(squares_a, ones_b) / count - mean_a**2, 1e-3)
        power_b = np.maximum(sums(ones_a, squares_b) / count - mean_b**2, 1e-3)
        value = (sums(fa, fb) / count - mean_a * mean_b) / np.sqrt(power_a * power_b)
        total += value * (np.sqrt(np.minimum(count / min(n, m), 1.0)) / 3.0)
    lags = np.arange(total.size)
    lags[lags >= m] -= size
    enough = np.flatnonzero(count >= LEAST_OVERLAP * min(n, m))
    order = enough[np.argsort(lags[enough])]
    return total[order], lags[order]


def _spread(values: Real) -> float:
    """The standard deviation, or 1 for a constant."""
    return float(np.std(values)) or 1.0


def _tap_votes(times: Real, abrupt: Real, taps: tuple[Tap, ...], shift: Real) -> Real:
    """How well the taps meet abrupt motion for each shift: -1..1, 0 where they are not filmed."""
    from scipy.ndimage import maximum_filter1d

    order = np.empty(abrupt.size)
    order[np.argsort(abrupt, kind="stable")] = np.linspace(-1.0, 1.0, abrupt.size)
    rank = np.where(order > 0, order**2, order)
    width = round(2.0 * TAP_PRECISION / (times[1] - times[0])) | 1
    peaks = maximum_filter1d(rank, width)
    clearest = sorted(taps, key=lambda tap: -tap.clearness)[:MOST_TAPS]
    total = np.zeros(shift.size)
    for tap in clearest:
        total += np.interp(tap.time + TAP_CENTRE - shift, times, peaks, left=0.0, right=0.0)
    return total / len(clearest)


#: Samples a second of the common grid, and of that for recordings longer than the third, s.
GRID_RATE, COARSE_GRID_RATE, LONG_RECORDING = 200.0, 50.0, 900.0
#: Frames or samples needed.
FEWEST_SAMPLES = 16
#: The share of the highest peak that the next one has: nothing is sure from the first on, all is
#: at the second. Measured on simulated demonstrations, with and without their taps.
DOUBTFUL_PEAK_RATIO, SURE_PEAK_RATIO = 0.9, 0.55
#: The same for the correlation alone: taps may meet anything in a video that shows nothing.
DOUBTFUL_CORRELATION, SURE_CORRELATION = 0.08, 0.2
#: Without two taps that agree nothing is proposed with more confidence.
CONFIDENCE_WITHOUT_TAPS = 0.45
#: How far from the coarse shift a tap's frame is looked for, s.
TAP_SEARCH = 0.08
#: How far the coarse comparison is trusted, s; how far from the shift that fits all taps one of
#: them may lie, in frames, and how much motion must grow there, in usual growths.
COARSE_ERROR, MOST_FRAMES_AWAY, LEAST_GROWTH = 0.05, 1.0, 0.5
#: By how much the motion grows at the taps on average, in usual growths: nothing is sure below the
#: first, as another motion may be meant; all is from the second on.
DOUBTFUL_GROWTH, SURE_GROWTH = 0.5, 1.0
#: A proposal with less confidence is one to look at twice.
TRUSTED_CONFIDENCE = 0.5
#: Taps further from the fitted clock than this share of a frame's time do not agree.
MOST_DISAGREEMENT = 1.0


@dataclass(frozen=True, eq=False)
class Proposal:
    """A clock that was found, and how far it may be believed."""

    clock: ClockMap  # from the video's own time to force time
    #: 0..1. Of the 30 demonstrations of the sample project 22 were above 0.5, all of them right to
    #: within 19 ms, and all 30 to within 50 ms; of 20 made after the bounds were set 15, to within
    #: 18 ms. Above 0.5 were also 15 of 309 videos put to the force of another demonstration, whose
    #: taps happened to fit: of the same task one in nine.
    confidence: float
    residual: float  # root mean square distance of the taps from the clock, s; 0 without taps
    #: Pairs of video and force time (s) at which a tap was found in both.
    taps: tuple[tuple[float, float], ...]
    #: motion and force: (2, m), what was compared, for looking at: rows of own times (s) and values
    #: of 0..1.
    motion: Real
    force: Real

    @property
    def doubtful(self) -> bool:
        """Whether it is to be looked at before it is believed."""
        return self.confidence < TRUSTED_CONFIDENCE


def propose_clock_for(
    demonstration: Demonstration, video: str | None = None
) -> Generator[Progress, None, Proposal]:
    """Propose the clock of a demonstration's video, by default its first one.

    See :func:`propose_clock`.
    Channels in newtons are looked at; where there is none, all channels in equal parts.
    """
    reference = demonstration.find_video(video)
    try:
        motion = yield from measuring_motion(reference.path)
    except InputError as error:
        raise InputError(name_video(str(error), reference, demonstration)) from error
    force = demonstration.signals
    newtons = [channel.unit == "N" for channel in demonstration.channels]
    if any(newtons):
        force = force[:, newtons]
    else:
        force = _valid_readings(force)  # as recorded: divided, a glitch would be none
        spread = np.nanstd(force, axis=0)
        force = force / np.where(spread > 0, spread, 1.0)
    return (yield from propose_clock(motion.times, motion.energy, demonstration.times, force))


def propose_clock(
    frame_times: ArrayLike, energy: ArrayLike, force_times: ArrayLike, force: ArrayLike
) -> Generator[Progress, None, Proposal]:
    """Propose a video's clock from its motion and the force.

    `frame_times` (n,): timestamps of the frames on the video's clock, s, strictly increasing;
    `energy` (n,): motion between the frame before and each frame, such as of
    :func:`~forcelab.video.motion.measuring_motion`; `force_times` (m,): stamps of the force's
    samples, s, strictly increasing; `force` (m,): force channels; NaN or infinity marks missing
    samples.

    The offset has no bounds but that video and force overlap by half of the shorter one. The rate
    stays 1 unless the recording is long enough to tell: clocks differ by some 50e-6, a tap is seen
    to half a frame's time, so that a rate from taps ten seconds apart would be worse than none.
    """
    t, e = _check_series(frame_times, energy, "video")
    ft, f = _check_series(force_times, force, "force")
    f = _valid_readings(f)  # beside a glitch no tap would be clear
    yield Progress(0, 1, "looking for taps in the force")
    taps = find_taps(ft, f)
    grid = GRID_RATE if max(t[-1] - t[0], ft[-1] - ft[0]) <= LONG_RECORDING else COARSE_GRID_RATE
    motion = video_signal(t, e[:, 0], grid)
    rate = force_signal(ft, f, grid)
    rates = rates_to_try(min(float(t[-1] - t[0]), float(ft[-1] - ft[0])))
    lags = []
    for done, drift in enumerate(rates):
        yield Progress(done, len(rates), "comparing motion and force")
        lags.append(best_shift(motion, rate, taps, drift))
    best = max(lags, key=attrgetter("score"))
    clock, residual, pairs, clear = _refine_by_taps(best.clock, t, e[:, 0], taps)
    confidence = _share_between(best.ratio, DOUBTFUL_PEAK_RATIO, SURE_PEAK_RATIO) * _share_between(
        best.alike, DOUBTFUL_CORRELATION, SURE_CORRELATION
    )
    confidence = min(CONFIDENCE_WITHOUT_TAPS, confidence) if clear is None else confidence * clear
    return Proposal(clock, confidence, residual, pairs, motion.to_show(), rate.to_show())


def _valid_readings(force: Real) -> Real:
    """Force channels (m, c) with NaN for what no sensor can have read."""
    return np.stack([readings(channel) for channel in force.T], axis=1)


def _share_between(value: float, zero: float, full: float) -> float:
    """Where a value lies between two, 0..1."""
    return float(np.clip((value - zero) / (full - zero), 0.0, 1.0))


def _check_series(times: ArrayLike, values: ArrayLike, noun: str) -> tuple[Real, Real]:
    """Times (n,) and values (n, c) as floats."""
    t = np.asarray(times, dtype=np.float64)
    v = np.asarray(values, dtype=np.float64)
    v = v[:, np.newaxis] if v.ndim == 1 else v
    if t.ndim != 1 or v.ndim != 2 or len(v) != t.size:
        raise InputError(
            f"Synchronising needs one time for each value of the {noun}; there are {t.size} times "
            f"and values of shape {v.shape}."
        )
    if t.size < FEWEST_SAMPLES or t[-1] - t[0] < 1.0:
        raise InputError(
            f"The {noun} is too short to find the video's clock by; mark a tap by hand instead."
        )
    return t, v


def _refine_by_taps(
    coarse: ClockMap, times: Real, energy: Real, taps: tuple[Tap, ...]
) -> tuple[ClockMap, float, tuple[tuple[float, float], ...], float | None]:
    """The clock through the taps, its residual (s), the taps, and how clearly they are seen, 0..1.

    The last is None unless two or more are seen, and agree.

    A tap lies between the frame that first shows it and the one before, where the motion grows.
    One tap alone may be mistaken for another motion near it; so the shift is taken for which the
    motion grows most at all of them together. The rate is changed only where the taps tell it
    beyond three times their uncertainty.
    """
    frame = float(np.median(np.diff(times)))
    middle = 0.5 * (times[1:] + times[:-1])
    growth = _motion_growth(energy)
    places = coarse.to_device([tap.time for tap in taps])
    filmed = (places > middle[0]) & (places < middle[-1])
    tap_times = np.array([tap.time for tap in taps])[filmed]
    places = places[filmed]
    if tap_times.size == 0:
        return coarse, 0.0, (), None
    shifts = np.arange(-TAP_SEARCH, TAP_SEARCH + 5e-4, 1e-3)
    between = np.searchsorted(times, places[:, np.newaxis] + shifts) - 1
    grown = growth[np.clip(between, 0, growth.size - 1)]
    votes = grown.sum(axis=0)
    top = int(np.argmax(votes * np.exp(-0.5 * (shifts / COARSE_ERROR) ** 2)))
    # The taps stay between the same frames for a while: the middle of it is the likeliest.
    same = np.flatnonzero((between == between[:, top : top + 1]).all(axis=0))
    shift = float(0.5 * (shifts[same[0]] + shifts[same[-1]]))
    pairs = []
    for place, time in zip((places + shift).tolist(), tap_times.tolist(), strict=True):
        near = np.flatnonzero(np.abs(middle - place) <= MOST_FRAMES_AWAY * frame)
        if near.size and growth[near].max() > LEAST_GROWTH:
            pairs.append((float(middle[near[np.argmax(growth[near])]]), time))
    if not pairs:
        return coarse, 0.0, (), None
    clock = ClockMap(coarse.offset - coarse.rate * shift, coarse.rate)
    frame_times, tap_times = np.array(pairs).T
    spread = float(np.sqrt(np.sum((frame_times - frame_times.mean()) ** 2)))
    if len(pairs) > 1 and spread > 0:
        fitted = fit_clock(frame_times.tolist(), tap_times.tolist()).clock
        # A tap is uncertain by a frame's time, evenly.
        unsure = frame / np.sqrt(12.0) / spread
        if 3.0 * unsure < abs(fitted.rate - coarse.rate) and abs(fitted.rate - 1.0) < MOST_DRIFT:
            clock = fitted
    away = np.abs(clock.to_force(frame_times) - tap_times)
    agree = len(pairs) > 1 and bool(np.all(away <= MOST_DISAGREEMENT * frame))
    clear = (
        _share_between(float(votes[top]) / tap_times.size, DOUBTFUL_GROWTH, SURE_GROWTH)
        if agree
        else None
    )
    return clock, float(np.sqrt(np.mean(away**2))), tuple(pairs), clear


def _motion_growth(energy: Real) -> Real:
    """By how much more moves in a frame and the next than in the two before, in usual amounts.

    Two, since what touches slows down before and is seen for more than one frame.
    """
    root = np.sqrt(np.maximum(energy[1:], 0.0))
    x = np.concatenate([np.repeat(root[:1], 2), root, root[-1:]])
    growth = x[2:-1] + x[3:] - x[1:-2] - x[:-3]
    usual = float(np.quantile(np.abs(growth), 0.8)) or 1.0
    return np.minimum(growth / usual, 4.0)
