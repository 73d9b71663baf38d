"""Whether the zero of a force sensor drifts, as by temperature, while it is used.

Nothing tells when a sensor is unloaded. But a person who handles things makes its readings change,
and lets go of them again and again: a level that is quiet, near the zero as it was known, and there
for many windows is the zero as it is now. A load that is held steadily is farther from zero than
that.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

_WINDOW = 0.5  # s that are looked at as one
_NEEDED = 8  # samples of a window that tell its noise
_REMEMBERED = 20  # quiet windows whose median is the zero: 10 s
_FIRST = 4  # quiet windows that tell the zero at the beginning: 2 s
_QUIET = 3.0  # times the least noise so far, at most, in a quiet window and between its halves
_NOISE, _SHARE = 20.0, 0.01  # a drift is reported beyond so many times the noise and this share
_NEAR = 5.0  # times that, at most, from which a quiet level is still the zero


class ZeroDrift:
    """Follows the zero level of each channel of a device; not thread-safe.

    The zero is what is read when it begins, after which :meth:`restart` takes it anew. A drift is
    reported where it is more than 20 times the noise and 1 % of the largest reading so far.
    """

    def __init__(self, channels: int) -> None:
        self._channels = channels
        self.restart()

    def restart(self) -> None:
        """What comes next is unloaded, as after zeroing."""
        self._levels: list[deque[float]] = [
            deque(maxlen=_REMEMBERED) for _ in range(self._channels)
        ]
        self._zero = np.full(self._channels, np.nan)
        self._noise = np.full(self._channels, np.inf)
        self._step = np.full(self._channels, np.inf)
        self._largest = np.zeros(self._channels)
        self._away = np.zeros(self._channels, dtype=np.int64)  # quiet levels in a row off the first
        self.interrupt()

    def interrupt(self) -> None:
        """Note that time is missing, across which no window may reach."""
        self._pending: list[NDArray[np.float64]] = []
        self._window_start = np.nan

    @property
    def drift(self) -> NDArray[np.float64]:
        """The drift of each zero in the channel's unit, shape (c,); 0 where it is small."""
        now = np.array([np.median(levels) if levels else np.nan for levels in self._levels])
        away = now - self._zero
        reported = np.abs(away) > self._threshold()
        reported &= np.array(
            [len(levels) == _REMEMBERED for levels in self._levels], dtype=np.bool_
        )
        return np.where(reported, away, 0.0)

    def update(self, times: NDArray[np.float64], values: NDArray[np.float64]) -> None:
        """Take in samples taken or come at `times` (s), values of shape (n, c)."""
        if not len(times):
            return
        if not times[0] - self._window_start < _WINDOW:  # or nothing has begun
            self._close_window()
            self._window_start = float(times[0])
        self._pending.append(values)

    def _threshold(self) -> NDArray[np.float64]:
        """The least drift that is reported."""
        least: NDArray[np.float64] = np.maximum(_NOISE * self._noise, _SHARE * self._largest)
        return least

    def _close_window(self) -> None:
        """Evaluate the window that has ended."""
        values = np.concatenate(self._pending) if self._pending else np.empty((0, self._channels))
        self._pending = []
        if len(values) < _NEEDED or not np.isfinite(values).all():
            return
        half = len(values) // 2
        steps = np.abs(np.diff(values, axis=0))
        # No reading tells less than the step between two numbers that the sensor can give.
        step = np.where(steps > 0, steps, np.inf).min(axis=0)
        self._step = np.minimum(self._step, step)
        level = np.median(values, axis=0)
        noise = 1.4826 * np.median(np.abs(values - level), axis=0)
        noise = np.maximum(noise, np.where(np.isfinite(self._step), self._step, 0.0))
        self._noise = np.minimum(self._noise, noise)
        moved = np.abs(values[:half].mean(axis=0) - values[half:].mean(axis=0))
        quiet = (moved <= _QUIET * self._noise) & (noise <= _QUIET * self._noise)
        for i in np.flatnonzero(quiet).tolist():
            self._add_level(i, float(level[i]))
        has_zero = np.isfinite(self._zero)
        off = np.abs(values - np.where(has_zero, self._zero, 0.0)).max(axis=0)
        self._largest = np.where(has_zero, np.maximum(self._largest, off), self._largest)

    def _add_level(self, channel: int, level: float) -> None:
        """Take in a quiet level of a channel."""
        levels = self._levels[channel]
        if np.isnan(self._zero[channel]):
            # The first level is unloaded; what is held soon after is not part of the zero. One that
            # does not come back was no zero: it was loaded when it began.
            near = not levels or abs(level - np.median(levels)) <= self._threshold()[channel]
            self._away[channel] = 0 if near else self._away[channel] + 1
            if self._away[channel] == _REMEMBERED:
                levels.clear()
                self._away[channel], near = 0, True
            if near:
                levels.append(level)
            if len(levels) == _FIRST:
                self._zero[channel] = np.median(levels)
        elif abs(level - np.median(levels)) <= _NEAR * self._threshold()[channel]:
            levels.append(level)
