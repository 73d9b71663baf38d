"""Training for the Review workspace: evaluation, final fit and proposals as one stored run.

It works on the labels as they are when it begins, reads them once and never writes a track: later
edits stay, and :func:`forcelab.review.run_result.edits_since` counts them. The run and the
recogniser are stored together at the very end, as soon as no other program keeps the project busy,
or not at all.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import monotonic
from typing import Any, Literal, TypeVar

from forcelab.errors import InputError, StoreBusyError
from forcelab.jobs import Progress, map_progress
from forcelab.process import interruptible
from forcelab.project import DemonstrationInfo, LabelsUsed, Project, Provenance
from forcelab.recognition.dataset import DataSelection, Dataset
from forcelab.recognition.ensemble import FitProgress
from forcelab.recognition.groups import fold_groups
from forcelab.recognition.project_runs import evaluate_joined, provenance
from forcelab.recognition.recogniser import Recogniser
from forcelab.recognition.remarks import (
    accepted_remarks,
    dataset_remarks,
    unlearnt_remarks,
    unused_merge_remarks,
)
from forcelab.recognition.results import (
    DemonstrationResult,
    Evaluation,
    run_record,
    run_title,
)
from forcelab.recognition.settings import Settings
from forcelab.recognition.storage import dump
from forcelab.recognition.training import Known, training_job
from forcelab.review.run_result import KIND

Phase = Literal["features", "fold", "final fit", "proposals", "storing"]
ResultT = TypeVar("ResultT")

#: Parts of the progress that one fit is.
PARTS = 100


@dataclass(frozen=True, slots=True)
class TrainingStep(Progress):
    """Progress of a training."""

    #: What is being done; of the features, both for testing and for the final fit
    phase: Phase = "features"
    #: fold, folds: which recogniser for testing is trained, from 1, of how many; 0 before the first
    fold: int = 0
    folds: int = 0
    epoch: int | None = None  # of the fit; None where it has none
    loss: float | None = None  # after that epoch; None for classifiers that have none
    #: Estimated from what the fits before took; None until one is done
    seconds_left: float | None = None


class TrainingProgress:
    """Turns the progress of the parts of a training into that of the whole.

    `folds` recognisers are trained for testing, and one more at the end.
    """

    def __init__(self, folds: int, clock: Callable[[], float] = monotonic) -> None:
        self.folds = folds
        self._fits = folds + 1
        self._clock = clock
        self._fold = 0
        self._done = 0  # fits
        self._took: list[float] = []  # seconds of each
        self._began = clock()  # the fit that is under way
        self._text = ""  # of that; empty while there is none

    def test(
        self, job: Generator[Progress, None, ResultT]
    ) -> Generator[TrainingStep, None, ResultT]:
        """The progress of an evaluation as steps."""
        result = yield from self._of(job, "fold")
        self._fold = self.folds
        return result

    def fit(
        self, job: Generator[Progress, None, ResultT]
    ) -> Generator[TrainingStep, None, ResultT]:
        """The progress of the final fit as steps."""
        # Testing may have been given up in the middle of it.
        self._done, self._text = self.folds, ""
        return (yield from self._of(job, "final fit"))

    def proposing(self, done: int, total: int, name: str) -> TrainingStep:
        """The step before a demonstration is recognised."""
        share = done / max(total, 1)
        return self._step("proposals", name, self._fits + share)

    def storing(self) -> TrainingStep:
        """The last step."""
        return self._step("storing", "storing", self._fits + 1)

    def _of(
        self, job: Generator[Progress, None, ResultT], phase: Phase
    ) -> Generator[TrainingStep, None, ResultT]:
        """The progress of a job as steps."""
        result = yield from map_progress(job, lambda progress: self._step_of(progress, phase))
        self._end_fit()
        return result

    def _step_of(self, progress: Progress, phase: Phase) -> TrainingStep:
        """A progress as a step."""
        if not isinstance(progress, FitProgress):
            if progress.text != "features":
                self._end_fit()
                return self._step(phase, progress.text, self._done)
            self._began = self._clock()
            return self._step("features", "features", self._done)
        if progress.text != self._text:
            self._end_fit()
            self._text = progress.text
            self._fold += phase == "fold"
        share = progress.done / max(progress.total, 1)
        words = f"fold {self._fold} of {self.folds}" if phase == "fold" else "final fit"
        epoch = progress.done if progress.loss is not None else None
        return self._step(phase, words, self._done + share, epoch, progress.loss)

    def _end_fit(self) -> None:
        """Count the fit that is under way, if there is one; the next begins now."""
        if self._text:
            now = self._clock()
            self._took.append(now - self._began)
            self._began, self._text = now, ""
            self._done += 1

    def _step(
        self,
        phase: Phase,
        text: str,
        fits: float,
        epoch: int | None = None,
        loss: float | None = None,
    ) -> TrainingStep:
        """A step, with the time left."""
        return TrainingStep(
            done=round(PARTS * fits),
            total=PARTS * (self._fits + 1),
            text=text,
            phase=phase,
            fold=self._fold,
            folds=self.folds,
            epoch=epoch,
            loss=loss,
            seconds_left=self._left(),
        )

    def _left(self) -> float | None:
        """Seconds left: each fit that is not done takes as long as the mean of those that are."""
        if not self._took:
            return None
        mean = sum(self._took) / len(self._took)
        waiting = self._fits - self._done
        if not waiting:
            return 0.0
        return mean * (waiting - 1) + max(0.0, mean - (self._clock() - self._began))


@dataclass(frozen=True)
class _Snapshot:
    """The data to train and test on, as it was when the training began."""

    tasks: tuple[str, ...]
    datasets: list[Dataset]  # of the tasks; and of the task that is tested on, if there is one
    #: The demonstrations of all these tasks that the coder has not labelled
    new: tuple[DemonstrationInfo, ...]

    @property
    def train(self) -> Dataset:
        """The dataset to train on."""
        return self.datasets[0]

    @property
    def labels(self) -> tuple[LabelsUsed, ...]:
        """The labels of all demonstrations, empty tracks included."""
        return tuple(used for part in self.datasets for used in part.labels)


def review_job(
    path: Path, settings: Settings, selection: DataSelection, name: str
) -> Generator[TrainingStep, None, int]:
    """Evaluate, train, and propose labels; returns the number of the stored run.

    Made for :func:`forcelab.process.run_in_process`, so it opens the project itself. With no task
    selected the only one is trained on. An InputError says that there is nothing to learn from, or
    the project cannot store the run; what only stands in the way of testing is a remark of the run.
    """
    selection.check()
    with Project.open(path) as project:
        project.refuse_read_only()  # before the work and not after it
        yield TrainingStep(0, 1, "labels", phase="features")
        snapshot = _snapshot(project, settings, selection)
        selection = selection.with_default_folds(snapshot.train)
        steps = TrainingProgress(_folds(snapshot, selection))
        known: Known = {}  # examples for testing, which the final fit learns from, too
        evaluation, remarks = yield from _evaluate(snapshot, settings, selection, steps, known)
        if evaluation is not None:
            remarks += accepted_remarks(snapshot.datasets[-1], evaluation)
        remarks += dataset_remarks(snapshot.datasets, settings)
        remarks += unused_merge_remarks(
            settings, frozenset().union(*(part.spellings for part in snapshot.datasets))
        )
        job = training_job(snapshot.train.labelled, settings, known)
        recogniser = yield from steps.fit(job)
        known.clear()
        remarks += unlearnt_remarks(snapshot.train, recogniser)
        try:
            content = dump(recogniser)
        except InputError as error:  # the scores and proposals are worth having all the same
            content, remarks = None, (*remarks, str(error))
        proposals, refused = yield from _proposals(project, snapshot, recogniser, steps)
        remarks += refused
        if evaluation is None:
            evaluation = Evaluation(
                title=run_title(snapshot.tasks, selection.test_task),
                settings=settings,
                actions=recogniser.actions,
                tested=(),
                rate=recogniser.rate,
                channels=recogniser.channels,
                trained_on=(),
                seconds={},
            )
        evaluation = replace(
            evaluation,
            trained_on=recogniser.trained_on,
            remarks=evaluation.remarks + remarks,
        )
        result = run_record(evaluation)
        result["proposals"] = [proposal.to_json() for proposal in proposals]
        origin = provenance(settings, selection, snapshot.tasks, snapshot.labels)
        while True:
            yield steps.storing()
            try:
                with interruptible():
                    return _store(project, snapshot, origin, result, name, recogniser, content)
            except StoreBusyError:  # what took minutes is not lost for that; one can cancel
                continue


def _snapshot(project: Project, settings: Settings, selection: DataSelection) -> _Snapshot:
    """Read the labelled demonstrations, and list those without labels."""
    tasks = selection.joined_tasks(project)
    datasets = selection.load_parts(project, tasks, settings)
    _check(datasets[0], settings, tasks)
    bare = {
        item.demonstration.id for part in datasets for item in part.labelled if not item.segments
    }
    infos = {info.id: info for info in project.demonstrations.infos() if info.id in bare}
    return _Snapshot(tasks, datasets, tuple(infos.values()))


def _check(dataset: Dataset, settings: Settings, tasks: Sequence[str]) -> None:
    """Refuse fewer than two actions before anything is computed."""
    merged = [item.merged(settings.merge) for item in dataset.labelled]
    actions = list(dict.fromkeys(s.action for item in merged for s in item.segments))
    if len(actions) < 2:
        labelled = f"only '{actions[0]}' is" if actions else "none is"
        raise InputError(
            f"Training needs two actions and {labelled} labelled in {' + '.join(tasks)}; label a "
            f"stretch of a second one. Until then you can go on labelling and compare coders."
        )


def _folds(snapshot: _Snapshot, selection: DataSelection) -> int:
    """The number of recognisers that are trained for testing."""
    if selection.test_task is not None:
        return 1
    labelled = snapshot.train.labelled
    own = [item.demonstration for item in labelled if item.segments and not item.added]
    if len(own) < 2:
        return 0
    # Where another coder's labels are added, each is also trained without.
    times = 2 if any(item.added for item in labelled) else 1
    return times * len(fold_groups(own, selection.folds))


def _evaluate(
    snapshot: _Snapshot,
    settings: Settings,
    selection: DataSelection,
    steps: TrainingProgress,
    known: Known,
) -> Generator[TrainingStep, None, tuple[Evaluation | None, tuple[str, ...]]]:
    """Evaluate; where that is not possible, None and a remark that says why.

    What stands in the way of training, too, is left to the training to report.
    """
    if not steps.folds:
        by_author = f" by {selection.author}" if selection.author else ""
        return None, (
            f"Only one demonstration is labelled{by_author}, so nothing could be tested; label a "
            f"second one. The recogniser was trained all the same, and proposes labels for the "
            f"others.",
        )
    job = evaluate_joined(
        snapshot.datasets, settings, snapshot.tasks, selection, probability_trace=True, known=known
    )
    try:
        return (yield from steps.test(job)), ()
    except InputError as error:
        return None, (f"Nothing could be tested: {error}",)


def _proposals(
    project: Project, snapshot: _Snapshot, recogniser: Recogniser, steps: TrainingProgress
) -> Generator[TrainingStep, None, tuple[list[DemonstrationResult], tuple[str, ...]]]:
    """Predictions for the demonstrations that the coder has not labelled.

    Also for those that are blind for the coder: the window hides them.
    """
    proposals, remarks = [], []
    for i, info in enumerate(snapshot.new):
        yield steps.proposing(i, len(snapshot.new), info.name)
        try:
            demonstration = project.demonstrations.load(info.id)
            prediction = recogniser.predict(demonstration, probability_trace=True)
        except InputError as error:
            remarks.append(f"No proposal for '{info.name}': {error}")
            continue
        remarks += [
            f"'{info.name}': {remark}" for remark in recogniser.unit_remarks(demonstration.channels)
        ]
        proposals.append(DemonstrationResult.of(demonstration, prediction))
    return proposals, tuple(remarks)


def _store(
    project: Project,
    snapshot: _Snapshot,
    origin: Provenance,
    result: dict[str, Any],
    name: str,
    recogniser: Recogniser,
    content: bytes | None,
) -> int:
    """Store the run and its recogniser, if there is a file of it, in one transaction."""
    origin = replace(origin, labels=project.runs.existing_labels(origin.labels))
    if content is None:
        return project.runs.add(KIND, origin, result)
    trained_on = project.runs.existing_labels(
        used for used in snapshot.train.labels if used.demonstration in recogniser.trained_on
    )
    return project.runs.add_training(KIND, name, content, origin, result, trained_on=trained_on)
