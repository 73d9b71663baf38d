"""A virtual camera: frames with numbers in them, given as OpenCV's capture objects give them."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

__all__ = ["BITS", "VirtualCamera"]

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
