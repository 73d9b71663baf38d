"""Small pictures of a whole video, so that a jump shows the right frame before it is decoded.

Where key frames are far apart, a frame somewhere in the middle costs the decoding of all since the
last key frame: half a second for 250 frames of 1280x720. A sketch of it is there in 2 ms.
"""

from __future__ import annotations

import math
from collections.abc import Generator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forcelab.video.index import Index, open_video
from forcelab.video.opencv import opencv
from forcelab.video.reader import Frame, as_rgb

__all__ = ["Sketches"]

#: Bytes that the sketches of one video may take: room for some minutes.
ROOM = 128 * 2**20
#: Pixels that a sketch is wide, about, and how well JPEG keeps it.
WIDE, QUALITY = 800, 85
#: Bytes that JPEG takes for a pixel, about, and pixels that a sketch is wide at least.
DENSITY, NARROW = 0.25, 240
#: Frames from key frame to key frame up to which decoding is fast enough without sketches.
SHORT = 30


class Sketches:
    """Small pictures of the frames of a video.

    Parameters
    ----------
    path : Path
        The video.
    index : Index
        Its index.
    room : int
        Bytes that they may take.
    """

    def __init__(self, path: Path, index: Index, room: int = ROOM) -> None:
        self.path = path
        self.index = index
        self._room = room
        self._bytes = 0
        self._packed: dict[int, NDArray[np.uint8]] = {}

    def __len__(self) -> int:
        return len(self._packed)

    @property
    def worthwhile(self) -> bool:
        """Whether some frames are far behind their key frame."""
        starts = np.append(self.index.keys, len(self.index.times))
        return bool(np.diff(starts).max() > SHORT)

    def sketching(self) -> Generator[None, None, None]:
        """Go through the video once as a job that yields after each frame; ends where room does."""
        cv2 = opencv()
        capture = open_video(self.path)
        try:
            while self._bytes < self._room and capture.grab():
                number = self.index.number_at(capture.get(cv2.CAP_PROP_POS_MSEC) / 1000)
                if number >= 0:
                    read, picture = capture.retrieve()
                    if read:
                        self._pack(number, picture)
                yield
        finally:
            capture.release()

    def get(self, number: int) -> Frame | None:
        """The sketch of a frame, if there is one: uint8, shape (height, width, 3), RGB."""
        packed = self._packed.get(number)
        if packed is None:
            return None
        return as_rgb(opencv().imdecode(packed, opencv().IMREAD_COLOR))

    def _pack(self, number: int, picture: NDArray[np.uint8]) -> None:
        """Keep a frame, small."""
        cv2 = opencv()
        height, width = picture.shape[:2]
        less = self._less(width, height)
        if less > 1:
            size = (width // less, max(height // less, 1))
            # By a whole number the mean over an area costs a twentieth of what it does otherwise.
            picture = picture[: size[1] * less, : size[0] * less]
            picture = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
        done, packed = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
        if done:
            self._packed[number] = packed
            self._bytes += packed.nbytes

    def _less(self, width: int, height: int) -> int:
        """How many times smaller a sketch is: the more so, the more of them share the room."""
        crowd = len(self.index.times) * width * height * DENSITY / self._room
        least = max(round(width / WIDE), 1)
        return max(least, min(math.ceil(math.sqrt(crowd)), width // NARROW))
