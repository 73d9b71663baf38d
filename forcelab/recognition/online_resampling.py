"""Steps of a uniform grid as they come, brought from one rate to another."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

__all__ = ["Resampling", "Steps"]

Real = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Steps:
    """Consecutive steps of the grid.

    Parameters
    ----------
    times : ndarray of float64, shape (n,)
        Seconds.
    signals : ndarray of float64, shape (n, c)
        Finite.
    valid : ndarray of bool, shape (n,)
    """

    times: Real
    signals: Real
    valid: Flags

    def __len__(self) -> int:
        return len(self.times)

    @classmethod
    def none(cls, columns: int) -> Steps:
        """No step at all."""
        return cls(np.empty(0), np.empty((0, columns)), np.empty(0, dtype=bool))

    def __add__(self, other: Steps) -> Steps:
        return Steps(
            np.concatenate([self.times, other.times]),
            np.concatenate([self.signals, other.signals]),
            np.concatenate([self.valid, other.valid]),
        )

    def __getitem__(self, which: slice) -> Steps:
        return Steps(self.times[which], self.signals[which], self.valid[which])


class Resampling:
    """From one even rate to another, as :func:`forcelab.signals.grid.on_grid` does.

    Straight lines to a higher rate; to a lower one the low-pass filter of
    :func:`scipy.signal.resample_poly` with the same window.

    Parameters
    ----------
    columns : int
    ratio : float
        Rows in for one row out.
    """

    def __init__(self, columns: int, ratio: float) -> None:
        if ratio <= 1:
            self.ratio, self._reach = ratio, 1
            self._up, self._down, self._taps = 1, 1, None
        else:
            from scipy.signal import firwin  # takes a second to load

            exact = Fraction(ratio).limit_denominator(max(1, int(1000 / ratio)))
            self._up, self._down = exact.denominator, exact.numerator
            self.ratio = self._down / self._up
            half = 10 * self._down
            shape = firwin(2 * half + 1, 1 / self._down, window=("kaiser", 8.0)) * self._up
            self._reach = math.ceil(half / self._up) + 1
            offsets = np.arange(-self._reach, self._reach + 1)
            places = np.arange(self._up)[:, None] - offsets * self._up + half
            inside = (places >= 0) & (places <= 2 * half)
            self._taps = np.where(inside, shape[np.clip(places, 0, 2 * half)], 0.0)
        self.lag = math.ceil(self._reach / self.ratio)
        self._rows = Steps.none(columns)
        self._first = 0  # number of the first row that is kept
        self._made = 0

    def push(self, rows: Steps, ended: bool) -> Steps:
        """The rows out whose surroundings are there."""
        if not self._first and not len(self._rows) and len(rows):
            self._rows = _repeated(rows[:1], self._reach)
            self._first = -self._reach
        rows = self._rows + rows
        if not len(rows):
            return rows
        count = self._first + len(rows)  # rows that came in all
        last = count - 1
        if ended:
            rows = rows + _repeated(rows[-1:], self._reach)
            final = (
                math.floor(last / self.ratio + 1e-6)
                if self._taps is None
                else math.ceil(count / self.ratio - 1e-9) - 1
            )
        else:
            final = math.floor((last - self._reach) / self.ratio - 1e-9)
        numbers = np.arange(self._made, max(self._made, final + 1))
        out = self._at(rows, numbers, last)
        self._made += len(numbers)
        keep = math.floor(self._made * self.ratio) - self._reach - self._first
        keep = min(max(keep, 0), len(rows))
        self._first += keep
        self._rows = rows[keep:]
        return out

    def _at(self, rows: Steps, numbers: NDArray[np.int64], last: int) -> Steps:
        """The rows out of these numbers."""
        places = numbers * self.ratio
        if self._taps is None:
            whole = np.minimum(np.floor(places + 1e-9).astype(np.int64), last)
        else:
            whole = (numbers * self._down) // self._up
        share = np.maximum(places - whole, 0.0)
        here = whole - self._first
        after = np.minimum(here + 1, len(rows) - 1)
        times = rows.times[here] + share * (rows.times[after] - rows.times[here])
        # Behind the last row all stamps are the last one's.
        valid = np.where(share < 0.5, rows.valid[here], rows.valid[after])
        if self._taps is None:
            signals = rows.signals[here] + share[:, None] * (
                rows.signals[after] - rows.signals[here]
            )
        else:
            around = here[:, None] + np.arange(-self._reach, self._reach + 1)
            taps = self._taps[(numbers * self._down) % self._up]
            signals = np.einsum("mt,mtc->mc", taps, rows.signals[around])
        return Steps(times, signals, valid)


def _repeated(row: Steps, count: int) -> Steps:
    """One row, several times."""
    return Steps(
        np.repeat(row.times, count),
        np.repeat(row.signals, count, axis=0),
        np.repeat(row.valid, count),
    )
