"""Who is to label what, blind or not, what is done, and notes: append-only, as the edits are.

An assignment follows from its events, the latest of which counts. So it stays known when a coder
who saw the others' labels, because the assignment was done or open, labels on.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from datetime import datetime, timedelta, timezone

from forcelab.errors import InputError
from forcelab.labels import Track, is_model
from forcelab.project.database import Database, time_of
from forcelab.project.folder import ProjectFolder
from forcelab.project.loading import known_ids, row_of
from forcelab.project.records import Assignment, AssignmentEvent, AssignmentKind, Note, utc_now
from forcelab.project.tracks import kind_of

#: The shortest time that a note can be later than another one.
_TICK = timedelta(microseconds=1)


def write_note(database: Database, demonstration: str, author: str, text: str) -> None:
    """Write a coder's note in place of the one that counts, inside a transaction."""
    before = [one for one in notes_of(database, demonstration) if one.author == author]
    time, there = utc_now(), ""
    if before:  # a clock that was set back must not let the older note count
        time, there = max(time, before[-1].time + _TICK), before[-1].text
    new = Note(demonstration, author, text, time)
    if new.text != there:
        add_notes(database, demonstration, [new])


def add_notes(database: Database, demonstration: str, notes: Iterable[Note]) -> bool:
    """Keep notes that are not there yet, inside a transaction; gives whether there were any.

    Of a coder's the latest counts, wherever it was written: two projects that take each other's
    notes over come to have the same.
    """
    known = {(one.author, one.time, one.text) for one in notes_of(database, demonstration)}
    new = [one for one in notes if (one.author, one.time, one.text) not in known]
    for one in new:
        Track(one.author)  # refuses an author without a name
        database.insert(
            "note",
            demonstration=demonstration,
            author=one.author,
            text=one.text,
            time=one.time.astimezone(timezone.utc).isoformat(),
        )
    return bool(new)


def notes_of(database: Database, demonstration: str | None) -> tuple[Note, ...]:
    """Every note on a demonstration, or on all of them."""
    which, values = (
        ("", []) if demonstration is None else ("WHERE demonstration = ?", [demonstration])
    )
    # Texts of times in UTC are sorted as the times are.
    return tuple(
        Note(
            row["demonstration"],
            row["author"],
            row["text"],
            time_of(row, f"A note of {row['author']}"),
        )
        for row in database.all(f"SELECT * FROM note {which} ORDER BY time, author, text", *values)
    )


_Key = tuple[str, str]


