"""Evaluating and training on a project, with the results kept in it."""

from __future__ import annotations

from collections.abc import Collection, Generator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from forcelab.errors import InputError, UnclearAuthorError
from forcelab.jobs import Progress
from forcelab.project import Project
from forcelab.recognition.cross_validation import Job, across, leave_one_out, leave_one_out_live
from forcelab.recognition.dataset import Choice, Corpus
from forcelab.recognition.examples import mixed_units
from forcelab.recognition.label_noise import remark_on
from forcelab.recognition.recogniser import Recogniser
from forcelab.recognition.results import Evaluation, kept, title_of
from forcelab.recognition.settings import Settings
from forcelab.recognition.storage import dump
from forcelab.recognition.training import training
from forcelab.resources import versions


@dataclass(frozen=True)
class Evaluated:
    """What came of evaluating a project.

    Parameters
    ----------
    evaluations : list of (tuple of str, Evaluation)
        At least one, each with its tasks.
    joined : bool
        Whether one evaluation was asked for, not one a task.
    remarks : tuple of str
        A sentence for each task that could not be evaluated, and on an idle merge map.
    """

    evaluations: list[tuple[tuple[str, ...], Evaluation]]
    joined: bool
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class Trained:
    """A recogniser trained on a project.

    Parameters
    ----------
    recogniser : Recogniser
    content : bytes
        Its file.
    remarks : tuple of str
        A sentence for each thing worth a look.
    """

    recogniser: Recogniser
    content: bytes
    remarks: tuple[str, ...]


def evaluate_tasks(
    project: Project,
    settings: Settings,
    choice: Choice,
    jobs: int = 1,
    *,
    certainty: bool = False,
    latency: float | None = None,
) -> Generator[Progress, None, Evaluated]:
    """Evaluate on a project; each evaluation is kept in it as a run.

    Those of streams, of demonstrations by their names and of adapted ones are not.

    The chosen tasks are one evaluation. With none chosen every task is one by itself, and those
    that cannot be evaluated are left out.

    Parameters
    ----------
    project : Project
    settings : Settings
    choice : Choice
    jobs : int
        Processes that share the work.
    certainty : bool
        Whether the runs also keep how certain each prediction is, and what each filter led to.
    latency : float, optional
        Evaluate as if demonstrations came live, labels so many seconds after their force.

    Yields
    ------
    Progress

    Returns
    -------
    Evaluated

    Raises
    ------
    UnclearAuthorError
        If several coders labelled, none was chosen, and no task can be evaluated without.
    InputError
        If what was chosen cannot be evaluated, or no task can.
    """
    choice.check()
    if latency is not None and not choice.leaves_out:
        raise InputError(
            "With a latency demonstrations are left out in turn; choose nothing to test on."
        )
    passing = _passing(choice, latency)
    chosen = tuple(dict.fromkeys(choice.tasks))
    every = [(task,) for task in project.demonstrations.tasks() if task != choice.test_task]
    groups = [chosen] if chosen else every
    if not groups and project.demonstrations.tasks():
        raise InputError(
            f"'{project.path}' has no task but '{choice.test_task}', so there is none to train on; "
            "name no task to test on, and its demonstrations are left out in turn."
        )
    if not groups:
        raise InputError(f"'{project.path}' has nothing to evaluate; import recordings first.")
    evaluations: list[tuple[tuple[str, ...], Evaluation]] = []
    refusals: list[str] = []
    mixed: list[str] = []
    unclear: UnclearAuthorError | None = None
    spelt: set[str] = set()
    for tasks in groups:
        try:
            corpora = choice.parts(project, tasks, settings)
            settled = choice.settled(corpora[0])
            if latency is None:
                job = evaluating(corpora, settings, tasks, settled, jobs, certainty=certainty)
            else:
                title = title_of(tasks, None)
                job = leave_one_out_live(
                    corpora[0].labelled, settings, latency, title, settled.folds
                )
            evaluation = yield from job
        except InputError as error:
            if len(groups) == 1:
                raise
            if isinstance(error, UnclearAuthorError):
                unclear = unclear or error
            refusals.append(f"Task '{tasks[0]}' was left out: {error}")
            continue
        evaluations.append((tasks, evaluation))
        spelt.update(*(part.spelt for part in corpora))
        mixed += unlike(corpora, settings)
        if project.read_only or passing:
            continue
        project.runs.add(
            "evaluate",
            settings=told(settings, settled, tasks),
            seed=settings.seed,
            labels=project.runs.existing_labels(
                labels for part in corpora for labels in part.labels
            ),
            versions=versions(),
            result=kept(evaluation, certainty=certainty),
        )
    if not evaluations:
        if unclear is not None:  # said once, not for every task
            raise unclear
        raise InputError(f"No task can be evaluated. {' '.join(refusals)}")
    remarks = (*refusals, *dict.fromkeys(mixed), *idle(settings, spelt), *_unkept(project))
    remarks += passing
    return Evaluated(evaluations, bool(chosen) or len(groups) == 1, remarks)


