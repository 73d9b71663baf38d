"""A line of text that has a shorter version for where there is little room."""

from __future__ import annotations

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

__all__ = ["Elided"]


class Elided(QWidget):
    """Shows the whole text, or the short one, or what fits of that; the tip has the whole."""

    def __init__(self) -> None:
        super().__init__()
        self.text = self.short = ""
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)

    def set_text(self, text: str, short: str = "") -> None:
        """Show another text."""
        short = short or text
        if (text, short) == (self.text, self.short):
            return
        self.text, self.short = text, short
        self.setToolTip(text)
        self.setAccessibleDescription(text)
        self.updateGeometry()
        self.update()

    @property
    def long_width(self) -> int:
        """The pixels that the whole text needs."""
        return self.fontMetrics().horizontalAdvance(self.text) + 4

    @property
    def short_width(self) -> int:
        """The pixels that the short text needs."""
        return self.fontMetrics().horizontalAdvance(self.short) + 4

    def sizeHint(self) -> QSize:
        """The whole text."""
        return QSize(self.long_width, self.fontMetrics().height() + 4)

    def minimumSizeHint(self) -> QSize:
        """The short text, or less."""
        line = self.fontMetrics().height()
        return QSize(min(self.short_width, 4 * line), line + 4)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw what fits."""
        with QPainter(self) as painter:
            painter.setPen(self.palette().color(self.foregroundRole()))
            shown = self.text if self.long_width <= self.width() else self.short
            shown = self.fontMetrics().elidedText(shown, Qt.TextElideMode.ElideRight, self.width())
            painter.drawText(
                self.rect(), Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignLeft, shown
            )
