"""Emulated devices on pseudo-terminals: DAQs and microcontrollers.

The packets are those of :mod:`forcelab.formats.optoforce_packets`.
"""

from __future__ import annotations

import math
import os
import re
import select
import sys
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.device import Closable
from forcelab.capture.optoforce import FILTERS, configure_command, serial_command
from forcelab.errors import InputError
from forcelab.formats.optoforce_packets import KINDS, with_checksum

#: Readings at device times (s), shape (m,): whole counts, shape (m, c).
Source = Callable[[NDArray[np.float64]], NDArray[np.int64]]


def build_packets(
    counters: NDArray[np.int64], status: NDArray[np.int64], counts: NDArray[np.int64]
) -> NDArray[np.uint8]:
    """OptoForce packets, one a row, of counters and status words, shape (n,), and readings.

    There are 3 of one sensor, 12 of four, 6 of a 6-axis one; counters wrap and readings are clipped
    here to 16 bits.
    """
    n, c = counts.shape
    kind = next((kind for kind in KINDS if kind.columns == c), None)
    if kind is None:
        raise InputError(f"No OptoForce device sends {c} readings at once; 3, 6 or 12 it must be.")
    out = np.empty((n, kind.size), dtype=np.uint8)
    out[:, :4] = np.frombuffer(kind.header, dtype=np.uint8)
    fields = np.column_stack([counters, status, np.clip(counts, -32_768, 32_767)])
    out[:, 4:-2] = fields.astype(np.uint16).astype(">u2").view(np.uint8).reshape(n, -1)
    sums = out[:, :-2].sum(axis=1, dtype=np.int64)
    out[:, -2:] = sums.astype(">u2").view(np.uint8).reshape(n, 2)
    return out


@dataclass(frozen=True)
class SamplingRun:
    """A stretch in which a device sent at one rate without being switched off."""

    #: Number of its first sample since the device was made.
    first: int
    #: When that was taken, in seconds of the host's monotonic clock, and of the device's clock.
    start: float
    device: float
    #: Samples a second of the device's clock; 0 while it stands still.
    rate: float

    def due(self, now: float) -> int:
        """How many samples it has taken up to a moment of the host's clock."""
        if self.rate == 0 or now < self.start:
            return 0
        return int((now - self.start) * self.rate) + 1

    def device_times(self, samples: NDArray[np.int64]) -> NDArray[np.float64]:
        """When samples were taken, in seconds of the device's clock."""
        return self.device + (samples - self.first) / (self.rate or 1.0)


#: Whether this system has what virtual devices need.
SUPPORTED = sys.platform == "linux"
POLLIN, POLLHUP = (getattr(select, name, 0) for name in ("POLLIN", "POLLHUP"))
#: Seconds between two deliveries: USB hands over what has gathered, not byte after byte.
BURST = 0.004
#: Bytes that wait for a reader that does not read; what comes after them is lost.
BACKLOG = 65_536
#: Seconds after which a thread that does not answer is taken for broken.
PATIENCE = 10.0
#: Seconds that a program takes after opening a port until what comes is kept, as a board takes to
#: start: the first of it would be dropped with what was there before.
OPENING = 0.25


