"""``forcelab export``."""

from __future__ import annotations

import argparse

from forcelab.cli.options import WrongWordError
from forcelab.cli.output import json_text
from forcelab.formats.exporting import exporting
from forcelab.jobs import finish
from forcelab.project import Project


def run(arguments: argparse.Namespace) -> None:
    """Write tracks, or the whole project, into a folder."""
    some = arguments.task or arguments.demo or arguments.author
    if some and arguments.format == "archive":
        raise WrongWordError("An archive holds the whole project; leave out what chooses of it.")
    ids = _ids(arguments) if arguments.task or arguments.demo else None
    job = exporting(
        arguments.project, arguments.out, arguments.format, ids, authors=arguments.author
    )
    written = finish(job)
    if arguments.json:
        print(json_text({"written": [str(path) for path in written]}))
        return
    for path in written:
        print(path)


def _ids(arguments: argparse.Namespace) -> set[str]:
    """The demonstrations of the tasks and names that are asked for."""
    with Project.open(arguments.project) as project:
        infos = project.demonstrations()
        for task in arguments.task or ():
            project.check_task(task)
        named = {project.id_of(name) for name in arguments.demo or ()}
    return named | {info.id for info in infos if info.task in (arguments.task or ())}
