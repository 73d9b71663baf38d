"""The result of a run, made ready to be looked at, and how its actions look."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import Any

from forcelab.errors import InputError
from forcelab.labels import Segment, Segments
from forcelab.project import DemonstrationInfo, LabelsUsed, Project, StoredRun
from forcelab.recognition.probability_trace import Certainty
from forcelab.recognition.settings import Settings
from forcelab.vocabulary import Vocabulary, joined

#: The kind of the runs that can be reviewed; ``forcelab evaluate`` and the window make them.
KIND = "evaluate"

#: What a track may hold besides the segments of its stages.
_NO_STAGE = ("demonstration", "start", "end", "human", "certainty", "typicality")


@dataclass(frozen=True)
class Reviewed:
    """One demonstration in an outcome.

    Parameters
    ----------
    id, name, task : str
        Of the demonstration.
    start, end : float
        Its first sample and the end of its last one, in seconds.
    human : tuple of Segment
        What was trained and scored with, spelt as there; empty in a proposal.
    stages : dict of str to tuple of Segment
        Predictions after each step: ``"raw"``, ``"threshold"``, ``"median"`` as far as they are
        switched on and were kept, and always ``"filtered"``.
    certainty : Certainty, optional
        None where the run kept no probabilities.
    typicality : float, optional
        Of a proposal: how typical it is of all of the run's, 0 to 1, as
        :func:`forcelab.review.active_learning.typicality` tells; None in runs that did not keep it.
    """

    id: str
    name: str
    task: str
    start: float
    end: float
    human: Segments
    stages: Mapping[str, Segments]
    certainty: Certainty | None = None
    typicality: float | None = None

    @property
    def predicted(self) -> Segments:
        """The final prediction."""
        return self.stages["filtered"]


@dataclass(frozen=True)
class Outcome:
    """What a run of a project found; printed, it tells what was run, and not all that was found.

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
    tested : tuple of Reviewed
        Each predicted by a recogniser that has not seen it.
    proposals : tuple of Reviewed
        Unlabelled demonstrations of the tasks, predicted by the final recogniser.
    recogniser : str
        Id of the final recogniser in the project; ``""`` where none was trained.
    scores : mapping
        ``"raw"`` and ``"filtered"``, as ``forcelab evaluate --json`` prints them.
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
    tested: tuple[Reviewed, ...] = field(repr=False)
    proposals: tuple[Reviewed, ...] = field(default=(), repr=False)
    recogniser: str = ""
    scores: Mapping[str, Any] = field(default_factory=dict, repr=False)
    seconds: Mapping[str, float] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    removed: int = 0
    folds: int = 0
    reliability: Mapping[str, Any] = field(default_factory=dict, repr=False)

    @property
    def proposer(self) -> str:
        """Who the predictions are by, as an author: ``"model NAME 12"``, 12 being the run."""
        return f"model {self.settings.preset} {self.number}"

    def find(self, id_: str) -> Reviewed | None:
        """The demonstration of this id, tested or proposed; None where it is neither."""
        return next((d for d in (*self.tested, *self.proposals) if d.id == id_), None)


def load(project: Project, number: int) -> Outcome:
    """A run of a project, made ready for looking.

    Raises
    ------
    InputError
        If there is no such run, it is of another kind, or it is damaged.
    """
    run = project.runs.get(number)
    if run.kind != KIND:
        raise InputError(
            f"Run {number} of '{project.path}' is of the kind '{run.kind}', which cannot be "
            f"reviewed; choose one of the kind '{KIND}'."
        )
    try:
        return _outcome(project, run)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise InputError(
            f"What run {number} of '{project.path}' found is damaged and cannot be reviewed; train "
            f"again."
        ) from error


