"""The list of the track's segments.

Changes reach the view as one run of rows, found by :func:`forcelab.segment_edits.splice`: a
stroke on a track of 10,000 segments costs one comparison of two tuples.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Mapping
from operator import attrgetter
from typing import Any, Literal, cast

from PySide6.QtCore import (
    QAbstractItemModel,
    QAbstractTableModel,
    QEvent,
    QItemSelectionModel,
    QModelIndex,
    QObject,
    QPointF,
    QRect,
    QRectF,
    Qt,
)
from PySide6.QtGui import (
    QColor,
    QContextMenuEvent,
    QHideEvent,
    QKeyEvent,
    QPainter,
    QResizeEvent,
    QShowEvent,
)
from PySide6.QtWidgets import (
    QAbstractItemView,
    QComboBox,
    QHeaderView,
    QMenu,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionHeader,
    QStyleOptionViewItem,
    QTableView,
    QWidget,
)

from forcelab.gui.document import Document
from forcelab.gui.figures.colormap import translucent
from forcelab.gui.figures.text import elided_name
from forcelab.gui.figures.tracks import LabelStyle
from forcelab.gui.icons import icon
from forcelab.gui.item_views import LEFT, NOWHERE, RIGHT, Index, SideList
from forcelab.gui.label.segment_commands import for_current_segment
from forcelab.gui.label.swatches import paint_swatch, style_of
from forcelab.gui.label.track_menus import add_relabel_menu, shown_name
from forcelab.gui.label.track_painting import MARK, origin_text, paint_proposed
from forcelab.gui.layout import PageOrPlaceholder, fill_layout, search_field, whole_rows
from forcelab.gui.theme import colours, themes
from forcelab.gui.widgets import ENTER_KEYS
from forcelab.labels import Segment, Segments
from forcelab.project import Origin
from forcelab.segment_edits import SLIVER, index_at, splice

#: The columns.
NUMBER, ACTION, START, END, DURATION = range(5)

_SHOWN = Qt.ItemFlag.ItemIsEnabled | Qt.ItemFlag.ItemIsSelectable
_EDITABLE = _SHOWN | Qt.ItemFlag.ItemIsEditable
_start = attrgetter("start")
_ORDERS: dict[int, Callable[[Segment], Any]] = {
    ACTION: lambda segment: (segment.action.casefold(), segment.start),
    DURATION: lambda segment: (segment.end - segment.start, segment.start),
}


class SegmentModel(QAbstractTableModel):
    """Rows for a table of the coder's segments, filtered and sorted.

    `rows` are the shown segments from the first row to the last; `origins` has those of the track's
    segments that a model proposed.
    """

    def __init__(self, document: Document, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.document = document
        self.rows: Segments = ()
        self.origins: Mapping[Segment, Origin] = {}
        self._source: Segments = ()
        self._filter = ""
        self._column, self._descending = START, False
        self._current: Segment | None = None

    # Rows

    def refresh(self) -> None:
        """Show the track as it is now, telling views only about rows that differ."""
        self._source, self.origins = self.document.editor.segments, self.document.origins()
        self._update_rows()
        self.follow(self.document.view.cursor)

    def _update_rows(self) -> None:
        """Tell views about the rows that come, go or change."""
        rows = self._ordered_rows()
        position, removed, inserted = splice(self.rows, rows)
        common = min(len(removed), len(inserted))
        if common:
            self.rows = rows[: position + common] + self.rows[position + common :]
            last = self.index(position + common - 1, DURATION)
            self.dataChanged.emit(self.index(position, NUMBER), last)
        at = position + common
        if len(removed) > common:
            self.beginRemoveRows(NOWHERE, at, position + len(removed) - 1)
            self.rows = rows
            self.endRemoveRows()
        elif len(inserted) > common:
            self.beginInsertRows(NOWHERE, at, position + len(inserted) - 1)
            self.rows = rows
            self.endInsertRows()
        self.rows = rows

    def clear(self) -> None:
        self.beginResetModel()
        self.rows, self._source, self._current, self.origins = (), (), None, {}
        self.endResetModel()

    def set_filter(self, text: str) -> None:
        """Show only segments whose action contains this text, ignoring case."""
        text = text.strip().casefold()
        if text != self._filter:
            self._filter = text
            self._update_rows()

    def sort(self, column: int, order: Qt.SortOrder = Qt.SortOrder.AscendingOrder) -> None:
        self._column, self._descending = column, order == Qt.SortOrder.DescendingOrder
        self.beginResetModel()
        self.rows = self._ordered_rows()
        self.endResetModel()

    def follow(self, cursor: float) -> None:
        """Mark the segment under the cursor."""
        index = index_at(self._source, cursor)
        under = None if index is None else self._source[index]
        if under is not self._current:
            before, self._current = self._current, under
            for segment in (before, under):
                if segment is not None and (row := self.row_of(segment)) is not None:
                    self.dataChanged.emit(self.index(row, NUMBER), self.index(row, DURATION))

    def row_of(self, segment: Segment) -> int | None:
        """Where a segment is shown, if it is."""
        if self._in_time_order:
            row = bisect_left(self.rows, segment.start, key=_start)
            return row if row < len(self.rows) and self.rows[row] == segment else None
        try:
            return self.rows.index(segment)
        except ValueError:
            return None

    def index_in_track(self, row: int) -> int | None:
        """The index of a row's segment in the document; None if it is no longer there."""
        if not 0 <= row < len(self.rows):
            return None
        return self.document.editor.index_of(self.rows[row])

    @property
    def _in_time_order(self) -> bool:
        """Whether the rows are in order of time; segments that never overlap also end in it."""
        return self._column in (NUMBER, START, END) and not self._descending

    def _ordered_rows(self) -> Segments:
        """The filtered segments, in order."""
        rows = self._source
        if self._filter:
            matching = {
                action
                for action in {segment.action for segment in rows}
                if self._filter in action.casefold()
            }
            rows = tuple(segment for segment in rows if segment.action in matching)
        if self._column in _ORDERS:
            rows = tuple(sorted(rows, key=_ORDERS[self._column], reverse=self._descending))
        elif self._descending:
            rows = rows[::-1]
        return rows

    # What Qt asks

    def rowCount(self, parent: Index = NOWHERE) -> int:
        return 0 if parent.isValid() else len(self.rows)

    def columnCount(self, parent: Index = NOWHERE) -> int:
        return 0 if parent.isValid() else 5

    def headerData(
        self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole
    ) -> Any:
        if orientation != Qt.Orientation.Horizontal:
            return None
        if role == Qt.ItemDataRole.TextAlignmentRole:
            return LEFT if section == ACTION else RIGHT
        if role == Qt.ItemDataRole.ToolTipRole and section >= START:
            return "In seconds"
        if role == Qt.ItemDataRole.DisplayRole:
            return ("#", "Action", "Start", "End", "Duration")[section]
        return None

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        if not index.isValid() or index.row() >= len(self.rows):
            return None
        segment, column = self.rows[index.row()], index.column()
        if role == Qt.ItemDataRole.DisplayRole:
            return self.cell_text(index.row(), column)
        if role == Qt.ItemDataRole.EditRole:
            return segment.action if column == ACTION else _as_typed(_time(segment, column))
        if role in (Qt.ItemDataRole.ToolTipRole, Qt.ItemDataRole.AccessibleDescriptionRole):
            tip = role == Qt.ItemDataRole.ToolTipRole
            return self._tooltip(segment, with_action=tip and column == ACTION)
        return None

    def _tooltip(self, segment: Segment, with_action: bool) -> str | None:
        """Which model proposed a segment, below the action if that may be cut off."""
        action = segment.action if with_action else ""
        proposed = origin_text(self.origins.get(segment))
        return "\n".join(filter(None, (action, proposed))) or None

    def under_cursor(self, segment: Segment) -> bool:
        return segment is self._current

    def cell_text(self, row: int, column: int) -> str:
        if column == NUMBER:
            number = self.index_in_track(row)
            return "" if number is None else str(number + 1)
        segment = self.rows[row]
        return segment.action if column == ACTION else f"{_time(segment, column):.3f}"

    def flags(self, index: Index) -> Qt.ItemFlag:
        """Everything but the number can be edited."""
        return _SHOWN if index.column() == NUMBER else _EDITABLE

    def setData(self, index: Index, value: Any, role: int = Qt.ItemDataRole.EditRole) -> bool:
        """Carry out what was typed; an error is shown as one sentence."""
        number = self.index_in_track(index.row())
        typed = str(value).strip()
        if role != Qt.ItemDataRole.EditRole or number is None:
            return False
        if typed == self.data(index, role):
            return False
        if index.column() == ACTION:
            return self.document.editor.relabel(number, typed) is not None
        try:
            time = float(typed.removesuffix("s"))
        except ValueError:
            self.document.refuse(f"'{typed}' is no time in seconds; type a number such as 1.25.")
            return False
        return self._set_time(number, index.column(), time)

    def _set_time(self, number: int, column: int, time: float) -> bool:
        """Move a segment's start or end, or set its duration, within the demonstration."""
        segment = self.document.editor.segments[number]
        if column == DURATION:
            time += segment.start
        low, high = self.document.view.bounds
        if not low <= time <= high:
            self.document.refuse(
                f"{time:.10g} s is outside the demonstration ({low:.3f} s to {high:.3f} s)."
            )
            return False
        edge: Literal["start", "end"] = "start" if column == START else "end"
        return self.document.editor.move_edge(number, edge, time) is not None


