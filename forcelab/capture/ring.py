"""The last seconds of a device, for views: a ring whose windows are contiguous."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["Ring", "Window"]

#: First sample's number, times (s, host's monotonic clock), shape (n,), and values, shape (n, c).
Window = tuple[int, NDArray[np.float64], NDArray[np.float64]]


class Ring:
    """The last samples of a device; memory is taken once.

    Each sample is written twice, one length of the ring apart, so that any window is one slice.

    Parameters
    ----------
    length : int
        Samples that are kept.
    channels : int

    Attributes
    ----------
    count : int
        Samples taken in so far.

    Notes
    -----
    Not for several threads at once.
    """

    def __init__(self, length: int, channels: int) -> None:
        self._length = length
        self._rows = np.zeros((2 * length, 1 + channels))
        self.count = 0

    def extend(self, times: NDArray[np.float64], values: NDArray[np.float64]) -> None:
        """Take in samples, shapes (n,) and (n, c)."""
        self.count += len(times)
        times, values = times[-self._length :], values[-self._length :]
        n = len(times)
        at = (self.count - n) % self._length
        first = min(n, self._length - at)
        for begin, part in ((at, slice(0, first)), (0, slice(first, n))):
            rows = part.stop - part.start
            for place in (begin, begin + self._length):
                self._rows[place : place + rows, 0] = times[part]
                self._rows[place : place + rows, 1:] = values[part]

    def since(self, number: int) -> Window:
        """Copies of all samples from one on, as far as they are still there.

        Parameters
        ----------
        number : int
            Of the first sample that is wanted, counted from 0; the next call's is this one's
            first number plus its length.
        """
        first = max(number, self.count - self._length, 0)
        n = max(self.count - first, 0)
        at = first % self._length
        rows = self._rows[at : at + n]
        return first, rows[:, 0].copy(), rows[:, 1:].copy()

    def latest(self, seconds: float) -> Window:
        """Copies of the samples of the last so many seconds, counted back from the last one."""
        kept = min(self.count, self._length)
        if not kept:
            return self.since(self.count)
        at = (self.count - kept) % self._length
        times = self._rows[at : at + kept, 0]
        first = int(np.searchsorted(times, times[-1] - seconds))
        return self.since(self.count - kept + first)