class ProjectCoding(ProjectFolder):
    """The assignments and the notes of a :class:`~forcelab.project.Project`."""

    def assign(self, demonstration: str, author: str, blind: bool = True) -> Assignment:
        """Assign a demonstration to a coder.

        What is assigned already keeps its time and whether it is done.

        Parameters
        ----------
        demonstration : str
            Its id.
        author : str
            The coder, who need not have labelled anything yet.
        blind : bool
            Whether the other tracks and all predictions are hidden from the coder until done.

        Raises
        ------
        InputError
            If there is no such demonstration, or the author has no name or is a model.
        """
        with self._db.writing():
            row_of(self._db, demonstration)
            self._check_coder(author, "are assigned to label")
            one = self._assignment(demonstration, author)
            if one is None or one.blind != blind:
                self._note_assignment(demonstration, author, "blind" if blind else "open")
            return self._standing_assignment(demonstration, author)

    def unassign(self, demonstration: str, author: str) -> None:
        """Take an assignment back; no label changes.

        Raises
        ------
        InputError
            If the demonstration is not assigned to the author.
        """
        with self._db.writing():
            self._standing_assignment(demonstration, author)
            self._note_assignment(demonstration, author, "removed")

    def set_done(self, demonstration: str, author: str, done: bool = True) -> Assignment:
        """Mark a demonstration as done by a coder, or open it again; both are kept for ever.

        What is not assigned to the coder is assigned openly when it is marked as done.

        Raises
        ------
        InputError
            If there is no such demonstration, the author has no name or is a model, or what is
            to be opened again is not assigned to the author.
        """
        with self._db.writing():
            if done and self._assignment(demonstration, author) is None:
                row_of(self._db, demonstration)
                self._check_coder(author, "mark as done")
                self._note_assignment(demonstration, author, "open")
            one = self._standing_assignment(demonstration, author)
            if (one.done is not None) != done:
                self._note_assignment(demonstration, author, "done" if done else "reopened")
            return self._standing_assignment(demonstration, author)

    def assignments(self, author: str | None = None) -> tuple[Assignment, ...]:
        """The assignments that stand, of everybody or of one coder, the first one first."""
        events = (
            self._assignment_events("")
            if author is None
            else self._assignment_events("author = ?", author)
        )
        return tuple(_standing(events).values())

    def is_blind(self, demonstration: str, author: str) -> bool:
        """Whether the other tracks and all predictions are to be hidden from a coder now."""
        one = self._assignment(demonstration, author)
        return one is not None and one.hides

    def blind_to(self, author: str) -> frozenset[str]:
        """The ids of demonstrations of which everything by others is hidden from a coder now."""
        return frozenset(one.demonstration for one in self.assignments(author) if one.hides)

    def assignment_events(self) -> tuple[AssignmentEvent, ...]:
        """Everything that ever happened to assignments, the first event first."""
        return self._assignment_events("")

    def replay_assignments(self, events: Iterable[AssignmentEvent]) -> None:
        """Let events happen again as they did, with their times, all or nothing.

        Parameters
        ----------
        events : iterable of AssignmentEvent
            The first one first, as from :meth:`assignment_events`.

        Raises
        ------
        InputError
            If a demonstration is not here, or an event befalls what was never assigned.
        """
        events = tuple(events)
        with self._db.writing():
            if missing := {event.demonstration for event in events} - known_ids(self._db):
                raise InputError(
                    f"There is no demonstration '{min(missing)}' in '{self._db.folder}'."
                )
            _standing(events)
            for event in events:
                Track(event.author)
                self._note_assignment(event.demonstration, event.author, event.kind, event.time)

    def set_note(self, demonstration: str, author: str, text: str) -> None:
        """Write a coder's note on a demonstration in place of the one there, which stays known.

        Parameters
        ----------
        demonstration : str
            Its id.
        author : str
            The coder, who need not have labelled anything yet.
        text : str
            As of :class:`~forcelab.project.records.Note`; ``""`` takes the note away.

        Raises
        ------
        InputError
            If there is no such demonstration, or the author has no name or is a model.
        """
        with self._db.writing():
            row_of(self._db, demonstration)
            self._check_coder(author, "write notes")
            write_note(self._db, demonstration, author, text)

    def notes(self, viewer: str | None = None) -> tuple[Note, ...]:
        """The notes that count, of each demonstration and coder the latest; the oldest one first.

        Parameters
        ----------
        viewer : str, optional
            A coder who is to see no note of others on what is to be coded blind.
        """
        latest = {(one.demonstration, one.author): one for one in self.note_events()}
        hidden = self.blind_to(viewer) if latest and viewer is not None else frozenset()
        return tuple(
            one
            for one in sorted(latest.values(), key=lambda one: one.time)
            if one.text and (one.author == viewer or one.demonstration not in hidden)
        )

    def note_events(self, demonstration: str | None = None) -> tuple[Note, ...]:
        """Every note ever written, on one demonstration or on all, the oldest one first.

        Parameters
        ----------
        demonstration : str, optional
            Its id.

        Returns
        -------
        tuple of Note
            One without a text took the coder's note away.
        """
        return notes_of(self._db, demonstration)

    def _check_coder(self, author: str, what: str) -> None:
        """Refuse who has no name, and a model, for what only coders do."""
        Track(author)
        if is_model(author) or kind_of(self._db, author) == "model":
            raise InputError(f"'{author}' is a model; only coders {what}.")

    def _standing_assignment(self, demonstration: str, author: str) -> Assignment:
        """An assignment that must be there."""
        row = row_of(self._db, demonstration)
        one = self._assignment(demonstration, author)
        if one is None:
            raise InputError(f"'{row['name']}' is not assigned to '{author}'; assign it first.")
        return one

    def _assignment(self, demonstration: str, author: str) -> Assignment | None:
        """An assignment, if it stands."""
        events = self._assignment_events("demonstration = ? AND author = ?", demonstration, author)
        return _standing(events).get((demonstration, author))

    def _assignment_events(self, where: str, *values: str) -> tuple[AssignmentEvent, ...]:
        """The events of some assignments."""
        condition = f"WHERE {where}" if where else ""
        return tuple(
            AssignmentEvent(
                demonstration=row["demonstration"],
                author=row["author"],
                kind=row["kind"],
                time=time_of(row, f"An assignment of {row['author']}"),
            )
            for row in self._db.all(f"SELECT * FROM assignment {condition} ORDER BY id", *values)
        )

    def _note_assignment(
        self, demonstration: str, author: str, kind: AssignmentKind, time: datetime | None = None
    ) -> None:
        """Write an event down."""
        when = (time or utc_now()).isoformat()
        self._db.insert(
            "assignment", demonstration=demonstration, author=author, kind=kind, time=when
        )


def _standing(events: Iterable[AssignmentEvent]) -> dict[_Key, Assignment]:
    """What the events lead to."""
    found: dict[_Key, Assignment] = {}
    for event in events:
        key = (event.demonstration, event.author)
        one = found.get(key)
        if event.kind in ("blind", "open"):
            blind = event.kind == "blind"
            new = Assignment(event.demonstration, event.author, blind, event.time)
            found[key] = new if one is None else replace(one, blind=blind)
        elif one is None:
            raise InputError(f"What was never assigned to '{event.author}' cannot be {event.kind}.")
        elif event.kind == "removed":
            del found[key]
        else:
            found[key] = replace(one, done=event.time if event.kind == "done" else None)
    return found
