"""What is done to a channel before it is transformed, so that no input can break the transform.

Missing samples are bridged, the median is taken away (every wavelet has zero mean, so nothing is
lost and a constant gives exactly nothing), and the rest is scaled by a power of two, which is
exact, so that neither squares nor sums can overflow or underflow.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["Conditioned", "condition", "noise_level"]


@dataclass(frozen=True, slots=True)
class Conditioned:
    """Channels ready for transforming.

    Parameters
    ----------
    values : ndarray of float64, shape (c, n)
        ``(x - median) / 2**exponent``, with absolute values below 2; all zero for a constant.
    exponent : ndarray of int, shape (c,)
        The power of two taken out of each channel; 0 for a constant channel.
    noise : ndarray of float64, shape (c,)
        Standard deviation of each channel's white noise, in units of `values`.
    """

    values: NDArray[np.float64]
    exponent: NDArray[np.int64]
    noise: NDArray[np.float64]


def bridge(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Replace non-finite samples by straight lines; beyond the ends the nearest sample holds."""
    good = np.isfinite(x)
    if good.all():
        return x
    if not good.any():
        return np.zeros_like(x)
    index = np.arange(x.size)
    return np.interp(index, index[good], x[good])


def noise_level(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Estimate the standard deviation of white noise along the last axis.

    From the median absolute second difference, which a slow signal and rare impacts leave alone;
    the variance of a second difference of white noise is six times its own.

    Parameters
    ----------
    values : ndarray, shape (..., n)

    Returns
    -------
    ndarray, shape (...)
        In the unit of `values`; 0 for fewer than three samples.
    """
    if values.shape[-1] < 3:
        return np.zeros(values.shape[:-1])
    second = np.abs(np.diff(values, 2, axis=-1))
    return np.median(second, axis=-1) * (1.482602218505602 / np.sqrt(6.0))


def condition(x: ArrayLike) -> Conditioned:
    """Prepare channels for a transform.

    Parameters
    ----------
    x : array_like of real numbers, shape (c, n), n >= 1
        Any real type, byte order and memory layout; NaN and infinity mark missing samples.

    Returns
    -------
    Conditioned
    """
    values = np.array(x, dtype=np.float64, order="C", ndmin=2)
    exponent = np.zeros(len(values), dtype=np.int64)
    for c, channel in enumerate(values):
        # Scaled before anything is subtracted: a difference of numbers near 1e308 overflows.
        peak = float(np.max(np.abs(channel), where=np.isfinite(channel), initial=0.0))
        first = int(np.frexp(peak)[1])
        scaled = bridge(np.ldexp(channel, -first))
        scaled -= np.median(scaled)
        rest = float(np.max(np.abs(scaled)))
        second = int(np.frexp(rest)[1]) if rest > 0 else 0
        values[c] = np.ldexp(scaled, -second)
        exponent[c] = first + second if rest > 0 else 0
    return Conditioned(values, exponent, noise_level(values))
