"""Differences of a human's track and a prediction, as intervals of a kind.

Both tracks together cut time into pieces over which neither changes; differences are found by
arithmetic on the edges of segments, whatever the rate of the samples.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby, pairwise
from operator import itemgetter
from typing import TYPE_CHECKING, Literal

from forcelab.labels import Interval, Segment, Segments
from forcelab.project import Project
from forcelab.segment_edits import SLIVER, overlapping

if TYPE_CHECKING:
    from forcelab.recognition.probabilities import ProbabilityTrace
    from forcelab.recognition.results import DemonstrationResult  # loads SciPy
    from forcelab.review.run_result import RunResult  # loads SciPy


def seconds_covered(segments: Segments, start: float, end: float) -> dict[str, float]:
    """How much of ``[start, end)`` each action covers that covers any of it, in seconds."""
    covered: dict[str, float] = {}
    for segment in segments[overlapping(segments, start, end)]:
        shared = min(segment.end, end) - max(segment.start, start)
        covered[segment.action] = covered.get(segment.action, 0.0) + shared
    return covered


def action_over(segments: Segments, start: float, end: float) -> str | None:
    """The action that covers most of ``[start, end)``; None where nothing covers any of it."""
    covered = seconds_covered(segments, start, end)
    return max(covered, key=lambda action: covered[action], default=None)


def interval_of(
    result: DemonstrationResult, start: float, end: float, human: str | None = None
) -> Interval:
    """A stretch with the actions that cover most of it; `human` where that is known better."""
    predicted = action_over(result.predicted, start, end)
    human = human or action_over(result.human, start, end)
    confidence = result.confidence(predicted, start, end)
    return Interval(result.id, start, end, human, predicted, confidence)


def interval_at(result: DemonstrationResult, time: float) -> Interval | None:
    """The stretch around a time (s) in which neither human nor prediction changes.

    None where nothing is labelled and nothing is predicted there.
    """
    start, end = result.start, result.end
    differs = False
    for segments in (result.human, result.predicted):
        for segment in segments:
            if segment.start <= time < segment.end:
                differs = True
                start, end = max(start, segment.start), min(end, segment.end)
            elif segment.end <= time:
                start = max(start, segment.end)
            else:
                end = min(end, segment.start)
    return interval_of(result, start, end) if differs else None


DifferenceKind = Literal["action", "missed", "invented", "boundary"]

#: A displaced edge differs by at most this share of the shorter of the two segments at it.
EDGE_SHARE = 0.25


@dataclass(frozen=True, slots=True)
class Difference(Interval):
    """A stretch where human and model differ, or two coders.

    `confidence` is the mean probability that the model gives to what it predicts there; where it
    predicts nothing, one minus that of the human's action.
    """

    #: Both name an action, not the same one; only the human does; only the model does; both see the
    #: same actions one after the other and only the edge between them differs
    kind: DifferenceKind = "action"
    #: How much speaks for an error of the coder, 0 to 1; see :mod:`forcelab.review.label_errors`
    suspicion: float = 0.0


def current_tracks(project: Project, run: RunResult) -> dict[str, Segments]:
    """The current tracks of a run's coder, with the actions as they were trained.

    Demonstrations that have left the project since are left out.
    """
    existing = {info.id for info in project.demonstrations.infos()}
    return {
        result.id: as_trained(project.tracks.get(result.id, run.author).segments, run, result)
        for result in run.tested
        if result.id in existing
    }


def as_trained(segments: Segments, run: RunResult, result: DemonstrationResult) -> Segments:
    """Segments of a demonstration with the actions as the run trained them."""
    merged = run.settings.merge.apply_segments(segments)
    if not run.apart:
        return merged
    return tuple(replace(s, action=f"{s.action}_{result.task}") for s in merged)


def action_as_coded(action: str, run: RunResult, result: DemonstrationResult) -> str:
    """The coder's spelling of an action that a recogniser has learnt, perhaps in another task."""
    if not run.apart:
        return action
    # A task's name may end with another one's.
    tasks = (result.task, *sorted(run.tasks, key=len, reverse=True))
    return action.removesuffix(next((f"_{t}" for t in tasks if action.endswith(f"_{t}")), ""))


def as_coded(segments: Segments, run: RunResult, result: DemonstrationResult) -> Segments:
    """Predicted segments of a demonstration with the actions as a coder writes them."""
    if not run.apart:
        return segments
    return tuple(replace(s, action=action_as_coded(s.action, run, result)) for s in segments)


