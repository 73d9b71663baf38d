"""What the Capture workspace does, without how it looks: devices, recordings, marks.

Whatever takes longer than a blink (opening devices, gathering a recording) is a job. While one is
on, nobody else asks the recorder anything but for its latest samples.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Generator, Sequence
from enum import Enum, auto
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QObject, Qt, QTimer, Signal

from forcelab.errors import ForcelabError
from forcelab.gui.capture.connection import Connection, Left, recovering
from forcelab.gui.capture.marks import LiveMarks
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.vocabulary import Vocabulary

if TYPE_CHECKING:
    from forcelab.capture.keeping import Kept, Recovered
    from forcelab.capture.recorder import Recorder, RecorderState

__all__ = ["Phase", "Session"]

#: Milliseconds between two frames while it is looked at, and two looks at alarms while it is not.
FRAME_MS, HIDDEN_MS = 33, 500
#: Seconds between two looks at how the devices do.
STATE = 0.2
#: Sentences that are kept on the page.
SENTENCES = 3
#: The key of its jobs: one at a time.
JOB = "capture"


class Phase(Enum):
    """What it is doing."""

    APART = auto()
    CONNECTING = auto()
    READY = auto()
    COUNTING = auto()
    STARTING = auto()
    RECORDING = auto()
    STOPPING = auto()
    #: A recording has ended and could not be kept: stop again, or discard it.
    STUCK = auto()


#: Phases in which a job has the recorder.
WORKING = frozenset({Phase.CONNECTING, Phase.STARTING, Phase.STOPPING})


class Session(QObject):
    """Devices that are connected and what is recorded from them.

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
    marks : LiveMarks
        Of the recording that runs or ran last.
    task, name : str
        Of the next recording; without a name it gets the task and the next number.
    countdown : int
        Seconds before a recording.
    left : int
        Seconds that are left of a countdown.
    sentences : deque of (str, bool)
        What was said last, and whether it is trouble.
    left_behind : int
        Unfinished recordings of the project.
    """

    changed = Signal()
    ticked = Signal()
    said = Signal()
    kept = Signal()

    def __init__(self, document: Document, jobs: Jobs, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.document, self._jobs = document, jobs
        self.phase = Phase.APART
        self.state: RecorderState | None = None
        self.marks = LiveMarks()
        self.vocabulary = Vocabulary()
        self.task, self.name = "", ""
        self.countdown, self.left = 0, 0
        self.sentences: deque[tuple[str, bool]] = deque(maxlen=SENTENCES)
        self.left_behind = 0
        self.begun = 0.0
        self._connection = Connection()
        self._path: Path | None = None
        self._asked = 0.0
        self._timer = QTimer(self)
        self._timer.setTimerType(Qt.TimerType.PreciseTimer)
        self._timer.setInterval(HIDDEN_MS)
        self._timer.timeout.connect(self._tick)
        self._second = QTimer(self)
        self._second.setInterval(1000)
        self._second.timeout.connect(self._count)
        document.project_changed.connect(self._check_project)

    @property
    def _recorder(self) -> Recorder | None:
        """None while nothing is connected."""
        return self._connection.recorder

    @property
    def recording(self) -> bool:
        """Whether something is being recorded."""
        return self.phase is Phase.RECORDING

    @property
    def connected(self) -> bool:
        """Whether devices are open."""
        return self._recorder is not None and self.phase is not Phase.CONNECTING

    def set_looked_at(self, looked_at: bool) -> None:
        """Tell 30 times a second that there is something new, or only look after alarms."""
        self._timer.setInterval(FRAME_MS if looked_at else HIDDEN_MS)

    def set_task(self, task: str) -> None:
        """The next recordings are of a task; its actions can be marked."""
        self.task = task.strip()
        project = self.document.project
        self.vocabulary = Vocabulary() if project is None else project.vocabulary(self.task)
        self.changed.emit()

    def next_name(self) -> str:
        """What the next recording will be called; empty while there is no task."""
        from forcelab.capture.keeping import next_name

        project = self.document.project
        if self.name or project is None or not self.task:
            return self.name
        return next_name(project, self.task)

    # Devices

    def connect_to(self, devices: Sequence[str], cameras: Sequence[str]) -> None:
        """Open devices and cameras by their names."""
        project = self.document.project
        if self.phase is not Phase.APART or project is None:
            return
        if not devices:
            self.say(self.tr("Tick a device, or write one such as optoforce:/dev/ttyACM0."), True)
            return
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
        self._second.stop()
        self._work(Phase.STOPPING, self._connection.leaving(), self._left, lambda: Phase.APART)

    def zero(self) -> None:
        """Let all devices take their present readings for zero."""
        if self._recorder is not None and self.phase not in WORKING:
            self._recorder.zero()
            self.say(self.tr("The present readings are zero now."))

    def latest(self, seconds: float) -> tuple[Any, ...]:
        """The last seconds of each device, as of ``Recorder.latest``."""
        recorder = self._recorder
        return () if recorder is None or not self.connected else recorder.latest(seconds)

    def frame(self) -> tuple[float, Any] | None:
        """When the latest frame of the first camera arrived, and it (BGR)."""
        recorder = self._recorder
        cameras = () if recorder is None or not self.connected else recorder.cameras
        return cameras[0].latest() if cameras else None

    # Recordings

    def record_or_stop(self) -> None:
        """Record, after the countdown; or stop and keep what was recorded."""
        if self.phase is Phase.READY:
            if not (self.name or self.task):
                self.say(self.tr("A recording needs a task; write one."), True)
                return
            self.left = self.countdown
            if self.left:
                self._to(Phase.COUNTING)
                self._second.start()
            else:
                self._start()
        elif self.phase is Phase.COUNTING:
            self._second.stop()
            self._to(Phase.READY)
        elif self.phase in (Phase.RECORDING, Phase.STUCK):
            self.marks.end(time.monotonic())
            self._work(Phase.STOPPING, self._connection.stopping(), self._kept, lambda: Phase.STUCK)
        elif self.phase is Phase.APART:
            self.say(self.tr("Connect the devices before recording."), True)

    def discard(self) -> None:
        """End what is recorded and keep nothing of it."""
        if self.phase is Phase.COUNTING:
            self.record_or_stop()
        elif self.phase in (Phase.RECORDING, Phase.STUCK):
            self._work(
                Phase.STOPPING, self._connection.discarding(), self._discarded, lambda: Phase.STUCK
            )
        elif self.phase not in WORKING:
            self.say(self.tr("Nothing is being recorded."))

    def mark(self, action: str, down: bool) -> bool:
        """An action's key went down or up; gives whether that counts."""
        if not self.recording or self._recorder is None:
            return False
        self._recorder.mark(action, down)
        self.marks.press(action, down, time.monotonic())
        return True

    def look_for_unfinished(self) -> None:
        """Look for recordings that a crash ended."""
        from forcelab.capture.keeping import unfinished

        project = self.document.project
        self.left_behind = 0 if project is None else len(unfinished(project.path))
        self.changed.emit()

    def recover(self) -> None:
        """Make demonstrations of the unfinished recordings."""
        project = self.document.project
        if project is not None and self.phase in (Phase.APART, Phase.READY):
            after = self.phase
            self._work(
                Phase.STOPPING, recovering(project.path), self._recovered, lambda: after, after
            )

    def say(self, sentence: str, trouble: bool = False) -> None:
        """Say a sentence on the page and in the status line."""
        self.sentences.append((sentence, trouble))
        self.document.say(sentence, trouble)
        self.said.emit()

    def let_go(self) -> None:
        """Let go of everything: the window closes. What is being recorded is kept."""
        self._timer.stop()
        self._second.stop()
        self._connection.let_go()

    # When jobs are done

    def _connected(self, _: None) -> None:
        self.sentences.clear()
        self._to(Phase.READY)
        self.said.emit()
        self._timer.start()
        self._check_project()

    def _started(self, name: str) -> None:
        self.begun = time.monotonic()
        self.marks = LiveMarks()
        self._to(Phase.RECORDING)
        self.say(self.tr("Recording '{0}'.").format(name))
        self._check_project()

    def _kept(self, kept: Kept) -> None:
        self.name = ""
        self._to(Phase.READY)
        for remark in kept.remarks:
            self.say(remark)
        self.say(_kept_text(self, kept))
        self._reread()

    def _discarded(self, _: None) -> None:
        self.marks = LiveMarks()
        self._to(Phase.READY)
        self.say(self.tr("Discarded; nothing of it is kept."))
        self._check_project()

    def _left(self, left: Left) -> None:
        kept, trouble = left
        self._timer.stop()
        self.state = None
        self._to(Phase.APART)
        if trouble:
            self.say(trouble, True)
            self.look_for_unfinished()
        elif kept is not None:
            self.say(_kept_text(self, kept))
        self._reread()

    def _recovered(self, found: tuple[Recovered, ...]) -> None:
        for one in found:
            if one.kept is None:
                self.say(one.trouble, True)
            else:
                self.say(_kept_text(self, one.kept))
        self._reread()
        self.look_for_unfinished()

    def _reread(self) -> None:
        """Show what is new in the project."""
        self.document.reread()
        self.kept.emit()
        self._check_project()

    # Inside

    def _start(self) -> None:
        """Record from now on."""
        work = self._connection.starting(self.task, self.name, self.document.author)
        self._work(Phase.STARTING, work, self._started, lambda: Phase.READY)

    def _count(self) -> None:
        """A second of the countdown has passed."""
        self.left -= 1
        if self.left > 0:
            self.changed.emit()
            return
        self._second.stop()
        self._start()

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
                self.say(str(error), True)
            self._check_project()

        self._to(phase)
        self._jobs.run(work, finished, failed, key=JOB)

    def _to(self, phase: Phase) -> None:
        self.phase = phase
        self.changed.emit()

    def _tick(self) -> None:
        """Look how the devices do now and then, and tell that there are new samples."""
        now = time.monotonic()
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


def _kept_text(session: Session, kept: Kept) -> str:
    """What became of a recording, in a sentence."""
    text = session.tr("'{name}' is kept: {seconds:.1f} s, {samples} samples.")
    return text.format(
        name=kept.added.name, seconds=kept.seconds, samples=f"{kept.samples:,}".replace(",", " ")
    )
