"""The video of a simulated demonstration: a clean front view, drawn from the motion.

It is a drawing, not a measurement. So that a stranger recognises what is done, some of it is larger
or smaller than life:

* What moves by less than a millimetre is exaggerated: a dome under pressure is flattened by up to
  a third of its radius, and leans by 0.7 mm for each newton that drags at it, at most by as much
  as its radius. A stylus rises in its vice four times as far as it does, and the hand turns ahead
  of the tongs by 0.05 rad for each newton with which their domes twist.
* Domes that slide along a body leave short streaks behind.
* A stylus's thick end is stretched 14 times where the domes climb it, and its tip is shortened.
* A body that stands on the rim beside its socket leans by up to 8 degrees, and strokes along y
  there are 2.5 times as long as they are.
* Depths in a socket are stretched to at least 4.5 mm, and a console's front is cut away.
* Lengths along y far from the socket, and heights above the table or beyond a stylus's tip, are
  shortened: they grow as the inverse hyperbolic sine does.
* Bricks and cartridges are drawn no taller, and blocks less deep, than makes them recognised.
* A tap has rays that fade for a tenth of a second.

Jaws, tongs and body are otherwise where the motion has them, at the true instant of each frame.
Nothing in the picture names the action.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from forcelab.arrays import Real
from forcelab.clock import ClockMap
from forcelab.errors import InputError
from forcelab.simulation.mechanics import width_at
from forcelab.simulation.scene import Performance, Profile, Scene, Shape, Socket
from forcelab.video.codecs import opencv

#: Seconds over which a frame's forces are averaged, as a camera's shutter does.
EXPOSURE = 0.012


@dataclass(frozen=True)
class State:
    jaws: tuple[float, ...]  # distance of the left and the right jaw from the tongs' middle, m
    tongs: tuple[float, ...]  # y (m), z (m) and angle (rad)
    body: tuple[float, ...]  # x, y, z (m) and angle (rad)
    normal: tuple[float, ...]  # what presses on the left and on the right jaw, N
    drag: tuple[float, ...]  # force on both domes together along y and z, N
    #: Force along y on the left dome less that on the right one, N: what a twist makes of it.
    torsion: float
    sliding: float  # how fast the tongs rise along the body, m/s


class States:
    """The states of a performance at any time; it rests before its start and after its end."""

    def __init__(self, performance: Performance) -> None:
        motion, forces = performance.motion, performance.forces
        self.times = motion.times
        self.tracks = np.column_stack([motion.jaws, motion.tongs, motion.body])
        drag = np.column_stack([forces[:, 0] + forces[:, 3], forces[:, 1] + forces[:, 4]])
        torsion = forces[:, 0] - forces[:, 3]
        forces = np.column_stack([motion.normal, drag, torsion])
        self.risen = motion.tongs[:, 1] - motion.body[:, 2]
        # The mean over a shutter's time is a difference of the running sum.
        self.sums = np.concatenate([np.zeros((1, 5)), np.cumsum(forces, axis=0)])
        self.step = float(self.times[1] - self.times[0])

    def at(self, time: float) -> State:
        """The state at a time on the force clock, s."""
        last = len(self.times) - 1
        place = float(np.clip((time - self.times[0]) / self.step, 0.0, last))
        row = min(int(place), last - 1)
        part = place - row
        track = ((1.0 - part) * self.tracks[row] + part * self.tracks[row + 1]).tolist()
        half = max(1, round(0.5 * EXPOSURE / self.step))
        first, end = max(row - half, 0), min(row + half + 1, last + 1)
        forces = ((self.sums[end] - self.sums[first]) / (end - first)).tolist()
        climbed = float(self.risen[end - 1] - self.risen[first])
        return State(
            jaws=tuple(track[:2]),
            tongs=tuple(track[2:5]),
            body=tuple(track[5:]),
            normal=tuple(forces[:2]),
            drag=tuple(forces[2:4]),
            torsion=forces[4],
            sliding=climbed / max((end - 1 - first) * self.step, self.step),
        )


Image = NDArray[np.uint8]
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


class Canvas:
    """Shapes on an image, anti-aliased to a sixteenth of a pixel.

    `image` (height, width, 3): what is drawn on; `zoom`: pixels of the image per pixel of line
    widths.
    """

    def __init__(self, image: Image, zoom: float = 1.0) -> None:
        self.image = image
        self.zoom = zoom

    def polygon(self, points: Real, fill: Colour, edge: Colour | None = None) -> None:
        """A filled polygon, shape (n, 2) in pixels, with a line around it where asked for."""
        corners = [_fixed(points)]
        cv2.fillPoly(self.image, corners, fill, cv2.LINE_AA, SHIFT)
        if edge is not None:
            cv2.polylines(self.image, corners, True, edge, self._width(1.0), cv2.LINE_AA, SHIFT)

    def hull(self, points: Real, fill: Colour, edge: Colour) -> None:
        """The convex hull of points, shape (n, 2) in pixels."""
        corners = [cv2.convexHull(_fixed(points))]
        cv2.fillPoly(self.image, corners, fill, cv2.LINE_AA, SHIFT)
        cv2.polylines(self.image, corners, True, edge, self._width(1.0), cv2.LINE_AA, SHIFT)

    def line(self, points: Real, paint: Colour, width: float = 1.0) -> None:
        """An open line through points, shape (n, 2) in pixels."""
        corners = [_fixed(points)]
        cv2.polylines(self.image, corners, False, paint, self._width(width), cv2.LINE_AA, SHIFT)

    def disc(
        self,
        centre: Real,
        radii: tuple[float, float],
        fill: Colour,
        edge: Colour | None = None,
    ) -> None:
        """A filled ellipse with its axes along the image's."""
        self.polygon(centre + CIRCLE * radii, fill, edge)

    def capsule(
        self,
        ends: tuple[Real, Real],
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

    def dots(self, centres: Real, radius: float, fill: Colour) -> None:
        """Small discs of one size, centres of shape (n, 2)."""
        size = max(1, round(radius * (1 << SHIFT)))
        for u, v in _fixed(centres).tolist():
            cv2.circle(self.image, (u, v), size, fill, -1, cv2.LINE_AA, SHIFT)

    def _width(self, width: float) -> int:
        """The width of a line in whole pixels of the image."""
        return max(1, round(width * self.zoom))


#: How far right and down on the picture a metre along y, towards the viewer, goes: where things
#: are carried, and where they turn, which is seen best from above.
ASIDE = (0.66, 0.3)
FACING = (0.1, 0.36)
#: Distances along y from the socket, and heights above the table, are shortened beyond about these
#: lengths, m: carrying takes less room than searching deserves.
NEAR = 0.012
LOW = 0.010
#: By how much strokes close to the socket are drawn too long.
STROKE = 2.5
#: The part of a stylus's rim on which the domes climb, in rim lengths below its end; by how much
#: it is stretched; and by how much the tip beyond is shortened.
CLIMB = (1.05, 0.4)
STRETCH = 14.0
TIP = 0.4
#: Heights beyond the tip are shortened from about this length on, m.
FREE = 0.004
#: Least drawn depth of a socket, m: of a brick's 2 mm one would see little.
SINK = 0.0045
#: Greatest drawn height over the half width: a cartridge is told from a stick by its proportions.
TALLEST: dict[Shape, float] = {"brick": 1.2, "cartridge": 3.2}
#: From the top of the body to the tongs' hinge, m.
CLEAR = 0.0145
#: Largest number of pixels a metre, for a picture 360 pixels high.
CLOSEST = 7000.0


@dataclass(frozen=True)
class Proportions:
    """Sizes of what is drawn that the mechanics do not know, m."""

    #: Where the jaws touch the body, above its lower face; with a holder, above the place of the
    #: first grip.
    grip: float
    dome: float  # radius of a sensor's dome
    reach: float  # from the domes up to the tongs' hinge
    back: float  # how far the body reaches away from the viewer
    foot: float  # from the body's lower face, or the place of the first grip, down to the table
    height: float  # of the body; with a holder, of what of it is above the place of the first grip

    @classmethod
    def of(cls, scene: Scene) -> Proportions:
        """The proportions that suit a scene."""
        body = scene.body
        half = body.half_width
        dome = float(np.clip(0.3 * half, 0.0045, 0.0065))
        if scene.holder is not None:
            if scene.profile is None:
                return cls(0.0, dome, 1.3 * half + CLEAR, half, 1.3 * half + 0.034, 1.3 * half)
            tip = np.array(scene.profile.end + scene.profile.taper)
            above = float(drawn_height(tip, scene.profile))
            return cls(0.0, dome, above + 0.7 * CLEAR, half, 0.038, above)
        height = min(body.height, TALLEST.get(body.shape, np.inf) * half)
        grip = max(0.55 * height, dome)
        foot = max(scene.socket.depth, SINK) + 0.004 if scene.socket else 0.0
        back = min(half, 0.005 if body.shape == "block" else 0.009)
        return cls(grip, dome, height - grip + CLEAR, back, foot, height)


def drawn_height(up: Real, profile: Profile) -> Real:
    """How far above the first grip heights of a stylus are drawn, m: rising and without jumps.

    The rim is stretched, for over it the domes go slowly, the tip is shortened, and so is what is
    beyond it, where the domes are free.
    """
    end, tip = profile.end, profile.end + profile.taper
    first, last = (end - share * profile.rim_length for share in CLIMB)
    inner = np.minimum(up, tip)
    stretched = (STRETCH - 1.0) * np.clip(inner - first, 0.0, last - first)
    shortened = (1.0 - TIP) * np.clip(inner - end, 0.0, None)
    beyond = FREE * np.arcsinh(np.clip(up - tip, 0.0, None) / FREE)
    drawn: Real = inner + stretched - shortened + beyond
    return drawn


@dataclass(frozen=True)
class View:
    """A parallel projection: x to the right, z up, y to the lower right, towards the viewer."""

    scale: float  # pixels a metre
    #: Pixel, from the left and from the top, of x = y = z = 0 of the stage.
    origin: tuple[float, float]
    place: float  # y around which distances are drawn in full, m
    ground: bool  # whether there is a table under z = 0, so that heights are shortened
    sink: float  # by how much depths below z = 0 are stretched
    depth: tuple[float, float]  # how far right and down a metre along y goes, as shares of a metre
    profile: Profile | None = None  # of a body along which heights are drawn
    tilt: float = 0.0  # by how much what is seen is turned to the right, rad
    pivot: tuple[float, float] = (0.0, 0.0)  # pixel about which it is turned

    @classmethod
    def fitted(cls, performance: Performance, sizes: Proportions, size: tuple[int, int]) -> View:
        """The view in which the whole motion is seen as large as it goes.

        `size`: width and height of the picture, pixels.
        """
        scene, motion = performance.scene, performance.motion
        socket = scene.socket
        raw = cls(
            scale=1.0,
            origin=(0.0, 0.0),
            place=socket.place if socket else 0.0,
            ground=scene.holder is None,
            sink=max(1.0, SINK / socket.depth) if socket and socket.depth > 0 else 1.0,
            depth=FACING if scene.thread else ASIDE,
            profile=scene.profile,
        )
        ys = [raw.along(float(y)) for y in (motion.tongs[:, 0].min(), motion.tongs[:, 0].max())]
        zs = [raw.above(float(z)) for z in (motion.tongs[:, 1].min(), motion.tongs[:, 1].max())]
        if socket:
            ys.append(raw.along(socket.place))
        wide = max(float(motion.jaws.max()), scene.body.half_width) + 2.2 * sizes.dome + 0.006
        left, right = -wide + raw.depth[0] * min(ys), wide + raw.depth[0] * max(ys)
        down = sizes.grip + sizes.reach + 0.012
        if raw.ground:
            # The hand is seen while the tongs are down; lifted highest, the domes and the body are.
            lifted = max(zs) + max(sizes.grip + sizes.dome, sizes.height + 0.006) + 0.01
        else:
            # They stay up there until the end: the hand is always seen.
            lifted = max(zs) + sizes.reach + 0.018
        top = max(down, lifted) - raw.depth[1] * min(ys)
        bottom = -sizes.foot - raw.depth[1] * max(ys) - 0.006
        width, height = size
        scale = min(
            CLOSEST * height / 360, 0.92 * width / (right - left), 0.97 * height / (top - bottom)
        )
        centre = (0.5 * width - scale * 0.5 * (left + right), 0.985 * height + scale * bottom)
        return replace(raw, scale=scale, origin=centre)

    def along(self, y: float) -> float:
        """Where a y of the motion is on the stage, m: stretched near the socket, less far off."""
        if not self.ground:
            return y
        return self._aside(y) - self._aside(0.0)

    def above(self, z: float) -> float:
        """Where a z of the motion is on the stage, m: shortened high up, stretched in a socket."""
        if not self.ground:
            return float(self.climbed(np.array(z)))
        return LOW * float(np.arcsinh(z / LOW)) if z >= 0 else self.sink * z

    def climbed(self, up: Real) -> Real:
        """Where heights along a body in a holder are on the stage, m, above the first grip."""
        return up if self.profile is None else drawn_height(up, self.profile)

    def at(self, x: float, y: float, z: float) -> Real:
        """Pixel of a place on the stage, shape (2,)."""
        right = self.origin[0] + self.scale * (x + self.depth[0] * y)
        down = self.origin[1] - self.scale * (z - self.depth[1] * y)
        if self.tilt != 0.0:
            cos, sin = np.cos(self.tilt), np.sin(self.tilt)
            u, v = right - self.pivot[0], down - self.pivot[1]
            right = self.pivot[0] + cos * u - sin * v
            down = self.pivot[1] + sin * u + cos * v
        return np.array([right, down])

    def way(self, x: float, y: float, z: float) -> Real:
        """How far right and down a way on the stage goes, pixels, shape (2,)."""
        return self.at(x, y, z) - self.at(0.0, 0.0, 0.0)

    def path(self, places: list[tuple[float, float, float]]) -> Real:
        """Pixels of places on the stage, shape (n, 2)."""
        return np.array([self.at(*place) for place in places])

    def zoomed(self, factor: float) -> View:
        """The same view on a picture `factor` times as large."""
        left, top = self.origin
        return replace(self, scale=self.scale * factor, origin=(left * factor, top * factor))

    def tilted(self, tilt: float, pivot: Real) -> View:
        """The same view, turned to the right by an angle about a pixel."""
        return replace(self, tilt=tilt, pivot=(float(pivot[0]), float(pivot[1])))

    def _aside(self, y: float) -> float:
        """How far from the socket a y is drawn, m."""
        stroke = STROKE * (y - self.place) / NEAR
        return NEAR * float(np.arcsinh(stroke))


#: A body in a holder is drawn that many times as far from its place as it is.
STRAIN = 4.0
#: How far the hand turns ahead of the tongs, rad for each newton of torsion.
LEAD = 0.05
#: Greatest tilt of a body that feels for its socket, rad.
TILT = 0.14
#: By what share it leans less half way between two places where it catches, and their distance, m.
ROCKING, ROCKING_PERIOD = 0.4, 0.003
#: How far from its place it is tilted by three quarters of that, m; up to where at all, m; and how
#: high over the socket's rim, and how deep below it, it is upright again, m.
TILT_OFFSET, TILT_REACH, TILT_ABOVE, TILT_BELOW = 0.0012, 0.016, 0.0012, 0.0006


@dataclass(frozen=True)
class Pose:
    """What is where on the stage: lengths in m of the picture, not of the motion."""

    tongs: tuple[float, float, float]  # y and z of the place between the domes, and the angle, rad
    body: tuple[float, float, float, float]  # x, y, z and angle, rad
    jaws: tuple[float, ...]  # distance of the left and the right jaw from the tongs' middle
    tilt: float  # by how much the body leans to the right, rad, about the place between the domes
    lead: float = 0.0  # by how much the hand has turned further than the arms that it twists, rad
    #: Whether the domes press on the middle of the body's sides, so that it hides the right one.
    inside: bool = False


def pose_of(scene: Scene, sizes: Proportions, view: View, state: State) -> Pose:
    """The pose in which a state is drawn."""
    y, z, angle = state.tongs
    x, body_y, body_z, turn = state.body
    if scene.holder is not None:
        risen = STRAIN * body_z
        up = risen + float(view.climbed(np.array(z - body_z)))
        lead = LEAD * state.torsion if scene.thread is not None else 0.0
        return Pose((y, up, angle), (x, body_y, risen, turn), state.jaws, 0.0, lead)
    tilt = _tilt(scene.socket, body_y, body_z) if scene.socket is not None else 0.0
    # What is tilted rests on its lower corner.
    lift = scene.body.half_width * abs(float(np.sin(tilt)))
    # The domes press on the middle of a block's sides; of flat bodies one sees no difference.
    inner = sizes.back if scene.body.shape == "block" else 0.0
    return Pose(
        (view.along(y) - inner, view.above(z) + lift + sizes.grip, angle),
        (x, view.along(body_y), view.above(body_z) + lift, turn),
        state.jaws,
        tilt,
        inside=inner > 0.0,
    )


def _tilt(socket: Socket, y: float, z: float) -> float:
    """How far a body leans that stands on a socket's rim beside its place, rad."""
    away = y - socket.place
    near = float(np.clip(2.0 - 2.0 * abs(away) / TILT_REACH, 0.0, 1.0))
    low = float(np.clip(1.0 - z / TILT_ABOVE if z > 0.0 else 1.0 + z / TILT_BELOW, 0.0, 1.0))
    rocking = 1.0 - ROCKING * (0.5 - 0.5 * np.cos(2.0 * np.pi * away / ROCKING_PERIOD))
    return TILT * near * low * float(rocking * np.tanh(away / TILT_OFFSET))


DOME = colour("119da4")
DOME_EDGE = colour("0a5a5e")
DOME_SHINE = colour("7fd6da")
HOUSING = colour("d5d9df")
ARM = colour("3c4250")
ARM_EDGE = colour("20242d")
SKIN = colour("e3b18c")
SKIN_EDGE = colour("a8734f")
NAIL = colour("f3d6c2")
SLEEVE = colour("5b7da6")
SLEEVE_EDGE = colour("3d5067")
SPARK = colour("ffd21f")
SPARK_EDGE = colour("3a2b00")
STREAK = colour("0f5c73")

#: Newtons at which a dome is flattened by two thirds of what it can be; and how far, as a share
#: of its radius. Real silicone gives less than a millimetre, which could not be seen.
SOFTNESS = 5.0
FLATTENING = 0.38
#: How far a dome leans at first, m, for each newton that drags at both, and at most, as a share of
#: its radius. Real ones lean by a fifth of that and less.
LEANING = 6.6e-4
LEANING_MOST = 1.05
#: Tongs that go along the body faster than this, m/s, leave streaks if they press on it, N.
STREAK_SPEED, STREAK_GRIP = 0.008, 0.15
#: Seconds in which the tapping finger comes and goes, and how far it comes from, m.
TAP_APPROACH, TAP_DISTANCE = 0.28, 0.06
#: Seconds for which it stays on the dome, before and after the middle of the tap.
TAP_CONTACT = 0.018
#: Seconds for which the tap's rays are seen, fading: three frames.
TAP_RAYS = 0.1


class Tongs:
    """The tongs of one instant, to be drawn part by part between other things."""

    def __init__(self, sizes: Proportions, view: View, state: State, pose: Pose) -> None:
        self.sizes = sizes
        self.view = view
        y, z, angle = pose.tongs
        turn = np.array([np.cos(angle), np.sin(angle)])
        axis, across = view.way(turn[0], turn[1], 0.0), view.way(-turn[1], turn[0], 0.0)
        #: How wide the round sensors are seen, as a share of their radius: 0 from the side.
        self.breadth = abs(float(turn[1]))
        middle = view.at(0.0, y, z)
        most = LEANING_MOST * sizes.dome
        lean = most * np.tanh(-LEANING * np.array(state.drag) / most)
        # The hand runs ahead of the domes that the body holds back.
        drag = view.way(0.0, lean[0], lean[1])
        twist = most * float(np.tanh(2.0 * LEANING * pose.lead / LEAD / most)) * across
        self.leans = [drag - twist, drag + twist]
        self.hinge = middle + 1.6 * drag - (0.0, view.scale * sizes.reach)
        self.heading = angle + pose.lead
        self.inward = [axis, -axis]
        self.contacts = [middle - axis * state.jaws[0], middle + axis * state.jaws[1]]
        self.pressed = [1.0 - float(np.exp(-max(n, 0.0) / SOFTNESS)) for n in state.normal]
        self.sliding = state.sliding if min(state.normal) > STREAK_GRIP else 0.0
        self.feet = [self._base(side) - 0.0042 * self.inward[side] for side in (0, 1)]
        down = 0.009 * view.scale
        self.knees = [
            np.array([foot[0], self.hinge[1] + down + (contact - middle)[1]])
            for foot, contact in zip(self.feet, self.contacts, strict=True)
        ]
        #: Whether the left and the right jaw are further off than the body.
        self.behind = [turn[1] > 0.15, turn[1] < -0.15 or pose.inside]

    def jaw(self, side: int, canvas: Canvas) -> None:
        """One jaw: its arm, the sensor's housing and its dome. 0 is the left one."""
        s = self.view.scale
        r = self.sizes.dome
        inward, up = self.inward[side], np.array([0.0, -s])
        flat = FLATTENING * r * self.pressed[side]
        bulge = 0.95 * r - flat
        base, foot, knee = self._base(side), self.feet[side], self.knees[side]
        top = self.hinge - 0.0028 * inward
        self._arm(canvas, [foot - 1.1 * r * up, knee, top])
        angles = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 17)
        out = np.minimum(np.cos(angles) * (bulge + 0.6 * flat), bulge)
        high = np.sin(angles) * (0.82 * r + 0.25 * flat)
        share = (out / bulge)[:, None]
        rim = base + out[:, None] * inward + high[:, None] * up - share * self.leans[side]
        disc = CIRCLE * (0.92 * r * s) * (self.breadth, 1.0)
        canvas.hull(np.concatenate([base + disc, base + disc - 0.003 * inward]), HOUSING, ARM_EDGE)
        canvas.hull(np.concatenate([rim, base + 0.88 * disc]), DOME, DOME_EDGE)
        shine = base + 0.3 * bulge * inward + np.linspace(0.15, 0.55, 3)[:, None] * r * up
        canvas.line(shine, DOME_SHINE, 2)
        if inward[1] < -0.2 * s:  # it turns its back to the viewer
            canvas.hull(base + disc - 0.003 * inward, HOUSING, ARM_EDGE)
            self._arm(canvas, [foot - 1.1 * r * up, knee, top])

    def streaks(self, canvas: Canvas) -> None:
        """Short lines behind the domes while they slide along the body."""
        if abs(self.sliding) < STREAK_SPEED:
            return
        s, r = self.view.scale, self.sizes.dome
        back = float(np.sign(self.sliding)) * s
        long = 0.004 + min(0.1 * abs(self.sliding), 0.006)
        for contact, inward in zip(self.contacts, self.inward, strict=True):
            for aside, share in ((0.0009, 1.0), (0.0029, 0.75), (0.0049, 0.5)):
                start = contact - aside * inward + (0.0, (0.95 * r + 0.0008) * back)
                canvas.line(start + np.array([(0.0, 0.0), (0.0, share * long * back)]), STREAK, 2)

    def hand(self, canvas: Canvas) -> None:
        """What of the hand is behind the tongs: forearm, palm and the fingers on the far side."""
        s, hinge = self.view.scale, self.hinge
        wrist = hinge + s * np.array([0.024, -0.024])
        elbow, cuff, far = (hinge + s * np.array([d, -d]) for d in (0.1, 0.038, 0.12))
        palm = hinge + s * np.array([0.002, -0.006])
        canvas.capsule((wrist, elbow), (0.011 * s, 0.013 * s), SKIN, SKIN_EDGE)
        canvas.capsule((cuff, far), (0.0145 * s, 0.018 * s), SLEEVE, SLEEVE_EDGE)
        self._grip(canvas, behind=True)
        canvas.capsule((palm, wrist), (0.0125 * s, 0.0125 * s), SKIN, SKIN_EDGE)

    def fingers(self, canvas: Canvas) -> None:
        """What of the hand is before the tongs: thumb and fingers on the arms, and the hinge."""
        s, hinge = self.view.scale, self.hinge
        canvas.disc(hinge, (0.0042 * s, 0.0042 * s), HOUSING, ARM_EDGE)
        canvas.disc(hinge, (0.0014 * s, 0.0014 * s), ARM_EDGE)
        self._grip(canvas, behind=False)

    def tapping(self, since: float, canvas: Canvas) -> None:
        """A fingertip of the other hand on the left dome, or on its way to it.

        `since`: seconds since the tap's middle, negative before it.
        """
        away = abs(since)
        if away >= TAP_APPROACH:
            return
        s = self.view.scale
        path = np.array([0.64, 0.77])
        distance = (
            TAP_DISTANCE * (max(0.0, away - TAP_CONTACT) / (TAP_APPROACH - TAP_CONTACT)) ** 1.5
        )
        radius = 0.0046 * s
        tip = self.contacts[0] + np.array([radius, 0.0]) + s * distance * path
        knuckle, fist = tip + 0.03 * s * path, tip + 0.045 * s * path
        side = s * np.array([0.77, -0.64])
        canvas.capsule((fist, fist + 0.2 * s * path), (0.012 * s, 0.013 * s), SKIN, SKIN_EDGE)
        cuff = fist + 0.03 * s * path
        canvas.capsule((cuff, cuff + 0.2 * s * path), (0.0155 * s, 0.018 * s), SLEEVE, SLEEVE_EDGE)
        canvas.disc(fist, (0.0145 * s, 0.0145 * s), SKIN, SKIN_EDGE)
        for aside in (0.0095, 0.0015):
            bent = knuckle + aside * side
            canvas.capsule((bent, bent + 0.01 * s * path), (0.005 * s,) * 2, SKIN, SKIN_EDGE)
        root = knuckle - 0.0065 * side + 0.004 * s * path
        canvas.capsule((root, tip), (0.006 * s, radius), SKIN, SKIN_EDGE)
        nail = tip + s * np.array([0.0008, 0.0002])
        canvas.capsule((nail, nail + 0.005 * s * path), (0.0022 * s, 0.0026 * s), NAIL, SKIN_EDGE)
        if 0.0 <= since < TAP_RAYS:
            left = 1.0 - since / TAP_RAYS
            for angle in (0.9, 1.6, 2.3):
                ray = np.array([np.cos(angle), -np.sin(angle)])
                start = self.contacts[0] - (0.0, 0.0035 * s)
                line = start + s * np.outer([0.0095 - 0.006 * left, 0.0115], ray)
                canvas.line(line, SPARK_EDGE, 3.0 + 3.0 * left)
                canvas.line(line, SPARK, 1.0 + 3.0 * left)

    def _base(self, side: int) -> Real:
        """Where a dome begins: the middle of its round face on the housing."""
        r = self.sizes.dome
        bulge = (0.95 - FLATTENING * self.pressed[side]) * r
        base: Real = self.contacts[side] - bulge * self.inward[side] + self.leans[side]
        return base

    def _grip(self, canvas: Canvas, *, behind: bool) -> None:
        """Thumb and fingers, which go round with the arms that they hold."""
        s, hinge = self.view.scale, self.hinge
        round_off = self.view.way(np.cos(self.heading), np.sin(self.heading), 0.0)
        for side, knuckle, tip in (
            (1, (0.017, -0.004), (0.001, 0.0055)),
            (1, (0.012, -0.012), (-0.0015, -0.001)),
            (0, (-0.013, -0.009), (-0.0005, 0.002)),
        ):
            if self.behind[side] != behind:
                continue
            root = hinge + knuckle[0] * round_off + (0.0, knuckle[1] * s)
            end = self.knees[side] + s * np.array(tip)
            bend = 0.5 * (root + end) + 0.004 * np.sign(knuckle[0]) * round_off
            self._finger(canvas, [root, bend - (0.0, 0.001 * s), end], 0.0042 * s)

    def _arm(self, canvas: Canvas, spine: list[Real]) -> None:
        """An arm along three points: down, at the knee, at the hinge."""
        half = 0.0021 * self.view.scale
        foot, knee, top = spine
        side = half if foot[0] > self.hinge[0] else -half
        sides = [(side, 0.0), (side, 0.0), (0.4 * side, -half),
                 (-0.4 * side, half), (-side, 1.2 * half), (-side, 0.0)]  # fmt: skip
        outline = np.array([foot, knee, top, top, knee, foot]) + np.array(sides)
        canvas.polygon(outline, ARM, ARM_EDGE)

    def _finger(self, canvas: Canvas, joints: list[Real], radius: float) -> None:
        """A finger through three joints."""
        root, bend, tip = joints
        canvas.capsule((root, bend), (1.15 * radius, radius), SKIN, SKIN_EDGE)
        canvas.capsule((bend, tip), (radius, 0.85 * radius), SKIN, SKIN_EDGE)
        canvas.capsule((root, bend), (1.05 * radius, 0.9 * radius), SKIN)


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


