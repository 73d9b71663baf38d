"""Painting a row of the queue: what human and model see, where, for how long and how surely."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QObject, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QPainter, QPen, QPolygonF
from PySide6.QtWidgets import QStyle, QStyledItemDelegate, QStyleOptionViewItem

from forcelab.gui.figures.shades import translucent
from forcelab.gui.figures.text import NAMES
from forcelab.gui.figures.tracks import Look
from forcelab.gui.indexes import Index
from forcelab.gui.label.swatches import look_of, paint_swatch
from forcelab.gui.review.queue_model import Item, QueueModel, Section
from forcelab.gui.review.queue_words import action_name, verdict_name
from forcelab.gui.row_painting import (
    ABOVE,
    GAP,
    HOVERED,
    SELECTED,
    SIDE,
    SMALL,
    STRIPE,
    paint_chevron,
    put_line,
    smaller,
)
from forcelab.gui.theme import colours
from forcelab.project import StoredVerdict
from forcelab.recognition.label_noise import SUSPECT
from forcelab.vocabulary import Vocabulary

__all__ = ["QueuePainter", "row_height"]

RIGHT = Qt.AlignmentFlag.AlignRight


class QueuePainter(QStyledItemDelegate):
    """Paints sections as headings and what is in them as two lines each.

    Parameters
    ----------
    model : QueueModel
    vocabulary : callable
        Gives the vocabulary whose colours and textures are drawn.
    parent : QObject
    """

    def __init__(
        self, model: QueueModel, vocabulary: Callable[[], Vocabulary], parent: QObject
    ) -> None:
        super().__init__(parent)
        self._model, self._vocabulary = model, vocabulary

    def sizeHint(self, option: QStyleOptionViewItem, _index: Index) -> QSize:
        """Two lines, for sections as for items."""
        return QSize(0, row_height(option.font))

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        """Paint one row."""
        item = self._model.at(index)
        painter.save()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        _paint_ground(painter, option, isinstance(item, Item))
        if isinstance(item, Section):
            _paint_section(painter, option, item, item.kind not in self._model.folded)
        elif item is not None:
            place = item.place
            looks = self._look(place.human), self._look(place.predicted)
            _paint_item(painter, option, item, looks)
        painter.restore()

    def _look(self, action: str | None) -> Look:
        """How an action is drawn; unlabelled time as it is in tracks."""
        if action is None:
            return Look("", QColor(colours().unlabelled))
        return look_of(self._vocabulary(), action)


def row_height(font: QFont) -> int:
    """Pixels of a row: two lines, and what is left free around them."""
    return round(QFontMetricsF(font).height() * (1 + SMALL + 3 * ABOVE))


def _paint_ground(painter: QPainter, option: QStyleOptionViewItem, is_item: bool) -> None:
    """A row's ground: under the pointer, selected and so the one that is judged."""
    box, state = QRectF(option.rect), option.state
    accent = QColor(colours().accent)
    selected = bool(state & QStyle.StateFlag.State_Selected)
    share = SELECTED * selected + HOVERED * bool(state & QStyle.StateFlag.State_MouseOver)
    if share:
        tint = translucent(accent, share)
        painter.fillRect(box, tint)
    if selected and is_item:
        painter.fillRect(QRectF(box.left(), box.top(), STRIPE, box.height()), accent)
    if selected and state & QStyle.StateFlag.State_HasFocus:
        painter.setPen(QPen(accent, 1))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRect(box.adjusted(0.5, 0.5, -0.5, -0.5))


def _paint_section(
    painter: QPainter, option: QStyleOptionViewItem, section: Section, expanded: bool
) -> None:
    """A section: whether it is folded, its name and how many there are; what it holds below."""
    theme, box = colours(), QRectF(option.rect)
    height = QFontMetricsF(option.font).height()
    left, right = box.left() + SIDE * height, box.right() - SIDE * height
    line = QRectF(left + 0.9 * height, box.top() + ABOVE * height, 0, height)
    line.setRight(right)
    centre = QPointF(left + 0.25 * height, line.center().y())
    paint_chevron(painter, centre, height, expanded)
    shown = len(section)
    count = str(shown) if shown == section.total else f"{shown}/{section.total}"
    small = smaller(option.font)
    put_line(painter, line, count, small, theme.muted, RIGHT)
    below = QRectF(line.left(), line.bottom() + 0.5 * ABOVE * height, line.width(), SMALL * height)
    line.setRight(right - QFontMetricsF(small).horizontalAdvance(count) - GAP * height)
    face = QFont(option.font)
    face.setBold(True)
    ink = theme.warning if section.kind == "suspected" else theme.text
    put_line(painter, line, section.title, face, ink)
    if rated := section.rated:  # as the head of the percentages below it
        put_line(painter, below, rated, small, theme.text, RIGHT)
        wide = QFontMetricsF(small).horizontalAdvance(rated)
        below.setRight(right - wide - 2 * GAP * height)
    put_line(painter, below, section.explained, small, theme.muted)


