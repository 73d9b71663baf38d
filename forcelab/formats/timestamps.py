"""Timestamps as found in files: their unit, and the rules by which they are repaired.

A unit in the header is believed. Without one, stamps that are a plausible date between 2001 and
2100 as seconds, milliseconds, microseconds or nanoseconds since 1970 are that. Other stamps are
seconds if their median step is below one; as a force recording slower than 1 Hz is none, larger
steps are milliseconds below 500, microseconds below 500,000, and nanoseconds above.

The rules, in this order. Each speaks one sentence, and refuses the file when asked to be strict.

1. Rows without a stamp, or with one beyond 1e30, are dropped.
2. Rows stamped after the year 2100 on an absolute clock are dropped.
3. Rows further from the median stamp than 1000 times the length of the rest of the recording are
   dropped, if they are at most 5 % of all, or one row of five or more: a clock that was not set
   yet, or one torn reading.
4. If at least four in five runs of equal stamps have the same length of two or more (within 10 %,
   or one row), the logger stamped bursts: a burst's rows are spread evenly from its stamp to the
   next one. A shorter first burst ends where the second starts; other short bursts, and those
   before a gap, keep the usual step. Otherwise the first row of each run is kept.
5. Where a jitter is allowed, rows keep their order: stamps that do not increase are replaced by the
   nearest ones that do not fall (isotonic regression, least squares), and rows that share one then
   are spread evenly halfway to the stamps before and after. If that moves one by more than the
   jitter, the file is refused. No row is dropped, neither here nor by the second half of rule 4.
6. Where stamps still do not increase, the fewest rows are dropped that leave increasing stamps. If
   that is more than a tenth, the file is refused.
7. Gaps of more than five median periods are counted. They are never filled.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import date
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import GAP_PERIODS, median_step
from forcelab.errors import InputError
from forcelab.formats.table_sniff import (
    MISSING,
    SECONDS_IN,
    STAMP,
    CellType,
    NotANumberError,
    cell_type,
    numbers,
)
from forcelab.text import counted, were

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
class RawTimestamps:
    """Stamps in the unit of their file, not repaired yet."""

    values: NDArray[np.float64]  #: relative to `base`; NaN where there is none
    base: int = 0
    per_second: float = 1  #: units in a second
    absolute: bool = False  #: whether the stamps count from 1970
    remarks: tuple[str, ...] = ()  #: on a unit that was guessed

    def seconds(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Seconds on the file's clock of some of the values."""
        return (self.base + values) / self.per_second


def epoch_unit(value: float) -> str:
    """The unit in which a number since 1970 is a date from 2001 to 2100; empty if none is."""
    for unit, per_second in _UNITS.items():
        if YEAR_2001 <= value / per_second < YEAR_2100:
            return unit
    return ""


