"""A virtual OptoForce: real packets in real time through a pseudo-terminal."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.virtual_faults import Faults, spoil
from forcelab.capture.virtual_port import BURST, VirtualPort
from forcelab.capture.virtual_streams import Run, Source, Truth, build_packets, truth_of
from forcelab.formats.optoforce.framing import sealed

__all__ = ["VirtualOptoForce"]

#: What the host sends: how it begins, and its whole length in bytes.
CONFIGURE, CONFIGURE_BYTES = bytes((170, 0, 50, 3)), 9
IDENTIFY = bytes((171, 0, 18, 8, 0, 197))
#: Value of the byte for zero that makes the present readings zero.
ZERO = 255
#: The filters are numbered 0 to this.
FILTERS = 6
#: Status bit of the first reading's overload; those of the next ones follow below it.
OVERLOAD = 9


class VirtualOptoForce(VirtualPort):
    """A DAQ with its sensors that is not there.

    It streams as soon as it is switched on, at `rate` until the host sets a speed, and answers
    as the real one does. Its filters are not simulated.

    Parameters
    ----------
    source : callable
        Readings in counts, shape (m, c), at device times (s), shape (m,); see
        :func:`~forcelab.capture.virtual_streams.rows` for a recording. c = 3, 12 or 6 makes it a
        DAQ of one 3-axis sensor, of four, or of a 6-axis one.
    rate : float
        Samples a second of its own clock when it is switched on.
    clock_ppm : float
        How fast its clock is, in parts per million; negative for a slow one.
    faults : Faults
        What goes wrong; can be set to others at any time.
    seed : int
        Of the faults.
    serial : str
        Eight characters.
    step : int
        Counts from one packet to the next.
    first : int
        The counter of the first packet after each switching on.
    limit : int
        Counts at which a reading saturates; its overload is in the status then.
    duration : float
        Seconds of the device's clock after which it has nothing more to send; can be set later.
    absent : callable, optional
        Which samples never leave it, by their device times (s); the counter counts them.
    path, burst, waits
        As of :class:`~forcelab.capture.virtual_port.VirtualPort`.
    """

    def __init__(
        self,
        source: Source,
        rate: float = 1000.0,
        *,
        clock_ppm: float = 0.0,
        faults: Faults | None = None,
        seed: int = 0,
        serial: str = "ISE123AB",
        step: int = 1,
        first: int = 0,
        limit: int = 32_767,
        duration: float = np.inf,
        absent: Callable[[NDArray[np.float64]], NDArray[np.bool_]] | None = None,
        path: Path | None = None,
        burst: float = BURST,
        waits: bool = False,
    ) -> None:
        super().__init__(path, burst=burst, waits=waits)
        self.faults = faults or Faults()
        #: Bits that are added to the status of every sample from now on.
        self.status = 0
        #: Whether it answers what it is asked; a real one that is broken may not.
        self.answers = True
        #: Each configuration it was given: speed, filter and zero byte.
        self.configured: list[tuple[int, int, int]] = []
        self._source, self._rate, self._serial = source, rate, serial
        self._pace = 1.0 + 1e-6 * clock_ppm
        self._step, self._first, self._limit = step, first, limit
        self.duration = duration
        self._absent = absent
        self._rng = np.random.default_rng(seed)
        self._runs: list[Run] = []
        self._sent = 0
        self._counter = first
        self._last = (0, 0)
        self._spoiled: list[NDArray[np.int64]] = []
        self._zero: NDArray[np.int64] | int = 0
        self._asked = b""

    def truth(self) -> Truth:
        """What was measured and when, up to now; settled once the device is closed."""
        runs, sent = list(self._runs), self._sent
        return truth_of(
            runs, sent, list(self._spoiled), lambda times: self._source(times).astype(np.float64)
        )

    @property
    def begun(self) -> float | None:
        """When its own clock began, in seconds of the host's monotonic one; None before that."""
        return self._runs[0].start if self._runs else None

    def jump(self, counts: int) -> None:
        """Let the counter jump ahead."""

        def ahead() -> None:
            self._counter += counts

        self._ask(ahead)

    def _begin(self, now: float) -> None:
        """Switched on: what it was told before is forgotten, but the world went on."""
        self._zero, self._asked, self._counter = 0, b"", self._first
        self._run_from(now, self._rate)

    def _run_from(self, now: float, rate: float) -> None:
        """Take samples from now on at a rate."""
        origin = self._runs[0].start if self._runs else now
        self._runs.append(Run(self._sent, now, (now - origin) * self._pace, rate, self._pace))

    def _due(self, now: float) -> bytes:
        """Packets of the samples taken since the last time."""
        run = self._runs[-1]
        samples = np.arange(self._sent, run.first + run.due(now))
        times = run.device_times(samples)
        samples, times = samples[times < self.duration], times[times < self.duration]
        if now - run.start + run.device >= self.duration:
            self.ended.set()
        self._last = (self._sent, self._sent + len(samples))
        if not len(samples):
            return b""
        packets = self._packets(times)
        if self._absent is not None:
            gone = self._absent(times)
            self._spoiled.append(samples[gone])
            self._sent += int(gone.sum())
            samples, packets = samples[~gone], packets[~gone]
        sent, intact = spoil(packets, self.faults, self._rng)
        if not intact.all():
            self._spoiled.append(samples[~intact])
        self._sent += len(samples)
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

    def _unheard(self) -> None:
        """The samples sent last were lost."""
        if self._last[1] > self._last[0]:
            self._spoiled.append(np.arange(*self._last))

    def _heard(self, data: bytes) -> bytes:
        """Answers to whole messages; what is none is passed over."""
        self._asked += data
        answer = b""
        while self._asked:
            if self._asked.startswith(IDENTIFY):
                self._asked = self._asked[len(IDENTIFY) :]
                answer += sealed(bytes((170, 0, 18, 8)) + self._serial.encode("ascii")[:8])
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
        if sealed(message[:-2]) != message:
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
        return sealed(bytes((170, 0, 80, 1, 0 if good else 1)))
