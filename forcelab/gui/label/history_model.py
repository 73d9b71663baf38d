"""The rows of the history: edits newest first, and what each of them has come to."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date, datetime
from enum import Enum
from typing import Any

from PySide6.QtCore import QAbstractListModel, QObject, Qt

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.indexes import NOWHERE, Index
from forcelab.project import Edit

__all__ = ["HistoryModel", "Standing", "clock", "standings"]

#: How many edits are read at a time, and how many at first when there are only new ones to read.
PAGE, NEW = 200, 4


class Standing(Enum):
    """What an edit has come to."""

    DONE = "done"
    UNDONE = "undone"  # redo can bring it back
    ABANDONED = "abandoned"  # undone, and another edit came after it: no redo reaches it


def standings(newest_first: Sequence[Edit]) -> dict[int, Standing]:
    """What edits have come to, from the latest of a track's edits alone.

    Parameters
    ----------
    newest_first : sequence of Edit
        The track's latest edits without a hole. Whatever happened to them came after them, so
        earlier edits say nothing about it.

    Returns
    -------
    dict of int to Standing
        By number, for those among them that are neither an undo nor a redo.
    """
    found: dict[int, Standing] = {}
    redone: set[int] = set()  # undos that were taken back
    replaced: set[int] = set()  # edits in whose place another one is: a run of them is one row
    fresh = False  # whether an edit came later that left the undos before it behind
    for newer, edit in zip((None, *newest_first), newest_first, strict=False):
        if edit.kind == "undo" and newer and newer.kind == "paint" and newer.time == edit.time:
            replaced.add(edit.reverts or 0)
        if edit.kind == "redo":
            redone.add(edit.reverts or 0)
        elif edit.kind == "undo":
            if edit.id not in redone:
                found.setdefault(
                    edit.reverts or 0, Standing.ABANDONED if fresh else Standing.UNDONE
                )
        else:
            found.setdefault(edit.id, Standing.DONE)
            fresh = True
    return {edit.id: found[edit.id] for edit in newest_first if edit.id in found.keys() - replaced}


class HistoryModel(QAbstractListModel):
    """A row for every edit of the coder's track; undo and redo show in the rows they concern.

    A long history is read by pages, as one scrolls down.

    Attributes
    ----------
    rows : list of Edit
        What has been read, newest first.
    """

    def __init__(self, document: Document, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.document = document
        self.rows: list[Edit] = []
        self._edits: list[Edit] = []  # newest first, undo and redo among them
        self._standings: dict[int, Standing] = {}
        self._track = ("", "")
        self._complete = False

    def refresh(self) -> None:
        """Read what is new."""
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
        self._sort_out()
        # What redo can bring back lies between the last page and the latest edit that stands.
        while not self._complete and Standing.DONE not in self._standings.values():
            self._keep_older(self._page(self._edits[-1].id))
        self.endResetModel()

    def clear(self) -> None:
        """Show nothing."""
        self.beginResetModel()
        self.rows, self._edits, self._standings, self._complete = [], [], {}, False
        self.endResetModel()

    def standing(self, row: int) -> Standing:
        """What the edit of a row has come to."""
        return self._standings[self.rows[row].id]

    def steps_to(self, row: int) -> int:
        """How many undos (negative) or redos make the edit of a row the latest that stands."""
        if self.standing(row) == Standing.DONE:
            return -sum(self.standing(newer) == Standing.DONE for newer in range(row))
        if self.standing(row) == Standing.UNDONE:
            older = range(row, len(self.rows))
            return sum(self.standing(at) == Standing.UNDONE for at in older)
        return 0

    # What Qt asks

    def canFetchMore(self, parent: Index) -> bool:
        """Whether there are older edits."""
        return not parent.isValid() and bool(self._edits) and not self._complete

    def fetchMore(self, parent: Index) -> None:
        """Read older edits."""
        if not self.canFetchMore(parent):
            return
        page = self._page(self._edits[-1].id)
        before = len(self.rows)
        more = len(standings([*self._edits, *page])) - before
        if more:
            self.beginInsertRows(NOWHERE, before, before + more - 1)
        self._keep_older(page)
        if more:
            self.endInsertRows()

    def rowCount(self, parent: Index = NOWHERE) -> int:
        """How many edits have been read."""
        return 0 if parent.isValid() else len(self.rows)

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """The sentence of an edit; when and by what it came as its tooltip."""
        if not index.isValid() or index.row() >= len(self.rows):
            return None
        edit, standing = self.rows[index.row()], self.standing(index.row())
        if role == Qt.ItemDataRole.DisplayRole:
            return edit.what
        if role == Qt.ItemDataRole.ToolTipRole:
            when = f"{edit.time.astimezone():%Y-%m-%d %H:%M:%S}"
            return f"{edit.what}\n{when}" + (f"\n{_fate(standing)}" if _fate(standing) else "")
        if role == Qt.ItemDataRole.AccessibleTextRole:
            return ", ".join(filter(None, (clock(edit.time), edit.what, _fate(standing))))
        return None

    # Inside

    def _page(self, before: int | None, latest: int | None = None) -> list[Edit]:
        """The latest edits before one, newest first."""
        document = self.document
        if document.project is None or not document.id:
            return []
        try:
            edits = document.project.history(
                document.id, document.author, latest=latest or PAGE, before=before
            )
        except ForcelabError as error:
            document.say(str(error), True)
            return []
        return list(reversed(edits))

    def _keep_older(self, page: list[Edit]) -> None:
        """Add a page to what has been read."""
        self._complete = len(page) < PAGE
        self._edits += page
        self._sort_out()

    def _sort_out(self) -> None:
        """Tell edits from undos and redos, and what has become of them."""
        self._standings = standings(self._edits)
        self.rows = [edit for edit in self._edits if edit.id in self._standings]


def clock(time: datetime) -> str:
    """The time of day, with the date where that is not today."""
    here = time.astimezone()
    if here.date() == date.today():
        return f"{here:%H:%M:%S}"
    return f"{here:%Y-%m-%d %H:%M}"


def _fate(standing: Standing) -> str:
    """What has become of an edit, in words."""
    return {
        Standing.DONE: "",
        Standing.UNDONE: "undone; redo brings it back",
        Standing.ABANDONED: "undone, and something else was edited after that",
    }[standing]
