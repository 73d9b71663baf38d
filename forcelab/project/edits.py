"""Tracks and the edits that made them: append-only, undone and redone by further edits.

Every edit replaces a run of segments by another (see :func:`forcelab.segment_edits.splice`), so
that it
costs the same on a long track as on a short one, and swapping the two runs undoes it.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import replace
from datetime import datetime
from typing import Literal

from forcelab.errors import InputError, StaleTrackError
from forcelab.labels import Segment, Segments, Track, check_action_name, is_model, ordered
from forcelab.project.database import Database
from forcelab.project.history import Line, edit_of, edits_of, line_of
from forcelab.project.judged import follow_edit
from forcelab.project.ownership import kind_of, track_for, track_of
from forcelab.project.records import AuthorKind, Edit, EditKind, segments_to_json, utc_now
from forcelab.segment_edits import splice, spliced

__all__ = ["Tracks"]

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

    def _fitting(self, edit: Edit, line: Line, reverts: int | None) -> tuple[Edit, int | None]:
        """An undo or redo with its parent, if it is the one that stands to be made."""
        told = replace(edit, id=_NEW, reverts=reverts)
        found = self._reverting(edit.kind, line)
        if found is None or replace(found[0], what=edit.what, time=edit.time) != told:
            raise InputError(f"Edit {edit.id} of '{edit.author}' takes back what was not there.")
        return told, found[1]

    def _reverting(self, kind: EditKind, line: Line) -> tuple[Edit, int | None] | None:
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

    def _carry_out(self, track: int, line: Line, change: Edit, parent: int | None) -> Edit:
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
