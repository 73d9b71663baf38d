"""A camera: every frame stamped as it arrives and written as it comes."""

from __future__ import annotations

import contextlib
import math
import threading
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.device import MessageQueue
from forcelab.capture.discovery import LIST_HINT
from forcelab.capture.journal import JournalWriter, RecordKind
from forcelab.errors import InputError
from forcelab.video.codecs import opencv
from forcelab.video.jpeg_writer import JpegVideoWriter, encode_jpeg

#: Seconds without a picture after which a camera is away.
SILENT_SECONDS = 2.0


@dataclass(frozen=True, slots=True)
class CameraState:
    """How a camera does; it counts from the start of a recording, before that from its opening."""

    name: str
    frames: int
    #: Missing between those.
    dropped: int
    #: As measured, in Hz; 0 while not known.
    rate: float
    #: Of ``no picture`` and ``not written``.
    alarms: tuple[str, ...]


_INTERVALS = 30  # of which the median is the camera's period
_KNOWN = 10  # intervals that tell it: what a driver kept before it was read comes all at once
_GAP, _EARLY = 1.6, 0.6  # periods between two frames: one is missing or late; it was late
_LEAK = 0.8  # of a delay that is left with the next frame, as the period is not known exactly
_WATCHED = 10  # frames after a gap that tell late frames from missing ones


class DropCounter:
    """Counts frames, and those that a camera or its driver dropped.

    Where a camera stamps its frames, the stamps tell what is missing. Where only arrivals tell, a
    gap between two is a missing frame or a late one: late frames are followed by others that come
    sooner than a period, until the delay is made up; missing ones are not.
    """

    def __init__(self) -> None:
        self._steps: deque[float] = deque(maxlen=_INTERVALS)
        self._arrived = self._own = math.nan
        self.frames = self._sure = 0
        #: Of the frames in doubt: how late the last one and the least late one came (s), how many
        #: are watched yet, how many were, and how many frames are missing by them.
        self._behind = self._least = 0.0
        self._left = self._doubted = self._missing = 0

    def restart(self) -> None:
        """Count anew from the next frame on; the camera's period is known already."""
        self.frames = self._sure = 0
        self._clear_doubt()

    def interrupt(self) -> None:
        """The camera was away: what it did not see it did not drop."""
        self._sure += self._missing
        self._arrived = self._own = math.nan
        self._clear_doubt()

    @property
    def dropped(self) -> int:
        """Frames that are missing between those that came, as far as is known."""
        return self._sure + self._missing

    @property
    def rate(self) -> float:
        """Frames a second as measured; 0 while not known."""
        return 1.0 / median(self._steps) if self._steps else 0.0

    def count(self, arrived: float, stamp: float = 0.0) -> None:
        """Count a frame: when it arrived (s, host's clock), and the camera's own stamp (s) or 0."""
        self.frames += 1
        stamped = self._own > 0 and stamp > self._own
        step = stamp - self._own if stamped else arrived - self._arrived
        self._arrived, self._own = arrived, stamp
        if not step > 0:
            return
        if len(self._steps) >= _KNOWN:
            period = median(self._steps)
            if stamped:
                self._sure += max(round(step / period) - 1, 0) if step > _GAP * period else 0
            else:
                self._watch(step - period, period)
        # What is made up after a delay comes faster than the camera; but its period may change.
        self._doubted = self._doubted + 1 if self._left else 0
        if not self._left or self._doubted > 2 * _WATCHED:
            self._steps.append(step)

    def _watch(self, ahead: float, period: float) -> None:
        """Take in by how much (s) a frame came later than a period after the one before it."""
        if ahead > (_GAP - 1) * period:
            self._sure += self._missing
            self._behind = self._least = max(self._behind - self._missing * period, 0.0) + ahead
            self._left = _WATCHED
        elif self._left:
            self._behind += ahead
            self._least = min(self._least, self._behind)
            self._left -= 1
        else:
            self._behind = _LEAK * self._behind + ahead
            if self._behind < -_EARLY * period and self._sure:
                self._sure -= 1  # it was late for longer than was watched
                self._behind += period
            return
        self._missing = max(round(self._least / period), 0)
        if not self._left:
            self._sure += self._missing
            self._behind -= self._missing * period
            self._least, self._missing = 0.0, 0

    def _clear_doubt(self) -> None:
        """Forget what was in doubt."""
        self._behind = self._least = 0.0
        self._left = self._missing = self._doubted = 0


