"""Label noise: evidence of other demonstrations against a human's segments.

Two sources of evidence speak about a segment: the mean probability `r` that a classifier, trained
without its demonstration, gives to each action over it, and which segments come before and after.
How each usually looks for an action is learnt from all *other* segments of that name, so that a
confusion which occurs everywhere, or an action that is seldom recognised, raises no suspicion. For
a segment called x and every other action y the evidence is a naive Bayes log ratio,

    log E = sum_k r_k log(P[k | y] / P[k | x])
            + log(P[before | y] / P[before | x]) + log(P[after | y] / P[after | x]),

with one pseudo-segment for the classifier and one for every possible neighbour (Laplace); the
neighbours are weighted by the mutual information of neighbour and action as a share of the action's
entropy. The suspicion is E / (1 + E) for the y that makes it largest, and none if the classifier
gives x itself 0.9 or more. The most suspect segment of a demonstration is then taken for y, and the
others are looked at again: none is suspect only for standing beside an error.

A coder who takes one action for another teaches a recogniser, and its decoder, something wrong. So
before a fit each training demonstration is recognised by a few trees grown on the others; segments
that are nine in ten likely to be another action are left out. It is never more than a third of an
action's segments, and none of fewer than three: what is rare is not taken for wrong. Labels stay as
they are.

With 5 % of the segments swapped, simulated LEGO tasks then cost `best` 0.5 points of accuracy
instead of 1.5; four in five of the swapped ones are found. `fast`, which goes without as its fit
time would double, loses 2.4, and would lose 0.8. Of right labels, 4 of 3800 were left out. On the
paper's stylus recordings, of which one or two segments go, twelve seeds of `best` lose 0.2 ± 0.2
points of accuracy and 0.5 ± 0.4 of the boundaries; on foam none goes.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from forcelab.arrays import Codes, Flags, Real, Whole
from forcelab.jobs import Progress
from forcelab.labels import UNLABELLED, Segment
from forcelab.recognition.ensemble import training_steps
from forcelab.recognition.examples import Examples, actions_of, gather_features
from forcelab.recognition.settings import Settings

#: From this suspicion on a segment or an edge counts as suspected: more likely wrong than right.
SUSPECT = 0.5
#: What is left out at either end of a segment, as a share of it: edges are no coding errors.
MARGIN = 0.1
#: A label to which the classifier gives this mean probability is not suspected.
SUPPORTED = 0.9
#: How often each neighbour of each action was seen beforehand.
PSEUDO = 1.0
#: How often the segments are looked at again: so many of a demonstration are suspected at most.
ROUNDS = 12


class SegmentSequence:
    """The codes of all segments of several demonstrations, one after the other.

    Given each demonstration's codes in order, -1 for an action that is not judged. `known` (m,) are
    the indices of the judged segments, `homes` (m,) the numbers of their demonstrations.
    """

    def __init__(self, codes: Sequence[Sequence[int]]) -> None:
        # -2 stands between demonstrations.
        self._line = np.array([-2, *(c for sequence in codes for c in (*sequence, -2))])
        places = np.flatnonzero(self._line != -2)
        self.known = np.flatnonzero(self._line[places] >= 0)
        self._places = places[self.known]
        self.homes = np.cumsum(self._line == -2)[self._places]

    @property
    def codes(self) -> Codes:
        """The code of each known segment, shape (m,)."""
        return np.asarray(self._line[self._places])

    @property
    def neighbours(self) -> tuple[Codes, Codes]:
        """The codes before and after each known segment."""
        return self._line[self._places - 1], self._line[self._places + 1]

    def correct(self, segment: int, code: int) -> None:
        """Take a known segment for another action."""
        self._line[self._places[segment]] = code


def score_suspicions(
    probabilities: Real, sequence: SegmentSequence, possible: Flags | None = None
) -> list[tuple[int, int, float]]:
    """Index, most likely other code and suspicion (0 to 1) of each known segment.

    `probabilities` (m, K) are means over the middle of each known segment, by a classifier that has
    not seen its demonstration; `possible` (m, K) limits the other actions. The worst segments are
    corrected in the sequence.
    """
    result: dict[int, tuple[int, float]] = {}
    for _ in range(ROUNDS):
        evidence = _evidence(probabilities, sequence)
        if possible is not None:
            evidence[~possible] = -np.inf
        others, strength = evidence.argmax(axis=1), evidence.max(axis=1)
        suspicion = np.exp(-np.logaddexp(0.0, -strength))
        suspicion[list(result)] = 0.0
        worst = [
            i
            for i in _largest_per_demonstration(suspicion, sequence.homes)
            if suspicion[i] >= SUSPECT
        ]
        if not worst:
            break
        for i in worst:
            result[i] = (int(others[i]), float(suspicion[i]))
            sequence.correct(i, int(others[i]))
    for i in range(len(probabilities)):
        result.setdefault(i, (int(others[i]), float(suspicion[i])))
    return [(int(sequence.known[i]), *corrected) for i, corrected in result.items()]


def _largest_per_demonstration(values: Real, homes: Whole) -> list[int]:
    """Index of the largest value of each home; values with the same home stand together."""
    order = np.lexsort((-values, homes))
    return [int(i) for i in order[np.flatnonzero(np.diff(homes[order], prepend=-1))]]


def _evidence(probabilities: Real, sequence: SegmentSequence) -> Real:
    """Log ratio for each segment and other action, shape (m, K); minus infinity without any."""
    evidence = _model_evidence(probabilities, sequence.codes)
    for neighbours in sequence.neighbours:
        evidence += _neighbour_evidence(neighbours, sequence.codes, probabilities.shape[1])
    own_cells = np.arange(len(probabilities)), sequence.codes
    # Whom the model supports is not suspected, however unusual the order is.
    evidence[probabilities[own_cells] >= SUPPORTED] = -np.inf
    evidence[own_cells] = -np.inf
    return evidence


def _model_evidence(probabilities: Real, codes: Codes) -> Real:
    """Log ratio of the classifier's probabilities for each segment and other action, (m, K)."""
    K = probabilities.shape[1]
    totals = np.zeros((K, K))
    np.add.at(totals, codes, probabilities)
    counts = np.bincount(codes, minlength=K).astype(np.float64)
    usual = np.log((totals + 1.0 / K) / (counts + 1.0)[:, None])
    own_totals = np.maximum(totals[codes] - probabilities, 0.0)  # without the segment itself
    without = np.log((own_totals + 1.0 / K) / counts[codes][:, None])
    return np.asarray(probabilities @ usual.T - (probabilities * without).sum(axis=1)[:, None])


