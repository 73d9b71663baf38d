"""Demonstrations as stored: their list, the one that is meant, its arrays."""

from __future__ import annotations

import json
import re
import sqlite3
from collections import defaultdict
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.clock import ClockMap
from forcelab.demonstration import Channel, Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.project import files
from forcelab.project.database import Database
from forcelab.project.files import read_array, read_json
from forcelab.project.records import DemonstrationInfo
from forcelab.project.troubles import told_of_content

__all__ = [
    "DEMONSTRATIONS",
    "TRUTH",
    "channels_of",
    "home_of",
    "id_of",
    "info",
    "infos",
    "known_id",
    "known_ids",
    "load",
    "natural_order",
    "read_signals",
    "row_of",
    "truth",
]

#: Name of the folder that holds one folder per demonstration.
DEMONSTRATIONS = "demonstrations"

#: Name of the file in a demonstration's folder that holds what was told as its truth.
TRUTH = "truth.json"

_SHORTEST_PREFIX = 6

_LABELLED = """
    SELECT track.demonstration AS id, author.name AS author,
           coalesce((SELECT sum(end - start) FROM segment WHERE track = track.id), 0.0) AS seconds,
           coalesce((SELECT max(id) FROM edit WHERE track = track.id), 0) AS edit
    FROM track JOIN author ON author.id = track.author
"""


def infos(database: Database, task: str | None) -> tuple[DemonstrationInfo, ...]:
    """What there is, sorted by task and name."""
    tracks: dict[str, list[sqlite3.Row]] = defaultdict(list)
    for row in database.all(f"{_LABELLED} ORDER BY author.id"):
        tracks[row["id"]].append(row)
    rows = database.all("SELECT * FROM demonstration")
    rows.sort(key=lambda row: (natural_order(row["task"]), natural_order(row["name"])))
    return tuple(
        _info(row, tracks.get(row["id"], ())) for row in rows if task is None or row["task"] == task
    )


def info(database: Database, id_: str) -> DemonstrationInfo:
    """What there is of one demonstration."""
    rows = database.all(f"{_LABELLED} WHERE track.demonstration = ? ORDER BY author.id", id_)
    return _info(row_of(database, id_), rows)


@lru_cache(maxsize=1 << 14)
def natural_order(name: str) -> tuple[tuple[bool, int, str], ...]:
    """What names sort by, so that ``pen-2`` comes before ``pen-10``, and ``2`` before ``pen``."""
    parts = re.findall(r"(\d+)|(\D+)", name)
    # A number sorts by its length before its digits: as many as one likes are no number of Python.
    numbers = ((digits.lstrip("0"), word.casefold()) for digits, word in parts)
    return tuple((bool(word), len(digits), digits or word) for digits, word in numbers)


def known_ids(database: Database) -> set[str]:
    """The ids of all demonstrations."""
    return {row["id"] for row in database.all("SELECT id FROM demonstration")}


def known_id(database: Database, id_: str) -> str:
    """The id, if there is such a demonstration."""
    row_of(database, id_)
    return id_


def row_of(database: Database, id_: str) -> sqlite3.Row:
    """The demonstration as stored, if there is one with this id."""
    row = database.one("SELECT * FROM demonstration WHERE id = ?", id_)
    if row is None:
        if database.one("SELECT id FROM demonstration WHERE name = ?", id_) is not None:
            raise InputError(
                f"'{id_}' is the name of a demonstration in '{database.folder}', not its id; "
                f"id_of('{id_}') gives that."
            )
        raise InputError(f"There is no demonstration '{id_}' in '{database.folder}'.")
    return row


def id_of(database: Database, key: str) -> str:
    """The id of the demonstration that is meant, whatever became of its files."""
    return str(_find(database, key)["id"])


