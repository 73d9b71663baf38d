"""The elapsed time of a recording, and the sign of it in other workspaces."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QMessageBox, QWidget

from forcelab.gui.capture.controller import CaptureController, CaptureState
from forcelab.gui.layout import emphasise
from forcelab.gui.status_bar import BackgroundIndicator
from forcelab.gui.theme import colours, themes
from forcelab.gui.widgets import show_text

#: What stands before whatever is recorded.
RECORD_DOT = "\N{BLACK CIRCLE}"


class RecordingIndicator(BackgroundIndicator):
    """A line in the status bar; a click on it leads to what is being recorded.

    Seen while another workspace is in front.
    """

    def __init__(self) -> None:
        super().__init__()
        self._name, self._seconds, self._stuck = "", 0.0, False
        self.setToolTip("Show what is being recorded")
        themes().changed.connect(self._colour)
        self._colour()

    def tell(self, name: str, seconds: float, *, stuck: bool = False) -> None:
        """Say what is recorded, and for how long it has been; empty for nothing.

        Parameters
        ----------
        name : str
        seconds : float
        stuck : bool
            Whether it has ended and could not be kept.
        """
        self._name, self._seconds, self._stuck = name, seconds, stuck
        self.refresh()

    def words(self) -> str:
        """What is recorded, and for how long it has been; empty while nothing is."""
        if not self._name:
            return ""
        if self._stuck:
            return f"{RECORD_DOT} '{self._name}' is not kept yet"
        minutes, seconds = divmod(int(self._seconds), 60)
        return "{dot} Recording '{name}'  {time}".format(
            dot=RECORD_DOT, name=self._name, time=f"{minutes}:{seconds:02d}"
        )

    def _colour(self) -> None:
        self.setStyleSheet(f"padding: 0 0.5em; color: {colours().trouble};")


def confirm_leaving(
    name: str, parent: QWidget, *, stuck: bool = False, in_memory: str = ""
) -> bool:
    """Ask whether the window is to be closed although something is being recorded.

    Parameters
    ----------
    name : str
        Of the recording.
    parent : QWidget
        Over which the question stands.
    stuck : bool
        Whether it has ended and could not be kept.
    in_memory : str
        How much of it the disk refuses, such as ``"12 kB"``; empty where it takes all.
    """
    box = QMessageBox(parent)
    box.setIcon(QMessageBox.Icon.Question)
    box.setWindowTitle("Recording")
    unsure = stuck or bool(in_memory)
    said = "'{0}' is being recorded."
    goes_on = "Go on recording"
    if stuck:
        said = "'{0}' was recorded and could not be kept."
        goes_on = "Stay"
    box.setText(said.format(name))
    box.setInformativeText(_consequence(unsure, in_memory))
    closes = "Keep it and close"
    if unsure:
        closes = "Try to keep it and close"
    stay = box.addButton(goes_on, QMessageBox.ButtonRole.RejectRole)
    leave = box.addButton(closes, QMessageBox.ButtonRole.AcceptRole)
    box.setDefaultButton(stay if unsure else leave)
    box.setEscapeButton(stay)
    box.exec()
    box.deleteLater()
    return box.clickedButton() is leave


def _consequence(unsure: bool, in_memory: str) -> str:
    """What becomes of a recording if the window is closed."""
    if not unsure:
        return "If the window is closed, the recording ends and is kept."
    told = (
        "If the window is closed, it is tried to keep the recording. If that fails, what is on "
        "the disk is offered the next time."
    )
    if in_memory:
        told += (
            f" {in_memory} that the disk refuses are in memory: all of it is written "
            "elsewhere then, "
            "and you are told where."
        )
    return told


class ElapsedTime(QLabel):
    """The time of the recording that runs, or that one may begin; hidden at other times.

    Parameters
    ----------
    session : Session
    """

    def __init__(self, session: CaptureController) -> None:
        super().__init__()
        self._session = session
        emphasise(self, 1.5)
        self.setAlignment(Qt.AlignmentFlag.AlignCenter)
        session.changed.connect(self._changed)
        session.ticked.connect(self._update_text)
        themes().changed.connect(self._changed)
        self._changed()

    def _changed(self) -> None:
        """It runs, or does not any more."""
        colour = colours().trouble if self._session.recording else colours().text
        self.setStyleSheet(f"QLabel {{ color: {colour}; }}")
        self._update_text()

    def _update_text(self) -> None:
        state, phase = self._session.state, self._session.phase
        text = ""
        if phase is CaptureState.RECORDING and state is not None:
            minutes, seconds = divmod(state.seconds, 60)
            text = f"{RECORD_DOT} {int(minutes)}:{seconds:04.1f}"
        elif phase is CaptureState.READY:
            text = "No device" if self._session.obstacle else "Ready"
        show_text(self, text)
