"""What the scalogram's panel has computed in the background."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from forcelab.demonstration import Demonstration
from forcelab.gui.document import Document
from forcelab.gui.label.scalogram_scales import LARGEST, SMALLEST, P
from forcelab.jobs import Progress
from forcelab.project.loading import DEMONSTRATIONS

if TYPE_CHECKING:
    from forcelab.signals.scalogram import Scalogram, Survey

__all__ = ["Wish", "compute", "folder_of"]

#: Rows of a long span, whatever the panel's height: its tiles are kept for these.
LONG_ROWS = 100
#: Of recordings of fewer samples nothing is kept: all is computed anew in less than a second.
KEPT = 1 << 21


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
    folder : Path, optional
        The demonstration's own, where what long spans are put together from is kept; None where
        nothing may be, or need be.
    """

    demonstration: Demonstration
    channel: str
    span: tuple[float, float]
    rows: int
    columns: int
    phase: bool
    folder: Path | None = None


def folder_of(document: Document) -> Path | None:
    """Where something is kept beside the demonstration; None where nothing may or need be."""
    project, shown = document.project, document.demonstration
    if project is None or project.read_only or shown is None or len(shown.times) < KEPT:
        return None
    return project.path / DEMONSTRATIONS / document.id


def compute(wish: Wish, known: Survey | None) -> Generator[Progress, None, Scalogram]:
    """Compute what is wished for; a job.

    Of a long recording it goes on with the tiles of what is not seen, after the exact picture, so
    that whoever pans or zooms later does not wait for them. One core is left to the window then.
    Its thread keeps its priority: one that waits its turn with Python's lock in its hand would
    hold up the window. In the end they are kept, and the next session begins with them.

    Parameters
    ----------
    wish : Wish
    known : Survey, optional
        Of the channel, from an earlier picture.
    """
    # In the job's thread these imports, most of a second the first time, delay nobody.
    from forcelab.signals.scalogram import LONG, Step, keep, kept, row_scales, scalogram, survey
    from forcelab.signals.wavelets import Morlet

    all_of_it = row_scales(LONG_ROWS, LARGEST, SMALLEST)
    view = known
    if view is None and wish.folder is not None:
        view = kept(wish.folder, wish.demonstration, wish.channel, all_of_it, Morlet(P))
    if view is None:
        view = yield from survey(wish.demonstration, wish.channel, LARGEST, Morlet(P))
    start, end = wish.span
    scales = row_scales(wish.rows, LARGEST, SMALLEST)
    if (end - start) * view.source.rate > LONG:
        scales = all_of_it
    picture = yield from scalogram(
        view, start, end, scales=scales, columns=wish.columns, phase=wish.phase
    )
    count = view.source.count
    if count > LONG and not wish.phase:
        yield Step(1, 1, "exact picture", picture)  # shown before the next chunk is computed
        tiles = view.tiles(all_of_it)
        for step in tiles.building(tiles.missing(0, count, tiles.told_cell), threads=1):
            yield Step(step.done, step.total, step.text, picture)
        if wish.folder is not None and not view.kept:
            view.kept = True  # tried once: a full disk is not asked again and again
            keep(wish.folder, view, all_of_it)
    return picture
