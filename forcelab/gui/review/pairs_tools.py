"""What stands above the timeline pairs: search, order, time axis, rows, export; and the legend."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QAction, QColor, QPainter, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QHBoxLayout,
    QMenu,
    QScrollArea,
    QSizePolicy,
    QToolButton,
    QWidget,
)

from forcelab.gui import settings
from forcelab.gui.arranging import search_field
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis, draw_bottom
from forcelab.gui.figures.legend import Legend
from forcelab.gui.figures.tracks import Look
from forcelab.gui.naming import verbatim
from forcelab.gui.review.confusion_switches import choice
from forcelab.gui.review.pairs_layout import MARGIN
from forcelab.gui.review.pairs_rows import Order, Wanted
from forcelab.gui.theme import colours, themes

__all__ = ["AxisStrip", "LegendRoom", "LegendStrip", "PairsTools"]

ROWS, ORDER, STRETCHED = "review/pairs/rows", "review/pairs/order", "review/pairs/stretched"
#: How the choice of a coder's row is remembered, apart from the stages.
CODER = "coder "


class PairsTools(QWidget):
    """Search, order, time axis, further rows and export.

    Signals
    -------
    changed()
        Something else is to be shown.
    ordered()
        Another order is chosen, and told by `changed`, too.
    exporting()
        The pairs are to be saved as a picture.
    """

    changed = Signal()
    ordered = Signal()
    exporting = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._wanted = set(settings.strings(ROWS))
        self.coders: tuple[str, ...] = ()
        name = "Filter timeline pairs by name or task"
        self.search = search_field("Filter by name or task", name)
        self.search.setMinimumWidth(60)
        self.order = choice(
            "Order of the timeline pairs",
            {
                "By name": "name",
                "Worst first": "worst",
                "Longest first": "longest",
            },
        )
        self.order.setCurrentIndex(max(0, self.order.findData(settings.text(ORDER))))
        self.stretched = QCheckBox("Full width")
        self.stretched.setAccessibleName("Stretch each demonstration to the full width")
        self.stretched.setToolTip(self.stretched.accessibleName())
        self.stretched.setChecked(settings.flag(STRETCHED))
        self.rows = _button("Rows", "Further rows below each pair")
        self.menu = QMenu(self.rows)
        self.rows.setMenu(self.menu)
        self.rows.setStyleSheet(
            "QToolButton { padding-right: 1.2em; }"
            "QToolButton::menu-indicator { subcontrol-position: right center; right: 0.3em; }"
        )
        self.rows.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.export = _button("Export…", "Save the pairs as SVG, PDF or PNG")
        self._lay_out()
        self._connect()
        self.offer(())

    @property
    def chosen_order(self) -> Order:
        """The order that is chosen."""
        order: Order = self.order.currentData()
        return order

    @property
    def wanted(self) -> Wanted:
        """The further rows that are chosen."""
        stages = tuple(stage for stage in self._stages() if stage[0] in self._wanted)
        coders = tuple(name for name in self.coders if CODER + name in self._wanted)
        return Wanted(stages, coders)

    def offer(self, coders: Collection[str]) -> None:
        """Offer the rows of these coders besides those of the recogniser."""
        self.coders = tuple(coders)
        self.menu.clear()
        self.menu.addSection("Before the filtered prediction")
        for key, caption in self._stages():
            self._add(key, caption)
        if coders:
            self.menu.addSection("Other coders")
        for name in coders:
            self._add(CODER + name, name)

    def _stages(self) -> tuple[tuple[str, str], ...]:
        """Keys and captions of the recogniser's steps."""
        return (
            ("raw", "raw"),
            ("threshold", "threshold"),
            ("median", "median"),
        )

    def _add(self, key: str, title: str) -> None:
        """Add a row to the menu."""
        action = QAction(verbatim(title), self.menu)
        action.setCheckable(True)
        action.setChecked(key in self._wanted)
        action.toggled.connect(lambda on: self._choose(key, on))
        self.menu.addAction(action)

    def _choose(self, key: str, on: bool) -> None:
        """Show a row, or not any more."""
        (self._wanted.add if on else self._wanted.discard)(key)
        settings.put(ROWS, sorted(self._wanted))
        self.changed.emit()

    def _lay_out(self) -> None:
        """All in a line."""
        line = QHBoxLayout(self)
        line.setContentsMargins(int(MARGIN), 6, int(MARGIN), 6)
        line.setSpacing(6)
        line.addWidget(self.search, 1)
        for widget in (self.order, self.stretched, self.rows, self.export):
            line.addWidget(widget)

    def _connect(self) -> None:
        """Tell what is chosen, and remember it."""
        self.search.textChanged.connect(lambda _: self.changed.emit())
        self.order.currentIndexChanged.connect(lambda _: self._remember())
        self.order.currentIndexChanged.connect(lambda _: self.ordered.emit())
        self.stretched.toggled.connect(lambda _: self._remember())
        self.export.clicked.connect(lambda _: self.exporting.emit())

    def _remember(self) -> None:
        """Keep order and time axis for the next time."""
        settings.put(ORDER, self.chosen_order)
        settings.put(STRETCHED, self.stretched.isChecked())
        self.changed.emit()


