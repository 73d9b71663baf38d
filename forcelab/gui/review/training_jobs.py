"""What the trainer of the window has done in the background."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from forcelab.project import Project, RunSummary
    from forcelab.recognition.dataset import Choice
    from forcelab.recognition.settings import Settings
    from forcelab.review.run_result import Outcome
    from forcelab.review.training import Step

__all__ = ["BACKGROUND", "Given", "Kept", "Work"]


#: Gives settings and choice.
Given = Callable[[], "tuple[Settings, Choice]"]


@dataclass(frozen=True, slots=True)
class Kept:
    """A run that the project keeps, as a list tells it.

    Parameters
    ----------
    number : int
    time : datetime
        In UTC.
    title : str
        What was evaluated, such as ``"stylus"``.
    tasks : tuple of str
        Those trained on, and the one tested on.
    f1 : float or None
        Pooled segmental F1 at half overlap after the filters, from 0 to 1; None where nothing was
        tested.
    preset : str
        The one that its settings began with.
    tested : str, optional
        The task tested on; without, each demonstration was left out once.
    """

    number: int
    time: datetime
    title: str
    tasks: tuple[str, ...]
    f1: float | None
    preset: str = ""
    tested: str | None = None


def _removing(path: Path, number: int) -> Generator[object, None, None]:
    """Remove a run; to make the store's file smaller may take seconds."""
    from forcelab.project import Project

    yield None
    with Project.open(path) as project:
        project.remove_run(number)


@dataclass(frozen=True, slots=True)
class Work:
    """The jobs of the trainer; each works on what the disk holds, with a connection of its own.

    Parameters
    ----------
    train : callable
        ``train(path, given, name, trail)``: makes a run, and gives its outcome. `given` gives
        settings and choice; called there, as to build them loads much. Every step is put at the
        end of the list `trail`, also those that nobody had time to show.
    load : callable
        ``load(path, number)``: gives the outcome of a run.
    listed : callable
        ``listed(path)``: gives every run that can be reviewed, the latest first.
    edits : callable
        ``edits(project, outcome)``: how many edits there were since it was trained; no job, as it
        takes no time.
    remove : callable
        ``remove(path, number)``: removes a run for good.
    """

    train: Callable[[Path, Given, str, list[Step]], Generator[object, None, Outcome]]
    load: Callable[[Path, int], Generator[object, None, Outcome]]
    listed: Callable[[Path], Generator[object, None, tuple[Kept, ...]]]
    edits: Callable[[Project, Outcome], int]
    remove: Callable[[Path, int], Generator[object, None, None]] = _removing


def _training(
    path: Path, given: Given, name: str, trail: list[Step]
) -> Generator[object, None, Outcome]:
    """Train in a process of its own, then read what it has stored."""
    from forcelab.process import elsewhere
    from forcelab.review.training import Step, reviewing

    yield None
    job = elsewhere(reviewing, path, *given(), name)
    try:
        while True:
            try:
                step = next(job)
            except StopIteration as end:
                number: int = end.value
                break
            if isinstance(step, Step) and (not trail or step is not trail[-1]):
                trail.append(step)
            yield step
    finally:
        job.close()
    return (yield from _loading(path, number))


def _loading(path: Path, number: int) -> Generator[object, None, Outcome]:
    """Read what a run found."""
    from forcelab.project import Project
    from forcelab.review.run_result import load

    yield None
    with Project.open(path) as project:
        return load(project, number)


def _listing(path: Path) -> Generator[object, None, tuple[Kept, ...]]:
    """Read which runs there are."""
    from forcelab.project import Project

    yield None
    with Project.open(path) as project:
        runs = project.run_summaries("evaluate")
    return tuple(_kept(run) for run in reversed(runs))


def _kept(run: RunSummary) -> Kept:
    """A run as the list tells it."""
    choice = run.settings.get("choice", {})
    tasks = [*choice.get("tasks", ()), choice.get("test_task")]
    return Kept(
        number=run.id,
        time=run.time,
        title=str(run.digest.get("title", "")),
        tasks=tuple(task for task in tasks if task is not None),
        f1=run.digest.get("f1"),
        preset=str(run.settings.get("preset", "")),
        tested=choice.get("test_task"),
    )


def _edits(project: Project, outcome: Outcome) -> int:
    """How many edits were made of the labels that an outcome rests on."""
    from forcelab.review.run_result import edits_since

    return edits_since(project, outcome)


#: What the window uses.
BACKGROUND = Work(_training, _loading, _listing, _edits)
