"""The recogniser: features, classifier and filters, with what it learnt."""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.labels import UNLABELLED, Segments, from_codes
from forcelab.recognition import filters
from forcelab.recognition.examples import Examples, Labelled, prepare
from forcelab.recognition.settings import Settings

__all__ = ["Prediction", "Recogniser"]

#: Time steps classified at once, so that the hidden layer's activations stay small.
BLOCK = 100_000


@dataclass(frozen=True)
class Prediction:
    """What a recogniser says of one demonstration.

    Parameters
    ----------
    times : ndarray of float64, shape (n,)
        Seconds.
    actions : tuple of str, length K
        The action with code ``i`` is ``actions[i]``.
    raw : ndarray of int64, shape (n,)
        Most probable action of each time step; unlabelled only in gaps.
    filtered : ndarray of int64, shape (n,)
        The same after the recogniser's filters.
    probabilities : ndarray of float64, shape (n, K), or None
        None where nothing needed them.
    seconds : dict
        Run time of ``predict`` and ``filter``.
    """

    times: NDArray[np.float64]
    actions: tuple[str, ...]
    raw: NDArray[np.int64]
    filtered: NDArray[np.int64]
    probabilities: NDArray[np.float64] | None
    seconds: dict[str, float]

    @property
    def segments(self) -> Segments:
        """The filtered prediction as segments."""
        return from_codes(self.filtered, self.times, self.actions)


@dataclass(frozen=True)
class Recogniser:
    """A trained recogniser.

    Parameters
    ----------
    settings : Settings
        What it was made with.
    rate : float
        Samples a second of the grid on which its scales count.
    channels : tuple of str
        Recognition channels it looks at.
    actions : tuple of str, length K
        What it can tell apart; the classifier's codes index it.
    shortest : dict of str to float
        Shortest training segment of each action, in seconds.
    classifier : object
        A fitted scikit-learn classifier of codes.
    trained_on : tuple of str
        Ids of the training demonstrations.
    """

    settings: Settings
    rate: float
    channels: tuple[str, ...]
    actions: tuple[str, ...]
    shortest: dict[str, float]
    classifier: Any
    trained_on: tuple[str, ...] = ()

    def predict(self, demonstration: Demonstration) -> Prediction:
        """Recognise the actions of a demonstration.

        Raises
        ------
        InputError
            If the demonstration lacks a channel that the recogniser looks at.
        """
        settings = self.settings.replace(channels=self.channels)
        return self.predict_examples(prepare(Labelled(demonstration), settings, self.rate))

    def predict_examples(self, examples: Examples) -> Prediction:
        """Recognise the actions of a demonstration whose features are there already."""
        if examples.channels != self.channels:
            raise InputError(
                f"'{examples.name}' has the channels {', '.join(examples.channels)}; the "
                f"recogniser was trained on {', '.join(self.channels)}."
            )
        started = perf_counter()
        raw, probabilities = self._classify(examples)
        classified = perf_counter()
        filtered = self._filter(raw, probabilities, examples)
        seconds = {"predict": classified - started, "filter": perf_counter() - classified}
        return Prediction(examples.times, self.actions, raw, filtered, probabilities, seconds)

    def _classify(self, examples: Examples) -> tuple[NDArray[np.int64], NDArray[np.float64] | None]:
        """Codes of every time step, and probabilities where the settings need them."""
        from threadpoolctl import threadpool_limits

        n, classes = len(examples.times), self.classifier.classes_
        raw = np.empty(n, dtype=np.int64)
        probabilities = np.zeros((n, len(self.actions))) if self._probabilistic else None
        with threadpool_limits(1, user_api="blas"):
            for first in range(0, n, BLOCK):
                block = slice(first, first + BLOCK)
                if probabilities is None:
                    raw[block] = self.classifier.predict(examples.features[block])
                    continue
                proba = self.classifier.predict_proba(examples.features[block])
                probabilities[block, classes] = proba
                raw[block] = classes[np.argmax(proba, axis=1)]
        raw[~examples.valid] = UNLABELLED
        return raw, probabilities

    @property
    def _probabilistic(self) -> bool:
        return self.settings.needs_probabilities

    def _filter(
        self,
        raw: NDArray[np.int64],
        probabilities: NDArray[np.float64] | None,
        examples: Examples,
    ) -> NDArray[np.int64]:
        """Apply the filters that are switched on, in the paper's order."""
        codes, settings = raw.copy(), self.settings
        if settings.threshold is not None and probabilities is not None:
            codes = filters.threshold(codes, probabilities, settings.threshold)
        if settings.median is not None:
            codes = filters.median(codes, settings.median)
            # A median reaches into gaps, where there is nothing to be seen.
            codes[~examples.valid] = UNLABELLED
        if settings.drop is not None:
            shortest = {
                code: self.shortest[action]
                for code, action in enumerate(self.actions)
                if action in self.shortest
            }
            codes = filters.drop_short(codes, examples.times, shortest, settings.drop)
        return codes
