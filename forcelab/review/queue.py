"""The review queue: differences to look at, in the order in which they matter."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Generator, Iterable, Mapping
from dataclasses import dataclass

from forcelab.jobs import Progress, finish
from forcelab.labels import Segments
from forcelab.project import Project, StoredVerdict
from forcelab.project.records import changed_labels
from forcelab.recognition.label_noise import SUSPECT
from forcelab.recognition.results import DemonstrationResult
from forcelab.review.differences import Difference, DifferenceKind, current_tracks, find_differences
from forcelab.review.label_errors import (
    ModelEvidence,
    gather_evidence,
    suspect_edges,
    suspect_segments,
)
from forcelab.review.run_result import RunResult
from forcelab.review.verdicts import applies_to, covers

#: Differences that last less, in seconds, are not listed: a fiftieth of a second cannot be seen.
LEAST = 0.02


@dataclass(frozen=True)
class Queue:
    """Differences and suspected errors by section, each with the most urgent first."""

    #: Human segments, parts of them and edges whose suspicion is :data:`SUSPECT` or more, by
    #: suspicion. What differs inside them stands in no other section.
    suspected: tuple[Difference, ...] = ()
    #: actions, missed, boundaries, invented: the differences of each kind, by seconds times
    #: confidence
    actions: tuple[Difference, ...] = ()
    missed: tuple[Difference, ...] = ()
    boundaries: tuple[Difference, ...] = ()
    invented: tuple[Difference, ...] = ()
    judged: tuple[StoredVerdict, ...] = ()  # the latest first

    @property
    def open(self) -> tuple[Difference, ...]:
        """All that is not judged, in the order in which it is looked at."""
        return self.suspected + self.actions + self.missed + self.boundaries + self.invented

    def after(self, verdict: StoredVerdict, difference: Difference) -> Queue:
        """The queue after a verdict on a difference."""
        sections = (self.suspected, self.actions, self.missed, self.boundaries, self.invented)
        suspected, actions, missed, boundaries, invented = (
            tuple(d for d in section if d != difference) for section in sections
        )
        return Queue(suspected, actions, missed, boundaries, invented, (verdict, *self.judged))


@dataclass(frozen=True)
class ComparedDemonstration:
    """The last comparison of a demonstration, so that an edit costs no other one's comparison."""

    result: DemonstrationResult
    segments: Segments
    differences: tuple[Difference, ...]
    evidence: ModelEvidence


def review_queue(project: Project, run: RunResult, invented: bool = False) -> Queue:
    """The review queue of a run, with the tracks as they are now.

    Parameters
    ----------
    project : Project
    run : RunResult
    invented : bool
        Whether to list what the model predicts where the human left time unlabelled, which is
        never scored.

    Returns
    -------
    Queue
        Its ``open`` is all that is not judged, the most urgent first. The human or the model
        of a difference is None where that one left the time unlabelled.

    Examples
    --------
    >>> for difference in forcelab.review_queue(project, run).open[:1]:
    ...     print(difference.kind, difference.human, difference.predicted)
    action hold still
    """
    tracks = current_tracks(project, run)
    return finish(arrange_queue(run, tracks, project.coding.verdicts(), invented=invented))[0]


def arrange_queue(
    run: RunResult,
    tracks: Mapping[str, Segments],
    verdicts: Collection[StoredVerdict],
    known: Mapping[str, ComparedDemonstration] | None = None,
    invented: bool = False,
) -> Generator[Progress, None, tuple[Queue, dict[str, ComparedDemonstration]]]:
    """Compare all demonstrations and arrange their differences.

    Demonstrations that `tracks` (see :func:`~forcelab.review.differences.current_tracks`) lacks are
    left out altogether, verdicts as well. Of those that are unchanged since `known`, which an
    earlier call returned, nothing is compared again.
    """
    now: dict[str, ComparedDemonstration] = {}
    visible = [d for d in run.tested if tracks.get(d.id)]
    for result in visible:
        old = (known or {}).get(result.id)
        segments = tracks[result.id]
        if old is None or old.result is not result or old.segments != segments:
            old = _compare(result, segments, run.actions)
        now[result.id] = old
        yield Progress(len(now), len(visible), "comparing")
    differences = [d for each in now.values() for d in each.differences]
    traces = {result.id: result.probability_trace for result in visible}
    differing = suspect_edges(differences, traces)
    segments_suspected = suspect_segments((c.evidence for c in now.values()), run.actions)
    own_verdicts = [v for v in verdicts if v.coder == run.author and v.demonstration in tracks]
    return _arrange(differing, segments_suspected, own_verdicts, invented), now


def _compare(
    result: DemonstrationResult, segments: Segments, actions: tuple[str, ...]
) -> ComparedDemonstration:
    differences = find_differences(result.id, segments, result.predicted, result.probability_trace)
    listed = tuple(d for d in differences if d.duration >= LEAST)
    return ComparedDemonstration(
        result, segments, listed, gather_evidence(result, segments, actions, listed)
    )


def _arrange(
    differing: Iterable[Difference],
    segments: Iterable[Difference],
    verdicts: Collection[StoredVerdict],
    invented: bool,
) -> Queue:
    """Sort differences into sections."""
    verdicts_of: dict[str, list[StoredVerdict]] = defaultdict(list)
    for verdict in verdicts:
        verdicts_of[verdict.demonstration].append(verdict)
    suspected = [d for d in segments if d.suspicion >= SUSPECT]
    suspects_of: dict[str, list[Difference]] = defaultdict(list)
    for suspect in suspected:
        suspects_of[suspect.demonstration].append(suspect)
    sections: dict[DifferenceKind, list[Difference]] = defaultdict(list)
    reopened: set[int] = set()  # verdicts whose edit was undone

    def is_settled(difference: Difference) -> bool:
        applying = [v for v in verdicts_of[difference.demonstration] if applies_to(v, difference)]
        reopened.update(v.id for v in applying if changed_labels(v))
        return any(not changed_labels(v) for v in applying)

    open_suspects = [d for d in suspected if not is_settled(d)]
    for difference in differing:
        if is_settled(difference):
            continue
        if any(_belongs(s, difference) for s in suspects_of[difference.demonstration]):
            continue
        if difference.suspicion >= SUSPECT:
            open_suspects.append(difference)
        else:
            sections[difference.kind].append(difference)
    return Queue(
        tuple(sorted(open_suspects, key=lambda d: (-d.suspicion, d.demonstration, d.start))),
        _by_score(sections["action"]),
        _by_score(sections["missed"]),
        _by_score(sections["boundary"]),
        _by_score(sections["invented"]) if invented else (),
        tuple(v for v in reversed(tuple(verdicts)) if v.id not in reopened),
    )


def _by_score(differences: Iterable[Difference]) -> tuple[Difference, ...]:
    """The longest and most confident first."""
    return tuple(sorted(differences, key=lambda d: (-d.score, d.demonstration, d.start)))


def _belongs(suspect: Difference, difference: Difference) -> bool:
    """Whether a difference is part of a suspected segment."""
    return suspect.human == difference.human and covers(suspect, difference)
