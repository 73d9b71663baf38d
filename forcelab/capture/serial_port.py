"""A serial port: opened for one reader alone, read as bytes arrive, found again."""

from __future__ import annotations

import errno
import os
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Final

from forcelab.capture.device import UnpluggedError
from forcelab.capture.discovery import LOOK, FoundPort, port_like
from forcelab.capture.messages import MessageQueue
from forcelab.demonstration import Channel
from forcelab.errors import InputError

if TYPE_CHECKING:
    import serial


#: Bytes of the longest line that can mean anything; a wrong baud rate may send no line end at all.
LONGEST: Final = 2048


class LineSplitter:
    """Splits a stream at CR, LF or both; blank lines are left out, unfinished ones are kept.

    A line longer than :data:`LONGEST` comes cut to one byte more than that, however much of it
    there was.
    """

    def __init__(self) -> None:
        self._tail = b""

    def feed(self, data: bytes) -> list[bytes]:
        """The lines that are complete with these bytes, without their ends.

        Parameters
        ----------
        data : bytes
            What follows on what was given before.
        """
        *lines, tail = (self._tail + data.replace(b"\r", b"\n")).split(b"\n")
        self._tail = tail[: LONGEST + 1]
        cut = [line[: LONGEST + 1] for line in lines]
        return [line for line in cut if line.strip()]

    def forget(self) -> None:
        """Drop the unfinished line, as after a cable was unplugged."""
        self._tail = b""


#: Seconds after which a device that takes no bytes is taken for gone.
WRITING = 1.0
#: Bytes that are read at once at most, so that a fast device cannot keep a reader for ever.
AT_ONCE = 1 << 20
#: What the system says of a port that somebody else has open.
BUSY = {errno.EBUSY, errno.EAGAIN}


class Port:
    """A serial port, 8 data bits, no parity, 1 stop bit.

    Parameters
    ----------
    path : str
        Such as ``/dev/ttyACM0`` or ``COM3``.
    baud : int
        Bits a second.
    gather : float
        Seconds that lie between two reads at least: what arrives meanwhile is read together, which
        costs a fraction of reading packet by packet.

    Attributes
    ----------
    path : str
        As given.
    """

    def __init__(self, path: str, baud: int, gather: float = 0.0) -> None:
        self.path = path
        self._baud, self._gather = baud, gather
        self._port: serial.Serial | None = None
        self._errors: tuple[type[Exception], ...] = (OSError,)
        self._next = 0.0

    def open(self) -> None:
        """Open it for this program alone; what arrived before is dropped.

        Raises
        ------
        InputError
            If that cannot be done: what, where, the cure.
        """
        try:
            import serial
        except ImportError as error:
            raise InputError(
                f"The port {self.path} needs pyserial; install it with 'pip install pyserial'."
            ) from error
        self.close()
        self._errors = (OSError, *_terminal_errors())
        try:
            self._port = serial.Serial(
                self.path, self._baud, timeout=0.1, write_timeout=WRITING, exclusive=True
            )
        except ValueError as error:
            raise InputError(
                f"The port {self.path} cannot be set to {self._baud} baud; choose a usual rate, "
                f"such as 115200."
            ) from error
        except self._errors as error:
            raise InputError(_sentence(self.path, error)) from error
        self._next = 0.0

    def read(self, timeout: float) -> tuple[bytes, float]:
        """Everything there is, after waiting for at most so many seconds for the first of it.

        Returns
        -------
        data : bytes
            Empty if nothing has come.
        arrived : float
            When the read returned, in seconds of the host's monotonic clock.

        Raises
        ------
        UnpluggedError
            If the device is gone.
        """
        begun = time.monotonic()
        pause = min(self._next - begun, timeout)
        if pause > 0:
            time.sleep(pause)
        port = self._opened()
        try:
            data = _taken(port, max(timeout - max(pause, 0.0), 0.0))
        except self._errors as error:
            raise self._lost_device_sentence() from error
        arrived = time.monotonic()
        self._next = arrived + self._gather
        return data, arrived

    def write(self, data: bytes) -> None:
        """Send bytes.

        Raises
        ------
        UnpluggedError
            If the device is gone, or takes nothing.
        """
        port = self._opened()
        try:
            port.write(data)
        except self._errors as error:
            raise self._lost_device_sentence() from error

    def close(self) -> None:
        """Let go of it; closing twice is fine."""
        port, self._port = self._port, None
        if port is not None:
            with suppress(*self._errors):  # the device may be gone already
                port.close()

    def _opened(self) -> serial.Serial:
        """The open port."""
        if self._port is None:
            raise UnpluggedError(f"The port {self.path} is not open.")
        return self._port

    def _lost_device_sentence(self) -> UnpluggedError:
        """What is said when the device does not answer any more."""
        # What the system says of it (an input/output error, mostly) helps nobody to plug it in.
        return UnpluggedError(f"The device at {self.path} is gone; plug it in again.")


def _taken(port: serial.Serial, timeout: float) -> bytes:
    """Everything that has arrived, after waiting for the first byte."""
    waiting = port.in_waiting
    if not waiting:
        if port.timeout != timeout:
            port.timeout = timeout
        data = port.read(1)
        if not data:
            return b""
        pieces = [data]
    else:
        pieces = []
    taken = 0
    # The system may hand over only a part of what there is at a time.
    while (waiting := port.in_waiting) and taken < AT_ONCE:
        pieces.append(port.read(waiting))
        taken += waiting
    return b"".join(pieces)


def _terminal_errors() -> tuple[type[Exception], ...]:
    """What terminals raise where there are any; pyserial lets some of it through."""
    try:
        import termios
    except ImportError:
        return ()
    return (termios.error,)


def _sentence(path: str, error: Exception) -> str:
    """Why a port cannot be opened, and the cure."""
    number = error.errno if isinstance(error, OSError) else error.args[0]
    if number == errno.ENOENT:
        return f"There is no port {path}; plug the device in, and {LOOK}."
    if number in {errno.EACCES, errno.EPERM}:
        return (
            f"You may not open {path}; become a member of the group that owns it "
            f"(sudo usermod -a -G dialout $USER) and log in again."
        )
    if number in BUSY:
        return f"The port {path} is in use by another program; close that first."
    return f"The port {path} cannot be opened ({error}); is it a serial port?"


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


Ports = Callable[[], Iterable[FoundPort]]


class LineDevice(PortDevice):
    """What such devices have in common: the port is found again by its USB serial number."""

    def __init__(self, path: str, baud: int, ports: Ports) -> None:
        super().__init__(path, baud)
        self.rate = 0.0
        self.channels: tuple[Channel, ...] = ()
        self._ports = ports
        self._known = FoundPort(path, "unknown", "", None, None, usable=True)
        self._events = MessageQueue()

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