class TimestampReader:
    """Reads one column of stamps block by block, whose notation the first cells (`sample`) tell."""

    def __init__(self, sample: Sequence[str], decimal: str) -> None:
        present = [cell.strip() for cell in sample if cell.strip().lower() not in MISSING]
        kinds = [cell_type(cell, decimal) for cell in present]
        self._decimal = decimal
        self._days: dict[tuple[str, str, str], int] = {}
        self._base = 0
        self._written = kinds.count(CellType.STAMP) > len(present) / 2
        self._dated = self._halved = False
        if self._written and (match := STAMP.fullmatch(present[kinds.index(CellType.STAMP)])):
            self._dated = bool(match["year"] or match["last_year"])
            self._halved = bool(match["half"])
            with suppress(ValueError):  # a day that is none is named with its line when it is read
                self._base = (self._day(match) or 0) * _DAY
        else:
            pairs = zip(present, kinds, strict=True)
            readable = [cell for cell, kind in pairs if kind is CellType.NUMBER] or ["0"]
            values = np.clip(numbers(readable, decimal), -_ABSURD, _ABSURD)
            middle = float(np.median(values))
            self._base = int(middle) if abs(middle) >= _LARGE else 0

    @property
    def plain(self) -> bool:
        """Whether the stamps are ordinary numbers, which any reader of numbers may read."""
        return not self._written and not self._base

    def read(self, cells: Sequence[str]) -> NDArray[np.float64]:
        """Read cells as values relative to a fixed base, NaN where a cell is empty."""
        if self._written:
            return np.array([self._stamp(i, c.strip()) for i, c in enumerate(cells)], np.float64)
        if self._base:
            return np.array([self._large(i, c.strip()) for i, c in enumerate(cells)], np.float64)
        return numbers(cells, self._decimal)

    def from_array(self, stamps: NDArray[Any]) -> NDArray[np.float64]:
        """As `read`, of numbers, or of dates and times of the day as NumPy holds them."""
        if stamps.dtype.kind not in "Mm":
            # A whole number of nanoseconds since 1970 has more digits than a float64.
            whole = stamps.dtype.kind in "iu" and int(stamps.max(initial=0)) < 2**63
            values = (stamps.astype(np.int64 if whole else np.float64) - self._base).astype(
                np.float64, copy=False
            )
            values[~np.isfinite(values)] = np.nan
            return values
        per_second = _UNITS[np.datetime_data(stamps.dtype)[0]]
        ticks = stamps.astype(np.int64) - self._base * per_second
        values = ticks / per_second
        values[np.isnat(stamps)] = np.nan
        return values

    def epoch(self, values: NDArray[np.float64]) -> str:
        """The unit in which values read are dates from 2001 to 2100; empty if in none."""
        return "" if self._written else epoch_unit(self._middle(values))

    def _middle(self, values: NDArray[np.float64]) -> float:
        """The median stamp, as it stands in the file."""
        present = values[np.abs(values) < _ABSURD]
        if not present.size:
            return 0.0
        return self._base + float(np.median(present, overwrite_input=True))

    def finish(
        self, values: NDArray[np.float64], unit: str, file: object, name: str
    ) -> RawTimestamps:
        """Settle the unit of all values read; `unit` is the header's, empty where it names none."""
        if not (usable := np.abs(values) < _ABSURD).all():
            values = np.where(usable, values, np.nan)
        if self._written:
            if self._dated:
                return RawTimestamps(values, self._base, 1, absolute=True)
            present = ~np.isnan(values)
            midnights = np.cumsum(np.diff(values[present], prepend=-np.inf) < -_DAY / 2)
            values[present] += _DAY * midnights
            return RawTimestamps(values)
        middle = self._middle(values)
        epoch = epoch_unit(middle)
        if unit:
            per_second = SECONDS_IN[unit]
            if epoch and middle / per_second > YEAR_2100:
                raise InputError(
                    f"{file}, column '{name}', is said to be in {unit}, but its stamps are dates "
                    f"in {epoch}; mend the unit in the header."
                )
            absolute = YEAR_2001 <= middle / per_second < YEAR_2100
            return RawTimestamps(values, self._base, per_second, absolute)
        if epoch:
            return RawTimestamps(values, self._base, _UNITS[epoch], absolute=True)
        steps = abs(np.diff(values[~np.isnan(values)]))
        steps = steps[steps > 0]
        step = float(np.median(steps, overwrite_input=True)) if steps.size else 0.0
        if step < 1:
            return RawTimestamps(values, self._base)
        guess = "ms" if step < 500 else "us" if step < 500_000 else "ns"
        remark = (
            f"Column '{name}' names no unit and was taken as {guess} by its steps of {step:g}; if "
            "that is wrong, write the unit into the header, as in 'time [s]'."
        )
        return RawTimestamps(values, self._base, _UNITS[guess], remarks=(remark,))

    def _large(self, index: int, cell: str) -> float:
        """A number minus the base, exactly."""
        match = _PLAIN.fullmatch(cell)
        if match and match[2] in (None, self._decimal):
            return int(match[1]) - self._base + float(f"0.{match[3] or 0}")
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
        half = match["half"]
        hours = range(1, 13) if half else range(25)
        wrong = self._dated != (day is not None) or self._halved != bool(half)
        if wrong or hour not in hours or minute > 59 or second > 60:
            raise NotANumberError(index, cell)
        if half:
            hour = hour % 12 + (12 if half in "pP" else 0)
        days = int(match["days"] or day or 0)
        seconds = days * _DAY - self._base + hour * 3600 + minute * 60 + second
        zone = match["zone"]
        if zone and zone[0] in "+-":
            minutes = int(zone[1:3]) * 60 + int(zone[3:].lstrip(":") or 0)
            seconds += (-60 if zone[0] == "+" else 60) * minutes
        return seconds + float(f"0.{match['fraction'] or 0}")

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


