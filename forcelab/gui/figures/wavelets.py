"""Wavelets and what they see: psi at several p above the magnitudes of a test signal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QRectF, QSizeF, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPen

from forcelab.gui.figures import text
from forcelab.gui.figures.axes import (
    CURVE_COLOURS,
    Axis,
    LogAxis,
    curve_pen,
    draw_bottom,
    draw_grid,
    draw_left,
    paint_curve,
    paint_names,
)
from forcelab.gui.figures.colormap import colormap_colours
from forcelab.gui.figures.figure import MARGIN, Figure
from forcelab.signals.cwt import cwt, frequencies
from forcelab.signals.wavelets import Morlet

LEFT = 76.0
COLUMN, APART = 230.0, 36.0
HEADING = 64.0
WAVELET_HEIGHT, SIGNAL_HEIGHT, MAGNITUDE_HEIGHT = 130.0, 44.0, 190.0
NAME_LINE = 24.0
AXIS_ROOM = 36.0
#: Pixels of a picture of magnitudes for each pixel of the figure.
FINENESS = 2
KEY = "Magnitudes: from none (light) to the largest of each wavelet (dark)."


@dataclass(frozen=True, eq=False)
class WaveletView:
    """One wavelet, and the magnitudes of the test signal; drawn as shares of the largest."""

    title: str  # such as "p = 5"
    t: NDArray[np.float64]  # (m,), in units of the scale, increasing
    psi: NDArray[np.complex128]  # (m,), the wavelet at `t`
    hertz: NDArray[np.float64]  # (k,), of the rows of `magnitudes`, positive, increasing, k >= 2
    magnitudes: NDArray[np.float64]  # (k, n)


def two_tones(
    low: float = 10.0, high: float = 16.0, rate: float = 200.0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times and signal of two tones that overlap: `low` Hz from 1 to 3 s, `high` from 2 to 4 s."""
    times = np.arange(0.0, 5.0, 1 / rate)
    first, second = (np.sin(2 * np.pi * tone * times) for tone in (low, high))
    return times, first * ((times >= 1) & (times < 3)) + second * ((times >= 2) & (times < 4))


def view_wavelets(
    ps: Sequence[float], signal: NDArray[np.float64], rate: float, low: float, high: float
) -> tuple[WaveletView, ...]:
    """Transform a signal at `rate` with Morlet wavelets of several p, from `low` to `high` Hz.

    Magnitudes are divided by the square root of the scale, so that sines of one amplitude look
    equally strong whatever their frequency.
    """
    t = np.linspace(-4.0, 4.0, 801)
    hertz = np.geomspace(low, high, 121)
    views = []
    for p in ps:
        wavelet = Morlet(p)
        scales = frequencies(hertz, rate, wavelet)  # its own inverse
        magnitudes = np.abs(cwt(signal, scales, wavelet)) / np.sqrt(scales)[:, np.newaxis]
        views.append(WaveletView(f"p = {p:g}", t, wavelet.time(t), hertz, magnitudes))
    return tuple(views)