def find_differences(
    demonstration: str,
    human: Sequence[Segment],
    predicted: Sequence[Segment],
    trace: ProbabilityTrace | None = None,
) -> tuple[Difference, ...]:
    """The differences of two tracks over one demonstration: they tile the time that differs."""
    pieces = track_pieces(demonstration, human, predicted)
    edges = _edges(pieces)
    return tuple(
        Difference(
            demonstration,
            piece.start,
            piece.end,
            piece.human,
            piece.predicted,
            _confidence(piece, trace),
            "boundary" if number in edges else difference_kind(piece.human, piece.predicted),
        )
        for number, piece in enumerate(pieces)
        if piece.differs
    )


def difference_kind(human: str | None, predicted: str | None) -> DifferenceKind:
    """The kind of a difference that is more than an edge."""
    if human is None:
        return "invented"
    return "missed" if predicted is None else "action"


def coder_differences(demonstration: str, a: Segments, b: Segments) -> tuple[Difference, ...]:
    """Every stretch in which two coders' tracks over a demonstration differ, in order of time.

    Only a boundary differs where before and after it both say the same, and in it one says what
    both said before, the other what both say after.
    """
    pieces = track_pieces(demonstration, a, b)
    both = [(piece.human, piece.predicted) for piece in pieces]
    differences = []
    for piece, before, after in zip(
        pieces, [(None, None), *both], [*both[1:], (None, None)], strict=False
    ):
        if piece.differs:
            agreed = before[0] == before[1] and after[0] == after[1]
            edge = agreed and {before[0], after[0]} == {piece.human, piece.predicted}
            kind = "boundary" if edge else difference_kind(piece.human, piece.predicted)
            where = demonstration, piece.start, piece.end
            differences.append(Difference(*where, piece.human, piece.predicted, kind=kind))
    return tuple(differences)


def _confidence(piece: Interval, trace: ProbabilityTrace | None) -> float | None:
    """The model's confidence that the human is wrong."""
    if trace is None:
        return None
    if piece.predicted is None:
        return 1.0 - trace.of_action(piece.human, piece.start, piece.end)
    return trace.of_action(piece.predicted, piece.start, piece.end)


def track_pieces(
    demonstration: str, human: Sequence[Segment], predicted: Sequence[Segment]
) -> list[Interval]:
    """Cut time where either track changes; a change from an action to itself is none.

    What lasts no longer than :data:`~forcelab.segment_edits.SLIVER` is float dust and left out.
    """
    times = sorted({t for s in (*human, *predicted) for t in (s.start, s.end)})
    spans = zip(
        pairwise(times),
        zip(_actions_between(human, times), _actions_between(predicted, times), strict=True),
        strict=True,
    )
    lasting = [(span, actions) for span, actions in spans if span[1] - span[0] > SLIVER]
    pieces = []
    for both, group in groupby(lasting, key=itemgetter(1)):
        of_both = [span for span, _ in group]
        pieces.append(Interval(demonstration, of_both[0][0], of_both[-1][1], *both))
    return pieces


def _actions_between(segments: Sequence[Segment], times: Sequence[float]) -> Iterator[str | None]:
    """A track's action between each two neighbouring times, which hold all of its edges."""
    following = iter(segments)
    current = next(following, None)
    for start in times[:-1]:
        while current is not None and current.end <= start:
            current = next(following, None)
        yield current.action if current is not None and current.start <= start else None


def _edges(pieces: Sequence[Interval]) -> set[int]:
    """Indices of the pieces that differ by a displaced edge only.

    Between two stretches over which both see A, and both see B, lies a transition. In it an edge is
    displaced if both go from A to B without a third action and without turning back; either may
    leave unlabelled time in between. Before the first and after the last stretch on which both
    agree, both have nothing.
    """
    agreed = [i for i, p in enumerate(pieces) if p.human is not None and not p.differs]
    edges: set[int] = set()
    for left, right in pairwise([-1, *agreed, len(pieces)]):
        before = pieces[left] if left >= 0 else None
        after = pieces[right] if right < len(pieces) else None
        inner = range(left + 1, right)
        if _same_transition(before, after, [pieces[i] for i in inner]):
            room = EDGE_SHARE * min(_length(before), _length(after))
            for i in inner:
                if pieces[i].differs and pieces[i].duration <= room:
                    edges.add(i)
    return edges


def _length(piece: Interval | None) -> float:
    """Length of a stretch in seconds; nothing lasts for ever."""
    return math.inf if piece is None else piece.duration


def _same_transition(
    before: Interval | None, after: Interval | None, between: Sequence[Interval]
) -> bool:
    """Whether both tracks go from one action to the other between two agreed stretches."""
    first = None if before is None else before.human
    last = None if after is None else after.human
    if first == last:
        return False
    # None stands between two actions; where one side is nothing, it is that side.
    ranks: dict[str | None, int] = {None: 1, first: 0, last: 2}
    for track in ("human", "predicted"):
        order = [ranks.get(getattr(piece, track), -1) for piece in between]
        if -1 in order or any(b < a for a, b in pairwise(order)):
            return False
    return True
