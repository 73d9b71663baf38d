"""What a consensus is decided with: buttons, the keys on them, and when they can be pressed."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeyEvent, QResizeEvent
from PySide6.QtWidgets import (
    QGridLayout,
    QHBoxLayout,
    QPushButton,
    QSpinBox,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui.arranging import allow
from forcelab.gui.figures.text import NAMES
from forcelab.gui.naming import verbatim

if TYPE_CHECKING:
    from forcelab.review.consensus import CoderDifference, Consensus

__all__ = ["ConsensusButtons"]

#: How many letters wide a button is around "Take NAME": its key and its edges.
AROUND = 8
NONE = Qt.KeyboardModifier.NoModifier
CTRL = Qt.KeyboardModifier.ControlModifier
SHIFT = Qt.KeyboardModifier.ShiftModifier


class _Verb(NamedTuple):
    """What a button and its key do."""

    button: QPushButton
    key: Qt.Key
    modifiers: Qt.KeyboardModifier
    do: Callable[[], object]


class _KeyedButtons:
    """Buttons that show their key; the keys hold while the keyboard is near them."""

    def __init__(self) -> None:
        self._verbs: list[_Verb] = []

    def add(
        self,
        text: str,
        key: Qt.Key,
        do: Callable[[], object],
        modifiers: Qt.KeyboardModifier = NONE,
    ) -> QPushButton:
        """A new button with a key, a letter or a digit."""
        button = QPushButton()
        button.setMinimumWidth(40)
        button.clicked.connect(lambda _=False: do())
        self._verbs.append(_Verb(button, key, modifiers, do))
        self.name(button, text)
        return button

    def name(self, button: QPushButton, text: str, whole: str = "") -> None:
        """Write a button's text, which may be cut from a whole one, and its key on it."""
        verb = next(verb for verb in self._verbs if verb.button is button)
        held = {SHIFT: "⇧", CTRL: "Ctrl+"}.get(verb.modifiers, "")
        button.setText(verbatim(f"{text}  [{held}{chr(verb.key)}]"))
        button.setAccessibleName(whole or text)
        button.setToolTip(whole or text)

    def does(self, event: QKeyEvent) -> Callable[[], object] | None:
        """What a key does: nothing where its button cannot be pressed, None where it is no key."""
        modifiers = event.modifiers() & ~Qt.KeyboardModifier.KeypadModifier
        pressed = (Qt.Key(event.key()), modifiers)
        verb = next((v for v in self._verbs if (v.key, v.modifiers) == pressed), None)
        if verb is None:
            return None
        return verb.do if verb.button.isEnabled() else lambda: None


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

    def __init__(self) -> None:
        super().__init__()
        self._coders = ("", "")
        self._keys = _KeyedButtons()
        verb, key = self._keys.add, Qt.Key
        # It stands apart, beside what is chosen; see ConsensusChoice.
        self.begin = verb("Take what both say", key.Key_B, self.begun.emit)
        self.take_a = verb("", key.Key_1, lambda: self.decided.emit(lambda c, d: c.take(d, "a")))
        self.take_b = verb("", key.Key_2, lambda: self.decided.emit(lambda c, d: c.take(d, "b")))
        self.mean = verb(
            "Mean of both edges",
            key.Key_M,
            lambda: self.decided.emit(lambda c, d: c.mean(d)),
        )
        self.leave = verb(
            "Unlabelled", key.Key_U, lambda: self.decided.emit(lambda c, d: c.leave(d))
        )
        self.other = verb("Other…", key.Key_O, self.other_asked.emit)
        self._keys.name(self.other, "Other…", "Another action…")
        self.next = verb("Next", key.Key_N, lambda: self.stepped.emit(1))
        self.previous = verb("Previous", key.Key_N, lambda: self.stepped.emit(-1), SHIFT)
        self.undo = verb("Undo", key.Key_Z, lambda: self.taken_back.emit(lambda c: c.undo()), CTRL)
        self.redo = verb("Redo", key.Key_Y, lambda: self.taken_back.emit(lambda c: c.redo()), CTRL)
        self.tolerance = QSpinBox()
        self.tolerance.setRange(1, 500)
        self.tolerance.setValue(100)
        self.tolerance.setSuffix(" ms")
        self.tolerance.setAccessibleName("How far apart edges may be")
        self.mean_all = QPushButton("Mean of edges up to")
        self.mean_all.setToolTip("Set edges that are up to this far apart to their mean")
        self.mean_all.setMinimumWidth(40)
        self.mean_all.clicked.connect(lambda: self.all_meant.emit(self.tolerance.value() / 1000))
        self._lay_out()

    def _lay_out(self) -> None:
        """Decisions, steps and what can be taken back; all edges at once below them."""
        decisions = QGridLayout()
        decisions.setSpacing(4)
        decisions.addWidget(self.mean, 1, 0, 1, 2)
        for row, pair in {
            0: (self.take_a, self.take_b),
            2: (self.leave, self.other),
            3: (self.previous, self.next),
            4: (self.undo, self.redo),
        }.items():
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

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Show as much of the coders' names as has room."""
        super().resizeEvent(event)
        self.name_coders(self._coders)

    def name_coders(self, coders: tuple[str, str]) -> None:
        """Print the coders' names on the buttons that take theirs."""
        self._coders = coders
        for button, coder in zip((self.take_a, self.take_b), coders, strict=True):
            whole = f"Take {coder}"
            room = self.width() // 2 - AROUND * self.fontMetrics().averageCharWidth()
            cut = self.fontMetrics().elidedText(whole, NAMES, room)
            self._keys.name(button, cut, whole)

    def offer(self, consensus: Consensus | None, current: CoderDifference | None) -> None:
        """Let what can be done be pressed."""
        begun = consensus is not None and consensus.begun
        chosen = begun and current is not None
        for button in (self.take_a, self.take_b, self.leave, self.other):
            allow(button, "" if chosen else self._first_choose(begun))
        edge = chosen and current is not None and current.edge
        only = "Only where two edges differ is there a mean of them."
        allow(self.mean, "" if edge else only if chosen else self._first_choose(begun))
        waiting = () if consensus is None else consensus.undecided
        for part in (self.mean_all, self.tolerance):
            left = begun and any(d.edge for d in waiting)
            allow(part, "" if left else "No edge that differs is left to decide on.")
        for button in (self.next, self.previous):
            differing = consensus is not None and bool(consensus.differences)
            allow(button, "" if differing else "The coders do not differ anywhere here.")
        two = "A demonstration that two coders have labelled is needed."
        allow(self.begin, two if consensus is None else "")
        self.undo.setEnabled(consensus is not None and consensus.can_undo)
        self.redo.setEnabled(consensus is not None and consensus.can_redo)

    def _first_choose(self, begun: bool) -> str:
        """What has to be done before a difference can be decided on."""
        if begun:
            return "Choose a place where the coders differ first."
        return "Begin the consensus first."

    def does(self, event: QKeyEvent) -> Callable[[], object] | None:
        """What a key does; a number that is being typed does nothing."""
        return None if self.tolerance.hasFocus() else self._keys.does(event)
