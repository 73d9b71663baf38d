"""Tracks and the edits that made them: append-only, undone and redone by further edits.

What can be undone is a stack, and what can be redone is another. Both are linked through the
``parent`` of the edits: that of a paint, an import or a prediction is the edit to undo once it is
undone itself; that of an undo is the undo to redo once it is redone itself. So the tops of both
stacks follow from the track's latest edit alone, whatever the length of the history. A new edit
leaves the redo stack behind; nothing is ever deleted.

Every edit replaces a run of segments by another (:func:`forcelab.segment_edits.splice`), so that it
costs the same on a long track as on a short one, and swapping the two runs undoes it.

Renaming an action edits many tracks at once. These edits share their author, their time and the
first half of their sentence, by which one undo finds them again in a copied or merged project too.
"""

from __future__ import annotations

import json
import math
import re
import sqlite3
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Literal

from forcelab.errors import InputError, StaleTrackError
from forcelab.labels import (
    Segment,
    Segments,
    Track,
    check_action_name,
    check_author,
    check_within,
    is_model,
    ordered,
)
from forcelab.project import files
from forcelab.project.coding import follow_edit
from forcelab.project.database import Database, content_errors
from forcelab.project.label_provenance import OriginTracker
from forcelab.project.records import (
    AuthorKind,
    Edit,
    EditKind,
    Origin,
    segments_from_text,
    segments_to_text,
    utc_now,
)
from forcelab.project.runs import LabelsUsed
from forcelab.segment_edits import splice, spliced
from forcelab.text import counted, listed

#: The sentence of a renaming, and where its number of segments begins: "grab is now hold in 2 ..".
RENAMED, NUMBER = " is now ", " in "
#: A sentence names so many demonstrations, and only counts further ones.
MOST_NAMED = 3
#: The number of an edit that is not in the store yet.
_NEW = 0
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


def undo_state(database: Database, track: int, until: int | None = None) -> UndoState:
    """The state of a track now, or after the edit with the number `until`."""
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
    (reverted,) = database.all("SELECT reverts, parent FROM edit WHERE id = ?", head["reverts"])
    if head["kind"] == "undo":
        return UndoState(head["id"], undo=reverted["parent"], redo=head["id"])
    return UndoState(head["id"], undo=reverted["reverts"], redo=reverted["parent"])


def _net_edits(database: Database, track: int, since: int) -> int:
    """The number of edits between a track after the edit `since` and the track now.

    An edit that was taken back counts for nothing; one older than `since` that was taken back
    afterwards counts as one. Below an edit on the stack lie only older ones, so the two stacks are
    followed downwards side by side until they meet.
    """
    before, now = undo_state(database, track, since).undo, undo_state(database, track).undo
    count = 0
    while before != now:
        count += 1
        if (now or 0) > (before or 0):
            now = _below(database, now)
        else:
            before = _below(database, before)
    return count


def _is_in_effect(database: Database, track: int, number: int) -> bool:
    """Whether an edit that was no undo or redo is part of what the track is now."""
    now = undo_state(database, track).undo
    while now is not None and now > number:
        now = _below(database, now)
    return now == number


def _below(database: Database, number: int | None) -> int | None:
    """The edit to undo after this one."""
    (row,) = database.all("SELECT parent FROM edit WHERE id = ?", number)
    return None if row["parent"] is None else int(row["parent"])


def _edit_of(database: Database, number: int) -> Edit:
    return _edit_from(*database.all(f"{_EDITS} WHERE edit.id = ?", number))


def _edit_from(row: sqlite3.Row) -> Edit:
    with content_errors(f"Edit {row['id']}"):
        return Edit(
            id=row["id"],
            demonstration=row["demonstration"],
            author=row["author"],
            kind=row["kind"],
            time=datetime.fromisoformat(row["time"]),
            what=row["what"],
            position=row["position"],
            removed=segments_from_text(row["removed"]),
            inserted=segments_from_text(row["inserted"]),
            reverts=row["reverts"],
            proposed_by=row["proposed_by"],
        )


