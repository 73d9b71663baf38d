"""The transport: the bar that controls playback, and the readouts in it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from PySide6.QtCore import QEvent, QRectF, QSize, Qt, QTimer
from PySide6.QtGui import (
    QColor,
    QFocusEvent,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPalette,
    QResizeEvent,
    QShowEvent,
)
from PySide6.QtWidgets import (
    QBoxLayout,
    QComboBox,
    QFrame,
    QHBoxLayout,
    QLineEdit,
    QSizePolicy,
    QSpinBox,
    QToolButton,
    QWidget,
)

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.icons import icon, paint_icon
from forcelab.gui.label.history import time_of_edit
from forcelab.gui.label.key_labelling import pending
from forcelab.gui.label.playback import SPEEDS, Player
from forcelab.gui.layout import fill_layout, set_enabled_with_reason, tool_button
from forcelab.gui.preferences import REACTION_TIME
from forcelab.gui.shortcuts import keys
from forcelab.gui.theme import colours, themes
from forcelab.gui.widgets import ElidedLabel
from forcelab.segment_edits import SLIVER

#: The time of the last edit is looked up when nothing was painted for so many ms.
PAUSE = 120


class SavedIndicator(QWidget):
    """Says that all labels are stored; or, in the colour of trouble, that an edit was not.

    An edit that could not be stored is not on screen either, so that what the coder sees is always
    stored; the trouble stays until an edit is stored again. Where text has no room only the icon is
    shown.
    """

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.document = document
        self.trouble = ""
        self.text = ""
        self._newest = 0  # the number of the last edit that is known to be stored
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)
        self._refresh_timer = QTimer(self, singleShot=True, interval=PAUSE)
        self._refresh_timer.timeout.connect(self.refresh)
        document.tracks_changed.connect(self._refresh_timer.start)
        document.demonstration_changed.connect(self._refresh_timer.start)
        document.store_failed.connect(self.fail)
        themes().changed.connect(self.update)
        self.refresh()

    def fail(self, sentence: str) -> None:
        """Show that the last edit was not stored, and why."""
        self.trouble = sentence
        self._refresh_timer.stop()
        self._show_text("Not stored", sentence)

    def refresh(self) -> None:
        """Read when the last edit was stored."""
        document = self.document
        if document.project is None or not document.id:
            self._show_text("", "")
            return
        try:
            last = document.project.tracks.history(document.id, document.author, latest=1)
        except ForcelabError as error:
            self.fail(str(error))
            return
        newest = last[0].id if last else 0
        if self.trouble and newest == self._newest:
            return
        self.trouble, self._newest = "", newest
        text = f"Stored {time_of_edit(last[0].time)}" if last else "All stored"
        self._show_text(text, "Every edit is stored before it is shown; there is nothing to save.")

    def sizeHint(self) -> QSize:
        height = self.fontMetrics().height() + 6
        width = self.fontMetrics().horizontalAdvance(self.text)
        return QSize(height + width + 6 if self.text else 0, height)

    def minimumSizeHint(self) -> QSize:
        height = self.fontMetrics().height() + 6
        return QSize(height if self.text else 0, height)

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        self.updateGeometry()

    def paintEvent(self, event: QPaintEvent) -> None:
        if not self.text:
            return
        theme = colours()
        with QPainter(self) as painter:
            side = self.fontMetrics().height()
            sign = QRectF(2, (self.height() - side) / 2, side, side)
            ink = QColor(theme.trouble if self.trouble else theme.muted)
            paint_icon(painter, sign, "warning" if self.trouble else "stored", ink)
            room = QRectF(self.rect()).adjusted(side + 6, 0, 0, 0)
            if room.width() >= self.fontMetrics().horizontalAdvance(self.text):
                painter.setPen(ink)
                painter.drawText(room, Qt.AlignmentFlag.AlignVCenter, self.text)

    def _show_text(self, text: str, about: str) -> None:
        before = self.sizeHint()
        self.text = text
        self.setToolTip(about)
        self.setAccessibleName(f"{text}. {about}" if about else text)
        if self.sizeHint() != before:  # each stroke says a time: the window is not laid out anew
            self.updateGeometry()
        self.update()


class TimeEdit(QLineEdit):
    """The cursor's time, which can be typed over to jump."""

    def __init__(self, document: Document) -> None:
        super().__init__()
        self._document = document
        self.setAccessibleName("Time in seconds; type one to jump there")
        self.setToolTip("Time of the cursor; type another one to jump there")
        self.setAlignment(Qt.AlignmentFlag.AlignRight)
        self._fit()
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.returnPressed.connect(self._jump)
        self.editingFinished.connect(self._leave)
        self._clicked_into = False

    def show_cursor(self) -> None:
        """Show the cursor's time, unless a time is being typed."""
        if not self.isModified():
            selected = self.hasSelectedText()
            self.setText(f"{self._document.view.cursor:.3f}")
            if selected:  # in playback, too, what is typed next takes its place
                self.selectAll()

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        self._clicked_into = event.reason() == Qt.FocusReason.MouseFocusReason

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Select the whole time at the click that leads here: digits are not typed into it."""
        super().mouseReleaseEvent(event)
        if self._clicked_into and not self.hasSelectedText():
            self.selectAll()
        self._clicked_into = False

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.FontChange:
            self._fit()

    def _fit(self) -> None:
        self.setFixedWidth(self.fontMetrics().horizontalAdvance("00000.000") + 16)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Escape discards what was typed."""
        if event.key() == Qt.Key.Key_Escape:
            self.clearFocus()
        else:
            super().keyPressEvent(event)

    def _jump(self) -> None:
        typed = self.text().strip()
        try:
            self._document.view.seek(_seconds(typed))
        except ValueError:
            self._document.refuse(f"'{typed}' is no time; type seconds such as 12.5, or 1:05.2.")
        self.clearFocus()

    def _leave(self) -> None:
        self.setModified(False)
        self.show_cursor()


