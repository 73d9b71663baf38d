"""Devices that speak in lines of text: microcontrollers with sensors, and the tongs' encoder."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.blocks import Block, UnpluggedError
from forcelab.capture.discovery import FoundPort, find_ports, port_like
from forcelab.capture.encoder import BAUD, CLOCK_RATE, EncoderParser, set_up
from forcelab.capture.events import Events
from forcelab.capture.serial_port import Port
from forcelab.capture.textline import Lines, TextParser
from forcelab.demonstration import Channel
from forcelab.errors import InputError

__all__ = ["Encoder", "TextLine"]

#: Seconds between two reads at least.
GATHER = 0.004
#: Seconds for the first lines; a board that starts anew when its port is opened needs two.
FIRST_LINES = 5.0
#: Samples from which a device's rate and clock are learnt when it is opened.
LEARNT = 8
#: Seconds that an encoder has for its answers.
ANSWERS = 1.0
#: Seconds without a line after which that is remarked.
SILENCE = 2.0
#: Junk lines in a row of which one is remarked.
MUCH_JUNK = 20

Ports = Callable[[], Iterable[FoundPort]]


class _LineDevice:
    """What both have in common: a port that is found again by its USB serial number."""

    kind = ""
    holds = False

    def __init__(self, path: str, baud: int, ports: Ports) -> None:
        self.rate = 0.0
        self.channels: tuple[Channel, ...] = ()
        self.connections = 0
        self._path, self._baud, self._ports = path, baud, ports
        self._port = Port(path, baud, GATHER)
        self._known = FoundPort(path, "unknown", "", None, None, usable=True)
        self._events = Events()
        self._heard = 0.0

    @property
    def name(self) -> str:
        """Such as ``"text:/dev/ttyUSB0"``; the port is the present one."""
        return f"{self.kind}:{self._path}"

    def open(self) -> None:
        """Connect and learn what it sends; see ``Device.open``."""
        self.connections = 0
        real = os.path.realpath(self._path)
        same = (port for port in self._ports() if os.path.realpath(port.path) == real)
        self._known = next(same, FoundPort(self._path, "unknown", "", None, None, usable=True))
        try:
            self._connect(self._path)
        except UnpluggedError as error:
            raise InputError(str(error)) from error

    def reopen(self) -> None:
        """Find the same device again, by its USB serial number at whatever port.

        Raises
        ------
        UnpluggedError
            While it is not back.
        """
        self.close()
        path = port_like(self._known, self._ports()) if self._known.usb else self._path
        if path is None:
            raise UnpluggedError(f"{self.name} is not plugged in again yet.")
        try:
            self._connect(path)
        except InputError as error:
            raise UnpluggedError(str(error)) from error

    def remarks(self) -> tuple[str, ...]:
        """What went wrong since the last time this was asked; see ``Device.remarks``."""
        return self._events.take()

    def close(self) -> None:
        """Let go of it; see ``Device.close``."""
        self._port.close()

    def _connect(self, path: str) -> None:
        """Open a port and begin."""
        port = Port(path, self._baud, GATHER)
        port.open()
        self._port.close()
        self._port = port
        try:
            self._begin()
        except BaseException:
            port.close()
            raise
        self._path, self._heard = path, time.monotonic()
        self.connections += 1

    def _begin(self) -> None:
        """What has to be said and learnt first."""
        raise NotImplementedError


class TextLine(_LineDevice):
    """A board that prints a line of values for each sample; see ``Device``.

    Where its lines carry a clock of their own and that is even, its samples are counted by it, so
    that lost lines are known; otherwise they are stamped as they arrive.

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
    """

    kind = "text"

    def __init__(
        self, path: str, *, baud: int = 115_200, rate: float = 0.0, ports: Ports = find_ports
    ) -> None:
        super().__init__(path, baud, ports)
        self.rate = rate
        self._parser = TextParser()
        self._counting: _Counting | None = None
        self._offset: NDArray[np.float64] | None = None
        self._latest: NDArray[np.float64] | None = None
        self._junk = 0

    @property
    def statistics(self) -> dict[str, int]:
        """What became of the lines since it was opened first."""
        return {"junk_lines": self._parser.junk_lines, "connections": self.connections}

    def open(self) -> None:
        """Connect and learn what it sends; see ``Device.open``."""
        self._parser, self._counting, self._offset = TextParser(), None, None
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
        ticks = None
        if self._counting is not None and lines.times is not None:
            ticks = self._counting.feed(lines.times)
        return Block(np.full(len(lines), arrived), ticks, values)

    def zero(self) -> None:
        """Take the present readings for zero; see ``Device.zero``."""
        self._offset = self._latest

    def _begin(self) -> None:
        """Wait until it is known what a line holds; what comes meanwhile is dropped."""
        if self.connections:
            self._parser.restart()
            if self._counting is not None:
                self._counting.restart()
            return
        pieces: list[Lines] = []
        stamps: list[float] = []
        until = time.monotonic() + FIRST_LINES
        while sum(map(len, pieces)) < LEARNT and time.monotonic() < until:
            data, arrived = self._port.read(0.1)
            lines = self._parser.feed(data)
            if lines is not None:
                pieces.append(lines)
                stamps += [arrived] * len(lines)
        if not self._parser.channels:
            raise InputError(
                f"{self.name} sends no lines of numbers at {self._baud} baud; choose its rate, "
                f"such as {self.name}?baud=9600, or see what it prints."
            )
        self.channels = self._parser.channels
        times = [piece.times for piece in pieces if piece.times is not None]
        if times:
            self._counting = _Counting.learnt(np.concatenate(times))
        if not self.rate:
            span = stamps[-1] - stamps[0]
            self.rate = (len(stamps) - 1) / span if span > 0 else 0.0
            if self._counting is not None:
                self.rate = 1.0 / self._counting.period

    def _remark_junk(self, number: int, good: bool) -> None:
        """Remark it when nothing but junk comes; single junk lines are only counted."""
        self._junk = 0 if good else self._junk + number
        if self._junk >= MUCH_JUNK:
            self._events.during(
                "junk",
                f"{self.name} sends lines that are not like the first ones; is the board as it "
                f"was when recording began?",
            )


class _Counting:
    """Samples counted by a clock that comes with them.

    Parameters
    ----------
    period : float
        Seconds of that clock from sample to sample.
    """

    def __init__(self, period: float) -> None:
        self.period = period
        self._last: float | None = None
        self._tick = -1

    @classmethod
    def learnt(cls, times: NDArray[np.float64]) -> _Counting | None:
        """From the first stamps (s); None where they are not even, as nothing can be counted."""
        steps = np.diff(times)
        if len(steps) < 2 or not np.all(steps > 0):
            return None
        period = float(np.median(steps))
        off = np.abs(steps / period - np.round(steps / period))
        return cls(period) if off.max() < 0.25 else None

    def feed(self, times: NDArray[np.float64]) -> NDArray[np.int64]:
        """Ticks of samples with these stamps (s)."""
        ticks = np.empty(len(times), dtype=np.int64)
        for i, stamp in enumerate(times.tolist()):
            on = 1
            if self._last is not None and stamp > self._last:
                step = stamp - self._last
                on = max(1, round(step / self.period))
                # Stamps in whole milliseconds tell the period of fast devices only by and by.
                self.period += 0.02 * (step / on - self.period)
            self._last, self._tick = stamp, self._tick + on
            ticks[i] = self._tick
        return ticks

    def restart(self) -> None:
        """Go on with a clock that may have started anew."""
        self._last = None


class Encoder(_LineDevice):
    """The opening of the tongs by a quadrature encoder behind a QSB; see ``Device``.

    It sends its count when that changes: in between the last value holds.

    Parameters
    ----------
    path : str
        Its port.
    scale : float
        Units a count.
    unit, channel : str
        Unit and name of its channel.
    rate : float
        The most it sends, in Hz: 512 / n.
    reverse : bool
        Count the other way round.
    ports : callable
        All ports that there are.
    """

    kind = "encoder"
    holds = True

    def __init__(
        self,
        path: str,
        *,
        scale: float = 1.0,
        unit: str = "",
        channel: str = "opening",
        rate: float = CLOCK_RATE,
        reverse: bool = False,
        ports: Ports = find_ports,
    ) -> None:
        super().__init__(path, BAUD, ports)
        self._commands = set_up(threshold=1, rate=rate, reverse=reverse)
        self.rate = rate
        self.channels = (Channel(channel, unit),)
        #: Serial number that it told; None before that.
        self.serial: str | None = None
        self._scale, self._zero, self._count = scale, 0, 0
        self._parser = EncoderParser()
        self._first: Block | None = None

    @property
    def statistics(self) -> dict[str, int]:
        """What became of the lines since it was opened first."""
        return {"junk_lines": self._parser.junk_lines, "connections": self.connections}

    def read(self, timeout: float) -> Block | None:
        """What has arrived; see ``Device.read``."""
        if self._first is not None:
            block, self._first = self._first, None
            return block
        return self._told(*self._port.read(timeout))

    def zero(self) -> None:
        """Take the present opening for zero; see ``Device.zero``."""
        self._zero = self._count

    def _told(self, data: bytes, arrived: float) -> Block | None:
        """The counts in what came."""
        counts = self._parser.feed(data) if data else None
        for reply in self._parser.take_replies():
            if reply.letter == "e":
                self._events.say(f"{self.name} refused a command; is it a QSB?")
            elif reply.letter == "r":
                self.serial = reply.device()[1]
        if counts is None:
            return None
        self._count = int(counts.counts[-1])
        values = self._scale * (counts.counts - self._zero).astype(np.float64)
        return Block(np.full(len(counts), arrived), None, values[:, None])

    def _begin(self) -> None:
        """Have it stream; its first count is kept, as it holds until the next one."""
        self._parser.restart()
        if self.connections:
            self._events.say(
                f"{self.name} may have lost its count while it was unplugged; close the tongs and "
                f"zero it again."
            )
        for command in self._commands:
            self._port.write(command)
        self._first = None
        until = time.monotonic() + ANSWERS
        while self._first is None and time.monotonic() < until:
            self._first = self._told(*self._port.read(0.05))
        if self._first is None:
            raise InputError(
                f"{self.name} does not answer as a QSB does; check its cable and its port."
            )
