"""Wide wavelets: a short inverse FFT on a coarse grid, and a matrix product to every sample.

The row of a wide wavelet is band-limited: it is known from few points. Those are found by an
inverse FFT of the band alone, in double precision; what lies between is interpolated
(:mod:`forcelab.signals.engine.kernels`), in single precision where the tolerance allows it.

The straight line through the ends of a block is taken away before, as of a frame
(:mod:`forcelab.signals.engine.frames`): the ring would turn it into a jump, of which the ends of
the band would cut something off. Its transform is one number.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from forcelab.signals.engine.copies import Copies
from forcelab.signals.engine.design import Design, response
from forcelab.signals.engine.frames import slope_at_zero
from forcelab.signals.engine.kernels import Interpolation, interpolation, windows
from forcelab.signals.engine.segments import without_line
from forcelab.signals.engine.sinks import Sink
from forcelab.signals.wavelets import Morlet

__all__ = ["WIDEST_STEP", "Wide"]

Real = NDArray[np.float64]
Floats = NDArray[np.floating[Any]]
Complex = NDArray[np.complex128]

#: The largest step of a grid: larger ones gain nothing, and their matrices leave the cache.
WIDEST_STEP = 256
#: Points of the grids that are worked on together, and samples that are interpolated and handed on
#: at once: both stay in the cache.
POINTS = 1 << 16
SAMPLES = 1 << 15
#: Rows that are transformed together at least: up to twice as fast for each as one alone.
ROWS = 4


@dataclass(frozen=True)
class _Grid:
    """Neighbouring scales with the same grid.

    Parameters
    ----------
    scales : slice
        Their places among all scales.
    step : int
        D, in samples.
    points : int
        Of the grid, over the whole ring.
    lines : ndarray of complex128, shape (s,)
        Bin 0 of what a line of slope 1 a value gives.
    positive, negative : ndarray, shape (s, 2 * bins)
        By what the spectrum's bins 0, 1, 2, ... and -1, -2, ... are multiplied, each twice: for
        their real and imaginary parts.
    """

    scales: slice
    step: int
    points: int
    lines: Complex
    positive: Real
    negative: Real


class Wide:
    """Some neighbouring scales on coarse grids, from one spectrum of each block of samples.

    Parameters
    ----------
    n : int
        Samples of a channel.
    block : int
        Samples that are transformed at once, a multiple of :data:`WIDEST_STEP`.
    scales : ndarray, shape (s,)
        Rising.
    first : int
        Place of the first one among all scales; the others follow.
    wavelet : Morlet
    design : Design
    single : bool
        Whether to interpolate in single precision.
    rate_step : int
        The spectrum is taken of a copy of the signal at every so many samples.
    variance : float
        Of the Gaussians that the copy went through, in samples squared.
    """

    def __init__(
        self,
        n: int,
        block: int,
        scales: Real,
        first: int,
        wavelet: Morlet,
        design: Design,
        single: bool,
        rate_step: int = 1,
        variance: float = 0.0,
    ) -> None:
        self._n, self._block, self._design, self._single = n, block, design, single
        self._rate_step, self._variance = rate_step, variance
        steps = [min(WIDEST_STEP, design.step(a)) for a in scales.tolist()]
        widest = max(*steps, rate_step)
        half = design.half_width(float(scales[-1])) + design.kernel.taps * steps[-1]
        # Whole steps of all grids before the first sample, so that each has a point at it.
        self._lead = widest * -(-half // widest)
        needed = self._lead + block + half + widest
        self._length = widest // rate_step * fft.next_fast_len(-(-needed // widest), real=True)
        self._grids: list[_Grid] = []
        for step, group in groupby(range(len(scales)), key=lambda i: steps[i]):
            members = list(group)
            places = slice(first + members[0], first + members[-1] + 1)
            self._grids.append(self._grid(scales[members], places, step, wavelet))

    def _grid(self, scales: Real, places: slice, step: int, wavelet: Morlet) -> _Grid:
        """Responses of scales of one step, divided by what the rest of the way multiplies."""
        samples = self._length * self._rate_step
        points = samples // step
        bin_width = 2 * np.pi / samples
        most = min(self._length // 2, points // 2 - 1)
        below = min(math.ceil(-self._design.low / scales[0] / bin_width), most)
        above = min(math.ceil(self._design.high / scales[0] / bin_width), most)
        omega = bin_width * np.arange(-below, above + 1)
        passed = self._design.kernel.transforms(step * omega) * step
        # The Gaussians' transform, and a sum over one in R samples.
        passed *= np.exp(-0.5 * self._variance * omega**2) / self._rate_step
        rows = np.stack([response(wavelet, a, omega) / passed for a in scales.tolist()])
        negative = rows[:, :below][:, ::-1]
        slopes = np.array([slope_at_zero(wavelet, a) for a in scales.tolist()]) / self._rate_step
        unit = points / self._design.kernel.transforms(np.zeros(1))
        return _Grid(
            places,
            step,
            points,
            -1j * slopes * unit,
            np.repeat(rows[:, below:], 2, axis=1),
            np.repeat(negative, 2, axis=1),
        )

    def transform(self, copies: Copies, sink: Sink) -> None:
        """Transform channels, block by block."""
        channels = len(copies.original)
        together = max(1, ROWS // channels)
        for begin in range(0, self._n, together * self._block):
            starts = range(begin, min(begin + together * self._block, self._n), self._block)
            parts = [
                copies.held(self._rate_step, start - self._lead, self._length) for start in starts
            ]
            blocks = np.stack(parts) if len(parts) > 1 else parts[0][np.newaxis]
            rest, slopes = without_line(blocks)
            spectra = np.asarray(fft.rfft(rest, axis=-1, overwrite_x=True))
            for grid in self._grids:
                most = max(1, POINTS // (len(starts) * channels * grid.points))
                for first in range(0, len(grid.positive), most):
                    some = slice(first, min(first + most, len(grid.positive)))
                    self._transform(spectra, slopes, sink, starts, grid, some)

    def _transform(
        self,
        spectra: Complex,
        slopes: Real,
        sink: Sink,
        starts: range,
        grid: _Grid,
        some: slice,
    ) -> None:
        """Some scales of one grid, of neighbouring blocks."""
        blocks, channels, bins = spectra.shape
        coarse = _coarse(spectra.reshape(-1, bins), slopes.reshape(-1, 1), grid, some)
        coarse = coarse.reshape(blocks, channels, *coarse.shape[1:])
        product = interpolation(self._design.kernel, grid.step, self._single)
        # The grid's points that the first row of the product starts from.
        skipped = self._lead // grid.step - product.before
        scales = slice(grid.scales.start + some.start, grid.scales.start + some.stop)
        for start, grids in zip(starts, coarse, strict=True):
            samples = min(self._block, self._n - start)
            rows = -(-samples // product.outputs)
            points = grids[:, :, skipped : skipped + rows * product.points + product.inputs]
            if sink.direct is None:
                _write_parts(points, product, rows, sink, scales, start)
            else:
                _write_complex(points, product, rows, sink.direct[:, scales], start)


def _coarse(spectra: Complex, slopes: Real, grid: _Grid, some: slice) -> Complex:
    """Rows of some scales on their grid, shape (rows of spectra, scales, points)."""
    positive, negative = grid.positive[some], grid.negative[some]
    product = np.empty((len(spectra), len(positive), grid.points), dtype=np.complex128)
    parts, source = product.view(np.float64), spectra.view(np.float64)
    above, below = positive.shape[1], negative.shape[1]
    np.multiply(source[:, None, :above], positive, out=parts[:, :, :above])
    product[:, :, 0] = slopes * grid.lines[some]
    parts[:, :, above : 2 * grid.points - below] = 0.0
    if below:
        mirrored = np.conj(spectra[:, 1 : below // 2 + 1]).view(np.float64)[:, None]
        product[:, :, : -below // 2 - 1 : -1] = (mirrored * negative).view(np.complex128)
    return np.asarray(fft.ifft(product, axis=-1, overwrite_x=True))


def _write_complex(
    points: Complex, product: Interpolation, rows: int, into: Floats, start: int
) -> None:
    """Interpolate, real and imaginary parts in turn, straight into the result."""
    matrix = product.interleaved
    parts = points.view(np.float64).astype(matrix.dtype)
    overlapping = windows(parts, rows, product, 2)
    place = into[:, :, 2 * start : 2 * start + rows * matrix.shape[1]]
    left = np.empty(overlapping.shape[2:], dtype=matrix.dtype)
    for c in range(len(points)):
        for j in range(points.shape[1]):
            np.copyto(left, overlapping[c, j])
            np.matmul(left, matrix, out=place[c, j].reshape(rows, -1))


def _write_parts(
    points: Complex, product: Interpolation, rows: int, sink: Sink, scales: slice, start: int
) -> None:
    """Interpolate real and imaginary parts apart and hand them on while they are in the cache."""
    matrix = product.matrix
    c, s, _ = points.shape
    # (2, c, s, points): real parts, then imaginary parts.
    parts = np.empty((2, *points.shape), dtype=matrix.dtype)
    parts[0], parts[1] = points.real, points.imag
    overlapping = windows(parts, rows, product)
    together = min(rows, max(1, SAMPLES // product.outputs))
    stack = min(s, max(1, SAMPLES // (rows * product.outputs)))
    channels = max(1, SAMPLES // (s * rows * product.outputs))
    for i in range(0, c, channels):
        for j in range(0, s, stack):
            for row in range(0, rows, together):
                chosen = overlapping[:, i : i + channels, j : j + stack, row : row + together]
                shape = chosen.shape
                left = np.ascontiguousarray(chosen).reshape(-1, product.inputs)
                real, imag = (left @ matrix).reshape(*shape[:3], -1)
                sink.write(
                    slice(i, i + shape[1]),
                    slice(scales.start + j, scales.start + j + shape[2]),
                    start + row * product.outputs,
                    real,
                    imag,
                )
