"""Any wavelet at any scale: the whole recording in one ring.

For wavelets that are cut at the Nyquist frequency, which ring for ever, and for those without a
compact band. The ring is that of :mod:`forcelab.signals.cwt`, so that both give the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from forcelab.signals.engine.copies import Copies
from forcelab.signals.engine.long_ring import PARTS, from_spectrum, spectrum
from forcelab.signals.engine.sinks import Sink
from forcelab.signals.wavelets import Wavelet

__all__ = ["KEPT", "Ring", "laid_into_ring", "ring_length", "ring_part", "ring_response"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Samples over which the last value leads to the first, half-widths away from both. A jump there
#: would be heard at both ends by wavelets that are cut at the Nyquist frequency and ring for long.
RAMP = 64
#: Samples that are handed on at once.
SAMPLES = 1 << 14
#: Rings up to this length are transformed as a whole and have their responses kept.
KEPT = 1 << 18
#: Samples of rings that are transformed at once: FFTs of several rows are faster for each.
TOGETHER = 1 << 19


def ring_length(n: int, scale: float, radius: float) -> int:
    """Samples of the ring: the signal, one half-width beyond both ends, and what joins them."""
    need = n + 2 * int(np.ceil(radius * scale)) + RAMP
    if need > KEPT:
        return int(PARTS**2 * fft.next_fast_len(-(-need // PARTS**2), real=False))
    # A length without factors of 7 and 11 would be faster, but how a wavelet that is cut at the
    # Nyquist frequency rings depends on the length, and preset ``paper`` has one of those.
    return int(fft.next_fast_len(need, real=False))


def laid_into_ring(values: Real, length: int) -> Real:
    """Lay channels into a ring of `length`; across the gap the last value leads to the first."""
    n = values.shape[-1]
    ring = np.empty((*values.shape[:-1], length))
    ring[..., :n] = values
    ring[..., n:] = _across(values, length, np.arange(n, length))
    return ring


def _across(values: Real, length: int, places: NDArray[np.int64]) -> Real:
    """The ring's samples at places beyond the last."""
    n = values.shape[-1]
    ramp = np.clip(0.5 + (places - 0.5 * (n + length - 1)) / RAMP, 0.0, 1.0)
    share = 0.5 + 0.5 * np.cos(np.pi * ramp)
    return np.asarray(share * values[..., -1:] + (1 - share) * values[..., :1])


def ring_part(values: Real, length: int, begin: int, end: int) -> Real:
    """Samples ``[begin, end)`` of the rings of channels, round and round, shape (c, end - begin).

    A view where none of them lies in the gap.
    """
    n = values.shape[1]
    if begin >= 0 and end <= n:
        return values[:, begin:end]
    places = np.arange(begin, end) % length
    out = _across(values, length, places)
    inside = places < n
    out[:, inside] = values[:, places[inside]]
    return out


def _in_ring(values: Real, length: int, places: NDArray[np.int64]) -> Real:
    """The ring's samples of one channel at rising places."""
    beyond = int(np.searchsorted(places, len(values)))
    return np.concatenate([values[places[:beyond]], _across(values, length, places[beyond:])])


def ring_response(wavelet: Wavelet, scale: float, length: int) -> Complex:
    """By what the spectrum of a ring is multiplied at all frequencies of ``fftfreq``."""
    return _response(wavelet, scale, length, np.arange(length))


def _signed(numbers: NDArray[np.int64], length: int) -> NDArray[np.int64]:
    """Bins of a spectrum, the upper half as the negative frequencies that it stands for."""
    return np.where(2 * numbers >= length, numbers - length, numbers)


def _response(wavelet: Wavelet, scale: float, length: int, numbers: NDArray[np.int64]) -> Complex:
    """The same at some bins of the spectrum, which are counted from 0."""
    bins = _signed(numbers, length)  # whole numbers, so that the Nyquist bin is known for sure
    omega = 2 * np.pi * (bins / length)
    response = np.sqrt(scale) * np.conj(wavelet.spectrum(scale * omega))
    # The Nyquist bin stands for both signs of its frequency.
    both = wavelet.spectrum(scale * np.array([-np.pi, np.pi]))
    response[2 * np.abs(bins) == length] = np.sqrt(scale) * np.conj(both.mean())
    return np.asarray(response, dtype=np.complex128)


