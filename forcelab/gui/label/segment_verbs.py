"""What keys and menus do to segments: each verb is a function of the document.

"The segment" is the selected one, or else the one under the cursor. Every verb says in the status
line why it did nothing.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable
from operator import attrgetter
from typing import Literal

from forcelab.gui.document import Document
from forcelab.gui.label.snapping import SAME
from forcelab.gui.label.track_hits import index_at
from forcelab.labels import Segment

__all__ = [
    "copy_from",
    "delete",
    "end_to_cursor",
    "erase_range",
    "fill_gaps",
    "fill_range",
    "merge",
    "next_segment",
    "nudge",
    "on_segment",
    "previous_segment",
    "say_no",
    "set_fine_nudges",
    "start_to_cursor",
    "the_segment",
    "to_copy",
    "zoom_selection",
    "zoom_to",
]

#: How far a key moves an edge or a segment, in seconds, and how far where that is to be finer.
NUDGE, FINE_NUDGE = 0.010, 0.001
#: What is left free on either side of a segment that is zoomed to, as a share of it.
MARGIN = 0.25

_start = attrgetter("start")
_end = attrgetter("end")


def the_segment(document: Document) -> int | None:
    """The selected segment, or else the one under the cursor."""
    if document.selected is not None:
        return document.selected
    return index_at(document.segments, document.cursor)


def on_segment(document: Document, segment: Segment, verb: Callable[[int], bool]) -> bool:
    """Do something to one of the coder's segments, whatever its number is by now."""
    index = document.index_of(segment)
    if index is None:
        sentence = "That segment was changed elsewhere; look at it anew."
        return say_no(document, sentence)
    return verb(index)


def previous_segment(document: Document) -> bool:
    """Select the last segment that starts before the cursor, and go to its start."""
    index = bisect_left(document.segments, document.cursor - SAME, key=_start) - 1
    return _go(document, index) or say_no(document, "There is no segment before the cursor.")


def next_segment(document: Document) -> bool:
    """Select the first segment that starts after the cursor, and go to its start."""
    index = bisect_right(document.segments, document.cursor + SAME, key=_start)
    # At first the cursor may stand on the first segment without having been sent there.
    if index and document.selected is None and _starts_at(document, index - 1):
        index -= 1
    return _go(document, index) or say_no(document, "There is no segment after the cursor.")


def delete(document: Document) -> bool:
    """Delete the selected segment; with none selected, make the marked range unlabelled."""
    if document.selected is not None:
        return document.delete(document.selected)
    if document.range is not None:
        return erase_range(document)
    return say_no(
        document,
        "Select the segment to delete: click it, or go to it with K and L.",
    )


def erase_range(document: Document) -> bool:
    """Make the marked range unlabelled, and forget the range."""
    if document.range is None:
        return say_no(document, "Mark the range to erase first, with [ and ].")
    start, end = document.range
    done = document.erase(start, end)
    if not document.refused:
        document.clear_range()
    return done


def fill_range(document: Document, action: str) -> bool:
    """Paint an action over the marked range, and forget the range."""
    if document.range is None:
        return say_no(document, "Mark the range to fill first, with [ and ].")
    start, end = document.range
    done = document.paint(start, end, action)
    if not document.refused:
        document.clear_range()
    return done


def merge(document: Document) -> bool:
    """Make one of the segments in the marked range; without one, of the segment and the next."""
    segments = document.segments
    if document.range is not None:
        start, end = document.range
        first = bisect_right(segments, start + SAME, key=_end)
        last = bisect_left(segments, end - SAME, key=_start) - 1
        if last <= first:
            return say_no(
                document,
                "The marked range must reach into two segments to merge.",
            )
        return document.merge(first, last)
    index = the_segment(document)
    if index is None:
        return say_no(document, "Select the first of the two segments to merge.")
    if index + 1 >= len(segments):
        return say_no(document, "There is no segment after this one to merge with.")
    return document.merge(index, index + 1)