def dark(paint: Colour, share: float = 0.45) -> Colour:
    """The shade of a colour in which edges are drawn."""
    return mix_colours(paint, colour("1a1d24"), share)


def light(paint: Colour, share: float = 0.35) -> Colour:
    """The tint of a colour on faces that the light falls on."""
    return mix_colours(paint, WHITE, share)


def upright(view: View, x: tuple[float, float], y: float, z: tuple[float, float]) -> Real:
    """Pixels of the corners of a rectangle that faces the viewer, shape (4, 2)."""
    (left, right), (low, high) = x, z
    return view.path([(left, y, low), (right, y, low), (right, y, high), (left, y, high)])


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
    canvas.polygon(view.path(side), dark(paint, 0.25), edge)
    canvas.polygon(view.path(top), light(paint), edge)
    canvas.polygon(upright(view, x, front, z), paint, edge)


def cylinder(
    canvas: Canvas, foot: Real, head: Real, radii: tuple[float, float], paint: Colour
) -> None:
    """An upright cylinder without its top, from pixel to pixel."""
    side, edge = np.array([radii[0], 0.0]), dark(paint)
    wall = np.array([foot - side, head - side, head + side, foot + side])
    canvas.disc(foot, radii, paint, edge)
    canvas.polygon(wall, paint)
    canvas.line(wall[:2], edge)
    canvas.line(wall[2:], edge)


