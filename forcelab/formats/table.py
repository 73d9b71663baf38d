"""Text tables as found in the wild: CSV, TSV, semicolons or blanks, one sample a row.

Nothing is repaired in silence: what is left out, renamed, guessed or dropped is said in one
remark each. The rules for time stamps and their units are in :mod:`~forcelab.formats.timestamps`,
those for headers in :mod:`~forcelab.formats.table_sniff`, those for what a column is in
:mod:`~forcelab.formats.table_columns`.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError, UnclearRateError
from forcelab.formats import boris
from forcelab.formats.label_tables import is_label_table, own_or_beside_tracks
from forcelab.formats.recording import (
    ColumnUse,
    ReadOptions,
    Recording,
    Use,
    reading_progress,
)
from forcelab.formats.samples import SAMPLES
from forcelab.formats.table_columns import (
    SEVERAL_AUTHORS,
    ColumnRoles,
    TextColumn,
    choose_roles,
    counter_columns,
    counter_restarts,
    is_counter_name,
    is_unlabelled,
    label_column,
    missing_remark,
    switch_remark,
    word_columns,
)
from forcelab.formats.table_sniff import (
    HEAD,
    CellType,
    Dialect,
    Layout,
    NotANumberError,
    cell_type,
    column_kinds,
    find_layout,
    head_lines,
    is_comment,
    is_index,
    is_label_name,
    is_text,
    is_time_name,
    lines,
    name_columns,
    numbers,
    sniff_layout,
    unit_of_time,
)
from forcelab.formats.timestamps import (
    RawTimestamps,
    RepairedTimestamps,
    TimestampReader,
    repair_timestamps,
)
from forcelab.formats.track_text import plain_text
from forcelab.jobs import Progress
from forcelab.labels import UNLABELLED, Track, from_codes
from forcelab.text import counted, listed, unique_names, were

#: Suffixes of files that are tables, whatever they hold.
_SUFFIXES = frozenset([".csv", ".tsv"])
#: Of any other text, from its first row of data on, more than this share of the lines must be such
#: rows, and more than one: prose has a line here and there that reads like a row of numbers.
_TABLE_SHARE = 0.5


def sniff(path: Path, head: bytes) -> bool:
    """Whether a file is a text table: rows of numbers, or a text called ``.csv`` or ``.tsv``."""
    if not is_text(head) or boris.sniff_labels(path, head):
        return False
    if path.suffix.lower() in _SUFFIXES:
        return True
    rows = head_lines(head[:HEAD])
    text = next((line.lstrip() for _, line in rows if line.strip()), "")
    if not text or text[0] in "{[<(":
        return False
    layout = find_layout(rows)
    if layout is None or CellType.NUMBER not in layout.kinds:
        return False
    body = [line for number, line in rows if number > layout.skip and not is_comment(line)]
    return len(layout.sample) > max(1, _TABLE_SHARE * len(body))


def read(path: Path, options: ReadOptions) -> Generator[Progress, None, list[Recording]]:
    """Read a table, and the labels beside it, as one demonstration, called like the file.

    With ``options.rate`` a table without times has that many rows a second, or as many samples
    where a column counts them; one with times keeps them and has its features computed at that
    rate.
    """
    layout = sniff_layout(path)
    with path.open("rb") as file:
        if is_label_table(file.read(HEAD)):
            raise InputError(
                f"{path} is a labels file (start, end, action), not a recording; put it beside its "
                "recording NAME.csv as NAME.labels.csv and import that, or import it as labels of "
                "one in a project (forcelab labels; in the window File > Import labels)."
            )
    roles = choose_roles(layout, options)
    rows = lines(path, layout.encoding, layout.skip, sections=layout.sections)
    letters = path.stat().st_size // (2 if layout.encoding.startswith("utf-16") else 1)
    table = yield from read_rows(layout, roles, rows, letters)
    remarks = []
    if layout.sections and any(lines(path, layout.encoding, int(table.lines[-1]))):
        remarks.append("More tables follow in the file; only the first one was read.")
    return make_recordings(path.stem, table, options, remarks)


def make_recordings(
    name: str, table: Table, options: ReadOptions, more_remarks: Sequence[str] = ()
) -> list[Recording]:
    """The demonstrations in a table: one, or one for each value of columns that tell them apart.

    They do where times begin again whenever they change, and only there.
    """
    starts, columns = _restarts(table)
    if not columns:
        return [make_recording(name, table, options, more_remarks)]
    titles = listed([f"'{table.layout.columns[index].name}'" for index in columns])
    remark = f"Times begin again with {titles}, so that the file holds {len(starts)} recordings."
    parts = [slice(start, end) for start, end in pairwise([*starts, len(table.ragged)])]
    names = unique_names([f"{name} {_values(table, columns, part.start)}" for part in parts])
    return [
        make_recording(
            own, _part(table, part, columns), options, [*more_remarks, remark], beside=False
        )
        for own, part in zip(names, parts, strict=True)
    ]


#: So many recordings may be in one table.
_MOST_PARTS = 10_000


def _restarts(table: Table) -> tuple[list[int], list[int]]:
    """The rows at which a table's recordings begin, and the columns that tell these apart."""
    roles, starts = table.roles, [0]
    stamps = table.times.values if table.times is not None else np.empty(0)
    for row in (np.flatnonzero(np.diff(stamps) < 0) + 1)[:_MOST_PARTS].tolist():
        # Not where times only jitter.
        if stamps[row - 1] - stamps[row] > 0.5 * (stamps[row - 1] - stamps[starts[-1]]):
            starts.append(row)
    several = min(np.diff([*starts, stamps.size]), default=0) > 1  # samples in each of them
    if len(starts) == 1 or not several:
        return [0], []
    taken = {roles.label, *roles.authors, roles.counter, roles.nanoseconds}
    words = {i: text.codes for i, text in table.words.items() if text.codes.size == stamps.size}
    columns = words | table.values
    telling, changes = [], np.empty(0, np.intp)
    for index in sorted(columns.keys() - taken):
        own = np.flatnonzero(columns[index][1:] != columns[index][:-1]) + 1
        if 0 < own.size < len(starts) and np.isin(own, starts).all():
            telling.append(index)
            changes = np.union1d(changes, own)
    return (starts, telling) if changes.size == len(starts) - 1 else ([0], [])


