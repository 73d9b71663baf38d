"""The kappa of every two coders as a matrix whose cells are clicked, and its words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFont, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QToolTip, QWidget

from forcelab.gui.figures.shades import shade
from forcelab.gui.figures.text import NAMES, ink_on
from forcelab.gui.review.moving import ARROWS, plain
from forcelab.gui.theme import colours, themes

if TYPE_CHECKING:
    from forcelab.review.agreement import Agreement, PairAgreement

__all__ = ["CoderMatrix", "word"]


#: Narrowest and widest cell in widths of a digit, its height in lines, and room around texts.
NARROWEST, WIDEST, LINES, PADDING = 6.5, 18.0, 2.5, 6
#: Kappa below which all cells are as light: chance agreement and worse.
LIGHTEST = 0.0


def word(kappa: float) -> str:
    """The word of Landis and Koch (1977) for a kappa."""
    from forcelab.review.agreement import landis_koch

    return {
        "poor": "poor",
        "slight": "slight",
        "fair": "fair",
        "moderate": "moderate",
        "substantial": "substantial",
        "almost perfect": "almost perfect",
    }[landis_koch(kappa)]


class CoderMatrix(QWidget):
    """Coders against coders: kappa and its word; the darker, the better they agree.

    Signals
    -------
    chosen(PairAgreement)
        A pair was clicked, or reached with the arrow keys.
    """

    chosen = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self.authors: tuple[str, ...] = ()
        self.at = (0, 1)
        self._found: Agreement | None = None
        self.setAccessibleName("Kappa of every two coders")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setMouseTracking(True)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        themes().changed.connect(self.update)

    def show_agreement(self, found: Agreement) -> None:
        """Show what was found, and keep the pair that is chosen if it is there still."""
        kept = self.pair
        self._found, self.authors = found, found.authors
        cells = [self._cell_of(pair) for pair in found.pairs]
        names = None if kept is None else (kept.a, kept.b)
        same = [self._cell_of(p) for p in found.pairs if (p.a, p.b) == names]
        self.at = (*same, *cells, (0, 1))[0]
        self.updateGeometry()
        self._tell()

    @property
    def pair(self) -> PairAgreement | None:
        """The pair that is chosen."""
        return self._pair_at(*self.at) if max(self.at) < len(self.authors) else None

    def choose(self, row: int, column: int) -> None:
        """Choose a pair by its cell."""
        inside = 0 <= row < len(self.authors) and 0 <= column < len(self.authors)
        if inside and row != column:
            self.at = (row, column)
            self._tell()

    def cell(self, row: int, column: int) -> QRectF:
        """Where a cell lies, in pixels."""
        left, top, wide, high = self._layout()
        return QRectF(left + column * wide, top + row * high, wide, high)

    def sizeHint(self) -> QSize:
        """Room for every cell."""
        high = round((len(self.authors) * LINES + 1.8) * self.fontMetrics().height())
        return QSize(320, high + 2)

    def minimumSizeHint(self) -> QSize:
        """As high as it is; names are cut."""
        return QSize(160, self.sizeHint().height())

    def keeps(self, event: QKeyEvent) -> bool:
        """Whether a key is an arrow, which is the window's too."""
        return event.key() in ARROWS and plain(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """The arrow keys go from pair to pair."""
        step = ARROWS.get(Qt.Key(event.key()))
        if step is None:
            super().keyPressEvent(event)
            return
        row, column = self.at[0] + step[0], self.at[1] + step[1]
        if row == column:  # nobody is compared with himself: on to the next
            row, column = row + step[0], column + step[1]
        self.choose(row, column)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Choose the pair that is clicked."""
        if (spot := self._spot(event.position())) is not None:
            self.choose(*spot)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Tell what lies under the pointer, as names may be cut."""
        spot = self._spot(event.position())
        self.setToolTip("" if spot is None else self._told(*spot))
        if spot is None:
            QToolTip.hideText()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw names and cells."""
        with QPainter(self) as painter:
            theme, metrics = colours(), self.fontMetrics()
            left, top, wide, high = self._layout()
            middle = Qt.AlignmentFlag.AlignCenter
            for i, name in enumerate(self.authors):
                painter.setPen(QColor(theme.text))
                row = QRectF(0, top + i * high, left - PADDING, high)
                shown = metrics.elidedText(name, NAMES, int(row.width()))
                painter.drawText(
                    row, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignRight, shown
                )
                head = QRectF(left + i * wide, 0, wide, top)
                room = int(wide - PADDING)
                painter.drawText(head, middle, metrics.elidedText(name, NAMES, room))
            for row_number in range(len(self.authors)):
                for column in range(len(self.authors)):
                    self._paint_cell(painter, row_number, column)
            if self.pair is not None:
                painter.setPen(QPen(QColor(theme.text), 3 if self.hasFocus() else 2))
                painter.setBrush(Qt.BrushStyle.NoBrush)
                painter.drawRect(self.cell(*self.at).adjusted(1, 1, -1, -1))

    def _paint_cell(self, painter: QPainter, row: int, column: int) -> None:
        """Draw one cell: kappa and word; or on the diagonal how much the coder labelled."""
        theme, box = colours(), self.cell(row, column).adjusted(1, 1, -1, -1)
        middle = Qt.AlignmentFlag.AlignCenter
        pair = self._pair_at(row, column)
        kappa = None if pair is None else pair.kappa
        if kappa is None:
            painter.fillRect(box, QColor(theme.panel))
            painter.setPen(QColor(theme.muted))
            count = self._labelled(self.authors[row]) if row == column else None
            text = "–" if count is None else f"{count} coded"
            room = int(box.width())
            cut = self.fontMetrics().elidedText(text, Qt.TextElideMode.ElideRight, room)
            painter.drawText(box, middle, cut)
            return
        ground = shade(max(kappa, LIGHTEST))
        painter.fillRect(box, ground)
        painter.setPen(ink_on(ground))
        bold = QFont(self.font())
        bold.setBold(True)
        painter.setFont(bold)
        upper = QRectF(box.left(), box.top() + 2, box.width(), box.height() / 2)
        painter.drawText(upper, middle, f"{kappa:.2f}".replace("-", "\N{MINUS SIGN}"))
        painter.setFont(self.font())
        lower = QRectF(box.left(), box.center().y() - 1, box.width(), box.height() / 2)
        room = int(box.width() - 4)
        shown = self.fontMetrics().elidedText(word(kappa), Qt.TextElideMode.ElideRight, room)
        painter.drawText(lower, middle, shown)

    def _layout(self) -> tuple[float, float, float, float]:
        """Left and top of the cells, their width and height, in pixels."""
        metrics, count = self.fontMetrics(), max(len(self.authors), 1)
        digit = metrics.horizontalAdvance("0")
        names = max((metrics.horizontalAdvance(name) for name in self.authors), default=0)
        left = min(names + 2 * PADDING, 0.3 * self.width())
        wide = min(max((self.width() - left - 1) / count, NARROWEST * digit), WIDEST * digit)
        return left, 1.6 * metrics.height(), wide, LINES * metrics.height()

    def _spot(self, where: QPointF) -> tuple[int, int] | None:
        """The cell at a point."""
        left, top, wide, high = self._layout()
        row, column = int((where.y() - top) // high), int((where.x() - left) // wide)
        count = len(self.authors)
        return (row, column) if 0 <= row < count and 0 <= column < count else None

    def _pair_at(self, row: int, column: int) -> PairAgreement | None:
        """What was found for a cell."""
        if self._found is None or row == column:
            return None
        return self._found.pair(self.authors[row], self.authors[column])

    def _cell_of(self, pair: PairAgreement) -> tuple[int, int]:
        """The cell of a pair, below which it is mirrored."""
        return self.authors.index(pair.a), self.authors.index(pair.b)

    def _labelled(self, author: str) -> int:
        """How many demonstrations a coder labelled."""
        counts = {} if self._found is None else self._found.counts
        return sum(counts.get(author, {}).values())

    def _told(self, row: int, column: int) -> str:
        """A cell in words."""
        a, b = self.authors[row], self.authors[column]
        if row == column:
            text = "{0}: {1} demonstrations labelled"
            return text.format(a, self._labelled(a))
        pair = self._pair_at(row, column)
        if pair is None:
            return f"{a} and {b} have no demonstration in common"
        if pair.kappa is None:
            return f"{a} and {b}: no kappa, as only one action was labelled"
        text = "{0} and {1}: kappa {2:.3f}, {3} (Landis and Koch); {4} demonstrations"
        return text.format(a, b, pair.kappa, word(pair.kappa), len(pair.demonstrations))

    def _tell(self) -> None:
        """Draw it, and hand on what is chosen."""
        if self.authors:
            self.setAccessibleDescription(self._told(*self.at) if self.pair else "")
        self.update()
        self.chosen.emit(self.pair)
