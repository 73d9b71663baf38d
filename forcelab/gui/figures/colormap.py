"""Mixed and translucent colours, and one hue from light to dark for shares and magnitudes."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PySide6.QtGui import QColor

#: From nothing to all, evenly spaced. Lightness falls by about the same amount from stop to stop,
#: so that equal differences look equal, in grey print too.
COLORMAP_STOPS = np.array(
    [
        [0xF6, 0xF8, 0xFB],
        [0xC3, 0xD7, 0xEC],
        [0x86, 0xB1, 0xDB],
        [0x44, 0x88, 0xC2],
        [0x1B, 0x5F, 0x9B],
        [0x0A, 0x38, 0x69],
    ],
    dtype=np.float64,
)


def mixed(first: QColor | str, second: QColor | str, share: float) -> QColor:
    """A colour between two, `share` of the way from the first."""
    a, b = QColor(first), QColor(second)
    return QColor.fromRgbF(
        a.redF() + (b.redF() - a.redF()) * share,
        a.greenF() + (b.greenF() - a.greenF()) * share,
        a.blueF() + (b.blueF() - a.blueF()) * share,
    )


def translucent(colour: QColor | str, opacity: float) -> QColor:
    """A colour of an opacity from 0 to 1."""
    result = QColor(colour)
    result.setAlphaF(opacity)
    return result


def colormap_colours(shares: ArrayLike) -> NDArray[np.uint8]:
    """RGB of shares from 0, the lightest, to 1, the darkest, in an array of shape (..., 3)."""
    shares = np.asarray(shares, dtype=np.float64)
    at = np.linspace(0.0, 1.0, len(COLORMAP_STOPS))
    channels = [np.interp(shares, at, COLORMAP_STOPS[:, c]) for c in range(3)]
    return np.round(np.stack(channels, axis=-1)).astype(np.uint8)


def colormap_colour(share: float) -> QColor:
    red, green, blue = (int(value) for value in colormap_colours(share))
    return QColor(red, green, blue)
