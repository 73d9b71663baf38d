"""How simulated coders label: people with habits of their own, over the same demonstrations.

A coder sees an edge where the forces change, some time after it happened. The faster they change,
the better the coder knows where: on a ramp two people differ by a tenth of a second, at a click
hardly at all. Now and then a short segment is overlooked or an action taken for another one. What a
coder did wrong is recorded, so that what finds such mistakes later can be tested against it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from forcelab.arrays import Real
from forcelab.labels import Segment, Segments, Track
from forcelab.simulation.scene import Performance


@dataclass(frozen=True, slots=True)
class Confusion:
    """A habit of taking one action for another."""

    #: action and taken_for: What it is, and what the coder calls it.
    action: str
    taken_for: str
    probability: float  # of doing so, where the rest fits
    #: after and before: Only where this action comes right before, or right after it.
    after: str | None = None
    before: str | None = None
    shorter: float = float("inf")  # only segments shorter than this, s


@dataclass(frozen=True, slots=True)
class Coder:
    """A simulated coder; the defaults are a careful one who is never wrong."""

    name: str  # the author of the coder's tracks
    lag: float = 0.0  # by which every edge is seen too late, s
    #: By how much more an edge is seen late (early if negative) where this action starts, s.
    starts: Mapping[str, float] = field(default_factory=dict)
    #: sharp and ramp: Standard deviation of an edge where the forces jump, and where they change
    #: slowly, s.
    sharp: float = 0.0
    ramp: float = 0.0
    #: gap and margin: Mean length of what stays unlabelled between two actions, and at each end of
    #: the recording, s.
    gap: float = 0.0
    margin: float = 0.0
    #: Segments shorter than this, in s, may be overlooked or taken for a neighbour.
    short: float = 0.0
    #: overlooked and neighbour: Probability that a short segment stays unlabelled, and that it is
    #: taken for the action before or after it.
    overlooked: float = 0.0
    neighbour: float = 0.0
    confusions: tuple[Confusion, ...] = ()  # the coder's habits


#: The coders of the sample project. Ines is exact, but lets large actions swallow small ones; Tomas
#: labels later and less exactly, and overlooks more.
CODERS = (
    Coder(
        "Ines",
        lag=0.015,
        starts={"release": -0.02, "slipped": -0.02},
        sharp=0.015,
        ramp=0.06,
        gap=0.04,
        margin=0.07,
        short=0.4,
        overlooked=0.04,
        neighbour=0.05,
        confusions=(
            Confusion("search", "insert", 0.6, before="insert", shorter=0.5),
            Confusion("hold", "insert", 0.25, after="insert", before="release", shorter=0.8),
            Confusion("hold", "twist", 0.2, after="twist", before="twist", shorter=0.6),
            Confusion("slip", "slip transition", 0.08),
        ),
    ),
    Coder(
        "Tomas",
        lag=0.035,
        starts={"grab": 0.02, "hold": 0.03},
        sharp=0.025,
        ramp=0.09,
        gap=0.05,
        margin=0.08,
        short=0.4,
        overlooked=0.06,
        neighbour=0.06,
        confusions=(
            Confusion("search", "insert", 0.2, before="insert", shorter=0.3),
            Confusion("grab", "pull", 0.15, before="pull"),
            Confusion("twist", "hold", 0.1, shorter=0.6),
            Confusion("slip transition", "slip", 0.1),
        ),
    ),
)


#: Seconds before and after an edge within which a coder looks for what changes.
SURROUNDINGS = 0.1
#: What changes within so many seconds is one sudden change to the eye, as in one video frame.
SUDDEN = 0.03
#: Newtons; a smaller change does not show a coder where the edge is, however sudden.
LEAST_CHANGE = 0.5

#: Largest share of an action's duration by which a coder's edge may be off: two edges never cross.
LARGEST_SHIFT = 0.4
#: Largest share of a seen segment that stays unlabelled at each of its ends.
LARGEST_GAP = 0.3


@dataclass(frozen=True, slots=True)
class Mistake:
    """A segment that a coder got wrong, other than by its edges."""

    segment: Segment  # what really happened
    taken_for: str | None  # what the coder called it; None where it was overlooked


@dataclass(frozen=True, slots=True)
class Coding:
    """What a coder made of a performance."""

    track: Track  # by the coder
    mistakes: tuple[Mistake, ...]  # in order of time


def code(performance: Performance, coder: Coder, rng: np.random.Generator) -> Coding:
    """Label a performance as a coder would.

    `rng`: of mistakes, edges and gaps. The track lies within the performance's actions and
    holds every one that is not among the mistakes. Touching actions that the coder calls the same
    are one segment.
    """
    actions = performance.actions
    if not actions:
        return Coding(Track(coder.name), ())
    names = _names(actions, coder, rng.random((len(actions), 2)))
    edges = np.unique([[action.start, action.end] for action in actions])
    perceived = _perceived_edges(performance, edges, coder, rng)
    bare = rng.gamma(2.0, coder.gap / 4, len(edges))
    bare[[0, -1]] = rng.gamma(2.0, coder.margin / 2, 2)
    sight = dict(
        zip(edges.tolist(), zip(perceived.tolist(), bare.tolist(), strict=True), strict=True)
    )
    pairs = zip(actions, names, strict=True)
    return Coding(
        Track(coder.name, tuple(_paint(stroke, sight) for stroke in _strokes(actions, names))),
        tuple(Mistake(action, name) for action, name in pairs if name != action.action),
    )


def _names(actions: Segments, coder: Coder, luck: Real) -> list[str | None]:
    """What the coder calls each action, None where it is overlooked; `luck` (n, 2) is uniform."""
    around = [None, *(action.action for action in actions), None]
    names: list[str | None] = []
    for action, before, after, (seeing, naming) in zip(
        actions, around[:-2], around[2:], luck.tolist(), strict=True
    ):
        short = action.duration < coder.short
        if short and seeing < coder.overlooked:
            names.append(None)
            continue
        chances = _habits(action, before, after, coder)
        if short:
            neighbours = [name for name in (before, after) if name is not None]
            chances += [(name, coder.neighbour / len(neighbours)) for name in neighbours]
        reached = np.cumsum([chance for _, chance in chances])
        chosen = int(np.searchsorted(reached, naming, side="right"))
        names.append(chances[chosen][0] if chosen < len(chances) else action.action)
    return names


def _habits(
    action: Segment, before: str | None, after: str | None, coder: Coder
) -> list[tuple[str, float]]:
    """What the coder's habits make of an action between two others, and how probably."""
    return [
        (habit.taken_for, habit.probability)
        for habit in coder.confusions
        if habit.action == action.action
        and habit.after in (None, before)
        and habit.before in (None, after)
        and action.duration < habit.shorter
    ]


