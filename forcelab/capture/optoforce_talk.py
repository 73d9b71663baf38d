"""Asking a DAQ that streams all the while."""

from __future__ import annotations

import time
from collections.abc import Callable

from forcelab.capture.serial_port import Port
from forcelab.errors import InputError
from forcelab.formats.optoforce.packets import Kind, Parser, Reply

__all__ = ["ANSWER", "Talk"]

#: Seconds that a DAQ has for an answer, and for the first packet.
ANSWER = 1.0


class Talk:
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

    def kind(self) -> Kind:
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