@dataclass(frozen=True, eq=False)
class WaveletFigure(Figure):
    """Wavelets side by side, each above the magnitudes of the same test signal.

    The views have the same ranges of `t` and `hertz`; `times` (s) are increasing. `tones` are the
    frequencies (Hz) in the signal, marked beside the magnitudes.
    """

    title: str
    views: tuple[WaveletView, ...]
    times: NDArray[np.float64]
    signal: NDArray[np.float64]
    tones: tuple[float, ...] = ()

    @property
    def size(self) -> QSizeF:
        tone_room = text.widest(self._tone_names, text.font(10)) + 8 if self.tones else 0.0
        columns = len(self.views)
        width = LEFT + columns * COLUMN + (columns - 1) * APART + tone_room + MARGIN
        width = max(width, 2 * MARGIN + text.width(KEY, text.font(10)))
        return QSizeF(width, self.box(0).bottom() + AXIS_ROOM + MARGIN)

    def box(self, column: int) -> QRectF:
        """The magnitudes of a wavelet, in pixels."""
        top = MARGIN + HEADING + NAME_LINE + WAVELET_HEIGHT + AXIS_ROOM + 24 + SIGNAL_HEIGHT + 8
        return QRectF(LEFT + column * (COLUMN + APART), top, COLUMN, MAGNITUDE_HEIGHT)

    def paint(self, painter: QPainter) -> None:
        self.paint_title(painter)
        real, imaginary, envelope = self._pens
        names = (("real part", real), ("imaginary part", imaginary), ("envelope", envelope))
        paint_names(painter, MARGIN, MARGIN + 28, names, self.theme)
        small, muted = text.font(10), self.theme.muted
        text.draw_text(painter, MARGIN, MARGIN + 47, KEY, face=small, ink=muted)
        for column in range(len(self.views)):
            self._paint_wavelet(painter, column)
            self._paint_signal(painter, column)
            self._paint_magnitudes(painter, column)

    @property
    def _pens(self) -> tuple[QPen, QPen, QPen]:
        """The pens of real part, imaginary part and envelope."""
        real, imaginary = (curve_pen(QColor(colour), 1.6) for colour in CURVE_COLOURS[:2])
        return real, imaginary, curve_pen(QColor(self.theme.muted), 1.0)

    @property
    def _tone_names(self) -> tuple[str, ...]:
        return tuple(f"{tone:g} Hz" for tone in self.tones)

    def _paint_wavelet(self, painter: QPainter, column: int) -> None:
        view, box = self.views[column], self.box(column)
        top = MARGIN + HEADING + NAME_LINE
        bottom = top + WAVELET_HEIGHT
        face = text.font(bold=True)
        name = text.elided(view.title, face, COLUMN)
        x, y, ink = box.center().x(), top - NAME_LINE / 2 - 2, self.theme.text
        text.draw_text(painter, x, y, name, face=face, ink=ink, align=0.5)
        across = Axis(float(view.t[0]), float(view.t[-1]), box.left(), box.right())
        largest = 1.08 * max(float(np.abs(view.psi).max()) for view in self.views) or 1.0
        up = Axis(-largest, largest, bottom, top)
        zero = QLineF(box.left(), up.at(0.0), box.right(), up.at(0.0))
        draw_grid(painter, [zero], self.theme)
        real, imaginary, envelope = self._pens
        size = np.abs(view.psi)
        paint_curve(painter, across, up, view.t, size, pen=envelope)
        paint_curve(painter, across, up, view.t, -size, pen=envelope)
        paint_curve(painter, across, up, view.t, view.psi.imag, pen=imaginary)
        paint_curve(painter, across, up, view.t, view.psi.real, pen=real)
        draw_bottom(painter, across, bottom, "time / scale", self.theme)
        draw_left(painter, up, box.left(), "wavelet", self.theme, numbers=column == 0)

    def _paint_signal(self, painter: QPainter, column: int) -> None:
        box = self.box(column)
        bottom = box.top() - 8
        low, high = float(self.signal.min()), float(self.signal.max())
        rim = 0.05 * (high - low) or 1.0
        up = Axis(low - rim, high + rim, bottom, bottom - SIGNAL_HEIGHT)
        pen = curve_pen(QColor(self.theme.text), 0.8)
        paint_curve(painter, self._time_axis(column), up, self.times, self.signal, pen=pen)
        if column == 0:
            x, y, muted = LEFT - 8, bottom - SIGNAL_HEIGHT / 2, self.theme.muted
            text.draw_text(painter, x, y, "signal", face=text.font(10), ink=muted, align=1.0)

    def _paint_magnitudes(self, painter: QPainter, column: int) -> None:
        """Draw the magnitudes as a picture, the highest frequency at the top."""
        view, box = self.views[column], self.box(column)
        up = LogAxis(float(view.hertz[0]), float(view.hertz[-1]), box.bottom(), box.top())
        painter.drawImage(box, _picture(view, self.times, box))
        painter.setPen(QPen(QColor(self.theme.muted), 0.8, Qt.PenStyle.DotLine))
        levels = [up.at(tone) for tone in self.tones]
        painter.drawLines([QLineF(box.left(), y, box.right(), y) for y in levels])
        if column == len(self.views) - 1:
            for y, name in zip(levels, self._tone_names, strict=True):
                x, ink = box.right() + 8, self.theme.muted
                text.draw_text(painter, x, y, name, face=text.font(10), ink=ink)
        draw_bottom(painter, self._time_axis(column), box.bottom(), "time (s)", self.theme)
        draw_left(painter, up, box.left(), "frequency (Hz)", self.theme, numbers=column == 0)

    def _time_axis(self, column: int) -> Axis:
        box = self.box(column)
        return Axis(float(self.times[0]), float(self.times[-1]), box.left(), box.right())


def wavelet_figure(ps: Sequence[float] = (3.0, 5.0, 10.0, 20.0)) -> WaveletFigure:
    """Draw Morlet wavelets of several p, and their magnitudes for two tones that overlap in time.

    A tone of 10 Hz from 1 s to 3 s and one of 16 Hz from 2 s to 4 s: a small p tells best when
    they begin and end, a large p how high they are.
    """
    rate, tones = 200.0, (10.0, 16.0)
    times, signal = two_tones(*tones, rate)
    views = view_wavelets(ps, signal, rate, 4.0, 40.0)
    title = "Morlet wavelets: the larger p, the finer in frequency and the coarser in time"
    return WaveletFigure(title, views, times, signal, tones)


def _picture(view: WaveletView, times: NDArray[np.float64], box: QRectF) -> QImage:
    """Magnitudes at the pixels of a box.

    Interpolated here and not by the painter, as viewers of PDF and SVG do not agree on how.
    """
    wide, high = round(box.width() * FINENESS), round(box.height() * FINENESS)
    logs = np.log(view.hertz)
    rows = np.linspace(logs[-1], logs[0], high)
    columns = np.linspace(times[0], times[-1], wide)
    across = np.stack([np.interp(columns, times, row) for row in view.magnitudes])
    grid = np.stack([np.interp(rows, logs, column) for column in across.T], axis=1)
    colours = np.ascontiguousarray(colormap_colours(grid / (grid.max() or 1.0)))
    # A copy, because QImage does not keep the array's memory alive.
    return QImage(colours.data, wide, high, 3 * wide, QImage.Format.Format_RGB888).copy()
