"""How a sweep makes one score of several segmentations': the best of them, or their sum."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

__all__ = ["Algebra", "Best", "Total"]

Real = NDArray[np.float64]

#: Stands for minus infinity where that cannot be subtracted.
SMALLEST = -1e300
#: Logarithms whose exponentials may stand beside each other: of more the smallest were lost.
RANGE = 600.0
#: Sums below this may have lost some.
TINY = 1e-250


class Algebra(Protocol):
    """How scores of several segmentations become one; k rows, of actions.

    Attributes
    ----------
    repeats : int
        Steps that may be found at once by repetition; 1 where joining a score twice counts twice.
    """

    repeats: bool

    def table(self, scores: Real) -> Any:
        """What :meth:`windows` takes of scores by length, shape (k, W)."""
        ...

    def windows(self, line: Real, strided: Real, table: Any, out: Real) -> Real:
        """Join ``strided[k, t, :] + table[k]``: shape (k, m).

        Parameters
        ----------
        line : ndarray, shape (k, n)
        strided : ndarray, shape (k, m, W)
            The same numbers: windows of the line, each begun one number after the one before.
        table
            As :meth:`table` gives it.
        out : ndarray, shape (k, m, W)
            To be written upon.
        """
        ...

    def join(self, one: Real, other: Real, out: Real) -> Real:
        """Join two of the same shape."""
        ...

    def running(self, scores: Real) -> Real:
        """Join all up to each column."""
        ...

    def order(self, follow: Real) -> Any:
        """What :meth:`follow` takes of which action follows which, shape (K, K)."""
        ...

    def follow(self, ends: Real, sums: Real, order: Any) -> Real:
        """Join over the action before, j: ``ends[j] + sums[j] + follow[j, k] - sums[k]``.

        Shapes (K, m), as is the result's.
        """
        ...


class Best:
    """The best of them."""

    repeats = True

    def table(self, scores: Real) -> Real:
        """One to be added to windows."""
        return scores[:, None, :]

    def windows(self, line: Real, strided: Real, table: Real, out: Real) -> Real:  # noqa: ARG002
        """The largest sums."""
        np.add(strided, table, out=out)
        return np.asarray(np.maximum.reduce(out, axis=2))

    def join(self, one: Real, other: Real, out: Real) -> Real:
        """The larger."""
        return np.maximum(one, other, out=out)

    def running(self, scores: Real) -> Real:
        """The running maximum."""
        return np.maximum.accumulate(scores, axis=1)

    def order(self, follow: Real) -> Real:
        """Shape (K, K, 1)."""
        return follow[:, :, None]

    def follow(self, ends: Real, sums: Real, order: Real) -> Real:
        """The largest sums."""
        found: Real = np.maximum.reduce((ends + sums)[:, None, :] + order, axis=0)
        found -= sums
        return found


class Total:
    """The sum of them, as a logarithm."""

    repeats = False

    def table(self, scores: Real) -> tuple[Real, Real, Real]:
        """The scores, their exponentials and the logarithms that these are relative to."""
        top = np.maximum(scores.max(axis=1, keepdims=True), SMALLEST)
        return scores, np.exp(scores - top), top

    def windows(self, line: Real, strided: Real, table: tuple[Real, Real, Real], out: Real) -> Real:
        """Logarithms of sums of exponentials."""
        scores, raised, top = table
        # Windows overlap: each number is raised once, relative to the largest of them all.
        unit = np.maximum(np.maximum.reduce(line, axis=1, keepdims=True), SMALLEST)
        below = line - unit
        every = np.exp(below)
        across = every.strides[1]
        stride = strided.strides[2] // strided.strides[1]
        strides = (every.strides[0], across, stride * across)
        windows = np.ndarray(strided.shape, every.dtype, every, 0, strides)
        sums = np.einsum("kmw,kw->km", windows, raised)
        if sums.min() < TINY and _lost(below):
            return self._apart(strided, scores, out)
        with np.errstate(divide="ignore"):
            np.log(sums, out=sums)
        sums += unit + top
        return np.asarray(sums)

    def _apart(self, strided: Real, scores: Real, out: Real) -> Real:
        """The same of numbers too far apart for one unit."""
        np.add(strided, scores[:, None, :], out=out)
        unit = np.maximum(out.max(axis=2, keepdims=True), SMALLEST)
        out -= unit
        np.exp(out, out=out)
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(out.sum(axis=2)) + unit[:, :, 0])

    def join(self, one: Real, other: Real, out: Real) -> Real:
        """The logarithm of the sum."""
        return np.logaddexp(one, other, out=out)

    def running(self, scores: Real) -> Real:
        """Running sums."""
        return np.logaddexp.accumulate(scores, axis=1)

    def order(self, follow: Real) -> tuple[Real, Real]:
        """The logarithms, shape (K, K, 1), and from the column's to the row's action themselves."""
        return follow[:, :, None], np.exp(follow).T.copy()

    def follow(self, ends: Real, sums: Real, order: tuple[Real, Real]) -> Real:
        """Logarithms of sums of exponentials."""
        logs, matrix = order
        before = ends + sums
        unit = np.maximum(np.maximum.reduce(before, axis=0), SMALLEST)
        below = before - unit
        found = matrix @ np.exp(below)
        if found.min() < TINY and _lost(below):
            every = before[:, None, :] + logs
            unit = np.maximum(every.max(axis=0), SMALLEST)
            found = np.exp(every - unit).sum(axis=0)
        with np.errstate(divide="ignore"):
            np.log(found, out=found)
        found += unit
        found -= sums
        return np.asarray(found)


def _lost(below: Real) -> bool:
    """Whether logarithms are so small that their exponentials count for nothing by mistake."""
    return bool(((below < -RANGE) & (below > SMALLEST)).any())
