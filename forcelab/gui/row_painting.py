"""Parts of rows of two lines, as in the list of demonstrations and in the queue."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QPainter, QPen, QPolygonF

from forcelab.gui.theme import colours

__all__ = [
    "ABOVE",
    "GAP",
    "HOVERED",
    "SELECTED",
    "SIDE",
    "SMALL",
    "STRIPE",
    "paint_chevron",
    "put_line",
    "smaller",
]

#: Space at the sides, between things in a line and above each line, as shares of a text's height.
SIDE, GAP, ABOVE = 0.6, 0.4, 0.3
#: The smaller line's size of that of the larger one.
SMALL = 0.88
#: How much of the accent's colour lies on a selected row, and on one under the pointer.
SELECTED, HOVERED = 0.20, 0.07
#: Width of the stripe that marks the row of what is open or looked at, in pixels.
STRIPE = 3.0


def paint_chevron(painter: QPainter, centre: QPointF, height: float, expanded: bool) -> None:
    """An angle that points down where rows are unfolded, and to their title where they are not."""
    a, b = 0.22 * height, 0.11 * height
    points = [(-a, -b), (0.0, b), (a, -b)] if expanded else [(-b, -a), (b, 0.0), (-b, a)]
    pen = QPen(QColor(colours().muted), max(1.4, 0.09 * height))
    pen.setCapStyle(Qt.PenCapStyle.RoundCap)
    painter.setPen(pen)
    painter.drawPolyline(QPolygonF([centre + QPointF(x, y) for x, y in points]))


def put_line(
    painter: QPainter,
    box: QRectF,
    text: str,
    face: QFont,
    ink: str,
    align: Qt.AlignmentFlag = Qt.AlignmentFlag.AlignLeft,
    elide: Qt.TextElideMode = Qt.TextElideMode.ElideRight,
) -> float:
    """Write one line of text into a box, elided where it does not fit; gives its width."""
    sizes = QFontMetricsF(face)
    line = " ".join(text.split())
    whole = sizes.horizontalAdvance(line) <= box.width()
    if not line or (not whole and box.width() < sizes.horizontalAdvance("…")):
        return 0.0
    painter.setFont(face)
    painter.setPen(QColor(ink))
    fitting = line if whole else sizes.elidedText(line, elide, box.width())
    flags = align | Qt.AlignmentFlag.AlignVCenter | Qt.TextFlag.TextSingleLine
    painter.drawText(box, int(flags), fitting)
    return sizes.horizontalAdvance(fitting)


def smaller(font: QFont) -> QFont:
    """The font of the second line."""
    small = QFont(font)
    if font.pointSizeF() > 0:
        small.setPointSizeF(font.pointSizeF() * SMALL)
    else:
        small.setPixelSize(round(font.pixelSize() * SMALL))
    return small
