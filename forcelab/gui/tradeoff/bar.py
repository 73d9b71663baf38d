"""The bar above the plot: what is measured, how far that is, how old it is, and what is drawn."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Signal
from PySide6.QtWidgets import (
    QComboBox,
    QHBoxLayout,
    QLabel,
    QProgressBar,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui.arranging import allow, copyable
from forcelab.gui.review.elided import Elided
from forcelab.gui.review.narrow_list import NarrowList
from forcelab.gui.review.wanted import shown_task
from forcelab.gui.tradeoff.measuring import Measuring
from forcelab.gui.tradeoff.points import ERRORS, TIMES, Kind

__all__ = ["TradeoffBar", "standing_text"]

#: How many letters of a task's name are shown at most; the list that opens has all of it.
WIDEST = 44


class TradeoffBar(QWidget):
    """Task and measurement in one row, what is drawn in the other.

    Signals
    -------
    axes_changed()
        Another error or time was chosen.
    """

    axes_changed = Signal()

    def __init__(self, measuring: Measuring) -> None:
        super().__init__()
        self._measuring = measuring
        self.setAccessibleName("Measurement")
        self.task = self._box("Task to measure", self._task_chosen)
        self.task.setMaximumWidth(WIDEST * self.fontMetrics().averageCharWidth())
        self.measure = QPushButton("Measure")
        self.measure.setAccessibleName("Measure recognition of this task")
        self.measure.setToolTip(
            "Recognise every labelled demonstration by settings trained on the others"
        )
        self.measure.clicked.connect(measuring.measure)
        self.progress = QProgressBar()
        self.progress.setTextVisible(False)
        self.progress.setFixedWidth(110)
        self.progress.setMaximumHeight(8)
        self.progress.setAccessibleName("Progress of the measurement")
        self.cancel = QPushButton("Cancel")
        self.cancel.setAccessibleName("Cancel the measurement")
        self.cancel.clicked.connect(measuring.cancel)
        self.standing = Elided()
        self.standing.setAccessibleName("How the measurement stands")
        self.back = QPushButton("Back to the settings before")
        self.back.clicked.connect(measuring.go_back)
        self.error, error = self._kinds("&Error", ERRORS)
        self.time, time = self._kinds("&against", TIMES)
        for button in (self.measure, self.cancel, self.back):
            button.setAutoDefault(False)
        self.trouble = copyable()
        self.trouble.setProperty("tone", "trouble")
        first, second = QHBoxLayout(), QHBoxLayout()
        measured: tuple[QWidget, ...] = (self.task, self.measure, self.progress, self.cancel)
        for widget in measured:
            first.addWidget(widget)
        first.addWidget(self.standing, 1)
        self._drawn: tuple[QWidget, ...] = (error, self.error, time, self.time)
        for widget in self._drawn:
            second.addWidget(widget)
        second.addStretch(1)
        second.addWidget(self.back)
        column = QVBoxLayout(self)
        column.setContentsMargins(6, 4, 6, 4)
        column.setSpacing(4)
        column.addLayout(first)
        column.addLayout(second)
        column.addWidget(self.trouble)
        measuring.progressed.connect(self._show_progress)
        self.refresh()

    @property
    def kinds(self) -> tuple[Kind, Kind]:
        """What is drawn: the error and the time."""
        return ERRORS[self.error.currentIndex()], TIMES[self.time.currentIndex()]

    def refresh(self) -> None:
        """Show how it stands."""
        state = self._measuring
        self._list_tasks()
        self.measure.setVisible(not state.running)
        few = "Label two demonstrations of the task first: one is recognised by the other."
        allow(self.measure, "" if state.labelled > 1 else few)
        self.progress.setVisible(state.running)
        self.cancel.setVisible(state.running)
        for drawn in self._drawn:
            drawn.setVisible(state.measured is not None)
        self.back.setVisible(state.can_go_back)
        self.trouble.setText(state.trouble)
        self.trouble.setVisible(bool(state.trouble))
        self._show_progress()

    def _show_progress(self) -> None:
        """Show how far it is, or how old."""
        state = self._measuring
        progress = state.progress
        if not state.running:
            self.standing.set_text(*standing_text(state))
            return
        self.progress.setRange(0, 0 if progress is None else max(progress.total, 1))
        if progress is not None:
            self.progress.setValue(min(progress.done, progress.total))
        self.standing.set_text("starting" if progress is None else progress.text)

    # What it is made of

    def _box(self, name: str, chosen: Callable[[int], object]) -> NarrowList:
        """A list to choose from."""
        box = NarrowList()
        box.set_name(name)
        box.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToContents)
        box.activated.connect(chosen)
        return box

    def _kinds(self, name: str, kinds: tuple[Kind, ...]) -> tuple[QComboBox, QLabel]:
        """A choice of what is drawn, and its name."""
        box = self._box(name.replace("&", ""), lambda _: self.axes_changed.emit())
        for kind in kinds:
            box.addItem(kind.title())
        label = QLabel(name)
        label.setBuddy(box)
        return box, label

    def _list_tasks(self) -> None:
        """The tasks of the project."""
        learning = self._measuring.learning
        tasks = learning.tasks
        if [self.task.itemData(i) for i in range(self.task.count())] != list(tasks):
            self.task.clear()
            for task in tasks:
                self.task.addItem(shown_task(task), task)
        self.task.setEnabled(len(tasks) > 1)
        self.task.setCurrentIndex(self.task.findData(learning.task))

    def _task_chosen(self, index: int) -> None:
        """Turn to another task."""
        self._measuring.learning.set_task(str(self.task.itemData(index)))


def standing_text(state: Measuring) -> tuple[str, str]:
    """When and on what it was measured, at length and in short."""
    measured = state.measured
    if measured is None:
        return "", ""
    when = measured.time.astimezone().strftime("%d %b %H:%M")
    since = _edits(state)
    told = "measured {when} on {count} demonstrations labelled by {author} · {since}"
    count = sum(bool(used.edit) for used in measured.labels)
    long = told.format(when=when, count=count, author=measured.author, since=since)
    if state.current is None:
        long += " · " + "the settings in use were not measured"
    return long, f"{when} · {since}"


def _edits(state: Measuring) -> str:
    """How many edits there were since."""
    if not state.edits:
        return "no change since"
    if state.edits == 1:
        return "1 change since"
    return f"{state.edits} changes since"
