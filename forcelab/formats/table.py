"""Text tables as found in the wild: CSV, TSV, semicolons or blanks, one sample a row.

Nothing is repaired in silence: what is left out, renamed, guessed or dropped is said in one
remark each. The rules for time stamps and their units are in :mod:`~forcelab.formats.timestamps`,
those for headers in :mod:`~forcelab.formats.table_sniff`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError, UnclearRateError
from forcelab.formats.label_tables import own_or_beside_tracks, sniff_labels
from forcelab.formats.recording import ReadOptions, Recording
from forcelab.formats.table_columns import (
    Body,
    ColumnPlan,
    ColumnRoles,
    TextColumn,
    choose_roles,
    counter_columns,
    counter_restarts,
    is_counter_name,
    is_unlabelled,
    label_column,
    missing_remark,
    read_body,
    switch_remark,
)
from forcelab.formats.table_sniff import (
    HEAD,
    CellType,
    Layout,
    cell_type,
    continues_name,
    find_layout,
    head_lines,
    is_comment,
    is_index,
    is_text,
    lines,
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
from forcelab.labels import UNLABELLED, Track, from_codes
from forcelab.text import counted, listed

#: Names of files that are meant to be tables, whatever they hold.
_SUFFIXES = frozenset([".csv", ".tsv"])
#: Of any other text, from its first row of data on, more than this share of the lines must be such
#: rows, and more than one: prose has a line here and there that reads like a row of numbers.
_TABLE_SHARE = 0.5
#: How many columns a sentence names.
NAMED_SHOWN = 20
#: Why a column is left out that counts, and one whose name does not say so.
_COUNTER_NOTE = "counting samples"
_GUESSED_NOTE = "by its steps counting samples; if it is a signal, import it as one (--signal)"


def sniff(path: Path, head: bytes) -> bool:
    """Whether a file is a text table: rows of numbers, or a text called ``.csv`` or ``.tsv``."""
    if not is_text(head):
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


def read(path: Path, options: ReadOptions) -> list[Recording]:
    """Read a table, and the labels beside it, as one demonstration, called like the file.

    With ``options.rate`` a table without stamps has that many rows a second, or as many samples
    where a column counts them; one with stamps keeps them and has its features computed at that
    rate.
    """
    layout, encoding = sniff_layout(path)
    with path.open("rb") as file:
        if sniff_labels(file.read(HEAD)):
            raise InputError(
                f"{path} is a labels file (start, end, action), not a recording; put it beside its "
                "recording NAME.csv as NAME.labels.csv and import that."
            )
    roles = choose_roles(layout, options, str(path))
    clock = None
    if roles.time is not None:
        clock = TimestampReader(layout.cells(roles.time), layout.dialect.decimal)
    body = read_body(
        path, layout, encoding, ColumnPlan(roles.numeric, roles.time, clock, roles.label)
    )
    table = _Table(
        path, layout, roles, body, counter_columns(layout, roles, body.values, str(path))
    )
    remarks = [*layout.remarks, *_ragged(table, options.strict)]
    if layout.sections and any(lines(path, encoding, int(body.lines[-1]))):
        remarks.append("More tables follow in the file; only the first one was read.")
    repaired = _times(table, clock, options)
    remarks += repaired.remarks
    label = label_column(layout, roles, body.words, str(path))
    chosen, left_out = _signal_columns(table, label)
    signals = np.column_stack([body.values[index][repaired.kept] for index in chosen])
    channels = tuple(Channel(layout.columns[i].name, layout.columns[i].unit) for i in chosen)
    wanted = table.roles.signals
    unasked = [column for column, index in enumerate(chosen) if index not in wanted]
    remarks += [
        *left_out,
        *switch_remark(signals, channels, unasked),
        *missing_remark(signals, channels),
    ]
    for array in (repaired.times, signals):
        array.flags.writeable = False  # so that the demonstration need not copy them
    demonstration = Demonstration(
        path.stem, options.task or "", repaired.times, signals, channels, grid_rate=options.rate
    )
    track = Track(options.author)
    if label is not None:
        track = _track(body.words[label], repaired, options.author)
    tracks: tuple[Track, ...] = (track,) if track.segments else ()
    tracks, more = own_or_beside_tracks(path, tracks, options, repaired.start, demonstration)
    remarks += more
    return [Recording(demonstration, tracks, tuple(remarks))]


@dataclass(frozen=True, slots=True)
class _Table:
    """A table as read, before it becomes a demonstration."""

    path: Path
    layout: Layout
    roles: ColumnRoles
    body: Body
    counters: Mapping[int, NDArray[np.float64]]

    @property
    def counter(self) -> int | None:
        """The column whose counts stand in for stamps, where there are none."""
        if self.roles.time is not None:
            return None
        return (
            min(self.counters, default=None) if self.roles.counter is None else self.roles.counter
        )


def _ragged(table: _Table, strict: bool) -> tuple[str, ...]:
    """A remark on rows with another number of cells; refused if strict."""
    number = int(table.body.ragged.sum())
    if not number:
        return ()
    line = int(table.body.lines[np.argmax(table.body.ragged)])
    stamped = table.roles.time is not None or table.counter is not None
    done = "dropped" if stamped else "taken as missing samples"
    text = (
        f"{counted(number, 'row')} with more or fewer than {table.layout.dialect.width} cells "
        f"{'was' if number == 1 else 'were'} {done}, the first in line {line}"
    )
    if strict:
        raise InputError(f"{table.path}, line {line}: {text}; mend it or let it be repaired.")
    return (f"{text}.",)


def _times(
    table: _Table, clock: TimestampReader | None, options: ReadOptions
) -> RepairedTimestamps:
    """The repaired stamps, or an even grid where there are none."""
    path, lines = table.path, table.body.lines
    if clock is None or table.roles.time is None or table.body.stamps is None:
        if options.rate is not None:
            return _even_times(table, options.rate, options.strict)
        if table.layout.rate is None:
            raise _no_times(table)
        placed = _even_times(table, table.layout.rate, options.strict)
        remark = f"The file says that there are {table.layout.rate:g} samples a second."
        return replace(placed, remarks=(remark, *placed.remarks))
    column = table.layout.columns[table.roles.time]
    whole = np.flatnonzero(~table.body.ragged)
    raw = clock.finish(table.body.stamps[whole], unit_of_time(column), path, column.name)
    repaired = repair_timestamps(
        raw, lines[whole], str(path), strict=options.strict, jitter=options.jitter
    )
    return RepairedTimestamps(
        repaired.times, whole[repaired.kept], repaired.start, (*raw.remarks, *repaired.remarks)
    )


def _no_times(table: _Table) -> UnclearRateError:
    """The error for a table without stamps and without a rate."""
    columns, counter = table.layout.columns, table.counter
    counts = f"'{columns[counter].name}' counts the samples" if counter is not None else ""
    if table.roles.counter is not None:
        return UnclearRateError(f"{table.path}: {counts}; say how many there are a second.")
    # Of those that are called so one was taken, unless they all stand still.
    stuck = [columns[index].name for index in table.roles.clocks]
    names = listed([column.name for column in columns], NAMED_SHOWN)
    what = (
        f"has in '{stuck[0]}' one and the same time throughout"
        if stuck
        else f"has no column of times among {names}"
    )
    return UnclearRateError(
        f"{table.path} {what}{'; ' + counts if counts else ''}; name the column of times, or say "
        "how many samples there are a second."
    )


def _even_times(table: _Table, rate: float, strict: bool) -> RepairedTimestamps:
    """The rows at a rate: where their counter says, if there is one, else one after the other."""
    lines, counter = table.body.lines, table.counter
    if counter is None:
        return RepairedTimestamps(np.arange(lines.size) / rate, np.arange(lines.size), 0.0, ())
    raw = RawTimestamps(table.counters[counter], per_second=rate)
    repaired = repair_timestamps(raw, lines, str(table.path), strict=strict)
    name = table.layout.columns[counter].name
    total = round(float(np.nanmax(raw.values))) + 1
    lost = total - int(np.unique(raw.values[~np.isnan(raw.values)]).size)
    # The same for all files of which nothing was lost, however long: it is told once then.
    much = f"{lost:,} of {total:,} were lost" if lost else "none was lost"
    remark = f"'{name}' counts the samples and places the rows: {much}."
    remarks = (remark, *_restart(table, counter), *repaired.remarks)
    return replace(repaired, remarks=remarks)


def _restart(table: _Table, counter: int) -> tuple[str, ...]:
    """A remark on restarts of the device, after which nothing tells how long it was off."""
    rows = counter_restarts(table.body.values[counter])
    if not rows.size:
        return ()
    often = "once" if rows.size == 1 else f"{rows.size:,} times"
    return (
        f"'{table.layout.columns[counter].name}' begins again {often}, first in line "
        f"{table.body.lines[rows[0]]}, as of a device that was restarted: a gap of unknown length, "
        "over which the times go on as if nothing was lost; import the parts as files of their own "
        "to keep them apart.",
    )


def _signal_columns(table: _Table, label: int | None) -> tuple[list[int], list[str]]:
    """The columns that become channels, and remarks on those left out."""
    chosen: list[int] = []
    left_out: dict[str, list[str]] = {}
    for index, column in enumerate(table.layout.columns):
        if index in (table.roles.time, label) or _is_constant(table, index):
            continue
        why = _refusal(table, index)
        if why == _COUNTER_NOTE and index == table.counter:
            continue  # that it places the rows is said already
        if why:
            name = column.name if column.named else column.name.removeprefix("column ")
            left_out.setdefault(why, []).append(name)
        else:
            chosen.append(index)
    if not chosen:
        wordy = [f"'{name}'" for name in left_out.get("words, not numbers", ())]
        raise InputError(
            f"{table.path} has no column of numbers besides its times"
            f"{'; words stand in ' + ', '.join(wordy) if wordy else ''}; there is nothing to "
            "import."
        )
    remarks = []
    nameless = [table.layout.columns[i].name for i in chosen if not table.layout.columns[i].named]
    if nameless and any(column.named for column in table.layout.columns):
        which = "a column" if len(nameless) == 1 else f"{len(nameless)} columns"
        remarks.append(f"The header leaves {which} without a name, called {', '.join(nameless)}.")
    for why, names in left_out.items():
        columns = (
            f"Column {names[0]} was" if len(names) == 1 else f"Columns {', '.join(names)} were"
        )
        remarks.append(f"{columns} left out: {why}.")
    return chosen, remarks


def _is_constant(table: _Table, index: int) -> bool:
    """Whether a column is what a separator at the end of each row makes."""
    words = table.body.words.get(index)
    return words is not None and words.empty and not table.layout.columns[index].named


def _refusal(table: _Table, index: int) -> str:
    """Why a column becomes no channel; empty where it does."""
    column, body = table.layout.columns[index], table.body
    if index in table.roles.signals:
        return ""
    if index in table.roles.left_out:
        return "not wanted"
    if index in table.roles.clocks:
        return "times too"
    if index in table.counters:
        told = index == table.roles.counter or (column.named and is_counter_name(column.name))
        return _COUNTER_NOTE if told else _GUESSED_NOTE
    if index in body.words:
        return "empty" if body.words[index].empty else "words, not numbers"
    alone = is_index(column, table.layout.cells(index)) and continues_name(
        body.values[index], column
    )
    return "counting rows only" if alone else ""


def _track(words: TextColumn, repaired: RepairedTimestamps, author: str) -> Track:
    """The label column as a track."""
    actions: dict[str, int] = {}
    numbers = np.full(len(words.words), UNLABELLED, np.int64)
    for code, word in enumerate(words.words):
        if not is_unlabelled(word):
            numbers[code] = actions.setdefault(word, len(actions))
    codes = numbers[words.codes[repaired.kept]]
    return Track(author, from_codes(codes, repaired.times, list(actions)))


Use = Literal["signal", "times", "counter", "labels", "left out"]
#: What any column of a table can be made, besides what it is taken for.
ANY_USE: tuple[Use, ...] = ("signal", "times", "counter", "labels", "left out")


@dataclass(frozen=True, slots=True)
class ColumnUse:
    """A column and what it is read as."""

    name: str
    unit: str
    use: Use  #: a counter is no signal; where there are no times it stands in for them
    cells: tuple[str, ...]  #: the first ones, as they stand in the file
    choices: tuple[Use, ...] = ANY_USE  #: what it can be made


def preview_table(path: Path, options: ReadOptions) -> tuple[ColumnUse, ...]:
    """What the columns of a table would be read as, from its first lines."""
    layout, _ = sniff_layout(path)
    roles = choose_roles(layout, options, str(path))
    decimal = layout.dialect.decimal
    values = {index: _values(layout.cells(index), decimal) for index in roles.numeric}
    counting = set(counter_columns(layout, roles, values, str(path)))
    words = {}
    for index in range(len(layout.columns)):
        if index not in values and index != roles.time:
            words[index] = TextColumn()
            words[index].read(layout.cells(index))
            words[index].close()
    label = label_column(layout, roles, words, str(path))
    return tuple(
        ColumnUse(
            column.name,
            column.unit,
            "labels" if index == label else _use(layout, roles, counting, index),
            tuple(cell.strip() for cell in layout.cells(index)[:3]),
        )
        for index, column in enumerate(layout.columns)
    )


def rate_in(path: Path) -> float | None:
    """The samples a second that lines before a table tell, as in a Vicon export."""
    return sniff_layout(path)[0].rate


def _values(cells: Sequence[str], decimal: str) -> NDArray[np.float64]:
    """The numbers of some cells; what is none is told with its line when the table is read."""
    kinds = (cell_type(cell, decimal) for cell in cells)
    pairs = zip(cells, kinds, strict=True)
    return numbers([cell if kind is CellType.NUMBER else "" for cell, kind in pairs], decimal)


def _use(layout: Layout, roles: ColumnRoles, counting: set[int], index: int) -> Use:
    """What one column is read as."""
    if index == roles.time:
        return "times"
    if index in roles.signals:
        return "signal"
    if index in roles.left_out or index in roles.clocks:
        return "left out"
    if index in counting:
        return "counter"
    if is_index(layout.columns[index], layout.cells(index)):
        return "left out"
    return "signal" if layout.kinds[index] is CellType.NUMBER else "left out"
