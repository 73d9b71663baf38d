"""The history of the coder's track: its edits, and how far undo and redo reach."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date, datetime
from enum import Enum
from typing import Any

from PySide6.QtCore import QAbstractListModel, QModelIndex, QObject, QRectF, QSize, Qt, QTimer
from PySide6.QtGui import QColor, QFont, QHideEvent, QPainter, QPalette, QShowEvent
from PySide6.QtWidgets import (
    QHBoxLayout,
    QLabel,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QWidget,
)

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.item_views import NOWHERE, Index, RowList, SideList, write_row
from forcelab.gui.layout import PageOrPlaceholder, fill_layout, set_enabled_with_reason, tool_button
from forcelab.gui.theme import colours, themes
from forcelab.project import Edit

#: How many edits are read at a time, and how many at first when there are only new ones to read.
PAGE, NEW = 200, 4


class EditState(Enum):
    """What has become of an edit."""

    DONE = "done"
    UNDONE = "undone"  # redo can bring it back
    ABANDONED = "abandoned"  # undone, and another edit came after it: no redo reaches it


STATE_TEXTS = {
    EditState.DONE: "",
    EditState.UNDONE: "undone; redo brings it back",
    EditState.ABANDONED: "undone before a later edit; redo cannot bring it back",
}


def edit_states(newest_first: Sequence[Edit]) -> dict[int, EditState]:
    """What has become of edits, by number, for those that are neither an undo nor a redo.

    Needs the track's latest edits without a hole: whatever happened to them came after them, so
    earlier edits say nothing about it.
    """
    states: dict[int, EditState] = {}
    redone: set[int] = set()  # undos that were taken back
    replaced: set[int] = set()  # edits in whose place another one is: a run of them is one row
    superseded = False  # whether an edit came later that left the undos before it behind
    for newer, edit in zip((None, *newest_first), newest_first, strict=False):
        if edit.kind == "undo" and newer and newer.kind == "paint" and newer.time == edit.time:
            replaced.add(edit.reverts or 0)
        if edit.kind == "redo":
            redone.add(edit.reverts or 0)
        elif edit.kind == "undo":
            if edit.id not in redone:
                states.setdefault(
                    edit.reverts or 0, EditState.ABANDONED if superseded else EditState.UNDONE
                )
        else:
            states.setdefault(edit.id, EditState.DONE)
            superseded = True
    return {
        edit.id: states[edit.id] for edit in newest_first if edit.id in states.keys() - replaced
    }


class HistoryModel(QAbstractListModel):
    """A row for every edit of the coder's track; undo and redo show in the rows they concern.

    A long history is read by pages as the list is scrolled; `rows` are newest first.
    """

    def __init__(self, document: Document, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.document = document
        self.rows: list[Edit] = []
        self._edits: list[Edit] = []  # newest first, undo and redo among them
        self._states: dict[int, EditState] = {}
        self._track = ("", "")
        self._complete = False

    def refresh(self) -> None:
        """Read new edits."""
        track = (self.document.id, self.document.author)
        newest = self._edits[0].id if self._edits and track == self._track else None
        # After a stroke there is one edit more: to read a page each time would hold up the next.
        page = self._page(None, None if newest is None else NEW)
        if newest is not None and len(page) == NEW and page[-1].id > newest:
            page = self._page(None)
        new = [edit for edit in page if newest is None or edit.id > newest]
        self.beginResetModel()
        if len(new) == len(page):  # another track, or more has happened than one page holds
            self._edits, self._complete = page, len(page) < PAGE
        else:
            self._edits = new + self._edits
        self._track = track
        self._update_states()
        # What redo can bring back lies between the last page and the latest edit that stands.
        while not self._complete and EditState.DONE not in self._states.values():
            self._append_page(self._page(self._edits[-1].id))
        self.endResetModel()

    def clear(self) -> None:
        self.beginResetModel()
        self.rows, self._edits, self._states, self._complete = [], [], {}, False
        self.endResetModel()

    def state_of(self, row: int) -> EditState:
        return self._states[self.rows[row].id]

    def steps_to(self, row: int) -> int:
        """How many undos (negative) or redos make the edit of a row the latest that stands."""
        if self.state_of(row) == EditState.DONE:
            return -sum(self.state_of(newer) == EditState.DONE for newer in range(row))
        if self.state_of(row) == EditState.UNDONE:
            older = range(row, len(self.rows))
            return sum(self.state_of(at) == EditState.UNDONE for at in older)
        return 0

    # What Qt asks

    def canFetchMore(self, parent: Index) -> bool:
        return not parent.isValid() and bool(self._edits) and not self._complete

    def fetchMore(self, parent: Index) -> None:
        if not self.canFetchMore(parent):
            return
        page = self._page(self._edits[-1].id)
        before = len(self.rows)
        added = len(edit_states([*self._edits, *page])) - before
        if added:
            self.beginInsertRows(NOWHERE, before, before + added - 1)
        self._append_page(page)
        if added:
            self.endInsertRows()

    def rowCount(self, parent: Index = NOWHERE) -> int:
        return 0 if parent.isValid() else len(self.rows)

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """The sentence of an edit; its time and state as the tooltip."""
        if not index.isValid() or index.row() >= len(self.rows):
            return None
        edit, state = self.rows[index.row()], self.state_of(index.row())
        if role == Qt.ItemDataRole.DisplayRole:
            return edit.what
        if role == Qt.ItemDataRole.ToolTipRole:
            when = f"{edit.time.astimezone():%Y-%m-%d %H:%M:%S}"
            return "\n".join(filter(None, (edit.what, when, STATE_TEXTS[state])))
        if role == Qt.ItemDataRole.AccessibleTextRole:
            return ", ".join(filter(None, (time_of_edit(edit.time), edit.what, STATE_TEXTS[state])))
        return None

    # Inside

    def _page(self, before: int | None, latest: int | None = None) -> list[Edit]:
        """The latest edits before edit number `before`, newest first."""
        document = self.document
        if document.project is None or not document.id:
            return []
        try:
            edits = document.project.tracks.history(
                document.id, document.author, latest=latest or PAGE, before=before
            )
        except ForcelabError as error:
            document.show_message(str(error), True)
            return []
        return list(reversed(edits))

    def _append_page(self, page: list[Edit]) -> None:
        self._complete = len(page) < PAGE
        self._edits += page
        self._update_states()

    def _update_states(self) -> None:
        """Tell edits from undos and redos, and what has become of each."""
        self._states = edit_states(self._edits)
        self.rows = [edit for edit in self._edits if edit.id in self._states]


def time_of_edit(time: datetime) -> str:
    """The time of day, with the date where that is not today."""
    local = time.astimezone()
    if local.date() == date.today():
        return f"{local:%H:%M:%S}"
    return f"{local:%Y-%m-%d %H:%M}"


#: Edits are read when nothing was painted for so many ms.
PAUSE = 60


class HistoryView(SideList):
    """Every edit of the coder's track, newest first; what was undone is greyed.

    Double click or Enter on an edit undoes what came after it, or redoes up to it. While the view
    is hidden nothing is read.
    """

    def __init__(self, document: Document) -> None:
        super().__init__(document)
        self.setAccessibleName("History")
        self.model = HistoryModel(document, self)
        self.list = RowList(self.model)
        self.list.setItemDelegate(_Delegate(self.model, self.list))
        self.list.setAccessibleName("Edits of your track, newest first")
        self.list.doubleClicked.connect(self._row_activated)
        self.list.opened.connect(self._row_activated)
        self.undo = tool_button("undo", "Undo", lambda: self._step(-1))
        self.redo = tool_button("redo", "Redo", lambda: self._step(1))
        for button in (self.undo, self.redo):
            button.setAutoRaise(True)
        self.reach = QLabel()
        self.reach.setForegroundRole(QPalette.ColorRole.PlaceholderText)
        self.pages = PageOrPlaceholder(self.list)
        bar = fill_layout(QHBoxLayout(), self.undo, self.redo, (self.reach, 1), spacing=2)
        fill_layout(self.column, bar, (self.pages, 1))
        self._refresh_timer = QTimer(self, singleShot=True, interval=PAUSE)
        self._refresh_timer.timeout.connect(self.refresh)
        document.tracks_changed.connect(self._refresh_soon)
        document.demonstration_changed.connect(self.refresh)
        themes().changed.connect(self.list.viewport().update)
        self._update_buttons()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self.refresh()

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self.model.clear()

    def go_to(self, row: int) -> None:
        """Undo or redo until the edit of a row is the latest that stands."""
        if not 0 <= row < len(self.model.rows):
            return
        if self.model.state_of(row) == EditState.ABANDONED:
            self.document.show_message(
                f"'{self.model.rows[row].what}' was undone before a later edit, so redo "
                "cannot bring it back."
            )
            return
        self._step(self.model.steps_to(row))

    def _step(self, steps: int) -> None:
        """Undo so many edits of the open track, if negative, or redo so many."""
        document, farther = self.document, []
        for _ in range(abs(steps)):
            editor = document.editor
            result = editor.undo_everywhere() if steps < 0 else editor.redo_everywhere()
            if result is None:
                return
            if result.reaches_farther:
                farther.append(document.local_message)
        if farther:  # what changed out of sight is not to go by in the middle
            document.show_local_message(". ".join(farther))

    def _row_activated(self, index: QModelIndex) -> None:
        """Go to the edit that was activated."""
        if not 0 <= index.row() < len(self.model.rows):
            return
        chosen = self.model.rows[index.row()]
        self.refresh()  # something may just have been painted
        rows = enumerate(self.model.rows)
        self.go_to(next((row for row, edit in rows if edit.id == chosen.id), -1))

    def _refresh_soon(self) -> None:
        """Refresh when painting pauses: strokes come first."""
        if self.isVisible():
            self._refresh_timer.start()

    def refresh(self) -> None:
        self._refresh_timer.stop()
        if self.isVisible():
            self.model.refresh()
            self._update_buttons()

    def _update_buttons(self) -> None:
        """Show in buttons and label what undo and redo would do."""
        rows = range(len(self.model.rows))
        self.pages.say("" if rows else "No edits yet. Every edit can be undone.")
        done = next((row for row in rows if self.model.state_of(row) == EditState.DONE), None)
        undone = [row for row in rows if self.model.state_of(row) == EditState.UNDONE]
        can_undo = done is not None or self.model.canFetchMore(QModelIndex())
        set_enabled_with_reason(self.undo, "" if can_undo else "No edit is left here to be undone.")
        set_enabled_with_reason(self.redo, "" if undone else "Nothing was undone here.")
        self.undo.setToolTip("Undo" if done is None else f"Undo: {self.model.rows[done].what}")
        self.redo.setToolTip(f"Redo: {self.model.rows[undone[-1]].what}" if undone else "Redo")
        count = len(undone)
        self.reach.setText(f"{count} undone" if count else "")


class _Delegate(QStyledItemDelegate):
    """Draws the time and the sentence of an edit, and a line where the present is."""

    PADDING = 6.0

    def __init__(self, model: HistoryModel, parent: QWidget) -> None:
        super().__init__(parent)
        self._model = model

    def sizeHint(self, option: QStyleOptionViewItem, index: Index) -> QSize:
        return QSize(100, round(option.fontMetrics.height() * 1.6))

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        row = index.row()
        edit, state = self._model.rows[row], self._model.state_of(row)
        theme = colours()
        box = QRectF(option.rect)
        painter.save()
        ink, muted = QColor(theme.text), QColor(theme.muted)
        if option.state & QStyle.StateFlag.State_Selected:
            painter.fillRect(box, QColor(theme.accent))
            ink = muted = QColor(theme.accent_text)
        elif state != EditState.DONE:
            ink = muted
        font = QFont(option.font)
        font.setStrikeOut(state == EditState.ABANDONED)
        font.setItalic(state != EditState.DONE)
        inner = box.adjusted(self.PADDING, 0, -self.PADDING, 0)
        write_row(painter, inner, (edit.what, time_of_edit(edit.time)), (ink, muted), font)
        below_undone = row > 0 and self._model.state_of(row - 1) == EditState.UNDONE
        if below_undone and state == EditState.DONE:
            painter.fillRect(QRectF(box.left(), box.top(), box.width(), 2), QColor(theme.accent))
        painter.restore()
