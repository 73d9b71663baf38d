"""Emulated devices on pseudo-terminals: DAQs and microcontrollers.

The packets are those of :mod:`forcelab.formats.optoforce_packets`.
"""

from __future__ import annotations

import contextlib
import math
import os
import select
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.device import Closable
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
    out = np.empty((n, kind.frame.size), dtype=np.uint8)
    out[:, :4] = np.frombuffer(kind.frame.header, dtype=np.uint8)
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
    #: Seconds of the device's clock that pass in one of the host's.
    pace: float

    def due(self, now: float) -> int:
        """How many samples it has taken up to a moment of the host's clock."""
        if self.rate == 0 or now < self.start:
            return 0
        return int((now - self.start) * self.pace * self.rate) + 1

    def device_times(self, samples: NDArray[np.int64]) -> NDArray[np.float64]:
        """When samples were taken, in seconds of the device's clock."""
        return self.device + (samples - self.first) / (self.rate or 1.0)

    def host_times(self, samples: NDArray[np.int64]) -> NDArray[np.float64]:
        """When samples were taken, in seconds of the host's monotonic clock."""
        return self.start + (self.device_times(samples) - self.device) / self.pace


@dataclass(frozen=True)
class GroundTruth:
    """What a virtual device measured and when, whatever of it arrived."""

    #: When each sample was taken, in seconds of the host's monotonic clock, and of the device's,
    #: both of shape (n,).
    times: NDArray[np.float64]
    device_times: NDArray[np.float64]
    #: Its readings before any fault, shape (n, c): counts of an OptoForce, numbers of text lines.
    values: NDArray[np.float64]
    #: Whether it was sent as it was, and read, shape (n,).
    intact: NDArray[np.bool_]


