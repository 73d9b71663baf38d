"""From the cells of a column of stamps to numbers on one clock.

A unit in the header is believed. Without one, stamps that are a plausible date between 2001 and
2100 as seconds, milliseconds, microseconds or nanoseconds since 1970 are that. Other stamps are
seconds if their median step is below one; as a force recording slower than 1 Hz is none, larger
steps are milliseconds below 500, microseconds below 500,000, and nanoseconds above.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import date

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.formats.table.cells import MISSING, STAMP, Kind, NotANumberError, kind_of, numbers
from forcelab.formats.table.columns import SECONDS_IN

__all__ = ["YEAR_2001", "YEAR_2100", "ClockReader", "RawStamps", "epoch_unit"]

#: Seconds from 1970 to the start of 2100; and a round number of them in September 2001.
YEAR_2100, YEAR_2001 = 4_102_444_800.0, 1e9

_EPOCH_DAY = date(1970, 1, 1).toordinal()
_DAY = 86_400
#: Larger stamps are read as an integer base and a remainder, so that no digit is lost.
_LARGE = 1e8
_PLAIN = re.compile(r"(\d{1,30})(?:([.,])(\d{1,30}))?", re.ASCII)
#: No clock counts further; what does is no stamp, and its sums would overflow.
_ABSURD = 1e30
_UNITS = {"s": 1, "ms": 1_000, "us": 1_000_000, "ns": 1_000_000_000}


@dataclass(frozen=True, slots=True)
class RawStamps:
    """Stamps in the unit of their file, not repaired yet.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Relative to `base`; NaN where there is none.
    base : int
        Added to the values it gives the stamps of the file.
    per_second : float
        Units in a second.
    absolute : bool
        Whether the stamps count from 1970.
    remarks : tuple of str
        On a unit that was guessed.
    """

    values: NDArray[np.float64]
    base: int = 0
    per_second: float = 1
    absolute: bool = False
    remarks: tuple[str, ...] = ()

    def seconds(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Seconds on the file's clock of some of the values."""
        result: NDArray[np.float64] = (self.base + values) / self.per_second
        return result


def epoch_unit(value: float) -> str:
    """The unit in which a number since 1970 is a date from 2001 to 2100; empty if none is."""
    for unit, per_second in _UNITS.items():
        if YEAR_2001 <= value / per_second < YEAR_2100:
            return unit
    return ""


