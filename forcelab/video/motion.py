"""How much moves in a video, frame by frame: what its clock is found by."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.video.codecs import opencv
from forcelab.video.index import SAME, opened_video

#: Blocks across and down that a frame is looked at in, and pixels along the side of each.
BLOCKS, SIDE = (16, 9), 10
#: Differences of grey levels up to this one are the noise of sensor and compression.
NOISE = 4
#: Frames between two reports of progress, short enough to be cancelled at once.
STRETCH = 15


@dataclass(frozen=True, eq=False)
class MotionEnergy:
    times: NDArray[np.float64]  #: (n,), of the frames on the video's own clock, s, from 0
    #: (n,), how much each differs from the one before it, in grey levels of 0..255; the first is 0
    energy: NDArray[np.float64]


def measuring_motion(path: Path) -> Generator[Progress, None, MotionEnergy]:
    """Measure the motion in a video; every frame is decoded once, small and grey.

    A frame is scaled to 160 x 90 pixels. In each of 16 x 9 blocks the mean absolute difference
    above :data:`NOISE` grey levels is taken, once the change common to all of the frame (its
    median, as of a lamp or of automatic exposure) is away. The energy is the square of the mean of
    their square roots: something large that moves far does not hide a finger that moves a little.
    """
    cv2 = opencv()
    times: list[float] = []
    energy: list[float] = []
    before: NDArray[np.int16] | None = None
    size = (BLOCKS[0] * SIDE, BLOCKS[1] * SIDE)
    with opened_video(path) as capture:
        count = int(max(capture.get(cv2.CAP_PROP_FRAME_COUNT), 0))
        while capture.grab():
            stamp = float(capture.get(cv2.CAP_PROP_POS_MSEC)) / 1000
            if times and stamp <= times[-1] + SAME:
                continue
            read, picture = capture.retrieve()
            if not read or picture is None:
                continue
            if picture.ndim == 3:
                picture = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
            small = cv2.resize(picture, size, interpolation=cv2.INTER_AREA).astype(np.int16)
            times.append(stamp)
            energy.append(0.0 if before is None else _difference(before, small))
            before = small
            if len(times) % STRETCH == 0:
                yield Progress(len(times), max(count, len(times)), "looking for motion")
    if len(times) < 2:
        raise InputError(
            f"'{path}' has fewer than two frames that can be decoded; convert it to H.264 in mp4."
        )
    return MotionEnergy(np.array(times) - times[0], np.array(energy))


def _difference(before: NDArray[np.int16], after: NDArray[np.int16]) -> float:
    """The motion energy between two small grey frames."""
    change = after - before
    change -= np.int16(np.median(change))
    rest = np.maximum(np.abs(change) - NOISE, 0)
    blocks = rest.reshape(BLOCKS[1], SIDE, BLOCKS[0], SIDE).mean(axis=(1, 3))
    return float(np.mean(np.sqrt(blocks)) ** 2)
