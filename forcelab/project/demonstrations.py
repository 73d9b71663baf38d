"""Demonstrations of a project: added, put right and taken out.

Taking a demonstration out of a project, as a whole or, if killed meanwhile, not at all. What people
labelled is kept as long as its demonstration. A recording that has just become one holds nothing of
that and can be discarded. One that was imported by mistake can be removed with what was labelled on
it, by somebody who was told whose labels these are.
"""

from __future__ import annotations

import contextlib
import json
import re
import shutil
import sqlite3
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from forcelab.clock import ClockMap
from forcelab.errors import InputError
from forcelab.io import sync_folder
from forcelab.labels import Track, check_within, is_model
from forcelab.project import files
from forcelab.project.coding import add_notes
from forcelab.project.database import Database, Value
from forcelab.project.loading import (
    DEMONSTRATIONS,
    TRUTH,
    channels_of,
    home_of,
    read_signals,
    row_of,
)
from forcelab.project.records import Added, Incoming, check_length
from forcelab.project.runs import give_back, lifted
from forcelab.project.tracks import (
    Tracks,
    drop_imported_actions,
    extend_vocabulary,
    kind_of,
    line_of,
    vocabularies,
)
from forcelab.vocabulary import Vocabulary


@dataclass
class _Adding:
    """One demonstration of a call of :func:`add_all`, and what came of it so far."""

    database: Database
    tracks: Tracks
    given: Incoming
    staged: Path
    video: str | None = None
    name: str = ""
    damaged: bool = False
    made_home: bool = False
    changed: bool = False
    old: sqlite3.Row | None = None
    remarks: list[str] = field(default_factory=list)

    @property
    def id(self) -> str:
        return self.given.demonstration.id

    @property
    def home(self) -> Path:
        """The demonstration's folder in the project."""
        return home_of(self.database, self.id)

    @property
    def failed(self) -> str:
        """How the sentence begins when it cannot be added."""
        return f"'{self.given.demonstration.name}' was not added to '{self.database.folder}'"

    def row(self) -> sqlite3.Row | None:
        """The demonstration as stored."""
        return self.database.one("SELECT * FROM demonstration WHERE id = ?", self.id)

    def stage(self) -> None:
        """Write what the project lacks into the staging folder."""
        d = self.given.demonstration
        row = self.row()
        self.damaged = row is not None and not _intact(self.home, row)
        self.staged.mkdir()
        if row is None or self.damaged:
            files.write_array(self.staged / "times.npy", d.times)
            files.write_array(self.staged / "signals.npy", d.signals)
        if d.video is not None:
            self.video = files.copy_named(d.video.path, self.staged, "video-").name
        if self.given.truth is not None:
            files.write_json(self.staged / TRUTH, self.given.truth)

    def write(self) -> None:
        """Move the files to their place and write the rows, inside a transaction."""
        self.old = self.row()
        self.changed = self.old is None or self.damaged
        if self.old is None and not self.home.exists():
            # In one step: a folder without its mark would never be known for a leftover.
            with files.staging(self.home.parent) as marked:
                files.mark_uncommitted(marked / files.UNCOMMITTED)
                marked.rename(self.home)
            self.made_home = True
        self.home.mkdir(exist_ok=True)
        if self.given.truth is not None:
            self.changed |= not files.same(self.staged / TRUTH, self.home / TRUTH)
        files.move_into(self.home, self.staged)
        self._write_row()
        for track in self.given.tracks:
            self._write_track(track)
        self.changed |= add_notes(self.database, self.id, self.given.notes)
        if self.changed:
            extend_vocabulary(self.database, self._task(), self.id, self.given.vocabulary)
        if self.old is not None and self.old["task"] != self._task():
            gone = drop_imported_actions(self.database, self.old["task"], self.id)
            if gone:
                self.remarks.append(
                    f"Task '{self.old['task']}' no longer lists {', '.join(gone)}, which no other "
                    f"demonstration there has."
                )

    def take_back(self) -> None:
        """Remove the files of a demonstration that will not be in the project after all."""
        if self.made_home:
            shutil.rmtree(self.home, ignore_errors=True)

    def tidy(self) -> None:
        """Remove what is not needed any more, after the transaction."""
        row = self.row()
        with contextlib.suppress(OSError):  # it only takes up room, and is perhaps in use
            (self.home / files.UNCOMMITTED).unlink(missing_ok=True)
            if self.old and row and self.old["video"] not in (None, row["video"]):
                files.remove_video(self.home, self.old["video"])

    def added(self) -> Added:
        """What became of it."""
        status: Literal["new", "updated", "unchanged"]
        status = "new" if self.old is None else "updated" if self.changed else "unchanged"
        return Added(self.id, self.name, status, tuple(self.remarks))

    def _task(self) -> str:
        """The task that the demonstration gets or keeps."""
        if self.old is not None and "task" in self.given.keep:
            return str(self.old["task"])
        return self.given.demonstration.task

    def _write_row(self) -> None:
        """Write the demonstration's row."""
        d, old, task = self.given.demonstration, self.old, self._task()
        self.name = self._free_name(task)
        values: dict[str, Value] = {"name": self.name, "task": task}
        if old is None or "grid_rate" not in self.given.keep:
            values["grid_rate"] = d.grid_rate
        if d.video is not None:
            clock = d.video.clock
            values |= {
                "video": self.video,
                "video_offset": float(clock.offset),
                "video_rate": float(clock.rate),
            }
        if old is None:
            channels = json.dumps([[c.name, c.unit] for c in d.channels], ensure_ascii=False)
            values |= {
                "id": d.id,
                "channels": channels,
                "samples": len(d.times),
                "period": d.period,
                "duration": d.duration,
                "source": self._source(),
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
                    f"The same recording was already in the project as '{old['name']}' of task "
                    f"'{old['task']}'; it is now '{self.name}' of task '{task}'."
                )

    def _write_track(self, track: Track) -> None:
        """Import one author's labels, unless the project has something better."""
        id_, author = self.id, track.author
        if kind_of(self.database, author) == "model" and not is_model(author):
            self.remarks.append(
                f"The labels of '{author}' were left out: in this project that is a model, and "
                f"its predictions are never mixed with labels from a file."
            )
            return
        current = self.tracks.track(id_, author).segments
        if current == track.segments:
            return
        if current and not self.tracks.as_imported(id_, author):
            self.remarks.append(
                f"The labels of '{author}' on '{self.name}' were edited in the project; those in "
                f"the file were left out."
            )
            return
        source = self.given.labels_from or self.given.source
        source = source.encode("utf-8", "backslashreplace").decode()
        origin = f" from {source}" if source else ""
        what = f"{len(track.segments)} segments imported{origin}"
        self.tracks.edit(id_, author, current, track.segments, what, kind="import")
        self.changed = True

    def _free_name(self, task: str) -> str:
        """The demonstration's name, numbered where another one of the task has it."""
        wanted, old = self.given.demonstration.name, self.old
        rows = self.database.all(
            "SELECT name FROM demonstration WHERE task = ? AND id <> ?", task, self.id
        )
        taken = {row["name"] for row in rows}
        if wanted not in taken:
            return wanted
        numbered = re.escape(wanted) + r" \(\d+\)"
        if old is not None and old["task"] == task and re.fullmatch(numbered, old["name"]):
            return str(old["name"])
        name = next(n for i in range(2, len(taken) + 3) if (n := f"{wanted} ({i})") not in taken)
        if (again := self._read_otherwise(wanted, task)) is not None:
            self.remarks.append(again.format(name))
        else:
            self.remarks.append(
                f"Another recording of task '{task}' is called '{wanted}'; this one is now "
                f"'{name}'."
            )
        return name

    def _read_otherwise(self, wanted: str, task: str) -> str | None:
        """What is said of a file that is here already with other columns; None where it is not."""
        here = self.database.one(
            "SELECT * FROM demonstration WHERE name = ? AND task = ? AND source = ? "
            "AND samples = ?",
            wanted,
            task,
            self._source(),
            len(self.given.demonstration.times),
        )
        if here is None or not self._shares_a_signal(here):
            return None
        labelled = any(track.segments for track in self.tracks.tracks(here["id"]))
        its = "with its labels" if labelled else "not labelled yet"
        name = wanted.replace("{", "{{").replace("}", "}}")
        return (
            f"The same file was in the project as '{name}', {its}, with other columns or times; "
            f"read anew it is '{{}}'. Remove the one that is not wanted, by its menu in the list "
            f"of demonstrations or 'forcelab remove'."
        )

    def _shares_a_signal(self, row: sqlite3.Row) -> bool:
        """Whether a channel of the same name has the same values in a stored demonstration."""
        given = self.given.demonstration
        try:
            _, signals = read_signals(home_of(self.database, row["id"]), row)
        except InputError:
            return False
        there = [channel.name for channel in channels_of(row)]
        return any(
            np.array_equal(given.signals[:, i], signals[:, there.index(c.name)], equal_nan=True)
            for i, c in enumerate(given.channels)
            if c.name in there
        )

    def _source(self) -> str:
        """What it was read from. File names may hold bytes that are no text."""
        return self.given.source.encode("utf-8", "backslashreplace").decode()


