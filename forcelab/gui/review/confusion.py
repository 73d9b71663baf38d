"""The confusion view: the matrix, and the list of a cell's places."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import cast

import numpy as np
from PySide6.QtCore import (
    QEvent,
    QModelIndex,
    QObject,
    QPointF,
    QRectF,
    QSize,
    Qt,
    QTimer,
    Signal,
)
from PySide6.QtGui import (
    QColor,
    QFocusEvent,
    QHideEvent,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPalette,
    QPen,
    QResizeEvent,
    QShowEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import (
    QBoxLayout,
    QComboBox,
    QHBoxLayout,
    QScrollArea,
    QSizePolicy,
    QWidget,
)

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.figures import text
from forcelab.gui.figures.confusion import MATRIX, ConfusionMatrix
from forcelab.gui.figures.figure import LIGHT, Figure
from forcelab.gui.file_dialogs import export_picture
from forcelab.gui.item_views import TableColumn, TableRow, TextModel, TextTable, as_tsv, copy_text
from forcelab.gui.jobs import Jobs
from forcelab.gui.kit import text_size
from forcelab.gui.kit.plot import PlotView
from forcelab.gui.layout import (
    PageOrPlaceholder,
    YieldingSplitter,
    fill_layout,
    fill_splitter,
    muted_label,
    page_layout,
    push_button,
    scroll_area,
    sentence_label,
)
from forcelab.gui.review.reviewed_run import on_visible_run_changed, visible_run
from forcelab.gui.theme import colours, themes
from forcelab.gui.widgets import ARROW_STEPS, ENTER_KEYS, combo_box, is_plain
from forcelab.labels import Interval
from forcelab.review.confusion import ConfusionCounts, Share, Unit, count_confusion, normalise
from forcelab.review.run_result import RunResult
from forcelab.text import counted


def _decimals(seconds: float) -> int:
    """A tenth of a second is enough, unless there is less than one."""
    return 1 if seconds >= 1 else 3


def _percent_text(part: float) -> str:
    """Whole per cents, tenths where there is less than one, and never 0 of something."""
    if part >= 1:
        return f"{part:.0f}"
    return f"{part:.1f}" if part >= 0.1 else "< 0.1"


#: Of the list of a cell's places.
COLUMNS = (
    TableColumn("Demonstration", number=False),
    TableColumn("Start (s)"),
    TableColumn("Duration (s)"),
    TableColumn("Confidence (%)", "Mean probability that the model gives to what it predicts"),
)


def _place_row(place: Interval, names: Mapping[str, str]) -> TableRow:
    name = names.get(place.demonstration, place.demonstration)
    sure = "–" if place.confidence is None else f"{100 * place.confidence:.0f}"
    return TableRow((name, f"{place.start:.3f}", f"{place.duration:.3f}", sure))


class CellIntervals(QWidget):
    """Intervals, the longest and most confident first; choosing one shows it in the window."""

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.document = document
        self.places: tuple[Interval, ...] = ()
        self.model = TextModel(self)
        self.table = TextTable(self.model)
        self.table.setAccessibleName("Places of the cell")
        self.hint = muted_label()
        self.hint.setMargin(8)
        self.hint.setAlignment(Qt.AlignmentFlag.AlignTop)
        page_layout(self, self.hint, self.table, growing=self.table)
        self.table.selectionModel().currentRowChanged.connect(self._row_chosen)
        self.table.clicked.connect(self._row_clicked)
        self.clear()

    def minimumSizeHint(self) -> QSize:
        return QSize(160, 90)

    def clear(self) -> None:
        """List nothing, and say what would be listed."""
        self.show_places((), {}, 0)
        self.hint.setText("Click on a cell to list its places.")
        self.hint.show()

    def show_places(
        self, places: tuple[Interval, ...], names: Mapping[str, str], number: int
    ) -> None:
        """List intervals of `number` in all; `names` are the demonstrations' by id."""
        self.places = places
        self.model.show(COLUMNS, [_place_row(place, names) for place in places])
        self.table.fit_columns(stretched=0)
        self.table.setVisible(bool(places))
        self.hint.setVisible(len(places) < number or not number)
        listed = f"The {len(places):,} longest of {number:,} places are listed."
        self.hint.setText(listed if number else "This cell is empty.")

    def _row_chosen(self, index: QModelIndex) -> None:
        if index.isValid():
            self.document.review.examine(self.places[index.row()])

    def _row_clicked(self, index: QModelIndex) -> None:
        """Show the interval once more, if the window has gone elsewhere since."""
        document, place = self.document, self.places[index.row()]
        position = document.id, document.view.cursor
        if document.review.examined is not place or position != (place.demonstration, place.start):
            document.review.examine(place)


