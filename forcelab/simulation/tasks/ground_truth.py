"""What really happened in a demonstration, and when its actions really began."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.arrays import Real
from forcelab.labels import Segment, Segments
from forcelab.simulation.scene import Event, Motion

#: What it is called when a jaw touches the body, and when it lets go.
CONTACT_MADE = ("left jaw: contact made", "right jaw: contact made")
CONTACT_LOST = ("left jaw: contact lost", "right jaw: contact lost")
#: How far from the plan a cue is looked for, s.
NEAR = 0.6
#: A knock of the jaws against the body lasts this long, s.
KNOCK = 0.08
#: No action is shorter than this, s: one that is has not happened.
SHORTEST = 0.02


@dataclass(frozen=True)
class Course:
    """A demonstration's motion and events, to look for cues in."""

    motion: Motion
    events: tuple[Event, ...]

    @property
    def grip(self) -> Real:
        """Mean of the two jaws' normal forces, N."""
        mean: Real = self.motion.normal.mean(axis=1)
        return mean

    def times_of(self, kinds: Sequence[str], start: float, end: float) -> list[float]:
        """When events of some kinds happened, in order."""
        return [e.time for e in self.events if e.kind in kinds and start <= e.time <= end]

    def first_true(self, condition: NDArray[np.bool_], start: float, end: float) -> float | None:
        """The first instant of a stretch at which a condition on the samples holds."""
        a, b = np.searchsorted(self.motion.times, (start, end))
        places = np.flatnonzero(condition[a:b])
        return float(self.motion.times[a + places[0]]) if len(places) else None


#: Finds the true start of a phase near the planned one: (course, planned) -> s, or None.
Cue = Callable[[Course, float], "float | None"]


@dataclass(frozen=True)
class Phase:
    action: str
    #: start and end: As planned, s.
    start: float
    end: float
    #: The cue with which it really begins; it begins as planned without one.
    begins: Cue | None = None


def first(*kinds: str, near: float = NEAR, lead: float = 0.0) -> Cue:
    """Begins `lead` s before the first event of some kinds near the planned time."""

    def cue(course: Course, planned: float) -> float | None:
        times = course.times_of(kinds, planned - near, planned + near)
        return times[0] - lead if times else None

    return cue


def last(*kinds: str, near: float = NEAR) -> Cue:
    """Begins with the last event of some kinds near the planned time."""

    def cue(course: Course, planned: float) -> float | None:
        return max(course.times_of(kinds, planned - near, planned + near), default=None)

    return cue


def grip_settled(course: Course, planned: float) -> float | None:
    """Begins when the grip, knocks apart, is near to what it is a while after the planned time."""
    near = 0.3
    a, b = np.searchsorted(course.motion.times, (planned, planned + near))
    settled = float(np.median(course.grip[a:b])) if b > a else 0.0
    span = max(1, round(KNOCK / float(course.motion.times[1] - course.motion.times[0])))
    calm = np.convolve(course.grip, np.full(span, 1.0 / span), mode="same")
    return course.first_true(calm >= 0.9 * settled, planned - near, planned + near)


def true_actions(phases: Sequence[Phase], course: Course) -> Segments:
    """When the actions of a plan really were.

    There are no gaps; neighbours of one action are one, what did not happen is left out.
    """
    starts = [phases[0].start]
    for phase in phases[1:]:
        observed = phase.begins(course, phase.start) if phase.begins else None
        starts.append(max(starts[-1], phase.start if observed is None else observed))
    ends = [*starts[1:], max(phases[-1].end, starts[-1])]
    result: list[Segment] = []
    for phase, start, end in zip(phases, starts, ends, strict=True):
        begin = result[-1].end if result else start
        if end - begin < SHORTEST:
            continue
        if result and result[-1].action == phase.action:
            result[-1] = Segment(result[-1].start, end, phase.action)
        else:
            result.append(Segment(begin, end, phase.action))
    return tuple(result)
