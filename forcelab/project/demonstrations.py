"""The demonstrations of a project: added, listed, loaded, put right and removed.

A demonstration is removed as a whole or, if the process is killed meanwhile, not at all. What
people labelled is kept as long as its demonstration. A recording that has just become one holds
nothing of that and can be discarded. One that was imported by mistake can be removed with what was
labelled on it, by a coder who was told whose labels these are.
"""

from __future__ import annotations

import contextlib
import json
import re
import shutil
import sqlite3
from collections import defaultdict
from collections.abc import Callable, Collection, Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from forcelab.clock import ClockMap
from forcelab.demonstration import Channel, Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.io import sync_folder
from forcelab.jobs import Progress, finish, job
from forcelab.labels import Track, is_model
from forcelab.project import files
from forcelab.project.actions import ActionStore
from forcelab.project.coding import CodingStore
from forcelab.project.database import Database, Value, content_errors
from forcelab.project.files import DEMONSTRATIONS
from forcelab.project.media import remove_unused_videos, video_rows, write_video
from forcelab.project.records import (
    AddResult,
    DemonstrationInfo,
    LabelImport,
    NewDemonstration,
    check_length,
)
from forcelab.project.tracks import TrackStore, undo_state
from forcelab.text import natural_order, unknown_word
from forcelab.vocabulary import Vocabulary

#: Name of the file in a demonstration's folder that holds its truth, where it was simulated.
_TRUTH = "truth.json"
_SHORTEST_PREFIX = 6
#: Tables whose rows a trigger keeps for ever.
_PERMANENT = ("edit", "assignment", "verdict", "note")
_TRACKS = "SELECT id FROM track WHERE demonstration = ?"
_LABELLED = """
    SELECT track.demonstration AS id, author.name AS author,
           coalesce((SELECT sum(end - start) FROM segment WHERE track = track.id), 0.0) AS seconds,
           coalesce((SELECT max(id) FROM edit WHERE track = track.id), 0) AS edit
    FROM track JOIN author ON author.id = track.author
"""


