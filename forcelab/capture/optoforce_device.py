"""An OptoForce DAQ at a serial port, asked while it streams."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.device import Block, UnpluggedError
from forcelab.capture.discovery import optoforce_ports
from forcelab.capture.optoforce import (
    BAUD,
    FILTERS,
    StatusMessages,
    Stream,
    Tare,
    configure,
    serial_request,
    speed_for,
)
from forcelab.capture.serial_port import Port, PortDevice
from forcelab.demonstration import Channel
from forcelab.errors import InputError
from forcelab.formats.calibration import Calibration, channels_of, read_calibrations
from forcelab.formats.optoforce_packets import Parser, Reply, SensorKind


class _Told(Protocol):
    """What is known of a device."""

    @property
    def name(self) -> str:
        """What it is called."""

    @property
    def channels(self) -> Sequence[Channel]:
        """What it gives."""


def counting(device: _Told) -> bool:
    """Whether a device that is open gives the raw counts of an OptoForce DAQ."""
    called = device.name.startswith("optoforce:")
    return called and any(not channel.unit for channel in device.channels)


def uncalibrated(name: str, cure: str = "give ?calibration=FILE") -> str:
    """What is said of a device that gives raw counts, before it is recorded, and what to do."""
    return (
        f"{name} is not calibrated: its forces are recorded as raw counts, which do not compare "
        f"with newtons; {cure}."
    )


#: Seconds that a DAQ has for an answer, and for the first packet.
ANSWER = 1.0


class CommandChannel:
    """Questions and answers between packets of data, which are passed over.

    Parameters
    ----------
    port : Port
        Open.
    """

    def __init__(self, port: Port) -> None:
        self._port, self._parser = port, Parser()
        self._tail = b""

    @property
    def left(self) -> bytes:
        """The unfinished packet at the end of what was read."""
        pending = self._parser.pending
        return self._tail[-pending:] if pending else b""

    def ask(self, message: bytes, wanted: Callable[[Reply], bool]) -> Reply | None:
        """Send a message, once more if nobody answers; the answer, or None if there is none."""
        for _ in range(2):
            self._port.write(message)
            until = time.monotonic() + ANSWER / 2
            while time.monotonic() < until:
                self._read()
                found = [reply for reply in self._parser.take_replies() if wanted(reply)]
                if found:
                    return found[-1]
        return None

    def kind(self) -> SensorKind:
        """The kind of its packets.

        Raises
        ------
        InputError
            If none comes.
        """
        until = time.monotonic() + ANSWER
        while self._parser.kind is None:
            if time.monotonic() > until:
                raise InputError(
                    f"The device at {self._port.path} sends no OptoForce packets; check that it "
                    f"is a DAQ, and that its sensors are plugged in."
                )
            self._read()
        return self._parser.kind

    def _read(self) -> None:
        """Take in what has come."""
        data, _ = self._port.read(0.05)
        self._parser.feed(data)
        self._tail = (self._tail + data)[-64:]


#: Seconds over which the readings are averaged that a zeroing takes for zero.
ZEROING = 0.03


class OptoForce(PortDevice):
    """A DAQ with its sensors; see :class:`~forcelab.capture.device.Device`.

    A zero that was taken survives an unplugged cable: the DAQ forgets it, and what it read at that
    moment is subtracted here from then on. Not for several threads at once.

    Parameters
    ----------
    path : str
        Its port.
    rate : float
        Samples a second: 1000 / n.
    cutoff : float
        Of its filter, in Hz; 0 for none.
    calibration : Path, optional
        File that says how many newtons a count is; without it the readings are counts.
    serial : str, optional
        Refuse any other DAQ. By default the one that is found first is remembered.
    first : int
        Number of its first sensor, which the names of the channels end with.
    ports : callable
        Ports at which it may be after it was plugged in again.

    Attributes
    ----------
    serial : str or None
        Serial number, once it was opened and if it told it.
    connections : int
        How often it was connected.

    Raises
    ------
    InputError
        If the DAQ has no such rate or filter, or the calibration file is not right.
    """

    kind = "optoforce"

    def __init__(
        self,
        path: str,
        *,
        rate: float = 1000.0,
        cutoff: float = 15.0,
        calibration: Path | None = None,
        serial: str | None = None,
        first: int = 1,
        ports: Callable[[], Sequence[str]] = optoforce_ports,
    ) -> None:
        if cutoff not in FILTERS:
            raise InputError(
                f"An OptoForce DAQ has no filter of {cutoff:g} Hz; choose one of "
                f"{', '.join(f'{one:g}' for one in FILTERS)} (0 is none)."
            )
        self.rate = rate
        self.serial = serial
        self.first = first
        super().__init__(path, BAUD)
        if not rate > 0:
            raise InputError(f"An OptoForce DAQ needs a rate above zero, not {rate:g}.")
        self._speed, self._filter = speed_for(rate), FILTERS.index(cutoff)
        self._calibrations = None if calibration is None else read_calibrations(calibration)
        self._calibration: Calibration | None = None
        self._ports = ports
        self._kind: SensorKind | None = None
        self._stream = Stream(rate)
        self._offset: NDArray[np.float64] | None = None
        self._zeroed = 0  # the connection in which the DAQ was zeroed; after it, it is not any more
        self._left = b""
        self._said = StatusMessages()

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Such as ``fx1 fy1 fz1``; none before it was opened, as its packets tell how many."""
        if self._kind is None:
            return ()
        return channels_of(self._kind, calibrated=self._calibrations is not None, first=self.first)

    @property
    def sensors(self) -> int:
        """How many sensors its packets tell of; 0 before it was opened."""
        return self._kind.sensors if self._kind else 0

    def open(self) -> None:
        """Connect, learn what it is, and configure it; see ``Device.open``."""
        self._stream, self._offset = Stream(self.rate), None
        super().open()

    def read(self, timeout: float) -> Block | None:
        """What has arrived; see ``Device.read``."""
        try:
            data, arrived = self._port.read(timeout)
        except UnpluggedError:
            self._port.close()
            withheld = self._stream.flush()
            if withheld is not None:
                return withheld  # the next call says that it is gone
            raise
        if self._left:
            data, self._left = self._left + data, b""
        if not data:
            self._said.silence(self._called(), self._heard)
            return None
        return self._parse_packets(data, arrived)

    def zero(self) -> None:
        """Take the present readings for zero; samples that come meanwhile are dropped.

        Raises
        ------
        UnpluggedError
            If the DAQ is gone.
        """
        self._offset = None
        self._order(configure(self._speed, self._filter, 0))
        self._stream.calibration = None
        readings: list[NDArray[np.float64]] = []
        until = time.monotonic() + ANSWER
        wanted = max(1, round(ZEROING * self.rate))
        while sum(map(len, readings)) < wanted and time.monotonic() < until:
            block = self._stream.feed(*self._port.read(0.1))
            if block is not None:
                readings.append(block.values)
        self._order(configure(self._speed, self._filter, 255))
        if readings:
            self._offset, self._zeroed = np.concatenate(readings).mean(axis=0), self.connections
        self._calibrate()

    def remarks(self) -> tuple[str, ...]:
        """What went wrong since the last time this was asked; see ``Device.remarks``."""
        return self._said.take()

    def _called(self) -> str:
        """What sentences call it."""
        return f"OptoForce DAQ {self.serial}" if self.serial else f"The DAQ at {self._path}"

    def _places(self) -> Sequence[str]:
        """Where it was, and wherever a DAQ may be if it can be told by its serial number."""
        others = [path for path in self._ports() if path != self._path] if self.serial else []
        return (self._path, *others)

    def _connect(self, path: str) -> None:
        """Connect, and let the stream give what this connection's zero makes of it."""
        super()._connect(path)
        self._calibrate()

    def _begin(self) -> None:
        """Learn which DAQ this is, and configure it if it is the right one."""
        talk, where = CommandChannel(self._port), self._port.path
        reply = talk.ask(serial_request(), lambda reply: reply.serial is not None)
        serial = reply.serial if reply else None
        if self.serial is not None and serial != self.serial:
            raise InputError(
                f"The device at {where} is {serial or 'one without a serial number'}, not "
                f"OptoForce DAQ {self.serial}; name the port that this one is at."
            )
        code = talk.ask(
            configure(self._speed, self._filter, 0), lambda reply: reply.code is not None
        )
        kind = talk.kind()
        if self.connections and kind != self._kind:
            raise InputError(f"The device at {where} has other sensors; connect it anew.")
        if self._calibrations is not None:
            self._calibration = self._calibrations.find(serial, kind)
        self._kind, self.serial, self._left = kind, serial, talk.left
        if self.connections:
            self._stream.flush()
            self._stream.restart(self.rate)
        called = self._called() if serial else f"The DAQ at {where}"
        if serial is None:
            self._said.say(
                f"{called} does not tell its serial number; after unplugging it is looked for at "
                f"the same port only."
            )
        if code is None or code.code:
            why = "did not confirm" if code is None else f"refused (code {code.code})"
            self._said.say(f"{called} {why} its configuration.")

    def _calibrate(self) -> None:
        """Let the stream give what the channels promise."""
        calibration = self._calibration
        if self._offset is not None and self._zeroed != self.connections:
            ones = np.ones(len(self._offset))
            known = calibration or Calibration("counts", ones, ones)
            calibration = Tare(known.source, known.positive, known.negative, self._offset)
        self._stream.calibration = calibration

    def _order(self, message: bytes) -> None:
        """Send a configuration, and drop what comes until it is confirmed."""
        self._port.write(message)
        until = time.monotonic() + ANSWER
        while time.monotonic() < until:
            data, arrived = self._port.read(0.1)
            self._stream.feed(self._left + data, arrived)
            self._left = b""
            codes = [reply.code for reply in self._stream.take_replies() if reply.code is not None]
            if codes:
                self._heard = arrived
                if codes[-1] != 0:
                    self._said.say(f"{self._called()} refused to be zeroed (code {codes[-1]}).")
                return
        self._said.say(f"{self._called()} did not confirm that it was zeroed; zero it again.")

    def _parse_packets(self, data: bytes, arrived: float) -> Block | None:
        """What the DAQ told."""
        repeated = self._stream.repeated
        block = self._stream.feed(data, arrived)
        for reply in self._stream.take_replies():
            if reply.code:
                self._said.say(f"{self._called()} refused a configuration (code {reply.code}).")
        if block is None:
            if self._stream.repeated > repeated:
                self._heard = arrived
                self._said.still(self._called(), arrived)
            else:
                self._said.silence(self._called(), self._heard)
            return None
        self._heard = arrived
        if block.status is not None:
            self._said.status(self._called(), block.status[block.status != 0], arrived)
        return block
