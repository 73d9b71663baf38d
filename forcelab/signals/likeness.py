"""Motion in a video and a force compared for every shift between their clocks.

Three correlations are added up. Motion is abrupt where it exceeds its running median. It is
correlated with the logarithm of the force's rate of change, once as it is and once above *its*
running median; and the logarithm of the motion is, too. Taps count where the video has abrupt
motion.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.clock import ClockMap
from forcelab.signals.tapping import Tap, rate_of_change

__all__ = ["DRIFT", "Match", "Track", "best_shift", "force_track", "motion_track", "rates_to_try"]

Array = NDArray[np.float64]

#: Clocks differ by no more than this share ...
DRIFT = 1.2e-3
#: ... and rates are tried so closely that neither end is off by more than this, s.
SLIP = 0.02
#: Video and force have at least this share of the shorter one in common.
OVERLAP = 0.5
#: Running medians, s: of the motion and of the force's rate of change.
MOTION_REST, FORCE_REST = 0.23, 0.6
#: How much the taps count beside the correlations, and how exactly they are met, s.
TAPS, MET = 0.6, 0.02
#: A tap's strongest motion comes this long after its onset in the force, s.
TAP_CENTRE = 0.03
#: Taps that are looked at, the clearest ones.
MOST_TAPS = 24
#: Another peak of the score counts from this distance on, s.
APART = 0.3


@dataclass(frozen=True, eq=False)
class Track:
    """A signal on a grid of `rate` samples a second: its abrupt part, and the whole's logarithm."""

    times: Array
    abrupt: Array
    level: Array
    rate: float

    def shown(self) -> Array:
        """Times and abrupt part, the largest of it 1."""
        top = float(np.max(self.abrupt, initial=0.0))
        return np.stack([self.times, self.abrupt / top if top > 0 else self.abrupt])


@dataclass(frozen=True, slots=True)
class Match:
    """A shift: its score, the share of it that the next peak has, and its correlation alone."""

    clock: ClockMap
    score: float
    ratio: float
    alike: float


def motion_track(times: Array, energy: Array, rate: float) -> Track:
    """The video's motion on a grid of `rate` samples a second."""
    from scipy.ndimage import gaussian_filter1d

    middle = 0.5 * (times[1:] + times[:-1])
    grid = np.arange(middle[0], middle[-1], 1.0 / rate)
    abrupt = np.interp(grid, middle, _abrupt(times, energy))
    usual = float(np.median(energy[1:]))
    level = np.log(energy[1:] + 0.1 * usual + 1e-3)
    return Track(
        grid, gaussian_filter1d(abrupt, 0.015 * rate), np.interp(grid, middle, level), rate
    )


def _abrupt(times: Array, energy: Array) -> Array:
    """By how much the root of the energy exceeds its running median; shape (n - 1,)."""
    from scipy.ndimage import median_filter

    root = np.sqrt(np.maximum(energy[1:], 0.0))
    width = max(round(MOTION_REST / float(np.median(np.diff(times)))), 3) | 1
    return np.maximum(root - median_filter(root, width, mode="nearest"), 0.0)


def force_track(times: Array, force: Array, rate: float) -> Track:
    """The force's rate of change on a grid of `rate` samples a second."""
    from scipy.ndimage import gaussian_filter1d, median_filter

    grid, magnitude = rate_of_change(times, force, rate)
    quiet = float(np.quantile(magnitude, 0.3))
    quiet = quiet if quiet > 0 else float(np.max(magnitude)) * 1e-3 + 1e-12
    level = np.log1p(magnitude / quiet)
    width = round(FORCE_REST * rate) | 1
    abrupt = np.maximum(level - median_filter(level, width, mode="nearest"), 0.0)
    smooth = 0.015 * rate
    return Track(grid, gaussian_filter1d(abrupt, smooth), gaussian_filter1d(level, smooth), rate)


def rates_to_try(length: float) -> tuple[float, ...]:
    """The rates to try, from 1 outwards; 1 alone where the drift of a length (s) cannot be seen."""
    steps = int(DRIFT * length / 2.0 / (2.0 * SLIP))
    if steps < 2:
        return (1.0,)
    drifts = np.linspace(-DRIFT, DRIFT, 2 * steps + 1)
    return tuple(1.0 + drifts[np.argsort(np.abs(drifts))])


