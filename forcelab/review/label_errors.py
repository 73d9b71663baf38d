"""Suspected coding errors: segments, parts of them and edges that a held-out model contradicts.

*Segments.* The evidence is that of :mod:`forcelab.recognition.label_noise`. It counts only for an
action that is more probable than the coder's and of which the prediction has more there: what is
unusual, but predicted as well, is no error.

*Parts* are what the prediction cuts off a segment called x and calls y, where a coder ends an
action far too early, or overlooks a short one. The evidence is the log ratio

    log E = sum_k r_k log(P[k | y] / P[k | x]) + w (log P[the order with y] - log P[as coded]),

with `r` the mean probability of each action over the part and the order as a Markov chain; all this
is learnt from the other segments, and w is the mutual information of the order. If a share of the
other segments of x hold such a part too, P[y | x] is no less than that: what happens everywhere is
the model's weakness. The suspicion is q E / (1 + E), with q the mean probability of y, times the
length as a share of the median length of y, where it is shorter: so neither an uncertain stretch
nor an edge that is a little displaced is suspicious.

*Edges* are suspect if the model puts them elsewhere, is sure of both sides and of what lies
between, and is far more off than usual where the same two meet: with q the least of the three mean
probabilities, d the displacement and u its median over that transition, q min(1, d / (4 u))^2,
which counts from 2 u on.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby, pairwise
from statistics import median

import numpy as np

from forcelab.arrays import Real
from forcelab.labels import Segment, Segments
from forcelab.recognition.label_noise import (
    MARGIN,
    PSEUDO,
    SUSPECT,
    SegmentSequence,
    neighbour_information,
    score_suspicions,
)
from forcelab.recognition.probabilities import ProbabilityTrace
from forcelab.recognition.results import DemonstrationResult
from forcelab.review.differences import Difference, seconds_covered


@dataclass(frozen=True)
class ModelEvidence:
    """The model's probabilities over the segments of one demonstration; m segments, K actions."""

    demonstration: str  # its id
    segments: Segments  # the human's, m of them
    probabilities: Real  # (m, K); mean of each action over the middle of each segment
    predicted: Real  # (m, K); share of it that the prediction gives to each action
    parts: tuple[Difference, ...]  # the stretches of kind "action", p of them
    part_probabilities: Real  # (p, K); mean of each action over each part


def gather_evidence(
    result: DemonstrationResult,
    segments: Segments,
    actions: Sequence[str],
    differences: Iterable[Difference] = (),
) -> ModelEvidence:
    """Gather the model's probabilities over a human's segments, and over the differences within.

    Without probabilities the share of time that it gives to each action stands for them. Without
    `differences` only whole segments are judged.
    """
    parts = tuple(d for d in differences if d.kind == "action")
    trace, raw = result.probability_trace, result.stages.get("raw", result.predicted)

    def over_middles(
        spans: Sequence[Segment | Difference], share: Callable[[float, float], Mapping[str, float]]
    ) -> Real:
        """A share of each action over each span without its edges, shape (spans, K)."""
        out = np.zeros((len(spans), len(actions)))
        for row, span in zip(out, spans, strict=True):
            margin = MARGIN * (span.end - span.start)
            found = share(span.start + margin, span.end - margin)
            row[:] = [found.get(action, 0.0) for action in actions]
        return out

    probability = partial(_shares, raw) if trace is None else partial(_means, trace)
    return ModelEvidence(
        result.id,
        segments,
        over_middles(segments, probability),
        over_middles(segments, partial(_shares, result.predicted)),
        parts,
        over_middles(parts, probability),
    )


def _means(trace: ProbabilityTrace, start: float, end: float) -> dict[str, float]:
    """Mean probability of each action over ``[start, end)``."""
    return dict(zip(trace.actions, trace.mean(start, end).tolist(), strict=True))


def _shares(segments: Segments, start: float, end: float) -> dict[str, float]:
    """Share of ``[start, end)`` that segments give to each action."""
    covered = seconds_covered(segments, start, end)
    return {action: seconds / (end - start) for action, seconds in covered.items()}


#: A part is like another one if it lasts at least this share of it.
ALIKE = 0.5


@dataclass(frozen=True)
class _SuspectPart:
    """A part with its codes."""

    difference: Difference
    number: int  # of its segment, among all
    start: float  # of its segment, in seconds
    #: x, y: the codes of what human and model see
    x: int
    y: int
    probabilities: Real
    #: coded, instead: the order of actions around it as it was coded, and with y
    coded: tuple[int, ...]
    instead: tuple[int, ...]


