"""The rows of the timeline pairs: a run's demonstrations with their current tracks."""

from __future__ import annotations

import math
from collections.abc import Collection, Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal

from forcelab.gui.document import Document
from forcelab.gui.figures.pairs import Pair, PairRow
from forcelab.gui.figures.tracks import agreed_share
from forcelab.gui.text import contains_words
from forcelab.labels import Segments, is_model
from forcelab.project import LabelsUsed, Project
from forcelab.recognition.results import DemonstrationResult
from forcelab.review.differences import Difference, as_trained, find_differences
from forcelab.review.run_result import RunResult
from forcelab.text import natural_order

#: Tracks by coder, spelt as in the run.
Tracks = Mapping[str, Segments]
PairOrder = Literal["name", "worst", "longest"]


@dataclass(frozen=True, eq=False)
class PairEntry:
    """One demonstration of the list."""

    reviewed: DemonstrationResult
    human: Segments | None  # the coder's track as it is now; None in a proposal
    lanes: tuple[PairRow, ...] = ()  # the extra rows

    @property
    def id(self) -> str:
        return self.reviewed.id

    @property
    def evaluated_accuracy(self) -> float | None:
        return self.reviewed.scores.get("filtered", {}).get("accuracy")

    @property
    def edited(self) -> bool:
        return self.human is not None and self.human != self.reviewed.human

    @cached_property
    def marks(self) -> tuple[Difference, ...]:
        """Where the model differs from what the human labelled."""
        if not self.human:
            return ()
        differences = find_differences(self.id, self.human, self.reviewed.predicted)
        return tuple(difference for difference in differences if difference.human is not None)

    @cached_property
    def share(self) -> float | None:
        """The accuracy now: as evaluated, or by time where the track has changed since.

        In a proposal the mean probability of what is predicted.
        """
        if self.human is None:
            return _mean_probability(self.reviewed)
        if self.evaluated_accuracy is not None and not self.edited:
            return self.evaluated_accuracy
        return agreed_share(self.human, self.marks)

    @property
    def final_tracks(self) -> tuple[Segments, ...]:
        """Human's, model's and other coders' tracks: not the steps to the prediction."""
        coders = (lane.segments for lane in self.lanes if not lane.certain)
        return (self.human or (), self.reviewed.predicted, *coders)

    @property
    def pair(self) -> Pair:
        """What is drawn, without the marks between the bars: they take time to be found."""
        reviewed = self.reviewed
        return Pair(
            reviewed.name,
            self.human,
            reviewed.predicted,
            reviewed.start,
            reviewed.end,
            lanes=self.lanes,
            probability_trace=reviewed.probability_trace,
            marks=(),
        )


@dataclass(frozen=True)
class ExtraRows:
    """Which rows stand below the pairs."""

    stages: tuple[str, ...] = ()  # of DemonstrationResult.stages
    coders: tuple[str, ...] = ()

    def lanes(self, reviewed: DemonstrationResult, tracks: Tracks) -> tuple[PairRow, ...]:
        """The further rows of a demonstration, as far as it has such."""
        stages = tuple(
            PairRow(stage, reviewed.stages[stage], certain=True)
            for stage in self.stages
            if stage in reviewed.stages
        )
        coders = tuple(PairRow(name, tracks[name]) for name in self.coders if tracks.get(name))
        return stages + coders


def tracks_by_coder(
    project: Project, run: RunResult, reviewed: DemonstrationResult, coders: Iterable[str]
) -> dict[str, Segments]:
    """Some coders' tracks of a demonstration as they are now.

    Of the coder whose labels were used that is what the run holds, as long as it was not changed:
    there every edge lies on a sample.
    """
    tracks = {
        coder: as_trained(project.tracks.get(reviewed.id, coder).segments, run, reviewed)
        for coder in coders
    }
    own_track = tracks.get(run.author)
    if own_track is not None and _is_as_evaluated(project, run, reviewed, own_track):
        tracks[run.author] = reviewed.human
    return tracks


def _is_as_evaluated(
    project: Project, run: RunResult, reviewed: DemonstrationResult, now: Segments
) -> bool:
    """Whether a track is the one that the run was made from, or came back to it."""
    head = project.tracks.head(reviewed.id, run.author)
    if LabelsUsed(reviewed.id, run.author, head) in run.labels:
        return True
    rates = (project.demonstrations.info(reviewed.id).rate, run.settings.rate or math.inf)
    sample = 1 / min(rates)
    return len(now) == len(reviewed.human) and all(
        a.action == b.action and abs(a.start - b.start) < sample and abs(a.end - b.end) < sample
        for a, b in zip(now, reviewed.human, strict=True)
    )


def read_tracks(
    path: Path, run: RunResult, coders: Collection[str], ids: Collection[str]
) -> Generator[None, None, dict[str, dict[str, Segments]]]:
    """Some coders' tracks of all tested demonstrations, as a job; by id."""
    tracks = {}
    with Project.open(path) as project:
        for reviewed in run.tested:
            yield
            if reviewed.id in ids:
                tracks[reviewed.id] = tracks_by_coder(project, run, reviewed, coders)
    return tracks


def filter_and_sort(
    entries: Sequence[PairEntry], order: PairOrder, searched: str = ""
) -> list[PairEntry]:
    """The entries whose name or task holds all words searched for, sorted; proposals at the end.

    The worst are those of the run, so that no row runs away while its mistakes are put right. Of
    the proposals the least certain is the worst.
    """
    fitting = [
        entry
        for entry in entries
        if contains_words(f"{entry.reviewed.name} {entry.reviewed.task}", searched)
    ]

    def place(entry: PairEntry) -> float:
        if order == "worst":
            share = entry.share if entry.evaluated_accuracy is None else entry.evaluated_accuracy
            return 2.0 if share is None else share
        return entry.reviewed.start - entry.reviewed.end if order == "longest" else 0.0

    return sorted(
        fitting,
        key=lambda entry: (entry.human is None, place(entry), natural_order(entry.reviewed.name)),
    )


def _mean_probability(reviewed: DemonstrationResult) -> float | None:
    """Mean probability of the predicted actions by time; None without probabilities."""
    seconds, certain = 0.0, 0.0
    for segment in reviewed.predicted:
        confidence = reviewed.confidence(segment.action, segment.start, segment.end)
        if confidence is None:
            return None
        seconds += segment.duration
        certain += segment.duration * confidence
    return certain / seconds if seconds else None


def other_coders(document: Document, hidden: Collection[str]) -> tuple[str, ...]:
    """The other coders of what the run tested, as far as it is not hidden."""
    run = document.review.run
    if run is None:
        return ()
    tested = {reviewed.id for reviewed in run.tested}.difference(hidden)
    infos = (info for info in document.infos if info.id in tested)
    authors = dict.fromkeys(author for info in infos for author in info.authors)
    return tuple(a for a in authors if a != run.author and not is_model(a))
