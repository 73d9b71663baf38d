"""The scalogram of a visible span, at the screen's resolution: coarse first, then fine.

A picture of c columns and k rows is never computed from the transform at the full rate. Three ways
lead to a row, the cheapest that is right for its scale `a` and the width `s` of a column:

* ``32 a <= s / 2``: power spectra of four overlapping blocks a column;
* otherwise a short transform of the band around the scale, from the samples themselves or, where
  only wide wavelets are left, from a coarser grid;
* phases of narrow wavelets: the sum itself, around each column's centre sample.

Error against :func:`forcelab.signals.cwt.cwt`, held by ``tests/signals/test_scalogram.py``:

* everywhere 1e-6 of the channel's amplitude times ``sqrt(a)``, from cut tails, held ends of the
  piece and filters; magnitudes are floored there;
* bands: 2 % of the row's largest mean power; phases within 0.03 rad where the magnitude is above a
  tenth of the row's largest (0.25 rad below scale 4, whose wavelet the Nyquist frequency cuts);
* blocks: the energy of the whole span within 2 %, a steady tone within 0.2 dB at its peak and
  0.6 dB beside it; each column's edges are soft over a quarter of its width, so that an impact
  there is shared by two columns.

Memory stays below 150 MB whatever the length; time is in ``forcelab measure view``.
"""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Demonstration
from forcelab.jobs import Progress
from forcelab.signals.conditioning import noise_level
from forcelab.signals.scalogram_picture import Picture, picture_values
from forcelab.signals.scalogram_source import Source, open_source
from forcelab.signals.wavelets import Morlet

__all__ = ["Scalogram", "Step", "Survey", "row_scales", "scalogram", "survey"]

Real = NDArray[np.float64]

#: No picture has more columns; a wider screen stretches it.
MAX_COLUMNS = 2048
#: Spans of more samples have a first picture from spots, not from every sample.
SPOTS_FROM = 300_000
#: The first picture has so many times fewer columns, and rows.
COARSE = 8
#: Stretches of a demonstration that tell its range of colours, and the samples of each.
_STRETCHES, _STRETCH = 16, 1 << 15
#: Shares of all magnitudes below the darkest and the brightest colour, and their least distance.
_DARKEST, _BRIGHTEST, _LEAST = 0.05, 0.999, 1.0


@dataclass(frozen=True, eq=False, slots=True)
class Survey:
    """What all views of a channel have in common, so that colours do not jump.

    Parameters
    ----------
    source : Source
        The channel on its grid.
    noise : float
        Standard deviation of the channel's white noise, in its unit.
    low, high : float
        Decimal logarithms of the magnitudes for the first and the last colour.
    """

    source: Source
    noise: float
    low: float
    high: float


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
        Decimal logarithms of root mean square magnitudes in the channel's unit, or phases in
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


def row_scales(rows: int, largest: float, smallest: float = 2.0) -> Real:
    """Scales in the middles of `rows` even steps of the logarithm; shape (rows,)."""
    ratio = largest / smallest
    return np.asarray(smallest * ratio ** ((np.arange(rows) + 0.5) / rows), dtype=np.float64)


def survey(
    demonstration: Demonstration, channel: str, largest: float, wavelet: Morlet | None = None
) -> Generator[Progress, None, Survey]:
    """Look at stretches of a whole demonstration; a job of at most 5e5 samples.

    Parameters
    ----------
    demonstration : Demonstration
    channel : str
        A recorded channel, or a recognition channel such as ``"tangential 1"``.
    largest : float
        The largest scale that will be shown, in samples.
    wavelet : Morlet, optional

    Raises
    ------
    InputError
        If there is no such channel, or a stray stamp makes the grid too long.
    """
    source = yield from open_source(demonstration, channel)
    length = min(_STRETCH, source.count)
    stretches = min(_STRETCHES, -(-source.count // length))
    scales = row_scales(24, largest)
    noises: list[float] = []
    magnitudes = []
    for first in np.linspace(0, source.count - length, stretches).astype(int).tolist():
        values, known = source.read(first, first + length)
        yield Progress(first, source.count, "range of colours")
        if not known.any():
            continue
        peak = int(np.frexp(np.max(np.abs(values)))[1])
        noises.append(float(np.ldexp(noise_level(np.ldexp(values, -peak)), peak)))
        columns = min(length, 64)
        places = float(first), float(first + length)
        job = picture_values(source, noises[-1], places, scales, columns, wavelet or Morlet())
        picture = yield from job
        magnitudes.append(picture[np.isfinite(picture)])
    found = np.concatenate(magnitudes) if magnitudes else np.zeros(0, dtype=np.float32)
    noise = float(np.median(noises)) if noises else 0.0
    if not found.size:
        return Survey(source, noise, -1.0, 0.0)
    low, high = (float(v) for v in np.quantile(found, (_DARKEST, _BRIGHTEST)))
    return Survey(source, noise, min(low, high - _LEAST), high)


def scalogram(
    view: Survey,
    start: float,
    end: float,
    *,
    scales: Real,
    columns: int,
    phase: bool = False,
    wavelet: Morlet | None = None,
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
    wavelet : Morlet, optional
        p = 5 by default.

    Yields
    ------
    Step
        Between two of them lie a few milliseconds.
    """
    mother = wavelet or Morlet()
    source = view.source
    first = min(max(source.place(start), 0.0), float(source.count - 1))
    last = max(min(source.place(end), float(source.count)), first + 1.0)
    span = source.time(first), source.time(last)
    count = max(1, min(columns, MAX_COLUMNS, math.floor(last - first)))
    total = len(scales) + 2
    thinned = _thinned(scales)
    rough = max(1, count // COARSE)

    def finished(values: Picture, rows: Real, coarse: bool) -> Scalogram:
        return Scalogram(*span, rows, values, phase, view, coarse)

    spots = last - first > SPOTS_FROM
    draft = picture_values(
        source, view.noise, (first, last), thinned, rough, mother, phase=phase, spots=spots
    )
    picture = finished((yield from _steps(draft, None, total)), thinned, True)
    yield Step(1, total, "first picture", picture)
    fine = picture_values(source, view.noise, (first, last), scales, count, mother, phase=phase)
    return finished((yield from _steps(fine, picture, total)), scales, False)


def _steps(
    job: Generator[Progress, None, Picture], picture: Scalogram | None, total: int
) -> Generator[Step, None, Picture]:
    """Go through a job's steps, with the newest picture beside each."""
    done = 0 if picture is None else 1
    while True:
        try:
            step = next(job)
        except StopIteration as end:
            values: Picture = end.value
            return values
        yield Step(done, total, step.text, picture)


def _thinned(scales: Real) -> Real:
    """Fewer rows over the same range of the logarithm."""
    if len(scales) == 1:
        return scales
    half = 0.5 * math.log(scales[-1] / scales[0]) / (len(scales) - 1)
    spread = math.exp(half)
    return row_scales(max(1, len(scales) // COARSE), scales[-1] * spread, scales[0] / spread)
