"""Videos and raw time stamps beside a demonstration."""

from __future__ import annotations

import re
import sqlite3
import zipfile
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.clock import ClockMap
from forcelab.demonstration import Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.io import atomic_file
from forcelab.project import files
from forcelab.project.database import Database
from forcelab.project.files import DEMONSTRATIONS, STAMPS
from forcelab.project.records import check_length
from forcelab.text import tidy_name, unknown_word


def video_rows(database: Database, demonstration: str) -> list[sqlite3.Row]:
    """The rows of a demonstration's videos, in order."""
    return database.all(
        "SELECT * FROM video WHERE demonstration = ? ORDER BY position", demonstration
    )


def write_video(
    database: Database, demonstration: str, name: str, file: str, clock: ClockMap
) -> None:
    """Write a video's row in place of the one of its name, or after the others."""
    database.execute(
        "INSERT INTO video SELECT ?1, coalesce(max(position) + 1, 0), ?2, ?3, ?4, ?5 FROM video "
        "WHERE demonstration = ?1 ON CONFLICT (demonstration, name) "
        "DO UPDATE SET file = excluded.file, offset = excluded.offset, rate = excluded.rate",
        demonstration,
        name,
        file,
        float(clock.offset),
        float(clock.rate),
    )


def remove_unused_videos(
    database: Database, demonstration: str, before: Sequence[sqlite3.Row]
) -> None:
    """Delete the files of a demonstration's videos of before that no row names any more."""
    used = {row["file"] for row in video_rows(database, demonstration)}
    for row in before:
        if row["file"] not in used:
            files.remove_video(database.demonstration_folder(demonstration), row["file"])


class MediaStore:
    """Videos and stamps of a project's demonstrations; ``project.media``.

    Every method raises InputError if there is no demonstration of the id.
    """

    def __init__(self, database: Database) -> None:
        self._db = database

    def attach_video(
        self,
        demonstration: str,
        path: str | PathLike[str],
        clock: ClockMap | None = None,
        name: str | None = None,
    ) -> None:
        """Copy a video into the project, as a further one or in place of the one of its name.

        Parameters
        ----------
        demonstration : str
            Its id.
        path : path-like
            The video; what is in it is not looked at.
        clock : ClockMap, optional
            From the video's own timestamps to force time; by default both are the same.
        name : str, optional
            What it is called among the demonstration's videos, such as ``"left"``; by default it
            takes the place of the first one.

        Raises
        ------
        InputError
            If the video cannot be read; nothing was changed.
        """
        row = self._db.demonstration(demonstration)
        root = self._db.folder / DEMONSTRATIONS
        home = self._db.demonstration_folder(demonstration)
        name = None if name is None else tidy_name(name)
        if name == "":
            raise InputError("A video needs a name; give one.")
        check_length(name or "", "name of a video")
        self._db.refuse_read_only()
        with (
            files.file_errors(f"The video was not attached to '{row['name']}'"),
            files.staging(root) as staged,
        ):
            file = files.copy_named(Path(path), staged, "video-").name
            with self._db.writing():
                self._db.demonstration(demonstration)  # somebody may have removed it
                before = video_rows(self._db, demonstration)
                home.mkdir(exist_ok=True)
                files.move_into(home, staged)  # under the name of its content: over nothing else
                name = name or (before[0]["name"] if before else "video 1")
                write_video(self._db, demonstration, name, file, clock or ClockMap())
        remove_unused_videos(self._db, demonstration, before)

    def remove_video(self, demonstration: str, name: str) -> None:
        """Remove a demonstration's video for good; InputError if it has none of that name."""
        with self._db.writing():
            self._video_row(demonstration, name)
            before = video_rows(self._db, demonstration)
            self._db.execute(
                "DELETE FROM video WHERE demonstration = ? AND name = ?", demonstration, name
            )
        remove_unused_videos(self._db, demonstration, before)

    def set_video_clock(self, demonstration: str, clock: ClockMap, name: str | None = None) -> None:
        """Set how a video's own timestamps map onto force time; by default the first video's.

        InputError if the demonstration has no such video.
        """
        with self._db.writing():
            video = self._video_row(demonstration, name)
            write_video(self._db, demonstration, video["name"], video["file"], clock)

    def attach_stamps(self, demonstration: str, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Store a recording's raw stamps beside it, in place of those there: numbers and names."""
        path = self._folder(demonstration) / STAMPS
        self._db.refuse_read_only()
        # As numpy.savez_compressed writes it, at the level that costs a third of the time and
        # almost no room: what arrives together has one stamp, and the low digits of the others do
        # not compress.
        with (
            atomic_file(path) as stream,
            zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        ):
            for name, array in arrays.items():
                with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                    np.lib.format.write_array(file, array, allow_pickle=False)

    def stamps(self, demonstration: str) -> dict[str, NDArray[Any]] | None:
        """The raw stamps beside a demonstration; None without any.

        Only recorded demonstrations have them; archives leave them out.
        """
        samples = self._db.demonstration(demonstration)["samples"]
        return files.read_stamps(self._folder(demonstration), samples)

    def _video_row(self, demonstration: str, name: str | None) -> sqlite3.Row:
        """The row of a video, by default of the first one."""
        title = self._db.demonstration(demonstration)["name"]
        rows = {row["name"]: row for row in video_rows(self._db, demonstration)}
        if not rows:
            raise InputError(f"'{title}' has no video; attach one first.")
        if name is None:
            return next(iter(rows.values()))
        if name not in rows:
            raise InputError(unknown_word("video", name, tuple(rows)))
        return rows[name]

    def _folder(self, demonstration: str) -> Path:
        self._db.demonstration(demonstration)
        return self._db.demonstration_folder(demonstration)


def video_title(video: VideoReference, demonstration: Demonstration) -> str:
    """What coders know a video by: that of a demonstration, its name only among several."""
    name = f" '{video.name}'" if len(demonstration.videos) > 1 else ""
    return f"the video{name} of '{demonstration.name}'"


def name_video(sentence: str, video: VideoReference, demonstration: Demonstration) -> str:
    """Replace a stored video's name or path in a sentence by what coders know it by.

    The path stays beside the name; a file that is not in a store keeps its own.
    """
    path = video.path
    if not files.STORED_VIDEO.fullmatch(path.name):
        return sentence
    for quoted, where in ((str(path), f" ('{path}')"), (path.name, "")):
        parts = re.split(rf"(?:The video )?'{re.escape(quoted)}'", sentence)
        if len(parts) > 1:
            sentence = f"{video_title(video, demonstration)}{where}".join(parts)
            return sentence[:1].upper() + sentence[1:]
    return sentence
