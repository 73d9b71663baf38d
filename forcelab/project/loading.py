"""Demonstrations as stored: their list, their arrays, cameras, films and raw stamps."""

from __future__ import annotations

import json
import re
import sqlite3
import zipfile
from collections import defaultdict
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.clock import ClockMap
from forcelab.demonstration import Channel, Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.io import atomic_file
from forcelab.project import files
from forcelab.project.database import Database, told_of_content
from forcelab.project.files import read_array, read_json
from forcelab.project.records import DemonstrationInfo

#: How files are called whose content names them.
_STORED = re.compile(r"[a-z]+-[0-9a-f]{16}(\.[a-z0-9]{1,8})?")


def said_of_film(sentence: str, path: Path, demonstration: str) -> str:
    """A sentence about a film in the name that people know: that of its demonstration.

    Parameters
    ----------
    sentence : str
        That quotes the file's name, or its path, which stays beside the name.
    path : Path
        The file; of one that is not in a store the sentence stays as it is.
    demonstration : str
        The demonstration's name.
    """
    if not _STORED.fullmatch(path.name):
        return sentence
    for quoted, where in ((str(path), f" ('{path}')"), (path.name, "")):
        told = f"the video of '{demonstration}'{where}"
        parts = re.split(rf"(?:The video )?'{re.escape(quoted)}'", sentence)
        if len(parts) > 1:
            sentence = told.join(parts)
            return sentence[:1].upper() + sentence[1:]
    return sentence


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


#: Name of the file in a demonstration's folder.
STAMPS = "stamps.npz"
#: What the names of files begin with that lie beside, such as the video of a second camera.
BESIDE = "beside-"
#: Bytes of stamps, unpacked, that are always read, and those for each sample of a demonstration.
_LARGEST, _EACH = 1 << 30, 1 << 10


def attach_stamps(database: Database, id_: str, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Keep arrays beside a demonstration, in place of those there; the rows do not know them."""
    path = home_of(database, known_id(database, id_)) / STAMPS
    if any(array.dtype.hasobject for array in arrays.values()):
        raise InputError(f"Stamps of '{id_}' are no plain numbers and names; convert them first.")
    # As numpy.savez_compressed writes it, at the level that costs a third of the time and almost no
    # room: what arrives together has one stamp, and the low digits of the others do not compress.
    with (
        atomic_file(path) as stream,
        zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
    ):
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                np.lib.format.write_array(file, array, allow_pickle=False)


def attach_beside(database: Database, id_: str, file: Path) -> Path:
    """Copy a file into a demonstration's folder; gives the copy, named after what is in it."""
    home = home_of(database, known_id(database, id_))
    with (
        files.told(f"'{file}' was not copied to '{home}'"),
        files.staging(home.parent) as staging,
    ):
        name = files.copy_named(file, staging, BESIDE).name
        files.move_into(home, staging)
    return home / name


def files_beside(database: Database, id_: str) -> tuple[Path, ...]:
    """The files that were copied into a demonstration's folder, by their names."""
    home = home_of(database, known_id(database, id_))
    found = sorted(home.glob(f"{BESIDE}*"))
    return tuple(path for path in found if path.is_file() and not path.is_symlink())


def stamps(
    database: Database, id_: str, names: Container[str] | None = None
) -> dict[str, NDArray[Any]] | None:
    """The arrays beside a demonstration, or those of some names; None where there are none."""
    path = home_of(database, known_id(database, id_)) / STAMPS
    files.check_file(path)
    largest = max(_LARGEST, _EACH * row_of(database, id_)["samples"])
    try:
        # Given a path, NumPy leaves a file open that is no archive.
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as found:
            if sum(member.file_size for member in found.zip.infolist()) > largest:
                raise ValueError("too large")
            wanted = (name for name in found.files if names is None or name in names)
            return {name: found[name] for name in wanted}
    except FileNotFoundError:
        return None
    except (
        OSError,
        ValueError,
        EOFError,
        KeyError,
        AttributeError,
        TypeError,
        zipfile.BadZipFile,
    ) as error:
        raise InputError(
            f"The file '{path}' is damaged; delete it, the demonstration itself is whole."
        ) from error


_NAMES, _FILES, _CLOCKS = "video_names", "video_files", "video_clocks"
#: Stamps of every recording: when time 0 was, and of each camera when its frames arrived.
_START, _FRAMES = "start", "frames_"
#: Cameras that are looked for.
MOST = 8


@dataclass(frozen=True, slots=True)
class Camera:
    """A camera's name, and its video of one recording."""

    name: str
    video: VideoReference


def camera_stamps(filmed: Sequence[Camera]) -> dict[str, NDArray[Any]]:
    """What tells the cameras of a recording apart, to be kept with its raw stamps.

    Parameters
    ----------
    filmed : sequence of Camera
        The first one's video is the demonstration's; the others are in the folder by now.

    Returns
    -------
    dict of str to ndarray
        ``video_names``; ``video_files``, the name of each file (of the first one nothing); and
        ``video_clocks``, shape (n, 2): offset (s) and rate, from each video's clock to the force's.
    """
    return {
        _NAMES: np.array([one.name for one in filmed], dtype=np.str_),
        _FILES: np.array(["", *(one.video.path.name for one in filmed[1:])], dtype=np.str_),
        _CLOCKS: np.array([(one.video.clock.offset, one.video.clock.rate) for one in filmed]),
    }


def cameras(database: Database, id_: str, first: VideoReference | None) -> tuple[Camera, ...]:
    """The cameras whose videos there are; nothing is read where no file lies beside."""
    beside = files_beside(database, id_)
    if first is None or not beside:
        return ()
    found = stamps(database, id_, (_NAMES, _FILES, _CLOCKS)) or {}
    if _NAMES not in found:
        return _told_by_frames(database, id_, first, beside)
    home = home_of(database, known_id(database, id_))
    try:
        made = [
            Camera(
                str(name),
                VideoReference(
                    home / Path(str(file)).name, ClockMap(float(clock[0]), float(clock[1]))
                ),
            )
            for name, file, clock in zip(found[_NAMES], found[_FILES], found[_CLOCKS], strict=True)
        ]
    except (KeyError, ValueError, IndexError) as error:
        raise InputError(
            f"The stamps of '{id_}' do not say what its cameras filmed ({error})."
        ) from error
    there = [camera for camera in made[1:] if camera.video.path in beside]
    return (Camera(made[0].name, first), *there) if there else ()


def _told_by_frames(
    database: Database, id_: str, first: VideoReference, beside: Sequence[Path]
) -> tuple[Camera, ...]:
    """The cameras of a recording of which only the arrivals of frames are kept.

    That was so before their names were. Of two cameras the film beside is the second one's, and
    its time 0 is when its first frame arrived; of more of them nothing tells which is whose.
    """
    wanted = {_START, *(f"{_FRAMES}{number}" for number in range(MOST))}
    found = stamps(database, id_, wanted) or {}
    frames = [found.get(f"{_FRAMES}{number}", np.empty((0, 2))) for number in range(MOST)]
    arrived = [each[:, 0] for each in frames if each.ndim == 2 and len(each)]
    start = found.get(_START, np.empty(0))
    if len(beside) != 1 or len(arrived) != 2 or start.shape != ():
        return ()
    video = VideoReference(beside[0], ClockMap(float(arrived[1][0] - start)))
    return Camera("first camera", first), Camera("second camera", video)