class Readout(QWidget):
    """A text that may change with every frame: it is drawn anew, and nothing around it.

    A label asks for another layout of its window each time, which takes longer than all panels.
    Where there is no room for the whole text, there is none of it.
    """

    def __init__(self) -> None:
        super().__init__()
        self._text = self._widest = ""
        self.setSizePolicy(QSizePolicy.Policy.Maximum, QSizePolicy.Policy.Preferred)

    def text(self) -> str:
        return self._text

    def say(self, text: str, widest: str = "") -> None:
        """Show a text in the width of `widest`, so that nothing moves."""
        if widest != self._widest:
            self._widest = widest
            self.updateGeometry()
        if text != self._text:
            self._text = text
            self.setAccessibleName(text)
            self.update()

    def sizeHint(self) -> QSize:
        wide = self.fontMetrics().horizontalAdvance(self._widest) + 2 if self._widest else 0
        return QSize(wide, self.fontMetrics().height())

    def minimumSizeHint(self) -> QSize:
        return QSize(0, self.fontMetrics().height())

    def paintEvent(self, event: QPaintEvent) -> None:
        if self.width() < self.fontMetrics().horizontalAdvance(self._text):
            return
        with QPainter(self) as painter:
            painter.setPen(self.palette().color(self.foregroundRole()))
            middle = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
            painter.drawText(self.rect(), middle, self._text)


def _seconds(typed: str) -> float:
    """Seconds from ``12.5``, ``12.5 s``, ``1:05.2`` or ``1:00:05``."""
    total = 0.0
    for part in typed.removesuffix("s").split(":"):
        total = total * 60 + float(part)
    if not math.isfinite(total):
        raise ValueError(typed)
    return total


#: The commands that buttons carry out, by the names of their icons.
BUTTON_COMMANDS = {
    "start": "to_start",
    "step-back": "step_back",
    "play": "play",
    "step-forward": "step_forward",
    "end": "to_end",
    "magnet": "snapping",
}
#: From this width on, in average characters, everything stands in one row.
ONE_ROW_WIDTH = 150


