"""When a device's samples were taken, on the host's monotonic clock, as they come.

A sample arrives when it was taken plus a delay that is never negative: the earliest arrivals tell
the time, late ones only how busy the computer was. Each window gives its earliest arrival to a line
of host time against the device's counter, fitted by recursive least squares that forgets. The
weighted mean and the spread about it are kept (West, 1979: Updating mean and variance estimates,
CACM 22), never sums of raw clock readings, so that hours of ticks cost no digits.

Windows whose earliest arrivals are behind the line are a backlog, which arrives faster than it was
taken and so ends by itself, or samples are missing that the device did not count, as when a hub was
stuck and a board went on printing lines. The latter keep the device's pace, all equally late.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

#: Seconds by which a jump of the counter must contradict the arrivals to begin a new stretch.
JUMP = 0.02
#: Seconds behind the line, at least, of windows that say nothing of the device's clock.
LATE = 0.005

_LOSS_SECONDS = 1.0  # s for which windows must be equally late to say that samples are missing
_LOSS_DELAY = 0.05  # s by which they must have become late at once; a wrong rate takes longer
# Share by which a configured rate is wrong without turning most of the first windows.
_SLIGHT_ERROR = 0.05
_PACE_STEPS = 7  # steps from window to window of which most tell the present pace
_CLEAR_SHARE = 0.6  # share of the steps that must be alike to say that a configured rate is wrong
_PACE_SECONDS = 1.0  # s of arrivals at one pace: what is read at once after a stall is over by then


def samples_lost_since(
    x: NDArray[np.float64], y: NDArray[np.float64], late: NDArray[np.float64], rate: float
) -> int | None:
    """The first of the last windows that show that samples are missing; None where none do.

    `x` and `y` are ticks and arrivals (s) of windows, `late` how far (s) each is behind the line;
    `rate` is in seconds a tick.
    """
    off = y - rate * x
    others = np.flatnonzero(np.abs(off - off[-1]) > JUMP)
    first = int(others[-1]) + 1 if len(others) else 0
    at_once = min(float(np.diff(late, prepend=0.0).max()), float(late[-1])) > _LOSS_DELAY
    return first if at_once and y[-1] - y[first] >= _LOSS_SECONDS else None


def late_pace(x: NDArray[np.float64], y: NDArray[np.float64], configured: float) -> float:
    """Seconds a tick by windows that were all late: as configured, unless that is why they were.

    A configured rate that is wrong by more than a few hundredths would have been found out by the
    first windows.
    """
    half = len(x) // 2
    pace = float(np.median((y[half:] - y[:-half]) / (x[half:] - x[:-half])))
    return (
        pace
        if LATE / np.ptp(x) < abs(pace - configured) < _SLIGHT_ERROR * configured
        else configured
    )


def initial_pace(
    x: NDArray[np.float64], y: NDArray[np.float64], promised: float
) -> tuple[float, bool]:
    """Seconds a tick by a device's first windows; and whether they may be a backlog after all.

    Delays turn single windows; only a wrong configured rate turns most of them, and for longer than
    a backlog does.
    """
    steps = np.diff(y)
    slopes = steps / np.diff(x)
    slope = float(np.median(slopes[-_PACE_STEPS:]))
    agreeing = np.abs(slopes - slope) <= 0.5 * slope
    clear = agreeing.mean() > _CLEAR_SHARE  # with a backlog among them, the middle one says nothing
    deviation = abs(slope - promised)
    if deviation > _SLIGHT_ERROR * promised:
        persists = clear and steps[agreeing].sum() >= _PACE_SECONDS
        return (slope, False) if persists else (promised, True)
    return (slope if clear and np.ptp(x) * deviation > LATE * len(x) else promised), False


def missing_samples(ticks: int, seconds: float, period: float) -> int:
    """How many samples are missing between two: `ticks` of the counter and `seconds` apart.

    As the counter tells, where so many fit into the time; of a counter that jumped ahead as many as
    do. None where it began anew: nothing tells how many there were.
    """
    fit = max(round(seconds / period) - 1, 0)
    return max(ticks - 1, 0) if (ticks - 1) * period <= seconds + JUMP else fit


def missing_by_stamps(stamps: NDArray[np.float64], rate: float) -> NDArray[np.int64]:
    """How many samples are missing after each but the last, by stamps (s) and a stated rate (Hz).

    None where the next samples catch up, as those of a delivery do that are stamped together, and
    none at all where the rate is not kept, which then tells nothing.
    """
    missing = np.zeros(max(len(stamps) - 1, 0), dtype=np.int64)
    late = rate * (stamps - stamps[:1]) - np.arange(len(stamps))  # in periods
    steps = np.diff(late)
    wide = np.flatnonzero(steps > 0.5)
    if len(wide) and np.median(steps) < 0.5:
        for before in wide.tolist():
            after = before + 1
            ahead = 2 + int(min(steps[before], rate))
            missing[before] = max(round(float(late[after : after + ahead].min() - late[before])), 0)
    return missing


T = TypeVar("T", float, NDArray[np.float64])

#: Seconds after which a window counts half.
HALF_LIFE = 90.0
#: Seconds of which only the earliest arrival is used.
WINDOW = 0.25
_PATIENCE = 4.0  # s of late windows, not of a backlog, after which it is the line that is wrong
_SETTLED = 2.0  # s of ticks before the slope of the line is believed
_FEWEST_WINDOWS = 5  # windows that may tell that the configured rate is wrong
_STARTING = 8  # windows that are all looked at again with each further one, as many may be late
_MOST_STARTING = 40  # of them while they contradict the configured rate, but may be a backlog


class ArrivalClock:
    """Host time against a device's counter, by recursive least squares with forgetting.

    Not thread-safe.
    """

    def __init__(self, rate: float) -> None:
        """`rate` is the configured one (Hz), used for the first seconds only."""
        self._stated_period = self._promised = 1.0 / rate if rate > 0 else 1e-3
        #: Whether `rate`, in host seconds a tick, was learnt from the arrivals of this stretch.
        self.learnt = False
        self._decay = math.log(2.0) / HALF_LIFE
        #: How often the ticks have begun anew: by `restart`, or by a jump of the counter.
        self.stretches = 0
        #: Weighted RMS distance (s) of the windows' earliest arrivals from the line as it was
        #: before them; once that has a slope of its own, of those since.
        self.residual = 0.0
        self.restart()

    def restart(self) -> None:
        """Begin a new stretch of ticks: the device was plugged in again, or its counter jumped.

        Its crystal is the same, so only the offset is learnt anew.
        """
        if self.learnt:
            self._promised = self.rate
        self.stretches += 1
        self._zero: tuple[int, float] | None = None  # ticks and host time that are counted from
        #: The last tick of this stretch; None before the first.
        self.newest: int | None = None
        self._pending: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []
        self._window_start = math.nan
        self._reset_windows()

    @property
    def known(self) -> bool:
        """Whether anything has arrived in this stretch."""
        return self._zero is not None

    @property
    def offset(self) -> float:
        """Host time (s) at which the counter reads zero; NaN before the first sample."""
        return float(self.to_host(np.zeros(1, dtype=np.int64))[0])

    def to_host(self, ticks: NDArray[np.int64]) -> NDArray[np.float64]:
        """When samples with these ticks of the present stretch were taken (s), as known now.

        NaN before the first sample.
        """
        if self._zero is None:
            return np.full(len(ticks), np.nan)
        x = (ticks - self._zero[0]).astype(np.float64)
        return self._zero[1] + self._line(x)

    def update(self, arrived: NDArray[np.float64], ticks: NDArray[np.int64]) -> None:
        """Take in the arrivals (s, host's monotonic clock) and ticks of new samples."""
        if not len(ticks):
            return
        for first, last in self._unbroken(arrived, ticks):
            if first > 0 or self._jumped(arrived[0], ticks[0]):
                self.restart()
            self._add(arrived[first:last], ticks[first:last])

    def _unbroken(
        self, arrived: NDArray[np.float64], ticks: NDArray[np.int64]
    ) -> list[tuple[int, int]]:
        """Ranges of a block within which the counter does not jump."""
        steps = np.diff(ticks)
        broken = steps != 1
        if not broken.any():
            return [(0, len(ticks))]
        ahead = np.diff(arrived) - self.rate * steps
        # The delay of what came before the break is in `ahead` too; delays end, jumps do not, and
        # those that stay behind are found by their lateness.
        jumps = np.flatnonzero((steps <= 0) | (broken & (ahead < -JUMP - self._delay(arrived))))
        edges = [0, *(jumps + 1).tolist(), len(ticks)]
        return list(pairwise(edges))

    def _delay(self, arrived: NDArray[np.float64]) -> float:
        """How long the bytes of a block may have waited before they were read, at most (s)."""
        return float(arrived[-1] - arrived[0]) + WINDOW

    def _jumped(self, arrived: float, tick: int) -> bool:
        """Whether the counter jumped between two blocks."""
        if self.newest is None or tick == self.newest + 1:
            return False
        if tick <= self.newest:
            return True
        early = float(self.to_host(np.array([tick]))[0]) - arrived
        return self._windows > 0 and early > JUMP

    def _add(self, arrived: NDArray[np.float64], ticks: NDArray[np.int64]) -> None:
        """Take in samples without a jump, window by window."""
        if self._zero is None:
            self._zero = (int(ticks[0]), float(arrived[0]))
        self.newest = int(ticks[-1])
        x = (ticks - self._zero[0]).astype(np.float64)
        y = arrived - self._zero[1]
        at = x * self._stated_period  # windows are cut by ticks: arrivals come in bursts
        if math.isnan(self._window_start):
            self._window_start = at[0]
        cuts = np.flatnonzero(np.diff(np.floor((at - self._window_start) / WINDOW))) + 1
        edges = [0, *cuts.tolist(), len(x)]
        for first, last in pairwise(edges):
            if at[first] - self._window_start >= WINDOW:
                self._close_window()
                passed = math.floor((at[first] - self._window_start) / WINDOW)
                self._window_start += passed * WINDOW
            self._pending.append((x[first:last], y[first:last]))
            if self._doubtful:  # nothing arrives before it was taken: the line is late so far
                early = y[first:last] - self._line(x[first:last])
                self._y += min(float(early.min()), 0.0)

    def _close_window(self) -> None:
        """Give the earliest arrival of the window that has ended to the line."""
        x = np.concatenate([part[0] for part in self._pending])
        y = np.concatenate([part[1] for part in self._pending])
        self._pending.clear()
        earliest = int(np.argmin(y - self._line(x)))
        self._learn(float(x[earliest]), float(y[earliest]))

    def _reset_windows(self) -> None:
        self.rate, self.learnt = self._promised, False
        self._reset_line()
        self._doubtful = True  # whether the first windows are still looked at together
        self._starting: list[tuple[float, float]] = []
        self._late: list[tuple[float, float]] = []

    def _reset_line(self) -> None:
        self._windows = 0
        self._weight = self._xx = self._xy = self._squares = self._judged_weight = 0.0
        self._x = self._y = self._latest = self._first = 0.0

    def _line(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """The line, in s from the stretch's first arrival against ticks from its first tick."""
        return self._y + self.rate * (x - self._x)

    def _learn(self, x: float, y: float) -> None:
        """Take in one window's earliest arrival."""
        if self._doubtful:
            self._start((x, y))
            return
        off = self._lateness(x, y)
        if abs(off) <= max(LATE, 6.0 * self.residual):
            self._late.clear()
            self._fit(x, y, off)
            return
        # Nothing arrives before it was taken: one early window shows that all before was late.
        self._late.append((x, y))
        self._start_with(*(([(x, y)], self._stated_period) if off < 0 else self._late_windows()))

    def _start_with(self, points: list[tuple[float, float]], promised: float) -> None:
        """Begin the line anew with these windows, if there are any."""
        if points:
            self._promised = promised
            self._reset_windows()
            for point in points:
                self._learn(*point)

    def _late_windows(self) -> tuple[list[tuple[float, float]], float]:
        """Late windows that show that the line is wrong, if any do, and the rate to go on with."""
        x, y = np.array(self._late).T
        late = self._lateness(x, y)
        for rate in (self.rate, self._stated_period):
            if (first := samples_lost_since(x, y, late, rate)) is not None:
                return self._late[first:], rate
        first = int(np.searchsorted(y, y[-1] - _PATIENCE, side="right")) - 1
        if first < 0 or late[-1] < late[first] - LATE:
            return [], self._stated_period
        return self._late[first:], late_pace(x[first:], y[first:], self._stated_period)

    def _start(self, point: tuple[float, float]) -> None:
        """Fit the first windows anew without those that are late, such as a backlog's."""
        self._starting.append(point)
        x, y = (np.array(values) for values in zip(*self._starting, strict=True))
        self._reset_line()
        self.rate, self._doubtful = self._promised, len(x) < _STARTING
        if len(x) >= _FEWEST_WINDOWS:
            self.rate, doubtful = initial_pace(x, y, self._promised)
            self._doubtful |= doubtful and len(x) < _MOST_STARTING
        late = y - self.rate * x
        for a, b in zip(*(v[late <= late.min() + LATE].tolist() for v in (x, y)), strict=True):
            self._fit(a, b, self._lateness(a, b))
        first = samples_lost_since(x, y, self._lateness(x, y), self.rate)
        self._start_with([] if first is None else self._starting[first:], self._promised)

    def _lateness(self, x: T, y: T) -> T:
        """How far (s) windows' earliest arrivals are behind the line."""
        return y - (self._y + self.rate * (x - self._x)) if self._windows else 0.0 * y

    def _fit(self, x: float, y: float, off: float) -> None:
        """One step of the recursion."""
        fade = math.exp(-self._decay * self.rate * (x - self._latest)) if self._windows else 0.0
        if not self._windows:
            self._first = x
        self._latest, self._windows = x, self._windows + 1
        old = fade * self._weight
        self._weight = old + 1.0
        dx, dy = x - self._x, y - self._y
        share = old / self._weight
        self._xx = fade * self._xx + share * dx * dx
        self._xy = fade * self._xy + share * dx * dy
        self._squares = fade * self._squares + off * off
        self._judged_weight = fade * self._judged_weight + 1.0
        self._x += dx / self._weight
        self._y += dy / self._weight
        slope = self._xy / self._xx if self._xx > 0 else 0.0
        # While the line is too short to tell, the rate is that of before, or as configured.
        if slope > 0 and self.rate * (x - self._first) >= _SETTLED:
            if not self.learnt:  # until now it was the promise that was off
                self._squares = self._judged_weight = 0.0
            self.rate, self.learnt = slope, True
        self.residual = math.sqrt(self._squares / max(self._judged_weight, 1.0))