def add_all(database: Database, tracks: Tracks, given: Sequence[Incoming]) -> tuple[Added, ...]:
    """Add demonstrations and the tracks that came with them, all or nothing."""
    for incoming in given:
        check_length(incoming.demonstration.name, "name")
        check_length(incoming.demonstration.task, "task")
        authors = [track.author for track in incoming.tracks]
        if len(set(authors)) < len(authors):
            name = incoming.demonstration.name
            raise InputError(f"'{name}' has two tracks of one author; rename one.")
        start, end = incoming.demonstration.start, incoming.demonstration.end
        for track in incoming.tracks:
            cure = f", in the labels of '{track.author}' on '{incoming.demonstration.name}'; shift "
            check_within(track.segments, start, end, f"{cure}or erase it first.")
    if not given:
        return ()
    database.refuse_read_only()
    root = database.folder / DEMONSTRATIONS
    others = ", and neither were the others" if len(given) > 1 else ""
    with files.told(f"Nothing was added to '{database.folder}'"), files.staging(root) as staging:
        adding = [
            _Adding(database, tracks, incoming, staging / str(number))
            for number, incoming in enumerate(given)
        ]
        # The slow part, while others may still write.
        for one in adding:
            with files.told(one.failed + others):
                one.stage()
        with database.writing():
            try:
                for one in adding:
                    with files.told(one.failed + others):
                        one.write()
                sync_folder(root)
            except BaseException:
                for one in adding:
                    one.take_back()
                raise
    for one in adding:
        one.tidy()
    return tuple(one.added() for one in adding)


