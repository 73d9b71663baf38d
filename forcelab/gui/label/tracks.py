"""The track panel: tracks of all authors, and the coder's own to paint on."""

from __future__ import annotations

from dataclasses import dataclass
from weakref import ref

from PySide6.QtCore import QPoint, QPointF, QRect, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QContextMenuEvent, QFont, QMouseEvent, QPainter, QPixmap
from PySide6.QtWidgets import QMenu, QSizePolicy

from forcelab.gui.document import Document
from forcelab.gui.figures import text
from forcelab.gui.figures.colormap import translucent
from forcelab.gui.kit import text_size
from forcelab.gui.kit.plot import draw_plate
from forcelab.gui.label.key_labelling import pending
from forcelab.gui.label.segment_commands import zoom_to
from forcelab.gui.label.segment_panel import FREE, SegmentPanel
from forcelab.gui.label.track_gestures import (
    Drag,
    Gesture,
    adjacent_edge,
    begin_gesture,
    snap,
    snap_targets,
    snapped_time,
)
from forcelab.gui.label.track_menus import other_menu, own_menu, range_menu
from forcelab.gui.label.track_painting import origin_text, outline, paint_row, plate_beside
from forcelab.gui.theme import colours
from forcelab.labels import MODEL_PREFIX, Segment, Segments, is_model
from forcelab.segment_edits import index_at, overlapping

#: Stands before the names of models, that no prediction is taken for a coder's label.
MODEL = "\N{WHITE DIAMOND}"
#: What moves a whole segment.
MOVING = Qt.KeyboardModifier.ShiftModifier | Qt.KeyboardModifier.AltModifier


#: Heights in pixels: of the coder's row at least and at most, of another author's row, of the
#: space between rows and around them, and of names in them.
OWN, OWN_MOST, OTHER, BETWEEN, AROUND = 34.0, 64.0, 18.0, 4.0, 5.0
OWN_NAME, OTHER_NAME = 12.0, 10.0
#: The same where room is short: the coder's row, and what the others share, in pixels. Two of them
#: keep their names; more become lower, down to a stripe of colours each.
OWN_COMPACT, OTHERS_COMPACT, STRIPE = 26.0, 30.0, 7.0


@dataclass(frozen=True, slots=True)
class Row:
    """One author's track on screen."""

    author: str
    segments: Segments
    box: QRectF
    own: bool


