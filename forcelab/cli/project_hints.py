"""Names that a command brings into a project although nearly the same ones are there."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from forcelab.cli.output import printable
from forcelab.project import Project
from forcelab.text import name_alike

__all__ = ["hint_at_new_names"]


@contextmanager
def hint_at_new_names(path: Path) -> Iterator[None]:
    """Say after the block which new coder or task differs from an old one by case or spaces only.

    Parameters
    ----------
    path : Path
        The project's folder; may be made by the block.
    """
    before = {} if Project.vacant(path) else _names(path)
    yield
    for what, names in _names(path).items():
        old = before.get(what, [])
        for at, name in enumerate(names):
            # Of two that came together the second one is told of.
            others = old or names[:at]
            if name not in old and (there := name_alike(name, others)) is not None:
                print(printable(f"'{name}' is a new {what} beside '{there}'."), file=sys.stderr)


def _names(path: Path) -> dict[str, list[str]]:
    """The coders and tasks of a project."""
    with Project.open(path) as project:
        tasks = [task for task in project.demonstrations.tasks() if task]
        return {"coder": list(project.coding.people()), "task": tasks}
