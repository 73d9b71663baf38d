"""The continuous wavelet transform by products in Fourier space.

``W(a, b) = a^-1/2 sum_n x_n conj(psi((n - b) / a))`` for scales `a` in samples. Before the first
and after the last sample the end values hold. This is the plain and exact way;
:mod:`forcelab.signals.cwt_engine` gives the same to a tolerance, many times as fast.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import fft

from forcelab.errors import InputError
from forcelab.signals.conditioning import condition
from forcelab.signals.cwt_engine import laid_into_ring, ring_length, ring_response
from forcelab.signals.wavelets import Morlet, Wavelet

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def geometric_scales(first: float = 2.0, last: float = 1024.0, spacing: float = 1.0) -> Real:
    """Scales ``first * 2**(j * spacing)``, up to and with `last`.

    `first`, `last`: smallest and largest scale, in samples; `spacing`: distance of neighbouring
    scales in octaves (the method's dj). Gives (k,): scales in samples, rising.
    """
    if not (0 < first <= last < np.inf and 0 < spacing < np.inf):
        raise InputError(
            f"The smallest scale and the spacing must be more than 0, and the largest scale no "
            f"smaller than the smallest; not {first:g} to {last:g} samples every {spacing:g} "
            f"octaves."
        )
    # The small allowance lets 2 .. 1024 end at 1024 whatever the rounding of the logarithm.
    steps = int(np.floor(np.log2(last / first) / spacing + 1e-9))
    return np.asarray(first * 2.0 ** (np.arange(steps + 1) * spacing), dtype=np.float64)


def usual_scales(n: int, first: float = 2.0, spacing: float = 1.0) -> Real:
    """All scales of a recording of `n` samples: ``J = log2(n / first) / spacing`` steps."""
    return geometric_scales(first, max(float(n), first), spacing)


def frequencies(scales: ArrayLike, rate: float, wavelet: Wavelet) -> Real:
    """Frequencies in Hz that the scales answer to most.

    `scales` (k,): in samples. Gives (k,).
    """
    return rate / (wavelet.fourier_factor * np.asarray(scales, dtype=np.float64))


def transform_channels(values: Real, scales: Real, wavelet: Wavelet) -> Complex:
    """Transform conditioned channels; :func:`cwt` is the safe way in.

    `values` (c, n): finite, moderate in size, as from
    :func:`forcelab.signals.conditioning.condition`; `scales` (k,): in samples. Gives (c, k, n).
    """
    c, n = values.shape
    out = np.empty((c, len(scales), n), dtype=np.complex128)
    # Narrow wavelets pay for no padding: each length has the scales that fit into it.
    lengths: dict[int, list[int]] = {}
    for j, scale in enumerate(scales):
        lengths.setdefault(ring_length(n, scale, wavelet.radius), []).append(j)
    for length, members in lengths.items():
        spectrum = fft.fft(laid_into_ring(values, length), axis=-1)
        for j in members:
            response = ring_response(wavelet, scales[j], length)
            out[:, j] = fft.ifft(spectrum * response, axis=-1, overwrite_x=True)[:, :n]
    if wavelet.real:
        # What rounding leaves there would flip the phase of negatives between pi and -pi.
        out.imag = 0.0
    return out


def cwt(x: ArrayLike, scales: Sequence[float] | Real, wavelet: Wavelet | None = None) -> Complex:
    """Continuous wavelet transform of one channel.

    Parameters
    ----------
    x : array_like of real numbers, shape (n,), n >= 1
        Samples at a uniform rate. NaN and infinity mark missing samples, bridged by straight
        lines.
    scales : array_like, shape (k,)
        In samples, positive, in any order.
    wavelet : Wavelet, optional
        The Morlet with p = 5 by default.

    Returns
    -------
    ndarray of complex128, shape (k, n)
        ``W(a, b)`` in the unit of `x`; the imaginary part is zero for real wavelets.

    Raises
    ------
    InputError
        If `x` is empty or not one channel, or a scale is not positive.

    Notes
    -----
    Frequencies above the Nyquist frequency are cut from the wavelet, not folded back.
    """
    channel = np.asarray(x)
    sizes = np.atleast_1d(np.asarray(scales, dtype=np.float64))
    if channel.ndim != 1 or channel.size == 0:
        raise InputError(f"One channel of at least one sample is needed, not {channel.shape}.")
    if sizes.ndim != 1 or not np.all((sizes > 0) & np.isfinite(sizes)):
        raise InputError("Scales are positive numbers of samples.")
    ready = condition(channel[np.newaxis])
    coefficients = transform_channels(ready.values, sizes, wavelet or Morlet())[0]
    # Multiplying by 2.0**e would overflow for exponents near 1024 where the product does not.
    for part in (coefficients.real, coefficients.imag):
        np.ldexp(part, int(ready.exponent[0]), out=part)
    return coefficients
