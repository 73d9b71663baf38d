"""The recogniser: features, classifier and filters, with what it learnt."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from forcelab.arrays import Codes, Flags, Real, Whole
from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.labels import UNLABELLED, Segments, from_codes
from forcelab.recognition import filters
from forcelab.recognition.examples import (
    Examples,
    LabelledDemonstration,
    prepare_examples,
    unit_remarks,
)
from forcelab.recognition.hsmm import decode, marginals
from forcelab.recognition.label_noise import DroppedSegment
from forcelab.recognition.probabilities import ProbabilityTrace, Reliability
from forcelab.recognition.settings import Settings
from forcelab.recognition.task_grammar import BoundaryModel, TaskGrammar
from forcelab.runtime import one_blas_thread
from forcelab.signals.grid import SAME_RATE

if TYPE_CHECKING:
    from forcelab.recognition.live_model import LiveModel

#: Time steps classified at once, so that the hidden layer's activations stay small.
BLOCK = 100_000


@dataclass(frozen=True)
class Prediction:
    """The prediction of a recogniser for one demonstration.

    Parameters
    ----------
    times : ndarray of float64, shape (n,)
        Seconds.
    actions : tuple of str, length K
        The action with code ``i`` is ``actions[i]``.
    stages : dict of str to ndarray of int64, shape (n,)
        Codes after each step: ``"raw"``, the most probable action, unlabelled only in gaps;
        ``"threshold"`` and ``"median"`` as far as these filters are switched on; ``"filtered"``,
        after all filters, or decoded.
    probabilities : ndarray of float64, shape (n, K), or None
        None where nothing needed them.
    seconds : dict
        Run time of ``predict`` and ``filter``.
    probability_trace : ProbabilityTrace, optional
        The probabilities, coarsely; None where not requested, or the classifier has none.
    ablations : dict of str to ndarray of int64, shape (n,)
        Codes that were predicted without a part: ``"unaided"``, decoded without the grammar, where
        requested; in evaluations also ``"unadapted"``, without matching the sensors.
    reliability : Reliability, optional
        Of the probabilities before they are decoded or filtered; None without a human to compare.
    """

    times: Real
    actions: tuple[str, ...]
    stages: dict[str, Codes]
    probabilities: Real | None
    seconds: dict[str, float]
    probability_trace: ProbabilityTrace | None = None
    ablations: dict[str, Codes] = field(default_factory=dict)
    reliability: Reliability | None = None

    def at(self, times: Real, steps: Whole) -> Prediction:
        """The prediction at other stamps (s), shape (m,), given the time step of each."""
        probabilities = None if self.probabilities is None else self.probabilities[steps]
        moved = replace(self, times=times, probabilities=probabilities)
        return moved._each(lambda codes: codes[steps])

    def with_actions(self, actions: tuple[str, ...]) -> Prediction:
        """The prediction in codes of other actions, which hold its own, without probabilities."""
        # One place more for UNLABELLED, which is -1 and so indexes the last one.
        table = np.array([*map(actions.index, self.actions), UNLABELLED], dtype=np.int64)
        renamed = replace(self, actions=actions, probabilities=None)
        return renamed._each(lambda codes: table[codes])

    def _each(self, change: Callable[[Codes], Codes]) -> Prediction:
        """The prediction with all codes changed alike."""
        stages = {name: change(codes) for name, codes in self.stages.items()}
        ablations = {name: change(codes) for name, codes in self.ablations.items()}
        return replace(self, stages=stages, ablations=ablations)

    @property
    def raw(self) -> Codes:
        """Codes before the filters."""
        return self.stages["raw"]

    @property
    def filtered(self) -> Codes:
        """Codes after the filters."""
        return self.stages["filtered"]

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
    grammar : TaskGrammar, optional
        Durations and order of the training tracks; None without a decoder.
    boundary_model : BoundaryModel, optional
        What tells the decoder where actions change; None where that was not learnt.
    live_models : tuple of LiveModel
        What it has learnt to follow a stream, by the time that each part looks ahead; empty where
        the classifier itself can do so.
    units : tuple of str
        Of the channels; empty where they are not known, as in files of older versions.
    dropped : tuple of DroppedSegment
        Segments that it was not trained on, as the other demonstrations contradict them. What was
        read from a file does not tell.

    Examples
    --------
    >>> recogniser = forcelab.train(labelled, settings)
    >>> prediction = recogniser.predict(project.demonstrations.load("foam 04"))
    >>> prediction.actions
    ('still', 'grab', 'hold', 'release')
    """

    settings: Settings
    rate: float
    channels: tuple[str, ...]
    actions: tuple[str, ...]
    shortest: dict[str, float]
    classifier: Any
    trained_on: tuple[str, ...] = ()
    grammar: TaskGrammar | None = None
    boundary_model: BoundaryModel | None = None
    live_models: tuple[LiveModel, ...] = ()
    units: tuple[str, ...] = ()
    dropped: tuple[DroppedSegment, ...] = ()

    def shortest_seconds(self, share: float) -> dict[int, float]:
        """A share of the shortest training segment of each code that has one, in seconds."""
        return {
            code: share * self.shortest[action]
            for code, action in enumerate(self.actions)
            if action in self.shortest
        }

    def unit_remarks(self, channels: Sequence[Channel]) -> tuple[str, ...]:
        """A remark where recorded channels have other units than those that it learnt.

        Raises
        ------
        InputError
            If it looks at a channel that is not there.
        """
        return unit_remarks(self.units, self.channels, channels)

    def rate_remarks(
        self, rate: float, come: str = "It was sampled", have: str = "this recording has"
    ) -> tuple[str, ...]:
        """A remark where samples come at too low a rate for its smallest scales or windows.

        A recording is put onto the recogniser's grid, but no interpolation brings back what lies
        above half the rate of its samples.

        Parameters
        ----------
        rate : float
            Samples a second, Hz.
        come, have : str
            What the remark says of the samples before the rate, and before "nothing".
        """
        bands = self.settings.bands(self.rate)
        unreachable = bands[bands > rate / 2]
        if rate >= (1 - SAME_RATE) * self.rate or not len(unreachable):
            return ()
        kind = "scales" if self.settings.known_features == "wavelets" else "windows"
        return (
            f"{come} at {rate:.4g} Hz, and the recogniser learnt at {self.rate:.4g} Hz: "
            f"{len(unreachable)} of its {len(bands)} {kind} look above {rate / 2:.4g} Hz, where "
            f"{have} nothing, so expect poor labels; train one with --rate {rate:.4g}.",
        )

    def prepare(self, demonstration: Demonstration) -> Examples:
        """Compute the features of a demonstration that this recogniser looks at.

        Raises
        ------
        InputError
            If the demonstration lacks a channel that the recogniser looks at.
        """
        settings = self.settings.replace(channels=self.channels)
        return prepare_examples(LabelledDemonstration(demonstration), settings, self.rate)

    def predict(
        self, demonstration: Demonstration, *, probability_trace: bool = False
    ) -> Prediction:
        """Recognise the actions of a demonstration.

        Parameters
        ----------
        demonstration : Demonstration
        probability_trace : bool
            Whether its certainty is wanted, which changes nothing else.

        Raises
        ------
        InputError
            If the demonstration lacks a channel that the recogniser looks at.
        """
        examples = self.prepare(demonstration)
        prediction = self.predict_examples(examples, probability_trace=probability_trace)
        if self.settings.step is None:
            return prediction
        return prediction.at(demonstration.times, examples.nearest(demonstration.times))

    def predict_examples(
        self, examples: Examples, *, probability_trace: bool = False, unaided: bool = False
    ) -> Prediction:
        """Recognise the actions of a demonstration whose features are there already.

        Parameters
        ----------
        examples : Examples
        probability_trace : bool
            As of :meth:`predict`.
        unaided : bool
            Whether what would be decoded without choreography is wanted, too.
        """
        if examples.channels != self.channels:
            raise InputError(
                f"'{examples.name}' has the channels {', '.join(examples.channels)}; the "
                f"recogniser was trained on {', '.join(self.channels)}."
            )
        started = perf_counter()
        raw, probabilities = self.classify(examples.features, examples.valid, probability_trace)
        changes = None
        if self.grammar is not None and self.boundary_model is not None:
            changes = self.boundary_model.ratios(examples.features)
        classified = perf_counter()
        use, apply_grammar = self.settings.choreography, None
        if self.grammar is not None and probabilities is not None:
            apply_grammar = partial(self._decode, probabilities, changes, examples)
            stages = {"raw": raw, "filtered": apply_grammar(decode, use)}
        else:
            stages = self.filter(raw, probabilities, examples.times, examples.valid)
        seconds = {"predict": classified - started, "filter": perf_counter() - classified}
        ablations = {}
        if unaided and apply_grammar is not None:
            ablations["unaided"] = apply_grammar(decode, "none")
        trace = None
        if probability_trace and probabilities is not None and examples.valid.any():
            valid = examples.valid
            refined = probabilities if apply_grammar is None else apply_grammar(marginals, use)
            trace = ProbabilityTrace.from_probabilities(
                examples.times[valid], refined[valid], self.actions
            )
        return Prediction(
            examples.times, self.actions, stages, probabilities, seconds, trace, ablations
        )

    def classify(
        self, features: Real, valid: Flags, with_probabilities: bool
    ) -> tuple[Codes, Real | None]:
        """Codes of time steps, and probabilities where something needs them or they are wanted."""
        n, classes = len(features), self.classifier.classes_
        raw = np.empty(n, dtype=np.int64)
        needed = self.settings.needs_probabilities
        # An SVM that was fitted without probabilities has none to ask for.
        available = with_probabilities and hasattr(self.classifier, "predict_proba")
        probabilities = np.zeros((n, len(self.actions))) if needed or available else None
        with one_blas_thread():
            for first in range(0, n, BLOCK):
                block = slice(first, first + BLOCK)
                if probabilities is not None:
                    proba = self.classifier.predict_proba(features[block])
                    probabilities[block, classes] = proba
                # Rounding and ties may tell the two apart: with a probability trace the
                # prediction must be the one without.
                raw[block] = (
                    classes[np.argmax(proba, axis=1)]
                    if needed
                    else self.classifier.predict(features[block])
                )
        raw[~valid] = UNLABELLED
        return raw, probabilities

    def _decode(
        self,
        probabilities: Real,
        changes: Real | None,
        examples: Examples,
        method: Callable[..., NDArray[Any]],
        use: str,
    ) -> NDArray[Any]:
        """The result of :func:`decode` or :func:`marginals`, with so much of the grammar."""
        with np.errstate(divide="ignore"):  # of a probability of nothing, minus infinity
            logs = np.log(probabilities)
        step = self.settings.hop(examples.rate) / examples.rate
        return method(logs, examples.valid, step, self.grammar, use, changes=changes)

    def filter(
        self, raw: Codes, probabilities: Real | None, times: Real, valid: Flags
    ) -> dict[str, Codes]:
        """The stages of the filters that are switched on, in the paper's order."""
        codes, settings = raw.copy(), self.settings
        stages = {"raw": raw}
        if settings.threshold is not None and probabilities is not None:
            stages["threshold"] = codes = filters.threshold(
                codes, probabilities, settings.threshold
            )
        if settings.median is not None:
            codes = filters.median(codes, settings.median)
            # A median reaches into gaps, where there is nothing to be seen.
            codes[~valid] = UNLABELLED
            stages["median"] = codes
        if settings.drop is not None:
            codes = filters.drop_short(codes, times, self.shortest_seconds(1.0), settings.drop)
        return stages | {"filtered": codes}
