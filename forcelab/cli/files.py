"""Files and folders that commands read and write."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.formats import read
from forcelab.formats.output_folder import file_names, output_folder, stay_out_of_projects
from forcelab.formats.recording import ReadOptions
from forcelab.formats.signatures import is_bag_folder
from forcelab.project import Project

__all__ = ["check_outputs", "demonstrations_in", "file_names", "output_folder"]


def check_outputs(outputs: Sequence[Path | None], inputs: Sequence[Path | None]) -> None:
    """Refuse files that cannot or must not be written, before the work and not after it.

    Parameters
    ----------
    outputs : sequence of Path or None
        Files to write; None is not asked for.
    inputs : sequence of Path or None
        Files and projects that are read.

    Raises
    ------
    InputError
        If a folder does not exist or may not be written, an output is a folder, an input or lies
        in a project, or two outputs are one file.
    """
    asked = [path for path in outputs if path is not None]
    # Of links in a circle Path.resolve raises before Python 3.13.
    places = [Path(os.path.realpath(path)) for path in asked]
    read = [Path(os.path.realpath(source)) for source in inputs if source is not None]
    for path, place in zip(asked, places, strict=True):
        if not place.parent.is_dir():
            raise InputError(f"'{path}' cannot be written; its folder does not exist.")
        if not os.access(place.parent, os.W_OK):
            raise InputError(f"'{path}' cannot be written; its folder is not yours to write into.")
        if place.is_dir():
            raise InputError(f"'{path}' is a folder; name a file to write.")
        if places.count(place) > 1:
            raise InputError(f"'{path}' is named for two outputs; give each a file of its own.")
        for source in read:
            if source == place or source in place.parents:
                raise InputError(f"'{path}' is or lies in what is read here; write elsewhere.")
        stay_out_of_projects(path, place.parent)


def demonstrations_in(
    sources: Sequence[Path], options: ReadOptions
) -> Iterator[tuple[Demonstration, tuple[str, ...]]]:
    """All demonstrations of projects (folders) and recordings (files), in order.

    Yields
    ------
    demonstration : Demonstration
    remarks : tuple of str
        What was said when it was read.

    Raises
    ------
    InputError
        If a source is neither.
    """
    for source in sources:
        if source.is_dir() and not is_bag_folder(source):
            with Project.open(source) as project:
                for info in project.demonstrations.infos():
                    yield project.demonstrations.load(info.id), ()
        else:
            for recording in read(source, options):
                yield recording.demonstration, recording.remarks
