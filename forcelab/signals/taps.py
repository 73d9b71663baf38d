"""What a force recording tells about its timing: taps, and its rate of change on a common grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.signals.conditioning import bridge

Array = NDArray[np.float64]

#: Samples a second at which taps are looked for, at most.
FINE = 500.0
#: Smoothing of the force before that, and of its rate of change, s.
SMOOTH, SCALE = 0.003, 0.02
#: A tap stands out from the running median over this time, s ...
REST = 0.3
#: ... by this many times what else stands out within this time of it, s ...
CLEAR, AROUND = 12.0, 0.25
#: ... and is not much less clear than the clearest of the recording ...
ALIKE = 0.25
#: ... and is down to a quarter of its height within this time, s.
LONGEST = 0.08
#: Samples a second at which the running median is taken.
COARSE = 100.0


@dataclass(frozen=True, slots=True)
class Tap:
    """A short strong pulse from rest.

    Parameters
    ----------
    time : float
        Of its onset, s on the force clock: where it has a quarter of its height.
    height : float
        In the unit of the force.
    clearness : float
        How many times higher it is than all else around it.
    """

    time: float
    height: float
    clearness: float


def find_taps(times: Array, force: Array) -> tuple[Tap, ...]:
    """Find the taps in a force recording.

    Parameters
    ----------
    times : ndarray, shape (n,)
        s, strictly increasing.
    force : ndarray, shape (n, c)
        NaN or infinity marks missing samples.

    Returns
    -------
    tuple of Tap
        In order of time.
    """
    from scipy.ndimage import gaussian_filter1d, maximum_filter1d, median_filter

    period = float(np.median(np.diff(times)))
    rate = min(1.0 / period, FINE)
    grid = np.arange(times[0], times[-1], 1.0 / rate)
    if grid.size < 8:
        return ()
    step = max(1, round(rate / COARSE))
    width = round(REST * rate / step) | 1
    power = np.zeros(grid.size)
    for column in force.T:
        smooth = gaussian_filter1d(_read(grid, times, column), max(SMOOTH * rate, 0.5))
        rest = median_filter(smooth[::step], width, mode="nearest")
        power += (smooth - np.interp(grid, grid[::step], rest)) ** 2
    pulse = np.sqrt(power)
    reach, own = round(AROUND * rate), round(0.75 * LONGEST * rate)
    floor = 6.0 * float(np.median(pulse)) + 1e-9 * float(
        np.max(np.abs(force), initial=0.0, where=np.isfinite(force))
    )
    highest = pulse == maximum_filter1d(pulse, 2 * reach + 1)
    taps = []
    for peak in np.flatnonzero(highest & (pulse > floor)).tolist():
        first, last = max(peak - reach, 0), min(peak + reach, pulse.size)
        below = np.flatnonzero(pulse[first:last] < pulse[peak] / 4) + first
        before, after = below[below < peak], below[below > peak]
        if before.size == 0 or after.size == 0 or after[0] - before[-1] > LONGEST * rate:
            continue
        around = np.concatenate([pulse[first : max(peak - own, first)], pulse[peak + own : last]])
        usual = float(np.quantile(around, 0.95)) if around.size else 0.0
        clearness = float(pulse[peak]) / max(usual, floor / 6.0)
        if clearness >= CLEAR:
            taps.append(Tap(float(grid[before[-1] + 1]), float(pulse[peak]), clearness))
    clearest = max((tap.clearness for tap in taps), default=0.0)
    return tuple(tap for tap in taps if tap.clearness >= ALIKE * clearest)


def rate_of_change(times: Array, force: Array, rate: float) -> tuple[Array, Array]:
    """The magnitude of the force's rate of change over all channels, on a uniform grid.

    Parameters
    ----------
    times : ndarray, shape (n,)
        s, strictly increasing.
    force : ndarray, shape (n, c)
        NaN or infinity marks missing samples, which straight lines bridge.
    rate : float
        Samples a second of the grid.

    Returns
    -------
    grid, magnitude : ndarray, shape (m,)
        s, and the force's unit a second, smoothed by a Gaussian of standard deviation
        :data:`SCALE`.
    """
    from scipy.ndimage import gaussian_filter1d

    grid = np.arange(times[0], times[-1], 1.0 / rate)
    power = np.zeros(grid.size)
    for column in force.T:
        power += (gaussian_filter1d(_read(grid, times, column), SCALE * rate, order=1) * rate) ** 2
    return grid, np.sqrt(power)


def _read(grid: Array, times: Array, column: Array) -> Array:
    """A channel at the grid's times, averaged where it has several samples for each of them."""
    from scipy.ndimage import uniform_filter1d

    values = bridge(np.asarray(column, dtype=np.float64))
    count = round((grid[1] - grid[0]) / float(np.median(np.diff(times)))) if grid.size > 1 else 1
    if count > 1:
        values = uniform_filter1d(values, count, mode="nearest")
    return np.interp(grid, times, values)
