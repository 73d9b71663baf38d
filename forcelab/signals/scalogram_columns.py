"""Columns of the screen on the grid, and the largest power in each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["Columns"]

Real = NDArray[np.float64]
Single = NDArray[np.float32]
Whole = NDArray[np.int64]

#: Times and rates round; an edge that is so little past a sample is taken for the sample.
_ROUNDING = 1e-6


class Columns:
    """Columns of the screen on the grid.

    Parameters
    ----------
    first : float
        Left edge of the first, in samples of the grid.
    width : float
        Samples a column, at least 1.
    count : int
        How many.
    """

    def __init__(self, first: float, width: float, count: int) -> None:
        self.first, self.width, self.count = first, width, count

    @property
    def last(self) -> float:
        """Right edge of the last one."""
        return self.first + self.width * self.count

    def edges(self) -> Real:
        """Edges in samples, shape (count + 1,)."""
        return np.asarray(self.first + self.width * np.arange(self.count + 1), dtype=np.float64)

    def bounds(self) -> Whole:
        """The first sample of each column, and the one after the last column."""
        bounds = np.ceil(self.edges() - _ROUNDING).astype(np.int64)
        # A column of one sample that rounding has lost takes the one before it.
        bounds[-1] = max(bounds[-1], bounds[0] + 1)
        return bounds

    def centres(self) -> Whole:
        """The sample in the middle of each column, shape (count,)."""
        return np.floor(self.first + self.width * (np.arange(self.count) + 0.5) + 1e-9).astype(
            np.int64
        )

    def largest(self, power: Single, start: int, step: int) -> Single:
        """The largest power in each column.

        Parameters
        ----------
        power : ndarray of float32, shape (s, m)
            At the samples ``start + i step``, from one in or before the first column to one
            beyond the last. Between two of them powers lie on a straight line.
        start, step : int

        Returns
        -------
        ndarray of float32, shape (s, count)
        """
        bounds = self.bounds() - start
        firsts, lasts = bounds[:-1], np.maximum(bounds[1:] - 1, bounds[:-1])
        if step == 1:
            return np.maximum.reduceat(power[:, : lasts[-1] + 1], firsts, axis=1)
        low, high = -(-firsts // step), lasts // step + 1
        out = np.maximum(_read(power, firsts, step), _read(power, lasts, step))
        # Columns without a point of their own are told by their ends alone.
        inner = np.flatnonzero(low < high)
        if inner.size:
            # The points of one column end where those of the next one begin.
            found = np.maximum.reduceat(power[:, : high[inner[-1]]], low[inner], axis=1)
            out[:, inner] = np.maximum(out[:, inner], found)
        return out


def _read(power: Single, samples: Whole, step: int) -> Single:
    """Powers at samples between points."""
    left, rest = np.divmod(samples, step)
    share = (rest / step).astype(np.float32)
    before = power[:, left]
    after = power[:, np.minimum(left + 1, power.shape[1] - 1)]
    after -= before
    after *= share
    after += before
    return after
