"""Mouse gestures on tracks: hit tests, snapping, and the drags that paint, move and mark.

Times snap to what the coder can see near the pointer: contact events, edges of segments, video
frames, samples. A drag previews its result with the very functions that the store's verbs use, so
that what is seen while dragging is what is there after the release.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from bisect import bisect_left, bisect_right
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF

from forcelab.gui.document import Document
from forcelab.gui.view_state import Snap, SnapKind
from forcelab.labels import Segments
from forcelab.segment_edits import SLIVER, move_edge, move_segment, paint

#: How near the pointer must come to a target to snap to it, in pixels.
SNAP_REACH = 8.0
#: A drag that begins on unlabelled time this near to a segment, in pixels, begins at its edge.
JOIN_REACH = 16.0
#: Samples closer than this many pixels cannot be told apart by hand: none of them is a target.
LEAST_SAMPLE_DISTANCE = 4.0
#: Targets in the order of their worth.
RANK: dict[SnapKind, int] = {"contact": 0, "edge": 0, "frame": 1, "sample": 2}

_start = attrgetter("start")
_end = attrgetter("end")


@dataclass(frozen=True)
class SnapTargets:
    """What times can snap to, all in seconds and increasing."""

    samples: NDArray[np.float64]
    frames: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    contacts: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    #: Tracks whose edges count, the coder's own first.
    tracks: Sequence[Segments] = ()
    #: Few further edges: the demonstration's start and end, the marked range.
    marks: Sequence[float] = ()
    #: Median distance of samples.
    period: float = 0.0


def snap_targets(document: Document) -> SnapTargets:
    """The document's targets; costs nothing, as no track is copied."""
    demonstration, frames = document.demonstration, document.view.frame_times
    return SnapTargets(
        samples=np.empty(0) if demonstration is None else demonstration.times,
        frames=np.empty(0) if frames is None else frames,
        contacts=document.view.contacts,
        tracks=(document.editor.segments, *document.other_tracks.values()),
        marks=(*document.view.bounds, *(document.view.range or ())),
        period=0.0 if demonstration is None else demonstration.period,
    )


def snap(
    time: float, pixels_per_second: float, targets: SnapTargets, *, exclude: Collection[float] = ()
) -> Snap | None:
    """The target that a time (s) snaps to, found in O(log n); None where none is in reach.

    The nearest contact event or edge within :data:`SNAP_REACH` pixels wins, whatever frames and
    samples there are: these lie everywhere, events do not. Otherwise it is the nearest frame within
    reach, and otherwise the nearest sample, if samples are drawn at least
    :data:`LEAST_SAMPLE_DISTANCE` pixels apart.

    Times to `exclude` are no targets: where the dragged edge itself is now.
    """
    nearest: dict[SnapKind, float | None] = {
        "contact": _nearest(targets.contacts, time, exclude),
        "edge": _nearest_edge(time, targets, exclude),
        "frame": _nearest(targets.frames, time, exclude),
    }
    if targets.period * pixels_per_second >= LEAST_SAMPLE_DISTANCE:
        nearest["sample"] = _nearest(targets.samples, time, exclude)
    offers = [Snap(at, kind) for kind, at in nearest.items() if at is not None]
    reach = SNAP_REACH / pixels_per_second
    near = [offer for offer in offers if abs(offer.time - time) <= reach]
    # Of a contact event and an edge that are as near the first: it says more about the signal.
    return min(near, key=lambda offer: (RANK[offer.kind], abs(offer.time - time)), default=None)


def round_to_sample(time: float, targets: SnapTargets) -> float:
    """The nearest sample to a time that snaps to no target.

    Times between two samples label the same samples, so that they are all one to a recogniser;
    the sample's own is the one that coders can agree on, and the one that reads ``1.250 s``. In a
    gap of the recording, more than a sample period from any sample, the time stays as it is:
    what the video shows there can be labelled, and must not jump to the gap's edge.
    """
    sample = _nearest(targets.samples, time, ())
    if sample is None:
        return time
    candidates = [sample, *(m for m in targets.marks if m > targets.samples[-1])]
    nearest = min(candidates, key=lambda candidate: abs(candidate - time))
    return nearest if abs(nearest - time) <= targets.period else time


