"""Lists and tables: rows of two lines, lists beside the panels, tables of texts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from PySide6.QtCore import (
    QAbstractItemModel,
    QAbstractTableModel,
    QModelIndex,
    QObject,
    QPersistentModelIndex,
    QPointF,
    QRectF,
    QSize,
    Qt,
    Signal,
)
from PySide6.QtGui import (
    QBrush,
    QColor,
    QFocusEvent,
    QFont,
    QFontMetrics,
    QFontMetricsF,
    QGuiApplication,
    QKeyEvent,
    QPainter,
    QPolygonF,
)
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QListView,
    QStyle,
    QStyleOptionViewItem,
    QTableView,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui.document import Document
from forcelab.gui.figures.axes import curve_pen
from forcelab.gui.figures.colormap import translucent
from forcelab.gui.figures.text import elided_name
from forcelab.gui.layout import fill_layout, whole_rows
from forcelab.gui.theme import colours, themes
from forcelab.gui.widgets import ENTER_KEYS

Index = QModelIndex | QPersistentModelIndex
#: No place: the parent of rows that have none.
NOWHERE: Final = QModelIndex()


#: Space at the sides, between things in a line and above each line, as shares of a text's height.
SIDE, GAP, ABOVE = 0.6, 0.4, 0.3
#: The smaller line's size of that of the larger one.
SMALL = 0.88
#: How much of the accent's colour lies on a selected row, and on one under the pointer.
SELECTED, HOVERED = 0.20, 0.07
#: Width of the stripe that marks the row of what is open or looked at, in pixels.
STRIPE = 3.0


def paint_row_background(painter: QPainter, option: QStyleOptionViewItem, marked: bool) -> None:
    """Paint a row's background: hovered or selected, with a stripe if it is marked."""
    box, state = QRectF(option.rect), option.state
    accent = QColor(colours().accent)
    selected = bool(state & QStyle.StateFlag.State_Selected)
    share = SELECTED * selected + HOVERED * bool(state & QStyle.StateFlag.State_MouseOver)
    if share:
        painter.fillRect(box, translucent(accent, share))
    if marked:
        painter.fillRect(QRectF(box.left(), box.top(), STRIPE, box.height()), accent)


def paint_chevron(painter: QPainter, centre: QPointF, height: float, expanded: bool) -> None:
    """Paint an angle that points down where rows are expanded, else to their title."""
    a, b = 0.22 * height, 0.11 * height
    points = [(-a, -b), (0.0, b), (a, -b)] if expanded else [(-b, -a), (b, 0.0), (-b, a)]
    painter.setPen(curve_pen(QColor(colours().muted), max(1.4, 0.09 * height)))
    painter.drawPolyline(QPolygonF([centre + QPointF(x, y) for x, y in points]))


def draw_line(
    painter: QPainter,
    box: QRectF,
    text: str,
    font: QFont,
    colour: str | QColor,
    align: Qt.AlignmentFlag = Qt.AlignmentFlag.AlignLeft,
    elide: Qt.TextElideMode = Qt.TextElideMode.ElideRight,
) -> float:
    """Draw one line of text into a box, elided if it does not fit; returns its width."""
    sizes = QFontMetricsF(font)
    line = " ".join(text.split())
    fits = sizes.horizontalAdvance(line) <= box.width()
    if not line or (not fits and box.width() < sizes.horizontalAdvance("…")):
        return 0.0
    painter.setFont(font)
    painter.setPen(QColor(colour))
    fitting = line if fits else sizes.elidedText(line, elide, box.width())
    flags = align | Qt.AlignmentFlag.AlignVCenter | Qt.TextFlag.TextSingleLine
    painter.drawText(box, int(flags), fitting)
    return sizes.horizontalAdvance(fitting)


