"""Virtual devices with faults, encoders and cameras, as tests and benchmarks need them."""

from __future__ import annotations

import contextlib
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, SimpleQueue

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forcelab.capture import emulator
from forcelab.capture.emulator import Readings, SamplingRun, Source, VirtualSampler, build_packets

#: Seconds after which a thread that does not answer is taken for broken.
PATIENCE = 10.0


@dataclass(frozen=True)
class PacedRun(SamplingRun):
    """A stretch by a clock of its own pace."""

    #: Seconds of the device's clock that pass in one of the host's.
    pace: float = 1.0

    def due(self, now: float) -> int:
        return SamplingRun(self.first, self.start, self.device, self.rate * self.pace).due(now)

    def host_times(self, samples: NDArray[np.int64]) -> NDArray[np.float64]:
        """When samples were taken, in seconds of the host's monotonic clock."""
        return self.start + (self.device_times(samples) - self.device) / self.pace


@dataclass(frozen=True)
class GroundTruth:
    """What a virtual device measured and when, whatever of it arrived."""

    #: When each sample was taken, in seconds of the host's monotonic clock, shape (n,).
    times: NDArray[np.float64]
    #: Its readings before any fault, shape (n, c): counts of an OptoForce, numbers of text lines.
    values: NDArray[np.float64]


def _none_absent(times: NDArray[np.float64]) -> NDArray[np.bool_]:
    return np.zeros(len(times), np.bool_)


class TestedSampler(VirtualSampler):
    """A device whose cable can be pulled, which has a clock of its own and knows what it measured.

    Without a path it is at ``ttyACM0`` in a temporary folder.
    """

    __test__ = False
    _runs: list[PacedRun]

    def __init__(
        self,
        source: Readings,
        rate: float,
        *,
        path: Path | None = None,
        clock_ppm: float = 0.0,
        waits: bool = False,
        **options,
    ) -> None:
        super().__init__(source, rate, path or Path("ttyACM0"), _none_absent, **options)
        self._homeless, self._folder, self._waits = path is None, None, waits
        self._pace = 1.0 + 1e-6 * clock_ppm
        self._held_until = 0.0
        self._requests: SimpleQueue[tuple[Callable[[], None], threading.Event]] = SimpleQueue()

    def open(self) -> None:
        if self._homeless:
            self._folder = Path(tempfile.mkdtemp(prefix="forcelab-port-"))
            self.path = self._folder / self.path
        super().open()

    def close(self) -> None:
        super().close()
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

    def truth(self) -> GroundTruth:
        """What was measured and when, up to now; settled once the device is closed."""
        runs, sent = list(self._runs), self._sent
        times, device_times = np.empty(sent), np.empty(sent)
        ends = [*(run.first for run in runs[1:]), sent]
        for run, end in zip(runs, ends, strict=False):  # without a run there is nothing yet
            samples = np.arange(run.first, end)
            times[run.first : end] = run.host_times(samples)
            device_times[run.first : end] = run.device_times(samples)
        return GroundTruth(times, self._source(device_times).astype(np.float64))

    def _ask(self, request: Callable[[], None]) -> None:
        """Have something done by the thread that owns the port, and wait until it is done."""
        if not self._thread.is_alive():
            request()
            return
        done = threading.Event()
        self._requests.put((request, done))
        done.wait(PATIENCE)

    def _take_turn(self, now: float, has_listener: bool) -> None:
        with contextlib.suppress(Empty):
            while True:
                request, done = self._requests.get_nowait()
                request()
                done.set()
        if now >= self._held_until:
            super()._take_turn(now, has_listener)

    def _run_from(self, now: float, rate: float) -> None:
        self._runs.append(PacedRun(self._sent, now, self._device_time(now), rate, self._pace))

    def _device_time(self, now: float) -> float:
        return super()._device_time(now) * self._pace


