"""Tracks and the edits that made them: append-only, undone and redone by further edits.

Where a track stands in its history: what can be undone, and what can be redone. What can be undone
is a stack, and what can be redone is another. Both are linked through the ``parent`` of the edits:
that of a paint, an import or a prediction is the edit to undo once it is undone itself; that of an
undo is the undo to redo once it is redone itself. So the tops of both stacks follow from the
track's latest edit alone, whatever the length of the history. A new edit leaves the redo stack
behind; nothing is ever deleted.

Every edit replaces a run of segments by another (see :func:`forcelab.segment_edits.splice`), so
that it
costs the same on a long track as on a short one, and swapping the two runs undoes it.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Literal

from forcelab.errors import InputError, StaleTrackError
from forcelab.labels import Segment, Segments, Track, check_action_name, is_model, ordered
from forcelab.project.database import Database, told_of_content
from forcelab.project.records import (
    AuthorKind,
    Edit,
    EditKind,
    segments_from_json,
    segments_to_json,
    utc_now,
)
from forcelab.project.runs import LabelsUsed
from forcelab.project.verdicts import follow_edit
from forcelab.segment_edits import splice, spliced
from forcelab.vocabulary import Vocabulary


def kind_of(database: Database, author: str) -> AuthorKind | None:
    """What an author is, if known."""
    row = database.one("SELECT kind FROM author WHERE name = ?", author)
    return row["kind"] if row else None


def track_of(database: Database, demonstration: str, author: str) -> int | None:
    """The number of a track, if there is one."""
    row = database.one(
        "SELECT track.id FROM track JOIN author ON author.id = track.author "
        "WHERE demonstration = ? AND name = ?",
        demonstration,
        author,
    )
    return row["id"] if row else None


def track_for(database: Database, demonstration: str, author: str, kind: AuthorKind) -> int:
    """The number of a track, made where there is none; needs a transaction around it.

    Raises
    ------
    InputError
        If the author has no name, or is of the other kind.
    """
    there = database.one(
        "SELECT track.id, kind FROM track JOIN author ON author.id = track.author "
        "WHERE demonstration = ? AND name = ?",
        demonstration,
        author,
    )
    if there is not None and there["kind"] == kind:
        return int(there["id"])
    Track(author)  # refuses an author without a name
    known = kind_of(database, author)
    if known is None:
        database.execute("INSERT INTO author (name, kind) VALUES (?, ?)", author, kind)
    elif known != kind:
        raise InputError(
            f"'{author}' is a {known} in this project and cannot be a {kind} as well; "
            f"use another author's name."
        )
    database.execute(
        "INSERT OR IGNORE INTO track (demonstration, author) "
        "SELECT ?, id FROM author WHERE name = ?",
        demonstration,
        author,
    )
    row = track_of(database, demonstration, author)
    assert row is not None
    return row


def vocabularies(database: Database) -> dict[str, Vocabulary]:
    """By task, every vocabulary that was written."""
    rows = database.all("SELECT task, actions FROM vocabulary ORDER BY task")
    found = {}
    for row in rows:
        with told_of_content(f"The list of actions of {row['task'] or 'no task'}"):
            found[row["task"]] = Vocabulary.from_json(json.loads(row["actions"]))
    return found


def write_vocabulary(database: Database, task: str, vocabulary: Vocabulary) -> None:
    """Replace the vocabulary of a task."""
    database.execute(
        "INSERT INTO vocabulary VALUES (?, ?) "
        "ON CONFLICT (task) DO UPDATE SET actions = excluded.actions",
        task,
        json.dumps(vocabulary.to_json(), ensure_ascii=False),
    )


def extend_vocabulary(database: Database, task: str, demonstration: str, looks: Vocabulary) -> None:
    """Add the actions that a task's vocabulary lacks.

    These are first those of `looks`, as they look there where that is free, then the others of the
    demonstration's tracks.
    """
    rows = database.all(
        "SELECT action FROM segment JOIN track ON track.id = segment.track "
        "WHERE demonstration = ? GROUP BY action ORDER BY min(start), action",
        demonstration,
    )
    old = vocabularies(database).get(task, Vocabulary())
    new = _joined(old, looks).with_actions(*(row["action"] for row in rows))
    if new != old:
        write_vocabulary(database, task, new)


def drop_imported_actions(database: Database, task: str, demonstration: str) -> tuple[str, ...]:
    """Take out of a task's vocabulary what a demonstration that has left the task brought along.

    These are the actions of its imported labels that no other demonstration of the task has. Where
    it was the last of the task, the vocabulary stays as it is.

    Returns
    -------
    tuple of str
        The actions that were taken out.
    """
    if not database.one("SELECT 1 FROM demonstration WHERE task = ?", task):
        return ()
    imports = database.all(
        "SELECT inserted FROM edit JOIN track ON track.id = edit.track "
        "WHERE demonstration = ? AND kind = 'import'",
        demonstration,
    )
    brought = {
        segment.action
        for row in imports
        for segment in segments_from_json(json.loads(row["inserted"]))
    }
    painted = database.all(
        "SELECT DISTINCT action FROM segment JOIN track ON track.id = segment.track "
        "JOIN demonstration ON demonstration.id = track.demonstration WHERE task = ?",
        task,
    )
    foreign = brought - {row["action"] for row in painted}
    old = vocabularies(database).get(task, Vocabulary())
    new = Vocabulary(tuple(action for action in old if action.name not in foreign))
    if new != old:
        write_vocabulary(database, task, new)
    return tuple(name for name in old.names if name in foreign)


def _joined(old: Vocabulary, looks: Vocabulary) -> Vocabulary:
    """Add the actions that are missing; one whose look or key is taken gets free ones."""
    for action in looks:
        if action.name in old:
            continue
        free = all(action.look != a.look and action.key not in ("", a.key) for a in old)
        old = Vocabulary((*old, action)) if free else old.with_actions(action.name)
    return old


_EDITS = """
    SELECT edit.*, track.demonstration, author.name AS author
    FROM edit JOIN track ON track.id = edit.track JOIN author ON author.id = track.author
