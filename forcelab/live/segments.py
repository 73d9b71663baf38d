"""Labels that come one after the other, as segments: those that have ended, and one that grows."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from forcelab.demonstration import GAP_PERIODS
from forcelab.labels import UNLABELLED, Segment
from forcelab.recognition.online import Decided, OnlineRecogniser

__all__ = ["Growing", "Recognised"]


@dataclass(frozen=True)
class Recognised:
    """A segment whose end is decided.

    Parameters
    ----------
    start, end : float
        Seconds of the host's monotonic clock.
    action : str
    probability : float
        Mean over its samples; NaN of a classifier that has none.
    """

    start: float
    end: float
    action: str
    probability: float

    @property
    def segment(self) -> Segment:
        """Without its probability."""
        return Segment(self.start, self.end, self.action)


class Growing:
    """Segments of labels that come in their order.

    Parameters
    ----------
    online : OnlineRecogniser
        Which gives the labels.

    Attributes
    ----------
    action : str
        Of the latest label; empty where that is unlabelled, or there is none yet.
    probability : float
        Of that action; NaN where it is not known.
    """

    def __init__(self, online: OnlineRecogniser) -> None:
        self._online = online
        self.action, self.probability = "", math.nan
        self._code = UNLABELLED
        self._start = self._last = math.nan
        self._sum, self._count = 0.0, 0

    @property
    def until(self) -> float:
        """The time up to which labels are decided; NaN while there are none."""
        return self._last + self._period

    @property
    def present(self) -> Recognised | None:
        """The segment that has not ended, as far as it is decided."""
        if self._code == UNLABELLED:
            return None
        return Recognised(self._start, self.until, self.action, self._sum / self._count)

    def take(self, decided: Decided) -> list[Recognised]:
        """Take in labels; gives the segments that they end."""
        if not len(decided):
            return []
        times, codes = decided.times, decided.codes
        sure = np.full(len(codes), np.nan)
        if decided.probabilities is not None:
            rows = np.arange(len(codes))
            sure = np.where(codes >= 0, decided.probabilities[rows, np.maximum(codes, 0)], np.nan)
        before = np.concatenate([[self._last], times[:-1]])
        parted = times - before > GAP_PERIODS * self._period
        changed = codes != np.concatenate([[self._code], codes[:-1]])
        found = []
        edges = [0, *np.flatnonzero(parted | changed).tolist(), len(codes)]
        for first, last in pairwise(edges):
            if first == last:
                continue
            if parted[first] or changed[first]:
                gone = float(before[first]) + self._period
                found += self._closed(gone if parted[first] else float(times[first]))
                self._code, self._start = int(codes[first]), float(times[first])
                self._sum, self._count = 0.0, 0
            self._sum += float(sure[first:last].sum())
            self._count += last - first
        self._last = float(times[-1])
        unlabelled = self._code == UNLABELLED
        self.action = "" if unlabelled else self._online.actions[self._code]
        self.probability = math.nan if unlabelled else float(sure[-1])
        return found

    def finish(self) -> list[Recognised]:
        """The segment that has not ended, which ends with the last label."""
        found = self._closed(self.until)
        self._code = UNLABELLED
        return found

    @property
    def _period(self) -> float:
        return self._online.step or 1.0 / self._online.recogniser.rate

    def _closed(self, end: float) -> list[Recognised]:
        if self._code == UNLABELLED:
            return []
        action = self._online.actions[self._code]
        return [Recognised(self._start, end, action, self._sum / self._count)]
