"""Stamps as found in files: their unit, and the rules by which they are repaired.

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

from bisect import bisect_left
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import GAP_PERIODS
from forcelab.errors import InputError
from forcelab.formats.table.clocks import YEAR_2100, RawStamps
from forcelab.text import counted

__all__ = ["Repaired", "repair"]

#: Shares and factors of the rules above.
_FAR_LENGTHS, _FAR_SHARE, _FAR_ROWS = 1000.0, 0.05, 5
_BURST_SHARE, _BURST_SLACK = 0.8, 0.1
_BACK_SHARE = 0.1


@dataclass(frozen=True, slots=True)
class Repaired:
    """Stamps after repair.

    Parameters
    ----------
    times : ndarray, shape (m,)
        Seconds from the first one, strictly increasing.
    kept : ndarray of int, shape (m,)
        The row that each stands for.
    start : float
        The first stamp in seconds on the file's own clock.
    remarks : tuple of str
        One sentence a rule that had to act.
    """

    times: NDArray[np.float64]
    kept: NDArray[np.int64]
    start: float
    remarks: tuple[str, ...]


@dataclass(slots=True)
class _Rows:
    """The rows that are left, while rules work on them."""

    where: str
    lines: NDArray[np.int64]
    strict: bool
    kept: NDArray[np.int64]
    values: NDArray[np.float64]
    row: str
    line: str
    remarks: list[str] = field(default_factory=list)

    def report(self, sentence: str, row: int) -> None:
        """Remark on what a rule did; refuse it if strict."""
        if self.strict:
            raise InputError(
                f"{self.where}, {self.line} {self.lines[self.kept[row]]}: {sentence}; mend the "
                "file or let it be repaired."
            )
        self.remarks.append(f"{sentence[0].upper()}{sentence[1:]}.")

    def drop(self, bad: NDArray[np.bool_], sentence: str) -> None:
        """Drop the rows marked, if any, and say so; ``{rows}`` is their count."""
        number = int(bad.sum())
        if not number:
            return
        text = sentence.format(
            rows=counted(number, self.row), were="was" if number == 1 else "were"
        )
        self.report(text, int(np.argmax(bad)))
        self.kept, self.values = self.kept[~bad], self.values[~bad]
        if self.kept.size < 2:
            raise InputError(f"{self.where}: {text}, and too few are left; look at its stamps.")


def repair(
    raw: RawStamps,
    lines: NDArray[np.int64],
    where: str,
    *,
    strict: bool = False,
    jitter: float = 0.0,
    row: str = "row",
    line: str = "line",
) -> Repaired:
    """Make stamps increase by the rules of this module.

    Parameters
    ----------
    raw : RawStamps
        One a row, in the order of the file; NaN where a row has none.
    lines : ndarray of int, shape (n,)
        1-based line of each row, for errors.
    where : str
        The file, for errors.
    strict : bool
        Refuse what would be repaired or remarked on.
    jitter : float
        Seconds by which a stamp may be moved so that stamps increase; 0 for none.
    row, line : str
        What has a stamp, and what its number counts, in the words of the file.

    Raises
    ------
    InputError
        If too few rows are left, if time runs backwards too often, or if strict and a rule has to
        act.
    """
    rows = _Rows(where, lines, strict, np.arange(raw.values.size), raw.values, row, line)
    rows.drop(np.isnan(rows.values), "{rows} without a usable stamp {were} dropped")
    if raw.absolute:
        late = raw.seconds(rows.values) > YEAR_2100
        rows.drop(late, "{rows} stamped after 2100 {were} dropped")
    _drop_far(rows)
    _treat_repeats(rows, jitter)
    if jitter > 0:
        _straighten(rows, raw.per_second, jitter)
    _drop_backward(rows)
    if rows.values.size < 2:
        raise InputError(f"{where} has fewer than two stamped {row}s; a recording needs more.")
    times = (rows.values - rows.values[0]) / raw.per_second
    _report_gaps(rows, times)
    return Repaired(times, rows.kept, float(raw.seconds(rows.values[:1])[0]), tuple(rows.remarks))


def _drop_far(rows: _Rows) -> None:
    """Rule 3."""
    if rows.values.size < _FAR_ROWS:
        return
    distance = np.abs(rows.values - np.median(rows.values))
    rest = distance.size - max(1, int(_FAR_SHARE * distance.size))
    reach = np.partition(distance, rest - 1)[rest - 1]
    length = float(np.ptp(rows.values[distance <= reach]))
    far = distance > max(_FAR_LENGTHS * length, reach)
    if length > 0:
        rows.drop(
            far,
            "{rows} stamped more than 1000 times the recording's length away from the rest "
            "{were} dropped",
        )


def _treat_repeats(rows: _Rows, jitter: float) -> None:
    """Rule 4."""
    repeats = np.concatenate([[False], np.diff(rows.values) == 0])
    if not repeats.any():
        return
    firsts = np.flatnonzero(~repeats)
    lengths = np.diff(np.append(firsts, repeats.size))
    usual = int(np.median(lengths))
    inner = lengths[1:-1]
    slack = max(1.0, _BURST_SLACK * usual)
    alike = (np.abs(inner - usual) <= slack) & (inner >= 2)
    steps = np.diff(rows.values[firsts])
    if usual < 2 or inner.size < 2 or alike.mean() < _BURST_SHARE or (steps <= 0).any():
        if jitter > 0:
            return
        verb = "repeats" if repeats.sum() == 1 else "repeat"
        rows.drop(
            repeats,
            f"{{rows}} {verb} the stamp before; the first {rows.row} of each stamp was kept",
        )
        return
    number = int(lengths.size)
    rows.report(
        f"the stamps come in {number:,} bursts of about {usual} {rows.row}s with one stamp; the "
        f"{rows.row}s of a burst were spread evenly up to the next stamp",
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
    places = np.arange(int(lengths.sum())) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    values = np.repeat(stamps, lengths) + places * np.repeat(steps, lengths)
    if short[0]:
        first = int(lengths[0])
        values[:first] = stamps[1] - (first - np.arange(first)) * (span / usual)
    result: NDArray[np.float64] = values
    return result


def _straighten(rows: _Rows, per_second: float, jitter: float) -> None:
    """Rule 5."""
    back = np.diff(rows.values) <= 0
    if not back.any():
        return
    levels, lengths = _nondecreasing(rows.values)
    between = (levels[:-1] + levels[1:]) / 2
    outer = float(np.median(np.diff(levels))) / 2 if levels.size > 1 else 0.0
    lows = np.concatenate([[levels[0] - outer], between])
    highs = np.concatenate([between, [levels[-1] + outer]])
    places = np.arange(rows.values.size) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    shares = (places + 0.5) / np.repeat(lengths, lengths)
    spread = np.repeat(lows, lengths) + shares * np.repeat(highs - lows, lengths)
    alone = np.repeat(lengths == 1, lengths)
    values = np.where(alone, rows.values, spread)
    moved = np.abs(values - rows.values) / per_second
    worst = int(np.argmax(moved))
    if moved[worst] > jitter:
        raise InputError(
            f"{rows.where}, {rows.line} {rows.lines[rows.kept[worst]]}: stamps run backwards so "
            f"far that one has to be moved by {moved[worst]:.3g} s, more than the jitter of "
            f"{jitter:g} s; allow more, or split the file where a new recording starts."
        )
    number = int((~alone).sum())
    rows.report(
        f"{counted(number, rows.row)} with stamps that repeat or run backwards, by up to "
        f"{-float(np.diff(rows.values).min()) / per_second:.3g} s, were spread evenly between "
        f"their neighbours, which moved none by more than {moved[worst]:.3g} s",
        int(np.argmax(back)) + 1,
    )
    rows.values = values


def _nondecreasing(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The increasing levels nearest to some values, and how many values share each.

    Least squares, by pooling adjacent violators.
    """
    means: list[float] = []
    counts: list[int] = []
    for value in values.tolist():
        mean, count = value, 1
        while means and means[-1] >= mean:
            total = count + counts[-1]
            mean += (means.pop() - mean) * counts.pop() / total
            count = total
        means.append(mean)
        counts.append(count)
    return np.array(means), np.array(counts, np.int64)


def _drop_backward(rows: _Rows) -> None:
    """Rule 6."""
    back = np.flatnonzero(np.diff(rows.values) <= 0)
    if not back.size:
        return
    bad = np.ones(rows.values.size, dtype=np.bool_)
    bad[_longest_increasing(rows.values)] = False
    number = int(bad.sum())
    if number > max(1.0, _BACK_SHARE * bad.size):
        where = f"{rows.where}, {rows.line} {rows.lines[rows.kept[back[0] + 1]]}"
        raise InputError(
            f"{where}: time runs backwards, and {number:,} of {bad.size:,} {rows.row}s would "
            "have to be dropped to mend it; split the file where a new recording starts, or say "
            "by how much stamps may jitter (--jitter)."
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
    steps = np.diff(times)
    period = float(np.median(steps))
    gaps = steps > GAP_PERIODS * period
    if gaps.any():
        number, missing = int(gaps.sum()), float((steps[gaps] - period).sum())
        rows.report(
            f"{counted(number, 'gap')} in the stamps, {missing:.3g} s in all, "
            f"{'is' if number == 1 else 'are'} kept as {'a gap' if number == 1 else 'gaps'}",
            int(np.argmax(gaps)) + 1,
        )
