"""Files that hold named arrays (NumPy, MATLAB, HDF5): which are times, signals and labels.

To such a file its arrays are what columns are to a table: those with a row for each sample are read
by the rules of tables (:mod:`~forcelab.formats.table_columns`), a column of an array being one of
the table's. Where arrays are columns of one table, such as ``t``, ``fx`` and ``fy``, all of them
are signals. Elsewhere those are that are called forces, or the only one there is; any others have
to be named. Groups that are numbered as demonstrations or trials are a demonstration each.
"""

from __future__ import annotations

import math
import re
import sys
import time
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass, field, replace
from itertools import groupby, takewhile
from pathlib import Path
from typing import Any, Final, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import ForcelabError, InputError
from forcelab.formats.recording import (
    ANY_USE,
    ColumnUse,
    ReadOptions,
    Recording,
    Use,
    reading_progress,
)
from forcelab.formats.rosbag_topics import Field, name_forces, values_within, with_sensors
from forcelab.formats.table import TableBody, make_recording, preview_layout
from forcelab.formats.table_columns import ColumnRoles, TextColumn, choose_roles, is_counter_name
from forcelab.formats.table_sniff import (
    CellType,
    Column,
    Dialect,
    Layout,
    cell_type,
    is_label_name,
    is_time_name,
    unit_of_time,
)
from forcelab.formats.timestamps import TimestampReader
from forcelab.jobs import Progress, finish, run_through
from forcelab.text import listed, natural_order

#: Rows looked at to find out what an array holds.
_SAMPLE: Final = 400
#: Bytes of an array that are read at a time, where it need not be read whole.
_BLOCK: Final = 2**20
_ALL: Final = slice(None)
#: An array with more columns holds pictures or a map.
MOST_COLUMNS: Final = 512
#: Bytes that an array may take in memory, and times as many as are stored of it beyond that.
ROOM, MOST_TIMES = 2**26, 100
#: Reading may take a gigabyte and this many times the file's size, and this many seconds of
#: computing and one more for this many of its bytes.
_TIMES_SIZE, _SECONDS, _BYTES_A_SECOND = 32, 30, 10**6
_MEMORY = Path("/proc/self/statm")


ResultT = TypeVar("ResultT")


