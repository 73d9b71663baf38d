"""Projects, runs and results that tests begin with."""

from __future__ import annotations

from datetime import datetime, timezone
from pathlib import Path

import numpy as np
from synthetic import synthetic_set

from forcelab.jobs import finish
from forcelab.labels import Segment, Track
from forcelab.project import LabelsUsed, Project
from forcelab.recognition.cross_validation import leave_one_out
from forcelab.recognition.dataset import DataSelection
from forcelab.recognition.examples import LabelledDemonstration
from forcelab.recognition.metrics import count_segments, pool
from forcelab.recognition.presets import preset
from forcelab.recognition.probabilities import ProbabilityTrace
from forcelab.recognition.settings import Settings
from forcelab.review.run_result import DemonstrationResult, RunResult

#: Small enough for a fit in a tenth of a second.
QUICK_SETTINGS = Settings(max_scale=64.0, stride=4, threshold=0.5, median=5, seed=3)


def make_evaluated_project(
    path: Path,
    settings: Settings = QUICK_SETTINGS,
    count: int = 4,
    rate: float = 100.0,
    folds: int = 0,
) -> RunResult:
    """Make a project of synthetic demonstrations, labelled by Ann, and evaluate on it."""
    pairs = synthetic_set(count, rate=rate)
    with Project.create(path) as project:
        for demonstration, segments in pairs:
            project.demonstrations.add(demonstration)
            project.tracks.edit(demonstration.id, "Ann", (), segments, "made")
        project.actions.add("foam", dict.fromkeys(s.action for _, t in pairs for s in t))
        return evaluate_as_run(
            project, [LabelledDemonstration(*pair) for pair in pairs], settings, folds
        )


def evaluate_as_run(
    project: Project, labelled: list[LabelledDemonstration], settings: Settings, folds: int = 0
) -> RunResult:
    """Evaluate as a run of the project would."""
    evaluation = finish(leave_one_out(labelled, settings, "foam", folds=folds))
    ids = [item.demonstration.id for item in labelled]
    return RunResult(
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
            DemonstrationResult(
                item.id,
                item.name,
                "foam",
                item.start,
                item.end,
                item.segments("human"),
                {"filtered": item.segments("filtered")},
            )
            for item in evaluation.tested
        ),
        seconds=evaluation.seconds,
        folds=folds,
    )


def demonstration_result(id_, human, predicted, raw=None, probability_trace=None, task="foam"):
    """One demonstration of ten seconds; segments are (start, end, action)."""
    stages = {"filtered": tuple(Segment(*s) for s in predicted)}
    if raw is not None:
        stages["raw"] = tuple(Segment(*s) for s in raw)
    human = tuple(Segment(*s) for s in human)
    return DemonstrationResult(
        id_, f"{task} {id_}", task, 0.0, 10.0, human, stages, probability_trace
    )


def run_result(tested, actions, number=1, settings=None):
    """A run's result with the scores that ``forcelab evaluate`` would find."""
    scores = {}
    for stage in ("raw", "filtered"):
        counts = [count_segments(d.human, d.stages.get(stage, ()), actions) for d in tested]
        scores[stage] = {
            "pooled": pool("pooled", counts).to_json() if counts else {},
            "demonstrations": [
                pool(d.name, [c]).to_json() for d, c in zip(tested, counts, strict=True)
            ],
        }
    return RunResult(
        number=number,
        time=datetime(2026, 1, number, tzinfo=timezone.utc),
        title="foam",
        tasks=("foam",),
        test_task=None,
        author="Ada",
        apart=False,
        settings=settings or Settings(),
        actions=tuple(actions),
        labels=(),
        tested=tuple(tested),
        scores=scores,
    )


def random_run_result(ids, actions, seed=0, right=0.75, number=1):
    """Demonstrations whose segments are predicted right for a share, else confused or missed."""
    random = np.random.default_rng(seed)
    tested = []
    for id_ in ids:
        edges = np.linspace(0.0, 10.0, 12).round(3).tolist()
        which = random.integers(0, len(actions), 11).tolist()
        human = [(a, b, actions[w]) for a, b, w in zip(edges, edges[1:], which, strict=False)]
        predicted, raw = [], []
        for (start, end, action), w in zip(human, which, strict=True):
            shift = float(random.uniform(0, 0.2))
            near = actions[(w + int(random.integers(1, 3))) % len(actions)]
            guess = action if random.random() < right else near
            raw += [(start, start + 0.3, near), (start + 0.3, end, guess)]
            if random.random() < 0.9:
                predicted.append((round(start + shift, 3), end, guess))
        values = random.integers(60, 255, (500, len(actions))).astype(np.uint8)
        trace = ProbabilityTrace(0.0, 50.0, tuple(actions), values)
        tested.append(demonstration_result(id_, human, predicted, raw, trace))
    return run_result(tested, actions, number)


#: Small enough for a fit in no time.
BAYES_SETTINGS = preset("paper").replace(classifier="naive-bayes", max_scale=32.0)
FOAM_SELECTION = DataSelection(("foam",))


def make_labelled_project(
    path: Path, labelled: int = 3, bare: int = 1, rate: float = 100.0
) -> Path:
    """A project of one task: so many demonstrations labelled by Ada, and some without labels."""
    with Project.create(path) as project:
        for number, (demonstration, segments) in enumerate(synthetic_set(labelled + bare, rate)):
            tracks = [Track("Ada", segments)] if number < labelled else []
            project.demonstrations.add(demonstration, tracks)
    return path
