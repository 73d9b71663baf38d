"""Recognisers and runs of a project: kept with everything to repeat them, and taken out again.

What runs and recognisers take up, and taking them out again, whole or not at all. Labels never
change by it, and what people said is kept: a verdict stays, without the number of its run, and a
label that was accepted from a prediction remembers the name of what proposed it.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import os
import re
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from forcelab.errors import ForcelabError, InputError
from forcelab.project import files
from forcelab.project.database import Database, Value, fits, told_of_content
from forcelab.project.records import utc_now


@dataclass(frozen=True, slots=True)
class LabelsUsed:
    """Which labels of a demonstration something was computed from.

    Parameters
    ----------
    demonstration : str
        Its id.
    author : str
        Whose labels were used.
    edit : int
        The latest edit of that track at the time; 0 where there was none.
    """

    demonstration: str
    author: str
    edit: int


@dataclass(frozen=True, slots=True)
class Made:
    """How something was made: everything needed to make it again.

    Parameters
    ----------
    time : datetime
        When it was added, in UTC.
    settings : dict
        Everything that was asked for, as JSON has it.
    seed : int or None
        The random seed, if there was one.
    labels : tuple of LabelsUsed
        What it was computed from.
    versions : dict of str to str
        Of the program and the libraries.
    """

    time: datetime
    settings: dict[str, Any]
    seed: int | None
    labels: tuple[LabelsUsed, ...]
    versions: dict[str, str]

    @property
    def demonstrations(self) -> tuple[str, ...]:
        """Ids of the demonstrations used, each once."""
        return tuple(dict.fromkeys(used.demonstration for used in self.labels))


@dataclass(frozen=True, slots=True)
class StoredRecogniser(Made):
    """A trained recogniser's record; its file is opaque to the store.

    Parameters
    ----------
    time, settings, seed, labels, versions
        As of :class:`Made`.
    id : str
        32 hex digits of the SHA-256 of its file.
    name : str
        For people; need not be unique.
    """

    id: str
    name: str


@dataclass(frozen=True, slots=True)
class RunSummary(Made):
    """A run without its result, which may be long.

    Parameters
    ----------
    time, settings, seed, labels, versions
        As of :class:`Made`.
    id : int
        Number in the project.
    kind : str
        Such as ``"evaluate"``.
    digest : dict
        What stands under ``"digest"`` in its result, if that comes first there; otherwise empty.
    """

    id: int
    kind: str
    digest: dict[str, Any]


@dataclass(frozen=True, slots=True)
class StoredRun(Made):
    """An evaluation or another computation, with everything needed to repeat it.

    Parameters
    ----------
    time, settings, seed, labels, versions
        As of :class:`Made`.
    id : int
        Number in the project.
    kind : str
        Such as ``"evaluate"``.
    result : dict
        What came out, as JSON has it.
    """

    id: int
    kind: str
    result: dict[str, Any]


#: Name of the folder that holds one file per recogniser.
RECOGNISERS = "recognisers"
#: What a result says of itself in few words, if this is its first key.
DIGEST = "digest"
#: Characters of a result that are read for its digest.
_FRONT = 4096
#: The columns of a run that say how it was made.
_HOW = "id, kind, time, settings, seed, labels, versions"
#: All of its columns; bytes that are no text are met where the result is parsed.
RUN = f"{_HOW}, CAST(result AS BLOB) AS result"


def columns_of(
    database: Database,
    settings: Mapping[str, Any],
    seed: int | None,
    labels: Sequence[LabelsUsed],
    versions: Mapping[str, str],
    time: datetime | None = None,
) -> dict[str, Value]:
    """The columns that say how a thing was made; the labels must be there."""
    if seed is not None and not fits(seed):
        raise InputError(f"The seed {seed} does not fit into 64 bits; use a smaller one.")
    for used in labels:
        _check(database, used)
    return {
        "time": (time or utc_now()).isoformat(),
        "settings": _json(dict(settings)),
        "seed": seed,
        "labels": _json([[used.demonstration, used.author, used.edit] for used in labels]),
        "versions": _json(dict(versions)),
    }


def keep_run(
    database: Database, kind: str, result: Mapping[str, Any], columns: Mapping[str, Value]
) -> int:
    """Write a run, in a transaction; gives its number."""
    if not kind.strip():
        raise InputError("A run needs a kind, such as 'evaluate'.")
    return database.insert("run", kind=kind, result=_json(dict(result)), **columns)


@contextlib.contextmanager
def keeping(database: Database, id_: str) -> Iterator[None]:
    """A transaction that keeps a recogniser, whose file is marked until that is committed."""
    mark = database.folder / RECOGNISERS / f"{id_}.{files.UNCOMMITTED}"
    try:
        with database.writing():
            files.mark_uncommitted(
                mark
            )  # in here, or whoever opens the project just now takes it away
            yield
    except BaseException:
        with contextlib.suppress(ForcelabError, OSError):  # the next opening does it
            clear_recognisers(database)
        raise
    with contextlib.suppress(OSError):
        mark.unlink(missing_ok=True)


def clear_recognisers(database: Database) -> None:
    """Delete the files of recognisers that did not get as far as the store.

    Only marked ones: a file without a mark may be of a newer store in whose place this one was put.
    """
    root = database.folder / RECOGNISERS
    if not any(root.glob(f"*.{files.UNCOMMITTED}")):
        return
    with database.writing():  # whoever is just keeping one holds it until then
        for mark in root.glob(f"*.{files.UNCOMMITTED}"):
            if not database.one("SELECT 1 FROM recogniser WHERE id = ?", mark.stem):
                mark.with_suffix(".skops").unlink(missing_ok=True)
            mark.unlink(missing_ok=True)


def keep_recogniser(
    database: Database, id_: str, name: str, content: bytes, columns: Mapping[str, Value]
) -> None:
    """Write a recogniser, within :func:`keeping`, unless the same one is there."""
    if not name.strip():
        raise InputError("A recogniser needs a name.")
    if database.one("SELECT 1 FROM recogniser WHERE id = ?", id_):
        return
    root = database.folder / RECOGNISERS
    with files.staging(root) as staged:
        with (staged / f"{id_}.skops").open("xb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        files.move_into(root, staged)
    database.insert("recogniser", id=id_, name=name, **columns)


def recogniser_id(content: bytes) -> str:
    """What a recogniser of this content is called in the store."""
    return hashlib.sha256(content).hexdigest()[:32]


def recogniser_of(row: sqlite3.Row) -> StoredRecogniser:
    """A recogniser as stored."""
    cure = f"remove it with 'forcelab remove --recogniser {row['id'][:8]}'"
    with told_of_content(f"The recogniser '{row['name']}'", cure):
        return StoredRecogniser(id=row["id"], name=row["name"], **_stored_provenance(row))


def run_of(row: sqlite3.Row) -> StoredRun:
    """A run as stored, of a row of :data:`RUN`."""
    with told_of_content(f"What run {row['id']} found", "repeat it"):
        result = json.loads(row["result"])
    with _told_of_run(row):
        return StoredRun(id=row["id"], kind=row["kind"], result=result, **_stored_provenance(row))


def row_of_run(database: Database, number: int, columns: str = RUN) -> sqlite3.Row:
    """The row of a run that must be there; what it found may be large, or damaged."""
    query = f"SELECT {columns} FROM run WHERE id = ?"
    row = database.one(query, number) if fits(number) else None
    if row is None:
        raise InputError(
            f"There is no run {number} in '{database.folder}'; 'forcelab runs' lists those that "
            "there are."
        )
    return row


def summaries(database: Database, kind: str | None) -> tuple[RunSummary, ...]:
    """Every run of a kind without its result, the first one first."""
    rows = database.all(
        f"SELECT {_HOW}, CAST(substr(result, 1, {_FRONT}) AS BLOB) AS front FROM run "
        "WHERE ? IS NULL OR kind = ? ORDER BY id",
        kind,
        kind,
    )
    return tuple(map(_summary, rows))


def _summary(row: sqlite3.Row) -> RunSummary:
    """A run without its result."""
    front = row["front"].decode(errors="replace")
    with _told_of_run(row):
        return RunSummary(
            id=row["id"], kind=row["kind"], digest=_digest(front), **_stored_provenance(row)
        )


def _told_of_run(row: sqlite3.Row) -> contextlib.AbstractContextManager[None]:
    """Tell that how a run was made cannot be read."""
    number = row["id"]
    return told_of_content(f"Run {number}", f"remove it with 'forcelab remove --run {number}'")


def _check(database: Database, used: LabelsUsed) -> None:
    """Refuse labels that were never there."""
    if not database.one("SELECT 1 FROM demonstration WHERE id = ?", used.demonstration):
        raise InputError(
            f"There is no demonstration '{used.demonstration}' in '{database.folder}'."
        )
    found = used.edit == 0 or database.one(
        "SELECT 1 FROM edit JOIN track ON track.id = edit.track "
        "JOIN author ON author.id = track.author "
        "WHERE edit.id = ? AND demonstration = ? AND name = ?",
        used.edit,
        used.demonstration,
        used.author,
    )
    if not found:
        raise InputError(
            f"Edit {used.edit} in '{database.folder}' is none of '{used.author}' over the "
            f"demonstration '{used.demonstration}'."
        )


def _digest(front: str) -> dict[str, Any]:
    """The digest at the front of a result; empty where there is none."""
    start = f'{{"{DIGEST}": '
    if not front.startswith(start):
        return {}
    try:
        found, _ = json.JSONDecoder().raw_decode(front, len(start))
    except (ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def _stored_provenance(row: sqlite3.Row) -> dict[str, Any]:
    """How a thing was made, as stored."""
    settings, labels, versions = (
        json.loads(row[name], parse_float=_finite, parse_constant=_finite)
        for name in ("settings", "labels", "versions")
    )
    used = tuple(LabelsUsed(*each) for each in labels)
    for each in used:
        if [type(part) for part in (each.demonstration, each.author, each.edit)] != [str, str, int]:
            raise TypeError("labels without demonstration, author and edit")
    if not isinstance(settings, dict) or not isinstance(versions, dict):
        raise TypeError("settings or versions that are none")
    if not isinstance(settings.get("choice", {}), dict):
        raise TypeError("a choice of labels that is none")
    return {
        "time": datetime.fromisoformat(row["time"]),
        "settings": settings,
        "seed": row["seed"],
        "labels": used,
        "versions": versions,
    }


def _finite(text: str) -> float:
    """A number as JSON has them."""
    if not math.isfinite(value := float(text)):
        raise ValueError(f"{text} is no number")
    return value


def _json(value: list[list[str | int]] | dict[str, Any]) -> str:
    """A value as JSON."""
    return json.dumps(value, ensure_ascii=False)


#: Free pages of the store that are given back to the disk: so many bytes, and this share of it.
LEAST, SHARE = 1 << 20, 0.25
#: The last thing that a run's result names, where a recogniser belongs to it.
_OWN = re.compile(r'"recogniser": "([0-9a-f]{32})"\}$')
#: Characters at the end of a result in which that stands.
_END = 64
#: Who proposed something, as of :attr:`forcelab.review.run_result.RunResult.proposer`.
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
