"""What the list of demonstrations says about each: plain values, filtered and put in groups."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Literal

from forcelab.project import Assignment, DemonstrationInfo, Note, left_to_label

__all__ = [
    "Group",
    "Order",
    "Row",
    "Shown",
    "grouped",
    "next_to_do",
    "ordered",
    "percent",
    "rows_of",
]

#: What of the list can be shown, and what it can be sorted by.
Shown = Literal["all", "unlabelled", "begun", "assigned", "done"]
Order = Literal["name", "share", "edit"]

#: So many letters of an id are searched for on purpose.
ID_TYPED = 6


@dataclass(frozen=True, slots=True)
class Row:
    """A demonstration as the coder may see it.

    Parameters
    ----------
    info : DemonstrationInfo
        Everything that the project tells of it.
    share : float
        Of its duration, what the coder has labelled: 0 to 1.
    others : tuple of (str, float)
        The other authors and their shares; empty while the coder is blind to them.
    assignment : Assignment or None
        The coder's own.
    assigned_to : tuple of Assignment
        The other coders'; empty while the coder is blind to them.
    edited : int
        The coder's last edit of it: the larger, the later; 0 where there was none.
    notes : tuple of Note
        What was written about it, by the coder and by others to whom the coder is not blind.
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
        """The coder's own, and those of others that may be seen."""
        own = () if self.assignment is None else (self.assignment,)
        return (*own, *self.assigned_to)

    @property
    def done(self) -> bool:
        """Whether the coder has marked it as done."""
        return self.assignment is not None and self.assignment.done is not None

    @property
    def blind(self) -> bool:
        """Whether the coder must not see what the others labelled."""
        return self.assignment is not None and self.assignment.blind and not self.done

    @property
    def finished(self) -> bool:
        """Whether the coder has labelled all of it, or marked it as done."""
        return self.done or percent(self.share) == 100

    @property
    def half_done(self) -> bool:
        """Whether the coder has begun it, left time unlabelled and not marked it as done."""
        return 0 < percent(self.share) < 100 and not self.done

    @property
    def to_do(self) -> bool:
        """Whether the coder has not begun it, or has it assigned and has not said it is done."""
        return left_to_label(self.share, self.assignment)

    def shows(self, what: Shown) -> bool:
        """Whether it is among what is to be shown."""
        if what == "unlabelled":
            return self.share == 0.0
        if what == "begun":
            return self.half_done
        if what == "assigned":
            return self.assignment is not None and not self.done
        return what == "all" or self.done


@dataclass(frozen=True, slots=True)
class Group:
    """The demonstrations of one task that are shown."""

    task: str
    rows: tuple[Row, ...]

    @property
    def labelled(self) -> int:
        """How many of them the coder has begun to label."""
        return sum(row.share > 0 for row in self.rows)

    @property
    def finished(self) -> int:
        """How many of them the coder has labelled to the end, or marked as done."""
        return sum(row.finished for row in self.rows)


def rows_of(
    infos: Iterable[DemonstrationInfo],
    assignments: Iterable[Assignment],
    author: str,
    notes: Iterable[Note] = (),
) -> tuple[Row, ...]:
    """What a coder may see of each demonstration, in their order.

    Parameters
    ----------
    infos : iterable of DemonstrationInfo
        All demonstrations.
    assignments : iterable of Assignment
        Everybody's.
    author : str
        The coder who looks.
    notes : iterable of Note
        Those that the coder may see.
    """
    noted: dict[str, tuple[Note, ...]] = {}
    for note in notes:
        noted[note.demonstration] = (*noted.get(note.demonstration, ()), note)
    assigned: dict[str, list[Assignment]] = defaultdict(list)
    for one in assignments:
        assigned[one.demonstration].append(one)
    return tuple(
        _row(info, assigned.get(info.id, ()), author, noted.get(info.id, ())) for info in infos
    )


def ordered(rows: Sequence[Row], order: Order) -> tuple[Row, ...]:
    """The same rows in another order, those of a task still one after the other.

    Parameters
    ----------
    rows : sequence of Row
        By task and name.
    order : "name", "share" or "edit"
        ``"share"``: what the coder has labelled least comes first in its task. ``"edit"``: what the
        coder edited last comes first, and so does its task. What is alike stays by name.
    """
    if order == "edit":
        rows = sorted(rows, key=lambda row: -row.edited)
    tasks = {task: i for i, task in enumerate(dict.fromkeys(row.info.task for row in rows))}
    if order == "share":
        rows = sorted(rows, key=lambda row: row.share)
    return tuple(sorted(rows, key=lambda row: tasks[row.info.task]))


def grouped(rows: Iterable[Row], search: str, shown: Shown, opened: str = "") -> tuple[Group, ...]:
    """What is to be shown, by task, in the order of the rows.

    Parameters
    ----------
    rows : iterable of Row
        Those of one task one after the other.
    search : str
        Words that name, task and notes must all contain, whatever their case; or the beginning
        of an id.
    shown : "all", "unlabelled", "begun", "assigned" or "done"
        Which of them.
    opened : str
        Id of the demonstration that is open: it is shown as long as it is found, whatever `shown`
        says, as it would otherwise vanish with the first segment that is painted.
    """
    words = search.casefold().split()
    fitting = [
        row for row in rows if (row.info.id == opened or row.shows(shown)) and _found(row, words)
    ]
    return tuple(
        Group(task, tuple(of_task)) for task, of_task in groupby(fitting, lambda row: row.info.task)
    )


def next_to_do(rows: Sequence[Row], opened: str) -> Row | None:
    """The next row that is left to label, the first after the last; None where there is no other.

    Parameters
    ----------
    rows : sequence of Row
        Those shown, in order.
    opened : str
        Id of the demonstration that is open, after which the search begins.
    """
    at = next((i for i, row in enumerate(rows) if row.info.id == opened), -1)
    others = (*rows[at + 1 :], *rows[: max(at, 0)])
    return next((row for row in others if row.to_do), None)


def percent(share: float) -> int:
    """A share in percent; 0 and 100 only where there is nothing and everything."""
    if share <= 0.0:
        return 0
    return 100 if share >= 0.9999 else min(max(round(100 * share), 1), 99)


def _row(
    info: DemonstrationInfo, assigned: Iterable[Assignment], author: str, notes: tuple[Note, ...]
) -> Row:
    """A demonstration as `author` may see it."""
    # Whoever painted past the end of the recording has labelled all of it, and not more.
    shares = {name: min(s / info.duration, 1.0) for name, s in info.labelled.items()}
    own = next((one for one in assigned if one.author == author), None)
    edited = info.edited.get(author, 0)
    row = Row(info, shares.pop(author, 0.0), assignment=own, edited=edited, notes=notes)
    if row.blind:
        return row
    others = tuple((name, share) for name, share in shares.items() if share > 0)
    elsewhere = tuple(one for one in assigned if one.author != author)
    return replace(row, others=others, assigned_to=elsewhere)


def _found(row: Row, words: list[str]) -> bool:
    """Whether a demonstration has all these words."""
    if not words:
        return True
    told = (row.info.name, row.info.task, *(note.text for note in row.notes))
    text = "\n".join(told).casefold()
    return all(word in text or _begins_id(row, word) for word in words)


def _begins_id(row: Row, word: str) -> bool:
    """Whether it is the beginning of a demonstration's id, and too long to be one by chance."""
    # In 32 digits any short number stands somewhere: "12" would find 45 of 400 demonstrations.
    return len(word) >= ID_TYPED and row.info.id.startswith(word)
