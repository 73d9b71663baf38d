"""The scores view: all metrics of a run, pooled with intervals and for each demonstration."""

from __future__ import annotations

import math
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass

from PySide6.QtCore import QModelIndex, Qt
from PySide6.QtGui import QHideEvent, QShowEvent
from PySide6.QtWidgets import (
    QAbstractButton,
    QHBoxLayout,
    QPushButton,
    QWidget,
)

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.figures.text import NAMES
from forcelab.gui.item_views import TableColumn, TableRow, TextModel, TextTable, copy_text
from forcelab.gui.jobs import Jobs
from forcelab.gui.layout import PageOrPlaceholder, muted_label, page_layout
from forcelab.gui.review.display_options import combo_box
from forcelab.gui.review.metric_texts import (
    Metric,
    agreement_metrics,
    error_metrics,
    reliability_text,
    reliability_tip,
)
from forcelab.gui.review.queue_loader import untested_text
from forcelab.gui.review.reviewed_run import visible_outcome
from forcelab.jobs import Progress
from forcelab.recognition.intervals import METHOD, Intervals, score_intervals
from forcelab.recognition.metrics import count_segments
from forcelab.review.run_result import DemonstrationResult, RunResult

#: As the scores name them.
STAGES = ("raw", "filtered")
#: Rows at the top that are never sorted: pooled and its intervals.
POOLED_ROWS = 2


@dataclass(frozen=True, slots=True)
class Sorting:
    """By which column the demonstrations are sorted; None for the run's order."""

    column: int | None = None
    descending: bool = False


def compute_intervals(outcome: RunResult) -> Generator[Progress, None, dict[str, Intervals]]:
    """The intervals of both stages: as the run has them, otherwise from its segments.

    Yields
    ------
    Progress
    """
    result = {}
    for stage in STAGES:
        stored = outcome.scores.get(stage, {}).get("intervals")
        if stored is not None:
            result[stage] = Intervals.from_json(stored)
            continue
        counts = []
        for number, one in enumerate(outcome.tested, 1):
            if stage in one.stages:
                counts.append(count_segments(one.human, one.stages[stage], outcome.actions))
            yield Progress(number, len(outcome.tested), one.name)
        result[stage] = score_intervals(counts, outcome.settings.seed)
    return result


def score_columns(metrics: Sequence[Metric]) -> tuple[TableColumn, ...]:
    """Raw and filtered of each metric, beside one another."""
    words = {
        "raw": "raw",
        "filtered": "filtered",
    }
    return tuple(
        TableColumn(f"{metric.title}\n{words[stage]}", metric.tip)
        for metric in metrics
        for stage in STAGES
    )


def score_rows(
    outcome: RunResult,
    seen: Sequence[DemonstrationResult],
    metrics: Sequence[Metric],
    found: Mapping[str, Intervals],
    sorting: Sorting,
) -> tuple[tuple[TableRow, ...], tuple[str, ...]]:
    """All rows, and the ids of the demonstrations below the fixed ones.

    Parameters
    ----------
    outcome : RunResult
    seen : sequence of DemonstrationResult
        The demonstrations that the coder may see.
    metrics : sequence of Metric
    found : mapping of str to Intervals
        By stage; empty while they are computed.
    sorting : Sorting
    """
    pairs = [(metric, stage) for metric in metrics for stage in STAGES]
    pooled = [
        metric.value(outcome.scores.get(stage, {}).get("pooled", {})) for metric, stage in pairs
    ]
    each = {
        one.id: [
            metric.value(scores[stage]) if stage in scores else None for metric, stage in pairs
        ]
        for one, scores in _scores_by_demonstration(outcome)
    }
    shown = [one for one in seen if one.id in each]
    if sorting.column is not None:
        shown.sort(key=lambda one: _sort_key(each[one.id][sorting.column or 0], sorting.descending))
    rows = [
        _score_row("pooled", pairs, pooled, bold=True),
        _interval_row(pairs, found),
        *(_score_row(one.name, pairs, each[one.id]) for one in shown),
    ]
    return tuple(rows), tuple(one.id for one in shown)


def _scores_by_demonstration(
    outcome: RunResult,
) -> list[tuple[DemonstrationResult, dict[str, Mapping[str, object]]]]:
    """Each tested demonstration with its scores by stage; they stand in the order of the tested."""
    lists = {stage: outcome.scores.get(stage, {}).get("demonstrations", ()) for stage in STAGES}
    return [
        (one, {stage: found[i] for stage, found in lists.items() if i < len(found)})
        for i, one in enumerate(outcome.tested)
    ]


def _score_row(
    name: str,
    pairs: Sequence[tuple[Metric, str]],
    values: Sequence[float | None],
    *,
    bold: bool = False,
) -> TableRow:
    """Numbers as texts."""
    cells = tuple(metric.text(value) for (metric, _), value in zip(pairs, values, strict=True))
    return TableRow(cells, name, bold=bold)


def _interval_row(pairs: Sequence[tuple[Metric, str]], found: Mapping[str, Intervals]) -> TableRow:
    """The intervals of what is pooled, and how they were made or why there are none."""
    name = "95 % interval"
    if not found:
        tip = "The intervals are being computed."
        return TableRow(("…",) * len(pairs), name, tip)
    reason = next((one.reason for one in found.values() if one.reason), "")
    cells = tuple(
        metric.span(found[stage][metric.path] if stage in found else None)
        for metric, stage in pairs
    )
    return TableRow(cells, name, reason or METHOD)


