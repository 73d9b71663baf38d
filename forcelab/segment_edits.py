"""Every way to change a track's segments, as pure functions on tuples, and what an edit changed.

Each verb takes segments in order and never overlapping, and gives a new tuple of the same kind;
what it was given stays as it is. Times are in seconds, and segments are counted from 0. What cannot
be done, as there is no such segment or a stretch is empty, is an `InputError`. What lasts no longer
than :data:`SLIVER` is float dust: a piece that short is dropped, and a hole that short counts as
none, so that segments on either side of it touch.

The cost of a verb is one copy of the tuple; only :func:`fill_gaps` looks at every segment. What a
verb changed is told by :func:`splice`.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from dataclasses import replace
from itertools import pairwise
from operator import attrgetter
from typing import Literal

from forcelab.errors import InputError, StaleTrackError
from forcelab.labels import Segment, Segments, ordered
from forcelab.text import counted

#: Segments that are compared at once.
BLOCK = 256


def splice(before: Segments, after: Segments) -> tuple[int, Segments, Segments]:
    """Find the smallest replacement that turns one tuple into another.

    Gives where it starts, what lay there before, and what lies there after. The two swapped undo
    the edit.
    """
    shorter = min(len(before), len(after))
    head = _agreeing(before, after, shorter)
    tail = _agreeing(before[head:][::-1], after[head:][::-1], shorter - head)
    return head, before[head : len(before) - tail], after[head : len(after) - tail]


def spliced(segments: Segments, position: int, removed: Segments, inserted: Segments) -> Segments:
    """Carry out a replacement found by :func:`splice`.

    `StaleTrackError` if `removed` does not lie at `position`, or `inserted` does not fit between
    its neighbours: the track is not the one that the replacement was made for.
    """
    end = position + len(removed)
    fits = position >= 0 and end <= len(segments) and segments[position:end] == removed
    result = segments[:position] + inserted + segments[end:] if fits else ()
    around = result[max(position - 1, 0) : position + len(inserted) + 1]
    if not fits or any(b.start < a.end for a, b in pairwise(around)):
        raise StaleTrackError(
            "The track was changed since it was read, so the edit was left out; look at the track "
            "as it is now and repeat the edit."
        )
    return result


def _agreeing(old: Segments, new: Segments, count: int) -> int:
    """How many segments are equal before the first that is not, out of `count`."""
    # Most segments of an edited track are the very same object: whole blocks of them are compared
    # faster than a loop looks at one.
    same = 0
    while same < count and old[same : same + BLOCK] == new[same : same + BLOCK]:
        same += BLOCK
    # The first that differs lies in the half whose slices do.
    width = BLOCK
    while width > 1:
        width //= 2
        if old[same : same + width] == new[same : same + width]:
            same += width
    return min(same, count)


#: Seconds up to which two times are the same, and a piece or a hole between them is float dust: far
#: below any sample period, far above the rounding of times of a day-long recording (1.5e-11 s).
SLIVER = 1e-9

_start = attrgetter("start")
_end = attrgetter("end")


def paint(segments: Segments, start: float, end: float, action: str) -> Segments:
    """Paint an action over ``[start, end)``.

    What is below is trimmed, split or removed. Segments of the same action that overlap or touch
    the painted stretch become one with it; segments further off that touch only those do not.
    """
    _check_stretch(start, end)
    first = bisect_left(segments, start - SLIVER, key=_end)
    last = bisect_right(segments, end + SLIVER, key=_start)
    same = [segment for segment in segments[first:last] if segment.action == action]
    if same:
        start, end = min(start, same[0].start), max(end, same[-1].end)
    return _placed(segments, Segment(start, end, action))


def erase(segments: Segments, start: float, end: float) -> Segments:
    """Make ``[start, end)`` unlabelled; segments that reach into it are trimmed or split."""
    _check_stretch(start, end)
    before, after = _around(segments, start, end)
    return before + after


def move_edge(
    segments: Segments, index: int, edge: Literal["start", "end"], time: float
) -> Segments:
    """Move one edge of a segment; refused where it would reach the other one.

    An edge shared with a touching neighbour moves for both. Growing over other segments trims or
    removes them; nothing merges.
    """
    old = _at(segments, index)
    start, end = (time, old.end) if edge == "start" else (old.start, time)
    if not end - start > SLIVER:
        raise InputError(
            f"The {edge} of '{old.action}' ({old.start:g} s to {old.end:g} s) cannot move to "
            f"{time:g} s; delete the segment instead."
        )
    moved = Segment(start, end, old.action)
    before, after = segments[:index], segments[index + 1 :]
    if edge == "start":
        if before and before[-1].end < start and old.start - before[-1].end <= SLIVER:
            before = (*before[:-1], replace(before[-1], end=start))
        else:
            before, _ = _around(before, start, end)
    elif after and end < after[0].start and after[0].start - old.end <= SLIVER:
        after = (replace(after[0], start=end), *after[1:])
    else:
        _, after = _around(after, start, end)
    return (*before, moved, *after)


def move_segment(segments: Segments, index: int, start: float) -> Segments:
    """Move a segment to another start time; it keeps its duration.

    It paints over what is below without merging, and leaves its old place unlabelled.
    """
    old = _at(segments, index)
    moved = Segment(start, start + old.duration, old.action)
    return _placed(segments[:index] + segments[index + 1 :], moved)


def split(segments: Segments, time: float) -> Segments:
    """Cut the segment that covers `time` (s) into two touching ones of the same action."""
    index = bisect_right(segments, time, key=_end)
    old = segments[index] if index < len(segments) else None
    if old is None or not (time - old.start > SLIVER and old.end - time > SLIVER):
        raise InputError(f"There is no segment to split at {time:g} s; pick a time inside one.")
    halves = (replace(old, end=time), replace(old, start=time))
    return segments[:index] + halves + segments[index + 1 :]


def merge(segments: Segments, first: int, last: int, action: str | None = None) -> Segments:
    """Make one segment of the run from `first` to `last`, unlabelled time between them included.

    Both are in it; its action is by default that of the first.
    """
    opening, closing = _at(segments, first), _at(segments, last)
    if last < first:
        raise InputError(f"Segments {first} to {last} run backwards; give the earlier one first.")
    whole = Segment(opening.start, closing.end, opening.action if action is None else action)
    return (*segments[:first], whole, *segments[last + 1 :])


def relabel(segments: Segments, index: int, action: str) -> Segments:
    """Give a segment another action; its edges stay, and it merges with no neighbour."""
    renamed = replace(_at(segments, index), action=action)
    return (*segments[:index], renamed, *segments[index + 1 :])


def fill_gaps(segments: Segments, longest: float, action: str | None = None) -> Segments:
    """Fill unlabelled stretches of at most `longest` seconds between two segments.

    They become segments of the action, one with a neighbour that has it. By default both neighbours
    grow to the middle, and neighbours of one action become one segment. Time before the first and
    after the last segment stays as it is.
    """
    if not longest >= 0:
        raise InputError(f"The longest gap to fill must be 0 s or more, not {longest:g} s.")
    filled = list(segments[:1])
    for right in segments[1:]:
        left = filled[-1]
        gap = right.start - left.end
        if SLIVER < gap <= longest + SLIVER:
            filled[-1:] = _bridged(left, right, action)
        else:
            filled.append(right)
    return tuple(filled)


def delete(segments: Segments, index: int) -> Segments:
    """Take a segment away; its time becomes unlabelled."""
    _at(segments, index)
    return segments[:index] + segments[index + 1 :]


def paint_all(segments: Segments, proposed: Segments) -> tuple[Segments, Segments]:
    """Paint segments that do not overlap one after the other, in one pass over the track.

    Gives the track as :func:`paint` makes it, called for each in turn, and those of `proposed` that
    were not there already.
    """
    done: list[Segment] = []
    painted = []
    passed = 0
    for new in ordered(proposed):
        while passed < len(segments) and segments[passed].start <= new.end + SLIVER:
            done.append(segments[passed])
            passed += 1
        # All that the new one overlaps or touches stands at the end of what is done.
        first = len(done)
        while first and done[first - 1].end >= new.start - SLIVER:
            first -= 1
        before = tuple(done[first:])
        after = paint(before, new.start, new.end, new.action)
        if after != before:
            painted.append(new)
            done[first:] = after
    done.extend(segments[passed:])
    return tuple(done), tuple(painted)


def tell_changes(before: Segments, after: Segments) -> str:
    """What differs between two states of a track: ``1 edge moved, 1 segment renamed``.

    A segment is the one before that it overlaps most, preferably of the same action.
    """
    pairs: list[tuple[bool, float, int, int]] = []
    first = second = 0
    while first < len(before) and second < len(after):
        old, new = before[first], after[second]
        if (overlap := min(old.end, new.end) - max(old.start, new.start)) > 0:
            pairs.append((old.action == new.action, overlap, first, second))
        first, second = first + (old.end <= new.end), second + (new.end <= old.end)
    kept, used, taken = [], set[int](), set[int]()
    for _, _, first, second in sorted(pairs, reverse=True):
        if first not in used and second not in taken:
            used.add(first)
            taken.add(second)
            kept.append((before[first], after[second]))
    # Neighbours share an edge, which moves once.
    edges = {(old.start, new.start) for old, new in kept}
    edges |= {(old.end, new.end) for old, new in kept}
    counts = [
        (sum(old != new for old, new in edges), "edge", "moved"),
        (sum(old.action != new.action for old, new in kept), "segment", "renamed"),
        (len(after) - len(kept), "segment", "added"),
        (len(before) - len(kept), "segment", "removed"),
    ]
    return ", ".join(f"{counted(number, noun)} {done}" for number, noun, done in counts if number)


def free_parts(segments: Segments, proposed: Segments) -> Segments:
    """Cut proposed segments so that they cover only time that no segment covers.

    One may lose all of itself, or become several.
    """
    parts = []
    for new in proposed:
        start = new.start
        for existing in segments[overlapping(segments, new.start, new.end)]:
            if existing.start - start > SLIVER:
                parts.append(Segment(start, existing.start, new.action))
            start = existing.end
        if new.end - start > SLIVER:
            parts.append(Segment(start, new.end, new.action))
    return tuple(parts)


def index_at(segments: Segments, time: float) -> int | None:
    """The segment that covers a time in seconds, if one does; found in O(log n)."""
    index = bisect_right(segments, time, key=_end)
    return index if index < len(segments) and segments[index].start <= time else None


def overlapping(segments: Segments, start: float, end: float, least: float = 0.0) -> slice:
    """Where the segments are of which more than `least` s lies in ``[start, end)``; in O(log n)."""
    first = bisect_right(segments, start + least, key=_end)
    last = bisect_left(segments, end - least, key=_start)
    return slice(first, max(first, last))


def covering(segments: Segments, segment: Segment) -> Segment | None:
    """The segment of the same action that covers all of `segment`, if there is one."""
    index = bisect_right(segments, segment.start + SLIVER, key=_end)
    if index == len(segments):
        return None
    old = segments[index]
    covers = old.start <= segment.start + SLIVER and segment.end <= old.end + SLIVER
    return old if covers and old.action == segment.action else None


def _check_stretch(start: float, end: float) -> None:
    """Refuse a stretch that holds no time."""
    if not end - start > SLIVER:
        raise InputError(f"A stretch must end after it starts, not go from {start} s to {end} s.")


def _at(segments: Segments, index: int) -> Segment:
    """The segment at `index`, which does not count from the end."""
    if not 0 <= index < len(segments):
        raise InputError(f"There is no segment {index}; the track has {len(segments)}.")
    return segments[index]


def _around(segments: Segments, start: float, end: float) -> tuple[Segments, Segments]:
    """What is left before and after ``[start, end)`` when all below it is cut away."""
    below = overlapping(segments, start, end)
    before, after = segments[: below.start], segments[below.stop :]
    if cut := segments[below]:
        opening, closing = cut[0], cut[-1]
        if start - opening.start > SLIVER:
            before = (*before, replace(opening, end=start))
        if closing.end - end > SLIVER:
            after = (replace(closing, start=end), *after)
    return before, after


def _placed(segments: Segments, segment: Segment) -> Segments:
    """Put a segment over all that is below it, without merging."""
    before, after = _around(segments, segment.start, segment.end)
    return (*before, segment, *after)


def _bridged(left: Segment, right: Segment, action: str | None) -> list[Segment]:
    """Two neighbours with the stretch between them filled, equal ones made one."""
    if action is None and left.action != right.action:
        middle = left.end + (right.start - left.end) / 2
        return [replace(left, end=middle), replace(right, start=middle)]
    filling = left.action if action is None else action
    start = left.start if left.action == filling else left.end
    end = right.end if right.action == filling else right.start
    run = [] if left.action == filling else [left]
    run.append(Segment(start, end, filling))
    return run if right.action == filling else [*run, right]
