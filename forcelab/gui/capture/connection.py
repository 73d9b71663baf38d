"""The recorder in the hands of jobs: one at a time, and let go of whatever happens."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from forcelab.capture.save import CAPTURES
from forcelab.errors import InputError
from forcelab.gui.capture.live_track import LiveTrack, Making

if TYPE_CHECKING:
    from forcelab.capture.device import Device
    from forcelab.capture.recorder import Recorder
    from forcelab.capture.save import Recovered, SavedRecording
    from forcelab.demonstration import Channel
    from forcelab.live.scalogram import LiveScalogram, RollingImage

log = logging.getLogger("forcelab")

__all__ = ["Connection", "Left", "discarding_kept", "recovering"]

#: Seconds that closing the window waits for a recording that is being kept.
PATIENCE = 60.0
#: Seconds between two looks of whatever follows the devices.
BLOCK = 0.02
#: Seconds between two pictures of a scalogram.
PICTURE = 0.04

#: What became of a recording that ran when its devices were let go: what was kept, or why not.
Left = tuple["SavedRecording | None", str]
#: Makes what draws a scalogram of the open devices of a recorder.
Drawing = Callable[["Recorder", "Sequence[Device]"], "LiveScalogram"]


class Connection:
    """Opens devices, records and lets go, each as a generator for :class:`~forcelab.gui.jobs.Jobs`.

    Attributes
    ----------
    recorder : Recorder or None
        Open; None while nothing is connected.
    track : LiveTrack
        What is recognised meanwhile.
    """

    def __init__(self) -> None:
        self.recorder: Recorder | None = None
        self.track = LiveTrack()
        self._devices: Sequence[Device] = ()
        self._recording = False
        self._lock = threading.Lock()  # who has it may use the recorder
        self._gone = False

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Of all open devices, as a demonstration of them has them; none while none is open."""
        from forcelab.capture.assemble import channels_of_all

        devices = () if self.recorder is None else self._devices
        return channels_of_all([device.channels for device in devices])

    def connecting(
        self, path: Path, names: tuple[str, ...], cameras: tuple[str, ...]
    ) -> Generator[None, None, None]:
        """Open devices and cameras for a project."""
        from forcelab.capture.camera import open_cameras
        from forcelab.capture.devices import devices_named
        from forcelab.capture.recorder import Recorder

        yield
        with self._lock:
            if self._gone:  # the window was closed meanwhile
                return
            devices = devices_named(names)
            recorder = Recorder(path, devices, open_cameras(cameras))
            recorder.open()
            self.recorder, self._devices = recorder, devices

    def starting(self, task: str, name: str, author: str) -> Generator[None, None, str]:
        """Record from now on; gives the demonstration's name."""
        yield
        with self._lock:
            recorder = self._open()
            given = recorder.start(task, name or None, author)
            self._recording = True
            self.track.anew(keeping=True, firsts=recorder.firsts)
            return given

    def stopping(self) -> Generator[None, None, SavedRecording]:
        """Make a demonstration of what was recorded."""
        yield
        with self._lock, self._ending():
            return _stopped(self._open(), self.track)

    def discarding(self) -> Generator[None, None, None]:
        """Keep nothing of what was recorded."""
        yield
        with self._lock, self._ending():
            self._open().discard()

    def leaving(self) -> Generator[None, None, Left]:
        """Let go of the devices; what is being recorded is kept."""
        yield
        with self._lock:
            return self._leave()

    def recognising(self, made: Making, watched: Callable[[], bool]) -> Generator[None, None, None]:
        """Recognise what comes until the devices are let go of.

        Parameters
        ----------
        made : callable
            Makes what recognises, of the open recorder and its devices.
        watched : callable
            Whether anybody looks; if not, only a recording is recognised. Asked in the thread.
        """
        yield
        with self._lock:
            if self.recorder is None:
                return
            live = made(self.recorder, self._devices)
            self.track.begin(live, keeping=self._recording)
        try:
            while self.recorder is not None:
                yield
                time.sleep(BLOCK)
                with self._lock:
                    if self.recorder is not None:
                        self.track.look(self._recording or watched())
                # Whoever presses Record waits for nothing, and a recording is not disturbed.
                lacking = None if self._recording else self.track.lacking
                if lacking is not None:
                    made_ready = lacking.renewed()
                    with self._lock:
                        self.track.spare(made_ready)
        except Exception as error:
            with self._lock:
                self.track.lose(error)
            raise
        finally:
            with self._lock:
                self.track.begin(None, keeping=False)

    def drawing(self, made: Drawing) -> Generator[RollingImage | None, None, None]:
        """Have a scalogram grow until the devices are let go of; yields the newest picture.

        Parameters
        ----------
        made : callable
            Makes it, of the open recorder and its devices.
        """
        yield None
        recorder = self.recorder
        if recorder is None:
            return
        live = made(recorder, self._devices)
        begun = False
        while True:
            with self._lock:
                if self.recorder is not recorder:
                    return
                if not begun:
                    live.begin()
                    begun = True
                found = live.read()
            for _ in live.take(*found):  # others may ask the recorder meanwhile
                yield live.strip
            yield live.strip
            time.sleep(PICTURE)

    def let_go(self) -> str:
        """Let go at once, and for good: the window closes. Gives why a recording was not kept."""
        self._gone = True
        if not self._lock.acquire(timeout=PATIENCE):
            return ""  # what is on the disk is offered the next time
        try:
            return self._leave()[1]
        finally:
            self._lock.release()

    def _leave(self) -> Left:
        """Keep what is being recorded and close the devices, holding the lock."""
        recorder, self.recorder = self.recorder, None
        self._recording = False
        return (None, "") if recorder is None else _keep_and_close(recorder, self.track)

    @property
    def holding(self) -> bool:
        """Whether a recording runs, or has ended and is not kept yet."""
        return self.recorder is not None and self.recorder.holding

    @contextmanager
    def _ending(self) -> Iterator[None]:
        """A recording ends, unless it cannot be kept; then all is for the eye alone."""
        try:
            yield
        finally:
            if not self.holding:
                self._recording = False
                self.track.anew(keeping=False)

    def _open(self) -> Recorder:
        """The recorder, in a job."""
        if self.recorder is None:
            raise InputError("The devices were let go of; connect them again.")
        return self.recorder


