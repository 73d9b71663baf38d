"""Recognition measured on a task of a project, and kept in it for the next time."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from pathlib import Path

from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.measure.recognition import measuring
from forcelab.measure.recognition_settings import VARIANTS, Variant, with_data_of
from forcelab.measure.recognition_tasks import size_of, usual_coder
from forcelab.measure.rows import Row, with_front
from forcelab.process import interruptible
from forcelab.project import LabelsUsed, Project, StoredRun
from forcelab.recognition.dataset import corpus
from forcelab.recognition.settings import Settings
from forcelab.resources import versions

__all__ = ["KIND", "Measured", "keeping", "load", "same_method"]

#: The kind of the runs that hold measurements.
KIND = "tradeoff"
#: The name of a variant that is measured because somebody uses it.
OWN = "yours"


@dataclass(frozen=True)
class Measured:
    """A measurement as a project keeps it.

    Parameters
    ----------
    number : int
        The run's.
    time : datetime
        When it was made, in UTC.
    task : str
    author : str
        Whose labels were used.
    labels : tuple of LabelsUsed
    variants : tuple of Variant
        What was measured.
    rows : tuple of Row
        One for each of them.
    """

    number: int
    time: datetime
    task: str
    author: str
    labels: tuple[LabelsUsed, ...]
    variants: tuple[Variant, ...]
    rows: tuple[Row, ...]

    def place_of(self, settings: Settings) -> int | None:
        """Which row is of these settings; None where they were not measured."""
        alike = (i for i, v in enumerate(self.variants) if same_method(v.settings, settings))
        return next(alike, None)


def same_method(one: Settings, other: Settings) -> bool:
    """Whether settings are the same by whatever name."""
    return one.replace(preset="") == other.replace(preset="")


def keeping(
    path: Path,
    task: str,
    author: str | None,
    own: Settings,
    variants: Sequence[Variant] = VARIANTS,
) -> Generator[Progress, None, int]:
    """Measure a task, and keep what came of it in the project.

    Made for :func:`forcelab.process.elsewhere`, so it opens the project by itself.

    Parameters
    ----------
    path : Path
        The project's.
    task : str
    author : str or None
        The coder; whoever labelled most if left out.
    own : Settings
        Those in use: they are measured too, and all others take channels, rate and merge map from
        them.
    variants : sequence of Variant

    Returns
    -------
    int
        The run's number.

    Raises
    ------
    InputError
        If the project cannot keep it, or too little is labelled.
    """
    with Project.open(path) as project:
        project.refuse_read_only()  # before the work and not after it
        yield Progress(0, 1, "labels")
        coder = author or usual_coder(project, task)
        found = corpus(project, [task], coder)
        asked = _with_own(variants, own)
        rows = yield from measuring(found.labelled, asked, size_of(task, found))
        with interruptible():
            return project.runs.add(
                KIND,
                settings={"choice": {"tasks": [task], "author": coder}},
                seed=None,
                labels=found.labels,
                versions=versions(),
                result={
                    "digest": {
                        "title": task,
                        "tested": sum(bool(i.segments) for i in found.labelled),
                    },
                    "rows": [asdict(row) for row in rows],
                    "settings": [variant.settings.to_json() for variant in asked],
                },
            )


def _with_own(variants: Sequence[Variant], own: Settings) -> tuple[Variant, ...]:
    """The variants on one's own channels, and one's own settings if they are not among them."""
    asked = [replace(v, settings=with_data_of(v.settings, own)) for v in variants]
    if not any(same_method(v.settings, own) for v in asked):
        asked.append(Variant(OWN, f"{own.preset}, changed", own))
    return tuple(asked)


def load(project: Project, number: int) -> Measured:
    """A measurement that a project keeps.

    Raises
    ------
    InputError
        If there is no such run, it is of another kind, or it is damaged.
    """
    run = project.runs.get(number)
    if run.kind != KIND:
        raise InputError(f"Run {number} of '{project.path}' is no measurement of recognition.")
    try:
        return _measured(run)
    except (AttributeError, LookupError, TypeError, ValueError) as error:
        raise InputError(
            f"What run {number} of '{project.path}' measured is damaged; measure again."
        ) from error


def _measured(run: StoredRun) -> Measured:
    """A run as a measurement; whatever is raised over what it holds, it is damaged."""
    choice = run.settings["choice"]
    rows = tuple(Row(**plain) for plain in run.result["rows"])
    settings = [Settings.from_json(plain) for plain in run.result["settings"]]
    variants = tuple(
        Variant(row.name, row.setting, used) for row, used in zip(rows, settings, strict=True)
    )
    return Measured(
        number=run.id,
        time=run.time,
        task=str(choice["tasks"][0]),
        author=str(choice["author"]),
        labels=run.labels,
        variants=variants,
        rows=with_front(rows),
    )