def smaller(font: QFont) -> QFont:
    """The font of the second line."""
    small = QFont(font)
    if font.pointSizeF() > 0:
        small.setPointSizeF(font.pointSizeF() * SMALL)
    else:
        small.setPixelSize(round(font.pixelSize() * SMALL))
    return small


#: Least room between the two texts of a row in pixels, and of the first one in average letters.
APART, LETTERS = 8, 5


class SideList(QWidget):
    """A list with what stands above and below it, in `column` from the top."""

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.document = document
        self.column = fill_layout(QVBoxLayout(self), margins=4, spacing=4)

    def sizeHint(self) -> QSize:
        return QSize(300, 220)

    def minimumSizeHint(self) -> QSize:
        """Two rows, and less than the columns need; then it scrolls."""
        return QSize(180, 88)


class RowList(QListView):
    """Rows of one height; keys that label and play are left to the window.

    Enter emits `opened`.
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
        """Enter opens a row; letters do not search."""
        if event.key() in ENTER_KEYS:
            self.opened.emit(self.currentIndex())
        elif event.text() and event.text().isprintable():
            event.ignore()
        else:
            super().keyPressEvent(event)


def write_row(
    painter: QPainter,
    room: QRectF,
    texts: tuple[str, str],
    pens: tuple[QColor, QColor],
    font: QFont,
    *,
    among: tuple[str, ...] | None = None,
) -> None:
    """Draw a text, and another one flush right if that leaves room for the first.

    The second may be empty, and is in the painter's font. If the first is a name, `among` are all
    the names it stands among; otherwise it is a sentence.
    """
    metrics, (first, other) = painter.fontMetrics(), texts
    wide = metrics.horizontalAdvance(other) + APART
    if other and room.width() - wide > LETTERS * metrics.averageCharWidth():
        draw_line(painter, room, other, painter.font(), pens[1], Qt.AlignmentFlag.AlignRight)
        room = room.adjusted(0, 0, -wide, 0)
    if among is not None:
        first = elided_name(first, font, room.width(), among)
    draw_line(painter, room, first, font, pens[0])


#: Where text stands in a cell; joined once, as joining flags takes longer than drawing a number.
LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter

#: Views ask for these thousands of times for one page: as plain numbers they compare fast.
_DISPLAY, _ALIGNMENT, _TIP, _COLOUR, _FONT = map(
    int,
    (
        Qt.ItemDataRole.DisplayRole,
        Qt.ItemDataRole.TextAlignmentRole,
        Qt.ItemDataRole.ToolTipRole,
        Qt.ItemDataRole.ForegroundRole,
        Qt.ItemDataRole.FontRole,
    ),
)
_ROLES = frozenset({_DISPLAY, _ALIGNMENT, _TIP, _COLOUR, _FONT})

#: Of a column's texts only so many of the longest are measured; what is left free beside them.
MEASURED_TEXTS, COLUMN_PADDING = 3, 8


@dataclass(frozen=True, slots=True)
class TableColumn:
    """A column; one of numbers is right aligned.

    The numbers of a column have equally many decimals: their points stand below one another.
    """

    name: str
    tip: str = ""
    number: bool = True


@dataclass(frozen=True, slots=True)
class TableRow:
    """A row: its cells, its name in the header and its colours, if any."""

    cells: tuple[str, ...]
    name: str = ""
    tip: str = ""
    colours: tuple[str | None, ...] = ()
    bold: bool = False


class TextModel(QAbstractTableModel):
    """Rows of texts."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.columns: tuple[TableColumn, ...] = ()
        self.rows: tuple[TableRow, ...] = ()

    def show(self, columns: Sequence[TableColumn], rows: Sequence[TableRow]) -> None:
        """Replace columns and rows."""
        self.beginResetModel()
        self.columns, self.rows = tuple(columns), tuple(rows)
        self.endResetModel()

    def replace_texts(self, rows: Sequence[TableRow]) -> None:
        """Replace the texts of as many rows; the current row stays."""
        self.rows = tuple(rows)
        if self.rows:
            last = self.index(len(self.rows) - 1, len(self.columns) - 1)
            self.dataChanged.emit(self.index(0, 0), last)

    def as_tsv(self) -> str:
        """The table for spreadsheets, with the names of columns and of rows that have any."""
        named = any(row.name for row in self.rows)
        lines = [["", *(column.name for column in self.columns)]]
        lines += [[row.name, *row.cells] for row in self.rows]
        return as_tsv(lines if named else [line[1:] for line in lines])

    def rowCount(self, parent: Index = NOWHERE) -> int:
        return 0 if parent.isValid() else len(self.rows)

    def columnCount(self, parent: Index = NOWHERE) -> int:
        return 0 if parent.isValid() else len(self.columns)

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        row, column = self.rows[index.row()], index.column()
        if role == _DISPLAY:
            return row.cells[column]
        if role == _ALIGNMENT:
            return RIGHT if self.columns[column].number else LEFT
        if role == _TIP:
            return row.tip or self.columns[column].tip or row.cells[column]  # which may be cut
        if role == _COLOUR and column < len(row.colours):
            colour = row.colours[column]
            return None if colour is None else QBrush(QColor(colour))
        if role == _FONT and row.bold:
            font = QGuiApplication.font()
            font.setBold(True)
            return font
        return None

    def headerData(
        self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole
    ) -> Any:
        if role not in _ROLES:
            return None
        across = orientation == Qt.Orientation.Horizontal
        if section >= len(self.columns if across else self.rows):
            return None
        if role == _DISPLAY:
            return self.columns[section].name if across else self.rows[section].name
        if role == _TIP:
            named = self.columns[section] if across else self.rows[section]
            return named.tip or named.name or None
        if role == _ALIGNMENT:
            return RIGHT if across and self.columns[section].number else LEFT
        return None


