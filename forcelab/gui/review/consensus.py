"""The consensus of two coders: their differences one after the other, each decided with one key."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial

from PySide6.QtCore import QKeyCombination, QSignalBlocker, Qt, Signal
from PySide6.QtGui import QKeyEvent, QKeySequence, QResizeEvent, QShowEvent
from PySide6.QtWidgets import (
    QApplication,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QMenu,
    QPushButton,
    QSizePolicy,
    QSpinBox,
    QVBoxLayout,
    QWidget,
)

from forcelab.errors import ForcelabError
from forcelab.gui import settings
from forcelab.gui.document import Document
from forcelab.gui.figures.text import NAMES
from forcelab.gui.layout import (
    fill_layout,
    page_layout,
    push_button,
    set_enabled_with_reason,
)
from forcelab.gui.review.agreement_details import IntervalRow, IntervalTable, unfocused_label
from forcelab.gui.review.reviewed_run import blind_demonstrations
from forcelab.gui.shortcuts import key_name
from forcelab.gui.text import escape_ampersands, settle_name
from forcelab.gui.widgets import ElidedComboBox
from forcelab.labels import Interval
from forcelab.project import Edit
from forcelab.review.coder_tracks import CoderTracks
from forcelab.review.consensus import CONSENSUS, Consensus
from forcelab.review.differences import Difference
from forcelab.text import tidy_name

#: Where it is remembered who the consensus is by.
AUTHOR_SETTING = "review/consensus"


class ConsensusChoice(QWidget):
    """Two coders, a demonstration that both labelled, and a name that is remembered.

    `begin` stands below; `known` gives the project's coders: a name that is nearly one of theirs is
    asked about.
    """

    changed = Signal()

    def __init__(self, begin: QWidget, known: Callable[[], Iterable[str]]) -> None:
        super().__init__()
        self._known = known
        self._coded: tuple[CoderTracks, ...] = ()
        self._requested = ("", "")
        self.first, self.second = _narrow_box("First coder"), _narrow_box("Second coder")
        self.demonstration = _narrow_box("Demonstration")
        self.first.activated.connect(lambda _: self._offer_demonstrations())
        self.second.activated.connect(lambda _: self._offer_demonstrations())
        self.demonstration.activated.connect(self.changed)
        self.author = QLineEdit(settings.text(AUTHOR_SETTING, CONSENSUS))
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
        return self.first.currentText(), self.second.currentText()

    @property
    def id(self) -> str:
        """The demonstration's; ``""`` where the two have none in common."""
        return self.demonstration.currentData() or ""

    @property
    def name(self) -> str:
        """The author of the consensus."""
        return tidy_name(self.author.text()) or CONSENSUS

    def offer(self, coded: Sequence[CoderTracks], at_first: str) -> None:
        """Offer demonstrations; the first time the one that is open, if it is among them."""
        self._coded = tuple(coded)
        authors = sorted({a for d in self._coded for a in d.tracks if a != self.name})
        for box, fallback in ((self.first, 0), (self.second, 1)):
            chosen = box.currentText()
            box.clear()
            box.addItems(authors)
            index = box.findText(chosen) if chosen else -1
            box.setCurrentIndex(index if index >= 0 else min(fallback, len(authors) - 1))
        self._offer_demonstrations(self.id or at_first)

    def choose(self, a: str, b: str) -> None:
        """Choose two coders that are offered; the same two once more change nothing."""
        if (a, b) == self._requested:
            return
        self._requested = a, b
        for box, name in ((self.first, a), (self.second, b)):
            box.setCurrentIndex(max(box.findText(name), 0))
        self._offer_demonstrations()

    def _offer_demonstrations(self, chosen: str = "") -> None:
        chosen = chosen or self.id
        a, b = self.coders
        self.demonstration.clear()
        for coded in self._coded:
            if a != b and a in coded.tracks and b in coded.tracks:
                self.demonstration.addItem(f"{coded.task}: {coded.name}", coded.id)
        self.demonstration.setCurrentIndex(max(self.demonstration.findData(chosen), 0))
        self.changed.emit()

    def _named(self) -> None:
        """Make the consensus under another name, and remember it."""
        if self.name == settings.text(AUTHOR_SETTING, CONSENSUS):
            return
        with QSignalBlocker(self.author):  # the question takes the keyboard from the field
            self.author.setText(settle_name(self, self.name, self._known()))
        if self.name != settings.text(AUTHOR_SETTING, CONSENSUS):
            settings.store(AUTHOR_SETTING, self.name)
            self.offer(self._coded, "")