def _values(table: Table, columns: Sequence[int], row: int) -> str:
    """What tells a recording from the others in its table, such as ``Ann trial 2``."""
    return " ".join(
        text.words[text.codes[row]]
        if (text := table.words.get(index))
        else f"{table.layout.columns[index].name} {table.values[index][row]:g}"
        for index in columns
    )


def _part(table: Table, rows: slice, columns: Sequence[int]) -> Table:
    """One of the recordings in a table, without the columns that tell which one it is."""
    assert table.times is not None
    return replace(
        table,
        roles=replace(table.roles, left_out=table.roles.left_out.union(columns)),
        numbers=table.numbers[rows],
        words={index: text.part(rows) for index, text in table.words.items()},
        lines=table.lines[rows],
        ragged=table.ragged[rows],
        times=replace(table.times, values=table.times.values[rows]),
        telling=frozenset(columns),
    )


def make_recording(
    name: str,
    table: Table,
    options: ReadOptions,
    more_remarks: Sequence[str] = (),
    *,
    beside: bool = True,
) -> Recording:
    """A demonstration of the rows of a table, with its labels and those `beside` its file."""
    layout, roles = table.layout, table.roles
    if table.times is not None and roles.nanoseconds is not None:
        nanoseconds = table.values[roles.nanoseconds]
        if (nanoseconds >= 1e9).any():
            rest = layout.columns[roles.nanoseconds].name
            raise InputError(
                f"{layout.path}: '{rest}' goes beyond a second, so that it adds nothing to the "
                f"column of seconds; leave one of the two out (--leave-out)."
            )
        ticks = nanoseconds * (table.times.per_second / 1e9)
        times = replace(table.times, values=table.times.values + ticks)
        table = replace(table, times=times)
    _refuse_long_format(table)
    remarks = [*layout.remarks, *table.ragged_remarks(options.strict), *more_remarks]
    repaired = _times(table, options)
    remarks += repaired.remarks
    indices, left_out_remarks = _channel_columns(table)
    signals = table.numbers
    if indices != table.numeric or not repaired.kept.all():
        signals = np.empty((repaired.times.size, len(indices)))
        for place, index in enumerate(indices):
            signals[:, place] = table.values[index][repaired.kept]
    channels = tuple(Channel(layout.columns[i].name, layout.columns[i].unit) for i in indices)
    unrequested = [column for column, i in enumerate(indices) if i not in roles.signals]
    remarks += [
        *left_out_remarks,
        *_found_remarks(table, options),
        *switch_remark(signals, channels, unrequested),
        *missing_remark(signals, channels),
    ]
    for array in (repaired.times, signals):
        array.flags.writeable = False  # so that the demonstration need not copy them
    name = name.removesuffix(SAMPLES)
    demonstration = Demonstration(
        name, options.task or "", repaired.times, signals, channels, grid_rate=options.rate
    )
    tracks = _own_tracks(table, repaired, options)
    if beside:
        tracks, label_remarks = own_or_beside_tracks(
            layout.path, tracks, options, repaired.start, demonstration
        )
        remarks += label_remarks
    return Recording(demonstration, tracks, tuple(remarks))


