"""The segment table: the coder's track as rows to sort, filter, edit and jump to."""

from __future__ import annotations

from PySide6.QtCore import QItemSelectionModel, QModelIndex, Qt
from PySide6.QtGui import QContextMenuEvent, QHideEvent, QKeyEvent, QShowEvent
from PySide6.QtWidgets import QMenu

from forcelab.gui.arranging import PageOrNote, search_field
from forcelab.gui.document import Document
from forcelab.gui.icons import icon
from forcelab.gui.label.segment_model import NUMBER, SegmentModel
from forcelab.gui.label.segment_rows import SegmentRows
from forcelab.gui.label.segment_verbs import on_segment
from forcelab.gui.label.side_lists import SideList
from forcelab.gui.label.track_menu import relabel_menu, shown_name
from forcelab.gui.theme import themes
from forcelab.segment_edits import SLIVER

__all__ = ["SegmentTable"]


class SegmentTable(SideList):
    """The coder's segments, one row each.

    Choosing a row selects its segment and moves the cursor to its start; the segment under the
    cursor is marked. While the table is hidden it does nothing at all.
    """

    def __init__(self, document: Document) -> None:
        super().__init__(document)
        self.setAccessibleName("Segments")
        self.model = SegmentModel(document, self)
        self.filter = search_field("Filter by action", "Filter by action")
        self.filter.textChanged.connect(self._filter_changed)
        self.table = SegmentRows(self.model)
        self.table.setAccessibleName("Segments of your track")
        self.table.selectionModel().currentRowChanged.connect(self._row_chosen)
        self.table.clicked.connect(self._row_clicked)
        self.table.horizontalHeader().sortIndicatorChanged.connect(self._show_selection)
        self._pages = PageOrNote(self.table)
        self._pages.note.setMargin(4)  # in a small window there is room for two lines
        self.column.addWidget(self.filter)
        self.column.addWidget(self._pages, 1)
        self._syncing = False
        document.tracks_changed.connect(self._refresh)
        document.selection_changed.connect(self._show_selection)
        document.vocabulary_changed.connect(self._repaint)
        document.cursor_moved.connect(self._follow)
        document.demonstration_changed.connect(self.table.fit_columns)
        document.demonstration_changed.connect(self._refresh)
        themes().changed.connect(self._repaint)
        self._say_empty()

    def showEvent(self, event: QShowEvent) -> None:
        """Catch up with what happened while it was hidden."""
        super().showEvent(event)
        self._refresh()
        self._show_selection()

    def hideEvent(self, event: QHideEvent) -> None:
        """Let go of the rows."""
        super().hideEvent(event)
        self._syncing = True
        self.model.clear()
        self._syncing = False

    def _refresh(self) -> None:
        """Show the track as it is now."""
        if not self.isVisible():
            return
        self._syncing = True
        self.model.refresh()
        self._syncing = False
        if self.model.rows is not self.document.segments:
            self.table.viewport().update()  # rows that stay may have other numbers
        self._say_empty()
        self._show_selection()

    def _follow(self, cursor: float) -> None:
        """Mark the segment under the cursor."""
        if self.isVisible():
            self.model.follow(cursor)

    def _repaint(self) -> None:
        """Draw the rows again, which look otherwise now."""
        self.table.setPalette(self.palette())
        self.table.viewport().update()

    def _filter_changed(self, text: str) -> None:
        """Show what the filter lets through."""
        self._syncing = True
        self.model.set_filter(text)
        self._syncing = False
        self._say_empty()
        self._show_selection()

    def _say_empty(self) -> None:
        """Say why there is nothing to see, where there is nothing."""
        if self.model.rows:
            text = ""
        elif self.document.demonstration is None:
            text = "No demonstration is open."
        elif self.document.segments and self.filter.text().strip():
            text = f"No segment's action contains '{self.filter.text().strip()}'."
        else:
            # The track itself says how to begin.
            text = "No segments yet: what you label is listed here."
        self._pages.say(text)

    def _show_selection(self) -> None:
        """Choose the row of the selected segment, and bring it into view."""
        if not self.isVisible():
            return
        number, track = self.document.selected, self.document.segments
        row = None if number is None or number >= len(track) else self.model.row_of(track[number])
        self._syncing = True
        selection = self.table.selectionModel()
        if row is None:
            selection.clear()
        elif row != self.table.currentIndex().row() or not selection.hasSelection():
            column = max(self.table.currentIndex().column(), NUMBER)
            index = self.model.index(row, column)
            flags = QItemSelectionModel.SelectionFlag
            selection.setCurrentIndex(index, flags.ClearAndSelect | flags.Rows)
            self.table.scrollTo(index)
        self._syncing = False

    def _row_chosen(self, index: QModelIndex) -> None:
        """Select the segment of the row and go to its start."""
        if self._syncing or not index.isValid():
            return
        number = self.model.number_of(index.row())
        if number is None:
            return
        segment = self.document.segments[number]
        self._syncing = True  # selecting the one may end the selection of another first
        self.document.select(number)
        self.document.seek(segment.start)
        self.document.select(number)
        self._syncing = False

    def _row_clicked(self, index: QModelIndex) -> None:
        """Go to the start once more when the row that is chosen already is clicked."""
        number = self.model.number_of(index.row())
        if number is None:
            return
        away = abs(self.document.cursor - self.document.segments[number].start) > SLIVER
        if away or self.document.selected != number:
            self._row_chosen(index)

    # Keys and menus

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Delete takes the chosen segment away."""
        number = self.model.number_of(self.table.currentIndex().row())
        if event.key() == Qt.Key.Key_Delete and number is not None:
            self.document.delete(number)
            event.accept()
            return
        super().keyPressEvent(event)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """Offer what can be done with the chosen segment."""
        if (menu := self.menu()) is not None:
            menu.exec(event.globalPos())
            menu.deleteLater()

    def menu(self) -> QMenu | None:
        """What can be done with the chosen segment; None where none is chosen."""
        number = self.model.number_of(self.table.currentIndex().row())
        if number is None:
            return None
        document, segment = self.document, self.document.segments[number]
        menu = QMenu(self)
        relabel_menu(menu, document, segment)
        fill = menu.addAction("Mark as range")
        fill.triggered.connect(lambda: document.set_range(segment.start, segment.end))
        show_only = f"Show only '{shown_name(menu, segment.action)}'"
        only = menu.addAction(icon("search"), show_only)
        only.triggered.connect(lambda: self.filter.setText(segment.action))
        menu.addSeparator()
        delete = menu.addAction(icon("trash"), "Delete")
        delete.triggered.connect(lambda: on_segment(document, segment, document.delete))
        return menu
