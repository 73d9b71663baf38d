"""The tab of the Capture workspace, which is built when it is first shown, and its commands."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QMessageBox, QWidget

from forcelab.capture.save import SavedRecording, unfinished_journals
from forcelab.gui.capture.controller import RECORD_DOT, CaptureState
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.layout import page_layout
from forcelab.gui.status_bar import BackgroundIndicator
from forcelab.gui.text import ask
from forcelab.gui.theme import colours, themes
from forcelab.text import amount, counted

if TYPE_CHECKING:
    from forcelab.gui.capture.workspace import CaptureWorkspace

#: Keys of jobs that go on for as long as devices are connected, or wait for the network.
ENDLESS = frozenset(
    {
        "capture: live recognition",
        "capture: live scalogram",
        "capture: streams in the network",
    }
)


class RecordingIndicator(BackgroundIndicator):
    """A line in the status bar while another workspace is in front; a click leads to Capture."""

    def __init__(self) -> None:
        super().__init__()
        self._name, self._seconds, self._stuck = "", 0.0, False
        self.setToolTip("Show what is being recorded")
        themes().changed.connect(self._colour)
        self._colour()

    def show_recording(self, name: str, seconds: float, *, stuck: bool = False) -> None:
        """Show what is recorded and for how long, or that it could not be kept."""
        self._name, self._seconds, self._stuck = name, seconds, stuck
        self.refresh()

    def words(self) -> str:
        if not self._name:
            return ""
        if self._stuck:
            return f"{RECORD_DOT} '{self._name}' is not kept yet"
        minutes, seconds = divmod(int(self._seconds), 60)
        return f"{RECORD_DOT} Recording '{self._name}'  {minutes}:{seconds:02d}"

    def _colour(self) -> None:
        self.setStyleSheet(f"padding: 0 0.5em; color: {colours().trouble};")


class CaptureTab(QWidget):
    """Room for the Capture workspace."""

    #: A recording began or ended, or could not be kept.
    recording_changed = Signal()
    #: A recording was opened, to be shown in the Label workspace.
    label_wanted = Signal()

    def __init__(self, document: Document, jobs: Jobs) -> None:
        super().__init__()
        self.document = document
        self._jobs = jobs
        self._built: CaptureWorkspace | None = None
        #: For the status bar.
        self.indicator = RecordingIndicator()
        #: What is being recorded or not kept yet, and whether it has ended and could not be kept.
        self.recording, self.stuck = "", False
        self._confirmed = False
        self._column = page_layout(self)
        document.project_changed.connect(self._report_unfinished)

    @property
    def workspace(self) -> CaptureWorkspace:
        """The workspace, built when it is first asked for."""
        if self._built is None:
            # A window that records nothing does not load what it needs.
            from forcelab.gui.capture.workspace import CaptureWorkspace

            self._built = CaptureWorkspace(self.document, self._jobs)
            self._column.addWidget(self._built)
            self._built.controller.changed.connect(self._update_indicator)
            self._built.controller.ticked.connect(self._update_indicator)
        return self._built

    def come_to_front(self, front: bool) -> None:
        """Build the workspace when it is needed."""
        self.indicator.set_elsewhere(not front)
        if front:
            _ = self.workspace

    def title(self, text: str) -> str:
        """The text of the tab, or of the window's title, with a dot while something is recorded."""
        return f"{RECORD_DOT} {text}" if self.recording else text

    def may_close(self, window: QWidget) -> bool:
        """Whether the window may be closed; asks while something is recorded."""
        if not self.recording or self._built is None:
            return True
        state = self._built.controller.state
        refused = 0 if state is None else state.in_memory
        in_memory = amount(refused) if refused else ""
        self._confirmed = confirm_leaving(
            self.recording, window, stuck=self.stuck, in_memory=in_memory
        )
        return self._confirmed

    def release(self) -> None:
        """Release the devices; what is being recorded is kept, or it is said where it is."""
        problem = "" if self._built is None else self._built.release()
        if problem:
            logging.getLogger("forcelab").error(problem)
            if self._confirmed:  # the coder is there; where a signal ends it all, the log has to do
                QMessageBox.warning(self.window(), "Recording", problem)

    def handlers(self) -> dict[str, Callable[[], object]]:
        """What the commands of capturing do, by their id in the table."""
        return {
            "record": self._record,
            "discard_recording": self._discard,
            "show_recording": self._show_last,
        }

    def obstacles(self) -> dict[str, Callable[[], str]]:
        """Why commands cannot be carried out now, by their id; empty where they can."""
        first = "Connect devices in the Capture workspace first."
        return {
            "record": lambda: first if self._built is None else self._built.obstacle_to_record,
            "discard_recording": lambda: (
                "" if self._built is not None else "Nothing is being recorded."
            ),
            "show_recording": lambda: (
                "" if self._last is not None else "Nothing was recorded just now."
            ),
        }

    def cancel(self) -> bool:
        """Take back what was begun last, if the workspace is in front; gives whether it was."""
        return self._built is not None and self._built.isVisible() and self._built.cancel()

    def _update_indicator(self) -> None:
        assert self._built is not None
        controller = self._built.controller
        name, state = controller.recording_name, controller.state
        stuck = controller.phase is CaptureState.UNSAVED
        self.indicator.show_recording(name, 0.0 if state is None else state.seconds, stuck=stuck)
        if (name, stuck) != (self.recording, self.stuck):
            self.recording, self.stuck = name, stuck
            self.recording_changed.emit()

    def _report_unfinished(self) -> None:
        """Say in whatever workspace that a crash has cut recordings off."""
        project = self.document.project
        if project is not None and (count := len(unfinished_journals(project.path))):
            self.document.show_message(
                f"{counted(count, 'recording')} cut off by a crash; open Capture to recover "
                + ("it." if count == 1 else "them."),
                True,
            )

    def _record(self) -> None:
        """Record or stop, whichever workspace is in front."""
        if self._built is not None:
            self._built.record()

    def _discard(self) -> None:
        if self._built is not None:
            self._built.controller.discard()

    @property
    def _last(self) -> SavedRecording | None:
        """The recording that was kept last."""
        return None if self._built is None else self._built.controller.last_recording.recording

    def _show_last(self) -> None:
        """Open the recording that was kept last."""
        if self._last is not None:
            self.document.open_demonstration(self._last.added.id)
            self.label_wanted.emit()


def confirm_leaving(
    name: str, parent: QWidget, *, stuck: bool = False, in_memory: str = ""
) -> bool:
    """Ask whether the window is to be closed although a recording runs, or could not be kept.

    `in_memory` is how much of it the disk refuses, such as ``"12 kB"``; empty where it takes all.
    """
    unsure = stuck or bool(in_memory)
    question = f"'{name}' is being recorded."
    if stuck:
        question = f"'{name}' was recorded and could not be kept."
    answers = (
        "Retry saving and close" if unsure else "Keep it and close",
        "Stay" if stuck else "Go on recording",
    )
    detail = _consequence(unsure, in_memory)
    answer = ask(parent, "Recording", question, detail, answers, default=int(unsure), escape=1)
    return answer == answers[0]


def _consequence(unsure: bool, in_memory: str) -> str:
    """What becomes of a recording if the window is closed."""
    if not unsure:
        return "If the window is closed, the recording ends and is kept."
    text = (
        "If the window is closed, saving is tried once more. If that fails, what is on the disk "
        "is offered the next time."
    )
    if in_memory:
        text += (
            f" {in_memory} that the disk refuses are in memory: all of it is written elsewhere "
            "then, and you are told where."
        )
    return text
