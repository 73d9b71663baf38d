"""The tongs as they are drawn, and the hands that hold and tap them."""

from __future__ import annotations

import numpy as np

from forcelab.simulation.canvas import CIRCLE, Canvas, Points, colour
from forcelab.simulation.projection import LEAD, Pose, Proportions, State, View

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
SLIDING = 0.008
PRESSING = 0.15
#: Seconds in which the tapping finger comes and goes, and how far it comes from, m.
COMING = 0.28
FAR = 0.06
#: Seconds for which it stays on the dome, before and after the middle of the tap.
TOUCHING = 0.018
#: Seconds for which the tap's rays are seen, fading: three frames.
SHINING = 0.1


class Tongs:
    """The tongs of one instant, to be drawn part by part between other things."""

    def __init__(self, sizes: Proportions, view: View, state: State, pose: Pose) -> None:
        self.sizes = sizes
        self.view = view
        y, z, angle = pose.tongs
        turn = np.array([np.cos(angle), np.sin(angle)])
        ways = view.at(turn[0], turn[1], 0.0), view.at(-turn[1], turn[0], 0.0)
        axis, across = (way - view.at(0.0, 0.0, 0.0) for way in ways)
        #: How wide the round sensors are seen, as a share of their radius: 0 from the side.
        self.breadth = abs(float(turn[1]))
        middle = view.at(0.0, y, z)
        most = LEANING_MOST * sizes.dome
        lean = most * np.tanh(-LEANING * np.array(state.drag) / most)
        # The hand runs ahead of the domes that the body holds back.
        drag = view.at(0.0, lean[0], lean[1]) - view.at(0.0, 0.0, 0.0)
        twist = most * float(np.tanh(2.0 * LEANING * pose.lead / LEAD / most)) * across
        self.leans = [drag - twist, drag + twist]
        self.hinge = middle + 1.6 * drag - (0.0, view.scale * sizes.reach)
        self.heading = angle + pose.lead
        self.inward = [axis, -axis]
        self.contacts = [middle - axis * state.jaws[0], middle + axis * state.jaws[1]]
        self.pressed = [1.0 - float(np.exp(-max(n, 0.0) / SOFTNESS)) for n in state.normal]
        self.sliding = state.sliding if min(state.normal) > PRESSING else 0.0
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
        if abs(self.sliding) < SLIDING:
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
        if away >= COMING:
            return
        s = self.view.scale
        path = np.array([0.64, 0.77])
        distance = FAR * (max(0.0, away - TOUCHING) / (COMING - TOUCHING)) ** 1.5
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
        if 0.0 <= since < SHINING:
            left = 1.0 - since / SHINING
            for angle in (0.9, 1.6, 2.3):
                ray = np.array([np.cos(angle), -np.sin(angle)])
                start = self.contacts[0] - (0.0, 0.0035 * s)
                line = start + s * np.outer([0.0095 - 0.006 * left, 0.0115], ray)
                canvas.line(line, SPARK_EDGE, 3.0 + 3.0 * left)
                canvas.line(line, SPARK, 1.0 + 3.0 * left)

    def _base(self, side: int) -> Points:
        """Where a dome begins: the middle of its round face on the housing."""
        r = self.sizes.dome
        bulge = (0.95 - FLATTENING * self.pressed[side]) * r
        base: Points = self.contacts[side] - bulge * self.inward[side] + self.leans[side]
        return base

    def _grip(self, canvas: Canvas, *, behind: bool) -> None:
        """Thumb and fingers, which go round with the arms that they hold."""
        s, hinge = self.view.scale, self.hinge
        zero = self.view.at(0.0, 0.0, 0.0)
        round_off = self.view.at(np.cos(self.heading), np.sin(self.heading), 0.0) - zero
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
