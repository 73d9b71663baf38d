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
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPen, QPolygonF

from forcelab.arrays import Real
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import NUMBER
from forcelab.gui.figures.colormap import translucent
from forcelab.gui.kit import text_size
from forcelab.gui.kit.plot import BoxItem, ValueAxis
from forcelab.gui.theme import colours
from forcelab.signals.wavelets import cone_of_influence

if TYPE_CHECKING:
    from forcelab.signals.scalogram import Scalogram


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
    linear = np.clip(_linear(lightness, low, hue), 0.0, 1.0)
    # The sRGB transfer function [2]_.
    curved = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.round(255 * curved).astype(np.uint8)


#: How many colours a map has; as many to either side of the middle one.
SHADES = 255


@cache
def magnitude_colours(dark: bool) -> Bytes:
    """A sequence from the least to the largest magnitude, shape (SHADES, 3). Not to be changed.

    On dark it rises from the ground to light, on light it falls from white to dark; lightness is
    linear in both.
    """
    stops = _ON_DARK if dark else _ON_LIGHT
    at = np.linspace(0.0, 1.0, len(stops))
    share = np.linspace(0.0, 1.0, SHADES)
    lightness, chroma, hue = (np.interp(share, at, column) for column in stops.T)
    return oklch_to_srgb(lightness, chroma, np.radians(hue))


@cache
def phase_colours(dark: bool) -> Bytes:
    """A circle of hues of one lightness, from -pi to pi, shape (SHADES, 3). Not to be changed."""
    hue = 2 * np.pi * np.arange(SHADES) / SHADES
    lightness = np.full(SHADES, 0.68 if dark else 0.74)
    return oklch_to_srgb(lightness, np.full(SHADES, 0.115), hue)


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


class ConeAndMarks(BoxItem):
    """The hatched cone of influence over a picture, and marks at the scales that are recognised.

    `bounds` are the recording's ends (s), `rate` its samples a second.
    """

    def __init__(self, box: pg.ViewBox) -> None:
        super().__init__(box)
        self.bounds, self.rate = (0.0, 1.0), 1.0
        # Kept as a picture while the cursor moves over it.
        self.setCacheMode(self.CacheMode.DeviceCoordinateCache)

    def paint(self, painter: QPainter, *_: object) -> None:
        (start, end), (top, bottom) = self.box.viewRange()
        plot, theme = self.box.rect(), colours()
        xs = np.arange(plot.left(), plot.right() + 2, 2.0)
        times = start + xs / plot.width() * (end - start)
        # Beyond the recording there is none.
        scales = np.maximum(cone_of_influence(times, self.bounds, E_FOLDING) * self.rate, 1e-3)
        if float(scales.min()) < LARGEST:
            shares = (np.log(scales) - top) / (bottom - top)
            self._paint_cone(painter, xs, np.clip(shares, 0.0, 1.0) * plot.height(), plot)
        pen = QPen(translucent(theme.text, 0.22), 1.0)
        pen.setDashPattern([1.0, 5.0])
        painter.setPen(pen)
        heights = [(math.log(scale) - top) / (bottom - top) * plot.height() for scale in MARKED]
        spots = [round(y) + 0.5 for y in heights if 0 < y < plot.height()]
        painter.drawLines([QLineF(plot.left(), y, plot.right(), y) for y in spots])
        for colour, thickness in ((theme.background, 3.0), (theme.text, 1.2)):
            pen = QPen(QColor(colour), thickness)
            pen.setCapStyle(Qt.PenCapStyle.FlatCap)
            painter.setPen(pen)
            painter.drawLines([QLineF(plot.right() - 7, y, plot.right(), y) for y in spots])
            painter.drawLines([QLineF(plot.left(), y, plot.left() + 7, y) for y in spots])

    def _paint_cone(self, painter: QPainter, xs: Real, ys: Real, plot: QRectF) -> None:
        theme = colours()
        edge = [QPointF(x, y) for x, y in zip(xs.tolist(), ys.tolist(), strict=True)]
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(translucent(theme.background, 0.35))
        corners = [QPointF(plot.right() + 2, plot.bottom()), QPointF(plot.left(), plot.bottom())]
        painter.drawPolygon(QPolygonF([*edge, *corners]))
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QPen(translucent(theme.text, 0.3), 1.0))
        painter.drawLines([QLineF(p.x(), p.y(), p.x(), plot.bottom()) for p in edge[::4]])
        painter.setPen(QPen(translucent(theme.text, 0.5), 1.0))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawPolyline(QPolygonF(edge))
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)


