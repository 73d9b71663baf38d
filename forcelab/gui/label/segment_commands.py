"""What menus, keys and lists do with one segment or one action.

"The segment" is the selected one, or else the one under the cursor. A command that does nothing
says why.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Collection
from operator import attrgetter
from typing import Literal

from PySide6.QtWidgets import QWidget

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.text import ask
from forcelab.labels import Segment
from forcelab.project import Edit
from forcelab.project.actions import ActionRename
from forcelab.segment_edits import SLIVER, index_at, overlapping


def rename_action(document: Document, name: str, new: str, parent: QWidget) -> bool:
    """Rename an action of the open demonstration's task in all of the coder's tracks.

    Asks first where it is merged into another action, and where the coder's segments in other
    tasks have it too.
    """
    project, demonstration = document.project, document.demonstration
    if project is None or demonstration is None:
        return False
    task = demonstration.task
    try:
        project.refuse_read_only()  # before anything is asked
        if name not in project.actions.vocabulary(task) and name not in project.actions.painted(
            task
        ):
            document.refuse(f"'{name}' is only predicted; it disappears when you train again.")
            return False
        in_task = project.actions.preview_rename(document.author, name, new, (task,))
        everywhere = project.actions.preview_rename(document.author, name, new)
    except ForcelabError as error:
        document.refuse(str(error))
        return False
    tasks: Collection[str] | None = in_task.tasks
    if everywhere.merges or everywhere.tasks != in_task.tasks:
        tasks = _confirm_rename(in_task, everywhere, parent)
    if tasks is None:
        return False
    return document.rename_action(name, new, tasks, merge=everywhere.merges)


def _confirm_rename(
    in_task: ActionRename, everywhere: ActionRename, parent: QWidget
) -> Collection[str] | None:
    """Ask whether to rename an action, and in which tasks; None to leave it."""
    old, new = everywhere.old, everywhere.new
    title, question = "Rename action", f"Rename '{old}' to '{new}' in other tasks, too?"
    if everywhere.merges:
        title, question = "Merge actions", f"Merge '{old}' into '{new}'?"
    choices = {"Merge": everywhere.tasks}
    if everywhere.tasks != in_task.tasks:
        choices = {
            f"Only in {in_task.tasks[0] or 'no task'}": in_task.tasks,
            f"In all {len(everywhere.tasks)} tasks": everywhere.tasks,
        }
    answers, last = (*choices, "Cancel"), len(choices)
    detail = everywhere.sentences(done=False)
    return choices.get(ask(parent, title, question, detail, answers, default=last, escape=last))


#: How far a key moves an edge or a segment, in seconds, and how far where that is to be finer.
NUDGE, FINE_NUDGE = 0.010, 0.001
#: What is left free on either side of a segment that is zoomed to, as a share of it.
MARGIN = 0.25

_start = attrgetter("start")
_end = attrgetter("end")


def current_segment(document: Document) -> int | None:
    """The selected segment, or else the one under the cursor."""
    if document.selected is not None:
        return document.selected
    return index_at(document.editor.segments, document.view.cursor)


def for_current_segment(
    document: Document, segment: Segment, verb: Callable[[int], Edit | None]
) -> bool:
    """Apply a verb to one of the coder's segments by its current index, which may have changed."""
    index = document.editor.index_of(segment)
    if index is None:
        sentence = "That segment was changed elsewhere; check it again."
        return report_refusal(document, sentence)
    return verb(index) is not None


def previous_segment(document: Document) -> bool:
    """Select the last segment that starts before the cursor, and go to its start."""
    index = bisect_left(document.editor.segments, document.view.cursor - SLIVER, key=_start) - 1
    return _seek_to(document, index) or report_refusal(
        document, "There is no segment before the cursor."
    )


def next_segment(document: Document) -> bool:
    """Select the first segment that starts after the cursor, and go to its start."""
    index = bisect_right(document.editor.segments, document.view.cursor + SLIVER, key=_start)
    # At first the cursor may stand on the first segment without having been sent there.
    if index and document.selected is None and _starts_at_cursor(document, index - 1):
        index -= 1
    return _seek_to(document, index) or report_refusal(
        document, "There is no segment after the cursor."
    )


def delete_segment(document: Document) -> bool:
    """Delete the selected segment; with none selected, make the marked range unlabelled."""
    if document.selected is not None:
        return document.editor.delete(document.selected) is not None
    if document.view.range is not None:
        return erase_range(document)
    return report_refusal(
        document, "Select the segment to delete: click it, or go to it with K and L."
    )


def erase_range(document: Document) -> bool:
    """Make the marked range unlabelled, and forget the range."""
    if document.view.range is None:
        return report_refusal(document, "Mark the range to erase first, with [ and ].")
    start, end = document.view.range
    done = document.editor.erase(start, end) is not None
    if not document.refused:
        document.view.clear_range()
    return done


def fill_range(document: Document, action: str) -> bool:
    """Paint an action over the marked range, and forget the range."""
    if document.view.range is None:
        return report_refusal(document, "Mark the range to fill first, with [ and ].")
    start, end = document.view.range
    done = document.editor.paint(start, end, action) is not None
    if not document.refused:
        document.view.clear_range()
    return done


