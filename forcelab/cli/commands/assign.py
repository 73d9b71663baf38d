"""Say who is to label what, blind to the others' labels or not.

A coder who is assigned a demonstration blind sees neither the tracks and notes of the
others nor predictions in the window until it is done. Without DEMO and --task: shows
what is assigned. Every assignment, and when it was done or opened again, is kept for
ever.

for example:
  forcelab assign lab.forcelab pull-03 pull-04 --author Ines
  forcelab assign lab.forcelab --task stylus --author Ines --done
"""

from __future__ import annotations

import argparse

from forcelab.cli.options import UsageError, add_project, json_flag, name_of
from forcelab.cli.output import json_text, table
from forcelab.cli.project_hints import hint_at_new_names
from forcelab.project import Assignment, DemonstrationInfo, Project


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of the command."""
    add_project(parser)
    parser.add_argument(
        "demonstrations", metavar="DEMO", nargs="*", help="names or ids of demonstrations"
    )
    parser.add_argument(
        "--author",
        metavar="NAME",
        type=name_of,
        help="the coder; without DEMO and --task: only this one's",
    )
    parser.add_argument(
        "--task", metavar="TASK", type=name_of, help="all demonstrations of this task"
    )
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--open", action="store_true", help="assign openly, not blind")
    what.add_argument("--done", action="store_true", help="mark as done")
    what.add_argument("--reopen", action="store_true", help="mark as not done after all")
    what.add_argument("--remove", action="store_true", help="take the assignment back")
    json_flag(parser)


def run(arguments: argparse.Namespace) -> None:
    """Assign demonstrations to a coder, and print what is assigned."""
    with Project.open(arguments.project) as project:
        infos = {info.id: info for info in project.demonstrations.infos()}
        chosen = _selected_ids(project, infos, arguments)
        if chosen:
            _check_author(arguments.author)
            with hint_at_new_names(arguments.project):
                for id_ in chosen:
                    _carry_out(project, id_, arguments)
        elif arguments.open or arguments.done or arguments.reopen or arguments.remove:
            raise UsageError("No demonstration was named; give names, ids or --task.")
        assignments = project.coding.assignments(arguments.author)
    if chosen:
        assignments = tuple(one for one in assignments if one.demonstration in chosen)
    if arguments.json:
        content = [_json_content(one, infos[one.demonstration]) for one in assignments]
        print(json_text({"assignments": content}))
        return
    if not assignments:
        print("Nothing is assigned.")
        return
    rows = [["task", "demonstration", "coder", "", "assigned", "done"]]
    print(table(rows + [_row(one, infos[one.demonstration]) for one in assignments]))


def _selected_ids(
    project: Project, infos: dict[str, DemonstrationInfo], arguments: argparse.Namespace
) -> list[str]:
    """The ids of the demonstrations that are meant, each once."""
    ids = [project.demonstrations.id_of(key) for key in arguments.demonstrations]
    if arguments.task is not None:
        project.demonstrations.check_task(arguments.task)
        ids += [info.id for info in infos.values() if info.task == arguments.task]
    return list(dict.fromkeys(ids))


def _check_author(author: str | None) -> None:
    """Refuse to assign to nobody."""
    if author is None:
        raise UsageError("Nobody was named; say who the coder is with --author NAME.")


def _carry_out(project: Project, id_: str, arguments: argparse.Namespace) -> None:
    """Assign one demonstration, or change its assignment."""
    if arguments.remove:
        project.coding.unassign(id_, arguments.author)
    elif arguments.done or arguments.reopen:
        project.coding.set_done(id_, arguments.author, done=arguments.done)
    else:
        project.coding.assign(id_, arguments.author, blind=not arguments.open)


def _row(one: Assignment, info: DemonstrationInfo) -> list[str]:
    """An assignment's line."""
    done = "-" if one.done is None else f"{one.done:%Y-%m-%d %H:%M}"
    how = "blind" if one.blind else "open"
    return [info.task, info.name, one.author, how, f"{one.assigned:%Y-%m-%d %H:%M}", done]


def _json_content(one: Assignment, info: DemonstrationInfo) -> dict[str, object]:
    """An assignment as plain values."""
    return {
        "id": info.id,
        "name": info.name,
        "task": info.task,
        "author": one.author,
        "blind": one.blind,
        "assigned": one.assigned.isoformat(),
        "done": None if one.done is None else one.done.isoformat(),
    }
