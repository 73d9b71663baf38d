"""Error against run time: a panel for each size, a mark for each setting, the best ones joined."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property

from PySide6.QtCore import QLineF, QPointF, QRectF, QSizeF
from PySide6.QtGui import QColor, QFont, QPainter, QPainterPath, QPolygonF, QTransform

from forcelab.errors import InputError
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import (
    CURVE_COLOURS,
    LogAxis,
    covered_area,
    curve_pen,
    draw_bottom,
    draw_grid,
    draw_left,
    free_place,
    place_along,
    place_labels,
)
from forcelab.gui.figures.figure import MARGIN, Figure
from forcelab.measure.rows import Row, Table

#: Room for the numbers of the upward axis, and for half of the last one across.
LEFT, RIGHT = 84.0, 36.0
PLOT_WIDTH, PLOT_HEIGHT = 440.0, 290.0
COLUMNS, APART = 2, 36.0
HEADING = 44.0
#: Above a plot: its size and its reference. Below: the axis and what could not be drawn.
NAME_ROOM, AXIS_ROOM, NOTE_ROOM = 40.0, 38.0, 22.0
PANEL = NAME_ROOM + PLOT_HEIGHT + AXIS_ROOM + NOTE_ROOM + 14.0
#: Half a mark's width, in pixels.
MARK = 4.5
COLOURS = (*CURVE_COLOURS, "#1c1f24")
#: Corners of the marks, in units of their half width; none is a circle.
SHAPES: tuple[tuple[tuple[float, float], ...], ...] = (
    (),
    ((-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)),
    ((0, -1.15), (1.1, 0.85), (-1.1, 0.85)),
    ((0, -1.3), (1.3, 0), (0, 1.3), (-1.3, 0)),
    ((0, 1.15), (1.1, -0.85), (-1.1, -0.85)),
)
KEY = "Filled and joined: no other is both faster and more exact (Pareto front)."
ZERO = "At the lower edge: no error at all."


@dataclass(frozen=True)
class Mark:
    """A row's mark in the plot."""

    row: Row
    spot: QPointF
    colour: QColor
    shape: int

    @property
    def box(self) -> QRectF:
        return QRectF(self.spot.x() - MARK, self.spot.y() - MARK, 2 * MARK, 2 * MARK)


