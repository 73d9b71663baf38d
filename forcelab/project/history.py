"""Where a track stands in its history: what can be undone, and what can be redone.

What can be undone is a stack, and what can be redone is another. Both are linked through the
``parent`` of the edits: that of a paint, an import or a prediction is the edit to undo once it is
undone itself; that of an undo is the undo to redo once it is redone itself. So the tops of both
stacks follow from the track's latest edit alone, whatever the length of the history. A new edit
leaves the redo stack behind; nothing is ever deleted.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from forcelab.project.database import Database
from forcelab.project.made import LabelsUsed
from forcelab.project.records import Edit, segments_from_json
from forcelab.project.troubles import told_of_content

__all__ = ["Line", "edit_of", "edits_of", "edits_since", "line_of", "net_edits", "stands"]

_EDITS = """
    SELECT edit.*, track.demonstration, author.name AS author
    FROM edit JOIN track ON track.id = edit.track JOIN author ON author.id = track.author
"""


@dataclass(frozen=True, slots=True)
class Line:
    """A track's latest edit (0: none), and the tops of its two stacks."""

    head: int = 0
    undo: int | None = None
    redo: int | None = None


def line_of(database: Database, track: int, until: int | None = None) -> Line:
    """Where the track stands, or stood after the edit with the number `until`."""
    head = database.one(
        "SELECT id, kind, reverts FROM edit WHERE track = ? AND (? IS NULL OR id <= ?) "
        "ORDER BY id DESC LIMIT 1",
        track,
        until,
        until,
    )
    if head is None:
        return Line()
    if head["reverts"] is None:
        return Line(head["id"], undo=head["id"])
    taken = database.one("SELECT reverts, parent FROM edit WHERE id = ?", head["reverts"])
    assert taken is not None
    if head["kind"] == "undo":
        return Line(head["id"], undo=taken["parent"], redo=head["id"])
    return Line(head["id"], undo=taken["reverts"], redo=taken["parent"])


def net_edits(database: Database, track: int, since: int) -> int:
    """How many edits lie between what the track was after the edit number `since` and what it is.

    An edit that was taken back counts for nothing. One that is older than `since` and was taken
    back afterwards counts as one. Below an edit on the stack lie only older ones, so that the two
    stacks are followed downwards side by side until they meet.
    """
    then, now = line_of(database, track, since).undo, line_of(database, track).undo
    count = 0
    while then != now:
        count += 1
        if (now or 0) > (then or 0):
            now = _below(database, now)
        else:
            then = _below(database, then)
    return count


def stands(database: Database, track: int, number: int) -> bool:
    """Whether an edit that was no undo or redo is part of what the track is now."""
    now = line_of(database, track).undo
    while now is not None and now > number:
        now = _below(database, now)
    return now == number


def edits_since(database: Database, labels: Sequence[LabelsUsed], tasks: Sequence[str]) -> int:
    """How many edits labels have had since, and demonstrations their tasks."""
    used = json.dumps([[one.demonstration, one.author, one.edit] for one in labels])
    edited = database.all(
        """
        SELECT track.id AS track, json_extract(value, '$[2]') AS edit
        FROM json_each(?)
        JOIN author ON author.name = json_extract(value, '$[1]')
        JOIN track ON track.demonstration = json_extract(value, '$[0]')
                  AND track.author = author.id
        WHERE EXISTS (
            SELECT 1 FROM edit
            WHERE edit.track = track.id AND edit.id > json_extract(value, '$[2]')
        )
        """,
        used,
    )
    (new,) = database.all(
        """
        SELECT count(*) AS number FROM demonstration
        WHERE task IN (SELECT value FROM json_each(?))
          AND id NOT IN (SELECT json_extract(value, '$[0]') FROM json_each(?))
        """,
        json.dumps(list(tasks)),
        used,
    )
    changed = sum(net_edits(database, row["track"], row["edit"]) for row in edited)
    return changed + int(new["number"])


def _below(database: Database, number: int | None) -> int | None:
    """The edit to undo after this one."""
    row = database.one("SELECT parent FROM edit WHERE id = ?", number)
    assert row is not None
    return None if row["parent"] is None else int(row["parent"])


def edits_of(
    database: Database, track: int, latest: int | None = None, before: int | None = None
) -> tuple[Edit, ...]:
    """Edits of a track, the first one first: the `latest` ones of those before number `before`."""
    rows = database.all(
        f"{_EDITS} WHERE track = ? AND (? IS NULL OR edit.id < ?) ORDER BY edit.id DESC LIMIT ?",
        track,
        before,
        before,
        -1 if latest is None else latest,
    )
    return tuple(_edit(row) for row in reversed(rows))


def edit_of(database: Database, number: int) -> Edit:
    """One edit."""
    row = database.one(f"{_EDITS} WHERE edit.id = ?", number)
    assert row is not None
    return _edit(row)


def _edit(row: sqlite3.Row) -> Edit:
    """An edit as stored."""
    with told_of_content(f"Edit {row['id']}"):
        return Edit(
            id=row["id"],
            demonstration=row["demonstration"],
            author=row["author"],
            kind=row["kind"],
            time=datetime.fromisoformat(row["time"]),
            what=row["what"],
            position=row["position"],
            removed=segments_from_json(json.loads(row["removed"])),
            inserted=segments_from_json(json.loads(row["inserted"])),
            reverts=row["reverts"],
            proposed_by=row["proposed_by"],
        )
