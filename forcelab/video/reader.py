"""Frames of a video by their own timestamps: verified seek, small cache."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Generator, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.video.decoder import LEAD, Decoder, Decoders
from forcelab.video.index import Index, indexing, last_at
from forcelab.video.opencv import opencv

__all__ = ["Frame", "VideoReader", "as_rgb"]

Frame = NDArray[np.uint8]

#: Bytes that kept frames may take.
CACHE = 192 * 2**20
#: Frames before the wanted one that are kept when they are passed anyway.
PASSED = 6
#: A step back of at most this many frames is taken for the first of many.
BACKWARDS = 3


def as_rgb(picture: NDArray[np.uint8]) -> Frame:
    """What OpenCV gives (blue, green, red, or grey) as red, green, blue."""
    cv2 = opencv()
    code = cv2.COLOR_GRAY2RGB if picture.ndim == 2 else cv2.COLOR_BGR2RGB
    frame: Frame = cv2.cvtColor(picture, code)
    return frame


class VideoReader:
    """Exact random access to the frames of a video.

    A frame is known by its timestamp, never by counting: each one that the decoder gives is looked
    up in the index of timestamps.

    Parameters
    ----------
    path : Path
        The video.
    index : Index, optional
        Its index, if it was read before with :func:`~forcelab.video.index.indexing`.
    cache : int
        Bytes that kept frames may take; at least two frames are kept.

    Attributes
    ----------
    times : ndarray of float64, shape (n,)
        Timestamp of each frame in seconds, strictly increasing, from 0 for the first frame.
    remark : str
        What is to be said about the file; empty where nothing is.

    Raises
    ------
    InputError
        If the file cannot be read, has no frame, or its codec cannot be decoded.

    Notes
    -----
    Not for several threads at once.
    """

    def __init__(self, path: Path, index: Index | None = None, cache: int = CACHE) -> None:
        cv2 = opencv()
        self.path = Path(path)
        self.index = finish(indexing(self.path)) if index is None else index
        self.times = self.index.times
        self.remark = self.index.remark
        self._decoders = Decoders(self.path, self.index)
        self._decoder = self._decoders[0]  # the one that goes on
        rate = self._decoder.get(cv2.CAP_PROP_FPS)
        self._period = 1 / rate if rate > 0 else 1 / 30
        self._room = cache
        self._bytes = 0
        self._kept: OrderedDict[int, Frame] = OrderedDict()
        self._asked = -1

    def __len__(self) -> int:
        return len(self.times)

    def __enter__(self) -> VideoReader:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Let go of the file and of what is kept."""
        self._decoders.close()
        self._kept.clear()
        self._bytes = 0

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the frames in pixels, as shown."""
        height, width = self.frame(0).shape[:2]
        return width, height

    @property
    def rate(self) -> float:
        """Frames a second: the inverse of the median period; 0 for a single frame."""
        return float(1 / np.median(np.diff(self.times))) if len(self) > 1 else 0.0

    @property
    def position(self) -> int:
        """The frame that was decoded last; -1 if that is not known."""
        return self._decoder.at

    @property
    def capacity(self) -> int:
        """How many frames are kept at most."""
        frame = next(iter(self._kept.values()), None)
        return max(2, self._room // frame.nbytes) if frame is not None else 2

    def index_at(self, time: float) -> int:
        """The last frame at or before a time (s); -1 before the first."""
        return last_at(self.times, time)

    def kept(self, number: int) -> Frame | None:
        """A frame if it is decoded already."""
        frame = self._kept.get(number)
        if frame is not None:
            self._kept.move_to_end(number)
        return frame

    def frame(self, number: int) -> Frame:
        """One frame.

        Parameters
        ----------
        number : int
            From 0, in the order of their times.

        Returns
        -------
        ndarray of uint8, shape (height, width, 3)
            Red, green, blue; contiguous and read-only.

        Raises
        ------
        IndexError
            If there is no such frame.
        InputError
            If it cannot be decoded.
        """
        result: list[Frame] = []

        def relayed() -> Iterator[None]:
            result.append((yield from self.reaching(number)))

        for _ in relayed():
            pass
        return result[0]

    def reaching(self, number: int, passed: int | None = None) -> Generator[None, None, Frame]:
        """Decode up to a frame as a job that yields after each frame that is passed.

        Whoever stops iterating loses nothing: the next request goes on from there.

        Parameters
        ----------
        number : int
            From 0, in the order of their times.
        passed : int, optional
            How many of the frames before it are kept when they are passed; by default a few, and
            many once somebody goes backwards.

        Returns
        -------
        ndarray of uint8, shape (height, width, 3)
            As of :meth:`frame`.

        Raises
        ------
        IndexError, InputError
            As :meth:`frame`.
        """
        if not 0 <= number < len(self):
            raise IndexError(f"no frame {number} in a video of {len(self)}")
        back = 0 < self._asked - number <= BACKWARDS
        self._asked = number
        kept = self.kept(number)
        if kept is not None:
            return kept
        behind = 0 if passed is None else passed
        if passed is None:
            behind = self.capacity // 2 if back else 0
            passed = behind or min(PASSED, self.capacity // 4)
        near = self._decoders.near(number, self._decoder, behind)
        decoder = self._decoder = near or self._decoders.spare()
        if near is None:
            yield from self._go_before(decoder, number, passed)
        while number not in self._kept:
            if not self._step(decoder, number - passed, number) or decoder.at > number:
                decoder.lost = True
                raise self._undecodable(number)
            yield
        return self._kept[number]

    def _go_before(self, decoder: Decoder, number: int, passed: int) -> Generator[None, None, None]:
        """Bring a decoder to a frame at or before the wanted one, as near as may be."""
        keys = self.index.keys
        for place in range(self._decoders.start(number), 0, -1):
            if decoder.send(float(self.times[keys[place]]) + (LEAD - 0.4) * self._period):
                yield
                if self._step(decoder, number - passed, number) and decoder.at <= number:
                    return
            yield
        sent = decoder.send(0.0) and self._step(decoder, number - passed, number)
        if not sent or decoder.at > number:
            decoder.restart()
        yield

    def _step(self, decoder: Decoder, low: int, high: int) -> bool:
        """Decode the next frame, and keep it if it is in low .. high."""
        if not decoder.step():
            return False
        if low <= decoder.at <= high and decoder.at not in self._kept:
            self._keep(decoder.at, decoder.picture())
        return True

    def _keep(self, number: int, picture: NDArray[np.uint8] | None) -> None:
        """Keep a frame as OpenCV gives it; the ones longest unused make room."""
        if picture is None:
            return
        frame = as_rgb(picture)
        frame.flags.writeable = False
        self._kept[number] = frame
        self._bytes += frame.nbytes
        while self._bytes > self._room and len(self._kept) > 2:
            self._bytes -= self._kept.popitem(last=False)[1].nbytes

    def _undecodable(self, number: int) -> InputError:
        """What is said of a frame that cannot be decoded."""
        return InputError(
            f"Frame {number + 1} of '{self.path}', at {self.times[number]:.3f} s, cannot be "
            f"decoded; copy the video again, or convert it to H.264."
        )
