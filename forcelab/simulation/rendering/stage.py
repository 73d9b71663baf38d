"""One performance, ready to be drawn at any time."""

from __future__ import annotations

import cv2
import numpy as np

from forcelab.simulation.motion import Performance
from forcelab.simulation.rendering.bodies import DRAWINGS
from forcelab.simulation.rendering.canvas import Canvas, Image
from forcelab.simulation.rendering.posing import Pose, posed
from forcelab.simulation.rendering.setting import background
from forcelab.simulation.rendering.state import States
from forcelab.simulation.rendering.tongs import Tongs
from forcelab.simulation.rendering.view import Proportions, View

__all__ = ["SIZE", "Stage"]

#: Width and height of a frame of the video, pixels.
SIZE = (640, 360)
#: Darkness of the shadow under a body that stands, and the height at which a third is left, m.
SHADE = 0.42
FADING = 0.022


class Stage:
    """Draws a performance; what stands still is drawn once.

    Parameters
    ----------
    performance : Performance
    size : tuple of int
        Width and height of the pictures, pixels.
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
        pose = posed(self.scene, self.sizes, self.view, state)
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
