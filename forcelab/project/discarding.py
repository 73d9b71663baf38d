"""Taking a demonstration out of a project, as a whole or, if killed meanwhile, not at all.

What people labelled is kept as long as its demonstration. A recording that has just become one
holds nothing of that and can be discarded. One that was imported by mistake can be removed with
what was labelled on it, by somebody who was told whose labels these are.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping

from forcelab.atomic import sync_folder
from forcelab.errors import InputError
from forcelab.project import files
from forcelab.project.database import Database
from forcelab.project.history import line_of
from forcelab.project.loading import DEMONSTRATIONS, row_of

__all__ = ["discard", "remove"]

#: Tables whose rows a trigger keeps for ever.
_KEPT = ("edit", "assignment", "verdict")
_TRACKS = "SELECT id FROM track WHERE demonstration = ?"


def discard(database: Database, id_: str, heads: Mapping[str, int]) -> None:
    """Remove a new recording with its files; see :meth:`~forcelab.project.Project.discard`."""
    _take_out(database, id_, lambda: _worked_with(database, id_, heads), "since it was recorded")


def remove(database: Database, id_: str, heads: Mapping[str, int]) -> None:
    """Remove a demonstration and its labels; see :meth:`~forcelab.project.Project.remove`."""
    _take_out(database, id_, lambda: _labelled(database, id_, heads), "meanwhile")


def _take_out(database: Database, id_: str, reason: Callable[[], str], since: str) -> None:
    """Remove a demonstration with its files, unless there is a reason to keep it."""
    home = database.folder / DEMONSTRATIONS / id_
    mark = home / files.UNCOMMITTED
    try:
        with database.writing():
            name = row_of(database, id_)["name"]
            if why := reason():
                raise InputError(f"'{name}' {why} {since}; it stays.")
            if home.is_dir():
                # A folder with this mark and without a row is what the next start clears away.
                with files.told(f"'{name}' cannot be discarded"):
                    mark.touch()
                    sync_folder(home)
            _forget(database, id_)
    except BaseException:
        with contextlib.suppress(OSError):  # beside a row it does no harm
            mark.unlink(missing_ok=True)
        raise
    files.remove(home)


def _worked_with(database: Database, id_: str, heads: Mapping[str, int]) -> str:
    """What people or runs did with a demonstration; empty if they did nothing."""
    if database.one("SELECT 1 FROM assignment WHERE demonstration = ?", id_):
        return "was assigned to a coder"
    if database.one("SELECT 1 FROM verdict WHERE demonstration = ?", id_):
        return "was reviewed"
    for table, columns in (("recogniser", "labels"), ("run", "labels || result")):
        if database.one(f"SELECT 1 FROM {table} WHERE instr({columns}, ?)", id_):
            return "was used for training or evaluation"
    return _labelled(database, id_, heads)


def _labelled(database: Database, id_: str, heads: Mapping[str, int]) -> str:
    """Whether a coder has labelled since the tracks had these heads; empty if nobody has."""
    rows = database.all(
        "SELECT track.id, author.name FROM track JOIN author ON author.id = track.author "
        "WHERE demonstration = ? AND kind = 'coder'",
        id_,
    )
    changed = any(line_of(database, row["id"]).head != heads.get(row["name"], 0) for row in rows)
    return "was labelled" if changed else ""


def _forget(database: Database, id_: str) -> None:
    """Delete the rows of a demonstration, inside a transaction."""
    authors = [
        row["author"]
        for row in database.all("SELECT author FROM track WHERE demonstration = ?", id_)
    ]
    database.execute(f"DELETE FROM segment WHERE track IN ({_TRACKS})", id_)
    # The store refuses to delete what people did, whoever asks. That is lifted for this
    # demonstration, and only inside this transaction, in which nobody else can write.
    for table in _KEPT:
        which = f"track IN ({_TRACKS})" if table == "edit" else "demonstration = ?"
        keeper = database.one(
            "SELECT name, sql FROM sqlite_schema WHERE name = ?", f"{table}_is_not_deleted"
        )
        assert keeper is not None
        database.execute(f"DROP TRIGGER {keeper['name']}")
        database.execute(f"DELETE FROM {table} WHERE {which}", id_)
        database.execute(keeper["sql"])
    database.execute("DELETE FROM track WHERE demonstration = ?", id_)
    for author in authors:
        database.execute(
            "DELETE FROM author WHERE id = ? AND id NOT IN (SELECT author FROM track)", author
        )
    database.execute("DELETE FROM demonstration WHERE id = ?", id_)
