"""A serial port: opened for one reader alone, read as bytes arrive, found again."""

from __future__ import annotations

import errno
import os
import sys
import time
from abc import abstractmethod
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Final

from forcelab.capture.device import Device, ReadPacer, UnpluggedError
from forcelab.capture.discovery import LIST_HINT, FoundPort, relocate_port
from forcelab.errors import InputError

if TYPE_CHECKING:
    import serial


#: Bytes of the longest line that can mean anything; a wrong baud rate may send no line end at all.
LONGEST: Final = 2048


class LineSplitter:
    """Splits a stream at CR, LF or both; blank lines are left out, unfinished ones are kept.

    A line longer than :data:`LONGEST` comes cut to one byte more than that, however long it was.
    """

    def __init__(self) -> None:
        self._tail = b""

    def feed(self, data: bytes) -> list[bytes]:
        """The lines that are complete with these bytes, without their ends."""
        *lines, tail = (self._tail + data.replace(b"\r", b"\n")).split(b"\n")
        self._tail = tail[: LONGEST + 1]
        cut = [line[: LONGEST + 1] for line in lines]
        return [line for line in cut if line.strip()]

    def forget(self) -> None:
        """Drop the unfinished line, as after a cable was unplugged."""
        self._tail = b""


#: Seconds after which a device that takes no bytes is taken for gone.
WRITE_TIMEOUT = 1.0
#: Bytes that are read at once at most, so that a fast device cannot keep a reader for ever.
AT_ONCE = 1 << 20
#: Errors of a port that another program has open.
BUSY = {errno.EBUSY, errno.EAGAIN}


class Port:
    """A serial port with 8 data bits, no parity and 1 stop bit."""

    def __init__(self, path: str, baud: int) -> None:
        self.path, self._baud = path, baud
        self._port: serial.Serial | None = None
        self._errors: tuple[type[Exception], ...] = (OSError,)
        self._pacer = ReadPacer()

    def open(self) -> None:
        """Open it for this program alone; what arrived before is dropped."""
        import serial  # what talks to no port does without

        self.close()
        self._errors = (OSError, *_terminal_errors())
        try:
            self._port = serial.Serial(
                self.path, self._baud, timeout=0.1, write_timeout=WRITE_TIMEOUT, exclusive=True
            )
        except ValueError as error:
            raise InputError(
                f"The port {self.path} cannot be set to {self._baud} baud; choose a usual rate, "
                f"such as 115200."
            ) from error
        except self._errors as error:
            raise InputError(open_error(self.path, error)) from error

    def read(self, timeout: float) -> tuple[bytes, float]:
        """What has arrived after at most `timeout` s, and when it was read.

        The time is in seconds of the host's monotonic clock. Raises UnpluggedError if the device is
        gone.
        """
        left = self._pacer.wait(timeout)
        port = self._open_port()
        try:
            data = _read_all(port, left)
        except self._errors as error:
            raise self._unplugged() from error
        return data, self._pacer.arrived()

    def write(self, data: bytes) -> None:
        """Send bytes; UnpluggedError if the device is gone or takes nothing."""
        port = self._open_port()
        try:
            port.write(data)
        except self._errors as error:
            raise self._unplugged() from error

    def close(self) -> None:
        """Closing twice is fine."""
        port, self._port = self._port, None
        if port is not None:
            with suppress(*self._errors):  # the device may be gone already
                port.close()

    def _open_port(self) -> serial.Serial:
        if self._port is None:
            raise UnpluggedError(f"The port {self.path} is not open.")
        return self._port

    def _unplugged(self) -> UnpluggedError:
        # The system's own text (an input/output error, mostly) does not say what to do.
        return UnpluggedError(f"The device at {self.path} is gone; plug it in again.")


