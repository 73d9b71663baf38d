"""Plots: pyqtgraph's views, axes and boxes in the window's fonts and colours.

Every plot can be copied and exported by its menu, as vectors where it has them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, ClassVar, Literal

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QPoint, QPointF, QRect, QRectF, QSize, QSizeF, Qt
from PySide6.QtGui import (
    QColor,
    QContextMenuEvent,
    QFocusEvent,
    QGuiApplication,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QRegion,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import (
    QGraphicsScene,
    QGraphicsSceneResizeEvent,
    QMenu,
    QMessageBox,
    QSizePolicy,
    QStyleOptionGraphicsItem,
    QWidget,
)

from forcelab.errors import ForcelabError
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import NUMBER, paint_names
from forcelab.gui.figures.colormap import translucent
from forcelab.gui.figures.figure import Figure
from forcelab.gui.file_dialogs import ask_picture
from forcelab.gui.kit import text_size
from forcelab.gui.theme import colours, themes

# Moves of the mouse come as often as the system sends them: a cursor is dragged by them.
pg.setConfigOptions(mouseRateLimit=-1)

#: How opaque a plot is that is disabled.
FAINT = 0.35
#: Pixels between the pointer and its readout, and around the readout's text.
READOUT = 12.0
PADDING = 4.0
#: Width in pixels of the bar at the left of a view that has the keyboard.
FOCUS = 2


class PlotView(pg.GraphicsView):
    """A view that plots are put into; what lies behind and above them is drawn by subclasses."""

    #: The theme's colour of what lies behind the plots.
    ground: ClassVar[Literal["background", "panel"]] = "background"
    _complete = False

    def __init__(self) -> None:
        super().__init__(background=None)
        self._complete = True
        self._pointer: QPointF | None = None
        self._has_readout = False
        self._text_scale = text_size.scale()
        #: What is being drawn, in pixels of the view; nothing need be drawn beyond it.
        self.exposed = QRectF()
        self.setCentralItem(None)
        self.centralLayout = None
        self.setRenderHint(QPainter.RenderHint.TextAntialiasing)
        themes().changed.connect(self.restyle)

    def close(self) -> bool:
        """Close as any widget does: pyqtgraph's own leaves no view that could be shown again."""
        return QWidget.close(self)

    def add_box(self, *, zooms: bool = False, inverted: bool = False) -> pg.ViewBox:
        """A box of a plot; its place is the view's to set.

        Boxes are hidden and used again, never removed: PySide trips over what is left of them.
        """
        box = pg.ViewBox(enableMouse=zooms, enableMenu=False, invertY=inverted, defaultPadding=0)
        box.disableAutoRange()
        box.borderRect.hide()  # it has no pen, and takes its time all the same
        self.addItem(box)
        return box

    # Drawing

    def update(self, *area: QRect | QRegion) -> None:
        """Draw again, all or an area; the background is kept."""
        self.viewport().update(*area)

    def invalidate(self, *_: object) -> None:
        """Draw again, with the background."""
        self.resetCachedContent()
        self.update()

    def restyle(self) -> None:
        for item in self.scene().items():
            if isinstance(item, ValueAxis):
                item.restyle()
        self.invalidate()

    def changeEvent(self, event: QEvent) -> None:
        """Draw again when fonts or the palette change."""
        styled = event.type() in (QEvent.Type.FontChange, QEvent.Type.PaletteChange)
        if styled and self._complete:  # its own constructor sets a palette
            if self._text_scale != text_size.scale():
                self._text_scale = text_size.scale()
                self.fit_text()
            self.invalidate()
        elif event.type() == QEvent.Type.EnabledChange:
            for item in self.scene().items():
                if item.parentItem() is None:
                    item.setOpacity(1.0 if self.isEnabled() else FAINT)
        super().changeEvent(event)

    def resizeEvent(self, event: QResizeEvent | None) -> None:
        super().resizeEvent(event)
        if event is not None:  # as its constructor has it
            self.place()
            self.invalidate()

    def fit_text(self) -> None:
        """Follow another text size."""
        for item in self.scene().items():
            if isinstance(item, ValueAxis):
                item.use_text_size()
        self.updateGeometry()
        self.place()

    def place(self) -> None:
        """Put the plots where they belong in a view of this size."""

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the plots, and above them what is in no file: readout and focus."""
        with scaled_lines(self.scene(), self.devicePixelRatioF(), 1.0):
            super().paintEvent(event)
        with QPainter(self.viewport()) as painter:
            sentence = "" if self._pointer is None else self.readout(self._pointer)
            self._has_readout = bool(sentence)
            if self._pointer is not None and sentence:
                self.paint_readout(painter, self._pointer, sentence)
            if self.hasFocus():
                self.paint_focus(painter)

    def render(self, painter: QPainter, *area: Any) -> None:
        """Draw into an image or a file."""
        scale = painter.worldTransform().m11()
        with scaled_lines(self.scene(), scale * painter.device().devicePixelRatioF(), scale):
            super().render(painter, *area)

    def drawBackground(self, painter: QPainter, rect: QRectF) -> None:
        self.exposed = rect
        painter.fillRect(rect, QColor(getattr(colours(), self.ground)))
        self.paint_background(painter)

    def drawForeground(self, painter: QPainter, rect: QRectF) -> None:
        self.exposed = rect
        painter.setOpacity(1.0 if self.isEnabled() else FAINT)
        painter.setFont(self.font())
        self.paint_foreground(painter)

    def paint_background(self, painter: QPainter) -> None:
        """Draw what lies behind the plots, in pixels of the view; kept until it is invalidated."""

    def paint_foreground(self, painter: QPainter) -> None:
        """Draw what lies above the plots, in pixels of the view."""

    def paint_focus(self, painter: QPainter) -> None:
        """Show that the view has the keyboard: by a bar at its left."""
        painter.fillRect(QRectF(0, 0, FOCUS, self.height()), QColor(colours().accent))

    def paint_readout(self, painter: QPainter, pointer: QPointF, sentence: str) -> None:
        """Write beside the pointer, at its other side where there is more room."""
        painter.setFont(text_size.font(NUMBER))
        room = QRectF(0, 0, self.width() - 2 * PADDING, self.height())
        box = painter.boundingRect(room, Qt.TextFlag.TextWordWrap, sentence)
        box = box.adjusted(0, 0, 2 * PADDING, 2 * PADDING)
        beside, most = pointer.x() + READOUT, self.width() - box.width()
        left = beside if beside <= most else pointer.x() - READOUT - box.width()
        top = min(max(pointer.y() - box.height(), 0.0), self.height() - box.height())
        box.moveTo(min(max(left, 0.0), most), top)
        painter.setPen(QColor(colours().frame))
        painter.setBrush(translucent(colours().panel, 0.92))
        painter.drawRect(box.adjusted(0.5, 0.5, -0.5, -0.5))
        painter.setPen(QColor(colours().text))
        text_box = box.adjusted(PADDING, PADDING, -PADDING, -PADDING)
        painter.drawText(text_box, Qt.TextFlag.TextWordWrap, sentence)

    # Pointer and keys

    def readout(self, pointer: QPointF) -> str:
        """What is to be read at a pixel; empty where there is nothing."""
        return ""

    def point_at(self, pointer: QPointF | None) -> None:
        """Show what is to be read at a pixel, or nothing."""
        self._pointer = pointer
        if self._has_readout or (pointer is not None and self.readout(pointer)):
            self.update()

    def leaveEvent(self, event: QEvent) -> None:
        super().leaveEvent(event)
        self.point_at(None)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Keys are the window's."""
        event.ignore()

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        self.update()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        self.update()

    # Menu

    def plot_menu(self) -> QMenu:
        """The menu of the plot, for a right click and the menu key."""
        menu = QMenu(self.accessibleName(), self)
        self.add_picture_entries(menu)
        return menu

    def add_picture_entries(self, menu: QMenu) -> None:
        menu.addAction("Copy as picture").triggered.connect(self.copy)
        menu.addAction("Export as picture…").triggered.connect(self.ask_export)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        menu = self.plot_menu()
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.popup(event.globalPos())

    def as_figure(self) -> Figure:
        """What is copied and exported: the plot as it is shown."""
        return ViewFigure(self)

    def copy(self) -> None:
        """Put a picture of the plot on the clipboard."""
        QGuiApplication.clipboard().setImage(self.as_figure().image())

    def ask_export(self) -> None:
        name = self.accessibleName() or "Plot"
        path = ask_picture(self, "Export as picture", f"{name}.svg")
        if path is None:
            return
        try:
            self.as_figure().save(path)
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