@dataclass(frozen=True)
class Table:
    """The n rows of a table, or the first ones, and what each of its columns is used for."""

    layout: Layout
    roles: ColumnRoles
    numeric: list[int]  #: the columns of numbers but the one of times
    #: What they hold, side by side, shape (n, len(numeric)): where all of them become channels
    #: these are the signals, as there may be no room for a copy.
    numbers: NDArray[np.float64]
    #: All other columns but the one of times; of a further stamp for each row only the first ones.
    words: dict[int, TextColumn]
    lines: NDArray[np.int64] | range  #: 1-based line of each row
    ragged: NDArray[np.bool_]  #: rows with another number of cells: all their samples are missing
    times: RawTimestamps | None = None  #: of the column of times
    #: Columns that tell it from others in its file, as a remark says; they are left out.
    telling: frozenset[int] = frozenset()

    @cached_property
    def values(self) -> dict[int, NDArray[np.float64]]:
        """The numbers of each numeric column, by its index."""
        return dict(zip(self.numeric, self.numbers.T, strict=True))

    @cached_property
    def counters(self) -> dict[int, NDArray[np.float64]]:
        """What the columns count that count samples."""
        return counter_columns(self.layout, self.roles, self.values)

    @cached_property
    def label(self) -> int | None:
        """The column of labels."""
        return label_column(self.layout, self.roles, self.words)

    @property
    def counter(self) -> int | None:
        """The column whose counts stand in for times, where there are none."""
        if self.roles.time is not None:
            return None
        counters = self.counters  # which refuse what was named and does not count
        return min(counters, default=None) if self.roles.counter is None else self.roles.counter

    def use(self, index: int) -> tuple[Use, str]:
        """What a column is used for, and why it becomes no channel; empty where that is plain.

        The reason may be that of several columns.
        """
        column, roles, words = self.layout.columns[index], self.roles, self.words.get(index)
        use: Use = "left out"
        why = ""
        if index in (roles.time, roles.nanoseconds):
            use = "times"
        elif index == self.label or index in roles.authors:
            use = "labels"
        elif index in roles.signals:
            use = "signal"
        elif words is not None and words.empty and not column.named:
            pass  # what a separator at the end of each row makes
        elif index in roles.left_out:
            why = "" if index in self.telling else "as chosen"
        elif index in roles.other_times or index in roles.probabilities:
            other_times = index in roles.other_times
            why = self._time_source() if other_times else "a model's probabilities"
        elif index in self.counters:
            use = "counter"
            if index != roles.counter and not (column.named and is_counter_name(column.name)):
                why = "sample counts, by their steps; import what is a signal as one (--signal)"
            elif index != self.counter:  # of which a remark says that it places the rows
                why = "sample counts"
        elif words is not None:
            why = "empty" if words.empty else "words, not numbers"
        elif is_index(column, self.layout.cells(index), self.values[index]):
            why = "row numbers"
        else:
            use = "signal"
        return use, why

    def _time_source(self) -> str:
        """Why further columns of times become nothing."""
        if self.roles.time is None:
            return "times are no signals"
        return f"times were read from '{self.layout.columns[self.roles.time].name}'"

    def ragged_remarks(self, strict: bool) -> tuple[str, ...]:
        """A remark on rows with another number of cells; refused if strict."""
        number = int(self.ragged.sum())
        if not number:
            return ()
        line = f"{self.layout.line} {self.lines[np.argmax(self.ragged)]}"
        placed = self.roles.time is not None or self.counter is not None
        text = (
            f"{counted(number, 'row')} with more or fewer than {self.layout.dialect.width} cells "
            f"{were(number)} {'dropped' if placed else 'taken as missing samples'}, the first in "
            f"{line}"
        )
        if strict:
            raise InputError(f"{self.layout.path}, {line}: {text}; mend it or let it be repaired.")
        return (f"{text}.",)


