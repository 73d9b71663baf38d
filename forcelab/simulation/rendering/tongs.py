"""The tongs with their sensors, the hand that holds them, and the fingertip that taps."""

from __future__ import annotations

import numpy as np

from forcelab.simulation.rendering.canvas import CIRCLE, Canvas, Points, colour
from forcelab.simulation.rendering.state import State
from forcelab.simulation.rendering.view import Proportions, View

__all__ = ["Tongs"]

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
SPARK = colour("d81b78")

#: Newtons at which a dome is flattened by two thirds of what it can be; and how far, as a share
#: of its radius. Real silicone gives less than a millimetre, which nobody would see.
SOFTNESS = 5.0
FLATTENING = 0.38
#: How far a dome leans, m, for each newton that drags at both; and at most.
LEANING = 2.2e-4
LEANING_MOST = 0.0030
#: Seconds in which the tapping finger comes and goes, and how far it comes from, m.
COMING = 0.28
FAR = 0.06
#: Seconds for which it stays on the dome, before and after the middle of the tap.
TOUCHING = 0.018


class Tongs:
    """The tongs of one instant, to be drawn part by part between other things.

    Parameters
    ----------
    sizes : Proportions
    view : View
    state : State
    """

    def __init__(self, sizes: Proportions, view: View, state: State) -> None:
        self.sizes = sizes
        self.view = view
        y = view.along(state.tongs[0])
        z = view.above(state.tongs[1]) + sizes.grip
        turn = np.array([np.cos(state.tongs[2]), np.sin(state.tongs[2])])
        axis = view.at(turn[0], turn[1], 0.0) - view.at(0.0, 0.0, 0.0)
        #: How wide the round sensors are seen, as a share of their radius: 0 from the side.
        self.breadth = abs(float(turn[1]))
        middle = view.at(0.0, y, z)
        lean = np.clip(-LEANING * np.array(state.drag), -LEANING_MOST, LEANING_MOST)
        # The hand runs ahead of the domes that the body holds back.
        self.lean = view.at(0.0, lean[0], lean[1]) - view.at(0.0, 0.0, 0.0)
        self.hinge = middle + 1.6 * self.lean - (0.0, view.scale * sizes.reach)
        self.inward = [axis, -axis]
        self.contacts = [middle - axis * state.jaws[0], middle + axis * state.jaws[1]]
        self.jaws = 0.5 * (state.jaws[0] + state.jaws[1])
        self.pressed = [1.0 - float(np.exp(-max(n, 0.0) / SOFTNESS)) for n in state.normal]
        #: Whether the left and the right jaw are further off than the body.
        self.behind = [turn[1] > 0.15, turn[1] < -0.15]

    def jaw(self, side: int, canvas: Canvas) -> None:
        """One jaw: its arm, the sensor's housing and its dome. 0 is the left one."""
        s = self.view.scale
        r = self.sizes.dome
        inward, up = self.inward[side], np.array([0.0, -s])
        contact = self.contacts[side]
        flat = FLATTENING * r * self.pressed[side]
        bulge = 0.95 * r - flat
        base = contact - bulge * inward + self.lean

        foot = base - 0.0042 * inward
        knee = foot + (self.hinge[1] - foot[1] + 0.009 * s) * np.array([0.0, 1.0])
        top = self.hinge - 0.0028 * inward
        self._arm(canvas, [foot - 1.1 * r * up, knee, top])
        angles = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 17)
        out = np.minimum(np.cos(angles) * (bulge + 0.6 * flat), bulge)
        high = np.sin(angles) * (0.82 * r + 0.25 * flat)
        share = (out / bulge)[:, None]
        rim = base + out[:, None] * inward + high[:, None] * up - share * self.lean
        disc = CIRCLE * (0.92 * r * s) * (self.breadth, 1.0)
        canvas.hull(np.concatenate([base + disc, base + disc - 0.003 * inward]), HOUSING, ARM_EDGE)
        canvas.hull(np.concatenate([rim, base + 0.88 * disc]), DOME, DOME_EDGE)
        shine = base + 0.3 * bulge * inward + np.linspace(0.15, 0.55, 3)[:, None] * r * up
        canvas.line(shine, DOME_SHINE, 2)
        if inward[1] < -0.2 * s:  # it turns its back to the viewer
            canvas.hull(base + disc - 0.003 * inward, HOUSING, ARM_EDGE)
            self._arm(canvas, [foot - 1.1 * r * up, knee, top])

    def hand(self, canvas: Canvas) -> None:
        """What of the hand is behind the tongs: forearm and palm."""
        s, hinge = self.view.scale, self.hinge
        wrist = hinge + s * np.array([0.024, -0.024])
        elbow, cuff, far = (hinge + s * np.array([d, -d]) for d in (0.1, 0.038, 0.12))
        palm = hinge + s * np.array([0.002, -0.006])
        canvas.capsule((wrist, elbow), (0.011 * s, 0.013 * s), SKIN, SKIN_EDGE)
        canvas.capsule((cuff, far), (0.0145 * s, 0.018 * s), SLEEVE, SLEEVE_EDGE)
        canvas.capsule((palm, wrist), (0.0125 * s, 0.0125 * s), SKIN, SKIN_EDGE)

    def fingers(self, canvas: Canvas) -> None:
        """What of the hand is before the tongs: thumb and fingers on the arms, and the hinge."""
        s, hinge = self.view.scale, self.hinge
        canvas.disc(hinge, (0.0042 * s, 0.0042 * s), HOUSING, ARM_EDGE)
        canvas.disc(hinge, (0.0014 * s, 0.0014 * s), ARM_EDGE)
        # The grip of thumb and fingers does not turn all the way with the arms.
        least = 0.5 * s * (self.jaws + 1.9 * self.sizes.dome)
        arm = self.contacts[0] - (0.95 * self.sizes.dome + 0.0042) * self.inward[0]
        across = abs(float((arm + self.lean - hinge)[0]))
        aside = max(across, least)
        knees = [hinge + np.array([side * aside, 0.0125 * s]) for side in (-1.0, 1.0)]
        for knuckle, tip in (
            ((0.017, -0.004), knees[1] + s * np.array([0.001, 0.002])),
            ((0.012, -0.012), knees[1] + s * np.array([-0.0015, -0.0045])),
            ((-0.013, -0.009), knees[0] + s * np.array([-0.0005, -0.0015])),
        ):
            root = hinge + s * np.array(knuckle)
            bend = 0.5 * (root + tip) + s * np.array([0.004 * np.sign(knuckle[0]), -0.001])
            self._finger(canvas, [root, bend, tip], 0.0042 * s)

    def tapping(self, away: float, canvas: Canvas) -> None:
        """A fingertip of the other hand on the left dome, or on its way to it.

        Parameters
        ----------
        away : float
            Seconds from the tap's middle, either way.
        canvas : Canvas
        """
        if away >= COMING:
            return
        s = self.view.scale
        path = np.array([0.64, 0.77])
        distance = FAR * max(0.0, away - TOUCHING) / (COMING - TOUCHING)
        radius = 0.0046 * s
        tip = self.contacts[0] + np.array([radius, 0.0]) + s * distance * path
        far = tip + s * 0.055 * path
        canvas.capsule((far, tip + s * 0.2 * path), (0.0078 * s, 0.012 * s), SKIN, SKIN_EDGE)
        canvas.capsule((far, tip), (0.0072 * s, radius), SKIN, SKIN_EDGE)
        nail = tip + s * np.array([0.0008, 0.0002])
        canvas.capsule((nail, nail + 0.005 * s * path), (0.0022 * s, 0.0026 * s), NAIL, SKIN_EDGE)
        if away <= TOUCHING:
            for angle in (1.0, 1.6, 2.2):
                ray = np.array([np.cos(angle), -np.sin(angle)])
                start = self.contacts[0] - (0.0, 0.0035 * s)
                canvas.line(start + s * np.outer([0.0035, 0.0085], ray), SPARK, 3)

    def _arm(self, canvas: Canvas, spine: list[Points]) -> None:
        """An arm along three points: down, at the knee, at the hinge."""
        half = 0.0021 * self.view.scale
        foot, knee, top = spine
        side = half if foot[0] > self.hinge[0] else -half
        sides = [(side, 0.0), (side, 0.0), (0.4 * side, -half),
                 (-0.4 * side, half), (-side, 1.2 * half), (-side, 0.0)]  # fmt: skip
        outline = np.array([foot, knee, top, top, knee, foot]) + np.array(sides)
        canvas.polygon(outline, ARM, ARM_EDGE)

    def _finger(self, canvas: Canvas, joints: list[Points], radius: float) -> None:
        """A finger through three joints."""
        root, bend, tip = joints
        canvas.capsule((root, bend), (1.15 * radius, radius), SKIN, SKIN_EDGE)
        canvas.capsule((bend, tip), (radius, 0.85 * radius), SKIN, SKIN_EDGE)
        canvas.capsule((root, bend), (1.05 * radius, 0.9 * radius), SKIN)