@contextmanager
def scaled_lines(scene: QGraphicsScene, width: float, size: float) -> Iterator[None]:
    """Lines so much wider, and marks so much larger: pyqtgraph has them in pixels of the device."""
    if width == size == 1.0:
        yield
        return
    pens: list[object] = []
    marks = [item for item in scene.items() if isinstance(item, pg.ScatterPlotItem)]
    for item in scene.items():
        if isinstance(item, pg.PlotCurveItem):
            pens.append(item.opts["pen"])
        elif isinstance(item, pg.InfiniteLine):
            pens.append(item.pen)
    for item in marks:
        pens += [item.opts["pen"], *item.data["pen"]]
        if size != 1.0:  # it asks to be drawn again, on the screen for ever
            item.setExportMode(True, {"resolutionScale": size})
    widths = {id(pen): (pen, pen.widthF()) for pen in pens if isinstance(pen, QPen)}
    try:
        for pen, before in widths.values():
            pen.setWidthF(before * width)
        yield
    finally:
        for pen, before in widths.values():
            pen.setWidthF(before)
        for item in marks if size != 1.0 else ():
            item.setExportMode(False)


def plate_box(line: str) -> QRectF:
    """A box with room for a line of small letters."""
    return QRectF(
        0, 0, text.width(line, text_size.font(NUMBER)) + 3 * PADDING, text_size.pixels(16)
    )


