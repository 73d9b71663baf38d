"""One track as a bar, its fading by probability, differences between two bars, and the legend."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from operator import attrgetter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen

from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis
from forcelab.gui.figures.colormap import mixed, translucent
from forcelab.gui.figures.figure import Theme
from forcelab.labels import Segment, Segments, to_codes
from forcelab.vocabulary import Action, Vocabulary

if TYPE_CHECKING:
    from forcelab.labels import Interval
    from forcelab.recognition.probabilities import ProbabilityTrace
    from forcelab.review.differences import Difference


#: From this probability on a prediction has its full colour; from that one down the lightest.
SURE, UNSURE = 0.95, 0.35
#: The opacity of the strongest fade, and how many opacities there are: so few that
#: a bar is a few rectangles in an SVG, so many that no step is seen as an edge of a segment.
STRONGEST, LEVELS = 0.72, 16
#: Width of what has one thickness, in pixels: narrower flicker cannot be read.
COLUMN = 5.0

_left = attrgetter("left")


@dataclass(frozen=True, slots=True)
class FadeOverlay:
    """A part of a bar, in pixels, that is lighter; `opacity` from 0, not, to 1, gone."""

    left: float
    right: float
    opacity: float


def fade_overlays(
    certainty: ProbabilityTrace, segments: Segments, axis: Axis, box: QRectF
) -> tuple[FadeOverlay, ...]:
    """The fades over a bar, from left to right; none where a prediction is sure.

    An action that `certainty` does not know is not faded.
    """
    if not segments or not len(certainty.values) or box.width() <= 0:
        return ()
    actions = tuple(dict.fromkeys((*certainty.actions, *(s.action for s in segments))))
    edges = _edges(segments, axis, box)
    middles = axis.value((edges[1:] + edges[:-1]) / 2)
    labelled = to_codes(segments, middles, actions) >= 0
    probabilities = _segment_steps(certainty, to_codes(segments, certainty.times, actions))
    ticks = certainty.start + np.arange(len(probabilities) + 1) / certainty.rate
    times = axis.value(edges)
    sums = np.interp(times, ticks, np.concatenate([[0.0], np.cumsum(probabilities)]))
    shares = np.diff(sums) / np.maximum(np.diff(times) * certainty.rate, 1e-12)
    levels = np.where(labelled, _levels(shares), 0)
    cuts = [0, *(np.flatnonzero(np.diff(levels)) + 1).tolist(), len(levels)]
    pixels, opacities = edges.tolist(), (levels * STRONGEST / LEVELS).tolist()
    return tuple(
        FadeOverlay(pixels[first], pixels[last], opacities[first])
        for first, last in pairwise(cuts)
        if opacities[first]
    )


def paint_fade(
    painter: QPainter, box: QRectF, fades: tuple[FadeOverlay, ...], unlabelled: QColor
) -> None:
    stretches_by_opacity: dict[float, list[QRectF]] = {}
    for fade in fades:
        stretch = QRectF(fade.left, box.top(), fade.right - fade.left, box.height())
        stretches_by_opacity.setdefault(fade.opacity, []).append(stretch)
    painter.setPen(Qt.PenStyle.NoPen)
    for share, stretches in stretches_by_opacity.items():
        painter.setBrush(translucent(unlabelled, share))
        painter.drawRects(stretches)


def fade_at(fades: tuple[FadeOverlay, ...], x: float) -> float:
    """The opacity of the fade at a pixel; 0 where there is none."""
    i = bisect_right(fades, x, key=_left) - 1
    return fades[i].opacity if i >= 0 and x < fades[i].right else 0.0


def _levels(probabilities: NDArray[np.float64]) -> NDArray[np.int64]:
    shares = np.clip((SURE - probabilities) / (SURE - UNSURE), 0.0, 1.0)
    return np.rint(shares * LEVELS).astype(np.int64)


def _edges(segments: Segments, axis: Axis, box: QRectF) -> NDArray[np.float64]:
    """Pixels at which the opacity may change: a grid, and the edges of segments."""
    grid = np.append(np.arange(box.left(), box.right(), COLUMN), box.right())
    spots = axis.at(np.array([(s.start, s.end) for s in segments]).ravel())
    return np.unique(np.clip(np.concatenate([grid, spots]), box.left(), box.right()))


def _segment_steps(certainty: ProbabilityTrace, codes: NDArray[np.int64]) -> NDArray[np.float64]:
    """The probability in each bin of what is predicted there; 1 where it is not known."""
    has_action = (codes >= 0) & (codes < len(certainty.actions))
    probabilities = np.ones(len(codes))
    probabilities[has_action] = (
        certainty.values[np.flatnonzero(has_action), codes[has_action]]
        / np.iinfo(certainty.values.dtype).max
    )
    return probabilities


#: Segments narrower than this many pixels are drawn so wide, above their neighbours.
NARROWEST = 1.0
#: Touching segments narrower than this have no line between them: it would cover them.
SEPARATED = 3.0
#: Height of the signs inside segments, and what is left free on either side, in pixels.
SIGN = 9.0
PADDING = 3.0


@dataclass(frozen=True, slots=True)
class LabelStyle:
    """How an action is drawn: the sign in its bars, its colour and its texture.

    The sign is the key that paints the action, or a number where nothing is painted; empty where
    there is neither.
    """

    sign: str
    colour: QColor
    texture: int = 0


def action_style(action: Action) -> LabelStyle:
    """How an action of a vocabulary is drawn, with its key as the sign."""
    return LabelStyle(action.key, QColor(action.colour), action.texture)


#: What writes into a bar: see :func:`paint_track`.
Inscription = Callable[[QPainter, QRectF, str, LabelStyle], None]


def paint_style(painter: QPainter, box: QRectF, style: LabelStyle) -> None:
    """Fill a box with an action's colour and texture, and its sign where there is room."""
    paint_texture(painter, box, style)
    _sign(painter, box, "", style)


