"""The scores view: all metrics of a run, pooled with intervals and for each demonstration."""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass

from PySide6.QtCore import QModelIndex, Qt
from PySide6.QtGui import QHideEvent, QShowEvent
from PySide6.QtWidgets import QAbstractButton, QHBoxLayout, QWidget

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.figures.text import NAMES
from forcelab.gui.item_views import TableColumn, TableRow, TextModel, TextTable, copy_text
from forcelab.gui.jobs import Jobs
from forcelab.gui.layout import (
    PageOrPlaceholder,
    fill_layout,
    muted_label,
    page_layout,
    push_button,
    toned_label,
)
from forcelab.gui.review.metrics import (
    AGREEMENT_METRICS,
    ERROR_METRICS,
    RELIABILITY_TIP,
    Metric,
    reliability_text,
)
from forcelab.gui.review.reviewed_run import on_visible_run_changed, untested_text, visible_run
from forcelab.gui.widgets import combo_box
from forcelab.jobs import Progress
from forcelab.recognition.intervals import METHOD, Intervals, score_intervals
from forcelab.recognition.metrics import count_segments
from forcelab.recognition.results import STAGES, TOO_HIGH, DemonstrationResult
from forcelab.review.run_result import RunResult

#: Rows at the top that are never sorted: pooled and its intervals.
POOLED_ROWS = 2


@dataclass(frozen=True, slots=True)
class Sorting:
    """By which column the demonstrations are sorted; None for the run's order."""

    column: int | None = None
    descending: bool = False


def compute_intervals(run: RunResult) -> Generator[Progress, None, dict[str, Intervals]]:
    """The intervals of both stages: as the run has them, otherwise from its segments."""
    result = {}
    for stage in STAGES:
        stored = run.scores.get(stage, {}).get("intervals")
        if stored is not None:
            result[stage] = Intervals.from_json(stored)
            continue
        counts = []
        for number, reviewed in enumerate(run.tested, 1):
            if stage in reviewed.stages:
                counts.append(count_segments(reviewed.human, reviewed.stages[stage], run.actions))
            yield Progress(number, len(run.tested), reviewed.name)
        result[stage] = score_intervals(counts, run.settings.seed)
    return result


def _sort_key(value: float | None, descending: bool) -> float:
    """The number to sort by; a missing one comes last either way."""
    if value is None:
        return math.inf
    return -value if descending else value


INTERVALS_JOB = "scores"
#: Longer names of demonstrations are cut in the middle; in pixels.
WIDEST_NAME = 180


