"""How much each feature speaks for one action and against another.

For scikit-learn's MLP with one hidden layer of rectified units the answer is exact: the integrated
gradients of Sundararajan, Taly and Yan, "Axiomatic Attribution for Deep Networks", ICML 2017, which
add up to the difference of the log-odds at the two ends of the line from a reference to the time
step. A rectified unit is linear on either side of its kink, so the average along the line has a
closed form: each unit counts with the share of the line on which it is active. Features that are
standardised and clipped before it keep their columns, and calibration multiplies the logits. Of
other classifiers only the scores are known; :mod:`forcelab.review.explanation` permutes their
features.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from forcelab.arrays import Real
from forcelab.recognition.ensemble import CalibratedEnsemble
from forcelab.recognition.forest import softmax
from forcelab.recognition.perceptron import Perceptron
from forcelab.recognition.recogniser import Recogniser
from forcelab.runtime import one_blas_thread

#: Probabilities below this count as this: a tree or a vote of neighbours knows 0 and 1.
FLOOR = 1e-3


class Scorer(Protocol):
    """Anything that gives each action a score at each time step."""

    @property
    def actions(self) -> tuple[str, ...]:
        """The actions that it tells apart, length K."""

    def scores(self, features: Real) -> Real:
        """Scores (n, K) of features (n, f), whose differences are log-odds."""


def log_odds(scorer: Scorer, features: Real, favoured: str, against: str) -> Real:
    """Log-odds of two actions at each time step, positive where `favoured` leads; shape (n,)."""
    scores = scorer.scores(features)
    first, second = scorer.actions.index(favoured), scorer.actions.index(against)
    return np.asarray(scores[:, first] - scores[:, second])


@dataclass(frozen=True, eq=False)
class MlpScorer:
    """An MLP with one hidden layer of h rectified units, and what is before and behind it."""

    actions: tuple[str, ...]  # length K
    network: Perceptron
    #: By which the probabilities are sharpened; the logits grow by as much
    exponent: float = 1.0
    #: Features as the network looks at them (n, f), column by column
    prepare: Callable[[Real], Real] = np.asarray

    def scores(self, features: Real) -> Real:
        """The logits, as scores."""
        return self.exponent * self.network.logits(self.prepare(features))

    def probabilities(self, features: Real) -> Real:
        """Probabilities of the actions at each time step, shape (n, K)."""
        return softmax(self.scores(features))

    def integrated_gradients(
        self, features: Real, reference: Real, favoured: str, against: str
    ) -> Real:
        """What each feature adds to the log-odds, compared with a reference (f,): shape (n, f).

        Each row adds up to the log-odds there minus those at the reference, but for rounding. The
        line from the reference runs through what the network looks at.
        """
        weights = self.exponent * self._between(favoured, against)
        ready, start = (
            self.network.clipped(self.prepare(rows)) for rows in (features, reference[np.newaxis])
        )
        inputs, reference_inputs = self.network.arriving(ready), self.network.arriving(start)
        change = inputs - reference_inputs
        # The share of the line on which a unit is active; where it stays put, its state there.
        moved = change != 0
        gained = np.maximum(inputs, 0.0) - np.maximum(reference_inputs, 0.0)
        active = np.where(moved, gained / np.where(moved, change, 1.0), reference_inputs > 0)
        return np.asarray((ready - start) * ((active * weights) @ self.network.inner.T))

    def _between(self, favoured: str, against: str) -> Real:
        """Weight of each hidden unit in the log-odds, shape (h,)."""
        first, second = self.actions.index(favoured), self.actions.index(against)
        return np.asarray(self.network.outer[:, first] - self.network.outer[:, second])


@dataclass(frozen=True, eq=False)
class BlackBoxScorer:
    """Any other fitted classifier of the codes 0 .. K-1."""

    actions: tuple[str, ...]
    classifier: Any  # fitted to the codes 0 .. K-1

    @property
    def probabilistic(self) -> bool:
        """Whether it gives probabilities; otherwise its margins stand for log-odds."""
        return hasattr(self.classifier, "predict_proba")

    def scores(self, features: Real) -> Real:
        """Logarithms of probabilities from :data:`FLOOR` on, or margins, as scores."""
        with one_blas_thread():
            if hasattr(self.classifier, "predict_joint_log_proba"):  # known without rounding
                return np.asarray(self.classifier.predict_joint_log_proba(features))
            if self.probabilistic:
                return np.log(np.maximum(self.classifier.predict_proba(features), FLOOR))
            if not hasattr(self.classifier, "decision_function"):  # one's own may only decide
                votes = np.equal.outer(self.classifier.predict(features), self.classifier.classes_)
                return np.log(np.maximum(votes, FLOOR))
            margins = np.asarray(self.classifier.decision_function(features))
        if margins.ndim == 1:  # of two actions there is one margin, the second one's
            margins = np.stack([np.zeros_like(margins), margins], axis=1)
        return margins

    def probabilities(self, features: Real) -> Real | None:
        """Probabilities of the actions at each time step, shape (n, K); None where it has none."""
        if not self.probabilistic:
            return None
        with one_blas_thread():
            return np.asarray(self.classifier.predict_proba(features))


def make_scorer(recogniser: Recogniser) -> MlpScorer | BlackBoxScorer:
    """The scorer of a recogniser's classifier."""
    classifier, actions = recogniser.classifier, recogniser.actions
    if isinstance(classifier, CalibratedEnsemble):
        # Of several that are averaged the logits do not add up.
        (network, *others) = classifier.members
        if isinstance(network, Perceptron) and not others:
            return MlpScorer(actions, network, classifier.exponent, classifier.standardised)
    elif len(getattr(classifier, "coefs_", ())) == 2 and classifier.activation == "relu":
        return MlpScorer(actions, Perceptron.from_sklearn(classifier))
    return BlackBoxScorer(actions, classifier)
