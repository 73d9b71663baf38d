"""Adding a demonstration: new, or the same recording once more."""

from __future__ import annotations

import contextlib
import json
import re
import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from forcelab.atomic import sync_folder
from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.labels import Track
from forcelab.project import files
from forcelab.project.database import Database, Value
from forcelab.project.edits import Tracks
from forcelab.project.loading import DEMONSTRATIONS, read_signals
from forcelab.project.records import Added
from forcelab.project.vocabularies import extend_vocabulary

__all__ = ["add"]


@dataclass
class _Adding:
    """One call of :func:`add`: what is added, and what came of it so far."""

    database: Database
    tracks: Tracks
    demonstration: Demonstration
    source: str
    remarks: list[str] = field(default_factory=list)
    changed: bool = False

    @property
    def id(self) -> str:
        return self.demonstration.id

    def row(self) -> sqlite3.Row | None:
        """The demonstration as stored."""
        return self.database.one("SELECT * FROM demonstration WHERE id = ?", self.id)

    def stage(self, folder: Path, home: Path) -> str | None:
        """Write what the project lacks into a staging folder; gives the video's new name."""
        d = self.demonstration
        row = self.row()
        if row is None or not _intact(home, row):
            files.write_array(folder / "times.npy", d.times)
            files.write_array(folder / "signals.npy", d.signals)
        return None if d.video is None else files.copy_named(d.video.path, folder, "video-").name

    def write_row(self, home: Path, staged: Path, video: str | None) -> str:
        """Move the files to their place and write the row; gives the name."""
        d = self.demonstration
        old = self.row()
        home.mkdir(exist_ok=True)
        if old is None:
            (home / files.UNCOMMITTED).touch()
        # Arrays are staged for a demonstration that is there only when they were damaged.
        self.changed = (staged / "times.npy").exists()
        files.move_into(home, staged)
        name = self._free_name(old)
        values: dict[str, Value] = {"name": name, "task": d.task, "grid_rate": d.grid_rate}
        if d.video is not None:
            clock = d.video.clock
            values |= {
                "video": video,
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
                "source": self.source,
            }
            marks = ", ".join("?" * len(values))
            self.database.execute(
                f"INSERT INTO demonstration ({', '.join(values)}) VALUES ({marks})",
                *values.values(),
            )
        elif any(old[column] != value for column, value in values.items()):
            self.changed = True
            self.database.execute(
                f"UPDATE demonstration SET {', '.join(f'{c} = ?' for c in values)} WHERE id = ?",
                *values.values(),
                d.id,
            )
            if (old["name"], old["task"]) != (name, d.task):
                self.remarks.append(
                    f"The same recording was already in the project as '{old['name']}' of task "
                    f"'{old['task']}'; it is now '{name}' of task '{d.task}'."
                )
        return name

    def write_track(self, track: Track) -> None:
        """Import one author's labels, unless the project has something better."""
        id_, author = self.id, track.author
        if self.tracks.kind(author) == "model":
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
                f"The labels of '{author}' were edited in the project; those in the file were "
                f"left out."
            )
            return
        origin = f" from {self.source}" if self.source else ""
        what = f"{len(track.segments)} segments imported{origin}"
        self.tracks.edit(id_, author, current, track.segments, what, kind="import")
        self.changed = True

    def _free_name(self, old: sqlite3.Row | None) -> str:
        """The demonstration's name, numbered where another one of the task has it."""
        d = self.demonstration
        rows = self.database.all(
            "SELECT name FROM demonstration WHERE task = ? AND id <> ?", d.task, d.id
        )
        taken = {row["name"] for row in rows}
        if d.name not in taken:
            return d.name
        numbered = re.escape(d.name) + r" \(\d+\)"
        if old is not None and old["task"] == d.task and re.fullmatch(numbered, old["name"]):
            return str(old["name"])
        name = next(n for i in range(2, len(taken) + 3) if (n := f"{d.name} ({i})") not in taken)
        self.remarks.append(
            f"Another recording of task '{d.task}' is called '{d.name}'; this one is now '{name}'."
        )
        return name


def add(
    database: Database,
    tracks: Tracks,
    demonstration: Demonstration,
    given: Sequence[Track],
    source: str,
) -> Added:
    """Add a demonstration and the tracks that came with it, all or nothing."""
    authors = [track.author for track in given]
    if len(set(authors)) < len(authors):
        raise InputError(f"'{demonstration.name}' has two tracks of one author; rename one.")
    adding = _Adding(database, tracks, demonstration, source)
    root = database.folder / DEMONSTRATIONS
    home = root / demonstration.id
    failed = f"'{demonstration.name}' was not added to '{database.folder}'"
    with files.told(failed), files.staging(root) as staged:
        video = adding.stage(staged, home)
        with database.writing():
            old = adding.row()
            name = adding.write_row(home, staged, video)
            for track in given:
                adding.write_track(track)
            if adding.changed:
                extend_vocabulary(database, demonstration.task, demonstration.id)
            sync_folder(root)
    with contextlib.suppress(OSError):  # only not needed any more, and perhaps in use
        if old is None:
            (home / files.UNCOMMITTED).unlink()
        elif video and old["video"] and old["video"] != video:
            (home / old["video"]).unlink()
    status: Literal["new", "updated", "unchanged"]
    status = "new" if old is None else "updated" if adding.changed else "unchanged"
    return Added(demonstration.id, name, status, tuple(adding.remarks))


def _intact(home: Path, row: sqlite3.Row) -> bool:
    """Whether a demonstration's arrays are there and of the right size."""
    try:
        read_signals(home, row)
    except InputError:
        return False
    return True
