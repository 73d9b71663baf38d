"""From the motion to the picture: its states at any time, sizes, a projection, and the pose."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from forcelab.simulation.canvas import Points
from forcelab.simulation.scene import Performance, Profile, Scene, Shape, Socket

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
        """Those that suit a scene."""
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


def drawn_height(up: Points, profile: Profile) -> Points:
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
    drawn: Points = inner + stretched - shortened + beyond
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

    def climbed(self, up: Points) -> Points:
        """Where heights along a body in a holder are on the stage, m, above the first grip."""
        return up if self.profile is None else drawn_height(up, self.profile)

    def at(self, x: float, y: float, z: float) -> Points:
        """Pixel of a place on the stage, shape (2,)."""
        right = self.origin[0] + self.scale * (x + self.depth[0] * y)
        down = self.origin[1] - self.scale * (z - self.depth[1] * y)
        if self.tilt != 0.0:
            cos, sin = np.cos(self.tilt), np.sin(self.tilt)
            u, v = right - self.pivot[0], down - self.pivot[1]
            right = self.pivot[0] + cos * u - sin * v
            down = self.pivot[1] + sin * u + cos * v
        return np.array([right, down])

    def path(self, places: list[tuple[float, float, float]]) -> Points:
        """Pixels of places on the stage, shape (n, 2)."""
        return np.array([self.at(*place) for place in places])

    def zoomed(self, factor: float) -> View:
        """The same view on a picture `factor` times as large."""
        left, top = self.origin
        return replace(self, scale=self.scale * factor, origin=(left * factor, top * factor))

    def tilted(self, tilt: float, pivot: Points) -> View:
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
ROCKING = 0.4
OVER = 0.003
#: How far from its place it is tilted by three quarters of that, m; up to where at all, m; and how
#: high over the socket's rim, and how deep below it, it is upright again, m.
OFF = 0.0012
AROUND = 0.016
HOVERING = 0.0012
SUNK = 0.0006


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
    near = float(np.clip(2.0 - 2.0 * abs(away) / AROUND, 0.0, 1.0))
    low = float(np.clip(1.0 - z / HOVERING if z > 0.0 else 1.0 + z / SUNK, 0.0, 1.0))
    rocking = 1.0 - ROCKING * (0.5 - 0.5 * np.cos(2.0 * np.pi * away / OVER))
    return TILT * near * low * float(rocking * np.tanh(away / OFF))
