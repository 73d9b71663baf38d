"""What the rows of the timeline pairs hold: an outcome's demonstrations with the tracks of now."""

from __future__ import annotations

import math
from collections.abc import Collection, Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from forcelab.gui.figures.marks import agreed_share
from forcelab.gui.figures.pairs import Lane, Pair
from forcelab.labels import Segments
from forcelab.project import LabelsUsed, Project
from forcelab.project.loading import natural_order

if TYPE_CHECKING:
    from forcelab.review.differences import Difference
    from forcelab.review.run_result import Outcome, Reviewed

__all__ = [
    "Entry",
    "Order",
    "Tracks",
    "Wanted",
    "arranged",
    "entries_of",
    "entry_of",
    "read_tracks",
    "tracks_of",
]

#: Tracks by coder, spelt as in the outcome.
Tracks = Mapping[str, Segments]
Order = Literal["name", "worst", "longest"]


@dataclass(frozen=True, eq=False)
class Entry:
    """One demonstration of the list.

    Parameters
    ----------
    reviewed : Reviewed
    human : tuple of Segment or None
        The coder's track as it is now; None in a proposal.
    lanes : tuple of Lane
        The rows that were asked for besides.
    evaluated : float or None
        The accuracy that the run found.
    """

    reviewed: Reviewed
    human: Segments | None
    lanes: tuple[Lane, ...] = ()
    evaluated: float | None = None

    @property
    def id(self) -> str:
        """Of the demonstration."""
        return self.reviewed.id

    @property
    def edited(self) -> bool:
        """Whether the coder has changed the track since the run."""
        return self.human is not None and self.human != self.reviewed.human

    @cached_property
    def marks(self) -> tuple[Difference, ...]:
        """Where the model differs from what the human labelled."""
        from forcelab.review.differences import compared

        if not self.human:
            return ()
        found = compared(self.id, self.human, self.reviewed.predicted)
        return tuple(difference for difference in found if difference.human is not None)

    @cached_property
    def share(self) -> float | None:
        """The accuracy now: as evaluated, or by time where the track has changed since.

        In a proposal the mean probability of what is predicted.
        """
        if self.human is None:
            return _mean_probability(self.reviewed)
        if self.evaluated is not None and not self.edited:
            return self.evaluated
        return agreed_share(self.human, self.marks)

    @property
    def whole_tracks(self) -> tuple[Segments, ...]:
        """Human's, model's and other coders' tracks: not the steps to the prediction."""
        coders = (lane.segments for lane in self.lanes if not lane.certain)
        return (self.human or (), self.reviewed.predicted, *coders)

    @property
    def sketch(self) -> Pair:
        """The pair as far as it costs nothing: all but its marks."""
        reviewed = self.reviewed
        return Pair(
            reviewed.name,
            self.human,
            reviewed.predicted,
            reviewed.start,
            reviewed.end,
            lanes=self.lanes,
            certainty=reviewed.certainty,
            marks=(),
        )

    @cached_property
    def pair(self) -> Pair:
        """The pair, to be drawn."""
        return replace(self.sketch, marks=self.marks)


@dataclass(frozen=True)
class Wanted:
    """Which rows stand below the pairs.

    Parameters
    ----------
    stages : tuple of (str, str)
        Keys of :attr:`Reviewed.stages` with their captions.
    coders : tuple of str
        Whose tracks.
    """

    stages: tuple[tuple[str, str], ...] = ()
    coders: tuple[str, ...] = ()

    def lanes(self, reviewed: Reviewed, tracks: Tracks) -> tuple[Lane, ...]:
        """The further rows of a demonstration, as far as there are such."""
        stages = tuple(
            Lane(caption, reviewed.stages[key], certain=True)
            for key, caption in self.stages
            if key in reviewed.stages
        )
        coders = tuple(Lane(name, tracks[name]) for name in self.coders if tracks.get(name))
        return stages + coders


def tracks_of(
    project: Project, outcome: Outcome, reviewed: Reviewed, coders: Iterable[str]
) -> dict[str, Segments]:
    """Some coders' tracks of a demonstration as they are now.

    Of the coder whose labels were used that is what the run holds, as long as it was not changed:
    there every edge lies on a sample.
    """
    from forcelab.review.differences import spelt

    found = {
        coder: spelt(project.track(reviewed.id, coder).segments, outcome, reviewed)
        for coder in coders
    }
    mine = found.get(outcome.author)
    if mine is not None and _as_evaluated(project, outcome, reviewed, mine):
        found[outcome.author] = reviewed.human
    return found


