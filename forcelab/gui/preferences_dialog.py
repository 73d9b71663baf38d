"""The dialog of all preferences and keys: made from their declarations, searched by their words."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from PySide6.QtCore import QModelIndex, QSize, Qt
from PySide6.QtGui import QKeySequence
from PySide6.QtWidgets import (
    QAbstractItemView,
    QDialog,
    QDialogButtonBox,
    QFormLayout,
    QGroupBox,
    QHBoxLayout,
    QHeaderView,
    QKeySequenceEdit,
    QLabel,
    QListWidget,
    QListWidgetItem,
    QPushButton,
    QStackedWidget,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from forcelab.errors import InputError
from forcelab.gui import settings
from forcelab.gui.author_choice import AuthorChoice
from forcelab.gui.commands import COMMANDS, Command
from forcelab.gui.document import Document
from forcelab.gui.layout import (
    PageOrPlaceholder,
    emphasise,
    fill_layout,
    label_of,
    muted_label,
    page_layout,
    push_button,
    resize_on_screen,
    scroll_area,
    search_field,
    set_enabled_with_reason,
    toned_label,
)
from forcelab.gui.preferences import (
    CODER,
    HOLD_TIME,
    REACTION_TIME,
    SAMPLE_FOLDER,
    SNAPPING,
    TEXT_SIZE,
    THEME,
    Preference,
)
from forcelab.gui.project_actions import ProjectActions
from forcelab.gui.review.trainer import Trainer
from forcelab.gui.review.training_preferences import (
    AUTOMATIC,
    OWN_CODE,
    PRESET,
    name_own_code,
    own_code_trouble,
)
from forcelab.gui.setting_editors import Editor, editor_for
from forcelab.gui.shortcuts import Keys, key_name
from forcelab.gui.text import contains_words, escape_ampersands
from forcelab.gui.widgets import show_text
from forcelab.recognition.plugins import Kind
from forcelab.text import task_text


class Row(QWidget):
    """A setting: its name, the control that changes it, and what it does."""

    def __init__(self, label: str, tip: str, control: QWidget) -> None:
        super().__init__()
        self._texts = f"{label} {tip}"
        self.control = control
        name = QLabel(label)
        emphasise(name)
        self._line = QHBoxLayout()
        aligned = isinstance(control, QPushButton)  # which is no wider than its text
        left = Qt.AlignmentFlag.AlignLeft if aligned else Qt.AlignmentFlag(0)
        self._line.addWidget(control, 1, left)
        parts = name, self._line, muted_label(tip)
        self._column = fill_layout(QVBoxLayout(self), *parts, margins=0, spacing=3)

    @property
    def words(self) -> str:
        """The text in which a search looks."""
        return self._texts

    def reset(self) -> None:
        """Go back to the default, where there is one."""


class PreferenceRow(Row):
    """A preference, which can be reset; by default its editor is that of its kind.

    `obstacle` gives the reason why it cannot be changed now, or nothing.
    """

    def __init__(
        self,
        preference: Preference[Any],
        control: QWidget | None = None,
        obstacle: Callable[[], str] = str,
    ) -> None:
        self.preference, self._obstacle, field = preference, obstacle, preference.field
        control = editor_for(field) if control is None else control
        super().__init__(field.label, field.tip, control)
        name = f"Reset: {field.label}"
        self._reset = push_button("Reset", self.reset, name, auto_default=False)
        self._line.addWidget(self._reset)
        if isinstance(control, Editor):
            control.changed.connect(lambda: preference.set_value(control.value()))
        preference.changed.connect(self.refresh)
        self.refresh()

    @property
    def words(self) -> str:
        return " ".join([super().words, *(text for _, text in self.preference.field.options)])

    def refresh(self) -> None:
        """Show the value that counts now."""
        preference, control = self.preference, self.control
        if isinstance(control, Editor) and control.value() != preference.value:
            control.set_value(preference.value)
        is_default = preference.value == preference.default
        obstacle = self._obstacle()
        set_enabled_with_reason(control, obstacle)
        set_enabled_with_reason(
            self._reset, obstacle or ("This is the default." if is_default else "")
        )

    def reset(self) -> None:
        if not self._obstacle():
            self.preference.reset()


class OwnCodeRow(PreferenceRow):
    """Import paths of one kind of code, and below them what is wrong with one."""

    def __init__(self, kind: Kind) -> None:
        self._kind = kind
        super().__init__(OWN_CODE[kind])
        self.trouble = toned_label("trouble")
        self.trouble.hide()
        self._column.addWidget(self.trouble)
        self.preference.changed.connect(self._check)

    def _check(self) -> None:
        name_own_code()
        show_text(self.trouble, own_code_trouble(self._kind))


class TaskSettingsRow(Row):
    """Leads to the settings with which the task in view is trained."""

    def __init__(self, trainer: Trainer, obstacle: Callable[[], str]) -> None:
        self._trainer, self._obstacle = trainer, obstacle
        self._button = push_button("", self._change, auto_default=False)
        super().__init__(
            "Settings of this task",
            "Features, classifier, decoder and merge map with which the task in view is trained.",
            self._button,
        )
        trainer.changed.connect(self._refresh)
        self._refresh()

    @property
    def words(self) -> str:
        from forcelab.recognition.settings import FIELDS  # loads much

        return " ".join([super().words, *(f"{field.label} {field.tip}" for field in FIELDS)])

    def _refresh(self) -> None:
        """Name the task and the preset that it is trained with."""
        trainer, name = self._trainer, "Settings…"
        if trainer.ready:
            preset, changed = trainer.preset_used
            name = f"{task_text(trainer.task)}: {preset}{', changed' if changed else ''}…"
        self._button.setText(escape_ampersands(name))
        self._button.setAccessibleName(name)
        obstacle = "" if trainer.ready else self._obstacle() or "Import demonstrations first."
        set_enabled_with_reason(self._button, obstacle)

    def _change(self) -> None:
        from forcelab.gui.review.settings_dialog import change_settings  # loads much

        change_settings(self._trainer, self)


class FormPage(QWidget):
    """Settings below one another, as many as a search leaves."""

    def __init__(self, rows: Sequence[Row]) -> None:
        super().__init__()
        self.rows = rows
        page = QWidget()
        layout = page_layout(page, *rows, margin=4, spacing=18)
        layout.addStretch(1)
        page_layout(self, scroll_area(page))

    def show_matching(self, query: str) -> bool:
        """Show the settings in which these words occur; gives whether there are any."""
        for row in self.rows:
            row.setVisible(contains_words(row.words, query))
        return any(not row.isHidden() for row in self.rows)

    def reset(self) -> None:
        for row in self.rows:
            row.reset()

    def focus_first(self) -> None:
        """Give the first setting that is shown the keyboard."""
        next(row.control for row in self.rows if not row.isHidden()).setFocus()


_ROW = Qt.ItemDataRole.UserRole
#: What a row has the keys of: a command, or an action of the task by its name.
_KeyOwner = Command | str


class KeysPage(QWidget):
    """All keys in one table; each change counts at once."""

    def __init__(self, document: Document, keys: Keys) -> None:
        super().__init__()
        self._document, self._keys = document, keys
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
        self._removers: list[QPushButton] = []
        self._form = QFormLayout()
        for place, name in enumerate(("Key", "Second key")):
            edit = QKeySequenceEdit()
            edit.setAccessibleName(name)
            edit.setMaximumSequenceLength(1)
            edit.editingFinished.connect(partial(self._take, place))
            # Not the field's own clear button: the field also empties itself when a press begins.
            press = partial(self._remove, place)
            remove = push_button("Remove", press, f"Remove: {name}", auto_default=False)
            self._edits.append(edit)
            self._removers.append(remove)
            self._form.addRow(label_of(edit, name), fill_layout(QHBoxLayout(), (edit, 1), remove))
        name = "Give this command its default keys back"
        self._reset = push_button("Reset", self._reset_current, name, auto_default=False)
        self._trouble = toned_label("trouble")
        self._trouble.setAccessibleName("Why a key was refused")
        # Kept free, so that the table does not jump when a sentence comes.
        self._trouble.setMinimumHeight(self.fontMetrics().lineSpacing() * 2)
        self._trouble.setAlignment(Qt.AlignmentFlag.AlignTop)
        row = QHBoxLayout()
        row.addLayout(self._form, 1)
        row.addWidget(self._reset, 0, Qt.AlignmentFlag.AlignTop)
        fill_layout(QVBoxLayout(self._editor), row, self._trouble)
        return self._editor

    def _fill(self) -> None:
        """List the task's actions and all commands."""
        chosen = self._current()
        self._table.clear()
        groups: dict[str, list[_KeyOwner]] = {}
        if names := self._document.vocabulary.names:
            groups["Actions of this task"] = [*names]
        for command in COMMANDS:
            groups.setdefault(command.group, []).append(command)
        self._groups = [self._add_group(heading, rows) for heading, rows in groups.items()]
        current = [item for item in self._items() if item.data(0, _ROW) == chosen]
        self._table.setCurrentItem((current or self._items())[0])
        self._table.expandAll()
        self._show_keys()
        self.show_matching(self._query)

    def _add_group(
        self, heading: str, rows: Sequence[_KeyOwner]
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
        for row in rows:
            text = row if isinstance(row, str) else row.text.rstrip("…")
            item = QTreeWidgetItem(top, [text])
            item.setData(0, _ROW, row)
            item.setSizeHint(0, room)
            items.append(item)
        return top, items

    def _items(self) -> list[QTreeWidgetItem]:
        """The rows that have keys."""
        return [item for _, rows in self._groups for item in rows]

    def _current(self) -> _KeyOwner | None:
        """The row whose keys are edited."""
        item = self._table.currentItem()
        row = item.data(0, _ROW) if item is not None else None
        return row if isinstance(row, _KeyOwner) else None

    def _keys_of(self, row: _KeyOwner) -> tuple[str, ...]:
        if isinstance(row, Command):
            return self._keys[row.id]
        vocabulary = self._document.vocabulary
        key = vocabulary[row].key if row in vocabulary else ""
        return (key,) if key else ()

    def _changed_by_coder(self, row: _KeyOwner | None) -> bool:
        return isinstance(row, Command) and self._keys.changed_by_coder(row.id)

    def _show_keys(self) -> None:
        """Show all keys; those that differ from the default in bold."""
        for item in self._items():
            row = item.data(0, _ROW)
            item.setText(1, ", ".join(key_name(key) for key in self._keys_of(row)))
            font = item.font(1)
            font.setBold(self._changed_by_coder(row))
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
        command = not isinstance(row, str)  # an action has one key, and no default
        self._form.setRowVisible(1, command)
        self._reset.setVisible(command)
        changed = self._changed_by_coder(row)
        set_enabled_with_reason(self._reset, "" if changed else "These are the default keys.")

    def _take(self, place: int) -> None:
        """Give the current row the key that was pressed in a field."""
        row = self._current()
        key = self._edits[place].keySequence().toString(QKeySequence.SequenceFormat.PortableText)
        bound = [] if row is None else list(self._keys_of(row))
        if isinstance(row, str):
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

    def _set(self, row: _KeyOwner, bound: Sequence[str]) -> None:
        document, key = self._document, bound[0] if bound else ""
        if isinstance(row, str):
            self._attempt(lambda: document.set_vocabulary(document.vocabulary.rebound(row, key)))
        else:
            self._attempt(lambda: self._keys.set_keys(row.id, bound, document.vocabulary))

    def _reset_current(self) -> None:
        if isinstance(row := self._current(), Command):
            self._attempt(lambda: self._keys.reset(row.id))

    def _attempt(self, change: Callable[[], object]) -> None:
        """Change keys, or say why they are refused and show those that count."""
        try:
            change()
        except InputError as error:
            self._show_current()
            self._trouble.setText(str(error))


class RecentProjectsEditor(QWidget):
    """The projects opened last, which can be removed from the list."""

    def __init__(self, opening: ProjectActions) -> None:
        super().__init__()
        self._opening = opening
        self._list = QListWidget()
        self._list.setAccessibleName("Recent projects")
        self._list.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self._list.setTextElideMode(Qt.TextElideMode.ElideMiddle)
        self._list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self._list.setFixedHeight(round(8.5 * self.fontMetrics().lineSpacing()))
        self._list.itemSelectionChanged.connect(self._enable)
        name = "Remove the selected projects from the list"
        press = self._remove_selected
        self._remove = push_button("Remove from list", press, name, auto_default=False)
        page_layout(self, self._list, spacing=6).addWidget(
            self._remove, 0, Qt.AlignmentFlag.AlignLeft
        )
        self.setFocusProxy(self._list)
        opening.recent_changed.connect(self._fill)
        self._fill()

    def _fill(self) -> None:
        self._list.clear()
        for path in settings.recent_projects():
            item = QListWidgetItem(str(path), self._list)
            item.setToolTip(str(path))
        self._enable()

    def _enable(self) -> None:
        chosen = bool(self._list.selectedItems())
        set_enabled_with_reason(self._remove, "" if chosen else "Select a project first.")

    def _remove_selected(self) -> None:
        for path in [Path(item.text()) for item in self._list.selectedItems()]:
            self._opening.forget_recent(path)


class PreferencesDialog(QDialog):
    """All preferences, a page for each subject; each change counts at once."""

    def __init__(
        self,
        document: Document,
        trainer: Trainer,
        opening: ProjectActions,
        keys: Keys,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle("Preferences")
        self._document, self._trainer = document, trainer
        self.pages: dict[str, FormPage | KeysPage] = {
            "Coder": FormPage([self._coder_row()]),
            "Appearance": FormPage([PreferenceRow(THEME), PreferenceRow(TEXT_SIZE)]),
            "Labelling": FormPage([PreferenceRow(p) for p in (SNAPPING, REACTION_TIME, HOLD_TIME)]),
            "Keys": KeysPage(document, keys),
            "Training": FormPage(self._training_rows()),
            "Files": FormPage(
                [
                    Row(
                        "Recent projects",
                        "The File menu offers them, and forcelab opens the first one when it "
                        "starts. Removing a project from the list does not delete it.",
                        RecentProjectsEditor(opening),
                    ),
                    PreferenceRow(SAMPLE_FOLDER),
                ]
            ),
        }
        self.search = search_field("Search settings and keys", "Search preferences")
        self.search.textChanged.connect(self._filter)
        self.search.returnPressed.connect(self._focus_page)
        self.subjects = QListWidget()
        self.subjects.setAccessibleName("Subjects")
        self._stack = QStackedWidget()
        for name, page in self.pages.items():
            self.subjects.addItem(name)
            self._stack.addWidget(page)
        room = round(1.7 * self.fontMetrics().height())
        for i in range(self.subjects.count()):
            self.subjects.item(i).setSizeHint(QSize(0, room))
        self.subjects.setFixedWidth(18 * self.fontMetrics().averageCharWidth())
        self.subjects.currentRowChanged.connect(self._stack.setCurrentIndex)
        content = QWidget()
        across = fill_layout(QHBoxLayout(content), margins=0, spacing=12)
        fill_layout(across, self.subjects, (self._stack, 1))
        self._found = PageOrPlaceholder(content)
        parts = self.search, (self._found, 1), self._make_buttons()
        fill_layout(QVBoxLayout(self), *parts, spacing=10)
        self.subjects.setCurrentRow(0)
        self.search.setFocus()
        resize_on_screen(self, self.sizeHint())

    def sizeHint(self) -> QSize:
        metrics = self.fontMetrics()
        return QSize(metrics.averageCharWidth() * 104, metrics.lineSpacing() * 38)

    def show_page(self, name: str) -> None:
        """Bring a page to the front, all of it."""
        self.search.clear()
        self.subjects.setCurrentRow([*self.pages].index(name))
        self.search.setFocus()

    # What it is made of

    def _coder_row(self) -> Row:
        document = self._document
        choice = AuthorChoice(document, labelled=False)
        coder = Preference(CODER, settings.account, lambda: document.author, choice.become)
        document.author_changed.connect(coder.changed)
        document.project_changed.connect(coder.changed)
        return PreferenceRow(coder, choice, self._no_project)

    def _training_rows(self) -> list[Row]:
        trainer = self._trainer
        automatic = Preference(
            AUTOMATIC, lambda: False, lambda: trainer.automatic, trainer.set_automatic
        )
        trainer.changed.connect(automatic.changed)
        return [
            PreferenceRow(automatic, obstacle=self._no_project),
            PreferenceRow(PRESET),
            TaskSettingsRow(trainer, self._no_project),
            *(OwnCodeRow(kind) for kind in OWN_CODE),
        ]

    def _make_buttons(self) -> QDialogButtonBox:
        # None is the default: Enter leads from the search to a setting, or from a row to its keys.
        name = "Reset this page"
        self._reset = push_button(name, self._reset_page, name, auto_default=False)
        close = push_button("Close", self.accept, "Close", auto_default=False)
        buttons, roles = QDialogButtonBox(), QDialogButtonBox.ButtonRole
        buttons.addButton(self._reset, roles.ResetRole)
        buttons.addButton(close, roles.RejectRole)
        return buttons

    # What happens

    @property
    def _page(self) -> FormPage | KeysPage:
        return [*self.pages.values()][self.subjects.currentRow()]

    def _filter(self, query: str) -> None:
        """Show the pages and settings in which all words occur; one of the pages is in front."""
        found = [page.show_matching(query) for page in self.pages.values()]
        for i, has_matches in enumerate(found):
            self.subjects.item(i).setHidden(not has_matches)
        if any(found) and not found[self.subjects.currentRow()]:
            self.subjects.setCurrentRow(found.index(True))
        # It would reset what the search hides, too.
        set_enabled_with_reason(self._reset, "Clear the search first." if query.strip() else "")
        self._found.say("" if any(found) else f"Nothing is called '{query.strip()}'.")

    def _reset_page(self) -> None:
        self._page.reset()

    def _focus_page(self) -> None:
        """Go on from the search to what was found."""
        if self._found.currentIndex() == 0:
            self._page.focus_first()

    def _no_project(self) -> str:
        return "Open a project first." if self._document.project is None else ""
