"""The rows of a text table as columns, and what each column is: time, label, counter or signal.

A counter goes on by the same step from row to row. Where it goes on by several steps samples were
lost. Where it falls it has begun again at zero: near its largest number by a turn, elsewhere as the
device was restarted, and nobody knows for how long it was off. So may the angle of a motor that
turns at an even speed: a column that is named after what it measures is never taken for a counter.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import LARGEST, Channel
from forcelab.errors import InputError, UnclearRateError
from forcelab.formats.recording import ReadOptions
from forcelab.formats.table_sniff import (
    MISSING,
    SECONDS_IN,
    CellType,
    Column,
    Dialect,
    Layout,
    NotANumberError,
    cell_type,
    find_column,
    is_index,
    is_label_name,
    is_time_name,
    lines,
    numbers,
)
from forcelab.formats.timestamps import TimestampReader, epoch_unit
from forcelab.labels import means_unlabelled
from forcelab.text import counted

#: More rows with another number of cells than this share (and than one) are no slip of a logger.
_RAGGED_SHARE = 0.05
#: Rows read before that share is looked at.
_RAGGED_ROWS = 1000


class TextColumn:
    """A column of words, each stored once."""

    def __init__(self) -> None:
        self._index: dict[str, int] = {}
        self._blocks: list[NDArray[np.int32]] = []
        self.codes = np.empty(0, np.int32)
        self.words: list[str] = []

    def read(self, cells: Sequence[str]) -> None:
        """Append the cells of a block."""
        index = self._index
        codes = (index.setdefault(cell, len(index)) for cell in cells)
        self._blocks.append(np.fromiter(codes, np.int32, len(cells)))

    def close(self) -> None:
        """Join the blocks."""
        if self._blocks:
            self.codes = np.concatenate(self._blocks)
        self._blocks.clear()
        self.words = [word.strip() for word in self._index]

    @property
    def empty(self) -> bool:
        """Whether every cell is empty or a word for a missing sample."""
        return all(word.lower() in MISSING for word in self.words)


@dataclass(frozen=True, slots=True)
class ColumnPlan:
    """What the columns of a table are read as; those not named here are words."""

    numeric: Collection[int]  #: Columns of numbers
    time: int | None = None  #: The column of stamps
    clock: TimestampReader | None = None  #: Its reader
    label: int | None = None  #: The column of labels: words, whatever it holds


@dataclass(frozen=True, slots=True)
class Body:
    """All rows of a table, n of them."""

    values: dict[int, NDArray[np.float64]]  #: of each numeric column, by index
    words: dict[int, TextColumn]  #: the other columns
    stamps: NDArray[np.float64] | None  #: as the timestamp reader gives them
    lines: NDArray[np.int64]  #: 1-based line of each row
    ragged: NDArray[np.bool_]  #: rows with another number of cells: all their samples are missing


def read_body(path: Path, layout: Layout, encoding: str, plan: ColumnPlan) -> Body:
    """Read all rows of a table.

    Errors name the line of the first cell that is not what its column holds. A table in which more
    than 5 % of the rows (and more than one) have another number of cells is refused.
    """
    blocks: list[list[NDArray[np.float64]]] = [[] for _ in layout.columns]
    words = {
        i: TextColumn() for i in range(len(blocks)) if i not in plan.numeric and i != plan.time
    }
    plain = [i for i in range(len(blocks)) if i in plan.numeric]
    if plan.clock and plan.time is not None and plan.clock.plain:
        plain = sorted([*plain, plan.time])
    rest = [i for i in range(len(blocks)) if i not in plain]
    at: list[NDArray[np.int64]] = []
    ragged: list[NDArray[np.bool_]] = []
    for line_numbers, rows in lines(path, encoding, layout.skip, sections=layout.sections):
        at.append(np.array(line_numbers, np.int64))
        quick = _parse_block(rows, layout.dialect, plain)
        columns: dict[int, Sequence[str]]
        if quick is not None:
            ragged.append(np.zeros(len(rows), np.bool_))
            for place, index in enumerate(plain):
                blocks[index].append(quick[:, place])
            columns = {index: _one_column(rows, layout.dialect, index) for index in rest}
        else:
            table = _split(path, line_numbers, rows, layout.dialect)
            ragged.append(_pad_rows(table, layout.dialect))
            _refuse_ragged(path, layout.dialect.width, at, ragged, final=False)
            columns = dict(enumerate(zip(*table, strict=True)))
        index = 0
        try:
            for index, cells in columns.items():
                if index in words:
                    words[index].read(cells)
                elif plan.clock and index == plan.time:
                    blocks[index].append(plan.clock.read(cells))
                else:
                    blocks[index].append(numbers(cells, layout.dialect.decimal))
        except NotANumberError as error:
            shown = error.cell if len(error.cell) <= 40 else error.cell[:37] + "..."
            raise InputError(
                f"{path}, line {line_numbers[error.index]}: {shown!r} in column "
                f"'{layout.columns[index].name}' is not a "
                f"{'stamp' if index == plan.time else 'number'}; mend the cell or empty it."
            ) from error
    _refuse_ragged(path, layout.dialect.width, at, ragged, final=True)
    values = {i: np.concatenate(block) for i, block in enumerate(blocks) if block}
    stamps = values.pop(plan.time, None) if plan.time is not None else None
    for index, column in list(words.items()):
        column.close()
        if layout.kinds[index] is CellType.MISSING and index != plan.label and not column.empty:
            # The head of the table, all that was known so far, left this column empty.
            with suppress(NotANumberError):
                values[index] = numbers(column.words, layout.dialect.decimal)[column.codes]
                del words[index]
    return Body(values, words, stamps, np.concatenate(at), np.concatenate(ragged))


def _split(
    path: Path, line_numbers: Sequence[int], rows: Sequence[str], dialect: Dialect
) -> list[list[str]]:
    """The cells of a block."""
    try:
        return dialect.split(rows)
    except ValueError as error:
        raise InputError(
            f"{path}: {error} between lines {line_numbers[0]} and {line_numbers[-1]}; a cell must "
            "end on the line on which it starts."
        ) from error


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
    try:
        table = np.loadtxt(
            rows,
            delimiter=mark,
            comments=None,
            ndmin=2,
            usecols=columns if others else None,
        )
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


def _refuse_ragged(
    path: Path,
    width: int,
    at: Sequence[NDArray[np.int64]],
    ragged: Sequence[NDArray[np.bool_]],
    *,
    final: bool,
) -> None:
    """Refuse a table once too many of its rows are ragged."""
    if not ragged[-1].any() and not final:
        return
    total = sum(block.size for block in ragged)
    bad = sum(int(block.sum()) for block in ragged)
    if bad > max(1.0, _RAGGED_SHARE * total) and (final or total >= _RAGGED_ROWS):
        line = next(int(a[np.argmax(r)]) for a, r in zip(at, ragged, strict=True) if r.any())
        raise InputError(
            f"{path}, line {line}: {bad:,} of {total:,} rows do not have {width} cells as most "
            "have; export the table again with one separator between cells."
        )


#: After how many values counters begin again: whole bytes, and whole decimal places.
_TURNS = (2**8, 10**3, 2**12, 10**4, 2**15, 2**16, 10**5, 10**6, 2**24, 2**31, 2**32)
#: So near its end, or so near in parts of what it counts to, a counter has turned when it falls.
_NEAR, _NEAR_PART = 1000, 0.05
#: In a column of any name so many rows must count before it is believed to be a counter, and so
#: large a share of all steps must be the same; a name that says so needs less.
_FEWEST, _FEWEST_NAMED = 100, 4
_ALIKE, _ALIKE_NAMED = 0.98, 0.8
_NAME = re.compile(
    r"(?:.*[\W_])?(?:counter|count|cnt|packets?|paket(?:nr|nummer)?|seq|sequence|ticks?|samples?"
    r"|frames?|idx|index|row|nr|no|number|nummer|z(?:ä|ae)hler|lfdnr|compteur|contador)"
    r"(?:[\W_]*(?:nr|no|number|num|id|index|counter|count|#))?",
    re.IGNORECASE,
)
#: Words of quantities that a machine at an even speed raises by whole steps.
_MEASURED = re.compile(
    r"(?:.*[\W\d_])?(?:enc|encoders?|motors?|stepper|wheels?|pulses?|pos|position|distance|weg|disp"
    r"|displacement|travel|stroke|extension|angle|winkel|height|depth)(?:[\W\d_].*)?",
    re.IGNORECASE,
)


def is_counter_name(name: str) -> bool:
    """Whether a column's name says that it counts, such as ``packet_no`` or ``Paket``."""
    return _NAME.fullmatch(_spaced(name)) is not None and not is_measured_name(name)