class DemonstrationStore:
    """The demonstrations of a project; ``project.demonstrations``."""

    def __init__(
        self, database: Database, tracks: TrackStore, actions: ActionStore, coding: CodingStore
    ) -> None:
        self._db = database
        self._tracks = tracks
        self._actions = actions
        self._coding = coding

    def infos(self, task: str | None = None) -> tuple[DemonstrationInfo, ...]:
        """All demonstrations, or those of one task, sorted by task and name; opens no array."""
        tracks: dict[str, list[sqlite3.Row]] = defaultdict(list)
        for row in self._db.all(f"{_LABELLED} ORDER BY author.id"):
            tracks[row["id"]].append(row)
        videos: dict[str, list[sqlite3.Row]] = defaultdict(list)
        for row in self._db.all("SELECT * FROM video ORDER BY position"):
            videos[row["demonstration"]].append(row)
        rows = self._db.all("SELECT * FROM demonstration")
        rows.sort(key=lambda row: (natural_order(row["task"]), natural_order(row["name"])))
        return tuple(
            _info(row, tracks.get(row["id"], ()), videos.get(row["id"], ()))
            for row in rows
            if task is None or row["task"] == task
        )

    def info(self, demonstration: str) -> DemonstrationInfo:
        """The name, task, length and labelled time of a demonstration, by its id."""
        query = f"{_LABELLED} WHERE track.demonstration = ? ORDER BY author.id"
        return _info(
            self._db.demonstration(demonstration),
            self._db.all(query, demonstration),
            video_rows(self._db, demonstration),
        )

    def tasks(self) -> tuple[str, ...]:
        """The tasks of all demonstrations, sorted."""
        rows = self._db.all("SELECT DISTINCT task FROM demonstration")
        return tuple(sorted((row["task"] for row in rows), key=natural_order))

    def check_task(self, task: str) -> None:
        """Raise InputError, which names the tasks that there are, if no demonstration has this."""
        tasks = self.tasks()
        if task not in tasks:
            raise InputError(unknown_word("task", task, tasks or ("none at all",)))

    def id_of(self, key: str) -> str:
        """The id of a demonstration, by its id, its name, or six or more first digits of its id.

        Its files are not looked at. InputError if there is none or more than one.
        """
        return str(self._find(key)["id"])

    def load(self, key: str) -> Demonstration:
        """Load a demonstration; its arrays are mapped into memory, read-only.

        Parameters
        ----------
        key : str
            Its id, its name, or the first six or more digits of its id.

        Raises
        ------
        InputError
            If there is none or more than one, or a file of it is missing, truncated or another one.
        """
        row = self._find(key)
        home = self._db.demonstration_folder(row["id"])
        try:
            times, signals = _read_signals(home, row)
        except InputError as error:
            why = str(error)
            raise InputError(
                f"'{row['name']}' cannot be read: {why[0].lower()}{why[1:]}"
            ) from error
        videos = video_rows(self._db, row["id"])
        for video in videos:
            files.check_file(home / video["file"])
        demonstration = Demonstration(
            name=row["name"],
            task=row["task"],
            times=times,
            signals=signals,
            channels=_channels_of(row),
            videos=tuple(
                VideoReference(home / v["file"], ClockMap(v["offset"], v["rate"]), v["name"])
                for v in videos
            ),
            grid_rate=row["grid_rate"],
        )
        # Both take most of a second for ten million samples. And whatever becomes of its files, it
        # is this demonstration that is meant.
        vars(demonstration).update(period=row["period"], id=row["id"])
        return demonstration

    def truth(self, demonstration: str) -> dict[str, Any] | None:
        """The truth that was stored when it was added; None for all but simulated ones."""
        self._db.demonstration(demonstration)
        return files.read_json(self._db.demonstration_folder(demonstration) / _TRUTH)

    def add(
        self, demonstration: Demonstration, tracks: Iterable[Track] = (), source: str = ""
    ) -> AddResult:
        """Add one demonstration, as :class:`NewDemonstration` has it; see :meth:`add_all`."""
        return self.add_all([NewDemonstration(demonstration, tuple(tracks), source)])[0]

    def add_all(self, demonstrations: Iterable[NewDemonstration]) -> tuple[AddResult, ...]:
        """Add demonstrations, or update those with the same content, all or none of them.

        Name, task and rate become those given, but for what is to be kept. A video takes the place
        of the one of its name; others stay. Where another demonstration of the task has the name, a
        number is put after it. An author's track is imported if there is none or it is as last
        imported; if it was edited since, it stays. Actions that the task's vocabulary lacks are
        added to it, with the looks that were given where these are free. Gives what became of each.

        Raises
        ------
        InputError
            If a video cannot be read, two tracks of a demonstration have one author, or labels lie
            beyond their recording by more than a second and 5 % of it; nothing was added.
        """
        return finish(self.add_all_job(demonstrations))

    @job
    def add_all_job(
        self, demonstrations: Iterable[NewDemonstration]
    ) -> Generator[Progress, None, tuple[AddResult, ...]]:
        """As :meth:`add_all`, as a job; cancelled, it adds nothing."""
        incoming = tuple(demonstrations)
        for each in incoming:
            check_length(each.demonstration.name, "name")
            check_length(each.demonstration.task, "task")
            for video in each.demonstration.videos:
                check_length(video.name, "name of a video")
            authors = [track.author for track in each.tracks]
            if len(set(authors)) < len(authors):
                name = each.demonstration.name
                raise InputError(f"'{name}' has two tracks of one author; rename one.")
        if not incoming:
            return ()
        self._db.refuse_read_only()
        root = self._db.folder / DEMONSTRATIONS
        others = ", and neither were the others" if len(incoming) > 1 else ""
        with (
            files.file_errors(f"Nothing was added to '{self._db.folder}'"),
            files.staging(root) as staging,
        ):
            stores = self._db, self._tracks, self._actions, self._coding
            additions = [
                _Addition(*stores, each, staging / str(number))
                for number, each in enumerate(incoming)
            ]
            # The slow part, while others may still write.
            for done, addition in enumerate(additions):
                yield Progress(done, len(additions), f"writing {self._db.folder.name}")
                with files.file_errors(addition.failure + others):
                    addition.stage()
            yield Progress(len(additions), len(additions), f"writing {self._db.folder.name}")
            with self._db.writing():
                try:
                    for addition in additions:
                        with files.file_errors(addition.failure + others):
                            addition.write()
                    sync_folder(root)
                except BaseException:
                    for addition in additions:
                        addition.take_back()
                    raise
        for addition in additions:
            addition.tidy()
        return tuple(addition.result() for addition in additions)

    def import_labels(self, imports: Iterable[LabelImport]) -> None:
        """Store labels from files on demonstrations that are there, one edit a track, all or none.

        Actions that a task's vocabulary lacks are added to it.

        Raises
        ------
        StaleTrackError
            If a track is not what it was when the import was prepared.
        InputError
            If labels lie beyond their demonstration by more than a second and 5 % of it, or the
            author is a model.
        """
        with self._db.writing():
            for each in imports:
                # What a coder had labelled stays the coder's: importing the recording anew may
                # replace an import, but not these.
                kind: Literal["paint", "import"] = "paint" if each.before else "import"
                id_, track = each.demonstration, each.track
                self._tracks.edit(
                    id_, track.author, each.before, track.segments, each.what, kind=kind
                )
                self._actions.extend(self._db.demonstration(id_)["task"], id_, Vocabulary())

    def set_task(self, demonstration: str, task: str) -> None:
        """Put a demonstration into another task; its vocabulary gets the actions it lacks.

        The task need not be known; ``""`` is none. The one that it leaves gives up the actions that
        came with its import and that no other demonstration there has. InputError if another
        demonstration of the task has its name.
        """
        task = " ".join(task.split())
        check_length(task, "task")
        with self._db.writing():
            row = self._db.demonstration(demonstration)
            if row["task"] == task:
                return
            if self._db.one(
                "SELECT 1 FROM demonstration WHERE task = ? AND name = ?", task, row["name"]
            ):
                where = f"Task '{task}' has" if task else "Without a task there is"
                raise InputError(
                    f"{where} another demonstration called '{row['name']}'; rename one of them "
                    "first."
                )
            self._db.execute("UPDATE demonstration SET task = ? WHERE id = ?", task, demonstration)
            painted = {s.action for track in self._tracks.of(demonstration) for s in track.segments}
            old = self._actions.vocabulary(row["task"])
            styles = Vocabulary(tuple(action for action in old if action.name in painted))
            self._actions.extend(task, demonstration, styles)
            self._actions.drop_imported(row["task"], demonstration)

    def rename(self, demonstration: str, name: str) -> None:
        """Give a demonstration another name.

        InputError if that is blank, or another demonstration of the task has it.
        """
        name = name.strip()
        if not name:
            raise InputError("A demonstration needs a name.")
        check_length(name, "name")
        with self._db.writing():
            row = self._db.demonstration(demonstration)
            if self._db.one(
                "SELECT 1 FROM demonstration WHERE task = ? AND name = ? AND id <> ?",
                row["task"],
                name,
                demonstration,
            ):
                raise InputError(
                    f"'{row['name']}' was not renamed, as another demonstration of "
                    f"{_task_phrase(row['task'])} is called '{name}'; choose another name."
                )
            self._db.execute("UPDATE demonstration SET name = ? WHERE id = ?", name, demonstration)

    def discard(self, demonstration: str, heads: Mapping[str, int]) -> None:
        """Remove a recording that was not worth keeping, for good, with what was marked live.

        Parameters
        ----------
        demonstration : str
            Its id.
        heads : mapping of str to int
            Of each author, the ``tracks.head`` of the track it was added with.

        Raises
        ------
        InputError
            If it was labelled, assigned, reviewed or used for training or evaluation since: it
            stays then.
        """
        self._remove(
            [demonstration], lambda id_: self._what_was_done(id_, heads), "since it was recorded"
        )

    def remove_all(self, heads: Mapping[str, Mapping[str, int]]) -> None:
        """Remove demonstrations for good, with videos, everybody's labels, notes and assignments.

        All or none of them. Runs and recognisers stay; what they were made of cannot be looked up
        any more.

        Parameters
        ----------
        heads : mapping of str to mapping of str to int
            By the id of each, of each coder whose labels may go, the ``tracks.head`` of the track.

        Raises
        ------
        InputError
            If a coder's labels are others than those: all stay.
        """
        self._remove(heads, lambda id_: self._labelled_since(id_, heads[id_]), "meanwhile")
        self._db.give_back()

    def _find(self, key: str) -> sqlite3.Row:
        """The demonstration with this id, name or beginning of an id."""
        rows = self._db.all("SELECT * FROM demonstration WHERE id = ? OR name = ?", key, key)
        rows = [row for row in rows if row["id"] == key] or rows
        if not rows and len(key) >= _SHORTEST_PREFIX and re.fullmatch("[0-9a-f]+", key):
            rows = self._db.all("SELECT * FROM demonstration WHERE id GLOB ?", f"{key}*")
        if not rows:
            raise InputError(
                f"There is no demonstration '{key}' in '{self._db.folder}'; use a name, an id or "
                f"its first {_SHORTEST_PREFIX} or more digits."
            )
        if len(rows) > 1:
            matches = ", ".join(f"{row['id'][:12]} (task '{row['task']}')" for row in rows)
            raise InputError(f"'{key}' may be any of {matches}; use the id.")
        return rows[0]

    def _remove(self, ids: Collection[str], obstacle: Callable[[str], str], since: str) -> None:
        """Remove demonstrations with their files, unless there is an obstacle to one of them."""
        homes = [self._db.demonstration_folder(id_) for id_ in ids]
        try:
            with self._db.writing():
                for id_, home in zip(ids, homes, strict=True):
                    name = self._db.demonstration(id_)["name"]
                    if why := obstacle(id_):
                        raise InputError(f"'{name}' {why} {since}; it stays.")
                    if home.is_dir():
                        # A folder with this mark and without a row is cleared at the next start.
                        with files.file_errors(f"'{name}' cannot be discarded"):
                            files.mark_uncommitted(home / files.UNCOMMITTED)
                            sync_folder(home)
                    self._delete_rows(id_)
        except BaseException:
            for home in homes:
                with contextlib.suppress(OSError):  # beside a row it does no harm
                    (home / files.UNCOMMITTED).unlink(missing_ok=True)
            raise
        for home in homes:
            files.remove(home)

    def _what_was_done(self, id_: str, heads: Mapping[str, int]) -> str:
        """What people or runs did with a demonstration; empty if they did nothing."""
        for table, reason in (
            ("assignment", "was assigned to a coder"),
            ("verdict", "was reviewed"),
            ("note", "was given a note"),
        ):
            if self._db.one(f"SELECT 1 FROM {table} WHERE demonstration = ?", id_):
                return reason
        for table, columns in (("recogniser", "labels"), ("run", "labels || result")):
            if self._db.one(f"SELECT 1 FROM {table} WHERE instr({columns}, ?)", id_):
                return "was used for training or evaluation"
        return self._labelled_since(id_, heads)

    def _labelled_since(self, id_: str, heads: Mapping[str, int]) -> str:
        """That a coder has labelled since the tracks had these heads, in words; empty if not."""
        rows = self._db.all(
            "SELECT track.id, author.name FROM track JOIN author ON author.id = track.author "
            "WHERE demonstration = ? AND kind = 'coder'",
            id_,
        )
        changed = any(
            undo_state(self._db, row["id"]).head != heads.get(row["name"], 0) for row in rows
        )
        return "was labelled" if changed else ""

    def _delete_rows(self, id_: str) -> None:
        """Delete the rows of a demonstration, inside a transaction."""
        authors = self._db.all("SELECT author FROM track WHERE demonstration = ?", id_)
        self._db.execute(f"DELETE FROM segment WHERE track IN ({_TRACKS})", id_)
        # The store refuses to delete what people did; of this demonstration it may go.
        for table in _PERMANENT:
            condition = f"track IN ({_TRACKS})" if table == "edit" else "demonstration = ?"
            with self._db.without_trigger(f"{table}_is_not_deleted"):
                self._db.execute(f"DELETE FROM {table} WHERE {condition}", id_)
        self._db.execute("DELETE FROM track WHERE demonstration = ?", id_)
        self._db.execute("DELETE FROM video WHERE demonstration = ?", id_)
        for (author,) in authors:
            self._db.execute(
                "DELETE FROM author WHERE id = ? AND id NOT IN (SELECT author FROM track)", author
            )
        self._db.execute("DELETE FROM demonstration WHERE id = ?", id_)


