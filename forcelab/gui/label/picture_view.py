"""A picture with words below it: fitted, or enlarged and moved under the pointer."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, QSize, QSizeF, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QContextMenuEvent,
    QGuiApplication,
    QImage,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPixmap,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QMenu, QSizePolicy, QWidget

from forcelab.gui.layout import set_enabled_with_reason
from forcelab.gui.theme import colours, themes

#: What one notch of the wheel makes of the picture, and how large it may become.
ZOOM_STEP, LARGEST_ZOOM = 1.25, 32.0
#: From this zoom on single pixels are shown, not smoothed.
SHARP_ZOOM = 4.0
#: Space around texts, in pixels.
MARGIN = 6.0


def scaled(image: QImage, size: QSize) -> QImage:
    """The picture in a size in pixels; may be called in any thread."""
    keep, smooth = Qt.AspectRatioMode.IgnoreAspectRatio, Qt.TransformationMode.SmoothTransformation
    return image.scaled(size, keep, smooth)


class PictureView(QWidget):
    """A picture, or a message in its place, and a caption below.

    `fits` tells in which size, in pixels of the screen, pictures are shown from now on; an empty
    size while they are enlarged.
    """

    fits = Signal(QSize)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setMinimumSize(160, 96)
        self.image: QImage | None = None
        # Every pixel is painted here; what lies below need not be.
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self._scaled: QPixmap | None = None
        self._announced_size = QSize()
        self._zoom, self._centre = 1.0, QPointF(0.5, 0.5)
        self._dragged: QPointF | None = None
        themes().changed.connect(self.update)

    @property
    def caption(self) -> str:
        """The text below the picture."""
        return ""

    @property
    def message(self) -> str:
        """The text in place of the picture; empty while there is one."""
        return ""

    @property
    def failed(self) -> bool:
        """Whether the message reports a failure."""
        return False

    def set_image(self, image: QImage | None, fitted: QImage | None = None) -> None:
        """Show another picture, enlarged as the one before.

        `fitted` is the same in the size that :attr:`fits` told last, where it is ready.
        """
        self.image = image
        self._scaled = None if fitted is None else self._screen_pixmap(fitted)
        self.setAccessibleDescription(self.message or self.caption)
        self.update()

    def sizeHint(self) -> QSize:
        """As wide as most videos are beside the panels."""
        return QSize(320, 220)

    # Painting

    @property
    def _stage(self) -> QRectF:
        """The area of the picture: all but the caption."""
        below = self.fontMetrics().height() + MARGIN
        return QRectF(0, 0, self.width(), max(self.height() - below, 1.0))

    def picture_box(self) -> QRectF:
        """Where the picture lies, beyond the stage when zoomed in."""
        assert self.image is not None
        stage = self._stage
        size = QSizeF(self.image.size()).scaled(
            stage.size() * self._zoom, Qt.AspectRatioMode.KeepAspectRatio
        )
        left = _placed(stage.center().x(), self._centre.x(), size.width(), stage.width())
        top = _placed(stage.center().y(), self._centre.y(), size.height(), stage.height())
        return QRectF(QPointF(left, top), size)

    def paintEvent(self, event: QPaintEvent) -> None:
        theme, stage = colours(), self._stage
        with QPainter(self) as painter:
            painter.fillRect(self.rect(), QColor(theme.panel))
            message = self.message
            if self.image is not None and not message:
                self._paint_picture(painter, stage)
            elif message:
                self._paint_message(painter, stage, message)
            below = self.height() - stage.height()
            caption = QRectF(MARGIN, stage.height(), self.width() - 2 * MARGIN, below)
            painter.setPen(QColor(theme.muted))
            text = self.fontMetrics().elidedText(
                self.caption, Qt.TextElideMode.ElideRight, int(caption.width())
            )
            painter.drawText(caption, Qt.AlignmentFlag.AlignCenter, text)

    def _paint_message(self, painter: QPainter, stage: QRectF, message: str) -> None:
        """Write a message in place of the picture; a long path is broken anywhere."""
        inner = stage.adjusted(2 * MARGIN, MARGIN, -2 * MARGIN, -MARGIN)
        wrap = Qt.TextFlag.TextWordWrap
        if painter.boundingRect(inner, wrap, message).width() > inner.width():
            wrap = Qt.TextFlag.TextWrapAnywhere
        painter.setPen(QColor(colours().trouble if self.failed else colours().muted))
        painter.drawText(inner, Qt.AlignmentFlag.AlignCenter | wrap, message)

    def _paint_picture(self, painter: QPainter, stage: QRectF) -> None:
        """Draw the picture, scaled once for each frame and size."""
        assert self.image is not None
        box = self.picture_box()
        painter.fillRect(stage, QColor("#000000" if colours().dark else "#14161a"))
        painter.setClipRect(stage)
        if self._zoom > 1:
            self._announce_size(QSize())
            smooth = box.width() * self.devicePixelRatioF() < SHARP_ZOOM * self.image.width()
            painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform, smooth)
            painter.drawImage(box, self.image)
        else:
            painter.drawPixmap(box.topLeft(), self._fitted(box.size()))
        painter.setClipping(False)

    def _fitted(self, size: QSizeF) -> QPixmap:
        """The picture at the resolution of the screen."""
        exact = (size * self.devicePixelRatioF()).toSize().expandedTo(QSize(1, 1))
        if self._scaled is None or self._scaled.size() != exact:
            assert self.image is not None
            self._scaled = self._screen_pixmap(scaled(self.image, exact))
        self._announce_size(exact)
        return self._scaled

    def _screen_pixmap(self, image: QImage) -> QPixmap:
        """A pixmap whose pixels are those of the screen."""
        pixmap = QPixmap.fromImage(image)
        pixmap.setDevicePixelRatio(self.devicePixelRatioF())
        return pixmap

    def _announce_size(self, size: QSize) -> None:
        """Emit the size in which pictures are shown, if it has changed."""
        if size != self._announced_size:
            self._announced_size = size
            self.fits.emit(size)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._scaled = None

    # Zoom

    def zoom_by(self, factor: float, about: QPointF | None = None) -> None:
        """Enlarge the picture by a factor, keeping the pixel `about` (the middle) in place."""
        if self.image is None:
            return
        about = self._stage.center() if about is None else about
        before = self.picture_box()
        share = QPointF(
            (about.x() - before.left()) / before.width(),
            (about.y() - before.top()) / before.height(),
        )
        self._zoom = min(max(self._zoom * factor, 1.0), LARGEST_ZOOM)
        after = self.picture_box().size()
        self._centre_on(
            share.x() - (about.x() - self._stage.center().x()) / after.width(),
            share.y() - (about.y() - self._stage.center().y()) / after.height(),
        )

    def fit(self) -> None:
        """Show the whole picture."""
        self._zoom, self._centre = 1.0, QPointF(0.5, 0.5)
        self.update()

    def _centre_on(self, x: float, y: float) -> None:
        """Put a point of the picture, in shares of it, into the middle of the stage."""
        size, stage = self.picture_box().size(), self._stage
        half_x = min(stage.width() / size.width() / 2, 0.5)
        half_y = min(stage.height() / size.height() / 2, 0.5)
        self._centre = QPointF(min(max(x, half_x), 1 - half_x), min(max(y, half_y), 1 - half_y))
        self.update()

    def wheelEvent(self, event: QWheelEvent) -> None:
        self.zoom_by(ZOOM_STEP ** (event.angleDelta().y() / 120), event.position())
        event.accept()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton and self._zoom > 1:
            self._dragged = event.position()
            self.setCursor(Qt.CursorShape.ClosedHandCursor)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._dragged is not None and self.image is not None:
            moved, size = event.position() - self._dragged, self.picture_box().size()
            self._dragged = event.position()
            self._centre_on(
                self._centre.x() - moved.x() / size.width(),
                self._centre.y() - moved.y() / size.height(),
            )

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        self._dragged = None
        self.unsetCursor()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        self.fit()

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        self.menu().exec(event.globalPos())

    def menu(self) -> QMenu:
        menu = QMenu(self)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        copy = menu.addAction("Copy frame", self.copy_frame)
        menu.addSeparator()
        closer = menu.addAction("Zoom in", lambda: self.zoom_by(ZOOM_STEP**2))
        zoom_out = menu.addAction("Zoom out", lambda: self.zoom_by(ZOOM_STEP**-2))
        fit = menu.addAction("Fit", self.fit)
        missing = "" if self.image is not None else "No frame is shown."
        for action in (copy, closer):
            set_enabled_with_reason(action, missing)
        for action in (zoom_out, fit):
            set_enabled_with_reason(
                action, missing or ("" if self._zoom > 1 else "All of the frame is shown.")
            )
        return menu

    def copy_frame(self) -> None:
        if self.image is not None:
            QGuiApplication.clipboard().setImage(self.image)


def _placed(centre: float, share: float, size: float, room: float) -> float:
    """Where a side begins: centred in the room, or scrolled where the picture is larger."""
    return centre - size / 2 if size <= room else centre - share * size
