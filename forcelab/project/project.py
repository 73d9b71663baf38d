"""The project: one folder, one SQLite store, and every edit ever made.

Undo and redo of what was done in many tracks at once, as one step. The edits of one renaming share
their author, their time and the first half of their sentence: so much tells them, in a project that
was copied or merged as well.

Renaming an action that has segments, or merging it into another one. Nobody edits another's track:
only the coder's own segments get the new name. It keeps key and look; where others use the old
name, that stays in the vocabulary with others. Who codes a demonstration of a task blind is told
nothing of what others have labelled on it: there the old one stays, whether they use it or not.
"""

from __future__ import annotations

import json
import sqlite3
from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from os import PathLike
from pathlib import Path
from typing import Any, Literal

from numpy.typing import NDArray

from forcelab.clock import ClockMap
from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.labels import Segments, Track, check_action_name
from forcelab.project import files, runs
from forcelab.project.coding import ProjectCoding
from forcelab.project.database import Database
from forcelab.project.demonstrations import (
    add_all,
    attach_video,
    discard,
    remove,
    rename,
    set_task,
    set_video_clock,
)
from forcelab.project.folder import ProjectFolder
from forcelab.project.loading import (
    Camera,
    attach_beside,
    attach_stamps,
    cameras,
    files_beside,
    id_of,
    info,
    infos,
    known_id,
    known_ids,
    load,
    natural_order,
    stamps,
    truth,
)
from forcelab.project.records import Added, Author, DemonstrationInfo, Edit, Incoming, utc_now
from forcelab.project.runs import (
    RECOGNISERS,
    RUN,
    LabelsUsed,
    RunSummary,
    RunUse,
    StoredRecogniser,
    StoredRun,
    columns_of,
    keep_recogniser,
    keep_run,
    keeping,
    recogniser_id,
    recogniser_of,
    row_of_run,
    run_of,
    summaries,
)
from forcelab.project.tracks import (
    Tracks,
    edit_of,
    edits_since,
    line_of,
    stands,
    vocabularies,
    write_vocabulary,
)
from forcelab.project.verdicts import ProjectJudged
from forcelab.text import counted, listed, unknown_word
from forcelab.vocabulary import Vocabulary


