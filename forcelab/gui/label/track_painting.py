"""How a track is drawn in the window: as in the figures, with the names of actions on it.

A track of ten thousand segments costs little more than its pixels: segments too narrow for a line
between them or for a texture are brought onto columns of pixels first, all at once.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterable
from dataclasses import replace
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPen

from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis
from forcelab.gui.figures.canvas import Theme
from forcelab.gui.figures.tracks import Look, paint_track, plate
from forcelab.gui.label.short_names import fitting
from forcelab.gui.label.track_spans import spans_of
from forcelab.gui.theme import Colours
from forcelab.labels import Segments
from forcelab.vocabulary import Vocabulary

__all__ = ["beside", "crowd", "looks_of", "outline", "paint_row", "put_plate", "visible"]

#: Room left of and right of a name inside its segment, in pixels.
PADDING = 4.0
#: Below this contrast to the ground (WCAG 2.2) a segment gets a line around it.
SEEN = 1.6
#: From what is dragged, and from the pointer's arrow, to the words about it, in pixels.
APART, ARROW = 8.0, 20.0
#: Segments narrower than this many pixels are drawn as columns of pixels.
NARROW = 3.0

_start = attrgetter("start")
_end = attrgetter("end")
_action = attrgetter("action")


def looks_of(vocabulary: Vocabulary, used: Iterable[str], theme: Theme) -> dict[str, Look]:
    """How each action is drawn; grey where another author's action is not in the vocabulary."""
    looks = {
        action.name: Look(action.key, QColor(action.colour), action.texture)
        for action in vocabulary
    }
    for name in used:
        if name not in looks:
            looks[name] = Look("", QColor(theme.muted))
    return looks


def visible(segments: Segments, start: float, end: float) -> Segments:
    """The segments that reach into ``[start, end]``, found in O(log n)."""
    first = bisect_right(segments, start, key=_end)
    last = bisect_left(segments, end, key=_start)
    return segments[first:last]


def crowd(
    segments: Segments, start: float, pixel: float, count: int, widest: float
) -> tuple[Segments, NDArray[np.int64], tuple[str, ...]]:
    """Bring the narrow segments onto columns of pixels.

    A segment gets the columns whose middle it covers, but at least one. Where several crowd in one
    column, the action that is the rarest among the narrow segments is seen: it must not be lost.

    Parameters
    ----------
    segments : tuple of Segment
        In order, never overlapping.
    start : float
        The time at which the first column begins, in seconds.
    pixel : float
        Seconds in one column.
    count : int
        Number of columns.
    widest : float
        Segments shorter than this are narrow, in seconds.

    Returns
    -------
    wide : tuple of Segment
        The other segments.
    columns : ndarray of int64, shape (count,)
        What is seen in each column, as an index into the names; -1 where no narrow segment is.
    names : tuple of str
        The actions of the narrow segments, and maybe others.
    """
    columns = np.full(count, -1, dtype=np.int64)
    spans = spans_of(segments)
    is_narrow = spans.ends - spans.starts < widest
    if not is_narrow.any():
        return segments, columns, ()
    wide = tuple(segments[i] for i in np.flatnonzero(~is_narrow).tolist())
    codes = spans.codes[is_narrow]
    # Rare ones come last: of several values written to one place the last one stays.
    order = np.argsort(-np.bincount(codes)[codes], kind="stable")
    codes = codes[order]
    left, right = (
        (times[is_narrow][order] - start) / pixel for times in (spans.starts, spans.ends)
    )
    first, last = np.ceil(left - 0.5), np.ceil(right - 0.5)
    single = last <= first
    first[single] = np.floor((left[single] + right[single]) / 2)
    last[single] = first[single] + 1
    for step in range(int((last - first).max())):
        place = first + step
        there = (place < last) & (place >= 0) & (place < count)
        columns[place[there].astype(np.int64)] = codes[there]
    return wide, columns, spans.names


