"""Recordings into a project: how they begin, their names and files, and what a crash left."""

from __future__ import annotations

import contextlib
import re
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime, timezone
from pathlib import Path

import numpy as np

from forcelab import __version__
from forcelab.capture.assemble import AssembledRecording, gather
from forcelab.capture.device import Device
from forcelab.capture.journal import SUFFIX, Contents, Kind, read
from forcelab.capture.journal_writer import JournalWriter
from forcelab.demonstration import VideoReference
from forcelab.errors import InputError
from forcelab.project import Added, Project
from forcelab.project.media import Camera, camera_stamps
from forcelab.project.records import Incoming

#: Name of the folder in a project that holds recordings while they last.
CAPTURES = "captures"


def unfinished(path: Path) -> tuple[Path, ...]:
    """Journals of a project that nobody is writing.

    Parameters
    ----------
    path : Path
        The project's folder.
    """
    if not (path / CAPTURES).is_dir():  # every window that opens a project asks
        return ()
    from forcelab.capture.journal_writer import being_written

    found = sorted((path / CAPTURES).glob(f"*{SUFFIX}"))
    return tuple(journal for journal in found if not being_written(journal))


@dataclass(frozen=True, slots=True)
class SavedRecording:
    """A recording that has become a demonstration.

    Parameters
    ----------
    added : Added
        What became of it.
    samples : int
    seconds : float
    remarks : tuple of str
        What is to be said of it, a sentence each.
    heads : dict of str to int
        Of each author, the last edit of the track that was marked live.
    precision : float
        To how many seconds the stamps are known, those of the worst device.
    """

    added: Added
    samples: int
    seconds: float
    remarks: tuple[str, ...]
    heads: dict[str, int] = field(default_factory=dict)
    precision: float = 0.0


class PartialSaveError(InputError):
    """A recording that could not be kept whole, and what is in the project could not be taken back.

    Attributes
    ----------
    part : Kept
        What is in the project.
    """

    def __init__(self, trouble: str, part: SavedRecording) -> None:
        super().__init__(trouble)
        self.part = part


@dataclass(frozen=True, slots=True)
class Recovered:
    """What became of an unfinished recording.

    Parameters
    ----------
    path : Path
        Its journal, which is still there where something is in it that was not kept.
    kept : Kept or None
    trouble : str
        Why nothing was kept; empty where it was.
    removed : bool
        Whether the journal is gone because nothing was in it.
    """

    path: Path
    kept: SavedRecording | None
    trouble: str = ""
    removed: bool = False


def next_name(project: Project, task: str) -> str:
    """The next name of a task's demonstrations: the task and the number after the largest one."""
    names = [one.name for one in project.demonstrations.infos(task)]
    names += [path.stem for path in (project.path / CAPTURES).glob(f"*{SUFFIX}")]
    numbered = re.compile(re.escape(task) + r" (\d+)(?: \(\d+\))?")
    numbers = [int(match[1]) for name in names if (match := numbered.fullmatch(name))]
    return f"{task} {max(numbers, default=0) + 1:02d}"


def keep(path: Path, contents: Contents) -> SavedRecording:
    """Make a demonstration of what a journal held and add it to its project.

    To do it twice does no harm: the same recording is the same demonstration.

    Parameters
    ----------
    path : Path
        The project's folder.
    contents : Contents
        What the journal held; videos lie where it says.

    Raises
    ------
    InputError
        If it holds no demonstration or the project cannot be written; nothing was added.
    PartialSaveError
        If the project could not be written twice: something was added and not taken back.
    """
    gathered = gather(contents, path / CAPTURES)
    demonstration = gathered.demonstration
    devices = ", ".join(str(one) for one in gathered.stamps["devices"])
    incoming = Incoming(
        demonstration,
        () if gathered.track is None else (gathered.track,),
        source=f"captured {contents.header.get('started', '')} from {devices}",
    )
    with Project.open(path) as project:
        (added,) = project.demonstrations.add_all([incoming])
        heads = {
            track.author: project.tracks.head(added.id, track.author) for track in incoming.tracks
        }
        try:
            beside = [_beside(project, added.id, camera) for camera in gathered.filmed[1:]]
            cameras = camera_stamps((*gathered.filmed[:1], *beside)) if beside else {}
            project.media.attach_stamps(added.id, gathered.stamps | cameras)
            _compare(project, added, gathered)
        except BaseException as error:  # whatever that is: the next try begins anew
            if added.status == "new":
                part = SavedRecording(
                    added, len(demonstration.times), demonstration.duration, (), heads
                )
                _take_back(project, part, error)
            raise
    more = (f"The video of {c.name} lies beside the first one's: '{c.video.path}'." for c in beside)
    remarks = (*gathered.remarks, *added.remarks, *more)
    samples, duration = len(demonstration.times), demonstration.duration
    return SavedRecording(added, samples, duration, remarks, heads, gathered.precision)


def _compare(project: Project, added: Added, gathered: AssembledRecording) -> None:
    """Hold what the project stored against what was recorded, before the journal may go."""
    stored = project.demonstrations.load(added.id)
    columns = slice(gathered.column, gathered.column + gathered.recorded.shape[1])
    if not (
        np.array_equal(stored.times, gathered.demonstration.times)
        and np.array_equal(stored.signals, gathered.demonstration.signals, equal_nan=True)
        and np.array_equal(stored.signals[:, columns], gathered.recorded, equal_nan=True)
    ):
        raise InputError(
            f"'{added.name}' in the project is not what was recorded; is the disk damaged? "
            f"Nothing of the recording is removed."
        )


