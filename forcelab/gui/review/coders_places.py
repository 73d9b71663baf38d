"""A list of places where coders differ; a click shows the place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from PySide6.QtCore import (
    QAbstractTableModel,
    QObject,
    QSize,
    Qt,
    Signal,
)
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QHeaderView, QTableView, QWidget

from forcelab.gui.arranging import whole_rows
from forcelab.gui.indexes import Index
from forcelab.review.places import Place

__all__ = ["PlaceRow", "PlaceTable"]

#: Columns whose texts are numbers.
_NUMBERS = (1, 2)


@dataclass(frozen=True, slots=True)
class PlaceRow:
    """A place, what kind of thing is there, and whether it is done with."""

    place: Place
    kind: str = ""
    done: bool = False


class _Model(QAbstractTableModel):
    """Where, how long, what each says, and what kind of difference it is."""

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.rows: tuple[PlaceRow, ...] = ()
        self.names: Mapping[str, str] = {}
        self.heads: tuple[str, ...] = ("", "", "")

    def put(
        self, rows: Sequence[PlaceRow], names: Mapping[str, str], heads: tuple[str, ...]
    ) -> None:
        """Show other places."""
        self.beginResetModel()
        self.rows, self.names, self.heads = tuple(rows), names, heads
        self.endResetModel()

    def rowCount(self, parent: Index | None = None) -> int:
        """How many places."""
        return 0 if parent is not None and parent.isValid() else len(self.rows)

    def columnCount(self, parent: Index | None = None) -> int:
        """Demonstration, time, length, both sayings, kind."""
        return 0 if parent is not None and parent.isValid() else 6

    def headerData(
        self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole
    ) -> Any:
        """What stands in a column."""
        if orientation == Qt.Orientation.Horizontal and role == Qt.ItemDataRole.TextAlignmentRole:
            return _side(section)
        if orientation != Qt.Orientation.Horizontal or role not in (
            Qt.ItemDataRole.DisplayRole,
            Qt.ItemDataRole.ToolTipRole,
        ):
            return None
        return (
            self.tr("Demonstration"),
            self.tr("At, s"),
            self.tr("Length, s"),
            *self.heads,
        )[section]

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """The text of a cell."""
        if role == Qt.ItemDataRole.TextAlignmentRole:
            return _side(index.column())
        if role not in (Qt.ItemDataRole.DisplayRole, Qt.ItemDataRole.ToolTipRole):
            return None
        row = self.rows[index.row()]
        place = row.place
        return (
            self.names.get(place.demonstration, place.demonstration),
            f"{'✓ ' if row.done else ''}{place.start:.2f}",
            f"{place.duration:.3f}",
            place.human or "–",
            place.predicted or "–",
            row.kind,
        )[index.column()]


def _side(column: int) -> Qt.AlignmentFlag:
    """How a column is aligned: numbers at the right."""
    side = Qt.AlignmentFlag
    return side.AlignVCenter | (side.AlignRight if column in _NUMBERS else side.AlignLeft)


class PlaceTable(QTableView):
    """Places in rows; a click, or Enter, shows one.

    Parameters
    ----------
    title : str
        What is listed, for screen readers.
    parent : QWidget, optional

    Signals
    -------
    wanted(int)
        The row that is to be shown.
    """

    wanted = Signal(int)

    def __init__(self, title: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.rows = _Model(self)
        self.setModel(self.rows)
        self.setAccessibleName(title)
        whole_rows(self)
        self.setTextElideMode(Qt.TextElideMode.ElideMiddle)
        header = self.horizontalHeader()
        header.setStretchLastSection(True)
        header.setTextElideMode(Qt.TextElideMode.ElideMiddle)
        header.setSectionResizeMode(QHeaderView.ResizeMode.Interactive)
        digit = self.fontMetrics().horizontalAdvance("0")
        for column, digits in enumerate((15, 8, 10, 10, 10)):
            header.resizeSection(column, digits * digit)
        self.clicked.connect(lambda index: self.wanted.emit(index.row()))

    def put(
        self, rows: Sequence[PlaceRow], names: Mapping[str, str], heads: tuple[str, str, str]
    ) -> None:
        """Show other places.

        Parameters
        ----------
        rows : sequence of PlaceRow
        names : mapping of str to str
            Of the demonstrations, by id.
        heads : tuple of str
            Over the two sayings and the kind.
        """
        self.rows.put(rows, names, heads)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Enter is a click; keys that paint and play are left to the window."""
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and self.currentIndex().isValid():
            self.wanted.emit(self.currentIndex().row())
        elif event.text().isprintable() and event.text():
            event.ignore()
        else:
            super().keyPressEvent(event)

    def sizeHint(self) -> QSize:
        """Room for some rows."""
        return QSize(320, 9 * self.verticalHeader().defaultSectionSize())

    def minimumSizeHint(self) -> QSize:
        """Room for the header and three rows."""
        return QSize(160, round(4.5 * self.verticalHeader().defaultSectionSize()))