def _read_all(port: serial.Serial, timeout: float) -> bytes:
    """Everything that has arrived, after waiting for the first byte."""
    pieces: list[bytes] = []
    if not port.in_waiting:
        if port.timeout != timeout:
            port.timeout = timeout
        pieces.append(port.read(1))
        if not pieces[0]:
            return b""
    received = 0
    # The system may hand over only a part of what there is at a time.
    while (waiting := port.in_waiting) and received < AT_ONCE:
        pieces.append(port.read(waiting))
        received += waiting
    return b"".join(pieces)


def _terminal_errors() -> tuple[type[Exception], ...]:
    """What terminals raise where there are any; pyserial lets some of it through."""
    if sys.platform == "win32":
        return ()
    import termios

    return (termios.error,)


def open_error(path: str, error: Exception) -> str:
    """Why a port cannot be opened, and the cure."""
    number = error.errno if isinstance(error, OSError) else error.args[0]
    # Under Windows pyserial only quotes the error; a port that is open is refused to all others.
    if number == errno.ENOENT or "FileNotFoundError(" in str(error):
        return f"There is no port {path}; plug the device in, and {LIST_HINT}."
    if number in {errno.EACCES, errno.EPERM}:
        return (
            f"You may not open {path}; become a member of the group that owns it "
            f"(sudo usermod -a -G dialout $USER) and log in again."
        )
    if number in BUSY or "PermissionError(" in str(error):
        return f"The port {path} is in use by another program; close that first."
    return f"The port {path} cannot be opened ({error}); is it a serial port?"


class PortDevice(Device):
    """What devices at serial ports have in common."""

    kind = ""

    def __init__(self, path: str, baud: int) -> None:
        super().__init__()
        #: How often it was connected since it was opened.
        self.connections = 0
        self._path, self._baud, self.name = path, baud, f"{self.kind}:{path}"
        self._port = Port(path, baud)
        self._last_arrival = 0.0

    def open(self) -> None:
        self.connections = 0
        try:
            self._connect(self._path)
        except UnpluggedError as error:
            raise InputError(str(error)) from error

    def reopen(self) -> None:
        """Find the same device again, at whatever port; UnpluggedError while it is not back."""
        self.close()
        for path in self._candidate_ports():
            try:
                self._connect(path)
            except (InputError, UnpluggedError):
                continue
            return
        raise UnpluggedError(f"{self._display_name()} is not plugged in again yet.")

    def close(self) -> None:
        self._port.close()

    def _connect(self, path: str) -> None:
        """Open a port and configure the device, if it is the right one."""
        port = Port(path, self._baud)
        port.open()
        self._port.close()
        self._port = port
        try:
            self._configure()
        except BaseException:
            port.close()
            raise
        self._path, self.name = path, f"{self.kind}:{path}"
        self._last_arrival = time.monotonic()
        self.connections += 1

    def _remark_silence(self, seconds: float, sentence: str) -> None:
        """Remark it once when nothing has come for longer than so many seconds."""
        if time.monotonic() - self._last_arrival > seconds:
            self._messages.put_once("silence", sentence)

    def _display_name(self) -> str:
        """What messages call it."""
        return self.name

    @abstractmethod
    def _candidate_ports(self) -> Sequence[str]:
        """The ports at which it may be after it was plugged in again, the likeliest first."""

    @abstractmethod
    def _configure(self) -> None:
        """Configure the device at the open port and learn what it sends."""


Ports = Callable[[], Iterable[FoundPort]]


class LineDevice(PortDevice):
    """A device that sends lines; its port is found again by its USB serial number."""

    def __init__(self, path: str, baud: int, ports: Ports) -> None:
        super().__init__(path, baud)
        self._ports = ports
        self._known: FoundPort | None = None  # of a USB device

    def open(self) -> None:
        real = os.path.realpath(self._path)
        same = (port for port in self._ports() if os.path.realpath(port.path) == real)
        self._known = next((port for port in same if port.usb), None)
        super().open()

    def _candidate_ports(self) -> Sequence[str]:
        """Wherever its USB serial number is now; else where it was."""
        path = relocate_port(self._known, self._ports()) if self._known else self._path
        return () if path is None else (path,)
