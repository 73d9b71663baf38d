"""The ruler: the numbers of the common time axis, and the cursor to take hold of."""

from __future__ import annotations

import math

from PySide6.QtCore import QLineF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy

from forcelab.gui.document import Document
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis, ticks
from forcelab.gui.theme import colours
from forcelab.gui.time_panel import TimePanel

#: A span longer than this many seconds is shown in minutes and seconds.
LONGEST_IN_SECONDS = 90.0
#: Seconds between two numbers in minutes and seconds.
STEPS = (1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 28800, 86400)
#: Height of the ruler and of its numbers, and least room between two of them, in pixels.
HEIGHT = 26
NUMBER = 10.0
BREATH = 18.0


def clock_time(seconds: float, decimals: int = 0) -> str:
    """A time as minutes and seconds, ``m:ss``, from an hour on ``h:mm:ss``."""
    sign = "\N{MINUS SIGN}" if seconds < 0 else ""
    units = round(abs(seconds) * 10**decimals)
    seconds_part, rest = divmod(units, 10**decimals)
    fraction = f".{rest:0{decimals}d}" if decimals else ""
    minutes, second = divmod(seconds_part, 60)
    hours, minute = divmod(minutes, 60)
    if hours:
        return f"{sign}{hours}:{minute:02d}:{second:02d}{fraction}"
    return f"{sign}{minute}:{second:02d}{fraction}"


def clock_marks(axis: Axis, size: float) -> tuple[tuple[float, str], ...]:
    """Times and their texts for an axis in minutes and seconds, with room between them."""
    face = text.font(size)
    per_second = abs(axis.finish - axis.begin) / (axis.end - axis.start)
    days = STEPS[-1] * 2.0 ** max(math.ceil(math.log2((axis.end - axis.start) / STEPS[-1])), 0)
    for step in (*STEPS, days):
        if step * per_second < size + BREATH:
            continue
        values = ticks(axis.start, axis.end, float(step))
        texts = tuple(clock_time(value) for value in values)
        if step * per_second >= text.widest(texts, face) + BREATH or step == days:
            break
    return tuple(zip(values, texts, strict=True))


class Ruler(TimePanel):
    """The time axis of all panels below it; dragging on it moves the cursor."""

    #: The tag with the cursor's time, which at the ends stands beside it.
    beside_cursor = 150.0

    def __init__(self, document: Document) -> None:
        super().__init__(document)
        #: Where the numbers are.
        self._places: list[QRectF] = []
        self.setAccessibleName("Time")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setFixedHeight(HEIGHT)
        self.setToolTip("Drag to move the cursor")

    def sizeHint(self) -> QSize:
        return QSize(900, HEIGHT)

    def paint_content(self, painter: QPainter, plot: QRectF) -> None:
        theme, axis = colours(), self.axis
        marks = clock_marks(axis, NUMBER) if self._clock else axis.marks(NUMBER, upright=False)
        painter.fillRect(plot, QColor(theme.panel))
        painter.setPen(QPen(QColor(theme.panel_edge), 1))
        edge = plot.bottom() - 0.5
        painter.drawLine(QLineF(plot.left(), edge, plot.right(), edge))
        painter.setPen(QPen(QColor(theme.frame), 1))
        spots = [round(axis.at(value)) + 0.5 for value, _ in marks]
        painter.drawLines([QLineF(x, edge - 6, x, edge) for x in spots])
        if len(marks) > 1:
            small = (marks[1][0] - marks[0][0]) / 5
            fine = [round(axis.at(v)) + 0.5 for v in ticks(axis.start, axis.end, small)]
            painter.drawLines([QLineF(x, edge - 3, x, edge) for x in fine])
        face, ink = text.font(NUMBER), QColor(theme.text)
        self._places = [self._place(value, label) for value, label in marks]
        for (_, label), place in zip(marks, self._places, strict=True):
            middle = place.center()
            text.draw_text(painter, middle.x(), middle.y(), label, face=face, ink=ink, align=0.5)

    def gutter_shows(self) -> object:
        return self._clock

    def paint_gutter(self, painter: QPainter, box: QRectF) -> None:
        theme = colours()
        painter.fillRect(box, QColor(theme.panel))
        unit = "min:s" if self._clock else "s"
        face = text.font(NUMBER)
        spot = box.right() - 8
        text.draw_text(painter, spot, 10.0, unit, face=face, ink=QColor(theme.muted), align=1.0)
        painter.setPen(QPen(QColor(theme.panel_edge), 1))
        painter.drawLine(QLineF(box.left(), box.bottom() - 0.5, box.right(), box.bottom() - 0.5))

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the panel, and a tag with the cursor's time."""
        super().paintEvent(event)
        x = self.x_at(self.document.view.cursor)
        # Half a pixel of room: the ends of the axis are pixels only up to rounding.
        if not self.plot.left() - 0.5 <= x <= self.plot.right() + 0.5:
            return
        if self.document.demonstration is None:
            return
        theme = colours()
        face = text.font(NUMBER, bold=True)
        label = self.cursor_text()
        wide = text.width(label, face) + 10
        left = min(max(x - wide / 2, self.plot.left()), self.plot.right() - wide)
        with QPainter(self) as painter:
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            painter.setPen(Qt.PenStyle.NoPen)
            ground = QColor(theme.cursor)
            painter.setBrush(QColor(theme.panel))
            tag = QRectF(left, 2, wide, 16)
            near = tag.adjusted(-3, 0, 3, 0)  # half a number beside the tag would be misread
            painter.drawRects([place for place in self._places if place.intersects(near)])
            painter.setBrush(ground)
            painter.drawRoundedRect(tag, 3, 3)
            ink = text.ink_on(ground)
            text.draw_text(painter, left + wide / 2, 10.0, label, face=face, ink=ink, align=0.5)

    def cursor_text(self) -> str:
        """The cursor's time, to the millisecond or finer where a pixel is finer."""
        decimals = min(max(3, math.ceil(-math.log10(self.seconds_per_pixel))), 6)
        if self._clock:
            return clock_time(self.document.view.cursor, decimals)
        return text.signed(f"{self.document.view.cursor:.{decimals}f}") + " s"

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self._scrub(event)
        else:
            super().mousePressEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if event.buttons() & Qt.MouseButton.LeftButton:
            self._scrub(event)
        else:
            super().mouseMoveEvent(event)

    def _scrub(self, event: QMouseEvent) -> None:
        """Move the cursor to the pointer, no further than to the ends of the visible span."""
        x = min(max(event.position().x(), self.plot.left()), self.plot.right())
        self.document.view.seek(self.time_at(x))

    def _place(self, value: float, label: str) -> QRectF:
        """Where a number is; at the ends they move inwards rather than being cut."""
        half = text.width(label, text.font(NUMBER)) / 2 + 1
        x = round(self.axis.at(value)) + 0.5
        middle = min(max(x, self.plot.left() + half), self.plot.right() - half)
        return QRectF(middle - half, 3.0, 2 * half, 14.0)

    @property
    def _clock(self) -> bool:
        """Whether times are in minutes and seconds."""
        return self.document.view.end - self.document.view.start > LONGEST_IN_SECONDS