class ProjectRecorded(ProjectFolder):
    """The videos and stamps of a :class:`~forcelab.project.Project`."""

    def attach_stamps(self, demonstration: str, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Keep a recording's raw stamps beside it, in place of those there.

        Parameters
        ----------
        demonstration : str
            Its id.
        arrays : mapping of str to ndarray
            Numbers and names, such as of :class:`~forcelab.capture.assemble.AssembledRecording`.

        Raises
        ------
        InputError
            If there is no such demonstration or they cannot be written.
        """
        attach_stamps(self._db, demonstration, arrays)

    def stamps(self, demonstration: str) -> dict[str, NDArray[Any]] | None:
        """The raw stamps beside a demonstration; None for all but recorded ones.

        Archives leave them out.

        Raises
        ------
        InputError
            If there is no such demonstration or the file is damaged.
        """
        return stamps(self._db, demonstration)

    def attach_beside(self, demonstration: str, path: str | PathLike[str]) -> Path:
        """Keep a file beside a recording, such as the video of a second camera; gives the copy.

        Archives leave it out; :meth:`beside` tells where it is.

        Parameters
        ----------
        demonstration : str
            Its id.
        path : path-like
            A file; what is in it is not looked at.

        Raises
        ------
        InputError
            If there is no such demonstration or it cannot be copied.
        """
        return attach_beside(self._db, demonstration, Path(path))

    def beside(self, demonstration: str) -> tuple[Path, ...]:
        """The files that are kept beside a recording, such as videos of further cameras.

        Raises
        ------
        InputError
            If there is no such demonstration.
        """
        return files_beside(self._db, demonstration)

    def cameras(self, demonstration: Demonstration) -> tuple[Camera, ...]:
        """The cameras that filmed a recording; none unless there are several.

        Parameters
        ----------
        demonstration : Demonstration
            As :meth:`load` gave it; its video is the first camera's.

        Raises
        ------
        InputError
            If there is no such demonstration or its stamps are damaged.
        """
        return cameras(self._db, demonstration.id, demonstration.video)

    def attach_video(
        self, demonstration: str, path: str | PathLike[str], clock: ClockMap | None = None
    ) -> None:
        """Copy a video into the project, in place of the one that the demonstration has.

        Parameters
        ----------
        demonstration : str
            Its id.
        path : path-like
            The video; what is in it is not looked at.
        clock : ClockMap, optional
            From the video's own timestamps to force time; by default both are the same.

        Raises
        ------
        InputError
            If there is no such demonstration or the video cannot be read; nothing was changed.
        """
        attach_video(self._db, demonstration, Path(path), clock or ClockMap())

    def set_video_clock(self, demonstration: str, clock: ClockMap) -> None:
        """Say how the clock of a demonstration's video maps onto the force clock.

        Raises
        ------
        InputError
            If there is no such demonstration or it has no video.
        """
        set_video_clock(self._db, demonstration, clock)

    def truth(self, demonstration: str) -> dict[str, Any] | None:
        """What was told as the truth when it was added; None for all but simulated ones.

        Raises
        ------
        InputError
            If there is no such demonstration or the file is damaged.
        """
        return truth(self._db, demonstration)


class ProjectPainted(ProjectFolder):
    """The tracks of a :class:`~forcelab.project.Project`, and the actions they may hold."""

    def __init__(self, path: Path, database: Database) -> None:
        super().__init__(path, database)
        self._tracks = Tracks(database)

    def sync_behind(self) -> None:
        """Let edits return before the disk has them, for a coder who paints one after the other.

        From now on what a method stored is safe from this process being killed, and a moment later
        from a power cut as well.
        """
        self._db.sync_behind()

    def authors(self) -> tuple[Author, ...]:
        """Everybody who made an edit, in order of first appearance."""
        rows = self._db.all("SELECT name, kind FROM author ORDER BY id")
        return tuple(Author(row["name"], row["kind"]) for row in rows)

    def coders(self) -> tuple[str, ...]:
        """The people who made an edit, by name, in order of first appearance: no models."""
        return tuple(author.name for author in self.authors() if author.kind == "coder")

    def track(self, demonstration: str, author: str) -> Track:
        """One author's track, empty if the author made none.

        Raises
        ------
        InputError
            If there is no such demonstration.
        """
        return self._tracks.track(self._id(demonstration), author)

    def tracks(self, demonstration: str) -> tuple[Track, ...]:
        """The tracks over a demonstration, in order of their authors' first appearance.

        Raises
        ------
        InputError
            If there is no such demonstration.
        """
        return self._tracks.tracks(self._id(demonstration))

    def edit(
        self,
        demonstration: str,
        author: str,
        before: Segments,
        after: Segments,
        what: str,
        *,
        kind: Literal["paint", "predict"] = "paint",
        proposed_by: str | None = None,
        replacing: int | None = None,
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
        kind : "paint" or "predict"
            Whether a person labelled or a model predicted.
        proposed_by : str, optional
            The model whose prediction a person accepts with this edit.
        replacing : int, optional
            The number of the track's latest edit, in whose place this one is: one undo then takes
            back both, and the history has one line.

        Raises
        ------
        StaleTrackError
            If the track is not `before`, or `replacing` not its latest edit, as another window or
            process changed it.
        InputError
            If there is no such demonstration, segments overlap or are out of order, or the author
            is of the other kind, or what proposed is no model. Nothing was written then.
        """
        id_ = self._id(demonstration)
        with self._db.writing():
            return self._tracks.edit(
                id_,
                author,
                before,
                after,
                what,
                kind=kind,
                proposed_by=proposed_by,
                replacing=replacing,
            )

    def undo(self, demonstration: str, author: str) -> Edit | None:
        """Take back a track's latest edit not yet taken back; None if there is none.

        Reaches back to the first edit, past restarts. It is an edit itself. A verdict for which
        the labels were edited goes with its edit, and comes back with it.
        """
        with self._db.writing():
            return self._tracks.revert(self._id(demonstration), author, "undo")

    def redo(self, demonstration: str, author: str) -> Edit | None:
        """Take back a track's latest undo; None if there is none or something was edited since."""
        with self._db.writing():
            return self._tracks.revert(self._id(demonstration), author, "redo")

    def revertible(
        self, demonstration: str, author: str, kind: Literal["undo", "redo"]
    ) -> Edit | None:
        """The edit that :meth:`undo` would take back, or the undo that :meth:`redo` would.

        None if there is none.
        """
        return self._tracks.revertible(self._id(demonstration), author, kind)

    def head(self, demonstration: str, author: str) -> int:
        """The number of the latest edit of a track, undoing and redoing included; 0 if none.

        As long as it is the same the track is the same.
        """
        return self._tracks.head(self._id(demonstration), author)

    def history(
        self,
        demonstration: str,
        author: str,
        *,
        latest: int | None = None,
        before: int | None = None,
    ) -> tuple[Edit, ...]:
        """Every edit ever made of a track, the first one first.

        Parameters
        ----------
        demonstration, author : str
            Whose track over what.
        latest : int, optional
            Only so many, the latest ones; a long history is read by pages.
        before : int, optional
            Only edits before the one with this number.
        """
        return self._tracks.history(self._id(demonstration), author, latest, before)

    def replay(self, edits: Iterable[Edit]) -> dict[int, int]:
        """Make edits again as they were made, with their times, all or nothing.

        Parameters
        ----------
        edits : iterable of Edit
            In the order in which they were made, as from :meth:`history`.

        Returns
        -------
        dict of int to int
            The new number of each edit by its old one.

        Raises
        ------
        InputError
            If an edit does not fit what the edits before it left, or its demonstration is not here.
        """
        with self._db.writing():
            known = known_ids(self._db)

            def of_known() -> Iterator[Edit]:
                for edit in edits:
                    if edit.demonstration not in known:
                        raise InputError(
                            f"There is no demonstration '{edit.demonstration}' in '{self.path}'."
                        )
                    yield edit

            return self._tracks.replay(of_known())

    # Vocabularies

    def vocabulary(self, task: str) -> Vocabulary:
        """The actions of a task; empty if there is none."""
        return self.vocabularies().get(task, Vocabulary())

    def vocabularies(self) -> dict[str, Vocabulary]:
        """Every vocabulary by task."""
        return vocabularies(self._db)

    def painted_actions(self, task: str) -> frozenset[str]:
        """The actions that any coder's or model's segment of a task has."""
        rows = self._db.all(
            "SELECT DISTINCT action FROM segment JOIN track ON track.id = segment.track "
            "JOIN demonstration ON demonstration.id = track.demonstration WHERE task = ?",
            task,
        )
        return frozenset(row["action"] for row in rows)

    def set_vocabulary(
        self, task: str, vocabulary: Vocabulary, *, before: Vocabulary | None = None
    ) -> bool:
        """Replace the actions of a task; no label changes.

        Parameters
        ----------
        task : str
        vocabulary : Vocabulary
            The actions from now on.
        before : Vocabulary, optional
            What it is made from: where another process has changed that, nothing is written.

        Returns
        -------
        bool
            Whether it was written.
        """
        with self._db.writing():
            if before is not None and self.vocabulary(task) != before:
                return False
            write_vocabulary(self._db, task, vocabulary)
            return True

    def add_actions(self, task: str, names: Iterable[str]) -> Vocabulary:
        """Add the actions that a task's vocabulary lacks; gives all that it has then.

        Raises
        ------
        InputError
            If a name is blank, or a new one says that there is no action.
        """
        with self._db.writing():
            old = self.vocabulary(task)
            new = old.with_actions(*names)
            if new != old:
                for name in {*new.names} - {*old.names} - self.painted_actions(task):
                    check_action_name(name)
                write_vocabulary(self._db, task, new)
            return new

    def _id(self, id_: str) -> str:
        """The id, if there is such a demonstration."""
        return known_id(self._db, id_)


#: What the sentence of a renaming in one track holds, and where its number of segments begins.
RENAMED, NUMBER = " is now ", " in "
#: A sentence names so many demonstrations, and only counts further ones.
NAMED = 3


@dataclass(frozen=True, slots=True)
class UndoResult:
    """What an undo or a redo has changed.

    Parameters
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
        found: dict[str, tuple[set[str], set[str]]] = defaultdict(lambda: (set(), set()))
        for edit in self.edits:
            gone, back = found[self.tasks[edit.demonstration]]
            gone.update(segment.action for segment in edit.removed)
            back.update(segment.action for segment in edit.inserted)
        return dict(found)

    @property
    def reaches_farther(self) -> bool:
        """Whether other demonstrations are concerned than the one that was asked for."""
        return len(self.edits) > 1 or bool(self.left)

    @property
    def renames(self) -> bool:
        """Whether it is a renaming that was undone or redone."""
        return RENAMED in self.edits[0].what

    def sentence(self) -> str:
        """What was done, for people."""
        told = self.edits[0].what
        if len(self.edits) > 1:
            pairs = [zip(edit.removed, edit.inserted, strict=True) for edit in self.edits]
            changed = sum(old != new for pair in pairs for old, new in pair)
            what, _, _ = told.rpartition(NUMBER)
            told = f"{what}{NUMBER}{counted(changed, 'segment')} of "
            told += counted(len(self.edits), "demonstration")
        if self.left:
            names = listed([f"'{name}'" for name in self.left], NAMED)
            told += f"; not in {names}, where something else was edited since"
        return told


class ProjectReverting(ProjectPainted):
    """How a :class:`~forcelab.project.Project` takes back what was done in many tracks."""

    def undo_everywhere(self, demonstration: str, author: str) -> UndoResult | None:
        """Take back a track's latest edit, and a renaming in all of the author's tracks.

        A track in which something was edited after the renaming is left as it is.

        Parameters
        ----------
        demonstration : str
            Its id.
        author : str
            Whose track it is.

        Returns
        -------
        Reverted or None
            None if there is nothing to undo in this track.
        """
        return self._revert_everywhere(demonstration, author, "undo")

    def redo_everywhere(self, demonstration: str, author: str) -> UndoResult | None:
        """Take back a track's latest undo, and that of a renaming in all of the author's tracks.

        A track in which the renaming can be redone no more, or not yet, is left as it is.

        Parameters
        ----------
        demonstration, author : str
            As of :meth:`undo_everywhere`.

        Returns
        -------
        Reverted or None
            None if there is nothing to redo in this track.
        """
        return self._revert_everywhere(demonstration, author, "redo")

    def _revert_everywhere(
        self, demonstration: str, author: str, kind: Literal["undo", "redo"]
    ) -> UndoResult | None:
        """Undo or redo, all of it or nothing."""
        id_ = self._id(demonstration)
        with self._db.writing():
            first = self._tracks.revert(id_, author, kind)
            if first is None:
                return None
            task = self._db.one("SELECT task FROM demonstration WHERE id = ?", id_)
            assert task is not None
            edits, tasks, left = [first], {id_: str(task["task"])}, []
            for row in self._made_with(first):
                line = line_of(self._db, row["track"])
                top = line.undo
                if kind == "redo":
                    top = None if line.redo is None else edit_of(self._db, line.redo).reverts
                if top == row["id"]:
                    another = self._tracks.revert(row["demonstration"], author, kind)
                    assert another is not None
                    edits.append(another)
                    tasks[another.demonstration] = str(row["task"])
                elif stands(self._db, row["track"], row["id"]) == (kind == "undo"):
                    left.append(str(row["name"]))
            return UndoResult(tuple(edits), tasks, tuple(left))

    def _made_with(self, edit: Edit) -> list[sqlite3.Row]:
        """The edits of other tracks that were made together with what an undo or a redo reverts."""
        while edit.reverts is not None:
            edit = edit_of(self._db, edit.reverts)
        what, _, number = edit.what.rpartition(NUMBER)
        if not number or RENAMED not in what:
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
            len(what) + len(NUMBER),
            what + NUMBER,
        )


#: A sentence names so many tasks or coders, and only counts further ones.
NAMED_AT_MOST = 5


@dataclass(frozen=True, slots=True)
class ActionRename:
    """What renaming an action changes, or has changed.

    Parameters
    ----------
    author : str
        The coder whose segments get the new name.
    old, new : str
        The names.
    tasks : tuple of str
        Whose actions change.
    segments : mapping of str to int
        By the id of each demonstration, how many segments get the new name.
    merges : bool
        Whether there is an action of the new name already.
    others : mapping of str to int
        By other coder, how many segments keep the old name, as far as the coder may see them.
    kept : frozenset of str
        The tasks in which the old name stays an action, as others use it.
    learnt : bool
        Whether recognisers or runs were made of what changes; they keep the old name.
    """

    author: str
    old: str
    new: str
    tasks: tuple[str, ...]
    segments: Mapping[str, int]
    merges: bool
    others: Mapping[str, int]
    kept: frozenset[str]
    learnt: bool

    def sentences(self, *, done: bool) -> str:
        """What changes, or has changed, and what stays, for people."""
        told = f"'{self.old}' {'is now' if done else 'becomes'} '{self.new}'"
        where = listed([task or "no task" for task in self.tasks], NAMED_AT_MOST)
        if self.segments:
            segments = counted(sum(self.segments.values()), "segment")
            number = counted(len(self.segments), "demonstration")
            told += f" in {segments} of {self.author}, in {number} of {where}."
        else:
            told += f" in {where}; {self.author} has no segment of '{self.old}'."
        if self.merges and not done:
            told += f" There is an action '{self.new}' already."
        if self.others:
            left = [f"{who} ({counted(number, 'segment')})" for who, number in self.others.items()]
            told += f" It stays '{self.old}' for {listed(left, NAMED_AT_MOST)}."
        elif self.kept:
            told += f" '{self.old}' stays in the list, as others may use it."
        if self.kept and not self.merges:
            gets = "has" if done else "gets"
            told += f" '{self.new}' keeps key and colour; '{self.old}' {gets} others."
        if self.learnt:
            told += f" Recognisers and runs made before keep '{self.old}': train again."
        return told


class ProjectRenaming(ProjectPainted, ProjectCoding):
    """What a :class:`~forcelab.project.Project` knows of renaming actions."""

    def renaming(
        self, author: str, old: str, new: str, tasks: Collection[str] | None = None
    ) -> ActionRename:
        """What :meth:`rename_action` would change; parameters and errors are those of it."""
        known = {
            task: vocabulary
            for task, vocabulary in self.vocabularies().items()
            if tasks is None or task in tasks
        }
        used = [row for row in self._using(old) if tasks is None or row["task"] in tasks]
        mine = [row for row in used if row["author"] == author]
        others = [row for row in used if row["author"] != author]
        hidden = self.blind_to(author)
        seen = [row for row in others if row["demonstration"] not in hidden]
        # Others may use it wherever the coder must not know whether they do.
        shared = frozenset(row["task"] for row in seen) | self.blind_tasks(author)
        offering = {task for task, vocabulary in known.items() if old in vocabulary}
        if not (mine or seen or offering):
            names = dict.fromkeys(name for one in known.values() for name in one.names)
            raise InputError(unknown_word("action", old, names or ("none at all",)))
        changing = {row["task"] for row in mine} | (offering - shared)
        if not changing:
            raise InputError(
                f"'{old}' was not renamed: {author} has no segment of it, and others may use it."
            )
        if not new.strip() or new == old:
            raise InputError(f"'{old}' needs another name to be renamed.")
        check_action_name(new)
        own = {row["task"] for row in self._using(new) if row["author"] == author}
        left: Counter[str] = Counter()
        for row in seen:
            if row["task"] in changing:
                left[row["author"]] += row["segments"]
        return ActionRename(
            author=author,
            old=old,
            new=new,
            tasks=tuple(sorted(changing, key=natural_order)),
            segments={row["demonstration"]: row["segments"] for row in mine},
            merges=any(new in known.get(task, ()) or task in own for task in changing),
            others=dict(left),
            kept=shared & changing & offering,
            learnt=self._learnt_from({row["demonstration"] for row in mine}, author),
        )

    def rename_action(
        self,
        author: str,
        old: str,
        new: str,
        tasks: Collection[str] | None = None,
        *,
        merge: bool = False,
    ) -> ActionRename:
        """Rename an action in all of a coder's tracks, one edit a track, all or nothing.

        Each edit stands in the history of its track and can be undone there, or all of them at
        once by :meth:`~forcelab.project.Project.undo_everywhere`. The action keeps its
        colour and its key; where others use it, the old name stays for them with the next that
        are free. Predictions, recognisers and runs keep the old name.

        Parameters
        ----------
        author : str
            The coder; nobody else's labels change.
        old, new : str
            The names.
        tasks : collection of str, optional
            Only in demonstrations of these tasks.
        merge : bool
            Whether the new name may be that of an action there is. What had the two names cannot
            be told apart any more, but by the history; no segments become one.

        Returns
        -------
        Renaming
            What has changed.

        Raises
        ------
        InputError
            If there is no such action, only others have segments of it, the new name is blank, the
            old one or says that there is none, or an action has it and `merge` is not given.
            Nothing was changed then.
        """
        with self._db.writing():
            change = self.renaming(author, old, new, tasks)
            if change.merges and not merge:
                raise InputError(
                    f"There is an action '{new}' already; merge the two or choose another name."
                )
            now = self._free_time()
            for id_, number in change.segments.items():
                before = self._tracks.track(id_, author).segments
                after = tuple(replace(s, action=new) if s.action == old else s for s in before)
                what = f"{old} is now {new} in {counted(number, 'segment')}"
                self._tracks.edit(id_, author, before, after, what, kind="paint", time=now)
            for task in change.tasks:
                vocabulary = _renamed(self.vocabulary(task), old, new, task in change.kept)
                write_vocabulary(self._db, task, vocabulary)
            return change

    def refuse_removing(self, author: str, action: str, task: str) -> None:
        """Refuse to take an action out of a task's vocabulary that segments have, or may have.

        Parameters
        ----------
        author : str
            The coder who would remove it, and is told no more than that coder may know.
        action, task : str

        Raises
        ------
        InputError
            If a segment of the task has the action, as far as the coder may see; or if the coder
            codes demonstrations of the task blind.
        """
        hidden = self.blind_to(author)
        rows = self._db.all(
            "SELECT DISTINCT demonstration, author.name AS author FROM segment "
            "JOIN track ON track.id = segment.track JOIN author ON author.id = track.author "
            "JOIN demonstration ON demonstration.id = track.demonstration "
            "WHERE action = ? AND task = ?",
            action,
            task,
        )
        if any(row["author"] == author or row["demonstration"] not in hidden for row in rows):
            raise InputError(
                f"There are segments of '{action}' in demonstrations of {task or 'no task'}; "
                "rename it to the action they should be, or delete those."
            )
        if task in self.blind_tasks(author):
            raise InputError(
                f"'{action}' stays in the list, as others may use it: {author} codes "
                f"demonstrations of {task or 'no task'} blind. It can be removed once those are "
                "done."
            )

    def blind_tasks(self, author: str) -> frozenset[str]:
        """The tasks of demonstrations of which everything by others is hidden from a coder.

        Parameters
        ----------
        author : str
        """
        rows = self._db.all(
            "SELECT DISTINCT task FROM demonstration WHERE id IN (SELECT value FROM json_each(?))",
            json.dumps(sorted(self.blind_to(author))),
        )
        return frozenset(row["task"] for row in rows)

    def _free_time(self) -> datetime:
        """The time now, or just after: that of no edit yet, as edits made together share theirs."""
        now = utc_now()
        while self._db.one("SELECT 1 FROM edit WHERE time = ? LIMIT 1", now.isoformat()):
            now += timedelta(microseconds=1)  # a coarse clock, or one that was put back
        return now

    def _using(self, action: str) -> list[sqlite3.Row]:
        """How many segments of an action each coder has on each demonstration."""
        return self._db.all(
            "SELECT demonstration, task, author.name AS author, count(*) AS segments FROM segment "
            "JOIN track ON track.id = segment.track JOIN author ON author.id = track.author "
            "JOIN demonstration ON demonstration.id = track.demonstration "
            "WHERE action = ? AND kind = 'coder' GROUP BY track.id ORDER BY author.id, track.id",
            action,
        )

    def _learnt_from(self, demonstrations: Collection[str], author: str) -> bool:
        """Whether a recogniser or a run was made of an author's labels of some demonstrations."""
        row = self._db.one(
            "SELECT 1 FROM (SELECT labels FROM recogniser UNION ALL SELECT labels FROM run), "
            "json_each(labels) WHERE json_extract(value, '$[1]') = ? "
            "AND json_extract(value, '$[0]') IN (SELECT value FROM json_each(?)) LIMIT 1",
            author,
            json.dumps(list(demonstrations)),
        )
        return row is not None


def _renamed(vocabulary: Vocabulary, old: str, new: str, kept: bool) -> Vocabulary:
    """The actions of a task once a coder's `old` is `new`."""
    if old not in vocabulary:
        return vocabulary.with_actions(new)
    if new in vocabulary:
        return vocabulary if kept else vocabulary.removed(old)
    renamed = vocabulary.renamed(old, new)
    return renamed.with_actions(old) if kept else renamed


class ProjectComputed(ProjectCoding):
    """The recognisers and runs of a :class:`~forcelab.project.Project`."""

    def add_recogniser(
        self,
        name: str,
        data: bytes | str | PathLike[str],
        *,
        settings: Mapping[str, Any],
        seed: int | None,
        labels: Sequence[LabelsUsed],
        versions: Mapping[str, str],
        time: datetime | None = None,
    ) -> str:
        """Keep a recogniser's file, which stays opaque here, and how it was made; gives its id.

        Parameters
        ----------
        name : str
            For people; not blank.
        data : bytes or path-like
            Its content, or the file. The same content is kept once, as it was added first.
        settings : mapping
            Everything that training was told; anything that JSON can hold.
        seed : int or None
            The random seed.
        labels : sequence of LabelsUsed
            What it was trained on, one for each demonstration; see :meth:`head`.
        versions : mapping of str to str
            Of the program and the libraries.
        time : datetime, optional
            When it was made, in UTC; by default now.

        Raises
        ------
        InputError
            If it has no name, labels are not in the project or the file cannot be read.
        """
        columns = columns_of(self._db, settings, seed, labels, versions, time)
        with files.told(f"The recogniser '{name}' was not added to '{self.path}'"):
            content = data if isinstance(data, bytes) else Path(data).read_bytes()
            id_ = recogniser_id(content)
            with keeping(self._db, id_):
                keep_recogniser(self._db, id_, name, content, columns)
        return id_

    def recognisers(self) -> tuple[StoredRecogniser, ...]:
        """Every recogniser, the first one first."""
        return tuple(map(recogniser_of, self._db.all("SELECT * FROM recogniser ORDER BY rowid")))

    def recogniser_path(self, id_: str) -> Path:
        """The file of a recogniser.

        Raises
        ------
        InputError
            If there is no such recogniser or its file is missing.
        """
        if not self._db.one("SELECT 1 FROM recogniser WHERE id = ?", id_):
            raise InputError(
                f"There is no recogniser '{id_}' in '{self.path}' any more; train it again."
            )
        path = self.path / RECOGNISERS / f"{id_}.skops"
        files.check_file(path)
        if not path.is_file():
            raise InputError(f"The file '{path}' is missing; train the recogniser again.")
        return path

    def add_run(
        self,
        kind: str,
        *,
        settings: Mapping[str, Any],
        seed: int | None,
        labels: Sequence[LabelsUsed],
        versions: Mapping[str, str],
        result: Mapping[str, Any],
        time: datetime | None = None,
    ) -> int:
        """Keep what was computed, and how; gives its number.

        Parameters
        ----------
        kind : str
            Such as ``"evaluate"``; not blank.
        settings, seed, labels, versions, time
            As of :meth:`add_recogniser`.
        result : mapping
            What came out; anything that JSON can hold.

        Raises
        ------
        InputError
            If it has no kind or labels are not in the project.
        """
        columns = columns_of(self._db, settings, seed, labels, versions, time)
        with self._db.writing():
            return keep_run(self._db, kind, result, columns)

    def add_training(
        self,
        kind: str,
        name: str,
        content: bytes,
        *,
        settings: Mapping[str, Any],
        seed: int | None,
        labels: Sequence[LabelsUsed],
        trained_on: Sequence[LabelsUsed],
        versions: Mapping[str, str],
        result: Mapping[str, Any],
    ) -> int:
        """Keep a run and its recogniser, both or neither; gives the run's number.

        Parameters
        ----------
        kind, settings, seed, labels, versions
            As of :meth:`add_run`.
        name, content
            The recogniser's, as of :meth:`add_recogniser`.
        trained_on : sequence of LabelsUsed
            What the recogniser was trained on.
        result : mapping
            What came out; the recogniser's id is added to it as ``"recogniser"``.

        Raises
        ------
        InputError
            If labels are not in the project, or it cannot be written.
        """
        columns = columns_of(self._db, settings, seed, labels, versions)
        of_recogniser = columns_of(self._db, settings, seed, trained_on, versions)
        id_ = recogniser_id(content)
        with (
            files.told(f"The recogniser '{name}' was not added to '{self.path}'"),
            keeping(self._db, id_),
        ):
            number = keep_run(self._db, kind, dict(result) | {"recogniser": id_}, columns)
            keep_recogniser(self._db, id_, name, content, of_recogniser)
        return number

    def run_summaries(self, kind: str | None = None) -> tuple[RunSummary, ...]:
        """Every run, or every run of a kind, without its result; the first one first."""
        return summaries(self._db, kind)

    def still_there(self, labels: Iterable[LabelsUsed]) -> list[LabelsUsed]:
        """Those of some labels whose demonstrations have not been removed meanwhile.

        What took minutes to compute from the others is worth keeping.
        """
        there = known_ids(self._db)
        return [used for used in labels if used.demonstration in there]

    def edits_since(self, labels: Sequence[LabelsUsed], tasks: Sequence[str] = ()) -> int:
        """How many edits some labels have had since, and how many demonstrations are new.

        Parameters
        ----------
        labels : sequence of LabelsUsed
            Whose later edits are counted; one that was taken back counts for nothing.
        tasks : sequence of str
            Their demonstrations that `labels` does not name are counted.
        """
        return edits_since(self._db, labels, tasks)

    def runs(self) -> tuple[StoredRun, ...]:
        """Every run, the first one first."""
        return tuple(map(run_of, self._db.all(f"SELECT {RUN} FROM run ORDER BY id")))

    def forget_run(self, number: int, proposer: str) -> bool:
        """Delete a run that another one has taken the place of, with its recogniser.

        It stays where a verdict was given on it or labels were accepted from it: what people said
        is kept for ever, with what they said it of.

        Parameters
        ----------
        number : int
            The run's.
        proposer : str
            As whom it proposed labels.

        Returns
        -------
        bool
            Whether it is gone.
        """
        return runs.forget_run(self._db, number, proposer)

    def run_uses(self, number: int | None = None) -> tuple[RunUse, ...]:
        """What runs take up on the disk and what hangs on them, the first one first.

        Parameters
        ----------
        number : int, optional
            Only of this run; by default of every one.
        """
        return runs.uses(self._db, number)

    def recogniser_bytes(self) -> dict[str, int]:
        """How large the file of each recogniser is, by its id; 0 where it is missing."""
        return runs.recogniser_bytes(self._db)

    def remove_run(self, number: int) -> None:
        """Delete a run for good: its predictions and scores, and its recogniser.

        Labels stay, those accepted from its predictions, too, and still tell who proposed them;
        verdicts stay, but no longer tell which run they were given on. A recogniser that another
        run has as well stays. Room that is free then is given back to the disk.

        Raises
        ------
        InputError
            If there is no such run.
        """
        runs.remove_run(self._db, number)

    def remove_recogniser(self, id_: str) -> None:
        """Delete a recogniser for good; a run that it belongs to keeps what it found.

        Raises
        ------
        InputError
            If there is no such recogniser.
        """
        runs.remove_recogniser(self._db, id_)

    def run(self, number: int) -> StoredRun:
        """One run.

        Raises
        ------
        InputError
            If there is no such run, or it is damaged.
        """
        return run_of(row_of_run(self._db, number))


class Project(ProjectRenaming, ProjectReverting, ProjectJudged, ProjectComputed, ProjectRecorded):
    """A folder of demonstrations with everybody's labels and every edit ever made.

    Made by :meth:`create` or :meth:`open`; a context manager. Everything is on the disk when a
    method returns, but for :meth:`sync_behind`. Several processes may have one project open; each
    thread opens its own. A demonstration is told by its id, except in :meth:`load`.

    Every method raises :class:`~forcelab.errors.InputError` if the disk is full, the store is
    damaged, or another process keeps it busy for more than five seconds; nothing was written then.

    Attributes
    ----------
    path : Path
        The project's folder.
    """

    def add(
        self, demonstration: Demonstration, tracks: Iterable[Track] = (), source: str = ""
    ) -> Added:
        """Add one demonstration; see :meth:`add_all`.

        Parameters
        ----------
        demonstration, tracks, source
            As of :class:`Incoming`.
        """
        return self.add_all([Incoming(demonstration, tuple(tracks), source)])[0]

    def add_all(self, given: Iterable[Incoming]) -> tuple[Added, ...]:
        """Add demonstrations, or update those with the same content, all or none of them.

        Name, task, rate and video become those given, but for what is to be kept; without a video,
        the one there stays. Where another demonstration of the task has the name, a number is put
        after it. An author's track is imported if there is none or it is as last imported; if it
        was edited since, it stays. Actions that the task's vocabulary lacks are added to it, with
        the looks that were given where these are free.

        Parameters
        ----------
        given : iterable of Incoming
            What is to be added, in this order.

        Returns
        -------
        tuple of Added
            What became of each.

        Raises
        ------
        InputError
            If a video cannot be read, two tracks of a demonstration have one author, or labels lie
            beyond their recording by more than a second and 5 % of it; nothing was added.
        """
        return add_all(self._db, self._tracks, tuple(given))

    def demonstrations(self, task: str | None = None) -> tuple[DemonstrationInfo, ...]:
        """What there is, or what there is of one task, sorted by task and name."""
        return infos(self._db, task)

    def info(self, demonstration: str) -> DemonstrationInfo:
        """What there is of one demonstration, by its id.

        Raises
        ------
        InputError
            If there is no such demonstration.
        """
        return info(self._db, demonstration)

    def people(self) -> tuple[str, ...]:
        """The people the project knows by name, no models: see :meth:`coders`.

        After who made an edit come those to whom something is assigned, and who wrote a note:
        whoever is to label blind has to be found under the very name that was assigned to.
        """
        assigned = (one.author for one in self.assignments())
        noted = (note.author for note in self.notes())
        return tuple(dict.fromkeys([*self.coders(), *assigned, *noted]))

    def tasks(self) -> tuple[str, ...]:
        """The tasks of all demonstrations, sorted."""
        rows = self._db.all("SELECT DISTINCT task FROM demonstration")
        return tuple(sorted((row["task"] for row in rows), key=natural_order))

    def check_task(self, task: str) -> None:
        """Refuse a task that no demonstration has.

        Raises
        ------
        InputError
            If it is none; the sentence names those that there are.
        """
        known = self.tasks()
        if task not in known:
            raise InputError(unknown_word("task", task, known or ("none at all",)))

    def id_of(self, key: str) -> str:
        """The id of a demonstration, whose files are not looked at.

        Parameters
        ----------
        key : str
            Its id, its name, or the first six or more digits of its id.

        Raises
        ------
        InputError
            If there is none or more than one such demonstration.
        """
        return id_of(self._db, key)

    def load(self, key: str) -> Demonstration:
        """Load a demonstration; its arrays are mapped into memory, read-only.

        Parameters
        ----------
        key : str
            Its id, its name, or the first six or more digits of its id.

        Raises
        ------
        InputError
            If there is none or more than one such demonstration, or a file of it is missing,
            truncated or another one.
        """
        return load(self._db, key)

    def discard(self, demonstration: str, heads: Mapping[str, int]) -> None:
        """Remove a recording that was not worth keeping, for good, with what was marked live.

        Parameters
        ----------
        demonstration : str
            Its id.
        heads : mapping of str to int
            Of each author, the :meth:`head` of the track it was added with.

        Raises
        ------
        InputError
            If there is no such demonstration, or it was labelled, assigned, reviewed or used for
            training or evaluation since: it stays then.
        """
        discard(self._db, demonstration, heads)

    def remove_all(self, heads: Mapping[str, Mapping[str, int]]) -> None:
        """Remove demonstrations for good, with videos, everybody's labels, notes and assignments.

        All or none of them. Runs and recognisers stay; what they were made of cannot be looked up
        any more.

        Parameters
        ----------
        heads : mapping of str to mapping of str to int
            By the id of each, of each coder whose labels may go, the :meth:`head` of the track.

        Raises
        ------
        InputError
            If there is none of one of them, or a coder's labels are others than those: all stay.
        """
        remove(self._db, heads)

    def set_task(self, demonstration: str, task: str) -> None:
        """Put a demonstration into another task; its vocabulary gets the actions it lacks.

        The task that it leaves gives up the actions that came with its import and that no other
        demonstration there has.

        Parameters
        ----------
        demonstration : str
            Its id.
        task : str
            The task, which need not be known; ``""`` for none.

        Raises
        ------
        InputError
            If there is no such demonstration, or another one of the task has its name.
        """
        set_task(self._db, demonstration, task)

    def rename(self, demonstration: str, name: str) -> None:
        """Give a demonstration another name.

        Raises
        ------
        InputError
            If there is no such demonstration, the name is blank, or another demonstration of the
            task has it.
        """
        rename(self._db, demonstration, name)
