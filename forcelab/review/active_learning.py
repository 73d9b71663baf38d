"""Active learning: which demonstration to label next, and what that is expected to bring.

The uncertainty of a moment is ``1 - p`` with p the probability of its most probable action, and
that of a demonstration its mean over time. How much of it is probably wrong follows from the run's
own tested demonstrations, by histogram binning [1]_: of all labelled moments there that were about
as uncertain, so many were not the human's action.

Where a coder labels next what a recogniser is least certain of, odd demonstrations come first: what
is unlike all others is uncertain, too, teaches little about them, and gains less than an order at
random. Information density [3]_ therefore weighs the uncertainty of each by how many are like it,
which does not (:mod:`tests.benchmarks.label_next` measures both). Demonstrations are alike by mean
and spread of their features, whatever was labelled.

.. [1] Zadrozny and Elkan, "Obtaining calibrated probability estimates from decision trees and naive
   Bayesian classifiers", ICML 2001.

.. [2] Zadrozny and Elkan, "Transforming classifier scores into accurate multiclass probability
   estimates", KDD 2002: pool adjacent violators.

.. [3] Settles and Craven, "An analysis of active learning strategies for sequence labeling tasks",
   EMNLP 2008, section 3.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from forcelab.labels import UNLABELLED, Interval, Segments, to_codes
from forcelab.recognition.examples import Examples
from forcelab.recognition.probabilities import ProbabilityTrace
from forcelab.segment_edits import overlapping

if TYPE_CHECKING:
    from forcelab.recognition.results import DemonstrationResult
    from forcelab.review.run_result import RunResult


#: Time steps of each demonstration that are looked at: their mean and spread are known to a
#: thirtieth of the spread, and a hundred demonstrations of a hundred features take 40 MB.
STEPS = 1000

Steps = NDArray[np.float32]


def sample_steps(examples: Examples) -> Steps:
    """Features of at most :data:`STEPS` valid time steps, spread evenly; float32, shape (m, f)."""
    valid = np.flatnonzero(examples.valid)
    stride = -(-len(valid) // STEPS) or 1
    # What is larger than the type holds is as odd as what it can hold.
    most = np.finfo(np.float32).max
    return np.clip(examples.features[valid[::stride]], -most, most).astype(np.float32)


def typicality(demonstrations: Sequence[Steps]) -> NDArray[np.float64]:
    """Share of all demonstrations, given by their sampled features (m, f), that are like each.

    Features are standardised over all demonstrations, and large ones made logarithmic: a single
    peak says little of what a demonstration is like. Two are alike by ``exp(-(d / h)^2)``, d being
    the distance of their means and spreads and h the median distance of two that differ. Above 0,
    at most 1: of 1 where all are alike, as one by itself is; 0 for one without rows.
    """
    typical = np.zeros(len(demonstrations))
    nonempty = [i for i, steps in enumerate(demonstrations) if len(steps)]
    if not nonempty:
        return typical
    all_steps = np.concatenate([demonstrations[i] for i in nonempty])
    mean, scale = all_steps.mean(axis=0, dtype=np.float64), all_steps.std(axis=0, dtype=np.float64)
    scale[scale == 0] = 1.0
    summaries = np.stack([_mean_and_spread((demonstrations[i] - mean) / scale) for i in nonempty])
    # One after the other: of all pairs at once the differences of 1,000 take gigabytes.
    apart = np.stack([np.linalg.norm(summaries - summary, axis=1) for summary in summaries])
    differing = apart[apart > 0]
    usual = float(np.median(differing)) if len(differing) else 1.0
    typical[nonempty] = np.exp(-np.square(apart / usual)).mean(axis=1)
    return typical


def _mean_and_spread(steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean and spread of standardised features, shape (2 f,)."""
    ready = np.arcsinh(steps)
    return np.concatenate([ready.mean(axis=0), ready.std(axis=0)])


#: Bins of equal width between the probabilities 0 and 1.
BINS = 10
#: With less tested time than this in a bin, in seconds, its neighbours are believed rather.
LEAST = 0.5
#: Seconds of the stretch that is looked at first.
STRETCH = 1.0

Real = NDArray[np.float64]


@dataclass(frozen=True)
class ConfidenceCalibration:
    """How often a run was right, by its confidence."""

    #: (BINS,); share of the tested time that has the human's action, by probability of the most
    #: probable action. Bins that were hardly tested have a value between their neighbours'.
    accuracy: Real
    seconds: float  # labelled time that was tested; with 0, `accuracy` is the probability itself

    def wrong(self, confidence: Real) -> Real:
        """Expected share that is wrong, for probabilities of any shape."""
        if not self.seconds:
            return 1.0 - confidence
        bins = np.minimum((confidence * BINS).astype(np.int64), BINS - 1)
        return 1.0 - self.accuracy[bins]


@dataclass(frozen=True)
class Proposal:
    """An unlabelled demonstration that could be labelled next."""

    id: str
    name: str
    task: str
    seconds: float  # how long it is
    uncertainty: float  # mean of ``1 - p`` over time, 0 to 1
    #: Seconds of the prediction that are probably wrong: what labelling it is expected to bring
    wrong: float
    place: Interval  # its most uncertain stretch
    #: How typical it is of all proposals, 0 to 1; None where the run did not keep it
    typicality: float | None = None


