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
    with np.errstate(divide="ignore"):
        magnitude = np.log(np.abs(coefficients))  # squares would overflow
    quiet = magnitude <= floor[:, :, None]
    parts = [np.maximum(magnitude, floor[:, :, None])]
    if phase:
        angle = np.arctan2(coefficients.imag, coefficients.real)
        angle[quiet] = 0.0
        parts.append(angle)
    return np.concatenate([part.reshape(q * k, n).T for part in parts], axis=1)


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
        Of the recogniser's scales, with `delay` as its latency.
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
        # Coefficients by step, each scale as far as it is known: column 0 is step `_given`.
        self._aligned = np.zeros((channels, len(transform.scales), delay), dtype=np.complex128)
        self._given = 0
        self._until = 0  # the first step that no scale knows yet

    def push(self, rows: Real) -> Real:
        """Take steps, shape (n, q); give the features that are due, shape (m, f)."""
        parts = []
        if self._floor.now is None:
            self._pending = np.concatenate([self._pending, rows])
            if len(self._pending) < FIRST:
                return self._none()
            rows, self._pending = self._pending, self._pending[:0]
            self._floor.see(rows[:FIRST])
            self._floor.look()
            parts.append(self._part(rows[:FIRST]))
            rows = rows[FIRST:]
        while len(rows):
            part = rows[: EVERY - self._seen % EVERY]
            parts.append(self._part(part))
            self._floor.see(part)
            if self._seen % EVERY == 0:
                self._floor.look()
            rows = rows[len(part) :]
        return np.concatenate(parts) if parts else self._none()

    def finish(self) -> Real:
        """The features that are still to come, with the last values held."""
        parts = []
        if self._floor.now is None:
            if not len(self._pending):
                return self._none()
            self._floor.see(self._pending)
            self._floor.look()
            parts.append(self._part(self._pending))
        last = self._seen
        rest = self._transform.finish()
        # Whatever goes beyond the last step is about samples that never were.
        parts.append(self._take(rest, last, last))
        return np.concatenate(parts)

    def _none(self) -> Real:
        q, k, _ = self._aligned.shape
        return np.empty((0, q * k * (2 if self._phase else 1)))

    def _part(self, rows: Real) -> Real:
        """Features that come with steps between two looks at the noise."""
        coefficients = self._transform.push(rows)
        first = self._seen
        self._seen += len(rows)
        return self._take(coefficients, first, max(self._given, self._seen - self._delay))

    def _take(self, coefficients: Complex, first: int, due: int) -> Real:
        """Put new columns to the steps they belong to; give the features of steps before `due`."""
        n = coefficients.shape[2]
        held = self._aligned
        width = first + n - self._given
        table = np.zeros((*held.shape[:2], max(width, held.shape[2])), dtype=np.complex128)
        table[:, :, : held.shape[2]] = held
        for j, delay in enumerate(self._transform.delays.tolist()):
            start = first - delay - self._given
            skip = max(0, -start)
            if skip < n:
                table[:, j, start + skip : start + n] = coefficients[:, j, skip:]
        count = due - self._given
        self._given = due
        self._aligned = table[:, :, count:]
        floor = self._floor.now
        if floor is None:
            raise RuntimeError("the noise must have been looked at before coefficients come")
        return rows_of(table[:, :, :count], floor, self._phase)
