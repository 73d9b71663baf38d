"""Combo boxes for what a view shows: prediction stage, unit and share."""

from __future__ import annotations

from typing import cast

from PySide6.QtCore import QSize, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QBoxLayout, QComboBox, QHBoxLayout, QPushButton, QWidget

from forcelab.review.confusion import Share, Unit


class DisplayOptions(QWidget):
    """Three lists to choose from, and what can be done with the matrix."""

    #: Another prediction is asked for, which is to be counted.
    stage_changed = Signal()
    #: The same is to be shown otherwise.
    changed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.stage_box = stage_combo_box()
        self.unit_box = combo_box(
            "What is counted",
            {"Time": "time", "Segments": "segments"},
            (
                "Seconds, or the coder's segments: each counts for what covers most of it in the "
                "prediction"
            ),
        )
        self.share_box = combo_box(
            "Share",
            {
                "By row": "row",
                "By column": "column",
                "Counts": "counts",
            },
            (
                "Per cent of what the coder labelled (row), of what was predicted (column), or "
                "the counts alone"
            ),
        )
        self.copy = QPushButton("Copy")
        self.copy.setToolTip("Copy the matrix as text for a spreadsheet")
        self.save = QPushButton("Save…")
        self.save.setToolTip("Save the matrix as SVG, PDF or PNG")
        self._rows = QBoxLayout(QBoxLayout.Direction.LeftToRight, self)
        self._rows.setContentsMargins(6, 6, 6, 2)
        self._rows.setSpacing(4)
        self._parts = (
            _widget_row(self.stage_box, self.unit_box, self.share_box),
            _widget_row(self.copy, self.save),
        )
        self._rows.addLayout(self._parts[0])
        self._rows.addStretch(1)
        self._rows.addLayout(self._parts[1])
        self.stage_box.currentIndexChanged.connect(lambda _: self.stage_changed.emit())
        for box in (self.unit_box, self.share_box):
            box.currentIndexChanged.connect(lambda _: self.changed.emit())

    def minimumSizeHint(self) -> QSize:
        """As narrow as the lists: what is done with the matrix then stands below them."""
        margins = self._rows.contentsMargins()
        widest = max(part.minimumSize().width() for part in self._parts)
        least = widest + margins.left() + margins.right()
        return QSize(least, super().minimumSizeHint().height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Begin a second row where the first would cut its words off."""
        super().resizeEvent(event)
        margins, way = self._rows.contentsMargins(), QBoxLayout.Direction
        wanted = sum(part.sizeHint().width() for part in self._parts) + self._rows.spacing()
        narrow = self.width() < wanted + margins.left() + margins.right()
        self._rows.setDirection(way.TopToBottom if narrow else way.LeftToRight)

    @property
    def stage(self) -> str:
        """Of the predictions: ``"filtered"`` or ``"raw"``."""
        return str(self.stage_box.currentData())

    @property
    def unit(self) -> Unit:
        """What is counted."""
        return cast(Unit, self.unit_box.currentData())

    @property
    def share(self) -> Share:
        """What is shown of it."""
        return cast(Share, self.share_box.currentData())


def _widget_row(*widgets: QWidget) -> QHBoxLayout:
    """Widgets beside each other."""
    row = QHBoxLayout()
    row.setSpacing(4)
    for widget in widgets:
        row.addWidget(widget)
    return row


def stage_combo_box() -> QComboBox:
    """Which prediction is meant: ``"filtered"`` or ``"raw"``."""
    return combo_box(
        "Prediction",
        {"Filtered": "filtered", "Raw": "raw"},
        "Predictions after the filters, or as the classifier gave them",
    )


def combo_box(name: str, items: dict[str, str], tip: str = "") -> QComboBox:
    """A list to choose from; each item knows what it stands for."""
    box = QComboBox()
    box.setAccessibleName(name)
    box.setToolTip(tip)
    for text, value in items.items():
        box.addItem(text, value)
    return box
