"""What the wavelet engine is built from: filter design, kernels, decimated copies and rings.

The compact kernel that carries a band-limited row from a coarse grid to every sample. ``W(t) =
sum_m c_m phi(t / D - m)`` for a grid of step D, where phi is the "exponential of semicircle"
``phi(z) = exp(beta (sqrt(1 - (2 z / w)^2) - 1))`` for ``|z| < w / 2``, 0 beyond. A wave ``exp(i
omega m)`` on the grid comes out multiplied by phi's transform, so the row is divided by that
beforehand; what is left are the aliases ``phi_hat(omega + 2 pi k)``, k = -1, 1, ...

References
----------
.. [1] Barnett, A. H., Magland, J. and af Klinteberg, L., "A parallel nonuniform fast Fourier
   transform library based on an 'exponential of semicircle' kernel", SIAM J. Sci. Comput. 41
   (2019), section 3.

Fourier transforms of long rings by many short ones, in little memory beside half a spectrum. A ring
of ``L = M P`` samples is seen as a table with M rows or columns (the "four-step" FFT [1]_): the
spectrum of every M-th sample at a time, then short transforms across them, and back likewise.

References
----------
.. [1] Bailey, D. H., "FFTs in external or hierarchical memory", J. Supercomputing 4 (1990).

Copies of held channels at lower rates, each made from the one before. A copy's values are Gaussian
means of the finer one, so that what it loses is known and can be divided out again: after several
of them the variances of the Gaussians have added up.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, Protocol

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.polynomial import chebyshev
from numpy.typing import NDArray
from scipy import fft

from forcelab.arrays import Floats, Real
from forcelab.errors import InputError
from forcelab.signals.wavelets import Morlet

#: Bytes. The temporary arrays of a transform take less, one by one; up to twice as much is kept.
LARGEST = 1 << 24


def keep_freed_memory() -> None:
    """Have the C library keep what is freed, rather than hand it back to the system at once.

    Getting the pages again took up to a fifth of a transform. glibc keeps more once it has seen a
    large block freed; other libraries take no notice. None of the block's pages is ever touched.
    """
    np.empty(LARGEST, dtype=np.uint8)


#: Outputs of one row of the matrix product: enough work a row, and few products with zeros.
ROW = 64


@dataclass(frozen=True)
class Kernel:
    """An exponential of semicircle."""

    taps: int  # its width w in steps of the grid: even
    #: How fast it falls; about ``pi w (1 - 1 / (2 s))`` for a grid s times as fine as the band
    #: needs ([1]_, equation 3.8 for s = 2).
    beta: float

    def __call__(self, z: Real) -> Real:
        """The kernel at `z` steps of the grid."""
        inside = np.maximum(1.0 - (2.0 * z / self.taps) ** 2, 0.0)
        decayed = np.exp(self.beta * (np.sqrt(inside) - 1.0))
        return np.where(inside > 0, decayed, 0.0)

    def transform(self, omega: Real) -> Real:
        """phi_hat at `omega` of at most 5 pi rad a step, by the midpoint rule.

        In ``z = w/2 sin(theta)`` the square root at the kernel's ends is gone, and what is left is
        almost a Gaussian, for which the rule is as exact as float64.
        """
        count = 12 * self.taps + 40
        width = math.pi / count
        theta = width * (np.arange(count) + 0.5) - 0.5 * math.pi
        weighted = width * np.cos(theta) * np.exp(self.beta * (np.cos(theta) - 1))
        waves = np.cos(np.multiply.outer(omega, 0.5 * self.taps * np.sin(theta)))
        return np.asarray(0.5 * self.taps * (waves @ weighted), dtype=np.float64)

    @cached_property
    def _series(self) -> Real:
        """Chebyshev coefficients of phi_hat over omega in -pi .. pi."""
        degree = 2 * self.taps + 40
        nodes = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
        return np.asarray(chebyshev.chebfit(nodes, self.transform(np.pi * nodes), degree))

    def transforms(self, omega: Real) -> Real:
        """phi_hat at many frequencies of at most pi rad a step; a hundred times as fast."""
        return np.asarray(chebyshev.chebval(omega / np.pi, self._series), dtype=np.float64)

    def aliases(self, omega: Real) -> Real:
        """Size of all aliases of a wave, as a share of the wave."""
        folds = 2.0 * math.pi * np.array([-2, -1, 1, 2])
        beside = np.abs(self.transform(np.add.outer(omega, folds)))
        # What is left below is the quadrature's own rounding.
        beside[beside < 4 * np.finfo(np.float64).eps] = 0.0
        # All others together come from the small steps at the kernel's ends.
        steps = 2.0 * math.exp(-self.beta)
        return np.asarray((beside.sum(axis=-1) + steps) / self.transform(omega), dtype=np.float64)


@dataclass(frozen=True)
class Interpolation:
    """One matrix product that makes all samples of a row from its coarse grid.

    Each row of the left factor holds `inputs` neighbouring points of the grid, `points` after those
    of the row before, and gives the ``points * step`` samples from its middle.
    """

    step: int  # D, samples of a step of the grid
    points: int  # steps that one row of the product covers
    before: int  # points of the grid that a row needs before its first sample
    matrix: NDArray[np.floating]  # (inputs, points * step)

    @property
    def inputs(self) -> int:
        """Points of the grid in one row of the left factor."""
        return len(self.matrix)

    @property
    def outputs(self) -> int:
        """Samples in one row of the product."""
        return self.points * self.step


@cache
def interpolation(kernel: Kernel, step: int, single: bool) -> Interpolation:
    """The products for grids of one step, in single or double precision."""
    points = max(1, ROW // step)
    before = kernel.taps // 2 - 1
    grid = np.arange(kernel.taps + points - 1)[:, None] - before
    matrix = kernel(np.arange(points * step) / step - grid)
    return Interpolation(step, points, before, matrix.astype(np.float32) if single else matrix)


#: Errors to choose from, relative to the largest coefficient of the scale, and fewest taps.
TOLERANCES = {1e-3: 4, 1e-5: 6, 1e-7: 8, 1e-10: 12, 1e-14: 16}
#: From this tolerance on, the result of a planned transform is in single precision.
SINGLE = 1e-7
#: Each of the four things that are left away (tails in time, both ends of the band, aliases) errs
#: by no more than this share of the tolerance.
SHARE = 0.2
#: The finest grid, in points to those that the band needs; before it a kernel takes more taps.
FINEST = 2.4
MOST_TAPS = 24
#: Rates and Gaussians of copies: what folds is below 4e-9 of what is kept, or below 1e-16.
COPIES = (4.0, 1.4)
FINE_COPIES = (8.0, 1.6)


@dataclass(frozen=True)
class Design:
    """What a tolerance asks of transforming with one Morlet wavelet."""

    reach: float  # half-width of the wavelet in scales, beyond which it is left away
    #: low and high: Band outside of which its spectrum is left away, in radians per unit of scale.
    low: float
    high: float
    kernel: Kernel
    #: Fewest points of the grid a scale: the step may be up to ``scale / points`` samples.
    points: float
    #: rate and gaussian: For transforming on a copy of the signal: its samples to the shortest
    #: period wanted, and the width of the Gaussian that makes it, in its steps.
    rate: float
    gaussian: float

    def copy_step(self, scale: float) -> int:
        """The largest power of two that a copy's step may be at a scale."""
        return 2 ** math.floor(math.log2(max(1.0, 2 * math.pi * scale / (self.rate * self.high))))

    def step(self, scale: float) -> int:
        """The largest power of two that the grid's step may be at a scale."""
        return 2 ** max(0, math.floor(math.log2(max(scale / self.points, 1.0))))

    def half_width(self, scale: float) -> int:
        """Samples to both sides that take part in a coefficient."""
        return math.ceil(self.reach * scale) + 2

    def is_cut(self, scale: float) -> bool:
        """Whether the band reaches past the Nyquist frequency."""
        return self.high > math.pi * scale


