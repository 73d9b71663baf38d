"""Powers and phases of a channel's wavelet coefficients on the columns of the screen.

Phases of a scalogram from the band of frequencies that each scale answers to. A scale `a` answers
to a band of about ``12 / a`` radians a sample only. So the band alone is cut from the signal's
spectrum and brought back to time by a short transform: a few points every `a` samples instead of
one every sample.

Neighbouring scales share overlapping frames of the signal. Of a frame's spectrum the band that a
scale answers to is brought back to time by a short transform: a point every few samples instead
of one at every sample. All is in single precision, which errs by 1e-7 of the frame's largest
sample, a tenth of where wavelets are cut; frames lie side by side, since transforms of several
rows take a quarter of the time.

One channel of a demonstration on its uniform grid, read piece by piece. The same samples as
:func:`forcelab.signals.grid.on_grid` gives at the recording's own rate, but only where they are
asked for, so that a view of a long recording costs what it shows. The whole channel is looked
through for glitches only once a number comes up that may be one.
"""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from forcelab.demonstration import GAP_PERIODS, Demonstration
from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.signals.channels import channel_map
from forcelab.signals.conditioning import GLITCH
from forcelab.signals.cwt_engine import slope_at_zero
from forcelab.signals.grid import MAX_SAMPLES, UNIFORM, measured, readings
from forcelab.signals.wavelets import Morlet

#: Threads at most: what the window needs is left to it.
THREADS = 2


def in_threads(
    tasks: Sequence[Callable[[], None]], text: str, threads: int = THREADS
) -> Generator[Progress, None, None]:
    """Do tasks, none before its turn; a job.

    `tasks`: most of their time goes into numpy and scipy, which let other threads run.
    """
    together = min(threads, os.cpu_count() or 1)
    if together == 1 or len(tasks) <= 1:
        for i, task in enumerate(tasks):
            task()
            yield Progress(i + 1, len(tasks), text)
        return
    with ThreadPoolExecutor(together) as pool:
        waiting = [pool.submit(task) for task in tasks[:together]]
        for i in range(len(tasks)):
            waiting.pop(0).result()
            if i + together < len(tasks):
                waiting.append(pool.submit(tasks[i + together]))
            yield Progress(i + 1, len(tasks), text)


Real = NDArray[np.float64]
Single = NDArray[np.float32]
Whole = NDArray[np.int64]

#: Times and rates round; an edge that is so little past a sample is taken for the sample.
_ROUNDING = 1e-6


