"""The list of demonstrations for Qt's views: tasks, and below each its demonstrations."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from typing import Any

from PySide6.QtCore import (
    QAbstractItemModel,
    QModelIndex,
    QObject,
    Qt,
)

from forcelab.gui.indexes import NOWHERE, Index
from forcelab.gui.listing_rows import Group, Row, percent

__all__ = ["ROW", "ListingModel"]

#: The role under which a :class:`Row` or :class:`Group` itself is asked for.
ROW = Qt.ItemDataRole.UserRole

#: What an index of a task holds; that of a demonstration holds its task's place and one more.
_TASK = 0


class ListingModel(QAbstractItemModel):
    """Groups of rows as a tree of two levels and one column.

    Attributes
    ----------
    groups : tuple of Group
        What is shown.
    opened : str
        Id of the demonstration that is open; ``""`` without one.
    """

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.groups: tuple[Group, ...] = ()
        self.opened = ""
        self._places: dict[str, tuple[int, int]] = {}

    def show(self, groups: tuple[Group, ...]) -> bool:
        """Show these groups; gives whether others than before are there, and not only news."""
        if _shape(groups) == _shape(self.groups):
            old, self.groups = self.groups, groups
            for g, (before, after) in enumerate(zip(old, groups, strict=True)):
                if before != after:
                    self._tell_changes(g, before, after)
            return False
        self.beginResetModel()
        self.groups = groups
        self._places = {
            row.info.id: (g, r)
            for g, group in enumerate(groups)
            for r, row in enumerate(group.rows)
        }
        self.endResetModel()
        return True

    def set_opened(self, id_: str) -> None:
        """Mark a demonstration as open."""
        old, self.opened = self.opened, id_
        for index in (self.index_of(old), self.index_of(id_)):
            if index.isValid():
                self.dataChanged.emit(index, index)

    def index_of(self, id_: str) -> QModelIndex:
        """Where a demonstration is; invalid where it is not shown."""
        if id_ not in self._places:
            return NOWHERE
        g, r = self._places[id_]
        return self.createIndex(r, 0, g + 1)

    def at(self, index: Index) -> Row | Group | None:
        """What stands there."""
        if not index.isValid():
            return None
        inside = int(index.internalId())
        if inside == _TASK:
            return self.groups[index.row()]
        return self.groups[inside - 1].rows[index.row()]

    def ids(self) -> list[str]:
        """The demonstrations that are shown, in order."""
        return list(self._places)

    @property
    def rows(self) -> Iterator[Row]:
        """What is told of them, in the same order."""
        return (row for group in self.groups for row in group.rows)

    # What Qt asks

    def index(self, row: int, column: int, parent: Index = NOWHERE) -> QModelIndex:
        """The index of a row below a parent."""
        if column != 0 or not 0 <= row < self.rowCount(parent):
            return NOWHERE
        return self.createIndex(row, column, parent.row() + 1 if parent.isValid() else _TASK)

    def parent(self, index: Index = NOWHERE) -> QModelIndex:  # type: ignore[override]
        """The index of the task of a demonstration."""
        inside = int(index.internalId()) if index.isValid() else _TASK
        return NOWHERE if inside == _TASK else self.createIndex(inside - 1, 0, _TASK)

    def rowCount(self, parent: Index = NOWHERE) -> int:
        """How many tasks there are, or demonstrations of one."""
        if not parent.isValid():
            return len(self.groups)
        return len(self.groups[parent.row()].rows) if parent.internalId() == _TASK else 0

    def columnCount(self, parent: Index = NOWHERE) -> int:
        """One column."""
        return 1

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """What is shown, told and read aloud of a row."""
        item = self.at(index)
        if item is None:
            return None
        if role == ROW:
            return item
        if role == Qt.ItemDataRole.DisplayRole:
            return item.info.name if isinstance(item, Row) else item.task
        if role == Qt.ItemDataRole.AccessibleTextRole:
            return "; ".join(_facts(item, open_=self._is_open(item)))
        if role == Qt.ItemDataRole.ToolTipRole:
            lines = [escape(line) for line in _facts(item, open_=self._is_open(item))]
            lines += [escape(line) for line in _details(item)]
            return f"<p style='white-space: pre-wrap'><b>{lines[0]}</b><br/>" + (
                "<br/>".join(lines[1:]) + "</p>"
            )
        return None

    def _is_open(self, item: Row | Group) -> bool:
        """Whether it is the demonstration that is open."""
        return isinstance(item, Row) and item.info.id == self.opened

    def _tell_changes(self, g: int, before: Group, after: Group) -> None:
        """Tell which rows of a group have news."""
        for r, (old, new) in enumerate(zip(before.rows, after.rows, strict=True)):
            if old != new:
                index = self.createIndex(r, 0, g + 1)
                self.dataChanged.emit(index, index)
        index = self.createIndex(g, 0, _TASK)
        self.dataChanged.emit(index, index)


def _shape(groups: tuple[Group, ...]) -> list[tuple[str, list[str]]]:
    """Which demonstrations are shown, and where."""
    return [(group.task, [row.info.id for row in group.rows]) for group in groups]


def _facts(item: Row | Group, open_: bool) -> list[str]:
    """What a row shows, in words."""
    if isinstance(item, Group):
        facts = [
            item.task or "No task",
            f"{item.finished} of {len(item.rows)} done by you",
        ]
        if item.labelled:
            facts.append(f"{item.labelled} started")
        return facts
    facts = [item.info.name]
    if open_:
        facts.append("Open now")
    facts += [f"Note by {note.author}: {note.text}" for note in item.notes]
    facts.append(f"Labelled by you: {percent(item.share)} %")
    facts += [f"Labelled by {name}: {percent(share)} %" for name, share in item.others]
    if item.blind:
        facts.append("Assigned to you, blind: the others' labels are hidden until it is done")
    elif item.done:
        facts.append("Done")
    elif item.assignment is not None:
        facts.append("Assigned to you")
    for one in item.assigned_to:
        sentence = "Assigned to {0}" if one.done is None else "Done by {0}"
        facts.append(sentence.format(one.author))
    facts.append("With video" if item.info.has_video else "No video")
    return facts


def _details(item: Row | Group) -> list[str]:
    """What only the tool tip tells."""
    if isinstance(item, Group):
        return []
    info = item.info
    details = [f"{info.duration:.2f} s, {info.rate:.6g} Hz, {len(info.channels)} channels"]
    if info.source:
        details.append(f"From {info.source}")
    return [*details, f"Id {info.id}"]