def stud(canvas: Canvas, view: View, foot: Real, height: float, paint: Colour) -> None:
    """A LEGO stud that stands on a pixel."""
    radius = 0.0024 * view.scale
    head = foot - (0.0, height * view.scale)
    cylinder(canvas, foot, head, (radius, 0.5 * radius), paint)
    canvas.disc(head, (radius, 0.5 * radius), light(paint), dark(paint))


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

    def face(points: list[tuple[float, float]]) -> Real:
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
def _outline(half: float, profile: Profile, low: float) -> tuple[Real, Real]:
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
        foot, head = middle - (0.0, s * low), middle - (0.0, s * high)
        cylinder(canvas, foot, head, (s * radius, s * flat), paint)

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

    def reach(heights: Real, side: int) -> Real:
        """Half width at heights above the lower face, on the left (0) or the right (1)."""
        away = np.abs(heights - grip) - 0.8 * sizes.dome
        press = np.exp(-((np.clip(away, 0.0, None) / (0.9 * sizes.dome)) ** 2))
        return half - dents[side] * press

    heights = np.linspace(0.0, height, 25)
    left = foot + s * np.column_stack([-reach(heights, 0), -heights])
    right = foot + s * np.column_stack([reach(heights, 1), -heights])
    shift = view.way(0.0, -2.0 * sizes.back, 0.0)
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
            _base_plate(scene, sizes, large, canvas)
        else:
            _console(scene, sizes, large, canvas)
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


