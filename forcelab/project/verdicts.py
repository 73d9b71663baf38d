"""Verdicts on places where labels and predictions differ: append-only, as the edits are."""

from __future__ import annotations

import math
import sqlite3
from collections.abc import Iterable
from datetime import datetime

from forcelab.errors import InputError
from forcelab.labels import Track
from forcelab.project.database import Database
from forcelab.project.decisions import VERDICT_KINDS, StoredVerdict, Verdict
from forcelab.project.loading import row_of
from forcelab.project.records import utc_now

__all__ = ["Verdicts"]


class Verdicts:
    """All verdicts of a project, each method as of :class:`Project`."""

    def __init__(self, database: Database) -> None:
        self._db = database

    def events(self, demonstration: str | None) -> tuple[StoredVerdict, ...]:
        """Every verdict on a demonstration, or on all of them, the first one first."""
        condition, values = "", []
        if demonstration is not None:
            condition, values = "WHERE demonstration = ?", [demonstration]
        rows = self._db.all(f"SELECT * FROM verdict {condition} ORDER BY id", *values)
        return tuple(_verdict(row) for row in rows)

    def counting(self, demonstration: str | None) -> tuple[StoredVerdict, ...]:
        """The latest verdict on each place, those left out that were withdrawn."""
        latest = {verdict.place: verdict for verdict in self.events(demonstration)}
        kept = (verdict for verdict in latest.values() if verdict.verdict != "withdrawn")
        return tuple(sorted(kept, key=lambda verdict: verdict.id))

    def add(self, verdicts: Iterable[Verdict]) -> tuple[StoredVerdict, ...]:
        """Write verdicts down, all or none of them."""
        verdicts = tuple(verdicts)
        with self._db.writing():
            return tuple(self._add(verdict) for verdict in verdicts)

    def _add(self, verdict: Verdict) -> StoredVerdict:
        """Write one verdict down."""
        self._check(verdict)
        number = self._db.execute(
            "INSERT INTO verdict (demonstration, author, coder, start, end, human, predicted, "
            "verdict, run, time) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
            verdict.demonstration,
            verdict.author,
            verdict.coder,
            float(verdict.start),
            float(verdict.end),
            verdict.human,
            verdict.predicted,
            verdict.verdict,
            verdict.run if verdict.run is None or self._has_run(verdict.run) else None,
            (verdict.time or utc_now()).isoformat(),
        ).lastrowid
        row = self._db.one("SELECT * FROM verdict WHERE id = ?", number)
        assert row is not None
        return _verdict(row)

    def _check(self, verdict: Verdict) -> None:
        """Refuse a verdict on what is not there."""
        name = row_of(self._db, verdict.demonstration)["name"]
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
        if verdict.run is not None and not self._had_run(verdict.run):
            raise InputError(f"There is no run {verdict.run} in '{self._db.folder}'.")

    def _had_run(self, number: int) -> bool:
        """Whether there is such a run, or was one: another window may have let go of it."""
        newest = self._db.one("SELECT seq FROM sqlite_sequence WHERE name = 'run'")
        return self._has_run(number) or (newest is not None and 0 < number <= newest["seq"])

    def _has_run(self, number: int) -> bool:
        """Whether there is such a run; a number that SQLite cannot hold is none."""
        fits = -(2**63) <= number < 2**63
        return fits and self._db.one("SELECT 1 FROM run WHERE id = ?", number) is not None


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
        time=datetime.fromisoformat(row["time"]),
        id=row["id"],
    )