def best_shift(motion: Track, force: Track, taps: tuple[Tap, ...], drift: float) -> Match:
    """The best shift for one rate."""
    times = np.arange(motion.times[0] * drift, motion.times[-1] * drift, 1.0 / force.rate)
    abrupt = np.interp(times / drift, motion.times, motion.abrupt)
    level = np.interp(times / drift, motion.times, motion.level)
    pairs = ((abrupt, force.abrupt), (abrupt, force.level), (level, force.level))
    alike, lags = _correlation(pairs)
    shift = force.times[0] - times[0] + lags / force.rate
    score = alike + TAPS * _tapped(times, abrupt, taps, shift) if taps else alike
    top = int(np.argmax(score))
    far = np.abs(shift - shift[top]) > APART
    second, peak = float(np.max(score[far], initial=0.0)), float(score[top])
    clock = ClockMap(_vertex(shift, score, top), drift)
    return Match(clock, peak, second / peak if peak > 0 else 1.0, float(alike[top]))


def _vertex(x: Array, y: Array, top: int) -> float:
    """Where a parabola through the highest value and its neighbours is highest."""
    if 0 < top < y.size - 1:
        bend = y[top - 1] - 2.0 * y[top] + y[top + 1]
        if bend < 0:
            return float(x[top] + 0.5 * (x[1] - x[0]) * (y[top - 1] - y[top + 1]) / bend)
    return float(x[top])


def _correlation(pairs: Iterable[tuple[Array, Array]]) -> tuple[Array, NDArray[np.intp]]:
    """The mean correlation coefficient of pairs over what they have in common, for every shift.

    Gives the values and the shifts in samples for which the first of each pair is to be delayed,
    where there is enough overlap. Coefficients are weighted by the root of the overlap, since
    short ones are high by chance.
    """
    from scipy.fft import irfft, next_fast_len, rfft

    total: Array | None = None
    for one, other in pairs:
        n, m = one.size, other.size
        size = next_fast_len(n + m, real=True)
        a, b = (one - one.mean()) / _spread(one), (other - other.mean()) / _spread(other)
        fa, fb = rfft([np.ones(n), a, a * a], size), rfft([np.ones(m), b, b * b], size)

        def sums(i: int, j: int, fa: Any = fa, fb: Any = fb, size: int = size) -> Array:
            return np.asarray(irfft(np.conj(fa[i]) * fb[j], size))

        count = np.maximum(np.round(sums(0, 0)), 1.0)
        mean_a, mean_b = sums(1, 0) / count, sums(0, 1) / count
        power_a = np.maximum(sums(2, 0) / count - mean_a**2, 1e-3)
        power_b = np.maximum(sums(0, 2) / count - mean_b**2, 1e-3)
        value = (sums(1, 1) / count - mean_a * mean_b) / np.sqrt(power_a * power_b)
        value *= np.sqrt(np.minimum(count / min(n, m), 1.0)) / 3.0
        total = value if total is None else total + value
    assert total is not None
    lags = np.arange(total.size)
    lags[lags >= m] -= size
    enough = np.flatnonzero(count >= OVERLAP * min(n, m))
    order = enough[np.argsort(lags[enough])]
    return total[order], lags[order]


def _spread(values: Array) -> float:
    """The standard deviation, or 1 for a constant."""
    return float(np.std(values)) or 1.0


def _tapped(times: Array, abrupt: Array, taps: tuple[Tap, ...], shift: Array) -> Array:
    """How well the taps meet abrupt motion for each shift: -1..1, 0 where they are not filmed."""
    from scipy.ndimage import maximum_filter1d

    order = np.empty(abrupt.size)
    order[np.argsort(abrupt, kind="stable")] = np.linspace(-1.0, 1.0, abrupt.size)
    rank = np.where(order > 0, order**2, order)
    width = round(2.0 * MET / (times[1] - times[0])) | 1
    met = maximum_filter1d(rank, width)
    clearest = sorted(taps, key=lambda tap: -tap.clearness)[:MOST_TAPS]
    total = np.zeros(shift.size)
    for tap in clearest:
        total += np.interp(tap.time + TAP_CENTRE - shift, times, met, left=0.0, right=0.0)
    return total / len(clearest)
