"""Training: labelled demonstrations in, a recogniser out, with progress on the way."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from statistics import median_low

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.jobs import Progress, finish
from forcelab.labels import from_codes
from forcelab.recognition.averaged import Averaged
from forcelab.recognition.changes import fitting_changes
from forcelab.recognition.choreography import Choreography
from forcelab.recognition.classifiers import fitting
from forcelab.recognition.examples import (
    Examples,
    Labelled,
    actions_of,
    common_rate,
    prepare,
    same_channels,
)
from forcelab.recognition.learning import AVERAGED, Care, learnt_steps
from forcelab.recognition.live_part import fitting_live, needs_whole
from forcelab.recognition.recogniser import Recogniser
from forcelab.recognition.settings import Settings
from forcelab.recognition.trimming import Contradicted, trimming

__all__ = ["Epoch", "fit_examples", "fit_trimmed", "preparing", "train", "training"]


@dataclass(frozen=True, slots=True)
class Epoch(Progress):
    """One step of a fit, as told to whoever watches.

    Parameters
    ----------
    loss : float, optional
        Training loss, of classifiers that have one.
    """

    loss: float | None = None


def preparing(
    labelled: Sequence[Labelled], settings: Settings
) -> Generator[Progress, None, list[Examples]]:
    """Compute the examples of several demonstrations on one grid; returns them in order.

    Raises
    ------
    InputError
        If there is no demonstration, or their channels differ.
    """
    if not labelled:
        raise InputError("There is no demonstration to recognise; import some first.")
    rate = common_rate([item.demonstration for item in labelled], settings)
    examples = []
    for item in labelled:
        examples.append(prepare(item, settings, rate))
        yield Progress(len(examples), len(labelled), "features")
    same_channels(examples)
    return examples


def _training_set(
    examples: Sequence[Examples], actions: tuple[str, ...], settings: Settings
) -> tuple[tuple[str, ...], NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
    """Actions that there is something to learn of; rows to train on, their codes, and whose.

    An action between two strides has nothing to learn. Rows that a classifier leaves out because
    there are too many are not even gathered.
    """
    y, groups, steps = learnt_steps(
        [example.codes(actions) for example in examples],
        settings.stride,
        every=settings.classifier not in AVERAGED,
    )
    used, codes = np.unique(y, return_inverse=True)
    found = tuple(actions[code] for code in used)
    X = np.concatenate([e.features[own] for e, own in zip(examples, steps, strict=True)])
    return found, X, codes.astype(np.int64), groups


def _care(examples: Sequence[Examples], groups: NDArray[np.int64], settings: Settings) -> Care:
    """Which demonstration each training row is of, and which columns there are to choose from."""
    columns = []
    if settings.amplitude == "chosen" and settings.features == "windows":
        # In the channels' units, then in each one's own; peaks stand beside either.
        windows, peaks = _columns(settings, len(examples[0].channels))
        columns = [np.concatenate([half, peaks]) for half in np.split(windows, 2)]
    return Care(
        groups=groups,
        columns=columns,
        balanced=settings.balanced,
        calibrated=settings.calibrated,
    )


def _columns(settings: Settings, channels: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The columns of the windows, and those of peaks, of so many channels."""
    every = np.arange(settings.width(channels))
    first = settings.replace(peaks=False).width(channels)
    return every[:first], every[first:]


def _shortest(examples: Sequence[Examples], actions: tuple[str, ...]) -> dict[str, float]:
    """Duration of each action's shortest segment, in seconds, merged and cut as when scored."""
    shortest: dict[str, float] = {}
    for example in examples:
        for segment in from_codes(example.codes(actions), example.times, actions):
            known = shortest.get(segment.action, np.inf)
            shortest[segment.action] = min(known, segment.duration)
    return shortest


def fit_examples(
    examples: Sequence[Examples], settings: Settings, text: str = "fit"
) -> Generator[Progress, None, Recogniser]:
    """Trim examples as the settings say and fit a recogniser to the rest; returns it.

    Parameters
    ----------
    examples : sequence of Examples
        Of the training demonstrations.
    settings : Settings
    text : str
        What the progress says.

    Raises
    ------
    InputError
        As :func:`fit_trimmed`.
    """
    kept, left_out = yield from trimming(examples, settings)
    return (yield from fit_trimmed(kept, left_out, settings, text=text))


