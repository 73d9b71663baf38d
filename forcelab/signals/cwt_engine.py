"""The wavelet engine: transforms to a tolerance, each scale by the cheapest way that holds it.

Any wavelet at any scale: the whole recording in one ring. For wavelets that are cut at the Nyquist
frequency, which ring for ever, and for those without a compact band. The ring is that of
:mod:`forcelab.signals.cwt`, so that both give the same.

Wide wavelets: a short inverse FFT on a coarse grid, and a matrix product to every sample. The row
of a wide wavelet is band-limited: it is known from few points. Those are found by an inverse FFT of
the band alone, in double precision; what lies between is interpolated
(:mod:`forcelab.signals.cwt_blocks`), in single precision where the tolerance allows it.

The straight line through the ends of a block is taken away before, as of a frame: the ring would
turn it into a jump, of which the ends of the band would cut something off. Its transform is one
number.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from itertools import groupby
from typing import Any, Protocol

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy import fft

from forcelab.arrays import Floats, Real
from forcelab.errors import InputError
from forcelab.runtime import one_blas_thread
from forcelab.signals.cwt_blocks import (
    PARTS,
    SINGLE,
    AtSamples,
    Coefficients,
    Complex,
    Copies,
    Design,
    Interpolation,
    LargestPower,
    LogPolar,
    Sink,
    Smoothing,
    design,
    from_spectrum,
    held,
    interpolation,
    keep_freed_memory,
    response,
    spectrum,
    without_line,
)
from forcelab.signals.wavelets import AREA, Morlet, Wavelet

Complex128 = NDArray[np.complex128]

#: Samples over which the last value leads to the first, half-widths away from both. A jump there
#: would be heard at both ends by wavelets that are cut at the Nyquist frequency and ring for long.
RAMP = 64
#: Samples that are handed on at once.
RING_SAMPLES = 1 << 14
#: Lengths above this are multiples of the square of :data:`PARTS`.
RING_EVEN = 1 << 18
#: Rings up to this length are transformed as a whole, longer ones in less memory.
RING_WHOLE = 1 << 21
#: Numbers of their responses that are kept from one transform to the next, at most.
RING_KEPT = 1 << 23
#: Samples of rings that are transformed at once: FFTs of several rows are faster for each.
RING_TOGETHER = 1 << 19


def ring_length(n: int, scale: float, radius: float) -> int:
    """Samples of the ring: the signal, one half-width beyond both ends, and what joins them."""
    need = n + 2 * int(np.ceil(radius * scale)) + RAMP
    if need > RING_EVEN:
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
    share = _share_of_last(values.shape[-1], length, places)
    return np.asarray(share * values[..., -1:] + (1 - share) * values[..., :1])


def _share_of_last(n: int, length: int, places: NDArray[np.int64]) -> Real:
    """How much of the last value a ring has at places beyond it; the rest is of the first."""
    ramp = np.clip(0.5 + (places - 0.5 * (n + length - 1)) / RAMP, 0.0, 1.0)
    return np.asarray(0.5 + 0.5 * np.cos(np.pi * ramp))


def _in_ring(values: Real, length: int, places: NDArray[np.int64]) -> Real:
    """The ring's samples of one channel at rising places."""
    beyond = int(np.searchsorted(places, len(values)))
    return np.concatenate([values[places[:beyond]], _across(values, length, places[beyond:])])


def ring_response(
    wavelet: Wavelet, scale: float, length: int, bins: slice = slice(None)
) -> Complex128:
    """By what the spectrum of a ring is multiplied at some frequencies of ``fftfreq``."""
    numbers = np.arange(*bins.indices(length))
    # Whole numbers, so that the Nyquist bin is known for sure; the upper half are negative.
    signed = np.where(2 * numbers >= length, numbers - length, numbers)
    omega = 2 * np.pi * (signed / length)
    response = np.sqrt(scale) * np.conj(wavelet.spectrum(scale * omega))
    # The Nyquist bin stands for both signs of its frequency.
    nyquist = wavelet.spectrum(scale * np.array([-np.pi, np.pi]))
    response[2 * np.abs(signed) == length] = np.sqrt(scale) * np.conj(nyquist.mean())
    return np.asarray(response, dtype=np.complex128)


