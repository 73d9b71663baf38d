"""What makes long spans affordable: power spectra of blocks, and filtered coarser grids.

Where a column of the screen is much wider than a wavelet, the column's mean of ``|W|^2`` is the
wavelet's share of the column's power spectrum (Parseval), one short transform for all scales; no
impact is missed, however short. For the wider wavelets the signal is brought to a coarser grid.
"""

from __future__ import annotations

import math
from collections.abc import Generator

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from forcelab.jobs import Progress
from forcelab.signals.scalogram_bands import Columns, band
from forcelab.signals.scalogram_source import Source
from forcelab.signals.wavelets import Morlet

__all__ = ["BLOCKS", "block_length", "block_rows", "coarser", "step_for", "widest_in_blocks"]

Real = NDArray[np.float64]

#: Blocks for each column; they overlap by half.
BLOCKS = 4
#: A wavelet fits into a block that is so many times its scale long.
ROOM = 32.0
#: Shape of the blocks' window: its side lobes lie below 1e-6 of its peak.
_ALPHA = 4.0
#: Samples looked at in one step.
_STEP = 1 << 18
#: Kaiser's window with side lobes of 1e-6, and its length times its transition in radians.
_BETA = 12.27
_LENGTH = (120 - 8) / 2.285
#: The part of a coarser grid's frequencies that the wavelets may use.
_USED = 0.7


def block_length(width: float) -> int:
    """Samples of a block, for columns of `width` samples: half a column, its edges half again."""
    return int(fft.next_fast_len(max(2, math.ceil(2 * width / BLOCKS)), real=True))


def widest_in_blocks(length: int) -> float:
    """The largest scale that blocks of `length` samples tell."""
    return length / ROOM


def _window(length: int) -> Real:
    """Kaiser-Bessel derived window: smooth, and its square and its neighbour's add up to one."""
    half = length // 2
    rise = np.cumsum(np.kaiser(half + 1, math.pi * _ALPHA))
    left = np.sqrt(rise[:half] / rise[-1])
    middle = np.ones(length - 2 * half)
    return np.concatenate([left, middle, left[::-1]])


def _shares(length: int, scales: Real, wavelet: Morlet) -> Real:
    """What each line of a block's power spectrum adds to each scale's mean power."""
    omega = 2 * np.pi * np.arange(length // 2 + 1) / length
    out = np.empty((len(omega), len(scales)))
    for j, scale in enumerate(scales):
        both = wavelet.spectrum(scale * omega).real ** 2
        both += wavelet.spectrum(-scale * omega).real ** 2
        if length % 2 == 0:
            both[-1] *= 0.25  # the mean of two halves of the line, once
        both[0] = 0.0
        out[:, j] = scale * both
    return out / (length * np.sum(_window(length) ** 2))


def block_rows(
    source: Source,
    columns: Columns,
    length: int,
    *,
    scales: Real,
    wavelet: Morlet,
    blocks: int = BLOCKS,
    shift: float,
    exponent: int,
) -> Generator[Progress, None, Real]:
    """Compute rows of narrow wavelets from power spectra; a job.

    Parameters
    ----------
    source : Source
    columns : Columns
    length : int
        Samples of a block.
    scales : ndarray, shape (k,)
        In samples, none above :func:`widest_in_blocks`.
    wavelet : Morlet
    blocks : int
        Blocks for each column; 1 looks at the middle of each column only.
    shift, exponent
        Samples are taken as ``(x - shift) / 2**exponent``.

    Returns
    -------
    ndarray of float64, shape (k, columns.count)
        Means of ``|W|^2``.
    """
    # Single precision errs by 1e-7 of the largest sample, a tenth of the windows' side lobes.
    window = _window(length).astype(np.float32)
    shares = _shares(length, scales, wavelet).astype(np.float32)
    place = np.arange(length) - 0.5 * (length - 1)
    ramp = (place / math.sqrt(float(place @ place))).astype(np.float32)
    out = np.empty((len(scales), columns.count))
    width = columns.width / blocks
    chunk = max(1, int(_STEP / max(length * blocks, columns.width)))
    for left in range(0, columns.count, chunk):
        right = min(left + chunk, columns.count)
        middles = columns.first + width * (np.arange(left * blocks, right * blocks) + 0.5)
        starts = np.round(middles - 0.5 * length).astype(np.int64)
        if blocks == 1:
            frames = np.empty((len(starts), length), dtype=np.float32)
            for frame, start in zip(frames, starts.tolist(), strict=True):
                frame[:] = _sized(source.read(start, start + length)[0], shift, exponent)
        else:
            first = int(starts[0])
            values = _sized(source.read(first, int(starts[-1]) + length)[0], shift, exponent)
            frames = np.lib.stride_tricks.sliding_window_view(values, length)[starts - first]
        # A slope that ends with the block would be heard at all frequencies.
        frames -= frames.mean(axis=1, keepdims=True)
        frames -= np.outer(frames @ ramp, ramp)
        frames *= window
        spectra = fft.rfft(frames, axis=1, overwrite_x=True)
        power = spectra.real**2 + spectra.imag**2
        means = power @ shares
        out[:, left:right] = means.reshape(right - left, blocks, -1).mean(axis=1).T
        yield Progress(right, columns.count, "power spectra")
    return out


def _sized(values: Real, shift: float, exponent: int) -> NDArray[np.float32]:
    """Samples around nothing, the largest about one."""
    values -= shift
    np.ldexp(values, -exponent, out=values)
    return values.astype(np.float32)


def step_for(scale: float, wavelet: Morlet) -> int:
    """Samples between the points of the coarsest grid that holds a scale and all wider ones."""
    highest = band(wavelet)[1] / scale
    return 1 << max(0, math.floor(math.log2(max(1.0, _USED * math.pi / highest))))


def coarser(
    source: Source, first: int, count: int, step: int, *, shift: float, exponent: int
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
    shift, exponent
        Samples are taken as ``(x - shift) / 2**exponent``.

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
            out[start : start + wanted] = np.ldexp(values - shift, -exponent)
        else:
            values, _ = source.read(at - half, at - half + length)
            values -= shift
            np.ldexp(values, -exponent, out=values)
            spectrum = fft.rfft(values, overwrite_x=True)
            spectrum *= response
            # Nothing is left above the coarser grid's frequencies: the rest is cut off.
            short = fft.irfft(spectrum[: length // step // 2 + 1] / step, length // step)
            out[start : start + wanted] = short[half // step :][:wanted]
        yield Progress(start + wanted, count, "coarser grid")
    return out
