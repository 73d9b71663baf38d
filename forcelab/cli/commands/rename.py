"""Rename an action in a coder's labels, or merge it into another.

All of the coder's segments of the action get the new name, one edit a demonstration,
which can be undone there. Others' labels stay as they are: where they use the action,
it stays beside the new one. Recognisers and runs keep the old name.

for example:
  forcelab rename lab.forcelab hold grip --author Ines --task stylus
"""

from __future__ import annotations

import argparse

from forcelab.cli.options import add_author, add_json, add_project, add_task, name_of
from forcelab.cli.output import print_result, printable
from forcelab.errors import InputError
from forcelab.project import Project


def add_options(parser: argparse.ArgumentParser) -> None:
    add_project(parser)
    parser.add_argument("old", metavar="ACTION", type=name_of, help="the action")
    parser.add_argument("new", metavar="NAME", type=name_of, help="what it is called from now on")
    add_author(parser, "whose labels change", required=True)
    add_task(parser, "only this; may be repeated", action="append")
    parser.add_argument(
        "--yes", action="store_true", help="merge the two if there is an action NAME already"
    )
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    """Rename an action in a coder's labels, or merge it into another one."""
    tasks = arguments.task
    renaming = arguments.author, arguments.old, arguments.new, tasks
    with Project.open(arguments.project) as project:
        project.refuse_read_only()
        for task in tasks or ():
            project.demonstrations.check_task(task)
        if not arguments.yes and (change := project.actions.preview_rename(*renaming)).merges:
            raise InputError(
                f"Nothing was renamed yet. {change.sentences(done=False)} "
                f"Give --yes to merge the two."
            )
        done = project.actions.rename(*renaming, merge=arguments.yes)
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
    print_result(arguments.json, content, printable(done.sentences(done=True)))
