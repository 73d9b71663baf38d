"""Taking a demonstration out of a project, as a whole or, if killed meanwhile, not at all.

What people labelled is kept as long as its demonstration. A recording that has just become one
holds nothing of that and can be discarded. One that was imported by mistake can be removed with
what was labelled on it, by somebody who was told whose labels these are.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Collection, Mapping

from forcelab.errors import InputError
from forcelab.io import sync_folder
from forcelab.project import files
from forcelab.project.clearing import give_back, lifted
from forcelab.project.database import Database
from forcelab.project.history import line_of
from forcelab.project.loading import home_of, row_of

__all__ = ["discard", "remove"]

#: Tables whose rows a trigger keeps for ever.
_KEPT = ("edit", "assignment", "verdict", "note")
_TRACKS = "SELECT id FROM track WHERE demonstration = ?"


def discard(database: Database, id_: str, heads: Mapping[str, int]) -> None:
    """Remove a new recording with its files; see :meth:`~forcelab.project.Project.discard`."""
    _take_out(
        database, [id_], lambda id_: _worked_with(database, id_, heads), "since it was recorded"
    )


def remove(database: Database, heads: Mapping[str, Mapping[str, int]]) -> None:
    """Remove demonstrations and their labels; see :meth:`~forcelab.project.Project.remove_all`."""
    _take_out(database, heads, lambda id_: _labelled(database, id_, heads[id_]), "meanwhile")
    give_back(database)


def _take_out(
    database: Database, ids: Collection[str], reason: Callable[[str], str], since: str
) -> None:
    """Remove demonstrations with their files, unless there is a reason to keep one of them."""
    homes = [home_of(database, id_) for id_ in ids]
    try:
        with database.writing():
            for id_, home in zip(ids, homes, strict=True):
                name = row_of(database, id_)["name"]
                if why := reason(id_):
                    raise InputError(f"'{name}' {why} {since}; it stays.")
                if home.is_dir():
                    # A folder with this mark and without a row is what the next start clears away.
                    with files.told(f"'{name}' cannot be discarded"):
                        files.mark_uncommitted(home / files.UNCOMMITTED)
                        sync_folder(home)
                _forget(database, id_)
    except BaseException:
        for home in homes:
            with contextlib.suppress(OSError):  # beside a row it does no harm
                (home / files.UNCOMMITTED).unlink(missing_ok=True)
        raise
    for home in homes:
        files.remove(home)


def _worked_with(database: Database, id_: str, heads: Mapping[str, int]) -> str:
    """What people or runs did with a demonstration; empty if they did nothing."""
    if database.one("SELECT 1 FROM assignment WHERE demonstration = ?", id_):
        return "was assigned to a coder"
    if database.one("SELECT 1 FROM verdict WHERE demonstration = ?", id_):
        return "was reviewed"
    if database.one("SELECT 1 FROM note WHERE demonstration = ?", id_):
        return "was given a note"
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
    # The store refuses to delete what people did, whoever asks; of this demonstration it may go.
    for table in _KEPT:
        which = f"track IN ({_TRACKS})" if table == "edit" else "demonstration = ?"
        with lifted(database, f"{table}_is_not_deleted"):
            database.execute(f"DELETE FROM {table} WHERE {which}", id_)
    database.execute("DELETE FROM track WHERE demonstration = ?", id_)
    for author in authors:
        database.execute(
            "DELETE FROM author WHERE id = ? AND id NOT IN (SELECT author FROM track)", author
        )
    database.execute("DELETE FROM demonstration WHERE id = ?", id_)
