"""Error against run time of the scalogram on the screen: first and exact image of any span.

Long spans are put together from tiles, so their exact image has three rows: with the tiles still to
be computed, once for a recording; with those that a file has kept still to be read, once in each
later session; and with them ready, ever after. First images of long spans are those with the
channel's means ready; the very first one shows narrow wavelets alone until they are.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Channel, Demonstration
from forcelab.jobs import Progress, finish
from forcelab.measure.rows import Judgement, Row, Table, timed_row, with_front
from forcelab.measure.timing import Method, Timed, timed_methods
from forcelab.signals.cwt import cwt
from forcelab.signals.scalogram import (
    LONG,
    Scalogram,
    Step,
    Survey,
    load_tiles,
    row_scales,
    scalogram,
    store_tiles,
    survey,
)
from forcelab.signals.scalogram_frames import Columns

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
    yield Progress(0, 1, "survey")
    view = finish(survey(demonstration, "f", LARGEST))
    with TemporaryDirectory(prefix="forcelab-measure-") as folder:
        ways = []
        for span in spans:
            first = (len(x) - span) // 2
            kinds = [FIRST_IMAGE, EXACT]
            if span > LONG:
                kinds[1:] = [ONCE, FILE, READY]
                yield Progress(0, 1, f"tiles of {span} samples")
                finish(_job(view, first, span, columns))
            for kind in kinds:
                run = partial(_picture, view, first, span, columns, kind, Path(folder))
                judged = partial(_judged, x, first, span)
                ways.append((span, kind, Method(f"{kind}, {span}", run, judged)))
        if spans[-1] > LONG:
            tiles = view.tiles(row_scales(ROWS, LARGEST))
            finish(tiles.building(tiles.missing(0, len(x))))
            store_tiles(Path(folder), view, tiles.scales)
        timed = yield from timed_methods([way for _, _, way in ways], repetitions)
    megabytes = view.tiles(row_scales(ROWS, LARGEST)).nbytes / 1e6
    return with_front(
        [
            _row(span, kind, timing, megabytes if span > LONG else None)
            for (span, kind, _), timing in zip(ways, timed, strict=True)
        ]
    )


#: The first image, that which stays, and that of a long span before its tiles are there, with those
#: of a file, and after.
FIRST_IMAGE, EXACT = "first image", "exact image"
ONCE, READY = "exact image, first time", "exact image, tiles ready"
FILE = "exact image, tiles in a file"


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


def _job(view: Survey, first: int, span: int, columns: int) -> Generator[Step, None, Scalogram]:
    """What computes the image of a span."""
    return scalogram(
        view,
        first / RATE,
        (first + span) / RATE,
        scales=row_scales(ROWS, LARGEST),
        columns=columns,
    )


def _picture(
    view: Survey, first: int, span: int, columns: int, kind: str, folder: Path
) -> Scalogram:
    """Compute the image of a span, as far as it is asked for."""
    if kind in (FIRST_IMAGE, ONCE):
        view = view.without_tiles()
    elif kind == FILE:
        source, scales = view.source, row_scales(ROWS, LARGEST)
        again = load_tiles(folder, source.demonstration, source.channel, scales, view.wavelet)
        assert again is not None
        view = again
    job = _job(view, first, span, columns)
    if kind != FIRST_IMAGE:
        return finish(job)
    return next(step.picture for step in job if step.picture is not None)


def _judged(x: Real, first: int, span: int, picture: Scalogram) -> Judgement:
    """How far columns are off, the worst of them; those of which nothing is known are left out."""
    columns = picture.values.shape[1]
    grid = Columns(first, span / columns, columns)
    edges = grid.bounds()
    if span > LONG and not picture.coarse:
        edges = np.minimum(picture.view.tiles(picture.scales).bounds(grid)[1], len(x))
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
    return replace(row, further={"tiles (MB)": megabytes})
