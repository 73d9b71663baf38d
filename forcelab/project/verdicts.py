"""What became of predictions: verdicts on them, append-only, and which labels come from them."""

from __future__ import annotations

import math
import sqlite3
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from forcelab.errors import InputError
from forcelab.labels import Segment, Track
from forcelab.project.database import Database, fits, time_of
from forcelab.project.folder import ProjectFolder
from forcelab.project.label_provenance import Origins
from forcelab.project.loading import known_id, row_of
from forcelab.project.records import (
    VERDICT_KINDS,
    Edit,
    Origin,
    StoredVerdict,
    Verdict,
    changed_labels,
    utc_now,
)


class ProjectJudged(ProjectFolder):
    """The verdicts of a :class:`~forcelab.project.Project`, and the origins of its labels."""

    def __init__(self, path: Path, database: Database) -> None:
        super().__init__(path, database)
        self._origins = Origins(database)

    def add_verdict(self, verdict: Verdict) -> StoredVerdict:
        """Keep a verdict for ever; no label changes.

        Parameters
        ----------
        verdict : Verdict
            One of the kind ``"withdrawn"`` takes back what was said of the same place before.

        Returns
        -------
        StoredVerdict
            With its number, and with the time now where it had none.

        Raises
        ------
        InputError
            If there is no such demonstration or run, the stretch is empty, or a name is blank.
        """
        return self.add_verdicts((verdict,))[0]

    def add_verdicts(self, verdicts: Iterable[Verdict]) -> tuple[StoredVerdict, ...]:
        """Keep several verdicts as one transaction, all or nothing; see :meth:`add_verdict`."""
        verdicts = tuple(verdicts)
        with self._db.writing():
            return tuple(_added(self._db, verdict) for verdict in verdicts)

    def verdicts(self, demonstration: str | None = None) -> tuple[StoredVerdict, ...]:
        """The verdicts that count: of each place the latest, unless it was withdrawn.

        A place is a stretch of a coder's labels over a demonstration with what coder and model see
        there; see :attr:`Verdict.place`.

        Parameters
        ----------
        demonstration : str, optional
            Its id; by default those on all demonstrations.

        Returns
        -------
        tuple of StoredVerdict
            In the order in which they were given.
        """
        latest = {verdict.place: verdict for verdict in self._verdicts(demonstration)}
        kept = (verdict for verdict in latest.values() if verdict.verdict != "withdrawn")
        return tuple(sorted(kept, key=lambda verdict: verdict.id))

    def verdict_events(self) -> tuple[StoredVerdict, ...]:
        """Every verdict ever given, the first one first."""
        return self._verdicts(None)

    def origins(self, demonstration: str, author: str) -> Mapping[Segment, Origin]:
        """Which segments of a track, as it is now, a model proposed; what is human is left out.

        A segment keeps its origin, as changed, while a hand moves its edges, splits it, or merges
        it with others; one that gets another action is the coder's. What is taken back takes
        origins back as well.

        Parameters
        ----------
        demonstration, author : str
            Whose track over what.

        Returns
        -------
        mapping of Segment to Origin
            Stays as it is when the track is edited. The same object as long as nothing in it
            changes, so that it costs a query of the latest edit only.

        Raises
        ------
        InputError
            If there is no such demonstration.
        """
        origins = self._origins.of(demonstration, author)
        if origins is None:
            known_id(self._db, demonstration)
            return {}
        return origins

    def _verdicts(self, demonstration: str | None) -> tuple[StoredVerdict, ...]:
        """Every verdict on a demonstration, or on all of them, the first one first."""
        which, values = (
            ("", []) if demonstration is None else ("WHERE demonstration = ?", [demonstration])
        )
        rows = self._db.all(f"SELECT * FROM verdict {which} ORDER BY id", *values)
        return tuple(_verdict(row) for row in rows)


def follow_edit(database: Database, edit: Edit, original: Edit) -> None:
    """Withdraw the verdict for which labels were edited when that is undone; renew it when redone.

    It has the time of its edit. Needs a transaction around it.
    """
    rows = database.all(
        "SELECT * FROM verdict WHERE demonstration = ? AND coder = ? AND time = ?",
        original.demonstration,
        original.author,
        original.time.isoformat(),
    )
    given = {verdict.place: verdict for verdict in map(_verdict, rows) if changed_labels(verdict)}
    for place, verdict in given.items():
        latest = database.one(
            "SELECT verdict, time FROM verdict WHERE demonstration = ? AND coder = ? "
            "AND start = ? AND end = ? AND human IS ? AND predicted IS ? ORDER BY id DESC LIMIT 1",
            *place,
        )
        assert latest is not None
        if edit.kind == "redo" and latest["verdict"] == "withdrawn":
            _added(database, verdict)
        elif edit.kind == "undo" and latest["verdict"] == "model":
            _added(database, replace(verdict, verdict="withdrawn", time=edit.time))


def _added(database: Database, verdict: Verdict) -> StoredVerdict:
    """Write one verdict down."""
    _check(database, verdict)
    number = database.insert(
        "verdict",
        demonstration=verdict.demonstration,
        author=verdict.author,
        coder=verdict.coder,
        start=float(verdict.start),
        end=float(verdict.end),
        human=verdict.human,
        predicted=verdict.predicted,
        verdict=verdict.verdict,
        run=verdict.run if verdict.run is None or _has_run(database, verdict.run) else None,
        time=(verdict.time or utc_now()).isoformat(),
    )
    row = database.one("SELECT * FROM verdict WHERE id = ?", number)
    assert row is not None
    return _verdict(row)


def _check(database: Database, verdict: Verdict) -> None:
    """Refuse a verdict on what is not there."""
    name = row_of(database, verdict.demonstration)["name"]
    Track(verdict.author)  # refuses an author without a name
    Track(verdict.coder)
    if verdict.verdict not in VERDICT_KINDS:
        raise InputError(
            f"'{verdict.verdict}' is no verdict; use one of {', '.join(VERDICT_KINDS)}."
        )
    start, end = verdict.start, verdict.end
    if not (math.isfinite(start) and math.isfinite(end) and start < end):
        raise InputError(
            f"A verdict on '{name}' must last some time, not go from {start} s to {end} s."
        )
    if verdict.human == "" or verdict.predicted == "":
        raise InputError(f"A verdict on '{name}' names no action; use None for unlabelled.")
    if verdict.run is not None and not _had_run(database, verdict.run):
        raise InputError(f"There is no run {verdict.run} in '{database.folder}'.")


def _had_run(database: Database, number: int) -> bool:
    """Whether there is such a run, or was one: another window may have let go of it."""
    newest = database.one("SELECT seq FROM sqlite_sequence WHERE name = 'run'")
    return _has_run(database, number) or (newest is not None and 0 < number <= newest["seq"])


def _has_run(database: Database, number: int) -> bool:
    """Whether there is such a run; a number that SQLite cannot hold is none."""
    return fits(number) and database.one("SELECT 1 FROM run WHERE id = ?", number) is not None


def _verdict(row: sqlite3.Row) -> StoredVerdict:
    """A verdict as stored."""
    return StoredVerdict(
        demonstration=row["demonstration"],
        author=row["author"],
        coder=row["coder"],
        start=row["start"],
        end=row["end"],
        human=row["human"],
        predicted=row["predicted"],
        verdict=row["verdict"],
        run=row["run"],
        time=time_of(row, f"Verdict {row['id']}"),
        id=row["id"],
    )
