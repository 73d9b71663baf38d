"""What menus, keys and lists do with one segment or one action.

"The segment" is the selected one, or else the one under the cursor.
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
from forcelab.text import task_text


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
            f"Only in {task_text(in_task.tasks[0])}": in_task.tasks,
            f"In all {len(everywhere.tasks)} tasks": everywhere.tasks,
        }
    answers, last = (*choices, "Cancel"), len(choices)
    detail = everywhere.sentences(done=False)
    return choices.get(ask(parent, title, question, detail, answers, default=last, escape=last))


#: How far a key moves an edge or a segment, in seconds, and how far where that is to be finer.
NUDGE, FINE_NUDGE = 0.010, 0.001
#: Without a range.
MARK_RANGE = "Mark a range first, with [ and ]."
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
        document.refuse("That segment was changed elsewhere; check it again.")
        return False
    return verb(index) is not None


def find_previous(document: Document) -> int | None:
    """The last segment that starts before the cursor."""
    index = bisect_left(document.editor.segments, document.view.cursor - SLIVER, key=_start) - 1
    return index if index >= 0 else None


def find_next(document: Document) -> int | None:
    """The first segment that starts after the cursor."""
    segments, cursor = document.editor.segments, document.view.cursor
    index = bisect_right(segments, cursor + SLIVER, key=_start)
    # At first the cursor may stand on the first segment without having been sent there.
    if index and document.selected is None and cursor - segments[index - 1].start <= SLIVER:
        index -= 1
    return index if index < len(segments) else None


def delete_segment(document: Document) -> bool:
    """Delete the selected segment; with none selected, make the marked range unlabelled."""
    if document.selected is not None:
        return document.editor.delete(document.selected) is not None
    return erase_range(document)


def erase_range(document: Document) -> bool:
    """Make the marked range unlabelled, and forget the range."""
    return _on_range(document, document.editor.erase)


def fill_range(document: Document, action: str) -> bool:
    """Paint an action over the marked range, and forget the range."""
    return _on_range(document, lambda start, end: document.editor.paint(start, end, action))


def _on_range(document: Document, verb: Callable[[float, float], Edit | None]) -> bool:
    """Apply a verb to the marked range and forget it, unless the store refuses."""
    if document.view.range is None:  # it may have gone while a dialog was open
        document.refuse(MARK_RANGE)
        return False
    done = verb(*document.view.range) is not None
    if not document.refused:
        document.view.clear_range()
    return done


def segments_to_merge(document: Document) -> tuple[int, int] | None:
    """The first and the last segment in the marked range; without one, the segment and the next."""
    segments, index = document.editor.segments, current_segment(document)
    if document.view.range is not None:
        chosen = overlapping(segments, *document.view.range, SLIVER)
        return (chosen.start, chosen.stop - 1) if chosen.stop - chosen.start > 1 else None
    if index is None or index + 1 >= len(segments):
        return None
    return index, index + 1


def merge_segments(document: Document) -> bool:
    run = segments_to_merge(document)
    return run is not None and document.editor.merge(*run) is not None


def fill_gaps(document: Document, longest: float) -> bool:
    """Fill gaps of at most `longest` seconds, in the marked range or everywhere.

    The segments on either side grow to the middle of the gap.
    """
    if document.editor.fill_gaps(longest, None, document.view.range) is not None:
        return True
    document.show_local_message(f"There is no gap of at most {longest:g} s to fill.")
    return False


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


def copy_span(document: Document, author: str, span: tuple[float, float] | None) -> bool:
    """Copy a span (s) of another track, if any, and offer its author first from now on."""
    if span is None:
        return False
    document.view.copied_from = author
    return document.editor.copy_from(author, *span) is not None


def find_to_start(document: Document) -> int | None:
    """The segment that can start at the cursor: the current one, or else the next."""
    segments, index = document.editor.segments, current_segment(document)
    if index is None:
        index = bisect_right(segments, document.view.cursor, key=_start)
    return index if index < len(segments) else None


def find_to_end(document: Document) -> int | None:
    """The segment that can end at the cursor: the current one, or else the previous."""
    index = current_segment(document)
    if index is None:
        index = bisect_right(document.editor.segments, document.view.cursor, key=_end) - 1
    return index if index >= 0 else None


def edge_to_cursor(document: Document, edge: Literal["start", "end"]) -> bool:
    """Move the start or the end of a segment to the cursor."""
    index = find_to_start(document) if edge == "start" else find_to_end(document)
    if index is None:
        return False
    return document.editor.move_edge(index, edge, document.view.cursor) is not None


def nudge(document: Document, part: Literal["start", "end", "both"], count: int) -> bool:
    """Move an edge of the segment, or all of it, by a number of steps."""
    index, step = current_segment(document), FINE_NUDGE if document.view.fine_nudges else NUDGE
    return index is not None and document.nudge(index, part, count * step)


def switch_fine_nudges(document: Document) -> None:
    """Switch between finer steps and the usual ones."""
    document.view.fine_nudges = not document.view.fine_nudges
    step = 1000 * (FINE_NUDGE if document.view.fine_nudges else NUDGE)
    document.show_local_message(f"Edges move by {step:g} ms.")


def selection(document: Document) -> tuple[float, float] | None:
    """Start and end (s) of the marked range, or else of the segment."""
    index = current_segment(document)
    if document.view.range is not None or index is None:
        return document.view.range
    return document.editor.segments[index].start, document.editor.segments[index].end


def zoom_selection(document: Document) -> None:
    if (selected := selection(document)) is not None:
        zoom_to(document, *selected)


def zoom_to(document: Document, start: float, end: float) -> None:
    """Show a span (s) with a margin on either side."""
    margin = MARGIN * (end - start)
    low, high = document.view.bounds
    document.view.set_span(max(start - margin, low), min(end + margin, high))
