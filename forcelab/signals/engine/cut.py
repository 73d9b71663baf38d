"""Wavelets that are cut at the Nyquist frequency, in long recordings.

The cut makes them ring for ever, so no frame holds one. But a response ``H`` is the sum of
``H (1 - w)``, which has no cut and dies away, and of ``H w``, with a window ``w`` that is 1 about
the Nyquist frequency and falls smoothly to 0: a band so narrow that few points of a grid hold it.
The first goes by frames that stay in the cache. For the second the ring is multiplied by
``(-1)^n``, which brings the Nyquist frequency to 0, and transformed at a quarter of the rate.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.special import erfc

from forcelab.signals.engine.copies import ROW, Copies, gaussian_means, mean_weights
from forcelab.signals.engine.design import Design, band, response
from forcelab.signals.engine.frames import Frames, slope_at_zero
from forcelab.signals.engine.kernels import interpolation, windows
from forcelab.signals.engine.ring import ring_length, ring_part
from forcelab.signals.engine.sinks import Sink
from forcelab.signals.wavelets import Morlet

__all__ = ["Cut"]

Real = NDArray[np.float64]
Floats = NDArray[np.floating[Any]]
Complex = NDArray[np.complex128]

#: Steps of the grid of the band at the Nyquist frequency, and of the ring's copy, in samples.
GRID, COPY = 8, 4
#: Points of the grids, and samples of the rings, that are worked on together.
POINTS, TOGETHER = 1 << 21, 1 << 19
#: Rings up to this length have their responses kept.
KEPT = 1 << 21
#: Bins whose responses are worked out at once.
STRETCH = 1 << 16


class Cut:
    """Some scales of long rings, cut at the Nyquist frequency.

    Parameters
    ----------
    n : int
        Samples of a channel.
    scales : ndarray, shape (s,)
        Rising.
    members : sequence of int
        Their places among all scales.
    wavelet : Morlet
    design : Design
    tolerance : float
    single : bool
        Whether to give single precision; spectra are always taken in double.
    """

    def __init__(
        self,
        n: int,
        scales: Real,
        members: Sequence[int],
        wavelet: Morlet,
        design: Design,
        tolerance: float,
        single: bool,
    ) -> None:
        self._wavelet = wavelet
        kernel, points, self._high = band(tolerance)
        #: Width in time, in samples, of the Gaussian whose transform's integral is w's edge.
        self._width = max(points * GRID, design.rate * COPY * self._high / (2 * math.pi))
        self._half = math.ceil(design.reach * design.gaussian)
        self._sigma = design.gaussian * COPY
        self._kernel = kernel
        product = interpolation(kernel, GRID, single)
        self._product = product
        # Back from frequency 0 to the Nyquist frequency.
        self._matrix = product.matrix * np.where(np.arange(product.outputs) % 2, -1, 1).astype(
            product.matrix.dtype
        )
        margin = math.ceil(design.reach * math.hypot(self._width, float(scales[-1]))) + 2
        self._frames = Frames(n, margin, single, product.outputs)
        omega = 2 * np.pi * fft.fftfreq(self._frames.length)
        rest = 1.0 - self._window(np.pi - np.abs(omega))
        self._rings: dict[int, list[tuple[int, float]]] = {}
        self._ways: dict[int, tuple[Floats, float]] = {}
        self._bands: dict[int, Real] = {}
        for j, scale in zip(members, scales.tolist(), strict=True):
            length = ring_length(n, scale, wavelet.radius)
            self._rings.setdefault(length, []).append((j, scale))
            weights = self._frames.weights(rest * response(wavelet, scale, omega))
            self._ways[j] = weights, slope_at_zero(wavelet, scale)
            if length <= KEPT:
                self._bands[j] = self._band(scale, length)

    def _window(self, distance: Real) -> Real:
        """The window w at distances from the Nyquist frequency, in radians a sample."""
        at = (distance * self._width - 0.5 * self._high) / math.sqrt(2)
        return np.asarray(0.5 * erfc(at), dtype=np.float64)

    def _bins(self, length: int) -> int:
        """How many bins of a ring's spectrum the band goes on for, on either side of Nyquist's.

        It may end on a bin exactly, so rounding is asked only here.
        """
        most = min(length // (2 * COPY), length // (2 * GRID) - 1)
        return min(math.ceil(self._high / self._width * length / (2 * math.pi)), most)

    def _band(self, scale: float, length: int) -> Real:
        """By what the copy's spectrum is multiplied at bins -K .. K, counted from Nyquist's.

        That is ``H w`` over what the Gaussian and the interpolation multiply by.
        """
        bin_width, bins = 2 * math.pi / length, self._bins(length)
        # Bit by bit: of a long ring what it takes is more than the result.
        return np.concatenate(
            [
                self._band_part(
                    scale, bin_width * np.arange(k, min(k + STRETCH, bins + 1), dtype=float)
                )
                for k in range(-bins, bins + 1, STRETCH)
            ]
        )

    def _band_part(self, scale: float, omega: Real) -> Real:
        """The same at frequencies in radians a sample, counted from Nyquist's."""
        passed = self._kernel.transforms(GRID * omega) * GRID
        passed *= np.exp(-0.5 * (self._sigma * omega) ** 2) / COPY
        # Below the Nyquist frequency, and above it, where the negative ones begin.
        weights = response(self._wavelet, scale, omega + np.where(omega > 0, -math.pi, math.pi))
        # Its own bin stands for both signs.
        both = response(self._wavelet, scale, np.array([-math.pi, math.pi]))
        weights[omega == 0] = both.mean()
        return np.asarray(weights * self._window(np.abs(omega)) / passed, dtype=np.float64)

    def transform(self, copies: Copies, sink: Sink) -> None:
        """Transform channels."""
        values = copies.original
        for length, members in self._rings.items():
            channels = max(1, TOGETHER // length)
            scales = max(1, POINTS * GRID // length)
            for c in range(0, len(values), channels):
                spectra = self._spectra(values[c : c + channels], length)
                for i in range(0, len(members), scales):
                    chosen = members[i : i + scales]
                    grids = {j: self._grid(spectra, length, j, scale) for j, scale in chosen}
                    count = max(1, self._frames.together // len(spectra))
                    for f in range(0, self._frames.count, count):
                        self._transform(values, length, grids, sink, c, slice(f, f + count))

    def _spectra(self, values: Real, length: int) -> Complex:
        """Half of the spectra of ``(-1)^n x_n`` at every COPY samples of rings."""
        weights = mean_weights(COPY, self._half, self._sigma)
        weights = weights * np.where(np.arange(len(weights)) % 2, -1.0, 1.0)[:, None]
        before = self._half * COPY
        means = gaussian_means(
            lambda start, stop: ring_part(values, length, start - before, stop - before),
            len(values),
            length // (ROW * COPY),
            COPY,
            weights,
        )
        # A copy: the rest of the spectrum is not needed.
        return fft.rfft(means, axis=-1, overwrite_x=True)[:, : self._bins(length) + 1].copy()

    def _grid(self, spectra: Complex, length: int, j: int, scale: float) -> Floats:
        """Points of one scale's band all along the ring; parts apart, shape (2, c, points)."""
        weights = self._bands[j] if j in self._bands else self._band(scale, length)
        bins, points = len(weights) // 2, length // GRID
        product = np.zeros((len(spectra), points), dtype=np.complex128)
        np.multiply(spectra[:, : bins + 1], weights[bins:], out=product[:, : bins + 1])
        np.conj(spectra[:, bins:0:-1], out=product[:, points - bins :])
        product[:, points - bins :] *= weights[:bins]
        found = fft.ifft(product, axis=-1, overwrite_x=True)
        before = self._product.before
        needed = before + self._frames.count * self._frames.hop // GRID + self._product.inputs
        parts = np.empty((2, len(spectra), needed), dtype=self._matrix.dtype)
        place = 0
        while place < needed:  # round and round the ring
            at = (place - before) % points
            count = min(points - at, needed - place)
            parts[0, :, place : place + count] = found.real[:, at : at + count]
            parts[1, :, place : place + count] = found.imag[:, at : at + count]
            place += count
        return parts

    def _transform(
        self, values: Real, length: int, grids: dict[int, Floats], sink: Sink, c: int, some: slice
    ) -> None:
        """Some scales, over some frames."""
        frames, product = self._frames, self._product
        first, count = some.start, min(some.stop, frames.count) - some.start
        rows_of_one = next(iter(grids.values())).shape[1]
        channels = slice(c, c + rows_of_one)
        start = first * frames.hop
        stop = start + count * frames.hop + 2 * frames.margin
        part = ring_part(values[channels], length, start - frames.margin, stop)
        spectra, slopes = frames.spectra(part, count)
        rows = count * frames.hop // product.outputs
        from_point = start // GRID
        for j, points in grids.items():
            found = frames.rows(spectra, slopes, *self._ways[j])
            left = np.ascontiguousarray(windows(points[:, :, from_point:], rows, product))
            both = (left.reshape(-1, product.inputs) @ self._matrix).reshape(2, *found.shape)
            both[0] += found.real
            both[1] += found.imag
            real, imag = both.reshape(2, rows_of_one, 1, -1)
            sink.write(channels, slice(j, j + 1), start, real, imag)