def _base_plate(scene: Scene, sizes: Proportions, view: View, canvas: Canvas) -> None:
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


def _console(scene: Scene, sizes: Proportions, view: View, canvas: Canvas) -> None:
    """A console whose front is cut away, so that the slot and its contacts are seen."""
    socket = scene.socket
    assert socket is not None
    front, low = view.along(socket.place), view.above(-socket.depth)
    wide = scene.body.half_width + 0.0012
    edge = wide + 0.014
    rear = front - 2.0 * sizes.back - 0.008
    box(canvas, view, (-edge, edge), (rear, front), (-sizes.foot, 0.0), CONSOLE)
    rim = wide + 0.004
    section = upright(view, (-rim, rim), front, (-sizes.foot, 0.0))
    canvas.polygon(section, CUT, dark(CONSOLE))
    for x in np.arange(-rim, rim, 0.0025).tolist():
        hatch = [(x, front, -sizes.foot), (min(x + sizes.foot, rim), front,
                 min(0.0, rim - x - sizes.foot))]  # fmt: skip
        canvas.line(view.path(hatch), dark(CUT, 0.3))
    opening = [(-wide, front, 0.0), (wide, front, 0.0), (wide, front - 2 * sizes.back, 0.0),
               (-wide, front - 2 * sizes.back, 0.0)]  # fmt: skip
    canvas.polygon(view.path(opening), PIT)
    canvas.polygon(upright(view, (-wide, wide), front, (low, 0.0)), PIT)
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


