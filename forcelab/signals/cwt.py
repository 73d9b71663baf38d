"""The continuous wavelet transform by products in Fourier space.

``W(a, b) = a^-1/2 sum_n x_n conj(psi((n - b) / a))`` for scales `a` in samples. Before the first
and after the last sample the end values hold. This is the plain and exact way;
:mod:`forcelab.signals.cwt_engine` gives the same to a tolerance, many times as fast.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import fft

from forcelab.arrays import Real
from forcelab.errors import InputError
from forcelab.signals.conditioning import condition
from forcelab.signals.cwt_engine import laid_into_ring, ring_length, ring_response
from forcelab.signals.wavelets import Morlet, Wavelet

Complex = NDArray[np.complex128]

#: A wavelet cut at the Nyquist frequency rings for ever; it is followed for this many samples.
RINGING = 512
#: Scales that were heard after a sample, and the error of its coefficient with the last value held
#: from there on, for a Morlet with p = 5: root mean square over that of the coefficients, as on the
#: paper's recordings, to a tenth up to 3 scales and to a fifth beyond. On random walks it is up to
#: a tenth less. Of white noise, whose last value tells nothing, it is up to three times as much at
#: a scale of 32 samples, six times at 128.
HEARD = (
    (0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0),
    (0.74, 0.51, 0.29, 0.13, 0.048, 0.013, 3.0e-3, 7e-5, 6e-7),
)


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


def reaches(scales: Real, wavelet: Wavelet, tolerance: float) -> NDArray[np.int64]:
    """Samples to each side of a coefficient that matter, shape (k,).

    `scales` (k,): in samples. What lies further off weighs less than 0.4 of `tolerance`, as a share
    of the wavelet's peak; for a Morlet that is 3.9 scales at 1.4e-3, 4.8 at 3e-5, 5.6 at 3e-7.
    """
    t = np.linspace(0.0, wavelet.radius, 20_001)
    size = np.maximum(np.abs(wavelet.time(t)), np.abs(wavelet.time(-t)))
    half_width = float(t[np.flatnonzero(size > 0.4 * tolerance * np.max(size))[-1]])
    return np.array([_reach(a, wavelet, half_width, tolerance) for a in scales.tolist()], np.int64)


def _reach(scale: float, wavelet: Wavelet, half_width: float, tolerance: float) -> int:
    """The reach in samples of a wavelet of that half-width in scales; longer if it rings."""
    wide = math.ceil(half_width * scale)
    n = 1 << max(14, math.ceil(math.log2(4 * wavelet.radius * scale)))
    response = ring_response(wavelet, scale, n)
    top = n // 2
    # Not at the Nyquist frequency alone: the Haar wavelet's spectrum has zeros.
    cut = np.abs(response[top - top // 8 : top + top // 8])
    if wide >= RINGING or np.max(cut) <= tolerance * np.max(np.abs(response)):
        return wide
    # What is left out must be quiet by its energy, for the ringing falls so slowly that many
    # samples of noise are heard together.
    energy = np.abs(fft.ifft(response)[: top + 1]) ** 2
    beyond = np.append(np.cumsum(energy[::-1])[::-1][1:], 0.0)
    return max(wide, min(int(np.argmax(beyond <= tolerance**2 * energy.sum())), RINGING))


def early_error(heard: ArrayLike) -> Real:
    """The expected error of coefficients with the last value held, see :data:`HEARD`.

    `heard`: time heard after the sample, in scales, at least 0.
    """
    at = np.clip(np.asarray(heard, dtype=np.float64), 0.0, HEARD[0][-1])
    return np.exp(np.interp(at, HEARD[0], np.log(HEARD[1])))


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

    Examples
    --------
    >>> forcelab.cwt(np.sin(np.arange(256) / 5), [8.0, 16.0]).shape
    (2, 256)
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
