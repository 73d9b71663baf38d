"""Emulated devices on pseudo-terminals: DAQs, microcontrollers, cameras, with faults on demand.

What virtual devices send: their readings by time, real packets of them, and when each was sent. The
layout of the packets is that of :mod:`forcelab.formats.optoforce_packets`.
"""

from __future__ import annotations

import contextlib
import math
import os
import select
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forcelab.capture.device import Opened
from forcelab.errors import InputError
from forcelab.formats.optoforce_packets import KINDS, with_checksum


@dataclass(frozen=True, slots=True)
class Faults:
    """How often what happens; nothing by default.

    Parameters
    ----------
    lost : float
        Share of the packets that never arrive, though the counter counts them.
    lost_bytes, corrupted, doubled : float
        Share of the bytes that are left out, changed in one bit, or sent twice.

    Raises
    ------
    InputError
        If a share is not one.
    """

    lost: float = 0.0
    lost_bytes: float = 0.0
    corrupted: float = 0.0
    doubled: float = 0.0

    def __post_init__(self) -> None:
        for name in ("lost", "lost_bytes", "corrupted", "doubled"):
            share = getattr(self, name)
            if not 0 <= share <= 1:
                raise InputError(f"The share '{name}' of faults must lie in 0..1, not {share:g}.")


def spoil(
    packets: NDArray[np.uint8], faults: Faults, rng: np.random.Generator
) -> tuple[bytes, NDArray[np.bool_]]:
    """Do to packets what a bad cable does.

    Parameters
    ----------
    packets : ndarray of uint8, shape (n, size)
        One packet a row.
    faults : Faults
        How often what happens to them.
    rng : Generator
        Says to which.

    Returns
    -------
    sent : bytes
        What is left of them.
    intact : ndarray of bool, shape (n,)
        Which are all there.
    """
    intact = np.ones(len(packets), dtype=bool)
    if not (faults.lost or faults.lost_bytes or faults.corrupted or faults.doubled):
        return packets.tobytes(), intact
    repeats = np.ones(packets.shape, dtype=np.int64)
    repeats[rng.random(packets.shape) < faults.doubled] = 2
    repeats[rng.random(packets.shape) < faults.lost_bytes] = 0
    repeats[rng.random(len(packets)) < faults.lost] = 0
    flips = np.where(
        rng.random(packets.shape) < faults.corrupted,
        np.left_shift(1, rng.integers(0, 8, packets.shape)),
        0,
    ).astype(np.uint8)
    intact &= (repeats == 1).all(axis=1) & (flips == 0).all(axis=1)
    return np.repeat((packets ^ flips).ravel(), repeats.ravel()).tobytes(), intact


#: Readings at device times (s), shape (m,): whole counts, shape (m, c).
Source = Callable[[NDArray[np.float64]], NDArray[np.int64]]


def rows(counts: ArrayLike, rate: float) -> Source:
    """A recording as a source: at each time the sample that was the nearest; zero past its end.

    Parameters
    ----------
    counts : array_like of int, shape (n, c)
        Readings.
    rate : float
        Rows a second of the device's clock.
    """
    table = np.atleast_2d(np.asarray(counts, dtype=np.int64))

    def read(times: NDArray[np.float64]) -> NDArray[np.int64]:
        places = np.floor(times * rate + 0.5).astype(np.int64)
        out = table[np.clip(places, 0, len(table) - 1)]
        out[places >= len(table)] = 0
        return out

    return read


