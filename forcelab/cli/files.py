"""Files and folders that commands read and write."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from forcelab.above import Drawing
from forcelab.cli.options import UsageError
from forcelab.cli.output import STANDARD_OUTPUT
from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.formats import read
from forcelab.formats.output_folder import stay_out_of_projects
from forcelab.formats.recording import ReadOptions
from forcelab.formats.signatures import is_bag_folder
from forcelab.project import Project

#: What stands for standard input where a recording is read.
STANDARD_INPUT = Path("-")


def check_outputs(
    outputs: Sequence[Path | None], inputs: Sequence[Path | None], *, binary: bool = False
) -> None:
    """Refuse files that cannot or must not be written, before the work and not after it.

    Outputs or inputs that are None were not requested. An output must not be an input, lie in a
    project or one that is read, or be the same file as another output. What is `binary` is not for
    a terminal.
    """
    if outputs.count(STANDARD_OUTPUT) > 1:
        raise UsageError(
            "Standard output ('-', or --json) can hold one file; name a file for the other one."
        )
    if binary and STANDARD_OUTPUT in outputs:
        refuse_terminal()
    paths = [path for path in outputs if path is not None and path != STANDARD_OUTPUT]
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


def refuse_terminal() -> None:
    """Make sure that standard output is no terminal, for what is no text."""
    if sys.stdout.isatty():
        raise UsageError(
            "What is written to '-' is no text and would spoil this terminal; send it on by "
            "'> FILE' or a pipe."
        )


@contextmanager
def output_file(path: Path, suffix: str) -> Iterator[Path]:
    """The file to write, with that suffix; where `path` is ``-``, it goes to standard output."""
    if path != STANDARD_OUTPUT:
        yield path
        return
    with TemporaryDirectory(prefix="forcelab-") as folder:
        file = Path(folder) / f"output{suffix}"
        yield file
        print_file(file)


def print_file(path: Path) -> None:
    """Write a file's content to standard output as it is."""
    sys.stdout.flush()
    with path.open("rb") as stream:
        shutil.copyfileobj(stream, sys.stdout.buffer)


def check_figure(path: Path) -> None:
    """Refuse a kind of picture there is not before the work, and not after it."""
    if path != STANDARD_OUTPUT:
        from forcelab.gui.figures.figure import check_suffix  # Qt

        check_suffix(path)


def save_figure(figure: Drawing, path: Path) -> None:
    """Save a figure; what goes to standard output is SVG."""
    with output_file(path, ".svg") as file:
        figure.save(file)


def demonstrations_in(
    sources: Sequence[Path], options: ReadOptions
) -> Iterator[tuple[Demonstration, tuple[str, ...]]]:
    """All demonstrations of projects (folders) and recordings (files), with remarks on them.

    ``-`` is a recording from standard input.
    """
    for source in sources:
        if source == STANDARD_INPUT and not source.exists():
            if sys.stdin is None:
                raise UsageError("Standard input ('-') is closed; pipe a recording into it.")
            with TemporaryDirectory(prefix="forcelab-") as folder:
                file = Path(folder) / "standard-input"
                with file.open("wb") as stream:
                    shutil.copyfileobj(sys.stdin.buffer, stream)
                yield from demonstrations_in([file], options)
        elif source.is_dir() and not is_bag_folder(source):
            with Project.open(source) as project:
                for info in project.demonstrations.infos():
                    yield project.demonstrations.load(info.id), ()
        else:
            for recording in read(source, options):
                yield recording.demonstration, recording.remarks
