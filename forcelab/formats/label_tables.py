"""Labels in files of their own: tables of start, end, action[, author]; Audacity's."""

from __future__ import annotations

import errno
import re
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.formats.label_files import LabelOptions, LabelSet, own_stem
from forcelab.formats.recording import ReadOptions
from forcelab.formats.table_sniff import (
    HEAD,
    CellType,
    Layout,
    Line,
    NotANumberError,
    encoding_of,
    find_layout,
    head_lines,
    is_comment,
    is_label_name,
    lines,
    numbers,
    unit_of_time,
)
from forcelab.formats.timestamps import YEAR_2001, TimestampReader
from forcelab.formats.track_text import edges_of, on_samples, plain_text, with_edges
from forcelab.labels import Segment, Track, check_name, first_beyond, means_unlabelled
from forcelab.text import left_out

#: An offset is an end where no other column is: BORIS tells the "Time offset" of the media, too.
_ENDS = ("end", "stop", "to", "finish", "offset")
#: What a column is by the first word of its name; else a name of labels is one of actions.
_ROLES = {
    **dict.fromkeys(["start", "begin", "onset", "from"], "start"),
    **{word: word for word in _ENDS},
    **dict.fromkeys(["text", "name", "event", "state"], "action"),
    **dict.fromkeys(["author", "coder", "annotator", "rater", "observer"], "author"),
}
_ENDINGS = (".labels.csv", ".labels.tsv", ".labels.txt", "_labels.csv")


def _segment_lines(text: Sequence[Line]) -> list[Line]:
    """The lines without those in which Audacity stores the frequency range of the label above."""
    return [line for line in text if not line[1].startswith("\\")]


def _columns(layout: Layout, *, requested: bool = False) -> tuple[int, int, int, int | None] | None:
    """The columns of start, end, action and author in a labels file; None if it is none.

    Without a header it has to look like one, unless it was asked to be read as one.
    """
    indices: dict[str, int] = {}
    for index, column in enumerate(layout.columns):
        words = re.split(r"[\W_]+", column.name.lower()) if column.named else []
        first = next((word for word in words if word not in {"t", "time"}), "")
        role = _ROLES.get(first) or ("action" if is_label_name(column.name) else "")
        indices.setdefault(role, index)
    end = next((indices[word] for word in _ENDS if word in indices), None)
    if end is not None and {"start", "action"} <= indices.keys():
        return indices["start"], end, indices["action"], indices.get("author")
    kinds = layout.kinds
    headless = not any(column.named for column in layout.columns)
    if not headless or not 3 <= len(kinds) <= 4 or kinds[:2] != (CellType.NUMBER, CellType.NUMBER):
        return None
    places = 0, 1, 2, 3 if len(kinds) == 4 else None
    if requested:
        return places
    if CellType.NUMBER in kinds[2:] or not any(cell.strip() for cell in layout.cells(2)):
        return None
    try:
        starts, ends = (numbers(layout.cells(i), layout.dialect.decimal) for i in (0, 1))
    except NotANumberError:
        return None
    apart = len(kinds) == 4 or bool((ends[:-1] <= starts[1:]).all())
    return places if (starts <= ends).all() and apart else None


def is_label_table(head: bytes) -> bool:
    """Whether a file's first 64 KiB are a labels file.

    It is one if its header names a start, an end and an action, or if it has no header and each row
    holds a start, a later end, and words.
    """
    layout = find_layout(_segment_lines(head_lines(head[:HEAD])))
    return layout is not None and _columns(layout) is not None


