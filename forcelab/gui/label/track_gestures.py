"""Drags on the coder's track: what they would make of the segments, and how that is stored.

A drag previews its result with the very functions that the store's verbs use, so that what is seen
while dragging is what is there after the release.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Literal

from PySide6.QtCore import QPointF

from forcelab.gui.document import Document, Snap
from forcelab.gui.label.snapping import Targets, rounded, snap
from forcelab.gui.label.track_hits import Hit
from forcelab.labels import Segments
from forcelab.segment_edits import SLIVER, move_edge, move_segment, paint

__all__ = ["Brushing", "Drag", "Gesture", "Marking", "MovingEdge", "MovingSegment", "begun"]

#: A segment's edge stops this far from its other edge where the sample period is not known, in s.
SHORTEST = 1e-3
#: What is more worth jumping to comes first.
RANK = {"contact": 0, "edge": 0, "frame": 1, "sample": 2}


class Gesture(ABC):
    """A drag on the coder's track. Times are in seconds.

    Parameters
    ----------
    pressed : float
        Where the pointer went down.
    handles : tuple of float
        The times that follow the pointer and may jump to a target; the first is :attr:`at`.
    bounds : tuple of float
        The first handle stays within.

    Attributes
    ----------
    at : float
        Where the first handle is now.
    """

    def __init__(
        self, pressed: float, handles: tuple[float, ...], bounds: tuple[float, float]
    ) -> None:
        self.pressed = pressed
        self.handles = handles
        self.bounds = bounds
        self.at = handles[0]

    #: The action that the dragged stretch has or gets; empty where it gets none.
    action = ""
    #: Whether what is there now attracts nothing: it is what is being moved.
    moves = True

    def follow(self, time: float, pixels_per_second: float, targets: Targets | None) -> Snap | None:
        """Move with the pointer; gives the target that it jumped to.

        `targets` None means that nothing attracts, and times stay as they are pointed at.
        """
        shift = time - self.pressed
        lead = self.handles[0]
        at, found = lead + shift, None
        if targets is not None:
            exclude = self.handles if self.moves else ()
            offers = []
            for handle in self.handles:
                offer = snap(handle + shift, pixels_per_second, targets, exclude=exclude)
                if offer is not None:
                    # For the first handle the target itself: no float dust from a sum.
                    there = offer.time if handle == lead else lead + (offer.time - handle)
                    offers.append((RANK[offer.kind], abs(there - at), there, offer))
            if offers:
                _, _, at, found = min(offers, key=lambda offer: offer[:2])
            else:
                at = rounded(at, targets)
        low, high = self.bounds
        self.at = min(max(at, low), high)
        return found

    @property
    @abstractmethod
    def stretch(self) -> tuple[float, float]:
        """What is being dragged; empty where nothing would come of it."""

    @abstractmethod
    def preview(self, segments: Segments) -> Segments:
        """What the track would become."""

    @abstractmethod
    def commit(self, document: Document) -> bool:
        """Carry it out; gives whether it changed the track."""


class Brushing(Gesture):
    """Painting an action over the stretch between press and release."""

    moves = False

    def __init__(
        self, pressed: float, begun: float, action: str, bounds: tuple[float, float]
    ) -> None:
        super().__init__(pressed, (pressed,), bounds)
        self.begun = begun
        self.action = action

    @property
    def stretch(self) -> tuple[float, float]:
        """From where it began to the pointer, in order."""
        return min(self.begun, self.at), max(self.begun, self.at)

    def preview(self, segments: Segments) -> Segments:
        """The track with the stretch painted."""
        start, end = self.stretch
        if end - start <= SLIVER:
            return segments
        return paint(segments, start, end, self.action)

    def commit(self, document: Document) -> bool:
        """Paint."""
        start, end = self.stretch
        return end - start > SLIVER and document.paint(start, end, self.action)


class Marking(Brushing):
    """Marking a range, to be filled with an action afterwards."""

    def __init__(self, pressed: float, begun: float, bounds: tuple[float, float]) -> None:
        super().__init__(pressed, begun, "", bounds)

    def preview(self, segments: Segments) -> Segments:
        """The track as it is."""
        return segments

    def commit(self, document: Document) -> bool:
        """Mark the range; no label changes."""
        document.set_range(*self.stretch)
        return False


class MovingEdge(Gesture):
    """Moving one edge of a segment, and of a neighbour that touches it there."""

    def __init__(
        self,
        pressed: float,
        segments: Segments,
        index: int,
        edge: Literal["start", "end"],
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
        self.edge: Literal["start", "end"] = edge
        self.old = old
        self.action = old.action

    @property
    def stretch(self) -> tuple[float, float]:
        """The segment as it would be."""
        if self.edge == "start":
            return self.at, self.old.end
        return self.old.start, self.at

    def preview(self, segments: Segments) -> Segments:
        """The track with the edge moved."""
        return move_edge(segments, self.index, self.edge, self.at)

    def commit(self, document: Document) -> bool:
        """Move the edge, unless it is where it was."""
        if self.at == self.handles[0]:
            return False
        return document.move_edge(self.index, self.edge, self.at)


class MovingSegment(Gesture):
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
    def stretch(self) -> tuple[float, float]:
        """The segment as it would be."""
        return self.at, self.at + self.old.duration

    def preview(self, segments: Segments) -> Segments:
        """The track with the segment moved."""
        return move_segment(segments, self.index, self.at)

    def commit(self, document: Document) -> bool:
        """Move the segment, unless it is where it was."""
        if self.at == self.handles[0]:
            return False
        return document.move_segment(self.index, self.at)


@dataclass(slots=True)
class Drag:
    """A drag that is on, and what there was when it began."""

    gesture: Gesture
    pressed: QPointF
    targets: Targets
    #: Demonstration, author and segments.
    track: tuple[str, str, Segments]
    #: What was marked.
    range: tuple[float, float] | None
    #: Where the pointer is in pixels, and whether it has gone far enough to be dragging.
    pointer: float = 0.0
    live: bool = False


def begun(document: Document, time: float, there: Hit, meant: float, *, moving: bool) -> Gesture:
    """The drag that a press on the coder's track begins, should the pointer move.

    With a brush, unlabelled time is painted right up to the segment beside it, whose edge is taken
    hold of from within the segment.

    Parameters
    ----------
    document : Document
        What is painted on.
    time : float
        Where the pointer went down.
    there : Hit
        What lies there.
    meant : float
        The time that is taken for that one, where a stretch begins.
    moving : bool
        Whether a segment is taken hold of, and not painted over.
    """
    segments, bounds = document.segments, document.bounds
    if document.action is not None and not there.inside:
        return Brushing(time, meant, document.action, bounds)
    if there.index is not None and there.edge is not None:
        demonstration = document.demonstration
        shortest = 0.0 if demonstration is None else demonstration.period
        return MovingEdge(time, segments, there.index, there.edge, bounds, shortest)
    if there.index is not None and moving:
        return MovingSegment(time, segments, there.index, bounds)
    if document.action is not None:
        return Brushing(time, meant, document.action, bounds)
    return Marking(time, meant, bounds)