#: Nominal frames a second, as the file states them.
RATE = 30.0


@dataclass(frozen=True, slots=True)
class Camera:
    """A camera with a clock of its own."""

    #: Force time at which the video begins, s; negative when the camera ran before the sensors.
    offset: float = 0.0
    #: By what share the camera's second is longer than the sensors', such as 30e-6. At most 1e-3
    #: either way.
    drift: float = 0.0
    #: Standard deviation of the instants at which the shutter opens, s; at most 1 ms.
    jitter: float = 0.0
    late: int = 0  # number of frames that come late: by 0.3 to 0.8 of a frame's time
    tail: float = 0.0  # seconds for which the camera goes on after the force recording's end
    seed: int = 0  # of jitter and late frames

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Camera:
        """A camera as people have them: tens of ppm wrong, a few frames late.

        It starts at most 0.4 s before and 0.15 s after the sensors, and ends after them, so that
        it sees every tap that is not at the very edge.
        """
        return cls(
            offset=float(rng.uniform(-0.4, 0.15)),
            drift=float(rng.choice([-1.0, 1.0]) * rng.uniform(15e-6, 60e-6)),
            jitter=float(rng.uniform(2e-4, 6e-4)),
            late=int(rng.integers(2, 6)),
            tail=float(rng.uniform(0.0, 0.4)),
            seed=int(rng.integers(2**63)),
        )

    @property
    def clock(self) -> ClockMap:
        """From the file's timestamps to force time; true but for jitter and late frames."""
        return ClockMap(offset=self.offset, rate=1.0 + self.drift)

    def shots(self, duration: float) -> tuple[Real, NDArray[np.intp]]:
        """The frames of a force recording.

        `duration`: of the force recording, s. Gives `force` (n,): the force time of the instant
        that each frame shows, rising; `late` (m,): which frames are late.
        """
        length = float(self.clock.to_device(duration + self.tail))
        count = int(np.ceil(length * RATE))
        rng = np.random.default_rng(self.seed)
        # Bounded, so that a frame is never taken before the one that is shown before it: one that
        # is 0.8 of a frame late, and 2.5 ms more, still comes 1.7 ms before one 2.5 ms early.
        shaken = self.jitter * np.clip(rng.standard_normal(count), -2.5, 2.5)
        late = np.sort(rng.permutation(count)[: self.late])
        shaken[late] += rng.uniform(0.3, 0.8, late.size) / RATE
        return self.clock.to_force(np.arange(count) / RATE) + shaken, late


