"""Curves: polylines through samples, and the names that tell them apart."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QPointF, Qt
from PySide6.QtGui import QColor, QPainter, QPen, QPolygonF

from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis
from forcelab.gui.figures.canvas import Theme

__all__ = ["CURVES", "curve_pen", "paint_curve", "paint_names"]

#: Colours of curves and clusters: Okabe and Ito's that stand out on white as thin lines.
CURVES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")


def curve_pen(colour: QColor, thickness: float) -> QPen:
    """A pen for curves, round so that steep corners do not stick out."""
    pen = QPen(colour, thickness)
    pen.setCapStyle(Qt.PenCapStyle.RoundCap)
    pen.setJoinStyle(Qt.PenJoinStyle.RoundJoin)
    return pen


def paint_curve(
    painter: QPainter,
    across: Axis,
    up: Axis,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    *,
    pen: QPen,
) -> None:
    """Draw a polyline through the points ``(x, y)``, both of shape (n,)."""
    painter.setPen(pen)
    painter.setBrush(Qt.BrushStyle.NoBrush)
    points = [QPointF(across.at(a), up.at(b)) for a, b in zip(x.tolist(), y.tolist(), strict=True)]
    painter.drawPolyline(QPolygonF(points))


def paint_names(
    painter: QPainter, x: float, y: float, names: Sequence[tuple[str, QPen]], theme: Theme
) -> None:
    """Draw a short stretch of each curve with its name, from left to right."""
    face = text.font(10)
    for name, pen in names:
        painter.setPen(pen)
        painter.drawLine(QLineF(x, y, x + 20, y))
        text.put(painter, x + 27, y, name, face=face, ink=QColor(theme.text))
        x += 27 + text.width(name, face) + 20
