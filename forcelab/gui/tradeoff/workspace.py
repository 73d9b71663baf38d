"""The Trade-off workspace: the plot, the table beside it, and what can be done where both lack."""

from __future__ import annotations

from PySide6.QtCore import QItemSelectionModel, QModelIndex, QSignalBlocker, Qt
from PySide6.QtWidgets import QHBoxLayout, QSplitter, QStackedWidget, QWidget

from forcelab.gui.arranging import column, copyable, placeholder
from forcelab.gui.review.rows import TextModel, TextRows
from forcelab.gui.review.wanted import shown_task
from forcelab.gui.tradeoff.bar import TradeoffBar
from forcelab.gui.tradeoff.measuring import Measuring
from forcelab.gui.tradeoff.plot import TradeoffPlot
from forcelab.gui.tradeoff.points import points_of
from forcelab.gui.tradeoff.table import columns, rows_of, sentence

__all__ = ["TradeoffWorkspace"]

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
        self.table = TextRows(self._model)
        self.table.setAccessibleName("All settings that were measured")
        self.empty = placeholder()
        self.empty.setFixedWidth(480)
        self.empty.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        left = QWidget()
        column(left, self.plot, self.told, growing=self.plot)
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
        column(self, self.bar, self._pages, growing=self._pages)
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
        task = shown_task(state.task)
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
