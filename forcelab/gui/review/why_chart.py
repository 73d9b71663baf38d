"""How probable each action was around a place: a line for each, named at its end."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QLineF, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QWidget

from forcelab.gui.document import Document
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis
from forcelab.gui.label.swatches import look_of, paint_swatch
from forcelab.gui.review.colouring import vocabulary_seen
from forcelab.gui.theme import colours, themes
from forcelab.vocabulary import Vocabulary

if TYPE_CHECKING:
    from forcelab.recognition.probability_trace import Certainty
    from forcelab.review.differences import Interval

__all__ = ["ProbabilityChart"]

#: Pixels around the plot: for its numbers, for the actions' names, and for the time below.
LEFT, RIGHT, TOP, BOTTOM = 30.0, 40.0, 6.0, 18.0
SMALL = 10.0
#: Names take at most this share of the width; a line that stands out less than this has an edge.
SHARE, FAINT = 0.35, 2.0
#: Lines that stay below this are not named; names are at least so many pixels apart.
NAMED, APART = 0.05, 13.0
#: Seconds and shares of the place's length that are shown on either side of it.
LEAST, AROUND = 0.5, 1.0


class ProbabilityChart(QWidget):
    """Probabilities over time; a click moves the cursor there."""

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.document = document
        self.setAccessibleName("Probability of each action")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setFixedHeight(self.sizeHint().height())
        self.certainty: Certainty | None = None
        self.place: Interval | None = None
        self.threshold: float | None = None
        self.missing = ""
        self._names = 0.0
        document.cursor_moved.connect(self._cursor_moved)
        self._vocabulary = Vocabulary()
        document.vocabulary_changed.connect(self._recolour)
        themes().changed.connect(self.update)

    def sizeHint(self) -> QSize:
        """Wide and low."""
        return QSize(320, 126)

    def show_place(
        self,
        place: Interval | None,
        certainty: Certainty | None,
        threshold: float | None,
        missing: str = "",
    ) -> None:
        """Show the probabilities around another place.

        Parameters
        ----------
        place : Place or None
        certainty : Certainty or None
        threshold : float or None
            That of the filter, drawn as a dotted line.
        missing : str
            What is said where there are no probabilities.
        """
        self.place, self.certainty, self.threshold = place, certainty, threshold
        self.missing = missing
        actions = () if certainty is None else certainty.actions
        self._names = text.widest(actions, text.font(SMALL))
        self._recolour()

    @property
    def plot(self) -> QRectF:
        """The area of the lines."""
        width = max(self.width() - LEFT - RIGHT - self._room, 1.0)
        return QRectF(LEFT, TOP, width, self.height() - TOP - BOTTOM)

    @property
    def _room(self) -> float:
        """The width of the actions' names."""
        return min(self._names, SHARE * self.width() - RIGHT)

    @property
    def axis(self) -> Axis | None:
        """From seconds to pixels; None without a place."""
        if self.place is None:
            return None
        margin = max(AROUND * self.place.duration, LEAST)
        box = self.plot
        start, end = self.place.start - margin, self.place.end + margin
        return Axis(start, end, box.left(), box.right())

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Move the cursor, in the demonstration that is shown."""
        axis, x = self.axis, event.position().x()
        if axis is None or self.place is None or not LEFT <= x <= self.plot.right():
            return
        here = self.document.id == self.place.demonstration
        if here and event.button() == Qt.MouseButton.LeftButton:
            self.document.seek(axis.value(x))

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw ground, place, lines, names and cursor."""
        with QPainter(self) as painter:
            axis = self.axis
            if axis is not None and self.place is not None:
                self._paint_ground(painter, axis, self.place)
                if self.certainty is None:
                    face, ink = text.font(SMALL), QColor(colours().on_unlabelled)
                    box = self.plot
                    told = text.elided(self.missing, face, box.width() - 8)
                    x, y = box.center().x(), self._y(0.25)
                    text.put(painter, x, y, told, face=face, ink=ink, align=0.5)
                else:
                    self._paint_lines(painter, axis, self.certainty)
                self._paint_cursor(painter, axis, self.place)

    # Inside

    def _paint_ground(self, painter: QPainter, axis: Axis, place: Interval) -> None:
        """What stands behind the lines, and the numbers around them."""
        theme, box, face = colours(), self.plot, text.font(SMALL)
        painter.fillRect(box, QColor(theme.unlabelled))
        shade = QColor(theme.range)
        shade.setAlpha(38)
        left, right = axis.at(place.start), axis.at(place.end)
        painter.fillRect(QRectF(left, box.top(), right - left, box.height()), shade)
        ink = QColor(theme.muted)
        for value in (0.0, 0.5, 1.0):
            y = self._y(value)
            painter.setPen(QPen(QColor(theme.frame), 0.6))
            painter.drawLine(QLineF(box.left(), y, box.right(), y))
            text.put(painter, LEFT - 6, y, f"{value:g}", face=face, ink=ink, align=1.0)
        if self.threshold is not None:
            painter.setPen(QPen(QColor(theme.on_unlabelled), 0.8, Qt.PenStyle.DotLine))
            y = self._y(self.threshold)
            painter.drawLine(QLineF(box.left(), y, box.right(), y))
        for value, label in axis.marks(SMALL, upright=False):
            x = axis.at(value)
            painter.setPen(QPen(QColor(theme.frame), 0.6))
            painter.drawLine(QLineF(x, box.bottom(), x, box.bottom() + 3))
            text.put(painter, x, box.bottom() + 10, label, face=face, ink=ink, align=0.5)
        second = "s"
        text.put(painter, box.right() + 8, box.bottom() + 10, second, face=face, ink=ink)

    def _y(self, probability: float) -> float:
        """The height of a probability."""
        box = self.plot.adjusted(0, 2, 0, -1)
        return box.bottom() - probability * box.height()

    def _paint_lines(self, painter: QPainter, axis: Axis, certainty: Certainty) -> None:
        """A line for each action, the most probable ones on top; names at their right ends."""
        times = certainty.times
        first, last = np.searchsorted(times, (axis.start, axis.end))
        values = certainty.values[max(first - 1, 0) : last + 1] / 255.0
        times = times[max(first - 1, 0) : last + 1]
        if not len(times):
            return
        xs = [axis.at(time) for time in times.tolist()]
        painter.save()
        painter.setClipRect(self.plot)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        named = []
        for column in np.argsort(values.max(axis=0), kind="stable").tolist():
            look = look_of(self._vocabulary, certainty.actions[column])
            ys = [self._y(value) for value in values[:, column].tolist()]
            line = QPolygonF([QPointF(x, y) for x, y in zip(xs, ys, strict=True)])
            if text.contrast(look.colour, QColor(colours().unlabelled)) < FAINT:
                painter.setPen(QPen(QColor(colours().on_unlabelled), 2.8))
                painter.drawPolyline(line)
            painter.setPen(QPen(look.colour, 1.8))
            painter.drawPolyline(line)
            if values[:, column].max() >= NAMED:
                named.append((ys[-1], certainty.actions[column]))
        painter.restore()
        self._paint_names(painter, named)

    def _paint_names(self, painter: QPainter, named: list[tuple[float, str]]) -> None:
        """Names beside the ends of their lines, moved apart where they would overlap."""
        face, theme, box = text.font(SMALL), colours(), self.plot
        named = sorted(named)[: max(int(box.height() // APART) + 1, 1)]
        heights: list[float] = []
        for y, _ in named:
            heights.append(max(y, heights[-1] + APART) if heights else y)
        lowest = box.bottom()
        for i in reversed(range(len(heights))):
            heights[i] = min(heights[i], lowest)
            lowest = heights[i] - APART
        for (y, action), height in zip(named, heights, strict=True):
            swatch = QRectF(box.right() + 12, height - 4, 9, 9)
            painter.setPen(QPen(QColor(theme.frame), 0.8))
            painter.drawLine(QLineF(box.right(), y, swatch.left() - 2, height))
            paint_swatch(painter, swatch, look_of(self._vocabulary, action))
            name = text.elided_name(action, face, self._room + 8)
            ink = QColor(theme.text)
            text.put(painter, swatch.right() + 4, height, name, face=face, ink=ink)

    def _paint_cursor(self, painter: QPainter, axis: Axis, place: Interval) -> None:
        """The cursor, while its demonstration is the one that is shown."""
        here = self.document.cursor
        if self.document.id == place.demonstration and axis.start <= here <= axis.end:
            painter.setPen(QPen(QColor(colours().cursor), 1.4))
            x = axis.at(here)
            painter.drawLine(QLineF(x, self.plot.top(), x, self.plot.bottom()))

    def _recolour(self) -> None:
        """The actions may look otherwise."""
        if self.certainty is not None:
            self._vocabulary = vocabulary_seen(self.document)
        self.update()

    def _cursor_moved(self, *_: object) -> None:
        """Follow it, where anybody sees that."""
        if self.isVisible() and self.place is not None:
            self.update()
