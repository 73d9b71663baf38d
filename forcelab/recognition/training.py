"""Training: labelled demonstrations in, a recogniser out, with progress on the way."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import replace
from statistics import median_low
from typing import Any

import numpy as np

from forcelab.errors import InputError
from forcelab.jobs import Progress, finish
from forcelab.labels import from_codes, to_codes
from forcelab.recognition.classifiers import fit_classifier
from forcelab.recognition.ensemble import FitOptions, FitProgress, training_steps
from forcelab.recognition.examples import (
    Examples,
    LabelledDemonstration,
    actions_of,
    common_channels,
    common_rate,
    gather_features,
    prepare_examples,
)
from forcelab.recognition.label_noise import DroppedSegment, drop_contradicted
from forcelab.recognition.live_model import fit_live_models, needs_live_model
from forcelab.recognition.recogniser import Recogniser
from forcelab.recognition.settings import Settings
from forcelab.recognition.task_grammar import TaskGrammar, boundary_steps, fit_boundary_model

#: Bytes of features that a training keeps: 18 minutes of the preset `best`. To make them anew
#: whenever they are looked at takes a tenth of its time.
ROOM = 64e6


#: Examples of demonstrations of one project with the same settings, by what they are made of and
#: the rate in Hz.
Known = dict[tuple[LabelledDemonstration, float], Examples]
#: Raises an InputError where a recogniser cannot be kept.
Check = Callable[[Recogniser], object]


def prepare_all(
    labelled: Sequence[LabelledDemonstration],
    settings: Settings,
    room: float = math.inf,
    known: Known | None = None,
) -> Generator[Progress, None, list[Examples]]:
    """Compute the examples of several demonstrations on one grid.

    Those that are `known` are taken from there, the others put there. Once features take `room`
    bytes, those of the others are not kept
    (:class:`~forcelab.recognition.examples.LazyExamples`). An InputError says that there is no
    demonstration, or channels differ.
    """
    if not labelled:
        raise InputError("There is no demonstration to recognise; import some first.")
    rate = _own_rate(labelled, settings)
    examples: list[Examples] = []
    used_bytes = 0
    for item in labelled:
        example = None if known is None else known.get((item, rate))
        if example is None:
            fits_room = used_bytes < room
            example = prepare_examples(item, settings, rate, kept=fits_room)
            used_bytes += example.features.nbytes if fits_room else 0
            if known is not None:
                known[item, rate] = example
        examples.append(example)
        yield Progress(len(examples), len(labelled), "features")
    common_channels(examples)
    return examples


def _own_rate(labelled: Sequence[LabelledDemonstration], settings: Settings) -> float:
    """The common rate (Hz) of the coder's own demonstrations, which others must not move."""
    own = [item.demonstration for item in labelled if not item.added]
    return common_rate(own or [item.demonstration for item in labelled], settings)


def _shortest(examples: Sequence[Examples], actions: tuple[str, ...]) -> dict[str, float]:
    """Duration of each action's shortest segment, in seconds, merged; a gap cuts none in two."""
    shortest: dict[str, float] = {}
    for example in examples:
        segments = [segment for segment in example.segments if segment.action in actions]
        codes = to_codes(segments, example.times, actions)
        for segment in from_codes(codes, example.times, actions):
            least = shortest.get(segment.action, np.inf)
            shortest[segment.action] = min(least, segment.duration)
    return shortest


def fit_examples(
    examples: Sequence[Examples], settings: Settings, text: str = "fit"
) -> Generator[Progress, None, Recogniser]:
    """Drop contradicted segments as the settings say and fit a recogniser to the rest."""
    cleaned, dropped = yield from clean_examples(examples, settings)
    return (yield from fit_cleaned(cleaned, dropped, settings, text=text))


def clean_examples(
    examples: Sequence[Examples], settings: Settings
) -> Generator[Progress, None, tuple[list[Examples], tuple[DroppedSegment, ...]]]:
    """Examples without contradicted segments, and these: each coder is judged by their own."""
    cleaned: list[Examples] = []
    dropped: tuple[DroppedSegment, ...] = ()
    for added in (False, True):
        coders = [example for example in examples if example.added is added]
        if coders:
            left, gone = yield from drop_contradicted(coders, settings)
            cleaned += left
            dropped += gone
    return cleaned, dropped


