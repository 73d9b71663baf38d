"""Which camera's video is shown, where several filmed a demonstration."""

from __future__ import annotations

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtGui import QPaintEvent
from PySide6.QtWidgets import QComboBox, QStyle, QStyleOptionComboBox, QStylePainter, QWidget

from forcelab.demonstration import VideoReference
from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.figures.text import NAMES
from forcelab.project.loading import Camera

__all__ = ["CameraChoice", "Cameras"]

#: Pixels beside a name in its field.
PADDING = 4


class Cameras(QObject):
    """The cameras of the open demonstration, and the one that is looked through.

    Attributes
    ----------
    all : tuple of Camera
        Nothing unless there are several; the first one's video is the demonstration's.
    shown : int
        The place of the one that is looked through.
    changed : Signal()
        There are others, or another one is looked through.
    """

    changed = Signal()

    def __init__(self, document: Document, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._document = document
        self._of = ""
        self.all: tuple[Camera, ...] = ()
        self.shown = 0
        document.demonstration_changed.connect(self._look)
        self._look()

    @property
    def video(self) -> VideoReference | None:
        """The video that is to be shown: of the demonstration, or of the chosen camera."""
        demonstration = self._document.demonstration
        if demonstration is None:
            return None
        return self.all[self.shown].video if self.shown else demonstration.video

    def show(self, place: int) -> None:
        """Look through another camera."""
        if place != self.shown and 0 <= place < len(self.all):
            self.shown = place
            self.changed.emit()

    def show_next(self) -> None:
        """Look through the next camera, after the last one through the first."""
        if self.all:
            self.show((self.shown + 1) % len(self.all))
            self._document.say(f"Camera: {self.all[self.shown].name}")
        else:
            self._document.say("No other camera filmed this demonstration.")

    def _look(self) -> None:
        """Ask which cameras there are; the same one stays while the demonstration does."""
        document = self._document
        found: tuple[Camera, ...] = ()
        if document.project is not None and document.demonstration is not None:
            try:
                found = document.project.cameras(document.demonstration)
            except ForcelabError as error:  # its own video can still be shown
                document.say(str(error), True)
        stays = document.id == self._of and len(found) == len(self.all)
        self._of, before = document.id, (self.all, self.shown)
        self.all, self.shown = found, self.shown if stays else 0
        if (self.all, self.shown) != before:
            self.changed.emit()


class CameraChoice(QComboBox):
    """Chooses the camera; hidden unless there are several."""

    def __init__(self, cameras: Cameras, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._cameras = cameras
        self.setAccessibleName("Camera")
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # a click leaves the keyboard where it is
        self.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToContents)
        self.activated.connect(cameras.show)
        cameras.changed.connect(self._fill)
        self._fill()

    def fit(self, room: int) -> None:
        """Be as wide as the names need, if so many pixels are enough."""
        # Not its size alone: a while after a change it takes the one that its names need.
        self.setMaximumWidth(max(room, 1))
        self.resize(self.sizeHint())

    def showPopup(self) -> None:
        """Offer the names no wider than the field, elided; their tooltips have all of them."""
        super().showPopup()
        popup = self.view().window()
        popup.setFixedWidth(self.width())
        popup.move(self.mapToGlobal(self.rect().topLeft()).x(), popup.y())

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw it with as much of the name as fits."""
        painter, option = QStylePainter(self), QStyleOptionComboBox()
        self.initStyleOption(option)
        field = QStyle.SubControl.SC_ComboBoxEditField
        kind = QStyle.ComplexControl.CC_ComboBox
        room = self.style().subControlRect(kind, option, field, self).width() - PADDING
        option.currentText = self.fontMetrics().elidedText(self.currentText(), NAMES, room)
        painter.drawComplexControl(kind, option)
        painter.drawControl(QStyle.ControlElement.CE_ComboBoxLabel, option)

    def _fill(self) -> None:
        """Offer the cameras that there are."""
        self.clear()
        for place, camera in enumerate(self._cameras.all):
            self.addItem(camera.name)
            self.setItemData(place, camera.name, Qt.ItemDataRole.ToolTipRole)
        self.setCurrentIndex(self._cameras.shown if self._cameras.all else -1)
        self.setToolTip(self.currentText())
        self.setVisible(bool(self._cameras.all))
