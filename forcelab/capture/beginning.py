"""How a recording begins: what it is called, where its files are, what its journal says first."""

from __future__ import annotations

import re
import time
from collections.abc import Sequence
from datetime import datetime, timezone
from pathlib import Path

from forcelab import __version__
from forcelab.capture.blocks import Device
from forcelab.capture.journal import SUFFIX
from forcelab.capture.journal_writer import JournalWriter
from forcelab.capture.keeping import CAPTURES, next_name
from forcelab.errors import InputError
from forcelab.project import Project

__all__ = ["begin_journal"]


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
