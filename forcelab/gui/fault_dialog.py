"""What the coder sees of an unexpected error."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtGui import QFontDatabase, QGuiApplication
from PySide6.QtWidgets import (
    QDialog,
    QHBoxLayout,
    QLabel,
    QPlainTextEdit,
    QPushButton,
    QSizePolicy,
    QStyle,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui.arranging import copyable, stress

__all__ = ["FaultDialog"]


class FaultDialog(QDialog):
    """Says that the labels are safe, where the log lies, and what can be sent on.

    It stops nobody from working on: it is not modal.

    Parameters
    ----------
    details : str
        For whoever mends it; can be copied.
    log_file : Path
        Where more is written.
    """

    def __init__(self, details: str, log_file: Path, parent: QWidget) -> None:
        super().__init__(parent)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.setWindowTitle("Something went wrong")
        self._details = details
        self._further = 0
        layout = QVBoxLayout(self)
        layout.setSpacing(14)
        layout.addLayout(self._words(log_file))
        self._text = self._folded(details)
        layout.addWidget(self._text, 1)
        layout.addLayout(self._buttons())

    def _words(self, log_file: Path) -> QHBoxLayout:
        """What is said, beside a sign."""
        headline = _wrapped("Something went wrong.")
        stress(headline, 1.2)
        lines = (
            "Your labels are safe: every stroke was stored when it was made.",
            "You can go on working. If it happens again, start forcelab anew.",
            f"What happened is written down in {log_file}",
        )
        self._more = _wrapped("")
        self._more.hide()
        words = QVBoxLayout()
        for line in (headline, *map(_wrapped, lines), self._more):
            words.addWidget(line)
        sign = QLabel()
        size = self.style().pixelMetric(QStyle.PixelMetric.PM_LargeIconSize)
        icon = self.style().standardIcon(QStyle.StandardPixmap.SP_MessageBoxWarning)
        sign.setPixmap(icon.pixmap(size, size))
        sign.setAlignment(Qt.AlignmentFlag.AlignTop)
        top = QHBoxLayout()
        top.setSpacing(16)
        top.addWidget(sign)
        top.addLayout(words, 1)
        return top

    def _folded(self, details: str) -> QPlainTextEdit:
        """The details, folded away."""
        text = QPlainTextEdit(details)
        text.setReadOnly(True)
        text.setFont(QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont))
        text.setLineWrapMode(QPlainTextEdit.LineWrapMode.NoWrap)
        text.setAccessibleName("Details")
        text.setTabChangesFocus(True)
        metrics = self.fontMetrics()
        text.setMinimumSize(metrics.averageCharWidth() * 80, metrics.lineSpacing() * 12)
        text.hide()
        return text

    def _buttons(self) -> QHBoxLayout:
        """Unfold, copy, close."""
        buttons = QHBoxLayout()
        self._show = QPushButton("Show details", self)
        self._show.setCheckable(True)
        self._show.toggled.connect(self._show_details)
        self._copy = QPushButton("Copy details", self)
        self._copy.clicked.connect(self._copy_details)
        close = QPushButton("Close")
        close.setDefault(True)
        close.clicked.connect(self.accept)
        buttons.addWidget(self._show)
        buttons.addWidget(self._copy)
        buttons.addStretch(1)
        buttons.addWidget(close)
        for button in (self._show, self._copy, close):
            button.setAccessibleName(button.text())
        close.setFocus()
        return buttons

    def add(self) -> None:
        """Say that something else went wrong while this is open."""
        self._further += 1
        self._more.setText(
            f"Further errors since then, written down in the same file: {self._further}"
        )
        self._more.show()

    def _show_details(self, shown: bool) -> None:
        """Unfold what is meant for whoever mends it."""
        self._text.setVisible(shown)
        self._show.setText("Hide details" if shown else "Show details")
        self.adjustSize()

    def _copy_details(self) -> None:
        """Copy the details, and say that it was done."""
        QGuiApplication.clipboard().setText(self._details)
        self._copy.setText("Copied")


def _wrapped(text: str) -> QLabel:
    """A paragraph that can be copied, by keys too."""
    label = copyable(text)
    label.setMinimumWidth(label.fontMetrics().averageCharWidth() * 56)
    label.setTextInteractionFlags(
        Qt.TextInteractionFlag.TextSelectableByMouse
        | Qt.TextInteractionFlag.TextSelectableByKeyboard
    )
    label.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Minimum)
    return label
