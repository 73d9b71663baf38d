"""Runs of a project: tasks evaluated and recognisers trained, which it keeps."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial

from forcelab.errors import InputError, UnclearAuthorError
from forcelab.jobs import Progress, job
from forcelab.notebook import html_title
from forcelab.parallel import run_job
from forcelab.project import LabelsUsed, Project, Provenance
from forcelab.recognition.cross_validation import (
    EvaluationJob,
    leave_one_out_job,
    leave_one_out_live_job,
    train_and_test_job,
)
from forcelab.recognition.dataset import DataSelection, Dataset
from forcelab.recognition.examples import LabelledDemonstration
from forcelab.recognition.label_noise import dropped_remarks
from forcelab.recognition.plugins import distribution_versions, is_import_path
from forcelab.recognition.recogniser import Recogniser
from forcelab.recognition.remarks import (
    accepted_remarks,
    dataset_remarks,
    settings_remarks,
    unlearnt_remarks,
    unused_merge_remarks,
)
from forcelab.recognition.results import Evaluation, run_record, run_title
from forcelab.recognition.settings import Settings
from forcelab.recognition.storage import dump
from forcelab.recognition.training import Known, train, training_job
from forcelab.resources import versions


@dataclass(frozen=True)
class TaskEvaluations:
    """The evaluations of a project's tasks."""

    evaluations: list[tuple[tuple[str, ...], Evaluation]]  # at least one, each with its tasks
    joined: bool  # whether one evaluation was asked for, not one a task
    #: A sentence for each task that could not be evaluated, and on an idle merge map
    remarks: tuple[str, ...]

    def _repr_html_(self) -> str:
        """As notebooks show it: each evaluation, and what is worth a look."""
        shown = [evaluation._repr_html_() for _, evaluation in self.evaluations]
        return "".join([*shown, *(html_title("", remark) for remark in self.remarks)])


@dataclass(frozen=True)
class TrainedRecogniser:
    """A recogniser trained on a project."""

    recogniser: Recogniser
    content: bytes  # its file
    remarks: tuple[str, ...]  # a sentence for each thing worth a look


@job
def evaluate_tasks_job(
    project: Project,
    settings: Settings,
    selection: DataSelection,
    jobs: int = 1,
    *,
    probability_trace: bool = False,
    latency: float | None = None,
) -> Generator[Progress, None, TaskEvaluations]:
    """Evaluate on a project; each evaluation is kept in it as a run.

    Evaluations of streams, of demonstrations by their names and of adapted ones are not kept.

    The chosen tasks are one evaluation. With none chosen every task is one by itself, and those
    that cannot be evaluated are left out.

    Parameters
    ----------
    project : Project
    settings : Settings
    selection : DataSelection
    jobs : int
        Processes that share the work.
    probability_trace : bool
        Whether the runs also store probabilities over time.
    latency : float, optional
        Evaluate as if demonstrations came live, labels so many seconds after their force.

    Yields
    ------
    Progress

    Returns
    -------
    TaskEvaluations

    Raises
    ------
    UnclearAuthorError
        If several coders labelled, none was chosen, and no task can be evaluated without.
    InputError
        If what was chosen cannot be evaluated, or no task can.

    Examples
    --------
    >>> selection = forcelab.DataSelection(tasks=("foam",), author="Ada")
    >>> job = forcelab.evaluate_tasks_job(project, settings, selection)
    >>> _, evaluation = forcelab.finish(job).evaluations[0]
    >>> evaluation.title
    'foam'
    """
    selection.check()
    if latency is not None and (not selection.leaves_out or selection.also_from is not None):
        raise InputError(
            "With a latency demonstrations are left out in turn; choose nothing to test on, and no "
            "other coder to learn from."
        )
    groups = _task_groups(project, selection)
    not_stored = _not_stored_remarks(selection, latency)
    evaluations: list[tuple[tuple[str, ...], Evaluation]] = []
    refusals: list[str] = []
    remarks: list[str] = []
    unclear: UnclearAuthorError | None = None
    spellings: set[str] = set()
    for tasks in groups:
        try:
            datasets = selection.load_parts(project, tasks, settings)
            choice = selection.with_default_folds(datasets[0])
            if latency is None:
                evaluation = yield from evaluate_joined(
                    datasets, settings, tasks, choice, jobs, probability_trace=probability_trace
                )
            else:
                title, labelled = run_title(tasks, None), datasets[0].labelled
                evaluation = yield from leave_one_out_live_job(
                    labelled, settings, latency, title, choice.folds
                )
        except InputError as error:
            if len(groups) == 1:
                raise
            if isinstance(error, UnclearAuthorError):
                unclear = unclear or error
            refusals.append(f"Task '{tasks[0]}' was left out: {error}")
            continue
        evaluation = replace(
            evaluation,
            vocabulary=project.actions.joint_vocabulary(
                tasks, choice.test_task, apart=choice.apart
            ),
            remarks=evaluation.remarks + accepted_remarks(datasets[-1], evaluation),
        )
        evaluations.append((tasks, evaluation))
        spellings.update(*(part.spellings for part in datasets))
        remarks += dataset_remarks(datasets, settings)
        if not (project.read_only or not_stored):
            labels = project.runs.existing_labels(used for part in datasets for used in part.labels)
            origin = provenance(settings, choice, tasks, labels)
            project.runs.add("evaluate", origin, run_record(evaluation))
    if not evaluations:
        if unclear is not None:  # once, not for every task
            raise unclear
        raise InputError(f"No task can be evaluated. {' '.join(refusals)}")
    remarks = [
        *refusals,
        *dict.fromkeys(remarks),
        *unused_merge_remarks(settings, spellings),
        *_read_only_remarks(project),
        *not_stored,
    ]
    return TaskEvaluations(evaluations, bool(selection.tasks) or len(groups) == 1, tuple(remarks))


