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

import contextlib
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from forcelab.clock import ClockMap
from forcelab.errors import InputError
from forcelab.simulation.canvas import Canvas, Image
from forcelab.simulation.drawn_background import background
from forcelab.simulation.drawn_bodies import DRAWINGS
from forcelab.simulation.drawn_tongs import Tongs
from forcelab.simulation.projection import Pose, Proportions, States, View, pose_of
from forcelab.simulation.scene import Performance

Array = NDArray[np.float64]

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

    def shots(self, duration: float) -> tuple[Array, NDArray[np.intp]]:
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


def render(performance: Performance, path: Path, camera: Camera) -> tuple[Array, NDArray[np.intp]]:
    """Film a performance: 640x360, 30 frames/s, MPEG-4 in an mp4 file.

    The file has the even timestamps n / 30 s that OpenCV writes. The same arguments give the same
    bytes on one machine.

    `path`: the video to write, ending in ``.mp4``, which tells OpenCV the container. Gives `force`,
    `late`: as of :meth:`Camera.shots`.
    """
    force, late = camera.shots(float(performance.motion.times[-1]))
    stage = Stage(performance)
    with _silence():
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


@contextlib.contextmanager
def _silence() -> Iterator[None]:
    """Keep OpenCV from telling the terminal what is raised as one sentence."""
    log = cv2.utils.logging
    level = log.getLogLevel()
    log.setLogLevel(log.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        log.setLogLevel(level)
