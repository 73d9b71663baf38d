"""Coders' assignments, notes and verdicts on predictions: append-only, as the edits are.

An assignment follows from its events, the latest of which counts. So it stays known when a coder
who saw the others' labels, because the assignment was done or open, labels on.
"""

from __future__ import annotations

import json
import math
import sqlite3
from collections.abc import Iterable
from dataclasses import replace
from datetime import datetime, timedelta, timezone
from typing import Any

from forcelab.errors import InputError
from forcelab.labels import check_author, is_model
from forcelab.project.database import Database, fits, read_time
from forcelab.project.records import (
    VERDICT_KINDS,
    Assignment,
    AssignmentEvent,
    AssignmentKind,
    Author,
    Edit,
    Note,
    StoredVerdict,
    Verdict,
    changed_labels,
    utc_now,
)

#: The shortest time that a note can be later than another one.
_TICK = timedelta(microseconds=1)


class CodingStore:
    """Coders, what is assigned to them, their notes and verdicts; ``project.coding``."""

    def __init__(self, database: Database) -> None:
        self._db = database

    def authors(self) -> tuple[Author, ...]:
        """Everybody who made an edit, in order of first appearance."""
        rows = self._db.all("SELECT name, kind FROM author ORDER BY id")
        return tuple(Author(row["name"], row["kind"]) for row in rows)

    def coders(self) -> tuple[str, ...]:
        """The people who made an edit, by name, in order of first appearance: no models."""
        return tuple(author.name for author in self.authors() if author.kind == "coder")

    def people(self) -> tuple[str, ...]:
        """All people the project knows by name: coders, then those assigned, then note writers.

        A coder who is to label blind has to be found under the very name of the assignment.
        """
        assigned = (assignment.author for assignment in self.assignments())
        noted = (note.author for note in self.notes())
        return tuple(dict.fromkeys([*self.coders(), *assigned, *noted]))

    def assign(self, demonstration: str, author: str, blind: bool = True) -> Assignment:
        """Assign a demonstration to a coder, who need not have labelled anything yet.

        With `blind` the other tracks and all predictions are hidden from the coder until it is
        done. What is assigned already keeps its time and whether it is done.

        Raises
        ------
        InputError
            If the author has no name or is a model.
        """
        with self._db.writing():
            self._db.demonstration(demonstration)
            self._check_coder(author, "are assigned to label")
            assignment = self._assignment(demonstration, author)
            if assignment is None or assignment.blind != blind:
                self._insert_assignment(demonstration, author, "blind" if blind else "open")
            return self._standing_assignment(demonstration, author)

    def unassign(self, demonstration: str, author: str) -> None:
        """Take an assignment back; InputError if there is none. No label changes."""
        with self._db.writing():
            self._standing_assignment(demonstration, author)
            self._insert_assignment(demonstration, author, "removed")

    def set_done(self, demonstration: str, author: str, done: bool = True) -> Assignment:
        """Mark a demonstration as done by a coder, or open it again; both are kept for ever.

        What is not assigned to the coder is assigned openly when it is marked as done.

        Raises
        ------
        InputError
            If the author has no name or is a model, or what is to be opened again is not assigned
            to the author.
        """
        with self._db.writing():
            if done and self._assignment(demonstration, author) is None:
                self._db.demonstration(demonstration)
                self._check_coder(author, "mark as done")
                self._insert_assignment(demonstration, author, "open")
            assignment = self._standing_assignment(demonstration, author)
            if (assignment.done is not None) != done:
                self._insert_assignment(demonstration, author, "done" if done else "reopened")
            return self._standing_assignment(demonstration, author)

    def assignments(self, author: str | None = None) -> tuple[Assignment, ...]:
        """The assignments that stand, of everybody or of one coder, the first one first."""
        condition = () if author is None else ("author = ?", author)
        return tuple(_assignments_after(self._assignment_events(*condition)).values())

    def is_blind(self, demonstration: str, author: str) -> bool:
        """Whether the other tracks and all predictions are to be hidden from a coder now."""
        assignment = self._assignment(demonstration, author)
        return assignment is not None and assignment.hides

    def blind_to(self, author: str) -> frozenset[str]:
        """The ids of demonstrations of which everything by others is hidden from a coder now."""
        return frozenset(a.demonstration for a in self.assignments(author) if a.hides)

    def blind_tasks(self, author: str) -> frozenset[str]:
        """The tasks of demonstrations of which everything by others is hidden from a coder."""
        rows = self._db.all(
            "SELECT DISTINCT task FROM demonstration WHERE id IN (SELECT value FROM json_each(?))",
            json.dumps(sorted(self.blind_to(author))),
        )
        return frozenset(row["task"] for row in rows)

    def assignment_events(self) -> tuple[AssignmentEvent, ...]:
        """Everything that ever happened to assignments, the first event first."""
        return self._assignment_events()

    def replay_assignments(self, events: Iterable[AssignmentEvent]) -> None:
        """Let events happen again as they did, with their times, all or nothing.

        They come as from :meth:`assignment_events`. Refused if a demonstration is not here, or an
        event befalls what was never assigned.
        """
        events = tuple(events)
        with self._db.writing():
            if missing := {event.demonstration for event in events} - self._db.demonstration_ids():
                raise InputError(
                    f"There is no demonstration '{min(missing)}' in '{self._db.folder}'."
                )
            _assignments_after(events)
            for event in events:
                check_author(event.author)
                self._insert_assignment(event.demonstration, event.author, event.kind, event.time)

    def set_note(self, demonstration: str, author: str, text: str) -> None:
        """Write a coder's note on a demonstration in place of the one there, which stays known.

        The text is as of :class:`~forcelab.project.records.Note`; ``""`` takes the note away.

        Raises
        ------
        InputError
            If the author, who need not have labelled anything yet, has no name or is a model.
        """
        with self._db.writing():
            self._db.demonstration(demonstration)
            self._check_coder(author, "write notes")
            before = [note for note in self.note_events(demonstration) if note.author == author]
            time, old_text = utc_now(), ""
            if before:  # a clock that was set back must not let the older note count
                time, old_text = max(time, before[-1].time + _TICK), before[-1].text
            new = Note(demonstration, author, text, time)
            if new.text != old_text:
                self.add_notes(demonstration, [new])

    def add_notes(self, demonstration: str, notes: Iterable[Note]) -> bool:
        """Add notes that are not there yet; gives whether there were any.

        Of a coder's the latest counts, wherever it was written: two projects that take each
        other's notes over come to have the same.
        """
        with self._db.writing():
            existing = self.note_events(demonstration)
            stored = {(note.author, note.time, note.text) for note in existing}
            new = [note for note in notes if (note.author, note.time, note.text) not in stored]
            for note in new:
                check_author(note.author)
                self._db.insert(
                    "note",
                    demonstration=demonstration,
                    author=note.author,
                    text=note.text,
                    time=note.time.astimezone(timezone.utc).isoformat(),
                )
        return bool(new)

    def notes(self, viewer: str | None = None) -> tuple[Note, ...]:
        """The notes that count, of each demonstration and coder the latest; the oldest one first.

        Parameters
        ----------
        viewer : str, optional
            A coder who is to see no note of others on what is to be coded blind.
        """
        latest = {(note.demonstration, note.author): note for note in self.note_events()}
        hidden = self.blind_to(viewer) if latest and viewer is not None else frozenset()
        return tuple(
            note
            for note in sorted(latest.values(), key=lambda note: note.time)
            if note.text and (note.author == viewer or note.demonstration not in hidden)
        )

    def note_events(self, demonstration: str | None = None) -> tuple[Note, ...]:
        """Every note ever written, on one demonstration or on all, the oldest one first.

        One without a text took the coder's note away.
        """
        rows = self._db.all(
            # Texts of times in UTC are sorted as the times are.
            "SELECT * FROM note WHERE ? IS NULL OR demonstration = ? ORDER BY time, author, text",
            demonstration,
            demonstration,
        )
        return tuple(
            Note(
                row["demonstration"],
                row["author"],
                row["text"],
                read_time(row, f"A note of {row['author']}"),
            )
            for row in rows
        )

    def add_verdict(self, verdict: Verdict) -> StoredVerdict:
        """Keep a verdict for ever, with the time now where it has none; no label changes.

        One of the kind ``"withdrawn"`` takes back what was said of the same place before.

        Raises
        ------
        InputError
            If there is no such run, the stretch is empty, or a name is blank.
        """
        return self.add_verdicts((verdict,))[0]

    def add_verdicts(self, verdicts: Iterable[Verdict]) -> tuple[StoredVerdict, ...]:
        """Keep several verdicts as one transaction, all or nothing; see :meth:`add_verdict`."""
        verdicts = tuple(verdicts)
        with self._db.writing():
            return tuple(_insert_verdict(self._db, verdict) for verdict in verdicts)

    def verdicts(self, demonstration: str | None = None) -> tuple[StoredVerdict, ...]:
        """The verdicts on one demonstration or on all that count, the first one first.

        That is of each place the latest, unless it was withdrawn. A place is a stretch of a coder's
        labels with what coder and model see there; see :attr:`Verdict.place`.
        """
        latest = {verdict.place: verdict for verdict in self.verdict_events(demonstration)}
        counting = (verdict for verdict in latest.values() if verdict.verdict != "withdrawn")
        return tuple(sorted(counting, key=lambda verdict: verdict.id))

    def verdict_events(self, demonstration: str | None = None) -> tuple[StoredVerdict, ...]:
        """Every verdict ever given, on one demonstration or on all, the first one first."""
        rows = self._db.all(
            "SELECT * FROM verdict WHERE ? IS NULL OR demonstration = ? ORDER BY id",
            demonstration,
            demonstration,
        )
        return tuple(_verdict(row) for row in rows)

    def _check_coder(self, author: str, privilege: str) -> None:
        """Refuse a nameless author and a model."""
        check_author(author)
        if is_model(author) or self._db.author_kind(author) == "model":
            raise InputError(f"'{author}' is a model; only coders {privilege}.")

    def _standing_assignment(self, demonstration: str, author: str) -> Assignment:
        """An assignment that must be there."""
        row = self._db.demonstration(demonstration)
        assignment = self._assignment(demonstration, author)
        if assignment is None:
            raise InputError(f"'{row['name']}' is not assigned to '{author}'; assign it first.")
        return assignment

    def _assignment(self, demonstration: str, author: str) -> Assignment | None:
        """An assignment, if it stands."""
        events = self._assignment_events("demonstration = ? AND author = ?", demonstration, author)
        return _assignments_after(events).get((demonstration, author))

    def _assignment_events(self, where: str = "1", *values: str) -> tuple[AssignmentEvent, ...]:
        """The events of some assignments."""
        return tuple(
            AssignmentEvent(
                demonstration=row["demonstration"],
                author=row["author"],
                kind=row["kind"],
                time=read_time(row, f"An assignment of {row['author']}"),
            )
            for row in self._db.all(f"SELECT * FROM assignment WHERE {where} ORDER BY id", *values)
        )

    def _insert_assignment(
        self, demonstration: str, author: str, kind: AssignmentKind, time: datetime | None = None
    ) -> None:
        """Store an event."""
        when = (time or utc_now()).isoformat()
        self._db.insert(
            "assignment", demonstration=demonstration, author=author, kind=kind, time=when
        )