def paint_row(
    painter: QPainter,
    box: QRectF,
    axis: Axis,
    segments: Segments,
    *,
    vocabulary: Vocabulary,
    theme: Colours,
    size: float,
) -> None:
    """Draw one author's visible segments with the actions' names in them.

    Parameters
    ----------
    painter, box, axis
        As of :func:`forcelab.gui.figures.tracks.paint_track`.
    segments : tuple of Segment
        In order, never overlapping; more than can be told apart cost little.
    vocabulary : Vocabulary
        How actions look.
    theme : Colours
        The window's colours.
    size : float
        Height of the names in pixels.
    """
    device = painter.device()
    ratio = 1.0 if device is None else device.devicePixelRatio()
    count = max(1, round(box.width() * ratio))
    pixel = (axis.end - axis.start) / count
    wide, columns, names = crowd(segments, axis.start, pixel, count, NARROW * ratio * pixel)
    looks = looks_of(vocabulary, (*names, *(s.action for s in wide)), theme)
    # Lines between segments lie on light colours in either theme.
    on_track = replace(theme, text=theme.on_unlabelled)
    edge = QPen(QColor(theme.on_unlabelled), 1.0)
    ground = QColor(theme.unlabelled)
    faint = {name for name, look in looks.items() if text.contrast(look.colour, ground) < SEEN}
    inks = {name: text.ink_on(look.colour) for name, look in looks.items()}
    face, known = text.font(size), vocabulary.names

    def inscribe(painter: QPainter, bar: QRectF, action: str, look: Look) -> None:
        width = bar.width()
        if action in faint:
            painter.setPen(edge)
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRect(bar.adjusted(0.5, 0.5, -0.5, -0.5))
        if width < 2 * PADDING or bar.height() < size:  # the letters would be cut
            return
        name, needed = fitting(action, known, size, int(width - 2 * PADDING))
        if name:
            middle = bar.center()
            line = QRectF(bar.left(), middle.y() - size * 0.7, width, size * 1.4)
            plate(painter, line.intersected(bar), needed + PADDING, look)
            text.put(
                painter, middle.x() - needed / 2, middle.y(), name, face=face, ink=inks[action]
            )

    paint_track(painter, box, axis, wide, looks=looks, theme=on_track, inscribe=inscribe)
    if names:
        palette = [looks[name].colour.rgba() for name in names]
        painter.drawImage(box, _strip(columns, np.array([*palette, 0], dtype=np.uint32)))


def _strip(columns: NDArray[np.int64], palette: NDArray[np.uint32]) -> QImage:
    """One line of pixels in the colours of the palette; its last one stands for -1."""
    pixels = np.ascontiguousarray(palette[columns])
    image = QImage(
        pixels.data, len(pixels), 1, 4 * len(pixels), QImage.Format.Format_ARGB32_Premultiplied
    )
    return image.copy()  # of its own: the array's memory goes


def outline(painter: QPainter, bar: QRectF, theme: Colours) -> None:
    """Draw a frame that is seen on every action's colour: accent outside, white inside."""
    painter.setBrush(Qt.BrushStyle.NoBrush)
    for inset, colour, thickness in ((0.0, theme.accent, 2.0), (2.0, "#ffffff", 1.0)):
        shrunk = inset + thickness / 2
        if bar.width() < 2 * shrunk + 1 and inset:
            continue
        pen = QPen(QColor(colour), thickness)
        pen.setJoinStyle(Qt.PenJoinStyle.MiterJoin)
        painter.setPen(pen)
        painter.drawRect(bar.adjusted(shrunk, shrunk, -shrunk, -shrunk))


def _plate(words: str) -> QRectF:
    """A small plate for a few words."""
    return QRectF(0, 0, text.width(words, text.font(10)) + 10, 16)


def beside(bar: QRectF, words: str, pointer: float, within: QRectF) -> QPointF:
    """Where the middle of a plate is to be, that it covers neither a bar nor the pointer.

    Parameters
    ----------
    bar : QRectF
        What is dragged.
    words : str
        On the plate.
    pointer : float
        Where it is pointed at, in pixels.
    within : QRectF
        There is no room elsewhere. Where the bar leaves none either, the plate lies at the end
        that is further from the pointer.
    """
    wide, y = _plate(words).width(), bar.center().y()
    before = min(bar.left() - APART, pointer - APART) - wide / 2
    behind = max(bar.right() + APART, pointer + ARROW) + wide / 2
    fits_before = before - wide / 2 >= within.left()
    fits_behind = behind + wide / 2 <= within.right()
    at_the_end = abs(pointer - bar.right()) <= abs(pointer - bar.left())
    if fits_before and (at_the_end or not fits_behind):
        return QPointF(before, y)
    if fits_behind:
        return QPointF(behind, y)
    ends = within.left() + wide / 2, within.right() - wide / 2
    return QPointF(max(ends, key=lambda x: abs(x - pointer)), y)


def put_plate(painter: QPainter, at: QPointF, words: str, theme: Colours, within: QRectF) -> None:
    """Write a few words on a small plate centred on a point, kept within a box."""
    face = text.font(10)
    room = _plate(words)
    room.moveCenter(at)
    room.moveLeft(max(min(room.left(), within.right() - room.width()), within.left()))
    painter.setPen(QPen(QColor(theme.frame), 1))
    painter.setBrush(QColor(theme.background))
    painter.drawRoundedRect(room.adjusted(0.5, 0.5, -0.5, -0.5), 3, 3)
    middle = room.center()
    text.put(painter, middle.x(), middle.y(), words, face=face, ink=QColor(theme.text), align=0.5)