def ground_truth(
    runs: list[SamplingRun],
    sent: int,
    spoiled: list[NDArray[np.int64]],
    values: Callable[[NDArray[np.float64]], NDArray[Any]],
) -> GroundTruth:
    """The truth about samples ``0 .. sent - 1``, some of them `spoiled` on their way out."""
    times, device_times = np.empty(sent), np.empty(sent)
    ends = [*(run.first for run in runs[1:]), sent]
    for run, end in zip(runs, ends, strict=False):  # without a run there is nothing yet
        samples = np.arange(run.first, end)
        times[run.first : end] = run.host_times(samples)
        device_times[run.first : end] = run.device_times(samples)
    intact = np.ones(sent, dtype=bool)
    for numbers in spoiled:
        intact[numbers] = False
    return GroundTruth(times, device_times, values(device_times).astype(np.float64), intact)


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

    def __init__(
        self, path: Path | None = None, *, burst: float = BURST, waits: bool = False
    ) -> None:
        """Without a path it is ``ttyACM0`` in a new temporary folder.

        `burst` seconds lie between two deliveries; where it `waits`, the device's time begins only
        when its port is opened.
        """
        if not SUPPORTED:
            # Windows has no pseudo-terminals, and those of macOS cannot be waited for by poll().
            raise InputError(
                "A virtual device needs the pseudo-terminals of Linux; play the demonstration in "
                "Capture as replay:PROJECT?demonstration=NAME, which needs none."
            )
        #: The port's name; while none was given, only from opening on.
        self.path = path or Path("ttyACM0")
        self._folder: Path | None = None
        self._homeless = path is None
        self.burst = burst
        #: Bytes that were lost because they were not read.
        self.overrun = 0
        #: Set once there is nothing more to send.
        self.ended = threading.Event()
        self._waits = waits
        self._started = False
        self._held_until = 0.0
        self._backlog = b""
        self._master: int | None = None
        self._poll: Any = None
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
        """Put the cable back, perhaps at another path."""

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

    def _answer(self, data: bytes) -> bytes:
        """Its answer to bytes that were sent to it."""
        raise NotImplementedError

    def _mark_lost(self) -> None:
        """What it sent last was lost, because it was not read."""

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
        begun, since = time.monotonic(), math.inf
        while not self._closing.is_set():
            now = time.monotonic()
            self._serve_requests()
            events = self._poll_events(0.0)
            has_listener = self._master is not None and not events & POLLHUP
            since = min(since, now) if has_listener else math.inf
            if not self._started and (not self._waits or now - since >= OPENING):
                self._started = True
                self._begin(now)
            if self._started and self._master is not None and now >= self._held_until:
                self._deliver(self._due(now), has_listener)
            until = begun + self.burst * (int((now - begun) / self.burst) + 1)
            if has_listener:
                self._listen(until)
            else:
                self._closing.wait(max(until - time.monotonic(), 0.0))

    def _serve_requests(self) -> None:
        """Do what other threads asked for."""
        while True:
            try:
                request, done = self._requests.get_nowait()
            except Empty:
                return
            request()
            done.set()

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
            if data:
                self._mark_lost()
            return
        if len(self._backlog) + len(data) > BACKLOG:
            self.overrun += len(data)
            self._mark_lost()
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
    """A device that takes samples at a rate, and their truth."""

    def __init__(
        self,
        source: Readings,
        rate: float,
        clock_ppm: float,
        path: Path | None,
        burst: float,
        waits: bool,
        absent: Absent | None = None,
    ) -> None:
        """Of the readings of `source`, `rate` samples a second of a clock `clock_ppm` fast.

        Samples that are `absent` never leave it; a counter counts them.
        """
        super().__init__(path, burst=burst, waits=waits)
        #: Seconds of the device's clock after which it has nothing more to send.
        self.duration = np.inf
        self._source, self._rate, self._pace = source, rate, 1.0 + 1e-6 * clock_ppm
        self._absent = absent
        self._runs: list[SamplingRun] = []
        self._sent = 0
        self._last = (0, 0)
        self._spoiled: list[NDArray[np.int64]] = []

    @property
    def begun(self) -> float | None:
        """When its own clock began, in seconds of the host's monotonic one; None before that."""
        return self._runs[0].start if self._runs else None

    def truth(self) -> GroundTruth:
        """What was measured and when, up to now; settled once the device is closed."""
        return ground_truth(list(self._runs), self._sent, list(self._spoiled), self._source)

    def _begin(self, now: float) -> None:
        self._run_from(now, self._rate)

    def _run_from(self, now: float, rate: float) -> None:
        """Take samples from now on at a rate."""
        origin = self._runs[0].start if self._runs else now
        self._runs.append(
            SamplingRun(self._sent, now, (now - origin) * self._pace, rate, self._pace)
        )

    def _take_samples(self, now: float) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Numbers and device times (s) of the samples taken since the last call."""
        run = self._runs[-1]
        samples = np.arange(self._sent, run.first + run.due(now))
        times = run.device_times(samples)
        samples, times = samples[times < self.duration], times[times < self.duration]
        if run.device + (now - run.start) * run.pace >= self.duration:
            self.ended.set()
        self._last = (self._sent, self._sent + len(samples))
        self._sent += len(samples)
        return samples, times

    def _present(
        self, samples: NDArray[np.int64], times: NDArray[np.float64]
    ) -> NDArray[np.bool_] | slice:
        """Which of some samples leave it."""
        if self._absent is None or not len(times):
            return slice(None)
        absent = self._absent(times)
        self._spoiled.append(samples[absent])
        return np.logical_not(absent)

    def _next(self, now: float) -> tuple[NDArray[np.float64], NDArray[Any]]:
        """Device times (s) and readings of the samples that leave it since the last call."""
        samples, times = self._take_samples(now)
        times = times[self._present(samples, times)]
        return times, self._source(times)

    def _mark_lost(self) -> None:
        if self._last[1] > self._last[0]:
            self._spoiled.append(np.arange(*self._last))


class VirtualTextDevice(VirtualSampler):
    """A microcontroller that prints a line for each sample."""

    def __init__(
        self,
        source: Readings,
        rate: float = 80.0,
        *,
        names: Sequence[str] = (),
        header: bool = False,
        labelled: bool = False,
        clock: str = "",
        separator: str = ",",
        decimals: int = 3,
        junk: float = 0.0,
        path: Path | None = None,
        burst: float = BURST,
        waits: bool = False,
        absent: Absent | None = None,
    ) -> None:
        """See the parser, :class:`~forcelab.capture.text_device.TextParser`, for its lines.

        With a `header` the names come first each time it is switched on; `labelled`, each value
        stands behind its name and a colon. `clock` names a first column with the device's time, in
        microseconds if it is ``"micros"``, else in milliseconds. A share `junk` of the lines
        follows one that means nothing.
        """
        super().__init__(source, rate, 0.0, path, burst, waits, absent)
        self._names, self._header, self._labelled = tuple(names), header, labelled
        self._clock, self._separator, self._decimals = clock, separator, decimals
        self._junk, self._rng = junk, np.random.default_rng(0)
        self._header_due = False

    def _begin(self, now: float) -> None:
        super()._begin(now)
        self._header_due = self._header

    def _due(self, now: float) -> bytes:
        times, values = self._next(now)
        lines = []
        if self._header_due and len(times):
            lines.append(self._separator.join([*([self._clock] * bool(self._clock)), *self._names]))
            self._header_due = False
        for at, row in zip(times, values, strict=True):
            if self._junk and self._rng.random() < self._junk:
                lines.append("#~ sensor not ready")
            lines.append(self._line(at, row))
        return "".join(f"{line}\r\n" for line in lines).encode("ascii")

    def _line(self, time: float, row: NDArray[np.float64]) -> str:
        """One sample as it is printed."""
        cells = [f"{value:.{self._decimals}f}" for value in row]
        if self._labelled:
            cells = [f"{name}:{cell}" for name, cell in zip(self._names, cells, strict=True)]
        if self._clock:
            stamp = f"{(1e6 if self._clock == 'micros' else 1e3) * time:.0f}"
            cells.insert(0, f"{self._clock}:{stamp}" if self._labelled else stamp)
        return self._separator.join(cells)

    def _answer(self, _: bytes) -> bytes:
        return b""


#: What the host sends: how it begins, and its whole length in bytes.
CONFIGURE, CONFIGURE_BYTES = bytes((170, 0, 50, 3)), 9
IDENTIFY = bytes((171, 0, 18, 8, 0, 197))
#: Value of the byte for zero that makes the present readings zero.
ZERO = 255
#: The filters are numbered 0 to this.
FILTERS = 6
#: Status bit of the first reading's overload; those of the next ones follow below it.
OVERLOAD = 9


class VirtualOptoForce(VirtualSampler):
    """A DAQ with its sensors, of 3, 12 or 6 counts a reading.

    It streams as soon as it is switched on, at `rate` until the host sets a speed, and answers as
    the real one does. Its filters are not simulated.
    """

    def __init__(
        self,
        source: Source,
        rate: float = 1000.0,
        *,
        clock_ppm: float = 0.0,
        serial: str = "ISE123AB",
        step: int = 1,
        first: int = 0,
        limit: int = 32_767,
        absent: Absent | None = None,
        path: Path | None = None,
        waits: bool = False,
    ) -> None:
        """`step` counts lie between two packets, `first` is the counter of the first one.

        A reading saturates at `limit` counts, and its overload is in the status then.
        """
        super().__init__(source, rate, clock_ppm, path, BURST, waits, absent)
        #: Bits that are added to the status of every sample from now on.
        self.status = 0
        #: Whether it answers what it is asked; a real one that is broken may not.
        self.answers = True
        #: Each configuration it was given: speed, filter and zero byte.
        self.configured: list[tuple[int, int, int]] = []
        self._serial = serial
        self._step, self._first, self._limit = step, first, limit
        self._counter = first
        self._zero: NDArray[np.int64] | int = 0
        self._received = b""

    def jump(self, counts: int) -> None:
        """Let the counter jump ahead."""

        def ahead() -> None:
            self._counter += counts

        self._ask(ahead)

    def _begin(self, now: float) -> None:
        """Switched on: what it was told before is forgotten, but the world went on."""
        self._zero, self._received, self._counter = 0, b"", self._first
        super()._begin(now)

    def _due(self, now: float) -> bytes:
        """Packets of the samples taken since the last call."""
        samples, times = self._take_samples(now)
        if not len(samples):
            return b""
        packets, left = self._packets(times), self._present(samples, times)
        data, intact = self._transmit(packets[left])
        if not intact.all():
            self._spoiled.append(samples[left][~intact])
        return data

    def _transmit(self, packets: NDArray[np.uint8]) -> tuple[bytes, NDArray[np.bool_]]:
        """The bytes that packets, one a row, become on their way, and which are intact."""
        return packets.tobytes(), np.ones(len(packets), dtype=np.bool_)

    def _packets(self, times: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Packets of the samples at device times (s)."""
        counts = self._source(times) - self._zero
        over = np.abs(counts) >= self._limit
        bits = np.left_shift(1, OVERLOAD - np.arange(counts.shape[1]) % 6)
        status = np.bitwise_or.reduce(np.where(over, bits, 0), axis=1) | self.status
        # The counter stands at what the next packet has.
        counters = self._counter + self._step * np.arange(len(times))
        self._counter = int(counters[-1]) + self._step
        return build_packets(counters, status, np.clip(counts, -self._limit, self._limit))

    def _answer(self, data: bytes) -> bytes:
        """Answers to whole messages; other bytes are passed over."""
        self._received += data
        answer = b""
        while self._received:
            if self._received.startswith(IDENTIFY):
                self._received = self._received[len(IDENTIFY) :]
                answer += with_checksum(bytes((170, 0, 18, 8)) + self._serial.encode("ascii")[:8])
            elif self._received.startswith(CONFIGURE) and len(self._received) >= CONFIGURE_BYTES:
                message, self._received = (
                    self._received[:CONFIGURE_BYTES],
                    self._received[CONFIGURE_BYTES:],
                )
                answer += self._configure(message)
            elif IDENTIFY.startswith(self._received) or (
                len(self._received) < CONFIGURE_BYTES
                and (CONFIGURE.startswith(self._received) or self._received.startswith(CONFIGURE))
            ):
                break  # its rest is still to come
            else:
                self._received = self._received[1:]
        return answer if self.answers else b""

    def _configure(self, message: bytes) -> bytes:
        """Do as ordered; the reply says whether that could be done."""
        if with_checksum(message[:-2]) != message:
            return b""
        speed, filtered, zero = message[4:7]
        valid = filtered <= FILTERS
        if valid:
            self.configured.append((speed, filtered, zero))
            now = time.monotonic()
            rate = 1000.0 / speed if speed else 0.0
            if self._runs and rate != self._runs[-1].rate:
                self._run_from(now, rate)
            if zero == 0:
                self._zero = 0
            elif zero == ZERO and self._runs:
                passed = (now - self._runs[0].start) * self._pace
                self._zero = self._source(np.array([passed]))[0]
        return with_checksum(bytes((170, 0, 80, 1, 0 if valid else 1)))
