"""Which bands speak for an action: a map of scales and channels, and a bar for each channel."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QHelpEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QToolTip, QWidget

from forcelab.gui.figures import text
from forcelab.gui.label.colourmaps import oklch_to_srgb
from forcelab.gui.review import why_words
from forcelab.gui.theme import colours, themes

if TYPE_CHECKING:
    from forcelab.review.explanation import Why

__all__ = ["BandMap", "balance_colour", "balance_colours"]

#: Heights of fonts; room for the numbers of Hz, for the legend, names and bars, in pixels.
SMALL, NUMBER = 10.0, 9.0
LEFT, LEGEND, HEAD, BARS = 52.0, 74.0, 20.0, 54.0
#: The legend grows with its names up to this share of the width.
SHARE = 0.28
#: A cell at least so wide and high shows its number.
WIDE, HIGH = 34.0, 12.0
#: Hues, in degrees of OKLCH, of what speaks against and of what speaks for: blue and orange
#: differ for every kind of colour vision, and each gets stronger with its lightness.
AGAINST, FOR = 255.0, 55.0


@cache
def balance_colours(dark: bool, count: int = 255) -> NDArray[np.uint8]:
    """Colours from the strongest against to the strongest for, shape (count, 3); count is odd.

    The middle is close to the ground of the theme, and lightness runs evenly away from it to
    either side, so that equal steps look equal. Shared: not to be changed.
    """
    way = np.linspace(-1.0, 1.0, count)
    ground, far = (0.26, 0.80) if dark else (0.97, 0.50)
    lightness = ground + (far - ground) * np.abs(way)
    chroma = 0.155 * np.abs(way)
    hue = np.radians(np.where(way < 0, AGAINST, FOR))
    return oklch_to_srgb(lightness, chroma, hue)


def balance_colour(share: float, dark: bool) -> QColor:
    """The colour of a weight as a share, -1 to 1, of the heaviest one."""
    table = balance_colours(dark)
    place = round((min(max(share, -1.0), 1.0) + 1) / 2 * (len(table) - 1))
    red, green, blue = (int(value) for value in table[place])
    return QColor(red, green, blue)


class BandMap(QWidget):
    """A map of weights: a column for each channel, a row for each scale, with Hz at the left.

    Below each column stands a bar for the channel as a whole; with its number everything can be
    read without colours.
    """

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("Bands that speak for and against")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.why: Why | None = None
        themes().changed.connect(self.update)

    def set_why(self, why: Why | None) -> None:
        """Show another explanation."""
        self.why = why
        self.setAccessibleDescription("" if why is None else why_words.strongest(why))
        self.setFixedHeight(self.sizeHint().height())
        self.update()

    def sizeHint(self) -> QSize:
        """As high as its rows need."""
        rows = 8 if self.why is None else len(self.why.hertz)
        return QSize(320, round(HEAD + min(max(rows * 15, 90), 240) + BARS))

    # Where things are

    @property
    def map(self) -> QRectF:
        """The area of the cells, in pixels of the widget."""
        width = max(self.width() - LEFT - self._legend, 1.0)
        return QRectF(LEFT, HEAD, width, max(self.height() - HEAD - BARS, 1.0))

    @property
    def _legend(self) -> float:
        """The width of the legend."""
        names = () if self.why is None else (self.why.favoured, self.why.against)
        texts = [f"for {name}" for name in names]
        needed = text.widest(texts, text.font(SMALL)) + 14
        return min(max(needed, LEGEND), max(SHARE * self.width(), LEGEND))

    def cell(self, channel: int, scale: int) -> QRectF:
        """Where a band is drawn."""
        assert self.why is not None
        box, (q, k) = self.map, self.why.influence.bands.shape
        width, height = box.width() / q, box.height() / k
        left, top = box.left() + channel * width, box.top() + scale * height
        return QRectF(left, top, width, height)

    def event(self, event: QEvent) -> bool:
        """Tell the band at the pointer."""
        if isinstance(event, QHelpEvent) and event.type() == QEvent.Type.ToolTip:
            told = self.told(QPointF(event.pos()))
            QToolTip.showText(event.globalPos(), told, self)
            return True
        return super().event(event)

    def told(self, where: QPointF) -> str:
        """What is known of the band at a point; empty where there is none."""
        if self.why is None or not self.map.contains(where):
            return ""
        found, box = self.why.influence, self.map
        q, k = found.bands.shape
        i = min(int((where.x() - box.left()) / box.width() * q), q - 1)
        j = min(int((where.y() - box.top()) / box.height() * k), k - 1)
        from forcelab.review.explanation import Band

        weight, error = float(found.bands[i, j]), float(found.bands_error[i, j])
        band = Band(self.why.channels[i], float(self.why.hertz[j]), weight, error)
        return why_words.band(band, self.why)

    # Painting

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the map, its axis, its legend and the bars."""
        with QPainter(self) as painter:
            if self.why is not None:
                painter.setOpacity(1.0 if self.isEnabled() else 0.35)
                painter.setRenderHint(QPainter.RenderHint.TextAntialiasing)
                self._paint_cells(painter, self.why)
                self._paint_axis(painter, self.why)
                self._paint_bars(painter, self.why)
                self._paint_legend(painter, self.why)

    def _paint_cells(self, painter: QPainter, why: Why) -> None:
        """One cell for each band, with its number where there is room."""
        theme, weights = colours(), why.influence.bands
        largest = float(np.abs(weights).max()) or 1.0
        face = text.font(NUMBER)
        head = text.font(SMALL, bold=True)
        marked = {(band.channel, band.hertz) for band in why.strongest() if band.weight}
        rings = []
        for i, channel in enumerate(why.channels):
            for j, hertz in enumerate(why.hertz.tolist()):
                box, weight = self.cell(i, j), float(weights[i, j])
                colour = balance_colour(weight / largest, theme.dark)
                painter.fillRect(box.adjusted(0, 0, -1, -1), colour)
                if (channel, hertz) in marked:
                    rings.append(box.adjusted(0.5, 0.5, -1.5, -1.5))
                if box.width() >= WIDE and box.height() >= HIGH:
                    number, centre = why_words.signed(weight), box.center()
                    ink = text.ink_on(colour)
                    text.put(painter, centre.x(), centre.y(), number, face=face, ink=ink, align=0.5)
            box = self.cell(i, 0)
            name = text.elided_name(channel, head, box.width() - 4)
            ink = QColor(theme.text)
            text.put(painter, box.center().x(), HEAD / 2, name, face=head, ink=ink, align=0.5)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(QColor(theme.text), 1.6))
        for ring in rings:
            painter.drawRect(ring)

    def _paint_axis(self, painter: QPainter, why: Why) -> None:
        """The frequency of each row, as many as have room."""
        theme, face = colours(), text.font(SMALL)
        height = self.map.height() / len(why.hertz)
        every = max(1, -int(-(SMALL + 3) // height))
        for j in range(0, len(why.hertz), every):
            middle = self.cell(0, j).center().y()
            label = f"{why.hertz[j]:.3g}"
            if j == 0:
                label = f"{label} Hz"
            ink = QColor(theme.muted)
            text.put(painter, LEFT - 6, middle, label, face=face, ink=ink, align=1.0)

    def _paint_bars(self, painter: QPainter, why: Why) -> None:
        """A bar for each channel: up where it speaks for, down where it speaks against."""
        theme, face = colours(), text.font(SMALL)
        weights, errors = why.influence.channels, why.influence.channels_error
        largest = float((np.abs(weights) + errors).max()) or 1.0
        box = self.map
        top, bottom = box.bottom() + 6, self.height() - 16.0
        most, least = max(float(weights.max()), 0.0), min(float(weights.min()), 0.0)
        unit = (bottom - top) / max(most - least, largest)
        zero = top + most * unit if most - least >= largest else (top if most == 0 else bottom)
        for i, weight in enumerate(weights.tolist()):
            column = self.cell(i, 0)
            wide = min(column.width() * 0.5, 40.0)
            left = column.center().x() - wide / 2
            bar = QRectF(left, zero - weight * unit, wide, weight * unit).normalized()
            painter.fillRect(bar, balance_colour(np.sign(weight) * 0.8, theme.dark))
            ink, at = QColor(theme.text), column.center().x()
            number = why_words.signed(weight)
            text.put(painter, at, self.height() - 7.0, number, face=face, ink=ink, align=0.5)
        painter.setPen(QPen(QColor(theme.frame), 1))
        painter.drawLine(QPointF(box.left(), zero), QPointF(box.right() - 1, zero))
        ink = QColor(theme.muted)
        label = "in all"
        text.put(painter, LEFT - 6, self.height() - 7.0, label, face=face, ink=ink, align=1.0)

    def _paint_legend(self, painter: QPainter, why: Why) -> None:
        """From the strongest for to the strongest against, with both actions' names."""
        theme, face = colours(), text.font(SMALL)
        box, left = self.map, self.map.right() + 10
        largest = float(np.abs(why.influence.bands).max())
        steps = 40
        lower, upper = box.top() + SMALL + 6, box.bottom() - SMALL - 6
        high = (upper - lower) / steps
        for step in range(steps):
            colour = balance_colour(1 - 2 * step / (steps - 1), theme.dark)
            painter.fillRect(QRectF(left, lower + step * high, 10, high + 0.5), colour)
        room = self._legend - 11
        for y, action, value in (
            (lower, why.favoured, largest),
            (upper, why.against, -largest),
        ):
            outside = y - SMALL if y == lower else y + SMALL
            inside = y + SMALL / 2 if y == lower else y - SMALL / 2
            name = text.elided_name(f"for {action}", face, room)
            text.put(painter, left, outside, name, face=face, ink=QColor(theme.text))
            number = why_words.signed(value)
            text.put(painter, left + 14, inside, number, face=face, ink=QColor(theme.muted))
