"""Evaluation: how well a recogniser does on demonstrations that are left out in turn."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from functools import reduce
from operator import add
from time import perf_counter

import numpy as np

from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.labels import UNLABELLED, to_codes
from forcelab.recognition.evaluation_remarks import (
    fitting_remarks,
    group_remarks,
    lonely_remark,
    twin_remarks,
    with_labels,
)
from forcelab.recognition.examples import Examples, Labelled, actions_of
from forcelab.recognition.folds import in_processes, one_by_one, parted
from forcelab.recognition.grouping import groups
from forcelab.recognition.recogniser import Prediction
from forcelab.recognition.reliability import Reliability
from forcelab.recognition.results import Evaluation, Tested
from forcelab.recognition.settings import Settings
from forcelab.recognition.silence import silence_remark
from forcelab.recognition.training import preparing
from forcelab.recognition.trimming import remark_on
from forcelab.text import there_are

__all__ = ["Job", "leave_one_out", "ready_to_part", "tested_by", "together"]

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
        How many groups are left out, as :func:`~forcelab.recognition.grouping.groups` parts them;
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