def suspect_parts(
    evidences: Sequence[ModelEvidence], actions: Sequence[str]
) -> Mapping[tuple[str, float], list[Difference]]:
    """The parts with their suspicion, by demonstration and start of their segment.

    `actions` are the columns of the evidence; parts with other actions are left out.
    """
    codes = {action: code for code, action in enumerate(actions)}
    parts = list(_numbered_parts(evidences, codes))
    words, order = _ProbabilityEvidence(evidences, codes, parts), _OrderEvidence(evidences, codes)
    lengths: dict[str | None, list[float]] = defaultdict(list)
    for evidence_item in evidences:
        for segment in evidence_item.segments:
            lengths[segment.action].append(segment.duration)
    usual = {action: median(durations) for action, durations in lengths.items()}
    result = defaultdict(list)
    for part in parts:
        difference = part.difference
        evidence = words.evidence(part) + order.evidence(part)
        share = min(1.0, difference.duration / usual.get(difference.predicted, math.inf))
        probability = float(part.probabilities[part.y])
        suspicion = probability * share * float(np.exp(-np.logaddexp(0.0, -evidence)))
        place = difference.demonstration, part.start
        result[place].append(replace(difference, suspicion=suspicion))
    return result


def _numbered_parts(
    evidences: Sequence[ModelEvidence], codes: Mapping[str, int]
) -> Iterator[_SuspectPart]:
    """The parts whose actions are known."""
    before = 0
    for evidence in evidences:
        sequence = _code_sequence(evidence, codes)
        starts = [segment.start for segment in evidence.segments]
        for difference, probabilities in zip(
            evidence.parts, evidence.part_probabilities, strict=True
        ):
            x, y = codes.get(difference.human or ""), codes.get(difference.predicted or "")
            k = bisect_right(starts, difference.start) - 1
            segment = evidence.segments[k]
            whole = difference.duration >= (1.0 - 2.0 * MARGIN) * segment.duration
            if x is None or y is None or whole:
                continue
            left, _, right = sequence[k : k + 3]
            ahead = [x] if difference.start > starts[k] else []
            rest = [x] if difference.end < segment.end else []
            # An action that goes on is one.
            instead = tuple(code for code, _ in groupby([left, *ahead, y, *rest, right]))
            coded = (left, x, right)
            yield _SuspectPart(
                difference, before + k, starts[k], x, y, probabilities, coded, instead
            )
        before += len(starts)


def _code_sequence(evidence: ModelEvidence, codes: Mapping[str, int]) -> list[int]:
    """The codes of a demonstration's segments; K stands for either end and for the unknown."""
    K = len(codes)
    return [K, *(codes.get(segment.action, K) for segment in evidence.segments), K]


class _ProbabilityEvidence:
    """The model's usual probabilities over segments of each action."""

    def __init__(
        self,
        evidences: Sequence[ModelEvidence],
        codes: Mapping[str, int],
        parts: Sequence[_SuspectPart],
    ) -> None:
        K = len(codes)
        sequence_codes = [
            code for evidence in evidences for code in _code_sequence(evidence, codes)[1:-1]
        ]
        self._probabilities = np.concatenate([evidence.probabilities for evidence in evidences])
        self._totals = np.zeros((K + 1, K))
        np.add.at(self._totals, sequence_codes, self._probabilities)
        self._counts = np.bincount(sequence_codes, minlength=K + 1)
        self._longest: dict[tuple[int, int], dict[int, float]] = defaultdict(dict)
        for part in parts:
            longest = self._longest[part.x, part.y]
            length = part.difference.duration
            longest[part.number] = max(longest.get(part.number, 0.0), length)

    def evidence(self, part: _SuspectPart) -> float:
        """Log ratio of the probabilities over a part."""
        x, y, spread = part.x, part.y, 1.0 / len(part.probabilities)
        called_y = (self._totals[y] + spread) / (self._counts[y] + 1)
        without = np.maximum(self._totals[x] - self._probabilities[part.number], 0.0)
        least = ALIKE * part.difference.duration
        longest = self._longest[x, y].items()
        longer = sum(length >= least for number, length in longest if number != part.number)
        without[y] = max(without[y], longer)
        called_x = (without + spread) / self._counts[x]
        return float(part.probabilities @ np.log(called_y / called_x))


class _OrderEvidence:
    """Counts of which action follows which."""

    def __init__(self, evidences: Sequence[ModelEvidence], codes: Mapping[str, int]) -> None:
        self._transitions = np.zeros((len(codes) + 1, len(codes) + 1))
        for evidence in evidences:
            for pair in pairwise(_code_sequence(evidence, codes)):
                self._transitions[pair] += 1.0
        self._mutual_information = neighbour_information(self._transitions)

    def evidence(self, part: _SuspectPart) -> float:
        """Log ratio of the order with a part."""
        transitions = self._transitions.copy()
        for pair in pairwise(part.coded):
            transitions[pair] -= 1.0
        transitions += PSEUDO
        chances = transitions / transitions.sum(axis=1, keepdims=True)
        instead, coded = (
            sum(math.log(chances[pair]) for pair in pairwise(path))
            for path in (part.instead, part.coded)
        )
        return self._mutual_information * (instead - coded)


