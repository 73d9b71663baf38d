"""Evaluation: how well a recogniser does on demonstrations it has never seen."""

from __future__ import annotations

import warnings
from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.jobs import Progress, finish
from forcelab.labels import UNLABELLED, Segment, Segments, from_codes
from forcelab.recognition.examples import Examples, Labelled, actions_of, common_rate
from forcelab.recognition.metrics import Counts, Scores, count, pool
from forcelab.recognition.recogniser import Prediction
from forcelab.recognition.settings import Settings
from forcelab.recognition.training import fit_examples, preparing
from forcelab.versions import versions

__all__ = ["Evaluation", "Tested", "across", "kept_apart", "leave_one_out"]


@dataclass(frozen=True)
class Tested:
    """One demonstration, recognised by a recogniser that has not seen it.

    Parameters
    ----------
    name, id : str
        Of the demonstration.
    times : ndarray of float64, shape (n,)
        Seconds.
    actions : tuple of str
        The evaluation's; codes index it.
    human, raw, filtered : ndarray of int64, shape (n,)
        Codes by the human, by the classifier, and by the classifier after the filters.
    """

    name: str
    id: str
    times: NDArray[np.float64]
    actions: tuple[str, ...]
    human: NDArray[np.int64]
    raw: NDArray[np.int64]
    filtered: NDArray[np.int64]

    @property
    def start(self) -> float:
        """Time of the first sample, in seconds."""
        return float(self.times[0])

    @property
    def end(self) -> float:
        """Time at which the last sample ends, in seconds."""
        return float(self.times[-1] + np.median(np.diff(self.times)))

    def segments(self, which: str) -> Segments:
        """Segments of ``"human"``, ``"raw"`` or ``"filtered"``."""
        return from_codes(getattr(self, which), self.times, self.actions)

    def counts(self, which: str) -> Counts:
        """Compare ``"raw"`` or ``"filtered"`` with the human."""
        return count(self.human, getattr(self, which), self.times, self.actions)


@dataclass(frozen=True)
class Evaluation:
    """An evaluation and everything needed to repeat it.

    Parameters
    ----------
    title : str
        What was evaluated, such as ``"stylus"`` or ``"trained on LEGO, tested on cartridge"``.
    settings : Settings
    actions : tuple of str
        All actions in the order of their first occurrence.
    tested : tuple of Tested
        In the order of the demonstrations.
    trained_on : tuple of str
        Ids of the demonstrations that were trained on; leaving one out, all but the tested one.
    seconds : dict of str to float
        Run time of ``features``, ``fit``, ``predict`` and ``filter``, each summed over folds.
    remarks : tuple of str
        What was left out, a sentence each.
    """

    title: str
    settings: Settings
    actions: tuple[str, ...]
    tested: tuple[Tested, ...]
    trained_on: tuple[str, ...]
    seconds: dict[str, float]
    remarks: tuple[str, ...] = ()

    def scores(self, which: str) -> tuple[Scores, list[Scores]]:
        """Pooled scores, and each demonstration's, of ``"raw"`` or ``"filtered"``."""
        counts = [item.counts(which) for item in self.tested]
        single = [pool(item.name, [part]) for item, part in zip(self.tested, counts, strict=True)]
        return pool("pooled", counts), single

    def to_json(self) -> dict[str, Any]:
        """Settings, seed, versions, labels, run times and all scores, as plain values."""
        result: dict[str, Any] = {
            "title": self.title,
            "preset": self.settings.preset,
            "settings": self.settings.to_json(),
            "seed": self.settings.seed,
            "versions": versions(),
            "labels": list(self.actions),
            "seconds": dict(self.seconds),
            "tested": [item.id for item in self.tested],
            "trained_on": list(self.trained_on),
            "remarks": list(self.remarks),
        }
        for which in ("raw", "filtered"):
            pooled, single = self.scores(which)
            result[which] = {
                "pooled": pooled.to_json(),
                "demonstrations": [scores.to_json() for scores in single],
            }
        return result


