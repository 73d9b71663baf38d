"""The pictures that the scalogram's panel keeps, and how they lie over each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QRectF
from PySide6.QtGui import QColor, QImage, QPainter

from forcelab.gui.label.scalogram_drawing import image
from forcelab.gui.theme import colours

if TYPE_CHECKING:
    from forcelab.signals.scalogram import Scalogram

__all__ = ["Layers", "colour_range"]

#: From the bottom: all of the demonstration, the last fine picture, the newest coarse one.
ORDER = ("whole", "fine", "coarse")


def colour_range(picture: Scalogram, steady: bool) -> tuple[float, float]:
    """Decimal logarithms of the magnitudes for the first and the last colour.

    Parameters
    ----------
    picture : Scalogram
    steady : bool
        Take the range of the whole demonstration, so that colours do not jump while panning.
    """
    view = picture.view
    known = picture.values[np.isfinite(picture.values)]
    if steady or picture.phase or not known.size:
        return view.low, view.high
    from forcelab.signals.scalogram import colour_range as fitted  # loaded by then

    return fitted(known, 0.5)


class Layers:
    """Pictures of one channel: the old ones stay below until a fine one covers them."""

    def __init__(self) -> None:
        self._kept: dict[str, tuple[Scalogram, QImage]] = {}

    def clear(self) -> None:
        """Forget all pictures."""
        self._kept.clear()

    def take(self, picture: Scalogram, *, whole: bool, steady: bool) -> None:
        """Lay a newer picture over the others; `whole` if it shows all of the demonstration."""
        layer = picture, _coloured(picture, steady)
        if picture.coarse:
            self._kept["coarse"] = layer
            return
        self._kept.pop("coarse", None)
        self._kept["fine"] = layer
        if whole:
            self._kept["whole"] = layer

    def recolour(self, steady: bool) -> None:
        """Make the images anew, from the same pictures."""
        for kind, (picture, _) in list(self._kept.items()):
            self._kept[kind] = picture, _coloured(picture, steady)

    def paint(
        self, painter: QPainter, plot: QRectF, start: float, end: float, *, smooth: bool
    ) -> None:
        """Draw what lies between two times, in seconds, where it belongs in `plot`.

        What is not `smooth` is drawn in half the time, for as long as it is being moved.
        """
        for kind in ORDER:
            if kind in self._kept:
                for seen in self._seen(kind, start, end):
                    _paint(painter, plot, (start, end), seen, smooth, *self._kept[kind])

    def _seen(self, kind: str, start: float, end: float) -> list[tuple[float, float]]:
        """Where a picture is not covered: a fine one hides what lies below it."""
        if kind != "whole" or "fine" not in self._kept:
            return [(start, end)]
        above, _ = self._kept["fine"]
        return [(start, min(end, above.start)), (max(start, above.end), end)]


def _coloured(picture: Scalogram, steady: bool) -> QImage:
    """A picture in the theme's colours."""
    return image(picture, *colour_range(picture, steady), colours().dark)


def _paint(
    painter: QPainter,
    plot: QRectF,
    span: tuple[float, float],
    seen: tuple[float, float],
    smooth: bool,
    picture: Scalogram,
    layer: QImage,
) -> None:
    """Draw the part of a picture that is seen where its time is in the visible span."""
    first, last = max(picture.start, seen[0]), min(picture.end, seen[1])
    if last <= first:
        return
    start, end = span
    per_pixel = (end - start) / plot.width()
    left = plot.left() + (first - start) / per_pixel
    target = QRectF(left, plot.top(), (last - first) / per_pixel, plot.height())
    per_second = layer.width() / (picture.end - picture.start)
    from_left, width = (first - picture.start) * per_second, (last - first) * per_second
    if not picture.coarse:
        painter.fillRect(target, QColor(colours().grid))  # where nothing is known
    # Between two phases there is no mean that means anything.
    hint = QPainter.RenderHint.SmoothPixmapTransform
    painter.setRenderHint(hint, smooth and not picture.phase)
    painter.drawImage(target, layer, QRectF(from_left, 0, width, layer.height()))
