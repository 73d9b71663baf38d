"""The scrolled list of timeline pairs: layout, painting, hit test, mouse and keyboard."""

from __future__ import annotations

from bisect import bisect_right
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from html import escape
from itertools import accumulate
from time import perf_counter

import numpy as np
from PySide6.QtCore import QEvent, QLineF, QPoint, QPointF, QRect, QRectF, QSize, Qt, QTimer, Signal
from PySide6.QtGui import (
    QAccessible,
    QAccessibleEvent,
    QColor,
    QFocusEvent,
    QFont,
    QHelpEvent,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPixmap,
    QResizeEvent,
)
from PySide6.QtWidgets import QAbstractScrollArea, QToolTip

from forcelab.gui.document import Document
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis
from forcelab.gui.figures.colormap import mixed
from forcelab.gui.figures.pairs import (
    CAPTION,
    PairBoxes,
    PairGeometry,
    captions,
    paint_captions,
    paint_pair,
)
from forcelab.gui.figures.tracks import LabelStyle, difference_box
from forcelab.gui.kit import text_size
from forcelab.gui.label.track_painting import outline
from forcelab.gui.review.pair_entries import PairEntry
from forcelab.gui.theme import colours, themes
from forcelab.gui.widgets import ARROW_STEPS, ENTER_KEYS, is_plain
from forcelab.labels import Interval, Segment, Segments
from forcelab.review.differences import action_over
from forcelab.segment_edits import index_at

MEASURES = PairGeometry(bar=16.0, lane=10.0)
#: Left and right of everything, and above and below the bars of a row, in pixels.
MARGIN = 12.0
ROW_PADDING = 6.0
#: The heading of the proposals.
HEADING_HEIGHT = 44.0
#: Names take so much of the width at most, in pixels and as a share.
NAME_WIDTH, NAME_SHARE = 240.0, 0.36
CAPTION_WIDTH = 80.0
NOTE_WIDTH = 56.0


@dataclass(frozen=True)
class PairsLayout:
    """The rows of some entries, the tested first, in a width in pixels."""

    entries: Sequence[PairEntry]
    width: float
    stretched: bool  # whether each takes the whole width, however long it lasts

    @cached_property
    def name_room(self) -> float:
        widest = text.widest(
            (text.printable(e.reviewed.name) for e in self.entries), text.font(bold=True)
        )
        return min(widest + 2, NAME_WIDTH, NAME_SHARE * self.width)

    @cached_property
    def caption_room(self) -> float:
        """Width of the column of captions; 0 where no row needs one."""
        names = {c for entry in self.entries for c in captions(entry.pair)}
        return min(text.widest(names, text.font(CAPTION)), CAPTION_WIDTH) + 12 if names else 0.0

    @property
    def left(self) -> float:
        return MARGIN + self.name_room + self.caption_room + 10

    @property
    def right(self) -> float:
        return max(self.width - MARGIN - NOTE_WIDTH, self.left + 40)

    @cached_property
    def span(self) -> tuple[float, float]:
        """From the earliest start to the latest end, in seconds."""
        if not self.entries:
            return 0.0, 1.0
        start = min(entry.reviewed.start for entry in self.entries)
        return start, max(entry.reviewed.end for entry in self.entries)

    def axis(self, entry: PairEntry | None = None) -> Axis:
        """The time axis of an entry, or the common one."""
        start, end = self.span
        if entry is not None and self.stretched:
            start, end = entry.reviewed.start, entry.reviewed.end
        return Axis(start, end, self.left, self.right)

    @cached_property
    def first_proposal(self) -> int | None:
        """Above which row the heading of the proposals stands."""
        return next((i for i, entry in enumerate(self.entries) if entry.human is None), None)

    @cached_property
    def tops(self) -> list[float]:
        """Upper edge of each row, headings above it left out, and the end of the last one."""
        heights = []
        for i, entry in enumerate(self.entries):
            heading = HEADING_HEIGHT if i == self.first_proposal else 0.0
            heights += [heading, MEASURES.height(entry.pair) + 2 * ROW_PADDING]
        edges = list(accumulate(heights, initial=0.0))
        return [*edges[1::2], edges[-1]]

    @property
    def height(self) -> float:
        return self.tops[-1] if self.entries else 0.0

    def row_height(self, row: int) -> float:
        return MEASURES.height(self.entries[row].pair) + 2 * ROW_PADDING

    def row_box(self, row: int) -> QRectF:
        return QRectF(0, self.tops[row], self.width, self.row_height(row))

    def visible(self, top: float, bottom: float) -> range:
        """The rows of which something lies between two heights."""
        count = len(self.entries)
        first = max(bisect_right(self.tops, top, 0, count) - 1, 0)
        return range(first, max(first, bisect_right(self.tops, bottom, 0, count)))

    def row_at(self, y: float) -> int | None:
        """Which row is at a height; None between and below them."""
        row = bisect_right(self.tops, y, 0, len(self.entries)) - 1
        if row < 0 or y >= self.tops[row] + self.row_height(row):
            return None
        return row

    def boxes(self, row: int) -> PairBoxes:
        """Where the bars of a row lie, measured from the row's upper edge."""
        entry = self.entries[row]
        return MEASURES.boxes(entry.pair, self.axis(entry), ROW_PADDING)


