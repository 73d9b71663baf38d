"""The queue for Qt's views: sections, and in each what is to be judged or was judged."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from itertools import accumulate
from typing import Any, Literal, get_args

from PySide6.QtCore import (
    QAbstractListModel,
    QObject,
    Qt,
)

from forcelab.gui.indexes import NOWHERE, Index
from forcelab.gui.review.queue_words import action_name, explained, percentages, verdict_name
from forcelab.project import StoredVerdict
from forcelab.review.differences import Difference, Interval
from forcelab.review.queue import Queue

__all__ = ["Item", "QueueModel", "Section", "place_of"]

Kind = Literal["suspected", "actions", "missed", "boundaries", "invented", "judged"]

#: Sections that are folded at first: many and small, or no mistakes, or done with.
FOLDED = frozenset({"boundaries", "invented", "judged"})


@dataclass(frozen=True, slots=True)
class Item:
    """A difference, or a verdict on one, with the name of its demonstration."""

    about: Difference | StoredVerdict
    name: str

    @property
    def place(self) -> Interval:
        """Where it is."""
        return place_of(self.about)

    @property
    def judged(self) -> bool:
        """Whether somebody has judged it."""
        return isinstance(self.about, StoredVerdict)


@dataclass(frozen=True, slots=True)
class Section:
    """One part of the queue.

    Parameters
    ----------
    kind : str
    listed : tuple of Difference or StoredVerdict
        What the filter lets through; rows are made of it when they are looked at.
    total : int
        How many there are without the filter.
    names : mapping of str to str
        The demonstrations' names by their ids.
    """

    kind: Kind
    listed: tuple[Difference | StoredVerdict, ...]
    total: int
    names: Mapping[str, str]

    def __len__(self) -> int:
        return len(self.listed)

    def item(self, row: int) -> Item:
        """One of its rows."""
        about = self.listed[row]
        return Item(about, self.names.get(about.demonstration, ""))

    @property
    def title(self) -> str:
        """What stands above it."""
        return {
            "suspected": "Suspected coding errors",
            "actions": "Wrong actions",
            "missed": "Missed by the model",
            "boundaries": "Boundaries only",
            "invented": "Labelled by the model only",
            "judged": "Judged",
        }[self.kind]

    @property
    def explained(self) -> str:
        """What it holds, in a sentence."""
        return explained(self.kind)

    @property
    def rated(self) -> str:
        """What the percentages at the right are; empty where there are none."""
        if self.kind == "suspected":
            return "suspicion"
        sure = any(isinstance(d, Difference) and d.confidence is not None for d in self.listed[:1])
        return "confidence" if sure else ""

    @property
    def tip(self) -> str:
        """What it holds, what the percentages are, and in which order it stands."""
        return "\n".join(filter(None, (self.explained, self.rated and percentages(self.kind))))


def place_of(about: Difference | StoredVerdict) -> Interval:
    """The place of a difference, or that a verdict is on."""
    if isinstance(about, StoredVerdict):
        return Interval(about.demonstration, about.start, about.end, about.human, about.predicted)
    return about


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
    fits = _filter(names, sought.strip().casefold())
    found = []
    for kind in get_args(Kind):
        everything = tuple(getattr(queue, kind))
        shown = tuple(filter(fits, everything)) if sought.strip() else everything
        if shown:
            found.append(Section(kind, shown, len(everything), names))
    return tuple(found)


def _filter(names: Mapping[str, str], sought: str) -> Callable[[Difference | StoredVerdict], bool]:
    """What tells whether an action or a demonstration's name holds what is sought."""

    @cache
    def action(name: str | None) -> bool:
        return sought in action_name(name).casefold()

    @cache
    def demonstration(id_: str) -> bool:
        return sought in names.get(id_, "").casefold()

    def fits(about: Difference | StoredVerdict) -> bool:
        return action(about.human) or action(about.predicted) or demonstration(about.demonstration)

    return fits


