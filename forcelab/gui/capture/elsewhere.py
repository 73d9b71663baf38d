"""That something is being recorded, said wherever one is in the window, and before it is left."""

from __future__ import annotations

from PySide6.QtCore import QCoreApplication, QSize
from PySide6.QtWidgets import QMessageBox, QToolButton, QWidget

from forcelab.gui.theme import colours, themes

__all__ = ["DOT", "RecordingLine", "asks_to_leave", "length"]

#: What stands before whatever is recorded.
DOT = "\N{BLACK CIRCLE}"


class RecordingLine(QToolButton):
    """A line in the status bar; a click on it leads to what is being recorded.

    Seen while another workspace is in front.

    Parameters
    ----------
    parent : QWidget, optional
    """

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._elsewhere, self._name, self._seconds = True, "", 0.0
        self.setAutoRaise(True)
        self.setToolTip(self.tr("Show what is being recorded"))
        themes().changed.connect(self._colour)
        self._colour()
        self.hide()

    def sizeHint(self) -> QSize:
        """No higher than a line, so that nothing moves when it comes."""
        return QSize(super().sizeHint().width(), self.fontMetrics().height())

    def minimumSizeHint(self) -> QSize:
        """The same."""
        return self.sizeHint()

    def set_elsewhere(self, elsewhere: bool) -> None:
        """Say whether another workspace than the one for capturing is in front."""
        self._elsewhere = elsewhere
        self._refresh()

    def tell(self, name: str, seconds: float) -> None:
        """Say what is recorded, and for how long it has been; empty for nothing."""
        self._name, self._seconds = name, seconds
        self._refresh()

    def _refresh(self) -> None:
        words = ""
        if self._name and self._elsewhere:
            words = self.tr("{dot} Recording '{name}'  {time}").format(
                dot=DOT, name=self._name, time=length(self._seconds)
            )
        if words != self.text():
            self.setText(words)
            self.setAccessibleName(words)
        if self.isHidden() == bool(words):
            self.setVisible(bool(words))

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
