"""The fields that say what the next recording is: its task, its name, and the countdown."""

from __future__ import annotations

from PySide6.QtWidgets import QComboBox, QFormLayout, QLineEdit, QWidget

from forcelab.gui.capture.phase import Phase
from forcelab.gui.capture.session import Session
from forcelab.gui.naming import settled_name
from forcelab.text import tidy_name

__all__ = ["NextRecording"]

#: Seconds of countdown that can be chosen.
COUNTDOWNS = (0, 3, 5)


class NextRecording(QWidget):
    """A form; further rows may be added to it.

    Parameters
    ----------
    session : Session

    Attributes
    ----------
    form : QFormLayout
    task, countdown : QComboBox
    name : QLineEdit
    """

    def __init__(self, session: Session) -> None:
        super().__init__()
        self._session, self._document = session, session.document
        self._asking = False  # whether a task is nearly the same as one there is
        self._make_fields()
        self.form = QFormLayout(self)
        self.form.setContentsMargins(0, 0, 0, 0)
        self.form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
        self.form.addRow("Task", self.task)
        self.form.addRow("Name", self.name)
        self.form.addRow("Countdown", self.countdown)
        session.changed.connect(self.refresh)
        session.kept.connect(self.list_tasks)
        self._document.project_changed.connect(self._project_changed)
        self._document.listing_changed.connect(self.show_name)
        self._document.demonstration_changed.connect(self._offer_task)
        self.list_tasks()
        self.refresh()

    def _make_fields(self) -> None:
        """Task, name and countdown."""
        self.task = QComboBox()
        self.task.setEditable(True)
        self.task.setInsertPolicy(QComboBox.InsertPolicy.NoInsert)
        self.task.setAccessibleName("Task of the recordings")
        self.task.setSizeAdjustPolicy(
            QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon
        )
        edit = self.task.lineEdit()
        assert edit is not None
        edit.setPlaceholderText("such as LEGO")
        edit.editingFinished.connect(self.take_task)
        self.task.activated.connect(self.take_task)
        self.name = QLineEdit()
        self.name.setAccessibleName("Name of the next recording; empty for the next number")
        self.name.textEdited.connect(self._name_edited)
        self.countdown = QComboBox()
        self.countdown.setAccessibleName("Countdown before recording")
        for seconds in COUNTDOWNS:
            text = f"{seconds} s" if seconds else "none"
            self.countdown.addItem(text, seconds)
        self.countdown.currentIndexChanged.connect(self._countdown_chosen)

    def take_task(self) -> None:
        """The next recordings are of the task that is written here."""
        task = tidy_name(self.task.currentText())
        if task == self._session.task or self._asking:
            self._write_task(self.task.currentText())
            return
        self._asking = True  # the question takes the keyboard from the field
        task = settled_name(self, task, self._tasks())
        self._asking = False
        self._write_task(task)
        self._session.set_task(task)

    def _write_task(self, task: str) -> None:
        """Show a task, of a long name its beginning."""
        self.task.setCurrentText(task)
        self.task.setToolTip(task)
        edit = self.task.lineEdit()
        assert edit is not None
        edit.setCursorPosition(0)

    def _tasks(self) -> tuple[str, ...]:
        """The tasks of the project, recorded and planned."""
        project = self._document.project
        if project is None:
            return ()
        return tuple(dict.fromkeys((*project.tasks(), *project.vocabularies())))

    def list_tasks(self) -> None:
        """Offer the tasks of the project; the one that was chosen stays."""
        chosen = self.task.currentText()
        if not chosen and self._document.demonstration is not None:
            chosen = self._document.demonstration.task
        self.task.blockSignals(True)
        self.task.clear()
        self.task.addItems(self._tasks())
        self._write_task(chosen)
        self.task.blockSignals(False)
        self._session.set_task(chosen)

    def refresh(self) -> None:
        """Show what can be changed now."""
        phase = self._session.phase
        for field in (self.task, self.name, self.countdown):
            field.setEnabled(phase in (Phase.APART, Phase.READY, Phase.CONNECTING))
        if phase is Phase.READY and self.name.text() and not self._session.name:
            self.name.clear()
        self.show_name()

    def show_name(self) -> None:
        """Show what the next recording will be called."""
        if self._session.phase in (Phase.APART, Phase.READY) and self.isVisible():
            self.name.setPlaceholderText(self._session.next_name())

    def _project_changed(self) -> None:
        """Another project has other tasks."""
        self.task.setCurrentText("")
        self.list_tasks()

    def _offer_task(self) -> None:
        """As long as no task was chosen, that of the demonstration that is open."""
        if not self.task.currentText() and self._session.phase is Phase.APART:
            self.list_tasks()

    def _name_edited(self, text: str) -> None:
        self._session.name = text.strip()

    def _countdown_chosen(self) -> None:
        self._session.countdown = int(self.countdown.currentData())
