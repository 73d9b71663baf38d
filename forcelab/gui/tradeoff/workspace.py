"""The Trade-off page: plot, table and controls."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from PySide6.QtCore import QItemSelectionModel, QModelIndex, QSignalBlocker, Qt, Signal
from PySide6.QtWidgets import (
    QComboBox,
    QHBoxLayout,
    QLabel,
    QProgressBar,
    QPushButton,
    QSplitter,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui.item_views import TableColumn, TableRow, TextModel, TextTable
from forcelab.gui.layout import copyable, page_layout, placeholder, set_enabled_with_reason
from forcelab.gui.review.trainer import task_text
from forcelab.gui.tradeoff.measuring import ERRORS, TIMES, Kind, Measuring, points_of, setting_name
from forcelab.gui.tradeoff.plot import TradeoffPlot
from forcelab.gui.widgets import ElidedComboBox, ElidedLabel

if TYPE_CHECKING:
    from forcelab.measure.rows import Row as MeasuredRow


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
        self.standing = ElidedLabel()
        self.standing.setAccessibleName("How the measurement stands")
        self.back = QPushButton("Undo")
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
        set_enabled_with_reason(self.measure, "" if state.labelled > 1 else few)
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

    def _box(self, name: str, chosen: Callable[[int], object]) -> ElidedComboBox:
        """A list to choose from."""
        box = ElidedComboBox()
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
                self.task.addItem(task_text(task), task)
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


#: What stands before the setting in use, and before those on the front.
IN_USE, FRONT = "●", "◆"


def columns() -> tuple[TableColumn, ...]:
    """What the table tells of each setting."""
    cpu = "CPU seconds of all threads, for a minute of signal"
    return (
        TableColumn(
            "",
            f"{IN_USE} in use; {FRONT} no other is both faster and better",
            number=False,
        ),
        TableColumn("Setting", number=False),
        TableColumn("F1@50", "Segments found, half of each overlapped (%)"),
        TableColumn("Accuracy", "Samples right (%)"),
        TableColumn(
            "Balanced",
            "Mean over the actions of their samples right (%)",
        ),
        TableColumn("Edit", "Order of the segments (%)"),
        TableColumn(
            "Boundary\nmedian (ms)",
            "Half of the boundaries are no further off than this",
        ),
        TableColumn(
            "Boundary\n90 % (ms)",
            "Nine in ten boundaries are no further off than this",
        ),
        TableColumn("Recognise", cpu),
        TableColumn("Train", cpu),
        TableColumn(
            "Memory",
            "Peak while a demonstration is recognised (MB)",
        ),
    )


def rows_of(
    rows: Sequence[MeasuredRow], current: int | None, front: frozenset[int]
) -> tuple[TableRow, ...]:
    """The rows of the table.

    Parameters
    ----------
    rows : sequence of measured rows
    current : int or None
        Which one is in use.
    front : frozenset of int
        Which ones are on the front of what is drawn.
    """
    return tuple(_row(row, i == current, i in front) for i, row in enumerate(rows))


def sentence(row: MeasuredRow) -> str:
    """Everything about a row in words, for below the plot and for who cannot see it."""
    if row.refusal:
        return f"{setting_name(row)}: {row.refusal}"
    return (
        "{name}: F1@50 {f1} %, accuracy {accuracy} %, balanced {balanced} %, edit {edit} %; "
        "half of the boundaries at most {median} ms off, nine in ten {most} ms; {predict} s to "
        "recognise and {train} s to train on a minute, {memory} MB"
    ).format(name=setting_name(row), **_figures(row))


def _row(row: MeasuredRow, current: bool, front: bool) -> TableRow:
    """A row as texts."""
    mark = (IN_USE if current else "") + (FRONT if front else "")
    cells = ("–",) * 9 if row.refusal else tuple(_figures(row).values())
    return TableRow((mark, setting_name(row), *cells), tip=sentence(row), bold=current)


def _figures(row: MeasuredRow) -> dict[str, str]:
    """All figures of a row that was not refused, in the order of the columns."""
    further = row.further

    def told(name: str, scale: float = 1.0, decimals: int = 0) -> str:
        value = further.get(name)
        return "–" if value is None else f"{scale * value:.{decimals}f}"

    return {
        "f1": told("F1@50", 100, 1),
        "accuracy": told("accuracy", 100, 1),
        "balanced": told("balanced", 100, 1),
        "edit": told("edit", 100, 1),
        "median": told("boundary (ms)"),
        "most": told("boundary p90 (ms)"),
        "predict": f"{row.seconds:.2f}",
        "train": f"{further['features (s/min)'] + further['fit (s/min)']:.2f}",
        "memory": f"{(row.peak_bytes or 0) / 1e6:.1f}",
    }


#: What plot and table get at first.
SHARES = (3, 2)
#: The column of names, and how many letters of them are shown at first, to leave room for figures.
SETTING, LETTERS = 1, 24


class TradeoffWorkspace(QWidget):
    """Error against run time of the current task; a click on a point adopts its settings."""

    def __init__(self, measuring: Measuring) -> None:
        super().__init__()
        self.measuring = measuring
        self.bar = TradeoffBar(measuring)
        self.plot = TradeoffPlot()
        self.told = copyable()
        self.told.setContentsMargins(8, 2, 8, 6)
        self.told.setMinimumHeight(2 * self.fontMetrics().lineSpacing() + 10)
        self.told.setAlignment(Qt.AlignmentFlag.AlignTop)
        self.told.setAccessibleName("The setting that is looked at")
        self._model = TextModel(self)
        self.table = TextTable(self._model)
        self.table.setAccessibleName("All settings that were measured")
        self.empty = placeholder()
        self.empty.setFixedWidth(480)
        self.empty.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        left = QWidget()
        page_layout(left, self.plot, self.told, growing=self.plot)
        self._split = QSplitter(Qt.Orientation.Horizontal)
        self._split.setChildrenCollapsible(False)
        for i, (part, share) in enumerate(zip((left, self.table), SHARES, strict=True)):
            self._split.addWidget(part)
            self._split.setStretchFactor(i, share)
        self._split.setSizes([1000 * share for share in SHARES])
        self._pages = QStackedWidget()
        page = QWidget()
        # As high as the page: one that is aligned is cut where it needs a line more.
        middle = QHBoxLayout(page)
        middle.addStretch(1)
        middle.addWidget(self.empty)
        middle.addStretch(1)
        self._pages.addWidget(page)
        self._pages.addWidget(self._split)
        page_layout(self, self.bar, self._pages, growing=self._pages)
        measuring.changed.connect(self.refresh)
        self.bar.axes_changed.connect(self.refresh)
        self.plot.pointed.connect(self._look_at)
        self.plot.chosen.connect(measuring.adopt)
        self.table.clicked.connect(lambda index: measuring.adopt(index.row()))
        self.table.selectionModel().currentRowChanged.connect(self._row_changed)
        self.refresh()

    def refresh(self) -> None:
        """Show what there is."""
        self.bar.refresh()
        measured = self.measuring.measured
        self._pages.setCurrentIndex(0 if measured is None else 1)
        if measured is None:
            self.empty.setText(self._lack())
            return
        current = self.measuring.current
        error, time = self.bar.kinds
        points = points_of(measured.rows, error, time)
        self.plot.show_points(points, current, error.title(), time.title())
        front = frozenset(point.place for point in points if point.front)
        with QSignalBlocker(self.table.selectionModel()):
            self._model.show(columns(), rows_of(measured.rows, current, front))
        self.table.fit_columns()
        header = self.table.horizontalHeader()
        widest = max(LETTERS * self.fontMetrics().averageCharWidth(), self.table.width() // 2)
        header.resizeSection(SETTING, min(header.sectionSize(SETTING), widest))
        looked_at = self.plot.looked_at
        self._look_at(current if looked_at is None else looked_at)

    def reset_layout(self) -> None:
        """Share out the room as at first."""
        self._split.setSizes([1000 * share for share in SHARES])

    def _lack(self) -> str:
        """What is missing before there is anything to see."""
        state = self.measuring
        if state.document.project is None:
            return "Open a project to see what recognising its actions costs."
        if not state.learning.tasks:
            return "There is no demonstration yet; import or record some first."
        task = task_text(state.task)
        if state.labelled < 2:
            return (
                f"To measure how well settings recognise '{task}', two labelled demonstrations are "
                "needed: each is recognised by what was trained on the others. Labelled so "
                f"far: {state.labelled}. Label more in the Label workspace."
            )
        if state.running:
            return f"'{task}' is being measured; go on with your work meanwhile."
        if state.reading:
            return ""
        return (
            f"Nothing was measured for '{task}' yet. “Measure” tries the presets and single "
            "settings "
            "on its demonstrations, which takes some minutes in the background; then every one is "
            "a point here, error against run time, and a click on a point trains with it."
        )

    def _row_changed(self, index: QModelIndex) -> None:
        """Show in the plot what is looked at in the table."""
        if index.isValid():
            self._look_at(index.row())

    def _look_at(self, row: int | None) -> None:
        """Show a row's figures, and mark it everywhere."""
        measured = self.measuring.measured
        if measured is None or row is None or row >= len(measured.rows):
            self.told.setText("Point at a setting to see its figures; a click uses it.")
            return
        told = sentence(measured.rows[row])
        self.told.setText(told)
        self.plot.setAccessibleDescription(told)
        self.plot.look_at(row)
        if self.table.currentIndex().row() != row:
            index = self._model.index(row, SETTING)
            flags = QItemSelectionModel.SelectionFlag
            self.table.selectionModel().setCurrentIndex(index, flags.ClearAndSelect | flags.Rows)
            self.table.scrollTo(index)