@dataclass(frozen=True, slots=True, eq=False)
class Array:
    """An array in a file, which is read when it is needed."""

    path: str  #: as people name it, such as ``obs/force``; empty where the file has but one
    shape: tuple[int, ...]
    dtype: np.dtype[Any]  #: objects where it holds words
    #: Gives the part of it that a slice of one of its axes cuts out.
    read: Callable[[slice, int], NDArray[Any]]
    unit: str = ""
    names: tuple[str, ...] = ()  #: of its columns
    codes: Mapping[int, str] = field(default_factory=dict)  #: what its numbers stand for
    rate: float | None = None  #: samples a second, where the file tells them of it
    #: The shape of the parts in which it lies in the file; empty where it is always read whole.
    chunks: tuple[int, ...] = ()

    @property
    def leaf(self) -> str:
        return re.split(r"[/.]", self.path)[-1]

    @property
    def group(self) -> str:
        return self.path[: -len(self.leaf)] if self.leaf else ""

    @property
    def length(self) -> int:
        """How many samples it has, if it has any: no recording has more channels than samples."""
        return max(self.shape, default=1)

    @property
    def is_vector(self) -> bool:
        return math.prod(self.shape) == self.length

    @property
    def is_text(self) -> bool:
        return self.dtype.kind in "OSU"

    @property
    def is_usable(self) -> bool:
        """Whether it may hold samples: numbers or words, a few for each."""
        few = len(self.shape) == 2 and min(self.shape) <= MOST_COLUMNS
        return self.length > 1 and self.dtype.kind in "biufOSUMm" and (few or self.is_vector)

    def width(self, rows: int) -> int:
        return math.prod(self.shape) // rows

    def sized(self) -> str:
        """Its path and its size, as in ``force (1,000 × 3)``."""
        return f"{self.path or 'an array'} ({self.size_text})"

    @property
    def size_text(self) -> str:
        return " × ".join(f"{number:,}" for number in self.shape) or "1"

    @property
    def size(self) -> int:
        """Bytes that it takes in memory."""
        return math.prod(self.shape) * self.dtype.itemsize

    def sample_table(self, rows: int, part: slice = _ALL) -> NDArray[Any]:
        """Its values, or a part of them, with a row for each of so many samples."""
        axis = self.shape.index(rows)
        values = self.read(part, axis)
        if self.is_vector:
            values = values.reshape(-1, 1)
        elif axis:
            values = values.T
        if values.dtype.kind == "M":
            values = values.astype("M8[ns]")
        elif values.dtype.kind == "m":
            values = values.astype("m8[ns]").astype(np.int64)
        return values

    def block(self, rows: int) -> int:
        """How many of its samples are read at a time, so that no chunk is unpacked twice."""
        if not self.chunks:
            return rows
        chunk = self.chunks[self.shape.index(rows)]
        return chunk * max(1, _BLOCK * rows // max(1, self.size) // chunk)


def cut(values: Any, part: slice, axis: int) -> Any:
    """A part of one axis of an array; all of an array that has no such axis."""
    return values[(*[_ALL] * axis, part)] if axis < len(values.shape) else values[()]


def check_size(path: str, values: int, stored: int) -> None:
    """Refuse an array of more values than so many stored bytes can hold, before room is made."""
    if 8 * values > (most := ROOM + MOST_TIMES * stored):
        raise InputError(
            f"{path or 'its array'} is said to hold {values:,} values, of which {stored:,} bytes "
            f"are stored; more than {most // 8:,} are not believed, so write the file again."
        )


@dataclass(frozen=True, slots=True)
class Tree:
    """What a file holds."""

    path: Path
    arrays: tuple[Array, ...]
    remarks: tuple[str, ...] = ()  #: on what of it cannot be read


def read_tree(tree: Tree, options: ReadOptions) -> Generator[Progress, None, list[Recording]]:
    """Read a file's demonstrations, called like it and, where there are several, their groups."""
    recordings: list[Recording] = []
    demonstrations = _demonstrations(tree)
    for name, arrays in demonstrations.items():
        yield Progress(len(recordings), len(demonstrations), f"reading {tree.path.name}")
        chosen = _Choice(tree, arrays, options)
        body = (yield from chosen.body()) if len(demonstrations) == 1 else finish(chosen.body())
        full_name = " ".join(filter(None, (tree.path.stem, name)))
        remarks = (*chosen.remarks(), *tree.remarks)
        recordings.append(
            make_recording(full_name, chosen.layout, chosen.roles, body, chosen.options, remarks)
        )
    return recordings


def preview_tree(tree: Tree, options: ReadOptions) -> tuple[ColumnUse, ...]:
    """What the arrays of a file's first demonstration would be read as."""
    arrays = next(iter(_demonstrations(tree).values()), ())
    try:
        chosen = _Choice(tree, arrays, options)
    except InputError:
        if any((options.signals, options.leave_out, *_single_roles(options))):
            raise
        return _propose(use for array in arrays for use in _unread(array))
    return tuple(chosen.uses())


_NUMBERED = re.compile(
    r"(?P<name>(?:.*?[/.])?(?:demo|demonstration|episode|ep|trial|traj|trajectory|recording|rec|run"
    r"|sequence|seq|session|take|rollout)s?[ _./-]?\d+)[/.](?P<rest>.+)",
    re.IGNORECASE,
)


def _demonstrations(tree: Tree) -> dict[str, list[Array]]:
    """The arrays of each demonstration by its name, which is empty where the file is but one.

    Paths are those within it. What lies outside of all of them belongs to each.
    """
    shared: list[Array] = []
    parts: dict[str, list[Array]] = {}
    for array in tree.arrays:
        match = _NUMBERED.fullmatch(array.path)
        if match is None:
            shared.append(array)
            continue
        parts.setdefault(match["name"], []).append(replace(array, path=match["rest"]))
    if not parts:
        return {"": shared}
    inner = {array.path for arrays in parts.values() for array in arrays}
    shared = [array for array in shared if array.path not in inner]
    names = sorted(parts, key=natural_order)
    steps = re.split(r"(?<=[/.])", names[0])
    shared_steps = min(len(steps) - 1, *(_shared_steps(names[0], name) for name in names))
    above = len("".join(steps[:shared_steps]))
    return {re.sub(r"[/.]", " ", name[above:]): [*parts[name], *shared] for name in names}


class _Choice:
    """What of the arrays of a demonstration is read, as columns of a table."""

    layout: Layout
    parts: list[tuple[Array, int]]  #: the array of each column, and its place in that

    def __init__(self, tree: Tree, arrays: Sequence[Array], options: ReadOptions) -> None:
        self._tree, self._arrays = tree, arrays
        self._usable = [array for array in arrays if array.is_usable]
        self._names: Array | None = None  # the list that names the codes of labels
        self._headings: list[Array] = []  # lists that name the columns of others
        self._wrenches: list[Array] = []  # taken for such, although called forces
        if not self._usable:
            why = "; ".join(f"{r[:1].lower()}{r[1:]}".rstrip(".") for r in tree.remarks)
            raise InputError(
                f"'{tree.path}' holds no array of numbers with a row for each sample"
                f"{f' ({why[:200]})' if why else ''}; there is nothing to import."
            )
        options = _rename(options, lambda name: (name.removeprefix("/"),))
        roles = _single_roles(options)
        names = [*roles, *options.signals, *options.leave_out]
        #: Beginnings of names of columns, whose arrays are told column by column.
        self._apart = {re.sub(r"\d+$", "", name) for name in names}
        for name in names:
            if not (found := self._named(name)):
                raise InputError(f"'{tree.path}' has no array '{name}'; it holds {self._holds()}.")
            if name in roles and (len(found) > 1 or found[0].path == name):
                self._refuse_several(name, found)
        signals = self._signals(options)
        self.rows = signals[0].length
        if timed := self._named(options.time):
            self.rows = timed[0].length
        self._refuse_lengths(signals)
        read = [*signals, *self._others(signals, options)]
        self.read = [array for array in self._usable if any(array is other for other in read)]
        self._columns(signals, options)
        self.options = self._translated(options)
        self.roles: ColumnRoles = choose_roles(self.layout, self.options)
        if self._tree.arrays[0].path:
            # What has no name steps as times where it can; in a remark it is called by its array.
            columns = tuple(replace(column, named=True) for column in self.layout.columns)
            self.layout = replace(self.layout, columns=columns)

    def _refuse_several(self, name: str, found: Sequence[Array]) -> None:
        """Refuse what is more than one column in the role of one."""
        if len(found) > 1:
            cure = f"is a group of {len(found)} arrays; name one of them, such as '{found[0].path}'"
        elif not found[0].is_vector:
            cure = f"has {min(found[0].shape)} columns; name one of them, such as '{name} 1'"
        else:
            return
        raise InputError(f"'{self._tree.path}': '{name}' {cure}.")

    def _named(self, name: str | None) -> list[Array]:
        return [array for array in self._usable if name and self._means(array, name)]

    @staticmethod
    def _means(array: Array, name: str) -> bool:
        """Whether a name is that of an array, of a group that it is in, or of a column of it."""
        bare, _, number = name.rpartition(" ")
        column = number.isdecimal() and 1 <= int(number) <= MOST_COLUMNS
        if not array.path:
            return name.isdecimal() or (column and bare == "column")
        whole = values_within(array.path, name)
        return whole or name in array.names or (column and values_within(array.path, bare))

    def _holds(self) -> str:
        """What is in the file, for errors."""
        return listed([array.sized() for array in self._arrays])

    def _signals(self, options: ReadOptions) -> list[Array]:
        """The arrays that become channels; refused where that is not plain."""
        roles = _single_roles(options)
        whole = [
            array
            for array in self._usable
            if not array.is_text and not values_within(array.path, *roles, *options.leave_out)
        ]
        plain = [
            array
            for array in whole
            if array.dtype.kind not in "Mm"
            and not (array.is_vector and (_is_role_name(array.leaf) or array.codes))
        ]
        requested = [
            array for array in whole if any(self._means(array, name) for name in options.signals)
        ]
        paths = {array.path for array in plain}
        forces = [
            array
            for array in plain
            if name_forces(array.leaf, array.width(array.length)) != ((), ())
            # What robomimic also keeps a step later, for learning.
            and not ("next_obs/" in array.path and array.path.replace("next_obs/", "obs/") in paths)
        ]
        times = self._named(options.time) or [
            array for array in self._usable if array.is_vector and is_time_name(array.leaf)
        ]
        lengths = {time.length for time in times} or {max((a.length for a in plain), default=0)}
        beside = [array for array in plain if array.length in lengths]
        flat = all(array.is_vector for array in beside) and len({a.group for a in beside}) == 1
        found = beside if flat else forces
        if not found and len(beside) == 1:
            found = beside
        signals = [array for array in whole if array in requested or array in found]
        self._whole = [
            array
            for array in signals
            if array in found or values_within(array.path, *options.signals)
        ]
        if not signals:
            candidates = listed([array.sized() for array in whole]) if whole else self._holds()
            raise InputError(
                f"'{self._tree.path}' holds no array that is called a force, and it is not plain "
                f"which are the signals among {candidates}; name what is to be read as a "
                f"signal, an array or a group of them (--signal), and the times (--time) or their "
                f"rate (--rate)."
            )
        return signals

    def _refuse_lengths(self, signals: Sequence[Array]) -> None:
        wrong = [array for array in signals if self.rows not in array.shape]
        if wrong:
            raise InputError(
                f"'{self._tree.path}': {wrong[0].sized()} has not the {self.rows:,} samples of "
                f"{next((a.path for a in signals if a.length == self.rows), 'its times')}; leave "
                f"it out (--leave-out), or import the two as files of their own."
            )

    def _others(self, signals: Sequence[Array], options: ReadOptions) -> list[Array]:
        """What else is read: times, counters, labels; of one name the nearest to the signals."""
        roles = _single_roles(options)
        nearest: dict[str, tuple[tuple[bool, int], Array]] = {}
        for array in self._usable:
            if array in signals:
                continue
            requested = any(self._means(array, name) for name in roles)
            fits = array.is_vector and array.length == self.rows
            if not fits and requested:
                raise InputError(
                    f"'{self._tree.path}': {array.sized()} has not a row for each of the "
                    f"{self.rows:,} samples of {signals[0].path}; name another array."
                )
            left = values_within(array.path, *options.leave_out)
            likely = _is_role_name(array.leaf) or array.is_text or array.codes
            if not fits or left or not (likely or requested):
                continue
            rank = requested, _shared_steps(array.group, signals[0].group)
            if array.leaf not in nearest or rank > nearest[array.leaf][0]:
                nearest[array.leaf] = rank, array
        return [array for _, array in nearest.values()]

    def _is_read(self, array: Array, place: int, name: str, options: ReadOptions) -> bool:
        """Whether a column is read: all of them are, but where some were asked for by name."""
        named = (*options.signals, options.time, options.label, options.counter)
        column = f"{array.path} {place + 1}"
        return array in self._whole or any(other in {name, column} for other in named)

    def _columns(self, signals: Sequence[Array], options: ReadOptions) -> None:
        """Make the columns of a table: `layout`, and the array and place of each in `parts`."""
        fields_ = with_sensors([self._field(array) for array in signals])
        names = {field_.topic: field_.names for field_ in fields_}
        taken = Counter(name for field_ in fields_ for name in field_.names)
        columns: list[Column] = []
        kinds: list[CellType] = []
        cells: list[list[str]] = []
        self.parts = []
        for array in self.read:
            table = array.sample_table(self.rows, slice(_SAMPLE))
            titles = names.get(f"/{array.path}")
            if titles is None:
                titles = (array.path if taken[array.leaf] else array.leaf,)
            unit = "ns" if array.dtype.kind == "m" else array.unit
            given = len(titles) == 1 or not titles[0].startswith(f"{array.leaf or 'column'} 1")
            for place, name in enumerate(titles):
                if array in signals and not self._is_read(array, place, name, options):
                    continue
                self.parts.append((array, place))
                columns.append(Column(name, unit, named=given and bool(array.path)))
                cells.append(_cells(table[:, place]))
                kinds.append(_kind(array, cells[-1]))
        rates = [array.rate for array in signals if array.rate]
        rates += [rate for array in self._arrays if (rate := _stated_rate(array))]
        width = len(columns)
        self.layout = Layout(
            Dialect(",", ".", width),
            tuple(columns),
            tuple(kinds),
            0,
            tuple(zip(*cells, strict=True)),
            rate=rates[0] if rates else None,
            path=self._tree.path,
            line="row",
        )

    def _field(self, array: Array) -> Field:
        """An array's columns as numbers that belong together, with their names."""
        number = array.width(self.rows)
        names, _ = name_forces(array.leaf, number)
        force = bool(names)
        leaf = array.leaf or "column"
        if given := self._column_names(array, number):
            names = given
        elif number == 6 and force and re.search("force", array.leaf, re.IGNORECASE):
            self._wrenches.append(array)
        elif not names or number == 1:
            names = (leaf,) if number == 1 else tuple(f"{leaf} {i + 1}" for i in range(number))
        leaves = tuple((i,) for i in range(number))
        return Field(f"/{array.path}", (), leaves, names, (array.unit,) * number, force)

    def _column_names(self, array: Array, number: int) -> tuple[str, ...]:
        """The names of an array's columns, of its own or in a list of words beside it."""
        if number == 1:
            return ()
        beside = [
            other
            for other in self._usable
            if other.is_text and other.is_vector and other.group == array.group
        ]
        names = array.names
        if self._name_each(number, names):
            return names
        for other in beside:
            if other.length == number != self.rows:
                names = tuple(self._words_of(other))
                if self._name_each(number, names):
                    self._headings.append(other)
                    return names
        return ()

    @staticmethod
    def _name_each(number: int, names: Sequence[str]) -> bool:
        """Whether names are one for each of so many columns."""
        return len(names) == number == len(set(names)) and all(map(str.strip, names))

    @staticmethod
    def _words_of(array: Array) -> list[str]:
        """The words of a list."""
        return _cells(array.sample_table(array.length)[:, 0])

    def _translated(self, options: ReadOptions) -> ReadOptions:
        """The options, with the names that arrays and groups have as columns."""

        def columns(name: str) -> tuple[str, ...]:
            found = [
                column.name
                for column, (array, place) in zip(self.layout.columns, self.parts, strict=True)
                if values_within(array.path, name) or f"{array.path} {place + 1}".strip() == name
            ]
            return tuple(found) or (name,)

        options = _rename(options, columns)
        known = {column.name for column in self.layout.columns}
        left_out = (name for name in options.leave_out if name in known or name.isdecimal())
        return replace(options, leave_out=tuple(left_out))

    def body(self) -> Generator[Progress, None, TableBody]:
        """Read the arrays, that of the times first, while there is nothing else in memory."""
        numeric = [index for index in range(len(self.parts)) if index in self.roles.numeric]
        table = np.empty((self.rows, len(numeric)))
        words: dict[int, TextColumn] = {}
        times, time = None, self.roles.time
        done, total = 0, sum(array.size for array in self.read)
        parts = sorted(enumerate(self.parts), key=lambda part: part[0] != time)
        for array, group in groupby(parts, key=lambda part: part[1][0]):
            places = {index: place for index, (_, place) in group}
            whole = any(index != time and index not in numeric for index in places)  # of words
            step = self.rows if whole else array.block(self.rows)
            if time in places:
                reader, stamps = TimestampReader(self.layout.cells(time), "."), np.empty(self.rows)
            for start in range(0, self.rows, step):
                values = np.empty((0, 0))  # so that those before are gone when these come
                values = array.sample_table(self.rows, slice(start, start + step))
                done += values.nbytes
                if (
                    values.shape == table.shape
                    and values.dtype == np.float64
                    and values.base is None
                    and places.keys() >= set(numeric)
                ):
                    table = values  # which needs no copy
                for index, place in places.items():
                    column = values[:, place]
                    if index == time:
                        text = column.dtype.kind in "OSU"
                        stamps[start : start + step] = (
                            reader.read(_cells(column)) if text else reader.from_array(column)
                        )
                    elif index in numeric:
                        part = table[start : start + step, numeric.index(index)]
                        part[:] = column
                        part[~np.isfinite(part)] = np.nan
                    else:
                        names = array.codes or self._code_names(array)
                        words[index] = _words(column, names)
                yield reading_progress(self.layout.path, done, total)
            if time in places:
                title = self.layout.columns[time]
                unit = unit_of_time(title)
                times = reader.finish(stamps, unit, self.layout.path, title.name)
        ragged = np.zeros(self.rows, np.bool_)
        return TableBody(numeric, table, words, range(1, self.rows + 1), ragged, times)

    def _code_names(self, array: Array) -> Mapping[int, str]:
        """What the codes of an array stand for, by a list of words beside it that is as long."""
        if array.is_text:
            return {}
        used = np.unique(array.sample_table(self.rows))
        for other in self._usable:
            beside = other.group == array.group and other.is_text and other.is_vector
            if beside and not array.names and used.size and other.length < self.rows:
                names = self._words_of(other)
                first = 1 if used[-1] == len(names) else 0
                if used[0] >= -1 and used[-1] < len(names) + first:
                    self._names = other
                    return {-1: "", 0: "", **dict(enumerate(names, first))}
        return dict(enumerate(array.names))

    def remarks(self) -> Iterator[str]:
        """What was read, and what was not."""
        if self._tree.arrays[0].path:
            roles = {self.roles.time: " (times)", self.roles.label: " (labels)"}
            names = dict.fromkeys(
                array.path + roles.get(index, "") for index, (array, _) in enumerate(self.parts)
            )
            yield f"Read from {listed(list(names))}."
        for array in self._wrenches:
            yield (
                f"The six columns of '{array.path or 'the array'}' were read as the force and the "
                f"torque of one sensor, fx to tz; if they are something else, keep a list of their "
                f"names beside them in the file."
            )
        read = [*self.read, self._names, *self._headings]
        others = [array for array in self._arrays if array not in read]
        numbers = [a for a in others if a.is_usable and not a.is_text]
        if numbers:
            names_text = listed([array.path for array in numbers])
            yield f"Other arrays can be read as signals (--signal): {names_text}."
        rest = [a for a in others if a not in numbers and a.length > 1]
        if rest:
            yield f"Nothing was read from {listed([a.sized() for a in rest])}."
        if any(array.dtype == np.uint8 and len(array.shape) > 2 for array in rest):
            yield "Pictures stay in the file; save them as a video and attach that."

    def uses(self) -> Iterator[ColumnUse]:
        """What each array is read as, and each column of one that is read as several things."""
        rows = preview_layout(self.layout, self.options, self.roles)
        if self.layout.rate and self.roles.time is None:
            yield ColumnUse("rate", "Hz", "times", (f"{self.layout.rate:g}",), ("times",), "1")
        for array in self._arrays:
            read = {
                place: row
                for row, (other, place) in zip(rows, self.parts, strict=True)
                if other is array
            }
            width = array.width(self.rows) if read else 1
            apart = len({row.use for row in read.values()}) > 1 or f"{array.path} " in self._apart
            if not read:
                yield from _unread(array)
            elif width == 1 or apart or not array.path:
                table = array.sample_table(self.rows, slice(3))
                for place in range(width):
                    row = read.get(place) or ColumnUse("", "", "left out", _few(table[:, place]))
                    name = array.path if width == 1 else f"{array.path} {place + 1}"
                    name = name if array.path else row.name
                    yield replace(row, name=name, size=array.size_text)
            else:
                cells = _few(array.sample_table(self.rows, slice(1))[0])
                use = read[0].use
                yield ColumnUse(array.path, array.unit, use, cells, _WHOLE, array.size_text)


_WHOLE: Final[tuple[Use, ...]] = ("signal", "left out")
_TEXT: Final[tuple[Use, ...]] = ("labels", "times", "left out")


def _unread(array: Array) -> Iterator[ColumnUse]:
    """An array that is not read, and what it can be made; of a single value nothing is told."""
    choices: tuple[Use, ...] = _WHOLE
    cells: tuple[str, ...] = ()
    if array.is_text:
        choices = _TEXT
    elif array.is_vector:
        choices = ANY_USE
    if array.is_usable:
        with suppress(InputError):  # told when it is chosen
            table = array.sample_table(array.length, slice(3))
            cells = _few(table[:, 0] if array.is_vector else table[0])
    if array.length > 1:
        choices = choices if array.is_usable else ("left out",)
        yield ColumnUse(array.path, array.unit, "left out", cells, choices, array.size_text)


def _propose(uses: Iterator[ColumnUse]) -> tuple[ColumnUse, ...]:
    """Times and labels by their names, where only one array is called so."""
    proposed = tuple(uses)
    called: dict[Use, Callable[[str], object]] = {"times": is_time_name, "labels": is_label_name}
    for use, is_called in called.items():
        found = [
            column.name
            for column in proposed
            if use in column.choices and is_called(re.split(r"[/.]", column.name)[-1])
        ]
        if len(found) == 1:
            proposed = tuple(replace(c, use=use) if c.name in found else c for c in proposed)
    return proposed


def _few(values: NDArray[Any]) -> tuple[str, ...]:
    """The first three of some values, of numbers not all digits."""
    cells = _cells(values[:3])
    return tuple(f"{float(c):.4g}" if values.dtype.kind == "f" and c else c for c in cells)


def _single_roles(options: ReadOptions) -> list[str]:
    """The names that were given for times, labels and counts."""
    return [name for name in (options.time, options.label, options.counter) if name]


def _rename(options: ReadOptions, names: Callable[[str], tuple[str, ...]]) -> ReadOptions:
    """The options with other names for what they name; a role is the first of several."""

    def role(name: str | None) -> str | None:
        return names(name)[0] if name else None

    return replace(
        options,
        time=role(options.time),
        label=role(options.label),
        counter=role(options.counter),
        signals=tuple(new for name in options.signals for new in names(name)),
        leave_out=tuple(new for name in options.leave_out for new in names(name)),
    )


def _shared_steps(path: str, other: str) -> int:
    """How many groups two paths have in common, from the outermost on."""
    pairs = zip(re.split(r"[/.]", path), re.split(r"[/.]", other), strict=False)
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], pairs))