def _task_groups(project: Project, selection: DataSelection) -> list[tuple[str, ...]]:
    """The tasks of each evaluation: those chosen together, else every task by itself."""
    if selection.tasks:
        return [tuple(dict.fromkeys(selection.tasks))]
    tasks = project.demonstrations.tasks()
    if not tasks:
        raise InputError(f"'{project.path}' has nothing to evaluate; import recordings first.")
    groups: list[tuple[str, ...]] = [(task,) for task in tasks if task != selection.test_task]
    if not groups:
        raise InputError(
            f"'{project.path}' has no task but '{selection.test_task}', so there is none to train "
            f"on; name no task to test on, and its demonstrations are left out in turn."
        )
    return groups


def _not_stored_remarks(selection: DataSelection, latency: float | None) -> tuple[str, ...]:
    """Why a result is not stored as a run; empty where it is."""
    options = {
        "a latency": latency is not None,
        "names to test on": selection.test_names is not None,
        "adaptation": selection.adapt,
    }
    used = [name for name, is_used in options.items() if is_used]
    if not used:
        return ()
    return (
        f"With {' and '.join(used)} the result is kept as no run: a review trains again what it "
        f"explains, and would do so without.",
    )


def evaluate_joined(
    datasets: Sequence[Dataset],
    settings: Settings,
    tasks: tuple[str, ...],
    selection: DataSelection,
    jobs: int = 1,
    *,
    probability_trace: bool,
    known: Known | None = None,
) -> EvaluationJob:
    """One evaluation of joined tasks, of what :meth:`DataSelection.load_parts` gives."""
    tested = selection.test_task if selection.test_names is None else selection.test_names
    title, train, test = run_title(tasks, tested), datasets[0].labelled, datasets[-1].labelled
    if selection.leaves_out:
        folds = selection.folds
        job = partial(leave_one_out_job, train, settings, title, jobs, folds=folds)
    else:
        job = partial(train_and_test_job, train, test, settings, title, adapt=selection.adapt)
    return job(probability_trace=probability_trace, known=known)


def provenance(
    settings: Settings,
    selection: DataSelection,
    tasks: Sequence[str],
    labels: tuple[LabelsUsed, ...],
) -> Provenance:
    """How a run or a recogniser of these settings and this selection is made now."""
    choice = {"choice": asdict(selection) | {"tasks": list(tasks)}}
    return Provenance(
        settings=settings.to_json() | choice,
        seed=settings.seed,
        labels=labels,
        versions=versions() | distribution_versions(settings.plugins),
    )


def _read_only_remarks(project: Project) -> tuple[str, ...]:
    """A remark where the project cannot store the result."""
    try:
        project.refuse_read_only()
    except InputError as error:
        return (f"The result was not kept: {error}",)
    return ()


@job
def train_tasks_job(
    project: Project, settings: Settings, selection: DataSelection, name: str
) -> Generator[Progress, None, TrainedRecogniser]:
    """Train a recogniser on a project, which keeps a copy of it.

    Parameters
    ----------
    project : Project
    settings : Settings
    selection : DataSelection
        All chosen demonstrations are trained on together.
    name : str
        What the recogniser is called in the project.

    Yields
    ------
    Progress

    Returns
    -------
    TrainedRecogniser

    Raises
    ------
    InputError
        If too little is labelled, or no file can hold the classifier.

    Examples
    --------
    >>> selection = forcelab.DataSelection(tasks=("foam",), author="Ada")
    >>> trained = forcelab.finish(forcelab.train_tasks_job(project, settings, selection, "foam"))
    >>> [stored.name for stored in project.runs.recognisers()]
    ['foam']
    """
    tasks = selection.joined_tasks(project)
    dataset = selection.load(project, tasks, settings)
    check = None
    if is_import_path(settings.classifier):
        _refuse_unstorable(dataset.labelled, settings)
        check = dump  # of as many samples it may consist of something else
    recogniser = yield from run_job(training_job, dataset.labelled, settings, None, check)
    content = dump(recogniser)
    if not project.read_only:
        labels = project.runs.existing_labels(
            used for used in dataset.labels if used.demonstration in recogniser.trained_on
        )
        project.runs.add_recogniser(name, content, provenance(settings, selection, tasks, labels))
    used = [item for item in dataset.labelled if item.segments]
    remarks = (
        settings_remarks(used, recogniser.rate, settings)
        + dataset_remarks([dataset], settings)
        + unused_merge_remarks(settings, dataset.spellings)
        + _read_only_remarks(project)
    )
    remarks += unlearnt_remarks(dataset, recogniser) + dropped_remarks(recogniser.dropped)
    return TrainedRecogniser(recogniser, content, remarks)


def _refuse_unstorable(labelled: Sequence[LabelledDemonstration], settings: Settings) -> None:
    """Say before the long training that no file can hold a classifier of one's own.

    It is fitted to the shortest demonstration of two actions; what else is wrong is left to the
    training to say.
    """
    enough = [
        item
        for item in labelled
        if len({segment.action for segment in item.merged(settings.merge).segments}) > 1
    ]
    if not enough:
        return
    shortest = min(enough, key=lambda item: item.demonstration.duration)
    try:
        recogniser = train([shortest], settings)
    except InputError:
        return
    dump(recogniser)
