"""Gaps in the recording, hatched behind the curves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QBrush, QColor, QPainter

from forcelab.gui.panel import TimePanel
from forcelab.gui.theme import Colours

__all__ = ["paint_gaps"]

Real = NDArray[np.float64]


def paint_gaps(
    painter: QPainter, panel: TimePanel, gaps: Real, plot: QRectF, theme: Colours
) -> None:
    """Hatch the visible gaps, shape (2, g) in seconds; those closer than a pixel become one."""
    document, slope = panel.document, panel.seconds_per_pixel
    first = int(np.searchsorted(gaps[1], document.start))
    last = int(np.searchsorted(gaps[0], document.end))
    if first >= last:
        return
    left, right = plot.left() + (gaps[:, first:last] - document.start) / slope
    left, right = np.maximum(left, plot.left() - 1), np.minimum(right, plot.right() + 1)
    middle = (left + right) / 2
    half = np.maximum((right - left) / 2, 0.5)
    left, right = middle - half, middle + half
    opens = np.flatnonzero(np.append(True, left[1:] > np.maximum.accumulate(right)[:-1] + 1.0))
    ends = np.maximum.accumulate(right)[np.append(opens[1:], len(left)) - 1]
    hatch = QBrush(QColor(theme.frame), Qt.BrushStyle.BDiagPattern)
    wash = QColor(theme.panel)
    for a, b in zip(left[opens].tolist(), ends.tolist(), strict=True):
        box = QRectF(a, plot.top(), b - a, plot.height())
        painter.fillRect(box, wash)
        painter.fillRect(box, hatch)
