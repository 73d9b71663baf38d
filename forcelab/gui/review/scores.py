"""The scores view: all metrics of the run, pooled with intervals and for each demonstration."""

from __future__ import annotations

from PySide6.QtCore import QModelIndex, Qt
from PySide6.QtGui import QHideEvent, QShowEvent
from PySide6.QtWidgets import (
    QAbstractButton,
    QHBoxLayout,
    QPushButton,
    QWidget,
)

from forcelab.errors import ForcelabError
from forcelab.gui.arranging import PageOrNote, column, muted
from forcelab.gui.document import Document
from forcelab.gui.figures.text import NAMES
from forcelab.gui.jobs import Jobs
from forcelab.gui.review.confusion_switches import choice
from forcelab.gui.review.metric_words import (
    Metric,
    events,
    rates,
    reliability_text,
    reliability_tip,
)
from forcelab.gui.review.queue_words import untested
from forcelab.gui.review.rows import TextModel, TextRows, copy_text
from forcelab.gui.review.scores_table import FIXED, Sorting, columns_of, computing, rows_of
from forcelab.gui.review.seen import seen_of
from forcelab.recognition.intervals import Intervals
from forcelab.review.run_result import Outcome, Reviewed

__all__ = ["ScoresView"]

KEY = "scores"
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
        self._outcome: Outcome | None = None
        self._seen: tuple[Reviewed, ...] = ()
        self._ids: tuple[str, ...] = ()
        self.which = choice(
            "Scores to show",
            {"Agreement": "rates", "Kinds of errors": "events"},
            "How well predictions agree with you, or in which way they are wrong",
        )
        self.copy_button = QPushButton("Copy")
        self.copy_button.setToolTip("Copy the table as text for a spreadsheet")
        self.model = TextModel(self)
        self.table = TextRows(self.model)
        self.table.setAccessibleName("Scores")
        self.note = muted()
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
        return rates() if self.which.currentData() == "rates" else events()

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
        self._jobs.cancel(KEY)
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
        column(page, self.table, self.note, growing=self.table)
        self._pages = PageOrNote(page)
        column(self, self._bar, self._pages, growing=self._pages)

    def _refresh(self) -> None:
        """Show the outcome as it is now."""
        if not self.isVisible():
            return
        try:
            seen = seen_of(self.document)
        except ForcelabError as error:
            self._outcome = None  # to be shown as soon as it can be read
            self._show_empty(str(error))
            return
        outcome = self.document.outcome
        if seen is None or outcome is None or not outcome.tested:
            self._jobs.cancel(KEY)
            self._outcome = None
            nothing = "Nothing was trained yet. Train, and this shows how well that works."
            if outcome is not None:
                nothing = untested(outcome, "This run tested no demonstration.")
            self._show_empty(nothing)
            return
        if outcome is not self._outcome:
            self._outcome, self.intervals = outcome, {}
            self._jobs.run(computing(outcome), self._take, key=KEY)
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
        rows, self._ids = rows_of(self._outcome, self._seen, metrics, self.intervals, self.sorting)
        self.model.show(columns_of(metrics), rows)
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
        number = index.row() - FIXED
        if 0 <= number < len(self._ids):
            self.document.open_demonstration(self._ids[number])