class Transport(QWidget):
    """The bar below the panels."""

    def __init__(self, document: Document, player: Player) -> None:
        super().__init__()
        self.document, self.player = document, player
        self.setAccessibleName("Transport")
        self.buttons: dict[str, QToolButton] = {}
        self.speed = QComboBox()
        self.speed.addItems([_speed_text(speed) for speed in SPEEDS])
        self.speed.setToolTip("Speed of playback")
        self.speed.setAccessibleName("Speed of playback")
        self.speed.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.speed.activated.connect(lambda at: document.view.set_speed(SPEEDS[at]))
        self.time = TimeEdit(document)
        self.length, self.frame = Readout(), Readout()
        self.range = ElidedLabel()
        self.range.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.range.setAccessibleName("Marked range")
        field = REACTION_TIME.field
        self.reaction = QSpinBox(
            maximum=round(field.highest),
            singleStep=round(field.step),
            prefix="Reaction ",
            suffix=f" {field.unit}",
        )
        self.saved = SavedIndicator(document)
        self._rows = QBoxLayout(QBoxLayout.Direction.LeftToRight, self)
        self._line = QFrame(frameShape=QFrame.Shape.VLine)
        self._line.setForegroundRole(QPalette.ColorRole.Mid)
        self._groups = self._playback_row(), self._labelling_row()
        parts = self._groups[0], self._line, (self._groups[1], 1)
        fill_layout(self._rows, *parts, margins=(6, 3, 6, 3), spacing=4)
        document.view.cursor_moved.connect(self._show_time)
        document.demonstration_changed.connect(self._update)
        document.view.frame_times_changed.connect(self._show_time)
        document.view.range_changed.connect(self._show_range)
        for changed in (document.stroke_changed, document.vocabulary_changed):
            changed.connect(self._show_range)
        document.view.playing_changed.connect(self._show_playing)
        document.view.snapping_changed.connect(self._show_snapping)
        player.loop_changed.connect(self.buttons["loop"].setChecked)
        keys().changed.connect(self._name_keys)
        self._name_keys()
        self._update()

    def sizeHint(self) -> QSize:
        return self._rows.sizeHint()

    def minimumSizeHint(self) -> QSize:
        wide = max(group.minimumSize().width() for group in self._groups)
        return QSize(wide + 12, self._rows.minimumSize().height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Use one row where there is room for it, else two."""
        super().resizeEvent(event)
        wide = self.width() >= ONE_ROW_WIDTH * self.fontMetrics().averageCharWidth()
        directions = QBoxLayout.Direction
        direction = directions.LeftToRight if wide else directions.TopToBottom
        if direction != self._rows.direction():
            self._rows.setDirection(direction)
            self._line.setVisible(wide)
            self.updateGeometry()

    def showEvent(self, event: QShowEvent) -> None:
        """Show what changed while it was hidden."""
        super().showEvent(event)
        self._update()

    # Layout

    def _playback_row(self) -> QHBoxLayout:
        """Buttons that move the cursor, the speed and the time."""
        document, player = self.document, self.player
        row = QHBoxLayout()
        row.setSpacing(1)
        self._button(row, "start", "To the start", lambda: self._to_end(0))
        self._button(row, "step-back", "Step back", lambda: document.view.step(-1), repeat=True)
        self._button(row, "play", "Play", player.toggle)
        self._button(
            row, "step-forward", "Step forward", lambda: document.view.step(1), repeat=True
        )
        self._button(row, "end", "To the end", lambda: self._to_end(1))
        loop = self._button(row, "loop", "Loop", lambda: None)
        loop.setCheckable(True)
        loop.toggled.connect(player.set_loop)
        readouts = (3, self.speed), (6, self.time), (4, self.length), (8, self.frame)
        for room, readout in readouts:
            row.addSpacing(room)
            row.addWidget(readout)
        row.addStretch(1)
        for label in (self.length, self.frame):
            label.setForegroundRole(QPalette.ColorRole.PlaceholderText)
        return row

    def _labelling_row(self) -> QHBoxLayout:
        """Snapping, reaction time, the marked range, and whether all is stored."""
        row = QHBoxLayout()
        row.setSpacing(4)
        snap = self._button(
            row,
            "magnet",
            "Snap to contacts, edges, frames and samples; not while you drag with Ctrl",
            lambda: None,
        )
        snap.setCheckable(True)
        snap.toggled.connect(self.document.view.set_snapping)
        self.reaction.setToolTip(REACTION_TIME.field.tip)
        self.reaction.setAccessibleName("Reaction time in milliseconds")
        self._show_reaction_time()
        REACTION_TIME.changed.connect(self._show_reaction_time)
        self.reaction.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.reaction.setKeyboardTracking(False)
        self.reaction.lineEdit().returnPressed.connect(self.reaction.clearFocus)
        self.reaction.setButtonSymbols(QSpinBox.ButtonSymbols.NoButtons)
        self.reaction.valueChanged.connect(REACTION_TIME.set_value)
        row.addWidget(self.reaction)
        row.addSpacing(6)
        return fill_layout(row, (self.range, 1), self.saved)

    def _button(
        self,
        row: QHBoxLayout,
        name: str,
        text: str,
        verb: Callable[[], object],
        *,
        repeat: bool = False,
    ) -> QToolButton:
        """Add a button with an icon; a click leaves the keyboard where it is."""
        button = tool_button(name, text, verb)
        button.setIconSize(QSize(18, 18))
        button.setAutoRaise(True)
        button.setAutoRepeat(repeat)
        button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.buttons[name] = button
        row.addWidget(button)
        return button

    def _to_end(self, index: int) -> None:
        self.document.view.seek(self.document.view.bounds[index])

    # Updates

    def _name_keys(self) -> None:
        """Say in the buttons' tooltips what they do, and which key does it as well."""
        for name, button in self.buttons.items():
            key = keys().shown(BUTTON_COMMANDS[name]) if name in BUTTON_COMMANDS else ""
            text = button.accessibleName()
            button.setToolTip(f"{text} ({key})" if key else text)

    def _update(self) -> None:
        is_open = self.document.demonstration is not None
        moving = (button for name, button in self.buttons.items() if name not in ("loop", "magnet"))
        for widget in (*moving, self.speed, self.time):
            set_enabled_with_reason(widget, "" if is_open else "Open a demonstration first.")
        length = f"/ {self.document.view.bounds[1]:.3f} s" if is_open else ""
        self.length.say(length, length)
        self._show_playing()
        self._show_snapping()
        self._show_range()
        self._show_time()

    def _show_time(self) -> None:
        """Show the cursor's time and frame."""
        if not self.isVisible():
            return
        self.time.show_cursor()
        frames = self.document.view.frame_times
        if frames is None or not len(frames):
            self.frame.say("")
            return
        # A cursor within float dust of a frame is on that frame.
        number = int(np.searchsorted(frames, self.document.view.cursor + SLIVER, side="right"))
        # As wide as the last one, so that nothing moves during playback.
        widest = "0" * len(str(len(frames)))
        self.frame.say(f"frame {number or '–'}", f"frame {widest}")
        self.frame.setToolTip(f"{number} of {len(frames)} video frames")

    def _show_range(self) -> None:
        """Show what was begun and waits for its end, or else the marked range."""
        text = ""
        if (begun := pending(self.document)) is not None:
            text = begun.what + begun.how
        elif self.document.view.range is not None:
            start, end = self.document.view.range
            text = f"range {start:.3f}–{end:.3f} s ({end - start:.3f} s)"
        self.range.set_text(text)

    def _show_playing(self) -> None:
        """Show whether and how fast the demonstration plays."""
        playing, speed = self.document.view.playing, self.document.view.speed
        play = self.buttons["play"]
        play.setIcon(icon("pause" if playing else "play"))
        text = "Pause" if playing else "Play"
        play.setAccessibleName(text)
        self._name_keys()
        if speed in SPEEDS:
            self.speed.setCurrentIndex(SPEEDS.index(speed))
        else:
            self.speed.setCurrentIndex(-1)
            self.speed.setPlaceholderText(_speed_text(speed))

    def _show_reaction_time(self) -> None:
        self.reaction.setValue(REACTION_TIME.value)

    def _show_snapping(self) -> None:
        self.buttons["magnet"].setChecked(self.document.view.snapping)


def _speed_text(speed: float) -> str:
    return f"{speed:g}×"
