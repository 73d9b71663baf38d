"""The dialog that puts a video on the clock of the force."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QByteArray, QPoint, QPointF, QSignalBlocker, QSize, Qt
from PySide6.QtGui import QImage, QMouseEvent
from PySide6.QtWidgets import (
    QApplication,
    QCheckBox,
    QDialog,
    QDialogButtonBox,
    QGridLayout,
    QGroupBox,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QPushButton,
    QSizePolicy,
    QSlider,
    QTableWidget,
    QTableWidgetItem,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from forcelab.clock import ClockMap, fit_clock
from forcelab.demonstration import Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.gui import settings
from forcelab.gui.document import Document
from forcelab.gui.figures.colormap import translucent
from forcelab.gui.figures.text import signed
from forcelab.gui.jobs import Jobs
from forcelab.gui.kit.plot import Plot
from forcelab.gui.label.picture_view import PictureView
from forcelab.gui.label.video_frames import VideoFrames
from forcelab.gui.layout import (
    FRAME,
    fill_layout,
    label_of,
    push_button,
    seconds_box,
    set_enabled_with_reason,
    toned_label,
    whole_rows,
)
from forcelab.gui.theme import colours
from forcelab.gui.widgets import ElidedComboBox
from forcelab.jobs import Progress
from forcelab.project.media import name_video
from forcelab.signals.sync import Proposal, propose_clock_for
from forcelab.video.index import SAME


class AlignmentPlot(Plot):
    """Motion upwards and change of force downwards from a line between them, on the force clock.

    Where the clock is right their peaks meet. A click moves the cursor.
    """

    MARGINS = (12.0, 24.0, 12.0, 36.0)

    def __init__(self, document: Document) -> None:
        super().__init__(None, "force time (s)", zooms=True)
        self.document = document
        self._proposal: Proposal | None = None
        self._clock = ClockMap()
        self._taps: tuple[float, ...] = ()
        self._cursor = pg.InfiniteLine()
        self._press: QPointF | None = None
        self.setAccessibleName("Motion of the video and change of the force")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.box.setMouseEnabled(y=False)
        document.view.cursor_moved.connect(self._show_cursor)

    def sizeHint(self) -> QSize:
        return QSize(480, 9 * self.fontMetrics().height())

    def minimumSizeHint(self) -> QSize:
        return self.sizeHint()

    def show_signals(self, proposal: Proposal | None, note: str = "") -> None:
        """Show the compared signals, or a note in their place."""
        self._proposal = proposal
        self.say(note)
        self.redraw()

    def show_clock(self, clock: ClockMap, taps: tuple[float, ...]) -> None:
        """Map the motion by this clock; `taps` are marked at their force times (s)."""
        self._clock, self._taps = clock, taps
        self.redraw()

    def redraw(self) -> None:
        self.clear()
        if self._proposal is None:
            return
        theme, motion, force = colours(), self._proposal.motion, self._proposal.force
        self.show_all_of(self.document.view.bounds, (-1.05, 1.05))
        moved = self._clock.to_force(motion[0])
        for times, values, colour, name in (
            (moved, motion[1], theme.curves[0], "up: motion in the video"),
            (force[0], -force[1], theme.curves[1], "down: change of the force"),
        ):
            brush = pg.mkBrush(translucent(colour, 0.43))
            curve = pg.PlotDataItem(times, values, pen=colour, fillLevel=0.0, fillBrush=brush)
            self.add(curve, name)
            curve.setDownsampling(auto=True, method="peak")
            curve.setClipToView(True)
        self.add(pg.InfiniteLine(0.0, angle=0, pen=theme.frame))
        dashed = pg.mkPen(theme.hint, width=2.0, style=Qt.PenStyle.DashLine)
        self.add(pg.PlotCurveItem(pen=dashed), "dashed: taps")
        for tap in self._taps:
            self.add(pg.InfiniteLine(tap, pen=dashed))
        self._cursor = pg.InfiniteLine(self.document.view.cursor, pen=theme.cursor)
        self.add(self._cursor)

    def readout(self, pointer: QPointF) -> str:
        return f"{self.value_at(pointer).x():.3f} s" if self.area.contains(pointer) else ""

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self._press = event.position()
        super().mousePressEvent(event)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Move the cursor to where it was clicked, not at the end of a drag."""
        super().mouseReleaseEvent(event)
        start, self._press = self._press, None
        if event.button() != Qt.MouseButton.LeftButton or start is None or self._proposal is None:
            return
        if (event.position() - start).manhattanLength() < QApplication.startDragDistance():
            self.document.view.seek(self.value_at(event.position()).x())

    def _show_cursor(self) -> None:
        self._cursor.setValue(self.document.view.cursor)


