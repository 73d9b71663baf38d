"""What runs and recognisers take up, and taking them out again, whole or not at all.

Labels never change by it, and what people said is kept: a verdict stays, without the number of its
run, and a label that was accepted from a prediction remembers the name of what proposed it.
"""

from __future__ import annotations

import contextlib
import re
import sqlite3
from collections.abc import Iterator
from dataclasses import dataclass

from forcelab.errors import InputError
from forcelab.project.database import Database
from forcelab.project.runs import RECOGNISERS, row_of_run

__all__ = [
    "RunUse",
    "forget_run",
    "give_back",
    "lifted",
    "recogniser_bytes",
    "remove_recogniser",
    "remove_run",
    "uses",
]

#: Free pages of the store that are given back to the disk: so many bytes, and this share of it.
LEAST, SHARE = 1 << 20, 0.25
#: The last thing that a run's result names, where a recogniser belongs to it.
_OWN = re.compile(r'"recogniser": "([0-9a-f]{32})"\}$')
#: Characters at the end of a result in which that stands.
_END = 64
#: Who proposed something, as of :attr:`forcelab.review.outcome.Outcome.proposer`.
_PROPOSER = """(
    'model ' || coalesce(
        CASE WHEN json_valid(settings) THEN json_extract(settings, '$.preset') END, 'paper'
    ) || ' ' || id
)"""


@dataclass(frozen=True, slots=True)
class RunUse:
    """What a run takes up, and what hangs on it.

    Parameters
    ----------
    run : int
        Its number.
    bytes : int
        Of what it found, and of its recogniser's file.
    recogniser : str
        Id of the recogniser that belongs to it; ``""`` where there is none, or none any more.
    verdicts : int
        How many were given on what it predicted.
    accepted : int
        How many edits took over what it predicted.
    """

    run: int
    bytes: int
    recogniser: str
    verdicts: int
    accepted: int


def uses(database: Database, number: int | None = None) -> tuple[RunUse, ...]:
    """Of every run, the first one first; or of the run of a number alone."""
    # The older way reads all of a result to tell how long it is.
    new = sqlite3.sqlite_version_info >= (3, 43)
    length = "octet_length(result)" if new else "length(CAST(result AS BLOB))"
    rows = database.all(
        f"SELECT id, {length} AS bytes, CAST(substr(result, {-_END}) AS BLOB) AS last, "
        f"CAST({_PROPOSER} AS BLOB) AS proposer "  # a run that is no text can be removed, too
        "FROM run WHERE ? IS NULL OR id = ? ORDER BY id",
        number,
        number,
    )
    verdicts = {
        row["run"]: row["number"]
        for row in database.all("SELECT run, count(*) AS number FROM verdict GROUP BY run")
    }
    accepted = {
        row["proposed_by"]: row["number"]
        for row in database.all(
            "SELECT proposed_by, count(*) AS number FROM edit "
            "WHERE proposed_by IS NOT NULL GROUP BY proposed_by"
        )
    }
    sizes = recogniser_bytes(database)
    found = []
    for row in rows:
        own = _OWN.search(row["last"].decode(errors="replace"))
        id_ = own[1] if own is not None and own[1] in sizes else ""
        number, size = row["id"], row["bytes"] + sizes.get(id_, 0)
        taken = accepted.get(row["proposer"].decode(errors="replace"), 0)
        found.append(RunUse(number, size, id_, verdicts.get(number, 0), taken))
    return tuple(found)


def recogniser_bytes(database: Database) -> dict[str, int]:
    """How large the file of each recogniser is, by its id; 0 where it is missing."""
    sizes = {}
    for row in database.all("SELECT id FROM recogniser ORDER BY rowid"):
        sizes[row["id"]] = 0
        with contextlib.suppress(OSError):
            path = database.folder / RECOGNISERS / f"{row['id']}.skops"
            sizes[row["id"]] = path.stat().st_size
    return sizes


