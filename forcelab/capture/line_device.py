"""A device that speaks in lines of text, at a port where it is found again."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable

from forcelab.capture.blocks import UnpluggedError
from forcelab.capture.discovery import FoundPort, port_like
from forcelab.capture.events import Events
from forcelab.capture.serial_port import Port
from forcelab.demonstration import Channel
from forcelab.errors import InputError

__all__ = ["LineDevice", "Ports"]

#: Seconds between two reads at least.
GATHER = 0.004

Ports = Callable[[], Iterable[FoundPort]]


class LineDevice:
    """What such devices have in common: the port is found again by its USB serial number."""

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
