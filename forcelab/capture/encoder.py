"""US Digital's QSB-D, which reads a quadrature encoder: the opening of the tongs.

It speaks lines of text at 230,400 baud. A command is a letter, two hexadecimal digits for a
register, and up to eight for a value: ``R0E`` reads, ``W0B1`` writes, ``S0E`` sends register 0E
again and again. The answer has the letter in lower case, or ``e`` for an error, the register, eight
digits of value, eight of the device's clock if so configured, and an exclamation mark; blanks may
stand between them. Its clock counts 1/512 s.

A stream comes at a fixed interval, but only when the count has changed by more than a threshold:
in between the last value holds, which is no gap. Facts from US Digital's public "QSB Commands
List"; only the registers named here are needed.
"""

from __future__ import annotations

import re
import time
from typing import Final

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.device import Block, SoftwareZero
from forcelab.capture.discovery import find_ports
from forcelab.capture.serial_port import LineDevice, LineSplitter, Ports
from forcelab.demonstration import Channel
from forcelab.errors import InputError

BAUD: Final = 230_400
#: Ticks a second of its clock, and so the fastest stream.
CLOCK_RATE: Final = 512.0

_MODE, _QUADRATURE, _DIRECTION = 0x00, 0x03, 0x04
_THRESHOLD, _INTERVAL, _CLOCK = 0x0B, 0x0C, 0x0D
#: The register of the encoder's count.
COUNT: Final = 0x0E
_FORMAT = 0x15
#: LF, CR, clock and blanks in each answer.
_FULL_FORMAT = 0x0F
#: Counts for each line of the encoder.
_FOUR_A_LINE = 3

_ANSWER = re.compile(
    rb"\s*([rwse])\s*([0-9A-F]{2})\s*([0-9A-F]{8})(?:\s*([0-9A-F]{8}))?\s*!?\s*", re.I
)
_TURN = 1 << 32


def setup_commands(*, reverse: bool = False, rate: float = CLOCK_RATE) -> tuple[bytes, ...]:
    """The commands that make a device stream its count whenever that changes, in their order.

    Each is answered by a line of its own, except that the stream begins after the last one. `rate`
    is the most that is sent, in Hz: 512 / n; `reverse` counts the other way round.
    """
    if not 0 < rate <= CLOCK_RATE:
        raise InputError(f"The encoder sends at most {CLOCK_RATE:g} counts a second, not {rate:g}.")
    return (
        _write(_FORMAT, _FULL_FORMAT),
        _write(_MODE, 0),
        _write(_QUADRATURE, _FOUR_A_LINE),
        _write(_DIRECTION, 0x80 if reverse else 0),
        _write(_THRESHOLD, 1),
        _write(_INTERVAL, max(1, round(CLOCK_RATE / rate))),
        _write(_CLOCK, 1),  # the clock starts at zero, so that it does not wrap soon
        f"S{COUNT:02X}\r\n".encode(),
    )


def _write(register: int, value: int) -> bytes:
    """The command that writes a value of 32 bits into a register."""
    return f"W{register:02X}{value:08X}\r\n".encode()


class EncoderParser:
    """Turns the bytes of one QSB-D into counts."""

    def __init__(self) -> None:
        #: How many commands it has refused.
        self.refused = 0
        self._splitter = LineSplitter()
        self._count: int | None = None

    def feed(self, data: bytes) -> NDArray[np.int64]:
        """The counts that are complete with these bytes, signed and not wrapping, shape (n,).

        A count that was asked for with ``R0E`` comes as one that was streamed. Lines that are no
        answer are passed over.
        """
        counts: list[int] = []
        for line in self._splitter.feed(data):
            answer = _ANSWER.fullmatch(line)
            if answer is None:
                continue
            letter, register = answer[1].decode().lower(), int(answer[2], 16)
            value = int(answer[3], 16)
            if letter in "rs" and register == COUNT:
                self._count = _unwrap(self._count, value)
                counts.append(self._count)
            self.refused += letter == "e"
        return np.array(counts, np.int64)

    def restart(self) -> None:
        """Go on after the cable was plugged in again, when the count may start anew."""
        self._splitter.forget()
        self._count = None


def _unwrap(before: int | None, value: int) -> int:
    """A signed value of 32 bits as the nearest one to what was before."""
    step = (value - (before or 0)) % _TURN
    return (before or 0) + (step - _TURN if step >= _TURN // 2 else step)


#: Seconds within which an encoder answers.
ANSWER_SECONDS = 1.0


class Encoder(LineDevice):
    """The opening of the tongs by a quadrature encoder behind a QSB.

    It sends its count when that changes: in between the last value holds. A zero holds over the
    cable as that of every device does; but without power the adapter forgets what it counted, and
    nothing tells whether it had any: a remark asks to zero it again.
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
        """At most `rate` counts a second (Hz: 512 / n), each of `scale` units."""
        super().__init__(path, BAUD, ports)
        if not 0 < abs(scale) < np.inf:
            raise InputError(
                f"An encoder cannot be read at {scale:g} units a count; write a number that is not "
                f"zero, such as scale=0.01."
            )
        self._commands = setup_commands(rate=rate, reverse=reverse)
        self.rate = rate
        self.channels = (Channel(channel, unit),)
        self._scale = scale
        self._parser = EncoderParser()
        self._first: Block | None = None

    def open(self) -> None:
        self._parser, self._zero = EncoderParser(), SoftwareZero()
        super().open()

    def read(self, timeout: float) -> Block | None:
        if self._first is not None:
            block, self._first = self._first, None
            return block
        return self._parse_counts(*self._port.read(timeout))

    def _parse_counts(self, data: bytes, arrived: float) -> Block | None:
        """The counts in what came."""
        refused = self._parser.refused
        counts = self._parser.feed(data)
        if self._parser.refused > refused:
            self._messages.put(f"{self.name} refused a command; is it a QSB?")
        if not len(counts):
            return None
        values = self._scale * self._zero.apply(counts[:, None].astype(np.float64))
        return Block(np.full(len(counts), arrived), None, values)

    def _configure(self) -> None:
        """Have it stream; its first count is kept, as it holds until the next one."""
        self._parser.restart()
        if self.connections:
            self._messages.put(
                f"{self.name} may have lost its count while it was unplugged; close the tongs and "
                f"zero it again."
            )
        for command in self._commands:
            self._port.write(command)
        self._first = None
        until = time.monotonic() + ANSWER_SECONDS
        while self._first is None and time.monotonic() < until:
            self._first = self._parse_counts(*self._port.read(0.05))
        if self._first is None:
            raise InputError(
                f"{self.name} does not answer as a QSB does; check its cable and its port."
            )
