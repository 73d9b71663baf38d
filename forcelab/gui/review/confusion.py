"""The confusion view: which action was seen where the coder saw another, and every such place."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtGui import QHideEvent, QPalette, QResizeEvent, QShowEvent
from PySide6.QtWidgets import (
    QLabel,
    QScrollArea,
    QSizePolicy,
    QSplitter,
    QWidget,
)

from forcelab.errors import ForcelabError
from forcelab.gui.arranging import PageOrNote, column, scrolled
from forcelab.gui.document import Document
from forcelab.gui.figures.canvas import LIGHT
from forcelab.gui.figures.confusion import ConfusionMatrix, Words
from forcelab.gui.jobs import Jobs
from forcelab.gui.review.confusion_painting import MatrixCanvas, fitted
from forcelab.gui.review.confusion_places import PlacesList
from forcelab.gui.review.confusion_switches import Switches
from forcelab.gui.review.confusion_words import as_text, missing, sentence
from forcelab.gui.review.rows import copy_text
from forcelab.gui.review.seen import seen_of
from forcelab.gui.saving import ask_picture, save_picture
from forcelab.gui.theme import colours, themes
from forcelab.review.confusion import Cells, crossing
from forcelab.review.run_result import Outcome

__all__ = ["ConfusionView"]

KEY = "confusion"
#: Least height of the matrix with its sentence, in lines; where there is less room, all scrolls.
LINES = 13


class ConfusionView(QWidget):
    """The confusion matrix of the outcome, and the places that a cell is counted from.

    While it is hidden nothing is counted.
    """

    def __init__(self, document: Document, jobs: Jobs) -> None:
        super().__init__()
        self.document = document
        self._jobs = jobs
        self.cells: Cells | None = None
        # What is counted or being counted: of this outcome these demonstrations, at this stage.
        self._outcome: Outcome | None = None
        self._wanted: tuple[tuple[str, ...], str] = ((), "")
        self.switches = Switches()
        self.canvas = MatrixCanvas()
        self.sentence = QLabel(wordWrap=True, textFormat=Qt.TextFormat.PlainText)
        self.sentence.setAccessibleName("The cell")
        self.sentence.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Minimum)
        self.list = PlacesList(document)
        self._area = QScrollArea()
        self._area.setWidget(self.canvas)
        self._area.setFrameShape(QScrollArea.Shape.NoFrame)
        self._area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._area.setBackgroundRole(QPalette.ColorRole.Base)
        self._area.setAlignment(Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop)
        self._lay_out()
        self.switches.stage_changed.connect(self._refresh)
        self.switches.changed.connect(self._changed)
        self.switches.copy.clicked.connect(self.copy)
        self.switches.save.clicked.connect(self.ask_save)
        self.canvas.pointed.connect(self._say)
        self.canvas.picked.connect(self._pick)
        document.outcome_changed.connect(self._refresh)
        document.author_changed.connect(self._refresh)
        document.listing_changed.connect(self._refresh)
        themes().changed.connect(self._draw)

    @property
    def figure(self) -> ConfusionMatrix | None:
        """The matrix as it is saved: on white, with title and key."""
        return None if self.cells is None else self._figure(headed=True)

    def copy(self) -> None:
        """Copy what the matrix shows as lines of cells with tabs between them."""
        if self.cells is not None:
            copy_text(as_text(self.cells, self.switches.unit, self.switches.share))
            self.document.say("The matrix was copied.")

    def ask_save(self) -> None:
        """Let the user name a file for the matrix."""
        title = "Save the confusion matrix"
        if (chosen := ask_picture(self, title, "confusion.svg")) is not None:
            self.save(chosen)

    def save(self, path: Path) -> None:
        """Write the matrix as a figure in the background, in the format that the suffix names."""
        if (figure := self.figure) is not None:
            save_picture(figure, path, self.document, self._jobs)

    # Qt

    def showEvent(self, event: QShowEvent) -> None:
        """Catch up with what happened while it was hidden."""
        super().showEvent(event)
        self._refresh()
        self._draw()

    def hideEvent(self, event: QHideEvent) -> None:
        """Nothing is counted for nobody."""
        super().hideEvent(event)
        self._jobs.cancel(KEY)
        if self.cells is None:
            self._outcome = None

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Fit the matrix to its room."""
        super().resizeEvent(event)
        self._draw()

    # Inside

    def _lay_out(self) -> None:
        """Switches above the matrix, the sentence and the list below it."""
        upper = QWidget()
        self.sentence.setContentsMargins(8, 2, 8, 4)
        column(upper, self._area, self.sentence, growing=self._area, spacing=2)
        upper.setMinimumHeight(LINES * self.fontMetrics().height())
        self._split = QSplitter(Qt.Orientation.Vertical, childrenCollapsible=False)
        self._split.addWidget(upper)
        self._split.addWidget(self.list)
        self._split.setStretchFactor(0, 3)
        self._split.setStretchFactor(1, 1)
        self._split.setSizes([3000, 1000])
        self._split.splitterMoved.connect(self._draw)
        self._page = scrolled(self._split)
        self._pages = PageOrNote(self._page)
        column(self, self.switches, self._pages, growing=self._pages)

    def _refresh(self) -> None:
        """Show the outcome as it is now, counting it if that was not done."""
        if not self.isVisible():
            return
        try:
            outcome = seen_of(self.document)
        except ForcelabError as error:
            self._outcome = None  # to be counted as soon as it can be read
            self._show_empty(str(error))
            return
        if outcome is None or not outcome.tested:
            self._jobs.cancel(KEY)
            self._outcome = None
            self._show_empty(missing(outcome, opened=self.document.project is not None))
            return
        wanted = (tuple(one.id for one in outcome.tested), self.switches.stage)
        if self._outcome is not self.document.outcome or self._wanted != wanted:
            if self._wanted[0] != wanted[0]:  # perhaps because some may not be seen any more
                self.canvas.show_figure(None)
            self._outcome, self._wanted = self.document.outcome, wanted
            self.cells = None
            self.list.clear()
            self._jobs.run(crossing(outcome, self.switches.stage), self._take, key=KEY)

    def _changed(self) -> None:
        """Show the same otherwise."""
        self._draw()
        self._relist()

    def _take(self, cells: Cells) -> None:
        """Show what was counted."""
        self.cells = cells
        if not cells.demonstrations:
            self._show_empty("This run kept no raw predictions; choose 'Filtered'.")
            self.switches.show()
            return
        self._pages.say("")
        self.switches.show()
        self._draw()
        self._relist()

    def _show_empty(self, text: str) -> None:
        """Show a sentence in place of the matrix."""
        self.cells = None
        self.canvas.show_figure(None)
        self.list.clear()
        self._pages.say(text)
        self.switches.hide()

    def _figure(self, *, headed: bool) -> ConfusionMatrix:
        """The matrix as a figure: for paper, or for the window."""
        assert self.cells is not None
        outcome, unit, matrix = (
            self.document.outcome,
            self.switches.unit,
            self.cells.matrix(self.switches.unit),
        )
        title = "" if outcome is None else outcome.title
        stage = self.switches.stage
        # In the cells are shares: only the totals have a unit.
        total = "total (s)" if unit == "time" else "total"
        words = Words("human", "predicted", "unlabelled", total)
        return ConfusionMatrix(
            f"{title}, after the filters" if stage == "filtered" else f"{title}, raw predictions",
            self.cells.actions,
            matrix if unit == "time" else matrix.astype(np.int64),
            theme=LIGHT if headed else colours(),
            unit="s" if unit == "time" else "segments",
            share=self.switches.share,
            headed=headed,
            words=Words() if headed else words,
        )

    def _draw(self) -> None:
        """Draw the matrix into the room there is."""
        if self.cells is None or not self.isVisible() or not self.cells.actions:
            return
        figure = fitted(self._figure(headed=False), self._area.maximumViewportSize())
        self.canvas.show_figure(figure)
        self._say(self.canvas.chosen or self.canvas.focus)

    def _say(self, cell: tuple[int, int] | None) -> None:
        """Say in a sentence what a cell holds."""
        if self.cells is None or cell is None:
            self.sentence.setText("")
            return
        text = sentence(self.cells, cell, self.switches.unit, self.switches.share)
        self.sentence.setText(text)
        self.canvas.setAccessibleDescription(text)

    def _pick(self, row: int, column: int, by_key: bool) -> None:
        """List the places of a cell; the keyboard goes there too."""
        if self.cells is None:
            return
        self._relist()
        self._page.ensureWidgetVisible(self.list, 0, 0)
        if by_key and self.list.places:
            self.list.table.setFocus()

    def _relist(self) -> None:
        """List the places of the chosen cell."""
        if self.cells is None or self.canvas.chosen is None:
            self.list.clear()
            return
        row, column = self.canvas.chosen
        actions = self.cells.actions
        predicted = None if column == len(actions) else actions[column]
        names = {one.id: one.name for one in self.cells.demonstrations}
        found = self.cells.places(actions[row], predicted, self.switches.unit)
        self.list.show_places(
            found, names, int(self.cells.numbers(self.switches.unit)[row, column])
        )
