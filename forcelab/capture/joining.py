"""Several devices' samples on the stamps of the first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import GAP_PERIODS
from forcelab.errors import InputError

__all__ = ["Joined", "Stream", "joined", "onto"]

_EDGE = 0.25  # s by which devices may begin or end apart and be cut to what they share
_AT_ONCE = 1 << 16  # stamps; more would only take memory
_MISSED = 1.5  # periods apart: a sample is missing between two neighbours that were stamped evenly


@dataclass(frozen=True, eq=False)
class Stream:
    """The samples of one device, on the host's clock.

    Parameters
    ----------
    host : ndarray of float64, shape (n,)
        When each was taken, s.
    values : ndarray of float64, shape (n, c)
    holds : bool
        Whether a value holds until the next one.
    even : bool
        Whether the stamps come from a clock; else from arrivals.
    away : tuple of (float, float)
        From when to when (s) it was unplugged.
    before : bool
        Whether the first value of one that holds was there before anything was recorded: then it
        holds for samples, too, that were on their way when recording began.
    """

    host: NDArray[np.float64]
    values: NDArray[np.float64]
    holds: bool = False
    even: bool = True
    away: tuple[tuple[float, float], ...] = ()
    before: bool = False


@dataclass(frozen=True, eq=False)
class Joined:
    """All channels on the stamps of one device.

    Parameters
    ----------
    times : ndarray of float64, shape (n,)
        Seconds from the first sample, strictly increasing.
    signals : ndarray of float64, shape (n, c)
        The channels of all devices in their order; NaN where one has no sample near.
    start : float
        Host time (s) of time 0.
    lead : int
        The device that gives the stamps.
    within : slice
        Which of its samples these are: all but those of the moments at the ends in which not all
        devices had begun, or some had ended.
    """

    times: NDArray[np.float64]
    signals: NDArray[np.float64]
    start: float
    lead: int
    within: slice


def joined(streams: Sequence[Stream], names: Sequence[str]) -> Joined:
    """Bring all channels onto the stamps of the first device that samples evenly, and did.

    Parameters
    ----------
    streams, names
        One for each device.

    Returns
    -------
    Joined

    Raises
    ------
    InputError
        If no device that could lead has two samples.
    """
    even = [i for i, stream in enumerate(streams) if not stream.holds]
    # One that was silent all the time takes nothing away from the others.
    lead = next((i for i in even if len(streams[i].host) > 1), -1)
    if lead < 0 and not even and streams and len(streams[0].host) > 1:
        lead = 0
    if lead < 0:
        which = f" of {names[even[0] if even else 0]}" if names else ""
        raise InputError(
            f"Fewer than two samples{which} were recorded; look at its channels live first."
        )
    first = streams[lead]
    host = _increasing(first.host)
    begin, end = _shared(host, [s for s in streams if not s.holds and len(s.host)])
    within = slice(*np.searchsorted(host, [begin, np.nextafter(end, np.inf)]).tolist())
    if within.stop - within.start < 2:
        within = slice(0, len(host))
    host = host[within]
    signals = np.empty((len(host), sum(stream.values.shape[1] for stream in streams)))
    column = 0
    for i, stream in enumerate(streams):
        part = signals[:, column : column + stream.values.shape[1]]
        if i == lead:
            part[:] = stream.values[within]
        else:
            _onto(host, stream, part)
        column += part.shape[1]
    start = float(host[0])
    times = host - start
    times.flags.writeable = signals.flags.writeable = False  # so that nobody needs a copy
    return Joined(times, signals, start, lead, within)


def _increasing(host: NDArray[np.float64]) -> NDArray[np.float64]:
    """Stamps that go on increasing; two stretches may overlap by a delay.

    Those that would go back follow the one before by half a period, until they have caught up.
    """
    steps = np.diff(host)
    if not (steps <= 0).any():
        return host
    forward = steps[steps > 0]
    passed = (0.5 * float(np.median(forward)) if len(forward) else 1e-6) * np.arange(len(host))
    increasing: NDArray[np.float64] = np.maximum.accumulate(host - passed) + passed
    return increasing


def _shared(host: NDArray[np.float64], streams: Sequence[Stream]) -> tuple[float, float]:
    """The time that all devices share, where they begin and end a moment apart."""
    begins = [float(s.host[0]) for s in streams if abs(s.host[0] - host[0]) < _EDGE]
    ends = [float(s.host[-1]) for s in streams if abs(s.host[-1] - host[-1]) < _EDGE]
    return max(begins, default=-np.inf), min(ends, default=np.inf)


def onto(host: NDArray[np.float64], stream: Stream) -> NDArray[np.float64]:
    """A device's channels at other stamps.

    Parameters
    ----------
    host : ndarray of float64, shape (n,)
        The stamps, in seconds of the host's clock.
    stream : Stream
        The device.

    Returns
    -------
    ndarray of float64, shape (n, c)
        NaN where it has no sample near.
    """
    out = np.empty((len(host), stream.values.shape[1]))
    _onto(host, stream, out)
    return out


def _onto(host: NDArray[np.float64], stream: Stream, out: NDArray[np.float64]) -> None:
    """As :func:`onto`, into an array."""
    own, values = stream.host, stream.values
    if len(own):
        own = _increasing(own)
    out[:] = np.nan
    if len(own) == 0:
        return
    if stream.holds:
        after = np.searchsorted(own, host, side="right")
        if stream.before:
            after = np.maximum(after, 1)
        known = after > 0
        out[known] = values[after[known] - 1]
        for gone, back in stream.away:
            # Until it has something to say again, for what it held may have changed unseen.
            again = own[own >= back]
            out[(host >= gone) & (host < (again[0] if len(again) else np.inf))] = np.nan
        return
    if len(own) == 1:
        return
    apart = (_MISSED if stream.even else GAP_PERIODS) * float(np.median(np.diff(own)))
    for first in range(0, len(host), _AT_ONCE):
        part = slice(first, first + _AT_ONCE)
        _between(host[part], own, values, apart, out[part])


def _between(
    host: NDArray[np.float64],
    own: NDArray[np.float64],
    values: NDArray[np.float64],
    apart: float,
    out: NDArray[np.float64],
) -> None:
    """Interpolate between neighbours that are not too far apart (s), into an array."""
    after = np.searchsorted(own, host, side="right")
    after = np.where(host == own[-1], len(own) - 1, after)
    inside = (after > 0) & (after < len(own))
    right = after[inside]
    left = right - 1
    step = own[right] - own[left]
    share = (host[inside] - own[left]) / step
    mixed = values[left] + share[:, None] * (values[right] - values[left])
    mixed[step > apart] = np.nan
    exact = share == 0.0
    mixed[exact] = values[left][exact]
    out[inside] = mixed
