"""Coarser grids of a long span: phases of wide wavelets need no more."""

from __future__ import annotations

import math
from collections.abc import Generator

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from forcelab.jobs import Progress
from forcelab.signals.scalogram_bands import band
from forcelab.signals.scalogram_source import Level, Source
from forcelab.signals.wavelets import Morlet

__all__ = ["coarser", "step_for"]

Real = NDArray[np.float64]

#: Samples looked at in one step.
_STEP = 1 << 18
#: Kaiser's window with side lobes of 1e-6, and its length times its transition in radians.
_BETA = 12.27
_LENGTH = (120 - 8) / 2.285
#: The part of a coarser grid's frequencies that the wavelets may use.
_USED = 0.7


def step_for(scale: float, wavelet: Morlet) -> int:
    """Samples between the points of the coarsest grid that holds a scale and all wider ones."""
    highest = band(wavelet)[1] / scale
    return 1 << max(0, math.floor(math.log2(max(1.0, _USED * math.pi / highest))))


def coarser(
    source: Source, first: int, count: int, step: int, level: Level
) -> Generator[Progress, None, Real]:
    """Read a piece of the signal on a coarser grid, without what that grid cannot hold; a job.

    Parameters
    ----------
    source : Source
    first : int
        Where the piece begins, in samples.
    count : int
        Points of the coarser grid.
    step : int
        Samples between them, a power of two; 1 reads the piece as it is.
    level : Level
        By which samples are shifted and sized.

    Returns
    -------
    ndarray of float64, shape (count,)
    """
    out = np.empty(count)
    half = math.ceil(0.5 * _LENGTH * step / (2 * np.pi * (1 - _USED))) if step > 1 else 0
    half = -(-half // step) * step
    enough = min(count * step, max(_STEP, 6 * half))
    length = fft.next_fast_len(-(-enough // step) + 2 * half // step, real=True) * step
    fresh = (length - 2 * half) // step
    place = np.arange(-half, half + 1)
    taps = np.sinc(place / step) / step * np.kaiser(2 * half + 1, _BETA)
    response = fft.rfft(np.roll(np.pad(taps, (0, length - len(taps))), -half)) if half else None
    for start in range(0, count, fresh):
        wanted = min(fresh, count - start)
        at = first + start * step
        if response is None:
            values, _ = source.read(at, at + wanted)
            out[start : start + wanted] = level.sized(values)
        else:
            values, _ = source.read(at - half, at - half + length)
            spectrum = fft.rfft(level.sized(values), overwrite_x=True)
            spectrum *= response
            # Nothing is left above the coarser grid's frequencies: the rest is cut off.
            short = fft.irfft(spectrum[: length // step // 2 + 1] / step, length // step)
            out[start : start + wanted] = short[half // step :][:wanted]
        yield Progress(start + wanted, count, "coarser grid")
    return out