@cache
def design(p: float, tolerance: float) -> Design:
    """Work out the cheapest design for a Morlet wavelet that holds a tolerance."""
    if tolerance not in TOLERANCES:
        choices = ", ".join(f"{choice:g}" for choice in TOLERANCES)
        raise InputError(f"The engine's tolerance is one of {choices}, not {tolerance:g}.")
    wavelet = Morlet(p)
    high = p + math.sqrt(2 * math.log(1 / (SHARE * tolerance)))
    u = np.linspace(-12.0, high, 200)
    size = np.abs(wavelet.spectrum(u).real)
    size /= size.max()
    # Forces have most of their power at low frequencies: up to 1 / u^2 in amplitude, as of a
    # ramp or of a kink. Below the band the spectrum must be small even for these.
    heavy = size * np.maximum(1.0, (p / np.maximum(np.abs(u), 1e-3)) ** 2) > SHARE * tolerance
    low = min(0.0, float(u[max(0, int(np.argmax(heavy)) - 1)]))
    kernel, points = _grid(u[u >= low], size[u >= low], high, tolerance)
    reach = math.sqrt(2 * math.log(1e3 / tolerance))
    copies = COPIES if tolerance >= SINGLE else FINE_COPIES
    return Design(reach, low, high, kernel, points, *copies)


