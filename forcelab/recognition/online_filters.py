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
from forcelab.recognition.filters import ROUNDING

__all__ = ["CausalDrop", "CausalMedian"]

Codes = NDArray[np.int64]
Real = NDArray[np.float64]


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
        across = self._codes.strides[0]
        # Not sliding_window_view, which takes longer than all the rest of this.
        windows = np.ndarray((ready, seen), self._codes.dtype, self._codes, 0, (across, across))
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
        self._times = np.empty(0)
        self._codes = np.empty(0, dtype=np.int64)
        # Stretches of one code: the place among what waits where it begins, and when it began.
        self._stretches: list[tuple[int, float]] = []
        self._last = (-np.inf, UNLABELLED - 1)  # time and code of the newest step

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
        if len(codes):
            self._append(times, codes)
        n = len(self._codes)
        ready = n if ended else max(0, n - self.delay)
        if not ready:
            return self._codes[:0]
        out = self._codes[:ready].copy()
        ends = [*(place for place, _ in self._stretches[1:]), n]
        gone = 0
        for (begin, start), end in zip(self._stretches, ends, strict=True):
            if begin >= ready:
                break
            gone += end <= ready
            code = int(self._codes[max(0, begin)])
            if end > 0 and 0 <= code < len(self._limits):
                least = start + float(self._limits[code]) - ROUNDING
                self._judge(out, max(0, begin), end, least, ended)
        self._times, self._codes = self._times[ready:], self._codes[ready:]
        gone = min(gone, len(self._stretches) - 1)  # the newest may go on
        self._stretches = [(place - ready, start) for place, start in self._stretches[gone:]]
        return out

    def _judge(self, out: Codes, begin: int, end: int, least: float, ended: bool) -> None:
        """Leave unlabelled those of a stretch that do not see it reach the time `least`."""
        n = len(self._times)
        # From here on its end is seen.
        known = min(max(begin, end - self.delay if end < n or ended else n), len(out))
        if end < n or ended:
            last = float(self._times[end - 1])
            following = float(self._times[end]) if end < n else np.inf
            whole = following - last <= GAP_PERIODS * self._period
            if (following if whole else last + self._period) < least:
                out[known:end] = UNLABELLED
        newest = self._times[begin + self.delay : known + self.delay]
        # The earlier a step, the less of what follows it has seen.
        out[begin : begin + int(np.searchsorted(newest, least))] = UNLABELLED

    def _append(self, times: Real, codes: Codes) -> None:
        """Note new codes, and where stretches begin."""
        longest = GAP_PERIODS * self._period
        fresh = (codes[1:] != codes[:-1]) | (times[1:] - times[:-1] > longest)
        begin = len(self._codes)
        if codes[0] != self._last[1] or times[0] - self._last[0] > longest:
            self._stretches.append((begin, float(times[0])))
        for i in fresh.nonzero()[0].tolist():
            self._stretches.append((begin + i + 1, float(times[i + 1])))
        self._last = (float(times[-1]), int(codes[-1]))
        self._times = np.concatenate([self._times, times])
        self._codes = np.concatenate([self._codes, codes])
