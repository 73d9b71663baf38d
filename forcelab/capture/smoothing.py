"""Afterwards: when a device's samples were taken, by all that arrived.

The offline counterpart of :mod:`forcelab.capture.clocks`: the earliest arrival of each window, and
through them lines fitted by least squares with weights that fall by half every 90 s *both* ways in
time, as a smoother is made of a filter run forwards and one run backwards. So the first sample is
as well known as the last, and a crystal that warms up is followed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.clocks import HALF_LIFE, STEP, WINDOW

__all__ = ["Stamped", "stamped"]

_AROUND = 1.0  # s on either side of a step that tell whether it stays
_ENOUGH = 0.5  # s of arrivals after a step that tell it from a delay, at least
_LONG = 30.0  # s, at most, over which the rate is guessed
_LATE = 0.003  # s behind the lines, at least, of windows that are left out
_RUNNING = 41  # windows of the running median that tells them first


@dataclass(frozen=True, eq=False)
class Stamped:
    """When the samples of a device were taken.

    Parameters
    ----------
    host : ndarray of float64, shape (n,)
        Seconds of the host's monotonic clock; increasing within a stretch.
    stretches : ndarray of int64, shape (s,)
        The first sample of each stretch of ticks.
    offset : float
        Host time (s) at which the counter reads zero, in the longest stretch.
    rate : float
        Seconds of the host that one tick takes there.
    residual : float
        Root mean square distance, in s, of the windows' earliest arrivals from the lines.
    """

    host: NDArray[np.float64]
    stretches: NDArray[np.int64]
    offset: float
    rate: float
    residual: float


def stamped(
    arrived: NDArray[np.float64], ticks: NDArray[np.int64], breaks: NDArray[np.int64] | None = None
) -> Stamped:
    """Find out when samples were taken.

    Parameters
    ----------
    arrived : ndarray of float64, shape (n,), n >= 1
        When each was read, in seconds of the host's monotonic clock; not decreasing.
    ticks : ndarray of int64, shape (n,)
        The device's counter, in samples.
    breaks : ndarray of int64, shape (b,), optional
        Samples with which the counter is known to begin anew, such as after plugging in.

    Returns
    -------
    Stamped
    """
    rate = _guess(arrived, ticks, 8)
    known = np.empty(0, dtype=np.int64) if breaks is None else breaks
    jumps = _jumps(arrived, ticks, rate, known)
    firsts = np.unique(np.concatenate([[0], known, jumps]).astype(np.int64))
    firsts = firsts[firsts < len(ticks)]
    lasts = np.append(firsts[1:], len(ticks))
    host = np.empty(len(ticks))
    squares, windows = 0.0, 0
    for first, last in zip(firsts.tolist(), lasts.tolist(), strict=True):
        piece = slice(first, last)
        own = _guess(arrived[piece], ticks[piece], 2) if last - first > 8 else rate
        host[piece], square, used = _stretch(arrived[piece], ticks[piece], own)
        squares, windows = squares + square, windows + used
    longest = int(np.argmax(lasts - firsts))
    piece = slice(int(firsts[longest]), int(lasts[longest]))
    offset, slope = _line(host[piece], ticks[piece], rate)
    return Stamped(host, firsts, offset, slope, float(np.sqrt(squares / max(windows, 1))))


def _guess(arrived: NDArray[np.float64], ticks: NDArray[np.int64], parts: int) -> float:
    """Seconds a tick: the median over pairs up to 1 / `parts` of the samples apart.

    Few of them have a jump between them where these parts are many.
    """
    n = len(ticks)
    if n < 2:
        return 1e-3
    rough = (arrived[-1] - arrived[0]) / n
    apart = int(np.clip(_LONG / rough if rough > 0 else n, 1, max(n // parts, 1)))
    begin = np.arange(0, n - apart, max(1, (n - apart) // 20_000))
    steps = ticks[begin + apart] - ticks[begin]
    slopes = (arrived[begin + apart] - arrived[begin])[steps > 0] / steps[steps > 0]
    slopes = slopes[slopes > 0]
    return float(np.median(slopes)) if len(slopes) else 1e-3


def _jumps(
    arrived: NDArray[np.float64],
    ticks: NDArray[np.int64],
    rate: float,
    known: NDArray[np.int64],
) -> NDArray[np.int64]:
    """Samples before which the counter jumped, or stood still while time went on."""
    steps = np.diff(ticks)
    off = np.diff(arrived) - rate * steps
    threshold = max(STEP, 0.6 * rate)
    back = np.flatnonzero(steps <= 0) + 1
    edges = np.unique(np.concatenate([[0], known, back, [len(ticks)]]))
    behind = arrived - rate * (ticks - ticks[0])
    found: list[int] = []
    for i in (np.flatnonzero((np.abs(off) > threshold) & (steps > 0)) + 1).tolist():
        place = int(np.searchsorted(edges, i, side="right"))
        first, last = int(edges[place - 1]), int(edges[place])
        if first == i:
            continue
        low = max(int(np.searchsorted(arrived, arrived[i - 1] - _AROUND)), first, *found[-1:])
        high = min(int(np.searchsorted(arrived, arrived[i] + _AROUND)), last)
        # Delays end soon after they began; what still disagrees a second later is the counter.
        if off[i - 1] > 0 and arrived[high - 1] - arrived[i] < _ENOUGH:
            continue
        before = float(behind[min(low, i - 1) : i].min())
        if abs(float(behind[i : max(high, i + 1)].min()) - before) > 0.75 * threshold:
            found.append(i)
    return np.union1d(back, np.array(found, dtype=np.int64))


def _stretch(
    arrived: NDArray[np.float64], ticks: NDArray[np.int64], rate: float
) -> tuple[NDArray[np.float64], float, int]:
    """Host times of a stretch without jumps; its windows' squared residuals, and their number."""
    at = rate * (ticks - ticks[0])
    late = arrived - at
    number = np.floor(at / WINDOW).astype(np.int64)
    starts = np.concatenate([[0], np.flatnonzero(np.diff(number)) + 1])
    filled = number[starts]
    earliest = np.zeros(int(filled[-1]) + 1)
    base = float(late.min())  # small numbers keep their digits
    earliest[filled] = np.minimum.reduceat(late, starts) - base
    weights = np.zeros(len(earliest))
    weights[filled] = 1.0
    weights[filled] = ~_outlying(earliest[filled], _running(earliest[filled]))
    for _ in range(3):
        smooth = _smooth(earliest, weights)
        weights[filled] = ~_outlying(earliest[filled], smooth[filled])
    used = weights > 0
    squares = float(np.sum((earliest - smooth)[used] ** 2))
    centres = (np.arange(len(earliest)) + 0.5) * WINDOW
    return at + base + np.interp(at, centres, smooth), squares, int(used.sum())


