"""The vocabulary beside the tracks: every action with its key, its look and what it has so far."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QModelIndex, Qt, QTimer
from PySide6.QtGui import QKeyEvent, QShowEvent
from PySide6.QtWidgets import QApplication, QCompleter, QHBoxLayout, QLineEdit, QMenu, QToolButton

from forcelab.errors import ForcelabError, InputError
from forcelab.gui.arranging import allow, placeholder
from forcelab.gui.document import Document
from forcelab.gui.icons import icon
from forcelab.gui.label.renaming import rename
from forcelab.gui.label.segment_verbs import fill_range
from forcelab.gui.label.side_lists import SideList
from forcelab.gui.label.vocabulary_dialogs import KeyDialog, ask_name, colour_menu
from forcelab.gui.label.vocabulary_model import VocabularyModel, entries
from forcelab.gui.label.vocabulary_rows import ActionRows
from forcelab.gui.label.vocabulary_suggestions import Suggestions
from forcelab.gui.theme import themes
from forcelab.vocabulary import Vocabulary

__all__ = ["VocabularyView"]

#: Counting waits until nothing was painted for so many ms: strokes come first.
PAUSE = 80


class _Entry(QLineEdit):
    """The name of an action to add; Escape empties it and leaves it."""

    def keeps(self, event: QKeyEvent) -> bool:
        """Escape is for the line; in the window it means something else."""
        return event.key() == Qt.Key.Key_Escape

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Escape; everything else edits."""
        if self.keeps(event):
            self.clear()
            self.clearFocus()  # where keys are text, the next one would not paint
        else:
            super().keyPressEvent(event)


