"""How it is shown that a model proposed a segment: by a diamond and in words."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen, QPolygonF

from forcelab.project import Origin

__all__ = ["MARK", "origin_words", "paint_proposed"]


#: Room that the mark takes at the end of a cell.
MARK = 14
#: Corners of the mark around its middle.
_DIAMOND = ((0.0, -3.5), (3.5, 0.0), (0.0, 3.5), (-3.5, 0.0))


def origin_words(origin: Origin | None) -> str:
    """Who proposed a segment, in words; nothing where no model did."""
    if origin is None:
        return ""
    if origin.changed:
        return f"proposed by {origin.proposer}, changed since"
    return f"proposed by {origin.proposer}"


def paint_proposed(painter: QPainter, box: QRectF, ink: str, changed: bool) -> None:
    """Mark at the end of a box that a model proposed a segment; hollow if it was changed since."""
    middle = QPointF(box.right() - MARK / 2, box.center().y())
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(QPen(QColor(ink), 1.2))
    painter.setBrush(Qt.GlobalColor.transparent if changed else QColor(ink))
    painter.drawPolygon(QPolygonF([middle + QPointF(*corner) for corner in _DIAMOND]))
    painter.restore()
