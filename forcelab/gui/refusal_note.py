"""Why something is not done, shown beside the place where it was tried."""

from __future__ import annotations

from PySide6.QtCore import QRect, Qt, QTimer
from PySide6.QtWidgets import (
    QAbstractItemView,
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QFrame,
    QLabel,
    QLineEdit,
    QWidget,
)

from forcelab.gui.document import Document
from forcelab.gui.label.tracks import TrackPanel

#: Milliseconds for which a note stays; its width at most and its distance from the place, pixels.
SHOWN, WIDEST, GAP = 8_000, 340, 4
#: What is edited in one spot; of a list it is the current row.
_FIELDS = (QLineEdit, QAbstractSpinBox, QComboBox)


class RefusalNote(QLabel):
    """A note over the window, below the current row of a list, a field, or the coder's track.

    It goes by itself, with the next message, and when the coder goes on: moves the cursor, edits or
    opens something. The mouse does not see it.
    """

    def __init__(self, document: Document, tracks: TrackPanel, window: QWidget) -> None:
        super().__init__(window, wordWrap=True, textFormat=Qt.TextFormat.PlainText)
        self._window, self._tracks, self._view = window, tracks, document.view
        self.setObjectName("refusal")  # by which the theme's style sheet finds it
        self.setProperty("tone", "trouble")
        self.setFrameShape(QFrame.Shape.Box)
        self.setMargin(4)
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.hide()
        self._is_new = False  # nothing was done since it was shown
        self._timer = QTimer(self, singleShot=True, interval=SHOWN)
        self._timer.timeout.connect(self.hide)
        for signal in (
            document.message_shown,
            document.demonstration_changed,
            document.tracks_changed,
            document.vocabulary_changed,
            document.selection_changed,
            document.stroke_changed,
        ):
            signal.connect(self._go_on)
        document.view.cursor_moved.connect(self._cursor_moved)
        document.refusal_shown.connect(self.show_at_place)

    def show_at_place(self, text: str, on_track: bool) -> None:
        """Show a sentence where something was tried, if that can be seen."""
        place = None if on_track else self._place_of_focus()
        if place is None and self._tracks.isVisible():
            place = self._in_window(self._tracks, self._tracks.place_of_edit())
        if place is None or QApplication.activeModalWidget() is not None:
            return
        self.setText(text)
        room = self._window.rect()
        wanted = self.fontMetrics().horizontalAdvance(text) + 2 * (self.margin() + 4)
        width = min(wanted, WIDEST, room.width())
        height = self.heightForWidth(width)
        top = place.bottom() + GAP
        if top + height > room.bottom():
            top = place.top() - GAP - height
        left = min(max(place.left(), room.left()), room.right() + 1 - width)
        self.setGeometry(left, top, width, height)
        self.show()
        self.raise_()
        self._timer.start()
        self._is_new = True
        QTimer.singleShot(0, self, self._age)

    def _place_of_focus(self) -> QRect | None:
        """The current row or the field that has the keyboard; None where neither has it."""
        focus = QApplication.focusWidget()
        if focus is None or not self._window.isAncestorOf(focus):
            return None
        if isinstance(focus, QAbstractItemView):
            row = focus.visualRect(focus.currentIndex()) & focus.viewport().rect()
            return self._in_window(focus.viewport(), row) if not row.isEmpty() else None
        return self._in_window(focus, focus.rect()) if isinstance(focus, _FIELDS) else None

    def _in_window(self, widget: QWidget, box: QRect) -> QRect:
        return QRect(widget.mapTo(self._window, box.topLeft()), box.size())

    def _age(self) -> None:
        self._is_new = False

    def _go_on(self) -> None:
        """Go, unless it is what was refused that is being put back."""
        if not self._is_new:
            self.hide()

    def _cursor_moved(self) -> None:
        """Playback moves it, too, while the coder reads."""
        if not self._view.playing:
            self._go_on()
