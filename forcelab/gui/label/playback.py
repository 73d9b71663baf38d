"""Playback by a monotonic clock, and the bar that controls it.

The cursor is the master clock. Where it is depends on the time since playback started and on
nothing else, so that a late tick skips time on screen and never slows it; what follows the cursor,
such as the video, drops what it cannot show in time.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

import numpy as np
from PySide6.QtCore import QObject, QSize, Qt, QTimer, Signal
from PySide6.QtGui import QPalette, QResizeEvent, QShowEvent
from PySide6.QtWidgets import (
    QBoxLayout,
    QComboBox,
    QFrame,
    QHBoxLayout,
    QLabel,
    QSpinBox,
    QToolButton,
    QWidget,
)

from forcelab.gui import settings
from forcelab.gui.document import Document
from forcelab.gui.icons import icon
from forcelab.gui.label.readouts import FrameCounter, Readout, TimeEdit
from forcelab.gui.label.saved_indicator import SavedIndicator
from forcelab.gui.layout import set_enabled_with_reason

#: The speeds that the transport offers; normal speed is in the middle.
SPEEDS = (0.1, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0)
#: Time between two ticks in ms: 60 a second or a little more.
TICK = 16


class Player(QObject):
    """Plays a document's demonstration.

    It follows the document: whoever calls ``document.set_playing`` or ``document.set_speed``
    starts, stops or paces it, and whoever calls ``document.seek`` while it plays makes it go on
    from there.

    Parameters
    ----------
    document : Document
        Whose cursor is moved.
    clock : callable
        Seconds of a clock that never jumps; tests give their own.

    Attributes
    ----------
    loop : bool
        Whether to begin again at the end, instead of stopping there.
    """

    loop_changed = Signal(bool)

    def __init__(
        self,
        document: Document,
        parent: QObject | None = None,
        *,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__(parent)
        self.document = document
        self.loop = False
        self._clock = clock
        self._timer = QTimer(self, timerType=Qt.TimerType.PreciseTimer, interval=TICK)
        self._timer.timeout.connect(self.tick)
        self._own = False
        self._stretch: tuple[float, float] | None = None
        self._anchor = (0.0, 0.0, 1.0)  # clock, cursor and speed of the last start, seek or change
        document.playing_changed.connect(self._follow_playing)
        document.cursor_moved.connect(self._follow_cursor)
        document.demonstration_changed.connect(self.stop)

    # What one can ask for

    def start(self) -> None:
        """Play from the cursor to the end of the demonstration.

        With the cursor at the end it begins at the start. With :attr:`loop` on, a marked range is
        played over and over; without one, the whole demonstration.
        """
        stretch = self.document.range if self.loop else None
        self._play(stretch, self.document.cursor)

    def stop(self) -> None:
        """Stop where the cursor is."""
        self.document.set_playing(False)

    def toggle(self) -> None:
        """Start, or stop."""
        if self.document.playing:
            self.stop()
        else:
            self.start()

    def play_span(self, start: float, end: float) -> None:
        """Play ``[start, end]``, in seconds, once; over and over with :attr:`loop` on."""
        if end > start:
            self._play((start, end), start)

    def play_current(self) -> None:
        """Play the marked range, the selected segment or the one under the cursor, from its start.

        Without any of them, play on from the cursor.
        """
        document = self.document
        index = document.selected
        if index is None:
            here = document.cursor
            under = (i for i, s in enumerate(document.segments) if s.start <= here < s.end)
            index = next(under, None)
        if document.range is not None:
            self.play_span(*document.range)
        elif index is not None:
            segment = document.segments[index]
            self.play_span(segment.start, segment.end)
        else:
            self.start()

    def set_loop(self, loop: bool) -> None:
        """Begin again at the end, or stop there."""
        if loop != self.loop:
            self.loop = loop
            self.loop_changed.emit(loop)

    def faster(self) -> None:
        """Take the next speed of :data:`SPEEDS`."""
        above = (speed for speed in SPEEDS if speed > self.document.speed)
        self.document.set_speed(next(above, SPEEDS[-1]))

    def slower(self) -> None:
        """Take the speed of :data:`SPEEDS` before."""
        below = (speed for speed in reversed(SPEEDS) if speed < self.document.speed)
        self.document.set_speed(next(below, SPEEDS[0]))

    def normal_speed(self) -> None:
        """Play in real time."""
        self.document.set_speed(1.0)

    # How it goes

    def tick(self) -> None:
        """Move the cursor to where it is by now."""
        if not self.document.playing:
            return
        start, end = self._bounds()
        position = self._position()
        if position < end:
            self._move(position)
        elif self.loop and end > start:
            position = start + math.fmod(position - start, end - start)
            self._hold(position)
            self._move(position)
        else:
            self._move(end)
            self.stop()

    def _play(self, stretch: tuple[float, float] | None, position: float) -> None:
        """Play from a position."""
        if self.document.demonstration is None:
            return
        self._stretch = stretch
        start, end = self._bounds()
        if not start <= position < end:
            position = start
        self._hold(position)
        self._move(position)
        self._timer.start()
        self.document.set_playing(True)

    def _bounds(self) -> tuple[float, float]:
        """What is played: the stretch, or the whole demonstration."""
        low, high = self.document.bounds
        if self._stretch is None:
            return low, high
        return max(self._stretch[0], low), min(self._stretch[1], high)

    def _position(self) -> float:
        """Where the cursor is by the clock."""
        began, position, speed = self._anchor
        return position + (self._clock() - began) * speed

    def _hold(self, position: float) -> None:
        """Count from here on."""
        self._anchor = (self._clock(), position, self.document.speed)

    def _move(self, position: float) -> None:
        """Move the cursor, knowing that it was not somebody else."""
        with self._moving():
            self.document.seek(position)

    @contextmanager
    def _moving(self) -> Iterator[None]:
        """While this lasts, the cursor is moved by playback."""
        self._own = True
        try:
            yield
        finally:
            self._own = False

    def _follow_playing(self) -> None:
        """Start, stop or change the speed, as the document says."""
        if not self.document.playing:
            self._timer.stop()
            self._stretch = None
        elif not self._timer.isActive():
            self._play(self._stretch, self.document.cursor)
        elif self._anchor[2] != self.document.speed:
            self._hold(self._position())

    def _follow_cursor(self, position: float) -> None:
        """Go on from where somebody moved the cursor; outside the stretch, play to the end."""
        if self._own or not self.document.playing:
            return
        if self._stretch is not None and not self._stretch[0] <= position < self._stretch[1]:
            self._stretch = None
        self._hold(position)


#: From this width on, in average characters, everything stands in one row.
ONE_ROW = 150


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
        self.speed.activated.connect(lambda at: document.set_speed(SPEEDS[at]))
        self.time = TimeEdit(document)
        self.length = QLabel()
        self.frame = FrameCounter()
        self.range = Readout()
        self.range.setAccessibleName("Marked range")
        self.reaction = QSpinBox()
        self.stored = SavedIndicator(document)
        self._rows = QBoxLayout(QBoxLayout.Direction.LeftToRight, self)
        self._rows.setContentsMargins(6, 3, 6, 3)
        self._rows.setSpacing(4)
        self._line = QFrame()
        self._line.setFrameShape(QFrame.Shape.VLine)
        self._line.setForegroundRole(QPalette.ColorRole.Mid)
        self._groups = self._playing(), self._painting()
        self._rows.addLayout(self._groups[0])
        self._rows.addWidget(self._line)
        self._rows.addLayout(self._groups[1], 1)
        document.cursor_moved.connect(self._show_time)
        document.demonstration_changed.connect(self._show)
        document.frame_times_changed.connect(self._show_time)
        document.range_changed.connect(self._show_range)
        document.playing_changed.connect(self._show_playing)
        document.snapping_changed.connect(self._show_snapping)
        player.loop_changed.connect(self.buttons["loop"].setChecked)
        self._show()

    def sizeHint(self) -> QSize:
        """One row or two, by the width."""
        return self._rows.sizeHint()

    def minimumSizeHint(self) -> QSize:
        """Two rows need less width than one."""
        wide = max(group.minimumSize().width() for group in self._groups)
        return QSize(wide + 12, self._rows.minimumSize().height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Stand in one row where there is room for it, else in two."""
        super().resizeEvent(event)
        wide = self.width() >= ONE_ROW * self.fontMetrics().averageCharWidth()
        directions = QBoxLayout.Direction
        direction = directions.LeftToRight if wide else directions.TopToBottom
        if direction != self._rows.direction():
            self._rows.setDirection(direction)
            self._line.setVisible(wide)
            self.updateGeometry()

    def showEvent(self, event: QShowEvent) -> None:
        """Catch up with what happened while it was hidden."""
        super().showEvent(event)
        self._show()

    # What it is made of

    def _playing(self) -> QHBoxLayout:
        """Buttons that move the cursor, the speed and the time."""
        document, player = self.document, self.player
        row = QHBoxLayout()
        row.setSpacing(1)
        self._button(row, "start", "To the start", partial(self._to_end, 0))
        self._button(row, "step-back", "Step back", lambda: document.step(-1), repeat=True)
        self._button(row, "play", "Play", player.toggle)
        self._button(row, "step-forward", "Step forward", lambda: document.step(1), repeat=True)
        self._button(row, "end", "To the end", partial(self._to_end, 1))
        loop = self._button(row, "loop", "Begin again at the end", lambda: None)
        loop.setCheckable(True)
        loop.toggled.connect(player.set_loop)
        row.addSpacing(3)
        row.addWidget(self.speed)
        row.addSpacing(6)
        row.addWidget(self.time)
        row.addSpacing(4)
        row.addWidget(self.length)
        row.addSpacing(8)
        row.addWidget(self.frame)
        row.addStretch(1)
        for label in (self.length, self.frame):
            label.setForegroundRole(QPalette.ColorRole.PlaceholderText)
        return row

    def _painting(self) -> QHBoxLayout:
        """The range, what painting is helped by, and whether all is stored."""
        row = QHBoxLayout()
        row.setSpacing(4)
        snap = self._button(
            row,
            "magnet",
            "Snap to contacts, edges, frames and samples (Alt while dragging: not)",
            lambda: None,
        )
        snap.setCheckable(True)
        snap.toggled.connect(self.document.set_snapping)
        self.reaction.setRange(0, round(settings.LONGEST_MS))
        self.reaction.setSingleStep(10)
        self.reaction.setPrefix("Reaction ")
        self.reaction.setSuffix(" ms")
        self.reaction.setToolTip(
            "How late you press keys during playback; labels are put that much earlier"
        )
        self.reaction.setAccessibleName("Reaction time in milliseconds")
        self.reaction.setValue(round(settings.reaction_ms()))
        self.reaction.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.reaction.setKeyboardTracking(False)
        self.reaction.lineEdit().returnPressed.connect(self.reaction.clearFocus)
        self.reaction.setButtonSymbols(QSpinBox.ButtonSymbols.NoButtons)
        self.reaction.valueChanged.connect(
            lambda milliseconds: settings.store("labelling/reaction_ms", milliseconds)
        )
        row.addWidget(self.reaction)
        row.addSpacing(6)
        row.addWidget(self.range, 1)
        row.addWidget(self.stored)
        return row

    def _button(
        self,
        row: QHBoxLayout,
        name: str,
        text: str,
        verb: Callable[[], object],
        *,
        repeat: bool = False,
    ) -> QToolButton:
        """A button with an icon; a click leaves the keyboard where it is."""
        button = QToolButton()
        button.setIcon(icon(name))
        button.setIconSize(QSize(18, 18))
        button.setToolTip(text)
        button.setAccessibleName(text)
        button.setAutoRaise(True)
        button.setAutoRepeat(repeat)
        button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        button.clicked.connect(lambda _=False: verb())
        self.buttons[name] = button
        row.addWidget(button)
        return button

    def _to_end(self, which: int) -> None:
        """Move the cursor to the start (0) or the end (1) of the demonstration."""
        self.document.seek(self.document.bounds[which])

    # What it shows

    def _show(self) -> None:
        """Show everything as it is now."""
        there = self.document.demonstration is not None
        moving = (button for name, button in self.buttons.items() if name not in ("loop", "magnet"))
        for widget in (*moving, self.speed, self.time):
            set_enabled_with_reason(widget, "" if there else "Open a demonstration first.")
        self.length.setText(f"/ {self.document.bounds[1]:.3f} s" if there else "")
        self._show_playing()
        self._show_snapping()
        self._show_range()
        self._show_time()

    def _show_time(self) -> None:
        """Show where the cursor is, in seconds and in frames."""
        if not self.isVisible():
            return
        self.time.show_cursor()
        frames = self.document.frame_times
        if frames is None or not len(frames):
            self.frame.say("")
            return
        # A cursor within float dust of a frame is on that frame.
        number = int(np.searchsorted(frames, self.document.cursor + 1e-9, side="right"))
        text = "frame {0}"
        # As wide as the last one, so that nothing moves during playback.
        widest = text.format("0" * len(str(len(frames))))
        self.frame.say(text.format(number if number else "–"), widest)
        self.frame.setToolTip(f"{number} of {len(frames)} video frames")

    def _show_range(self) -> None:
        """Show the range that is marked, or half of it."""
        document = self.document
        if document.range is not None:
            start, end = document.range
            text = f"range {start:.3f}–{end:.3f} s ({end - start:.3f} s)"
        elif document.range_in is not None:
            text = f"range from {document.range_in:.3f} s"
        else:
            text = ""
        self.range.say(text)

    def _show_playing(self) -> None:
        """Show whether and how fast the cursor moves."""
        playing, speed = self.document.playing, self.document.speed
        play = self.buttons["play"]
        play.setIcon(icon("pause" if playing else "play"))
        text = "Pause" if playing else "Play"
        play.setToolTip(text)
        play.setAccessibleName(text)
        if speed in SPEEDS:
            self.speed.setCurrentIndex(SPEEDS.index(speed))
        else:
            self.speed.setCurrentIndex(-1)
            self.speed.setPlaceholderText(_speed_text(speed))

    def _show_snapping(self) -> None:
        """Show whether painted times snap."""
        self.buttons["magnet"].setChecked(self.document.snapping)


def _speed_text(speed: float) -> str:
    """A speed as it is shown."""
    return f"{speed:g}×"
