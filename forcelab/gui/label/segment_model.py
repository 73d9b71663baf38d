"""The rows of the segment table: some of a track's segments, in some order.

What has changed is told to the view as one run of rows, found by
:func:`forcelab.segment_edits.splice`:
a stroke on a track of 10,000 segments costs one comparison of two tuples.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Mapping
from operator import attrgetter
from typing import Any

from PySide6.QtCore import QAbstractTableModel, QObject, Qt

from forcelab.gui.document import Document
from forcelab.gui.indexes import NOWHERE, Index
from forcelab.gui.label.proposed import origin_words
from forcelab.labels import Segment, Segments
from forcelab.project import Origin
from forcelab.segment_edits import splice

__all__ = ["ACTION", "DURATION", "END", "NUMBER", "START", "SegmentModel"]

#: The columns.
NUMBER, ACTION, START, END, DURATION = range(5)

_SHOWN = Qt.ItemFlag.ItemIsEnabled | Qt.ItemFlag.ItemIsSelectable
_EDITABLE = _SHOWN | Qt.ItemFlag.ItemIsEditable
_start = attrgetter("start")
_ORDERS: dict[int, Callable[[Segment], Any]] = {
    ACTION: lambda segment: (segment.action.casefold(), segment.start),
    DURATION: lambda segment: (segment.end - segment.start, segment.start),
}


class SegmentModel(QAbstractTableModel):
    """Rows for a table of the coder's segments, filtered and sorted.

    Parameters
    ----------
    document : Document
        Whose track is shown, and which carries out what is typed into a cell.

    Attributes
    ----------
    rows : tuple of Segment
        What is shown, from the first row to the last.
    origins : mapping of Segment to Origin
        Those of the track's segments that a model proposed.
    """

    def __init__(self, document: Document, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.document = document
        self.rows: Segments = ()
        self.origins: Mapping[Segment, Origin] = {}
        self._source: Segments = ()
        self._filter = ""
        self._column, self._descending = START, False
        self._current: Segment | None = None

    # What is shown

    def refresh(self) -> None:
        """Show the track as it is now, telling views about the rows that differ only."""
        self._source, self.origins = self.document.segments, self.document.origins()
        self._renew()
        self.follow(self.document.cursor)

    def _renew(self) -> None:
        """Tell views about the rows that come, go or change."""
        rows = self._arranged()
        position, removed, inserted = splice(self.rows, rows)
        common = min(len(removed), len(inserted))
        if common:
            self.rows = rows[: position + common] + self.rows[position + common :]
            last = self.index(position + common - 1, DURATION)
            self.dataChanged.emit(self.index(position, NUMBER), last)
        at = position + common
        if len(removed) > common:
            self.beginRemoveRows(NOWHERE, at, position + len(removed) - 1)
            self.rows = rows
            self.endRemoveRows()
        elif len(inserted) > common:
            self.beginInsertRows(NOWHERE, at, position + len(inserted) - 1)
            self.rows = rows
            self.endInsertRows()
        self.rows = rows

    def clear(self) -> None:
        """Show nothing."""
        self.beginResetModel()
        self.rows, self._source, self._current, self.origins = (), (), None, {}
        self.endResetModel()

    def set_filter(self, text: str) -> None:
        """Show only segments whose action contains this text, in capitals or not."""
        text = text.strip().casefold()
        if text != self._filter:
            self._filter = text
            self._renew()

    def sort(self, column: int, order: Qt.SortOrder = Qt.SortOrder.AscendingOrder) -> None:
        """Put the rows in the order of a column."""
        self._column, self._descending = column, order == Qt.SortOrder.DescendingOrder
        self.beginResetModel()
        self.rows = self._arranged()
        self.endResetModel()

    def follow(self, cursor: float) -> None:
        """Mark the segment under the cursor."""
        index = bisect_right(self._source, cursor, key=_start) - 1
        under = self._source[index] if index >= 0 and cursor < self._source[index].end else None
        if under is not self._current:
            before, self._current = self._current, under
            for segment in (before, under):
                if segment is not None and (row := self.row_of(segment)) is not None:
                    self.dataChanged.emit(self.index(row, NUMBER), self.index(row, DURATION))

    def row_of(self, segment: Segment) -> int | None:
        """Where a segment is shown, if it is."""
        if self._natural:
            row = bisect_left(self.rows, segment.start, key=_start)
            return row if row < len(self.rows) and self.rows[row] == segment else None
        try:
            return self.rows.index(segment)
        except ValueError:
            return None

    def number_of(self, row: int) -> int | None:
        """Which of the document's segments a row shows, from 0; None if it is there no more."""
        if not 0 <= row < len(self.rows):
            return None
        return self.document.index_of(self.rows[row])

    @property
    def _natural(self) -> bool:
        """Whether the rows are in order of time; segments that never overlap also end in it."""
        return self._column in (NUMBER, START, END) and not self._descending

    def _arranged(self) -> Segments:
        """The segments that the filter lets through, in order."""
        rows = self._source
        if self._filter:
            wanted = {
                action
                for action in {segment.action for segment in rows}
                if self._filter in action.casefold()
            }
            rows = tuple(segment for segment in rows if segment.action in wanted)
        if self._column in _ORDERS:
            rows = tuple(sorted(rows, key=_ORDERS[self._column], reverse=self._descending))
        elif self._descending:
            rows = rows[::-1]
        return rows

    # What Qt asks

    def rowCount(self, parent: Index = NOWHERE) -> int:
        """How many segments are shown."""
        return 0 if parent.isValid() else len(self.rows)

    def columnCount(self, parent: Index = NOWHERE) -> int:
        """Number, action, start, end and duration."""
        return 0 if parent.isValid() else 5

    def headerData(
        self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole
    ) -> Any:
        """The names of the columns."""
        if orientation != Qt.Orientation.Horizontal:
            return None
        if role == Qt.ItemDataRole.TextAlignmentRole:
            side = Qt.AlignmentFlag.AlignLeft if section == ACTION else Qt.AlignmentFlag.AlignRight
            return side | Qt.AlignmentFlag.AlignVCenter
        if role == Qt.ItemDataRole.ToolTipRole and section >= START:
            return "In seconds"
        if role == Qt.ItemDataRole.DisplayRole:
            return (
                "#",
                "Action",
                "Start",
                "End",
                "Duration",
            )[section]
        return None

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """What a cell shows."""
        if not index.isValid() or index.row() >= len(self.rows):
            return None
        segment, column = self.rows[index.row()], index.column()
        if role == Qt.ItemDataRole.DisplayRole:
            return self.shown(index.row(), column)
        if role == Qt.ItemDataRole.EditRole:
            return segment.action if column == ACTION else _as_typed(_time(segment, column))
        if role in (Qt.ItemDataRole.ToolTipRole, Qt.ItemDataRole.AccessibleDescriptionRole):
            tip = role == Qt.ItemDataRole.ToolTipRole
            return self._more(segment, with_action=tip and column == ACTION)
        return None

    def _more(self, segment: Segment, with_action: bool) -> str | None:
        """Who proposed a segment, below the action where that may be cut off in its cell."""
        action = segment.action if with_action else ""
        proposed = origin_words(self.origins.get(segment))
        return "\n".join(filter(None, (action, proposed))) or None

    def under_cursor(self, segment: Segment) -> bool:
        """Whether a segment lies under the cursor."""
        return segment is self._current

    def shown(self, row: int, column: int) -> str:
        """The text of a cell."""
        if column == NUMBER:
            number = self.number_of(row)
            return "" if number is None else str(number + 1)
        segment = self.rows[row]
        return segment.action if column == ACTION else f"{_time(segment, column):.3f}"

    def flags(self, index: Index) -> Qt.ItemFlag:
        """Everything but the number can be edited."""
        return _SHOWN if index.column() == NUMBER else _EDITABLE

    def setData(self, index: Index, value: Any, role: int = Qt.ItemDataRole.EditRole) -> bool:
        """Carry out what was typed; what cannot be is told in one sentence."""
        number = self.number_of(index.row())
        typed = str(value).strip()
        if role != Qt.ItemDataRole.EditRole or number is None:
            return False
        if typed == self.data(index, role):
            return False
        if index.column() == ACTION:
            return self.document.relabel(number, typed)
        try:
            time = float(typed.removesuffix("s"))
        except ValueError:
            self.document.say(f"'{typed}' is no time in seconds; type a number such as 1.25.", True)
            return False
        return self._moved(number, index.column(), time)

    def _moved(self, number: int, column: int, time: float) -> bool:
        """Give a segment another start, end or duration, within the demonstration."""
        segment = self.document.segments[number]
        if column == DURATION:
            time += segment.start
        low, high = self.document.bounds
        if not low <= time <= high:
            self.document.say(
                f"{time:.10g} s is outside the demonstration ({low:.3f} s to {high:.3f} s).", True
            )
            return False
        return self.document.move_edge(number, "start" if column == START else "end", time)


def _as_typed(time: float) -> str:
    """A time as one would type it: to the microsecond, without zeros at the end."""
    return f"{time:.6f}".rstrip("0").rstrip(".")


def _time(segment: Segment, column: int) -> float:
    """What a column shows of a segment, in seconds."""
    if column == START:
        return segment.start
    return segment.end if column == END else segment.end - segment.start
