"""Which columns of a text table hold stamps, which hold labels, which hold numbers."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError, UnclearRateError
from forcelab.formats.recording import ReadOptions
from forcelab.formats.table.body import Words
from forcelab.formats.table.cells import Kind, kind_of, numbers
from forcelab.formats.table.clocks import epoch_unit
from forcelab.formats.table.columns import (
    SECONDS_IN,
    Column,
    find_column,
    is_index,
    is_label_name,
    is_time_name,
)
from forcelab.formats.table.counters import is_counter_name, is_measured_name, sub_ticks, ticks
from forcelab.formats.table.layout import Layout
from forcelab.labels import means_unlabelled

__all__ = ["MOST_LABELS", "Roles", "choose_roles", "counters", "is_unlabelled", "label_column"]

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
class Roles:
    """What the columns of a table are for.

    Parameters
    ----------
    time, label : int or None
        Columns of stamps and of labels, as far as names and options tell.
    numeric : tuple of int
        Columns to read as numbers.
    clocks : tuple of int
        Further columns that hold stamps and are no signals.
    counter : int or None
        The column that is asked to stand in for stamps, as it counts the samples.
    left_out : frozenset of int
        Columns that are not wanted.
    signals : frozenset of int
        Columns that are asked for as signals.
    """

    time: int | None
    label: int | None
    numeric: tuple[int, ...]
    clocks: tuple[int, ...] = ()
    counter: int | None = None
    left_out: frozenset[int] = frozenset()
    signals: frozenset[int] = frozenset()


def is_unlabelled(word: str) -> bool:
    """Whether a word in a column of labels, in whatever case, says that there is none."""
    return word.lower() in _UNLABELLED_WORDS or means_unlabelled(word)


def choose_roles(layout: Layout, options: ReadOptions, where: str) -> Roles:
    """Find the columns of stamps and labels by options, names, and how they step.

    Raises
    ------
    InputError
        If an option names no column, or one column for two things, if a column asked for as a
        signal holds words, or if one of stamps is written in a way that is not understood.
    """
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
        if kind is Kind.NUMBER and index not in (time, label)
    )
    clocks = [index for index in clocks if index not in (time, counter)]
    return Roles(time, label, numeric, tuple(clocks), counter, left_out, signals)


def counters(
    layout: Layout, roles: Roles, values: Mapping[int, NDArray[np.float64]], where: str
) -> dict[int, NDArray[np.float64]]:
    """The columns in which a device counts its samples, and what they count.

    Raises
    ------
    InputError
        If the one that is asked for does not count.
    """
    found = {}
    for index, column in enumerate(layout.columns):
        if index not in values or (index != roles.counter and _is_no_counter(roles, index, column)):
            continue
        named = index == roles.counter or (column.named and is_counter_name(column.name))
        counted = ticks(values[index], named)
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
    layout: Layout, roles: Roles, values: Mapping[int, NDArray[np.float64]]
) -> dict[int, NDArray[np.float64]]:
    """The columns "Frame" and "Sub Frame" of motion capture, where they count together."""
    named = {column.name.lower(): index for index, column in enumerate(layout.columns)}
    frame, sub = named.get("frame"), named.get("sub frame")
    if frame is None or sub is None or frame not in values or sub not in values:
        return {}
    if {frame, sub} & (roles.signals | roles.left_out | {roles.counter}):
        return {}
    counts = sub_ticks(values[frame], values[sub])
    return {} if counts is None else {frame: counts, sub: counts}


def _is_no_counter(roles: Roles, index: int, column: Column) -> bool:
    """Whether a column is said to be something else than a counter, by its name or by options."""
    said = index in roles.signals or index in roles.left_out
    return said or bool(column.unit) or (column.named and is_measured_name(column.name))


def _signals(layout: Layout, options: ReadOptions, where: str) -> frozenset[int]:
    """The columns that are asked for as signals."""
    found = frozenset(find_column(layout.columns, w, "values", where) for w in options.signals)
    for index in found:
        if layout.kinds[index] is not Kind.NUMBER:
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
        if layout.kinds[index] in (Kind.TEXT, Kind.MISSING) or _counts_actions(layout, index):
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
        and layout.kinds[index] in (Kind.NUMBER, Kind.STAMP)
        and index not in taken
    ]
    if options.time is not None:
        wanted = find_column(columns, options.time, "times", where)
        if layout.kinds[wanted] not in (Kind.NUMBER, Kind.STAMP):
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
            words = layout.kinds[index] is Kind.TEXT and index not in taken
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
    cells = [cell for cell in layout.cells(index) if kind_of(cell, decimal) is kind]
    if kind is Kind.STAMP:
        return len(set(cells)) > 1
    if kind is not Kind.NUMBER or len(cells) < 2:
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
    layout: Layout, roles: Roles, words: Mapping[int, Words], where: str
) -> int | None:
    """The column of labels: as chosen before reading, else the only one that holds words.

    Of those, constants, dates, columns with a new word in every other row, and with more words than
    there are actions are none.

    Raises
    ------
    InputError
        If the one that was chosen has more words than there are actions.
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
        if layout.kinds[index] is Kind.STAMP or any(_DATE.fullmatch(word) for word in found):
            continue
        if found and varies:
            candidates.append(index)
    return candidates[0] if len(candidates) == 1 else None
