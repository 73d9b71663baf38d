"""The transport's lines: a time to type over, a number that runs, a text that is cut."""

from __future__ import annotations

import math

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QKeyEvent, QPainter, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import QLabel, QLineEdit, QSizePolicy, QWidget

from forcelab.gui.document import Document

__all__ = ["FrameCounter", "Readout", "TimeEdit"]


class TimeEdit(QLineEdit):
    """The cursor's time, which can be typed over to jump."""

    def __init__(self, document: Document) -> None:
        super().__init__()
        self._document = document
        self.setAccessibleName("Time in seconds; type one to jump there")
        self.setToolTip("Time of the cursor; type another one to jump there")
        self.setAlignment(Qt.AlignmentFlag.AlignRight)
        self.setFixedWidth(self.fontMetrics().horizontalAdvance("00000.000") + 16)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.returnPressed.connect(self._jump)
        self.editingFinished.connect(self._leave)

    def show_cursor(self) -> None:
        """Show where the cursor is, unless a time is being typed."""
        if not self.isModified():
            self.setText(f"{self._document.view.cursor:.3f}")

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Escape leaves everything as it was."""
        if event.key() == Qt.Key.Key_Escape:
            self.clearFocus()
        else:
            super().keyPressEvent(event)

    def _jump(self) -> None:
        """Move the cursor to the time that was typed."""
        typed = self.text().strip()
        try:
            self._document.view.seek(_seconds(typed))
        except ValueError:
            self._document.show_message(
                f"'{typed}' is no time; type seconds such as 12.5, or 1:05.2.", True
            )
        self.clearFocus()

    def _leave(self) -> None:
        """Show the cursor's time again."""
        self.setModified(False)
        self.show_cursor()


class FrameCounter(QWidget):
    """A line that changes with every frame: it is drawn anew, and nothing around it.

    A label asks for another layout of its window each time, which takes longer than all panels.
    """

    def __init__(self) -> None:
        super().__init__()
        self._text, self._wide = "", 0
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Preferred)

    def text(self) -> str:
        """What is shown."""
        return self._text

    def say(self, text: str, widest: str = "") -> None:
        """Show a text in the width of another one, so that nothing moves."""
        wide = self.fontMetrics().horizontalAdvance(widest) + 2 if widest else 0
        if wide != self._wide:
            self._wide = wide
            self.updateGeometry()
        if text != self._text:
            self._text = text
            self.setAccessibleName(text)
            self.update()

    def sizeHint(self) -> QSize:
        """One line."""
        return QSize(self._wide, self.fontMetrics().height())

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the text."""
        with QPainter(self) as painter:
            painter.setPen(self.palette().color(self.foregroundRole()))
            middle = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
            painter.drawText(self.rect(), middle, self._text)


class Readout(QLabel):
    """A line that is cut where there is no room for it, and takes none by itself."""

    def __init__(self) -> None:
        super().__init__()
        self._text = ""
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)

    def say(self, text: str) -> None:
        """Show a text."""
        self._text = text
        self.setToolTip(text)
        self._cut()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Show what there is room for."""
        super().resizeEvent(event)
        self._cut()

    def _cut(self) -> None:
        """Show what there is room for."""
        end = Qt.TextElideMode.ElideRight
        self.setText(self.fontMetrics().elidedText(self._text, end, self.width()))


def _seconds(typed: str) -> float:
    """Seconds from ``12.5``, ``12.5 s``, ``1:05.2`` or ``1:00:05``."""
    total = 0.0
    for part in typed.removesuffix("s").split(":"):
        total = total * 60 + float(part)
    if not math.isfinite(total):
        raise ValueError(typed)
    return total
