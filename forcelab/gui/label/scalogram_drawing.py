"""What the scalogram's panel draws: pictures as images, the cone of influence, the axis in Hz."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPen, QPolygonF

from forcelab.gui.figures import text
from forcelab.gui.figures.axes import LogAxis
from forcelab.gui.figures.shades import translucent
from forcelab.gui.label.colourmaps import magnitude_colours, phase_colours
from forcelab.gui.label.scalogram_scales import E_FOLDING
from forcelab.gui.theme import Colours
from forcelab.signals.wavelets import cone_of_influence

if TYPE_CHECKING:
    from forcelab.signals.scalogram import Scalogram

__all__ = [
    "Rows",
    "amount",
    "draw_bar",
    "draw_cone",
    "draw_frequencies",
    "draw_marks",
    "image",
    "magnitudes",
    "plate",
]

Real = NDArray[np.float64]

#: The colour that says that nothing is known.
NOTHING = 255
#: Height of small numbers in pixels.
SMALL = 10.0


@dataclass(frozen=True, slots=True)
class Rows:
    """The vertical axis: logarithms of scales, the smallest on top.

    Parameters
    ----------
    top, bottom : float
        Pixels.
    smallest, largest : float
        Scales in samples at top and bottom.
    factor : float
        Periods over scales, of the wavelet.
    rate : float
        Samples a second.
    """

    top: float
    bottom: float
    smallest: float
    largest: float
    factor: float
    rate: float

    def y(self, scale: float) -> float:
        """The pixel of a scale."""
        share = math.log(scale / self.smallest) / math.log(self.largest / self.smallest)
        return self.top + share * (self.bottom - self.top)

    def hertz(self, scale: float) -> float:
        """The frequency that a scale answers to most."""
        return self.rate / (self.factor * scale)

    def scale(self, y: float) -> float:
        """The scale at a pixel."""
        share = (y - self.top) / (self.bottom - self.top)
        return float(self.smallest * (self.largest / self.smallest) ** share)


def image(picture: Scalogram, low: float, high: float, dark: bool) -> QImage:
    """A picture as an image, one pixel a value; transparent where nothing is known."""
    if not picture.phase:
        return magnitudes(picture.values, low, high, dark)
    places = (picture.values + np.float32(np.pi)) * np.float32(NOTHING / (2 * np.pi))
    return _coloured(np.where(places >= NOTHING, 0.0, places), phase_colours(dark, NOTHING))


def magnitudes(values: NDArray[np.float32], low: float, high: float, dark: bool) -> QImage:
    """Logarithms of magnitudes as an image, one pixel a value; transparent where one is NaN."""
    places = (values - np.float32(low)) * np.float32(NOTHING / max(high - low, 1e-9))
    return _coloured(places, magnitude_colours(dark, NOTHING))


def _coloured(places: NDArray[np.float32], table: NDArray[np.uint8]) -> QImage:
    """Places in a table of colours as an image."""
    known = np.isfinite(places)
    codes = np.where(known, np.clip(places, 0, NOTHING - 1), NOTHING)
    return _as_image(_words(table)[codes.astype(np.uint8)])


def _words(table: NDArray[np.uint8]) -> NDArray[np.uint32]:
    """Pixels of the table's colours, and one that is transparent."""
    words = np.zeros(NOTHING + 1, dtype=np.uint32)
    red, green, blue = table.astype(np.uint32).T
    words[:NOTHING] = 0xFF000000 | red << 16 | green << 8 | blue
    return words


def _as_image(pixels: NDArray[np.uint32]) -> QImage:
    """An image with memory of its own."""
    height, width = pixels.shape
    data = np.ascontiguousarray(pixels).data
    kind = QImage.Format.Format_ARGB32_Premultiplied
    return QImage(data, width, height, 4 * width, kind).copy()


def draw_cone(
    painter: QPainter,
    plot: QRectF,
    rows: Rows,
    colours: Colours,
    *,
    span: tuple[float, float],
    bounds: tuple[float, float],
) -> None:
    """Hatch where the ends of the recording bear upon the coefficients."""
    per_pixel = (span[1] - span[0]) / plot.width()
    xs = np.arange(plot.left(), plot.right() + 2, 2.0)
    times = span[0] + (xs - plot.left()) * per_pixel
    # Beyond the recording there is none.
    scales = np.maximum(cone_of_influence(times, bounds, E_FOLDING) * rows.rate, 1e-3)
    if float(scales.min()) >= rows.largest:
        return
    shares = np.log(scales / rows.smallest) / math.log(rows.largest / rows.smallest)
    ys = rows.top + np.clip(shares, 0.0, 1.0) * (rows.bottom - rows.top)
    edge = [QPointF(x, y) for x, y in zip(xs.tolist(), ys.tolist(), strict=True)]
    corners = [QPointF(plot.right() + 2, plot.bottom()), QPointF(plot.left(), plot.bottom())]
    shape = QPolygonF([*edge, *corners])
    painter.save()
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(translucent(colours.background, 0.35))
    painter.drawPolygon(shape)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(QPen(translucent(colours.text, 0.3), 1.0))
    painter.drawLines(
        [QLineF(point.x(), point.y(), point.x(), plot.bottom()) for point in edge[::4]]
    )
    painter.setPen(QPen(translucent(colours.text, 0.5), 1.0))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawPolyline(QPolygonF(edge))
    painter.restore()