#: Width and height of a frame of the video, pixels.
SIZE = (640, 360)
#: Darkness of the shadow under a body that stands, and the height at which a third is left, m.
SHADE = 0.42
FADING = 0.022


class Stage:
    """Draws a performance; what stands still is drawn once.

    `size`: width and height of the pictures, pixels.
    """

    def __init__(self, performance: Performance, size: tuple[int, int] = SIZE) -> None:
        scene = performance.scene
        self.scene = scene
        self.taps = performance.taps
        self.states = States(performance)
        self.sizes = Proportions.of(scene)
        self.view = View.fitted(performance, self.sizes, size)
        self.background = background(scene, self.sizes, self.view, size)
        self.shadow = self._shadow()

    def frame(self, time: float) -> Image:
        """The picture at a time on the force clock, s; shape (height, width, 3), BGR."""
        state = self.states.at(time)
        pose = pose_of(self.scene, self.sizes, self.view, state)
        canvas = Canvas(self.background.copy())
        if self.scene.holder is None:
            self._lay_shadow(pose, canvas.image)
        tongs = Tongs(self.sizes, self.view, state, pose)
        tongs.hand(canvas)
        for side in (0, 1):
            if tongs.behind[side]:
                tongs.jaw(side, canvas)
        pivot = self.view.at(pose.body[0], pose.body[1], pose.tongs[1])
        view = self.view.tilted(pose.tilt, pivot)
        DRAWINGS[self.scene.body.shape](self.scene, self.sizes, view, pose, canvas)
        for side in (0, 1):
            if not tongs.behind[side]:
                tongs.jaw(side, canvas)
        tongs.streaks(canvas)
        tongs.fingers(canvas)
        if self.taps:
            tongs.tapping(min((time - tap for tap in self.taps), key=abs), canvas)
        return canvas.image

    def _shadow(self) -> Image:
        """The body's shadow as darkness, shape (h, w, 3)."""
        s, body = self.view.scale, self.scene.body
        half, flat = 1.5 * body.half_width * s, (0.5 * body.half_width + 0.004) * s
        v, u = np.mgrid[-flat : flat + 1, -half : half + 1]
        round_off = np.clip(1.0 - np.hypot(u / half, v / flat), 0.0, 1.0)
        soft = round_off * round_off * (3.0 - 2.0 * round_off)
        return np.repeat((255.0 * np.sqrt(soft))[:, :, None], 3, axis=2).astype(np.uint8)

    def _lay_shadow(self, pose: Pose, image: Image) -> None:
        """Darken what is below the body, the less the higher it is."""
        view, half, back = self.view, self.scene.body.half_width, self.sizes.back
        x, y, z, _ = pose.body
        floor = -self.sizes.foot
        if self.scene.socket is not None:
            socket = view.along(self.scene.socket.place)
            if y < 0.008 or socket - y < 2.0 * back + 0.008:
                floor = 0.0
        share = SHADE * float(np.exp(-max(z - floor, 0.0) / FADING))
        middle = view.at(x - 0.1 * half, y - back, floor)
        rows, columns = self.shadow.shape[:2]
        top, left = round(middle[1] - 0.5 * rows), round(middle[0] - 0.5 * columns)
        upper, lower = max(top, 0), min(top + rows, image.shape[0])
        first, last = max(left, 0), min(left + columns, image.shape[1])
        if upper >= lower or first >= last:
            return
        part = image[upper:lower, first:last]
        dark = self.shadow[upper - top : lower - top, first - left : last - left]
        bright = cv2.convertScaleAbs(dark, alpha=-share, beta=255.0)
        cv2.multiply(part, bright, dst=part, scale=1.0 / 255.0)


