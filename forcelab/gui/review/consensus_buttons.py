"""What a consensus is decided with: buttons, the keys on them, and when they can be pressed."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import (
    QGridLayout,
    QHBoxLayout,
    QPushButton,
    QSpinBox,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui.review.consensus_keys import CTRL, SHIFT, KeyedButtons

if TYPE_CHECKING:
    from forcelab.project import Edit
    from forcelab.review.consensus import Consensus, Difference

__all__ = ["ConsensusButtons"]

#: How many letters of "Take NAME" are shown at most.
LONGEST = 20


class ConsensusButtons(QWidget):
    """The buttons; what they ask for is a verb of the consensus.

    Signals
    -------
    begun()
        What both say is wanted.
    decided(callable)
        ``verb(consensus, difference)`` decides the current difference.
    taken_back(callable)
        ``verb(consensus)`` undoes or redoes.
    all_meant(float)
        Edges up to so many seconds apart are to be set to their means.
    stepped(int)
        The next difference is wanted, or with -1 the one before.
    other_asked()
        Another action is to be chosen.
    """

    begun = Signal()
    decided = Signal(object)
    taken_back = Signal(object)
    all_meant = Signal(float)
    stepped = Signal(int)
    other_asked = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._keys = KeyedButtons()
        verb, key = self._keys.add, Qt.Key
        # It stands apart, beside what is chosen; see ConsensusChoice.
        self.begin = verb(self.tr("Take what both say"), key.Key_B, self.begun.emit)
        self.take_a = verb("", key.Key_1, lambda: self.decided.emit(_take_a))
        self.take_b = verb("", key.Key_2, lambda: self.decided.emit(_take_b))
        self.mean = verb(self.tr("Mean of both edges"), key.Key_M, lambda: self.decided.emit(_mean))
        self.leave = verb(self.tr("Unlabelled"), key.Key_U, lambda: self.decided.emit(_leave))
        self.other = verb(self.tr("Another action…"), key.Key_O, self.other_asked.emit)
        self.next = verb(self.tr("Next"), key.Key_N, lambda: self.stepped.emit(1))
        self.previous = verb(self.tr("Previous"), key.Key_N, lambda: self.stepped.emit(-1), SHIFT)
        self.undo = verb(self.tr("Undo"), key.Key_Z, lambda: self.taken_back.emit(_undo), CTRL)
        self.redo = verb(self.tr("Redo"), key.Key_Y, lambda: self.taken_back.emit(_redo), CTRL)
        self.tolerance = QSpinBox()
        self.tolerance.setRange(1, 500)
        self.tolerance.setValue(100)
        self.tolerance.setSuffix(" ms")
        self.tolerance.setAccessibleName(self.tr("How far apart edges may be"))
        self.mean_all = QPushButton(self.tr("Edges up to this far apart: mean"))
        self.mean_all.setMinimumWidth(40)
        self.mean_all.clicked.connect(lambda: self.all_meant.emit(self.tolerance.value() / 1000))
        self._lay_out()

    def _lay_out(self) -> None:
        """Decisions, steps and what can be taken back; all edges at once below them."""
        decisions = QGridLayout()
        decisions.setSpacing(4)
        for row, pair in enumerate(((self.take_a, self.take_b), (self.mean, self.leave))):
            decisions.addWidget(pair[0], row, 0)
            decisions.addWidget(pair[1], row, 1)
        decisions.addWidget(self.other, 2, 0, 1, 2)
        for row, pair in enumerate(((self.previous, self.next), (self.undo, self.redo)), 3):
            decisions.addWidget(pair[0], row, 0)
            decisions.addWidget(pair[1], row, 1)
        for half in (0, 1):
            decisions.setColumnStretch(half, 1)
        together = QHBoxLayout()
        together.addWidget(self.mean_all, 1)
        together.addWidget(self.tolerance)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(6)
        column.addLayout(decisions)
        column.addLayout(together)

    def name_coders(self, coders: tuple[str, str]) -> None:
        """Print the coders' names on the buttons that take theirs."""
        for button, coder in zip((self.take_a, self.take_b), coders, strict=True):
            whole = self.tr("Take {0}").format(coder)
            room = LONGEST * self.fontMetrics().averageCharWidth()
            cut = self.fontMetrics().elidedText(whole, Qt.TextElideMode.ElideMiddle, room)
            self._keys.name(button, cut, whole)

    def offer(self, consensus: Consensus | None, current: Difference | None) -> None:
        """Let what can be done be pressed."""
        begun = consensus is not None and consensus.begun
        chosen = begun and current is not None
        for button in (self.take_a, self.take_b, self.leave, self.other):
            button.setEnabled(chosen)
        self.mean.setEnabled(chosen and current is not None and current.edge)
        waiting = () if consensus is None else consensus.undecided
        self.mean_all.setEnabled(begun and any(d.edge for d in waiting))
        for button in (self.next, self.previous):
            button.setEnabled(consensus is not None and bool(consensus.differences))
        for button in (self.begin, self.undo, self.redo):
            button.setEnabled(consensus is not None)

    def does(self, event: QKeyEvent) -> Callable[[], object] | None:
        """What a key does; a number that is being typed does nothing."""
        return None if self.tolerance.hasFocus() else self._keys.does(event)


def _take_a(consensus: Consensus, difference: Difference) -> Edit | None:
    """Decide as the first coder did."""
    return consensus.take(difference, "a")


def _take_b(consensus: Consensus, difference: Difference) -> Edit | None:
    """Decide as the second coder did."""
    return consensus.take(difference, "b")


def _mean(consensus: Consensus, difference: Difference) -> Edit | None:
    """Set an edge midway."""
    return consensus.mean(difference)


def _leave(consensus: Consensus, difference: Difference) -> Edit | None:
    """Leave it unlabelled."""
    return consensus.leave(difference)


def _undo(consensus: Consensus) -> Edit | None:
    """Take back the latest decision."""
    return consensus.undo()


def _redo(consensus: Consensus) -> Edit | None:
    """Take back the latest undo."""
    return consensus.redo()
