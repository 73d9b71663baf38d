"""Icons drawn from lines and shapes: in the theme's ink, and crisp at every size and scale.

Each icon is written on a square of 16 x 16 in the manner of SVG paths: ``M x y`` goes somewhere,
``L x y`` draws a line there, ``C`` with three points a Bézier curve, ``O x y r`` a circle, and
``Z`` closes the shape.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

from PySide6.QtCore import QPointF, QRect, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QIcon, QIconEngine, QPainter, QPainterPath, QPixmap

from forcelab.gui.figures.axes import curve_pen
from forcelab.gui.theme import colours

#: Side of the square that icons are written on, and the thickness of their lines on it.
SIDE, THICKNESS = 16.0, 1.5


@dataclass(frozen=True, slots=True)
class _Drawing:
    """The filled and the stroked paths of an icon."""

    fill: str = ""
    line: str = ""


_DRAWINGS = {
    "play": _Drawing(fill="M 4 2.5 L 13.5 8 L 4 13.5 Z"),
    "pause": _Drawing(
        fill="M 3.5 2.5 L 6.5 2.5 L 6.5 13.5 L 3.5 13.5 Z "
        "M 9.5 2.5 L 12.5 2.5 L 12.5 13.5 L 9.5 13.5 Z"
    ),
    "step-back": _Drawing(fill="M 9 3 L 2 8 L 9 13 Z", line="M 12 3 L 12 13"),
    "step-forward": _Drawing(fill="M 7 3 L 14 8 L 7 13 Z", line="M 4 3 L 4 13"),
    "start": _Drawing(fill="M 13.5 3 L 5.5 8 L 13.5 13 Z", line="M 3 3 L 3 13"),
    "end": _Drawing(fill="M 2.5 3 L 10.5 8 L 2.5 13 Z", line="M 13 3 L 13 13"),
    "loop": _Drawing(
        line="M 2.5 8.5 L 2.5 7 C 2.5 5.4 3.6 4.5 5 4.5 L 12.5 4.5 M 10.2 2 L 12.7 4.5 L 10.2 7 "
        "M 13.5 7.5 L 13.5 9 C 13.5 10.6 12.4 11.5 11 11.5 L 3.5 11.5 "
        "M 5.8 9 L 3.3 11.5 L 5.8 14"
    ),
    "magnet": _Drawing(
        line="M 2.5 2.5 L 2.5 8 C 2.5 11.5 5 13.5 8 13.5 C 11 13.5 13.5 11.5 13.5 8 L 13.5 2.5 "
        "L 10 2.5 L 10 8 C 10 9.3 9.1 10 8 10 C 6.9 10 6 9.3 6 8 L 6 2.5 Z "
        "M 2.5 5.5 L 6 5.5 M 10 5.5 L 13.5 5.5"
    ),
    "undo": _Drawing(
        line="M 5.5 2.5 L 2.5 5.5 L 5.5 8.5 "
        "M 2.8 5.5 L 9.5 5.5 C 12 5.5 13.5 7.2 13.5 9.3 C 13.5 11.5 12 13 9.5 13 L 6 13"
    ),
    "redo": _Drawing(
        line="M 10.5 2.5 L 13.5 5.5 L 10.5 8.5 "
        "M 13.2 5.5 L 6.5 5.5 C 4 5.5 2.5 7.2 2.5 9.3 C 2.5 11.5 4 13 6.5 13 L 10 13"
    ),
    "back": _Drawing(line="M 13.5 8 L 2.8 8 M 7 3.8 L 2.8 8 L 7 12.2"),
    "forward": _Drawing(line="M 2.5 8 L 13.2 8 M 9 3.8 L 13.2 8 L 9 12.2"),
    "folder": _Drawing(line="M 1.8 12.8 L 1.8 3.2 L 6.2 3.2 L 7.8 5.2 L 14.2 5.2 L 14.2 12.8 Z"),
    "eye-off": _Drawing(
        line="M 1.2 8 C 3 4.8 5.3 3.4 8 3.4 C 10.7 3.4 13 4.8 14.8 8 "
        "C 13 11.2 10.7 12.6 8 12.6 C 5.3 12.6 3 11.2 1.2 8 Z M 2.5 13.5 L 13.5 2.5"
    ),
    "plus": _Drawing(line="M 8 2.5 L 8 13.5 M 2.5 8 L 13.5 8"),
    "cross": _Drawing(line="M 3.5 3.5 L 12.5 12.5 M 12.5 3.5 L 3.5 12.5"),
    "import": _Drawing(
        line="M 8 1.8 L 8 9.8 M 4.8 6.8 L 8 10 L 11.2 6.8 M 2 10.5 L 2 13.8 L 14 13.8 L 14 10.5"
    ),
    "split": _Drawing(
        line="M 8 2.5 L 8 13.5 M 5 8 L 1.5 8 M 3.7 5.6 L 1.3 8 L 3.7 10.4 "
        "M 11 8 L 14.5 8 M 12.3 5.6 L 14.7 8 L 12.3 10.4"
    ),
    "merge": _Drawing(
        line="M 8 2.5 L 8 13.5 M 1.3 8 L 5.2 8 M 3.1 5.6 L 5.5 8 L 3.1 10.4 "
        "M 14.7 8 L 10.8 8 M 12.9 5.6 L 10.5 8 L 12.9 10.4"
    ),
    "network": _Drawing(
        line="O 3.2 3.6 1.8 O 3.2 12.4 1.8 O 12.6 8 1.8 M 4.9 4.4 L 10.9 7.2 M 4.9 11.6 L 10.9 8.8"
    ),
    "check-next": _Drawing(line="M 1.5 8.5 L 4.3 11.5 L 9 4.5 M 11 4.8 L 14.2 8 L 11 11.2"),
    "check": _Drawing(line="M 2.5 8.5 L 6.2 12.2 L 13.5 4"),
    "search": _Drawing(line="O 6.8 6.8 4.3 M 10 10 L 14 14"),
    "warning": _Drawing(fill="O 8 11.6 0.9", line="M 8 1.8 L 15 14.2 L 1 14.2 Z M 8 6.2 L 8 9.4"),
    "stored": _Drawing(line="O 8 8 6.2 M 5 8.3 L 7.2 10.5 L 11 5.8"),
    "trash": _Drawing(
        line="M 2.5 4.5 L 13.5 4.5 M 6 4.2 L 6 2.2 L 10 2.2 L 10 4.2 "
        "M 4 4.8 L 4.6 13.8 L 11.4 13.8 L 12 4.8 M 6.8 7.2 L 6.8 11.4 M 9.2 7.2 L 9.2 11.4"
    ),
    "pencil": _Drawing(
        line="M 2.5 13.5 L 3.3 10.3 L 10.8 2.8 L 13.2 5.2 L 5.7 12.7 Z M 9 4.6 L 11.4 7"
    ),
    "key": _Drawing(
        line="M 2.5 2.5 L 13.5 2.5 L 13.5 13.5 L 2.5 13.5 Z "
        "M 5.5 10.5 L 8 5.2 L 10.5 10.5 M 6.4 8.8 L 9.6 8.8"
    ),
    "range": _Drawing(
        line="M 5 2.5 L 2.5 2.5 L 2.5 13.5 L 5 13.5 "
        "M 11 2.5 L 13.5 2.5 L 13.5 13.5 L 11 13.5 M 5 8 L 11 8"
    ),
    "book": _Drawing(
        line="M 8 13.6 L 8 3.8 C 6.4 2.7 4.2 2.4 1.8 2.8 L 1.8 12.6 C 4.2 12.2 6.4 12.5 8 13.6 "
        "C 9.6 12.5 11.8 12.2 14.2 12.6 L 14.2 2.8 C 11.8 2.4 9.6 2.7 8 3.8"
    ),
    "person": _Drawing(line="O 8 5 2.8 M 2.5 14 C 2.8 11 5 9.8 8 9.8 C 11 9.8 13.2 11 13.5 14"),
    "video": _Drawing(
        line="M 1.5 4 L 10.5 4 L 10.5 12 L 1.5 12 Z M 10.8 7 L 14.5 4.8 L 14.5 11.2 L 10.8 9"
    ),
    "note": _Drawing(
        line="M 2.5 2.8 L 13.5 2.8 L 13.5 10.6 L 7.6 10.6 L 4.6 13.4 L 4.6 10.6 L 2.5 10.6 Z "
        "M 5.2 6.7 L 10.8 6.7"
    ),
    "float": _Drawing(
        line="M 5.5 5 L 5.5 2.5 L 13.5 2.5 L 13.5 10.5 L 11 10.5 "
        "M 2.5 5.5 L 10.5 5.5 L 10.5 13.5 L 2.5 13.5 Z"
    ),
    "more": _Drawing(fill="O 3 8 1.3 O 8 8 1.3 O 13 8 1.3"),
    "sort": _Drawing(
        line="M 4.5 2.5 L 4.5 13 M 2 10.5 L 4.5 13 L 7 10.5 "
        "M 9 3.5 L 14.5 3.5 M 9 8 L 13 8 M 9 12.5 L 11.5 12.5"
    ),
}

#: The icons that there are.
NAMES = tuple(_DRAWINGS)


def icon(name: str) -> QIcon:
    """An icon (one of :data:`NAMES`) in the colours of the theme in use when it is drawn.

    Disabled it is pale; checked it has the colour for text on the accent.
    """
    return QIcon(_Engine(name))


def paint_icon(painter: QPainter, box: QRectF, name: str, ink: QColor) -> None:
    """Draw an icon into the middle of a box."""
    side = min(box.width(), box.height())
    fill, line = _paths(name)
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.translate(box.center().x() - side / 2, box.center().y() - side / 2)
    painter.scale(side / SIDE, side / SIDE)
    painter.fillPath(fill, ink)
    painter.strokePath(line, curve_pen(ink, THICKNESS))
    painter.restore()


class _Engine(QIconEngine):
    """Draws the icon whenever it is asked for, so that it follows theme and scale."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self._name = name
        _paths(name)

    def paint(self, painter: QPainter, rect: QRect, mode: QIcon.Mode, state: QIcon.State) -> None:
        theme = colours()
        ink = QColor(theme.accent_text if state == QIcon.State.On else theme.text)
        if mode == QIcon.Mode.Disabled:
            ink = ink if state == QIcon.State.On else QColor(theme.muted)
            ink.setAlphaF(0.5)
        paint_icon(painter, QRectF(rect), self._name, ink)

    def pixmap(self, size: QSize, mode: QIcon.Mode, state: QIcon.State) -> QPixmap:
        """Draw it on nothing."""
        image = QPixmap(size)
        if size.isEmpty():  # of a button that a layout has squeezed away
            return image
        image.fill(Qt.GlobalColor.transparent)
        with QPainter(image) as painter:
            self.paint(painter, QRect(0, 0, size.width(), size.height()), mode, state)
        return image

    def clone(self) -> QIconEngine:
        """The engine of a copy of the icon."""
        return _Engine(self._name)


@cache
def _paths(name: str) -> tuple[QPainterPath, QPainterPath]:
    """An icon's shapes and lines."""
    drawing = _DRAWINGS[name]
    return _path(drawing.fill), _path(drawing.line)


def _path(text: str) -> QPainterPath:
    path = QPainterPath()
    words = iter(text.split())
    for word in words:
        if word == "M":
            path.moveTo(_point(words))
        elif word == "L":
            path.lineTo(_point(words))
        elif word == "C":
            path.cubicTo(_point(words), _point(words), _point(words))
        elif word == "O":
            centre, radius = _point(words), float(next(words))
            path.addEllipse(centre, radius, radius)
        else:
            path.closeSubpath()
    return path


def _point(words: Iterator[str]) -> QPointF:
    """The next two numbers."""
    return QPointF(float(next(words)), float(next(words)))
