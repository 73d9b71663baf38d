"""Pictures of what is slow to draw, kept until what they show is not the same any more."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QSize
from PySide6.QtGui import QPainter, QPixmap

__all__ = ["Kept"]


class Kept:
    """A picture that is drawn anew when its size or what it shows has changed.

    Its memory is used again: to have the system find and clear another megabyte takes longer than
    most panels take to draw.
    """

    def __init__(self) -> None:
        self._pixmap: QPixmap | None = None
        self._shown: object = None
        self._fresh = False

    def forget(self) -> None:
        """Draw it anew the next time."""
        self._fresh = False

    def picture(
        self, size: QSize, ratio: float, shown: object, draw: Callable[[QPainter], object]
    ) -> QPixmap:
        """The picture.

        Parameters
        ----------
        size : QSize
            In pixels of the widget.
        ratio : float
            Pixels of the screen for each of them.
        shown : object
            All that the drawing depends on, to be compared.
        draw : callable
            Draws it if need be, every pixel: what was drawn before still lies there.

        Returns
        -------
        QPixmap
            To be used at once; the next call draws into it.
        """
        pixmap, exact = self._pixmap, size * ratio
        if pixmap is None or pixmap.size() != exact or pixmap.devicePixelRatio() != ratio:
            self._pixmap = pixmap = QPixmap(exact)
            pixmap.setDevicePixelRatio(ratio)
            self._fresh = False
        if not self._fresh or shown != self._shown:
            with QPainter(pixmap) as painter:
                painter.setRenderHint(QPainter.RenderHint.TextAntialiasing)
                draw(painter)
            self._shown, self._fresh = shown, True
        return pixmap