#: Shares and factors of the rules above.
_FAR_LENGTHS, _FAR_SHARE, _FAR_ROWS = 1000.0, 0.05, 5
_BURST_SHARE, _BURST_SLACK = 0.8, 0.1
#: Share of rows whose stamps repeat from which on a clock was too coarse for them.
_MANY_REPEATS = 0.1
_BACK_SHARE = 0.1


@dataclass(frozen=True, slots=True)
class RepairedTimestamps:
    """Stamps after repair, m of them in n rows."""

    times: NDArray[np.float64]  #: seconds from the first one, strictly increasing
    kept: NDArray[np.bool_]  #: which rows they are of, shape (n,)
    start: float  #: the first stamp in seconds on the file's own clock
    remarks: tuple[str, ...]  #: a sentence for each rule that had to act

    @property
    def rows(self) -> NDArray[np.int64]:
        """The row of each."""
        return np.flatnonzero(self.kept)


@dataclass(slots=True)
class _Rows:
    """The rows that are left, while rules work on them."""

    where: str
    lines: NDArray[np.int64] | range
    strict: bool
    kept: NDArray[np.bool_]  #: of all rows those that are left
    values: NDArray[np.float64]  #: of these
    row: str
    line: str
    remarks: list[str] = field(default_factory=list)

    def locate(self, row: int) -> str:
        """Where one of the rows that are left stands in the file."""
        return f"{self.where}, {self.line} {self.lines[np.flatnonzero(self.kept)[row]]}"

    def report(self, sentence: str, row: int) -> None:
        """Remark on what a rule did; refuse it if strict."""
        if self.strict:
            raise InputError(
                f"{self.locate(row)}: {sentence}; mend the file or let it be repaired."
            )
        self.remarks.append(f"{sentence[0].upper()}{sentence[1:]}.")

    def drop(self, bad: NDArray[np.bool_], sentence: str) -> None:
        """Drop the rows marked, if any, and say so; ``{rows}`` is their count."""
        number = int(bad.sum())
        if not number:
            return
        text = sentence.format(rows=counted(number, self.row), were=were(number))
        self.report(text, int(np.argmax(bad)))
        self.kept[self.kept] = ~bad
        self.values = self.values[~bad]
        if self.values.size < 2:
            raise InputError(f"{self.where}: {text}, and too few are left; look at its stamps.")


def repair_timestamps(
    raw: RawTimestamps,
    lines: NDArray[np.int64] | range,
    where: str,
    *,
    strict: bool = False,
    jitter: float = 0.0,
    row: str = "row",
    line: str = "line",
    bursts: bool = True,
) -> RepairedTimestamps:
    """Make stamps increase by the rules of this module; `strict` refuses instead of repairing.

    Values come in the order of the file, NaN where a row has none; `lines` are 1-based and `where`
    names the file, for errors. Stamps are moved by at most `jitter` seconds. `row` and `line` are
    what has a stamp and what its number counts, in the words of the file. Without `bursts` rule 4
    only keeps the first row of each run. The values of `raw` become the times, as there may be no
    room for both.
    """
    rows = _Rows(where, lines, strict, np.ones(raw.values.size, np.bool_), raw.values, row, line)
    rows.drop(np.isnan(rows.values), "{rows} without a usable stamp {were} dropped")
    if raw.absolute:
        late = _marked(lambda values: raw.seconds(values) > YEAR_2100, rows.values)
        rows.drop(late, "{rows} stamped after 2100 {were} dropped")
    _drop_far(rows)
    _treat_repeats(rows, jitter, bursts)
    if jitter > 0:
        _sort_backward(rows, raw.per_second, jitter)
    _drop_backward(rows)
    if rows.values.size < 2:
        raise InputError(f"{where} has fewer than two stamped {row}s; a recording needs more.")
    start, times = float(raw.seconds(rows.values[:1])[0]), rows.values
    times -= times[0]
    times /= raw.per_second
    _report_gaps(rows, times)
    return RepairedTimestamps(times, rows.kept, start, tuple(rows.remarks))


