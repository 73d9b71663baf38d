"""Small videos whose frames carry their number as black and white blocks."""

from fractions import Fraction
from pathlib import Path

import av
import numpy as np

from forcelab.video.codecs import opencv

#: Bits of the number, and the side of a block in pixels.
BITS, BLOCK = 16, 24
WIDTH, HEIGHT = BITS * BLOCK, 64
FINE = Fraction(1, 90_000)
GOP_250 = {"g": "250", "keyint_min": "250", "sc_threshold": "0", "bf": "3", "preset": "veryfast"}


def even_times(count, rate=30):
    """Times of a constant frame rate, s."""
    return np.arange(count) / rate


def odd_times(count, seed=0):
    """Times of a variable frame rate: 12 to 60 frames a second, and two long holes; s."""
    steps = np.random.default_rng(seed).uniform(1 / 60, 1 / 12, count)
    steps[[count // 3, count // 2]] = 0.9
    return np.round(np.cumsum(steps) / float(FINE)) * float(FINE)


def numbered(number, size=(WIDTH, HEIGHT)):
    """A frame, shape (height, width, 3), that says its number."""
    image = np.full((size[1], size[0], 3), 96, np.uint8)
    image[:, :WIDTH] = 16
    for bit in range(BITS):
        if number >> bit & 1:
            image[:HEIGHT, bit * BLOCK : (bit + 1) * BLOCK] = 235
    return image


def number_of(frame):
    """The number that a frame says."""
    levels = frame[HEIGHT // 2 - 6 : HEIGHT // 2 + 6, :WIDTH].mean(axis=(0, 2))
    middles = levels.reshape(BITS, BLOCK)[:, 6:18].mean(axis=1)
    return int(sum(1 << bit for bit in range(BITS) if middles[bit] > 128))


def write(path: Path, codec, times, options=None, size=(WIDTH, HEIGHT)):
    """Encode numbered frames with their times (s)."""
    # Matroska keeps milliseconds; the others as fine as they are told.
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=30)
        stream.width, stream.height = size
        stream.pix_fmt = "yuv420p"
        stream.options = options or {}
        stream.codec_context.time_base = FINE
        stream.time_base = FINE
        for number, time in enumerate(times):
            frame = av.VideoFrame.from_ndarray(numbered(number, size), format="rgb24")
            frame.pts, frame.time_base = round(time / FINE), FINE
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


def write_with_opencv(path: Path, fourcc, count):
    """Encode numbered frames as OpenCV does, at 30 frames a second."""
    cv2 = opencv()
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*fourcc), 30, (WIDTH, HEIGHT))
    for number in range(count):
        writer.write(numbered(number))
    writer.release()
    return path