def paint_texture(painter: QPainter, box: QRectF, style: LabelStyle) -> None:
    """Fill a box with an action's colour and texture."""
    painter.fillRect(box, style.colour)
    _hatch(painter, [box], style)


def paint_track(
    painter: QPainter,
    box: QRectF,
    axis: Axis,
    segments: Sequence[Segment],
    *,
    styles: Mapping[str, LabelStyle],
    theme: Theme,
    inscribe: Inscription | None = None,
    fades: tuple[FadeOverlay, ...] = (),
) -> None:
    """Draw one author's segments, which are in order and never overlap; nothing outside of `box`.

    `inscribe` writes into each bar of a pixel or more; by default the action's sign.
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
        _fill(painter, bars, styles[action].colour)
        _hatch(painter, bars, styles[action])
    paint_fade(painter, box, fades, QColor(theme.unlabelled))
    painter.setPen(_line(QColor(theme.text), 0.8))
    painter.drawLines(cuts)
    # The rarest last: where narrow segments crowd, it is the one that must not be lost.
    for action, bars in sorted(narrow.items(), key=lambda item: -len(item[1])):
        _fill(painter, bars, styles[action].colour)
    for action, bars in wide.items():
        for bar in bars:
            inscribe(painter, bar, action, _faded(styles[action], bar, fades, theme))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.setPen(_line(QColor(theme.frame), 0.6))
    painter.drawRect(box)


def _faded(
    style: LabelStyle, bar: QRectF, fades: tuple[FadeOverlay, ...], theme: Theme
) -> LabelStyle:
    """An action's style in the middle of a bar, on which its sign must be legible."""
    share = fade_at(fades, bar.center().x()) if fades and bar.width() >= SIGN else 0.0
    if not share:
        return style
    return replace(style, colour=mixed(style.colour, theme.unlabelled, share))


def plate(painter: QPainter, bar: QRectF, width: float, style: LabelStyle) -> None:
    """Clear a part of the texture in the middle of a bar, for a text."""
    if style.texture:
        ground = QRectF(0, 0, width, bar.height())
        ground.moveCenter(bar.center())
        painter.fillRect(ground, style.colour)


def _line(colour: QColor, thickness: float) -> QPen:
    """A pen whose lines end where they end."""
    return QPen(colour, thickness, c=Qt.PenCapStyle.FlatCap, j=Qt.PenJoinStyle.MiterJoin)


def _fill(painter: QPainter, bars: Sequence[QRectF], colour: QColor) -> None:
    """Fill many bars in one call; a path of them takes three times as long."""
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(colour)
    painter.drawRects(bars)


def _hatch(painter: QPainter, bars: Sequence[QRectF], style: LabelStyle) -> None:
    """Draw an action's texture as lines, which look the same in every format."""
    lines = [line for bar in bars for line in _hatching(bar, style.texture)]
    if not lines:
        return
    painter.setPen(_line(mixed(style.colour, text.ink_on(style.colour), 0.5), 1.2))
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


