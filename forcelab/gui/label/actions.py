"""The list of the task's actions, with keys, colours and suggestions."""

from __future__ import annotations

from collections.abc import Callable, Collection
from functools import cache
from typing import Any

from PySide6.QtCore import (
    QAbstractListModel,
    QModelIndex,
    QObject,
    QPoint,
    QRectF,
    QSize,
    Qt,
    QTimer,
    Signal,
)
from PySide6.QtGui import QColor, QContextMenuEvent, QFont, QKeyEvent, QPainter, QPen, QShowEvent
from PySide6.QtWidgets import (
    QApplication,
    QColorDialog,
    QCompleter,
    QDialog,
    QDialogButtonBox,
    QFrame,
    QHBoxLayout,
    QInputDialog,
    QLabel,
    QLineEdit,
    QMenu,
    QPushButton,
    QScrollArea,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QVBoxLayout,
    QWidget,
)

from forcelab.errors import ForcelabError, InputError
from forcelab.gui.document import Document
from forcelab.gui.icons import icon
from forcelab.gui.item_views import NOWHERE, Index, RowList, SideList, write_row
from forcelab.gui.label.segment_commands import fill_range, rename_action
from forcelab.gui.label.swatches import paint_key, paint_swatch, style_of, swatch_icon
from forcelab.gui.label.track_spans import track_spans
from forcelab.gui.layout import (
    fill_layout,
    placeholder,
    push_button,
    run_dialog,
    sentence_label,
    set_enabled_with_reason,
    toned_label,
    tool_button,
)
from forcelab.gui.theme import colours, themes
from forcelab.terms import Entry, glossary
from forcelab.vocabulary import COLOURS, Vocabulary


