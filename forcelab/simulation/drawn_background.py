"""What stands still in the picture: the room, the table, and what holds the body."""

from __future__ import annotations

import cv2
import numpy as np

from forcelab.simulation.canvas import Canvas, Colour, Image, colour, dark, light
from forcelab.simulation.drawn_bodies import box, stud
from forcelab.simulation.projection import Proportions, View
from forcelab.simulation.scene import Scene

WALL = colour("dfe5ea"), colour("f3f5f6")
TABLE = colour("cdbfae"), colour("bba994")
WOOD = colour("a98c6b")
PLATE = colour("3f8f5a")
CONSOLE = colour("50565f")
CUT = colour("8e969f")
PIT = colour("23262b")
PIN = colour("d9a736")
IRON = colour("6f7f92")
BRASS = colour("9aa5b1")

#: The still parts are drawn this many times as large and then made small.
FINER = 3


def background(scene: Scene, sizes: Proportions, view: View, size: tuple[int, int]) -> Image:
    """Everything that stands still, drawn once.

    `size`: width and height, pixels. Gives (height, width, 3).
    """
    width, height = size
    large = view.zoomed(FINER)
    room = np.empty((height, width, 3), dtype=np.uint8)
    horizon = int(np.clip(view.at(0.0, -0.05, -sizes.foot)[1], 1, height - 1))
    room[:horizon] = _shades(*WALL, horizon)
    room[horizon:] = _shades(*TABLE, height - horizon)
    Canvas(room).line(np.array([(0, horizon), (width, horizon)]), dark(TABLE[1], 0.15))
    _shade(scene, sizes, view, room)
    image = cv2.resize(room, (width * FINER, height * FINER)).astype(np.uint8, copy=False)
    canvas = Canvas(image, FINER)
    if scene.socket is not None:
        _stand(scene, sizes, large, canvas)
        if scene.body.shape == "brick":
            _base_plate(scene, large, canvas, sizes)
        else:
            _console(scene, large, canvas, sizes)
    elif scene.holder is not None:
        _vice(scene, sizes, large, canvas)
    return cv2.resize(image, size, interpolation=cv2.INTER_AREA).astype(np.uint8, copy=False)


def _shade(scene: Scene, sizes: Proportions, view: View, image: Image) -> None:
    """The soft shadow on the table of what stands on it."""
    half, back, foot = scene.body.half_width, sizes.back, sizes.foot
    if scene.socket is not None:
        front = view.along(scene.socket.place)
        outlines = [(half + 0.004, -2 * back - 0.003, 0.002), (half + 0.015, front - 0.02, front)]
    elif scene.holder is not None:
        outlines = [(half + 0.018, -0.012, 0.008)]
    else:
        return
    mask = np.zeros(image.shape[:2], dtype=np.uint8)
    for wide, rear, near in outlines:
        ground = [(-wide - 0.003, near + 0.004, -foot), (wide + 0.003, near + 0.004, -foot),
                  (wide + 0.003, rear, -foot), (-wide - 0.003, rear, -foot)]  # fmt: skip
        cv2.fillPoly(mask, [view.path(ground).astype(np.int32)], 105)
    bright = 255 - cv2.GaussianBlur(mask, (0, 0), 0.0022 * view.scale)
    cv2.multiply(image, cv2.merge([bright] * 3), dst=image, scale=1.0 / 255.0)


def _shades(first: Colour, last: Colour, rows: int) -> Image:
    """A gradient from the upper to the lower row, shape (rows, 1, 3)."""
    part = np.linspace(0.0, 1.0, rows)[:, None, None]
    ends = np.array(first), np.array(last)
    return np.asarray(ends[0] + part * (ends[1] - ends[0]), dtype=np.uint8)


def _stand(scene: Scene, sizes: Proportions, view: View, canvas: Canvas) -> None:
    """The wooden stand from which the body is taken."""
    wide = scene.body.half_width + 0.004
    box(canvas, view, (-wide, wide), (-2 * sizes.back - 0.003, 0.002), (-sizes.foot, 0.0), WOOD)


