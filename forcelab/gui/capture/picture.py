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
    """

    def __init__(self, session: Session) -> None:
        super().__init__()
        self._session = session
        self._image: QImage | None = None
        self._arrived = 0.0
        self._gone = False  # the camera gives no picture now
        self.setAccessibleName("Camera")
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
        with QPainter(self) as painter:
            painter.fillRect(self.rect(), QColor(colours().panel))
            if self._image is not None:
                painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
                size = self._image.size().scaled(self.size(), Qt.AspectRatioMode.KeepAspectRatio)
                left = (self.width() - size.width()) / 2
                top = (self.height() - size.height()) / 2
                painter.drawImage(QRectF(left, top, size.width(), size.height()), self._image)
            if self._gone:
                self._paint_gone(painter)

    def _paint_gone(self, painter: QPainter) -> None:
        """What is seen is not how it is now."""
        veil = QColor(colours().panel)
        veil.setAlphaF(0.75)
        painter.fillRect(self.rect(), veil)
        painter.setPen(QColor(colours().trouble))
        wrapped = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
        painter.drawText(self.rect().adjusted(6, 6, -6, -6), wrapped, "No picture comes")

    def _look(self) -> None:
        """Take the latest frame, if it is another one."""
        parent = self.parentWidget()
        if parent is None or not parent.isVisible():
            return
        frame, state = self._session.frame(), self._session.state
        self.setVisible(frame is not None)
        gone = state is not None and any("no picture" in one.alarms for one in state.cameras[:1])
        if gone != self._gone:
            self._gone = gone
            self.update()
        if frame is None:
            self._image = None
        elif frame[0] != self._arrived:
            self._arrived, picture = frame
            height, width = picture.shape[:2]
            form = QImage.Format.Format_BGR888
            self._image = QImage(picture.data, width, height, picture.strides[0], form).copy()
            self.update()
