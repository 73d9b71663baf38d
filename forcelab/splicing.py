"""What an edit changed: the smallest run of segments that another one took the place of."""

from __future__ import annotations

from itertools import pairwise

from forcelab.errors import StaleTrackError
from forcelab.labels import Segments

__all__ = ["splice", "spliced"]

#: Segments that are compared at once.
BLOCK = 256


def splice(before: Segments, after: Segments) -> tuple[int, Segments, Segments]:
    """Find the smallest replacement that turns one tuple into another.

    Returns
    -------
    position : int
        Where the replacement starts.
    removed : tuple of Segment
        What lay there before.
    inserted : tuple of Segment
        What lies there after. Swapped with `removed`, it undoes the edit.
    """
    shorter = min(len(before), len(after))
    head = _agreeing(before, after, shorter)
    tail = _agreeing(before[head:][::-1], after[head:][::-1], shorter - head)
    return head, before[head : len(before) - tail], after[head : len(after) - tail]


def spliced(segments: Segments, position: int, removed: Segments, inserted: Segments) -> Segments:
    """Carry out a replacement found by :func:`splice`.

    Raises
    ------
    StaleTrackError
        If `removed` does not lie at `position`, or `inserted` does not fit between its neighbours:
        the track is not the one that the replacement was made for.
    """
    end = position + len(removed)
    there = position >= 0 and end <= len(segments) and segments[position:end] == removed
    result = segments[:position] + inserted + segments[end:] if there else ()
    around = result[max(position - 1, 0) : position + len(inserted) + 1]
    if not there or any(b.start < a.end for a, b in pairwise(around)):
        raise StaleTrackError(
            "The track was changed since it was read, so the edit was left out; look at the track "
            "as it is now and repeat the edit."
        )
    return result


def _agreeing(one: Segments, other: Segments, count: int) -> int:
    """How many segments are equal before the first that is not, out of `count`."""
    # Most segments of an edited track are the very same object: whole blocks of them are compared
    # faster than a loop looks at one.
    same = 0
    while same < count and one[same : same + BLOCK] == other[same : same + BLOCK]:
        same += BLOCK
    # The first that differs lies in the half whose slices do.
    width = BLOCK
    while width > 1:
        width //= 2
        if one[same : same + width] == other[same : same + width]:
            same += width
    return min(same, count)
