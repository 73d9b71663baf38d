"""Who has tracks: what an author is, and the number of each one's track."""

from __future__ import annotations

from forcelab.errors import InputError
from forcelab.labels import Track
from forcelab.project.database import Database
from forcelab.project.records import AuthorKind

__all__ = ["kind_of", "track_for", "track_of"]


def kind_of(database: Database, author: str) -> AuthorKind | None:
    """What an author is, if known."""
    row = database.one("SELECT kind FROM author WHERE name = ?", author)
    return row["kind"] if row else None


def track_of(database: Database, demonstration: str, author: str) -> int | None:
    """The number of a track, if there is one."""
    row = database.one(
        "SELECT track.id FROM track JOIN author ON author.id = track.author "
        "WHERE demonstration = ? AND name = ?",
        demonstration,
        author,
    )
    return row["id"] if row else None


def track_for(database: Database, demonstration: str, author: str, kind: AuthorKind) -> int:
    """The number of a track, made where there is none; needs a transaction around it.

    Raises
    ------
    InputError
        If the author has no name, or is of the other kind.
    """
    there = database.one(
        "SELECT track.id, kind FROM track JOIN author ON author.id = track.author "
        "WHERE demonstration = ? AND name = ?",
        demonstration,
        author,
    )
    if there is not None and there["kind"] == kind:
        return int(there["id"])
    Track(author)  # refuses an author without a name
    known = kind_of(database, author)
    if known is None:
        database.execute("INSERT INTO author (name, kind) VALUES (?, ?)", author, kind)
    elif known != kind:
        raise InputError(
            f"'{author}' is a {known} in this project and cannot be a {kind} as well; "
            f"use another author's name."
        )
    database.execute(
        "INSERT OR IGNORE INTO track (demonstration, author) "
        "SELECT ?, id FROM author WHERE name = ?",
        demonstration,
        author,
    )
    row = track_of(database, demonstration, author)
    assert row is not None
    return row