class Ring:
    """Some scales by products in the Fourier space of whole rings.

    Parameters
    ----------
    n : int
        Samples of a channel.
    scales : ndarray, shape (s,)
    members : sequence of int
        Their places among all scales.
    wavelet : Wavelet
    single : bool
        Whether to invert in single precision; spectra are always taken in double.
    """

    def __init__(
        self, n: int, scales: Real, members: Sequence[int], wavelet: Wavelet, single: bool
    ) -> None:
        self._n, self._wavelet, self._single = n, wavelet, single
        self._lengths: dict[int, list[tuple[int, float]]] = {}
        self._kept: dict[int, NDArray[Any]] = {}
        for j, scale in zip(members, scales.tolist(), strict=True):
            length = ring_length(n, scale, wavelet.radius)
            self._lengths.setdefault(length, []).append((j, scale))
            if length <= KEPT:
                self._kept[j] = self._weights(scale, length)

    def _weights(self, scale: float, length: int) -> NDArray[Any]:
        """The response at the frequencies of ``fftfreq``."""
        response: NDArray[Any] = ring_response(self._wavelet, scale, length)
        if not np.any(response.imag):
            # Twice each: real and imaginary parts alike, faster than a complex product.
            return np.repeat(response.real, 2).astype(np.float32 if self._single else float)
        return response.astype(np.complex64 if self._single else complex)

    def transform(self, copies: Copies, sink: Sink) -> None:
        """Transform channels; in long rings one scale of one channel after the other."""
        values = copies.original
        for length, members in self._lengths.items():
            if length > KEPT:
                for c in range(len(values)):
                    for j, scale in members:
                        self._transform_long(values[c], length, scale, sink, c, j)
                continue
            together = max(1, TOGETHER // length)
            for c in range(0, len(values), together):
                channels = slice(c, c + together)
                half = fft.rfft(laid_into_ring(values[channels], length), axis=-1)
                spectra = whole_spectra(half, length, self._single)
                for j, _ in members:
                    self._transform(spectra, sink, channels, j)

    def _transform(
        self,
        spectra: NDArray[np.complexfloating[Any, Any]],
        sink: Sink,
        channels: slice,
        j: int,
    ) -> None:
        """One scale of some channels."""
        weights = self._kept[j]
        product = np.empty_like(spectra)
        np.multiply(spectra.view(weights.dtype), weights, out=product.view(weights.dtype))
        rows = fft.ifft(product, axis=-1, overwrite_x=True)[:, : self._n]
        if self._wavelet.real:
            # What rounding leaves there would flip the phase of negatives between pi and -pi.
            rows.imag = 0.0
        step = max(1, SAMPLES // len(rows))
        for start in range(0, self._n, step):
            part = rows[:, None, start : start + step]
            sink.write(channels, slice(j, j + 1), start, part.real.copy(), part.imag.copy())

    def _transform_long(
        self, values: Real, length: int, scale: float, sink: Sink, c: int, j: int
    ) -> None:
        """One scale of one channel; responses are never there as a whole.

        The spectrum is taken anew for each scale. To keep it would cost a third more memory.
        """
        kind = np.complex64 if self._single else np.complex128
        table = spectrum(partial(_in_ring, values, length), length, kind)

        def response(bins: slice) -> Complex:
            return _response(self._wavelet, scale, length, np.arange(bins.start, bins.stop))

        for start, piece in from_spectrum(table, length, response):
            rows = piece[: max(0, self._n - start)]
            if rows.size:
                real = rows.real.copy()[None, None]
                imag = np.zeros_like(real) if self._wavelet.real else rows.imag.copy()[None, None]
                sink.write(slice(c, c + 1), slice(j, j + 1), start, real, imag)


def whole_spectra(
    half: Complex, length: int, single: bool
) -> NDArray[np.complexfloating[Any, Any]]:
    """Spectra of real rows at positive and negative frequencies, shape (..., length).

    Parameters
    ----------
    half : ndarray, shape (..., length // 2 + 1)
        From ``rfft``.
    length : int
    single : bool
        Whether to give single precision.
    """
    bins = half.shape[-1]
    whole = np.empty((*half.shape[:-1], length), dtype=np.complex64 if single else np.complex128)
    whole[..., :bins] = half
    np.conj(whole[..., length - bins : 0 : -1], out=whole[..., bins:])
    return whole
