"""A coder's own consistency, from one demonstration of a task to the next.

Coders do not label everything twice, but the demonstrations of a task repeat one choreography, so
that a duration or an order of actions that stands alone is worth a look. It need not be a mistake.
The robust z and its 3.5 are those of Iglewicz and Hoaglin, "How to detect and handle outliers",
ASQC 1993.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from forcelab.labels import Interval, Segment
from forcelab.review.coder_tracks import CoderTracks

#: The robust z beyond which a duration stands out, and how many segments it takes to say so.
STANDS_OUT, FEWEST_SEGMENTS = 3.5, 5
#: A transition of one demonstration is rare if so many have been labelled.
FEWEST_DEMONSTRATIONS = 3


@dataclass(frozen=True)
class Durations:
    """Durations of the segments of an action of a task."""

    task: str
    action: str
    count: int  # segments
    mean: float  # seconds
    variation: float | None  # standard deviation over mean; None with fewer than two segments


@dataclass(frozen=True)
class Consistency:
    """The variation of one coder's labels."""

    author: str
    actions: tuple[Durations, ...]  # by task, in the order of their first occurrence
    #: Segments whose duration stands out among those of their action, the oddest first
    odd: tuple[Interval, ...]
    #: Two actions in an order that no other demonstration of the task has; ``human`` is the first
    #: of them, ``predicted`` the second
    rare: tuple[Interval, ...]

    def to_json(self) -> dict[str, Any]:
        """The figures as plain values."""
        return {
            "coder": self.author,
            "odd_durations": len(self.odd),
            "rare_transitions": len(self.rare),
            "durations": [
                {
                    "task": row.task,
                    "action": row.action,
                    "segments": row.count,
                    "mean_s": row.mean,
                    "variation": row.variation,
                }
                for row in self.actions
            ],
        }


def consistency(coded: Sequence[CoderTracks], author: str) -> Consistency:
    """The variation of a coder's labels over the demonstrations of each task."""
    tasks = dict.fromkeys(item.task for item in coded if author in item.tracks)
    durations: list[Durations] = []
    odd: list[tuple[float, Interval]] = []
    rare: list[Interval] = []
    for task in tasks:
        coded_by_author = (item for item in coded if item.task == task and author in item.tracks)
        tracks = {item.id: item.tracks[author] for item in coded_by_author}
        by_action: dict[str, list[tuple[str, Segment]]] = {}
        for id_, segments in tracks.items():
            for segment in segments:
                by_action.setdefault(segment.action, []).append((id_, segment))
        for action, coded_segments in by_action.items():
            lengths = np.array([segment.duration for _, segment in coded_segments])
            mean = float(lengths.mean())
            variation = float(lengths.std(ddof=1)) / mean if len(lengths) > 1 else None
            durations.append(Durations(task, action, len(lengths), mean, variation))
            odd += _odd_durations(coded_segments)
        rare += _rare_transitions(tracks)
    odd.sort(key=lambda item: -item[0])
    return Consistency(author, tuple(durations), tuple(place for _, place in odd), tuple(rare))


def _odd_durations(segments: Sequence[tuple[str, Segment]]) -> list[tuple[float, Interval]]:
    """Segments of one action whose duration stands out, with their robust z."""
    lengths = np.array([segment.duration for _, segment in segments])
    away = np.abs(lengths - np.median(lengths))
    deviation = float(np.median(away))
    if len(segments) < FEWEST_SEGMENTS or deviation <= 0:
        return []
    scores = 0.6745 * away / deviation
    return [
        (float(z), Interval(id_, segment.start, segment.end, segment.action))
        for z, (id_, segment) in zip(scores, segments, strict=True)
        if z > STANDS_OUT
    ]


def _rare_transitions(tracks: dict[str, tuple[Segment, ...]]) -> list[Interval]:
    """Orders of two actions that only one of the tracks has."""
    if len(tracks) < FEWEST_DEMONSTRATIONS:
        return []
    where: dict[tuple[str, str], set[str]] = {}
    for id_, segments in tracks.items():
        for left, right in pairwise(segments):
            where.setdefault((left.action, right.action), set()).add(id_)
    return [
        Interval(id_, left.start, right.end, left.action, right.action)
        for id_, segments in tracks.items()
        for left, right in pairwise(segments)
        if len(where[left.action, right.action]) == 1
    ]
