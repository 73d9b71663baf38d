"""The consensus: two coders' differences one after the other, each decided with one key."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QKeyEvent, QShowEvent
from PySide6.QtWidgets import (
    QGridLayout,
    QHBoxLayout,
    QMenu,
    QPushButton,
    QSpinBox,
    QVBoxLayout,
    QWidget,
)

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.review.coders_pair import sentence
from forcelab.gui.review.coders_places import PlaceRow, PlaceTable
from forcelab.gui.review.consensus_choice import ConsensusChoice
from forcelab.gui.review.consensus_keys import CTRL, SHIFT, KeyedButtons

if TYPE_CHECKING:
    from forcelab.project import Edit
    from forcelab.review.coded import Coded
    from forcelab.review.consensus import Consensus, Difference

__all__ = ["ConsensusBar"]

#: How many letters of "Take NAME" are shown at most.
LONGEST = 20


class ConsensusBar(QWidget):
    """Makes one track of two; every decision is stored at once, as an edit of its author's track.

    The keys on the buttons hold while the keyboard is in here and nowhere else.

    Parameters
    ----------
    document : Document
    parent : QWidget, optional
    """

    def __init__(self, document: Document, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.document = document
        self.consensus: Consensus | None = None
        self.current: Difference | None = None
        self._names: Mapping[str, str] = {}
        self._keys = KeyedButtons()
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAccessibleName(self.tr("Consensus"))
        self.state, self.now = sentence(), sentence(muted=True)
        self.places = PlaceTable(self.tr("Differences, in order of time"))
        self.places.wanted.connect(self._row_wanted)
        self._make_verbs()
        self.choice = ConsensusChoice(self.begin)
        self.choice.changed.connect(self._read)
        self._lay_out()
        document.tracks_changed.connect(self._track_changed)

    # Building

    def _make_verbs(self) -> None:
        """Make the buttons."""
        verb, key = self._keys.add, Qt.Key
        self.begin = verb(self.tr("Take what both say"), key.Key_B, self._begin)
        self.take_a = verb("", key.Key_1, lambda: self._decide(lambda c, d: c.take(d, "a")))
        self.take_b = verb("", key.Key_2, lambda: self._decide(lambda c, d: c.take(d, "b")))
        self.mean = verb(
            self.tr("Mean of both edges"),
            key.Key_M,
            lambda: self._decide(lambda c, d: c.mean(d)),
        )
        self.leave = verb(
            self.tr("Unlabelled"), key.Key_U, lambda: self._decide(lambda c, d: c.leave(d))
        )
        self.other = verb(self.tr("Another action…"), key.Key_O, self._offer_actions)
        self.next = verb(self.tr("Next"), key.Key_N, lambda: self.step(1))
        self.previous = verb(self.tr("Previous"), key.Key_N, lambda: self.step(-1), SHIFT)
        self.undo = verb(self.tr("Undo"), key.Key_Z, lambda: self._go_back(_undo), CTRL)
        self.redo = verb(self.tr("Redo"), key.Key_Y, lambda: self._go_back(_redo), CTRL)
        self.mean_all = QPushButton(self.tr("Edges up to this far apart: mean"))
        self.mean_all.setMinimumWidth(40)
        self.mean_all.clicked.connect(lambda _=False: self._mean_all())
        self.tolerance = QSpinBox()
        self.tolerance.setRange(1, 500)
        self.tolerance.setValue(100)
        self.tolerance.setSuffix(" ms")
        self.tolerance.setAccessibleName(self.tr("How far apart edges may be"))

    def _lay_out(self) -> None:
        """Put choices above, decisions below them, the list at the bottom."""
        decisions = QGridLayout()
        decisions.addWidget(self.take_a, 0, 0)
        decisions.addWidget(self.take_b, 0, 1)
        decisions.addWidget(self.mean, 1, 0)
        decisions.addWidget(self.leave, 1, 1)
        decisions.addWidget(self.other, 2, 0, 1, 2)
        decisions.addWidget(self.previous, 3, 0)
        decisions.addWidget(self.next, 3, 1)
        decisions.addWidget(self.undo, 4, 0)
        decisions.addWidget(self.redo, 4, 1)
        for half in (0, 1):
            decisions.setColumnStretch(half, 1)
        together = QHBoxLayout()
        together.addWidget(self.mean_all, 1)
        together.addWidget(self.tolerance)
        self.places.hideColumn(0)  # it is the same one throughout
        decisions.setSpacing(4)
        column = QVBoxLayout(self)
        column.setContentsMargins(6, 6, 6, 6)
        column.setSpacing(6)
        column.addWidget(self.choice)
        column.addWidget(self.state)
        column.addWidget(self.now)
        column.addLayout(decisions)
        column.addLayout(together)
        column.addWidget(self.places, 1)

    # What is shown

    @property
    def name(self) -> str:
        """Who the consensus is by."""
        return self.choice.name

    def show_coded(self, coded: Sequence[Coded], names: Mapping[str, str]) -> None:
        """Offer demonstrations that two coders labelled; models are not among them."""
        self._names = names
        self.choice.offer(coded, self.document.id)

    def showEvent(self, event: QShowEvent) -> None:
        """Read what there is by now."""
        super().showEvent(event)
        self._read()

    def _read(self) -> None:
        """Read the three tracks of what is chosen."""
        if not self.isVisible():
            return
        project, id_ = self.document.project, self.choice.id
        self.consensus = None
        if project is not None and id_ and not project.is_blind(id_, self.document.author):
            from forcelab.review.consensus import Consensus

            try:
                self.consensus = Consensus(project, id_, *self.choice.coders, self.name)
            except ForcelabError as error:
                self.document.say(str(error), True)
        self._show()

    def _track_changed(self) -> None:
        """Follow an edit of one of the three tracks that was made elsewhere."""
        consensus = self.consensus
        if (
            consensus is not None
            and self.isVisible()
            and self.document.project is consensus.project
            and self.document.id == consensus.demonstration
            and self.document.author in (consensus.a, consensus.b, consensus.author)
        ):
            try:
                consensus.refresh()
            except ForcelabError as error:
                self.document.say(str(error), True)
            self._show()

    def _show(self) -> None:
        """Say how far it is, and list the differences."""
        consensus = self.consensus
        every = () if consensus is None else consensus.differences
        waiting = () if consensus is None else consensus.undecided
        if self.current not in every:
            self.current = waiting[0] if waiting else None
        for button, coder in zip((self.take_a, self.take_b), self.choice.coders, strict=True):
            whole = self.tr("Take {0}").format(coder)
            room = LONGEST * self.fontMetrics().averageCharWidth()
            cut = self.fontMetrics().elidedText(whole, Qt.TextElideMode.ElideMiddle, room)
            self._keys.name(button, cut, whole)
        self.state.setText(self._state(len(every), len(waiting)))
        self.now.setText(self._now())
        begun = consensus is not None and consensus.begun
        chosen = begun and self.current is not None
        for button in (self.take_a, self.take_b, self.leave, self.other):
            button.setEnabled(chosen)
        self.mean.setEnabled(chosen and self.current is not None and self.current.edge)
        self.mean_all.setEnabled(begun and any(d.edge for d in waiting))
        for button in (self.next, self.previous):
            button.setEnabled(bool(every))
        self.begin.setEnabled(consensus is not None)
        for button in (self.undo, self.redo):
            button.setEnabled(consensus is not None)
        open_ones = set(waiting)
        rows = [
            PlaceRow(
                one.place(self.choice.id),
                self.tr("boundary") if one.edge else self.tr("action"),
                one not in open_ones,
            )
            for one in every
        ]
        self.places.put(rows, self._names, (*self.choice.coders, self.tr("What")))
        if self.current in every:
            self.places.selectRow(every.index(self.current))

    def _state(self, every: int, waiting: int) -> str:
        """How far the consensus is, in a sentence."""
        if self.consensus is None:
            return self.tr("Choose two coders who labelled the same demonstration.")
        if not every:
            return self.tr("The two agree everywhere; take what both say, and it is done.")
        if not self.consensus.begun:
            text = self.tr("{0} differences. Take what both say first, then decide these.")
            return text.format(every)
        return self.tr("{0} of {1} differences decided").format(every - waiting, every)

    def _now(self) -> str:
        """What is to be decided."""
        one = self.current
        if one is None:
            return ""
        nothing = self.tr("unlabelled")
        text = self.tr("{0:.3f} to {1:.3f} s: {2} says {3}, {4} says {5}.")
        names = self.choice.coders
        return text.format(
            one.start, one.end, names[0], one.a or nothing, names[1], one.b or nothing
        )

    # What is done

    def step(self, direction: int) -> None:
        """Go to the next difference that waits, or to the next one at all where none does."""
        if self.consensus is None or not self.consensus.differences:
            return
        every = self.consensus.differences
        pool = self.consensus.undecided or every
        start = self.current.start if self.current is not None else every[0].start - 1.0
        if direction > 0:
            found = next((d for d in pool if d.start > start), pool[0])
        else:
            found = next((d for d in reversed(pool) if d.start < start), pool[-1])
        self._go_to(found)

    def _go_to(self, difference: Difference) -> None:
        """Look at a difference."""
        self.current = difference
        self.document.examine(difference.place(self.choice.id))
        self._show()

    def _row_wanted(self, row: int) -> None:
        """Look at the difference of a row."""
        if self.consensus is not None and row < len(self.consensus.differences):
            self._go_to(self.consensus.differences[row])

    def _begin(self) -> None:
        """Take what both say, and go to the first difference."""
        done = self._carry_out(lambda consensus: consensus.begin())
        if done and self.consensus is not None and self.consensus.undecided:
            self._go_to(self.consensus.undecided[0])

    def _go_back(self, verb: Callable[[Consensus], Edit | None]) -> None:
        """Undo or redo, and look at the difference that waits again."""
        before = () if self.consensus is None else self.consensus.undecided
        if self._carry_out(verb) and self.consensus is not None:
            again = [one for one in self.consensus.undecided if one not in before]
            if again:
                self._go_to(again[0])

    def _decide(self, verb: Callable[[Consensus, Difference], Edit | None]) -> None:
        """Decide the current difference, and go to the next that waits."""
        current = self.current
        if current is None:
            return
        if self._carry_out(lambda consensus: verb(consensus, current)) and self.consensus:
            if self.consensus.undecided:
                self.step(1)
            else:
                self.document.say(self.tr("Every difference is decided."))

    def _mean_all(self) -> None:
        """Set all close edges to their means."""
        tolerance = self.tolerance.value() / 1000
        self._carry_out(lambda consensus: consensus.mean_all(tolerance))

    def _carry_out(self, verb: Callable[[Consensus], Edit | None]) -> bool:
        """Let the consensus be edited; gives whether it was."""
        consensus, edit = self.consensus, None
        if consensus is None:
            return False
        try:
            edit = verb(consensus)
        except ForcelabError as error:
            self.document.say(str(error), True)
            self._read()
            return False
        if edit is None:
            self.document.say(self.tr("There is nothing to change."))
        else:
            if self.document.id == consensus.demonstration:
                self.document.reread()
            self.document.say(edit.what)
        self._show()
        return edit is not None

    def _offer_actions(self) -> None:
        """Let any action of the task be chosen."""
        menu = self.action_menu()
        menu.exec(self.other.mapToGlobal(self.other.rect().bottomLeft()))
        menu.deleteLater()

    def action_menu(self) -> QMenu:
        """The actions of the task."""
        menu = QMenu(self)
        project, id_ = self.document.project, self.choice.id
        if project is not None and id_:
            for name in project.vocabulary(project.info(id_).task).names:
                action = menu.addAction(name.replace("&", "&&"))
                action.triggered.connect(partial(self._put, name))
        return menu

    def _put(self, name: str, _checked: bool = False) -> None:
        """Decide for an action."""
        self._decide(lambda consensus, difference: consensus.put(difference, name))

    # Keys

    def event(self, event: QEvent) -> bool:
        """Keep the keys of the buttons from the window's commands."""
        if (
            event.type() == QEvent.Type.ShortcutOverride
            and isinstance(event, QKeyEvent)
            and self._does(event) is not None
        ):
            event.accept()
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Carry out what the key's button does."""
        do = self._does(event)
        if do is None:
            super().keyPressEvent(event)
        else:
            do()

    def _does(self, event: QKeyEvent) -> Callable[[], object] | None:
        """What a key does; text that is being typed does nothing."""
        typing = self.choice.author.hasFocus() or self.tolerance.hasFocus()
        return None if typing else self._keys.does(event)


def _undo(consensus: Consensus) -> Edit | None:
    """Take back the latest decision."""
    return consensus.undo()


def _redo(consensus: Consensus) -> Edit | None:
    """Take back the latest undo."""
    return consensus.redo()
