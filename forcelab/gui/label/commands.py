"""The commands of the Label workspace."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from PySide6.QtCore import QPoint
from PySide6.QtWidgets import QApplication, QWidget

from forcelab.gui.document import Document
from forcelab.gui.key_events import is_typing
from forcelab.gui.label import segment_commands
from forcelab.gui.label.playback import Player
from forcelab.gui.label.segment_panel import SegmentPanel
from forcelab.gui.label.track_menus import ask_largest_gap, copy_menu
from forcelab.gui.label.tracks import TrackPanel

#: How many video frames a larger step is; without video it is this share of the visible span.
JUMP_FRAMES = 10
JUMP_SHARE = 0.02
#: The share of the visible span that one key press pans by.
PAN_SHARE = 0.2
#: What one press of a zoom key makes of the visible span.
ZOOM = 1.5


def handlers(
    document: Document, tracks: TrackPanel, player: Player, window: QWidget
) -> dict[str, Callable[[], object]]:
    """What commands do, by their id in the table (:mod:`forcelab.gui.commands`).

    Dialogs and menus open above `window`; cancelling ends a drag in any of its panels.
    """
    nudges: dict[str, Callable[[], object]] = {}
    for part in ("start", "end", "both"):
        name = "move" if part == "both" else part
        nudges[f"{name}_earlier"] = partial(segment_commands.nudge, document, part, -1)
        nudges[f"{name}_later"] = partial(segment_commands.nudge, document, part, 1)
    return {
        **nudges,
        "previous_segment": partial(_go_to, document, segment_commands.find_previous),
        "next_segment": partial(_go_to, document, segment_commands.find_next),
        "delete": partial(segment_commands.delete_segment, document),
        "erase_range": partial(segment_commands.erase_range, document),
        "merge": partial(segment_commands.merge_segments, document),
        "start_to_cursor": partial(segment_commands.edge_to_cursor, document, "start"),
        "end_to_cursor": partial(segment_commands.edge_to_cursor, document, "end"),
        "zoom_selection": partial(segment_commands.zoom_selection, document),
        "play": player.toggle,
        "play_segment": player.play_current,
        "slower": player.slower,
        "faster": player.faster,
        "normal_speed": player.normal_speed,
        "zoom_in": lambda: document.view.zoom(1 / ZOOM, document.view.cursor),
        "zoom_out": lambda: document.view.zoom(ZOOM, document.view.cursor),
        "zoom_fit": document.view.fit,
        "range_in": document.view.mark_in,
        "range_out": document.view.mark_out,
        "fine_nudges": partial(segment_commands.switch_fine_nudges, document),
        "snapping": lambda: document.view.set_snapping(not document.view.snapping),
        "split": lambda: document.editor.split(document.view.cursor),
        "fill_gaps": partial(ask_largest_gap, window, document),
        "copy_from": partial(_copy, document, tracks),
        "cancel": partial(_cancel, document, window),
        "step_back": partial(document.view.step, -1),
        "step_forward": partial(document.view.step, 1),
        "leap_back": partial(_jump, document, -1),
        "leap_forward": partial(_jump, document, 1),
        "pan_left": partial(_pan, document, -PAN_SHARE),
        "pan_right": partial(_pan, document, PAN_SHARE),
        "to_start": lambda: document.view.seek(document.view.bounds[0]),
        "to_end": lambda: document.view.seek(document.view.bounds[1]),
    }


def _cancel(document: Document, window: QWidget) -> None:
    """Cancel the last thing begun: typing, a drag, a stroke, a range, a selection, a brush."""
    field = QApplication.focusWidget()
    if field is not None and is_typing(field):
        field.clearFocus()  # where keys are text, the next one would not paint
    elif dragged := [p for p in window.findChildren(SegmentPanel) if p.dragging]:
        dragged[0].cancel_drag()
    elif document.stroke is not None:
        document.cancel_stroke()
    elif document.view.range is not None or document.view.range_start is not None:
        document.view.clear_range()
    elif document.selected is not None:
        document.select(None)
    else:
        document.set_action(None)


def _go_to(document: Document, find: Callable[[Document], int | None]) -> None:
    """Select the segment that is found, and go to its start."""
    if (index := find(document)) is not None:
        document.view.seek(document.editor.segments[index].start)
        document.select(index)


def _jump(document: Document, direction: int) -> None:
    demonstration, frames = document.demonstration, document.view.frame_times
    if demonstration is None:
        return
    count = JUMP_FRAMES
    if frames is None or not len(frames):
        samples = JUMP_SHARE * (document.view.end - document.view.start) / demonstration.period
        count = max(count, round(samples))
    document.view.step(direction * count)


def _pan(document: Document, share: float) -> None:
    document.view.pan(share * (document.view.end - document.view.start))


def _copy(document: Document, tracks: TrackPanel) -> None:
    """Copy from the only other author at once; from one of several, ask which."""
    authors = tuple(document.other_tracks)
    if len(authors) > 1:
        menu = copy_menu(tracks, document, document.view.cursor)
        tracks.show_menu(menu, tracks.mapToGlobal(QPoint(tracks.gutter, 0)))
    elif authors:
        span = segment_commands.copy_candidates(document, authors[0], document.view.cursor)
        segment_commands.copy_span(document, authors[0], span)