class VirtualPort(Closable):
    """A thread behind a pseudo-terminal, with its name in a folder of its own.

    The name is a symbolic link, so that it stays the same when the device is unplugged and comes
    back. What is sent while the port is not open is lost, as it is with a cable.
    """

    def __init__(self, path: Path) -> None:
        if not SUPPORTED:
            # Windows has no pseudo-terminals, and those of macOS cannot be waited for by poll().
            raise InputError(
                "A virtual device needs the pseudo-terminals of Linux; play the demonstration in "
                "Capture as replay:PROJECT?demonstration=NAME, which needs none."
            )
        self.path = path
        #: Bytes that were lost because they were not read.
        self.overrun = 0
        #: Set once there is nothing more to send.
        self.ended = threading.Event()
        self._waits = True  # until the port is opened; then the device's time begins
        self._started = False
        self._since = math.inf  # when its port was opened
        self._backlog = b""
        self._master: int | None = None
        self._poll: Any = None
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"virtual {self.path.name}")

    @property
    def port(self) -> str:
        """The port's name, as a serial program opens it."""
        return str(self.path)

    def open(self) -> None:
        """Plug the device in and switch it on; it is opened once only."""
        self._plug()
        self._thread.start()

    def close(self) -> None:
        """Switch it off and take the port away; closing twice is fine."""
        self._closing.set()
        if self._thread.is_alive():
            self._thread.join(PATIENCE)
        self._unplug()

    # What a device does; all of it is called by the port's own thread.

    def _begin(self, now: float) -> None:
        """The device is switched on."""

    def _due(self, now: float) -> bytes:
        """What it sends, up to a moment of the host's monotonic clock."""
        raise NotImplementedError

    def _answer(self, data: bytes) -> bytes:
        """Its answer to bytes that were sent to it."""
        raise NotImplementedError

    # The thread.

    def _plug(self) -> None:
        """Make the pseudo-terminal and give it its name."""
        if self._master is not None or sys.platform != "linux":
            return
        import tty

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
            # Without it the master sees whether the port is open.
            os.close(slave)
        self._master, self._poll = master, select.poll()
        self._poll.register(master, select.POLLIN)

    def _unplug(self) -> None:
        """Take the pseudo-terminal and its name away."""
        if self._master is None:
            return
        self.path.unlink(missing_ok=True)
        os.close(self._master)
        self._master, self._backlog = None, b""

    def _run(self) -> None:
        """Deliver at the times of an absolute schedule until closed."""
        begun = time.monotonic()
        while not self._closing.is_set():
            now = time.monotonic()
            has_listener = self._master is not None and not self._poll_events(0.0) & POLLHUP
            self._take_turn(now, has_listener)
            until = begun + BURST * (int((now - begun) / BURST) + 1)
            if has_listener:
                self._listen(until)
            else:
                self._closing.wait(max(until - time.monotonic(), 0.0))

    def _take_turn(self, now: float, has_listener: bool) -> None:
        """Switch the device on when it is time, and deliver what is due."""
        self._since = min(self._since, now) if has_listener else math.inf
        if not self._started and (not self._waits or now - self._since >= OPENING):
            self._started = True
            self._begin(now)
        if self._started and self._master is not None:
            self._deliver(self._due(now), has_listener)

    def _poll_events(self, timeout: float) -> int:
        """Events of the port within so many seconds, as bits of ``poll``."""
        if self._master is None:
            return 0
        events = self._poll.poll(1000.0 * timeout)
        return events[0][1] if events else 0

    def _listen(self, until: float) -> None:
        """Answer what is asked until the next delivery."""
        while (left := until - time.monotonic()) > 0:
            events = self._poll_events(left)
            if self._master is None or not events & POLLIN:
                # Nothing was asked, or the reader left, which is an event again and again.
                self._closing.wait(max(until - time.monotonic(), 0.0))
                return
            try:
                received = os.read(self._master, 4096)
            except OSError:
                return  # the reader left just now
            answer = self._answer(received)
            if answer:
                self._deliver(answer, has_listener=True)

    def _deliver(self, data: bytes, has_listener: bool) -> None:
        """Write as much as the reader has room for; the rest waits, up to a limit."""
        if not has_listener:
            self._backlog = b""
            return
        if len(self._backlog) + len(data) > BACKLOG:
            self.overrun += len(data)
            data = b""
        self._backlog += data
        if self._backlog and self._master is not None:
            try:
                written = os.write(self._master, self._backlog)
            except OSError:
                return  # no room now, or the reader left
            self._backlog = self._backlog[written:]


#: Numbers at device times (s), shape (m,): shape (m, c).
Readings = Callable[[NDArray[np.float64]], NDArray[Any]]
#: Which samples are never sent, by their device times (s), shape (m,).
Absent = Callable[[NDArray[np.float64]], NDArray[np.bool_]]


