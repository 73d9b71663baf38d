"""Every interval over which a human's track and a prediction differ, told apart by kind.

Both tracks together cut time into pieces over which neither changes; what differs is found by
arithmetic on the edges of segments, whatever the rate of the samples.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Literal, NamedTuple

from forcelab.labels import Segment, Segments
from forcelab.project import Project

if TYPE_CHECKING:
    from forcelab.recognition.probability_trace import Certainty
    from forcelab.review.run_result import Outcome, Reviewed  # loads SciPy


@dataclass(frozen=True, slots=True)
class Interval:
    """A stretch of a demonstration, and what human and model make of it.

    Parameters
    ----------
    demonstration : str
        Its id.
    start, end : float
        Seconds, ``start < end``.
    human, predicted : str, optional
        The action that each sees there; None where it is unlabelled or nothing is known.
    confidence : float, optional
        Mean probability, 0 to 1, that the model gives to what it predicts.
    """

    demonstration: str
    start: float
    end: float
    human: str | None = None
    predicted: str | None = None
    confidence: float | None = None

    @property
    def duration(self) -> float:
        """Length in seconds."""
        return self.end - self.start


def action_over(segments: Segments, start: float, end: float) -> str | None:
    """The action that covers most of ``[start, end)``; None where nothing covers any of it."""
    covered: dict[str, float] = {}
    for segment in segments:
        shared = min(segment.end, end) - max(segment.start, start)
        if shared > 0:
            covered[segment.action] = covered.get(segment.action, 0.0) + shared
    return max(covered, key=lambda action: covered[action], default=None)


def place_of(reviewed: Reviewed, start: float, end: float, human: str | None = None) -> Interval:
    """A stretch of a demonstration with what human and model mostly make of it.

    Parameters
    ----------
    reviewed : Reviewed
    start, end : float
        Seconds.
    human : str, optional
        What the human makes of it, where that is known better.
    """
    predicted = action_over(reviewed.predicted, start, end)
    confidence = None
    if predicted is not None and reviewed.certainty is not None:
        confidence = reviewed.certainty.of_action(predicted, start, end)
    human = human or action_over(reviewed.human, start, end)
    return Interval(reviewed.id, start, end, human, predicted, confidence)


def place_at(reviewed: Reviewed, time: float) -> Interval | None:
    """The stretch around a time (s) in which neither human nor model changes their mind.

    None where nothing is labelled and nothing is predicted there.
    """
    start, end = reviewed.start, reviewed.end
    found = False
    for segments in (reviewed.human, reviewed.predicted):
        for segment in segments:
            if segment.start <= time < segment.end:
                found = True
                start, end = max(start, segment.start), min(end, segment.end)
            elif segment.end <= time:
                start = max(start, segment.end)
            else:
                end = min(end, segment.start)
    return place_of(reviewed, start, end) if found else None


Kind = Literal["action", "missed", "invented", "boundary"]

#: A displaced edge differs by at most this share of the shorter of the two segments at it.
EDGE_SHARE = 0.25


@dataclass(frozen=True, slots=True)
class Difference(Interval):
    """A place where human and model differ.

    `confidence` is the mean probability that the model gives to what it predicts there; where it
    predicts nothing, one minus that of the action that the human sees.

    Parameters
    ----------
    kind : "action", "missed", "invented" or "boundary"
        Both name an action, not the same one; only the human does; only the model does; both see
        the same actions one after the other and only the edge between them differs.
    suspicion : float
        How much speaks for an error of the coder, 0 to 1; see :mod:`forcelab.review.label_errors`.
    """

    kind: Kind = "action"
    suspicion: float = 0.0

    @property
    def score(self) -> float:
        """Seconds times confidence: what is worth the first look; seconds if nothing is known."""
        return self.duration * (1.0 if self.confidence is None else self.confidence)


class _Piece(NamedTuple):
    """A stretch over which neither track changes; None is unlabelled."""

    start: float
    end: float
    human: str | None
    predicted: str | None

    @property
    def differs(self) -> bool:
        return self.human != self.predicted


def current_tracks(project: Project, outcome: Outcome) -> dict[str, Segments]:
    """The tracks of an outcome's coder as they are now, spelt as they were trained.

    Demonstrations that have left the project since are left out.
    """
    there = {info.id for info in project.demonstrations.infos()}
    return {
        reviewed.id: spelt(
            project.tracks.get(reviewed.id, outcome.author).segments, outcome, reviewed
        )
        for reviewed in outcome.tested
        if reviewed.id in there
    }


def spelt(segments: Segments, outcome: Outcome, reviewed: Reviewed) -> Segments:
    """Segments of a demonstration with the actions as the outcome trained them."""
    merged = outcome.settings.merge.apply_segments(segments)
    if not outcome.apart:
        return merged
    return tuple(replace(s, action=f"{s.action}_{reviewed.task}") for s in merged)


def spelt_back(action: str, outcome: Outcome, reviewed: Reviewed) -> str:
    """What a coder writes for an action that a recogniser has learnt, perhaps in another task."""
    if not outcome.apart:
        return action
    # A task's name may end with another one's.
    tasks = (reviewed.task, *sorted(outcome.tasks, key=len, reverse=True))
    return action.removesuffix(next((f"_{t}" for t in tasks if action.endswith(f"_{t}")), ""))


def spelt_as_coded(segments: Segments, outcome: Outcome, reviewed: Reviewed) -> Segments:
    """Predicted segments of a demonstration with the actions as a coder writes them."""
    if not outcome.apart:
        return segments
    return tuple(replace(s, action=spelt_back(s.action, outcome, reviewed)) for s in segments)


def compared(
    demonstration: str,
    human: Sequence[Segment],
    predicted: Sequence[Segment],
    certainty: Certainty | None = None,
) -> tuple[Difference, ...]:
    """The differences of two tracks over one demonstration: they tile the time that differs.

    Parameters
    ----------
    demonstration : str
        Its id.
    human, predicted : sequence of Segment
        In order, never overlapping.
    certainty : Certainty, optional
        The model's.
    """
    pieces = list(_pieces(human, predicted))
    edges = _edges(pieces)
    return tuple(
        Difference(
            demonstration,
            piece.start,
            piece.end,
            piece.human,
            piece.predicted,
            _confidence(piece, certainty),
            "boundary" if number in edges else _kind(piece),
        )
        for number, piece in enumerate(pieces)
        if piece.differs
    )


def _kind(piece: _Piece) -> Kind:
    """What a piece is that differs by more than an edge."""
    if piece.human is None:
        return "invented"
    return "missed" if piece.predicted is None else "action"


def _confidence(piece: _Piece, certainty: Certainty | None) -> float | None:
    """How sure the model is that the human is not right."""
    if certainty is None:
        return None
    if piece.predicted is None:
        return 1.0 - certainty.of_action(piece.human, piece.start, piece.end)
    return certainty.of_action(piece.predicted, piece.start, piece.end)


def _pieces(human: Sequence[Segment], predicted: Sequence[Segment]) -> Iterator[_Piece]:
    """Cut time where either track changes; a change from an action to itself is none."""
    times = sorted({t for s in (*human, *predicted) for t in (s.start, s.end)})
    pending: _Piece | None = None
    stretches = zip(
        pairwise(times),
        _actions_between(human, times),
        _actions_between(predicted, times),
        strict=True,
    )
    for (start, end), one, other in stretches:
        if pending is not None and (pending.human, pending.predicted) == (one, other):
            pending = pending._replace(end=end)
            continue
        if pending is not None:
            yield pending
        pending = _Piece(start, end, one, other)
    if pending is not None:
        yield pending


def _actions_between(segments: Sequence[Segment], times: Sequence[float]) -> Iterator[str | None]:
    """What a track has between each two neighbouring times, which hold all of its edges."""
    following = iter(segments)
    current = next(following, None)
    for start in times[:-1]:
        while current is not None and current.end <= start:
            current = next(following, None)
        yield current.action if current is not None and current.start <= start else None


def _edges(pieces: Sequence[_Piece]) -> set[int]:
    """Which pieces differ by a displaced edge only.

    Between two stretches over which both see A, and both see B, lies a transition. In it an edge
    is displaced if both go from A to B without a third action and without turning back; either may
    leave unlabelled time in between. Before the first and after the last stretch on which both
    agree, nothing is what both see.
    """
    agreed = [i for i, p in enumerate(pieces) if p.human is not None and not p.differs]
    found: set[int] = set()
    for left, right in pairwise([-1, *agreed, len(pieces)]):
        before = pieces[left] if left >= 0 else None
        after = pieces[right] if right < len(pieces) else None
        between = range(left + 1, right)
        if _from_to(before, after, [pieces[i] for i in between]):
            room = EDGE_SHARE * min(_length(before), _length(after))
            for i in between:
                if pieces[i].differs and pieces[i].end - pieces[i].start <= room:
                    found.add(i)
    return found


def _length(piece: _Piece | None) -> float:
    """Length of a stretch in seconds; nothing lasts for ever."""
    return math.inf if piece is None else piece.end - piece.start


def _from_to(before: _Piece | None, after: _Piece | None, between: Sequence[_Piece]) -> bool:
    """Whether both tracks go from one action to the other between two agreed stretches."""
    first = None if before is None else before.human
    last = None if after is None else after.human
    if first == last:
        return False
    # None stands between two actions; where one side is nothing, it is that side.
    ranks: dict[str | None, int] = {None: 1, first: 0, last: 2}
    for track in ("human", "predicted"):
        seen = [ranks.get(getattr(piece, track), -1) for piece in between]
        if -1 in seen or any(b < a for a, b in pairwise(seen)):
            return False
    return True
