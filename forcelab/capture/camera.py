"""A camera: every frame stamped as it arrives and written as it comes, in a thread of its own."""

from __future__ import annotations

import contextlib
import threading
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.camera_device import Capture
from forcelab.capture.events import Events
from forcelab.capture.frames import SILENT, FrameCount
from forcelab.capture.journal import Kind
from forcelab.capture.journal_writer import JournalWriter
from forcelab.capture.matroska import MatroskaWriter
from forcelab.capture.recorder_state import CameraState

__all__ = ["CameraReader"]

_POSITION_MS = 0  # OpenCV's CAP_PROP_POS_MSEC
_QUALITY = 90  # of the JPEG pictures, in percent
_PAUSE = 0.02  # s between two tries while there is no picture
_RETRY = 1.0  # s between two tries to find it again


class CameraReader:
    """Reads one camera.

    One that falls silent is looked for until it is back, and is a gap in its video.

    Parameters
    ----------
    number : int
        Of the camera in the journal.
    capture : Capture
        Open; used by this thread alone from now on. After it fell silent, its `reopen` is called,
        where it has that, until it gives whether it is back.
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
        self._size: tuple[int, int] | None = None  # height and width of the video
        self._refused = self._silent = False
        self._events = Events()
        self._latest: tuple[float, NDArray[np.uint8]] | None = None
        self._count = FrameCount()
        self._heard = self._tried = time.monotonic()
        self._thread = threading.Thread(target=self._run, name=f"forcelab {name}")
        self._thread.start()

    def record_to(self, journal: JournalWriter | None, path: Path | None) -> None:
        """Write what comes from now on into a video, its stamps into a journal; or nothing."""
        with self._lock:
            self._finish_video()
            self._journal, self._path, self._refused = journal, path, False
            if journal is not None:
                self._count.restart()

    def latest(self) -> tuple[float, NDArray[np.uint8]] | None:
        """When the latest frame arrived (s, host's clock), and it: (height, width, 3), BGR."""
        with self._lock:
            return self._latest

    def remarks(self) -> tuple[str, ...]:
        """What happened since the last time this was asked, a sentence each."""
        return self._events.take()

    def state(self) -> CameraState:
        """How the camera does."""
        with self._lock:
            count = self._count
            alarms = {"no picture": self._silent, "not written": self._refused}
            told = tuple(name for name, there in alarms.items() if there)
            return CameraState(self.name, count.frames, count.dropped, count.rate, told)

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
                self._heard_again(arrived)
                self._count.count(arrived, own)
                self._latest = (arrived, picture)
                if encoded is not None and self._journal is not None:
                    self._write(encoded, arrived, own)

    def _nothing(self, now: float) -> None:
        """No picture came; say so once it has been long, and look for the camera."""
        if now - self._heard <= SILENT:
            return
        if not self._silent:
            with self._lock:
                self._silent = True
                self._count.interrupted()
                self._say(f"{self.name} gives no picture; look at its cable.")
        again = getattr(self._capture, "reopen", None)
        if again is not None and now - self._tried >= _RETRY:
            again()
            self._tried = time.monotonic()

    def _heard_again(self, arrived: float) -> None:
        """A picture came, perhaps after long; holding the lock."""
        if self._silent:
            self._silent = False
            self._say(f"{self.name} is back after {arrived - self._heard:.1f} s.")
        self._heard = arrived

    def _say(self, sentence: str) -> None:
        """Say a sentence, and note it in the journal; holding the lock."""
        self._events.say(sentence)
        if self._journal is not None:
            self._journal.note(Kind.MESSAGE, at=time.monotonic(), text=sentence)

    def _encode(self, picture: NDArray[np.uint8]) -> bytes:
        """A picture as JPEG, in the size that the video has."""
        from forcelab.video.codecs import opencv

        cv2 = opencv()
        size = self._size
        if size is not None and picture.shape[:2] != size:  # it came back with another one
            picture = cv2.resize(picture, size[::-1])
        _, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
        if size is None:
            self._size = (picture.shape[0], picture.shape[1])
        jpeg: bytes = data.tobytes()
        return jpeg

    def _write(self, jpeg: bytes, arrived: float, own: float) -> None:
        """Write a frame, and its stamps into the journal."""
        try:
            if self._writer is None and self._path is not None and self._size is not None:
                height, width = self._size
                self._writer = MatroskaWriter(self._path, width, height)
                self._first = arrived
            if self._writer is None or self._journal is None:
                return
            written = self._writer.write(jpeg, arrived - self._first)
        except OSError as error:
            if not self._refused:
                self._refused = True
                self._events.say(
                    f"'{self._path}' cannot be written ({error.strerror or error}); frames are "
                    f"lost until it can."
                )
            return
        self._refused = False
        stamps = [arrived, own if own > 0 else None, written]
        self._journal.note(Kind.FRAME, self._number, frames=[stamps])

    def _finish_video(self) -> None:
        """Close the video that is being written."""
        writer, self._writer, self._size = self._writer, None, None
        if writer is not None:
            with contextlib.suppress(OSError):  # what is there can be read without its end
                writer.close()
