"""Recognisers and runs of a project: stored with everything to repeat them, and removed again.

A removal is whole or not at all, and no label changes by it: a verdict stays, without the number of
its run, and a label that was accepted from a prediction remembers the name of what proposed it.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import re
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime
from os import PathLike
from pathlib import Path
from typing import Any

from forcelab.errors import ForcelabError, InputError
from forcelab.project import files
from forcelab.project.database import Database, Value, content_errors, fits
from forcelab.project.files import RECOGNISERS
from forcelab.project.records import utc_now

#: What a result says of itself in few words, if this is its first key.
DIGEST = "digest"
#: Characters of a result that are read for its digest.
_FRONT_CHARACTERS = 4096
#: The columns of a run that say how it was made.
_PROVENANCE = "id, kind, time, settings, seed, labels, versions"
#: All of its columns; bytes that are no text are met where the result is parsed.
_RUN = f"{_PROVENANCE}, CAST(result AS BLOB) AS result"
#: The last thing that a run's result names, where a recogniser belongs to it.
_OWN_RECOGNISER = re.compile(r'"recogniser": "([0-9a-f]{32})"\}$')
#: Characters at the end of a result in which that stands.
_END_CHARACTERS = 64
#: The author of a run's proposals, :attr:`forcelab.review.run_result.RunResult.proposer`.
_PROPOSER = """(
    'model ' || coalesce(
        CASE WHEN json_valid(settings) THEN json_extract(settings, '$.preset') END, 'paper'
    ) || ' ' || id
)"""


@dataclass(frozen=True, slots=True)
class LabelsUsed:
    """Which labels of a demonstration something was computed from.

    Parameters
    ----------
    demonstration, author : str
        Its id, and whose labels were used.
    edit : int
        The latest edit of that track at the time; 0 where there was none.
    """

    demonstration: str
    author: str
    edit: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Provenance:
    """How a run or a recogniser was computed: everything needed to repeat it.

    Parameters
    ----------
    settings : dict
        Everything that was asked for, as JSON has it.
    seed : int or None
        The random seed, if there was one.
    labels : tuple of LabelsUsed
        What it was computed from, one for each demonstration; see ``tracks.head``.
    versions : dict of str to str
        Of the program and the libraries.
    time : datetime
        When it was made, in UTC; by default now.
    """

    settings: dict[str, Any]
    seed: int | None
    labels: tuple[LabelsUsed, ...]
    versions: dict[str, str]
    time: datetime = field(default_factory=utc_now)

    @property
    def demonstrations(self) -> tuple[str, ...]:
        """Ids of the demonstrations used, each once."""
        return tuple(dict.fromkeys(used.demonstration for used in self.labels))

    @property
    def choice(self) -> Mapping[str, Any]:
        """What data were asked for; empty where the settings do not tell."""
        return self.settings.get("choice", {})

    @property
    def tasks(self) -> tuple[str, ...]:
        """The tasks that it was trained on."""
        return tuple(self.choice.get("tasks", ()))

    @property
    def test_task(self) -> str | None:
        """The task tested on; None where demonstrations of the others were left out in turn."""
        return self.choice.get("test_task")


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredRecogniser(Provenance):
    """A trained recogniser's record; its file is opaque to the store.

    Attributes
    ----------
    id : str
        32 hex digits of the SHA-256 of its file.
    name : str
        For people; need not be unique.
    """

    id: str
    name: str


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSummary(Provenance):
    """A run without its result, which may be long.

    Attributes
    ----------
    id : int
        Its number in the project.
    kind : str
        Such as ``"evaluate"``.
    digest : dict
        What stands under "digest" in its result, if that comes first there; otherwise empty.
    """

    id: int
    kind: str
    digest: dict[str, Any]

    @property
    def title(self) -> str:
        """What was evaluated, such as ``"stylus"``; ``""`` where nothing was."""
        return str(self.digest.get("title", ""))

    @property
    def f1(self) -> float | None:
        """Pooled F1 at half overlap after the filters, 0 to 1; None where nothing was tested."""
        return self.digest.get("f1")


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredRun(Provenance):
    """An evaluation or another computation, with everything needed to repeat it.

    Attributes
    ----------
    id : int
        Its number in the project.
    kind : str
        Such as ``"evaluate"``.
    result : dict
        What came out, as JSON has it.
    """

    id: int
    kind: str
    result: dict[str, Any]


@dataclass(frozen=True, slots=True)
class RunUse:
    """What a run takes up, and what hangs on it.

    Attributes
    ----------
    run : int
        Its number.
    bytes : int
        Those of what it found, and of its recogniser's file.
    recogniser : str
        Id of the one that belongs to it; ``""`` where there is none, or none any more.
    verdicts, accepted : int
        How many verdicts were given on what it predicted, and how many edits took it over.
    """

    run: int
    bytes: int
    recogniser: str
    verdicts: int
    accepted: int


class RunStore:
    """The runs and recognisers of a project; ``project.runs``."""

    def __init__(self, database: Database) -> None:
        self._db = database

    def all(self) -> tuple[StoredRun, ...]:
        """Every run, the first one first."""
        return tuple(map(_run, self._db.all(f"SELECT {_RUN} FROM run ORDER BY id")))

    def get(self, number: int) -> StoredRun:
        """One run; InputError if there is none of this number, or it is damaged."""
        return _run(self._row(number))

    def summaries(self, kind: str | None = None) -> tuple[RunSummary, ...]:
        """Every run, or every run of a kind, without its result; the first one first."""
        rows = self._db.all(
            f"SELECT {_PROVENANCE}, CAST(substr(result, 1, {_FRONT_CHARACTERS}) AS BLOB) AS front "
            "FROM run WHERE ? IS NULL OR kind = ? ORDER BY id",
            kind,
            kind,
        )
        return tuple(map(_summary, rows))

    def add(self, kind: str, provenance: Provenance, result: Mapping[str, Any]) -> int:
        """Add a result, anything that JSON can hold, and how it was computed; gives its number.

        Its kind is such as ``"evaluate"``. InputError if that is blank or labels are not in the
        project.
        """
        columns = self._provenance_columns(provenance)
        if not kind.strip():
            raise InputError("A run needs a kind, such as 'evaluate'.")
        with self._db.writing():
            return self._db.insert("run", kind=kind, result=_to_json(dict(result)), **columns)

    def add_recogniser(
        self, name: str, data: bytes | str | PathLike[str], provenance: Provenance
    ) -> str:
        """Add a recogniser's file, or its content, and how it was made; gives its id.

        The same content is stored once, as it was added first; it stays opaque here. InputError if
        the name is blank, labels are not in the project or the file cannot be read.
        """
        with self._adding_recogniser(name, data, provenance) as id_:
            return id_

    def add_training(
        self,
        kind: str,
        name: str,
        content: bytes,
        provenance: Provenance,
        result: Mapping[str, Any],
        *,
        trained_on: tuple[LabelsUsed, ...],
    ) -> int:
        """Add a run and its recogniser, both or neither; gives the run's number.

        As :meth:`add` and :meth:`add_recogniser`, the latter with the labels `trained_on`. The
        recogniser's id is added to the result as ``"recogniser"``.
        """
        of_recogniser = replace(provenance, labels=trained_on)
        with self._adding_recogniser(name, content, of_recogniser) as id_:
            return self.add(kind, provenance, dict(result) | {"recogniser": id_})

    def recognisers(self) -> tuple[StoredRecogniser, ...]:
        """Every recogniser, the first one first."""
        return tuple(map(_recogniser, self._db.all("SELECT * FROM recogniser ORDER BY rowid")))

    def recogniser_path(self, id_: str) -> Path:
        """The file of a recogniser; InputError if there is no such one, or its file is missing."""
        if not self._db.one("SELECT 1 FROM recogniser WHERE id = ?", id_):
            raise InputError(
                f"There is no recogniser '{id_}' in '{self._db.folder}' any more; train it again."
            )
        path = self._recogniser_file(id_)
        files.check_file(path)
        if not path.is_file():
            raise InputError(f"The file '{path}' is missing; train the recogniser again.")
        return path

    def recogniser_bytes(self) -> dict[str, int]:
        """The size of each recogniser's file by its id; 0 where it is missing."""
        sizes = {}
        for row in self._db.all("SELECT id FROM recogniser ORDER BY rowid"):
            sizes[row["id"]] = 0
            with contextlib.suppress(OSError):
                sizes[row["id"]] = self._recogniser_file(row["id"]).stat().st_size
        return sizes

    def existing_labels(self, labels: Iterable[LabelsUsed]) -> tuple[LabelsUsed, ...]:
        """The labels whose demonstrations have not been removed meanwhile.

        What took minutes to compute from the others is worth storing.
        """
        existing_ids = self._db.demonstration_ids()
        return tuple(used for used in labels if used.demonstration in existing_ids)

    def uses(self, number: int | None = None) -> tuple[RunUse, ...]:
        """What every run, or only this one, takes up on the disk and what depends on it."""
        # The older way reads all of a result to tell how long it is.
        new = sqlite3.sqlite_version_info >= (3, 43)
        length = "octet_length(result)" if new else "length(CAST(result AS BLOB))"
        rows = self._db.all(
            # As bytes: a run that is no text can be removed, too.
            f"SELECT id, {length} AS bytes, "
            f"CAST(substr(result, {-_END_CHARACTERS}) AS BLOB) AS last, "
            "coalesce(verdicts, 0) AS verdicts, coalesce(accepted, 0) AS accepted FROM run "
            "LEFT JOIN (SELECT run AS judged, count(*) AS verdicts FROM verdict GROUP BY run) "
            "ON judged = id "
            "LEFT JOIN (SELECT proposed_by, count(*) AS accepted FROM edit "
            "WHERE proposed_by IS NOT NULL GROUP BY proposed_by) "
            f"ON proposed_by = {_PROPOSER} WHERE ? IS NULL OR id = ? ORDER BY id",
            number,
            number,
        )
        sizes = self.recogniser_bytes()
        uses = []
        for row in rows:
            match = _OWN_RECOGNISER.search(row["last"].decode(errors="replace"))
            id_ = match[1] if match is not None and match[1] in sizes else ""
            size = row["bytes"] + sizes.get(id_, 0)
            uses.append(RunUse(row["id"], size, id_, row["verdicts"], row["accepted"]))
        return tuple(uses)

    def remove(self, number: int) -> None:
        """Delete a run for good: its predictions and scores, and its recogniser.

        Labels stay, those accepted from its predictions, too, and still tell who proposed them;
        verdicts stay, but no longer tell which run they were given on. A recogniser that another
        run has as well stays. Room that is free then is given back to the disk.

        InputError if there is no such run.
        """
        with self._db.writing():
            self._row(number, "id")
            if self._db.one("SELECT 1 FROM verdict WHERE run = ?", number):
                with self._db.without_trigger("verdict_is_not_changed"):
                    self._db.execute("UPDATE verdict SET run = NULL WHERE run = ?", number)
            recogniser_id = self._delete(number)
        self._delete_file(recogniser_id)
        self._db.give_back()

    def forget(self, number: int, proposer: str) -> bool:
        """Delete a run that another one has taken the place of, with its recogniser.

        It stays where a verdict was given on it or labels were accepted from it, of which it was
        the `proposer`: what people said is kept for ever, with what they said it of. Gives whether
        it is gone.
        """
        with self._db.writing():
            exists = self._db.one("SELECT 1 FROM run WHERE id = ?", number)
            if (
                not exists
                or self._db.one("SELECT 1 FROM verdict WHERE run = ?", number)
                or self._db.one("SELECT 1 FROM edit WHERE proposed_by = ?", proposer)
                or self._db.one("SELECT 1 FROM author WHERE name = ?", proposer)
            ):
                return False
            recogniser_id = self._delete(number)
        self._delete_file(recogniser_id)  # the next run fills the room in the store
        return True

    def remove_recogniser(self, id_: str) -> None:
        """Delete a recogniser for good; a run that it belongs to keeps what it found.

        InputError if there is no such recogniser.
        """
        with self._db.writing():
            if not self._db.one("SELECT 1 FROM recogniser WHERE id = ?", id_):
                raise InputError(
                    f"There is no recogniser '{id_}' in '{self._db.folder}'; "
                    "'forcelab list --json' tells those that there are."
                )
            self._db.execute("DELETE FROM recogniser WHERE id = ?", id_)
        self._delete_file(id_)

    def clear_uncommitted(self) -> None:
        """Delete the files of recognisers that did not get as far as the store.

        Only marked ones: a file without a mark may be of a newer store in whose place this one was
        put.
        """
        root = self._db.folder / RECOGNISERS
        if not any(root.glob(f"*.{files.UNCOMMITTED}")):
            return
        with self._db.writing():  # another process that is just adding one holds it until then
            for mark in root.glob(f"*.{files.UNCOMMITTED}"):
                if not self._db.one("SELECT 1 FROM recogniser WHERE id = ?", mark.stem):
                    mark.with_suffix(".skops").unlink(missing_ok=True)
                mark.unlink(missing_ok=True)

    def _recogniser_file(self, id_: str) -> Path:
        return self._db.folder / RECOGNISERS / f"{id_}.skops"

    def _row(self, number: int, columns: str = _RUN) -> sqlite3.Row:
        """The row of a run that must exist; its result may be large, or damaged."""
        query = f"SELECT {columns} FROM run WHERE id = ?"
        row = self._db.one(query, int(number)) if fits(number) else None  # it may be NumPy's
        if row is None:
            raise InputError(
                f"There is no run {number} in '{self._db.folder}'; 'forcelab runs' lists those "
                "that there are."
            )
        return row

    def _provenance_columns(self, provenance: Provenance) -> dict[str, Value]:
        seed, labels = provenance.seed, provenance.labels
        if seed is not None and not fits(seed):
            raise InputError(f"The seed {seed} does not fit into 64 bits; use a smaller one.")
        for used in labels:
            self._check_labels(used)
        return {
            "time": provenance.time.isoformat(),
            "settings": _to_json(provenance.settings),
            "seed": seed,
            "labels": _to_json([[used.demonstration, used.author, used.edit] for used in labels]),
            "versions": _to_json(provenance.versions),
        }

    def _check_labels(self, used: LabelsUsed) -> None:
        """Refuse labels that were never there."""
        self._db.demonstration(used.demonstration)
        exists = used.edit == 0 or self._db.one(
            "SELECT 1 FROM edit JOIN track ON track.id = edit.track "
            "JOIN author ON author.id = track.author "
            "WHERE edit.id = ? AND demonstration = ? AND name = ?",
            used.edit,
            used.demonstration,
            used.author,
        )
        if not exists:
            raise InputError(
                f"Edit {used.edit} in '{self._db.folder}' is none of '{used.author}' over the "
                f"demonstration '{used.demonstration}'."
            )

    @contextlib.contextmanager
    def _adding_recogniser(
        self, name: str, data: bytes | str | PathLike[str], provenance: Provenance
    ) -> Iterator[str]:
        """A transaction that stores a recogniser, unless the same one is there; gives its id.

        Its file is marked until all of that is committed.
        """
        columns = self._provenance_columns(provenance)
        if not name.strip():
            raise InputError("A recogniser needs a name.")
        root = self._db.folder / RECOGNISERS
        with files.file_errors(f"The recogniser '{name}' was not added to '{self._db.folder}'"):
            content = data if isinstance(data, bytes) else Path(data).read_bytes()
            id_ = hashlib.sha256(content).hexdigest()[:32]
            mark = root / f"{id_}.{files.UNCOMMITTED}"
            try:
                with self._db.writing():
                    # Inside the transaction: a process that opens the project now would remove it.
                    files.mark_uncommitted(mark)
                    if not self._db.one("SELECT 1 FROM recogniser WHERE id = ?", id_):
                        with files.staging(root) as staged:
                            files.write_bytes(staged / f"{id_}.skops", content)
                            files.move_into(root, staged)
                        self._db.insert("recogniser", id=id_, name=name, **columns)
                    yield id_
            except BaseException:
                with contextlib.suppress(ForcelabError, OSError):  # the next opening does it
                    self.clear_uncommitted()
                raise
            with contextlib.suppress(OSError):
                mark.unlink(missing_ok=True)

    def _delete(self, number: int) -> str:
        """Delete the rows of a run and of its recogniser, in a transaction.

        Gives the recogniser's id, ``""`` where there is none or another run has it, too.
        """
        row = self._db.one(
            "SELECT CASE WHEN json_valid(result) THEN json_extract(result, '$.recogniser') END "
            "AS own FROM run WHERE id = ?",
            number,
        )
        self._db.execute("DELETE FROM run WHERE id = ?", number)
        recogniser_id = row["own"] if row is not None else None
        if recogniser_id is None or self._db.one(
            "SELECT 1 FROM run WHERE instr(result, ?)", recogniser_id
        ):
            return ""
        self._db.execute("DELETE FROM recogniser WHERE id = ?", recogniser_id)
        return str(recogniser_id)

    def _delete_file(self, id_: str) -> None:
        """Delete the file of a recogniser, which without its row only takes up room."""
        if id_:
            with contextlib.suppress(OSError):
                self._recogniser_file(id_).unlink(missing_ok=True)


