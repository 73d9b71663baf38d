"""One track as a bar: coloured segments with textures and signs, white where unlabelled."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache

from PySide6.QtCore import QLineF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen

from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis
from forcelab.gui.figures.canvas import Theme
from forcelab.gui.figures.fading import Veil, paint_veils, veil_at
from forcelab.gui.figures.shades import mixed
from forcelab.labels import Segment

__all__ = ["Look", "paint_look", "paint_texture", "paint_track", "plate"]

#: Segments narrower than this many pixels are drawn so wide, above their neighbours.
NARROWEST = 1.0
#: Touching segments narrower than this have no line between them: it would cover them.
SEPARATED = 3.0
#: Height of the signs inside segments, and what is left free on either side, in pixels.
SIGN = 9.0
PADDING = 3.0


@dataclass(frozen=True, slots=True)
class Look:
    """How an action is drawn: what stands in its bars, its colour and its texture.

    The sign is the key that paints the action, or a number where nothing is painted; empty where
    there is neither.
    """

    sign: str
    colour: QColor
    texture: int = 0


#: What writes into a bar: see :func:`paint_track`.
Inscription = Callable[[QPainter, QRectF, str, Look], None]


def paint_look(painter: QPainter, box: QRectF, look: Look) -> None:
    """Fill a box with an action's colour and texture, and its sign where there is room."""
    paint_texture(painter, box, look)
    _sign(painter, box, "", look)


def paint_texture(painter: QPainter, box: QRectF, look: Look) -> None:
    """Fill a box with an action's colour and texture."""
    painter.fillRect(box, look.colour)
    _hatch(painter, [box], look)


def paint_track(
    painter: QPainter,
    box: QRectF,
    axis: Axis,
    segments: Sequence[Segment],
    *,
    looks: Mapping[str, Look],
    theme: Theme,
    inscribe: Inscription | None = None,
    veils: tuple[Veil, ...] = (),
) -> None:
    """Draw one author's segments.

    Parameters
    ----------
    painter : QPainter
        Where to draw.
    box : QRectF
        From the start to the end of the demonstration; nothing is drawn outside.
    axis : Axis
        From seconds to pixels.
    segments : sequence of Segment
        In order, never overlapping.
    looks : mapping of str to Look
        One for each action.
    theme : Theme
        Colours of unlabelled time, frames and lines.
    inscribe : callable, optional
        Writes into each bar of a pixel or more, given painter, bar, action and look; by default
        the action's sign.
    veils : tuple of Veil, optional
        Where the bars are lighter, as of :func:`forcelab.gui.figures.fading.veils`.
    """
    inscribe = inscribe or _sign
    painter.fillRect(box, QColor(theme.unlabelled))
    wide: dict[str, list[QRectF]] = {}
    narrow: dict[str, list[QRectF]] = {}
    cuts = []
    touched = (-math.inf, 0.0)  # where the segment before ends, and how wide it is
    first, last, top, height = box.left(), box.right(), box.top(), box.height()
    for segment in segments:
        left, right = max(axis.at(segment.start), first), min(axis.at(segment.end), last)
        if right <= left:
            continue
        if right - left < NARROWEST:
            spot = min(max((left + right - NARROWEST) / 2, first), last - NARROWEST)
            bar = QRectF(spot, top, NARROWEST, height)
            narrow.setdefault(segment.action, []).append(bar)
        else:
            bar = QRectF(left, top, right - left, height)
            wide.setdefault(segment.action, []).append(bar)
        if left - touched[0] < 0.01 and min(touched[1], right - left) >= SEPARATED:
            cuts.append(QLineF(left, top, left, top + height))
        touched = (right, right - left)
    for action, bars in wide.items():
        _fill(painter, bars, looks[action].colour)
        _hatch(painter, bars, looks[action])
    paint_veils(painter, box, veils, QColor(theme.unlabelled))
    painter.setPen(_line(QColor(theme.text), 0.8))
    painter.drawLines(cuts)
    # The rarest last: where narrow segments crowd, it is the one that must not be lost.
    for action, bars in sorted(narrow.items(), key=lambda item: -len(item[1])):
        _fill(painter, bars, looks[action].colour)
    for action, bars in wide.items():
        for bar in bars:
            inscribe(painter, bar, action, _veiled(looks[action], bar, veils, theme))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.setPen(_line(QColor(theme.frame), 0.6))
    painter.drawRect(box)


