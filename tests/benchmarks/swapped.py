"""What wrong labels do: some segments of a task get another action at random.

Each demonstration is recognised by who was trained on all the others, wrong labels and all, and
scored with the right ones. Then a review lists the segments that it suspects, most suspect first:
how many of the wrong ones stand in the first tenth of as many places as there are segments?

Each draw has a seed of its own and is compared with the right labels under the same seed. Of few
demonstrations seeds alone differ by points: with one training on right labels for all draws, its
luck would be taken for what wrong labels cost.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.jobs import Progress, finish
from forcelab.labels import Segments
from forcelab.measure.recognition import median_and_spread, require_labelled
from forcelab.measure.rows import Row
from forcelab.measure.timing import measure_peak, measure_seconds
from forcelab.recognition.cross_validation import held_out_prediction
from forcelab.recognition.examples import Examples, LabelledDemonstration, actions_of
from forcelab.recognition.metrics import Counts, pool
from forcelab.recognition.recogniser import Prediction
from forcelab.recognition.results import DemonstrationResult
from forcelab.recognition.settings import Settings
from forcelab.recognition.training import fit_examples, prepare_all
from forcelab.review.differences import find_differences
from forcelab.review.label_errors import ModelEvidence, gather_evidence, suspect_segments

#: What the columns of the table hold.
ERROR_SWAPPED, SECONDS_SWAPPED = "1 - accuracy, trained on wrong labels", "training (CPU s)"
#: The share of the segments that get another action, how often they are drawn, and the share of
#: the segments that somebody looks through to find them.
SHARE, DRAWS, LOOKED = 0.05, 5, 0.1
#: Presets that are measured.
MEASURED = ("fast", "best")

#: A segment by the id of its demonstration and its start.
Place = tuple[str, float]


@dataclass
class _Found:
    """What came of the draws."""

    accuracies: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    wrong: int = 0
    noticed: int = 0
    peak_bytes: int = 0


def swapped(
    labelled: Sequence[LabelledDemonstration], random: np.random.Generator, share: float = SHARE
) -> tuple[list[LabelledDemonstration], set[Place]]:
    """Give some segments another action of the same task.

    `share`: of all segments; at least one is swapped. Gives `places`: the demonstration's id and
    the start of each swapped segment.
    """
    every = [(i, k) for i, item in enumerate(labelled) for k in range(len(item.segments))]
    actions = sorted({segment.action for item in labelled for segment in item.segments})
    if len(actions) < 2:
        raise InputError("Labels can be swapped between two actions; label another one.")
    result, places = list(labelled), set()
    for number in random.choice(len(every), max(1, round(share * len(every))), replace=False):
        i, k = every[number]
        segments = list(result[i].segments)
        others = [action for action in actions if action != segments[k].action]
        segments[k] = replace(segments[k], action=str(random.choice(others)))
        result[i] = replace(result[i], segments=tuple(segments))
        places.add((result[i].demonstration.id, segments[k].start))
    return result, places


def measuring_swapped(
    labelled: Sequence[LabelledDemonstration],
    size: str,
    settings: Settings,
    draws: int = DRAWS,
) -> Generator[Progress, None, Row]:
    """Measure what swapped labels do to one recogniser.

    `labelled`: those without a segment take no part; `size`: what the row calls them; `settings`:
    of a recogniser that has probabilities; `draws`: how often other segments are swapped. Gives
    `further` holds how many points of accuracy the wrong labels cost (negative: none), the mean
    over draws, with its standard error; the standard deviation between seeds of the accuracy with
    right labels, in points; how many segments were swapped in all, and which share of them stands
    in the first tenth.
    """
    used = require_labelled(labelled)
    examples = yield from prepare_all(used, settings)
    found, right = _Found(), _Found()
    for draw in range(draws):
        own = settings.replace(seed=(settings.seed + draw) % 2**32)
        yield Progress(2 * draw, 2 * draws, f"right labels: {draw + 1}")
        _drawn(used, used, set(), examples, own, right)
        yield Progress(2 * draw + 1, 2 * draws, f"swapped labels: {draw + 1}")
        wrong, places = swapped(used, np.random.default_rng([settings.seed, draw]))
        _drawn(used, wrong, places, examples, own, found)
    accuracy = float(np.mean(found.accuracies))
    lost = 100 * np.subtract(right.accuracies, found.accuracies)
    seconds, spread = median_and_spread(found.seconds)
    return Row(
        "swapped",
        settings.preset,
        size,
        f"the coder's labels of {len(used)} demonstrations; {100 * SHARE:.0f} % of the segments "
        f"swapped, {draws} draws",
        error=1 - accuracy,
        seconds=seconds,
        spread=spread,
        peak_bytes=right.peak_bytes,
        further={
            "points lost": float(lost.mean()),
            "standard error": _deviation(lost) / math.sqrt(draws),
            "between seeds": _deviation(100 * np.array(right.accuracies)),
            "swapped": float(found.wrong),
            "in the first tenth": found.noticed / found.wrong,
        },
    )


def _deviation(values: NDArray[np.float64]) -> float:
    """Standard deviation; 0 of a single one."""
    return float(values.std(ddof=1)) if len(values) > 1 else 0.0


def _drawn(
    right: Sequence[LabelledDemonstration],
    wrong: Sequence[LabelledDemonstration],
    places: set[Place],
    examples: Sequence[Examples],
    settings: Settings,
    found: _Found,
) -> None:
    """Train on some labels, score with the right ones, and look the suspects through."""
    learnt = [
        replace(example, segments=item.merged(settings.merge).segments)
        for example, item in zip(examples, wrong, strict=True)
    ]
    actions = actions_of(examples)
    counts: list[Counts] = []
    everything: list[ModelEvidence] = []
    taken = 0.0
    for i, item in enumerate(wrong):
        others = [*learnt[:i], *learnt[i + 1 :]]
        recogniser, fitted = measure_seconds(lambda: finish(fit_examples(others, settings)))  # noqa: B023
        taken += fitted
        if not found.peak_bytes:
            _, found.peak_bytes = measure_peak(lambda: recogniser.predict_examples(examples[0]))  # noqa: B023
        prediction = recogniser.predict_examples(examples[i], probability_trace=True)
        counts.append(
            held_out_prediction(right[i], examples[i], prediction, actions).counts("filtered")
        )
        everything.append(_evidence(item, learnt[i].segments, prediction, actions))
    found.accuracies.append(pool("", counts).accuracy or 0.0)
    found.seconds.append(taken)
    looked = math.ceil(LOOKED * sum(len(labelled.segments) for labelled in everything))
    segments = {labelled.demonstration: labelled.segments for labelled in everything}
    looked_at = {
        (suspect.demonstration, segment.start)
        for suspect in suspect_segments(everything, actions)[:looked]
        for segment in segments[suspect.demonstration]
        if segment.start <= suspect.start < segment.end
    }
    found.wrong += len(places)
    found.noticed += len(places & looked_at)


def _evidence(
    item: LabelledDemonstration,
    segments: Segments,
    prediction: Prediction,
    actions: tuple[str, ...],
) -> ModelEvidence:
    """What the model says about the labels of one demonstration."""
    result = DemonstrationResult.of(item.demonstration, prediction, segments)
    found = find_differences(result.id, segments, prediction.segments, prediction.probability_trace)
    return gather_evidence(result, segments, actions, found)
