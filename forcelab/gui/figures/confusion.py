"""Confusion matrix: which action the recogniser saw where the coder saw another."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRectF, QSizeF
from PySide6.QtGui import QColor, QLinearGradient, QPainter

from forcelab.errors import InputError
from forcelab.gui.figures import text
from forcelab.gui.figures.canvas import LIGHT, Figure, Theme
from forcelab.gui.figures.shades import STOPS, shade

__all__ = ["ConfusionMatrix"]

MARGIN = 24.0
#: The matrix is about this wide where its cells may have the size that takes.
MATRIX = 640.0
SMALLEST_CELL, LARGEST_CELL = 20.0, 64.0
NAME_ROOM = 150.0
#: Between the actions and the last column, which is none.
APART = 8.0
#: Left free inside a cell on either side of its text.
PADDING = 2.0
SIDE_TITLE = 22.0
BAR_WIDTH, BAR_HEIGHT = 12.0, 160.0
#: The name of the last column.
LAST_NAME = "unlabelled"
KEY = "Colour and per cent: share of the human label's samples (row)."


@dataclass(frozen=True, eq=False)
class ConfusionMatrix(Figure):
    """Counts of samples by human and predicted action.

    Parameters
    ----------
    title : str
        At the top.
    actions : tuple of str, length k >= 1
        In the order of rows and columns.
    counts : array_like of int, shape (k, k + 1)
        Rows are human, columns predicted; the last column counts samples predicted unlabelled.
    theme : Theme
        Colours apart from the cells'.

    Raises
    ------
    InputError
        If there is no action, the shape does not fit or a count is negative.
    """

    title: str
    actions: tuple[str, ...]
    counts: NDArray[np.int64]
    theme: Theme = LIGHT

    def __post_init__(self) -> None:
        counts = np.array(self.counts, dtype=np.int64)
        k = len(self.actions)
        if k == 0 or counts.shape != (k, k + 1):
            raise InputError(
                f"A confusion matrix of {k} actions needs {k} rows and {k + 1} columns and at "
                f"least one action; its shape is {counts.shape}."
            )
        if counts.min() < 0:
            raise InputError("A confusion matrix counts samples; none of its counts is negative.")
        counts.flags.writeable = False
        object.__setattr__(self, "counts", counts)

    @property
    def shares(self) -> NDArray[np.float64]:
        """Counts over their row's total, shape (k, k + 1); zero in a row without samples."""
        totals = self.counts.sum(axis=1, keepdims=True)
        return self.counts / np.maximum(totals, 1)

    @property
    def size(self) -> QSizeF:
        """Width and height in pixels."""
        matrix = self._matrix
        wide = max(self._bar_left + BAR_WIDTH + 48, MARGIN + text.width(KEY, text.font(10)))
        return QSizeF(wide + MARGIN, matrix.bottom() + MARGIN)

    def box(self, row: int, column: int) -> QRectF:
        """Where a cell lies, in pixels."""
        matrix, cell = self._matrix, self._cell
        apart = APART if column == len(self.actions) else 0.0
        left = matrix.left() + column * cell + apart
        return QRectF(left, matrix.top() + row * cell, cell, cell).adjusted(0.5, 0.5, -0.5, -0.5)

    def paint(self, painter: QPainter) -> None:
        """Draw title, names, cells, totals and the scale of colours."""
        ink, muted = QColor(self.theme.text), QColor(self.theme.muted)
        heading, small = text.font(14, bold=True), text.font(10)
        title = text.elided(self.title, heading, self.size.width() - 2 * MARGIN)
        text.put(painter, MARGIN, MARGIN + 6, title, face=heading, ink=ink)
        text.put(painter, MARGIN, MARGIN + 26, KEY, face=small, ink=muted)
        matrix = self._matrix
        middle = matrix.center()
        text.put(painter, middle.x(), MARGIN + 54, "predicted", face=small, ink=muted, align=0.5)
        text.put_upwards(painter, MARGIN + 6, middle.y(), "human", face=small, ink=muted, align=0.5)
        self._paint_names(painter)
        self._paint_cells(painter)
        self._paint_bar(painter)

    @cached_property
    def _cell(self) -> float:
        """Side of a cell in pixels."""
        side = MATRIX // (len(self.actions) + 1)
        return min(max(side, SMALLEST_CELL), LARGEST_CELL)

    @cached_property
    def _names(self) -> tuple[str, ...]:
        """The columns' names, elided; all but the last are the rows' too."""
        return tuple(
            text.elided(name, text.font(), NAME_ROOM, middle=True)
            for name in (*self.actions, LAST_NAME)
        )

    @cached_property
    def _upwards(self) -> bool:
        """Whether the columns' names are too long to stand level."""
        return text.widest(self._names, text.font()) > self._cell - 4

    @cached_property
    def _matrix(self) -> QRectF:
        """From the first cell to the last, in pixels."""
        k = len(self.actions)
        names = text.widest(self._names[:-1], text.font())
        left = MARGIN + SIDE_TITLE + names + 10
        above = text.widest(self._names, text.font()) if self._upwards else 11.0
        top = MARGIN + 54 + 12 + above + 8
        return QRectF(left, top, (k + 1) * self._cell + APART, k * self._cell)

    @cached_property
    def _totals(self) -> tuple[str, ...]:
        """The rows' totals as text."""
        return tuple(f"{total:,}" for total in self.counts.sum(axis=1))

    @property
    def _totals_right(self) -> float:
        """Right edge of the totals, in pixels."""
        column = text.widest((*self._totals, "total"), text.font(10))
        return self._matrix.right() + 12 + column

    @property
    def _bar_left(self) -> float:
        """Left edge of the scale of colours, in pixels."""
        return self._totals_right + 32

    def _paint_names(self, painter: QPainter) -> None:
        """Draw the names of rows and columns, and the totals."""
        matrix, face, small = self._matrix, text.font(), text.font(10)
        last = len(self.actions)
        for column, name in enumerate(self._names):
            ink = QColor(self.theme.muted if column == last else self.theme.text)
            x = self.box(0, column).center().x()
            if self._upwards:
                text.put_upwards(painter, x, matrix.top() - 8, name, face=face, ink=ink)
            else:
                text.put(painter, x, matrix.top() - 13, name, face=face, ink=ink, align=0.5)
        muted = QColor(self.theme.muted)
        text.put(
            painter,
            self._totals_right,
            matrix.top() - 13,
            "total",
            face=small,
            ink=muted,
            align=1.0,
        )
        for row, (name, total) in enumerate(zip(self._names[:-1], self._totals, strict=True)):
            y = self.box(row, 0).center().y()
            text.put(
                painter,
                matrix.left() - 10,
                y,
                name,
                face=face,
                ink=QColor(self.theme.text),
                align=1.0,
            )
            text.put(painter, self._totals_right, y, total, face=small, ink=muted, align=1.0)

    def _paint_cells(self, painter: QPainter) -> None:
        """Draw the cells: colour, per cent and count, as much of it as has room."""
        large, medium, small = text.font(11), text.font(9), text.font(8)
        room = self._cell - 2 * PADDING
        counts = [f"{count:,}" for count in self.counts.flat]
        decimals = text.width("100.0 %", large) <= room
        with_counts = decimals and text.widest(counts, medium) <= room
        face = large if decimals else medium if text.width("100", medium) <= room else small
        for row, shares in enumerate(self.shares):
            for column, share in enumerate(shares):
                box, colour = self.box(row, column), shade(float(share))
                painter.fillRect(box, colour)
                count = int(self.counts[row, column])
                ink = text.ink_on(colour) if count else QColor(self.theme.frame)
                label = f"{100 * share:.1f} %" if decimals else f"{100 * share:.0f}"
                if not self.counts[row].any():
                    label = "–"  # a share of nothing
                centre = box.center()
                up = 8.0 if with_counts else 0.0
                text.put(painter, centre.x(), centre.y() - up, label, face=face, ink=ink, align=0.5)
                if with_counts:
                    text.put(
                        painter,
                        centre.x(),
                        centre.y() + 9,
                        f"{count:,}",
                        face=medium,
                        ink=ink,
                        align=0.5,
                    )

    def _paint_bar(self, painter: QPainter) -> None:
        """Draw the scale of colours."""
        matrix = self._matrix
        high = min(BAR_HEIGHT, matrix.height())
        box = QRectF(self._bar_left, matrix.top(), BAR_WIDTH, high)
        gradient = QLinearGradient(box.bottomLeft(), box.topLeft())
        for i in range(len(STOPS)):
            share = i / (len(STOPS) - 1)
            gradient.setColorAt(share, shade(share))
        painter.fillRect(box, gradient)
        for share in (0.0, 0.5, 1.0):
            y = box.bottom() - share * box.height()
            label, face = f"{100 * share:.0f} %", text.font(10)
            text.put(painter, box.right() + 6, y, label, face=face, ink=QColor(self.theme.text))
