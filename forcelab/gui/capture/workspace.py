"""The Capture workspace: devices and what to record at the left, what comes at the right."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QHideEvent, QShowEvent
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QScrollArea,
    QSplitter,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui.capture.live import LiveView
from forcelab.gui.capture.marks import HeldKeys
from forcelab.gui.capture.next_recording import NextRecording
from forcelab.gui.capture.phase import WORKING, Phase
from forcelab.gui.capture.picture import CameraPicture
from forcelab.gui.capture.recogniser_choice import RecogniserChoice
from forcelab.gui.capture.recognition import RecognitionPanel
from forcelab.gui.capture.scalogram import LiveScalogramView
from forcelab.gui.capture.scalogram_choice import ScalogramChoice
from forcelab.gui.capture.session import Session
from forcelab.gui.capture.sources import Sources
from forcelab.gui.capture.standing import Standing
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.shortcuts import keys
from forcelab.gui.theme import colours, themes

__all__ = ["CaptureWorkspace"]

#: Width of the left side, in pixels.
SIDE = 250


class CaptureWorkspace(QWidget):
    """Everything to record with.

    Parameters
    ----------
    document : Document
    jobs : Jobs
    parent : QWidget, optional

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

    def __init__(self, document: Document, jobs: Jobs, parent: QWidget | None = None) -> None:
        super().__init__(parent)
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
        self.task, self.name, self.countdown = (
            self.fields.task,
            self.fields.name,
            self.fields.countdown,
        )
        self.held = HeldKeys(self, lambda: self.session.vocabulary, self.session.mark)
        self._looked = False
        self._make_buttons()
        self._lay_out()
        self.session.changed.connect(self._changed)
        self.session.ticked.connect(self._tell_time)
        document.project_changed.connect(self._project_changed)
        keys().changed.connect(self._changed)
        themes().changed.connect(self._changed)
        self._changed()

    def let_go(self) -> None:
        """Let go of the devices; what is being recorded is kept."""
        self.held.release_all()
        self.session.let_go()

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
        self.zero_button = QPushButton(self.tr("Zero"))
        self.zero_button.setToolTip(self.tr("Take the present readings of all devices for zero"))
        self.zero_button.setAccessibleName(self.tr("Zero all devices"))
        self.zero_button.clicked.connect(self.session.zero)
        self.record_button = QPushButton()
        self.record_button.clicked.connect(self.record)
        self.record_button.setMinimumHeight(2 * self.fontMetrics().height())
        strong = self.record_button.font()
        strong.setBold(True)
        self.record_button.setFont(strong)
        self.discard_button = QPushButton()
        self.discard_button.clicked.connect(self.session.discard)
        self.recover_button = QPushButton()
        self.recover_button.clicked.connect(self.session.recover)
        self.clock = QLabel()
        face = self.clock.font()
        face.setPointSizeF(face.pointSizeF() * 1.5)
        face.setBold(True)
        self.clock.setFont(face)
        self.clock.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.legend = QLabel()
        self.legend.setTextFormat(Qt.TextFormat.PlainText)
        self.legend.setWordWrap(True)

    def _lay_out(self) -> None:
        """The left side and the right one."""
        form = self.fields.form
        form.addRow(self.tr("Recogniser"), self.recogniser.which)
        form.addRow(self.recogniser.nothing)
        form.addRow(self.tr("Latency"), self.recogniser.latency)
        form.addRow(self.tr("Scalogram"), self.scalogram_channel)
        devices = QHBoxLayout()
        devices.addWidget(self.connect_button, 1)
        devices.addWidget(self.zero_button)
        side = QWidget()
        side.setFixedWidth(SIDE)
        column = QVBoxLayout(side)
        column.setContentsMargins(8, 8, 8, 8)
        column.addWidget(self.recover_button)
        column.addWidget(self.sources, 1)
        column.addLayout(devices)
        column.addWidget(_rule())
        column.addWidget(self.fields)
        column.addWidget(self.legend)
        column.addWidget(self.clock)
        column.addWidget(self.record_button)
        column.addWidget(self.discard_button)
        lanes = QScrollArea()
        lanes.setWidgetResizable(True)
        lanes.setFrameShape(QFrame.Shape.NoFrame)
        lanes.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        lanes.setWidget(self.live)
        views = QSplitter(Qt.Orientation.Vertical)
        views.addWidget(lanes)
        views.addWidget(self.scalogram)
        views.addWidget(self.picture)
        for place, share in enumerate((3, 2, 2)):
            views.setStretchFactor(place, share)
        views.setChildrenCollapsible(False)
        right = QVBoxLayout()
        right.setContentsMargins(0, 0, 0, 0)
        right.setSpacing(0)
        right.addWidget(views, 1)
        right.addWidget(self.recognition)
        right.addWidget(self.standing)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(0)
        row.addWidget(side)
        row.addLayout(right, 1)

    # What is pressed

    def record(self) -> None:
        """Record, or stop; the keys of actions mark from now on."""
        self.fields.take_task()
        if self.session.phase in (Phase.READY, Phase.RECORDING):
            self.held.release_all()
            # Letters mark actions from now on and are no text.
            self.live.setFocus()
        self.session.record_or_stop()

    def _connect_or_not(self) -> None:
        """Connect what is ticked, or let go of it."""
        self.fields.take_task()
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
        busy = phase in WORKING
        text = self.tr("Connect") if apart else self.tr("Disconnect")
        if phase is Phase.CONNECTING:
            text = self.tr("Connecting…")
        _say_on(self.connect_button, text)
        self.connect_button.setEnabled(
            not busy and phase is not Phase.STUCK and self.document.project is not None
        )
        self.sources.setEnabled(apart)
        self.zero_button.setEnabled(phase in (Phase.READY, Phase.COUNTING))
        words = {
            Phase.COUNTING: self.tr("Do not record"),
            Phase.STARTING: self.tr("Starting…"),
            Phase.RECORDING: self.tr("Stop and keep"),
            Phase.STOPPING: self.tr("Keeping…"),
            Phase.STUCK: self.tr("Try to keep it again"),
        }
        _say_on(self.record_button, words.get(phase, self.tr("Record")), keys().shown("record"))
        self.record_button.setEnabled(not busy and not apart)
        self._show_discard()
        left = session.left_behind
        _say_on(self.recover_button, self.tr("Recover {0} unfinished").format(left))
        self.recover_button.setToolTip(
            self.tr("Make demonstrations of recordings that a crash or a power cut ended")
        )
        self.recover_button.setVisible(left > 0)
        self.recover_button.setEnabled(phase in (Phase.APART, Phase.READY))
        colour = colours().trouble if session.recording else colours().text
        self.clock.setStyleSheet(f"QLabel {{ color: {colour}; }}")
        self._show_actions()
        self._tell_time()

    def _show_discard(self) -> None:
        """What would be discarded: what is recorded, or what was kept last."""
        session, text = self.session, self.tr("Discard")
        can = session.phase in (Phase.COUNTING, Phase.RECORDING, Phase.STUCK)
        kept = session.last.kept
        if kept is not None and session.phase in (Phase.READY, Phase.APART):
            can = True
            name = self.fontMetrics().elidedText(
                kept.added.name, Qt.TextElideMode.ElideMiddle, SIDE // 3
            )
            words = self.tr("Discard '{0}'"), self.tr("Really discard '{0}'")
            text = words[session.last.asked].format(name)
        _say_on(self.discard_button, text, keys().shown("discard_recording"))
        self.discard_button.setEnabled(can)

    def _show_actions(self) -> None:
        """Which keys mark what."""
        marking = [f"{a.key.upper()} {a.name}" for a in self.session.vocabulary if a.key]
        told = self.tr("Hold to mark: {0}").format(" · ".join(marking)) if marking else ""
        self.legend.setText(told)
        self.legend.setVisible(bool(told))

    def _tell_time(self) -> None:
        """How long it has been recorded."""
        state, phase = self.session.state, self.session.phase
        text = ""
        if phase is Phase.RECORDING and state is not None:
            minutes, seconds = divmod(state.seconds, 60)
            text = f"\N{BLACK CIRCLE} {int(minutes)}:{seconds:04.1f}"
        elif phase is Phase.READY:
            text = self.tr("Ready")
        if self.clock.text() != text:
            self.clock.setText(text)
        if self.clock.isHidden() == bool(text):
            self.clock.setVisible(bool(text))


def _say_on(button: QPushButton, text: str, key: str = "") -> None:
    """Write on a button what it does and which key does it."""
    shown = f"{text}  ({key})" if key else text
    if button.text() != shown:
        button.setText(shown)
        button.setAccessibleName(text)


def _rule() -> QFrame:
    """A line between two groups."""
    rule = QFrame()
    rule.setFrameShape(QFrame.Shape.HLine)
    rule.setFrameShadow(QFrame.Shadow.Sunken)
    return rule