class LegendStrip(QWidget):
    """The legend above the pairs, with the key of each action.

    Signals
    -------
    fitted()
        It has taken the height of its lines.
    """

    fitted = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._looks: Mapping[str, Look] = {}
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName("Legend of the actions")
        themes().changed.connect(self.update)

    def show_looks(self, looks: Mapping[str, Look]) -> None:
        """Show these actions in this order."""
        self._looks = looks
        self.setAccessibleDescription(
            ", ".join(f"{look.sign.upper()} {name}".lstrip() for name, look in looks.items())
        )
        self._fit()
        self.update()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """A narrow legend has more lines."""
        self._fit()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the legend."""
        with QPainter(self) as painter:
            painter.fillRect(self.rect(), QColor(colours().background))
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            self._legend.paint(painter, MARGIN, 6, colours())

    @property
    def _legend(self) -> Legend:
        """The legend in the width there is."""
        return Legend(self._looks, max(self.width() - 2 * MARGIN, 1.0))

    def _fit(self) -> None:
        """Take the height of the lines."""
        height = round(self._legend.height) + 10
        if height != self.minimumHeight():
            self.setFixedHeight(height)
            self.fitted.emit()


class LegendRoom(QScrollArea):
    """The room of the legend: that of some lines, beyond which it scrolls."""

    #: Pixels: as many lines as leave room for the pairs, and the first line.
    MOST, LEAST = 76, 30

    def __init__(self, legend: LegendStrip) -> None:
        super().__init__()
        self._legend = legend
        self.setWidget(legend)
        self.setWidgetResizable(True)
        self.setFrameShape(QScrollArea.Shape.NoFrame)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Maximum)
        legend.fitted.connect(self.updateGeometry)

    def sizeHint(self) -> QSize:
        """All lines, if they are few."""
        return QSize(160, min(self._legend.height(), self.MOST))

    def minimumSizeHint(self) -> QSize:
        """One line: in a small window the timeline needs the room."""
        return QSize(60, min(self._legend.height(), self.LEAST))


class AxisStrip(QWidget):
    """The time axis below the pairs, which all share."""

    HEIGHT = 38

    def __init__(self) -> None:
        super().__init__()
        self._axis: Axis | None = None
        self.setFixedHeight(self.HEIGHT)
        self.setAccessibleName("Time axis of the pairs")
        themes().changed.connect(self.update)

    def show_axis(self, axis: Axis | None) -> None:
        """Show this axis; none where each pair has one of its own."""
        self._axis = axis
        self.setHidden(axis is None)
        self.update()

    def sizeHint(self) -> QSize:
        """As wide as the rows."""
        return QSize(400, self.HEIGHT)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the axis."""
        with QPainter(self) as painter:
            painter.fillRect(self.rect(), QColor(colours().background))
            text.ready()
            if self._axis is not None:
                painter.setRenderHint(QPainter.RenderHint.Antialiasing)
                draw_bottom(painter, self._axis, 0.5, "time (s)", colours())


def _button(title: str, name: str) -> QToolButton:
    """A button of the tools."""
    button = QToolButton()
    button.setText(title)
    button.setAccessibleName(name)
    button.setToolTip(name)
    button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextOnly)
    button.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
    return button
