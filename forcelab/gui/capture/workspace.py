"""The Capture workspace: devices and the next recording at the left, live views at the right."""

from __future__ import annotations

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QHideEvent, QImage, QPainter, QPaintEvent, QShowEvent
from PySide6.QtWidgets import (
    QApplication,
    QComboBox,
    QFormLayout,
    QHBoxLayout,
    QLineEdit,
    QPushButton,
    QSizePolicy,
    QSplitter,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui.capture.controller import BUSY_STATES, CaptureController, CaptureState
from forcelab.gui.capture.device_list import DeviceList
from forcelab.gui.capture.live_plot import LiveView
from forcelab.gui.capture.live_scalogram import LiveScalogramView, ScalogramChoice
from forcelab.gui.capture.marks import HeldKeys, MarkLegend
from forcelab.gui.capture.recognition_panel import RecogniserChoice, RecognitionPanel
from forcelab.gui.capture.recording_indicator import ElapsedTime
from forcelab.gui.capture.status_panel import StatusPanel
from forcelab.gui.document import Document
from forcelab.gui.figures.text import NAMES
from forcelab.gui.jobs import Jobs
from forcelab.gui.key_events import ignore_wheel, is_typing
from forcelab.gui.layout import (
    emphasise,
    page_layout,
    scroll_area,
    separator,
    set_enabled_with_reason,
)
from forcelab.gui.shortcuts import keys
from forcelab.gui.text import settle_name
from forcelab.gui.theme import colours
from forcelab.text import tidy_name


class CameraView(QWidget):
    """Shows what the first camera sees; hidden while there is none.

    Parameters
    ----------
    session : Session
    """

    def __init__(self, session: CaptureController) -> None:
        super().__init__()
        self._session = session
        self._image: QImage | None = None
        self._arrived = 0.0
        self._gone = False  # the camera gives no picture now
        self.setAccessibleName("Camera")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.hide()
        session.ticked.connect(self._look)
        session.changed.connect(self._look)

    def sizeHint(self) -> QSize:
        """A small picture."""
        return QSize(240, 180)

    def minimumSizeHint(self) -> QSize:
        """One in which something can be seen."""
        return QSize(120, 90)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the frame as large as there is room."""
        with QPainter(self) as painter:
            painter.fillRect(self.rect(), QColor(colours().panel))
            if self._image is not None:
                painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
                size = self._image.size().scaled(self.size(), Qt.AspectRatioMode.KeepAspectRatio)
                left = (self.width() - size.width()) / 2
                top = (self.height() - size.height()) / 2
                painter.drawImage(QRectF(left, top, size.width(), size.height()), self._image)
            if self._gone:
                self._paint_gone(painter)

    def _paint_gone(self, painter: QPainter) -> None:
        """What is seen is not how it is now."""
        veil = QColor(colours().panel)
        veil.setAlphaF(0.75)
        painter.fillRect(self.rect(), veil)
        painter.setPen(QColor(colours().trouble))
        wrapped = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
        painter.drawText(self.rect().adjusted(6, 6, -6, -6), wrapped, "No picture comes")

    def _look(self) -> None:
        """Take the latest frame, if it is another one."""
        parent = self.parentWidget()
        if parent is None or not parent.isVisible():
            return
        frame, state = self._session.frame(), self._session.state
        self.setVisible(frame is not None)
        gone = state is not None and any("no picture" in one.alarms for one in state.cameras[:1])
        if gone != self._gone:
            self._gone = gone
            self.update()
        if frame is None:
            self._image = None
        elif frame[0] != self._arrived:
            self._arrived, picture = frame
            height, width = picture.shape[:2]
            form = QImage.Format.Format_BGR888
            self._image = QImage(picture.data, width, height, picture.strides[0], form).copy()
            self.update()


#: Seconds of countdown that can be chosen.
COUNTDOWNS = (0, 3, 5)


class NextRecording(QWidget):
    """A form; further rows may be added to it.

    Parameters
    ----------
    session : Session

    Attributes
    ----------
    form : QFormLayout
    task, countdown : QComboBox
    name : QLineEdit
    """

    def __init__(self, session: CaptureController) -> None:
        super().__init__()
        self._session, self._document = session, session.document
        self._asking = False  # whether a task is nearly the same as one there is
        self._make_fields()
        self.form = QFormLayout(self)
        self.form.setContentsMargins(0, 0, 0, 0)
        self.form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
        self.form.addRow("Task", self.task)
        self.form.addRow("Name", self.name)
        self.form.addRow("Countdown", self.countdown)
        session.changed.connect(self.refresh)
        session.kept.connect(self.list_tasks)
        self._document.project_changed.connect(self._project_changed)
        self._document.listing_changed.connect(self.show_name)
        self._document.demonstration_changed.connect(self._offer_task)
        self.list_tasks()
        self.refresh()

    def _make_fields(self) -> None:
        """Task, name and countdown."""
        self.task = QComboBox()
        self.task.setEditable(True)
        self.task.setInsertPolicy(QComboBox.InsertPolicy.NoInsert)
        self.task.setAccessibleName("Task of the recordings")
        self.task.setSizeAdjustPolicy(
            QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon
        )
        edit = self.task.lineEdit()
        assert edit is not None
        edit.setPlaceholderText("such as LEGO")
        edit.editingFinished.connect(self.take_task)
        self.task.activated.connect(self.take_task)
        self.name = QLineEdit()
        self.name.setAccessibleName("Name of the next recording; empty for the next number")
        self.name.textEdited.connect(self._name_edited)
        self.countdown = QComboBox()
        self.countdown.setAccessibleName("Countdown before recording")
        for seconds in COUNTDOWNS:
            text = f"{seconds} s" if seconds else "none"
            self.countdown.addItem(text, seconds)
        self.countdown.currentIndexChanged.connect(self._countdown_chosen)

    def take_task(self) -> None:
        """The next recordings are of the task that is written here."""
        task = tidy_name(self.task.currentText())
        if task == self._session.task or self._asking:
            self._write_task(self.task.currentText())
            return
        self._asking = True  # the question takes the keyboard from the field
        task = settle_name(self, task, self._tasks())
        self._asking = False
        self._write_task(task)
        self._session.set_task(task)

    def _write_task(self, task: str) -> None:
        """Show a task, of a long name its beginning."""
        self.task.setCurrentText(task)
        self.task.setToolTip(task)
        edit = self.task.lineEdit()
        assert edit is not None
        edit.setCursorPosition(0)

    def _tasks(self) -> tuple[str, ...]:
        """The tasks of the project, recorded and planned."""
        project = self._document.project
        if project is None:
            return ()
        return tuple(
            dict.fromkeys((*project.demonstrations.tasks(), *project.actions.vocabularies()))
        )

    def list_tasks(self) -> None:
        """Offer the tasks of the project; the one that was chosen stays."""
        chosen = self.task.currentText()
        if not chosen and self._document.demonstration is not None:
            chosen = self._document.demonstration.task
        self.task.blockSignals(True)
        self.task.clear()
        self.task.addItems(self._tasks())
        self._write_task(chosen)
        self.task.blockSignals(False)
        self._session.set_task(chosen)

    def refresh(self) -> None:
        """Show what can be changed now."""
        phase = self._session.phase
        for field in (self.task, self.name, self.countdown):
            field.setEnabled(
                phase in (CaptureState.APART, CaptureState.READY, CaptureState.CONNECTING)
            )
        if phase is CaptureState.READY and self.name.text() and not self._session.name:
            self.name.clear()
        self.show_name()

    def show_name(self) -> None:
        """Show what the next recording will be called."""
        if self._session.phase in (CaptureState.APART, CaptureState.READY) and self.isVisible():
            self.name.setPlaceholderText(self._session.next_name())

    def _project_changed(self) -> None:
        """Another project has other tasks."""
        self.task.setCurrentText("")
        self.list_tasks()

    def _offer_task(self) -> None:
        """As long as no task was chosen, that of the demonstration that is open."""
        if not self.task.currentText() and self._session.phase is CaptureState.APART:
            self.list_tasks()

    def _name_edited(self, text: str) -> None:
        self._session.name = text.strip()

    def _countdown_chosen(self) -> None:
        self._session.countdown = int(self.countdown.currentData())


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
        self.session = CaptureController(document, jobs, self)
        self.sources = DeviceList(self.session, jobs)
        self.live = LiveView(self.session)
        self.picture = CameraView(self.session)
        self.scalogram = LiveScalogramView(self.session, jobs, self.live)
        self.scalogram_channel = ScalogramChoice(self.session, self.scalogram)
        self.recognition = RecognitionPanel(self.session)
        self.recogniser = RecogniserChoice(self.session, self)
        self.standing = StatusPanel(self.session)
        self.fields = NextRecording(self.session)
        self.held = HeldKeys(self, lambda: self.session.vocabulary, self.session.mark)
        self._looked = False
        self._make_buttons()
        self._lay_out()
        self.session.changed.connect(self._changed)
        self.session.ticked.connect(self._show_whether_recording_can_begin)
        document.project_changed.connect(self._project_changed)
        document.review.training_changed.connect(self.recogniser.refresh)
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
        emphasise(self.record_button)
        self.discard_button = QPushButton()
        self.discard_button.clicked.connect(self.session.discard)
        self.recover_button = QPushButton()
        self.recover_button.clicked.connect(self.session.recover)
        self.clock = ElapsedTime(self.session)
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
        ignore_wheel(
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
        upper.addWidget(separator())
        upper.addWidget(self.fields)
        # What is pressed while hands are full is always there; what was set up before may scroll.
        recording = QVBoxLayout()
        recording.setContentsMargins(8, 0, 8, 8)
        for widget in (self.legend, self.clock, self.record_button, self.discard_button):
            recording.addWidget(widget)
        side = QWidget()
        side.setMinimumWidth(SIDE)
        above = scroll_area(setting_up)
        page_layout(side, above, growing=above, spacing=6).addLayout(recording)
        return side

    def _right_side(self) -> QWidget:
        """What comes, and how it does."""
        views = QSplitter(Qt.Orientation.Vertical)
        views.addWidget(scroll_area(self.live))
        views.addWidget(self.scalogram)
        views.setStretchFactor(0, 3)
        views.setStretchFactor(1, 2)
        views.setChildrenCollapsible(False)
        main = QWidget()
        page_layout(main, views, self.recognition, self.standing, growing=views)
        return main

    # What is pressed

    def record(self) -> None:
        """Record, or stop; the keys of actions mark from now on."""
        self.fields.take_task()
        if self.session.phase in (CaptureState.READY, CaptureState.RECORDING):
            self.held.release_all()
            # Letters mark actions from now on and are no text.
            self.live.setFocus()
        self.session.record_or_stop()

    def cancel(self) -> bool:
        """Take back what was begun last: a mark that grows, or a countdown; gives whether it was.

        A recording is not ended by it, and what is written in a field is left first.
        """
        if is_typing(QApplication.focusWidget()):
            return False
        if self.session.phase is CaptureState.COUNTING:
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
        if self.session.phase is CaptureState.APART:
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
        apart = phase is CaptureState.APART
        if phase is not CaptureState.RECORDING:
            self.held.forget_begun()
        text = "Connect" if apart else "Disconnect"
        under_way = {
            CaptureState.CONNECTING: "Connecting…",
            CaptureState.LEAVING: "Disconnecting…",
        }
        _connect_announcements(self.connect_button, under_way.get(phase, text))
        set_enabled_with_reason(self.connect_button, self._obstacle_to_connect(phase))
        self.sources.set_open(apart)
        zeroing = phase in (CaptureState.READY, CaptureState.COUNTING)
        set_enabled_with_reason(
            self.zero_button, "" if zeroing else "Connect devices before zeroing them."
        )
        words = {
            CaptureState.COUNTING: "Cancel",
            CaptureState.STARTING: "Starting…",
            CaptureState.RECORDING: "Stop and keep",
            CaptureState.KEEPING: "Keeping…",
            CaptureState.DISCARDING: "Discarding…",
            CaptureState.RECOVERING: "Recovering…",
            CaptureState.STUCK: "Retry saving",
        }
        _connect_announcements(
            self.record_button, words.get(phase, "Record"), keys().shown("record")
        )
        self._show_whether_recording_can_begin()
        self._show_discard()
        left = session.left_behind
        _connect_announcements(self.recover_button, f"Recover unfinished recordings: {left}")
        self.recover_button.setToolTip(
            "Make demonstrations of recordings that a crash or a power cut ended"
        )
        self.recover_button.setVisible(left > 0)
        free = phase in (CaptureState.APART, CaptureState.READY)
        set_enabled_with_reason(self.recover_button, "" if free else "Wait until this is done.")

    def _obstacle_to_connect(self, phase: CaptureState) -> str:
        """Why devices cannot be connected or disconnected now; empty where they can."""
        if self.document.project is None:
            return "Open or make a project first; recordings go into it."
        if phase is CaptureState.STUCK:
            return "Keep or discard the last recording first."
        return "Wait until this is done." if phase in BUSY_STATES else ""

    def _show_whether_recording_can_begin(self) -> None:
        """Devices may be unplugged and plugged in again at any moment."""
        session, obstacle = self.session, self.session.obstacle
        can = (
            session.phase not in BUSY_STATES
            and session.phase is not CaptureState.APART
            and not obstacle
        )
        if self.record_button.isEnabled() != can or self.record_button.toolTip() != obstacle:
            reason = obstacle or "Connect devices before recording."
            if session.phase in BUSY_STATES:
                reason = "Wait until this is done."
            set_enabled_with_reason(self.record_button, "" if can else reason)
            self.record_button.setToolTip(obstacle)

    def _show_discard(self) -> None:
        """What would be discarded: what is recorded, or what was kept last."""
        session, text = self.session, "Discard"
        can = session.phase in (CaptureState.COUNTING, CaptureState.RECORDING, CaptureState.STUCK)
        kept = session.last.kept
        if kept is not None and session.phase in (CaptureState.READY, CaptureState.APART):
            can = True
            name = self.fontMetrics().elidedText(kept.added.name, NAMES, SIDE // 3)
            words = "Discard '{0}'", "Really discard '{0}'"
            text = words[session.last.asked].format(name)
        _connect_announcements(self.discard_button, text, keys().shown("discard_recording"))
        set_enabled_with_reason(
            self.discard_button, "" if can else "There is no recording to discard."
        )


def _connect_announcements(button: QPushButton, text: str, key: str = "") -> None:
    """Write on a button what it does and which key does it."""
    shown = f"{text}  ({key})" if key else text
    if button.text() != shown:
        button.setText(shown)
        button.setAccessibleName(text)
