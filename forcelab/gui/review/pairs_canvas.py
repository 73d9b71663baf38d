"""The scrolled list of timeline pairs: only rows in view are painted, each once."""

from __future__ import annotations

from collections.abc import Mapping
from time import perf_counter

from PySide6.QtCore import QLineF, QPointF, QRect, QRectF, QSize, Qt, QTimer
from PySide6.QtGui import (
    QAccessible,
    QAccessibleEvent,
    QColor,
    QFocusEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPixmap,
    QResizeEvent,
)
from PySide6.QtWidgets import QAbstractScrollArea

from forcelab.gui.document import Document
from forcelab.gui.figures import text
from forcelab.gui.figures.tracks import Look
from forcelab.gui.review.pairs_hits import described
from forcelab.gui.review.pairs_layout import HEADING, MARGIN, Layout
from forcelab.gui.review.pairs_painting import RowPictures, paint_examined, paint_focus
from forcelab.gui.review.pairs_rows import Entry
from forcelab.gui.theme import colours, themes

__all__ = ["PairsCanvas"]

#: What one notch of the wheel scrolls by, in pixels.
STEP = 20
#: Seconds that one event may spend on painting rows that were never seen before.
BUDGET = 0.004
#: How many screens above and below are painted before they are scrolled to.
AHEAD = 0.7
#: Pixels beside the cursor's place that are drawn anew when it moves.
BESIDE = 2


