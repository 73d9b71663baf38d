"""Weights of samples that have come already in the coefficients of a stream.

The coefficient of scale `a` at sample `b`, as known at sample ``t = b + delay``, is the offline
one of the samples up to `t` with the last value held: a weighted sum of these samples. Wide
wavelets see a decimated copy of all but the newest samples. The copy is made with a Kaiser window
as its filter, whose response is divided out of the wavelet and whose images (spectra shifted by the
decimated rate) are below :data:`IMAGES` of the signal.

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

__all__ = ["RINGING", "Kernel", "Level", "low_pass", "plan", "support"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Half-width in decimated samples of the filter before decimation.
HALF = 4
#: Largest share of what lies beyond the decimated copy's band that comes back into the wavelet's.
IMAGES = 1e-7
#: Highest angular frequency of a wavelet on its decimated copy, radians per decimated sample.
HIGHEST = 0.9
#: A spectrum is taken as ended where it is below this share of its peak.
ENDED = 1e-9
#: Outputs of one matrix product on the undecimated signal.
BLOCK = 16
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
        size = np.abs(self.values[: RINGING + 1])
        top = len(self.response) // 2
        # Not at the Nyquist frequency alone: the Haar wavelet's spectrum has zeros.
        cut = np.abs(self.response[top - top // 8 : top + top // 8])
        if wide >= RINGING or np.max(cut) <= tolerance * np.max(np.abs(self.response)):
            return wide
        loud = np.flatnonzero(size > 0.4 * tolerance * np.max(size))
        return max(wide, int(loud[-1]))

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


@dataclass(frozen=True)
class Level:
    """Scales whose coefficients come from one matrix product.

    Parameters
    ----------
    members : ndarray of int, shape (k,)
        Places of the scales among all.
    step : int
        Decimation of the copy; 1 where there is none.
    block : int
        Outputs of one product, a multiple of `step`.
    coarse, fine : int
        How many decimated samples, and how many full-rate ones before the block's first sample,
        take part. The newest decimated sample lies ``HALF * step`` before the block.
    matrix : ndarray of float64, shape (block * k * 2, coarse + fine + block)
        Rows by output, scale, and real or imaginary part; columns by time, decimated first.
    """

    members: NDArray[np.int64]
    step: int
    block: int
    coarse: int
    fine: int
    matrix: Real


def _step(taps: int, highest: float) -> int:
    """The decimation that costs the fewest products; `highest` in radians per sample."""
    steps = [1]
    while 2 * steps[-1] * highest <= HIGHEST:
        steps.append(2 * steps[-1])
    costs = [taps + 0.5 * BLOCK]
    costs += [(taps / step) + 2 * HALF * step + 0.5 * max(step, BLOCK) for step in steps[1:]]
    return steps[int(np.argmin(costs))]


def plan(
    scales: Real, wavelet: Wavelet, delays: NDArray[np.int64], pasts: NDArray[np.int64]
) -> list[Level]:
    """Group scales by octaves and build their matrices.

    Parameters
    ----------
    scales : ndarray, shape (k,)
        In samples.
    wavelet : Wavelet
    delays, pasts : ndarray of int, shape (k,)
        Samples after and before the coefficient that take part.
    """
    if not len(scales):
        return []
    frequencies = np.linspace(0.0, 64.0 + 2 * getattr(wavelet, "p", 0.0), 4096)
    size = np.abs(wavelet.spectrum(frequencies)) + np.abs(wavelet.spectrum(-frequencies))
    ended = float(frequencies[np.flatnonzero(size > ENDED * np.max(size))[-1]])
    octaves = np.floor(np.log2(scales / np.min(scales)) + 1e-9)
    levels = []
    for octave in np.unique(octaves):
        members = np.flatnonzero(octaves == octave)
        kernels = [Kernel.of(float(scales[j]), wavelet) for j in members]
        taps = int(np.max(delays[members] + pasts[members])) + 1
        highest = ended / float(np.min(scales[members]))
        step = _step(taps, highest)
        levels.append(_level(members, kernels, delays[members], pasts[members], step))
    return levels


def _level(
    members: NDArray[np.int64],
    kernels: list[Kernel],
    delays: NDArray[np.int64],
    pasts: NDArray[np.int64],
    step: int,
) -> Level:
    """The matrix of one level."""
    taps = int(np.max(delays + pasts)) + 1
    block = max(BLOCK, step)
    if step == 1:
        coarse, fine = 0, taps - 1
    else:
        coarse = max(0, math.ceil((taps + block) / step) - HALF) + 2
        fine = (2 * HALF - 1) * step - 1
    matrix = np.zeros((block, len(members), 2, coarse + fine + block))
    filter_ = low_pass(step)
    for s, kernel in enumerate(kernels):
        delay, past = int(delays[s]), int(pasts[s])
        weights = kernel.weights(delay, past)
        smooth = kernel.without(filter_) if coarse else kernel.values
        for row in range(block):
            # Distances into the past from this row's newest sample.
            ages = row + fine - np.arange(fine + row + 1)
            line = np.zeros(coarse + fine + block, dtype=np.complex128)
            known = ages < len(weights)
            line[coarse : coarse + fine + row + 1][known] = weights[ages[known]]
            if coarse:
                # Places relative to the block's first sample.
                centres = -HALF * step - step * np.arange(coarse - 1, -1, -1)
                away = row - delay - centres  # from the decimated sample to the coefficient
                held = max(1, int(HELD * kernel.scale) // step)
                _share(line, away, past, step * smooth, held, centres + fine, filter_)
            matrix[row, s, 0], matrix[row, s, 1] = line.real, line.imag
    flat = np.ascontiguousarray(matrix.reshape(-1, matrix.shape[3]))
    return Level(members, step, block, coarse, fine, flat)


def _share(
    line: Complex,
    away: NDArray[np.int64],
    past: int,
    smooth: Complex,
    held: int,
    places: NDArray[np.int64],
    filter_: Real,
) -> None:
    """Give the decimated samples their weights, and the full-rate ones what is left for them.

    Parameters
    ----------
    line : ndarray, shape (columns,)
        A row of the matrix with the weights of the full-rate columns; changed.
    away : ndarray of int, shape (coarse,)
        Distance from each decimated sample to the coefficient's.
    past : int
        The largest distance that counts.
    smooth : ndarray
        Weight of a decimated sample by distance.
    held : int
        Decimated samples that stand for all before.
    places : ndarray of int, shape (coarse,)
        Where each one's filter is centred among the full-rate columns.
    filter_ : ndarray
    """
    coarse, half = len(away), len(filter_) // 2
    reached = np.flatnonzero(away <= past)
    if not reached.size:
        return
    line[reached] = smooth[away[reached] % len(smooth)]
    for j in range(max(0, coarse - 2 * HALF), coarse):
        low, high = max(0, places[j] - half), places[j] + half + 1
        line[coarse + low : coarse + high] -= (
            line[j] * filter_[half - places[j] + low :][: high - low]
        )
    line[reached[:held]] -= np.sum(line) / len(reached[:held])
    line[reached[0]] -= np.sum(line)
