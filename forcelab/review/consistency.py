"""A coder's own consistency, from one demonstration of a task to the next.

Nobody labels everything twice. But the demonstrations of a task repeat one choreography, so that a
duration or an order of actions that stands alone is worth a look. It need not be a mistake.

Source
------
Iglewicz and Hoaglin, "How to detect and handle outliers", ASQC 1993: the robust z and its 3.5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from forcelab.labels import Segment
from forcelab.review.coded import Coded
from forcelab.review.places import Place

__all__ = ["Consistency", "Durations", "consistency"]

#: The robust z beyond which a duration stands out, and how many segments it takes to say so.
STANDS_OUT, FEWEST = 3.5, 5
#: A transition of one demonstration is rare if so many have been labelled.
FEWEST_DEMONSTRATIONS = 3


@dataclass(frozen=True)
class Durations:
    """How long the segments of an action of a task are.

    Parameters
    ----------
    task, action : str
    count : int
        Segments.
    mean : float
        Seconds.
    variation : float or None
        Standard deviation over mean; None with fewer than two segments.
    """

    task: str
    action: str
    count: int
    mean: float
    variation: float | None


@dataclass(frozen=True)
class Consistency:
    """How much one coder's labels vary.

    Parameters
    ----------
    author : str
    actions : tuple of Durations
        By task, in the order of their first occurrence.
    odd : tuple of Place
        Segments whose duration stands out among those of their action, the oddest first.
    rare : tuple of Place
        Two actions in an order that no other demonstration of the task has; ``human`` is the first
        of them, ``predicted`` the second.
    """

    author: str
    actions: tuple[Durations, ...]
    odd: tuple[Place, ...]
    rare: tuple[Place, ...]

    def to_json(self) -> dict[str, Any]:
        """The figures as plain values."""
        return {
            "coder": self.author,
            "odd_durations": len(self.odd),
            "rare_transitions": len(self.rare),
            "durations": [
                {
                    "task": one.task,
                    "action": one.action,
                    "segments": one.count,
                    "mean_s": one.mean,
                    "variation": one.variation,
                }
                for one in self.actions
            ],
        }


def consistency(coded: Sequence[Coded], author: str) -> Consistency:
    """How much a coder's labels vary over the demonstrations of each task."""
    tasks = dict.fromkeys(one.task for one in coded if author in one.tracks)
    durations: list[Durations] = []
    odd: list[tuple[float, Place]] = []
    rare: list[Place] = []
    for task in tasks:
        theirs = (one for one in coded if one.task == task and author in one.tracks)
        tracks = {one.id: one.tracks[author] for one in theirs}
        by_action: dict[str, list[tuple[str, Segment]]] = {}
        for id_, segments in tracks.items():
            for segment in segments:
                by_action.setdefault(segment.action, []).append((id_, segment))
        for action, found in by_action.items():
            lengths = np.array([segment.duration for _, segment in found])
            mean = float(lengths.mean())
            variation = float(lengths.std(ddof=1)) / mean if len(lengths) > 1 else None
            durations.append(Durations(task, action, len(lengths), mean, variation))
            odd += _odd(found)
        rare += _rare(tracks)
    odd.sort(key=lambda item: -item[0])
    return Consistency(author, tuple(durations), tuple(place for _, place in odd), tuple(rare))


def _odd(found: Sequence[tuple[str, Segment]]) -> list[tuple[float, Place]]:
    """Segments of one action whose duration stands out, with their robust z."""
    lengths = np.array([segment.duration for _, segment in found])
    away = np.abs(lengths - np.median(lengths))
    deviation = float(np.median(away))
    if len(found) < FEWEST or deviation <= 0:
        return []
    scores = 0.6745 * away / deviation
    return [
        (float(z), Place(id_, segment.start, segment.end, segment.action))
        for z, (id_, segment) in zip(scores, found, strict=True)
        if z > STANDS_OUT
    ]


def _rare(tracks: dict[str, tuple[Segment, ...]]) -> list[Place]:
    """Orders of two actions that only one of the tracks has."""
    if len(tracks) < FEWEST_DEMONSTRATIONS:
        return []
    where: dict[tuple[str, str], set[str]] = {}
    for id_, segments in tracks.items():
        for left, right in pairwise(segments):
            where.setdefault((left.action, right.action), set()).add(id_)
    return [
        Place(id_, left.start, right.end, left.action, right.action)
        for id_, segments in tracks.items()
        for left, right in pairwise(segments)
        if len(where[left.action, right.action]) == 1
    ]
