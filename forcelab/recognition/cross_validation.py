"""How well a recogniser does on demonstrations that are left out in turn, or chosen."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial, reduce
from operator import add
from time import perf_counter

import numpy as np

from forcelab.errors import InputError
from forcelab.jobs import Progress, finish
from forcelab.labels import UNLABELLED, to_codes
from forcelab.parallel import map_in_processes
from forcelab.recognition.adaptation import matching
from forcelab.recognition.calibration import Reliability
from forcelab.recognition.examples import Examples, Labelled, actions_of, common_rate, prepare
from forcelab.recognition.groups import groups, twins
from forcelab.recognition.label_noise import Contradicted, remark_on
from forcelab.recognition.live import Decided, check_latency, with_latency
from forcelab.recognition.recogniser import Prediction, Recogniser
from forcelab.recognition.results import Evaluation, Tested, silence_remark
from forcelab.recognition.settings import Settings
from forcelab.recognition.training import fit_examples, preparing, training
from forcelab.text import there_are


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
    """One fold for each of the :func:`~forcelab.recognition.groups.groups`."""
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
    with closing(map_in_processes(worked, folds, jobs)) as coming:
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


def with_labels(labelled: Sequence[Labelled]) -> tuple[list[Labelled], tuple[str, ...]]:
    """The demonstrations that have a segment, and a remark on those that have none."""
    used = [item for item in labelled if item.segments]
    without = len(labelled) - len(used)
    if not without:
        return used, ()
    what = (
        "demonstration without labels was" if without == 1 else "demonstrations without labels were"
    )
    return used, (f"{without} {what} left out.",)


def twin_remarks(labelled: Sequence[Labelled]) -> tuple[str, ...]:
    """A remark on recordings that are there twice."""
    names = [item.demonstration.name for item in labelled]
    return tuple(
        f"{' and '.join(names[i] for i in same)} hold the same recording, so that they were left "
        f"out together; remove all but one."
        for same in twins([item.demonstration for item in labelled])
        if len(same) > 1
    )


def group_remarks(parts: Sequence[Sequence[int]]) -> tuple[str, ...]:
    """A remark on demonstrations that were left out together."""
    most = max(map(len, parts))
    return (f"Left out in {len(parts)} groups of up to {most}.",) if most > 1 else ()


def lonely_remark(examples: Sequence[Examples], parts: Sequence[Sequence[int]]) -> tuple[str, ...]:
    """A remark on actions of a single demonstration or group, which no other can teach."""
    homes: dict[str, dict[int, str]] = {}  # by action, the first demonstration of each group
    for number, group in enumerate(parts):
        for i in group:
            for action in actions_of([examples[i]]):
                homes.setdefault(action, {}).setdefault(number, examples[i].name)
    lonely = {action: next(iter(of.values())) for action, of in homes.items() if len(of) < 2}
    if not lonely:
        return ()
    what = "group" if max(map(len, parts)) > 1 else "demonstration"
    told = ", ".join(f"{action} (only in {name})" for action, name in lonely.items())
    return (f"Cannot be recognised when its only {what} is left out: {told}.",)


def fitting_remarks(
    labelled: Sequence[Labelled], examples: Sequence[Examples], settings: Settings
) -> tuple[str, ...]:
    """Remarks on how settings and demonstrations fit together."""
    remarks = []
    rates = sorted(item.demonstration.rate for item in labelled)
    if rates[-1] > 1.01 * rates[0]:
        remarks.append(
            f"Recorded at {rates[0]:.6g} to {rates[-1]:.6g} Hz, recognised at "
            f"{examples[0].rate:.6g} Hz."
        )
    short = [
        example.name
        for example in examples
        if len(example.times) * settings.hop(example.rate) < settings.max_scale
    ]
    if short and settings.features == "wavelets":
        remarks.append(
            f"The largest scale, {settings.max_scale:g} samples, is longer than {short[0]}"
            + (f" and {len(short) - 1} more" if len(short) > 1 else "")
            + ": there it sees held end values more than forces."
        )
    return tuple(remarks)


Job = Generator[Progress, None, Evaluation]


def leave_one_out(
    labelled: Sequence[Labelled],
    settings: Settings,
    title: str = "",
    jobs: int = 1,
    *,
    certainty: bool = False,
    folds: int | None = None,
) -> Job:
    """Recognise each demonstration by a recogniser trained on all the others.

    Of many demonstrations that takes long: each fit takes longer, and there are more of them. Left
    out in groups, each is still recognised by a recogniser that has not seen it.

    Parameters
    ----------
    labelled : sequence of Labelled
        Demonstrations without a segment take no part, which a remark says.
    settings : Settings
    title : str
    jobs : int
        Processes that share the folds; the result is the same for any number.
    certainty : bool
        Whether to keep how certain each prediction is, for a review; nothing else changes.
    folds : int, optional
        How many groups are left out, as :func:`~forcelab.recognition.groups.groups` parts them;
        by default each demonstration by itself.

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
    """
    used, parts, remarks = ready_to_part(labelled, folds)
    started = perf_counter()
    examples = yield from preparing(used, settings)
    seconds = {"features": perf_counter() - started, "fit": 0.0, "predict": 0.0, "filter": 0.0}
    actions = actions_of(examples)
    jobs = min(jobs, len(parts))
    if jobs <= 1:
        found = yield from one_by_one(parted(examples, parts), settings, certainty)
    else:
        found = yield from in_processes(parted(examples, parts), settings, jobs, certainty)
    # Groups are interleaved; what was found goes back to the order of the demonstrations.
    order = np.argsort(np.concatenate(parts))
    flat = [result for group in found for result in group]
    results = [flat[i] for i in order]
    for result in results:
        seconds["fit"] += result.fit_seconds
        for stage, spent in result.prediction.seconds.items():
            seconds[stage] += spent
    tested = [
        tested_by(item, example, result.prediction, actions)
        for item, example, result in zip(used, examples, results, strict=True)
    ]
    return Evaluation(
        title=title,
        settings=settings,
        actions=actions,
        tested=tuple(tested),
        rate=examples[0].rate,
        channels=examples[0].channels,
        trained_on=tuple(item.demonstration.id for item in used),
        seconds=seconds,
        reliability=together([result.reliability for result in results]),
        remarks=(
            *remarks,
            *lonely_remark(examples, parts),
            *remark_on([one for result in results for one in result.left_out]),
            *fitting_remarks(used, examples, settings),
            *silence_remark(tested, settings, examples[0].rate),
        ),
    )


def ready_to_part(
    labelled: Sequence[Labelled], folds: int | None = None
) -> tuple[list[Labelled], list[list[int]], tuple[str, ...]]:
    """What can be left out one after the other, and in which groups.

    Parameters
    ----------
    labelled : sequence of Labelled
    folds : int, optional
        As of :func:`leave_one_out`.

    Returns
    -------
    used : list of Labelled
        Those with a segment.
    parts : list of list of int
        Places in `used`, at least two groups.
    remarks : tuple of str

    Raises
    ------
    InputError
        If fewer than two recordings are labelled, one is there twice, or there is a single group.
    """
    used, remarks = with_labels(labelled)
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
    parts = groups([item.demonstration for item in used], folds)
    if len(parts) < 2:
        raise InputError(
            f"All {len(used)} labelled demonstrations hold the same recording, so that nothing "
            f"else is left to train on; label another recording."
        )
    return used, parts, (*remarks, *group_remarks(parts), *twin_remarks(used))


def together(parts: Sequence[Reliability | None]) -> Reliability | None:
    """Reliability of all demonstrations; None where there were no probabilities."""
    known = [part for part in parts if part is not None]
    return reduce(add, known) if known else None


def tested_by(
    item: Labelled, examples: Examples, prediction: Prediction, actions: tuple[str, ...]
) -> Tested:
    """Bring a prediction's codes to the evaluation's actions and the demonstration's stamps.

    Parameters
    ----------
    item : Labelled
        The demonstration as it was recorded.
    examples : Examples
        Its time steps, which were predicted.
    prediction : Prediction
    actions : tuple of str
        The evaluation's; those of the prediction are among them.
    """
    number = [actions.index(action) for action in prediction.actions]
    # One place more for UNLABELLED, which is -1 and so indexes the last one.
    table = np.array([*number, UNLABELLED], dtype=np.int64)
    stamps = item.demonstration.times
    nearest = examples.nearest(stamps)
    human = to_codes(examples.segments, stamps, actions)
    human[~examples.valid[nearest]] = UNLABELLED
    return Tested(
        name=item.demonstration.name,
        id=item.demonstration.id,
        times=stamps,
        actions=actions,
        human=human,
        raw=table[prediction.raw][nearest],
        filtered=table[prediction.filtered][nearest],
        stages={name: table[codes][nearest] for name, codes in prediction.stages.items()},
        certainty=prediction.certainty,
        unaided=None if prediction.unaided is None else table[prediction.unaided][nearest],
    )


def across(
    train: Sequence[Labelled],
    test: Sequence[Labelled],
    settings: Settings,
    title: str = "",
    *,
    certainty: bool = False,
    adapt: bool = False,
) -> Job:
    """Train on all demonstrations of one task and recognise those of another.

    Parameters
    ----------
    train, test : sequence of Labelled
        Demonstrations without a segment take no part, which a remark says.
    settings : Settings
    title : str
    certainty : bool
        As of :func:`leave_one_out`.
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
    """
    learnt, train_remarks = with_labels(train)
    asked, test_remarks = with_labels(test)
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
    on = settings.replace(rate=rate)
    examples = yield from preparing([*learnt, *asked], on)
    matched = matching(learnt, asked) if adapt else None
    prepared = perf_counter()
    known, new = examples[: len(learnt)], examples[len(learnt) :]
    recogniser = yield from fit_examples(known, settings)
    seconds = {"features": prepared - started, "fit": perf_counter() - prepared}
    seconds.update(predict=0.0, filter=0.0)
    actions = actions_of(examples)
    tested, reliable = [], []
    for i, (item, example) in enumerate(zip(asked, new, strict=True)):
        before = None
        if matched is not None:
            before = tested_by(item, example, recogniser.predict_examples(example), actions)
            example = prepare(matched.adapted(item), on)  # noqa: PLW2901 - as it is seen from here
        prediction, reliability = recognised(recogniser, example, certainty)
        reliable.append(reliability)
        for stage, spent in prediction.seconds.items():
            seconds[stage] += spent
        found = tested_by(item, example, prediction, actions)
        tested.append(found if before is None else replace(found, unadapted=before.filtered))
        yield Progress(i + 1, len(asked), "recognising")
    remarks = train_remarks + tuple(r for r in test_remarks if r not in train_remarks)
    if matched is not None:
        remarks += (matched.sentence,)
    untrained = [action for action in actions_of(new) if action not in recogniser.actions]
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
        seconds=seconds,
        reliability=together(reliable),
        remarks=remarks
        + _seen_before(learnt, asked)
        + remark_on(recogniser.left_out)
        + fitting_remarks([*learnt, *asked], examples, settings)
        + silence_remark(tested, settings, recogniser.rate),
    )


def _seen_before(learnt: Sequence[Labelled], asked: Sequence[Labelled]) -> tuple[str, ...]:
    """A remark on recordings that are trained on under one name and tested under another."""
    every = [item.demonstration for item in (*learnt, *asked)]
    known = len(learnt)
    return tuple(
        f"'{every[place].name}' holds the same recording as '{every[same[0]].name}', so that it "
        f"was tested by a recogniser that had seen it; remove one of them."
        for same in twins(every)
        for place in same
        if same[0] < known <= place
    )


def leave_one_out_live(
    labelled: Sequence[Labelled],
    settings: Settings,
    latency: float,
    title: str = "",
    folds: int | None = None,
) -> Job:
    """Recognise each demonstration as a stream, by a recogniser trained on all the others.

    Parameters
    ----------
    labelled : sequence of Labelled
        Demonstrations without a segment take no part.
    settings : Settings
    latency : float
        Seconds from a force to its label.
    title : str
    folds : int, optional
        As of :func:`~forcelab.recognition.cross_validation.leave_one_out`.

    Yields
    ------
    Progress

    Returns
    -------
    Evaluation
        Its raw predictions are the filtered ones.

    Raises
    ------
    InputError
        If fewer than two demonstrations are labelled, they do not fit together, or a recogniser
        with these settings cannot follow a stream.
    """
    check_latency(latency)
    used, parts, remarks = ready_to_part(labelled, folds)
    rate = common_rate([item.demonstration for item in used], settings)
    fixed = settings.replace(rate=rate)
    merged = [item.merged(settings.merge) for item in used]
    actions = tuple(dict.fromkeys(s.action for item in merged for s in item.segments))
    seconds = {"features": 0.0, "fit": 0.0, "predict": 0.0, "filter": 0.0}
    tested: dict[int, Tested] = {}
    reliable = []
    left_out: list[Contradicted] = []
    for part in parts:
        started = perf_counter()
        recogniser = yield from training([o for i, o in enumerate(used) if i not in part], fixed)
        left_out.extend(recogniser.left_out)
        seconds["fit"] += perf_counter() - started
        for i in part:
            started = perf_counter()
            decided = with_latency(recogniser, used[i].demonstration, latency)
            seconds["predict"] += perf_counter() - started
            examples = _examples(merged[i], recogniser, decided)
            codes = decided.codes
            prediction = Prediction(
                decided.times, recogniser.actions, codes, codes, decided.probabilities, {}
            )
            tested[i] = tested_by(used[i], examples, prediction, actions)
            reliable.append(relied_on(prediction, examples))  # gaps, which have none, do not count
    return Evaluation(
        title=title,
        settings=settings,
        actions=actions,
        tested=tuple(tested[i] for i in range(len(used))),
        rate=recogniser.rate,
        channels=recogniser.channels,
        trained_on=tuple(item.demonstration.id for item in used),
        seconds=seconds,
        reliability=together(reliable),
        remarks=(
            f"Recognised as a stream, each label {1000 * latency:g} ms after its force.",
            *remarks,
            *remark_on(left_out),
            *silence_remark(list(tested.values()), settings, recogniser.rate),
        ),
    )


def _examples(item: Labelled, recogniser: Recogniser, decided: Decided) -> Examples:
    """The steps of a stream, of which nothing but the human's labels is wanted."""
    n = len(decided)
    known = decided.probabilities
    seen = np.ones(n, dtype=bool) if known is None else np.asarray(known.any(axis=1))
    return Examples(
        name=item.demonstration.name,
        times=decided.times,
        features=np.empty((n, 0)),
        valid=seen,
        segments=item.segments,
        channels=recogniser.channels,
        rate=recogniser.rate,
    )
