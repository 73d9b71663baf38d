"""The continuous wavelet transform of a stream: each coefficient a fixed delay after its sample.

Weights of samples that have come already in the coefficients of a stream. The coefficient of scale
`a` at sample `b`, as known at sample ``t = b + delay``, is the offline one of the samples up to `t`
with the last value held: a weighted sum of these samples. Wide wavelets see a decimated copy of all
but the newest samples. The copy is made with a Kaiser window as its filter, whose response is
divided out of the wavelet and whose images (spectra shifted by the decimated rate) are below 1e-7
of the signal.

Which scales of a stream are computed together, on which copy of the signal, and their matrices. A
product of 20 samples with the weights of one narrow wavelet takes no longer than the call that asks
for it. So neighbouring scales share a product wherever the zeros that this adds to the narrower
ones cost less than a call, and the calls that are left are told by a sum of costs.

A coefficient is the offline one (:mod:`forcelab.signals.cwt`) of all samples up to `delay` after
its own, with the end value held (the mean of the last eighth of a scale). After ``c * a`` samples
the wavelet has passed and what follows matters no more than the tolerance; before that it is an
early estimate with a known error. Nothing is ever carried from coefficient to coefficient, so that
nothing drifts.

References
----------
.. [1] Jackson, J. I. et al., "Selection of a convolution function for Fourier inversion using
   gridding", IEEE Trans. Med. Imaging 10 (1991): the Kaiser window as a gridding kernel, its
   response divided out afterwards, and its beta for a width and an oversampling.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import fft

from forcelab.errors import InputError
from forcelab.signals.conditioning import GLITCH, RARE, SPIKE, robust_peak
from forcelab.signals.wavelets import Morlet, Wavelet

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Half-width in decimated samples of the filter before decimation.
HALF = 4
#: Highest angular frequency of a wavelet on its decimated copy, radians per decimated sample.
HIGHEST = 0.9
#: A spectrum is taken as ended where it is below this share of its peak.
ENDED = 1e-9
#: Beyond the newest sample their mean holds, over this share of the scale. The last sample alone is
#: as good on smooth forces, but its noise, held for long, is loud: half of an early coefficient.
HELD = 0.125
#: A wavelet cut at the Nyquist frequency rings for ever; its weights end after this many samples.
RINGING = 512


def support(wavelet: Wavelet, tolerance: float) -> float:
    """Half-width in units of the scale outside of which a wavelet is below 0.4 of `tolerance`.

    As a share of its peak. The rest is for what stands in for the samples out there: see
    :data:`HELD`. For a Morlet 3.9 at 1.4e-3, 4.8 at 3e-5, 5.6 at 3e-7.
    """
    t = np.linspace(0.0, wavelet.radius, 20_001)
    size = np.maximum(np.abs(wavelet.time(t)), np.abs(wavelet.time(-t)))
    loud = np.flatnonzero(size > 0.4 * tolerance * np.max(size))
    return float(t[loud[-1]])


def reaches(scales: Real, wavelet: Wavelet, tolerance: float) -> NDArray[np.int64]:
    """Samples to each side of a coefficient that matter to `tolerance`, shape (k,)."""
    c = support(wavelet, tolerance)
    return np.array([Kernel.of(float(a), wavelet).reach(c, tolerance) for a in scales], np.int64)


@dataclass(frozen=True)
class Kernel:
    """The weights of one scale, as the offline engine has them on an endless signal."""

    scale: float  # in samples
    #: (N,), Fourier transform of the weights at the frequencies of an FFT of length N.
    response: Complex
    #: (N,), ``values[m]`` is the weight in the coefficient at `b` of the sample ``b - m``; negative
    #: places count from the end.
    values: Complex

    @classmethod
    def of(cls, scale: float, wavelet: Wavelet) -> Kernel:
        """The kernel of one scale."""
        n = 1 << max(14, int(np.ceil(np.log2(4 * wavelet.radius * scale))))
        response = np.sqrt(scale) * np.conj(wavelet.spectrum(2 * np.pi * scale * fft.fftfreq(n)))
        nyquist = wavelet.spectrum(scale * np.array([-np.pi, np.pi]))
        response[n // 2] = np.sqrt(scale) * np.conj(nyquist.mean())
        values = fft.ifft(response)
        if wavelet.real:
            values.imag = 0.0
        return cls(scale, response, values)

    def reach(self, c: float, tolerance: float) -> int:
        """Samples to each side that matter: c scales, more for a wavelet that rings."""
        wide = math.ceil(c * self.scale)
        top = len(self.response) // 2
        # Not at the Nyquist frequency alone: the Haar wavelet's spectrum has zeros.
        cut = np.abs(self.response[top - top // 8 : top + top // 8])
        if wide >= RINGING or np.max(cut) <= tolerance * np.max(np.abs(self.response)):
            return wide
        # What is left out must be quiet by its energy, for the ringing falls so slowly that many
        # samples of noise are heard together.
        energy = np.abs(self.values[: top + 1]) ** 2
        beyond = np.append(np.cumsum(energy[::-1])[::-1][1:], 0.0)
        ends = int(np.argmax(beyond <= tolerance**2 * energy.sum()))
        return max(wide, min(ends, RINGING))

    def weights(self, delay: int, past: int) -> Complex:
        """Weights of the samples ``t, t - 1, ..`` in the coefficient at ``t - delay``.

        Gives (delay + past + 1,): the mean of the newest samples stands for all that will follow,
        and that of the oldest for all before, so that a constant gives nothing.
        """
        n = len(self.values)
        truncated = self.values[np.arange(-delay, past + 1) % n]
        held = min(max(1, int(HELD * self.scale)), len(truncated))
        truncated[:held] += np.sum(self.values[n // 2 : n - delay]) / held
        truncated[-held:] -= np.sum(truncated) / held
        truncated[-1] -= np.sum(truncated)  # what rounding has left
        return truncated

    def without(self, filter_: Real) -> Complex:
        """The kernel with a symmetric filter's response divided out, laid out as `values`."""
        n, half = len(self.values), len(filter_) // 2
        ring = np.zeros(n)
        ring[np.arange(-half, half + 1)] = filter_
        gain = fft.fft(ring).real
        passed = np.abs(self.response) > 1e-3 * ENDED * np.max(np.abs(self.response))
        # Beyond the wavelet's band a gain near zero would blow up what is nothing.
        share = np.where(passed & (gain > 1e-3), self.response / np.maximum(gain, 1e-3), 0.0)
        return fft.ifft(share)


