"""What the scalogram's panel has computed in the background."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from forcelab.demonstration import Demonstration
from forcelab.gui.label.scalogram_scales import LARGEST, SMALLEST, P
from forcelab.jobs import Progress

if TYPE_CHECKING:
    from forcelab.signals.scalogram import Scalogram, Survey

__all__ = ["Wish", "compute"]

#: Rows of a long span, whatever the panel's height: its tiles are kept for these.
LONG_ROWS = 100


@dataclass(frozen=True, slots=True)
class Wish:
    """What a picture is wanted of.

    Parameters
    ----------
    demonstration : Demonstration
    channel : str
    span : tuple of two floats
        Seconds.
    rows, columns : int
    phase : bool
        Phases instead of magnitudes.
    """

    demonstration: Demonstration
    channel: str
    span: tuple[float, float]
    rows: int
    columns: int
    phase: bool


def compute(wish: Wish, known: Survey | None) -> Generator[Progress, None, Scalogram]:
    """Compute what is wished for; a job.

    Of a long recording it goes on with the tiles of what is not seen, after the exact picture, so
    that whoever pans or zooms later does not wait for them.

    Parameters
    ----------
    wish : Wish
    known : Survey, optional
        Of the channel, from an earlier picture.
    """
    # In the job's thread these imports, most of a second the first time, delay nobody.
    from forcelab.signals.scalogram import LONG, Step, row_scales, scalogram, survey
    from forcelab.signals.wavelets import Morlet

    view = known
    if view is None:
        view = yield from survey(wish.demonstration, wish.channel, LARGEST, Morlet(P))
    start, end = wish.span
    scales = row_scales(wish.rows, LARGEST, SMALLEST)
    all_of_it = row_scales(LONG_ROWS, LARGEST, SMALLEST)
    if (end - start) * view.source.rate > LONG:
        scales = all_of_it
    picture = yield from scalogram(
        view, start, end, scales=scales, columns=wish.columns, phase=wish.phase
    )
    count = view.source.count
    if count > LONG and not wish.phase:
        tiles = view.tiles(all_of_it)
        for step in tiles.building(tiles.missing(0, count)):
            yield Step(step.done, step.total, step.text, picture)
    return picture
