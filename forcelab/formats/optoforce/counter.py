"""From the 16-bit counter of a DAQ to ticks, which count samples and never wrap.

The counter goes on by the same step from sample to sample, but by which one differs from device to
device and with the speed that it was told: it is learnt from the stream. Where it goes on by
several steps, the samples between are missing. Up to half a turn the counter is believed; beyond
that the host's clock decides how many turns it made, or whether it jumped.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

__all__ = ["TURN", "Ticks", "Unwrapper", "modal_step"]

#: Values of the counter.
TURN: Final = 65_536


def modal_step(counts: NDArray[np.uint16]) -> tuple[int, float]:
    """The commonest step of a counter, and its share of all steps.

    A counter that stands still, as in a packet that came twice, is no step.

    Parameters
    ----------
    counts : ndarray of uint16, shape (n,)
        In order of arrival.

    Returns
    -------
    step : int
        The smallest of those that are equally common; 1 where there is none.
    share : float
        From 0, where there is no step, to 1.
    """
    steps = _going(counts.astype(np.int64))
    steps = steps[steps > 0]
    if not steps.size:
        return 1, 0.0
    number = np.bincount(steps)
    return int(number.argmax()), float(number.max() / steps.size)


@dataclass(frozen=True)
class Ticks:
    """Ticks of some samples.

    Parameters
    ----------
    kept : ndarray of bool, shape (n,)
        False for a sample that came a second time.
    ticks : ndarray of int64, shape (m,)
        Of those that are kept, strictly increasing; neighbours differ by one where nothing is
        missing between them.
    """

    kept: NDArray[np.bool_]
    ticks: NDArray[np.int64]


class Unwrapper:
    """Turns the counter of one connection into ticks, the first of which is 0.

    Parameters
    ----------
    step : int
        By how much the counter goes on from sample to sample, such as that of :func:`modal_step`.
    rate : float
        Samples a second, as far as it is known; what the host's clock is compared with.

    Attributes
    ----------
    missing : int
        Samples that are missing between those that came.
    doubled : int
        Samples that came a second time.
    jumps : int
        How often the counter made no sense and the host's clock was taken instead.
    """

    def __init__(self, step: int, rate: float) -> None:
        self.missing = self.doubled = self.jumps = 0
        self._step, self._rate = step, rate
        self._tick: int | None = None
        self._count = 0
        self._arrived: float | None = None
        self._resumed = False

    def resume(self, step: int, rate: float) -> None:
        """Go on with a counter that was started again, as after a cable was unplugged.

        The host's clock decides how many samples are missing before the next one.
        """
        self._step, self._rate, self._resumed = step, rate, True

    def feed(self, counts: NDArray[np.uint16], arrived: NDArray[np.float64] | None = None) -> Ticks:
        """Ticks of the next samples.

        Parameters
        ----------
        counts : ndarray of uint16, shape (n,)
            The device's counter.
        arrived : ndarray of float64, shape (n,), optional
            When each arrived, in seconds of the host's clock. Without it the counter is believed
            whatever it says: it went on by less than one turn.
        """
        if not len(counts):
            return Ticks(np.zeros(0, np.bool_), np.zeros(0, np.int64))
        first = self._tick is None
        before = int(counts[0]) - self._step if first else self._count
        going = _going(np.concatenate([[before], counts]))
        on = np.maximum((going + self._step // 2) // self._step, 1)
        on[going == 0] = 0
        if arrived is not None:
            self._ask_the_clock(going, on, arrived)
        if first:
            on[0] = 1
        kept = on > 0
        start = -1 if self._tick is None else self._tick
        ticks = start + np.cumsum(on)[kept]
        self.doubled += int(np.sum(~kept))
        if ticks.size:
            self.missing += int(ticks[-1]) - start - len(ticks)
            self._tick = int(ticks[-1])
        self._count = int(counts[-1])
        self._arrived = None if arrived is None else float(arrived[-1])
        return Ticks(kept, ticks)

    def _ask_the_clock(
        self, going: NDArray[np.int64], on: NDArray[np.int64], arrived: NDArray[np.float64]
    ) -> None:
        """Put right, in place, what the counter alone cannot tell."""
        last = arrived[0] if self._arrived is None else self._arrived
        elapsed = np.diff(arrived, prepend=last)
        expected = np.maximum(elapsed, 0.0) * self._rate * self._step
        doubtful = (going == 0) | (going > TURN // 2) | (expected > TURN // 2)
        if self._resumed:
            on[0] = max(1, round(expected[0] / self._step))
            doubtful[0] = self._resumed = False
        for i in np.flatnonzero(doubtful):
            turns = max(0, round((expected[i] - going[i]) / TURN))
            total = int(going[i]) + turns * TURN
            if total == 0:
                on[i] = 0
            elif abs(total - expected[i]) <= TURN // 2:
                on[i] = max(1, round(total / self._step))
            else:
                on[i] = max(1, round(expected[i] / self._step))
                self.jumps += 1


def _going(counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """By how much a counter went on from one to the next, less than a turn."""
    going: NDArray[np.int64] = np.remainder(np.diff(counts), np.int64(TURN))
    return going
