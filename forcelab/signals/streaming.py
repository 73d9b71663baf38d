"""The continuous wavelet transform of a stream: each coefficient a fixed delay after its sample.

A coefficient is the offline one (:mod:`forcelab.signals.cwt`) of all samples up to `delay` after
its own, with the end value held (the mean of the last eighth of a scale). After ``c * a`` samples
the wavelet has passed and what follows matters no more than the tolerance; before that it is an
early estimate with a known error. Nothing is ever carried from coefficient to coefficient, so that
nothing drifts.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forcelab.errors import InputError
from forcelab.signals.streaming_kernels import HALF, Kernel, Level, low_pass, plan, support
from forcelab.signals.wavelets import Morlet, Wavelet

__all__ = ["StreamingCwt", "early_error"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Samples that are worked on at once; larger blocks are cut, so that memory stays bounded.
CHUNK = 2048
#: Delay over scale, and the error of the early estimate of a Morlet with p = 5: root mean square
#: over that of the coefficients, on force recordings (on random walks and white noise within a
#: fifth; ``forcelab measure stream``).
EARLY = (
    (0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0),
    (0.8, 0.55, 0.32, 0.15, 0.054, 0.016, 3.5e-3, 8e-5, 7e-7),
)


def early_error(delay_in_scales: ArrayLike) -> Real:
    """The expected error of coefficients `delay_in_scales` after their sample, see :data:`EARLY`.

    Parameters
    ----------
    delay_in_scales : array_like
        Delay over scale, at least 0.
    """
    at = np.clip(np.asarray(delay_in_scales, dtype=np.float64), 0.0, EARLY[0][-1])
    return np.exp(np.interp(at, EARLY[0], np.log(EARLY[1])))


class _Tape:
    """The newest rows of an endless table, in one piece of memory.

    Parameters
    ----------
    rows : int
        How many of the newest rows must stay readable.
    columns : int
    """

    def __init__(self, rows: int, columns: int) -> None:
        self._kept = rows
        self._table = np.zeros((2 * rows + 2 * CHUNK, columns))
        self._end = rows
        #: Rows that were ever written.
        self.written = 0

    def append(self, rows: Real) -> None:
        """Add rows at the end, at most :data:`CHUNK`."""
        if self._end + len(rows) > len(self._table):
            self._table[: self._kept] = self._table[self._end - self._kept : self._end]
            self._end = self._kept
        self._table[self._end : self._end + len(rows)] = rows
        self._end += len(rows)
        self.written += len(rows)

    def view(self, first: int, last: int) -> Real:
        """Rows ``[first, last)`` by their number; numbers before 0 are rows of zeros."""
        shift = self._end - self.written
        return self._table[first + shift : last + shift]

    def lower(self, by: Real) -> None:
        """Subtract from all rows that can still be read."""
        self._table[max(0, self._end - self._kept - CHUNK) : self._end] -= by


class StreamingCwt:
    """Wavelet coefficients of samples as they come.

    Parameters
    ----------
    scales : array_like, shape (k,)
        In samples, positive, in any order.
    channels : int
    wavelet : Wavelet, optional
        The Morlet with p = 5 by default.
    tolerance : float
        Error of a complete coefficient relative to the largest one of its scale. It is held 3.9
        scales after the sample for 1.4e-3, 4.8 for 3e-5 and 5.6 for 3e-7 (Morlet).
    latency : int, optional
        Samples after which a coefficient is given even if its wavelet has not passed yet, with
        the last value held beyond. By default every wavelet is waited for.

    Attributes
    ----------
    scales : ndarray of float64, shape (k,)
    complete : ndarray of int, shape (k,)
        Samples after which the wavelet of each scale has passed.
    delays : ndarray of int, shape (k,)
        Samples after which its coefficients are given: `complete`, or the latency.
    pasts : ndarray of int, shape (k,)
        Samples before the coefficient's that take part in it.

    Raises
    ------
    InputError
        If a number is out of its range.

    Notes
    -----
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
        latency: int | None = None,
    ) -> None:
        self.scales = np.atleast_1d(np.asarray(scales, dtype=np.float64))
        if self.scales.ndim != 1 or not np.all((self.scales > 0) & np.isfinite(self.scales)):
            raise InputError("Scales are positive numbers of samples.")
        if channels < 1:
            raise InputError(f"A stream needs at least one channel, not {channels}.")
        if not 1e-8 <= tolerance < 0.5:
            raise InputError(f"The tolerance must lie between 1e-8 and 0.5, not at {tolerance}.")
        if latency is not None and latency < 0:
            raise InputError(f"The latency is a number of samples from 0, not {latency}.")
        self.channels = channels
        self.tolerance = tolerance
        self._wavelet = wavelet or Morlet()
        after = support(self._wavelet, tolerance)
        before = support(self._wavelet, 0.1 * tolerance)
        kernels = [Kernel.of(float(a), self._wavelet) for a in self.scales]
        self.complete = np.array([k.reach(after, tolerance) for k in kernels], dtype=np.int64)
        self.pasts = np.array([k.reach(before, 0.1 * tolerance) for k in kernels], dtype=np.int64)
        self.delays = self.complete if latency is None else np.minimum(self.complete, latency)
        self._levels = plan(self.scales, self._wavelet, self.delays, self.pasts)
        self._filters = {level.step: low_pass(level.step) for level in self._levels}
        self._filters.pop(1, None)
        self.reset()

    def reset(self) -> None:
        """Forget all samples; the next one is the first."""
        fine = [level.fine + level.block for level in self._levels]
        filters = [len(taps) + step for step, taps in self._filters.items()]
        self._fine = _Tape(max([1, *fine, *filters]) + CHUNK, self.channels)
        self._coarse = {
            step: _Tape(
                max(lv.coarse for lv in self._levels if lv.step == step)
                + HALF
                + (CHUNK + max(lv.block for lv in self._levels if lv.step == step)) // step
                + 2,
                self.channels,
            )
            for step in self._filters
        }
        self._base: Real | None = None
        self._next_base = 0
        self._last: Real | None = None

    @property
    def pushed(self) -> int:
        """Samples that have come since the start."""
        return self._fine.written

    def push(self, block: ArrayLike) -> Complex:
        """Take samples and give as many coefficients of each scale.

        Parameters
        ----------
        block : array_like, shape (n, channels)
            Finite numbers. The first sample of all is taken as having held for ever.

        Returns
        -------
        ndarray of complex128, shape (channels, k, n)
            Column `i` of scale `j` is the coefficient at sample ``first + i - delays[j]``, where
            `first` is what :attr:`pushed` was before; places before 0 are from before the start.

        Raises
        ------
        InputError
            If the block has another number of channels or a sample is not finite.
        """
        samples = np.asarray(block, dtype=np.float64)
        if samples.ndim != 2 or samples.shape[1] != self.channels:
            raise InputError(
                f"A block of {self.channels} channels has the shape (n, {self.channels}), "
                f"not {samples.shape}."
            )
        if not np.isfinite(samples).all():
            raise InputError("A stream takes finite samples only; bridge what is missing first.")
        out = np.empty((self.channels, len(self.scales), len(samples)), dtype=np.complex128)
        for start in range(0, len(samples), CHUNK):
            part = samples[start : start + CHUNK]
            self._take(part)
            self._give(out[:, :, start : start + len(part)])
        if len(samples):
            self._last = samples[-1].copy()
        if self._wavelet.real:
            out.imag = 0.0  # what rounding leaves there would flip the phase of negatives
        return out

    def finish(self) -> Complex:
        """End the stream: the coefficients that are still to come, with the last value held.

        Returns
        -------
        ndarray of complex128, shape (channels, k, m)
            As of :meth:`push`, for ``m = max(delays)`` further samples.
        """
        rest = int(np.max(self.delays, initial=0))
        if self._last is None:
            return np.empty((self.channels, len(self.scales), 0), dtype=np.complex128)
        return self.push(np.broadcast_to(self._last, (rest, self.channels)))

    def _take(self, samples: Real) -> None:
        """Write samples onto the tapes, as differences from a level that follows them slowly."""
        if self._base is None:
            self._base = samples[0].copy()
        elif self._fine.written >= self._next_base:
            # A level far from zero would leave the rounding of large numbers in the products.
            level = samples[0].copy()
            shift = level - self._base
            for tape in (self._fine, *self._coarse.values()):
                tape.lower(shift)
            self._base = self._base + shift
        if self._fine.written >= self._next_base:
            self._next_base = (self._fine.written // CHUNK + 1) * CHUNK
        self._fine.append(samples - self._base)
        for step, tape in self._coarse.items():
            self._decimate(step, tape)

    def _decimate(self, step: int, tape: _Tape) -> None:
        """Write the decimated samples, at multiples of `step`, whose filter has all its samples.

        The tape begins with those before the start whose filter reaches into the signal.
        """
        filter_ = self._filters[step]
        half = len(filter_) // 2
        first, last = tape.written - HALF, (self._fine.written - 1 - half) // step + 1
        if last <= first:
            return
        seen = self._fine.view(first * step - half, (last - 1) * step + half + 1)
        if last - first <= 4:  # a view of windows takes longer to make than these
            taps = len(filter_)
            sums = [filter_ @ seen[i * step : i * step + taps] for i in range(last - first)]
            tape.append(np.array(sums))
            return
        windows = np.lib.stride_tricks.sliding_window_view(seen, len(filter_), axis=0)[::step]
        tape.append(windows @ filter_)

    def _give(self, out: Complex) -> None:
        """Compute the coefficients that the newest samples bring; they fill `out`."""
        last = self._fine.written
        first = last - out.shape[2]
        for level in self._levels:
            block = level.block
            start = first
            while start < last:
                row = start % block
                count = (last - start) // block if row == 0 else 0
                stop = start + count * block if count else min(last, start - row + block)
                found = self._product(level, start - row, row, stop - start, max(count, 1))
                out[:, level.members, start - first : stop - first] = found
                start = stop

    def _product(self, level: Level, origin: int, row: int, length: int, count: int) -> Complex:
        """Outputs of part of a block at `origin` from `row` on, or of `count` whole blocks."""
        rows = length // count
        columns = level.fine + row + rows
        k = len(level.members)
        weights = level.matrix[row * 2 * k : (row + rows) * 2 * k, : level.coarse + columns]
        if count == 1:
            fine = self._fine.view(origin - level.fine, origin - level.fine + columns)
            seen = fine
            if level.coarse:
                end = origin // level.step + 1  # on the tape: HALF back from here, HALF on
                coarse = self._coarse[level.step].view(end - level.coarse, end)
                seen = np.concatenate([coarse, fine])
        else:
            seen = self._windows(level, origin, columns, count)
        product = (weights @ seen).reshape(rows, k, 2, count, self.channels)
        ordered = product.transpose(4, 1, 3, 0, 2).reshape(self.channels, k, length, 2)
        return np.ascontiguousarray(ordered).view(np.complex128)[..., 0]

    def _windows(self, level: Level, origin: int, columns: int, count: int) -> Real:
        """What `count` blocks from `origin` on see, side by side; shape (width, count * c)."""
        block, step = level.block, level.step
        seen = np.empty((level.coarse + columns, count, self.channels))
        view = np.lib.stride_tricks.sliding_window_view
        if level.coarse:
            first = origin // step + 1 - level.coarse
            tape = self._coarse[step].view(
                first, first + level.coarse + (count - 1) * (block // step)
            )
            windows = view(tape, level.coarse, axis=0)[:: block // step]
            seen[: level.coarse] = windows.transpose(2, 0, 1)
        begin = origin - level.fine
        fine = self._fine.view(begin, begin + (count - 1) * block + columns)
        seen[level.coarse :] = view(fine, columns, axis=0)[::block].transpose(2, 0, 1)
        return seen.reshape(len(seen), -1)
