"""The timeline pairs of the window as a figure."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import replace
from pathlib import Path

from forcelab.gui.figures.timelines import TimelinePairs
from forcelab.gui.review.pairs_rows import Entry
from forcelab.vocabulary import Vocabulary

__all__ = ["figure_of", "saving"]


def figure_of(
    title: str,
    entries: Sequence[Entry],
    vocabulary: Vocabulary,
    actions: Sequence[str],
    stretched: bool,
) -> TimelinePairs:
    """The pairs of some entries, at least one; parameters as of :class:`TimelinePairs`."""
    return TimelinePairs(
        title,
        tuple(replace(entry.pair, note=_note(entry)) for entry in entries),
        vocabulary,
        tuple(actions),
        note_key="At the right: accuracy after the filters.",
        stretched=stretched,
    )


def saving(figure: TimelinePairs, path: Path) -> Generator[None, None, None]:
    """Save a figure, as a job."""
    yield
    figure.save(path)


def _note(entry: Entry) -> str:
    """What is said beside a pair."""
    if entry.human is None:
        return "proposed"
    return "" if entry.share is None else f"{100 * entry.share:.1f} %"
