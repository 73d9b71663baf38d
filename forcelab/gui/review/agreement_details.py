"""The parts of the agreement view: kappa matrix, charts, tables, and two coders compared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFont, QKeyEvent, QMouseEvent, QPainter, QPalette, QPen
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui.document import Document
from forcelab.gui.figures.colormap import colormap_colour
from forcelab.gui.figures.text import NAMES, ink_on, signed
from forcelab.gui.figures.tracks import LabelStyle
from forcelab.gui.item_views import TableColumn, TableRow, TextModel, TextTable
from forcelab.gui.kit import text_size
from forcelab.gui.kit.plot import Bars, PanelPlot
from forcelab.gui.label.swatches import paint_swatch, style_of
from forcelab.gui.layout import copyable, emphasise, fill_layout
from forcelab.gui.theme import colours
from forcelab.gui.widgets import ARROW_STEPS, combo_box, is_plain
from forcelab.labels import Interval
from forcelab.review.agreement import WINDOW, Agreement, PairAgreement
from forcelab.review.consistency import Consistency
from forcelab.review.kappa import landis_koch
from forcelab.text import counted, task_text
from forcelab.vocabulary import Vocabulary

#: Widths of all columns but the last, in digits.
COLUMN_WIDTHS = (15, 8, 10, 10, 10)


@dataclass(frozen=True, slots=True)
class IntervalRow:
    """An interval, what kind of difference is there, and whether it is decided."""

    place: Interval
    kind: str = ""
    done: bool = False


class IntervalTable(TextTable):
    """Intervals in rows: where, how long, what each of two coders says, and the kind."""

    interval_chosen = Signal(object)

    def __init__(self, title: str) -> None:
        super().__init__(TextModel())
        self.rows: tuple[IntervalRow, ...] = ()
        self.setAccessibleName(title)
        self.setTextElideMode(NAMES)
        header = self.horizontalHeader()
        header.setStretchLastSection(True)
        header.setTextElideMode(NAMES)
        header.setSectionResizeMode(QHeaderView.ResizeMode.Interactive)
        self.put((), {}, ("", "", ""))
        digit = self.fontMetrics().horizontalAdvance("0")
        for column, digits in enumerate(COLUMN_WIDTHS):
            header.resizeSection(column, digits * digit)
        self.clicked.connect(lambda index: self.interval_chosen.emit(self.rows[index.row()].place))

    def put(
        self, rows: Sequence[IntervalRow], names: Mapping[str, str], heads: tuple[str, str, str]
    ) -> None:
        """Show other intervals; `names` are the demonstrations', `heads` the last columns'."""
        self.rows = tuple(rows)
        numbers = TableColumn("At, s"), TableColumn("Length, s")
        texts = [TableColumn(head, number=False) for head in ("Demonstration", *heads)]
        self._model.show(
            (texts[0], *numbers, *texts[1:]), [_interval_cells(row, names) for row in rows]
        )

    def sizeHint(self) -> QSize:
        return QSize(320, 9 * self.verticalHeader().defaultSectionSize())

    def minimumSizeHint(self) -> QSize:
        return QSize(160, round(4.5 * self.verticalHeader().defaultSectionSize()))


def _interval_cells(row: IntervalRow, names: Mapping[str, str]) -> TableRow:
    place = row.place
    return TableRow(
        (
            names.get(place.demonstration, place.demonstration),
            f"{'✓ ' if row.done else ''}{place.start:.2f}",
            f"{place.duration:.3f}",
            place.human or "–",
            place.predicted or "–",
            row.kind,
        )
    )


#: Widths of a bin in ms, of which the first is taken that gives no more than so many bins.
BIN_WIDTHS, MOST_BINS = (1, 2, 5, 10, 20, 25, 50, 100), 50
#: The axis reaches at least so many ms to either side.
LEAST_RANGE = 50.0
CHART_MARGIN = 6


def histogram_bins(offsets: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """A histogram of offsets in ms: counts (2 n,) and edges (2 n + 1,), as far below zero as above.

    An offset on an edge counts in the bin above it.
    """
    reach = max(float(np.abs(offsets).max(initial=0.0)), LEAST_RANGE)
    width = next((w for w in BIN_WIDTHS if 2 * reach / w <= MOST_BINS), BIN_WIDTHS[-1])
    half = int(reach // width) + 1
    edges = width * np.arange(-half, half + 1, dtype=np.float64)
    # A thousandth of a ms is far below what times are exact to, and keeps an edge an edge.
    numbers = np.floor((offsets + 1e-3) / width).astype(np.int64) + half
    return np.bincount(numbers, minlength=2 * half), edges


class OffsetHistogram(PanelPlot):
    """How much later than the first coder, in ms, the second puts the boundaries."""

    def __init__(self) -> None:
        super().__init__(bottom="ms")
        self.offsets: NDArray[np.float64] = np.empty(0)
        self._second = ""
        self.setAccessibleName("Histogram of boundary offsets")

    def show_offsets(self, offsets: NDArray[np.float64], second: str) -> None:
        """Show by how many ms the second of two coders is later."""
        self.offsets, self._second = offsets, second
        self.redraw()

    @property
    def needed_height(self) -> float:
        return 9.0 * self.fontMetrics().height()

    @property
    def margins(self) -> tuple[float, float, float, float]:
        above, below = 1.2 * self.fontMetrics().height(), text_size.pixels(36)
        return 2.0 * CHART_MARGIN, above, 2.0 * CHART_MARGIN, below

    def redraw(self) -> None:
        self.clear()
        if not len(self.offsets):
            return
        theme, (counts, edges) = colours(), histogram_bins(self.offsets)
        self.show_all_of((edges[0], edges[-1]), (0.0, counts.max()))
        gap = pg.mkPen(theme.panel)
        bars = {"x0": edges[:-1], "x1": edges[1:], "height": counts}
        self.add(pg.BarGraphItem(**bars, brush=theme.curves[0], pen=gap))
        dashed = pg.mkPen(theme.frame, style=Qt.PenStyle.DashLine)
        self.add(pg.InfiniteLine(0.0, pen=dashed))
        self.add(pg.InfiniteLine(np.median(self.offsets), pen=pg.mkPen(theme.cursor, width=2)))

    def readout(self, pointer: QPointF) -> str:
        """How many offsets are in the bin under the pointer."""
        if not len(self.offsets) or not self.area.contains(pointer):
            return ""
        counts, edges = histogram_bins(self.offsets)
        number = int(np.searchsorted(edges, self.value_at(pointer).x(), side="right")) - 1
        number = min(max(number, 0), len(counts) - 1)
        start, end = _signed_ms(edges[number]), _signed_ms(edges[number + 1])
        return f"{start} to {end} ms: {counts[number]}"

    def paint_foreground(self, painter: QPainter) -> None:
        """Write the median, and what either side means."""
        if not len(self.offsets):
            return
        area, metrics = self.area, self.fontMetrics()
        line, median = metrics.height(), float(np.median(self.offsets))
        label = f"median {_signed_ms(median)} ms"
        wide = metrics.horizontalAdvance(label) + 2
        left = min(max(self.spot(median, 0).x() - wide / 2, 0.0), self.width() - wide)
        painter.setPen(QColor(colours().cursor))
        painter.drawText(QRectF(left, 0, wide, line), Qt.AlignmentFlag.AlignHCenter, label)
        below = QRectF(area.left(), self.height() - line, area.width(), line)
        painter.setPen(QColor(colours().muted))
        for text, side in (
            (f"{self._second} earlier", Qt.AlignmentFlag.AlignLeft),
            (f"{self._second} later", Qt.AlignmentFlag.AlignRight),
        ):
            room = int(area.width() / 2 - line)
            painter.drawText(below, side, metrics.elidedText(text, NAMES, room))


class ActionBars(PanelPlot):
    """A bar for the agreement on each action, from 0 to 100 %."""

    def __init__(self) -> None:
        super().__init__()
        self.shares: dict[str, float | None] = {}
        self._styles: dict[str, LabelStyle] = {}
        self.setAccessibleName("Agreement on each action")
        self.box.invertY()

    def show_shares(self, shares: Mapping[str, float | None], vocabulary: Vocabulary) -> None:
        """Show a share, 0 to 1, for each action; None where there is none."""
        self.shares = dict(shares)
        self._styles = {name: style_of(vocabulary, name) for name in shares}
        self.setAccessibleDescription(
            ", ".join(f"{name} {_whole_percent(share)}" for name, share in shares.items())
        )
        self.renew()

    @property
    def needed_height(self) -> float:
        return len(self.shares) * 1.5 * self.fontMetrics().height() + 2

    @property
    def _side(self) -> float:
        """Of a swatch."""
        return 0.8 * self.fontMetrics().height()

    @property
    def margins(self) -> tuple[float, float, float, float]:
        metrics = self.fontMetrics()
        widest = max((metrics.horizontalAdvance(name) for name in self.shares), default=0)
        names = min(widest, round(0.35 * self.width()))
        right = metrics.horizontalAdvance("100 %") + 2 * CHART_MARGIN
        return self._side + names + 3 * CHART_MARGIN, 0.0, right, 0.0

    def redraw(self) -> None:
        self.clear()
        if not self.shares:
            return
        self.show_all_of((0.0, 1.0), (0, len(self.shares)))
        rows, shares = np.arange(len(self.shares)) + 0.5, list(self.shares.values())
        for ends, colour in (
            (np.ones(len(rows)), colours().panel_edge),
            (np.array([share or 0.0 for share in shares]), colours().curves[0]),
        ):
            self.add(pg.BarGraphItem(x0=0, width=ends, y=rows, height=0.5, brush=colour, pen=None))

    def paint_foreground(self, painter: QPainter) -> None:
        theme, metrics, area, side = colours(), self.fontMetrics(), self.area, self._side
        left = side + 2 * CHART_MARGIN
        upright, high = Qt.AlignmentFlag.AlignVCenter, area.height() / max(len(self.shares), 1)
        for row, (name, share) in enumerate(self.shares.items()):
            top = area.top() + row * high
            swatch = QRectF(CHART_MARGIN, top + (high - side) / 2, side, side)
            paint_swatch(painter, swatch, self._styles[name])
            painter.setPen(QColor(theme.text))
            names = QRectF(left, top, area.left() - CHART_MARGIN - left, high)
            painter.drawText(names, upright, metrics.elidedText(name, NAMES, int(names.width())))
            painter.setPen(QColor(theme.text if share is not None else theme.muted))
            number = QRectF(area.right(), top, self.width() - area.right() - CHART_MARGIN, high)
            right = upright | Qt.AlignmentFlag.AlignRight
            painter.drawText(number, right, _whole_percent(share))


def _whole_percent(share: float | None) -> str:
    """A share in whole percent; never 100 where it is not all."""
    if share is None:
        return "–"
    percent = 99 if 0.99 < share < 1 else round(100 * share)
    return f"{percent} %"


#: Narrowest and widest cell in widths of a digit, its height in lines, and room around texts.
NARROWEST_CELL, WIDEST_CELL, CELL_LINES, CELL_PADDING = 5.0, 18.0, 2.5, 6
#: Kappa below which all cells are as light: chance agreement and worse.
LIGHTEST_KAPPA = 0.0


class CoderMatrix(PanelPlot):
    """Coders against coders: kappa and its word; the darker, the better they agree."""

    chosen = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self.authors: tuple[str, ...] = ()
        self.at = (0, 1)
        self._agreement: Agreement | None = None
        self.setAccessibleName("Kappa of every two coders")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.box.invertY()

    def show_agreement(self, agreement: Agreement) -> None:
        """Show an agreement, and keep the chosen pair if it is still in it."""
        chosen = self.pair
        self._agreement, self.authors = agreement, agreement.authors
        cells = [self._cell_of(pair) for pair in agreement.pairs]
        names = None if chosen is None else (chosen.a, chosen.b)
        same = [self._cell_of(p) for p in agreement.pairs if (p.a, p.b) == names]
        self.at = (*same, *cells, (0, 1))[0]
        self.renew()
        self._tell()

    @property
    def pair(self) -> PairAgreement | None:
        return self._pair_at(*self.at) if max(self.at) < len(self.authors) else None

    def choose(self, row: int, column: int) -> None:
        inside = 0 <= row < len(self.authors) and 0 <= column < len(self.authors)
        if inside and row != column:
            self.at = (row, column)
            self._tell()

    def cell(self, row: int, column: int) -> QRectF:
        return QRectF(self.spot(column, row), self.spot(column + 1, row + 1))

    @property
    def needed_height(self) -> float:
        return (len(self.authors) * CELL_LINES + 1.8) * self.fontMetrics().height() + 2

    @property
    def margins(self) -> tuple[float, float, float, float]:
        metrics, count = self.fontMetrics(), max(len(self.authors), 1)
        digit = metrics.horizontalAdvance("0")
        names = max((metrics.horizontalAdvance(name) for name in self.authors), default=0)
        left, top = min(names + 2 * CELL_PADDING, 0.3 * self.width()), 1.6 * metrics.height()
        wide = max((self.width() - left - 1) / count, NARROWEST_CELL * digit)
        wide, high = count * min(wide, WIDEST_CELL * digit), count * CELL_LINES * metrics.height()
        return left, top, self.width() - left - wide, self.height() - top - high

    # Keys and pointer

    def keeps(self, event: QKeyEvent) -> bool:
        """Whether a key is an arrow, which the window uses too."""
        return event.key() in ARROW_STEPS and is_plain(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        step = ARROW_STEPS.get(Qt.Key(event.key()))
        if step is None:
            super().keyPressEvent(event)
            return
        row, column = self.at[0] + step[0], self.at[1] + step[1]
        if row == column:  # the diagonal: on to the next
            row, column = row + step[0], column + step[1]
        self.choose(row, column)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if (cell := self._cell_at(event.position())) is not None:
            self.choose(*cell)

    def readout(self, pointer: QPointF) -> str:
        """The cell in words, as names may be elided."""
        cell = self._cell_at(pointer)
        return "" if cell is None else self._cell_text(*cell)

    def _cell_at(self, where: QPointF) -> tuple[int, int] | None:
        at = self.value_at(where)
        return (int(at.y()), int(at.x())) if self.authors and self.area.contains(where) else None

    # Drawing

    def redraw(self) -> None:
        self.clear()
        count = len(self.authors)
        if not count:
            return
        self.show_all_of((0, count), (0, count))
        rows, columns = (places.ravel() for places in np.indices((count, count)))
        fills = [self._ground(*cell) for cell in zip(rows.tolist(), columns.tolist(), strict=True)]
        gap = pg.mkPen(colours().panel, width=2)
        self.add(Bars(x0=columns, y0=rows, width=1, height=1, brushes=fills, pen=gap))

    def paint_foreground(self, painter: QPainter) -> None:
        """Write names, kappas and their words, and frame the chosen pair."""
        theme, metrics, area = colours(), self.fontMetrics(), self.area
        middle = Qt.AlignmentFlag.AlignCenter
        right = Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignRight
        for i, name in enumerate(self.authors):
            painter.setPen(QColor(theme.text))
            box = self.cell(i, i)
            row = QRectF(0, box.top(), area.left() - CELL_PADDING, box.height())
            painter.drawText(row, right, metrics.elidedText(name, NAMES, int(row.width())))
            head, room = QRectF(box.left(), 0, box.width(), area.top()), box.width() - CELL_PADDING
            painter.drawText(head, middle, metrics.elidedText(name, NAMES, int(room)))
            for column in range(len(self.authors)):
                self._paint_cell(painter, i, column)
        if self.pair is not None:
            painter.setPen(QPen(QColor(theme.text), 3 if self.hasFocus() else 2))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRect(self.cell(*self.at).adjusted(1, 1, -1, -1))

    def _ground(self, row: int, column: int) -> QColor:
        pair = self._pair_at(row, column)
        if pair is None or pair.kappa is None:
            return QColor(colours().panel)
        return colormap_colour(max(pair.kappa, LIGHTEST_KAPPA))

    def _paint_cell(self, painter: QPainter, row: int, column: int) -> None:
        """Write kappa and its word; on the diagonal how much the coder labelled."""
        box, pair = self.cell(row, column).adjusted(3, 2, -3, -2), self._pair_at(row, column)
        middle = Qt.AlignmentFlag.AlignCenter
        metrics, room = self.fontMetrics(), int(box.width())
        if pair is None or pair.kappa is None:
            painter.setPen(QColor(colours().muted))
            count = self._labelled(self.authors[row]) if row == column else None
            label = "–" if count is None else f"{count} coded"
            if metrics.horizontalAdvance(label) > room:
                label = label.removesuffix(" coded")
            painter.drawText(box, middle, label)
            return
        painter.setPen(ink_on(self._ground(row, column)))
        face = QFont(self.font())
        face.setBold(True)
        word = landis_koch(pair.kappa)
        half = box.height() / 2 if metrics.horizontalAdvance(word) <= room else 0.0
        painter.setFont(face)
        painter.drawText(box.adjusted(0, 0, 0, -half), middle, signed(f"{pair.kappa:.2f}"))
        painter.setFont(self.font())
        if half:
            painter.drawText(box.adjusted(0, half, 0, 0), middle, word)

    def _pair_at(self, row: int, column: int) -> PairAgreement | None:
        if self._agreement is None or row == column:
            return None
        return self._agreement.pair(self.authors[row], self.authors[column])

    def _cell_of(self, pair: PairAgreement) -> tuple[int, int]:
        """The cell of a pair, below which it is mirrored."""
        return self.authors.index(pair.a), self.authors.index(pair.b)

    def _labelled(self, author: str) -> int:
        counts = {} if self._agreement is None else self._agreement.counts
        return sum(counts.get(author, {}).values())

    def _cell_text(self, row: int, column: int) -> str:
        a, b = self.authors[row], self.authors[column]
        if row == column:
            return f"{a}: {counted(self._labelled(a), 'demonstration')} labelled"
        pair = self._pair_at(row, column)
        if pair is None:
            return f"{a} and {b} have no demonstration in common"
        if pair.kappa is None:
            return f"{a} and {b}: no kappa, as only one action was labelled"
        kappa, word = signed(f"{pair.kappa:.3f}"), landis_koch(pair.kappa)
        common = counted(len(pair.demonstrations), "demonstration")
        return f"{a} and {b}: kappa {kappa}, {word} (Landis and Koch); {common}"

    def _tell(self) -> None:
        if self.authors:
            self.setAccessibleDescription(self._cell_text(*self.at) if self.pair else "")
        self.update()
        self.chosen.emit(self.pair)


#: How many places are listed at most; the rest are shorter than all of these.
MOST_INTERVALS = 2000


def unfocused_label(muted: bool = False) -> QLabel:
    """A label to copy from that leaves the keyboard where it is."""
    label = copyable()
    label.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    if muted:
        label.setForegroundRole(QPalette.ColorRole.PlaceholderText)
    return label


class PairDetails(QWidget):
    """What two coders agree on, and where they differ."""

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.document = document
        self._pair: PairAgreement | None = None
        self._names: Mapping[str, str] = {}
        self.title = unfocused_label()
        emphasise(self.title)
        self.frames, self.alone = unfocused_label(), unfocused_label()
        self.each, self.bars = unfocused_label(), ActionBars()
        self.offsets, self.histogram = unfocused_label(), OffsetHistogram()
        self.segments = unfocused_label()
        self.kinds = combo_box(
            "Which places are listed",
            {
                "All differences": "all",
                "Different actions": "apart",
                "Only one labelled": "alone",
                "Boundaries moved": "shifted",
            },
        )
        self.kinds.activated.connect(self._list)
        self.places = IntervalTable("Places where the two differ")
        self.places.interval_chosen.connect(document.review.examine)
        self._count = unfocused_label(muted=True)
        row = fill_layout(QHBoxLayout(), self.kinds, (self._count, 1))
        frames = self.title, self.frames, self.alone
        column = fill_layout(QVBoxLayout(self), *frames, margins=0, spacing=4)
        for group in (
            (self.each, self.bars),
            (self.offsets, self.histogram),
            (self.segments,),
            (row, (self.places, 1)),
        ):
            column.addSpacing(4)
            fill_layout(column, *group)

    def show_pair(self, pair: PairAgreement, names: Mapping[str, str]) -> None:
        """Show two coders; `names` are the demonstrations' by id."""
        self._pair, self._names = pair, names
        self._show_frames(pair)
        self._show_actions(pair)
        self._show_boundaries(pair)
        self._show_segments(pair)
        self._list()

    def _show_frames(self, pair: PairAgreement) -> None:
        common = counted(len(pair.demonstrations), "demonstration")
        self.title.setText(f"{pair.a} and {pair.b}, {common}")
        kappa, agreed = pair.kappa, pair.agreed
        if agreed is None:
            text = "No time is labelled by both, so nothing can be compared."
        elif kappa is None:
            text = "Both used only one action; kappa cannot tell that from chance."
        else:
            text = (
                f"Kappa {signed(f'{kappa:.2f}')}, “{landis_koch(kappa)}” by Landis and Koch. "
                f"They agree {_percent_text(agreed)} of the time; "
                "kappa is agreement beyond chance (0 chance, 1 perfect)."
            )
            if pair.interval is not None:
                low, high = pair.interval
                text += f" 95 % interval {signed(f'{low:.2f}')} to {signed(f'{high:.2f}')}."
        self.frames.setText(text)
        first, second = pair.only
        self.alone.setText(
            f"Only one of them labelled {_percent_text(pair.only_share)} of the labelled time "
            f"({pair.a} {first:.1f} s, {pair.b} {second:.1f} s);"
            " it enters neither kappa nor the figures of actions and segments."
        )

    def _show_actions(self, pair: PairAgreement) -> None:
        self.each.setText("Actions: where one coder labels it, how often the other does too.")
        self.bars.show_shares(pair.by_action, self.document.vocabulary)

    def _show_boundaries(self, pair: PairAgreement) -> None:
        quartiles = pair.quartiles
        self.histogram.setVisible(quartiles is not None)
        window = f"{1000 * WINDOW:.0f} ms"
        if quartiles is None:
            self.offsets.setText(f"Boundaries: no two are within {window} of each other.")
            return
        low, middle, high = quartiles
        when = "later" if round(middle) >= 0 else "earlier"
        near = ", ".join(
            f"{_percent_text(share)} within {ms} ms" for ms, share in pair.within.items()
        )
        count, (first, second) = len(pair.offsets), pair.boundaries
        matched = f"{count} boundaries match within {window}, of {first} and {second}."
        if count == first == second:
            matched = f"All {count} boundaries match within {window}."
        self.offsets.setText(
            f"Boundaries: {pair.b} puts the same boundary {abs(middle):.0f} ms {when} than "
            f"{pair.a} (median; half of them lie from {_signed_ms(low)} to {_signed_ms(high)} ms). "
            f"{near}. {matched}"
        )
        self.histogram.show_offsets(pair.offsets, pair.b)

    def _show_segments(self, pair: PairAgreement) -> None:
        f1 = ", ".join(
            f"{_percent_text(value)} at {overlap} %"
            for overlap, value in pair.f1.items()
            if value is not None
        )
        self.segments.setText(
            f"Segments (F1): {f1 or '–'}. 100 % means that every segment overlaps one of "
            "the same action in the other track by at least that much."
        )

    def _list(self) -> None:
        """List the places of the chosen kind, the longest first."""
        pair, kind = self._pair, self.kinds.currentData()
        if pair is None:
            return
        kinds = {
            "apart": (pair.apart, "different actions"),
            "alone": (pair.alone, "only one labelled"),
            "shifted": (pair.shifted, "boundary moved"),
        }
        chosen = ("apart", "alone") if kind == "all" else (kind,)
        rows = [IntervalRow(place, kinds[name][1]) for name in chosen for place in kinds[name][0]]
        rows.sort(key=lambda row: -row.place.duration)
        count = f"{len(rows)}, the longest first"
        self._count.setText(count if rows else "There are none.")
        self.places.setVisible(bool(rows))
        self.places.put(rows[:MOST_INTERVALS], self._names, (pair.a, pair.b, "What"))