@dataclass(frozen=True, slots=True)
class UndoResult:
    """What an undo or a redo has changed.

    Attributes
    ----------
    edits : tuple of Edit
        The undo, or redo, of each track; that of the demonstration that was asked for comes first.
    tasks : mapping of str to str
        By the id of each demonstration among them, its task.
    left : tuple of str
        Names of further demonstrations where the same was done and stays as it is, as something
        else was edited there since.
    """

    edits: tuple[Edit, ...]
    tasks: Mapping[str, str]
    left: tuple[str, ...] = ()

    @property
    def actions(self) -> dict[str, tuple[set[str], set[str]]]:
        """By task, the actions of what was taken away and of what came instead."""
        actions_of_tasks: dict[str, tuple[set[str], set[str]]] = defaultdict(lambda: (set(), set()))
        for edit in self.edits:
            gone, back = actions_of_tasks[self.tasks[edit.demonstration]]
            gone.update(segment.action for segment in edit.removed)
            back.update(segment.action for segment in edit.inserted)
        return dict(actions_of_tasks)

    @property
    def reaches_farther(self) -> bool:
        """Whether other demonstrations are concerned than the one that was asked for."""
        return len(self.edits) > 1 or bool(self.left)

    @property
    def renames(self) -> bool:
        """Whether it is a renaming that was undone or redone."""
        return bool(_renaming(self.edits[0].what))

    def sentence(self) -> str:
        """What was done, for people."""
        edit = self.edits[0]
        description = edit.what.removeprefix(f"{edit.kind}: ")
        if self.renames:
            pairs = [p for e in self.edits for p in zip(e.removed, e.inserted, strict=True)]
            changed = [(old.action, new.action) for old, new in pairs if old != new]
            old, new = changed[0] if edit.kind == "redo" else changed[0][::-1]
            number = counted(len(changed), "segment")
            if len(self.edits) > 1:
                number += f" in {counted(len(self.edits), 'demonstration')}"
            description = f"rename of {old} to {new} ({number})"
        sentence = f"{'Undone' if edit.kind == 'undo' else 'Redone'}: {description}"
        if self.left:
            names = listed([f"'{name}'" for name in self.left], MOST_NAMED)
            sentence += f"; not in {names}, where something else was edited since"
        return sentence