@dataclass
class _Addition:
    """One demonstration that is being added, and what came of it so far."""

    database: Database
    tracks: TrackStore
    actions: ActionStore
    coding: CodingStore
    incoming: NewDemonstration
    staged: Path
    files: list[str] = field(default_factory=list)  #: of its videos
    name: str = ""
    damaged: bool = False
    created_home: bool = False
    changed: bool = False
    old: sqlite3.Row | None = None
    old_videos: Sequence[sqlite3.Row] = ()
    remarks: list[str] = field(default_factory=list)

    @property
    def id(self) -> str:
        return self.incoming.demonstration.id

    @property
    def home(self) -> Path:
        return self.database.demonstration_folder(self.id)

    @property
    def failure(self) -> str:
        """How the sentence begins when it cannot be added."""
        return f"'{self.incoming.demonstration.name}' was not added to '{self.database.folder}'"

    def row(self) -> sqlite3.Row | None:
        return self.database.one("SELECT * FROM demonstration WHERE id = ?", self.id)

    def stage(self) -> None:
        """Write what the project lacks into the staging folder."""
        d = self.incoming.demonstration
        row = self.row()
        self.damaged = row is not None and not _is_intact(self.home, row)
        self.staged.mkdir()
        if row is None or self.damaged:
            files.write_array(self.staged / "times.npy", d.times)
            files.write_array(self.staged / "signals.npy", d.signals)
        self.files = [files.copy_named(v.path, self.staged, "video-").name for v in d.videos]
        if self.incoming.truth is not None:
            files.write_json(self.staged / _TRUTH, self.incoming.truth)

    def write(self) -> None:
        """Move the files to their place and write the rows, inside a transaction."""
        self.old = self.row()
        self.old_videos = video_rows(self.database, self.id)
        self.changed = self.old is None or self.damaged
        if self.old is None and not self.home.exists():
            # In one step: a folder without its mark would never be known for a leftover.
            with files.staging(self.home.parent) as marked:
                files.mark_uncommitted(marked / files.UNCOMMITTED)
                marked.rename(self.home)
            self.created_home = True
        self.home.mkdir(exist_ok=True)
        if self.incoming.truth is not None:
            self.changed |= not files.same_content(self.staged / _TRUTH, self.home / _TRUTH)
        files.move_into(self.home, self.staged)
        self._write_row()
        for video, file in zip(self.incoming.demonstration.videos, self.files, strict=True):
            write_video(self.database, self.id, video.name, file, video.clock)
        self.changed |= video_rows(self.database, self.id) != self.old_videos
        for track in self.incoming.tracks:
            self._write_track(track)
        self.changed |= self.coding.add_notes(self.id, self.incoming.notes)
        if self.changed:
            self.actions.extend(self._task(), self.id, self.incoming.vocabulary)
        if self.old is not None and self.old["task"] != self._task():
            dropped = self.actions.drop_imported(self.old["task"], self.id)
            if dropped:
                self.remarks.append(
                    f"Task '{self.old['task']}' no longer lists {', '.join(dropped)}, which no "
                    f"other demonstration there has."
                )

    def take_back(self) -> None:
        """Remove the files of a demonstration that will not be in the project after all."""
        if self.created_home:
            shutil.rmtree(self.home, ignore_errors=True)

    def tidy(self) -> None:
        """Remove what is not needed any more, after the transaction."""
        with contextlib.suppress(OSError):  # it only takes up room, and is perhaps in use
            (self.home / files.UNCOMMITTED).unlink(missing_ok=True)
            remove_unused_videos(self.database, self.id, self.old_videos)

    def result(self) -> AddResult:
        status: Literal["new", "updated", "unchanged"]
        status = "new" if self.old is None else "updated" if self.changed else "unchanged"
        return AddResult(self.id, self.name, status, tuple(self.remarks))

    def _task(self) -> str:
        if self.old is not None and "task" in self.incoming.keep:
            return str(self.old["task"])
        return self.incoming.demonstration.task

    def _write_row(self) -> None:
        d, old, task = self.incoming.demonstration, self.old, self._task()
        self.name = self._free_name(task)
        values: dict[str, Value] = {"name": self.name, "task": task}
        if old is None or "grid_rate" not in self.incoming.keep:
            values["grid_rate"] = d.grid_rate
        if old is None:
            channels = json.dumps([[c.name, c.unit] for c in d.channels], ensure_ascii=False)
            values |= {
                "id": d.id,
                "channels": channels,
                "samples": len(d.times),
                "period": d.period,
                "duration": d.duration,
                "source": _file_name(self.incoming.source),
            }
            self.database.insert("demonstration", **values)
        elif any(old[column] != value for column, value in values.items()):
            self.changed = True
            self.database.execute(
                f"UPDATE demonstration SET {', '.join(f'{c} = ?' for c in values)} WHERE id = ?",
                *values.values(),
                d.id,
            )
            if (old["name"], old["task"]) != (self.name, task):
                self.remarks.append(
                    f"The same recording was already in the project as '{old['name']}' of "
                    f"{_task_phrase(old['task'])}; it is now '{self.name}' of {_task_phrase(task)}."
                )

    def _write_track(self, track: Track) -> None:
        """Import one author's labels, unless the project has something better."""
        id_, author = self.id, track.author
        if self.database.author_kind(author) == "model" and not is_model(author):
            self.remarks.append(
                f"The labels of '{author}' were left out: in this project that is a model, and "
                f"its predictions are never mixed with labels from a file."
            )
            return
        current = self.tracks.get(id_, author).segments
        if current == track.segments:
            return
        if current and not self.tracks.as_imported(id_, author):
            self.remarks.append(
                f"The labels of '{author}' on '{self.name}' were edited in the project; those in "
                f"the file were left out. To replace the edited ones, import those of the file as "
                f"a table of segments: start, end, action (forcelab labels --replace; in the "
                f"window File > Import labels)."
            )
            return
        source = _file_name(self.incoming.labels_from or self.incoming.source)
        origin = f" from {source}" if source else ""
        description = f"{len(track.segments)} segments imported{origin}"
        self.tracks.edit(id_, author, current, track.segments, description, kind="import")
        self.changed = True

    def _free_name(self, task: str) -> str:
        """The demonstration's name, numbered where another one of the task has it."""
        own_name, old = self.incoming.demonstration.name, self.old
        rows = self.database.all(
            "SELECT name FROM demonstration WHERE task = ? AND id <> ?", task, self.id
        )
        taken = {row["name"] for row in rows}
        if own_name not in taken:
            return own_name
        numbered = re.escape(own_name) + r" \(\d+\)"
        if old is not None and old["task"] == task and re.fullmatch(numbered, old["name"]):
            return str(old["name"])
        name = next(n for i in range(2, len(taken) + 3) if (n := f"{own_name} ({i})") not in taken)
        self.remarks.append(
            self._remark_on_other_reading(own_name, task, name)
            or f"Another recording of {_task_phrase(task)} is called '{own_name}'; this one is now "
            f"'{name}'."
        )
        return name

    def _remark_on_other_reading(self, own_name: str, task: str, name: str) -> str:
        """The remark on a file that was imported before, read otherwise; empty if it was not."""
        same_file = self.database.one(
            "SELECT * FROM demonstration WHERE name = ? AND task = ? AND source = ? "
            "AND samples = ?",
            own_name,
            task,
            _file_name(self.incoming.source),
            len(self.incoming.demonstration.times),
        )
        if same_file is None or not self._shares_a_signal(same_file):
            return ""
        labelled = any(track.segments for track in self.tracks.of(same_file["id"]))
        labelling = "with its labels" if labelled else "not labelled yet"
        return (
            f"The same file was in the project as '{own_name}', {labelling}, with other columns, "
            f"units or times; read anew it is '{name}'. Remove the one that is not wanted, by its "
            f"menu in the list of demonstrations or 'forcelab remove'."
        )

    def _shares_a_signal(self, row: sqlite3.Row) -> bool:
        """Whether a channel of the same name has the same values in a stored demonstration."""
        new = self.incoming.demonstration
        try:
            _, signals = _read_signals(self.database.demonstration_folder(row["id"]), row)
        except InputError:
            return False
        stored = [channel.name for channel in _channels_of(row)]
        return any(
            np.array_equal(new.signals[:, i], signals[:, stored.index(c.name)], equal_nan=True)
            for i, c in enumerate(new.channels)
            if c.name in stored
        )