#: How much narrower than its room a figure may end up, in pixels, as cells have whole ones.
FIT_TOLERANCE = 2

Cell = tuple[int, int]


class MatrixCanvas(PlotView):
    """Draws a matrix and tells which cell is pointed at, focused and chosen, as (row, column).

    Copied and exported is what `headed` gives, the matrix with its title.
    """

    #: The cell that is pointed at or focused, as (row, column); None for none.
    pointed = Signal(object)
    #: A cell was clicked, or Enter was pressed on it: row, column, and whether by key.
    picked = Signal(int, int, bool)

    def __init__(self, headed: Callable[[], Figure | None]) -> None:
        super().__init__()
        self._headed = headed
        self.figure: ConfusionMatrix | None = None
        self.focus: Cell = (0, 0)
        self.chosen: Cell | None = None
        self._hovered: Cell | None = None
        self.setAccessibleName("Confusion matrix")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setMouseTracking(True)

    def show_figure(self, figure: ConfusionMatrix | None) -> None:
        """Draw this matrix from now on; a focus that it lacks returns to the first cell."""
        actions = () if self.figure is None else self.figure.actions
        self.figure = figure
        if figure is None or figure.actions != actions:
            self.focus, self.chosen, self._hovered = (0, 0), None, None
        if figure is not None:
            size = figure.size * text_size.scale()
            self.setFixedSize(QSize(int(size.width()), int(size.height())))
        self.invalidate()

    def as_figure(self) -> Figure:
        return self._headed() or super().as_figure()

    # Qt

    def keeps(self, event: QKeyEvent) -> bool:
        """Whether a key is an arrow or Enter, which the window uses too."""
        return event.key() in (*ARROW_STEPS, *ENTER_KEYS) and is_plain(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        figure, key = self.figure, Qt.Key(event.key())
        if figure is None:
            super().keyPressEvent(event)
        elif key in ARROW_STEPS:
            k = len(figure.actions)
            (row, column), (down, right) = self.focus, ARROW_STEPS[key]
            self.focus = min(max(row + down, 0), k - 1), min(max(column + right, 0), k)
            self._hovered = None
            self._bring_into_view()
            self.pointed.emit(self.focus)
            self.update()
        elif key in ENTER_KEYS:
            self._pick(self.focus, by_key=True)
        else:
            super().keyPressEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        self._point_at(self._cell_at(event.position()))

    def leaveEvent(self, event: QEvent) -> None:
        self._point_at(None)
        super().leaveEvent(event)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        cell = self._cell_at(event.position())
        if event.button() == Qt.MouseButton.LeftButton and cell is not None:
            self.focus = cell
            self._pick(cell, by_key=False)

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        if self.figure is not None and self._hovered is None:
            self.pointed.emit(self.focus)

    def wheelEvent(self, event: QWheelEvent) -> None:
        event.ignore()  # what it lies in scrolls

    def paint_background(self, painter: QPainter) -> None:
        if self.figure is not None:
            painter.save()
            painter.scale(text_size.scale(), text_size.scale())
            self.figure.draw(painter)
            painter.restore()

    def paint_foreground(self, painter: QPainter) -> None:
        """Draw frames around the cells that are pointed at and chosen."""
        if self.figure is not None and self._hovered is not None:
            self._frame(painter, self._cell_box(self._hovered), 1.0)
        if self.figure is not None and self.chosen is not None:
            self._frame(painter, self._cell_box(self.chosen), 2.0)

    def paint_focus(self, painter: QPainter) -> None:
        if self.figure is not None:
            self._frame(painter, self._cell_box(self.focus), 2.0, dashed=True)

    # Inside

    def _cell_at(self, point: QPointF) -> Cell | None:
        return None if self.figure is None else self.figure.cell_at(point / text_size.scale())

    def _cell_box(self, cell: Cell) -> QRectF:
        """A cell in pixels of the view: the figure is painted at the text size."""
        assert self.figure is not None
        box, scale = self.figure.box(*cell), text_size.scale()
        return QRectF(box.topLeft() * scale, box.size() * scale)

    def _pick(self, cell: Cell, *, by_key: bool) -> None:
        self.chosen = cell
        self.pointed.emit(cell)
        self.picked.emit(*cell, by_key)
        self.update()

    def _point_at(self, cell: Cell | None) -> None:
        """Emit the cell that is pointed at; without one, the chosen or focused one."""
        if cell != self._hovered:
            self._hovered = cell
            resting = self.chosen if self.chosen is not None or not self.hasFocus() else self.focus
            self.pointed.emit(resting if cell is None else cell)
            self.update()

    def _bring_into_view(self) -> None:
        viewport = self.parentWidget()
        area = None if viewport is None else viewport.parentWidget()
        if isinstance(area, QScrollArea) and self.figure is not None:
            spot = self._cell_box(self.focus).center()
            area.ensureVisible(int(spot.x()), int(spot.y()), 40, 40)

    def _frame(self, painter: QPainter, box: QRectF, width: float, *, dashed: bool = False) -> None:
        """A frame around a cell, between two lines that show it on light and on dark cells."""
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(QColor(colours().background), width + 2))
        painter.drawRect(box)
        style = Qt.PenStyle.DotLine if dashed else Qt.PenStyle.SolidLine
        painter.setPen(QPen(QColor(colours().accent), width, style))
        painter.drawRect(box)


