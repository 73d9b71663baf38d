"""Active learning: which demonstration to label next, and what that is expected to bring.

The uncertainty of a moment is ``1 - p`` with p the probability of its most probable action, and
that of a demonstration its mean over time. How much of it is probably wrong follows from the run's
own tested demonstrations, by histogram binning [1]_: of all labelled moments there that were about
as uncertain, so many were not the human's action.

The demonstration that is least certain is proposed first: most of what it needs put right can be
expected there. That a recogniser then gets better faster than by an order at random is not to be
expected: no rule that was tried gains on all recordings (:mod:`tests.benchmarks.label_next`).

.. [1] Zadrozny and Elkan, "Obtaining calibrated probability estimates from decision trees and naive
   Bayesian classifiers", ICML 2001.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from forcelab.arrays import Real
from forcelab.labels import UNLABELLED, Interval, Segments, to_codes
from forcelab.recognition.probabilities import ProbabilityTrace
from forcelab.segment_edits import overlapping

if TYPE_CHECKING:
    from forcelab.recognition.results import DemonstrationResult
    from forcelab.review.run_result import RunResult


#: Bins of equal width between the probabilities 0 and 1.
BINS = 10
#: With less tested time than this in a bin, in seconds, its neighbours are believed rather.
LEAST = 0.5
#: Seconds of the stretch that is looked at first.
STRETCH = 1.0


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
    from scipy.optimize import isotonic_regression  # takes long to load

    # Higher confidence is not less often right.
    rising = isotonic_regression(right[tested] / total[tested], weights=total[tested])
    accuracy = np.interp(np.arange(BINS), tested, rising.x)
    return ConfidenceCalibration(accuracy, float(total.sum()))


def rank_proposals(run: RunResult) -> tuple[Proposal, ...]:
    """The unlabelled demonstrations of a run, the most uncertain one first."""
    calibration = calibrate_confidence(run)
    candidates = (_proposal(result, calibration) for result in run.proposals)
    proposals = [proposal for proposal in candidates if proposal is not None]
    return tuple(sorted(proposals, key=lambda proposal: proposal.uncertainty, reverse=True))


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