#: How far from a mark it is still meant, in pixels.
HIT_DISTANCE = 3.0
#: How many actions a tooltip tells the probability of.
MOST_MARKS = 3


@dataclass(frozen=True)
class Hit:
    """What is at a point of a row."""

    row: int
    time: float | None = None  # in seconds; None beside the bars
    target: Segment | Interval | None = None
    author: str = ""  # whose bar it is, as on the screen


def hit_test(layout: PairsLayout, point: QPointF) -> Hit | None:
    """What is at a point among all rows; None below and between them."""
    row = layout.row_at(point.y())
    if row is None:
        return None
    entry, boxes = layout.entries[row], layout.boxes(row)
    axis = layout.axis(entry)
    x, y = point.x(), point.y() - layout.tops[row]
    if not boxes.predicted.left() - HIT_DISTANCE <= x <= boxes.predicted.right() + HIT_DISTANCE:
        return Hit(row)
    time = min(max(axis.value(x), entry.reviewed.start), entry.reviewed.end)
    if boxes.band.top() <= y < boxes.band.bottom():
        distances = [(_distance(difference_box(boxes.band, axis, m), x), m) for m in entry.marks]
        distance, mark = min(distances, key=lambda pair: pair[0], default=(HIT_DISTANCE + 1, None))
        return Hit(row, time, mark if distance <= HIT_DISTANCE else None)
    predicted = entry.reviewed.predicted
    bars: list[tuple[str, QRectF, Segments]] = [
        ("human", boxes.human, entry.human or ()),
        ("predicted", boxes.predicted, predicted),
    ]
    for lane, box in zip(entry.lanes, boxes.lanes, strict=True):
        bars.append((lane.caption, box, lane.segments))
    for author, box, segments in bars:
        if box.top() <= y < box.bottom():
            index = index_at(segments, time)
            return Hit(row, time, None if index is None else segments[index], author)
    return Hit(row, time)


def hit_interval(entry: PairEntry, place: Segment | Interval) -> Interval:
    """A segment or a disagreement as an interval: what each sees in most of it, and how sure."""
    if isinstance(place, Interval):
        human, predicted = place.human, place.predicted
    else:
        human = action_over(entry.human or (), place.start, place.end)
        predicted = action_over(entry.reviewed.predicted, place.start, place.end)
    confidence = entry.reviewed.confidence(predicted, place.start, place.end)
    return Interval(entry.id, place.start, place.end, human, predicted, confidence)