class VideoPreview(QWidget):
    """A frame, and a slider, a number and buttons that choose it.

    `times` are the frames' own timestamps (s), shape (n,), empty until the video is open; `number`
    is the chosen frame, from 0.
    """

    def __init__(self) -> None:
        super().__init__()
        self.times: NDArray[np.float64] = np.empty(0)
        self.number = 0
        self._requested_time = 0.0
        self._open: tuple[VideoReference, Demonstration] | None = None
        self.frames = VideoFrames(self)
        self.picture = _FrameView()
        self.picture.setAccessibleName("Frame of the video")
        self.slider = QSlider(Qt.Orientation.Horizontal)
        self.slider.setAccessibleName("Frame")
        self.spin = seconds_box("Time on the video's own clock")
        self.previous_button, self.next_button = QToolButton(), QToolButton()
        for button, arrow, name, step in (
            (self.previous_button, Qt.ArrowType.LeftArrow, "Frame before", -1),
            (self.next_button, Qt.ArrowType.RightArrow, "Next frame", 1),
        ):
            button.setArrowType(arrow)
            button.setAutoRepeat(True)
            button.setToolTip(name)
            button.setAccessibleName(name)
            button.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
            button.clicked.connect(lambda _=False, step=step: self.show_frame(self.number + step))
        label = label_of(self.spin, "&Video time")
        row = fill_layout(
            QHBoxLayout(), label, self.spin, self.previous_button, self.next_button, 1
        )
        fill_layout(QVBoxLayout(self), (self.picture, 1), self.slider, row, margins=0)
        self.frames.opened.connect(self._opened)
        self.frames.frame_ready.connect(self._shown)
        self.frames.failed.connect(self._show_problem)
        self.frames.missed.connect(lambda _, sentence: self._show_problem(sentence))
        self.slider.valueChanged.connect(self.show_frame)
        self.spin.valueChanged.connect(self.show_time)

    @property
    def time(self) -> float:
        """The chosen frame's own time (s)."""
        return float(self.times[self.number]) if self.times.size else 0.0

    def open(self, video: VideoReference, demonstration: Demonstration) -> None:
        """Show a video of a demonstration."""
        self._open = video, demonstration
        self.times, self.number = np.empty(0), 0
        for control in self._controls:
            set_enabled_with_reason(control, "Wait until the video is open.")
        self.picture.say("")
        self.frames.open(video.path)

    def show_time(self, time: float) -> None:
        """Choose the last frame at or before a time (s) on the video's clock."""
        self._requested_time = time
        # The number on screen has three decimals: half a millisecond is the same frame.
        self.show_frame(int(np.searchsorted(self.times, time + 5e-4 + SAME, side="right")) - 1)

    def show_frame(self, number: int) -> None:
        """Choose the frame whose number is nearest."""
        if self.times.size == 0:
            return
        number = min(max(number, 0), self.times.size - 1)
        direction = int(np.sign(number - self.number))
        self.number = number
        image = self.frames.request_frame(number, direction)
        if image is not None:
            self._shown(number, image)
        self._show_position()

    @property
    def settled(self) -> bool:
        """Whether the frame is shown, or why it cannot be."""
        return bool(self.picture.caption or self.picture.message)

    def close_video(self) -> None:
        """Close the file; no thread is left."""
        self.frames.close()

    @property
    def _controls(self) -> tuple[QWidget, ...]:
        return (self.slider, self.spin, self.previous_button, self.next_button)

    def _opened(self, times: NDArray[np.float64]) -> None:
        """Begin at the frame that was asked for."""
        self.times = times
        for widget in self._controls:
            set_enabled_with_reason(widget, "")
        with QSignalBlocker(self.slider), QSignalBlocker(self.spin):
            self.slider.setRange(0, times.size - 1)
            self.slider.setPageStep(max(times.size // 20, 1))
            self.spin.setRange(float(times[0]), float(np.ceil(1000 * times[-1]) / 1000))
            self.spin.setSingleStep(float(np.median(np.diff(times))) if times.size > 1 else 1.0)
        self.show_time(self._requested_time)

    def _shown(self, number: int, image: QImage) -> None:
        """Show a decoded frame."""
        if number == self.number:
            self.picture.show_image(image, f"frame {number + 1} of {max(self.times.size, 1)}")

    def _show_problem(self, sentence: str) -> None:
        """Show why a frame cannot be shown."""
        self.picture.say(name_video(sentence, *self._open) if self._open else sentence)

    def _show_position(self) -> None:
        """Put slider and number where the frame is."""
        with QSignalBlocker(self.slider), QSignalBlocker(self.spin):
            self.slider.setValue(self.number)
            self.spin.setValue(self.time)


class _FrameView(PictureView):
    """The frame with its number, or a message in its place."""

    caption: str = ""
    message: str = ""

    def __init__(self) -> None:
        super().__init__()
        self.setMinimumSize(320, 200)

    def sizeHint(self) -> QSize:
        return QSize(480, 300)

    def show_image(self, image: QImage, caption: str) -> None:
        self.message, self.caption = "", caption
        self.set_image(image)

    def say(self, message: str) -> None:
        self.message, self.caption = message, ""
        self.set_image(None)


def _button(text: str, press: Callable[[], object]) -> QPushButton:
    """A button that screen readers name as it is labelled; Enter presses only the one in focus."""
    return push_button(text, press, text.replace("&", ""), auto_default=False)


#: The force tap is set to a contact event at most so far from the cursor (s).
SNAP = 0.08
#: Rates farther from 1 are mistakes.
LARGEST_RATE_ERROR = 2e-3
KEY = "synchronise"


@dataclass(frozen=True, slots=True)
class TapRow:
    """A tap: its times (s) on the video's clock and on the force's, as far as they are marked."""

    video: float | None = None
    force: float | None = None


class SynchroniseDialog(QDialog):
    """Offset and rate of the video's clock, from taps marked by hand or found automatically.

    Of several videos one is chosen, at first that which is given. `rows` are the taps, `candidate`
    the clock that Accept would store, `proposal` what was found. Size and place are those of the
    last time, and kept for the next one, if `remembering`.
    """

    def __init__(
        self,
        document: Document,
        jobs: Jobs,
        parent: QWidget | None = None,
        video: VideoReference | None = None,
        *,
        remembering: bool = True,
    ) -> None:
        super().__init__(parent)
        self._remembering = remembering
        self.document = document
        demonstration = self.demonstration
        self.video = video or demonstration.find_video()
        self.choice: ElidedComboBox | None = None
        self.preview = VideoPreview()
        self.plot = AlignmentPlot(document)
        left = QVBoxLayout()
        if len(demonstration.videos) > 1:
            left.addLayout(self._choice_row(demonstration.videos))
        fill_layout(left, (self.preview, 1), self._force_row())
        right = fill_layout(QVBoxLayout(), (self._taps_box(), 1), self._clock_box())
        top = fill_layout(QHBoxLayout(), (left, 3), (right, 2))
        fill_layout(QVBoxLayout(self), (top, 1), self.plot, self._button_row())
        self.jobs = jobs
        self._id = document.id
        self.rows: tuple[TapRow, ...] = ()
        self.candidate: ClockMap | None = None
        self.residual: float | None = None
        self.proposal: Proposal | None = None
        self.setWindowTitle(f"Synchronise video and force – {demonstration.name}")
        self.fit_rate.toggled.connect(lambda: self.set_rows(self.rows))
        self.table.currentCellChanged.connect(self._show_tap)
        document.view.cursor_moved.connect(self._show_cursor)
        document.demonstration_changed.connect(self._close_if_other)
        self._show_cursor()
        self.show_video(self.video)
        self._restore()

    @property
    def demonstration(self) -> Demonstration:
        """The open demonstration, with which the dialog is closed."""
        assert self.document.demonstration is not None
        return self.document.demonstration

    @property
    def settled(self) -> bool:
        """Whether all of it is on the screen."""
        return self.preview.settled

    def sizeHint(self) -> QSize:
        """Large enough to see a fingertip."""
        line = self.fontMetrics().height()
        return QSize(60 * line, 42 * line).expandedTo(super().sizeHint())

    def _restore(self) -> None:
        """Have size and place of the last time, else be small at the window's bottom right.

        The forces, which are to be clicked, stay in view there.
        """
        parent = self.parentWidget()
        geometry = settings.data("synchronise/geometry") if self._remembering else b""
        if geometry:
            self.restoreGeometry(QByteArray(geometry))
        elif parent is not None:
            room = parent.window().geometry()
            least = self.minimumSizeHint()
            self.resize(self.sizeHint().boundedTo(room.size() / 2).expandedTo(least))
            outside = self.size() + FRAME
            self.move(room.bottomRight() - QPoint(outside.width(), outside.height()))

    def _choice_row(self, videos: Sequence[VideoReference]) -> QHBoxLayout:
        self.choice = choice = ElidedComboBox()
        choice.addItems([video.name for video in videos])
        choice.setCurrentText(self.video.name)
        choice.setAccessibleName("Video to synchronise")
        choice.activated.connect(self._choose)
        return fill_layout(QHBoxLayout(), label_of(choice, "Vi&deo"), (choice, 1))

    def _force_row(self) -> QHBoxLayout:
        self.force_time = seconds_box("Cursor on the force clock")
        self.force_time.setRange(*self.document.view.bounds)
        self.force_time.setSingleStep(0.001)
        self.force_time.valueChanged.connect(self.document.view.seek)
        self.snap = QCheckBox("&Snap to contact events")
        self.snap.setAccessibleName("Snap to contact events")
        self.snap.setChecked(True)
        label = label_of(self.force_time, "F&orce time")
        return fill_layout(QHBoxLayout(), label, self.force_time, self.snap, 1)

    def _taps_box(self) -> QGroupBox:
        self.frame_button = _button("Set &video tap", self.mark_frame)
        self.force_button = _button("Set &force tap", self.mark_force)
        self.remove_button = _button("&Remove", self.remove)
        self.fit_rate = QCheckBox("Fit the rate too, from &two taps on")
        self.fit_rate.setAccessibleName("Fit the rate too, from two taps on")
        self.fit_rate.setChecked(True)
        self.table = QTableWidget(0, 3)
        self.table.setAccessibleName("Taps")
        self.table.setHorizontalHeaderLabels(["video, s", "force, s", "apart, ms"])
        header = self.table.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        header.setDefaultAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        whole_rows(self.table)
        self.table.setMinimumHeight(round(5.4 * self.fontMetrics().height()))
        box = QGroupBox("Taps")
        grid = QGridLayout(box)
        grid.addWidget(self.frame_button, 0, 0)
        grid.addWidget(self.force_button, 0, 1)
        grid.addWidget(self.remove_button, 0, 2)
        grid.addWidget(self.table, 1, 0, 1, 3)
        grid.addWidget(self.fit_rate, 2, 0, 1, 3)
        return box

    def _clock_box(self) -> QGroupBox:
        """The stored clock, the new one, and how good that is."""
        box = QGroupBox("Clock of the video")
        grid = QGridLayout(box)
        grid.setColumnStretch(1, 1)
        self.stored_label, self.new_label = QLabel(), QLabel()
        self.residual_label, self.confidence_label = QLabel(), QLabel()
        named = (
            ("stored", self.stored_label, 1),
            ("new", self.new_label, 1),
            ("taps are off by", self.residual_label, 3),
            ("confidence", self.confidence_label, 2),
        )
        for row, (name, value, lines) in enumerate(named):
            value.setWordWrap(lines > 1)
            value.setAlignment(Qt.AlignmentFlag.AlignTop)
            # Room for the longest sentence, so that nothing jumps.
            value.setMinimumHeight(lines * self.fontMetrics().lineSpacing())
            value.setAccessibleName(name)
            grid.addWidget(QLabel(name), row, 0, Qt.AlignmentFlag.AlignTop)
            grid.addWidget(value, row, 1)
        return box

    def _button_row(self) -> QHBoxLayout:
        self.propose_button = _button("Find &taps", self.propose)
        self.reset_button = _button("R&eset", self.reset)
        self.trouble = toned_label("trouble")
        self.accept_button = _button("&Accept", self.accept)
        self.cancel_button = _button("Cancel", self.reject)
        buttons = QDialogButtonBox()
        buttons.addButton(self.accept_button, QDialogButtonBox.ButtonRole.AcceptRole)
        buttons.addButton(self.cancel_button, QDialogButtonBox.ButtonRole.RejectRole)
        parts = self.propose_button, self.reset_button, (self.trouble, 1), buttons
        return fill_layout(QHBoxLayout(), *parts)

    # Verbs

    def show_video(self, video: VideoReference) -> None:
        """Synchronise this video of the demonstration."""
        self.jobs.cancel(KEY)
        set_enabled_with_reason(self.propose_button, "")
        self.video, self.stored = video, video.clock
        self.preview.open(video, self.demonstration)
        self.preview.show_time(float(self.stored.to_device(self.document.view.cursor)))
        self.reset()

    def mark_frame(self) -> None:
        """Set the video time of the tap that lacks one, or of a new tap, to the chosen frame's."""
        if self.preview.times.size:
            self._set_tap_time("video", self.preview.time)

    def mark_force(self) -> None:
        """Set the force time of a tap to the cursor, or to the contact event beside it."""
        time, contacts = self.document.view.cursor, self.document.view.contacts
        if self.snap.isChecked() and contacts.size:
            nearest = float(contacts[np.argmin(np.abs(contacts - time))])
            time = nearest if abs(nearest - time) <= SNAP else time
        self._set_tap_time("force", time)

    def remove(self) -> None:
        """Remove the selected tap."""
        row = self.table.currentRow()
        if 0 <= row < len(self.rows):
            self.set_rows(self.rows[:row] + self.rows[row + 1 :])

    def set_rows(self, rows: tuple[TapRow, ...]) -> None:
        """Replace the taps, and fit the clock to them."""
        self.rows = rows
        complete = [(r.video, r.force) for r in rows if r.video is not None and r.force is not None]
        self.candidate = self.residual = None
        self.trouble.clear()
        try:
            if complete:
                self.candidate, self.residual = self._fitted(complete)
        except InputError as error:
            self.trouble.setText(str(error))
        self._refresh()

    def propose(self) -> None:
        """Search for the clock in the background."""
        set_enabled_with_reason(self.propose_button, "Wait until the search is over.")
        self.trouble.clear()
        search = propose_clock_for(self.demonstration, self.video.name)
        self.jobs.run(search, self._proposed, self._failed, self._progress, KEY)

    def reset(self) -> None:
        """Remove all taps and what was found; the stored clock stays."""
        self.proposal = None
        self._show_hint()
        self.set_rows(())

    def accept(self) -> None:
        before, new = self.stored, self.candidate
        if new is not None:
            if not self.document.set_video_clock(new, self.video.name):
                return
            old, now = _offset_sentence(before), _offset_sentence(new)
            self.document.show_message(f"The video has a new clock: {now}; it had {old}.")
        super().accept()

    def done(self, result: int) -> None:
        """Close in any way: the search ends and the file is closed."""
        if self._remembering:
            settings.store("synchronise/geometry", bytes(self.saveGeometry().data()))
        self.jobs.cancel(KEY)
        self.preview.close_video()
        super().done(result)
        self.deleteLater()  # with it go its connections to the document

    # The proposal

    def _proposed(self, proposal: Proposal) -> None:
        """Show what was found; it is the candidate until a tap is marked."""
        set_enabled_with_reason(self.propose_button, "")
        self.proposal = proposal
        self.plot.show_signals(proposal)
        self.rows = tuple(TapRow(video, force) for video, force in proposal.taps)
        self.candidate, self.residual = proposal.clock, proposal.residual
        self._refresh(proposed=True)

    def _failed(self, error: Exception) -> None:
        set_enabled_with_reason(self.propose_button, "")
        self.trouble.setText(str(error))
        self._show_hint()

    def _progress(self, progress: Progress) -> None:
        share = 100.0 * progress.done / max(progress.total, 1)
        if self.proposal is None:
            self.plot.show_signals(None, f"{progress.text}  {share:.0f} %")

    # Inside

    def _choose(self) -> None:
        assert self.choice is not None
        if (name := self.choice.currentText()) != self.video.name:
            self.show_video(self.demonstration.find_video(name))

    def _fitted(self, taps: list[tuple[float, float]]) -> tuple[ClockMap, float]:
        """The clock through taps (video s, force s), and its residual (s).

        Equal times, or a clock that would run backwards, raise an InputError.
        """
        video, force = (np.array(times) for times in zip(*taps, strict=True))
        if len(taps) > 1 and self.fit_rate.isChecked():
            fit = fit_clock(video.tolist(), force.tolist())
            return fit.clock, fit.residual
        rate = self.stored.rate  # one tap says nothing about it
        clock = ClockMap(float(np.mean(force - rate * video)), rate)
        return clock, float(np.sqrt(np.mean((clock.to_force(video) - force) ** 2)))

    def _show_tap(self, number: int) -> None:
        """Show the frame and the force of a chosen tap."""
        if not 0 <= number < len(self.rows):
            return
        row = self.rows[number]
        if row.video is not None:
            self.preview.show_time(row.video)
        if row.force is not None:
            self.document.view.seek(row.force)

    def _set_tap_time(self, clock: Literal["video", "force"], time: float) -> None:
        """Set the time on a clock of the first tap that lacks it, or of a new tap."""
        rows = [*self.rows, TapRow()]
        place = next(i for i, row in enumerate(rows) if getattr(row, clock) is None)
        rows[place] = replace(rows[place], **{clock: time})
        self.set_rows(tuple(row for row in rows if row != TapRow()))

    def _show_cursor(self) -> None:
        with QSignalBlocker(self.force_time):
            self.force_time.setValue(self.document.view.cursor)

    def _close_if_other(self) -> None:
        if self.document.id != self._id:
            self.reject()

    def _show_hint(self) -> None:
        """Explain both ways to a clock in place of the curves, until something is found."""
        hint = (
            "Find taps compares the motion in the video with the force. Or by hand: choose a "
            "moment that shows in both, such as a tap; set the video tap at its frame and the "
            "force tap at its force time."
        )
        self.plot.show_signals(None, hint)

    def _refresh(self, proposed: bool = False) -> None:
        """Show taps and clocks as they are now."""
        clock = self.candidate or self.stored
        with QSignalBlocker(self.table):  # the coder has chosen no tap
            self._fill_table(clock)
        set_enabled_with_reason(self.remove_button, "" if self.rows else "There are no taps yet.")
        taps = tuple(row.force for row in self.rows if row.force is not None)
        self.plot.show_clock(clock, taps)
        self.stored_label.setText(_offset_sentence(self.stored))
        self.new_label.setText("–" if self.candidate is None else _offset_sentence(self.candidate))
        self.residual_label.setText(self._residual_text(proposed))
        self.confidence_label.setText(self._confidence_text() if proposed else "–")
        doubtful = proposed and self.proposal is not None and self.proposal.doubtful
        for label, wrong in (
            (self.confidence_label, doubtful),
            (self.residual_label, self._rate_is_wrong),
        ):
            colour = colours().warning if wrong else colours().text
            label.setStyleSheet(f"color: {colour}")
        none = "Set a video tap and its force tap, or press Find taps."
        set_enabled_with_reason(self.accept_button, none if self.candidate is None else "")
        # What is doubtful is accepted by whoever means it, not by Enter.
        self.accept_button.setDefault(not doubtful and not self._rate_is_wrong)
        if self.choice is not None:  # another video's taps would be lost
            set_enabled_with_reason(
                self.choice, "Accept or reset the taps first." if self.rows else ""
            )

    def _fill_table(self, clock: ClockMap) -> None:
        """List the taps, choose the last one, and show how far each is from the new clock."""
        self.table.setRowCount(len(self.rows))
        for number, row in enumerate(self.rows):
            difference = ""
            if row.video is not None and row.force is not None and self.candidate is not None:
                difference = signed(f"{1000 * (float(clock.to_force(row.video)) - row.force):+.1f}")
            for column, cell in enumerate((_seconds(row.video), _seconds(row.force), difference)):
                item = QTableWidgetItem(cell)
                item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
                self.table.setItem(number, column, item)
        if self.rows:
            self.table.setCurrentCell(len(self.rows) - 1, 0)

    @property
    def _rate_is_wrong(self) -> bool:
        """Whether the new clock runs as no clock does."""
        return self.candidate is not None and abs(self.candidate.rate - 1) > LARGEST_RATE_ERROR

    def _residual_text(self, proposed: bool) -> str:
        """How far the taps lie from the new clock, and what that tells."""
        count = sum(row.video is not None and row.force is not None for row in self.rows)
        if self.candidate is None or count == 0:
            return "–"
        if count == 1 and not proposed:
            return "one tap: the rate stays"
        if self._rate_is_wrong:
            return "clocks never differ this much: check the taps, or do not fit the rate"
        if self.residual is None or (count == 2 and self.residual < 1e-6):
            return "two taps always fit exactly; a third shows the error"
        return f"{1000 * self.residual:.1f} ms, root mean square"

    def _confidence_text(self) -> str:
        """How far what was found can be trusted."""
        assert self.proposal is not None
        value = f"{self.proposal.confidence:.2f}"
        if self.proposal.doubtful:
            return f"{value} – low: compare the frames at a tap before accepting"
        return f"{value} of 1"


def _seconds(time: float | None) -> str:
    """A time in the table; a dash where it is not marked."""
    return "–" if time is None else signed(f"{time:.3f}")


def _offset_sentence(clock: ClockMap) -> str:
    offset, rate = signed(f"{clock.offset:+.4f}"), signed(f"{1e6 * (clock.rate - 1):+.1f}")
    return f"offset {offset} s, rate {rate} ppm"
