"""OpenCV, loaded when a video is met and kept from telling the terminal."""

from __future__ import annotations

import os
from types import ModuleType

__all__ = ["opencv"]


def opencv() -> ModuleType:
    """OpenCV's module, silent: what goes wrong with a video is told as one sentence instead.

    Raises
    ------
    ImportError
        If OpenCV is not installed, or lacks a library of the system.
    """
    # Read once, when the first video is opened: -8 is FFmpeg's AV_LOG_QUIET.
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
    import cv2

    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    module: ModuleType = cv2
    return module