def hit_tooltip(entry: PairEntry, hit: Hit) -> str:
    """The tooltip as rich text; names are escaped."""
    lines = [f"<b>{escape(entry.reviewed.name)}</b>"]
    if hit.time is None:
        return "<br>".join([*lines, escape(entry_description(entry))])
    target = hit.target
    if isinstance(target, Interval):
        lines.append(escape(difference_text(target)))
    elif isinstance(target, Segment):
        lines.append(
            escape(f"{hit.author}: {target.action}, {_interval_text(target.start, target.end)}")
        )
    else:
        lines.append(f"{hit.time:.3f} s")
    certainty = entry.reviewed.probability_trace
    if certainty is not None:
        start, end = (target.start, target.end) if target is not None else (hit.time, hit.time)
        means = certainty.mean(start, end)
        best = np.argsort(-means, kind="stable")[:MOST_MARKS]
        lines += [f"{100 * means[i]:.0f} %&nbsp; {escape(certainty.actions[i])}" for i in best]
    return "<br>".join(lines)


def difference_text(mark: Interval) -> str:
    predicted = mark.predicted or "unlabelled"
    return f"{_interval_text(mark.start, mark.end)}: human {mark.human}, predicted {predicted}"


def entry_description(entry: PairEntry, mark: int | None = None) -> str:
    """A row in words, for screen readers and tooltips; with the focused disagreement."""
    share = "" if entry.share is None else f"{100 * entry.share:.1f} %"
    if entry.human is None:
        mean = f"proposal, mean probability {share}"
        return mean if share else "proposal"
    words = [f"accuracy {share}"] if share else []
    if entry.edited:
        words.append("edited since the run")
    count = len(entry.marks)
    words.append(f"disagreements: {count}")
    if mark is not None:
        words.append(f"number {mark + 1}, {difference_text(entry.marks[mark])}")
    return "; ".join(words)


def _interval_text(start: float, end: float) -> str:
    return f"{start:.3f}\N{EN DASH}{end:.3f} s"


def _distance(box: QRectF, x: float) -> float:
    """Pixels from a mark; of two that cover the point the narrower is the nearer."""
    if box.left() <= x <= box.right():
        return box.width() / 1e6
    return min(abs(box.left() - x), abs(box.right() - x))


#: How many rows' pictures are kept: some screens of them; more where more are in view.
PICTURES_KEPT = 48
#: How much of the accent the ground of the open demonstration has.
OPEN_TINT = 0.13


class RowPictures:
    """The pictures of the rows seen last, by demonstration."""

    def __init__(self) -> None:
        self._pictures: OrderedDict[str, QPixmap] = OrderedDict()
        #: How many rows were painted so far.
        self.painted = 0

    def clear(self) -> None:
        self._pictures.clear()

    def drop(self, id_: str) -> None:
        self._pictures.pop(id_, None)

    def known(self, id_: str) -> QPixmap | None:
        if id_ in self._pictures:
            self._pictures.move_to_end(id_)
        return self._pictures.get(id_)

    def put(self, id_: str, picture: QPixmap, in_view: int) -> None:
        self._pictures[id_] = picture
        self.painted += 1
        while len(self._pictures) > max(PICTURES_KEPT, in_view):
            self._pictures.popitem(last=False)


#: What one notch of the wheel scrolls by, in pixels.
WHEEL_STEP = 20
#: Seconds that one event may spend on painting rows that were never seen before.
PAINT_BUDGET = 0.004
#: Pixels beside the cursor's place that are drawn anew when it moves.
CURSOR_MARGIN = 2


#: Keys that the list keeps from the window, where arrows move the cursor.
PAGING_KEYS = (Qt.Key.Key_PageUp, Qt.Key.Key_PageDown, Qt.Key.Key_Home, Qt.Key.Key_End)
OWN_KEYS = {*ARROW_STEPS, *PAGING_KEYS, *ENTER_KEYS}


