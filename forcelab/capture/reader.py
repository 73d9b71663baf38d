"""A thread that reads one device: journal, clock, last seconds, and what is wrong."""

from __future__ import annotations

import re
import threading
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.clock import ArrivalClock
from forcelab.capture.device import Block, Device, UnpluggedError
from forcelab.capture.journal import Kind
from forcelab.capture.journal_writer import JournalWriter
from forcelab.capture.messages import MessageQueue
from forcelab.capture.sample_counter import missed
from forcelab.capture.zero_drift import ZeroDrift
from forcelab.demonstration import Channel
from forcelab.errors import ForcelabError

#: First sample's number, times (s, host's monotonic clock), shape (n,), and values, shape (n, c).
Window = tuple[int, NDArray[np.float64], NDArray[np.float64]]


class Ring:
    """The last samples of a device; memory is taken once.

    Each sample is written twice, one length of the ring apart, so that any window is one slice.

    Parameters
    ----------
    length : int
        Samples that are kept.
    channels : int

    Attributes
    ----------
    count : int
        Samples taken in so far.

    Notes
    -----
    Not for several threads at once.
    """

    def __init__(self, length: int, channels: int) -> None:
        self._length = length
        self._rows = np.zeros((2 * length, 1 + channels))
        self.count = 0

    def extend(self, times: NDArray[np.float64], values: NDArray[np.float64]) -> None:
        """Take in samples, shapes (n,) and (n, c)."""
        self.count += len(times)
        times, values = times[-self._length :], values[-self._length :]
        n = len(times)
        at = (self.count - n) % self._length
        first = min(n, self._length - at)
        for begin, part in ((at, slice(0, first)), (0, slice(first, n))):
            rows = part.stop - part.start
            for place in (begin, begin + self._length):
                self._rows[place : place + rows, 0] = times[part]
                self._rows[place : place + rows, 1:] = values[part]

    def since(self, number: int) -> Window:
        """Copies of all samples from one on, as far as they are still there.

        Parameters
        ----------
        number : int
            Of the first sample that is wanted, counted from 0; the next call's is this one's
            first number plus its length.
        """
        first = max(number, self.count - self._length, 0)
        n = max(self.count - first, 0)
        at = first % self._length
        rows = self._rows[at : at + n]
        return first, rows[:, 0].copy(), rows[:, 1:].copy()

    def latest(self, seconds: float) -> Window:
        """Copies of the samples of the last so many seconds, counted back from the last one."""
        kept = min(self.count, self._length)
        if not kept:
            return self.since(self.count)
        at = (self.count - kept) % self._length
        times = self._rows[at : at + kept, 0]
        first = int(np.searchsorted(times, times[-1] - seconds))
        return self.since(self.count - kept + first)


@dataclass(frozen=True, slots=True)
class DeviceState:
    """How a device does.

    Parameters
    ----------
    name : str
    channels : tuple of Channel
    plugged : bool
        Whether it is there.
    samples, lost, saturated : int
        Samples that came, were missing by the counter, and were beyond the sensor's range, since
        the recording began; before that, since it was opened.
    rate : float
        Samples a second as measured, in Hz; 0 while not known.
    offset : float
        Host time (s) at which its counter reads zero; NaN where there is no clock.
    clock_rate : float
        Its seconds as told in seconds of the host: 1 + 200e-6 for a clock 200 ppm slow; NaN where
        there is no clock.
    residual : float
        Root mean square distance (s) of the earliest arrivals from the clock.
    alarms : tuple of str
        Of ``unplugged``, ``stalled``, ``saturation``, ``lost samples``, ``drift`` (of its clock)
        and ``zero`` (which wanders).
    wandered : tuple of (Channel, float)
        The channels whose zero wandered, and by how much in their unit.
    """

    name: str
    channels: tuple[Channel, ...]
    plugged: bool
    samples: int
    lost: int
    saturated: int
    rate: float
    offset: float
    clock_rate: float
    residual: float
    alarms: tuple[str, ...]
    wandered: tuple[tuple[Channel, float], ...] = ()


@dataclass(frozen=True, slots=True)
class CameraState:
    """How a camera does.

    Parameters
    ----------
    name : str
    frames, dropped : int
        That came, and that are missing between those, since the recording began; before that,
        since it was opened.
    rate : float
        Frames a second as measured; 0 while not known.
    alarms : tuple of str
        Of ``no picture`` and ``not written``.
    """

    name: str
    frames: int
    dropped: int
    rate: float
    alarms: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class RecorderState:
    """How a recorder does.

    Parameters
    ----------
    recording : bool
    name : str
        Of the demonstration that is recorded; empty while none is.
    seconds : float
        Since the recording began; 0 while none is.
    in_memory : int
        Bytes that the disk refuses and that are kept in memory.
    devices : tuple of DeviceState
    cameras : tuple of CameraState
    """

    recording: bool
    name: str
    seconds: float
    in_memory: int
    devices: tuple[DeviceState, ...]
    cameras: tuple[CameraState, ...]

    @property
    def obstacle(self) -> str:
        """Why no recording can begin, in a sentence; empty where one can."""
        if any(device.plugged for device in self.devices):
            return ""
        return "No device is plugged in, so nothing can be recorded; plug one in again."


