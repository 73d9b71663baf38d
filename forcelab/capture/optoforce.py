"""OptoForce DAQs at serial ports: their commands, their stream, and the device itself.

:mod:`forcelab.formats.optoforce_packets` has the packets themselves.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.device import Block, Device, UnpluggedError
from forcelab.capture.discovery import optoforce_ports
from forcelab.capture.serial_port import PortDevice
from forcelab.errors import InputError
from forcelab.formats.calibration import Calibration, channels_of, read_calibrations
from forcelab.formats.optoforce_packets import (
    Packets,
    Parser,
    Reply,
    SensorKind,
    Unwrapper,
    modal_step,
    status_sentences,
    with_checksum,
)

if TYPE_CHECKING:
    from forcelab.capture.reader import DeviceState

BAUD: Final = 1_000_000
#: Cut-off frequencies of the built-in low-pass filter in Hz, by code; 0 Hz is no filter.
FILTERS: Final = (0.0, 500.0, 150.0, 50.0, 15.0, 5.0, 1.5)
#: Seconds that a DAQ has for an answer, and for the first packet.
ANSWER_SECONDS = 1.0
#: Seconds without a packet after which that is remarked.
SILENCE_SECONDS = 1.0
#: Seconds over which the readings are averaged that a zeroing takes for zero.
ZEROING_SECONDS = 0.03
#: Steps of the counter from which its usual step is learnt, if so large a share is the same; and
#: the number from which the commonest is taken whatever its share.
_LEARN, _SHARE, _LEARN_ANYHOW = 16, 0.75, 256


def speed_code(rate: float) -> int:
    """The speed code for a rate (Hz): n for 1000 / n samples a second.

    Raises InputError, which names the nearest rates, if the DAQ has no such one.
    """
    code = round(1000 / rate) if 0 < rate < np.inf else 0
    if not 1 <= code <= 255 or abs(1000 / code - rate) > 0.005 * rate:
        near = sorted({1000 / n for n in (code - 1, code, code + 1) if 1 <= n <= 255} or {1000, 4})
        raise InputError(
            f"An OptoForce DAQ cannot give {rate:g} samples a second; choose 1000 / n with n from "
            f"1 to 255, such as {' or '.join(f'{rate:.5g}' for rate in near)}."
        )
    return code


def configure_command(speed: int, filtered: int = 4, zero: int = 0) -> bytes:
    """The command that sets speed (0 to stop) and filter by their codes, and zeroes if asked to.

    To zero, send it with `zero` 0, then with 255, and drop what had been buffered. A DAQ starts
    with filter 4 (15 Hz), see :data:`FILTERS`.
    """
    return with_checksum(bytes([170, 0, 50, 3, speed, filtered, zero]))


def serial_command() -> bytes:
    return with_checksum(bytes([171, 0, 18, 8]))


class PacketStream:
    """Turns the bytes of one DAQ into blocks of samples, whose values are counts.

    The first few samples are withheld until the usual step of the counter is known; they come with
    the first block then. A sample that came twice is dropped.
    """

    def __init__(self, rate: float) -> None:
        self.parser = Parser()
        self._rate = rate
        self._unwrapper: Unwrapper | None = None
        self._learning = True  # what the step is
        self._withheld: list[tuple[Packets, NDArray[np.float64]]] = []
        self._arrived = 0.0  # the last bytes

    @property
    def repeated(self) -> int:
        """How many samples were dropped, as the counter had not gone on since the one before."""
        return 0 if self._unwrapper is None else self._unwrapper.doubled

    def feed(self, data: bytes, arrived: float) -> Block | None:
        """The samples that are complete with these bytes, read at `arrived` (s); None without."""
        self._arrived = arrived
        return self._take(self.parser.feed(data))

    def flush(self) -> Block | None:
        """What is still withheld or unfinished, as nothing follows; None if there is nothing."""
        return self._take(self.parser.finish(), final=True)

    def restart(self, parser: Parser) -> None:
        """Go on with another parser, and learn the step anew: the DAQ was plugged in again.

        Ticks go on: the host's clock decides how many samples are missing in between.
        """
        self.parser, self._learning, self._withheld = parser, True, []

    def _take(self, packets: Packets, *, final: bool = False) -> Block | None:
        """These packets and those that are withheld as a block, once the step is known."""
        if len(packets):
            self._withheld.append((packets, np.full(len(packets), self._arrived)))
        if not self._withheld:
            return None
        counters = np.concatenate([packets.counts for packets, _ in self._withheld])
        if self._learning:
            step, share = modal_step(counters)
            if not final and len(counters) <= (_LEARN if share >= _SHARE else _LEARN_ANYHOW):
                return None
            self._learning = False
            if self._unwrapper is None:
                self._unwrapper = Unwrapper(step, self._rate)
            else:
                self._unwrapper.resume(step, self._rate)
        assert self._unwrapper is not None
        pieces, self._withheld = self._withheld, []
        arrived = np.concatenate([arrived for _, arrived in pieces])
        unwrapped = self._unwrapper.feed(counters, arrived)
        valid = unwrapped.is_new
        if not valid.any():
            return None
        values = np.concatenate([packets.values for packets, _ in pieces])[valid]
        status = np.concatenate([packets.status for packets, _ in pieces])[valid]
        return Block(arrived[valid], unwrapped.ticks, values.astype(np.float64), status)


def sends_raw_counts(device: Device | DeviceState) -> bool:
    """Whether an open device is an OptoForce DAQ without a calibration."""
    return device.name.startswith("optoforce:") and any(not c.unit for c in device.channels)


def uncalibrated_warning(name: str, cure: str = "give ?calibration=FILE") -> str:
    """The warning, before it is recorded, that a device gives raw counts, and what to do."""
    return (
        f"{name} is not calibrated: its forces are recorded as raw counts, which do not compare "
        f"with newtons; {cure}."
    )


class OptoForce(PortDevice):
    """A DAQ with its sensors; not for several threads at once.

    A zero survives an unplugged cable: the DAQ forgets it, and what it read at that moment is
    subtracted here from then on.
    """

    kind = "optoforce"

    def __init__(
        self,
        path: str,
        *,
        rate: float = 1000.0,
        filter: float = 15.0,  # noqa: A002 - as --device calls it
        calibration: Path | None = None,
        serial: str | None = None,
        ports: Callable[[], Sequence[str]] = optoforce_ports,
    ) -> None:
        """`rate` is 1000 / n Hz, `filter` (Hz, 0 for none) the cut-off frequency of its filter.

        The file `calibration` says how many newtons a count is; without it the readings are counts.
        Any DAQ with another `serial` is refused; by default the one that is found first is
        remembered. It may be at one of `ports` after it was plugged in again.
        """
        if filter not in FILTERS:
            raise InputError(
                f"An OptoForce DAQ has no filter of {filter:g} Hz; choose one of "
                f"{', '.join(f'{cutoff:g}' for cutoff in FILTERS)} (0 is none)."
            )
        super().__init__(path, BAUD)
        self.rate, self.serial = rate, serial
        if not rate > 0:
            raise InputError(f"An OptoForce DAQ needs a rate above zero, not {rate:g}.")
        self._speed, self._filter = speed_code(rate), FILTERS.index(filter)
        self._calibrations = None if calibration is None else read_calibrations(calibration)
        self._calibration: Calibration | None = None
        self._ports = ports
        self._kind: SensorKind | None = None
        self._first = 1  # number of its first sensor
        self._stream = PacketStream(rate)
        self._offset: NDArray[np.float64] | None = None
        self._zeroed = 0  # the connection in which the DAQ was zeroed; after it, it is not any more

    def number_sensors(self, first: int) -> int:
        assert self._kind is not None  # it is open
        self._first = first
        self.channels = channels_of(
            self._kind, calibrated=self._calibrations is not None, first=first
        )
        return first + self._kind.sensors

    def open(self) -> None:
        self._stream, self._offset = PacketStream(self.rate), None
        super().open()

    def read(self, timeout: float) -> Block | None:
        try:
            data, arrived = self._port.read(timeout)
        except UnpluggedError:
            self._port.close()
            withheld = self._stream.flush()
            if withheld is not None:
                return self._calibrated(withheld)  # the next call says that it is gone
            raise
        if not data:
            self._report_silence()
            return None
        repeated = self._stream.repeated
        block = self._stream.feed(data, arrived)
        for reply in self._stream.parser.take_replies():
            if reply.code:
                self._messages.put(
                    f"{self._display_name()} refused a configuration (code {reply.code})."
                )
        if block is None:
            if self._stream.repeated > repeated:
                self._last_arrival = arrived
                self._messages.put_once(
                    "still",
                    f"{self._display_name()}: its sample counter stands still, so its packets are "
                    f"left out as repeated; unplug it and plug it in again.",
                    arrived,
                )
            else:
                self._report_silence()
            return None
        self._last_arrival = arrived
        if block.status is not None:
            self._report_status(block.status[block.status != 0], arrived)
        return self._calibrated(block)

    def zero(self) -> None:
        """Take the present readings for zero; samples that come meanwhile are dropped."""
        self._offset = None
        self._configure_zero(0)
        readings: list[NDArray[np.float64]] = []
        until = time.monotonic() + ANSWER_SECONDS
        needed = max(1, round(ZEROING_SECONDS * self.rate))
        while sum(map(len, readings)) < needed and time.monotonic() < until:
            block = self._stream.feed(*self._port.read(0.1))
            if block is not None:
                readings.append(block.values)
        self._configure_zero(255)
        if readings:
            self._offset, self._zeroed = np.concatenate(readings).mean(axis=0), self.connections

    def _display_name(self) -> str:
        return f"OptoForce DAQ {self.serial}" if self.serial else f"The DAQ at {self._path}"

    def _candidate_ports(self) -> Sequence[str]:
        """Where it was, and wherever a DAQ may be if its serial number is known."""
        others = [path for path in self._ports() if path != self._path] if self.serial else []
        return (self._path, *others)

    def _configure(self) -> None:
        """Learn which DAQ this is, and configure it if it is the right one."""
        parser, where = Parser(), self._port.path
        reply = self._ask(parser, serial_command(), lambda reply: reply.serial is not None)
        serial = reply.serial if reply else None
        if self.serial is not None and serial != self.serial:
            raise InputError(
                f"The device at {where} is {serial or 'one without a serial number'}, not "
                f"OptoForce DAQ {self.serial}; name the port that this one is at."
            )
        code = self._ask_to_configure(parser, 0)
        kind = self._read_kind(parser)
        if self.connections and kind != self._kind:
            raise InputError(f"The device at {where} has other sensors; connect it anew.")
        if self._calibrations is not None:
            self._calibration = self._calibrations.find(serial, kind)
        self._kind, self.serial = kind, serial
        self.number_sensors(self._first)
        self._stream.restart(parser)
        name = self._display_name() if serial else f"The DAQ at {where}"
        if serial is None:
            self._messages.put(
                f"{name} does not tell its serial number; after unplugging it is looked for at "
                f"the same port only."
            )
        if code != 0:
            why = "did not confirm" if code is None else f"refused (code {code})"
            self._messages.put(f"{name} {why} its configuration.")

    def _calibrated(self, block: Block) -> Block:
        """A block of counts in the unit of the channels, from the zero on."""
        values = block.values
        if self._offset is not None and self._zeroed != self.connections:  # it has forgotten that
            values = values - self._offset
        if self._calibration is not None:
            values = self._calibration.apply(values)
        return replace(block, values=values)

    def _ask(
        self, parser: Parser, message: bytes, is_answer: Callable[[Reply], bool]
    ) -> Reply | None:
        """Send a message, once more if no answer comes; the answer, or None.

        Packets that come meanwhile are dropped.
        """
        parser.take_replies()  # what was answered before is no answer to this
        for _ in range(2):
            self._port.write(message)
            until = time.monotonic() + ANSWER_SECONDS / 2
            while time.monotonic() < until:
                data, arrived = self._port.read(0.05)
                parser.feed(data)
                answers = [reply for reply in parser.take_replies() if is_answer(reply)]
                if answers:
                    self._last_arrival = arrived
                    return answers[-1]
        return None

    def _ask_to_configure(self, parser: Parser, zero: int) -> int | None:
        """Configure it; the code that it answers, 0 if it accepts, or None."""
        command = configure_command(self._speed, self._filter, zero)
        reply = self._ask(parser, command, lambda reply: reply.code is not None)
        return None if reply is None else reply.code

    def _configure_zero(self, zero: int) -> None:
        """Have it take its readings for zero (255), or forget that (0)."""
        code = self._ask_to_configure(self._stream.parser, zero)
        if code is None:
            self._messages.put(
                f"{self._display_name()} did not confirm that it was zeroed; zero it again."
            )
        elif code:
            self._messages.put(f"{self._display_name()} refused to be zeroed (code {code}).")

    def _read_kind(self, parser: Parser) -> SensorKind:
        """The kind of its packets."""
        until = time.monotonic() + ANSWER_SECONDS
        while parser.kind is None:
            if time.monotonic() > until:
                raise InputError(
                    f"The device at {self._port.path} sends no OptoForce packets; check that it "
                    f"is a DAQ, and that its sensors are plugged in."
                )
            parser.feed(self._port.read(0.05)[0])
        return parser.kind

    def _report_status(self, status: NDArray[np.uint16], arrived: float) -> None:
        """Remark what status words other than zero say, shape (n,), the last read at `arrived`."""
        name = self._display_name()
        for number in np.unique(status & 0xF):
            word = int(np.bitwise_or.reduce(status[status & 0xF == number]))
            for sentence in status_sentences(word & ~0x03F0):
                self._messages.put_once(sentence, f"{name}: {sentence}", arrived)
            for sentence in status_sentences(word & 0x03FF):
                self._messages.put_once(int(number), f"{name}: {sentence}", arrived)

    def _report_silence(self) -> None:
        name = self._display_name()
        sentence = f"{name} has sent no valid packet for {SILENCE_SECONDS:g} s; check its cable."
        self._remark_silence(SILENCE_SECONDS, sentence)