def is_measured_name(name: str) -> bool:
    """Whether a column's name says that it measures something, such as ``encoder_count``."""
    return _MEASURED.fullmatch(_spaced(name)) is not None


def counter_ticks(values: NDArray[np.float64], named: bool) -> NDArray[np.float64] | None:
    """What a column counts, without its turns and in steps of one; None where it is no counter.

    The ticks, shape (n,), are 0 at the first row that has a value and NaN where a row has none;
    they increase by one where no sample was lost, and where the device was restarted. Of a column
    whose name says that it counts (`named`) less is proof enough.
    """
    given = ~np.isnan(values)
    counts = values[given]
    if counts.size < (_FEWEST_NAMED if named else _FEWEST):
        return None
    if (counts < 0).any() or (counts > 2**53).any() or (counts != np.floor(counts)).any():
        return None
    turn = _counter_range(counts)
    going = np.diff(counts)
    falls = going < 0
    again = np.zeros_like(falls)
    if falls.any():
        if turn is None or not _restart_rows(counts, turn, named)[falls].all():
            return None
        turned = falls & _is_near(counts[:-1], turn)
        again = falls & ~turned
        going = np.where(turned, going + turn, going)
    usual, number = _commonest(going[~again])
    going = np.where(again, usual, going)
    if not named and (going <= 0).any():
        return None  # what stands still now and then is moved by something else
    fewest = (_ALIKE_NAMED if named else _ALIKE) * going.size
    if usual <= 0 or number < fewest or (going % usual != 0).any():
        return None
    result = np.full(values.size, np.nan)
    result[given] = np.concatenate([[0.0], np.cumsum(going / usual)])
    return result


