"""Devices and cameras at once, live and into a project."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from forcelab.capture.camera import CameraReader, Capture
from forcelab.capture.device import Device, Opened
from forcelab.capture.devices import number_sensors
from forcelab.capture.journal import Contents, Kind
from forcelab.capture.journal_writer import JournalWriter
from forcelab.capture.reader import DeviceReader, RecorderState, Window
from forcelab.capture.save import (
    PartialSaveError,
    SavedRecording,
    begin_journal,
    delete_videos,
    discard,
    keep,
)
from forcelab.errors import InputError


class Recorder(Opened):
    """Reads devices and cameras from :meth:`open` to :meth:`close`, and records in between.

    A context manager. Its methods are for one thread; whoever shows it asks every now and then.

    Parameters
    ----------
    path : Path
        A project's folder.
    devices : sequence of Device
        Not open yet; the first that samples evenly gives the clock.
    cameras : sequence of (str, Capture)
        Names and open capture objects; a demonstration has the first one's video, the others lie
        beside it. They are released at the end.
    seconds : float
        That are kept for views.

    Attributes
    ----------
    begun : float
        When the recording began, in seconds of the host's monotonic clock.
    saved : Path or None
        After :meth:`close`, the journal of a recording that could not be kept and that the
        project's disk did not take either: it is all there.
    """

    def __init__(
        self,
        path: Path,
        devices: Sequence[Device],
        cameras: Sequence[tuple[str, Capture]] = (),
        *,
        seconds: float = 60.0,
    ) -> None:
        self.path = Path(path)
        self._devices, self._captures, self._seconds = tuple(devices), tuple(cameras), seconds
        self._readers: list[DeviceReader] = []
        self._cameras: list[CameraReader] = []
        self._journal: JournalWriter | None = None
        self._stopped = False
        self._part: SavedRecording | None = (
            None  # of what could not be kept whole, but is in the project
        )
        self._name, self.begun = "", 0.0
        self.saved: Path | None = None

    def open(self) -> None:
        """Open all devices and read them from now on.

        Raises
        ------
        InputError
            If one cannot be opened; none is then.
        """
        opened = []
        try:
            for device in self._devices:
                device.open()
                opened.append(device)
        except BaseException:
            for device in opened:
                device.close()
            for _, capture in self._captures:
                capture.release()
            raise
        number_sensors(self._devices)
        for number, device in enumerate(self._devices):
            self._readers.append(DeviceReader(number, device, self._seconds))
        for number, (name, capture) in enumerate(self._captures):
            self._cameras.append(CameraReader(number, capture, name))

    def close(self) -> None:
        """Let go of everything; a recording that was not stopped stays as its journal."""
        for reader in self._readers:
            reader.close()
        for camera in self._cameras:
            camera.close()
        self._readers, self._cameras = [], []
        if self._journal is not None:
            self._journal.close()
            self.saved = self._journal.saved
            self._journal = None

    # Recording

    def start(self, task: str, name: str | None = None, author: str = "live") -> str:
        """Record from now on; gives the demonstration's name.

        Parameters
        ----------
        task : str
            Not blank where there is no name.
        name : str, optional
            By default the task and the next number.
        author : str
            Whose track live marks become.

        Raises
        ------
        InputError
            If the project cannot be written or no device is plugged in; nothing is recorded.
        """
        if self._journal is not None:
            raise InputError(f"'{self._name}' is still being recorded; stop it first.")
        if obstacle := self.state().obstacle:
            raise InputError(obstacle)
        names = [camera.name for camera in self._cameras]
        name, self._journal, videos = begin_journal(
            self.path, task, name, author, self._devices, names
        )
        self._stopped, self._part = False, None
        self._name, self.begun = name, time.monotonic()
        for camera, video in zip(self._cameras, videos, strict=True):
            camera.record_to(self._journal, video)
        for reader in self._readers:
            reader.record_to(self._journal)
        return name

    @property
    def holding(self) -> bool:
        """Whether a recording runs, or has ended and is not kept yet."""
        return self._journal is not None

    def stop(self) -> SavedRecording:
        """End the recording and make a demonstration of it.

        Raises
        ------
        InputError
            If nothing is recorded, or it cannot be kept: stop again once that is mended, or
            discard it.
        """
        journal = self._ended()
        contents = journal.contents()
        try:
            kept = keep(self.path, contents)
        except PartialSaveError as error:
            self._part = error.part
            raise
        if self._part is not None and kept.added.status != "new":
            # It is this recording's own part: whoever does not want it may discard it still.
            kept = replace(kept, added=replace(kept.added, status="new"), heads=self._part.heads)
        self._forget(journal, contents)
        return kept

    def discard(self) -> None:
        """End the recording and keep nothing of it.

        Raises
        ------
        InputError
            If nothing is recorded, or a part of it is in the project and cannot be removed: it is
            still recorded then.
        """
        journal = self._ended()
        contents = journal.contents()
        if self._part is not None:
            discard(self.path, self._part)
            self._part = None
        self._forget(journal, contents)

    def _forget(self, journal: JournalWriter, contents: Contents) -> None:
        """Remove the files of a recording."""
        journal.close(delete=True)
        delete_videos(journal.path.parent, contents)
        self._journal = None

    def end(self) -> None:
        """End the recording; it is held until it is kept, by :meth:`stop`, or discarded.

        Raises
        ------
        InputError
            If nothing is recorded.
        """
        self._ended()

    def _ended(self) -> JournalWriter:
        """Nothing goes into the journal any more."""
        journal = self._journal
        if journal is None:
            raise InputError("Nothing is being recorded; start a recording first.")
        if not self._stopped:
            self._stopped = True
            for reader in self._readers:
                reader.record_to(None)
            for camera in self._cameras:
                camera.record_to(None, None)
            journal.finish()
        return journal

    def mark(self, action: str, down: bool, at: float | None = None) -> None:
        """Note that the key of an action went down or up, while something is recorded.

        Parameters
        ----------
        action : str
        down : bool
            Whether it went down.
        at : float, optional
            When, in seconds of the host's monotonic clock; now if left out.
        """
        if self._journal is not None and not self._stopped and action:
            at = time.monotonic() if at is None else at
            self._journal.note(Kind.MARK, at=at, action=action, down=down)

    def zero(self) -> None:
        """Let all devices take their present readings for zero."""
        for reader in self._readers:
            reader.zero()

    # Looking

    def state(self) -> RecorderState:
        """How it does now."""
        recording = self._journal is not None and not self._stopped
        return RecorderState(
            recording,
            self._name if recording else "",
            time.monotonic() - self.begun if recording else 0.0,
            self._journal.in_memory if self._journal is not None else 0,
            tuple(reader.state() for reader in self._readers),
            tuple(camera.state() for camera in self._cameras),
        )

    def latest(self, seconds: float) -> tuple[Window, ...]:
        """The last seconds of each device: number of the first sample, times (s), values.

        Times are those of the host's monotonic clock; see :class:`~forcelab.capture.reader.Ring`.
        """
        return tuple(reader.latest(seconds) for reader in self._readers)

    def since(self, device: int, number: int) -> Window:
        """All samples of a device from one on, counted since it was opened, as far as kept."""
        return self._readers[device].since(number)

    @property
    def firsts(self) -> tuple[int, ...]:
        """Number of each device's first sample of what is recorded, counted as :meth:`since`."""
        return tuple(reader.first for reader in self._readers)

    @property
    def ends(self) -> tuple[int | None, ...]:
        """Number of each device's first sample after what was recorded; None while it goes on."""
        return tuple(reader.end for reader in self._readers)

    @property
    def cameras(self) -> tuple[CameraReader, ...]:
        """The cameras, for their latest frames."""
        return tuple(self._cameras)

    def remarks(self) -> tuple[str, ...]:
        """What happened since the last time this was asked, a sentence each."""
        told = [sentence for reader in self._readers for sentence in reader.remarks()]
        told += [sentence for camera in self._cameras for sentence in camera.remarks()]
        return (*told, *(self._journal.remarks() if self._journal is not None else ()))