def _percent_text(share: float) -> str:
    """A share in percent with a decimal; never 100.0 where it is not all."""
    percent = min(100 * share, 99.9) if share < 1 else 100.0
    return f"{percent:.1f}\N{NO-BREAK SPACE}%"


def _signed_ms(ms: float) -> str:
    """Whole milliseconds with their sign; none at zero."""
    return f"{ms:+.0f}".replace("-", "\N{MINUS SIGN}") if round(ms) else "0"


class ConsistencyView(QWidget):
    """How consistent a coder is."""

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.document = document
        self._own: tuple[Consistency, ...] = ()
        self._names: Mapping[str, str] = {}
        self.coder = combo_box("Coder", {})
        self.coder.activated.connect(self._show)
        about = unfocused_label(muted=True)
        about.setText(
            "± is the spread of an action's durations, as a share of their mean. A low one "
            "means that its segments are about as long each time."
        )
        self._model = TextModel(self)
        self.durations = TextTable(self._model)
        self.durations.setAccessibleName("Durations of each action")
        self.durations.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        self.durations.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        high = self.durations.verticalHeader().defaultSectionSize()
        self.durations.setMinimumHeight(round(6.5 * high))  # where there is less room, all scrolls
        self._odd = unfocused_label()
        self.places = IntervalTable("Segments that stand out")
        self.places.interval_chosen.connect(document.review.examine)
        parts = self.coder, about, (self.durations, 1), self._odd, (self.places, 1)
        fill_layout(QVBoxLayout(self), *parts, margins=6)

    def show_agreement(self, agreement: Agreement, names: Mapping[str, str]) -> None:
        chosen = self.coder.currentText()
        self._own, self._names = agreement.own, names
        self.coder.clear()
        self.coder.addItems([consistency.author for consistency in agreement.own])
        self.coder.setCurrentIndex(max(self.coder.findText(chosen), 0))
        self._show()

    def _show(self) -> None:
        index = self.coder.currentIndex()
        if not 0 <= index < len(self._own):
            return
        consistency = self._own[index]
        tasks = len({item.task for item in consistency.actions})
        rows = []
        for item in consistency.actions:
            # The task stands last, so that it is cut before the action is.
            name = item.action if tasks == 1 else f"{item.action} · {task_text(item.task)}"
            spread = "–" if item.variation is None else f"{100 * item.variation:.0f}"
            rows.append(TableRow((name, str(item.count), f"{item.mean:.2f}", spread)))
        numbers = "Count", "Mean, s", "± %"
        self._model.show((TableColumn("Action", number=False), *map(TableColumn, numbers)), rows)
        self.durations.fit_columns(stretched=0)
        odd = [IntervalRow(place, "unusual duration") for place in consistency.odd]
        rare = [IntervalRow(place, "unusual order") for place in consistency.rare]
        text = "No segment stands out by its duration or its order."
        if odd or rare:
            text = (
                f"Unusually long or short for their action: {counted(len(odd), 'segment')}. Two "
                "actions that follow each other as in no other demonstration of the task: "
                f"{counted(len(rare), 'time')}. Worth a look; it need not be a mistake."
            )
        self._odd.setText(text)
        self.places.setVisible(bool(odd or rare))
        heads = ("Action", "Then", "What")
        self.places.put([*odd, *rare], self._names, heads)
