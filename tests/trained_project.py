"""A small project to train on, and settings with which that takes no time."""

from __future__ import annotations

from pathlib import Path

from synthetic import synthetic_set

from forcelab.labels import Track
from forcelab.project import Project
from forcelab.recognition.dataset import Choice
from forcelab.recognition.presets import preset

__all__ = ["CHOICE", "FAST", "make"]

FAST = preset("paper").replace(classifier="naive-bayes", max_scale=32.0)
CHOICE = Choice(("foam",))


def make(path: Path, labelled: int = 3, bare: int = 1, rate: float = 100.0) -> Path:
    """A project of one task: so many demonstrations labelled by Ada, and some by nobody."""
    with Project.create(path) as project:
        for number, (demonstration, segments) in enumerate(synthetic_set(labelled + bare, rate)):
            tracks = [Track("Ada", segments)] if number < labelled else []
            project.demonstrations.add(demonstration, tracks)
    return path