Job = Generator[Progress, None, Evaluation]


def kept_apart(labelled: Sequence[Labelled], suffixes: Sequence[str]) -> list[Labelled]:
    """Give each demonstration's actions a suffix, so that ``grab`` of two tasks stays two actions.

    Parameters
    ----------
    labelled : sequence of Labelled
    suffixes : sequence of str
        One for each demonstration, usually its task: ``grab`` becomes ``grab_foam``.
    """
    return [
        Labelled(
            item.demonstration,
            tuple(Segment(s.start, s.end, f"{s.action}_{suffix}") for s in item.segments),
        )
        for item, suffix in zip(labelled, suffixes, strict=True)
    ]


def leave_one_out(
    labelled: Sequence[Labelled], settings: Settings, title: str = "", jobs: int = 1
) -> Job:
    """Recognise each demonstration by a recogniser trained on all the others.

    Parameters
    ----------
    labelled : sequence of Labelled
        Demonstrations without a segment take no part, which a remark says.
    settings : Settings
    title : str
    jobs : int
        Processes that share the folds; the result is the same for any number.

    Yields
    ------
    Progress

    Returns
    -------
    Evaluation

    Raises
    ------
    InputError
        If fewer than two demonstrations are labelled, or they do not fit together.
    """
    used, remarks = _with_labels(labelled)
    if len(used) < 2:
        raise InputError(
            f"Leaving one demonstration out needs two labelled ones; there "
            f"{'is' if len(used) == 1 else 'are'} {len(used) or 'none'}."
        )
    started = perf_counter()
    examples = yield from preparing(used, settings)
    seconds = {"features": perf_counter() - started, "fit": 0.0, "predict": 0.0, "filter": 0.0}
    actions = actions_of(examples)
    folds = [(examples[:i] + examples[i + 1 :], examples[i]) for i in range(len(examples))]
    jobs = min(jobs, len(folds))
    results = yield from (_one_by_one if jobs <= 1 else _in_processes)(folds, settings, jobs)
    for fit_seconds, prediction in results:
        seconds["fit"] += fit_seconds
        for stage, spent in prediction.seconds.items():
            seconds[stage] += spent
    tested = [
        _tested(item, example, prediction, actions)
        for item, example, (_, prediction) in zip(used, examples, results, strict=True)
    ]
    ids = tuple(item.id for item in tested)
    return Evaluation(title, settings, actions, tuple(tested), ids, seconds, remarks)


def across(
    train: Sequence[Labelled], test: Sequence[Labelled], settings: Settings, title: str = ""
) -> Job:
    """Train on all demonstrations of one task and recognise those of another.

    Parameters
    ----------
    train, test : sequence of Labelled
        Demonstrations without a segment take no part, which a remark says.
    settings : Settings
    title : str

    Yields
    ------
    Progress

    Returns
    -------
    Evaluation
        Of the test demonstrations. Their samples of actions that were never trained count as
        wrong; a remark names those actions.

    Raises
    ------
    InputError
        If either side has no labels, the two share a demonstration or have different channels.
    """
    learnt, train_remarks = _with_labels(train)
    asked, test_remarks = _with_labels(test)
    if not learnt or not asked:
        side = "train on" if not learnt else "test on"
        raise InputError(f"There is no labelled demonstration to {side}; label one first.")
    ids = tuple(item.demonstration.id for item in learnt)
    for item in asked:
        if item.demonstration.id in ids:
            raise InputError(
                f"'{item.demonstration.name}' is trained on and so cannot be tested; choose "
                f"different tasks, or leave one demonstration out."
            )
    started = perf_counter()
    # What is tested must not move the grid.
    rate = common_rate([item.demonstration for item in learnt], settings)
    examples = yield from preparing([*learnt, *asked], settings.replace(rate=rate))
    prepared = perf_counter()
    known, new = examples[: len(learnt)], examples[len(learnt) :]
    recogniser = yield from fit_examples(known, settings)
    seconds = {"features": prepared - started, "fit": perf_counter() - prepared}
    seconds.update(predict=0.0, filter=0.0)
    actions = actions_of(examples)
    tested = []
    for i, (item, example) in enumerate(zip(asked, new, strict=True)):
        prediction = recogniser.predict_examples(example)
        for stage, spent in prediction.seconds.items():
            seconds[stage] += spent
        tested.append(_tested(item, example, prediction, actions))
        yield Progress(i + 1, len(asked), "recognising")
    remarks = train_remarks + tuple(r for r in test_remarks if r not in train_remarks)
    untrained = [action for action in actions_of(new) if action not in recogniser.actions]
    if untrained:
        remarks += (f"Tested but never trained: {', '.join(untrained)}.",)
    return Evaluation(title, settings, actions, tuple(tested), ids, seconds, remarks)