def _recogniser(row: sqlite3.Row) -> StoredRecogniser:
    cure = f"remove it with 'forcelab remove --recogniser {row['id'][:8]}'"
    with content_errors(f"The recogniser '{row['name']}'", cure):
        return StoredRecogniser(id=row["id"], name=row["name"], **_provenance(row))


def _run(row: sqlite3.Row) -> StoredRun:
    with content_errors(f"What run {row['id']} found", "repeat it"):
        result = json.loads(row["result"])
    with _run_errors(row):
        return StoredRun(id=row["id"], kind=row["kind"], result=result, **_provenance(row))


def _summary(row: sqlite3.Row) -> RunSummary:
    front = row["front"].decode(errors="replace")
    with _run_errors(row):
        return RunSummary(id=row["id"], kind=row["kind"], digest=_digest(front), **_provenance(row))


def _run_errors(row: sqlite3.Row) -> contextlib.AbstractContextManager[None]:
    number = row["id"]
    return content_errors(f"Run {number}", f"remove it with 'forcelab remove --run {number}'")


def _digest(front: str) -> dict[str, Any]:
    """The digest at the front of a result; empty where there is none."""
    start = f'{{"{DIGEST}": '
    if not front.startswith(start):
        return {}
    try:
        record, _ = json.JSONDecoder().raw_decode(front, len(start))
    except (ValueError, RecursionError):
        return {}
    return record if isinstance(record, dict) else {}


def _provenance(row: sqlite3.Row) -> dict[str, Any]:
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
    """A number; JSON's own parser takes infinities too."""
    if not math.isfinite(value := float(text)):
        raise ValueError(f"{text} is no number")
    return value


def _to_json(value: list[list[str | int]] | dict[str, Any]) -> str:
    return json.dumps(value, ensure_ascii=False)
