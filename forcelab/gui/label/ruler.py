"""The ruler: the numbers of the common time axis, and the cursor to take hold of."""

from __future__ import annotations

import math
from typing import Any

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QMouseEvent, QPainter
from PySide6.QtWidgets import QSizePolicy

from forcelab.gui.document import Document
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import NUMBER
from forcelab.gui.kit import text_size
from forcelab.gui.kit.plot import ValueAxis
from forcelab.gui.kit.time_panel import TimePanel
from forcelab.gui.theme import colours

#: A span longer than this many seconds is shown in minutes and seconds.
LONGEST_IN_SECONDS = 90.0
#: Seconds between two numbers in minutes and seconds.
STEPS = (1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 28800, 86400)
#: Height of the ruler, and least room between two of its numbers, in pixels.
HEIGHT = 26
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


class TimeAxis(ValueAxis):
    """An axis of seconds, in minutes and seconds where it shows many."""

    def __init__(self) -> None:
        super().__init__("top")
        #: Where the numbers stand, in pixels of the axis.
        self.number_boxes: list[QRectF] = []

    def generateDrawSpecs(self, p: QPainter) -> Any:
        specs = super().generateDrawSpecs(p)
        # What pyqtgraph takes for a number's height is less than that.
        above = -text_size.pixels(4)
        numbers = () if specs is None else specs[2]
        self.number_boxes = [box.adjusted(-1, above, 1, 0) for box, *_ in numbers]
        return specs

    @property
    def clock(self) -> bool:
        """Whether times are in minutes and seconds."""
        return self.range[1] - self.range[0] > LONGEST_IN_SECONDS

    def tickSpacing(self, minVal: float, maxVal: float, size: float) -> list[tuple[float, float]]:
        """The numbers' distance, the smallest with room, and a fifth of it."""
        if not self.clock:
            major = super().tickSpacing(minVal, maxVal, size)[0]
            return [major, (major[0] / 5, 0)]
        face, span = text_size.font(NUMBER), maxVal - minVal
        days = STEPS[-1] * 2.0 ** max(math.ceil(math.log2(span / STEPS[-1])), 0)
        widest = text.widest((clock_time(value) for value in (minVal, maxVal)), face) + BREATH
        step = next((step for step in STEPS if step * size / span >= widest), days)
        return [(float(step), 0), (step / 5, 0)]

    def tickStrings(self, values: list[float], scale: float, spacing: float) -> list[str]:
        if self.clock:
            return [clock_time(value) for value in values]
        return super().tickStrings(values, scale, spacing)


class Ruler(TimePanel):
    """The time axis of all panels below it; dragging on it moves the cursor."""

    #: The tag with the cursor's time, which at the ends stands beside it.
    beside_cursor = 150.0

    def __init__(self, document: Document) -> None:
        super().__init__(document)
        self.setAccessibleName("Time")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setToolTip("Drag to move the cursor")
        self._numbers = TimeAxis()
        self._numbers.setStyle(tickLength=-6, maxTextLevel=0)
        self.addItem(self._numbers)
        self.fit_text()

    def fit_text(self) -> None:
        height = round(text_size.pixels(HEIGHT))
        self.setFixedHeight(height)
        self._numbers.setHeight(height)
        super().fit_text()

    def invalidate(self, *_: object) -> None:
        view = self.document.view
        self._numbers.setVisible(self.document.demonstration is not None)
        self._numbers.setRange(view.start, view.end)
        super().invalidate()

    def place(self) -> None:
        self._numbers.setGeometry(self.plot)

    def paint_background(self, painter: QPainter) -> None:
        painter.fillRect(self.rect(), QColor(colours().panel))
        super().paint_background(painter)

    def paint_gutter(self, painter: QPainter, box: QRectF) -> None:
        unit, ink = "min:s" if self._numbers.clock else "s", QColor(colours().muted)
        face = text_size.font(NUMBER)
        y = text_size.pixels(10)
        text.draw_text(painter, box.right() - 8, y, unit, face=face, ink=ink, align=1.0)

    def paint_foreground(self, painter: QPainter) -> None:
        """Draw the cursor and a tag with its time."""
        super().paint_foreground(painter)
        x, plot = self.x_at(self.document.view.cursor), self.plot
        # Half a pixel of room: the ends of the axis are pixels only up to rounding.
        if self.document.demonstration is None or not plot.left() - 0.5 <= x <= plot.right() + 0.5:
            return
        face, label = text_size.font(NUMBER, bold=True), self.cursor_text()
        ground, panel = QColor(colours().cursor), QColor(colours().panel)
        wide = text.width(label, face) + 10
        left = min(max(x - wide / 2, plot.left()), plot.right() - wide)
        tag = QRectF(left, 2, wide, text_size.pixels(20) - 4)
        apart = tag.adjusted(-4, 0, 4, 0)
        painter.fillRect(apart, panel)
        for box in self._numbers.number_boxes:  # of a number that it covers nothing stays
            if (number := box.translated(plot.left(), 0)).intersects(apart):
                painter.fillRect(number, panel)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(ground)
        painter.drawRoundedRect(tag, 3, 3)
        at, ink = tag.center(), text.ink_on(ground)
        text.draw_text(painter, at.x(), at.y(), label, face=face, ink=ink, align=0.5)

    def cursor_text(self) -> str:
        """The cursor's time, to the millisecond or finer where a pixel is finer."""
        decimals = min(max(3, math.ceil(-math.log10(self.seconds_per_pixel))), 6)
        if self._numbers.clock:
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
