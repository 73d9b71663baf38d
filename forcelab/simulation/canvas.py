"""Shapes on a picture, drawn by OpenCV, and the colours they have."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
Points = NDArray[np.float64]
#: Blue, green and red, 0..255, as OpenCV orders them.
Colour = tuple[int, int, int]

#: Bits of the fractions of a pixel in which OpenCV is told coordinates.
SHIFT = 4
_TURN = np.linspace(0.0, 2.0 * np.pi, 28, endpoint=False)
#: Corners of a polygon that passes for a circle of radius 1, shape (28, 2).
CIRCLE = np.column_stack([np.cos(_TURN), np.sin(_TURN)])


def colour(code: str) -> Colour:
    """The colour of a code such as ``"d8432f"``: red, green, blue."""
    red, green, blue = bytes.fromhex(code)
    return blue, green, red


def mix_colours(first: Colour, second: Colour, share: float) -> Colour:
    """The colour that holds `share` of the other one."""
    blue, green, red = (round(a + share * (b - a)) for a, b in zip(first, second, strict=True))
    return blue, green, red


def _fixed(values: Any) -> NDArray[np.int32]:
    """Pixels as the fixed-point numbers that OpenCV takes; pixel centres are whole numbers."""
    return np.rint((np.asarray(values) - 0.5) * (1 << SHIFT)).astype(np.int32)


def dark(paint: Colour, share: float = 0.45) -> Colour:
    """The shade of a colour in which edges are drawn."""
    return mix_colours(paint, colour("1a1d24"), share)


def light(paint: Colour, share: float = 0.35) -> Colour:
    """The tint of a colour on faces that the light falls on."""
    return mix_colours(paint, colour("ffffff"), share)


class Canvas:
    """Shapes on an image, anti-aliased to a sixteenth of a pixel.

    `image` (height, width, 3): what is drawn on; `zoom`: pixels of the image per pixel of line
    widths.
    """

    def __init__(self, image: Image, zoom: float = 1.0) -> None:
        self.image = image
        self.zoom = zoom

    def polygon(self, points: Points, fill: Colour, edge: Colour | None = None) -> None:
        """A filled polygon, shape (n, 2) in pixels, with a line around it where asked for."""
        corners = [_fixed(points)]
        cv2.fillPoly(self.image, corners, fill, cv2.LINE_AA, SHIFT)
        if edge is not None:
            cv2.polylines(self.image, corners, True, edge, self._width(1.0), cv2.LINE_AA, SHIFT)

    def hull(self, points: Points, fill: Colour, edge: Colour) -> None:
        """The convex hull of points, shape (n, 2) in pixels."""
        corners = [cv2.convexHull(_fixed(points))]
        cv2.fillPoly(self.image, corners, fill, cv2.LINE_AA, SHIFT)
        cv2.polylines(self.image, corners, True, edge, self._width(1.0), cv2.LINE_AA, SHIFT)

    def line(self, points: Points, paint: Colour, width: float = 1.0) -> None:
        """An open line through points, shape (n, 2) in pixels."""
        corners = [_fixed(points)]
        cv2.polylines(self.image, corners, False, paint, self._width(width), cv2.LINE_AA, SHIFT)

    def disc(
        self,
        centre: Points,
        radii: tuple[float, float],
        fill: Colour,
        edge: Colour | None = None,
    ) -> None:
        """A filled ellipse with its axes along the image's."""
        self.polygon(centre + CIRCLE * radii, fill, edge)

    def capsule(
        self,
        ends: tuple[Points, Points],
        radii: tuple[float, float],
        fill: Colour,
        edge: Colour | None = None,
    ) -> None:
        """The convex hull of two discs: a finger, a sleeve, a rod."""
        first, second = ends
        along = second - first
        length = float(np.hypot(along[0], along[1]))
        if length <= abs(radii[0] - radii[1]):
            larger = 0 if radii[0] >= radii[1] else 1
            self.disc(ends[larger], (radii[larger], radii[larger]), fill, edge)
            return
        # The common tangents touch both discs where the rim leans by this angle.
        lean = np.arccos((radii[0] - radii[1]) / length)
        heading = np.arctan2(along[1], along[0])
        far = heading + np.linspace(-lean, lean, 13)
        near = heading + np.linspace(lean, 2.0 * np.pi - lean, 13)
        outline = np.concatenate(
            [
                second + radii[1] * np.column_stack([np.cos(far), np.sin(far)]),
                first + radii[0] * np.column_stack([np.cos(near), np.sin(near)]),
            ]
        )
        self.polygon(outline, fill, edge)

    def dots(self, centres: Points, radius: float, fill: Colour) -> None:
        """Small discs of one size, centres of shape (n, 2)."""
        size = max(1, round(radius * (1 << SHIFT)))
        for u, v in _fixed(centres).tolist():
            cv2.circle(self.image, (u, v), size, fill, -1, cv2.LINE_AA, SHIFT)

    def _width(self, width: float) -> int:
        """Of a line, in whole pixels of the image."""
        return max(1, round(width * self.zoom))
