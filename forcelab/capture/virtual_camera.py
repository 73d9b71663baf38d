"""A virtual camera: frames with numbers in them, given as OpenCV's capture objects give them."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["BITS", "VirtualCamera"]

#: OpenCV's numbers of what a capture object can be asked.
POSITION_MS, WIDTH, HEIGHT, RATE = 0, 3, 4, 5
#: A frame's number stands in its top rows as so many black and white squares.
BITS = 16
#: Longest time (s) that is slept at once, so that a release is noticed.
NAP = 0.05


@dataclass(frozen=True, slots=True)
class _Frame:
    """One frame on its way.

    Parameters
    ----------
    number : int
        Which one, from 0; it wraps in the picture only.
    taken, ready : float
        When it was taken, and when it can be had, in seconds of the host's monotonic clock.
    """

    number: int
    taken: float
    ready: float


class VirtualCamera:
    """Something with ``read``, ``grab``, ``retrieve``, ``get``, ``set`` and ``release``.

    Frames that nobody asks for are kept up to `buffered` and lost after that, the oldest first,
    as drivers do.

    Parameters
    ----------
    rate : float
        Frames a second.
    width, height : int
        Size in pixels.
    jitter : float
        Mean of the exponential delay of each frame's arrival, in seconds.
    dropped : float
        Share of the frames that never arrive.
    stalls : sequence of (float, float)
        Stretches, in seconds from its start, in which nothing arrives; what was taken then
        arrives at their end.
    tells_time : bool
        Whether it tells when a frame was taken; else it says 0, as many do.
    buffered : int
        Frames that the driver keeps.
    seed : int
        Of jitter and drops.
    """

    def __init__(
        self,
        rate: float = 30.0,
        width: int = 320,
        height: int = 240,
        *,
        jitter: float = 0.0,
        dropped: float = 0.0,
        stalls: tuple[tuple[float, float], ...] = (),
        tells_time: bool = True,
        buffered: int = 4,
        seed: int = 0,
    ) -> None:
        self.start = time.monotonic()
        self.rate = rate
        self._size = (width, height)
        self._jitter, self._dropped, self._stalls = jitter, dropped, stalls
        self._tells_time, self._buffered = tells_time, buffered
        self._rng = np.random.default_rng(seed)
        self._waiting: list[_Frame] = []
        self._next = 0
        self._held: _Frame | None = None
        self._released = False
        self._latest = self.start

    def isOpened(self) -> bool:  # noqa: N802 - as OpenCV calls it
        """Whether it can be read."""
        return not self._released

    def unplug(self) -> None:
        """From now on it gives nothing, at once."""
        self._released = True

    def release(self) -> None:
        """Let go of it."""
        self._released = True

    def grab(self) -> bool:
        """Wait for the next frame; False once it is released or unplugged."""
        while not self._released:
            frame = self._foremost()
            wait = frame.ready - time.monotonic()
            if wait <= 0:
                self._held = self._waiting.pop(0)
                return True
            time.sleep(min(wait, NAP))
        return False

    def retrieve(self) -> tuple[bool, NDArray[np.uint8] | None]:
        """The picture of the frame that was grabbed."""
        if self._held is None or self._released:
            return False, None
        return True, _picture(self._held.number, *self._size)

    def read(self) -> tuple[bool, NDArray[np.uint8] | None]:
        """Wait for the next frame and give its picture."""
        return self.retrieve() if self.grab() else (False, None)

    def get(self, what: int) -> float:
        """A property by OpenCV's number; 0 for what it does not know."""
        if what == POSITION_MS:
            return 1000.0 * self._held.taken if self._held and self._tells_time else 0.0
        known = {WIDTH: float(self._size[0]), HEIGHT: float(self._size[1]), RATE: self.rate}
        return known.get(what, 0.0)

    def set(self, what: int, value: float) -> bool:
        """Ask for a property; it only ever takes another rate, and that before the first frame."""
        if what == RATE and value > 0 and self._next == 0:
            self.rate = value
            return True
        return False

    def _foremost(self) -> _Frame:
        """The oldest frame that is not lost, on its way or there."""
        now = time.monotonic()
        while not self._waiting or self._waiting[-1].ready <= now:
            self._waiting.append(self._arriving())
        there = sum(frame.ready <= now for frame in self._waiting)
        del self._waiting[: max(there - self._buffered, 0)]
        return self._waiting[0]

    def _arriving(self) -> _Frame:
        """The next frame that is not dropped."""
        while self._dropped and self._rng.random() < self._dropped:
            self._next += 1
        number, self._next = self._next, self._next + 1
        taken = self.start + number / self.rate
        ready = taken + (self._rng.exponential(self._jitter) if self._jitter else 0.0)
        for begin, end in self._stalls:
            if self.start + begin <= ready < self.start + end:
                ready = self.start + end
        self._latest = max(self._latest, ready)  # frames do not overtake each other
        return _Frame(number, taken, self._latest)


def _picture(number: int, width: int, height: int) -> NDArray[np.uint8]:
    """A grey picture with a number in its top rows, and a bar that moves."""
    out = np.full((height, width, 3), 96, dtype=np.uint8)
    side = width // BITS
    bits = (number >> np.arange(BITS)) & 1
    out[:side, : side * BITS] = (255 * np.repeat(bits, side))[None, :, None]
    left = 4 * number % width
    out[2 * side :, left : left + side] = (40, 200, 240)
    return out