def _neighbour_evidence(neighbours: Codes, codes: Codes, K: int) -> Real:
    """Log ratio of the neighbour on one side for each segment and other action, (m, K)."""
    kinds, names = np.unique(neighbours, return_inverse=True)
    joint_counts = np.zeros((K, len(kinds)))
    np.add.at(joint_counts, (codes, names), 1.0)
    counts = joint_counts.sum(axis=1)
    spread = PSEUDO * len(kinds)
    usual = np.log((joint_counts + PSEUDO) / (counts + spread)[:, None])[:, names].T
    own_evidence = np.log(
        (joint_counts[codes, names] - 1.0 + PSEUDO) / (counts[codes] - 1.0 + spread)
    )
    return np.asarray(neighbour_information(joint_counts) * (usual - own_evidence[:, None]))


def neighbour_information(joint_counts: Real) -> float:
    """Mutual information of neighbours and actions, as a share of the actions' entropy."""
    joint = joint_counts / joint_counts.sum()
    actions, neighbours = joint.sum(axis=1), joint.sum(axis=0)
    entropy = -float(np.sum(actions * np.log(np.where(actions > 0, actions, 1.0))))
    ratio = np.divide(
        joint, actions[:, None] * neighbours, out=np.ones_like(joint), where=joint > 0
    )
    return float(np.sum(joint * np.log(ratio))) / entropy if entropy > 0 else 0.0


#: From this suspicion on a segment is left out. From 0.5 on, 6 % of the right ones would be, and
#: accuracy on simulated tasks would fall by up to 0.8 points.
SURE = 0.9
#: At most one in so many of an action's segments is left out, rounded down.
ONE_IN = 3
#: Fewer demonstrations than that cannot outvote one of them.
FEWEST = 3
#: Folds in which demonstrations are recognised by trees grown on the others, and trees of each.
FOLDS, TREES = 5, 20
#: Seconds from one sample that a tree is grown on to the next, and how many it takes at most.
APART, MOST = 0.1, 20_000
#: How many left-out segments a remark names.
NAMED = 3


@dataclass(frozen=True, slots=True)
class DroppedSegment:
    """A segment that was left out of training."""

    demonstration: str  # the name of its demonstration
    segment: Segment  # the human's
    other: str  # the action that most speaks for


def drop_contradicted(
    examples: Sequence[Examples], settings: Settings
) -> Generator[Progress, None, tuple[list[Examples], tuple[DroppedSegment, ...]]]:
    """Leave out the segments that the other demonstrations contradict, if the settings say so.

    Returns the examples with fewer segments, and the dropped ones in order.
    """
    actions = actions_of(examples)
    if not settings.trimmed or len(examples) < FEWEST or len(actions) < 2:
        return list(examples), ()
    probabilities = yield from _held_out_means(examples, actions, settings)
    dropped = _choose_dropped(examples, actions, probabilities)
    cleaned = [
        replace(e, segments=tuple(s for k, s in enumerate(e.segments) if (i, k) not in dropped))
        for i, e in enumerate(examples)
    ]
    return cleaned, tuple(
        DroppedSegment(examples[i].name, examples[i].segments[k], actions[dropped[i, k]])
        for i, k in sorted(dropped)
    )


