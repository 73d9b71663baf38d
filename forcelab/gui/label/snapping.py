"""Snapping: which time is meant by a pointer that is about a pixel off.

A time jumps to what a coder can see near the pointer: a contact event, an edge of a segment, a
video frame, a sample. No Qt here.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from operator import attrgetter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from forcelab.gui.document import Snap
from forcelab.labels import Segments

if TYPE_CHECKING:
    from forcelab.gui.document import Document

__all__ = ["REACH", "SAME", "Targets", "on_target", "rounded", "snap", "snapped", "targets_of"]

#: Times closer than this are the same, in seconds.
SAME = 1e-9
#: How near the pointer must come to a target, in pixels.
REACH = 8.0
#: Samples closer than this many pixels are not told apart by hand: none of them is offered.
SAMPLES_APART = 4.0

_start = attrgetter("start")
_end = attrgetter("end")


@dataclass(frozen=True)
class Targets:
    """What times can jump to, all in seconds and increasing.

    Parameters
    ----------
    samples : ndarray, shape (n,)
        The force samples.
    frames : ndarray, shape (f,)
        The video frames.
    contacts : ndarray, shape (e,)
        Contact events.
    tracks : sequence of tuple of Segment
        Tracks whose edges count.
    marks : sequence of float
        Few further edges: the demonstration's start and end, the marked range.
    period : float
        Median distance of samples.
    """

    samples: NDArray[np.float64]
    frames: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    contacts: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    tracks: Sequence[Segments] = ()
    marks: Sequence[float] = ()
    period: float = 0.0


def targets_of(document: Document) -> Targets:
    """What times can jump to in a document now; costs nothing, as no track is copied."""
    demonstration, frames = document.demonstration, document.frame_times
    return Targets(
        samples=np.empty(0) if demonstration is None else demonstration.times,
        frames=np.empty(0) if frames is None else frames,
        contacts=document.contacts,
        tracks=(document.segments, *document.others.values()),
        marks=(*document.bounds, *(document.range or ())),
        period=0.0 if demonstration is None else demonstration.period,
    )


def snap(
    time: float,
    pixels_per_second: float,
    targets: Targets,
    *,
    exclude: Collection[float] = (),
) -> Snap | None:
    """Find the target that a time near it jumps to.

    The nearest contact event or edge within :data:`REACH` pixels wins, whatever frames and samples
    there are: these lie everywhere, events do not. Otherwise it is the nearest frame within reach,
    and otherwise the nearest sample, if samples are drawn at least :data:`SAMPLES_APART` pixels
    apart.

    Nothing is offered where nothing is near; :func:`rounded` says which time is taken then.

    Parameters
    ----------
    time : float
        Where the pointer is, in seconds.
    pixels_per_second : float
        How far one is zoomed in.
    targets : Targets
        What there is to jump to.
    exclude : collection of float
        Times that are no targets: where the dragged edge itself is now.

    Returns
    -------
    Snap or None
        The target; None where none is in reach. Takes O(log n) in the number of targets.
    """
    reach = REACH / pixels_per_second
    contact = _nearest(targets.contacts, time, exclude)
    best = None
    if contact is not None and abs(contact - time) <= reach:
        best = Snap(contact, "contact")
    edge = _nearest_edge(time, targets, exclude)
    nearer = reach if best is None else abs(best.time - time)
    if edge is not None and abs(edge - time) <= nearer and (best is None or edge != best.time):
        # A contact event that is as near as an edge says more about the signal.
        best = best if best is not None and abs(edge - time) == nearer else Snap(edge, "edge")
    if best is not None:
        return best
    frame = _nearest(targets.frames, time, exclude)
    if frame is not None and abs(frame - time) <= reach:
        return Snap(frame, "frame")
    if targets.period * pixels_per_second >= SAMPLES_APART:
        sample = _nearest(targets.samples, time, exclude)
        if sample is not None and abs(sample - time) <= reach:
            return Snap(sample, "sample")
    return None


def rounded(time: float, targets: Targets) -> float:
    """Round a time that jumps to no target to the nearest sample, unseen.

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


def snapped(time: float, pixels_per_second: float, targets: Targets) -> float:
    """The time that is taken for one: that of the target in reach, or else it is rounded."""
    found = snap(time, pixels_per_second, targets)
    return rounded(time, targets) if found is None else found.time


def on_target(time: float, targets: Targets) -> bool:
    """Whether a time is exactly that of an edge, a contact event, a frame or a sample."""
    near = [
        _nearest(kind, time, ()) for kind in (targets.contacts, targets.frames, targets.samples)
    ]
    near.append(_nearest_edge(time, targets, ()))
    return any(at is not None and abs(at - time) <= SAME for at in near)


def _nearest_edge(time: float, targets: Targets, exclude: Collection[float]) -> float | None:
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