def render(performance: Performance, path: Path, camera: Camera) -> tuple[Real, NDArray[np.intp]]:
    """Film a performance: 640x360, 30 frames/s, MPEG-4 in an mp4 file.

    The file has the even timestamps n / 30 s that OpenCV writes. The same arguments give the same
    bytes on one machine.

    `path`: the video to write, ending in ``.mp4``, which tells OpenCV the container. Gives `force`,
    `late`: as of :meth:`Camera.shots`.
    """
    force, late = camera.shots(float(performance.motion.times[-1]))
    stage = Stage(performance)
    opencv()  # silent from here on
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), RATE, SIZE)
    try:
        if not writer.isOpened():
            raise InputError(
                f"'{path}' cannot be written: OpenCV finds no MPEG-4 encoder (mp4v) or no room "
                f"here; install opencv-contrib-python-headless or free some space."
            )
        for time in force.tolist():
            writer.write(stage.frame(time))
    finally:
        writer.release()
    # The encoder goes on when the disk is full; its file then lacks its index.
    if not _has_index(path):
        raise InputError(
            f"'{path}' cannot be written: not all of it reached the disk; free some space and "
            f"film again."
        )
    return force, late


def _has_index(path: Path) -> bool:
    """Whether an mp4 file is a sequence of whole boxes, one of them the index of its frames."""
    with path.open("rb") as stream:
        end = stream.seek(0, os.SEEK_END)
        place, has_index = 0, False
        while place < end:
            stream.seek(place)
            head = stream.read(8)
            size = int.from_bytes(head[:4], "big")
            has_index = has_index or head[4:] == b"moov"
            if size < 8:
                return False
            place += size
    return has_index and place == end