def dropped_remarks(left_out: Sequence[DroppedSegment]) -> tuple[str, ...]:
    """A remark on the segments that were left out; none where nothing was."""
    # Of several folds each segment once, whatever it was rather taken for.
    segments = list({(c.demonstration, c.segment): c for c in left_out}.values())
    if not segments:
        return ()
    named = ", ".join(
        f"{c.segment.action} of {c.demonstration} at {c.segment.start:.2f} s (rather {c.other})"
        for c in segments[:NAMED]
    )
    more = f" and {len(segments) - NAMED} more" if len(segments) > NAMED else ""
    return (f"Not trained on, because the other demonstrations contradict it: {named}{more}.",)


def _held_out_means(
    examples: Sequence[Examples], actions: tuple[str, ...], settings: Settings
) -> Generator[Progress, None, list[Real]]:
    """Mean probabilities (segments, K) over each segment, by trees grown on the others.

    Zero throughout for a segment without a time step.
    """
    from sklearn.ensemble import ExtraTreesClassifier
    from threadpoolctl import threadpool_limits

    codes = [example.codes(actions) for example in examples]
    stride = _training_stride(codes, examples[0].rate, settings)
    y, groups, steps = training_steps(codes, stride, complete=True)
    (X,) = yield from gather_features(examples, steps)
    means = [np.zeros((len(e.segments), len(actions))) for e in examples]
    count = min(FOLDS, len(examples))
    done = 0
    for first in range(count):
        others = groups % count != first
        training_codes = y[others]
        trees = None
        if len(np.unique(training_codes)) > 1:
            with threadpool_limits(1):
                trees = ExtraTreesClassifier(TREES, random_state=settings.seed)
                trees.fit(X[others], training_codes)
        for i in range(first, len(examples), count):
            if trees is not None:
                with threadpool_limits(1):
                    means[i][:, trees.classes_] = _means(examples[i], trees)
            done += 1
            yield Progress(done, len(examples), "contradictions")
    return means


def _training_stride(codes: Sequence[Codes], rate: float, settings: Settings) -> int:
    """Time steps from one that the trees are grown of to the next."""
    labelled = sum(int(np.count_nonzero(item_codes != UNLABELLED)) for item_codes in codes)
    apart = round(APART * rate / settings.hop(rate))
    return max(settings.training_stride(rate), apart, math.ceil(labelled / MOST))


def _means(examples: Examples, trees: Any) -> Real:
    """Mean probabilities over the middle of each segment, shape (segments, actions learnt)."""
    probabilities = trees.predict_proba(examples.all_features())
    probabilities[~examples.valid] = 0.0
    sums = np.concatenate([np.zeros((1, probabilities.shape[1])), np.cumsum(probabilities, axis=0)])
    valid_counts = np.concatenate([[0], np.cumsum(examples.valid)])
    margins = np.array([MARGIN * s.duration for s in examples.segments])
    starts = np.array([s.start for s in examples.segments]) + margins
    ends = np.array([s.end for s in examples.segments]) - margins
    first, last = (np.searchsorted(examples.times, at) for at in (starts, ends))
    steps = valid_counts[last] - valid_counts[first]
    return (sums[last] - sums[first]) / np.maximum(steps, 1)[:, None]


def _choose_dropped(
    examples: Sequence[Examples], actions: tuple[str, ...], probabilities: Sequence[Real]
) -> dict[tuple[int, int], int]:
    """Demonstration and index of the segments to leave out, with the code they rather have."""
    number = {action: code for code, action in enumerate(actions)}
    codes = [
        [
            number[s.action] if row.any() else UNLABELLED
            for s, row in zip(e.segments, item_probabilities)  # noqa: B905
        ]
        for e, item_probabilities in zip(examples, probabilities, strict=True)
    ]
    places = [(i, k) for i, e in enumerate(examples) for k in range(len(e.segments))]
    sequence = SegmentSequence(codes)
    if len(sequence.known) == 0:
        return {}
    total = Counter(code for sequence_codes in codes for code in sequence_codes)
    dropped: dict[tuple[int, int], int] = {}
    dropped_counts: Counter[int] = Counter()
    suspicions = score_suspicions(np.concatenate(probabilities)[sequence.known], sequence)
    for place, other, suspicion in sorted(
        suspicions, key=lambda segment: (-segment[2], segment[0])
    ):
        if suspicion < SURE:
            break
        i, k = places[place]
        code = codes[i][k]
        if dropped_counts[code] < total[code] // ONE_IN:
            dropped_counts[code] += 1
            dropped[i, k] = other
    return dropped