def _narrow_box(name: str) -> ElidedComboBox:
    box = ElidedComboBox()
    box.setAccessibleName(name)
    box.setMinimumContentsLength(3)
    box.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
    return box


#: How many letters wide a button is around "Take NAME": its key and its edges.
BUTTON_CHARACTERS = 8


class KeyedButton(QPushButton):
    """A button that shows its key, which holds while the keyboard is near it."""

    def __init__(self, text: str, key: str, do: Callable[[], object], full_text: str = "") -> None:
        super().__init__()
        self.key = QKeySequence(key)
        self.setMinimumWidth(40)
        self.clicked.connect(do)
        self.write(text, full_text)

    def write(self, text: str, full_text: str = "") -> None:
        """Write another text, which may be cut from a whole one, and the key."""
        key = key_name(self.key.toString()).replace("Shift+", "⇧")
        self.setText(escape_ampersands(f"{text}  [{key}]"))
        self.setAccessibleName(full_text or text)
        self.setToolTip(full_text or text)


class ConsensusButtons(QWidget):
    """What can be decided, and the way through the differences."""

    def __init__(self, bar: ConsensusBar) -> None:
        super().__init__()
        self._coders = ("", "")
        # It stands apart, beside what is chosen; see ConsensusChoice.
        self.begin = KeyedButton("Take what both say", "B", bar.begin)
        self.take_a = KeyedButton("", "1", lambda: bar.decide(lambda c, d: c.take(d, "a")))
        self.take_b = KeyedButton("", "2", lambda: bar.decide(lambda c, d: c.take(d, "b")))
        self.mean = KeyedButton("Mean of both edges", "M", lambda: bar.decide(Consensus.mean))
        self.leave = KeyedButton("Unlabelled", "U", lambda: bar.decide(Consensus.leave))
        self.other = KeyedButton("Other…", "O", bar.offer_actions, "Another action…")
        self.next = KeyedButton("Next", "N", lambda: bar.step(1))
        self.previous = KeyedButton("Previous", "Shift+N", lambda: bar.step(-1))
        self.undo = KeyedButton("Undo", "Ctrl+Z", lambda: bar.go_back(Consensus.undo))
        self.redo = KeyedButton("Redo", "Ctrl+Y", lambda: bar.go_back(Consensus.redo))
        self.tolerance = QSpinBox()
        self.tolerance.setRange(1, 500)
        self.tolerance.setValue(100)
        self.tolerance.setSuffix(" ms")
        self.tolerance.setAccessibleName("How far apart edges may be")
        self.mean_all = push_button(
            "Mean of edges up to",
            lambda: bar.mean_all(self.tolerance.value() / 1000),
            tip="Set edges that are up to this far apart to their mean",
        )
        self.mean_all.setMinimumWidth(40)
        self._lay_out()

    def _lay_out(self) -> None:
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
        together = fill_layout(QHBoxLayout(), (self.mean_all, 1), self.tolerance)
        fill_layout(QVBoxLayout(self), decisions, together, margins=0, spacing=6)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Show as much of the coders' names as has room."""
        super().resizeEvent(event)
        self.name_coders(self._coders)

    def name_coders(self, coders: tuple[str, str]) -> None:
        self._coders = coders
        for button, coder in zip((self.take_a, self.take_b), coders, strict=True):
            full_text = f"Take {coder}"
            room = self.width() // 2 - BUTTON_CHARACTERS * self.fontMetrics().averageCharWidth()
            cut = self.fontMetrics().elidedText(full_text, NAMES, room)
            button.write(cut, full_text)

    def offer(self, consensus: Consensus | None, current: Difference | None) -> None:
        two = choice = differing = edges = undo = redo = ""
        if consensus is None:
            two = "A demonstration that two coders have labelled is needed."
        if consensus is None or not consensus.begun:
            choice = "Begin the consensus first."
        elif current is None:
            choice = "Choose a place where the coders differ first."
        mean = choice
        if not choice and current is not None and current.kind != "boundary":
            mean = "Only where two edges differ is there a mean of them."
        if consensus is None or not consensus.differences:
            differing = "The coders do not differ anywhere here."
        waiting = consensus.undecided if consensus is not None and consensus.begun else ()
        if not any(difference.kind == "boundary" for difference in waiting):
            edges = "No edge that differs is left to decide on."
        if consensus is None or not consensus.can_undo:
            undo = "No decision is left to be undone."
        if consensus is None or not consensus.can_redo:
            redo = "No decision was undone."
        for parts, obstacle in (
            ((self.begin,), two),
            ((self.take_a, self.take_b, self.leave, self.other), choice),
            ((self.mean,), mean),
            ((self.mean_all, self.tolerance), edges),
            ((self.next, self.previous), differing),
            ((self.undo,), undo),
            ((self.redo,), redo),
        ):
            for part in parts:
                set_enabled_with_reason(part, obstacle)

    def with_key(self, event: QKeyEvent) -> KeyedButton | None:
        """The button of a key; none while a number is being typed."""
        if self.tolerance.hasFocus():
            return None
        keypad = Qt.KeyboardModifier.KeypadModifier
        pressed = QKeyCombination(event.modifiers() & ~keypad, Qt.Key(event.key()))
        buttons = (self.begin, *self.findChildren(KeyedButton))
        return next((button for button in buttons if button.key == QKeySequence(pressed)), None)