def recovering(path: Path) -> Generator[None, None, tuple[Recovered, ...]]:
    """Make demonstrations of the unfinished recordings of a project."""
    from forcelab.capture.save import recover

    yield
    return recover(path)


def discarding_kept(path: Path, kept: SavedRecording) -> Generator[None, None, str]:
    """Remove a recording that was kept; gives its name."""
    from forcelab.capture.save import discard

    yield
    discard(path, kept)
    return kept.added.name


def _stopped(recorder: Recorder, track: LiveTrack) -> SavedRecording:
    """End a recording and keep it, with what was recognised of it up to its last sample."""
    recorder.end()
    track.finish()
    return track.keep(recorder.path, recorder.stop())


def _keep_and_close(recorder: Recorder, track: LiveTrack) -> Left:
    """Keep what is being recorded and let go of the devices."""
    kept, trouble = None, ""
    try:
        if recorder.holding:
            kept = _stopped(recorder, track)
    except Exception as error:  # its journal stays, and is offered the next time
        trouble = str(error)
        if not isinstance(error, InputError):
            log.error("A recording was not kept.", exc_info=error)
            trouble = f"{type(error).__name__}: {error}"
    finally:
        recorder.close()
    if trouble and recorder.saved is not None:
        trouble = (
            f"{trouble} All of the recording is in '{recorder.saved}'; when that is mended, move "
            f"it to '{recorder.path / CAPTURES}': the Capture workspace offers it then."
        )
    return kept, trouble
