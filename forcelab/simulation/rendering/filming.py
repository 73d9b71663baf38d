"""Videos of performances, written whole or not at all."""

from __future__ import annotations

import contextlib
import os
import secrets
import shutil
from collections.abc import Generator, Iterator
from pathlib import Path

import cv2

from forcelab.atomic import atomic_file, write_atomically
from forcelab.errors import InputError
from forcelab.jobs import Progress, finish
from forcelab.simulation.motion import Performance
from forcelab.simulation.rendering.camera import RATE, Array, Camera, Filmed
from forcelab.simulation.rendering.stage import SIZE, Stage

__all__ = ["render", "rendering"]

#: Frames between two reports of progress.
STRETCH = 30


def render(performance: Performance, path: Path, camera: Camera) -> Filmed:
    """Film a performance; see :func:`rendering`, which is the same as a job."""
    return finish(rendering(performance, path, camera))


def rendering(
    performance: Performance, path: Path, camera: Camera
) -> Generator[Progress, None, Filmed]:
    """Film a performance: 640x360, 30 frames/s, MPEG-4 in an mp4 file.

    The file has the even timestamps n / 30 s that OpenCV writes. The true times are kept beside
    it: ``NAME.mp4`` has ``NAME.frames.csv`` with a row for each frame: its number, the file's
    timestamp and the force time of the instant that it shows. The same arguments give the same
    bytes on one machine.

    Parameters
    ----------
    performance : Performance
    path : Path
        The video to write, ending in ``.mp4``; its folder must exist.
    camera : Camera
        Its clock.

    Yields
    ------
    Progress
        About once for each second of the video.

    Returns
    -------
    Filmed

    Raises
    ------
    InputError
        If the video cannot be written, or OpenCV lacks the codec; neither file is then there, or
        each is as it was before.
    """
    times = performance.motion.times
    video, force, late = camera.shots(float(times[-1]))
    stamps = path.with_suffix(".frames.csv")
    # OpenCV tells the container by the file's ending, and cannot write to a stream.
    scratch = path.with_name(f".forcelab-{secrets.token_hex(8)}.part.mp4")
    try:
        with atomic_file(path) as stream:
            yield from _encoding(Stage(performance), force, scratch, path)
            with scratch.open("rb") as encoded:
                shutil.copyfileobj(encoded, stream)
            stream.flush()
            write_atomically(stamps, _table(video, force))
    finally:
        with contextlib.suppress(OSError):
            scratch.unlink()
    return Filmed(path, stamps, video, force, camera.clock, late)


def _encoding(
    stage: Stage, force: Array, scratch: Path, path: Path
) -> Generator[Progress, None, None]:
    """Draw and encode the frames of some instants into a file that OpenCV may name."""
    yield Progress(0, force.size, f"filming {path.name}")
    with _silence():
        writer = cv2.VideoWriter(str(scratch), cv2.VideoWriter.fourcc(*"mp4v"), RATE, SIZE)
    try:
        if not writer.isOpened():
            raise InputError(
                f"'{path}' cannot be written: OpenCV finds no MPEG-4 encoder (mp4v) or no room "
                f"here; install opencv-contrib-python-headless or free some space."
            )
        for first in range(0, force.size, STRETCH):
            with _silence():
                for time in force[first : first + STRETCH].tolist():
                    writer.write(stage.frame(time))
            yield Progress(min(first + STRETCH, force.size), force.size, f"filming {path.name}")
    finally:
        with _silence():
            writer.release()
    # The encoder goes on when the disk is full; its file then lacks its index.
    if not _has_index(scratch):
        raise InputError(
            f"'{path}' cannot be written: not all of it reached the disk; free some space and "
            f"film again."
        )


def _has_index(path: Path) -> bool:
    """Whether an mp4 file is a sequence of whole boxes, one of them the index of its frames."""
    with path.open("rb") as stream:
        end = stream.seek(0, os.SEEK_END)
        place, found = 0, False
        while place < end:
            stream.seek(place)
            head = stream.read(8)
            size = int.from_bytes(head[:4], "big")
            found = found or head[4:] == b"moov"
            if size < 8:
                return False
            place += size
    return found and place == end


@contextlib.contextmanager
def _silence() -> Iterator[None]:
    """Keep OpenCV from telling the terminal what is raised as one sentence."""
    log = cv2.utils.logging
    level = log.getLogLevel()
    log.setLogLevel(log.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        log.setLogLevel(level)


def _table(video: Array, force: Array) -> bytes:
    """The true times as a table, to the nanosecond."""
    rows = (
        f"{frame},{seen:.9f},{true:.9f}\n"
        for frame, (seen, true) in enumerate(zip(video.tolist(), force.tolist(), strict=True))
    )
    return ("frame,video_seconds,force_seconds\n" + "".join(rows)).encode()
