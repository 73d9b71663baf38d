"""Which two coders, which demonstration, and whose track the consensus becomes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING

from PySide6.QtCore import QSignalBlocker, Signal
from PySide6.QtWidgets import QGridLayout, QLabel, QLineEdit, QSizePolicy, QWidget

from forcelab.gui import settings
from forcelab.gui.naming import settled_name
from forcelab.gui.review.narrow_list import NarrowList
from forcelab.review.consensus import CONSENSUS
from forcelab.text import tidy_name

if TYPE_CHECKING:
    from forcelab.review.agreement import CoderTracks

__all__ = ["ConsensusChoice"]

#: Where it is remembered who the consensus is by.
NAME = "review/consensus"


class ConsensusChoice(QWidget):
    """Two coders, a demonstration that both labelled, and a name that is remembered.

    Parameters
    ----------
    begin : QWidget
        Stands below: what begins the consensus.
    known : callable
        Gives the coders of the project: where a name is nearly one of theirs, one is asked.

    Signals
    -------
    changed()
        Anything else was chosen.
    """

    changed = Signal()

    def __init__(self, begin: QWidget, known: Callable[[], Iterable[str]]) -> None:
        super().__init__()
        self._known = known
        self._coded: tuple[CoderTracks, ...] = ()
        self._asked = ("", "")
        self.first, self.second, self.demonstration = NarrowList(), NarrowList(), NarrowList()
        self.first.setAccessibleName("First coder")
        self.second.setAccessibleName("Second coder")
        self.demonstration.setAccessibleName("Demonstration")
        for box in (self.first, self.second, self.demonstration):
            box.setMinimumContentsLength(3)
            box.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.first.activated.connect(lambda _: self._offer_demonstrations())
        self.second.activated.connect(lambda _: self._offer_demonstrations())
        self.demonstration.activated.connect(lambda _: self.changed.emit())
        self.author = QLineEdit(settings.text(NAME, CONSENSUS))
        self.author.setPlaceholderText(CONSENSUS)
        self.author.setMinimumWidth(40)
        self.author.setAccessibleName("Whose track the consensus becomes")
        self.author.editingFinished.connect(self._named)
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setSpacing(4)
        grid.addWidget(QLabel("Coders"), 0, 0)
        grid.addWidget(self.first, 0, 1)
        grid.addWidget(self.second, 0, 2)
        grid.addWidget(QLabel("Demonstration"), 1, 0)
        grid.addWidget(self.demonstration, 1, 1, 1, 2)
        grid.addWidget(QLabel("Consensus by"), 2, 0)
        grid.addWidget(self.author, 2, 1, 1, 2)
        grid.addWidget(begin, 3, 0, 1, 3)

    @property
    def coders(self) -> tuple[str, str]:
        """The two coders."""
        return self.first.currentText(), self.second.currentText()

    @property
    def id(self) -> str:
        """The demonstration's; ``""`` where the two have none in common."""
        return self.demonstration.currentData() or ""

    @property
    def name(self) -> str:
        """Who the consensus is by."""
        return tidy_name(self.author.text()) or CONSENSUS

    def offer(self, coded: Sequence[CoderTracks], at_first: str) -> None:
        """Offer demonstrations; the first time the one that is open, if it is among them."""
        self._coded = tuple(coded)
        authors = sorted({a for one in self._coded for a in one.tracks if a != self.name})
        for box, fallback in ((self.first, 0), (self.second, 1)):
            kept = box.currentText()
            box.clear()
            box.addItems(authors)
            index = box.findText(kept) if kept else -1
            box.setCurrentIndex(index if index >= 0 else min(fallback, len(authors) - 1))
        self._offer_demonstrations(self.id or at_first)

    def choose(self, a: str, b: str) -> None:
        """Choose two coders that are offered; the same two once more change nothing."""
        if (a, b) == self._asked:
            return
        self._asked = a, b
        for box, name in ((self.first, a), (self.second, b)):
            box.setCurrentIndex(max(box.findText(name), 0))
        self._offer_demonstrations()

    def _offer_demonstrations(self, kept: str = "") -> None:
        """List the demonstrations that both chosen coders labelled."""
        kept = kept or self.id
        a, b = self.coders
        self.demonstration.clear()
        for one in self._coded:
            if a != b and a in one.tracks and b in one.tracks:
                self.demonstration.addItem(f"{one.task}: {one.name}", one.id)
        self.demonstration.setCurrentIndex(max(self.demonstration.findData(kept), 0))
        self.changed.emit()

    def _named(self) -> None:
        """Make the consensus under another name, and remember it."""
        if self.name == settings.text(NAME, CONSENSUS):
            return
        with QSignalBlocker(self.author):  # the question takes the keyboard from the field
            self.author.setText(settled_name(self, self.name, self._known()))
        if self.name != settings.text(NAME, CONSENSUS):
            settings.put(NAME, self.name)
            self.offer(self._coded, "")
