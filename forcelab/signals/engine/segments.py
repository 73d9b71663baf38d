"""Parts of channels whose end values hold for ever, and the straight lines through their ends."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["held", "without_line"]

Real = NDArray[np.float64]


def held(values: Real, start: int, stop: int) -> Real:
    """Samples ``[start, stop)``; before the first and after the last the end values hold.

    Parameters
    ----------
    values : ndarray, shape (c, n)
    start, stop : int

    Returns
    -------
    ndarray, shape (c, stop - start)
        A view where no end value is needed.
    """
    n = values.shape[1]
    if start >= 0 and stop <= n:
        return values[:, start:stop]
    out = np.empty((len(values), stop - start))
    first, last = min(max(-start, 0), stop - start), min(max(n - start, 0), stop - start)
    out[:, :first] = values[:, :1]
    out[:, first:last] = values[:, start + first : start + last]
    out[:, last:] = values[:, -1:]
    return out


def without_line(parts: Real) -> tuple[Real, Real]:
    """Take away the straight line through the first and the last value of each part.

    The ring that a part is transformed in would turn the line into a jump.

    Parameters
    ----------
    parts : ndarray, shape (..., m)

    Returns
    -------
    rest : ndarray, shape (..., m)
    slopes : ndarray, shape (..., 1)
        Of the lines, from value to value.
    """
    last = parts.shape[-1] - 1
    slopes = (parts[..., -1:] - parts[..., :1]) / last
    rest = slopes * np.arange(last + 1)
    rest += parts[..., :1]
    return np.subtract(parts, rest, out=rest), slopes
