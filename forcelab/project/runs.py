"""Recognisers and runs as rows and files: what was computed, with everything to repeat it."""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import os
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from typing import Any

from forcelab.errors import ForcelabError, InputError
from forcelab.project import files
from forcelab.project.database import Database, Value, fits
from forcelab.project.made import LabelsUsed, RunSummary, StoredRecogniser, StoredRun
from forcelab.project.records import utc_now
from forcelab.project.troubles import told_of_content

__all__ = [
    "DIGEST",
    "RECOGNISERS",
    "RUN",
    "clear_recognisers",
    "columns_of",
    "keep_recogniser",
    "keep_run",
    "keeping",
    "recogniser_id",
    "recogniser_of",
    "row_of_run",
    "run_of",
    "summaries",
]

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
        return StoredRecogniser(id=row["id"], name=row["name"], **_made(row))


def run_of(row: sqlite3.Row) -> StoredRun:
    """A run as stored, of a row of :data:`RUN`."""
    with told_of_content(f"What run {row['id']} found", "repeat it"):
        result = json.loads(row["result"])
    with _told_of_run(row):
        return StoredRun(id=row["id"], kind=row["kind"], result=result, **_made(row))


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
        return RunSummary(id=row["id"], kind=row["kind"], digest=_digest(front), **_made(row))


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


def _made(row: sqlite3.Row) -> dict[str, Any]:
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
