"""Copies of held channels at lower rates, each made from the one before.

A copy's values are Gaussian means of the finer one, so that what it loses is known and can be
divided out again: after several of them the variances of the Gaussians have added up.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from forcelab.signals.engine.segments import held

__all__ = ["ROW", "Copies", "Smoothing", "gaussian_means", "mean_weights"]

Real = NDArray[np.float64]

#: Means that one row of the matrix product gives, and samples that are smoothed at once.
ROW = 16
CHUNK = 1 << 16


@dataclass(frozen=True)
class Smoothing:
    """How copies are made, and which of them there are.

    Parameters
    ----------
    steps : tuple of int
        Samples between the values of each copy: 1, rising, each a multiple of the one before.
    width : float
        Of the Gaussians, in steps of the copy that they make.
    half : int
        Half-width in the same steps, beyond which they are left away.
    """

    steps: tuple[int, ...]
    width: float
    half: int

    def variance(self, step: int) -> float:
        """Of all Gaussians that a copy went through together, in samples squared."""
        return float(sum((self.width * made) ** 2 for made in self.steps if 1 < made <= step))


@dataclass(frozen=True)
class _Copy:
    """Values at every `step` samples from sample `first` on; the end values hold for ever."""

    values: Real
    step: int
    first: int


class Copies:
    """All copies of some channels, made when they are first asked for.

    Parameters
    ----------
    values : ndarray, shape (c, n)
    smoothing : Smoothing
    """

    def __init__(self, values: Real, smoothing: Smoothing) -> None:
        self._smoothing = smoothing
        self._made = [_Copy(values, 1, 0)]

    @property
    def original(self) -> Real:
        """The channels themselves."""
        return self._made[0].values

    def held(self, step: int, start: int, count: int) -> Real:
        """Values at every `step` samples from sample `start`, a multiple of it, shape (c, count).

        Before the first and after the last sample the end values hold.
        """
        while self._made[-1].step < step:
            finer = self._made[-1]
            coarser = self._smoothing.steps[len(self._made)]
            self._made.append(_smoothed(finer, coarser // finer.step, self._smoothing))
        copy = next(made for made in self._made if made.step == step)
        begin = (start - copy.first) // step
        return held(copy.values, begin, begin + count)


def _smoothed(finer: _Copy, ratio: int, smoothing: Smoothing) -> _Copy:
    """Gaussian means at every `ratio` values.

    ``y_m = sum_n G(n - m R) x_n`` with ``G(t) = exp(-t^2 / 2 sigma^2) / sqrt(2 pi) sigma``.
    """
    half, step = smoothing.half, finer.step * ratio
    c, n = finer.values.shape
    # From where on all that a mean is taken of is the first value, to where it is the last.
    first = finer.first // step - half
    last = -(-(finer.first + n * finer.step) // step) + half
    rows = -(-(last - first + 1) // ROW)
    matrix = mean_weights(ratio, half, smoothing.width * ratio)
    begin = (first - half) * ratio - finer.first // finer.step
    out = gaussian_means(
        lambda start, stop: held(finer.values, begin + start, begin + stop),
        c,
        rows,
        ratio,
        matrix,
    )
    return _Copy(out, step, first * step)


def gaussian_means(
    values: Callable[[int, int], Real], channels: int, rows: int, ratio: int, matrix: Real
) -> Real:
    """Weighted means at every `ratio` values, :data:`ROW` in a row of a matrix product.

    Parameters
    ----------
    values : callable
        Gives the values ``[start, stop)``, shape (channels, stop - start), counted from the first
        one that a mean is taken of.
    channels, rows, ratio : int
    matrix : ndarray
        From :func:`mean_weights`.

    Returns
    -------
    ndarray, shape (channels, rows * ROW)
    """
    out = np.empty((channels, rows * ROW))
    beyond = len(matrix) - ROW * ratio
    together = max(1, CHUNK // (ROW * ratio))
    for row in range(0, rows, together):
        chosen = min(together, rows - row)
        start = row * ROW * ratio
        part = values(start, start + chosen * ROW * ratio + beyond)
        # Each row of the left factor begins ROW means after the one before, and overlaps it.
        strides = (part.strides[0], ROW * ratio * part.strides[1], part.strides[1])
        shape = (channels, chosen, len(matrix))
        windows = np.lib.stride_tricks.as_strided(part, shape, strides, writeable=False)
        means = np.ascontiguousarray(windows).reshape(-1, len(matrix)) @ matrix
        out[:, row * ROW : (row + chosen) * ROW] = means.reshape(channels, -1)
    return out


@cache
def mean_weights(ratio: int, half: int, sigma: float) -> Real:
    """Weights of ``(ROW + 2 half) ratio`` values in each of ROW means."""
    places = np.arange((ROW + 2 * half) * ratio)[:, None] - ratio * (half + np.arange(ROW))
    weights = np.exp(-0.5 * (places / sigma) ** 2) / (math.sqrt(2 * math.pi) * sigma)
    return np.where(np.abs(places) <= half * ratio, weights, 0.0)
