"""The encoder that tells how far the tongs are open."""

from __future__ import annotations

import time

import numpy as np

from forcelab.capture.blocks import Block
from forcelab.capture.discovery import find_ports
from forcelab.capture.encoder import BAUD, CLOCK_RATE, EncoderParser, set_up
from forcelab.capture.line_device import LineDevice, Ports
from forcelab.demonstration import Channel
from forcelab.errors import InputError

__all__ = ["Encoder"]

#: Seconds that an encoder has for its answers.
ANSWERS = 1.0


class Encoder(LineDevice):
    """The opening of the tongs by a quadrature encoder behind a QSB; see ``Device``.

    It sends its count when that changes: in between the last value holds. A zero holds over the
    cable as that of every device does; but without power the adapter forgets what it counted, and
    whether it had any is not told: a remark asks to zero it again.

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

    Raises
    ------
    InputError
        If the scale is zero or not finite, or the device has no such rate.
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
        if not 0 < abs(scale) < np.inf:
            raise InputError(
                f"An encoder cannot be read at {scale:g} units a count; write a number that is not "
                f"zero, such as scale=0.01."
            )
        self._commands = set_up(rate=rate, reverse=reverse)
        self.rate = rate
        self.channels = (Channel(channel, unit),)
        #: Serial number that it told; None before that.
        self.serial: str | None = None
        self._scale, self._zero, self._count = scale, 0, 0
        self._parser = EncoderParser()
        self._first: Block | None = None

    def open(self) -> None:
        """Connect and have it stream; see ``Device.open``."""
        self._parser, self._zero, self._count, self.serial = EncoderParser(), 0, 0, None
        super().open()

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
        counts = self._parser.feed(data)
        for reply in self._parser.take_replies():
            if reply.letter == "e":
                self._events.say(f"{self.name} refused a command; is it a QSB?")
            elif reply.letter == "r":
                self.serial = reply.serial
        if not len(counts):
            return None
        self._count = int(counts[-1])
        values = self._scale * (counts - self._zero).astype(np.float64)
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