def _running(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """A running median."""
    from scipy.ndimage import median_filter

    smooth: NDArray[np.float64] = median_filter(
        values, size=min(_RUNNING, len(values)), mode="nearest"
    )
    return smooth


def _outlying(values: NDArray[np.float64], smooth: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which windows are late; never all of them."""
    off = values - smooth
    spread = float(np.median(np.abs(off)))
    late = off > max(_LATE, 6.0 * spread)
    return np.zeros_like(late) if late.all() else late


def _smooth(values: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """The value at each window of the line fitted with weights that halve in 90 s either way."""
    fade = 0.5 ** (WINDOW / HALF_LIFE)
    s0, s1, s2 = _moments(weights, fade)
    t0, t1, _ = _moments(weights * values, fade)
    power = s0 * s2 - s1 * s1
    straight = power > 1e-9 * s0 * s0
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(straight, (s2 * t0 - s1 * t1) / power, t0 / s0)


def _moments(values: NDArray[np.float64], fade: float) -> tuple[NDArray[np.float64], ...]:
    """Sums of ``fade^|m| m^p values[k + m]`` over m for p = 0, 1, 2, each of shape (n,)."""
    past = _past(values, fade)
    coming = [sums[::-1] for sums in _past(values[::-1], fade)]
    return past[0] + coming[0] - values, coming[1] - past[1], past[2] + coming[2]


def _past(values: NDArray[np.float64], fade: float) -> tuple[NDArray[np.float64], ...]:
    """The same sums over what is before each value, with the sign of `m` turned.

    A loop, for it is one of some thousand windows: to load scipy.signal would take longer.
    """
    rows = np.empty((len(values), 3))
    s0 = s1 = s2 = 0.0
    for k, value in enumerate(values.tolist()):
        s2 = fade * (s2 + 2.0 * s1 + s0)
        s1 = fade * (s1 + s0)
        s0 = fade * s0 + value
        rows[k] = s0, s1, s2
    return rows[:, 0], rows[:, 1], rows[:, 2]


def _line(host: NDArray[np.float64], ticks: NDArray[np.int64], rate: float) -> tuple[float, float]:
    """Offset and rate of the line through a stretch."""
    x = (ticks - ticks[0]).astype(np.float64)
    y = host - host[0]
    spread = x - x.mean()
    power = float(spread @ spread)
    slope = float(spread @ y) / power if power > 0 else rate
    return float(host[0] + y.mean() - slope * (x.mean() + float(ticks[0]))), slope
