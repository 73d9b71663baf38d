"""The confusion matrix on screen: the figure that is saved, fitted to its room, with a focus."""

from __future__ import annotations

from dataclasses import replace

from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QFocusEvent,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPixmap,
)
from PySide6.QtWidgets import QScrollArea, QWidget

from forcelab.gui.figures import text
from forcelab.gui.figures.confusion import MATRIX, ConfusionMatrix
from forcelab.gui.review.moving import ARROWS, ENTER, plain
from forcelab.gui.theme import colours, themes

__all__ = ["MatrixCanvas", "fitted"]

#: How much narrower than its room a figure may end up, in pixels, as cells have whole ones.
FITTINGS = 2

Cell = tuple[int, int]


class MatrixCanvas(QWidget):
    """Draws a matrix and tells which cell is pointed at, focused and chosen.

    Attributes
    ----------
    figure : ConfusionMatrix or None
        What is drawn.
    focus : (int, int)
        Row and column that the keyboard is at.
    chosen : (int, int) or None
        The cell that was clicked last.
    """

    #: The cell that is pointed at or focused, as (row, column); None for none.
    pointed = Signal(object)
    #: A cell was clicked, or Enter was pressed on it: row, column, and whether by key.
    picked = Signal(int, int, bool)

    def __init__(self) -> None:
        super().__init__()
        self.figure: ConfusionMatrix | None = None
        self.focus: Cell = (0, 0)
        self.chosen: Cell | None = None
        self._hovered: Cell | None = None
        self._drawn: QPixmap | None = None
        self.setAccessibleName("Confusion matrix")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setMouseTracking(True)
        themes().changed.connect(self._invalidate)

    def show_figure(self, figure: ConfusionMatrix | None) -> None:
        """Draw this matrix from now on; a focus that it lacks returns to the first cell."""
        actions = () if self.figure is None else self.figure.actions
        self.figure = figure
        if figure is None or figure.actions != actions:
            self.focus, self.chosen, self._hovered = (0, 0), None, None
        if figure is not None:
            size = figure.size
            self.setFixedSize(QSize(int(size.width()), int(size.height())))
        self._invalidate()

    # Qt

    def keeps(self, event: QKeyEvent) -> bool:
        """Whether a key is an arrow or Enter, which are the window's too."""
        return event.key() in (*ARROWS, *ENTER) and plain(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Arrows move the focus; Enter picks its cell."""
        figure, key = self.figure, Qt.Key(event.key())
        if figure is None:
            super().keyPressEvent(event)
        elif key in ARROWS:
            k = len(figure.actions)
            row, column = (now + step for now, step in zip(self.focus, ARROWS[key], strict=True))
            self.focus = (min(max(row, 0), k - 1), min(max(column, 0), k))
            self._hovered = None
            self._bring_into_view()
            self.pointed.emit(self.focus)
            self.update()
        elif key in ENTER:
            self._pick(self.focus, by_key=True)
        else:
            super().keyPressEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Tell which cell the pointer is over."""
        self._point_at(self._cell_at(event.position()))

    def leaveEvent(self, event: QEvent) -> None:
        """Nothing is pointed at any more."""
        self._point_at(None)
        super().leaveEvent(event)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Pick a cell."""
        cell = self._cell_at(event.position())
        if event.button() == Qt.MouseButton.LeftButton and cell is not None:
            self.focus = cell
            self._pick(cell, by_key=False)

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Show where the keyboard is."""
        super().focusInEvent(event)
        if self.figure is not None and self._hovered is None:
            self.pointed.emit(self.focus)
        self.update()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """The keyboard is elsewhere."""
        super().focusOutEvent(event)
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the figure, kept as a picture, and the frames of cells over it."""
        with QPainter(self) as painter:
            if self.figure is None:
                return
            ratio = self.devicePixelRatioF()
            if self._drawn is None or self._drawn.devicePixelRatio() != ratio:
                self._drawn = self._picture(self.figure, ratio)
            painter.drawPixmap(0, 0, self._drawn)
            if self._hovered is not None:
                self._frame(painter, self.figure.box(*self._hovered), 1.0)
            if self.chosen is not None:
                self._frame(painter, self.figure.box(*self.chosen), 2.0)
            if self.hasFocus():
                self._frame(painter, self.figure.box(*self.focus), 2.0, dashed=True)

    # Inside

    def _cell_at(self, point: QPointF) -> Cell | None:
        """The cell at a point."""
        return None if self.figure is None else self.figure.cell_at(point)

    def _pick(self, cell: Cell, *, by_key: bool) -> None:
        """Mark a cell and say so."""
        self.chosen = cell
        self.pointed.emit(cell)
        self.picked.emit(*cell, by_key)
        self.update()

    def _point_at(self, cell: Cell | None) -> None:
        """Say which cell is pointed at; without one, which is chosen or focused."""
        if cell != self._hovered:
            self._hovered = cell
            resting = self.chosen if self.chosen is not None or not self.hasFocus() else self.focus
            self.pointed.emit(resting if cell is None else cell)
            self.update()

    def _bring_into_view(self) -> None:
        """Scroll to the focus."""
        viewport = self.parentWidget()
        area = None if viewport is None else viewport.parentWidget()
        if isinstance(area, QScrollArea) and self.figure is not None:
            spot = self.figure.box(*self.focus).center()
            area.ensureVisible(int(spot.x()), int(spot.y()), 40, 40)

    def _invalidate(self) -> None:
        """Say that the picture is stale."""
        self._drawn = None
        self.update()

    def _picture(self, figure: ConfusionMatrix, ratio: float) -> QPixmap:
        """The figure at the screen's resolution."""
        pixmap = QPixmap(self.size() * ratio)
        pixmap.setDevicePixelRatio(ratio)
        pixmap.fill(QColor(figure.theme.background))
        with QPainter(pixmap) as painter:
            figure.draw(painter)
        return pixmap

    def _frame(self, painter: QPainter, box: QRectF, width: float, *, dashed: bool = False) -> None:
        """A frame around a cell, between two lines that show it on light and on dark cells."""
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(QColor(colours().background), width + 2))
        painter.drawRect(box)
        style = Qt.PenStyle.DotLine if dashed else Qt.PenStyle.SolidLine
        painter.setPen(QPen(QColor(colours().accent), width, style))
        painter.drawRect(box)


def fitted(figure: ConfusionMatrix, room: QSize) -> ConfusionMatrix:
    """The figure with its cells as large as its room lets them be; cells have a smallest size.

    Parameters
    ----------
    figure : ConfusionMatrix
    room : QSize
        In pixels. What does not fit even with the smallest cells is scrolled.
    """
    text.ready()
    columns = len(figure.actions) + 1
    made = replace(figure, room=MATRIX)
    for _ in range(FITTINGS):  # smaller cells may turn the names upright, which takes height
        size = made.size
        over = max(
            (size.width() - room.width()) / columns,
            (size.height() - room.height()) / max(columns - 1, 1),
        )
        made = replace(made, room=max(made.box(0, 0).width() + 1 - max(over, 0.0), 1.0) * columns)
    return made
