"""Suspected coding errors: human segments that the model, not having seen them, contradicts.

Of segments the evidence is that of :mod:`forcelab.recognition.witnesses`: what the recogniser says
that was trained without the demonstration, and the neighbours.

An edge is suspect if the model puts it elsewhere, is sure of what it sees on either side and
between, and is far more off than usual where the same two meet: with q the least of the three mean
probabilities, d the displacement and u its median over that transition, q min(1, d / (4 u))^2,
which counts from 2 u on.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import median

import numpy as np
from numpy.typing import NDArray

from forcelab.labels import Segments
from forcelab.recognition.certainty import Certainty
from forcelab.recognition.witnesses import MARGIN, SUSPECT, Line, suspicions
from forcelab.review.differences import Difference
from forcelab.review.outcome import Reviewed

__all__ = ["SUSPECT", "Heard", "heard", "suspect_edges", "suspect_segments"]

Real = NDArray[np.float64]

#: An edge is far off at so many times the usual displacement, which is so many seconds at least;
#: below half of that it is as good as others.
FAR, LEAST_USUAL = 4.0, 0.025


@dataclass(frozen=True)
class Heard:
    """What the model says about the segments of one demonstration; m of them, K actions.

    Parameters
    ----------
    demonstration : str
        Its id.
    segments : tuple of Segment
        The human's.
    said : ndarray of float64, shape (m, K)
        Mean probability of each action over the middle of each segment.
    """

    demonstration: str
    segments: Segments
    said: Real


def heard(reviewed: Reviewed, segments: Segments, actions: Sequence[str]) -> Heard:
    """Gather what the model says about a human's segments.

    Without probabilities its word is the share of time that it gives to each action.
    """
    said = np.zeros((len(segments), len(actions)))
    for row, segment in enumerate(segments):
        margin = MARGIN * segment.duration
        inside = (segment.start + margin, segment.end - margin)
        if reviewed.certainty is None:
            raw = reviewed.stages.get("raw", reviewed.predicted)
            said[row] = _shares(raw, *inside, actions)
        else:
            said[row] = _means(reviewed.certainty, *inside, actions)
    return Heard(reviewed.id, segments, said)


def _means(certainty: Certainty, start: float, end: float, actions: Sequence[str]) -> Real:
    """Mean probability of each action, in the order of `actions`."""
    means = dict(zip(certainty.actions, certainty.mean(start, end).tolist(), strict=True))
    return np.array([means.get(action, 0.0) for action in actions])


def _shares(segments: Segments, start: float, end: float, actions: Sequence[str]) -> Real:
    """Share of ``[start, end)`` that segments give to each action."""
    seconds = dict.fromkeys(actions, 0.0)
    for segment in segments:
        both = min(segment.end, end) - max(segment.start, start)
        if both > 0 and segment.action in seconds:
            seconds[segment.action] += both
    return np.array(list(seconds.values())) / (end - start)


def suspect_segments(all_heard: Iterable[Heard], actions: Sequence[str]) -> tuple[Difference, ...]:
    """Every human segment that the model would rather call something else, most suspect first.

    Parameters
    ----------
    all_heard : iterable of Heard
        Of each demonstration.
    actions : sequence of str
        The outcome's.

    Returns
    -------
    tuple of Difference
        Of the whole segment; `suspicion` is as told above, `confidence` the mean probability of
        the other action.
    """
    everything = [h for h in all_heard if h.segments]
    if not everything:
        return ()
    said = np.concatenate([h.said for h in everything])
    # Of an action that it never learnt, as of another task, the model cannot be a witness.
    learnt = np.flatnonzero(said.any(axis=0))
    said, actions = said[:, learnt], [actions[code] for code in learnt.tolist()]
    if len(actions) < 2:
        return ()
    number = {action: code for code, action in enumerate(actions)}
    line = Line([[number.get(s.action, -1) for s in h.segments] for h in everything])
    segments = [(h.demonstration, segment) for h in everything for segment in h.segments]
    result = [
        Difference(
            segments[i][0],
            segments[i][1].start,
            segments[i][1].end,
            segments[i][1].action,
            actions[other],
            float(said[i, other]),
            suspicion=suspicion,
        )
        for i, other, suspicion in suspicions(said[line.known], line)
        if suspicion > 0
    ]
    return tuple(sorted(result, key=lambda d: (-d.suspicion, d.demonstration, d.start)))


def suspect_edges(
    differences: Sequence[Difference], certainties: Mapping[str, Certainty | None]
) -> tuple[Difference, ...]:
    """The same differences; those of kind "boundary" with their suspicion.

    Parameters
    ----------
    differences : sequence of Difference
        Of all demonstrations: what is usual is learnt from them.
    certainties : mapping of str to Certainty or None
        By the demonstration's id; without probabilities no edge is suspect.
    """
    lengths: dict[frozenset[str | None], list[float]] = {}
    for difference in differences:
        if difference.kind == "boundary":
            lengths.setdefault(_transition(difference), []).append(difference.duration)
    usual = {pair: max(median(found), LEAST_USUAL) for pair, found in lengths.items()}
    return tuple(
        replace(d, suspicion=_edge(d, usual[_transition(d)], certainties.get(d.demonstration)))
        if d.kind == "boundary"
        else d
        for d in differences
    )


def _transition(difference: Difference) -> frozenset[str | None]:
    """The two that meet at a displaced edge, whichever comes first."""
    return frozenset((difference.human, difference.predicted))


def _edge(difference: Difference, usual: float, certainty: Certainty | None) -> float:
    """How suspect a displaced edge is."""
    if certainty is None or difference.confidence is None:
        return 0.0
    far = min(1.0, difference.duration / (FAR * usual))
    if far < 0.5:
        return 0.0
    start, end, length = difference.start, difference.end, difference.duration
    beside = (certainty.mean(start - length, start), certainty.mean(end, end + length))
    sure = min(difference.confidence, *(float(side.max()) for side in beside))
    return sure * far**2
