"""What recognition costs and how well it does: presets and settings on the same demonstrations.

Features are computed once for all settings that share them, and so is a classifier: what differs
in filters or decoder alone is fitted once.
"""

from __future__ import annotations

import gc
import time
import tracemalloc
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.measure.recognition_settings import Variant, fitted_alike, seen_alike
from forcelab.measure.rows import Row, with_front
from forcelab.recognition.evaluation import tested_by
from forcelab.recognition.examples import Examples, Labelled, actions_of, common_rate, prepare
from forcelab.recognition.metrics import Counts, Scores, pool
from forcelab.recognition.recogniser import Recogniser
from forcelab.recognition.training import fit_examples

__all__ = ["ERROR", "FOLDS", "SECONDS", "measuring"]

MadeT = TypeVar("MadeT")

#: What the columns of the table hold.
ERROR, SECONDS = "1 - F1@50", "recognition (CPU s per min)"
#: Into so many groups demonstrations are parted, each of which is left out in turn.
FOLDS = 4


@dataclass
class _Spent:
    """What came of a variant, fold by fold; CPU seconds."""

    counts: list[Counts] = field(default_factory=list)
    #: Per minute of signal, of each demonstration: features, and what comes after them.
    features: list[float] = field(default_factory=list)
    predict: list[float] = field(default_factory=list)
    fit: float = 0.0
    #: Minutes that were trained on.
    trained: float = 0.0
    peak_bytes: int = 0
    refusal: str = ""


@dataclass(frozen=True)
class _Seen:
    """Demonstrations with their features, and what those cost."""

    labelled: Sequence[Labelled]
    examples: list[Examples]
    #: CPU seconds of each.
    seconds: list[float]
    peak_bytes: int

    @property
    def minutes(self) -> list[float]:
        """Of signal, of each demonstration."""
        return [item.demonstration.duration / 60 for item in self.labelled]