#: Cells of a column, or an array of the numbers, dates or times of the day that it holds.
TypedColumn: TypeAlias = Sequence[str] | NDArray[Any]


def typed_layout(
    names: Sequence[str], units: Sequence[str], columns: Sequence[TypedColumn], path: Path
) -> Layout:
    """What a table is whose columns have types, by the first values of each."""
    named, remarks = name_columns(names, units)
    dialect = Dialect(None, ".", len(named))
    sample = tuple(zip(*map(_as_cells, columns), strict=True))
    kinds = list(column_kinds(sample, dialect))
    for index, column in enumerate(columns):
        if isinstance(column, np.ndarray):
            kinds[index] = CellType.STAMP if column.dtype.kind in "Mm" else CellType.NUMBER
    return Layout(dialect, named, tuple(kinds), 0, sample, remarks, path=path, line="row")


def _as_cells(column: TypedColumn) -> Sequence[str]:
    """Words, numbers or times as the cells of a text table; empty where one is missing."""
    if not isinstance(column, np.ndarray):
        return column
    if column.dtype.kind in "Mm":
        clock = column.dtype.kind == "m"
        dates = np.datetime64("1970-01-01") + column if clock else column
        texts = ["" if text == "NaT" else text for text in np.datetime_as_string(dates).tolist()]
        return [text.partition("T")[2] for text in texts] if clock else texts
    # Whole numbers of labels may be floats as some are missing.
    return ["" if text == "nan" else text.removesuffix(".0") for text in map(str, column.tolist())]


#: More rows with another number of cells than this share (and than one) are no slip of a logger;
#: looked at once so many rows have been read.
_RAGGED_SHARE, _RAGGED_ROWS = 0.05, 1000


