"""Colours of the scalogram, computed in a space in which equal steps look equal.

Lightness is that of OKLab, which is even to the eye from black to white; hue and chroma only add
what tells neighbours apart. Where the screen cannot show a chroma, it is lowered, never the
lightness.

References
----------
.. [1] Ottosson, B., "A perceptual color space for image processing" (2020): OKLab and its matrices.
.. [2] IEC 61966-2-1: the sRGB transfer function.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

__all__ = ["magnitude_colours", "oklch_to_srgb", "phase_colours"]

Real = NDArray[np.float64]
Bytes = NDArray[np.uint8]

#: From OKLab to cube roots of cone responses, and from cone responses to linear sRGB [1]_.
_CONES = np.array(
    [
        [1.0, 0.3963377774, 0.2158037573],
        [1.0, -0.1055613458, -0.0638541728],
        [1.0, -0.0894841775, -1.2914855480],
    ]
)
_LINEAR = np.array(
    [
        [4.0767416621, -3.3077115913, 0.2309699292],
        [-1.2684380046, 2.6097574011, -0.3413193965],
        [-0.0041960863, -0.7034186147, 1.7076147010],
    ]
)
#: Lightness, chroma and hue in degrees, evenly spaced from the least to the largest magnitude.
#: Lightness runs on a straight line; the least is close to the panel's ground.
_ON_DARK = np.array(
    [
        [0.22, 0.030, 265.0],
        [0.37, 0.120, 285.0],
        [0.52, 0.170, 325.0],
        [0.67, 0.170, 385.0],
        [0.82, 0.150, 430.0],
        [0.97, 0.080, 465.0],
    ]
)
_ON_LIGHT = np.array(
    [
        [0.985, 0.012, 110.0],
        [0.845, 0.110, 140.0],
        [0.705, 0.130, 180.0],
        [0.565, 0.140, 230.0],
        [0.425, 0.150, 268.0],
        [0.285, 0.120, 300.0],
    ]
)


def _linear(lightness: Real, chroma: Real, hue: Real) -> Real:
    """Linear sRGB of OKLCH colours, shape (..., 3), inside the screen's range or not."""
    lab = np.stack([lightness, chroma * np.cos(hue), chroma * np.sin(hue)], axis=-1)
    return np.asarray(((lab @ _CONES.T) ** 3) @ _LINEAR.T, dtype=np.float64)


def oklch_to_srgb(lightness: Real, chroma: Real, hue: Real) -> Bytes:
    """Colours of the screen for OKLCH, with the largest chroma up to `chroma` that it can show.

    Parameters
    ----------
    lightness, chroma, hue : ndarray, shape (n,)
        Lightness from 0 to 1; hue in radians.

    Returns
    -------
    ndarray of uint8, shape (n, 3)
        Red, green and blue.
    """
    low, high = np.zeros_like(chroma), chroma.copy()
    for _ in range(20):
        half = 0.5 * (low + high)
        linear = _linear(lightness, half, hue)
        fits = np.all((linear >= -1e-6) & (linear <= 1 + 1e-6), axis=-1)
        low, high = np.where(fits, half, low), np.where(fits, high, half)
    fits = np.all(np.abs(_linear(lightness, chroma, hue) - 0.5) <= 0.5, axis=-1)
    linear = np.clip(_linear(lightness, np.where(fits, chroma, low), hue), 0.0, 1.0)
    # The sRGB transfer function [2]_.
    curved = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.round(255 * curved).astype(np.uint8)


@cache
def magnitude_colours(dark: bool, count: int = 255) -> Bytes:
    """A sequence from the least to the largest magnitude, for a dark or a light theme.

    On dark it rises from the ground to light, on light it falls from white to dark; lightness is
    linear in both. Shared: not to be changed.

    Returns
    -------
    ndarray of uint8, shape (count, 3)
    """
    stops = _ON_DARK if dark else _ON_LIGHT
    at = np.linspace(0.0, 1.0, len(stops))
    share = np.linspace(0.0, 1.0, count)
    lightness, chroma, hue = (np.interp(share, at, column) for column in stops.T)
    return oklch_to_srgb(lightness, chroma, np.radians(hue))


@cache
def phase_colours(dark: bool, count: int = 255) -> Bytes:
    """A circle of hues of one lightness, from -pi to pi; its ends are neighbours.

    Shared: not to be changed.

    Returns
    -------
    ndarray of uint8, shape (count, 3)
    """
    hue = 2 * np.pi * np.arange(count) / count
    lightness = np.full(count, 0.68 if dark else 0.74)
    return oklch_to_srgb(lightness, np.full(count, 0.115), hue)
