"""The rows of the segment table as they are drawn and edited."""

from __future__ import annotations

from typing import cast

from PySide6.QtCore import QAbstractItemModel, QModelIndex, QPointF, QRect, QRectF, Qt
from PySide6.QtGui import QColor, QKeyEvent, QPainter, QResizeEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QComboBox,
    QHeaderView,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionHeader,
    QStyleOptionViewItem,
    QTableView,
    QWidget,
)

from forcelab.gui.arranging import whole_rows
from forcelab.gui.figures.shades import translucent
from forcelab.gui.figures.text import elided_name
from forcelab.gui.figures.tracks import Look
from forcelab.gui.indexes import Index
from forcelab.gui.label.proposed import MARK, paint_proposed
from forcelab.gui.label.segment_model import ACTION, DURATION, END, NUMBER, START, SegmentModel
from forcelab.gui.label.swatches import look_of, paint_swatch
from forcelab.gui.theme import colours

__all__ = ["SegmentRows"]

#: Where text stands in a cell; joined once, as joining flags takes longer than drawing a number.
LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter


class SegmentRows(QTableView):
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
            NUMBER: measure(str(max(len(model.document.segments), 100))),
            START: measure(f"{model.document.bounds[1]:.3f}"),
            END: measure(f"{model.document.bounds[1]:.3f}"),
            DURATION: measure("00.000"),
        }
        for column in self._widths:
            self.setColumnHidden(column, False)
        for column, width in numbers.items():
            name = str(model.headerData(column, Qt.Orientation.Horizontal))
            header.resizeSection(column, max(width + 10, measure(name) + 14))
        self._drop_columns()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Leave columns away where actions could not be read otherwise."""
        super().resizeEvent(event)
        self._drop_columns()

    def _drop_columns(self) -> None:
        """Show number and duration if they leave room for eight letters of the action."""
        header = self.horizontalHeader()
        letters = 24 + 8 * self.fontMetrics().averageCharWidth()
        room = self.viewport().width() - letters
        room -= header.sectionSize(START) + header.sectionSize(END)
        for column, width in self._widths.items():
            self._widths[column] = header.sectionSize(column) or width
            room -= self._widths[column]
            if (room < 0) != self.isColumnHidden(column):
                self.setColumnHidden(column, room < 0)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Leave keys that label and play to the window; others move about in the table."""
        text, editing = event.text(), self.state() == QAbstractItemView.State.EditingState
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and not editing:
            here = self.currentIndex()
            self.edit(here if here.column() != NUMBER else here.siblingAtColumn(START))
        elif (text and text.isprintable()) or event.key() == Qt.Key.Key_Delete:
            event.ignore()
        else:
            super().keyPressEvent(event)


class _Header(QHeaderView):
    """Names of the columns, with the sign of the order above them, where it covers no name."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(Qt.Orientation.Horizontal, parent)

    def initStyleOptionForIndex(self, option: QStyleOptionHeader, logicalIndex: int) -> None:
        """Leave the sign away that Qt would draw over a name that is flush right."""
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
        self._looks: dict[str, Look] = {}

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
            tint = translucent(theme.accent, 0.16)
            painter.fillRect(box, tint)
        if under and column == NUMBER:
            painter.fillRect(QRectF(box.left(), box.top(), 3, box.height()), QColor(theme.cursor))
        text, side = self._model.shown(row, column), RIGHT
        box.adjust(3, 0, -3, 0)
        if column == ACTION:
            swatch = QRectF(box.left() + 1, round(box.center().y()) - 6, 12, 12)
            paint_swatch(painter, swatch, self._look(text))
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

    def _look(self, name: str) -> Look:
        """How an action is drawn, looked up once."""
        vocabulary = self._model.document.vocabulary
        if vocabulary is not self._vocabulary or colours() is not self._theme:
            self._vocabulary, self._theme, self._looks = vocabulary, colours(), {}
        if name not in self._looks:
            self._looks[name] = look_of(vocabulary, name)
        return self._looks[name]

    def createEditor(self, parent: QWidget, option: QStyleOptionViewItem, index: Index) -> QWidget:
        """A list of the actions, or a line for a number."""
        if index.column() != ACTION:
            return super().createEditor(parent, option, index)
        editor = QComboBox(parent)
        editor.addItems(list(self._model.document.vocabulary.names))
        editor.activated.connect(lambda: self._chosen(editor))
        return editor

    def setEditorData(self, editor: QWidget, index: Index) -> None:
        """Begin with what is there."""
        if isinstance(editor, QComboBox):
            editor.setCurrentText(str(index.data()))
            editor.showPopup()
        else:
            super().setEditorData(editor, index)

    def setModelData(self, editor: QWidget, model: QAbstractItemModel, index: Index) -> None:
        """Hand over what was chosen or typed."""
        if isinstance(editor, QComboBox):
            model.setData(cast(QModelIndex, index), editor.currentText())
        else:
            super().setModelData(editor, model, index)

    def _chosen(self, editor: QComboBox) -> None:
        """An action was chosen from the list: that is all there is to edit."""
        self.commitData.emit(editor)
        self.closeEditor.emit(editor)
