"""Devices that print lines of values: microcontrollers with sensors, load cells behind an HX711.

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

import math
import re
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.device import Block, SoftwareZero
from forcelab.capture.discovery import find_ports
from forcelab.capture.serial_port import LONGEST, LineDevice, LineSplitter, Ports
from forcelab.demonstration import Channel
from forcelab.errors import InputError
from forcelab.formats.table_sniff import (
    SECONDS_IN,
    Column,
    is_time_name,
    is_unit,
    name_columns,
    unit_of_time,
)

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
class TextSamples:
    """Samples in their order."""

    #: One column a channel, shape (n, c); NaN where the device sent ``nan``.
    values: NDArray[np.float64]
    #: Seconds of the device's own clock, which may start anywhere, shape (n,); None without one.
    times: NDArray[np.float64] | None
    #: Of each sample among all that were sent, torn ones included, shape (n,).
    numbers: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.values)


@dataclass(frozen=True, slots=True)
class _Row:
    """A line that holds numbers, with their labels if it has any."""

    values: tuple[float, ...]
    labels: tuple[str, ...] = ()
    units: tuple[str, ...] = ()

    def matches(self, other: _Row) -> bool:
        """Whether both are made of the same parts."""
        return len(self.values) == len(other.values) and self.labels == other.labels


class TextParser:
    """Turns the bytes of one device into samples.

    The first line is not trusted if it holds numbers, as the connection may have begun in its
    middle.
    """

    def __init__(self) -> None:
        #: Empty until two samples in a row agree.
        self.channels: tuple[Channel, ...] = ()
        #: Lines that were no sample, and those of them that were one before they were torn.
        self.junk_lines = self.torn_lines = 0
        self._sent = 0  # samples so far, those in torn lines included
        self._length = 0  # bytes of the longest line so far that was a sample
        self._decimals = _Decimals()
        self._splitter = LineSplitter()
        self._distrust = True
        self._header: tuple[str, ...] = ()
        self._shape: _Row | None = None
        self._candidate: _Row | None = None
        self._clock: int | None = None
        self._per_second = 1.0
        self._last_stamp, self._turns = -np.inf, 0

    def feed(self, data: bytes) -> TextSamples | None:
        """The samples that are complete with these bytes; None if there are none."""
        rows: list[tuple[float, ...]] = []
        numbers: list[int] = []
        for line in self._splitter.feed(data):
            for row in self._parse_line(line):
                rows.append(row)
                numbers.append(self._sent)
                self._sent += 1
        if not rows:
            return None
        values, order = np.array(rows, np.float64), np.array(numbers, np.int64)
        if self._clock is None:
            return TextSamples(values, None, order)
        times = self._seconds(values[:, self._clock])
        return TextSamples(np.delete(values, self._clock, axis=1), times, order)

    def restart(self) -> None:
        """Go on after the cable was plugged in again: the first line may be torn once more."""
        self._splitter.forget()
        self._distrust = True

    def _parse_line(self, line: bytes) -> list[tuple[float, ...]]:
        """The samples that a line completes: mostly one."""
        distrusted, self._distrust = self._distrust, False
        row = _parse_row(line) if len(line) <= LONGEST else None
        if row is None:
            header = _parse_header(line) if len(line) <= LONGEST else ()
            if not header or (self._shape is not None and header != self._header):
                self._reject(line)
            elif self._shape is None:
                self.junk_lines += bool(self._header) and header != self._header
                self._header = header
        elif distrusted:
            self.junk_lines += 1
        elif self._shape is not None:
            if row.matches(self._shape) and self._decimals.matches(line):
                self._length = max(self._length, len(line))
                return [row.values]
            self._reject(line)
        elif self._candidate is not None and row.matches(self._candidate):
            self._set_shape(row)
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
        if self._shape is not None and self._length and _is_torn_sample(line, self._shape.labels):
            self.torn_lines += 1
            self._sent += -(-min(len(line), LONGEST) // self._length)

    def _set_shape(self, row: _Row) -> None:
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
        clocks = [i for i, column in enumerate(columns) if column.named and _is_clock(column)]
        self._clock = clocks[0] if clocks else None
        if self._clock is not None:
            self._per_second = float(SECONDS_IN[unit_of_time(columns[self._clock])])
        self.channels = tuple(
            Channel(column.name, column.unit)
            for i, column in enumerate(columns)
            if i != self._clock
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

    def matches(self, line: bytes) -> bool:
        """Whether a line has as many decimals as almost all before it."""
        decimals = tuple(len(match[1] or b"") for match in _DECIMALS.finditer(line))
        if decimals == self._usual:
            self._alike += 1
            return True
        fixed = self._alike >= _ALIKE and self._others < _SELDOM * self._alike
        self._others += 1
        if self._others > self._alike:
            self._usual, self._alike, self._others = decimals, 1, 0
        fewer = [
            now < usual for now, usual in zip(decimals, self._usual, strict=False) if now != usual
        ]
        return not (fixed and len(decimals) == len(self._usual) and fewer == [True])


def _is_torn_sample(line: bytes, labels: tuple[str, ...]) -> bool:
    """Whether a line that is no sample is what is left of one, or of several."""
    text = _decode(line)
    for label in labels:
        text = text.replace(label, "")
    return any(sign.isdigit() for sign in text) and _CELLS.fullmatch(text) is not None


def _is_clock(column: Column) -> bool:
    """Whether a column holds stamps and says in what unit."""
    return is_time_name(column.name) and bool(unit_of_time(column))


def _decode(line: bytes) -> str:
    """A line as text; a byte that is none becomes a sign that no number and no name has."""
    return line.decode("utf-8", errors="replace").strip()


def _parse_row(line: bytes) -> _Row | None:
    """A line that holds a sample; None for any other."""
    text = _decode(line)
    if ":" in text or "=" in text:
        return _parse_pairs(text)
    cells = _split_cells(text)
    if not all(_IS_NUMBER.fullmatch(cell) for cell in cells):
        return None
    return _Row(tuple(float(cell) for cell in cells))


def _split_cells(text: str) -> Sequence[str]:
    """The cells of a line; one separator behind the last cell is left out."""
    for separator in "\t;,":
        if separator in text:
            cells = [cell.strip() for cell in text.split(separator)]
            return cells[:-1] if len(cells) > 1 and not cells[-1] else cells
    return text.split()


def _parse_pairs(text: str) -> _Row | None:
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


def _parse_header(line: bytes) -> tuple[str, ...]:
    """The names in a line that may be a header; empty for any other."""
    text = _decode(line)
    if "�" in text or (not text.isprintable() and "\t" not in text) or ":" in text:
        return ()
    cells = tuple(_split_cells(text))
    named = all(_NAME.match(cell) and not _IS_NUMBER.fullmatch(cell) for cell in cells)
    return cells if named else ()


#: Samples that can be missing at one go: a month of them at 1 kHz.
MOST_TICKS = 2.0**31


class SampleCounter:
    """Counts samples by a clock that comes with them, of `period` seconds a sample."""

    def __init__(self, period: float) -> None:
        self.period = period
        self._last: tuple[float, int] | None = None  # the last stamp that was one, and its tick
        self._tick = -1

    @classmethod
    def from_stamps(cls, times: NDArray[np.float64]) -> SampleCounter | None:
        """From the first stamps (s); None where they are not even, as nothing can be counted."""
        steps = np.diff(times)
        if len(steps) < 2 or not np.all(steps > 0):
            return None
        period = float(np.median(steps))
        off = np.abs(steps / period - np.round(steps / period))
        return cls(period) if off.max() < 0.25 else None

    def feed(self, times: NDArray[np.float64]) -> NDArray[np.int64]:
        """Ticks of samples with these stamps (s).

        A stamp that is no number, or so late that the clock must have been set anew, is the next
        tick.
        """
        ticks = np.empty(len(times), dtype=np.int64)
        for i, stamp in enumerate(times.tolist()):
            self._tick += 1
            if math.isfinite(stamp):
                self._tick = max(self._tick, self._tick_at(stamp))
                self._last = stamp, self._tick
            ticks[i] = self._tick
        return ticks

    def _tick_at(self, stamp: float) -> int:
        """The tick by a stamp alone; -1 where it tells none."""
        if self._last is None:
            return -1
        last, tick = self._last
        step = stamp - last
        if not 0 < step < MOST_TICKS * self.period:
            return -1
        steps = max(1, round(step / self.period))
        # Stamps in whole milliseconds tell the period of fast devices only by and by.
        self.period += 0.02 * (step / steps - self.period)
        return tick + steps

    def restart(self) -> None:
        """Go on with a clock that may have started anew."""
        self._last = None


#: Seconds for the first lines; a board that starts anew when its port is opened needs two.
FIRST_LINES_SECONDS = 5.0
#: Samples from which a device's clock is learnt when it is opened, and its rate where that was
#: told; seconds of lines from which it is measured, by their arrivals or by their own clock: the
#: sample that a delivery holds more or less, or a whole millisecond, is a hundredth of it at most.
LEARNING_LINES, MEASURING_SECONDS, CLOCK_SECONDS = 8, 1.0, 0.2
#: Seconds without a line after which that is remarked.
SILENCE_SECONDS = 2.0
#: Junk lines in a row of which one is remarked.
MOST_JUNK = 20


class TextDevice(LineDevice):
    """A board that prints a line of values for each sample.

    Where its lines carry a clock of their own and that is even, its samples are counted by it, so
    that lost lines are known; otherwise they are counted as they come, torn lines included.
    """

    kind = "text"

    def __init__(
        self, path: str, *, baud: int = 115_200, rate: float = 0.0, ports: Ports = find_ports
    ) -> None:
        super().__init__(path, baud, ports)
        if not 0 <= rate < np.inf:
            raise InputError(
                f"A board that prints lines cannot print {rate:g} of them a second; leave its rate "
                f"away, and it is measured."
            )
        self.rate = self._stated_rate = rate
        self._parser = TextParser()
        self._counter: SampleCounter | None = None
        self._junk = 0

    def open(self) -> None:
        self._parser, self._counter, self._zero = TextParser(), None, SoftwareZero()
        self.rate, self.measured = self._stated_rate, False
        super().open()

    def read(self, timeout: float) -> Block | None:
        data, arrived = self._port.read(timeout)
        before = self._parser.junk_lines
        lines = self._parser.feed(data) if data else None
        self._remark_junk(self._parser.junk_lines - before, lines is not None)
        if lines is None:
            sentence = f"{self.name} has sent no values for {SILENCE_SECONDS:g} s."
            self._remark_silence(SILENCE_SECONDS, sentence)
            return None
        self._last_arrival = arrived
        values = self._zero.apply(lines.values)
        ticks = lines.numbers
        if self._counter is not None and lines.times is not None:
            ticks = self._counter.feed(lines.times)
        return Block(np.full(len(lines), arrived), ticks, values)

    def _configure(self) -> None:
        """Wait until it is known what a line holds; what comes meanwhile is dropped."""
        if self.connections:
            self._parser.restart()
            if self._counter is not None:
                self._counter.restart()
            return
        first = _FirstLines()
        until = time.monotonic() + FIRST_LINES_SECONDS
        while not first.enough(bool(self._stated_rate)) and time.monotonic() < until:
            data, arrived = self._port.read(0.1)
            first.add(self._parser.feed(data), arrived)
        if not self._parser.channels:
            raise InputError(
                f"{self.name} sends no lines of numbers at {self._baud} baud; choose its rate, "
                f"such as {self.name}?baud=9600, or see what it prints."
            )
        self.channels = self._parser.channels
        self._counter = first.counter()
        # Torn lines are known without its clock, too, but not those that never came.
        self.counted = self._counter is not None
        if not self._stated_rate:
            self.measured = self._counter is None
            self.rate = first.rate() if self._counter is None else 1.0 / self._counter.period

    def _remark_junk(self, number: int, parsed: bool) -> None:
        """Remark it when nothing but junk comes; single junk lines are only counted."""
        self._junk = 0 if parsed else self._junk + number
        if self._junk >= MOST_JUNK:
            self._messages.put_once(
                "junk",
                f"{self.name} sends lines that are not like the first ones; is the board as it "
                f"was when recording began?",
            )


class _FirstLines:
    """The first lines of a device, from which its clock and its rate are learnt."""

    def __init__(self) -> None:
        self._times: list[NDArray[np.float64]] = []
        # How many lines there were after each delivery, and when that was read.
        self._counts: list[int] = []
        self._stamps: list[float] = []

    def add(self, lines: TextSamples | None, arrived: float) -> None:
        if lines is None:
            return
        if lines.times is not None:
            self._times.append(lines.times)
        self._counts.append(int(lines.numbers[-1]) + 1)
        self._stamps.append(arrived)

    def enough(self, configured: bool) -> bool:
        """Whether there are enough lines; fewer where the rate was configured."""
        if not self._counts or self._counts[-1] < LEARNING_LINES:
            return False
        seconds = 0.0 if configured else CLOCK_SECONDS if self._times else MEASURING_SECONDS
        return self._stamps[-1] - self._stamps[0] >= seconds

    def counter(self) -> SampleCounter | None:
        """A counter by the device's own clock; None where it has none that is even."""
        if not self._times:
            return None
        times = np.concatenate(self._times)
        counter = SampleCounter.from_stamps(times[:LEARNING_LINES])
        if counter is None:
            return None
        ticks, finite = counter.feed(times), np.isfinite(times)
        span, steps = float(np.ptp(times[finite])), int(np.ptp(ticks[finite]))
        # Stamps in whole milliseconds tell the period of fast devices by all of them only.
        plausible = 0.8 < span / (steps * counter.period) < 1.25
        return SampleCounter(span / steps if plausible else counter.period)

    def rate(self) -> float:
        """Lines a second by their arrivals; 0 where too few came.

        A delivery tells too few lines, never too many: those that waited least, one among the first
        deliveries and one among the last, are held against each other.
        """
        counts, stamps = np.array(self._counts), np.array(self._stamps)
        if len(counts) < 2:
            return 0.0
        third = max(len(counts) // 3, 1)
        first, last, rate = 0, len(counts) - 1, 0.0
        for _ in range(4):  # which waited least depends on the rate, but little
            rate = float((counts[last] - counts[first]) / max(stamps[last] - stamps[first], 1e-6))
            waited = stamps - counts / rate
            first = int(np.argmin(waited[:third]))
            last = len(counts) - third + int(np.argmin(waited[-third:]))
        return rate
