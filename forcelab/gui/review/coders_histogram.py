"""Two small pictures of two coders: how far boundaries lie apart, and how each action agrees."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget

from forcelab.gui.figures.axes import Axis
from forcelab.gui.figures.text import NAMES
from forcelab.gui.figures.tracks import Look
from forcelab.gui.label.swatches import look_of, paint_swatch
from forcelab.gui.theme import colours, themes
from forcelab.vocabulary import Vocabulary

__all__ = ["ActionBars", "OffsetHistogram", "bins"]

#: Widths of a bin in ms, of which the first is taken that gives no more than so many bins.
WIDTHS, MOST = (1, 2, 5, 10, 20, 25, 50, 100), 50
#: The axis reaches at least so many ms to either side.
LEAST = 50.0
MARGIN = 6


def bins(offsets: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """A histogram about zero.

    Parameters
    ----------
    offsets : ndarray, shape (m,)
        Milliseconds.

    Returns
    -------
    counts : ndarray of int64, shape (2 n,)
    edges : ndarray of float64, shape (2 n + 1,)
        Multiples of the bins' width, as far below zero as above; an offset on an edge counts in
        the bin above it.
    """
    reach = max(float(np.abs(offsets).max(initial=0.0)), LEAST)
    width = next((w for w in WIDTHS if 2 * reach / w <= MOST), WIDTHS[-1])
    half = int(reach // width) + 1
    edges = width * np.arange(-half, half + 1, dtype=np.float64)
    # A thousandth of a ms is far below what times are exact to, and keeps an edge an edge.
    numbers = np.floor((offsets + 1e-3) / width).astype(np.int64) + half
    return np.bincount(numbers, minlength=2 * half), edges


class OffsetHistogram(QWidget):
    """How many boundaries the second coder puts how much later than the first."""

    def __init__(self) -> None:
        super().__init__()
        self.offsets: NDArray[np.float64] = np.empty(0)
        self._second = ""
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName("Histogram of boundary offsets")
        themes().changed.connect(self.update)

    def show_offsets(self, offsets: NDArray[np.float64], second: str) -> None:
        """Show by how many ms the second of two coders is later."""
        self.offsets, self._second = offsets, second
        self.update()

    def sizeHint(self) -> QSize:
        """Wide and low."""
        return QSize(320, 9 * self.fontMetrics().height())

    def minimumSizeHint(self) -> QSize:
        """As high as it is."""
        return QSize(160, self.sizeHint().height())

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw bars, the axis in ms, zero and the median."""
        if not len(self.offsets):
            return
        with QPainter(self) as painter:
            theme, line = colours(), self.fontMetrics().height()
            box = QRectF(self.rect()).adjusted(MARGIN, 1.2 * line, -MARGIN, -2.6 * line)
            counts, edges = bins(self.offsets)
            axis = Axis(float(edges[0]), float(edges[-1]), box.left(), box.right())
            for count, left, right in zip(counts, edges, edges[1:], strict=False):
                if count:
                    high = box.height() * float(count / counts.max())
                    x, end = axis.at(float(left)), axis.at(float(right))
                    bar = QRectF(x, box.bottom() - high, max(end - x - 1, 1), high)
                    painter.fillRect(bar, QColor(theme.curves[0]))
            painter.setPen(QPen(QColor(theme.frame), 1))
            painter.drawLine(QLineF(box.bottomLeft(), box.bottomRight()))
            self._paint_axis(painter, axis, box)
            self._paint_median(painter, axis, box)

    def _paint_axis(self, painter: QPainter, axis: Axis, box: QRectF) -> None:
        """Draw the numbers below, and what they are."""
        theme, metrics = colours(), self.fontMetrics()
        line, middle = metrics.height(), Qt.AlignmentFlag.AlignHCenter
        for value, number in axis.marks(line, upright=False):
            x = axis.at(value)
            painter.setPen(QPen(QColor(theme.frame), 1))
            painter.drawLine(QLineF(x, box.bottom(), x, box.bottom() + 4))
            painter.setPen(QColor(theme.muted))
            wide = metrics.horizontalAdvance(number) + 2
            left = min(max(x - wide / 2, 0.0), self.width() - wide)
            painter.drawText(QRectF(left, box.bottom() + 4, wide, line), middle, number)
        painter.setPen(QPen(QColor(theme.frame), 1, Qt.PenStyle.DashLine))
        painter.drawLine(QLineF(axis.at(0.0), box.top(), axis.at(0.0), box.bottom()))
        below = QRectF(box.left(), box.bottom() + 4 + 1.2 * line, box.width(), line)
        half = int(below.width() / 2 - line)
        painter.setPen(QColor(theme.muted))
        for text, side in (
            (f"{self._second} earlier", Qt.AlignmentFlag.AlignLeft),
            (f"{self._second} later", Qt.AlignmentFlag.AlignRight),
        ):
            painter.drawText(below, side, metrics.elidedText(text, NAMES, half))
        painter.drawText(below, middle, "ms")

    def _paint_median(self, painter: QPainter, axis: Axis, box: QRectF) -> None:
        """Draw the line that half of the offsets lie below."""
        median = float(np.median(self.offsets))
        x, line = axis.at(median), self.fontMetrics().height()
        painter.setPen(QPen(QColor(colours().cursor), 2))
        painter.drawLine(QLineF(x, box.top() - 2, x, box.bottom()))
        number = f"{median:+.0f}".replace("-", "\N{MINUS SIGN}")
        text = "median {} ms".format("0" if round(median) == 0 else number)
        wide = self.fontMetrics().horizontalAdvance(text) + 2
        left = min(max(x - wide / 2, 0.0), self.width() - wide)
        painter.drawText(
            QRectF(left, box.top() - 1.2 * line, wide, line), Qt.AlignmentFlag.AlignHCenter, text
        )