def snap_or_round(time: float, pixels_per_second: float, targets: SnapTargets) -> float:
    """The time of the target in reach, or else of the nearest sample."""
    target = snap(time, pixels_per_second, targets)
    return round_to_sample(time, targets) if target is None else target.time


def snapped_time(document: Document, time: float, pixel: float, *, free: bool) -> float:
    """A pointed time, snapped unless `free`, within the demonstration."""
    low, high = document.view.bounds
    time = min(max(time, low), high)
    if free or not document.view.snapping:
        return time
    return snap_or_round(time, 1 / pixel, snap_targets(document))


def adjacent_edge(document: Document, time: float, pixel: float) -> Snap | None:
    """The edge at which a drag begins that paints or marks beside a segment."""
    if not document.view.snapping:
        return None
    edge = edge_beside(document.editor.segments, time, JOIN_REACH * pixel)
    if edge is None:
        return None
    target = snap(time, 1 / pixel, snap_targets(document))
    # Farther away than anything snaps, what is pointed at counts for more; but from there to the
    # edge no gap may be left that is too narrow to be seen.
    if target is None or target.kind not in ("contact", "edge"):
        return Snap(edge, "edge")
    nearest = min(abs(edge - time), abs(edge - target.time))
    return None if nearest > SNAP_REACH * pixel else Snap(edge, "edge")


def is_on_target(time: float, targets: SnapTargets) -> bool:
    """Whether a time is exactly that of an edge, a contact event, a frame or a sample."""
    near = [_nearest(at, time, ()) for at in (targets.contacts, targets.frames, targets.samples)]
    near.append(_nearest_edge(time, targets, ()))
    return any(at is not None and abs(at - time) <= SLIVER for at in near)


def _nearest_edge(time: float, targets: SnapTargets, exclude: Collection[float]) -> float | None:
    """The nearest start or end of a segment, or mark."""
    candidates = [mark for mark in targets.marks if mark not in exclude]
    for track in targets.tracks:
        for edge in (_start, _end):
            middle = bisect_left(track, time, key=edge)
            # An excluded time occurs once among starts and once among ends.
            reach = len(exclude) + 1
            near = track[max(middle - reach, 0) : middle + reach]
            candidates += [at for at in map(edge, near) if at not in exclude]
    return min(candidates, key=lambda at: abs(at - time), default=None)


def _nearest(times: NDArray[np.float64], time: float, exclude: Collection[float]) -> float | None:
    """The nearest of increasing times that is not excluded."""
    middle = int(np.searchsorted(times, time))
    reach = len(exclude) + 1
    near: Iterator[float] = iter(times[max(middle - reach, 0) : middle + reach].tolist())
    return min((t for t in near if t not in exclude), key=lambda t: abs(t - time), default=None)


#: How near to an edge the pointer grabs it, in pixels.
EDGE_REACH = 5.0
#: Segments narrower than this many pixels can be hit from a pixel beside them.
TINY = 2.0

Edge = Literal["start", "end"]


@dataclass(frozen=True, slots=True)
class Hit:
    """What lies under the pointer: a segment's index, the edge that can be grabbed, or neither."""

    index: int | None = None
    edge: Edge | None = None


def gap_at(segments: Segments, time: float) -> tuple[float, float] | None:
    """The unlabelled span between two segments around a time, in seconds, if there is one."""
    index = bisect_right(segments, time, key=_end)
    if 0 < index < len(segments) and time < segments[index].start:
        return segments[index - 1].end, segments[index].start
    return None


def edge_beside(segments: Segments, time: float, reach: float) -> float | None:
    """The nearest edge of the unlabelled span around a time; None beyond `reach` seconds."""
    index = bisect_right(segments, time, key=_end)
    if index < len(segments) and segments[index].start <= time:
        return None
    edges = [segment.end for segment in segments[max(index - 1, 0) : index]]
    edges += [segment.start for segment in segments[index : index + 1]]
    nearest = min(edges, key=lambda edge: abs(edge - time), default=None)
    return nearest if nearest is not None and abs(nearest - time) <= reach else None


