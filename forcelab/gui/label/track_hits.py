"""What lies under the pointer on a track. No Qt here."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from operator import attrgetter
from typing import Literal

from forcelab.labels import Segments

__all__ = ["EDGE_REACH", "Hit", "edge_beside", "gap_at", "hit", "index_at"]

#: How near to an edge it is grabbed, in pixels.
EDGE_REACH = 5.0
#: Segments narrower than this many pixels can be hit from a pixel beside them.
TINY = 2.0

Edge = Literal["start", "end"]

_start = attrgetter("start")
_end = attrgetter("end")


@dataclass(frozen=True, slots=True)
class Hit:
    """What lies under the pointer.

    Parameters
    ----------
    index : int or None
        Which segment; None on unlabelled time.
    edge : "start", "end" or None
        Which of its edges, where one can be grabbed.
    inside : bool
        Whether the pointer is on the segment itself, and not beside its edge.
    """

    index: int | None = None
    edge: Edge | None = None
    inside: bool = False


def index_at(segments: Segments, time: float) -> int | None:
    """The segment that covers a time in seconds, if one does."""
    index = bisect_right(segments, time, key=_end)
    return index if index < len(segments) and segments[index].start <= time else None


def gap_at(segments: Segments, time: float) -> tuple[float, float] | None:
    """The unlabelled stretch between two segments around a time, in seconds, if there is one."""
    index = bisect_right(segments, time, key=_end)
    if 0 < index < len(segments) and time < segments[index].start:
        return segments[index - 1].end, segments[index].start
    return None


def edge_beside(segments: Segments, time: float, reach: float) -> float | None:
    """The nearest edge of the unlabelled stretch around a time; None beyond `reach` seconds."""
    index = bisect_right(segments, time, key=_end)
    if index < len(segments) and segments[index].start <= time:
        return None
    edges = [segment.end for segment in segments[max(index - 1, 0) : index]]
    edges += [segment.start for segment in segments[index : index + 1]]
    nearest = min(edges, key=lambda edge: abs(edge - time), default=None)
    return nearest if nearest is not None and abs(nearest - time) <= reach else None


def hit(segments: Segments, time: float, pixel: float) -> Hit:
    """Find what is under the pointer.

    An edge is grabbed from :data:`EDGE_REACH` pixels on either side, but never from more than a
    third of the segment or of the unlabelled stretch there, so that both stay within reach
    however narrow. A segment narrower than :data:`TINY` pixels is hit from one pixel beside it.

    Parameters
    ----------
    segments : tuple of Segment
        In order, never overlapping.
    time : float
        Where the pointer is, in seconds.
    pixel : float
        Seconds in one pixel.

    Returns
    -------
    Hit
        Found in O(log n).
    """
    index = bisect_right(segments, time, key=_end)
    tiny = _tiny(segments, time, pixel)
    if tiny is not None:
        return Hit(tiny, None, inside=True)
    if index < len(segments) and segments[index].start <= time:
        here = segments[index]
        zone = min(EDGE_REACH * pixel, here.duration / 3)
        if time - here.start <= zone:
            return Hit(index, "start", inside=True)
        return Hit(index, "end" if here.end - time <= zone else None, inside=True)
    before = segments[index - 1].end if index else float("-inf")
    after = segments[index].start if index < len(segments) else float("inf")
    zone = min(EDGE_REACH * pixel, (after - before) / 3)
    if time - before <= zone:
        return Hit(index - 1, "end")
    return Hit(index, "start") if after - time <= zone else Hit()


def _tiny(segments: Segments, time: float, pixel: float) -> int | None:
    """The tiny segment whose middle is nearest to a time, within a pixel."""
    first = bisect_left(segments, time - 2 * pixel, key=_end)
    last = bisect_right(segments, time + 2 * pixel, key=_start)
    # Where hundreds crowd in a pixel nobody can point at one: those around the time will do.
    middle = bisect_left(segments, time, key=_start)
    near = range(max(first, middle - 2), min(last, middle + 2))
    tiny = [
        i
        for i in near
        if segments[i].duration < TINY * pixel
        and abs((segments[i].start + segments[i].end) / 2 - time) <= pixel
    ]
    return min(
        tiny, key=lambda i: abs((segments[i].start + segments[i].end) / 2 - time), default=None
    )
