"""The rows of the tracks: the coder's own at the top, and below it those of the others."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFont, QHelpEvent, QPainter, QPixmap
from PySide6.QtWidgets import QSizePolicy, QToolTip

from forcelab.gui.document import Document
from forcelab.gui.figures import text
from forcelab.gui.figures.shades import translucent
from forcelab.gui.label.proposed import origin_words
from forcelab.gui.label.track_hits import hit
from forcelab.gui.label.track_painting import outline, paint_row, put_plate, visible
from forcelab.gui.panel import TimePanel
from forcelab.gui.theme import colours
from forcelab.labels import MODEL_PREFIX, Segment, Segments, is_model

__all__ = ["Row", "TrackRows"]

#: Heights in pixels: of the coder's row at least and at most, of another author's row, of the
#: space between rows and around them, and of names in them.
OWN, OWN_MOST, OTHER, BETWEEN, AROUND = 34.0, 64.0, 18.0, 4.0, 5.0
OWN_NAME, OTHER_NAME = 12.0, 10.0
#: The same where room is short: the coder's row, and what the others share, in pixels. Two of them
#: keep their names; more become lower, down to a stripe of colours each.
OWN_SLIM, OTHERS_SLIM, STRIPE = 26.0, 30.0, 7.0
#: Stands before the names of models, that no prediction is taken for a coder's label.
MODEL = "\N{WHITE DIAMOND}"


@dataclass(frozen=True, slots=True)
class Row:
    """One author's track on screen."""

    author: str
    segments: Segments
    box: QRectF
    own: bool


