"""What is kept of a stream: its newest samples, and decimated copies that reach further back."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from forcelab.signals.streaming_kernels import HALF, low_pass

__all__ = ["CHUNK", "Tape", "Tapes", "level_of"]

Real = NDArray[np.float64]

#: Samples that are worked on at once; larger blocks are cut at its multiples, so that memory stays
#: bounded. There the base is chosen anew, from every :data:`SPARSE`-th sample of the last ones.
CHUNK, SPARSE = 1024, 8
#: Binary exponents of samples beyond which their products with the weights could overflow, or lose
#: digits. What lies beyond is scaled by a power of two, which is exact.
SAFE = 900


def level_of(latest: Real) -> Real:
    """The base that follows :data:`CHUNK` samples, (CHUNK, c): a glitch among them moves nothing.

    Were it one sample, and that the glitch, what comes next would lose the glitch's rounding.
    """
    # An odd number of samples: no mean of two, which could overflow.
    return np.asarray(np.median(latest[SPARSE::SPARSE], axis=0), dtype=np.float64)


class Tape:
    """The newest rows of an endless table, in one piece of memory.

    Parameters
    ----------
    rows : int
        How many of the newest rows must stay readable.
    columns : int
    """

    def __init__(self, rows: int, columns: int) -> None:
        self._kept = rows
        self._table = np.zeros((2 * rows + 2 * CHUNK, columns))
        self._end = rows
        #: Rows that were ever written.
        self.written = 0

    def append(self, rows: Real) -> None:
        """Add rows at the end, at most :data:`CHUNK`."""
        end = self._end + len(rows)
        if end > len(self._table):
            self._table[: self._kept] = self._table[self._end - self._kept : self._end]
            self._end, end = self._kept, self._kept + len(rows)
        self._table[self._end : end] = rows
        self._end = end
        self.written += len(rows)

    def view(self, first: int, last: int) -> Real:
        """Rows ``[first, last)`` by their number; numbers before 0 are rows of zeros."""
        shift = self._end - self.written
        return self._table[first + shift : last + shift]

    def windows(self, first: int, length: int, step: int, count: int) -> Real:
        """Views of `length` rows from `first` on, every `step` rows; shape (count, length, c).

        They overlap in memory and are for reading only.
        """
        table = self._table
        if first + (count - 1) * step + length > self.written or first < self.written - self._end:
            raise IndexError("these rows are not on the tape")
        down, across = table.strides
        # Not sliding_window_view, which takes longer to check its arguments than to do the sums.
        return np.ndarray(
            (count, length, table.shape[1]),
            table.dtype,
            table,
            (first + self._end - self.written) * down,
            (step * down, down, across),
        )

    def lower(self, by: Real) -> None:
        """Subtract from all rows that can still be read."""
        self._table[max(0, self._end - self._kept - CHUNK) : self._end] -= by

    def shift(self, exponent: int) -> None:
        """Multiply all rows by a power of two."""
        np.ldexp(self._table, exponent, out=self._table)


class Tapes:
    """A stream of samples at its full rate, and decimated.

    Parameters
    ----------
    channels : int
    rows : int
        Samples that must stay readable before each chunk.
    coarse : mapping of int to int
        The same of each decimated copy, by its step.

    Attributes
    ----------
    fine : Tape
        ``(samples - base) / 2**exponent``, where the base follows the samples slowly: a level far
        from zero would leave the rounding of large numbers in the products.
    coarse : dict of int to Tape
        The copies, at multiples of their steps; they begin with what their filter sees before the
        start, :data:`~forcelab.signals.streaming_kernels.HALF` samples.
    exponent : int
        0 unless samples are as large or as small as nearly to leave the range of float64.
    """

    def __init__(self, channels: int, rows: int, coarse: Mapping[int, int]) -> None:
        self._filters = {step: low_pass(step) for step in coarse}
        widest = max((len(taps) + step for step, taps in self._filters.items()), default=0)
        self.fine = Tape(max(1, rows, widest) + CHUNK, channels)
        self.coarse = {
            step: Tape(kept + HALF + CHUNK // step + 2, channels) for step, kept in coarse.items()
        }
        self.exponent = 0
        self._base: Real | None = None
        self._peak = 0.0
        #: The newest sample of all; None before the first.
        self.last: Real | None = None

    def take(self, samples: Real, peak: float) -> None:
        """Write finite samples, at least one, none beyond the next multiple of :data:`CHUNK`.

        `peak` is the largest absolute value among them, or among more that come with them.
        """
        if peak > self._peak:
            self._peak = peak
            self._scale()
        rows = samples if self.exponent == 0 else np.ldexp(samples, -self.exponent)
        written = self.fine.written
        if self._base is None:
            self._base = rows[0].copy()
        elif written % CHUNK == 0:
            shift = level_of(self.fine.view(written - CHUNK, written))
            for tape in (self.fine, *self.coarse.values()):
                tape.lower(shift)
            self._base = self._base + shift
        self.fine.append(rows - self._base)
        for step, tape in self.coarse.items():
            self._decimate(step, tape)
        self.last = samples[-1].copy()

    def _scale(self) -> None:
        """Choose the exponent for the largest sample so far, and bring all there is to it."""
        size = int(np.frexp(self._peak)[1])
        wanted = 0 if abs(size) <= SAFE else size // 64 * 64  # not anew for every larger sample
        by = self.exponent - wanted
        if by == 0:
            return
        self.exponent = wanted
        for tape in (self.fine, *self.coarse.values()):
            tape.shift(by)
        if self._base is not None:
            self._base = np.ldexp(self._base, by)

    def _decimate(self, step: int, tape: Tape) -> None:
        """Write the decimated samples, at multiples of `step`, whose filter has all its samples."""
        filter_ = self._filters[step]
        half = len(filter_) // 2
        first, last = tape.written - HALF, (self.fine.written - 1 - half) // step + 1
        if last > first:
            tape.append(
                filter_ @ self.fine.windows(first * step - half, len(filter_), step, last - first)
            )
