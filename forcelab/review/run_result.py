"""The result of a stored run, loaded for review, and the styles of its actions."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import Any

from forcelab.above import Drawing, call_above
from forcelab.errors import InputError
from forcelab.formats.samples import Prediction
from forcelab.notebook import html_picture, html_title
from forcelab.project import LabelsUsed, Project, StoredRun
from forcelab.recognition.intervals import Intervals
from forcelab.recognition.results import STAGES, DemonstrationResult, scores_html
from forcelab.recognition.settings import Settings
from forcelab.vocabulary import Vocabulary

#: The kind of the runs that can be reviewed; ``forcelab evaluate`` and the window make them.
KIND = "evaluate"


@dataclass(frozen=True)
class RunResult:
    """The result of a run of a project; its repr leaves the long fields out.

    Parameters
    ----------
    number : int
        The run's.
    time : datetime
        When it was made, in UTC.
    title : str
        Such as ``"stylus"``.
    tasks : tuple of str
        What was trained on.
    test_task : str or None
        What was tested on instead of leaving one demonstration out.
    author : str
        The coder whose labels were used.
    apart : bool
        Whether actions have their task as a suffix.
    settings : Settings
    actions : tuple of str
        In the order of their first occurrence.
    labels : tuple of LabelsUsed
    tested : tuple of DemonstrationResult
        Each predicted by a recogniser that has not seen it.
    proposals : tuple of DemonstrationResult
        Unlabelled demonstrations of the tasks, predicted by the final recogniser.
    recogniser : str
        Id of the final recogniser in the project; ``""`` where none was trained.
    scores : mapping
        ``"raw"`` and ``"filtered"``, as ``forcelab evaluate --json`` prints them, without those of
        each demonstration.
    seconds : mapping of str to float
        Run time of ``features``, ``fit``, ``predict``, ``filter``.
    remarks : tuple of str
    removed : int
        How many of those tested are no longer in the project. They are not among `tested` and have
        no scores of their own; the pooled scores are those of all.
    folds : int
        In how many groups demonstrations were left out; 0: each by itself.
    reliability : mapping
        ``"brier"``, ``"ece"`` and ``"bins"``, as ``forcelab evaluate --json`` prints them; empty
        where there were no probabilities.
    vocabulary : Vocabulary
        The actions of the tasks, with their colours, as they were when the run was loaded.

    Examples
    --------
    >>> run.title, run.author, len(run.tested)
    ('foam', 'Ada', 3)
    >>> run.plot().save("pairs.svg")
    """

    number: int
    time: datetime
    title: str
    tasks: tuple[str, ...]
    test_task: str | None
    author: str
    apart: bool
    settings: Settings
    actions: tuple[str, ...]
    labels: tuple[LabelsUsed, ...] = field(repr=False)
    tested: tuple[DemonstrationResult, ...] = field(repr=False)
    proposals: tuple[DemonstrationResult, ...] = field(default=(), repr=False)
    recogniser: str = ""
    scores: Mapping[str, Any] = field(default_factory=dict, repr=False)
    seconds: Mapping[str, float] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    removed: int = 0
    folds: int = 0
    reliability: Mapping[str, Any] = field(default_factory=dict, repr=False)
    vocabulary: Vocabulary = field(default_factory=Vocabulary, repr=False)

    def plot(self) -> Drawing:
        """The timeline pairs of what was tested, as ``forcelab evaluate --figure`` draws them."""
        return call_above("plot", self)

    def _repr_html_(self) -> str:
        """As notebooks show it: the scores after the filters, and the timeline pairs."""
        stage = self.scores.get("filtered", {})
        each = [(result.name, result.scores.get("filtered", {})) for result in self.tested]
        ranges = Intervals.from_json(stage.get("intervals", {"reason": "none are stored"}))
        labels = f"{self.settings.preset}, {self.settings.classifier}; labels of {self.author}"
        return (
            html_title(f"Run {self.number}, {self.title}", f"{labels}; {self.time:%Y-%m-%d}")
            + scores_html(each, stage.get("pooled", {}), ranges)
            + html_picture(self.plot)
        )

    @property
    def proposer(self) -> str:
        """The author of the predictions: ``"model NAME 12"``, 12 being the run."""
        return f"model {self.settings.preset} {self.number}"

    @property
    def also_from(self) -> str:
        """The other coder whose labels were learnt from as well; empty where there is none."""
        return next((used.author for used in self.labels if used.author != self.author), "")

    def find(self, id_: str) -> DemonstrationResult | None:
        """The demonstration of this id, tested or proposed; None where it is neither."""
        return next((d for d in (*self.tested, *self.proposals) if d.id == id_), None)

    def result_of(self, id_: str) -> DemonstrationResult:
        """The demonstration of this id, tested or proposed; an InputError where it is neither."""
        if (result := self.find(id_)) is None:
            raise InputError(
                f"Run {self.number} neither tested nor proposed labels for this demonstration; "
                f"choose another run, or train again."
            )
        return result


def load_run(project: Project, number: int) -> RunResult:
    """A run of a project, made ready for looking.

    Raises
    ------
    InputError
        If there is no such run, it is of another kind, or it is damaged.

    Examples
    --------
    >>> forcelab.load_run(project, 1).title
    'foam'
    """
    run = project.runs.get(number)
    if run.kind != KIND:
        raise InputError(
            f"Run {number} of '{project.path}' is of the kind '{run.kind}', which cannot be "
            f"reviewed; choose one of the kind '{KIND}'."
        )
    try:
        return _run_result(project, run)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise InputError(
            f"What run {number} of '{project.path}' found is damaged and cannot be reviewed; train "
            f"again."
        ) from error


def latest_run(project: Project, tasks: Sequence[str] | None = None) -> RunResult | None:
    """The latest run that can be reviewed; None where there is none.

    Parameters
    ----------
    project : Project
    tasks : sequence of str, optional
        Only of runs that were trained and tested on exactly these, in any order. Where there is
        none, of those that were tested on these, and then of those that were trained on them.

    Raises
    ------
    InputError
        If it is damaged.

    Examples
    --------
    >>> forcelab.latest_run(project, ["foam"]).title
    'foam'
    """
    runs = project.runs.summaries(KIND)[::-1]
    if tasks is not None:
        requested = set(tasks)
        trained = [run for run in runs if set(run.tasks) == requested]
        runs = (
            # A task's own demonstrations come first, before tests on those of another one.
            *(run for run in trained if run.test_task is None),
            *(run for run in runs if {run.test_task} == requested),
            *trained,
        )
    return load_run(project, runs[0].id) if runs else None


def latest_predictions(project: Project) -> dict[str, Prediction]:
    """What the latest run of each task predicts, by the demonstrations' ids."""
    predictions: dict[str, Prediction] = {}
    for task in dict.fromkeys(info.task for info in project.demonstrations.infos()):
        run = latest_run(project, [task])
        if run is None:
            continue
        for result in (*run.tested, *run.proposals):
            if result.task == task:
                trace = result.probability_trace
                probabilities = None if trace is None else trace.at
                predictions[result.id] = Prediction(run.proposer, result.predicted, probabilities)
    return predictions


