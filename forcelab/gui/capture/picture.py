"""The latest frame of the camera."""

from __future__ import annotations

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from forcelab.gui.capture.session import Session
from forcelab.gui.theme import colours

__all__ = ["CameraPicture"]


class CameraPicture(QWidget):
    """Shows what the first camera sees; hidden while there is none.

    Parameters
    ----------
    session : Session
    parent : QWidget, optional
    """

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._image: QImage | None = None
        self._arrived = 0.0
        self.setAccessibleName(self.tr("Camera"))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.hide()
        session.ticked.connect(self._look)
        session.changed.connect(self._look)

    def sizeHint(self) -> QSize:
        """A small picture."""
        return QSize(240, 180)

    def minimumSizeHint(self) -> QSize:
        """One in which something can be seen."""
        return QSize(120, 90)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the frame as large as there is room."""
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(colours().panel))
        if self._image is not None:
            painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
            size = self._image.size().scaled(self.size(), Qt.AspectRatioMode.KeepAspectRatio)
            left = (self.width() - size.width()) / 2
            top = (self.height() - size.height()) / 2
            painter.drawImage(QRectF(left, top, size.width(), size.height()), self._image)
        painter.end()

    def _look(self) -> None:
        """Take the latest frame, if it is another one."""
        parent = self.parentWidget()
        if parent is None or not parent.isVisible():
            return
        frame = self._session.frame()
        self.setVisible(frame is not None)
        if frame is None:
            self._image = None
        elif frame[0] != self._arrived:
            self._arrived, picture = frame
            height, width = picture.shape[:2]
            form = QImage.Format.Format_BGR888
            self._image = QImage(picture.data, width, height, picture.strides[0], form).copy()
            self.update()