_LINKS = Path("/dev/v4l/by-id")  # names that stay with a camera whatever number it gets (udev)


class Capture(Protocol):
    """What OpenCV's capture objects do, and can be opened again."""

    def read(self) -> tuple[bool, NDArray[np.uint8] | None]:
        """Wait for the next frame: whether there is one, and its picture (blue, green, red)."""

    def get(self, what: int, /) -> float:
        """A property."""

    def reopen(self) -> bool:
        """Connect anew; gives whether it is back."""

    def release(self) -> None:
        """Release the camera."""


class OpenCvCamera:
    """A camera by its number such as ``"0"`` or its device."""

    def __init__(self, name: str) -> None:
        self.which = name
        self._link = persistent_link(name)
        self._capture: Any = None
        if not self.reopen():
            raise InputError(
                f"The camera {name} cannot be opened; plug it in, close what else uses it, and "
                f"{LIST_HINT}."
            )

    def reopen(self) -> bool:
        """Connect anew, by its own name where it has one; gives whether it is back."""
        self.release()
        path = self.which
        if self._link is not None:
            if not self._link.exists():
                return False
            path = str(self._link.resolve())
        number = path.removeprefix("/dev/video")
        capture = opencv().VideoCapture(int(number) if number.isdigit() else path)
        if not capture.isOpened():
            return False
        self._capture = capture
        return True

    def read(self) -> tuple[bool, NDArray[np.uint8] | None]:
        if self._capture is None:
            return False, None
        frame: tuple[bool, NDArray[np.uint8] | None] = self._capture.read()
        return frame

    def get(self, what: int, /) -> float:
        """A property by OpenCV's number."""
        return float(self._capture.get(what)) if self._capture is not None else 0.0

    def release(self) -> None:
        if self._capture is not None:
            self._capture.release()
            self._capture = None


def check_camera(which: str) -> None:
    """Refuse what cannot name a camera.

    Names are a number, a path, or an address on the network such as ``"rtsp://10.0.0.5/stream"``.
    """
    plain = which.isascii() and which.isdigit()
    if not plain and not which.startswith("/") and "://" not in which:
        raise InputError(
            f"'{which}' is no camera; write its number, such as 0, or its device, such as "
            f"/dev/video0."
        )


def open_camera(which: str) -> Capture:
    check_camera(which)
    return OpenCvCamera(which)


def open_cameras(names: Sequence[str]) -> list[tuple[str, Capture]]:
    """Open cameras, with their names, for a recorder; if one cannot be opened, none is."""
    opened: list[tuple[str, Capture]] = []
    try:
        for which in names:
            name = f"camera {which}"
            if any(name == other for other, _ in opened):
                raise InputError(f"The {name} is named twice; name it once.")
            opened.append((name, open_camera(which)))
    except BaseException:  # whatever that is: those before it are released
        for _, capture in opened:
            capture.release()
        raise
    return opened


def persistent_link(which: str, links: Path = _LINKS) -> Path | None:
    """The name of a camera that does not change when it is plugged in again, if any."""
    device = Path(f"/dev/video{which}" if which.isdigit() else which)
    if not links.is_dir():
        return None
    # A camera may have several, the pictures first.
    return next((link for link in sorted(links.iterdir()) if link.resolve() == device), None)


_POSITION_MS = 0  # OpenCV's CAP_PROP_POS_MSEC
_PAUSE = 0.02  # s between two tries while there is no picture
_RETRY = 1.0  # s between two tries to find it again


