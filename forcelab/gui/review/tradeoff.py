"""The page "Accuracy and speed": how well settings recognise a task, against what they cost."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from PySide6.QtCore import QItemSelectionModel, QObject, Qt, QTimer, Signal
from PySide6.QtGui import QHideEvent, QResizeEvent, QShowEvent
from PySide6.QtWidgets import QHBoxLayout, QSplitter, QWidget

from forcelab.errors import ForcelabError
from forcelab.gui.figures.tradeoff import Tradeoff
from forcelab.gui.file_dialogs import export_picture
from forcelab.gui.item_views import TableColumn, TableRow, TextModel, TextTable
from forcelab.gui.layout import (
    PageOrPlaceholder,
    SlimProgressBar,
    copyable,
    fill_layout,
    fill_splitter,
    label_of,
    page_layout,
    push_button,
    scroll_area,
    set_enabled_with_reason,
    set_shares,
    toned_label,
)
from forcelab.gui.review.tradeoff_plot import Point, TradeoffPlot
from forcelab.gui.review.trainer import MEASURING, Trainer, default_author
from forcelab.gui.widgets import ElidedComboBox, ElidedLabel
from forcelab.jobs import Progress
from forcelab.measure.rows import Row, Table, with_front
from forcelab.text import task_text

if TYPE_CHECKING:
    from forcelab.measure.recognition import Measured
    from forcelab.project import Project, RunSummary
    from forcelab.recognition.settings import Settings


class Quantity(NamedTuple):
    """What an axis shows: its title, and its value of a measured row; None where that has none."""

    title: str
    of: Callable[[Row], float | None]


def _training_seconds(row: Row) -> float:
    """Features and fit of a minute that is trained on, in CPU seconds."""
    return row.further["features (s/min)"] + row.further["fit (s/min)"]


def _inaccuracy(row: Row) -> float | None:
    return 1.0 - row.further["accuracy"] if "accuracy" in row.further else None


ERRORS = (
    Quantity("1 − F1@50", lambda row: row.error),
    Quantity("1 − accuracy", _inaccuracy),
    Quantity("median boundary error (ms)", lambda row: row.further.get("boundary (ms)")),
    Quantity(
        "90th percentile of boundary error (ms)", lambda row: row.further.get("boundary p90 (ms)")
    ),
)
TIMES = (
    Quantity("CPU seconds per minute of data", lambda row: row.seconds),
    Quantity("CPU seconds to train on a minute", _training_seconds),
)
#: A fit that was too short for the clock took no longer, in seconds.
SHORTEST = 1e-4


def drawn_rows(rows: Sequence[Row], error: Quantity, time: Quantity) -> dict[int, Row]:
    """The rows that have both an error and a time, by their numbers, with their front marked."""
    drawn: dict[int, Row] = {}
    for number, row in enumerate(rows):
        if row.refusal:
            continue
        off, seconds = error.of(row), time.of(row)
        if off is not None and seconds is not None:
            drawn[number] = replace(row, error=off, seconds=max(seconds, SHORTEST))
    return dict(zip(drawn, with_front([*drawn.values()]), strict=True))


def points_of(rows: Mapping[int, Row]) -> tuple[Point, ...]:
    return tuple(
        Point(i, row.name, setting_name(row), row.seconds or 0.0, row.error or 0.0, row.pareto)
        for i, row in rows.items()
    )


def setting_name(row: Row) -> str:
    """The name of a row beside its point; presets go by their name alone."""
    return row.setting if row.name == "preset" else f"{row.name}: {row.setting}"


# What is measured. What loads slowly is imported by the jobs, which run beside the window's thread.


def measure_task(
    path: Path, task: str, author: str | None, settings: Settings
) -> Generator[object, None, Measured]:
    """Measure in a process of its own, then read the measurement that it has stored."""
    from forcelab.measure.recognition import load_measured, measure_and_store
    from forcelab.process import run_in_process
    from forcelab.project import Project

    number = yield from run_in_process(measure_and_store, path, task, author, settings)
    with Project.open(path) as project:
        return load_measured(project, number)


def read_latest(path: Path, task: str, viewer: str) -> Generator[object, None, Measured | None]:
    """Read the latest measurement of a task that a coder may see."""
    from forcelab.measure.recognition import KIND, load_measured
    from forcelab.project import Project

    yield None
    with Project.open(path) as project:
        for run in reversed(project.runs.summaries(KIND)):
            if run.tasks == (task,) and _may_see(project, run, viewer):
                return load_measured(project, run.id)
            yield None
    return None


def _may_see(project: Project, run: RunSummary, viewer: str) -> bool:
    """Whether a run rests on no labels that are hidden from a coder."""
    return not any(
        used.author != viewer and used.edit and project.coding.is_blind(used.demonstration, viewer)
        for used in run.labels
    )


#: The key of the job that reads.
READING = "latest measurement"
#: Project, task and coder where there are none.
_NO_SUBJECT: tuple[Path | None, str, str] = (None, "", "")
#: Edits are counted so many ms after the last one.
COUNT_DELAY = 1000


class TradeoffController(QObject):
    """Measures recognition of the trainer's task in the background, and adopts settings from it.

    While the page is hidden nothing is read or counted.
    """

    changed = Signal()
    progressed = Signal()

    def __init__(self, trainer: Trainer, parent: QObject | None = None) -> None:
        super().__init__(parent)
        document = trainer.document
        self.document, self.trainer, self._jobs = document, trainer, trainer.jobs
        self._visible = False
        self._path: Path | None = None
        self._subject = _NO_SUBJECT  # what is shown: of this project this task, for this coder
        self.measured: Measured | None = None
        self.progress: Progress | None = None
        self.edits = 0  # since what is shown was measured
        self.trouble = ""
        self._measured_for = ""  # the coder who asked for the measurement under way
        self._replaced: list[Settings] = []  # by adopted ones, the latest last
        self._adopted: Settings | None = None
        self._count_later = QTimer(self, singleShot=True, interval=COUNT_DELAY)
        self._count_later.timeout.connect(self._count_edits)
        document.tracks_changed.connect(self._tracks_changed)
        document.listing_changed.connect(self._emit_if_visible)
        document.author_changed.connect(self._follow)
        document.project_changed.connect(self._follow)
        trainer.changed.connect(self._follow)

    @property
    def running(self) -> bool:
        return self._jobs.awaits(MEASURING)

    @property
    def reading(self) -> bool:
        return self._jobs.awaits(READING)

    @property
    def task(self) -> str:
        return self.trainer.task

    @property
    def author(self) -> str | None:
        """Whose labels are measured on, if anyone's; a blind coder has only his own."""
        author = self.trainer.choice.author or default_author(self.document, {self.task})
        coder, project = self.document.author, self.document.project
        if author in (None, coder) or project is None:
            return author
        infos = [info for info in self.document.infos if info.task == self.task]
        hidden = any(author in i.labelled and project.coding.is_blind(i.id, coder) for i in infos)
        return coder if hidden else author

    @property
    def labelled(self) -> int:
        """How many demonstrations of the task can be measured on."""
        author = self.author
        infos = [info for info in self.document.infos if info.task == self.task]
        return sum(author in info.labelled for info in infos)

    @property
    def current(self) -> int | None:
        """The row of the settings that the task is trained with; None where there is none."""
        if self.measured is None or not self.trainer.ready:
            return None
        return self.measured.place_of(self.trainer.settings)

    @property
    def can_undo(self) -> bool:
        """Whether settings were adopted in place of others."""
        return bool(self._replaced)

    def set_visible(self, visible: bool) -> None:
        """Follow the document, while the page is visible."""
        self._visible = visible
        if visible:
            self._follow()
            self._count_edits()

    def measure(self) -> None:
        """Begin to measure, in a process of its own."""
        project = self.document.project
        if self.running or project is None or not self.trainer.ready:
            return
        self.progress, self.trouble = None, ""
        self._measured_for = self.document.author
        job = measure_task(project.path, self.task, self.author, self.trainer.settings)
        self._jobs.run(job, self._finished, self._failed, self._progressed, key=MEASURING)
        self.changed.emit()

    def cancel(self) -> None:
        """Give the measurement up; what is shown stays."""
        if self.running:
            self._jobs.cancel(MEASURING)
            self._ended()

    def adopt(self, row: int) -> None:
        """Train the task with the settings of a row from now on."""
        if self.measured is None or row == self.current:
            return
        measured, settings = self.measured.rows[row], self.measured.variants[row].settings
        name = setting_name(measured)
        if measured.refusal:
            reason = f"“{name}” could not be measured, and is not trained with: {measured.refusal}"
            self.document.show_message(reason, True)
            return
        self._replaced.append(self.trainer.settings)
        self._train_with(settings, f"with “{name}” from now on")

    def undo(self) -> None:
        """Train with the settings again that were in use before the latest ones were adopted."""
        if self._replaced:
            self._train_with(self._replaced.pop(), "as before")

    def _train_with(self, settings: Settings, how: str) -> None:
        self._adopted = settings
        self.trainer.set_settings(settings)
        self.document.show_message(f"'{task_text(self.task)}' is trained {how}.")
        self.changed.emit()

    def show_measured(self, measured: Measured | None) -> None:
        """Show a measurement, or that there is none."""
        self.measured = measured
        self._count_edits()
        self.changed.emit()

    def _follow(self) -> None:
        """Turn to another project, task or coder, if there is one."""
        project = self.document.project
        path = None if project is None else project.path
        if path != self._path:
            self._path = path
            self.cancel()
        subject = (path, self.task, self.document.author)
        if subject != self._subject:
            self._jobs.cancel(READING)
            self.measured, self._replaced, self.trouble = None, [], ""
            self._subject = subject if self._visible else _NO_SUBJECT
            if self._visible:
                self._read()
        if self._replaced and self.trainer.settings != self._adopted:
            self._replaced = []  # others were chosen elsewhere
        self._emit_if_visible()

    def _emit_if_visible(self) -> None:
        if self._visible:
            self.changed.emit()

    def _read(self) -> None:
        path, task, viewer = self._subject
        if path is not None and self.trainer.ready:
            job = read_latest(path, task, viewer)
            self._jobs.run(job, self.show_measured, self._failed_to_read, key=READING)

    def _failed_to_read(self, error: Exception) -> None:
        if isinstance(error, ForcelabError):
            self.trouble = str(error)
        self.changed.emit()

    def _progressed(self, progress: object) -> None:
        if isinstance(progress, Progress):
            self.progress = progress
            self.progressed.emit()

    def _finished(self, measured: Measured) -> None:
        """Show what was measured, unless the coder has turned to another task meanwhile."""
        self._ended()
        if measured.task != self.task:
            self.document.show_message(f"Recognition of '{task_text(measured.task)}' is measured.")
        elif self.document.author == self._measured_for:
            self.show_measured(measured)
        else:
            self._read()  # what another coder may see of it, who may be blind to the labels

    def _failed(self, error: Exception) -> None:
        expected = isinstance(error, ForcelabError)
        self.trouble = str(error) if expected else "Measuring failed; the log says more."
        self.document.show_message(self.trouble, True)
        self._ended()

    def _ended(self) -> None:
        self.progress = None
        self.changed.emit()

    def _tracks_changed(self) -> None:
        if self._visible and self.measured is not None:
            self._count_later.start()

    def _count_edits(self) -> None:
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


