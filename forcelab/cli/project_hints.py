"""Hints at names that a command brings into a project although it has nearly the same ones."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from forcelab.cli.output import printable
from forcelab.project import Project
from forcelab.text import name_alike


@contextmanager
def hint_at_new_names(path: Path) -> Iterator[None]:
    """Print after the block which new coders or tasks differ from old ones by case or spaces."""
    before = {} if Project.vacant(path) else _names(path)
    yield
    for what, names in _names(path).items():
        old = before.get(what, [])
        for at, name in enumerate(names):
            # Of two that came together the second one is told of.
            others = old or names[:at]
            if name not in old and (similar := name_alike(name, others)) is not None:
                print(printable(f"'{name}' is a new {what} beside '{similar}'."), file=sys.stderr)


def _names(path: Path) -> dict[str, list[str]]:
    with Project.open(path) as project:
        tasks = [task for task in project.demonstrations.tasks() if task]
        return {"coder": list(project.coding.people()), "task": tasks}
