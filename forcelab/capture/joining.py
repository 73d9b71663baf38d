"""Several devices' samples on the stamps of the first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import GAP_PERIODS
from forcelab.errors import InputError

__all__ = ["Stream", "joined", "onto"]

_EDGE = 0.25  # s by which devices may begin or end apart and be cut to what they share
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
    """

    host: NDArray[np.float64]
    values: NDArray[np.float64]
    holds: bool = False
    even: bool = True
    away: tuple[tuple[float, float], ...] = ()


def joined(
    streams: Sequence[Stream], names: Sequence[str]
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Bring all channels onto the stamps of the first device that samples evenly.

    Parameters
    ----------
    streams, names
        One for each device.

    Returns
    -------
    times : ndarray of float64, shape (n,)
        Seconds from the first sample, strictly increasing.
    signals : ndarray of float64, shape (n, c)
        The channels of all devices in their order; NaN where one has no sample near.
    start : float
        Host time (s) of time 0.

    Raises
    ------
    InputError
        If the device that leads has fewer than two samples.
    """
    lead = next((i for i, stream in enumerate(streams) if not stream.holds), 0)
    if not streams or len(streams[lead].host) < 2:
        which = f" of {names[lead]}" if names else ""
        raise InputError(
            f"Fewer than two samples{which} were recorded; look at its channels live first."
        )
    first = streams[lead]
    kept = _increasing(first.host)
    host = first.host[kept]
    begin, end = _shared(host, [s for s in streams if not s.holds and len(s.host)])
    within = (host >= begin) & (host <= end)
    if within.sum() < 2:
        within[:] = True
    host = host[within]
    columns = [
        stream.values[kept][within] if i == lead else onto(host, stream)
        for i, stream in enumerate(streams)
    ]
    start = float(host[0])
    return host - start, np.concatenate(columns, axis=1), start


def _increasing(host: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which stamps are later than all before them; two stretches may overlap by a delay."""
    before = np.maximum.accumulate(host)
    return np.concatenate([[True], host[1:] > before[:-1]])


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
    kept = _increasing(stream.host) if len(stream.host) else np.zeros(0, dtype=bool)
    own, values = stream.host[kept], stream.values[kept]
    out = np.full((len(host), stream.values.shape[1]), np.nan)
    if len(own) == 0:
        return out
    after = np.searchsorted(own, host, side="right")
    if stream.holds:
        known = after > 0
        out[known] = values[after[known] - 1]
        for gone, back in stream.away:
            # Until it has something to say again, for what it held may have changed unseen.
            again = own[own >= back]
            out[(host >= gone) & (host < (again[0] if len(again) else np.inf))] = np.nan
        return out
    if len(own) == 1:
        return out
    after = np.where(host == own[-1], len(own) - 1, after)
    inside = (after > 0) & (after < len(own))
    right = after[inside]
    left = right - 1
    step = own[right] - own[left]
    share = (host[inside] - own[left]) / step
    mixed = values[left] + share[:, None] * (values[right] - values[left])
    apart = _MISSED if stream.even else GAP_PERIODS
    mixed[step > apart * float(np.median(np.diff(own)))] = np.nan
    exact = share == 0.0
    mixed[exact] = values[left][exact]
    out[inside] = mixed
    return out
