"""OpenCV, loaded when a video is met, and which codecs work on this machine."""

from __future__ import annotations

import os
import tempfile
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np

from forcelab.errors import InputError


def opencv() -> ModuleType:
    """OpenCV's module, silent: what goes wrong with a video is told as one sentence instead.

    `ImportError` if OpenCV is not installed, or lacks a library of the system.
    """
    # Read once, when the first video is opened: -8 is FFmpeg's AV_LOG_QUIET.
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
    import cv2

    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    module: ModuleType = cv2
    return module


@dataclass(frozen=True, slots=True)
class Codec:
    name: str  #: what people call it
    fourcc: str  #: its four letters
    suffix: str  #: of files of its container


#: The codecs that OpenCV's wheels are known to write and read.
CODECS = (
    Codec("MPEG-4", "mp4v", ".mp4"),
    Codec("Motion JPEG", "MJPG", ".avi"),
    Codec("VP8", "VP80", ".mkv"),
    Codec("VP9", "VP90", ".mkv"),
    Codec("FFV1", "FFV1", ".mkv"),
)
FRAMES = 5


def try_codec(codec: Codec) -> bool:
    """Write a few frames, and say whether they all come back: one that opens may still give none.

    `ImportError` as of :func:`opencv`.
    """
    cv2 = opencv()
    try:
        scratch = tempfile.TemporaryDirectory()
    except OSError as error:
        raise InputError(
            f"No temporary folder can be made ({error}); set TMPDIR to a folder with room."
        ) from error
    with scratch as folder:
        path = str(Path(folder) / f"test{codec.suffix}")
        writer = cv2.VideoWriter(path, cv2.VideoWriter.fourcc(*codec.fourcc), 30, (64, 64))
        if not writer.isOpened():
            return False
        for number in range(FRAMES):
            writer.write(np.full((64, 64, 3), 40 * number, dtype=np.uint8))
        writer.release()
        reader = cv2.VideoCapture(path)
        read = 0
        while reader.read()[0]:
            read += 1
        reader.release()
        return read == FRAMES
