"""The list of the queue: its Qt model, how rows are painted, and the keys that move through it."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import accumulate
from typing import Any, Literal, get_args

from PySide6.QtCore import (
    QAbstractListModel,
    QModelIndex,
    QObject,
    QPointF,
    QRectF,
    QSize,
    Qt,
    Signal,
)
from PySide6.QtGui import (
    QColor,
    QFont,
    QFontMetricsF,
    QKeyEvent,
    QPainter,
    QPen,
)
from PySide6.QtWidgets import (
    QAbstractItemView,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
)

from forcelab.gui.figures.text import NAMES
from forcelab.gui.figures.tracks import LabelStyle
from forcelab.gui.item_views import (
    ABOVE,
    GAP,
    NOWHERE,
    SIDE,
    SMALL,
    Index,
    RowList,
    draw_line,
    paint_chevron,
    paint_row_background,
    smaller,
)
from forcelab.gui.label.swatches import paint_swatch, style_of
from forcelab.gui.theme import colours, themes
from forcelab.labels import Interval
from forcelab.project import StoredVerdict
from forcelab.recognition.label_noise import SUSPECT
from forcelab.review.differences import Difference
from forcelab.review.queue import Queue
from forcelab.vocabulary import Vocabulary

SectionKind = Literal["suspected", "actions", "missed", "boundaries", "invented", "judged"]

#: Sections that are folded at first: many and small, or no mistakes, or done with.
FOLDED_AT_FIRST = frozenset({"boundaries", "invented", "judged"})

#: The title of each section, and what is in it.
SECTION_TEXTS = {
    "suspected": (
        "Suspected coding errors",
        "A recogniser that has not seen them contradicts, where it is usually right.",
    ),
    "actions": ("Wrong actions", "Both see an action, not the same one: human → model."),
    "missed": ("Missed by the model", "Labelled, and the model sees nothing."),
    "boundaries": (
        "Boundaries only",
        "Both see the same actions; only the edge between them differs.",
    ),
    "invented": (
        "Labelled by the model only",
        "Unlabelled time, which is never scored, where the model sees an action.",
    ),
    "judged": ("Judged", "All judged places, the latest first."),
}
VERDICT_NAMES = {"human": "human right", "model": "model right", "ambiguous": "ambiguous"}


def action_name(action: str | None) -> str:
    return "unlabelled" if action is None else action


#: What is listed: a difference, or a verdict on one.
QueueItem = Difference | StoredVerdict


@dataclass(frozen=True, slots=True)
class QueueSection:
    """One part of the queue."""

    kind: SectionKind
    listed: tuple[QueueItem, ...]  # what the filter lets through
    total: int  # without the filter

    def __len__(self) -> int:
        return len(self.listed)

    @property
    def title(self) -> str:
        return SECTION_TEXTS[self.kind][0]

    @property
    def explained(self) -> str:
        return SECTION_TEXTS[self.kind][1]

    @property
    def percentages(self) -> str:
        if self.kind == "suspected":
            return "suspicion"
        sure = any(isinstance(d, Difference) and d.confidence is not None for d in self.listed[:1])
        return "confidence" if sure else ""

    @property
    def tip(self) -> str:
        """What is in it, what its percentages are, and its order by these."""
        order = "how sure the model is; what is long and sure comes first."
        if self.kind == "suspected":
            order = "how much speaks for an error of the coder, the largest first."
        return f"{self.explained}\nPercentages: {order}" if self.percentages else self.explained


class QueueModel(QAbstractListModel):
    """Sections one below the other, each a heading and, unless it is folded, its rows.

    Flat, and no row is made before it is painted: a queue of thousands is there at once.
    """

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.sections: tuple[QueueSection, ...] = ()
        self.names: Mapping[str, str] = {}  # the demonstrations', by their ids
        self.folded: set[str] = set(FOLDED_AT_FIRST)
        self._heads: tuple[int, ...] = (0,)  # the rows of the headings, and how many rows there are

    def show(self, queue: Queue, names: Mapping[str, str], text: str = "") -> bool:
        """Show what of a queue has a text in action or demonstration; gives whether it changed."""
        text = text.strip().casefold()

        def fits(about: Interval) -> bool:
            actions = action_name(about.human), action_name(about.predicted)
            return any(text in t.casefold() for t in (*actions, names.get(about.demonstration, "")))

        sections = []
        for kind in get_args(SectionKind):
            items = tuple(getattr(queue, kind))
            if listed := tuple(filter(fits, items)) if text else items:
                sections.append(QueueSection(kind, listed, len(items)))
        if (tuple(sections), names) == (self.sections, self.names):
            return False
        self.beginResetModel()
        self.sections, self.names = tuple(sections), names
        self._count()
        self.endResetModel()
        return True

    def fold(self, number: int, folded: bool) -> None:
        section = self.sections[number]
        if folded == (section.kind in self.folded):
            return
        first = self._heads[number] + 1
        begin, end = self.beginInsertRows, self.endInsertRows
        if folded:
            begin, end = self.beginRemoveRows, self.endRemoveRows
        begin(NOWHERE, first, first + len(section) - 1)
        self.folded ^= {section.kind}
        self._count()
        end()

    def _count(self) -> None:
        """Count anew in which rows the headings are."""
        rows = (1 + (0 if s.kind in self.folded else len(s)) for s in self.sections)
        self._heads = tuple(accumulate(rows, initial=0))

    def where(self, row: int) -> tuple[int, int]:
        """The section of a row, and the item in it; -1 for the heading."""
        number = bisect_right(self._heads, row) - 1
        return number, row - self._heads[number] - 1

    def row(self, number: int, item: int = -1) -> int:
        """The row of a section's heading, or of an item of a section that is not folded."""
        return self._heads[number] + 1 + item

    def find(self, place: Interval) -> tuple[int, int] | None:
        """The section and the item of an interval, also in folded sections; None if in none."""
        sought = place.start, place.end, place.demonstration
        for number, section in enumerate(self.sections):
            for item, about in enumerate(section.listed):
                if (about.start, about.end, about.demonstration) == sought:
                    return number, item
        return None

    def at(self, index: Index) -> QueueItem | QueueSection | None:
        if not index.isValid():
            return None
        number, item = self.where(index.row())
        section = self.sections[number]
        return section if item < 0 else section.listed[item]

    # What Qt asks

    def rowCount(self, parent: Index = NOWHERE) -> int:
        return 0 if parent.isValid() else self._heads[-1]

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        item = self.at(index)
        if item is None:
            return None
        if isinstance(item, QueueSection):
            folded = ", folded" if item.kind in self.folded else ""
            shown, spoken, tip = item.title, f"{item.title}: {item.total}{folded}", item.tip
        else:
            texts = item_text(item, self.names.get(item.demonstration, ""))
            shown = spoken = "; ".join(texts)
            tip = "\n".join(texts)
        return {
            Qt.ItemDataRole.DisplayRole: shown,
            Qt.ItemDataRole.AccessibleTextRole: spoken,
            Qt.ItemDataRole.ToolTipRole: tip,
        }.get(Qt.ItemDataRole(role))


