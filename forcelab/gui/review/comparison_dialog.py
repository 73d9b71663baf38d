"""The dialog that compares two runs: which settings differ, and what became better or worse."""

from __future__ import annotations

from collections.abc import Collection, Generator
from dataclasses import replace
from pathlib import Path

from PySide6.QtCore import QModelIndex, QSignalBlocker, QSize, Qt
from PySide6.QtWidgets import QDialog, QHBoxLayout, QLabel, QSplitter, QVBoxLayout, QWidget

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.item_views import TableColumn, TableRow, TextModel, TextTable, copy_text
from forcelab.gui.jobs import Jobs
from forcelab.gui.layout import (
    fill_layout,
    fill_splitter,
    muted_label,
    push_button,
    resize_on_screen,
    sentence_label,
)
from forcelab.gui.review.confusion import stage_combo_box
from forcelab.gui.review.metrics import AGREEMENT_METRICS, ERROR_METRICS, Metric
from forcelab.gui.review.reviewed_run import blind_demonstrations
from forcelab.gui.review.training_backend import Backend, run_text
from forcelab.gui.theme import colours, themes
from forcelab.gui.widgets import ElidedComboBox
from forcelab.project import RunSummary
from forcelab.recognition.settings import FIELDS
from forcelab.review.run_comparison import Comparison, comparison_job

#: What a run is asked for, by the words of the dialogs in which it is chosen.
_SETTING_LABELS = {
    "preset": "Preset",
    "windows": "Windows in seconds",
    "tasks": "Train on",
    "test task": "Test on another task",
    "coder": "Labels of",
    "also learnt from": "Also learn from",
    "apart": "Actions of the same name stay apart",
    "groups left out": "Groups left out",
}


def comparison_columns(
    comparison: Comparison, first: str, *, sure: bool
) -> tuple[TableColumn, ...]:
    """The columns' names; `first` heads the rows, `sure` adds the intervals."""
    columns = (
        TableColumn(first, number=False),
        TableColumn(f"run {comparison.first.number}"),
        TableColumn(f"run {comparison.second.number}"),
        TableColumn("difference"),
    )
    tip = "Of the difference, paired over the demonstrations both tested."
    return (*columns, TableColumn("95 % interval", tip)) if sure else columns


def metric_rows(
    comparison: Comparison, stage: str, metrics: Collection[Metric]
) -> tuple[TableRow, ...]:
    """A row for each metric, pooled over what both tested."""
    first, second = comparison.pooled[stage]
    intervals = comparison.intervals[stage]
    rows = []
    for metric in metrics:
        ends = intervals[metric.path]
        values = metric.value(first), metric.value(second)
        row = _difference_row(
            metric, metric.title, *values, sure=ends is None or not ends[0] <= 0 <= ends[1]
        )
        cells = (*row.cells, metric.span(ends, signed=True))
        rows.append(replace(row, cells=cells, tip=metric.tip))
    return tuple(rows)


def settings_differences(comparison: Comparison) -> str:
    """The settings that differ, in a line or two."""
    if not comparison.settings:
        text = "Both runs have the same settings."
    else:
        listed = "; ".join(_setting_difference(*setting) for setting in comparison.settings)
        text = f"Different settings: {listed}."
    if number := len(comparison.relabelled):
        demonstrations = f"{number} of {len(comparison.pairs)} demonstrations"
        text += f" Labels of {demonstrations} were changed between the runs."
    return text


def _setting_difference(name: str, first: str, second: str) -> str:
    """A setting that differs, under its label in the dialog of settings."""
    field = next((field for field in FIELDS if field.name == name), None)
    words = _SETTING_LABELS.get(name, name) if field is None else field.label
    options = {} if field is None else dict(field.options)
    first, second = (options.get(value, value) for value in (first, second))
    return f"{words}: {first} → {second}"


def _difference_row(
    metric: Metric, name: str, first: float | None, second: float | None, *, sure: bool = True
) -> TableRow:
    """Both numbers and their difference: better ones marked, in colour and in words.

    Not where it is not `sure` that there is a difference at all.
    """
    difference = None if first is None or second is None else second - first
    change = metric.text(difference, signed=True)
    colour = None
    if difference is not None and metric.better and change.strip("+\u22120.,"):
        better = (difference > 0) == (metric.better > 0)
        # Not the accent: text on it can be read, but hardly text in it on dark ground.
        colour = colours().range if better else colours().trouble
        words = "better" if better else "worse"
        if not sure:
            colour, words = colours().muted, "no clear difference"
        change = f"{words}  {change}"
    cells = (name, metric.text(first), metric.text(second), change)
    return TableRow(cells, colours=(None, None, None, colour))


LISTING_JOB, COMPARING_JOB = "runs to compare", "comparing"


