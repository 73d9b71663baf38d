"""What virtual devices share that take samples at a rate: which are due, and the truth of them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.virtual_port import VirtualPort
from forcelab.capture.virtual_streams import Run, Truth, truth_of

__all__ = ["Absent", "Readings", "VirtualSampler"]

#: Numbers at device times (s), shape (m,): shape (m, c).
Readings = Callable[[NDArray[np.float64]], NDArray[Any]]
#: Which samples are never sent, by their device times (s), shape (m,).
Absent = Callable[[NDArray[np.float64]], NDArray[np.bool_]]


class VirtualSampler(VirtualPort):
    """A device that takes samples at a rate, and its truth.

    Parameters
    ----------
    source : callable
        Readings, shape (m, c), at device times (s), shape (m,).
    rate : float
        Samples a second of its own clock when it is switched on.
    clock_ppm : float
        How fast its clock is, in parts per million; negative for a slow one.
    path, burst, waits
        As of :class:`~forcelab.capture.virtual_port.VirtualPort`.
    absent : callable, optional
        Which samples never leave it, by their device times (s); a counter counts them.

    Attributes
    ----------
    duration : float
        Seconds of the device's clock after which it has nothing more to send; can be set later.
    """

    def __init__(
        self,
        source: Readings,
        rate: float,
        clock_ppm: float,
        path: Path | None,
        burst: float,
        waits: bool,
        absent: Absent | None = None,
    ) -> None:
        super().__init__(path, burst=burst, waits=waits)
        self.duration = np.inf
        self._source, self._rate, self._pace = source, rate, 1.0 + 1e-6 * clock_ppm
        self._absent = absent
        self._runs: list[Run] = []
        self._sent = 0
        self._last = (0, 0)
        self._spoiled: list[NDArray[np.int64]] = []

    @property
    def begun(self) -> float | None:
        """When its own clock began, in seconds of the host's monotonic one; None before that."""
        return self._runs[0].start if self._runs else None

    def truth(self) -> Truth:
        """What was measured and when, up to now; settled once the device is closed."""
        return truth_of(list(self._runs), self._sent, list(self._spoiled), self._source)

    def _begin(self, now: float) -> None:
        self._run_from(now, self._rate)

    def _run_from(self, now: float, rate: float) -> None:
        """Take samples from now on at a rate."""
        origin = self._runs[0].start if self._runs else now
        self._runs.append(Run(self._sent, now, (now - origin) * self._pace, rate, self._pace))

    def _taken(self, now: float) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Numbers and device times (s) of the samples taken since the last time."""
        run = self._runs[-1]
        samples = np.arange(self._sent, run.first + run.due(now))
        times = run.device_times(samples)
        samples, times = samples[times < self.duration], times[times < self.duration]
        if run.device + (now - run.start) * run.pace >= self.duration:
            self.ended.set()
        self._last = (self._sent, self._sent + len(samples))
        self._sent += len(samples)
        return samples, times

    def _leaving(
        self, samples: NDArray[np.int64], times: NDArray[np.float64]
    ) -> NDArray[np.bool_] | slice:
        """Which of some samples leave it."""
        if self._absent is None or not len(times):
            return slice(None)
        gone = self._absent(times)
        self._spoiled.append(samples[gone])
        return np.logical_not(gone)

    def _next(self, now: float) -> tuple[NDArray[np.float64], NDArray[Any]]:
        """Device times (s) and readings of the samples that leave it since the last time."""
        samples, times = self._taken(now)
        times = times[self._leaving(samples, times)]
        return times, self._source(times)

    def _unheard(self) -> None:
        if self._last[1] > self._last[0]:
            self._spoiled.append(np.arange(*self._last))