def _as_evaluated(project: Project, outcome: Outcome, reviewed: Reviewed, now: Segments) -> bool:
    """Whether a track is the one that the run was made from, or came back to it."""
    head = project.head(reviewed.id, outcome.author)
    if LabelsUsed(reviewed.id, outcome.author, head) in outcome.labels:
        return True
    rates = (project.info(reviewed.id).rate, outcome.settings.rate or math.inf)
    sample = 1 / min(rates)
    return len(now) == len(reviewed.human) and all(
        one.action == other.action
        and abs(one.start - other.start) < sample
        and abs(one.end - other.end) < sample
        for one, other in zip(now, reviewed.human, strict=True)
    )


def read_tracks(
    path: Path, outcome: Outcome, coders: Collection[str], ids: Collection[str]
) -> Generator[None, None, dict[str, dict[str, Segments]]]:
    """Some coders' tracks of all tested demonstrations, as a job; by id.

    Raises
    ------
    ForcelabError
        If the project cannot be read.
    """
    found = {}
    with Project.open(path) as project:
        for reviewed in outcome.tested:
            yield
            if reviewed.id in ids:
                found[reviewed.id] = tracks_of(project, outcome, reviewed, coders)
    return found


def entries_of(
    outcome: Outcome, tracks: Mapping[str, Tracks], wanted: Wanted, hidden: Collection[str]
) -> tuple[Entry, ...]:
    """All demonstrations that may be seen, the tested first.

    Parameters
    ----------
    outcome : Outcome
    tracks : mapping
        By id, as far as they were read; without, the tracks are those of the run.
    wanted : Wanted
    hidden : collection of str
        Ids of the demonstrations that are left out.
    """
    scores = outcome.scores.get("filtered", {}).get("demonstrations", ())
    shares = [score.get("accuracy") for score in scores]
    shares += [None] * (len(outcome.tested) - len(shares))
    tested = tuple(
        entry_of(outcome, reviewed, tracks.get(reviewed.id, {}), wanted, share)
        for reviewed, share in zip(outcome.tested, shares, strict=False)
        if reviewed.id not in hidden
    )
    proposals = tuple(
        Entry(reviewed, None, wanted.lanes(reviewed, {}))
        for reviewed in outcome.proposals
        if reviewed.id not in hidden
    )
    return tested + proposals


def entry_of(
    outcome: Outcome, reviewed: Reviewed, tracks: Tracks, wanted: Wanted, share: float | None
) -> Entry:
    """A tested demonstration."""
    human = tracks.get(outcome.author, reviewed.human)
    return Entry(reviewed, human, wanted.lanes(reviewed, tracks), share)


def arranged(entries: Sequence[Entry], order: Order, searched: str = "") -> list[Entry]:
    """Those whose name or task holds all words searched for, in an order; proposals at the end.

    The worst are those of the run, so that no row runs away while its mistakes are put right. Of
    the proposals the least certain is the worst.
    """
    words = searched.casefold().split()
    found = [
        entry
        for entry in entries
        if all(word in f"{entry.reviewed.name} {entry.reviewed.task}".casefold() for word in words)
    ]

    def place(entry: Entry) -> float:
        if order == "worst":
            share = entry.share if entry.evaluated is None else entry.evaluated
            return 2.0 if share is None else share
        return entry.reviewed.start - entry.reviewed.end if order == "longest" else 0.0

    return sorted(
        found,
        key=lambda one: (one.human is None, place(one), natural_order(one.reviewed.name)),
    )


def _mean_probability(reviewed: Reviewed) -> float | None:
    """How probable what is predicted is on the whole; None where nothing is known of it."""
    certainty = reviewed.certainty
    seconds = sum(segment.duration for segment in reviewed.predicted)
    if certainty is None or not seconds:
        return None
    each = (
        segment.duration * certainty.of_action(segment.action, segment.start, segment.end)
        for segment in reviewed.predicted
    )
    return sum(each) / seconds
