"""The plot: error against run time, where a click on a point uses its settings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

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
from forcelab.gui.figures.tradeoff import SHAPES
from forcelab.gui.theme import colours, themes
from forcelab.gui.tradeoff.measuring import Point
from forcelab.gui.widgets import ARROW_STEPS, ENTER_KEYS, is_plain

#: Half the width of a mark, and the radius of the ring around what is in use, in pixels.
MARK, RING = 5.0, 9.5
#: Room for the numbers and names of the axes, and at the other sides, in pixels.
LEFT, TOP, RIGHT, BOTTOM = 62.0, 14.0, 18.0, 44.0
#: What is left free beyond the outermost points, as a share of the axis.
FREE = 0.06


@dataclass(frozen=True)
class PlotLayout:
    """Where everything lies, in pixels.

    Parameters
    ----------
    box : QRectF
        The plot within its axes.
    across : LogAxis
        From seconds.
    up : Axis
        From errors.
    spots : tuple of QPointF
        The middle of each point.
    names : dict of int to QRectF
        Where the name of a point stands, by its index; those without room are left out.
    """

    box: QRectF
    across: LogAxis
    up: Axis
    spots: tuple[QPointF, ...]
    names: dict[int, QRectF]

    def nearest(self, at: QPointF, reach: float) -> int | None:
        """The index of the point under the pointer: in its mark's reach, or by its name."""
        gaps = [math.hypot(spot.x() - at.x(), spot.y() - at.y()) for spot in self.spots]
        best = min(range(len(gaps)), key=gaps.__getitem__, default=None)
        if best is not None and gaps[best] <= reach:
            return best
        return next((i for i, name in self.names.items() if name.contains(at)), None)


def lay_out(
    points: Sequence[Point], room: QRectF, face: QFont, bold: QFont, current: int | None
) -> PlotLayout:
    """Lay points out; names are placed in the order in which they are missed most.

    Parameters
    ----------
    points : sequence of Point
        At least one.
    room : QRectF
        The whole widget.
    face, bold : QFont
        Of names; bold are those of presets.
    current : int or None
        The index of what is in use.
    """
    box = room.adjusted(LEFT, TOP, -RIGHT, -BOTTOM)
    across = _time_axis([point.seconds for point in points], box)
    highest = max(point.error for point in points)
    up = Axis(0.0, highest * (1 + FREE) or 1.0, box.bottom(), box.top())
    spots = tuple(QPointF(across.at(p.seconds), up.at(p.error)) for p in points)
    front = sorted((i for i, p in enumerate(points) if p.front), key=lambda i: points[i].seconds)
    taken = [_around(spot, RING if i == current else MARK) for i, spot in enumerate(spots)]
    taken += place_along([spots[i] for i in front])
    names: dict[int, QRectF] = {}
    for i in sorted(range(len(points)), key=lambda i: _rank(points[i], i == current)):
        own = bold if points[i].kind == "preset" else face
        mark = RING if i == current else MARK
        for place in place_labels(spots[i], points[i].text, own, box, mark):
            others = [other for j, other in enumerate(taken) if j != i]
            if not covered_area(place, others) and not covered_area(place, [taken[i]]):
                names[i] = place
                taken.append(place)
                break
    return PlotLayout(box, across, up, spots, names)


def _rank(point: Point, current: bool) -> tuple[bool, bool, bool]:
    """Whose name is placed first: what is in use, the front, the presets."""
    return not current, not point.front, point.kind != "preset"


def _around(spot: QPointF, radius: float) -> QRectF:
    """A box around a point."""
    return QRectF(spot.x() - radius, spot.y() - radius, 2 * radius, 2 * radius)


def _time_axis(seconds: Sequence[float], box: QRectF) -> LogAxis:
    """A logarithmic axis with all times inside, and at least a factor of four."""
    low, high = math.log10(min(seconds)), math.log10(max(seconds))
    free = max(FREE * (high - low), 0.3 - (high - low) / 2, 0.05)
    return LogAxis(10 ** (low - free), 10 ** (high + free), box.left(), box.right())


#: How near the pointer must be to a point, in pixels.
REACH = 12.0
#: Pixels of names and of axes.
NAME, AXIS = 11.0, 10.5


