"""The editor of a merge map: a small table of spellings and what they are taken as."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QCompleter,
    QHeaderView,
    QLineEdit,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTableWidget,
    QTableWidgetItem,
    QWidget,
)

from forcelab.errors import InputError
from forcelab.gui.arranging import column, muted, toned
from forcelab.gui.icons import icon
from forcelab.gui.indexes import Index
from forcelab.gui.review.settings_editors import Editor
from forcelab.gui.review.settings_facts import Facts
from forcelab.gui.review.settings_field import Field
from forcelab.label_map import MergeMap

__all__ = ["MergeEditor"]


class MergeEditor(Editor):
    """Two columns; an empty line at the end waits for more. Delete takes a line away."""

    def __init__(self, field: Field, facts: Facts) -> None:
        super().__init__(field)
        self._spellings = facts.spellings
        self.table = _Table(0, 2)
        self.table.setAccessibleName(field.shown)
        self.table.setHorizontalHeaderLabels(["spelling", "taken as"])
        header = self.table.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        header.setHighlightSections(False)
        self.table.verticalHeader().hide()
        self.table.setTabKeyNavigation(False)
        self.table.setFixedHeight(round(7.5 * self.fontMetrics().height()))
        self.table.setEditTriggers(QAbstractItemView.EditTrigger.AllEditTriggers)
        self.table.setItemDelegate(_Offering(facts.spellings, self.table))
        self.table.itemChanged.connect(self._edited)
        self.hint = muted(
            "Click a line and write what was labelled and what it is to count as; an emptied "
            "line is left out."
        )
        self.remark = toned("warning")
        self.remark.hide()
        column(self, self.table, self.hint, self.remark, spacing=2)
        self.set_value(MergeMap())

    def value(self) -> MergeMap:
        """The map.

        Raises
        ------
        InputError
            If a line names only one of the two, a spelling stands twice, a chain of merges, or
            a merge into no action.
        """
        targets: dict[str, str] = {}
        for source, target in self.lines():
            if source in targets:
                raise InputError(f"'{source}' is merged twice; keep one of the two lines.")
            targets[source] = target
        merge = MergeMap(targets)
        merge.check_targets()
        return merge

    def set_value(self, value: Any) -> None:
        """Show a map."""
        self.blockSignals(True)
        self.table.blockSignals(True)
        self.table.setRowCount(0)
        for source, target in (*value.items(), ("", "")):
            self._append(source, target)
        self.table.blockSignals(False)
        self._flag()
        self.blockSignals(False)

    def lines(self) -> list[tuple[str, str]]:
        """What stands in the lines that are not empty."""
        found = []
        for row in range(self.table.rowCount()):
            source, target = (self._text(row, column) for column in (0, 1))
            if source or target:
                found.append((source, target))
        return found

    def unknown(self) -> tuple[str, ...]:
        """Spellings that nobody labelled; perhaps mistyped."""
        sources = dict.fromkeys(source for source, _ in self.lines() if source)
        return tuple(name for name in sources if name not in self._spellings)

    def _append(self, source: str, target: str) -> None:
        """Add a line."""
        row = self.table.rowCount()
        self.table.insertRow(row)
        self.table.setItem(row, 0, QTableWidgetItem(source))
        self.table.setItem(row, 1, QTableWidgetItem(target))

    def _text(self, row: int, column: int) -> str:
        """What stands in a cell."""
        item = self.table.item(row, column)
        return "" if item is None else item.text().strip()

    def _edited(self, _item: QTableWidgetItem) -> None:
        """Keep one empty line at the end, and tell."""
        self.table.blockSignals(True)
        last = self.table.rowCount() - 1
        if last < 0 or self._text(last, 0) or self._text(last, 1):
            self._append("", "")
        self.table.blockSignals(False)
        self._flag()
        self.changed.emit()

    def _flag(self) -> None:
        """Mark the spellings that nobody labelled."""
        unknown = self.unknown()
        self.table.blockSignals(True)
        for row in range(self.table.rowCount()):
            item = self.table.item(row, 0)
            if item is not None:
                strange = self._text(row, 0) in unknown
                item.setData(Qt.ItemDataRole.DecorationRole, icon("warning") if strange else None)
                item.setToolTip("Nobody labelled this here." if strange else "")
        self.table.blockSignals(False)
        self.remark.setVisible(bool(unknown))
        self.remark.setText("Nobody labelled here: {}".format(", ".join(unknown)))


class _Offering(QStyledItemDelegate):
    """Cells to write in, which offer the spellings that were labelled."""

    def __init__(self, spellings: Iterable[str], parent: QWidget) -> None:
        super().__init__(parent)
        self._spellings = sorted(spellings, key=str.lower)

    def createEditor(self, parent: QWidget, option: QStyleOptionViewItem, index: Index) -> QWidget:
        """A line to write in."""
        line = QLineEdit(parent)
        line.setFrame(False)
        offered = QCompleter(self._spellings, line)
        offered.setCaseSensitivity(Qt.CaseSensitivity.CaseInsensitive)
        offered.setFilterMode(Qt.MatchFlag.MatchContains)
        line.setCompleter(offered)
        return line


class _Table(QTableWidget):
    """A table in which Delete takes lines away."""

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Empty the chosen line, or leave it to the table."""
        if event.key() in (Qt.Key.Key_Delete, Qt.Key.Key_Backspace) and self.currentRow() >= 0:
            if self.currentRow() < self.rowCount() - 1:
                row = self.currentRow()
                self.removeRow(row)
                # Whoever listens to cells that change is told of the one that is there now.
                if (item := self.item(row, 0)) is not None:
                    self.itemChanged.emit(item)
            event.accept()
            return
        super().keyPressEvent(event)
