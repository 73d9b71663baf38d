"""The Capture workspace: devices and the next recording at the left, live views at the right."""

from __future__ import annotations

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QHideEvent, QImage, QPainter, QPaintEvent, QShowEvent
from PySide6.QtWidgets import (
    QApplication,
    QComboBox,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QPushButton,
    QSizePolicy,
    QSplitter,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui.capture.controller import (
    BUSY_STATES,
    IDLE_STATES,
    RECORD_DOT,
    WAIT,
    CaptureController,
    CaptureState,
)
from forcelab.gui.capture.device_list import DeviceList
from forcelab.gui.capture.live_plot import LiveView
from forcelab.gui.capture.live_scalogram import LiveScalogramView, ScalogramChoice
from forcelab.gui.capture.marks import HeldKeys, MarkLegend
from forcelab.gui.capture.recognition_panel import RecogniserChoice, RecognitionPanel
from forcelab.gui.capture.status_panel import StatusPanel
from forcelab.gui.document import Document
from forcelab.gui.figures.colormap import translucent
from forcelab.gui.figures.text import NAMES
from forcelab.gui.jobs import Jobs
from forcelab.gui.key_events import ignore_wheel, is_typing
from forcelab.gui.layout import (
    emphasise,
    fill_layout,
    page_layout,
    push_button,
    scroll_area,
    separator,
    set_enabled_with_reason,
)
from forcelab.gui.shortcuts import keys
from forcelab.gui.text import settle_name
from forcelab.gui.theme import colours, themes
from forcelab.gui.widgets import show_text
from forcelab.text import tidy_name


class CameraView(QWidget):
    """Shows what the first camera sees; hidden while there is none."""

    def __init__(self, controller: CaptureController) -> None:
        super().__init__()
        self._controller = controller
        self._image: QImage | None = None
        self._arrived = 0.0
        self._is_away = False  # the camera gives no picture now
        self.setAccessibleName("Camera")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.hide()
        controller.ticked.connect(self._show_frame)
        controller.changed.connect(self._show_frame)

    def sizeHint(self) -> QSize:
        return QSize(240, 180)

    def minimumSizeHint(self) -> QSize:
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
            if self._is_away:
                self._paint_veil(painter)

    def _paint_veil(self, painter: QPainter) -> None:
        """Veil a frame that is not the present one."""
        painter.fillRect(self.rect(), translucent(colours().panel, 0.75))
        painter.setPen(QColor(colours().trouble))
        wrapped = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
        painter.drawText(self.rect().adjusted(6, 6, -6, -6), wrapped, "No picture comes")

    def _show_frame(self) -> None:
        """Take the latest frame, if it is another one."""
        parent = self.parentWidget()
        if parent is None or not parent.isVisible():
            return
        recorder, state = self._controller.recorder, self._controller.state
        cameras = [] if recorder is None else recorder.cameras
        frame = cameras[0].latest() if cameras else None
        self.setVisible(frame is not None)
        is_away = state is not None and any(
            "no picture" in camera.alarms for camera in state.cameras[:1]
        )
        if is_away != self._is_away:
            self._is_away = is_away
            self.update()
        if frame is None:
            self._image = None
        elif frame[0] != self._arrived:
            self._arrived, picture = frame
            height, width = picture.shape[:2]
            form = QImage.Format.Format_BGR888
            self._image = QImage(picture.data, width, height, picture.strides[0], form).copy()
            self.update()


class ElapsedTime(QLabel):
    """The time of the recording that runs, or that one may begin; hidden at other times."""

    def __init__(self, controller: CaptureController) -> None:
        super().__init__()
        self._controller = controller
        emphasise(self, 1.5)
        self.setAlignment(Qt.AlignmentFlag.AlignCenter)
        controller.changed.connect(self._changed)
        controller.ticked.connect(self._update_text)
        themes().changed.connect(self._changed)
        self._changed()

    def _changed(self) -> None:
        colour = colours().trouble if self._controller.recording else colours().text
        self.setStyleSheet(f"QLabel {{ color: {colour}; }}")
        self._update_text()

    def _update_text(self) -> None:
        state, phase = self._controller.state, self._controller.phase
        text = ""
        if phase is CaptureState.RECORDING and state is not None:
            minutes, seconds = divmod(state.seconds, 60)
            text = f"{RECORD_DOT} {int(minutes)}:{seconds:04.1f}"
        elif phase is CaptureState.READY:
            text = "No device" if self._controller.obstacle else "Ready"
        show_text(self, text)


#: Seconds of countdown that can be chosen.
COUNTDOWNS = (0, 3, 5)


class NextRecording(QWidget):
    """The form of the next recording; further rows may be added to it."""

    def __init__(self, controller: CaptureController) -> None:
        super().__init__()
        self._controller, self._document = controller, controller.document
        self._is_asking = False  # whether a task is nearly the same as one there is
        self._make_fields()
        self.form = QFormLayout(self)
        self.form.setContentsMargins(0, 0, 0, 0)
        self.form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
        self.form.addRow("Task", self.task)
        self.form.addRow("Name", self.name)
        self.form.addRow("Countdown", self.countdown)
        controller.changed.connect(self.refresh)
        controller.recording_saved.connect(self.list_tasks)
        self._document.project_changed.connect(self._project_changed)
        self._document.listing_changed.connect(self.show_name)
        self._document.demonstration_changed.connect(self._offer_task)
        self.list_tasks()
        self.refresh()

    def _make_fields(self) -> None:
        self.task = QComboBox(editable=True)
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
        """Take over the task that is written here."""
        task = tidy_name(self.task.currentText())
        if task == self._controller.task or self._is_asking:
            self._write_task(self.task.currentText())
            return
        self._is_asking = True  # the question takes the keyboard from the field
        task = settle_name(self, task, self._tasks())
        self._is_asking = False
        self._write_task(task)
        self._controller.set_task(task)

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
        self._controller.set_task(chosen)

    def refresh(self) -> None:
        """Show what can be changed now."""
        phase = self._controller.phase
        for field in (self.task, self.name, self.countdown):
            set_enabled_with_reason(field, self._controller.obstacle_to_set_up)
        if phase is CaptureState.READY and self.name.text() and not self._controller.name:
            self.name.clear()
        self.show_name()

    def show_name(self) -> None:
        if self._controller.phase in IDLE_STATES and self.isVisible():
            self.name.setPlaceholderText(self._controller.next_name())

    def _project_changed(self) -> None:
        """List the tasks of another project."""
        self.task.setCurrentText("")
        self.list_tasks()

    def _offer_task(self) -> None:
        """As long as no task was chosen, offer that of the open demonstration."""
        if not self.task.currentText() and self._controller.phase is CaptureState.DISCONNECTED:
            self.list_tasks()

    def _name_edited(self, text: str) -> None:
        self._controller.name = text.strip()

    def _countdown_chosen(self) -> None:
        self._controller.countdown = int(self.countdown.currentData())


#: Texts of the buttons; else "Disconnect" and "Record".
CONNECT_TEXTS = {
    CaptureState.DISCONNECTED: "Connect",
    CaptureState.CONNECTING: "Connecting…",
    CaptureState.DISCONNECTING: "Disconnecting…",
}
RECORD_TEXTS = {
    CaptureState.COUNTDOWN: "Cancel",
    CaptureState.STARTING: "Starting…",
    CaptureState.RECORDING: "Stop and keep",
    CaptureState.SAVING: "Keeping…",
    CaptureState.DISCARDING: "Discarding…",
    CaptureState.RECOVERING: "Recovering…",
    CaptureState.UNSAVED: "Retry saving",
}
#: Width of the left side at least, in average letters, and in pixels of letters of usual size.
SIDE_LETTERS, SIDE = 42, 250
#: The same of both sides when they are first laid out; what is added goes to the right one.
WINDOW = 900


class LeftSide(QWidget):
    """Widens with its letters."""

    def minimumSizeHint(self) -> QSize:
        wide = SIDE_LETTERS * self.fontMetrics().averageCharWidth()
        return QSize(wide, super().minimumSizeHint().height())


class CaptureWorkspace(QWidget):
    """Everything to record with."""

    def __init__(self, document: Document, jobs: Jobs) -> None:
        super().__init__()
        self.document = document
        self.controller = CaptureController(document, jobs, self)
        self.device_list = DeviceList(self.controller, jobs)
        self.live_view = LiveView(self.controller)
        self.camera_view = CameraView(self.controller)
        self.scalogram = LiveScalogramView(self.controller, jobs, self.live_view)
        self.scalogram_channel = ScalogramChoice(self.controller, self.scalogram)
        self.recognition = RecognitionPanel(self.controller)
        self.recogniser = RecogniserChoice(self.controller, self)
        self.status = StatusPanel(self.controller)
        self.next_recording = NextRecording(self.controller)
        self.held_keys = HeldKeys(self, lambda: self.controller.vocabulary, self.controller.mark)
        self._was_shown = False
        self._make_buttons()
        self._lay_out()
        self.controller.changed.connect(self._changed)
        self.controller.ticked.connect(self._update_record_button)
        document.project_changed.connect(self._project_changed)
        document.review.training_changed.connect(self.recogniser.refresh)
        keys().changed.connect(self._changed)
        self._changed()

    def release(self) -> str:
        """Release the devices; keeps what is being recorded, or says why not."""
        self.held_keys.release_all()
        return self.controller.release()

    # Qt

    def showEvent(self, event: QShowEvent) -> None:
        """Look what is plugged in, the first time, and draw from now on."""
        super().showEvent(event)
        self.controller.set_visible(True)
        self.recogniser.refresh()  # one may have been trained meanwhile
        if not self._was_shown:
            self._was_shown = True
            self.device_list.refresh()
            self.controller.find_unfinished()

    def hideEvent(self, event: QHideEvent) -> None:
        """Draw nothing; a recording goes on."""
        super().hideEvent(event)
        self.held_keys.release_all()
        self.controller.set_visible(False)

    # Building

    def _make_buttons(self) -> None:
        self.connect_button = push_button("", self._toggle_connection)
        tip = "Take the present readings of all devices for zero"
        self.zero_button = push_button("Zero", self.controller.zero, "Zero all devices", tip)
        self.record_button = push_button("", self.record)
        self.record_button.setMinimumHeight(2 * self.fontMetrics().height())
        emphasise(self.record_button)
        self.discard_button = push_button("", self.controller.discard)
        tip = "Make demonstrations of recordings that a crash or a power cut ended"
        self.recover_button = push_button("", self.controller.recover, tip=tip)
        self.elapsed = ElapsedTime(self.controller)
        self.legend = MarkLegend(self.controller, self)

    def _lay_out(self) -> None:
        sides = QSplitter(Qt.Orientation.Horizontal)
        sides.addWidget(self._build_left_side())
        sides.addWidget(self._build_right_side())
        sides.setStretchFactor(1, 1)
        sides.setChildrenCollapsible(False)
        # Long texts at the left would ask for half of a small window; they are wrapped instead.
        sides.setSizes([SIDE, WINDOW - SIDE])
        page_layout(self, sides)

    def _build_left_side(self) -> QWidget:
        """Devices, their picture, and what to record."""
        form = self.next_recording.form
        form.addRow("Recogniser", self.recogniser.which)
        form.addRow(self.recogniser.nothing)
        form.addRow("Latency", self.recogniser.latency)
        form.addRow("", self.recogniser.send)
        form.addRow("Scalogram", self.scalogram_channel)
        ignore_wheel(
            self.next_recording.task,
            self.next_recording.countdown,
            self.recogniser.which,
            self.recogniser.latency,
            self.scalogram_channel,
        )
        devices = fill_layout(QHBoxLayout(), (self.connect_button, 1), self.zero_button)
        setting_up = QWidget()
        upper = fill_layout(QVBoxLayout(setting_up), self.recover_button, margins=(8, 8, 8, 0))
        fill_layout(upper, (self.device_list, 1), devices, (self.camera_view, 3), 0)
        fill_layout(upper, separator(), self.next_recording)
        # What is pressed while hands are full is always visible; what was set up before may scroll.
        buttons = self.legend, self.elapsed, self.record_button, self.discard_button
        recording = fill_layout(QVBoxLayout(), *buttons, margins=(8, 0, 8, 8))
        side = LeftSide()
        above = scroll_area(setting_up)
        page_layout(side, above, growing=above, spacing=6).addLayout(recording)
        return side

    def _build_right_side(self) -> QWidget:
        """Live views, recognition, and the status of the devices."""
        views = QSplitter(Qt.Orientation.Vertical)
        views.addWidget(scroll_area(self.live_view))
        views.addWidget(self.scalogram)
        views.setStretchFactor(0, 3)
        views.setStretchFactor(1, 2)
        views.setChildrenCollapsible(False)
        main = QWidget()
        page_layout(main, views, self.recognition, self.status, growing=views)
        return main

    # What is pressed

    def record(self) -> None:
        """Record, or stop; the keys of actions mark from now on."""
        self.next_recording.take_task()
        if self.controller.phase in (CaptureState.READY, CaptureState.RECORDING):
            self.held_keys.release_all()
            # Letters mark actions from now on and are no text.
            self.live_view.setFocus()
        self.controller.record_or_stop()

    def cancel(self) -> bool:
        """Take back what was begun last: a mark that grows, or a countdown; gives whether it was.

        A recording is not ended by it, and what is written in a field is left first.
        """
        if is_typing(QApplication.focusWidget()):
            return False
        if self.controller.phase is CaptureState.COUNTDOWN:
            self.controller.record_or_stop()
            return True
        forgotten = self.controller.forget_mark()
        if forgotten is not None:
            self.held_keys.forget(forgotten)
        return forgotten is not None

    def _toggle_connection(self) -> None:
        """Connect the ticked devices, or release them."""
        self.next_recording.take_task()
        # The button is disabled meanwhile: the next field would get the keyboard, and keys as text.
        self.live_view.setFocus()
        if self.controller.phase is CaptureState.DISCONNECTED:
            self.device_list.remember()
            self.controller.connect_devices(self.device_list.devices, self.device_list.cameras)
        else:
            self.controller.disconnect_devices()

    # What is shown

    def _project_changed(self) -> None:
        """Show the recognisers and the unfinished recordings of another project."""
        self.recogniser.refresh()
        if self._was_shown:
            self.controller.find_unfinished()

    def _changed(self) -> None:
        """Show what can be pressed now, and how it is called."""
        controller, phase = self.controller, self.controller.phase
        if phase is not CaptureState.RECORDING:
            self.held_keys.forget_tap()
        _label_button(self.connect_button, CONNECT_TEXTS.get(phase, "Disconnect"))
        set_enabled_with_reason(self.connect_button, self._obstacle_to_connect(phase))
        self.device_list.set_choosing(phase is CaptureState.DISCONNECTED)
        zeroing = phase in (CaptureState.READY, CaptureState.COUNTDOWN)
        set_enabled_with_reason(
            self.zero_button, "" if zeroing else "Connect devices before zeroing them."
        )
        text = RECORD_TEXTS.get(phase, "Record")
        _label_button(self.record_button, text, keys().shown("record"))
        self._update_record_button()
        self._update_discard_button()
        text = f"Recover unfinished recordings: {controller.unfinished}"
        _label_button(self.recover_button, text)
        self.recover_button.setVisible(controller.unfinished > 0)
        set_enabled_with_reason(self.recover_button, "" if phase in IDLE_STATES else WAIT)

    def _obstacle_to_connect(self, phase: CaptureState) -> str:
        """Why devices cannot be connected or disconnected now; empty where they can."""
        if self.document.project is None:
            return "Open or make a project first; recordings go into it."
        if phase is CaptureState.UNSAVED:
            return "Keep or discard the last recording first."
        return WAIT if phase in BUSY_STATES else ""

    @property
    def obstacle_to_record(self) -> str:
        """Why a recording can neither begin nor end now; empty where it can."""
        if self.controller.phase in BUSY_STATES:
            return WAIT
        if self.controller.phase is CaptureState.DISCONNECTED:
            return "Connect devices before recording."
        return self.controller.obstacle

    def _update_record_button(self) -> None:
        """Devices may be unplugged and plugged in again at any moment."""
        set_enabled_with_reason(self.record_button, self.obstacle_to_record)

    def _update_discard_button(self) -> None:
        """What would be discarded: what is recorded, or what was kept last."""
        controller, text = self.controller, "Discard"
        discardable = controller.phase in (
            CaptureState.COUNTDOWN,
            CaptureState.RECORDING,
            CaptureState.UNSAVED,
        )
        last = controller.last_recording
        if last.recording is not None and controller.phase in IDLE_STATES:
            discardable = True
            name = self.fontMetrics().elidedText(last.recording.added.name, NAMES, SIDE // 3)
            text = f"Really discard '{name}'" if last.confirming else f"Discard '{name}'"
        _label_button(self.discard_button, text, keys().shown("discard_recording"))
        no_recording = "There is no recording to discard."
        reason = WAIT if controller.phase in BUSY_STATES else no_recording
        set_enabled_with_reason(self.discard_button, "" if discardable else reason)


def _label_button(button: QPushButton, text: str, key: str = "") -> None:
    """Write on a button what it does and which key does it."""
    caption = f"{text}  ({key})" if key else text
    if button.text() != caption:
        button.setText(caption)
        button.setAccessibleName(text)
