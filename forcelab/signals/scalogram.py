"""The scalogram of a visible span, at the screen's resolution: coarse first, then exact.

The first picture of a long span: spots for narrow wavelets, means of the signal for wide ones. A
spot is a short piece in the middle of a column: the rest of the column is not looked at. Wavelets
too wide for a spot need no more than means of 16 samples, which are computed once for a channel;
beyond the wavelets' band means hold a tenth, at most, of what they answer to.

Largest powers of a channel's scalogram, kept, from which any span is put together. Of each scale
the largest ``|W|^2`` of every 64 samples is kept, and of every 4, 16, ... of these cells: a column
of the screen looks at eight of them at most, however much time it holds. Cells are computed once,
chunk by chunk, first those that are seen; the larger ones of a chunk may be there before the
smaller ones (:meth:`Tiles.restore`).

What a channel's scalogram is put together from, kept in a file for the next session. A hundred rows
of a recording of 1e7 samples are 3e8 powers, and the transforms behind them alone take 3.6 ns each:
half a second of two cores before anything else is done. What comes out is a few megabytes. So it is
kept once it is complete, beside the recording, whose content never changes, and read in 13 ms.
Nothing hangs on the file: where it is missing, cannot be written, or is not what was written, all
is computed. So those of many recordings do not fill the disk either: the oldest go.

A column shows the largest magnitude of all its samples, so that no impact vanishes, however short
it is and however much time is seen. It is never computed from the transform at the full rate:

* powers come from short transforms with a point every quarter of the scale, frame by frame;
* of long spans the largest powers of small cells are kept (:class:`Tiles`), computed once, from
  which any span is put together; until they are there a picture is made of spots and means;
* phases are those at the columns' centres: the sums themselves, or a short transform of the band.

Error against :func:`forcelab.signals.cwt.cwt`, held by ``tests/signals/test_scalogram.py``:

* everywhere 1e-6 of the channel's amplitude times ``sqrt(a)``, from cut tails and single
  precision; magnitudes are floored there;
* magnitudes: 2 % of the row's largest power, from what lies between points; where two tones beat
  in one row, `d` radians a scale apart, ``sin(d / 16)^2``: 6 % where the wavelet answers to
  either with an eighth of its most, 10 % where with a twenty-third;
* of tiles the columns' edges move to the nearest cell, by a quarter of a column at most; powers of
  tiles that come from a file are off by 0.4 % more;
* phases within 0.03 rad where the magnitude is above a tenth of the row's largest. A wavelet that
  the Nyquist frequency cuts rings further than it is followed: within 0.25 rad from scale
  ``(p + 1) / pi`` on (1.9 at p = 5, 2.9 at p = 8), within 0.5 rad from ``p / pi`` on, below which
  the peak itself is cut off and phases are not sure; nothing of that from ``(p + 6.5) / pi`` on.

Of recordings of up to a day at 1 kHz, memory stays below 150 MB for a picture, and 128 MB for the
tiles; means take a byte for each sample. Where a glitch comes up its channel is looked through,
once and as a whole, in some 40 bytes for each sample. Time is in ``python -m tests.benchmarks
scalogram``.
"""

from __future__ import annotations