def _as_typed(time: float) -> str:
    """A time as it is typed: to the microsecond, without zeros at the end."""
    return f"{time:.6f}".rstrip("0").rstrip(".")


def _time(segment: Segment, column: int) -> float:
    """A column's value of a segment (s)."""
    if column == START:
        return segment.start
    return segment.end if column == END else segment.end - segment.start


#: Letters of an action's name that other columns give way to: at least and at most.
LETTERS = 8, 20
#: Pixels beside a name: its swatch and margins.
BESIDE_NAME = 27


class SegmentRowList(QTableView):
    """A table of whole rows, edited on double click or Enter; the window's keys are left to it."""

    #: Delete is the window's here: it deletes the segment that is selected.
    lists_segments = True

    def __init__(self, model: SegmentModel) -> None:
        super().__init__()
        self._model = model
        self._widths = {NUMBER: 0, DURATION: 0}  # of these columns when they were last shown
        self.setModel(model)
        self.setHorizontalHeader(_Header(self))
        self.setItemDelegate(_Delegate(model, self))
        whole_rows(self)
        triggers = QAbstractItemView.EditTrigger
        self.setEditTriggers(triggers.DoubleClicked | triggers.EditKeyPressed)
        header = self.horizontalHeader()
        header.setSectionsClickable(True)
        header.setMinimumSectionSize(28)
        header.setSectionResizeMode(QHeaderView.ResizeMode.Interactive)
        header.setSectionResizeMode(ACTION, QHeaderView.ResizeMode.Stretch)
        self.setSortingEnabled(True)
        self.sortByColumn(START, Qt.SortOrder.AscendingOrder)
        self.fit_columns()

    def fit_columns(self) -> None:
        """Give the numbers the room that they need; the action gets the rest."""
        model, header = self._model, self.horizontalHeader()
        measure = self.fontMetrics().horizontalAdvance
        numbers = {
            NUMBER: measure(str(max(len(model.document.editor.segments), 100))),
            START: measure(f"{model.document.view.bounds[1]:.3f}"),
            END: measure(f"{model.document.view.bounds[1]:.3f}"),
            DURATION: measure("00.000"),
        }
        for column in self._widths:
            self.setColumnHidden(column, False)
        for column, width in numbers.items():
            name = str(model.headerData(column, Qt.Orientation.Horizontal))
            header.resizeSection(column, max(width + 10, measure(name) + 14))
        self._hide_columns()

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.FontChange:
            self.fit_columns()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._hide_columns()

    def _hide_columns(self) -> None:
        """Show number and duration if they leave room for the actions' names."""
        header, document = self.horizontalHeader(), self._model.document
        measure = self.fontMetrics().horizontalAdvance
        longest = max(map(measure, (*document.vocabulary.names, "n" * LETTERS[0])))
        names = min(longest, measure("n" * LETTERS[1])) + BESIDE_NAME
        room = self.viewport().width() - names - (MARK if document.origins() else 0)
        room -= header.sectionSize(START) + header.sectionSize(END)
        for column, width in self._widths.items():
            self._widths[column] = header.sectionSize(column) or width
            room -= self._widths[column]
            if (room < 0) != self.isColumnHidden(column):
                self.setColumnHidden(column, room < 0)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Leave keys that label and play to the window; others navigate in the table."""
        text, editing = event.text(), self.state() == QAbstractItemView.State.EditingState
        if event.key() in ENTER_KEYS and not editing:
            current = self.currentIndex()
            self.edit(current if current.column() != NUMBER else current.siblingAtColumn(START))
        elif (text and text.isprintable()) or event.key() == Qt.Key.Key_Delete:
            event.ignore()
        else:
            super().keyPressEvent(event)


class _Header(QHeaderView):
    """Names of the columns, with the sign of the order above them, where it covers no name."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(Qt.Orientation.Horizontal, parent)

    def initStyleOptionForIndex(self, option: QStyleOptionHeader, logicalIndex: int) -> None:
        """Omit the sign that Qt would draw over a name that is flush right."""
        super().initStyleOptionForIndex(option, logicalIndex)
        option.sortIndicator = QStyleOptionHeader.SortIndicator.None_

    def paintSection(self, painter: QPainter, rect: QRect, logicalIndex: int) -> None:
        """Draw a name, and the sign if the rows are sorted by this column."""
        painter.save()
        super().paintSection(painter, rect, logicalIndex)
        painter.restore()
        if logicalIndex != self.sortIndicatorSection():
            return
        up = self.sortIndicatorOrder() == Qt.SortOrder.AscendingOrder
        tip, base = (2.0, 5.0) if up else (5.0, 2.0)
        x, top = rect.center().x() + 0.5, rect.top()
        painter.save()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(colours().muted))
        painter.drawPolygon(
            [QPointF(x - 3.5, top + base), QPointF(x + 3.5, top + base), QPointF(x, top + tip)]
        )
        painter.restore()


