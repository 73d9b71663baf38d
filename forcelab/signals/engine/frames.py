"""Overlapping frames that are transformed while they lie in the cache (overlap and save)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from forcelab.signals.engine.ring import whole_spectra
from forcelab.signals.engine.segments import without_line
from forcelab.signals.wavelets import Morlet

__all__ = ["Frames", "slope_at_zero"]

Real = NDArray[np.float64]
Floats = NDArray[np.floating[Any]]
Complex = NDArray[np.complexfloating[Any, Any]]

#: Samples of the frames that are worked on at once: with their spectra they fill half of L2.
CACHED = 1 << 15
#: Longest frame; whole recordings up to four times as long may still be one.
LONGEST = 1 << 11


class Frames:
    """How channels are cut into frames, and the transforms of those.

    A frame of `length` samples gives the `hop` coefficients from its middle; the others, which
    the ring of the frame has spoilt, are given by the frames beside it. The straight line through
    the ends of a frame is taken away before: the ring would turn it into a jump, beside which the
    rest of a slow force is lost in single precision. Its transform is one number, ``-i`` times the
    slope times the response's derivative at frequency 0.

    Parameters
    ----------
    n : int
        Samples of a channel.
    margin : int
        Samples to both sides that take part in a coefficient.
    single : bool
        Whether to invert in single precision; spectra are always taken in double.
    multiple : int
        The hop is a multiple of it.

    Attributes
    ----------
    length, margin, hop : int
        In samples; a frame begins `margin` before the first of its coefficients.
    count : int
        Frames that n samples take.
    together : int
        Frames that fill the cache.
    """

    def __init__(self, n: int, margin: int, single: bool, multiple: int = 1) -> None:
        self.margin = margin
        self.length = _length(n, margin, multiple)
        self.hop = (self.length - 2 * margin) // multiple * multiple
        self.count = -(-n // self.hop)
        self.together = max(1, CACHED // self.length)
        self._single = single

    def weights(self, response: Real) -> Floats:
        """A real response at the frequencies of ``fftfreq``, as :meth:`rows` wants it.

        Twice each: multiplying real and imaginary parts alike is faster than a complex product.
        """
        return np.repeat(response, 2).astype(np.float32 if self._single else np.float64)

    def spectra(self, part: Real, frames: int) -> tuple[Complex, Real]:
        """Spectra and slopes of neighbouring frames.

        Parameters
        ----------
        part : ndarray, shape (c, (frames - 1) * hop + length or more)
            From `margin` samples before the first coefficient on.
        frames : int

        Returns
        -------
        spectra : ndarray, shape (c, frames, length)
            At positive and negative frequencies, without the straight lines.
        slopes : ndarray, shape (c, frames)
            Of the lines, a sample.
        """
        c, length = len(part), self.length
        strides = (part.strides[0], self.hop * part.strides[1], part.strides[1])
        views = np.lib.stride_tricks.as_strided(part, (c, frames, length), strides, writeable=False)
        rest, slopes = without_line(views)
        half = fft.rfft(rest, axis=-1, overwrite_x=True)
        return whole_spectra(half, length, self._single), slopes[:, :, 0]

    def rows(self, spectra: Complex, slopes: Real, weights: Floats, slope: float) -> Complex:
        """Coefficients of frames, shape (c, frames, hop).

        Parameters
        ----------
        spectra, slopes : ndarray
            From :meth:`spectra`.
        weights : ndarray
            From :meth:`weights`.
        slope : float
            The response's derivative at frequency 0.
        """
        product = np.empty_like(spectra)
        np.multiply(spectra.view(weights.dtype), weights, out=product.view(weights.dtype))
        # The inverse transform divides by the length.
        product[:, :, 0] = slopes * (-1j * slope * self.length)
        found = fft.ifft(product, axis=-1, overwrite_x=True)
        return np.asarray(found[:, :, self.margin : self.margin + self.hop])


def slope_at_zero(wavelet: Morlet, scale: float) -> float:
    """The response's derivative at frequency 0.

    Of the spectrum exp(-(u - p)^2 / 2) - exp(-p^2 / 2) exp(-u^2 / 2): p exp(-p^2 / 2).
    """
    slope = math.sqrt(2 * math.pi) * math.pi**-0.25 * wavelet.p * math.exp(-(wavelet.p**2) / 2)
    return slope * scale**1.5


def _length(n: int, margin: int, multiple: int) -> int:
    """The length of frames that costs least: long ones waste less, short ones stay in the cache."""
    whole = fft.next_fast_len(n + 2 * margin + n % 2, real=True)
    longest = max(LONGEST, 1 << math.ceil(math.log2(8 * margin)))
    lengths = [1 << k for k in range(8, 28)] + [3 << k for k in range(7, 27)]
    lengths = [b for b in lengths if b <= longest and b - 2 * margin >= max(64, multiple)]
    if whole <= 4 * longest and multiple == 1:
        lengths.append(whole)

    def cost(length: int) -> float:
        frames = -(-n // ((length - 2 * margin) // multiple * multiple))
        missed = 1.25 if length > CACHED // 4 else 1.0
        return frames * length * (math.log2(length) + 4) * missed

    return min(lengths, key=cost)
