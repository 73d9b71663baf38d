"""The overlay of two tracks that are there as segments, without the samples they were made from.

An :class:`~forcelab.recognition.overlay.Overlay` counts in samples; here a sample is a nanosecond
and stretches are found from the edges of segments alone, so that an hour costs no more than its
segments. With even stamps every score is the same; where stamps jitter, rates differ by as much.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.labels import UNLABELLED, Segments
from forcelab.recognition.metrics import Counts, Scores, count_overlay, pool
from forcelab.recognition.overlay import Overlay
from forcelab.runs import Runs, stretches

__all__ = ["TICKS", "score_tracks", "timed_counts", "timed_overlay"]

#: Ticks a second: the samples of these overlays.
TICKS = 1_000_000_000


def timed_overlay(human: Segments, predicted: Segments, actions: Sequence[str]) -> Overlay:
    """Lay predicted over human segments; what is predicted in unlabelled time is left out.

    Parameters
    ----------
    human, predicted : tuple of Segment
        In order, never overlapping. Touching segments of one action are one.
    actions : sequence of str
        The action with code ``i`` is ``actions[i]``.

    Raises
    ------
    KeyError
        If a segment's action is not among `actions`.
    """
    number = {action: code for code, action in enumerate(actions)}
    edges = np.array([time for s in (*human, *predicted) for time in (s.start, s.end)])
    ticks, firsts = np.unique(np.rint(edges * TICKS).astype(np.int64), return_index=True)
    times = edges[firsts]
    return Overlay.gathered(
        _codes(human, number, ticks),
        _codes(predicted, number, ticks),
        len(actions),
        lambda codes: _stretches(codes, ticks, times),
    )


def timed_counts(human: Segments, predicted: Segments, actions: Sequence[str]) -> Counts:
    """Count a predicted against a human track as :func:`~forcelab.recognition.metrics.count` does.

    The confusion is in nanoseconds. Parameters are those of :func:`timed_overlay`.
    """
    return count_overlay(timed_overlay(human, predicted, actions))


def score_tracks(
    human: Segments, predicted: Segments, actions: Sequence[str] | None = None, name: str = ""
) -> Scores:
    """Score a predicted against a human track, wherever the two come from.

    Unlabelled human time is never counted.

    Parameters
    ----------
    human, predicted : tuple of Segment
        In order, never overlapping, as of :class:`~forcelab.labels.Track`.
    actions : sequence of str, optional
        In the order of the confusion; by default that of their first occurrence.
    name : str
        Of the demonstration.

    Returns
    -------
    Scores
        Its confusion is in nanoseconds instead of samples.

    Raises
    ------
    InputError
        If an action is not among `actions`.
    """
    used = tuple(dict.fromkeys(segment.action for segment in (*human, *predicted)))
    known = used if actions is None else tuple(actions)
    if unknown := [action for action in used if action not in known]:
        raise InputError(f"'{unknown[0]}' is not among the actions {', '.join(known)}.")
    return pool(name, [timed_counts(human, predicted, known)])


def _codes(
    segments: Segments, number: dict[str, int], ticks: NDArray[np.int64]
) -> NDArray[np.int64]:
    """The code of the time between each edge and the next, shape (edges - 1,)."""
    starts = ticks[:-1]
    if not segments:
        return np.full(len(starts), UNLABELLED, dtype=np.int64)
    codes = np.array([number[s.action] for s in segments], dtype=np.int64)
    begin, end = (
        np.rint(np.array([getattr(s, side) for s in segments]) * TICKS).astype(np.int64)
        for side in ("start", "end")
    )
    last = np.searchsorted(begin, starts, side="right") - 1
    return np.where((last >= 0) & (starts < end[last]), codes[last], UNLABELLED)


def _stretches(
    codes: NDArray[np.int64], ticks: NDArray[np.int64], times: NDArray[np.float64]
) -> Runs:
    """Gather neighbours of equal code, numbered in ticks instead of in edges."""
    found = stretches(codes, times[:-1], times[1:])
    return Runs(found.codes, ticks[found.firsts], ticks[found.lasts], found.starts, found.ends)
