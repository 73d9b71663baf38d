"""Tracks as text: as CSV with every author, and as a label track for Audacity."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Sequence

import numpy as np

from forcelab.errors import InputError
from forcelab.formats.times import plain_times
from forcelab.labels import Track

__all__ = ["COLUMNS", "plain_text", "quoted_text", "table_text", "to_audacity", "to_csv"]

#: The columns of the CSV, in this order.
COLUMNS = ("start", "end", "action", "author")

#: Texts that spreadsheets take for formulas, and run; with what is quoted already, so that
#: :func:`plain_text` undoes exactly one quote.
_FORMULA = re.compile(r"'*[=+\-@\t\r\n]")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)


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
    rows = (
        (*map(repr, times), segment.action, track.author)
        for track in tracks
        for segment, times in plain_times(track)
    )
    return table_text(COLUMNS, rows)


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
    for segment, times in plain_times(track):
        if "\t" in segment.action or segment.action.splitlines() != [segment.action]:
            raise InputError(
                f"The action {segment.action!a} holds a tab or a line break, which an "
                f"Audacity label track cannot hold; rename the action or write CSV."
            )
        start, end = (np.format_float_positional(time, unique=True, min_digits=6) for time in times)
        lines.append(f"{start}\t{end}\t{segment.action}\n")
    return "".join(lines)


def quoted_text(text: str) -> str:
    """A name as a cell that no spreadsheet runs as a formula: with an apostrophe in front.

    Names that begin with ``=``, ``+``, ``-``, ``@``, a tab or a line break get one, unless they
    are numbers.
    """
    return f"'{text}" if _FORMULA.match(text) and not _NUMBER.fullmatch(text) else text


def plain_text(cell: str) -> str:
    """The name that :func:`quoted_text` made a cell of."""
    return cell[1:] if cell[:1] == "'" and _FORMULA.match(cell) else cell


def table_text(header: Sequence[str], rows: Iterable[Sequence[str]], separator: str = ",") -> str:
    """A table as text, without formulas; refused where a name holds a NUL."""
    text = io.StringIO()
    writer = csv.writer(text, delimiter=separator)
    writer.writerow(header)
    for row in rows:
        for cell in row:
            if "\0" in cell:
                raise InputError(
                    f"The name {cell!a} holds a NUL, which a text table cannot hold; rename it."
                )
        writer.writerow(map(quoted_text, row))
    return text.getvalue()
