"""Axes with their numbers, curves, and labels that cover nothing."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QPainter, QPen, QPolygonF

from forcelab.gui.figures import text
from forcelab.gui.figures.figure import Theme

#: A value or a pixel, or many of them.
PlacesT = TypeVar("PlacesT", float, NDArray[np.float64])
#: Height of an axis' numbers and title, in pixels.
NUMBER = 10.0
#: Length of a tick mark, and the distance from its end to its number, in pixels.
MARK = 4.0
GAP = 4.0
#: Least space between two numbers at an axis, in pixels.
BREATH = 18.0
#: The same where with more of it there would be fewer than two, from which nothing can be read.
TIGHT = 4.0


def ticks(start: float, end: float, step: float) -> tuple[float, ...]:
    """The multiples of `step` in ``[start, end]``."""
    slack = 1e-9 * (end - start)
    first = math.ceil((start - slack) / step)
    last = math.floor((end + slack) / step)
    return tuple(i * step for i in range(first, last + 1))


def labels(values: tuple[float, ...], step: float) -> tuple[str, ...]:
    """Numbers with as many decimals as multiples of `step` need."""
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    return tuple(text.signed(f"{value:.{decimals}f}") for value in values)


@dataclass(frozen=True, slots=True)
class Axis:
    """A linear axis of values from `start` to `end`, at the pixels from `begin` to `finish`.

    ``start < end``; ``finish < begin`` for an axis that grows upwards.
    """

    start: float
    end: float
    begin: float
    finish: float

    def at(self, value: PlacesT) -> PlacesT:
        """The pixel of a value."""
        share = (value - self.start) / (self.end - self.start)
        return self.begin + share * (self.finish - self.begin)

    def value(self, pixel: PlacesT) -> PlacesT:
        """The value at a pixel."""
        share = (pixel - self.begin) / (self.finish - self.begin)
        return self.start + share * (self.end - self.start)

    def marks(self, *, upright: bool) -> tuple[tuple[float, str], ...]:
        """Values and their texts: multiples of 1, 2 or 5 times a power of ten that have room.

        Along an `upright` axis texts need room by height, not width.
        """
        marks = self._marks(upright, BREATH)
        return marks if len(marks) > 1 else self._marks(upright, TIGHT)

    def _marks(self, upright: bool, breath: float) -> tuple[tuple[float, str], ...]:
        face = text.font(NUMBER)
        room = abs(self.finish - self.begin)
        span = self.end - self.start
        power = math.floor(math.log10(span)) - 3
        while True:
            for step in (10.0**power, 2 * 10.0**power, 5 * 10.0**power):
                if step / span * room < NUMBER + breath:
                    continue
                values = ticks(self.start, self.end, step)
                texts = labels(values, step)
                needed = NUMBER if upright else text.widest(texts, face)
                if step > span or step / span * room >= needed + breath:
                    return tuple(zip(values, texts, strict=True))
            power += 1


@dataclass(frozen=True, slots=True)
class LogAxis:
    """A logarithmic axis, as :class:`Axis` with ``0 < start < end``."""

    start: float
    end: float
    begin: float
    finish: float

    def at(self, value: float) -> float:
        share = math.log(value / self.start) / math.log(self.end / self.start)
        return self.begin + share * (self.finish - self.begin)

    def marks(self, *, upright: bool) -> tuple[tuple[float, str], ...]:
        """Values and their texts: 1, 2 and 5 times powers of ten, or fewer where these crowd."""
        face = text.font(NUMBER)
        low, high = math.floor(math.log10(self.start)), math.ceil(math.log10(self.end))
        exponents = range(low, high + 1)
        for digits, stride in (((1, 2, 5), 1), ((1,), 1), ((1,), 2), ((1,), 5)):
            values = [d * 10.0**e for e in exponents if e % stride == 0 for d in digits]
            values = [v for v in values if self.start * 0.999 <= v <= self.end * 1.001]
            texts = [f"{value:g}" for value in values]
            spots = [self.at(value) for value in values]
            needed = NUMBER if upright else text.widest(texts, face)
            gaps = [abs(b - a) for a, b in pairwise(spots)]
            if min(gaps, default=math.inf) >= needed + BREATH / 2:
                break
        return tuple(zip(values, texts, strict=True))


def draw_grid(painter: QPainter, lines: Iterable[QLineF], theme: Theme) -> None:
    """Draw lines behind the data."""
    painter.setPen(QPen(QColor(theme.grid), 1.0))
    painter.drawLines(list(lines))


def draw_bottom(
    painter: QPainter,
    axis: Axis | LogAxis,
    y: float,
    title: str,
    theme: Theme,
    *,
    above: bool = False,
) -> None:
    """Draw an axis along the bottom edge `y` of a plot, or along its top edge with `above`."""
    sign = -1.0 if above else 1.0
    marks = axis.marks(upright=False)
    painter.setPen(QPen(QColor(theme.frame), 1.0))
    painter.drawLine(QLineF(axis.begin, y, axis.finish, y))
    painter.drawLines([QLineF(axis.at(v), y, axis.at(v), y + sign * MARK) for v, _ in marks])
    face = text.font(NUMBER)
    centre = y + sign * (MARK + GAP + NUMBER / 2)
    for value, label in marks:
        text.draw_text(painter, axis.at(value), centre, label, face=face, ink=theme.text, align=0.5)
    middle = (axis.begin + axis.finish) / 2
    below = centre + sign * (NUMBER + GAP + 2)
    text.draw_text(painter, middle, below, title, face=face, ink=theme.muted, align=0.5)


def draw_left(
    painter: QPainter,
    axis: Axis | LogAxis,
    x: float,
    title: str,
    theme: Theme,
    *,
    numbers: bool = True,
) -> None:
    """Draw an axis along the left edge `x` of a plot, with or without its numbers."""
    marks = axis.marks(upright=True)
    painter.setPen(QPen(QColor(theme.frame), 1.0))
    painter.drawLine(QLineF(x, axis.begin, x, axis.finish))
    painter.drawLines([QLineF(x, axis.at(v), x - MARK, axis.at(v)) for v, _ in marks])
    if not numbers:
        return
    face = text.font(NUMBER)
    for value, label in marks:
        y = axis.at(value)
        text.draw_text(painter, x - MARK - GAP, y, label, face=face, ink=theme.text, align=1.0)
    side = x - MARK - GAP - text.widest((label for _, label in marks), face) - GAP - NUMBER / 2
    middle = (axis.begin + axis.finish) / 2
    text.draw_text_upwards(painter, side, middle, title, face=face, ink=theme.muted, align=0.5)


#: Colours of curves and clusters: Okabe and Ito's that stand out on white as thin lines.
CURVE_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")


def curve_pen(colour: QColor, thickness: float) -> QPen:
    """A pen for curves, round so that steep corners do not stick out."""
    return QPen(colour, thickness, c=Qt.PenCapStyle.RoundCap, j=Qt.PenJoinStyle.RoundJoin)


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
    points = zip(across.at(x).tolist(), up.at(y).tolist(), strict=True)
    painter.drawPolyline(QPolygonF([QPointF(*point) for point in points]))


def paint_names(
    painter: QPainter, x: float, y: float, names: Sequence[tuple[str, QPen]], theme: Theme
) -> None:
    """Draw a piece of each curve with its name, from left to right."""
    face = text.font(10)
    for name, pen in names:
        painter.setPen(pen)
        painter.drawLine(QLineF(x, y, x + 20, y))
        text.draw_text(painter, x + 27, y, name, face=face, ink=theme.text)
        x += 27 + text.width(name, face) + 20


#: What is left free between a mark and its text, and boxes along a line, in pixels.
LABEL_GAP, STEP = 3.0, 4.0


def place_labels(
    spot: QPointF, label: str, face: QFont, box: QRectF, mark: float
) -> Iterator[QRectF]:
    """Boxes inside the plot where the label of a mark may stand, the best ones first.

    The mark is in the middle of its `spot` and `mark` pixels wide on either side.
    """
    wide, high = text.width(label, face), face.pixelSize() + 2.0
    out, near = mark + LABEL_GAP, mark
    for left, top in (
        (out, -high / 2),
        (-out - wide, -high / 2),
        (-wide / 2, -out - high),
        (-wide / 2, out),
        (near, -near - high),
        (near, near),
        (-near - wide, -near - high),
        (-near - wide, near),
    ):
        x = min(max(spot.x() + left, box.left() + 2), box.right() - 2 - wide)
        y = min(max(spot.y() + top, box.top() + 2), box.bottom() - 2 - high)
        yield QRectF(x, y, wide, high)


def free_place(
    spot: QPointF, label: str, face: QFont, box: QRectF, mark: float, taken: list[QRectF]
) -> QRectF | None:
    """The best box of a label that covers nothing, which is taken from then on."""
    places = place_labels(spot, label, face, box, mark)
    place = next((place for place in places if not any(map(place.intersects, taken))), None)
    if place is not None:
        taken.append(place)
    return place


def place_along(line: Sequence[QPointF]) -> Iterator[QRectF]:
    """Small boxes that cover a polyline, so that no label is written across it."""
    for start, end in pairwise(line):
        length = QLineF(start, end).length()
        for i in range(math.ceil(length / STEP)):
            spot = QLineF(start, end).pointAt(i * STEP / length)
            yield QRectF(spot.x() - STEP / 2, spot.y() - STEP / 2, STEP, STEP)


def covered_area(place: QRectF, taken: Sequence[QRectF]) -> float:
    common = [place.intersected(other) for other in taken]
    return sum(box.width() * box.height() for box in common)