def _sort_key(value: float | None, descending: bool) -> float:
    """What is sorted by; a missing number comes last either way."""
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
        self._outcome: RunResult | None = None
        self._seen: tuple[DemonstrationResult, ...] = ()
        self._ids: tuple[str, ...] = ()
        self.which = combo_box(
            "Scores to show",
            {"Agreement": "rates", "Kinds of errors": "events"},
            "How well predictions agree with you, or in which way they are wrong",
        )
        self.copy_button = QPushButton("Copy")
        self.copy_button.setToolTip("Copy the table as text for a spreadsheet")
        self.model = TextModel(self)
        self.table = TextTable(self.model)
        self.table.setAccessibleName("Scores")
        self.note = muted_label()
        self._lay_out()
        self.which.currentIndexChanged.connect(self._unsort)
        self.copy_button.clicked.connect(self.copy)
        self.table.clicked.connect(self._open)
        document.outcome_changed.connect(self._refresh)
        document.author_changed.connect(self._refresh)
        document.listing_changed.connect(self._refresh)

    @property
    def metrics(self) -> tuple[Metric, ...]:
        """What is shown."""
        return agreement_metrics() if self.which.currentData() == "rates" else error_metrics()

    def copy(self) -> None:
        """Copy the table as lines of cells with tabs between them."""
        copy_text(self.model.as_tsv())
        self.document.say("The scores were copied.")

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
        """Catch up with what happened while it was hidden."""
        super().showEvent(event)
        self._refresh()

    def hideEvent(self, event: QHideEvent) -> None:
        """Nothing is computed for nobody."""
        super().hideEvent(event)
        self._jobs.cancel(INTERVALS_JOB)
        if not self.intervals:
            self._outcome = None

    # Inside

    def _lay_out(self) -> None:
        """The choice above the table, and the note below it."""
        self._bar = QWidget()
        bar = QHBoxLayout(self._bar)
        bar.setContentsMargins(6, 6, 6, 4)
        bar.addWidget(self.which)
        bar.addStretch(1)
        bar.addWidget(self.copy_button)
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
        self.note.setContentsMargins(8, 4, 8, 4)
        page_layout(page, self.table, self.note, growing=self.table)
        self._pages = PageOrPlaceholder(page)
        page_layout(self, self._bar, self._pages, growing=self._pages)

    def _refresh(self) -> None:
        """Show the outcome as it is now."""
        if not self.isVisible():
            return
        try:
            seen = visible_outcome(self.document)
        except ForcelabError as error:
            self._outcome = None  # to be shown as soon as it can be read
            self._show_empty(str(error))
            return
        outcome = self.document.outcome
        if seen is None or outcome is None or not outcome.tested:
            self._jobs.cancel(INTERVALS_JOB)
            self._outcome = None
            nothing = "Nothing was trained yet. Train, and this shows how well that works."
            if outcome is not None:
                nothing = untested_text(outcome, "This run tested no demonstration.")
            self._show_empty(nothing)
            return
        if outcome is not self._outcome:
            self._outcome, self.intervals = outcome, {}
            self._jobs.run(compute_intervals(outcome), self._take, key=INTERVALS_JOB)
        elif [d.id for d in self._seen] == [d.id for d in seen.tested]:
            return
        self._seen = seen.tested
        self._show()

    def _take(self, found: dict[str, Intervals]) -> None:
        """Show the intervals."""
        self.intervals = found
        self._show()

    def _unsort(self) -> None:
        """Other columns: the order of the run."""
        self.sorting = Sorting()
        self._show()

    def _show(self) -> None:
        """Fill the table."""
        if self._outcome is None or not self.isVisible():
            return
        metrics = self.metrics
        rows, self._ids = score_rows(
            self._outcome, self._seen, metrics, self.intervals, self.sorting
        )
        self.model.show(score_columns(metrics), rows)
        self.table.fit_columns()
        header = self.table.horizontalHeader()
        column, order = self.sorting.column, Qt.SortOrder
        header.setSortIndicator(
            -1 if column is None else column,
            order.DescendingOrder if self.sorting.descending else order.AscendingOrder,
        )
        self.note.setText(self._note(rows[1].tip))
        self.note.setToolTip(reliability_tip() if self._outcome.reliability else "")
        self._bar.show()
        self._pages.say("")

    def _note(self, how: str) -> str:
        """How the intervals were made, and what was done to get here."""
        outcome = self._outcome
        assert outcome is not None
        told = f"Run {outcome.number}, seed {outcome.settings.seed}. 95 % intervals: {how}"
        return "\n".join((told, reliability_text(outcome.reliability))).strip()

    def _show_empty(self, text: str) -> None:
        """Show a sentence in place of the table."""
        self._bar.hide()
        self._pages.say(text)

    def _open(self, index: QModelIndex) -> None:
        """Open the demonstration of a row."""
        number = index.row() - POOLED_ROWS
        if 0 <= number < len(self._ids):
            self.document.open_demonstration(self._ids[number])
