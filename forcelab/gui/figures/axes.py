"""Axes: which numbers stand at them, and how they are drawn."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

from PySide6.QtCore import QLineF
from PySide6.QtGui import QColor, QPainter, QPen

from forcelab.gui.figures import text
from forcelab.gui.figures.canvas import Theme

__all__ = ["Axis", "LogAxis", "draw_bottom", "draw_left", "labels", "ticks"]

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
    """The numbers with just the decimals that tell multiples of `step` apart."""
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    return tuple(text.signed(f"{value:.{decimals}f}") for value in values)


@dataclass(frozen=True, slots=True)
class Axis:
    """A linear axis.

    Parameters
    ----------
    start, end : float
        Values at its two ends, ``start < end``.
    begin, finish : float
        Pixels of its two ends; ``finish < begin`` for an axis that grows upwards.
    """

    start: float
    end: float
    begin: float
    finish: float

    def at(self, value: float) -> float:
        """The pixel of a value."""
        share = (value - self.start) / (self.end - self.start)
        return self.begin + share * (self.finish - self.begin)

    def value(self, pixel: float) -> float:
        """The value at a pixel."""
        share = (pixel - self.begin) / (self.finish - self.begin)
        return self.start + share * (self.end - self.start)

    def marks(self, size: float, upright: bool) -> tuple[tuple[float, str], ...]:
        """Values and their texts: multiples of 1, 2 or 5 times a power of ten that have room.

        Parameters
        ----------
        size : float
            Height of the font in pixels.
        upright : bool
            Whether the axis runs up the page, so that texts need room by height, not width.
        """
        found = self._marks(size, upright, BREATH)
        return found if len(found) > 1 else self._marks(size, upright, TIGHT)

    def _marks(self, size: float, upright: bool, breath: float) -> tuple[tuple[float, str], ...]:
        """Those that are at least so many pixels apart."""
        face = text.font(size)
        room = abs(self.finish - self.begin)
        span = self.end - self.start
        power = math.floor(math.log10(span)) - 3
        while True:
            for step in (10.0**power, 2 * 10.0**power, 5 * 10.0**power):
                if step / span * room < size + breath:
                    continue
                values = ticks(self.start, self.end, step)
                texts = labels(values, step)
                needed = size if upright else text.widest(texts, face)
                if step > span or step / span * room >= needed + breath:
                    return tuple(zip(values, texts, strict=True))
            power += 1


@dataclass(frozen=True, slots=True)
class LogAxis:
    """A logarithmic axis; parameters as of :class:`Axis`, with ``0 < start < end``."""

    start: float
    end: float
    begin: float
    finish: float

    def at(self, value: float) -> float:
        """The pixel of a value."""
        share = math.log(value / self.start) / math.log(self.end / self.start)
        return self.begin + share * (self.finish - self.begin)

    def marks(self, size: float, upright: bool) -> tuple[tuple[float, str], ...]:
        """Values and their texts: 1, 2 and 5 times powers of ten, or fewer where these are close.

        Parameters as of :meth:`Axis.marks`.
        """
        face = text.font(size)
        low, high = math.floor(math.log10(self.start)), math.ceil(math.log10(self.end))
        every = range(low, high + 1)
        for digits, stride in (((1, 2, 5), 1), ((1,), 1), ((1,), 2), ((1,), 5)):
            values = [d * 10.0**e for e in every if e % stride == 0 for d in digits]
            values = [v for v in values if self.start * 0.999 <= v <= self.end * 1.001]
            texts = [f"{value:g}" for value in values]
            spots = [self.at(value) for value in values]
            needed = size if upright else text.widest(texts, face)
            gaps = [abs(b - a) for a, b in pairwise(spots)]
            if min(gaps, default=math.inf) >= needed + BREATH / 2:
                break
        return tuple(zip(values, texts, strict=True))


def draw_bottom(
    painter: QPainter,
    axis: Axis | LogAxis,
    y: float,
    title: str,
    theme: Theme,
    *,
    size: float = 10.0,
    above: bool = False,
) -> None:
    """Draw an axis along the bottom edge `y` of a plot, or along its top edge with `above`."""
    way = -1.0 if above else 1.0
    marks = axis.marks(size, upright=False)
    painter.setPen(QPen(QColor(theme.frame), 1.0))
    painter.drawLine(QLineF(axis.begin, y, axis.finish, y))
    painter.drawLines([QLineF(axis.at(v), y, axis.at(v), y + way * MARK) for v, _ in marks])
    face = text.font(size)
    centre = y + way * (MARK + GAP + size / 2)
    for value, label in marks:
        text.put(
            painter, axis.at(value), centre, label, face=face, ink=QColor(theme.text), align=0.5
        )
    middle = (axis.begin + axis.finish) / 2
    below = centre + way * (size + GAP + 2)
    text.put(painter, middle, below, title, face=face, ink=QColor(theme.muted), align=0.5)


def draw_left(
    painter: QPainter,
    axis: Axis | LogAxis,
    x: float,
    title: str,
    theme: Theme,
    *,
    size: float = 10.0,
    numbers: bool = True,
) -> None:
    """Draw an axis along the left edge `x` of a plot, with or without its numbers."""
    marks = axis.marks(size, upright=True)
    painter.setPen(QPen(QColor(theme.frame), 1.0))
    painter.drawLine(QLineF(x, axis.begin, x, axis.finish))
    painter.drawLines([QLineF(x, axis.at(v), x - MARK, axis.at(v)) for v, _ in marks])
    if not numbers:
        return
    face = text.font(size)
    for value, label in marks:
        ink = QColor(theme.text)
        text.put(painter, x - MARK - GAP, axis.at(value), label, face=face, ink=ink, align=1.0)
    side = x - MARK - GAP - text.widest((label for _, label in marks), face) - GAP - size / 2
    middle = (axis.begin + axis.finish) / 2
    text.put_upwards(painter, side, middle, title, face=face, ink=QColor(theme.muted), align=0.5)