import contextlib
import hashlib
import math
import time
import zipfile
import zlib
from collections.abc import Generator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.io import atomic_file
from forcelab.jobs import Progress, finish
from forcelab.signals.conditioning import noise_level
from forcelab.signals.scalogram_frames import (
    BLOCK,
    PHASE_RINGING,
    THREADS,
    TOLERANCE,
    Columns,
    Frames,
    Level,
    Source,
    band,
    band_rows,
    bank,
    coarser,
    columns_of,
    in_threads,
    is_cut,
    open_source,
    reach,
    step_for,
    sum_rows,
    sums_are_cheaper,
)
from forcelab.signals.wavelets import Morlet

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

    `noise`: standard deviation of the channel's white noise, in its unit; `places`: where the
    picture begins and ends, in samples of the grid; `scales` (k,): in samples, rising. Gives (k,
    columns): decimal logarithms of magnitudes in the channel's unit; NaN where nothing is known.
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
    measured_values = values[half : half + last - first]
    level = Level.of(float(measured_values.min()), float(measured_values.max()))
    level.sized(values)
    out = np.empty((len(scales), columns), dtype=np.float32)

    def take(rows: slice, step: int, power: Single) -> None:
        out[rows] = grid.largest(power, first, step)

    threads = 1 if last - first < _ALONE else THREADS
    for group in groups:
        yield from in_threads(group.tasks(values[half - group.half :], take), "rows", threads)
    covered = np.maximum.reduceat(known[half : half + last - first], bounds[:-1] - first)
    return decimal(out, noise, scales, level.exponent, covered)


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

    `spots`: by the sums around the columns' centres alone, and look for gaps only there. Gives (k,
    columns): radians; NaN where nothing is known, or at the floor.
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
        band = band_rows(values, origin, step, scales=scales[rows], wavelet=wavelet, columns=grid)
        for j, row in zip(rows, band, strict=True):
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
        values, measured = source.read(begin, end)
        if spots:
            known[left:right] = measured.any()
        else:
            at = np.minimum(edges[left:right] - begin, len(measured) - 1)
            known[left:right] = np.add.reduceat(measured, at) > 0
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

    `power` (k, c): ``|W|^2`` of samples that were divided by ``2**exponent``; NaN where not
    computed; `noise`: of the channel, in its unit; `scales` (k,); `known` (c,); `largest` (c,): of
    the divided samples; of those that each column rests on.
    """
    with np.errstate(divide="ignore"):
        size = 0.5 * np.log10(power)
    # NaN stays NaN.
    values = np.maximum(size, _floor(noise, scales, exponent, largest).astype(np.float32))
    values += np.float32(exponent * math.log10(2.0))
    values[:, ~known] = np.nan
    return np.asarray(values, dtype=np.float32)


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
        As of :func:`~forcelab.signals.scalogram.magnitudes`. Of scales that do not fit a
        spot nothing is known (NaN).
    """
    grid = Columns(places[0], (places[1] - places[0]) / columns, columns)
    out = np.full((len(scales), columns), np.nan, dtype=np.float32)
    frames, covered = source.pieces(grid.centres() - SPOT // 2, SPOT)
    yield Progress(0, len(scales), "spots")
    level = Level.of(float(frames.min()), float(frames.max()))
    level.sized(frames)

    def take(rows: slice, _: int, power: Single) -> None:
        out[rows] = power.reshape(len(power), columns, -1).max(axis=-1)

    if fitting := narrow(scales):
        group = _frames(tuple(scales[:fitting].tolist()), wavelet)
        yield from in_threads(group.tasks_of(frames, take), "spots")
    return decimal(out, noise, scales, level.exponent, covered)


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

    `means`: from :func:`means_of`. Gives (k, columns).
    """
    first, last = ((place - (MEAN - 1) / 2) / MEAN for place in places)
    # A coefficient adds up so many times fewer values, weighted by a wavelet of a smaller scale.
    ratio = math.sqrt(MEAN)
    picture = yield from magnitudes(
        means, noise / ratio, (first, last), scales / MEAN, columns, wavelet
    )
    picture += np.float32(math.log10(ratio))
    return picture


#: Samples of a cell at least, and cells of a level in one of the next.
CELL, RATIO = 64, 4
#: Samples that are computed in one go, in 20 ms: cells of the highest level lie within one. Fewer
#: cost more, as wide wavelets reach far beyond them; more are too many for a span that is not.
CHUNK = 1 << 16
#: Bytes of all cells at most; of longer recordings cells are larger.
MOST = 1 << 27
#: Bytes at most that :meth:`Tiles.to_arrays` makes of the cells.
TILES_TOLD = 10_000_000
#: Samples are kept from overflowing in single precision.
_LARGEST = 1e15


class Tiles:
    """The cells of one channel at some scales.

    `noise`: standard deviation of the channel's white noise, in its unit; `level`: of the channel's
    usual samples; `scales` (k,): in samples, rising; `cell`: samples of a cell: a power of two, 64
    for recordings up to 1e7 samples and 150 scales.
    """

    def __init__(
        self, source: Source, noise: float, level: Level, scales: Real, wavelet: Morlet
    ) -> None:
        self.scales = scales
        self.cell = CELL
        while 4 * len(scales) * source.count * RATIO > (RATIO - 1) * MOST * self.cell:
            self.cell *= 2
        self._source, self._noise, self._level = source, noise, level
        chunks = -(-source.count // CHUNK)
        self._sizes = np.zeros(chunks)  # half the range of the samples that each rests on
        cells = chunks * CHUNK // self.cell
        self._known = np.zeros(cells, dtype=bool)
        self._levels: list[Single] = []
        count, size = cells, self.cell
        while size <= CHUNK:
            self._levels.append(np.zeros((len(scales), count), dtype=np.float32))
            count, size = count // RATIO, size * RATIO
        # Of each chunk the level from which on its cells are there.
        self._ready = np.full(chunks, len(self._levels))
        self._wavelet = wavelet

    @cached_property
    def _groups(self) -> list[Frames]:
        """Frames of a chunk: made when one is computed, for the first picture does not wait."""
        # One point beyond the last sample, on the widest grid.
        return bank(self.scales, self._wavelet, CHUNK + 1, self.cell)

    @property
    def nbytes(self) -> int:
        """Memory of all cells: at most :data:`MOST` and what fills the last chunk."""
        return sum(level.nbytes for level in self._levels)

    def serve(self, grid: Columns) -> bool:
        """Whether columns are wide enough: their edges move by a quarter of one at most."""
        return grid.width >= 2 * self.cell

    def bounds(self, grid: Columns) -> tuple[int, NDArray[np.int64]]:
        """Samples of the cells that columns are put together from, and the nearest edges.

        Gives `edges` (count + 1,): in samples, multiples of `size`.
        """
        size = self.cell
        while 2 * size * RATIO <= grid.width and size * RATIO <= CHUNK:
            size *= RATIO
        # Half a cell more or less is told from rounding: edges do not depend on the last bits.
        return size, size * np.floor(grid.edges() / size + 0.5 + 1e-6).astype(np.int64)

    def missing(self, first: float, last: float, size: int = 0) -> list[int]:
        """The chunks of a span, in samples, that are still to be computed.

        `size`: samples of the cells that are wanted; by default the smallest.
        """
        begin = max(0, int(first) // CHUNK)
        end = min(len(self._ready), -(-int(last + 1) // CHUNK))
        return (begin + np.flatnonzero(self._ready[begin:end] > self._level_of(size))).tolist()

    def _level_of(self, size: int) -> int:
        """The place of the cells of a size among the levels."""
        return round(math.log(max(size, self.cell) / self.cell, RATIO))

    def building(
        self, chunks: list[int], *, threads: int = THREADS
    ) -> Generator[Progress, None, None]:
        """Compute chunks; a job. What was computed when it is cancelled is kept."""
        if chunks:
            assert self._groups  # made before threads ask for them
        tasks = [partial(self._build, chunk) for chunk in chunks]
        yield from in_threads(tasks, "scalogram of the whole recording", threads)

    def _build(self, chunk: int) -> None:
        """Compute one chunk."""
        first = chunk * CHUNK
        half = max(group.half for group in self._groups)
        end = max(group.reading - group.half for group in self._groups)
        values, known = self._source.read(first - half, first + end)
        self._level.sized(values)
        np.clip(values, -_LARGEST, _LARGEST, out=values)
        count = CHUNK // self.cell
        cells = slice(chunk * count, (chunk + 1) * count)

        def take(rows: slice, step: int, power: Single) -> None:
            self._levels[0][rows, cells] = _cells(power, step, self.cell, count)

        for group in self._groups:
            for task in group.tasks(values[half - group.half :], take):
                task()
        self._known[cells] = known[half : half + CHUNK].reshape(-1, self.cell).any(axis=1)
        self._coarser(0, cells)
        self._sizes[chunk] = 0.5 * np.ptp(values)
        self._ready[chunk] = 0

    def _coarser(self, level: int, cells: slice) -> None:
        """Put the cells of all higher levels together from some of one."""
        for finer, next_coarser in zip(
            self._levels[level:], self._levels[level + 1 :], strict=False
        ):
            part = finer[:, cells]
            cells = slice(cells.start // RATIO, cells.stop // RATIO)
            coarse = np.maximum(part[:, ::RATIO], part[:, 1::RATIO], out=next_coarser[:, cells])
            for place in range(2, RATIO):  # a quarter of the time of the largest along a short axis
                np.maximum(coarse, part[:, place::RATIO], out=coarse)

    def _stored_level(self) -> int:
        """The level of the smallest cells of which all together take few bytes."""
        few = (i for i, level in enumerate(self._levels) if 2 * level.size <= TILES_TOLD)
        return next(few, len(self._levels) - 1)

    @property
    def stored_cell(self) -> int:
        """Samples of the cells that :meth:`to_arrays` tells of."""
        return self.cell * RATIO ** self._stored_level()

    def to_arrays(self) -> dict[str, NDArray[Any]]:
        """What is worth keeping of tiles that are complete, in a few megabytes.

        Of each power's 32 bits the upper 16 are told, rounded, which errs by 0.4 % of it.
        """
        level = self._stored_level()
        bits = self._levels[level].view(np.uint32) + np.uint32(1 << 15)
        known: Flags = np.any(self._known.reshape(bits.shape[1], -1), axis=1)
        return {"cells": (bits >> 16).astype(np.uint16), "known": known, "sizes": self._sizes}

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> bool:
        """Take over what :meth:`to_arrays` gave of the same channel; gives whether it fits."""
        level = self._stored_level()
        cells, known, sizes = (arrays[name] for name in ("cells", "known", "sizes"))
        finest = self._levels[level]
        shapes = [array.shape for array in (cells, known, sizes)]
        kinds = [array.dtype.kind for array in (cells, known, sizes)]
        if shapes != [finest.shape, finest.shape[1:], self._sizes.shape] or kinds != [*"ubf"]:
            return False
        finest.view(np.uint32)[:] = cells
        finest.view(np.uint32)[:] <<= 16
        self._known[:] = np.repeat(known, len(self._known) // len(known))
        self._sizes[:] = sizes
        self._coarser(level, slice(0, finest.shape[1]))
        self._ready[:] = level
        return True

    def picture(self, grid: Columns) -> tuple[Picture, Flags]:
        """Put a picture together.

        `grid`: which :meth:`serve` accepts. Edges move to the nearest cell. Gives `values` (k,
        count): decimal logarithms of the largest magnitudes in the channel's unit; NaN where
        nothing is known; `done` (count,): which columns are computed; the others mean nothing.
        """
        size, edges = self.bounds(grid)
        level = self._level_of(size)
        cells = self._levels[level]
        edges = np.clip(edges // size, 0, cells.shape[1])
        firsts = np.minimum(edges[:-1], cells.shape[1] - 1)
        end = max(int(edges[-1]), int(firsts[-1]) + 1)
        power = np.maximum.reduceat(cells[:, :end], firsts, axis=1)
        finest = size // self.cell
        known = np.maximum.reduceat(self._known[: end * finest], firsts * finest)
        begin = firsts * size // CHUNK
        final = (np.maximum(edges[1:], firsts + 1) * size - 1) // CHUNK
        missing = np.concatenate(([0], np.cumsum(self._ready > level)))
        done = missing[final + 1] == missing[begin]
        # What one column cannot tell for the rounding of a loud sample, another one can.
        within = np.maximum.reduceat(self._sizes[: final[-1] + 1], begin)
        largest = np.maximum(within, self._sizes[final])
        values = decimal(power, self._noise, self.scales, self._level.exponent, known, largest)
        return values, done


def _cells(power: Single, step: int, cell: int, count: int) -> Single:
    """The largest power of each cell, of points from the first cell's first sample on."""
    rows = len(power)
    if step >= cell:
        # The first and the last sample of each cell, on the straight lines between points.
        each = step // cell
        before = power[:, : count // each, np.newaxis]
        rise = power[:, 1 : count // each + 1, np.newaxis] - before
        at = np.arange(0, step, cell, dtype=np.float32) / np.float32(step)
        ends = at + np.float32((cell - 1) / step)
        largest = np.maximum(before + rise * at, before + rise * ends)
        return np.asarray(largest.reshape(rows, -1))
    each = cell // step
    # Faster than the largest along a short axis.
    largest = np.maximum.reduceat(
        power[:, : count * each], np.arange(0, count * each, each), axis=1
    )
    if step > 1:
        # The cell's last sample, between its last point and the next cell's first.
        last = power[:, each - 1 : count * each : each] / step
        last += power[:, each : count * each + 1 : each] * np.float32(1 - 1 / step)
        np.maximum(largest, last, out=largest)
    return largest


#: Stretches of a demonstration that tell its range of colours, and the samples of each.
_STRETCHES, _STRETCH = 8, 1 << 14
#: Columns that a stretch is seen in.
_LOOKED = 512
#: Shares of all magnitudes below the darkest and the brightest colour, and their least distance.
_DARKEST, _BRIGHTEST, _LEAST = 0.05, 0.999, 1.0
#: Decades above the middle that have colours of their own at most: forces take two. Next to a spike
#: that is no glitch yet they would all have one colour.
_MOST = 4.0


@dataclass(eq=False, slots=True)
class Survey:
    """What all views of a channel have in common, so that colours do not jump.

    What tells of the channel never changes. Beside it, once a long span was seen, are kept the
    channel's means, and the tiles of the scales that were last asked for: one job at a time may
    use them.

    `means`: the channel in means, once :meth:`averaging` has gone through it; `kept`: whether the
    tiles came from a file, or were to be written into one.
    """

    source: Source  # the channel on its grid
    noise: float  # standard deviation of the channel's white noise, in its unit
    #: low and high: Decimal logarithms of the magnitudes for the first and the last colour.
    low: float
    high: float
    level: Level  # middle and size of the samples
    wavelet: Morlet
    means: Source | None = field(default=None, init=False, repr=False)
    kept: bool = field(default=False, init=False, repr=False)
    _tiles: Tiles | None = field(default=None, init=False, repr=False)

    def tiles(self, scales: Real) -> Tiles:
        """The tiles of some scales, as far as they are computed; those of others are dropped."""
        if self._tiles is None or not np.array_equal(self._tiles.scales, scales):
            self._tiles = Tiles(self.source, self.noise, self.level, scales, self.wavelet)
        return self._tiles

    def averaging(self) -> Generator[Progress, None, Source]:
        """Compute the channel's means, once; a job."""
        if self.means is None:
            self.means = yield from means_of(self.source)
        return self.means

    def without_tiles(self) -> Survey:
        """The same with no tile computed yet."""
        fresh = replace(self)
        fresh.means = self.means
        return fresh


def colour_range(values: NDArray[np.floating], least: float = _LEAST) -> tuple[float, float]:
    """Which magnitudes the colours are for.

    `values` (n,): decimal logarithms, at least one, all known; `least`: decades from the first
    colour to the last at least. Gives `low`, `high`: those of the first and the last colour.
    """
    shares = (_DARKEST, 0.5, _BRIGHTEST)
    dark, middle, bright = (float(v) for v in np.quantile(values, shares))
    high = min(bright, middle + _MOST)
    return min(dark, high - least), high


def row_scales(rows: int, largest: float, smallest: float = 2.0) -> Real:
    """Scales in the middles of `rows` even steps of the logarithm; shape (rows,)."""
    ratio = largest / smallest
    return np.asarray(smallest * ratio ** ((np.arange(rows) + 0.5) / rows), dtype=np.float64)


def survey(
    demonstration: Demonstration, channel: str, largest: float, wavelet: Morlet | None = None
) -> Generator[Progress, None, Survey]:
    """Look at stretches of a whole demonstration; a job of at most 5e5 samples.

    `channel`: a recorded channel, or a recognition channel such as ``"tangential 1"``; `largest`:
    the largest scale that will be shown, in samples.
    """
    source = yield from open_source(demonstration, channel)
    mother = wavelet or Morlet()
    length = min(_STRETCH, source.count)
    stretches = min(_STRETCHES, -(-source.count // length))
    scales = row_scales(24, largest)
    places = np.linspace(0, source.count - length, stretches).astype(int).tolist()
    looked_at: dict[int, _Stretch] = {}

    def look(first: int) -> None:
        if (stretch := _look(source, first, length, scales, mother)) is not None:
            looked_at[first] = stretch

    yield from in_threads([partial(look, first) for first in places], "range of colours")
    if not looked_at:
        return Survey(source, 0.0, -1.0, 0.0, Level(0.0, 0), mother)
    samples = [looked_at[first] for first in places if first in looked_at]
    noise = float(np.median([stretch.noise for stretch in samples]))
    dark, bright = colour_range(np.concatenate([stretch.known for stretch in samples]))
    level = Level.of(min(each.low for each in samples), max(each.high for each in samples))
    return Survey(source, noise, dark, bright, level, mother)


@dataclass(frozen=True, eq=False, slots=True)
class _Stretch:
    """What one stretch tells: its samples' range and noise, and all magnitudes that are known."""

    low: float
    high: float
    noise: float
    known: NDArray[np.float32]


def _look(
    source: Source, first: int, length: int, scales: Real, wavelet: Morlet
) -> _Stretch | None:
    """Look at a stretch; None where nothing of it is known."""
    values, known = source.read(first, first + length)
    if not known.any():
        return None
    peak = int(np.frexp(np.max(np.abs(values)))[1])
    noise = float(np.ldexp(noise_level(np.ldexp(values, -peak)), peak))
    places = float(first), float(first + length)
    picture = finish(magnitudes(source, noise, places, scales, min(length, _LOOKED), wavelet))
    finite = picture[np.isfinite(picture)]
    return _Stretch(float(values.min()), float(values.max()), noise, finite)


#: To be raised when anything is computed in another way: older files count as missing then.
EDITION = 1
#: Bytes of the files beside all recordings together at most.
MOST_ON_DISK = 1 << 30
#: Seconds after which nobody goes on with a file that is not complete.
ABANDONED = 3600.0


def store_tiles(folder: Path, view: Survey, scales: Real) -> bool:
    """Write what is known of a channel; gives whether that could be done.

    `folder`: of the recording alone, such as the demonstration's in a project; `view`: all of whose
    tiles are there; `scales` (k,): those of the tiles.
    """
    source, level = view.source, view.level
    path = _path(folder, source.demonstration, source.channel, scales, view.wavelet)
    _clear_away(folder)
    facts = (view.noise, view.low, view.high, level.shift, level.exponent)
    grid = (source.uniform, source.rate, source.count)
    looked = source.looked_at
    glitches = [(column, place) for column in looked for place in source.glitches(column).tolist()]
    arrays: dict[str, NDArray[Any]] = {
        "facts": np.array((*facts, *grid), dtype=np.float64),
        "looked": np.array(looked, dtype=np.int64),
        "wild": np.array(glitches, dtype=np.int64).reshape(-1, 2),
        **view.tiles(scales).to_arrays(),
    }
    try:
        with atomic_file(path) as stream:
            np.savez(stream, allow_pickle=False, **arrays)
    except (InputError, OSError):  # a full disk, or another's: the next session computes it anew
        return False
    _make_room(folder.parent)
    return True


def load_tiles(
    folder: Path, demonstration: Demonstration, channel: str, scales: Real, wavelet: Morlet
) -> Survey | None:
    """Read what was kept of a channel; None where there is nothing that fits.

    `demonstration`: the very one of which it was kept; `scales` (k,).
    """
    path = _path(folder, demonstration, channel, scales, wavelet)
    # What is damaged fails the archive's checksums. OverflowError and MemoryError: sizes made up.
    broken = (OSError, ValueError, LookupError, EOFError, OverflowError, MemoryError)
    with contextlib.suppress(*broken, zipfile.BadZipFile, zlib.error, NotImplementedError):
        # Given a path, NumPy leaves a file open that is no archive.
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        noise, low, high, shift, exponent, uniform, rate, count = arrays["facts"].tolist()
        columns = columns_of(demonstration, channel)
        source = Source(demonstration, channel, columns, bool(uniform), rate, int(count))
        if source.uniform and source.count != len(demonstration.times):
            return None
        for column in arrays["looked"].tolist():
            source.know_glitches(column, arrays["wild"][arrays["wild"][:, 0] == column, 1])
        level = Level(shift, int(exponent))
        view = Survey(source, noise, low, high, level, wavelet)
        if view.tiles(scales).restore(arrays):
            view.kept = True
            return view
    return None


def _path(
    folder: Path, demonstration: Demonstration, channel: str, scales: Real, wavelet: Morlet
) -> Path:
    """The file of a channel in some scales."""
    columns = columns_of(demonstration, channel)
    # Another machine's powers may differ in the last digit.
    rounded = [f"{scale:.6g}" for scale in scales.tolist()]
    identity = repr((EDITION, channel, columns, wavelet, rounded))
    return folder / f"scalogram-{hashlib.sha256(identity.encode()).hexdigest()[:16]}.npz"


def _clear_away(folder: Path) -> None:
    """Delete what was begun in a recording's folder by a process that was killed."""
    for part in folder.glob(".forcelab-*.part"):
        with contextlib.suppress(OSError):  # its process is alive and has just ended it
            if time.time() - part.stat().st_mtime > ABANDONED:
                part.unlink()


def _make_room(folder: Path) -> None:
    """Delete the oldest of what was kept in the folders of all recordings, if it is too much."""
    files = []
    for path in folder.glob("*/scalogram-*.npz"):
        with contextlib.suppress(OSError):  # another window has just deleted it
            status = path.stat()
            files.append((status.st_mtime_ns, status.st_size, path))
    total = 0
    for _, size, path in sorted(files, reverse=True):
        total += size
        if total > MOST_ON_DISK:
            with contextlib.suppress(OSError):  # in use, or another's
                path.unlink()


#: No picture has more columns; a wider screen stretches it.
MAX_COLUMNS = 2048
#: Spans of more samples are put together from tiles; their first picture is from spots
#: and means.
LONG = 1 << 18
#: The first picture has so many times fewer rows, and columns; that of a long span, whose columns
#: are told by spots, fewer still.
COARSE, SPOTTED = 8, 16
#: Of recordings so many times as long as the span, means take a quarter of the time of the tiles.
WORTH = 8
#: Samples between two pictures of a long span while its tiles are computed: some 0.2 s.
SHOWN = 1 << 20


@dataclass(frozen=True, eq=False, slots=True)
class Scalogram:
    """A picture of a span."""

    #: start and end: The span in seconds; columns divide it evenly.
    start: float
    end: float
    #: (k,), of the rows, in samples of the grid, rising; rows divide the logarithms evenly.
    scales: Real
    #: (k, c), decimal logarithms of the columns' largest magnitudes in the channel's unit, or
    #: phases in radians at the columns' centres. NaN where nothing is known: in gaps, outside the
    #: recording, at the floor (phases), or not computed yet (the first picture).
    values: Picture
    phase: bool  # whether the values are phases
    view: Survey  # of the channel
    coarse: bool  # whether a finer picture follows


@dataclass(frozen=True, slots=True)
class Step(Progress):
    """Progress of a scalogram, with the newest picture there is."""

    picture: Scalogram | None = None


def scalogram(
    view: Survey,
    start: float,
    end: float,
    *,
    scales: Real,
    columns: int,
    phase: bool = False,
) -> Generator[Step, None, Scalogram]:
    """Compute the picture of a span; a job that yields a coarse picture first.

    `view`: of the channel, from :func:`survey`; `start`, `end`: visible span in seconds; what lies
    outside the recording is left out; `scales` (k,): of the rows, as from :func:`row_scales`;
    `columns`: of the screen; fewer are computed where there are fewer samples.
    """
    source, mother = view.source, view.wavelet
    first = min(max(source.place(start), 0.0), float(source.count - 1))
    last = max(min(source.place(end), float(source.count)), first + 1.0)
    span = source.time(first), source.time(last)
    count = max(1, min(columns, MAX_COLUMNS, math.floor(last - first)))
    thinned = _thinned(scales)
    long = last - first > LONG
    rough = max(1, count // (SPOTTED if long and not phase else COARSE))
    places = (first, last)

    def finished(values: Picture, rows: Real, coarse: bool) -> Scalogram:
        return Scalogram(*span, rows, values, phase, view, coarse)

    grid = Columns(first, (last - first) / count, count)
    tiles = view.tiles(scales) if long and not phase else None
    if tiles is not None and not tiles.serve(grid):
        tiles = None
    if tiles is not None and not tiles.missing(first, last, tiles.bounds(grid)[0]):
        return finished(tiles.picture(grid)[0], scales, False)
    if phase:
        draft = phases(source, view.noise, places, thinned, rough, mother, spots=long)
    else:
        compute = spots if long else magnitudes
        draft = compute(source, view.noise, places, thinned, rough, mother)
    values = yield from _steps(draft, None)
    picture = finished(values, thinned, True)
    few = averaged(thinned, mother)
    # Means are of the whole channel: of a small part of it the exact picture is there before.
    pays = view.means is not None or source.count < WORTH * (last - first)
    if long and not phase and few < len(thinned) and pays:
        # Means take a while, once: what there is of a first picture is shown meanwhile.
        shown = picture if view.means is None else None
        means = yield from _steps(view.averaging(), shown)
        # Of few rows, many columns cost hardly more than few.
        job = wide(means, view.noise, places, thinned[few:], count, mother)
        rest = yield from _steps(job, shown)
        spread = values[:few, np.arange(count) * rough // count]
        spread[:, np.isnan(rest).all(axis=0)] = np.nan  # a gap ends where it ends
        values = np.concatenate([spread, rest])
        picture = finished(values, thinned, True)
    yield Step(1, 2, "first picture", picture)
    if tiles is not None:
        return finished((yield from _tiled(tiles, grid, picture)), scales, False)
    exact = phases if phase else magnitudes
    job = exact(source, view.noise, places, scales, count, mother)
    return finished((yield from _steps(job, picture)), scales, False)


def _tiled(tiles: Tiles, grid: Columns, picture: Scalogram) -> Generator[Step, None, Picture]:
    """Compute the tiles of a span; now and then what is exact by then is shown."""
    missing = tiles.missing(grid.first, grid.last, tiles.bounds(grid)[0])
    rows = np.arange(len(tiles.scales)) * len(picture.values) // len(tiles.scales)
    columns = np.arange(grid.count) * picture.values.shape[1] // grid.count
    coarse = picture.values[np.ix_(rows, columns)]
    each = max(1, SHOWN // CHUNK)
    for start in range(0, len(missing), each):
        yield from _steps(tiles.building(missing[start : start + each]), picture)
        if start + each < len(missing):
            values, done = tiles.picture(grid)
            values = np.where(done, values, coarse)
            picture = replace(picture, values=values, scales=tiles.scales)
            yield Step(1, 2, "scalogram of the whole span", picture)
    return tiles.picture(grid)[0]


_ResultT = TypeVar("_ResultT")


def _steps(
    job: Generator[Progress, None, _ResultT], picture: Scalogram | None
) -> Generator[Step, None, _ResultT]:
    """Go through a job's steps, with the newest picture beside each."""
    while True:
        try:
            step = next(job)
        except StopIteration as end:
            result: _ResultT = end.value
            return result
        yield Step(step.done, step.total, step.text, picture)


def _thinned(scales: Real) -> Real:
    """Fewer rows over the same range of the logarithm."""
    if len(scales) == 1:
        return scales
    half = 0.5 * math.log(scales[-1] / scales[0]) / (len(scales) - 1)
    spread = math.exp(half)
    return row_scales(max(1, len(scales) // COARSE), scales[-1] * spread, scales[0] / spread)