class TableReader:
    """Reads the columns of a table block by block.

    Errors name the line of the first cell that is not what its column holds.
    """

    def __init__(self, layout: Layout, roles: ColumnRoles) -> None:
        self._layout, self._roles = layout, roles
        self._stamps: TimestampReader | None = None
        if roles.time is not None:
            self._stamps = TimestampReader(layout.cells(roles.time), layout.dialect.decimal)
        indices = range(len(layout.columns))
        times_plain = self._stamps is not None and self._stamps.plain
        #: Columns that hold nothing but ordinary numbers.
        self.plain = [i for i in indices if i in roles.numeric or (i == roles.time and times_plain)]
        self._words = {
            i: TextColumn() for i in indices if i not in roles.numeric and i != roles.time
        }
        labels = (roles.label, *roles.authors)
        #: Further columns of stamps, which at most tell recordings apart: of those with a stamp for
        #: each row the first blocks are enough.
        self._further_stamps = {
            i for i in self._words if layout.kinds[i] is CellType.STAMP and i not in labels
        }
        self._blocks: dict[int, list[NDArray[np.float64]]] = {
            i: [] for i in indices if i not in self._words
        }
        self._lines: list[NDArray[np.int64]] = []
        self._ragged: list[NDArray[np.bool_]] = []

    def read(
        self,
        line_numbers: Sequence[int] | NDArray[np.int64],
        columns: Mapping[int, TypedColumn],
        ragged: NDArray[np.bool_] | None = None,
    ) -> None:
        """Read a block of rows; columns that are left out need not be given."""
        self._lines.append(np.array(line_numbers, np.int64))
        self._ragged.append(np.zeros(len(line_numbers), np.bool_) if ragged is None else ragged)
        if ragged is not None and ragged.any() and sum(map(len, self._ragged)) >= _RAGGED_ROWS:
            self._refuse_ragged()
        for index, column in columns.items():
            if index in self._words:
                words = self._words[index]
                if index not in self._further_stamps or words.word_count <= _MOST_PARTS:
                    words.read(_as_cells(column))
                continue
            try:
                self._blocks[index].append(self._numbers(index, column))
            except NotANumberError as error:
                excerpt = error.cell if len(error.cell) <= 40 else error.cell[:37] + "..."
                kind = "stamp" if index == self._roles.time else "number"
                raise InputError(
                    f"{self._layout.path}, {self._layout.line} {line_numbers[error.index]}: "
                    f"{excerpt!r} in column '{self._layout.columns[index].name}' is not a {kind}; "
                    f"mend the cell or empty it."
                ) from error

    def _numbers(self, index: int, column: TypedColumn) -> NDArray[np.float64]:
        """The numbers or stamps in the cells of a column."""
        if self._stamps is not None and index == self._roles.time:
            if isinstance(column, np.ndarray):
                return self._stamps.from_array(column)
            return self._stamps.read(column)
        if not isinstance(column, np.ndarray):
            return numbers(column, self._layout.dialect.decimal)
        values = column.astype(np.float64)
        values[~np.isfinite(values)] = np.nan
        return values

    def finish(self) -> Table:
        """All rows; a table of which more than 5 % (and more than one) are ragged is refused."""
        layout, time = self._layout, self._roles.time
        self._refuse_ragged()
        times = None
        if self._stamps is not None and time is not None:
            column, stamps = layout.columns[time], np.concatenate(self._blocks.pop(time))
            times = self._stamps.finish(stamps, unit_of_time(column), layout.path, column.name)
        words = dict(self._words)
        for index, text in self._words.items():
            text.close()
            labels = index == self._roles.label or index in self._roles.authors
            if layout.kinds[index] is CellType.MISSING and not labels and not text.empty:
                # The head of the table, all that was known so far, left this column empty.
                with suppress(NotANumberError):
                    late = numbers(text.words, layout.dialect.decimal)[text.codes]
                    self._blocks[index] = [late]
                    del words[index]
        lines, ragged = np.concatenate(self._lines), np.concatenate(self._ragged)
        numeric = sorted(index for index, blocks in self._blocks.items() if blocks)
        table = np.empty((lines.size, len(numeric)))
        for place, index in enumerate(numeric):
            np.concatenate(self._blocks.pop(index), out=table[:, place])
        return Table(layout, self._roles, numeric, table, words, lines, ragged, times)

    def _refuse_ragged(self) -> None:
        """Refuse a table too many of whose rows have another number of cells."""
        marks = np.concatenate(self._ragged)
        bad = int(marks.sum())
        if bad > max(1.0, _RAGGED_SHARE * marks.size):
            line = np.concatenate(self._lines)[np.argmax(marks)]
            raise InputError(
                f"{self._layout.path}, {self._layout.line} {line}: {bad:,} of {marks.size:,} rows "
                f"do not have {self._layout.dialect.width} cells as most have; export the table "
                "again with one separator between cells."
            )


def read_rows(
    layout: Layout,
    roles: ColumnRoles,
    row_blocks: Iterable[tuple[list[int], list[str]]],
    letters: int,
) -> Generator[Progress, None, Table]:
    """Read all rows of a table as text: blocks of their 1-based line numbers and lines.

    `letters` is about how many they have, 0 where that is not known.
    """
    dialect, reader, done = layout.dialect, TableReader(layout, roles), 0
    rest = [i for i in range(len(layout.columns)) if i not in reader.plain]
    for line_numbers, rows in row_blocks:
        if done:
            yield reading_progress(layout.path, done, letters)
        done += len(rows) + sum(map(len, rows))
        quick = _parse_block(rows, dialect, reader.plain)
        columns: dict[int, TypedColumn]
        if quick is not None:
            columns = {index: _one_column(rows, dialect, index) for index in rest}
            columns |= {index: quick[:, place] for place, index in enumerate(reader.plain)}
            reader.read(line_numbers, columns)
        else:
            try:
                cells = dialect.split(rows)
            except ValueError as error:
                raise InputError(
                    f"{layout.path}: {error} between lines {line_numbers[0]} and "
                    f"{line_numbers[-1]}; a cell must end on the line on which it starts."
                ) from error
            ragged = _pad_rows(cells, dialect)
            columns = dict(enumerate(zip(*cells, strict=True)))
            reader.read(line_numbers, columns, ragged)
    return reader.finish()