def remove_run(database: Database, number: int) -> None:
    """Delete a run with its recogniser; see :meth:`forcelab.project.Project.remove_run`."""
    with database.writing():
        row_of_run(database, number, "id")
        if database.one("SELECT 1 FROM verdict WHERE run = ?", number):
            with lifted(database, "verdict_is_not_changed"):
                database.execute("UPDATE verdict SET run = NULL WHERE run = ?", number)
        own = _delete(database, number)
    _delete_file(database, own)
    give_back(database)


def forget_run(database: Database, number: int, proposer: str) -> bool:
    """Delete a run unless it was used; see :meth:`forcelab.project.Project.forget_run`."""
    with database.writing():
        there = database.one("SELECT 1 FROM run WHERE id = ?", number)
        if not there or _is_used(database, number, proposer):
            return False
        own = _delete(database, number)
    _delete_file(database, own)  # the next run fills the room in the store
    return True


def _is_used(database: Database, number: int, proposer: str) -> bool:
    """Whether a run was judged, or labels come from it."""
    return bool(
        database.one("SELECT 1 FROM verdict WHERE run = ?", number)
        or database.one("SELECT 1 FROM edit WHERE proposed_by = ?", proposer)
        or database.one("SELECT 1 FROM author WHERE name = ?", proposer)
    )


def _delete(database: Database, number: int) -> str:
    """Delete the rows of a run and of its recogniser, in a transaction.

    Gives the recogniser's id, ``""`` where there is none or another run has it, too.
    """
    row = database.one(
        "SELECT CASE WHEN json_valid(result) THEN json_extract(result, '$.recogniser') END AS own "
        "FROM run WHERE id = ?",
        number,
    )
    database.execute("DELETE FROM run WHERE id = ?", number)
    own = row["own"] if row is not None else None
    if own is None or database.one("SELECT 1 FROM run WHERE instr(result, ?)", own):
        return ""
    database.execute("DELETE FROM recogniser WHERE id = ?", own)
    return str(own)


def remove_recogniser(database: Database, id_: str) -> None:
    """Delete a recogniser; see :meth:`forcelab.project.Project.remove_recogniser`."""
    with database.writing():
        if not database.one("SELECT 1 FROM recogniser WHERE id = ?", id_):
            raise InputError(
                f"There is no recogniser '{id_}' in '{database.folder}'; 'forcelab list --json' "
                "tells those that there are."
            )
        database.execute("DELETE FROM recogniser WHERE id = ?", id_)
    _delete_file(database, id_)


@contextlib.contextmanager
def lifted(database: Database, trigger: str) -> Iterator[None]:
    """Without one of the triggers by which the store refuses to change what people did.

    Only inside a transaction, in which nobody else can write: it is back at its end, whatever
    happens.
    """
    keeper = database.one("SELECT sql FROM sqlite_schema WHERE name = ?", trigger)
    assert keeper is not None
    database.execute(f"DROP TRIGGER {trigger}")
    yield
    database.execute(keeper["sql"])


def give_back(database: Database) -> None:
    """Make the store's file smaller where much of it is free; otherwise the next run fills that.

    SQLite writes it anew, whole or not at all. Where it cannot, as the disk is full or another
    program is at work, the file stays as large as it was.
    """
    pages, free, size = (
        int(database.execute(f"PRAGMA {name}").fetchone()[0])
        for name in ("page_count", "freelist_count", "page_size")
    )
    if free * size < LEAST or free < SHARE * pages:
        return
    with contextlib.suppress(InputError):
        database.execute("VACUUM")
        database.execute("PRAGMA wal_checkpoint(TRUNCATE)")


def _delete_file(database: Database, id_: str) -> None:
    """Delete the file of a recogniser, which without its row only takes up room."""
    if not id_:
        return
    with contextlib.suppress(OSError):
        (database.folder / RECOGNISERS / f"{id_}.skops").unlink(missing_ok=True)
