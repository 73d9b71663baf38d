"""What recognising left-out demonstrations took and how well it went, whoever recognised them."""

from __future__ import annotations

import gc
import time
import tracemalloc
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from forcelab.errors import InputError
from forcelab.measure.rows import Row
from forcelab.recognition.cross_validation import held_out_prediction
from forcelab.recognition.examples import Examples, LabelledDemonstration
from forcelab.recognition.metrics import Counts, Scores, pool
from forcelab.recognition.recogniser import Recogniser
from forcelab.text import there_are

__all__ = [
    "Seen",
    "Spent",
    "enough",
    "recognise",
    "reference",
    "remembered",
    "row_of",
    "timed",
    "usual",
]

MadeT = TypeVar("MadeT")


@dataclass
class Spent:
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
class Seen:
    """Demonstrations with their features, and what those cost."""

    labelled: Sequence[LabelledDemonstration]
    examples: list[Examples]
    #: CPU seconds of each.
    seconds: list[float]
    peak_bytes: int

    @property
    def minutes(self) -> list[float]:
        """Of signal, of each demonstration."""
        return [item.demonstration.duration / 60 for item in self.labelled]


def enough(labelled: Sequence[LabelledDemonstration]) -> list[LabelledDemonstration]:
    """Those that have a segment.

    Raises
    ------
    InputError
        If they are fewer than two.
    """
    used = [item for item in labelled if item.segments]
    if len(used) < 2:
        raise InputError(
            f"Measuring recognition needs two labelled demonstrations; {there_are(len(used))}."
        )
    return used


def reference(demonstrations: int, groups: int) -> str:
    """What so many demonstrations, left out in so many groups, are compared with."""
    turns = "one left out at a time"
    if groups < demonstrations:
        turns = f"left out in {groups} groups in turn"
    return f"the coder's labels of {demonstrations} demonstrations, {turns}"


def recognise(
    recogniser: Recogniser, seen: Seen, i: int, actions: tuple[str, ...], found: Spent
) -> None:
    """Recognise a demonstration that was left out, on the clock, and count its mistakes."""
    if not found.counts:
        _, peak = remembered(lambda: recogniser.predict_examples(seen.examples[i]))
        found.peak_bytes = max(seen.peak_bytes, peak + seen.examples[i].features.nbytes)
    prediction, taken = timed(lambda: recogniser.predict_examples(seen.examples[i]))
    tested = held_out_prediction(seen.labelled[i], seen.examples[i], prediction, actions)
    found.counts.append(tested.counts("filtered"))
    found.features.append(seen.seconds[i] / seen.minutes[i])
    found.predict.append(taken / seen.minutes[i])


def timed(make: Callable[[], MadeT]) -> tuple[MadeT, float]:
    """What is made, and the CPU seconds that took."""
    began = time.process_time()
    made = make()
    return made, time.process_time() - began


def remembered(make: Callable[[], MadeT]) -> tuple[MadeT, int]:
    """What is made, and the most memory that was held at once."""
    gc.collect()
    tracemalloc.start()
    try:
        return make(), tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def usual(seconds: Sequence[float]) -> tuple[float, float]:
    """Median and interquartile range; a row needs a time of at least the clock's tick."""
    low, middle, high = np.percentile(seconds, [25, 50, 75]).tolist()
    return max(middle, time.get_clock_info("process_time").resolution), high - low


def row_of(name: str, setting: str, spent: Spent, size: str, against: str) -> Row:
    """The row of one way to recognise; `against` is its reference."""
    scores = pool(size, spent.counts) if spent.counts and not spent.refusal else None
    refusal = spent.refusal
    if scores is not None and scores.f1["50"] is None:
        refusal = "There is no segment to compare with."
    if scores is None or refusal:
        return Row(name, setting, size, against, refusal=refusal)
    seconds, spread = usual(np.add(spent.features, spent.predict).tolist())
    return Row(
        name,
        setting,
        size,
        against,
        error=1.0 - (scores.f1["50"] or 0.0),
        seconds=seconds,
        spread=spread,
        peak_bytes=spent.peak_bytes,
        further=_further(scores, spent),
    )


def _further(scores: Scores, spent: Spent) -> dict[str, float]:
    """All other figures that there are."""
    figures = {
        "accuracy": scores.accuracy,
        "balanced": scores.balanced_accuracy,
        "edit": scores.edit,
        "F1@50": scores.f1["50"],
        "F1@50, labelled time": scores.f1_labelled["50"],
        "boundaries found": scores.boundaries_found,
        "boundary (ms)": scores.boundary_ms["median"],
        "boundary p90 (ms)": scores.boundary_ms["p90"],
        "features (s/min)": float(np.median(spent.features)),
        "fit (s/min)": spent.fit / spent.trained,
        "predict (s/min)": float(np.median(spent.predict)),
    }
    return {name: figure for name, figure in figures.items() if figure is not None}