def draw_plate(
    painter: QPainter,
    at: QPointF,
    line: str,
    within: QRectF,
    *,
    centred: bool = False,
    quiet: bool = False,
) -> None:
    """Write a line on a plate, whose corner or centre is at a point, moved and cut to be `within`.

    It covers what is behind it; through a `quiet` one it shows.
    """
    theme, room = colours(), within.adjusted(2, 2, -2, -2)
    box = plate_box(line)
    box.setWidth(min(box.width(), room.width()))
    box.moveTopLeft(at - box.center() if centred else at)
    box.moveLeft(max(room.left(), min(box.left(), room.right() - box.width())))
    box.moveTop(max(room.top(), min(box.top(), room.bottom() - box.height())))
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(Qt.PenStyle.NoPen if quiet else QPen(QColor(theme.frame), 1.0))
    painter.setBrush(translucent(theme.panel, 0.75 if quiet else 0.94))
    painter.drawRoundedRect(box.adjusted(0.5, 0.5, -0.5, -0.5), 3, 3)
    face, ink = text_size.font(NUMBER), QColor(theme.muted if quiet else theme.text)
    line, left = text.elided(line, face, box.width() - 2 * PADDING), box.left() + 1.5 * PADDING
    text.draw_text(painter, left, box.center().y(), line, face=face, ink=ink)
    painter.restore()


class ValueAxis(pg.AxisItem):
    """An axis with the window's fonts, colours and minus signs."""

    def __init__(self, side: str, title: str = "") -> None:
        super().__init__(side)
        self.setLabel(title)
        self.enableAutoSIPrefix(False)
        self.setStyle(tickTextOffset=3, hideOverlappingLabels=True, maxTickLevel=1)
        self.use_text_size()
        self.restyle()

    def use_text_size(self) -> None:
        self.label.setFont(text_size.font(NUMBER))
        self.setStyle(tickFont=text_size.font(NUMBER))

    def restyle(self) -> None:
        theme = colours()
        self.setPen(theme.frame, cosmetic=False)
        self.setTickPen(theme.frame, cosmetic=False)
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

    def resizeEvent(self, ev: QGraphicsSceneResizeEvent | None = None) -> None:
        super().resizeEvent(ev)
        inwards = QPointF(3, 0) if self.orientation == "left" else QPointF(0, -3)
        self.label.setPos(self.label.pos() + inwards)  # it would be cut at the edge of the view

    def boundingRect(self) -> QRectF:
        """With room for numbers at the ends, which pyqtgraph leaves out beside a grid."""
        rect = super().boundingRect()
        room = text_size.pixels(NUMBER)
        return rect.adjusted(-room, -room, room, room) if self.grid else rect

    def paint(
        self, p: QPainter, opt: QStyleOptionGraphicsItem, widget: QWidget | None = None
    ) -> None:
        if widget is not None:
            super().paint(p, opt, widget)
            return
        # The picture that it keeps for the screen would be scaled by the dots per inch of a file.
        p.save()
        p.setFont(self.style["tickFont"])
        if (specs := self.generateDrawSpecs(p)) is not None:
            self.drawPicture(p, *specs)
        p.restore()

    def places(self, values: Any) -> Any:
        """Where values are in the units of the box: their logarithms on a logarithmic axis."""
        return np.log10(values) if self.logMode else np.asarray(values, dtype=np.float64)

    def numbers(self) -> list[float]:
        """The values that have numbers in any case."""
        upright = self.orientation in ("left", "right")
        length = self.size().height() if upright else self.size().width()
        levels = self.tickValues(*self.range, length or 1.0)
        return list(levels[0][1]) if levels else []

    def tickStrings(self, values: list[float], scale: float, spacing: float) -> list[str]:
        if self.logMode:
            return [f"{10**value:g}" for value in values]
        return [text.signed(label) for label in super().tickStrings(values, scale, spacing)]

    def logTickValues(
        self, minVal: float, maxVal: float, size: float, stdTicks: object
    ) -> list[tuple[float, list[float]]]:
        """Whole multiples of powers of ten, or 1, 2 and 5 times these, or fewer as they crowd."""
        decade = size / max(maxVal - minVal, 1e-9)
        room = text_size.pixels(NUMBER) * (1.6 if self.orientation in ("left", "right") else 4.0)
        choices = ((range(1, 10), 10 / 9), ((1, 2, 5), 2.0))
        digits = next(
            (digits for digits, step in choices if decade * math.log10(step) >= room), (1,)
        )
        stride = max(math.ceil(room / decade), 1)
        powers = range(math.floor(minVal), math.ceil(maxVal) + 1)
        values = [p + math.log10(d) for p in powers if p % stride == 0 for d in digits]
        return [(1.0, [value for value in values if minVal <= value <= maxVal])]