def calibrate_confidence(run: RunResult) -> ConfidenceCalibration:
    """Compare the predictions of the tested demonstrations with their humans."""
    right, total = np.zeros(BINS), np.zeros(BINS)
    for result in run.tested:
        trace = result.probability_trace
        if trace is None or not len(trace.values):
            continue
        # An action that the recogniser never met is predicted wrong wherever it is.
        actions = dict.fromkeys((*trace.actions, *(s.action for s in result.human)))
        human = to_codes(result.human, trace.times, tuple(actions))
        known = (human != UNLABELLED) & trace.known
        confidence = _confidence(trace)[known]
        bins = np.minimum((confidence * BINS).astype(np.int64), BINS - 1)
        hit = trace.values.argmax(axis=1)[known] == human[known]
        total += np.bincount(bins, minlength=BINS) / trace.rate
        right += np.bincount(bins, weights=hit, minlength=BINS) / trace.rate
    tested = np.flatnonzero(total >= LEAST)
    if not len(tested):
        return ConfidenceCalibration((np.arange(BINS) + 0.5) / BINS, 0.0)
    rising = _pool_adjacent_violators(right[tested] / total[tested], total[tested])
    accuracy = np.interp(np.arange(BINS), tested, rising)
    return ConfidenceCalibration(accuracy, float(total.sum()))


def rank_proposals(run: RunResult) -> tuple[Proposal, ...]:
    """The unlabelled demonstrations of a run, the one to label next first.

    By uncertainty times typicality; by uncertainty alone where older runs did not store that.
    """
    calibration = calibrate_confidence(run)
    candidates = (_proposal(result, calibration) for result in run.proposals)
    proposals = [proposal for proposal in candidates if proposal is not None]
    typical = weighs_typicality(proposals)

    def urgency(proposal: Proposal) -> float:
        return (
            proposal.uncertainty * (proposal.typicality or 0.0) if typical else proposal.uncertainty
        )

    return tuple(sorted(proposals, key=urgency, reverse=True))


def weighs_typicality(proposals: Sequence[Proposal]) -> bool:
    """Whether proposals are ordered by their typicality, too; older runs did not store it."""
    return all(proposal.typicality is not None for proposal in proposals)


def acceptable_segments(
    result: DemonstrationResult, start: float, end: float, at_least: float = 0.0
) -> Segments:
    """The predicted segments that overlap ``[start, end)`` (s) with at least that mean probability.

    Each is taken as a whole; with 0 no probability is needed.
    """
    return tuple(
        s
        for s in result.predicted[overlapping(result.predicted, start, end)]
        if not at_least or (result.confidence(s.action, s.start, s.end) or 0.0) >= at_least
    )


def uncertainty(trace: ProbabilityTrace) -> float:
    """Mean of ``1 - p`` over time, p the probability of the most probable action; 0 to 1.

    Bins without a probability do not count; where there is no other, the uncertainty is 0.
    """
    defined = trace.known
    return float(1.0 - _confidence(trace)[defined].mean()) if defined.any() else 0.0


def _pool_adjacent_violators(values: Real, weights: Real) -> Real:
    """The nearest values that never fall: higher confidence is not less often right.

    Neighbours that fall are replaced by their mean, until none is left [2]_.
    """
    pools: list[tuple[float, float, int]] = []
    for value, weight in zip(values.tolist(), weights.tolist(), strict=True):
        mean, mass, count = value, weight, 1
        while pools and pools[-1][0] >= mean:
            before, pool_mass, others = pools.pop()
            mean = (before * pool_mass + mean * mass) / (pool_mass + mass)
            mass, count = mass + pool_mass, count + others
        pools.append((mean, mass, count))
    return np.repeat([mean for mean, _, _ in pools], [count for _, _, count in pools])


def _proposal(result: DemonstrationResult, calibration: ConfidenceCalibration) -> Proposal | None:
    """The proposal of one demonstration; None where no probability is known."""
    trace = result.probability_trace
    if trace is None or not (defined := trace.known).any():
        return None
    confidence = _confidence(trace)
    return Proposal(
        id=result.id,
        name=result.name,
        task=result.task,
        seconds=result.end - result.start,
        uncertainty=uncertainty(trace),
        wrong=float(calibration.wrong(confidence[defined]).sum() / trace.rate),
        place=_least_certain_interval(result, trace),
        typicality=result.typicality,
    )


def _confidence(trace: ProbabilityTrace) -> Real:
    """Probability of the most probable action over time."""
    return np.asarray(trace.values.max(axis=1) / np.iinfo(trace.values.dtype).max)


def _least_certain_interval(result: DemonstrationResult, trace: ProbabilityTrace) -> Interval:
    """The stretch of :data:`STRETCH` seconds, or less, with the most uncertainty in it.

    One value where they are farther apart than that.
    """
    doubt = np.where(trace.known, 1.0 - _confidence(trace), 0.0)
    width = min(max(round(STRETCH * trace.rate), 1), len(doubt))
    sums = np.cumsum(np.concatenate([[0.0], doubt]))
    first = int(np.argmax(sums[width:] - sums[:-width]))
    start = max(trace.start + first / trace.rate, result.start)
    end = min(trace.start + (first + width) / trace.rate, result.end)
    means = trace.mean(start, end)
    best = int(np.argmax(means))
    return Interval(
        result.id,
        start,
        end,
        predicted=trace.actions[best],
        confidence=float(means[best]),
    )