class ClockReader:
    """Reads the cells of one column of stamps, block by block.

    Parameters
    ----------
    sample : sequence of str
        Cells from the start of the column.
    decimal : str
        The decimal mark.
    """

    def __init__(self, sample: Sequence[str], decimal: str) -> None:
        present = [cell.strip() for cell in sample if cell.strip().lower() not in MISSING]
        kinds = [kind_of(cell, decimal) for cell in present]
        self._decimal = decimal
        self._days: dict[tuple[str, str, str], int] = {}
        self._base = 0
        self._written = kinds.count(Kind.STAMP) > len(present) / 2
        self._dated = False
        if self._written:
            match = STAMP.fullmatch(present[kinds.index(Kind.STAMP)])
            with suppress(ValueError):  # a day that is none is named with its line when it is read
                self._base = ((match and self._day(match)) or 0) * _DAY
            self._dated = match is not None and bool(match["year"] or match["last_year"])
        else:
            readable = _readable(present, kinds, decimal) or [0.0]
            middle = float(np.median(np.clip(readable, -_ABSURD, _ABSURD)))
            self._base = int(middle) if abs(middle) >= _LARGE else 0

    @property
    def plain(self) -> bool:
        """Whether the stamps are ordinary numbers, which any reader of numbers may read."""
        return not self._written and not self._base

    def read(self, cells: Sequence[str]) -> NDArray[np.float64]:
        """Read cells as values relative to a fixed base, NaN where a cell is empty.

        Raises
        ------
        NotANumberError
            At the first cell that is no stamp.
        """
        if self._written:
            return np.array([self._stamp(i, c.strip()) for i, c in enumerate(cells)], np.float64)
        if self._base:
            return np.array([self._large(i, c.strip()) for i, c in enumerate(cells)], np.float64)
        return numbers(cells, self._decimal)

    def epoch(self, values: NDArray[np.float64]) -> str:
        """The unit in which values read are dates from 2001 to 2100; empty if in none."""
        return "" if self._written else epoch_unit(self._middle(values))

    def _middle(self, values: NDArray[np.float64]) -> float:
        """The median stamp, as it stands in the file."""
        present = values[np.abs(values) < _ABSURD]
        return self._base + float(np.median(present)) if present.size else 0.0

    def finish(self, values: NDArray[np.float64], unit: str, file: object, name: str) -> RawStamps:
        """Settle the unit of all values read.

        Parameters
        ----------
        values : ndarray, shape (n,)
            What :meth:`read` returned, all blocks together.
        unit : str
            As named in the header, empty where it names none.
        file : object
            As errors name it; a remark is told with its file by whoever tells it.
        name : str
            Of the column.

        Raises
        ------
        InputError
            If the stamps cannot be in the unit that the header names.
        """
        values = np.where(np.abs(values) < _ABSURD, values, np.nan)
        if self._written:
            if self._dated:
                return RawStamps(values, self._base, 1, absolute=True)
            given = ~np.isnan(values)
            midnights = np.cumsum(np.diff(values[given], prepend=-np.inf) < -_DAY / 2)
            values[given] += _DAY * midnights
            return RawStamps(values)
        middle, epoch = self._middle(values), self.epoch(values)
        if unit:
            per_second = SECONDS_IN[unit]
            if epoch and middle / per_second > YEAR_2100:
                raise InputError(
                    f"{file}, column '{name}', is said to be in {unit}, but its stamps are dates "
                    f"in {epoch}; mend the unit in the header."
                )
            absolute = YEAR_2001 <= middle / per_second < YEAR_2100
            return RawStamps(values, self._base, per_second, absolute)
        if epoch:
            return RawStamps(values, self._base, _UNITS[epoch], absolute=True)
        steps = np.abs(np.diff(values[~np.isnan(values)]))
        step = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
        if step < 1:
            return RawStamps(values, self._base)
        guess = "ms" if step < 500 else "us" if step < 500_000 else "ns"
        remark = (
            f"Column '{name}' names no unit and was taken as {guess} by its steps of {step:g}; if "
            "that is wrong, write the unit into the header, as in 'time [s]'."
        )
        return RawStamps(values, self._base, _UNITS[guess], remarks=(remark,))

    def _large(self, index: int, cell: str) -> float:
        """A number minus the base, exactly."""
        match = _PLAIN.fullmatch(cell)
        if match and match[2] in (None, self._decimal):
            whole = int(match[1]) - self._base
            return whole + float(f"0.{match[3]}") if match[3] else float(whole)
        try:
            return float(numbers([cell], self._decimal)[0]) - self._base
        except NotANumberError as error:
            raise NotANumberError(index, cell) from error

    def _stamp(self, index: int, cell: str) -> float:
        """Seconds after the base of a written stamp."""
        match = STAMP.fullmatch(cell)
        if match is None:
            if cell.lower() in MISSING:
                return float("nan")
            raise NotANumberError(index, cell)
        hour, minute, second = (int(match[part] or 0) for part in ("hour", "minute", "second"))
        try:
            day = self._day(match)
        except ValueError as error:
            raise NotANumberError(index, cell) from error
        if self._dated != (day is not None) or hour > 24 or minute > 59 or second > 60:
            raise NotANumberError(index, cell)
        whole = (day or 0) * _DAY - self._base + hour * 3600 + minute * 60 + second
        zone = match["zone"]
        if zone and zone[0] in "+-":
            minutes = int(zone[1:3]) * 60 + int(zone[3:].lstrip(":") or 0)
            whole += (-60 if zone[0] == "+" else 60) * minutes
        fraction = match["fraction"]
        return whole + float(f"0.{fraction}") if fraction else float(whole)

    def _day(self, match: re.Match[str]) -> int | None:
        """Days from 1970 to a stamp's date; None where it has none."""
        if match["year"]:
            key = (match["year"], match["month"], match["day"])
        elif match["last_year"]:
            key = (match["last_year"], match["then_month"], match["first_day"])
        else:
            return None
        if key not in self._days:
            self._days[key] = date(int(key[0]), int(key[1]), int(key[2])).toordinal() - _EPOCH_DAY
        return self._days[key]


def _readable(present: Sequence[str], kinds: Sequence[Kind], decimal: str) -> list[float]:
    """The numbers among some cells."""
    pairs = zip(present, kinds, strict=True)
    return numbers([cell for cell, kind in pairs if kind is Kind.NUMBER], decimal).tolist()
