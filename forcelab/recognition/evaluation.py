"""Evaluation: how well a recogniser does on demonstrations it has never seen."""

from __future__ import annotations

import hashlib
from collections.abc import Generator, Sequence
from dataclasses import replace
from functools import reduce
from operator import add
from time import perf_counter

import numpy as np

from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.labels import UNLABELLED, Segment, to_codes
from forcelab.recognition.adaptation import matching
from forcelab.recognition.examples import (
    Examples,
    Labelled,
    actions_of,
    common_rate,
    prepare,
)
from forcelab.recognition.folds import groups, in_processes, one_by_one, parted, recognised
from forcelab.recognition.recogniser import Prediction
from forcelab.recognition.reliability import Reliability
from forcelab.recognition.results import Evaluation, Tested
from forcelab.recognition.settings import Settings
from forcelab.recognition.training import fit_examples, preparing
from forcelab.recognition.trimming import remark_on
from forcelab.wording import there_are

__all__ = ["Evaluation", "Tested", "across", "kept_apart", "leave_one_out", "tested_by", "together"]


Job = Generator[Progress, None, Evaluation]


def kept_apart(labelled: Sequence[Labelled], suffixes: Sequence[str]) -> list[Labelled]:
    """Give each demonstration's actions a suffix, so that ``grab`` of two tasks stays two actions.

    No merge map changes them any more: what it is to merge is merged before.

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
            apart=True,
        )
        for item, suffix in zip(labelled, suffixes, strict=True)
    ]


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
        How many groups are left out, as :func:`~forcelab.recognition.folds.groups` parts them; by
        default each demonstration by itself.

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
            f"Leaving one demonstration out needs two labelled ones; {there_are(len(used))}."
        )
    ids = [item.demonstration.id for item in used]
    for item in used:
        if ids.count(item.demonstration.id) > 1:
            raise InputError(
                f"'{item.demonstration.name}' is there twice, so that its twin would be trained on "
                f"while it is left out; name each demonstration once."
            )
    started = perf_counter()
    examples = yield from preparing(used, settings)
    seconds = {"features": perf_counter() - started, "fit": 0.0, "predict": 0.0, "filter": 0.0}
    actions = actions_of(examples)
    parts = groups(len(examples), folds)
    jobs = min(jobs, len(parts))
    if jobs <= 1:
        found = yield from one_by_one(parted(examples, folds), settings, certainty)
    else:
        found = yield from in_processes(parted(examples, folds), settings, jobs, certainty)
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
        trained_on=tuple(ids),
        seconds=seconds,
        reliability=together([result.reliability for result in results]),
        remarks=(
            *remarks,
            *_grouped(parts),
            *_twins(used),
            *_lonely(examples, parts),
            *remark_on([one for result in results for one in result.left_out]),
            *_fitting(used, examples, settings),
        ),
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
        + remark_on(recogniser.left_out)
        + _fitting([*learnt, *asked], examples, settings),
    )


def together(parts: Sequence[Reliability | None]) -> Reliability | None:
    """Reliability of all demonstrations; None where there were no probabilities."""
    known = [part for part in parts if part is not None]
    return reduce(add, known) if known else None


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


def _twins(labelled: Sequence[Labelled]) -> tuple[str, ...]:
    """A remark on recordings that are there twice, by whatever names and stamps.

    Their ids differ as soon as a stamp does; what was recorded is then still the same.
    """
    homes: dict[bytes, list[str]] = {}
    for item in labelled:
        signals = np.ascontiguousarray(item.demonstration.signals, dtype=np.float64)
        key = hashlib.sha256(signals.tobytes()).digest()
        homes.setdefault(key, []).append(item.demonstration.name)
    return tuple(
        f"{' and '.join(names)} hold the same recording, so that each was tested by a recogniser "
        f"that had seen it; remove all but one."
        for names in homes.values()
        if len(names) > 1
    )


def _grouped(parts: Sequence[Sequence[int]]) -> tuple[str, ...]:
    """A remark on demonstrations that were left out together."""
    most = max(map(len, parts))
    return (f"Left out in {len(parts)} groups of up to {most}.",) if most > 1 else ()


def _lonely(examples: Sequence[Examples], parts: Sequence[Sequence[int]]) -> tuple[str, ...]:
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


def _fitting(
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
