"""The jobs behind the trainer, what a list shows of a run, and how runs and progress are worded."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from forcelab.project import Project, RunSummary
    from forcelab.recognition.dataset import Choice
    from forcelab.recognition.settings import Settings
    from forcelab.review.run_result import Outcome
    from forcelab.review.training import Step


#: Gives settings and choice.
SettingsAndChoice = Callable[[], "tuple[Settings, Choice]"]


@dataclass(frozen=True, slots=True)
class RunInfo:
    """A run that the project keeps, as a list tells it.

    Parameters
    ----------
    number : int
    time : datetime
        In UTC.
    title : str
        What was evaluated, such as ``"stylus"``.
    tasks : tuple of str
        Those trained on, and the one tested on.
    f1 : float or None
        Pooled segmental F1 at half overlap after the filters, from 0 to 1; None where nothing was
        tested.
    preset : str
        The one that its settings began with.
    tested : str, optional
        The task tested on; without, each demonstration was left out once.
    """

    number: int
    time: datetime
    title: str
    tasks: tuple[str, ...]
    f1: float | None
    preset: str = ""
    tested: str | None = None


def _remove_run(path: Path, number: int) -> Generator[object, None, None]:
    """Remove a run; to make the store's file smaller may take seconds."""
    from forcelab.project import Project

    yield None
    with Project.open(path) as project:
        project.runs.remove(number)


@dataclass(frozen=True, slots=True)
class Backend:
    """The jobs of the trainer; each works on what the disk holds, with a connection of its own.

    Parameters
    ----------
    train : callable
        ``train(path, given, name, trail)``: makes a run, and gives its outcome. `given` gives
        settings and choice; called there, as to build them loads much. Every step is put at the
        end of the list `trail`, also those that nobody had time to show.
    load : callable
        ``load(path, number)``: gives the outcome of a run.
    listed : callable
        ``listed(path)``: gives every run that can be reviewed, the latest first.
    edits : callable
        ``edits(project, outcome)``: how many edits there were since it was trained; no job, as it
        takes no time.
    remove : callable
        ``remove(path, number)``: removes a run for good.
    """

    train: Callable[[Path, SettingsAndChoice, str, list[Step]], Generator[object, None, Outcome]]
    load: Callable[[Path, int], Generator[object, None, Outcome]]
    listed: Callable[[Path], Generator[object, None, tuple[RunInfo, ...]]]
    edits: Callable[[Project, Outcome], int]
    remove: Callable[[Path, int], Generator[object, None, None]] = _remove_run


def _train(
    path: Path, given: SettingsAndChoice, name: str, trail: list[Step]
) -> Generator[object, None, Outcome]:
    """Train in a process of its own, then read what it has stored."""
    from forcelab.process import elsewhere
    from forcelab.review.training import Step, reviewing

    yield None
    job = elsewhere(reviewing, path, *given(), name)
    try:
        while True:
            try:
                step = next(job)
            except StopIteration as end:
                number: int = end.value
                break
            if isinstance(step, Step) and (not trail or step is not trail[-1]):
                trail.append(step)
            yield step
    finally:
        job.close()
    return (yield from _load_run(path, number))


def _load_run(path: Path, number: int) -> Generator[object, None, Outcome]:
    """Read what a run found."""
    from forcelab.project import Project
    from forcelab.review.run_result import load

    yield None
    with Project.open(path) as project:
        return load(project, number)


def _list_runs(path: Path) -> Generator[object, None, tuple[RunInfo, ...]]:
    """Read which runs there are."""
    from forcelab.project import Project

    yield None
    with Project.open(path) as project:
        runs = project.runs.summaries("evaluate")
    return tuple(_run_info(run) for run in reversed(runs))


def _run_info(run: RunSummary) -> RunInfo:
    """A run as the list tells it."""
    choice = run.settings.get("choice", {})
    tasks = [*choice.get("tasks", ()), choice.get("test_task")]
    return RunInfo(
        number=run.id,
        time=run.time,
        title=str(run.digest.get("title", "")),
        tasks=tuple(task for task in tasks if task is not None),
        f1=run.digest.get("f1"),
        preset=str(run.settings.get("preset", "")),
        tested=choice.get("test_task"),
    )


def _count_edits(project: Project, outcome: Outcome) -> int:
    """How many edits were made of the labels that an outcome rests on."""
    from forcelab.review.run_result import edits_since

    return edits_since(project, outcome)


#: What the window uses.
BACKGROUND = Backend(_train, _load_run, _list_runs, _count_edits)


def freshness_text(
    edits: int | None, coder: str = "", *, kept: bool = True, resettled: bool = False
) -> tuple[str, str]:
    """How up to date what is reviewed is, at length and in short.

    Parameters
    ----------
    edits : int or None
        Edits and new demonstrations since it was trained; None where nothing is.
    coder : str, optional
        Whose labels it was trained on, where the next training takes another coder's.
    kept : bool
        Whether there is a recogniser; an evaluation leaves none.
    resettled : bool
        Whether the next training takes other settings.
    """
    if edits is None:
        return "not trained yet", ""
    if coder:
        told = "trained on the labels of {0}"
        return told.format(coder), f"trained on {coder}"
    if not edits and kept and resettled:
        told = "trained with other settings"
        return told, "other settings"
    if not edits and kept:
        return "up to date", ""
    if not edits:
        told = "up to date, no recogniser kept"
        if resettled:
            told = "of other settings, no recogniser kept"
        return told, "no recogniser kept"
    trained = "this recogniser was trained"
    since = trained if kept else "this run"
    told = "{0} edits or new demonstrations since {1}"
    short = "{0} changes since"
    if edits == 1:
        told = "{0} edit or new demonstration since {1}"
        short = "{0} change since"
    return told.format(edits, since), short.format(edits)


def run_text(kept: RunInfo) -> str:
    """A run in a list: its number, what, how, how good, and when."""
    here = kept.time.astimezone()
    now = datetime.now(here.tzinfo)
    day = "" if here.date() == now.date() else "%d %b " if here.year == now.year else "%d %b %Y "
    when = here.strftime(f"{day}%H:%M")
    score = "" if kept.f1 is None else f" · F1 {100 * kept.f1:.0f} %"
    preset = f" · {kept.preset}" if kept.preset else ""
    return f"{kept.number}: {kept.title}{preset}{score} · {when}"


def training_progress_text(step: Step, *, short: bool = False) -> str:
    """How far a training is, in words such as ``"fold 3 of 10 · epoch 41 · 12 s left"``."""
    phases = {
        "features": "features",
        "fold": f"fold {step.fold} of {step.folds}",
        "final fit": "final fit",
        "proposals": "proposals",
        "storing": "storing",
    }
    parts = [phases[step.phase]]
    if step.epoch is not None and not short:
        parts.append(f"epoch {step.epoch}")
    # A fit that takes longer than those before it is not "0 s" from its end.
    if step.seconds_left is not None and step.seconds_left >= 0.5:
        parts.append(f"{_duration_text(step.seconds_left)} left")
    return " · ".join(parts)


def _duration_text(seconds: float) -> str:
    """Seconds, or minutes where there are many."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min"
