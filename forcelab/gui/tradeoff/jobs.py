"""What the Trade-off workspace has done in the background."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from forcelab.measure.recognition_runs import Measured
    from forcelab.project import Project, RunSummary
    from forcelab.recognition.settings import Settings

__all__ = ["BACKGROUND", "MEASURING", "Work"]

#: The key of the job that measures: nobody waits for it in front of the screen.
MEASURING = "measuring recognition"


@dataclass(frozen=True, slots=True)
class Work:
    """The jobs of the workspace; each works on what the disk holds, with its own connection.

    Parameters
    ----------
    measure : callable
        ``measure(path, task, author, settings)``: measures, and gives what came of it.
    latest : callable
        ``latest(path, task, viewer)``: gives the latest measurement of a task that a coder may see;
        None where there is none.
    """

    measure: Callable[[Path, str, str | None, Settings], Generator[object, None, Measured]]
    latest: Callable[[Path, str, str], Generator[object, None, Measured | None]]


def _measuring(
    path: Path, task: str, author: str | None, settings: Settings
) -> Generator[object, None, Measured]:
    """Measure in a process of its own, then read what it has stored."""
    from forcelab.measure.recognition_runs import keeping, load
    from forcelab.process import elsewhere
    from forcelab.project import Project

    number = yield from elsewhere(keeping, path, task, author, settings)
    with Project.open(path) as project:
        return load(project, number)


def _latest(path: Path, task: str, viewer: str) -> Generator[object, None, Measured | None]:
    """Read the latest measurement."""
    from forcelab.measure.recognition_runs import KIND, load
    from forcelab.project import Project

    yield None
    with Project.open(path) as project:
        for run in reversed(project.run_summaries(KIND)):
            tasks = run.settings.get("choice", {}).get("tasks")
            if tasks == [task] and _may_see(project, run, viewer):
                return load(project, run.id)
            yield None
    return None


def _may_see(project: Project, run: RunSummary, viewer: str) -> bool:
    """Whether a run rests on no labels that are hidden from a coder."""
    return not any(
        used.author != viewer and used.edit and project.is_blind(used.demonstration, viewer)
        for used in run.labels
    )


#: What the window uses.
BACKGROUND = Work(_measuring, _latest)
