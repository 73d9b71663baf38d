"""The values of a scalogram in one quality: largest magnitudes of columns, or phases."""

from __future__ import annotations

import math
from collections.abc import Generator

import numpy as np
from numpy.typing import NDArray

from forcelab.jobs import Progress
from forcelab.signals.scalogram_bands import PHASE_RINGING, TOLERANCE, band_rows, is_cut, reach
from forcelab.signals.scalogram_coarser import coarser, step_for
from forcelab.signals.scalogram_columns import Columns
from forcelab.signals.scalogram_frames import bank
from forcelab.signals.scalogram_source import Level, Source
from forcelab.signals.scalogram_sums import sum_rows, sums_are_cheaper
from forcelab.signals.scalogram_threads import THREADS, in_threads
from forcelab.signals.wavelets import Morlet

__all__ = ["Picture", "decimal", "magnitudes", "phases"]

Real = NDArray[np.float64]
Single = NDArray[np.float32]
Flags = NDArray[np.bool_]
Picture = NDArray[np.float32]

#: Magnitudes are floored at this share of the channel's noise, as features are.
NOISE_SHARE = 1e-3
#: Pieces of fewer samples are not worth a coarser grid.
_SHORT = 1 << 17
#: Pieces of fewer samples are done before a second thread has begun: two take a third longer.
_ALONE = 1 << 15
#: Samples looked at around a column's middle where its level is told from the middle alone.
_SPOT = 4096


def magnitudes(
    source: Source,
    noise: float,
    places: tuple[float, float],
    scales: Real,
    columns: int,
    wavelet: Morlet,
) -> Generator[Progress, None, Picture]:
    """The largest magnitude of each column; a job.

    The span is read and transformed as a whole: memory is 40 bytes for each of its samples.

    Parameters
    ----------
    source : Source
    noise : float
        Standard deviation of the channel's white noise, in its unit.
    places : tuple of two floats
        Where the picture begins and ends, in samples of the grid.
    scales : ndarray, shape (k,)
        In samples, rising.
    columns : int
    wavelet : Morlet

    Returns
    -------
    ndarray of float32, shape (k, columns)
        Decimal logarithms of magnitudes in the channel's unit; NaN where nothing is known.
    """
    grid = Columns(places[0], (places[1] - places[0]) / columns, columns)
    bounds = grid.bounds()
    first, last = int(bounds[0]), int(bounds[-1])
    # One point beyond the last sample, on the widest grid.
    groups = bank(scales, wavelet, last - first + 1, grid.width)
    half = max(group.half for group in groups)
    end = max(group.reading - group.half for group in groups)
    values, known = source.read(first - half, first + end)
    yield Progress(0, len(scales), "reading")
    told = values[half : half + last - first]
    level = Level.of(float(told.min()), float(told.max()))
    level.sized(values)
    out = np.empty((len(scales), columns), dtype=np.float32)

    def take(rows: slice, step: int, power: Single) -> None:
        out[rows] = grid.largest(power, first, step)

    threads = 1 if last - first < _ALONE else THREADS
    for group in groups:
        yield from in_threads(group.tasks(values[half - group.half :], take), "rows", threads)
    there = np.maximum.reduceat(known[half : half + last - first], bounds[:-1] - first)
    return decimal(out, noise, scales, level.exponent, there)


