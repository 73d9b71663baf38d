"""Parts that several pages are arranged with."""

from __future__ import annotations

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QPalette
from PySide6.QtWidgets import (
    QAbstractItemView,
    QFrame,
    QHeaderView,
    QLabel,
    QLineEdit,
    QScrollArea,
    QTableView,
    QWidget,
)

__all__ = [
    "muted",
    "placeholder",
    "resize_on_screen",
    "rule",
    "scrolled",
    "search_field",
    "whole_rows",
]

#: Height of a table's row, in heights of its letters.
ROW = 1.6
#: Free room around a placeholder, in pixels.
AROUND = 16
#: What a window's frame adds to its width and height at most, in pixels.
FRAME = QSize(16, 44)


def scrolled(page: QWidget) -> QScrollArea:
    """A page that can be scrolled up and down where there is too little room.

    Parameters
    ----------
    page : QWidget
        Wraps its texts: it is as wide as the room.
    """
    area = QScrollArea()
    area.setWidgetResizable(True)
    area.setFrameShape(QFrame.Shape.NoFrame)
    area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    area.setWidget(page)
    return area


def placeholder(text: str = "") -> QLabel:
    """What stands, faint and in the middle, where there is nothing to show yet.

    Parameters
    ----------
    text : str
        Plain: names in it are anybody's.
    """
    label = QLabel(text)
    label.setTextFormat(Qt.TextFormat.PlainText)
    label.setWordWrap(True)
    label.setMargin(AROUND)
    label.setAlignment(Qt.AlignmentFlag.AlignCenter)
    label.setForegroundRole(QPalette.ColorRole.PlaceholderText)
    return label


def muted(text: str = "") -> QLabel:
    """A sentence that is said in passing, on as many lines as it needs."""
    label = QLabel(text)
    label.setWordWrap(True)
    label.setForegroundRole(QPalette.ColorRole.PlaceholderText)
    return label


def resize_on_screen(window: QWidget, size: QSize) -> None:
    """Give a window a size, or as much of it as its screen has room for, frame and all.

    Parameters
    ----------
    window : QWidget
    size : QSize
        In pixels, without the frame.
    """
    window.resize(size.boundedTo(window.screen().availableGeometry().size() - FRAME))


def search_field(placeholder: str, name: str) -> QLineEdit:
    """A line to type into that can be emptied by a click; `name` is for screen readers."""
    field = QLineEdit(placeholderText=placeholder, clearButtonEnabled=True)
    field.setAccessibleName(name)
    return field


def rule() -> QFrame:
    """A line between two groups."""
    line = QFrame()
    line.setFrameShape(QFrame.Shape.HLine)
    line.setFrameShadow(QFrame.Shadow.Plain)
    line.setForegroundRole(QPalette.ColorRole.Mid)
    return line


def whole_rows(table: QTableView) -> None:
    """Let a table be one of whole rows that are chosen one at a time, and read.

    It scrolls smoothly, draws no grid, and leaves the Tab key to the window.
    """
    modes = QAbstractItemView.ScrollMode
    table.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
    table.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
    table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
    table.setVerticalScrollMode(modes.ScrollPerPixel)
    table.setHorizontalScrollMode(modes.ScrollPerPixel)
    table.setShowGrid(False)
    table.setWordWrap(False)
    table.setTabKeyNavigation(False)
    rows = table.verticalHeader()
    rows.hide()
    rows.setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
    rows.setDefaultSectionSize(round(ROW * table.fontMetrics().height()))
    table.horizontalHeader().setHighlightSections(False)
