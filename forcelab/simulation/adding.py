"""Simulated demonstrations into a project: all of them or none."""

from __future__ import annotations

import tempfile
from collections.abc import Generator, Sequence
from os import PathLike
from pathlib import Path

from forcelab.jobs import Progress
from forcelab.project import Added, Project
from forcelab.simulation.origin import Origin
from forcelab.simulation.production import Order, producing

__all__ = ["simulating"]


def simulating(
    path: str | PathLike[str], origins: Sequence[Origin], *, video: bool = True, jobs: int = 1
) -> Generator[Progress, None, tuple[Added, ...]]:
    """Simulate demonstrations, labelled by every simulated coder, and add them to a project.

    To stop iterating cancels it; nothing is written before all of them are made.

    Parameters
    ----------
    path : path-like
        The project's folder; made if there is none.
    origins : sequence of Origin
        What to make.
    video : bool
        Whether to film them; without, OpenCV is never loaded.
    jobs : int
        Processes that share the work.

    Returns
    -------
    tuple of Added
        What became of each; one that is there already is unchanged.

    Raises
    ------
    InputError
        If the folder is no project or may not be written, or the disk is full. The project is as
        it was then, and one that did not exist does not exist afterwards either.
    """
    path = Path(path)
    new = Project.vacant(path)
    if not new:
        with Project.open(path) as project:
            project.refuse_read_only()  # before the work and not after it
    orders = [Order(origin, video=video) for origin in origins]
    with tempfile.TemporaryDirectory(prefix="forcelab-") as scratch:
        given = yield from producing(orders, Path(scratch), jobs)
        yield Progress(len(orders), len(orders), f"writing {path.name}")
        with Project.creating(path) if new else Project.open(path) as project:
            return project.add_all(given)
