"""Each coder alone: how much durations vary from one demonstration to the next, and odd places."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QAbstractItemView, QComboBox, QVBoxLayout, QWidget

from forcelab.gui.document import Document
from forcelab.gui.review.coders_pair import sentence
from forcelab.gui.review.coders_places import PlaceRow, PlaceTable
from forcelab.gui.review.rows import Column, Row, TextModel, TextRows
from forcelab.gui.review.wanted import shown_task

if TYPE_CHECKING:
    from forcelab.review.agreement import Agreement, Consistency

__all__ = ["AloneView"]


class AloneView(QWidget):
    """How consistent a coder is."""

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.document = document
        self._own: tuple[Consistency, ...] = ()
        self._names: Mapping[str, str] = {}
        self.coder = QComboBox()
        self.coder.setAccessibleName("Coder")
        self.coder.activated.connect(lambda _: self._show())
        about = sentence(muted=True)
        about.setText(
            "± is the spread of an action's durations, as a share of their mean. A low one "
            "means that its segments are about as long each time."
        )
        self._model = TextModel(self)
        self.durations = TextRows(self._model)
        self.durations.setAccessibleName("Durations of each action")
        self.durations.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        self.durations.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        high = self.durations.verticalHeader().defaultSectionSize()
        self.durations.setMinimumHeight(round(6.5 * high))  # where there is less room, all scrolls
        self._odd = sentence()
        self.places = PlaceTable("Segments that stand out")
        self.places.wanted.connect(document.examine)
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
        rows = []
        for one in own.actions:
            # The task stands last, so that it is cut before the action is.
            name = one.action if tasks == 1 else f"{one.action} · {shown_task(one.task)}"
            spread = "–" if one.variation is None else f"{100 * one.variation:.0f}"
            rows.append(Row((name, str(one.count), f"{one.mean:.2f}", spread)))
        numbers = "Count", "Mean, s", "± %"
        self._model.show((Column("Action", number=False), *map(Column, numbers)), rows)
        self.durations.fit_columns(stretched=0)
        odd = [PlaceRow(place, "unusual duration") for place in own.odd]
        rare = [PlaceRow(place, "order found nowhere else") for place in own.rare]
        text = (
            "{0} segments are unusually long or short for their action, and {1} times two actions "
            "follow each other as in no other demonstration of the task. Worth a look; it need not "
            "be a mistake."
        )
        nothing = "No segment stands out by its duration or by what it follows."
        self._odd.setText(text.format(len(odd), len(rare)) if odd or rare else nothing)
        self.places.setVisible(bool(odd or rare))
        heads = ("Action", "Then", "What")
        self.places.put([*odd, *rare], self._names, heads)