def _grid(u: Real, size: Real, high: float, tolerance: float) -> tuple[Kernel, float]:
    """The shortest kernel, and for it the coarsest grid whose aliases are small enough.

    They count with the spectrum where they come from: near the end of the band, where they are
    largest, it is small.
    """

    def holding(taps: int, fineness: float) -> Kernel | None:
        # Slightly less or more than the usual beta may do better, for the same reason.
        for share in (0.98, 0.94, 1.02):
            kernel = Kernel(taps, share * math.pi * taps * (1 - 1 / (2 * fineness)))
            aliases = kernel.aliases(math.pi * u / (fineness * high))
            if np.max(size * aliases) <= SHARE * tolerance:
                return kernel
        return None

    taps, fine = TOLERANCES[tolerance], FINEST
    while (best := holding(taps, fine)) is None:
        taps += 2
        if taps > MOST_TAPS:
            raise AssertionError("A kernel of 24 taps holds every tolerance.")
    coarse = 1.0
    for _ in range(6):
        middle = 0.5 * (coarse + fine)
        kernel = holding(taps, middle)
        if kernel is None:
            coarse = middle
        else:
            best, fine = kernel, middle
    return best, fine * high / math.pi


def response(wavelet: Morlet, scale: float, omega: Real) -> Real:
    """``sqrt(a) psi_hat(a omega)``, real for a Morlet."""
    return np.asarray(math.sqrt(scale) * wavelet.spectrum(scale * omega).real, dtype=np.float64)


def held(values: Real, start: int, stop: int) -> Real:
    """Samples ``[start, stop)``; before the first and after the last the end values hold.

    `values` (c, n). Gives (c, stop - start): a view where no end value is needed.
    """
    n = values.shape[1]
    if start >= 0 and stop <= n:
        return values[:, start:stop]
    out = np.empty((len(values), stop - start))
    first, last = min(max(-start, 0), stop - start), min(max(n - start, 0), stop - start)
    out[:, :first] = values[:, :1]
    out[:, first:last] = values[:, start + first : start + last]
    out[:, last:] = values[:, -1:]
    return out


def without_line(parts: Real) -> tuple[Real, Real]:
    """Take away the straight line through the first and the last value of each part.

    The ring that a part is transformed in would turn the line into a jump.

    `parts` (..., m). Gives `rest` (..., m); `slopes` (..., 1): of the lines, from value to value.
    """
    last = parts.shape[-1] - 1
    slopes = (parts[..., -1:] - parts[..., :1]) / last
    rest = slopes * np.arange(last + 1)
    rest += parts[..., :1]
    return np.subtract(parts, rest, out=rest), slopes


Complex = NDArray[np.complexfloating[Any, Any]]


