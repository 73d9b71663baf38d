"""A project with a run whose mistakes are explained."""

from __future__ import annotations

from datetime import datetime, timezone
from pathlib import Path

from synthetic import synthetic_set

from forcelab.jobs import finish
from forcelab.project import LabelsUsed, Project
from forcelab.recognition.cross_validation import leave_one_out
from forcelab.recognition.examples import Labelled
from forcelab.recognition.settings import Settings
from forcelab.review.run_result import Outcome, Reviewed

__all__ = ["FAST", "made", "outcome_of"]

#: Small enough for a fit in a tenth of a second.
FAST = Settings(max_scale=64.0, stride=4, threshold=0.5, median=5, seed=3)


def made(
    path: Path, settings: Settings = FAST, count: int = 4, rate: float = 100.0, folds: int = 0
) -> Outcome:
    """Make a project of synthetic demonstrations, labelled by Ann, and evaluate on it."""
    pairs = synthetic_set(count, rate=rate)
    with Project.create(path) as project:
        for demonstration, segments in pairs:
            project.demonstrations.add(demonstration)
            project.tracks.edit(demonstration.id, "Ann", (), segments, "made")
        project.actions.add("foam", dict.fromkeys(s.action for _, t in pairs for s in t))
        return outcome_of(project, [Labelled(*pair) for pair in pairs], settings, folds)


def outcome_of(
    project: Project, labelled: list[Labelled], settings: Settings, folds: int = 0
) -> Outcome:
    """Evaluate as a run of the project would."""
    evaluation = finish(leave_one_out(labelled, settings, "foam", folds=folds))
    ids = [item.demonstration.id for item in labelled]
    return Outcome(
        number=1,
        time=datetime(2026, 1, 1, tzinfo=timezone.utc),
        title="foam",
        tasks=("foam",),
        test_task=None,
        author="Ann",
        apart=False,
        settings=settings,
        actions=evaluation.actions,
        labels=tuple(LabelsUsed(id_, "Ann", project.tracks.head(id_, "Ann")) for id_ in ids),
        tested=tuple(
            Reviewed(
                one.id,
                one.name,
                "foam",
                one.start,
                one.end,
                one.segments("human"),
                {"filtered": one.segments("filtered")},
            )
            for one in evaluation.tested
        ),
        seconds=evaluation.seconds,
        folds=folds,
    )