class ComparisonDialog(QDialog):
    """Two runs of the project side by side, pooled and for each demonstration that both tested."""

    def __init__(
        self,
        document: Document,
        jobs: Jobs,
        parent: QWidget | None = None,
        *,
        backend: Backend | None = None,
    ) -> None:
        super().__init__(parent)
        self.document = document
        self._jobs = jobs
        self._backend = backend or Backend()
        self.comparison: Comparison | None = None
        self._ids: tuple[str, ...] = ()
        self.setWindowTitle("Compare two runs")
        self.first, self.second = ElidedComboBox(), ElidedComboBox()
        self.first.setAccessibleName("First run")
        self.second.setAccessibleName("Second run")
        self.stage = stage_combo_box()
        self.settings = sentence_label()
        self.settings.setAccessibleName("Settings that differ")
        self.note = muted_label()
        self.model, self.each_model = TextModel(self), TextModel(self)
        self.table, self.each = TextTable(self.model), TextTable(self.each_model)
        self.table.setAccessibleName("Scores of both runs")
        self.each.setAccessibleName("Demonstrations of both runs")
        self._lay_out()
        for box in (self.first, self.second):
            box.currentIndexChanged.connect(self._compare)
        self.stage.currentIndexChanged.connect(self._show)
        self.table.selectionModel().currentRowChanged.connect(self._show_each)
        self.each.clicked.connect(self._open)
        themes().changed.connect(self._show)
        resize_on_screen(self, QSize(720, 620))
        self._list()

    @property
    def metrics(self) -> tuple[Metric, ...]:
        return (*AGREEMENT_METRICS, *(metric for metric in ERROR_METRICS if metric.better))

    def done(self, result: int) -> None:
        for key in (LISTING_JOB, COMPARING_JOB):
            self._jobs.cancel(key)
        super().done(result)

    # Inside

    def _lay_out(self) -> None:
        choice = (self.first, 1), QLabel("→"), (self.second, 1), self.stage
        runs = fill_layout(QHBoxLayout(), *choice)
        tables = QSplitter(Qt.Orientation.Vertical)
        fill_splitter(tables, (self.table, self.each), (2, 1))
        tip = "Copy the table as text for a spreadsheet"
        copy = push_button("Copy", self._copy, tip=tip, auto_default=False)
        close = push_button("Close", self.accept, auto_default=False)
        buttons = fill_layout(QHBoxLayout(), (self.note, 1), copy, close)
        fill_layout(QVBoxLayout(self), runs, self.settings, (tables, 1), buttons)

    def _copy(self) -> None:
        copy_text(self.model.as_tsv())

    def _list(self) -> None:
        project = self.document.project
        if project is None:
            self.settings.setText("Open a project to compare its runs.")
            return
        job = self._backend.list_runs(project.path)
        self._jobs.run(job, self._offer, self._fail, key=LISTING_JOB)

    def _offer(self, runs: tuple[RunSummary, ...]) -> None:
        """Offer the runs: at first the reviewed one, and the one before it of its tasks."""
        if len(runs) < 2:
            self.settings.setText(
                "Two runs are needed to compare; train once more, with other settings."
            )
            return
        for box, chosen in zip((self.first, self.second), self._first_two(runs), strict=True):
            with QSignalBlocker(box):
                for run in runs:
                    box.addItem(run_text(run), run.id)
                box.setCurrentIndex(chosen)
        self._compare()

    def _first_two(self, runs: tuple[RunSummary, ...]) -> tuple[int, int]:
        """Indices of an older and a newer run that are worth a comparison; the latest is first."""
        run = self.document.review.run
        numbers = [run.id for run in runs]
        reviewed = None if run is None else run.number
        newer = numbers.index(reviewed) if reviewed in numbers else 0
        same = [i for i, run in enumerate(runs) if run.title == runs[newer].title and i != newer]
        older = next((i for i in same if i > newer), same[0] if same else (newer + 1) % len(runs))
        return max(older, newer), min(older, newer)

    def _compare(self) -> None:
        project = self.document.project
        if project is None:
            return
        self.comparison = None
        self.note.setText("comparing…")
        numbers = (int(self.first.currentData()), int(self.second.currentData()))
        job = _compare_runs(self._backend, project.path, *numbers)
        self._jobs.run(job, self._take, self._fail, key=COMPARING_JOB)

    def _take(self, comparison: Comparison) -> None:
        self.comparison = comparison
        self._show()

    def _fail(self, error: Exception) -> None:
        sentence = str(error) if isinstance(error, ForcelabError) else repr(error)
        self.settings.setText(sentence)
        self.note.setText("")

    def _show(self) -> None:
        comparison = self.comparison
        if comparison is None:
            return
        self.settings.setText(settings_differences(comparison))
        row = max(self.table.currentIndex().row(), 0)
        stage = str(self.stage.currentData())
        columns = comparison_columns(comparison, "Metric", sure=True)
        self.model.show(columns, metric_rows(comparison, stage, self.metrics))
        self.table.fit_columns(stretched=0)
        self.table.selectRow(row)
        self.table.setCurrentIndex(self.model.index(row, 0))
        self.note.setText(self._note(comparison, stage))

    def _note(self, comparison: Comparison, stage: str) -> str:
        if not comparison.pairs:
            return "These runs tested no demonstration in common; choose two runs of the same task."
        reason = comparison.intervals[stage].reason
        shared = f"Both tested {len(comparison.pairs)} demonstrations."
        return f"{shared} {reason}".strip()

    def _show_each(self, index: QModelIndex) -> None:
        comparison = self.comparison
        if comparison is None or not index.isValid():
            return
        metric = self.metrics[index.row()]
        stage, hidden = str(self.stage.currentData()), blind_demonstrations(self.document)
        pairs = [pair for pair in comparison.pairs if pair[0].id not in hidden]
        self._ids = tuple(first.id for first, _ in pairs)
        rows = [
            _difference_row(
                metric,
                first.name,
                *(metric.value(result.scores.get(stage, {})) for result in (first, second)),
            )
            for first, second in pairs
        ]
        columns = comparison_columns(comparison, metric.title, sure=False)
        self.each_model.show(columns, rows)
        self.each.fit_columns(stretched=0)

    def _open(self, index: QModelIndex) -> None:
        if index.isValid():
            self.document.open_demonstration(self._ids[index.row()])


def _compare_runs(
    backend: Backend, path: Path, a: int, b: int
) -> Generator[object, None, Comparison]:
    first = yield from backend.load(path, a)
    second = first if a == b else (yield from backend.load(path, b))
    return (yield from comparison_job(first, second))
