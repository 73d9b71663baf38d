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

from forcelab.capture.assemble import AssembledRecording, assemble
from forcelab.capture.device import Device
from forcelab.capture.journal import (
    SUFFIX,
    JournalReader,
    JournalWriter,
    RecordKind,
    is_being_written,
    read_journal,
)
from forcelab.errors import InputError
from forcelab.formats.output_folder import file_names
from forcelab.project import AddResult, Project
from forcelab.project.records import NewDemonstration
from forcelab.version import __version__

#: Name of the folder in a project that holds recordings while they last.
CAPTURES = "captures"


def unfinished_journals(path: Path) -> tuple[Path, ...]:
    """Journals of a project (its folder) that no process is writing."""
    if not (path / CAPTURES).is_dir():  # every window that opens a project asks
        return ()
    journals = sorted((path / CAPTURES).glob(f"*{SUFFIX}"))
    return tuple(journal for journal in journals if not is_being_written(journal))


@dataclass(frozen=True, slots=True)
class SavedRecording:
    """A recording that has become a demonstration."""

    added: AddResult
    samples: int
    seconds: float
    #: Sentences for the user.
    remarks: tuple[str, ...]
    #: Of each author, the last edit of the track that was marked live.
    heads: dict[str, int] = field(default_factory=dict)
    #: To how many seconds the stamps are known, those of the worst device.
    precision: float = 0.0


class PartialSaveError(InputError):
    """A recording that could not be kept whole, nor taken back: `part` is in the project."""

    def __init__(self, trouble: str, part: SavedRecording) -> None:
        super().__init__(trouble)
        self.part = part


@dataclass(frozen=True, slots=True)
class RecoveredRecording:
    """What became of an unfinished recording."""

    #: Its journal, which is still there where something is in it that was not kept.
    path: Path
    recording: SavedRecording | None
    #: Why nothing was kept.
    problem: str = ""
    #: Whether the journal is gone because nothing was in it.
    removed: bool = False


def next_name(project: Project, task: str) -> str:
    """The next name of a task's demonstrations: the task and the number after the largest one."""
    names = [demonstration.name for demonstration in project.demonstrations.infos(task)]
    names += [path.stem for path in (project.path / CAPTURES).glob(f"*{SUFFIX}")]
    numbered = re.compile(re.escape(task) + r" (\d+)(?: \(\d+\))?")
    numbers = [int(match[1]) for name in names if (match := numbered.fullmatch(name))]
    return f"{task} {max(numbers, default=0) + 1:02d}"


def save(path: Path, contents: JournalReader) -> SavedRecording:
    """Make a demonstration of a journal and add it to its project.

    To do it twice does no harm: the same recording is the same demonstration. InputError if it
    holds no demonstration or the project cannot be written: nothing was added; PartialSaveError if
    that could not be taken back.
    """
    assembled = assemble(contents, path / CAPTURES)
    demonstration = assembled.demonstration
    devices = ", ".join(str(device) for device in assembled.stamps["devices"])
    incoming = NewDemonstration(
        demonstration,
        assembled.tracks,
        source=f"captured {contents.header.get('started', '')} from {devices}",
    )
    with Project.open(path) as project:
        (added,) = project.demonstrations.add_all([incoming])
        heads = {
            track.author: project.tracks.head(added.id, track.author) for track in incoming.tracks
        }
        recording = SavedRecording(
            added,
            len(demonstration.times),
            demonstration.duration,
            (*assembled.remarks, *added.remarks),
            heads,
            assembled.precision,
        )
        try:
            project.media.attach_stamps(added.id, assembled.stamps)
            _compare(project, added, assembled)
        except BaseException as error:  # whatever that is: the next try begins anew
            if added.status == "new":
                _take_back(project, recording, error)
            raise
    return recording


