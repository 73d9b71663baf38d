"""Assign demonstrations to coders, blind to other coders' labels or not.

Until a blind assignment is done, the window shows its coder neither the tracks and
notes of other coders nor predictions. Without DEMO and --task: lists the assignments.
Every assignment, and when it was done or reopened, is kept for ever.

for example:
  forcelab assign lab.forcelab pull-03 pull-04 --author Ines
  forcelab assign lab.forcelab --task stylus --author Ines --done
"""

from __future__ import annotations

import argparse

from forcelab.cli.options import UsageError, add_author, add_json, add_project, add_task
from forcelab.cli.output import print_result, table
from forcelab.cli.project_hints import hint_at_new_names
from forcelab.project import Assignment, DemonstrationInfo, Project


def add_options(parser: argparse.ArgumentParser) -> None:
    add_project(parser)
    parser.add_argument(
        "demonstrations", metavar="DEMO", nargs="*", help="names or ids of demonstrations"
    )
    add_author(parser, "the coder; without DEMO and --task: only this coder's")
    add_task(parser, "all demonstrations of this task")
    mode = parser.add_mutually_exclusive_group()
    mode.add_argument("--open", action="store_true", help="assign openly, not blind")
    mode.add_argument("--done", action="store_true", help="mark as done")
    mode.add_argument("--reopen", action="store_true", help="mark as not done")
    mode.add_argument("--remove", action="store_true", help="withdraw the assignment")
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    with Project.open(arguments.project) as project:
        infos = {info.id: info for info in project.demonstrations.infos()}
        chosen = _selected_ids(project, infos, arguments)
        if chosen:
            if arguments.author is None:
                raise UsageError("Nobody was named; say who the coder is with --author NAME.")
            with hint_at_new_names(arguments.project, project):
                for id_ in chosen:
                    _assign(project, id_, arguments)
        elif arguments.open or arguments.done or arguments.reopen or arguments.remove:
            raise UsageError("No demonstration was named; give names, ids or --task.")
        assignments = project.coding.assignments(arguments.author)
    pairs = [
        (assignment, infos[assignment.demonstration])
        for assignment in assignments
        if not chosen or assignment.demonstration in chosen
    ]
    header = ["task", "demonstration", "coder", "", "assigned", "done"]
    print_result(
        arguments.json,
        {"assignments": [_json_content(*pair) for pair in pairs]},
        table([header, *(_row(*pair) for pair in pairs)]) if pairs else "Nothing is assigned.",
    )


def _selected_ids(
    project: Project, infos: dict[str, DemonstrationInfo], arguments: argparse.Namespace
) -> list[str]:
    """The ids of the demonstrations that the command line names, each once."""
    ids = [project.demonstrations.id_of(key) for key in arguments.demonstrations]
    if arguments.task is not None:
        project.demonstrations.check_task(arguments.task)
        ids += [info.id for info in infos.values() if info.task == arguments.task]
    return list(dict.fromkeys(ids))


def _assign(project: Project, id_: str, arguments: argparse.Namespace) -> None:
    """Assign one demonstration, or change its assignment."""
    if arguments.remove:
        project.coding.unassign(id_, arguments.author)
    elif arguments.done or arguments.reopen:
        project.coding.set_done(id_, arguments.author, done=arguments.done)
    else:
        project.coding.assign(id_, arguments.author, blind=not arguments.open)


def _row(assignment: Assignment, info: DemonstrationInfo) -> list[str]:
    assigned = f"{assignment.assigned:%Y-%m-%d %H:%M}"
    done = "-" if assignment.done is None else f"{assignment.done:%Y-%m-%d %H:%M}"
    blinding = "blind" if assignment.blind else "open"
    return [info.task, info.name, assignment.author, blinding, assigned, done]


def _json_content(assignment: Assignment, info: DemonstrationInfo) -> dict[str, object]:
    return {
        "id": info.id,
        "name": info.name,
        "task": info.task,
        "author": assignment.author,
        "blind": assignment.blind,
        "assigned": assignment.assigned.isoformat(),
        "done": None if assignment.done is None else assignment.done.isoformat(),
    }
