"""How actions look in lists: a box of their colour and texture, and the cap of their key."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QIcon, QPainter, QPen, QPixmap

from forcelab.gui.figures.tracks import LabelStyle, action_style, paint_texture
from forcelab.gui.theme import colours
from forcelab.vocabulary import Vocabulary


def style_of(vocabulary: Vocabulary, name: str) -> LabelStyle:
    """How an action of the vocabulary is drawn; one that is not in it is grey."""
    if name in vocabulary:
        return action_style(vocabulary[name])
    return LabelStyle("", QColor(colours().frame))


def paint_swatch(painter: QPainter, box: QRectF, style: LabelStyle) -> None:
    """Fill a box with an action's colour and texture, framed so that black shows on dark."""
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing, style.texture > 0)
    painter.setClipRect(box)
    paint_texture(painter, box, style)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.setPen(QPen(QColor(colours().frame), 0))
    painter.drawRect(box.adjusted(0, 0, -1, -1))
    painter.restore()


def swatch_icon(colour: str, texture: int = 0) -> QIcon:
    """A small swatch for menus; twice as fine as the screen."""
    picture = QPixmap(32, 32)
    picture.setDevicePixelRatio(2.0)
    picture.fill(Qt.GlobalColor.transparent)
    with QPainter(picture) as painter:
        paint_swatch(painter, QRectF(1, 1, 14, 14), LabelStyle("", QColor(colour), texture))
    return QIcon(picture)


def paint_key(painter: QPainter, box: QRectF, key: str, font: QFont) -> None:
    """Draw the cap of a key, as on a keyboard; a faint empty one where there is no key."""
    theme = colours()
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    if not key:
        painter.setOpacity(0.4)
    cap = box.adjusted(0.5, 0.5, -0.5, -0.5)
    painter.setPen(QPen(QColor(theme.frame), 1))
    painter.setBrush(QColor(theme.frame))
    painter.drawRoundedRect(cap, 4, 4)
    painter.setBrush(QColor(theme.background))
    top = cap.adjusted(0, 0, 0, -2)
    painter.drawRoundedRect(top, 4, 4)
    painter.setFont(font)
    painter.setPen(QColor(theme.text))
    # Capitals sit in the middle by their height, which the line's box is not symmetric about.
    metrics = painter.fontMetrics()
    text = key.upper()
    left = top.center().x() - metrics.horizontalAdvance(text) / 2
    painter.drawText(QPointF(left, top.center().y() + metrics.capHeight() / 2), text)
    painter.restore()