class FrequencyAxis(ValueAxis):
    """Frequencies along logarithms of scales: `rate` samples a second, the largest on top."""

    def __init__(self, free: float) -> None:
        self.rate = 1.0
        self.free = free  # pixels at the top that have no numbers
        super().__init__("left")

    def set_rate(self, rate: float) -> None:
        if rate != self.rate:
            self.rate = rate
            self.picture = None
            self.update()

    def tickValues(
        self, minVal: float, maxVal: float, size: float
    ) -> list[tuple[float, list[float]]]:
        """Powers of ten, and 2 and 5 times them."""
        minVal, maxVal = sorted((minVal, maxVal))
        low, high = (self.rate / (FOURIER_FACTOR * math.exp(y)) for y in (maxVal, minVal))
        decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)))
        levels = []
        for step, digits in ((1.0, (1,)), (0.5, (2, 5))):
            hertz = (digit * 10.0**decade for decade in decades for digit in digits)
            places = (math.log(self.rate / (FOURIER_FACTOR * value)) for value in hertz)
            top = minVal + self.free / max(size, 1.0) * (maxVal - minVal)
            levels.append((step, [y for y in places if top <= y <= maxVal]))
        return levels

    def tickStrings(self, values: list[float], scale: float, spacing: float) -> list[str]:
        labels = [f"{self.rate / (FOURIER_FACTOR * math.exp(y)):.3g}" for y in values]
        if spacing == 1.0 and labels:
            labels[len(labels) // 2] += " Hz"
        return labels


def amount_text(value: float) -> str:
    """A number in few characters: ``110``, ``0.003``, ``2e-07``."""
    if not 1e-4 <= value < 1e5:
        return f"{value:.1g}"
    digits = max(0, 1 - math.floor(math.log10(value)))
    return f"{value:.{digits}f}".rstrip("0").rstrip(".") if digits else f"{value:.0f}"


def draw_bar(painter: QPainter, box: QRectF, ends: tuple[str, str], *, phase: bool = False) -> None:
    """The legend: all colours in a bar, the least and the largest value beside its ends."""
    theme = colours()
    table = phase_colours(theme.dark) if phase else magnitude_colours(theme.dark)
    kind = QImage.Format.Format_RGB888
    painter.drawImage(box, QImage(table[::-1].tobytes(), 1, len(table), 3, kind))
    painter.setPen(QPen(QColor(theme.frame), 1.0))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawRect(box)
    face, ink = text_size.font(NUMBER), QColor(theme.muted)
    half = text_size.pixels(NUMBER / 2)
    for label, y in zip(ends, (box.bottom() - half, box.top() + half), strict=True):
        text.draw_text(painter, box.right() + 4, y, label, face=face, ink=ink)


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


class ScalogramImage(pg.ImageItem):
    """An image of rows in a box of seconds and logarithms of scales."""

    def __init__(self) -> None:
        super().__init__(axisOrder="row-major")
        self.qimage: QImage | None

    def show_values(
        self, values: NDArray[np.float32], ends: tuple[float, float], *, phase: bool = False
    ) -> None:
        """Draw values in the theme's colours, of which the first and the last are for the ends."""
        low, high = (-math.pi, math.pi) if phase else ends
        table = phase_colours(colours().dark) if phase else magnitude_colours(colours().dark)
        self.setImage(values, levels=(low, max(high, low + 1e-9)), lut=table)

    def render(self) -> None:
        """Make the image, in the format that is drawn in a fraction of the time of indices."""
        super().render()
        if self.qimage is not None:
            form = QImage.Format.Format_ARGB32_Premultiplied
            self.qimage = self.qimage.convertToFormat(form)


class Picture(ScalogramImage):
    """A picture of one channel of the demonstration."""

    def __init__(self) -> None:
        super().__init__()
        self.source: Scalogram | None = None
        #: Decimal logarithms of the magnitudes for the first and the last colour.
        self.ends = -1.0, 0.0
        self.smooth = True
        self.hide()

    def show_picture(self, source: Scalogram, steady: bool) -> None:
        self.source = source
        self.recolour(steady)
        top, bottom = math.log(SMALLEST), math.log(LARGEST)
        self.setRect(QRectF(source.start, top, source.end - source.start, bottom - top))
        self.show()

    def recolour(self, steady: bool) -> None:
        """Draw the same picture in the theme's colours, or in another range of them."""
        if self.source is not None:
            self.ends = colour_range(self.source, steady)
            self.show_values(self.source.values, self.ends, phase=self.source.phase)

    def paint(self, painter: QPainter, *args: Any) -> None:
        if self.source is None:
            return
        if not self.source.coarse:
            painter.fillRect(self.boundingRect(), QColor(colours().grid))  # where nothing is known
        # Between two phases there is no mean that means anything.
        hint = QPainter.RenderHint.SmoothPixmapTransform
        painter.setRenderHint(hint, self.smooth and not self.source.phase)
        super().paint(painter, *args)


class ScalogramLayers:
    """Pictures of one channel: the old ones stay below until a fine one covers them."""

    def __init__(self, box: pg.ViewBox) -> None:
        # From the bottom: all of the demonstration, the last fine picture, the newest coarse one.
        self._pictures = self._whole, self._fine, self._coarse = Picture(), Picture(), Picture()
        for z, picture in enumerate(self._pictures):
            picture.setZValue(z)
            box.addItem(picture, ignoreBounds=True)
        self._newest = self._coarse

    @property
    def ends(self) -> tuple[float, float]:
        """Decimal logarithms of the newest picture's magnitudes for the first and last colour."""
        return self._newest.ends

    def clear(self) -> None:
        for picture in self._pictures:
            picture.source = None
            picture.hide()

    def take(self, source: Scalogram, *, whole: bool, steady: bool) -> None:
        """Lay a newer picture over the others; `whole` if it shows all of the demonstration."""
        self._newest = self._coarse if source.coarse else self._whole if whole else self._fine
        # It covers what is nearer to the eye.
        for picture in self._pictures[self._pictures.index(self._newest) + 1 :]:
            picture.hide()
        self._newest.show_picture(source, steady)

    def recolour(self, steady: bool) -> None:
        for picture in self._pictures:
            picture.recolour(steady)

    def set_smooth(self, smooth: bool) -> None:
        """Drawing that is not smooth, for while it is moved, takes half the time."""
        for picture in self._pictures:
            if picture.smooth != smooth:
                picture.smooth = smooth
                picture.update()
