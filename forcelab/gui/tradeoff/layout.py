"""Where everything of the trade-off plot lies: axes, points, and the names that have room."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import QPointF, QRectF
from PySide6.QtGui import QFont

from forcelab.gui.figures.axes import Axis, LogAxis
from forcelab.gui.figures.label_places import along, covered, places
from forcelab.gui.tradeoff.points import Point

__all__ = ["MARK", "RING", "Layout", "laid_out"]

#: Half the width of a mark, and the radius of the ring around what is in use, in pixels.
MARK, RING = 5.0, 9.5
#: Room for the numbers and names of the axes, and at the other sides, in pixels.
LEFT, TOP, RIGHT, BOTTOM = 62.0, 14.0, 18.0, 44.0
#: What is left free beyond the outermost points, as a share of the axis.
FREE = 0.06


@dataclass(frozen=True)
class Layout:
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


def laid_out(
    points: Sequence[Point], room: QRectF, face: QFont, bold: QFont, current: int | None
) -> Layout:
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
    taken += along([spots[i] for i in front])
    names: dict[int, QRectF] = {}
    for i in sorted(range(len(points)), key=lambda i: _rank(points[i], i == current)):
        own = bold if points[i].kind == "preset" else face
        mark = RING if i == current else MARK
        for place in places(spots[i], points[i].text, own, box, mark):
            others = [other for j, other in enumerate(taken) if j != i]
            if not covered(place, others) and not covered(place, [taken[i]]):
                names[i] = place
                taken.append(place)
                break
    return Layout(box, across, up, spots, names)


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
