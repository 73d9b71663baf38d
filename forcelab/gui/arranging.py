"""Parts that several pages are arranged with."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QPalette
from PySide6.QtWidgets import (
    QAbstractItemView,
    QFrame,
    QHeaderView,
    QLabel,
    QScrollArea,
    QTableView,
    QWidget,
)

__all__ = ["placeholder", "rule", "scrolled", "whole_rows"]

#: Height of a table's row, in heights of its letters.
ROW = 1.6
#: Free room around a placeholder, in pixels.
AROUND = 16


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

    Parameters
    ----------
    table : QTableView
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
