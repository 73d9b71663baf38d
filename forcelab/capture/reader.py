"""A thread that reads one device: journal, clock, last seconds, and what is wrong."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.align import FORCE_NAME
from forcelab.capture.clock import ArrivalClock, missing_by_stamps, missing_samples
from forcelab.capture.device import Block, Device, MessageQueue, UnpluggedError
from forcelab.capture.journal import ENDED, PLUGGED, UNPLUGGED, JournalWriter, RecordKind
from forcelab.capture.zero_drift import ZeroDrift
from forcelab.demonstration import Channel
from forcelab.errors import ForcelabError

#: First sample's number, times (s, host's monotonic clock), shape (n,), and values, shape (n, c).
Window = tuple[int, NDArray[np.float64], NDArray[np.float64]]


class RingBuffer:
    """The last samples of a device, for any thread; memory is taken once.

    Samples are appended; where there is no more room, the last ones move to the front. So any
    window is one slice.
    """

    def __init__(self, length: int, channels: int) -> None:
        self._length = length
        self._rows = np.zeros((2 * length, 1 + channels))
        self._end = 0  # of the rows that are filled
        self._lock = threading.RLock()
        #: Samples taken in so far.
        self.count = 0

    def extend(self, times: NDArray[np.float64], values: NDArray[np.float64]) -> None:
        """Take in samples, shapes (n,) and (n, c)."""
        with self._lock:
            self.count += len(times)
            times, values = times[-self._length :], values[-self._length :]
            if self._end + len(times) > len(self._rows):
                self._rows[: self._length] = self._rows[self._end - self._length : self._end]
                self._end = self._length
            new = self._rows[self._end : self._end + len(times)]
            new[:, 0], new[:, 1:] = times, values
            self._end += len(times)

    def since(self, number: int) -> Window:
        """Copies of all samples from a number on (counted from 0), as far as they are kept.

        The next call's number is this one's first number plus its length.
        """
        with self._lock:
            first = max(number, self.count - self._length, 0)
            n = max(self.count - first, 0)
            rows = self._rows[self._end - n : self._end]
            return first, rows[:, 0].copy(), rows[:, 1:].copy()

    def latest(self, seconds: float) -> Window:
        """Copies of the samples of the last so many seconds, counted back from the last one."""
        with self._lock:
            n = min(self.count, self._length)
            times = self._rows[self._end - n : self._end, 0]
            first = int(np.searchsorted(times, times[-1] - seconds)) if n else 0
            return self.since(self.count - n + first)


@dataclass(frozen=True, slots=True)
class DeviceState:
    """How a device does; it counts from the start of a recording, before that from its opening."""

    name: str
    channels: tuple[Channel, ...]
    plugged: bool
    samples: int
    #: Missing by the counter, or by the stamps of a stream.
    lost: int
    #: Beyond the sensor's range.
    saturated: int
    #: As measured, in Hz; 0 while not known.
    rate: float
    #: Host time (s) at which its counter reads zero; NaN where there is no clock.
    offset: float
    #: Its configured seconds in seconds of the host: 1 + 200e-6 for a clock 200 ppm slow; NaN
    #: where there is no clock.
    clock_rate: float
    #: RMS distance (s) of the earliest arrivals from the clock.
    residual: float
    #: Of ``unplugged``, ``stalled``, ``saturation``, ``lost samples``, ``drift`` (of its clock) and
    #: ``zero`` (which drifts).
    alarms: tuple[str, ...]
    #: The channels whose zero drifted, and by how much in their unit.
    drifted: tuple[tuple[Channel, float], ...] = ()


#: Bits of a sample's status that mean that a reading is beyond what the sensor can tell.
OVERLOAD = 0x03F0
#: Units of channels that read zero when nothing is touched.
FORCE_UNITS = frozenset({"N", "mN", "kN", "Nm", "N m", "Nmm", "N mm", "mNm", "mN m", "g", "kg"})
_READ_SECONDS = 0.1  # s that a read waits at most
_RETRY = 0.25  # s between two tries to find a device again
_RECENT_SECONDS = 2.0  # s of an alarm after its cause; s that tell a rate, and what is lost
_STALLED = 1.0  # s without a sample after which a device is called stalled
# A clock is said to drift by so many s of residual, or that share of a period if it is more, ...
_DRIFT_SECONDS, _DRIFT_SHARE = 0.002, 0.2
_RATE_DRIFT = 1e-3  # ... or if its rate is off by this share
_WRONG_RATE, _SETTLED = 0.05, 5.0  # share by which a rate is wrong; s to be sure of it
_UNKNOWN_RATE = 1000.0  # Hz, at most, of a device without a configured rate


def _rate(times: NDArray[np.float64], stated: float) -> float:
    """Samples a second by their stamps (s), with those missing; 0 where these do not tell."""
    seconds = float(np.ptp(times)) if len(times) > 1 else 0.0
    taken = len(times) - 1 + int(missing_by_stamps(times, stated).sum())
    return taken / seconds if seconds > 0 else 0.0


class DeviceReader:
    """Reads one open device in a thread of its own, which alone uses it until :meth:`close`.

    `number` is that of the device in the journal; `seconds` are kept for views.
    """

    def __init__(self, number: int, device: Device, seconds: float) -> None:
        self.device = device
        rate = device.rate if device.rate > 0 else _UNKNOWN_RATE
        self.ring = RingBuffer(max(int(seconds * rate), 64), len(device.channels))
        #: Numbers of the first sample of what is recorded, counted since the device was opened, and
        #: of the first after it; None while it goes on.
        self.first = 0
        self.end: int | None = None
        self._number = number
        self._clock = ArrivalClock(device.rate)
        self._zero_drift = ZeroDrift(len(device.channels))
        self._lock = threading.Lock()
        self._stop, self._zero_requested = threading.Event(), threading.Event()
        self._journal: JournalWriter | None = None
        self._messages = MessageQueue()
        self._last: Block | None = None
        self._plugged = True
        self._marker: tuple[float, str] | None = None  # the last one
        self._counted = 0  # samples so far of a device without a counter: they count themselves
        self._opened = self._last_arrival = time.monotonic()
        self._lost_at = self._saturated_at = -np.inf
        self._samples = self._lost = self._saturated = 0
        self._unsettled = np.zeros(0)  # stamps of a stream whose next ones may tell what is missing
        self._just_zeroed = False  # what it dropped meanwhile was not lost
        self._before_gap: tuple[int, float] | None = None  # tick and time of the last sample
        self._rate_checked = device.holds
        self._thread = threading.Thread(target=self._run, name=f"forcelab {device.name}")
        self._thread.start()

    # For the recorder

    def record_to(self, journal: JournalWriter | None) -> None:
        """Give what comes from now on to a journal, or to none."""
        with self._lock:
            if journal is None and not self._plugged:
                self._note(RecordKind.EVENT, what=ENDED)
            self._journal = journal
            if journal is None:
                self.end = self.ring.count
                return
            self._samples = self._lost = self._saturated = 0
            self._unsettled = np.zeros(0)
            # What it holds, it holds since before.
            self.first = self.ring.count - int(self.device.holds and self.ring.count > 0)
            self.end = None
            self._before_gap = None  # what it misses before its first sample is not recorded
            if self.device.holds and self._last is not None and self._plugged:
                # Its value holds since before.
                journal.block(
                    self._number, Block(self._last.arrived[-1:], None, self._last.values[-1:])
                )
            if self._marker is not None:
                at, text = self._marker
                self._note(RecordKind.MARK, at, marker=text)  # it holds until the next one
            if not self._plugged:
                self._note(RecordKind.EVENT, what=UNPLUGGED)

    def zero(self) -> None:
        """Let the device take its present readings for zero, soon."""
        self._zero_requested.set()

    def remarks(self) -> tuple[str, ...]:
        """What happened since the last call, a sentence each."""
        return self._messages.take()

    def state(self) -> DeviceState:
        now = time.monotonic()
        configured = self.device.rate
        with self._lock:
            clocked = self._clock.known and not self.device.holds
            rate = 1.0 / self._clock.rate if clocked else 0.0
            if self.device.stamped and not self.device.holds:
                rate = _rate(self.ring.latest(_RECENT_SECONDS)[1], configured)
            # A rate that was only measured is no promise that a clock could break.
            promised = configured > 0 and not self.device.measured
            pace = configured / rate if clocked and promised else np.nan
            residual = self._clock.residual if clocked else np.nan
            patience = _STALLED + (2 / configured if configured > 0 else 0)
            off = clocked and residual > max(_DRIFT_SECONDS, _DRIFT_SHARE / rate)
            drifted = self._drifted()
            alarms = {
                "unplugged": not self._plugged,
                "stalled": self._plugged
                and not self.device.holds
                and now - self._last_arrival > patience,
                "saturation": now - self._saturated_at < _RECENT_SECONDS,
                "lost samples": now - self._lost_at < _RECENT_SECONDS,
                "drift": clocked and (off or abs(pace - 1) > _RATE_DRIFT),
                "zero": bool(drifted),
            }
            return DeviceState(
                self.device.name,
                self.device.channels,
                self._plugged,
                self._samples,
                self._lost + int(missing_by_stamps(self._unsettled, configured).sum()),
                self._saturated,
                rate,
                self._clock.offset if clocked else np.nan,
                pace,
                residual,
                tuple(name for name, on in alarms.items() if on),
                drifted,
            )

    def _drifted(self) -> tuple[tuple[Channel, float], ...]:
        """The channels whose zero drifted; of forces alone, as others may rest anywhere."""
        drift = self._zero_drift.drift.tolist()
        return tuple(
            (channel, by)
            for channel, by in zip(self.device.channels, drift, strict=True)
            if by and (channel.unit in FORCE_UNITS or FORCE_NAME.fullmatch(channel.name))
        )

    def close(self) -> None:
        """End the thread and release the device."""
        self._stop.set()
        self._thread.join()
        self.device.close()

    # In the thread

    def _run(self) -> None:
        while not self._stop.is_set():
            try:
                if self._zero_requested.is_set():
                    self._zero_requested.clear()
                    self.device.zero()
                    with self._lock:
                        self._zero_drift.restart()
                        self._just_zeroed = True
                block = self.device.read(_READ_SECONDS)
            except UnpluggedError as error:
                self._wait_for_device(error)
                continue
            if block is not None and len(block):
                self._add(block)
            for at, text in self.device.take_markers():
                with self._lock:
                    self._marker = at, text
                    self._samples += 1
                    self._note(RecordKind.MARK, at, marker=text)
            for sentence in self.device.remarks():
                self._report(sentence)
            self._check_rate()

    def _check_rate(self) -> None:
        """Say once that the device does not give as many samples as configured."""
        settled = self._last_arrival >= self._opened + _SETTLED
        if self._rate_checked or not self._clock.learnt or not settled:
            return
        self._rate_checked = True
        configured, rate = self.device.rate, 1.0 / self._clock.rate
        if configured > 0 and abs(rate - configured) > _WRONG_RATE * configured:
            self._report(
                f"{self.device.name} gives {rate:.4g} samples a second, not {configured:.4g}: what "
                f"is recognised live goes wrong; connect it with ?rate={rate:.4g} or set it to "
                f"{configured:.4g}."
            )

    def _add(self, block: Block) -> None:
        with self._lock:
            if self._journal is not None:
                self._journal.block(self._number, block)
            self._last = block
            self._last_arrival = time.monotonic()
            self._samples += len(block)
            self.ring.extend(self._times(block), block.values)
            if not self.device.holds:
                self._zero_drift.update(block.arrived, block.values)
            if block.status is not None:
                saturated = int(np.count_nonzero(block.status & OVERLOAD))
                self._saturated += saturated
                if saturated:
                    self._saturated_at = self._last_arrival

    def _times(self, block: Block) -> NDArray[np.float64]:
        """When the samples were taken, by the clock as it is now."""
        if self.device.stamped and not self.device.holds:
            self._count_missing(block.arrived)
        if self.device.holds or self.device.stamped:
            return block.arrived
        ticks = block.ticks
        if ticks is None:
            ticks = np.arange(self._counted, self._counted + len(block), dtype=np.int64)
            self._counted += len(block)
        before, stretches = self._clock.newest, self._clock.stretches
        self._clock.update(block.arrived, ticks)
        if before is not None and self._clock.stretches == stretches:
            missing = int(ticks[-1]) - before - len(block)
            if missing > 0 and not self._just_zeroed:
                self._lost += missing
                self._lost_at = self._last_arrival
        self._just_zeroed = False
        host = self._clock.to_host(ticks)
        if self._before_gap is not None:
            last, when = self._before_gap
            steps, seconds = int(ticks[0]) - last, float(host[0]) - when
            self._lost += missing_samples(steps, seconds, self._clock.rate)
            self._before_gap = None
        return host

    def _count_missing(self, stamps: NDArray[np.float64]) -> None:
        """Count what a stream's stamps say is missing once later ones can no longer catch up."""
        stamps = np.concatenate([self._unsettled, stamps])
        missing = missing_by_stamps(stamps, self.device.rate)
        settled = int(np.searchsorted(stamps, stamps[-1] - _RECENT_SECONDS))
        self._lost += int(missing[:settled].sum())
        self._unsettled = stamps[settled:]
        later = np.arange(len(missing), 0, -1)  # samples that came after each
        if ((missing > 0) & (later > missing))[settled:].any():
            self._lost_at = self._last_arrival

    def _wait_for_device(self, error: UnpluggedError) -> None:
        """Say that the device is gone, and wait until it is back."""
        since = time.monotonic()
        with self._lock:
            self._plugged = False
            self._note(RecordKind.EVENT, what=UNPLUGGED)
        self._report(str(error))
        while not self._stop.wait(_RETRY):
            try:
                self.device.reopen()
            except ForcelabError:  # it is not back yet
                continue
            with self._lock:
                self._plugged = True
                self._last_arrival = time.monotonic()
                if self._before_gap is None and (newest := self._clock.newest) is not None:
                    self._before_gap = newest, float(self._clock.to_host(np.array([newest]))[0])
                self._lost += int(missing_by_stamps(self._unsettled, self.device.rate).sum())
                self._unsettled = np.zeros(0)
                self._clock.restart()
                self._zero_drift.interrupt()
                self._note(RecordKind.EVENT, what=PLUGGED)
            self._report(f"{self.device.name} is back after {self._last_arrival - since:.1f} s.")
            return

    def _note(self, kind: RecordKind, at: float | None = None, **what: str) -> None:
        """Note what happened in the journal, at a time (s) or now, holding the lock."""
        if self._journal is not None:
            at = time.monotonic() if at is None else at
            self._journal.note(kind, self._number, at=at, **what)

    def _report(self, sentence: str) -> None:
        self._messages.put(sentence)
        with self._lock:
            self._note(RecordKind.MESSAGE, text=sentence)
