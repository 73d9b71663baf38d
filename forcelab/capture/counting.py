"""Samples of a device without a counter, counted by a clock that comes with them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["Counting"]


class Counting:
    """Samples counted by a clock that comes with them.

    Parameters
    ----------
    period : float
        Seconds of that clock from sample to sample.
    """

    def __init__(self, period: float) -> None:
        self.period = period
        self._last: float | None = None
        self._tick = -1

    @classmethod
    def learnt(cls, times: NDArray[np.float64]) -> Counting | None:
        """From the first stamps (s); None where they are not even, as nothing can be counted."""
        steps = np.diff(times)
        if len(steps) < 2 or not np.all(steps > 0):
            return None
        period = float(np.median(steps))
        off = np.abs(steps / period - np.round(steps / period))
        return cls(period) if off.max() < 0.25 else None

    def feed(self, times: NDArray[np.float64]) -> NDArray[np.int64]:
        """Ticks of samples with these stamps (s)."""
        ticks = np.empty(len(times), dtype=np.int64)
        for i, stamp in enumerate(times.tolist()):
            on = 1
            if self._last is not None and stamp > self._last:
                step = stamp - self._last
                on = max(1, round(step / self.period))
                # Stamps in whole milliseconds tell the period of fast devices only by and by.
                self.period += 0.02 * (step / on - self.period)
            self._last, self._tick = stamp, self._tick + on
            ticks[i] = self._tick
        return ticks

    def restart(self) -> None:
        """Go on with a clock that may have started anew."""
        self._last = None
