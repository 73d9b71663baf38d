"""Phases of a scalogram from the band of frequencies that each scale answers to.

A scale `a` answers to a band of about ``12 / a`` radians a sample only. So the band alone is cut
from the signal's spectrum and brought back to time by a short transform: a few points every `a`
samples instead of one every sample.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from forcelab.signals.scalogram_columns import Columns
from forcelab.signals.wavelets import Morlet

__all__ = ["PHASE_RINGING", "RINGING", "TOLERANCE", "band", "band_rows", "is_cut", "reach"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Single = NDArray[np.complex64]

#: Wavelets and filters are cut where they have fallen to this share of their peak.
TOLERANCE = 1e-6
#: Half-width of a Gaussian of unit deviation at that share.
_CUT = math.sqrt(2 * math.log(1 / TOLERANCE))
#: Samples on either side that a wavelet which the Nyquist frequency cuts is followed for: for
#: magnitudes, and for phases, which what is left of the ringing turns.
RINGING, PHASE_RINGING = 256, 1024
#: Samples over which the last value leads to the first.
_RAMP = 64
#: Points for each independent one: a row is read between its points.
_FINE = 4


def reach(scale: float) -> int:
    """Samples on either side that a coefficient rests on, to within the tolerance."""
    return math.ceil(_CUT * scale) + 1


def is_cut(scale: float, wavelet: Morlet) -> bool:
    """Whether the Nyquist frequency cuts the wavelet, which then rings beyond its reach."""
    return math.pi * scale < wavelet.p + 6.5  # see Morlet: what is cut beyond is below 1e-9


def band(wavelet: Morlet) -> tuple[float, float]:
    """The angular frequencies times scale between which the wavelet's spectrum lies."""
    low, high = wavelet.p - _CUT, wavelet.p + _CUT
    if low < 0:
        # The term that makes the mean zero lies around zero, and is small beyond p of about 5.
        low = min(low, -math.sqrt(_CUT**2 - wavelet.p**2))
    return low, high


def _spectrum(values: Real) -> tuple[Complex, int]:
    """Spectrum of the samples on a ring, the last value leading smoothly to the first."""
    n = len(values)
    length = fft.next_fast_len(n + _RAMP, real=True)
    place = (np.arange(length - n) - 0.5 * (length - n - 1)) / _RAMP
    share = 0.5 + 0.5 * np.cos(np.pi * np.clip(0.5 + place, 0.0, 1.0))
    ring = np.empty(length)
    ring[:n] = values
    ring[n:] = share * values[-1] + (1 - share) * values[0]
    return fft.rfft(ring, overwrite_x=True), length


def band_rows(
    values: Real,
    origin: int,
    step: int,
    *,
    scales: Real,
    wavelet: Morlet,
    columns: Columns,
) -> Iterator[Complex]:
    """Compute rows from one piece of the signal.

    Parameters
    ----------
    values : ndarray of float64, shape (n,)
        Every `step`-th sample, the columns and the reach of the widest scale on either side.
    origin : int
        Place of ``values[0]`` on the grid, in samples.
    step : int
        Samples of the grid between two of `values`; what lies above their Nyquist frequency has
        been filtered out.
    scales : ndarray, shape (k,)
        In samples of the grid.
    wavelet : Morlet
    columns : Columns

    Yields
    ------
    ndarray of complex128, shape (columns.count,)
        Row by row: coefficients at the columns' centre samples.
    """
    spectrum, length = _spectrum(values)
    low, high = band(wavelet)
    for scale in scales:
        widest = 2 * np.pi * scale / (high - low) / step  # between points that tell all, in steps
        between = max(1.0, widest / _FINE)
        unit = 2 * np.pi / length / step
        k = np.arange(
            max(int(np.ceil(low / scale / unit)), -(length // 2) + 1),
            min(int(np.floor(high / scale / unit)), length // 2) + 1,
        )
        part = np.empty(len(k), dtype=np.complex64)
        below = int(np.searchsorted(k, 0))
        part[:below] = np.conj(spectrum[-k[:below]])
        part[below:] = spectrum[k[below] : k[-1] + 1] if below < len(k) else 0.0
        response = math.sqrt(scale) * wavelet.spectrum(scale * unit * k).real
        part *= response.astype(np.float32)
        if length % 2 == 0 and len(k) and k[-1] == length // 2:
            part[-1] *= 0.5  # this bin stands for both signs of its frequency
        count = min(length, fft.next_fast_len(max(int(np.ceil(length / between)), len(k), 1)))
        middle = round(wavelet.p / scale / unit)
        middle = min(max(middle, int(k[0])), int(k[-1])) if len(k) else 0
        # Errors of 1e-7 of the row's largest: a tenth of the tolerance, at half the time.
        around = np.zeros(count, dtype=np.complex64)
        upper = int(np.searchsorted(k, middle))
        around[: len(k) - upper] = part[upper:]
        around[count - upper :] = part[:upper]
        points = fft.ifft(around, overwrite_x=True)
        points *= np.float32(count / length)
        spacing = length / count * step
        places = columns.centres() - origin
        turns = np.exp(2j * np.pi * middle / length * (places / step))
        yield _between(points, places / spacing) * turns


def _between(points: Single, places: Real) -> Complex:
    """Read a smooth row between its points, along straight lines."""
    left = np.clip(np.floor(places).astype(np.int64), 0, len(points) - 1)
    share = places - left
    right = np.minimum(left + 1, len(points) - 1)
    return points[left] * (1 - share) + points[right] * share
