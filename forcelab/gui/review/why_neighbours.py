"""The nearest training segments of two actions, side by side as cards that can be chosen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QImage, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import (
    QAbstractButton,
    QGridLayout,
    QLabel,
    QSizePolicy,
    QWidget,
)

from forcelab.gui.document import Document
from forcelab.gui.figures import text
from forcelab.gui.label.force_axes import curve_colour
from forcelab.gui.label.swatches import look_of, paint_swatch
from forcelab.gui.review.colouring import vocabulary_seen
from forcelab.gui.theme import colours, themes
from forcelab.review.differences import Interval

if TYPE_CHECKING:
    from forcelab.review.explanation import Neighbour, Trace

__all__ = ["Card", "Heading", "Neighbours"]

#: Heights of fonts, of a card and of its frame of video, in pixels.
NAME, SMALL = 11.0, 10.0
HIGH, PADDING = 76, 6.0


class Card(QAbstractButton):
    """One training segment: where it is, how far off, and what its forces looked like.

    Parameters
    ----------
    neighbour : Neighbour
    name : str
        Of its demonstration.
    """

    def __init__(self, neighbour: Neighbour, name: str) -> None:
        super().__init__()
        self.neighbour, self.name = neighbour, name
        self.trace: Trace | None = None
        self.span: tuple[float, float] | None = None
        self._frame: QImage | None = None
        self.setCheckable(True)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setAccessibleName(
            "{} at {} s, {}, distance {}".format(name, *self._numbers(), neighbour.place.human)
        )
        self.setToolTip("Show this segment with its surroundings")
        themes().changed.connect(self.update)

    def _numbers(self) -> tuple[str, str]:
        """Time and distance, as they are written."""
        return f"{self.neighbour.place.start:.2f}", f"{self.neighbour.distance:.1f}"

    def sizeHint(self) -> QSize:
        """Low: three stand above each other."""
        return QSize(180, HIGH)

    def show_trace(self, trace: Trace, span: tuple[float, float]) -> None:
        """Show the forces, drawn from `span`'s lower to its upper force, and the frame."""
        self.trace, self.span = trace, span
        if trace.frame is not None:
            height, width = trace.frame.shape[:2]
            image = QImage(trace.frame.data, width, height, 3 * width, QImage.Format.Format_RGB888)
            self._frame = image.copy()  # of its own: the array goes
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the card."""
        theme = colours()
        with QPainter(self) as painter:
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            chosen = self.isChecked() or self.hasFocus()
            painter.setPen(QPen(QColor(theme.accent if chosen else theme.panel_edge), 1 + chosen))
            lit = self.underMouse() and self.isEnabled()
            painter.setBrush(QColor(theme.panel_edge if lit else theme.background))
            painter.drawRoundedRect(QRectF(self.rect()).adjusted(1, 1, -1, -1), 4, 4)
            painter.setOpacity(1.0 if self.isEnabled() else 0.35)
            inside = QRectF(self.rect()).adjusted(PADDING, PADDING, -PADDING, -PADDING)
            self._paint_line(painter, inside)
            lower = inside.adjusted(0, NAME + 5, 0, 0)
            if self._frame is not None:
                lower.setLeft(self._paint_frame(painter, lower, self._frame) + PADDING)
            if self.trace is not None and self.span is not None:
                self._paint_trace(painter, lower, self.trace, self.span)

    def _paint_frame(self, painter: QPainter, box: QRectF, frame: QImage) -> float:
        """Draw the frame at the left; gives where it ends."""
        width = min(box.height() * frame.width() / frame.height(), box.width() / 2)
        height = width * frame.height() / frame.width()
        place = QRectF(box.left(), box.center().y() - height / 2, width, height)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        painter.drawImage(place, frame)
        return place.right()

    def _paint_line(self, painter: QPainter, box: QRectF) -> None:
        """Name and time at the left, distance at the right."""
        theme, y = colours(), box.top() + NAME / 2
        face, small = text.font(NAME), text.font(SMALL)
        seconds, distance = self._numbers()
        far = f"d {distance}"
        when = f"{seconds} s"
        ink = QColor(theme.muted)
        text.put(painter, box.right(), y, far, face=small, ink=ink, align=1.0)
        room = box.width() - text.width(far, small) - text.width(when, small) - 18
        name = text.elided_name(self.name, face, max(room, 20))
        text.put(painter, box.left(), y, name, face=face, ink=QColor(theme.text))
        at = box.left() + text.width(name, face) + 6
        text.put(painter, at, y, when, face=small, ink=ink)

    def _paint_trace(
        self, painter: QPainter, box: QRectF, trace: Trace, span: tuple[float, float]
    ) -> None:
        """Draw each channel as a band from its least to its greatest sample."""
        low, high = span
        unit = box.height() / ((high - low) or 1.0)
        columns, channels = trace.low.shape
        xs = box.left() + box.width() * np.arange(columns) / max(columns - 1, 1)
        painter.setClipRect(box.adjusted(0, -1, 0, 1))
        for channel in range(channels):
            painter.setPen(QPen(curve_colour(channel, colours()), 1.1))
            ends = np.stack([trace.low[:, channel], trace.high[:, channel]], axis=1).ravel()
            ys = box.bottom() - (ends - low) * unit
            known = np.isfinite(ys)
            pieces = zip(np.repeat(xs, 2)[known].tolist(), ys[known].tolist(), strict=True)
            painter.drawPolyline(QPolygonF([QPointF(x, y) for x, y in pieces]))
        painter.setClipping(False)


class Heading(QWidget):
    """The name of a column's action with its colour, and what it is to the place."""

    def __init__(self, document: Document, action: str, role: str) -> None:
        super().__init__()
        self.action, self.role = action, role
        self._look = look_of(vocabulary_seen(document), action)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName(f"{action}, {role}")
        themes().changed.connect(self.update)

    def sizeHint(self) -> QSize:
        """One line."""
        return QSize(160, 20)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw swatch, action and role."""
        theme = colours()
        with QPainter(self) as painter:
            painter.setOpacity(1.0 if self.isEnabled() else 0.35)
            paint_swatch(painter, QRectF(1, 4, 12, 12), self._look)
            face, small = text.font(NAME, bold=True), text.font(SMALL)
            name = text.elided_name(self.action, face, max(self.width() - 18, 20))
            text.put(painter, 18, 10, name, face=face, ink=QColor(theme.text))
            at = 18 + text.width(name, face) + 8
            role = text.elided(self.role, small, self.width() - at)
            if len(role) > 1:
                text.put(painter, at, 10, role, face=small, ink=QColor(theme.muted))


class Neighbours(QWidget):
    """Two columns of cards: segments of the one action, and of the other.

    Attributes
    ----------
    chosen : Signal(object)
        The place of a card that was clicked.
    """

    chosen = Signal(object)

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.document = document
        self.cards: list[Card] = []
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setSpacing(6)
        for column in (0, 1):
            self._grid.setColumnStretch(column, 1)

    def show_neighbours(
        self,
        columns: Sequence[tuple[str, str, Sequence[Neighbour]]],
        name_of: Callable[[str], str],
    ) -> None:
        """Show other neighbours: for each column its action, what that is, and its segments."""
        while (item := self._grid.takeAt(0)) is not None:
            if (widget := item.widget()) is not None:
                widget.hide()
                widget.deleteLater()
        self.cards = []
        for column, (action, role, found) in enumerate(columns):
            self._grid.addWidget(Heading(self.document, action, role), 0, column)
            for row, neighbour in enumerate(found, 1):
                card = Card(neighbour, name_of(neighbour.place.demonstration))
                card.clicked.connect(partial(self.chosen.emit, neighbour.place))
                self._grid.addWidget(card, row, column)
                self.cards.append(card)
            if not found:
                none = QLabel("No other demonstration has any.")
                none.setWordWrap(True)
                self._grid.addWidget(none, 1, column, Qt.AlignmentFlag.AlignTop)

    def show_traces(self, traces: Sequence[Trace]) -> None:
        """Show what the cards' segments looked like, all on one scale, in the cards' order."""
        ends = [
            (float(np.nanmin(t.low)), float(np.nanmax(t.high)))
            for t in traces
            if np.isfinite(t.low).any()
        ]
        if not ends:
            return
        span = min(low for low, _ in ends), max(high for _, high in ends)
        for card, trace in zip(self.cards, traces, strict=True):
            card.show_trace(trace, span)

    @property
    def traced(self) -> bool:
        """Whether every card shows what its segment looked like."""
        return all(card.trace is not None for card in self.cards)

    def mark(self, place: Interval | None) -> None:
        """Mark the card of the place that is looked at."""
        for card in self.cards:
            card.setChecked(place is not None and card.neighbour.place == place)