class _Delegate(QStyledItemDelegate):
    """Draws swatches and the mark of the cursor, and edits actions with a list."""

    def __init__(self, model: SegmentModel, parent: QWidget) -> None:
        super().__init__(parent)
        self._model = model
        self._vocabulary, self._theme = model.document.vocabulary, colours()
        self._styles: dict[str, LabelStyle] = {}

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        """Draw a cell, by hand: a style takes many times as long, and strokes shift all rows."""
        row, column = index.row(), index.column()
        theme, segment = colours(), self._model.rows[row]
        box = QRectF(option.rect)
        ink, under = theme.text, self._model.under_cursor(segment)
        if option.state & QStyle.StateFlag.State_Selected:
            painter.fillRect(box, QColor(theme.accent))
            ink = theme.accent_text
        elif under:
            painter.fillRect(box, translucent(theme.accent, 0.16))
        if under and column == NUMBER:
            painter.fillRect(QRectF(box.left(), box.top(), 3, box.height()), QColor(theme.cursor))
        text, side = self._model.cell_text(row, column), RIGHT
        box.adjust(3, 0, -3, 0)
        if column == ACTION:
            swatch = QRectF(box.left() + 1, round(box.center().y()) - 6, 12, 12)
            paint_swatch(painter, swatch, self._style(text))
            box.adjust(18, 0, 0, 0)
            if (origin := self._model.origins.get(segment)) is not None:
                faint = theme.muted if ink == theme.text else ink
                paint_proposed(painter, box, faint, origin.changed)
                box.adjust(0, 0, -MARK, 0)
            side = LEFT
            text = elided_name(
                text, option.font, box.width(), self._model.document.vocabulary.names
            )
        painter.setPen(QColor(ink))
        painter.drawText(box, side, text)

    def _style(self, name: str) -> LabelStyle:
        """How an action is drawn, cached."""
        vocabulary = self._model.document.vocabulary
        if vocabulary is not self._vocabulary or colours() is not self._theme:
            self._vocabulary, self._theme, self._styles = vocabulary, colours(), {}
        if name not in self._styles:
            self._styles[name] = style_of(vocabulary, name)
        return self._styles[name]

    def createEditor(self, parent: QWidget, option: QStyleOptionViewItem, index: Index) -> QWidget:
        """A list of the actions, or a field for a number."""
        if index.column() != ACTION:
            return super().createEditor(parent, option, index)
        editor = QComboBox(parent)
        editor.addItems(list(self._model.document.vocabulary.names))
        editor.activated.connect(lambda: self._action_chosen(editor))
        return editor

    def setEditorData(self, editor: QWidget, index: Index) -> None:
        if isinstance(editor, QComboBox):
            editor.setCurrentText(str(index.data()))
            editor.showPopup()
        else:
            super().setEditorData(editor, index)

    def setModelData(self, editor: QWidget, model: QAbstractItemModel, index: Index) -> None:
        if isinstance(editor, QComboBox):
            model.setData(cast(QModelIndex, index), editor.currentText())
        else:
            super().setModelData(editor, model, index)

    def _action_chosen(self, editor: QComboBox) -> None:
        """Choosing an action from the list ends editing."""
        self.commitData.emit(editor)
        self.closeEditor.emit(editor)


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
        self.table = SegmentRowList(self.model)
        self.table.setAccessibleName("Segments of your track")
        self.table.selectionModel().currentRowChanged.connect(self._row_chosen)
        self.table.clicked.connect(self._row_clicked)
        self.table.horizontalHeader().sortIndicatorChanged.connect(self._show_selection)
        self.pages = PageOrPlaceholder(self.table)
        self.pages.note.setMargin(4)  # in a small window there is room for two lines
        fill_layout(self.column, self.filter, (self.pages, 1))
        self._syncing = False
        document.tracks_changed.connect(self.refresh)
        document.selection_changed.connect(self._show_selection)
        document.vocabulary_changed.connect(self._repaint)
        document.vocabulary_changed.connect(self.table.fit_columns)
        document.view.cursor_moved.connect(self._follow)
        document.demonstration_changed.connect(self.table.fit_columns)
        document.demonstration_changed.connect(self.refresh)
        themes().changed.connect(self._repaint)
        self._update_placeholder()

    def showEvent(self, event: QShowEvent) -> None:
        """Show what changed while it was hidden."""
        super().showEvent(event)
        self.refresh()
        self._show_selection()

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self._syncing = True
        self.model.clear()
        self._syncing = False

    def refresh(self) -> None:
        if not self.isVisible():
            return
        self._syncing = True
        self.model.refresh()
        self._syncing = False
        if self.model.rows is not self.document.editor.segments:
            self.table.viewport().update()  # rows that stay may have other numbers
        self._update_placeholder()
        self._show_selection()

    def _follow(self, cursor: float) -> None:
        if self.isVisible():
            self.model.follow(cursor)

    def _repaint(self) -> None:
        """Redraw the rows, which look different now."""
        self.table.setPalette(self.palette())
        self.table.viewport().update()

    def _filter_changed(self, text: str) -> None:
        self._syncing = True
        self.model.set_filter(text)
        self._syncing = False
        self._update_placeholder()
        self._show_selection()

    def _update_placeholder(self) -> None:
        """Say why the table is empty, where it is."""
        if self.model.rows:
            text = ""
        elif self.document.demonstration is None:
            text = "No demonstration is open."
        elif self.document.editor.segments and self.filter.text().strip():
            text = f"No segment's action contains '{self.filter.text().strip()}'."
        else:
            # The track itself says how to begin.
            text = "No segments yet: what you label is listed here."
        self.pages.say(text)
        self.filter.setVisible(bool(self.document.editor.segments))

    def _show_selection(self) -> None:
        """Choose the row of the selected segment, and scroll to it."""
        if not self.isVisible():
            return
        number, track = self.document.selected, self.document.editor.segments
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
        number = self.model.index_in_track(index.row())
        if number is None:
            return
        segment = self.document.editor.segments[number]
        self._syncing = True  # selecting the one may end the selection of another first
        self.document.select(number)
        self.document.view.seek(segment.start)
        self.document.select(number)
        self._syncing = False

    def _row_clicked(self, index: QModelIndex) -> None:
        """Go to the start again when the chosen row is clicked."""
        number = self.model.index_in_track(index.row())
        if number is None:
            return
        start = self.document.editor.segments[number].start
        elsewhere = abs(self.document.view.cursor - start) > SLIVER
        if elsewhere or self.document.selected != number:
            self._row_chosen(index)

    # Keys and menus

    def keyPressEvent(self, event: QKeyEvent) -> None:
        number = self.model.index_in_track(self.table.currentIndex().row())
        if event.key() == Qt.Key.Key_Delete and number is not None:
            self.document.editor.delete(number)
            event.accept()
            return
        super().keyPressEvent(event)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        if (menu := self.menu()) is not None:
            menu.exec(event.globalPos())
            menu.deleteLater()

    def menu(self) -> QMenu | None:
        """The chosen segment's menu; None where none is chosen."""
        number = self.model.index_in_track(self.table.currentIndex().row())
        if number is None:
            return None
        document, segment = self.document, self.document.editor.segments[number]
        menu = QMenu(self)
        add_relabel_menu(menu, document, segment)
        menu.addAction("Mark as range", lambda: document.view.set_range(segment.start, segment.end))
        show_only = f"Show only '{shown_name(menu, segment.action)}'"
        menu.addAction(icon("search"), show_only, lambda: self.filter.setText(segment.action))
        menu.addSeparator()
        menu.addAction(
            icon("trash"),
            "Delete",
            lambda: for_current_segment(document, segment, document.editor.delete),
        )
        return menu
