"""The Capture workspace without its view: devices, recordings and marks.

Whatever takes longer than a blink (opening devices, assembling a recording) is a job. While one is
on, nothing else asks the recorder anything but for its latest samples.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Generator, Sequence
from enum import Enum, auto
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QObject, Qt, QTimer, Signal

from forcelab.capture.discovery import LIST_HINT
from forcelab.capture.live_marks import LiveMarks
from forcelab.capture.save import next_name, unfinished_journals
from forcelab.errors import ForcelabError
from forcelab.gui.capture.connection import (
    Connection,
    UnfinishedRecording,
    discard_recording,
    recover_recordings,
)
from forcelab.gui.capture.recognition_controller import RecognitionController
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.shortcuts import keys
from forcelab.vocabulary import Action, Vocabulary

if TYPE_CHECKING:
    from forcelab.capture.recorder import Recorder, RecorderState
    from forcelab.capture.save import RecoveredRecording, SavedRecording


class CaptureState(Enum):
    """What the workspace is doing."""

    DISCONNECTED = auto()
    CONNECTING = auto()
    READY = auto()
    COUNTDOWN = auto()
    STARTING = auto()
    RECORDING = auto()
    SAVING = auto()
    DISCARDING = auto()
    RECOVERING = auto()
    #: Devices are released while nothing is recorded.
    DISCONNECTING = auto()
    #: A recording has ended and could not be kept: stop again, or discard it.
    UNSAVED = auto()


#: States in which a job has the recorder.
BUSY_STATES = frozenset(
    {
        CaptureState.CONNECTING,
        CaptureState.STARTING,
        CaptureState.SAVING,
        CaptureState.DISCARDING,
        CaptureState.RECOVERING,
        CaptureState.DISCONNECTING,
    }
)

#: States in which there is nothing to wait for or to keep, and settings may change.
IDLE_STATES = frozenset({CaptureState.DISCONNECTED, CaptureState.READY})

#: What disables controls in a state with a job.
WAIT = "Wait until this is done."
#: The sign of a running recording.
RECORD_DOT = "\N{BLACK CIRCLE}"
#: Milliseconds within which discarding must be asked for a second time.
CONFIRM_MS = 6000
#: Milliseconds between two frames while the page can be seen, and two looks at alarms while not.
FRAME_MS, HIDDEN_MS = 33, 500
#: Seconds between two looks at how the devices do.
STATE_SECONDS = 0.2
#: Messages that stay on the page.
MOST_MESSAGES = 3
#: The key of its jobs: one at a time.
JOB = "capture"


class LastRecording(QObject):
    """The recording that was kept last, as long as it can be discarded.

    Asking twice keeps the hands on the keys, where a dialog would ask for the mouse.
    """

    changed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.recording: SavedRecording | None = None
        #: The folder of the project that it is in.
        self.path: Path | None = None
        self._timer = QTimer(self, singleShot=True, interval=CONFIRM_MS)
        self._timer.timeout.connect(self.changed)

    @property
    def confirming(self) -> bool:
        """Whether discarding was asked for once, a moment ago."""
        return self._timer.isActive()

    def set(self, recording: SavedRecording, path: Path | None) -> None:
        self.forget()
        if recording.added.status == "new":
            self.recording, self.path = recording, path
        self.changed.emit()

    def forget(self) -> None:
        """Forget the recording, which cannot be discarded any more."""
        self._timer.stop()
        existed, self.recording, self.path = self.recording is not None, None, None
        if existed:
            self.changed.emit()

    def confirm(self) -> bool:
        """Ask for it to be discarded; gives whether that was the second time."""
        if self.confirming:
            self._timer.stop()
            return True
        self._timer.start()
        self.changed.emit()
        return False


class CaptureController(QObject):
    """Devices that are connected, and what is recorded from them."""

    changed = Signal()
    #: There may be new samples.
    ticked = Signal()
    messages_changed = Signal()
    recording_saved = Signal()

    def __init__(self, document: Document, jobs: Jobs, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.document, self._jobs = document, jobs
        self.phase = CaptureState.DISCONNECTED
        #: As it was asked last; None while nothing is connected.
        self.state: RecorderState | None = None
        #: The last messages, and whether each is about a problem.
        self.messages: deque[tuple[str, bool]] = deque(maxlen=MOST_MESSAGES)
        #: The time of the last tick, on the host's monotonic clock.
        self.now = 0.0
        self.connection = Connection()
        self.recognition = RecognitionController(self.connection, document, jobs, self)
        self.changed.connect(lambda: self.recognition.set_connected(self.connected))
        #: Of the recording that runs or ran last.
        self.marks = LiveMarks()
        #: Of the next recording; without a name it gets the task and the next number.
        self.task, self.name = "", ""
        self.vocabulary = Vocabulary()
        self._other_actions: list[Action] = []
        #: Seconds before a recording, and those that are left of a countdown.
        self.countdown, self.seconds_left = 0, 0
        #: Number of unfinished recordings of the project.
        self.unfinished = 0
        self.last_recording = LastRecording(self)
        self.last_recording.changed.connect(self.changed)
        self._path: Path | None = None  # of the project into which is recorded
        self._state_asked = 0.0
        self._timer = QTimer(self, timerType=Qt.TimerType.PreciseTimer, interval=HIDDEN_MS)
        self._timer.timeout.connect(self._tick)
        self._countdown_timer = QTimer(self, interval=1000)
        self._countdown_timer.timeout.connect(self._count_down)
        document.project_changed.connect(self._check_project)

    @property
    def recorder(self) -> Recorder | None:
        """Open; None while nothing is connected."""
        return None if self.phase is CaptureState.CONNECTING else self.connection.recorder

    @property
    def connected(self) -> bool:
        """Whether devices are open."""
        return self.recorder is not None

    @property
    def recording(self) -> bool:
        """Whether something is being recorded."""
        return self.phase is CaptureState.RECORDING

    @property
    def recording_name(self) -> str:
        """The name of the recording that runs or is not kept yet; else empty."""
        unsaved = self.phase in (CaptureState.RECORDING, CaptureState.UNSAVED)
        return self.recorder.name if unsaved and self.recorder is not None else ""

    @property
    def obstacle(self) -> str:
        """Why no recording can begin with the devices as they are; empty where one can."""
        if self.phase is not CaptureState.READY or self.state is None:
            return ""
        return self.state.obstacle

    @property
    def obstacle_to_set_up(self) -> str:
        """Why settings of the next recording cannot be changed now; empty where they can."""
        if self.phase in IDLE_STATES or self.phase is CaptureState.CONNECTING:
            return ""
        if self.phase is CaptureState.UNSAVED:
            return "Keep or discard the last recording first."
        return WAIT if self.phase in BUSY_STATES else "End the recording first."

    @property
    def display_vocabulary(self) -> Vocabulary:
        """The task's actions, and those that the recogniser knows besides."""
        loaded = self.recognition.loaded
        if loaded is None:
            return self.vocabulary
        return self.vocabulary.with_actions(*loaded.recogniser.actions, like=self._other_actions)

    def set_visible(self, visible: bool) -> None:
        """Tick 30 times a second, or only look after alarms."""
        self._timer.setInterval(FRAME_MS if visible else HIDDEN_MS)
        self.recognition.visible = visible

    def add_message(self, message: str, problem: bool = False) -> None:
        """Show a message on the page and in the status line."""
        message = message.replace(LIST_HINT, "press Refresh")
        self.messages.append((message, problem))
        self.document.show_message(message, problem)
        self.messages_changed.emit()

    def clear_messages(self) -> None:
        """Forget earlier messages: something is tried anew."""
        self.messages.clear()
        self.messages_changed.emit()

    # Devices

    def connect_devices(self, devices: Sequence[str], cameras: Sequence[str]) -> None:
        """Open devices and cameras by their names."""
        project = self.document.project
        if self.phase is not CaptureState.DISCONNECTED or project is None:
            return
        if not devices:
            self.add_message("Select a device, or write one such as optoforce:/dev/ttyACM0.", True)
            return
        self.clear_messages()
        self._path = project.path
        self._run_job(
            CaptureState.CONNECTING,
            self.connection.open_devices(project.path, tuple(devices), tuple(cameras)),
            self._devices_opened,
        )

    def disconnect_devices(self) -> None:
        """Release the devices; a recording that runs is kept, a countdown ends."""
        self._countdown_timer.stop()
        if self.recorder is None or self.phase in BUSY_STATES:
            return
        unsaved = self.phase in (CaptureState.RECORDING, CaptureState.UNSAVED)
        phase = CaptureState.SAVING if unsaved else CaptureState.DISCONNECTING
        self._run_job(phase, self.connection.close_devices(), self._devices_closed)

    def zero(self) -> None:
        """Let all devices take their present readings for zero."""
        if self.recorder is not None and self.phase not in BUSY_STATES:
            self.recorder.zero()
            self.add_message("The present readings are zero now.")

    def release(self) -> str:
        """The window closes: release everything. Keeps what is being recorded, or says why not."""
        self._countdown_timer.stop()
        self._timer.stop()
        return self.connection.release()

    # Recordings

    def set_task(self, task: str) -> None:
        """The next recordings are of a task; its actions can be marked."""
        self.task = task.strip()
        project = self.document.project
        self.vocabulary, self._other_actions = Vocabulary(), []
        if project is not None:
            self.vocabulary = project.actions.vocabulary(self.task)
            self._other_actions = project.actions.elsewhere(self.task)
        self.changed.emit()

    def next_name(self) -> str:
        """The name of the next recording; empty while there is no task."""
        project = self.document.project
        if self.name or project is None or not self.task:
            return self.name
        return next_name(project, self.task)

    def record_or_stop(self) -> None:
        """Record, after the countdown; or stop and keep what was recorded."""
        if self.phase is CaptureState.READY:
            if not (self.name or self.task):
                self.add_message("A recording needs a task; write one.", True)
                return
            if self.obstacle:
                self.add_message(self.obstacle, True)
                return
            self.seconds_left = self.countdown
            if self.seconds_left:
                self._set_phase(CaptureState.COUNTDOWN)
                self._countdown_timer.start()
            else:
                self._start()
        elif self.phase is CaptureState.COUNTDOWN:
            self._countdown_timer.stop()
            self._set_phase(CaptureState.READY)
        elif self.phase in (CaptureState.RECORDING, CaptureState.UNSAVED):
            self.marks.end(time.monotonic())
            job = self.connection.stop_recording()
            self._run_job(CaptureState.SAVING, job, self._recording_saved)
        elif self.phase is CaptureState.DISCONNECTED:
            self.add_message("Connect the devices before recording.", True)

    def discard(self) -> None:
        """End what is recorded and keep nothing of it."""
        if self.phase is CaptureState.COUNTDOWN:
            self.record_or_stop()
        elif self.phase in (CaptureState.RECORDING, CaptureState.UNSAVED):
            job = self.connection.discard_recording()
            self._run_job(CaptureState.DISCARDING, job, self._discarded)
        elif self.phase not in BUSY_STATES:
            self._discard_last()

    def _discard_last(self) -> None:
        """Discard what was kept last, once it was asked for twice."""
        recording, path = self.last_recording.recording, self.last_recording.path
        if recording is None or path is None:
            self.add_message("Nothing is being recorded, and nothing was recorded just now.")
        elif not self.last_recording.confirm():
            self.add_message(
                f"'{recording.added.name}' ({recording.seconds:.1f} s) is discarded for good if "
                f"you ask once more."
            )
        else:
            job = discard_recording(path, recording)
            self._run_job(CaptureState.DISCARDING, job, self._last_discarded)

    def mark(self, action: str, down: bool, at: float) -> bool:
        """An action's key went down or up; gives whether that counts."""
        if not self.recording or self.recorder is None:
            return False
        self.recorder.mark(action, down, at)
        self.marks.press(action, down, at)
        return True

    def forget_mark(self) -> str | None:
        """Forget the mark that grows, as if its key had never gone down; gives its action."""
        current = self.marks.current() if self.recording else None
        if current is None:
            return None
        action, since = current
        self.mark(action, False, since)
        self.add_message(f"The mark '{action}' is forgotten.")
        return action

    def find_unfinished(self) -> None:
        """Look for recordings that a crash ended."""
        project = self.document.project
        self.unfinished = 0 if project is None else len(unfinished_journals(project.path))
        self.changed.emit()

    def recover(self) -> None:
        """Make demonstrations of the unfinished recordings."""
        project = self.document.project
        if project is not None and self.phase in IDLE_STATES:
            job = recover_recordings(project.path)
            self._run_job(CaptureState.RECOVERING, job, self._recovered)

    def _start(self) -> None:
        job = self.connection.start_recording(self.task, self.name, self.document.author)
        self._run_job(CaptureState.STARTING, job, self._started)

    # Jobs

    def _run_job(
        self,
        phase: CaptureState,
        job: Generator[Any, None, Any],
        done: Callable[[Any], object],
    ) -> None:
        """Let a job have the recorder."""

        def failed(error: Exception) -> None:
            self._set_phase(self._phase_without_job)
            if isinstance(error, ForcelabError):
                self.add_message(self._error_text(error), True)
            self._check_project()

        self._set_phase(phase)
        self._jobs.run(job, done, failed, key=JOB)

    def _set_phase(self, phase: CaptureState) -> None:
        self.phase = phase
        self.changed.emit()

    @property
    def _phase_without_job(self) -> CaptureState:
        """The phase once a job is over that began no recording, by what is open and kept."""
        if self.connection.recorder is None:
            return CaptureState.DISCONNECTED
        return CaptureState.UNSAVED if self.connection.has_recording else CaptureState.READY

    def _error_text(self, error: ForcelabError) -> str:
        """What went wrong, and how to keep a recording that could not be kept."""
        if self.phase is not CaptureState.UNSAVED:
            return str(error)
        return (
            f"{error} '{self.recording_name}' is not lost: mend that and press "
            f"{keys().shown('record')} once more."
        )

    def _devices_opened(self, _: None) -> None:
        self.messages.clear()
        self.now = time.monotonic()
        self._set_phase(CaptureState.READY)
        self.messages_changed.emit()
        self._timer.start()
        self._check_project()

    def _devices_closed(self, unfinished: UnfinishedRecording) -> None:
        self._timer.stop()
        self.state = None
        self._set_phase(CaptureState.DISCONNECTED)
        recording, problem = unfinished
        if problem:
            self.add_message(problem, True)
            self.find_unfinished()
        elif recording is not None:
            self._report_saved(recording)
        self._reload_project()

    def _started(self, name: str) -> None:
        self.last_recording.forget()
        self.marks = LiveMarks()
        self._set_phase(CaptureState.RECORDING)
        self.add_message(f"Recording '{name}'.")
        self._check_project()

    def _recording_saved(self, recording: SavedRecording) -> None:
        self.name = ""
        self._set_phase(CaptureState.READY)
        self._report_saved(recording)
        self._reload_project()

    def _report_saved(self, recording: SavedRecording) -> None:
        self.last_recording.set(recording, self._path)
        for remark in recording.remarks:
            self.add_message(remark)
        self.add_message(_saved_text(recording))

    def _discarded(self, _: None) -> None:
        self.marks = LiveMarks()
        self._set_phase(CaptureState.READY)
        self.add_message("Discarded; nothing of it is kept.")
        self._check_project()

    def _last_discarded(self, name: str) -> None:
        self._set_phase(self._phase_without_job)
        self.last_recording.forget()
        self.add_message(f"'{name}' is discarded; nothing of it is kept.")
        self._reload_project()

    def _recovered(self, results: tuple[RecoveredRecording, ...]) -> None:
        self._set_phase(self._phase_without_job)
        for result in results:
            if result.recording is None:
                self.add_message(result.problem, not result.removed)
            else:
                self.add_message(_saved_text(result.recording))
        self._reload_project()
        self.find_unfinished()

    # Timers

    def _tick(self) -> None:
        """Look how the devices do now and then, and tell that there may be new samples."""
        self.now = now = time.monotonic()
        due = now - self._state_asked >= STATE_SECONDS
        if self.recorder is not None and self.phase not in BUSY_STATES and due:
            self._state_asked = now
            self.state = self.recorder.state()
            for message in self.recorder.remarks():
                self.add_message(message)
        self.ticked.emit()

    def _count_down(self) -> None:
        """A second of the countdown has passed."""
        self.seconds_left -= 1
        if self.seconds_left > 0:
            self.changed.emit()
            return
        self._countdown_timer.stop()
        self._start()

    # The project

    def _reload_project(self) -> None:
        """Show what is new in the project."""
        self.document.reread()
        self.recording_saved.emit()
        self._check_project()

    def _check_project(self) -> None:
        """What is recorded goes into the project in which it began: leave that with it."""
        project = self.document.project
        if project is None or project.path != self.last_recording.path:
            self.last_recording.forget()
        if self.recorder is not None and (project is None or project.path != self._path):
            self.disconnect_devices()


def _saved_text(recording: SavedRecording) -> str:
    name, samples = recording.added.name, recording.samples
    return f"'{name}' is kept: {recording.seconds:.1f} s, {samples:,} samples."