def merge_segments(document: Document) -> bool:
    """Merge the segments in the marked range; without one, the segment and the next."""
    segments = document.editor.segments
    if document.view.range is not None:
        chosen = overlapping(segments, *document.view.range, SLIVER)
        first, last = chosen.start, chosen.stop - 1
        if last <= first:
            return report_refusal(
                document, "The marked range must reach into two segments to merge."
            )
        return document.editor.merge(first, last) is not None
    index = current_segment(document)
    if index is None:
        return report_refusal(document, "Select the first of the two segments to merge.")
    if index + 1 >= len(segments):
        return report_refusal(document, "There is no segment after this one to merge with.")
    return document.editor.merge(index, index + 1) is not None


def fill_gaps(document: Document, longest: float) -> bool:
    """Fill gaps of at most `longest` seconds, in the marked range or everywhere.

    The segments on either side grow to the middle of the gap.
    """
    if document.editor.fill_gaps(longest, None, document.view.range) is not None:
        return True
    return report_refusal(
        document, f"There is no gap of at most {longest:g} s to fill.", trouble=False
    )


def copy_candidates(document: Document, author: str, time: float) -> tuple[float, float] | None:
    """The span (s) to copy from another author at a time; None for nothing.

    That is the marked range. Without one it is everything while the coder's track is empty; later
    on what lies along the selected segment, and elsewhere the other author's segment there.
    """
    other = document.other_tracks.get(author, ())
    if document.view.range is not None:
        return document.view.range
    if other and not document.editor.segments:
        return document.view.bounds
    chosen = None if document.selected is None else document.editor.segments[document.selected]
    if chosen is None or not chosen.start - SLIVER <= time <= chosen.end + SLIVER:
        index = index_at(other, time)
        chosen = None if index is None else other[index]
    return None if chosen is None else (chosen.start, chosen.end)


def copy_from(document: Document, author: str) -> bool:
    """Copy what another author has at the cursor (:func:`copy_candidates`)."""
    stretch = copy_candidates(document, author, document.view.cursor)
    if stretch is None:
        return report_refusal(
            document, f"{author} has no segment at the cursor; mark a range to copy."
        )
    return copy_interval(document, author, *stretch)


def copy_interval(document: Document, author: str, start: float, end: float) -> bool:
    """Copy an interval of another track, and offer its author first from now on."""
    document.view.copied_from = author
    return document.editor.copy_from(author, start, end) is not None


def start_to_cursor(document: Document) -> bool:
    """Move the segment's start to the cursor; on unlabelled time, that of the next segment."""
    index = current_segment(document)
    if index is None:
        index = bisect_right(document.editor.segments, document.view.cursor, key=_start)
    if index >= len(document.editor.segments):
        return report_refusal(document, "There is no segment after the cursor.")
    return document.editor.move_edge(index, "start", document.view.cursor) is not None


def end_to_cursor(document: Document) -> bool:
    """Move the segment's end to the cursor; on unlabelled time, that of the previous segment."""
    index = current_segment(document)
    if index is None:
        index = bisect_right(document.editor.segments, document.view.cursor, key=_end) - 1
    if index < 0:
        return report_refusal(document, "There is no segment before the cursor.")
    return document.editor.move_edge(index, "end", document.view.cursor) is not None


def nudge(document: Document, part: Literal["start", "end", "both"], count: int) -> bool:
    """Move an edge of the segment, or all of it, by a number of steps."""
    index = current_segment(document)
    if index is None:
        return report_refusal(document, "Select the segment to change: click it, or use K and L.")
    return document.nudge(index, part, count * (FINE_NUDGE if document.view.fine_nudges else NUDGE))


def set_fine_nudges(document: Document, fine: bool) -> bool:
    """Switch between finer steps and the usual ones."""
    document.view.fine_nudges = fine
    step = 1000 * (FINE_NUDGE if fine else NUDGE)
    document.show_local_message(f"Edges move by {step:g} ms.")
    return True


def zoom_selection(document: Document) -> bool:
    """Zoom to the marked range, or else to the segment."""
    if document.view.range is not None:
        zoom_to(document, *document.view.range)
        return True
    index = current_segment(document)
    if index is None:
        return report_refusal(document, "Select a segment or mark a range to zoom to.")
    zoom_to(document, document.editor.segments[index].start, document.editor.segments[index].end)
    return True


def zoom_to(document: Document, start: float, end: float) -> None:
    """Show a span (s) with a margin on either side."""
    margin = MARGIN * (end - start)
    low, high = document.view.bounds
    document.view.set_span(max(start - margin, low), min(end + margin, high))


def _seek_to(document: Document, index: int) -> bool:
    """Select a segment and go to its start, if there is one."""
    if not 0 <= index < len(document.editor.segments):
        return False
    document.view.seek(document.editor.segments[index].start)
    document.select(index)
    return True


def _starts_at_cursor(document: Document, index: int) -> bool:
    return abs(document.editor.segments[index].start - document.view.cursor) <= SLIVER


def report_refusal(document: Document, sentence: str, *, trouble: bool = True) -> bool:
    """Say why nothing was done; gives False."""
    if trouble:
        document.refuse(sentence)
    else:
        document.show_local_message(sentence)
    return False