def _compare(project: Project, added: AddResult, assembled: AssembledRecording) -> None:
    """Hold what the project stored against what was recorded, before the journal may go."""
    stored = project.demonstrations.load(added.id)
    columns = slice(assembled.lead_column, assembled.lead_column + assembled.lead_values.shape[1])
    if not (
        np.array_equal(stored.times, assembled.demonstration.times)
        and np.array_equal(stored.signals, assembled.demonstration.signals, equal_nan=True)
        and np.array_equal(stored.signals[:, columns], assembled.lead_values, equal_nan=True)
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
        # Whatever it was: that something is half done has to be said before anything else.
        first = error if isinstance(error, InputError) else f"It ended early ({error!r})."
        raise PartialSaveError(
            f"{first} '{part.added.name}' is in the project without its stamps, as it could "
            f"not be taken back either: {second}",
            part,
        ) from error


def discard(path: Path, recording: SavedRecording) -> None:
    """Remove a recording from its project for good, as if it had never been kept.

    One that was removed meanwhile is gone, which is all that is asked for. InputError if it was
    there before it was recorded, as when it was recovered twice, or was labelled, assigned,
    reviewed or used for training since: it stays then.
    """
    if recording.added.status != "new":
        raise InputError(f"'{recording.added.name}' was in the project before; it stays.")
    with Project.open(path) as project:
        if any(
            demonstration.id == recording.added.id
            for demonstration in project.demonstrations.infos()
        ):
            project.demonstrations.discard(recording.added.id, recording.heads)


def delete_videos(folder: Path, contents: JournalReader) -> None:
    """Remove the videos of a journal: they are in the project, or not needed."""
    for camera in contents.header.get("cameras", ()):
        with contextlib.suppress(OSError):  # it only takes up room
            (folder / Path(str(camera["file"])).name).unlink(missing_ok=True)


def recover(path: Path) -> tuple[RecoveredRecording, ...]:
    """Make demonstrations of a project's unfinished recordings; remove those without samples."""
    return tuple(_recover(path, journal) for journal in unfinished_journals(path))


def _recover(path: Path, journal: Path) -> RecoveredRecording:
    try:
        contents = read_journal(journal)
        if _empty(contents):
            _remove(journal, contents)
            problem = (
                f"'{journal.stem}' ended before its first sample; there was nothing to recover."
            )
            return RecoveredRecording(journal, None, problem, removed=True)
        recording = save(path, contents)
    except InputError as error:
        return RecoveredRecording(journal, None, str(error))
    _remove(journal, contents)
    return RecoveredRecording(journal, recording)


def _empty(contents: JournalReader) -> bool:
    """Whether a journal holds neither samples nor pictures, not even damaged ones."""
    data = (RecordKind.BLOCK, RecordKind.FRAME)
    return all(record.kind not in data for record in contents) and not contents.torn


def _remove(journal: Path, contents: JournalReader) -> None:
    delete_videos(journal.parent, contents)
    with contextlib.suppress(OSError):  # it is offered again, which does no harm
        journal.unlink()


def create_journal(
    path: Path,
    task: str,
    name: str | None,
    author: str,
    devices: Sequence[Device],
    cameras: Sequence[str],
) -> tuple[str, JournalWriter, list[Path]]:
    """Make the journal of a recording that is to begin; if it fails, there is none.

    Live marks become a track of `author`; without a name the recording is called by its task and
    the next number. Gives its name, the journal, and where each camera's video is to be written.
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
    stem = _free_stem(folder, name)
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
                "counted": device.counted,
                "stamped": device.stamped,
            }
            for device in devices
        ],
        "cameras": [
            {"name": camera, "file": video.name}
            for camera, video in zip(cameras, videos, strict=True)
        ],
    }
    return name, JournalWriter(folder / f"{stem}{SUFFIX}", header), videos


def _free_stem(folder: Path, name: str) -> str:
    """What the files of a recording are called: its name where that is free and a file's."""
    stem = re.sub(r"[^\w .,()+-]", "_", name).strip(" .")[:80] or "recording"
    (stem,) = file_names([stem])
    existing = {path.name.casefold() for path in folder.iterdir()}
    number, free = 1, stem
    while any(other.startswith(f"{free.casefold()}.") for other in existing):
        number += 1
        free = f"{stem} ({number})"
    return free