def low_pass(step: int) -> Real:
    """The filter before decimation by `step`, shape (2 * HALF * step - 1,), of unit sum."""
    beta = np.pi * 2 * HALF * (1 - 0.5 * HIGHEST / np.pi) * 0.97
    window = np.kaiser(2 * HALF * step + 1, beta)[1:-1]
    return window / np.sum(window)


#: Samples that are worked on at once; larger blocks are cut at its multiples, so that memory stays
#: bounded. There the base is chosen anew, from every :data:`SPARSE`-th sample of the last ones.
CHUNK, SPARSE = 1024, 8
#: Binary exponents of samples beyond which their products with the weights could overflow, or lose
#: digits. What lies beyond is scaled by a power of two, which is exact.
SAFE = 900


def level_of(latest: Real) -> Real:
    """The base that follows :data:`CHUNK` samples, (CHUNK, c): a glitch among them moves nothing.

    Were it one sample, and that the glitch, what comes next would lose the glitch's rounding.
    """
    # An odd number of samples: no mean of two, which could overflow.
    return np.asarray(np.median(latest[SPARSE::SPARSE], axis=0), dtype=np.float64)


class Tape:
    """The newest rows of an endless table, in one piece of memory.

    `rows`: how many of the newest rows must stay readable.
    """

    def __init__(self, rows: int, columns: int) -> None:
        self._rows = rows
        self._table = np.zeros((2 * rows + 2 * CHUNK, columns))
        self._end = rows
        #: Rows that were ever written.
        self.written = 0

    def append(self, rows: Real) -> None:
        """Add rows at the end, at most :data:`CHUNK`."""
        end = self._end + len(rows)
        if end > len(self._table):
            self._table[: self._rows] = self._table[self._end - self._rows : self._end]
            self._end, end = self._rows, self._rows + len(rows)
        self._table[self._end : end] = rows
        self._end = end
        self.written += len(rows)

    def view(self, first: int, last: int) -> Real:
        """Rows ``[first, last)`` by their number; numbers before 0 are rows of zeros."""
        shift = self._end - self.written
        return self._table[first + shift : last + shift]

    def windows(self, first: int, length: int, step: int, count: int) -> Real:
        """Views of `length` rows from `first` on, every `step` rows; shape (count, length, c).

        They overlap in memory and are for reading only.
        """
        table = self._table
        if first + (count - 1) * step + length > self.written or first < self.written - self._end:
            raise IndexError("these rows are not on the tape")
        down, across = table.strides
        # Not sliding_window_view, which takes longer to check its arguments than to do the sums.
        return np.ndarray(
            (count, length, table.shape[1]),
            table.dtype,
            table,
            (first + self._end - self.written) * down,
            (step * down, down, across),
        )

    def lower(self, offsets: Real) -> None:
        """Subtract from all rows that can still be read."""
        self._table[max(0, self._end - self._rows - CHUNK) : self._end] -= offsets

    def shift(self, exponent: int) -> None:
        """Multiply all rows by a power of two."""
        np.ldexp(self._table, exponent, out=self._table)