def _task_phrase(task: str) -> str:
    return f"task '{task}'" if task else "no task"


def _file_name(name: str) -> str:
    """The name of a file, which may hold bytes that are no text, as one."""
    return name.encode("utf-8", "backslashreplace").decode()


def _is_intact(home: Path, row: sqlite3.Row) -> bool:
    """Whether a demonstration's arrays are there and of the right size."""
    try:
        _read_signals(home, row)
    except InputError:
        return False
    return True


def _read_signals(home: Path, row: sqlite3.Row) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times (n,) and signals (n, c) of a demonstration, mapped read-only."""
    n, c = row["samples"], len(_channels_of(row))
    times = files.read_array(home / "times.npy", (n,))
    return times, files.read_array(home / "signals.npy", (n, c))


def _info(
    row: sqlite3.Row, tracks: Sequence[sqlite3.Row], videos: Sequence[sqlite3.Row]
) -> DemonstrationInfo:
    return DemonstrationInfo(
        id=row["id"],
        name=row["name"],
        task=row["task"],
        samples=row["samples"],
        channels=_channels_of(row),
        rate=row["grid_rate"] or 1.0 / row["period"],
        duration=row["duration"],
        labelled={track["author"]: track["seconds"] for track in tracks},
        edited={track["author"]: track["edit"] for track in tracks},
        videos=tuple(video["name"] for video in videos),
        source=row["source"],
    )


def _channels_of(row: sqlite3.Row) -> tuple[Channel, ...]:
    with content_errors(f"The list of channels of '{row['name']}'"):
        return _channels(row["channels"])


@lru_cache(maxsize=256)
def _channels(text: str) -> tuple[Channel, ...]:
    """Channels as stored; a thousand demonstrations mostly have the same ones."""
    pairs = json.loads(text)
    if not all(isinstance(word, str) for pair in pairs for word in pair):
        raise TypeError("a name or a unit that is no text")
    return tuple(Channel(name, unit) for name, unit in pairs)
