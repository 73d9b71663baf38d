"""Videos of performances."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.simulation.motion import Performance
from forcelab.simulation.rendering.camera import RATE, Array, Camera
from forcelab.simulation.rendering.stage import SIZE, Stage

__all__ = ["render"]


def render(performance: Performance, path: Path, camera: Camera) -> tuple[Array, NDArray[np.intp]]:
    """Film a performance: 640x360, 30 frames/s, MPEG-4 in an mp4 file.

    The file has the even timestamps n / 30 s that OpenCV writes. The same arguments give the same
    bytes on one machine.

    Parameters
    ----------
    performance : Performance
    path : Path
        The video to write, ending in ``.mp4``, which tells OpenCV the container.
    camera : Camera
        Its clock.

    Returns
    -------
    force, late : ndarray
        As of :meth:`Camera.shots`.

    Raises
    ------
    InputError
        If the camera starts after the end, the video cannot be written, or OpenCV lacks the codec.
    """
    force, late = camera.shots(float(performance.motion.times[-1]))
    stage = Stage(performance)
    with _silence():
        writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), RATE, SIZE)
        try:
            if not writer.isOpened():
                raise InputError(
                    f"'{path}' cannot be written: OpenCV finds no MPEG-4 encoder (mp4v) or no room "
                    f"here; install opencv-contrib-python-headless or free some space."
                )
            for time in force.tolist():
                writer.write(stage.frame(time))
        finally:
            writer.release()
    # The encoder goes on when the disk is full; its file then lacks its index.
    if not _has_index(path):
        raise InputError(
            f"'{path}' cannot be written: not all of it reached the disk; free some space and "
            f"film again."
        )
    return force, late


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