def _perceived_edges(
    performance: Performance, edges: Real, coder: Coder, rng: np.random.Generator
) -> Real:
    """Where the coder sees the edges (m,): in the same order, the first and the last unmoved."""
    starting = {action.start: action.action for action in performance.actions}
    late = [coder.lag + coder.starts.get(starting.get(edge, ""), 0.0) for edge in edges.tolist()]
    spread = coder.ramp + (coder.sharp - coder.ramp) * _sharpness(performance, edges)
    off = (late + spread * rng.standard_normal(len(edges)))[1:-1]
    room = LARGEST_SHIFT * np.diff(edges)
    perceived = edges.copy()
    perceived[1:-1] += np.clip(off, -room[:-1], room[1:])
    return perceived


def _sharpness(performance: Performance, edges: Real) -> Real:
    """How suddenly the forces change around each edge (m,): 1 as in a jump, near 0 on a ramp.

    It is the largest change within :data:`SUDDEN` over all that changes within
    :data:`SURROUNDINGS` of the edge.
    """
    step = SUDDEN / 6
    around = step * np.arange(-round(SURROUNDINGS / step), round(SURROUNDINGS / step) + 1)
    times = performance.motion.times
    windows = np.stack(
        [np.interp(edges[:, np.newaxis] + around, times, force) for force in performance.forces.T],
        axis=-1,
    )
    quickest = np.linalg.norm(windows[:, 6:] - windows[:, :-6], axis=-1).max(axis=1)
    extent = np.linalg.norm(np.ptp(windows, axis=1), axis=-1)
    return quickest / np.maximum(extent, LEAST_CHANGE)


def _strokes(actions: Segments, names: list[str | None]) -> list[Segment]:
    """The actions under the coder's names for them, touching ones of the same name as one."""
    strokes: list[Segment] = []
    for action, name in zip(actions, names, strict=True):
        if name is None:
            continue
        start = action.start
        if strokes and (strokes[-1].action, strokes[-1].end) == (name, start):
            start = strokes.pop().start
        strokes.append(Segment(start, action.end, name))
    return strokes


def _paint(stroke: Segment, sight: Mapping[float, tuple[float, float]]) -> Segment:
    """A stroke as the coder paints it; `sight` is where an edge is seen and how much stays bare."""
    (start, before), (end, after) = sight[stroke.start], sight[stroke.end]
    most = LARGEST_GAP * (end - start)
    return Segment(start + min(before, most), end - min(after, most), stroke.action)