def _base_plate(scene: Scene, view: View, canvas: Canvas, sizes: Proportions) -> None:
    """A plate with rows of studs; the brick goes onto those at its front edge."""
    socket = scene.socket
    assert socket is not None
    front, low = view.along(socket.place), view.above(-socket.depth)
    pitch = max(socket.pitch, 0.0055)
    columns = pitch * (np.arange(6) - 2.5)
    edge = float(columns[-1]) + 0.5 * pitch
    rear = front - 3.0 * pitch
    box(canvas, view, (-edge, edge), (rear, front), (-sizes.foot, low), PLATE)
    for row in (2.5, 1.5, 0.5):
        for x in columns.tolist():
            stud(canvas, view, view.at(x, front - row * pitch, low), -low, PLATE)


def _console(scene: Scene, view: View, canvas: Canvas, sizes: Proportions) -> None:
    """A console whose front is cut away, so that the slot and its contacts are seen."""
    socket = scene.socket
    assert socket is not None
    front, low = view.along(socket.place), view.above(-socket.depth)
    wide = scene.body.half_width + 0.0012
    edge = wide + 0.014
    rear = front - 2.0 * sizes.back - 0.008
    box(canvas, view, (-edge, edge), (rear, front), (-sizes.foot, 0.0), CONSOLE)
    rim = wide + 0.004
    section = [(-rim, front, -sizes.foot), (rim, front, -sizes.foot), (rim, front, 0.0),
               (-rim, front, 0.0)]  # fmt: skip
    canvas.polygon(view.path(section), CUT, dark(CONSOLE))
    for x in np.arange(-rim, rim, 0.0025).tolist():
        hatch = [(x, front, -sizes.foot), (min(x + sizes.foot, rim), front,
                 min(0.0, rim - x - sizes.foot))]  # fmt: skip
        canvas.line(view.path(hatch), dark(CUT, 0.3))
    opening = [(-wide, front, 0.0), (wide, front, 0.0), (wide, front - 2 * sizes.back, 0.0),
               (-wide, front - 2 * sizes.back, 0.0)]  # fmt: skip
    pit = [(-wide, front, low), (wide, front, low), (wide, front, 0.0), (-wide, front, 0.0)]
    canvas.polygon(view.path(opening), PIT)
    canvas.polygon(view.path(pit), PIT)
    for x in np.linspace(-0.6, 0.6, 6).tolist():
        at = x * scene.body.half_width
        canvas.line(view.path([(at, front, low), (at, front, 0.45 * low)]), PIN, 2)
    inner = [(-wide, front, 0.0), (-wide, front, low), (wide, front, low), (wide, front, 0.0)]
    canvas.line(view.path(inner), light(CUT, 0.5), 1.5)


def _vice(scene: Scene, sizes: Proportions, view: View, canvas: Canvas) -> None:
    """A bench vice that holds a stylus or a marker by its lower end."""
    half, foot = 0.86 * scene.body.half_width, sizes.foot
    box(canvas, view, (-half - 0.018, half + 0.018), (-0.012, 0.008), (-foot, -foot + 0.006), IRON)
    for side in (-1.0, 1.0):
        near, far = sorted((side * half, side * (half + 0.012)))
        box(canvas, view, (near, far), (-0.008, 0.004), (-foot + 0.006, -foot + 0.02), BRASS)
    rod = [(half + 0.012, 0.0, -foot + 0.013), (half + 0.03, 0.0, -foot + 0.013)]
    bar = [(half + 0.03, 0.0, -foot + 0.006), (half + 0.03, 0.0, -foot + 0.02)]
    for part, thick in ((rod, 0.0018), (bar, 0.0012)):
        ends = view.path(part)
        canvas.capsule((ends[0], ends[1]), (thick * view.scale,) * 2, IRON, dark(IRON))
