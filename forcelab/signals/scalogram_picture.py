"""The values of a scalogram in one quality, each row by the cheapest way that is right for it."""

from __future__ import annotations

import math
from collections.abc import Generator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.jobs import Progress
from forcelab.signals.scalogram_bands import TOLERANCE, Columns, band_rows, reach
from forcelab.signals.scalogram_blocks import (
    BLOCKS,
    block_length,
    block_rows,
    coarser,
    step_for,
    widest_in_blocks,
)
from forcelab.signals.scalogram_source import Source
from forcelab.signals.scalogram_sums import sum_rows, sums_are_cheaper
from forcelab.signals.wavelets import Morlet

__all__ = ["Picture", "picture_values"]

Real = NDArray[np.float64]
Picture = NDArray[np.float32]

#: Magnitudes are floored at this share of the channel's noise, as features are.
NOISE_SHARE = 1e-3
#: Pieces of fewer samples are not worth a coarser grid.
_SHORT = 1 << 17
#: Samples of a spot at most.
_SPOT = 4096


def picture_values(
    source: Source,
    noise: float,
    places: tuple[float, float],
    scales: Real,
    columns: int,
    wavelet: Morlet,
    *,
    phase: bool = False,
    spots: bool = False,
) -> Generator[Progress, None, Picture]:
    """Compute values of a scalogram; a job.

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
    phase : bool
        Phases at the columns' centre samples instead of magnitudes.
    spots : bool
        Look at a spot in the middle of each column only, and leave wide wavelets out (NaN).

    Returns
    -------
    ndarray of float32, shape (k, columns)
        Decimal logarithms of root mean square magnitudes in the channel's unit, or radians.
    """
    grid = Columns(places[0], (places[1] - places[0]) / columns, columns)
    shift, exponent, known = yield from _levels(source, grid, spots)
    fill = np.nan if spots else 0.0
    out = np.full((len(scales), columns), fill, dtype=np.complex128 if phase else np.float64)
    if phase:
        alone = np.array(
            [reach(a) <= _SPOT if spots else sums_are_cheaper(a, grid) for a in scales.tolist()]
        )
        if alone.any():
            out[alone] = yield from sum_rows(
                source, grid, scales[alone], wavelet, shift=shift, exponent=exponent
            )
    else:
        length = block_length(grid.width)
        length = min(length, _SPOT) if spots else length
        alone = scales <= widest_in_blocks(length)
        if alone.any():
            out[alone] = yield from block_rows(
                source,
                grid,
                length,
                scales=scales[alone],
                wavelet=wavelet,
                blocks=1 if spots else BLOCKS,
                shift=shift,
                exponent=exponent,
            )
    left = np.flatnonzero(~alone) if not spots else np.zeros(0, dtype=np.intp)
    for rows in _groups(left, scales, places[1] - places[0]):
        halo = reach(scales[rows[-1]])
        pieces = places[1] - places[0] + 2 * halo
        step = step_for(scales[rows[0]], wavelet) if pieces > _SHORT else 1
        halo += 2 * step
        origin = math.floor(grid.first) - halo
        count = math.ceil((grid.last + halo - origin) / step) + 1
        values = yield from coarser(source, origin, count, step, shift=shift, exponent=exponent)
        made = band_rows(
            values,
            origin,
            step,
            scales=scales[rows],
            wavelet=wavelet,
            columns=grid,
            phase=phase,
        )
        for j, row in zip(rows, made, strict=True):
            out[j] = row
            yield Progress(int(j), len(scales), "rows")
    return _finish(out, noise, scales, exponent, known)


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
) -> Generator[Progress, None, tuple[float, int, NDArray[np.bool_]]]:
    """Middle and size of the samples, and in which columns something is known."""
    edges = np.clip(np.round(grid.edges()).astype(np.int64), 0, source.count)
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
    largest = max(abs(low), abs(high))
    # Halved before they meet: the sum of two numbers near 1e308 overflows.
    middle = 0.5 * low + 0.5 * high
    return middle, int(np.frexp(largest)[1]) if largest > 0 else 0, known


def _finish(
    out: NDArray[Any],
    noise: float,
    scales: Real,
    exponent: int,
    known: NDArray[np.bool_],
) -> Picture:
    """Logarithms of magnitudes in the channel's unit, or phases, where something is known."""
    with np.errstate(divide="ignore"):
        level = np.log10(NOISE_SHARE * np.ldexp(noise, -exponent))
        floor = np.maximum(level, np.log10(TOLERANCE * np.sqrt(scales)))[:, np.newaxis]
        if np.iscomplexobj(out):
            values = np.angle(out)
            values[np.log10(np.abs(out)) <= floor] = np.nan
        else:
            size = 0.5 * np.log10(out)
            values = np.where(np.isnan(size), size, np.maximum(size, floor))
            values += exponent * math.log10(2.0)
    values[:, ~known] = np.nan
    return values.astype(np.float32)
