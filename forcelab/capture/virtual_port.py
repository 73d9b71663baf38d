"""A pretended serial port: a pseudo-terminal that something virtual is plugged into."""

from __future__ import annotations

import contextlib
import math
import os
import select
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from queue import Empty, SimpleQueue

from forcelab.capture.opened import Opened
from forcelab.errors import InputError

__all__ = ["BURST", "VirtualPort"]

#: Seconds between two deliveries: USB hands over what has gathered, not byte after byte.
BURST = 0.004
#: Bytes that wait for a reader who does not read; what comes after them is lost.
BACKLOG = 65_536
#: Seconds after which a thread that does not answer is taken for broken.
PATIENCE = 10.0
#: Seconds that whoever opens a port takes until what comes is kept, as a board takes to start: the
#: first of it would be dropped with what was there before.
OPENING = 0.25


class VirtualPort(Opened):
    """A thread behind a pseudo-terminal, with its name in a folder of its own.

    The name is a symbolic link, so that it stays the same when the device is unplugged and comes
    back. What is sent while nobody has the port open is lost, as it is with a cable.

    Parameters
    ----------
    path : Path, optional
        The port's name; by default ``ttyACM0`` in a new temporary folder.
    burst : float
        Seconds between two deliveries.
    waits : bool
        Whether the device's time begins only when somebody opens the port.

    Raises
    ------
    InputError
        If this system has no pseudo-terminals, or the name is taken.
    """

    def __init__(
        self, path: Path | None = None, *, burst: float = BURST, waits: bool = False
    ) -> None:
        if not hasattr(os, "openpty"):
            raise InputError(
                "A virtual device needs a pseudo-terminal, which this system does not have; "
                "use Linux or macOS."
            )
        #: The port's name; while none was given, only from opening on.
        self.path = path or Path("ttyACM0")
        self._folder: Path | None = None
        self._homeless = path is None
        self.burst = burst
        #: Bytes that were lost because nobody took them.
        self.overrun = 0
        #: Set once there is nothing more to send.
        self.ended = threading.Event()
        self._waits = waits
        self._started = False
        self._held_until = 0.0
        self._backlog = b""
        self._master: int | None = None
        self._poll = select.poll()
        self._requests: SimpleQueue[tuple[Callable[[], None], threading.Event]] = SimpleQueue()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"virtual {self.path.name}")

    @property
    def port(self) -> str:
        """The port's name, as a serial program opens it."""
        return str(self.path)

    def open(self) -> None:
        """Plug the device in and switch it on; it is opened once only."""
        if self._homeless:
            self._folder = Path(tempfile.mkdtemp(prefix="forcelab-port-"))
            self.path = self._folder / self.path
        self._plug()
        self._thread.start()

    def close(self) -> None:
        """Switch it off and take the port away; closing twice is fine."""
        self._closing.set()
        if self._thread.is_alive():
            self._thread.join(PATIENCE)
        self._unplug()
        if self._folder is not None:
            with contextlib.suppress(OSError):
                self._folder.rmdir()

    def unplug(self) -> None:
        """Pull the cable: readers see an error, the port's name is gone."""
        self._ask(self._unplug)

    def replug(self, path: Path | None = None) -> None:
        """Put the cable back.

        Parameters
        ----------
        path : Path, optional
            Another name that the port has now; by default the same.
        """

        def plug() -> None:
            self.path = path or self.path
            self._plug()
            self._begin(time.monotonic())

        self._ask(plug)

    def stall(self, seconds: float) -> None:
        """Hold everything back for a while; then it arrives all at once."""
        self._ask(lambda: setattr(self, "_held_until", time.monotonic() + seconds))

    def _ask(self, request: Callable[[], None]) -> None:
        """Have something done by the thread that owns the port, and wait until it is done."""
        if not self._thread.is_alive():
            request()
            return
        done = threading.Event()
        self._requests.put((request, done))
        done.wait(PATIENCE)

    # What a device does; all of it is called by the port's own thread.

    def _begin(self, now: float) -> None:
        """The device is switched on."""

    def _due(self, now: float) -> bytes:
        """What it sends, up to a moment of the host's monotonic clock."""
        raise NotImplementedError

    def _heard(self, data: bytes) -> bytes:
        """What it answers."""
        raise NotImplementedError

    def _unheard(self) -> None:
        """What it sent last was lost, because nobody took it."""

    # The thread.

    def _plug(self) -> None:
        """Make the pseudo-terminal and give it its name."""
        import tty

        if self._master is not None:
            return
        master, slave = os.openpty()
        try:
            tty.setraw(slave)
            os.set_blocking(master, False)
            self.path.symlink_to(os.ttyname(slave))
        except OSError as error:
            os.close(master)
            raise InputError(
                f"A virtual port cannot be made at {self.path}: {error.strerror}; "
                f"choose another name."
            ) from error
        finally:
            # Without it the master sees whether anybody has the port open.
            os.close(slave)
        self._master = master
        self._poll.register(master, select.POLLIN)

    def _unplug(self) -> None:
        """Take the pseudo-terminal and its name away."""
        if self._master is None:
            return
        self.path.unlink(missing_ok=True)
        self._poll.unregister(self._master)
        os.close(self._master)
        self._master, self._backlog = None, b""

    def _run(self) -> None:
        """Deliver at the times of an absolute schedule until closed."""
        begun, since = time.monotonic(), math.inf
        while not self._closing.is_set():
            now = time.monotonic()
            self._tend()
            events = self._look(0.0)
            listened = self._master is not None and not events & select.POLLHUP
            since = min(since, now) if listened else math.inf
            if not self._started and (not self._waits or now - since >= OPENING):
                self._started = True
                self._begin(now)
            if self._started and self._master is not None and now >= self._held_until:
                self._deliver(self._due(now), listened)
            until = begun + self.burst * (int((now - begun) / self.burst) + 1)
            if listened:
                self._listen(until)
            else:
                self._closing.wait(max(until - time.monotonic(), 0.0))

    def _tend(self) -> None:
        """Do what other threads asked for."""
        while True:
            try:
                request, done = self._requests.get_nowait()
            except Empty:
                return
            request()
            done.set()

    def _look(self, timeout: float) -> int:
        """What the port has to tell within so many seconds, as bits of ``poll``."""
        if self._master is None:
            return 0
        told = self._poll.poll(1000.0 * timeout)
        return told[0][1] if told else 0

    def _listen(self, until: float) -> None:
        """Answer what is asked until the next delivery."""
        while (left := until - time.monotonic()) > 0:
            events = self._look(left)
            if self._master is None or not events & select.POLLIN:
                # Nothing was asked, or the reader left, which would be told again and again.
                self._closing.wait(max(until - time.monotonic(), 0.0))
                return
            try:
                heard = os.read(self._master, 4096)
            except OSError:
                return  # the reader left just now
            answer = self._heard(heard)
            if answer:
                self._deliver(answer, listened=True)

    def _deliver(self, data: bytes, listened: bool) -> None:
        """Write as much as the reader has room for; the rest waits, up to a limit."""
        if not listened:
            self._backlog = b""
            if data:
                self._unheard()
            return
        if len(self._backlog) + len(data) > BACKLOG:
            self.overrun += len(data)
            self._unheard()
            data = b""
        self._backlog += data
        if self._backlog and self._master is not None:
            try:
                written = os.write(self._master, self._backlog)
            except OSError:
                return  # no room now, or the reader left
            self._backlog = self._backlog[written:]
