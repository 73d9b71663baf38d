"""Features of every time step: log magnitudes and phases of the wavelet transform.

The vector of one time step with q channels and k scales is
``[M_1 .. M_q, phi_1 .. phi_q]``, where ``M_i`` and ``phi_i`` are the k log magnitudes and the k
phases of channel i. Each time step is then an example of its own.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from forcelab.signals.conditioning import condition
from forcelab.signals.cwt import frequencies, transform_channels
from forcelab.signals.wavelets import Wavelet

__all__ = ["feature_names", "features"]

#: Magnitudes are floored at this share of the channel's noise: far below what white noise gives.
NOISE_SHARE = 1e-3
#: The smallest floor, as a share of the channel's amplitude: above the rounding of the transform.
ROUNDING = 1e-13


def features(
    channels: NDArray[np.float64],
    scales: NDArray[np.float64],
    wavelet: Wavelet,
    phase: bool = True,
) -> NDArray[np.float64]:
    """Compute the features of every time step.

    Parameters
    ----------
    channels : ndarray, shape (q, n)
        Recognition channels on a uniform grid; NaN and infinity are bridged.
    scales : ndarray, shape (k,)
        In samples.
    wavelet : Wavelet
    phase : bool
        Whether to append the phases.

    Returns
    -------
    ndarray of float64, shape (n, q * k) or (n, 2 * q * k)
        Always finite. Natural logarithms of magnitudes in the unit of the channel, phases in
        radians in [-pi, pi].

    Notes
    -----
    The transform of white noise of standard deviation s has magnitudes of about s at every scale
    (the wavelets have unit energy), so that the floor stands in relation to the channel's noise.
    Where a magnitude is at its floor the phase means nothing and is 0. A channel without any
    variation has the floor of one of amplitude 1.
    """
    q, n = channels.shape
    k = len(scales)
    out = np.empty(((2 if phase else 1) * q * k, n))
    for i, channel in enumerate(channels):
        # A channel at a time: the coefficients of one stay small beside the features of all.
        ready = condition(channel)
        coefficients = transform_channels(ready.values, scales, wavelet)[0]
        floor = np.maximum(NOISE_SHARE * ready.noise[0], ROUNDING * np.sqrt(scales))[:, np.newaxis]
        power = coefficients.real**2 + coefficients.imag**2
        quiet = power <= floor**2
        magnitude = out[i * k : (i + 1) * k]
        np.log(np.maximum(power, floor**2), out=magnitude)
        magnitude *= 0.5
        magnitude += ready.exponent[0] * np.log(2.0)
        if phase:
            angle = out[(q + i) * k : (q + i + 1) * k]
            np.arctan2(coefficients.imag, coefficients.real, out=angle)
            angle[quiet] = 0.0
    return np.ascontiguousarray(out.T)


def feature_names(
    channels: tuple[str, ...],
    scales: NDArray[np.float64],
    wavelet: Wavelet,
    rate: float,
    phase: bool = True,
) -> tuple[str, ...]:
    """Name the columns of :func:`features`, such as ``log magnitude, normal 1, 12.43 Hz``."""
    hertz = frequencies(scales, rate, wavelet)
    kinds = ("log magnitude", "phase") if phase else ("log magnitude",)
    return tuple(
        f"{kind}, {channel}, {hz:.4g} Hz" for kind in kinds for channel in channels for hz in hertz
    )
