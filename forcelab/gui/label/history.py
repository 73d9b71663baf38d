"""The history of the coder's track: what was done when, and how far undo and redo reach."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QModelIndex, QRectF, QSize, QTimer
from PySide6.QtGui import QColor, QFont, QHideEvent, QPainter, QPalette, QShowEvent
from PySide6.QtWidgets import (
    QHBoxLayout,
    QLabel,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QToolButton,
    QWidget,
)

from forcelab.gui.arranging import PageOrNote
from forcelab.gui.document import Document
from forcelab.gui.icons import icon
from forcelab.gui.indexes import Index
from forcelab.gui.label.history_model import HistoryModel, Standing, clock
from forcelab.gui.label.side_lists import RowList, SideList, write_row
from forcelab.gui.theme import colours, themes

__all__ = ["HistoryView"]

#: What was done is read when nothing was painted for so many ms.
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
        self.list.doubleClicked.connect(self._chosen)
        self.list.opened.connect(self._chosen)
        self.undo = self._button("undo", "Undo", document.undo)
        self.redo = self._button("redo", "Redo", document.redo)
        self._reach = QLabel()
        self._reach.setForegroundRole(QPalette.ColorRole.PlaceholderText)
        self._pages = PageOrNote(self.list)
        bar = QHBoxLayout()
        bar.setSpacing(2)
        bar.addWidget(self.undo)
        bar.addWidget(self.redo)
        bar.addWidget(self._reach, 1)
        self.column.addLayout(bar)
        self.column.addWidget(self._pages, 1)
        self._soon = QTimer(self, singleShot=True, interval=PAUSE)
        self._soon.timeout.connect(self.refresh)
        document.tracks_changed.connect(self._refresh_soon)
        document.demonstration_changed.connect(self.refresh)
        themes().changed.connect(self.list.viewport().update)
        self._show_reach()

    def showEvent(self, event: QShowEvent) -> None:
        """Read what there is by now."""
        super().showEvent(event)
        self.refresh()

    def hideEvent(self, event: QHideEvent) -> None:
        """Let go of it."""
        super().hideEvent(event)
        self.model.clear()

    def go_to(self, row: int) -> None:
        """Undo or redo until the edit of a row is the latest that stands."""
        if not 0 <= row < len(self.model.rows):
            return
        if self.model.standing(row) == Standing.ABANDONED:
            self.document.say(
                f"'{self.model.rows[row].what}' was undone before a later edit, so redo "
                "cannot bring it back."
            )
            return
        steps = self.model.steps_to(row)
        document, farther = self.document, []
        verb = document.undo if steps < 0 else document.redo
        for _ in range(abs(steps)):
            if not verb():
                return
            if document.reverted is not None and document.reverted.reaches_farther:
                farther.append(document.said_here)
        if farther:  # what changed out of sight is not to go by in the middle
            document.say_here(". ".join(farther))

    def _chosen(self, index: QModelIndex) -> None:
        """Go back or forth to the edit that was chosen."""
        if not 0 <= index.row() < len(self.model.rows):
            return
        chosen = self.model.rows[index.row()]
        self.refresh()  # something may just have been painted
        rows = enumerate(self.model.rows)
        self.go_to(next((row for row, edit in rows if edit.id == chosen.id), -1))

    def _refresh_soon(self) -> None:
        """Look again when nothing was painted for a moment: strokes come first."""
        if self.isVisible():
            self._soon.start()

    def refresh(self) -> None:
        """Show what has been done by now."""
        self._soon.stop()
        if self.isVisible():
            self.model.refresh()
            self._show_reach()

    def _show_reach(self) -> None:
        """Say what undo and redo would do."""
        rows = range(len(self.model.rows))
        nothing = "Nothing was edited here yet. Every edit can be undone."
        self._pages.say("" if rows else nothing)
        done = next((row for row in rows if self.model.standing(row) == Standing.DONE), None)
        undone = [row for row in rows if self.model.standing(row) == Standing.UNDONE]
        self.undo.setEnabled(done is not None or self.model.canFetchMore(QModelIndex()))
        self.redo.setEnabled(bool(undone))
        undo, redo = "Undo", "Redo"
        self.undo.setToolTip(undo if done is None else f"{undo}: {self.model.rows[done].what}")
        self.redo.setToolTip(f"{redo}: {self.model.rows[undone[-1]].what}" if undone else redo)
        count = len(undone)
        self._reach.setText(f"{count} undone" if count else "")

    def _button(self, name: str, text: str, verb: Callable[[], object]) -> QToolButton:
        """A button with an icon."""
        button = QToolButton()
        button.setIcon(icon(name))
        button.setAccessibleName(text)
        button.setToolTip(text)
        button.setAutoRaise(True)
        button.clicked.connect(lambda _=False: verb())
        return button


class _Delegate(QStyledItemDelegate):
    """Draws the time and the sentence of an edit, and a line where the present is."""

    PADDING = 6.0

    def __init__(self, model: HistoryModel, parent: QWidget) -> None:
        super().__init__(parent)
        self._model = model

    def sizeHint(self, option: QStyleOptionViewItem, index: Index) -> QSize:
        """One line of text with some room."""
        return QSize(100, round(option.fontMetrics.height() * 1.6))

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        """Draw one edit."""
        row = index.row()
        edit, standing = self._model.rows[row], self._model.standing(row)
        theme = colours()
        box = QRectF(option.rect)
        painter.save()
        ink, aside = QColor(theme.text), QColor(theme.muted)
        if option.state & QStyle.StateFlag.State_Selected:
            painter.fillRect(box, QColor(theme.accent))
            ink = aside = QColor(theme.accent_text)
        elif standing != Standing.DONE:
            ink = aside
        font = QFont(option.font)
        font.setStrikeOut(standing == Standing.ABANDONED)
        font.setItalic(standing != Standing.DONE)
        inner = box.adjusted(self.PADDING, 0, -self.PADDING, 0)
        write_row(painter, inner, (edit.what, clock(edit.time)), (ink, aside), font)
        above = row > 0 and self._model.standing(row - 1) == Standing.UNDONE
        if above and standing == Standing.DONE:
            painter.fillRect(QRectF(box.left(), box.top(), box.width(), 2), QColor(theme.accent))
        painter.restore()
