"""Recognisers and runs: what was computed, with everything needed to repeat it."""

from __future__ import annotations

import hashlib
import json
import os
import sqlite3
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any

from forcelab.errors import InputError
from forcelab.project import files
from forcelab.project.database import Database, Value
from forcelab.project.history import net_edits
from forcelab.project.made import LabelsUsed, RunSummary, StoredRecogniser, StoredRun
from forcelab.project.records import utc_now

__all__ = ["DIGEST", "RECOGNISERS", "Making", "Runs"]

#: Name of the folder that holds one file per recogniser.
RECOGNISERS = "recognisers"
#: What a result says of itself in few words, if this is its first key.
DIGEST = "digest"
#: Characters of a result that are read for its digest.
_FRONT = 4096


@dataclass(frozen=True, slots=True)
class Making:
    """How a recogniser or a run is made; see :class:`~forcelab.project.made.Made`."""

    settings: Mapping[str, Any]
    seed: int | None
    labels: Sequence[LabelsUsed]
    versions: Mapping[str, str]
    time: datetime | None = None


class Runs:
    """All recognisers and runs of a project, each method as of :class:`Project`."""

    def __init__(self, database: Database) -> None:
        self._db = database

    def add_recogniser(self, name: str, data: bytes | Path, made: Making) -> str:
        """Keep a recogniser's file and how it was made; gives its id."""
        columns = self._columns(made)
        root = self._db.folder / RECOGNISERS
        with files.told(f"The recogniser '{name}' was not added to '{self._db.folder}'"):
            content = data if isinstance(data, bytes) else data.read_bytes()
            id_ = _id_of(content)
            with files.staging(root) as staged, self._db.writing():
                self._keep(staged, {"id": id_, "name": name, **columns}, content)
        return id_

    def add_training(
        self,
        kind: str,
        made: Making,
        result: Mapping[str, Any],
        recogniser: tuple[str, bytes, Sequence[LabelsUsed]],
    ) -> int:
        """Keep a run and the recogniser that belongs to it, both or neither."""
        name, content, labels = recogniser
        id_ = _id_of(content)
        columns = self._columns(made)
        row = {"id": id_, "name": name, **self._columns(replace(made, labels=labels))}
        text = _json(dict(result) | {"recogniser": id_})
        root = self._db.folder / RECOGNISERS
        with (
            files.told(f"The recogniser '{name}' was not added to '{self._db.folder}'"),
            files.staging(root) as staged,
            self._db.writing(),
        ):
            number = self._keep_run(kind, text, columns)
            self._keep(staged, row, content)
        return number

    def _keep_run(self, kind: str, result: str, columns: Mapping[str, Value]) -> int:
        """Write a run, in a transaction; gives its number."""
        if not kind.strip():
            raise InputError("A run needs a kind, such as 'evaluate'.")
        return self._insert("run", {"kind": kind, "result": result, **columns})

    def _keep(self, staged: Path, row: Mapping[str, Value], content: bytes) -> None:
        """Write a recogniser, in a transaction, unless the same one is there."""
        if not str(row["name"]).strip():
            raise InputError("A recogniser needs a name.")
        if self._db.one("SELECT 1 FROM recogniser WHERE id = ?", row["id"]):
            return
        with (staged / f"{row['id']}.skops").open("xb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        files.move_into(self._db.folder / RECOGNISERS, staged)
        self._insert("recogniser", row)

    def recognisers(self) -> tuple[StoredRecogniser, ...]:
        """Every recogniser, the first one first."""
        rows = self._db.all("SELECT * FROM recogniser ORDER BY rowid")
        return tuple(StoredRecogniser(id=row["id"], name=row["name"], **_made(row)) for row in rows)

    def recogniser_path(self, id_: str) -> Path:
        """The file of a recogniser."""
        if not self._db.one("SELECT 1 FROM recogniser WHERE id = ?", id_):
            raise InputError(
                f"There is no recogniser '{id_}' in '{self._db.folder}' any more; train it again."
            )
        path = self._db.folder / RECOGNISERS / f"{id_}.skops"
        if not path.is_file():
            raise InputError(f"The file '{path}' is missing; train the recogniser again.")
        return path

    def add_run(self, kind: str, made: Making, result: Mapping[str, Any]) -> int:
        """Keep what was computed, and how; gives its number."""
        columns = self._columns(made)
        with self._db.writing():
            return self._keep_run(kind, _json(dict(result)), columns)

    def runs(self) -> tuple[StoredRun, ...]:
        """Every run, the first one first."""
        return tuple(_run(row) for row in self._db.all("SELECT * FROM run ORDER BY id"))

    def summaries(self, kind: str | None) -> tuple[RunSummary, ...]:
        """Every run of a kind without its result, the first one first."""
        rows = self._db.all(
            "SELECT id, kind, time, settings, seed, labels, versions, "
            f"substr(result, 1, {_FRONT}) AS front FROM run "
            "WHERE ? IS NULL OR kind = ? ORDER BY id",
            kind,
            kind,
        )
        return tuple(
            RunSummary(id=row["id"], kind=row["kind"], digest=_digest(row["front"]), **_made(row))
            for row in rows
        )

    def edits_since(self, labels: Sequence[LabelsUsed], tasks: Sequence[str]) -> int:
        """How many edits labels have had since, and demonstrations their tasks."""
        used = _json([[used.demonstration, used.author, used.edit] for used in labels])
        edited = self._db.all(
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
        new = self._db.one(
            """
            SELECT count(*) AS number FROM demonstration
            WHERE task IN (SELECT value FROM json_each(?))
              AND id NOT IN (SELECT json_extract(value, '$[0]') FROM json_each(?))
            """,
            json.dumps(list(tasks)),
            used,
        )
        assert new is not None
        return int(new["number"]) + sum(
            net_edits(self._db, row["track"], row["edit"]) for row in edited
        )

    def run(self, number: int) -> StoredRun:
        """One run."""
        row = self._db.one("SELECT * FROM run WHERE id = ?", number)
        if row is None:
            raise InputError(
                f"There is no run {number} in '{self._db.folder}'; 'forcelab runs' lists those "
                "that there are."
            )
        return _run(row)

    def _columns(self, made: Making) -> dict[str, Value]:
        """The columns that say how a thing was made; the labels must be there."""
        if made.seed is not None and not -(2**63) <= made.seed < 2**63:
            raise InputError(f"The seed {made.seed} does not fit into 64 bits; use a smaller one.")
        for used in made.labels:
            self._check(used)
        return {
            "time": (made.time or utc_now()).isoformat(),
            "settings": _json(dict(made.settings)),
            "seed": made.seed,
            "labels": _json([[used.demonstration, used.author, used.edit] for used in made.labels]),
            "versions": _json(dict(made.versions)),
        }

    def _check(self, used: LabelsUsed) -> None:
        """Refuse labels that were never there."""
        if not self._db.one("SELECT 1 FROM demonstration WHERE id = ?", used.demonstration):
            raise InputError(
                f"There is no demonstration '{used.demonstration}' in '{self._db.folder}'."
            )
        found = used.edit == 0 or self._db.one(
            "SELECT 1 FROM edit JOIN track ON track.id = edit.track "
            "JOIN author ON author.id = track.author "
            "WHERE edit.id = ? AND demonstration = ? AND name = ?",
            used.edit,
            used.demonstration,
            used.author,
        )
        if not found:
            raise InputError(
                f"Edit {used.edit} in '{self._db.folder}' is none of '{used.author}' over the "
                f"demonstration '{used.demonstration}'."
            )

    def _insert(self, table: str, values: Mapping[str, Value]) -> int:
        """Insert a row; gives its number."""
        marks = ", ".join("?" * len(values))
        sql = f"INSERT INTO {table} ({', '.join(values)}) VALUES ({marks})"
        number = self._db.execute(sql, *values.values()).lastrowid
        assert number is not None
        return number


def _id_of(content: bytes) -> str:
    """What a recogniser of this content is called in the store."""
    return hashlib.sha256(content).hexdigest()[:32]


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


def _run(row: sqlite3.Row) -> StoredRun:
    """A run as stored."""
    try:
        result = json.loads(row["result"])
    except (ValueError, RecursionError) as error:
        raise InputError(
            f"What run {row['id']} found is damaged in the store; repeat it, or restore the store "
            f"from a copy."
        ) from error
    return StoredRun(id=row["id"], kind=row["kind"], result=result, **_made(row))


def _made(row: sqlite3.Row) -> dict[str, Any]:
    """How a thing was made, as stored."""
    return {
        "time": datetime.fromisoformat(row["time"]),
        "settings": json.loads(row["settings"]),
        "seed": row["seed"],
        "labels": tuple(LabelsUsed(*used) for used in json.loads(row["labels"])),
        "versions": json.loads(row["versions"]),
    }


def _json(value: list[list[str | int]] | dict[str, Any]) -> str:
    """A value as JSON."""
    return json.dumps(value, ensure_ascii=False)