def _sample_table(layout: Layout, roles: ColumnRoles) -> Table:
    """The first rows but their times; cells that are no numbers are named on reading the table."""
    columns = {i: layout.cells(i) for i in range(len(layout.columns)) if i != roles.time}
    for index in roles.numeric:
        pairs = [(cell, cell_type(cell, layout.dialect.decimal)) for cell in columns[index]]
        columns[index] = [cell if kind is CellType.NUMBER else "" for cell, kind in pairs]
    reader = TableReader(layout, replace(roles, time=None))
    reader.read(range(1, len(layout.sample) + 1), columns)
    return replace(reader.finish(), roles=roles)


def _parse_block(
    rows: list[str], dialect: Dialect, columns: Sequence[int]
) -> NDArray[np.float64] | None:
    """The columns of plain numbers of a block, read three times as fast as cell by cell.

    None where a cell is missing or quoted, a row is ragged, or decimal marks are commas.
    """
    mark, others = dialect.separator, len(columns) < dialect.width
    if dialect.decimal != "." or not columns or (others and mark is None):
        return None
    if mark and not all(row.count(mark) == dialect.width - 1 for row in rows):
        return None
    if any('"' in row for row in rows):
        return None
    used = columns if others else None
    try:
        table = np.loadtxt(rows, delimiter=mark, comments=None, ndmin=2, usecols=used)
    except ValueError:
        return None
    if table.shape != (len(rows), len(columns)):
        return None
    table[~np.isfinite(table)] = np.nan
    return table


def _one_column(rows: list[str], dialect: Dialect, index: int) -> list[str]:
    """The cells of one column of rows without quotes, split from the nearer end."""
    mark, behind = dialect.separator, dialect.width - 1 - index
    if behind < index:
        return [row.rsplit(mark, behind + 1)[-behind - 1] for row in rows]
    return [row.split(mark, index + 1)[index] for row in rows]


def _pad_rows(table: list[list[str]], dialect: Dialect) -> NDArray[np.bool_]:
    """Make all rows equally wide; mark those that needed more than spare separators dropped."""
    ragged = np.zeros(len(table), np.bool_)
    if set(map(len, table)) == {dialect.width}:
        return ragged
    for i, row in enumerate(table):
        while len(row) > dialect.width and not row[-1].strip():
            row.pop()
        if len(row) != dialect.width:
            ragged[i] = True
            table[i] = [""] * dialect.width
    return ragged


def _times(table: Table, options: ReadOptions) -> RepairedTimestamps:
    """The repaired times of the column that holds them, or an even grid where there is none."""
    if table.times is None:
        return _even_times(table, options)
    raw, lines, kept = table.times, table.lines, ~table.ragged
    if not kept.all():
        raw, lines = replace(raw, values=raw.values[kept]), np.array(lines)[kept]
    repaired = repair_timestamps(
        raw,
        lines,
        str(table.layout.path),
        strict=options.strict,
        jitter=options.jitter,
        line=table.layout.line,
    )
    remarks = (*raw.remarks, *repaired.remarks)
    kept[kept] = repaired.kept
    return replace(repaired, kept=kept, remarks=remarks)


