"""Training without the segments that the other demonstrations contradict.

A coder who takes one action for another teaches a recogniser, and its decoder, something wrong. So
before a fit each training demonstration is heard through a few trees grown on the others; segments
of which these, and their neighbours, are nine in ten sure that they are another action are left
out (:mod:`forcelab.recognition.witnesses`). It is never more than a third of an action's segments,
and none of fewer than three: what is rare is not taken for wrong. Of the labels nothing changes.

With 5 % of the segments swapped, simulated LEGO tasks then cost `best` 0.5 points of accuracy
instead of 1.5; four in five of the swapped ones are found. `fast`, which goes without as its fit
time would double, loses 2.4, and would lose 0.8. Of right labels, 4 of 3800 were left out. On the
paper's stylus recordings, of which one or two segments go, twelve seeds of `best` lose 0.2 ± 0.2
points of accuracy and 0.5 ± 0.4 of the boundaries; on foam none goes.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.jobs import Progress
from forcelab.labels import UNLABELLED, Segment
from forcelab.recognition.examples import Examples, actions_of, gathering
from forcelab.recognition.learning import learnt_steps
from forcelab.recognition.settings import Settings
from forcelab.recognition.witnesses import MARGIN, Line, suspicions

__all__ = ["Contradicted", "remark_on", "trimming"]

Real = NDArray[np.float64]

#: From this suspicion on a segment is left out. From 0.5 on, 6 % of the right ones would be, and
#: accuracy on simulated tasks would fall by up to 0.8 points.
SURE = 0.9
#: At most one in so many of an action's segments is left out, rounded down.
ONE_IN = 3
#: Fewer demonstrations than that cannot outvote one of them.
FEWEST = 3
#: Demonstrations, or groups of them, that are heard through trees grown on the others, and trees.
FOLDS, TREES = 5, 20
#: Seconds from one sample that a tree is grown on to the next, and how many it takes at most.
APART, MOST = 0.1, 20_000
#: How many left-out segments a remark names.
NAMED = 3


@dataclass(frozen=True, slots=True)
class Contradicted:
    """A segment that was left out of training.

    Parameters
    ----------
    demonstration : str
        The name of its demonstration.
    segment : Segment
        The human's.
    other : str
        The action that most speaks for.
    """

    demonstration: str
    segment: Segment
    other: str


def trimming(
    examples: Sequence[Examples], settings: Settings
) -> Generator[Progress, None, tuple[list[Examples], tuple[Contradicted, ...]]]:
    """Leave out what the other demonstrations contradict, if the settings say so.

    Parameters
    ----------
    examples : sequence of Examples
        Of the training demonstrations.
    settings : Settings

    Yields
    ------
    Progress

    Returns
    -------
    examples : list of Examples
        The same, with fewer segments.
    left_out : tuple of Contradicted
        The segments that are gone, in order.
    """
    actions = actions_of(examples)
    if not settings.trimmed or len(examples) < FEWEST or len(actions) < 2:
        return list(examples), ()
    said = yield from _hearing(examples, actions, settings)
    gone = _chosen(examples, actions, said)
    kept = [
        replace(e, segments=tuple(s for k, s in enumerate(e.segments) if (i, k) not in gone))
        for i, e in enumerate(examples)
    ]
    return kept, tuple(
        Contradicted(examples[i].name, examples[i].segments[k], actions[gone[i, k]])
        for i, k in sorted(gone)
    )


def remark_on(left_out: Sequence[Contradicted]) -> tuple[str, ...]:
    """A remark on the segments that were left out; none where nothing was."""
    # Of several folds each segment once, whatever it was rather taken for.
    every = list({(c.demonstration, c.segment): c for c in left_out}.values())
    if not every:
        return ()
    named = ", ".join(
        f"{c.segment.action} of {c.demonstration} at {c.segment.start:.2f} s (rather {c.other})"
        for c in every[:NAMED]
    )
    more = f" and {len(every) - NAMED} more" if len(every) > NAMED else ""
    return (f"Not trained on, because the other demonstrations contradict it: {named}{more}.",)


def _hearing(
    examples: Sequence[Examples], actions: tuple[str, ...], settings: Settings
) -> Generator[Progress, None, list[Real]]:
    """Mean probability of each action over each segment, shape (segments, K), by the others.

    Zero throughout for a segment that no time step sees.
    """
    from sklearn.ensemble import ExtraTreesClassifier
    from threadpoolctl import threadpool_limits

    codes = [example.codes(actions) for example in examples]
    every = _every(codes, examples[0].rate, settings)
    y, groups, steps = learnt_steps(codes, every, every=True)
    (X,) = yield from gathering(examples, steps)
    said = [np.zeros((len(e.segments), len(actions))) for e in examples]
    count = min(FOLDS, len(examples))
    done = 0
    for first in range(count):
        others = groups % count != first
        known = y[others]
        trees = None
        if len(np.unique(known)) > 1:
            with threadpool_limits(1):
                trees = ExtraTreesClassifier(TREES, random_state=settings.seed)
                trees.fit(X[others], known)
        for i in range(first, len(examples), count):
            if trees is not None:
                with threadpool_limits(1):
                    said[i][:, trees.classes_] = _means(examples[i], trees)
            done += 1
            yield Progress(done, len(examples), "contradictions")
    return said


def _every(codes: Sequence[NDArray[np.int64]], rate: float, settings: Settings) -> int:
    """Every how many-th time step trees are grown on."""
    labelled = sum(int(np.count_nonzero(own != UNLABELLED)) for own in codes)
    apart = round(APART * rate / settings.hop(rate))
    return max(settings.stride, apart, math.ceil(labelled / MOST), 1)


def _means(examples: Examples, trees: Any) -> Real:
    """Mean probabilities over the middle of each segment, shape (segments, actions learnt)."""
    found = trees.predict_proba(examples.all_features())
    found[~examples.valid] = 0.0
    sums = np.concatenate([np.zeros((1, found.shape[1])), np.cumsum(found, axis=0)])
    seen = np.concatenate([[0], np.cumsum(examples.valid)])
    margins = np.array([MARGIN * s.duration for s in examples.segments])
    starts = np.array([s.start for s in examples.segments]) + margins
    ends = np.array([s.end for s in examples.segments]) - margins
    first, last = (np.searchsorted(examples.times, at) for at in (starts, ends))
    steps = seen[last] - seen[first]
    return (sums[last] - sums[first]) / np.maximum(steps, 1)[:, None]


def _chosen(
    examples: Sequence[Examples], actions: tuple[str, ...], said: Sequence[Real]
) -> dict[tuple[int, int], int]:
    """Which segments are left out, by demonstration and number, and the code they rather have."""
    number = {action: code for code, action in enumerate(actions)}
    codes = [
        [number[s.action] if row.any() else UNLABELLED for s, row in zip(e.segments, own)]  # noqa: B905
        for e, own in zip(examples, said, strict=True)
    ]
    every = [(i, k) for i, e in enumerate(examples) for k in range(len(e.segments))]
    line = Line(codes)
    if len(line.known) == 0:
        return {}
    total = Counter(code for own in codes for code in own)
    gone: dict[tuple[int, int], int] = {}
    less: Counter[int] = Counter()
    found = suspicions(np.concatenate(said)[line.known], line)
    for place, other, suspicion in sorted(found, key=lambda one: (-one[2], one[0])):
        if suspicion < SURE:
            break
        i, k = every[place]
        own = codes[i][k]
        if less[own] < total[own] // ONE_IN:
            less[own] += 1
            gone[i, k] = other
    return gone
