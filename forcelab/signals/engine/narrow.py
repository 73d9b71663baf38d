"""Narrow wavelets: overlapping frames that are transformed while they lie in the cache."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from forcelab.signals.engine.copies import Copies
from forcelab.signals.engine.design import Design, response
from forcelab.signals.engine.segments import held
from forcelab.signals.engine.sinks import Sink
from forcelab.signals.wavelets import Morlet

__all__ = ["Narrow"]

Real = NDArray[np.float64]

#: Samples of the frames that are worked on at once: with their spectra they fill half of L2.
CACHED = 1 << 15
#: Longest frame; whole recordings up to four times as long may still be one.
LONGEST = 1 << 11


class Narrow:
    """Some neighbouring scales by overlap and save.

    A frame of `length` samples gives the `hop` coefficients from its middle; the others, which
    the ring of the frame has spoilt, are given by the frames beside it. The straight line through
    the ends of a frame is taken away before: the ring would turn it into a jump, beside which the
    rest of a slow force is lost in single precision. Its transform is one number, ``-i`` times the
    slope times the response's derivative at frequency 0.

    Parameters
    ----------
    n : int
        Samples of a channel.
    scales : ndarray, shape (s,)
        Rising, none of them cut at the Nyquist frequency.
    members : sequence of int
        Their places among all scales.
    wavelet : Morlet
    design : Design
    single : bool
        Whether to invert in single precision; spectra are always taken in double.
    """

    def __init__(
        self,
        n: int,
        scales: Real,
        members: Sequence[int],
        wavelet: Morlet,
        design: Design,
        single: bool,
    ) -> None:
        self._n = n
        self._members = members
        self._margin = design.half_width(float(scales[-1]))
        self._length = _frame(n, self._margin)
        self._hop = self._length - 2 * self._margin
        self._frames = -(-n // self._hop)
        self._kind = np.complex64 if single else np.complex128
        omega = 2 * np.pi * fft.fftfreq(self._length)
        real = np.float32 if single else np.float64
        # Twice each: multiplying real and imaginary parts alike is faster than a complex product.
        self._responses = [
            np.repeat(response(wavelet, a, omega), 2).astype(real) for a in scales.tolist()
        ]
        # Of the spectrum exp(-(u - p)^2 / 2) - exp(-p^2 / 2) exp(-u^2 / 2): p exp(-p^2 / 2).
        slope = math.sqrt(2 * math.pi) * math.pi**-0.25 * wavelet.p * math.exp(-(wavelet.p**2) / 2)
        self._slopes = (slope * scales**1.5).tolist()

    def batches(self, copies: Copies, sink: Sink) -> Iterator[list[Callable[[], None]]]:
        """What there is to do; the pieces of a batch may be done at the same time."""
        values = copies.original
        together = max(1, CACHED // self._length)
        channels = max(1, together // self._frames)
        frames = max(1, together // channels)
        yield [
            partial(self._transform, values, sink, slice(c, c + channels), f, f + frames)
            for c in range(0, len(values), channels)
            for f in range(0, self._frames, frames)
        ]

    def _transform(self, values: Real, sink: Sink, channels: slice, first: int, last: int) -> None:
        """Frames `first` .. `last` of some channels."""
        last = min(last, self._frames)
        length, hop, margin = self._length, self._hop, self._margin
        part = held(values[channels], first * hop - margin, last * hop + margin)
        c, frames = len(part), last - first
        strides = (part.strides[0], hop * part.strides[1], part.strides[1])
        views = np.lib.stride_tricks.as_strided(part, (c, frames, length), strides, writeable=False)
        slopes = (views[:, :, -1:] - views[:, :, :1]) / (length - 1)
        level = slopes * np.arange(length)
        level += views[:, :, :1]
        spectra = self._spectra(np.subtract(views, level, out=level))
        halves = spectra.view(spectra.real.dtype)
        product = np.empty_like(spectra)
        parts = product.view(halves.dtype)
        ways = zip(self._members, self._responses, self._slopes, strict=True)
        for j, weights, slope in ways:
            np.multiply(halves, weights, out=parts)
            # The inverse transform divides by the length.
            product[:, :, 0] = slopes[:, :, 0] * (-1j * slope * length)
            rows = fft.ifft(product, axis=-1, overwrite_x=True)[:, :, margin : margin + hop]
            if sink.direct is None:
                real = np.ascontiguousarray(rows.real).reshape(c, 1, -1)
                imag = np.ascontiguousarray(rows.imag).reshape(c, 1, -1)
                sink.write(channels, slice(j, j + 1), first * hop, real, imag)
            else:
                self._place(rows, sink.direct[channels, j], first * hop)

    def _spectra(self, frames: Real) -> NDArray[np.complexfloating[Any, Any]]:
        """Spectra at positive and negative frequencies."""
        half = fft.rfft(frames, axis=-1, overwrite_x=True)
        bins = half.shape[-1]
        whole = np.empty((*half.shape[:-1], self._length), dtype=self._kind)
        whole[..., :bins] = half
        np.conj(whole[..., self._length - bins : 0 : -1], out=whole[..., bins:])
        return whole

    def _place(
        self,
        rows: NDArray[np.complexfloating[Any, Any]],
        into: NDArray[np.floating[Any]],
        start: int,
    ) -> None:
        """Copy the middles of frames side by side."""
        place = into.view(self._kind)[:, start : min(self._n, start + rows.shape[1] * self._hop)]
        full = place.shape[1] // self._hop
        for c in range(len(rows)):
            whole = place[c, : full * self._hop].reshape(full, self._hop)
            whole[...] = rows[c, :full]
            if full < rows.shape[1]:
                rest = place[c, full * self._hop :]
                rest[...] = rows[c, full, : len(rest)]


def _frame(n: int, margin: int) -> int:
    """The length of frames that costs least: long ones waste less, short ones stay in the cache."""
    whole = fft.next_fast_len(n + 2 * margin + n % 2, real=True)
    longest = max(LONGEST, 1 << math.ceil(math.log2(8 * margin)))
    lengths = [1 << k for k in range(8, 28)] + [3 << k for k in range(7, 27)]
    lengths = [b for b in lengths if b <= longest and b - 2 * margin >= 64]
    if whole <= 4 * longest:
        lengths.append(whole)

    def cost(length: int) -> float:
        frames = -(-n // (length - 2 * margin))
        missed = 1.25 if length > CACHED // 4 else 1.0
        return frames * length * (math.log2(length) + 4) * missed

    return min(lengths, key=cost)
