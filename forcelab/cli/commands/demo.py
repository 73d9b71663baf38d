"""Make the sample project.

Thirty simulated demonstrations of five tasks, with forces, video and the labels of two
coders, and a recogniser. The folder appears when it is complete; an existing one is not
changed. --small leaves out the videos and three of the tasks, and is done in seconds.

With --files it writes six example recordings instead, to try an import on.

for example:
  forcelab demo sample.forcelab
  forcelab demo --small
  forcelab demo --files recordings
"""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path

from joblib import cpu_count

from forcelab.cli.options import UsageError, add_json, path_of
from forcelab.cli.output import print_result, progress_bar
from forcelab.jobs import finish
from forcelab.project import Project
from forcelab.sample import (
    CODER,
    LABELLED,
    UNLABELLED,
    UNSYNCHRONISED,
    make_sample_job,
    write_recordings,
)
from forcelab.text import counted


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "folder",
        metavar="DIR",
        type=path_of,
        nargs="?",
        help="project folder to make (default: sample.forcelab)",
    )
    kind = parser.add_mutually_exclusive_group()
    kind.add_argument(
        "--small", action="store_true", help="twelve demonstrations of two tasks, without videos"
    )
    kind.add_argument(
        "--files",
        metavar="DIR",
        type=path_of,
        help="write example recordings (CSV) into this folder, and make no project",
    )
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    if arguments.files is not None:
        if arguments.folder is not None:
            raise UsageError(f"--files makes no project; leave out '{arguments.folder}'.")
        _write_recordings(arguments)
    else:
        _make_project(arguments)


def _write_recordings(arguments: argparse.Namespace) -> None:
    folder: Path = arguments.files
    files = write_recordings(folder)
    text = (
        f"{folder}: {files[0].name} to {files[-1].name}, {len(files)} recordings of forces with "
        f"a coder's labels.\n"
        f"\n"
        f"Next:\n"
        f"  forcelab import first.forcelab {shlex.quote(str(folder))}/*.csv --task foam\n"
        f"  forcelab gui first.forcelab"
    )
    print_result(arguments.json, {"files": [str(path) for path in files]}, text)


def _make_project(arguments: argparse.Namespace) -> None:
    path: Path = arguments.folder or Path("sample.forcelab")
    with progress_bar() as watch:
        created = finish(make_sample_job(path, cpu_count(), small=arguments.small), watch)
    with Project.open(path) as project:
        infos, recognisers = project.demonstrations.infos(), project.runs.recognisers()
        tasks = project.demonstrations.tasks()
    content = {
        "project": str(path),
        "made": created,
        "tasks": list(tasks),
        "demonstrations": len(infos),
        "recognisers": [recogniser.name for recogniser in recognisers],
    }
    folder = shlex.quote(str(path))
    labelled = [f"{coder} labelled {_listed(numbers)}" for coder, numbers in LABELLED.items()]
    videos = "There are no videos; 'forcelab demo' makes thirty demonstrations with videos."
    if any(info.has_video for info in infos):
        videos = (
            f"The video of number {_listed(UNSYNCHRONISED)} of each task is not synchronised; "
            f"its two taps are there for that."
        )
    state = f"Made {path}" if created else f"{path} is there already"
    text = (
        f"{state}: {counted(len(infos), 'demonstration')} of {counted(len(tasks), 'task')} "
        f"({', '.join(tasks)}), {counted(len(recognisers), 'recogniser')}.\n"
        f"\n"
        f"All of it is simulated. Of each task {', '.join(labelled)}; {_listed(UNLABELLED)} is "
        f"left to you.\n"
        f"{videos}\n"
        f"\n"
        f"Next:\n"
        f"  forcelab gui {folder}\n"
        f"  forcelab list {folder}\n"
        f"  forcelab evaluate {folder} --task stylus --author {CODER} --stride 10 "
        f"--figure pairs.svg"
    )
    print_result(arguments.json, content, text)


def _listed(numbers: tuple[int, ...]) -> str:
    """Neighbouring numbers as people write them."""
    return f"{numbers[0]} to {numbers[-1]}" if len(numbers) > 1 else str(numbers[0])