def labels_file_beside(path: Path) -> Path | None:
    """The labels file beside a recording, if there is one.

    For ``NAME.csv`` that is ``NAME.labels.csv``, ``NAME.labels.tsv``, ``NAME.labels.txt``,
    ``NAME_labels.csv``, or ``NAME.txt`` if it is an Audacity label track; the first that exists.
    """
    for ending in _ENDINGS:
        candidate = path.with_name(path.stem + ending)
        if _is_file(candidate) and candidate != path:
            return candidate
    audacity = path.with_suffix(".txt")
    if audacity == path or not _is_file(audacity):
        return None
    with audacity.open("rb") as file:
        head = file.read(HEAD)
    layout = find_layout(_segment_lines(head_lines(head)))
    if layout is None or layout.dialect.separator != "\t" or _columns(layout) != (0, 1, 2, None):
        return None
    return audacity


def _is_file(path: Path) -> bool:
    """Whether there is such a file; no disk has one whose name is too long for it."""
    try:
        return path.is_file()
    except OSError as error:
        if error.errno != errno.ENAMETOOLONG:
            raise
        return False


def read_tracks(path: Path, options: ReadOptions) -> tuple[Track, ...]:
    """Read a labels file: start, end, action and perhaps author, with a header or in this order.

    Audacity's label tracks and aggregated events of BORIS are such files. A row whose action is
    empty or ``unlabelled`` is none. Tracks come in the order of their first segment; times are the
    file's own, in seconds from the start of the recording, or since 1970 where they are dates.
    Errors name the line.
    """
    table = _read_table(path)
    return () if table is None else _all_tracks(table, options.author)


def sniff_labels(_path: Path, head: bytes) -> bool:
    """Whether a file can be read as a labels file, although its labels may overlap."""
    text = _segment_lines(head_lines(head[:HEAD]))
    layout = find_layout(text)
    if layout is None:
        return _is_header_alone(text)
    return _columns(layout) is not None or (
        _columns(layout, requested=True) is not None and CellType.NUMBER not in layout.kinds[2:]
    )


def read_labels(path: Path, options: LabelOptions) -> list[LabelSet]:
    """Read a labels file: of one demonstration, or of all that a column of this name names."""
    table = _read_table(path)
    if table is None:
        return []
    if "demonstration" not in table.names:
        return [LabelSet(own_stem(path), _all_tracks(table, options.author))]
    rows_of: dict[str, list[int]] = defaultdict(list)
    tasks, demonstrations = (table.column(name) for name in ("task", "demonstration"))
    for row, key in enumerate(zip(tasks, demonstrations, strict=True)):
        rows_of[" - ".join(filter(None, map(plain_text, key)))].append(row)
    kinds, lengths = (table.column(name) for name in ("kind", "seconds"))
    unsigned = [options.author] * len(table.cells)
    sets = []
    for name, rows in rows_of.items():
        coded = [row for row in rows if kinds[row] != "model"]
        left = len(rows) - len(coded)
        remarks = (f"{left_out(left, 'segment that models predicted')}.",) if left else ()
        length = _length(lengths[rows[0]], table.layout.dialect.decimal)
        sets.append(LabelSet(name, table.tracks(coded, unsigned), length, remarks))
    return sets


@dataclass(frozen=True, slots=True)
class _LabelTable:
    path: Path
    layout: Layout
    names: list[str]  #: of the columns, in lower case
    places: tuple[int, int, int, int | None]  #: columns of start, end, action and author
    lines: list[int]  #: the number of each row's line
    cells: list[list[str]]
    edges: NDArray[np.float64]  #: starts and ends

    def column(self, name: str) -> list[str]:
        """The cells of a column; empty ones where there is none."""
        index = self.names.index(name) if name in self.names else None
        return ["" if index is None else row[index].strip() for row in self.cells]

    def tracks(self, rows: Iterable[int], unsigned: Sequence[str]) -> tuple[Track, ...]:
        """The tracks that some of the rows make; whose each row is where it does not say."""
        _, _, action_at, author_at = self.places
        segments_by_author: dict[str, list[tuple[Segment, int]]] = defaultdict(list)
        for row in rows:
            cells, line = self.cells[row], self.lines[row]
            action = plain_text(cells[action_at].strip())
            author = plain_text(cells[author_at].strip()) if author_at is not None else ""
            if not action or means_unlabelled(action):
                continue
            start, end = self.edges[row].tolist()
            try:
                check_name(action)
                segment = Segment(start, end, action)
            except InputError as error:
                raise InputError(f"{self.path}, line {line}: {error}") from error
            segments_by_author[author or unsigned[row]].append((segment, line))
        for author, segments in segments_by_author.items():
            for (left, _), (right, line) in pairwise(sorted(segments)):
                if right.start < left.end:
                    raise InputError(
                        f"{self.path}, line {line}: '{right.action}' starts at {right.start:g} s, "
                        f"before '{left.action}' of {author} ends at {left.end:g} s; move one of "
                        f"their edges."
                    )
        return tuple(
            Track(author, tuple(segment for segment, _ in segments))
            for author, segments in segments_by_author.items()
        )


