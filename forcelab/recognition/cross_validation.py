"""Evaluations: each demonstration is recognised by a recogniser that has not seen it.

Demonstrations are left out in turn, offline or as a stream, or one set is trained on and another
one tested.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter

import numpy as np

from forcelab.cluster import current_cluster
from forcelab.errors import InputError
from forcelab.jobs import Progress, finish, job
from forcelab.labels import UNLABELLED, to_codes
from forcelab.parallel import run_job, share_work
from forcelab.recognition.adaptation import estimate_adaptation
from forcelab.recognition.examples import (
    Examples,
    LabelledDemonstration,
    actions_of,
    common_rate,
    prepare_examples,
)
from forcelab.recognition.groups import fold_groups
from forcelab.recognition.label_noise import DroppedSegment, dropped_remarks
from forcelab.recognition.online import LiveLabels, check_latency, recognise_with_latency
from forcelab.recognition.probabilities import Reliability
from forcelab.recognition.recogniser import Prediction, Recogniser
from forcelab.recognition.remarks import (
    added_remarks,
    bridged_remarks,
    copy_remarks,
    group_remarks,
    settings_remarks,
    trained_on_remarks,
    unlearnable_remarks,
)
from forcelab.recognition.results import Evaluation, HeldOutPrediction, empty_prediction_remarks
from forcelab.recognition.settings import Settings
from forcelab.recognition.training import Known, fit_examples, prepare_all, training_job
from forcelab.text import there_are


@dataclass(frozen=True)
class FoldResult:
    """What the recogniser of a fold predicts for the demonstrations that it has not seen."""

    predictions: list[Prediction]  # as of :func:`predict_held_out`
    fit_seconds: float
    dropped: tuple[DroppedSegment, ...]  # segments of the others that were not trained on


def split_examples(
    examples: Sequence[Examples], part: Sequence[int]
) -> tuple[list[Examples], list[Examples]]:
    """The examples to train on, and those of a group, which the recogniser will not have seen."""
    train = [example for i, example in enumerate(examples) if i not in part]
    return train, [examples[i] for i in sorted(part)]


def run_folds(
    examples: Sequence[Examples],
    parts: Sequence[Sequence[int]],
    settings: Settings,
    probability_trace: bool,
    jobs: int,
) -> Generator[Progress, None, list[FoldResult]]:
    """Leave out each group of indices in turn.

    Every epoch is progress, of several processes and of a cluster every finished fold.
    """
    results: list[FoldResult] = []
    if jobs > 1 or current_cluster() is not None:
        work = partial(
            _run_fold_in_process,
            examples=examples,
            settings=settings,
            probability_trace=probability_trace,
        )
        with closing(share_work(work, parts, jobs)) as coming:
            for result in coming:
                results.append(result)
                yield Progress(len(results), len(parts), "recognising")
        return results
    for part in parts:
        where = f"{len(results) + 1} of {len(parts)}"
        results.append((yield from _run_fold(part, examples, settings, where, probability_trace)))
    return results


def _run_fold(
    part: Sequence[int],
    examples: Sequence[Examples],
    settings: Settings,
    position: str,
    probability_trace: bool,
) -> Generator[Progress, None, FoldResult]:
    """Train on all but a group and recognise that; progress gives the position of its fold."""
    train, held_out = split_examples(examples, part)
    started = perf_counter()
    try:
        recogniser = yield from fit_examples(train, settings, text=f"fit {position}")
    except InputError as error:
        more = len(held_out) - 1
        names = f"'{held_out[0].name}'" + (f" and {more} more" if more else "")
        raise InputError(f"With {names} left out: {error}") from error
    seconds = perf_counter() - started
    predictions = [predict_held_out(recogniser, e, probability_trace) for e in held_out]
    return FoldResult(predictions, seconds, recogniser.dropped)


def predict_held_out(
    recogniser: Recogniser, examples: Examples, probability_trace: bool
) -> Prediction:
    """Recognise a demonstration that the recogniser has not seen, and compare its probabilities."""
    prediction = recogniser.predict_examples(
        examples, probability_trace=probability_trace, unaided=True
    )
    return compare_probabilities(prediction, examples)


def compare_probabilities(prediction: Prediction, examples: Examples) -> Prediction:
    """A prediction with the reliability of its probabilities in their place.

    They would be sent between processes, and what is made of them is far smaller.
    """
    if prediction.probabilities is None:
        return prediction
    actions = actions_of([examples])
    reliability = Reliability.from_predictions(
        prediction.probabilities, prediction.actions, examples.codes(actions), actions
    )
    return replace(prediction, probabilities=None, reliability=reliability)


def _run_fold_in_process(
    part: Sequence[int], examples: Sequence[Examples], settings: Settings, probability_trace: bool
) -> FoldResult:
    """Run a fold in a worker process, without progress."""
    return finish(_run_fold(part, examples, settings, "", probability_trace))


def select_labelled(
    labelled: Sequence[LabelledDemonstration],
) -> tuple[list[LabelledDemonstration], tuple[str, ...]]:
    """The own demonstrations that have a segment, and a remark on those that have none."""
    own = [item for item in labelled if not item.added]
    used = [item for item in own if item.segments]
    without = len(own) - len(used)
    if not without:
        return used, ()
    what = (
        "demonstration without labels was" if without == 1 else "demonstrations without labels were"
    )
    return used, (f"{without} {what} left out.",)


EvaluationJob = Generator[Progress, None, Evaluation]


@job
def leave_one_out_job(
    labelled: Sequence[LabelledDemonstration],
    settings: Settings,
    title: str = "",
    jobs: int = 1,
    *,
    probability_trace: bool = False,
    folds: int | None = None,
    known: Known | None = None,
) -> EvaluationJob:
    """Recognise each demonstration by a recogniser trained on all the others.

    Of many demonstrations that takes long: each fit takes longer, and there are more of them. Left
    out in groups, each is still recognised by a recogniser that has not seen it.

    Parameters
    ----------
    labelled : sequence of LabelledDemonstration
        Demonstrations without a segment take no part, which a remark says. Those of another coder
        that are added are always trained on and never left out; then what the others alone teach is
        kept beside.
    settings : Settings
    title : str
    jobs : int
        Processes that share the folds; the result is the same for any number.
    probability_trace : bool
        Whether to keep how certain each prediction is, for a review; nothing else changes.
    folds : int, optional
        How many groups are left out in turn; by default each demonstration by itself.
    known : dict, optional
        Examples with these settings that another fit has computed or will need, which are taken
        from there and put there.

    Yields
    ------
    Progress

    Returns
    -------
    Evaluation

    Raises
    ------
    InputError
        If fewer than two recordings are labelled, they do not fit together, or there is a single
        group.

    Examples
    --------
    >>> evaluation = forcelab.finish(forcelab.leave_one_out_job(labelled, settings, "foam"))
    >>> evaluation.scores("filtered")[0].accuracy > 0.6
    True
    """
    used, parts, remarks = plan_folds(labelled, folds)
    started = perf_counter()
    added = [item for item in labelled if item.added and item.segments]
    examples = yield from prepare_all([*used, *added], settings, known=known)
    prepared = perf_counter()
    actions = actions_of(examples)
    jobs = min(jobs, len(parts))
    # Groups are interleaved; what was found goes back to the order of the demonstrations.
    order = np.argsort(np.concatenate(parts))

    def held_out(results: Sequence[FoldResult]) -> list[HeldOutPrediction]:
        predictions = [prediction for result in results for prediction in result.predictions]
        return [
            held_out_prediction(used[i], examples[i], predictions[place], actions)
            for i, place in enumerate(order)
        ]

    results = yield from run_folds(examples, parts, settings, probability_trace, jobs)
    tested = held_out(results)
    if added:
        own = examples[: len(used)]
        alone = held_out((yield from run_folds(own, parts, settings, False, jobs)))
        tested = [
            replace(both, ablations=both.ablations | {"alone": own.filtered})
            for both, own in zip(tested, alone, strict=True)
        ]
    return Evaluation(
        title=title,
        settings=settings,
        actions=actions,
        tested=tuple(tested),
        rate=examples[0].rate,
        channels=examples[0].channels,
        trained_on=tuple(item.demonstration.id for item in [*used, *added]),
        seconds=_run_times(prepared - started, sum(r.fit_seconds for r in results), tested),
        remarks=(
            *remarks,
            *added_remarks(tested, added),
            *unlearnable_remarks(examples, parts),
            *dropped_remarks([segment for result in results for segment in result.dropped]),
            *settings_remarks([*used, *added], examples[0].rate, settings),
            *bridged_remarks(examples[: len(used)], settings),
            *empty_prediction_remarks(tested, settings, examples[0].rate),
        ),
    )


def plan_folds(
    labelled: Sequence[LabelledDemonstration], folds: int | None = None
) -> tuple[list[LabelledDemonstration], list[list[int]], tuple[str, ...]]:
    """The labelled demonstrations, the groups of indices to leave out in turn, and remarks.

    An InputError says that fewer than two recordings are labelled, a demonstration occurs twice, or
    there is a single group.
    """
    used, remarks = select_labelled(labelled)
    if len(used) < 2:
        raise InputError(
            f"Leaving one demonstration out needs two labelled ones; {there_are(len(used))}."
        )
    ids = [item.demonstration.id for item in used]
    for item in used:
        if ids.count(item.demonstration.id) > 1:
            raise InputError(
                f"'{item.demonstration.name}' is there twice, so that its twin would be trained on "
                f"while it is left out; name each demonstration once."
            )
    parts = fold_groups([item.demonstration for item in used], folds)
    if len(parts) < 2:
        raise InputError(
            f"All {len(used)} labelled demonstrations hold the same recording, so that nothing "
            f"else is left to train on; label another recording."
        )
    return used, parts, (*remarks, *group_remarks(parts), *copy_remarks(used, parts))


def _run_times(features: float, fit: float, tested: Sequence[Prediction]) -> dict[str, float]:
    """Seconds of each step, those of recognising summed over what was tested."""
    spent = {"features": features, "fit": fit}
    for step in ("predict", "filter"):
        spent[step] = sum(prediction.seconds.get(step, 0.0) for prediction in tested)
    return spent


def held_out_prediction(
    item: LabelledDemonstration,
    examples: Examples,
    prediction: Prediction,
    actions: tuple[str, ...],
) -> HeldOutPrediction:
    """A prediction in codes of the evaluation's actions, at the demonstration's own stamps."""
    stamps = item.demonstration.times
    nearest = examples.nearest(stamps)
    human = to_codes(examples.segments, stamps, actions)
    human[~examples.valid[nearest]] = UNLABELLED
    found = prediction.with_actions(actions).at(stamps, nearest)
    return HeldOutPrediction(**vars(found), demonstration=item.demonstration, human=human)


@job
def train_and_test_job(
    train: Sequence[LabelledDemonstration],
    test: Sequence[LabelledDemonstration],
    settings: Settings,
    title: str = "",
    *,
    probability_trace: bool = False,
    adapt: bool = False,
    known: Known | None = None,
) -> EvaluationJob:
    """Train on all demonstrations of one task and recognise those of another.

    Parameters
    ----------
    train, test : sequence of LabelledDemonstration
        Demonstrations without a segment take no part, which a remark says.
    settings : Settings
    title : str
    probability_trace, known
        As of :func:`leave_one_out_job`.
    adapt : bool
        Whether offsets, scales and places of the sensors are matched to the training
        demonstrations before, as :mod:`forcelab.recognition.adaptation` does; what is recognised
        without is kept beside.

    Yields
    ------
    Progress

    Returns
    -------
    Evaluation
        Of the test demonstrations. Their samples of actions that were never trained count as
        wrong; a remark names those actions, another one what was adapted.

    Raises
    ------
    InputError
        If either side has no labels, the two share a demonstration or have different channels.

    Examples
    --------
    >>> job = forcelab.train_and_test_job(labelled[:2], labelled[2:3], settings)
    >>> [item.name for item in forcelab.finish(job).tested]
    ['foam 03']
    """
    train_items, train_remarks = select_labelled(train)
    tested_items, test_remarks = select_labelled(test)
    if not train_items or not tested_items:
        side = "train on" if not train_items else "test on"
        raise InputError(f"There is no labelled demonstration to {side}; label one first.")
    ids = tuple(item.demonstration.id for item in train_items)
    for item in tested_items:
        if item.demonstration.id in ids:
            raise InputError(
                f"'{item.demonstration.name}' is trained on and so cannot be tested; choose "
                f"different tasks, or leave one demonstration out."
            )
    started = perf_counter()
    # What is tested must not move the grid.
    rate = common_rate([item.demonstration for item in train_items], settings)
    grid_settings = settings.replace(rate=rate)
    examples = yield from prepare_all([*train_items, *tested_items], grid_settings, known=known)
    matched = estimate_adaptation(train_items, tested_items) if adapt else None
    prepared = perf_counter()
    train_examples, test_examples = examples[: len(train_items)], examples[len(train_items) :]
    recogniser = yield from run_job(fit_examples, train_examples, settings)
    fitted = perf_counter()
    actions = actions_of(examples)
    tested = []
    for i, (item, example) in enumerate(zip(tested_items, test_examples, strict=True)):
        unadapted = {}
        if matched is not None:
            unadapted["unadapted"] = recogniser.predict_examples(example).filtered
            example = prepare_examples(matched.apply(item), grid_settings)  # noqa: PLW2901
        prediction = predict_held_out(recogniser, example, probability_trace)
        prediction = replace(prediction, ablations=prediction.ablations | unadapted)
        tested.append(held_out_prediction(item, example, prediction, actions))
        yield Progress(i + 1, len(tested_items), "recognising")
    remarks = train_remarks + tuple(r for r in test_remarks if r not in train_remarks)
    if matched is not None:
        remarks += (matched.summary,)
    untrained = [action for action in actions_of(test_examples) if action not in recogniser.actions]
    if untrained:
        remarks += (f"Tested but never trained: {', '.join(untrained)}.",)
    return Evaluation(
        title=title,
        settings=settings,
        actions=actions,
        tested=tuple(tested),
        rate=recogniser.rate,
        channels=recogniser.channels,
        trained_on=ids,
        seconds=_run_times(prepared - started, fitted - prepared, tested),
        remarks=remarks
        + trained_on_remarks(train_items, tested_items)
        + dropped_remarks(recogniser.dropped)
        + settings_remarks([*train_items, *tested_items], recogniser.rate, settings)
        + bridged_remarks(examples[len(train_items) :], settings)
        + empty_prediction_remarks(tested, settings, recogniser.rate),
    )


@job
def leave_one_out_live_job(
    labelled: Sequence[LabelledDemonstration],
    settings: Settings,
    latency: float,
    title: str = "",
    folds: int | None = None,
) -> EvaluationJob:
    """:func:`leave_one_out_job` on streams, with `latency` seconds from a force to its label.

    The evaluation's raw predictions are the filtered ones. An InputError says, besides, that a
    recogniser with these settings cannot follow a stream.
    """
    check_latency(latency)
    used, parts, remarks = plan_folds(labelled, folds)
    rate = common_rate([item.demonstration for item in used], settings)
    fixed = settings.replace(rate=rate)
    merged = [item.merged(settings.merge) for item in used]
    actions = tuple(dict.fromkeys(s.action for item in merged for s in item.segments))
    fit_seconds = 0.0
    tested: dict[int, HeldOutPrediction] = {}
    left_out: list[DroppedSegment] = []
    for part in parts:
        started = perf_counter()
        others = [item for i, item in enumerate(used) if i not in part]
        recogniser = yield from run_job(training_job, others, fixed)
        left_out.extend(recogniser.dropped)
        fit_seconds += perf_counter() - started
        for i in part:
            started = perf_counter()
            decided = recognise_with_latency(recogniser, used[i].demonstration, latency)
            seconds = {"predict": perf_counter() - started}
            examples = _live_examples(merged[i], recogniser, decided)
            stages = {"raw": decided.codes, "filtered": decided.codes}
            prediction = Prediction(
                decided.times, recogniser.actions, stages, decided.probabilities, seconds
            )
            # Gaps, which have no probabilities, do not count.
            prediction = compare_probabilities(prediction, examples)
            tested[i] = held_out_prediction(used[i], examples, prediction, actions)
    return Evaluation(
        title=title,
        settings=settings,
        actions=actions,
        tested=tuple(tested[i] for i in range(len(used))),
        rate=recogniser.rate,
        channels=recogniser.channels,
        trained_on=tuple(item.demonstration.id for item in used),
        seconds=_run_times(0.0, fit_seconds, [*tested.values()]),
        remarks=(
            f"Recognised as a stream, each label {1000 * latency:g} ms after its force.",
            *remarks,
            *dropped_remarks(left_out),
            *settings_remarks(used, recogniser.rate, settings),
            *empty_prediction_remarks(list(tested.values()), settings, recogniser.rate),
        ),
    )


def _live_examples(
    item: LabelledDemonstration, recogniser: Recogniser, live_labels: LiveLabels
) -> Examples:
    """The steps of a stream with the human's labels, without features."""
    n = len(live_labels)
    probabilities = live_labels.probabilities
    valid = (
        np.ones(n, dtype=bool) if probabilities is None else np.asarray(probabilities.any(axis=1))
    )
    return Examples(
        name=item.demonstration.name,
        times=live_labels.times,
        features=np.empty((n, 0)),
        valid=valid,
        segments=item.segments,
        channels=recogniser.channels,
        rate=recogniser.rate,
    )
