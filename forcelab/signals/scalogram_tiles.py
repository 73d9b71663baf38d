"""Largest powers of a channel's scalogram, kept, from which any span is put together.

Of each scale the largest ``|W|^2`` of every 64 samples is kept, and of every 4, 16, ... of these
cells: a column of the screen looks at eight of them at most, however much time it holds. Cells are
computed once, chunk by chunk, first those that are seen; the larger ones of a chunk may be there
before the smaller ones (:meth:`Tiles.restore`).
"""

from __future__ import annotations

import math
from collections.abc import Generator, Mapping
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.jobs import Progress
from forcelab.signals.scalogram_columns import Columns
from forcelab.signals.scalogram_frames import Frames, bank
from forcelab.signals.scalogram_picture import Picture, decimal
from forcelab.signals.scalogram_source import Level, Source
from forcelab.signals.scalogram_threads import THREADS, in_threads
from forcelab.signals.wavelets import Morlet

__all__ = ["Tiles"]

Real = NDArray[np.float64]
Single = NDArray[np.float32]
Flags = NDArray[np.bool_]

#: Samples of a cell at least, and cells of a level in one of the next.
CELL, RATIO = 64, 4
#: Samples that are computed in one go, in 20 ms: cells of the highest level lie within one. Fewer
#: cost more, as wide wavelets reach far beyond them; more are too many for a span that is not.
CHUNK = 1 << 16
#: Bytes of all cells at most; of longer recordings cells are larger.
MOST = 1 << 27
#: Bytes at most that :meth:`Tiles.told` makes of the cells.
TOLD = 10_000_000
#: Samples are kept from overflowing in single precision.
_LARGEST = 1e15


class Tiles:
    """The cells of one channel at some scales.

    Parameters
    ----------
    source : Source
    noise : float
        Standard deviation of the channel's white noise, in its unit.
    level : Level
        Of the channel's usual samples.
    scales : ndarray, shape (k,)
        In samples, rising.
    wavelet : Morlet

    Attributes
    ----------
    cell : int
        Samples of a cell: a power of two, 64 for recordings up to 1e7 samples and 150 scales.
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

        Returns
        -------
        size : int
        edges : ndarray of int64, shape (count + 1,)
            In samples, multiples of `size`.
        """
        size = self.cell
        while 2 * size * RATIO <= grid.width and size * RATIO <= CHUNK:
            size *= RATIO
        # Half a cell more or less is told from rounding: edges do not depend on the last bits.
        return size, size * np.floor(grid.edges() / size + 0.5 + 1e-6).astype(np.int64)

    def missing(self, first: float, last: float, size: int = 0) -> list[int]:
        """The chunks of a span, in samples, that are still to be computed.

        Parameters
        ----------
        first, last : float
        size : int
            Samples of the cells that are wanted; by default the smallest.
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
        for finer, coarser in zip(self._levels[level:], self._levels[level + 1 :], strict=False):
            part = finer[:, cells]
            cells = slice(cells.start // RATIO, cells.stop // RATIO)
            into = np.maximum(part[:, ::RATIO], part[:, 1::RATIO], out=coarser[:, cells])
            for place in range(2, RATIO):  # a quarter of the time of the largest along a short axis
                np.maximum(into, part[:, place::RATIO], out=into)

    def _told_level(self) -> int:
        """The level of the smallest cells of which all together take few bytes."""
        few = (i for i, level in enumerate(self._levels) if 2 * level.size <= TOLD)
        return next(few, len(self._levels) - 1)

    @property
    def told_cell(self) -> int:
        """Samples of the cells that :meth:`told` tells of."""
        return self.cell * RATIO ** self._told_level()

    def told(self) -> dict[str, NDArray[Any]]:
        """What is worth keeping of tiles that are complete, in a few megabytes.

        Of each power's 32 bits the upper 16 are told, rounded, which errs by 0.4 % of it.
        """
        level = self._told_level()
        bits = self._levels[level].view(np.uint32) + np.uint32(1 << 15)
        known: Flags = np.any(self._known.reshape(bits.shape[1], -1), axis=1)
        return {"cells": (bits >> 16).astype(np.uint16), "known": known, "sizes": self._sizes}

    def restore(self, told: Mapping[str, NDArray[Any]]) -> bool:
        """Take over what :meth:`told` told of the same channel; gives whether it fits."""
        level = self._told_level()
        cells, known, sizes = (told[name] for name in ("cells", "known", "sizes"))
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

        Parameters
        ----------
        grid : Columns
            Which :meth:`serve` accepts. Edges move to the nearest cell.

        Returns
        -------
        values : ndarray of float32, shape (k, count)
            Decimal logarithms of the largest magnitudes in the channel's unit; NaN where nothing
            is known.
        done : ndarray of bool, shape (count,)
            Which columns are computed; the others mean nothing.
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
        found = np.maximum(before + rise * at, before + rise * ends)
        return np.asarray(found.reshape(rows, -1))
    each = cell // step
    # Faster than the largest along a short axis.
    found = np.maximum.reduceat(power[:, : count * each], np.arange(0, count * each, each), axis=1)
    if step > 1:
        # The cell's last sample, between its last point and the next cell's first.
        last = power[:, each - 1 : count * each : each] / step
        last += power[:, each : count * each + 1 : each] * np.float32(1 - 1 / step)
        np.maximum(found, last, out=found)
    return found