def fit_figure(figure: ConfusionMatrix, room: QSize) -> ConfusionMatrix:
    """The figure with cells as large as its room, in pixels, lets them be; the smallest scroll."""
    text.ensure_application()
    columns = len(figure.actions) + 1
    fitted = replace(figure, room=MATRIX)
    for _ in range(FIT_TOLERANCE):  # smaller cells may turn the names upright, which takes height
        size = fitted.size
        over = max(
            (size.width() - room.width()) / columns,
            (size.height() - room.height()) / max(columns - 1, 1),
        )
        cell = max(fitted.box(0, 0).width() + 1 - max(over, 0.0), 1.0)
        fitted = replace(fitted, room=cell * columns)
    return fitted


def stage_combo_box() -> QComboBox:
    """Offers the stages ``"filtered"`` and ``"raw"`` of the predictions."""
    return combo_box(
        "Prediction",
        {"Filtered": "filtered", "Raw": "raw"},
        "Predictions after the filters, or as the classifier gave them",
    )


class DisplayOptions(QWidget):
    """Three lists to choose from, and what can be done with the matrix."""

    #: The same is to be shown otherwise; another stage has to be counted first.
    changed = Signal()

    def __init__(self, copy: Callable[[], object], save: Callable[[], object]) -> None:
        super().__init__()
        self.stage_box = stage_combo_box()
        self.unit_box = combo_box(
            "What is counted",
            {"Time": "time", "Segments": "segments"},
            "Seconds, or the coder's segments: each counts for what covers most of it in the "
            "prediction",
        )
        self.share_box = combo_box(
            "Share",
            {"By row": "row", "By column": "column", "Counts": "counts"},
            "Per cent of what the coder labelled (row), of what was predicted (column), or the "
            "counts alone",
        )
        self.copy = push_button("Copy", copy, tip="Copy the matrix as text for a spreadsheet")
        self.save = push_button("Save…", save, tip="Save the matrix as SVG, PDF or PNG")
        self._rows = QBoxLayout(QBoxLayout.Direction.LeftToRight, self)
        self._parts = (
            fill_layout(QHBoxLayout(), self.stage_box, self.unit_box, self.share_box, spacing=4),
            fill_layout(QHBoxLayout(), self.copy, self.save, spacing=4),
        )
        lists, buttons = self._parts
        fill_layout(self._rows, lists, 1, buttons, margins=(6, 6, 6, 2), spacing=4)
        for box in (self.unit_box, self.share_box):
            box.currentIndexChanged.connect(self.changed)

    def minimumSizeHint(self) -> QSize:
        """As narrow as the lists: the buttons then stand below them."""
        margins = self._rows.contentsMargins()
        widest = max(part.minimumSize().width() for part in self._parts)
        least = widest + margins.left() + margins.right()
        return QSize(least, super().minimumSizeHint().height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Begin a second row where the first would elide its texts."""
        super().resizeEvent(event)
        margins, direction = self._rows.contentsMargins(), QBoxLayout.Direction
        needed = sum(part.sizeHint().width() for part in self._parts) + self._rows.spacing()
        narrow = self.width() < needed + margins.left() + margins.right()
        self._rows.setDirection(direction.TopToBottom if narrow else direction.LeftToRight)

    @property
    def stage(self) -> str:
        """Of the predictions: ``"filtered"`` or ``"raw"``."""
        return str(self.stage_box.currentData())

    @property
    def unit(self) -> Unit:
        return cast(Unit, self.unit_box.currentData())

    @property
    def share(self) -> Share:
        return cast(Share, self.share_box.currentData())


CONFUSION_JOB = "confusion"
#: Least height of the matrix with its sentence, in lines; where there is less room, all scrolls.
LIST_LINES = 13
#: Height of what stands in place of the intervals while no cell is chosen, in lines.
HINT_LINES = 2


class ConfusionView(QWidget):
    """The confusion matrix of the run, and the intervals that a cell is counted from.

    Nothing is counted while it is hidden.
    """

    def __init__(self, document: Document, jobs: Jobs) -> None:
        super().__init__()
        self.document = document
        self._jobs = jobs
        self.cells: ConfusionCounts | None = None
        # What is counted or being counted: of this run these demonstrations, at this stage.
        self._run: RunResult | None = None
        self._requested: tuple[tuple[str, ...], str] = ((), "")
        self.switches = DisplayOptions(self.copy, self.ask_save)
        self.canvas = MatrixCanvas(lambda: self.figure)
        self.sentence = sentence_label()
        self.sentence.setAccessibleName("The cell")
        self.sentence.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Minimum)
        self.list = CellIntervals(document)
        self._area = QScrollArea()
        self._area.setWidget(self.canvas)
        self._area.installEventFilter(self)
        self._area.setFrameShape(QScrollArea.Shape.NoFrame)
        self._area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._area.setBackgroundRole(QPalette.ColorRole.Base)
        self._area.setAlignment(Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop)
        self._lay_out()
        self.switches.stage_box.currentIndexChanged.connect(self._refresh)
        self.switches.changed.connect(self._changed)
        self.canvas.pointed.connect(self._describe_cell)
        self.canvas.picked.connect(self._pick)
        on_visible_run_changed(document, self._refresh)
        themes().changed.connect(self._draw)

    @property
    def figure(self) -> ConfusionMatrix | None:
        """The matrix as it is saved: on white, with title and key."""
        return None if self.cells is None else self._figure(headed=True)

    def copy(self) -> None:
        """Copy what the matrix shows as tab-separated text."""
        cells, unit, share = self.cells, self.switches.unit, self.switches.share
        if cells is None:
            return
        matrix = cells.matrix(unit)
        shown = matrix if share == "counts" else normalise(matrix, share)
        decimals = 4 if share != "counts" else 3 if unit == "time" else 0
        lines = [["", *cells.actions, "unlabelled"]]
        for action, row in zip(cells.actions, shown.tolist(), strict=True):
            lines.append([action, *(f"{value:.{decimals}f}" for value in row)])
        copy_text(as_tsv(lines))
        self.document.show_message("The matrix was copied.")

    def ask_save(self) -> None:
        title, name = "Save the confusion matrix", "confusion.svg"
        if (figure := self.figure) is not None:
            export_picture(figure, self, title, name, self.document, self._jobs)

    # Qt

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._refresh()
        self._draw()

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self._jobs.cancel(CONFUSION_JOB)
        if self.cells is None:
            self._run = None

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.FontChange and self.isVisible():
            self._draw()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Fit the matrix into its room, also where only that of the list below has changed."""
        if watched is self._area and event.type() == QEvent.Type.Resize:
            self._draw()
        return super().eventFilter(watched, event)

    # Inside

    def _lay_out(self) -> None:
        upper = QWidget()
        self.sentence.setContentsMargins(8, 2, 8, 4)
        page_layout(upper, self._area, self.sentence, growing=self._area, spacing=2)
        upper.setMinimumHeight(LIST_LINES * self.fontMetrics().height())
        self._split = YieldingSplitter()
        fill_splitter(self._split, (upper, self.list), (3, 1))
        self._split.splitterMoved.connect(self._draw)
        self._page = scroll_area(self._split)
        self.pages = PageOrPlaceholder(self._page)
        page_layout(self, self.switches, self.pages, growing=self.pages)

    def _refresh(self) -> None:
        """Show the run as it is now, counting it if that was not done."""
        if not self.isVisible():
            return
        try:
            run = visible_run(self.document)
        except ForcelabError as error:
            self._run = None  # to be counted as soon as it can be read
            self._show_empty(str(error))
            return
        if run is None or not run.tested:
            self._jobs.cancel(CONFUSION_JOB)
            self._run = None
            self._show_empty(self._missing(run))
            return
        requested = (tuple(d.id for d in run.tested), self.switches.stage)
        if self._run is not self.document.review.run or self._requested != requested:
            if self._requested[0] != requested[0]:  # perhaps as some may not be seen any more
                self.canvas.show_figure(None)
            self._run, self._requested = self.document.review.run, requested
            self.cells = None
            self.list.clear()
            self._jobs.run(count_confusion(run, self.switches.stage), self._take, key=CONFUSION_JOB)

    def _missing(self, run: RunResult | None) -> str:
        """Why there is no matrix."""
        if self.document.project is None:
            return "Open a project to see which actions are confused."
        if run is None:
            return (
                "Train a recogniser; this then shows which actions it confuses, and every place "
                "where it does."
            )
        return (
            "No demonstration that you may see was tested in this run: label at least two, or "
            "finish those that you code blind."
        )

    def _changed(self) -> None:
        self._draw()
        self._relist()

    def _take(self, cells: ConfusionCounts) -> None:
        self.cells = cells
        if cells.demonstrations:
            self.pages.say("")
            self._changed()
        else:
            self._show_empty("This run kept no raw predictions; choose 'Filtered'.")
        self.switches.show()

    def _show_empty(self, text: str) -> None:
        self.cells = None
        self.canvas.show_figure(None)
        self.list.clear()
        self.pages.say(text)
        self.switches.hide()

    def _figure(self, *, headed: bool) -> ConfusionMatrix:
        assert self.cells is not None
        run, unit = self.document.review.run, self.switches.unit
        matrix, title = self.cells.matrix(unit), "" if run is None else run.title
        stage = self.switches.stage
        return ConfusionMatrix(
            f"{title}, after the filters" if stage == "filtered" else f"{title}, raw predictions",
            self.cells.actions,
            matrix if unit == "time" else matrix.astype(np.int64),
            theme=LIGHT if headed else colours(),
            unit="s" if unit == "time" else "segments",
            share=self.switches.share,
            headed=headed,
            # In the cells are shares: only the totals have a unit.
            total="total (s)" if unit == "time" and not headed else "total",
        )

    def _draw(self) -> None:
        if self.cells is None or not self.isVisible() or not self.cells.actions:
            return
        room = self._area.maximumViewportSize() / text_size.scale()
        figure = fit_figure(self._figure(headed=False), room)
        self.canvas.show_figure(figure)
        self._describe_cell(self.canvas.chosen or self.canvas.focus)

    def _describe_cell(self, cell: tuple[int, int] | None) -> None:
        if self.cells is None or cell is None:
            self.sentence.setText("")
            return
        text = self._cell_sentence(self.cells, *cell)
        self.sentence.setText(text)
        self.canvas.setAccessibleDescription(text)

    def _cell_sentence(self, cells: ConfusionCounts, row: int, column: int) -> str:
        """Such as ``"grab seen as hold: 12.3 s, 8 % of grab, in 5 places"``; by column, of hold."""
        unit, share = self.switches.unit, self.switches.share
        human = cells.actions[row]
        missed = column == len(cells.actions)
        predicted = "unlabelled" if missed else cells.actions[column]
        if missed:
            event = f"{human} left unlabelled"
        elif row == column:
            event = f"{human} recognised"
        else:
            event = f"{human} seen as {predicted}"
        matrix = cells.matrix(unit)
        if matrix[row, column] == 0:
            return f"{event}: never"
        part = 100 * float(normalise(matrix, "column" if share == "column" else "row")[row, column])
        total = human
        if share == "column":
            total = f"all that was {'left unlabelled' if missed else f'seen as {predicted}'}"
        share_text = f"{_percent_text(part)} % of {total}"
        number = int((matrix if unit == "segments" else cells.numbers(unit))[row, column])
        if unit == "segments":
            return f"{event}: {counted(number, 'segment')}, {share_text}"
        seconds = f"{matrix[row, column]:,.{_decimals(matrix[row, column])}f} s"
        return f"{event}: {seconds}, {share_text}, in {counted(number, 'place')}"

    def _pick(self, row: int, column: int, by_key: bool) -> None:
        """List the intervals of a cell; the keyboard goes there too."""
        if self.cells is None:
            return
        self._relist()
        # Once it has its room.
        QTimer.singleShot(0, self, lambda: self._page.ensureWidgetVisible(self.list, 0, 0))
        if by_key and self.list.places:
            self.list.table.setFocus()

    def _relist(self) -> None:
        if self.cells is None or self.canvas.chosen is None:
            self.list.clear()
            self._split.set_empty(self.list, HINT_LINES)
            return
        self._split.set_empty(self.list, 0)
        cells, unit, (row, column) = self.cells, self.switches.unit, self.canvas.chosen
        predicted = None if column == len(cells.actions) else cells.actions[column]
        places = cells.places(cells.actions[row], predicted, unit)
        names = {d.id: d.name for d in cells.demonstrations}
        self.list.show_places(places, names, int(cells.numbers(unit)[row, column]))
