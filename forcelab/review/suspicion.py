"""Suspected coding errors: human segments that the model, not having seen them, contradicts.

Two witnesses speak about a segment. What the recogniser says, that was trained without its
demonstration: the mean probability `r` that it gives to each action over the segment. And the
neighbours: which segments come before and after it. How each witness usually speaks of an action
is learnt from all *other* segments that bear its name, so that a confusion which occurs
everywhere, or an action that is seldom recognised, makes nobody suspicious. For a segment called x
and every other action y the evidence is a naive Bayes log ratio,

    log E = sum_k r_k log(P[k | y] / P[k | x])
            + log(P[before | y] / P[before | x]) + log(P[after | y] / P[after | x]),

with one pseudo-segment for the recogniser and one for every possible neighbour (Laplace); what the
neighbours say is weighed by how much they tell at all, the mutual information with the action as a
share of the action's entropy. The suspicion is E / (1 + E) for the y that makes it largest, and
none if the model gives x itself 0.9 or more. The most suspect segment of a demonstration is then
taken for y, and the others are looked at again: none is suspect only for standing beside an error.

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
from forcelab.review.certainty import Certainty
from forcelab.review.differences import Difference
from forcelab.review.outcome import Reviewed

__all__ = ["SUSPECT", "Heard", "heard", "suspect_edges", "suspect_segments"]

Real = NDArray[np.float64]

#: From this suspicion on a segment or an edge counts as suspected: more likely wrong than right.
SUSPECT = 0.5
#: What is left out at either end of a segment, as a share of it: edges are nobody's error.
MARGIN = 0.1
#: A label to which the model gives this mean probability is not suspected.
SUPPORTED = 0.9
#: How often each neighbour of each action was seen beforehand.
PSEUDO = 1.0
#: How often the segments are looked at again: so many of a demonstration are suspected at most.
ROUNDS = 12
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
    track = _Track([[number.get(s.action, -1) for s in h.segments] for h in everything])
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
        for i, other, suspicion in _found(said[track.known], track)
        if suspicion > 0
    ]
    return tuple(sorted(result, key=lambda d: (-d.suspicion, d.demonstration, d.start)))


class _Track:
    """The codes of all segments of several demonstrations, one after the other.

    Attributes
    ----------
    known : ndarray of int64, shape (m,)
        Which segments have an action of the outcome.
    homes : ndarray of int64, shape (m,)
        The number of the demonstration of each.
    """

    def __init__(self, codes: Sequence[Sequence[int]]) -> None:
        # -1 is an action that the outcome does not know, -2 stands between demonstrations.
        self._line = np.array([-2, *(c for one in codes for c in (*one, -2))])
        places = np.flatnonzero(self._line != -2)
        self.known = np.flatnonzero(self._line[places] >= 0)
        self._places = places[self.known]
        self.homes = np.cumsum(self._line == -2)[self._places]

    @property
    def codes(self) -> NDArray[np.int64]:
        """The code of each known segment, shape (m,)."""
        return np.asarray(self._line[self._places])

    @property
    def neighbours(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """The codes before and after each known segment."""
        return self._line[self._places - 1], self._line[self._places + 1]

    def correct(self, segment: int, code: int) -> None:
        """Take a known segment for another action."""
        self._line[self._places[segment]] = code


def _found(said: Real, track: _Track) -> list[tuple[int, int, float]]:
    """Each known segment's place, the other action that most speaks for, and the suspicion.

    The most suspect segment of each demonstration is taken for what it is suspected to be before
    the others are looked at again.
    """
    result: dict[int, tuple[int, float]] = {}
    for _ in range(ROUNDS):
        evidence = _evidence(said, track)
        others, strength = evidence.argmax(axis=1), evidence.max(axis=1)
        suspicion = np.exp(-np.logaddexp(0.0, -strength))
        suspicion[list(result)] = 0.0
        worst = [i for i in _firsts(suspicion, track.homes) if suspicion[i] >= SUSPECT]
        if not worst:
            break
        for i in worst:
            result[i] = (int(others[i]), float(suspicion[i]))
            track.correct(i, int(others[i]))
    for i in range(len(said)):
        result.setdefault(i, (int(others[i]), float(suspicion[i])))
    return [(int(track.known[i]), *found) for i, found in result.items()]


def _firsts(values: Real, homes: NDArray[np.int64]) -> list[int]:
    """Where the largest value of each home is; values with the same home stand together."""
    order = np.lexsort((-values, homes))
    return [int(i) for i in order[np.flatnonzero(np.diff(homes[order], prepend=-1))]]


def _evidence(said: Real, track: _Track) -> Real:
    """Log ratio for each segment and other action, shape (m, K); minus infinity without any."""
    evidence = _model_evidence(said, track.codes)
    for neighbours in track.neighbours:
        evidence += _neighbour_evidence(neighbours, track.codes, said.shape[1])
    own = np.arange(len(said)), track.codes
    # Whom the model supports is not suspected, however unusual the order is.
    evidence[said[own] >= SUPPORTED] = -np.inf
    evidence[own] = -np.inf
    return evidence


def _model_evidence(said: Real, codes: NDArray[np.int64]) -> Real:
    """Log ratio for each segment and other action of what the model says, shape (m, K)."""
    K = said.shape[1]
    totals = np.zeros((K, K))
    np.add.at(totals, codes, said)
    counts = np.bincount(codes, minlength=K).astype(np.float64)
    usual = np.log((totals + 1.0 / K) / (counts + 1.0)[:, None])
    own = np.maximum(totals[codes] - said, 0.0)  # without the segment itself
    without = np.log((own + 1.0 / K) / counts[codes][:, None])
    return np.asarray(said @ usual.T - (said * without).sum(axis=1)[:, None])


def _neighbour_evidence(neighbours: NDArray[np.int64], codes: NDArray[np.int64], K: int) -> Real:
    """Log ratio for each segment and other action of one of its neighbours, shape (m, K)."""
    kinds, names = np.unique(neighbours, return_inverse=True)
    met = np.zeros((K, len(kinds)))
    np.add.at(met, (codes, names), 1.0)
    counts = met.sum(axis=1)
    spread = PSEUDO * len(kinds)
    usual = np.log((met + PSEUDO) / (counts + spread)[:, None])[:, names].T
    own = np.log((met[codes, names] - 1.0 + PSEUDO) / (counts[codes] - 1.0 + spread))
    return np.asarray(_told(met) * (usual - own[:, None]))


def _told(met: Real) -> float:
    """How much neighbours tell about actions: mutual information, as a share of the entropy."""
    joint = met / met.sum()
    actions, neighbours = joint.sum(axis=1), joint.sum(axis=0)
    entropy = -float(np.sum(actions * np.log(np.where(actions > 0, actions, 1.0))))
    ratio = np.divide(
        joint, actions[:, None] * neighbours, out=np.ones_like(joint), where=joint > 0
    )
    return float(np.sum(joint * np.log(ratio))) / entropy if entropy > 0 else 0.0


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
