"""The first picture of a long span: spots for narrow wavelets, means of the signal for wide ones.

A spot is a short piece in the middle of a column: the rest of the column is not looked at. Wavelets
too wide for a spot need no more than means of 16 samples, which are computed once for a channel;
beyond the wavelets' band means hold a tenth, at most, of what they answer to.
"""

from __future__ import annotations

import math
from collections.abc import Generator
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Channel, Demonstration
from forcelab.jobs import Progress
from forcelab.signals.scalogram_bands import band, reach
from forcelab.signals.scalogram_columns import Columns
from forcelab.signals.scalogram_frames import Frames
from forcelab.signals.scalogram_picture import Picture, decimal, magnitudes
from forcelab.signals.scalogram_source import BLOCK, Level, Source
from forcelab.signals.scalogram_threads import in_threads
from forcelab.signals.wavelets import Morlet

__all__ = ["averaged", "means_of", "narrow", "spots", "wide"]

Real = NDArray[np.float64]
Single = NDArray[np.float32]

#: Samples of a spot, and how many of them are told about at least.
SPOT, TOLD = 2048, 512
#: Samples of a mean: for the narrowest wavelet that does not fit a spot, nine of a wave's (p = 5).
MEAN = 16


def narrow(scales: Real) -> int:
    """How many of the scales, rising, fit a spot."""
    return int(np.count_nonzero([2 * reach(a) + TOLD <= SPOT for a in scales.tolist()]))


def averaged(scales: Real, wavelet: Morlet) -> int:
    """From which of the scales, rising, on means take the place of spots.

    Those between them and the :func:`narrow` ones, of high carriers, are known by neither.
    """
    folded = band(wavelet)[1] * MEAN > np.pi * scales
    return max(narrow(scales), int(np.count_nonzero(folded)))


def spots(
    source: Source,
    noise: float,
    places: tuple[float, float],
    scales: Real,
    columns: int,
    wavelet: Morlet,
) -> Generator[Progress, None, Picture]:
    """The largest magnitude of a spot in the middle of each column; a job.

    Parameters, result
        As of :func:`~forcelab.signals.scalogram_picture.magnitudes`. Of scales that do not fit a
        spot nothing is known (NaN).
    """
    grid = Columns(places[0], (places[1] - places[0]) / columns, columns)
    out = np.full((len(scales), columns), np.nan, dtype=np.float32)
    frames, there = source.pieces(grid.centres() - SPOT // 2, SPOT)
    yield Progress(0, len(scales), "spots")
    level = Level.of(float(frames.min()), float(frames.max()))
    level.sized(frames)

    def take(rows: slice, _: int, power: Single) -> None:
        out[rows] = power.reshape(len(power), columns, -1).max(axis=-1)

    if fitting := narrow(scales):
        group = _frames(tuple(scales[:fitting].tolist()), wavelet)
        yield from in_threads(group.tasks_of(frames, take), "spots")
    return decimal(out, noise, scales, level.exponent, there)


@lru_cache(maxsize=4)
def _frames(scales: tuple[float, ...], wavelet: Morlet) -> Frames:
    """The frames of spots: the same for all spans."""
    return Frames(np.array(scales), 0, wavelet, length=SPOT)


def means_of(source: Source) -> Generator[Progress, None, Source]:
    """The channel in means of :data:`MEAN` samples, as a source of its own; a job.

    Means of nothing known are missing samples. Memory is 16 bytes for each of them.
    """
    count = -(-source.count // MEAN)
    means = np.empty(count)
    share = np.full(MEAN, 1.0 / MEAN)
    each = BLOCK // MEAN
    for start in range(0, count, each):
        end = min(start + each, count)
        values, known = source.read(start * MEAN, end * MEAN)
        means[start:end] = values.reshape(-1, MEAN) @ share
        means[start:end][~known.reshape(-1, MEAN).any(axis=1)] = np.nan
        yield Progress(end, count, "means")
    rate = source.rate / MEAN
    recorded = source.demonstration
    coarse = Demonstration(
        recorded.name,
        recorded.task,
        recorded.start + ((MEAN - 1) / 2) / source.rate + np.arange(count) / rate,
        means[:, np.newaxis],
        (Channel(source.channel),),
    )
    return Source(coarse, source.channel, (0,), uniform=True, rate=rate, count=count)


def wide(
    means: Source,
    noise: float,
    places: tuple[float, float],
    scales: Real,
    columns: int,
    wavelet: Morlet,
) -> Generator[Progress, None, Picture]:
    """The largest magnitude of each column, of wide wavelets; a job.

    Parameters
    ----------
    means : Source
        From :func:`means_of`.
    noise, places, scales, columns, wavelet
        As of :func:`~forcelab.signals.scalogram_picture.magnitudes`, in samples, not in means.

    Returns
    -------
    ndarray of float32, shape (k, columns)
    """
    first, last = ((place - (MEAN - 1) / 2) / MEAN for place in places)
    # A coefficient adds up so many times fewer values, weighted by a wavelet of a smaller scale.
    ratio = math.sqrt(MEAN)
    picture = yield from magnitudes(
        means, noise / ratio, (first, last), scales / MEAN, columns, wavelet
    )
    picture += np.float32(math.log10(ratio))
    return picture
