"""The status bar: what was just done or went wrong, and what runs in another workspace."""

from __future__ import annotations

from PySide6.QtCore import QSize
from PySide6.QtWidgets import QStatusBar, QToolButton

from forcelab.gui import theme
from forcelab.gui.document import Document


class BackgroundIndicator(QToolButton):
    """Seen while another workspace is in front; a click on it is to lead there."""

    def __init__(self) -> None:
        super().__init__()
        self._elsewhere = True
        self.setAutoRaise(True)
        self.hide()

    def sizeHint(self) -> QSize:
        """No higher than a line, so that nothing moves when it comes."""
        return QSize(super().sizeHint().width(), self.fontMetrics().height())

    def minimumSizeHint(self) -> QSize:
        """The same."""
        return self.sizeHint()

    def set_elsewhere(self, elsewhere: bool) -> None:
        """Say whether another workspace than its own is in front."""
        self._elsewhere = elsewhere
        self.refresh()

    def refresh(self) -> None:
        """Say how it stands; hidden where there is nothing to say."""
        words = self.words() if self._elsewhere else ""
        if words != self.text():
            self.setText(words)
            self.setAccessibleName(words)
        if self.isHidden() == bool(words):
            self.setVisible(bool(words))

    def words(self) -> str:
        """What there is to say; empty for nothing."""
        raise NotImplementedError


#: Milliseconds for which a sentence stays; for which one about trouble does.
SHOWN, TROUBLE_SHOWN = 6_000, 15_000


class StatusLine(QStatusBar):
    """Says a sentence for a while, in the colour of what it is about.

    Parameters
    ----------
    document : Document
        Its sentences are said.
    """

    def __init__(self, document: Document) -> None:
        super().__init__()
        self._document, self._trouble, self._said = document, False, ""
        self.messageChanged.connect(self._shown)
        document.message_shown.connect(self.say)
        document.demonstration_changed.connect(self._forget_former)
        theme.themes().changed.connect(self._colour)

    def say(self, sentence: str, trouble: bool = False) -> None:
        """Say a sentence; one about trouble stays longer."""
        self._trouble, self._said = trouble, sentence
        self._colour()
        self.showMessage(sentence, TROUBLE_SHOWN if trouble else SHOWN)

    def _shown(self, sentence: str) -> None:
        """What else is shown here, such as what an entry of a menu does, is no trouble."""
        if sentence and sentence != self._said:
            self._trouble = False
            self._colour()

    def _colour(self) -> None:
        """Write in the theme's colour."""
        colour = theme.colours().trouble if self._trouble else theme.colours().text
        style = f"QStatusBar {{ color: {colour}; }}"
        if self.styleSheet() != style:  # putting one on takes longer than a stroke
            self.setStyleSheet(style)

    def _forget_former(self) -> None:
        """Say of another demonstration no more what was said of the one before."""
        if self.currentMessage() == self._document.local_message:
            self.clearMessage()
