"""Tracks as text: CSV with every author, a label track for Audacity, a table for statistics."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.labels import Segment, Track
from forcelab.segment_edits import SLIVER

#: Decimals that are enough for times on microseconds.
DECIMALS = 6
#: How far a time on microseconds lies from what it rounds (s), and what arithmetic adds.
ROUNDING = 0.5 * 10**-DECIMALS + SLIVER


def plain_times(track: Track, within: float = SLIVER) -> list[tuple[Segment, tuple[float, float]]]:
    """Each segment with start and end times (s) whose shortest text is what a person would write.

    Arithmetic leaves 4.6899999999999995 where 4.69 is right: times `within` so many seconds of a
    microsecond are that microsecond, unless that would leave nothing of a segment. Read by
    :func:`on_samples`, 4.69 is the same sample again.
    """
    times = [(_plain(s.start, within), _plain(s.end, within)) for s in track.segments]
    if not all(start < end for start, end in times):
        times = [(float(s.start), float(s.end)) for s in track.segments]
    return list(zip(track.segments, times, strict=True))


def _plain(time: float, within: float) -> float:
    """The microsecond on which a time lies, or the time."""
    rounded = _microseconds(time)
    return rounded if abs(rounded - time) <= within else float(time)


def on_samples(tracks: Iterable[Track], times: NDArray[np.float64]) -> tuple[Track, ...]:
    """Put edges that were rounded to the microsecond nearest to a sample onto its exact stamp.

    A track that would lose a segment by it stays as it was.
    """
    result = []
    for track in tracks:
        edges = edges_of(track)
        samples = nearest(edges, times)
        moved = np.where(abs(samples - edges) <= ROUNDING, samples, edges)
        whole = (moved[:, 0] < moved[:, 1]).all()
        result.append(with_edges(track, moved) if whole else track)
    return tuple(result)


def edges_of(track: Track) -> NDArray[np.float64]:
    """Starts and ends (s) of a track's segments, shape (n, 2)."""
    return np.array([(s.start, s.end) for s in track.segments]).reshape(-1, 2)


def with_edges(track: Track, edges: NDArray[np.float64]) -> Track:
    """A track with other starts and ends of its segments."""
    pairs = zip(track.segments, edges.tolist(), strict=True)
    return Track(track.author, tuple(Segment(start, end, s.action) for s, (start, end) in pairs))


def nearest(values: NDArray[np.float64], known: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of some rising values the one that is nearest to each value."""
    after = np.searchsorted(known, values)
    lower, upper = known[np.maximum(after - 1, 0)], known[np.minimum(after, len(known) - 1)]
    return np.where(values - lower < upper - values, lower, upper)


#: The columns of the CSV, in this order.
COLUMNS = ("start", "end", "action", "author")

#: Texts that spreadsheets take for formulas, and run; with what is quoted already, so that
#: :func:`plain_text` undoes exactly one quote.
_FORMULA = re.compile(r"'*[=+\-@\t\r\n]")
_NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)


def to_csv(tracks: Iterable[Track]) -> str:
    """The segments of all tracks of a demonstration as CSV (RFC 4180): ``start,end,action,author``.

    Times are seconds as of :func:`plain_times`, with as many digits as tell them exactly.
    """
    rows = (
        (*map(repr, times), segment.action, track.author)
        for track in tracks
        for segment, times in plain_times(track)
    )
    return table_text(COLUMNS, rows)


def to_audacity(track: Track) -> str:
    """One track as an Audacity label track, which has no place for the author.

    Times are as of :func:`to_csv`, without an exponent and with at least six decimals.
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


#: The columns of the table, in this order.
TABLE_COLUMNS = (
    *("demonstration", "task", "seconds", "author", "kind", "segment", "action"),
    *("start", "end", "duration", "proposed_by"),
)


@dataclass(frozen=True, slots=True)
class AnnotatedTrack:
    demonstration: str
    task: str
    seconds: float  #: length of the demonstration
    kind: str  #: of its author: coder or model
    track: Track
    #: Of segments that a coder accepted, the model that proposed them
    proposers: Mapping[Segment, str] = field(default_factory=dict)


def to_statistics_table(tracks: Iterable[AnnotatedTrack]) -> str:
    """One line a segment, as CSV (RFC 4180).

    ``seconds`` is the length of the demonstration, ``segment`` counts from 1 in each track, times
    are in seconds of the force clock, to a microsecond unless that would leave nothing of a segment
    of the track. ``proposed_by`` is empty where the label is the coder's own.
    """
    rows = [
        (
            *(coded.demonstration, coded.task, repr(_microseconds(coded.seconds))),
            *(coded.track.author, coded.kind, str(number), segment.action),
            *(repr(start), repr(end), repr(_microseconds(end - start) or end - start)),
            coded.proposers.get(segment, ""),
        )
        for coded in tracks
        for number, (segment, (start, end)) in enumerate(
            plain_times(coded.track, within=ROUNDING), start=1
        )
    ]
    return table_text(TABLE_COLUMNS, rows)


def _microseconds(seconds: float) -> float:
    return round(float(seconds), DECIMALS)
