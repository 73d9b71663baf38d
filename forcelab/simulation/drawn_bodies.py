"""The bodies as they are drawn: brick, cartridge, stylus, marker and foam block."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from types import SimpleNamespace

import numpy as np

from forcelab.simulation.canvas import Canvas, Colour, Points, colour, dark, light
from forcelab.simulation.projection import Pose, Proportions, View
from forcelab.simulation.scene import Profile, Scene, Shape, width_at

#: Draws a body: scene, sizes, view, pose, and the canvas.
Drawing = Callable[[Scene, Proportions, View, Pose, Canvas], None]

WHITE = colour("ffffff")
RED = colour("d63a2f")
GREY = colour("a9adb3")
LABEL = colour("2f5fa8")
GOLD = colour("d9a736")
INK = colour("34466e")
STEEL = colour("c9ced6")
BARREL = colour("f3f2ee")
CAP = colour("6a4c93")
FOAM = colour("f2c14e")
PORE = colour("d39a2c")
#: Stripes around the marker's cap, and how much of a turn, rad, each of them takes.
STRIPES, STRIPE = 9, 0.3
#: Places of the foam's pores, shares of half width and height, spread by the golden ratio.
PORES = np.column_stack(
    [1.84 * (np.arange(1, 56) * 0.6180339887 % 1.0) - 0.92, np.linspace(0.066, 0.934, 55)]
)


def box(
    canvas: Canvas,
    view: View,
    x: tuple[float, float],
    y: tuple[float, float],
    z: tuple[float, float],
    paint: Colour,
) -> None:
    """A box whose front face, top and left side are seen."""
    (left, right), (rear, front), (low, high) = x, y, z
    edge = dark(paint)
    side = [(left, front, low), (left, front, high), (left, rear, high), (left, rear, low)]
    top = [(left, front, high), (right, front, high), (right, rear, high), (left, rear, high)]
    face = [(left, front, low), (right, front, low), (right, front, high), (left, front, high)]
    canvas.polygon(view.path(side), dark(paint, 0.25), edge)
    canvas.polygon(view.path(top), light(paint), edge)
    canvas.polygon(view.path(face), paint, edge)


def stud(canvas: Canvas, view: View, foot: Points, height: float, paint: Colour) -> None:
    """A LEGO stud that stands on a pixel."""
    radius = 0.0024 * view.scale
    flat = 0.5 * radius
    head = foot - (0.0, height * view.scale)
    edge = dark(paint)
    sides = np.array([(-radius, 0.0), (-radius, 0.0), (radius, 0.0), (radius, 0.0)])
    wall = np.array([foot, head, head, foot]) + sides
    canvas.disc(foot, (radius, flat), paint, edge)
    canvas.polygon(wall, paint)
    canvas.line(wall[:2], edge)
    canvas.line(wall[2:], edge)
    canvas.disc(head, (radius, flat), light(paint), edge)


def _brick(scene: Scene, sizes: Proportions, view: View, pose: Pose, canvas: Canvas) -> None:
    """A LEGO brick with two by two studs."""
    half, height = scene.body.half_width, sizes.height
    x, y, z, _ = pose.body
    box(canvas, view, (x - half, x + half), (y - 2 * sizes.back, y), (z, z + height), RED)
    for back in (1.5, 0.5):
        for side in (-0.5, 0.5):
            foot = view.at(x + side * half, y - back * sizes.back, z + height)
            stud(canvas, view, foot, 0.0017, RED)
    shine = [(x - 0.86 * half, y, z + 0.88 * height), (x + 0.2 * half, y, z + 0.88 * height)]
    canvas.line(view.path(shine), light(RED, 0.5), 2)


def _cartridge(scene: Scene, sizes: Proportions, view: View, pose: Pose, canvas: Canvas) -> None:
    """A game cartridge with a label, ribs and the gold contacts of its board."""
    half, height = scene.body.half_width, sizes.height
    x, y, z, _ = pose.body

    def face(points: list[tuple[float, float]]) -> Points:
        """Pixels of places on the front face: shares of half width and height."""
        return view.path([(x + across * half, y, z + up * height) for across, up in points])

    box(canvas, view, (x - half, x + half), (y - 2 * sizes.back, y), (z, z + height), GREY)
    canvas.polygon(
        face([(-0.78, 0.42), (0.78, 0.42), (0.78, 0.9), (-0.78, 0.9)]), LABEL, dark(LABEL)
    )
    canvas.polygon(face([(-0.78, 0.42), (0.78, 0.42), (0.78, 0.56)]), GOLD)
    canvas.disc(face([(0.0, 0.72)])[0], (0.3 * half * view.scale,) * 2, WHITE)
    for up in (0.26, 0.32):
        canvas.line(face([(-0.6, up), (0.6, up)]), dark(GREY, 0.3))
    canvas.polygon(face([(-0.72, 0.0), (0.72, 0.0), (0.72, 0.13), (-0.72, 0.13)]), dark(GREY, 0.65))
    for across in np.linspace(-0.6, 0.6, 6).tolist():
        canvas.line(face([(across, 0.015), (across, 0.1)]), GOLD, 2)


@lru_cache(maxsize=8)
def _outline(half: float, profile: Profile, low: float) -> tuple[Points, Points]:
    """A stylus from below the first grip to its tip: heights (n,) and half widths (2, n), m."""
    heights = np.linspace(low, profile.end + profile.taper, 180)
    numbers = {name: np.array([number]) for name, number in vars(profile).items()}
    return heights, width_at(heights, np.array([half]), SimpleNamespace(**numbers)).half


def _stylus(scene: Scene, sizes: Proportions, view: View, pose: Pose, canvas: Canvas) -> None:
    """A stylus that stands upright: its true width, rings to see motion by, and a tip."""
    profile = scene.profile
    assert profile is not None
    heights, widths = _outline(scene.body.half_width, profile, -sizes.foot + 0.006)
    s, foot = view.scale, view.at(*pose.body[:3])
    end = float(heights[-1]) - profile.taper
    rings = view.climbed(np.arange(-0.0225, end - 0.001, 0.005))
    heights, end = view.climbed(heights), float(view.climbed(np.array(end)))

    def bar(low: float, high: float, paint: Colour) -> None:
        inner = heights[(heights > low) & (heights < high)]
        ups = np.concatenate([[low], inner, [high]])
        left = foot + s * np.column_stack([-np.interp(ups, heights, widths[0]), -ups])
        right = foot + s * np.column_stack([np.interp(ups, heights, widths[1]), -ups])
        canvas.polygon(np.concatenate([right, left[::-1]]), paint)
        canvas.line(right, dark(paint))
        canvas.line(left, dark(paint))

    bar(float(heights[0]), end, INK)
    bar(end, float(heights[-1]), STEEL)
    for height in rings.tolist():
        bar(height, height + 0.0006, light(INK, 0.65))
    shine = np.column_stack([-0.45 * widths[0], -heights])[heights < 0.97 * end]
    canvas.line(foot + s * shine, light(INK, 0.4), 2)


def _marker(scene: Scene, sizes: Proportions, view: View, pose: Pose, canvas: Canvas) -> None:
    """A marker that stands upright, its cap striped so that one sees it turn."""
    half = scene.body.half_width
    x, y, z, turned = pose.body
    middle = view.at(x, y, z)
    s = view.scale
    rim, flat = 1.3 * half, 0.3 * half

    def band(radius: float, low: float, high: float, paint: Colour) -> None:
        """A stretch of a cylinder without its top."""
        wall = np.array([(-radius, -low), (-radius, -high), (radius, -high), (radius, -low)])
        canvas.disc(middle - (0.0, s * low), (s * radius, s * flat), paint, dark(paint))
        canvas.polygon(middle + s * wall, paint)
        canvas.line(middle + s * wall[:2], dark(paint))
        canvas.line(middle + s * wall[2:], dark(paint))

    band(0.86 * half, -sizes.foot + 0.006, -rim, BARREL)
    band(0.86 * half, -sizes.foot + 0.022, -rim - 0.0075, INK)
    band(0.9 * half, -rim - 0.006, -rim - 0.002, CAP)
    band(half, -rim, rim, CAP)
    turn = turned + 2.0 * np.pi / STRIPES * np.arange(STRIPES)
    # Angles run from the right (0) over the front to the left (pi), as those of the tongs do.
    first = (turn + STRIPE) % (2.0 * np.pi) - STRIPE
    for start, end in zip(np.maximum(first, 0.0), np.minimum(first + STRIPE, np.pi), strict=True):
        if start < end:
            angles = np.array([start, end, end, start])
            heights = flat * np.sin(angles) + (rim, rim, -rim, -rim)
            corners = np.column_stack([half * np.cos(angles), heights])
            canvas.polygon(middle + s * corners, light(CAP, 0.75))
    canvas.disc(middle - (0.0, s * rim), (s * half, s * flat), light(CAP), dark(CAP))
    spoke = 0.85 * np.array([half * np.cos(turned), flat * np.sin(turned)])
    canvas.line(middle - (0.0, s * rim) + s * np.array([(0.0, 0.0), spoke]), dark(CAP), 2)


def _block(scene: Scene, sizes: Proportions, view: View, pose: Pose, canvas: Canvas) -> None:
    """A foam block: its sides give way under the jaws, and its pores crowd together."""
    half, height = scene.body.half_width, sizes.height
    x, y, z, _ = pose.body
    # The jaws press where the tongs are, on a body that may be lower by what it slipped.
    grip = pose.tongs[1] - z
    most = 0.9 * half
    dents = (
        float(np.clip(half - pose.jaws[0] - x, 0.0, most)),
        float(np.clip(half - pose.jaws[1] + x, 0.0, most)),
    )
    s, foot = view.scale, view.at(x, y, z)

    def reach(heights: Points, side: int) -> Points:
        """Half width at heights above the lower face, on the left (0) or the right (1)."""
        away = np.abs(heights - grip) - 0.8 * sizes.dome
        press = np.exp(-((np.clip(away, 0.0, None) / (0.9 * sizes.dome)) ** 2))
        return half - dents[side] * press

    heights = np.linspace(0.0, height, 25)
    left = foot + s * np.column_stack([-reach(heights, 0), -heights])
    right = foot + s * np.column_stack([reach(heights, 1), -heights])
    shift = view.at(0.0, -2.0 * sizes.back, 0.0) - view.at(0.0, 0.0, 0.0)
    canvas.polygon(np.concatenate([left, left[::-1] + shift]), dark(FOAM, 0.22))
    top = np.array([left[-1], right[-1], right[-1] + shift, left[-1] + shift])
    canvas.polygon(top, light(FOAM), dark(FOAM))
    canvas.polygon(np.concatenate([left, right[::-1]]), FOAM, dark(FOAM))
    across, up = PORES[:, 0], PORES[:, 1] * height
    widths = np.where(across < 0.0, reach(up, 0), reach(up, 1))
    canvas.dots(foot + s * np.column_stack([across * widths, -up]), 0.0006 * s, PORE)


DRAWINGS: dict[Shape, Drawing] = {
    "brick": _brick,
    "cartridge": _cartridge,
    "stylus": _stylus,
    "marker": _marker,
    "block": _block,
}