class Sink(Protocol):
    """Takes coefficients, part by part."""

    def write(self, channels: slice, scales: slice, start: int, real: Floats, imag: Floats) -> None:
        """Take parts of shape (channels, scales, samples) from sample `start` on.

        What lies past the last sample is left away. The arrays may be overwritten.
        """


class Coefficients:
    """Complex coefficients; `result` (c, k, n)."""

    def __init__(self, channels: int, scales: int, n: int, single: bool) -> None:
        kind = np.complex64 if single else np.complex128
        self.result: Complex = np.empty((channels, scales, n), dtype=kind)

    def write(self, channels: slice, scales: slice, start: int, real: Floats, imag: Floats) -> None:
        into = self.result[channels, scales, start : start + real.shape[-1]]
        into.real = real[..., : into.shape[-1]]
        into.imag = imag[..., : into.shape[-1]]


class LogPolar:
    """Log magnitudes and phases.

    `floor` (k,): magnitudes below are raised to it, and their phase, which means nothing, is 0;
    `magnitudes`, `phases` (c, k, n): natural logarithms, and radians in -pi .. pi.
    """

    def __init__(self, channels: int, floor: NDArray[np.float64], n: int, single: bool) -> None:
        kind = np.float32 if single else np.float64
        self.magnitudes: Floats = np.empty((channels, len(floor), n), dtype=kind)
        self.phases: Floats = np.empty_like(self.magnitudes)
        self._floor = np.maximum(floor**2, np.finfo(kind).tiny).astype(kind)[:, None]
        self._highest = self._floor.max(initial=0.0)
        self._half = kind(0.5)

    def write(self, channels: slice, scales: slice, start: int, real: Floats, imag: Floats) -> None:
        magnitudes = self.magnitudes[channels, scales, start : start + real.shape[-1]]
        phases = self.phases[channels, scales, start : start + real.shape[-1]]
        real, imag = real[..., : phases.shape[-1]], imag[..., : phases.shape[-1]]
        np.arctan2(imag, real, out=phases)
        np.multiply(real, real, out=real)
        np.multiply(imag, imag, out=imag)
        power = np.add(real, imag, out=real)
        if power.min(initial=np.inf) <= self._highest:
            floor = self._floor[scales]
            phases[power <= floor] = 0.0
            np.maximum(power, floor, out=power)
        np.log(power, out=power)
        np.multiply(power, self._half, out=magnitudes)


class LargestPower:
    """The largest ``|W|^2`` between neighbouring bounds.

    `bounds` (m + 1,): samples, rising; `power` (c, k, m).
    """

    def __init__(self, channels: int, scales: int, bounds: NDArray[np.int64], single: bool) -> None:
        kind = np.float32 if single else np.float64
        self.power: Floats = np.zeros((channels, scales, len(bounds) - 1), dtype=kind)
        self._bounds = bounds

    def write(self, channels: slice, scales: slice, start: int, real: Floats, imag: Floats) -> None:
        begin = max(start, int(self._bounds[0]))
        end = min(start + real.shape[-1], int(self._bounds[-1]))
        if begin >= end:
            return
        part = slice(begin - start, end - start)
        power = np.multiply(real[..., part], real[..., part], out=real[..., part])
        power += np.multiply(imag[..., part], imag[..., part], out=imag[..., part])
        first = int(np.searchsorted(self._bounds, begin, side="right")) - 1
        last = int(np.searchsorted(self._bounds, end))
        places = np.maximum(self._bounds[first:last] - begin, 0)
        largest = self.power[channels, scales, first:last]
        np.maximum(largest, np.maximum.reduceat(power, places, axis=-1), out=largest)


