"""Where two coders put the same boundary, and how far apart.

A boundary is the start of a segment, or the end of one after which time is unlabelled: where two
segments touch, the end of the first is the start of the second and counts once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.labels import Segments
from forcelab.segment_edits import SLIVER

__all__ = ["WINDOW", "Boundaries", "boundaries", "match_boundaries"]

#: Seconds up to which two boundaries of the same kind may be the same one.
WINDOW = 0.5

#: A boundary's kind: whether an action starts or ends, and which.
_Kind = tuple[bool, str]


@dataclass(frozen=True, eq=False)
class Boundaries:
    """Matched boundaries of two tracks; m pairs.

    Parameters
    ----------
    times : ndarray of float64, shape (m, 2)
        Seconds, of the first and the second track.
    actions : tuple of str, length m
        What starts or ends there.
    starting : tuple of bool, length m
        Whether it starts.
    counts : tuple of int
        How many boundaries each of the two has.
    """

    times: NDArray[np.float64]
    actions: tuple[str, ...]
    starting: tuple[bool, ...]
    counts: tuple[int, int]

    @property
    def offsets(self) -> NDArray[np.float64]:
        """Milliseconds by which the second track is later, shape (m,)."""
        return 1000.0 * (self.times[:, 1] - self.times[:, 0])


def boundaries(segments: Segments) -> dict[_Kind, list[float]]:
    """The times of every kind of boundary of a track, increasing.

    Touching segments of one action are one: nobody sees a boundary between them.
    """
    found: dict[_Kind, list[float]] = {}
    for index, segment in enumerate(segments):
        before = segments[index - 1] if index else None
        after = segments[index + 1] if index + 1 < len(segments) else None
        touched = before is not None and segment.start - before.end <= SLIVER
        if not (touched and before is not None and before.action == segment.action):
            found.setdefault((True, segment.action), []).append(segment.start)
        if after is None or after.start - segment.end > SLIVER:
            found.setdefault((False, segment.action), []).append(segment.end)
    return found


def match_boundaries(a: Segments, b: Segments, window: float = WINDOW) -> Boundaries:
    """Match boundaries of the same kind, the nearest first, each at most once.

    Parameters
    ----------
    a, b : tuple of Segment
        Two tracks.
    window : float
        Seconds that two matched ones are apart at most.
    """
    ours, theirs = boundaries(a), boundaries(b)
    rows: list[tuple[float, float, _Kind]] = []
    for kind in ours.keys() & theirs.keys():
        rows += [(s, t, kind) for s, t in _nearest(ours[kind], theirs[kind], window)]
    rows.sort()
    return Boundaries(
        times=np.array([row[:2] for row in rows], dtype=np.float64).reshape(-1, 2),
        actions=tuple(action for _, _, (_, action) in rows),
        starting=tuple(starting for _, _, (starting, _) in rows),
        counts=(sum(map(len, ours.values())), sum(map(len, theirs.values()))),
    )


def _nearest(ours: list[float], theirs: list[float], window: float) -> list[tuple[float, float]]:
    """Pairs of times, the nearest first; which track is the first makes no difference."""
    all_theirs = np.array(theirs)
    near = []
    for i, time in enumerate(ours):
        low, high = np.searchsorted(all_theirs, [time - window, time + window])
        # Rounded, so that the last bits of two equal distances do not decide.
        near += [
            (round(abs(theirs[j] - time), 9), time + theirs[j], i, j)
            for j in range(max(int(low) - 1, 0), min(int(high) + 1, len(theirs)))
        ]
    used_ours: set[int] = set()
    used_theirs: set[int] = set()
    pairs = []
    for distance, _, i, j in sorted(near):
        if distance <= window and i not in used_ours and j not in used_theirs:
            used_ours.add(i)
            used_theirs.add(j)
            pairs.append((ours[i], theirs[j]))
    return pairs
