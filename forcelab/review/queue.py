"""The queue: what is to be looked at, and in which order."""

from __future__ import annotations

from collections.abc import Collection, Generator, Iterable, Mapping
from dataclasses import dataclass

from forcelab.jobs import Progress, finish
from forcelab.labels import Segments
from forcelab.project import Project, StoredVerdict
from forcelab.project.records import changed_labels
from forcelab.recognition.label_noise import SUSPECT
from forcelab.review.differences import Difference, Kind, compared, current_tracks
from forcelab.review.label_errors import ModelEvidence, heard, suspect_edges, suspects
from forcelab.review.run_result import Outcome, Reviewed
from forcelab.review.verdicts import covers, speaks_of

__all__ = ["LEAST", "Compared", "Queue", "arranging", "queue"]

#: Differences that last less, in seconds, are not listed: nobody sees a fiftieth of a second.
LEAST = 0.02


@dataclass(frozen=True)
class Queue:
    """What is to be looked at, section by section, each with the most urgent first.

    Parameters
    ----------
    suspected : tuple of Difference
        Human segments, parts of them and edges whose suspicion is :data:`SUSPECT` or more, by
        suspicion. What differs inside them stands in no other section.
    actions, missed, boundaries, invented : tuple of Difference
        The differences of each kind, by seconds times confidence.
    judged : tuple of StoredVerdict
        What was said already, the latest first.
    """

    suspected: tuple[Difference, ...] = ()
    actions: tuple[Difference, ...] = ()
    missed: tuple[Difference, ...] = ()
    boundaries: tuple[Difference, ...] = ()
    invented: tuple[Difference, ...] = ()
    judged: tuple[StoredVerdict, ...] = ()

    @property
    def open(self) -> tuple[Difference, ...]:
        """All that nobody has judged, in the order in which it is looked at."""
        return self.suspected + self.actions + self.missed + self.boundaries + self.invented

    def after(self, verdict: StoredVerdict, difference: Difference) -> Queue:
        """The queue when this difference is judged."""

        def rest(section: tuple[Difference, ...]) -> tuple[Difference, ...]:
            return tuple(d for d in section if d != difference)

        return Queue(
            rest(self.suspected),
            rest(self.actions),
            rest(self.missed),
            rest(self.boundaries),
            rest(self.invented),
            (verdict, *self.judged),
        )


@dataclass(frozen=True)
class Compared:
    """A demonstration as it was compared last, so that an edit costs no other one's comparison."""

    reviewed: Reviewed
    segments: Segments
    differences: tuple[Difference, ...]
    heard: ModelEvidence


def queue(project: Project, outcome: Outcome, invented: bool = False) -> Queue:
    """What is to be looked at in a project, with the tracks as they are now.

    Parameters
    ----------
    project : Project
    outcome : Outcome
    invented : bool
        Whether to list what the model predicts where the human left time unlabelled, which is
        never scored.

    Returns
    -------
    Queue
        Its ``open`` is all that nobody has judged, the most urgent first. The human or the model
        of a difference is None where that one left the time unlabelled.
    """
    tracks = current_tracks(project, outcome)
    return finish(arranging(outcome, tracks, project.coding.verdicts(), invented=invented))[0]


def arranging(
    outcome: Outcome,
    tracks: Mapping[str, Segments],
    verdicts: Collection[StoredVerdict],
    known: Mapping[str, Compared] | None = None,
    invented: bool = False,
) -> Generator[Progress, None, tuple[Queue, dict[str, Compared]]]:
    """Compare all demonstrations and put what differs in order.

    Parameters
    ----------
    outcome : Outcome
    tracks : mapping of str to tuple of Segment
        As of :func:`~forcelab.review.differences.current_tracks`; demonstrations that are not in
        it are left out altogether, judged ones as well.
    verdicts : collection of StoredVerdict
        Those that count.
    known : mapping of str to Compared, optional
        What an earlier call returned; demonstrations whose tracks are the same are not compared
        again.
    invented : bool
        As of :func:`queue`.

    Yields
    ------
    Progress

    Returns
    -------
    queue : Queue
    known : dict of str to Compared
        For the next call.
    """
    now: dict[str, Compared] = {}
    shown = [d for d in outcome.tested if tracks.get(d.id)]
    for reviewed in shown:
        old = (known or {}).get(reviewed.id)
        segments = tracks[reviewed.id]
        if old is None or old.reviewed is not reviewed or old.segments != segments:
            old = _compared(reviewed, segments, outcome.actions)
        now[reviewed.id] = old
        yield Progress(len(now), len(shown), "comparing")
    everything = [d for each in now.values() for d in each.differences]
    certainties = {reviewed.id: reviewed.certainty for reviewed in shown}
    differing = suspect_edges(everything, certainties)
    segments_suspected = suspects((c.heard for c in now.values()), outcome.actions)
    mine = [v for v in verdicts if v.coder == outcome.author and v.demonstration in tracks]
    return _arranged(differing, segments_suspected, mine, invented), now


def _compared(reviewed: Reviewed, segments: Segments, actions: tuple[str, ...]) -> Compared:
    """Compare one demonstration."""
    found = compared(reviewed.id, segments, reviewed.predicted, reviewed.certainty)
    listed = tuple(d for d in found if d.duration >= LEAST)
    return Compared(reviewed, segments, listed, heard(reviewed, segments, actions, listed))


def _arranged(
    differing: Iterable[Difference],
    segments: Iterable[Difference],
    verdicts: Collection[StoredVerdict],
    invented: bool,
) -> Queue:
    """Put differences into sections."""
    said: dict[str, list[StoredVerdict]] = {}
    for verdict in verdicts:
        said.setdefault(verdict.demonstration, []).append(verdict)
    suspected = [d for d in segments if d.suspicion >= SUSPECT]
    over: dict[str, list[Difference]] = {}
    for suspect in suspected:
        over.setdefault(suspect.demonstration, []).append(suspect)
    sections: dict[Kind, list[Difference]] = {
        "action": [],
        "missed": [],
        "boundary": [],
        "invented": [],
    }
    still_there: set[int] = set()  # verdicts whose edit was undone

    def settled(difference: Difference) -> bool:
        speaking = [v for v in said.get(difference.demonstration, ()) if speaks_of(v, difference)]
        still_there.update(v.id for v in speaking if changed_labels(v))
        return any(not changed_labels(v) for v in speaking)

    open_suspects = [d for d in suspected if not settled(d)]
    for difference in differing:
        if settled(difference):
            continue
        if any(_belongs(s, difference) for s in over.get(difference.demonstration, ())):
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
        tuple(v for v in reversed(tuple(verdicts)) if v.id not in still_there),
    )


def _by_score(differences: Iterable[Difference]) -> tuple[Difference, ...]:
    """The longest and most confident first."""
    return tuple(sorted(differences, key=lambda d: (-d.score, d.demonstration, d.start)))


def _belongs(suspect: Difference, difference: Difference) -> bool:
    """Whether a difference is part of a suspected segment."""
    return suspect.human == difference.human and covers(suspect, difference)
