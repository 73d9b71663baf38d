"""``forcelab remove``."""

from __future__ import annotations

import argparse

from forcelab.cli.output import json_text, percent, printable
from forcelab.errors import InputError
from forcelab.project import DemonstrationInfo, Project
from forcelab.wording import counted


def run(arguments: argparse.Namespace) -> None:
    """Say what would go with a demonstration, or remove it."""
    with Project.open(arguments.project) as project:
        id_ = project.load(arguments.demonstration).id
        heads = {name: project.head(id_, name) for name in project.info(id_).authors}
        info = project.info(id_)
        goes = _goes(project, info)
        if not arguments.yes:
            raise InputError(
                f"'{info.name}' was not removed: with it would go {', '.join(goes)}, for good; "
                f"give --yes to remove it."
            )
        project.remove(id_, heads)
    if arguments.json:
        print(json_text({"removed": {"id": id_, "name": info.name, "task": info.task}}))
        return
    print(printable(f"Removed '{info.name}': {', '.join(goes)}."))


def _goes(project: Project, info: DemonstrationInfo) -> list[str]:
    """What goes with a demonstration."""
    goes = [f"the recording ({info.duration:.2f} s)"]
    if info.has_video:
        goes.append("its video")
    goes += [
        f"the labels of {name} ({percent(min(seconds / info.duration, 1.0))} %)"
        for name, seconds in info.labelled.items()
    ]
    assigned = [one for one in project.assignments() if one.demonstration == info.id]
    if assigned:
        goes.append(counted(len(assigned), "assignment"))
    return goes
