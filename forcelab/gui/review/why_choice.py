"""Which place is to be explained, and what is said where there is none."""

from __future__ import annotations

from forcelab.gui.document import Document
from forcelab.review.differences import Interval, place_at, place_of

__all__ = ["at_cursor", "chosen", "reason"]


def chosen(document: Document, selecting: bool) -> Interval | None:
    """The place that was examined, or the selected segment; None if there is neither.

    Parameters
    ----------
    document : Document
    selecting : bool
        Whether the segment was selected after the place was examined.
    """
    reviewed, examined = document.reviewed, document.examined
    if reviewed is None or document.outcome is None:
        return None
    if examined is not None and examined.demonstration != document.id:
        examined = None
    if document.selected is None or (examined is not None and not selecting):
        return examined
    segment = document.segments[document.selected]
    # What was trained may have merged it with another action.
    human = segment.action if segment.action in document.outcome.actions else None
    return place_of(reviewed, segment.start, segment.end, human)


def at_cursor(document: Document) -> Interval | None:
    """What is labelled or predicted at the cursor; None where nothing is."""
    reviewed = document.reviewed
    return None if reviewed is None else place_at(reviewed, document.cursor)


def reason(document: Document) -> str:
    """What is said where nothing can be explained."""
    if document.project is None or not document.id:
        return "Open a demonstration to see why something was predicted in it."
    if document.coding_blind:
        return "You code this demonstration blind: what was predicted is shown when it is done."
    if document.outcome is None:
        return "Train a recogniser; then a mistake of it can be explained here."
    if document.reviewed is None:
        return (
            "This demonstration was not part of the training; choose one that was, or train again."
        )
    return (
        "Nothing is labelled or predicted at the cursor; choose a segment or a mistake to see why."
    )
