"""Suspected coding errors: human segments that the model, not having seen them, contradicts.

Of segments the evidence is that of :mod:`forcelab.recognition.witnesses`: what the recogniser says
that was trained without the demonstration, and the neighbours. It counts only for an action that is
more probable than the coder's and of which the prediction has more there: what is unusual, but seen
by the model as well, is nobody's error. Of parts of segments it is that of
:mod:`forcelab.review.parts`.

An edge is suspect if the model puts it elsewhere, is sure of what it sees on either side and
between, and is far more off than usual where the same two meet: with q the least of the three mean
probabilities, d the displacement and u its median over that transition, q min(1, d / (4 u))^2,
which counts from 2 u on.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from statistics import median

import numpy as np

from forcelab.recognition.certainty import Certainty
from forcelab.recognition.witnesses import SUSPECT, Line, suspicions
from forcelab.review.differences import Difference
from forcelab.review.hearing import Heard
from forcelab.review.parts import suspect_parts

__all__ = ["SUSPECT", "suspect_edges", "suspects"]

#: An edge is far off at so many times the usual displacement, which is so many seconds at least;
#: below half of that it is as good as others.
FAR, LEAST_USUAL = 4.0, 0.025


def suspects(all_heard: Iterable[Heard], actions: Sequence[str]) -> tuple[Difference, ...]:
    """Every human segment, or part of one, that the model would rather call something else.

    Parameters
    ----------
    all_heard : iterable of Heard
        Of each demonstration.
    actions : sequence of str
        The outcome's.

    Returns
    -------
    tuple of Difference
        The most suspect first. `suspicion` is as told above, `confidence` the mean probability of
        the other action. A segment is listed as a whole where that is suspected, and otherwise
        as what is more suspect: the whole, or its parts.
    """
    everything = [h for h in all_heard if h.segments]
    if not everything:
        return ()
    # Of an action that it never learnt, as of another task, the model cannot be a witness.
    learnt = np.flatnonzero(np.concatenate([h.said for h in everything]).any(axis=0))
    if len(learnt) < 2:
        return ()
    known = [actions[code] for code in learnt.tolist()]
    everything = [
        replace(
            h,
            said=h.said[:, learnt],
            predicted=h.predicted[:, learnt],
            of_parts=h.of_parts[:, learnt],
        )
        for h in everything
    ]
    wholes = {(d.demonstration, d.start): d for d in _segments(everything, known)}
    parts = suspect_parts(everything, known)
    result: list[Difference] = []
    for place in wholes.keys() | parts.keys():
        whole, own = wholes.get(place), parts.get(place, [])
        most = max((part.suspicion for part in own), default=0.0)
        if whole is not None and whole.suspicion >= min(SUSPECT, most):
            result.append(whole)
        else:
            result += own
    return tuple(sorted(result, key=lambda d: (-d.suspicion, d.demonstration, d.start)))


def _segments(everything: Sequence[Heard], actions: Sequence[str]) -> list[Difference]:
    """The whole segments of which anything is suspected."""
    said = np.concatenate([h.said for h in everything])
    number = {action: code for code, action in enumerate(actions)}
    line = Line([[number.get(s.action, -1) for s in h.segments] for h in everything])
    segments = [(h.demonstration, segment) for h in everything for segment in h.segments]
    predicted = np.concatenate([h.predicted for h in everything])[line.known]
    known, own = said[line.known], (np.arange(len(line.known)), line.codes)
    # A label may be unusual: the model contradicts it only by seeing more of something else.
    contradicts = (known > known[own][:, None]) & (predicted > predicted[own][:, None])
    return [
        Difference(
            segments[i][0],
            segments[i][1].start,
            segments[i][1].end,
            segments[i][1].action,
            actions[other],
            float(said[i, other]),
            suspicion=suspicion,
        )
        for i, other, suspicion in suspicions(known, line, contradicts)
        if suspicion > 0
    ]


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
