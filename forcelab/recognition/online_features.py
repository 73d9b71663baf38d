"""Features of a stream: those of :mod:`forcelab.recognition.features`, a fixed delay behind.

Offline the floor of the magnitudes comes from noise and amplitude of the whole recording. A stream
takes the noise from the latest :data:`EVERY` steps, anew after as many, first after :data:`FIRST`,
and the amplitude from the latest :data:`LASTING` times so many.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from forcelab.recognition.features import NOISE_SHARE, ROUNDING
from forcelab.signals.conditioning import noise_level, robust_peak
from forcelab.signals.streaming import CHUNK, StreamingCwt, level_of

__all__ = ["EVERY", "FIRST", "Floor", "StreamingFeatures", "rows_of"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Steps between two looks, and before the first. The transform's base is chosen anew as often.
EVERY, FIRST = CHUNK, 256
#: Looks after which the channel's size is forgotten.
LASTING = 64


def rows_of(coefficients: Complex, floor: Real, phase: bool) -> Real:
    """Features of steps from their coefficients.

    Parameters
    ----------
    coefficients : ndarray, shape (q, k, n)
    floor : ndarray, shape (q, k)
    phase : bool

    Returns
    -------
    ndarray, shape (n, q * k) or (n, 2 * q * k)
        As of :func:`forcelab.recognition.features.features`.
    """
    q, k, n = coefficients.shape
    out = np.empty((2 if phase else 1, q, k, n))
    magnitude, level = out[0], floor[:, :, None]
    np.abs(coefficients, out=magnitude)  # squares would overflow
    with np.errstate(divide="ignore"):
        np.log(magnitude, out=magnitude)
    if phase:
        np.arctan2(coefficients.imag, coefficients.real, out=out[1])
        out[1][magnitude <= level] = 0.0
    np.maximum(magnitude, level, out=magnitude)
    return out.reshape(len(out) * q * k, n).T


class Floor:
    """The floor of the magnitudes as it follows a stream.

    It lies above the rounding, a share of how far samples are from the transform's base, one in
    :data:`~forcelab.signals.conditioning.RARE` left out: a glitch is forgotten with the last
    wavelet that holds it. What disturbs for longer the base may follow, and what comes after is
    rounded as it is.

    Parameters
    ----------
    channels : int
    scales : ndarray, shape (k,)

    Attributes
    ----------
    now : ndarray, shape (q, k), or None
        Natural logarithms of the floors; None before the first look.
    """

    def __init__(self, channels: int, scales: Real) -> None:
        self._rounding = np.log(ROUNDING * np.sqrt(scales))
        self._latest = np.empty((0, channels))
        self._base: Real | None = None
        self._peaks = np.empty((0, channels))  # of the latest looks
        self.now: Real | None = None

    def see(self, rows: Real) -> None:
        """Take steps, shape (n, q), none beyond the next multiple of :data:`EVERY`."""
        if self._base is None and len(rows):
            self._base = rows[0].copy()
        self._latest = np.concatenate([self._latest, rows])[-EVERY:]

    def look(self) -> None:
        """Take the floor anew, at the first look or at a multiple of :data:`EVERY`."""
        if self._base is None:
            raise RuntimeError("a look needs a step")
        peak = robust_peak((self._latest - self._base).T)
        peaks = np.concatenate([self._peaks, [peak]])[-LASTING:]
        size = np.max(peaks, axis=0)
        size = np.where(size > 0, size, 1.0)  # as offline
        with np.errstate(divide="ignore"):  # no noise has the logarithm -inf
            noise = np.log(NOISE_SHARE) + np.log(noise_level(self._latest.T))
        self.now = np.maximum(noise[:, None], np.log(size)[:, None] + self._rounding)
        if len(self._latest) == EVERY:  # not at the first look, after which more is seen of it
            self._base, self._peaks = level_of(self._latest), peaks


class StreamingFeatures:
    """Features of steps, `delay` steps behind.

    Parameters
    ----------
    channels : int
        Recognition channels q.
    transform : StreamingCwt
        Of the recogniser's scales, all together with `delay` as their latency.
    delay : int
        Steps.
    phase : bool
    """

    def __init__(self, channels: int, transform: StreamingCwt, delay: int, phase: bool) -> None:
        self._transform = transform
        self._delay = delay
        self._phase = phase
        self._floor = Floor(channels, transform.scales)
        self._pending = np.empty((0, channels))  # before the noise is known
        self._seen = 0

    def push(self, rows: Real) -> Real:
        """Take steps, shape (n, q); give the features that are due, shape (m, f)."""
        if self._floor.now is None:
            rows = np.concatenate([self._pending, rows])
            if len(rows) < FIRST:
                self._pending = rows
                return self._none()
            self._pending = rows[:0]
            self._floor.see(rows[:FIRST])
            self._floor.look()
        return self._features(rows) if len(rows) else self._none()

    def finish(self) -> Real:
        """The features that are still to come, with the last values held."""
        first = self._none()
        if self._floor.now is None:
            if not len(self._pending):
                return first
            self._floor.see(self._pending)
            self._floor.look()
            first = self._features(self._pending)
        rest = self._rows(self._transform.finish(), self._seen)
        return np.concatenate([first, rest])

    def _none(self) -> Real:
        columns = self._transform.channels * len(self._transform.scales)
        return np.empty((0, columns * (2 if self._phase else 1)))

    def _features(self, rows: Real) -> Real:
        """Features that come with steps, with a look at the noise wherever one is due."""
        coefficients = self._transform.push(rows)
        parts = []
        done = 0
        while done < len(rows):
            # What had been seen when the first look was taken was seen already.
            count = EVERY - self._seen % EVERY if self._seen else FIRST
            part = rows[done : done + count]
            parts.append(self._rows(coefficients[:, :, done : done + len(part)], self._seen))
            if self._seen:
                self._floor.see(part)
            self._seen += len(part)
            done += len(part)
            if self._seen % EVERY == 0:
                self._floor.look()
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def _rows(self, coefficients: Complex, first: int) -> Real:
        """Features of the coefficients that came with the steps from `first` on."""
        floor = self._floor.now
        if floor is None:
            raise RuntimeError("the noise must have been looked at before coefficients come")
        # What belongs before the first step is about samples that never were.
        return rows_of(coefficients[:, :, max(0, self._delay - first) :], floor, self._phase)
