"""Columns of text tables: their names, their units, and which hold stamps and labels."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.formats.table.cells import Kind, kind_of

__all__ = [
    "SECONDS_IN",
    "Column",
    "find_column",
    "goes_on",
    "is_index",
    "is_label_name",
    "is_time_name",
    "is_unit",
    "name_columns",
    "unit_of_time",
]

#: Time units as they are written in headers, and how many of each make a second.
SECONDS_IN = {
    **dict.fromkeys(["s", "sec", "secs", "second", "seconds", "sekunden"], 1),
    **dict.fromkeys(["ms", "msec", "msecs", "millis", "millisecond", "milliseconds"], 1_000),
    **dict.fromkeys(["us", "usec", "usecs", "micros", "microsecond", "microseconds"], 1_000_000),
    **dict.fromkeys(["µs", "μs"], 1_000_000),
    **dict.fromkeys(["ns", "nsec", "nsecs", "nanos", "nanosecond", "nanoseconds"], 1_000_000_000),
    **dict.fromkeys(["min", "minutes", "minuten"], 1 / 60),
    **dict.fromkeys(["h", "hours", "stunden"], 1 / 3600),
}
#: Of these none says by itself that a column holds stamps: distances, minima and heights.
_NO_NAMES = frozenset(["s", "min", "h"])

_TOKEN = (
    r"(?:(?:da|[kMGmcdnpµμu])?(?:N|gf|g|m|s|V|A|W|J|T|G|Pa|Hz|bar|Nm|Nmm|rad|deg|dps)"
    r"|[Nn]ewtons?|kp|lbf?|oz|°|°C|°F|%|min|h|°/s|C|K|in|ft|inch|psi|gauss|counts?|lsb|raw|px|dB"
    r"|a\.?u\.?|-)"
)
_UNIT = re.compile(rf"{_TOKEN}(?:\^?-?\d|²|³|⁻¹|⁻²)?(?:[ */·.]{_TOKEN}(?:\^?-?\d|²|³|⁻¹|⁻²)?)*")
_BRACKETS = re.compile(r"(.*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\)|\{([^{}]*)\})\s*")
_SLASH = re.compile(r"(.+?)\s*/\s*(\S+)")

_TIME_WORD = re.compile(
    r"times?|timestamps?|stamp|t|ts|zeit|zeitstempel|uhrzeit|temps|heure|tiempo|hora|tempo|ora|clock"
    r"|epoch|unix(time)?|datetime|elapsed"
)
_TIME_PREFIX = re.compile(
    r"elapsed|sensor|sample|recording|record|system|sys|unix|epoch|rel|relative|abs|absolute|host"
    r"|device|local|utc|gps|ros|rosbag|header|field|stamp|time|date|datum"
)
#: In order of preference.
_LABEL_WORDS = (
    *("label", "labels", "action", "actions", "activity", "annotation", "annotations", "phase"),
    *("class", "tag", "tags", "behaviour", "behavior", "gesture"),
)
_INDEX_WORDS = frozenset(
    ["index", "idx", "unnamed", "row", "frame", "sample", "no", "nr", "seq", "id"]
)


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a table.

    Parameters
    ----------
    name : str
        Unique within its table.
    unit : str
        As in the header, empty if unknown.
    named : bool
        Whether the name stands in the file; others are called by their number.
    """

    name: str
    unit: str = ""
    named: bool = True


def is_unit(text: str) -> bool:
    """Whether a text reads as a physical or a time unit, such as ``m/s^2`` or ``msec``."""
    text = text.strip()
    return text.lower() in SECONDS_IN or _UNIT.fullmatch(text) is not None


def _name_and_unit(cell: str) -> tuple[str, str]:
    """Split ``Fx [N]``, ``time (ms)``, ``t/s`` into a name and a unit."""
    cell = cell.strip()
    bracketed = _BRACKETS.fullmatch(cell)
    if bracketed:
        unit = next(group for group in bracketed.groups()[1:] if group is not None).strip()
        if bracketed[1] and is_unit(unit):
            return bracketed[1], unit
    slashed = _SLASH.fullmatch(cell)
    if slashed and is_unit(slashed[2]):
        return slashed[1], slashed[2]
    return cell, ""


