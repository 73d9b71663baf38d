"""Evaluating and training on a project, with the results kept in it."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass

from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.project import Project
from forcelab.recognition.corpus import corpus
from forcelab.recognition.evaluation import Evaluation, across, leave_one_out
from forcelab.recognition.examples import Labelled
from forcelab.recognition.recogniser import Recogniser
from forcelab.recognition.settings import Settings
from forcelab.recognition.storage import dump
from forcelab.recognition.training import training
from forcelab.versions import versions

__all__ = ["Choice", "evaluate_tasks", "train_tasks"]


@dataclass(frozen=True)
class Choice:
    """Which demonstrations of a project are meant.

    Parameters
    ----------
    tasks : tuple of str
        Joined into one; empty means every task.
    author : str, optional
        The coder; may be left out where there is only one.
    apart : bool
        Whether joined tasks keep their actions apart, ``grab`` becoming ``grab_TASK``.
    """

    tasks: tuple[str, ...] = ()
    author: str | None = None
    apart: bool = False


def evaluate_tasks(
    project: Project,
    settings: Settings,
    choice: Choice,
    test_task: str | None = None,
    jobs: int = 1,
) -> Generator[Progress, None, tuple[list[Evaluation], tuple[str, ...]]]:
    """Evaluate on a project; each evaluation is kept in it as a run.

    The chosen tasks are one evaluation. With none chosen every task is one by itself, and those
    that cannot be evaluated are left out.

    Parameters
    ----------
    project : Project
    settings : Settings
    choice : Choice
    test_task : str, optional
        Test on this task instead of leaving one demonstration out.
    jobs : int
        Processes that share the work.

    Yields
    ------
    Progress

    Returns
    -------
    evaluations : list of Evaluation
        At least one.
    left_out : tuple of str
        A sentence for each task that was left out.

    Raises
    ------
    InputError
        If what was chosen cannot be evaluated, or no task can.
    """
    groups = [choice.tasks] if choice.tasks else [(t,) for t in project.tasks() if t != test_task]
    if not groups:
        raise InputError(f"'{project.path}' has nothing to evaluate; import recordings first.")
    evaluations: list[Evaluation] = []
    refusals: list[InputError] = []
    for tasks in groups:
        try:
            evaluation = yield from _evaluating(project, settings, tasks, choice, test_task, jobs)
        except InputError as error:
            refusals.append(error)
            continue
        evaluations.append(evaluation)
        used = [*evaluation.trained_on, *(item.id for item in evaluation.tested)]
        project.add_run(
            "evaluate",
            settings=settings.to_json(),
            seed=settings.seed,
            demonstrations=list(dict.fromkeys(used)),
            versions=versions(),
            result=evaluation.to_json(),
        )
    if not evaluations:
        raise refusals[0]
    return evaluations, tuple(f"A task was left out: {error}" for error in refusals)


def _evaluating(
    project: Project,
    settings: Settings,
    tasks: Sequence[str],
    choice: Choice,
    test_task: str | None,
    jobs: int,
) -> Generator[Progress, None, Evaluation]:
    """One evaluation of joined tasks."""

    def chosen(tasks: Sequence[str]) -> list[Labelled]:
        return corpus(project, tasks, choice.author, merge=settings.merge, apart=choice.apart)

    title = " + ".join(tasks) or "no task"
    if test_task is None:
        return (yield from leave_one_out(chosen(tasks), settings, title, jobs))
    title = f"{title} → {test_task}"
    return (yield from across(chosen(tasks), chosen([test_task]), settings, title))


def train_tasks(
    project: Project, settings: Settings, choice: Choice, name: str
) -> Generator[Progress, None, tuple[Recogniser, bytes]]:
    """Train a recogniser on a project, which keeps a copy of it.

    Parameters
    ----------
    project : Project
    settings : Settings
    choice : Choice
        All chosen demonstrations are trained on together.
    name : str
        What the recogniser is called in the project.

    Yields
    ------
    Progress

    Returns
    -------
    recogniser : Recogniser
    content : bytes
        Its file.

    Raises
    ------
    InputError
        If too little is labelled.
    """
    tasks = choice.tasks or project.tasks()
    labelled = corpus(project, tasks, choice.author, merge=settings.merge, apart=choice.apart)
    recogniser = yield from training(labelled, settings)
    content = dump(recogniser)
    project.add_recogniser(
        name,
        content,
        settings=settings.to_json(),
        seed=settings.seed,
        demonstrations=recogniser.trained_on,
        versions=versions(),
    )
    return recogniser, content
