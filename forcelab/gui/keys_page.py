"""The page on which every key can be changed: of all commands and of the task's actions."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import partial

from PySide6.QtCore import QModelIndex, QSize, Qt
from PySide6.QtGui import QKeySequence
from PySide6.QtWidgets import (
    QFormLayout,
    QGroupBox,
    QHBoxLayout,
    QHeaderView,
    QKeySequenceEdit,
    QLabel,
    QPushButton,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from forcelab.errors import InputError
from forcelab.gui.document import Document
from forcelab.gui.layout import (
    fill_layout,
    label_of,
    page_layout,
    push_button,
    set_enabled_with_reason,
    toned_label,
)
from forcelab.gui.shortcuts import COMMANDS, Keys, key_name
from forcelab.gui.text import contains_words

_ROW = Qt.ItemDataRole.UserRole


@dataclass(frozen=True, slots=True)
class _Row:
    """What a row changes: a command by its id, or an action by its name."""

    name: str
    is_action: bool


class KeysPage(QWidget):
    """All keys in one table; each change counts at once.

    `offered` are the ids of the commands, by default all.
    """

    def __init__(
        self, document: Document, keys: Keys, offered: Collection[str] | None = None
    ) -> None:
        super().__init__()
        self._document, self._keys = document, keys
        self._offered = [c for c in COMMANDS if offered is None or c.id in offered]
        self._query = ""
        self._groups: list[tuple[QTreeWidgetItem, list[QTreeWidgetItem]]] = []
        self._table = self._make_table()
        page_layout(self, self._table, self._make_editor(), growing=self._table, spacing=10)
        self._fill()
        keys.changed.connect(self._show_keys)
        document.vocabulary_changed.connect(self._fill)

    def show_matching(self, query: str) -> bool:
        """Show the rows in whose name or keys these words occur; one of them is current.

        Gives whether there are any.
        """
        self._query = query
        for top, rows in self._groups:
            for item in rows:
                item.setHidden(not contains_words(f"{item.text(0)} {item.text(1)}", query))
            top.setHidden(all(item.isHidden() for item in rows))
        shown = [item for item in self._items() if not item.isHidden()]
        if self._table.currentItem() not in shown:
            first = self._table.indexFromItem(shown[0]) if shown else QModelIndex()
            self._table.setCurrentIndex(first)
        return bool(shown)

    def reset(self) -> None:
        """Give all commands their default keys back."""
        self._keys.reset_all()

    def focus_first(self) -> None:
        """Give the table the keyboard; Enter leads on to the keys of the row."""
        self._table.setFocus()

    def _make_table(self) -> QTreeWidget:
        table = QTreeWidget()
        table.setColumnCount(2)
        table.setHeaderLabels(["Command", "Keys"])
        table.setAccessibleName("Commands and actions with their keys")
        table.setRootIsDecorated(False)
        table.setItemsExpandable(False)
        table.setIndentation(self.fontMetrics().averageCharWidth() * 2)
        table.setUniformRowHeights(True)
        table.header().setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        table.header().setSectionResizeMode(1, QHeaderView.ResizeMode.ResizeToContents)
        table.header().setStretchLastSection(False)
        table.currentItemChanged.connect(self._show_current)
        table.itemActivated.connect(lambda *_: self._edits[0].setFocus())
        return table

    def _make_editor(self) -> QGroupBox:
        """The fields in which keys are pressed."""
        self._editor = QGroupBox()
        self._edits: list[QKeySequenceEdit] = []
        self._labels: list[QLabel] = []
        self._removers: list[QPushButton] = []
        form = QFormLayout()
        for place, name in enumerate(("Key", "Second key")):
            edit = QKeySequenceEdit()
            edit.setAccessibleName(name)
            edit.setMaximumSequenceLength(1)
            edit.editingFinished.connect(partial(self._take, place))
            label = label_of(edit, name)
            # Not the field's own clear button: the field also empties itself when a press begins.
            press = partial(self._remove, place)
            remove = push_button("Remove", press, f"Remove: {name}", auto_default=False)
            self._edits.append(edit)
            self._labels.append(label)
            self._removers.append(remove)
            form.addRow(label, fill_layout(QHBoxLayout(), (edit, 1), remove))
        name = "Give this command its default keys back"
        self._reset = push_button("Reset", self._reset_current, name, auto_default=False)
        self._trouble = toned_label("trouble")
        self._trouble.setTextFormat(Qt.TextFormat.PlainText)
        self._trouble.setAccessibleName("Why a key was refused")
        # Kept free, so that the table does not jump when a sentence comes.
        self._trouble.setMinimumHeight(self.fontMetrics().lineSpacing() * 2)
        self._trouble.setAlignment(Qt.AlignmentFlag.AlignTop)
        row = QHBoxLayout()
        row.addLayout(form, 1)
        row.addWidget(self._reset, 0, Qt.AlignmentFlag.AlignTop)
        fill_layout(QVBoxLayout(self._editor), row, self._trouble)
        return self._editor

    def _fill(self) -> None:
        """List the task's actions and all commands."""
        chosen = self._current()
        self._table.clear()
        rows: dict[str, list[tuple[str, _Row]]] = {}
        if len(self._document.vocabulary):
            rows["Actions of this task"] = [
                (name, _Row(name, is_action=True)) for name in self._document.vocabulary.names
            ]
        for command in self._offered:
            members = rows.setdefault(command.group, [])
            members.append((command.text.rstrip("…"), _Row(command.id, is_action=False)))
        self._groups = [self._group(heading, members) for heading, members in rows.items()]
        current = [item for item in self._items() if item.data(0, _ROW) == chosen]
        self._table.setCurrentItem((current or self._items())[0])
        self._table.expandAll()
        self._show_keys()
        self.show_matching(self._query)

    def _group(
        self, heading: str, members: Sequence[tuple[str, _Row]]
    ) -> tuple[QTreeWidgetItem, list[QTreeWidgetItem]]:
        """Add a heading and its rows."""
        top = QTreeWidgetItem(self._table, [heading])
        top.setFlags(Qt.ItemFlag.ItemIsEnabled)
        font = top.font(0)
        font.setBold(True)
        top.setFont(0, font)
        room = QSize(0, round(self.fontMetrics().lineSpacing() * 1.5))
        top.setSizeHint(0, room)
        items = []
        for text, row in members:
            item = QTreeWidgetItem(top, [text])
            item.setData(0, _ROW, row)
            item.setSizeHint(0, room)
            items.append(item)
        return top, items

    def _items(self) -> list[QTreeWidgetItem]:
        """The rows that have keys."""
        return [item for _, rows in self._groups for item in rows]

    def _current(self) -> _Row | None:
        """The row whose keys are edited."""
        item = self._table.currentItem()
        row = item.data(0, _ROW) if item is not None else None
        return row if isinstance(row, _Row) else None

    def _keys_of(self, row: _Row) -> tuple[str, ...]:
        if row.is_action:
            vocabulary = self._document.vocabulary
            key = vocabulary[row.name].key if row.name in vocabulary else ""
            return (key,) if key else ()
        return self._keys[row.name]

    def _show_keys(self) -> None:
        """Show all keys; those that differ from the default in bold."""
        for item in self._items():
            row = item.data(0, _ROW)
            item.setText(1, ", ".join(key_name(key) for key in self._keys_of(row)))
            font = item.font(1)
            font.setBold(not row.is_action and self._keys.changed_by_coder(row.name))
            item.setFont(1, font)
        self._show_current()

    def _show_current(self) -> None:
        """Show the keys of the current row in the fields."""
        row = self._current()
        self._trouble.clear()
        set_enabled_with_reason(self._editor, "" if row else "Choose a command first.")
        item = self._table.currentItem()
        self._editor.setTitle(item.text(0) if item is not None and row is not None else "")
        bound = (*self._keys_of(row), "", "")[:2] if row is not None else ("", "")
        for edit, remove, key in zip(self._edits, self._removers, bound, strict=True):
            edit.setKeySequence(QKeySequence(key, QKeySequence.SequenceFormat.PortableText))
            set_enabled_with_reason(remove, "" if key else "There is no key to be removed.")
        command = row is None or not row.is_action  # an action has one key, and no default
        for widget in (self._edits[1], self._labels[1], self._removers[1], self._reset):
            widget.setVisible(command)
        changed = row is not None and command and self._keys.changed_by_coder(row.name)
        set_enabled_with_reason(self._reset, "" if changed else "These are the default keys.")

    def _take(self, place: int) -> None:
        """Give the current row the key that was pressed in a field."""
        row = self._current()
        key = self._edits[place].keySequence().toString(QKeySequence.SequenceFormat.PortableText)
        bound = [] if row is None else list(self._keys_of(row))
        if row is not None and row.is_action:
            key = key.lower()
        if row is None or not key or key in bound:
            self._show_current()  # nothing came of a press, as of Ctrl alone
        else:
            bound[place : place + 1] = [key]
            self._set(row, bound)

    def _remove(self, place: int) -> None:
        """Remove a key from the current row."""
        row = self._current()
        if row is not None:
            bound = list(self._keys_of(row))
            del bound[place : place + 1]
            self._set(row, bound)

    def _set(self, row: _Row, bound: Sequence[str]) -> None:
        """Give a row other keys, or say why not."""
        try:
            if row.is_action:
                vocabulary, key = self._document.vocabulary, bound[0] if bound else ""
                self._document.set_vocabulary(vocabulary.rebound(row.name, key))
            else:
                self._keys.set_keys(row.name, bound, self._document.vocabulary)
        except InputError as error:
            self._refuse(error)

    def _refuse(self, error: InputError) -> None:
        """Say why a key is refused, and show the keys that count."""
        self._show_current()
        self._trouble.setText(str(error))

    def _reset_current(self) -> None:
        """Reset the keys of the current command."""
        row = self._current()
        if row is None or row.is_action:
            return
        try:
            self._keys.reset(row.name)
        except InputError as error:
            self._refuse(error)