def build_packets(
    counters: NDArray[np.int64], status: NDArray[np.int64], counts: NDArray[np.int64]
) -> NDArray[np.uint8]:
    """OptoForce packets, one a row.

    Parameters
    ----------
    counters, status : ndarray of int64, shape (n,)
        Sample counter, which wraps here, and status word.
    counts : ndarray of int64, shape (n, c)
        Readings: 3 of one sensor, 12 of four, 6 of a 6-axis one; clipped to 16 bits.

    Returns
    -------
    ndarray of uint8, shape (n, size)

    Raises
    ------
    InputError
        If no device sends as many readings.
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
class Run:
    """A stretch in which a device sent at one rate without being switched off.

    Parameters
    ----------
    first : int
        Number of its first sample since the device was made.
    start : float
        When that was taken, in seconds of the host's monotonic clock.
    device : float
        The same in seconds of the device's clock.
    rate : float
        Samples a second of the device's clock; 0 while it stands still.
    pace : float
        Seconds of the device's clock that pass in one of the host's.
    """

    first: int
    start: float
    device: float
    rate: float
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
    """What a virtual device measured and when, whatever of it arrived.

    Parameters
    ----------
    times : ndarray of float64, shape (n,)
        When each sample was taken, in seconds of the host's monotonic clock.
    device_times : ndarray of float64, shape (n,)
        The same in seconds of the device's own clock.
    values : ndarray, shape (n, c)
        Its readings before any fault: counts for an OptoForce, numbers for text lines.
    intact : ndarray of bool, shape (n,)
        Whether it was sent, as it was, to somebody who listened.
    """

    times: NDArray[np.float64]
    device_times: NDArray[np.float64]
    values: NDArray[np.float64]
    intact: NDArray[np.bool_]


def truth_of(
    runs: list[Run],
    sent: int,
    spoiled: list[NDArray[np.int64]],
    values: Callable[[NDArray[np.float64]], NDArray[Any]],
) -> GroundTruth:
    """The truth about samples ``0 .. sent - 1``.

    Parameters
    ----------
    runs : list of Run
        In their order.
    sent : int
        Samples so far.
    spoiled : list of ndarray of int64
        Numbers of those that did not go out as they were.
    values : callable
        Readings at device times (s).
    """
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


#: Numbers at device times (s), shape (m,): shape (m, c).
Readings = Callable[[NDArray[np.float64]], NDArray[Any]]
#: Which samples are never sent, by their device times (s), shape (m,).
Absent = Callable[[NDArray[np.float64]], NDArray[np.bool_]]


class VirtualSampler(VirtualPort):
    """A device that takes samples at a rate, and its truth.

    Parameters
    ----------
    source : callable
        Readings, shape (m, c), at device times (s), shape (m,).
    rate : float
        Samples a second of its own clock when it is switched on.
    clock_ppm : float
        How fast its clock is, in parts per million; negative for a slow one.
    path, burst, waits
        As of :class:`~forcelab.capture.emulator.VirtualPort`.
    absent : callable, optional
        Which samples never leave it, by their device times (s); a counter counts them.

    Attributes
    ----------
    duration : float
        Seconds of the device's clock after which it has nothing more to send; can be set later.
    """

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
        super().__init__(path, burst=burst, waits=waits)
        self.duration = np.inf
        self._source, self._rate, self._pace = source, rate, 1.0 + 1e-6 * clock_ppm
        self._absent = absent
        self._runs: list[Run] = []
        self._sent = 0
        self._last = (0, 0)
        self._spoiled: list[NDArray[np.int64]] = []

    @property
    def begun(self) -> float | None:
        """When its own clock began, in seconds of the host's monotonic one; None before that."""
        return self._runs[0].start if self._runs else None

    def truth(self) -> GroundTruth:
        """What was measured and when, up to now; settled once the device is closed."""
        return truth_of(list(self._runs), self._sent, list(self._spoiled), self._source)

    def _begin(self, now: float) -> None:
        self._run_from(now, self._rate)

    def _run_from(self, now: float, rate: float) -> None:
        """Take samples from now on at a rate."""
        origin = self._runs[0].start if self._runs else now
        self._runs.append(Run(self._sent, now, (now - origin) * self._pace, rate, self._pace))

    def _taken(self, now: float) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Numbers and device times (s) of the samples taken since the last time."""
        run = self._runs[-1]
        samples = np.arange(self._sent, run.first + run.due(now))
        times = run.device_times(samples)
        samples, times = samples[times < self.duration], times[times < self.duration]
        if run.device + (now - run.start) * run.pace >= self.duration:
            self.ended.set()
        self._last = (self._sent, self._sent + len(samples))
        self._sent += len(samples)
        return samples, times

    def _leaving(
        self, samples: NDArray[np.int64], times: NDArray[np.float64]
    ) -> NDArray[np.bool_] | slice:
        """Which of some samples leave it."""
        if self._absent is None or not len(times):
            return slice(None)
        gone = self._absent(times)
        self._spoiled.append(samples[gone])
        return np.logical_not(gone)

    def _next(self, now: float) -> tuple[NDArray[np.float64], NDArray[Any]]:
        """Device times (s) and readings of the samples that leave it since the last time."""
        samples, times = self._taken(now)
        times = times[self._leaving(samples, times)]
        return times, self._source(times)

    def _unheard(self) -> None:
        if self._last[1] > self._last[0]:
            self._spoiled.append(np.arange(*self._last))


class VirtualTextLine(VirtualSampler):
    """A microcontroller that prints a line for each sample.

    Parameters
    ----------
    source : callable
        Readings, shape (m, c), at device times (s), shape (m,).
    rate : float
        Lines a second of its own clock.
    names : sequence of str, length c
        Names of the readings; empty for none.
    header : bool
        Whether a line with the names comes first, each time it is switched on.
    labelled : bool
        Whether each value stands behind its name and a colon.
    clock : str
        Name of a first column with the device's time, in microseconds if it is ``"micros"``, else
        in milliseconds; empty for none.
    separator : str
        What stands between values.
    decimals : int
        Of the values.
    junk : float
        Share of the lines before which there is one that means nothing.
    path, burst, waits, absent
        As of :class:`~forcelab.capture.emulator.VirtualSampler`.
    """

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
        super().__init__(source, rate, 0.0, path, burst, waits, absent)
        self._names, self._header, self._labelled = tuple(names), header, labelled
        self._clock, self._separator, self._decimals = clock, separator, decimals
        self._junk, self._rng = junk, np.random.default_rng(0)
        self._begins = False

    def _begin(self, now: float) -> None:
        super()._begin(now)
        self._begins = self._header

    def _due(self, now: float) -> bytes:
        times, values = self._next(now)
        lines = []
        if self._begins and len(times):
            lines.append(self._separator.join([*([self._clock] * bool(self._clock)), *self._names]))
            self._begins = False
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

    def _heard(self, _: bytes) -> bytes:
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
    """A DAQ with its sensors that is not there.

    It streams as soon as it is switched on, at `rate` until the host sets a speed, and answers
    as the real one does. Its filters are not simulated.

    Parameters
    ----------
    source : callable
        Readings in counts, shape (m, c), at device times (s), shape (m,); see
        :func:`~forcelab.capture.emulator.rows` for a recording. c = 3, 12 or 6 makes it a
        DAQ of one 3-axis sensor, of four, or of a 6-axis one.
    rate : float
        Samples a second of its own clock when it is switched on.
    faults : Faults
        What goes wrong; can be set to others at any time.
    serial : str
        Eight characters.
    step : int
        Counts from one packet to the next.
    first : int
        The counter of the first packet after each switching on.
    limit : int
        Counts at which a reading saturates; its overload is in the status then.
    clock_ppm, absent, path, waits
        As of :class:`~forcelab.capture.emulator.VirtualSampler`.
    """

    def __init__(
        self,
        source: Source,
        rate: float = 1000.0,
        *,
        clock_ppm: float = 0.0,
        faults: Faults | None = None,
        serial: str = "ISE123AB",
        step: int = 1,
        first: int = 0,
        limit: int = 32_767,
        absent: Absent | None = None,
        path: Path | None = None,
        waits: bool = False,
    ) -> None:
        super().__init__(source, rate, clock_ppm, path, BURST, waits, absent)
        self.faults = faults or Faults()
        #: Bits that are added to the status of every sample from now on.
        self.status = 0
        #: Whether it answers what it is asked; a real one that is broken may not.
        self.answers = True
        #: Each configuration it was given: speed, filter and zero byte.
        self.configured: list[tuple[int, int, int]] = []
        self._serial = serial
        self._step, self._first, self._limit = step, first, limit
        self._rng = np.random.default_rng(0)
        self._counter = first
        self._zero: NDArray[np.int64] | int = 0
        self._asked = b""

    def jump(self, counts: int) -> None:
        """Let the counter jump ahead."""

        def ahead() -> None:
            self._counter += counts

        self._ask(ahead)

    def _begin(self, now: float) -> None:
        """Switched on: what it was told before is forgotten, but the world went on."""
        self._zero, self._asked, self._counter = 0, b"", self._first
        super()._begin(now)

    def _due(self, now: float) -> bytes:
        """Packets of the samples taken since the last time."""
        samples, times = self._taken(now)
        if not len(samples):
            return b""
        packets, left = self._packets(times), self._leaving(samples, times)
        sent, intact = spoil(packets[left], self.faults, self._rng)
        if not intact.all():
            self._spoiled.append(samples[left][~intact])
        return sent

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

    def _heard(self, data: bytes) -> bytes:
        """Answers to whole messages; what is none is passed over."""
        self._asked += data
        answer = b""
        while self._asked:
            if self._asked.startswith(IDENTIFY):
                self._asked = self._asked[len(IDENTIFY) :]
                answer += with_checksum(bytes((170, 0, 18, 8)) + self._serial.encode("ascii")[:8])
            elif self._asked.startswith(CONFIGURE) and len(self._asked) >= CONFIGURE_BYTES:
                message, self._asked = (
                    self._asked[:CONFIGURE_BYTES],
                    self._asked[CONFIGURE_BYTES:],
                )
                answer += self._configure(message)
            elif IDENTIFY.startswith(self._asked) or (
                len(self._asked) < CONFIGURE_BYTES
                and (CONFIGURE.startswith(self._asked) or self._asked.startswith(CONFIGURE))
            ):
                break  # its rest is still to come
            else:
                self._asked = self._asked[1:]
        return answer if self.answers else b""

    def _configure(self, message: bytes) -> bytes:
        """Do as told; the reply says whether that could be done."""
        if with_checksum(message[:-2]) != message:
            return b""
        speed, filtered, zero = message[4:7]
        good = filtered <= FILTERS
        if good:
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
        return with_checksum(bytes((170, 0, 80, 1, 0 if good else 1)))


#: OpenCV's number of the time of the frame that was read last.
POSITION_MS = 0
#: A frame's number stands in its top rows as so many black and white squares.
BITS = 16
#: Longest time (s) that is slept at once, so that a release is noticed.
NAP = 0.05
#: Frames that are kept for who reads late; the oldest ones are lost, as drivers lose them.
BUFFERED = 4


class VirtualCamera:
    """Something with ``read``, ``get`` and ``release``.

    Parameters
    ----------
    rate : float
        Frames a second.
    width, height : int
        Size in pixels.
    """

    def __init__(self, rate: float = 30.0, width: int = 320, height: int = 240) -> None:
        self.start = time.monotonic()
        self.rate = rate
        self._size = (width, height)
        self._next = 0
        self._taken = 0.0
        self._released = False

    def release(self) -> None:
        """Let go of it."""
        self._released = True

    def read(self) -> tuple[bool, NDArray[np.uint8] | None]:
        """Wait for the next frame and give its picture; nothing once it is released."""
        passed = int((time.monotonic() - self.start) * self.rate)
        number = max(self._next, passed + 1 - BUFFERED)
        taken = self.start + number / self.rate
        while not self._released:
            wait = taken - time.monotonic()
            if wait <= 0:
                self._next, self._taken = number + 1, taken
                return True, _picture(number, *self._size)
            time.sleep(min(wait, NAP))
        return False, None

    def get(self, what: int) -> float:
        """A property by OpenCV's number; 0 for what it does not know."""
        return 1000.0 * self._taken if what == POSITION_MS else 0.0


def _picture(number: int, width: int, height: int) -> NDArray[np.uint8]:
    """A grey picture with a number in its top rows, and a bar that moves."""
    out = np.full((height, width, 3), 96, dtype=np.uint8)
    side = width // BITS
    bits = (number >> np.arange(BITS)) & 1
    out[:side, : side * BITS] = (255 * np.repeat(bits, side))[None, :, None]
    left = 4 * number % width
    out[2 * side :, left : left + side] = (40, 200, 240)
    return out
