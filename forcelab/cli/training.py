"""``forcelab train``."""

from __future__ import annotations

import argparse

from forcelab.atomic import write_atomically
from forcelab.cli.output import json_text, progress_bar
from forcelab.cli.settings import choice_from, settings_from
from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.project import Project
from forcelab.recognition.project_runs import train_tasks


def run(arguments: argparse.Namespace) -> None:
    """Train and write the recogniser."""
    settings = settings_from(arguments)
    if not arguments.out.resolve().parent.is_dir():
        # Said before the training, not after it.
        raise InputError(f"'{arguments.out}' cannot be written; its folder does not exist.")
    with Project.open(arguments.project) as project, progress_bar() as watch:
        job = train_tasks(project, settings, choice_from(arguments), arguments.out.stem)
        recogniser, content = finish(job, watch)
    write_atomically(arguments.out, content)
    summary = {
        "recogniser": str(arguments.out),
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