def _intact(home: Path, row: sqlite3.Row) -> bool:
    """Whether a demonstration's arrays are there and of the right size."""
    try:
        read_signals(home, row)
    except InputError:
        return False
    return True


def rename(database: Database, id_: str, name: str) -> None:
    """Give a demonstration another name, which no other one of its task has."""
    name = name.strip()
    if not name:
        raise InputError("A demonstration needs a name.")
    check_length(name, "name")
    with database.writing():
        row = row_of(database, id_)
        if database.one(
            "SELECT 1 FROM demonstration WHERE task = ? AND name = ? AND id <> ?",
            row["task"],
            name,
            id_,
        ):
            raise InputError(
                f"'{row['name']}' was not renamed, as another demonstration of task "
                f"'{row['task']}' is called '{name}'; choose another name."
            )
        database.execute("UPDATE demonstration SET name = ? WHERE id = ?", name, id_)


def set_task(database: Database, id_: str, task: str) -> None:
    """Put a demonstration into another task, whose vocabulary gets the actions it lacks.

    The task that it leaves gives up the actions that only this demonstration's import brought.
    """
    task = " ".join(task.split())
    check_length(task, "task")
    with database.writing():
        row = row_of(database, id_)
        if row["task"] == task:
            return
        if database.one(
            "SELECT 1 FROM demonstration WHERE task = ? AND name = ?", task, row["name"]
        ):
            where = f"Task '{task}' has" if task else "Without a task there is"
            raise InputError(
                f"{where} another demonstration called '{row['name']}'; rename one of them first."
            )
        database.execute("UPDATE demonstration SET task = ? WHERE id = ?", task, id_)
        painted = {
            one["action"]
            for one in database.all(
                "SELECT DISTINCT action FROM segment JOIN track ON track.id = segment.track "
                "WHERE demonstration = ?",
                id_,
            )
        }
        old = vocabularies(database).get(row["task"], Vocabulary())
        looks = Vocabulary(tuple(action for action in old if action.name in painted))
        extend_vocabulary(database, task, id_, looks)
        drop_imported_actions(database, row["task"], id_)


def set_video_clock(database: Database, id_: str, clock: ClockMap) -> None:
    """Say how the video's clock maps onto the force clock."""
    with database.writing():
        row = row_of(database, id_)
        if row["video"] is None:
            raise InputError(
                f"'{row['name']}' has no video whose clock could be set; attach one first."
            )
        _write(database, id_, row["video"], clock)


def attach_video(database: Database, id_: str, path: Path, clock: ClockMap) -> None:
    """Copy a video into the project, in place of the one that the demonstration has."""
    row = row_of(database, id_)
    root = database.folder / DEMONSTRATIONS
    home = home_of(database, id_)
    database.refuse_read_only()
    with (
        files.told(f"The video was not attached to '{row['name']}'"),
        files.staging(root) as staged,
    ):
        video = files.copy_named(path, staged, "video-").name
        with database.writing():
            old: sqlite3.Row = row_of(database, id_)
            home.mkdir(exist_ok=True)
            files.move_into(home, staged)  # under the name of its content: over nothing else
            _write(database, id_, video, clock)
    if old["video"] not in (None, video):
        files.remove_video(home, old["video"])


