"""Training as the window does it: everything that a review shows, with its progress.

It works on the labels as they are when it begins, reads them once and never writes a track: what
is edited meanwhile stays, and is counted by :func:`forcelab.review.run_result.edits_since`. The run
and the recogniser are stored together at the very end, as soon as no other program keeps the
project busy, or not at all.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Any, Literal, TypeVar, cast

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError, StoreBusyError
from forcelab.jobs import Progress
from forcelab.labels import from_codes
from forcelab.process import interruptible
from forcelab.project import DemonstrationInfo, LabelsUsed, Project
from forcelab.recognition.dataset import Choice, Corpus
from forcelab.recognition.experiments import evaluating, idle, told, unlearnt, unlike
from forcelab.recognition.groups import groups
from forcelab.recognition.recogniser import Prediction, Recogniser
from forcelab.recognition.results import Evaluation, digest, kept, title_of
from forcelab.recognition.settings import Settings
from forcelab.recognition.storage import dump
from forcelab.recognition.training import Epoch, training
from forcelab.resources import versions
from forcelab.review.active_learning import sampled, typicality
from forcelab.review.run_result import KIND

Phase = Literal["features", "fold", "final fit", "proposals", "storing"]
MadeT = TypeVar("MadeT")

#: Parts of the progress that one fit is.
PARTS = 100


@dataclass(frozen=True, slots=True)
class Step(Progress):
    """How far a training is.

    Parameters
    ----------
    phase : "features", "fold", "final fit", "proposals" or "storing"
        What is being done; of the features, both for testing and for the final fit.
    fold, folds : int
        Which recogniser for testing is trained, from 1, of how many; 0 before the first.
    epoch : int or None
        Of the fit; None where it has none.
    loss : float or None
        After that epoch; None for classifiers that have none.
    seconds_left : float or None
        Estimated from what the fits before took; None until one is done.
    """

    phase: Phase = "features"
    fold: int = 0
    folds: int = 0
    epoch: int | None = None
    loss: float | None = None
    seconds_left: float | None = None


class TrainingProgress:
    """Turns the progress of the parts of a training into that of the whole.

    Parameters
    ----------
    folds : int
        Recognisers that are trained for testing.
    fit : bool
        Whether one is trained at the end.
    clock : callable
        Gives seconds.
    """

    def __init__(self, folds: int, fit: bool, clock: Callable[[], float] = monotonic) -> None:
        self.folds = folds
        self._fits = folds + fit
        self._clock = clock
        self._fold = 0
        self._done = 0  # fits
        self._took: list[float] = []  # seconds of each
        self._began = clock()  # the fit that is under way
        self._text = ""  # of that; empty while there is none

    def test(self, job: Generator[Progress, None, MadeT]) -> Generator[Step, None, MadeT]:
        """An evaluation as steps."""
        made = yield from self._of(job, "fold")
        self._fold = self.folds
        return made

    def fit(self, job: Generator[Progress, None, MadeT]) -> Generator[Step, None, MadeT]:
        """The final fit as steps."""
        # Testing may have been given up in the middle of it.
        self._done, self._text = self.folds, ""
        return (yield from self._of(job, "final fit"))

    def proposing(self, done: int, total: int, name: str) -> Step:
        """The step before a demonstration is recognised."""
        share = done / max(total, 1)
        return self._step("proposals", name, self._fits + share)

    def storing(self) -> Step:
        """The last step."""
        return self._step("storing", "storing", self._fits + 1)

    def _of(
        self, job: Generator[Progress, None, MadeT], phase: Phase
    ) -> Generator[Step, None, MadeT]:
        """The steps of a job."""
        try:
            while True:
                try:
                    progress = next(job)
                except StopIteration as end:
                    self._end_fit()
                    return cast(MadeT, end.value)
                yield self._step_of(progress, phase)
        finally:
            job.close()

    def _step_of(self, progress: Progress, phase: Phase) -> Step:
        """The step that a progress is."""
        if not isinstance(progress, Epoch):
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
    ) -> Step:
        """A step, with what is left."""
        return Step(
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
    """What is trained and tested on, as it was when the training began.

    Parameters
    ----------
    tasks : tuple of str
    corpora : list of Corpus
        Of the tasks; and of the task that is tested on, if there is one.
    new : tuple of DemonstrationInfo
        The demonstrations of all these tasks that the coder has not labelled.
    """

    tasks: tuple[str, ...]
    corpora: list[Corpus]
    new: tuple[DemonstrationInfo, ...]

    @property
    def found(self) -> Corpus:
        """What is trained on."""
        return self.corpora[0]

    @property
    def labels(self) -> list[LabelsUsed]:
        """Which labels of which demonstrations are used, the empty ones among them."""
        return [used for part in self.corpora for used in part.labels]


def reviewing(
    path: Path, settings: Settings, choice: Choice, name: str, fit: bool = True
) -> Generator[Step, None, int]:
    """Evaluate, train, and propose labels; kept in the project as one run.

    Made for :func:`forcelab.process.elsewhere`, so it opens the project by itself.

    Parameters
    ----------
    path : Path
        The project's.
    settings : Settings
    choice : Choice
        What is trained on together; with no task chosen, the only one that there is.
    name : str
        What the recogniser is called in the project.
    fit : bool
        Whether a recogniser is trained on all that is labelled, which then proposes labels for
        what is not. Without, there is only the evaluation.

    Yields
    ------
    Step

    Returns
    -------
    int
        The run's number.

    Raises
    ------
    InputError
        If there is nothing to learn from, or the project cannot keep the run. What only stands in
        the way of testing is a remark of the run.
    """
    choice.check()
    with Project.open(path) as project:
        project.refuse_read_only()  # before the work and not after it
        yield Step(0, 1, "labels", phase="features")
        snapshot = _snapshot(project, settings, choice)
        choice = choice.settled(snapshot.found)
        steps = TrainingProgress(_folds(snapshot, choice), fit)
        title = title_of(snapshot.tasks, choice.test_task)
        evaluation, remarks = yield from _tested(snapshot, settings, choice, steps, fit)
        if evaluation is not None:
            result = kept(evaluation, certainty=True)
            trained_on: Sequence[str] = evaluation.trained_on
        else:
            result = _untested(title, settings)
        remarks += unlike(snapshot.corpora, settings)
        remarks += idle(settings, frozenset().union(*(part.spelt for part in snapshot.corpora)))
        recogniser = None
        if fit:
            recogniser = yield from steps.fit(training(snapshot.found.labelled, settings))
            remarks += unlearnt(snapshot.found, recogniser)
            trained_on = recogniser.trained_on
            result.setdefault("labels", list(recogniser.actions))
            proposals, refused = yield from _proposals(project, snapshot, recogniser, steps)
            result["proposals"] = proposals
            remarks += refused
        result["remarks"] = [*result["remarks"], *remarks]
        result["trained_on"] = list(trained_on)
        asked = told(settings, choice, snapshot.tasks)
        while True:
            yield steps.storing()
            try:
                with interruptible():
                    return _stored(project, snapshot, asked, result, name, recogniser)
            except StoreBusyError:  # what took minutes is not lost for that; one can cancel
                continue


def _snapshot(project: Project, settings: Settings, choice: Choice) -> _Snapshot:
    """Read what is labelled and what is not."""
    tasks = tuple(dict.fromkeys(choice.tasks)) or project.demonstrations.tasks()
    if len(tasks) > 1 and not choice.tasks:
        raise InputError(
            f"'{project.path}' has the tasks {', '.join(tasks)}; choose the task to train on, or "
            f"several to join."
        )
    corpora = [choice.corpus(project, tasks, settings)]
    if choice.test_task is not None:
        corpora.append(choice.corpus(project, [choice.test_task], settings))
    _check(corpora[0], settings, tasks)
    bare = {
        item.demonstration.id for part in corpora for item in part.labelled if not item.segments
    }
    infos = {info.id: info for info in project.demonstrations.infos() if info.id in bare}
    return _Snapshot(tasks, corpora, tuple(infos.values()))


def _check(found: Corpus, settings: Settings, tasks: Sequence[str]) -> None:
    """Refuse fewer than two actions before anything is computed."""
    merged = [item.merged(settings.merge) for item in found.labelled]
    actions = list(dict.fromkeys(s.action for item in merged for s in item.segments))
    if len(actions) < 2:
        there = f"only '{actions[0]}' is" if actions else "none is"
        raise InputError(
            f"Training needs two actions and {there} labelled in {' + '.join(tasks)}; label a "
            f"stretch of a second one. Until then you can go on labelling and compare coders."
        )


def _folds(snapshot: _Snapshot, choice: Choice) -> int:
    """How many recognisers are trained for testing."""
    if choice.test_task is not None:
        return 1
    labelled = [item.demonstration for item in snapshot.found.labelled if item.segments]
    return len(groups(labelled, choice.folds)) if len(labelled) > 1 else 0


def _tested(
    snapshot: _Snapshot, settings: Settings, choice: Choice, steps: TrainingProgress, fit: bool
) -> Generator[Step, None, tuple[Evaluation | None, tuple[str, ...]]]:
    """Evaluate; where that cannot be, None and a remark that says why.

    What stands in the way of training, too, is then told by that.
    """
    if not steps.folds and fit:
        whose = f" by {choice.author}" if choice.author else ""
        return None, (
            f"Only one demonstration is labelled{whose}, so nothing could be tested; label a "
            f"second one. The recogniser was trained all the same, and proposes labels for the "
            f"others.",
        )
    job = evaluating(snapshot.corpora, settings, snapshot.tasks, choice, certainty=True)
    try:
        return (yield from steps.test(job)), ()
    except InputError as error:
        if not fit:
            raise
        return None, (f"Nothing could be tested: {error}",)


def _untested(title: str, settings: Settings) -> dict[str, Any]:
    """What a run keeps where nothing was tested."""
    return {
        "digest": digest(title, {}),
        "title": title,
        "preset": settings.preset,
        "settings": settings.to_json(),
        "seed": settings.seed,
        "versions": versions(),
        "seconds": {},
        "tested": [],
        "remarks": [],
        "tracks": [],
        "certainty": {},
    }


def _proposals(
    project: Project, snapshot: _Snapshot, recogniser: Recogniser, steps: TrainingProgress
) -> Generator[Step, None, tuple[list[dict[str, Any]], tuple[str, ...]]]:
    """What the recogniser makes of the demonstrations that the coder has not labelled.

    Also of those that are blind for the coder: it is the window that hides them. Each is stored
    with how typical it is of all of them.
    """
    made, remarks, looks = [], [], []
    for i, info in enumerate(snapshot.new):
        yield steps.proposing(i, len(snapshot.new), info.name)
        try:
            demonstration = project.demonstrations.load(info.id)
            examples = recogniser.prepared(demonstration)
            prediction = recogniser.predict(demonstration, certainty=True, examples=examples)
        except InputError as error:
            remarks.append(f"No proposal for '{info.name}': {error}")
            continue
        remarks += [
            f"'{info.name}': {one}" for one in recogniser.remarks_on(demonstration.channels)
        ]
        made.append(_proposal(demonstration, prediction))
        looks.append(sampled(examples))
    for proposal, share in zip(made, typicality(looks).tolist(), strict=True):
        proposal["typicality"] = share
    return made, tuple(remarks)


def _proposal(demonstration: Demonstration, prediction: Prediction) -> dict[str, Any]:
    """A prediction as plain values, as tracks are kept, with its certainty."""
    where = {
        "demonstration": demonstration.id,
        "start": demonstration.start,
        "end": demonstration.end,
    }
    stages = {"raw": prediction.raw, **prediction.stages, "filtered": prediction.filtered}
    tracks = {
        which: [
            [s.start, s.end, s.action]
            for s in from_codes(codes, prediction.times, prediction.actions)
        ]
        for which, codes in stages.items()
    }
    sure = prediction.certainty
    certainty = {} if sure is None else {"certainty": sure.to_json()}
    return {**where, **tracks, **certainty}


def _stored(
    project: Project,
    snapshot: _Snapshot,
    asked: dict[str, Any],
    result: dict[str, Any],
    name: str,
    recogniser: Recogniser | None,
) -> int:
    """Keep everything, at once."""
    seed, labels = result["seed"], project.runs.existing_labels(snapshot.labels)
    if recogniser is None:
        return project.runs.add(
            KIND,
            settings=asked,
            seed=seed,
            labels=labels,
            versions=versions(),
            result=result,
        )
    return project.runs.add_training(
        KIND,
        name,
        dump(recogniser),
        settings=asked,
        seed=seed,
        labels=labels,
        trained_on=project.runs.existing_labels(
            used for used in snapshot.found.labels if used.demonstration in recogniser.trained_on
        ),
        versions=versions(),
        result=result,
    )