#: An edge is far off at so many times the usual displacement, which is so many seconds at least;
#: below half of that it is as good as others.
FAR, LEAST_USUAL = 4.0, 0.025


def suspect_segments(
    everything_in: Iterable[ModelEvidence], actions: Sequence[str]
) -> tuple[Difference, ...]:
    """Every human segment, or part of one, that the model would rather call something else.

    The most suspect first; `confidence` is the mean probability of the other action. A segment is
    listed as a whole where that is suspected, and otherwise as what is more suspect: the whole, or
    its parts.
    """
    evidences = [evidence for evidence in everything_in if evidence.segments]
    if not evidences:
        return ()
    # Of an action that it never learnt, as of another task, the model cannot be a witness.
    learnt_codes = np.flatnonzero(
        np.concatenate([evidence.probabilities for evidence in evidences]).any(axis=0)
    )
    if len(learnt_codes) < 2:
        return ()
    learnt_actions = [actions[code] for code in learnt_codes.tolist()]
    evidences = [
        replace(
            evidence,
            probabilities=evidence.probabilities[:, learnt_codes],
            predicted=evidence.predicted[:, learnt_codes],
            part_probabilities=evidence.part_probabilities[:, learnt_codes],
        )
        for evidence in evidences
    ]
    wholes = {(d.demonstration, d.start): d for d in _segments(evidences, learnt_actions)}
    parts = suspect_parts(evidences, learnt_actions)
    result: list[Difference] = []
    for place in wholes.keys() | parts.keys():
        whole, own_parts = wholes.get(place), parts.get(place, [])
        most = max((part.suspicion for part in own_parts), default=0.0)
        if whole is not None and whole.suspicion >= min(SUSPECT, most):
            result.append(whole)
        else:
            result += own_parts
    return tuple(sorted(result, key=lambda d: (-d.suspicion, d.demonstration, d.start)))


def _segments(evidences: Sequence[ModelEvidence], actions: Sequence[str]) -> list[Difference]:
    """The whole segments with a suspicion."""
    probabilities = np.concatenate([h.probabilities for h in evidences])
    number = {action: code for code, action in enumerate(actions)}
    sequence = SegmentSequence([[number.get(s.action, -1) for s in h.segments] for h in evidences])
    segments = [(h.demonstration, segment) for h in evidences for segment in h.segments]
    predicted = np.concatenate([h.predicted for h in evidences])[sequence.known]
    known, own = probabilities[sequence.known], (np.arange(len(predicted)), sequence.codes)
    # A label may be unusual: the model contradicts it only by seeing more of something else.
    contradicts = (known > known[own][:, None]) & (predicted > predicted[own][:, None])
    return [
        Difference(
            segments[i][0],
            segments[i][1].start,
            segments[i][1].end,
            segments[i][1].action,
            actions[other],
            float(probabilities[i, other]),
            suspicion=suspicion,
        )
        for i, other, suspicion in score_suspicions(known, sequence, contradicts)
        if suspicion > 0
    ]


def suspect_edges(
    differences: Sequence[Difference], traces: Mapping[str, ProbabilityTrace | None]
) -> tuple[Difference, ...]:
    """The differences of all demonstrations, those of kind "boundary" with their suspicion.

    What is usual is learnt from them; without a probability trace no edge is suspect.
    """
    lengths: dict[frozenset[str | None], list[float]] = {}
    for difference in differences:
        if difference.kind == "boundary":
            lengths.setdefault(_transition(difference), []).append(difference.duration)
    usual = {pair: max(median(durations), LEAST_USUAL) for pair, durations in lengths.items()}
    return tuple(
        replace(d, suspicion=_edge(d, usual[_transition(d)], traces.get(d.demonstration)))
        if d.kind == "boundary"
        else d
        for d in differences
    )


def _transition(difference: Difference) -> frozenset[str | None]:
    """The two actions that meet at a displaced edge, in either order."""
    return frozenset((difference.human, difference.predicted))


def _edge(difference: Difference, usual: float, trace: ProbabilityTrace | None) -> float:
    """The suspicion of a displaced edge."""
    if trace is None or difference.confidence is None:
        return 0.0
    far = min(1.0, difference.duration / (FAR * usual))
    if far < 0.5:
        return 0.0
    start, end, length = difference.start, difference.end, difference.duration
    beside = (trace.mean(start - length, start), trace.mean(end, end + length))
    probability = min(difference.confidence, *(float(side.max()) for side in beside))
    return probability * far**2
