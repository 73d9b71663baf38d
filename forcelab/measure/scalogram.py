"""Error against run time of the scalogram on the screen: first and exact image of any span."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Channel, Demonstration
from forcelab.jobs import Progress, finish
from forcelab.measure.rows import Row, Table, with_front
from forcelab.measure.timing import Timed, Way, timed_ways
from forcelab.signals.cwt import cwt
from forcelab.signals.scalogram import Scalogram, Survey, row_scales, scalogram, survey

__all__ = ["measuring", "tabulate"]

Real = NDArray[np.float64]

RATE = 1000.0
#: Visible samples.
SPANS = (4_000, 65_000, 1_000_000, 10_000_000)
#: Of the screen, and the largest scale in samples.
ROWS, COLUMNS, LARGEST = 100, 1920, 2048.0
#: Rows of the picture that are compared with the transform at the full rate.
COMPARED = 4
#: A row is compared where the span is so many times its scale: it holds as many waves at least.
WAVES = 64
#: How far a piece of the reference reaches beyond what is kept of it, in scales; its samples.
HALO, PIECE = 6.0, 1 << 19


def tabulate(*, quick: bool = False) -> Generator[Progress, None, Table]:
    """Measure all spans of a recording of 1e7 samples; with `quick` those up to 1e6."""
    spans, length = (SPANS[:3], 1_000_000) if quick else (SPANS, SPANS[-1])
    rows = yield from measuring(_noise(length), spans, 3 if quick else 5)
    return Table(
        f"Scalogram on the screen, {ROWS} scales x {COLUMNS} columns, 2 to {LARGEST:g} samples",
        "error (of a row's energy)",
        "CPU s",
        rows,
    )


def measuring(
    x: Real, spans: Sequence[int], repetitions: int, columns: int = COLUMNS
) -> Generator[Progress, None, tuple[Row, ...]]:
    """Measure first and exact images of spans in the middle of a recording.

    The error is that of the energy that a row holds over the span, of the worst of some rows,
    relative to the transform at the full rate.

    Parameters
    ----------
    x : ndarray, shape (n,)
    spans : sequence of int
        Visible samples, none more than n.
    repetitions : int
    columns : int
        Of the screen.

    Yields
    ------
    Progress

    Returns
    -------
    tuple of Row
    """
    demonstration = Demonstration(
        "scalogram", "scalogram", np.arange(len(x)) / RATE, x[:, np.newaxis], (Channel("f", "N"),)
    )
    yield Progress(0, 1, "survey")
    view = finish(survey(demonstration, "f", LARGEST))
    ways = []
    for span in spans:
        first = (len(x) - span) // 2
        yield Progress(0, 1, f"reference of {span} samples")
        energy = _energy(x, first, first + span)
        for kind in _KINDS:
            run = partial(_picture, view, first, span, columns, kind)
            ways.append((span, kind, Way(f"{kind}, {span}", run, partial(_error, energy))))
    timed = yield from timed_ways([way for _, _, way in ways], repetitions)
    return with_front(
        [_row(span, kind, one) for (span, kind, _), one in zip(ways, timed, strict=True)]
    )


#: The first image, and that which stays.
_KINDS = ("first image", "exact image")


def _noise(n: int) -> Real:
    """White noise: there is energy at all scales and everywhere."""
    return np.random.default_rng(0).standard_normal(n)


def _compared(scales: Real, span: int) -> NDArray[np.intp]:
    """Which rows are compared: none that the Nyquist frequency cuts, or has but a few waves."""
    fine = np.flatnonzero((scales >= 4.0) & (scales <= span / WAVES))
    return fine[np.linspace(0, len(fine) - 1, min(COMPARED, len(fine))).astype(int)]


def _energy(x: Real, first: int, last: int) -> dict[float, float]:
    """Mean of ``|W|^2`` over a span for some scales of its picture, piece by piece."""
    scales = row_scales(ROWS, LARGEST)
    found = {}
    for scale in scales[_compared(scales, last - first)].tolist():
        halo, total = int(HALO * scale) + 1, 0.0
        for begin in range(first, last, PIECE):
            end = min(begin + PIECE, last)
            left, right = max(0, begin - halo), min(len(x), end + halo)
            full = cwt(x[left:right], np.array([scale]))[0, begin - left : end - left]
            total += float(np.sum(full.real**2 + full.imag**2))
        found[scale] = total / (last - first)
    return found


def _picture(view: Survey, first: int, span: int, columns: int, kind: str) -> Scalogram:
    """Compute the image of a span, as far as it is asked for."""
    job = scalogram(
        view,
        first / RATE,
        (first + span) / RATE,
        scales=row_scales(ROWS, LARGEST),
        columns=columns,
    )
    if kind == _KINDS[1]:
        return finish(job)
    return next(step.picture for step in job if step.picture is not None)


def _error(energy: dict[float, float], picture: Scalogram) -> float:
    """How far the energy of rows is off, of the worst of them; nothing known is not compared."""
    worst = 0.0
    for scale, expected in energy.items():
        row = picture.values[int(np.argmin(np.abs(np.log(picture.scales / scale))))]
        known = np.isfinite(row)
        if not known.any():
            continue
        # Of white noise each scale holds the same power; the nearest row will do.
        found = float(np.mean(10.0 ** (2 * row[known].astype(np.float64))))
        worst = max(worst, abs(found / expected - 1))
    return worst


def _row(span: int, kind: str, timed: Timed[float]) -> Row:
    """One way's row."""
    size, reference = f"{span} visible samples", "the transform at the full rate, of some rows"
    if timed.seen is None:
        return Row(kind, "magnitude", size, reference, refusal=timed.refusal)
    return Row(
        kind,
        "magnitude",
        size,
        reference,
        error=timed.seen,
        seconds=timed.seconds,
        spread=timed.spread,
        peak_bytes=timed.peak_bytes,
    )
