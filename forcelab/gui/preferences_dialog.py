"""The dialog of all preferences: made from their declarations, searched by their words."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import Any

from PySide6.QtCore import QSize, Qt
from PySide6.QtWidgets import (
    QAbstractItemView,
    QDialog,
    QDialogButtonBox,
    QHBoxLayout,
    QLabel,
    QListWidget,
    QListWidgetItem,
    QPushButton,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui import settings
from forcelab.gui.author_choice import AuthorChoice
from forcelab.gui.document import Document
from forcelab.gui.keys_page import KeysPage
from forcelab.gui.layout import (
    PageOrPlaceholder,
    emphasise,
    fill_layout,
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
from forcelab.gui.shortcuts import Keys
from forcelab.gui.text import contains_words, escape_ampersands
from forcelab.recognition.plugins import Kind


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
        self.trouble.setText(own_code_trouble(self._kind))
        self.trouble.setVisible(bool(self.trouble.text()))


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
            name = f"{trainer.task or 'no task'}: {preset}{', changed' if changed else ''}…"
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
        offered: Collection[str] | None = None,
    ) -> None:
        """`offered` are the ids of the commands whose keys can be changed, by default all."""
        super().__init__(parent)
        self.setWindowTitle("Preferences")
        self._document, self._trainer = document, trainer
        self.pages: dict[str, FormPage | KeysPage] = {
            "Coder": FormPage([self._coder_row()]),
            "Appearance": FormPage([PreferenceRow(THEME), PreferenceRow(TEXT_SIZE)]),
            "Labelling": FormPage([PreferenceRow(p) for p in (SNAPPING, REACTION_TIME, HOLD_TIME)]),
            "Keys": KeysPage(document, keys, offered),
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
        buttons, roles = QDialogButtonBox(), QDialogButtonBox.ButtonRole
        self._reset = buttons.addButton("Reset this page", roles.ResetRole)
        self._reset.clicked.connect(self._reset_page)
        close = buttons.addButton("Close", roles.RejectRole)
        close.clicked.connect(self.accept)
        # None is the default: Enter leads from the search to a setting, or from a row to its keys.
        for button in (self._reset, close):
            button.setAccessibleName(button.text())
            button.setAutoDefault(False)
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
