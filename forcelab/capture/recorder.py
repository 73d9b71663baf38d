"""Devices and cameras at once, live and into a project."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from forcelab.capture.camera import CameraReader, CameraState, Capture
from forcelab.capture.device import Closable, Device
from forcelab.capture.journal import JournalReader, JournalWriter, RecordKind
from forcelab.capture.reader import DeviceReader, DeviceState, Window
from forcelab.capture.save import (
    PartialSaveError,
    SavedRecording,
    create_journal,
    delete_videos,
    discard,
    save,
)
from forcelab.errors import InputError


@dataclass(frozen=True, slots=True)
class RecorderState:
    recording: bool
    #: Of the demonstration that is recorded; empty while none is.
    name: str
    #: Since the recording began; 0 while none runs.
    seconds: float
    #: Bytes that the disk refuses and that are kept in memory.
    in_memory: int
    devices: tuple[DeviceState, ...]
    cameras: tuple[CameraState, ...]

    @property
    def obstacle(self) -> str:
        """Why no recording can begin, in a sentence; empty where one can."""
        if not any(device.plugged for device in self.devices):
            return "No device is plugged in, so nothing can be recorded; plug one in again."
        if not any(device.channels for device in self.devices):
            names = " and ".join(device.name for device in self.devices)
            give = "gives" if len(self.devices) == 1 else "give"
            return f"{names} {give} texts only; add a stream of numbers."
        return ""


class Recorder(Closable):
    """Reads devices and cameras from :meth:`open` to :meth:`close`, and records in between.

    Its methods are for one thread; what happened is asked for every now and then.
    """

    def __init__(
        self,
        path: Path,
        devices: Sequence[Device],
        cameras: Sequence[tuple[str, Capture]] = (),
        *,
        seconds: float = 60.0,
    ) -> None:
        """Record into the project at `path`; the last `seconds` are kept for views.

        The devices are not open yet; the first that samples evenly gives the clock. The cameras are
        open, and released at the end; a demonstration has the first one's video, the others lie
        beside it.
        """
        self.path = Path(path)
        self.devices, self._captures, self._seconds = tuple(devices), tuple(cameras), seconds
        self._readers: list[DeviceReader] = []
        self.cameras: list[CameraReader] = []
        self._journal: JournalWriter | None = None
        self._stopped = False
        #: Of what could not be kept whole, but is in the project.
        self._part: SavedRecording | None = None
        #: The last recording's name, and its begin in seconds of the host's monotonic clock.
        self.name, self.begun = "", 0.0
        #: After `close`, the journal of a recording that could not be kept and that the project's
        #: disk did not take either: it is all in this file.
        self.saved: Path | None = None

    def open(self) -> None:
        """Open all devices and read them from now on; if one cannot be opened, none is."""
        opened = []
        try:
            for device in self.devices:
                device.open()
                opened.append(device)
        except BaseException:
            for device in opened:
                device.close()
            for _, capture in self._captures:
                capture.release()
            raise
        sensor = 1  # no two channels share a name
        for number, device in enumerate(self.devices):
            sensor = device.number_sensors(sensor)
            self._readers.append(DeviceReader(number, device, self._seconds))
        for number, (name, capture) in enumerate(self._captures):
            self.cameras.append(CameraReader(number, capture, name))

    def close(self) -> None:
        """Release everything; a recording that was not stopped stays as its journal."""
        for reader in self._readers:
            reader.close()
        for camera in self.cameras:
            camera.close()
        self._readers, self.cameras = [], []
        if self._journal is not None:
            self._journal.close()
            self.saved = self._journal.saved
            self._journal = None

    # Recording

    def start(self, task: str, name: str | None = None, author: str = "live") -> str:
        """Record from now on; gives the demonstration's name, by default task and next number.

        Live marks become a track of `author`. Nothing is recorded if it fails, as where the project
        cannot be written or no device is plugged in.
        """
        if self._journal is not None:
            raise InputError(f"'{self.name}' is still being recorded; stop it first.")
        if obstacle := self.state().obstacle:
            raise InputError(obstacle)
        names = [camera.name for camera in self.cameras]
        name, self._journal, videos = create_journal(
            self.path, task, name, author, self.devices, names
        )
        self._stopped, self._part = False, None
        self.name, self.begun = name, time.monotonic()
        for camera, video in zip(self.cameras, videos, strict=True):
            camera.record_to(self._journal, video)
        for reader in self._readers:
            reader.record_to(self._journal)
        return name

    @property
    def has_recording(self) -> bool:
        """Whether a recording runs, or has ended and is not kept yet."""
        return self._journal is not None

    def stop(self) -> SavedRecording:
        """End the recording and make a demonstration of it.

        Where it cannot be kept, stop again once that is mended, or discard it.
        """
        journal = self.end()
        contents = journal.contents()
        try:
            recording = save(self.path, contents)
        except PartialSaveError as error:
            self._part = error.part
            raise
        if self._part is not None and recording.added.status != "new":
            # It is this recording's own part, which may still be discarded.
            added = replace(recording.added, status="new")
            recording = replace(recording, added=added, heads=self._part.heads)
        self._forget(journal, contents)
        return recording

    def discard(self) -> None:
        """End the recording and keep nothing of it.

        It is still recorded if a part of it is in the project and cannot be removed.
        """
        journal = self.end()
        contents = journal.contents()
        if self._part is not None:
            discard(self.path, self._part)
            self._part = None
        self._forget(journal, contents)

    def _forget(self, journal: JournalWriter, contents: JournalReader) -> None:
        """Remove the files of a recording."""
        journal.close(delete=True)
        delete_videos(journal.path.parent, contents)
        self._journal = None

    def end(self) -> JournalWriter:
        """End the recording, into whose journal nothing goes any more.

        It is held until it is kept, by :meth:`stop`, or discarded.
        """
        journal = self._journal
        if journal is None:
            raise InputError("Nothing is being recorded; start a recording first.")
        if not self._stopped:
            self._stopped = True
            for reader in self._readers:
                reader.record_to(None)
            for camera in self.cameras:
                camera.record_to(None, None)
            journal.finish()
        return journal

    def mark(self, action: str, down: bool, at: float | None = None) -> None:
        """Note that the key of an action went down or up, while something is recorded.

        `at` is in seconds of the host's monotonic clock, by default the present.
        """
        if self._journal is not None and not self._stopped and action:
            at = time.monotonic() if at is None else at
            self._journal.note(RecordKind.MARK, at=at, action=action, down=down)

    def zero(self) -> None:
        """Let all devices take their present readings for zero."""
        for reader in self._readers:
            reader.zero()

    # Looking

    def state(self) -> RecorderState:
        recording = self._journal is not None and not self._stopped
        return RecorderState(
            recording,
            self.name if recording else "",
            time.monotonic() - self.begun if recording else 0.0,
            self._journal.in_memory if self._journal is not None else 0,
            tuple(reader.state() for reader in self._readers),
            tuple(camera.state() for camera in self.cameras),
        )

    def latest(self, seconds: float) -> tuple[Window, ...]:
        """The last seconds of each device."""
        return tuple(reader.ring.latest(seconds) for reader in self._readers)

    def since(self, device: int, number: int) -> Window:
        """All samples of a device from a number on, counted since it was opened."""
        return self._readers[device].ring.since(number)

    @property
    def firsts(self) -> tuple[int, ...]:
        """Number of each device's first sample of what is recorded, counted as :meth:`since`."""
        return tuple(reader.first for reader in self._readers)

    @property
    def ends(self) -> tuple[int | None, ...]:
        """Number of each device's first sample after what was recorded; None while it goes on."""
        return tuple(reader.end for reader in self._readers)

    def remarks(self) -> tuple[str, ...]:
        """What happened since the last call, a sentence each."""
        sources: list[DeviceReader | CameraReader | JournalWriter] = [*self._readers, *self.cameras]
        if self._journal is not None:
            sources.append(self._journal)
        return tuple(sentence for source in sources for sentence in source.remarks())