#: What stands before the setting in use, and before those on the front.
IN_USE, FRONT = "●", "◆"
_CPU = "CPU seconds of all threads, for a minute of signal"
COLUMNS = (
    TableColumn("", f"{IN_USE} in use; {FRONT} no other is both faster and better", number=False),
    TableColumn("Setting", number=False),
    TableColumn("F1@50", "Segments found, half of each overlapped (%)"),
    TableColumn("Accuracy", "Samples right (%)"),
    TableColumn("Balanced", "Mean over the actions of their samples right (%)"),
    TableColumn("Edit", "Order of the segments (%)"),
    TableColumn("Boundary\nmedian (ms)", "Half of the boundaries are no further off than this"),
    TableColumn("Boundary\n90 % (ms)", "Nine in ten boundaries are no further off than this"),
    TableColumn("Recognise", _CPU),
    TableColumn("Train", _CPU),
    TableColumn("Memory", "Peak while a demonstration is recognised (MB)"),
)
#: The column of names, and how many letters of them are shown at first, to leave room for figures.
SETTING, LETTERS = 1, 24


def _cells(row: Row) -> tuple[str, ...]:
    """All figures of a row, in the order of the columns."""
    if row.refusal:
        return ("–",) * (len(COLUMNS) - 2)

    def text(name: str, scale: float = 1.0, decimals: int = 0) -> str:
        value = row.further.get(name)
        return "–" if value is None else f"{scale * value:.{decimals}f}"

    return (
        text("F1@50", 100, 1),
        text("accuracy", 100, 1),
        text("balanced", 100, 1),
        text("edit", 100, 1),
        text("boundary (ms)"),
        text("boundary p90 (ms)"),
        f"{row.seconds:.2f}",
        f"{_training_seconds(row):.2f}",
        f"{(row.peak_bytes or 0) / 1e6:.1f}",
    )