def _paint_item(
    painter: QPainter, option: QStyleOptionViewItem, item: Item, looks: tuple[Look, Look]
) -> None:
    """A difference: human, arrow, model and how sure above; where and how long below."""
    theme, box, place = colours(), QRectF(option.rect), item.place
    face, small = option.font, smaller(option.font)
    height = QFontMetricsF(face).height()
    left, right = box.left() + SIDE * height + 0.9 * height, box.right() - SIDE * height
    line = QRectF(left, box.top() + ABOVE * height, right - left, height)
    told = _told(item)
    room = QFontMetricsF(face).horizontalAdvance(told) + 1 if told else 0.0
    put_line(painter, line, told, face, theme.text, RIGHT)
    line.setRight(right - room - (GAP * height if told else 0))
    names = (action_name(place.human), action_name(place.predicted))
    _paint_names(painter, line, face, names, looks, (place.human, place.predicted))
    sizes = QFontMetricsF(small)
    below = QRectF(left, line.bottom() + ABOVE * height, right - left, sizes.height())
    seconds = f"{place.duration:.2f} s"
    put_line(painter, below, seconds, small, theme.muted, RIGHT)
    span = f"{place.start:.2f}–{place.end:.2f} s"
    below.setRight(right - sizes.horizontalAdvance(seconds) - GAP * height - 1)
    wide = sizes.horizontalAdvance(span) + GAP * height
    name = QRectF(below)
    name.setRight(below.right() - wide)
    written = put_line(painter, name, item.name, small, theme.muted, elide=NAMES)
    below.setLeft(left + (written + GAP * height if written else 0))
    put_line(painter, below, span, small, theme.muted)


def _told(item: Item) -> str:
    """What stands at the right: how suspect, how sure, or who is right."""
    about = item.about
    if isinstance(about, StoredVerdict):
        return verdict_name(about.verdict)
    if about.suspicion >= SUSPECT:  # by which these are in order
        return f"{100 * about.suspicion:.0f} %"
    return "" if about.confidence is None else f"{100 * about.confidence:.0f} %"


def _paint_names(
    painter: QPainter,
    line: QRectF,
    face: QFont,
    names: tuple[str, str],
    looks: tuple[Look, Look],
    actions: tuple[str | None, str | None],
) -> None:
    """Swatch and name of what the human sees, an arrow, and those of what the model sees."""
    theme, metrics = colours(), QFontMetricsF(face)
    height = metrics.height()
    side, gap, arrow = round(0.72 * height), GAP * height, 1.1 * height
    room = line.width() - 2 * side - 4 * gap - arrow
    widths = [metrics.horizontalAdvance(name) + 1 for name in names]
    if sum(widths) > room:  # a short name leaves its room to a long one
        least = min(room / 2, *widths)
        widths = [w if w == least else room - least for w in widths]
        if widths[0] == widths[1]:
            widths = [room / 2, room / 2]
    x = line.left()
    for i, (name, look, width, action) in enumerate(
        zip(names, looks, widths, actions, strict=True)
    ):
        if i:
            _paint_arrow(painter, QRectF(x, line.top(), arrow, height))
            x += arrow + gap
        box = QRectF(round(x), round(line.center().y() - side / 2), side, side)
        paint_swatch(painter, box, look)
        x += side + gap
        ink = theme.muted if action is None else theme.text
        where = QRectF(x, line.top(), max(width, 0), height)
        x += put_line(painter, where, name, face, ink, elide=NAMES) + gap


def _paint_arrow(painter: QPainter, box: QRectF) -> None:
    """From what the human sees to what the model sees."""
    pen = QPen(QColor(colours().muted), 1.3)
    pen.setCapStyle(Qt.PenCapStyle.RoundCap)
    painter.setPen(pen)
    middle, tip = box.center().y(), 0.22 * box.height()
    left, right = box.left() + 1, box.right() - 1
    painter.drawLine(QPointF(left, middle), QPointF(right, middle))
    painter.drawPolyline(
        QPolygonF(
            [
                QPointF(right - tip, middle - tip),
                QPointF(right, middle),
                QPointF(right - tip, middle + tip),
            ]
        )
    )
