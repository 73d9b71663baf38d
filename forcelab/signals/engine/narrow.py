"""Narrow wavelets: overlapping frames that are transformed while they lie in the cache."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from forcelab.signals.engine.copies import Copies
from forcelab.signals.engine.design import Design, response
from forcelab.signals.engine.frames import Frames, slope_at_zero
from forcelab.signals.engine.segments import held
from forcelab.signals.engine.sinks import Sink
from forcelab.signals.wavelets import Morlet

__all__ = ["Narrow"]

Real = NDArray[np.float64]


class Narrow:
    """Some neighbouring scales by overlap and save.

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
        self._frames = Frames(n, design.half_width(float(scales[-1])), single)
        omega = 2 * np.pi * fft.fftfreq(self._frames.length)
        self._ways = [
            (j, self._frames.weights(response(wavelet, a, omega)), slope_at_zero(wavelet, a))
            for j, a in zip(members, scales.tolist(), strict=True)
        ]

    def transform(self, copies: Copies, sink: Sink) -> None:
        """Transform channels."""
        values = copies.original
        channels = max(1, self._frames.together // self._frames.count)
        frames = max(1, self._frames.together // channels)
        for c in range(0, len(values), channels):
            for f in range(0, self._frames.count, frames):
                self._transform(values, sink, slice(c, c + channels), f, f + frames)

    def _transform(self, values: Real, sink: Sink, channels: slice, first: int, last: int) -> None:
        """Frames `first` .. `last` of some channels."""
        last = min(last, self._frames.count)
        hop, margin = self._frames.hop, self._frames.margin
        part = held(values[channels], first * hop - margin, last * hop + margin)
        spectra, slopes = self._frames.spectra(part, last - first)
        for j, weights, slope in self._ways:
            rows = self._frames.rows(spectra, slopes, weights, slope)
            if sink.direct is None:
                real = np.ascontiguousarray(rows.real).reshape(len(rows), 1, -1)
                imag = np.ascontiguousarray(rows.imag).reshape(len(rows), 1, -1)
                sink.write(channels, slice(j, j + 1), first * hop, real, imag)
            else:
                self._place(rows, sink.direct[channels, j], first * hop)

    def _place(
        self,
        rows: NDArray[np.complexfloating[Any, Any]],
        into: NDArray[np.floating[Any]],
        start: int,
    ) -> None:
        """Copy the middles of frames side by side."""
        hop = self._frames.hop
        place = into.view(rows.dtype)[:, start : min(self._n, start + rows.shape[1] * hop)]
        full = place.shape[1] // hop
        for c in range(len(rows)):
            whole = place[c, : full * hop].reshape(full, hop)
            whole[...] = rows[c, :full]
            if full < rows.shape[1]:
                rest = place[c, full * hop :]
                rest[...] = rows[c, full, : len(rest)]
