"""A scalogram as an image, with its colour maps, frequency axis and marks.

Lightness is that of OKLab, which is even to the eye from black to white; hue and chroma only add
what tells neighbours apart. Where the screen cannot show a chroma, it is lowered, never the
lightness.

References
----------
.. [1] Ottosson, B., "A perceptual color space for image processing" (2020): OKLab and its matrices.
.. [2] IEC 61966-2-1: the sRGB transfer function.

Wavelet and marks are those of preset ``paper``, written out: to load the wavelets takes long.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPen, QPolygonF

from forcelab.gui.figures import text
from forcelab.gui.figures.axes import LogAxis
from forcelab.gui.figures.colormap import translucent
from forcelab.gui.theme import Colours, colours
from forcelab.signals.wavelets import cone_of_influence

if TYPE_CHECKING:
    from forcelab.signals.scalogram import Scalogram


Real = NDArray[np.float64]
Bytes = NDArray[np.uint8]

#: From OKLab to cube roots of cone responses, and from cone responses to linear sRGB [1]_.
_CONES = np.array(
    [
        [1.0, 0.3963377774, 0.2158037573],
        [1.0, -0.1055613458, -0.0638541728],
        [1.0, -0.0894841775, -1.2914855480],
    ]
)
_LINEAR = np.array(
    [
        [4.0767416621, -3.3077115913, 0.2309699292],
        [-1.2684380046, 2.6097574011, -0.3413193965],
        [-0.0041960863, -0.7034186147, 1.7076147010],
    ]
)
#: Lightness, chroma and hue in degrees, evenly spaced from the least to the largest magnitude.
#: Lightness runs on a straight line; the least is close to the panel's ground.
_ON_DARK = np.array(
    [
        [0.22, 0.030, 265.0],
        [0.37, 0.120, 285.0],
        [0.52, 0.170, 325.0],
        [0.67, 0.170, 385.0],
        [0.82, 0.150, 430.0],
        [0.97, 0.080, 465.0],
    ]
)
_ON_LIGHT = np.array(
    [
        [0.985, 0.012, 110.0],
        [0.845, 0.110, 140.0],
        [0.705, 0.130, 180.0],
        [0.565, 0.140, 230.0],
        [0.425, 0.150, 268.0],
        [0.285, 0.120, 300.0],
    ]
)


def _linear(lightness: Real, chroma: Real, hue: Real) -> Real:
    """Linear sRGB of OKLCH colours, shape (..., 3), inside the screen's range or not."""
    lab = np.stack([lightness, chroma * np.cos(hue), chroma * np.sin(hue)], axis=-1)
    return np.asarray(((lab @ _CONES.T) ** 3) @ _LINEAR.T, dtype=np.float64)


def oklch_to_srgb(lightness: Real, chroma: Real, hue: Real) -> Bytes:
    """Colours (RGB, shape (n, 3)) for OKLCH, with the largest chroma up to `chroma` that fits.

    Lightness from 0 to 1, hue in radians; all of shape (n,).
    """
    low, high = np.zeros_like(chroma), chroma.copy()
    for _ in range(20):
        half = 0.5 * (low + high)
        linear = _linear(lightness, half, hue)
        fits = np.all((linear >= -1e-6) & (linear <= 1 + 1e-6), axis=-1)
        low, high = np.where(fits, half, low), np.where(fits, high, half)
    fits = np.all(np.abs(_linear(lightness, chroma, hue) - 0.5) <= 0.5, axis=-1)
    linear = np.clip(_linear(lightness, np.where(fits, chroma, low), hue), 0.0, 1.0)
    # The sRGB transfer function [2]_.
    curved = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.round(255 * curved).astype(np.uint8)


@cache
def magnitude_colours(dark: bool, count: int = 255) -> Bytes:
    """A sequence from the least to the largest magnitude, shape (count, 3). Not to be changed.

    On dark it rises from the ground to light, on light it falls from white to dark; lightness is
    linear in both.
    """
    stops = _ON_DARK if dark else _ON_LIGHT
    at = np.linspace(0.0, 1.0, len(stops))
    share = np.linspace(0.0, 1.0, count)
    lightness, chroma, hue = (np.interp(share, at, column) for column in stops.T)
    return oklch_to_srgb(lightness, chroma, np.radians(hue))


