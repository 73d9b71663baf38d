"""What other demonstrations say about a human's segments: evidence that one is called wrongly.

Two witnesses speak about a segment. What a classifier says, that was trained without its
demonstration: the mean probability `r` that it gives to each action over the segment. And the
neighbours: which segments come before and after it. How each witness usually speaks of an action
is learnt from all *other* segments that bear its name, so that a confusion which occurs
everywhere, or an action that is seldom recognised, makes nobody suspicious. For a segment called x
and every other action y the evidence is a naive Bayes log ratio,

    log E = sum_k r_k log(P[k | y] / P[k | x])
            + log(P[before | y] / P[before | x]) + log(P[after | y] / P[after | x]),

with one pseudo-segment for the classifier and one for every possible neighbour (Laplace); what the
neighbours say is weighed by how much they tell at all, the mutual information with the action as a
share of the action's entropy. The suspicion is E / (1 + E) for the y that makes it largest, and
none if the classifier gives x itself 0.9 or more. The most suspect segment of a demonstration is
then taken for y, and the others are looked at again: none is suspect only for standing beside an
error.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ["MARGIN", "PSEUDO", "SUSPECT", "Line", "suspicions", "told"]

Real = NDArray[np.float64]

#: From this suspicion on a segment or an edge counts as suspected: more likely wrong than right.
SUSPECT = 0.5
#: What is left out at either end of a segment, as a share of it: edges are nobody's error.
MARGIN = 0.1
#: A label to which the classifier gives this mean probability is not suspected.
SUPPORTED = 0.9
#: How often each neighbour of each action was seen beforehand.
PSEUDO = 1.0
#: How often the segments are looked at again: so many of a demonstration are suspected at most.
ROUNDS = 12


class Line:
    """The codes of all segments of several demonstrations, one after the other.

    Parameters
    ----------
    codes : sequence of sequence of int
        Of each demonstration's segments, in order; -1 where the action is none of those judged.

    Attributes
    ----------
    known : ndarray of int64, shape (m,)
        Which segments have an action that is judged.
    homes : ndarray of int64, shape (m,)
        The number of the demonstration of each.
    """

    def __init__(self, codes: Sequence[Sequence[int]]) -> None:
        # -2 stands between demonstrations.
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


def suspicions(
    said: Real, line: Line, possible: NDArray[np.bool_] | None = None
) -> list[tuple[int, int, float]]:
    """How suspect each known segment is, and of being which other action.

    Parameters
    ----------
    said : ndarray of float64, shape (m, K)
        Mean probability of each action over the middle of each known segment, by a classifier that
        has not seen its demonstration.
    line : Line
        Of codes below K. The worst are corrected in it.
    possible : ndarray of bool, shape (m, K), optional
        Which other actions each segment is suspected of; by default any.

    Returns
    -------
    list of (int, int, float)
        The segment's number among all, the code of the action that most speaks for, and the
        suspicion from 0 to 1.
    """
    result: dict[int, tuple[int, float]] = {}
    for _ in range(ROUNDS):
        evidence = _evidence(said, line)
        if possible is not None:
            evidence[~possible] = -np.inf
        others, strength = evidence.argmax(axis=1), evidence.max(axis=1)
        suspicion = np.exp(-np.logaddexp(0.0, -strength))
        suspicion[list(result)] = 0.0
        worst = [i for i in _firsts(suspicion, line.homes) if suspicion[i] >= SUSPECT]
        if not worst:
            break
        for i in worst:
            result[i] = (int(others[i]), float(suspicion[i]))
            line.correct(i, int(others[i]))
    for i in range(len(said)):
        result.setdefault(i, (int(others[i]), float(suspicion[i])))
    return [(int(line.known[i]), *found) for i, found in result.items()]


def _firsts(values: Real, homes: NDArray[np.int64]) -> list[int]:
    """Where the largest value of each home is; values with the same home stand together."""
    order = np.lexsort((-values, homes))
    return [int(i) for i in order[np.flatnonzero(np.diff(homes[order], prepend=-1))]]


def _evidence(said: Real, line: Line) -> Real:
    """Log ratio for each segment and other action, shape (m, K); minus infinity without any."""
    evidence = _model_evidence(said, line.codes)
    for neighbours in line.neighbours:
        evidence += _neighbour_evidence(neighbours, line.codes, said.shape[1])
    own = np.arange(len(said)), line.codes
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
    return np.asarray(told(met) * (usual - own[:, None]))


def told(met: Real) -> float:
    """How much neighbours tell about actions: mutual information, as a share of the entropy."""
    joint = met / met.sum()
    actions, neighbours = joint.sum(axis=1), joint.sum(axis=0)
    entropy = -float(np.sum(actions * np.log(np.where(actions > 0, actions, 1.0))))
    ratio = np.divide(
        joint, actions[:, None] * neighbours, out=np.ones_like(joint), where=joint > 0
    )
    return float(np.sum(joint * np.log(ratio))) / entropy if entropy > 0 else 0.0