def _assignments_after(events: Iterable[AssignmentEvent]) -> dict[tuple[str, str], Assignment]:
    """The assignments that stand after some events, by demonstration and author."""
    assignments: dict[tuple[str, str], Assignment] = {}
    for event in events:
        key = (event.demonstration, event.author)
        assignment = assignments.get(key)
        if event.kind in ("blind", "open"):
            blind = event.kind == "blind"
            new = Assignment(event.demonstration, event.author, blind, event.time)
            assignments[key] = new if assignment is None else replace(assignment, blind=blind)
        elif assignment is None:
            raise InputError(f"What was never assigned to '{event.author}' cannot be {event.kind}.")
        elif event.kind == "removed":
            del assignments[key]
        else:
            assignments[key] = replace(
                assignment, done=event.time if event.kind == "done" else None
            )
    return assignments


def follow_edit(database: Database, edit: Edit, original: Edit) -> None:
    """Withdraw a verdict when the edit that it made is undone, and renew it when that is redone.

    Verdict and edit have the same time. Needs a transaction around it.
    """
    rows = database.all(
        "SELECT * FROM verdict WHERE demonstration = ? AND coder = ? AND time = ?",
        original.demonstration,
        original.author,
        original.time.isoformat(),
    )
    verdicts = {
        verdict.place: verdict for verdict in map(_verdict, rows) if changed_labels(verdict)
    }
    for place, verdict in verdicts.items():
        (latest,) = database.all(
            "SELECT verdict, time FROM verdict WHERE demonstration = ? AND coder = ? "
            "AND start = ? AND end = ? AND human IS ? AND predicted IS ? ORDER BY id DESC LIMIT 1",
            *place,
        )
        if edit.kind == "redo" and latest["verdict"] == "withdrawn":
            _insert_verdict(database, verdict)
        elif edit.kind == "undo" and latest["verdict"] == "model":
            _insert_verdict(database, replace(verdict, verdict="withdrawn", time=edit.time))


def _insert_verdict(database: Database, verdict: Verdict) -> StoredVerdict:
    _check_verdict(database, verdict)
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
    return _verdict(*database.all("SELECT * FROM verdict WHERE id = ?", number))


def _check_verdict(database: Database, verdict: Verdict) -> None:
    """Refuse a verdict on what is not there."""
    name = database.demonstration(verdict.demonstration)["name"]
    check_author(verdict.author)
    check_author(verdict.coder)
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
    columns: dict[str, Any] = dict(row)
    return StoredVerdict(**columns | {"time": read_time(row, f"Verdict {row['id']}")})
