"""All segments of many demonstrations as one table, for statistics."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from forcelab.formats.times import plain_times
from forcelab.formats.tracks import table_text
from forcelab.labels import Track

__all__ = ["Coded", "to_table"]

#: The columns of the table, in this order.
TABLE = (
    *("demonstration", "task", "seconds", "author", "kind", "segment", "action"),
    *("start", "end", "duration"),
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
    """

    demonstration: str
    task: str
    seconds: float
    kind: str
    track: Track


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


def _text(seconds: float) -> str:
    """A length of time without the dust of arithmetic."""
    return repr(round(float(seconds), 9))
