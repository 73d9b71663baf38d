"""The state of the Trade-off workspace: what is measured, how old it is, and what is in use."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, QTimer, Signal

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.review.learning import Learning
from forcelab.gui.review.wanted import shown_task, whose_labels
from forcelab.gui.tradeoff.jobs import BACKGROUND, MEASURING, Work
from forcelab.gui.tradeoff.points import named
from forcelab.jobs import Progress

if TYPE_CHECKING:
    from forcelab.measure.recognition_runs import Measured
    from forcelab.recognition.settings import Settings

__all__ = ["Measuring"]

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
        learning: Learning,
        parent: QObject | None = None,
        *,
        work: Work = BACKGROUND,
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
        author = self.learning.choice.author or whose_labels(self.document, {self.task})
        own, project = self.document.author, self.document.project
        if author in (None, own) or project is None:
            return author
        infos = [info for info in self.document.infos if info.task == self.task]
        hidden = any(author in i.labelled and project.is_blind(i.id, own) for i in infos)
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
            self._made,
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
            self.document.say(told.format(named(row), row.refusal), True)
            return
        self._before.append(self.learning.settings)
        self._adopted = settings
        self.learning.set_settings(settings)
        told = "'{0}' is trained with “{1}” from now on."
        self.document.say(told.format(shown_task(self.task), named(row)))
        self.changed.emit()

    def go_back(self) -> None:
        """Train with what was adopted last no longer, but with what was in use before it."""
        if self._before:
            self._adopted = self._before.pop()
            self.learning.set_settings(self._adopted)
            told = f"'{shown_task(self.task)}' is trained as before."
            self.document.say(told)
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

    def _made(self, measured: Measured) -> None:
        """Show what was measured, unless the coder has turned to another task meanwhile."""
        self._ended()
        if measured.task != self.task:
            told = f"Recognition of '{shown_task(measured.task)}' is measured."
            self.document.say(told)
        elif self.document.author == self._asked_by:
            self._show(measured)
        else:
            self._read()  # what another coder may see of it, who may be blind to the labels

    def _failed(self, error: Exception) -> None:
        """Say why it did not come about."""
        known = isinstance(error, ForcelabError)
        self.trouble = str(error) if known else "Measuring failed; the log says more."
        self.document.say(self.trouble, True)
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
            edits = project.edits_since(measured.labels, (measured.task,))
        except ForcelabError:
            return  # the store is busy; the next edit counts again
        if edits != self.edits:
            self.edits = edits
            self.changed.emit()
