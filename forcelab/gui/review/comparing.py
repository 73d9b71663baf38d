"""Comparing two runs of the project: which settings differ, and what became better or worse."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path

from PySide6.QtCore import QModelIndex, QSize, Qt
from PySide6.QtWidgets import (
    QDialog,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QSplitter,
    QVBoxLayout,
    QWidget,
)

from forcelab.errors import ForcelabError
from forcelab.gui.arranging import muted, resize_on_screen
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.review.bar_texts import run_text
from forcelab.gui.review.comparing_table import (
    by_demonstration,
    by_metric,
    columns_of,
    settings_text,
)
from forcelab.gui.review.confusion_switches import stage_choice
from forcelab.gui.review.metric_words import Metric, events, rates
from forcelab.gui.review.narrow_list import NarrowList
from forcelab.gui.review.rows import TextModel, TextRows, copy_text
from forcelab.gui.review.seen import blind_to
from forcelab.gui.review.training_jobs import BACKGROUND, Kept, Work
from forcelab.gui.theme import themes
from forcelab.review.run_comparison import Comparison, comparing

__all__ = ["ComparingDialog"]

LISTING, COMPARING = "runs to compare", "comparing"


class ComparingDialog(QDialog):
    """Two runs of the project side by side, pooled and for each demonstration that both tested.

    Parameters
    ----------
    document : Document
    jobs : Jobs
    parent : QWidget, optional
    work : Work, optional
        What lists and reads runs.
    """

    def __init__(
        self,
        document: Document,
        jobs: Jobs,
        parent: QWidget | None = None,
        *,
        work: Work = BACKGROUND,
    ) -> None:
        super().__init__(parent)
        self.document = document
        self._jobs = jobs
        self._work = work
        self.comparison: Comparison | None = None
        self._ids: tuple[str, ...] = ()
        self.setWindowTitle("Compare two runs")
        self.one, self.other = NarrowList(), NarrowList()
        self.one.setAccessibleName("First run")
        self.other.setAccessibleName("Second run")
        self.stage = stage_choice()
        self.settings = QLabel()
        self.settings.setAccessibleName("Settings that differ")
        self.settings.setWordWrap(True)
        self.settings.setTextFormat(Qt.TextFormat.PlainText)
        self.note = muted()
        self.model, self.each_model = TextModel(self), TextModel(self)
        self.table, self.each = TextRows(self.model), TextRows(self.each_model)
        self.table.setAccessibleName("Scores of both runs")
        self.each.setAccessibleName("Demonstrations of both runs")
        self._lay_out()
        for box in (self.one, self.other):
            box.currentIndexChanged.connect(self._compare)
        self.stage.currentIndexChanged.connect(self._show)
        self.table.selectionModel().currentRowChanged.connect(self._show_each)
        self.each.clicked.connect(self._open)
        themes().changed.connect(self._show)
        resize_on_screen(self, QSize(720, 620))
        self._list()

    @property
    def metrics(self) -> tuple[Metric, ...]:
        """What is compared."""
        return (*rates(), *(metric for metric in events() if metric.better))

    def done(self, result: int) -> None:
        """Nothing is computed any more when it closes."""
        for key in (LISTING, COMPARING):
            self._jobs.cancel(key)
        super().done(result)

    # Inside

    def _lay_out(self) -> None:
        """Runs and settings above the tables."""
        runs = QHBoxLayout()
        runs.addWidget(self.one, 1)
        runs.addWidget(QLabel("→"))
        runs.addWidget(self.other, 1)
        runs.addWidget(self.stage)
        tables = QSplitter(Qt.Orientation.Vertical, childrenCollapsible=False)
        tables.addWidget(self.table)
        tables.addWidget(self.each)
        tables.setSizes([2000, 1000])
        copy = QPushButton("Copy")
        copy.setToolTip("Copy the table as text for a spreadsheet")
        copy.setAutoDefault(False)
        copy.clicked.connect(lambda: copy_text(self.model.as_tsv()))
        close = QPushButton("Close")
        close.setAutoDefault(False)
        close.clicked.connect(self.accept)
        buttons = QHBoxLayout()
        buttons.addWidget(self.note, 1)
        buttons.addWidget(copy)
        buttons.addWidget(close)
        column = QVBoxLayout(self)
        column.addLayout(runs)
        column.addWidget(self.settings)
        column.addWidget(tables, 1)
        column.addLayout(buttons)

    def _list(self) -> None:
        """Read which runs there are."""
        project = self.document.project
        if project is None:
            self.settings.setText("Open a project to compare its runs.")
            return
        self._jobs.run(self._work.listed(project.path), self._offer, self._fail, key=LISTING)

    def _offer(self, runs: tuple[Kept, ...]) -> None:
        """Offer the runs: at first the one that is reviewed, and the one before it of its tasks."""
        if len(runs) < 2:
            self.settings.setText(
                "Two runs are needed to compare; train once more, with other settings."
            )
            return
        for box, chosen in zip((self.one, self.other), self._first_two(runs), strict=True):
            box.blockSignals(True)
            for run in runs:
                box.addItem(run_text(run), run.number)
            box.setCurrentIndex(chosen)
            box.blockSignals(False)
        self._compare()

    def _first_two(self, runs: tuple[Kept, ...]) -> tuple[int, int]:
        """Places of an older and a newer run that are worth a comparison; the latest is first."""
        outcome = self.document.outcome
        numbers = [run.number for run in runs]
        shown = None if outcome is None else outcome.number
        other = numbers.index(shown) if shown in numbers else 0
        alike = [i for i, run in enumerate(runs) if run.title == runs[other].title and i != other]
        one = next((i for i in alike if i > other), alike[0] if alike else (other + 1) % len(runs))
        return max(one, other), min(one, other)

    def _compare(self) -> None:
        """Read both runs and compare them in the background."""
        project = self.document.project
        if project is None:
            return
        self.comparison = None
        self.note.setText("comparing…")
        numbers = (int(self.one.currentData()), int(self.other.currentData()))
        job = _comparing(self._work, project.path, *numbers)
        self._jobs.run(job, self._take, self._fail, key=COMPARING)

    def _take(self, comparison: Comparison) -> None:
        """Show what came of it."""
        self.comparison = comparison
        self._show()

    def _fail(self, error: Exception) -> None:
        """Say what stands in the way."""
        sentence = str(error) if isinstance(error, ForcelabError) else repr(error)
        self.settings.setText(sentence)
        self.note.setText("")

    def _show(self) -> None:
        """Fill the table of metrics."""
        comparison = self.comparison
        if comparison is None:
            return
        self.settings.setText(settings_text(comparison))
        row = max(self.table.currentIndex().row(), 0)
        stage = str(self.stage.currentData())
        columns = columns_of(comparison, "Metric", sure=True)
        self.model.show(columns, by_metric(comparison, stage, self.metrics))
        self.table.fit_columns(stretched=0)
        self.table.selectRow(row)
        self.table.setCurrentIndex(self.model.index(row, 0))
        self.note.setText(self._note(comparison, stage))

    def _note(self, comparison: Comparison, stage: str) -> str:
        """On what the comparison rests."""
        if not comparison.shared:
            return (
                "The two tested no demonstration in common, so there is nothing to set side by "
                "side; choose two runs of the same task."
            )
        reason = comparison.intervals[stage].reason
        shared = f"Both tested {len(comparison.shared)} demonstrations."
        return f"{shared} {reason}".strip()

    def _show_each(self, index: QModelIndex) -> None:
        """Fill the table of demonstrations with the chosen metric."""
        comparison = self.comparison
        if comparison is None or not index.isValid():
            return
        metric = self.metrics[index.row()]
        rows, self._ids = by_demonstration(
            comparison, str(self.stage.currentData()), metric, self._seen()
        )
        columns = columns_of(comparison, metric.title, sure=False)
        self.each_model.show(columns, rows)
        self.each.fit_columns(stretched=0)

    def _seen(self) -> frozenset[str]:
        """The demonstrations that the coder may see predictions of."""
        shared = () if self.comparison is None else self.comparison.shared
        return frozenset(shared) - blind_to(self.document)

    def _open(self, index: QModelIndex) -> None:
        """Open the demonstration of a row."""
        if index.isValid():
            self.document.open_demonstration(self._ids[index.row()])


def _comparing(work: Work, path: Path, one: int, other: int) -> Generator[object, None, Comparison]:
    """Read two runs and compare them."""
    first = yield from work.load(path, one)
    second = first if one == other else (yield from work.load(path, other))
    return (yield from comparing(first, second))