def _is_role_name(name: str) -> bool:
    """Whether a name says that an array holds times, labels or counts."""
    return is_time_name(name) or bool(is_label_name(name)) or is_counter_name(name)


_RATE_NAME = re.compile(r"(?:fs|hz|s?freq|(?:sampl(?:e|ing))?(?:rate|freq(?:uency)?))", re.I)


def is_rate_name(name: str) -> bool:
    """Whether a name says that a number is the samples a second, such as ``Fs``."""
    return _RATE_NAME.fullmatch(re.sub(r"[\W_]", "", name)) is not None


def _stated_rate(array: Array) -> float | None:
    """The samples a second, where an array is nothing but these."""
    if math.prod(array.shape) != 1 or array.dtype.kind not in "iuf" or not is_rate_name(array.leaf):
        return None
    rate = float(array.read(_ALL, 0).reshape(-1)[0])
    return rate if 1e-9 < rate < 1e9 else None


def _cells(values: NDArray[Any]) -> list[str]:
    """Values as the cells of a table."""
    if values.dtype.kind in "OU":
        return [str(value) for value in values.tolist()]
    if values.dtype.kind == "S":
        return [value.decode("utf-8", "replace") for value in values.tolist()]
    if values.dtype.kind == "M":
        return ["" if np.isnat(value) else str(value) for value in values]
    if values.dtype.kind == "b":
        values = values.astype(np.int8)
    if values.dtype.kind == "f":
        return [repr(value).removesuffix(".0") for value in values.astype(np.float64).tolist()]
    return [str(value) for value in values.tolist()]


