"""Segments in labelled time alone: what the human left unlabelled is cut out and closed up.

A coder who leaves a few hundredths of a second between two actions cuts a predicted segment that
runs through in two, and each boundary into an edge that no prediction can miss. Some publish their
segmental scores so, others cut the unlabelled time out first; the two differ by ten points and
more, so both are reported.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from forcelab.recognition.overlay import Overlay
from forcelab.recognition.segmental import Matches
from forcelab.runs import Runs

__all__ = ["NEAR", "boundaries_found", "closed_up", "inner_boundary_errors"]

#: Seconds within which a predicted boundary counts as a human one found.
NEAR = 0.1


def closed_up(over: Overlay) -> Overlay:
    """The overlay with all that the human left unlabelled, and gaps, cut out.

    Neighbours of one action that now touch are one segment.
    """
    samples, seconds = over.pieces.samples, over.pieces.seconds
    places = np.concatenate([[0], np.cumsum(samples)])
    times = np.concatenate([[0.0], np.cumsum(seconds)])

    def gathered(codes: NDArray[np.int64]) -> Runs:
        """Neighbouring pieces of one code together; unlabelled ones left out."""
        changes = np.flatnonzero(np.diff(codes)) + 1
        first = np.concatenate([[0], changes]) if len(codes) else changes
        last = np.concatenate([changes, [len(codes)]]) if len(codes) else changes
        kept = codes[first] >= 0
        first, last = first[kept], last[kept]
        return Runs(codes[first], places[first], places[last], times[first], times[last])

    return Overlay.gathered(over.human_codes, over.predicted_codes, over.actions, gathered)


def boundaries_found(closed: Overlay) -> tuple[int, int]:
    """How many human boundaries have a predicted one within 100 ms, and how many there are.

    Parameters
    ----------
    closed : Overlay
        Closed up. Its boundaries are where one action gives way to another; the ends of what was
        recorded are none. A predicted one counts whichever its actions are.
    """
    human, predicted = closed.human.starts[1:], _inner(closed)
    if len(predicted) == 0:
        return 0, len(human)
    after = np.searchsorted(predicted, human)
    sides = np.maximum(after - 1, 0), np.minimum(after, len(predicted) - 1)
    near = np.minimum(*(np.abs(human - predicted[side]) for side in sides))
    # Stamps are rounded: 100 ms are 100 ms.
    return int((near <= NEAR * (1 + 1e-9)).sum()), len(human)


def inner_boundary_errors(closed: Overlay, matches: Matches) -> NDArray[np.float64]:
    """How far matched segments' edges lie apart, where one action gives way to another.

    Unlike those of :func:`forcelab.recognition.segmental.boundary_errors`, of which every edge at
    unlabelled time is 0 whatever was predicted. The first edge and the last one are left out.

    Parameters
    ----------
    closed : Overlay
        Closed up.
    matches : Matches
        Of its segments.

    Returns
    -------
    ndarray of float64
        Distances in milliseconds, never negative.
    """
    human, predicted = matches.human, matches.predicted
    starts = (closed.human.starts[human] - closed.predicted.starts[predicted])[human > 0]
    ends = closed.human.ends[human] - closed.predicted.ends[predicted]
    inner = human < len(closed.human) - 1
    return np.asarray(1000.0 * np.abs(np.concatenate([starts, ends[inner]])))


def _inner(closed: Overlay) -> NDArray[np.float64]:
    """Where the prediction changes, in seconds, rising."""
    changes = np.flatnonzero(np.diff(closed.predicted_codes)) + 1
    return closed.pieces.starts[changes]