class TextTable(QTableView):
    """A view of whole rows; letters and digits are left to the window."""

    def __init__(self, model: TextModel) -> None:
        super().__init__()
        self._model = model
        self.setModel(model)
        whole_rows(self)
        self.horizontalHeader().setMinimumSectionSize(28)
        themes().changed.connect(self.viewport().update)

    def fit_columns(self, stretched: int | None = None) -> None:
        """Make columns as wide as their longest texts; column `stretched` gets the room left.

        Qt would measure every cell by its style: seconds for 200 rows.
        """
        model, header = self._model, self.horizontalHeader()
        bold = QFont(self.font())
        bold.setBold(True)
        measure = QFontMetrics(bold).horizontalAdvance
        modes = QHeaderView.ResizeMode
        for number, column in enumerate(model.columns):
            texts = [*column.name.split("\n"), *(row.cells[number] for row in model.rows)]
            longest = sorted(texts, key=len)[-MEASURED_TEXTS:]
            header.setSectionResizeMode(number, modes.Interactive)
            header.resizeSection(number, max(map(measure, longest)) + 2 * COLUMN_PADDING)
        if stretched is not None:
            header.setSectionResizeMode(stretched, modes.Stretch)

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Select the first row if the focus comes by keyboard."""
        by_mouse = event.reason() == Qt.FocusReason.MouseFocusReason
        if not by_mouse and not self.currentIndex().isValid():
            self.selectRow(0)
        super().focusInEvent(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Enter opens the row, as a click does; letters do not search."""
        if event.key() in ENTER_KEYS:
            if self.currentIndex().isValid():
                self.clicked.emit(self.currentIndex())
        elif event.text() and event.text().isprintable():
            event.ignore()
        else:
            super().keyPressEvent(event)


def as_tsv(lines: Sequence[Sequence[str]]) -> str:
    """Lines of tab-separated cells, as spreadsheets take them."""
    return "".join("\t".join(" ".join(cell.split()) for cell in cells) + "\n" for cells in lines)


def copy_text(text: str) -> None:
    QGuiApplication.clipboard().setText(text)
