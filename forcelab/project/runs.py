"""Recognisers and runs: what was computed, with everything needed to repeat it."""

from __future__ import annotations

import hashlib
import json
import os
import sqlite3
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from forcelab.errors import InputError
from forcelab.project import files
from forcelab.project.database import Database, Value
from forcelab.project.records import LabelsUsed, StoredRecogniser, StoredRun, utc_now

__all__ = ["RECOGNISERS", "Made", "Runs"]

#: Name of the folder that holds one file per recogniser.
RECOGNISERS = "recognisers"


@dataclass(frozen=True, slots=True)
class Made:
    """How a recogniser or a run was made; see :class:`~forcelab.project.StoredRecogniser`."""

    settings: Mapping[str, Any]
    seed: int | None
    labels: Sequence[LabelsUsed]
    versions: Mapping[str, str]
    time: datetime | None = None


class Runs:
    """All recognisers and runs of a project, each method as of :class:`Project`."""

    def __init__(self, database: Database) -> None:
        self._db = database

    def add_recogniser(self, name: str, data: bytes | Path, made: Made) -> str:
        """Keep a recogniser's file and how it was made; gives its id."""
        if not name.strip():
            raise InputError("A recogniser needs a name.")
        columns = self._columns(made)
        root = self._db.folder / RECOGNISERS
        with files.told(f"The recogniser '{name}' was not added to '{self._db.folder}'"):
            content = data if isinstance(data, bytes) else data.read_bytes()
            id_ = hashlib.sha256(content).hexdigest()[:32]
            with files.staging(root) as staged, self._db.writing():
                if self._db.one("SELECT 1 FROM recogniser WHERE id = ?", id_):
                    return id_
                with (staged / f"{id_}.skops").open("xb") as stream:
                    stream.write(content)
                    stream.flush()
                    os.fsync(stream.fileno())
                files.move_into(root, staged)
                self._insert("recogniser", {"id": id_, "name": name, **columns})
        return id_

    def recognisers(self) -> tuple[StoredRecogniser, ...]:
        """Every recogniser, the first one first."""
        rows = self._db.all("SELECT * FROM recogniser ORDER BY rowid")
        return tuple(StoredRecogniser(id=row["id"], name=row["name"], **_made(row)) for row in rows)

    def recogniser_path(self, id_: str) -> Path:
        """The file of a recogniser."""
        if not self._db.one("SELECT 1 FROM recogniser WHERE id = ?", id_):
            raise InputError(f"There is no recogniser '{id_}' in '{self._db.folder}'.")
        path = self._db.folder / RECOGNISERS / f"{id_}.skops"
        if not path.is_file():
            raise InputError(f"The file '{path}' is missing; train the recogniser again.")
        return path

    def add_run(self, kind: str, made: Made, result: Mapping[str, Any]) -> int:
        """Keep what was computed, and how; gives its number."""
        if not kind.strip():
            raise InputError("A run needs a kind, such as 'evaluate'.")
        columns = self._columns(made)
        with self._db.writing():
            return self._insert("run", {"kind": kind, "result": _json(dict(result)), **columns})

    def runs(self) -> tuple[StoredRun, ...]:
        """Every run, the first one first."""
        return tuple(_run(row) for row in self._db.all("SELECT * FROM run ORDER BY id"))

    def run(self, number: int) -> StoredRun:
        """One run."""
        row = self._db.one("SELECT * FROM run WHERE id = ?", number)
        if row is None:
            raise InputError(f"There is no run {number} in '{self._db.folder}'.")
        return _run(row)

    def _columns(self, made: Made) -> dict[str, Value]:
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


def _run(row: sqlite3.Row) -> StoredRun:
    """A run as stored."""
    return StoredRun(id=row["id"], kind=row["kind"], result=json.loads(row["result"]), **_made(row))


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
