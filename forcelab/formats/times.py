"""Times as text: no more digits than tell the instant, and back onto the sample they came from."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from forcelab.labels import Segment, Track

__all__ = ["on_samples", "plain_times"]

#: Decimals that are enough for times on microseconds, and how far from one a time may lie to be
#: on it, in seconds: far more than float64 arithmetic strays in a recording, far less than what
#: parts two samples.
DECIMALS, STRAY = 6, 1e-9


def plain_times(track: Track) -> list[tuple[Segment, tuple[float, float]]]:
    """Each segment with a start and an end whose shortest text is what a person would write.

    Arithmetic leaves 4.6899999999999995 where 4.69 is meant; read by :func:`on_samples`, 4.69 is
    the same sample again.

    Parameters
    ----------
    track : Track

    Returns
    -------
    list of (Segment, (float, float))
        Times in seconds: those within a nanosecond of a microsecond are that microsecond, all
        others are as they were. Where that would leave nothing of a segment, none is changed.
    """
    times = [(_plain(s.start), _plain(s.end)) for s in track.segments]
    if not all(start < end for start, end in times):
        times = [(float(s.start), float(s.end)) for s in track.segments]
    return list(zip(track.segments, times, strict=True))


def on_samples(tracks: Iterable[Track], times: NDArray[np.float64]) -> tuple[Track, ...]:
    """Put edges that lie within a nanosecond of a sample exactly onto its stamp.

    Parameters
    ----------
    tracks : iterable of Track
    times : ndarray, shape (n,)
        Stamps of the recording in seconds, increasing.

    Returns
    -------
    tuple of Track
        A track that would lose a segment by it is as it was.
    """
    return tuple(_on_samples(track, times) for track in tracks)


def _plain(time: float) -> float:
    """The microsecond on which a time lies, or the time."""
    rounded = round(float(time), DECIMALS)
    return rounded if abs(rounded - time) <= STRAY else float(time)


def _on_samples(track: Track, times: NDArray[np.float64]) -> Track:
    """One track with its edges on the samples."""
    edges = np.array([(s.start, s.end) for s in track.segments]).reshape(-1, 2)
    after = np.clip(np.searchsorted(times, edges), 1, len(times) - 1)
    lower, upper = times[after - 1], times[after]
    nearest = np.where(edges - lower < upper - edges, lower, upper)
    moved = np.where(abs(nearest - edges) <= STRAY, nearest, edges)
    if not (moved[:, 0] < moved[:, 1]).all():
        return track
    pairs = zip(track.segments, moved.tolist(), strict=True)
    return Track(track.author, tuple(Segment(start, end, s.action) for s, (start, end) in pairs))
