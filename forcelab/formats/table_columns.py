"""What each column of a text table is: times, labels, a sample counter or a signal.

A counter goes on by the same step from row to row. Where it goes on by several steps samples were
lost. Where it falls it has begun again at zero: near its largest number by a turn, elsewhere as the
device was restarted, and it is not known for how long it was off. So may the angle of a motor that
turns at an even speed: a column that is named after what it measures is never taken for a counter.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import LARGEST, Channel
from forcelab.errors import InputError, UnclearRateError
from forcelab.formats.recording import ReadOptions
from forcelab.formats.samples import LABELS_OF, PROBABILITY_OF
from forcelab.formats.table_sniff import (
    DATA,
    MISSING,
    SECONDS_IN,
    CellType,
    Column,
    Layout,
    cell_type,
    find_column,
    is_index,
    is_label_name,
    is_time_name,
    numbers,
    spaced,
)
from forcelab.formats.timestamps import epoch_unit
from forcelab.formats.track_text import plain_text
from forcelab.labels import means_unlabelled
from forcelab.text import counted


class TextColumn:
    """A column of words, each stored once."""

    def __init__(self) -> None:
        self._index: dict[str, int] = {}
        self._blocks: list[NDArray[np.int32]] = []
        #: Index of each row into `words`, which come in the order of their first occurrence; both
        #: once the column is closed.
        self.codes = np.empty(0, np.int32)
        self.words: list[str] = []

    @property
    def word_count(self) -> int:
        """How many different words it has so far."""
        return len(self._index)

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

    def part(self, rows: slice) -> TextColumn:
        """Some rows of the column, once it is closed."""
        result = TextColumn()
        result.codes, result.words = self.codes[rows], self.words
        return result

    @property
    def empty(self) -> bool:
        """Whether every cell is empty or a word for a missing sample."""
        return all(word.lower() in MISSING for word in self.words)


#: After how many values counters begin again: whole bytes, and whole decimal places.
_TURNS = (2**8, 10**3, 2**12, 10**4, 2**15, 2**16, 10**5, 10**6, 2**24, 2**31, 2**32)
#: So near its end, or so near in parts of what it counts to, a counter has turned when it falls.
_NEAR, _NEAR_PART = 1000, 0.05
#: In a column of any name so many rows must count before it is believed to be a counter, and so
#: large a share of all steps must be the same; a name that says so needs less.
_FEWEST, _FEWEST_NAMED = 100, 4
_ALIKE, _ALIKE_NAMED = 0.98, 0.8
_COUNTER_NAME = re.compile(
    r"(?:.*[\W_])?(?:counter|count|cnt|packets?|paket(?:nr|nummer)?|seq|sequence|ticks?|samples?"
    r"|frames?|idx|index|row|nr|no|number|nummer|z(?:ä|ae)hler|lfdnr|compteur|contador)"
    r"(?:[\W_]*(?:nr|no|number|num|id|index|counter|count|#))?",
    re.IGNORECASE,
)
#: Words of quantities that a machine at an even speed raises by whole steps.
_MEASURED_NAME = re.compile(
    r"(?:.*[\W\d_])?(?:enc|encoders?|motors?|stepper|wheels?|pulses?|pos|position|distance|weg|disp"
    r"|displacement|travel|stroke|extension|angle|winkel|height|depth)(?:[\W\d_].*)?",
    re.IGNORECASE,
)


def is_counter_name(name: str) -> bool:
    """Whether a column's name says that it counts, such as ``packet_no`` or ``Paket``."""
    return _COUNTER_NAME.fullmatch(spaced(name)) is not None and not is_measured_name(name)


def is_measured_name(name: str) -> bool:
    """Whether a column's name says that it measures something, such as ``encoder_count``."""
    return _MEASURED_NAME.fullmatch(spaced(name)) is not None


