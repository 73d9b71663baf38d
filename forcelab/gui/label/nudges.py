"""Nudges: an edge, or a whole segment, moves by one video frame or sample."""

from __future__ import annotations

from bisect import bisect_left
from operator import attrgetter
from typing import Literal

from PySide6.QtCore import QCoreApplication

from forcelab.gui.document import Document
from forcelab.gui.label.segment_verbs import SAME, say_no, the_segment

translate = QCoreApplication.translate

__all__ = ["nudge"]

_start = attrgetter("start")
_end = attrgetter("end")


def nudge(document: Document, what: Literal["start", "end", "both"], count: int) -> bool:
    """Move an edge of the segment, or all of it, by a step; the cursor goes with the edge."""
    index = the_segment(document)
    if index is None:
        return say_no(
            document,
            translate("forcelab", "Select the segment to change: click it, or use K and L."),
        )
    old = document.segments[index]
    at = old.end if what == "end" else old.start
    low, high = document.bounds
    time = min(
        max(document.stepped(at, count), low), high - (old.duration if what == "both" else 0)
    )
    if what == "both":
        done = document.move_segment(index, time)
    else:
        done = document.move_edge(index, what, time)
    if done:
        document.seek(time)
        # What it grew over may have gone, so that it has another number now.
        edge = _end if what == "end" else _start
        document.select(bisect_left(document.segments, time - SAME, key=edge))
    return done
