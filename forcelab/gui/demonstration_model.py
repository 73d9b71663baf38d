"""The demonstrations of a project as rows in groups, and their Qt model."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from html import escape
from itertools import groupby
from typing import Any, Literal

from PySide6.QtCore import QAbstractItemModel, QModelIndex, QObject, Qt

from forcelab.gui.item_views import NOWHERE, Index
from forcelab.project import Assignment, DemonstrationInfo, Note, left_to_label

#: What of the list can be shown, and what it can be sorted by.
ListFilter = Literal["all", "unlabelled", "begun", "assigned", "done"]
ListOrder = Literal["name", "share", "edit"]

#: So many letters of an id are searched for on purpose. Of its 32 digits any short number is
#: somewhere a part: "12" would find 45 of 400 demonstrations.
ID_TYPED = 6


@dataclass(frozen=True, slots=True)
class DemonstrationRow:
    """A demonstration as the coder may see it.

    `share` is the labelled part of its duration, 0 to 1, and `others` are the other authors with
    theirs; `assignment` is the coder's own, `assigned_to` are the others'; both of the others' are
    empty while the coder is blind to them. `edited` orders the coder's last edits (larger is later,
    0 is none). `notes` are those that the coder may see.
    """

    info: DemonstrationInfo
    share: float = 0.0
    others: tuple[tuple[str, float], ...] = ()
    assignment: Assignment | None = None
    assigned_to: tuple[Assignment, ...] = ()
    edited: int = 0
    notes: tuple[Note, ...] = ()

    @property
    def assignments(self) -> tuple[Assignment, ...]:
        """The coder's own, and those of others that the coder may see."""
        own = () if self.assignment is None else (self.assignment,)
        return (*own, *self.assigned_to)

    @property
    def done(self) -> bool:
        """Whether the coder has marked it as done."""
        return self.assignment is not None and self.assignment.done is not None

    @property
    def blind(self) -> bool:
        """Whether the coder must not see what others labelled."""
        return self.assignment is not None and self.assignment.blind and not self.done

    @property
    def finished(self) -> bool:
        """Whether the coder has marked it as done, or labelled all of it and need not mark it."""
        return self.done or (percent(self.share) == 100 and self.assignment is None)

    @property
    def to_do(self) -> bool:
        """Whether the coder has not begun it, or has it assigned and not marked as done."""
        return left_to_label(self.share, self.assignment)

    def shows(self, filter_: ListFilter) -> bool:
        """Whether it passes the filter."""
        if filter_ == "unlabelled":
            return self.share == 0.0
        if filter_ == "begun":
            return 0 < percent(self.share) < 100 and not self.done
        if filter_ == "assigned":
            return self.assignment is not None and not self.done
        return filter_ == "all" or self.finished  # as they are counted above the list


@dataclass(frozen=True, slots=True)
class TaskGroup:
    """The listed demonstrations of one task."""

    task: str
    rows: tuple[DemonstrationRow, ...]

    @property
    def labelled(self) -> int:
        """How many the coder has begun to label."""
        return sum(row.share > 0 for row in self.rows)

    @property
    def finished(self) -> int:
        """How many are finished."""
        return count_finished(self.rows)


def rows_of(
    infos: Iterable[DemonstrationInfo],
    assignments: Iterable[Assignment],
    author: str,
    notes: Iterable[Note] = (),
) -> tuple[DemonstrationRow, ...]:
    """What a coder may see of each demonstration.

    `assignments` are everybody's, `notes` those that the coder may see.
    """
    noted: dict[str, list[Note]] = defaultdict(list)
    for note in notes:
        noted[note.demonstration].append(note)
    assigned: dict[str, list[Assignment]] = defaultdict(list)
    for assignment in assignments:
        assigned[assignment.demonstration].append(assignment)
    return tuple(_row(info, assigned[info.id], author, tuple(noted[info.id])) for info in infos)