class PairsCanvas(QAbstractScrollArea):
    """The rows, scrolled; see :class:`~forcelab.gui.review.pairs_area.PairsArea` for its hands.

    Parameters
    ----------
    document : Document
        Whose open demonstration, cursor and examined place are shown.

    Attributes
    ----------
    entries : list of Entry
        The rows from top to bottom.
    row : int
        Which of them has the keyboard's focus; -1 without rows.
    mark : int or None
        Which of its disagreements.
    """

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.document = document
        self.entries: list[Entry] = []
        self.row = -1
        self.mark: int | None = None
        self.pictures = RowPictures()
        self.stretched = False
        self._looks: Mapping[str, Look] = {}
        self._layout: Layout | None = None
        self._cursor_at: QRect | None = None
        self._opened = document.id
        self._scrolled = False
        self._skipped: set[str] = set()
        self._ahead = QTimer(self, singleShot=True, interval=0)
        self._ahead.timeout.connect(self._paint_ahead)
        self.setFrameShape(QAbstractScrollArea.Shape.NoFrame)
        self.setAccessibleName("Timeline pairs")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.viewport().setMouseTracking(True)
        self.viewport().setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.verticalScrollBar().setSingleStep(STEP)
        themes().changed.connect(self.repaint_all)
        document.cursor_moved.connect(self._cursor_moved)
        document.demonstration_changed.connect(self._open_changed)
        document.examined_changed.connect(self.viewport().update)

    def minimumSizeHint(self) -> QSize:
        """One row: in a small window the timeline needs the room."""
        return QSize(160, 46)

    # What is shown

    @property
    def names(self) -> tuple[str, str]:
        """What the two bars of a pair are called."""
        return "human", "predicted"

    @property
    def arrangement(self) -> Layout:
        """Where everything lies."""
        if self._layout is None:
            width = self.viewport().width()
            self._layout = Layout(self.entries, width, self.stretched, self.names)
        return self._layout

    def show_entries(
        self, entries: list[Entry], looks: Mapping[str, Look], stretched: bool
    ) -> None:
        """Show these rows; the focus stays with its demonstration."""
        focused = self.focused
        self.entries, self._looks, self.stretched = entries, looks, stretched
        ids = [entry.id for entry in entries]
        if focused is None or focused.id not in ids:
            self.row = ids.index(self.document.id) if self.document.id in ids else 0
            self.mark = None
        else:
            self.row = ids.index(focused.id)
        self.row = min(self.row, len(ids) - 1)
        self._check_mark()
        self.repaint_all()

    def replace_entry(self, new: Entry) -> None:
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
        """Everything looks different now."""
        self.pictures.clear()
        self._lay_out()
        self.viewport().update()
        self._describe()

    def _lay_out(self) -> None:
        """Say anew where everything lies."""
        self._layout = None
        page = self.viewport().height()
        bar = self.verticalScrollBar()
        bar.setPageStep(page)
        bar.setRange(0, max(0, round(self.arrangement.height) - page))

    # Painting

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the rows in view."""
        layout, area = self.arrangement, event.rect()
        with QPainter(self.viewport()) as painter:
            offset = self.verticalScrollBar().value()
            painter.fillRect(area, QColor(colours().background))
            ratio, began = self.devicePixelRatioF(), perf_counter()
            for row in layout.visible(area.top() + offset, area.bottom() + 1 + offset):
                opened = self.entries[row].id == self.document.id
                picture = self.pictures.known(self.entries[row].id)
                if picture is None and not self._scrolled and perf_counter() - began < BUDGET:
                    picture = self._painted(row)
                if picture is None:
                    # It comes with an event of its own, so that scrolling never waits. That is
                    # noted: an event that shows a part of it may be the one in which it is painted.
                    self._skipped.add(self.entries[row].id)
                    continue
                top = layout.tops[row] - offset
                painter.drawPixmap(QPointF(0, round(top * ratio) / ratio), picture)
                if row == layout.first_proposal:
                    self._paint_heading(painter, top)
                painter.save()
                painter.translate(0, top)
                painter.setRenderHint(QPainter.RenderHint.Antialiasing)
                self._paint_marked(painter, layout, row, opened)
                painter.restore()
            self._scrolled = False
            self._ahead.start()

    def _painted(self, row: int) -> QPixmap:
        """Paint a row's picture."""
        entry = self.entries[row]
        opened, ratio = entry.id == self.document.id, self.devicePixelRatioF()
        remark = self._remark(entry)
        return self.pictures.paint(self.arrangement, row, self._looks, opened, ratio, remark)

    def _paint_ahead(self) -> None:
        """Paint one row that is in view or may come there next, and so on until all are there."""
        if not self.isVisible():
            return
        top, page = self.verticalScrollBar().value(), self.viewport().height()
        seen = self.arrangement.visible(top, top + page)
        near = self.arrangement.visible(top - AHEAD * page, top + (1 + AHEAD) * page)
        for row in (*seen, *(row for row in near if row not in seen)):
            id_ = self.entries[row].id
            unknown = self.pictures.known(id_) is None
            if unknown:
                self._painted(row)
            if unknown or id_ in self._skipped:
                self._skipped.discard(id_)
                if row in seen:
                    box = self.arrangement.row_box(row).translated(0, -top)
                    self.viewport().update(box.toAlignedRect())
                self._ahead.start()
                return

    def _paint_marked(self, painter: QPainter, layout: Layout, row: int, opened: bool) -> None:
        """Draw what changes more often than the row: examined place, focus and cursor."""
        place = self.document.examined
        if place is not None and place.demonstration == layout.entries[row].id:
            paint_examined(painter, layout, row, place.start, place.end)
        if row == self.row and self.hasFocus():
            marks = layout.entries[row].marks
            paint_focus(painter, layout, row, None if self.mark is None else marks[self.mark])
        if opened:
            boxes = layout.boxes(row)
            x = round(layout.axis(layout.entries[row]).at(self.document.cursor)) + 0.5
            bottom = boxes.lanes[-1].bottom() if boxes.lanes else boxes.predicted.bottom()
            painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
            painter.setPen(QPen(QColor(colours().cursor), 1.0))
            painter.drawLine(QLineF(x, boxes.human.top() - 4, x, bottom + 4))
            # The next move takes away what stands here, however it came to stand here.
            self._cursor_at = self._cursor_box()

    def _paint_heading(self, painter: QPainter, bottom: float) -> None:
        """Draw the heading of the proposals."""
        theme, width = colours(), self.viewport().width()
        box = QRectF(0, bottom - HEADING, width, HEADING)
        painter.fillRect(box.adjusted(0, 10, 0, 0), QColor(theme.panel))
        head, face = "Proposals", text.font(bold=True)
        middle = box.center().y() + 5
        text.put(painter, MARGIN, middle, head, face=face, ink=QColor(theme.text))
        x = MARGIN + text.width(head, face) + 12
        what = "predicted where nothing is labelled; at the right: mean probability"
        small = text.font(10)
        what = text.elided(what, small, width - MARGIN - x)
        text.put(painter, x, middle, what, face=small, ink=QColor(theme.muted))

    def _remark(self, entry: Entry) -> str:
        """What stands below the share: since when it differs, how long it lasts, or what it is."""
        if entry.edited:
            return "edited"
        if self.stretched:
            return f"{entry.reviewed.end - entry.reviewed.start:.1f} s"
        if entry.share is None or entry.human is None:  # a proposal's is told by their heading
            return ""
        return "accuracy"

    def scrollContentsBy(self, dx: int, dy: int) -> None:
        """Move what is there; only what comes into view is painted."""
        self._scrolled = True
        if self._cursor_at is not None:  # what is drawn moves along
            self._cursor_at.translate(dx, dy)
        self.viewport().scroll(dx, dy)

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Show where the keyboard is."""
        super().focusInEvent(event)
        self.viewport().update()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """The keyboard is elsewhere."""
        super().focusOutEvent(event)
        self.viewport().update()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Lay out anew."""
        self.repaint_all()

    @property
    def focused(self) -> Entry | None:
        """The row with the keyboard's focus."""
        return self.entries[self.row] if 0 <= self.row < len(self.entries) else None

    def _check_mark(self) -> None:
        """Focus no disagreement that is there no more."""
        entry = self.focused
        if self.mark is not None and (entry is None or self.mark >= len(entry.marks)):
            self.mark = None

    def _describe(self) -> None:
        """Tell screen readers what has the focus."""
        entry = self.focused
        words = "" if entry is None else f"{entry.reviewed.name}: {described(entry, self.mark)}"
        if words != self.accessibleDescription():
            self.setAccessibleDescription(words)
            changed = QAccessibleEvent(self, QAccessible.Event.DescriptionChanged)
            QAccessible.updateAccessibility(changed)

    # What the document tells

    def _cursor_moved(self, _: float) -> None:
        """Draw the cursor where it is now, and nothing else."""
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
                box = self.arrangement.row_box(row)
                x = round(self.arrangement.axis(entry).at(self.document.cursor))
                top = int(box.top()) - self.verticalScrollBar().value()
                return QRect(x - BESIDE, top, 2 * BESIDE + 1, int(box.height()) + 2)
        return None

    def _open_changed(self) -> None:
        """Another demonstration is the open one."""
        for id_ in (self._opened, self.document.id):
            self.pictures.drop(id_)
        self._opened = self.document.id
        self.viewport().update()
