"""A demonstration: its channels over time, below the tracks of those who labelled it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QRectF, QSizeF
from PySide6.QtGui import QColor, QPainter

from forcelab.demonstration import GAP_PERIODS, Demonstration
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import (
    Axis,
    curve_pen,
    draw_bottom,
    draw_grid,
    draw_left,
    paint_curve,
)
from forcelab.gui.figures.figure import MARGIN, Figure
from forcelab.gui.figures.tracks import LabelStyle, Legend, paint_track, styles_in_order
from forcelab.gui.theme import LIGHT, Colours
from forcelab.jobs import finish
from forcelab.labels import Track
from forcelab.sample_runs import marked_runs
from forcelab.signals.minmax import Columns, Envelope, Extremes, drawn_together, read_envelopes
from forcelab.vocabulary import Vocabulary

WIDTH = 960.0
#: Heights of a track, of a channel, and of what is left free below either; all in pixels.
BAR, STRIP, APART = 15.0, 54.0, 12.0
#: Room for the names at the left, at most, and for the numbers between them and the curves.
NAME_ROOM, NUMBER_ROOM = 150.0, 48.0
TITLE_ROOM, AXIS_ROOM = 26.0, 36.0


@dataclass(frozen=True)
class DemonstrationFigure(Figure):
    """The tracks and channels of a demonstration on one time axis.

    The vocabulary has every action of the tracks. Where there are more samples than pixels a
    channel is drawn from its least to its greatest sample in each column of pixels.
    """

    title: str
    demonstration: Demonstration
    tracks: tuple[Track, ...]
    vocabulary: Vocabulary
    theme: Colours = LIGHT

    @property
    def size(self) -> QSizeF:
        return QSizeF(WIDTH, self._bottom + AXIS_ROOM + MARGIN)

    @cached_property
    def axis(self) -> Axis:
        names = [track.author for track in self.tracks] + self._channel_names
        room = min(text.widest(map(text.printable, names), text.font()), NAME_ROOM)
        shown = self.demonstration
        return Axis(shown.start, shown.end, MARGIN + room + 10 + NUMBER_ROOM, WIDTH - MARGIN)

    def paint(self, painter: QPainter) -> None:
        self.paint_title(painter)
        self._legend.paint(painter, MARGIN, MARGIN + TITLE_ROOM, self.theme)
        for row, track in enumerate(self.tracks):
            box = QRectF(self.axis.begin, self._tracks_top + row * (BAR + APART), self._wide, BAR)
            self._paint_name(painter, track.author, box.center().y(), QColor(self.theme.text))
            paint_track(
                painter, box, self.axis, track.segments, styles=self._styles, theme=self.theme
            )
        self._paint_channels(painter)
        draw_bottom(painter, self.axis, self._bottom, "time (s)", self.theme)

    def _paint_channels(self, painter: QPainter) -> None:
        """Draw each channel on an axis of its own, with the marks of time behind it."""
        edges = np.linspace(self.axis.start, self.axis.end, round(self._wide) + 1)
        marks = [value for value, _ in self.axis.marks(upright=False)]
        for row, extremes in enumerate(self._extremes(edges)):
            top = self._channels_top + row * (STRIP + APART)
            low, high = _limits(extremes)
            up = Axis(low, high, top + STRIP, top)
            grid = (QLineF(self.axis.at(v), top, self.axis.at(v), up.begin) for v in marks)
            draw_grid(painter, grid, self.theme)
            draw_left(painter, up, self.axis.begin, "", self.theme)
            ink = QColor(self.theme.curves[row % len(self.theme.curves)])
            self._paint_name(painter, self._channel_names[row], top + STRIP / 2, ink)
            x = np.repeat((edges[:-1] + edges[1:]) / 2, 2)
            y = np.stack([extremes.low, extremes.high], axis=1).ravel()
            for first, end in marked_runs(np.isfinite(y)).tolist():
                part = slice(first, end)
                paint_curve(painter, self.axis, up, x[part], y[part], pen=curve_pen(ink, 1.0))

    def _paint_name(self, painter: QPainter, name: str, y: float, ink: QColor) -> None:
        edge = self.axis.begin - NUMBER_ROOM
        name = text.elided_name(name, text.font(), edge - MARGIN)
        text.draw_text(painter, edge, y, name, face=text.font(), ink=ink, align=1.0)

    def _extremes(self, edges: NDArray[np.float64]) -> list[Extremes]:
        """The least and the greatest value of each channel in each column of pixels."""
        shown = self.demonstration
        envelopes = [Envelope(shown.signals, column) for column in range(len(shown.channels))]
        finish(read_envelopes(envelopes))
        columns = Columns(shown.times, edges, GAP_PERIODS * shown.period)
        return drawn_together(envelopes, columns)

    @property
    def _channel_names(self) -> list[str]:
        return [f"{c.name} ({c.unit})" if c.unit else c.name for c in self.demonstration.channels]

    @cached_property
    def _styles(self) -> dict[str, LabelStyle]:
        actions = dict.fromkeys(action for track in self.tracks for action in track.actions)
        return styles_in_order(actions, self.vocabulary)

    @property
    def _legend(self) -> Legend:
        return Legend(self._styles, WIDTH - 2 * MARGIN)

    @property
    def _wide(self) -> float:
        """Width of bars and curves, in pixels."""
        return self.axis.finish - self.axis.begin

    @property
    def _tracks_top(self) -> float:
        return MARGIN + TITLE_ROOM + (self._legend.height + 10 if self.tracks else 0.0)

    @property
    def _channels_top(self) -> float:
        return self._tracks_top + len(self.tracks) * (BAR + APART)

    @property
    def _bottom(self) -> float:
        """Where the time axis lies, in pixels."""
        return self._channels_top + len(self.demonstration.channels) * (STRIP + APART)


def _limits(extremes: Extremes) -> tuple[float, float]:
    """The values at the lower and the upper end of a channel's axis."""
    present = np.concatenate([extremes.low, extremes.high])
    present = present[np.isfinite(present)]
    if not present.size:
        return -1.0, 1.0
    low, high = float(present.min()), float(present.max())
    room = 0.05 * (high - low) or max(abs(high), 1.0)
    return low - room, high + room