def counter_ticks(values: NDArray[np.float64], named: bool) -> NDArray[np.float64] | None:
    """What a column counts, without its turns and in steps of one; None where it is no counter.

    The ticks, shape (n,), are 0 at the first row that has a value and NaN where a row has none;
    they increase by one where no sample was lost, and where the device was restarted. Of a column
    whose name says that it counts (`named`) less is proof enough.
    """
    present = ~np.isnan(values)
    # Most columns show at once that they do not count.
    if not all(_are_counts(values[rows][present[rows]]) for rows in (slice(_FEWEST), slice(None))):
        return None
    counts = values[present]
    if counts.size < (_FEWEST_NAMED if named else _FEWEST):
        return None
    turn = _counter_range(counts)
    steps = np.diff(counts)
    falls = steps < 0
    restarts = np.zeros_like(falls)
    if falls.any():
        if turn is None or not _may_restart(counts, turn, named)[falls].all():
            return None
        turns = falls & _is_near_end(counts[:-1], turn)
        restarts = falls & ~turns
        steps = np.where(turns, steps + turn, steps)
        if restarts.all():
            return None
    different, numbers_of = np.unique(steps[~restarts], return_counts=True)
    usual = float(different[numbers_of.argmax()])
    steps = np.where(restarts, usual, steps)
    # What stands still now and then is moved by something else.
    stands = not named and (steps <= 0).any()
    fewest = (_ALIKE_NAMED if named else _ALIKE) * steps.size
    if stands or usual <= 0 or numbers_of.max() < fewest or (steps % usual != 0).any():
        return None
    ticks = np.full(values.size, np.nan)
    ticks[present] = np.concatenate([[0.0], np.cumsum(steps / usual)])
    return ticks


def _are_counts(values: NDArray[np.float64]) -> bool:
    return bool(((values >= 0) & (values <= 2**53) & (values == np.floor(values))).all())


