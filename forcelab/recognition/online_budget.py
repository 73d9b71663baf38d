"""What the latency of live recognition is spent on, and what it leaves to be estimated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from forcelab.recognition.live_part import hop_of, live_for, needs_whole
from forcelab.recognition.online_filters import CausalDrop
from forcelab.recognition.recogniser import Recogniser
from forcelab.recognition.windows import REACH
from forcelab.signals.streaming import reaches

__all__ = ["TOLERANCE", "Budget", "Early", "budget_of", "limits_of", "longest_gap"]

#: Error of complete coefficients, relative to the largest of their scale.
TOLERANCE = 3e-5


@dataclass(frozen=True)
class Early:
    """A scale that is estimated before its wavelet has passed.

    Parameters
    ----------
    scale : float
        In samples.
    hertz : float
        The frequency that it answers to most.
    seconds : float
        Time after which its wavelet would have passed.
    error : float
        Expected error, root mean square over that of its coefficients (Morlet, p = 5).
    """

    scale: float
    hertz: float
    seconds: float
    error: float


@dataclass(frozen=True)
class Budget:
    """What the latency is spent on, in steps of the grid.

    Parameters
    ----------
    grid, features, median, drop : int
        Steps that resampling, wavelets or windows, and the two filters look ahead.
    decoder : int
        Steps that the decoder looks ahead, where there is one.
    hold : int
        Steps from the first one that shares a label to the one that it is made for.
    """

    grid: int
    features: int
    median: int
    drop: int
    decoder: int = 0
    hold: int = 0

    @property
    def total(self) -> int:
        """All of them."""
        filters = self.median + self.drop + self.decoder
        return self.grid + self.features + filters + self.hold


def limits_of(recogniser: Recogniser) -> dict[int, float]:
    """The least seconds of each code that the drop heuristic keeps."""
    share = recogniser.settings.drop
    return {} if share is None else recogniser.least(share)


def longest_gap(recogniser: Recogniser) -> int:
    """Samples of a gap beyond which nothing is heard of what was before it.

    That is twice what the widest wavelet or window spans.
    """
    settings = recogniser.settings
    if needs_whole(settings):
        return int(2 * REACH * settings.windows[-1] * recogniser.rate) + 1
    return 2 * int(np.max(reaches(settings.scales, settings.mother, TOLERANCE))) + 1


def budget_of(recogniser: Recogniser, latency: float, period: float, grid: int = 0) -> Budget:
    """How a latency is shared.

    Parameters
    ----------
    recogniser : Recogniser
    latency : float
        Seconds.
    period : float
        Seconds between two steps.
    grid : int
        Steps that resampling takes.
    """
    total = max(0, int(np.floor(latency / period + 1e-6)) - grid)
    if needs_whole(recogniser.settings):
        return _of_part(recogniser, total, period, grid)
    width = recogniser.settings.median
    median = min((width - 1) // 2, total // 2) if width is not None else 0
    need = CausalDrop.needed(limits_of(recogniser), period)
    drop = min(need, max(0, total // 2 - median))
    return Budget(grid, total - median - drop, median, drop)


def _of_part(recogniser: Recogniser, total: int, period: float, grid: int) -> Budget:
    """How it is shared where a part for streams is asked, at every `hop` steps of the grid.

    Its label goes for the steps around, so that the first of them waits for half a hop longer:
    less than that cannot be had.
    """
    hop = hop_of(recogniser.settings, 1.0 / period)
    rest = max(0, total - hop // 2)
    part = live_for(recogniser.live, rest * period)
    look = round(part.windows.look / period)
    return Budget(grid, look, 0, 0, max(0, rest - look) // hop * hop, hop // 2)
