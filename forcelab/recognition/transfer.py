"""Evaluation on demonstrations that are chosen: of another task, or of another person."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter

from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.recognition.adaptation import matching
from forcelab.recognition.evaluation import Job, tested_by, together
from forcelab.recognition.evaluation_remarks import fitting_remarks, with_labels
from forcelab.recognition.examples import Labelled, actions_of, common_rate, prepare
from forcelab.recognition.folds import recognised
from forcelab.recognition.grouping import twins
from forcelab.recognition.results import Evaluation
from forcelab.recognition.settings import Settings
from forcelab.recognition.silence import silence_remark
from forcelab.recognition.training import fit_examples, preparing
from forcelab.recognition.trimming import remark_on

__all__ = ["across"]


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
