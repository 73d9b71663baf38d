"""How many frames of a camera are missing between those that came."""

from __future__ import annotations

import math
from collections import deque
from statistics import median

__all__ = ["SILENT", "FrameCount"]

#: Seconds without a picture after which a camera is away.
SILENT = 2.0

_INTERVALS = 30  # of which the median is the camera's period
_KNOWN = 10  # intervals that tell it: what a driver kept before anybody read comes all at once
_GAP, _EARLY = 1.6, 0.6  # periods between two frames: one is missing or late; it was late
_LEAK = 0.8  # of a delay that is left with the next frame, as the period is not known exactly
_WATCHED = 10  # frames after a gap that tell late frames from missing ones


class FrameCount:
    """Counts frames, and those that a camera or its driver dropped.

    Where a camera stamps its frames, the stamps tell what is missing. Where only arrivals tell, a
    gap between two is a missing frame or a late one: late frames are followed by others that come
    sooner than a period, until the delay is made up; missing ones are not.

    Attributes
    ----------
    frames, dropped : int
        That came, and that are missing between those.
    """

    def __init__(self) -> None:
        self._steps: deque[float] = deque(maxlen=_INTERVALS)
        self._arrived = self._own = math.nan
        self.frames = self._sure = 0
        #: Of the frames in doubt: how late the last one and the least late one came (s), how many
        #: are watched yet, how many were, and how many frames are missing by them.
        self._behind = self._least = 0.0
        self._left = self._doubted = self._missing = 0

    def restart(self) -> None:
        """Count anew from the next frame on; the camera's period is known already."""
        self.frames = self._sure = 0
        self._forgive()

    def interrupted(self) -> None:
        """The camera was away: what it did not see it did not drop."""
        self._sure += self._missing
        self._arrived = self._own = math.nan
        self._forgive()

    @property
    def dropped(self) -> int:
        """Frames that are missing, as far as is known."""
        return self._sure + self._missing

    @property
    def rate(self) -> float:
        """Frames a second as measured; 0 while not known."""
        return 1.0 / median(self._steps) if self._steps else 0.0

    def count(self, arrived: float, own: float = 0.0) -> None:
        """Count a frame.

        Parameters
        ----------
        arrived : float
            When it arrived, in seconds of the host's clock.
        own : float
            The camera's own stamp (s); 0 where it tells none.
        """
        self.frames += 1
        stamped = self._own > 0 and own > self._own
        step = own - self._own if stamped else arrived - self._arrived
        self._arrived, self._own = arrived, own
        if not step > 0:
            return
        if len(self._steps) >= _KNOWN:
            period = median(self._steps)
            if stamped:
                self._sure += max(round(step / period) - 1, 0) if step > _GAP * period else 0
            else:
                self._watch(step - period, period)
        # What is made up after a delay comes faster than the camera; but its period may change.
        self._doubted = self._doubted + 1 if self._left else 0
        if not self._left or self._doubted > 2 * _WATCHED:
            self._steps.append(step)

    def _watch(self, ahead: float, period: float) -> None:
        """Take in by how much (s) a frame came later than a period after the one before it."""
        if ahead > (_GAP - 1) * period:
            self._sure += self._missing
            self._behind = self._least = max(self._behind - self._missing * period, 0.0) + ahead
            self._left = _WATCHED
        elif self._left:
            self._behind += ahead
            self._least = min(self._least, self._behind)
            self._left -= 1
        else:
            self._behind = _LEAK * self._behind + ahead
            if self._behind < -_EARLY * period and self._sure:
                self._sure -= 1  # it was late for longer than was watched
                self._behind += period
            return
        self._missing = max(round(self._least / period), 0)
        if not self._left:
            self._sure += self._missing
            self._behind -= self._missing * period
            self._least, self._missing = 0.0, 0

    def _forgive(self) -> None:
        """Nothing is in doubt."""
        self._behind = self._least = 0.0
        self._left = self._missing = self._doubted = 0