def _sign(painter: QPainter, bar: QRectF, _action: str, style: LabelStyle) -> None:
    """Draw an action's sign in the middle of a bar that is wide enough for it."""
    label = style.sign.upper()  # as on the caps of keys
    face, centre = text.font(SIGN), bar.center()
    needed = text.width(label, face) + 2 * PADDING
    if not label or bar.width() < needed:
        return
    plate(painter, bar, needed - PADDING, style)
    text.draw_text(
        painter, centre.x(), centre.y(), label, face=face, ink=text.ink_on(style.colour), align=0.5
    )


#: A mark is at least so wide, in pixels; one as wide as two posts has a post at each end.
NARROWEST_MARK = 2.0
POST = 2.0
#: Thickness of the bar of another action and of the line of none, in pixels.
WRONG, MISSED = 4.0, 2.0


def agreed_share(human: Segments, marks: Sequence[Interval]) -> float | None:
    """Share of the time the human labelled that is predicted right; None if that is none."""
    labelled = sum(segment.duration for segment in human)
    marked_seconds = sum(mark.duration for mark in marks)
    return 1.0 - marked_seconds / labelled if labelled > 0 else None


def difference_box(band: QRectF, axis: Axis, mark: Interval) -> QRectF:
    """Where a mark lies in the band between two bars, in pixels; none is too narrow to be seen."""
    left, right = max(axis.at(mark.start), band.left()), min(axis.at(mark.end), band.right())
    wide = max(right - left, NARROWEST_MARK)
    if wide > right - left:
        left = min(max((left + right - wide) / 2, band.left()), band.right() - wide)
    return QRectF(left, band.top(), wide, band.height())


def paint_differences(
    painter: QPainter, band: QRectF, axis: Axis, marks: Sequence[Difference], colour: QColor
) -> None:
    """Draw the marks of differences.

    A wrong action is a thick bar between two posts, a displaced edge a bar without them, what was
    not predicted a thin line: they are told apart without colour.
    """
    middle = band.center().y()
    inside = [mark for mark in marks if mark.end > axis.start and mark.start < axis.end]
    rects = []
    # What is missed first: a narrow wrong action must not be lost beside it.
    for mark in sorted(inside, key=lambda mark: mark.predicted is not None):
        box = difference_box(band, axis, mark)
        if mark.predicted is None:
            rects.append(QRectF(box.left(), middle - MISSED / 2, box.width(), MISSED))
            continue
        rects.append(QRectF(box.left(), middle - WRONG / 2, box.width(), WRONG))
        if mark.kind == "boundary":
            continue
        width = min(POST, box.width() / 2)
        rects.append(QRectF(box.left(), band.top(), width, band.height()))
        rects.append(QRectF(box.right() - width, band.top(), width, band.height()))
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(colour)
    painter.drawRects(rects)


#: Names longer than this are elided; height of a line; size of a swatch; all in pixels.
LEGEND_NAME_ROOM = 190.0
LEGEND_LINE = 20.0
SWATCH, SWATCH_HEIGHT = 22.0, 13.0


def styles_in_order(actions: Iterable[str], vocabulary: Vocabulary) -> dict[str, LabelStyle]:
    """How each action is drawn, with the key that paints it: no other number is to be learnt."""
    return {name: action_style(vocabulary[name]) for name in actions}


@dataclass(frozen=True)
class Legend:
    """A legend of actions laid out in a width of `room` pixels."""

    styles: Mapping[str, LabelStyle]
    room: float

    @property
    def columns(self) -> tuple[int, float]:
        """Number of columns, and the width of one."""
        names = [text.printable(name) for name in self.styles]
        column = SWATCH + 7 + min(text.widest(names, text.font()), LEGEND_NAME_ROOM) + 20
        return max(1, int((self.room + 20) // column)), column

    @property
    def height(self) -> float:
        return math.ceil(len(self.styles) / self.columns[0]) * LEGEND_LINE

    def paint(self, painter: QPainter, left: float, top: float, theme: Theme) -> None:
        columns, column = self.columns
        for i, (name, style) in enumerate(self.styles.items()):
            x = left + i % columns * column
            y = top + i // columns * LEGEND_LINE
            swatch = QRectF(x, y + (LEGEND_LINE - SWATCH_HEIGHT) / 2, SWATCH, SWATCH_HEIGHT)
            paint_style(painter, swatch, style)
            label = text.elided_name(name, text.font(), LEGEND_NAME_ROOM, tuple(self.styles))
            middle = y + LEGEND_LINE / 2
            text.draw_text(painter, x + SWATCH + 7, middle, label, face=text.font(), ink=theme.text)
