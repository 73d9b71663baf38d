"""The simulated tongs beside real recordings of the same tasks in a project."""

from __future__ import annotations

import tempfile
from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.labels import Segments
from forcelab.measure.realism import Comparison, realism, recognition
from forcelab.measure.statistics import figures
from forcelab.merging import MergeMap
from forcelab.project import Project
from forcelab.recognition.corpus import corpus
from forcelab.recognition.examples import Labelled
from forcelab.simulation.coders import CODERS
from forcelab.simulation.origin import Origin, origins
from forcelab.simulation.production import Order, producing
from forcelab.simulation.scene import TASKS, Task

__all__ = ["PUBLISHED", "Beside", "comparing", "simulated_beside"]

#: Real recordings start and end this long before and after what is labelled, s.
LEAD = 0.08
#: Leaving one demonstration out leaves something to learn from.
FEWEST = 2
#: How the recordings published with the paper spell the actions.
PUBLISHED = MergeMap(
    {
        "grab_pen": "grab",
        "pull_pen": "pull",
        "slip_pen": "slip",
        "sliptransition_pen": "slip transition",
        "slipped_pen": "slipped",
        "grab_soft": "grab",
        "hold_soft": "hold",
        "release_soft": "release",
    }
)


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
        A project with two labelled demonstrations or more of each task that is labelled and can
        be simulated; there is at least one such task.
    author : str, optional
        Whose labels; may be left out where there is one coder.
    count, seed : int
        How many demonstrations of each task are simulated, at least 2, and from what. The first
        of the simulated coders labels them.
    jobs : int
        Processes that share the work.

    Returns
    -------
    tuple of Beside
        One for each task, the recognition by preset ``paper`` included.

    Raises
    ------
    InputError
        If the count or the seed is out of its range, too little of the project is labelled, or
        its recordings cannot be compared; before anything is simulated.
    """
    if count < FEWEST:
        raise InputError(
            f"A comparison needs {FEWEST} simulated demonstrations or more, not {count}: each is "
            f"recognised from the others."
        )
    # Whatever can be refused is refused before the first is simulated, which takes its time.
    wanted = {task: origins(task, count, seed) for task in TASKS}
    recorded = _recorded(path, author)
    result = []
    for task, real in recorded.items():
        simulated = yield from simulated_beside(wanted[task], jobs)
        rows = realism(simulated, real)
        rows += yield from recognition(simulated, real, jobs=jobs)
        result.append(Beside(task, len(simulated), len(real), rows))
    return tuple(result)


def _recorded(path: Path, author: str | None) -> dict[Task, list[Labelled]]:
    """The labelled demonstrations of a project, by task, spelled as ours; each can be compared."""
    result: dict[Task, list[Labelled]] = {}
    with Project.open(path) as project:
        tasks = [task for task in TASKS if any(i.authors for i in project.demonstrations(task))]
        if not tasks:
            raise InputError(
                f"'{path}' has no labelled demonstration of a task that can be simulated "
                f"({', '.join(TASKS)}); import some as a task of one of these names."
            )
        for task in tasks:
            found = corpus(project, (task,), author, merge=PUBLISHED)
            real = [one for one in found.labelled if one.segments]
            if len(real) < FEWEST:
                raise InputError(
                    f"'{path}' has too few labelled demonstrations of the task '{task}', "
                    f"{len(real)}; a comparison needs {FEWEST} or more."
                )
            figures(real, ())  # refuses what has no 3-axis force sensor
            result[task] = real
    return result


def simulated_beside(
    wanted: Sequence[Origin], jobs: int = 1
) -> Generator[Progress, None, list[Labelled]]:
    """Simulate demonstrations as the paper's were recorded: without video and taps.

    Parameters
    ----------
    wanted : sequence of Origin
    jobs : int
        Processes that share the work.

    Returns
    -------
    list of Labelled
        By the first of the simulated coders.
    """
    coder = CODERS[0].name
    orders = [Order(origin, coders=(coder,), video=False) for origin in wanted]
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
