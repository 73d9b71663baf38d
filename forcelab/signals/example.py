"""A test signal as Morlet wavelets of several p see it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.signals.cwt import cwt, frequencies
from forcelab.signals.wavelets import Morlet


@dataclass(frozen=True, eq=False)
class WaveletView:
    """One wavelet, and the magnitudes it gives.

    Parameters
    ----------
    title : str
        Such as ``"p = 5"``.
    t : ndarray, shape (m,)
        Times in units of the scale, increasing.
    psi : ndarray of complex, shape (m,)
        The wavelet at `t`.
    hertz : ndarray, shape (k,)
        Frequencies of the rows of `magnitudes`, positive, increasing, k >= 2.
    magnitudes : ndarray, shape (k, n)
        Of the test signal; drawn as shares of the largest.
    """

    title: str
    t: NDArray[np.float64]
    psi: NDArray[np.complex128]
    hertz: NDArray[np.float64]
    magnitudes: NDArray[np.float64]


def two_tones(
    low: float = 10.0, high: float = 16.0, rate: float = 200.0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Two tones that overlap in time: `low` from 1 s to 3 s, `high` from 2 s to 4 s.

    Parameters
    ----------
    low, high : float
        Frequencies in Hz.
    rate : float
        Samples a second.

    Returns
    -------
    times, signal : ndarray, shape (n,)
        Five seconds; amplitudes of 1.
    """
    times = np.arange(0.0, 5.0, 1 / rate)
    first, second = (np.sin(2 * np.pi * tone * times) for tone in (low, high))
    return times, first * ((times >= 1) & (times < 3)) + second * ((times >= 2) & (times < 4))


def view_wavelets(
    ps: Sequence[float], signal: NDArray[np.float64], rate: float, low: float, high: float
) -> tuple[WaveletView, ...]:
    """Transform a signal with Morlet wavelets of several p.

    Parameters
    ----------
    ps : sequence of float
        Each wavelet's p.
    signal : ndarray, shape (n,)
        The test signal at a uniform rate.
    rate : float
        Samples a second.
    low, high : float
        Frequencies in Hz from which to which magnitudes are computed, ``0 < low < high``.

    Notes
    -----
    Magnitudes are divided by the square root of the scale, so that sines of one amplitude look
    equally strong whatever their frequency.
    """
    t = np.linspace(-4.0, 4.0, 801)
    hertz = np.geomspace(low, high, 121)
    views = []
    for p in ps:
        wavelet = Morlet(p)
        scales = frequencies(hertz, rate, wavelet)  # its own inverse
        magnitudes = np.abs(cwt(signal, scales, wavelet)) / np.sqrt(scales)[:, np.newaxis]
        views.append(WaveletView(f"p = {p:g}", t, wavelet.time(t), hertz, magnitudes))
    return tuple(views)