def hit(segments: Segments, time: float, pixel: float) -> Hit:
    """What is under the pointer, found in O(log n); `pixel` is the seconds in one.

    An edge is grabbed from :data:`EDGE_REACH` pixels within its segment, but never from more than a
    third of that, so that its body stays within reach however narrow. Beside it a drag begins that
    labels what is unlabelled. A segment narrower than :data:`TINY` pixels is hit from one pixel
    beside it.
    """
    index = bisect_right(segments, time, key=_end)
    tiny = _tiny(segments, time, pixel)
    if tiny is not None:
        return Hit(tiny)
    if index == len(segments) or time < segments[index].start:
        return Hit()
    segment = segments[index]
    zone = min(EDGE_REACH * pixel, segment.duration / 3)
    if time - segment.start <= zone:
        return Hit(index, "start")
    return Hit(index, "end" if segment.end - time <= zone else None)


def _tiny(segments: Segments, time: float, pixel: float) -> int | None:
    """The tiny segment whose middle is nearest to a time, within a pixel."""
    first = bisect_left(segments, time - 2 * pixel, key=_end)
    last = bisect_right(segments, time + 2 * pixel, key=_start)
    # Where hundreds crowd in a pixel nobody can point at one: those around the time will do.
    middle = bisect_left(segments, time, key=_start)
    near = range(max(first, middle - 2), min(last, middle + 2))

    def distance(i: int) -> float:
        return abs((segments[i].start + segments[i].end) / 2 - time)

    tiny = [i for i in near if segments[i].duration < TINY * pixel and distance(i) <= pixel]
    return min(tiny, key=distance, default=None)


#: A segment's edge stops this far from its other edge where the sample period is not known, in s.
SHORTEST = 1e-3


class Gesture(ABC):
    """A drag on the coder's track, from where the pointer was `pressed`. Times are in seconds.

    The `handles` follow the pointer and may snap to a target; the first one stays within `bounds`
    and is now :attr:`at`.
    """

    def __init__(
        self, pressed: float, handles: tuple[float, ...], bounds: tuple[float, float]
    ) -> None:
        self.pressed = pressed
        self.handles = handles
        self.bounds = bounds
        self.at = handles[0]

    #: The action that the dragged span has or gets; empty where it gets none.
    action = ""
    #: Whether the handles move what is there, which then attracts nothing.
    moves = True

    def follow(
        self, time: float, pixels_per_second: float, targets: SnapTargets | None
    ) -> Snap | None:
        """Move with the pointer; gives the target that it snapped to.

        Without `targets` times stay as they are pointed at.
        """
        shift = time - self.pressed
        lead = self.handles[0]
        at, target = lead + shift, None
        if targets is not None:
            exclude = self.handles if self.moves else ()
            offers = []
            for handle in self.handles:
                offer = snap(handle + shift, pixels_per_second, targets, exclude=exclude)
                if offer is not None:
                    # For the first handle the target itself: no float dust from a sum.
                    lead_at = offer.time if handle == lead else lead + (offer.time - handle)
                    offers.append((RANK[offer.kind], abs(lead_at - at), lead_at, offer))
            if offers:
                _, _, at, target = min(offers, key=lambda offer: offer[:2])
            else:
                at = round_to_sample(at, targets)
        low, high = self.bounds
        self.at = min(max(at, low), high)
        return target

    @property
    @abstractmethod
    def span(self) -> tuple[float, float]:
        """What is being dragged; empty where it would change nothing."""

    @abstractmethod
    def preview(self, segments: Segments) -> Segments:
        """What the track would become."""

    @abstractmethod
    def commit(self, document: Document) -> bool:
        """Carry the drag out; gives whether it changed the track."""


class BrushGesture(Gesture):
    """Painting an action from where the drag began, or an edge beside that, to the pointer."""

    moves = False

    def __init__(
        self, pressed: float, start: float, action: str, bounds: tuple[float, float]
    ) -> None:
        super().__init__(pressed, (pressed,), bounds)
        self.start = start
        self.action = action

    def follow(
        self, time: float, pixels_per_second: float, targets: SnapTargets | None
    ) -> Snap | None:
        """As any drag, but on to the coder's own edge if a gap too narrow to see would be left."""
        target = super().follow(time, pixels_per_second, targets)
        if targets is None or target is None or not targets.tracks:
            return target
        edge = edge_beside(targets.tracks[0], self.at, SNAP_REACH / pixels_per_second)
        if edge is None or (edge - self.at) * (self.at - self.start) <= 0:  # not ahead
            return target
        self.at = edge
        return Snap(edge, "edge")

    @property
    def span(self) -> tuple[float, float]:
        return min(self.start, self.at), max(self.start, self.at)

    def preview(self, segments: Segments) -> Segments:
        start, end = self.span
        if end - start <= SLIVER:
            return segments
        return paint(segments, start, end, self.action)

    def commit(self, document: Document) -> bool:
        start, end = self.span
        if end - start <= SLIVER:
            return False
        return document.editor.paint(start, end, self.action) is not None


