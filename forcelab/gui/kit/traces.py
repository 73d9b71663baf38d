"""Curves of channels: one item a channel, which fills each column of pixels that it covers.

Filling columns takes a fraction of the time of polylines, which Qt draws at 15 ms for six jagged
ones of 3200 points and at 50 ms for six smooth ones of 50; and it is smooth. Into SVG and PDF the
same columns go as lines.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from functools import cache, lru_cache

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QImage, QPaintEngine, QPainter, QPen, QPolygonF
from PySide6.QtWidgets import QStyleOptionGraphicsItem, QWidget

from forcelab.arrays import Real
from forcelab.gui.figures import text
from forcelab.gui.figures.colormap import mixed, translucent
from forcelab.gui.kit.plot import BoxItem
from forcelab.gui.theme import Colours, colours
from forcelab.signals.minmax import Extremes

#: Thickness of curves and side of the squares at samples, in pixels of the widget.
THICKNESS = 1.2
DOT = 3.0
#: Width and height of the mark of a glitch, in pixels.
GLITCH = (9.0, 6.0)
#: The least contrast of a text to its ground (WCAG 2.2).
READABLE_CONTRAST = 4.5
#: Rows of an image, whose numbers have to fit into 16 bits.
HIGHEST = 30_000


def fill_columns(
    pixels: NDArray[np.uint32], top: Real, bottom: Real, colour: QColor
) -> tuple[int, int]:
    """Fill each column of an image from one height to another, in place.

    The image has shape (h, w) and is premultiplied by its alpha. Heights, shape (w,), are in pixels
    from the top, not necessarily inside of it; NaN leaves a column as it is, and a pixel that is
    covered in part gets as much of the colour. Gives the rows that hold anything, from one up to
    another.
    """
    height, width = pixels.shape
    drawn = ~np.isnan(top)
    # Clipped while still floats: heights far outside do not fit into whole numbers.
    top = np.minimum(np.maximum(np.where(drawn, top, height + 1), -1), height + 1)
    bottom = np.minimum(np.maximum(np.where(drawn, bottom, -1), -1), height + 1)
    first, last = np.ceil(top).astype(np.int16), np.floor(bottom).astype(np.int16)
    start = np.maximum(first, 0)
    count = np.maximum(np.minimum(last, height) - start, 0).astype(np.uint16)
    begin = min(max(int(first.min()) - 1, 0), height)
    end = max(min(int(last.max()) + 1, height), begin)
    rows = np.arange(begin, end, dtype=np.uint16)[:, np.newaxis]
    # As numbers without a sign, rows above the first are far below the last.
    inside = rows - start.astype(np.uint16) < count
    shades = _shades(colour.rgba())
    np.copyto(pixels[begin:end], shades[255], where=inside)
    # The pixels at both ends, which are covered in part, unless both ends are in one.
    within = last < first
    rows = np.concatenate([first - 1, last])
    above, below = np.where(within, bottom, first) - top, np.where(within, 0.0, bottom - last)
    shares = np.concatenate([above, below])
    (ends,) = ((rows >= 0) & (rows < height) & (shares > 0.0)).nonzero()
    rows, columns = rows[ends], ends % width
    shade = shades[np.minimum(shares[ends] * 255.0 + 0.5, 255.0).astype(np.uint8)]
    thinner = pixels[rows, columns] >> 24 < shade >> 24  # where nothing covers more of it
    pixels[rows[thinner], columns[thinner]] = shade[thinner]
    return begin, end


@lru_cache(maxsize=64)
def _shades(colour: int) -> NDArray[np.uint32]:
    """A colour where it covers 0 to 255 parts of a pixel, premultiplied by its alpha."""
    alpha = np.arange(256, dtype=np.uint32) * np.uint32(colour >> 24) // np.uint32(255)
    shades: NDArray[np.uint32] = alpha << np.uint32(24)
    for place in (16, 8, 0):
        shades |= (np.uint32(colour >> place & 255) * alpha // np.uint32(255)) << np.uint32(place)
    return shades


def column_edges(box: pg.ViewBox, ratio: float) -> tuple[float, Real]:
    """The edges of the columns of the screen that a box covers, in the box's x unit.

    Before them, how many pixels from the box's left the first one is. `ratio` are the pixels of the
    screen for one of the widget.
    """
    left, width = box.scenePos().x() * ratio, box.rect().width()
    first = round(left)
    count = max(int(np.ceil(left + width * ratio)) - first, 1)
    start, end = box.viewRange()[0]
    across = (first - left + np.arange(count + 1)) / ratio / width
    return (first - left) / ratio, start + across * (end - start)


class Trace(BoxItem):
    """A curve in a box, drawn from the extremes of its columns of pixels.

    The item covers its box and has pixels as coordinates. `opaque` is the curve's opacity.
    """

    opaque = 1.0

    def __init__(self, box: pg.ViewBox, column: int) -> None:
        super().__init__(box)
        self._column = column
        self._key: object = None
        self._pixels = np.empty((0, 0), dtype=np.uint32)
        #: The rows of it that hold the curve, and where they stand.
        self._image, self._place = QImage(), QPointF()

    @abstractmethod
    def extremes(self, edges: Real) -> Extremes:
        """The least and the greatest value of each column, between edges in the box's x unit."""

    def version(self) -> object:
        """Equal as long as the same columns have the same extremes."""
        return None

    def samples(self, start: float, end: float, width: float) -> tuple[Real, Real] | None:
        """Places and values of the samples between two places; None if they are not dotted."""
        return None

    def glitches(self, start: float, end: float) -> tuple[Real, NDArray[np.bool_]]:
        """Places of values beyond all axes, and which of them are above."""
        return np.empty(0), np.empty(0, dtype=np.bool_)

    def paint(
        self, painter: QPainter, option: QStyleOptionGraphicsItem, widget: QWidget | None = None
    ) -> None:
        box = self.box.rect()
        (x0, x1), _ = self.box.viewRange()
        colour = translucent(curve_colour(self._column, colours()), self.opaque)
        if box.width() < 1 or box.height() < 1:
            return
        if painter.paintEngine().type() in (QPaintEngine.Type.Raster, QPaintEngine.Type.OpenGL2):
            self._paint_image(painter, colour)
        else:
            self._paint_lines(painter, colour)
        dots = self.samples(x0, x1, box.width())
        if dots is not None:
            places = np.stack([self._x(dots[0]), self._y(dots[1])], axis=1)
            for x, y in places[np.isfinite(places).all(axis=1)].tolist():
                painter.fillRect(QRectF(x - DOT / 2, y - DOT / 2, DOT, DOT), colour)
        times, upwards = self.glitches(x0, x1)
        if len(times):
            paint_glitches(painter, self._x(times), upwards, (box.top(), box.bottom()))

    def _paint_image(self, painter: QPainter, colour: QColor) -> None:
        """Draw the columns at the resolution of the screen; kept while they are the same."""
        ratio, box = painter.device().devicePixelRatioF(), self.box.rect()
        spot = self.box.scenePos().x(), box.width(), box.height(), ratio
        key = (*self.box.viewRange(), spot, colour.rgba(), self.version())
        if key != self._key:
            self._key = key
            left, edges = column_edges(self.box, ratio)
            found = self.extremes(edges)
            shape = min(max(math.ceil(box.height() * ratio), 1), HIGHEST), len(edges) - 1
            if self._pixels.shape == shape:
                self._pixels.fill(0)
            else:
                self._pixels = np.zeros(shape, dtype=np.uint32)
            half = THICKNESS / 2 * ratio
            top, bottom = self._y(found.high) * ratio - half, self._y(found.low) * ratio + half
            first, last = fill_columns(self._pixels, top, bottom, colour)
            rows, form = self._pixels[first:last], QImage.Format.Format_ARGB32_Premultiplied
            self._image = QImage(rows.data, rows.shape[1], len(rows), 4 * rows.shape[1], form)
            self._image.setDevicePixelRatio(ratio)
            self._place = QPointF(left, first / ratio)
        painter.drawImage(self._place, self._image)

    def _paint_lines(self, painter: QPainter, colour: QColor) -> None:
        """Draw the columns as a line from the least to the greatest value of each."""
        width = max(round(self.box.rect().width()), 1)
        start, end = self.box.viewRange()[0]
        edges = np.linspace(start, end, width + 1)
        found = self.extremes(edges)
        x = np.repeat(self._x((edges[:-1] + edges[1:]) / 2), 2)
        y = np.stack([self._y(found.low), self._y(found.high)], axis=1).ravel()
        painter.setPen(QPen(colour, THICKNESS))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawPath(pg.arrayToQPath(x, y, connect="finite"))

    def _x(self, places: Real) -> Real:
        """Pixels of places on the x axis."""
        start, end = self.box.viewRange()[0]
        return np.asarray((places - start) / (end - start) * self.box.rect().width())

    def _y(self, values: Real) -> Real:
        """Pixels of values."""
        low, high = self.box.viewRange()[1]
        with np.errstate(over="ignore"):
            return np.asarray((high - values) / (high - low) * self.box.rect().height())


