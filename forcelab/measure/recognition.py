"""What recognition costs and how well it does: presets and settings on the same demonstrations.

Features are computed once for all settings that share them, and so is a classifier: what differs
in filters or decoder alone is fitted once.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Sequence
from dataclasses import replace

from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.measure.recognition_settings import Variant, fitted_alike, seen_alike
from forcelab.measure.recognition_spent import (
    Seen,
    Spent,
    enough,
    recognise,
    reference,
    remembered,
    row_of,
    timed,
)
from forcelab.measure.rows import Row, with_front
from forcelab.recognition.examples import (
    Examples,
    LabelledDemonstration,
    actions_of,
    common_rate,
    prepare_examples,
)
from forcelab.recognition.groups import fold_groups
from forcelab.recognition.recogniser import Recogniser
from forcelab.recognition.training import fit_examples

__all__ = ["ERROR", "FOLDS", "SECONDS", "measuring"]

#: What the columns of the table hold.
ERROR, SECONDS = "1 - F1@50", "recognition (CPU s per min)"
#: Into so many groups demonstrations are parted, each of which is left out in turn.
FOLDS = 4


def measuring(
    labelled: Sequence[LabelledDemonstration],
    variants: Sequence[Variant],
    size: str,
    folds: int | None = FOLDS,
) -> Generator[Progress, None, tuple[Row, ...]]:
    """Measure variants on labelled demonstrations, each recognised by who has not seen it.

    The error is ``1 - F1@50``, pooled over all demonstrations, and the seconds are those of
    features, classifier and filters or decoder per minute of signal: the median over
    demonstrations and their interquartile range, CPU time of all threads. `further` holds all the
    scores, and the seconds of features, fit (per minute trained on) and prediction by themselves.

    Parameters
    ----------
    labelled : sequence of LabelledDemonstration
        Demonstrations without a segment take no part.
    variants : sequence of Variant
    size : str
        What the rows call these demonstrations.
    folds : int, optional
        Into so many groups the demonstrations are parted at most, at least 2; None leaves out one
        at a time.

    Yields
    ------
    Progress

    Returns
    -------
    tuple of Row
        In the order of `variants`. Settings that cannot be trained are refused.

    Raises
    ------
    InputError
        If fewer than two demonstrations are labelled.
    """
    used = enough(labelled)
    parts = fold_groups([item.demonstration for item in used], folds)
    watch = _Watch(variants, len(parts))
    spent: dict[int, Spent] = {id(variant): Spent() for variant in variants}
    for alike in seen_alike(variants):
        try:
            seen = yield from _compute_features(used, alike[0], watch)
        except InputError as error:
            _refuse(alike, spent, error)
            continue
        for group in fitted_alike(alike):
            yield from _folds(seen, group, parts, spent, watch)
        del seen  # before the next features are computed
    against = reference(len(used), len(parts))
    return with_front([row_of(v.name, v.setting, spent[id(v)], size, against) for v in variants])


class _Watch:
    """How far all of it is: a step for each fold of each fit, and one for each set of features."""

    def __init__(self, variants: Sequence[Variant], parts: int) -> None:
        groups = seen_alike(variants)
        fits = sum(len(fitted_alike(alike)) for alike in groups)
        self.total = len(groups) + fits * parts
        self.done = 0

    def at(self, text: str) -> Progress:
        """Where it is."""
        return Progress(min(self.done, self.total), self.total, text)


def _refuse(variants: Sequence[Variant], spent: dict[int, Spent], error: InputError) -> None:
    """Remember why some variants have no figures."""
    for variant in variants:
        spent[id(variant)].refusal = str(error)


def _variant_text(variant: Variant) -> str:
    """A variant in the words of the progress."""
    return f"{variant.name} {variant.setting}"


def _compute_features(
    labelled: Sequence[LabelledDemonstration], variant: Variant, watch: _Watch
) -> Generator[Progress, None, Seen]:
    """Compute the features of all demonstrations, each on the clock."""
    settings = variant.settings
    rate = common_rate([item.demonstration for item in labelled], settings)
    yield watch.at(f"{_variant_text(variant)}: features")
    # Untimed, as counting memory takes time; it also loads and plans what the others then find.
    _, peak = remembered(lambda: prepare_examples(labelled[0], settings, rate))
    examples, seconds = [], []
    for item in labelled:
        made, taken = timed(lambda item=item: prepare_examples(item, settings, rate))  # type: ignore[misc]
        examples.append(made)
        seconds.append(taken)
        yield watch.at(f"{_variant_text(variant)}: features")
    watch.done += 1
    return Seen(labelled, examples, seconds, peak)


def _folds(
    seen: Seen,
    group: Sequence[Variant],
    parts: Sequence[Sequence[int]],
    spent: dict[int, Spent],
    watch: _Watch,
) -> Generator[Progress, None, None]:
    """Fit what a group of variants shares, then recognise the left-out ones by each of them."""
    actions = actions_of(seen.examples)
    # Whoever decodes needs more of a fit; whoever does not leaves it alone.
    first = next((variant for variant in group if variant.settings.decodes), group[0])
    ended = watch.done + len(parts)
    try:
        for number, part in enumerate(parts, 1):
            text = f"{_variant_text(group[0])}: {number} of {len(parts)}"
            train = [e for i, e in enumerate(seen.examples) if i not in part]
            recogniser, fitted = yield from _fitted(train, first, watch, text)
            for variant in group:
                own = replace(
                    recogniser,
                    settings=variant.settings,
                    grammar=recogniser.grammar if variant.settings.decodes else None,
                )
                found = spent[id(variant)]
                found.fit += fitted
                found.trained += sum(m for i, m in enumerate(seen.minutes) if i not in part)
                for i in part:
                    recognise(own, seen, i, actions, found)
                    yield watch.at(text)
            watch.done += 1
    except InputError as error:
        _refuse(group, spent, error)
    watch.done = ended


def _fitted(
    train: Sequence[Examples], variant: Variant, watch: _Watch, text: str
) -> Generator[Progress, None, tuple[Recogniser, float]]:
    """A recogniser and the CPU seconds of its fit, without those of whoever watches."""
    job = fit_examples(train, variant.settings)
    taken = 0.0
    try:
        while True:
            began = time.process_time()
            try:
                next(job)
            except StopIteration as end:
                recogniser: Recogniser = end.value
                return recogniser, taken + time.process_time() - began
            taken += time.process_time() - began
            yield watch.at(text)
    finally:
        job.close()
