"""Weights of samples that have come already in the coefficients of a stream.

The coefficient of scale `a` at sample `b`, as known at sample ``t = b + delay``, is the offline
one of the samples up to `t` with the last value held: a weighted sum of these samples. Wide
wavelets see a decimated copy of all but the newest samples. The copy is made with a Kaiser window
as its filter, whose response is divided out of the wavelet and whose images (spectra shifted by the
decimated rate) are below 1e-7 of the signal.

References
----------
.. [1] Jackson, J. I. et al., "Selection of a convolution function for Fourier inversion using
   gridding", IEEE Trans. Med. Imaging 10 (1991): the Kaiser window as a gridding kernel, its
   response divided out afterwards, and its beta for a width and an oversampling.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from forcelab.signals.wavelets import Wavelet

__all__ = [
    "ENDED",
    "HALF",
    "HELD",
    "HIGHEST",
    "RINGING",
    "Kernel",
    "low_pass",
    "reaches",
    "support",
]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Half-width in decimated samples of the filter before decimation.
HALF = 4
#: Highest angular frequency of a wavelet on its decimated copy, radians per decimated sample.
HIGHEST = 0.9
#: A spectrum is taken as ended where it is below this share of its peak.
ENDED = 1e-9
#: Beyond the newest sample their mean holds, over this share of the scale. The last sample alone is
#: as good on smooth forces, but its noise, held for long, is loud: half of an early coefficient.
HELD = 0.125
#: A wavelet cut at the Nyquist frequency rings for ever; its weights end after this many samples.
RINGING = 512


def support(wavelet: Wavelet, tolerance: float) -> float:
    """Half-width in units of the scale outside of which a wavelet is below 0.4 of `tolerance`.

    As a share of its peak. The rest is for what stands in for the samples out there: see
    :data:`HELD`. For a Morlet 3.9 at 1.4e-3, 4.8 at 3e-5, 5.6 at 3e-7.
    """
    t = np.linspace(0.0, wavelet.radius, 20_001)
    size = np.maximum(np.abs(wavelet.time(t)), np.abs(wavelet.time(-t)))
    loud = np.flatnonzero(size > 0.4 * tolerance * np.max(size))
    return float(t[loud[-1]])


def reaches(scales: Real, wavelet: Wavelet, tolerance: float) -> NDArray[np.int64]:
    """Samples to each side of a coefficient that matter to `tolerance`, shape (k,)."""
    c = support(wavelet, tolerance)
    return np.array([Kernel.of(float(a), wavelet).reach(c, tolerance) for a in scales], np.int64)


@dataclass(frozen=True)
class Kernel:
    """The weights of one scale, as the offline engine has them on an endless signal.

    Parameters
    ----------
    scale : float
        In samples.
    response : ndarray of complex128, shape (N,)
        Fourier transform of the weights at the frequencies of an FFT of length N.
    values : ndarray of complex128, shape (N,)
        ``values[m]`` is the weight in the coefficient at `b` of the sample ``b - m``; negative
        places count from the end.
    """

    scale: float
    response: Complex
    values: Complex

    @classmethod
    def of(cls, scale: float, wavelet: Wavelet) -> Kernel:
        """The kernel of one scale."""
        n = 1 << max(14, int(np.ceil(np.log2(4 * wavelet.radius * scale))))
        response = np.sqrt(scale) * np.conj(wavelet.spectrum(2 * np.pi * scale * fft.fftfreq(n)))
        both = wavelet.spectrum(scale * np.array([-np.pi, np.pi]))
        response[n // 2] = np.sqrt(scale) * np.conj(both.mean())
        values = fft.ifft(response)
        if wavelet.real:
            values.imag = 0.0
        return cls(scale, response, values)

    def reach(self, c: float, tolerance: float) -> int:
        """Samples to each side that matter: c scales, more for a wavelet that rings."""
        wide = math.ceil(c * self.scale)
        top = len(self.response) // 2
        # Not at the Nyquist frequency alone: the Haar wavelet's spectrum has zeros.
        cut = np.abs(self.response[top - top // 8 : top + top // 8])
        if wide >= RINGING or np.max(cut) <= tolerance * np.max(np.abs(self.response)):
            return wide
        # What is left out must be quiet by its energy, for the ringing falls so slowly that many
        # samples of noise are heard together.
        energy = np.abs(self.values[: top + 1]) ** 2
        beyond = np.append(np.cumsum(energy[::-1])[::-1][1:], 0.0)
        ends = int(np.argmax(beyond <= tolerance**2 * energy.sum()))
        return max(wide, min(ends, RINGING))

    def weights(self, delay: int, past: int) -> Complex:
        """Weights of the samples ``t, t - 1, ..`` in the coefficient at ``t - delay``.

        Returns
        -------
        ndarray, shape (delay + past + 1,)
            The mean of the newest samples stands for all that will follow, and that of the oldest
            for all before, so that a constant gives nothing.
        """
        n = len(self.values)
        kept = self.values[np.arange(-delay, past + 1) % n]
        held = min(max(1, int(HELD * self.scale)), len(kept))
        kept[:held] += np.sum(self.values[n // 2 : n - delay]) / held
        kept[-held:] -= np.sum(kept) / held
        kept[-1] -= np.sum(kept)  # what rounding has left
        return kept

    def without(self, filter_: Real) -> Complex:
        """The kernel with a symmetric filter's response divided out, laid out as `values`."""
        n, half = len(self.values), len(filter_) // 2
        ring = np.zeros(n)
        ring[np.arange(-half, half + 1)] = filter_
        gain = fft.fft(ring).real
        wanted = np.abs(self.response) > 1e-3 * ENDED * np.max(np.abs(self.response))
        # Beyond the wavelet's band a gain near zero would blow up what is nothing.
        share = np.where(wanted & (gain > 1e-3), self.response / np.maximum(gain, 1e-3), 0.0)
        return fft.ifft(share)


def low_pass(step: int) -> Real:
    """The filter before decimation by `step`, shape (2 * HALF * step - 1,), of unit sum."""
    beta = np.pi * 2 * HALF * (1 - 0.5 * HIGHEST / np.pi) * 0.97
    window = np.kaiser(2 * HALF * step + 1, beta)[1:-1]
    return window / np.sum(window)
