"""``forcelab assign``."""

from __future__ import annotations

import argparse

from forcelab.cli.newcomers import telling_newcomers
from forcelab.cli.options import WrongWordError
from forcelab.cli.output import json_text, table
from forcelab.project import Assignment, DemonstrationInfo, Project

__all__ = ["run"]


def run(arguments: argparse.Namespace) -> None:
    """Assign demonstrations to a coder, and print what is assigned."""
    with Project.open(arguments.project) as project:
        infos = {info.id: info for info in project.demonstrations()}
        chosen = _chosen(project, infos, arguments)
        if chosen:
            _check_author(arguments.author)
            with telling_newcomers(arguments.project):
                for id_ in chosen:
                    _carry_out(project, id_, arguments)
        elif arguments.open or arguments.done or arguments.reopen or arguments.remove:
            raise WrongWordError("No demonstration was named; give names, ids or --task.")
        assignments = project.assignments(arguments.author)
    if chosen:
        assignments = tuple(one for one in assignments if one.demonstration in chosen)
    if arguments.json:
        content = [_plain(one, infos[one.demonstration]) for one in assignments]
        print(json_text({"assignments": content}))
        return
    if not assignments:
        print("Nothing is assigned.")
        return
    rows = [["task", "demonstration", "coder", "", "assigned", "done"]]
    print(table(rows + [_row(one, infos[one.demonstration]) for one in assignments]))


def _chosen(
    project: Project, infos: dict[str, DemonstrationInfo], arguments: argparse.Namespace
) -> list[str]:
    """The ids of the demonstrations that are meant, each once."""
    ids = [project.id_of(key) for key in arguments.demonstrations]
    if arguments.task is not None:
        project.check_task(arguments.task)
        ids += [info.id for info in infos.values() if info.task == arguments.task]
    return list(dict.fromkeys(ids))


def _check_author(author: str | None) -> None:
    """Refuse to assign to nobody."""
    if author is None:
        raise WrongWordError("Nobody was named; say who the coder is with --author NAME.")


def _carry_out(project: Project, id_: str, arguments: argparse.Namespace) -> None:
    """Assign one demonstration, or change its assignment."""
    if arguments.remove:
        project.unassign(id_, arguments.author)
    elif arguments.done or arguments.reopen:
        project.set_done(id_, arguments.author, done=arguments.done)
    else:
        project.assign(id_, arguments.author, blind=not arguments.open)


def _row(one: Assignment, info: DemonstrationInfo) -> list[str]:
    """An assignment's line."""
    done = "-" if one.done is None else f"{one.done:%Y-%m-%d %H:%M}"
    how = "blind" if one.blind else "open"
    return [info.task, info.name, one.author, how, f"{one.assigned:%Y-%m-%d %H:%M}", done]


def _plain(one: Assignment, info: DemonstrationInfo) -> dict[str, object]:
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
