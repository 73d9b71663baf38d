"""A virtual OptoForce: real packets in real time through a pseudo-terminal."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.virtual_faults import Faults, spoil
from forcelab.capture.virtual_port import BURST
from forcelab.capture.virtual_sampler import Absent, VirtualSampler
from forcelab.capture.virtual_streams import Source, build_packets
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


class VirtualOptoForce(VirtualSampler):
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
        As of :class:`~forcelab.capture.virtual_sampler.VirtualSampler`.
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