class VirtualTextDevice(TestedSampler, emulator.VirtualTextDevice):
    """A microcontroller that prints lines of any kind.

    With a `header` the names come first each time it is switched on; `labelled`, each value stands
    behind its name and a colon. `clock` names a first column with the device's time in
    milliseconds. A share `junk` of the lines follows one that means nothing.
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
        decimals: int = 3,
        junk: float = 0.0,
        **options,
    ) -> None:
        super().__init__(source, rate, names=names, **options)
        self._with_header, self._labelled, self._clock = header, labelled, clock
        self._decimals, self._junk, self._rng = decimals, junk, np.random.default_rng(0)

    def _header(self) -> list[str]:
        names = [*([self._clock] * bool(self._clock)), *self._names]
        return [",".join(names)] if self._with_header else []

    def _line(self, time: float, row: NDArray[np.float64]) -> str:
        cells = [f"{value:.{self._decimals}f}" for value in row]
        if self._labelled:
            cells = [f"{name}:{cell}" for name, cell in zip(self._names, cells, strict=True)]
        if self._clock:
            stamp = f"{1e3 * time:.0f}"
            cells.insert(0, f"{self._clock}:{stamp}" if self._labelled else stamp)
        junk = "#~ sensor not ready\r\n" if self._junk and self._rng.random() < self._junk else ""
        return junk + ",".join(cells)


class VirtualOptoForce(TestedSampler, emulator.VirtualOptoForce):
    """A DAQ: `step` counts lie between two packets, `first` is the counter of the first one."""

    def __init__(
        self,
        source: Source,
        rate: float = 1000.0,
        *,
        serial: str = "ISE123AB",
        step: int = 1,
        first: int = 0,
        **options,
    ) -> None:
        super().__init__(source, rate, serial=serial, **options)
        #: Bits that are added to the status of every sample from now on.
        self.status = 0
        #: Whether it answers what it is asked; a real one that is broken may not.
        self.answers = True
        #: Each configuration it was given: speed, filter and zero byte.
        self.configured: list[tuple[int, int, int]] = []
        self._step, self._first, self._counter = step, first, first

    def _begin(self, now: float) -> None:
        super()._begin(now)
        self._counter = self._first

    def _packets(self, times: NDArray[np.float64]) -> NDArray[np.uint8]:
        packets, begin = super()._packets(times), self._counter - len(times)
        self._counter = begin + self._step * len(times)
        fields = np.ascontiguousarray(packets[:, 4:-2]).view(">u2").astype(np.int64)
        counters = begin + self._step * np.arange(len(times))
        counts = fields[:, 2:].astype(np.int16).astype(np.int64)
        return build_packets(counters, fields[:, 1] | self.status, counts)

    def _answer(self, data: bytes) -> bytes:
        answer = super()._answer(data)
        return answer if self.answers else b""

    def _configure(self, message: bytes) -> bytes:
        reply = super()._configure(message)
        if reply and not reply[4]:
            self.configured.append((message[4], message[5], message[6]))
        return reply


def table_source(counts: ArrayLike, rate: float) -> Source:
    """A recording as a source: at each time the sample that was the nearest; zero past its end.

    `counts` has shape (n, c); `rate` is in rows a second of the device's clock.
    """
    table = np.atleast_2d(np.asarray(counts, dtype=np.int64))

    def read(times: NDArray[np.float64]) -> NDArray[np.int64]:
        places = np.floor(times * rate + 0.5).astype(np.int64)
        out = table[np.clip(places, 0, len(table) - 1)]
        out[places >= len(table)] = 0
        return out

    return read


@dataclass(frozen=True, slots=True)
class Faults:
    """How often what goes wrong, as shares of the packets or bytes; nothing by default."""

    #: Packets that never arrive, though the counter counts them.
    lost: float = 0.0
    #: Bytes that are left out, changed in one bit, or sent twice.
    lost_bytes: float = 0.0
    corrupted: float = 0.0
    doubled: float = 0.0


def apply_faults(packets: NDArray[np.uint8], faults: Faults, rng: np.random.Generator) -> bytes:
    """Do to packets, one a row, what a bad cable does; gives the bytes that are left."""
    if not (faults.lost or faults.lost_bytes or faults.corrupted or faults.doubled):
        return packets.tobytes()
    repeats = np.ones(packets.shape, dtype=np.int64)
    repeats[rng.random(packets.shape) < faults.doubled] = 2
    repeats[rng.random(packets.shape) < faults.lost_bytes] = 0
    repeats[rng.random(len(packets)) < faults.lost] = 0
    flips = np.where(
        rng.random(packets.shape) < faults.corrupted,
        np.left_shift(1, rng.integers(0, 8, packets.shape)),
        0,
    ).astype(np.uint8)
    return np.repeat((packets ^ flips).ravel(), repeats.ravel()).tobytes()


class FaultyOptoForce(VirtualOptoForce):
    """A DAQ behind a bad cable; its faults can be set to others at any time."""

    def __init__(
        self, source: Source, rate: float = 1000.0, *, faults: Faults | None = None, **options
    ) -> None:
        super().__init__(source, rate, **options)
        self.faults = faults or Faults()
        self._rng, self._size = np.random.default_rng(0), 1

    def _packets(self, times: NDArray[np.float64]) -> NDArray[np.uint8]:
        packets = super()._packets(times)
        self._size = packets.shape[1]
        return packets

    def _due(self, now: float) -> bytes:
        packets = np.frombuffer(super()._due(now), np.uint8).reshape(-1, self._size)
        return apply_faults(packets, self.faults, self._rng)


#: Registers of the encoder's adapter: how much its count has to change to be sent, how often it
#: looks, its clock, its count, and how it replies.
THRESHOLD, INTERVAL, CLOCK, COUNT, FORMAT = "0B", "0C", "0D", "0E", "15"
#: Bits of the last: line feed, carriage return, a time stamp before them, blanks between all.
LINE_FEED, RETURN, STAMPED, SPACED = 1, 2, 4, 8
#: Steps a second of its clock.
STAMP_RATE = 512.0


class VirtualEncoder(TestedSampler):
    """A quadrature encoder behind a QSB adapter: it streams on change once it is told to.

    Its replies are ``r``, ``w``, ``s`` or ``e``, the register, the value in hexadecimal, and where
    register 15 says so a time stamp; then ``!`` if the adapter is one that ends so. See
    :mod:`forcelab.capture.encoder`.

    Parameters
    ----------
    source : callable
        Counts, shape (m, 1), at device times (s), shape (m,).
    rate : float
        How often a second it looks whether the count has changed.
    bang : bool
        Whether its replies end with ``!``.
    clock_ppm, path, waits
        As of :class:`TestedSampler`.
    """

    def __init__(
        self, source: Readings, rate: float = STAMP_RATE, *, bang: bool = True, **options
    ) -> None:
        super().__init__(source, rate, **options)
        #: All commands it was given.
        self.commands: list[str] = []
        self._end = "!" if bang else ""
        self._received = ""
        self._now = 0.0
        self._reset()

    def _reset(self) -> None:
        """As it is when it is switched on: it has lost its count."""
        self._streams = False
        self._registers = {FORMAT: LINE_FEED | RETURN}
        self._clock = self._now
        self._offset: int | None = None
        self._count = self._shown = 0

    def _begin(self, now: float) -> None:
        super()._begin(now)
        self._reset()

    def _due(self, now: float) -> bytes:
        times, values = self._next(now)
        out = b""
        threshold = self._registers.get(THRESHOLD, 0)
        for at, count in zip(times.tolist(), values[:, 0].tolist(), strict=True):
            if self._offset is None:
                self._offset = round(count)
            self._now, self._count = at, round(count) - self._offset
            if self._streams and abs(self._count - self._shown) >= threshold:
                self._shown = self._count
                out += self._reply("s", COUNT, self._count)
        return out

    def _answer(self, data: bytes) -> bytes:
        *lines, self._received = (self._received + data.decode("ascii", "replace")).split("\n")
        commands = [line.strip().upper() for line in lines]
        return b"".join(self._reply_to(command) for command in commands if command)

    def _reply_to(self, command: str) -> bytes:
        """What it replies to one command."""
        self.commands.append(command)
        verb, register, digits = command[:1], command[1:3], command[3:]
        try:
            number = int(digits or "0", 16)
        except ValueError:
            return self._reply("e", "00", 0)
        if verb == "W":
            self._write(register, number)
        elif verb in {"R", "S"} and register == COUNT:
            self._streams = verb == "S"
            number = self._shown = self._count
        elif verb == "R":
            number = self._registers.get(register, 0)
        else:
            return self._reply("e", "00", 0)
        return self._reply(verb.lower(), register, number)

    def _write(self, register: str, number: int) -> None:
        """Do what a register stands for."""
        self._registers[register] = number
        if register == INTERVAL and number and self._runs:
            last = self._runs[-1]
            sent = np.array([self._sent])
            start, device = float(last.host_times(sent)[0]), float(last.device_times(sent)[0])
            self._runs.append(PacedRun(self._sent, start, device, STAMP_RATE / number, self._pace))
        elif register == CLOCK:
            self._clock = self._now

    def _reply(self, verb: str, register: str, value: int) -> bytes:
        """One reply, in the format that register 15 asks for."""
        style = self._registers[FORMAT]
        parts = [verb, register, f"{value & 0xFFFFFFFF:08X}"]
        if style & STAMPED:
            parts.append(f"{int((self._now - self._clock) * STAMP_RATE) & 0xFFFFFFFF:08X}")
        if self._end:
            parts.append(self._end)
        ending = "\r" * bool(style & RETURN) + "\n" * bool(style & LINE_FEED)
        return ((" " if style & SPACED else "").join(parts) + ending).encode("ascii")


#: OpenCV's number of the time of the frame that was read last.
POSITION_MS = 0
#: A frame's number stands in its top rows as so many black and white squares.
BITS = 16
#: Longest time (s) that is slept at once, so that a release is noticed.
NAP = 0.05
#: Frames that are kept for a late reader; the oldest ones are lost, as drivers lose them.
BUFFERED = 4


class VirtualCamera:
    """A camera with `rate` frames a second of so many pixels."""

    def __init__(self, rate: float = 30.0, width: int = 320, height: int = 240) -> None:
        self.start = time.monotonic()
        self.rate = rate
        self._size = (width, height)
        self._next = 0
        self._take_samples = 0.0
        self._released = False

    def release(self) -> None:
        self._released = True

    def read(self) -> tuple[bool, NDArray[np.uint8] | None]:
        """Wait for the next frame and give its picture; nothing once it is released."""
        passed = int((time.monotonic() - self.start) * self.rate)
        number = max(self._next, passed + 1 - BUFFERED)
        taken = self.start + number / self.rate
        while not self._released:
            wait = taken - time.monotonic()
            if wait <= 0:
                self._next, self._take_samples = number + 1, taken
                return True, _picture(number, *self._size)
            time.sleep(min(wait, NAP))
        return False, None

    def get(self, what: int) -> float:
        """A property by OpenCV's number; 0 for what it does not know."""
        return 1000.0 * self._take_samples if what == POSITION_MS else 0.0


def _picture(number: int, width: int, height: int) -> NDArray[np.uint8]:
    """A grey picture with a number in its top rows, and a bar that moves."""
    out = np.full((height, width, 3), 96, dtype=np.uint8)
    side = width // BITS
    bits = (number >> np.arange(BITS)) & 1
    out[:side, : side * BITS] = (255 * np.repeat(bits, side))[None, :, None]
    left = 4 * number % width
    out[2 * side :, left : left + side] = (40, 200, 240)
    return out


def frame_number(picture):
    """The number in a picture of a virtual camera, modulo 65,536; lossy coding does it no harm."""
    side = picture.shape[1] // BITS
    squares = picture[:side, : side * BITS].mean(axis=(0, 2)).reshape(BITS, side)
    return int(((squares.mean(axis=1) > 127) << np.arange(BITS)).sum())