@cache
def phase_colours(dark: bool, count: int = 255) -> Bytes:
    """A circle of hues of one lightness, from -pi to pi, shape (count, 3). Not to be changed."""
    hue = 2 * np.pi * np.arange(count) / count
    lightness = np.full(count, 0.68 if dark else 0.74)
    return oklch_to_srgb(lightness, np.full(count, 0.115), hue)


#: p of the Morlet wavelet; its Fourier period and its e-folding time, both over its scale.
MORLET_P = 5.0
FOURIER_FACTOR = 1.232462020307901
E_FOLDING = math.sqrt(2.0)

#: Scales that are marked, in samples of the grid.
MARKED = tuple(2.0**j for j in range(1, 11))
#: Smallest scale shown, in samples: the wavelet is cut by the Nyquist frequency below.
SMALLEST = 2.0
#: Largest scale shown: an octave beyond the marks.
LARGEST = 2.0 * MARKED[-1]


#: The colour of unknown values.
UNKNOWN = 255
#: Height of small numbers in pixels.
SMALL = 10.0


@dataclass(frozen=True, slots=True)
class Rows:
    """The vertical axis: logarithms of scales (samples), the smallest on top, in pixels.

    `factor` is the wavelet's period over its scale, `rate` the samples a second.
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
        """The frequency at which a scale's response is largest."""
        return self.rate / (self.factor * scale)

    def scale(self, y: float) -> float:
        """The scale at a pixel."""
        share = (y - self.top) / (self.bottom - self.top)
        return float(self.smallest * (self.largest / self.smallest) ** share)


def image(picture: Scalogram, low: float, high: float, dark: bool) -> QImage:
    """A picture as an image, one pixel a value; transparent where nothing is known."""
    if not picture.phase:
        return magnitudes(picture.values, low, high, dark)
    places = (picture.values + np.float32(np.pi)) * np.float32(UNKNOWN / (2 * np.pi))
    return _coloured(np.where(places >= UNKNOWN, 0.0, places), phase_colours(dark, UNKNOWN))


def magnitudes(values: NDArray[np.float32], low: float, high: float, dark: bool) -> QImage:
    """Logarithms of magnitudes as an image, one pixel a value; transparent where one is NaN."""
    places = (values - np.float32(low)) * np.float32(UNKNOWN / max(high - low, 1e-9))
    return _coloured(places, magnitude_colours(dark, UNKNOWN))


def _coloured(places: NDArray[np.float32], table: NDArray[np.uint8]) -> QImage:
    """Indices into a table of colours as an image."""
    finite = np.isfinite(places)
    codes = np.where(finite, np.clip(places, 0, UNKNOWN - 1), UNKNOWN)
    return _as_image(_palette(table)[codes.astype(np.uint8)])


def _palette(table: NDArray[np.uint8]) -> NDArray[np.uint32]:
    """The table's colours as pixels, and a transparent one."""
    palette = np.zeros(UNKNOWN + 1, dtype=np.uint32)
    red, green, blue = table.astype(np.uint32).T
    palette[:UNKNOWN] = 0xFF000000 | red << 16 | green << 8 | blue
    return palette


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
    """Hatch the coefficients that the ends of the recording influence."""
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
    visible = [m for m in marks if avoid <= axis.at(m[0]) <= rows.bottom - SMALL / 2]
    # The unit stands where no number of the legend is near.
    named = len(visible) // 2 if len(visible) > 2 else 0
    for place, (value, label) in enumerate(visible):
        y = axis.at(value)
        painter.setPen(QPen(QColor(colours.frame), 1.0))
        painter.drawLine(QLineF(right - 4, y, right, y))
        marked = f"{label} Hz" if place == named else label
        ink = QColor(colours.text)
        text.draw_text(painter, right - 7, y, marked, face=face, ink=ink, align=1.0)


def amount_text(value: float) -> str:
    """A number in few characters: ``110``, ``0.003``, ``2e-07``."""
    if not 1e-4 <= value < 1e5:
        return f"{value:.1g}"
    digits = max(0, 1 - math.floor(math.log10(value)))
    return f"{value:.{digits}f}".rstrip("0").rstrip(".") if digits else f"{value:.0f}"


