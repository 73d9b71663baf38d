"""Features of every time step: log magnitudes and phases of the wavelet transform.

The vector of one time step with q channels and k scales is
``[M_1 .. M_q, phi_1 .. phi_q]``, where ``M_i`` and ``phi_i`` are the k log magnitudes and the k
phases of channel i. Each time step is then an example of its own.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.signals.conditioning import condition
from forcelab.signals.cwt_engine import plan_for
from forcelab.signals.wavelets import Wavelet

__all__ = ["features"]

#: Magnitudes are floored at this share of the channel's noise: far below what white noise gives.
NOISE_SHARE = 1e-3
#: The smallest floor, as a share of the channel's amplitude: above the rounding of the transform.
ROUNDING = 1e-13
#: Time steps that are turned from rows of scales into rows of steps at once: they fit the cache.
BLOCK = 1024


def features(
    channels: NDArray[np.float64],
    scales: NDArray[np.float64],
    wavelet: Wavelet,
    phase: bool = True,
    noise: NDArray[np.float64] | None = None,
    *,
    circular: bool = False,
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
    noise : ndarray, shape (q,), optional
        Standard deviation of each channel's noise in its own unit, not negative. By default it is
        estimated from `channels` by :func:`~forcelab.signals.conditioning.noise_level`; give it
        where features of several recordings, or of parts of one, must have the same floor.
    circular : bool
        Whether cosine and sine of the phase stand for the phase. Both fade to 0 towards the floor:
        times ``1 - (floor / magnitude)^2``.

    Returns
    -------
    ndarray of float64, shape (n, q * k), (n, 2 * q * k), or circular (n, 3 * q * k)
        Always finite. Natural logarithms of magnitudes in the unit of the channel, phases in
        radians in [-pi, pi].

    Raises
    ------
    InputError
        If `noise` is not one number for each channel, finite and not negative.

    Notes
    -----
    The transform of white noise of standard deviation s has magnitudes of about s at every scale
    (the wavelets have unit energy), so that the floor stands in relation to the channel's noise:
    a thousandth of it, and never less than 1e-13 of the channel's amplitude. Where a magnitude is
    at its floor the phase means nothing and is 0. A channel without any variation has the floor
    of one of amplitude 1.
    """
    q, n = channels.shape
    k = len(scales)
    if noise is not None and not (noise.shape == (q,) and np.all((noise >= 0) & (noise < np.inf))):
        raise InputError(f"The noise of {q} channels is {q} finite numbers from 0, not {noise}.")
    out = np.empty((n, (1 + (2 if circular else 1) * phase) * q * k))
    for i, channel in enumerate(channels):
        # A channel at a time: the coefficients of one stay small beside the features of all.
        ready = condition(channel)
        coefficients = plan_for(n, scales, wavelet, 1e-14).coefficients(ready.values)[0]
        shift = ready.exponent[0] * np.log(2.0)
        with np.errstate(divide="ignore"):  # no noise has the logarithm -inf
            level = np.log(ready.noise[0]) if noise is None else np.log(noise[i]) - shift
        floor = np.maximum(np.log(NOISE_SHARE) + level, np.log(ROUNDING * np.sqrt(scales)))[:, None]
        for start in range(0, n, BLOCK):
            rows = slice(start, start + BLOCK)
            real, imaginary = coefficients.real[:, rows], coefficients.imag[:, rows]
            power = np.maximum(real**2 + imaginary**2, np.finfo(np.float64).tiny)
            magnitude = 0.5 * np.log(power)
            out[rows, i * k : (i + 1) * k] = (np.maximum(magnitude, floor) + shift).T
            if phase and circular:
                # The cosine is the real part over the magnitude, without an angle on the way.
                power = np.maximum(power, np.exp(2 * floor))
                fading = -np.expm1(2 * floor - np.log(power)) / np.sqrt(power)
                for kind, part in enumerate((real, imaginary), start=1):
                    first = (kind * q + i) * k
                    out[rows, first : first + k] = (part * fading).T
            elif phase:
                angle = np.arctan2(imaginary, real)
                angle[magnitude <= floor] = 0.0
                out[rows, (q + i) * k : (q + i + 1) * k] = angle.T
        del coefficients, real, imaginary  # before the next channel's are made
    return out
