"""Where one action gives way to another, learnt by itself.

Trees that tell actions apart are grown on labelled time, and where one action gives way to another
coders mostly leave a little unlabelled. What happens just there, a contact, a slip or a snap, they
hardly see. So some more trees are grown on all the time around: they tell what lies near such a
change from what does not. The decoder changes the action where a change is likelier than usual.

Over simulated tasks, five of them and six seeds of five demonstrations each, `best` gains 0.5 ± 0.1
points of accuracy by it, and 1.5 ± 0.6 of the boundaries found within 100 ms; `fast` as much. On
the paper's recordings, over eight seeds of `best`, accuracy stays (0.2 ± 0.4 and 0.0 ± 0.1); of the
boundaries of the stylus 3.4 ± 1.3 points more are found, of foam's forty 1.3 ± 1.0 fewer.

A stream is decoded without: :mod:`forcelab.recognition.live_part` says what it has instead.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.jobs import Progress, finish
from forcelab.labels import UNLABELLED, Segment, Segments
from forcelab.recognition.averaged import Averaged
from forcelab.recognition.choreography import HOLE
from forcelab.recognition.examples import Examples
from forcelab.recognition.forest import must
from forcelab.recognition.learning import Care, fitting_averaged, learnt_steps
from forcelab.recognition.settings import Settings

__all__ = ["Changes", "fitting_changes", "near_changes"]

Real = NDArray[np.float64]
Whole = NDArray[np.int64]

#: Seconds to either side of a change that are near it: about what coders differ by.
NEAR = 0.06
#: Trees of a forest; half of them where only every few samples are learnt from, for a quick fit:
#: over the simulated tasks that finds 0.5 points fewer boundaries.
TREES = 50
#: Probabilities below this count as this: one of the trees may always say so.
LEAST = 0.02
#: Of fewer changes nothing is learnt but what these happened to look like.
FEWEST = 3


@dataclass(frozen=True, eq=False)
class Changes:
    """What tells time steps near a change of actions from others.

    Parameters
    ----------
    classifier : Averaged
        Of two codes, 1 being near a change.
    share : float
        Of the time steps that it was trained on, how many are near one, 0 to 1.
    """

    classifier: Averaged
    share: float

    def ratios(self, features: Real) -> Real:
        """How much likelier than usual a change is near, as a logarithm; of rows, shape (n,)."""
        near = self.classifier.predict_proba(features)[:, 1]
        return np.asarray(np.log(np.maximum(near, LEAST) / self.share))

    def plain(self) -> dict[str, Any]:
        """Arrays, numbers and lists, from which :meth:`from_plain` makes an equal one."""
        return {"classifier": self.classifier.plain(), "share": self.share}

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any], width: int) -> Changes:
        """Check what was read from a file, of so many features.

        Raises
        ------
        ValueError
            If anything does not fit together.
        """
        share = float(plain["share"])
        must(0 < share < 1, "a share near changes between 0 and 1")
        return cls(Averaged.from_plain(plain["classifier"], width, 2), share)


def near_changes(examples: Sequence[Examples], settings: Settings) -> tuple[Whole, list[Whole]]:
    """Which time steps tell where actions change.

    Parameters
    ----------
    examples : sequence of Examples
        Of the training demonstrations.
    settings : Settings

    Returns
    -------
    y : ndarray of int64, shape (m,)
        1 near a change, 0 elsewhere; empty where nobody asks, or hardly any action gives way to
        another.
    steps : list of ndarray of int64
        Their places in each demonstration.
    """
    asked = settings.changes and settings.decodes
    if not asked or sum(len(_changes(example.segments)) for example in examples) < FEWEST:
        none = np.empty(0, dtype=np.int64)
        return none, [none] * len(examples)
    y, _, steps = learnt_steps([_near(example) for example in examples], settings.stride)
    return y, steps


def fitting_changes(
    X: Real, y: Whole, settings: Settings
) -> Generator[Progress, None, Changes | None]:
    """Learn where actions change; yields progress.

    Parameters
    ----------
    X : ndarray, shape (m, f)
        Features of the time steps that :func:`near_changes` names.
    y : ndarray of int64, shape (m,)
    settings : Settings

    Returns
    -------
    Changes or None
        None where there is no time step near a change, or no other.
    """
    if len(np.unique(y)) < 2:
        return None
    yield Progress(0, 1, "changes")
    trees = TREES if settings.stride == 1 else TREES // 2
    made = finish(fitting_averaged("extra-trees", X, y, settings.seed, Care(trees=trees)))
    return Changes(made, float(y.mean()))


def _near(example: Examples) -> Whole:
    """1 for each time step near a change, 0 for others, -1 where no coder says; shape (n,).

    The middle of a short hole between two actions is where they change, and it counts as seen.
    """
    near = np.full(len(example.times), UNLABELLED, dtype=np.int64)
    holes = [(a.end, b.start) for a, b in _meeting(example.segments)]
    for span in [(s.start, s.end) for s in example.segments] + holes:
        near[slice(*np.searchsorted(example.times, span))] = 0
    for change in _changes(example.segments):
        near[(np.abs(example.times - change) <= NEAR) & (near == 0)] = 1
    near[~example.valid] = UNLABELLED
    return near


def _meeting(segments: Segments) -> list[tuple[Segment, Segment]]:
    """Neighbours with no more than a short hole between them."""
    return [(a, b) for a, b in pairwise(segments) if b.start - a.end <= HOLE]


def _changes(segments: Segments) -> list[float]:
    """When one action gives way to another, in seconds."""
    return [0.5 * (a.end + b.start) for a, b in _meeting(segments) if a.action != b.action]
