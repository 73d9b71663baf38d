"""When a device's samples were taken, by all that arrived, once a recording has ended.

The offline counterpart of :mod:`forcelab.capture.clock`: the earliest arrival of each window, and
through them lines fitted by least squares with weights that fall by half every 90 s *both* ways in
time, as a smoother is made of a filter run forwards and one run backwards. So the first sample is
as well known as the last, and a crystal that warms up is followed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.clock import HALF_LIFE, JUMP, WINDOW

_JUMP_MARGIN = 1.0  # s on either side of a jump of the counter that tell whether it is one
_STANDSTILL = 10.0  # s of late samples, none lost, that say that the counter stood still
_LEAST_AFTER_JUMP = 0.5  # s of arrivals after a step that tell it from a delay, at least
_LONGEST_PAIR = 30.0  # s, at most, over which the rate is guessed
_SHORTEST_PAIR = 0.25  # s, at least, where there are as many: nearer ones tell bursts of 16 ms
_SHORT_STRETCH = 5.0  # s over which a guess is no better than what a crystal promises
_MOST_CONTRADICTION = 0.1  # s by which a guess may contradict the configured rate
# Shares by which the pace of a pair of samples may be off that of the device: by more, one of them
# waited in a backlog or some were lost between them. Then of a configured rate, and of a guess.
_NEAR_STATED, _NEAR_GUESS = 0.5, 0.02
_LEAST_NEAR_SHARE = 0.02  # share of the pairs that have to be so near to say more than all of them
_LATENESS = 0.003  # s behind the lines, at least, of windows that are left out
_NEIGHBOURS = 20  # windows on either side of which the earliest tells first which are late
# The slope is believed to differ from the guess by some 200 ppm of a crystal, and windows' earliest
# arrivals to be off by some ms: the square of their ratio, in windows, is the weight of that.
_STIFFNESS = (1e-3 / (2e-4 * WINDOW)) ** 2


@dataclass(frozen=True, eq=False)
class Timestamps:
    """When the samples of a device were taken."""

    #: Seconds of the host's monotonic clock, shape (n,); increasing within a stretch.
    host: NDArray[np.float64]
    #: The first sample of each stretch of ticks, shape (s,).
    stretches: NDArray[np.int64]
    #: Host time (s) at which the counter reads zero, in the longest stretch.
    offset: float
    #: Host seconds a tick there.
    rate: float
    #: RMS distance (s) of the windows' earliest arrivals from the lines.
    residual: float


def fit_timestamps(
    arrived: NDArray[np.float64],
    ticks: NDArray[np.int64],
    breaks: NDArray[np.int64] | None = None,
    configured: float = 0.0,
    *,
    counted: bool = True,
) -> Timestamps:
    """When samples were taken, by their arrivals (s, not decreasing) and ticks, shape (n,), n >= 1.

    The counter is known to begin anew with the samples `breaks`, such as after plugging in. The
    `configured` rate (Hz, 0 for none) is believed where too little was recorded to know better;
    where the samples count themselves (not `counted`) it was measured by arrivals too: it tells a
    backlog, and nothing that they do not tell better.

    A short stretch, as after plugging in, has the rate of the longest one: it is the same crystal,
    and only its offset is to be found, for which one sample that was read at once is enough.
    """
    known_breaks = np.empty(0, dtype=np.int64) if breaks is None else breaks
    rate = _choose_rate(arrived, ticks, known_breaks, configured, counted)
    jumps = _find_jumps(arrived, ticks, rate, known_breaks)
    firsts = np.unique(np.concatenate([[0], known_breaks, jumps]).astype(np.int64))
    firsts = firsts[firsts < len(ticks)]
    lasts = np.append(firsts[1:], len(ticks))
    host = np.empty(len(ticks))
    squares, windows = 0.0, 0
    offset = slope = np.nan
    for longest in np.argsort(firsts - lasts, kind="stable").tolist():
        piece = slice(int(firsts[longest]), int(lasts[longest]))
        duration = rate * float(ticks[piece][-1] - ticks[piece][0])
        piece_rate = rate
        if duration > 2 * _SHORT_STRETCH:
            piece_rate = _guess(arrived[piece], ticks[piece], 2, about=rate, near=_NEAR_GUESS)[0]
        host[piece], square, used = _fit_stretch(arrived[piece], ticks[piece], piece_rate)
        squares, windows = squares + square, windows + used
        if np.isnan(slope):
            offset, slope = _fit_line(host[piece], ticks[piece], rate)
            rate = slope if duration > 2 * _SHORT_STRETCH else rate
    return Timestamps(host, firsts, offset, slope, float(np.sqrt(squares / max(windows, 1))))


def spread_deliveries(
    arrived: NDArray[np.float64], breaks: NDArray[np.int64]
) -> tuple[NDArray[np.float64], float]:
    """When samples were taken of which only the arrivals tell, several in a delivery.

    Those of a delivery are spread evenly over the time since the one before, but not over more than
    they take elsewhere, as a device may have been silent in between. `arrived` (s) does not
    decrease; the device was plugged in again before the samples `breaks`. Gives host times (s),
    strictly increasing, and the longest time (s) over which a delivery was spread.
    """
    firsts = np.concatenate([[0], np.flatnonzero(np.diff(arrived) > 0) + 1])
    number = np.diff(firsts, append=len(arrived))
    since = np.diff(arrived[firsts], prepend=np.nan)
    since[np.isin(firsts, breaks)] = np.nan  # since when is not known
    each = since / number
    usual = float(np.nanmedian(each)) if np.isfinite(each).any() else 1e-3
    each = np.fmin(np.where(np.isnan(each), usual, each), 2 * usual)
    # The first of all, and of a connection, may have waited for each other no longer than since the
    # delivery before it.
    room = np.diff(arrived[firsts], prepend=-np.inf)
    each = np.minimum(each, room / number)
    left = np.repeat(firsts + number, number) - 1 - np.arange(len(arrived))
    host = arrived - left * np.repeat(each, number)
    return host, float((each * number).max())


def _choose_rate(
    arrived: NDArray[np.float64],
    ticks: NDArray[np.int64],
    breaks: NDArray[np.int64],
    configured: float,
    counted: bool,
) -> float:
    """Seconds a tick: as configured, or by the arrivals where they contradict it or tell enough."""
    about = 1.0 / configured if configured > 0 else 0.0
    guess, over = _guess(arrived, ticks, 8, breaks, about=about)
    if not (configured > 0 and counted):
        return guess
    contradicted = over * abs(guess * configured - 1) > _MOST_CONTRADICTION
    return guess if over > _SHORT_STRETCH or contradicted else 1.0 / configured


def _guess(
    arrived: NDArray[np.float64],
    ticks: NDArray[np.int64],
    parts: int,
    breaks: NDArray[np.int64] | tuple[int, ...] = (),
    *,
    about: float = 0.0,
    near: float = _NEAR_STATED,
) -> tuple[float, float]:
    """Seconds a tick: the median over pairs of samples far apart; and how far apart (s).

    That is up to 1 / `parts` of the samples between two breaks: few pairs have a jump of the
    counter between them where these parts are many. Of a recording of one or two bursts it is all.
    Where it is known to be `about` something, only pairs that are as `near` as that count.
    """
    n = len(ticks)
    edges = np.unique(np.concatenate([[0], np.asarray(breaks, dtype=np.int64), [n]]))
    longest = int(np.argmax(np.diff(edges)))
    first, last = int(edges[longest]), int(edges[longest + 1]) - 1
    if last <= first:
        return 1e-3, 0.0
    rough = (arrived[last] - arrived[first]) / (last - first)
    if rough <= 0:
        return 1e-3, 0.0
    most = max((last - first) // parts, int(min(np.ceil(_SHORTEST_PAIR / rough), last - first)))
    apart = int(np.clip(_LONGEST_PAIR / rough, 1, most))
    begin = np.arange(0, n - apart, max(1, (n - apart) // 20_000))
    begin = begin[
        np.searchsorted(edges, begin, "right") == np.searchsorted(edges, begin + apart, "right")
    ]
    steps = ticks[begin + apart] - ticks[begin]
    slopes = (arrived[begin + apart] - arrived[begin])[steps > 0] / steps[steps > 0]
    slopes = slopes[slopes > 0]
    plausible = slopes[np.abs(slopes - about) < near * about]
    # Of those of another pace, which only end so near, the middle one would lie at the edge.
    if (
        len(plausible) > _LEAST_NEAR_SHARE * len(begin)
        and abs(np.median(plausible) - about) < 0.5 * near * about
    ):
        slopes = plausible
    return (float(np.median(slopes)), apart * rough) if len(slopes) else (1e-3, 0.0)


def _find_jumps(
    arrived: NDArray[np.float64],
    ticks: NDArray[np.int64],
    rate: float,
    breaks: NDArray[np.int64],
) -> NDArray[np.int64]:
    """Samples before which the counter jumped, or stood still while time went on."""
    steps = np.diff(ticks)
    off = np.diff(arrived) - rate * steps
    threshold = max(JUMP, 0.6 * rate)
    back = np.flatnonzero(steps <= 0) + 1
    edges = np.unique(np.concatenate([[0], breaks, back, [len(ticks)]]))
    behind = arrived - rate * (ticks - ticks[0])
    jumps: list[int] = []
    # Where the counter went on by one, what comes early is the rest of a backlog.
    doubtful = (off > threshold) & (steps > 0) | (off < -threshold) & (steps > 1)
    for i in (np.flatnonzero(doubtful) + 1).tolist():
        place = int(np.searchsorted(edges, i, side="right"))
        first, last = int(edges[place - 1]), int(edges[place])
        if first == i:
            continue
        low = max(int(np.searchsorted(arrived, arrived[i - 1] - _JUMP_MARGIN)), first, *jumps[-1:])
        # Delays end; what still disagrees afterwards is the counter. Where that went on by one, a
        # busy computer is the likelier cause, and is busy for seconds.
        after = _STANDSTILL if steps[i - 1] == 1 else _JUMP_MARGIN
        high = min(int(np.searchsorted(arrived, arrived[i] + after)), last)
        if off[i - 1] > 0 and arrived[high - 1] - arrived[i] < _LEAST_AFTER_JUMP:
            continue
        before = float(behind[min(low, i - 1) : i].min())
        stays = float(behind[i : max(high, i + 1)].min()) - before
        if stays * np.sign(off[i - 1]) > 0.75 * threshold:
            jumps.append(i)
    return np.union1d(back, np.array(jumps, dtype=np.int64))


def _fit_stretch(
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
    # Nothing arrives before it was taken: the earliest of the neighbours are right.
    weights[filled] = earliest[filled] - _running_minimum(earliest[filled]) <= _LATENESS
    for _ in range(3):
        smooth = _smooth(earliest, weights)
        weights[filled] = _punctual((earliest - smooth)[filled], weights[filled] > 0)
    used = weights > 0
    squares = float(np.sum((earliest - smooth)[used] ** 2))
    centres = (np.arange(len(earliest)) + 0.5) * WINDOW
    return at + base + np.interp(at, centres, smooth), squares, int(used.sum())


def _running_minimum(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """The smallest of each value and its neighbours."""
    around = np.pad(values, _NEIGHBOURS, constant_values=np.inf)
    smallest: NDArray[np.float64] = np.lib.stride_tricks.sliding_window_view(
        around, 2 * _NEIGHBOURS + 1
    ).min(axis=1)
    return smallest


def _punctual(off: NDArray[np.float64], used: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which windows are not late, by those that were used so far; never none."""
    typical = float(np.median(np.abs(off[used])))
    punctual = off <= max(_LATENESS, 6.0 * typical)
    return punctual if punctual.any() else used