def load(database: Database, key: str) -> Demonstration:
    """A demonstration with its arrays mapped into memory."""
    row = _find(database, key)
    home = home_of(database, row["id"])
    try:
        times, signals = read_signals(home, row)
    except InputError as error:
        why = str(error)
        raise InputError(f"'{row['name']}' cannot be read: {why[0].lower()}{why[1:]}") from error
    video = None
    if row["video"] is not None:
        files.check_file(home / row["video"])
        clock = ClockMap(row["video_offset"], row["video_rate"])
        video = VideoReference(home / row["video"], clock)
    demonstration = Demonstration(
        name=row["name"],
        task=row["task"],
        times=times,
        signals=signals,
        channels=channels_of(row),
        video=video,
        grid_rate=row["grid_rate"],
    )
    # Both take most of a second for ten million samples. And whatever becomes of its files, it is
    # this demonstration that is meant.
    vars(demonstration).update(period=row["period"], id=row["id"])
    return demonstration


def home_of(database: Database, id_: str) -> Path:
    """The folder of a demonstration, which need not be there.

    Raises
    ------
    InputError
        If that would be outside the project, or is a link.
    """
    if not files.STORED_ID.fullmatch(id_):
        raise InputError(f"There is no demonstration '{id_}' in '{database.folder}'.")
    home = database.folder / DEMONSTRATIONS / id_
    files.check_folder(home.parent)
    files.check_folder(home)
    return home


def read_signals(home: Path, row: sqlite3.Row) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times (n,) and signals (n, c) of a demonstration, mapped read-only."""
    n, c = row["samples"], len(channels_of(row))
    return read_array(home / "times.npy", (n,)), read_array(home / "signals.npy", (n, c))


def truth(database: Database, id_: str) -> dict[str, Any] | None:
    """What was told as the truth of a demonstration; None where nothing was."""
    return read_json(home_of(database, known_id(database, id_)) / TRUTH)


def _info(row: sqlite3.Row, tracks: Sequence[sqlite3.Row]) -> DemonstrationInfo:
    """A stored demonstration's row in a list."""
    return DemonstrationInfo(
        id=row["id"],
        name=row["name"],
        task=row["task"],
        samples=row["samples"],
        channels=channels_of(row),
        rate=row["grid_rate"] or 1.0 / row["period"],
        duration=row["duration"],
        labelled={track["author"]: track["seconds"] for track in tracks},
        edited={track["author"]: track["edit"] for track in tracks},
        has_video=row["video"] is not None,
        source=row["source"],
    )


def _find(database: Database, key: str) -> sqlite3.Row:
    """The demonstration with this id, name or beginning of an id."""
    rows = database.all("SELECT * FROM demonstration WHERE id = ? OR name = ?", key, key)
    rows = [row for row in rows if row["id"] == key] or rows
    if not rows and len(key) >= _SHORTEST_PREFIX and re.fullmatch("[0-9a-f]+", key):
        rows = database.all("SELECT * FROM demonstration WHERE id GLOB ?", f"{key}*")
    if not rows:
        raise InputError(
            f"There is no demonstration '{key}' in '{database.folder}'; use a name, an id or its "
            f"first {_SHORTEST_PREFIX} or more digits."
        )
    if len(rows) > 1:
        which = ", ".join(f"{row['id'][:12]} (task '{row['task']}')" for row in rows)
        raise InputError(f"'{key}' may be any of {which}; use the id.")
    return rows[0]


def channels_of(row: sqlite3.Row) -> tuple[Channel, ...]:
    """The channels of a stored demonstration."""
    with told_of_content(f"The list of channels of '{row['name']}'"):
        return _channels(row["channels"])


@lru_cache(maxsize=256)
def _channels(text: str) -> tuple[Channel, ...]:
    """Channels as stored; a thousand demonstrations mostly have the same ones."""
    pairs = json.loads(text)
    if not all(isinstance(word, str) for pair in pairs for word in pair):
        raise TypeError("a name or a unit that is no text")
    return tuple(Channel(name, unit) for name, unit in pairs)
