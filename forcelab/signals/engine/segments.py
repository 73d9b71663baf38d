"""Parts of channels whose end values hold for ever, and copies of them at a lower rate."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

__all__ = ["Segments", "held", "smoothed"]

Real = NDArray[np.float64]
#: Gives the samples ``[start, stop)`` of all channels; numbers below 0 and past the end are fine.
Segments = Callable[[int, int], Real]

#: Samples that are smoothed at once.
CHUNK = 1 << 19


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


def smoothed(values: Real, step: int, sigma: float, half: int, start: int, count: int) -> Real:
    """Gaussian means of held channels at every `step` samples.

    ``y_m = sum_n G(n - start - m step) x_n`` with
    ``G(t) = exp(-t^2 / 2 sigma^2) / sqrt(2 pi) sigma``.

    Parameters
    ----------
    values : ndarray, shape (c, n)
    step : int
        R, samples.
    sigma : float
        Of the Gaussian, samples.
    half : int
        Half-width of the Gaussian in steps.
    start : int
        Sample of the first mean.
    count : int
        Of means.

    Returns
    -------
    ndarray, shape (c, count)
    """
    c, n = values.shape
    offsets = np.arange(step)[:, None] + step * np.arange(-half, half)
    weights = np.exp(-0.5 * (offsets / sigma) ** 2) / (math.sqrt(2 * math.pi) * sigma)
    out = np.empty((c, count))
    # Only means near the signal need its samples; those away from it are of one value.
    first = min(max(-(start // step) - half - 1, 0), count)
    last = min(max((n - start) // step + half + 2, first), count)
    total = float(weights.sum())
    out[:, :first] = values[:, :1] * total
    out[:, last:] = values[:, -1:] * total
    rows = max(1, CHUNK // step)
    for m in range(first, last, rows):
        size = min(rows, last - m)
        begin = start + (m - half) * step
        part = held(values, begin, begin + (size + 2 * half) * step)
        # Each stretch of R samples counts for 2 `half` means, with weights of its own for each.
        shares = part.reshape(c, size + 2 * half, step) @ weights
        out[:, m : m + size] = sum(shares[:, j : j + size, j] for j in range(2 * half))
    return out
