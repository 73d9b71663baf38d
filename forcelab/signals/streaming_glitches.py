"""The glitches of a stream: told as soon as the samples after them are there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from forcelab.signals.conditioning import GLITCH, RARE, SPIKE, robust_peak

__all__ = ["CausalGlitches"]

Real = NDArray[np.float64]


class CausalGlitches:
    """Takes the glitches out of a stream, as :func:`~forcelab.signals.conditioning.glitches` would.

    What is usual is what the :data:`~forcelab.signals.conditioning.RARE` samples before a glitch
    were like, and it is measured from the last of them: a stream does not know its median.

    Parameters
    ----------
    columns : int
    """

    def __init__(self, columns: int) -> None:
        self._past = np.full((RARE, columns), np.nan)

    def push(self, values: Real, ended: bool) -> tuple[Real, int]:
        """Mark glitches.

        Parameters
        ----------
        values : ndarray, shape (n, columns)
            Those that were not settled the last time, and what came since; NaN where missing.
        ended : bool
            Whether nothing will follow.

        Returns
        -------
        values : ndarray, shape (n, columns)
            With NaN for glitches.
        settled : int
            The first so many; the rest is to be pushed again, with what follows.
        """
        series = np.concatenate([self._past, values])
        settled = len(values)
        # Exact, and as good as always the answer: nothing is as far from anything else.
        if not series.max() - series.min() <= GLITCH:  # or a sample is missing
            apart = np.fmax.reduce(series) - np.fmin.reduce(series)
            for column in np.flatnonzero(apart > GLITCH).tolist():
                settled = min(settled, _without(series[:, column], ended))
        self._past = series[settled : settled + RARE].copy()
        return series[RARE:], settled


def _without(series: Real, ended: bool) -> int:
    """Put NaN for the glitches behind the first `RARE` values; how many of these are settled."""
    first, n = RARE, len(series)
    doubtful = _doubtful(series).tolist()
    while first < n:
        wild = 0
        if doubtful[first]:
            wild = _wild(series[first - RARE : first], series[first : first + SPIKE + 1])
        if 0 < wild <= SPIKE:
            behind = first + wild
            if behind == n and not ended:
                return first - RARE
            series[first:behind] = np.nan
            doubtful[behind : behind + SPIKE] = [True] * SPIKE  # other samples precede them now
        first += max(wild, 1)
    return n - RARE


def _doubtful(series: Real) -> NDArray[np.bool_]:
    """Which values are to be looked at: all that are wild, and few others.

    A glitch is further from the value before it than :data:`GLITCH` times the nearer of the two
    before that: what is usual leaves out one value at most. Where one is missing it may be.
    """
    last = series[2:-1]
    usual = np.minimum(np.abs(series[1:-2] - last), np.abs(series[:-3] - last))
    calm = np.abs(series[3:] - last) <= GLITCH * np.maximum(usual, 1.0)
    return np.concatenate([np.ones(3, dtype=bool), ~calm])


def _wild(before: Real, ahead: Real) -> int:
    """How many of the next values are too far from those before, one after the other."""
    known = before[np.isfinite(before)]
    if len(known) <= RARE // 2:  # nobody knows what is usual
        return 0
    usual = max(1.0, float(robust_peak(known - known[-1])))
    near = np.abs(ahead - known[-1]) <= GLITCH * usual
    near |= np.isnan(ahead)
    return int(np.argmax(near)) if near.any() else len(ahead)