class Columns:
    """Columns of the screen on the grid.

    `first`: left edge of the first, in samples of the grid; `width`: samples a column, at least 1.
    """

    def __init__(self, first: float, width: float, count: int) -> None:
        self.first, self.width, self.count = first, width, count

    @property
    def last(self) -> float:
        """Right edge of the last one."""
        return self.first + self.width * self.count

    def edges(self) -> Real:
        """Edges in samples, shape (count + 1,)."""
        return np.asarray(self.first + self.width * np.arange(self.count + 1), dtype=np.float64)

    def bounds(self) -> Whole:
        """The first sample of each column, and the one after the last column."""
        bounds = np.ceil(self.edges() - _ROUNDING).astype(np.int64)
        # A column of one sample that rounding has lost takes the one before it.
        bounds[-1] = max(bounds[-1], bounds[0] + 1)
        return bounds

    def centres(self) -> Whole:
        """The sample in the middle of each column, shape (count,)."""
        return np.floor(self.first + self.width * (np.arange(self.count) + 0.5) + 1e-9).astype(
            np.int64
        )

    def largest(self, power: Single, start: int, step: int) -> Single:
        """The largest power in each column.

        `power` (s, m): at the samples ``start + i step``, from one in or before the first column to
        one beyond the last. Between two of them powers lie on a straight line. Gives (s, count).
        """
        bounds = self.bounds() - start
        firsts, lasts = bounds[:-1], np.maximum(bounds[1:] - 1, bounds[:-1])
        if step == 1:
            return np.maximum.reduceat(power[:, : lasts[-1] + 1], firsts, axis=1)
        low, high = -(-firsts // step), lasts // step + 1
        out = np.maximum(_read(power, firsts, step), _read(power, lasts, step))
        # Columns without a point of their own are told by their ends alone.
        inner = np.flatnonzero(low < high)
        if inner.size:
            # The points of one column end where those of the next one begin.
            largest = np.maximum.reduceat(power[:, : high[inner[-1]]], low[inner], axis=1)
            out[:, inner] = np.maximum(out[:, inner], largest)
        return out


def _read(power: Single, samples: Whole, step: int) -> Single:
    """Powers at samples between points."""
    left, rest = np.divmod(samples, step)
    share = (rest / step).astype(np.float32)
    before = power[:, left]
    after = power[:, np.minimum(left + 1, power.shape[1] - 1)]
    after -= before
    after *= share
    after += before
    return after


Complex = NDArray[np.complex128]
SingleComplex = NDArray[np.complex64]

#: Wavelets and filters are cut where they have fallen to this share of their peak.
TOLERANCE = 1e-6
#: Half-width of a Gaussian of unit deviation at that share.
_CUT = math.sqrt(2 * math.log(1 / TOLERANCE))
#: Samples on either side that a wavelet which the Nyquist frequency cuts is followed for: for
#: magnitudes, and for phases, which what is left of the ringing turns.
RINGING, PHASE_RINGING = 256, 1024
#: Samples over which the last value leads to the first.
_RAMP = 64
#: Points for each independent one: a row is read between its points.
_FINE = 4


def reach(scale: float) -> int:
    """Samples on either side that a coefficient rests on, to within the tolerance."""
    return math.ceil(_CUT * scale) + 1


def is_cut(scale: float, wavelet: Morlet) -> bool:
    """Whether the Nyquist frequency cuts the wavelet, which then rings beyond its reach."""
    return math.pi * scale < wavelet.p + 6.5  # see Morlet: what is cut beyond is below 1e-9


def band(wavelet: Morlet) -> tuple[float, float]:
    """The angular frequencies times scale between which the wavelet's spectrum lies."""
    low, high = wavelet.p - _CUT, wavelet.p + _CUT
    if low < 0:
        # The term that makes the mean zero lies around zero, and is small beyond p of about 5.
        low = min(low, -math.sqrt(_CUT**2 - wavelet.p**2))
    return low, high


def _spectrum(values: Real) -> tuple[Complex, int]:
    """Spectrum of the samples on a ring, the last value leading smoothly to the first."""
    n = len(values)
    length = fft.next_fast_len(n + _RAMP, real=True)
    place = (np.arange(length - n) - 0.5 * (length - n - 1)) / _RAMP
    share = 0.5 + 0.5 * np.cos(np.pi * np.clip(0.5 + place, 0.0, 1.0))
    ring = np.empty(length)
    ring[:n] = values
    ring[n:] = share * values[-1] + (1 - share) * values[0]
    return fft.rfft(ring, overwrite_x=True), length


def band_rows(
    values: Real,
    origin: int,
    step: int,
    *,
    scales: Real,
    wavelet: Morlet,
    columns: Columns,
) -> Iterator[Complex]:
    """Compute rows from one piece of the signal.

    `values` (n,): every `step`-th sample, the columns and the reach of the widest scale on either
    side; `origin`: place of ``values[0]`` on the grid, in samples; `step`: samples of the grid
    between two of `values`; what lies above their Nyquist frequency has been filtered out; `scales`
    (k,): in samples of the grid.
    """
    spectrum, length = _spectrum(values)
    low, high = band(wavelet)
    for scale in scales:
        widest = 2 * np.pi * scale / (high - low) / step  # between points that tell all, in steps
        between = max(1.0, widest / _FINE)
        unit = 2 * np.pi / length / step
        k = np.arange(
            max(int(np.ceil(low / scale / unit)), -(length // 2) + 1),
            min(int(np.floor(high / scale / unit)), length // 2) + 1,
        )
        part = np.empty(len(k), dtype=np.complex64)
        below = int(np.searchsorted(k, 0))
        part[:below] = np.conj(spectrum[-k[:below]])
        part[below:] = spectrum[k[below] : k[-1] + 1] if below < len(k) else 0.0
        response = math.sqrt(scale) * wavelet.spectrum(scale * unit * k).real
        part *= response.astype(np.float32)
        if length % 2 == 0 and len(k) and k[-1] == length // 2:
            part[-1] *= 0.5  # this bin stands for both signs of its frequency
        count = min(length, fft.next_fast_len(max(int(np.ceil(length / between)), len(k), 1)))
        middle = round(wavelet.p / scale / unit)
        middle = min(max(middle, int(k[0])), int(k[-1])) if len(k) else 0
        # Errors of 1e-7 of the row's largest: a tenth of the tolerance, at half the time.
        around = np.zeros(count, dtype=np.complex64)
        upper = int(np.searchsorted(k, middle))
        around[: len(k) - upper] = part[upper:]
        around[count - upper :] = part[:upper]
        points = fft.ifft(around, overwrite_x=True)
        points *= np.float32(count / length)
        spacing = length / count * step
        places = columns.centres() - origin
        turns = np.exp(2j * np.pi * middle / length * (places / step))
        yield _between(points, places / spacing) * turns


def _between(points: SingleComplex, places: Real) -> Complex:
    """Read a smooth row between its points, along straight lines."""
    left = np.clip(np.floor(places).astype(np.int64), 0, len(points) - 1)
    share = places - left
    right = np.minimum(left + 1, len(points) - 1)
    return points[left] * (1 - share) + points[right] * share


Spectra = NDArray[np.complex64]
Take = Callable[[slice, int, Single], None]

#: Points of the grid to each scale at least. The largest power between two points is missed by
#: 1.6 % at most where an impact is, as ``|W|^2 = exp(-t^2 / a^2)`` falls over half a step; the
#: beat of two tones falls faster. What is narrower than a step is read along straight lines, which
#: takes more points.
POINTS, FINE_POINTS = 4, 32
#: Scales that share frames are up to so many times the narrowest of them.
TOGETHER = 12.0
#: Fresh samples of a frame at least, and to each sample that overlaps.
_FEWEST, _ROOM = 1 << 10, 7
#: Points that are transformed at once: they lie in the cache with their powers.
_CACHED = 1 << 17


def grid_step(scale: float, width: float) -> int:
    """Samples between the points of a scale's grid, a power of two, for columns of a width."""
    step = max(scale / FINE_POINTS, min(scale / POINTS, width))
    return 1 << max(0, math.floor(math.log2(max(1.0, step))))


@dataclass(frozen=True, eq=False, slots=True)
class _Rows:
    """Neighbouring scales with the same grid."""

    rows: slice  # their places among all scales
    step: int  # samples between two points
    #: The bin of the frame's spectrum that becomes the points' bin 0: powers do not tell by which
    #: frequency a row is turned, and the band of a high carrier lies far from 0.
    first: int
    #: positive and negative: (s, 2 * bins), by what the spectrum's bins `first`, `first` + 1, ...
    #: and -1, -2, ... are multiplied, each twice: for their real and imaginary parts.
    positive: Single
    negative: Single
    #: (s, 1), what a straight line answers, for each unit of its slope; it lies in the spectrum's
    #: bin 0.
    slopes: Single


class Frames:
    """Neighbouring scales that share frames of one length.

    `scales` (s,): in samples, rising; `first`: place of the first one among all scales; `width`:
    samples of a column; where a spot is one column, without end; `span`: samples that are wanted at
    once; frames are made to fit; `length`: samples of a frame instead, a power of two; `half`:
    samples before and after those that are told about which each frame needs; `hop`: samples that a
    frame tells about; `count`: frames that the span takes.
    """

    def __init__(
        self,
        scales: Real,
        first: int,
        wavelet: Morlet,
        *,
        width: float = math.inf,
        span: int = 0,
        length: int = 0,
    ) -> None:
        steps = [grid_step(a, width) for a in scales.tolist()]
        widest = steps[-1]
        ringing = RINGING if is_cut(float(scales[0]), wavelet) else 0
        needed = max(reach(float(scales[-1])), ringing)
        self.half = widest * -(-needed // widest)
        usual = max(_FEWEST, _ROOM * 2 * self.half)
        self.count = max(1, round(span / usual))
        self.hop = widest * -(-span // (widest * self.count)) or length - 2 * self.half
        needed = length or self.hop + 2 * self.half
        self.length = widest * int(fft.next_fast_len(-(-needed // widest), real=True))
        self._parts = []
        start = 0
        for end in range(1, len(steps) + 1):
            together = end < len(steps) and steps[end] == steps[start]
            if together:
                low, high = self._bins(scales[start : end + 1], wavelet)
                together = high - low < self.length // steps[start]
            if not together:
                rows = slice(first + start, first + end)
                self._parts.append(self._rows(scales[start:end], rows, steps[start], wavelet))
                start = end

    def _bins(self, scales: Real, wavelet: Morlet) -> tuple[int, int]:
        """The first and the last bin of a frame's spectrum that scales answer to."""
        low, high = (edge * self.length / (2 * np.pi) for edge in band(wavelet))
        above = min(math.floor(high / scales[0]), self.length // 2)
        lowest = math.ceil(min(low / scales[0], low / scales[-1]))
        return max(min(lowest, above), -((self.length - 1) // 2)), above

    def _rows(self, scales: Real, rows: slice, step: int, wavelet: Morlet) -> _Rows:
        """Responses of scales of one step, whose bins fit into its points."""
        points = self.length // step
        lowest, above = self._bins(scales, wavelet)
        first, below = max(lowest, 0), max(-lowest, 0)
        omega = 2 * np.pi / self.length * np.arange(lowest, above + 1)
        sizes = np.sqrt(scales)[:, None] * wavelet.spectrum(scales[:, None] * omega).real
        sizes *= points / self.length  # the transform back divides by its own points
        if 2 * above == self.length:
            sizes[:, -1] *= 0.5  # this bin stands for both signs of its frequency
        sizes = sizes.astype(np.float32)
        slopes = np.array([slope_at_zero(wavelet, a) for a in scales.tolist()])
        return _Rows(
            rows,
            step,
            first,
            np.repeat(sizes[:, below:], 2, axis=1),
            np.repeat(sizes[:, :below][:, ::-1], 2, axis=1),
            (points * slopes[:, None]).astype(np.float32),
        )

    def _spectra(self, frames: Real) -> tuple[Spectra, Single]:
        """Spectra of frames, and the slopes of the straight lines that were taken away before.

        The ring of a frame would turn such a line into a jump, beside which what a slow force
        holds at high frequencies is lost.

        `frames` (f, length). Gives `spectra` (f, length // 2 + 1); `slopes` (f,).
        """
        slopes = (frames[:, -1:] - frames[:, :1]) / (self.length - 1)
        flat = np.empty(frames.shape, dtype=np.float32)
        place = np.arange(self.length)
        for row, frame, slope in zip(flat, frames, slopes[:, 0].tolist(), strict=True):
            line = slope * place
            line += frame[0]
            np.subtract(frame, line, out=row, casting="same_kind")
        return fft.rfft(flat, axis=-1, overwrite_x=True), slopes[:, 0].astype(np.float32)

    def cut(self, values: Real) -> Real:
        """Frames of a piece, shape (count, length); its first `half` samples lie before.

        `values` (n,): at least :attr:`reading` samples.
        """
        stride = values.strides[0]
        shape, strides = (self.count, self.length), (self.hop * stride, stride)
        return np.lib.stride_tricks.as_strided(values, shape, strides, writeable=False)

    @property
    def reading(self) -> int:
        """Samples that all frames together are made of."""
        return (self.count - 1) * self.hop + self.length

    def tasks(self, values: Real, take: Take) -> list[Callable[[], None]]:
        """What there is to do for a piece; tasks may be done at the same time.

        `values` (n,): of which :meth:`cut` makes frames; `take`: is given which scales, the samples
        between two points, and their powers, a float32 array of shape (scales, points); the first
        point is that at ``values[half]``.
        """
        return self.tasks_of(self.cut(values), take)

    def tasks_of(self, frames: Real, take: Take) -> list[Callable[[], None]]:
        """The same of frames that need not be neighbours, shape (f, length)."""
        spectra, slopes = self._spectra(frames)
        tasks: list[Callable[[], None]] = []
        for part in self._parts:
            size = len(part.positive)
            together = max(1, _CACHED // (len(frames) * (self.length // part.step)))
            for start in range(0, size, together):
                chosen = slice(start, min(start + together, size))
                rows = slice(part.rows.start + chosen.start, part.rows.start + chosen.stop)
                tasks.append(partial(self._emit_rows, part, chosen, rows, spectra, slopes, take))
        return tasks

    def _emit_rows(
        self,
        part: _Rows,
        chosen: slice,
        rows: slice,
        spectra: Spectra,
        slopes: Single,
        take: Take,
    ) -> None:
        """Hand over the powers of some rows."""
        take(rows, part.step, self._power(part, chosen, spectra, slopes))

    def _power(self, part: _Rows, chosen: slice, spectra: Spectra, slopes: Single) -> Single:
        """``|W|^2`` of some rows, shape (rows, frames * hop // step), frame by frame."""
        positive, negative = part.positive[chosen], part.negative[chosen]
        count, points = len(spectra), self.length // part.step
        skipped, length = self.half // part.step, self.hop // part.step
        out = np.empty((len(positive), count, length), dtype=np.float32)
        together = min(count, max(1, _CACHED // (len(positive) * points)))
        above, below = positive.shape[1], negative.shape[1]
        room = np.empty((len(positive), together, points), dtype=np.complex64)
        for f in range(0, count, together):
            source = spectra[f : f + together]
            product = room[:, : len(source)]
            parts = product.view(np.float32)
            lines = source.view(np.float32)[:, 2 * part.first : 2 * part.first + above]
            np.multiply(lines, positive[:, None], out=parts[:, :, :above])
            parts[:, :, above : 2 * points - below] = 0.0
            if below:
                mirrored = np.conj(source[:, 1 : below // 2 + 1]).view(np.float32)
                turned = (mirrored * negative[:, None]).view(np.complex64)
                product[:, :, : -below // 2 - 1 : -1] = turned
            if part.first == 0:
                product[:, :, 0] = -1j * part.slopes[chosen] * slopes[f : f + together]
            rows = fft.ifft(product, axis=-1, overwrite_x=True)[:, :, skipped : skipped + length]
            squares = np.square(rows.view(np.float32), out=rows.view(np.float32))
            np.add(squares[..., 0::2], squares[..., 1::2], out=out[:, f : f + together])
        return out.reshape(len(positive), -1)


def bank(scales: Real, wavelet: Morlet, span: int, width: float) -> list[Frames]:
    """Frames for all scales, narrow wavelets with short ones.

    `scales` (k,): in samples, rising; `span`: samples that are wanted at once.
    """
    groups = []
    start = 0
    while start < len(scales):
        end = int(np.searchsorted(scales, TOGETHER * scales[start], side="right"))
        groups.append(Frames(scales[start:end], start, wavelet, span=span, width=width))
        start = end
    return groups


Flags = NDArray[np.bool_]

#: Stamps or samples looked at in one step.
BLOCK = 1 << 19
#: A channel is looked through by one thread, and the others wait for what it finds.
_LOOKING = threading.Lock()


@dataclass(frozen=True, slots=True)
class Level:
    """How samples are shifted and sized before single precision sees them."""

    shift: float  # what lies in the middle of them
    exponent: int  # they are divided by two to this power

    @classmethod
    def of(cls, low: float, high: float) -> Level:
        """That of samples from `low` to `high`."""
        largest = max(abs(low), abs(high))
        # Halved before they meet: the sum of two numbers near 1e308 overflows.
        return cls(0.5 * low + 0.5 * high, int(np.frexp(largest)[1]) if largest > 0 else 0)

    def sized(self, values: Real) -> Real:
        """Samples shifted and divided, in place."""
        values -= self.shift
        return np.ldexp(values, -self.exponent, out=values)


@dataclass(frozen=True, eq=False, slots=True)
class Source:
    """A channel on a uniform grid."""

    demonstration: Demonstration
    channel: str  # a recorded channel, or a recognition channel such as ``"tangential 1"``
    #: The recorded columns it is made of: two for a tangential magnitude, one for any other.
    columns: tuple[int, ...]
    #: Whether the samples are the grid; otherwise straight lines between them are read.
    uniform: bool
    rate: float  # samples a second
    count: int  # how many samples the grid has
    _wild: dict[int, NDArray[np.int64]] = field(default_factory=dict, init=False, repr=False)

    def place(self, time: float) -> float:
        """Where on the grid a time lies, in samples from the first."""
        return (time - self.demonstration.start) * self.rate

    def time(self, place: float) -> float:
        """When a place on the grid is, in seconds."""
        return self.demonstration.start + place / self.rate

    def read(self, first: int, last: int) -> tuple[Real, Flags]:
        """Read the samples ``first .. last - 1``; beyond the ends the end values hold.

        Gives `values` (last - first,): missing samples are bridged by straight lines, in each
        recorded column on its own; `known` (last - first,): false in gaps of the stamps, in long
        runs of missing samples and beyond the ends.
        """
        inner = max(0, min(first, self.count - 1)), max(1, min(last, self.count))
        parts, known = [], np.ones(inner[1] - inner[0], dtype=bool)
        for column in self.columns:
            if self.uniform:
                part, measured = self._recorded(column, *inner)
            else:
                part, measured = self._between(column, *inner)
            parts.append(part)
            known &= measured
        values = parts[0] if len(parts) == 1 else np.hypot(parts[0], parts[1])
        before, after = max(0, inner[0] - first), max(0, last - inner[1])
        if before or after:
            values = np.pad(values, (before, after), mode="edge")[: last - first]
            known = np.pad(known, (before, after))[: last - first]
        return values, known

    def pieces(self, firsts: NDArray[np.int64], length: int) -> tuple[Real, Flags]:
        """Read pieces of one length from each of several samples on, faster than one by one.

        Gives `values` (len(firsts), length): as of :meth:`read`; `known` (len(firsts),): whether
        there is anything known in a piece.
        """
        values = np.empty((len(firsts), length))
        whole = np.zeros(len(firsts), dtype=bool)
        if self.uniform and len(self.columns) == 1:
            whole = (firsts >= 0) & (firsts + length <= self.count)
            column = self.demonstration.signals[:, self.columns[0]]
            for row in np.flatnonzero(whole).tolist():
                values[row] = column[firsts[row] : firsts[row] + length]
            whole[whole] = _plain(values[whole]).all(axis=1)
        known = whole.copy()
        for row in np.flatnonzero(~whole).tolist():
            first = int(firsts[row])
            values[row], measured = self.read(first, first + length)
            known[row] = measured.any()
        return values, known

    def _recorded(self, column: int, first: int, last: int) -> tuple[Real, Flags]:
        """Recorded samples as they are, bridged from the nearest ones even outside the piece."""
        values = self.demonstration.signals[first:last, column].copy()
        is_measured = self._measured(column, first, values)
        if is_measured.all():
            return values, is_measured
        places, heights = np.flatnonzero(is_measured) + first, values[is_measured]
        before = after = 0  # samples missing beyond the piece, of the runs it begins and ends in
        # Only a piece that begins or ends in a run needs to look for the run's other side.
        if not is_measured[0]:
            left = self._finite(column, first, -1)
            before = first if left is None else first - left - 1
            if left is not None:
                places = np.append(left, places)
                heights = np.append(self.demonstration.signals[left, column], heights)
        if not is_measured[-1]:
            right = self._finite(column, last, 1)
            after = (len(self.demonstration.signals) if right is None else right) - last
            if right is not None:
                places = np.append(places, right)
                heights = np.append(heights, self.demonstration.signals[right, column])
        numbers = np.arange(first, last)
        bridged = np.interp(numbers, places, heights) if places.size else np.zeros(last - first)
        return bridged, ~_long_runs(~is_measured, before, after)

    def _measured(self, column: int, first: int, values: Real) -> Flags:
        """Which of the recorded samples from `first` on a sensor can have read."""
        is_measured = _plain(values)
        if is_measured.all():
            return is_measured
        is_measured = measured(values)
        if np.abs(values, where=is_measured, out=np.zeros(len(values))).max() > GLITCH / 2:
            glitches = self.glitches(column)
            low, high = np.searchsorted(glitches, (first, first + len(values)))
            is_measured[glitches[low:high] - first] = False
        return is_measured

    def glitches(self, column: int) -> NDArray[np.int64]:
        """Which samples of a recorded column are glitches, rising; looked for once."""
        with _LOOKING:
            if column not in self._wild:
                values = self.demonstration.signals[:, column]
                lost = measured(values) & ~np.isfinite(readings(values))
                self._wild[column] = np.flatnonzero(lost)
            return self._wild[column]

    @property
    def looked_at(self) -> tuple[int, ...]:
        """The recorded columns that were looked through for glitches."""
        return tuple(self._wild)

    def know_glitches(self, column: int, places: NDArray[np.int64]) -> None:
        """Take it that these are the glitches of a recorded column, and no others."""
        self._wild[column] = places

    def left_out(self, first: float, last: float) -> int:
        """How many glitches there are between two places, as far as they were come across."""
        # Asked for with every paint, while a job may come across more of them.
        span = self.time(first), self.time(last)
        begin, end = np.searchsorted(self.demonstration.times, span).tolist()
        glitches = tuple(self._wild.values())
        return sum(int(np.diff(np.searchsorted(places, (begin, end)))[0]) for places in glitches)

    def _finite(self, column: int, start: int, step: int) -> int | None:
        """The nearest sample that is there before `start`, or from `start` on."""
        signals = self.demonstration.signals
        while start > 0 if step < 0 else start < len(signals):
            end = max(0, start - BLOCK) if step < 0 else min(len(signals), start + BLOCK)
            low, high = min(start, end), max(start, end)
            places = np.flatnonzero(self._measured(column, low, signals[low:high, column]))
            if places.size:
                return low + int(places[-1 if step < 0 else 0])
            start = end
        return None

    def _between(self, column: int, first: int, last: int) -> tuple[Real, Flags]:
        """Straight lines between recorded samples, read off at the grid's times."""
        stamps = self.demonstration.times
        grid_times = self.demonstration.start + np.arange(first, last) / self.rate
        low = max(0, int(np.searchsorted(stamps, grid_times[0], side="right")) - 1)
        high = min(len(stamps), int(np.searchsorted(stamps, grid_times[-1])) + 1)
        heights, measured = self._recorded(column, low, max(high, low + 1))
        places = stamps[low : low + len(heights)]
        values = np.interp(grid_times, places, heights)
        spaces = np.diff(places, append=places[-1])
        if measured.all() and spaces.max() <= GAP_PERIODS / self.rate:
            return values, np.ones(len(grid_times), dtype=bool)
        # A time belongs to the stamp before it, for as long as a gap lasts at most.
        owner = np.clip(
            np.searchsorted(places, grid_times + 1e-6 / self.rate) - 1, 0, len(places) - 1
        )
        gap = spaces[owner] > GAP_PERIODS / self.rate
        late = grid_times - places[owner] > (1 - 1e-6) / self.rate
        return values, measured[owner] & ~(gap & late)


def _plain(values: Real) -> Flags:
    """Which values are so small that they need not be compared with a channel's usual ones."""
    return np.asarray(np.abs(values) <= GLITCH / 2)


def _long_runs(lost: Flags, before: int, after: int) -> Flags:
    """Where samples are missing in runs longer than a gap may be.

    A run at either end goes on for `before` or `after` samples beyond it.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], lost, [False]])))
    out = np.zeros_like(lost)
    for first, last in edges.reshape(-1, 2).tolist():
        beyond = (before if first == 0 else 0) + (after if last == len(lost) else 0)
        out[first:last] = last - first + beyond > GAP_PERIODS
    return out


def columns_of(demonstration: Demonstration, channel: str) -> tuple[int, ...]:
    """The recorded columns that a channel is made of."""
    names = [recorded.name for recorded in demonstration.channels]
    if channel in names:
        return (names.index(channel),)
    mapping = channel_map(demonstration.channels, (channel,))
    return tuple(mapping.recorded[place] for place in mapping.columns[0])


def open_source(demonstration: Demonstration, channel: str) -> Generator[Progress, None, Source]:
    """Find out on which grid a channel lies; a job.

    `channel`: name of a recorded channel, or of a recognition channel (see
    :func:`~forcelab.signals.channels.channel_map`).
    """
    columns = columns_of(demonstration, channel)
    times, own_rate = demonstration.times, 1.0 / demonstration.period
    n = len(times)
    true = (n - 1) / float(times[-1] - times[0])
    uniform = True
    steps = np.arange(min(n, BLOCK)) / true
    room = np.empty(len(steps))  # used again: new memory takes five times as long as the numbers
    for start in range(0, n, BLOCK):
        yield Progress(start, n, "looking at the stamps")
        part = times[start : start + BLOCK]
        off = np.subtract(part, steps[: len(part)], out=room[: len(part)])
        off -= times[0] + start / true
        if max(off.max(), -off.min()) > UNIFORM / own_rate:
            uniform = False
            break
    if uniform:
        return Source(demonstration, channel, columns, True, true, n)
    count = int(np.floor((times[-1] - times[0]) * own_rate + 1e-6)) + 1
    if count > MAX_SAMPLES:
        raise InputError(
            f"Demonstration '{demonstration.name}' spans {demonstration.duration:.6g} s, "
            f"{count:.3g} samples at {own_rate:.6g} Hz; remove stray stamps."
        )
    return Source(demonstration, channel, columns, False, own_rate, count)


#: Samples looked at in one step.
_STEP = 1 << 18
#: Kaiser's window with side lobes of 1e-6, and its length times its transition in radians.
_BETA = 12.27
_LENGTH = (120 - 8) / 2.285
#: The part of a coarser grid's frequencies that the wavelets may use.
_USED = 0.7


def step_for(scale: float, wavelet: Morlet) -> int:
    """Samples between the points of the coarsest grid that holds a scale and all wider ones."""
    highest = band(wavelet)[1] / scale
    return 1 << max(0, math.floor(math.log2(max(1.0, _USED * math.pi / highest))))


def coarser(
    source: Source, first: int, count: int, step: int, level: Level
) -> Generator[Progress, None, Real]:
    """Read a piece of the signal on a coarser grid, without what that grid cannot hold; a job.

    `first`: where the piece begins, in samples; `count`: points of the coarser grid; `step`:
    samples between them, a power of two; 1 reads the piece as it is; `level`: by which samples are
    shifted and sized. Gives (count,).
    """
    out = np.empty(count)
    half = math.ceil(0.5 * _LENGTH * step / (2 * np.pi * (1 - _USED))) if step > 1 else 0
    half = -(-half // step) * step
    needed = min(count * step, max(_STEP, 6 * half))
    length = fft.next_fast_len(-(-needed // step) + 2 * half // step, real=True) * step
    new_points = (length - 2 * half) // step
    place = np.arange(-half, half + 1)
    taps = np.sinc(place / step) / step * np.kaiser(2 * half + 1, _BETA)
    response = fft.rfft(np.roll(np.pad(taps, (0, length - len(taps))), -half)) if half else None
    for start in range(0, count, new_points):
        length_now = min(new_points, count - start)
        at = first + start * step
        if response is None:
            values, _ = source.read(at, at + length_now)
            out[start : start + length_now] = level.sized(values)
        else:
            values, _ = source.read(at - half, at - half + length)
            spectrum = fft.rfft(level.sized(values), overwrite_x=True)
            spectrum *= response
            # Nothing is left above the coarser grid's frequencies: the rest is cut off.
            short = fft.irfft(spectrum[: length // step // 2 + 1] / step, length // step)
            out[start : start + length_now] = short[half // step :][:length_now]
        yield Progress(start + length_now, count, "coarser grid")
    return out


def sums_are_cheaper(scale: float, columns: Columns) -> bool:
    """Whether sums around each column's centre cost less than a transform of the band."""
    return 32 * scale < columns.width and 11 * scale * scale < 60 * columns.width


def _kernel(scale: float, wavelet: Morlet) -> NDArray[np.complex128]:
    """The conjugate wavelet over its reach, without what the Nyquist frequency cuts."""
    if not is_cut(scale, wavelet):
        place = np.arange(-reach(scale), reach(scale) + 1)
        kernel = np.conj(wavelet.time(place / scale)) / math.sqrt(scale)
    else:
        half = PHASE_RINGING
        omega = 2 * np.pi * np.fft.fftfreq(8 * half)
        response = math.sqrt(scale) * wavelet.spectrum(scale * omega)
        place = np.arange(-half, half + 1)
        kernel = np.conj(np.fft.ifft(response)[place]) * np.kaiser(2 * half + 1, 4.0)
    return np.asarray(kernel - kernel.mean(), dtype=np.complex128)


def sum_rows(
    source: Source,
    columns: Columns,
    scales: NDArray[np.float64],
    wavelet: Morlet,
    level: Level,
) -> Generator[Progress, None, NDArray[np.complex128]]:
    """Coefficients at the columns' centre samples; a job.

    The samples around a column are read once, as far as the widest wavelet reaches.

    `scales` (k,): in samples; at least one; `level`: by which samples are shifted and sized. Gives
    (k, columns.count).
    """
    kernels = [_kernel(scale, wavelet) for scale in scales.tolist()]
    half = max(len(kernel) for kernel in kernels) // 2
    centres = columns.centres()
    out = np.empty((len(kernels), columns.count), dtype=np.complex128)
    chunk = max(1, _STEP // (2 * half + 1))
    for left in range(0, columns.count, chunk):
        right = min(left + chunk, columns.count)
        frames = np.empty((right - left, 2 * half + 1))
        for frame, centre in zip(frames, centres[left:right].tolist(), strict=True):
            frame[:] = source.read(centre - half, centre + half + 1)[0]
        level.sized(frames)
        for row, kernel in zip(out, kernels, strict=True):
            side = len(kernel) // 2
            within = frames[:, half - side : half + side + 1]
            row[left:right] = within @ kernel.real + 1j * (within @ kernel.imag)
        yield Progress(right, columns.count, "sums")
    return out
