"""The list of actions as it is drawn: key cap, swatch, name, and how much there is of each."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QPoint, QRectF, QSize
from PySide6.QtGui import QColor, QContextMenuEvent, QFont, QPainter, QPen
from PySide6.QtWidgets import QMenu, QStyle, QStyledItemDelegate, QStyleOptionViewItem, QWidget

from forcelab.gui.indexes import Index
from forcelab.gui.label.side_lists import RowList, write_row
from forcelab.gui.label.swatches import look_of, paint_key, paint_swatch
from forcelab.gui.label.vocabulary_model import VocabularyModel
from forcelab.gui.theme import colours

__all__ = ["ActionRows"]


class ActionRows(RowList):
    """A list of actions, with the menu of each."""

    def __init__(self, model: VocabularyModel, menu: Callable[[str], QMenu]) -> None:
        super().__init__(model)
        self._model, self._menu = model, menu
        self.setAccessibleName("Actions: Enter takes up the brush")
        self.setItemDelegate(_Delegate(model, self))
        self.setMouseTracking(True)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """Offer what can be done with the action that was pointed at or chosen."""
        by_mouse = event.reason() == QContextMenuEvent.Reason.Mouse
        index = self.indexAt(event.pos()) if by_mouse else self.currentIndex()
        name = self._model.name(index.row())
        if name is None:
            return
        below = QPoint(8, self.visualRect(index).bottom())
        menu = self._menu(name)
        menu.exec(event.globalPos() if by_mouse else self.viewport().mapToGlobal(below))
        menu.deleteLater()


class _Delegate(QStyledItemDelegate):
    """Draws one action."""

    def __init__(self, model: VocabularyModel, parent: QWidget) -> None:
        super().__init__(parent)
        self._model = model

    def sizeHint(self, option: QStyleOptionViewItem, index: Index) -> QSize:
        """A key cap with some room."""
        return QSize(120, round(option.fontMetrics.height() * 1.9))

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        """Draw key, look, name and amounts; the brush on the accent's colour."""
        document = self._model.document
        action = document.vocabulary.actions[index.row()]
        theme = colours()
        box = QRectF(option.rect)
        brush = action.name == document.action
        stroke = document.stroke is not None and document.stroke.action == action.name
        painter.save()
        ink, aside = QColor(theme.text), QColor(theme.muted)
        if brush:
            painter.fillRect(box, QColor(theme.accent))
            ink = aside = QColor(theme.accent_text)
        elif option.state & QStyle.StateFlag.State_MouseOver:
            painter.fillRect(box, QColor(theme.panel))
        if stroke:
            painter.fillRect(QRectF(box.left(), box.top(), 3, box.height()), QColor(theme.cursor))
        if option.state & QStyle.StateFlag.State_HasFocus:
            painter.setPen(QPen(QColor(theme.accent_text if brush else theme.accent), 1))
            painter.drawRect(box.adjusted(1.5, 1.5, -1.5, -1.5))
        unit = option.fontMetrics.height()
        cap = QRectF(box.left() + 6, 0, unit * 1.4, unit * 1.45)
        cap.moveTop(round(box.center().y() - cap.height() / 2))
        paint_key(painter, cap, action.key, option.font)
        swatch = QRectF(round(cap.right() + 6), round(box.center().y() - unit * 0.45), unit, unit)
        swatch.setSize(QSize(round(unit * 1.5), round(unit * 0.9)).toSizeF())
        paint_swatch(painter, swatch, look_of(document.vocabulary, action.name))
        number, seconds = self._model.counts.get(action.name, (0, 0.0))
        amount = f"{number} · {seconds:.1f} s" if number else ""
        room = box.adjusted(swatch.right() - box.left() + 8, 0, -8, 0)
        font = QFont(option.font)
        font.setBold(brush)
        write_row(
            painter,
            room,
            (action.name, amount),
            (ink, aside),
            font,
            among=document.vocabulary.names,
        )
        painter.restore()