def fit_trimmed(
    examples: Sequence[Examples],
    left_out: tuple[Contradicted, ...],
    settings: Settings,
    trained_on: Sequence[str] = (),
    text: str = "fit",
) -> Generator[Progress, None, Recogniser]:
    """Fit a recogniser to what :func:`~forcelab.recognition.trimming.trimming` left of examples.

    Parameters
    ----------
    examples : sequence of Examples
        Of the training demonstrations; unlabelled time steps teach no action, though those between
        two actions may teach where they change (:mod:`forcelab.recognition.changes`).
    left_out : tuple of Contradicted
        What is gone, to remember.
    settings : Settings
    trained_on : sequence of str
        Ids to remember.
    text : str
        What the progress says.

    Returns
    -------
    Recogniser
        Of the actions that have at least one training sample.

    Raises
    ------
    InputError
        If fewer than two actions have a training sample.
    """
    actions, X, y, groups = _training_set(examples, actions_of(examples), settings)
    if len(actions) < 2:
        found = f"only {actions[0]}" if actions else "none of any action"
        raise InputError(
            f"Training needs samples of two actions and there is {found}, after merging, "
            f"without missing samples and with a stride of {settings.stride}; label more or "
            "change these."
        )
    changes = yield from fitting_changes(examples, settings)
    # Of every time step they are far more than the rows that are learnt from.
    none = np.empty((0, 0))
    examples = [replace(example, features=none) for example in examples]
    probabilities = settings.needs_probabilities
    care = _care(examples, groups, settings)
    for step in fitting(settings.classifier, X, y, settings.seed, probabilities, care):
        yield Epoch(step.number, step.total, text, step.loss)
    return Recogniser(
        settings=settings,
        rate=median_low(example.rate for example in examples),
        channels=examples[0].channels,
        # Of demonstrations in unlike units nothing is learnt that others could be held against.
        units=examples[0].units if len({example.units for example in examples}) == 1 else (),
        actions=actions,
        shortest=_shortest(examples, actions),
        classifier=step.classifier,
        trained_on=tuple(trained_on),
        choreography=Choreography.learn([example.segments for example in examples], actions)
        if settings.decodes
        else None,
        changes=changes,
        left_out=left_out,
    )


def training(
    labelled: Sequence[Labelled], settings: Settings
) -> Generator[Progress, None, Recogniser]:
    """Train a recogniser; a generator that yields progress and returns the recogniser.

    To stop, stop iterating: nothing is left running.

    Parameters
    ----------
    labelled : sequence of Labelled
        Training demonstrations; those without a segment take no part.
    settings : Settings

    Raises
    ------
    InputError
        If nothing is labelled, fewer than two actions are, or channels differ.
    """
    used = [item for item in labelled if item.segments]
    if not used:
        raise InputError("Nothing is labelled yet; label at least two actions first.")
    examples = yield from preparing(used, settings)
    ids = [item.demonstration.id for item in used]
    kept, left_out = yield from trimming(examples, settings)
    taught = [
        # The segments of examples are merged already.
        Labelled(item.demonstration, example.segments, apart=True)
        for item, example in zip(used, kept, strict=True)
    ]
    fit = fit_trimmed(kept, left_out, settings, ids)
    del examples, kept  # features of every time step, which the fit lets go of
    recogniser = yield from fit
    if not (needs_whole(settings) and settings.decodes):
        return recogniser
    own = _own_amplitude(recogniser)
    rate = common_rate([item.demonstration for item in used], settings)
    parts = yield from fitting_live(taught, settings, rate, recogniser.actions, own)
    return replace(recogniser, live=parts)


def _own_amplitude(recogniser: Recogniser) -> bool:
    """Whether a stream's forces are to count in units of its own amplitude.

    Where offline both units stand side by side, a stream has its own alone, by a running size: on
    the stylus recordings its probabilities then have a Brier score of 0.253, with both 0.264, with
    newtons 0.280 (50 ms ahead), and as many labels are right.
    """
    settings, classifier = recogniser.settings, recogniser.classifier
    if settings.amplitude != "chosen" or not isinstance(classifier, Averaged):
        return settings.amplitude != "absolute"
    # What was chosen on left-out demonstrations is one half of the columns; own is the second.
    windows, _ = _columns(settings, len(recogniser.channels))
    return bool(classifier.columns.min() >= len(windows) // 2)


def train(labelled: Sequence[Labelled], settings: Settings) -> Recogniser:
    """Train a recogniser, without looking at the progress.

    Parameters
    ----------
    labelled : sequence of Labelled
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
    """
    return finish(training(labelled, settings))
