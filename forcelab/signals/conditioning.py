"""What is done to a channel before it is transformed, so that no input can break the transform.

Missing samples are bridged, the median is taken away (every wavelet has zero mean, so nothing is
lost and a constant gives exactly nothing), and the rest is scaled by a power of two, which is
exact, so that neither squares nor sums can overflow or underflow.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forcelab.sample_runs import marked_runs

#: Differences below this share of a channel's size come from the rounding of float64. Its size is
#: the largest value but for one in :data:`RARE`: a glitch must not pass all else for rounding.
ROUNDING, RARE = 64 * float(np.finfo(np.float64).eps), 64
#: So many times a channel's usual size, in so few samples in a row, is no force but a glitch: no
#: converter tells as many sizes apart. Usual sizes below 1, in the channel's unit, count as 1: the
#: rounding of a channel at rest is no size that an impact may be compared with.
GLITCH, SPIKE = 1e9, 3
#: Samples that are conditioned at once: with many short channels most of the time goes into calls.
TOGETHER = 1 << 17
#: The share of a channel's changes that stay below what is taken for the step of its values.
STEP_SHARE = 0.1


@dataclass(frozen=True, slots=True)
class Conditioned:
    """Channels ready for transforming."""

    #: (c, n), ``(x - median) / 2**exponent``, with absolute values below 2; all zero for a
    #: constant.
    values: NDArray[np.float64]
    #: (c,), the power of two taken out of each channel; 0 for a constant channel.
    exponent: NDArray[np.int64]
    #: (c,), standard deviation of each channel's white noise, in units of `values`; ``noise *
    #: 2**exponent`` is in the unit of the channel.
    noise: NDArray[np.float64]


def bridge(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Replace non-finite samples by straight lines; beyond the ends the nearest sample holds."""
    finite = np.isfinite(x)
    if finite.all():
        return x
    if not finite.any():
        return np.zeros_like(x)
    index = np.arange(x.size)
    return np.interp(index, index[finite], x[finite])


def glitches(channel: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which samples of a channel are no force but a glitch, shape (n,).

    A glitch is up to :data:`SPIKE` samples in a row that are further from the channel's median than
    :data:`GLITCH` units, and :data:`GLITCH` times as far as all but one in :data:`RARE` of its
    samples. The rounding of one could be louder than the force all along a recording, and the
    narrowest wavelets, which ring for ever, would hear nothing else.

    `channel` (n,): what is not finite is missing already, and no glitch.
    """
    glitching = np.zeros(len(channel), dtype=bool)
    finite = np.isfinite(channel)
    # Nothing is further from the median than twice the largest: as good as always the answer.
    highest, lowest = (f(channel, where=finite, initial=0.0) for f in (np.max, np.min))
    if max(highest, -lowest) <= GLITCH / 2:
        return glitching
    values = channel[finite]
    with np.errstate(over="ignore"):
        away = np.abs(values - np.median(values))
        glitching[finite] = away > GLITCH * max(1.0, float(robust_peak(away)))
    return in_short_runs(glitching)


def in_short_runs(marked: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """What was found in at most :data:`SPIKE` samples in a row, shape (n,) as `marked`."""
    runs = marked_runs(marked)
    short = marked.copy()
    for first, last in runs[runs[:, 1] - runs[:, 0] > SPIKE].tolist():
        short[first:last] = False
    return short


def noise_level(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Estimate the standard deviation of white noise along the last axis.

    From the median absolute second difference, which a slow signal and rare impacts leave alone;
    the variance of a second difference of white noise is six times its own. Where half of the
    second differences or more are zero, as of counts that mostly repeat, it is the noise of
    rounding: the step between values over the square root of 12.

    `values` (..., n): finite, below 1e307. Gives (...): in the unit of `values`; 0 for fewer than
    three samples and where nothing ever changes.

    Second differences of rounded values are multiples of the step: their median is nothing, or
    gives more than the noise of rounding. So the step matters in the first case only, and a
    smooth signal, whose differences are small but not nothing, is never taken for a rounded one.
    The step is the size that a tenth of the changes stay below: the least of them would be left
    to chance where rounded samples were joined by straight lines.
    """
    if values.shape[-1] < 3:
        return np.zeros(values.shape[:-1])
    flat = np.ascontiguousarray(values.reshape(-1, values.shape[-1]))
    # All channels at once: live, with a thousand samples each, most of the time goes into calls.
    typical = np.median(np.abs(np.diff(flat, n=2)), axis=1)
    levels = typical * (1.482602218505602 / np.sqrt(6.0))
    for i in np.flatnonzero(typical <= ROUNDING * np.max(np.abs(flat), axis=1)):
        rounding = ROUNDING * float(robust_peak(flat[i]))
        if typical[i] <= rounding:
            levels[i] = _rounding_noise(flat[i], rounding)
    return np.asarray(levels, dtype=np.float64).reshape(values.shape[:-1])


def robust_peak(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """The largest absolute value along the last axis but for one in :data:`RARE`, shape (...)."""
    n = values.shape[-1]
    place = n - 1 - n // RARE
    return np.asarray(np.partition(np.abs(values), place, axis=-1)[..., place], dtype=np.float64)


def _rounding_noise(channel: NDArray[np.float64], rounding: float) -> float:
    """The noise level of a channel whose second differences are mostly within its rounding."""
    changes = np.abs(np.diff(channel))
    changes = changes[changes > rounding]
    if changes.size == 0:
        return 0.0
    return float(np.quantile(changes, STEP_SHARE, method="lower")) / np.sqrt(12.0)


def condition(x: ArrayLike, *, noise_known: bool = False) -> Conditioned:
    """Prepare channels for a transform.

    `x` (c, n): any real type, byte order and memory layout; NaN and infinity mark missing samples.
    Where the noise is known it is not estimated: that takes half of the time.
    """
    values = np.array(x, dtype=np.float64, order="C", ndmin=2)
    exponent, noise = np.zeros(len(values), dtype=np.int64), np.zeros(len(values))
    together = max(1, TOGETHER // max(values.shape[1], 1))
    for c in range(0, len(values), together):
        channels = slice(c, c + together)
        part = values[channels]
        # Scaled before anything is subtracted: a difference of numbers near 1e308 overflows.
        peak = np.max(np.abs(part), axis=1, where=np.isfinite(part), initial=0.0)
        first = np.frexp(peak)[1].astype(np.int64)
        np.ldexp(part, -first[:, np.newaxis], out=part)
        for channel in part:
            channel[:] = bridge(channel)
        # Before the median is gone: the larger it is, the coarser the rounding.
        level = np.zeros(len(part)) if noise_known else noise_level(part)
        part -= np.median(part, axis=1, keepdims=True)
        rest = np.max(np.abs(part), axis=1)
        second = np.frexp(rest)[1].astype(np.int64)
        np.ldexp(part, -second[:, np.newaxis], out=part)
        noise[channels] = np.ldexp(level, -second)
        exponent[channels] = np.where(rest > 0, first + second, 0)
    return Conditioned(values, exponent, noise)