def ordered(rows: Sequence[DemonstrationRow], order: ListOrder) -> tuple[DemonstrationRow, ...]:
    """Sort rows, those of a task staying together.

    ``"share"`` puts what the coder has labelled least first in its task; ``"edit"`` what the coder
    edited last, with its task. Equal ones stay by name.
    """
    if order == "edit":
        rows = sorted(rows, key=lambda row: -row.edited)
    tasks = {task: i for i, task in enumerate(dict.fromkeys(row.info.task for row in rows))}
    if order == "share":
        rows = sorted(rows, key=lambda row: row.share)
    return tuple(sorted(rows, key=lambda row: tasks[row.info.task]))


def grouped(
    rows: Iterable[DemonstrationRow], search: str, shown: ListFilter, opened: str = ""
) -> tuple[TaskGroup, ...]:
    """The rows that match, by task.

    Name, task and notes must contain all words of `search`, whatever their case, or the id begin
    with it. The open demonstration passes every filter: it would vanish with the first segment
    painted.
    """
    words = search.casefold().split()
    fitting = [
        row for row in rows if (row.info.id == opened or row.shows(shown)) and _matches(row, words)
    ]
    return tuple(
        TaskGroup(task, tuple(of_task))
        for task, of_task in groupby(fitting, lambda row: row.info.task)
    )


def count_finished(rows: Iterable[DemonstrationRow]) -> int:
    return sum(row.finished for row in rows)


def find_next(
    rows: Sequence[DemonstrationRow], opened: str, fits: Callable[[DemonstrationRow], bool]
) -> DemonstrationRow | None:
    """The next row that fits after the open one, cyclically; first of the open one's task."""
    at = next((i for i, row in enumerate(rows) if row.info.id == opened), -1)
    others = [*rows[at + 1 :], *rows[: max(at, 0)]]
    if at >= 0:
        others.sort(key=lambda row: row.info.task != rows[at].info.task)
    return next(filter(fits, others), None)


def percent(share: float) -> int:
    """A share in percent; 0 and 100 only for nothing and everything."""
    if share <= 0.0:
        return 0
    return 100 if share >= 0.9999 else min(max(round(100 * share), 1), 99)


def _row(
    info: DemonstrationInfo, assigned: Iterable[Assignment], author: str, notes: tuple[Note, ...]
) -> DemonstrationRow:
    """A demonstration as `author` may see it."""
    # Whoever painted past the end of the recording has labelled all of it, and not more.
    shares = {name: min(s / info.duration, 1.0) for name, s in info.labelled.items()}
    assignment = next((a for a in assigned if a.author == author), None)
    edited = info.edited.get(author, 0)
    row = DemonstrationRow(
        info, shares.pop(author, 0.0), assignment=assignment, edited=edited, notes=notes
    )
    if row.blind:
        return row
    others = tuple((name, share) for name, share in shares.items() if share > 0)
    elsewhere = tuple(a for a in assigned if a.author != author)
    return replace(row, others=others, assigned_to=elsewhere)


def _matches(row: DemonstrationRow, words: list[str]) -> bool:
    texts = (row.info.name, row.info.task, *(note.text for note in row.notes))
    text = "\n".join(texts).casefold()
    return all(
        word in text or (len(word) >= ID_TYPED and row.info.id.startswith(word)) for word in words
    )


#: The role under which a :class:`DemonstrationRow` or :class:`TaskGroup` itself is asked for.
ROW_ROLE = Qt.ItemDataRole.UserRole

#: What an index of a task holds; that of a demonstration holds its task's place and one more.
_TASK = 0


