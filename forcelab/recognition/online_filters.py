"""The paper's filters on a stream of codes, each a fixed number of steps behind.

With as many steps to look ahead as a filter needs it gives what
:mod:`forcelab.recognition.filters` gives offline; with fewer the median takes the last code that
it sees as going on, and a stretch stays unlabelled until it has proved long enough.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import GAP_PERIODS
from forcelab.labels import UNLABELLED

__all__ = ["CausalDrop", "CausalMedian"]

Codes = NDArray[np.int64]
Real = NDArray[np.float64]

#: As in :mod:`forcelab.recognition.filters`.
_ROUNDING = 1e-9


class CausalMedian:
    """Running median over label numbers.

    Parameters
    ----------
    width : int
        As of :func:`forcelab.recognition.filters.median`.
    ahead : int
        Steps that it may look ahead; more than it needs are not waited for.
    """

    def __init__(self, width: int, ahead: int) -> None:
        after = (width - 1) // 2
        self._width = width
        self._before = width // 2
        self.delay = min(after, ahead)
        self._unseen = after - self.delay
        self._codes: Codes | None = None  # `before` codes of context, then those that wait

    def push(self, codes: Codes) -> Codes:
        """Take codes; give the medians of those that have enough after them."""
        if not len(codes):
            return codes
        if self._codes is None:
            self._codes = np.full(self._before, codes[0])
        self._codes = np.concatenate([self._codes, codes])
        ready = max(0, len(self._codes) - self._before - self.delay)
        if not ready:
            return codes[:0]
        seen = self._before + 1 + self.delay
        windows = np.lib.stride_tricks.sliding_window_view(self._codes, seen)
        if self._unseen:
            windows = np.concatenate(
                [windows, np.repeat(windows[:, -1:], self._unseen, axis=1)], axis=1
            )
        ranks = ((self._width - 1) // 2, self._width // 2)
        ordered = np.partition(windows, ranks, axis=1)
        self._codes = self._codes[ready:]
        return (ordered[:, ranks[0]] + ordered[:, ranks[1]] + 1) // 2

    def finish(self) -> Codes:
        """The medians that were waiting; the last code goes on."""
        if self._codes is None or not self.delay:
            return np.empty(0, dtype=np.int64)
        return self.push(np.full(self.delay, self._codes[-1]))


class CausalDrop:
    """Leaves unlabelled what is too short to be the action.

    Parameters
    ----------
    limits : mapping of int to float
        The least seconds of each code that has a limit.
    period : float
        Seconds between two steps.
    ahead : int
        Steps that it may look ahead; more than it needs are not waited for.
    """

    def __init__(self, limits: Mapping[int, float], period: float, ahead: int) -> None:
        self._limits = np.zeros(max(limits, default=0) + 1)
        for code, seconds in limits.items():
            self._limits[code] = seconds
        self._period = period
        self.delay = min(ahead, self.needed(limits, period))
        self._times, self._starts = np.empty(0), np.empty(0)
        self._codes = np.empty(0, dtype=np.int64)
        self._last: tuple[float, int, float] | None = None  # time, code, start of its stretch

    @staticmethod
    def needed(limits: Mapping[int, float], period: float) -> int:
        """Steps ahead with which nothing is missed; some more for stamps that jitter."""
        longest = max(limits.values(), default=0.0)
        return int(np.ceil(1.01 * longest / period)) + 2 if longest > 0 else 0

    def push(self, times: Real, codes: Codes) -> Codes:
        """Take codes with their times; give those that are decided."""
        return self._decide(times, codes, ended=False)

    def finish(self) -> Codes:
        """The codes that were waiting."""
        return self._decide(np.empty(0), np.empty(0, dtype=np.int64), ended=True)

    def _decide(self, times: Real, codes: Codes, ended: bool) -> Codes:
        self._append(times, codes)
        n = len(self._codes)
        ready = n if ended else max(0, n - self.delay)
        if not ready:
            return self._codes[:0]
        # Where each stretch ends among what is there; n where it may go on.
        new = np.flatnonzero(np.diff(self._starts) != 0) + 1
        bounds = np.append(new, n)
        ends = bounds[np.searchsorted(bounds, np.arange(ready), side="right")]
        last = np.minimum(np.arange(ready) + self.delay, n - 1)
        following = np.append(self._times, np.inf)[ends]
        end_times = np.minimum(following, self._times[ends - 1] + GAP_PERIODS * self._period)
        gap = following - self._times[ends - 1] > GAP_PERIODS * self._period
        end_times = np.where(gap, self._times[ends - 1] + self._period, end_times)
        known = (ends <= last) | (ended & (ends == n))
        seconds = np.where(known, end_times, self._times[last]) - self._starts[:ready]
        out = self._codes[:ready].copy()
        places = np.clip(out, 0, len(self._limits) - 1)
        limited = (out >= 0) & (out < len(self._limits))
        short = limited & (seconds < self._limits[places] - _ROUNDING)
        out[short] = UNLABELLED
        self._times, self._starts = self._times[ready:], self._starts[ready:]
        self._codes = self._codes[ready:]
        return out

    def _append(self, times: Real, codes: Codes) -> None:
        """Note new codes, and when the stretch of each began."""
        if not len(codes):
            return
        before = np.array([-np.inf if self._last is None else self._last[0]])
        last_code = np.array([UNLABELLED - 1 if self._last is None else self._last[1]])
        steps = np.diff(np.concatenate([before, times]))
        fresh = np.diff(np.concatenate([last_code, codes])) != 0
        fresh |= steps > GAP_PERIODS * self._period
        index = np.maximum.accumulate(np.where(fresh, np.arange(len(codes)), -1))
        first = times[0] if self._last is None else self._last[2]
        starts = np.where(index >= 0, times[np.maximum(index, 0)], first)
        self._last = (float(times[-1]), int(codes[-1]), float(starts[-1]))
        self._times = np.concatenate([self._times, times])
        self._codes = np.concatenate([self._codes, codes])
        self._starts = np.concatenate([self._starts, starts])
