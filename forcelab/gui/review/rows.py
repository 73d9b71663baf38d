"""Tables of texts: a model that holds them, and a view of whole rows that Enter and clicks open."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from PySide6.QtCore import QAbstractTableModel, QObject, Qt
from PySide6.QtGui import (
    QBrush,
    QColor,
    QFocusEvent,
    QFont,
    QFontMetrics,
    QGuiApplication,
    QKeyEvent,
)
from PySide6.QtWidgets import QHeaderView, QTableView

from forcelab.gui.arranging import whole_rows
from forcelab.gui.indexes import NOWHERE, Index
from forcelab.gui.review.moving import ENTER
from forcelab.gui.theme import themes

__all__ = ["Column", "Row", "TextModel", "TextRows", "as_tsv", "copy_text"]

_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter

#: Views ask for these thousands of times for one page: as plain numbers they compare fast.
_DISPLAY, _ALIGNMENT, _TIP, _COLOUR, _FONT = map(
    int,
    (
        Qt.ItemDataRole.DisplayRole,
        Qt.ItemDataRole.TextAlignmentRole,
        Qt.ItemDataRole.ToolTipRole,
        Qt.ItemDataRole.ForegroundRole,
        Qt.ItemDataRole.FontRole,
    ),
)
_ASKED = frozenset({_DISPLAY, _ALIGNMENT, _TIP, _COLOUR, _FONT})

#: Of a column's texts only so many of the longest are measured; what is left free beside them.
LONGEST, ROOM = 3, 8


@dataclass(frozen=True, slots=True)
class Column:
    """A column's name, what explains it, and whether it holds numbers, which stand at the right.

    Numbers of a column have equally many decimals: their points stand below one another.
    """

    name: str
    tip: str = ""
    number: bool = True


@dataclass(frozen=True, slots=True)
class Row:
    """A row: its name in the header, if rows have one; its cells; and their colours, if any."""

    cells: tuple[str, ...]
    name: str = ""
    tip: str = ""
    colours: tuple[str | None, ...] = ()
    bold: bool = False


class TextModel(QAbstractTableModel):
    """Rows of texts."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.columns: tuple[Column, ...] = ()
        self.rows: tuple[Row, ...] = ()

    def show(self, columns: Sequence[Column], rows: Sequence[Row]) -> None:
        """Hold these from now on."""
        self.beginResetModel()
        self.columns, self.rows = tuple(columns), tuple(rows)
        self.endResetModel()

    def retell(self, rows: Sequence[Row]) -> None:
        """Hold other texts in as many rows; the row that is chosen stays so."""
        self.rows = tuple(rows)
        if self.rows:
            last = self.index(len(self.rows) - 1, len(self.columns) - 1)
            self.dataChanged.emit(self.index(0, 0), last)

    def as_tsv(self) -> str:
        """What is held, with names of columns and of rows that have any, for spreadsheets."""
        named = any(row.name for row in self.rows)
        lines = [["", *(column.name for column in self.columns)]]
        lines += [[row.name, *row.cells] for row in self.rows]
        return as_tsv(lines if named else [line[1:] for line in lines])

    def rowCount(self, parent: Index = NOWHERE) -> int:
        """How many rows there are."""
        return 0 if parent.isValid() else len(self.rows)

    def columnCount(self, parent: Index = NOWHERE) -> int:
        """How many columns there are."""
        return 0 if parent.isValid() else len(self.columns)

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """What a cell shows."""
        row, column = self.rows[index.row()], index.column()
        if role == _DISPLAY:
            return row.cells[column]
        if role == _ALIGNMENT:
            return _RIGHT if self.columns[column].number else _LEFT
        if role == _TIP:
            return row.tip or self.columns[column].tip or row.cells[column]  # which may be cut
        if role == _COLOUR and column < len(row.colours):
            colour = row.colours[column]
            return None if colour is None else QBrush(QColor(colour))
        if role == _FONT and row.bold:
            font = QGuiApplication.font()
            font.setBold(True)
            return font
        return None

    def headerData(
        self,
        section: int,
        orientation: Qt.Orientation,
        role: int = Qt.ItemDataRole.DisplayRole,
    ) -> Any:
        """Names of columns and rows, and what explains them."""
        if role not in _ASKED:
            return None
        across = orientation == Qt.Orientation.Horizontal
        if section >= len(self.columns if across else self.rows):
            return None
        if role == _DISPLAY:
            return self.columns[section].name if across else self.rows[section].name
        if role == _TIP:
            named = self.columns[section] if across else self.rows[section]
            return named.tip or named.name or None
        if role == _ALIGNMENT:
            return _RIGHT if across and self.columns[section].number else _LEFT
        return None


class TextRows(QTableView):
    """A view of whole rows; letters and digits are left to the window."""

    def __init__(self, model: TextModel) -> None:
        super().__init__()
        self._model = model
        self.setModel(model)
        whole_rows(self)
        self.horizontalHeader().setMinimumSectionSize(28)
        themes().changed.connect(self.viewport().update)

    def fit_columns(self, stretched: int | None = None) -> None:
        """Make columns as wide as their longest texts; one may get the room that is left.

        Qt would measure every cell by its style: seconds for 200 rows.

        Parameters
        ----------
        stretched : int, optional
            The column that gets what the others leave.
        """
        model, header = self._model, self.horizontalHeader()
        bold = QFont(self.font())
        bold.setBold(True)
        measure = QFontMetrics(bold).horizontalAdvance
        modes = QHeaderView.ResizeMode
        for number, column in enumerate(model.columns):
            texts = [*column.name.split("\n"), *(row.cells[number] for row in model.rows)]
            longest = sorted(texts, key=len)[-LONGEST:]
            header.setSectionResizeMode(number, modes.Interactive)
            header.resizeSection(number, max(map(measure, longest)) + 2 * ROOM)
        if stretched is not None:
            header.setSectionResizeMode(stretched, modes.Stretch)

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Who comes by keyboard begins at the first row."""
        by_mouse = event.reason() == Qt.FocusReason.MouseFocusReason
        if not by_mouse and not self.currentIndex().isValid():
            self.selectRow(0)
        super().focusInEvent(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Enter opens the row, as a click does; plain characters are not searched for."""
        if event.key() in ENTER:
            if self.currentIndex().isValid():
                self.clicked.emit(self.currentIndex())
        elif event.text() and event.text().isprintable():
            event.ignore()
        else:
            super().keyPressEvent(event)


def as_tsv(lines: Sequence[Sequence[str]]) -> str:
    """Lines of cells with tabs between them, as spreadsheets take them."""
    return "".join("\t".join(" ".join(cell.split()) for cell in cells) + "\n" for cells in lines)


def copy_text(text: str) -> None:
    """Put a text on the clipboard."""
    QGuiApplication.clipboard().setText(text)
