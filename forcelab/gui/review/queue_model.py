"""The queue for Qt's views: sections, and in each what is to be judged or was judged."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args

from PySide6.QtCore import (
    QAbstractItemModel,
    QCoreApplication,
    QModelIndex,
    QObject,
    QPersistentModelIndex,
    Qt,
)

from forcelab.project import StoredVerdict
from forcelab.review.differences import Difference
from forcelab.review.places import Place
from forcelab.review.queue import Queue

translate = QCoreApplication.translate

__all__ = ["Item", "QueueModel", "Section", "action_name", "place_of", "verdict_name"]

Index = QModelIndex | QPersistentModelIndex
Kind = Literal["suspected", "actions", "missed", "boundaries", "invented", "judged"]

#: What an index of a section holds; that of an item holds its section's place and one more.
_SECTION = 0


@dataclass(frozen=True, slots=True)
class Item:
    """A difference, or a verdict on one, with the name of its demonstration."""

    about: Difference | StoredVerdict
    name: str

    @property
    def place(self) -> Place:
        """Where it is."""
        return place_of(self.about)

    @property
    def judged(self) -> bool:
        """Whether somebody has judged it."""
        return isinstance(self.about, StoredVerdict)


@dataclass(frozen=True, slots=True)
class Section:
    """One part of the queue; `total` counts also what the filter leaves out."""

    kind: Kind
    items: tuple[Item, ...]
    total: int

    @property
    def title(self) -> str:
        """What stands above it."""
        return {
            "suspected": translate("forcelab", "Suspected coding errors"),
            "actions": translate("forcelab", "Wrong actions"),
            "missed": translate("forcelab", "Missed by the model"),
            "boundaries": translate("forcelab", "Boundaries only"),
            "invented": translate("forcelab", "Labelled by the model only"),
            "judged": translate("forcelab", "Judged"),
        }[self.kind]

    @property
    def explained(self) -> str:
        """What it holds, in a sentence."""
        return {
            "suspected": translate(
                "forcelab",
                "A recogniser that has not seen them contradicts, where it is usually right.",
            ),
            "actions": translate("forcelab", "Both see an action, but not the same one."),
            "missed": translate("forcelab", "Labelled, and the model sees nothing."),
            "boundaries": translate(
                "forcelab", "Both see the same actions; only the edge between them differs."
            ),
            "invented": translate(
                "forcelab",
                "Unlabelled time, which is never scored, where the model sees an action.",
            ),
            "judged": translate("forcelab", "What somebody has judged, the latest first."),
        }[self.kind]


def place_of(about: Difference | StoredVerdict) -> Place:
    """The place of a difference, or that a verdict is on."""
    if isinstance(about, StoredVerdict):
        return Place(about.demonstration, about.start, about.end, about.human, about.predicted)
    return about


def action_name(action: str | None) -> str:
    """An action as it is written in a row."""
    return translate("forcelab", "unlabelled") if action is None else action


def verdict_name(verdict: str) -> str:
    """A verdict as it is written in a row."""
    return {
        "human": translate("forcelab", "human right"),
        "model": translate("forcelab", "model right"),
        "ambiguous": translate("forcelab", "ambiguous"),
    }[verdict]


def sections_of(queue: Queue, names: Mapping[str, str], sought: str = "") -> tuple[Section, ...]:
    """The sections that hold anything, with the items that a filter lets through.

    Parameters
    ----------
    queue : Queue
    names : mapping of str to str
        The demonstrations' names by their ids.
    sought : str
        Part of an action or of a demonstration's name, in capitals or not.
    """
    sought = sought.strip().casefold()
    found = []
    for kind in get_args(Kind):
        everything = [Item(a, names.get(a.demonstration, "")) for a in getattr(queue, kind)]
        shown = tuple(item for item in everything if sought in _searched(item))
        if shown:
            found.append(Section(kind, shown, len(everything)))
    return tuple(found)


def _searched(item: Item) -> str:
    """What a filter looks at."""
    place = item.place
    words = (action_name(place.human), action_name(place.predicted), item.name)
    return "\n".join(words).casefold()


class QueueModel(QAbstractItemModel):
    """Sections of items as a tree of two levels and one column.

    Attributes
    ----------
    sections : tuple of Section
        What is shown; empty ones are left away.
    """

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.sections: tuple[Section, ...] = ()

    def show(self, queue: Queue, names: Mapping[str, str], sought: str = "") -> bool:
        """Show a queue; gives whether anything changed."""
        sections = sections_of(queue, names, sought)
        if sections == self.sections:
            return False
        self.beginResetModel()
        self.sections = sections
        self.endResetModel()
        return True

    def at(self, index: Index) -> Item | Section | None:
        """What stands there."""
        if not index.isValid():
            return None
        inside = int(index.internalId())
        if inside == _SECTION:
            return self.sections[index.row()]
        return self.sections[inside - 1].items[index.row()]

    def index_of(self, place: Place) -> QModelIndex:
        """Where a place stands, the sections in order; invalid where it does not."""
        wanted = (place.demonstration, place.start, place.end)
        for index, item in self.items():
            about = item.about
            if (about.demonstration, about.start, about.end) == wanted:
                return index
        return QModelIndex()

    def items(self) -> Iterator[tuple[QModelIndex, Item]]:
        """All items in order."""
        for s, section in enumerate(self.sections):
            for row, item in enumerate(section.items):
                yield self.createIndex(row, 0, s + 1), item

    # What Qt asks

    def index(self, row: int, column: int, parent: Index = QModelIndex()) -> QModelIndex:  # noqa: B008
        """The index of a row below a parent."""
        if column != 0 or not 0 <= row < self.rowCount(parent):
            return QModelIndex()
        return self.createIndex(row, column, parent.row() + 1 if parent.isValid() else _SECTION)

    def parent(self, index: Index = QModelIndex()) -> QModelIndex:  # type: ignore[override]  # noqa: B008
        """The index of the section of an item."""
        inside = int(index.internalId()) if index.isValid() else _SECTION
        if inside == _SECTION:
            return QModelIndex()
        return self.createIndex(inside - 1, 0, _SECTION)

    def rowCount(self, parent: Index = QModelIndex()) -> int:  # noqa: B008
        """How many sections there are, or items of one."""
        if not parent.isValid():
            return len(self.sections)
        inside = parent.internalId() == _SECTION
        return len(self.sections[parent.row()].items) if inside else 0

    def columnCount(self, parent: Index = QModelIndex()) -> int:  # noqa: B008
        """One column."""
        return 1

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """What is shown, told and read aloud of a row."""
        item = self.at(index)
        if item is None:
            return None
        if isinstance(item, Section):
            told = {
                Qt.ItemDataRole.DisplayRole: item.title,
                Qt.ItemDataRole.AccessibleTextRole: f"{item.title}: {item.total}",
                Qt.ItemDataRole.ToolTipRole: item.explained,
            }
            return told.get(Qt.ItemDataRole(role))
        if role in (Qt.ItemDataRole.DisplayRole, Qt.ItemDataRole.AccessibleTextRole):
            return "; ".join(facts(item))
        if role == Qt.ItemDataRole.ToolTipRole:
            return "\n".join(facts(item))
        return None


def facts(item: Item) -> list[str]:
    """What a row shows, in words."""
    place, about = item.place, item.about
    told = [
        translate("forcelab", "Human: {0}").format(action_name(place.human)),
        translate("forcelab", "Model: {0}").format(action_name(place.predicted)),
        translate("forcelab", "{0}, {1:.3f} to {2:.3f} s").format(
            item.name, place.start, place.end
        ),
    ]
    if isinstance(about, StoredVerdict):
        told.append(
            translate("forcelab", "Judged by {0}: {1}").format(
                about.author, verdict_name(about.verdict)
            )
        )
        return told
    if about.confidence is not None:
        told.append(
            translate("forcelab", "Confidence of the model: {0:.0f} %").format(
                100 * about.confidence
            )
        )
    if about.suspicion:
        told.append(
            translate("forcelab", "Suspicion of a coding error: {0:.0f} %").format(
                100 * about.suspicion
            )
        )
    return told