def _veiled(look: Look, bar: QRectF, veils: tuple[Veil, ...], theme: Theme) -> Look:
    """How an action looks in the middle of a bar: what is written there is to be read."""
    share = veil_at(veils, bar.center().x()) if veils and bar.width() >= SIGN else 0.0
    if not share:
        return look
    return replace(look, colour=mixed(look.colour, theme.unlabelled, share))


def plate(painter: QPainter, bar: QRectF, width: float, look: Look) -> None:
    """Clear a stretch of texture in the middle of a bar, for what is written there."""
    if look.texture:
        ground = QRectF(0, 0, width, bar.height())
        ground.moveCenter(bar.center())
        painter.fillRect(ground, look.colour)


def _line(colour: QColor, thickness: float) -> QPen:
    """A pen whose lines end where they end."""
    pen = QPen(colour, thickness)
    pen.setCapStyle(Qt.PenCapStyle.FlatCap)
    pen.setJoinStyle(Qt.PenJoinStyle.MiterJoin)
    return pen


def _fill(painter: QPainter, bars: Sequence[QRectF], colour: QColor) -> None:
    """Fill many bars in one call; a path of them takes three times as long."""
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(colour)
    painter.drawRects(bars)


def _hatch(painter: QPainter, bars: Sequence[QRectF], look: Look) -> None:
    """Draw an action's texture as lines, which look the same in every format."""
    lines = [line for bar in bars for line in _hatching(bar, look.texture)]
    if not lines:
        return
    ink = text.ink_on(look.colour)
    halfway = QColor(
        (look.colour.red() + ink.red()) // 2,
        (look.colour.green() + ink.green()) // 2,
        (look.colour.blue() + ink.blue()) // 2,
    )
    painter.setPen(_line(halfway, 1.2))
    painter.drawLines(lines)


def _hatching(bar: QRectF, texture: int) -> Iterator[QLineF]:
    """The lines of a texture inside a bar: rising, falling, crossed, upright; then further apart.

    Lines keep their place on the page whatever the bar, so that neighbours of one action match.
    """
    if texture == 0:
        return
    kind, loose = (texture - 1) % 4, (texture - 1) // 4
    gap = 5.0 + 3.0 * loose
    left, right, top, bottom = bar.left(), bar.right(), bar.top(), bar.bottom()
    if kind in (0, 2):
        for c in _multiples(gap * math.sqrt(2), left + top, right + bottom):
            low, high = max(top, c - right), min(bottom, c - left)
            yield QLineF(c - low, low, c - high, high)
    if kind in (1, 2):
        for c in _multiples(gap * math.sqrt(2), left - bottom, right - top):
            low, high = max(top, left - c), min(bottom, right - c)
            yield QLineF(c + low, low, c + high, high)
    if kind == 3:
        for c in _multiples(gap, left, right):
            yield QLineF(c, top, c, bottom)


def _multiples(step: float, low: float, high: float) -> Iterator[float]:
    """The multiples of `step` strictly between two numbers."""
    for i in range(math.floor(low / step) + 1, math.ceil(high / step)):
        yield i * step


def _sign(painter: QPainter, bar: QRectF, _action: str, look: Look) -> None:
    """Draw an action's sign in the middle of a bar that is wide enough for it."""
    label = look.sign.upper()  # as on the caps of keys
    needed = _room(label)
    if not label or bar.width() < needed:
        return
    face, centre = text.font(SIGN), bar.center()
    plate(painter, bar, needed - PADDING, look)
    text.put(
        painter, centre.x(), centre.y(), label, face=face, ink=_ink(look.colour.rgb()), align=0.5
    )


@cache
def _room(label: str) -> float:
    """Width of the narrowest bar that a sign is written in, in pixels."""
    return text.width(label, text.font(SIGN)) + 2 * PADDING


@lru_cache(maxsize=1024)
def _ink(ground: int) -> QColor:
    """What is read on a colour, given as of :meth:`QColor.rgb`."""
    return text.ink_on(QColor.fromRgb(ground))