class DemonstrationModel(QAbstractItemModel):
    """Groups of rows as a tree of two levels and one column.

    `opened` is the id of the open demonstration, or ``""``.
    """

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.groups: tuple[TaskGroup, ...] = ()
        self.opened = ""
        self._places: dict[str, tuple[int, int]] = {}

    def show(self, groups: tuple[TaskGroup, ...]) -> bool:
        """Show these groups; returns whether rows came, went or moved."""
        if _shape(groups) == _shape(self.groups):
            old, self.groups = self.groups, groups
            for g, (before, after) in enumerate(zip(old, groups, strict=True)):
                if before != after:
                    self._emit_changes(g, before, after)
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
        """Where a demonstration is; invalid if it is not listed."""
        if id_ not in self._places:
            return NOWHERE
        g, r = self._places[id_]
        return self.createIndex(r, 0, g + 1)

    def at(self, index: Index) -> DemonstrationRow | TaskGroup | None:
        """The row or group at an index."""
        if not index.isValid():
            return None
        inside = int(index.internalId())
        if inside == _TASK:
            return self.groups[index.row()]
        return self.groups[inside - 1].rows[index.row()]

    def ids(self) -> list[str]:
        """The listed demonstrations, in order."""
        return list(self._places)

    @property
    def rows(self) -> Iterator[DemonstrationRow]:
        """The listed rows, in order."""
        return (row for group in self.groups for row in group.rows)

    # What Qt asks

    def index(self, row: int, column: int, parent: Index = NOWHERE) -> QModelIndex:
        if column != 0 or not 0 <= row < self.rowCount(parent):
            return NOWHERE
        return self.createIndex(row, column, parent.row() + 1 if parent.isValid() else _TASK)

    def parent(self, index: Index = NOWHERE) -> QModelIndex:  # type: ignore[override]
        """The index of a demonstration's task."""
        inside = int(index.internalId()) if index.isValid() else _TASK
        return NOWHERE if inside == _TASK else self.createIndex(inside - 1, 0, _TASK)

    def rowCount(self, parent: Index = NOWHERE) -> int:
        """The number of tasks, or of a task's demonstrations."""
        if not parent.isValid():
            return len(self.groups)
        return len(self.groups[parent.row()].rows) if parent.internalId() == _TASK else 0

    def columnCount(self, parent: Index = NOWHERE) -> int:
        return 1

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """Text, tooltip and accessible text of a row."""
        item = self.at(index)
        if item is None:
            return None
        if role == ROW_ROLE:
            return item
        if role == Qt.ItemDataRole.DisplayRole:
            return item.info.name if isinstance(item, DemonstrationRow) else item.task
        if role == Qt.ItemDataRole.AccessibleTextRole:
            return "; ".join(_facts(item, open_=self._is_open(item)))
        if role == Qt.ItemDataRole.ToolTipRole:
            facts = _facts(item, open_=self._is_open(item))
            lines = [*map(escape, facts), *map(escape, _details(item))]
            lines[0] = f"<b>{lines[0]}</b>"
            return f"<p style='white-space: pre-wrap'>{'<br/>'.join(lines)}</p>"
        return None

    def _is_open(self, item: DemonstrationRow | TaskGroup) -> bool:
        return isinstance(item, DemonstrationRow) and item.info.id == self.opened

    def _emit_changes(self, g: int, before: TaskGroup, after: TaskGroup) -> None:
        """Emit `dataChanged` for the rows of a group that differ."""
        for r, (old, new) in enumerate(zip(before.rows, after.rows, strict=True)):
            if old != new:
                index = self.createIndex(r, 0, g + 1)
                self.dataChanged.emit(index, index)
        index = self.createIndex(g, 0, _TASK)
        self.dataChanged.emit(index, index)


def _shape(groups: tuple[TaskGroup, ...]) -> list[tuple[str, list[str]]]:
    """Which demonstrations are listed, and where."""
    return [(group.task, [row.info.id for row in group.rows]) for group in groups]


def _facts(item: DemonstrationRow | TaskGroup, open_: bool) -> list[str]:
    """A row in words."""
    if isinstance(item, TaskGroup):
        facts = [item.task or "No task", f"{item.finished} of {len(item.rows)} done by you"]
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
    for assignment in item.assigned_to:
        stage = "Assigned to" if assignment.done is None else "Done by"
        facts.append(f"{stage} {assignment.author}")
    videos = item.info.videos
    several = f"With {len(videos)} videos"
    facts.append(several if len(videos) > 1 else "With video" if videos else "No video")
    return facts


def _details(item: DemonstrationRow | TaskGroup) -> list[str]:
    """What only the tooltip says."""
    if isinstance(item, TaskGroup):
        return []
    info = item.info
    details = [f"{info.duration:.2f} s, {info.rate:.6g} Hz, {len(info.channels)} channels"]
    if info.source:
        details.append(f"From {info.source}")
    return [*details, f"Id {info.id}"]
