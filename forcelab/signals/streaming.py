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
from forcelab.signals.streaming_kernels import reaches
from forcelab.signals.streaming_plan import Level, plan
from forcelab.signals.streaming_tape import CHUNK, Tapes
from forcelab.signals.wavelets import Morlet, Wavelet

__all__ = ["StreamingCwt", "early_error"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Delay over scale, and the error of the early estimate of a Morlet with p = 5: root mean square
#: over that of the coefficients, as on the paper's recordings, to 6 % up to 3 scales and to a fifth
#: beyond. On random walks it is up to a sixth less; on white noise up to a third more at 2 scales,
#: and twice as much at 5; more still of a scale that is quieter than its neighbours, on the
#: made-up forces of ``forcelab measure stream`` up to three times.
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
    latency : int or array_like of int, shape (k,), optional
        Samples, of all scales or of each, after which a coefficient is given even if its wavelet
        has not passed yet, with the last value held beyond. By default every wavelet is waited
        for.
    together : bool
        Whether the coefficients of all scales come at one delay, the latency or else that of the
        widest, so that a column of what comes belongs to one sample.

    Attributes
    ----------
    scales : ndarray of float64, shape (k,)
    complete : ndarray of int, shape (k,)
        Samples after which the wavelet of each scale has passed.
    delays : ndarray of int, shape (k,)
        Samples after which its coefficients are given: `complete`, or the latency.
    aheads : ndarray of int, shape (k,)
        Samples after the coefficient's that take part in it, at most the delay.
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
                kept = lv.coarse + (lv.rows + lv.behind) // lv.step + 1
                coarse[lv.step] = max(coarse.get(lv.step, 0), kept)
        self._tapes = Tapes(self.channels, fine, coarse)

    @property
    def pushed(self) -> int:
        """Samples that have come since the start."""
        return self._tapes.fine.written

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

        Returns
        -------
        ndarray of complex128, shape (channels, k, m)
            As of :meth:`push`, for ``m = max(delays)`` further samples.
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
                    found = self._blocks(level, first + done, count)
                else:
                    size = min(n - done, level.rows - row)
                    found = self._product(level, first + done - row, row, size)
                out[:, level.members, done : done + size] = found
                done += size
        if self._tapes.exponent:
            np.ldexp(out, self._tapes.exponent, out=out)

    def _product(self, level: Level, origin: int, row: int, size: int) -> Real:
        """Outputs from `row` of a block at `origin` on; shape (c, k, size, 2)."""
        columns = level.fine + row + size
        first = row * 2 * level.count
        weights = level.matrix[first : first + size * 2 * level.count, : level.coarse + columns]
        seen = self._tapes.fine.view(origin - level.fine, origin - level.fine + columns)
        if level.coarse:
            end = origin // level.step + 1  # on the tape: HALF back from here, HALF on
            coarse = self._tapes.coarse[level.step].view(end - level.coarse, end)
            seen = np.concatenate([coarse, seen])
        product = weights @ seen
        return product.reshape(size, level.count, 2, self.channels).transpose(3, 1, 0, 2)

    def _blocks(self, level: Level, origin: int, count: int) -> Real:
        """Outputs of `count` whole blocks from `origin` on; shape (c, k, count * block, 2)."""
        block, columns, c = level.block, level.fine + level.block, self.channels
        # What the blocks see, side by side.
        seen = np.empty((level.coarse + columns, count, c))
        if level.coarse:
            first = origin // level.step + 1 - level.coarse
            coarse = self._tapes.coarse[level.step]
            windows = coarse.windows(first, level.coarse, block // level.step, count)
            seen[: level.coarse] = windows.transpose(1, 0, 2)
        windows = self._tapes.fine.windows(origin - level.fine, columns, block, count)
        seen[level.coarse :] = windows.transpose(1, 0, 2)
        weights = level.matrix[: block * 2 * level.count, : level.coarse + columns]
        product = (weights @ seen.reshape(len(seen), -1)).reshape(block, level.count, 2, count, c)
        return product.transpose(4, 1, 3, 0, 2).reshape(c, level.count, count * block, 2)
