"""Why commands cannot be carried out now: one answer for keys, menus and toolbar."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from forcelab.errors import ForcelabError
from forcelab.gui.commands import COMMANDS
from forcelab.gui.document import Document
from forcelab.gui.label import segment_commands as segments
from forcelab.segment_edits import index_at, overlapping

#: Before a verdict is given.
CHOOSE_DIFFERENCE = "Choose a difference to judge first, with N."
_NEEDS = {command.id: command.needs for command in COMMANDS}


class Obstacles:
    """Tells what stands in the way of a command, as a sentence; an empty one says that it is free.

    `in_view` says whether the open demonstration can be seen, `others` what stands in the way of
    commands that other parts of the window decide on, by id.
    """

    def __init__(
        self,
        document: Document,
        in_view: Callable[[], bool] = lambda: True,
        others: Mapping[str, Callable[[], str]] | None = None,
    ) -> None:
        self._document, self._in_view = document, in_view
        own = {id_: partial(check, document) for id_, check in _CHECKS.items()}
        self._checks: dict[str, Callable[[], str]] = {**own, **(others or {})}

    def __call__(self, command: str) -> str:
        missing = self._missing(_NEEDS[command])
        check = self._checks.get(command)
        return missing or (check() if check is not None else "")

    def _missing(self, needs: str) -> str:
        """What of all that a command needs is missing."""
        document, project = self._document, self._document.project
        if project is None:
            vacant = needs in ("", "write or new")
            return "" if vacant else "Open or make a project first."
        if needs == "listed" and not document.infos:
            return "There is no demonstration yet; import one first."
        if needs in ("view", "edit") and not self._in_view():
            return "This acts on the demonstration in view; go to Label or Review."
        if needs in ("view", "edit") and document.demonstration is None:
            return "Open a demonstration first."
        if needs in ("write", "write or new", "edit"):
            try:
                project.refuse_read_only()
            except ForcelabError as error:
                return str(error)
        return ""


def _merge(document: Document) -> str:
    if segments.segments_to_merge(document) is not None:
        return ""
    if document.view.range is not None:
        return "The marked range must reach into two segments to merge."
    if segments.current_segment(document) is None:
        return "Select the first of the two segments to merge."
    return "There is no segment after this one to merge with."


def _copy_from(document: Document) -> str:
    authors, cursor = tuple(document.other_tracks), document.view.cursor
    if document.coding_blind:
        return "Other labels are hidden until you are done; nothing copied."
    if not authors:
        return "No other track is shown to copy from."
    if any(segments.copy_candidates(document, author, cursor) for author in authors):
        return ""
    if len(authors) == 1:
        return f"{authors[0]} has no segment at the cursor; mark a range to copy."
    return "No other track has a segment at the cursor; mark a range to copy."


def obstacle_to_accept(document: Document) -> str:
    predicted = index_at(document.review.prediction, document.view.cursor) is not None
    return document.review.obstacle or ("" if predicted else "Nothing is predicted at the cursor.")


def obstacle_to_accept_all(document: Document) -> str:
    inside = overlapping(document.review.prediction, document.view.start, document.view.end)
    predicted = inside.start < inside.stop
    return document.review.obstacle or ("" if predicted else "Nothing is predicted in view.")


def _without(find: Callable[[Document], object | None], sentence: str) -> Callable[[Document], str]:
    """A check that needs what `find` gives, and says a sentence where that is None."""
    return lambda document: sentence if find(document) is None else ""


_NUDGE = _without(
    segments.current_segment, "Select the segment to change: click it, or use K and L."
)
_VERDICT = _without(lambda document: document.review.examined, CHOOSE_DIFFERENCE)
_BEFORE, _AFTER = (f"There is no segment {side} the cursor." for side in ("before", "after"))
#: Checks by the id of their command.
_CHECKS: dict[str, Callable[[Document], str]] = {
    "delete": _without(
        lambda document: document.view.range if document.selected is None else document.selected,
        "Select the segment to delete: click it, or go to it with K and L.",
    ),
    "erase_range": _without(lambda document: document.view.range, segments.MARK_RANGE),
    "split": _without(
        lambda document: index_at(document.editor.segments, document.view.cursor),
        "Move the cursor into the segment to split.",
    ),
    "merge": _merge,
    "fill_gaps": _without(
        lambda document: document.editor.segments or None,
        "You have no segments to fill gaps between.",
    ),
    "copy_from": _copy_from,
    "zoom_selection": _without(segments.selection, "Select a segment or mark a range to zoom to."),
    "previous_segment": _without(segments.find_previous, _BEFORE),
    "next_segment": _without(segments.find_next, _AFTER),
    "end_to_cursor": _without(segments.find_to_end, _BEFORE),
    "start_to_cursor": _without(segments.find_to_start, _AFTER),
    "synchronise": _without(
        lambda document: document.demonstration and document.demonstration.video,
        "There is no video to synchronise here.",
    ),
    "accept": obstacle_to_accept,
    "accept_all": obstacle_to_accept_all,
    **dict.fromkeys(("verdict_human", "verdict_model", "verdict_ambiguous"), _VERDICT),
    **{
        f"{part}_{way}": _NUDGE for part in ("start", "end", "move") for way in ("earlier", "later")
    },
}
