"""The widgets of the dialog that synchronises video and force; what they do is told elsewhere."""

from __future__ import annotations

from typing import TypeVar

from PySide6.QtCore import QSize, Qt
from PySide6.QtWidgets import (
    QCheckBox,
    QDialog,
    QDialogButtonBox,
    QDoubleSpinBox,
    QGridLayout,
    QGroupBox,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QPushButton,
    QTableWidget,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui.arranging import whole_rows
from forcelab.gui.document import Document
from forcelab.gui.label.alignment import AlignmentPlot
from forcelab.gui.label.preview import VideoPreview
from forcelab.gui.theme import colours

__all__ = ["SynchroniseForm"]

ButtonT = TypeVar("ButtonT", QPushButton, QCheckBox)


class SynchroniseForm(QDialog):
    """The video left, marks and clock right, the curves below."""

    def __init__(self, document: Document, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.document = document
        self.preview = VideoPreview()
        self.plot = AlignmentPlot(document)
        left = QVBoxLayout()
        left.addWidget(self.preview, 1)
        left.addLayout(self._force_row())
        right = QVBoxLayout()
        right.addWidget(self._taps_box(), 1)
        right.addWidget(self._clock_box())
        top = QHBoxLayout()
        top.addLayout(left, 3)
        top.addLayout(right, 2)
        column = QVBoxLayout(self)
        column.addLayout(top, 1)
        column.addWidget(self.plot)
        column.addLayout(self._button_row())

    def sizeHint(self) -> QSize:
        """Large enough to see a fingertip."""
        line = self.fontMetrics().height()
        return QSize(60 * line, 42 * line).expandedTo(super().sizeHint())

    def _force_row(self) -> QHBoxLayout:
        """The cursor as a number."""
        self.force_time = QDoubleSpinBox()
        self.force_time.setDecimals(3)
        self.force_time.setSuffix(" s")
        self.force_time.setRange(*self.document.bounds)
        self.force_time.setSingleStep(0.001)
        self.force_time.setKeyboardTracking(False)
        self.force_time.setAccessibleName("Cursor on the force clock")
        self.force_time.valueChanged.connect(self.document.seek)
        self.snap = _named(QCheckBox("&Snap to contact events"))
        self.snap.setChecked(True)
        label = QLabel("F&orce time")
        label.setBuddy(self.force_time)
        row = QHBoxLayout()
        for widget in (label, self.force_time, self.snap):
            row.addWidget(widget)
        row.addStretch(1)
        return row

    def _taps_box(self) -> QGroupBox:
        """What was marked, with its buttons."""
        self.frame_button = _named(QPushButton("Mark this &frame"))
        self.force_button = _named(QPushButton("&Mark this force"))
        self.remove_button = _named(QPushButton("&Remove"))
        self.fit_rate = _named(QCheckBox("Fit the rate too, from &two taps on"))
        self.fit_rate.setChecked(True)
        self.table = QTableWidget(0, 3)
        self.table.setAccessibleName("Taps")
        self.table.setHorizontalHeaderLabels(["video, s", "force, s", "apart, ms"])
        header = self.table.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        header.setDefaultAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        whole_rows(self.table)
        self.table.setMinimumHeight(round(5.4 * self.fontMetrics().height()))
        box = QGroupBox("Taps seen in both")
        grid = QGridLayout(box)
        grid.addWidget(self.frame_button, 0, 0)
        grid.addWidget(self.force_button, 0, 1)
        grid.addWidget(self.remove_button, 0, 2)
        grid.addWidget(self.table, 1, 0, 1, 3)
        grid.addWidget(self.fit_rate, 2, 0, 1, 3)
        return box

    def _clock_box(self) -> QGroupBox:
        """The clock that is stored, the new one, and how good that is."""
        box = QGroupBox("Clock of the video")
        grid = QGridLayout(box)
        grid.setColumnStretch(1, 1)
        self.stored_label, self.new_label = QLabel(), QLabel()
        self.residual_label, self.confidence_label = QLabel(), QLabel()
        named = (
            ("stored", self.stored_label, 1),
            ("new", self.new_label, 1),
            ("taps are off by", self.residual_label, 2),
            ("confidence", self.confidence_label, 2),
        )
        for row, (name, value, lines) in enumerate(named):
            value.setWordWrap(True)
            value.setAlignment(Qt.AlignmentFlag.AlignTop)
            # Room for the longest sentence, so that nothing jumps.
            value.setMinimumHeight(lines * self.fontMetrics().lineSpacing())
            value.setAccessibleName(name)
            grid.addWidget(QLabel(name), row, 0, Qt.AlignmentFlag.AlignTop)
            grid.addWidget(value, row, 1)
        return box

    def _button_row(self) -> QHBoxLayout:
        """What is done with all of it."""
        self.propose_button = _named(QPushButton("&Propose"))
        self.reset_button = _named(QPushButton("R&eset"))
        self.trouble = QLabel()
        self.trouble.setWordWrap(True)
        self.trouble.setStyleSheet(f"color: {colours().trouble}")
        self.accept_button = _named(QPushButton("&Accept"))
        self.cancel_button = _named(QPushButton("Cancel"))
        buttons = QDialogButtonBox()
        buttons.addButton(self.accept_button, QDialogButtonBox.ButtonRole.AcceptRole)
        buttons.addButton(self.cancel_button, QDialogButtonBox.ButtonRole.RejectRole)
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        row = QHBoxLayout()
        row.addWidget(self.propose_button)
        row.addWidget(self.reset_button)
        row.addWidget(self.trouble, 1)
        row.addWidget(buttons)
        return row


def _named(button: ButtonT) -> ButtonT:
    """A button that screen readers name as it is labelled; Enter presses only the one in focus."""
    button.setAccessibleName(button.text().replace("&", ""))
    if isinstance(button, QPushButton):
        button.setAutoDefault(False)
    return button