#: Stamps that are looked at at a time, where there may be no room for copies of all.
_BLOCK = 2**17


def _marked(
    condition: Callable[..., NDArray[np.bool_]], *arrays: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """For which elements of arrays of one length a condition holds."""
    marks = np.empty(len(arrays[0]), np.bool_)
    for start in range(0, len(marks), _BLOCK):
        stop = start + _BLOCK
        marks[start:stop] = condition(*(array[start:stop] for array in arrays))
    return marks


def _drop_far(rows: _Rows) -> None:
    """Rule 3."""
    values, count = rows.values, rows.values.size
    if count < _FAR_ROWS:
        return
    rest = count - max(1, int(_FAR_SHARE * count))
    if (values[1:] >= values[:-1]).all():
        # As they should be: the median is in the middle, and the nearest ones lie side by side.
        middle = np.mean(values[(count - 1) // 2 : count // 2 + 1])
        reach = np.maximum(middle - values[: count - rest + 1], values[rest - 1 :] - middle).min()
    else:
        middle = np.median(values)
        distance = abs(values - middle)
        distance.partition(rest - 1)
        reach = distance[rest - 1]
        del distance  # there may be no room for it twice, in order and as the rows are
    near = _marked(lambda stamps: abs(stamps - middle) <= reach, values)
    first = values.min(where=near, initial=np.inf)
    length = float(values.max(where=near, initial=-np.inf) - first)
    bound = max(_FAR_LENGTHS * length, reach)
    far = _marked(lambda stamps: abs(stamps - middle) > bound, values)
    if length > 0:
        rows.drop(
            far,
            "{rows} stamped more than 1000 times the recording's length away from the rest "
            "{were} dropped",
        )


def _treat_repeats(rows: _Rows, jitter: float, bursts: bool) -> None:
    """Rule 4."""
    repeats = np.concatenate([[False], rows.values[1:] == rows.values[:-1]])
    if not repeats.any():
        return
    firsts = np.flatnonzero(~repeats)
    lengths = np.diff(np.append(firsts, repeats.size))
    usual = int(np.median(lengths))
    inner = lengths[1:-1]
    slack = max(1.0, _BURST_SLACK * usual)
    regular = bursts & (np.abs(inner - usual) <= slack) & (inner >= 2)
    steps = np.diff(rows.values[firsts])
    if usual < 2 or inner.size < 2 or regular.mean() < _BURST_SHARE or (steps <= 0).any():
        if jitter > 0:
            return
        verb = "repeats" if repeats.sum() == 1 else "repeat"
        rows.drop(
            repeats,
            f"{{rows}} {verb} the stamp before; the first {rows.row} of each stamp was kept"
            + ", and all are if stamps may jitter (--jitter)"
            * bool(repeats.mean() > _MANY_REPEATS),
        )
        return
    rows.report(
        f"the stamps come in {lengths.size:,} bursts of about {usual} {rows.row}s with one "
        f"stamp; the {rows.row}s of a burst were spread evenly up to the next stamp",
        int(np.argmax(repeats)),
    )
    rows.values = _spread(rows.values[firsts], lengths, usual)


def _spread(
    stamps: NDArray[np.float64], lengths: NDArray[np.int64], usual: int
) -> NDArray[np.float64]:
    """Stamps of single rows from the stamps of bursts."""
    spans = np.diff(stamps)
    span = float(np.median(spans))
    spans = np.append(spans, span)
    # A short burst, or one before a gap, keeps the usual step; the rest is a gap.
    short = lengths < (1 - _BURST_SLACK) * usual - 1
    steps = np.where(short, span / usual, spans / lengths)
    steps = np.where(spans > GAP_PERIODS * span, span / np.maximum(lengths, usual), steps)
    values = np.repeat(stamps, lengths) + _places(lengths) * np.repeat(steps, lengths)
    if short[0]:
        first = int(lengths[0])
        values[:first] = stamps[1] - (first - np.arange(first)) * (span / usual)
    return values


def _places(lengths: NDArray[np.int64]) -> NDArray[np.int64]:
    """The place of each row in its run, of runs of these lengths that follow each other."""
    return np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)


def _sort_backward(rows: _Rows, per_second: float, jitter: float) -> None:
    """Rule 5."""
    back = np.diff(rows.values) <= 0
    if not back.any():
        return
    from scipy.optimize import isotonic_regression  # takes long to load

    pooled = isotonic_regression(rows.values)
    levels, lengths = pooled.x[pooled.blocks[:-1]], np.diff(pooled.blocks)
    midpoints = (levels[:-1] + levels[1:]) / 2
    outer = float(np.median(np.diff(levels))) / 2 if levels.size > 1 else 0.0
    lows = np.concatenate([[levels[0] - outer], midpoints])
    highs = np.concatenate([midpoints, [levels[-1] + outer]])
    shares = (_places(lengths) + 0.5) / np.repeat(lengths, lengths)
    spread = np.repeat(lows, lengths) + shares * np.repeat(highs - lows, lengths)
    alone = np.repeat(lengths == 1, lengths)
    values = np.where(alone, rows.values, spread)
    moved = np.abs(values - rows.values) / per_second
    worst = int(np.argmax(moved))
    if moved[worst] > jitter:
        raise InputError(
            f"{rows.locate(worst)}: stamps run backwards so far that one has to be moved by "
            f"{moved[worst]:.3g} s, more than the jitter of {jitter:g} s; allow more, or split the "
            "file where a new recording starts."
        )
    back_by = abs(float(np.diff(rows.values).min())) / per_second
    rows.report(
        f"{counted(int((~alone).sum()), rows.row)} with stamps that repeat or run backwards, by "
        f"up to {back_by:.3g} s, were spread evenly between their neighbours, which moved none by "
        f"more than {moved[worst]:.3g} s",
        int(np.argmax(back)) + 1,
    )
    rows.values = values


def _drop_backward(rows: _Rows) -> None:
    """Rule 6."""
    back = np.flatnonzero(rows.values[1:] <= rows.values[:-1])
    if not back.size:
        return
    bad = np.ones(rows.values.size, dtype=np.bool_)
    bad[_longest_increasing(rows.values)] = False
    number = int(bad.sum())
    if number > max(1.0, _BACK_SHARE * bad.size):
        raise InputError(
            f"{rows.locate(back[0] + 1)}: time runs backwards, and {number:,} of {bad.size:,} "
            f"{rows.row}s would have to be dropped to mend it; split the file where a new "
            "recording starts, or say by how much stamps may jitter (--jitter)."
        )
    rows.drop(bad, "{rows} whose stamp is out of order {were} dropped")


def _longest_increasing(values: NDArray[np.float64]) -> NDArray[np.int64]:
    """Indices of the longest strictly increasing subsequence (patience sorting)."""
    tails: list[float] = []
    tail_rows: list[int] = []
    before = np.full(values.size, -1, dtype=np.int64)
    for row, value in enumerate(values.tolist()):
        pile = bisect_left(tails, value)
        if pile == len(tails):
            tails.append(value)
            tail_rows.append(row)
        else:
            tails[pile] = value
            tail_rows[pile] = row
        before[row] = tail_rows[pile - 1] if pile else -1
    chain = np.empty(len(tails), dtype=np.int64)
    row = tail_rows[-1]
    for place in range(len(tails) - 1, -1, -1):
        chain[place] = row
        row = int(before[row])
    return chain


def _report_gaps(rows: _Rows, times: NDArray[np.float64]) -> None:
    """Rule 7."""
    period = median_step(times)
    before, after = times[:-1], times[1:]
    gaps = _marked(lambda start, end: end - start > GAP_PERIODS * period, before, after)
    if gaps.any():
        number = int(gaps.sum())
        missing = float((after[gaps] - before[gaps] - period).sum())
        rows.report(
            f"{counted(number, 'gap')} in the stamps, {missing:.3g} s in all, "
            f"{'is' if number == 1 else 'are'} kept as {'a gap' if number == 1 else 'gaps'}",
            int(np.argmax(gaps)) + 1,
        )
