"""Each coder alone: how much durations vary from one demonstration to the next, and odd places."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QAbstractItemView,
    QComboBox,
    QHeaderView,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui.document import Document
from forcelab.gui.review.coders_pair import sentence
from forcelab.gui.review.coders_places import PlaceRow, PlaceTable

if TYPE_CHECKING:
    from forcelab.review.agreement import Agreement
    from forcelab.review.consistency import Consistency

__all__ = ["AloneView"]


class AloneView(QWidget):
    """How consistent a coder is.

    Parameters
    ----------
    document : Document
    parent : QWidget, optional
    """

    def __init__(self, document: Document, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.document = document
        self._own: tuple[Consistency, ...] = ()
        self._names: Mapping[str, str] = {}
        self.coder = QComboBox()
        self.coder.setAccessibleName(self.tr("Coder"))
        self.coder.activated.connect(lambda _: self._show())
        about = sentence(muted=True)
        about.setText(
            self.tr(
                "Variation is the spread of an action's durations, as a share of their mean. A low "
                "one means that its segments are about as long each time."
            )
        )
        self.durations = QTableWidget(0, 4)
        self.durations.setAccessibleName(self.tr("Durations of each action"))
        self.durations.setHorizontalHeaderLabels(
            [self.tr("Action"), self.tr("Segments"), self.tr("Mean, s"), self.tr("Variation")]
        )
        for number in range(4):
            if (title := self.durations.horizontalHeaderItem(number)) is not None:
                title.setTextAlignment(_side(number))
        self.durations.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.durations.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        self.durations.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.durations.setShowGrid(False)
        self.durations.verticalHeader().hide()
        high = round(1.6 * self.fontMetrics().height())
        self.durations.verticalHeader().setDefaultSectionSize(high)
        self.durations.setMinimumHeight(round(6.5 * high))  # where there is less room, all scrolls
        head = self.durations.horizontalHeader()
        head.setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        head.setHighlightSections(False)
        self._odd = sentence()
        self.places = PlaceTable(self.tr("Segments that stand out"))
        self.places.wanted.connect(self._show_place)
        column = QVBoxLayout(self)
        column.setContentsMargins(6, 6, 6, 6)
        column.addWidget(self.coder)
        column.addWidget(about)
        column.addWidget(self.durations, 1)
        column.addWidget(self._odd)
        column.addWidget(self.places, 1)

    def show_agreement(self, found: Agreement, names: Mapping[str, str]) -> None:
        """Show the coders that were found."""
        kept = self.coder.currentText()
        self._own, self._names = found.own, names
        self.coder.clear()
        self.coder.addItems([one.author for one in found.own])
        self.coder.setCurrentIndex(max(self.coder.findText(kept), 0))
        self._show()

    def _show(self) -> None:
        """Show the coder that is chosen."""
        index = self.coder.currentIndex()
        if not 0 <= index < len(self._own):
            return
        own = self._own[index]
        tasks = len({one.task for one in own.actions})
        self.durations.setRowCount(len(own.actions))
        for row, one in enumerate(own.actions):
            name = one.action if tasks == 1 else f"{one.task}: {one.action}"
            spread = "–" if one.variation is None else f"{100 * one.variation:.0f} %"
            for column, text in enumerate((name, str(one.count), f"{one.mean:.2f}", spread)):
                item = QTableWidgetItem(text)
                item.setTextAlignment(_side(column))
                self.durations.setItem(row, column, item)
        odd = [PlaceRow(place, self.tr("unusual duration")) for place in own.odd]
        rare = [PlaceRow(place, self.tr("order found nowhere else")) for place in own.rare]
        text = self.tr(
            "{0} segments are unusually long or short for their action, and {1} times two actions "
            "follow each other as in no other demonstration of the task. Worth a look; it need not "
            "be a mistake."
        )
        nothing = self.tr("No segment stands out by its duration or by what it follows.")
        self._odd.setText(text.format(len(odd), len(rare)) if odd or rare else nothing)
        self.places.setVisible(bool(odd or rare))
        heads = (self.tr("Action"), self.tr("Then"), self.tr("What"))
        self.places.put([*odd, *rare], self._names, heads)

    def _show_place(self, row: int) -> None:
        """Look at a place."""
        self.document.examine(self.places.rows.rows[row].place)


def _side(column: int) -> Qt.AlignmentFlag:
    """How a column is aligned: numbers at the right."""
    side = Qt.AlignmentFlag.AlignLeft if column == 0 else Qt.AlignmentFlag.AlignRight
    return side | Qt.AlignmentFlag.AlignVCenter