def doubled(response: Real, single: bool) -> Floats:
    """A real response, each number twice: to multiply the parts alike beats a complex product."""
    return np.repeat(response, 2).astype(np.float32 if single else np.float64)


class Ring:
    """Some scales by products in the Fourier space of whole rings.

    `scales` (s,); `members`: their places among all scales; `single`: whether to invert in single
    precision; spectra are always taken in double.
    """

    def __init__(
        self, n: int, scales: Real, members: Sequence[int], wavelet: Wavelet, single: bool
    ) -> None:
        self._n, self._wavelet, self._single = n, wavelet, single
        self._lengths: dict[int, list[tuple[int, float]]] = {}
        self._kept_weights: dict[int, NDArray[Any]] = {}
        for j, scale in zip(members, scales.tolist(), strict=True):
            length = ring_length(n, scale, wavelet.radius)
            self._lengths.setdefault(length, []).append((j, scale))
            kept = sum(map(len, self._kept_weights.values()))
            if length <= RING_WHOLE and kept + length <= RING_KEPT:
                self._kept_weights[j] = self._weights(scale, length)

    def _weights(self, scale: float, length: int) -> NDArray[Any]:
        """The response at the frequencies of ``fftfreq``."""
        response: NDArray[Any] = ring_response(self._wavelet, scale, length)
        if not np.any(response.imag):
            return doubled(response.real, self._single)
        return response.astype(np.complex64 if self._single else complex)

    def transform(self, copies: Copies, sink: Sink) -> None:
        """Transform channels; in long rings one scale of one channel after the other."""
        values = copies.original
        for length, members in self._lengths.items():
            if length > RING_WHOLE:
                for c in range(len(values)):
                    for j, scale in members:
                        self._transform_long(values[c], length, scale, sink, c, j)
                continue
            together = max(1, RING_TOGETHER // length)
            for c in range(0, len(values), together):
                channels = slice(c, c + together)
                half = fft.rfft(laid_into_ring(values[channels], length), axis=-1)
                spectra = whole_spectra(half, length, self._single)
                for j, scale in members:
                    weights = self._kept_weights.get(j)
                    if weights is None:
                        weights = self._weights(scale, length)
                    self._transform(spectra, weights, sink, channels, j)

    def _transform(
        self, spectra: Complex, weights: NDArray[Any], sink: Sink, channels: slice, j: int
    ) -> None:
        """One scale of some channels."""
        product = (spectra.view(weights.dtype) * weights).view(spectra.dtype)
        rows = fft.ifft(product, axis=-1, overwrite_x=True)[:, : self._n]
        if self._wavelet.real:
            # What rounding leaves there would flip the phase of negatives between pi and -pi.
            rows.imag = 0.0
        step = max(1, RING_SAMPLES // len(rows))
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
        response = partial(ring_response, self._wavelet, scale, length)
        for start, piece in from_spectrum(table, length, response):
            rows = piece[: max(0, self._n - start)]
            if rows.size:
                real = rows.real.copy()[None, None]
                imag = np.zeros_like(real) if self._wavelet.real else rows.imag.copy()[None, None]
                sink.write(slice(c, c + 1), slice(j, j + 1), start, real, imag)


def whole_spectra(half: Complex128, length: int, single: bool) -> Complex:
    """Spectra of real rows at positive and negative frequencies, shape (..., length).

    `half` (..., length // 2 + 1): from ``rfft``; `single`: whether to give single precision.
    """
    bins = half.shape[-1]
    whole = np.empty((*half.shape[:-1], length), dtype=np.complex64 if single else np.complex128)
    whole[..., :bins] = half
    np.conj(whole[..., length - bins : 0 : -1], out=whole[..., bins:])
    return whole


#: Samples of the frames that are worked on at once: with their spectra they fill half of L2.
CACHED = 1 << 15
#: Longest frame; whole recordings up to four times as long may still be one.
LONGEST = 1 << 11


def slope_at_zero(wavelet: Morlet, scale: float) -> float:
    """The response's derivative at frequency 0.

    Of the spectrum exp(-(u - p)^2 / 2) - exp(-p^2 / 2) exp(-u^2 / 2): p exp(-p^2 / 2).
    """
    return AREA * wavelet.p * math.exp(-(wavelet.p**2) / 2) * scale**1.5


def _frame_length(n: int, margin: int) -> int:
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


class Narrow:
    """Some neighbouring scales by overlap and save.

    Channels are cut into frames. Each gives the `hop` coefficients from its middle; the others,
    which the ring of the frame has spoilt, are given by the frames beside it. The straight line
    through the ends of a frame is taken away before: the ring would turn it into a jump, beside
    which the rest of a slow force is lost in single precision. Its transform is one number, ``-i``
    times the slope times the response's derivative at frequency 0.

    `scales` (s,): rising, none of them cut at the Nyquist frequency; `members`: their places among
    all scales; `single`: whether to invert in single precision; spectra are always taken in double.
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
        self._n, self._single = n, single
        # Samples to both sides that take part in a coefficient; a frame begins so many before the
        # first one that it gives.
        self._margin = design.half_width(float(scales[-1]))
        self._length = _frame_length(n, self._margin)
        self._hop = self._length - 2 * self._margin
        omega = 2 * np.pi * fft.fftfreq(self._length)
        self._ways = [
            (j, doubled(response(wavelet, a, omega), single), slope_at_zero(wavelet, a))
            for j, a in zip(members, scales.tolist(), strict=True)
        ]

    def transform(self, copies: Copies, sink: Sink) -> None:
        """Transform channels, as many frames at a time as fill the cache."""
        values, count = copies.original, -(-self._n // self._hop)
        together = max(1, CACHED // self._length)
        channels = max(1, together // count)
        frames = max(1, together // channels)
        for c in range(0, len(values), channels):
            for f in range(0, count, frames):
                self._transform(values, sink, slice(c, c + channels), f, min(f + frames, count))

    def _transform(self, values: Real, sink: Sink, channels: slice, first: int, last: int) -> None:
        """Frames `first` .. `last` of some channels."""
        hop, margin = self._hop, self._margin
        part = held(values[channels], first * hop - margin, last * hop + margin)
        spectra, slopes = self._spectra(part)
        for j, weights, slope in self._ways:
            product = (spectra.view(weights.dtype) * weights).view(spectra.dtype)
            # The inverse transform divides by the length.
            product[:, :, 0] = slopes * (-1j * slope * self._length)
            rows = fft.ifft(product, axis=-1, overwrite_x=True)[:, :, margin : margin + hop]
            real = np.ascontiguousarray(rows.real).reshape(len(rows), 1, -1)
            imag = np.ascontiguousarray(rows.imag).reshape(len(rows), 1, -1)
            sink.write(channels, slice(j, j + 1), first * hop, real, imag)

    def _spectra(self, part: Real) -> tuple[Complex, Real]:
        """Spectra (c, frames, length) without the straight lines, and the lines' slopes."""
        rest, slopes = without_line(sliding_window_view(part, self._length, 1)[:, :: self._hop])
        half = fft.rfft(rest, axis=-1, overwrite_x=True)
        return whole_spectra(half, self._length, self._single), slopes[:, :, 0]


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
    """Neighbouring scales with the same grid."""

    scales: slice  # their places among all scales
    step: int  # D, in samples
    points: int  # of the grid, over the whole ring
    lines: Complex128  # (s,), bin 0 of what a line of slope 1 a value gives
    #: positive and negative: (s, 2 * bins), by what the spectrum's bins 0, 1, 2, ... and -1, -2,
    #: ... are multiplied, each twice: for their real and imaginary parts.
    positive: Real
    negative: Real


class Wide:
    """Some neighbouring scales on coarse grids, from one spectrum of each block of samples.

    `block`: samples that are transformed at once, a multiple of :data:`WIDEST_STEP`; `scales` (s,):
    rising; `first`: place of the first one among all scales; the others follow; `single`: whether
    to interpolate in single precision; `rate_step`: the spectrum is taken of a copy of the signal
    at every so many samples; `variance`: of the Gaussians that the copy went through, in samples
    squared.
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
                    members = slice(first, min(first + most, len(grid.positive)))
                    self._transform(spectra, slopes, sink, starts, grid, members)

    def _transform(
        self,
        spectra: Complex128,
        slopes: Real,
        sink: Sink,
        starts: range,
        grid: _Grid,
        members: slice,
    ) -> None:
        """Some scales of one grid, of neighbouring blocks."""
        blocks, channels, bins = spectra.shape
        coarse = _coarse(spectra.reshape(-1, bins), slopes.reshape(-1, 1), grid, members)
        coarse = coarse.reshape(blocks, channels, *coarse.shape[1:])
        product = interpolation(self._design.kernel, grid.step, self._single)
        # The grid's points that the first row of the product starts from.
        skipped = self._lead // grid.step - product.before
        scales = slice(grid.scales.start + members.start, grid.scales.start + members.stop)
        for start, grids in zip(starts, coarse, strict=True):
            samples = min(self._block, self._n - start)
            rows = -(-samples // product.outputs)
            points = grids[:, :, skipped : skipped + rows * product.points + product.inputs]
            _interpolate(points, product, rows, sink, scales, start)


def _coarse(spectra: Complex128, slopes: Real, grid: _Grid, members: slice) -> Complex128:
    """Rows of some scales on their grid, shape (rows of spectra, scales, points)."""
    positive, negative = grid.positive[members], grid.negative[members]
    product = np.empty((len(spectra), len(positive), grid.points), dtype=np.complex128)
    parts, source = product.view(np.float64), spectra.view(np.float64)
    above, below = positive.shape[1], negative.shape[1]
    np.multiply(source[:, None, :above], positive, out=parts[:, :, :above])
    product[:, :, 0] = slopes * grid.lines[members]
    parts[:, :, above : 2 * grid.points - below] = 0.0
    if below:
        mirrored = np.conj(spectra[:, 1 : below // 2 + 1]).view(np.float64)[:, None]
        product[:, :, : -below // 2 - 1 : -1] = (mirrored * negative).view(np.complex128)
    return np.asarray(fft.ifft(product, axis=-1, overwrite_x=True))


def _interpolate(
    points: Complex128, product: Interpolation, rows: int, sink: Sink, scales: slice, start: int
) -> None:
    """Interpolate real and imaginary parts apart and hand them on while they are in the cache."""
    matrix = product.matrix
    c, s, _ = points.shape
    # (2, c, s, points): real parts, then imaginary parts.
    parts = np.empty((2, *points.shape), dtype=matrix.dtype)
    parts[0], parts[1] = points.real, points.imag
    firsts = slice(0, rows * product.points, product.points)
    overlapping = sliding_window_view(parts, product.inputs, -1)[..., firsts, :]
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


#: Magnitudes of channels of amplitude 1 that are above this share times the root of the scale are
#: above the rounding of the transform.
ROUNDING = 1e-13
#: Recordings above the first length are cut into blocks of the second.
WHOLE, BLOCK = 1 << 17, 1 << 16
#: Wavelets take part with grids of this step and wider.
COARSE = 4
#: Up to this length, where a call costs more than a sample, copies are for the widest only.
SHORT = 1 << 15
#: A wavelet that reaches further than this share of a block is transformed on a slower copy.
SHARE = 0.15
#: Scales of one copy are up to so many times the narrowest of them.
SPAN = 16.0


#: So few neighbouring samples, of recordings up to :data:`SHORT`, are products with a matrix: of a
#: stream's 40 out of 5000, ten scales take 0.2 ms instead of 2.3.
FEW = 64


class FewSamples:
    """Some scales at few neighbouring samples.

    Each coefficient is a weighted sum of the recording, whose weights are those of the ring. Those
    of neighbouring samples are almost alike where the wavelet is wide: the matrix of all of them is
    kept as a product of two narrow ones, by its singular values.
    """

    def __init__(
        self, n: int, scales: Real, wavelet: Wavelet, tolerance: float, samples: range
    ) -> None:
        self._count = len(samples)
        self._ways = [self._way(n, scale, wavelet, tolerance, samples) for scale in scales.tolist()]

    def _way(
        self, n: int, scale: float, wavelet: Wavelet, tolerance: float, samples: range
    ) -> tuple[slice, Real, Real]:
        """The samples that take part, and the two matrices, parts of a coefficient apart."""
        length = ring_length(n, scale, wavelet.radius)
        kernel = fft.ifft(ring_response(wavelet, scale, length))
        if wavelet.real:
            kernel.imag = 0.0
        last_share = _share_of_last(n, length, np.arange(n, length))
        weights = np.empty((n, len(samples)), dtype=np.complex128)
        for column, sample in zip(weights.T, samples, strict=True):
            around = np.roll(kernel[::-1], sample + 1)
            column[:] = around[:n]
            column[-1] += last_share @ around[n:]
            column[0] += (1 - last_share) @ around[n:]
        # What is left away is far below the tolerance.
        size = np.abs(weights).max(axis=1)
        taking_part = np.flatnonzero(size > 1e-3 * tolerance * size.max())
        part = slice(int(taking_part[0]), int(taking_part[-1]) + 1)
        both = np.hstack([weights[part].real, weights[part].imag])
        left, singular, right = np.linalg.svd(both, full_matrices=False)
        rank = int(np.count_nonzero(singular > 1e-3 * tolerance * singular[0]))
        return part, left[:, :rank] * singular[:rank], right[:rank]

    def coefficients(self, values: Real) -> Complex:
        """Coefficients (c, k, m) of channels (c, n)."""
        out = np.empty((len(values), len(self._ways), self._count), dtype=np.complex64)
        for j, (part, left, right) in enumerate(self._ways):
            products = values[:, part] @ left @ right
            out.real[:, j], out.imag[:, j] = products[:, : self._count], products[:, self._count :]
        return out


class _Path(Protocol):
    """A way to transform some of the scales."""

    def transform(self, copies: Copies, sink: Sink) -> None: ...


class Plan:
    """A transform that is ready to run; use :func:`plan_for`, which keeps plans.

    `scales`: in samples, positive, in any order; `tolerance`: one of 1e-3, 1e-5, 1e-7, 1e-10 and
    1e-14; `single`: whether coefficients are given in single precision, and interpolated in it.
    """

    def __init__(
        self, n: int, scales: Sequence[float], wavelet: Wavelet, tolerance: float, single: bool
    ) -> None:
        keep_freed_memory()
        self.n, self.tolerance, self.single = n, tolerance, single
        self.scales: Real = np.asarray(scales, dtype=np.float64)
        self._wavelet = wavelet
        self._few: tuple[range, FewSamples] | None = None
        # In rising order inside.
        self._order = np.argsort(self.scales, kind="stable")
        rising = self.scales[self._order]
        block = WIDEST_STEP * -(-(n if n <= WHOLE else BLOCK) // WIDEST_STEP)
        self._smoothing = Smoothing((1,), 1.0, 1)
        if type(wavelet) is Morlet:
            self._paths = self._morlet(rising, wavelet, design(wavelet.p, tolerance), block)
        else:
            design(5.0, tolerance)  # refuses unknown tolerances
            self._paths = [Ring(n, rising, range(len(rising)), wavelet, single)]

    def _morlet(self, scales: Real, wavelet: Morlet, design: Design, block: int) -> list[_Path]:
        """Ways for cut, narrow, wide and the widest wavelets."""
        n, single = self.n, self.single
        cut = sum(map(design.is_cut, scales.tolist()))
        first = max(cut, sum(design.step(a) < COARSE for a in scales.tolist()))
        paths: list[_Path] = []
        if cut:
            paths.append(Ring(n, scales[:cut], range(cut), wavelet, single))
        if cut < first:
            narrow = range(cut, first)
            paths.append(Narrow(n, scales[cut:first], narrow, wavelet, design, single))
        half = math.ceil(design.reach * design.gaussian)
        self._smoothing = Smoothing((1,), design.gaussian, half)
        while first < len(scales):
            scale = float(scales[first])
            near = design.half_width(scale) <= max(SHARE * block, 512)
            step = self._copy_step(scale, design, near)
            last = int(np.searchsorted(scales, self._reached(scale, step, design, block)))
            last = max(last, first + 1)
            paths.append(
                Wide(
                    n,
                    block if near else WIDEST_STEP * -(-n // WIDEST_STEP),
                    scales[first:last],
                    first,
                    wavelet,
                    design,
                    single,
                    step,
                    self._smoothing.variance(step),
                )
            )
            first = last
        return paths

    def _copy_step(self, scale: float, design: Design, near: bool) -> int:
        """Samples a step of the copy that a scale is transformed on; 1 for the signal itself."""
        steps = self._smoothing.steps
        step = min(design.copy_step(scale), 1 << max(0, (self.n // 32).bit_length() - 1))
        if step <= steps[-1] or (near and self.n <= SHORT):
            return steps[-1]
        self._smoothing = replace(self._smoothing, steps=(*steps, step))
        return step

    def _reached(self, scale: float, step: int, design: Design, block: int) -> float:
        """The scale up to which others join that one on its copy."""
        farthest = (max(SHARE * block, 512) - 2) / design.reach
        if scale > farthest:
            return SPAN * scale
        return min(farthest * (1 + 1e-12), SPAN * scale if step > 1 else math.inf)

    def coefficients(self, values: Real, samples: slice = slice(None)) -> Complex:
        """Transform channels.

        `values` (c, n): finite, moderate in size, as from
        :func:`forcelab.signals.conditioning.condition`. Gives (c, k, m) at the m `samples`.
        """
        wanted = range(self.n)[samples]
        if self.single and wanted.step == 1 and 0 < len(wanted) <= FEW < self.n <= SHORT:
            latest = self._few  # another thread may ask for other samples
            if latest is None or latest[0] != wanted:
                few = FewSamples(self.n, self.scales, self._wavelet, self.tolerance, wanted)
                latest = self._few = wanted, few
            return latest[1].coefficients(values)
        sink = Coefficients(len(values), len(self.scales), self.n, self.single)
        self._run(values, sink)
        return self._as_asked(sink.result)[:, :, samples]

    def log_polar(self, values: Real) -> tuple[Floats, Floats]:
        """Log magnitudes and phases of channels, without their coefficients ever being kept.

        `values` (c, n). Gives `magnitudes`, `phases` (c, k, n): natural logarithms, and radians
        from -pi to pi. Magnitudes below :data:`ROUNDING` times the root of the scale are raised to
        that, and their phase is 0.
        """
        floor = ROUNDING * np.sqrt(self.scales[self._order])
        sink = LogPolar(len(values), floor, self.n, self.single)
        self._run(values, sink)
        return self._as_asked(sink.magnitudes), self._as_asked(sink.phases)

    def largest_power(self, values: Real, bounds: NDArray[np.int64]) -> Floats:
        """The largest ``|W|^2`` of channels between neighbouring bounds.

        `values` (c, n); `bounds` (m + 1,): samples, rising, from 0 to n. Gives (c, k, m).
        """
        sink = LargestPower(len(values), len(self.scales), bounds, self.single)
        self._run(values, sink)
        return self._as_asked(sink.power)

    def at_samples(self, values: Real, samples: NDArray[np.int64]) -> Complex:
        """The coefficients of channels at some samples.

        `values` (c, n); `samples` (m,): rising. Gives (c, k, m).
        """
        sink = AtSamples(len(values), len(self.scales), samples, self.single)
        self._run(values, sink)
        return self._as_asked(sink.coefficients)

    def _run(self, values: Real, sink: Sink) -> None:
        if values.ndim != 2 or values.shape[1] != self.n:
            raise InputError(
                f"This plan is for channels of {self.n} samples, not for {values.shape}."
            )
        values = np.ascontiguousarray(values, dtype=np.float64)
        with one_blas_thread():
            copies = Copies(values, self._smoothing)
            for path in self._paths:
                path.transform(copies, sink)

    def _as_asked(self, rows: NDArray[Any]) -> NDArray[Any]:
        """Bring scales back into the order they were given in."""
        if np.array_equal(self._order, np.arange(len(self._order))):
            return rows
        return rows[:, np.argsort(self._order)]


_cached_plan = lru_cache(maxsize=8)(Plan)


def plan_for(
    n: int,
    scales: Sequence[float] | Real,
    wavelet: Wavelet | None = None,
    tolerance: float = 1e-7,
) -> Plan:
    """A plan for transforms; the last few are kept and given again.

    `n`: samples of a channel, at least 1; `scales` (k,): in samples, positive, in any order;
    `wavelet`: the Morlet with p = 5 by default. Any other than the complex Morlet takes the plain
    way; `tolerance`: 1e-3, 1e-5, 1e-7, 1e-10 or 1e-14: error relative to the largest coefficient of
    its scale.
    """
    sizes = np.asarray(scales, dtype=np.float64)
    if n < 1:
        raise InputError(f"A transform needs at least one sample, not {n}.")
    if sizes.ndim != 1 or sizes.size == 0 or not np.all((sizes > 0) & np.isfinite(sizes)):
        raise InputError("Scales are positive numbers of samples.")
    single = tolerance >= SINGLE
    return _cached_plan(
        int(n), tuple(sizes.tolist()), wavelet or Morlet(), float(tolerance), single
    )
