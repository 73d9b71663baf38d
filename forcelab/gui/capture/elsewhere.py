"""That something is being recorded, said wherever one is in the window, and before it is left."""

from __future__ import annotations

from PySide6.QtCore import QCoreApplication
from PySide6.QtWidgets import QMessageBox, QWidget

from forcelab.gui.elsewhere_line import ElsewhereLine
from forcelab.gui.theme import colours, themes

__all__ = ["DOT", "RecordingLine", "asks_to_leave", "length"]

#: What stands before whatever is recorded.
DOT = "\N{BLACK CIRCLE}"


class RecordingLine(ElsewhereLine):
    """A line in the status bar; a click on it leads to what is being recorded.

    Seen while another workspace is in front.

    Parameters
    ----------
    parent : QWidget, optional
    """

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._name, self._seconds = "", 0.0
        self.setToolTip(self.tr("Show what is being recorded"))
        themes().changed.connect(self._colour)
        self._colour()

    def tell(self, name: str, seconds: float) -> None:
        """Say what is recorded, and for how long it has been; empty for nothing."""
        self._name, self._seconds = name, seconds
        self.refresh()

    def words(self) -> str:
        """What is recorded, and for how long it has been; empty while nothing is."""
        if not self._name:
            return ""
        return self.tr("{dot} Recording '{name}'  {time}").format(
            dot=DOT, name=self._name, time=length(self._seconds)
        )

    def _colour(self) -> None:
        self.setStyleSheet(f"padding: 0 0.5em; color: {colours().trouble};")


def length(seconds: float) -> str:
    """Minutes and whole seconds."""
    minutes, rest = divmod(int(seconds), 60)
    return f"{minutes}:{rest:02d}"


def asks_to_leave(name: str, parent: QWidget) -> bool:
    """Ask whether the window is to be closed although something is being recorded.

    Parameters
    ----------
    name : str
        Of the recording.
    parent : QWidget
        Over which the question stands.
    """
    translate = QCoreApplication.translate
    box = QMessageBox(parent)
    box.setIcon(QMessageBox.Icon.Question)
    box.setWindowTitle(translate("forcelab", "Recording"))
    box.setText(translate("forcelab", "'{0}' is being recorded.").format(name))
    box.setInformativeText(
        translate("forcelab", "If the window is closed, the recording ends and is kept.")
    )
    stay = box.addButton(
        translate("forcelab", "Go on recording"), QMessageBox.ButtonRole.RejectRole
    )
    leave = box.addButton(
        translate("forcelab", "Keep it and close"), QMessageBox.ButtonRole.AcceptRole
    )
    box.setDefaultButton(leave)
    box.setEscapeButton(stay)
    box.exec()
    box.deleteLater()
    return box.clickedButton() is leave
