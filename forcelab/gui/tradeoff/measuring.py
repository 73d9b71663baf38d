"""The state of the Trade-off page: what is measured, how old it is, and what is in use."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, QTimer, Signal

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.review.trainer import Trainer, default_author, task_text
from forcelab.jobs import Progress

if TYPE_CHECKING:
    from forcelab.measure.recognition_runs import Measured
    from forcelab.measure.rows import Row
    from forcelab.project import Project, RunSummary
    from forcelab.recognition.settings import Settings


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of error or of time.

    Parameters
    ----------
    text : str
        What it is called, to be translated.
    of : callable
        Its value of a row that was not refused; None where that has none.
    """

    text: str
    of: Callable[[Row], float | None]

    def title(self) -> str:
        """What it is called in the user's language."""
        return self.text


def _training(row: Row) -> float | None:
    """Features and fit of a minute that is trained on, in CPU seconds."""
    return row.further["features (s/min)"] + row.further["fit (s/min)"]


def _inaccuracy(row: Row) -> float | None:
    """What is missing to a perfect accuracy."""
    return 1.0 - row.further["accuracy"] if "accuracy" in row.further else None


ERRORS = (
    Kind("1 − F1@50", lambda row: row.error),
    Kind("1 − accuracy", _inaccuracy),
    Kind(
        "boundaries off by, median (ms)",
        lambda row: row.further.get("boundary (ms)"),
    ),
    Kind(
        "boundaries off by, 9 of 10 less (ms)",
        lambda row: row.further.get("boundary p90 (ms)"),
    ),
)
TIMES = (
    Kind("CPU seconds per minute of data", lambda row: row.seconds),
    Kind("training on a minute (CPU s)", _training),
)
#: A fit that was too short for the clock took no longer, in seconds.
SHORTEST = 1e-4


@dataclass(frozen=True, slots=True)
class Point:
    """A row as it is drawn.

    Parameters
    ----------
    place : int
        Of the row in the measurement.
    kind, text : str
        What is varied, and what stands beside the point.
    seconds, error : float
    front : bool
        Whether no other point is better in one and as good in the other.
    """

    place: int
    kind: str
    text: str
    seconds: float
    error: float
    front: bool


def points_of(rows: Sequence[Row], error: Kind, time: Kind) -> tuple[Point, ...]:
    """The points of all rows that have both an error and a time, in their order."""
    from forcelab.measure.rows import with_front

    found: list[tuple[int, Row]] = []
    for place, row in enumerate(rows):
        if row.refusal:
            continue
        wrong, seconds = error.of(row), time.of(row)
        if wrong is not None and seconds is not None:
            seen = replace(row, size="", error=wrong, seconds=max(seconds, SHORTEST))
            found.append((place, seen))
    marked = with_front([row for _, row in found])
    return tuple(
        Point(place, row.name, setting_name(row), row.seconds or 0.0, row.error or 0.0, row.pareto)
        for (place, _), row in zip(found, marked, strict=True)
    )


def setting_name(row: Row) -> str:
    """What a row is called beside its point: presets by their name alone."""
    if row.name == "preset":
        return row.setting
    return f"{row.name}: {row.setting}"


#: The key of the job that measures: nobody waits for it in front of the screen.
MEASURING = "measuring recognition"


@dataclass(frozen=True, slots=True)
class TradeoffBackend:
    """The jobs of the workspace; each works on what the disk holds, with its own connection.

    Parameters
    ----------
    measure : callable
        ``measure(path, task, author, settings)``: measures, and gives what came of it.
    latest : callable
        ``latest(path, task, viewer)``: gives the latest measurement of a task that a coder may see;
        None where there is none.
    """

    measure: Callable[[Path, str, str | None, Settings], Generator[object, None, Measured]]
    latest: Callable[[Path, str, str], Generator[object, None, Measured | None]]


def _measuring(
    path: Path, task: str, author: str | None, settings: Settings
) -> Generator[object, None, Measured]:
    """Measure in a process of its own, then read what it has stored."""
    from forcelab.measure.recognition_runs import keeping, load
    from forcelab.process import elsewhere
    from forcelab.project import Project

    number = yield from elsewhere(keeping, path, task, author, settings)
    with Project.open(path) as project:
        return load(project, number)


