"""Train a recogniser on all labelled demonstrations.

The file holds no pickle and can be passed on. The project keeps a copy. A recogniser with a
classifier or features of your own (MODULE:FUNCTION, see evaluate) is loaded only where its
user names the same paths, as in FORCELAB_CLASSIFIERS=mylab.models:make_forest. What such a
classifier consists of must be scikit-learn's or classes of its own package.

for example:
  forcelab train lab.forcelab --task stylus --preset best --out stylus.skops
  forcelab train lab.forcelab --task stylus --task foam --classifier svm --out both.skops
"""

from __future__ import annotations

import argparse
from pathlib import Path

from forcelab.cli.files import check_outputs, output_file
from forcelab.cli.options import add_json, add_project, add_scheduler, join_scheduler
from forcelab.cli.output import STANDARD_OUTPUT, print_result, printable, progress_bar
from forcelab.cli.settings_options import add_settings, choice_from, settings_from
from forcelab.io import write_atomically
from forcelab.jobs import finish
from forcelab.project import Project
from forcelab.recognition.project_runs import train_tasks_job
from forcelab.text import counted

#: What the project calls a recogniser that goes to standard output.
NAME = "recogniser"


def add_options(parser: argparse.ArgumentParser) -> None:
    add_project(parser)
    parser.add_argument(
        "--out",
        metavar="RECOGNISER",
        type=Path,
        required=True,
        help="file to write (.skops); - is standard output",
    )
    add_settings(parser)
    add_scheduler(parser)
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    settings = settings_from(arguments)
    out: Path = arguments.out
    printed = out == STANDARD_OUTPUT
    outputs = [out, STANDARD_OUTPUT if arguments.json else None]
    check_outputs(outputs, [arguments.project, arguments.merge], binary=True)
    with (
        Project.open(arguments.project) as project,
        join_scheduler(arguments.scheduler),
        progress_bar() as watch,
    ):
        name = NAME if printed else out.stem
        job = train_tasks_job(project, settings, choice_from(arguments), name)
        trained = finish(job, watch)
    with output_file(out, ".skops") as file:
        write_atomically(file, trained.content)
    recogniser = trained.recogniser
    summary = {
        "recogniser": str(out),
        "actions": list(recogniser.actions),
        "channels": list(recogniser.channels),
        "rate": recogniser.rate,
        "demonstrations": len(recogniser.trained_on),
        "settings": settings.to_json(),
        "remarks": list(trained.remarks),
    }
    sentence = (
        f"{NAME if printed else out}: {counted(len(recogniser.actions), 'action')} "
        f"({', '.join(recogniser.actions)}) learnt from "
        f"{counted(len(recogniser.trained_on), 'demonstration')} at {recogniser.rate:.6g} Hz."
    )
    text = "\n".join(map(printable, (sentence, *trained.remarks)))
    print_result(arguments.json, summary, text, aside=printed)