def draw_marks(painter: QPainter, plot: QRectF, heights: Sequence[float], colours: Colours) -> None:
    """Mark the scales that the recogniser uses: ticks at both ends, a faint line between."""
    painter.save()
    faint = translucent(colours.text, 0.22)
    pen = QPen(faint, 1.0)
    pen.setDashPattern([1.0, 5.0])
    painter.setPen(pen)
    spots = [round(y) + 0.5 for y in heights if plot.top() < y < plot.bottom()]
    painter.drawLines([QLineF(plot.left(), y, plot.right(), y) for y in spots])
    for colour, thickness in ((colours.background, 3.0), (colours.text, 1.2)):
        pen = QPen(QColor(colour), thickness)
        pen.setCapStyle(Qt.PenCapStyle.FlatCap)
        painter.setPen(pen)
        painter.drawLines([QLineF(plot.right() - 7, y, plot.right(), y) for y in spots])
        painter.drawLines([QLineF(plot.left(), y, plot.left() + 7, y) for y in spots])
    painter.restore()


def draw_frequencies(
    painter: QPainter, right: float, rows: Rows, colours: Colours, avoid: float
) -> None:
    """The axis in Hz along the gutter's edge; no number above `avoid` pixels."""
    axis = LogAxis(rows.hertz(rows.largest), rows.hertz(rows.smallest), rows.bottom, rows.top)
    face = text.font(SMALL)
    marks = axis.marks(SMALL, upright=True)
    painter.setPen(QPen(QColor(colours.frame), 1.0))
    painter.drawLine(QLineF(right - 0.5, rows.top, right - 0.5, rows.bottom))
    shown = [m for m in marks if avoid <= axis.at(m[0]) <= rows.bottom - SMALL / 2]
    # The unit stands where no number of the legend is near.
    named = len(shown) // 2 if len(shown) > 2 else 0
    for place, (value, label) in enumerate(shown):
        y = axis.at(value)
        painter.setPen(QPen(QColor(colours.frame), 1.0))
        painter.drawLine(QLineF(right - 4, y, right, y))
        whole = f"{label} Hz" if place == named else label
        ink = QColor(colours.text)
        text.put(painter, right - 7, y, whole, face=face, ink=ink, align=1.0)


def amount(value: float) -> str:
    """A number in as few characters as tell it: ``110``, ``0.003``, ``2e-07``."""
    if not 1e-4 <= value < 1e5:
        return f"{value:.1g}"
    digits = max(0, 1 - math.floor(math.log10(value)))
    return f"{value:.{digits}f}".rstrip("0").rstrip(".") if digits else f"{value:.0f}"


def draw_bar(
    painter: QPainter, box: QRectF, ends: tuple[str, str], phase: bool, colours: Colours
) -> None:
    """The legend: all colours in a bar, the least and the largest value beside its ends."""
    table = phase_colours(colours.dark) if phase else magnitude_colours(colours.dark)
    painter.drawImage(box, _as_image(_words(table[::-1])[:NOTHING, np.newaxis]))
    painter.setPen(QPen(QColor(colours.frame), 1.0))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawRect(box)
    face, ink = text.font(SMALL), QColor(colours.muted)
    for label, y in zip(ends, (box.bottom() - SMALL / 2, box.top() + SMALL / 2), strict=True):
        text.put(painter, box.right() + 4, y, label, face=face, ink=ink)


def plate(
    painter: QPainter,
    corner: QPointF,
    line: str,
    colours: Colours,
    area: QRectF,
    *,
    quiet: bool = False,
) -> None:
    """A line of text on a plate that covers what is behind it, kept inside `area`.

    `quiet` is for what is said in passing: smaller, and the picture shows through.
    """
    face = text.font(SMALL if quiet else 11.0)
    line = text.elided(line, face, max(area.width() - 16, 1.0))
    box = QRectF(0, 0, text.width(line, face) + 12, 16 if quiet else 20)
    box.moveTopLeft(corner)
    box.moveLeft(max(area.left() + 2, min(box.left(), area.right() - box.width() - 2)))
    box.moveTop(max(area.top() + 2, min(box.top(), area.bottom() - box.height() - 2)))
    ground = translucent(colours.panel, 0.75 if quiet else 0.94)
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(Qt.PenStyle.NoPen if quiet else QPen(QColor(colours.panel_edge), 1.0))
    painter.setBrush(ground)
    painter.drawRoundedRect(box, 3, 3)
    ink = QColor(colours.muted if quiet else colours.text)
    text.put(painter, box.left() + 6, box.center().y(), line, face=face, ink=ink)
    painter.restore()