#: What events in the journal are called.
UNPLUGGED, PLUGGED = "unplugged", "plugged in again"
#: Bits of a sample's status that mean that a reading is beyond what the sensor can tell.
OVERLOAD = 0x03F0
#: Units of channels that read zero when nothing is touched.
FORCES = frozenset({"N", "mN", "kN", "Nm", "N m", "Nmm", "N mm", "mNm", "mN m", "g", "kg"})

FORCE_NAME = re.compile(r"[ft][xyz]\d*")  # raw counts have no unit, but the name of a force
_WAIT = 0.1  # s that a read waits at most
_RETRY = 0.25  # s between two tries to find a device again
_RECENT = 2.0  # s for which an alarm is shown after its cause
_STALLED = 1.0  # s without a sample after which a device is called stalled
_DRIFT, _PART = 0.002, 0.2  # s of residual, and share of a period if that is more, and
_FAST = 1e-3  # share of the rate, beyond which a clock is said to drift
_WRONG, _SETTLED = 0.05, 5.0  # share by which a rate is off that was told wrong; s to be sure of it
_UNKNOWN = 1000.0  # Hz, at most, of a device that was told no rate


class DeviceReader:
    """Reads one device that is open, in a thread of its own.

    Parameters
    ----------
    number : int
        Of the device in the journal.
    device : Device
        Open; used by this thread alone from now on, until :meth:`close`.
    seconds : float
        That are kept for views.

    Attributes
    ----------
    first : int
        Number of the first sample of what is recorded, counted since it was opened.
    end : int or None
        Number of the first sample after it; None while it goes on.
    """

    def __init__(self, number: int, device: Device, seconds: float) -> None:
        self.device = device
        self._number = number
        self._clock = ArrivalClock(device.rate)
        rate = device.rate if device.rate > 0 else _UNKNOWN
        self._ring = Ring(max(int(seconds * rate), 64), len(device.channels))
        self._wander = ZeroDrift(len(device.channels))
        self._lock = threading.Lock()
        self._ended, self._zero = threading.Event(), threading.Event()
        self._journal: JournalWriter | None = None
        self._events = MessageQueue()
        self._last: Block | None = None
        self._plugged = True
        self._counted = 0  # samples so far of a device without a counter: they count themselves
        self._heard = time.monotonic()
        self._lost_at = self._saturated_at = -np.inf
        self._samples = self._lost = self._saturated = 0
        self.first = 0
        self.end: int | None = None
        self._zeroed = False  # just now: what it dropped meanwhile was not lost
        self._gone: tuple[int, float] | None = None  # tick and time of the last sample before
        self._begun, self._judged = self._heard, device.holds  # whether its rate was looked at
        self._thread = threading.Thread(target=self._run, name=f"forcelab {device.name}")
        self._thread.start()

    # For the recorder

    def record_to(self, journal: JournalWriter | None) -> None:
        """Give what comes from now on to a journal, or to none."""
        with self._lock:
            self._journal = journal
            if journal is None:
                self.end = self._ring.count
                return
            self._samples = self._lost = self._saturated = 0
            # What it holds, it holds since before.
            self.first = self._ring.count - int(self.device.holds and self._ring.count > 0)
            self.end = None
            self._gone = None  # what it misses before its first sample is not of this recording
            if self.device.holds and self._last is not None and self._plugged:
                journal.block(self._number, self._last)  # its value holds since before
            if not self._plugged:
                journal.note(Kind.EVENT, self._number, at=time.monotonic(), what=UNPLUGGED)

    def zero(self) -> None:
        """Let the device take its present readings for zero, soon."""
        self._zero.set()

    def latest(self, seconds: float) -> Window:
        """The samples of the last seconds; see :class:`~forcelab.capture.reader.Ring`."""
        with self._lock:
            return self._ring.latest(seconds)

    def since(self, number: int) -> Window:
        """All samples from one on; see :class:`~forcelab.capture.reader.Ring`."""
        with self._lock:
            return self._ring.since(number)

    def remarks(self) -> tuple[str, ...]:
        """What happened since the last time this was asked, a sentence each."""
        return self._events.take()

    def state(self) -> DeviceState:
        """How the device does."""
        now = time.monotonic()
        told = self.device.rate
        with self._lock:
            clocked = self._clock.known and not self.device.holds
            rate = 1.0 / self._clock.rate if clocked else 0.0
            # A rate that was only measured is no promise that a clock could break.
            promised = told > 0 and not getattr(self.device, "measured", False)
            pace = told / rate if clocked and promised else np.nan
            residual = self._clock.residual if clocked else np.nan
            silent = now - self._heard > _STALLED + (2 / told if told > 0 else 0)
            off = clocked and residual > max(_DRIFT, _PART / rate)
            drifts = clocked and (off or abs(pace - 1) > _FAST)
            wandered = self._wandered()
            alarms = {
                "unplugged": not self._plugged,
                "stalled": self._plugged and silent and not self.device.holds,
                "saturation": now - self._saturated_at < _RECENT,
                "lost samples": now - self._lost_at < _RECENT,
                "drift": drifts,
                "zero": bool(wandered),
            }
            return DeviceState(
                self.device.name,
                self.device.channels,
                self._plugged,
                self._samples,
                self._lost,
                self._saturated,
                rate,
                self._clock.offset if clocked else np.nan,
                pace,
                residual,
                tuple(name for name, there in alarms.items() if there),
                wandered,
            )

    def _wandered(self) -> tuple[tuple[Channel, float], ...]:
        """The channels whose zero wandered; of forces alone, as others may rest anywhere."""
        wander = self._wander.wander.tolist()
        return tuple(
            (channel, by)
            for channel, by in zip(self.device.channels, wander, strict=True)
            if by and (channel.unit in FORCES or FORCE_NAME.fullmatch(channel.name))
        )

    def close(self) -> None:
        """End the thread and let go of the device."""
        self._ended.set()
        self._thread.join()
        self.device.close()

    # In the thread

    def _run(self) -> None:
        while not self._ended.is_set():
            try:
                if self._zero.is_set():
                    self._zero.clear()
                    self.device.zero()
                    with self._lock:
                        self._wander.restart()
                        self._zeroed = True
                block = self.device.read(_WAIT)
            except UnpluggedError as error:
                self._wait_for_it(error)
                continue
            if block is not None and len(block):
                self._take(block)
            for sentence in (*self.device.remarks(), *self._misjudged()):
                self._report(sentence)

    def _misjudged(self) -> list[str]:
        """Say once that the device does not give as many samples as it was told to."""
        if self._judged or not self._clock.learnt or self._heard < self._begun + _SETTLED:
            return []
        self._judged = True
        told, rate = self.device.rate, 1.0 / self._clock.rate
        if not told > 0 or abs(rate - told) <= _WRONG * told:
            return []
        return [
            f"{self.device.name} gives {rate:.4g} samples a second, not {told:.4g}: what is "
            f"recognised live goes wrong; connect it with ?rate={rate:.4g} or set it to {told:.4g}."
        ]

    def _take(self, block: Block) -> None:
        """Take in what came."""
        with self._lock:
            if self._journal is not None:
                self._journal.block(self._number, block)
            self._last = Block(
                block.arrived[-1:].copy(),
                None if block.ticks is None else block.ticks[-1:].copy(),
                block.values[-1:].copy(),
                None if block.status is None else block.status[-1:].copy(),
            )
            self._heard = time.monotonic()
            self._samples += len(block)
            self._ring.extend(self._times(block), block.values)
            if not self.device.holds:
                self._wander.update(block.arrived, block.values)
            if block.status is not None:
                over = int(np.count_nonzero(block.status & OVERLOAD))
                self._saturated += over
                if over:
                    self._saturated_at = self._heard

    def _times(self, block: Block) -> NDArray[np.float64]:
        """When the samples were taken, by the clock as it is now."""
        if self.device.holds:
            return block.arrived
        ticks = block.ticks
        if ticks is None:
            ticks = np.arange(self._counted, self._counted + len(block), dtype=np.int64)
            self._counted += len(block)
        before, stretches = self._clock.newest, self._clock.stretches
        self._clock.update(block.arrived, ticks)
        if before is not None and self._clock.stretches == stretches:
            missing = int(ticks[-1]) - before - len(block)
            if missing > 0 and not self._zeroed:
                self._lost += missing
                self._lost_at = self._heard
        self._zeroed = False
        host = self._clock.to_host(ticks)
        if self._gone is not None:
            last, when = self._gone
            self._lost += missed(int(ticks[0]) - last, float(host[0]) - when, self._clock.rate)
            self._gone = None
        return host

    def _wait_for_it(self, error: UnpluggedError) -> None:
        """Say that the device is gone, and wait until it is back."""
        gone = time.monotonic()
        with self._lock:
            self._plugged = False
            self._note(UNPLUGGED)
        self._report(str(error))
        while not self._ended.wait(_RETRY):
            try:
                self._reopen()
            except ForcelabError:  # it is not there yet
                continue
            with self._lock:
                self._plugged = True
                self._heard = time.monotonic()
                if self._gone is None and (newest := self._clock.newest) is not None:
                    self._gone = newest, float(self._clock.to_host(np.array([newest]))[0])
                self._clock.restart()
                self._wander.interrupt()
                self._note(PLUGGED)
            self._report(f"{self.device.name} is back after {self._heard - gone:.1f} s.")
            return

    def _reopen(self) -> None:
        """Connect again, by the device's own way where it has one."""
        again = getattr(self.device, "reopen", None)
        if again is not None:
            again()
            return
        self.device.close()
        self.device.open()

    def _note(self, what: str) -> None:
        """Note an event in the journal, holding the lock."""
        if self._journal is not None:
            self._journal.note(Kind.EVENT, self._number, at=time.monotonic(), what=what)

    def _report(self, sentence: str) -> None:
        self._events.say(sentence)
        with self._lock:
            if self._journal is not None:
                at = time.monotonic()
                self._journal.note(Kind.MESSAGE, self._number, at=at, text=sentence)
