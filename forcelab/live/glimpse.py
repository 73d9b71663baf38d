"""The last seconds of live labels with their certainty, as a view shows them."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.labels import Segment
from forcelab.live.segments import Growing, Recognised
from forcelab.recognition.certainty import RATE, Certainty
from forcelab.recognition.online import Decided

__all__ = ["Glimpse", "Recent"]

#: Seconds that are kept for views.
SECONDS = 15.0


@dataclass(frozen=True, eq=False)
class Glimpse:
    """What was recognised last; never changed, so that any thread may look at it.

    Parameters
    ----------
    segments : tuple of Segment
        Of the last seconds, on the host's monotonic clock; the last one may still grow.
    certainty : Certainty or None
        Of the same time; None of a classifier without probabilities.
    until : float
        The time (s) up to which labels are decided; NaN while there are none.
    action : str
        Of the latest label; empty where that is unlabelled.
    probabilities : tuple of float
        Of each action the recogniser knows, over the latest labels; empty where they are unknown.
    cost : float
        Share of one core that recognising has taken of late.
    """

    segments: tuple[Segment, ...] = ()
    certainty: Certainty | None = None
    until: float = math.nan
    action: str = ""
    probabilities: tuple[float, ...] = ()
    cost: float = 0.0


class Recent:
    """Gathers what a :class:`Glimpse` shows; memory is taken once.

    Parameters
    ----------
    actions : tuple of str, length K
    """

    def __init__(self, actions: tuple[str, ...]) -> None:
        self._actions = actions
        self._length = math.ceil(SECONDS * RATE)
        self._sums = np.zeros((self._length, len(actions)))
        self._counts = np.zeros(self._length)
        self._newest: int | None = None  # bin since the clock's zero
        self._segments: deque[Segment] = deque()
        self._latest: tuple[float, ...] = ()

    def take(self, decided: Decided, ended: list[Recognised]) -> None:
        """Take in labels and the segments that they ended."""
        self._segments.extend(one.segment for one in ended)
        if not len(decided):
            return
        while self._segments and self._segments[0].end < decided.times[-1] - SECONDS:
            self._segments.popleft()
        if decided.probabilities is None:
            return
        times = decided.times
        kept = times > times[-1] - SECONDS + 1.0
        self._latest = tuple(decided.probabilities[-1].tolist())
        self._add(np.floor(times[kept] * RATE).astype(np.int64), decided.probabilities[kept])

    def end(self, growing: Growing) -> None:
        """The segment that grows ends here: another recogniser goes on."""
        present = growing.present
        if present is not None:
            self._segments.append(present.segment)
        self._latest = ()

    def glimpse(self, growing: Growing, cost: float) -> Glimpse:
        """What is to be seen now."""
        present = growing.present
        segments = (*self._segments, *(() if present is None else (present.segment,)))
        return Glimpse(
            segments, self._certainty(), growing.until, growing.action, self._latest, cost
        )

    def _add(self, bins: NDArray[np.int64], probabilities: NDArray[np.float64]) -> None:
        """Add probabilities to their bins; bins that nobody filled are empty."""
        last = int(bins[-1])
        if self._newest is not None and last > self._newest:
            fresh = np.arange(max(self._newest + 1, last - self._length + 1), last + 1)
            self._sums[fresh % self._length] = 0.0
            self._counts[fresh % self._length] = 0.0
        self._newest = last
        np.add.at(self._sums, bins % self._length, probabilities)
        np.add.at(self._counts, bins % self._length, 1.0)

    def _certainty(self) -> Certainty | None:
        """The means, from the oldest bin to the newest."""
        if self._newest is None:
            return None
        bins = np.arange(self._newest - self._length + 1, self._newest + 1)
        rows = bins % self._length
        means = self._sums[rows] / np.maximum(self._counts[rows], 1.0)[:, None]
        values = np.rint(255.0 * np.clip(means, 0.0, 1.0)).astype(np.uint8)
        return Certainty(float(bins[0]) / RATE, RATE, self._actions, values)