class MarkGesture(BrushGesture):
    """Marking a range, to be filled with an action afterwards."""

    def __init__(self, pressed: float, start: float, bounds: tuple[float, float]) -> None:
        super().__init__(pressed, start, "", bounds)

    def preview(self, segments: Segments) -> Segments:
        return segments

    def commit(self, document: Document) -> bool:
        """Mark the range, which changes no label."""
        document.view.set_range(*self.span)
        return False


class EdgeGesture(Gesture):
    """Moving one edge of a segment, and of a neighbour that touches it there."""

    def __init__(
        self,
        pressed: float,
        segments: Segments,
        index: int,
        edge: Edge,
        bounds: tuple[float, float],
        shortest: float,
    ) -> None:
        old = segments[index]
        low, high = bounds
        # A segment shorter than the shortest may still be moved, just not be made shorter.
        shortest = min(shortest or SHORTEST, old.duration)
        limits = (low, old.end - shortest) if edge == "start" else (old.start + shortest, high)
        super().__init__(pressed, (old.start if edge == "start" else old.end,), limits)
        self.index = index
        self.edge: Edge = edge
        self.old = old
        self.action = old.action

    @property
    def span(self) -> tuple[float, float]:
        if self.edge == "start":
            return self.at, self.old.end
        return self.old.start, self.at

    def preview(self, segments: Segments) -> Segments:
        return move_edge(segments, self.index, self.edge, self.at)

    def commit(self, document: Document) -> bool:
        if self.at == self.handles[0]:
            return False
        return document.editor.move_edge(self.index, self.edge, self.at) is not None


class MoveGesture(Gesture):
    """Moving a whole segment, which paints over what lies where it goes."""

    def __init__(
        self, pressed: float, segments: Segments, index: int, bounds: tuple[float, float]
    ) -> None:
        old = segments[index]
        low, high = bounds
        super().__init__(pressed, (old.start, old.end), (low, max(high - old.duration, low)))
        self.index = index
        self.old = old
        self.action = old.action

    @property
    def span(self) -> tuple[float, float]:
        return self.at, self.at + self.old.duration

    def preview(self, segments: Segments) -> Segments:
        return move_segment(segments, self.index, self.at)

    def commit(self, document: Document) -> bool:
        if self.at == self.handles[0]:
            return False
        return document.editor.move_segment(self.index, self.at) is not None


@dataclass(slots=True)
class Drag:
    """A drag that is on, and what it began with."""

    gesture: Gesture
    pressed: QPointF
    targets: SnapTargets
    #: Demonstration, author and segments.
    track: tuple[str, str, Segments]
    #: The marked range.
    range: tuple[float, float] | None
    #: Where the pointer is in pixels, and whether it has gone far enough to be dragging.
    pointer: float = 0.0
    live: bool = False


def begin_gesture(
    document: Document, time: float, target: Hit, start: float, *, moving: bool
) -> Gesture:
    """The drag that a press on `target` begins, should the pointer move.

    A span begins at `start`, which is `time` snapped. `moving` grabs a segment that would be
    painted over otherwise.
    """
    segments, bounds = document.editor.segments, document.view.bounds
    if target.index is not None and target.edge is not None:
        demonstration = document.demonstration
        shortest = 0.0 if demonstration is None else demonstration.period
        return EdgeGesture(time, segments, target.index, target.edge, bounds, shortest)
    if target.index is not None and moving:
        return MoveGesture(time, segments, target.index, bounds)
    if document.action is not None:
        return BrushGesture(time, start, document.action, bounds)
    return MarkGesture(time, start, bounds)