class Tapes:
    """A stream of samples at its full rate, and decimated.

    `rows`: samples that must stay readable before each chunk; `coarse`: the same of each decimated
    copy, by its step; `fine`: ``(samples - base) / 2**exponent``, where the base follows the
    samples slowly: a level far from zero would leave the rounding of large numbers in the products;
    `coarse`: the copies, at multiples of their steps; they begin with what their filter sees before
    the start, :data:`~forcelab.signals.streaming.HALF` samples; `exponent`: 0 unless samples are as
    large or as small as nearly to leave the range of float64.
    """

    def __init__(self, channels: int, rows: int, coarse: Mapping[int, int]) -> None:
        self._filters = {step: low_pass(step) for step in coarse}
        widest = max((len(taps) + step for step, taps in self._filters.items()), default=0)
        self.fine = Tape(max(1, rows, widest) + CHUNK, channels)
        self.coarse = {
            step: Tape(samples + HALF + CHUNK // step + 2, channels)
            for step, samples in coarse.items()
        }
        self.exponent = 0
        self._base: Real | None = None
        self._peak = 0.0
        #: The newest sample of all; None before the first.
        self.last: Real | None = None

    def take(self, samples: Real, peak: float) -> None:
        """Write finite samples, at least one, none beyond the next multiple of :data:`CHUNK`.

        `peak` is the largest absolute value among them, or among more that come with them.
        """
        if peak > self._peak:
            self._peak = peak
            self._scale()
        rows = samples if self.exponent == 0 else np.ldexp(samples, -self.exponent)
        written = self.fine.written
        if self._base is None:
            self._base = rows[0].copy()
        elif written % CHUNK == 0:
            shift = level_of(self.fine.view(written - CHUNK, written))
            for tape in (self.fine, *self.coarse.values()):
                tape.lower(shift)
            self._base = self._base + shift
        self.fine.append(rows - self._base)
        for step, tape in self.coarse.items():
            self._decimate(step, tape)
        self.last = samples[-1].copy()

    def _scale(self) -> None:
        """Choose the exponent for the largest sample so far, and bring all there is to it."""
        size = int(np.frexp(self._peak)[1])
        exponent = 0 if abs(size) <= SAFE else size // 64 * 64  # not anew for every larger sample
        step = self.exponent - exponent
        if step == 0:
            return
        self.exponent = exponent
        for tape in (self.fine, *self.coarse.values()):
            tape.shift(step)
        if self._base is not None:
            self._base = np.ldexp(self._base, step)

    def _decimate(self, step: int, tape: Tape) -> None:
        """Write the decimated samples, at multiples of `step`, whose filter has all its samples."""
        filter_ = self._filters[step]
        half = len(filter_) // 2
        first, last = tape.written - HALF, (self.fine.written - 1 - half) // step + 1
        if last > first:
            tape.append(
                filter_ @ self.fine.windows(first * step - half, len(filter_), step, last - first)
            )


#: Samples that one product takes at once: blocks of 20 ms at 1 kHz, with some to spare.
TOGETHER = 32
#: What calling a product costs, and decimating for it, in weights of a sample: measured, 20 us.
CALL, DECIMATION = 1000.0, 700.0
#: Decimations that are thought of. Few, so that several groups share a copy.
STEPS = (1, 4, 16, 64, 256)


@dataclass(frozen=True)
class Level:
    """Scales whose coefficients come from one matrix product."""

    members: slice | NDArray[np.int64]  # (k,), places of the scales among all
    count: int  # how many they are, k
    step: int  # decimation of the copy; 1 where there is none
    rows: int  # outputs of one product at most; the first of them may be any of the first `step`
    #: coarse and fine: How many decimated samples, and how many full-rate ones before the first
    #: row's, take part. The newest decimated sample lies ``HALF * step`` before the first row's.
    coarse: int
    fine: int
    behind: int  # samples that the newest one to take part lies behind the newest of all
    #: (rows * k * 2, coarse + fine + rows), rows by output, scale, and real or imaginary part;
    #: columns by time, decimated first.
    matrix: Real

    @property
    def block(self) -> int:
        """Outputs of each of many products at once: a multiple of the step."""
        return self.rows // self.step * self.step


def plan(
    scales: Real,
    wavelet: Wavelet,
    delays: NDArray[np.int64],
    pasts: NDArray[np.int64],
    together: int | None = None,
) -> tuple[list[Level], NDArray[np.int64]]:
    """Group scales and build their matrices.

    `scales` (k,): in samples; `delays`, `pasts` (k,): samples after and before the coefficient that
    must take part; `together`: the delay at which all coefficients are wanted, at least that of
    each; by default each comes at its own. Gives `aheads` (k,): samples after the coefficient that
    do take part: where all are wanted at one delay, those of a group wait for the same sample,
    which costs nothing.
    """
    order = np.argsort(scales, kind="stable")
    levels, aheads = [], delays.copy()
    parts = _groups(scales[order], _ended(wavelet), delays[order], pasts[order])
    for first, last, step in parts:
        members = order[first:last]
        if together is not None:
            aheads[members] = np.max(delays[members])
        behind = 0 if together is None else together - int(aheads[members[0]])
        kernels = [Kernel.of(float(scales[j]), wavelet) for j in members]
        levels.append(_level(members, kernels, aheads[members], pasts[members], step, behind))
    return levels, aheads


def _ended(wavelet: Wavelet) -> float:
    """The angular frequency, per unit of scale, above which a wavelet's spectrum has ended."""
    frequencies = np.linspace(0.0, 64.0 + 2 * getattr(wavelet, "p", 0.0), 4096)
    size = np.abs(wavelet.spectrum(frequencies)) + np.abs(wavelet.spectrum(-frequencies))
    return float(frequencies[np.flatnonzero(size > ENDED * np.max(size))[-1]])


def _groups(
    scales: Real, ended: float, delays: NDArray[np.int64], pasts: NDArray[np.int64]
) -> list[tuple[int, int, int]]:
    """The cheapest way to part rising scales into groups: first, last, and step of each.

    The wavelet's spectrum ends at `ended` radians per unit of scale. Bellman's recursion over where
    the last group begins.
    """
    k = len(scales)
    cheapest = np.concatenate([[0.0], np.full(k, np.inf)])
    chosen = [(0, 1)] * (k + 1)
    for last in range(1, k + 1):
        delay, past = 0, 0
        for first in range(last - 1, -1, -1):
            delay, past = max(delay, int(delays[first])), max(past, int(pasts[first]))
            taps = delay + past + 1
            for step in STEPS:
                if step > 1 and step * ended > HIGHEST * scales[first]:
                    break
                columns = taps if step == 1 else taps / step + 0.5 * step
                if step > 1:
                    columns += max(2 * HALF * step, HELD * scales[last - 1])
                columns += 0.5 * TOGETHER
                cost = CALL + (step > 1) * DECIMATION + (last - first) * columns
                if cheapest[first] + cost < cheapest[last]:
                    cheapest[last] = cheapest[first] + cost
                    chosen[last] = (first, step)
    groups, last = [], k
    while last:
        first, step = chosen[last]
        groups.append((first, last, step))
        last = first
    return groups[::-1]


def _level(
    members: NDArray[np.int64],
    kernels: list[Kernel],
    delays: NDArray[np.int64],
    pasts: NDArray[np.int64],
    step: int,
    behind: int,
) -> Level:
    """The matrix of one level."""
    taps = int(np.max(delays + pasts)) + 1
    rows = step - 1 + TOGETHER
    if step == 1:
        coarse, fine = 0, taps - 1
    else:
        coarse = max(0, math.ceil((taps + rows) / step) - HALF) + 2
        # What holds beyond the newest sample is no smooth part of the wavelet: at the full rate.
        held = int(HELD * max(kernel.scale for kernel in kernels))
        fine = max((2 * HALF - 1) * step - 1, held)
    matrix = np.empty((rows, len(members), 2, coarse + fine + rows))
    for s, kernel in enumerate(kernels):
        lines = _lines(kernel, int(delays[s]), int(pasts[s]), step, rows, coarse, fine)
        matrix[:, s, 0], matrix[:, s, 1] = lines.real, lines.imag
    # A slice of the output is filled much faster than a choice of places.
    rising = np.array_equal(members, np.arange(members[0], members[0] + len(members)))
    places = slice(int(members[0]), int(members[0]) + len(members)) if rising else members
    flat = matrix.reshape(-1, matrix.shape[3])
    return Level(places, len(members), step, rows, coarse, fine, behind, flat)


def _lines(
    kernel: Kernel, delay: int, past: int, step: int, rows: int, coarse: int, fine: int
) -> Complex:
    """The weights of one scale, shape (rows, coarse + fine + rows)."""
    row = np.arange(rows)[:, None]
    lines = np.zeros((rows, coarse + fine + rows), dtype=np.complex128)
    weights = kernel.weights(delay, past)
    ages = row + fine - np.arange(fine + rows)  # into the past from the row's newest sample
    known = (ages >= 0) & (ages < len(weights))
    lines[:, coarse:][known] = weights[ages[known]]
    if coarse:
        # Places relative to the first row's sample.
        centres = -HALF * step - step * np.arange(coarse - 1, -1, -1)
        away = row - delay - centres  # from the decimated sample to the coefficient
        filter_ = low_pass(step)
        _share(lines, away, past, step * kernel.without(filter_), centres + fine, filter_)
        _balance(lines, away <= past, max(1, int(HELD * kernel.scale) // step))
    return lines


def _share(
    lines: Complex,
    away: NDArray[np.int64],
    past: int,
    smooth: Complex,
    places: NDArray[np.int64],
    filter_: Real,
) -> None:
    """Give the decimated samples their weights, and the full-rate ones what is left for them.

    `lines` (rows, columns): with the weights of the full-rate columns; changed; `away` (rows,
    coarse): distance from each decimated sample to the coefficient's; `past`: the largest distance
    that counts; `smooth`: weight of a decimated sample by distance; `places` (coarse,): where each
    one's filter is centred among the full-rate columns.
    """
    coarse, half = len(places), len(filter_) // 2
    lines[:, :coarse] = np.where(away <= past, smooth[away % len(smooth)], 0.0)
    newest = places[places + half >= 0]
    spread = np.zeros((len(newest), lines.shape[1] - coarse))
    for row, place in zip(spread, newest.tolist(), strict=True):
        low, high = max(0, place - half), max(0, place + half + 1)
        row[low:high] = filter_[half - place + low : half - place + high]
    lines[:, coarse:] -= lines[:, coarse - len(newest) : coarse] @ spread


def _balance(lines: Complex, reached: NDArray[np.bool_], held: int) -> None:
    """Let the oldest `held` decimated samples stand for all before, so that a line's sum is 0.

    Lines that reach no decimated sample are balanced as they are; `reached` is (rows, coarse).
    """
    for line, reached_columns in zip(lines, reached, strict=True):
        places = np.flatnonzero(reached_columns)[:held]
        if places.size:
            line[places] -= np.sum(line) / places.size
            line[places[0]] -= np.sum(line)


#: Delay over scale, and the error of the early estimate of a Morlet with p = 5: root mean square
#: over that of the coefficients, as on the paper's recordings, to 6 % up to 3 scales and to a fifth
#: beyond. On random walks it is up to a sixth less; on white noise up to a third more at 2 scales,
#: and twice as much at 5; more still of a scale that is quieter than its neighbours, on the
#: made-up forces of ``python -m tests.benchmarks stream`` up to three times.
EARLY = (
    (0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0),
    (0.8, 0.55, 0.32, 0.15, 0.054, 0.016, 3.5e-3, 8e-5, 7e-7),
)


def early_error(delay_in_scales: ArrayLike) -> Real:
    """The expected error of coefficients `delay_in_scales` after their sample, see :data:`EARLY`.

    `delay_in_scales`: delay over scale, at least 0.
    """
    at = np.clip(np.asarray(delay_in_scales, dtype=np.float64), 0.0, EARLY[0][-1])
    return np.exp(np.interp(at, EARLY[0], np.log(EARLY[1])))


class StreamingCwt:
    """Wavelet coefficients of samples as they come.

    `scales` (k,): in samples, positive, in any order; `wavelet`: the Morlet with p = 5 by default;
    `tolerance`: error of a complete coefficient relative to the largest one of its scale. It is
    held 3.9 scales after the sample for 1.4e-3, 4.8 for 3e-5 and 5.6 for 3e-7 (Morlet); `latency`
    (k,): samples, of all scales or of each, after which a coefficient is given even if its wavelet
    has not passed yet, with the last value held beyond. By default every wavelet is waited for;
    `together`: whether the coefficients of all scales come at one delay, the latency or else that
    of the widest, so that a column of what comes belongs to one sample; `scales` (k,); `complete`
    (k,): samples after which the wavelet of each scale has passed; `delays` (k,): samples after
    which its coefficients are given: `complete`, or the latency; `aheads` (k,): samples after the
    coefficient's that take part in it, at most the delay; `pasts` (k,): samples before the
    coefficient's that take part in it.

    The cost of a sample does not depend on the size of blocks, nor on how long the stream has
    been running. A wavelet that is cut at the Nyquist frequency (scales below
    ``(p + 3.7) / pi``, 2.8 samples for p = 5) rings for ever, offline too; it is waited for until
    the ringing has fallen to the tolerance, 512 samples at most. What is left then is heard of
    signals with much power at the Nyquist frequency only: of an impulse, at scale 2, the ringing
    of 0.35 / m of the peak `m` samples away.
    """

    def __init__(
        self,
        scales: Sequence[float] | Real,
        channels: int,
        wavelet: Wavelet | None = None,
        tolerance: float = 3e-5,
        latency: int | Sequence[int] | NDArray[np.int64] | None = None,
        together: bool = False,
    ) -> None:
        self.scales = np.atleast_1d(np.asarray(scales, dtype=np.float64))
        if self.scales.ndim != 1 or not np.all((self.scales > 0) & np.isfinite(self.scales)):
            raise InputError("Scales are positive numbers of samples.")
        if channels < 1:
            raise InputError(f"A stream needs at least one channel, not {channels}.")
        if not 1e-8 <= tolerance < 0.5:
            raise InputError(f"The tolerance must lie between 1e-8 and 0.5, not at {tolerance}.")
        if latency is not None and np.min(latency) < 0:
            raise InputError(f"The latency is a number of samples from 0, not {np.min(latency)}.")
        self.channels = channels
        self.tolerance = tolerance
        self._wavelet = wavelet or Morlet()
        self.complete = reaches(self.scales, self._wavelet, tolerance)
        self.pasts = reaches(self.scales, self._wavelet, 0.1 * tolerance)
        aheads = self.complete if latency is None else np.minimum(self.complete, latency)
        longest = int(np.max(aheads if latency is None else latency, initial=0))
        self._levels, self.aheads = plan(
            self.scales, self._wavelet, aheads, self.pasts, longest if together else None
        )
        self.delays = np.full_like(aheads, longest) if together else aheads
        self.reset()

    def reset(self) -> None:
        """Forget all samples; the next one is the first."""
        fine = max((lv.fine + lv.rows + lv.behind for lv in self._levels), default=0)
        coarse: dict[int, int] = {}
        for lv in self._levels:
            if lv.step > 1:
                samples = lv.coarse + (lv.rows + lv.behind) // lv.step + 1
                coarse[lv.step] = max(coarse.get(lv.step, 0), samples)
        self._tapes = Tapes(self.channels, fine, coarse)

    @property
    def pushed(self) -> int:
        """Samples that have come since the start."""
        return self._tapes.fine.written

    def push(self, block: ArrayLike) -> Complex:
        """Take samples and give as many coefficients of each scale.

        `block` (n, channels): finite numbers. The first sample of all is taken as having held for
        ever. Gives (channels, k, n): column `i` of scale `j` is the coefficient at sample ``first +
        i - delays[j]``, where `first` is what :attr:`pushed` was before; places before 0 are from
        before the start.
        """
        samples = np.asarray(block, dtype=np.float64)
        if samples.ndim != 2 or samples.shape[1] != self.channels:
            raise InputError(
                f"A block of {self.channels} channels has the shape (n, {self.channels}), "
                f"not {samples.shape}."
            )
        peak = float(np.max(np.abs(samples), initial=0.0))
        if not peak < np.inf:  # nor is NaN
            raise InputError("A stream takes finite samples only; bridge what is missing first.")
        out = np.empty((self.channels, len(self.scales), len(samples)), dtype=np.complex128)
        # Real and imaginary parts as an axis of their own.
        parts = out.view(np.float64).reshape(*out.shape, 2)
        start = 0
        while start < len(samples):
            chunk = samples[start : start + CHUNK - self.pushed % CHUNK]
            self._tapes.take(chunk, peak)
            self._give(parts[:, :, start : start + len(chunk)])
            start += len(chunk)
        if self._wavelet.real:
            out.imag = 0.0  # what rounding leaves there would flip the phase of negatives
        return out

    def finish(self) -> Complex:
        """End the stream: the coefficients that are still to come, with the last value held.

        Gives (channels, k, m): as of :meth:`push`, for ``m = max(delays)`` further samples.
        """
        rest = int(np.max(self.delays, initial=0))
        if self._tapes.last is None:
            return np.empty((self.channels, len(self.scales), 0), dtype=np.complex128)
        return self.push(np.broadcast_to(self._tapes.last, (rest, self.channels)))

    def _give(self, out: Real) -> None:
        """Compute the coefficients that the newest samples bring; they fill `out`."""
        n = out.shape[2]
        for level in self._levels:
            first = self.pushed - n - level.behind
            done = 0
            while done < n:
                row = (first + done) % level.step
                count = (n - done) // level.block if row == 0 else 0
                if count > 1:
                    size = count * level.block
                    coefficients = self._blocks(level, first + done, count)
                else:
                    size = min(n - done, level.rows - row)
                    coefficients = self._product(level, first + done - row, row, size)
                out[:, level.members, done : done + size] = coefficients
                done += size
        if self._tapes.exponent:
            np.ldexp(out, self._tapes.exponent, out=out)

    def _product(self, level: Level, origin: int, row: int, size: int) -> Real:
        """Outputs from `row` of a block at `origin` on; shape (c, k, size, 2)."""
        columns = level.fine + row + size
        first = row * 2 * level.count
        weights = level.matrix[first : first + size * 2 * level.count, : level.coarse + columns]
        samples = self._tapes.fine.view(origin - level.fine, origin - level.fine + columns)
        if level.coarse:
            end = origin // level.step + 1  # on the tape: HALF back from here, HALF on
            coarse = self._tapes.coarse[level.step].view(end - level.coarse, end)
            samples = np.concatenate([coarse, samples])
        product = weights @ samples
        return product.reshape(size, level.count, 2, self.channels).transpose(3, 1, 0, 2)

    def _blocks(self, level: Level, origin: int, count: int) -> Real:
        """Outputs of `count` whole blocks from `origin` on; shape (c, k, count * block, 2)."""
        block, columns, c = level.block, level.fine + level.block, self.channels
        # What the blocks see, side by side.
        samples = np.empty((level.coarse + columns, count, c))
        if level.coarse:
            first = origin // level.step + 1 - level.coarse
            coarse = self._tapes.coarse[level.step]
            windows = coarse.windows(first, level.coarse, block // level.step, count)
            samples[: level.coarse] = windows.transpose(1, 0, 2)
        windows = self._tapes.fine.windows(origin - level.fine, columns, block, count)
        samples[level.coarse :] = windows.transpose(1, 0, 2)
        weights = level.matrix[: block * 2 * level.count, : level.coarse + columns]
        product = (weights @ samples.reshape(len(samples), -1)).reshape(
            block, level.count, 2, count, c
        )
        return product.transpose(4, 1, 3, 0, 2).reshape(c, level.count, count * block, 2)


class CausalGlitches:
    """Takes the glitches out of a stream, as :func:`~forcelab.signals.conditioning.glitches` would.

    What is usual is what the :data:`~forcelab.signals.conditioning.RARE` samples before a glitch
    were like, and it is measured from the last of them: a stream does not know its median.
    """

    def __init__(self, columns: int) -> None:
        self._past = np.full((RARE, columns), np.nan)

    def push(self, values: Real, ended: bool) -> tuple[Real, int]:
        """Mark glitches.

        `values` (n, columns): those that were not settled the last time, and what came since; NaN
        where missing. Gives `values` (n, columns): with NaN for glitches; `settled`: the first so
        many; the rest is to be pushed again, with what follows.
        """
        series = np.concatenate([self._past, values])
        settled = len(values)
        # Exact, and as good as always the answer: nothing is as far from anything else.
        if not series.max() - series.min() <= GLITCH:  # or a sample is missing
            apart = np.fmax.reduce(series) - np.fmin.reduce(series)
            for column in np.flatnonzero(apart > GLITCH).tolist():
                settled = min(settled, _without(series[:, column], ended))
        self._past = series[settled : settled + RARE].copy()
        return series[RARE:], settled


def _without(series: Real, ended: bool) -> int:
    """Put NaN for the glitches behind the first `RARE` values; how many of these are settled."""
    first, n = RARE, len(series)
    doubtful = _doubtful(series).tolist()
    while first < n:
        wild = 0
        if doubtful[first]:
            wild = _wild(series[first - RARE : first], series[first : first + SPIKE + 1])
        if 0 < wild <= SPIKE:
            behind = first + wild
            if behind == n and not ended:
                return first - RARE
            series[first:behind] = np.nan
            doubtful[behind : behind + SPIKE] = [True] * SPIKE  # other samples precede them now
        first += max(wild, 1)
    return n - RARE


def _doubtful(series: Real) -> NDArray[np.bool_]:
    """Which values are to be looked at: all that are wild, and few others.

    A glitch is further from the value before it than :data:`GLITCH` times the nearer of the two
    before that: what is usual leaves out one value at most. Where one is missing it may be.
    """
    last = series[2:-1]
    usual = np.minimum(np.abs(series[1:-2] - last), np.abs(series[:-3] - last))
    calm = np.abs(series[3:] - last) <= GLITCH * np.maximum(usual, 1.0)
    return np.concatenate([np.ones(3, dtype=bool), ~calm])


def _wild(before: Real, ahead: Real) -> int:
    """How many of the next values are too far from those before, one after the other."""
    known = before[np.isfinite(before)]
    if len(known) <= RARE // 2:  # nobody knows what is usual
        return 0
    usual = max(1.0, float(robust_peak(known - known[-1])))
    near = np.abs(ahead - known[-1]) <= GLITCH * usual
    near |= np.isnan(ahead)
    return int(np.argmax(near)) if near.any() else len(ahead)
