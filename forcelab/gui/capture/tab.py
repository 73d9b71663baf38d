"""The tab of the Capture workspace, which is built when it is first shown, and its commands."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QMessageBox, QWidget

from forcelab.gui.capture.controller import CaptureState
from forcelab.gui.capture.recording_indicator import RECORD_DOT, RecordingIndicator, confirm_leaving
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.layout import page_layout
from forcelab.text import amount, counted

if TYPE_CHECKING:
    from forcelab.gui.capture.workspace import CaptureWorkspace

__all__ = ["ENDLESS", "CaptureTab"]

#: Keys of jobs that go on for as long as devices are connected.
ENDLESS = frozenset({"capture: live recognition", "capture: live scalogram"})


class CaptureTab(QWidget):
    """Room for the Capture workspace.

    Parameters
    ----------
    document : Document
    jobs : Jobs

    Signals
    -------
    recording_changed()
        A recording began or ended, or could not be kept; see :attr:`recording`, :attr:`stuck`.
    label_wanted()
        A recording was opened, to be looked at in the Label workspace.

    Attributes
    ----------
    line : RecordingIndicator
        For the status bar: what is recorded while another workspace is in front.
    recording : str
        What is being recorded, or is not kept yet; empty for nothing.
    stuck : bool
        Whether it has ended and could not be kept.
    """

    recording_changed = Signal()
    label_wanted = Signal()

    def __init__(self, document: Document, jobs: Jobs) -> None:
        super().__init__()
        self.document = document
        self._jobs = jobs
        self._built: CaptureWorkspace | None = None
        self.line = RecordingIndicator()
        self.recording, self.stuck = "", False
        self._asked = False
        self._column = page_layout(self)
        document.project_changed.connect(self._tell_unfinished)

    @property
    def workspace(self) -> CaptureWorkspace:
        """The workspace; the first one who asks has it built."""
        if self._built is None:
            # What it needs is not loaded by those who do not record.
            from forcelab.gui.capture.workspace import CaptureWorkspace

            self._built = CaptureWorkspace(self.document, self._jobs)
            self._column.addWidget(self._built)
            self._built.session.changed.connect(self._update_indicator)
            self._built.session.ticked.connect(self._update_indicator)
        return self._built

    def come_to_front(self, front: bool) -> None:
        """Build the workspace when it is wanted."""
        self.line.set_elsewhere(not front)
        if front:
            _ = self.workspace

    def title(self, text: str) -> str:
        """The text of the tab, or of the window's title, with a dot while something is recorded."""
        return f"{RECORD_DOT} {text}" if self.recording else text

    def may_close(self, window: QWidget) -> bool:
        """Whether the window may be closed; asks while something is recorded."""
        if not self.recording or self._built is None:
            return True
        session = self._built.session
        refused = 0 if session.state is None else session.state.in_memory
        self._asked = confirm_leaving(
            self.recording,
            window,
            stuck=self.stuck,
            in_memory=amount(refused) if refused else "",
        )
        return self._asked

    def let_go(self) -> None:
        """Let go of the devices; what is being recorded is kept, or it is said where it is."""
        trouble = "" if self._built is None else self._built.let_go()
        if trouble:
            logging.getLogger("forcelab").error(trouble)
            if self._asked:  # somebody is there; where a signal ends it all, the log has to do
                QMessageBox.warning(self.window(), "Recording", trouble)

    def handlers(self) -> dict[str, Callable[[], object]]:
        """What the commands of capturing do, by their id in the table."""
        return {
            "record": self._record,
            "discard_recording": self._discard,
            "show_recording": self._show_kept,
        }

    def cancel(self) -> bool:
        """Take back what was begun last, if the workspace is in front; gives whether it was."""
        return self._built is not None and self._built.isVisible() and self._built.cancel()

    def _update_indicator(self) -> None:
        """Say elsewhere what is recorded."""
        assert self._built is not None
        session = self._built.session
        name = session.recorded
        state = session.state
        stuck = session.phase is CaptureState.STUCK
        self.line.tell(name, 0.0 if state is None else state.seconds, stuck=stuck)
        if (name, stuck) != (self.recording, self.stuck):
            self.recording, self.stuck = name, stuck
            self.recording_changed.emit()

    def _tell_unfinished(self) -> None:
        """Say in whatever workspace what a crash has left behind."""
        project = self.document.project
        if project is None:
            return
        from forcelab.capture.save import unfinished

        if count := len(unfinished(project.path)):
            self.document.show_message(
                f"{counted(count, 'recording')} cut off by a crash; open Capture to recover "
                + ("it." if count == 1 else "them."),
                True,
            )

    def _record(self) -> None:
        """Record or stop, whichever workspace is in front."""
        if self._built is None:
            self.document.show_message("Connect devices in the Capture workspace first.", True)
        else:
            self._built.record()

    def _discard(self) -> None:
        """Discard what is being recorded."""
        if self._built is None:
            self.document.show_message("Nothing is being recorded.")
        else:
            self._built.session.discard()

    def _show_kept(self) -> None:
        """Open the recording that was kept last, to be looked at."""
        kept = None if self._built is None else self._built.session.last.kept
        if kept is None:
            self.document.show_message("Nothing was recorded just now.")
        else:
            self.document.open_demonstration(kept.added.id)
            self.label_wanted.emit()
