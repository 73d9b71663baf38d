"""Where things are in the picture: proportions of the props, and the way from metres to pixels."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from forcelab.simulation.motion import Performance
from forcelab.simulation.parts import Profile, Shape
from forcelab.simulation.rendering.canvas import Points
from forcelab.simulation.scene import Scene

__all__ = ["Proportions", "View"]

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
    """Sizes of what is drawn that the mechanics do not know, m.

    Parameters
    ----------
    grip : float
        Where the jaws touch the body, above its lower face; with a holder, above the place of
        the first grip.
    dome : float
        Radius of a sensor's dome.
    reach : float
        From the domes up to the tongs' hinge.
    back : float
        How far the body reaches away from the viewer.
    foot : float
        From the body's lower face, or the place of the first grip, down to the table.
    height : float
        Of the body; with a holder, of what of it is above the place of the first grip.
    """

    grip: float
    dome: float
    reach: float
    back: float
    foot: float
    height: float

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
    """A parallel projection: x to the right, z up, y to the lower right, towards the viewer.

    Parameters
    ----------
    scale : float
        Pixels a metre.
    origin : tuple of float
        Pixel, from the left and from the top, of x = y = z = 0 of the stage.
    place : float
        y around which distances are drawn in full, m.
    ground : bool
        Whether there is a table under z = 0, so that heights are shortened.
    sink : float
        By how much depths below z = 0 are stretched.
    depth : tuple of float
        How far right and down a metre along y goes, as shares of a metre.
    profile : Profile, optional
        Of a body along which heights are drawn.
    tilt : float
        By how much what is seen is turned to the right, rad.
    pivot : tuple of float
        Pixel about which it is turned.
    """

    scale: float
    origin: tuple[float, float]
    place: float
    ground: bool
    sink: float
    depth: tuple[float, float]
    profile: Profile | None = None
    tilt: float = 0.0
    pivot: tuple[float, float] = (0.0, 0.0)

    @classmethod
    def fitted(cls, performance: Performance, sizes: Proportions, size: tuple[int, int]) -> View:
        """The view in which the whole motion is seen as large as it goes.

        Parameters
        ----------
        performance : Performance
        sizes : Proportions
        size : tuple of int
            Width and height of the picture, pixels.
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
