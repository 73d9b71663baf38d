"""Tracks as text: as CSV with every author, and as a label track for Audacity."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable

import numpy as np

from forcelab.errors import InputError
from forcelab.formats.times import plain_times
from forcelab.labels import Track

__all__ = ["to_audacity", "to_csv"]

#: The columns of the CSV, in this order.
COLUMNS = ("start", "end", "action", "author")


def to_csv(tracks: Iterable[Track]) -> str:
    """The segments of all tracks as CSV (RFC 4180).

    Parameters
    ----------
    tracks : iterable of Track
        Of one demonstration. Tracks follow one another as given, segments in order of time.

    Returns
    -------
    str
        A header and one line a segment, ``start,end,action,author``; times in seconds as of
        :func:`~forcelab.formats.times.plain_times`, with as many digits as tell them exactly.

    Raises
    ------
    InputError
        If a name holds a NUL, which a text table cannot hold.
    """
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(COLUMNS)
    for track in tracks:
        pairs = zip(track.segments, plain_times(track.segments), strict=True)
        for segment, times in pairs:
            if "\0" in segment.action + track.author:
                raise InputError(
                    f"The name {segment.action!a} of {track.author!a} holds a NUL, which a text "
                    f"table cannot hold; rename the action or its author."
                )
            writer.writerow([*map(repr, times), segment.action, track.author])
    return text.getvalue()


def to_audacity(track: Track) -> str:
    """One track as an Audacity label track; such a file has no place for the author.

    Parameters
    ----------
    track : Track
        What to write.

    Returns
    -------
    str
        One line a segment, start and end in seconds and the action, separated by tabs; times as
        of :func:`to_csv`, without an exponent and with at least six decimals.

    Raises
    ------
    InputError
        If an action holds a tab or a line break, which a label track cannot hold.
    """
    lines = []
    for segment, times in zip(track.segments, plain_times(track.segments), strict=True):
        if "\t" in segment.action or segment.action.splitlines() != [segment.action]:
            raise InputError(
                f"The action {segment.action!a} holds a tab or a line break, which an "
                f"Audacity label track cannot hold; rename the action or write CSV."
            )
        start, end = (np.format_float_positional(time, unique=True, min_digits=6) for time in times)
        lines.append(f"{start}\t{end}\t{segment.action}\n")
    return "".join(lines)
