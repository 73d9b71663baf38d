"""``forcelab rename``."""

from __future__ import annotations

import argparse

from forcelab.cli.output import json_text, printable
from forcelab.errors import InputError
from forcelab.project import Project


def run(arguments: argparse.Namespace) -> None:
    """Rename an action in a coder's labels, or merge it into another one."""
    tasks = arguments.task
    asked = arguments.author, arguments.old, arguments.new, tasks
    with Project.open(arguments.project) as project:
        project.refuse_read_only()
        for task in tasks or ():
            project.check_task(task)
        if not arguments.yes and (change := project.renaming(*asked)).merges:
            raise InputError(
                f"Nothing was renamed yet. {change.sentences(done=False)} "
                f"Give --yes to merge the two."
            )
        done = project.rename_action(*asked, merge=arguments.yes)
    if not arguments.json:
        print(printable(done.sentences(done=True)))
        return
    content = {
        "author": done.author,
        "old": done.old,
        "new": done.new,
        "tasks": list(done.tasks),
        "merged": done.merges,
        "segments": dict(done.segments),
        "others": dict(done.others),
        "kept": sorted(done.kept),
    }
    print(json_text(content))
