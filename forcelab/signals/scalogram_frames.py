"""Powers of wavelet coefficients on grids of a quarter of the scale, frame by frame.

Neighbouring scales share overlapping frames of the signal. Of a frame's spectrum the band that a
scale answers to is brought back to time by a short transform: a point every few samples instead
of one at every sample. All is in single precision, which errs by 1e-7 of the frame's largest
sample, a tenth of where wavelets are cut; frames lie side by side, since transforms of several
rows take a quarter of the time.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from forcelab.signals.engine.frames import slope_at_zero
from forcelab.signals.scalogram_bands import RINGING, band, is_cut, reach
from forcelab.signals.wavelets import Morlet

__all__ = ["Frames", "bank", "grid_step"]

Real = NDArray[np.float64]
Single = NDArray[np.float32]
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
    """Neighbouring scales with the same grid.

    Parameters
    ----------
    rows : slice
        Their places among all scales.
    step : int
        Samples between two points.
    first : int
        The bin of the frame's spectrum that becomes the points' bin 0: powers do not tell by
        which frequency a row is turned, and the band of a high carrier lies far from 0.
    positive, negative : ndarray of float32, shape (s, 2 * bins)
        By what the spectrum's bins `first`, `first` + 1, ... and -1, -2, ... are multiplied, each
        twice: for their real and imaginary parts.
    slopes : ndarray of float32, shape (s, 1)
        What a straight line answers, for each unit of its slope; it lies in the spectrum's bin 0.
    """

    rows: slice
    step: int
    first: int
    positive: Single
    negative: Single
    slopes: Single


class Frames:
    """Neighbouring scales that share frames of one length.

    Parameters
    ----------
    scales : ndarray, shape (s,)
        In samples, rising.
    first : int
        Place of the first one among all scales.
    wavelet : Morlet
    width : float
        Samples of a column; where a spot is one column, without end.
    span : int, optional
        Samples that are wanted at once; frames are made to fit.
    length : int, optional
        Samples of a frame instead, a power of two.

    Attributes
    ----------
    half : int
        Samples before and after those that are told about which each frame needs.
    hop : int
        Samples that a frame tells about.
    length : int
        Samples of a frame.
    count : int
        Frames that the span takes.
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

        Parameters
        ----------
        frames : ndarray of float64, shape (f, length)

        Returns
        -------
        spectra : ndarray of complex64, shape (f, length // 2 + 1)
        slopes : ndarray of float32, shape (f,)
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

        Parameters
        ----------
        values : ndarray of float64, shape (n,)
            At least :attr:`reading` samples.
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

        Parameters
        ----------
        values : ndarray of float64, shape (n,)
            Of which :meth:`cut` makes frames.
        take : callable
            Is given which scales, the samples between two points, and their powers, a float32
            array of shape (scales, points); the first point is that at ``values[half]``.
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
                tasks.append(partial(self._told, part, chosen, rows, spectra, slopes, take))
        return tasks

    def _told(
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
        skipped, kept = self.half // part.step, self.hop // part.step
        out = np.empty((len(positive), count, kept), dtype=np.float32)
        together = min(count, max(1, _CACHED // (len(positive) * points)))
        above, below = positive.shape[1], negative.shape[1]
        room = np.empty((len(positive), together, points), dtype=np.complex64)
        for f in range(0, count, together):
            source = spectra[f : f + together]
            product = room[:, : len(source)]
            parts = product.view(np.float32)
            held = source.view(np.float32)[:, 2 * part.first : 2 * part.first + above]
            np.multiply(held, positive[:, None], out=parts[:, :, :above])
            parts[:, :, above : 2 * points - below] = 0.0
            if below:
                mirrored = np.conj(source[:, 1 : below // 2 + 1]).view(np.float32)
                turned = (mirrored * negative[:, None]).view(np.complex64)
                product[:, :, : -below // 2 - 1 : -1] = turned
            if part.first == 0:
                product[:, :, 0] = -1j * part.slopes[chosen] * slopes[f : f + together]
            rows = fft.ifft(product, axis=-1, overwrite_x=True)[:, :, skipped : skipped + kept]
            squares = np.square(rows.view(np.float32), out=rows.view(np.float32))
            np.add(squares[..., 0::2], squares[..., 1::2], out=out[:, f : f + together])
        return out.reshape(len(positive), -1)


def bank(scales: Real, wavelet: Morlet, span: int, width: float) -> list[Frames]:
    """Frames for all scales, narrow wavelets with short ones.

    Parameters
    ----------
    scales : ndarray, shape (k,)
        In samples, rising.
    wavelet : Morlet
    span : int
        Samples that are wanted at once.
    width : float
        Samples of a column.
    """
    found = []
    start = 0
    while start < len(scales):
        end = int(np.searchsorted(scales, TOGETHER * scales[start], side="right"))
        found.append(Frames(scales[start:end], start, wavelet, span=span, width=width))
        start = end
    return found
