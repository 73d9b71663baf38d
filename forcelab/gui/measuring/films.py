"""Videos to measure on, whose frames carry their number in a form that survives compression."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forcelab.video.opencv import opencv

__all__ = ["FILMS", "Film", "number_of"]

Picture = NDArray[np.uint8]

WIDTH, HEIGHT = 640, 480
#: Bits of a number, and the side of a bit's square in pixels.
BITS, BLOCK = 16, 40
FRAMES_PER_SECOND = 30
FINE = Fraction(1, 90_000)
#: Key frames 250 frames apart, as cameras' and converters' defaults have it.
H264 = {
    "g": "250",
    "keyint_min": "250",
    "sc_threshold": "0",
    "bf": "2",
    "preset": "veryfast",
    "threads": "2",
}


@dataclass(frozen=True, slots=True)
class Film:
    """One kind of video.

    Parameters
    ----------
    name : str
        For people.
    codec : "h264" or "mp4v"
    even : bool
        Whether its frames are all equally far apart.
    """

    name: str
    codec: str
    even: bool

    @property
    def refusal(self) -> str:
        """Why it cannot be made here; empty if it can."""
        if self.codec == "h264" and find_spec("av") is None:
            return "PyAV, which makes these H.264 videos, is missing; get it by: pip install av"
        return ""

    @property
    def sketched(self) -> bool:
        """Whether its key frames are so far apart that small pictures of all frames are made."""
        return self.codec == "h264"

    def times(self, count: int) -> NDArray[np.float64]:
        """Times of the frames in seconds, shape (count,), from 0."""
        if self.even:
            return np.arange(count) / FRAMES_PER_SECOND
        steps = np.random.default_rng(0).uniform(1 / 60, 1 / 12, count)
        steps[count // 3] = 0.9
        ticks = np.round(np.cumsum(steps) / float(FINE))
        return (ticks - ticks[0]) * float(FINE)

    def make(self, path: Path, count: int) -> None:
        """Write the video."""
        if self.codec == "h264":
            self._encode(path, count)
        else:
            cv2 = opencv()
            code = cv2.VideoWriter.fourcc(*self.codec)
            writer = cv2.VideoWriter(str(path), code, FRAMES_PER_SECOND, (WIDTH, HEIGHT))
            for picture in _pictures(count):
                writer.write(picture)
            writer.release()

    def _encode(self, path: Path, count: int) -> None:
        """Write H.264 with the times of the frames."""
        import av

        with av.open(str(path), "w") as container:
            stream = container.add_stream("libx264", rate=FRAMES_PER_SECOND, options=H264)
            stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
            stream.codec_context.time_base = stream.time_base = FINE
            for time, picture in zip(self.times(count), _pictures(count), strict=True):
                frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
                frame.pts, frame.time_base = round(time / FINE), FINE
                container.mux(stream.encode(frame))
            container.mux(stream.encode())


FILMS = (
    Film("H.264, GOP 250", "h264", True),
    Film("H.264, GOP 250, VFR", "h264", False),
    Film("mp4v", "mp4v", True),
)


def number_of(picture: Picture) -> int:
    """The number that a frame carries, whatever its size.

    Parameters
    ----------
    picture : ndarray of uint8, shape (height, width, channels)
    """
    height, width = picture.shape[:2]
    row = picture[height * BLOCK // (2 * HEIGHT)].mean(axis=1)
    middles = (np.arange(BITS) + 0.5) * BLOCK * width / WIDTH
    return int(sum(1 << bit for bit, x in enumerate(middles) if row[int(x)] > 128))


def _pictures(count: int) -> Iterator[Picture]:
    """Frames with a moving, textured ground: a plain one would be decoded in no time."""
    random = np.random.default_rng(3)
    coarse = random.integers(40, 200, (HEIGHT // 8 + 8, WIDTH // 8 + 64, 3))
    ground = np.kron(coarse, np.ones((8, 8, 1))).astype(np.uint8)
    ground += random.integers(0, 24, ground.shape, dtype=np.uint8)
    bits = np.arange(BITS)
    for number in range(count):
        x, y = int(200 + 190 * np.sin(number / 37)), int(30 + 29 * np.cos(number / 23))
        picture = np.ascontiguousarray(ground[y : y + HEIGHT, x : x + WIDTH])
        black_and_white = np.where(number >> bits & 1, 235, 16).astype(np.uint8)
        picture[:BLOCK] = np.repeat(black_and_white, BLOCK)[np.newaxis, :, np.newaxis]
        yield picture
