"""The scalogram of a visible span at the screen's resolution: a running maximum of the transform.

A column shows the largest magnitude of all its samples, so that no impact vanishes, however short
it is and however much time is seen. The wavelet engine hands its coefficients on part by part, and
only the largest of each column is ever kept; long spans go block by block. Phases are those at the
columns' centres.

A long span has a first picture: few rows, of which narrow wavelets are transformed in a short piece
in the middle of few columns, wide ones on means of the samples. Where its columns are wide, the
exact picture is put together from cells of 64 samples, which stay in memory: what was computed of a
channel once is there when it is seen again. The edges of columns move to the nearest cell then, by
a quarter of a column at most.

Error against :func:`forcelab.signals.cwt.cwt`, held by ``tests/signals/test_scalogram.py``: that of
the engine, 1e-7 of the largest coefficient; magnitudes are floored at 1e-6 of the block's amplitude
times ``sqrt(a)``. A wavelet that the Nyquist frequency cuts rings further than it is followed: what
lies :data:`RINGING` samples outside the block is left away, 1e-4 of an impact there.
"""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from forcelab.arrays import Flags, Real, Whole
from forcelab.demonstration import Demonstration
from forcelab.jobs import Progress, map_progress
from forcelab.signals.conditioning import condition
from forcelab.signals.cwt_blocks import design
from forcelab.signals.cwt_engine import plan_for
from forcelab.signals.grid_reader import GridReader, open_reader
from forcelab.signals.wavelets import Morlet

Picture = NDArray[np.float32]

#: Error of the transform, of the largest coefficient of a scale.
TOLERANCE = 1e-7
#: Magnitudes are floored at this share of the channel's noise, as features are, and at this share
#: of its amplitude, which is above the rounding of single precision.
NOISE_SHARE, FLOOR = 1e-3, 1e-6
#: Samples on either side that a wavelet which the Nyquist frequency cuts is followed for.
RINGING = 1024
#: Scales that are transformed together are up to so many times the narrowest: narrow wavelets need
#: not pay for the reach of wide ones.
TOGETHER = 32.0
#: Pieces are of multiples of so many samples where the recording goes on: plans are kept by length.
EVEN = 256
#: Samples that are transformed in one go, in some 60 ms for 100 rows.
BLOCK = 3 << 15
#: No picture has more columns; a wider screen stretches it.
MAX_COLUMNS = 2048
#: Spans of more samples have a first picture.
LONG = 1 << 17
#: The first picture has so many times fewer rows; columns of narrow wavelets are as many times
#: fewer.
FEWER_ROWS, FEWER_COLUMNS = 8, 16
#: Samples of a column that its first picture tells of where pieces are looked at, and the furthest
#: that their wavelets may reach.
PIECE, FARTHEST = 512, 768
#: Samples of a mean at least, and means of a span at most.
MEAN, MEANS = 16, 1 << 20
#: Samples of a cell at least, and bytes of all cells of a channel at most: of recordings of more
#: than 1e7 samples cells are larger.
CELL, MOST = 64, 1 << 26
#: Blocks between two pictures of a long span while its cells are computed: some 0.3 s.
SHOWN = 4
#: Stretches of a demonstration that tell its range of colours, the samples of each, and the columns
#: and rows that it is seen in.
STRETCHES, STRETCH, STRETCH_COLUMNS, STRETCH_ROWS = 6, 1 << 14, 512, 16
#: Shares of all magnitudes below the darkest and the brightest colour, and their least distance.
DARKEST, BRIGHTEST, LEAST = 0.05, 0.999, 1.0
#: Decades above the middle that have colours of their own at most: forces take two. Next to a spike
#: that is no glitch yet they would all have one colour.
MOST_DECADES = 4.0
#: Times and rates round; an edge that is so little past a sample is taken for the sample.
ROUNDING = 1e-6