def _write(database: Database, id_: str, video: str, clock: ClockMap) -> None:
    """Write the columns of the video."""
    database.execute(
        "UPDATE demonstration SET video = ?, video_offset = ?, video_rate = ? WHERE id = ?",
        video,
        float(clock.offset),
        float(clock.rate),
        id_,
    )


#: Tables whose rows a trigger keeps for ever.
_KEPT = ("edit", "assignment", "verdict", "note")
_TRACKS = "SELECT id FROM track WHERE demonstration = ?"


def discard(database: Database, id_: str, heads: Mapping[str, int]) -> None:
    """Remove a new recording with its files; see :meth:`~forcelab.project.Project.discard`."""
    _take_out(
        database, [id_], lambda id_: _worked_with(database, id_, heads), "since it was recorded"
    )


def remove(database: Database, heads: Mapping[str, Mapping[str, int]]) -> None:
    """Remove demonstrations and their labels; see :meth:`~forcelab.project.Project.remove_all`."""
    _take_out(database, heads, lambda id_: _labelled(database, id_, heads[id_]), "meanwhile")
    give_back(database)


def _take_out(
    database: Database, ids: Collection[str], reason: Callable[[str], str], since: str
) -> None:
    """Remove demonstrations with their files, unless there is a reason to keep one of them."""
    homes = [home_of(database, id_) for id_ in ids]
    try:
        with database.writing():
            for id_, home in zip(ids, homes, strict=True):
                name = row_of(database, id_)["name"]
                if why := reason(id_):
                    raise InputError(f"'{name}' {why} {since}; it stays.")
                if home.is_dir():
                    # A folder with this mark and without a row is what the next start clears away.
                    with files.told(f"'{name}' cannot be discarded"):
                        files.mark_uncommitted(home / files.UNCOMMITTED)
                        sync_folder(home)
                _forget(database, id_)
    except BaseException:
        for home in homes:
            with contextlib.suppress(OSError):  # beside a row it does no harm
                (home / files.UNCOMMITTED).unlink(missing_ok=True)
        raise
    for home in homes:
        files.remove(home)


def _worked_with(database: Database, id_: str, heads: Mapping[str, int]) -> str:
    """What people or runs did with a demonstration; empty if they did nothing."""
    if database.one("SELECT 1 FROM assignment WHERE demonstration = ?", id_):
        return "was assigned to a coder"
    if database.one("SELECT 1 FROM verdict WHERE demonstration = ?", id_):
        return "was reviewed"
    if database.one("SELECT 1 FROM note WHERE demonstration = ?", id_):
        return "was given a note"
    for table, columns in (("recogniser", "labels"), ("run", "labels || result")):
        if database.one(f"SELECT 1 FROM {table} WHERE instr({columns}, ?)", id_):
            return "was used for training or evaluation"
    return _labelled(database, id_, heads)


def _labelled(database: Database, id_: str, heads: Mapping[str, int]) -> str:
    """Whether a coder has labelled since the tracks had these heads; empty if nobody has."""
    rows = database.all(
        "SELECT track.id, author.name FROM track JOIN author ON author.id = track.author "
        "WHERE demonstration = ? AND kind = 'coder'",
        id_,
    )
    changed = any(line_of(database, row["id"]).head != heads.get(row["name"], 0) for row in rows)
    return "was labelled" if changed else ""


def _forget(database: Database, id_: str) -> None:
    """Delete the rows of a demonstration, inside a transaction."""
    authors = [
        row["author"]
        for row in database.all("SELECT author FROM track WHERE demonstration = ?", id_)
    ]
    database.execute(f"DELETE FROM segment WHERE track IN ({_TRACKS})", id_)
    # The store refuses to delete what people did, whoever asks; of this demonstration it may go.
    for table in _KEPT:
        which = f"track IN ({_TRACKS})" if table == "edit" else "demonstration = ?"
        with lifted(database, f"{table}_is_not_deleted"):
            database.execute(f"DELETE FROM {table} WHERE {which}", id_)
    database.execute("DELETE FROM track WHERE demonstration = ?", id_)
    for author in authors:
        database.execute(
            "DELETE FROM author WHERE id = ? AND id NOT IN (SELECT author FROM track)", author
        )
    database.execute("DELETE FROM demonstration WHERE id = ?", id_)