def _read_table(path: Path) -> _LabelTable | None:
    """All rows; None where there is a header alone."""
    encoding = encoding_of(path)
    with path.open("rb") as file:
        head = _segment_lines(head_lines(file.read(HEAD)))
    layout = find_layout(head)
    if layout is None and _is_header_alone(head):
        return None
    places = _columns(layout, requested=True) if layout is not None else None
    if layout is None or places is None:
        raise InputError(
            f"{path} is not a labels file; write one row a segment: start, end, action, and the "
            "author if there are several."
        )
    rows: list[Line] = []
    # Without a header nothing tells a preamble from a segment with a slip in it.
    skip = layout.skip if any(column.named for column in layout.columns) else 0
    for line_numbers, texts in lines(path, encoding, skip):
        rows += _segment_lines(list(zip(line_numbers, texts, strict=True)))
    at = [number for number, _ in rows]
    cells = [_cells(path, number, text, layout) for number, text in rows]
    edges = np.column_stack(_seconds(path, layout, at, cells, places[:2]))
    names = [column.name.lower() for column in layout.columns]
    return _LabelTable(path, layout, names, places, at, cells, edges)


def _length(cell: str, decimal: str) -> float | None:
    """The length of a demonstration, if its table tells it."""
    try:
        (length,) = numbers([cell], decimal)
    except NotANumberError:
        return None
    return float(length) if np.isfinite(length) else None


def _all_tracks(table: _LabelTable, unsigned: str) -> tuple[Track, ...]:
    """The tracks of all rows of a recording.

    Where it has no authors, BORIS's observations may tell them: they are called NAME - CODER. A
    single observation may have any name.
    """
    rows = range(len(table.cells))
    if table.places[3] is not None:
        return table.tracks(rows, [unsigned] * len(rows))
    prefix = f"{own_stem(table.path)} - "
    observations = table.column("observation id")
    several = len(set(observations)) > 1
    for number, observation in zip(table.lines, observations, strict=True):
        if several and not observation.startswith(prefix):
            raise InputError(
                f"{table.path}, line {number}: the observation '{observation}' is not called "
                f"'{prefix}CODER', as those of this recording are; export each recording's "
                f"observations by themselves."
            )
    coders = [
        name.removeprefix(prefix) if name.startswith(prefix) else unsigned for name in observations
    ]
    return table.tracks(rows, coders)


def _is_header_alone(rows: Sequence[Line]) -> bool:
    """Whether a file has a header and no segment."""
    plain = [text for _, text in rows if not is_comment(text)]
    return len(plain) == 1 and {"start", "end"} <= set(re.split(r"[\W_]+", plain[0].lower()))


def _cells(path: Path, number: int, text: str, layout: Layout) -> list[str]:
    """The cells of one row; words missing at its end are empty."""
    try:
        cells = layout.dialect.split([text])[0]
    except ValueError as error:
        raise InputError(f"{path}, line {number}: {error}.") from error
    width = layout.dialect.width
    if len(cells) == width - 1 and layout.kinds[-1] is not CellType.NUMBER:
        cells.append("")
    if len(cells) != width:
        raise InputError(
            f"{path}, line {number} has {len(cells)} cells where {width} are expected: "
            f"{', '.join(column.name for column in layout.columns)}."
        )
    return cells


