"""The last seconds of a device as upright lines, one a column of the screen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.reader import FORCE_NAME
from forcelab.demonstration import Channel

__all__ = ["Scale", "columns_of", "least_span"]

Real = NDArray[np.float64]

#: A step between samples longer than so many periods, and at least so many seconds, is a gap.
GAP_PERIODS, GAP = 5.0, 0.02
#: Least span of a lane, so that noise looks like noise: in units of force and torque, of a force in
#: raw counts, and of anything else; share of it that is left free at either end.
LEASTS = {
    "N": 0.2, "mN": 200.0, "kN": 2e-4, "g": 20.0, "kg": 0.02,
    "Nm": 0.01, "N m": 0.01, "Nmm": 10.0, "N mm": 10.0, "mNm": 10.0, "mN m": 10.0,
}  # fmt: skip
COUNTS, LEAST, FREE = 100.0, 0.2, 0.12
#: A lane is scaled down where less than this share of it was needed for so many seconds.
NEEDED, CALM = 0.4, 2.0


def columns_of(times: Real, values: Real, edges: Real, holds: bool = False) -> tuple[Real, Real]:
    """The least and the greatest value of each channel in each column.

    Parameters
    ----------
    times : ndarray of float64, shape (n,)
        Seconds, increasing (a little jitter does no harm).
    values : ndarray of float64, shape (n, c)
    edges : ndarray of float64, shape (k + 1,)
        Seconds at the edges of the columns.
    holds : bool
        Whether a value holds until the next one, however long that takes.

    Returns
    -------
    low, high : ndarray of float64, shape (k, c)
        NaN where a column holds nothing. A column begins with the sample before it, so that its
        line joins up with its neighbour's; not across a gap.
    """
    n, k = len(times), len(edges) - 1
    if n == 0:
        nothing = np.full((k, values.shape[1]), np.nan)
        return nothing, nothing
    places = np.maximum.accumulate(np.searchsorted(times, edges))
    first, last = places[:-1], places[1:]
    longest = np.inf
    if not holds:
        period = float(np.median(np.diff(times[-200:]))) if n > 1 else 0.0
        longest = max(GAP_PERIODS * period, GAP)
    following = np.where(first < n, times[np.minimum(first, n - 1)], np.inf if not holds else 0.0)
    joined = (first > 0) & (following - times[np.maximum(first - 1, 0)] <= longest)
    begin = np.where(joined, first - 1, first)
    padded = np.concatenate([values, np.full((1, values.shape[1]), np.nan)])
    pairs = np.stack([begin, last], axis=1).ravel()
    low = np.fmin.reduceat(padded, pairs, axis=0)[::2]
    high = np.fmax.reduceat(padded, pairs, axis=0)[::2]
    empty = begin >= last
    low[empty] = high[empty] = np.nan
    return low, high


def least_span(channel: Channel) -> float:
    """The least span of a channel's lane, in its unit: what noise is small in."""
    if not channel.unit and FORCE_NAME.fullmatch(channel.name):
        return COUNTS
    return LEASTS.get(channel.unit, LEAST)


class Scale:
    """The span of a lane: grows at once, and shrinks only after a while.

    Parameters
    ----------
    least : float
        The least span, see :func:`least_span`.

    Attributes
    ----------
    low, high : float
        Values at the lane's lower and upper edge.
    """

    def __init__(self, least: float = LEAST) -> None:
        self._least = least
        self.low, self.high = -1.0, 1.0
        self._fresh = True
        self._needed_at = -np.inf

    def fit(self, low: float, high: float, now: float) -> None:
        """Take in what is to be seen now.

        Parameters
        ----------
        low, high : float
            Least and greatest value; NaN where there is none.
        now : float
            Seconds of a clock that never jumps.
        """
        if not (np.isfinite(low) and np.isfinite(high)):
            return
        span = max(high - low, self._least)
        if span >= NEEDED * (self.high - self.low):
            self._needed_at = now
        beyond = low < self.low or high > self.high
        if self._fresh or beyond or now - self._needed_at > CALM:
            middle, half = (low + high) / 2, (0.5 + FREE) * span
            if beyond and not self._fresh and now - self._needed_at <= CALM:
                self.low = min(self.low, middle - half)
                self.high = max(self.high, middle + half)
            else:
                self.low, self.high = middle - half, middle + half
            self._fresh, self._needed_at = False, now
