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
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import takewhile
from pathlib import Path
from typing import Any, Final, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import ForcelabError, InputError
from forcelab.formats.fields import Field, name_forces, numbered, values_within, with_sensors
from forcelab.formats.recording import (
    ANY_USE,
    ColumnUse,
    ReadOptions,
    Recording,
    Use,
    reading_progress,
)
from forcelab.formats.table import Table, make_recording, preview_layout
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

    def blocks(self, rows: int) -> list[slice]:
        """The parts in which so many samples are read, so that no chunk is unpacked twice."""
        step = rows
        if self.chunks:
            chunk = self.chunks[self.shape.index(rows)]
            step = chunk * max(1, _BLOCK * rows // max(1, self.size) // chunk)
        return [slice(start, start + step) for start in range(0, rows, step)]


def cut(values: Any, part: slice, axis: int) -> Any:
    """A part of one axis of an array; all of an array that has no such axis."""
    return values[(*[_ALL] * axis, part)] if axis < len(values.shape) else values[()]


def check_size(path: str, values: int, stored: int, width: int = 8) -> None:
    """Refuse more values, of so many bytes, than the stored bytes can hold, before room is made."""
    if values > (most := (ROOM + MOST_TIMES * stored) // max(8, width)):
        raise InputError(
            f"{path or 'its array'} is said to hold {values:,} values, of which {stored:,} bytes "
            f"are stored; more than {most:,} are not believed, so write the file again."
        )


def array_of(path: str, values: NDArray[Any]) -> Array:
    """An array that is in memory."""
    return Array(path, values.shape, values.dtype, partial(cut, values))


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
        chosen = _ArrayTable(tree, arrays, options)
        table = (yield from chosen.table()) if len(demonstrations) == 1 else finish(chosen.table())
        full_name = " ".join(filter(None, (tree.path.stem, name)))
        remarks = (*chosen.remarks(), *tree.remarks)
        recordings.append(make_recording(full_name, table, chosen.options, remarks))
    return recordings


def preview_tree(tree: Tree, options: ReadOptions) -> tuple[ColumnUse, ...]:
    """What the arrays of a file's first demonstration would be read as."""
    arrays = next(iter(_demonstrations(tree).values()), ())
    try:
        return tuple(_ArrayTable(tree, arrays, options).uses())
    except InputError:
        if any((options.signals, options.leave_out, *_single_roles(options))):
            raise
        return _propose(use for array in arrays for use in _unread(array))


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
    above = len("".join(_shared_steps([re.split(r"(?<=[/.])", name)[:-1] for name in names])))
    return {re.sub(r"[/.]", " ", name[above:]): [*parts[name], *shared] for name in names}


class _ArrayTable:
    """The arrays of a demonstration that are read, as columns of a table."""

    layout: Layout
    parts: list[tuple[Array, int]]  #: the array of each column, and its place in that

    def __init__(self, tree: Tree, arrays: Sequence[Array], options: ReadOptions) -> None:
        self._tree, self._arrays, self._options = tree, arrays, options
        #: Names that were given for times, labels and counts, and for anything.
        self._single = _single_roles(options)
        self._given = [*self._single, *options.signals, *options.leave_out]
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
        self._check_names()
        signals = self._signals()
        self.rows = (self._named(options.time) or signals)[0].length
        self._refuse_lengths(signals)
        read = [*signals, *self._others(signals)]
        self.read = [array for array in self._usable if array in read]
        self._columns(signals)
        self.options = self._translated()
        self.roles: ColumnRoles = choose_roles(self.layout, self.options)
        if self._tree.arrays[0].path:
            # What has no name steps as times where it can; in a remark it is called by its array.
            columns = tuple(replace(column, named=True) for column in self.layout.columns)
            self.layout = replace(self.layout, columns=columns)

    def _check_names(self) -> None:
        """Refuse names of what is not there, and of more than one column in the role of one."""
        where = f"'{self._tree.path}'"
        for name in self._given:
            if not (found := self._named(name)):
                raise InputError(f"{where} has no array '{name}'; it holds {self._holds()}.")
            if name not in self._single:
                continue
            if len(found) > 1:
                raise InputError(
                    f"{where}: '{name}' is a group of {len(found)} arrays; name one of them, such "
                    f"as '{found[0].path}'."
                )
            if values_within(found[0].path, name) and not found[0].is_vector:
                raise InputError(
                    f"{where}: '{name}' has {min(found[0].shape)} columns; name one of them, such "
                    f"as '{found[0].path} 1'."
                )

    def _named(self, name: str | None) -> list[Array]:
        return [array for array in self._usable if name and self._is_meant(array, [name])]

    @staticmethod
    def _is_meant(array: Array, names: Sequence[str], place: int | None = None) -> bool:
        """Whether a name is that of an array, of a group that it is in, or of a column of it.

        With a place, whether one means the column there.
        """
        if array.path and values_within(array.path, *names):
            return True
        columns = [array.names.index(name) for name in names if name in array.names]
        for title, _, number in (name.rpartition(" ") for name in names):
            own = values_within(array.path, title) if array.path else title in {"", "column"}
            if own and number.isdecimal():
                columns.append(int(number) - 1)
        return bool(columns) if place is None else place in columns

    def _holds(self) -> str:
        """What is in the file, for errors."""
        return listed([array.sized() for array in self._arrays])

    def _signals(self) -> list[Array]:
        """The arrays that become channels; refused where that is not plain."""
        others = (*self._single, *self._options.leave_out)
        whole = [
            array
            for array in self._usable
            if not array.is_text and not values_within(array.path, *others)
        ]
        plain = [
            array
            for array in whole
            if array.dtype.kind not in "Mm"
            and not (array.is_vector and (_is_role_name(array.leaf) or array.codes))
        ]
        paths = {array.path for array in plain}
        forces = [
            array
            for array in plain
            if name_forces(array.leaf, array.width(array.length)) != ((), ())
            # What robomimic also keeps a step later, for learning.
            and not ("next_obs/" in array.path and array.path.replace("next_obs/", "obs/") in paths)
        ]
        times = self._named(self._options.time) or [
            array for array in self._usable if array.is_vector and is_time_name(array.leaf)
        ]
        lengths = {time.length for time in times} or {max((a.length for a in plain), default=0)}
        beside = [array for array in plain if array.length in lengths]
        flat = all(array.is_vector for array in beside) and len({a.group for a in beside}) == 1
        #: Those that are read without being asked for.
        self._default = beside if flat or (len(beside) == 1 and not forces) else forces
        signals = [
            array
            for array in whole
            if array in self._default or self._is_meant(array, self._options.signals)
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

    def _others(self, signals: Sequence[Array]) -> list[Array]:
        """What else is read: times, counters, labels; of one name the nearest to the signals."""

        def rank(array: Array) -> tuple[bool, int]:
            groups = [re.split(r"[/.]", a.group) for a in (array, signals[0])]
            return self._is_meant(array, self._single), len(_shared_steps(groups))

        nearest: dict[str, Array] = {}
        for array in self._usable:
            if array in signals:
                continue
            requested, _ = rank(array)
            fits = array.is_vector and array.length == self.rows
            if not fits and requested:
                raise InputError(
                    f"'{self._tree.path}': {array.sized()} has not a row for each of the "
                    f"{self.rows:,} samples of {signals[0].path}; name another array."
                )
            left = values_within(array.path, *self._options.leave_out)
            likely = _is_role_name(array.leaf) or array.is_text or array.codes
            if fits and not left and (likely or requested):
                nearest[array.leaf] = max(nearest.get(array.leaf, array), array, key=rank)
        return list(nearest.values())

    def _columns(self, signals: Sequence[Array]) -> None:
        """Make the columns of a table: `layout`, and the array and place of each in `parts`."""
        named = with_sensors([self._field(array) for array in signals])
        names = {array.path: field_.names for array, field_ in zip(signals, named, strict=True)}
        taken = {name for field_ in named for name in field_.names}
        requested = [*self._options.signals, *self._single]
        columns: list[Column] = []
        kinds: list[CellType] = []
        cells: list[list[str]] = []
        self.parts = []
        for array in self.read:
            table = array.sample_table(self.rows, slice(_SAMPLE))
            titles = names.get(array.path, (array.path if array.leaf in taken else array.leaf,))
            whole = array in self._default or array not in signals
            unit = "ns" if array.dtype.kind == "m" else array.unit
            given = len(titles) == 1 or not titles[0].startswith(f"{array.leaf or 'column'} 1")
            for place, name in enumerate(titles):
                if not (whole or self._is_meant(array, requested, place)):
                    continue
                self.parts.append((array, place))
                columns.append(Column(name, unit, named=given and bool(array.path)))
                cells.append(_cells(table[:, place]))
                kinds.append(_kind(array, cells[-1]))
        rates = [array.rate for array in signals if array.rate]
        rates += [rate for array in self._arrays if (rate := _stated_rate(array))]
        self.layout = Layout(
            Dialect(",", ".", len(columns)),
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
        number, leaf = array.width(self.rows), array.leaf or "column"
        forces, _ = name_forces(array.leaf, number)
        names = numbered(leaf, number)
        if number > 1:
            given = self._column_names(array, number)
            names = given or forces or names
            if len(forces) == 6 and not given and "force" in array.leaf.lower():
                self._wrenches.append(array)
        leaves = tuple((i,) for i in range(number))
        return Field(f"/{array.path}", (), leaves, names, (array.unit,) * number, bool(forces))

    def _column_names(self, array: Array, number: int) -> tuple[str, ...]:
        """The names of an array's columns, of its own or in a list of words beside it."""
        for other in (None, *self._lists_beside(array)):
            names = tuple(_words_of(other)) if other else array.names
            if len(names) == number == len(set(names)) and all(map(str.strip, names)):
                self._headings += [other] if other else []
                return names
        return ()

    def _lists_beside(self, array: Array) -> list[Array]:
        """The lists of words in an array's group, which may name its columns or its codes."""
        return [
            other
            for other in self._usable
            if other.is_text
            and other.is_vector
            and other.group == array.group
            and other.length < self.rows
        ]

    def _translated(self) -> ReadOptions:
        """The options, with the names that arrays and groups have as columns."""
        options = self._options

        def columns(*names: str) -> tuple[str, ...]:
            found: list[str] = []
            for name in names:
                found += [
                    column.name
                    for column, (array, place) in zip(self.layout.columns, self.parts, strict=True)
                    if self._is_meant(array, [name], place)
                ] or [name]
            return tuple(found)

        def role(name: str | None) -> str | None:
            return columns(name)[0] if name else None

        known = {column.name for column in self.layout.columns}
        left_out = (n for n in columns(*options.leave_out) if n in known or n.isdecimal())
        return replace(
            options,
            time=role(options.time),
            label=role(options.label),
            counter=role(options.counter),
            signals=columns(*options.signals),
            leave_out=tuple(left_out),
        )

    def table(self) -> Generator[Progress, None, Table]:
        """Read the arrays, that of the times first, while there is nothing else in memory."""
        numeric, time = list(self.roles.numeric), self.roles.time
        table = np.empty((self.rows, len(numeric)))
        words: dict[int, TextColumn] = {}
        times, timed = None, None
        if time is not None:
            timed, title = self.parts[time][0], self.layout.columns[time]
            reader, stamps = TimestampReader(self.layout.cells(time), "."), np.empty(self.rows)
        done, total = 0, sum(array.size for array in self.read)
        for array in sorted(self.read, key=lambda array: array is not timed):
            places = {i: place for i, (other, place) in enumerate(self.parts) if other is array}
            of_words = not places.keys() <= {time, *numeric}
            for part in [_ALL] if of_words else array.blocks(self.rows):
                values = array.sample_table(self.rows, part)
                done += values.nbytes
                for index, place in places.items():
                    if index == time and array.is_text:
                        stamps[part] = reader.read(_cells(values[:, place]))
                    elif index == time:
                        stamps[part] = reader.from_array(values[:, place])
                    elif index in numeric:
                        column = table[part, numeric.index(index)]
                        column[:] = values[:, place]
                        column[~np.isfinite(column)] = np.nan
                    else:
                        names = self._code_names(array, values[:, place])
                        words[index] = _words(values[:, place], names)
                del values  # before the next ones come
                yield reading_progress(self.layout.path, done, total)
            if array is timed:
                times = reader.finish(stamps, unit_of_time(title), self.layout.path, title.name)
        ragged = np.zeros(self.rows, np.bool_)
        lines = range(1, self.rows + 1)
        return Table(self.layout, self.roles, numeric, table, words, lines, ragged, times)

    def _code_names(self, array: Array, codes: NDArray[Any]) -> Mapping[int, str]:
        """What the codes in an array stand for, by its own words or a list of them beside it."""
        if array.codes or array.names or array.dtype.kind not in "biuf":
            return array.codes or dict(enumerate(array.names))
        lowest, highest = codes.min(), codes.max()
        for other in self._lists_beside(array):
            names = _words_of(other)
            first = 1 if highest == len(names) else 0
            if lowest >= -1 and highest < len(names) + first:
                self._names = other
                return {-1: "", 0: "", **dict(enumerate(names, first))}
        return {}

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
            by_column = [name for name in self._given if not values_within(array.path, name)]
            apart = len({row.use for row in read.values()}) > 1 or self._is_meant(array, by_column)
            if not read:
                yield from _unread(array)
            elif width == 1 or apart or not array.path:
                table = array.sample_table(self.rows, slice(3))
                for place, name in enumerate(numbered(array.path, width)):
                    row = read.get(place) or ColumnUse("", "", "left out", _few(table[:, place]))
                    yield replace(row, name=name if array.path else row.name, size=array.size_text)
            else:
                cells = _few(array.sample_table(self.rows, slice(1))[0])
                use = read[0].use
                yield ColumnUse(array.path, array.unit, use, cells, _WHOLE, array.size_text)


_WHOLE: Final[tuple[Use, ...]] = ("signal", "left out")
_TEXT: Final[tuple[Use, ...]] = ("labels", "times", "left out")


def _unread(array: Array) -> Iterator[ColumnUse]:
    """An array that is not read, and what it can be made; of a single value nothing is told."""
    choices: tuple[Use, ...] = ("left out",)
    cells: tuple[str, ...] = ()
    if array.is_usable:
        choices = _TEXT if array.is_text else ANY_USE if array.is_vector else _WHOLE
        with suppress(InputError):  # told when it is chosen
            table = array.sample_table(array.length, slice(3))
            cells = _few(table[:, 0] if array.is_vector else table[0])
    if array.length > 1:
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


def _shared_steps(paths: Iterable[Sequence[str]]) -> list[str]:
    """The steps with which all paths begin."""
    alike = takewhile(lambda steps: len(set(steps)) == 1, zip(*paths, strict=False))
    return [steps[0] for steps in alike]


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


def _words_of(array: Array) -> list[str]:
    """The words of a list."""
    return _cells(array.sample_table(array.length)[:, 0])


def _kind(array: Array, cells: Sequence[str]) -> CellType:
    """What an array's column holds, by its first cells."""
    if not array.is_text:
        return CellType.STAMP if array.dtype.kind == "M" else CellType.NUMBER
    kinds = {cell_type(cell) for cell in cells if cell.strip()}
    return CellType.STAMP if kinds == {CellType.STAMP} else CellType.TEXT


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
