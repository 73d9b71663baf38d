"""What the latency of live recognition is spent on, and what it leaves to be estimated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from forcelab.recognition.online_filters import CausalDrop
from forcelab.recognition.recogniser import Recogniser

__all__ = ["TOLERANCE", "Budget", "Early", "budget_of", "limits_of"]

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
        Steps that resampling, wavelets and the two filters look ahead.
    """

    grid: int
    features: int
    median: int
    drop: int

    @property
    def total(self) -> int:
        """All of them."""
        return self.grid + self.features + self.median + self.drop


def limits_of(recogniser: Recogniser) -> dict[int, float]:
    """The least seconds of each code that the drop heuristic keeps."""
    share = recogniser.settings.drop
    if share is None:
        return {}
    return {
        code: share * recogniser.shortest[action]
        for code, action in enumerate(recogniser.actions)
        if action in recogniser.shortest
    }


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
    width = recogniser.settings.median
    median = min((width - 1) // 2, total // 2) if width is not None else 0
    need = CausalDrop.needed(limits_of(recogniser), period)
    drop = min(need, max(0, total // 2 - median))
    return Budget(grid, total - median - drop, median, drop)