def _with_labels(labelled: Sequence[Labelled]) -> tuple[list[Labelled], tuple[str, ...]]:
    """The demonstrations that have a segment, and a remark on those that have none."""
    used = [item for item in labelled if item.segments]
    without = len(labelled) - len(used)
    if not without:
        return used, ()
    what = (
        "demonstration without labels was" if without == 1 else "demonstrations without labels were"
    )
    return used, (f"{without} {what} left out.",)


def _tested(
    item: Labelled, examples: Examples, prediction: Prediction, actions: tuple[str, ...]
) -> Tested:
    """Bring a prediction's codes to the evaluation's actions."""
    number = [actions.index(action) for action in prediction.actions]
    # One place more for UNLABELLED, which is -1 and so indexes the last one.
    table = np.array([*number, UNLABELLED], dtype=np.int64)
    return Tested(
        name=item.demonstration.name,
        id=item.demonstration.id,
        times=examples.times,
        actions=actions,
        human=examples.codes(actions),
        raw=table[prediction.raw],
        filtered=table[prediction.filtered],
    )


Fold = tuple[Sequence[Examples], Examples]
FoldResult = tuple[float, Prediction]


def _fold(
    train: Sequence[Examples], held_out: Examples, settings: Settings
) -> Generator[Progress, None, FoldResult]:
    """Train on some demonstrations and recognise another; gives the seconds of the fit as well."""
    started = perf_counter()
    recogniser = yield from fit_examples(train, settings)
    fitted = perf_counter()
    prediction = recogniser.predict_examples(held_out)
    # Probabilities are not needed any more and would be sent between processes.
    return fitted - started, replace(prediction, probabilities=None)


def _finished_fold(*fold: Any) -> FoldResult:
    """A fold in a process of its own, where nobody watches."""
    return finish(_fold(*fold))


def _one_by_one(
    folds: Sequence[Fold], settings: Settings, _jobs: int
) -> Generator[Progress, None, list[FoldResult]]:
    """Work off the folds here; every epoch is progress, so that stopping is heard at once."""
    results = []
    for train, held_out in folds:
        results.append((yield from _fold(train, held_out, settings)))
        yield Progress(len(results), len(folds), "recognising")
    return results


def _in_processes(
    folds: Sequence[Fold], settings: Settings, jobs: int
) -> Generator[Progress, None, list[FoldResult]]:
    """Work off the folds in several processes; the results are in order."""
    from joblib import Parallel, delayed

    work = (delayed(_finished_fold)(train, held_out, settings) for train, held_out in folds)
    coming = Parallel(n_jobs=jobs, return_as="generator")(work)
    results = []
    try:
        for result in coming:
            results.append(result)
            yield Progress(len(results), len(folds), "recognising")
    finally:
        with warnings.catch_warnings():
            # joblib finds it worth a warning that somebody stops early.
            warnings.simplefilter("ignore", UserWarning)
            coming.close()
    return results