class ScoresView(QWidget):
    """A table of scores; a click on a demonstration opens it, one on a column sorts by it."""

    def __init__(self, document: Document, jobs: Jobs) -> None:
        super().__init__()
        self.document = document
        self._jobs = jobs
        self.intervals: dict[str, Intervals] = {}
        self.sorting = Sorting()
        self._run: RunResult | None = None
        self._visible: tuple[DemonstrationResult, ...] = ()
        self._ids: tuple[str, ...] = ()
        self.which = combo_box(
            "Scores to show",
            {"Agreement": "rates", "Kinds of errors": "events"},
            "How well predictions agree with you, or in which way they are wrong",
        )
        self.copy_button = push_button(
            "Copy", self.copy, tip="Copy the table as text for a spreadsheet"
        )
        self.model = TextModel(self)
        self.table = TextTable(self.model)
        self.table.setAccessibleName("Scores")
        self.warning, self.note = toned_label("warning"), muted_label()
        self._lay_out()
        self.which.currentIndexChanged.connect(self._unsort)
        self.table.clicked.connect(self._open)
        on_visible_run_changed(document, self._refresh)

    @property
    def metrics(self) -> tuple[Metric, ...]:
        return AGREEMENT_METRICS if self.which.currentData() == "rates" else ERROR_METRICS

    def copy(self) -> None:
        copy_text(self.model.as_tsv())
        self.document.show_message("The scores were copied.")

    def sort_by(self, column: int) -> None:
        """Sort demonstrations by a column: the highest first, then the lowest, then as run."""
        now = self.sorting
        if now.column != column:
            self.sorting = Sorting(column, descending=True)
        elif now.descending:
            self.sorting = Sorting(column)
        else:
            self.sorting = Sorting()
        self._show()

    # Qt

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._refresh()

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self._jobs.cancel(INTERVALS_JOB)
        if not self.intervals:
            self._run = None

    # Inside

    def _lay_out(self) -> None:
        self._bar = QWidget()
        bar = QHBoxLayout(self._bar)
        fill_layout(bar, self.which, 1, self.copy_button, margins=(6, 6, 6, 4))
        names = self.table.verticalHeader()
        names.show()
        names.setSectionsClickable(True)
        names.setHighlightSections(False)
        names.setTextElideMode(NAMES)
        names.setMaximumWidth(WIDEST_NAME)
        names.setDefaultSectionSize(round(self.fontMetrics().height() * 2))
        names.sectionClicked.connect(lambda row: self._open(self.model.index(row, 0)))
        header = self.table.horizontalHeader()
        header.setSectionsClickable(True)
        header.sectionClicked.connect(self.sort_by)
        header.setSortIndicatorShown(True)
        # The corner would select everything; nothing is done with that.
        corner = self.table.findChild(QAbstractButton)
        if corner is not None:
            corner.setEnabled(False)
        page = QWidget()
        for label in (self.warning, self.note):
            label.setContentsMargins(8, 4, 8, 4)
        page_layout(page, self.table, self.warning, self.note, growing=self.table)
        self.pages = PageOrPlaceholder(page)
        page_layout(self, self._bar, self.pages, growing=self.pages)

    def _refresh(self) -> None:
        if not self.isVisible():
            return
        try:
            visible = visible_run(self.document)
        except ForcelabError as error:
            self._run = None  # to be shown as soon as it can be read
            self._show_empty(str(error))
            return
        run = self.document.review.run
        if visible is None or run is None or not run.tested:
            self._jobs.cancel(INTERVALS_JOB)
            self._run = None
            empty_text = "Train a recogniser; its scores appear here."
            if run is not None:
                empty_text = untested_text(run, "This run tested no demonstration.")
            self._show_empty(empty_text)
            return
        if run is not self._run:
            self._run, self.intervals = run, {}
            self._jobs.run(compute_intervals(run), self._take, key=INTERVALS_JOB)
        elif [d.id for d in self._visible] == [d.id for d in visible.tested]:
            return
        self._visible = visible.tested
        warnings = [remark for remark in visible.remarks if TOO_HIGH in remark]
        self.warning.setText("\n".join(warnings))
        self.warning.setVisible(bool(warnings))
        self._show()

    def _take(self, intervals: dict[str, Intervals]) -> None:
        self.intervals = intervals
        self._show()

    def _unsort(self) -> None:
        """Other columns: the order of the run."""
        self.sorting = Sorting()
        self._show()

    def _show(self) -> None:
        if self._run is None or not self.isVisible():
            return
        pairs = [(metric, stage) for metric in self.metrics for stage in STAGES]
        columns = [TableColumn(f"{metric.title}\n{stage}", metric.tip) for metric, stage in pairs]
        intervals = self._interval_row(pairs)
        self.model.show(columns, [self._pooled_row(pairs), intervals, *self._sorted_rows(pairs)])
        self.table.fit_columns()
        header = self.table.horizontalHeader()
        column, order = self.sorting.column, Qt.SortOrder
        header.setSortIndicator(
            -1 if column is None else column,
            order.DescendingOrder if self.sorting.descending else order.AscendingOrder,
        )
        self.note.setText(self._note(intervals.tip))
        self.note.setToolTip(RELIABILITY_TIP if self._run.reliability else "")
        self._bar.show()
        self.pages.say("")

    def _pooled_row(self, pairs: Sequence[tuple[Metric, str]]) -> TableRow:
        assert self._run is not None
        scores = {stage: found.get("pooled", {}) for stage, found in self._run.scores.items()}
        cells = tuple(metric.text(metric.value(scores.get(stage, {}))) for metric, stage in pairs)
        return TableRow(cells, "pooled", bold=True)

    def _interval_row(self, pairs: Sequence[tuple[Metric, str]]) -> TableRow:
        """The intervals of what is pooled, and how they were computed or why there are none."""
        name, intervals = "95 % interval", self.intervals
        if not intervals:
            return TableRow(("…",) * len(pairs), name, "The intervals are being computed.")
        reason = next((found.reason for found in intervals.values() if found.reason), METHOD)
        cells = tuple(
            metric.span(intervals[stage][metric.path] if stage in intervals else None)
            for metric, stage in pairs
        )
        return TableRow(cells, name, reason)

    def _sorted_rows(self, pairs: Sequence[tuple[Metric, str]]) -> list[TableRow]:
        """A row for each demonstration, in the order that was chosen."""
        listed = [
            (d, [metric.value(d.scores.get(stage, {})) for metric, stage in pairs])
            for d in self._visible
        ]
        if (column := self.sorting.column) is not None:
            listed.sort(key=lambda row: _sort_key(row[1][column], self.sorting.descending))
        self._ids = tuple(d.id for d, _ in listed)
        return [
            TableRow(tuple(m.text(v) for (m, _), v in zip(pairs, values, strict=True)), d.name)
            for d, values in listed
        ]

    def _note(self, state: str) -> str:
        run = self._run
        assert run is not None
        note = f"Run {run.number}, seed {run.settings.seed}. 95 % intervals: {state}"
        return "\n".join((note, reliability_text(run.reliability))).strip()

    def _show_empty(self, text: str) -> None:
        self._bar.hide()
        self.pages.say(text)

    def _open(self, index: QModelIndex) -> None:
        number = index.row() - POOLED_ROWS
        if 0 <= number < len(self._ids):
            self.document.open_demonstration(self._ids[number])
