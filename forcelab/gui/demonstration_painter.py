"""How the list of demonstrations is painted: tasks as headings, demonstrations in two lines."""

from __future__ import annotations

from PySide6.QtCore import QObject, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QPainter
from PySide6.QtWidgets import QStyle, QStyledItemDelegate, QStyleOptionViewItem

from forcelab.gui.demonstration_model import (
    DemonstrationModel,
    DemonstrationRow,
    TaskGroup,
    percent,
)
from forcelab.gui.figures.colormap import translucent
from forcelab.gui.figures.text import NAMES
from forcelab.gui.icons import paint_icon
from forcelab.gui.item_views import (
    ABOVE,
    GAP,
    SIDE,
    SMALL,
    Index,
    draw_line,
    paint_chevron,
    paint_row_background,
    smaller,
)
from forcelab.gui.theme import Colours, colours

#: The bar's width and thickness, in heights of the smaller line, and its most of a row's width.
BAR_WIDTH, BAR_THICKNESS, BAR_SHARE = 3.6, 0.32, 0.18


class RowPainter(QStyledItemDelegate):
    """Paints tasks as headings and demonstrations as two lines each."""

    def __init__(self, model: DemonstrationModel, parent: QObject) -> None:
        super().__init__(parent)
        self._model = model

    def sizeHint(self, option: QStyleOptionViewItem, index: Index) -> QSize:
        """One line for a task, two for a demonstration."""
        height = QFontMetricsF(option.font).height()
        if isinstance(self._model.at(index), TaskGroup):
            return QSize(0, round(height * 1.7))
        return QSize(0, round(height * (1 + SMALL + 3 * ABOVE)))

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        item = self._model.at(index)
        painter.save()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        is_open = isinstance(item, DemonstrationRow) and item.info.id == self._model.opened
        paint_row_background(painter, option, is_open)
        if isinstance(item, TaskGroup):
            _paint_group(painter, option, item)
        elif item is not None:
            _paint_row(painter, option, item, is_open)
        painter.restore()


def _paint_group(painter: QPainter, option: QStyleOptionViewItem, group: TaskGroup) -> None:
    """A task: its chevron, its name, and how many of its demonstrations are done."""
    theme, box = colours(), QRectF(option.rect)
    font = QFont(option.font)
    font.setBold(True)
    height = QFontMetricsF(option.font).height()
    expanded = bool(option.state & QStyle.StateFlag.State_Open)
    left, right = box.left() + SIDE * height, box.right() - SIDE * height
    paint_chevron(painter, QPointF(left + 0.25 * height, box.center().y()), height, expanded)
    left += height * 0.9
    count = f"{group.finished}/{len(group.rows)}"
    small = smaller(option.font)
    room = QFontMetricsF(small).horizontalAdvance(count)
    where = QRectF(right - room - 1, box.top(), room + 1, box.height())
    draw_line(painter, where, count, small, theme.muted)
    name = group.task or "No task"
    where = QRectF(left, box.top(), right - room - GAP * height - left, box.height())
    draw_line(painter, where, name, font, theme.text, elide=NAMES)


def _paint_row(
    painter: QPainter, option: QStyleOptionViewItem, row: DemonstrationRow, is_open: bool
) -> None:
    """A demonstration: name and icons above; bar, percent and the other authors below."""
    theme, box = colours(), QRectF(option.rect)
    font = QFont(option.font)
    font.setBold(is_open)
    height = QFontMetricsF(option.font).height()
    left, right = box.left() + SIDE * height + 0.9 * height, box.right() - SIDE * height
    top = box.top() + ABOVE * height
    side = 0.85 * height
    edge = right
    for mark, ink in _marks(row, theme):
        where = QRectF(edge - side, top + (height - side) / 2, side, side)
        paint_icon(painter, where, mark, QColor(ink))
        edge -= side + GAP * height
    where = QRectF(left, top, edge - left, height)
    draw_line(painter, where, row.info.name, font, theme.text, elide=NAMES)

    small = smaller(option.font)
    sizes = QFontMetricsF(small)
    line = QRectF(left, top + height + ABOVE * height, right - left, sizes.height())
    wide = min(BAR_WIDTH * height, BAR_SHARE * box.width())
    bar = QRectF(line.left(), 0, wide, BAR_THICKNESS * height)
    bar.moveCenter(QPointF(bar.center().x(), line.center().y()))
    _paint_bar(painter, bar, row.share, theme)
    digits = sizes.horizontalAdvance("100 %")
    where = QRectF(bar.right() + GAP * height, line.top(), digits + 1, line.height())
    ink = theme.text if row.share else theme.muted
    draw_line(painter, where, f"{percent(row.share)} %", small, ink, Qt.AlignmentFlag.AlignRight)
    names = "others hidden" if row.blind else ", ".join(name for name, _ in row.others)
    line.setLeft(where.right() + 1.5 * GAP * height)
    draw_line(painter, line, names, small, theme.muted)


def _marks(row: DemonstrationRow, theme: Colours) -> list[tuple[str, str]]:
    """The icons of a demonstration and their colours, from the right."""
    marks = [("video", theme.muted)] if row.info.has_video else []
    if row.done:
        marks.append(("check", theme.text))
    elif row.blind:
        marks.append(("eye-off", theme.warning))
    elif row.assignment is not None:
        marks.append(("person", theme.text))
    if row.notes:
        marks.append(("note", theme.text))
    return marks


def _paint_bar(painter: QPainter, bar: QRectF, share: float, theme: Colours) -> None:
    """The labelled share as a bar."""
    radius = bar.height() / 2
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(translucent(theme.frame, 0.6))
    painter.drawRoundedRect(bar, radius, radius)
    if share > 0:
        # Never shorter than it is thick, so that a beginning is seen.
        length = max(bar.width() * share, bar.height())
        painter.setBrush(QColor(theme.curves[0]))
        painter.drawRoundedRect(QRectF(bar.left(), bar.top(), length, bar.height()), radius, radius)