class TrackRows(TimePanel):
    """One row for each author, to look at."""

    def __init__(self, document: Document) -> None:
        super().__init__(document)
        self.setAccessibleName("Tracks of the coders")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        # Other authors' rows stay the same while one paints: pictures of them are kept.
        self._kept: dict[str, tuple[tuple[object, ...], QPixmap]] = {}
        self._slim = False
        for signal in (document.tracks_changed, document.demonstration_changed):
            signal.connect(self._tracks_changed)
        for signal in (document.vocabulary_changed, document.author_changed):
            signal.connect(self.invalidate)
        document.selection_changed.connect(self._selection_changed)

    # Where things are

    def rows(self) -> tuple[Row, ...]:
        """The tracks from top to bottom."""
        document, plot = self.document, self.plot
        others = document.others
        least, pitch = OWN_SLIM if self._slim else OWN, OTHER + BETWEEN
        room = self.height() - 2 * AROUND
        if others and self._slim:
            pitch = min(max((room - least) / len(others), STRIPE), pitch)
        between = min(BETWEEN, pitch / 5)
        top, high = AROUND, min(max(room - len(others) * pitch, least), OWN_MOST)
        rows = [
            Row(
                document.author,
                document.segments,
                QRectF(plot.left(), top, plot.width(), high),
                True,
            )
        ]
        for author, segments in others.items():
            top = rows[-1].box.bottom() + between
            box = QRectF(plot.left(), top, plot.width(), pitch - between)
            rows.append(Row(author, segments, box, False))
        return tuple(rows)

    def set_slim(self, slim: bool) -> None:
        """Whether rows become lower where there is no room for all of them."""
        if slim != self._slim:
            self._slim = slim
            self.updateGeometry()
            self.invalidate()

    def least_height(self, slim: bool) -> int:
        """How high the rows are at least, in pixels."""
        count = len(self.document.others)
        if not slim:
            return round(OWN + 2 * AROUND + count * (OTHER + BETWEEN))
        shared = max(min(count, 2) * OTHERS_SLIM / 2, count * STRIPE)
        return round(OWN_SLIM + 2 * AROUND + shared)

    def sizeHint(self) -> QSize:
        """Room for every row."""
        return QSize(900, self.least_height(slim=False) + 10)

    def minimumSizeHint(self) -> QSize:
        """Room for every row, the own one at its slimmest."""
        return QSize(self.GUTTER + 100, self.least_height(self._slim))

    def row_at(self, position: QPointF) -> Row | None:
        """The row under a pixel of the plot, if any."""
        if self.document.demonstration is None or not self.plot.contains(position):
            return None
        return next((r for r in self.rows() if r.box.top() <= position.y() <= r.box.bottom()), None)

    def event(self, event: QEvent) -> bool:
        """Say what is under the pointer: narrow segments have no room for their names."""
        if event.type() == QEvent.Type.ToolTip and isinstance(event, QHelpEvent):
            QToolTip.showText(event.globalPos(), self.words_at(QPointF(event.pos())), self)
            return True
        return super().event(event)

    def words_at(self, position: QPointF) -> str:
        """What is under a pixel in words: a segment, or left of the tracks an author."""
        if position.x() < self.plot.left():
            author = self.row_at(QPointF(self.plot.left(), position.y()))
            return "" if author is None else author.author
        row = self.row_at(position)
        if row is None:
            return ""
        time = self.time_at(position.x())
        index = hit(row.segments, time, self.seconds_per_pixel).index
        if index is None:
            return ""
        segment = row.segments[index]
        words = f"{row.author}: {_said(segment)}"
        proposed = origin_words(self.document.origins().get(segment)) if row.own else ""
        return f"{words}\n{proposed}" if proposed else words

    # Drawing

    def paint_content(self, painter: QPainter, plot: QRectF) -> None:
        """Draw every row."""
        painter.fillRect(plot, QColor(colours().background))
        for row in self.rows():
            if row.own:
                self._paint_row(painter, row, row.segments)
            else:
                self._paint_kept(painter, row)

    def gutter_shows(self) -> object:
        """Authors, and where their rows are."""
        return tuple((row.author, row.box.top(), row.box.height(), row.own) for row in self.rows())

    def paint_gutter(self, painter: QPainter, box: QRectF) -> None:
        """Draw the authors' names, those of models marked and in italics."""
        now = colours()
        for row in self.rows():
            if row.box.height() < OTHER_NAME:  # a stripe: its tooltip names it
                continue
            face = QFont(text.font(OWN_NAME if row.own else OTHER_NAME + 1, bold=row.own))
            face.setItalic(is_model(row.author))
            name = row.author
            if is_model(name):
                name = f"{MODEL} {name.removeprefix(MODEL_PREFIX)}"
            name = text.elided_name(name, face, box.width() - 14)
            ink = QColor(now.text if row.own else now.muted)
            y = row.box.center().y()
            text.put(painter, box.right() - 8, y, name, face=face, ink=ink, align=1.0)

    def paint_overlay(self, painter: QPainter, plot: QRectF) -> None:
        """Draw the drag, the stroke and the selection over the coder's row."""
        document = self.document
        if document.demonstration is None:
            return
        painter.setClipRect(plot)
        own = self.rows()[0]
        self._paint_marked(painter, own)
        if document.stroke is not None:
            self._paint_stroke(painter, own)
        if document.hint is not None:
            word = self._word(document.hint.kind)
            # Beside the line, which is drawn over everything.
            x = self.x_at(document.hint.time) + text.width(word, text.font(10)) / 2 + 8
            put_plate(painter, QPointF(x, own.box.bottom() - 10), word, colours(), plot)

    def _paint_invitation(self, painter: QPainter, box: QRectF) -> None:
        """Say how to begin, in a row that is empty."""
        words = (
            "Drag here to paint, or press the key of an action to begin."
            if self.document.vocabulary
            else "Drag here and choose an action, or add one under Actions."
        )
        face = text.font(OWN_NAME)
        words = text.elided(words, face, box.width() - 20)
        centre, ink = box.center(), translucent(colours().on_unlabelled, 0.72)
        text.put(painter, centre.x(), centre.y(), words, face=face, ink=ink, align=0.5)

    def _marks_moved(self, *_: object) -> None:
        """Draw all rows anew: what stands beside a mark is as wide as it is worded."""
        self.update()

    def _paint_row(self, painter: QPainter, row: Row, segments: Segments) -> None:
        """Draw some segments in a row."""
        document = self.document
        seen = visible(segments, document.start, document.end)
        paint_row(
            painter,
            row.box,
            self.axis,
            seen,
            vocabulary=document.vocabulary,
            theme=colours(),
            size=OWN_NAME if row.own else OTHER_NAME,
        )

    def _paint_kept(self, painter: QPainter, row: Row) -> None:
        """Draw a row that changes seldom, from a picture as long as it is the same."""
        document, ratio = self.document, self.devicePixelRatioF()
        seen = (document.start, document.end, self.size(), ratio)
        now = (row, seen, document.vocabulary, colours())
        kept = self._kept.get(row.author)
        if kept is None or kept[0] != now:
            picture = QPixmap(self.size() * ratio)
            picture.setDevicePixelRatio(ratio)
            picture.fill(Qt.GlobalColor.transparent)
            with QPainter(picture) as drawing:
                self._paint_row(drawing, row, row.segments)
            self._kept[row.author] = kept = (now, picture)
        painter.drawPixmap(0, 0, kept[1])

    def _paint_marked(self, painter: QPainter, own: Row) -> None:
        """Draw a frame around the selected segment, or say how to make the first one."""
        if not own.segments and self.document.stroke is None:
            self._paint_invitation(painter, own.box)
        selected = self.document.selected
        if selected is not None and selected < len(own.segments):
            segment = own.segments[selected]
            outline(painter, self._bar(own.box, segment.start, segment.end), colours())

    def _paint_stroke(self, painter: QPainter, own: Row) -> None:
        """Draw what a key has begun, up to the cursor."""
        stroke = self.document.stroke
        assert stroke is not None
        start, end = sorted((stroke.start, self.document.cursor))
        if end <= start:
            return
        growing = (Segment(start, end, stroke.action),)
        bar = self._bar(own.box, start, end)
        painter.save()
        painter.setClipRect(bar, Qt.ClipOperation.IntersectClip)
        self._paint_row(painter, own, growing)
        painter.restore()
        outline(painter, bar, colours())

    def _bar(self, box: QRectF, start: float, end: float) -> QRectF:
        """Where a stretch lies in a row, at least so wide that its outline is seen."""
        # What is far outside is cut: its frame must be straight at any zoom.
        left, right = (
            min(max(self.x_at(time), box.left() - 10), box.right() + 10) for time in (start, end)
        )
        return QRectF(left, box.top(), max(right - left, 4.0), box.height())

    def _word(self, kind: str) -> str:
        """What a snap target is called on screen."""
        words = {
            "contact": "contact",
            "edge": "edge",
            "frame": "frame",
            "sample": "sample",
        }
        return words[kind]

    def _tracks_changed(self) -> None:
        """Draw anew, with room for every row."""
        others = self.document.others
        self._kept = {author: kept for author, kept in self._kept.items() if author in others}
        self.updateGeometry()
        self.invalidate()

    def _selection_changed(self) -> None:
        """Frame another segment, and tell screen readers which."""
        selected, segments = self.document.selected, self.document.segments
        there = selected is not None and selected < len(segments)
        self.setAccessibleDescription(_said(segments[selected or 0]) if there else "")
        self.update()


def _said(segment: Segment) -> str:
    """A segment in words."""
    return f"{segment.action} {segment.start:.3f}–{segment.end:.3f} s ({segment.duration:.3f} s)"
