"""Remarks on an evaluation or a training: a sentence for each thing worth a look."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import pairwise

import numpy as np

from forcelab.demonstration import Demonstration
from forcelab.recognition.copies import find_copies
from forcelab.recognition.dataset import Dataset
from forcelab.recognition.examples import (
    Examples,
    LabelledDemonstration,
    actions_of,
    mixed_unit_remarks,
)
from forcelab.recognition.hsmm import bridged_runs, bridged_steps
from forcelab.recognition.metrics import pool
from forcelab.recognition.recogniser import Recogniser
from forcelab.recognition.results import TOO_HIGH, Evaluation, HeldOutPrediction
from forcelab.recognition.settings import Settings
from forcelab.text import counted, percent, were


def copy_remarks(
    labelled: Sequence[LabelledDemonstration], parts: Sequence[Sequence[int]]
) -> tuple[str, ...]:
    """A remark on recordings that occur more than once, or nearly so."""
    every = [item.demonstration for item in labelled]
    remarks = []
    for same in find_copies(every):
        if len(same) > 1:
            together = any(set(same) <= set(part) for part in parts)
            outcome = "left out together" if together else "tested by recognisers that had seen it"
            remarks.append(
                f"{' and '.join(every[i].name for i in same)} hold "
                f"{_same_recording([every[i] for i in same])}, so that they were {outcome}; remove "
                f"all but one."
            )
    return tuple(remarks)


def _same_recording(copies: Sequence[Demonstration]) -> str:
    first, *others = (np.asarray(copy.signals) for copy in copies)
    equal = all(np.array_equal(first, other, equal_nan=True) for other in others)
    return "the same recording" if equal else "nearly the same recording"


def group_remarks(parts: Sequence[Sequence[int]]) -> tuple[str, ...]:
    """A remark on demonstrations that were left out together."""
    most = max(map(len, parts))
    return (f"Left out in {len(parts)} groups of up to {most}.",) if most > 1 else ()


def unlearnable_remarks(
    examples: Sequence[Examples], parts: Sequence[Sequence[int]]
) -> tuple[str, ...]:
    """A remark on actions of a single demonstration or group, which no other can teach."""
    homes: dict[str, dict[int, str]] = {}  # by action, the first demonstration of each group
    always_trained_on = range(sum(map(len, parts)), len(examples))
    for number, group in enumerate([*parts, always_trained_on]):
        for i in group:
            for action in actions_of([examples[i]]):
                homes.setdefault(action, {}).setdefault(number, examples[i].name)
    lonely = {action: next(iter(of.values())) for action, of in homes.items() if len(of) < 2}
    if not lonely:
        return ()
    what = "group" if max(map(len, parts)) > 1 else "demonstration"
    actions = ", ".join(f"{action} (only in {name})" for action, name in lonely.items())
    return (f"Cannot be recognised when its only {what} is left out: {actions}.",)


#: A largest scale that lasts fewer seconds sees little of an action. In the paper's recordings it
#: lasts 1.0 s; of the stylus at 10 kHz, where that is 0.1 s, preset paper gets 27 % right, and
#: released, where it is 0.4 s, 71 % instead of 76. A running median that lasts longer takes out
#: actions: that of released lasts 0.1 s in those recordings; of foam at 100, 50 and 20 Hz, where
#: that is 1 to 5 s, it gets 90, 87 and 63 % right instead of 96, and at 20 Hz put onto a grid of
#: 1000 Hz 94.
LEAST_SECONDS = 0.5


def settings_remarks(
    labelled: Sequence[LabelledDemonstration], rate: float, settings: Settings
) -> tuple[str, ...]:
    """Remarks on rates that differ, and on scales and filters that are too short or too long.

    `rate`: samples a second of the grid.
    """
    remarks = []
    demonstrations = [item.demonstration for item in labelled]
    rates = sorted(demonstration.rate for demonstration in demonstrations)
    if rates[-1] > 1.01 * rates[0]:
        remarks.append(
            f"Recorded at {rates[0]:.6g} to {rates[-1]:.6g} Hz, recognised at {rate:.6g} Hz."
        )
    widest = settings.max_scale / rate
    if "wavelets" in settings.known_features and widest < LEAST_SECONDS:
        remarks.append(
            f"At {rate:g} Hz the largest scale, {settings.max_scale:g} samples, lasts "
            f"{widest:.2g} s only and sees little of an action, so expect poorer labels; use "
            f"a larger one, or a lower rate."
        )
    if settings.median is not None and not settings.decodes:
        lasting = settings.median / rate
        if lasting > LEAST_SECONDS:
            remarks.append(
                f"At {rate:g} Hz the running median, {settings.median} samples, lasts "
                f"{lasting:.2g} s and takes out shorter actions, so expect poorer labels; use a "
                f"narrower one, or a higher rate."
            )
    # At 20, 50, 100, 1000 and 10,000 Hz the stylus' accuracy is 82.4, 81.7, 82.8, 84.2 and 83.8 by
    # preset fast; 82.9, 84.0, 84.2 and 83.2 by best, without the last.
    if settings.known_features == "windows" and settings.windows[0] * rate < 0.9:
        remarks.append(
            f"At {rate:g} Hz the shortest window, {settings.windows[0]:g} s, holds less than a "
            f"sample: expect up to three points less accuracy than at 1000 Hz."
        )
    short = [d.name for d in demonstrations if round(d.duration * rate) < settings.max_scale]
    if short and "wavelets" in settings.known_features:
        remarks.append(
            f"The largest scale, {settings.max_scale:g} samples, is longer than {short[0]}"
            + (f" and {len(short) - 1} more" if len(short) > 1 else "")
            + ": there it sees held end values more than forces, which tells the place in a "
            "recording and need not carry over to another task; use a smaller one, or a higher "
            "rate."
        )
    return tuple(remarks)


def bridged_remarks(examples: Sequence[Examples], settings: Settings) -> tuple[str, ...]:
    """A remark on gaps in tested demonstrations that the decoder looked through."""
    step = settings.hop(examples[0].rate) / examples[0].rate
    runs = (bridged_runs(example.valid, 0) for example in examples)
    gaps = [after - before for own in runs for (_, before), (after, _) in pairwise(own)]
    short = [gap for gap in gaps if gap <= bridged_steps(step)]
    if not (settings.decodes and short):
        return ()
    return (
        f"Decoded as time of which nothing is known, and left unlabelled: "
        f"{counted(len(short), 'gap')} of up to {max(short) * step:.2g} s.",
    )


def added_remarks(
    tested: Sequence[HeldOutPrediction], added: Sequence[LabelledDemonstration]
) -> tuple[str, ...]:
    """A remark on what another coder's labels add to the coder's own, or take away."""
    if not added:
        return ()
    both, alone = (
        pool("", [prediction.counts(kind) for prediction in tested]).accuracy or 0.0
        for kind in ("filtered", "alone")
    )
    hurt = " They hurt here: leave them out, or merge actions that are coded otherwise."
    return (
        f"Also learnt from {counted(len(added), 'demonstration')} that another coder labelled: "
        f"{100 * both:.1f} % right, with the own labels alone {100 * alone:.1f} %."
        + (hurt if both < alone else ""),
    )


def trained_on_remarks(
    train: Sequence[LabelledDemonstration], test: Sequence[LabelledDemonstration]
) -> tuple[str, ...]:
    """A remark on recordings that are trained on under one name and tested under another."""
    every = [item.demonstration for item in (*train, *test)]
    train_count = len(train)
    return tuple(
        f"'{every[place].name}' holds {_same_recording([every[same[0]], every[place]])} as "
        f"'{every[same[0]].name}', so that it was tested by a recogniser that had seen it; remove "
        f"one of them."
        for same in find_copies(every)
        for place in same
        if same[0] < train_count <= place
    )


def accepted_remarks(dataset: Dataset, evaluation: Evaluation) -> tuple[str, ...]:
    """A sentence if labels that were tested on are proposals that nobody changed."""
    ids = {item.id for item in evaluation.tested}
    tested = [
        segment
        for item in dataset.labelled
        if item.demonstration.id in ids
        for segment in item.segments
    ]
    accepted = [segment for id_ in ids for segment in dataset.accepted.get(id_, ())]
    if not accepted:
        return ()
    share = sum(s.end - s.start for s in accepted) / sum(s.end - s.start for s in tested)
    return (
        f"{len(accepted)} of {counted(len(tested), 'tested segment')} ({percent(share)} % of the "
        f"tested time) {were(len(accepted))} proposed by a recogniser and "
        f"{TOO_HIGH}; report scores on demonstrations that were labelled without it.",
    )


def unused_merge_remarks(settings: Settings, spelt: Collection[str]) -> tuple[str, ...]:
    """A remark on a merge map's spellings that no label has."""
    unused = settings.merge.unused(spelt)
    return (f"The merge map names what nobody labelled: {', '.join(unused)}.",) if unused else ()


def dataset_remarks(datasets: Sequence[Dataset], settings: Settings) -> tuple[str, ...]:
    """Remarks on units that differ, and on actions that the coder's own labels do not have.

    The first dataset is trained on, perhaps with another coder's labels; all are looked at for
    their units.
    """
    labelled = [item for part in datasets for item in part.labelled if item.segments]
    units = mixed_unit_remarks([item.demonstration for item in labelled], settings)
    merged = [item.merged(settings.merge) for item in datasets[0].labelled]
    own, added = (
        {s.action for item in merged if item.added is which for s in item.segments}
        for which in (False, True)
    )
    if not added - own:
        return units
    return (
        *units,
        f"Of the added labels alone: {', '.join(sorted(added - own))}; a merge map makes them one "
        f"with an action of yours where they mean the same.",
    )


def unlearnt_remarks(dataset: Dataset, recogniser: Recogniser) -> tuple[str, ...]:
    """A remark on actions that are labelled but gave no training sample."""
    merged = (item.merged(recogniser.settings.merge) for item in dataset.labelled)
    labels = {segment.action for item in merged for segment in item.segments}
    names = sorted(labels - set(recogniser.actions))
    return (f"No sample to train on at this stride: {', '.join(names)}.",) if names else ()
