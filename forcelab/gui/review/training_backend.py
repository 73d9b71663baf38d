"""The trainer's jobs, and the texts of runs and of a training's progress."""

from __future__ import annotations

from collections.abc import Callable, Generator
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from forcelab.jobs import Progress, map_progress
from forcelab.text import duration_text

if TYPE_CHECKING:
    from forcelab.project import Project, RunSummary
    from forcelab.recognition.dataset import DataSelection
    from forcelab.recognition.settings import Settings
    from forcelab.review.run_result import RunResult
    from forcelab.review.training import TrainingStep


T = TypeVar("T")
#: Gives settings and choice.
SettingsAndChoice = Callable[[], "tuple[Settings, DataSelection]"]


class Backend:
    """The jobs of the trainer; each works on what the disk holds, with a connection of its own."""

    def train(
        self, path: Path, request: SettingsAndChoice, name: str, steps: list[TrainingStep]
    ) -> Generator[object, None, RunResult]:
        """Train in a process of its own, then read what it has stored.

        Every step is appended to `steps`, also those that come too fast to be shown.
        """
        from forcelab.process import run_in_process
        from forcelab.review.training import TrainingStep, review_job

        def note(step: Progress) -> Progress:
            if isinstance(step, TrainingStep) and (not steps or step is not steps[-1]):
                steps.append(step)
            return step

        yield None
        job = run_in_process(review_job, path, *request(), name)
        number = yield from map_progress(job, note)
        return (yield from self.load(path, number))

    def load(self, path: Path, number: int) -> Generator[object, None, RunResult]:
        def read(project: Project) -> RunResult:
            from forcelab.review.run_result import load_run

            return load_run(project, number)

        return _in_project(path, read)

    def list_runs(self, path: Path) -> Generator[object, None, tuple[RunSummary, ...]]:
        """Read which runs can be reviewed, the latest first."""
        return _in_project(path, lambda project: project.runs.summaries("evaluate")[::-1])

    def remove(self, path: Path, number: int) -> Generator[object, None, None]:
        """Remove a run for good; to make the store's file smaller may take seconds."""
        return _in_project(path, lambda project: project.runs.remove(number))

    def count_edits(self, project: Project, run: RunResult) -> int:
        """Edits of the labels that a run rests on; no job, as it takes no time."""
        from forcelab.review.run_result import edits_since

        return edits_since(project, run)


def _in_project(path: Path, work: Callable[[Project], T]) -> Generator[object, None, T]:
    """Do something in a project of its own connection, as a job."""
    from forcelab.project import Project

    yield None
    with Project.open(path) as project:
        return work(project)


def run_text(run: RunSummary) -> str:
    """A run in a list: its number, what, how, how good, and when."""
    local = run.time.astimezone()
    now = datetime.now(local.tzinfo)
    day = "" if local.date() == now.date() else "%d %b " if local.year == now.year else "%d %b %Y "
    when = local.strftime(f"{day}%H:%M")
    score = "" if run.f1 is None else f" · F1 {100 * run.f1:.0f} %"
    preset = f" · {name}" if (name := run.settings.get("preset")) else ""
    return f"{run.id}: {run.title}{preset}{score} · {when}"


def training_progress_text(step: TrainingStep, *, short: bool = False) -> str:
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
        parts.append(f"{duration_text(step.seconds_left)} left")
    return " · ".join(parts)
