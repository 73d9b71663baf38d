"""Whether the last edit is in the store, and which."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QRectF, QSize, Qt, QTimer
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.icons import paint_icon
from forcelab.gui.label.history import clock
from forcelab.gui.theme import colours, themes

#: The time of the last edit is looked up when nothing was painted for so many ms.
PAUSE = 120


class SavedIndicator(QWidget):
    """Says that all labels are stored; or, in the colour of trouble, that an edit was not.

    An edit that could not be stored is not on screen either, so that what one sees is always
    stored; the trouble stands here until an edit is stored again. Where there is no room for words
    only the sign is shown.
    """

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.document = document
        self.trouble = ""
        self.text = ""
        self._newest = 0  # the number of the last edit that is known to be stored
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)
        self._looking = QTimer(self, singleShot=True, interval=PAUSE)
        self._looking.timeout.connect(self.look)
        document.tracks_changed.connect(self._looking.start)
        document.demonstration_changed.connect(self._looking.start)
        document.store_failed.connect(self.fail)
        themes().changed.connect(self.update)
        self.look()

    def fail(self, sentence: str) -> None:
        """Say that the last edit was not stored, and why."""
        self.trouble = sentence
        self._looking.stop()
        self._show_text("Not stored", sentence)

    def look(self) -> None:
        """Look up when the last edit was made."""
        document = self.document
        if document.project is None or not document.id:
            self._show_text("", "")
            return
        try:
            last = document.project.tracks.history(document.id, document.author, latest=1)
        except ForcelabError as error:
            self.fail(str(error))
            return
        newest = last[0].id if last else 0
        if self.trouble and newest == self._newest:
            return
        self.trouble, self._newest = "", newest
        about = "Every edit is stored before it is shown; there is nothing to save."
        if last:
            self._show_text(f"Stored {clock(last[0].time)}", about)
        else:
            self._show_text("All stored", about)

    def sizeHint(self) -> QSize:
        """Sign and words."""
        height = self.fontMetrics().height() + 6
        words = self.fontMetrics().horizontalAdvance(self.text)
        return QSize(height + words + 6 if self.text else 0, height)

    def minimumSizeHint(self) -> QSize:
        """The sign alone."""
        height = self.fontMetrics().height() + 6
        return QSize(height if self.text else 0, height)

    def changeEvent(self, event: QEvent) -> None:
        """The words need other room in another font."""
        super().changeEvent(event)
        self.updateGeometry()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw sign and words."""
        if not self.text:
            return
        theme = colours()
        with QPainter(self) as painter:
            side = self.fontMetrics().height()
            sign = QRectF(2, (self.height() - side) / 2, side, side)
            ink = QColor(theme.trouble if self.trouble else theme.muted)
            paint_icon(painter, sign, "warning" if self.trouble else "stored", ink)
            room = QRectF(self.rect()).adjusted(side + 6, 0, 0, 0)
            if room.width() >= self.fontMetrics().horizontalAdvance(self.text):
                painter.setPen(ink)
                painter.drawText(room, Qt.AlignmentFlag.AlignVCenter, self.text)

    def _show_text(self, text: str, about: str) -> None:
        """Show a text and more about it."""
        before = self.sizeHint()
        self.text = text
        self.setToolTip(about)
        self.setAccessibleName(f"{text}. {about}" if about else text)
        if self.sizeHint() != before:  # each stroke says a time: the window is not laid out anew
            self.updateGeometry()
        self.update()
