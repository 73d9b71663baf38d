"""The sample project: simulated demonstrations of every task, for machines without tongs."""

from __future__ import annotations

import tempfile
from collections.abc import Generator, Iterable
from os import PathLike
from pathlib import Path
from typing import Final

from forcelab.errors import InputError
from forcelab.io import write_atomically
from forcelab.jobs import Progress, job
from forcelab.project import DemonstrationInfo, Project
from forcelab.project.database import FILE
from forcelab.resources import asset
from forcelab.simulation.origin import Origin
from forcelab.simulation.scene import TASKS, Task

#: The seed of the sample project, and how many demonstrations it has of each task.
SEED, COUNT = 1, 6
#: Who labelled which numbers. The second coder's labels are for comparing the two.
LABELLED = {"Ines": (1, 2, 3, 4, 5), "Tomas": (1, 2, 3)}
#: The coder from whose labels is learnt, and the task that the recogniser was trained on.
CODER: Final = "Ines"
RECOGNISED: Task = "LEGO"
#: The small sample project has these tasks alone, no videos, and learns the second one.
SMALL: tuple[Task, ...] = ("foam", "stylus")
#: The numbers left for trying out labelling, and synchronising by the taps.
UNLABELLED, UNSYNCHRONISED = (6,), (5,)
#: Where the window begins: it waits to be labelled, with few actions, and others are labelled.
FIRST = Origin("foam", SEED, UNLABELLED[0])


@job
def make_sample_job(
    path: str | PathLike[str], jobs: int = 1, *, small: bool = False
) -> Generator[Progress, None, bool]:
    """Make the sample project, unless it is there.

    It takes its name once it is complete. What somebody did in it since then stays.

    Parameters
    ----------
    path : path-like
        Its folder; may exist if it is empty or the sample project.
    jobs : int
        Processes that share the work; the result is the same for any number.
    small : bool
        Whether two of the tasks without videos will do; that takes seconds. The forces and labels
        of these are the same.

    Returns
    -------
    bool
        Whether it was made; False where it was there already.

    Raises
    ------
    InputError
        If something else is there, or the disk is full; nothing is left behind then.

    Examples
    --------
    >>> job = forcelab.make_sample_job("sample.forcelab")
    >>> forcelab.finish(job)  # doctest: +SKIP
    True
    >>> job.close()  # not made after all: it takes a minute
    """
    path = Path(path)
    if not Project.vacant(path):
        _check(path, small)
        return False
    # What making one needs is loaded only now.
    from forcelab.recognition.dataset import DataSelection
    from forcelab.recognition.presets import preset
    from forcelab.recognition.project_runs import train_tasks_job
    from forcelab.simulation.generate import Order, produce_demonstrations

    orders = [
        Order(
            origin,
            coders=tuple(name for name, numbers in LABELLED.items() if origin.number in numbers),
            video=not small,
            synchronised=origin.number not in UNSYNCHRONISED,
        )
        for origin in _origins(SMALL if small else TASKS)
    ]
    recognised = SMALL[-1] if small else RECOGNISED
    with (
        Project.creating(path) as project,
        tempfile.TemporaryDirectory(dir=project.path) as scratch,  # goes where the project goes
    ):
        demonstrations = yield from produce_demonstrations(orders, Path(scratch), jobs)
        yield Progress(len(orders), len(orders), f"writing {path.name}")
        project.demonstrations.add_all(demonstrations)
        settings = preset("paper").replace(stride=10)
        yield from train_tasks_job(
            project, settings, DataSelection((recognised,), author=CODER), recognised
        )
    return True


def write_recordings(folder: str | PathLike[str]) -> tuple[Path, ...]:
    """Write the example recordings, to try an import on: six tables of forces and labels.

    The folder is made if need be, and files of other names stay. Nothing is written if another file
    has one of the names.
    """
    from forcelab.formats.output_folder import output_folder  # loads all that reads and writes

    folder = Path(folder)
    sources = sorted(asset("foam-01.csv").parent.glob("foam-*.csv"))
    files = {folder / source.name: source.read_bytes() for source in sources}
    with output_folder(folder):
        for path, content in files.items():
            if path.exists() and not (path.is_file() and path.read_bytes() == content):
                raise InputError(f"'{path}' is there already and differs; choose another folder.")
        for path, content in files.items():
            if not path.exists():
                write_atomically(path, content)
    return tuple(files)


def _origins(tasks: Iterable[Task]) -> tuple[Origin, ...]:
    """Where the demonstrations of the sample project come from."""
    numbers = range(1, COUNT + 1)
    return tuple(Origin(task, SEED, number) for task in tasks for number in numbers)


def first_to_label(infos: Iterable[DemonstrationInfo]) -> str:
    """Id of the demonstration to begin with in the sample project; empty if this is another."""
    ids = {info.source: info.id for info in infos}
    return ids[str(FIRST)] if ids.keys() >= set(map(str, _origins(SMALL))) else ""


def _check(path: Path, small: bool) -> None:
    """Refuse what is not the sample project, or the small one where the whole is asked for."""
    other = InputError(
        f"'{path}' is there already and is not the sample project; choose another folder."
    )
    if not (path / FILE).is_file():
        raise other
    with Project.open(path) as project:
        sources = {info.source for info in project.demonstrations.infos()}
        trained = {recogniser.name for recogniser in project.runs.recognisers()}

    def holds(tasks: Iterable[Task], recognised: Task) -> bool:
        return recognised in trained and sources >= set(map(str, _origins(tasks)))

    if holds(TASKS, RECOGNISED) or (small and holds(SMALL, SMALL[-1])):
        return
    if holds(SMALL, SMALL[-1]):
        raise InputError(f"'{path}' is the small sample project; choose another folder.")
    raise other
