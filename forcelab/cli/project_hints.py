"""Hints at names that a command brings into a project although it has nearly the same ones."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from forcelab.cli.output import print_remark
from forcelab.project import Project
from forcelab.text import name_alike


@contextmanager
def hint_at_new_names(path: Path, project: Project | None = None) -> Iterator[None]:
    """Print after the block which new coders or tasks differ from old ones by case or spaces.

    `project` is the one at `path`, where that is open already.
    """
    with ExitStack() as opened:
        if project is None and not Project.vacant(path):
            project = opened.enter_context(Project.open(path))
        before = {} if project is None else _names(project)
        yield
        after = _names(project or opened.enter_context(Project.open(path)))
    for kind, names in after.items():
        old = before.get(kind, [])
        for at, name in enumerate(names):
            # Of two that came together the second one is told of.
            others = old or names[:at]
            if name not in old and (similar := name_alike(name, others)) is not None:
                print_remark(f"'{name}' is a new {kind} beside '{similar}'.")


def _names(project: Project) -> dict[str, list[str]]:
    tasks = [task for task in project.demonstrations.tasks() if task]
    return {"coder": list(project.coding.people()), "task": tasks}