def measuring(
    labelled: Sequence[Labelled],
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
    labelled : sequence of Labelled
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
    used = [item for item in labelled if item.segments]
    if len(used) < 2:
        raise InputError(
            f"Measuring recognition needs two labelled demonstrations; there "
            f"{'is' if len(used) == 1 else 'are'} {len(used) or 'none'}."
        )
    parts = _parts(len(used), folds)
    watch = _Watch(variants, len(parts))
    spent: dict[int, _Spent] = {id(variant): _Spent() for variant in variants}
    for alike in seen_alike(variants):
        try:
            seen = yield from _seen(used, alike[0], watch)
        except InputError as error:
            _refuse(alike, spent, error)
            continue
        for group in fitted_alike(alike):
            yield from _folds(seen, group, parts, spent, watch)
        del seen  # before the next features are computed
    turns = "one left out at a time"
    if len(parts) < len(used):
        turns = f"left out in {len(parts)} groups in turn"
    reference = f"the coder's labels of {len(used)} demonstrations, {turns}"
    return with_front([_row(variant, spent[id(variant)], size, reference) for variant in variants])


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


def _parts(count: int, folds: int | None) -> list[list[int]]:
    """The places of the demonstrations that are left out together, spread over all of them."""
    groups = count if folds is None else min(max(folds, 2), count)
    return [list(range(start, count, groups)) for start in range(groups)]


def _refuse(variants: Sequence[Variant], spent: dict[int, _Spent], error: InputError) -> None:
    """Remember why some variants have no figures."""
    for variant in variants:
        spent[id(variant)].refusal = str(error)


def _told(variant: Variant) -> str:
    """A variant in the words of the progress."""
    return f"{variant.name} {variant.setting}"


def _seen(
    labelled: Sequence[Labelled], variant: Variant, watch: _Watch
) -> Generator[Progress, None, _Seen]:
    """Compute the features of all demonstrations, each on the clock."""
    settings = variant.settings
    rate = common_rate([item.demonstration for item in labelled], settings)
    yield watch.at(f"{_told(variant)}: features")
    # Untimed, as counting memory takes time; it also loads and plans what the others then find.
    _, peak = _remembered(lambda: prepare(labelled[0], settings, rate))
    examples, seconds = [], []
    for item in labelled:
        made, taken = _timed(lambda item=item: prepare(item, settings, rate))  # type: ignore[misc]
        examples.append(made)
        seconds.append(taken)
        yield watch.at(f"{_told(variant)}: features")
    watch.done += 1
    return _Seen(labelled, examples, seconds, peak)


def _folds(
    seen: _Seen,
    group: Sequence[Variant],
    parts: Sequence[Sequence[int]],
    spent: dict[int, _Spent],
    watch: _Watch,
) -> Generator[Progress, None, None]:
    """Fit what a group of variants shares, then recognise the left-out ones by each of them."""
    actions = actions_of(seen.examples)
    # Whoever decodes needs more of a fit; whoever does not leaves it alone.
    first = next((variant for variant in group if variant.settings.decodes), group[0])
    ended = watch.done + len(parts)
    try:
        for number, part in enumerate(parts, 1):
            text = f"{_told(group[0])}: {number} of {len(parts)}"
            train = [e for i, e in enumerate(seen.examples) if i not in part]
            recogniser, fitted = yield from _fitted(train, first, watch, text)
            for variant in group:
                own = replace(
                    recogniser,
                    settings=variant.settings,
                    choreography=recogniser.choreography if variant.settings.decodes else None,
                )
                found = spent[id(variant)]
                found.fit += fitted
                found.trained += sum(m for i, m in enumerate(seen.minutes) if i not in part)
                for i in part:
                    _recognise(own, seen, i, actions, found)
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


def _recognise(
    recogniser: Recogniser, seen: _Seen, i: int, actions: tuple[str, ...], found: _Spent
) -> None:
    """Recognise a demonstration that was left out, on the clock, and count its mistakes."""
    if not found.counts:
        _, peak = _remembered(lambda: recogniser.predict_examples(seen.examples[i]))
        found.peak_bytes = max(seen.peak_bytes, peak + seen.examples[i].features.nbytes)
    prediction, taken = _timed(lambda: recogniser.predict_examples(seen.examples[i]))
    tested = tested_by(seen.labelled[i], seen.examples[i], prediction, actions)
    found.counts.append(tested.counts("filtered"))
    found.features.append(seen.seconds[i] / seen.minutes[i])
    found.predict.append(taken / seen.minutes[i])


def _timed(make: Callable[[], MadeT]) -> tuple[MadeT, float]:
    """What is made, and the CPU seconds that took."""
    began = time.process_time()
    made = make()
    return made, time.process_time() - began


def _remembered(make: Callable[[], MadeT]) -> tuple[MadeT, int]:
    """What is made, and the most memory that was held at once."""
    gc.collect()
    tracemalloc.start()
    try:
        return make(), tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def _row(variant: Variant, spent: _Spent, size: str, reference: str) -> Row:
    """A variant's row."""
    scores = pool(size, spent.counts) if spent.counts and not spent.refusal else None
    refusal = spent.refusal
    if scores is not None and scores.f1["50"] is None:
        refusal = "There is no segment to compare with."
    if scores is None or refusal:
        return Row(variant.name, variant.setting, size, reference, refusal=refusal)
    each = np.add(spent.features, spent.predict)
    low, middle, high = np.percentile(each, [25, 50, 75]).tolist()
    return Row(
        variant.name,
        variant.setting,
        size,
        reference,
        error=1.0 - (scores.f1["50"] or 0.0),
        # A short demonstration may take less than the clock's tick.
        seconds=max(middle, time.get_clock_info("process_time").resolution),
        spread=high - low,
        peak_bytes=spent.peak_bytes,
        further=_further(scores, spent),
    )


def _further(scores: Scores, spent: _Spent) -> dict[str, float]:
    """All other figures that there are."""
    figures = {
        "accuracy": scores.accuracy,
        "balanced": scores.balanced_accuracy,
        "edit": scores.edit,
        "F1@50": scores.f1["50"],
        "boundary (ms)": scores.boundary_ms["median"],
        "boundary p90 (ms)": scores.boundary_ms["p90"],
        "features (s/min)": float(np.median(spent.features)),
        "fit (s/min)": spent.fit / spent.trained,
        "predict (s/min)": float(np.median(spent.predict)),
    }
    return {name: figure for name, figure in figures.items() if figure is not None}
