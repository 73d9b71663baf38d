"""The simulated tongs beside real recordings of the same tasks in a project."""

from __future__ import annotations

import tempfile
from collections.abc import Generator
from dataclasses import dataclass, replace
from pathlib import Path

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.labels import Segments
from forcelab.measure.realism import PUBLISHED, Comparison, realism, recognition
from forcelab.project import Project
from forcelab.recognition.corpus import corpus
from forcelab.recognition.examples import Labelled
from forcelab.simulation.coders import CODERS
from forcelab.simulation.origin import Origin
from forcelab.simulation.production import Order, producing
from forcelab.simulation.scene import TASKS, Task

__all__ = ["Beside", "comparing", "simulated_beside"]

#: Real recordings start and end this long before and after what is labelled, s.
LEAD = 0.08


@dataclass(frozen=True)
class Beside:
    """One task's comparison.

    Parameters
    ----------
    task : str
    simulated, real : int
        Number of demonstrations.
    rows : tuple of Comparison
    """

    task: Task
    simulated: int
    real: int
    rows: tuple[Comparison, ...]


def comparing(
    path: Path, author: str | None = None, count: int = 10, seed: int = 1, jobs: int = 1
) -> Generator[Progress, None, tuple[Beside, ...]]:
    """Simulate the tasks of a project of real recordings, and compare.

    Parameters
    ----------
    path : Path
        A project with labelled demonstrations of at least one task that can be simulated.
    author : str, optional
        Whose labels; may be left out where there is one coder.
    count, seed : int
        How many demonstrations of each task are simulated, and from what. The first of the
        simulated coders labels them.
    jobs : int
        Processes that share the work.

    Yields
    ------
    Progress

    Returns
    -------
    tuple of Beside
        One for each task, the recognition by preset ``paper`` included.

    Raises
    ------
    InputError
        If no task of the project can be simulated, or recordings cannot be compared.
    """
    result = []
    with Project.open(path) as project:
        tasks = [task for task in TASKS if task in project.tasks()]
        if not tasks:
            raise InputError(
                f"'{path}' has none of the tasks that can be simulated ({', '.join(TASKS)}); "
                f"import recordings with --task and one of these names."
            )
        for task in tasks:
            real = corpus(project, (task,), author).labelled
            simulated = yield from simulated_beside(task, count, seed, jobs)
            rows = realism(simulated, real, PUBLISHED)
            rows += yield from recognition(simulated, real, PUBLISHED, jobs=jobs)
            result.append(Beside(task, len(simulated), len(real), rows))
    return tuple(result)


def simulated_beside(
    task: Task, count: int, seed: int, jobs: int
) -> Generator[Progress, None, list[Labelled]]:
    """Simulate demonstrations of a task as the paper's were recorded: without video and taps.

    Parameters
    ----------
    task : str
    count, seed, jobs : int
        As of :func:`comparing`.

    Yields
    ------
    Progress

    Returns
    -------
    list of Labelled
        By the first of the simulated coders.
    """
    coder = CODERS[0].name
    orders = [
        Order(Origin(task, seed, number), coders=(coder,), video=False)
        for number in range(1, count + 1)
    ]
    with tempfile.TemporaryDirectory() as scratch:
        made = yield from producing(orders, Path(scratch), jobs)
    return [
        Labelled(_task_only(one.demonstration, one.tracks[0].segments), one.tracks[0].segments)
        for one in made
    ]


def _task_only(demonstration: Demonstration, segments: Segments) -> Demonstration:
    """A demonstration without its taps, which the real recordings do not have."""
    times = demonstration.times
    kept = (times >= segments[0].start - LEAD) & (times < segments[-1].end + LEAD)
    return replace(demonstration, times=times[kept], signals=demonstration.signals[kept])