#: How strong the lines of a grid are, of 255.
GRID = 70


class Plot(PlotView):
    """A box for curves, points, bars and pictures between a left and a bottom axis.

    An axis whose title is None is not shown. Where the plot zooms, the wheel zooms at the pointer,
    dragging pans and a double click shows everything again. What :meth:`say` says stands in its
    place while there is nothing to show.
    """

    MARGINS: ClassVar[tuple[float, float, float, float]] = (58.0, 12.0, 14.0, 38.0)

    def __init__(
        self,
        left: str | None = "",
        bottom: str | None = "",
        *,
        zooms: bool = False,
        grid: bool = False,
    ) -> None:
        super().__init__()
        self.box = self.add_box(zooms=zooms)
        self.box.sigRangeChangedManually.connect(self._zoomed_by_hand)
        self.left, self.bottom = ValueAxis("left", left or ""), ValueAxis("bottom", bottom or "")
        titled = ((self.left, left), (self.bottom, bottom))
        self._shown = [self.box, *(axis for axis, title in titled if title is not None)]
        self.zooms, self.zoomed = zooms, False
        self._whole = QRectF(0, 0, 1, 1)
        self.sentence = ""
        #: Named curves with their pens: pyqtgraph's legend crashes when a window is deleted.
        self.legend: list[tuple[str, QPen]] = []
        for axis in (self.left, self.bottom):
            axis.setZValue(-1)
            axis.setStyle(tickLength=4, hideOverlappingLabels=False)
            axis.setGrid(GRID if grid else False)
            axis.linkToView(self.box)
            self.addItem(axis)
            axis.setVisible(axis in self._shown)
        self.setMouseTracking(True)
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)

    # What is shown

    @property
    def margins(self) -> tuple[float, float, float, float]:
        """Pixels left of the box, above, right and below, for the axes' numbers and titles."""
        left, top, right, bottom = map(text_size.pixels, self.MARGINS)
        return left, top, right, bottom

    @property
    def area(self) -> QRectF:
        """Where the box is, in pixels."""
        left, top, right, bottom = self.margins
        width, height = self.width() - left - right, self.height() - top - bottom
        return QRectF(left, top, max(width, 1.0), max(height, 1.0))

    def redraw(self) -> None:
        """Put the items in, in the theme's colours, in place of those that were there."""

    def clear(self) -> None:
        self.box.clear()
        self.legend.clear()

    def add(self, item: pg.GraphicsObject, name: str = "") -> None:
        """Add an item whose coordinates are those of the box; named ones stand above it."""
        self.box.addItem(item)
        if name:
            pen = pg.mkPen(item.opts["pen"])
            pen.setCosmetic(False)
            self.legend.append((name, pen))

    def show_all_of(self, across: Sequence[float], up: Sequence[float]) -> None:
        """Let the axes go from the first to the second value; no further by wheel or drag."""
        (x0, x1), (y0, y1) = self.bottom.places(across), self.left.places(up)
        self._whole = QRectF(x0, y0, x1 - x0, y1 - y0)
        self.box.setLimits(xMin=x0, xMax=x1, yMin=y0, yMax=y1)
        if not self.zoomed:
            self.show_all()

    def show_all(self) -> None:
        self.box.setRange(self._whole, padding=0)
        self.zoomed = False

    def pixels_of(self, x: Any, y: Any) -> NDArray[np.float64]:
        """The pixels of values on either axis, shape (n, 2)."""
        places = np.stack([self.bottom.places(x), self.left.places(y)])
        corner = self.area.topLeft()
        in_box = pg.transformCoordinates(self.box.childTransform(), places)
        return np.add(in_box.T, (corner.x(), corner.y()))

    def spot(self, x: float, y: float) -> QPointF:
        """The pixel of a value on either axis."""
        return QPointF(*self.pixels_of([x], [y])[0])

    def value_at(self, pixel: QPointF) -> QPointF:
        """The place of a pixel in the units of the box."""
        place = self.box.mapToView(pixel - self.area.topLeft())
        return QPointF(place.x(), place.y())

    def say(self, sentence: str) -> None:
        """Show a sentence in place of the plot, or the plot."""
        self.sentence, self.zoomed = sentence, self.zoomed and not sentence
        for item in self._shown:
            item.setVisible(not sentence)
        self.place()  # hidden axes have no height, and so no room for their numbers
        if sentence:
            self._pointer = None
        self.invalidate()

    # Drawing

    def restyle(self) -> None:
        self.redraw()
        super().restyle()

    def place(self) -> None:
        area, (left, _, _, bottom) = self.area, self.margins
        self.box.setGeometry(area)
        self.left.setWidth(left)
        self.left.setGeometry(QRectF(0, area.top(), left, area.height()))
        self.bottom.setHeight(bottom)
        self.bottom.setGeometry(QRectF(area.left(), area.bottom(), area.width(), bottom))

    def paint_background(self, painter: QPainter) -> None:
        if self.sentence:
            painter.setFont(self.font())
            painter.setPen(QColor(colours().muted))
            flags = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
            painter.drawText(QRectF(self.rect()).adjusted(16, 8, -16, -8), flags, self.sentence)

    def drawForeground(self, painter: QPainter, rect: QRectF) -> None:
        if self.legend:
            painter.save()
            painter.translate(self.area.left(), self.area.top() - text_size.pixels(NUMBER))
            painter.scale(text_size.scale(), text_size.scale())
            paint_names(painter, 0, 0, self.legend, colours())
            painter.restore()
        super().drawForeground(painter, rect)

    def paint_focus(self, painter: QPainter) -> None:
        painter.setPen(QPen(QColor(colours().accent), 1.0))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRect(self.rect().adjusted(0, 0, -1, -1))

    # Pointer and keys

    def wheelEvent(self, event: QWheelEvent) -> None:
        if self.zooms:
            super().wheelEvent(event)
        else:
            event.ignore()  # what it lies in scrolls

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() != Qt.MouseButton.RightButton:  # which has the menu
            super().mousePressEvent(event)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        if self.zooms and event.button() == Qt.MouseButton.LeftButton:
            self.show_all()
        else:
            self.mousePressEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        super().mouseMoveEvent(event)
        self.point_at(None if self.sentence else event.position())

    def _zoomed_by_hand(self, *_: object) -> None:
        self.zoomed = True


class PanelPlot(Plot):
    """A plot among texts on a page that scrolls: as high as its contents need."""

    ground = "panel"

    def __init__(self, left: str | None = None, bottom: str | None = None) -> None:
        super().__init__(left, bottom)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    @property
    def needed_height(self) -> float:
        """In pixels."""
        raise NotImplementedError

    def sizeHint(self) -> QSize:
        return QSize(320, round(self.needed_height))

    def minimumSizeHint(self) -> QSize:
        return QSize(160, self.sizeHint().height())

    def renew(self) -> None:
        """Draw other contents, which may need another height and other margins."""
        self.updateGeometry()
        self.redraw()
        self.place()


class Bars(pg.BarGraphItem):
    """Bars of several colours; pyqtgraph's are pictures, which are scaled in files."""

    def paint(self, p: QPainter, *args: object) -> None:
        self._render(p)


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
