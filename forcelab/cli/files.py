"""Files and folders that commands read and write."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.formats import read
from forcelab.formats.output_folder import stay_out_of_projects
from forcelab.formats.recording import ReadOptions
from forcelab.formats.signatures import is_bag_folder
from forcelab.project import Project


def check_outputs(outputs: Sequence[Path | None], inputs: Sequence[Path | None]) -> None:
    """Refuse files that cannot or must not be written, before the work and not after it.

    Outputs or inputs that are None were not requested. An output must not be an input, lie in a
    project or one that is read, or be the same file as another output.
    """
    paths = [path for path in outputs if path is not None]
    # Of links in a circle Path.resolve raises before Python 3.13.
    targets = [Path(os.path.realpath(path)) for path in paths]
    sources = [Path(os.path.realpath(source)) for source in inputs if source is not None]
    for path, target in zip(paths, targets, strict=True):
        if not target.parent.is_dir():
            raise InputError(f"'{path}' cannot be written; its folder does not exist.")
        if not os.access(target.parent, os.W_OK):
            raise InputError(f"'{path}' cannot be written; its folder is not yours to write into.")
        if target.is_dir():
            raise InputError(f"'{path}' is a folder; name a file to write.")
        if targets.count(target) > 1:
            raise InputError(f"'{path}' is named for two outputs; give each a file of its own.")
        for source in sources:
            if source == target or source in target.parents:
                raise InputError(f"'{path}' is or lies in what is read here; write elsewhere.")
        stay_out_of_projects(path, target.parent)


def demonstrations_in(
    sources: Sequence[Path], options: ReadOptions
) -> Iterator[tuple[Demonstration, tuple[str, ...]]]:
    """All demonstrations of projects (folders) and recordings (files), with remarks on them."""
    for source in sources:
        if source.is_dir() and not is_bag_folder(source):
            with Project.open(source) as project:
                for info in project.demonstrations.infos():
                    yield project.demonstrations.load(info.id), ()
        else:
            for recording in read(source, options):
                yield recording.demonstration, recording.remarks
