"""A serial port: opened for one reader alone, read as bytes arrive, gone when the cable is."""

from __future__ import annotations

import errno
import time
from contextlib import suppress
from typing import TYPE_CHECKING

from forcelab.capture.blocks import UnpluggedError
from forcelab.capture.ports import LOOK
from forcelab.errors import InputError

if TYPE_CHECKING:
    import serial

__all__ = ["Port"]

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
            raise self._gone() from error
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
            raise self._gone() from error

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

    def _gone(self) -> UnpluggedError:
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
