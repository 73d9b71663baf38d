"""The recorder as background jobs use it.

One at a time, released whatever happens, with the recogniser that follows it.
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

from forcelab.capture.save import CAPTURES
from forcelab.errors import InputError

if TYPE_CHECKING:
    from forcelab.capture.device import Device
    from forcelab.capture.recorder import Recorder
    from forcelab.capture.save import RecoveredRecording, SavedRecording
    from forcelab.demonstration import Channel
    from forcelab.live.recognition import LiveRecognition, LiveSnapshot
    from forcelab.live.scalogram import LiveScalogram, RollingImage


log = logging.getLogger("forcelab")


#: Makes what follows the open devices of a recorder.
RecogniserLoader = Callable[["Recorder", "Sequence[Device]"], "LiveRecognition"]


class LiveTrack:
    """What is recognised while devices are connected, anew from the start of each recording.

    So that the track of a recording rests on nothing that is not in it, and can be computed again.
    """

    def __init__(self) -> None:
        self._live: LiveRecognition | None = None
        self._spare: LiveRecognition | None = None  # like it, and knows nothing yet
        self._paused = False
        self._trouble = ""  # why a recording has no track; what failed is asked nothing more

    @property
    def glimpse(self) -> LiveSnapshot | None:
        """What was recognised last, for any thread; None where nothing is."""
        live = self._live
        return None if live is None or self._trouble else live.glimpse

    def begin(
        self, live: LiveRecognition | None, *, keeping: bool, firsts: Sequence[int] | None = None
    ) -> None:
        """Recognise with this one from now on, or from the first samples of a recording.

        None ends it.
        """
        before, self._live, self._paused = self._live, live, False
        if before is None or live is None or not _same_channels(before, live):
            self._spare = None
        if live is not None:
            live.begin(keeping=keeping, after=before, firsts=firsts)

    def anew(self, *, keeping: bool, firsts: Sequence[int] | None = None) -> None:
        """Begin with another one that knows nothing yet, whatever became of the one before.

        Where that fails, there is no track.
        """
        self._trouble = ""
        try:
            self.begin(self.renewed(), keeping=keeping, firsts=firsts)
        except Exception as error:  # noqa: BLE001 - logged, and told with what is kept
            self.lose(error)

    def lose(self, error: Exception) -> None:
        """Recognise no more until all begins anew; of a recording that runs it is told why."""
        self._trouble = _error_message(error)

    def renewed(self) -> LiveRecognition | None:
        """Another one that knows nothing yet: the spare one where there is one."""
        spare, self._spare = self._spare, None
        if spare is not None or self._live is None:
            return spare
        return self._live.renewed()

    @property
    def lacking(self) -> LiveRecognition | None:
        """The one of which there is no spare yet.

        Making one takes longer than a person's finger on a key. Whoever does it in advance, with
        :meth:`~forcelab.live.recognition.LiveRecognition.renewed`, needs to hold nothing meanwhile.
        """
        return self._live if self._spare is None else None

    def spare(self, made: LiveRecognition) -> None:
        """Have one for the next recording; left alone if it is of another recogniser by now."""
        if self._live is not None and _same_channels(self._live, made):
            self._spare = made

    def look(self, wanted: bool) -> None:
        """Take in what came since, or let it pass where nobody looks and nothing is recorded."""
        if self._live is None or self._trouble:
            return
        if not wanted:
            self._paused = True
            return
        if self._paused:
            self.begin(self.renewed(), keeping=False)
        self._live.look()

    def finish(self) -> None:
        """The recording has ended: take in the last of it. What fails costs its track alone."""
        if self._live is None or self._trouble:
            return
        try:
            self._live.finish()
        except Exception as error:  # noqa: BLE001 - as above
            self.lose(error)

    def keep(self, path: Path, kept: SavedRecording) -> SavedRecording:
        """Keep the track with its demonstration; gives that with a sentence on it."""
        if self._trouble:
            return replace(kept, remarks=(*kept.remarks, self._trouble))
        if self._live is None:
            return kept
        try:
            figures = self._live.keep(path, kept)
        except Exception as error:  # noqa: BLE001 - as above
            return replace(kept, remarks=(*kept.remarks, _error_message(error)))
        one = "Recognised by '{author}': 1 segment, {share:.0f} % labelled."
        more = "Recognised by '{author}': {segments} segments, {share:.0f} % labelled."
        told = (one if figures["segments"] == 1 else more).format(
            author=figures["author"],
            segments=figures["segments"],
            share=100 * figures["labelled"],
        )
        return replace(kept, remarks=(*kept.remarks, told))


def _error_message(error: Exception) -> str:
    """What went wrong with a track; a fault of the program is in the log besides."""
    if isinstance(error, InputError):
        return str(error)
    log.error("A live track is lost.", exc_info=error)
    return "The recogniser failed ({fault}): the recording is kept without its track.".format(
        fault=f"{type(error).__name__}: {error}"
    )


def _same_channels(one: LiveRecognition, other: LiveRecognition) -> bool:
    """Whether two do the same."""
    return one.recogniser is other.recogniser and one.latency == other.latency


#: Seconds that closing the window waits for a recording that is being kept.
JOIN_TIMEOUT = 60.0
#: Seconds between two looks of whatever follows the devices.
BLOCK_SECONDS = 0.02
#: Seconds between two pictures of a scalogram.
FRAME_INTERVAL = 0.04

#: What became of a recording that ran when its devices were let go: what was kept, or why not.
UnfinishedRecording = tuple["SavedRecording | None", str]
#: Makes what draws a scalogram of the open devices of a recorder.
LiveData = Callable[["Recorder", "Sequence[Device]"], "LiveScalogram"]


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
        from forcelab.capture.device_names import parse_devices
        from forcelab.capture.recorder import Recorder

        yield
        with self._lock:
            if self._gone:  # the window was closed meanwhile
                return
            devices = parse_devices(names)
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

    def leaving(self) -> Generator[None, None, UnfinishedRecording]:
        """Let go of the devices; what is being recorded is kept."""
        yield
        with self._lock:
            return self._leave()

    def recognising(
        self, made: RecogniserLoader, watched: Callable[[], bool]
    ) -> Generator[None, None, None]:
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
                time.sleep(BLOCK_SECONDS)
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

    def drawing(self, made: LiveData) -> Generator[RollingImage | None, None, None]:
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
            time.sleep(FRAME_INTERVAL)

    def let_go(self) -> str:
        """Let go at once, and for good: the window closes. Gives why a recording was not kept."""
        self._gone = True
        if not self._lock.acquire(timeout=JOIN_TIMEOUT):
            return ""  # what is on the disk is offered the next time
        try:
            return self._leave()[1]
        finally:
            self._lock.release()

    def _leave(self) -> UnfinishedRecording:
        """Keep what is being recorded and close the devices, holding the lock."""
        recorder, self.recorder = self.recorder, None
        self._recording = False
        return (None, "") if recorder is None else _keep_and_close(recorder, self.track)

    @property
    def has_recording(self) -> bool:
        """Whether a recording runs, or has ended and is not kept yet."""
        return self.recorder is not None and self.recorder.has_recording

    @contextmanager
    def _ending(self) -> Iterator[None]:
        """A recording ends, unless it cannot be kept; then all is for the eye alone."""
        try:
            yield
        finally:
            if not self.has_recording:
                self._recording = False
                self.track.anew(keeping=False)

    def _open(self) -> Recorder:
        """The recorder, in a job."""
        if self.recorder is None:
            raise InputError("The devices were let go of; connect them again.")
        return self.recorder


def recovering(path: Path) -> Generator[None, None, tuple[RecoveredRecording, ...]]:
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


def _keep_and_close(recorder: Recorder, track: LiveTrack) -> UnfinishedRecording:
    """Keep what is being recorded and let go of the devices."""
    kept, trouble = None, ""
    try:
        if recorder.has_recording:
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
