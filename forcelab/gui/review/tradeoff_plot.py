"""A plot of error against run time, in which a click on a point uses its settings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from PySide6.QtCore import QLineF, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QFont,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPolygonF,
    QResizeEvent,
)
from PySide6.QtWidgets import QSizePolicy, QWidget

from forcelab.gui.figures import text
from forcelab.gui.figures.axes import (
    Axis,
    LogAxis,
    covered_area,
    curve_pen,
    draw_bottom,
    draw_left,
    place_along,
    place_labels,
)
from forcelab.gui.figures.colormap import translucent
from forcelab.gui.figures.tradeoff import mark_style, paint_mark
from forcelab.gui.theme import colours, themes
from forcelab.gui.widgets import ARROW_STEPS, ENTER_KEYS, is_plain

#: Half the width of a mark, and the radius of the ring around what is in use, in pixels.
MARK, RING = 5.0, 9.5
#: Room for the numbers and names of the axes, and at the other sides, in pixels.
LEFT, TOP, RIGHT, BOTTOM = 62.0, 14.0, 18.0, 44.0
#: What is left free beyond the outermost points, as a share of the axis.
FREE = 0.06
#: How near the pointer must be to a point, in pixels.
REACH = 12.0
#: Pixels of names and of axes.
NAME, AXIS = 11.0, 10.5


class Point(NamedTuple):
    """A measured row as it is drawn: what is varied, its text, and whether it is on the front."""

    row: int
    kind: str
    text: str
    seconds: float
    error: float
    front: bool


@dataclass(frozen=True)
class PlotLayout:
    """Where everything lies, in pixels; points by their rows, and the names that have room."""

    box: QRectF
    across: LogAxis
    up: Axis
    spots: dict[int, QPointF]
    names: dict[int, QRectF]

    def row_at(self, position: QPointF) -> int | None:
        """The row whose mark is in reach of the pointer, or whose name is under it."""
        distances = {row: QLineF(spot, position).length() for row, spot in self.spots.items()}
        nearest = min(distances, key=distances.__getitem__, default=None)
        if nearest is not None and distances[nearest] <= REACH:
            return nearest
        return next((row for row, name in self.names.items() if name.contains(position)), None)


def lay_out(points: Sequence[Point], room: QRectF, current: int | None) -> PlotLayout:
    """Lay out at least one point; the row in use, the front and presets get their names first."""
    box = room.adjusted(LEFT, TOP, -RIGHT, -BOTTOM)
    across = _time_axis([point.seconds for point in points], box)
    highest = max(point.error for point in points)
    up = Axis(0.0, highest * (1 + FREE) or 1.0, box.bottom(), box.top())
    spots = {p.row: QPointF(across.at(p.seconds), up.at(p.error)) for p in points}
    radii = {row: RING if row == current else MARK for row in spots}
    taken = [
        QRectF(spot.x() - radii[row], spot.y() - radii[row], 2 * radii[row], 2 * radii[row])
        for row, spot in spots.items()
    ]
    taken += place_along([spots[point.row] for point in _front(points)])
    names: dict[int, QRectF] = {}
    for p in sorted(points, key=lambda p: (p.row != current, not p.front, p.kind != "preset")):
        for place in place_labels(spots[p.row], p.text, _font(p), box, radii[p.row]):
            if not covered_area(place, taken):
                names[p.row] = place
                taken.append(place)
                break
    return PlotLayout(box, across, up, spots, names)


def _front(points: Sequence[Point]) -> list[Point]:
    """The points that no other beats, from left to right."""
    return sorted((point for point in points if point.front), key=lambda point: point.seconds)


def _font(point: Point) -> QFont:
    """The font of a name; presets are bold."""
    return text.font(NAME, bold=point.kind == "preset")


def _time_axis(seconds: Sequence[float], box: QRectF) -> LogAxis:
    """A logarithmic axis with all times inside, and at least a factor of four."""
    low, high = math.log10(min(seconds)), math.log10(max(seconds))
    free = max(FREE * (high - low), 0.3 - (high - low) / 2, 0.05)
    return LogAxis(10 ** (low - free), 10 ** (high + free), box.left(), box.right())


class TradeoffPlot(QWidget):
    """Points, a line through the best of them, and a ring around the row in use.

    Left and Right go from point to point by time, Up and Down by error; Enter adopts.
    """

    #: The row of the point that is highlighted by pointer or keys.
    highlight_changed = Signal(int)
    #: The row that was clicked, or entered.
    activated = Signal(int)

    def __init__(self) -> None:
        super().__init__()
        self.points: tuple[Point, ...] = ()
        self.current: int | None = None
        self.highlighted: int | None = None
        self._titles = ("", "")
        self._layout: PlotLayout | None = None
        self.setAccessibleName("Error against run time")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setMouseTracking(True)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        themes().changed.connect(self.update)

    def sizeHint(self) -> QSize:
        """Enough for most names."""
        return QSize(620, 460)

    def minimumSizeHint(self) -> QSize:
        """Less than that is a thumbnail."""
        return QSize(260, 200)

    def show_points(
        self, points: Sequence[Point], current: int | None, error: str, time: str
    ) -> None:
        """Draw other points; `current` is the row in use, the texts name the axes."""
        self.points, self.current = tuple(points), current
        self._titles = (time, error)
        self._layout = None
        if self.highlighted not in [point.row for point in points]:
            self.highlighted = None
        self.update()

    def highlight(self, row: int | None) -> None:
        """Mark the point of a row that is selected elsewhere."""
        if row != self.highlighted:
            self.highlighted = row
            self.update()

    def layout_of_points(self) -> PlotLayout | None:
        """Where everything lies; None where there is nothing."""
        if self._layout is None and self.points:
            self._layout = lay_out(self.points, QRectF(self.rect()), self.current)
        return self._layout

    # Painting

    def paintEvent(self, event: QPaintEvent) -> None:
        theme = colours()
        with QPainter(self) as painter:
            painter.fillRect(self.rect(), QColor(theme.background))
            layout = self.layout_of_points()
            if layout is None:
                return
            self._paint_axes(painter, layout)
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            painter.setPen(curve_pen(QColor(theme.frame), 2.0))
            painter.drawPolyline(QPolygonF([layout.spots[p.row] for p in _front(self.points)]))
            marked = (self.current, self.highlighted)
            for point in sorted(self.points, key=lambda point: point.row in marked):  # last on top
                self._paint_point(painter, point, layout.spots[point.row])
            for point in sorted(self.points, key=lambda point: point.row not in layout.names):
                if point.row in layout.names:
                    self._paint_name(painter, point, layout.names[point.row])
                elif point.row == self.highlighted:
                    self._paint_name_over(painter, point, layout.spots[point.row])
            if self.hasFocus():
                painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
                painter.setPen(QPen(QColor(theme.accent), 1.0))
                painter.setBrush(Qt.BrushStyle.NoBrush)
                painter.drawRect(self.rect().adjusted(0, 0, -1, -1))

    def _paint_axes(self, painter: QPainter, layout: PlotLayout) -> None:
        """Grid and axes."""
        theme, box = colours(), layout.box
        painter.setPen(QPen(QColor(theme.grid), 1.0))
        for value, _ in layout.across.marks(AXIS, upright=False):
            x = layout.across.at(value)
            painter.drawLine(QLineF(x, box.top(), x, box.bottom()))
        for value, _ in layout.up.marks(AXIS, upright=True):
            y = layout.up.at(value)
            painter.drawLine(QLineF(box.left(), y, box.right(), y))
        time, error = self._titles
        draw_bottom(painter, layout.across, box.bottom(), time, theme, size=AXIS)
        draw_left(painter, layout.up, box.left(), error, theme, size=AXIS)

    def _paint_point(self, painter: QPainter, point: Point, spot: QPointF) -> None:
        """A mark: filled on the front, hollow elsewhere."""
        theme = colours()
        kinds = list(dict.fromkeys(point.kind for point in self.points))
        ink, shape = mark_style(kinds.index(point.kind), theme.curves)
        if point.row == self.highlighted:
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(translucent(ink, 0.3))
            painter.drawEllipse(spot, RING + 3, RING + 3)
        if point.row == self.current:
            painter.setPen(QPen(QColor(theme.accent), 2.0))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawEllipse(spot, RING, RING)
        painter.setPen(curve_pen(ink, 1.8))
        painter.setBrush(ink if point.front else QColor(theme.background))
        paint_mark(painter, spot, shape, MARK)

    def _paint_name(self, painter: QPainter, point: Point, place: QRectF) -> None:
        theme = colours()
        strong = point.front or point.row in (self.current, self.highlighted)
        ink = QColor(theme.text if strong else theme.muted)
        middle = place.center().y()
        text.draw_text(painter, place.left(), middle, point.text, face=_font(point), ink=ink)

    def _paint_name_over(self, painter: QPainter, point: Point, spot: QPointF) -> None:
        """The name of the highlighted point, which had no room, over what is drawn there."""
        face = _font(point)
        wide = text.width(point.text, face)
        x = spot.x() + RING + 5
        if x + wide > self.width() - 4:
            x = max(spot.x() - RING - 5 - wide, 4.0)
        high = face.pixelSize() + 4.0
        ground = translucent(colours().background, 0.9)
        painter.fillRect(QRectF(x - 3, spot.y() - high / 2, wide + 6, high), ground)
        self._paint_name(painter, point, QRectF(x, spot.y() - high / 2, wide, high))

    # Pointer and keys

    def resizeEvent(self, event: QResizeEvent) -> None:
        self._layout = None
        super().resizeEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        row = self._row_under(event)
        shape = Qt.CursorShape.ArrowCursor if row is None else Qt.CursorShape.PointingHandCursor
        self.setCursor(shape)
        if row is not None:
            self._highlight(row)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        row = self._row_under(event)
        if event.button() == Qt.MouseButton.LeftButton and row is not None:
            self._highlight(row)
            self.activated.emit(row)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        step = ARROW_STEPS.get(Qt.Key(event.key()))
        if step is not None and self.points:
            down, right = step
            self._step(right - down, "seconds" if right else "error")
        elif event.key() in ENTER_KEYS and self.highlighted is not None:
            self.activated.emit(self.highlighted)
        else:
            super().keyPressEvent(event)

    def keeps(self, event: QKeyEvent) -> bool:
        """The arrow keys move here, whatever they do elsewhere in the window; and Enter adopts."""
        return event.key() in (*ARROW_STEPS, *ENTER_KEYS) and is_plain(event)

    def _step(self, direction: int, order: str) -> None:
        """To the next point by time or error; the first time to the row in use."""
        rows = [p.row for p in sorted(self.points, key=lambda p: (getattr(p, order), p.row))]
        if self.highlighted in rows:
            at = min(max(rows.index(self.highlighted) + direction, 0), len(rows) - 1)
        else:
            at = rows.index(self.current) if self.current in rows else 0
        self._highlight(rows[at])

    def _row_under(self, event: QMouseEvent) -> int | None:
        """The row of the point under the pointer."""
        layout = self.layout_of_points()
        return None if layout is None else layout.row_at(event.position())

    def _highlight(self, row: int) -> None:
        """Highlight a row and emit it."""
        if row != self.highlighted:
            self.highlight(row)
            self.highlight_changed.emit(row)
