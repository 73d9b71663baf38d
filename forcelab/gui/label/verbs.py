"""What the commands of time and segments do; the window binds them to keys and menus."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from PySide6.QtCore import QPoint
from PySide6.QtWidgets import QApplication, QWidget

from forcelab.gui.document import Document
from forcelab.gui.label import segment_verbs
from forcelab.gui.label.track_menu import ask_longest_gap, copy_menu
from forcelab.gui.label.tracks import TrackPanel
from forcelab.gui.player import Player
from forcelab.gui.typing_guard import typing

__all__ = ["handlers"]


#: How many video frames a larger step is; without video it is this share of the visible span.
LEAP_FRAMES = 10
LEAP_SHARE = 0.02
#: The share of the visible span that one key press pans by.
PAN_SHARE = 0.2
#: What one press of a zoom key makes of the visible span.
ZOOM = 1.5


def handlers(
    document: Document, tracks: TrackPanel, player: Player, window: QWidget
) -> dict[str, Callable[[], object]]:
    """What commands do, by their id in the table (:mod:`forcelab.gui.commands`).

    Parameters
    ----------
    document : Document
        What is looked at and painted on.
    tracks : TrackPanel
        Where a drag may be on that is to be cancelled.
    player : Player
        Plays it.
    window : QWidget
        Above which dialogs and menus open.
    """
    simple = (
        segment_verbs.delete,
        segment_verbs.end_to_cursor,
        segment_verbs.erase_range,
        segment_verbs.merge,
        segment_verbs.next_segment,
        segment_verbs.previous_segment,
        segment_verbs.start_to_cursor,
        segment_verbs.zoom_selection,
    )
    made: dict[str, Callable[[], object]] = {
        verb.__name__: partial(verb, document) for verb in simple
    }
    for what in ("start", "end", "both"):
        name = "move" if what == "both" else what
        made[f"{name}_earlier"] = partial(segment_verbs.nudge, document, what, -1)
        made[f"{name}_later"] = partial(segment_verbs.nudge, document, what, 1)
    return {
        **made,
        "play": player.toggle,
        "play_segment": player.play_current,
        "slower": player.slower,
        "faster": player.faster,
        "normal_speed": player.normal_speed,
        "zoom_in": lambda: document.zoom(1 / ZOOM, document.cursor),
        "zoom_out": lambda: document.zoom(ZOOM, document.cursor),
        "zoom_fit": document.fit,
        "range_in": document.mark_in,
        "range_out": document.mark_out,
        "undo": document.undo,
        "redo": document.redo,
        "fine_nudges": lambda: segment_verbs.set_fine_nudges(document, not document.fine_nudges),
        "snapping": lambda: document.set_snapping(not document.snapping),
        "split": lambda: document.split(document.cursor),
        "fill_gaps": partial(_fill_gaps, document, window),
        "copy_from": partial(_copy, document, tracks),
        "cancel": partial(_cancel, document, tracks),
        "step_back": partial(document.step, -1),
        "step_forward": partial(document.step, 1),
        "leap_back": partial(_leap, document, -1),
        "leap_forward": partial(_leap, document, 1),
        "pan_left": partial(_pan, document, -PAN_SHARE),
        "pan_right": partial(_pan, document, PAN_SHARE),
        "to_start": lambda: document.seek(document.bounds[0]),
        "to_end": lambda: document.seek(document.bounds[1]),
    }


def _cancel(document: Document, tracks: TrackPanel) -> None:
    """Take back the last thing begun: typing, a drag, a stroke, a range, a selection, a brush."""
    field = QApplication.focusWidget()
    if field is not None and typing(field):
        field.clearFocus()  # where keys are text, the next one would not paint
    elif tracks.dragging:
        tracks.cancel_drag()
    elif document.stroke is not None:
        document.cancel_stroke()
    elif document.range is not None or document.range_in is not None:
        document.clear_range()
    elif document.selected is not None:
        document.select(None)
    else:
        document.set_action(None)


def _fill_gaps(document: Document, window: QWidget) -> None:
    """Ask how long a gap may be that is filled, if there is anything to fill."""
    if document.segments:
        ask_longest_gap(window, document)
    else:
        document.say("There are no segments of yours to fill gaps between.")


def _leap(document: Document, direction: int) -> None:
    """Make a larger step."""
    demonstration, frames = document.demonstration, document.frame_times
    if demonstration is None:
        return
    count = LEAP_FRAMES
    if frames is None or not len(frames):
        samples = LEAP_SHARE * (document.end - document.start) / demonstration.period
        count = max(count, round(samples))
    document.step(direction * count)


def _pan(document: Document, share: float) -> None:
    """Show earlier or later time."""
    document.pan(share * (document.end - document.start))


def _copy(document: Document, tracks: TrackPanel) -> None:
    """Copy from the only other author at once; from one of several, ask which."""
    authors = tuple(document.others)
    if document.coding_blind:
        document.say(
            "Other labels are hidden until you are done; nothing copied.",
            True,
        )
        return
    if len(authors) == 1:
        segment_verbs.copy_from(document, authors[0])
    elif any(segment_verbs.to_copy(document, author, document.cursor) for author in authors):
        menu = copy_menu(tracks, document, document.cursor)
        tracks.show_menu(menu, tracks.mapToGlobal(QPoint(tracks.GUTTER, 0)))
    elif authors:
        sentence = "No other track has a segment at the cursor; mark a range to copy."
        segment_verbs.say_no(document, sentence)
    else:
        document.say("No other track is shown to copy from.", True)