@dataclass(eq=False, slots=True)
class ChannelView:
    """What all pictures of a channel have in common; one job at a time may use it."""

    reader: GridReader  # the channel on its grid
    wavelet: Morlet
    #: Decimal logarithms of the magnitudes for the first and the last colour.
    low: float = -1.0
    high: float = 0.0
    _cells: Cells | None = field(default=None, init=False, repr=False)

    def cells(self, scales: Real) -> Cells:
        """The cells of some scales, as far as they are computed; those of others are dropped."""
        if self._cells is None or not np.array_equal(self._cells.scales, scales):
            self._cells = Cells(self, scales)
        return self._cells


@dataclass(frozen=True, eq=False, slots=True)
class Scalogram:
    """A picture of a span."""

    #: start and end: The span in seconds; columns divide it evenly.
    start: float
    end: float
    #: (k,), of the rows, in samples of the grid, rising; rows divide the logarithms evenly.
    scales: Real
    #: (k, c), decimal logarithms of the columns' largest magnitudes in the channel's unit, or
    #: phases in radians at the columns' centres. NaN where nothing is known: in gaps, at the floor
    #: (phases), or not computed yet (the first picture).
    values: Picture
    phase: bool  # whether the values are phases
    view: ChannelView
    coarse: bool  # whether a finer picture follows


@dataclass(frozen=True, slots=True)
class Step(Progress):
    """Progress of a scalogram, with the newest picture there is."""

    picture: Scalogram | None = None


def row_scales(rows: int, largest: float, smallest: float = 2.0) -> Real:
    """Scales in the middles of `rows` even steps of the logarithm; shape (rows,)."""
    ratio = largest / smallest
    return np.asarray(smallest * ratio ** ((np.arange(rows) + 0.5) / rows), dtype=np.float64)


def colour_range(values: NDArray[np.floating], least: float = LEAST) -> tuple[float, float]:
    """Decimal logarithms of the magnitudes for the first and the last colour.

    `values` (n,): decimal logarithms, at least one, all known; `least`: decades between the two.
    """
    shares = (DARKEST, 0.5, BRIGHTEST)
    dark, middle, bright = (float(v) for v in np.quantile(values, shares))
    high = min(bright, middle + MOST_DECADES)
    return min(dark, high - least), high


