"""The engine for channels as they come: any numbers, any gaps, in the unit of the channel."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forcelab.errors import InputError
from forcelab.signals.conditioning import condition
from forcelab.signals.engine.plan import plan_for
from forcelab.signals.wavelets import Wavelet

__all__ = ["log_polar", "transform"]

Real = NDArray[np.float64]


def transform(
    x: ArrayLike,
    scales: Sequence[float] | Real,
    wavelet: Wavelet | None = None,
    tolerance: float = 1e-7,
    *,
    workers: int = 1,
) -> NDArray[np.complex128]:
    """Coefficients of channels, like :func:`forcelab.signals.cwt.cwt` but to a tolerance.

    Parameters
    ----------
    x : array_like of real numbers, shape (c, n)
        Of any type, size and layout; NaN and infinity are bridged by straight lines.
    scales : array_like, shape (k,)
        In samples, positive, in any order.
    wavelet : Wavelet, optional
        The Morlet with p = 5 by default.
    tolerance : float
        1e-3, 1e-5, 1e-7, 1e-10 or 1e-14, relative to the largest coefficient of a scale.
    workers : int
        Threads.

    Returns
    -------
    ndarray of complex128, shape (c, k, n)
        In the unit of `x`. Double precision holds magnitudes from 1e-300 to 1e300.

    Raises
    ------
    InputError
        If `x` is empty or not channels, a scale is not positive or the tolerance is unknown.

    Notes
    -----
    The ends of the band cut a little off a slow strong force too: by up to the tolerance times a
    fiftieth of the channel's range times the root of the scale, which is more than the tolerance
    where all coefficients of a scale are smaller than that. Of a ramp of fifty scales and more it
    is a two hundredth of that at p = 5, as straight lines are taken away. Interpolating in single
    precision, for tolerances from 1e-7 on, adds up to 2e-7.
    """
    ready = condition(_channels(x))
    plan = plan_for(ready.values.shape[1], scales, wavelet, tolerance)
    found = plan.coefficients(ready.values, workers=workers).astype(np.complex128)
    for part in (found.real, found.imag):
        np.ldexp(part, ready.exponent[:, None, None], out=part)
    return found


def log_polar(
    x: ArrayLike,
    scales: Sequence[float] | Real,
    wavelet: Wavelet | None = None,
    tolerance: float = 1e-7,
    *,
    workers: int = 1,
) -> tuple[NDArray[np.floating[Any]], NDArray[np.floating[Any]]]:
    """Log magnitudes and phases of channels; parameters and errors as of :func:`transform`.

    Returns
    -------
    magnitudes, phases : ndarray of float32 or float64, shape (c, k, n)
        Always finite. Natural logarithms of magnitudes in the unit of `x`, raised to the rounding
        of the transform where they are below it; the phase, in radians, is 0 there.
    """
    ready = condition(_channels(x))
    plan = plan_for(ready.values.shape[1], scales, wavelet, tolerance)
    shift = np.asarray(ready.exponent * math.log(2.0), dtype=np.float64)
    return plan.log_polar(ready.values, shift=shift, workers=workers)


def _channels(x: ArrayLike) -> NDArray[Any]:
    """`x` as channels of at least one sample."""
    channels = np.asarray(x)
    if channels.ndim != 2 or channels.size == 0:
        raise InputError(
            f"Channels of at least one sample, shape (channels, samples), are needed, "
            f"not {channels.shape}."
        )
    return channels
