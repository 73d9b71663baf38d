"""``forcelab train``."""

from __future__ import annotations

import argparse

from forcelab.atomic import write_atomically
from forcelab.cli.output import json_text, progress_bar
from forcelab.cli.settings import settings_from
from forcelab.jobs import finish
from forcelab.project import Project
from forcelab.recognition.corpus import corpus
from forcelab.recognition.storage import dump
from forcelab.recognition.training import training
from forcelab.versions import versions


def run(arguments: argparse.Namespace) -> None:
    """Train, write the recogniser, and keep a copy in the project."""
    settings = settings_from(arguments)
    with Project.open(arguments.project) as project:
        tasks = arguments.task or list(project.tasks())
        demonstrations = corpus(project, tasks, arguments.author, arguments.apart)
        with progress_bar(" + ".join(tasks)) as watch:
            recogniser = finish(training(demonstrations, settings), watch)
        data = dump(recogniser)
        write_atomically(arguments.out, data)
        kept = project.add_recogniser(
            arguments.out.stem,
            data,
            settings=settings.to_json(),
            seed=settings.seed,
            demonstrations=recogniser.trained_on,
            versions=versions(),
        )
    summary = {
        "recogniser": str(arguments.out),
        "id": kept,
        "actions": list(recogniser.actions),
        "channels": list(recogniser.channels),
        "rate": recogniser.rate,
        "demonstrations": len(recogniser.trained_on),
        "settings": settings.to_json(),
    }
    if arguments.json:
        print(json_text(summary))
        return
    print(
        f"{arguments.out}: {len(recogniser.actions)} actions ({', '.join(recogniser.actions)}) "
        f"learnt from {len(recogniser.trained_on)} demonstrations at {recogniser.rate:g} Hz."
    )
