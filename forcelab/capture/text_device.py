"""Devices that print lines of values: microcontrollers with sensors, load cells."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.blocks import Block
from forcelab.capture.counting import Counting
from forcelab.capture.discovery import find_ports
from forcelab.capture.line_device import LineDevice, Ports
from forcelab.capture.textline import Lines, TextParser
from forcelab.errors import InputError

__all__ = ["TextLine"]

#: Seconds for the first lines; a board that starts anew when its port is opened needs two.
FIRST_LINES = 5.0
#: Samples from which a device's clock is learnt when it is opened, and its rate where that was
#: told; seconds of lines from which it is measured, by their arrivals or by their own clock: the
#: sample that a delivery holds more or less, or a whole millisecond, is a hundredth of it at most.
LEARNT, MEASURED, CLOCKED = 8, 1.0, 0.2
#: Seconds without a line after which that is remarked.
SILENCE = 2.0
#: Junk lines in a row of which one is remarked.
MUCH_JUNK = 20


class TextLine(LineDevice):
    """A board that prints a line of values for each sample; see ``Device``.

    Where its lines carry a clock of their own and that is even, its samples are counted by it, so
    that lost lines are known; otherwise they are counted as they come, torn lines included.

    Parameters
    ----------
    path : str
        Its port.
    baud : int
        Bits a second.
    rate : float, optional
        Samples a second, in Hz; measured by default.
    ports : callable
        All ports that there are.

    Attributes
    ----------
    counted : bool
        Whether its samples are counted by its own clock; else torn lines are known, and those that
        never came are not.
    measured : bool
        Whether its rate was measured by arrivals: no promise, and good to a hundredth.

    Raises
    ------
    InputError
        If the rate is negative or not finite.
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
        self.rate = self._told = rate
        self.measured = False
        self._parser = TextParser()
        self._counting: Counting | None = None
        self._offset: NDArray[np.float64] | None = None
        self._latest: NDArray[np.float64] | None = None
        self._junk = 0

    @property
    def counted(self) -> bool:
        """Whether its samples are counted by its own clock."""
        return self._counting is not None

    def open(self) -> None:
        """Connect and learn what it sends; see ``Device.open``."""
        self._parser, self._counting, self._offset = TextParser(), None, None
        self.rate, self.measured = self._told, False
        super().open()

    def read(self, timeout: float) -> Block | None:
        """What has arrived; see ``Device.read``."""
        data, arrived = self._port.read(timeout)
        before = self._parser.junk_lines
        lines = self._parser.feed(data) if data else None
        self._remark_junk(self._parser.junk_lines - before, lines is not None)
        if lines is None:
            if time.monotonic() - self._heard > SILENCE:
                self._events.during("silence", f"{self.name} has sent no values for {SILENCE:g} s.")
            return None
        self._heard = arrived
        self._latest = lines.values[-1]
        values = lines.values if self._offset is None else lines.values - self._offset
        ticks = lines.numbers
        if self._counting is not None and lines.times is not None:
            ticks = self._counting.feed(lines.times)
        return Block(np.full(len(lines), arrived), ticks, values)

    def zero(self) -> None:
        """Take the present readings for zero; see ``Device.zero``.

        A channel that has none at present keeps the zero it has.
        """
        if self._latest is not None:
            before = np.zeros(len(self._latest)) if self._offset is None else self._offset
            self._offset = np.where(np.isfinite(self._latest), self._latest, before)

    def _begin(self) -> None:
        """Wait until it is known what a line holds; what comes meanwhile is dropped."""
        if self.connections:
            self._parser.restart()
            if self._counting is not None:
                self._counting.restart()
            return
        first = _First()
        until = time.monotonic() + FIRST_LINES
        while not first.enough(bool(self._told)) and time.monotonic() < until:
            data, arrived = self._port.read(0.1)
            first.take(self._parser.feed(data), arrived)
        if not self._parser.channels:
            raise InputError(
                f"{self.name} sends no lines of numbers at {self._baud} baud; choose its rate, "
                f"such as {self.name}?baud=9600, or see what it prints."
            )
        self.channels = self._parser.channels
        self._counting = first.counting()
        if not self._told:
            self.measured = self._counting is None
            self.rate = first.rate() if self._counting is None else 1.0 / self._counting.period

    def _remark_junk(self, number: int, good: bool) -> None:
        """Remark it when nothing but junk comes; single junk lines are only counted."""
        self._junk = 0 if good else self._junk + number
        if self._junk >= MUCH_JUNK:
            self._events.during(
                "junk",
                f"{self.name} sends lines that are not like the first ones; is the board as it "
                f"was when recording began?",
            )


class _First:
    """The first lines of a device, which tell its clock and its rate."""

    def __init__(self) -> None:
        self._times: list[NDArray[np.float64]] = []
        # How many lines there were after each delivery, and when that was read.
        self._counts: list[int] = []
        self._stamps: list[float] = []

    def take(self, lines: Lines | None, arrived: float) -> None:
        """Take in what a delivery held."""
        if lines is None:
            return
        if lines.times is not None:
            self._times.append(lines.times)
        self._counts.append(int(lines.numbers[-1]) + 1)
        self._stamps.append(arrived)

    def enough(self, told: bool) -> bool:
        """Whether there are enough lines; fewer where the rate was told."""
        if not self._counts or self._counts[-1] < LEARNT:
            return False
        seconds = 0.0 if told else CLOCKED if self._times else MEASURED
        return self._stamps[-1] - self._stamps[0] >= seconds

    def counting(self) -> Counting | None:
        """What counts samples by the device's own clock; None where it has none that is even."""
        if not self._times:
            return None
        times = np.concatenate(self._times)
        counting = Counting.learnt(times[:LEARNT])
        if counting is None:
            return None
        ticks, known = counting.feed(times), np.isfinite(times)
        span, steps = float(np.ptp(times[known])), int(np.ptp(ticks[known]))
        # Stamps in whole milliseconds tell the period of fast devices by all of them only.
        even = 0.8 < span / (steps * counting.period) < 1.25
        return Counting(span / steps if even else counting.period)

    def rate(self) -> float:
        """Lines a second by their arrivals; 0 where too few came.

        A delivery tells too few lines, never too many: those that waited least, one among the
        first deliveries and one among the last, are held against each other.
        """
        counts, stamps = np.array(self._counts), np.array(self._stamps)
        if len(counts) < 2:
            return 0.0
        third = max(len(counts) // 3, 1)
        first, last, rate = 0, len(counts) - 1, 0.0
        for _ in range(4):  # who waited least depends on the rate, but little
            rate = float((counts[last] - counts[first]) / max(stamps[last] - stamps[first], 1e-6))
            waited = stamps - counts / rate
            first = int(np.argmin(waited[:third]))
            last = len(counts) - third + int(np.argmin(waited[-third:]))
        return rate
