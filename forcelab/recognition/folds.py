"""Folds: train on some demonstrations, recognise others; here or in several processes."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter

from forcelab.errors import InputError
from forcelab.jobs import Progress, finish
from forcelab.parallel import shared
from forcelab.recognition.examples import Examples, actions_of
from forcelab.recognition.recogniser import Prediction, Recogniser
from forcelab.recognition.reliability import Reliability
from forcelab.recognition.settings import Settings
from forcelab.recognition.training import fit_examples
from forcelab.recognition.trimming import Contradicted

__all__ = ["Fold", "FoldResult", "in_processes", "one_by_one", "parted", "recognised", "relied_on"]


@dataclass(frozen=True)
class Fold:
    """One demonstration left out, or a group of them.

    Parameters
    ----------
    train : sequence of Examples
        All the others.
    held_out : sequence of Examples
        Those that the recogniser will not have seen.
    """

    train: Sequence[Examples]
    held_out: Sequence[Examples]


@dataclass(frozen=True)
class FoldResult:
    """What came out of a fold for one of its demonstrations.

    Parameters
    ----------
    prediction : Prediction
        Of the demonstration that was left out, without probabilities but for its certainty.
    fit_seconds : float
        Run time of the fit; 0 for all but the first that was left out of it.
    reliability : Reliability, optional
        Of its probabilities, if it has any.
    left_out : tuple of Contradicted
        Segments of the others that were not trained on.
    """

    prediction: Prediction
    fit_seconds: float
    reliability: Reliability | None = None
    left_out: tuple[Contradicted, ...] = ()


def parted(examples: Sequence[Examples], parts: Sequence[Sequence[int]]) -> list[Fold]:
    """One fold for each of the :func:`~forcelab.recognition.grouping.groups`."""
    return [
        Fold(
            [example for i, example in enumerate(examples) if i not in out],
            [example for i, example in enumerate(examples) if i in out],
        )
        for out in map(set, parts)
    ]


def one_by_one(
    folds: Sequence[Fold], settings: Settings, certainty: bool
) -> Generator[Progress, None, list[list[FoldResult]]]:
    """Work off the folds here; every epoch is progress, so that stopping is heard at once."""
    results: list[list[FoldResult]] = []
    for fold in folds:
        where = f"{len(results) + 1} of {len(folds)}"
        results.append((yield from _working(fold, settings, where, certainty)))
    return results


def in_processes(
    folds: Sequence[Fold], settings: Settings, jobs: int, certainty: bool
) -> Generator[Progress, None, list[list[FoldResult]]]:
    """Work off the folds in several processes; every finished fold is progress."""
    results: list[list[FoldResult]] = []
    worked = partial(_worked, settings=settings, certainty=certainty)
    with closing(shared(worked, folds, jobs)) as coming:
        for result in coming:
            results.append(result)
            yield Progress(len(results), len(folds), "recognising")
    return results


def _working(
    fold: Fold, settings: Settings, where: str, certainty: bool
) -> Generator[Progress, None, list[FoldResult]]:
    """Train and recognise; progress says which fold it is."""
    started = perf_counter()
    try:
        recogniser = yield from fit_examples(fold.train, settings, text=f"fit {where}")
    except InputError as error:
        more = len(fold.held_out) - 1
        those = f"'{fold.held_out[0].name}'" + (f" and {more} more" if more else "")
        raise InputError(f"With {those} left out: {error}") from error
    seconds = perf_counter() - started
    results: list[FoldResult] = []
    for examples in fold.held_out:
        prediction, reliability = recognised(recogniser, examples, certainty)
        spent = 0.0 if results else seconds
        results.append(FoldResult(prediction, spent, reliability, recogniser.left_out))
    return results


def recognised(
    recogniser: Recogniser, examples: Examples, certainty: bool
) -> tuple[Prediction, Reliability | None]:
    """What a recogniser says of a demonstration that it has not seen, and how far to rely on it.

    Probabilities are left out: they would be sent between processes, and what is made of them is
    far smaller.
    """
    prediction = recogniser.predict_examples(examples, certainty=certainty, unaided=True)
    return replace(prediction, probabilities=None), relied_on(prediction, examples)


def relied_on(prediction: Prediction, examples: Examples) -> Reliability | None:
    """How far to rely on the probabilities of a prediction; None where it has none."""
    if prediction.probabilities is None:
        return None
    actions = actions_of([examples])
    human = examples.codes(actions)
    return Reliability.of(prediction.probabilities, prediction.actions, human, actions)


def _worked(fold: Fold, settings: Settings, certainty: bool) -> list[FoldResult]:
    """A fold in a process of its own, where nobody watches."""
    return finish(_working(fold, settings, "", certainty))
