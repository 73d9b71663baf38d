"""How long it has been recorded, large."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel

from forcelab.gui.arranging import stress
from forcelab.gui.capture.calm_label import show_text
from forcelab.gui.capture.elsewhere import DOT
from forcelab.gui.capture.phase import Phase
from forcelab.gui.capture.session import Session
from forcelab.gui.theme import colours, themes

__all__ = ["RecordedTime"]


class RecordedTime(QLabel):
    """The time of the recording that runs, or that one may begin; hidden at other times.

    Parameters
    ----------
    session : Session
    """

    def __init__(self, session: Session) -> None:
        super().__init__()
        self._session = session
        stress(self, 1.5)
        self.setAlignment(Qt.AlignmentFlag.AlignCenter)
        session.changed.connect(self._changed)
        session.ticked.connect(self._tell)
        themes().changed.connect(self._changed)
        self._changed()

    def _changed(self) -> None:
        """It runs, or does not any more."""
        colour = colours().trouble if self._session.recording else colours().text
        self.setStyleSheet(f"QLabel {{ color: {colour}; }}")
        self._tell()

    def _tell(self) -> None:
        state, phase = self._session.state, self._session.phase
        text = ""
        if phase is Phase.RECORDING and state is not None:
            minutes, seconds = divmod(state.seconds, 60)
            text = f"{DOT} {int(minutes)}:{seconds:04.1f}"
        elif phase is Phase.READY:
            text = "No device" if self._session.obstacle else "Ready"
        show_text(self, text)
