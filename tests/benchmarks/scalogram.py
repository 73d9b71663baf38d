"""Error against run time of the scalogram on the screen: first and exact image of any span.

Long spans are put together from cells that stay in memory, so their exact image has two rows: with
the cells still to be computed, and with them ready.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Channel, Demonstration
from forcelab.jobs import Progress, finish
from forcelab.measure.rows import Judgement, Row, Table, timed_row, with_front
from forcelab.measure.timing import Method, Timed, timed_methods
from forcelab.signals.cwt import cwt
from forcelab.signals.scalogram import (
    LONG,
    ChannelView,
    Scalogram,
    Step,
    open_channel,
    row_scales,
    scalogram,
)

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
        "error (of a row's largest)",
        "CPU s",
        rows,
    )


def measuring(
    x: Real, spans: Sequence[int], repetitions: int, columns: int = COLUMNS
) -> Generator[Progress, None, tuple[Row, ...]]:
    """Measure first and exact images of spans in the middle of a recording.

    The error is the largest of a column's largest power, of some rows, relative to the largest
    power of its row in the transform at the full rate.

    `x` (n,); `spans`: visible samples, none more than n.
    """
    demonstration = Demonstration(
        "scalogram", "scalogram", np.arange(len(x)) / RATE, x[:, np.newaxis], (Channel("f", "N"),)
    )
    yield Progress(0, 1, "range of colours")
    view = finish(open_channel(demonstration, "f", LARGEST))
    ways = []
    for span in spans:
        first = (len(x) - span) // 2
        kinds = [FIRST_IMAGE, ONCE, READY] if span > LONG else [EXACT]
        if READY in kinds:
            finish(_job(view, first, span, columns))
        for kind in kinds:
            run = partial(_picture, view, first, span, columns, kind)
            judged = partial(_judged, x, first, span)
            ways.append((span, kind, Method(f"{kind}, {span}", run, judged)))
    timed = yield from timed_methods([way for _, _, way in ways], repetitions)
    megabytes = view.cells(row_scales(ROWS, LARGEST)).values.nbytes / 1e6
    return with_front(
        [
            _row(span, kind, timing, megabytes if span > LONG else None)
            for (span, kind, _), timing in zip(ways, timed, strict=True)
        ]
    )


#: The only image of a short span; of a long one the first, and the exact one before its cells are
#: there and after.
EXACT, FIRST_IMAGE = "exact image", "first image"
ONCE, READY = "exact image, first time", "exact image, seen before"


def _noise(n: int) -> Real:
    """White noise: there is energy at all scales and everywhere."""
    return np.random.default_rng(0).standard_normal(n)


def _compared(scales: Real, span: int) -> NDArray[np.intp]:
    """Which rows are compared: none that the Nyquist frequency cuts, or has but a few waves."""
    fine = np.flatnonzero((scales >= 4.0) & (scales <= span / WAVES))
    return fine[np.linspace(0, len(fine) - 1, min(COMPARED, len(fine))).astype(int)]


def _largest(x: Real, scale: float, edges: NDArray[np.int64]) -> Real:
    """Largest ``|W|^2`` between neighbouring edges, in samples, piece by piece."""
    out = np.zeros(len(edges) - 1)
    halo = int(HALO * scale) + 1
    for begin in range(int(edges[0]), int(edges[-1]), PIECE):
        end = min(begin + PIECE, int(edges[-1]))
        left, right = max(0, begin - halo), min(len(x), end + halo)
        full = cwt(x[left:right], np.array([scale]))[0, begin - left : end - left]
        power = full.real**2 + full.imag**2
        bounds = np.clip(edges, begin, end) - begin
        which = np.flatnonzero(bounds[:-1] < bounds[1:])
        out[which] = np.maximum(out[which], np.maximum.reduceat(power, bounds[which]))
    return out


def _job(
    view: ChannelView, first: int, span: int, columns: int
) -> Generator[Step, None, Scalogram]:
    """What computes the image of a span."""
    return scalogram(
        view,
        first / RATE,
        (first + span) / RATE,
        scales=row_scales(ROWS, LARGEST),
        columns=columns,
    )


def _picture(view: ChannelView, first: int, span: int, columns: int, kind: str) -> Scalogram:
    """Compute the image of a span, as far as it is asked for."""
    if kind != READY:
        view = replace(view)  # without the cells
    job = _job(view, first, span, columns)
    if kind != FIRST_IMAGE:
        return finish(job)
    return next(step.picture for step in job if step.text == "first picture")


def _judged(x: Real, first: int, span: int, picture: Scalogram) -> Judgement:
    """How far columns are off, the worst of them; those of which nothing is known are left out."""
    edges = first + span / picture.values.shape[1] * np.arange(picture.values.shape[1] + 1)
    cells = picture.view.cells(picture.scales)
    if span > LONG and not picture.coarse and cells.serve(edges):
        edges = np.minimum(cells.size * np.floor(edges / cells.size + 0.5 + 1e-6), len(x))
    edges = np.ceil(edges - 1e-6).astype(np.int64)
    worst = 0.0
    for row in _compared(picture.scales, span).tolist():
        found = 10.0 ** (2 * picture.values[row].astype(np.float64))
        known = np.isfinite(found)
        if known.any():
            expected = _largest(x, float(picture.scales[row]), edges)
            worst = max(worst, float(np.max(np.abs(found - expected)[known]) / expected.max()))
    return worst, {}


def _row(span: int, kind: str, timed: Timed[Judgement], megabytes: float | None) -> Row:
    """One way's row."""
    size, reference = f"{span} visible samples", "the transform at the full rate, of some rows"
    row = timed_row(kind, "magnitude", size, reference, timed, 1.0)
    if megabytes is None or row.refusal:
        return row
    return replace(row, further={"cells (MB)": megabytes})
