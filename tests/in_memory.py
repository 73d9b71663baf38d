"""Folders and tracks in memory: most tests are not about the disk, for which commits wait."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from forcelab.demonstration import Channel, Demonstration
from forcelab.labels import Segments
from forcelab.project import Project
from forcelab.project.track_editor import TrackEditor

__all__ = ["folder_in_memory", "labelling_in_memory", "recording", "stored"]

MEMORY = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None


@contextmanager
def folder_in_memory() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(dir=MEMORY) as folder:
        yield Path(folder)


@contextmanager
def labelling_in_memory() -> Iterator[TrackEditor]:
    """Ada at work on the only demonstration of a project, ten seconds long."""
    with folder_in_memory() as folder, Project.create(folder / "p.forcelab") as project:
        yield TrackEditor(project, project.demonstrations.add(recording()).id, "Ada")


def recording() -> Demonstration:
    """What she labels."""
    times, channels = np.arange(10_000) / 1000, (Channel("f"),)
    return Demonstration("pen 1", "stylus", times, np.zeros((10_000, 1)), channels)


def stored(labelling: TrackEditor) -> Segments:
    """The track as another window reads it."""
    with Project.open(labelling.project.path) as other:
        return other.tracks.get(labelling.demonstration, labelling.author).segments
