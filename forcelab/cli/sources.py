"""Demonstrations from files and projects alike."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from forcelab.demonstration import Demonstration
from forcelab.formats import read
from forcelab.formats.recording import ReadOptions
from forcelab.project import Project

__all__ = ["demonstrations_in"]


def demonstrations_in(sources: Sequence[Path]) -> Iterator[Demonstration]:
    """All demonstrations of projects (folders) and recordings (files), in order.

    Raises
    ------
    InputError
        If a source is neither.
    """
    for source in sources:
        if source.is_dir():
            with Project.open(source) as project:
                for info in project.demonstrations():
                    yield project.load(info.id)
        else:
            for recording in read(source, ReadOptions()):
                yield recording.demonstration