def _kind(array: Array, cells: Sequence[str]) -> CellType:
    """What an array's column holds, by its first cells."""
    if not array.is_text:
        return CellType.STAMP if array.dtype.kind == "M" else CellType.NUMBER
    kinds = [cell_type(cell) for cell in cells if cell.strip()]
    stamps = kinds.count(CellType.STAMP)
    return CellType.STAMP if stamps and stamps == len(kinds) else CellType.TEXT


def _words(values: NDArray[Any], names: Mapping[int, str]) -> TextColumn:
    """A column of words, in which numbers are called by their names."""
    column = TextColumn()
    if values.dtype.kind in "OSU":
        column.read(_cells(values))
        column.close()
        return column
    different, codes = np.unique(values, return_inverse=True)
    column.read(_cells(different))
    column.close()
    column.codes = codes.astype(np.int32)
    column.words = [
        names.get(int(word), word) if re.fullmatch(r"-?\d{1,9}", word) else word
        for word in column.words
    ]
    return column


#: Opens a file of arrays, which are there as long as it is open.
TreeOpener: TypeAlias = Callable[[Path], AbstractContextManager[Tree]]
#: What is made of a file's arrays, as a job where it takes long.
TreeUse: TypeAlias = Callable[[Tree, ReadOptions], ResultT | Generator[Progress, None, ResultT]]


