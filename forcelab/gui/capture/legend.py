"""Which keys mark which actions, and how."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QLabel, QWidget

from forcelab.gui.capture.session import Session
from forcelab.gui.figures.text import NAMES
from forcelab.gui.shortcuts import keys

__all__ = ["MarkLegend"]


class MarkLegend(QLabel):
    """A sentence and the keys; hidden where the task has no actions with keys.

    Parameters
    ----------
    session : Session
    parent : QWidget, optional
    """

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setWordWrap(True)
        session.changed.connect(self._tell)
        keys().changed.connect(self._tell)
        self._tell()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Long names have other room."""
        super().resizeEvent(event)
        self._tell()

    def _tell(self) -> None:
        """Write the keys of the actions that there are now."""
        # A key stays with its action where the line is broken.
        space, room = "\N{NO-BREAK SPACE}", self.contentsRect().width()
        marking = [f"{a.key.upper()}{space}{a.name}" for a in self._session.vocabulary if a.key]
        self.setToolTip("\n".join(marking))
        shown = [self.fontMetrics().elidedText(f"{one}{space}·", NAMES, room) for one in marking]
        how = ["hold a key, or tap to begin and tap to end"]
        if forgets := keys().shown("cancel"):
            how.append(f"{forgets} forgets it")
        told = "Mark: {}. {}".format("; ".join(how), " ".join(shown).rstrip(f"{space}·"))
        self.setText(told if marking else "")
        self.setVisible(bool(marking))