def summary(row: Row) -> str:
    """Everything about a row in words, for below the plot and for screen readers."""
    if row.refusal:
        return f"{setting_name(row)}: {row.refusal}"
    f1, accuracy, balanced, edit, median, most, recognise, train, memory = _cells(row)
    return (
        f"{setting_name(row)}: F1@50 {f1} %, accuracy {accuracy} %, balanced {balanced} %, "
        f"edit {edit} %; half of the boundaries at most {median} ms off, nine in ten {most} ms; "
        f"{recognise} s to recognise and {train} s to train on a minute, {memory} MB"
    )


#: What plot and table get at first, and the ratio of width to height from which on they stand
#: beside each other.
SHARES, WIDE = (3, 2), 1.4
#: Letters of an axis and lines of the table that are seen at least; where there is less room, the
#: page scrolls.
AXIS_LETTERS, TABLE_LINES = 6, 11


class TradeoffView(QWidget):
    """Error against run time of the trainer's task; a click on a point adopts its settings."""

    def __init__(self, trainer: Trainer) -> None:
        super().__init__()
        self.controller = controller = TradeoffController(trainer, self)
        self._drawn: dict[int, Row] = {}
        self.plot = TradeoffPlot()
        self.summary = copyable()
        self.summary.setContentsMargins(8, 2, 8, 6)
        self.summary.setMinimumHeight(3 * self.fontMetrics().lineSpacing() + 8)
        self.summary.setAlignment(Qt.AlignmentFlag.AlignTop)
        self.summary.setAccessibleName("The selected setting")
        self._model = TextModel(self)
        self.table = TextTable(self._model)
        self._widest_setting = 0  # as wide as its longest text, in pixels, once there are any
        self.table.setAccessibleName("All settings that were measured")
        self.table.setMinimumHeight(TABLE_LINES * self.fontMetrics().lineSpacing())
        charts = QWidget()
        page_layout(charts, self.plot, self.summary, growing=self.plot)
        self._split = QSplitter(Qt.Orientation.Vertical)
        fill_splitter(self._split, (charts, self.table), SHARES)
        self._axes = self._axes_row()
        page = QWidget()
        page_layout(page, self._axes, self._split, growing=self._split)
        self.pages = PageOrPlaceholder(scroll_area(page))
        self.trouble = toned_label("trouble")
        self.trouble.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.trouble.setContentsMargins(6, 0, 6, 4)
        page_layout(self, self._measurement_row(), self.trouble, self.pages, growing=self.pages)
        controller.changed.connect(self.refresh)
        controller.progressed.connect(self._show_progress)
        self.plot.highlight_changed.connect(self._select)
        self.plot.activated.connect(controller.adopt)
        self.table.clicked.connect(lambda index: controller.adopt(index.row()))
        self.table.selectionModel().currentRowChanged.connect(
            lambda index: self._select(index.row())
        )
        self.refresh()

    def _measurement_row(self) -> QWidget:
        controller = self.controller
        tip = "Recognise every labelled demonstration by settings trained on the others"
        name = "Measure recognition of this task"
        self.measure = push_button("Measure", controller.measure, name, tip)
        self.progress = SlimProgressBar("Progress of the measurement", 80)
        self.cancel = push_button("Cancel", controller.cancel, "Cancel the measurement")
        self.state = ElidedLabel()
        self.state.setAccessibleName("When it was measured")
        tip = "Train with the settings that were in use before"
        self.undo = push_button("Undo", controller.undo, "Undo the latest change of settings", tip)
        tip = "Save the plot as SVG, PDF or PNG"
        self.save = push_button("Save…", self.ask_save, "Save the plot", tip)
        return _row(self.measure, self.progress, self.cancel, self.state, self.undo, self.save)

    def _axes_row(self) -> QWidget:
        self.error, self.time = ElidedComboBox(), ElidedComboBox()
        for box, name, quantities in ((self.error, "Error", ERRORS), (self.time, "Time", TIMES)):
            box.set_name(name)
            box.setMinimumContentsLength(AXIS_LETTERS)
            box.addItems([quantity.title for quantity in quantities])
            box.activated.connect(self.refresh)
        return _row(self.error, label_of(self.time, "&against"), self.time)

    def refresh(self) -> None:
        """Show what was measured, or what is missing."""
        controller, measured = self.controller, self.controller.measured
        few = "Label two demonstrations of the task first; each is tested by training on the other."
        set_enabled_with_reason(self.measure, "" if controller.labelled > 1 else few)
        self.undo.setVisible(controller.can_undo)
        self.trouble.setText(controller.trouble)
        self.trouble.setVisible(bool(controller.trouble))
        self._show_progress()
        self.pages.say("" if measured is not None else self._missing() or " ")
        if measured is None:
            self._drawn = {}
            self.save.hide()
            return
        current = controller.current
        error, time = ERRORS[self.error.currentIndex()], TIMES[self.time.currentIndex()]
        self._drawn = drawn_rows(measured.rows, error, time)
        self.save.setVisible(bool(self._drawn))
        self.plot.show_points(points_of(self._drawn), current, error.title, time.title)
        self._model.show(COLUMNS, [self._table_row(i) for i in range(len(measured.rows))])
        self.table.fit_columns()
        self._widest_setting = self.table.horizontalHeader().sectionSize(SETTING)
        self._fit_settings()
        highlighted = self.plot.highlighted
        self._select(current if highlighted is None else highlighted)

    def _fit_settings(self) -> None:
        """Give the settings the width of their texts, at most half of the table's."""
        half = max(LETTERS * self.fontMetrics().averageCharWidth(), self.table.width() // 2)
        self.table.horizontalHeader().resizeSection(SETTING, min(self._widest_setting, half))

    def reset_layout(self) -> None:
        """Share out the room as at first."""
        set_shares(self._split, SHARES)

    def ask_save(self) -> None:
        """Save the plot with these axes."""
        controller = self.controller
        if self._drawn:
            error, time = ERRORS[self.error.currentIndex()], TIMES[self.time.currentIndex()]
            title = f"Accuracy and speed: {task_text(controller.task)}"
            figure = Tradeoff(Table(title, error.title, time.title, tuple(self._drawn.values())))
            document, jobs = controller.document, controller.trainer.jobs
            title = "Save accuracy and speed"
            export_picture(figure, self, title, "tradeoff.svg", document, jobs)

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self.controller.set_visible(True)

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self.controller.set_visible(False)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Plot and table stand below each other, or side by side where the page is wide."""
        super().resizeEvent(event)
        beside = self.width() > WIDE * self.height()
        self._split.setOrientation(Qt.Orientation.Horizontal if beside else Qt.Orientation.Vertical)
        if self._widest_setting:
            self._fit_settings()

    def _show_progress(self) -> None:
        """Show how far a measurement is, or how old the one shown is."""
        controller, progress = self.controller, self.controller.progress
        self.measure.setVisible(not controller.running)
        self.progress.setVisible(controller.running)
        self.cancel.setVisible(controller.running)
        self.progress.show_step(progress)
        if controller.running:
            self.state.set_text("starting" if progress is None else progress.text)
        else:
            self.state.set_text(*self._age_texts())

    def _age_texts(self) -> tuple[str, str]:
        """When and on what it was measured, at length and in short."""
        measured, edits = self.controller.measured, self.controller.edits
        if measured is None:
            return "", ""
        when = measured.time.astimezone().strftime("%d %b %H:%M")
        since = f"{edits or 'no'} change{'' if edits < 2 else 's'} since"
        count = sum(bool(used.edit) for used in measured.labels)
        long = f"measured {when} on {count} demonstrations labelled by {measured.author} · {since}"
        if self.controller.current is None:
            long += " · the settings in use were not measured"
        return long, f"{when} · {since}"

    def _missing(self) -> str:
        controller, task = self.controller, task_text(self.controller.task)
        if controller.labelled < 2:
            return (
                f"To measure how well settings recognise '{task}', two labelled demonstrations are "
                "needed: each is recognised by settings trained on the others. Labelled so "
                f"far: {controller.labelled}. Label more in the Label workspace."
            )
        if controller.running:
            return f"'{task}' is being measured; you can go on with your work."
        if controller.reading:
            return ""
        return (
            f"Nothing was measured for '{task}' yet. 'Measure' tries the presets and single "
            "settings on its demonstrations, which takes some minutes in the background. Each "
            "then becomes a point, error against run time; click a point to train with it."
        )

    def _table_row(self, number: int) -> TableRow:
        measured = self.controller.measured
        assert measured is not None
        row, in_use = measured.rows[number], number == self.controller.current
        front = number in self._drawn and self._drawn[number].pareto
        mark = (IN_USE if in_use else "") + (FRONT if front else "")
        return TableRow((mark, setting_name(row), *_cells(row)), tip=summary(row), bold=in_use)

    def _select(self, row: int | None) -> None:
        """Show a row's figures, and mark it in plot and table."""
        measured = self.controller.measured
        if measured is None or row is None or not 0 <= row < len(measured.rows):
            self.summary.setText("Point at a setting to see its figures; a click uses it.")
            return
        text = summary(measured.rows[row])
        self.summary.setText(text)
        self.plot.setAccessibleDescription(text)
        self.plot.highlight(row)
        if self.table.currentIndex().row() != row:
            index = self._model.index(row, SETTING)
            flags = QItemSelectionModel.SelectionFlag
            self.table.selectionModel().setCurrentIndex(index, flags.ClearAndSelect | flags.Rows)
            self.table.scrollTo(index)


def _row(*widgets: QWidget) -> QWidget:
    """Widgets beside each other; labels and lists that elide share the room."""
    holder = QWidget()
    shared = [(part, int(isinstance(part, (ElidedLabel, ElidedComboBox)))) for part in widgets]
    fill_layout(QHBoxLayout(holder), *shared, margins=(6, 4, 6, 4))
    return holder