def item_text(about: QueueItem, name: str) -> list[str]:
    parts = [
        f"Human: {action_name(about.human)}",
        f"Model: {action_name(about.predicted)}",
        f"{name}, {about.start:.3f} to {about.end:.3f} s",
    ]
    if isinstance(about, StoredVerdict):
        parts.append(f"Judged by {about.author}: {VERDICT_NAMES[about.verdict]}")
        return parts
    if about.confidence is not None:
        parts.append(f"Confidence of the model: {100 * about.confidence:.0f} %")
    if about.suspicion:
        parts.append(f"Suspicion of a coding error: {100 * about.suspicion:.0f} %")
    return parts


RIGHT = Qt.AlignmentFlag.AlignRight


class QueuePainter(QStyledItemDelegate):
    """Paints sections as headings and their items as two lines each."""

    def __init__(
        self, model: QueueModel, vocabulary: Callable[[], Vocabulary], parent: QObject
    ) -> None:
        super().__init__(parent)
        self._model, self._vocabulary = model, vocabulary

    def sizeHint(self, option: QStyleOptionViewItem, _index: Index) -> QSize:
        return QSize(0, round(QFontMetricsF(option.font).height() * (1 + SMALL + 3 * ABOVE)))

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        item = self._model.at(index)
        painter.save()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        selected = bool(option.state & QStyle.StateFlag.State_Selected)
        paint_row_background(painter, option, selected and isinstance(item, QueueItem))
        if isinstance(item, QueueSection):
            self._paint_section(painter, option, item)
        elif item is not None:
            self._paint_item(painter, option, item)
        painter.restore()

    def _paint_section(
        self, painter: QPainter, option: QStyleOptionViewItem, section: QueueSection
    ) -> None:
        theme, box = colours(), QRectF(option.rect)
        height = QFontMetricsF(option.font).height()
        left, right = box.left() + SIDE * height, box.right() - SIDE * height
        line = QRectF(left + 0.9 * height, box.top() + ABOVE * height, 0, height)
        line.setRight(right)
        centre = QPointF(left + 0.25 * height, line.center().y())
        paint_chevron(painter, centre, height, section.kind not in self._model.folded)
        listed = len(section)
        count = str(listed) if listed == section.total else f"{listed}/{section.total}"
        small = smaller(option.font)
        draw_line(painter, line, count, small, theme.muted, RIGHT)
        below = QRectF(
            line.left(), line.bottom() + 0.5 * ABOVE * height, line.width(), SMALL * height
        )
        line.setRight(right - QFontMetricsF(small).horizontalAdvance(count) - GAP * height)
        face = QFont(option.font)
        face.setBold(True)
        ink = theme.warning if section.kind == "suspected" else theme.text
        draw_line(painter, line, section.title, face, ink)
        if rated := section.percentages:  # as the head of the percentages below it
            draw_line(painter, below, rated, small, theme.text, RIGHT)
            wide = QFontMetricsF(small).horizontalAdvance(rated)
            below.setRight(right - wide - 2 * GAP * height)
        draw_line(painter, below, section.explained, small, theme.muted)

    def _paint_item(
        self, painter: QPainter, option: QStyleOptionViewItem, place: QueueItem
    ) -> None:
        """A difference: human, arrow, model and how sure above; where and how long below."""
        theme, box = colours(), QRectF(option.rect)
        face, small = option.font, smaller(option.font)
        height = QFontMetricsF(face).height()
        left, right = box.left() + SIDE * height + 0.9 * height, box.right() - SIDE * height
        line = QRectF(left, box.top() + ABOVE * height, right - left, height)
        text = _verdict_or_probability(place)
        room = QFontMetricsF(face).horizontalAdvance(text) + 1 if text else 0.0
        draw_line(painter, line, text, face, theme.text, RIGHT)
        line.setRight(right - room - (GAP * height if text else 0))
        self._paint_names(painter, line, face, (place.human, place.predicted))
        sizes = QFontMetricsF(small)
        below = QRectF(left, line.bottom() + ABOVE * height, right - left, sizes.height())
        seconds = f"{place.duration:.2f} s"
        draw_line(painter, below, seconds, small, theme.muted, RIGHT)
        span = f"{place.start:.2f}–{place.end:.2f} s"
        below.setRight(right - sizes.horizontalAdvance(seconds) - GAP * height - 1)
        wide = sizes.horizontalAdvance(span) + GAP * height
        name = QRectF(below)
        name.setRight(below.right() - wide)
        demonstration = self._model.names.get(place.demonstration, "")
        written = draw_line(painter, name, demonstration, small, theme.muted, elide=NAMES)
        below.setLeft(left + (written + GAP * height if written else 0))
        draw_line(painter, below, span, small, theme.muted)

    def _paint_names(
        self, painter: QPainter, line: QRectF, face: QFont, actions: tuple[str | None, str | None]
    ) -> None:
        """Swatch and name of what the human labelled, an arrow, and those of the prediction."""
        theme, metrics = colours(), QFontMetricsF(face)
        height = metrics.height()
        side, gap, arrow = round(0.72 * height), GAP * height, 1.1 * height
        room = line.width() - 2 * side - 4 * gap - arrow
        widths = [metrics.horizontalAdvance(action_name(action)) + 1 for action in actions]
        if sum(widths) > room:  # a short name leaves its room to a long one
            least = min(room / 2, *widths)
            widths = [w if w == least else room - least for w in widths]
            if widths[0] == widths[1]:
                widths = [room / 2, room / 2]
        x = line.left()
        for i, (action, width) in enumerate(zip(actions, widths, strict=True)):
            if i:
                _paint_arrow(painter, QRectF(x, line.top(), arrow, height))
                x += arrow + gap
            box = QRectF(round(x), round(line.center().y() - side / 2), side, side)
            paint_swatch(painter, box, self._style(action))
            x += side + gap
            ink = theme.muted if action is None else theme.text
            where = QRectF(x, line.top(), max(width, 0), height)
            x += draw_line(painter, where, action_name(action), face, ink, elide=NAMES) + gap

    def _style(self, action: str | None) -> LabelStyle:
        if action is None:
            return LabelStyle("", QColor(colours().unlabelled))
        return style_of(self._vocabulary(), action)


