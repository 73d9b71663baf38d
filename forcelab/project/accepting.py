"""Taking predicted segments over into a coder's track, as pure functions on tuples."""

from __future__ import annotations

from bisect import bisect_right
from operator import attrgetter

from forcelab.labels import Segment, Segments, ordered
from forcelab.segment_edits import SLIVER, paint

__all__ = ["free_parts", "paint_all"]

_end = attrgetter("end")


def paint_all(segments: Segments, proposed: Segments) -> tuple[Segments, Segments]:
    """Paint segments one after the other, in one pass over the track.

    Parameters
    ----------
    segments : tuple of Segment
        The track, in order, never overlapping.
    proposed : tuple of Segment
        What is painted over it, never overlapping.

    Returns
    -------
    after : tuple of Segment
        As :func:`forcelab.segment_edits.paint` makes it of the track, called for each in turn.
    painted : tuple of Segment
        Those of `proposed` that were not there already.

    Raises
    ------
    InputError
        If proposed segments overlap.
    """
    done: list[Segment] = []
    painted = []
    taken = 0
    for new in ordered(proposed):
        while taken < len(segments) and segments[taken].start <= new.end + SLIVER:
            done.append(segments[taken])
            taken += 1
        # All that the new one overlaps or touches stands at the end of what is done.
        first = len(done)
        while first and done[first - 1].end >= new.start - SLIVER:
            first -= 1
        before = tuple(done[first:])
        after = paint(before, new.start, new.end, new.action)
        if after != before:
            painted.append(new)
            done[first:] = after
    done.extend(segments[taken:])
    return tuple(done), tuple(painted)


def free_parts(segments: Segments, proposed: Segments) -> Segments:
    """Cut proposed segments so that they cover only time that no segment covers.

    Parameters
    ----------
    segments : tuple of Segment
        The track, in order, never overlapping.
    proposed : tuple of Segment
        What is cut; a segment may lose all of itself, or become several.
    """
    parts = []
    for new in proposed:
        start = new.start
        for index in range(bisect_right(segments, new.start, key=_end), len(segments)):
            there = segments[index]
            if there.start >= new.end:
                break
            if there.start - start > SLIVER:
                parts.append(Segment(start, there.start, new.action))
            start = there.end
        if new.end - start > SLIVER:
            parts.append(Segment(start, new.end, new.action))
    return tuple(parts)
