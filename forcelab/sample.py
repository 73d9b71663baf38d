"""The sample project: simulated demonstrations of every task, for machines without tongs."""

from __future__ import annotations

import tempfile
from collections.abc import Generator, Iterable
from os import PathLike
from pathlib import Path

from forcelab.errors import InputError
from forcelab.jobs import Progress, job
from forcelab.project import DemonstrationInfo, Project
from forcelab.project.database import FILE
from forcelab.simulation.origin import Origin
from forcelab.simulation.scene import TASKS

__all__ = ["CODER", "LABELLED", "UNLABELLED", "UNSYNCHRONISED", "first_to_label", "make_sample_job"]

#: The seed of the sample project, and how many demonstrations it has of each task.
SEED, COUNT = 1, 6
#: Who labelled which numbers. The second coder's labels are for comparing the two.
LABELLED = {"Ines": (1, 2, 3, 4, 5), "Tomas": (1, 2, 3)}
#: The coder from whose labels is learnt, and the task that the recogniser was trained on.
CODER, RECOGNISED = "Ines", "LEGO"
#: The numbers left for trying out labelling, and synchronising by the taps.
UNLABELLED, UNSYNCHRONISED = (6,), (5,)
#: Where the window begins: it waits to be labelled, with few actions, and others are labelled.
FIRST = Origin("foam", SEED, UNLABELLED[0])


@job
def make_sample_job(path: str | PathLike[str], jobs: int = 1) -> Generator[Progress, None, bool]:
    """Make the sample project, unless it is there.

    It takes its name once it is complete. What somebody did in it since then stays.

    Parameters
    ----------
    path : path-like
        Its folder; may exist if it is empty or the sample project.
    jobs : int
        Processes that share the work; the result is the same for any number.

    Returns
    -------
    bool
        Whether it was made; False where it was there already.

    Raises
    ------
    InputError
        If something else is there, or the disk is full; nothing is left behind then.
    """
    path = Path(path)
    if not Project.vacant(path):
        _check(path)
        return False
    # What making one needs is loaded only now.
    from forcelab.recognition.dataset import DataSelection
    from forcelab.recognition.experiments import train_tasks_job
    from forcelab.recognition.presets import preset
    from forcelab.simulation.generate import Job, produce_demonstrations

    orders = [
        Job(
            origin,
            coders=tuple(name for name, numbers in LABELLED.items() if origin.number in numbers),
            synchronised=origin.number not in UNSYNCHRONISED,
        )
        for origin in _origins()
    ]
    with (
        Project.creating(path) as project,
        tempfile.TemporaryDirectory(dir=project.path) as scratch,  # goes where the project goes
    ):
        demonstrations = yield from produce_demonstrations(orders, Path(scratch), jobs)
        yield Progress(len(orders), len(orders), f"writing {path.name}")
        project.demonstrations.add_all(demonstrations)
        settings = preset("paper").replace(stride=10)
        yield from train_tasks_job(
            project, settings, DataSelection((RECOGNISED,), author=CODER), RECOGNISED
        )
    return True


def _origins() -> tuple[Origin, ...]:
    """Where the demonstrations of the sample project come from."""
    numbers = range(1, COUNT + 1)
    return tuple(Origin(task, SEED, number) for task in TASKS for number in numbers)


def first_to_label(infos: Iterable[DemonstrationInfo]) -> str:
    """Id of the demonstration to begin with in the sample project; empty if this is another."""
    ids = {info.source: info.id for info in infos}
    return ids[str(FIRST)] if ids.keys() >= set(map(str, _origins())) else ""


def _check(path: Path) -> None:
    """Refuse what is there if it is not the whole sample project."""
    other = f"'{path}' is there already and is not the sample project; choose another folder."
    if not (path / FILE).is_file():
        raise InputError(other)
    with Project.open(path) as project:
        complete = first_to_label(project.demonstrations.infos())
        trained = {recogniser.name for recogniser in project.runs.recognisers()}
    if not complete or RECOGNISED not in trained:
        raise InputError(other)