def _verdict_or_probability(about: QueueItem) -> str:
    if isinstance(about, StoredVerdict):
        return VERDICT_NAMES[about.verdict]
    if about.suspicion >= SUSPECT:  # by which these are in order
        return f"{100 * about.suspicion:.0f} %"
    return "" if about.confidence is None else f"{100 * about.confidence:.0f} %"


def _paint_arrow(painter: QPainter, box: QRectF) -> None:
    pen = QPen(QColor(colours().muted), 1.3)
    pen.setCapStyle(Qt.PenCapStyle.RoundCap)
    painter.setPen(pen)
    middle, tip = box.center().y(), 0.22 * box.height()
    left, right = box.left() + 1, box.right() - 1
    painter.drawLine(QPointF(left, middle), QPointF(right, middle))
    upper, lower = QPointF(right - tip, middle - tip), QPointF(right - tip, middle + tip)
    painter.drawPolyline([upper, QPointF(right, middle), lower])


class QueueList(RowList):
    """The rows; `chosen` holds an interval, `withdrawn` follows Delete."""

    chosen = Signal(object)
    withdrawn = Signal()

    def __init__(self, model: QueueModel, vocabulary: Callable[[], Vocabulary]) -> None:
        super().__init__(model)
        self._model = model
        self._last = 0  # where in the order the marked item stood last
        self.setItemDelegate(QueuePainter(model, vocabulary, self))
        self.setAccessibleName("Where labels and predictions differ")
        self.setFrameShape(RowList.Shape.NoFrame)
        self.setMouseTracking(True)
        self.clicked.connect(self._show_or_fold)
        self.opened.connect(self._show_or_fold)
        themes().changed.connect(self.viewport().update)

    @property
    def current(self) -> QueueItem | None:
        item = self._model.at(self.currentIndex())
        return None if isinstance(item, QueueSection) else item

    @property
    def waiting(self) -> list[int]:
        """The rows with something to judge, in unfolded sections."""
        model = self._model
        return [
            model.row(number, item)
            for number, section in enumerate(model.sections)
            if section.kind not in {"judged", *model.folded}
            for item in range(len(section))
        ]

    def beside(self, direction: int) -> tuple[Interval, bool]:
        """The place of the next open item or of the one before, and whether it wrapped around.

        Where the marked one has gone, its place in the order counts. There must be an open item.
        """
        rows, position = self.waiting, self._position()
        if position is None:
            position = self._last - (direction > 0)
        target = position + direction
        number, item = self._model.where(rows[target % len(rows)])
        return self._model.sections[number].listed[item], not 0 <= target < len(rows)

    def after(self) -> Interval | None:
        """What comes after the current item; None where it is the only one."""
        if self._position() is None or len(self.waiting) < 2:
            return None
        return self.beside(1)[0]

    def _position(self) -> int | None:
        """The index of the marked item among the open ones."""
        rows, row = self.waiting, self.currentIndex().row()
        return rows.index(row) if row in rows else None

    def mark(self, place: Interval | None, unfold: bool = True) -> None:
        """Mark an interval, if it is listed, and bring it into view, unfolding its section."""
        position = None if place is None else self._model.find(place)
        if position is not None and self._model.sections[position[0]].kind in self._model.folded:
            if unfold:
                self._model.fold(position[0], False)
            else:
                position = None
        index = QModelIndex() if position is None else self._model.index(self._model.row(*position))
        if not index.isValid():
            self.clearSelection()
        if index != self.currentIndex():
            self.setCurrentIndex(index)
        if index.isValid():
            self._last = self._position() or 0
            self.scrollTo(index, QAbstractItemView.ScrollHint.EnsureVisible)

    @property
    def folded(self) -> list[QueueSection]:
        """The folded sections with something to judge."""
        folded = self._model.folded - {"judged"}
        return [section for section in self._model.sections if section.kind in folded]

    def unfold_first(self) -> bool:
        """Unfold the first section with something to judge; gives whether there is one."""
        if not self.folded:
            return False
        self._model.fold(self._model.sections.index(self.folded[0]), False)
        return True

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Delete:
            self.withdrawn.emit()
        else:
            super().keyPressEvent(event)

    def _show_or_fold(self, index: QModelIndex) -> None:
        """Show an interval; fold or unfold a section."""
        item = self._model.at(index)
        if isinstance(item, QueueSection):
            number, _ = self._model.where(index.row())
            self._model.fold(number, item.kind not in self._model.folded)
        elif item is not None:
            self.chosen.emit(item)