def name_columns(
    header: Sequence[str], units: Sequence[str] = ()
) -> tuple[tuple[Column, ...], tuple[str, ...]]:
    """Make columns of the cells of a header.

    A blank name becomes ``column 3``, a repeated one gets a number behind it (``fx 2``).

    Parameters
    ----------
    header : sequence of str
        One cell a column.
    units : sequence of str
        The cells of a line of units below the header; empty where there is none.

    Returns
    -------
    columns : tuple of Column
        With unique names.
    remarks : tuple of str
        What was renamed.
    """
    split = [_name_and_unit(cell) for cell in header]
    below = [unit.strip().strip("[](){}").strip() for unit in units] or [""] * len(split)
    taken = {name for name, _ in split if name}
    columns: list[Column] = []
    seen: set[str] = set()
    renamed: list[str] = []
    for number, ((name, unit), lower) in enumerate(zip(split, below, strict=True), start=1):
        new, count = name or f"column {number}", 2
        while new in seen or (new != name and new in taken):
            new, count = f"{name or f'column {number}'} {count}", count + 1
        if name and new != name:
            renamed.append(f"'{new}' (column {number})")
        seen.add(new)
        columns.append(Column(new, unit or lower, named=bool(name)))
    remarks = []
    if renamed:
        remarks.append(f"Columns that repeat a name were renamed: {', '.join(renamed)}.")
    return tuple(columns), tuple(remarks)


def _words(name: str) -> list[str]:
    """The words of a name in lower case: ``sensorTime_ms`` is sensor, time, ms."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    return [word for word in re.split(r"[\W_]+", spaced.lower()) if word]


def is_time_name(name: str) -> bool:
    """Whether a column's name says that it holds stamps, such as ``t``, ``time_ms``, ``Zeit``."""
    words = _words(name)
    if len(words) > 1 and words[-1] in SECONDS_IN:
        words.pop()
    if len(words) == 1:
        named = words[0] in SECONDS_IN and words[0] not in _NO_NAMES
        return named or _TIME_WORD.fullmatch(words[0]) is not None
    return bool(
        words
        and _TIME_WORD.fullmatch(words[-1])
        and all(_TIME_PREFIX.fullmatch(word) for word in words[:-1])
    )


def unit_of_time(column: Column) -> str:
    """The time unit that a column's header names, in lower case; empty where it names none."""
    words = _words(column.name)
    for text in (column.unit.lower(), words[-1] if words else ""):
        if text in SECONDS_IN and not (text in _NO_NAMES and text == column.name.lower()):
            return text
    return ""


def is_label_name(name: str) -> int:
    """Rank of a name that says that its column holds labels, 1 for the surest; 0 for others."""
    words = _words(name)
    if not words or len(words) > 2:
        return 0
    if words[-1] in {"id", "name", "names"} and len(words) == 2:
        words.pop()
    return _LABEL_WORDS.index(words[-1]) + 1 if words[-1] in _LABEL_WORDS else 0


def is_index(column: Column, cells: Sequence[str]) -> bool:
    """Whether a column only counts its rows: nameless or called so, and whole numbers in step."""
    named = column.named and not _INDEX_WORDS.intersection(_words(column.name))
    if named or len(cells) < 3:
        return False
    if not all(kind_of(cell) is Kind.NUMBER and cell.strip().isdigit() for cell in cells):
        return False
    counts = [int(cell) for cell in cells]
    return counts == list(range(counts[0], counts[0] + len(counts)))


def goes_on(values: NDArray[np.float64], column: Column) -> bool:
    """Whether a column that starts as :func:`is_index` tells counts its rows to the end.

    In one that is called so rows may have been taken out since; without a name, what does not go
    on by one measures something.
    """
    steps = np.diff(values[~np.isnan(values)])
    return bool((steps > 0).all() if column.named else (steps == 1).all())


def find_column(columns: Sequence[Column], wish: str, role: str, where: str) -> int:
    """Find the column that is wished for, by name, else by 1-based number.

    Parameters
    ----------
    columns : sequence of Column
        The table's columns.
    wish : str
        A name, with or without its case and its unit, or a number.
    role : str
        What it holds, such as ``"times"``, for the error.
    where : str
        The file, for the error.

    Returns
    -------
    int
        Index into `columns`.

    Raises
    ------
    InputError
        If there is no such column.
    """
    names = [column.name for column in columns]
    wanted = _name_and_unit(wish)[0]
    for match in (wish, wanted):
        if match in names:
            return names.index(match)
    folded = [name.casefold() for name in names]
    if wanted.casefold() in folded:
        return folded.index(wanted.casefold())
    if wish.strip().isdecimal() and 1 <= int(wish) <= len(columns):
        return int(wish) - 1
    raise InputError(
        f"{where} has no column '{wish}' of {role}; name one of {', '.join(names)}, "
        f"or give a number from 1 to {len(columns)}."
    )
