"""A plot of error against run time, in which a click on a point uses its settings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QLineF, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFont, QKeyEvent, QMouseEvent, QPainter
from PySide6.QtWidgets import QSizePolicy

from forcelab.gui.figures import text
from forcelab.gui.figures.axes import free_place, place_along
from forcelab.gui.figures.colormap import translucent
from forcelab.gui.figures.tradeoff import mark_path, mark_style
from forcelab.gui.kit import text_size
from forcelab.gui.kit.plot import Plot
from forcelab.gui.theme import colours
from forcelab.gui.widgets import ARROW_STEPS, ENTER_KEYS, is_plain

#: Half the width of a mark, and the radius of the ring around what is in use, in pixels.
MARK, RING = 5.0, 9.5
#: What is left free beyond the outermost points, as a share of the axis.
FREE = 0.06
#: How near the pointer must be to a point, in pixels.
REACH = 12.0
#: Pixels of names.
NAME = 11.0


class Point(NamedTuple):
    """A measured row as it is drawn: what is varied, its text, and whether it is on the front."""

    row: int
    kind: str
    text: str
    seconds: float
    error: float
    front: bool


class TradeoffPlot(Plot):
    """Points, a line through the best of them, and a ring around the row in use.

    Left and Right go from point to point by time, Up and Down by error; Enter adopts.
    """

    MARGINS = (62.0, 14.0, 18.0, 44.0)
    #: The row of the point that is highlighted by pointer or keys.
    highlight_changed = Signal(int)
    #: The row that was clicked, or entered.
    activated = Signal(int)

    def __init__(self) -> None:
        super().__init__(zooms=True, grid=True)
        self.bottom.setLogMode(True)
        self.points: tuple[Point, ...] = ()
        self.current: int | None = None
        self.highlighted: int | None = None
        self.setAccessibleName("Error against run time")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

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
        if [point[3:5] for point in points] != [point[3:5] for point in self.points]:
            self.zoomed = False
        self.points, self.current = tuple(points), current
        self.bottom.setLabel(time)
        self.left.setLabel(error)
        if self.highlighted not in [point.row for point in points]:
            self.highlighted = None
        if points:
            low = math.log10(min(point.seconds for point in points))
            high = math.log10(max(point.seconds for point in points))
            # At least a factor of four.
            free = max(FREE * (high - low), 0.3 - (high - low) / 2, 0.05)
            top = max(point.error for point in points) * (1 + FREE) or 1.0
            self.show_all_of((10 ** (low - free), 10 ** (high + free)), (0.0, top))
        self.redraw()

    def highlight(self, row: int | None) -> None:
        """Mark the point of a row that is selected elsewhere."""
        if row != self.highlighted:
            self.highlighted = row
            self.redraw()

    @property
    def spots(self) -> dict[int, QPointF]:
        """Where the points lie, in pixels, by their rows."""
        if not self.points:
            return {}
        rows, _, _, seconds, errors, _ = zip(*self.points, strict=True)
        pixels = self.pixels_of(seconds, errors).tolist()
        return {row: QPointF(x, y) for row, (x, y) in zip(rows, pixels, strict=True)}

    @property
    def names(self) -> dict[int, QRectF]:
        """Where there is room for names; the row in use, the front and presets get it first."""
        names, spots = dict[int, QRectF](), self.spots
        radii = {row: RING if row == self.current else MARK for row in spots}
        taken = [
            QRectF(spot.x() - radii[row], spot.y() - radii[row], 2 * radii[row], 2 * radii[row])
            for row, spot in spots.items()
        ]
        taken += place_along([spots[point.row] for point in self._front])
        for p in sorted(
            self.points, key=lambda p: (p.row != self.current, not p.front, p.kind != "preset")
        ):
            spot, radius = spots[p.row], radii[p.row]
            if self.area.contains(spot):
                place = free_place(spot, p.text, _font(p), self.area, radius, taken)
                if place is not None:
                    names[p.row] = place
        return names

    @property
    def _front(self) -> list[Point]:
        """The points that no other beats, from left to right."""
        return sorted((point for point in self.points if point.front), key=lambda p: p.seconds)

    # Painting

    def redraw(self) -> None:
        self.clear()
        self.say("" if self.points else "No setting was measured for both axes.")
        theme = colours()
        kinds = list(dict.fromkeys(point.kind for point in self.points))
        pen = pg.mkPen(theme.frame, width=2.0)
        self.add(pg.PlotCurveItem(*self._places(self._front), pen=pen, antialias=True))
        marked = (self.current, self.highlighted)
        for point in sorted(self.points, key=lambda point: point.row in marked):  # last on top
            ink, shape = mark_style(kinds.index(point.kind), theme.curves)
            if point.row == self.highlighted:
                self._add_mark(point, "o", RING + 3, None, translucent(ink, 0.3))
            if point.row == self.current:
                self._add_mark(point, "o", RING, pg.mkPen(theme.accent, width=2.0), None)
            ground = ink if point.front else QColor(theme.background)
            self._add_mark(point, mark_path(shape), MARK, pg.mkPen(ink, width=1.8), ground)
        self.update()

    def paint_foreground(self, painter: QPainter) -> None:
        theme, names = colours(), self.names
        for point in self.points:
            if point.row in names:
                place, face = names[point.row], _font(point)
                strong = point.front or point.row in (self.current, self.highlighted)
                ink, y = QColor(theme.text if strong else theme.muted), place.center().y()
                text.draw_text(painter, place.left(), y, point.text, face=face, ink=ink)
            elif point.row == self.highlighted:
                self.paint_readout(painter, self.spots[point.row], point.text)

    def _add_mark(
        self, point: Point, symbol: object, radius: float, pen: object, brush: object
    ) -> None:
        place, style = self._places([point]), {"pen": pen, "brush": brush, "useCache": False}
        self.add(pg.ScatterPlotItem(*place, symbol=symbol, size=2 * radius, **style))

    def _places(self, points: Sequence[Point]) -> tuple[object, object]:
        seconds = np.array([point.seconds for point in points])
        return self.bottom.places(seconds), np.array([point.error for point in points])

    # Pointer and keys

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        super().mouseMoveEvent(event)
        row = self._row_at(event.position())
        shape = Qt.CursorShape.ArrowCursor if row is None else Qt.CursorShape.PointingHandCursor
        self.setCursor(shape)
        if row is not None and not event.buttons():
            self._highlight(row)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        row = self._row_at(event.position())
        if event.button() != Qt.MouseButton.LeftButton or row is None:
            super().mousePressEvent(event)
        else:
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

    def _row_at(self, position: QPointF) -> int | None:
        """The row whose mark is in reach of the pointer, or whose name is under it."""
        distances = {row: QLineF(spot, position).length() for row, spot in self.spots.items()}
        nearest = min(distances, key=distances.__getitem__, default=None)
        if nearest is not None and distances[nearest] <= REACH:
            return nearest
        return next((row for row, name in self.names.items() if name.contains(position)), None)

    def _highlight(self, row: int) -> None:
        if row != self.highlighted:
            self.highlight(row)
            self.highlight_changed.emit(row)


def _font(point: Point) -> QFont:
    """The font of a name; presets are bold."""
    return text_size.font(NAME, bold=point.kind == "preset")
