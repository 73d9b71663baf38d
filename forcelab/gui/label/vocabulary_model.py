"""The rows of the vocabulary: the actions of the task and how much of the track each has."""

from __future__ import annotations

from functools import cache
from typing import Any

from PySide6.QtCore import QAbstractListModel, QObject, Qt

from forcelab.errors import InputError
from forcelab.glossary import Entry, glossary
from forcelab.gui.document import Document
from forcelab.gui.indexes import NOWHERE, Index
from forcelab.gui.label.track_spans import spans_of

__all__ = ["VocabularyModel", "entries"]


class VocabularyModel(QAbstractListModel):
    """A row for every action of the open demonstration's task.

    Attributes
    ----------
    counts : dict of str to (int, float)
        By action, how many of the coder's segments have it and how many seconds they cover.
    """

    def __init__(self, document: Document, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.document = document
        self.counts: dict[str, tuple[int, float]] = {}
        self._actions = document.vocabulary.actions

    def refresh(self) -> None:
        """Show the vocabulary as it is now; rows that stay keep selection and place."""
        actions = self.document.vocabulary.actions
        kept = min(len(actions), len(self._actions))
        if len(actions) > kept:
            self.beginInsertRows(NOWHERE, kept, len(actions) - 1)
            self._actions = actions
            self.endInsertRows()
        elif len(self._actions) > kept:
            self.beginRemoveRows(NOWHERE, kept, len(self._actions) - 1)
            self._actions = actions
            self.endRemoveRows()
        self._actions = actions
        self.redraw()

    def count(self) -> None:
        """Count the coder's segments."""
        self.counts = spans_of(self.document.segments).totals()
        self.redraw()

    def redraw(self) -> None:
        """Have every row drawn again."""
        if self._actions:
            self.dataChanged.emit(self.index(0), self.index(len(self._actions) - 1))

    def name(self, row: int) -> str | None:
        """The action of a row."""
        return self._actions[row].name if 0 <= row < len(self._actions) else None

    def rowCount(self, parent: Index = NOWHERE) -> int:
        """How many actions there are."""
        return 0 if parent.isValid() else len(self._actions)

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """An action's name, and all about it as its tooltip."""
        if not index.isValid() or index.row() >= len(self._actions):
            return None
        action = self._actions[index.row()]
        if role == Qt.ItemDataRole.DisplayRole:
            return action.name
        if role == Qt.ItemDataRole.ToolTipRole:
            return _tooltip(action.name)
        if role == Qt.ItemDataRole.AccessibleTextRole:
            number, seconds = self.counts.get(action.name, (0, 0.0))
            brush = ", brush" if action.name == self.document.action else ""
            return (
                "{}, key {}, {} segments, {:.1f} seconds".format(
                    action.name, action.key or "none", number, seconds
                )
                + brush
            )
        return None


@cache
def entries() -> dict[str, Entry]:
    """The glossary by action; empty where its file is missing or broken, which others tell."""
    try:
        return {entry.action: entry for entry in glossary()}
    except InputError:
        return {}


def _tooltip(name: str) -> str:
    """What the glossary says of an action; at least its name, which may be cut on screen."""
    entry = entries().get(name)
    if entry is None:
        return name
    starts, ends, unlike = (
        "Starts:",
        "Ends:",
        "Beware:",
    )
    return (
        f"<p><b>{entry.action}</b> {entry.sentence}</p>"
        f"<p><b>{starts}</b> {entry.starts}<br><b>{ends}</b> {entry.ends}</p>"
        f"<p><b>{unlike}</b> {entry.unlike}</p>"
    )