class TrackPanel(SegmentPanel):
    """One row for each author; the coder's own, at the top, is painted on with the mouse.

    =========================  ====================================================================
    drag                       paints with the brush; without one marks a range and asks with what
    drag an edge               moves it, and that of a neighbour that touches it; it is grabbed from
                               within the segment
    Shift and drag a segment   moves it; so does Alt, which many desktops take for their windows
    Ctrl while dragging        nothing attracts; so does Alt, unless it moves a segment
    Esc while dragging         as if nothing had happened
    click, double click        selects the segment and seeks; zooms to it
    right click                everything else
    =========================  ====================================================================
    """

    #: Asks for playback from one time to another, in seconds.
    play_requested = Signal(float, float)

    def __init__(self, document: Document) -> None:
        super().__init__(document)
        self.setAccessibleName("Tracks of the coders")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)  # its menu is for the keyboard, too
        self._compact = False
        # Other authors' rows stay the same while the coder paints: their pictures are reused.
        self._pictures: dict[str, tuple[tuple[object, ...], QPixmap]] = {}
        self._plated = False  # whether something is written beside a mark
        #: The menu that was opened last.
        self.menu: QMenu | None = None
        for signal in (document.tracks_changed, document.demonstration_changed):
            signal.connect(self._tracks_changed)
        for signal in (document.vocabulary_changed, document.author_changed):
            signal.connect(self.invalidate)
        document.selection_changed.connect(self._selection_changed)

    # Rows

    def rows(self) -> tuple[Row, ...]:
        """The tracks from top to bottom, the coder's own first."""
        document, others, plot = self.document, self.document.other_tracks, self.plot
        least = text_size.pixels(OWN_COMPACT if self._compact else OWN)
        pitch = text_size.pixels(OTHER) + BETWEEN
        room = plot.height() - 2 * AROUND
        if others and self._compact:
            pitch = min(max((room - least) / len(others), STRIPE), pitch)
        gap = min(BETWEEN, pitch / 5)
        high = min(max(room - len(others) * pitch, least), text_size.pixels(OWN_MOST))
        box = QRectF(plot.left(), AROUND, plot.width(), high)
        rows = [Row(document.author, document.editor.segments, box, True)]
        for author, segments in others.items():
            top = rows[-1].box.bottom() + gap
            box = QRectF(plot.left(), top, plot.width(), pitch - gap)
            rows.append(Row(author, segments, box, False))
        return tuple(rows)

    def row_at(self, position: QPointF) -> Row | None:
        """The row under a pixel of the plot, if any."""
        if self.document.demonstration is None or not self.plot.contains(position):
            return None
        return next((r for r in self.rows() if r.box.top() <= position.y() <= r.box.bottom()), None)

    def place_of_edit(self) -> QRect:
        """Where the coder is at work: the own row, from the cursor on."""
        box = self.rows()[0].box
        left = min(max(self.x_at(self.document.view.cursor), box.left()), box.right() - 1)
        return QRectF(left, box.top(), box.right() - left, box.height()).toRect()

    def set_compact(self, compact: bool) -> None:
        """Whether rows become lower where there is no room for all of them."""
        if compact != self._compact:
            self._compact = compact
            self.updateGeometry()
            self.invalidate()

    def least_height(self, *, compact: bool) -> int:
        """How high the rows are at least, in pixels."""
        count = len(self.document.other_tracks)
        if not compact:
            others = count * (text_size.pixels(OTHER) + BETWEEN)
            return round(text_size.pixels(OWN) + 2 * AROUND + others)
        shared = max(min(count, 2) * text_size.pixels(OTHERS_COMPACT) / 2, count * STRIPE)
        return round(text_size.pixels(OWN_COMPACT) + 2 * AROUND + shared)

    def sizeHint(self) -> QSize:
        return QSize(900, self.least_height(compact=False) + 10)

    def minimumSizeHint(self) -> QSize:
        return QSize(self.gutter + 100, self.least_height(compact=self._compact))

    def tooltip_at(self, position: QPointF) -> str:
        """The segment, which may have no room for its name, or the author left of the tracks."""
        if position.x() < self.plot.left():
            row = self.row_at(QPointF(self.plot.left(), position.y()))
            return "" if row is None else row.author
        row = self.row_at(position)
        if row is None:
            return ""
        index = self.hit(self.time_at(position.x()), row.segments).index
        if index is None:
            return ""
        segment = row.segments[index]
        description = f"{row.author}: {_describe(segment)}"
        origin = origin_text(self.document.origins().get(segment)) if row.own else ""
        return f"{description}\n{origin}" if origin else description

    # Drawing

    def paint_content(self, painter: QPainter, plot: QRectF) -> None:
        """Draw every row."""
        painter.fillRect(plot, QColor(colours().background))
        for row in self.rows():
            if row.own:
                self._paint_row(painter, row, row.segments)
            else:
                painter.drawPixmap(0, 0, self._picture_of(row))

    def paint_gutter(self, painter: QPainter, box: QRectF) -> None:
        """Draw the authors' names, those of models marked and in italics."""
        theme = colours()
        painter.fillRect(box, QColor(theme.background))
        for row in self.rows():
            if row.box.height() < text_size.pixels(OTHER_NAME):  # a stripe: its tooltip names it
                continue
            face = QFont(text_size.font(OWN_NAME if row.own else OTHER_NAME + 1, bold=row.own))
            face.setItalic(is_model(row.author))
            name = row.author
            if is_model(name):
                name = f"{MODEL} {name.removeprefix(MODEL_PREFIX)}"
            name = text.elided_name(name, face, box.width() - 14)
            ink = QColor(theme.text if row.own else theme.muted)
            y = row.box.center().y()
            text.draw_text(painter, box.right() - 8, y, name, face=face, ink=ink, align=1.0)

    def paint_overlay(self, painter: QPainter, plot: QRectF) -> None:
        """Draw the drag or the selection, the stroke and the snap target over the coder's row."""
        document = self.document
        if document.demonstration is None:
            return
        painter.setClipRect(plot)
        own_row = self.rows()[0]
        if self._drag is not None and self._drag.live:
            self._paint_drag(painter, own_row, self._drag)
        else:
            self._paint_selection(painter, own_row)
        if document.stroke is not None:
            self._paint_stroke(painter, own_row)
        self._paint_pending(painter, own_row)
        if document.view.hint is not None:
            # Beside the line, which is drawn over everything.
            x = self.x_at(document.view.hint.time) + 8
            self._paint_plate(painter, own_row, x, document.view.hint.kind)

    def _paint_row(self, painter: QPainter, row: Row, segments: Segments) -> None:
        document = self.document
        paint_row(
            painter,
            row.box,
            self.axis,
            segments[overlapping(segments, document.view.start, document.view.end)],
            vocabulary=document.vocabulary,
            theme=colours(),
            size=text_size.pixels(OWN_NAME if row.own else OTHER_NAME),
        )

    def _picture_of(self, row: Row) -> QPixmap:
        """A picture of a row that changes seldom, made anew only when it looks different."""
        document, ratio = self.document, self.devicePixelRatioF()
        span = (document.view.start, document.view.end, self.size(), ratio)
        key = (row, span, document.vocabulary, colours(), text_size.scale())
        cached = self._pictures.get(row.author)
        if cached is not None and cached[0] == key:
            return cached[1]
        picture = QPixmap(self.size() * ratio)
        picture.setDevicePixelRatio(ratio)
        picture.fill(Qt.GlobalColor.transparent)
        with QPainter(picture) as painter:
            self._paint_row(painter, row, row.segments)
        self._pictures[row.author] = key, picture
        return picture

    def _paint_selection(self, painter: QPainter, own_row: Row) -> None:
        """Draw a frame around the selected segment, or say how to make the first one."""
        if not own_row.segments and self.document.stroke is None:
            self._paint_invitation(painter, own_row.box)
        selected = self.document.selected
        if selected is not None and selected < len(own_row.segments):
            segment = own_row.segments[selected]
            outline(painter, self._bar(own_row.box, segment.start, segment.end))

    def _paint_drag(self, painter: QPainter, own_row: Row, drag: Drag) -> None:
        """Draw what a drag would make of the track, and how long that is."""
        gesture = drag.gesture
        after = gesture.preview(own_row.segments)
        start, end = gesture.span
        if after is not own_row.segments:
            self._paint_row(painter, own_row, after)
        if end > start:
            bar = self._bar(own_row.box, start, end)
            outline(painter, bar)
            label = f"{gesture.action} {start:.3f}–{end:.3f} s ({end - start:.3f} s)".lstrip()
            at = plate_beside(bar, label, drag.pointer, own_row.box)
            draw_plate(painter, at, label, own_row.box, centred=True)

    def _paint_stroke(self, painter: QPainter, own_row: Row) -> None:
        """Draw what a key has begun, up to the cursor."""
        stroke = self.document.stroke
        assert stroke is not None
        start, end = sorted((stroke.start, self.document.view.cursor))
        if end <= start:
            return
        bar = self._bar(own_row.box, start, end)
        painter.save()
        painter.setClipRect(bar, Qt.ClipOperation.IntersectClip)
        self._paint_row(painter, own_row, (Segment(start, end, stroke.action),))
        painter.restore()
        outline(painter, bar)

    def _paint_pending(self, painter: QPainter, own_row: Row) -> None:
        """Say in the row what was begun and how it is ended."""
        if (begun := pending(self.document)) is None:
            return
        face = text_size.font(10)
        room = self.plot.width() - text.width(begun.how, face) - 18
        label = text.elided_name(begun.what, face, room) + begun.how
        self._paint_plate(painter, own_row, self.x_at(begun.start) + 12, label)

    def _paint_plate(self, painter: QPainter, own_row: Row, left: float, label: str) -> None:
        """Say something at the foot of the row, from `left` on."""
        x = left + text.width(label, text_size.font(10)) / 2
        foot = QPointF(x, own_row.box.bottom() - text_size.pixels(10))
        draw_plate(painter, foot, label, self.plot, centred=True)

    def _paint_invitation(self, painter: QPainter, box: QRectF) -> None:
        """Say how to begin, in a row that is empty."""
        sentence = (
            "Drag here to paint, or press the key of an action to begin."
            if self.document.vocabulary
            else "Drag here and choose an action, or add one under Actions."
        )
        face = text_size.font(OWN_NAME)
        sentence = text.elided(sentence, face, box.width() - 20)
        centre, ink = box.center(), translucent(colours().on_unlabelled, 0.72)
        text.draw_text(painter, centre.x(), centre.y(), sentence, face=face, ink=ink, align=0.5)

    def _bar(self, box: QRectF, start: float, end: float) -> QRectF:
        """Where a span lies in a row, at least so wide that its outline is seen."""
        # What is far outside is cut: its frame must be straight at any zoom.
        left, right = (
            min(max(self.x_at(time), box.left() - 10), box.right() + 10) for time in (start, end)
        )
        return QRectF(left, box.top(), max(right - left, 4.0), box.height())

    # Mouse

    def gesture_at(self, event: QMouseEvent) -> Gesture | None:
        row = self.row_at(event.position())
        if row is None or not row.own:
            return None
        document, time = self.document, self.time_at(event.position().x())
        free = bool(event.modifiers() & FREE)
        start = snapped_time(document, time, self.seconds_per_pixel, free=free)
        if not free and (edge := adjacent_edge(document, time, self.seconds_per_pixel)) is not None:
            start = edge.time
        moving = bool(event.modifiers() & MOVING)
        return begin_gesture(document, time, self.hit(time), start, moving=moving)

    def mark(self, event: QMouseEvent) -> None:
        """Ask what the marked range is."""
        if self.document.view.range is not None:
            # It stays where the menu is shut without a choice.
            self.document.show_message(
                "Choose an action for the marked range, or press its key; Esc shuts the list."
            )
            self.show_menu(range_menu(self, self.document), event.globalPosition().toPoint())

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Zoom to the segment under the pointer."""
        row, time = self.row_at(event.position()), self.time_at(event.position().x())
        if row is None or event.button() != Qt.MouseButton.LeftButton:
            return
        index = self.hit(time, row.segments).index if row.own else index_at(row.segments, time)
        if index is not None:
            zoom_to(self.document, row.segments[index].start, row.segments[index].end)

    def click(self, event: QMouseEvent) -> None:
        """Select the segment under the pointer, and go there."""
        document, pointed = self.document, self.time_at(event.position().x())
        target = self.hit(pointed)
        document.view.clear_range()
        free = bool(event.modifiers() & FREE)
        time = snapped_time(document, pointed, self.seconds_per_pixel, free=free)
        if target.index is not None:
            # A key relabels the segment that the cursor is in, however short that is.
            segment = document.editor.segments[target.index]
            time = min(max(time, segment.start), segment.end)
        document.view.seek(time)
        document.select(target.index)

    def point(self, position: QPointF, modifiers: Qt.KeyboardModifier) -> None:
        document, row = self.document, self.row_at(position)
        if row is None or not row.own:
            self.unsetCursor()
            document.view.set_hint(None)
            return
        time, pixel = self.time_at(position.x()), self.seconds_per_pixel
        target = self.hit(time)
        if target.edge is not None:
            self.setCursor(Qt.CursorShape.SplitHCursor)
        elif target.index is not None and modifiers & MOVING:
            self.setCursor(Qt.CursorShape.SizeAllCursor)
        elif document.action is not None or target.index is None:
            self.setCursor(Qt.CursorShape.CrossCursor)
        else:
            self.unsetCursor()
        hint = None
        if document.view.snapping and not modifiers & FREE and target.edge is None:
            hint = adjacent_edge(document, time, pixel)
            if hint is None:
                hint = snap(time, 1 / pixel, snap_targets(document))
        document.view.set_hint(hint)

    # Keyboard and menus

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """Open the menu of what is under the pointer; by the keyboard, of what the cursor is on."""
        if self.document.demonstration is None:
            return
        row, time = self.row_at(QPointF(event.pos())), self.time_at(event.pos().x())
        where = event.globalPos()
        if event.reason() == QContextMenuEvent.Reason.Keyboard:
            row, time = self.rows()[0], self.document.view.cursor
            where = self.mapToGlobal(QPointF(self.x_at(time), row.box.bottom()).toPoint())
        if row is not None:
            self.show_menu(self.menu_at(row, time), where)

    def menu_at(self, row: Row, time: float) -> QMenu:
        """The menu of a row at a time in seconds."""
        # A menu must not keep its panel alive: its own end would then be the panel's, which ends
        # the menu a second time.
        panel_ref = ref(self)

        def play(start: float, end: float) -> None:
            if (panel := panel_ref()) is not None:
                panel.play_requested.emit(start, end)

        if not row.own:
            return other_menu(self, self.document, row.author, time, play)
        index = self.hit(time, row.segments).index
        if index is not None:
            self.document.select(index)
        return own_menu(self, self.document, time, play)

    def show_menu(self, menu: QMenu, where: QPoint) -> None:
        """Show a menu without waiting for it; its default entry is ready for Enter."""
        if self.menu is not None:
            self.menu.close()
        self.menu = menu
        menu.aboutToHide.connect(self._menu_hides)
        menu.popup(where)
        if (default := menu.defaultAction()) is not None:
            menu.setActiveAction(default)

    def _menu_hides(self) -> None:
        """Delete the menu, once what was chosen in it is done."""
        if self.menu is not None:
            self.menu.deleteLater()
            self.menu = None

    # The document

    def _marks_moved(self, *_: object) -> None:
        """Draw all rows anew while there is a mark with a plate, which is as wide as its text."""
        document, before = self.document, self._plated
        waiting = document.view.range_start is not None
        hinted = document.view.hint is not None
        self._plated = waiting or hinted or document.stroke is not None
        if before or self._plated:
            self.update()
        else:
            super()._marks_moved()

    def _tracks_changed(self) -> None:
        """Draw anew, with room for every row."""
        others = self.document.other_tracks
        self._pictures = {
            author: picture for author, picture in self._pictures.items() if author in others
        }
        self.updateGeometry()
        self.invalidate()

    def _selection_changed(self) -> None:
        """Frame another segment, and tell screen readers which."""
        selected, segments = self.document.selected, self.document.editor.segments
        exists = selected is not None and selected < len(segments)
        self.setAccessibleDescription(_describe(segments[selected or 0]) if exists else "")
        self.update()


def _describe(segment: Segment) -> str:
    return f"{segment.action} {segment.start:.3f}–{segment.end:.3f} s ({segment.duration:.3f} s)"