class VocabularyView(SideList):
    """The actions of the open demonstration's task.

    Clicking an action (or Enter on it) makes it the brush, and once more puts the brush down; while
    a range is marked it fills the range instead.
    """

    def __init__(self, document: Document) -> None:
        super().__init__(document)
        self.setAccessibleName("Actions")
        self.model = VocabularyModel(document, self)
        self.list = ActionRows(self.model, self.menu)
        self.list.clicked.connect(self._clicked)
        self.list.opened.connect(self._clicked)
        self.entry = _Entry(placeholderText="Add an action", clearButtonEnabled=True)
        self.entry.setAccessibleName("Name of an action to add")
        self.entry.returnPressed.connect(self._add_typed)
        completer = QCompleter(list(entries()), self)
        completer.setCaseSensitivity(Qt.CaseSensitivity.CaseInsensitive)
        self.entry.setCompleter(completer)
        self.plus = add = QToolButton()
        add.setIcon(icon("plus"))
        add.setToolTip("Add the action; it gets a free colour and a free key")
        add.setAccessibleName("Add action")
        add.clicked.connect(self._add_typed)
        self.suggestions = Suggestions()
        self.suggestions.chosen.connect(self.add)
        self.suggestions.dismissed.connect(self._suggest_no_more)
        self.nothing = placeholder("No demonstration is open.")
        #: The task to which actions are suggested: from its first one on, until it is painted.
        self._suggested: str | None = None
        bar = QHBoxLayout()
        bar.setSpacing(2)
        bar.addWidget(self.entry, 1)
        bar.addWidget(add)
        for widget in (self.list, self.suggestions, self.nothing):
            self.column.addWidget(widget, 1)
        self.column.addLayout(bar)
        self._striking = -1
        self._counting = QTimer(self, singleShot=True, interval=PAUSE)
        self._counting.timeout.connect(self._count)
        document.project_changed.connect(self.entry.clear)
        document.vocabulary_changed.connect(self._refresh)
        document.demonstration_changed.connect(self._refresh)
        document.tracks_changed.connect(self._count_soon)
        document.tracks_changed.connect(self._follow_painting)
        document.stroke_changed.connect(self._follow_painting)
        document.action_changed.connect(self.list.viewport().update)
        document.stroke_changed.connect(self._show_stroke)
        themes().changed.connect(self.list.viewport().update)
        self._refresh()

    def _show_stroke(self) -> None:
        """Mark the row of the action that a key has begun, and only that one anew."""
        stroke = self.document.stroke
        names = self.document.vocabulary.names
        now = names.index(stroke.action) if stroke is not None and stroke.action in names else -1
        for row in {self._striking, now} - {-1}:
            self.list.update(self.list.model().index(row, 0))
        self._striking = now

    def showEvent(self, event: QShowEvent) -> None:
        """Count what was painted while it was hidden."""
        super().showEvent(event)
        self._count()

    # What one can do with an action

    def use(self, name: str) -> None:
        """Fill the marked range with an action, or take it up as the brush, or put it down."""
        document = self.document
        if document.range is not None:
            fill_range(document, name)
        else:
            self._toggle(name)

    def _toggle(self, name: str) -> None:
        """Take an action up as the brush, or put it down."""
        self.document.set_action(None if self.document.action == name else name)

    def add(self, name: str) -> bool:
        """Add an action; the others stay as they are."""
        name = " ".join(name.split())
        if not name:
            return False
        if name in self.document.vocabulary:
            self.document.say(f"There is an action '{name}' already.", True)
            return False
        return self.document.add_actions(name)

    def rename(self, name: str, new: str) -> bool:
        """Give an action another name, in all segments of the coder's that have it."""
        return rename(self.document, name, new, self)

    def recolour(self, name: str, colour: str) -> bool:
        """Give an action another colour."""
        return self._change(lambda: self.document.vocabulary.recoloured(name, colour))

    def remove(self, name: str) -> bool:
        """Take an action that no segment has out of the vocabulary."""
        project, demonstration = self.document.project, self.document.demonstration
        if project is None or demonstration is None:
            return False
        try:
            project.refuse_removing(self.document.author, name, demonstration.task)
        except ForcelabError as error:
            self.document.say(str(error), True)
            return False
        return self._change(lambda: self.document.vocabulary.removed(name))

    def menu(self, name: str) -> QMenu:
        """What can be done with an action."""
        document = self.document
        menu = QMenu(self)
        brush = menu.addAction("Use as brush")
        brush.setCheckable(True)
        brush.setChecked(document.action == name)
        brush.triggered.connect(lambda: self._toggle(name))
        if document.range is not None:
            fill = menu.addAction(icon("range"), "Fill the marked range")
            fill.triggered.connect(lambda: fill_range(document, name))
        menu.addSeparator()
        key = menu.addAction(icon("key"), "Change key…")
        key.triggered.connect(lambda: self._ask_key(name))
        current = document.vocabulary[name].colour
        colour_menu(current, lambda colour: self.recolour(name, colour), menu)
        other = menu.addAction(icon("pencil"), "Rename…")
        other.triggered.connect(lambda: self._ask_name(name))
        remove = menu.addAction(icon("trash"), "Remove")
        remove.triggered.connect(lambda: self.remove(name))
        return menu

    # Inside

    def _change(self, change: Callable[[], Vocabulary]) -> bool:
        """Store the vocabulary as changed; what cannot be is told in one sentence."""
        try:
            changed = change()
        except InputError as error:
            self.document.say(str(error), True)
            return False
        return self.document.set_vocabulary(changed)

    def _ask_key(self, name: str) -> None:
        """Let a key be pressed for an action."""
        dialog = KeyDialog(self.document.vocabulary, name, self)
        dialog.exec()
        if (key := dialog.key) is not None:
            # The vocabulary may have changed elsewhere while the dialog was open.
            self._change(lambda: self.document.vocabulary.rebound(name, key))
        dialog.deleteLater()

    def _ask_name(self, name: str) -> None:
        """Let an action's name be typed."""
        if (new := ask_name(name, self)) is not None:
            self.rename(name, new)

    def _add_typed(self) -> None:
        """Add the action whose name was typed."""
        if self.add(self.entry.text()):
            self.entry.clear()
            self.list.scrollToBottom()

    def _clicked(self, index: QModelIndex) -> None:
        """Use the action that was clicked, or on which Enter was pressed."""
        if (name := self.model.name(index.row())) is not None:
            self.use(name)

    def _refresh(self) -> None:
        """Show the vocabulary as it is now."""
        self.model.refresh()
        demonstration, names = self.document.demonstration, self.document.vocabulary.names
        there = demonstration is not None
        task = None if demonstration is None else demonstration.task
        if task != self._suggested:
            self._suggested = None
        if not names:
            self._suggested = task
        self.suggestions.leave_out(names)
        self._show_parts()
        obstacle = "" if there else "Open a demonstration first: its task gets the action."
        allow(self.entry, obstacle)
        allow(self.plus, obstacle)
        self._count_soon()

    def _show_parts(self) -> None:
        """Show the actions, what else could be one, or both."""
        suggesting = self._suggested is not None
        there = self.document.demonstration is not None
        self.list.setVisible(there and (bool(self.document.vocabulary.names) or not suggesting))
        focus = QApplication.focusWidget()
        if not suggesting and focus is not None and self.suggestions.isAncestorOf(focus):
            self.list.setFocus()  # not the field below, where the next keys would be text
        self.suggestions.setVisible(suggesting)
        self.nothing.setHidden(there)

    def _suggest_no_more(self) -> None:
        """The actions there are do for this task."""
        self._suggested = None
        self._show_parts()

    def _follow_painting(self) -> None:
        """Who paints has all the actions it takes to begin."""
        document = self.document
        if self._suggested is not None and (document.segments or document.stroke is not None):
            self._suggest_no_more()

    def _count_soon(self) -> None:
        """Count when painting pauses."""
        if self.isVisible():
            self._counting.start()

    def _count(self) -> None:
        """Count the coder's segments."""
        if self.isVisible():
            self.model.count()
