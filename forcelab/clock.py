"""Clocks: other devices' times, such as of taps, become seconds on the force recording's clock.

Time is float64 seconds from the start of the force recording. Every other clock (a video's, a
device's sample counter) is carried onto it by a :class:`ClockMap`, never by a nominal rate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forcelab.errors import InputError

#: Seconds between two clocks' zeros at most, and how many times as fast one may run: beyond, a
#: number is mistyped.
_FARTHEST, _FASTEST = 1e12, 1e6


def farthest_drift(late: NDArray[np.float64], window: int) -> float:
    """How far stamps move away from even ones over `window` samples, in the unit of `late`.

    Of stamps that only jitter the median distance from even ones, `late` (n,), is everywhere the
    same; where samples were lost, all that come after are late.
    """
    parts = np.median(late[: late.size // window * window].reshape(-1, window), axis=1)
    return float(np.abs(parts - np.median(late)).max())


@dataclass(frozen=True, slots=True)
class ClockMap:
    """An affine map from a device's clock to the force recording's clock.

    Parameters
    ----------
    offset : float
        Force time, in seconds, at which the device's clock reads zero.
    rate : float
        Force seconds that pass in one second of the device's clock; 1.0 for a perfect clock,
        1 + 20e-6 for one that runs 20 ppm slow. Positive.

    Raises
    ------
    InputError
        If the offset is beyond 1e12 s, or the rate not from 1e-6 to 1e6.
    """

    offset: float = 0.0
    rate: float = 1.0

    def __post_init__(self) -> None:
        if not (abs(self.offset) <= _FARTHEST and 1 / _FASTEST <= self.rate <= _FASTEST):
            raise InputError(
                f"A clock needs a finite offset and a positive rate, up to {_FARTHEST:g} s and "
                f"{_FASTEST:g}, not offset {self.offset:g} s and rate {self.rate:g}."
            )

    def to_force(self, device: ArrayLike) -> NDArray[np.float64]:
        """Carry device times (s), of any shape, to force times (s)."""
        return self.offset + self.rate * np.asarray(device, dtype=np.float64)

    def to_device(self, force: ArrayLike) -> NDArray[np.float64]:
        """Carry force times (s), of any shape, to device times (s)."""
        return (np.asarray(force, dtype=np.float64) - self.offset) / self.rate


@dataclass(frozen=True, slots=True)
class ClockFit:
    """A fitted map, and how far the taps lie from it."""

    clock: ClockMap
    #: Root mean square distance of the taps from the map, in force seconds. Zero for one or two
    #: taps, which a map meets exactly: it says nothing about the error then.
    residual: float


def fit_clock(device: Sequence[float], force: Sequence[float]) -> ClockFit:
    """Fit a clock map to events seen on both clocks, such as taps.

    `device`, `force`: their times on both, s, one at least. One tap fixes the offset alone (the
    rate stays 1); two or more fix offset and rate by least squares. What gives no map is refused.
    """
    d = np.asarray(device, dtype=np.float64)
    f = np.asarray(force, dtype=np.float64)
    if d.ndim != 1 or d.shape != f.shape or d.size == 0:
        raise InputError(
            f"Synchronising needs the same number of taps on both clocks, at least one; "
            f"there are {d.size} and {f.size}."
        )
    if d.size == 1:
        return ClockFit(ClockMap(offset=float(f[0] - d[0])), residual=0.0)
    spread = d - d.mean()
    power = float(spread @ spread)
    # Of equal times the mean may round, which leaves a spread of dust.
    if power == 0.0 or d.min() == d.max():
        raise InputError("All taps have the same device time; mark taps further apart.")
    rate = float(spread @ (f - f.mean())) / power
    clock = ClockMap(offset=float(f.mean() - rate * d.mean()), rate=rate)
    return ClockFit(clock, residual=float(np.sqrt(np.mean((clock.to_force(d) - f) ** 2))))
