"""Folds: train on some demonstrations, recognise another; here or in several processes."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter

from forcelab.errors import InputError
from forcelab.jobs import Progress, finish
from forcelab.processes import shared
from forcelab.recognition.examples import Examples, actions_of
from forcelab.recognition.recogniser import Prediction, Recogniser
from forcelab.recognition.reliability import Reliability
from forcelab.recognition.settings import Settings
from forcelab.recognition.training import fit_examples

__all__ = ["Fold", "FoldResult", "in_processes", "one_by_one", "recognised"]


@dataclass(frozen=True)
class Fold:
    """One demonstration left out.

    Parameters
    ----------
    train : sequence of Examples
        All the others.
    held_out : Examples
        The one that the recogniser will not have seen.
    """

    train: Sequence[Examples]
    held_out: Examples


@dataclass(frozen=True)
class FoldResult:
    """What came out of a fold.

    Parameters
    ----------
    prediction : Prediction
        Of the demonstration that was left out, without probabilities but for its certainty.
    fit_seconds : float
        Run time of the fit.
    reliability : Reliability, optional
        Of its probabilities, if it has any.
    """

    prediction: Prediction
    fit_seconds: float
    reliability: Reliability | None = None


def one_by_one(
    folds: Sequence[Fold], settings: Settings, certainty: bool = False
) -> Generator[Progress, None, list[FoldResult]]:
    """Work off the folds here; every epoch is progress, so that stopping is heard at once."""
    results: list[FoldResult] = []
    for fold in folds:
        where = f"{len(results) + 1} of {len(folds)}"
        results.append((yield from _working(fold, settings, where, certainty)))
    return results


def in_processes(
    folds: Sequence[Fold], settings: Settings, jobs: int, certainty: bool = False
) -> Generator[Progress, None, list[FoldResult]]:
    """Work off the folds in several processes; every finished fold is progress."""
    results: list[FoldResult] = []
    worked = partial(_worked, settings=settings, certainty=certainty)
    with closing(shared(worked, folds, jobs)) as coming:
        for result in coming:
            results.append(result)
            yield Progress(len(results), len(folds), "recognising")
    return results


def _working(
    fold: Fold, settings: Settings, where: str, certainty: bool
) -> Generator[Progress, None, FoldResult]:
    """Train and recognise; progress says which fold it is."""
    started = perf_counter()
    try:
        recogniser = yield from fit_examples(fold.train, settings, text=f"fit {where}")
    except InputError as error:
        raise InputError(f"With '{fold.held_out.name}' left out: {error}") from error
    fitted = perf_counter()
    prediction, reliability = recognised(recogniser, fold.held_out, certainty)
    return FoldResult(prediction, fitted - started, reliability)


def recognised(
    recogniser: Recogniser, examples: Examples, certainty: bool
) -> tuple[Prediction, Reliability | None]:
    """What a recogniser says of a demonstration that it has not seen, and how far to rely on it.

    Probabilities are left out: they would be sent between processes, and what is made of them is
    far smaller.
    """
    prediction = recogniser.predict_examples(examples, certainty=certainty, unaided=True)
    reliability = None
    if prediction.probabilities is not None:
        actions = actions_of([examples])
        human = examples.codes(actions)
        reliability = Reliability.of(prediction.probabilities, prediction.actions, human, actions)
    return replace(prediction, probabilities=None), reliability


def _worked(fold: Fold, settings: Settings, certainty: bool) -> FoldResult:
    """A fold in a process of its own, where nobody watches."""
    return finish(_working(fold, settings, "", certainty))