"""


@dataclass(frozen=True, slots=True)
class UndoState:
    """A track's latest edit (0: none), and the tops of its two stacks."""

    head: int = 0
    undo: int | None = None
    redo: int | None = None


def line_of(database: Database, track: int, until: int | None = None) -> UndoState:
    """Where the track stands, or stood after the edit with the number `until`."""
    head = database.one(
        "SELECT id, kind, reverts FROM edit WHERE track = ? AND (? IS NULL OR id <= ?) "
        "ORDER BY id DESC LIMIT 1",
        track,
        until,
        until,
    )
    if head is None:
        return UndoState()
    if head["reverts"] is None:
        return UndoState(head["id"], undo=head["id"])
    taken = database.one("SELECT reverts, parent FROM edit WHERE id = ?", head["reverts"])
    assert taken is not None
    if head["kind"] == "undo":
        return UndoState(head["id"], undo=taken["parent"], redo=head["id"])
    return UndoState(head["id"], undo=taken["reverts"], redo=taken["parent"])


def net_edits(database: Database, track: int, since: int) -> int:
    """How many edits lie between what the track was after the edit number `since` and what it is.

    An edit that was taken back counts for nothing. One that is older than `since` and was taken
    back afterwards counts as one. Below an edit on the stack lie only older ones, so that the two
    stacks are followed downwards side by side until they meet.
    """
    then, now = line_of(database, track, since).undo, line_of(database, track).undo
    count = 0
    while then != now:
        count += 1
        if (now or 0) > (then or 0):
            now = _below(database, now)
        else:
            then = _below(database, then)
    return count


def stands(database: Database, track: int, number: int) -> bool:
    """Whether an edit that was no undo or redo is part of what the track is now."""
    now = line_of(database, track).undo
    while now is not None and now > number:
        now = _below(database, now)
    return now == number


