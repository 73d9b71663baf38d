"""Playback by a monotonic clock.

The cursor is the master clock. Where it is depends on the time since playback started and on
nothing else, so that a late tick skips time on screen and never slows it; what follows the cursor,
such as the video, drops what it cannot show in time.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from PySide6.QtCore import QObject, Qt, QTimer, Signal

from forcelab.gui.document import Document
from forcelab.gui.label.segment_commands import selection

#: The speeds that the transport offers; normal speed is in the middle.
SPEEDS = (0.1, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0)
#: Time between two ticks in ms: 60 a second or a little more.
TICK = 16


class Player(QObject):
    """Plays a document's demonstration.

    It follows the document's view: ``set_playing`` and ``set_speed`` start, stop and pace it, and
    ``seek`` during playback makes it go on from there. `loop` plays again from the start instead of
    stopping at the end. `clock` gives seconds and never jumps.
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
        self._moving_cursor = False
        self._span: tuple[float, float] | None = None
        self._anchor = (0.0, 0.0, 1.0)  # clock, cursor and speed of the last start, seek or change
        document.view.playing_changed.connect(self._follow_playing)
        document.view.cursor_moved.connect(self._follow_cursor)
        document.demonstration_changed.connect(self.stop)

    def start(self) -> None:
        """Play from the cursor to the end of the demonstration.

        With the cursor at the end it begins at the start. With :attr:`loop` on, a marked range is
        played over and over; without one, the whole demonstration.
        """
        self._play(self.document.view.range if self.loop else None, self.document.view.cursor)

    def stop(self) -> None:
        self.document.view.set_playing(False)

    def toggle(self) -> None:
        if self.document.view.playing:
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
        span = selection(self.document)
        if span is None:
            self.start()
        else:
            self.play_span(*span)

    def set_loop(self, loop: bool) -> None:
        if loop != self.loop:
            self.loop = loop
            self.loop_changed.emit(loop)

    def faster(self) -> None:
        """Play at the next speed of :data:`SPEEDS`."""
        above = (speed for speed in SPEEDS if speed > self.document.view.speed)
        self.document.view.set_speed(next(above, SPEEDS[-1]))

    def slower(self) -> None:
        """Play at the speed of :data:`SPEEDS` before."""
        below = (speed for speed in reversed(SPEEDS) if speed < self.document.view.speed)
        self.document.view.set_speed(next(below, SPEEDS[0]))

    def normal_speed(self) -> None:
        self.document.view.set_speed(1.0)

    # Inside

    def tick(self) -> None:
        """Move the cursor to where the clock says."""
        if not self.document.view.playing:
            return
        start, end = self._bounds()
        position = self._position()
        if position < end:
            self._move(position)
        elif self.loop and end > start:
            position = start + math.fmod(position - start, end - start)
            self._set_anchor(position)
            self._move(position)
        else:
            self._move(end)
            self.stop()

    def _play(self, span: tuple[float, float] | None, position: float) -> None:
        if self.document.demonstration is None:
            return
        self._span = span
        start, end = self._bounds()
        if not start <= position < end:
            position = start
        self._set_anchor(position)
        self._move(position)
        self._timer.start()
        self.document.view.set_playing(True)

    def _bounds(self) -> tuple[float, float]:
        """The span that is played, or the whole demonstration."""
        low, high = self.document.view.bounds
        if self._span is None:
            return low, high
        return max(self._span[0], low), min(self._span[1], high)

    def _position(self) -> float:
        """Where the cursor is by the clock."""
        time, position, speed = self._anchor
        return position + (self._clock() - time) * speed

    def _set_anchor(self, position: float) -> None:
        self._anchor = (self._clock(), position, self.document.view.speed)

    def _move(self, position: float) -> None:
        """Move the cursor without taking it for a seek of the coder's."""
        self._moving_cursor = True
        try:
            self.document.view.seek(position)
        finally:
            self._moving_cursor = False

    def _follow_playing(self) -> None:
        """Start, stop or change the speed, as the document says."""
        if not self.document.view.playing:
            self._timer.stop()
            self._span = None
        elif not self._timer.isActive():
            self._play(self._span, self.document.view.cursor)
        elif self._anchor[2] != self.document.view.speed:
            self._set_anchor(self._position())

    def _follow_cursor(self, position: float) -> None:
        """Go on from where the cursor was moved; outside the played span, play to the end."""
        if self._moving_cursor or not self.document.view.playing:
            return
        if self._span is not None and not self._span[0] <= position < self._span[1]:
            self._span = None
        self._set_anchor(position)