def open_channel(
    demonstration: Demonstration, channel: str, largest: float, wavelet: Morlet | None = None
) -> Generator[Progress, None, ChannelView]:
    """Find a channel's grid, and its range of colours from stretches of it; a job.

    `channel`: a recorded channel, or a recognition channel such as ``"tangential 1"``; `largest`:
    the largest scale that will be shown, in samples.
    """
    reader = yield from open_reader(demonstration, channel)
    view = ChannelView(reader, wavelet or Morlet())
    length = min(STRETCH, reader.count)
    stretches = min(STRETCHES, -(-reader.count // length))
    firsts = np.linspace(0, reader.count - length, stretches).astype(np.int64)
    values, known = _read_pieces(reader, firsts, length)
    yield Progress(0, 1, "range of colours")
    bounds = np.linspace(0, length, min(length, STRETCH_COLUMNS) + 1).astype(np.int64)
    sizes = _values(view, values, row_scales(STRETCH_ROWS, largest), bounds, False)
    seen = np.logical_or.reduceat(known, bounds[:-1], axis=1)
    if seen.any():
        view.low, view.high = colour_range(np.moveaxis(sizes, 1, 0)[:, seen].ravel())
    return view


def scalogram(
    view: ChannelView,
    start: float,
    end: float,
    *,
    scales: Real,
    columns: int,
    phase: bool = False,
) -> Generator[Step, None, Scalogram]:
    """Compute the picture of a span; a job that yields a first picture of a long one.

    `view`: of the channel, from :func:`open_channel`; `start`, `end`: visible span in seconds; what
    lies outside the recording is left out; `scales` (k,): of the rows, as from :func:`row_scales`;
    `columns`: of the screen; fewer are computed where there are fewer samples.
    """
    reader = view.reader
    first = min(max(reader.place(start), 0.0), float(reader.count - 1))
    last = max(min(reader.place(end), float(reader.count)), first + 1.0)
    count = max(1, min(columns, MAX_COLUMNS, math.floor(last - first)))
    edges = np.linspace(first, last, count + 1)
    span, empty = (reader.time(first), reader.time(last)), np.empty((0, 0), dtype=np.float32)
    picture = Scalogram(*span, scales, empty, phase, view, False)
    at = _centres(edges) if phase else _bounds(edges)
    if last - first <= LONG:
        exact = _blocks(view, scales, at, phase)
        return replace(picture, values=(yield from _steps(exact, None)))
    cells = view.cells(scales)
    in_cells = not phase and cells.serve(edges)
    missing = cells.missing(first, last)
    if in_cells and not missing:
        return replace(picture, values=cells.picture(edges))
    thinned = _thinned(scales)
    narrow, wide, mean = _first_rows(thinned, view.wavelet, last - first)
    values = np.full((len(thinned), count), np.nan, dtype=np.float32)
    coarse = replace(picture, scales=thinned, values=values, coarse=True)
    if narrow:
        job = _narrow_rows(view, thinned[:narrow], edges, phase)
        values[:narrow] = yield from _steps(job, None)
        yield Step(0, 2, "rows of narrow wavelets", coarse)
    if wide < len(thinned):
        job = _wide_rows(view, thinned[wide:], edges, mean, phase)
        rest = yield from _steps(job, coarse)
        values = np.concatenate([values[:wide], rest])
        values[:, np.isnan(rest).all(axis=0)] = np.nan  # a gap ends where it ends
        coarse = replace(coarse, values=values)
    yield Step(1, 2, "first picture", coarse)
    if not in_cells:
        exact = _phases(view, scales, at) if phase else largest_magnitudes(view, scales, at)
        return replace(picture, values=(yield from _steps(exact, coarse)))
    rough = values[np.arange(len(scales)) * len(thinned) // len(scales)]
    for number, block in enumerate(missing):
        if number and number % SHOWN == 0:
            # What is exact by then is shown.
            values = np.where(cells.done(edges), cells.picture(edges), rough)
            coarse = replace(picture, values=values, coarse=True)
            yield Step(number, len(missing), "exact picture", coarse)
        yield from _steps(cells.computing(block), coarse)
    return replace(picture, values=cells.picture(edges))


_ResultT = TypeVar("_ResultT")


def _steps(
    job: Generator[Progress, None, _ResultT], picture: Scalogram | None
) -> Generator[Step, None, _ResultT]:
    """Go through a job's steps, with the newest picture beside each."""
    return map_progress(job, lambda step: Step(step.done, step.total, step.text, picture))


def _thinned(scales: Real) -> Real:
    """Fewer rows over the same range of the logarithm."""
    if len(scales) == 1:
        return scales
    spread = math.exp(0.5 * math.log(scales[-1] / scales[0]) / (len(scales) - 1))
    return row_scales(max(1, len(scales) // FEWER_ROWS), scales[-1] * spread, scales[0] / spread)


def _bounds(edges: Real) -> Whole:
    """The first sample of each column, and the one after the last column."""
    bounds = np.ceil(edges - ROUNDING).astype(np.int64)
    # A column of one sample that rounding has lost takes the one before it.
    bounds[-1] = max(bounds[-1], bounds[0] + 1)
    return bounds


def _centres(edges: Real) -> Whole:
    """The sample in the middle of each column."""
    return np.floor(0.5 * (edges[:-1] + edges[1:]) + 1e-9).astype(np.int64)


def _bands(scales: Real, wavelet: Morlet) -> list[tuple[slice, int]]:
    """Neighbouring scales, with the samples on either side that their coefficients rest on."""
    needs = design(wavelet.p, TOLERANCE)
    bands, start = [], 0
    while start < len(scales):
        end = int(np.searchsorted(scales, TOGETHER * scales[start], side="right"))
        half = needs.half_width(float(scales[end - 1]))
        if needs.is_cut(float(scales[start])):
            half = max(half, RINGING)
        bands.append((slice(start, end), half))
        start = end
    return bands


def reach(scales: Real, wavelet: Morlet) -> int:
    """Samples on either side that are read for the coefficients of some scales."""
    return EVEN + max(half for _, half in _bands(scales, wavelet))


def largest_magnitudes(
    view: ChannelView, scales: Real, bounds: Whole
) -> Generator[Progress, None, Picture]:
    """Decimal logarithms of the largest magnitudes between neighbouring samples; a job.

    `bounds` (m + 1,): samples of the grid, rising. Gives (k, m); NaN where nothing is known.
    """
    return _blocks(view, scales, bounds, False)


def _values(view: ChannelView, values: Real, scales: Real, at: Whole, phase: bool) -> Picture:
    """Phases at some samples, or logarithms of the largest magnitudes between neighbouring ones.

    `values` (c, n): finite; `at` (m,): rising, from 0 to n. Gives (c, k, m), or one less.
    """
    ready = condition(values)
    plan = plan_for(values.shape[1], scales, view.wavelet, TOLERANCE)
    floor = np.maximum(NOISE_SHARE * ready.noise[:, np.newaxis], FLOOR * np.sqrt(scales))
    if phase:
        coefficients = plan.at_samples(ready.values, at)
        angles = np.angle(coefficients)
        angles[np.abs(coefficients) <= floor[:, :, np.newaxis]] = np.nan
        return np.asarray(angles, dtype=np.float32)
    power = plan.largest_power(ready.values, at)
    sizes = 0.5 * np.log10(np.maximum(power, floor[:, :, np.newaxis] ** 2))
    sizes += (math.log10(2.0) * ready.exponent)[:, np.newaxis, np.newaxis]
    return np.asarray(sizes, dtype=np.float32)


def _block(
    view: ChannelView, scales: Real, at: Whole, phase: bool
) -> Generator[Progress, None, Picture]:
    """A picture of one block on the channel's grid, as a job; NaN where nothing is known."""
    first, last = int(at[0]), int(at[-1]) + int(phase)

    def around(half: int) -> tuple[int, int]:
        begin = max(0, first - half)
        return begin, min(view.reader.count, begin + EVEN * -(-(last + half - begin) // EVEN))

    begin, end = around(reach(scales, view.wavelet))
    values, known = view.reader.read(begin, end)
    parts = []
    for rows, half in _bands(scales, view.wavelet):
        left, right = around(half)
        piece = values[np.newaxis, left - begin : right - begin]
        parts.append(_values(view, piece, scales[rows], at - left, phase)[0])
        yield Progress(rows.stop, len(scales), "rows")
    out = np.concatenate(parts)
    if phase:
        out[:, ~known[at - begin]] = np.nan
    else:
        inside = known[first - begin : last - begin]
        out[:, ~np.logical_or.reduceat(inside, at[:-1] - first)] = np.nan
    return out


def _blocks(
    view: ChannelView, scales: Real, at: Whole, phase: bool
) -> Generator[Progress, None, Picture]:
    """A picture of a span of any length, block by block, as a job."""
    out = np.full((len(scales), len(at) - int(not phase)), np.nan, dtype=np.float32)
    first, last = int(at[0]), int(at[-1]) + int(phase)
    for begin in range(first, last, BLOCK):
        end = min(begin + BLOCK, last)
        low, high = np.searchsorted(at, (begin, end))
        if phase:
            columns, inside = slice(low, high), at[low:high]
        else:
            low = int(np.searchsorted(at, begin, side="right")) - 1
            columns, inside = slice(low, high), np.clip(at[low : high + 1], begin, end)
        if len(inside):
            values = yield from _block(view, scales, inside, phase)
            out[:, columns] = np.fmax(out[:, columns], values)
        yield Progress(end - first, last - first, "blocks")
    return out


def _read_pieces(reader: GridReader, firsts: Whole, length: int) -> tuple[Real, Flags]:
    """Samples from each of several places on, and which are known; (len(firsts), length)."""
    pieces = [reader.read(first, first + length) for first in firsts.tolist()]
    return np.stack([values for values, _ in pieces]), np.stack([known for _, known in pieces])


def _at_centres(
    view: ChannelView, scales: Real, centres: Whole, half: int, wanted: int, phase: bool
) -> Generator[Progress, None, Picture]:
    """Values of `wanted` samples in the middle of columns alone, from pieces around them; a job."""
    length = wanted + 2 * half
    at = np.array([length // 2] if phase else [half, half + wanted])
    out = np.empty((len(scales), len(centres)), dtype=np.float32)
    together = max(1, BLOCK // length)
    for start in range(0, len(centres), together):
        columns = slice(start, start + together)
        values, known = _read_pieces(view.reader, centres[columns] - length // 2, length)
        out[:, columns] = _values(view, values, scales, at, phase)[:, :, 0].T
        seen = known[:, half : half + wanted].any(axis=1)
        out[:, columns][:, ~seen] = np.nan
        yield Progress(start, len(centres), "pieces")
    return out


def _phases(view: ChannelView, scales: Real, centres: Whole) -> Generator[Progress, None, Picture]:
    """Phases of a long span; a job that looks at no more samples than it needs."""
    parts = []
    for rows, half in _bands(scales, view.wavelet):
        if len(centres) * (2 * half + 1) < centres[-1] - centres[0]:
            job = _at_centres(view, scales[rows], centres, half, 1, True)
        else:
            job = _blocks(view, scales[rows], centres, True)
        parts.append((yield from job))
    return np.concatenate(parts)


def _first_rows(scales: Real, wavelet: Morlet, span: float) -> tuple[int, int, int]:
    """Up to which row a first picture is from pieces, from which from means; samples of a mean.

    Wavelets of high carriers may be too wide for pieces and too fast for means.
    """
    needs = design(wavelet.p, TOLERANCE)
    mean = MEAN
    while span > MEANS * mean:
        mean *= 2
    wide = sum(needs.is_cut(scale / mean) for scale in scales.tolist())
    narrow = sum(needs.half_width(scale) <= FARTHEST for scale in scales[:wide].tolist())
    return narrow, wide, mean


def _narrow_rows(
    view: ChannelView, scales: Real, edges: Real, phase: bool
) -> Generator[Progress, None, Picture]:
    """Rows of a first picture from pieces in the middle of few columns; a job."""
    count, half = len(edges) - 1, design(view.wavelet.p, TOLERANCE).half_width(float(scales[-1]))
    few = max(1, count // FEWER_COLUMNS)
    centres = _centres(np.linspace(edges[0], edges[-1], few + 1))
    wanted = 1 if phase else PIECE
    values = yield from _at_centres(view, scales, centres, half, wanted, phase)
    return values[:, np.arange(count) * few // count]


def _wide_rows(
    view: ChannelView, scales: Real, edges: Real, mean: int, phase: bool
) -> Generator[Progress, None, Picture]:
    """Rows of a first picture on means of the samples; a job."""
    half = -(-design(view.wavelet.p, TOLERANCE).half_width(float(scales[-1])) // mean)
    begin = max(0, int(edges[0]) // mean - half)
    end = min(-(-view.reader.count // mean), int(edges[-1]) // mean + 1 + half)
    means, known = yield from _means(view.reader, mean, begin, end)
    places = (edges - 0.5 * (mean - 1)) / mean - begin  # of the middles of means
    at = np.clip(_centres(places) if phase else _bounds(places), 0, len(means) - int(phase))
    values = _values(view, means[np.newaxis], scales / mean, at, phase)[0]
    if not phase:
        # A coefficient adds up so many times fewer values, weighted by a smaller wavelet.
        values += np.float32(0.5 * math.log10(mean))
    values[:, ~(known[at] if phase else np.logical_or.reduceat(known, at[:-1]))] = np.nan
    return values


def _means(
    reader: GridReader, mean: int, begin: int, end: int
) -> Generator[Progress, None, tuple[Real, Flags]]:
    """Means of `mean` samples each, from a number on, and of which something is known; a job."""
    means, known = np.empty(end - begin), np.empty(end - begin, dtype=bool)
    each = BLOCK // mean
    for start in range(begin, end, each):
        stop = min(start + each, end)
        values, measured = reader.read(start * mean, stop * mean)
        into = slice(start - begin, stop - begin)
        means[into] = values.reshape(-1, mean) @ np.full(mean, 1.0 / mean)
        known[into] = measured.reshape(-1, mean).any(axis=1)
        yield Progress(stop - begin, end - begin, "means")
    return means, known


class Cells:
    """The largest magnitudes of a channel in all cells of a few samples, as far as computed.

    `scales` (k,): in samples, rising; `size`: samples of a cell, a power of two; `values` (k,
    cells): decimal logarithms, NaN where nothing is known.
    """

    def __init__(self, view: ChannelView, scales: Real) -> None:
        self.scales, self._view = scales, view
        count = view.reader.count
        self.size = CELL
        while 4 * len(scales) * count > MOST * self.size:
            self.size *= 2
        self.values = np.zeros((len(scales), -(-count // self.size)), dtype=np.float32)
        self._done = np.zeros(-(-count // BLOCK), dtype=bool)

    def serve(self, edges: Real) -> bool:
        """Whether columns are so wide that their edges move by a quarter of one at most."""
        return bool(edges[-1] - edges[0] >= 2 * self.size * (len(edges) - 1))

    def missing(self, first: float = 0, last: float = math.inf) -> list[int]:
        """The blocks of a span, in samples, that are still to be computed."""
        begin = int(first) // BLOCK
        end = len(self._done) if math.isinf(last) else -(-int(last + 1) // BLOCK)
        return (begin + np.flatnonzero(~self._done[begin:end])).tolist()

    def computing(self, block: int) -> Generator[Progress, None, None]:
        """Compute a block; a job."""
        begin = block * BLOCK
        end = min(begin + BLOCK, self._view.reader.count)
        bounds = np.append(np.arange(begin, end, self.size), end)
        values = yield from _block(self._view, self.scales, bounds, False)
        first = begin // self.size
        self.values[:, first : first + values.shape[1]] = values
        self._done[block] = True

    def _nearest(self, edges: Real) -> Whole:
        """The cells nearest to edges of columns; edges do not depend on the last bits."""
        nearest = np.floor(edges / self.size + 0.5 + ROUNDING).astype(np.int64)
        nearest[:-1] = np.minimum(nearest[:-1], self.values.shape[1] - 1)
        nearest[-1] = max(min(nearest[-1], self.values.shape[1]), nearest[-2] + 1)
        return nearest

    def done(self, edges: Real) -> Flags:
        """Which columns are computed."""
        cells = self._nearest(edges)
        missing = np.concatenate(([0], np.cumsum(~self._done)))
        last = (np.maximum(cells[1:], cells[:-1] + 1) * self.size - 1) // BLOCK
        return np.asarray(missing[last + 1] == missing[cells[:-1] * self.size // BLOCK])

    def picture(self, edges: Real) -> Picture:
        """Logarithms of the largest magnitudes in columns that the cells :meth:`serve`."""
        cells = self._nearest(edges)
        return np.fmax.reduceat(self.values[:, : cells[-1]], cells[:-1], axis=1)
