"""The Capture workspace: devices and what to record at the left, what comes at the right."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QHideEvent, QShowEvent
from PySide6.QtWidgets import (
    QApplication,
    QHBoxLayout,
    QPushButton,
    QSplitter,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui.arranging import allow, column, rule, scrolled, stress
from forcelab.gui.capture.legend import MarkLegend
from forcelab.gui.capture.live import LiveView
from forcelab.gui.capture.marks import HeldKeys
from forcelab.gui.capture.next_recording import NextRecording
from forcelab.gui.capture.phase import WORKING, Phase
from forcelab.gui.capture.picture import CameraPicture
from forcelab.gui.capture.recogniser_choice import RecogniserChoice
from forcelab.gui.capture.recognition import RecognitionPanel
from forcelab.gui.capture.recorded_time import RecordedTime
from forcelab.gui.capture.scalogram import LiveScalogramView
from forcelab.gui.capture.scalogram_choice import ScalogramChoice
from forcelab.gui.capture.session import Session
from forcelab.gui.capture.sources import Sources
from forcelab.gui.capture.standing import Standing
from forcelab.gui.document import Document
from forcelab.gui.figures.text import NAMES
from forcelab.gui.jobs import Jobs
from forcelab.gui.shortcuts import keys
from forcelab.gui.typing_guard import typing
from forcelab.gui.wheel_guard import guard_from_wheel

__all__ = ["CaptureWorkspace"]

#: Width of the left side at least, in pixels.
SIDE = 250
#: The same of both sides when they are first laid out; what is added goes to the right one.
WINDOW = 900


class CaptureWorkspace(QWidget):
    """Everything to record with.

    Parameters
    ----------
    document : Document
    jobs : Jobs

    Attributes
    ----------
    session : Session
        Does what is pressed.
    fields : NextRecording
        What the next recording is.
    sources : Sources
        What can be connected.
    live : LiveView
    standing : Standing
    """

    def __init__(self, document: Document, jobs: Jobs) -> None:
        super().__init__()
        self.document = document
        self.session = Session(document, jobs, self)
        self.sources = Sources(self.session, jobs)
        self.live = LiveView(self.session)
        self.picture = CameraPicture(self.session)
        self.scalogram = LiveScalogramView(self.session, jobs, self.live)
        self.scalogram_channel = ScalogramChoice(self.session, self.scalogram)
        self.recognition = RecognitionPanel(self.session)
        self.recogniser = RecogniserChoice(self.session, self)
        self.standing = Standing(self.session)
        self.fields = NextRecording(self.session)
        self.held = HeldKeys(self, lambda: self.session.vocabulary, self.session.mark)
        self._looked = False
        self._make_buttons()
        self._lay_out()
        self.session.changed.connect(self._changed)
        self.session.ticked.connect(self._show_whether_recording_can_begin)
        document.project_changed.connect(self._project_changed)
        document.training_changed.connect(self.recogniser.refresh)
        keys().changed.connect(self._changed)
        self._changed()

    def let_go(self) -> str:
        """Let go of the devices; what is being recorded is kept, or it is said why not."""
        self.held.release_all()
        return self.session.let_go()

    # Qt

    def showEvent(self, event: QShowEvent) -> None:
        """Look what is plugged in, the first time, and draw from now on."""
        super().showEvent(event)
        self.session.set_looked_at(True)
        self.recogniser.refresh()  # one may have been trained meanwhile
        if not self._looked:
            self._looked = True
            self.sources.look()
            self.session.look_for_unfinished()

    def hideEvent(self, event: QHideEvent) -> None:
        """Draw nothing; a recording goes on."""
        super().hideEvent(event)
        self.held.release_all()
        self.session.set_looked_at(False)

    # Building

    def _make_buttons(self) -> None:
        """What can be pressed."""
        self.connect_button = QPushButton()
        self.connect_button.clicked.connect(self._connect_or_not)
        self.zero_button = QPushButton("Zero")
        self.zero_button.setToolTip("Take the present readings of all devices for zero")
        self.zero_button.setAccessibleName("Zero all devices")
        self.zero_button.clicked.connect(self.session.zero)
        self.record_button = QPushButton()
        self.record_button.clicked.connect(self.record)
        self.record_button.setMinimumHeight(2 * self.fontMetrics().height())
        stress(self.record_button)
        self.discard_button = QPushButton()
        self.discard_button.clicked.connect(self.session.discard)
        self.recover_button = QPushButton()
        self.recover_button.clicked.connect(self.session.recover)
        self.clock = RecordedTime(self.session)
        self.legend = MarkLegend(self.session, self)

    def _lay_out(self) -> None:
        """The left side and the right one."""
        sides = QSplitter(Qt.Orientation.Horizontal)
        sides.addWidget(self._left_side())
        sides.addWidget(self._right_side())
        sides.setStretchFactor(1, 1)
        sides.setChildrenCollapsible(False)
        # Long texts at the left would ask for half of a small window; they are wrapped instead.
        sides.setSizes([SIDE, WINDOW - SIDE])
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.addWidget(sides)

    def _left_side(self) -> QWidget:
        """Devices, their picture, and what to record."""
        form = self.fields.form
        form.addRow("Recogniser", self.recogniser.which)
        form.addRow(self.recogniser.nothing)
        form.addRow("Latency", self.recogniser.latency)
        form.addRow("Scalogram", self.scalogram_channel)
        guard_from_wheel(
            self.fields.task,
            self.fields.countdown,
            self.recogniser.which,
            self.recogniser.latency,
            self.scalogram_channel,
        )
        devices = QHBoxLayout()
        devices.addWidget(self.connect_button, 1)
        devices.addWidget(self.zero_button)
        setting_up = QWidget()
        upper = QVBoxLayout(setting_up)
        upper.setContentsMargins(8, 8, 8, 0)
        upper.addWidget(self.recover_button)
        upper.addWidget(self.sources, 1)
        upper.addLayout(devices)
        upper.addWidget(self.picture, 3)
        upper.addStretch()
        upper.addWidget(rule())
        upper.addWidget(self.fields)
        # What is pressed while hands are full is always there; what was set up before may scroll.
        recording = QVBoxLayout()
        recording.setContentsMargins(8, 0, 8, 8)
        for widget in (self.legend, self.clock, self.record_button, self.discard_button):
            recording.addWidget(widget)
        side = QWidget()
        side.setMinimumWidth(SIDE)
        above = scrolled(setting_up)
        column(side, above, growing=above, spacing=6).addLayout(recording)
        return side

    def _right_side(self) -> QWidget:
        """What comes, and how it does."""
        views = QSplitter(Qt.Orientation.Vertical)
        views.addWidget(scrolled(self.live))
        views.addWidget(self.scalogram)
        views.setStretchFactor(0, 3)
        views.setStretchFactor(1, 2)
        views.setChildrenCollapsible(False)
        main = QWidget()
        column(main, views, self.recognition, self.standing, growing=views)
        return main

    # What is pressed

    def record(self) -> None:
        """Record, or stop; the keys of actions mark from now on."""
        self.fields.take_task()
        if self.session.phase in (Phase.READY, Phase.RECORDING):
            self.held.release_all()
            # Letters mark actions from now on and are no text.
            self.live.setFocus()
        self.session.record_or_stop()

    def cancel(self) -> bool:
        """Take back what was begun last: a mark that grows, or a countdown; gives whether it was.

        A recording is not ended by it, and what is written in a field is left first.
        """
        if typing(QApplication.focusWidget()):
            return False
        if self.session.phase is Phase.COUNTING:
            self.session.record_or_stop()
            return True
        forgotten = self.session.forget_mark()
        if forgotten is not None:
            self.held.forget(forgotten)
        return forgotten is not None

    def _connect_or_not(self) -> None:
        """Connect what is ticked, or let go of it."""
        self.fields.take_task()
        # The button is disabled meanwhile: the next field would get the keyboard, and keys as text.
        self.live.setFocus()
        if self.session.phase is Phase.APART:
            self.sources.remember()
            self.session.connect_to(self.sources.devices, self.sources.cameras)
        else:
            self.session.disconnect_all()

    # What is shown

    def _project_changed(self) -> None:
        """Another project: its tasks, its unfinished recordings."""
        self.recogniser.refresh()
        if self._looked:
            self.session.look_for_unfinished()

    def _changed(self) -> None:
        """Show what can be pressed now, and what it is called."""
        session, phase = self.session, self.session.phase
        apart = phase is Phase.APART
        if phase is not Phase.RECORDING:
            self.held.forget_begun()
        text = "Connect" if apart else "Disconnect"
        under_way = {
            Phase.CONNECTING: "Connecting…",
            Phase.LEAVING: "Disconnecting…",
        }
        _say_on(self.connect_button, under_way.get(phase, text))
        allow(self.connect_button, self._obstacle_to_connect(phase))
        self.sources.set_open(apart)
        zeroing = phase in (Phase.READY, Phase.COUNTING)
        allow(self.zero_button, "" if zeroing else "Connect devices before zeroing them.")
        words = {
            Phase.COUNTING: "Do not record",
            Phase.STARTING: "Starting…",
            Phase.RECORDING: "Stop and keep",
            Phase.KEEPING: "Keeping…",
            Phase.DISCARDING: "Discarding…",
            Phase.RECOVERING: "Recovering…",
            Phase.STUCK: "Try to keep it again",
        }
        _say_on(self.record_button, words.get(phase, "Record"), keys().shown("record"))
        self._show_whether_recording_can_begin()
        self._show_discard()
        left = session.left_behind
        _say_on(self.recover_button, f"Recover unfinished recordings: {left}")
        self.recover_button.setToolTip(
            "Make demonstrations of recordings that a crash or a power cut ended"
        )
        self.recover_button.setVisible(left > 0)
        self.recover_button.setEnabled(phase in (Phase.APART, Phase.READY))

    def _obstacle_to_connect(self, phase: Phase) -> str:
        """Why devices cannot be connected or disconnected now; empty where they can."""
        if self.document.project is None:
            return "Open or make a project first; recordings go into it."
        if phase is Phase.STUCK:
            return "Keep or discard the last recording first."
        return "Wait until this is done." if phase in WORKING else ""

    def _show_whether_recording_can_begin(self) -> None:
        """Devices may be unplugged and plugged in again at any moment."""
        session, obstacle = self.session, self.session.obstacle
        can = session.phase not in WORKING and session.phase is not Phase.APART and not obstacle
        if self.record_button.isEnabled() != can or self.record_button.toolTip() != obstacle:
            reason = obstacle or "Connect devices before recording."
            if session.phase in WORKING:
                reason = "Wait until this is done."
            allow(self.record_button, "" if can else reason)
            self.record_button.setToolTip(obstacle)

    def _show_discard(self) -> None:
        """What would be discarded: what is recorded, or what was kept last."""
        session, text = self.session, "Discard"
        can = session.phase in (Phase.COUNTING, Phase.RECORDING, Phase.STUCK)
        kept = session.last.kept
        if kept is not None and session.phase in (Phase.READY, Phase.APART):
            can = True
            name = self.fontMetrics().elidedText(kept.added.name, NAMES, SIDE // 3)
            words = "Discard '{0}'", "Really discard '{0}'"
            text = words[session.last.asked].format(name)
        _say_on(self.discard_button, text, keys().shown("discard_recording"))
        allow(self.discard_button, "" if can else "There is no recording to discard.")


def _say_on(button: QPushButton, text: str, key: str = "") -> None:
    """Write on a button what it does and which key does it."""
    shown = f"{text}  ({key})" if key else text
    if button.text() != shown:
        button.setText(shown)
        button.setAccessibleName(text)
