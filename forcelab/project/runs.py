"""Recognisers and runs: what was computed, with everything needed to repeat it."""

from __future__ import annotations

import hashlib
import json
import os
import sqlite3
from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from forcelab.errors import InputError
from forcelab.project import files
from forcelab.project.database import Database, Value
from forcelab.project.records import Recogniser, Run, utc_now

__all__ = ["RECOGNISERS", "Runs"]

#: Name of the folder that holds one file per recogniser.
RECOGNISERS = "recognisers"


class Runs:
    """The part of a :class:`~forcelab.project.Project` that keeps recognisers and runs."""

    def __init__(self, database: Database) -> None:
        self._db = database

    def add_recogniser(
        self,
        name: str,
        data: bytes | Path,
        *,
        settings: Mapping[str, Any],
        seed: int | None,
        demonstrations: Sequence[str],
        versions: Mapping[str, str],
        time: datetime | None = None,
    ) -> str:
        """Keep a recogniser's file, which stays opaque here, and how it was made.

        Parameters
        ----------
        name : str
            For people; not blank.
        data : bytes or Path
            Its content, or the file. The same content is kept once, as it was added first.
        settings : mapping
            Everything that training was told; anything that JSON can hold.
        seed : int or None
            The random seed.
        demonstrations : sequence of str
            Ids of what it was trained on.
        versions : mapping of str to str
            Of the program and the libraries.
        time : datetime, optional
            When it was made, in UTC; by default now.

        Returns
        -------
        str
            Its id.

        Raises
        ------
        InputError
            If it has no name, a demonstration is not in the project or the file cannot be read.
        """
        if not name.strip():
            raise InputError("A recogniser needs a name.")
        made = self._making(settings, seed, demonstrations, versions, time)
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
                self._insert("recogniser", {"id": id_, "name": name, **made})
        return id_

    def recognisers(self) -> tuple[Recogniser, ...]:
        """Every recogniser, the first one first."""
        rows = self._db.all("SELECT * FROM recogniser ORDER BY rowid")
        return tuple(Recogniser(id=row["id"], name=row["name"], **_made(row)) for row in rows)

    def recogniser_path(self, id_: str) -> Path:
        """The file of a recogniser.

        Raises
        ------
        InputError
            If there is no such recogniser or its file is missing.
        """
        if not self._db.one("SELECT 1 FROM recogniser WHERE id = ?", id_):
            raise InputError(f"There is no recogniser '{id_}' in '{self._db.folder}'.")
        path = self._db.folder / RECOGNISERS / f"{id_}.skops"
        if not path.is_file():
            raise InputError(f"The file '{path}' is missing; train the recogniser again.")
        return path

    def add_run(
        self,
        kind: str,
        *,
        settings: Mapping[str, Any],
        seed: int | None,
        demonstrations: Sequence[str],
        versions: Mapping[str, str],
        result: Mapping[str, Any],
        time: datetime | None = None,
    ) -> int:
        """Keep what was computed, and how.

        Parameters
        ----------
        kind : str
            Such as ``"evaluate"``; not blank.
        settings, seed, demonstrations, versions, time
            As of :meth:`add_recogniser`.
        result : mapping
            What came out; anything that JSON can hold.

        Returns
        -------
        int
            Its number.

        Raises
        ------
        InputError
            If it has no kind or a demonstration is not in the project.
        """
        if not kind.strip():
            raise InputError("A run needs a kind, such as 'evaluate'.")
        made = self._making(settings, seed, demonstrations, versions, time)
        with self._db.writing():
            return self._insert("run", {"kind": kind, "result": _json(dict(result)), **made})

    def runs(self) -> tuple[Run, ...]:
        """Every run, the first one first."""
        return tuple(_run(row) for row in self._db.all("SELECT * FROM run ORDER BY id"))

    def run(self, number: int) -> Run:
        """One run.

        Raises
        ------
        InputError
            If there is no such run.
        """
        row = self._db.one("SELECT * FROM run WHERE id = ?", number)
        if row is None:
            raise InputError(f"There is no run {number} in '{self._db.folder}'.")
        return _run(row)

    def _making(
        self,
        settings: Mapping[str, Any],
        seed: int | None,
        demonstrations: Sequence[str],
        versions: Mapping[str, str],
        time: datetime | None,
    ) -> dict[str, Value]:
        """The columns that say how a thing was made; the demonstrations must be there."""
        if seed is not None and not -(2**63) <= seed < 2**63:
            raise InputError(f"The seed {seed} does not fit into 64 bits; use a smaller one.")
        known = {row["id"] for row in self._db.all("SELECT id FROM demonstration")}
        for id_ in demonstrations:
            if id_ not in known:
                raise InputError(f"There is no demonstration '{id_}' in '{self._db.folder}'.")
        return {
            "time": (time or utc_now()).isoformat(),
            "settings": _json(dict(settings)),
            "seed": seed,
            "demonstrations": _json(list(demonstrations)),
            "versions": _json(dict(versions)),
        }

    def _insert(self, table: str, values: Mapping[str, Value]) -> int:
        """Insert a row; gives its number."""
        marks = ", ".join("?" * len(values))
        sql = f"INSERT INTO {table} ({', '.join(values)}) VALUES ({marks})"
        number = self._db.execute(sql, *values.values()).lastrowid
        assert number is not None
        return number


def _run(row: sqlite3.Row) -> Run:
    """A run as stored."""
    return Run(id=row["id"], kind=row["kind"], result=json.loads(row["result"]), **_made(row))


def _made(row: sqlite3.Row) -> dict[str, Any]:
    """How a thing was made, as stored."""
    return {
        "time": datetime.fromisoformat(row["time"]),
        "settings": json.loads(row["settings"]),
        "seed": row["seed"],
        "demonstrations": tuple(json.loads(row["demonstrations"])),
        "versions": json.loads(row["versions"]),
    }


def _json(value: list[str] | dict[str, Any]) -> str:
    """A value as JSON."""
    return json.dumps(value, ensure_ascii=False)
