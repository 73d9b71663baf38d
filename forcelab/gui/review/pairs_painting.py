"""How a row of the timeline pairs is painted: once into a pixmap, which scrolling only moves."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen, QPixmap

from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis
from forcelab.gui.figures.marks import mark_box
from forcelab.gui.figures.pairs import CAPTION, Lane, Pair, captions, paint_pair
from forcelab.gui.figures.shades import mixed
from forcelab.gui.figures.tracks import Look
from forcelab.gui.label.track_painting import crowd, outline
from forcelab.gui.review.pairs_layout import MARGIN, Layout
from forcelab.gui.theme import Colours, colours
from forcelab.labels import Segment, Segments
from forcelab.review.differences import Interval

__all__ = ["RowPictures", "paint_examined", "paint_focus", "paint_row", "thinned"]

#: How many rows' pictures are kept: some screens of them.
KEPT = 48
#: Tracks of more segments than this are brought onto columns of pixels before they are drawn.
MANY = 300
#: How much of the accent the ground of the open demonstration has.
TINT = 0.13


class RowPictures:
    """The pictures of the rows seen last, by demonstration."""

    def __init__(self) -> None:
        self._kept: OrderedDict[str, QPixmap] = OrderedDict()
        #: How many rows were painted so far.
        self.painted = 0

    def clear(self) -> None:
        """Everything looks different now."""
        self._kept.clear()

    def drop(self, id_: str) -> None:
        """A demonstration looks different now."""
        self._kept.pop(id_, None)

    def known(self, id_: str) -> QPixmap | None:
        """The picture of a demonstration's row, if it is there."""
        if id_ in self._kept:
            self._kept.move_to_end(id_)
        return self._kept.get(id_)

    def paint(
        self,
        layout: Layout,
        row: int,
        looks: Mapping[str, Look],
        opened: bool,
        ratio: float,
        remark: str,
    ) -> QPixmap:
        """Paint a row and keep its picture; parameters as of :func:`paint_row`."""
        box = layout.row_box(row)
        picture = QPixmap(round(box.width() * ratio), round(box.height() * ratio))
        picture.setDevicePixelRatio(ratio)
        with QPainter(picture) as painter:
            paint_row(painter, layout, row, looks, opened, ratio, remark)
        self._kept[layout.entries[row].id] = picture
        self.painted += 1
        while len(self._kept) > KEPT:
            self._kept.popitem(last=False)
        return picture


def paint_row(
    painter: QPainter,
    layout: Layout,
    row: int,
    looks: Mapping[str, Look],
    opened: bool,
    ratio: float,
    remark: str,
) -> None:
    """Paint a row with its upper left corner at the origin.

    Parameters
    ----------
    painter : QPainter
    layout : Layout
    row : int
    looks : mapping of str to Look
    opened : bool
        Whether its demonstration is the open one.
    ratio : float
        Image pixels for each pixel.
    remark : str
        Said below the share.
    """
    theme, entry = colours(), layout.entries[row]
    axis, boxes = layout.axis(entry), layout.boxes(row)
    whole = QRectF(0, 0, layout.width, layout.row_height(row))
    ground = QColor(theme.background)
    if opened:
        ground = mixed(ground, theme.accent, TINT)
    painter.fillRect(whole, ground)
    if opened:
        painter.fillRect(QRectF(0, 0, 4, whole.height()), QColor(theme.accent))
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    if not layout.stretched:
        painter.setPen(QPen(QColor(theme.grid), 1.0))
        spots = [axis.at(value) for value, _ in axis.marks(10.0, upright=False)]
        painter.drawLines([QLineF(x, 0, x, whole.height()) for x in spots])
    on_track = replace(theme, text=theme.on_unlabelled)
    pair = _drawable(entry.pair, axis, ratio)
    mark = QColor(theme.trouble)
    paint_pair(painter, boxes, axis, pair, looks=looks, theme=on_track, mark=mark)
    _write(painter, layout, row, opened, remark, theme)