def counter_sub_ticks(
    frames: NDArray[np.float64], subs: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """As :func:`counter_ticks`, of frames and, from 0, the samples within each."""
    given = ~(np.isnan(frames) | np.isnan(subs))
    if not given.any() or (subs[given] < 0).any():
        return None
    return counter_ticks(frames * (subs[given].max() + 1) + subs, named=True)


def counter_restarts(values: NDArray[np.float64]) -> NDArray[np.intp]:
    """The first row after each restart of a counter, which began again before its end."""
    rows = np.flatnonzero(~np.isnan(values))
    counts = values[rows]
    turn = _counter_range(counts)
    if turn is None:
        return rows[:0]
    again = (np.diff(counts) < 0) & ~_is_near(counts[:-1], turn)
    return rows[1:][again]


def _counter_range(counts: NDArray[np.float64]) -> int | None:
    """The number at which a counter that has come this far begins again."""
    return next((turn for turn in _TURNS if turn > counts.max()), None)


def _restart_rows(counts: NDArray[np.float64], turn: int, named: bool) -> NDArray[np.bool_]:
    """Whether a fall from each count to the next may be a turn or a restart, shape (n - 1,).

    A device may be restarted when it has counted little. Then it goes on near zero, and only a
    column whose name says that it counts is believed to have done so; not one that goes round in
    a few numbers.
    """
    before, after = counts[:-1], counts[1:]
    far = (before >= turn / 2) & (after <= turn / 2)
    early = (before >= _FEWEST) & (after <= _NEAR_PART * before)
    return far | early if named else far


def _is_near(counts: NDArray[np.float64], turn: int) -> NDArray[np.bool_]:
    """Whether counts are so near the end that the next one may be beyond it."""
    return counts >= max(turn - max(_NEAR, _NEAR_PART * turn), turn / 2)


def _spaced(name: str) -> str:
    """A name with its words apart, where capitals part them."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name.strip())


def _commonest(steps: NDArray[np.float64]) -> tuple[float, int]:
    """The commonest of some steps, and how many of them there are."""
    found, numbers = np.unique(steps, return_counts=True)
    place = int(numbers.argmax())
    return float(found[place]), int(numbers[place])


#: Words, in lower case, by which coders and programs leave a sample unlabelled, besides those that
#: say it in full.
_UNLABELLED_WORDS = frozenset(
    ["", "nan", "none", "null", "na", "n/a", "<na>", "-", "--", "_", "?", "-1"]
)

_WHOLE = re.compile(r"-?\d+", re.ASCII)
_DATE = re.compile(r"\d{1,4}[-/.]\d\d?[-/.]\d{1,4}.*", re.ASCII)
#: A column of whole numbers with more different values than this measures something.
MOST_LABELS = 100
#: A column with more different words than this names no actions.
_MOST_ACTIONS = 1000
#: Fewer rows cannot show that a nameless column steps evenly.
_FEWEST_STEPS = 5


@dataclass(frozen=True, slots=True)
class ColumnRoles:
    """What the columns of a table are for."""

    time: int | None  #: stamps, as far as names and options tell
    label: int | None
    numeric: tuple[int, ...]  #: read as numbers
    clocks: tuple[int, ...] = ()  #: further columns of stamps, which are no signals
    counter: int | None = None  #: requested to stand in for stamps, as it counts the samples
    left_out: frozenset[int] = frozenset()
    signals: frozenset[int] = frozenset()  #: requested as signals, whatever they look like


def is_unlabelled(word: str) -> bool:
    """Whether a word in a column of labels, in whatever case, says that there is none."""
    return word.lower() in _UNLABELLED_WORDS or means_unlabelled(word)


def choose_roles(layout: Layout, options: ReadOptions, where: str) -> ColumnRoles:
    """Find the columns of stamps and labels by options, names, and how they step."""
    columns = layout.columns
    left_out = frozenset(find_column(columns, w, "values", where) for w in options.leave_out)
    signals = _signals(layout, options, where)
    counter = None
    if options.counter is not None:
        counter = find_column(columns, options.counter, "counts", where)
    taken = left_out | signals
    label = _label(layout, options, where, taken)
    time, clocks = _time(layout, options, where, taken | {label})
    if counter is not None:
        time = None
    for index in signals & (left_out | {time, label, counter}):
        raise InputError(
            f"{where}: column '{columns[index].name}' is asked for as a signal and as something "
            "else; choose one of the two."
        )
    if time is not None and time == label:
        raise InputError(
            f"{where}: column '{layout.columns[time].name}' cannot hold both times and labels; "
            "name another one for either."
        )
    numeric = tuple(
        index
        for index, kind in enumerate(layout.kinds)
        if kind is CellType.NUMBER and index not in (time, label)
    )
    clocks = [index for index in clocks if index not in (time, counter)]
    return ColumnRoles(time, label, numeric, tuple(clocks), counter, left_out, signals)


def counter_columns(
    layout: Layout, roles: ColumnRoles, values: Mapping[int, NDArray[np.float64]], where: str
) -> dict[int, NDArray[np.float64]]:
    """The columns in which a device counts its samples, and what they count."""
    found = {}
    for index, column in enumerate(layout.columns):
        if index not in values or (index != roles.counter and _is_no_counter(roles, index, column)):
            continue
        named = index == roles.counter or (column.named and is_counter_name(column.name))
        counted = counter_ticks(values[index], named)
        if counted is not None:
            found[index] = counted
    found |= _frames(layout, roles, values)
    if not set(values) - set(found) - {roles.label} - roles.left_out:
        # What else there is to see in the file is left a signal.
        found = {index: counts for index, counts in found.items() if index == roles.counter}
    if roles.counter is not None and roles.counter not in found:
        raise InputError(
            f"{where}: column '{layout.columns[roles.counter].name}' does not go on by one step "
            "from row to row, so that it counts no samples; name another one."
        )
    return found


def _frames(
    layout: Layout, roles: ColumnRoles, values: Mapping[int, NDArray[np.float64]]
) -> dict[int, NDArray[np.float64]]:
    """The columns "Frame" and "Sub Frame" of motion capture, where they count together."""
    named = {column.name.lower(): index for index, column in enumerate(layout.columns)}
    frame, sub = named.get("frame"), named.get("sub frame")
    if frame is None or sub is None or frame not in values or sub not in values:
        return {}
    if {frame, sub} & (roles.signals | roles.left_out | {roles.counter}):
        return {}
    counts = counter_sub_ticks(values[frame], values[sub])
    return {} if counts is None else {frame: counts, sub: counts}


def _is_no_counter(roles: ColumnRoles, index: int, column: Column) -> bool:
    """Whether a column is said to be something else than a counter, by its name or by options."""
    said = index in roles.signals or index in roles.left_out
    return said or bool(column.unit) or (column.named and is_measured_name(column.name))


def _signals(layout: Layout, options: ReadOptions, where: str) -> frozenset[int]:
    """The columns that are asked for as signals."""
    found = frozenset(find_column(layout.columns, w, "values", where) for w in options.signals)
    for index in found:
        if layout.kinds[index] is not CellType.NUMBER:
            raise InputError(
                f"{where}: column '{layout.columns[index].name}' holds no numbers, so that it is "
                "no signal; name another one."
            )
    return found


def _label(layout: Layout, options: ReadOptions, where: str, taken: Collection[int]) -> int | None:
    """The column of labels that is asked for or has the surest name."""
    if options.label is not None:
        return find_column(layout.columns, options.label, "labels", where)
    ranked = [
        (is_label_name(column.name), index)
        for index, column in enumerate(layout.columns)
        if column.named and is_label_name(column.name) and not column.unit and index not in taken
    ]
    for _, index in sorted(ranked):
        if layout.kinds[index] in (CellType.TEXT, CellType.MISSING) or _counts_actions(
            layout, index
        ):
            return index
    return None


def _counts_actions(layout: Layout, index: int) -> bool:
    """Whether a numeric column holds a few whole numbers only."""
    present = {word for cell in layout.cells(index) if not is_unlabelled(word := cell.strip())}
    return len(present) <= MOST_LABELS and all(_WHOLE.fullmatch(cell) for cell in present)


def _time(
    layout: Layout, options: ReadOptions, where: str, taken: Collection[int | None]
) -> tuple[int | None, list[int]]:
    """The column of stamps, and all columns named as such."""
    columns = layout.columns
    named = [
        index
        for index, column in enumerate(columns)
        if column.named
        and is_time_name(column.name)
        and (not column.unit or column.unit.lower() in SECONDS_IN)
        and layout.kinds[index] in (CellType.NUMBER, CellType.STAMP)
        and index not in taken
    ]
    if options.time is not None:
        wanted = find_column(columns, options.time, "times", where)
        if layout.kinds[wanted] not in (CellType.NUMBER, CellType.STAMP):
            raise _not_understood(layout, wanted, where)
        return wanted, named
    for index in named:
        if len(set(layout.cells(index))) > 1 or len(layout.sample) == 1:
            return index, named
    for index, column in enumerate(columns):
        if index not in taken and _steps_like_time(layout, index, column):
            return index, named
    if options.rate is None:
        for index, column in enumerate(columns):
            words = layout.kinds[index] is CellType.TEXT and index not in taken
            if words and column.named and is_time_name(column.name):
                raise _not_understood(layout, index, where)
    return None, named


def _not_understood(layout: Layout, index: int, where: str) -> InputError:
    """The error for stamps that are words."""
    shown = next((cell for cell in layout.cells(index) if cell.strip()), "")[:40]
    return UnclearRateError(
        f"{where}: times such as {shown!r} in column '{layout.columns[index].name}' are not "
        "understood; write numbers, 2024-05-31 12:00:00.000 or 31.05.2024 12:00:00,000, or say how "
        "many samples there are a second."
    )


def _steps_like_time(layout: Layout, index: int, column: Column) -> bool:
    """Whether a column that is not named so still can only hold stamps.

    It never falls in the sample, and is written as a date and time, or is a date since 1970 by its
    size, or has a unit of time, or has no name and steps evenly by something else than one.
    """
    kind, decimal = layout.kinds[index], layout.dialect.decimal
    cells = [cell for cell in layout.cells(index) if cell_type(cell, decimal) is kind]
    if kind is CellType.STAMP:
        return len(set(cells)) > 1
    if kind is not CellType.NUMBER or len(cells) < 2:
        return False
    values = np.clip(numbers(cells, decimal), -1e30, 1e30)  # so that no difference overflows
    steps = np.diff(values)
    if (steps < 0).any() or not (steps > 0).any():
        return False
    if epoch_unit(float(values[0])) or column.unit.lower() in SECONDS_IN:
        return True
    if column.named or steps.size < _FEWEST_STEPS or is_index(column, cells):
        return False
    usual = float(np.median(steps))
    low, high = np.quantile(steps, [0.05, 0.95])
    return bool((steps > 0).all() and low > usual / 2 and high < usual * 2)


def label_column(
    layout: Layout, roles: ColumnRoles, words: Mapping[int, TextColumn], where: str
) -> int | None:
    """The column of labels: as chosen before reading, else the only one that holds words.

    Constants, dates, columns with a new word in every other row, and those with more words than
    there are actions are none.
    """
    if roles.label is not None:
        number = len(words[roles.label].words)
        if number > _MOST_ACTIONS:
            raise InputError(
                f"{where}: column '{layout.columns[roles.label].name}' holds {number:,} different "
                f"words, too many to be actions; name the column that holds the labels, or give "
                f"this one another header."
            )
        return roles.label
    candidates = []
    for index, column in words.items():
        if index in roles.left_out:
            continue
        found = {word for word in column.words if not is_unlabelled(word)}
        most = min(max(1, column.codes.size // 2), _MOST_ACTIONS)
        varies = len(column.words) > 1 and len(found) <= most
        if layout.kinds[index] is CellType.STAMP or any(_DATE.fullmatch(word) for word in found):
            continue
        if found and varies:
            candidates.append(index)
    return candidates[0] if len(candidates) == 1 else None


def missing_remark(signals: NDArray[np.float64], channels: Sequence[Channel]) -> list[str]:
    """A remark on samples that are missing (NaN) or cannot have been measured."""
    counts = (~(np.abs(signals) <= LARGEST)).sum(axis=0).tolist()  # nor is NaN
    total = sum(counts)
    if not total:
        return []
    each = ", ".join(
        f"{channel.name} {count:,}"
        for channel, count in zip(channels, counts, strict=True)
        if count
    )
    return [f"{counted(total, 'sample')} {'is' if total == 1 else 'are'} missing ({each})."]


def switch_remark(
    signals: NDArray[np.float64], channels: Sequence[Channel], unasked: Sequence[int]
) -> list[str]:
    """A remark on columns of 0 and 1, of those (`unasked`) that the user has not called signals."""
    names = [channels[i].name for i in unasked if _on_and_off(signals[:, i])]
    if not names:
        return []
    one = len(names) == 1
    columns = f"Column {names[0]} holds" if one else f"Columns {', '.join(names)} hold"
    return [
        f"{columns} nothing but 0 and 1, as of a button, and became "
        f"{'a signal' if one else 'signals'}; leave out what measures nothing."
    ]


def _on_and_off(values: NDArray[np.float64]) -> bool:
    """Whether all values are 0 or 1, and both occur."""
    return bool(((values == 0) | (values == 1)).all() and np.ptp(values) == 1)