class ActionModel(QAbstractListModel):
    """The actions of the open demonstration's task.

    `counts` has the number and total duration (s) of the coder's segments by action.
    """

    def __init__(self, document: Document, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.document = document
        self.counts: dict[str, tuple[int, float]] = {}
        self._actions = document.vocabulary.actions

    def refresh(self) -> None:
        """Show the vocabulary as it is now; remaining rows keep selection and scroll position."""
        actions = self.document.vocabulary.actions
        common = min(len(actions), len(self._actions))
        if len(actions) > common:
            self.beginInsertRows(NOWHERE, common, len(actions) - 1)
            self._actions = actions
            self.endInsertRows()
        elif len(self._actions) > common:
            self.beginRemoveRows(NOWHERE, common, len(self._actions) - 1)
            self._actions = actions
            self.endRemoveRows()
        self._actions = actions
        self.redraw()

    def count(self) -> None:
        """Count the coder's segments."""
        self.counts = track_spans(self.document.editor.segments).totals()
        self.redraw()

    def redraw(self) -> None:
        if self._actions:
            self.dataChanged.emit(self.index(0), self.index(len(self._actions) - 1))

    def name(self, row: int) -> str | None:
        return self._actions[row].name if 0 <= row < len(self._actions) else None

    def rowCount(self, parent: Index = NOWHERE) -> int:
        return 0 if parent.isValid() else len(self._actions)

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """The action's name; the glossary's entry as its tooltip."""
        if not index.isValid() or index.row() >= len(self._actions):
            return None
        action = self._actions[index.row()]
        if role == Qt.ItemDataRole.DisplayRole:
            return action.name
        if role == Qt.ItemDataRole.ToolTipRole:
            return _tooltip(action.name)
        if role == Qt.ItemDataRole.AccessibleTextRole:
            number, seconds = self.counts.get(action.name, (0, 0.0))
            brush = ", brush" if action.name == self.document.action else ""
            key = action.key or "none"
            return f"{action.name}, key {key}, {number} segments, {seconds:.1f} seconds{brush}"
        return None


@cache
def glossary_by_action() -> dict[str, Entry]:
    """The glossary by action; empty where its file is missing or broken (others report it)."""
    try:
        return {entry.action: entry for entry in glossary()}
    except InputError:
        return {}


def _tooltip(name: str) -> str:
    """The glossary's entry for an action; at least its name, which may be cut on screen."""
    entry = glossary_by_action().get(name)
    if entry is None:
        return name
    return (
        f"<p><b>{entry.action}</b> {entry.sentence}</p>"
        f"<p><b>Starts:</b> {entry.starts}<br><b>Ends:</b> {entry.ends}</p>"
        f"<p><b>Beware:</b> {entry.unlike}</p>"
    )


class KeyDialog(QDialog):
    """Waits for the key that is to paint an action, and says at once why one cannot.

    `key` is the accepted one; empty to take the action's key away, None while none was accepted.
    """

    def __init__(self, vocabulary: Vocabulary, name: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._vocabulary, self._name = vocabulary, name
        self.key: str | None = None
        self.setWindowTitle(f"Key of '{name}'")
        ask = sentence_label(f"Press a key for '{name}'. Backspace removes its key.")
        self.trouble = toned_label("trouble")
        self.trouble.setMinimumHeight(2 * self.fontMetrics().height())
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Cancel, self)
        buttons.rejected.connect(self.reject)
        for button in buttons.buttons():
            button.setFocusPolicy(Qt.FocusPolicy.NoFocus)  # keys are for this dialog
        fill_layout(QVBoxLayout(self), ask, self.trouble, buttons)
        self.setMinimumWidth(320)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Take the key, or say what is against it."""
        if event.key() == Qt.Key.Key_Escape:
            self.reject()
            return
        key = event.text().strip().lower()
        if event.key() in (Qt.Key.Key_Backspace, Qt.Key.Key_Delete):
            key = ""
        elif not key or not key.isprintable():
            return
        try:
            self._vocabulary.rebound(self._name, key)
        except InputError as error:
            self.trouble.setText(str(error))
            return
        self.key = key
        self.accept()


def ask_name(old: str, parent: QWidget) -> str | None:
    """Ask for another name of an action; None to keep its own."""
    name, accepted = QInputDialog.getText(
        parent, "Rename action", f"New name of '{old}':", text=old
    )
    name = " ".join(name.split())
    return name if accepted and name and name != old else None


def colour_menu(current: str, choose: Callable[[str], object], parent_menu: QMenu) -> QMenu:
    """Add a submenu of the colours that every viewer tells apart, and any other."""
    menu, parent = parent_menu.addMenu("Colour"), parent_menu.parentWidget()
    names = (
        "Blue",
        "Vermilion",
        "Sky blue",
        "Orange",
        "Bluish green",
        "Yellow",
        "Reddish purple",
        "Black",
    )
    for colour, name in zip(COLOURS, names, strict=True):
        action = menu.addAction(swatch_icon(colour), name)
        same = "The action has this colour."
        set_enabled_with_reason(action, same if colour == current else "")
        action.triggered.connect(lambda _=False, colour=colour: choose(colour))
    menu.addSeparator()
    custom = menu.addAction("Other…")

    def ask() -> None:
        chosen = QColorDialog.getColor(QColor(current), parent, "Colour")
        if chosen.isValid():
            choose(chosen.name())

    custom.triggered.connect(ask)
    return menu


class ActionRows(RowList):
    """A list of actions, with the menu of each."""

    def __init__(self, model: ActionModel, menu: Callable[[str], QMenu]) -> None:
        super().__init__(model)
        self._model, self._menu = model, menu
        self.setAccessibleName("Actions: Enter selects the brush")
        self.setItemDelegate(_Delegate(model, self))
        self.setMouseTracking(True)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """Open the menu of the action under the pointer, or of the current one."""
        by_mouse = event.reason() == QContextMenuEvent.Reason.Mouse
        index = self.indexAt(event.pos()) if by_mouse else self.currentIndex()
        name = self._model.name(index.row())
        if name is None:
            return
        corner = QPoint(8, self.visualRect(index).bottom())
        menu = self._menu(name)
        menu.exec(event.globalPos() if by_mouse else self.viewport().mapToGlobal(corner))
        menu.deleteLater()


class _Delegate(QStyledItemDelegate):
    def __init__(self, model: ActionModel, parent: QWidget) -> None:
        super().__init__(parent)
        self._model = model

    def sizeHint(self, option: QStyleOptionViewItem, index: Index) -> QSize:
        return QSize(120, round(option.fontMetrics.height() * 1.9))

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        """Draw key, swatch, name and amounts; the brush on the accent's colour."""
        document = self._model.document
        action = document.vocabulary.actions[index.row()]
        theme = colours()
        box = QRectF(option.rect)
        brush = action.name == document.action
        stroke = document.stroke is not None and document.stroke.action == action.name
        painter.save()
        ink, muted = QColor(theme.text), QColor(theme.muted)
        if brush:
            painter.fillRect(box, QColor(theme.accent))
            ink = muted = QColor(theme.accent_text)
        elif option.state & QStyle.StateFlag.State_MouseOver:
            painter.fillRect(box, QColor(theme.panel))
        if stroke:
            painter.fillRect(QRectF(box.left(), box.top(), 3, box.height()), QColor(theme.cursor))
        if option.state & QStyle.StateFlag.State_HasFocus:
            painter.setPen(QPen(QColor(theme.accent_text if brush else theme.accent), 1))
            painter.drawRect(box.adjusted(1.5, 1.5, -1.5, -1.5))
        unit = option.fontMetrics.height()
        cap = QRectF(box.left() + 6, 0, unit * 1.4, unit * 1.45)
        cap.moveTop(round(box.center().y() - cap.height() / 2))
        paint_key(painter, cap, action.key, option.font)
        swatch = QRectF(round(cap.right() + 6), round(box.center().y() - unit * 0.45), unit, unit)
        swatch.setSize(QSize(round(unit * 1.5), round(unit * 0.9)).toSizeF())
        paint_swatch(painter, swatch, style_of(document.vocabulary, action.name))
        number, seconds = self._model.counts.get(action.name, (0, 0.0))
        amount = f"{number} · {seconds:.1f} s" if number else ""
        room = box.adjusted(swatch.right() - box.left() + 8, 0, -8, 0)
        font = QFont(option.font)
        font.setBold(brush)
        write_row(
            painter,
            room,
            (action.name, amount),
            (ink, muted),
            font,
            among=document.vocabulary.names,
        )
        painter.restore()


class ActionSuggestions(QScrollArea):
    """One button for each action that the vocabulary lacks."""

    chosen = Signal(str)
    dismissed = Signal()

    def __init__(self) -> None:
        super().__init__()
        page = QWidget()
        column = QVBoxLayout(page)
        self._text = QLabel(wordWrap=True)
        tip = "Show only the actions of this task; painting hides suggestions, too"
        self.hide_button = push_button("Hide suggestions", self.dismissed, tip=tip)
        fill_layout(column, self._text, self.hide_button)
        # Below each other: side by side the longer names are cut off in a narrow list.
        self.buttons: dict[str, QPushButton] = {}
        for name, entry in glossary_by_action().items():
            self.buttons[name] = push_button(
                name, lambda _=False, name=name: self.chosen.emit(name), tip=entry.sentence
            )
        fill_layout(column, *self.buttons.values(), 1)
        self.setWidgetResizable(True)
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setWidget(page)
        self.leave_out(())

    def leave_out(self, names: Collection[str]) -> None:
        """Hide the buttons of these actions, which the vocabulary has."""
        for name, button in self.buttons.items():
            button.setVisible(name not in names)
        self.hide_button.setVisible(bool(names))
        if names:
            self._text.setText("More actions to add:")
        else:
            self._text.setText("No actions yet: add one below, or begin with these.")


#: Segments are counted when nothing was painted for so many ms: strokes come first.
COUNT_DELAY_MS = 80


class _Entry(QLineEdit):
    """The name of an action to add; Escape empties the field and leaves it."""

    def keeps(self, event: QKeyEvent) -> bool:
        """Escape is for this field; in the window it means something else."""
        return event.key() == Qt.Key.Key_Escape

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if self.keeps(event):
            self.clear()
            self.clearFocus()  # where keys are text, the next one would not paint
        else:
            super().keyPressEvent(event)


class ActionList(SideList):
    """The actions of the open demonstration's task.

    Clicking an action (or Enter on it) makes it the brush, and once more puts the brush down; while
    a range is marked it fills the range instead.
    """

    def __init__(self, document: Document) -> None:
        super().__init__(document)
        self.setAccessibleName("Actions")
        self.model = ActionModel(document, self)
        self.list = ActionRows(self.model, self.menu)
        self.list.clicked.connect(self._clicked)
        self.list.opened.connect(self._clicked)
        self.entry = _Entry(placeholderText="Add an action", clearButtonEnabled=True)
        self.entry.setAccessibleName("Name of an action to add")
        self.entry.returnPressed.connect(self._add_typed)
        completer = QCompleter(list(glossary_by_action()), self)
        completer.setCaseSensitivity(Qt.CaseSensitivity.CaseInsensitive)
        self.entry.setCompleter(completer)
        tip = "Add the action; it gets a free colour and a free key"
        self.add_button = tool_button("plus", "Add action", self._add_typed, tip)
        self.suggestions = ActionSuggestions()
        self.suggestions.chosen.connect(self.add)
        self.suggestions.dismissed.connect(self._hide_suggestions)
        self.nothing = placeholder("No demonstration is open.")
        #: The task to which actions are suggested: from its first one on, until it is painted.
        self._suggested: str | None = None
        bar = fill_layout(QHBoxLayout(), (self.entry, 1), self.add_button, spacing=2)
        fill_layout(self.column, (self.list, 1), (self.suggestions, 1), (self.nothing, 1), bar)
        self._stroke_row = -1
        self._count_timer = QTimer(self, singleShot=True, interval=COUNT_DELAY_MS)
        self._count_timer.timeout.connect(self._count)
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
        """Mark the row of the action that a key has begun, and redraw only rows that change."""
        stroke = self.document.stroke
        names = self.document.vocabulary.names
        listed = stroke is not None and stroke.action in names
        current = names.index(stroke.action) if stroke is not None and listed else -1
        for row in {self._stroke_row, current} - {-1}:
            self.list.update(self.model.index(row))
        self._stroke_row = current

    def showEvent(self, event: QShowEvent) -> None:
        """Count what was painted while it was hidden."""
        super().showEvent(event)
        self._count()

    # Verbs

    def use(self, name: str) -> None:
        """Fill the marked range with an action, or set or clear it as the brush."""
        document = self.document
        if document.view.range is not None:
            fill_range(document, name)
        else:
            self._toggle_brush(name)

    def _toggle_brush(self, name: str) -> None:
        """Set the action as the brush, or clear the brush if it is that already."""
        brush = None if self.document.action == name else name
        self.document.set_action(brush)
        self.document.show_message(
            "No brush: a drag on your track asks for the action."
            if brush is None
            else f"'{brush}' is the brush: every drag on your track paints it. Click it "
            "again to put the brush down."
        )

    def add(self, name: str) -> bool:
        name = " ".join(name.split())
        if not name:
            return False
        if name in self.document.vocabulary:
            self.document.refuse(f"The action '{name}' already exists.")
            return False
        return self.document.add_actions(name)

    def rename(self, name: str, new: str) -> bool:
        """Rename an action in all of the coder's segments."""
        return rename_action(self.document, name, new, self)

    def recolour(self, name: str, colour: str) -> bool:
        return self._change(lambda: self.document.vocabulary.recoloured(name, colour), name)

    def remove(self, name: str) -> bool:
        """Remove an action that no segment has from the vocabulary."""
        project, demonstration = self.document.project, self.document.demonstration
        if project is None or demonstration is None:
            return False
        try:
            project.actions.refuse_removing(self.document.author, name, demonstration.task)
        except ForcelabError as error:
            self.document.refuse(str(error))
            return False
        return self._change(lambda: self.document.vocabulary.removed(name))

    def menu(self, name: str) -> QMenu:
        document = self.document
        menu = QMenu(self)
        brush = menu.addAction("Use as brush")
        brush.setCheckable(True)
        brush.setChecked(document.action == name)
        brush.triggered.connect(lambda: self._toggle_brush(name))
        if document.view.range is not None:
            text = "Fill the marked range"
            menu.addAction(icon("range"), text, lambda: fill_range(document, name))
        menu.addSeparator()
        menu.addAction(icon("key"), "Change key…", lambda: self._ask_key(name))
        current = document.vocabulary[name].colour
        colour_menu(current, lambda colour: self.recolour(name, colour), menu)
        menu.addAction(icon("pencil"), "Rename…", lambda: self._ask_name(name))
        menu.addAction(icon("trash"), "Remove", lambda: self.remove(name))
        return menu

    # Inside

    def _change(self, change: Callable[[], Vocabulary], recoloured: str = "") -> bool:
        """Store a changed vocabulary; an error is shown as one sentence."""
        try:
            changed = change()
        except InputError as error:
            self.document.refuse(str(error))
            return False
        return self.document.set_vocabulary(changed, recoloured)

    def _ask_key(self, name: str) -> None:
        dialog = KeyDialog(self.document.vocabulary, name, self)
        if run_dialog(dialog) and (key := dialog.key) is not None:
            # The vocabulary may have changed elsewhere while the dialog was open.
            self._change(lambda: self.document.vocabulary.rebound(name, key))

    def _ask_name(self, name: str) -> None:
        if (new := ask_name(name, self)) is not None:
            self.rename(name, new)

    def _add_typed(self) -> None:
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
        is_open = demonstration is not None
        task = None if demonstration is None else demonstration.task
        if task != self._suggested:
            self._suggested = None
        if not names:
            self._suggested = task
        self.suggestions.leave_out(names)
        self._update_visibility()
        obstacle = "" if is_open else "Open a demonstration first: its task gets the action."
        set_enabled_with_reason(self.entry, obstacle)
        set_enabled_with_reason(self.add_button, obstacle)
        self._count_soon()

    def _update_visibility(self) -> None:
        """Show the actions, the suggestions, or both."""
        suggesting = self._suggested is not None
        is_open = self.document.demonstration is not None
        self.list.setVisible(is_open and (bool(self.document.vocabulary.names) or not suggesting))
        focus = QApplication.focusWidget()
        if not suggesting and focus is not None and self.suggestions.isAncestorOf(focus):
            self.list.setFocus()  # not the field below, where the next keys would be text
        self.suggestions.setVisible(suggesting)
        self.nothing.setHidden(is_open)

    def _hide_suggestions(self) -> None:
        self._suggested = None
        self._update_visibility()

    def _follow_painting(self) -> None:
        """Drop the suggestions once the coder paints."""
        document = self.document
        if self._suggested is not None and (
            document.editor.segments or document.stroke is not None
        ):
            self._hide_suggestions()

    def _count_soon(self) -> None:
        """Count when painting pauses."""
        if self.isVisible():
            self._count_timer.start()

    def _count(self) -> None:
        if self.isVisible():
            self.model.count()
