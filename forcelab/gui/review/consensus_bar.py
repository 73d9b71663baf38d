"""The consensus: two coders' differences one after the other, each decided with one key."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent, QShowEvent
from PySide6.QtWidgets import QApplication, QMenu, QWidget

from forcelab.errors import ForcelabError
from forcelab.gui.arranging import column
from forcelab.gui.document import Document
from forcelab.gui.naming import verbatim
from forcelab.gui.review.coders_pair import sentence
from forcelab.gui.review.coders_places import PlaceRow, PlaceTable
from forcelab.gui.review.consensus_buttons import ConsensusButtons
from forcelab.gui.review.consensus_choice import ConsensusChoice
from forcelab.gui.review.seen import blind_to

if TYPE_CHECKING:
    from forcelab.project import Edit
    from forcelab.review.agreement import CoderTracks
    from forcelab.review.consensus import CoderDifference, Consensus
    from forcelab.review.differences import Interval

__all__ = ["ConsensusBar"]


class ConsensusBar(QWidget):
    """Makes one track of two; every decision is stored at once, as an edit of its author's track.

    The keys on the buttons hold while the keyboard is in here and nowhere else.
    """

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.document = document
        self.consensus: Consensus | None = None
        self.current: CoderDifference | None = None
        self._names: Mapping[str, str] = {}
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAccessibleName("Consensus")
        self.state, self.now = sentence(), sentence(muted=True)
        self.places = PlaceTable("Differences, in order of time")
        self.buttons = ConsensusButtons()
        self.choice = ConsensusChoice(self.buttons.begin, self._coders)
        self._lay_out()
        self._connect()

    def _lay_out(self) -> None:
        """Put choices above, decisions below them, the list at the bottom."""
        self.places.hideColumn(0)  # it is the same one throughout
        parts = self.choice, self.state, self.now, self.buttons, self.places
        column(self, *parts, growing=self.places, margin=6, spacing=6)

    def _connect(self) -> None:
        """Listen to what is pressed, and to the document."""
        buttons, document = self.buttons, self.document
        self.places.wanted.connect(self._place_wanted)
        self.choice.changed.connect(self._read)
        buttons.begun.connect(self._begin)
        buttons.decided.connect(self._decide)
        buttons.taken_back.connect(self._go_back)
        buttons.all_meant.connect(self._mean_all)
        buttons.stepped.connect(self.step)
        buttons.other_asked.connect(self._offer_actions)
        document.tracks_changed.connect(self._track_changed)
        document.author_changed.connect(self._viewer_changed)
        document.listing_changed.connect(self._viewer_changed)

    def _coders(self) -> tuple[str, ...]:
        """The coders of the project; a consensus that was made is one of them."""
        project = self.document.project
        return project.coders() if project else ()

    # What is shown

    @property
    def name(self) -> str:
        """Who the consensus is by."""
        return self.choice.name

    def show_coded(self, coded: Sequence[CoderTracks], names: Mapping[str, str]) -> None:
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
        there = any(info.id == id_ for info in self.document.infos)  # and not of one before
        self.consensus = None
        if project is not None and there and id_ not in blind_to(self.document):
            from forcelab.review.consensus import Consensus

            try:
                self.consensus = Consensus(project, id_, *self.choice.coders, self.name)
            except ForcelabError as error:
                self.document.say(str(error), True)
        self._show()

    def _viewer_changed(self) -> None:
        """Show nothing of what whoever looks codes blind; read what became free to be seen."""
        hidden = self.choice.id in blind_to(self.document)
        if hidden == (self.consensus is not None):
            self._read()

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
        self.buttons.name_coders(self.choice.coders)
        had = QApplication.focusWidget() if self._has_keyboard() else None
        self.buttons.offer(consensus, self.current)
        if had is not None and not had.isEnabled():  # the next field would take the keys as text
            self.setFocus()
        self.state.setText(self._state(len(every), len(waiting)))
        self.now.setText(self._now())
        open_ones = set(waiting)
        rows = [
            PlaceRow(
                one.place(self.choice.id),
                self._what(one),
                one not in open_ones,
            )
            for one in every
        ]
        self.places.put(rows, self._names, (*self.choice.coders, "What"))
        if self.current in every:
            self.places.selectRow(every.index(self.current))

    def _what(self, one: CoderDifference) -> str:
        """What differs, in the words of the table of agreement."""
        if one.edge:
            return "boundary moved"
        both = one.a is not None and one.b is not None
        return "different actions" if both else "only one labelled"

    def _state(self, every: int, waiting: int) -> str:
        """How far the consensus is, in a sentence."""
        if self.consensus is None:
            return "Choose two coders who labelled the same demonstration."
        if not every:
            return "The two agree everywhere; take what both say, and it is done."
        if not self.consensus.begun:
            return f"{every} differences. Take what both say first, then decide these."
        return f"{every - waiting} of {every} differences decided"

    def _now(self) -> str:
        """What is to be decided."""
        one = self.current
        if one is None:
            return ""
        nothing = "unlabelled"
        text = "{0:.3f} to {1:.3f} s: {2} says {3}, {4} says {5}."
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

    def _go_to(self, difference: CoderDifference) -> None:
        """Look at a difference."""
        self.current = difference
        had = self._has_keyboard()
        self.document.examine(difference.place(self.choice.id))
        if had and not self._has_keyboard():  # another demonstration's track, which was opened, has
            self.setFocus()
        self._show()

    def _has_keyboard(self) -> bool:
        """Whether keys that are pressed come here."""
        now = QApplication.focusWidget()
        return now is not None and (now is self or self.isAncestorOf(now))

    def _place_wanted(self, place: Interval) -> None:
        """Look at the difference of a row."""
        every = () if self.consensus is None else self.consensus.differences
        for one in every:
            if one.start == place.start:  # they do not overlap
                self._go_to(one)

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

    def _decide(self, verb: Callable[[Consensus, CoderDifference], Edit | None]) -> None:
        """Decide the current difference, and go to the next that waits."""
        current = self.current
        if current is None:
            return
        if self._carry_out(lambda consensus: verb(consensus, current)) and self.consensus:
            if self.consensus.undecided:
                self.step(1)
            else:
                self.document.say("Every difference is decided.")

    def _mean_all(self, tolerance: float) -> None:
        """Set all edges that are up to so many seconds apart to their means."""
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
            self.document.say("There is nothing to change.")
        else:
            if self.document.id == consensus.demonstration:
                self.document.reread()
            self.document.say(edit.what)
        self._show()
        return edit is not None

    def _offer_actions(self) -> None:
        """Let any action of the task be chosen."""
        menu, other = self.action_menu(), self.buttons.other
        menu.exec(other.mapToGlobal(other.rect().bottomLeft()))
        menu.deleteLater()

    def action_menu(self) -> QMenu:
        """The actions of the task."""
        menu = QMenu(self)
        project, id_ = self.document.project, self.choice.id
        if project is not None and id_:
            for name in project.vocabulary(project.info(id_).task).names:
                action = menu.addAction(verbatim(name))
                action.triggered.connect(partial(self._put, name))
        return menu

    def _put(self, name: str, _checked: bool = False) -> None:
        """Decide for an action."""
        self._decide(lambda consensus, difference: consensus.put(difference, name))

    # Keys

    def keeps(self, event: QKeyEvent) -> bool:
        """Whether a key is one of the buttons', and not the window's."""
        return self._does(event) is not None

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Carry out what the key's button does."""
        do = self._does(event)
        if do is None:
            super().keyPressEvent(event)
        else:
            do()

    def _does(self, event: QKeyEvent) -> Callable[[], object] | None:
        """What a key does; text that is being typed does nothing."""
        return None if self.choice.author.hasFocus() else self.buttons.does(event)
