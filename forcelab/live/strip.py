"""A picture that grows to the right: columns of time in a ring, and colours' range that is calm."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Ring", "Strip"]

Real = NDArray[np.float64]
Sizes = NDArray[np.float32]

#: Decades from the first to the last colour at most, and the share of values below the last.
DECADES, TOP = 3.0, 0.998
#: Decades by which the last colour's value falls with each picture, where less would do, and by how
#: many it may stay above: after a glitch of many decades the rest must not wait for it to fall.
CALM, ABOVE = 0.02, 2.0


@dataclass(frozen=True, eq=False)
class Strip:
    """The last seconds, as they are known.

    Parameters
    ----------
    start, end : float
        Seconds at the edges of the first and the last column, on the clock of the stream.
    values : ndarray of float32, shape (rows, columns)
        Decimal logarithms of magnitudes; NaN where nothing is known.
    hertz : ndarray, shape (rows,)
        The frequency of each row, falling.
    complete : ndarray, shape (rows,)
        The time (s) up to which each row is complete.
    low, high : float
        For the first and the last colour.
    """

    start: float
    end: float
    values: Sizes
    hertz: Real
    complete: Real
    low: float
    high: float


class Ring:
    """Columns of the last seconds.

    Parameters
    ----------
    rows, columns : int
    width : float
        Seconds of a column; they stand at multiples of it.
    """

    def __init__(self, rows: int, columns: int, width: float) -> None:
        self._columns, self._width = columns, width
        self._values = np.full((rows, columns), np.nan, dtype=np.float32)
        self._newest = -1
        # Of each source the newest column of each row that it wrote to: a second block of one
        # column joins the first one, another source's better estimate replaces it.
        self._open: list[NDArray[np.int64]] = []
        self._high = -np.inf

    @property
    def seconds(self) -> float:
        """That are shown."""
        return self._columns * self._width

    def reach(self, until: float) -> None:
        """Time goes on: columns up to there are empty."""
        newest = int(np.floor(until / self._width))
        if newest > self._newest:
            first = max(self._newest + 1, newest - self._columns + 1)
            self._values[:, np.arange(first, newest + 1) % self._columns] = np.nan
            self._newest = newest

    def write(self, rows: NDArray[np.int64], times: Real, sizes: Sizes, source: int) -> None:
        """Write the largest magnitude in each column, in place of what was there before.

        Parameters
        ----------
        rows : ndarray of int, shape (k,)
        times : ndarray, shape (k, n)
            Increasing along each row; NaN of what is not to be written.
        sizes : ndarray, shape (k, n)
        source : int
            Who writes, from 0; what the same one wrote into a column before counts, too.
        """
        ages = self._newest - np.floor(times / self._width)
        row, at = np.nonzero((ages >= 0) & (ages < self._columns))  # not so of NaN
        if not len(row):
            return
        places = self._newest - ages[row, at].astype(np.int64)
        firsts = np.flatnonzero(np.diff(row, prepend=-1) | np.diff(places, prepend=-1))
        largest = np.maximum.reduceat(sizes[row, at], firsts)
        target, places = rows[row[firsts]], places[firsts]
        columns = places % self._columns
        while len(self._open) <= source:
            self._open.append(np.full(len(self._values), -1, dtype=np.int64))
        joined = self._open[source][target] == places
        before = self._values[target[joined], columns[joined]]
        largest[joined] = np.fmax(largest[joined], before)
        self._open[source][target] = places  # the last of each row stays
        self._values[target, columns] = largest

    def strip(self, hertz: Real, complete: Real) -> Strip:
        """The picture as it is now; parameters as of :class:`Strip`."""
        order = np.arange(self._newest - self._columns + 1, self._newest + 1)
        sizes = self._values[:, order % self._columns]
        with np.errstate(divide="ignore"):
            values = np.log10(sizes)
        known = values[np.isfinite(values)]
        if known.size:
            high = float(np.partition(known, place := int(TOP * (known.size - 1)))[place])
            self._high = max(high, min(self._high - CALM, high + ABOVE))
        high = self._high if np.isfinite(self._high) else 0.0
        start = float(order[0]) * self._width
        return Strip(start, start + self.seconds, values, hertz, complete, high - DECADES, high)
