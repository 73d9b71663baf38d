"""Clusters over a signal: the same force, coloured by the clusters of different features."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QRectF, QSizeF
from PySide6.QtGui import QColor, QPainter

from forcelab.gui.figures import text
from forcelab.gui.figures.axes import (
    CURVE_COLOURS,
    Axis,
    curve_pen,
    draw_bottom,
    draw_grid,
    draw_left,
    paint_curve,
)
from forcelab.gui.figures.figure import MARGIN, Figure
from forcelab.gui.figures.tracks import LabelStyle, paint_track
from forcelab.labels import from_codes

LEFT = 72.0
PLOT_WIDTH, PLOT_HEIGHT = 560.0, 76.0
#: Height of the bar of clusters under each signal, and of the line that names the features.
BAR = 13.0
NAME_LINE = 22.0
ROW = NAME_LINE + PLOT_HEIGHT + 6 + BAR + 18
HEADING = 44.0
AXIS_ROOM = 36.0


@dataclass(frozen=True, eq=False)
class ClusterFigure(Figure):
    """One signal in N, drawn once for each clustering.

    `times` (s) are increasing and have as many samples as the signal and each row's codes. `rows`
    are the features' names and the cluster of every sample from 0; there are no more clusters than
    curve colours.
    """

    title: str
    times: NDArray[np.float64]
    signal: NDArray[np.float64]
    rows: tuple[tuple[str, NDArray[np.int64]], ...]

    @property
    def size(self) -> QSizeF:
        height = MARGIN + HEADING + len(self.rows) * ROW - 8 + AXIS_ROOM + MARGIN
        return QSizeF(LEFT + PLOT_WIDTH + MARGIN, height)

    @property
    def axis(self) -> Axis:
        return Axis(float(self.times[0]), float(self.times[-1]), LEFT, LEFT + PLOT_WIDTH)

    def box(self, row: int) -> QRectF:
        """The bar of clusters of a row, in pixels."""
        top = MARGIN + HEADING + row * ROW + NAME_LINE + PLOT_HEIGHT + 6
        return QRectF(LEFT, top, PLOT_WIDTH, BAR)

    def paint(self, painter: QPainter) -> None:
        self.paint_title(painter)
        for row in range(len(self.rows)):
            self._paint_row(painter, row)
        bottom = self.box(len(self.rows) - 1).bottom() + 8
        draw_bottom(painter, self.axis, bottom, "time (s)", self.theme)

    def _paint_row(self, painter: QPainter, row: int) -> None:
        name, codes = self.rows[row]
        bar = self.box(row)
        bottom = bar.top() - 6
        middle = bottom - PLOT_HEIGHT - NAME_LINE / 2 - 2
        face = text.font(bold=True)
        caption = text.elided_name(name, face, PLOT_WIDTH)
        text.draw_text(painter, LEFT, middle, caption, face=face, ink=self.theme.text)
        low, high = float(self.signal.min()), float(self.signal.max())
        # Room for the thick line, and something to divide by where the signal never changes.
        rim = 0.06 * (high - low) or 1.0
        up = Axis(low - rim, high + rim, bottom, bottom - PLOT_HEIGHT)
        levels = [up.at(value) for value, _ in up.marks(upright=True)]
        grid = (QLineF(LEFT, y, LEFT + PLOT_WIDTH, y) for y in levels)
        draw_grid(painter, grid, self.theme)
        draw_left(painter, up, LEFT, "force (N)", self.theme)
        edges = [0, *(np.flatnonzero(np.diff(codes)) + 1).tolist(), len(codes)]
        for first, last in pairwise(edges):
            # Up to the first sample of the next piece, so that the line has no gaps.
            piece = slice(first, last + 1)
            pen = curve_pen(QColor(CURVE_COLOURS[codes[first]]), 3.0)
            paint_curve(painter, self.axis, up, self.times[piece], self.signal[piece], pen=pen)
        numbers = [str(i) for i in range(1, len(CURVE_COLOURS) + 1)]
        styles = {n: LabelStyle(n, QColor(CURVE_COLOURS[int(n) - 1])) for n in numbers}
        segments = from_codes(codes, self.times, numbers)
        paint_track(painter, bar, self.axis, segments, styles=styles, theme=self.theme)


def cluster_figure() -> ClusterFigure:
    """Draw four clusters over a force that rises and falls, for the paper's four features.

    Only the complex Morlet's magnitude and phase together tell rising from falling.
    """
    # Here, because scikit-learn takes a second to load and only this figure needs it.
    from forcelab.recognition.clusters import compare_wavelets, trapezoid

    times, signal = trapezoid()
    rows = tuple((view.title, view.codes) for view in compare_wavelets(signal))
    return ClusterFigure("Four clusters over a force that rises and falls", times, signal, rows)
