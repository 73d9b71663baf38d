"""Text tables as found in the wild: CSV, TSV, semicolons or blanks, one sample a row.

Nothing is repaired in silence: what is left out, renamed, guessed or dropped is said in one
remark each. The rules for stamps are in :mod:`~forcelab.formats.table.stamps`, those for units of
time in :mod:`~forcelab.formats.table.clocks`, those for headers in
:mod:`~forcelab.formats.table.layout`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError, UnclearRateError
from forcelab.formats.recording import ReadOptions, Recording
from forcelab.formats.table.body import Body, Plan, Words, read_body
from forcelab.formats.table.cells import Kind
from forcelab.formats.table.clocks import ClockReader, RawStamps
from forcelab.formats.table.columns import goes_on, is_index, unit_of_time
from forcelab.formats.table.counters import is_counter_name, restarts
from forcelab.formats.table.dialect import HEAD, head_lines, is_comment, is_text, lines
from forcelab.formats.table.labels import own_or_beside, sniff_labels
from forcelab.formats.table.layout import Layout, lay_out, survey
from forcelab.formats.table.roles import (
    Roles,
    choose_roles,
    counters,
    is_unlabelled,
    label_column,
)
from forcelab.formats.table.signals import missing, switches
from forcelab.formats.table.stamps import Repaired, repair
from forcelab.labels import UNLABELLED, Track, from_codes
from forcelab.text import counted, listed

__all__ = ["read", "sniff"]

#: Names of files that are meant to be tables, whatever they hold.
_SUFFIXES = frozenset([".csv", ".tsv"])
#: Of any other text, from its first row of data on, more than this share of the lines must be such
#: rows, and more than one: prose has a line here and there that reads like a row of numbers.
_TABLE_SHARE = 0.5
#: How many columns a sentence names.
NAMED = 20
#: Why a column is left out that counts, and one whose name does not say so.
_COUNTING = "counting samples"
_BY_LOOKS = "by its steps counting samples; if it is a signal, import it as one (--signal)"


def sniff(path: Path, head: bytes) -> bool:
    """Whether a file is a text table: rows of numbers, or a text called ``.csv`` or ``.tsv``.

    Parameters
    ----------
    path : Path
        The file.
    head : bytes
        Its first 64 KiB.
    """
    if not is_text(head):
        return False
    if path.suffix.lower() in _SUFFIXES:
        return True
    rows = head_lines(head[:HEAD])
    text = next((line.lstrip() for _, line in rows if line.strip()), "")
    if not text or text[0] in "{[<(":
        return False
    layout = lay_out(rows)
    if layout is None or Kind.NUMBER not in layout.kinds:
        return False
    body = [line for number, line in rows if number > layout.skip and not is_comment(line)]
    return len(layout.sample) > max(1, _TABLE_SHARE * len(body))


def read(path: Path, options: ReadOptions) -> list[Recording]:
    """Read a table as one demonstration, called like the file.

    Parameters
    ----------
    path : Path
        The file. A labels file beside it is read too, see
        :func:`forcelab.formats.table.labels.lies_beside`.
    options : ReadOptions
        With `rate`, a table without stamps has that many rows a second, and as many samples a
        second where a column counts them; one with stamps keeps them and has its features computed
        at that rate.

    Returns
    -------
    list of Recording
        Exactly one.

    Raises
    ------
    InputError
        If the file holds no table, a cell is not what its column holds, there are neither stamps
        nor a rate, or the stamps break the rules of :mod:`forcelab.formats.table.stamps`.
    """
    layout, encoding = survey(path)
    with path.open("rb") as file:
        if sniff_labels(file.read(HEAD)):
            raise InputError(
                f"{path} is a labels file (start, end, action), not a recording; put it beside its "
                "recording NAME.csv as NAME.labels.csv and import that."
            )
    roles = choose_roles(layout, options, str(path))
    clock = None
    if roles.time is not None:
        clock = ClockReader(layout.cells(roles.time), layout.dialect.decimal)
    body = read_body(path, layout, encoding, Plan(roles.numeric, roles.time, clock, roles.label))
    table = _Table(path, layout, roles, body, counters(layout, roles, body.values, str(path)))
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
    remarks += [*left_out, *switches(signals, channels, unasked), *missing(signals, channels)]
    for array in (repaired.times, signals):
        array.flags.writeable = False  # so that the demonstration need not copy them
    demonstration = Demonstration(
        path.stem, options.task or "", repaired.times, signals, channels, grid_rate=options.rate
    )
    track = Track(options.author)
    if label is not None:
        track = _track(body.words[label], repaired, options.author)
    tracks: tuple[Track, ...] = (track,) if track.segments else ()
    tracks, more = own_or_beside(path, tracks, options, repaired.start, demonstration)
    remarks += more
    return [Recording(demonstration, tracks, tuple(remarks))]


@dataclass(frozen=True, slots=True)
class _Table:
    """A table as read, before it becomes a demonstration."""

    path: Path
    layout: Layout
    roles: Roles
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


def _times(table: _Table, clock: ClockReader | None, options: ReadOptions) -> Repaired:
    """The repaired stamps, or an even grid where there are none."""
    path, lines = table.path, table.body.lines
    if clock is None or table.roles.time is None or table.body.stamps is None:
        if options.rate is not None:
            return _evenly(table, options.rate, options.strict)
        if table.layout.rate is None:
            raise _no_times(table)
        placed = _evenly(table, table.layout.rate, options.strict)
        remark = f"The file says that there are {table.layout.rate:g} samples a second."
        return replace(placed, remarks=(remark, *placed.remarks))
    column = table.layout.columns[table.roles.time]
    whole = np.flatnonzero(~table.body.ragged)
    raw = clock.finish(table.body.stamps[whole], unit_of_time(column), path, column.name)
    repaired = repair(raw, lines[whole], str(path), strict=options.strict, jitter=options.jitter)
    return Repaired(
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
    names = listed([column.name for column in columns], NAMED)
    what = (
        f"has in '{stuck[0]}' one and the same time throughout"
        if stuck
        else f"has no column of times among {names}"
    )
    return UnclearRateError(
        f"{table.path} {what}{'; ' + counts if counts else ''}; name the column of times, or say "
        "how many samples there are a second."
    )


def _evenly(table: _Table, rate: float, strict: bool) -> Repaired:
    """The rows at a rate: where their counter says, if there is one, else one after the other."""
    lines, counter = table.body.lines, table.counter
    if counter is None:
        return Repaired(np.arange(lines.size) / rate, np.arange(lines.size), 0.0, ())
    raw = RawStamps(table.counters[counter], per_second=rate)
    repaired = repair(raw, lines, str(table.path), strict=strict)
    name = table.layout.columns[counter].name
    total = round(float(np.nanmax(raw.values))) + 1
    lost = total - int(np.unique(raw.values[~np.isnan(raw.values)]).size)
    # The same for all files of which nothing was lost, however long: it is told once then.
    much = f"{lost:,} of {total:,} were lost" if lost else "none was lost"
    remark = f"'{name}' counts the samples and places the rows: {much}."
    remarks = (remark, *_begun_again(table, counter), *repaired.remarks)
    return replace(repaired, remarks=remarks)


def _begun_again(table: _Table, counter: int) -> tuple[str, ...]:
    """A remark on restarts of the device, after which nothing tells how long it was off."""
    rows = restarts(table.body.values[counter])
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
        if index in (table.roles.time, label) or _says_nothing(table, index):
            continue
        why = _why_not(table, index)
        if why == _COUNTING and index == table.counter:
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


def _says_nothing(table: _Table, index: int) -> bool:
    """Whether a column is what a separator at the end of each row makes."""
    words = table.body.words.get(index)
    return words is not None and words.empty and not table.layout.columns[index].named


def _why_not(table: _Table, index: int) -> str:
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
        return _COUNTING if told else _BY_LOOKS
    if index in body.words:
        return "empty" if body.words[index].empty else "words, not numbers"
    alone = is_index(column, table.layout.cells(index)) and goes_on(body.values[index], column)
    return "counting rows only" if alone else ""


def _track(words: Words, repaired: Repaired, author: str) -> Track:
    """The label column as a track."""
    actions: dict[str, int] = {}
    numbers = np.full(len(words.words), UNLABELLED, np.int64)
    for code, word in enumerate(words.words):
        if not is_unlabelled(word):
            numbers[code] = actions.setdefault(word, len(actions))
    codes = numbers[words.codes[repaired.kept]]
    return Track(author, from_codes(codes, repaired.times, list(actions)))