class AtSamples:
    """The coefficients at some samples.

    `samples` (m,): rising; `coefficients` (c, k, m).
    """

    def __init__(
        self, channels: int, scales: int, samples: NDArray[np.int64], single: bool
    ) -> None:
        kind = np.complex64 if single else np.complex128
        self.coefficients: Complex = np.zeros((channels, scales, len(samples)), dtype=kind)
        self._samples = samples

    def write(self, channels: slice, scales: slice, start: int, real: Floats, imag: Floats) -> None:
        first, last = np.searchsorted(self._samples, (start, start + real.shape[-1]))
        places = self._samples[first:last] - start
        into = self.coefficients[channels, scales, first:last]
        into.real, into.imag = real[..., places], imag[..., places]


#: M; rows that are transformed at once, and columns.
PARTS = 64
ROWS = 4
COLUMNS = 1 << 11
#: Bins whose responses are worked out at once.
STRETCH = 1 << 14


def spectrum(ring: Callable[[NDArray[np.int64]], Real], length: int, kind: Any) -> list[Complex]:
    """Half of the spectrum of a real ring.

    `ring`: gives the ring's samples at some indices; `length`: L, a multiple of the square of
    :data:`PARTS`; `kind`: complex, of the result; transforms of the parts are in double precision.
    Gives (P / 2 + 1,): ``X[j P + k]`` for all j < M; those for k above P / 2 are conjugates of
    others, as the ring is real.
    """
    index = PARTS * np.arange(length // PARTS)
    table: list[Complex] = []
    for r in range(0, PARTS, ROWS):
        rows = np.stack([ring(index + i) for i in range(r, r + ROWS)])
        table += [row.astype(kind) for row in fft.rfft(rows, axis=-1)]
    for columns, turned in _turns(length, 0, len(table[0])):
        part = np.stack([row[columns] for row in table])
        for row, spectrum_part in zip(table, fft.fft(part * np.conj(turned), axis=0), strict=True):
            row[columns] = spectrum_part
    return table


def from_spectrum(
    table: list[Complex], length: int, response: Callable[[slice], Complex]
) -> Iterator[tuple[int, Complex]]:
    """The ring of a spectrum times a response, in pieces.

    `table`: from :func:`spectrum`. It is used up, and is empty in the end: both it and what is made
    of it would take a third more memory; `response`: gives the factors of the bins of a slice of 0
    .. L.
    """
    part, width = length // PARTS, length // PARTS**2
    half, kind = part // 2, table[0].dtype
    blocks: dict[int, Complex] = {}
    for j in range(PARTS // 2):
        first, last = table.pop(0), table.pop()  # each other's mirror images
        for place, half_bins, mirrored in ((j, first, last), (PARTS - 1 - j, last, first)):
            bins = np.empty(part, dtype=kind)
            bins[: half + 1] = half_bins
            bins[half + 1 :] = np.conj(mirrored[half - 1 : 0 : -1])
            for k in range(0, part, STRETCH):
                section = bins[k : k + STRETCH]
                section *= response(slice(place * part + k, place * part + k + len(section)))
            # Every M-th bin beside each other.
            blocks[place] = bins.reshape(-1, PARTS).T.copy()
    for r in range(0, PARTS, ROWS):
        rows = np.concatenate([blocks[j][r : r + ROWS] for j in range(PARTS)], axis=1)
        rows = fft.ifft(rows, axis=-1, overwrite_x=True)
        for j in range(PARTS):
            blocks[j][r : r + ROWS] = rows[:, j * width : (j + 1) * width]
    for j in range(PARTS):
        for columns, turned in _turns(length, j * width, (j + 1) * width):
            within = slice(columns.start - j * width, columns.stop - j * width)
            block = fft.ifft(blocks[j][:, within] * turned.astype(kind), axis=0)
            for r in range(PARTS):
                yield r * part + columns.start, block[r]


def _turns(length: int, begin: int, end: int) -> Iterator[tuple[slice, NDArray[np.complex128]]]:
    """``exp(2 pi i r k / L)`` for all r < M, and k in stretches of `begin` .. `end`."""
    r = np.arange(PARTS)[:, None]
    first = np.exp(2j * np.pi * r * np.arange(min(COLUMNS, end - begin)) / length)
    for start in range(begin, end, COLUMNS):
        columns = slice(start, min(start + COLUMNS, end))
        turned = np.exp(2j * np.pi * r * start / length)
        yield columns, turned * first[:, : columns.stop - start]


#: Means that one row of the matrix product gives, and samples that are smoothed at once.
MEANS_A_ROW = 16
CHUNK = 1 << 16


@dataclass(frozen=True)
class Smoothing:
    """How copies are made, and which of them there are."""

    #: Samples between the values of each copy: 1, rising, each a multiple of the one before.
    steps: tuple[int, ...]
    width: float  # of the Gaussians, in steps of the copy that they make
    half: int  # half-width in the same steps, beyond which they are left away

    def variance(self, step: int) -> float:
        """The variance of all Gaussians that a copy went through, in samples squared."""
        return float(sum((self.width * finer) ** 2 for finer in self.steps if 1 < finer <= step))


@dataclass(frozen=True)
class _Copy:
    """Values at every `step` samples from sample `first` on; the end values hold for ever."""

    values: Real
    step: int
    first: int


class Copies:
    """All copies of some channels, made when they are first asked for.

    `values` (c, n).
    """

    def __init__(self, values: Real, smoothing: Smoothing) -> None:
        self._smoothing = smoothing
        self._copies = [_Copy(values, 1, 0)]

    @property
    def original(self) -> Real:
        """The channels themselves."""
        return self._copies[0].values

    def held(self, step: int, start: int, count: int) -> Real:
        """Values at every `step` samples from sample `start`, a multiple of it, shape (c, count).

        Before the first and after the last sample the end values hold.
        """
        while self._copies[-1].step < step:
            finer = self._copies[-1]
            coarser = self._smoothing.steps[len(self._copies)]
            self._copies.append(_smoothed(finer, coarser // finer.step, self._smoothing))
        copy = next(candidate for candidate in self._copies if candidate.step == step)
        begin = (start - copy.first) // step
        return held(copy.values, begin, begin + count)


def _smoothed(finer: _Copy, ratio: int, smoothing: Smoothing) -> _Copy:
    """Gaussian means at every `ratio` values, :data:`MEANS_A_ROW` in a row of a matrix product.

    ``y_m = sum_n G(n - m R) x_n`` with ``G(t) = exp(-t^2 / 2 sigma^2) / sqrt(2 pi) sigma``.
    """
    half, step = smoothing.half, finer.step * ratio
    c, n = finer.values.shape
    # From where on all that a mean is taken of is the first value, to where it is the last.
    first = finer.first // step - half
    last = -(-(finer.first + n * finer.step) // step) + half
    rows = -(-(last - first + 1) // MEANS_A_ROW)
    matrix = _mean_weights(ratio, half, smoothing.width * ratio)
    begin = (first - half) * ratio - finer.first // finer.step
    out = np.empty((c, rows * MEANS_A_ROW))
    hop = MEANS_A_ROW * ratio  # values from one row of the left factor to the next, which overlap
    together = max(1, CHUNK // hop)
    for row in range(0, rows, together):
        chosen = min(together, rows - row)
        start = begin + row * hop
        part = held(finer.values, start, start + (chosen - 1) * hop + len(matrix))
        windows = sliding_window_view(part, len(matrix), 1)[:, ::hop]
        means = np.ascontiguousarray(windows).reshape(-1, len(matrix)) @ matrix
        out[:, row * MEANS_A_ROW : (row + chosen) * MEANS_A_ROW] = means.reshape(c, -1)
    return _Copy(out, step, first * step)


@cache
def _mean_weights(ratio: int, half: int, sigma: float) -> Real:
    """Weights of ``(ROW + 2 half) ratio`` values in each of ROW means."""
    places = np.arange((MEANS_A_ROW + 2 * half) * ratio)[:, None] - ratio * (
        half + np.arange(MEANS_A_ROW)
    )
    weights = np.exp(-0.5 * (places / sigma) ** 2) / (math.sqrt(2 * math.pi) * sigma)
    return np.where(np.abs(places) <= half * ratio, weights, 0.0)