def _passing(choice: Choice, latency: float | None) -> tuple[str, ...]:
    """Why a result is kept as no run, in a sentence; nothing where it is kept."""
    options = {
        "a latency": latency is not None,
        "names to test on": choice.test_names is not None,
        "adaptation": choice.adapt,
    }
    asked = [name for name, there in options.items() if there]
    if not asked:
        return ()
    return (
        f"With {' and '.join(asked)} the result is kept as no run: a review trains again what it "
        f"explains, and would do so without.",
    )


def evaluating(
    corpora: Sequence[Corpus],
    settings: Settings,
    tasks: tuple[str, ...],
    choice: Choice,
    jobs: int = 1,
    *,
    certainty: bool,
) -> Job:
    """One evaluation of joined tasks.

    Parameters
    ----------
    corpora : sequence of Corpus
        As :meth:`~forcelab.recognition.dataset.Choice.parts` gives them.
    settings : Settings
    tasks : tuple of str
    choice : Choice
        Settled.
    jobs : int
    certainty : bool
        As of :func:`evaluate_tasks`.
    """
    if choice.leaves_out:
        title = title_of(tasks, None)
        labelled, folds = corpora[0].labelled, choice.folds
        return leave_one_out(labelled, settings, title, jobs, certainty=certainty, folds=folds)
    title = title_of(tasks, choice.test_task if choice.test_names is None else choice.test_names)
    train, test = (part.labelled for part in corpora)
    return across(train, test, settings, title, certainty=certainty, adapt=choice.adapt)


def told(settings: Settings, choice: Choice, tasks: Sequence[str]) -> dict[str, Any]:
    """Everything that was asked for, as plain values."""
    return settings.to_json() | {"choice": asdict(choice) | {"tasks": list(tasks)}}


def idle(settings: Settings, spelt: Collection[str]) -> tuple[str, ...]:
    """A remark on a merge map's spellings that nobody used."""
    unused = settings.merge.unused(spelt)
    return (f"The merge map names what nobody labelled: {', '.join(unused)}.",) if unused else ()


def unlike(corpora: Sequence[Corpus], settings: Settings) -> tuple[str, ...]:
    """A remark on labelled demonstrations whose channels have unlike units."""
    labelled = [item for part in corpora for item in part.labelled if item.segments]
    return mixed_units([item.demonstration for item in labelled], settings)


def _unkept(project: Project) -> tuple[str, ...]:
    """A remark where the project cannot keep the result."""
    try:
        project.refuse_read_only()
    except InputError as error:
        return (f"The result was not kept: {error}",)
    return ()


def train_tasks(
    project: Project, settings: Settings, choice: Choice, name: str
) -> Generator[Progress, None, Trained]:
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
    Trained

    Raises
    ------
    InputError
        If too little is labelled.
    """
    tasks = tuple(dict.fromkeys(choice.tasks)) or project.demonstrations.tasks()
    if len(tasks) > 1 and not choice.tasks:
        raise InputError(
            f"'{project.path}' has the tasks {', '.join(tasks)}; choose the task to train on, or "
            f"several to join."
        )
    found = choice.corpus(project, tasks, settings)
    recogniser = yield from training(found.labelled, settings)
    content = dump(recogniser)
    if not project.read_only:
        project.runs.add_recogniser(
            name,
            content,
            settings=told(settings, choice, tasks),
            seed=settings.seed,
            labels=project.runs.existing_labels(
                used for used in found.labels if used.demonstration in recogniser.trained_on
            ),
            versions=versions(),
        )
    remarks = unlike([found], settings) + idle(settings, found.spelt) + _unkept(project)
    remarks += unlearnt(found, recogniser) + remark_on(recogniser.left_out)
    return Trained(recogniser, content, remarks)


def unlearnt(found: Corpus, recogniser: Recogniser) -> tuple[str, ...]:
    """A remark on actions that are labelled and that a recogniser has learnt nothing of."""
    merged = (item.merged(recogniser.settings.merge) for item in found.labelled)
    labels = {segment.action for item in merged for segment in item.segments}
    names = sorted(labels - set(recogniser.actions))
    return (f"No sample to train on at this stride: {', '.join(names)}.",) if names else ()