def _smooth(values: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """The value at each window of the line fitted with weights that halve in 90 s either way."""
    fade = 0.5 ** (WINDOW / HALF_LIFE)
    s0, s1, s2 = _moments(weights, fade)
    t0, t1, _ = _moments(weights * values, fade)
    # Least squares with a penalty on the slope, so that a few windows turn no line: see _STIFFNESS.
    slope = (s0 * t1 - s1 * t0) / (s0 * (s2 + _STIFFNESS) - s1 * s1)
    smooth: NDArray[np.float64] = (t0 - slope * s1) / s0
    return smooth


def _moments(values: NDArray[np.float64], fade: float) -> tuple[NDArray[np.float64], ...]:
    """Sums of ``fade^|m| m^p values[k + m]`` over m for p = 0, 1, 2, each of shape (n,)."""
    past = _past(values, fade)
    future = [sums[::-1] for sums in _past(values[::-1], fade)]
    return past[0] + future[0] - values, future[1] - past[1], past[2] + future[2]


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


def _fit_line(
    host: NDArray[np.float64], ticks: NDArray[np.int64], rate: float
) -> tuple[float, float]:
    """Offset and rate of the line through a stretch."""
    x = (ticks - ticks[0]).astype(np.float64)
    y = host - host[0]
    centred = x - x.mean()
    power = float(centred @ centred)
    slope = float(centred @ y) / power if power > 0 else rate
    return float(host[0] + y.mean() - slope * (x.mean() + float(ticks[0]))), slope
