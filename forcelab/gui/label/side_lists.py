"""What the lists beside the panels have in common."""

from __future__ import annotations

from PySide6.QtCore import QAbstractItemModel, QModelIndex, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFont, QKeyEvent, QPainter
from PySide6.QtWidgets import QAbstractItemView, QListView, QVBoxLayout, QWidget

from forcelab.gui.document import Document
from forcelab.gui.figures.text import elided, elided_name

__all__ = ["RowList", "SideList", "write_row"]

#: Least room between the two texts of a row in pixels, and of the first one in average letters.
APART, LETTERS = 8, 5


class SideList(QWidget):
    """A list, and what stands above and below it.

    Attributes
    ----------
    column : QVBoxLayout
        Holds them, from the top.
    """

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.document = document
        self.column = QVBoxLayout(self)
        self.column.setContentsMargins(4, 4, 4, 4)
        self.column.setSpacing(4)

    def sizeHint(self) -> QSize:
        """Room for all columns and some rows."""
        return QSize(300, 220)

    def minimumSizeHint(self) -> QSize:
        """Room for two rows, and less than the columns need; then one scrolls."""
        return QSize(180, 88)


class RowList(QListView):
    """Rows of one height; keys that label and play are left to the window.

    Attributes
    ----------
    opened : Signal(QModelIndex)
        Enter was pressed on a row.
    """

    opened = Signal(QModelIndex)

    def __init__(self, model: QAbstractItemModel) -> None:
        super().__init__()
        self.setModel(model)
        self.setUniformItemSizes(True)
        self.setVerticalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Enter opens a row; letters search for none."""
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.opened.emit(self.currentIndex())
        elif event.text() and event.text().isprintable():
            event.ignore()
        else:
            super().keyPressEvent(event)


def write_row(
    painter: QPainter,
    room: QRectF,
    texts: tuple[str, str],
    inks: tuple[QColor, QColor],
    font: QFont,
    *,
    among: tuple[str, ...] | None = None,
) -> None:
    """Write a text, and another one flush right where that leaves room for the first.

    Parameters
    ----------
    texts, inks : tuple of two
        Of both; the other one may be empty.
    font : QFont
        Of the first; the other one is in the painter's own.
    among : tuple of str, optional
        Where the first is a name: all that it stands among. Otherwise it is a sentence.
    """
    metrics, middle = painter.fontMetrics(), Qt.AlignmentFlag.AlignVCenter
    first, other = texts
    wide = metrics.horizontalAdvance(other) + APART
    if other and room.width() - wide > LETTERS * metrics.averageCharWidth():
        painter.setPen(inks[1])
        painter.drawText(room, middle | Qt.AlignmentFlag.AlignRight, other)
        room = room.adjusted(0, 0, -wide, 0)
    painter.setFont(font)
    painter.setPen(inks[0])
    if among is None:
        cut = elided(first, font, room.width())
    else:
        cut = elided_name(first, font, room.width(), among)
    painter.drawText(room, middle | Qt.AlignmentFlag.AlignLeft, cut)
