"""How the open demonstration is looked at: cursor, visible span, marked range, playback."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from forcelab.demonstration import Demonstration
from forcelab.gui.preferences import SNAPPING
from forcelab.segment_edits import SLIVER

#: The closest look at the time axis, in seconds.
SHORTEST_SPAN = 1e-4
#: How many samples a span holds at least.
FEWEST_SAMPLES = 5
#: Where in the span the cursor comes to lie when it left it: near the start while playing, so that
#: the span turns like a page; otherwise in the middle.
PAGE, MIDDLE = 0.05, 0.5


SnapKind = Literal["contact", "edge", "frame", "sample"]


@dataclass(frozen=True, slots=True)
class Snap:
    """A time that a dragged edge jumps to, in seconds, and what is there."""

    time: float
    kind: SnapKind


class ViewState(QObject):
    """Cursor, span, range and the like; all times in seconds."""

    cursor_moved = Signal(float)
    span_changed = Signal(float, float)
    range_changed = Signal()
    hint_changed = Signal()
    peek_changed = Signal()
    frame_times_changed = Signal()
    playing_changed = Signal()
    snapping_changed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        SNAPPING.changed.connect(self.snapping_changed)
        self.fine_nudges = False  # whether keys move edges and segments by finer steps
        self.playing = False  # whether playback moves the cursor
        self.speed = 1.0  # seconds of the demonstration that pass in one second
        self.copied_from = ""  # the author whose segments were copied last
        self.reset(None)

    def reset(self, demonstration: Demonstration | None) -> None:
        """Show another demonstration from its start; emits no signal."""
        self.demonstration: Demonstration | None = demonstration
        self.start, self.end = self.bounds  # the visible span
        self.cursor = self.start
        self.range: tuple[float, float] | None = None  # that is marked
        self.range_start: float | None = None  # while it has no end
        self.hint: Snap | None = None  # the snap target that is being offered
        #: Shown instead of the cursor's time, such as that of an edge while it is dragged.
        self.peek: float | None = None
        #: Of the video's frames, on the force clock, once they are known.
        self.frame_times: NDArray[np.float64] | None = None
        self.contacts: NDArray[np.float64] = np.empty(0)  # contact events, once they are known

    @property
    def bounds(self) -> tuple[float, float]:
        """Start and end of the demonstration in seconds; 0 and 1 without one."""
        if self.demonstration is None:
            return 0.0, 1.0
        return self.demonstration.start, self.demonstration.end

    def within(self, time: float) -> float:
        """The nearest time in the demonstration."""
        low, high = self.bounds
        return min(max(float(time), low), high)

    def seek(self, time: float) -> None:
        """Move the cursor; the visible span follows it."""
        time = self.within(time)
        if time != self.cursor:
            self.cursor = time
            self._reveal(time)
            self.cursor_moved.emit(time)

    @property
    def shortest_span(self) -> float:
        """The shortest span that is shown, in seconds: a few samples."""
        if self.demonstration is None:
            return SHORTEST_SPAN
        return max(SHORTEST_SPAN, FEWEST_SAMPLES * self.demonstration.period)

    def set_span(self, start: float, end: float) -> None:
        """Show ``[start, end]``, kept within the demonstration."""
        low, high = self.bounds
        length = min(max(end - start, self.shortest_span), high - low)
        start = min(max((start + end - length) / 2, low), high - length)
        if (start, start + length) != (self.start, self.end):
            self.start, self.end = start, start + length
            self.span_changed.emit(self.start, self.end)

    def zoom(self, factor: float, about: float) -> None:
        """Show `factor` times as long a span, with the time `about` where it is on screen."""
        low, high = self.bounds
        length = min(max((self.end - self.start) * factor, self.shortest_span), high - low)
        share = (about - self.start) / (self.end - self.start)
        start = about - share * length
        self.set_span(start, start + length)

    def pan(self, seconds: float) -> None:
        low, high = self.bounds
        seconds = min(max(seconds, low - self.start), high - self.end)
        self.set_span(self.start + seconds, self.end + seconds)

    def fit(self) -> None:
        """Show the whole demonstration."""
        self.set_span(*self.bounds)

    def step(self, count: int) -> None:
        """Move the cursor by video frames, or by samples where there is no video."""
        self.seek(self.stepped(self.cursor, count))

    def stepped(self, time: float, count: int) -> float:
        """The time so many video frames on; where no frame lies that way, so many samples."""
        if self.demonstration is None:
            return time
        for times in (self.frame_times, self.demonstration.times):
            if times is None or not len(times):
                continue
            # A time within float dust of a frame is on that frame.
            current = int(np.searchsorted(times, time + SLIVER, side="right")) - 1
            on_it = current >= 0 and time - times[current] <= SLIVER
            target = current + count if count > 0 or on_it else current + count + 1
            target_time = float(times[min(max(target, 0), len(times) - 1)])
            if (target_time - time) * count > 0:
                return target_time
        return self.bounds[1] if count > 0 else self.bounds[0]

    def mark_in(self) -> None:
        """Start the range at the cursor, or move its start there."""
        self._mark(self.cursor, self.range[1] if self.range else None)

    def mark_out(self) -> None:
        """End the range at the cursor, or move its end there."""
        start = self.range[0] if self.range else self.range_start
        self._mark(start if start is not None else self.bounds[0], self.cursor)

    def set_range(self, start: float, end: float) -> None:
        """Mark a range, the times in any order."""
        start, end = sorted((self.within(start), self.within(end)))
        self.range_start, self.range = None, (start, end) if end > start else None
        self.range_changed.emit()

    def clear_range(self) -> None:
        if self.range is not None or self.range_start is not None:
            self.range = self.range_start = None
            self.range_changed.emit()

    def set_hint(self, hint: Snap | None) -> None:
        """Offer a snap target."""
        if hint != self.hint:
            self.hint = hint
            self.hint_changed.emit()

    @property
    def displayed_time(self) -> float:
        """The time whose picture is shown: that of the peek, or else the cursor's."""
        return self.cursor if self.peek is None else self.peek

    def set_peek(self, time: float | None) -> None:
        """Show another time for a while; the cursor stays."""
        if time != self.peek:
            self.peek = time
            self.peek_changed.emit()

    @property
    def snapping(self) -> bool:
        """Whether painted times snap to edges, contacts and frames nearby."""
        return SNAPPING.value

    def set_snapping(self, snapping: bool) -> None:
        """Let painted times snap to what is near, or not."""
        if snapping != self.snapping:
            SNAPPING.set_value(snapping)

    def set_frame_times(self, times: NDArray[np.float64] | None) -> None:
        """Set the times of the video's frames, in force time."""
        self.frame_times = times
        self.frame_times_changed.emit()

    def set_playing(self, playing: bool) -> None:
        """Set the playing flag; the cursor is moved by playback."""
        if playing != self.playing:
            self.playing = playing
            self.playing_changed.emit()

    def set_speed(self, speed: float) -> None:
        if speed != self.speed:
            self.speed = speed
            self.playing_changed.emit()

    def _mark(self, start: float, end: float | None) -> None:
        """Mark a range, or only its start."""
        if end is None or end <= start:
            self.range, self.range_start = None, start
            self.range_changed.emit()
        else:
            self.set_range(start, end)

    def _reveal(self, time: float) -> None:
        """Move the span so that a time is in it; during playback by pages."""
        if self.start <= time <= self.end:
            return
        length = self.end - self.start
        start = time - (PAGE if self.playing else MIDDLE) * length
        self.set_span(start, start + length)