def curve_colour(column: int, theme: Colours) -> QColor:
    """The colour of a channel: it depends on its place in the recording only."""
    return QColor(theme.curves[column % len(theme.curves)])


@cache
def curve_ink(column: int, theme: Colours) -> QColor:
    """The colour of a channel's name and values: its curve's, deepened until it can be read."""
    colour = curve_colour(column, theme)
    inks = (mixed(colour, theme.text, share / 20) for share in range(21))
    return next(ink for ink in inks if text.contrast(ink, QColor(theme.panel)) >= READABLE_CONTRAST)


def paint_glitches(
    painter: QPainter, x: Real, upwards: NDArray[np.bool_], edges: tuple[float, float]
) -> None:
    """Draw an arrow head at the edge of a plot for each glitch at pixels `x`, towards its value.

    `upwards` are those above the plot; `edges` are its top and bottom in pixels.
    """
    wide, high = GLITCH
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(QPen(QColor(colours().background), 1.0))
    painter.setBrush(QColor(colours().trouble))
    # One arrow a pixel is enough, however many there are.
    for at, up in sorted({*zip(np.round(x).tolist(), upwards.tolist(), strict=True)}):
        tip, base = (
            (edges[0] + 1, edges[0] + 1 + high) if up else (edges[1] - 1, edges[1] - 1 - high)
        )
        corners = [(at, tip), (at - wide / 2, base), (at + wide / 2, base)]
        painter.drawPolygon(QPolygonF([QPointF(*corner) for corner in corners]))
    painter.restore()