class ConsensusBar(QWidget):
    """Makes one track of two; every decision is stored at once, as an edit of its author's track.

    The keys on the buttons hold while the keyboard is in here and nowhere else.
    """

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.document = document
        self.consensus: Consensus | None = None
        self.current: Difference | None = None
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAccessibleName("Consensus")
        self.state, self.now = unfocused_label(), unfocused_label(muted=True)
        self.places = IntervalTable("Differences, in order of time")
        self.places.hideColumn(0)  # the demonstration is the same one throughout
        self.buttons = ConsensusButtons(self)
        self.choice = ConsensusChoice(self.buttons.begin, self._coders)
        parts = self.choice, self.state, self.now, self.buttons, self.places
        page_layout(self, *parts, growing=self.places, margin=6, spacing=6)
        self.places.interval_chosen.connect(self._show_row)
        self.choice.changed.connect(self._read)
        document.tracks_changed.connect(self._track_changed)
        document.author_changed.connect(self._viewer_changed)
        document.listing_changed.connect(self._viewer_changed)

    def _coders(self) -> tuple[str, ...]:
        """The coders of the project; a consensus that was made is one of them."""
        project = self.document.project
        return project.coding.coders() if project else ()

    # What is shown

    @property
    def name(self) -> str:
        """The author of the consensus."""
        return self.choice.name

    def show_coded(self, coded: Sequence[CoderTracks]) -> None:
        """Offer demonstrations that two coders labelled; models are not among them."""
        self.choice.offer(coded, self.document.id)

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._read()

    def _read(self) -> None:
        if not self.isVisible():
            return
        project, id_ = self.document.project, self.choice.id
        listed = any(info.id == id_ for info in self.document.infos)  # and not of one before
        self.consensus = None
        if project is not None and listed and id_ not in blind_demonstrations(self.document):
            try:
                self.consensus = Consensus(project, id_, *self.choice.coders, self.name)
            except ForcelabError as error:
                self.document.show_message(str(error), True)
        self._show()

    def _viewer_changed(self) -> None:
        """Show nothing of what the coder codes blind; read what became visible."""
        hidden = self.choice.id in blind_demonstrations(self.document)
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
                self.document.show_message(str(error), True)
            self._show()

    def _show(self) -> None:
        consensus = self.consensus
        differences = () if consensus is None else consensus.differences
        waiting = () if consensus is None else consensus.undecided
        if self.current not in differences:
            self.current = waiting[0] if waiting else None
        self.buttons.name_coders(self.choice.coders)
        focused = QApplication.focusWidget() if self._has_keyboard() else None
        self.buttons.offer(consensus, self.current)
        if focused is not None and not focused.isEnabled():
            self.setFocus()  # or the next field takes the keys as text
        self.state.setText(self._state(len(differences), len(waiting)))
        self.now.setText(self._current_item())
        undecided = set(waiting)
        rows = [IntervalRow(d, self._what(d), d not in undecided) for d in differences]
        self.places.put(rows, {}, (*self.choice.coders, "What"))
        if self.current in differences:
            self.places.selectRow(differences.index(self.current))

    def _what(self, difference: Difference) -> str:
        """What differs, in the words of the table of agreement."""
        texts = {"boundary": "boundary moved", "action": "different actions"}
        return texts.get(difference.kind, "only one labelled")

    def _state(self, total: int, waiting: int) -> str:
        if self.consensus is None:
            return "Choose two coders who labelled the same demonstration."
        if not total:
            return "The two agree everywhere; take what both say, and it is done."
        if not self.consensus.begun:
            return f"{total} differences. Take what both say first, then decide these."
        return f"{total - waiting} of {total} differences decided"

    def _current_item(self) -> str:
        item = self.current
        if item is None:
            return ""
        first, second = self.choice.coders
        return (
            f"{item.start:.3f} to {item.end:.3f} s: {first} says {item.human or 'unlabelled'}, "
            f"{second} says {item.predicted or 'unlabelled'}."
        )

    # What is done

    def step(self, direction: int) -> None:
        """Go to the next difference that waits, or to the next one at all where none does."""
        if self.consensus is None or not self.consensus.differences:
            return
        differences = self.consensus.differences
        pool = self.consensus.undecided or differences
        start = self.current.start if self.current is not None else differences[0].start - 1.0
        if direction > 0:
            difference = next((d for d in pool if d.start > start), pool[0])
        else:
            difference = next((d for d in reversed(pool) if d.start < start), pool[-1])
        self._go_to(difference)

    def _go_to(self, difference: Difference) -> None:
        self.current = difference
        had_keyboard = self._has_keyboard()
        self.document.review.examine(difference)
        if had_keyboard and not self._has_keyboard():
            self.setFocus()  # a demonstration that was opened has given it to the track
        self._show()

    def _has_keyboard(self) -> bool:
        now = QApplication.focusWidget()
        return now is not None and (now is self or self.isAncestorOf(now))

    def _show_row(self, place: Interval) -> None:
        differences = () if self.consensus is None else self.consensus.differences
        for difference in differences:
            if difference.start == place.start:  # they do not overlap
                self._go_to(difference)

    def begin(self) -> None:
        """Take what both say, and go to the first difference."""
        done = self._carry_out(Consensus.begin)
        if done and self.consensus is not None and self.consensus.undecided:
            self._go_to(self.consensus.undecided[0])

    def go_back(self, verb: Callable[[Consensus], Edit | None]) -> None:
        """Undo or redo, and look at the difference that waits again."""
        before = () if self.consensus is None else self.consensus.undecided
        if self._carry_out(verb) and self.consensus is not None:
            reopened = next((d for d in self.consensus.undecided if d not in before), None)
            if reopened is not None:
                self._go_to(reopened)

    def decide(self, verb: Callable[[Consensus, Difference], Edit | None]) -> None:
        """Decide the current difference, and go to the next that waits."""
        current = self.current
        if current is None:
            return
        if self._carry_out(lambda consensus: verb(consensus, current)) and self.consensus:
            if self.consensus.undecided:
                self.step(1)
            else:
                self.document.show_message("Every difference is decided.")

    def mean_all(self, tolerance: float) -> None:
        """Set all edges that are up to so many seconds apart to their means."""
        self._carry_out(lambda consensus: consensus.mean_all(tolerance))

    def _carry_out(self, verb: Callable[[Consensus], Edit | None]) -> bool:
        """Edit the consensus; gives whether that was possible."""
        consensus, edit = self.consensus, None
        if consensus is None:
            return False
        try:
            edit = verb(consensus)
        except ForcelabError as error:
            self.document.refuse(str(error))
            self._read()
            return False
        if edit is None:
            self.document.show_message("There is nothing to change.")
        else:
            if self.document.id == consensus.demonstration:
                self.document.reread()
            self.document.show_message(edit.what)
        self._show()
        return edit is not None

    def offer_actions(self) -> None:
        """Let any action of the task be chosen."""
        menu, other = self.action_menu(), self.buttons.other
        menu.exec(other.mapToGlobal(other.rect().bottomLeft()))
        menu.deleteLater()

    def action_menu(self) -> QMenu:
        menu = QMenu(self)
        project, id_ = self.document.project, self.choice.id
        if project is not None and id_:
            for name in project.actions.vocabulary(project.demonstrations.info(id_).task).names:
                put = partial(self.decide, partial(Consensus.put, action=name))
                menu.addAction(escape_ampersands(name)).triggered.connect(put)
        return menu

    # Keys

    def keeps(self, event: QKeyEvent) -> bool:
        """Whether a key is one of the buttons', and not the window's."""
        return self._with_key(event) is not None

    def keyPressEvent(self, event: QKeyEvent) -> None:
        button = self._with_key(event)
        if button is None:
            super().keyPressEvent(event)
        else:
            button.click()

    def _with_key(self, event: QKeyEvent) -> KeyedButton | None:
        """The button of a key; none while text is being typed."""
        return None if self.choice.author.hasFocus() else self.buttons.with_key(event)