def fill_gaps(document: Document, longest: float) -> bool:
    """Fill gaps of at most `longest` seconds, in the marked range or everywhere.

    The segments on either side grow to the middle of the gap.
    """
    done = document.fill_gaps(longest, None, document.range)
    return done or say_no(
        document,
        f"There is no gap of at most {longest:g} s to fill.",
        trouble=False,
    )


def to_copy(document: Document, author: str, time: float) -> tuple[float, float] | None:
    """What is taken over from another author at a time: start and end in seconds; None for nothing.

    That is the marked range. Without one it is everything while one's own track is empty; later on
    what lies along the selected segment, and elsewhere the other author's segment there.
    """
    other = document.others.get(author, ())
    if document.range is not None:
        return document.range
    if other and not document.segments:
        return document.bounds
    chosen = None if document.selected is None else document.segments[document.selected]
    if chosen is None or not chosen.start - SAME <= time <= chosen.end + SAME:
        index = index_at(other, time)
        chosen = None if index is None else other[index]
    return None if chosen is None else (chosen.start, chosen.end)


def copy_from(document: Document, author: str) -> bool:
    """Take over what another author has at the cursor (:func:`to_copy`)."""
    stretch = to_copy(document, author, document.cursor)
    if stretch is None:
        return say_no(document, f"{author} has no segment at the cursor; mark a range to copy.")
    return document.copy_from(author, *stretch)


def start_to_cursor(document: Document) -> bool:
    """Let the segment start at the cursor; on unlabelled time, the next segment."""
    index = the_segment(document)
    if index is None:
        index = bisect_right(document.segments, document.cursor, key=_start)
    if index >= len(document.segments):
        return say_no(document, "There is no segment after the cursor.")
    return document.move_edge(index, "start", document.cursor)


def end_to_cursor(document: Document) -> bool:
    """Let the segment end at the cursor; on unlabelled time, the previous segment."""
    index = the_segment(document)
    if index is None:
        index = bisect_right(document.segments, document.cursor, key=_end) - 1
    if index < 0:
        return say_no(document, "There is no segment before the cursor.")
    return document.move_edge(index, "end", document.cursor)


def nudge(document: Document, what: Literal["start", "end", "both"], count: int) -> bool:
    """Move an edge of the segment, or all of it, by a step."""
    index = the_segment(document)
    if index is None:
        return say_no(
            document,
            "Select the segment to change: click it, or use K and L.",
        )
    return document.nudge(index, what, count * (FINE_NUDGE if document.fine_nudges else NUDGE))


def set_fine_nudges(document: Document, fine: bool) -> bool:
    """Move edges and segments by finer steps from now on, or by the usual ones."""
    document.fine_nudges = fine
    step = 1000 * (FINE_NUDGE if fine else NUDGE)
    document.say_here(f"Edges move by {step:g} ms.")
    return True


def zoom_selection(document: Document) -> bool:
    """Show the marked range, or else the segment, with something on either side."""
    if document.range is not None:
        zoom_to(document, *document.range)
        return True
    index = the_segment(document)
    if index is None:
        return say_no(document, "Select a segment or mark a range to zoom to.")
    zoom_to(document, document.segments[index].start, document.segments[index].end)
    return True


def zoom_to(document: Document, start: float, end: float) -> None:
    """Show a stretch with something on either side."""
    margin = MARGIN * (end - start)
    low, high = document.bounds
    document.set_span(max(start - margin, low), min(end + margin, high))


def _go(document: Document, index: int) -> bool:
    """Select a segment and go to its start, if there is one."""
    if not 0 <= index < len(document.segments):
        return False
    document.seek(document.segments[index].start)
    document.select(index)
    return True


def _starts_at(document: Document, index: int) -> bool:
    """Whether a segment starts where the cursor is."""
    return abs(document.segments[index].start - document.cursor) <= SAME


def say_no(document: Document, sentence: str, *, trouble: bool = True) -> bool:
    """Say why nothing was done; gives False."""
    document.say_here(sentence, trouble)
    return False