def fit_cleaned(
    examples: Sequence[Examples],
    left_out: tuple[DroppedSegment, ...],
    settings: Settings,
    trained_on: Sequence[str] = (),
    text: str = "fit",
    check: Check | None = None,
) -> Generator[Progress, None, Recogniser]:
    """Fit a recogniser to examples without their dropped segments.

    Unlabelled time steps teach no action, though those between two actions may teach where they
    change (:mod:`forcelab.recognition.task_grammar`). The recogniser knows the actions that have at
    least one training sample; an InputError where these are fewer than two. `check` raises one
    where the recogniser cannot be kept, once there is a first one.
    """
    all_actions = actions_of(examples)
    stride = settings.training_stride(examples[0].rate)
    codes, groups, steps = training_steps(
        [example.codes(all_actions) for example in examples],
        stride,
        complete=not settings.standardises,
    )
    used, y = np.unique(codes, return_inverse=True)
    # An action between two strides has nothing to learn.
    actions = tuple(all_actions[code] for code in used)
    if len(actions) < 2:
        available = f"only {actions[0]}" if actions else "none of any action"
        raise InputError(
            f"Training needs samples of two actions and there is {available}, after merging, "
            f"without missing samples and with a stride of {stride}; label more or "
            "change these."
        )
    near, near_steps = boundary_steps(examples, settings)
    X, of_changes = yield from gather_features(examples, steps, near_steps)
    spacing = stride * settings.hop(examples[0].rate) / examples[0].rate
    boundary_model = yield from fit_boundary_model(of_changes, near, spacing, settings.seed)
    del of_changes  # before the classifier takes as much
    recogniser = Recogniser(
        settings=settings,
        rate=median_low(example.rate for example in examples),
        channels=examples[0].channels,
        # Of demonstrations in unlike units nothing is learnt that others could be held against.
        units=examples[0].units if len({example.units for example in examples}) == 1 else (),
        actions=actions,
        shortest=_shortest(examples, actions),
        classifier=None,
        trained_on=tuple(trained_on),
        grammar=TaskGrammar.learn([example.segments for example in examples], actions)
        if settings.decodes
        else None,
        boundary_model=boundary_model,
        dropped=left_out,
    )

    def check_classifier(classifier: Any) -> None:
        if check is not None:
            check(replace(recogniser, classifier=classifier))

    probabilities = settings.needs_probabilities
    options = FitOptions(
        groups,
        balanced=settings.balanced,
        calibrated=settings.calibrated,
        standardised=settings.standardises,
        check=check_classifier,
    )
    for step in fit_classifier(settings.classifier, X, y, settings.seed, probabilities, options):
        yield FitProgress(step.done, step.total, text, step.loss)
    check_classifier(step.classifier)
    return replace(recogniser, classifier=step.classifier)


def training_job(
    labelled: Sequence[LabelledDemonstration],
    settings: Settings,
    known: Known | None = None,
    check: Check | None = None,
) -> Generator[Progress, None, Recogniser]:
    """Train a recogniser; a generator of progress that stops where one stops iterating.

    `known` is as of :func:`prepare_all`, `check` as of :func:`fit_cleaned`. An InputError says that
    nothing is labelled, fewer than two actions are, or channels differ.
    """
    used = sorted((item for item in labelled if item.segments), key=lambda item: item.added)
    if not used:
        raise InputError("Nothing is labelled yet; label at least two actions first.")
    examples = yield from prepare_all(used, settings, ROOM, known)
    ids = [item.demonstration.id for item in used]
    cleaned, dropped = yield from clean_examples(examples, settings)
    live_training = [
        # The segments of examples are merged already.
        replace(item, segments=example.segments, apart=True)
        for item, example in zip(used, cleaned, strict=True)
    ]
    recogniser = yield from fit_cleaned(cleaned, dropped, settings, ids, check=check)
    if not (needs_live_model(settings) and settings.decodes):
        return recogniser
    # Where offline both units stand side by side, a stream has its own alone, by a running size: on
    # the stylus recordings its probabilities then have a Brier score of 0.253, with both 0.264,
    # with newtons 0.280 (50 ms ahead), and as many labels are right.
    own_units = settings.amplitude != "absolute"
    rate = _own_rate(used, settings)
    parts = yield from fit_live_models(live_training, settings, rate, recogniser.actions, own_units)
    return replace(recogniser, live_models=parts)


def train(labelled: Sequence[LabelledDemonstration], settings: Settings) -> Recogniser:
    """Train a recogniser, without looking at the progress.

    Parameters
    ----------
    labelled : sequence of LabelledDemonstration
        Those without a segment are passed over.
    settings : Settings
        Such as ``preset("best")``.

    Returns
    -------
    Recogniser
        Its ``predict(demonstration)`` gives the actions of another one.

    Raises
    ------
    InputError
        If there is too little to train on.

    Examples
    --------
    >>> forcelab.train(labelled, settings).actions
    ('still', 'grab', 'hold', 'release')
    """
    return finish(training_job(labelled, settings))
