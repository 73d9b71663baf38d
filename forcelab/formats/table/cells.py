"""Cells of text tables: what a cell is, and columns of cells as numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from enum import Enum

import numpy as np
from numpy.typing import NDArray

__all__ = ["MISSING", "STAMP", "Kind", "NotANumberError", "kind_of", "numbers"]

#: Words, in lower case, that stand for a missing sample.
MISSING = (
    frozenset(["", "nan", "+nan", "-nan", "na", "n/a", "<na>", "null", "none", "nil"])
    | {"-", "--", "?", "inf", "+inf", "-inf", "infinity", "+infinity", "-infinity"}
    | {"#n/a", "#num!", "#div/0!", "nan(ind)", "-nan(ind)", "1.#qnan", "-1.#qnan"}
    | {"1.#ind", "-1.#ind", "1.#inf", "-1.#inf"}
)

_POINT = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_COMMA = re.compile(r"[+-]?(?:\d+(?:,\d+)?|,\d+)(?:[eE][+-]?\d+)?", re.ASCII)

#: ISO 8601 date and time, one with its day first and points (31.05.2024 12:00:00), or a time of the
#: day alone. Of the named groups the date's are either all of one of the two or none.
STAMP = re.compile(
    r"(?:(?P<year>\d{4})[-/](?P<month>\d\d?)[-/](?P<day>\d\d?)(?:T|\s+)"
    r"|(?P<first_day>\d\d?)\.(?P<then_month>\d\d?)\.(?P<last_year>\d{4}),?\s+)?"
    r"(?P<hour>\d\d?):(?P<minute>\d\d)(?::(?P<second>\d\d)(?:[.,](?P<fraction>\d+))?)?"
    r"\s*(?P<zone>Z|UTC|[+-]\d\d(?::?\d\d)?)?",
    re.ASCII | re.IGNORECASE,
)


class Kind(Enum):
    """What a cell, or most cells of a column, hold."""

    NUMBER = "number"
    STAMP = "stamp"
    MISSING = "missing"
    TEXT = "text"


class NotANumberError(ValueError):
    """A cell holds neither a number nor a word for a missing sample.

    Parameters
    ----------
    index : int
        Position of the cell in its column of cells.
    cell : str
        What it holds.
    """

    def __init__(self, index: int, cell: str) -> None:
        super().__init__(cell)
        self.index = index
        self.cell = cell


def kind_of(cell: str, decimal: str = ".") -> Kind:
    """Tell what a cell holds, where `decimal` is the decimal mark (``"."`` or ``","``)."""
    cell = cell.strip()
    if cell.lower() in MISSING:
        return Kind.MISSING
    if (_COMMA if decimal == "," else _POINT).fullmatch(cell):
        return Kind.NUMBER
    return Kind.STAMP if STAMP.fullmatch(cell) else Kind.TEXT


def numbers(cells: Sequence[str], decimal: str = ".") -> NDArray[np.float64]:
    """Read a column of cells as numbers.

    Parameters
    ----------
    cells : sequence of str, length n
        The cells as they stand in the file.
    decimal : str
        The decimal mark, ``"."`` or ``","``.

    Returns
    -------
    ndarray, shape (n,)
        The nearest float64 of each number; NaN where the cell is empty or a word for a missing
        sample, or means infinity or a number beyond float64.

    Raises
    ------
    NotANumberError
        At the first cell that is neither.
    """
    # float() alone would also take "1_000", and a point where the decimal mark is a comma.
    foreign = "_" if decimal == "." else "_."
    joined = "".join(cells)
    if not any(mark in joined for mark in foreign):
        plain = cells if decimal == "." else [cell.replace(",", ".") for cell in cells]
        try:
            values = np.fromiter(map(float, plain), np.float64, len(plain))
        except ValueError:
            pass  # the careful way below tells missing samples from mistakes
        else:
            values[~np.isfinite(values)] = np.nan
            return values
    return np.array([_number(i, cell.strip(), decimal) for i, cell in enumerate(cells)], np.float64)


def _number(index: int, cell: str, decimal: str) -> float:
    """One number, NaN for a missing sample."""
    kind = kind_of(cell, decimal)
    if kind is Kind.NUMBER:
        value = float(cell.replace(",", "."))
        return value if math.isfinite(value) else math.nan
    if kind is Kind.MISSING:
        return math.nan
    raise NotANumberError(index, cell)
