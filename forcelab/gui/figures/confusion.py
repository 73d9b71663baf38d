"""The confusion matrix: what the recogniser predicted where the coder labelled another action."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, QSizeF
from PySide6.QtGui import QColor, QLinearGradient, QPainter

from forcelab.gui.figures import text
from forcelab.gui.figures.colormap import COLORMAP_STOPS, colormap_colours
from forcelab.gui.figures.figure import LIGHT, MARGIN, Figure, Theme

#: Left free inside a cell on either side of its text.
PADDING = 2.0


#: The matrix is about this wide where its cells may have the size that takes.
MATRIX = 640.0
SMALLEST_CELL, LARGEST_CELL = 20.0, 64.0
#: For names; in a figure without heading, which has to be small.
NAME_ROOM, TIGHT_NAME_ROOM = 150.0, 96.0
#: Between the actions and the last column, unlabelled.
APART = 8.0
SIDE_TITLE = 22.0
BAR_WIDTH, BAR_HEIGHT = 12.0, 160.0
#: Without a heading, what is left free around the figure, and its smallest cell.
TIGHT, TIGHT_CELL = 10.0, 16.0
#: What colours and per cents are shares of.
KEYS = {
    "row": "Colour and per cent: share of the human label's {0} (row).",
    "column": "Colour and per cent: share of the prediction's {0} (column).",
    "counts": "Colour and number: {0}, as a share of the largest cell.",
}
#: How units are called in the key.
UNITS = {"samples": "samples", "s": "time in seconds", "segments": "segments"}


@dataclass(frozen=True, eq=False)
class ConfusionMatrix(Figure):
    """Counts of samples, seconds or segments by human and predicted action.

    `counts` has the shape (k, k + 1): rows are human, columns predicted, the last column counts
    what is predicted unlabelled; the sums of the rows stand below `total`. Colours and per cents
    are shares of a row, of a column, or, without per cents, of the largest cell. The cells take
    about `room` pixels together, as far as their sizes allow. Without being `headed` by title, key
    and scale it is as small as it can be. On a dark ground shades run from dark to light.
    """

    title: str
    actions: tuple[str, ...]
    counts: NDArray[np.int64] | NDArray[np.float64]
    theme: Theme = LIGHT
    unit: Literal["samples", "s", "segments"] = "samples"
    share: Literal["row", "column", "counts"] = "row"
    room: float = MATRIX
    headed: bool = True
    total: str = "total"

    @property
    def shares(self) -> NDArray[np.float64]:
        """Counts over their row's or column's total, or the largest; shape (k, k + 1)."""
        denominators = self._denominators
        return np.divide(
            self.counts, denominators, out=np.zeros(self.counts.shape), where=denominators > 0
        )

    @cached_property
    def _denominators(self) -> NDArray[np.float64]:
        """What each count is a share of, shape (k, k + 1)."""
        if self.share == "counts":
            total = self.counts.max(keepdims=True)
        else:
            total = self.counts.sum(axis=1 if self.share == "row" else 0, keepdims=True)
        return np.broadcast_to(total.astype(np.float64), self.counts.shape)

    @property
    def size(self) -> QSizeF:
        margin, wide = self._margin, self._totals_right
        if self.headed:
            bar = self._bar_left + BAR_WIDTH + 48
            wide = max(bar, margin + text.width(self._key, text.font(10)))
        return QSizeF(wide + margin, self._matrix.bottom() + margin)

    def box(self, row: int, column: int) -> QRectF:
        matrix, cell = self._matrix, self._cell
        apart = APART if column == len(self.actions) else 0.0
        left = matrix.left() + column * cell + apart
        return QRectF(left, matrix.top() + row * cell, cell, cell).adjusted(0.5, 0.5, -0.5, -0.5)

    def cell_at(self, point: QPointF) -> tuple[int, int] | None:
        """Row and column of the cell at a point in pixels, if any."""
        matrix, cell, k = self._matrix, self._cell, len(self.actions)
        x = point.x() - matrix.left()
        if x >= k * cell:
            x -= APART
            if x < k * cell:
                return None
        row, column = int((point.y() - matrix.top()) // cell), int(x // cell)
        return (row, column) if 0 <= row < k and 0 <= column <= k else None

    def paint(self, painter: QPainter) -> None:
        """Draw title, names, cells, totals and the scale of colours."""
        muted, small = self.theme.muted, text.font(10)
        if self.headed:
            self.paint_title(painter, self._key)
        middle, margin = self._matrix.center(), self._margin
        x, y = middle.x(), self._predicted_at
        text.draw_text(painter, x, y, "predicted", face=small, ink=muted, align=0.5)
        x, y = margin + 6, middle.y()
        text.draw_text_upwards(painter, x, y, "human", face=small, ink=muted, align=0.5)
        self._paint_names(painter)
        self._paint_cells(painter)
        if self.headed:
            self._paint_bar(painter)

    @property
    def _margin(self) -> float:
        return MARGIN if self.headed else TIGHT

    @property
    def _predicted_at(self) -> float:
        """Middle of the word above the columns' names, in pixels."""
        return MARGIN + 54 if self.headed else TIGHT + 6

    @property
    def _key(self) -> str:
        return KEYS[self.share].format(UNITS[self.unit])

    @cached_property
    def _cell(self) -> float:
        """Side of a cell in pixels."""
        side = self.room // (len(self.actions) + 1)
        return min(max(side, SMALLEST_CELL if self.headed else TIGHT_CELL), LARGEST_CELL)

    @cached_property
    def _names(self) -> tuple[str, ...]:
        """The columns' names, elided; all but the last are the rows' too."""
        room = NAME_ROOM if self.headed else TIGHT_NAME_ROOM
        names = (*self.actions, "unlabelled")
        return tuple(text.elided_name(name, text.font(), room, names) for name in names)

    @cached_property
    def _names_upright(self) -> bool:
        """Whether the columns' names are too long to stand level."""
        return text.widest(self._names, text.font()) > self._cell - 4

    @cached_property
    def _matrix(self) -> QRectF:
        """From the first cell to the last, in pixels."""
        k = len(self.actions)
        names = text.widest(self._names[:-1], text.font())
        left = self._margin + SIDE_TITLE + names + 10
        above = text.widest(self._names, text.font()) if self._names_upright else 11.0
        top = self._predicted_at + 12 + above + 8
        return QRectF(left, top, (k + 1) * self._cell + APART, k * self._cell)

    @cached_property
    def _totals(self) -> tuple[str, ...]:
        return tuple(self._count_text(total) for total in self.counts.sum(axis=1).tolist())

    def _count_text(self, count: float) -> str:
        """A count as text: seconds to a tenth, whole numbers whole."""
        return f"{count:,.1f}" if self.unit == "s" else f"{count:,}"

    def _cell_colours(self, shares: NDArray[np.float64]) -> NDArray[np.uint8]:
        """The colours of shares, shape (..., 3), from the ground's lightness away from it."""
        dark = QColor(self.theme.background).lightnessF() < 0.5
        return colormap_colours(1.0 - shares if dark else shares)

    @property
    def _totals_right(self) -> float:
        column = text.widest((*self._totals, self.total), text.font(10))
        return self._matrix.right() + 12 + column

    @property
    def _bar_left(self) -> float:
        return self._totals_right + 32

    def _paint_names(self, painter: QPainter) -> None:
        matrix, face, small = self._matrix, text.font(), text.font(10)
        right, above, muted = self._totals_right, self._matrix.top() - 13, self.theme.muted
        for column, name in enumerate(self._names):
            ink = muted if column == len(self.actions) else self.theme.text
            x = self.box(0, column).center().x()
            if self._names_upright:
                text.draw_text_upwards(painter, x, matrix.top() - 8, name, face=face, ink=ink)
            else:
                text.draw_text(painter, x, above, name, face=face, ink=ink, align=0.5)
        text.draw_text(painter, right, above, self.total, face=small, ink=muted, align=1.0)
        for row, (name, total) in enumerate(zip(self._names[:-1], self._totals, strict=True)):
            left, y, ink = matrix.left() - 10, self.box(row, 0).center().y(), self.theme.text
            text.draw_text(painter, left, y, name, face=face, ink=ink, align=1.0)
            text.draw_text(painter, right, y, total, face=small, ink=muted, align=1.0)

    def _paint_cells(self, painter: QPainter) -> None:
        """Draw the cells: colour, per cent and count, as much of it as has room."""
        counts = [self._count_text(count) for count in self.counts.ravel().tolist()]
        shares, room, below = self.shares, self._cell - 2 * PADDING, list[str]()
        large, medium, small = text.font(11), text.font(9), text.font(8)
        if self.share == "counts":
            fitting = (face for face in (large, medium) if text.widest(counts, face) <= room)
            face = next(fitting, small)
            labels = [text.elided(count, face, self._cell) for count in counts]
        else:
            fitting = (face for face in (large, medium) if text.width("100", face) <= room)
            face = next(fitting, small)
            decimals = text.width("100.0 %", large) <= room
            labels = [f"{100 * s:.1f} %" if decimals else f"{100 * s:.0f}" for s in shares.flat]
            # A share of nothing is none.
            whole = self._denominators.flat
            labels = [label if all_ else "–" for label, all_ in zip(labels, whole, strict=True)]
            if decimals and text.widest(counts, medium) <= room:
                below = counts
        up = 8.0 if below else 0.0
        grounds = self._cell_colours(shares).reshape(-1, 3).tolist()
        for number, label in enumerate(labels):
            row, column = divmod(number, len(self.actions) + 1)
            box, colour = self.box(row, column), QColor(*grounds[number])
            painter.fillRect(box, colour)
            if not self.headed and not below and not self.counts[row, column]:
                continue  # many small zeros on screen only stand in the way
            ink = text.ink_on(colour) if self.counts[row, column] else QColor(self.theme.frame)
            x, y = box.center().x(), box.center().y()
            text.draw_text(painter, x, y - up, label, face=face, ink=ink, align=0.5)
            if below:
                text.draw_text(painter, x, y + 9, below[number], face=medium, ink=ink, align=0.5)

    def _paint_bar(self, painter: QPainter) -> None:
        matrix = self._matrix
        high = min(BAR_HEIGHT, matrix.height())
        box = QRectF(self._bar_left, matrix.top(), BAR_WIDTH, high)
        gradient = QLinearGradient(box.bottomLeft(), box.topLeft())
        stops = np.linspace(0.0, 1.0, len(COLORMAP_STOPS))
        for share, ground in zip(stops.tolist(), self._cell_colours(stops).tolist(), strict=True):
            gradient.setColorAt(share, QColor(*ground))
        painter.fillRect(box, gradient)
        largest = float(self.counts.max())
        for share in (0.0, 0.5, 1.0):
            y = box.bottom() - share * box.height()
            label, face = f"{100 * share:.0f} %", text.font(10)
            if self.share == "counts":
                label = f"{share * largest:,.3g}"
            text.draw_text(painter, box.right() + 6, y, label, face=face, ink=self.theme.text)
