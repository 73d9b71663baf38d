"""What virtual devices send: their readings by time, real packets of them, and when each was sent.

The layout of the packets is that of :mod:`forcelab.formats.optoforce.packets`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forcelab.errors import InputError
from forcelab.formats.optoforce.packets import KINDS

__all__ = ["Run", "Source", "Truth", "build_packets", "rows", "truth_of"]

#: Readings at device times (s), shape (m,): whole counts, shape (m, c).
Source = Callable[[NDArray[np.float64]], NDArray[np.int64]]


def rows(counts: ArrayLike, rate: float) -> Source:
    """A recording as a source: at each time the sample that was the nearest; zero past its end.

    Parameters
    ----------
    counts : array_like of int, shape (n, c)
        Readings.
    rate : float
        Rows a second of the device's clock.
    """
    table = np.atleast_2d(np.asarray(counts, dtype=np.int64))

    def read(times: NDArray[np.float64]) -> NDArray[np.int64]:
        places = np.floor(times * rate + 0.5).astype(np.int64)
        out = table[np.clip(places, 0, len(table) - 1)]
        out[places >= len(table)] = 0
        return out

    return read


def build_packets(
    counters: NDArray[np.int64], status: NDArray[np.int64], counts: NDArray[np.int64]
) -> NDArray[np.uint8]:
    """OptoForce packets, one a row.

    Parameters
    ----------
    counters, status : ndarray of int64, shape (n,)
        Sample counter, which wraps here, and status word.
    counts : ndarray of int64, shape (n, c)
        Readings: 3 of one sensor, 12 of four, 6 of a 6-axis one; clipped to 16 bits.

    Returns
    -------
    ndarray of uint8, shape (n, size)

    Raises
    ------
    InputError
        If no device sends as many readings.
    """
    n, c = counts.shape
    kind = next((kind for kind in KINDS if kind.columns == c), None)
    if kind is None:
        raise InputError(f"No OptoForce device sends {c} readings at once; 3, 6 or 12 it must be.")
    out = np.empty((n, kind.frame.size), dtype=np.uint8)
    out[:, :4] = np.frombuffer(kind.frame.header, dtype=np.uint8)
    fields = np.column_stack([counters, status, np.clip(counts, -32_768, 32_767)])
    out[:, 4:-2] = fields.astype(np.uint16).astype(">u2").view(np.uint8).reshape(n, -1)
    sums = out[:, :-2].sum(axis=1, dtype=np.int64)
    out[:, -2:] = sums.astype(">u2").view(np.uint8).reshape(n, 2)
    return out


@dataclass(frozen=True)
class Run:
    """A stretch in which a device sent at one rate without being switched off.

    Parameters
    ----------
    first : int
        Number of its first sample since the device was made.
    start : float
        When that was taken, in seconds of the host's monotonic clock.
    device : float
        The same in seconds of the device's clock.
    rate : float
        Samples a second of the device's clock; 0 while it stands still.
    pace : float
        Seconds of the device's clock that pass in one of the host's.
    """

    first: int
    start: float
    device: float
    rate: float
    pace: float

    def due(self, now: float) -> int:
        """How many samples it has taken up to a moment of the host's clock."""
        if self.rate == 0 or now < self.start:
            return 0
        return int((now - self.start) * self.pace * self.rate) + 1

    def device_times(self, samples: NDArray[np.int64]) -> NDArray[np.float64]:
        """When samples were taken, in seconds of the device's clock."""
        return self.device + (samples - self.first) / (self.rate or 1.0)

    def host_times(self, samples: NDArray[np.int64]) -> NDArray[np.float64]:
        """When samples were taken, in seconds of the host's monotonic clock."""
        return self.start + (self.device_times(samples) - self.device) / self.pace


@dataclass(frozen=True)
class Truth:
    """What a virtual device measured and when, whatever of it arrived.

    Parameters
    ----------
    times : ndarray of float64, shape (n,)
        When each sample was taken, in seconds of the host's monotonic clock.
    device_times : ndarray of float64, shape (n,)
        The same in seconds of the device's own clock.
    values : ndarray, shape (n, c)
        Its readings before any fault: counts for an OptoForce, numbers for text lines.
    intact : ndarray of bool, shape (n,)
        Whether it was sent, as it was, to somebody who listened.
    """

    times: NDArray[np.float64]
    device_times: NDArray[np.float64]
    values: NDArray[np.float64]
    intact: NDArray[np.bool_]


def truth_of(
    runs: list[Run],
    sent: int,
    spoiled: list[NDArray[np.int64]],
    values: Callable[[NDArray[np.float64]], NDArray[Any]],
) -> Truth:
    """The truth about samples ``0 .. sent - 1``.

    Parameters
    ----------
    runs : list of Run
        In their order.
    sent : int
        Samples so far.
    spoiled : list of ndarray of int64
        Numbers of those that did not go out as they were.
    values : callable
        Readings at device times (s).
    """
    times, device_times = np.empty(sent), np.empty(sent)
    ends = [*(run.first for run in runs[1:]), sent]
    for run, end in zip(runs, ends, strict=False):  # without a run there is nothing yet
        samples = np.arange(run.first, end)
        times[run.first : end] = run.host_times(samples)
        device_times[run.first : end] = run.device_times(samples)
    intact = np.ones(sent, dtype=bool)
    for numbers in spoiled:
        intact[numbers] = False
    return Truth(times, device_times, values(device_times).astype(np.float64), intact)