class TradeoffPlot(QWidget):
    """Points, the front that joins the best of them, and a ring around the one in use.

    Left and Right go from point to point by time, Up and Down by error; Enter adopts.

    Signals
    -------
    pointed(int)
        The row of the point that is looked at; -1 for none.
    chosen(int)
        The row whose settings are wanted.
    """

    pointed = Signal(int)
    chosen = Signal(int)

    def __init__(self) -> None:
        super().__init__()
        self.points: tuple[Point, ...] = ()
        self.current: int | None = None
        self.looked_at: int | None = None
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
        """Draw other points.

        Parameters
        ----------
        points : sequence of Point
        current : int or None
            The row of the settings in use.
        error, time : str
            What the axes are called.
        """
        self.points, self.current = tuple(points), current
        self._titles = (time, error)
        self._layout = None
        if self._index(self.looked_at) is None:
            self.looked_at = None
        self.update()

    def look_at(self, row: int | None) -> None:
        """Mark the point of a row, which somebody points at elsewhere."""
        if row != self.looked_at:
            self.looked_at = row
            self.update()

    # Painting

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw axes, front, points and names."""
        theme = colours()
        with QPainter(self) as painter:
            painter.fillRect(self.rect(), QColor(theme.background))
            layout = self._laid_out()
            if layout is None:
                return
            self._paint_axes(painter, layout)
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            self._paint_front(painter, layout)
            for i in self._from_back_to_front():
                self._paint_point(painter, layout, i)
            for i, place in layout.names.items():
                self._paint_name(painter, i, place)
            looked = self._index(self.looked_at)
            if looked is not None and looked not in layout.names:
                self._paint_name_over(painter, layout, looked)
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

    def _paint_front(self, painter: QPainter, layout: PlotLayout) -> None:
        """The line through the points that no other beats."""
        front = [(p.seconds, layout.spots[i]) for i, p in enumerate(self.points) if p.front]
        line = [spot for _, spot in sorted(front, key=lambda pair: pair[0])]
        painter.setPen(curve_pen(QColor(colours().frame), 2.0))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawPolyline(QPolygonF(line))

    def _paint_point(self, painter: QPainter, layout: PlotLayout, i: int) -> None:
        """A mark: filled on the front, hollow elsewhere."""
        theme, point, spot = colours(), self.points[i], layout.spots[i]
        ink, corners = self._mark_style(point.kind)
        if point.place == self.looked_at:
            halo = translucent(ink, 0.3)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(halo)
            painter.drawEllipse(spot, RING + 3, RING + 3)
        if point.place == self.current:
            painter.setPen(QPen(QColor(theme.accent), 2.0))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawEllipse(spot, RING, RING)
        painter.setPen(curve_pen(ink, 1.8))
        painter.setBrush(ink if point.front else QColor(theme.background))
        if corners:
            painter.drawPolygon([spot + QPointF(x, y) * MARK for x, y in corners])
        else:
            painter.drawEllipse(spot, MARK, MARK)

    def _paint_name(self, painter: QPainter, i: int, place: QRectF) -> None:
        """A name in its place."""
        theme, point = colours(), self.points[i]
        strong = point.front or point.place in (self.current, self.looked_at)
        ink = QColor(theme.text if strong else theme.muted)
        middle = place.center().y()
        text.draw_text(painter, place.left(), middle, point.text, face=self._face(point), ink=ink)

    def _paint_name_over(self, painter: QPainter, layout: PlotLayout, i: int) -> None:
        """The name of what is looked at and had no room, over whatever is there."""
        point, spot = self.points[i], layout.spots[i]
        face = self._face(point)
        wide = text.width(point.text, face)
        x = spot.x() + RING + 5
        if x + wide > self.width() - 4:
            x = max(spot.x() - RING - 5 - wide, 4.0)
        high = face.pixelSize() + 4.0
        ground = translucent(colours().background, 0.9)
        painter.fillRect(QRectF(x - 3, spot.y() - high / 2, wide + 6, high), ground)
        self._paint_name(painter, i, QRectF(x, spot.y() - high / 2, wide, high))

    def _mark_style(self, kind: str) -> tuple[QColor, tuple[tuple[float, float], ...]]:
        """Colour and shape of a kind, in the order in which kinds come."""
        kinds = list(dict.fromkeys(point.kind for point in self.points))
        curves, number = colours().curves, kinds.index(kind)
        turn, i = divmod(number, len(curves))
        return QColor(curves[i]), SHAPES[(i + turn) % len(SHAPES)]

    def _face(self, point: Point) -> QFont:
        """The font of a name."""
        return text.font(NAME, bold=point.kind == "preset")

    def _from_back_to_front(self) -> list[int]:
        """What is looked at or in use lies over the others."""
        first = (self.current, self.looked_at)
        return sorted(range(len(self.points)), key=lambda i: self.points[i].place in first)

    def _laid_out(self) -> PlotLayout | None:
        """Where everything lies; None where there is nothing."""
        if self._layout is None and self.points:
            faces = text.font(NAME), text.font(NAME, bold=True)
            room = QRectF(self.rect())
            self._layout = lay_out(self.points, room, *faces, self._index(self.current))
        return self._layout

    def _index(self, row: int | None) -> int | None:
        """Which point a row is; None where it is not drawn."""
        return next((i for i, point in enumerate(self.points) if point.place == row), None)

    # Pointing

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Lay it out anew."""
        self._layout = None
        super().resizeEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Tell of the point under the pointer."""
        at = self._under(event.position())
        self.setCursor(
            Qt.CursorShape.ArrowCursor if at is None else Qt.CursorShape.PointingHandCursor
        )
        if at is not None:
            self._point_at(at)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """A click on a point chooses it."""
        at = self._under(event.position())
        if event.button() == Qt.MouseButton.LeftButton and at is not None:
            self._point_at(at)
            self.chosen.emit(at)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Go from point to point; Enter chooses."""
        step = ARROW_STEPS.get(Qt.Key(event.key()))
        if step is not None and self.points:
            down, right = step
            self._go(right - down, "seconds" if right else "error")
        elif event.key() in ENTER_KEYS and self.looked_at is not None:
            self.chosen.emit(self.looked_at)
        else:
            super().keyPressEvent(event)

    def keeps(self, event: QKeyEvent) -> bool:
        """The arrow keys move here, whatever they do elsewhere in the window; and Enter chooses."""
        return event.key() in (*ARROW_STEPS, *ENTER_KEYS) and is_plain(event)

    def _go(self, direction: int, by: str) -> None:
        """To the next point by time or error; the first time to the one in use."""
        order = sorted(self.points, key=lambda p: (getattr(p, by), p.place))
        places = [point.place for point in order]
        if self.looked_at in places:
            at = min(max(places.index(self.looked_at) + direction, 0), len(places) - 1)
        else:
            at = places.index(self.current) if self.current in places else 0
        self._point_at(places[at])

    def _under(self, at: QPointF) -> int | None:
        """The row of the point under the pointer."""
        layout = self._laid_out()
        found = None if layout is None else layout.nearest(at, REACH)
        return None if found is None else self.points[found].place

    def _point_at(self, row: int) -> None:
        """Look at a row and tell of it."""
        if row != self.looked_at:
            self.look_at(row)
            self.pointed.emit(row)