def _even_times(table: Table, options: ReadOptions) -> RepairedTimestamps:
    """Rows at a rate: where their counter says, if there is one, else one after the other."""
    layout, lines, counter = table.layout, table.lines, table.counter
    rate, remarks = options.rate, []
    if rate is None:
        rate = layout.rate
        if rate is None:
            raise _unclear_rate(table)
        remarks = [f"The file says that there are {rate:g} samples a second."]
    if counter is None:
        times = np.arange(len(lines)) / rate
        return RepairedTimestamps(times, np.ones(len(lines), np.bool_), 0.0, tuple(remarks))
    ticks = table.counters[counter]
    total = round(float(np.nanmax(ticks))) + 1
    lost = total - int(np.unique(ticks[~np.isnan(ticks)]).size)
    repaired = repair_timestamps(
        RawTimestamps(ticks, per_second=rate),
        lines,
        str(layout.path),
        strict=options.strict,
        line=layout.line,
    )
    # The same for all files of which nothing was lost, however long, so that it is told once.
    result = f"{lost:,} of {total:,} were lost" if lost else "none was lost"
    name = layout.columns[counter].name
    remarks.append(f"'{name}' counts the samples and places the rows: {result}.")
    restarts = counter_restarts(table.values[counter])
    if restarts.size:
        how_often = "once" if restarts.size == 1 else f"{restarts.size:,} times"
        remarks.append(
            f"'{name}' begins again {how_often}, first in {layout.line} {lines[restarts[0]]}, as "
            "of a device that was restarted: a gap of unknown length, over which the times go on "
            "as if nothing was lost; import the parts as files of their own to keep them apart."
        )
    return replace(repaired, remarks=(*remarks, *repaired.remarks))


#: How many columns a sentence names.
_NAMED = 20


def _unclear_rate(table: Table) -> UnclearRateError:
    """The error for a table without times and without a rate."""
    path, columns, counter = table.layout.path, table.layout.columns, table.counter
    counts = f"'{columns[counter].name}' counts the samples" if counter is not None else ""
    if table.roles.counter is not None:
        return UnclearRateError(f"{path}: {counts}; say how many there are a second.")
    # A column that is named as times was taken, unless all of those stand still.
    constant = [columns[index].name for index in table.roles.other_times]
    names = listed([column.name for column in columns], _NAMED)
    problem = (
        f"has in '{constant[0]}' one and the same time throughout"
        if constant
        else f"has no column of times among {names}"
    )
    return UnclearRateError(
        f"{path} {problem}{'; ' + counts if counts else ''}; name the column of times, or say how "
        "many samples there are a second."
    )


def _channel_columns(table: Table) -> tuple[list[int], list[str]]:
    """The columns that become channels, and remarks on those left out."""
    columns = table.layout.columns
    chosen: list[int] = []
    left_out: dict[str, list[str]] = {}
    for index, column in enumerate(columns):
        use, why = table.use(index)
        if use == "signal":
            chosen.append(index)
        elif why:
            name = column.name if column.named else column.name.removeprefix("column ")
            left_out.setdefault(why, []).append(name)
    if not chosen:
        words = [f"'{name}'" for name in left_out.get("words, not numbers", ())]
        raise InputError(
            f"{table.layout.path} has no column of numbers besides its times"
            f"{'; words stand in ' + ', '.join(words) if words else ''}; there is nothing to "
            "import."
        )
    remarks = []
    nameless = [columns[index].name for index in chosen if not columns[index].named]
    if nameless and any(column.named for column in columns):
        columns_text = "a column" if len(nameless) == 1 else f"{len(nameless)} columns"
        remarks.append(
            f"The header leaves {columns_text} without a name, called {', '.join(nameless)}."
        )
    for why, names in left_out.items():
        subject = (
            f"Column {names[0]} was" if len(names) == 1 else f"Columns {', '.join(names)} were"
        )
        remarks.append(f"{subject} left out: {why}.")
    return chosen, remarks


#: Of the rows that repeat a time, so many have another word than the row before if the word says
#: whose value stands in the row; of no more words than these.
_LONG_SHARE, _LONG_WORDS = 0.9, 100


def _refuse_long_format(table: Table) -> None:
    """Refuse a table with several rows a time, each for another channel or sensor."""
    stamps = table.times.values if table.times is not None else np.empty(0)
    repeats = stamps[1:] == stamps[:-1]
    if not np.any(repeats) or np.mean(repeats) < 0.4:
        return
    for index, text in table.words.items():
        if index in {table.label, *table.roles.authors, *table.roles.left_out} or text.empty:
            continue
        if table.layout.kinds[index] is CellType.STAMP:
            continue
        changes = np.diff(text.codes)[repeats] != 0
        if len(text.words) <= _LONG_WORDS and np.mean(changes) > _LONG_SHARE:
            name, words = table.layout.columns[index].name, listed(text.words, 6)
            raise InputError(
                f"{table.layout.path} has several rows for each time, one for each of {words} in "
                f"'{name}'; write one row for each time, with columns for each of them (a pivot "
                f"table does it)."
            )


