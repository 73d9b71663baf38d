"""Sensors that send lines of text: Arduinos, and load cells behind an HX711.

A line is a sample: numbers separated by tabs, semicolons, commas or blanks, or ``label:value``
pairs as the Arduino plotter reads them. A line of names in front of the numbers names the channels,
and units in it (``Fz [N]``) are theirs; a column that is named as stamps with a unit of time
(``time_ms``, ``micros``, ``t (s)``) is the device's clock. What a line is made of is settled by two
samples in a row that agree; every other line is junk from then on, which is counted. Numbers have
points: ``1,5`` is two of them.

Samples are numbered in the order in which they were sent. A torn line (cut short, or grown together
with the next one for want of a line end) takes as many numbers as lines went into it, so that what
is missing is known and the samples after it keep their times.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.lines import LONGEST, LineSplitter
from forcelab.demonstration import Channel
from forcelab.formats.table.columns import (
    SECONDS_IN,
    Column,
    is_time_name,
    is_unit,
    name_columns,
    unit_of_time,
)

__all__ = ["Lines", "TextParser"]

_NUMBER: Final = r"[+-]?(?:(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?|nan|inf)"
_IS_NUMBER = re.compile(_NUMBER, re.I | re.ASCII)
_PAIR = re.compile(
    rf"\s*(?P<label>[^\W\d][^:=,;\t|]*?)\s*[:=]\s*(?P<value>{_NUMBER})"
    r"(?:\s*(?P<unit>[^\W\d_][\w/^%°²·]*)(?![\w.]*\s*[:=]))?\s*(?:[,;|\t]|(?<=\s)|$)",
    re.I,
)
_NAME = re.compile(r"[^\W\d].{0,39}$")
#: The decimals of a number, and what numbers and the separators between them are made of; the sign
#: that stands for a byte that is no text is what a bad line makes of any of these.
_DECIMALS = re.compile(rb"\d(?:\.(\d*))?(?![\d.])")
_CELLS = re.compile(r"(?:[\d\s.,;:=|+\-\uFFFD]|e[+-]?\d|nan|inf)+", re.I)
#: Lines with the same decimals from which a device is known to print them so, and the share of
#: others up to which these are torn; where zeros at the end are left out it is a tenth.
_ALIKE, _SELDOM = 300, 0.05
#: Clocks of 32 bits that count these units start again at zero.
_WRAPS = 2.0**32


@dataclass(frozen=True)
class Lines:
    """Samples in their order.

    Parameters
    ----------
    values : ndarray of float64, shape (n, c)
        One column a channel; NaN where the device sent ``nan``.
    times : ndarray of float64, shape (n,), or None
        Seconds of the device's own clock, which may start anywhere; None if it sends none.
    numbers : ndarray of int64, shape (n,)
        Of each sample among all that were sent, torn ones included.
    """

    values: NDArray[np.float64]
    times: NDArray[np.float64] | None
    numbers: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.values)


@dataclass(frozen=True, slots=True)
class _Row:
    """A line that holds numbers, with their labels if it has any."""

    values: tuple[float, ...]
    labels: tuple[str, ...] = ()
    units: tuple[str, ...] = ()

    def agrees(self, other: _Row) -> bool:
        """Whether both are made of the same parts."""
        return len(self.values) == len(other.values) and self.labels == other.labels


class TextParser:
    """Turns the bytes of one device into samples.

    The first line is not trusted if it holds numbers, as the connection may have begun in its
    middle.

    Attributes
    ----------
    channels : tuple of Channel
        Empty until two samples in a row agree.
    junk_lines : int
        Lines that were no sample.
    torn_lines : int
        Lines among them that were a sample before they were torn.
    """

    def __init__(self) -> None:
        self.channels: tuple[Channel, ...] = ()
        self.junk_lines = self.torn_lines = 0
        self._sent = 0  # samples so far, those in torn lines included
        self._length = 0  # bytes of the longest line so far that was a sample
        self._decimals = _Decimals()
        self._splitter = LineSplitter()
        self._torn = True
        self._header: tuple[str, ...] = ()
        self._shape: _Row | None = None
        self._candidate: _Row | None = None
        self._clock: int | None = None
        self._per_second = 1.0
        self._last_stamp, self._turns = -np.inf, 0

    def feed(self, data: bytes) -> Lines | None:
        """The samples that are complete with these bytes; None if there are none.

        Parameters
        ----------
        data : bytes
            What follows on what was given before; an unfinished line is kept.
        """
        rows: list[tuple[float, ...]] = []
        numbers: list[int] = []
        for line in self._splitter.feed(data):
            for row in self._line(line):
                rows.append(row)
                numbers.append(self._sent)
                self._sent += 1
        if not rows:
            return None
        values, order = np.array(rows, np.float64), np.array(numbers, np.int64)
        if self._clock is None:
            return Lines(values, None, order)
        times = self._seconds(values[:, self._clock])
        return Lines(np.delete(values, self._clock, axis=1), times, order)

    def restart(self) -> None:
        """Go on after the cable was plugged in again: the first line may be torn once more."""
        self._splitter.forget()
        self._torn = True

    def _line(self, line: bytes) -> list[tuple[float, ...]]:
        """The samples that a line completes: mostly one."""
        torn, self._torn = self._torn, False
        row = _row(line) if len(line) <= LONGEST else None
        if row is None:
            header = _header(line) if len(line) <= LONGEST else ()
            if not header or (self._shape is not None and header != self._header):
                self._reject(line)
            elif self._shape is None:
                self.junk_lines += bool(self._header) and header != self._header
                self._header = header
        elif torn:
            self.junk_lines += 1
        elif self._shape is not None:
            if row.agrees(self._shape) and self._decimals.agree(line):
                self._length = max(self._length, len(line))
                return [row.values]
            self._reject(line)
        elif self._candidate is not None and row.agrees(self._candidate):
            self._settle(row)
            if self.channels:
                return [self._candidate.values, row.values]
            self._shape, self._candidate = None, row  # nothing but a clock
        else:
            self.junk_lines += self._candidate is not None
            self._candidate = row
        return []

    def _reject(self, line: bytes) -> None:
        """Count a line that is no sample, and the samples that were in it if it was torn."""
        self.junk_lines += 1
        if self._shape is not None and self._length and _was_sample(line, self._shape.labels):
            self.torn_lines += 1
            self._sent += -(-min(len(line), LONGEST) // self._length)

    def _settle(self, row: _Row) -> None:
        """Name the channels, once it is known what a line is made of."""
        self._shape = row
        if row.labels:
            columns, _ = name_columns(row.labels, row.units)
            self.junk_lines += bool(self._header)
        elif len(self._header) == len(row.values):
            columns, _ = name_columns(self._header)
        else:
            self.junk_lines += bool(self._header)
            columns = tuple(Column(f"a{i + 1}", named=False) for i in range(len(row.values)))
        clocks = [i for i, one in enumerate(columns) if one.named and _is_clock(one)]
        self._clock = clocks[0] if clocks else None
        if self._clock is not None:
            self._per_second = float(SECONDS_IN[unit_of_time(columns[self._clock])])
        self.channels = tuple(
            Channel(one.name, one.unit) for i, one in enumerate(columns) if i != self._clock
        )

    def _seconds(self, stamps: NDArray[np.float64]) -> NDArray[np.float64]:
        """Seconds of a clock that may start again at zero after 32 bits, as ``micros()`` does."""
        seconds = np.empty(len(stamps))
        for i, stamp in enumerate(stamps):
            if stamp < self._last_stamp - _WRAPS / 2:
                self._turns += 1
            if np.isfinite(stamp):
                self._last_stamp = stamp
            seconds[i] = (stamp + self._turns * _WRAPS) / self._per_second
        return seconds


class _Decimals:
    """How many decimals a device prints in each cell, where that is always the same.

    A line that lost some digits of one number is else like any other.
    """

    def __init__(self) -> None:
        self._usual: tuple[int, ...] = ()
        self._alike = self._others = 0

    def agree(self, line: bytes) -> bool:
        """Whether a line has as many decimals as almost all before it."""
        found = tuple(len(match[1] or b"") for match in _DECIMALS.finditer(line))
        if found == self._usual:
            self._alike += 1
            return True
        fixed = self._alike >= _ALIKE and self._others < _SELDOM * self._alike
        self._others += 1
        if self._others > self._alike:
            self._usual, self._alike, self._others = found, 1, 0
        fewer = [
            now < usual for now, usual in zip(found, self._usual, strict=False) if now != usual
        ]
        return not (fixed and len(found) == len(self._usual) and fewer == [True])


def _was_sample(line: bytes, labels: tuple[str, ...]) -> bool:
    """Whether a line that is no sample is what is left of one, or of several."""
    text = _text(line)
    for label in labels:
        text = text.replace(label, "")
    return any(sign.isdigit() for sign in text) and _CELLS.fullmatch(text) is not None


def _is_clock(column: Column) -> bool:
    """Whether a column holds stamps and says in what unit."""
    return is_time_name(column.name) and bool(unit_of_time(column))


def _text(line: bytes) -> str:
    """A line as text; a byte that is none becomes a sign that no number and no name has."""
    return line.decode("utf-8", errors="replace").strip()


def _row(line: bytes) -> _Row | None:
    """A line that holds a sample; None for any other."""
    text = _text(line)
    if ":" in text or "=" in text:
        return _labelled(text)
    cells = _cells(text)
    if not all(_IS_NUMBER.fullmatch(cell) for cell in cells):
        return None
    return _Row(tuple(float(cell) for cell in cells))


def _cells(text: str) -> Sequence[str]:
    """The cells of a line; one separator behind the last cell is left out."""
    for separator in "\t;,":
        if separator in text:
            cells = [cell.strip() for cell in text.split(separator)]
            return cells[:-1] if len(cells) > 1 and not cells[-1] else cells
    return text.split()


def _labelled(text: str) -> _Row | None:
    """A line of ``label:value`` pairs and nothing else; None for any other."""
    pairs, place = [], 0
    while place < len(text):
        pair = _PAIR.match(text, place)
        if pair is None or pair.end() == place:
            return None
        pairs.append(pair)
        place = pair.end()
    labels = tuple(pair["label"] for pair in pairs)
    if not labels or len(set(labels)) < len(labels):
        return None
    units = tuple(unit if (unit := pair["unit"] or "") and is_unit(unit) else "" for pair in pairs)
    return _Row(tuple(float(pair["value"]) for pair in pairs), labels, units)


def _header(line: bytes) -> tuple[str, ...]:
    """The names in a line that may be a header; empty for any other."""
    text = _text(line)
    if "�" in text or (not text.isprintable() and "\t" not in text) or ":" in text:
        return ()
    cells = tuple(_cells(text))
    named = all(_NAME.match(cell) and not _IS_NUMBER.fullmatch(cell) for cell in cells)
    return cells if named else ()
