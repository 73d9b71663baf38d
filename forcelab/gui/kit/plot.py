"""Plots: pyqtgraph's views, axes and boxes in the window's fonts and colours.

Every plot can be copied and exported by its menu, as vectors where it has them.
"""

from __future__ import annotations

from typing import Any

import pyqtgraph as pg
from PySide6.QtCore import QEvent, QPoint, QRect, QRectF, QSizeF, Qt
from PySide6.QtGui import (
    QColor,
    QContextMenuEvent,
    QGuiApplication,
    QPainter,
    QRegion,
    QResizeEvent,
)
from PySide6.QtWidgets import QMenu, QMessageBox, QWidget

from forcelab.errors import ForcelabError
from forcelab.gui.figures import text
from forcelab.gui.figures.figure import Figure
from forcelab.gui.file_dialogs import ask_picture
from forcelab.gui.theme import colours, themes

# Moves of the mouse come as often as the system sends them: a cursor is dragged by them.
pg.setConfigOptions(mouseRateLimit=-1)

#: Height of an axis' numbers, in pixels.
NUMBER = 10.0


class PlotView(pg.GraphicsView):
    """A view that plots are put into; what lies behind and above them is drawn by subclasses."""

    _complete = False

    def __init__(self) -> None:
        super().__init__(background=None)
        self._complete = True
        self.setCentralItem(None)
        self.centralLayout = None
        self.setRenderHint(QPainter.RenderHint.TextAntialiasing)
        themes().changed.connect(self.restyle)

    def close(self) -> bool:
        """Close as any widget does: pyqtgraph's own leaves no view that could be shown again."""
        return QWidget.close(self)

    # Drawing

    def update(self, *area: QRect | QRegion) -> None:
        """Draw again, all or an area; the background is kept."""
        self.viewport().update(*area)

    def invalidate(self, *_: object) -> None:
        """Draw again, with the background."""
        self.resetCachedContent()
        self.update()

    def restyle(self) -> None:
        """Take the theme's colours."""
        for item in self.scene().items():
            if isinstance(item, ValueAxis):
                item.restyle()
        self.invalidate()

    def changeEvent(self, event: QEvent) -> None:
        """Draw again when fonts or the palette change."""
        styled = event.type() in (QEvent.Type.FontChange, QEvent.Type.PaletteChange)
        if styled and self._complete:  # its own constructor sets a palette
            self.invalidate()
        super().changeEvent(event)

    def resizeEvent(self, event: QResizeEvent | None) -> None:
        super().resizeEvent(event)
        if event is not None:  # as its constructor has it
            self.place()
            self.invalidate()

    def place(self) -> None:
        """Put the plots where they belong in a view of this size."""

    def drawBackground(self, painter: QPainter, rect: QRectF) -> None:
        painter.fillRect(rect, QColor(colours().background))
        self.paint_background(painter)

    def drawForeground(self, painter: QPainter, rect: QRectF) -> None:
        self.paint_foreground(painter)

    def paint_background(self, painter: QPainter) -> None:
        """Draw what lies behind the plots, in pixels of the view; kept until it is invalidated."""

    def paint_foreground(self, painter: QPainter) -> None:
        """Draw what lies above the plots, in pixels of the view."""

    # Menu

    def plot_menu(self) -> QMenu:
        """The menu of the plot, for a right click and the menu key."""
        menu = QMenu(self.accessibleName(), self)
        self.add_picture_entries(menu)
        return menu

    def add_picture_entries(self, menu: QMenu) -> None:
        """Offer to copy and to export the plot."""
        menu.addAction("Copy as picture").triggered.connect(self.copy)
        menu.addAction("Export as picture…").triggered.connect(self.ask_export)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        menu = self.plot_menu()
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.popup(event.globalPos())

    def copy(self) -> None:
        """Put a picture of the plot on the clipboard."""
        QGuiApplication.clipboard().setImage(ViewFigure(self).image())

    def ask_export(self) -> None:
        """Ask for a file and save a picture of the plot in it."""
        name = self.accessibleName() or "Plot"
        path = ask_picture(self, "Export as picture", f"{name}.svg")
        if path is None:
            return
        try:
            ViewFigure(self).save(path)
        except ForcelabError as error:
            QMessageBox.warning(self, "Export as picture", str(error))


class ViewFigure(Figure):
    """What a view shows, as a figure that is saved as SVG, PDF or PNG."""

    def __init__(self, view: PlotView) -> None:
        self.title, self.theme = view.accessibleName(), colours()
        self._view = view

    @property
    def size(self) -> QSizeF:
        return QSizeF(self._view.viewport().size())

    def paint(self, painter: QPainter) -> None:
        self._view.render(painter, QRectF(QPoint(0, 0), self.size))


class ValueAxis(pg.AxisItem):
    """An axis with the window's fonts, colours and minus signs."""

    def __init__(self, side: str, title: str = "") -> None:
        super().__init__(side, text=title)
        self.enableAutoSIPrefix(False)
        self.setStyle(
            tickFont=text.font(NUMBER), tickTextOffset=3, hideOverlappingLabels=True, maxTickLevel=1
        )
        self.restyle()

    def restyle(self) -> None:
        theme = colours()
        self.setPen(theme.frame)
        self.setTickPen(theme.frame)
        self.setTextPen(theme.muted)

    def taken(self) -> list[QRectF]:
        """Where no number may stand, in pixels of the axis."""
        return []

    def generateDrawSpecs(self, p: QPainter) -> Any:
        """Leave out the numbers that would stand on another, or on what is there already."""
        specs = super().generateDrawSpecs(p)
        if specs is None:
            return None
        line, marks, numbers = specs
        boxes, free = self.taken(), []
        for number in numbers:  # the round ones come first
            if not any(number[0].intersects(box) for box in boxes):
                boxes.append(number[0].adjusted(-3, -1, 3, 1))
                free.append(number)
        return line, marks, free

    def numbers(self) -> list[float]:
        """The values that have numbers in any case."""
        low, high = self.range
        levels = self.tickValues(low, high, self.size().height() or 1.0)
        return list(levels[0][1]) if levels else []

    def tickStrings(self, values: list[float], scale: float, spacing: float) -> list[str]:
        return [text.signed(label) for label in super().tickStrings(values, scale, spacing)]


class BoxItem(pg.GraphicsObject):
    """An item that fills a box; it is drawn in pixels of the box, not in its units."""

    def __init__(self, box: pg.ViewBox) -> None:
        super().__init__()
        self.box = box
        self.setParentItem(box)
        box.sigRangeChanged.connect(self.redraw)
        box.sigResized.connect(self._resize)

    def boundingRect(self) -> QRectF:
        return self.box.rect()

    def redraw(self, *_: object) -> None:
        self.update()

    def _resize(self, *_: object) -> None:
        self.prepareGeometryChange()
        self.update()
