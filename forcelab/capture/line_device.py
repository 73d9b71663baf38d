"""A device that speaks in lines of text, at a port where it is found again."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence

from forcelab.capture.discovery import FoundPort, port_like
from forcelab.capture.events import Events
from forcelab.capture.port_device import PortDevice
from forcelab.demonstration import Channel

__all__ = ["LineDevice", "Ports"]

Ports = Callable[[], Iterable[FoundPort]]


class LineDevice(PortDevice):
    """What such devices have in common: the port is found again by its USB serial number."""

    def __init__(self, path: str, baud: int, ports: Ports) -> None:
        super().__init__(path, baud)
        self.rate = 0.0
        self.channels: tuple[Channel, ...] = ()
        self._ports = ports
        self._known = FoundPort(path, "unknown", "", None, None, usable=True)
        self._events = Events()

    def open(self) -> None:
        """Connect and learn what it sends; see ``Device.open``."""
        real = os.path.realpath(self._path)
        same = (port for port in self._ports() if os.path.realpath(port.path) == real)
        self._known = next(same, FoundPort(self._path, "unknown", "", None, None, usable=True))
        super().open()

    def remarks(self) -> tuple[str, ...]:
        """What went wrong since the last time this was asked; see ``Device.remarks``."""
        return self._events.take()

    def _places(self) -> Sequence[str]:
        """Wherever its USB serial number is now; else where it was."""
        path = port_like(self._known, self._ports()) if self._known.usb else self._path
        return () if path is None else (path,)