def phases(
    source: Source,
    noise: float,
    places: tuple[float, float],
    scales: Real,
    columns: int,
    wavelet: Morlet,
    *,
    spots: bool = False,
) -> Generator[Progress, None, Picture]:
    """Phases at the columns' centre samples; a job.

    Parameters
    ----------
    source, noise, places, scales, columns, wavelet
        As of :func:`magnitudes`.
    spots : bool
        By the sums around the columns' centres alone, and look for gaps only there.

    Returns
    -------
    ndarray of float32, shape (k, columns)
        Radians; NaN where nothing is known, or at the floor.
    """
    grid = Columns(places[0], (places[1] - places[0]) / columns, columns)
    level, known = yield from _levels(source, grid, spots)
    out = np.zeros((len(scales), columns), dtype=np.complex128)
    alone = np.array([spots or sums_are_cheaper(a, grid) for a in scales.tolist()])
    if alone.any():
        out[alone] = yield from sum_rows(source, grid, scales[alone], wavelet, level)
    for rows in _groups(np.flatnonzero(~alone), scales, places[1] - places[0]):
        halo = reach(scales[rows[-1]])
        if is_cut(float(scales[rows[0]]), wavelet):
            halo += PHASE_RINGING
        pieces = places[1] - places[0] + 2 * halo
        step = step_for(scales[rows[0]], wavelet) if pieces > _SHORT else 1
        halo += 2 * step
        origin = math.floor(grid.first) - halo
        count = math.ceil((grid.last + halo - origin) / step) + 1
        values = yield from coarser(source, origin, count, step, level)
        made = band_rows(values, origin, step, scales=scales[rows], wavelet=wavelet, columns=grid)
        for j, row in zip(rows, made, strict=True):
            out[j] = row
            yield Progress(int(j), len(scales), "rows")
    values = np.angle(out)
    with np.errstate(divide="ignore"):
        values[np.log10(np.abs(out)) <= _floor(noise, scales, level.exponent)] = np.nan
    values[:, ~known] = np.nan
    return values.astype(np.float32)


def _groups(rows: NDArray[np.intp], scales: Real, span: float) -> list[NDArray[np.intp]]:
    """Rows that share one piece: narrow wavelets need not pay for the reach of wide ones."""
    groups = []
    while rows.size:
        largest = max(4 * scales[rows[0]], span / 32)
        fits = scales[rows] <= largest
        groups.append(rows[fits])
        rows = rows[~fits]
    return groups


def _levels(
    source: Source, grid: Columns, spots: bool
) -> Generator[Progress, None, tuple[Level, Flags]]:
    """The level of the samples, and in which columns something is known."""
    edges = np.clip(grid.bounds(), 0, source.count)
    known = np.zeros(grid.count, dtype=bool)
    low, high = math.inf, -math.inf
    chunk = max(1, int((1 << 18) / grid.width))
    for left in range(0, grid.count, chunk):
        right = min(left + chunk, grid.count)
        begin, end = int(edges[left]), max(int(edges[right]), int(edges[left]) + 1)
        if spots and end - begin > _SPOT:
            begin = (begin + end - _SPOT) // 2
            end = begin + _SPOT
        values, good = source.read(begin, end)
        if spots:
            known[left:right] = good.any()
        else:
            at = np.minimum(edges[left:right] - begin, len(good) - 1)
            known[left:right] = np.add.reduceat(good, at) > 0
        low, high = min(low, float(values.min())), max(high, float(values.max()))
        yield Progress(right, grid.count, "levels")
    return Level.of(low, high), known


def _floor(noise: float, scales: Real, exponent: int, largest: float | Real = 1.0) -> Real:
    """Decimal logarithms of the magnitudes below which nothing is told, shape (k, 1) or (k, c)."""
    with np.errstate(divide="ignore"):
        level = np.log10(NOISE_SHARE * np.ldexp(noise, -exponent))
    sizes = np.where(np.asarray(largest) > 0, largest, 1.0)
    return np.maximum(level, np.log10(TOLERANCE * sizes * np.sqrt(scales)[:, np.newaxis]))


def decimal(
    power: Single,
    noise: float,
    scales: Real,
    exponent: int,
    known: Flags,
    largest: float | Real = 1.0,
) -> Picture:
    """Decimal logarithms of magnitudes in the channel's unit, where something is known.

    Parameters
    ----------
    power : ndarray of float32, shape (k, c)
        ``|W|^2`` of samples that were divided by ``2**exponent``; NaN where not computed.
    noise : float
        Of the channel, in its unit.
    scales : ndarray, shape (k,)
    exponent : int
    known : ndarray of bool, shape (c,)
    largest : float or ndarray, shape (c,)
        Of the divided samples; of those that each column rests on.
    """
    with np.errstate(divide="ignore"):
        size = 0.5 * np.log10(power)
    # NaN stays NaN.
    values = np.maximum(size, _floor(noise, scales, exponent, largest).astype(np.float32))
    values += np.float32(exponent * math.log10(2.0))
    values[:, ~known] = np.nan
    return np.asarray(values, dtype=np.float32)