def latest(project: Project, tasks: Sequence[str] | None = None) -> Outcome | None:
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
    """
    runs = project.runs.summaries(KIND)[::-1]
    if tasks is not None:
        told = [(run, *tasks_of(run.settings)) for run in runs]
        wanted = set(tasks)
        trained = [(run, test) for run, of, test in told if set(of) == wanted]
        runs = (
            # Whoever asks for a task wants its own demonstrations, and not those of another one.
            *(run for run, test in trained if test is None),
            *(run for run, _, test in told if {test} == wanted),
            *(run for run, _ in trained),
        )
    return load(project, runs[0].id) if runs else None


def edits_since(project: Project, outcome: Outcome) -> int:
    """How many edits lie between the labels that were used and those of now.

    Edits that were taken back count for nothing. Demonstrations that have come into its tasks
    since count as one each.
    """
    tested = () if outcome.test_task is None else (outcome.test_task,)
    return project.tracks.edits_since(outcome.labels, (*outcome.tasks, *tested))


def tasks_of(settings: Mapping[str, Any]) -> tuple[tuple[str, ...], str | None]:
    """What a run was trained on, and what it was tested on instead of leaving one out.

    Parameters
    ----------
    settings : mapping
        Of the run: everything it was told.
    """
    choice = settings.get("choice", {})
    return tuple(choice.get("tasks", ())), choice.get("test_task")


def _outcome(project: Project, run: StoredRun) -> Outcome:
    """A run as an outcome; whatever is raised over what it holds, it is damaged."""
    result = run.result
    infos = {info.id: info for info in project.demonstrations.infos()}
    sure = result.get("certainty", {})

    def reviewed(plain: Mapping[str, Any]) -> Reviewed:
        id_ = plain["demonstration"]
        return _reviewed(project, infos[id_], plain, plain.get("certainty", sure.get(id_)))

    def there(key: str) -> list[Mapping[str, Any]]:
        told = result.get(key, ())
        return [one for one in told if one["demonstration"] in infos or not _is_id(one)]

    tracks = there("tracks")
    remarks = list(result["remarks"])
    if gone := len(result["tracks"]) - len(tracks):
        if not tracks:
            raise InputError(
                f"All demonstrations that run {run.id} tested were removed from "
                f"'{project.path}'; train again."
            )
        remarks.append(
            f"{gone} of the {len(result['tracks'])} demonstrations that were tested were removed "
            f"from the project since; the scores are those of all."
        )
    tasks, test_task = tasks_of(run.settings)
    choice = run.settings.get("choice", {})
    return Outcome(
        number=run.id,
        time=run.time,
        title=str(result["title"]),
        tasks=tasks,
        test_task=test_task,
        author=run.labels[0].author if run.labels else str(choice.get("author") or ""),
        apart=bool(choice.get("apart", False)),
        settings=Settings.from_json(result["settings"]),
        actions=tuple(result["labels"]),
        labels=run.labels,
        tested=tuple(reviewed(plain) for plain in tracks),
        proposals=tuple(reviewed(plain) for plain in there("proposals")),
        recogniser=str(result.get("recogniser", "")),
        scores={
            which: _scores(result[which], result["tracks"], tracks)
            for which in ("raw", "filtered")
            if which in result
        },
        seconds={name: float(spent) for name, spent in result["seconds"].items()},
        remarks=tuple(remarks),
        removed=gone,
        folds=int(choice.get("folds") or 0),
        reliability=result.get("reliability", {}),
    )


def _scores(
    stage: Mapping[str, Any], told: Sequence[Mapping[str, Any]], kept: Sequence[Mapping[str, Any]]
) -> Mapping[str, Any]:
    """Scores of a stage; those of each demonstration stand in the order of those that are kept."""
    if len(kept) == len(told) or "demonstrations" not in stage:
        return stage
    ids = {plain["demonstration"] for plain in kept}
    each = zip(told, stage["demonstrations"], strict=False)
    return {
        **stage,
        "demonstrations": [one for plain, one in each if plain["demonstration"] in ids],
    }


def _is_id(plain: Mapping[str, Any]) -> bool:
    """Whether what a run tells is of a demonstration, be it one that was removed since."""
    return re.fullmatch("[0-9a-f]{32}", plain["demonstration"]) is not None


def _reviewed(
    project: Project,
    info: DemonstrationInfo,
    plain: Mapping[str, Any],
    certainty: Mapping[str, Any] | None,
) -> Reviewed:
    """One demonstration of a run."""
    if "start" in plain:
        start, end = float(plain["start"]), float(plain["end"])
    else:  # of a run that was made on the command line
        demonstration = project.demonstrations.load(info.id)
        start, end = demonstration.start, demonstration.end
    stages = {name: _segments(rows) for name, rows in plain.items() if name not in _NO_STAGE}
    if "filtered" not in stages or not start < end:
        raise ValueError("no prediction, or no time")
    share = plain.get("typicality")
    if share is not None and not 0 <= float(share) <= 1:
        raise ValueError("typicality is a share")
    return Reviewed(
        id=info.id,
        name=info.name,
        task=info.task,
        start=start,
        end=end,
        human=_segments(plain.get("human", ())),
        stages=stages,
        certainty=None if certainty is None else Certainty.from_json(certainty),
        typicality=None if share is None else float(share),
    )


def _segments(rows: Sequence[Sequence[Any]]) -> Segments:
    """Segments out of plain values."""
    return tuple(Segment(float(start), float(end), action) for start, end, action in rows)


def vocabulary_of(project: Project, outcome: Outcome) -> Vocabulary:
    """All actions of an outcome, each with the look that it has where it is labelled.

    The task that is tested comes first, so that its tracks look as when they are labelled. Two
    actions of the same look, from two tasks, keep the colour and differ in texture; so do those
    that are kept apart by their task, like ``grab_hard`` and ``grab_soft``.

    Raises
    ------
    ForcelabError
        If the project cannot be read.
    """
    tasks = dict.fromkeys(([outcome.test_task] if outcome.test_task else []) + [*outcome.tasks])
    found = joined({task: project.actions.vocabulary(task) for task in tasks}, apart=outcome.apart)
    keyless = Vocabulary(tuple(replace(action, key="") for action in found))
    return keyless.with_actions(*outcome.actions)
