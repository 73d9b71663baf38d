"""What coders hand on about recordings: append-only, as the edits are, and the latest counts."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import timedelta, timezone

from forcelab.labels import Track
from forcelab.project.database import Database
from forcelab.project.decisions import Note
from forcelab.project.records import utc_now
from forcelab.project.troubles import time_of

__all__ = ["add_notes", "notes_of", "write_note"]

#: The shortest time that a note can be later than another one.
_TICK = timedelta(microseconds=1)


def write_note(database: Database, demonstration: str, author: str, text: str) -> None:
    """Write a coder's note in place of the one that counts, inside a transaction."""
    before = [one for one in notes_of(database, demonstration) if one.author == author]
    time, there = utc_now(), ""
    if before:  # a clock that was set back must not let the older note count
        time, there = max(time, before[-1].time + _TICK), before[-1].text
    new = Note(demonstration, author, text, time)
    if new.text != there:
        add_notes(database, demonstration, [new])


def add_notes(database: Database, demonstration: str, notes: Iterable[Note]) -> bool:
    """Keep notes that are not there yet, inside a transaction; gives whether there were any.

    Of a coder's the latest counts, wherever it was written: two projects that take each other's
    notes over come to have the same.
    """
    known = {(one.author, one.time, one.text) for one in notes_of(database, demonstration)}
    new = [one for one in notes if (one.author, one.time, one.text) not in known]
    for one in new:
        Track(one.author)  # refuses an author without a name
        database.insert(
            "note",
            demonstration=demonstration,
            author=one.author,
            text=one.text,
            time=one.time.astimezone(timezone.utc).isoformat(),
        )
    return bool(new)


def notes_of(database: Database, demonstration: str | None) -> tuple[Note, ...]:
    """Every note on a demonstration, or on all of them."""
    which, values = (
        ("", []) if demonstration is None else ("WHERE demonstration = ?", [demonstration])
    )
    # Texts of times in UTC are sorted as the times are.
    return tuple(
        Note(
            row["demonstration"],
            row["author"],
            row["text"],
            time_of(row, f"A note of {row['author']}"),
        )
        for row in database.all(f"SELECT * FROM note {which} ORDER BY time, author, text", *values)
    )
