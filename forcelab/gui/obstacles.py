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


def _delete(document: Document) -> str:
    if document.selected is not None or document.view.range is not None:
        return ""
    return "Select the segment to delete: click it, or go to it with K and L."


def _erase_range(document: Document) -> str:
    return "" if document.view.range is not None else segments.MARK_RANGE


def _split(document: Document) -> str:
    index = index_at(document.editor.segments, document.view.cursor)
    return "" if index is not None else "Move the cursor into the segment to split."


def _merge(document: Document) -> str:
    if segments.segments_to_merge(document) is not None:
        return ""
    if document.view.range is not None:
        return "The marked range must reach into two segments to merge."
    if segments.current_segment(document) is None:
        return "Select the first of the two segments to merge."
    return "There is no segment after this one to merge with."


def _fill_gaps(document: Document) -> str:
    return "" if document.editor.segments else "You have no segments to fill gaps between."


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


def _nudge(document: Document) -> str:
    if segments.current_segment(document) is not None:
        return ""
    return "Select the segment to change: click it, or use K and L."


def _zoom_selection(document: Document) -> str:
    selected = segments.selection(document) is not None
    return "" if selected else "Select a segment or mark a range to zoom to."


def _before(find: Callable[[Document], int | None], document: Document) -> str:
    return "" if find(document) is not None else "There is no segment before the cursor."


def _after(find: Callable[[Document], int | None], document: Document) -> str:
    return "" if find(document) is not None else "There is no segment after the cursor."


def _synchronise(document: Document) -> str:
    demonstration = document.demonstration
    filmed = demonstration is not None and demonstration.video is not None
    return "" if filmed else "There is no video to synchronise here."


def obstacle_to_accept(document: Document) -> str:
    predicted = index_at(document.review.prediction, document.view.cursor) is not None
    return document.review.obstacle or ("" if predicted else "Nothing is predicted at the cursor.")


def obstacle_to_accept_all(document: Document) -> str:
    inside = overlapping(document.review.prediction, document.view.start, document.view.end)
    predicted = inside.start < inside.stop
    return document.review.obstacle or ("" if predicted else "Nothing is predicted in view.")


def _verdict(document: Document) -> str:
    return "" if document.review.examined is not None else CHOOSE_DIFFERENCE


#: Checks by the id of their command.
_CHECKS: dict[str, Callable[[Document], str]] = {
    "delete": _delete,
    "erase_range": _erase_range,
    "split": _split,
    "merge": _merge,
    "fill_gaps": _fill_gaps,
    "copy_from": _copy_from,
    "zoom_selection": _zoom_selection,
    "previous_segment": partial(_before, segments.find_previous),
    "next_segment": partial(_after, segments.find_next),
    "end_to_cursor": partial(_before, segments.find_to_end),
    "start_to_cursor": partial(_after, segments.find_to_start),
    "synchronise": _synchronise,
    "accept": obstacle_to_accept,
    "accept_all": obstacle_to_accept_all,
    **{f"verdict_{kind}": _verdict for kind in ("human", "model", "ambiguous")},
    **{
        f"{part}_{way}": _nudge for part in ("start", "end", "move") for way in ("earlier", "later")
    },
}
