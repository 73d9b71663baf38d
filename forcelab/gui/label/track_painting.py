"""How tracks look: segments with the names of their actions, outlines, plates, origin marks.

A track of ten thousand segments costs little more than its pixels: segments too narrow for a line
between them or for a texture are brought onto columns of pixels first, all at once.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QImage, QPainter, QPen, QPolygonF

from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis
from forcelab.gui.figures.tracks import LabelStyle, paint_track, plate
from forcelab.gui.kit.plot import plate_box
from forcelab.gui.label.swatches import style_of
from forcelab.gui.label.track_spans import track_spans
from forcelab.gui.theme import Colours, colours
from forcelab.labels import Segments
from forcelab.project import Origin
from forcelab.vocabulary import Vocabulary

#: In place of omitted letters.
ELLIPSIS = "…"
#: Letters beside that sign: with fewer, it would take the room of those that tell the name.
LEAST_LETTERS = 3


@lru_cache(maxsize=4096)
def short_name(name: str, names: tuple[str, ...], size: float, room: int) -> tuple[str, float]:
    """As much of an action's name as fits into `room` pixels at a font `size`, and its width.

    A beginning that other names have too tells nothing: ``slip transition`` beside ``slip`` is
    ``slip tra…``, then ``s…tra``, then ``st``; never ``sl``.
    """
    face, full = text.font(size), text.printable(name)
    if (wide := text.width(full, face)) <= room:
        return full, wide
    others = [text.printable(other) for other in names if other != name]
    common = max((text.common_letters(full, other) for other in others), default=0)
    common += len(full[common:]) - len(full[common:].lstrip())
    short = text.elided(full, face, room)
    letters = len(short) - len(ELLIPSIS)
    if letters < LEAST_LETTERS or (common >= LEAST_LETTERS and letters <= common):
        short = _cut_inside(full, common, face, room) if common >= LEAST_LETTERS else ""
    if not short:
        candidates = abbreviations(tuple(dict.fromkeys((*names, name))))[name]
        short = next((sign for sign in candidates if text.width(sign, face) <= room), "")
    return short, text.width(short, face)


@lru_cache(maxsize=256)
def abbreviations(names: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    """Two letters and one letter of each name; none where another name has the same.

    A later name does not change the sign of an earlier one, unless that begins like it.
    """
    shown = {name: text.printable(name) for name in names}
    pairs: dict[str, str] = {}
    ambiguous = []
    for name, full in shown.items():
        if full[:2] not in pairs.values():
            pairs[name] = full[:2]
        else:
            ambiguous.append(name)
    for name in ambiguous:
        full = shown[name]
        tail = full[max(text.common_letters(full, o) for n, o in shown.items() if n != name) :]
        candidates = (full[0] + letter for letter in (*tail, *full[1:]) if not letter.isspace())
        pairs[name] = next((pair for pair in candidates if pair not in pairs.values()), "")
    initials = [full[:1] for full in shown.values()]
    return {
        name: tuple(filter(None, (pairs[name], full[:1] if initials.count(full[:1]) == 1 else "")))
        for name, full in shown.items()
    }


def _cut_inside(name: str, common: int, face: QFont, room: int) -> str:
    """The first letter, and what follows after the `common` beginning; empty if it has no room."""
    tail = name[common:]
    for count in range(len(tail), 0, -1):
        short = f"{name[0]}{ELLIPSIS}{tail[:count].rstrip()}"
        if text.width(short, face) <= room:
            return short
    return ""


#: Room that the mark of a proposed segment takes at the end of a cell, in pixels.
MARK = 14
#: Corners of the mark around its middle.
_DIAMOND = ((0.0, -3.5), (3.5, 0.0), (0.0, 3.5), (-3.5, 0.0))


def origin_text(origin: Origin | None) -> str:
    """Which model proposed a segment; empty where none did."""
    if origin is None:
        return ""
    if origin.changed:
        return f"proposed by {origin.proposer}, changed since"
    return f"proposed by {origin.proposer}"


def paint_proposed(painter: QPainter, box: QRectF, ink: str, changed: bool) -> None:
    """Mark at the end of a box that a model proposed a segment; hollow if it was changed since."""
    middle = QPointF(box.right() - MARK / 2, box.center().y())
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(QPen(QColor(ink), 1.2))
    painter.setBrush(Qt.GlobalColor.transparent if changed else QColor(ink))
    painter.drawPolygon(QPolygonF([middle + QPointF(*corner) for corner in _DIAMOND]))
    painter.restore()


#: Room left of and right of a name inside its segment, in pixels.
PADDING = 4.0
#: Below this contrast to the ground (WCAG 2.2) a segment gets a line around it.
LEAST_CONTRAST = 1.6
#: From what is dragged, and from the pointer's arrow, to the plate beside it, in pixels.
PLATE_DISTANCE, ARROW = 8.0, 20.0
#: Segments narrower than this many pixels are drawn as columns of pixels.
NARROW = 3.0


def narrow_columns(
    segments: Segments, start: float, pixel: float, count: int, widest: float
) -> tuple[Segments, NDArray[np.int64], tuple[str, ...]]:
    """Bring the segments shorter than `widest` (s) onto `count` columns of `pixel` s from `start`.

    A segment gets the columns whose middle it covers, but at least one. Where several crowd in one
    column, the action that is the rarest among the narrow segments is seen: it must not be lost.
    Gives the wide segments, for each column an index into the names (-1 where no narrow segment
    is; shape (count,)), and these names of actions.
    """
    columns = np.full(count, -1, dtype=np.int64)
    spans = track_spans(segments)
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
        inside = (place < last) & (place >= 0) & (place < count)
        columns[place[inside].astype(np.int64)] = codes[inside]
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
    """Draw one author's visible segments with the actions' names in them, `size` pixels high.

    More segments than can be told apart cost little.
    """
    device = painter.device()
    ratio = 1.0 if device is None else device.devicePixelRatio()
    count = max(1, round(box.width() * ratio))
    pixel = (axis.end - axis.start) / count
    wide, columns, names = narrow_columns(
        segments, axis.start, pixel, count, NARROW * ratio * pixel
    )
    used = {*names, *(segment.action for segment in wide)}
    styles = {name: style_of(vocabulary, name) for name in used}
    # Lines between segments lie on light colours in either theme.
    on_track = replace(theme, text=theme.on_unlabelled)
    edge = QPen(QColor(theme.on_unlabelled), 1.0)
    ground = QColor(theme.unlabelled)
    faint = {
        name
        for name, style in styles.items()
        if text.contrast(style.colour, ground) < LEAST_CONTRAST
    }
    inks = {name: text.ink_on(style.colour) for name, style in styles.items()}
    face, known_names = text.font(size), vocabulary.names

    def inscribe(painter: QPainter, bar: QRectF, action: str, style: LabelStyle) -> None:
        width = bar.width()
        if action in faint:
            painter.setPen(edge)
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRect(bar.adjusted(0.5, 0.5, -0.5, -0.5))
        if width < 2 * PADDING or bar.height() < size:  # the letters would be cut
            return
        name, needed = short_name(action, known_names, size, int(width - 2 * PADDING))
        if name:
            middle = bar.center()
            line = QRectF(bar.left(), middle.y() - size * 0.7, width, size * 1.4)
            plate(painter, line.intersected(bar), needed + PADDING, style)
            text.draw_text(
                painter, middle.x() - needed / 2, middle.y(), name, face=face, ink=inks[action]
            )

    paint_track(painter, box, axis, wide, styles=styles, theme=on_track, inscribe=inscribe)
    if names:
        palette = [styles[name].colour.rgba() for name in names]
        painter.drawImage(box, _strip(columns, np.array([*palette, 0], dtype=np.uint32)))


def _strip(columns: NDArray[np.int64], palette: NDArray[np.uint32]) -> QImage:
    """One line of pixels in the colours of the palette, whose last one stands for -1."""
    pixels = np.ascontiguousarray(palette[columns])
    image = QImage(
        pixels.data, len(pixels), 1, 4 * len(pixels), QImage.Format.Format_ARGB32_Premultiplied
    )
    return image.copy()  # of its own: the array's memory goes


def outline(painter: QPainter, bar: QRectF) -> None:
    """Draw a frame that is seen on every action's colour: accent outside, white inside."""
    painter.setBrush(Qt.BrushStyle.NoBrush)
    for inset, colour, thickness in ((0.0, colours().accent, 2.0), (2.0, "#ffffff", 1.0)):
        shrunk = inset + thickness / 2
        if bar.width() < 2 * shrunk + 1 and inset:
            continue
        pen = QPen(QColor(colour), thickness)
        pen.setJoinStyle(Qt.PenJoinStyle.MiterJoin)
        painter.setPen(pen)
        painter.drawRect(bar.adjusted(shrunk, shrunk, -shrunk, -shrunk))


def plate_beside(bar: QRectF, label: str, pointer: float, within: QRectF) -> QPointF:
    """The middle of a label's plate that covers neither a dragged bar nor the pointer (pixels).

    Where the bar leaves no room `within`, the plate lies at the end farther from the pointer.
    """
    wide, y = plate_box(label).width(), bar.center().y()
    before = min(bar.left() - PLATE_DISTANCE, pointer - PLATE_DISTANCE) - wide / 2
    behind = max(bar.right() + PLATE_DISTANCE, pointer + ARROW) + wide / 2
    fits_before = before - wide / 2 >= within.left()
    fits_behind = behind + wide / 2 <= within.right()
    at_the_end = abs(pointer - bar.right()) <= abs(pointer - bar.left())
    if fits_before and (at_the_end or not fits_behind):
        return QPointF(before, y)
    if fits_behind:
        return QPointF(behind, y)
    ends = within.left() + wide / 2, within.right() - wide / 2
    return QPointF(max(ends, key=lambda x: abs(x - pointer)), y)
