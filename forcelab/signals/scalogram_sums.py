"""Coefficients at single samples, by the sum itself: phases of narrow wavelets in wide columns."""

from __future__ import annotations

import math
from collections.abc import Generator

import numpy as np
from numpy.typing import NDArray

from forcelab.jobs import Progress
from forcelab.signals.scalogram_bands import PHASE_RINGING, is_cut, reach
from forcelab.signals.scalogram_columns import Columns
from forcelab.signals.scalogram_source import Level, Source
from forcelab.signals.wavelets import Morlet

__all__ = ["sum_rows", "sums_are_cheaper"]

#: Samples looked at in one step.
_STEP = 1 << 18


def sums_are_cheaper(scale: float, columns: Columns) -> bool:
    """Whether sums around each column's centre cost less than a transform of the band."""
    return 32 * scale < columns.width and 11 * scale * scale < 60 * columns.width


def _kernel(scale: float, wavelet: Morlet) -> NDArray[np.complex128]:
    """The conjugate wavelet over its reach, without what the Nyquist frequency cuts."""
    if not is_cut(scale, wavelet):
        place = np.arange(-reach(scale), reach(scale) + 1)
        kernel = np.conj(wavelet.time(place / scale)) / math.sqrt(scale)
    else:
        half = PHASE_RINGING
        omega = 2 * np.pi * np.fft.fftfreq(8 * half)
        response = math.sqrt(scale) * wavelet.spectrum(scale * omega)
        place = np.arange(-half, half + 1)
        kernel = np.conj(np.fft.ifft(response)[place]) * np.kaiser(2 * half + 1, 4.0)
    return np.asarray(kernel - kernel.mean(), dtype=np.complex128)


def sum_rows(
    source: Source,
    columns: Columns,
    scales: NDArray[np.float64],
    wavelet: Morlet,
    level: Level,
) -> Generator[Progress, None, NDArray[np.complex128]]:
    """Coefficients at the columns' centre samples; a job.

    The samples around a column are read once, as far as the widest wavelet reaches.

    Parameters
    ----------
    source : Source
    columns : Columns
    scales : ndarray, shape (k,)
        In samples; at least one.
    wavelet : Morlet
    level : Level
        By which samples are shifted and sized.

    Returns
    -------
    ndarray of complex128, shape (k, columns.count)
    """
    kernels = [_kernel(scale, wavelet) for scale in scales.tolist()]
    half = max(len(kernel) for kernel in kernels) // 2
    centres = columns.centres()
    out = np.empty((len(kernels), columns.count), dtype=np.complex128)
    chunk = max(1, _STEP // (2 * half + 1))
    for left in range(0, columns.count, chunk):
        right = min(left + chunk, columns.count)
        frames = np.empty((right - left, 2 * half + 1))
        for frame, centre in zip(frames, centres[left:right].tolist(), strict=True):
            frame[:] = source.read(centre - half, centre + half + 1)[0]
        level.sized(frames)
        for row, kernel in zip(out, kernels, strict=True):
            side = len(kernel) // 2
            within = frames[:, half - side : half + side + 1]
            row[left:right] = within @ kernel.real + 1j * (within @ kernel.imag)
        yield Progress(right, columns.count, "sums")
    return out