def _seconds(
    path: Path,
    layout: Layout,
    at: Sequence[int],
    table: Sequence[Sequence[str]],
    columns: tuple[int, int],
) -> list[NDArray[np.float64]]:
    """Starts and ends in seconds on the file's own clock."""
    edges = [[row[index] for row in table] for index in columns]
    reader = TimestampReader([cell for edge in edges for cell in edge], layout.dialect.decimal)
    result = []
    for index, cells in zip(columns, edges, strict=True):
        name = layout.columns[index].name
        try:
            values = reader.read(cells)
        except NotANumberError as error:
            raise InputError(
                f"{path}, line {at[error.index]}: {error.cell[:40]!r} in column '{name}' is no "
                "time."
            ) from error
        if np.isnan(values).any():
            line = at[int(np.argmax(np.isnan(values)))]
            raise InputError(f"{path}, line {line} has no time in column '{name}'; give one.")
        # Unlike the stamps of samples, edges without a unit are far apart: seconds or dates.
        unit = unit_of_time(layout.columns[index]) or reader.epoch(values) or "s"
        raw = reader.finish(values, unit, path, name)
        result.append(raw.seconds(values))
    return result


def own_or_beside_tracks(
    path: Path,
    tracks: tuple[Track, ...],
    options: ReadOptions,
    start: float,
    demonstration: Demonstration,
) -> tuple[tuple[Track, ...], list[str]]:
    """The labels in a recording and those of further coders in the file beside it, with remarks.

    `start` is the recording's first stamp on its file's clock, in seconds. Times in the file beside
    it count from the start of the recording, or are on the clock of its stamps where only that
    fits. Errors of the file beside it are remarks where the recording has labels of its own.
    """
    beside = labels_file_beside(path)
    if beside is None:
        return tracks, []
    authors = {track.author for track in tracks}
    try:
        read = read_tracks(beside, options)
        others = tuple(track for track in read if track.author not in authors)
        if tracks and not others:
            return tracks, [f"{beside.name} was not read, as the recording has labels of its own."]
        carried, remarks = _carry_tracks(beside, others, start, demonstration.duration)
    except InputError as error:
        if not tracks:
            raise
        return tracks, [f"The labels beside the recording were not read: {error}"]
    if left := [track.author for track in read if track.author in authors]:
        remarks.append(
            f"The labels of {', '.join(left)} in {beside.name} were not read, as the recording has "
            "labels of its own."
        )
    return tracks + on_samples(carried, demonstration.times), remarks


def _carry_tracks(
    path: Path, tracks: tuple[Track, ...], start: float, duration: float
) -> tuple[tuple[Track, ...], list[str]]:
    """The tracks of the file beside a recording, on the recording's clock."""
    remarks = [f"The labels were read from {path.name}."]
    segments = [segment for track in tracks for segment in track.segments]
    edges = [edge for segment in segments for edge in (segment.start, segment.end)]
    if not edges:
        return (), remarks
    if first_beyond(segments, 0.0, duration) is None:
        return tracks, remarks
    if first_beyond(segments, start, start + duration) is not None:
        raise InputError(
            f"{path}: the labels go from {min(edges):.9g} s to {max(edges):.9g} s and do not fit "
            f"its recording, which is {duration:.6g} s long and starts at {start:.9g} s; check "
            "that they are of this one."
        )
    if max(edges) < YEAR_2001:
        remarks.append(
            f"Its times were taken as stamps of the recording, which start at {start:.9g} s."
        )
    return tuple(with_edges(track, edges_of(track) - start) for track in tracks), remarks