def edits_since(database: Database, labels: Sequence[LabelsUsed], tasks: Sequence[str]) -> int:
    """How many edits labels have had since, and demonstrations their tasks."""
    used = json.dumps([[one.demonstration, one.author, one.edit] for one in labels])
    edited = database.all(
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
    (new,) = database.all(
        """
        SELECT count(*) AS number FROM demonstration
        WHERE task IN (SELECT value FROM json_each(?))
          AND id NOT IN (SELECT json_extract(value, '$[0]') FROM json_each(?))
        """,
        json.dumps(list(tasks)),
        used,
    )
    changed = sum(net_edits(database, row["track"], row["edit"]) for row in edited)
    return changed + int(new["number"])


def _below(database: Database, number: int | None) -> int | None:
    """The edit to undo after this one."""
    row = database.one("SELECT parent FROM edit WHERE id = ?", number)
    assert row is not None
    return None if row["parent"] is None else int(row["parent"])


def edits_of(
    database: Database, track: int, latest: int | None = None, before: int | None = None
) -> tuple[Edit, ...]:
    """Edits of a track, the first one first: the `latest` ones of those before number `before`."""
    rows = database.all(
        f"{_EDITS} WHERE track = ? AND (? IS NULL OR edit.id < ?) ORDER BY edit.id DESC LIMIT ?",
        track,
        before,
        before,
        -1 if latest is None else latest,
    )
    return tuple(_edit(row) for row in reversed(rows))


def edit_of(database: Database, number: int) -> Edit:
    """One edit."""
    row = database.one(f"{_EDITS} WHERE edit.id = ?", number)
    assert row is not None
    return _edit(row)


def _edit(row: sqlite3.Row) -> Edit:
    """An edit as stored."""
    with told_of_content(f"Edit {row['id']}"):
        return Edit(
            id=row["id"],
            demonstration=row["demonstration"],
            author=row["author"],
            kind=row["kind"],
            time=datetime.fromisoformat(row["time"]),
            what=row["what"],
            position=row["position"],
            removed=segments_from_json(json.loads(row["removed"])),
            inserted=segments_from_json(json.loads(row["inserted"])),
            reverts=row["reverts"],
            proposed_by=row["proposed_by"],
        )


#: The number of an edit that is not in the store yet.
_NEW = 0


class Tracks:
    """All tracks of a project. Methods that write need a transaction around them."""

    def __init__(self, database: Database) -> None:
        self._db = database
        # Segments as they were after the edit whose number stands beside them; a track whose
        # latest edit is another one, made by another process, is read again.
        self._known: dict[int, tuple[int, Segments]] = {}
        # The number of an edit that was rolled back is given out again.
        database.on_rollback = self._known.clear

    def track(self, demonstration: str, author: str) -> Track:
        """The track as it is now, empty where the author made none."""
        row = track_of(self._db, demonstration, author)
        return Track(author) if row is None else Track(author, self._segments(row))

    def tracks(self, demonstration: str) -> tuple[Track, ...]:
        """The tracks of every author, in order of first appearance."""
        rows = self._db.all(
            "SELECT track.id, name FROM track JOIN author ON author.id = track.author "
            "WHERE demonstration = ? ORDER BY author",
            demonstration,
        )
        return tuple(Track(row["name"], self._segments(row["id"])) for row in rows)

    def head(self, demonstration: str, author: str) -> int:
        """The number of a track's latest edit, 0 where there is none."""
        row = track_of(self._db, demonstration, author)
        return 0 if row is None else line_of(self._db, row).head

    def history(
        self, demonstration: str, author: str, latest: int | None = None, before: int | None = None
    ) -> tuple[Edit, ...]:
        """The edits of a track, the first one first; see :func:`edits_of`."""
        row = track_of(self._db, demonstration, author)
        return () if row is None else edits_of(self._db, row, latest, before)

    def edit(
        self,
        demonstration: str,
        author: str,
        before: Segments,
        after: Segments,
        what: str,
        *,
        kind: EditKind,
        proposed_by: str | None = None,
        replacing: int | None = None,
        time: datetime | None = None,
    ) -> Edit:
        """Turn `before`, which the track must be, into `after`; at a `time`, by default now.

        Where the latest edit is replaced it is undone at the same time, by which it can be told
        from one that was undone by hand; an `after` as before it gives that undo.
        """
        before, after = tuple(before), tuple(after)
        time = utc_now() if time is None else time
        if kind == "paint" and is_model(author):
            raise InputError(f"'{author}' is a model's name; paint under a coder's.")
        if proposed_by is not None:
            self._check_proposer(proposed_by, kind)
        track = track_for(self._db, demonstration, author, _made_by(kind, author))
        line = line_of(self._db, track)
        if self._segments(track, line.head) != before or replacing not in (None, line.head):
            raise StaleTrackError(
                f"The labels of '{author}' were changed elsewhere since they were read, so the "
                f"edit was left out; look at them as they are now and repeat it."
            )
        if replacing is not None and (latest := self._reverting("undo", line)) is not None:
            undone = self._carry_out(track, line, replace(latest[0], time=time), latest[1])
            line, before = line_of(self._db, track), self._segments(track, undone.id)
            if after == before:
                return undone
        position, removed, inserted = splice(before, after)
        if kind == "paint":
            for action in {s.action for s in inserted} - {s.action for s in removed}:
                check_action_name(action)
        around = after[max(position - 1, 0) : position + len(inserted) + 1]
        if ordered(around) != around:
            raise InputError(f"The labels of '{author}' must be in order of time.")
        new = Edit(
            id=_NEW,
            demonstration=demonstration,
            author=author,
            kind=kind,
            time=time,
            what=what,
            position=position,
            removed=removed,
            inserted=inserted,
            proposed_by=proposed_by,
        )
        return self._carry_out(track, line, new, line.undo)

    def revert(self, demonstration: str, author: str, kind: Literal["undo", "redo"]) -> Edit | None:
        """Take back the latest edit, or the latest undo, if there is one to be taken back."""
        track = track_of(self._db, demonstration, author)
        if track is None:
            return None
        line = line_of(self._db, track)
        found = self._reverting(kind, line)
        if found is None:
            return None
        edit = self._carry_out(track, line, *found)
        follow_edit(self._db, edit, self._original(edit))
        return edit

    def revertible(
        self, demonstration: str, author: str, kind: Literal["undo", "redo"]
    ) -> Edit | None:
        """The edit that an undo, or the undo that a redo, would take back."""
        track = track_of(self._db, demonstration, author)
        if track is None:
            return None
        line = line_of(self._db, track)
        top = line.undo if kind == "undo" else line.redo
        return None if top is None else edit_of(self._db, top)

    def _original(self, edit: Edit) -> Edit:
        """The edit that an undo, or the redo of one, is about."""
        while edit.reverts is not None:
            edit = edit_of(self._db, edit.reverts)
        return edit

    def as_imported(self, demonstration: str, author: str) -> bool:
        """Whether the track is what the latest import made it."""
        row = self._db.one(
            "SELECT edit.id, track FROM edit JOIN track ON track.id = edit.track "
            "JOIN author ON author.id = track.author "
            "WHERE demonstration = ? AND name = ? AND edit.kind = 'import' "
            "ORDER BY edit.id DESC LIMIT 1",
            demonstration,
            author,
        )
        return row is not None and line_of(self._db, row["track"]).undo == row["id"]

    def replay(self, edits: Iterable[Edit]) -> dict[int, int]:
        """Make edits again as they were made, with their own times; gives their new numbers."""
        numbers: dict[int, int] = {}
        for edit in edits:
            kind = _made_by(edit.kind, edit.author)
            if edit.reverts is not None:
                kind = kind_of(self._db, edit.author) or kind
            track = track_for(self._db, edit.demonstration, edit.author, kind)
            line = line_of(self._db, track)
            change, parent = edit, line.undo
            if edit.kind in ("undo", "redo"):
                change, parent = self._fitting(edit, line, numbers.get(edit.reverts or 0))
            numbers[edit.id] = self._carry_out(track, line, change, parent).id
        return numbers

    def _fitting(self, edit: Edit, line: UndoState, reverts: int | None) -> tuple[Edit, int | None]:
        """An undo or redo with its parent, if it is the one that stands to be made."""
        told = replace(edit, id=_NEW, reverts=reverts)
        found = self._reverting(edit.kind, line)
        if found is None or replace(found[0], what=edit.what, time=edit.time) != told:
            raise InputError(f"Edit {edit.id} of '{edit.author}' takes back what was not there.")
        return told, found[1]

    def _reverting(self, kind: EditKind, line: UndoState) -> tuple[Edit, int | None] | None:
        """The undo or redo that stands to be made, with its parent; None where there is none."""
        top = line.undo if kind == "undo" else line.redo
        if top is None:
            return None
        old = edit_of(self._db, top)
        change = replace(
            old,
            id=_NEW,
            kind=kind,
            time=utc_now(),
            what=f"{kind}: {old.what.removeprefix('undo: ')}",
            removed=old.inserted,
            inserted=old.removed,
            reverts=top,
            proposed_by=None,
        )
        return change, line.redo if kind == "undo" else None

    def _carry_out(self, track: int, line: UndoState, change: Edit, parent: int | None) -> Edit:
        """Change the segments, and write down how; gives the edit with its number."""
        before = self._segments(track, line.head)
        after = spliced(before, change.position, change.removed, change.inserted)
        for segment in change.removed:
            self._db.execute(
                "DELETE FROM segment WHERE track = ? AND start = ?", track, float(segment.start)
            )
        for segment in change.inserted:
            self._db.execute(
                "INSERT INTO segment VALUES (?, ?, ?, ?)",
                track,
                float(segment.start),
                float(segment.end),
                segment.action,
            )
        new = self._db.insert(
            "edit",
            track=track,
            kind=change.kind,
            time=change.time.isoformat(),
            what=change.what,
            position=change.position,
            removed=json.dumps(segments_to_json(change.removed), ensure_ascii=False),
            inserted=json.dumps(segments_to_json(change.inserted), ensure_ascii=False),
            reverts=change.reverts,
            parent=parent,
            proposed_by=change.proposed_by,
        )
        self._known[track] = (new, after)
        removed, inserted = _as_stored(change.removed), _as_stored(change.inserted)
        return replace(change, id=new, removed=removed, inserted=inserted)

    def _segments(self, track: int, head: int | None = None) -> Segments:
        """The segments of a track as they are now."""
        # The latest edit is asked for before the segments: should another process edit in
        # between, what is kept here only looks older than it is, and is read once more.
        head = line_of(self._db, track).head if head is None else head
        known = self._known.get(track)
        if known is None or known[0] != head:
            rows = self._db.all(
                "SELECT start, end, action FROM segment WHERE track = ? ORDER BY start", track
            )
            known = self._known[track] = (head, tuple(Segment(*row) for row in rows))
        return known[1]

    def _check_proposer(self, proposer: str, kind: EditKind) -> None:
        """Only models propose, and only what coders paint."""
        if kind != "paint" or not (is_model(proposer) or kind_of(self._db, proposer) == "model"):
            raise InputError(
                f"'{proposer}' is no model that proposes labels to a coder; copy a coder's labels."
            )


def _as_stored(segments: Segments) -> Segments:
    """Segments as they are when they are read again."""
    return tuple(Segment(float(s.start), float(s.end), s.action) for s in segments)


def _made_by(kind: EditKind, author: str) -> AuthorKind:
    """Whether an edit is a model's: its prediction, or the import of one under a model's name."""
    return "model" if kind == "predict" or is_model(author) else "coder"