class TrackStore:
    """The tracks of a project and their edits; ``project.tracks``.

    A track is one author's segments over one demonstration, which is named by its id. Every method
    raises InputError if there is no such demonstration.
    """

    def __init__(self, database: Database) -> None:
        self._db = database
        self._origins = OriginTracker(database)
        # Segments as they were after the edit whose number stands beside them; a track whose
        # latest edit is another one, made by another process, is read again.
        self._cache: dict[int, tuple[int, Segments]] = {}
        # The number of an edit that was rolled back is given out again.
        database.on_rollback = self._cache.clear

    def get(self, demonstration: str, author: str) -> Track:
        """One author's track, empty if the author made none."""
        track = self._track_id(demonstration, author)
        return Track(author) if track is None else Track(author, self._segments(track))

    def of(self, demonstration: str) -> tuple[Track, ...]:
        """The tracks over a demonstration, in order of their authors' first appearance."""
        self._db.demonstration(demonstration)
        rows = self._db.all(
            "SELECT track.id, name FROM track JOIN author ON author.id = track.author "
            "WHERE demonstration = ? ORDER BY author",
            demonstration,
        )
        return tuple(Track(row["name"], self._segments(row["id"])) for row in rows)

    def edit(
        self,
        demonstration: str,
        author: str,
        before: Segments,
        after: Segments,
        what: str,
        *,
        kind: Literal["paint", "predict", "import"] = "paint",
        proposed_by: str | None = None,
        replacing: int | None = None,
        time: datetime | None = None,
    ) -> Edit:
        """Change a track, as one transaction that is in the store when this returns.

        Parameters
        ----------
        demonstration : str
            Its id.
        author : str
            Whose track is changed, and who changes it. Whoever paints is a coder, whoever predicts
            is a model, and nobody is ever both.
        before, after : tuple of Segment
            The whole track as it is, and as it becomes.
        what : str
            A line of history for people, such as ``"grab 1.25-1.73 s moved to 1.244"``.
        kind : "paint", "predict" or "import"
            Whether a person labelled, a model predicted, or the labels came from a file.
        proposed_by : str, optional
            The model whose prediction a person accepts with this edit.
        replacing : int, optional
            The number of the track's latest edit, in whose place this one is: one undo then takes
            back both, and the history has one line.
        time : datetime, optional
            In UTC; by default now.

        Raises
        ------
        StaleTrackError
            If the track is not `before`, or `replacing` not its latest edit, as another window or
            process changed it.
        InputError
            If segments overlap or are out of order, or lie farther beyond the recording than any
            before and by more than a second and 5 % of it, or the author is of the other kind, or
            what proposed is no model. Nothing was written then.
        """
        recording = self._db.demonstration(demonstration)
        before, after = tuple(before), tuple(after)
        time = utc_now() if time is None else time
        with self._db.writing():
            if kind == "paint" and is_model(author):
                raise InputError(f"'{author}' is a model's name; paint under a coder's.")
            if proposed_by is not None:
                self._check_proposer(proposed_by, kind)
            track = self._track_for(demonstration, author, _author_kind(kind, author))
            state = undo_state(self._db, track)
            if self._segments(track, state.head) != before or replacing not in (None, state.head):
                raise StaleTrackError(
                    f"The labels of '{author}' were changed elsewhere since they were read, so the "
                    f"edit was left out; look at them as they are now and repeat it."
                )
            # The replaced edit is undone at the time of the new one, by which it can be told from
            # an edit that was undone by hand; an `after` as before it gives that undo.
            if replacing is not None and (undo := self._inverse("undo", state)) is not None:
                undone = self._apply(track, state, replace(undo[0], time=time), undo[1])
                state, before = undo_state(self._db, track), self._segments(track, undone.id)
                if after == before:
                    return undone
            position, removed, inserted = splice(before, after)
            if kind == "paint":
                for action in {s.action for s in inserted} - {s.action for s in removed}:
                    check_action_name(action)
            around = after[max(position - 1, 0) : position + len(inserted) + 1]
            if ordered(around) != around:
                raise InputError(f"The labels of '{author}' must be in order of time.")
            low, high = (before[0].start, before[-1].end) if before else (math.inf, -math.inf)
            if farther := [s for s in inserted if s.start < low or s.end > high]:
                self._check_within(recording, author, farther)
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
            return self._apply(track, state, new, state.undo)

    def undo(self, demonstration: str, author: str) -> Edit | None:
        """Take back a track's latest edit not yet taken back; None if there is none.

        Reaches back to the first edit, past restarts. It is an edit itself. A verdict for which
        the labels were edited goes with its edit, and comes back with it.
        """
        return self._revert(demonstration, author, "undo")

    def redo(self, demonstration: str, author: str) -> Edit | None:
        """Take back a track's latest undo; None if there is none or something was edited since."""
        return self._revert(demonstration, author, "redo")

    def undo_everywhere(self, demonstration: str, author: str) -> UndoResult | None:
        """Take back a track's latest edit, and a renaming in all of the author's tracks.

        A track in which something was edited after the renaming is left as it is. None if there is
        nothing to undo in this track.
        """
        return self._revert_everywhere(demonstration, author, "undo")

    def redo_everywhere(self, demonstration: str, author: str) -> UndoResult | None:
        """Take back a track's latest undo, and that of a renaming in all of the author's tracks.

        A track in which the renaming can be redone no more, or not yet, is left as it is. None if
        there is nothing to redo in this track.
        """
        return self._revert_everywhere(demonstration, author, "redo")

    def revertible(
        self, demonstration: str, author: str, kind: Literal["undo", "redo"]
    ) -> Edit | None:
        """The edit that :meth:`undo` would take back, or the undo that :meth:`redo` would."""
        top = self._top(demonstration, author, kind)
        return None if top is None else _edit_of(self._db, top)

    def can_revert(self, demonstration: str, author: str, kind: Literal["undo", "redo"]) -> bool:
        """Whether :meth:`undo` or :meth:`redo` would take anything back; reads no segment."""
        return self._top(demonstration, author, kind) is not None

    def _top(self, demonstration: str, author: str, kind: Literal["undo", "redo"]) -> int | None:
        """The number of the edit that undo or redo would revert."""
        track = self._track_id(demonstration, author)
        state = UndoState() if track is None else undo_state(self._db, track)
        return state.undo if kind == "undo" else state.redo

    def head(self, demonstration: str, author: str) -> int:
        """The number of the latest edit of a track, undoing and redoing included; 0 if none.

        As long as it is the same the track is the same.
        """
        track = self._track_id(demonstration, author)
        return 0 if track is None else undo_state(self._db, track).head

    def history(
        self,
        demonstration: str,
        author: str,
        *,
        latest: int | None = None,
        before: int | None = None,
    ) -> tuple[Edit, ...]:
        """Every edit ever made of a track, the first one first.

        A long history is read by pages: of the edits before the one with the number `before`, as
        many as `latest`.
        """
        track = self._track_id(demonstration, author)
        if track is None:
            return ()
        rows = self._db.all(
            f"{_EDITS} WHERE track = ? AND (? IS NULL OR edit.id < ?) "
            "ORDER BY edit.id DESC LIMIT ?",
            track,
            before,
            before,
            -1 if latest is None else latest,
        )
        return tuple(_edit_from(row) for row in reversed(rows))

    def replay(self, edits: Iterable[Edit]) -> dict[int, int]:
        """Make edits again as they were made, with their times, all or nothing.

        They come in the order in which they were made, as from :meth:`history`. Gives the new
        number of each by its old one. Refused if one does not fit what those before it left, or its
        demonstration is not here.
        """
        numbers: dict[int, int] = {}
        with self._db.writing():
            existing_ids = self._db.demonstration_ids()
            for edit in edits:
                if edit.demonstration not in existing_ids:
                    raise InputError(
                        f"There is no demonstration '{edit.demonstration}' in '{self._db.folder}'."
                    )
                kind = _author_kind(edit.kind, edit.author)
                if edit.reverts is not None:
                    kind = self._db.author_kind(edit.author) or kind
                track = self._track_for(edit.demonstration, edit.author, kind)
                state = undo_state(self._db, track)
                change, parent = edit, state.undo
                if edit.kind in ("undo", "redo"):
                    change, parent = self._matching(edit, state, numbers.get(edit.reverts or 0))
                numbers[edit.id] = self._apply(track, state, change, parent).id
        return numbers

    def origins(self, demonstration: str, author: str) -> Mapping[Segment, Origin]:
        """Which segments of a track, as it is now, a model proposed; what is human is left out.

        A segment keeps its origin, as changed, while a hand moves its edges, splits it, or merges
        it with others; one that gets another action is the coder's. What is taken back takes
        origins back as well.

        What is returned stays as it is when the track is edited. It is the same object as long as
        nothing in it changes, and costs a query of the latest edit only.
        """
        origins = self._origins.of(demonstration, author)
        if origins is None:
            self._db.demonstration(demonstration)
            return {}
        return origins

    def edits_since(self, labels: Sequence[LabelsUsed], tasks: Sequence[str] = ()) -> int:
        """How many edits labels have had since, and how many demonstrations of `tasks` are new.

        An edit that was taken back counts for nothing; new is what `labels` does not name.
        """
        used_json = json.dumps([[used.demonstration, used.author, used.edit] for used in labels])
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
            used_json,
        )
        (new,) = self._db.all(
            """
            SELECT count(*) AS number FROM demonstration
            WHERE task IN (SELECT value FROM json_each(?))
              AND id NOT IN (SELECT json_extract(value, '$[0]') FROM json_each(?))
            """,
            json.dumps(list(tasks)),
            used_json,
        )
        changed = sum(_net_edits(self._db, row["track"], row["edit"]) for row in edited)
        return changed + int(new["number"])

    def as_imported(self, demonstration: str, author: str) -> bool:
        """Whether the track is what the latest import made it."""
        track = self._track_id(demonstration, author)
        if track is None:
            return False
        row = self._db.one(
            "SELECT id FROM edit WHERE track = ? AND kind = 'import' ORDER BY id DESC LIMIT 1",
            track,
        )
        return row is not None and undo_state(self._db, track).undo == row["id"]

    def _track_id(self, demonstration: str, author: str) -> int | None:
        row = self._db.one(
            "SELECT track.id FROM track JOIN author ON author.id = track.author "
            "WHERE demonstration = ? AND name = ?",
            demonstration,
            author,
        )
        if row is None:
            self._db.demonstration(demonstration)  # it may be that which is unknown
            return None
        return int(row["id"])

    def _track_for(self, demonstration: str, author: str, kind: AuthorKind) -> int:
        """The number of a track, made if there is none; refuses an author of the other kind."""
        known_kind = self._db.author_kind(author)
        if known_kind == kind and (track := self._track_id(demonstration, author)) is not None:
            return track
        check_author(author)
        if known_kind is None:
            self._db.execute("INSERT INTO author (name, kind) VALUES (?, ?)", author, kind)
        elif known_kind != kind:
            raise InputError(
                f"'{author}' is a {known_kind} in this project and cannot be a {kind} as well; "
                f"use another author's name."
            )
        self._db.execute(
            "INSERT OR IGNORE INTO track (demonstration, author) "
            "SELECT ?, id FROM author WHERE name = ?",
            demonstration,
            author,
        )
        track = self._track_id(demonstration, author)
        assert track is not None
        return track

    def _revert(
        self, demonstration: str, author: str, kind: Literal["undo", "redo"]
    ) -> Edit | None:
        with self._db.writing():
            track = self._track_id(demonstration, author)
            if track is None:
                return None
            state = undo_state(self._db, track)
            inverse = self._inverse(kind, state)
            if inverse is None:
                return None
            edit = self._apply(track, state, *inverse)
            follow_edit(self._db, edit, self._original(edit))
            return edit

    def _revert_everywhere(
        self, demonstration: str, author: str, kind: Literal["undo", "redo"]
    ) -> UndoResult | None:
        with self._db.writing():
            first = self._revert(demonstration, author, kind)
            if first is None:
                return None
            task = self._db.demonstration(demonstration)["task"]
            edits, tasks, left = [first], {demonstration: str(task)}, []
            for row in self._edits_made_with(self._original(first)):
                state = undo_state(self._db, row["track"])
                top = state.undo
                if kind == "redo":
                    top = None if state.redo is None else _edit_of(self._db, state.redo).reverts
                if top == row["id"]:
                    reverted = self._revert(row["demonstration"], author, kind)
                    assert reverted is not None
                    edits.append(reverted)
                    tasks[reverted.demonstration] = str(row["task"])
                elif _is_in_effect(self._db, row["track"], row["id"]) == (kind == "undo"):
                    left.append(str(row["name"]))
            return UndoResult(tuple(edits), tasks, tuple(left))

    def _edits_made_with(self, edit: Edit) -> list[sqlite3.Row]:
        """The edits of other tracks that were made by the same renaming as this one."""
        renaming = _renaming(edit.what)
        if not renaming:
            return []
        return self._db.all(
            "SELECT edit.id, track, demonstration, demonstration.name, task FROM edit "
            "JOIN track ON track.id = edit.track JOIN author ON author.id = track.author "
            "JOIN demonstration ON demonstration.id = track.demonstration "
            "WHERE edit.time = ? AND author.name = ? AND edit.id <> ? "
            "AND substr(what, 1, ?) = ? ORDER BY edit.id",
            edit.time.isoformat(),
            edit.author,
            edit.id,
            len(renaming) + len(NUMBER),
            renaming + NUMBER,
        )

    def _original(self, edit: Edit) -> Edit:
        """The edit that an undo, or the redo of one, is about."""
        while edit.reverts is not None:
            edit = _edit_of(self._db, edit.reverts)
        return edit

    def _matching(
        self, edit: Edit, state: UndoState, reverts: int | None
    ) -> tuple[Edit, int | None]:
        """A replayed undo or redo with its parent, if it is the one that can be made now."""
        change = replace(edit, id=_NEW, reverts=reverts)
        inverse = self._inverse(edit.kind, state)
        if inverse is None or replace(inverse[0], what=edit.what, time=edit.time) != change:
            raise InputError(f"Edit {edit.id} of '{edit.author}' takes back what was not there.")
        return change, inverse[1]

    def _inverse(self, kind: EditKind, state: UndoState) -> tuple[Edit, int | None] | None:
        """The undo or redo that can be made now, with its parent; None if there is none."""
        top = state.undo if kind == "undo" else state.redo
        if top is None:
            return None
        old = _edit_of(self._db, top)
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
        return change, state.redo if kind == "undo" else None

    def _apply(self, track: int, state: UndoState, change: Edit, parent: int | None) -> Edit:
        """Change the segments and store the edit; gives it with its number."""
        before = self._segments(track, state.head)
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
            removed=segments_to_text(change.removed),
            inserted=segments_to_text(change.inserted),
            reverts=change.reverts,
            parent=parent,
            proposed_by=change.proposed_by,
        )
        self._cache[track] = (new, after)
        removed, inserted = _as_stored(change.removed), _as_stored(change.inserted)
        return replace(change, id=new, removed=removed, inserted=inserted)

    def _segments(self, track: int, head: int | None = None) -> Segments:
        """The segments of a track as they are now."""
        # The latest edit is asked for before the segments: should another process edit in
        # between, what is cached here only looks older than it is, and is read once more.
        head = undo_state(self._db, track).head if head is None else head
        cached = self._cache.get(track)
        if cached is None or cached[0] != head:
            rows = self._db.all(
                "SELECT start, end, action FROM segment WHERE track = ? ORDER BY start", track
            )
            cached = self._cache[track] = (head, tuple(Segment(*row) for row in rows))
        return cached[1]

    def _check_within(self, row: sqlite3.Row, author: str, segments: Sequence[Segment]) -> None:
        """Refuse labels beyond the recording of a demonstration's row."""
        home = self._db.demonstration_folder(row["id"])
        start = float(files.read_array(home / "times.npy", (row["samples"],))[0])
        cure = f", in the labels of '{author}' on '{row['name']}'; shift or erase it first."
        check_within(segments, start, start + row["duration"], cure)

    def _check_proposer(self, proposer: str, kind: EditKind) -> None:
        """Only models propose, and only what coders paint."""
        if kind != "paint" or not (is_model(proposer) or self._db.author_kind(proposer) == "model"):
            raise InputError(
                f"'{proposer}' is no model that proposes labels to a coder; copy a coder's labels."
            )


def _renaming(description: str) -> str:
    """The half that sentences of one renaming share; ``""`` of another edit, such as a relabel."""
    match = re.fullmatch(rf"(.+{RENAMED}.+){NUMBER}[0-9,]+ segments?", description, re.DOTALL)
    return "" if match is None else match[1]


def _as_stored(segments: Segments) -> Segments:
    """Segments as they are when they are read again."""
    return tuple(Segment(float(s.start), float(s.end), s.action) for s in segments)


def _author_kind(kind: EditKind, author: str) -> AuthorKind:
    """Whether an edit is a model's: its prediction, or the import of one under a model's name."""
    return "model" if kind == "predict" or is_model(author) else "coder"
