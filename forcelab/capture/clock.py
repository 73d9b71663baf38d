"""When a device's samples were taken, on the host's monotonic clock, as they come.

What windows tell whose earliest arrivals are behind a clock's line. They are a backlog, which
arrives faster than it was taken and so ends by itself, or samples are missing which nobody counted,
as when a hub was stuck and a board went on printing lines. The latter keep the device's pace, all
equally late.

Live: when a device's samples were taken, on the host's monotonic clock. A sample arrives when it
was taken plus a delay that is never negative: the earliest arrivals tell the time, late ones tell
only how busy the computer was. Each window gives its earliest arrival to a line of host time
against the device's counter, fitted by recursive least squares that forgets. What is kept is the
weighted mean and the spread about it (West, 1979: Updating mean and variance estimates, CACM 22),
never sums of raw clock readings, so that hours of ticks cost no digits.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

#: Seconds by which a jump of the counter must contradict the arrivals to begin a new stretch.
STEP = 0.02
#: Seconds behind the line, at least, of windows that say nothing of the device's clock.
LATE = 0.005

_STEADY = 1.0  # s for which windows must be equally late to say that samples are missing
_MISSING = 0.05  # s by which they must have become late at once; a wrong rate takes longer
_SLIGHT = 0.05  # share by which a told rate is wrong without turning most of the first windows
_RECENT = 7  # steps from window to window of which most tell the present pace
_CLEAR = 0.6  # share of the steps that must be alike to say that a told rate is wrong
_PERSISTS = 1.0  # s of arrivals at one pace: what is read at once after a stall is over by then


def steady_since(
    x: NDArray[np.float64], y: NDArray[np.float64], late: NDArray[np.float64], rate: float
) -> int | None:
    """The first of the last windows that show that samples are missing; None where none do.

    Parameters
    ----------
    x, y : ndarray of float64, shape (n,)
        Ticks and arrivals (s) of windows.
    late : ndarray of float64, shape (n,)
        How far (s) they are behind the line.
    rate : float
        Seconds a tick, at which they are to come.
    """
    off = y - rate * x
    others = np.flatnonzero(np.abs(off - off[-1]) > STEP)
    first = int(others[-1]) + 1 if len(others) else 0
    at_once = min(float(np.diff(late, prepend=0.0).max()), float(late[-1])) > _MISSING
    return first if at_once and y[-1] - y[first] >= _STEADY else None


def pace_of_late(x: NDArray[np.float64], y: NDArray[np.float64], told: float) -> float:
    """Seconds a tick by windows that were all late: as told, unless that is why they were.

    Who was told a rate that is wrong by more than a few hundredths would have found out by the
    first windows.
    """
    half = len(x) // 2
    pace = float(np.median((y[half:] - y[:-half]) / (x[half:] - x[:-half])))
    return pace if LATE / np.ptp(x) < abs(pace - told) < _SLIGHT * told else told


def believed_slope(
    x: NDArray[np.float64], y: NDArray[np.float64], promised: float
) -> tuple[float, bool]:
    """Seconds a tick by a device's first windows; and whether they may be a backlog after all.

    Delays turn single windows; only a rate that was told wrong turns most of them, and for longer
    than a backlog does.
    """
    steps = np.diff(y)
    slopes = steps / np.diff(x)
    slope = float(np.median(slopes[-_RECENT:]))
    alike = np.abs(slopes - slope) <= 0.5 * slope
    clear = alike.mean() > _CLEAR  # with a backlog among them, the middle one says nothing
    wrong = abs(slope - promised)
    if wrong > _SLIGHT * promised:
        persists = clear and steps[alike].sum() >= _PERSISTS
        return (slope, False) if persists else (promised, True)
    return (slope if clear and np.ptp(x) * wrong > LATE * len(x) else promised), False


T = TypeVar("T", float, NDArray[np.float64])

#: Seconds after which a window counts half.
HALF_LIFE = 90.0
#: Seconds of which only the earliest arrival is used.
WINDOW = 0.25
_PATIENCE = 4.0  # s of late windows, not of a backlog, after which it is the line that is wrong
_SETTLED = 2.0  # s of ticks before the slope of the line is believed
_ENOUGH = 5  # windows that may tell that the device was told a wrong rate
_STARTING = 8  # windows that are all looked at again with each further one, as many may be late
_DOUBTFUL = 40  # of them while they contradict what was told, but may be a backlog


class ArrivalClock:
    """Host time against a device's counter, by recursive least squares with forgetting.

    Parameters
    ----------
    rate : float
        Samples a second that the device was told to give; used for the first seconds only.

    Attributes
    ----------
    rate : float
        Seconds of the host that one tick takes.
    residual : float
        Weighted root mean square distance, in s, of the windows' earliest arrivals from the line
        as it was before them; once that has a slope of its own, of those since.
    stretches : int
        How many times the ticks have begun anew: by :meth:`restart`, or by a jump of the counter.

    Notes
    -----
    Not for several threads at once.
    """

    def __init__(self, rate: float) -> None:
        self._stated_period = self._promised = 1.0 / rate if rate > 0 else 1e-3
        self._learnt = False
        self._decay = math.log(2.0) / HALF_LIFE
        self.stretches = 0
        self.residual = 0.0
        self.restart()

    def restart(self) -> None:
        """Begin a new stretch of ticks: the device was plugged in again, or its counter jumped.

        Its crystal is the same, so that only the offset is to be learnt anew.
        """
        if self._learnt:
            self._promised = self.rate
        self.stretches += 1
        self._zero: tuple[int, float] | None = None  # ticks and host time that are counted from
        self._last: int | None = None
        self._pending: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []
        self._begun = math.nan
        self._forget()

    @property
    def known(self) -> bool:
        """Whether anything has arrived in this stretch."""
        return self._zero is not None

    @property
    def learnt(self) -> bool:
        """Whether the rate was learnt from the arrivals of this stretch."""
        return self._learnt

    @property
    def newest(self) -> int | None:
        """The last tick that arrived in this stretch; None before the first."""
        return self._last

    @property
    def offset(self) -> float:
        """Host time (s) at which the counter reads zero; NaN before the first sample."""
        return float(self.to_host(np.zeros(1, dtype=np.int64))[0])

    def to_host(self, ticks: NDArray[np.int64]) -> NDArray[np.float64]:
        """When samples were taken, by what is known now.

        Parameters
        ----------
        ticks : ndarray of int64, shape (n,)
            Of the present stretch.

        Returns
        -------
        ndarray of float64, shape (n,)
            Seconds of the host's monotonic clock; NaN before the first sample.
        """
        if self._zero is None:
            return np.full(len(ticks), np.nan)
        x = (ticks - self._zero[0]).astype(np.float64)
        return self._zero[1] + self._line(x)

    def update(self, arrived: NDArray[np.float64], ticks: NDArray[np.int64]) -> None:
        """Take in samples as they arrive.

        Parameters
        ----------
        arrived : ndarray of float64, shape (n,)
            When each was read, in seconds of the host's monotonic clock.
        ticks : ndarray of int64, shape (n,)
            The device's counter.
        """
        if not len(ticks):
            return
        for first, last in self._pieces(arrived, ticks):
            if first > 0 or self._broken(arrived[0], ticks[0]):
                self.restart()
            self._take(arrived[first:last], ticks[first:last])

    def _pieces(
        self, arrived: NDArray[np.float64], ticks: NDArray[np.int64]
    ) -> list[tuple[int, int]]:
        """Where within a block the counter jumps."""
        steps = np.diff(ticks)
        broken = steps != 1
        if not broken.any():
            return [(0, len(ticks))]
        ahead = np.diff(arrived) - self.rate * steps
        # The delay of what came before the break is in `ahead` too; delays end, jumps do not, and
        # those that stay behind are found by their lateness.
        jumps = np.flatnonzero((steps <= 0) | (broken & (ahead < -STEP - self._delay(arrived))))
        edges = [0, *(jumps + 1).tolist(), len(ticks)]
        return list(pairwise(edges))

    def _delay(self, arrived: NDArray[np.float64]) -> float:
        """How long the bytes of a block may have waited before they were read, at most (s)."""
        return float(arrived[-1] - arrived[0]) + WINDOW

    def _broken(self, arrived: float, tick: int) -> bool:
        """Whether the counter jumped between two blocks."""
        if self._last is None or tick == self._last + 1:
            return False
        if tick <= self._last:
            return True
        early = float(self.to_host(np.array([tick]))[0]) - arrived
        return self._seen > 0 and early > STEP

    def _take(self, arrived: NDArray[np.float64], ticks: NDArray[np.int64]) -> None:
        """Take in samples without a jump, window by window."""
        if self._zero is None:
            self._zero = (int(ticks[0]), float(arrived[0]))
        self._last = int(ticks[-1])
        x = (ticks - self._zero[0]).astype(np.float64)
        y = arrived - self._zero[1]
        at = x * self._stated_period  # windows are cut by ticks: arrivals come in bursts
        if math.isnan(self._begun):
            self._begun = at[0]
        cuts = np.flatnonzero(np.diff(np.floor((at - self._begun) / WINDOW))) + 1
        edges = [0, *cuts.tolist(), len(x)]
        for first, last in pairwise(edges):
            if at[first] - self._begun >= WINDOW:
                self._close()
                passed = math.floor((at[first] - self._begun) / WINDOW)
                self._begun += passed * WINDOW
            self._pending.append((x[first:last], y[first:last]))
            if self._doubtful:  # nothing arrives before it was taken: the line is late so far
                early = y[first:last] - self._line(x[first:last])
                self._y += min(float(early.min()), 0.0)

    def _close(self) -> None:
        """Give the earliest arrival of the window that has ended to the line."""
        x = np.concatenate([part[0] for part in self._pending])
        y = np.concatenate([part[1] for part in self._pending])
        self._pending.clear()
        earliest = int(np.argmin(y - self._line(x)))
        self._learn(float(x[earliest]), float(y[earliest]))

    def _forget(self) -> None:
        """No window has been seen."""
        self.rate, self._learnt = self._promised, False
        self._begin()
        self._doubtful = True  # whether the first windows are still looked at together
        self._starting: list[tuple[float, float]] = []
        self._late: list[tuple[float, float]] = []

    def _begin(self) -> None:
        """The line goes through nothing yet."""
        self._seen = 0
        self._weight = self._xx = self._xy = self._squares = self._judged = 0.0
        self._x = self._y = self._latest = self._first = 0.0

    def _line(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """The line, in s from the stretch's first arrival against ticks from its first tick."""
        return self._y + self.rate * (x - self._x)

    def _learn(self, x: float, y: float) -> None:
        """Take in one window's earliest arrival."""
        if self._doubtful:
            self._start((x, y))
            return
        off = self._off(x, y)
        if abs(off) <= max(LATE, 6.0 * self.residual):
            self._late.clear()
            self._fit(x, y, off)
            return
        # Nothing arrives before it was taken: one early window shows that all before was late.
        self._late.append((x, y))
        self._anew(*(([(x, y)], self._stated_period) if off < 0 else self._believed()))

    def _anew(self, points: list[tuple[float, float]], promised: float) -> None:
        """Begin the line anew with some windows, if there are any."""
        if points:
            self._promised = promised
            self._forget()
            for point in points:
                self._learn(*point)

    def _believed(self) -> tuple[list[tuple[float, float]], float]:
        """Late windows that show that the line is wrong, if any do, and the rate to go on with."""
        x, y = np.array(self._late).T
        late = self._off(x, y)
        for rate in (self.rate, self._stated_period):
            if (first := steady_since(x, y, late, rate)) is not None:
                return self._late[first:], rate
        first = int(np.searchsorted(y, y[-1] - _PATIENCE, side="right")) - 1
        if first < 0 or late[-1] < late[first] - LATE:
            return [], self._stated_period
        return self._late[first:], pace_of_late(x[first:], y[first:], self._stated_period)

    def _start(self, point: tuple[float, float]) -> None:
        """Fit the first windows anew without those that are late, such as a backlog's."""
        self._starting.append(point)
        x, y = (np.array(values) for values in zip(*self._starting, strict=True))
        self._begin()
        self.rate, self._doubtful = self._promised, len(x) < _STARTING
        if len(x) >= _ENOUGH:
            self.rate, doubtful = believed_slope(x, y, self._promised)
            self._doubtful |= doubtful and len(x) < _DOUBTFUL
        late = y - self.rate * x
        for a, b in zip(*(v[late <= late.min() + LATE].tolist() for v in (x, y)), strict=True):
            self._fit(a, b, self._off(a, b))
        first = steady_since(x, y, self._off(x, y), self.rate)
        self._anew([] if first is None else self._starting[first:], self._promised)

    def _off(self, x: T, y: T) -> T:
        """How far (s) windows' earliest arrivals are behind the line."""
        return y - (self._y + self.rate * (x - self._x)) if self._seen else 0.0 * y

    def _fit(self, x: float, y: float, off: float) -> None:
        """One step of the recursion."""
        fade = math.exp(-self._decay * self.rate * (x - self._latest)) if self._seen else 0.0
        if not self._seen:
            self._first = x
        self._latest, self._seen = x, self._seen + 1
        old = fade * self._weight
        self._weight = old + 1.0
        dx, dy = x - self._x, y - self._y
        share = old / self._weight
        self._xx = fade * self._xx + share * dx * dx
        self._xy = fade * self._xy + share * dx * dy
        self._squares, self._judged = fade * self._squares + off * off, fade * self._judged + 1.0
        self._x += dx / self._weight
        self._y += dy / self._weight
        slope = self._xy / self._xx if self._xx > 0 else 0.0
        # While the line is too short to tell, the rate is that of before, or as told.
        if slope > 0 and self.rate * (x - self._first) >= _SETTLED:
            if not self._learnt:  # until now it was the promise that was off
                self._squares = self._judged = 0.0
            self.rate, self._learnt = slope, True
        self.residual = math.sqrt(self._squares / self._judged) if self._judged else 0.0