def read_apart(
    opener: TreeOpener, use: TreeUse[ResultT], path: Path, options: ReadOptions
) -> Generator[Progress, None, ResultT]:
    """Use a file's tree in a process of its own, which a damaged file may end.

    The libraries of HDF5 and MATLAB files are written in C: what a file says wrongly of itself may
    crash them, or keep them busy for ever.
    """
    from forcelab.process import run_in_process  # not every file needs it

    try:
        return (yield from run_in_process(_use_within_bounds, opener, use, path, options))
    except InputError:
        raise
    except ForcelabError as error:
        raise InputError(
            f"'{path}' ended or held up the process that read it, as damaged files do; copy it "
            f"again, or write it again with the program that made it."
        ) from error


def _use_within_bounds(
    opener: TreeOpener, use: TreeUse[ResultT], path: Path, options: ReadOptions
) -> Generator[Progress, None, ResultT]:
    """Use a file's tree with bounds on memory and time, which leave room for what it may need."""
    _set_bounds(path.stat().st_size)
    return (yield from use_tree(opener, use, path, options))


def use_tree(
    opener: TreeOpener, use: TreeUse[ResultT], path: Path, options: ReadOptions
) -> Generator[Progress, None, ResultT]:
    with opener(path) as tree:
        return (yield from run_through(use(tree, options)))


def _set_bounds(size: int) -> None:
    """Let this process take a gigabyte and half a minute, and what a file of that size needs."""
    if sys.platform == "win32":  # it has no such limits
        return
    import resource

    seconds = math.ceil(time.process_time()) + _SECONDS + size // _BYTES_A_SECOND
    limits = {resource.RLIMIT_CPU: seconds}
    with suppress(OSError, ValueError):  # macOS does not tell, nor keep to a bound on memory
        pages = int(_MEMORY.read_text("ascii").split()[0])
        limits[resource.RLIMIT_AS] = pages * resource.getpagesize() + 2**30 + _TIMES_SIZE * size
    for bound, limit in limits.items():
        with suppress(OSError, ValueError):
            _, hard = resource.getrlimit(bound)
            if hard == resource.RLIM_INFINITY or limit < hard:
                resource.setrlimit(bound, (limit, hard))
