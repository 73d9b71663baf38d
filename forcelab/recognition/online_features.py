"""Features of a stream: those of :mod:`forcelab.recognition.features`, a fixed delay behind.

Offline the floor of the magnitudes comes from the noise of the whole recording. A stream takes it
from the latest :data:`SPAN` steps, anew every :data:`EVERY` steps, first after :data:`FIRST`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from forcelab.recognition.features import NOISE_SHARE, ROUNDING
from forcelab.signals.conditioning import noise_level
from forcelab.signals.streaming import StreamingCwt

__all__ = ["EVERY", "FIRST", "SPAN", "Floor", "StreamingFeatures", "floors", "rows_of"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Steps from which the noise is taken, steps between two such looks, and before the first.
SPAN, EVERY, FIRST = 1024, 1024, 256


def floors(channels: Real, loudest: Real, scales: Real) -> Real:
    """Natural logarithms of the floors of the magnitudes, shape (q, k).

    Parameters
    ----------
    channels : ndarray, shape (n, q)
        Steps to take the noise from.
    loudest : ndarray, shape (q,)
        Largest distance from the first sample so far.
    scales : ndarray, shape (k,)
    """
    with np.errstate(divide="ignore"):  # no noise has the logarithm -inf
        noise = np.log(NOISE_SHARE) + np.log(noise_level(channels.T))
        size = np.log(np.where(loudest > 0, loudest, 1.0))
    return np.maximum(noise[:, None], size[:, None] + np.log(ROUNDING * np.sqrt(scales)))


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

    Parameters
    ----------
    channels : int
    scales : ndarray, shape (k,)
    """

    def __init__(self, channels: int, scales: Real) -> None:
        self._scales = scales
        self._latest = np.empty((0, channels))
        self._first: Real | None = None
        self._loudest = np.zeros(channels)
        self.now: Real | None = None  # None before the first look

    def see(self, rows: Real) -> None:
        """Take steps, shape (n, q)."""
        if not len(rows):
            return
        if self._first is None:
            self._first = rows[0].copy()
        self._loudest = np.maximum(self._loudest, np.max(np.abs(rows - self._first), axis=0))
        self._latest = np.concatenate([self._latest, rows])[-SPAN:]

    def look(self) -> None:
        """Take the noise anew."""
        self.now = floors(self._latest, self._loudest, self._scales)


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