def _take_back(project: Project, part: SavedRecording, error: BaseException) -> None:
    """Remove what was added before something went wrong; raises where that goes wrong too."""
    try:
        project.demonstrations.discard(part.added.id, part.heads)
    except InputError as second:
        # Whatever it was: that something is half done has to be told before anything else.
        first = error if isinstance(error, InputError) else f"It ended early ({error!r})."
        raise PartialSaveError(
            f"{first} '{part.added.name}' is in the project without its stamps, as it could "
            f"not be taken back either: {second}",
            part,
        ) from error


def _beside(project: Project, id_: str, camera: Camera) -> Camera:
    """Keep a further camera's video beside a recording."""
    copy = project.media.attach_file(id_, camera.video.path)
    return Camera(camera.name, VideoReference(copy, camera.video.clock))


def discard(path: Path, kept: SavedRecording) -> None:
    """Remove a recording from its project for good, as if it had never been kept.

    One that somebody removed meanwhile is gone, which is all that is wanted.

    Parameters
    ----------
    path : Path
        The project's folder.
    kept : Kept
        What :func:`keep` gave.

    Raises
    ------
    InputError
        If it was there before it was recorded, as when it was recovered twice, or was labelled,
        assigned, reviewed or used for training since: it stays then.
    """
    if kept.added.status != "new":
        raise InputError(f"'{kept.added.name}' was in the project before; it stays.")
    with Project.open(path) as project:
        if any(one.id == kept.added.id for one in project.demonstrations.infos()):
            project.demonstrations.discard(kept.added.id, kept.heads)


def delete_videos(folder: Path, contents: Contents) -> None:
    """Remove the videos of a journal: they are in the project, or not wanted."""
    for camera in contents.header.get("cameras", ()):
        with contextlib.suppress(OSError):  # it only takes up room
            (folder / Path(str(camera["file"])).name).unlink(missing_ok=True)


def recover(path: Path) -> tuple[Recovered, ...]:
    """Make demonstrations of all unfinished recordings of a project; remove those without samples.

    Parameters
    ----------
    path : Path
        The project's folder.
    """
    return tuple(_recovered(path, journal) for journal in unfinished(path))


def _recovered(path: Path, journal: Path) -> Recovered:
    try:
        contents = read(journal)
        if _empty(contents):
            _remove(journal, contents)
            told = f"'{journal.stem}' ended before its first sample; there was nothing to recover."
            return Recovered(journal, None, told, removed=True)
        kept = keep(path, contents)
    except InputError as error:
        return Recovered(journal, None, str(error))
    _remove(journal, contents)
    return Recovered(journal, kept)


def _empty(contents: Contents) -> bool:
    """Whether a journal holds neither samples nor pictures, not even damaged ones."""
    held = (Kind.BLOCK, Kind.FRAME)
    return all(one.kind not in held for one in contents) and not contents.torn


def _remove(journal: Path, contents: Contents) -> None:
    """Remove a journal and its videos."""
    delete_videos(journal.parent, contents)
    with contextlib.suppress(OSError):  # it is offered again, which does no harm
        journal.unlink()


def begin_journal(
    path: Path,
    task: str,
    name: str | None,
    author: str,
    devices: Sequence[Device],
    cameras: Sequence[str],
) -> tuple[str, JournalWriter, list[Path]]:
    """Make the journal of a recording that is to begin.

    Parameters
    ----------
    path : Path
        A project's folder.
    task : str
        Not blank where there is no name.
    name : str or None
        Of the demonstration; None for the task and the next number.
    author : str
        Whose track live marks become.
    devices : sequence of Device
        Open.
    cameras : sequence of str
        Names of the cameras.

    Returns
    -------
    name : str
        What the demonstration is called.
    journal : JournalWriter
    videos : list of Path
        Where each camera's video is to be written.

    Raises
    ------
    InputError
        If the project cannot be written; there is no journal then.
    """
    with Project.open(path) as project:
        project.refuse_read_only()
        if not (name or task).strip():
            raise InputError("A recording needs a task; give one.")
        name = (name or next_name(project, task)).strip()
    folder = path / CAPTURES
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise InputError(
            f"'{folder}' cannot be made ({error.strerror}); nothing is recorded."
        ) from error
    stem = _free(folder, name)
    videos = [folder / f"{stem}.{number}.mkv" for number in range(len(cameras))]
    header = {
        "name": name,
        "task": task,
        "author": author,
        "started": datetime.now(timezone.utc).isoformat(timespec="seconds"),
        "monotonic": time.monotonic(),
        "forcelab": __version__,
        "devices": [
            {
                "name": device.name,
                "channels": [[channel.name, channel.unit] for channel in device.channels],
                "rate": device.rate,
                "holds": device.holds,
                "counted": bool(getattr(device, "counted", True)),
            }
            for device in devices
        ],
        "cameras": [
            {"name": camera, "file": video.name}
            for camera, video in zip(cameras, videos, strict=True)
        ],
    }
    return name, JournalWriter(folder / f"{stem}{SUFFIX}", header), videos


def _free(folder: Path, name: str) -> str:
    """What the files of a recording are called: its name where that is free and a file's."""
    stem = re.sub(r"[^\w .,()+-]", "_", name).strip(" .")[:80] or "recording"
    taken = {path.name for path in folder.iterdir()}
    number, free = 1, stem
    while any(other.startswith(f"{free}.") for other in taken):
        number += 1
        free = f"{stem} ({number})"
    return free