def _latest(path: Path, task: str, viewer: str) -> Generator[object, None, Measured | None]:
    """Read the latest measurement."""
    from forcelab.measure.recognition_runs import KIND, load
    from forcelab.project import Project

    yield None
    with Project.open(path) as project:
        for run in reversed(project.runs.summaries(KIND)):
            tasks = run.settings.get("choice", {}).get("tasks")
            if tasks == [task] and _may_see(project, run, viewer):
                return load(project, run.id)
            yield None
    return None


def _may_see(project: Project, run: RunSummary, viewer: str) -> bool:
    """Whether a run rests on no labels that are hidden from a coder."""
    return not any(
        used.author != viewer and used.edit and project.coding.is_blind(used.demonstration, viewer)
        for used in run.labels
    )


#: What the window uses.
BACKGROUND = TradeoffBackend(_measuring, _latest)


#: The key of the job that reads.
READING = "latest measurement"
#: Project, task and coder where there are none.
_NOTHING: tuple[Path | None, str, str] = (None, "", "")
#: Edits are counted so many ms after the last one.
COUNTING = 1000


class Measuring(QObject):
    """Measures recognition of the current task in the background, and adopts what was measured.

    While the workspace is hidden nothing is read or counted.

    Parameters
    ----------
    document : Document
    jobs : Jobs
    learning : Learning
        Whose task is measured, and whose settings are changed.
    work : Work, optional
        What is done in the background.

    Attributes
    ----------
    measured : Measured or None
        What is shown.
    progress : Progress or None
        How far a measurement is.
    edits : int
        How many edits there were since what is shown was measured.
    trouble : str
        Why the last measurement did not come about.
    """

    changed = Signal()
    progressed = Signal()

    def __init__(
        self,
        document: Document,
        jobs: Jobs,
        learning: Trainer,
        parent: QObject | None = None,
        *,
        work: TradeoffBackend = BACKGROUND,
    ) -> None:
        super().__init__(parent)
        self.document, self.learning = document, learning
        self._jobs, self._work = jobs, work
        self._front = False
        self._path: Path | None = None
        self._of = _NOTHING
        self.measured: Measured | None = None
        self.progress: Progress | None = None
        self.running = self.reading = False
        self.edits = 0
        self.trouble = ""
        self._asked_by = ""
        self._before: list[Settings] = []  # what was adopted in place of, the latest last
        self._adopted: Settings | None = None
        self._count = QTimer(self, singleShot=True, interval=COUNTING)
        self._count.timeout.connect(self._recount)
        document.tracks_changed.connect(self._edited)
        document.listing_changed.connect(self._relisted)
        document.author_changed.connect(self._follow)
        document.project_changed.connect(self._follow)
        learning.changed.connect(self._follow)

    # What is asked for

    @property
    def task(self) -> str:
        """The task that is measured."""
        return self.learning.task

    @property
    def author(self) -> str | None:
        """Whose labels are measured on; None for nobody's. Blind, a coder has only his own."""
        author = self.learning.choice.author or default_author(self.document, {self.task})
        own, project = self.document.author, self.document.project
        if author in (None, own) or project is None:
            return author
        infos = [info for info in self.document.infos if info.task == self.task]
        hidden = any(author in i.labelled and project.coding.is_blind(i.id, own) for i in infos)
        return own if hidden else author

    @property
    def labelled(self) -> int:
        """How many demonstrations of the task can be measured on."""
        author = self.author
        infos = [info for info in self.document.infos if info.task == self.task]
        return sum(author in info.labelled for info in infos)

    @property
    def current(self) -> int | None:
        """The row of the settings that the task is trained with; None where there is none."""
        if self.measured is None or not self.learning.ready:
            return None
        return self.measured.place_of(self.learning.settings)

    @property
    def can_go_back(self) -> bool:
        """Whether settings were adopted in place of others."""
        return bool(self._before)

    def set_front(self, front: bool) -> None:
        """Whether the workspace is seen."""
        self._front = front
        if front:
            self._follow()
            self._recount()

    def measure(self) -> None:
        """Begin to measure, in a process of its own."""
        project = self.document.project
        if self.running or project is None or not self.learning.ready:
            return
        self.running, self.progress, self.trouble = True, None, ""
        self._asked_by = self.document.author
        self._jobs.run(
            self._work.measure(project.path, self.task, self.author, self.learning.settings),
            self._show_measured,
            self._failed,
            self._moved,
            key=MEASURING,
        )
        self.changed.emit()

    def cancel(self) -> None:
        """Give the measurement up; what is shown stays."""
        if self.running:
            self._jobs.cancel(MEASURING)
            self._ended()

    def adopt(self, place: int) -> None:
        """Train the task with the settings of a row from now on."""
        if self.measured is None or place == self.current:
            return
        row, settings = self.measured.rows[place], self.measured.variants[place].settings
        if row.refusal:
            told = "“{0}” could not be measured, and is not trained with: {1}"
            self.document.show_message(told.format(setting_name(row), row.refusal), True)
            return
        self._before.append(self.learning.settings)
        self._adopted = settings
        self.learning.set_settings(settings)
        told = "'{0}' is trained with “{1}” from now on."
        self.document.show_message(told.format(task_text(self.task), setting_name(row)))
        self.changed.emit()

    def go_back(self) -> None:
        """Train with what was adopted last no longer, but with what was in use before it."""
        if self._before:
            self._adopted = self._before.pop()
            self.learning.set_settings(self._adopted)
            told = f"'{task_text(self.task)}' is trained as before."
            self.document.show_message(told)
            self.changed.emit()

    # Inside

    def _follow(self) -> None:
        """Turn to another project, task or coder, if there is one."""
        project = self.document.project
        path = None if project is None else project.path
        if path != self._path:
            self._path = path
            self.cancel()
        of = (path, self.task, self.document.author)
        if of != self._of:
            self._jobs.cancel(READING)
            self.measured, self._before, self.trouble, self.reading = None, [], "", False
            self._of = of if self._front else _NOTHING
            if self._front:
                self._read()
        if self._before and self.learning.settings != self._adopted:
            self._before = []  # others were chosen elsewhere
        if self._front:
            self.changed.emit()

    def _relisted(self) -> None:
        """Show how many demonstrations are labelled now, where one looks."""
        if self._front:
            self.changed.emit()

    def _read(self) -> None:
        """Show what was measured the last time."""
        path, task, viewer = self._of
        if path is not None and self.learning.ready:
            self.reading = True
            work = self._work.latest(path, task, viewer)
            self._jobs.run(work, self._show, self._unread, key=READING)

    def _show(self, measured: Measured | None) -> None:
        """Show a measurement."""
        self.reading = False
        self.measured = measured
        self._recount()
        self.changed.emit()

    def _unread(self, error: Exception) -> None:
        """Say what could not be read."""
        self.reading = False
        if isinstance(error, ForcelabError):
            self.trouble = str(error)
        self.changed.emit()

    def _moved(self, progress: object) -> None:
        """Take note of how far it is."""
        if isinstance(progress, Progress):
            self.progress = progress
            self.progressed.emit()

    def _show_measured(self, measured: Measured) -> None:
        """Show what was measured, unless the coder has turned to another task meanwhile."""
        self._ended()
        if measured.task != self.task:
            told = f"Recognition of '{task_text(measured.task)}' is measured."
            self.document.show_message(told)
        elif self.document.author == self._asked_by:
            self._show(measured)
        else:
            self._read()  # what another coder may see of it, who may be blind to the labels

    def _failed(self, error: Exception) -> None:
        """Say why it did not come about."""
        known = isinstance(error, ForcelabError)
        self.trouble = str(error) if known else "Measuring failed; the log says more."
        self.document.show_message(self.trouble, True)
        self._ended()

    def _ended(self) -> None:
        """Nothing is being measured any more."""
        self.running, self.progress = False, None
        self.changed.emit()

    def _edited(self) -> None:
        """Count soon."""
        if self._front and self.measured is not None:
            self._count.start()

    def _recount(self) -> None:
        """Count the edits since what is shown was measured."""
        project, measured = self.document.project, self.measured
        if project is None or measured is None:
            return
        try:
            edits = project.tracks.edits_since(measured.labels, (measured.task,))
        except ForcelabError:
            return  # the store is busy; the next edit counts again
        if edits != self.edits:
            self.edits = edits
            self.changed.emit()
