"""A classifier asked for a few steps at a time, which is mostly overhead otherwise."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.labels import UNLABELLED
from forcelab.recognition.filters import threshold
from forcelab.recognition.recogniser import Recogniser

__all__ = ["classify", "prober"]

Real = NDArray[np.float64]
Codes = NDArray[np.int64]
Prober = Callable[[Real], Real]


def prober(classifier: Any) -> Prober | None:
    """What gives a classifier's probabilities, shape (n, classes); None of one that has none.

    Of scikit-learn's MLP as it is trained here the sums are done in place: checking its input
    takes it ten times as long as 20 steps do.
    """
    if not hasattr(classifier, "predict_proba"):
        return None
    plain = type(classifier).__name__ == "MLPClassifier" and classifier.activation == "relu"
    if not plain or classifier.out_activation_ not in ("softmax", "logistic"):
        asked: Prober = classifier.predict_proba
        return asked
    layers = list(zip(classifier.coefs_, classifier.intercepts_, strict=True))
    softmax = classifier.out_activation_ == "softmax"

    def probabilities(features: Real) -> Real:
        values = features
        for i, (weights, bias) in enumerate(layers):
            values = values @ weights + bias
            if i < len(layers) - 1:
                np.maximum(values, 0.0, out=values)
        if softmax:
            values -= values.max(axis=1, keepdims=True)
            np.exp(values, out=values)
            return values / values.sum(axis=1, keepdims=True)
        with np.errstate(over="ignore"):  # exp(800) is as good as infinite
            second = 1.0 / (1.0 + np.exp(-values))
        return np.concatenate([1.0 - second, second], axis=1)

    return probabilities


def classify(
    recogniser: Recogniser, features: Real, valid: NDArray[np.bool_], probe: Prober | None
) -> tuple[Codes, Real | None]:
    """Codes of steps after the threshold, and their probabilities where there are any.

    Parameters
    ----------
    recogniser : Recogniser
    features : ndarray, shape (n, f)
    valid : ndarray of bool, shape (n,)
        Where not, nothing is asked: unlabelled, with probabilities of zero.
    probe : callable or None
        As of :func:`prober`.
    """
    classifier, at = recogniser.classifier, recogniser.settings.threshold
    whole = len(valid) > 0 and bool(valid.all())
    if probe is not None and whole and len(classifier.classes_) == len(recogniser.actions):
        # Nothing to be left out and an action for each class: nearly always.
        found = probe(features)
        codes = np.argmax(found, axis=1)
        return codes if at is None else threshold(codes, found, at), found
    codes = np.full(len(features), UNLABELLED, dtype=np.int64)
    probabilities = None if probe is None else np.zeros((len(features), len(recogniser.actions)))
    if not valid.any():
        return codes, probabilities
    if probe is None or probabilities is None:
        codes[valid] = classifier.predict(features[valid])
        return codes, None
    found = probe(features[valid])
    probabilities[np.ix_(valid, classifier.classes_)] = found
    codes[valid] = classifier.classes_[np.argmax(found, axis=1)]
    if at is not None:
        codes = threshold(codes, probabilities, at)
    return codes, probabilities
