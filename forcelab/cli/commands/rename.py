"""Rename an action in a coder's labels, or merge it into another.

All of the coder's segments of the action get the new name, as one edit per
demonstration, which can be undone there. Labels of other coders stay as they are: where
they use the action, it stays beside the new one. Recognisers and runs keep the old name.

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
    parser.add_argument("new", metavar="NAME", type=name_of, help="its new name")
    add_author(parser, "the coder whose labels change", required=True)
    add_task(parser, "only this; may be repeated", action="append")
    parser.add_argument(
        "--yes", action="store_true", help="merge the two if the action NAME already exists"
    )
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
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
        renamed = project.actions.rename(*renaming, merge=arguments.yes)
    content = {
        "author": renamed.author,
        "old": renamed.old,
        "new": renamed.new,
        "tasks": list(renamed.tasks),
        "merged": renamed.merges,
        "segments": dict(renamed.segments),
        "others": dict(renamed.others),
        "kept": sorted(renamed.kept),
    }
    print_result(arguments.json, content, printable(renamed.sentences(done=True)))
