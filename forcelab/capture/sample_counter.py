"""Samples counted: by a clock that comes with them, and those that are missing told."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.clock import STEP

#: Samples that can be missing at one go: a month of them at 1 kHz.
FARTHEST = 2.0**31


def missed(ticks: int, seconds: float, period: float) -> int:
    """How many samples are missing between two.

    Parameters
    ----------
    ticks : int
        By which the counter stepped.
    seconds : float
        Between their stamps.
    period : float
        Seconds from sample to sample.

    Returns
    -------
    int
        As the counter tells, where so many fit into the time; of a counter that jumped ahead as
        many as do. None where it began anew: nobody knows how many there were.
    """
    fit = max(round(seconds / period) - 1, 0)
    return max(ticks - 1, 0) if (ticks - 1) * period <= seconds + STEP else fit


class SampleCounter:
    """Samples counted by a clock that comes with them.

    Parameters
    ----------
    period : float
        Seconds of that clock from sample to sample.
    """

    def __init__(self, period: float) -> None:
        self.period = period
        self._last: tuple[float, int] | None = None  # the last stamp that was one, and its tick
        self._tick = -1

    @classmethod
    def learnt(cls, times: NDArray[np.float64]) -> SampleCounter | None:
        """From the first stamps (s); None where they are not even, as nothing can be counted."""
        steps = np.diff(times)
        if len(steps) < 2 or not np.all(steps > 0):
            return None
        period = float(np.median(steps))
        off = np.abs(steps / period - np.round(steps / period))
        return cls(period) if off.max() < 0.25 else None

    def feed(self, times: NDArray[np.float64]) -> NDArray[np.int64]:
        """Ticks of samples with these stamps (s).

        A stamp that is no number, or so late that the clock must have been set anew, is the next
        tick.
        """
        ticks = np.empty(len(times), dtype=np.int64)
        for i, stamp in enumerate(times.tolist()):
            self._tick += 1
            if math.isfinite(stamp):
                self._tick = max(self._tick, self._counted(stamp))
                self._last = stamp, self._tick
            ticks[i] = self._tick
        return ticks

    def _counted(self, stamp: float) -> int:
        """The tick by a stamp alone; -1 where it tells none."""
        if self._last is None:
            return -1
        last, tick = self._last
        step = stamp - last
        if not 0 < step < FARTHEST * self.period:
            return -1
        on = max(1, round(step / self.period))
        # Stamps in whole milliseconds tell the period of fast devices only by and by.
        self.period += 0.02 * (step / on - self.period)
        return tick + on

    def restart(self) -> None:
        """Go on with a clock that may have started anew."""
        self._last = None