class PairsList(QAbstractScrollArea):
    """The rows of the timeline pairs, scrolled."""

    #: An entry and the Hit in it that was clicked or entered.
    chosen = Signal(object, object)

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.document = document
        self.entries: list[PairEntry] = []
        self.row = -1
        self.mark: int | None = None
        self.pictures = RowPictures()
        self.stretched = False
        self._styles: Mapping[str, LabelStyle] = {}
        self._layout: PairsLayout | None = None
        self._cursor_at: QRect | None = None
        self._opened = document.id
        self.setFrameShape(QAbstractScrollArea.Shape.NoFrame)
        self.setAccessibleName("Timeline pairs")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.viewport().setMouseTracking(True)
        self.viewport().setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.verticalScrollBar().setSingleStep(WHEEL_STEP)
        themes().changed.connect(self.repaint_all)
        document.view.cursor_moved.connect(self._cursor_moved)
        document.demonstration_changed.connect(self._open_changed)
        document.review.examined_changed.connect(self.viewport().update)
        document.demonstration_changed.connect(self.follow)
        document.review.examined_changed.connect(self.follow)

    def minimumSizeHint(self) -> QSize:
        """One row: in a small window the timeline needs the room."""
        return QSize(160, round(text_size.pixels(46)))

    # What is shown

    @property
    def arrangement(self) -> PairsLayout:
        """The rows at the usual text size: at another one all of them are painted so much larger.

        Of the scroll bar and the viewport, one pixel is always a pixel of the screen.
        """
        if self._layout is None:
            width = self.viewport().width() / text_size.scale()
            self._layout = PairsLayout(self.entries, width, self.stretched)
        return self._layout

    def replace_entry(self, new: PairEntry) -> None:
        """Show one row anew; the others stay as they are."""
        for i, old in enumerate(self.entries):
            if old.id == new.id:
                self.entries[i] = new
                self.pictures.drop(new.id)
                if len(old.lanes) != len(new.lanes):
                    self._lay_out()
                if i == self.row:
                    self._check_mark()
        self.viewport().update()
        self._describe()

    def repaint_all(self) -> None:
        self.pictures.clear()
        self._lay_out()
        self.viewport().update()
        self._describe()

    def _lay_out(self) -> None:
        self._layout = None
        page = self.viewport().height()
        bar = self.verticalScrollBar()
        bar.setPageStep(page)
        bar.setRange(0, max(0, round(text_size.pixels(self.arrangement.height)) - page))

    # Painting

    def paintEvent(self, event: QPaintEvent) -> None:
        layout, area, scale = self.arrangement, event.rect(), text_size.scale()
        with QPainter(self.viewport()) as painter:
            offset = self.verticalScrollBar().value()
            painter.fillRect(area, QColor(colours().background))
            # Its room is no row's, so that it waits for none.
            if layout.first_proposal is not None:
                painter.save()
                painter.translate(0, -offset)
                painter.scale(scale, scale)
                self._paint_heading(painter, layout.tops[layout.first_proposal])
                painter.restore()
            ratio, end = self.devicePixelRatioF(), perf_counter() + PAINT_BUDGET
            painted = late = False
            first, last = (area.top() + offset) / scale, (area.bottom() + 1 + offset) / scale
            for row in layout.visible(first, last):
                picture = self.pictures.known(self.entries[row].id)
                if picture is None and painted and perf_counter() > end:
                    late = True
                    continue
                if picture is None:  # one at least, however long the known ones take
                    picture, painted = self._painted(row), True
                top = layout.tops[row] * scale - offset
                painter.drawPixmap(QPointF(0, round(top * ratio) / ratio), picture)
                painter.save()
                painter.translate(0, top)
                painter.scale(scale, scale)
                painter.setRenderHint(QPainter.RenderHint.Antialiasing)
                self._paint_marked(painter, row)
                painter.restore()
        if late:  # the rows without a picture come in the next events
            QTimer.singleShot(0, self.viewport(), self.viewport().update)

    def _painted(self, row: int) -> QPixmap:
        """The picture of a row, painted anew and kept."""
        box, scale = self.arrangement.row_box(row), text_size.scale()
        ratio = self.devicePixelRatioF()
        width, height = (round(side * scale * ratio) for side in (box.width(), box.height()))
        picture = QPixmap(width, height)
        picture.setDevicePixelRatio(ratio)
        with QPainter(picture) as painter:
            painter.scale(scale, scale)
            self._paint_row(painter, row)
        top, page = self.verticalScrollBar().value(), self.viewport().height()
        in_view = self.arrangement.visible(top / scale, (top + page) / scale)
        self.pictures.put(self.entries[row].id, picture, len(in_view))
        return picture

    def _paint_row(self, painter: QPainter, row: int) -> None:
        """Paint a row with its upper left corner at the origin."""
        theme, layout, entry = colours(), self.arrangement, self.entries[row]
        axis, boxes, opened = layout.axis(entry), layout.boxes(row), entry.id == self.document.id
        height = layout.row_height(row)
        ground = mixed(theme.background, theme.accent, OPEN_TINT if opened else 0.0)
        painter.fillRect(QRectF(0, 0, layout.width, height), ground)
        if opened:
            painter.fillRect(QRectF(0, 0, 4, height), QColor(theme.accent))
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if not layout.stretched:
            painter.setPen(QPen(QColor(theme.grid), 1.0))
            spots = [axis.at(value) for value, _ in axis.marks(upright=False)]
            painter.drawLines([QLineF(x, 0, x, height) for x in spots])
        on_track = replace(theme, text=theme.on_unlabelled)
        pair, mark = replace(entry.pair, marks=entry.marks), QColor(theme.trouble)
        paint_pair(painter, boxes, axis, pair, styles=self._styles, theme=on_track, mark=mark)
        self._paint_texts(painter, row, text.font(bold=opened))

    def _paint_texts(self, painter: QPainter, row: int, face: QFont) -> None:
        theme, layout, entry = colours(), self.arrangement, self.entries[row]
        boxes, remark = layout.boxes(row), self._remark(entry)
        middle = (boxes.human.top() + boxes.predicted.bottom()) / 2
        ink, muted, edge = QColor(theme.text), QColor(theme.muted), layout.width - MARGIN
        name = text.elided_name(entry.reviewed.name, face, layout.name_room)
        text.draw_text(painter, MARGIN, middle, name, face=face, ink=ink)
        room = layout.caption_room - 10
        paint_captions(painter, boxes, entry.pair, layout.left - 7, room, muted)
        if entry.share is not None:
            y, share = middle - 6 if remark else middle, f"{100 * entry.share:.1f} %"
            text.draw_text(painter, edge, y, share, face=text.font(), ink=ink, align=1.0)
        if remark:
            y, small = middle + 7 if entry.share is not None else middle, text.font(CAPTION)
            text.draw_text(painter, edge, y, remark, face=small, ink=muted, align=1.0)

    def _paint_marked(self, painter: QPainter, row: int) -> None:
        """Draw what changes more often than the row: examined interval, focus and cursor."""
        layout, entry = self.arrangement, self.entries[row]
        axis, boxes, place = layout.axis(entry), layout.boxes(row), self.document.review.examined
        if place is not None and place.demonstration == entry.id:
            left, right = axis.at(place.start), axis.at(place.end)
            spare = max(8.0 - (right - left), 0.0) / 2 + 2
            frame = QRectF(boxes.human.topLeft(), boxes.predicted.bottomRight())
            frame.setLeft(left - spare)
            frame.setRight(right + spare)
            outline(painter, frame.adjusted(0, -3, 0, 3))
        if row == self.row and self.hasFocus():
            self._paint_focus(painter, row)
        if entry.id == self.document.id:
            x = round(axis.at(self.document.view.cursor)) + 0.5
            bottom = boxes.lanes[-1].bottom() if boxes.lanes else boxes.predicted.bottom()
            painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
            painter.setPen(QPen(QColor(colours().cursor), 1.0))
            painter.drawLine(QLineF(x, boxes.human.top() - 4, x, bottom + 4))
            # The next move takes away what stands here, however it came to stand here.
            self._cursor_at = self._cursor_box()

    def _paint_focus(self, painter: QPainter, row: int) -> None:
        """Frame the focused row, and point at the disagreement that is focused in it."""
        theme, layout, entry = colours(), self.arrangement, self.entries[row]
        pen = QPen(QColor(theme.accent), 2.0)
        pen.setJoinStyle(Qt.PenJoinStyle.MiterJoin)
        painter.setPen(pen)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRect(QRectF(0, 0, layout.width, layout.row_height(row)).adjusted(1, 1, -1, -1))
        if self.mark is None:
            return
        band = layout.boxes(row).band
        centre = difference_box(band, layout.axis(entry), entry.marks[self.mark]).center().x()
        painter.setPen(QPen(QColor(theme.background), 1.0))
        painter.setBrush(QColor(theme.accent))
        for tip, base in ((band.top(), band.top() - 8), (band.bottom(), band.bottom() + 8)):
            painter.drawPolygon(
                [QPointF(centre, tip), QPointF(centre - 6, base), QPointF(centre + 6, base)]
            )

    def _paint_heading(self, painter: QPainter, bottom: float) -> None:
        theme, width = colours(), self.arrangement.width
        box = QRectF(0, bottom - HEADING_HEIGHT, width, HEADING_HEIGHT)
        painter.fillRect(box.adjusted(0, 10, 0, 0), QColor(theme.panel))
        head, face = "Proposals", text.font(bold=True)
        middle = box.center().y() + 5
        text.draw_text(painter, MARGIN, middle, head, face=face, ink=theme.text)
        x = MARGIN + text.width(head, face) + 12
        caption = "predicted where nothing is labelled; at the right: mean probability"
        small = text.font(10)
        caption = text.elided(caption, small, width - MARGIN - x)
        text.draw_text(painter, x, middle, caption, face=small, ink=theme.muted)

    def _remark(self, entry: PairEntry) -> str:
        """What stands below the share: since when it differs, how long it lasts, or what it is."""
        if entry.edited:
            return "edited"
        if self.stretched:
            return f"{entry.reviewed.end - entry.reviewed.start:.1f} s"
        if entry.share is None or entry.human is None:  # a proposal's is told by their heading
            return ""
        return "accuracy"

    def scrollContentsBy(self, dx: int, dy: int) -> None:
        """Move what is painted; only what comes into view is painted anew."""
        if self._cursor_at is not None:  # what is drawn moves along
            self._cursor_at.translate(dx, dy)
        self.viewport().scroll(dx, dy)

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.FontChange:
            self.repaint_all()

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        self.viewport().update()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        self.viewport().update()

    @property
    def focused(self) -> PairEntry | None:
        return self.entries[self.row] if 0 <= self.row < len(self.entries) else None

    def _check_mark(self) -> None:
        entry = self.focused
        if self.mark is not None and (entry is None or self.mark >= len(entry.marks)):
            self.mark = None

    def _describe(self) -> None:
        entry = self.focused
        words = (
            "" if entry is None else f"{entry.reviewed.name}: {entry_description(entry, self.mark)}"
        )
        if words != self.accessibleDescription():
            self.setAccessibleDescription(words)
            changed = QAccessibleEvent(self, QAccessible.Event.DescriptionChanged)
            QAccessible.updateAccessibility(changed)

    # What the document tells

    def _cursor_moved(self, _: float) -> None:
        """Repaint only where the cursor was and is."""
        if not self.isVisible():
            return
        for box in (self._cursor_at, self._cursor_box()):
            if box is not None:
                self.viewport().update(box)
        self._cursor_at = self._cursor_box()

    def _cursor_box(self) -> QRect | None:
        """Around the cursor, in the viewport; None where it is not shown."""
        for row, entry in enumerate(self.entries):
            if entry.id == self.document.id:
                box, scale = self.arrangement.row_box(row), text_size.scale()
                x = round(self.arrangement.axis(entry).at(self.document.view.cursor) * scale)
                top = int(box.top() * scale) - self.verticalScrollBar().value()
                margin, height = round(CURSOR_MARGIN * scale), int(box.height() * scale) + 2
                return QRect(x - margin, top, 2 * margin + 1, height)
        return None

    def _open_changed(self) -> None:
        for id_ in (self._opened, self.document.id):
            self.pictures.drop(id_)
        self._opened = self.document.id
        self.viewport().update()

    def follow(self) -> None:
        """Bring the open demonstration into view."""
        row = next((i for i, e in enumerate(self.entries) if e.id == self.document.id), None)
        if row is None:
            return
        if row != self.row:
            self.row, self.mark = row, None
            self._describe()
        self.reveal(row)
        self.viewport().update()

    def show_entries(
        self, entries: list[PairEntry], styles: Mapping[str, LabelStyle], stretched: bool
    ) -> None:
        """Show these rows; where they have changed, with the open demonstration in view."""
        before = [entry.id for entry in self.entries]
        focused = self.focused
        self.entries, self._styles, self.stretched = entries, styles, stretched
        ids = [entry.id for entry in entries]
        if focused is None or focused.id not in ids:
            self.row = ids.index(self.document.id) if self.document.id in ids else 0
            self.mark = None
        else:
            self.row = ids.index(focused.id)
        self.row = min(self.row, len(ids) - 1)
        self._check_mark()
        self.repaint_all()
        if [entry.id for entry in entries] != before:
            self.follow()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Lay out anew; the focused row stays in view."""
        self.repaint_all()
        if self.row >= 0:
            self.reveal(self.row)

    def hit_at(self, point: QPointF) -> Hit | None:
        at = point + QPointF(0, self.verticalScrollBar().value())
        return hit_test(self.arrangement, at / text_size.scale())

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        hit = self.hit_at(event.position())
        if event.button() != Qt.MouseButton.LeftButton or hit is None:
            return
        self.row, self.mark = hit.row, None
        entry = self.entries[hit.row]
        if hit.target in entry.marks:
            self.mark = entry.marks.index(hit.target)
        self._describe()
        self.viewport().update()
        self.chosen.emit(entry, hit)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        hit = self.hit_at(event.position())
        hand = hit is not None and hit.target is not None
        shape = Qt.CursorShape.PointingHandCursor if hand else Qt.CursorShape.ArrowCursor
        self.viewport().setCursor(shape)

    def viewportEvent(self, event: QEvent) -> bool:
        if event.type() == QEvent.Type.ToolTip and isinstance(event, QHelpEvent):
            hit = self.hit_at(QPointF(event.pos()))
            if hit is None:
                QToolTip.hideText()
            else:
                around = QRect(event.pos() - QPoint(2, 2), event.pos() + QPoint(2, 2))
                words = hit_tooltip(self.entries[hit.row], hit)
                QToolTip.showText(event.globalPos(), words, self.viewport(), around)
            return True
        return super().viewportEvent(event)

    # Keyboard

    def keyPressEvent(self, event: QKeyEvent) -> None:
        entry, key = self.focused, Qt.Key(event.key())
        if entry is None or not is_plain(event):
            super().keyPressEvent(event)
            return
        page = self._page
        rows = {Qt.Key.Key_Up: -1, Qt.Key.Key_Down: 1, Qt.Key.Key_PageUp: -page}
        rows |= {Qt.Key.Key_PageDown: page, Qt.Key.Key_Home: -self.row}
        rows[Qt.Key.Key_End] = len(self.entries)
        if key in rows:
            self._go_to(self.row + rows[key], None)
        elif key in (Qt.Key.Key_Left, Qt.Key.Key_Right):
            step, count = (1 if key == Qt.Key.Key_Right else -1), len(entry.marks)
            begin = (-1 if step > 0 else count) if self.mark is None else self.mark
            if count:
                self._go_to(self.row, min(max(begin + step, 0), count - 1))
        elif key in ENTER_KEYS:
            target = None if self.mark is None else entry.marks[self.mark]
            self.chosen.emit(entry, Hit(self.row, None, target))
        else:
            super().keyPressEvent(event)

    def keeps(self, event: QKeyEvent) -> bool:
        """Whether a key is one of the list's, which the window uses too."""
        return event.key() in OWN_KEYS and is_plain(event) and bool(self.entries)

    def reveal(self, row: int) -> None:
        box, bar = self.arrangement.row_box(row), self.verticalScrollBar()
        top, bottom = text_size.pixels(box.top()), text_size.pixels(box.bottom())
        if top < bar.value():
            bar.setValue(round(top))
        elif bottom > bar.value() + self.viewport().height():
            bar.setValue(round(bottom) - self.viewport().height())

    @property
    def _page(self) -> int:
        height = text_size.pixels(self.arrangement.row_height(self.row))
        return max(1, int(self.viewport().height() // height))

    def _go_to(self, row: int, mark: int | None) -> None:
        self.row, self.mark = min(max(row, 0), len(self.entries) - 1), mark
        self.reveal(self.row)
        self.viewport().update()
        self._describe()
