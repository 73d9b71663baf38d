"""The time axis of what is seen live: the last seconds up to now, alike in all live views."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF
from PySide6.QtGui import QColor, QFontMetrics, QPainter

from forcelab.gui.capture.live_scale import scale_width
from forcelab.gui.figures.axes import Axis
from forcelab.gui.theme import colours

__all__ = ["RULER", "SECONDS", "column_edges", "gutter", "live_axis", "paint_ruler"]

#: Seconds that are shown, and the ruler's height in pixels.
SECONDS, RULER = 10.0, 20


def gutter(metrics: QFontMetrics) -> int:
    """Pixels at the left for names and numbers."""
    return 12 + metrics.horizontalAdvance("opening  −0000.0 Nmm") + scale_width()


def live_axis(now: float, plot: QRectF) -> Axis:
    """From seconds of the host's monotonic clock to pixels."""
    return Axis(now - SECONDS, now, plot.left(), plot.right())


def column_edges(now: float, width: int) -> NDArray[np.float64]:
    """Edges of columns of the screen in seconds.

    They stand at multiples of a column's width, so that a curve moves and does not shimmer.
    """
    step = SECONDS / width
    newest = math.floor(now / step)
    return (newest - width + np.arange(width + 1, dtype=np.float64)) * step


def paint_ruler(painter: QPainter, plot: QRectF, bottom: float) -> None:
    """Seconds before now."""
    painter.setPen(QColor(colours().muted))
    metrics = painter.fontMetrics()
    y = bottom - (RULER - metrics.capHeight()) / 2
    for ago in range(0, int(SECONDS) + 1, 2):
        x = plot.right() - ago / SECONDS * plot.width()
        text = "0 s" if not ago else f"\N{MINUS SIGN}{ago}"
        width = metrics.horizontalAdvance(text)
        left = min(x - width / 2, plot.right() - width - 4)
        painter.drawText(QPointF(left, y), text)
