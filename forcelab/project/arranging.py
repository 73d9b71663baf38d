"""What is put right about a stored demonstration: name, task, video and the video's clock."""

from __future__ import annotations

import sqlite3
from pathlib import Path

from forcelab.clock import ClockMap
from forcelab.errors import InputError
from forcelab.project import files
from forcelab.project.database import Database
from forcelab.project.loading import DEMONSTRATIONS, home_of, row_of
from forcelab.project.records import check_length
from forcelab.project.vocabularies import drop_imported_actions, extend_vocabulary, vocabularies
from forcelab.vocabulary import Vocabulary

__all__ = ["attach_video", "rename", "set_task", "set_video_clock"]


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