class ActionBars(QWidget):
    """A bar for the agreement on each action, from 0 to 100 %."""

    def __init__(self) -> None:
        super().__init__()
        self.shares: dict[str, float | None] = {}
        self._looks: dict[str, Look] = {}
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName("Agreement on each action")
        themes().changed.connect(self.update)

    def show_shares(self, shares: Mapping[str, float | None], vocabulary: Vocabulary) -> None:
        """Show a share, 0 to 1, for each action; None where there is none."""
        self.shares = dict(shares)
        self._looks = {name: look_of(vocabulary, name) for name in shares}
        self.setAccessibleDescription(
            ", ".join(f"{name} {_percent(share)}" for name, share in shares.items())
        )
        self.updateGeometry()
        self.update()

    def sizeHint(self) -> QSize:
        """A line for each action."""
        return QSize(320, round(len(self.shares) * self._line) + 2)

    def minimumSizeHint(self) -> QSize:
        """As high as it is."""
        return QSize(160, self.sizeHint().height())

    @property
    def _line(self) -> float:
        """Height of a row in pixels."""
        return 1.5 * self.fontMetrics().height()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw swatch, name, bar and number of each action."""
        with QPainter(self) as painter:
            theme, metrics = colours(), self.fontMetrics()
            line, side = self._line, metrics.height() * 0.8
            numbers = metrics.horizontalAdvance("100 %") + MARGIN
            widest = max((metrics.horizontalAdvance(name) for name in self.shares), default=0)
            names = min(widest, round(0.35 * self.width()))
            left = side + 2 * MARGIN + names + MARGIN
            room = max(self.width() - left - numbers - MARGIN, 1.0)
            upright = Qt.AlignmentFlag.AlignVCenter
            for row, (name, share) in enumerate(self.shares.items()):
                top = row * line
                swatch = QRectF(MARGIN, top + (line - side) / 2, side, side)
                paint_swatch(painter, swatch, self._looks[name])
                painter.setPen(QColor(theme.text))
                shown = metrics.elidedText(name, NAMES, names)
                painter.drawText(QRectF(side + 2 * MARGIN, top, names, line), upright, shown)
                bar = QRectF(left, top + 0.25 * line, room, 0.5 * line)
                painter.fillRect(bar, QColor(theme.panel_edge))
                if share is not None:
                    painter.fillRect(
                        QRectF(bar.left(), bar.top(), share * room, bar.height()),
                        QColor(theme.curves[0]),
                    )
                painter.setPen(QColor(theme.text if share is not None else theme.muted))
                number = QRectF(left + room, top, numbers, line)
                painter.drawText(number, upright | Qt.AlignmentFlag.AlignRight, _percent(share))


def _percent(share: float | None) -> str:
    """A share in whole percent; never 100 where it is not all."""
    if share is None:
        return "–"
    whole = 99 if 0.99 < share < 1 else round(100 * share)
    return f"{whole} %"
