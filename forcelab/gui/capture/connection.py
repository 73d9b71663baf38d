"""The recorder as background jobs use it, and the recogniser that follows it.

One job at a time has the recorder, which is released whatever happens.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from forcelab.capture.align import channels_of_all
from forcelab.capture.save import CAPTURES, discard, recover
from forcelab.errors import InputError

if TYPE_CHECKING:
    from forcelab.capture.recorder import Recorder
    from forcelab.capture.save import RecoveredRecording, SavedRecording
    from forcelab.demonstration import Channel
    from forcelab.live.recognition import LiveRecognition, LiveSnapshot
    from forcelab.live.scalogram import LiveScalogram, RollingImage


log = logging.getLogger("forcelab")

#: Seconds that closing the window waits for a recording that is being kept.
JOIN_TIMEOUT = 60.0
#: Seconds between two looks of whatever follows the devices.
BLOCK_SECONDS = 0.02
#: Seconds between two pictures of a scalogram.
FRAME_INTERVAL = 0.2

#: What became of a recording that ran when its devices were released: what was kept, or why not.
UnfinishedRecording = tuple["SavedRecording | None", str]
#: Make what follows the open devices of a recorder.
RecogniserFactory = Callable[["Recorder"], "LiveRecognition"]
ScalogramFactory = Callable[["Recorder"], "LiveScalogram"]


class LiveTrack:
    """What is recognised while devices are connected.

    It begins anew with each recording, so that the track of a recording depends on nothing that is
    not in it, and can be computed again.
    """

    def __init__(self) -> None:
        self._live: LiveRecognition | None = None
        self._spare: LiveRecognition | None = None  # like it, and knows nothing yet
        self._paused = False
        self._problem = ""  # why a recording has no track; what failed is asked nothing more

    @property
    def snapshot(self) -> LiveSnapshot | None:
        """What was recognised last, for any thread; None where nothing is."""
        live = self._live
        return None if live is None or self._problem else live.snapshot

    def begin(
        self, live: LiveRecognition | None, *, keeping: bool, firsts: Sequence[int] | None = None
    ) -> None:
        """Recognise from now on, or from the first samples of a recording.

        None ends it.
        """
        before, self._live, self._paused = self._live, live, False
        if before is None or live is None or not _are_alike(before, live):
            self._spare = None
        if live is not None:
            live.begin(keeping=keeping, after=before, firsts=firsts)

    def restart(self, *, keeping: bool, firsts: Sequence[int] | None = None) -> None:
        """Begin again with a recogniser in its initial state, whatever became of the one before.

        Where that fails, there is no track.
        """
        self._problem = ""
        try:
            self.begin(self.take_fresh(), keeping=keeping, firsts=firsts)
        except Exception as error:  # noqa: BLE001 - logged, and reported with what is kept
            self.fail(error)

    def fail(self, error: Exception) -> None:
        """Recognise no more until all begins anew; a recording that runs says why."""
        # Whatever has failed has loaded it.
        from forcelab.live.recognition import lost_track_sentence

        self._problem = lost_track_sentence(error)

    def take_fresh(self) -> LiveRecognition | None:
        """A recogniser in its initial state: the spare one where there is one."""
        spare, self._spare = self._spare, None
        if spare is not None or self._live is None:
            return spare
        return self._live.renewed()

    @property
    def without_spare(self) -> LiveRecognition | None:
        """The recogniser, as long as there is no spare one like it.

        Making one takes longer than a person's finger on a key. Whatever does it in advance, with
        :meth:`~forcelab.live.recognition.LiveRecognition.renewed`, needs to hold nothing meanwhile.
        """
        return self._live if self._spare is None else None

    def set_spare(self, spare: LiveRecognition) -> None:
        """Keep a spare for the next recording, unless another recogniser is used by now."""
        if self._live is not None and _are_alike(self._live, spare):
            self._spare = spare

    def update(self, needed: bool) -> None:
        """Take in what came since, or let it pass where it is not seen and nothing is recorded."""
        if self._live is None or self._problem:
            return
        if not needed:
            self._paused = True
            return
        if self._paused:
            self.begin(self.take_fresh(), keeping=False)
        self._live.look()

    def finish(self) -> None:
        """The recording has ended: take in the last of it. What fails costs its track alone."""
        if self._live is None or self._problem:
            return
        try:
            self._live.finish()
        except Exception as error:  # noqa: BLE001 - as above
            self.fail(error)

    def save(self, path: Path, recording: SavedRecording) -> SavedRecording:
        """Keep the track with its demonstration; gives that with a sentence on it."""
        if self._problem:
            return replace(recording, remarks=(*recording.remarks, self._problem))
        if self._live is None:
            return recording
        from forcelab.live.recognition import lost_track_sentence, track_summary  # as above

        try:
            remark = f"{track_summary(self._live.keep(path, recording))}."
        except Exception as error:  # noqa: BLE001 - as above
            remark = lost_track_sentence(error)
        return replace(recording, remarks=(*recording.remarks, remark))


def _are_alike(first: LiveRecognition, second: LiveRecognition) -> bool:
    """Whether two have the same recogniser and latency."""
    return first.recogniser is second.recogniser and first.latency == second.latency


class Connection:
    """Opens devices, records and releases, each as a job of :class:`~forcelab.gui.jobs.Jobs`."""

    def __init__(self) -> None:
        #: Open; None while nothing is connected.
        self.recorder: Recorder | None = None
        #: What is recognised meanwhile.
        self.track = LiveTrack()
        self._recording = False
        self._lock = threading.Lock()  # held by whatever uses the recorder
        self._released = False

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The channels that a demonstration of all open devices has; none while none is open."""
        devices = () if self.recorder is None else self.recorder.devices
        return channels_of_all([device.channels for device in devices])

    def open_devices(
        self, path: Path, names: tuple[str, ...], cameras: tuple[str, ...]
    ) -> Generator[None, None, None]:
        """Open devices and cameras for a project."""
        # A window that records nothing does not load what talks to devices.
        from forcelab.capture.camera import open_cameras
        from forcelab.capture.device_names import parse_devices
        from forcelab.capture.recorder import Recorder

        yield
        with self._lock:
            if self._released:  # the window was closed meanwhile
                return
            recorder = Recorder(path, parse_devices(names), open_cameras(cameras))
            recorder.open()
            self.recorder = recorder

    def start_recording(self, task: str, name: str, author: str) -> Generator[None, None, str]:
        """Record from now on; gives the demonstration's name."""
        yield
        with self._lock:
            recorder = self._open_recorder()
            name = recorder.start(task, name or None, author)
            self._recording = True
            self.track.restart(keeping=True, firsts=recorder.firsts)
            return name

    def stop_recording(self) -> Generator[None, None, SavedRecording]:
        """Make a demonstration of what was recorded."""
        yield
        with self._lock, self._ending():
            return _stop(self._open_recorder(), self.track)

    def discard_recording(self) -> Generator[None, None, None]:
        """Keep nothing of what was recorded."""
        yield
        with self._lock, self._ending():
            self._open_recorder().discard()

    def close_devices(self) -> Generator[None, None, UnfinishedRecording]:
        """Release the devices; what is being recorded is kept."""
        yield
        with self._lock:
            return self._close()

    def recognise(
        self, create: RecogniserFactory, is_visible: Callable[[], bool]
    ) -> Generator[None, None, None]:
        """Recognise what comes until the devices are released.

        While it is not visible, as asked in the thread, only a recording is recognised.
        """
        yield
        with self._lock:
            if self.recorder is None:
                return
            live = create(self.recorder)
            self.track.begin(live, keeping=self._recording)
        try:
            while self.recorder is not None:
                yield
                time.sleep(BLOCK_SECONDS)
                with self._lock:
                    if self.recorder is not None:
                        self.track.update(self._recording or is_visible())
                # Whoever presses Record waits for nothing, and a recording is not disturbed.
                without_spare = None if self._recording else self.track.without_spare
                if without_spare is not None:
                    spare = without_spare.renewed()
                    with self._lock:
                        self.track.set_spare(spare)
        except Exception as error:
            with self._lock:
                self.track.fail(error)
            raise
        finally:
            with self._lock:
                self.track.begin(None, keeping=False)

    def draw_scalogram(
        self, create: ScalogramFactory
    ) -> Generator[RollingImage | None, None, None]:
        """Redraw a scalogram until the devices are released; yields the newest picture."""
        yield None
        recorder = self.recorder
        if recorder is None:
            return
        live = create(recorder)
        begun = False
        while True:
            with self._lock:
                if self.recorder is not recorder:
                    return
                if not begun:
                    live.begin()
                    begun = True
                samples = live.read()
            for _ in live.take(*samples):  # others may ask the recorder meanwhile
                yield live.image
            yield live.image
            time.sleep(FRAME_INTERVAL)

    def release(self) -> str:
        """Release all at once, and for good: the window closes. Gives why no recording was kept."""
        self._released = True
        if not self._lock.acquire(timeout=JOIN_TIMEOUT):
            return ""  # what is on the disk is offered the next time
        try:
            return self._close()[1]
        finally:
            self._lock.release()

    @property
    def has_recording(self) -> bool:
        """Whether a recording runs, or has ended and is not kept yet."""
        return self.recorder is not None and self.recorder.has_recording

    def _close(self) -> UnfinishedRecording:
        """Keep what is being recorded and close the devices, holding the lock."""
        recorder, self.recorder = self.recorder, None
        self._recording = False
        if recorder is None:
            return None, ""
        recording, problem = None, ""
        try:
            if recorder.has_recording:
                recording = _stop(recorder, self.track)
        except Exception as error:  # its journal stays, and is offered the next time
            problem = str(error)
            if not isinstance(error, InputError):
                log.error("A recording was not kept.", exc_info=error)
                problem = f"{type(error).__name__}: {error}"
        finally:
            recorder.close()
        if problem and recorder.saved is not None:
            problem = (
                f"{problem} All of the recording is in '{recorder.saved}'; when that is mended, "
                f"move it to '{recorder.path / CAPTURES}': the Capture workspace offers it then."
            )
        return recording, problem

    @contextmanager
    def _ending(self) -> Iterator[None]:
        """A recording ends, unless it cannot be kept; then all is for the eye alone."""
        try:
            yield
        finally:
            if not self.has_recording:
                self._recording = False
                self.track.restart(keeping=False)

    def _open_recorder(self) -> Recorder:
        if self.recorder is None:
            raise InputError("The devices were disconnected; connect them again.")
        return self.recorder


def _stop(recorder: Recorder, track: LiveTrack) -> SavedRecording:
    """End a recording and keep it, with what was recognised of it up to its last sample."""
    recorder.end()
    track.finish()
    return track.save(recorder.path, recorder.stop())


def recover_recordings(path: Path) -> Generator[None, None, tuple[RecoveredRecording, ...]]:
    """Make demonstrations of the unfinished recordings of a project."""
    yield
    return recover(path)


def discard_recording(path: Path, recording: SavedRecording) -> Generator[None, None, str]:
    """Remove a recording that was kept; gives its name."""
    yield
    discard(path, recording)
    return recording.added.name
