"""A project with two tasks, outcomes made by hand, and a trainer whose work takes no time."""

from __future__ import annotations

import tempfile
import time
from contextlib import contextmanager
from dataclasses import replace
from datetime import datetime, timezone
from pathlib import Path

import numpy as np
from made_once import made_once
from painting_bench import MEMORY

from forcelab.demonstration import Channel, Demonstration
from forcelab.labels import Segment
from forcelab.project import LabelsUsed, Project, Provenance
from forcelab.recognition.presets import preset
from forcelab.recognition.probabilities import ProbabilityTrace
from forcelab.review.run_result import DemonstrationResult, RunResult
from forcelab.review.training import TrainingStep

TRACK = (Segment(0.0, 2.0, "grab"), Segment(2.0, 5.0, "hold"))
PREDICTED = (Segment(0.0, 2.5, "grab"), Segment(2.5, 6.0, "hold"), Segment(6.0, 7.0, "grab"))


def step(epoch=1, loss=1.0, fold=1, folds=3, phase="fold", seconds_left=12.0):
    """What a training tells of an epoch."""
    done = 100 * fold + (epoch or 0)
    text = f"fold {fold} of {folds}"
    return TrainingStep(
        done, 100 * (folds + 2), text, phase, fold, folds, epoch, loss, seconds_left
    )


def recording(name, task, shift=0.0):
    """Ten seconds at 100 Hz of one 3-axis sensor."""
    times = np.arange(1000) / 100
    signals = np.sin(times[:, np.newaxis] + shift + np.arange(3))
    return Demonstration(name, task, times, signals, tuple(Channel(f"f{a}", "N") for a in "xyz"))


def certainty(*parts, rate=50.0):
    """Stretches of (seconds, probability of grab)."""
    grab = np.concatenate([np.full(round(seconds * rate), p) for seconds, p in parts])
    values = np.rint(np.stack([grab, 1 - grab], axis=1) * 255).astype(np.uint8)
    return ProbabilityTrace(0.0, rate, ("grab", "hold"), values)


def outcome_of(project, number=1, task="foam", author="Ann", proposed=(), **changes):
    """An outcome that has tested every labelled demonstration of a task."""
    infos = project.demonstrations.infos(task)
    sure = certainty((2.5, 0.97), (3.5, 0.2), (1.0, 0.6), (3.0, 0.9))

    def reviewed(info, human):
        return DemonstrationResult(
            info.id, info.name, task, 0.0, 10.0, human, {"filtered": PREDICTED}, sure
        )

    made = RunResult(
        number=number,
        time=datetime(2026, 3, 1, 12, number % 60, tzinfo=timezone.utc),
        title=task,
        tasks=(task,),
        test_task=None,
        author=author,
        apart=False,
        settings=preset("best"),
        actions=("grab", "hold"),
        labels=tuple(LabelsUsed(i.id, author, project.tracks.head(i.id, author)) for i in infos),
        tested=tuple(
            reviewed(i, project.tracks.get(i.id, author).segments) for i in infos if i.labelled
        ),
        proposals=tuple(reviewed(i, ()) for i in infos if not i.labelled),
        recogniser=project.runs.add_recogniser(
            "tiny", b"tiny", Provenance(settings={}, seed=None, labels=(), versions={})
        ),
        seconds={"features": 0.25, "fit": 3.5, "predict": 0.1, "filter": 0.05},
    )
    return replace(made, **changes)


class FakeWork:
    """The trainer's work, as told: steps, then an outcome or an error."""

    def __init__(self):
        self.asked = []
        self.loaded = []
        self.steps = [step(epoch=n, loss=1.0 / n) for n in (1, 2, 3)]
        self.result = None
        self.kept = ()
        self.outcomes = {}
        self.gate = True  # whether a training that has told all its steps may end
        self.closed = 0

    def train(self, path, given, name, trail):
        self.asked.append((path, *given(), name))
        try:
            for step in self.steps:
                trail.append(step)
                yield step
            while not self.gate:
                time.sleep(0.001)
                yield self.steps[-1] if self.steps else None
            if isinstance(self.result, Exception):
                raise self.result
            return self.result
        finally:
            self.closed += 1

    def load(self, _path, number):
        self.loaded.append(number)
        yield None
        return self.outcomes[number]

    def list_runs(self, _path):
        yield None
        return self.kept

    def remove(self, path, number):
        yield None
        with Project.open(path) as project:
            project.runs.remove(number)
        self.kept = tuple(kept for kept in self.kept if kept.number != number)

    def count_edits(self, project, outcome):
        """Every edit of the labels that were used, one by one."""
        return sum(
            edit.id > used.edit
            for used in outcome.labels
            for edit in project.tracks.history(used.demonstration, used.author)
        )


def project(path, labelled, tasks):
    """Of each task three demonstrations, some labelled by Ann."""
    with Project.create(path) as project:
        for number, task in enumerate(tasks):
            for place, name in enumerate(("01", "02", "03")):
                one = recording(name, task, number + 0.1 * place)
                project.demonstrations.add(one)
                if name in labelled:
                    project.tracks.edit(one.id, "Ann", (), TRACK, "made")


@contextmanager
def study(labelled=("01", "02"), tasks=("foam", "stylus")):
    """A document of a project: of each task three demonstrations, some labelled by Ann."""
    from forcelab.gui.document import Document

    folder = tempfile.TemporaryDirectory(dir=MEMORY)
    path = made_once(project, Path(folder.name) / "study.forcelab", tuple(labelled), tuple(tasks))
    document = Document("Ann")
    document.open_project(path)
    document.open_demonstration(document.infos[0].id)
    try:
        yield document
    finally:
        document.close()
        folder.cleanup()
