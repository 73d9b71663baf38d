"""A camera: every frame stamped as it arrives and written as it comes, in a thread of its own."""

from __future__ import annotations

import contextlib
import threading
import time
from collections import deque
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.journal import Kind
from forcelab.capture.journal_writer import JournalWriter
from forcelab.capture.matroska import MatroskaWriter
from forcelab.errors import InputError

__all__ = ["CameraReader", "CameraState", "Capture", "open_camera"]

_POSITION_MS = 0  # OpenCV's CAP_PROP_POS_MSEC
_QUALITY = 90  # of the JPEG pictures, in percent
_PAUSE = 0.02  # s between two tries while there is no picture
_SILENT = 2.0  # s without a picture after which that is said
_INTERVALS = 30  # of which the median is the camera's period
_LATE, _EARLY = 1.6, 0.5  # periods between two frames: one is missing, or was late


class Capture(Protocol):
    """What OpenCV's capture objects do."""

    def read(self) -> tuple[bool, NDArray[np.uint8] | None]:
        """Wait for the next frame: whether there is one, and its picture (blue, green, red)."""

    def get(self, what: int, /) -> float:
        """A property."""

    def release(self) -> None:
        """Let go of the camera."""


@dataclass(frozen=True, slots=True)
class CameraState:
    """How a camera does.

    Parameters
    ----------
    name : str
    frames, dropped : int
        That came, and that are missing between those, since the recording began; before that,
        since it was opened.
    rate : float
        Frames a second as measured; 0 while not known.
    alarms : tuple of str
        Of ``no picture`` and ``not written``.
    """

    name: str
    frames: int
    dropped: int
    rate: float
    alarms: tuple[str, ...]


def open_camera(which: str) -> Capture:
    """Open a camera.

    Parameters
    ----------
    which : str
        Its number, such as ``"0"``, or its device, such as ``"/dev/video0"``.

    Raises
    ------
    InputError
        If it cannot be opened.
    """
    from forcelab.video.opencv import opencv

    capture = opencv().VideoCapture(int(which) if which.isdigit() else which)
    if not capture.isOpened():
        raise InputError(
            f"The camera {which} cannot be opened; plug it in, close what else uses it, and see "
            f"'forcelab capture --list' for what there is."
        )
    found: Capture = capture
    return found


class CameraReader:
    """Reads one camera.

    Parameters
    ----------
    number : int
        Of the camera in the journal.
    capture : Capture
        Open; used by this thread alone from now on.
    name : str
        Such as ``"camera 0"``.
    """

    def __init__(self, number: int, capture: Capture, name: str) -> None:
        self.name = name
        self._number, self._capture = number, capture
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self._journal: JournalWriter | None = None
        self._path: Path | None = None
        self._writer: MatroskaWriter | None = None
        self._first = 0.0
        self._refused = self._silent = False
        self._remarks: list[str] = []
        self._latest: tuple[float, NDArray[np.uint8]] | None = None
        self._steps: deque[float] = deque(maxlen=_INTERVALS)
        self._heard, self._own = time.monotonic(), 0.0
        self._frames = self._dropped = self._owed = 0
        self._thread = threading.Thread(target=self._run, name=f"forcelab {name}")
        self._thread.start()

    def record_to(self, journal: JournalWriter | None, path: Path | None) -> None:
        """Write what comes from now on into a video, its stamps into a journal; or nothing."""
        with self._lock:
            self._finish_video()
            self._journal, self._path, self._refused = journal, path, False
            if journal is not None:
                self._frames = self._dropped = self._owed = 0

    def latest(self) -> tuple[float, NDArray[np.uint8]] | None:
        """When the latest frame arrived (s, host's clock), and it: (height, width, 3), BGR."""
        with self._lock:
            return self._latest

    def remarks(self) -> tuple[str, ...]:
        """What happened since the last time this was asked, a sentence each."""
        with self._lock:
            told = tuple(self._remarks)
            self._remarks.clear()
        return told

    def state(self) -> CameraState:
        """How the camera does."""
        with self._lock:
            rate = 1.0 / float(np.median(self._steps)) if self._steps else 0.0
            alarms = {"no picture": self._silent, "not written": self._refused}
            told = tuple(name for name, there in alarms.items() if there)
            return CameraState(self.name, self._frames, self._dropped, rate, told)

    def close(self) -> None:
        """End the thread and let go of the camera."""
        self._ended.set()
        self._thread.join()
        self.record_to(None, None)
        self._capture.release()

    # In the thread

    def _run(self) -> None:
        while not self._ended.is_set():
            there, picture = self._capture.read()
            arrived = time.monotonic()
            if not there or picture is None:
                self._nothing(arrived)
                self._ended.wait(_PAUSE)
                continue
            own = self._capture.get(_POSITION_MS) / 1000.0
            encoded = self._encode(picture) if self._journal is not None else None
            with self._lock:
                self._count(arrived, own)
                self._latest = (arrived, picture)
                if encoded is not None and self._journal is not None:
                    self._write(encoded, picture, arrived, own)

    def _nothing(self, now: float) -> None:
        """No picture came; say so once it has been long."""
        with self._lock:
            if now - self._heard > _SILENT and not self._silent:
                self._silent = True
                self._remarks.append(f"{self.name} gives no picture; look at its cable.")

    def _count(self, arrived: float, own: float) -> None:
        """Count the frame, and those that are missing before it."""
        moves = self._own > 0 and own > self._own
        step = own - self._own if moves else arrived - self._heard
        if self._latest is not None and step > 0:
            period = float(np.median(self._steps)) if len(self._steps) > 4 else np.inf
            if step > _LATE * period:
                self._owed = max(round(step / period) - 1, 1)
                self._dropped += self._owed
            elif step < _EARLY * period and self._owed and not moves:
                self._owed -= 1  # it was late, not missing
                self._dropped -= 1
            self._steps.append(step)
        self._heard, self._own, self._silent = arrived, own, False
        self._frames += 1

    @staticmethod
    def _encode(picture: NDArray[np.uint8]) -> bytes:
        """A picture as JPEG."""
        from forcelab.video.opencv import opencv

        cv2 = opencv()
        _, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
        jpeg: bytes = data.tobytes()
        return jpeg

    def _write(self, jpeg: bytes, picture: NDArray[Any], arrived: float, own: float) -> None:
        """Write a frame, and its stamps into the journal."""
        try:
            if self._writer is None and self._path is not None:
                height, width = picture.shape[:2]
                self._writer = MatroskaWriter(self._path, width, height)
                self._first = arrived
            if self._writer is None or self._journal is None:
                return
            written = self._writer.write(jpeg, arrived - self._first)
        except OSError as error:
            if not self._refused:
                self._refused = True
                self._remarks.append(
                    f"'{self._path}' cannot be written ({error.strerror or error}); frames are "
                    f"lost until it can."
                )
            return
        self._refused = False
        stamps = [arrived, own if own > 0 else None, written]
        self._journal.note(Kind.FRAME, self._number, frames=[stamps])

    def _finish_video(self) -> None:
        """Close the video that is being written."""
        writer, self._writer = self._writer, None
        if writer is not None:
            with contextlib.suppress(OSError):  # what is there can be read without its end
                writer.close()