def edits_since(project: Project, run: RunResult) -> int:
    """Number of edits between the labels that were used and those of now.

    Edits that were taken back count for nothing. Demonstrations that have come into its tasks
    since count as one each.
    """
    tested = () if run.test_task is None else (run.test_task,)
    return project.tracks.edits_since(run.labels, (*run.tasks, *tested))


def _run_result(project: Project, run: StoredRun) -> RunResult:
    """The result of a run; whatever is raised while reading it, the run is damaged."""
    result = run.result
    infos = {info.id: info for info in project.demonstrations.infos()}
    # Earlier runs kept probabilities here, and those of the command line no start and end.
    traces = result.get("certainty", {})
    scores: dict[str, Any] = {stage: dict(result[stage]) for stage in STAGES if stage in result}
    each = {stage: stage_scores.pop("demonstrations", ()) for stage, stage_scores in scores.items()}

    def reviewed(plain: Mapping[str, Any]) -> DemonstrationResult:
        info = infos[plain["demonstration"]]
        if "start" not in plain:
            demonstration = project.demonstrations.load(info.id)
            plain = {"start": demonstration.start, "end": demonstration.end, **plain}
        return DemonstrationResult.from_json(
            {"certainty": traces.get(info.id), **plain}, info.name, info.task
        )

    def exists(plain: Mapping[str, Any]) -> bool:
        return plain["demonstration"] in infos or not _is_id(plain)

    tested = [
        replace(
            reviewed(plain),
            scores={stage: rows[i] for stage, rows in each.items() if i < len(rows)},
        )
        for i, plain in enumerate(result["tracks"])
        if exists(plain)
    ]
    remarks = list(result["remarks"])
    if removed := len(result["tracks"]) - len(tested):
        if not tested:
            raise InputError(
                f"All demonstrations that run {run.id} tested were removed from "
                f"'{project.path}'; train again."
            )
        remarks.append(
            f"{removed} of the {len(result['tracks'])} demonstrations that were tested were "
            f"removed from the project since; the scores are those of all."
        )
    apart = bool(run.choice.get("apart", False))
    return RunResult(
        number=run.id,
        time=run.time,
        title=str(result["title"]),
        tasks=run.tasks,
        test_task=run.test_task,
        author=run.labels[0].author if run.labels else str(run.choice.get("author") or ""),
        apart=apart,
        settings=Settings.from_json(result["settings"]),
        actions=tuple(result["labels"]),
        labels=run.labels,
        tested=tuple(tested),
        proposals=tuple(reviewed(plain) for plain in result.get("proposals", ()) if exists(plain)),
        recogniser=str(result.get("recogniser", "")),
        scores=scores,
        seconds={name: float(duration) for name, duration in result["seconds"].items()},
        remarks=tuple(remarks),
        removed=removed,
        folds=int(run.choice.get("folds") or 0),
        reliability=result.get("reliability", {}),
        vocabulary=project.actions.joint_vocabulary(run.tasks, run.test_task, apart=apart),
    )


def _is_id(plain: Mapping[str, Any]) -> bool:
    """Whether a row is of a demonstration, be it one that was removed since."""
    return re.fullmatch("[0-9a-f]{32}", plain["demonstration"]) is not None


def action_styles(project: Project, run: RunResult) -> Vocabulary:
    """All actions of a run, each with its colour and texture in the tasks' vocabularies.

    Two actions of the same style, from two tasks, keep the colour and differ in texture; so do
    those that are kept apart by their task, like ``grab_hard`` and ``grab_soft``.
    """
    vocabulary = project.actions.joint_vocabulary(run.tasks, run.test_task, apart=run.apart)
    keyless = Vocabulary(tuple(replace(action, key="") for action in vocabulary))
    return keyless.with_actions(*run.actions)
