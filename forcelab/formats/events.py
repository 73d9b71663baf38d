"""All segments of many demonstrations as one table: for statistics, or as BORIS writes them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime

from forcelab.formats.times import plain_times
from forcelab.formats.tracks import table_text
from forcelab.labels import Track

__all__ = ["Coded", "to_boris", "to_table"]

#: The columns of the table, in this order.
TABLE = (
    *("demonstration", "task", "seconds", "author", "kind", "segment", "action"),
    *("start", "end", "duration"),
)
#: Those of BORIS's aggregated events.
BORIS = (
    *("Observation id", "Observation date", "Description", "Media file", "Total length", "FPS"),
    *("Subject", "Behavior", "Behavioral category", "Modifiers", "Behavior type"),
    *("Start (s)", "Stop (s)", "Duration (s)", "Comment start", "Comment stop"),
)


@dataclass(frozen=True, slots=True)
class Coded:
    """A track of one demonstration.

    Parameters
    ----------
    demonstration, task : str
        Their names.
    seconds : float
        Length of the demonstration.
    kind : "coder" or "model"
        Who the track's author is.
    track : Track
        What was labelled.
    video : str
        The demonstration's video file; empty where there is none.
    fps : float
        Its frames a second, as it says itself; 0 where that is not known.
    begun : datetime, optional
        When the coder began.
    """

    demonstration: str
    task: str
    seconds: float
    kind: str
    track: Track
    video: str = ""
    fps: float = 0.0
    begun: datetime | None = None


def to_table(coded: Iterable[Coded]) -> str:
    """One line a segment, as CSV (RFC 4180).

    Returns
    -------
    str
        With a header. ``seconds`` is the length of the demonstration, ``segment`` counts from 1
        in each track, times are in seconds of the force clock.

    Raises
    ------
    InputError
        If a name holds a NUL, which a text table cannot hold.
    """
    rows = [
        (
            *(one.demonstration, one.task, _text(one.seconds), one.track.author, one.kind),
            *(str(number), segment.action, repr(start), repr(end), _text(end - start)),
        )
        for one in coded
        for number, (segment, (start, end)) in enumerate(plain_times(one.track), start=1)
    ]
    return table_text(TABLE, rows)


def to_boris(coded: Iterable[Coded]) -> str:
    """The aggregated events that BORIS exports, separated by tabs.

    Returns
    -------
    str
        Each track is an observation and each segment a state event; times are in seconds of the
        force clock. The observation's date is that of the track's first edit, the media file is
        the project's copy. What forcelab does not know is empty.

    Raises
    ------
    InputError
        As :func:`to_table`.
    """
    rows = [
        (
            *(f"{one.demonstration} - {one.track.author}", _date(one.begun), one.task, one.video),
            *(_text(one.seconds), f"{one.fps:.6g}" if one.fps > 0 else "", "No focal subject"),
            *(segment.action, "", "", "STATE"),
            *(repr(start), repr(end), _text(end - start), "", ""),
        )
        for one in coded
        for segment, (start, end) in plain_times(one.track)
    ]
    return table_text(BORIS, rows, "\t")


def _date(when: datetime | None) -> str:
    """A date and time as BORIS writes them, by the clock on the wall."""
    return "" if when is None else when.astimezone().strftime("%Y-%m-%d %H:%M:%S")


def _text(seconds: float) -> str:
    """A length of time without the dust of arithmetic."""
    return repr(round(float(seconds), 9))
