"""Recognition measured on tasks of a project, which is left as it is; each task by itself."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Generator, Sequence

from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.labels import is_model
from forcelab.measure.recognition import ERROR, FOLDS, SECONDS, measuring
from forcelab.measure.recognition_settings import QUICK, VARIANTS
from forcelab.measure.rows import Row, Table, with_front
from forcelab.project import Project
from forcelab.recognition.dataset import Corpus, corpus
from forcelab.recognition.examples import Labelled

__all__ = ["Measuring", "Rows", "measured_tasks", "rows_of_tasks", "size_of", "usual_coder"]

Rows = Generator[Progress, None, tuple[Row, ...]]
#: Takes what is labelled of a task, and what the rows call that.
Measuring = Callable[[Sequence[Labelled], str], Rows]


def usual_coder(project: Project, task: str) -> str:
    """The coder who labelled most demonstrations of a task.

    Raises
    ------
    InputError
        If nobody labelled any.
    """
    names = (name for info in project.demonstrations.infos(task) for name in info.labelled)
    count = Counter(name for name in names if not is_model(name))
    if not count:
        raise InputError(f"Nothing of the task '{task}' is labelled; label at least two actions.")
    return count.most_common(1)[0][0]


def size_of(task: str, found: Corpus) -> str:
    """What the rows call what is labelled of a task."""
    used = [item.demonstration for item in found.labelled if item.segments]
    seconds = sum(demonstration.duration for demonstration in used)
    return f"{task}, {len(used)} demonstrations, {seconds:.0f} s"


def measured_tasks(
    project: Project,
    tasks: Sequence[str],
    author: str | None = None,
    *,
    quick: bool = False,
    thorough: bool = False,
) -> Generator[Progress, None, Table]:
    """Measure recognition on tasks of a project.

    Parameters
    ----------
    project : Project
    tasks : sequence of str
        Each by itself; all of the project's where there are none.
    author : str, optional
        The coder; by default whoever labelled most of a task.
    quick : bool
        Only a few variants.
    thorough : bool
        Leave out one demonstration at a time, however many there are.

    Raises
    ------
    InputError
        If no task can be measured, or there is none.
    """

    def presets(labelled: Sequence[Labelled], size: str) -> Rows:
        folds = None if thorough else FOLDS
        variants = QUICK if quick else VARIANTS
        return with_front((yield from measuring(labelled, variants, size, folds)))

    rows = yield from rows_of_tasks(project, tasks, author, "recognition", presets)
    return Table("Recognition against run time", ERROR, SECONDS, rows, ".3f")


def rows_of_tasks(
    project: Project, tasks: Sequence[str], author: str | None, name: str, measure: Measuring
) -> Rows:
    """The rows of all tasks, of which one at least could be measured."""
    rows: list[Row] = []
    for task in tuple(tasks) or project.demonstrations.tasks():
        rows += yield from _of_task(project, task, author, name, measure)
    if not rows:
        raise InputError(f"'{project.path}' has nothing to measure; import recordings first.")
    if not any(row.point for row in rows):
        whys = dict.fromkeys(row.refusal for row in rows)
        raise InputError(" ".join([f"Nothing can be measured in '{project.path}'.", *whys]))
    return tuple(rows)


def _of_task(
    project: Project, task: str, author: str | None, name: str, measure: Measuring
) -> Rows:
    """The rows of a task; a single one with its refusal where it cannot be measured."""
    try:
        found = corpus(project, [task], author or usual_coder(project, task))
        return (yield from measure(found.labelled, size_of(task, found)))
    except InputError as error:
        return (Row(name, "all", task, "the coder's labels", refusal=str(error)),)