class VirtualSampler(VirtualPort):
    """A device that takes samples at a rate."""

    def __init__(self, source: Readings, rate: float, path: Path, absent: Absent) -> None:
        """`rate` samples a second of the readings of `source`.

        Samples that are `absent` never leave it; a counter counts them.
        """
        super().__init__(path)
        #: Seconds of the device's clock after which it has nothing more to send.
        self.duration = np.inf
        self._source, self._rate, self._absent = source, rate, absent
        self._runs: list[SamplingRun] = []
        self._sent = 0

    @property
    def begun(self) -> float | None:
        """When its own clock began, in seconds of the host's monotonic one; None before that."""
        return self._runs[0].start if self._runs else None

    def _begin(self, now: float) -> None:
        self._run_from(now, self._rate)

    def _run_from(self, now: float, rate: float) -> None:
        """Take samples from now on at a rate."""
        self._runs.append(SamplingRun(self._sent, now, self._device_time(now), rate))

    def _device_time(self, now: float) -> float:
        """A moment of the host's clock in seconds of the device's."""
        return now - self._runs[0].start if self._runs else 0.0

    def _take_samples(self, now: float) -> NDArray[np.float64]:
        """Device times (s) of the samples taken since the last call."""
        run = self._runs[-1]
        samples = np.arange(self._sent, run.first + run.due(now))
        times = run.device_times(samples)
        times = times[times < self.duration]
        if self._device_time(now) >= self.duration:
            self.ended.set()
        self._sent += len(times)
        return times

    def _present(self, times: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which of the samples at device times (s) leave it."""
        return np.logical_not(self._absent(times))

    def _next(self, now: float) -> tuple[NDArray[np.float64], NDArray[Any]]:
        """Device times (s) and readings of the samples that leave it since the last call."""
        times = self._take_samples(now)
        times = times[self._present(times)]
        return times, self._source(times)


class VirtualTextDevice(VirtualSampler):
    """A microcontroller that prints a line of names, and below it one for each sample.

    The first column is the device's time in microseconds.
    """

    def __init__(
        self, source: Readings, rate: float, path: Path, absent: Absent, names: Sequence[str]
    ) -> None:
        super().__init__(source, rate, path, absent)
        self._names = tuple(names)
        self._header_due = True

    def _begin(self, now: float) -> None:
        super()._begin(now)
        self._header_due = True

    def _due(self, now: float) -> bytes:
        times, values = self._next(now)
        lines = []
        if self._header_due and len(times):
            lines += self._header()
            self._header_due = False
        lines += [self._line(at, row) for at, row in zip(times, values, strict=True)]
        return "".join(f"{line}\r\n" for line in lines).encode("ascii")

    def _header(self) -> list[str]:
        return ["\t".join(["micros", *self._names])]

    def _line(self, time: float, row: NDArray[np.float64]) -> str:
        return "\t".join([f"{1e6 * time:.0f}", *(f"{value:.6f}" for value in row)])

    def _answer(self, _: bytes) -> bytes:
        return b""


#: What the host sends: to ask for the serial number, and to configure, with what it says behind it.
_COMMAND = re.compile(
    re.escape(serial_command()) + b"|" + re.escape(configure_command(0)[:4]) + b".{5}", re.S
)
#: Value of the byte for zero that makes the present readings zero.
ZERO = 255
#: Status bit of the first reading's overload; those of the next ones follow below it. The counts
#: from which on a reading is one.
OVERLOAD, LIMIT = 9, 32_767


class VirtualOptoForce(VirtualSampler):
    """A DAQ with its sensors, of 3, 12 or 6 counts a reading.

    It streams as soon as it is switched on, at `rate` until the host sets a speed, and answers as
    the real one does. Its filters are not simulated.
    """

    def __init__(
        self, source: Source, rate: float, path: Path, absent: Absent, serial: str
    ) -> None:
        super().__init__(source, rate, path, absent)
        self._serial = serial
        self._counter = 0
        self._zero: NDArray[np.int64] | int = 0
        self._received = b""

    def _begin(self, now: float) -> None:
        """Switched on: what it was told before is forgotten, but the world went on."""
        self._zero, self._received, self._counter = 0, b"", 0
        super()._begin(now)

    def _due(self, now: float) -> bytes:
        """Packets of the samples taken since the last call."""
        times = self._take_samples(now)
        return self._packets(times)[self._present(times)].tobytes() if len(times) else b""

    def _packets(self, times: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Packets of the samples at device times (s)."""
        counts = self._source(times) - self._zero
        bits = np.left_shift(1, OVERLOAD - np.arange(counts.shape[1]) % 6)
        status = np.bitwise_or.reduce(np.where(np.abs(counts) >= LIMIT, bits, 0), axis=1)
        # The counter stands at what the next packet has.
        counters = self._counter + np.arange(len(times))
        self._counter += len(times)
        return build_packets(counters, status, np.clip(counts, -LIMIT, LIMIT))

    def _answer(self, data: bytes) -> bytes:
        """Answers to whole messages; other bytes are passed over."""
        self._received += data
        answer, end = b"", 0
        for command in _COMMAND.finditer(self._received):
            end = command.end()
            if command[0] == serial_command():
                answer += with_checksum(bytes((170, 0, 18, 8)) + self._serial.encode("ascii")[:8])
            else:
                answer += self._configure(command[0])
        self._received = self._received[end:][-8:]  # a command has nine bytes at most
        return answer

    def _configure(self, message: bytes) -> bytes:
        """Do as ordered; the reply says whether that could be done."""
        if with_checksum(message[:-2]) != message:
            return b""
        speed, filtered, zero = message[4:7]
        valid = filtered < len(FILTERS)
        if valid:
            now = time.monotonic()
            rate = 1000.0 / speed if speed else 0.0
            if self._runs and rate != self._runs[-1].rate:
                self._run_from(now, rate)
            if zero == 0:
                self._zero = 0
            elif zero == ZERO and self._runs:
                self._zero = self._source(np.array([self._device_time(now)]))[0]
        return with_checksum(bytes((170, 0, 80, 1, 0 if valid else 1)))
