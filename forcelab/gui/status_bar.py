"""The status bar: messages, and what runs in other workspaces."""

from __future__ import annotations

from PySide6.QtCore import QSize
from PySide6.QtWidgets import QStatusBar, QToolButton

from forcelab.gui import theme
from forcelab.gui.document import Document
from forcelab.gui.widgets import show_text


class BackgroundIndicator(QToolButton):
    """Says what runs in a workspace while another one is in front; a click leads there."""

    def __init__(self) -> None:
        super().__init__()
        self._elsewhere = True
        self.setAutoRaise(True)
        self.hide()

    def sizeHint(self) -> QSize:
        """No higher than a line, so that nothing moves when it appears."""
        return QSize(super().sizeHint().width(), self.fontMetrics().height())

    def minimumSizeHint(self) -> QSize:
        return self.sizeHint()

    def set_elsewhere(self, elsewhere: bool) -> None:
        """Set whether another workspace than its own is in front."""
        self._elsewhere = elsewhere
        self.refresh()

    def refresh(self) -> None:
        """Show the text; hidden if it is empty."""
        show_text(self, self.words() if self._elsewhere else "")

    def words(self) -> str:
        """The text; empty for nothing."""
        raise NotImplementedError


#: Milliseconds for which a sentence stays; for which one about trouble does.
SHOWN, TROUBLE_SHOWN = 6_000, 15_000


class StatusLine(QStatusBar):
    """Shows the document's messages for a while, errors in the theme's colour for trouble."""

    def __init__(self, document: Document) -> None:
        super().__init__()
        self._document, self._trouble, self._message = document, False, ""
        self.messageChanged.connect(self._shown)
        document.message_shown.connect(self.say)
        document.demonstration_changed.connect(self._forget_former)
        theme.themes().changed.connect(self._colour)

    def say(self, sentence: str, trouble: bool = False) -> None:
        """Show a message; an error stays longer."""
        self._trouble, self._message = trouble, sentence
        self._colour()
        self.showMessage(sentence, TROUBLE_SHOWN if trouble else SHOWN)

    def _shown(self, sentence: str) -> None:
        """Use the normal colour for what else is shown here, such as a menu entry's status tip."""
        if sentence and sentence != self._message:
            self._trouble = False
            self._colour()

    def _colour(self) -> None:
        """Use the theme's colour."""
        colour = theme.colours().trouble if self._trouble else theme.colours().text
        style = f"QStatusBar {{ color: {colour}; }}"
        if self.styleSheet() != style:  # putting one on takes longer than a stroke
            self.setStyleSheet(style)

    def _forget_former(self) -> None:
        """Clear a message that was about the demonstration before."""
        if self.currentMessage() == self._document.local_message:
            self.clearMessage()