def draw_bar(
    painter: QPainter, box: QRectF, ends: tuple[str, str], phase: bool, colours: Colours
) -> None:
    """The legend: all colours in a bar, the least and the largest value beside its ends."""
    table = phase_colours(colours.dark) if phase else magnitude_colours(colours.dark)
    painter.drawImage(box, _as_image(_palette(table[::-1])[:UNKNOWN, np.newaxis]))
    painter.setPen(QPen(QColor(colours.frame), 1.0))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawRect(box)
    face, ink = text.font(SMALL), QColor(colours.muted)
    for label, y in zip(ends, (box.bottom() - SMALL / 2, box.top() + SMALL / 2), strict=True):
        text.draw_text(painter, box.right() + 4, y, label, face=face, ink=ink)


def draw_plate(
    painter: QPainter,
    corner: QPointF,
    line: str,
    colours: Colours,
    area: QRectF,
    *,
    quiet: bool = False,
) -> None:
    """Write a line on a plate that covers what is behind it, kept inside `area`.

    A `quiet` one is smaller, and the picture shows through.
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
    text.draw_text(painter, box.left() + 6, box.center().y(), line, face=face, ink=ink)
    painter.restore()


#: From the bottom: all of the demonstration, the last fine picture, the newest coarse one.
ORDER = ("whole", "fine", "coarse")


def colour_range(picture: Scalogram, steady: bool) -> tuple[float, float]:
    """Decimal logarithms of the magnitudes for the first and the last colour.

    They are those of the whole demonstration where they are to be `steady` while panning.
    """
    view = picture.view
    finite = picture.values[np.isfinite(picture.values)]
    if steady or picture.phase or not finite.size:
        return view.low, view.high
    from forcelab.signals.scalogram import colour_range as fitted  # loaded by then

    return fitted(finite, 0.5)


class ScalogramLayers:
    """Pictures of one channel: the old ones stay below until a fine one covers them."""

    def __init__(self) -> None:
        self._layers: dict[str, tuple[Scalogram, QImage]] = {}

    def clear(self) -> None:
        self._layers.clear()

    def take(self, picture: Scalogram, *, whole: bool, steady: bool) -> None:
        """Lay a newer picture over the others; `whole` if it shows all of the demonstration."""
        layer = picture, _layer_image(picture, steady)
        if picture.coarse:
            self._layers["coarse"] = layer
            return
        self._layers.pop("coarse", None)
        self._layers["fine"] = layer
        if whole:
            self._layers["whole"] = layer

    def recolour(self, steady: bool) -> None:
        """Make the images anew, from the same pictures."""
        for kind, (picture, _) in list(self._layers.items()):
            self._layers[kind] = picture, _layer_image(picture, steady)

    def paint(
        self, painter: QPainter, plot: QRectF, start: float, end: float, *, smooth: bool
    ) -> None:
        """Draw what lies between two times (s) into `plot`.

        Drawing that is not `smooth`, for while it is moved, takes half the time.
        """
        for kind in ORDER:
            if kind in self._layers:
                for region in self._visible_region(kind, start, end):
                    _paint(painter, plot, (start, end), region, smooth, *self._layers[kind])

    def _visible_region(self, kind: str, start: float, end: float) -> list[tuple[float, float]]:
        """Where a picture is not covered by a finer one."""
        if kind != "whole" or "fine" not in self._layers:
            return [(start, end)]
        above, _ = self._layers["fine"]
        return [(start, min(end, above.start)), (max(start, above.end), end)]


def _layer_image(picture: Scalogram, steady: bool) -> QImage:
    return image(picture, *colour_range(picture, steady), colours().dark)


def _paint(
    painter: QPainter,
    plot: QRectF,
    span: tuple[float, float],
    region: tuple[float, float],
    smooth: bool,
    picture: Scalogram,
    layer: QImage,
) -> None:
    """Draw the part of a picture between two times (s), the `region`."""
    first, last = max(picture.start, region[0]), min(picture.end, region[1])
    if last <= first:
        return
    start, end = span
    per_pixel = (end - start) / plot.width()
    left = plot.left() + (first - start) / per_pixel
    target = QRectF(left, plot.top(), (last - first) / per_pixel, plot.height())
    per_second = layer.width() / (picture.end - picture.start)
    from_left, width = (first - picture.start) * per_second, (last - first) * per_second
    if not picture.coarse:
        painter.fillRect(target, QColor(colours().grid))  # where nothing is known
    # Between two phases there is no mean that means anything.
    hint = QPainter.RenderHint.SmoothPixmapTransform
    painter.setRenderHint(hint, smooth and not picture.phase)
    painter.drawImage(target, layer, QRectF(from_left, 0, width, layer.height()))
