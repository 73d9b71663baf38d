"""Devices that are connected, without how they look, and the jobs that have them.

Whatever takes longer than a blink (opening devices, gathering a recording) is a job. While one is
on, nobody else asks the recorder anything but for its latest samples.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Generator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QObject, Qt, QTimer, Signal

from forcelab.capture.discovery import LOOK
from forcelab.errors import ForcelabError
from forcelab.gui.capture.connection import Connection, Drawing, Left
from forcelab.gui.capture.phase import WORKING, Phase
from forcelab.gui.capture.recognising import Recognising
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs

if TYPE_CHECKING:
    from forcelab.capture.reader import RecorderState
    from forcelab.capture.recorder import Recorder
    from forcelab.demonstration import Channel
    from forcelab.live.scalogram import RollingImage

__all__ = ["Attached"]

#: Milliseconds between two frames while it is looked at, and two looks at alarms while it is not.
FRAME_MS, HIDDEN_MS = 33, 500
#: Seconds between two looks at how the devices do.
STATE = 0.2
#: Sentences that are kept on the page.
SENTENCES = 3
#: The key of its jobs: one at a time.
JOB = "capture"


class Attached(QObject):
    """Devices that are connected, and what is computed of them while they are.

    Parameters
    ----------
    document : Document
    jobs : Jobs
    parent : QObject, optional

    Attributes
    ----------
    phase : Phase
    state : RecorderState or None
        As it was asked last; None while nothing is connected.
    sentences : deque of (str, bool)
        What was said last, and whether it is trouble.
    recognising : Recognising
        A recogniser on what comes.
    now : float
        When it was last told that there is something new, on the host's monotonic clock.
    """

    changed = Signal()
    ticked = Signal()
    said = Signal()

    def __init__(self, document: Document, jobs: Jobs, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.document, self._jobs = document, jobs
        self.phase = Phase.APART
        self.state: RecorderState | None = None
        self.sentences: deque[tuple[str, bool]] = deque(maxlen=SENTENCES)
        self.now = 0.0
        self._connection = Connection()
        self.recognising = Recognising(self._connection, document, jobs, self)
        self.changed.connect(lambda: self.recognising.follow(self.connected))
        self._path: Path | None = None
        self._asked = 0.0
        self._timer = QTimer(self)
        self._timer.setTimerType(Qt.TimerType.PreciseTimer)
        self._timer.setInterval(HIDDEN_MS)
        self._timer.timeout.connect(self._tick)
        document.project_changed.connect(self._check_project)

    @property
    def _recorder(self) -> Recorder | None:
        """None while nothing is connected."""
        return self._connection.recorder

    @property
    def connected(self) -> bool:
        """Whether devices are open."""
        return self._recorder is not None and self.phase is not Phase.CONNECTING

    def set_looked_at(self, looked_at: bool) -> None:
        """Tell 30 times a second that there is something new, or only look after alarms."""
        self._timer.setInterval(FRAME_MS if looked_at else HIDDEN_MS)
        self.recognising.watched = looked_at

    def connect_to(self, devices: Sequence[str], cameras: Sequence[str]) -> None:
        """Open devices and cameras by their names."""
        project = self.document.project
        if self.phase is not Phase.APART or project is None:
            return
        if not devices:
            self.say("Tick a device, or write one such as optoforce:/dev/ttyACM0.", True)
            return
        self.unsay()
        self._path = project.path
        self._work(
            Phase.CONNECTING,
            self._connection.connecting(project.path, tuple(devices), tuple(cameras)),
            self._connected,
            lambda: Phase.APART,
        )

    def disconnect_all(self) -> None:
        """Let go of the devices; a recording that runs is kept."""
        if self._recorder is None or self.phase in WORKING:
            return
        holds = self.phase in (Phase.RECORDING, Phase.STUCK)
        phase = Phase.KEEPING if holds else Phase.LEAVING
        self._work(phase, self._connection.leaving(), self._left, lambda: Phase.APART)

    def zero(self) -> None:
        """Let all devices take their present readings for zero."""
        if self._recorder is not None and self.phase not in WORKING:
            self._recorder.zero()
            self.say("The present readings are zero now.")

    def latest(self, seconds: float) -> tuple[Any, ...]:
        """The last seconds of each device, as of ``Recorder.latest``."""
        recorder = self._recorder
        return () if recorder is None or not self.connected else recorder.latest(seconds)

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Of all devices that are connected."""
        return self._connection.channels if self.connected else ()

    def drawing(self, made: Drawing) -> Generator[RollingImage | None, None, None]:
        """A job that draws a scalogram, see :meth:`Connection.drawing`."""
        return self._connection.drawing(made)

    def frame(self) -> tuple[float, Any] | None:
        """When the latest frame of the first camera arrived, and it (BGR)."""
        recorder = self._recorder
        cameras = () if recorder is None or not self.connected else recorder.cameras
        return cameras[0].latest() if cameras else None

    def say(self, sentence: str, trouble: bool = False) -> None:
        """Say a sentence on the page and in the status line."""
        sentence = sentence.replace(LOOK, "press Look again")
        self.sentences.append((sentence, trouble))
        self.document.say(sentence, trouble)
        self.said.emit()

    def unsay(self) -> None:
        """Nothing that was said before counts any more: something is tried anew."""
        self.sentences.clear()
        self.said.emit()

    def let_go(self) -> str:
        """Let go of everything: the window closes. What is being recorded is kept, or why not."""
        self._timer.stop()
        return self._connection.let_go()

    # Inside

    def _connected(self, _: None) -> None:
        self.sentences.clear()
        self.now = time.monotonic()
        self._to(Phase.READY)
        self.said.emit()
        self._timer.start()
        self._check_project()

    def _left(self, left: Left) -> None:
        """The devices are let go of; `left` is what became of a recording that ran."""
        self._timer.stop()
        self.state = None
        self._to(Phase.APART)

    def _work(
        self,
        phase: Phase,
        work: Generator[Any, None, Any],
        done: Callable[[Any], object],
        otherwise: Callable[[], Phase],
        after: Phase | None = None,
    ) -> None:
        """Let a job have the recorder."""

        def finished(result: Any) -> None:
            if after is not None:
                self._to(after)
            done(result)

        def failed(error: Exception) -> None:
            self._to(otherwise())
            if isinstance(error, ForcelabError):
                self.say(self._told(error), True)
            self._check_project()

        self._to(phase)
        self._jobs.run(work, finished, failed, key=JOB)

    def _told(self, error: ForcelabError) -> str:
        """What is said of a job that failed, in the phase that it left behind."""
        return str(error)

    def _to(self, phase: Phase) -> None:
        self.phase = phase
        self.changed.emit()

    def _tick(self) -> None:
        """Look how the devices do now and then, and tell that there are new samples."""
        self.now = now = time.monotonic()
        recorder = self._recorder
        if recorder is not None and self.phase not in WORKING and now - self._asked >= STATE:
            self._asked = now
            self.state = recorder.state()
            for sentence in recorder.remarks():
                self.say(sentence)
        self.ticked.emit()

    def _check_project(self) -> None:
        """What is recorded goes into the project in which it began: leave that with it."""
        project = self.document.project
        if self._recorder is not None and (project is None or project.path != self._path):
            self.disconnect_all()