def _write(
    painter: QPainter, layout: Layout, row: int, opened: bool, remark: str, theme: Colours
) -> None:
    """Write name, captions and notes of a row."""
    entry, boxes = layout.entries[row], layout.boxes(row)
    top = boxes.human.top()
    middle = (top + boxes.predicted.bottom()) / 2
    ink, muted = QColor(theme.text), QColor(theme.muted)
    face = text.font(bold=opened)
    name = text.elided_name(entry.reviewed.name, face, layout.name_room)
    text.put(painter, MARGIN, middle, name, face=face, ink=ink)
    small = text.font(CAPTION)
    for height, caption in captions(boxes, entry.pair, *layout.names):
        short = text.elided(caption, small, layout.caption_room - 10)
        text.put(painter, layout.left - 7, height, short, face=small, ink=muted, align=1.0)
    edge = layout.width - MARGIN
    if entry.share is not None:
        height = middle - 6 if remark else middle
        share = f"{100 * entry.share:.1f} %"
        text.put(painter, edge, height, share, face=text.font(), ink=ink, align=1.0)
    if remark:
        height = middle + 7 if entry.share is not None else middle
        text.put(painter, edge, height, remark, face=small, ink=muted, align=1.0)


def thinned(segments: Segments, axis: Axis, ratio: float) -> Segments:
    """Segments of a pixel or more that look the same as very many narrow ones."""
    if len(segments) <= MANY:
        return segments
    count = max(1, round((axis.finish - axis.begin) * ratio))
    pixel = (axis.end - axis.start) / count
    wide, columns, names = crowd(segments, axis.start, pixel, count, 3.0 * pixel)
    cuts = np.concatenate([[0], np.flatnonzero(np.diff(columns)) + 1, [count]]).tolist()
    narrow = (
        Segment(axis.start + first * pixel, axis.start + last * pixel, names[columns[first]])
        for first, last in pairwise(cuts)
        if columns[first] >= 0
    )
    return tuple(sorted((*wide, *narrow)))


def _drawable(pair: Pair, axis: Axis, ratio: float) -> Pair:
    """A pair that looks the same and costs no more than its pixels."""
    return replace(
        pair,
        human=None if pair.human is None else thinned(pair.human, axis, ratio),
        predicted=thinned(pair.predicted, axis, ratio),
        lanes=tuple(
            Lane(lane.caption, thinned(lane.segments, axis, ratio), lane.certain)
            for lane in pair.lanes
        ),
    )


def paint_examined(painter: QPainter, layout: Layout, row: int, start: float, end: float) -> None:
    """Frame a stretch of a row, over all of its bars; the painter stands at the row's corner."""
    boxes, axis = layout.boxes(row), layout.axis(layout.entries[row])
    left, right = axis.at(start), axis.at(end)
    spare = max(8.0 - (right - left), 0.0) / 2 + 2
    top = boxes.human.top()
    frame = QRectF(left, top, right - left, boxes.predicted.bottom() - top)
    outline(painter, frame.adjusted(-spare, -3, spare, 3), colours())


def paint_focus(painter: QPainter, layout: Layout, row: int, mark: Interval | None) -> None:
    """Show which row and which disagreement the keyboard is at."""
    theme = colours()
    pen = QPen(QColor(theme.accent), 2.0)
    pen.setJoinStyle(Qt.PenJoinStyle.MiterJoin)
    painter.setPen(pen)
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawRect(QRectF(0, 0, layout.width, layout.row_height(row)).adjusted(1, 1, -1, -1))
    if mark is None:
        return
    band = layout.boxes(row).band
    box = mark_box(band, layout.axis(layout.entries[row]), mark)
    centre = box.center().x()
    painter.setPen(QPen(QColor(theme.background), 1.0))
    painter.setBrush(QColor(theme.accent))
    for tip, base in ((band.top(), band.top() - 8), (band.bottom(), band.bottom() + 8)):
        painter.drawPolygon(
            [QPointF(centre, tip), QPointF(centre - 6, base), QPointF(centre + 6, base)]
        )