def counter_sub_ticks(
    frames: NDArray[np.float64], subs: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """As :func:`counter_ticks`, of frames and, from 0, the samples within each."""
    present = ~(np.isnan(frames) | np.isnan(subs))
    if not present.any() or (subs[present] < 0).any():
        return None
    return counter_ticks(frames * (subs[present].max() + 1) + subs, named=True)


def counter_restarts(values: NDArray[np.float64]) -> NDArray[np.intp]:
    """The first row after each restart of a counter, which began again before its end."""
    rows = np.flatnonzero(~np.isnan(values))
    counts = values[rows]
    turn = _counter_range(counts)
    if turn is None:
        return rows[:0]
    return rows[1:][(np.diff(counts) < 0) & ~_is_near_end(counts[:-1], turn)]


def _counter_range(counts: NDArray[np.float64]) -> int | None:
    """The number at which a counter that has come this far begins again."""
    return next((turn for turn in _TURNS if turn > counts.max()), None)


def _may_restart(counts: NDArray[np.float64], turn: int, named: bool) -> NDArray[np.bool_]:
    """Whether a fall from each count to the next may be a turn or a restart, shape (n - 1,).

    A device may be restarted when it has counted little. Then it goes on near zero, and only a
    column whose name says that it counts is believed to have done so; not one that goes round in
    a few numbers.
    """
    before, after = counts[:-1], counts[1:]
    far = (before >= turn / 2) & (after <= turn / 2)
    early = (before >= _FEWEST) & (after <= _NEAR_PART * before)
    return far | early if named else far


def _is_near_end(counts: NDArray[np.float64], turn: int) -> NDArray[np.bool_]:
    """Whether counts are so near the end that the next one may be beyond it."""
    return counts >= max(turn - max(_NEAR, _NEAR_PART * turn), turn / 2)


#: Words, in lower case, by which coders and programs leave a sample unlabelled, besides those that
#: say it in full.
_UNLABELLED_WORDS = frozenset(
    ["", "nan", "none", "null", "na", "n/a", "<na>", "-", "--", "_", "?", "-1"]
)

_WHOLE = re.compile(r"-?\d+", re.ASCII)
_DATE = re.compile(r"\d{1,4}[-/.]\d\d?[-/.]\d{1,4}.*", re.ASCII)
#: The two columns of a time as ROS writes it, such as ``stamp.sec`` and ``stamp.nanosec``.
_SECONDS_NAME = re.compile(r"(?P<stem>|.*?[\W_])(?P<nano>n|nano|)(?:secs?|seconds)", re.IGNORECASE)
#: A column of whole numbers with more different values than this measures something.
MOST_LABELS = 100
#: A column with more different words than this names no actions.
_MOST_ACTIONS = 1000
#: Nor does one whose word changes in more of the rows: labels last longer than a sample.
_CHANGING = 0.75
#: Fewer rows cannot show that a nameless column steps evenly.
_FEWEST_STEPS = 5


#: How the labels of several people are read from one table.
SEVERAL_AUTHORS: Final = (
    f"to read labels of several people, call each column '{LABELS_OF}NAME' in the header"
)


def is_unlabelled(word: str) -> bool:
    """Whether a word in a column of labels, in whatever case, says that there is none."""
    return word.lower() in _UNLABELLED_WORDS or means_unlabelled(word)


@dataclass(frozen=True, slots=True)
class ColumnRoles:
    """What options, names and the first rows tell of the columns of a table, by index."""

    time: int | None
    label: int | None
    numeric: tuple[int, ...]  #: read as numbers
    other_times: tuple[int, ...] = ()  #: further columns of times, which are no signals
    counter: int | None = None  #: requested to stand in for times, as it counts the samples
    left_out: frozenset[int] = frozenset()
    signals: frozenset[int] = frozenset()  #: requested as signals, whatever they look like
    #: whose labels columns hold that are named so, as those of exported samples are
    authors: Mapping[int, str] = field(default_factory=dict)
    probabilities: frozenset[int] = frozenset()  #: how sure predictions among these are
    nanoseconds: int | None = None  #: what is to be added to whole seconds in the column of times


def choose_roles(layout: Layout, options: ReadOptions) -> ColumnRoles:
    """Find the columns of times and labels by options, names, and how they step."""

    def column_of(name: str, role: str) -> int:
        return find_column(layout.columns, name, role, str(layout.path))

    def error(index: int, problem: str) -> InputError:
        return InputError(f"{layout.path}: column '{layout.columns[index].name}' {problem}")

    left_out = frozenset(column_of(name, "values") for name in options.leave_out)
    signals = frozenset(column_of(name, "values") for name in options.signals)
    for index in signals:
        if layout.kinds[index] is not CellType.NUMBER:
            raise error(index, "holds no numbers, so that it is no signal; name another one.")
    counter = None if options.counter is None else column_of(options.counter, "counts")
    taken = left_out | signals
    label: int | None
    if options.label is None:
        label, authors = _find_label(layout, taken), _find_authors(layout, taken)
    else:
        label, authors = column_of(options.label, "labels"), {}
    probabilities = frozenset(
        index
        for index, column in enumerate(layout.columns)
        if column.name.removeprefix(PROBABILITY_OF) in authors.values() and index not in taken
    )
    taken |= probabilities.union(authors, () if label is None else [label])
    pairs = {s: ns for s, ns in _find_pairs(layout).items() if not {s, ns} & taken}
    named = sorted({*_time_columns(layout), *pairs} - {*pairs.values(), *taken})
    if options.time is None:
        time = _find_time(layout, named, pairs, taken, required=options.rate is None)
    elif layout.kinds[time := column_of(options.time, "times")] not in DATA:
        raise _not_understood(layout, time)
    time = next((seconds for seconds, rest in pairs.items() if rest == time), time)
    if counter is not None:
        time = None
    nanoseconds = None if time is None else pairs.get(time)
    for index in signals & (left_out | {time, label, counter}):
        raise error(index, "is asked for as a signal and as something else; choose one of the two.")
    if time is not None and (time == label or time in authors):
        raise error(time, "cannot hold both times and labels; name another one for either.")
    kinds, used = enumerate(layout.kinds), {time, label, *authors}
    times = (*named, *pairs.values())
    return ColumnRoles(
        time=time,
        label=label,
        numeric=tuple(i for i, kind in kinds if kind is CellType.NUMBER and i not in used),
        other_times=tuple(i for i in times if i not in (time, counter, nanoseconds)),
        counter=counter,
        left_out=left_out,
        signals=signals,
        authors=authors,
        probabilities=probabilities,
        nanoseconds=nanoseconds,
    )


def _find_authors(layout: Layout, taken: Collection[int]) -> dict[int, str]:
    """The columns whose names say whose labels they hold."""
    return {
        index: plain_text(author)
        for index, column in enumerate(layout.columns)
        if index not in taken
        and column.name.startswith(LABELS_OF)
        and (author := column.name.removeprefix(LABELS_OF).strip())
    }


def _find_label(layout: Layout, taken: Collection[int]) -> int | None:
    """The column with the surest name for labels, if it may hold some."""
    ranked = [
        (is_label_name(column.name), index)
        for index, column in enumerate(layout.columns)
        if column.named and is_label_name(column.name) and not column.unit and index not in taken
    ]
    for _, index in sorted(ranked):
        if layout.kinds[index] in (CellType.TEXT, CellType.MISSING):
            return index
        cells = {word for cell in layout.cells(index) if not is_unlabelled(word := cell.strip())}
        if len(cells) <= MOST_LABELS and all(_WHOLE.fullmatch(cell) for cell in cells):
            return index
    return None


def _time_columns(layout: Layout) -> list[int]:
    """The columns that are named as times and can be read as such."""
    return [
        index
        for index, column in enumerate(layout.columns)
        if column.named
        and is_time_name(column.name)
        and (not column.unit or column.unit.lower() in SECONDS_IN)
        and layout.kinds[index] in DATA
    ]


def _find_pairs(layout: Layout) -> dict[int, int]:
    """Columns of whole seconds, each with that of the nanoseconds beyond, as ROS has them."""
    found: dict[str, dict[str, int]] = {"": {}, "n": {}}
    for index, column in enumerate(layout.columns):
        match = _SECONDS_NAME.fullmatch(column.name)
        if match is None or not column.named or layout.kinds[index] is not CellType.NUMBER:
            continue
        decimal = layout.dialect.decimal
        cells = [c for c in layout.cells(index) if cell_type(c, decimal) is CellType.NUMBER]
        values = numbers(cells, decimal)
        part = match["nano"][:1].lower()
        if (values == np.floor(values)).all() and (not part or (values < 1e9).all()):
            found[part].setdefault(match["stem"].lower(), index)
    return {index: found["n"][stem] for stem, index in found[""].items() if stem in found["n"]}


def _find_time(
    layout: Layout,
    named: Sequence[int],
    pairs: Collection[int],
    taken: Collection[int],
    *,
    required: bool,
) -> int | None:
    """The first column of times by its name, else by how it steps.

    A column that is named so but holds words is refused where one is `required`.
    """
    for index in named:
        if index in pairs or len(set(layout.cells(index))) > 1 or len(layout.sample) == 1:
            return index
    for index, column in enumerate(layout.columns):
        if index not in taken and _steps_like_time(layout, index, column):
            return index
    for index, column in enumerate(layout.columns) if required else ():
        words = layout.kinds[index] is CellType.TEXT and index not in taken
        if words and column.named and is_time_name(column.name):
            raise _not_understood(layout, index)
    return None


def _not_understood(layout: Layout, index: int) -> UnclearRateError:
    """The error for times that are words."""
    excerpt = next((cell for cell in layout.cells(index) if cell.strip()), "")[:40]
    return UnclearRateError(
        f"{layout.path}: times such as {excerpt!r} in column '{layout.columns[index].name}' are "
        f"not "
        "understood; write numbers, 2024-05-31 12:00:00.000 or 31.05.2024 12:00:00,000, or say how "
        "many samples there are a second."
    )


def _steps_like_time(layout: Layout, index: int, column: Column) -> bool:
    """Whether a column that is not named so still can only hold times.

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


def counter_columns(
    layout: Layout, roles: ColumnRoles, values: Mapping[int, NDArray[np.float64]]
) -> dict[int, NDArray[np.float64]]:
    """The columns in which a device counts its samples, and what they count."""
    counters = {}
    for index, counts in values.items():
        column, requested = layout.columns[index], index == roles.counter
        measured = column.unit or (column.named and is_measured_name(column.name))
        if not requested and (measured or index in roles.signals | roles.left_out):
            continue
        named = requested or (column.named and is_counter_name(column.name))
        if (ticks := counter_ticks(counts, named)) is not None:
            counters[index] = ticks
    counters |= _frame_columns(layout, roles, values)
    if not set(values) - set(counters) - {roles.label} - roles.left_out:
        # What else there is to see in the file is left a signal.
        counters = {index: ticks for index, ticks in counters.items() if index == roles.counter}
    if roles.counter is not None and roles.counter not in counters:
        raise InputError(
            f"{layout.path}: column '{layout.columns[roles.counter].name}' does not go on by one "
            "step from row to row, so that it counts no samples; name another one."
        )
    return counters


def _frame_columns(
    layout: Layout, roles: ColumnRoles, values: Mapping[int, NDArray[np.float64]]
) -> dict[int, NDArray[np.float64]]:
    """The columns "Frame" and "Sub Frame" of motion capture, where they count together."""
    named = {column.name.lower(): index for index, column in enumerate(layout.columns)}
    frame, sub = named.get("frame"), named.get("sub frame")
    if frame is None or sub is None or frame not in values or sub not in values:
        return {}
    if {frame, sub} & (roles.signals | roles.left_out | {roles.counter}):
        return {}
    ticks = counter_sub_ticks(values[frame], values[sub])
    return {} if ticks is None else {frame: ticks, sub: ticks}


def label_column(layout: Layout, roles: ColumnRoles, words: Mapping[int, TextColumn]) -> int | None:
    """The column of labels: as chosen before reading, else the only one fit by its words."""
    if roles.label is not None:
        number = len(words[roles.label].words)
        if number > _MOST_ACTIONS:
            raise InputError(
                f"{layout.path}: column '{layout.columns[roles.label].name}' holds {number:,} "
                f"different words, too many to be actions; name the column that holds the labels, "
                f"or give this one another header."
            )
        return roles.label
    candidates = word_columns(layout, roles, words)
    return candidates[0] if len(candidates) == 1 and not roles.authors else None


def word_columns(layout: Layout, roles: ColumnRoles, words: Mapping[int, TextColumn]) -> list[int]:
    """The columns that may hold labels by their words, where no name or option tells.

    Constants, dates, columns whose word is another one in most rows, and those with more words than
    there are actions cannot.
    """
    candidates = []
    for index, column in words.items():
        if index in roles.left_out or index in roles.authors:
            continue
        if layout.kinds[index] is CellType.STAMP:
            continue
        actions = {word for word in column.words if not is_unlabelled(word)}
        most = min(max(1, column.codes.size // 2), _MOST_ACTIONS)
        dates = any(_DATE.fullmatch(word) for word in actions)
        lasting = np.count_nonzero(np.diff(column.codes)) <= _CHANGING * column.codes.size
        if not dates and lasting and len(column.words) > 1 and 0 < len(actions) <= most:
            candidates.append(index)
    return candidates


def missing_remark(signals: NDArray[np.float64], channels: Sequence[Channel]) -> list[str]:
    """A remark on samples that are missing (NaN) or cannot have been measured."""
    measured = (np.count_nonzero((v >= -LARGEST) & (v <= LARGEST)) for v in signals.T)  # nor is NaN
    counts = [len(signals) - int(number) for number in measured]
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
    signals: NDArray[np.float64], channels: Sequence[Channel], unrequested: Sequence[int]
) -> list[str]:
    """A remark on channels of 0 and 1, of those that were not requested as signals."""
    names = [channels[i].name for i in unrequested if _is_switch(signals[:, i])]
    if not names:
        return []
    single = len(names) == 1
    columns = f"Column {names[0]} holds" if single else f"Columns {', '.join(names)} hold"
    return [
        f"{columns} nothing but 0 and 1, as of a button, and became "
        f"{'a signal' if single else 'signals'}; leave out what measures nothing."
    ]


def _is_switch(values: NDArray[np.float64]) -> bool:
    """Whether all values are 0 or 1, and both occur."""
    return bool(((values == 0) | (values == 1)).all() and np.ptp(values) == 1)
