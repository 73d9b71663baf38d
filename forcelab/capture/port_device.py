"""A device at a serial port: opened, and found again once it was unplugged."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Sequence

from forcelab.capture.blocks import UnpluggedError
from forcelab.capture.serial_port import Port
from forcelab.errors import InputError

__all__ = ["PortDevice"]

#: Seconds between two reads at least; the newest sample of each is still a millisecond old at most.
GATHER = 0.004


class PortDevice(ABC):
    """What devices at serial ports have in common.

    Parameters
    ----------
    path : str
        Its port.
    baud : int
        Bits a second.

    Attributes
    ----------
    connections : int
        How often it was connected since it was opened.
    """

    kind = ""
    holds = False

    def __init__(self, path: str, baud: int) -> None:
        self.connections = 0
        self._path, self._baud = path, baud
        self._port = Port(path, baud, GATHER)
        self._heard = 0.0

    @property
    def name(self) -> str:
        """Such as ``"text:/dev/ttyUSB0"``; the port is the present one."""
        return f"{self.kind}:{self._path}"

    def open(self) -> None:
        """Connect and learn what it sends; see ``Device.open``."""
        self.connections = 0
        try:
            self._connect(self._path)
        except UnpluggedError as error:
            raise InputError(str(error)) from error

    def reopen(self) -> None:
        """Find the same device again, at whatever port, and connect to it.

        Raises
        ------
        UnpluggedError
            While it is not back.
        """
        self.close()
        for path in self._places():
            try:
                self._connect(path)
            except (InputError, UnpluggedError):
                continue
            return
        raise UnpluggedError(f"{self._called()} is not plugged in again yet.")

    def close(self) -> None:
        """Let go of it; see ``Device.close``."""
        self._port.close()

    def _connect(self, path: str) -> None:
        """Open a port and begin, if the right device is behind it."""
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

    def _called(self) -> str:
        """What sentences call it."""
        return self.name

    @abstractmethod
    def _places(self) -> Sequence[str]:
        """The ports at which it may be after it was plugged in again, the likeliest first."""

    @abstractmethod
    def _begin(self) -> None:
        """What has to be said and learnt first, at a port that is open."""