@dataclass(frozen=True)
class Tradeoff(Figure):
    """A table of error against run time, on logarithmic axes that all panels share.

    At most 25 names can be told apart by colour and shape. A table whose rows are all refused is an
    InputError.
    """

    table: Table

    def __post_init__(self) -> None:
        if not any(row.point for row in self.table.rows):
            raise InputError(f"'{self.table.title}' has nothing to draw; every row was refused.")

    @property
    def title(self) -> str:  # type: ignore[override]
        return self.table.title

    @property
    def size(self) -> QSizeF:
        columns = min(COLUMNS, len(self.table.sizes))
        width = LEFT + columns * PLOT_WIDTH + (columns - 1) * APART + RIGHT
        lines = math.ceil(len(self.table.sizes) / COLUMNS)
        return QSizeF(width, MARGIN + HEADING + lines * PANEL + MARGIN - 14.0)

    def box(self, panel: int) -> QRectF:
        """The plot of a size, in pixels."""
        line, column = divmod(panel, COLUMNS)
        top = MARGIN + HEADING + line * PANEL + NAME_ROOM
        return QRectF(LEFT + column * (PLOT_WIDTH + APART), top, PLOT_WIDTH, PLOT_HEIGHT)

    def axes(self, panel: int) -> tuple[LogAxis, LogAxis]:
        """The axes of seconds and of errors."""
        box = self.box(panel)
        (fast, slow), (exact, coarse) = self._ranges
        across = LogAxis(fast, slow, box.left(), box.right())
        return across, LogAxis(exact, coarse, box.bottom(), box.top())

    def paint(self, painter: QPainter) -> None:
        self.paint_title(painter, KEY)
        for panel in range(len(self.table.sizes)):
            self._paint_frame(painter, panel)
            marks = self.marks(panel)
            front = sorted((m for m in marks if m.row.pareto), key=lambda m: m.spot.x())
            line = [mark.spot for mark in front]
            painter.setPen(curve_pen(QColor(self.theme.frame), 2.0))
            painter.drawPolyline(QPolygonF(line))
            for mark in marks:
                self._paint_mark(painter, mark)
            self._paint_labels(painter, self.box(panel), marks, list(place_along(line)))

    def marks(self, panel: int) -> tuple[Mark, ...]:
        """The marks of a panel, in the order of the rows; an error of 0 is at the lower edge."""
        across, up = self.axes(panel)
        names = list(dict.fromkeys(row.name for row in self.table.rows))
        marks = []
        for row in self.table.of(self.table.sizes[panel]):
            if row.point is not None:
                seconds, error = row.point
                spot = QPointF(across.at(seconds), up.at(max(error, up.start)))
                marks.append(Mark(row, spot, *mark_style(names.index(row.name), COLOURS)))
        return tuple(marks)

    @cached_property
    def _ranges(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Whole decades around all seconds, and around all errors but 0."""
        points = [row.point for row in self.table.rows if row.point is not None]
        errors = [error for _, error in points if error > 0] or [1.0]
        return _decades([seconds for seconds, _ in points]), _decades(errors)

    def _paint_frame(self, painter: QPainter, panel: int) -> None:
        """Draw a panel's names, grid, axes and note."""
        box, (across, up) = self.box(panel), self.axes(panel)
        size = self.table.sizes[panel]
        rows = self.table.of(size)
        ink, muted = self.theme.text, self.theme.muted
        bold, small = text.font(bold=True), text.font(10)
        name = text.elided(size, bold, box.width())
        text.draw_text(painter, box.left(), box.top() - 30, name, face=bold, ink=ink)
        reference = text.elided(f"Against {rows[0].reference}.", small, box.width())
        text.draw_text(painter, box.left(), box.top() - 13, reference, face=small, ink=muted)
        xs = [across.at(value) for value, _ in across.marks(upright=False)]
        ys = [up.at(value) for value, _ in up.marks(upright=True)]
        grid = [QLineF(x, box.top(), x, box.bottom()) for x in xs]
        grid += [QLineF(box.left(), y, box.right(), y) for y in ys]
        draw_grid(painter, grid, self.theme)
        draw_bottom(painter, across, box.bottom(), self.table.seconds, self.theme)
        first = panel % COLUMNS == 0
        draw_left(painter, up, box.left(), self.table.error, self.theme, numbers=first)
        note = text.elided(_note(rows), small, box.width())
        below = box.bottom() + AXIS_ROOM + NOTE_ROOM / 2
        text.draw_text(painter, box.left(), below, note, face=small, ink=muted)

    def _paint_mark(self, painter: QPainter, mark: Mark) -> None:
        """Draw a mark: filled on the front, hollow elsewhere."""
        painter.setPen(curve_pen(mark.colour, 1.6))
        painter.setBrush(mark.colour if mark.row.pareto else QColor(self.theme.background))
        to_spot = QTransform.fromTranslate(mark.spot.x(), mark.spot.y()).scale(2 * MARK, 2 * MARK)
        painter.drawPath(to_spot.map(mark_path(mark.shape)))

    def _paint_labels(
        self, painter: QPainter, box: QRectF, marks: Sequence[Mark], line: Sequence[QRectF]
    ) -> None:
        """Write each name once, then the settings that have room, those of the front first."""
        taken = [*line, *(mark.box for mark in marks)]
        named: dict[str, list[Mark]] = {}
        for mark in marks:
            named.setdefault(mark.row.name, []).append(mark)
        for name, named_marks in named.items():
            bold = text.font(10, bold=True)
            label = text.elided_name(name, bold, box.width() / 3)
            near = [
                place
                for mark in named_marks
                for place in place_labels(mark.spot, label, bold, box, MARK)
            ]
            # A name is written in any case: where it covers least.
            best = min(near, key=lambda place: covered_area(place, taken))
            taken.append(best)
            _write(painter, best, label, bold, named_marks[0].colour)
        small, muted = text.font(9), self.theme.muted
        for mark in sorted(marks, key=lambda mark: not mark.row.pareto):
            label = text.elided_name(mark.row.setting, small, box.width() / 3)
            if place := free_place(mark.spot, label, small, box, MARK, taken):
                _write(painter, place, label, small, muted)


def mark_style(number: int, colours: Sequence[str]) -> tuple[QColor, int]:
    """Colour and index of the shape of the `number`-th name; no two names have both alike."""
    turn, i = divmod(number, len(colours))
    return QColor(colours[i]), (i + turn) % len(SHAPES)


@cache
def mark_path(shape: int) -> QPainterPath:
    """The outline of a mark as wide as a pixel. Shared: not to be changed."""
    path = QPainterPath()
    if corners := SHAPES[shape]:
        path.addPolygon(QPolygonF([QPointF(x, y) / 2 for x, y in corners]))
        path.closeSubpath()
    else:
        path.addEllipse(QRectF(-0.5, -0.5, 1, 1))
    return path


def _decades(values: Sequence[float]) -> tuple[float, float]:
    """The nearest powers of ten that leave a little room around all values."""
    low, high = math.log10(min(values)) - 0.1, math.log10(max(values)) + 0.1
    return 10.0 ** math.floor(low), 10.0 ** math.ceil(high)


def _note(rows: Sequence[Row]) -> str:
    """What a panel cannot show: refusals, and errors of 0."""
    refused = [f"{row.name}, {row.setting}" for row in rows if row.refusal]
    sentences = [f"Refused: {'; '.join(refused)}."] if refused else []
    if any(row.error == 0 for row in rows):
        sentences.append(ZERO)
    return " ".join(sentences)


def _write(painter: QPainter, place: QRectF, label: str, face: QFont, ink: QColor | str) -> None:
    text.draw_text(painter, place.left(), place.center().y(), label, face=face, ink=ink)
