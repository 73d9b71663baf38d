"""Whether it pays to label the demonstration next that is proposed, beside any other.

The demonstrations of a task are parted at random: a third is tested, two are labelled, and the rest
waits. Then one after the other is labelled, with a recogniser trained in between: the one that it
is least certain of, as a review proposes them; or any, at random. Both orders begin with the same
two and are tested on the same third, so that they compare turn by turn.

It does not, and no other rule does on all recordings. In forty partings of the paper's recordings,
ten of each task, preset ``fast`` with filters in place of its decoder, the least certain first lose
1.4 points of accuracy (standard error 0.4) on stylus, for the odd ones come first, and gain 0.1
(0.2) on soft; uncertainty times likeness to the others (Settles and Craven, EMNLP 2008) loses 0.3
(0.4) and gains 0.3 (0.1). In twenty partings of these and of four simulated tasks, trees without a
decoder, neither of them, nor likeness alone, nor what leaves the others nearest to one that is
labelled gains on all six: the ends are -0.9 (0.5) and 0.9 (0.4).
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from forcelab.errors import InputError
from forcelab.jobs import Progress, finish
from forcelab.measure.recognition import median_and_spread
from forcelab.measure.rows import Row, with_front
from forcelab.measure.timing import measure_peak, measure_seconds
from forcelab.recognition.cross_validation import held_out_prediction
from forcelab.recognition.examples import Examples, LabelledDemonstration, actions_of
from forcelab.recognition.metrics import pool
from forcelab.recognition.presets import PRESETS
from forcelab.recognition.recogniser import Recogniser
from forcelab.recognition.settings import Settings
from forcelab.recognition.training import fit_examples, prepare_all
from forcelab.review.active_learning import uncertainty
from forcelab.text import there_are

#: What the columns of the table hold.
ERROR_NEXT, SECONDS_NEXT = "1 - accuracy, mean over what is labelled", "choosing (CPU s)"
#: Demonstrations that are labelled at first, random partings, and demonstrations labelled in each.
FIRST, TURNS, ADDED = 2, 6, 4
#: The least demonstrations: one is tested, and of two there is one to be chosen.
LEAST = FIRST + 3
#: The order that is compared with.
RANDOM = "at random"

#: Takes a recogniser and demonstrations that are not labelled; gives each its urgency.
Urgency = Callable[[Recogniser, Sequence[Examples]], Sequence[float]]


def _least_certain(recogniser: Recogniser, waiting: Sequence[Examples]) -> list[float]:
    """The mean of one minus the probability of the most probable action."""
    found = (
        recogniser.predict_examples(item, probability_trace=True).probability_trace
        for item in waiting
    )
    return [0.0 if certainty is None else uncertainty(certainty) for certainty in found]


#: Orders by name; at random where there is no urgency.
CHOOSING: dict[str, Urgency | None] = {
    "least certain": _least_certain,
    RANDOM: None,
}


@dataclass
class _Course:
    """What came of an order: one minus accuracy after each labelling, turn by turn."""

    errors: list[list[float]] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    peak_bytes: int = 0


def measuring_next(
    labelled: Sequence[LabelledDemonstration],
    size: str,
    settings: Settings = PRESETS["fast"],
    turns: int = TURNS,
) -> Generator[Progress, None, tuple[Row, ...]]:
    """Measure the orders in which demonstrations may be labelled.

    `labelled`: those without a segment take no part; `size`: what the rows call them; `settings`:
    of a recogniser that has probabilities; `turns`: partings; each draws its own. Gives one for
    each order. `further` holds how many points of accuracy are gained beside an order at random
    (negative: lost), the mean over turns, with its standard error, and the accuracy after the last
    labelling.
    """
    used = [item for item in labelled if item.segments]
    if len(used) < LEAST:
        raise InputError(
            f"What to label next is measured with {LEAST} labelled demonstrations; "
            f"{there_are(len(used))}. Label more."
        )
    examples = yield from prepare_all(used, settings)
    courses = {name: _Course() for name in CHOOSING}
    total = turns * len(CHOOSING)
    for turn in range(turns):
        random = np.random.default_rng([settings.seed, turn])
        order = random.permutation(len(used)).tolist()
        tested = order[: max(1, len(used) // 3)]
        rest = order[len(tested) :]
        for number, (name, urgency) in enumerate(CHOOSING.items()):
            yield Progress(turn * len(CHOOSING) + number, total, f"{name}: turn {turn + 1}")
            choice = np.random.default_rng([settings.seed, turn, 1])
            _labelling(used, examples, (tested, rest), settings, urgency, courses[name], choice)
    against = (
        f"the coder's labels of a third of {len(used)} demonstrations, mean after each labelling, "
        f"{turns} random partings"
    )
    return with_front([_row(name, courses, size, against) for name in CHOOSING])


def _labelling(
    used: Sequence[LabelledDemonstration],
    examples: Sequence[Examples],
    parts: tuple[list[int], list[int]],
    settings: Settings,
    urgency: Urgency | None,
    course: _Course,
    random: np.random.Generator,
) -> None:
    """Label one demonstration after the other; `parts` are places of the tested and of the rest."""
    tested, rest = parts
    known, waiting = rest[:FIRST], rest[FIRST:]
    recogniser = finish(fit_examples([examples[i] for i in known], settings))
    errors = []
    for _ in range(min(ADDED, len(waiting))):
        # Whoever chooses must not know the labels, nor how many there are.
        bare = [replace(examples[i], segments=()) for i in waiting]
        chosen = _chosen(urgency, recogniser, bare, course, random)
        known = [*known, waiting.pop(chosen)]
        recogniser = finish(fit_examples([examples[i] for i in known], settings))
        errors.append(1 - _accuracy(recogniser, used, examples, tested))
    course.errors.append(errors)


def _chosen(
    urgency: Urgency | None,
    recogniser: Recogniser,
    waiting: Sequence[Examples],
    course: _Course,
    random: np.random.Generator,
) -> int:
    """The place of the demonstration that is labelled next; notes what choosing it cost."""
    if urgency is None:
        return int(random.integers(len(waiting)))
    if not course.seconds:
        _, course.peak_bytes = measure_peak(lambda: urgency(recogniser, waiting))
    found, taken = measure_seconds(lambda: urgency(recogniser, waiting))
    course.seconds.append(taken)
    return int(np.argmax(found))


def _accuracy(
    recogniser: Recogniser,
    used: Sequence[LabelledDemonstration],
    examples: Sequence[Examples],
    tested: Sequence[int],
) -> float:
    """Pooled accuracy of what was decoded or filtered."""
    actions = actions_of(examples)
    counts = [
        held_out_prediction(
            used[i], examples[i], recogniser.predict_examples(examples[i]), actions
        ).counts("filtered")
        for i in tested
    ]
    return pool("", counts).accuracy or 0.0


def _row(name: str, courses: dict[str, _Course], size: str, against: str) -> Row:
    course = courses[name]
    errors = np.array(course.errors)
    gains = np.array(courses[RANDOM].errors).mean(axis=1) - errors.mean(axis=1)
    deviation = float(gains.std(ddof=1) / np.sqrt(len(gains))) if len(gains) > 1 else 0.0
    seconds, spread = median_and_spread(course.seconds or [0.0])  # to draw at random takes none
    return Row(
        "next",
        name,
        size,
        against,
        error=float(errors.mean()),
        seconds=seconds,
        spread=spread,
        peak_bytes=course.peak_bytes,
        further={
            "points gained": 100 * float(gains.mean()),
            "standard error": 100 * deviation,
            "accuracy at the end": float(1 - errors[:, -1].mean()),
        },
    )
