"""The list of timeline pairs under mouse and keyboard."""

from __future__ import annotations

from collections.abc import Mapping

from PySide6.QtCore import QEvent, QPoint, QPointF, QRect, Qt, Signal
from PySide6.QtGui import QHelpEvent, QKeyEvent, QMouseEvent, QResizeEvent
from PySide6.QtWidgets import QToolTip

from forcelab.gui.document import Document
from forcelab.gui.figures.tracks import Look
from forcelab.gui.review.moving import ARROWS, ENTER, plain
from forcelab.gui.review.pairs_canvas import PairsCanvas
from forcelab.gui.review.pairs_hits import Hit, hit, told
from forcelab.gui.review.pairs_rows import Entry

__all__ = ["PairsArea"]

#: Keys that the list keeps from the window, where arrows move the cursor.
PAGING = (Qt.Key.Key_PageUp, Qt.Key.Key_PageDown, Qt.Key.Key_Home, Qt.Key.Key_End)
OWN = {*ARROWS, *PAGING, *ENTER}


class PairsArea(PairsCanvas):
    """The rows of the timeline pairs.

    Signals
    -------
    chosen(Entry, Hit)
        Somebody wants to go to what is there.
    """

    chosen = Signal(object, object)

    def __init__(self, document: Document) -> None:
        super().__init__(document)
        document.demonstration_changed.connect(self.follow)
        document.examined_changed.connect(self.follow)

    def follow(self) -> None:
        """Have the open demonstration in view, whoever opened it."""
        row = next((i for i, e in enumerate(self.entries) if e.id == self.document.id), None)
        if row is None:
            return
        if row != self.row:
            self.row, self.mark = row, None
            self._describe()
        self.reveal(row)
        self.viewport().update()

    def show_entries(
        self, entries: list[Entry], looks: Mapping[str, Look], stretched: bool
    ) -> None:
        """Show these rows; where they are other ones, with the open demonstration in view."""
        before = [entry.id for entry in self.entries]
        super().show_entries(entries, looks, stretched)
        if [entry.id for entry in entries] != before:
            self.follow()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Lay out anew; the row with the focus stays in view."""
        super().resizeEvent(event)
        if self.row >= 0:
            self.reveal(self.row)

    def hit_at(self, point: QPointF) -> Hit | None:
        """What is at a point of the viewport."""
        return hit(self.arrangement, point + QPointF(0, self.verticalScrollBar().value()))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Go to what was clicked."""
        found = self.hit_at(event.position())
        if event.button() != Qt.MouseButton.LeftButton or found is None:
            return
        self.row, self.mark = found.row, None
        entry = self.entries[found.row]
        if found.what in entry.marks:
            self.mark = entry.marks.index(found.what)
        self._describe()
        self.viewport().update()
        self.chosen.emit(entry, found)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Show by the pointer what can be clicked."""
        found = self.hit_at(event.position())
        hand = found is not None and found.what is not None
        shape = Qt.CursorShape.PointingHandCursor if hand else Qt.CursorShape.ArrowCursor
        self.viewport().setCursor(shape)

    def viewportEvent(self, event: QEvent) -> bool:
        """Tell what is under the pointer."""
        if event.type() == QEvent.Type.ToolTip and isinstance(event, QHelpEvent):
            found = self.hit_at(QPointF(event.pos()))
            if found is None:
                QToolTip.hideText()
            else:
                around = QRect(event.pos() - QPoint(2, 2), event.pos() + QPoint(2, 2))
                words = told(self.entries[found.row], found)
                QToolTip.showText(event.globalPos(), words, self.viewport(), around)
            return True
        return super().viewportEvent(event)

    # Keyboard

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Up and Down for rows, Left and Right for disagreements, Enter to go there."""
        entry, key = self.focused, Qt.Key(event.key())
        if entry is None or not plain(event):
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
        elif key in ENTER:
            what = None if self.mark is None else entry.marks[self.mark]
            self.chosen.emit(entry, Hit(self.row, None, what))
        else:
            super().keyPressEvent(event)

    def keeps(self, event: QKeyEvent) -> bool:
        """Whether a key is one of the list's, which are the window's too."""
        return event.key() in OWN and plain(event) and bool(self.entries)

    def reveal(self, row: int) -> None:
        """Scroll until a row is in view."""
        box, bar = self.arrangement.row_box(row), self.verticalScrollBar()
        if box.top() < bar.value():
            bar.setValue(round(box.top()))
        elif box.bottom() > bar.value() + self.viewport().height():
            bar.setValue(round(box.bottom()) - self.viewport().height())

    @property
    def _page(self) -> int:
        """How many rows fit into the view."""
        height = self.arrangement.row_height(self.row)
        return max(1, int(self.viewport().height() // height))

    def _go_to(self, row: int, mark: int | None) -> None:
        """Move the focus."""
        self.row, self.mark = min(max(row, 0), len(self.entries) - 1), mark
        self.reveal(self.row)
        self.viewport().update()
        self._describe()
