"""Where coefficients go while they are in the cache: as they are, or as log magnitude and phase."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

__all__ = ["Coefficients", "LogPolar", "Sink"]

Real = NDArray[np.floating[Any]]
Complex = NDArray[np.complexfloating[Any, Any]]


class Sink(Protocol):
    """Takes coefficients, part by part.

    Attributes
    ----------
    direct : ndarray of real, shape (c, k, 2 * padded), or None
        Where real and imaginary parts in turn can be written without the sink's help.
    """

    direct: Real | None

    def write(self, channels: slice, scales: slice, start: int, real: Real, imag: Real) -> None:
        """Take parts of shape (channels, scales, samples) from sample `start` on.

        What lies past the last sample is left away. The arrays may be overwritten.
        """


class Coefficients:
    """Complex coefficients.

    Parameters
    ----------
    channels, scales, n : int
    padded : int
        Samples with those that only fill the last row of a product.
    single : bool
    """

    def __init__(self, channels: int, scales: int, n: int, padded: int, single: bool) -> None:
        kind = np.complex64 if single else np.complex128
        self._whole = np.empty((channels, scales, padded), dtype=kind)
        self._n = n
        self.direct: Real | None = self._whole.view(np.float32 if single else np.float64)

    @property
    def result(self) -> Complex:
        """What was written, shape (c, k, n)."""
        return self._whole[:, :, : self._n]

    def write(self, channels: slice, scales: slice, start: int, real: Real, imag: Real) -> None:
        """Take parts, see :class:`Sink`."""
        into = self.result[channels, scales, start : start + real.shape[-1]]
        into.real = real[..., : into.shape[-1]]
        into.imag = imag[..., : into.shape[-1]]


class LogPolar:
    """Log magnitudes and phases.

    Parameters
    ----------
    channels : int
    floor : ndarray, shape (k,)
        Magnitudes below are raised to it, and their phase, which means nothing, is 0.
    n : int
    single : bool

    Attributes
    ----------
    magnitudes, phases : ndarray, shape (c, k, n)
        Natural logarithms, and radians in -pi .. pi.
    """

    direct: Real | None = None

    def __init__(self, channels: int, floor: NDArray[np.float64], n: int, single: bool) -> None:
        kind = np.float32 if single else np.float64
        self.magnitudes: Real = np.empty((channels, len(floor), n), dtype=kind)
        self.phases: Real = np.empty_like(self.magnitudes)
        self._floor = np.maximum(floor**2, np.finfo(kind).tiny).astype(kind)[:, None]
        self._highest = self._floor.max(initial=0.0)
        self._half = kind(0.5)

    def write(self, channels: slice, scales: slice, start: int, real: Real, imag: Real) -> None:
        """Take parts, see :class:`Sink`."""
        magnitudes = self.magnitudes[channels, scales, start : start + real.shape[-1]]
        phases = self.phases[channels, scales, start : start + real.shape[-1]]
        real, imag = real[..., : phases.shape[-1]], imag[..., : phases.shape[-1]]
        np.arctan2(imag, real, out=phases)
        np.multiply(real, real, out=real)
        np.multiply(imag, imag, out=imag)
        power = np.add(real, imag, out=real)
        if power.min(initial=np.inf) <= self._highest:
            floor = self._floor[scales]
            phases[power <= floor] = 0.0
            np.maximum(power, floor, out=power)
        np.log(power, out=power)
        np.multiply(power, self._half, out=magnitudes)
