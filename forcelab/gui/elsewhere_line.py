"""A line in the status bar for what goes on in a workspace that is not in front."""

from __future__ import annotations

from PySide6.QtCore import QSize
from PySide6.QtWidgets import QToolButton

__all__ = ["ElsewhereLine"]


class ElsewhereLine(QToolButton):
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
