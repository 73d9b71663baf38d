"""The Capture workspace without its view: devices, recordings and marks.

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

from forcelab.capture.assemble import LiveMarks
from forcelab.capture.discovery import LOOK
from forcelab.errors import ForcelabError
from forcelab.gui.capture.connection import (
    Connection,
    LiveData,
    UnfinishedRecording,
    discarding_kept,
    recovering,
)
from forcelab.gui.capture.live_model import LiveModelController
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.shortcuts import keys
from forcelab.gui.text import thousands
from forcelab.vocabulary import Vocabulary

if TYPE_CHECKING:
    from forcelab.capture.reader import RecorderState
    from forcelab.capture.recorder import Recorder
    from forcelab.capture.save import Recovered, SavedRecording
    from forcelab.demonstration import Channel
    from forcelab.live.scalogram import RollingImage


class CaptureState(Enum):
    """What it is doing."""

    APART = auto()
    CONNECTING = auto()
    READY = auto()
    COUNTING = auto()
    STARTING = auto()
    RECORDING = auto()
    KEEPING = auto()
    DISCARDING = auto()
    RECOVERING = auto()
    #: Devices are let go of while nothing is recorded.
    LEAVING = auto()
    #: A recording has ended and could not be kept: stop again, or discard it.
    STUCK = auto()


#: Phases in which a job has the recorder.
BUSY_STATES = frozenset(
    {
        CaptureState.CONNECTING,
        CaptureState.STARTING,
        CaptureState.KEEPING,
        CaptureState.DISCARDING,
        CaptureState.RECOVERING,
        CaptureState.LEAVING,
    }
)


#: Milliseconds within which it must be asked for a second time.
CONFIRM_MS = 6000


class LastRecording(QObject):
    """What was kept last, and whether it was asked to be discarded.

    Asking twice keeps the hands on the keys, where a dialog would ask for the mouse.

    Parameters
    ----------
    parent : QObject, optional

    Attributes
    ----------
    kept : Kept or None
    path : Path or None
        The folder of the project that it is in.
    """

    changed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.kept: SavedRecording | None = None
        self.path: Path | None = None
        self._patience = QTimer(self)
        self._patience.setSingleShot(True)
        self._patience.setInterval(CONFIRM_MS)
        self._patience.timeout.connect(self.changed)

    @property
    def asked(self) -> bool:
        """Whether it was asked for once, a moment ago."""
        return self._patience.isActive()

    def take(self, kept: SavedRecording, path: Path | None) -> None:
        """Remember what was kept just now."""
        self.forget()
        if kept.added.status == "new":
            self.kept, self.path = kept, path
        self.changed.emit()

    def forget(self) -> None:
        """There is nothing to discard any more."""
        self._patience.stop()
        there, self.kept, self.path = self.kept is not None, None, None
        if there:
            self.changed.emit()

    def asked_twice(self) -> bool:
        """Ask for it to be discarded; gives whether that was the second time."""
        if self._patience.isActive():
            self._patience.stop()
            return True
        self._patience.start()
        self.changed.emit()
        return False


#: Milliseconds between two frames while it is looked at, and two looks at alarms while it is not.
FRAME_MS, HIDDEN_MS = 33, 500
#: Seconds between two looks at how the devices do.
STATE = 0.2
#: Sentences that are kept on the page.
SENTENCES = 3
#: The key of its jobs: one at a time.
JOB = "capture"


class CaptureController(QObject):
    """Devices that are connected, and what is recorded from them.

    Parameters
    ----------
    document : Document
    jobs : Jobs
    parent : QObject, optional

    Attributes
    ----------
    phase : CaptureState
    state : RecorderState or None
        As it was asked last; None while nothing is connected.
    sentences : deque of (str, bool)
        What was said last, and whether it is trouble.
    recognising : LiveModelController
        A recogniser on what comes.
    now : float
        When it was last told that there is something new, on the host's monotonic clock.
    marks : LiveMarks
        Of the recording that runs or ran last.
    task, name : str
        Of the next recording; without a name it gets the task and the next number.
    countdown : int
        Seconds before a recording.
    left : int
        Seconds that are left of a countdown.
    left_behind : int
        Unfinished recordings of the project.
    last : LastRecording
        The recording that was kept last, as long as it can be discarded.
    """

    changed = Signal()

    ticked = Signal()

    said = Signal()

    kept = Signal()

    def __init__(self, document: Document, jobs: Jobs, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.document, self._jobs = document, jobs
        self.phase = CaptureState.APART
        self.state: RecorderState | None = None
        self.sentences: deque[tuple[str, bool]] = deque(maxlen=SENTENCES)
        self.now = 0.0
        self._connection = Connection()
        self.recognising = LiveModelController(self._connection, document, jobs, self)
        self.changed.connect(lambda: self.recognising.follow(self.connected))
        self._path: Path | None = None
        self._asked = 0.0
        self._timer = QTimer(self)
        self._timer.setTimerType(Qt.TimerType.PreciseTimer)
        self._timer.setInterval(HIDDEN_MS)
        self._timer.timeout.connect(self._tick)
        document.project_changed.connect(self._check_project)
        self.marks = LiveMarks()
        self.vocabulary = Vocabulary()
        self.task, self.name = "", ""
        self.countdown, self.left = 0, 0
        self.left_behind = 0
        self.begun, self._recorded = 0.0, ""
        self.last = LastRecording(self)
        self.last.changed.connect(self.changed)
        self._second = QTimer(self)
        self._second.setInterval(1000)
        self._second.timeout.connect(self._count)

    @property
    def _recorder(self) -> Recorder | None:
        """None while nothing is connected."""
        return self._connection.recorder

    @property
    def connected(self) -> bool:
        """Whether devices are open."""
        return self._recorder is not None and self.phase is not CaptureState.CONNECTING

    def set_looked_at(self, looked_at: bool) -> None:
        """Tell 30 times a second that there is something new, or only look after alarms."""
        self._timer.setInterval(FRAME_MS if looked_at else HIDDEN_MS)
        self.recognising.watched = looked_at

    def connect_to(self, devices: Sequence[str], cameras: Sequence[str]) -> None:
        """Open devices and cameras by their names."""
        project = self.document.project
        if self.phase is not CaptureState.APART or project is None:
            return
        if not devices:
            self.say("Select a device, or write one such as optoforce:/dev/ttyACM0.", True)
            return
        self.unsay()
        self._path = project.path
        self._work(
            CaptureState.CONNECTING,
            self._connection.connecting(project.path, tuple(devices), tuple(cameras)),
            self._connected,
            lambda: CaptureState.APART,
        )

    def zero(self) -> None:
        """Let all devices take their present readings for zero."""
        if self._recorder is not None and self.phase not in BUSY_STATES:
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

    def drawing(self, made: LiveData) -> Generator[RollingImage | None, None, None]:
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
        self.document.show_message(sentence, trouble)
        self.said.emit()

    def unsay(self) -> None:
        """Nothing that was said before counts any more: something is tried anew."""
        self.sentences.clear()
        self.said.emit()

    # Inside

    def _connected(self, _: None) -> None:
        self.sentences.clear()
        self.now = time.monotonic()
        self._to(CaptureState.READY)
        self.said.emit()
        self._timer.start()
        self._check_project()

    def _work(
        self,
        phase: CaptureState,
        work: Generator[Any, None, Any],
        done: Callable[[Any], object],
        otherwise: Callable[[], CaptureState],
        after: CaptureState | None = None,
    ) -> None:
        """Let a job have the recorder."""

        def finished(result: Any) -> None:
            if after is not None:
                self._to(after)
            done(result)

        def failed(error: Exception) -> None:
            self._to(otherwise())
            if isinstance(error, ForcelabError):
                self.say(self._error_text(error), True)
            self._check_project()

        self._to(phase)
        self._jobs.run(work, finished, failed, key=JOB)

    def _to(self, phase: CaptureState) -> None:
        self.phase = phase
        self.changed.emit()

    def _tick(self) -> None:
        """Look how the devices do now and then, and tell that there are new samples."""
        self.now = now = time.monotonic()
        recorder = self._recorder
        if recorder is not None and self.phase not in BUSY_STATES and now - self._asked >= STATE:
            self._asked = now
            self.state = recorder.state()
            for sentence in recorder.remarks():
                self.say(sentence)
        self.ticked.emit()

    @property
    def recording(self) -> bool:
        """Whether something is being recorded."""
        return self.phase is CaptureState.RECORDING

    @property
    def recorded(self) -> str:
        """What the recording that runs is called; empty while none runs."""
        return self._recorded if self.phase in (CaptureState.RECORDING, CaptureState.STUCK) else ""

    @property
    def obstacle(self) -> str:
        """Why no recording can begin with the devices as they are; empty where one can."""
        if self.phase is not CaptureState.READY or self.state is None:
            return ""
        return self.state.obstacle

    def set_task(self, task: str) -> None:
        """The next recordings are of a task; its actions can be marked."""
        self.task = task.strip()
        project = self.document.project
        self.vocabulary = Vocabulary() if project is None else project.actions.vocabulary(self.task)
        self.changed.emit()

    @property
    def seen_vocabulary(self) -> Vocabulary:
        """The task's actions, and those that the recogniser knows besides."""
        loaded = self.recognising.loaded
        if loaded is None:
            return self.vocabulary
        return self.vocabulary.with_actions(*loaded.recogniser.actions)

    def next_name(self) -> str:
        """What the next recording will be called; empty while there is no task."""
        from forcelab.capture.save import next_name

        project = self.document.project
        if self.name or project is None or not self.task:
            return self.name
        return next_name(project, self.task)

    def disconnect_all(self) -> None:
        """Let go of the devices; a recording that runs is kept, a countdown ends."""
        self._second.stop()
        if self._recorder is None or self.phase in BUSY_STATES:
            return
        holds = self.phase in (CaptureState.RECORDING, CaptureState.STUCK)
        phase = CaptureState.KEEPING if holds else CaptureState.LEAVING
        self._work(phase, self._connection.leaving(), self._left, lambda: CaptureState.APART)

    def record_or_stop(self) -> None:
        """Record, after the countdown; or stop and keep what was recorded."""
        if self.phase is CaptureState.READY:
            if not (self.name or self.task):
                self.say("A recording needs a task; write one.", True)
                return
            if self.obstacle:
                self.say(self.obstacle, True)
                return
            self.left = self.countdown
            if self.left:
                self._to(CaptureState.COUNTING)
                self._second.start()
            else:
                self._start()
        elif self.phase is CaptureState.COUNTING:
            self._second.stop()
            self._to(CaptureState.READY)
        elif self.phase in (CaptureState.RECORDING, CaptureState.STUCK):
            self.marks.end(time.monotonic())
            self._work(
                CaptureState.KEEPING,
                self._connection.stopping(),
                self._recording_saved,
                self._not_ended,
            )
        elif self.phase is CaptureState.APART:
            self.say("Connect the devices before recording.", True)

    def discard(self) -> None:
        """End what is recorded and keep nothing of it."""
        if self.phase is CaptureState.COUNTING:
            self.record_or_stop()
        elif self.phase in (CaptureState.RECORDING, CaptureState.STUCK):
            work = self._connection.discarding()
            self._work(CaptureState.DISCARDING, work, self._discarded, self._not_ended)
        elif self.phase not in BUSY_STATES:
            self._discard_last()

    def _discard_last(self) -> None:
        """Discard what was kept last, once it was asked for twice."""
        kept, path, after = self.last.kept, self.last.path, self.phase
        if kept is None or path is None:
            self.say("Nothing is being recorded, and nothing was recorded just now.")
        elif not self.last.asked_twice():
            self.say(
                f"'{kept.added.name}' ({kept.seconds:.1f} s) is discarded for good if you "
                "ask once more."
            )
        else:
            self._work(
                CaptureState.DISCARDING,
                discarding_kept(path, kept),
                self._discarded_last,
                lambda: after,
                after,
            )

    def mark(self, action: str, down: bool, at: float) -> bool:
        """An action's key went down or up; gives whether that counts."""
        if not self.recording or self._recorder is None:
            return False
        self._recorder.mark(action, down, at)
        self.marks.press(action, down, at)
        return True

    def forget_mark(self) -> str | None:
        """Forget the mark that grows, as if its key had never gone down; gives its action."""
        grown = self.marks.growing() if self.recording else None
        if grown is None:
            return None
        action, since = grown
        self.mark(action, False, since)
        self.say(f"The mark '{action}' is forgotten.")
        return action

    def look_for_unfinished(self) -> None:
        """Look for recordings that a crash ended."""
        from forcelab.capture.save import unfinished

        project = self.document.project
        self.left_behind = 0 if project is None else len(unfinished(project.path))
        self.changed.emit()

    def recover(self) -> None:
        """Make demonstrations of the unfinished recordings."""
        project = self.document.project
        if project is not None and self.phase in (CaptureState.APART, CaptureState.READY):
            after = self.phase
            self._work(
                CaptureState.RECOVERING,
                recovering(project.path),
                self._recovered,
                lambda: after,
                after,
            )

    def let_go(self) -> str:
        """Let go of everything: the window closes. What is being recorded is kept, or why not."""
        self._second.stop()
        self._timer.stop()
        return self._connection.let_go()

    # When jobs are done

    def _started(self, name: str) -> None:
        self.begun, self._recorded = time.monotonic(), name
        self.last.forget()
        self.marks = LiveMarks()
        self._to(CaptureState.RECORDING)
        self.say(f"Recording '{name}'.")
        self._check_project()

    def _recording_saved(self, kept: SavedRecording) -> None:
        self.name = ""
        self.last.take(kept, self._path)
        self._to(CaptureState.READY)
        for remark in kept.remarks:
            self.say(remark)
        self.say(_saved_text(kept))
        self._reread()

    def _discarded(self, _: None) -> None:
        self.marks = LiveMarks()
        self._to(CaptureState.READY)
        self.say("Discarded; nothing of it is kept.")
        self._check_project()

    def _discarded_last(self, name: str) -> None:
        self.last.forget()
        self.say(f"'{name}' is discarded; nothing of it is kept.")
        self._reread()

    def _left(self, left: UnfinishedRecording) -> None:
        self._timer.stop()
        self.state = None
        self._to(CaptureState.APART)
        kept, trouble = left
        if trouble:
            self.say(trouble, True)
            self.look_for_unfinished()
        elif kept is not None:
            self.last.take(kept, self._path)
            for remark in kept.remarks:
                self.say(remark)
            self.say(_saved_text(kept))
        self._reread()

    def _recovered(self, found: tuple[Recovered, ...]) -> None:
        for one in found:
            if one.kept is None:
                self.say(one.trouble, not one.removed)
            else:
                self.say(_saved_text(one.kept))
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
        self._work(CaptureState.STARTING, work, self._started, lambda: CaptureState.READY)

    def _not_ended(self) -> CaptureState:
        """What follows where ending a recording has failed."""
        return CaptureState.STUCK if self._connection.holding else CaptureState.READY

    def _error_text(self, error: ForcelabError) -> str:
        """What went wrong, and of a recording that could not be kept what is to be done now."""
        if self.phase is not CaptureState.STUCK:
            return str(error)
        return (
            f"{error} '{self._recorded}' is not lost: mend that and press "
            f"{keys().shown('record')} once more."
        )

    def _count(self) -> None:
        """A second of the countdown has passed."""
        self.left -= 1
        if self.left > 0:
            self.changed.emit()
            return
        self._second.stop()
        self._start()

    def _check_project(self) -> None:
        """What is recorded goes into the project in which it began: leave that with it."""
        project = self.document.project
        if project is None or project.path != self.last.path:
            self.last.forget()
        project = self.document.project
        if self._recorder is not None and (project is None or project.path != self._path):
            self.disconnect_all()


def _saved_text(kept: SavedRecording) -> str:
    """What became of a recording, in a sentence."""
    return f"'{kept.added.name}' is kept: {kept.seconds:.1f} s, {thousands(kept.samples)} samples."