class QueueModel(QAbstractListModel):
    """Sections one below the other, each a heading and, unless it is folded, its rows.

    Flat, and no row is made before it is looked at: a queue of thousands is there at once.

    Attributes
    ----------
    sections : tuple of Section
        What is shown; empty ones are left away.
    folded : set of str
        The kinds of the sections of which only the heading is shown.
    """

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.sections: tuple[Section, ...] = ()
        self.folded: set[str] = set(FOLDED)
        self._heads: tuple[int, ...] = (0,)  # the rows of the headings, and how many rows there are

    def show(self, queue: Queue, names: Mapping[str, str], sought: str = "") -> bool:
        """Show a queue; gives whether anything changed."""
        sections = sections_of(queue, names, sought)
        if sections == self.sections:
            return False
        self.beginResetModel()
        self.sections = sections
        self._count()
        self.endResetModel()
        return True

    def fold(self, number: int, folded: bool) -> None:
        """Fold a section, or unfold it."""
        section = self.sections[number]
        if folded == (section.kind in self.folded):
            return
        first = self._heads[number] + 1
        if folded:
            self.beginRemoveRows(NOWHERE, first, first + len(section) - 1)
            self.folded.add(section.kind)
            self._count()
            self.endRemoveRows()
        else:
            self.beginInsertRows(NOWHERE, first, first + len(section) - 1)
            self.folded.discard(section.kind)
            self._count()
            self.endInsertRows()

    def _count(self) -> None:
        """Say anew where the headings stand."""
        rows = (1 + (0 if s.kind in self.folded else len(s)) for s in self.sections)
        self._heads = tuple(accumulate(rows, initial=0))

    def where(self, row: int) -> tuple[int, int]:
        """Of which section a row is, and which of its items; -1 for its heading."""
        number = bisect_right(self._heads, row) - 1
        return number, row - self._heads[number] - 1

    def row(self, number: int, item: int = -1) -> int:
        """The row of a section's heading, or of an item of a section that is not folded."""
        return self._heads[number] + 1 + item

    def find(self, place: Interval) -> tuple[int, int] | None:
        """The section and the item that a place is, also in folded sections; None if in none."""
        for number, section in enumerate(self.sections):
            for item, about in enumerate(section.listed):
                if (
                    about.start == place.start
                    and about.end == place.end
                    and about.demonstration == place.demonstration
                ):
                    return number, item
        return None

    def at(self, index: Index) -> Item | Section | None:
        """What stands there."""
        if not index.isValid():
            return None
        number, item = self.where(index.row())
        section = self.sections[number]
        return section if item < 0 else section.item(item)

    # What Qt asks

    def rowCount(self, parent: Index = NOWHERE) -> int:
        """How many headings and items there are."""
        return 0 if parent.isValid() else self._heads[-1]

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """What is shown, told and read aloud of a row."""
        found = self.at(index)
        if found is None:
            return None
        if isinstance(found, Section):
            told = f"{found.title}: {found.total}"
            if found.kind in self.folded:
                told = f"{told}, folded"
            return {
                Qt.ItemDataRole.DisplayRole: found.title,
                Qt.ItemDataRole.AccessibleTextRole: told,
                Qt.ItemDataRole.ToolTipRole: found.tip,
            }.get(Qt.ItemDataRole(role))
        if role in (Qt.ItemDataRole.DisplayRole, Qt.ItemDataRole.AccessibleTextRole):
            return "; ".join(facts(found))
        if role == Qt.ItemDataRole.ToolTipRole:
            return "\n".join(facts(found))
        return None


def facts(item: Item) -> list[str]:
    """What a row shows, in words."""
    place, about = item.place, item.about
    told = [
        f"Human: {action_name(place.human)}",
        f"Model: {action_name(place.predicted)}",
        f"{item.name}, {place.start:.3f} to {place.end:.3f} s",
    ]
    if isinstance(about, StoredVerdict):
        told.append(f"Judged by {about.author}: {verdict_name(about.verdict)}")
        return told
    if about.confidence is not None:
        told.append(f"Confidence of the model: {100 * about.confidence:.0f} %")
    if about.suspicion:
        told.append(f"Suspicion of a coding error: {100 * about.suspicion:.0f} %")
    return told