class CameraReader:
    """Reads one open camera in a thread of its own, which alone uses it.

    One that falls silent is looked for until it is back, and is a gap in its video.
    """

    def __init__(self, number: int, capture: Capture, name: str) -> None:
        self.name = name
        self._number, self._capture = number, capture
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._journal: JournalWriter | None = None
        self._path: Path | None = None
        self._writer: JpegVideoWriter | None = None
        self._first = 0.0
        self._size: tuple[int, int] | None = None  # height and width of the video
        self._refused = self._silent = False
        self._messages = MessageQueue()
        self._latest: tuple[float, NDArray[np.uint8]] | None = None
        self._count = DropCounter()
        self._last_arrival = self._tried = time.monotonic()
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
        """What happened since the last call, a sentence each."""
        return self._messages.take()

    def state(self) -> CameraState:
        with self._lock:
            count = self._count
            alarms = {"no picture": self._silent, "not written": self._refused}
            names = tuple(name for name, on in alarms.items() if on)
            return CameraState(self.name, count.frames, count.dropped, count.rate, names)

    def close(self) -> None:
        """End the thread and release the camera."""
        self._stop.set()
        self._thread.join()
        self.record_to(None, None)
        self._capture.release()

    # In the thread

    def _run(self) -> None:
        while not self._stop.is_set():
            read, picture = self._capture.read()
            arrived = time.monotonic()
            if not read or picture is None:
                self._no_picture(arrived)
                self._stop.wait(_PAUSE)
                continue
            stamp = self._capture.get(_POSITION_MS) / 1000.0
            encoded = self._encode(picture) if self._journal is not None else None
            with self._lock:
                self._picture_arrived(arrived)
                self._count.count(arrived, stamp)
                self._latest = (arrived, picture)
                if encoded is not None and self._journal is not None:
                    self._write(encoded, arrived, stamp)

    def _no_picture(self, now: float) -> None:
        """No picture came; say so once it has been long, and look for the camera."""
        if now - self._last_arrival <= SILENT_SECONDS:
            return
        if not self._silent:
            with self._lock:
                self._silent = True
                self._count.interrupt()
                self._report(f"{self.name} gives no picture; look at its cable.")
        if now - self._tried >= _RETRY:
            self._capture.reopen()
            self._tried = time.monotonic()

    def _picture_arrived(self, arrived: float) -> None:
        """A picture came, perhaps after long; holding the lock."""
        if self._silent:
            self._silent = False
            self._report(f"{self.name} is back after {arrived - self._last_arrival:.1f} s.")
        self._last_arrival = arrived

    def _report(self, sentence: str) -> None:
        """Say a sentence, and note it in the journal; holding the lock."""
        self._messages.put(sentence)
        if self._journal is not None:
            self._journal.note(RecordKind.MESSAGE, at=time.monotonic(), text=sentence)

    def _encode(self, picture: NDArray[np.uint8]) -> bytes:
        """A picture as JPEG, in the size that the video has."""
        size = self._size = self._size or (picture.shape[0], picture.shape[1])
        if picture.shape[:2] != size:  # it came back with another one
            picture = opencv().resize(picture, size[::-1])
        return encode_jpeg(picture)

    def _write(self, jpeg: bytes, arrived: float, stamp: float) -> None:
        """Write a frame, and its stamps into the journal."""
        try:
            if self._writer is None and self._path is not None and self._size is not None:
                height, width = self._size
                self._writer = JpegVideoWriter(self._path, width, height)
                self._first = arrived
            if self._writer is None or self._journal is None:
                return
            written = self._writer.write(jpeg, arrived - self._first)
        except OSError as error:
            if not self._refused:
                self._refused = True
                self._messages.put(
                    f"'{self._path}' cannot be written ({error.strerror or error}); frames are "
                    f"lost until it can."
                )
            return
        self._refused = False
        stamps = [arrived, stamp if stamp > 0 else None, written]
        self._journal.note(RecordKind.FRAME, self._number, frames=[stamps])

    def _finish_video(self) -> None:
        writer, self._writer, self._size = self._writer, None, None
        if writer is not None:
            with contextlib.suppress(OSError):  # what is there can be read without its end
                writer.close()
