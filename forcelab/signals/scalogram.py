"""The scalogram of a visible span, at the screen's resolution: coarse first, then exact.

A column shows the largest magnitude of all its samples, so that no impact vanishes, however short
it is and however much time is seen. It is never computed from the transform at the full rate:

* powers come from short transforms with a point every quarter of the scale, frame by frame;
* of long spans the largest powers of small cells are kept (:class:`Tiles`), computed once, from
  which any span is put together; until they are there a picture is made of spots and means
  (:mod:`forcelab.signals.scalogram_spots`);
* phases are those at the columns' centres: the sums themselves, or a short transform of the band.

Error against :func:`forcelab.signals.cwt.cwt`, held by ``tests/signals/test_scalogram.py``:

* everywhere 1e-6 of the channel's amplitude times ``sqrt(a)``, from cut tails and single
  precision; magnitudes are floored there;
* magnitudes: 2 % of the row's largest power, from what lies between points; where two tones beat
  in one row, `d` radians a scale apart, ``sin(d / 16)^2``: 6 % where the wavelet answers to
  either with an eighth of its most, 10 % where with a twenty-third;
* of tiles the columns' edges move to the nearest cell, by a quarter of a column at most; powers of
  tiles that come from a file (:mod:`forcelab.signals.scalogram_kept`) are off by 0.4 % more;
* phases within 0.03 rad where the magnitude is above a tenth of the row's largest. A wavelet that
  the Nyquist frequency cuts rings further than it is followed: within 0.25 rad from scale
  ``(p + 1) / pi`` on (1.9 at p = 5, 2.9 at p = 8), within 0.5 rad from ``p / pi`` on, below which
  the peak itself is cut off and phases are not sure; nothing of that from ``(p + 6.5) / pi`` on.

Of recordings of up to a day at 1 kHz, memory stays below 150 MB for a picture, and 128 MB for the
tiles; means take a byte for each sample. Where a glitch comes up its channel is looked through,
once and as a whole, in some 40 bytes for each sample. Time is in ``forcelab measure scalogram``.
"""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from forcelab.jobs import Progress
from forcelab.signals.scalogram_columns import Columns
from forcelab.signals.scalogram_picture import Picture, magnitudes, phases
from forcelab.signals.scalogram_spots import averaged, spots, wide
from forcelab.signals.scalogram_survey import Survey, row_scales, survey
from forcelab.signals.scalogram_tiles import CHUNK, Tiles

__all__ = ["LONG", "Scalogram", "Step", "Survey", "row_scales", "scalogram", "survey"]

Real = NDArray[np.float64]

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
    """A picture of a span.

    Parameters
    ----------
    start, end : float
        The span in seconds; columns divide it evenly.
    scales : ndarray, shape (k,)
        Of the rows, in samples of the grid, rising; rows divide the logarithms evenly.
    values : ndarray of float32, shape (k, c)
        Decimal logarithms of the columns' largest magnitudes in the channel's unit, or phases in
        radians at the columns' centres. NaN where nothing is known: in gaps, outside the
        recording, at the floor (phases), or not computed yet (the first picture).
    phase : bool
        Whether the values are phases.
    view : Survey
        Of the channel.
    coarse : bool
        Whether a finer picture follows.
    """

    start: float
    end: float
    scales: Real
    values: Picture
    phase: bool
    view: Survey
    coarse: bool


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

    Parameters
    ----------
    view : Survey
        Of the channel, from :func:`survey`.
    start, end : float
        Visible span in seconds; what lies outside the recording is left out.
    scales : ndarray, shape (k,)
        Of the rows, as from :func:`row_scales`.
    columns : int
        Of the screen; fewer are computed where there are fewer samples.
    phase : bool
        Phases instead of magnitudes.

    Yields
    ------
    Step
        Between two of them lie a few milliseconds. While the tiles of a long span are computed,
        pictures come that are exact where they are ready and coarse elsewhere.
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
        way = spots if long else magnitudes
        draft = way(source, view.noise, places, thinned, rough, mother)
    values = yield from _steps(draft, None)
    picture = finished(values, thinned, True)
    few = averaged(thinned, mother)
    # Means are of the whole channel: of a small part of it the exact picture is there before.
    worth = view.means is not None or source.count < WORTH * (last - first)
    if long and not phase and few < len(thinned) and worth:
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