def _found_remarks(table: Table, options: ReadOptions) -> list[str]:
    """On columns of times and labels that neither names nor options tell, and on brief labels."""
    columns, remarks = table.layout.columns, []
    time, label = table.roles.time, table.label
    named = options.time or table.roles.nanoseconds is not None
    if time is not None and not named and not is_time_name(columns[time].name):
        remarks.append(
            f"Times were read from '{columns[time].name}', as it steps like a clock; name another "
            f"column if they are not (--time)."
        )
    if label is not None and options.label is None and not is_label_name(columns[label].name):
        remarks.append(
            f"Labels were read from '{columns[label].name}', the only column of words; leave it "
            f"out if they are none (--leave-out)."
        )
    if label is None and not table.roles.authors:
        candidates = word_columns(table.layout, table.roles, table.words)
        if len(candidates) > 1:
            names = listed([columns[index].name for index in candidates], _NAMED)
            remarks.append(
                f"No column was read as labels, as several may be ({names}): name the one that is "
                f"(--label); {SEVERAL_AUTHORS}."
            )
    if label is not None:
        text = table.words[label]
        labelled = np.array([not is_unlabelled(word) for word in text.words], np.bool_)[text.codes]
        if np.count_nonzero(labelled) > 1 and not (labelled[1:] & labelled[:-1]).any():
            remarks.append(
                f"'{columns[label].name}' is empty below each label, so that all of them last one "
                f"sample; where one holds until the next, fill the cells below it with it (Fill "
                f"down in a spreadsheet) and import the file again."
            )
    return remarks


def _own_tracks(
    table: Table, repaired: RepairedTimestamps, options: ReadOptions
) -> tuple[Track, ...]:
    """The columns of labels as tracks, as far as there are labels in them."""
    authors = dict(table.roles.authors)
    if table.label is not None:
        authors[table.label] = options.author
    tracks: dict[str, Track] = {}
    for index, author in authors.items():
        column = table.words[index]
        actions: dict[str, int] = {}
        numbers = np.full(len(column.words), UNLABELLED, np.int64)
        for code, word in enumerate(column.words):
            # Of exported samples it is known that what is unlabelled is empty.
            unlabelled = not word if index in table.roles.authors else is_unlabelled(word)
            if not unlabelled:
                action = plain_text(word) if index in table.roles.authors else word
                numbers[code] = actions.setdefault(action, len(actions))
        codes = numbers[column.codes[repaired.kept]]
        if segments := from_codes(codes, repaired.times, list(actions)):
            tracks.setdefault(author, Track(author, segments))
    return tuple(tracks.values())


def preview(path: Path, options: ReadOptions) -> tuple[ColumnUse, ...]:
    """What the columns of a table would be read as, from its first lines."""
    return preview_layout(sniff_layout(path), options)


def preview_layout(
    layout: Layout, options: ReadOptions, roles: ColumnRoles | None = None
) -> tuple[ColumnUse, ...]:
    """What the columns of a table would be read as, from its first rows."""
    roles = roles or choose_roles(layout, options)
    table = _sample_table(layout, roles)
    uses = [table.use(index)[0] for index in range(len(layout.columns))]
    empty = [
        index
        for index, column in enumerate(layout.columns)
        if layout.kinds[index] is CellType.MISSING
        and (column.named and not column.unit)
        and index not in roles.left_out | roles.signals
    ]
    if "labels" not in uses and len(empty) == 1:
        # Words that come later will be labels, as most recordings begin without one.
        uses[empty[0]] = "labels"
    return tuple(
        ColumnUse(
            column.name,
            column.unit,
            use,
            tuple(cell.strip() for cell in layout.cells(index)[:3]),
        )
        for index, (column, use) in enumerate(zip(layout.columns, uses, strict=True))
    )


def rate_in(path: Path) -> float | None:
    """The samples a second that lines before a table tell, as in a Vicon export."""
    return sniff_layout(path).rate
