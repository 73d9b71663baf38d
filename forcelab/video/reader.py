"""Frames of a video by their own timestamps: verified seek, a small cache, thumbnails.

Where key frames are far apart, a frame costs the decoding of all since the one before it: half a
second for 250 frames of 1280x720. A thumbnail of it is there in 2 ms. A coder who jumps about in a
video comes near places of before: decoders that were left there are nearer to what is wanted than
the key frame is. With sixteen of them half of the jumps in a video of 1500 frames, 250 from key
frame to key frame, decode fewer than 42 frames, and one in twenty more than 135; with a single one
it is 129 and 251.
"""

from __future__ import annotations

import math
import os
from bisect import bisect_right
from collections import OrderedDict
from collections.abc import Generator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.video.codecs import opencv
from forcelab.video.index import Index, indexing, last_at, open_video, opened_video
from forcelab.video.pyav import PyAvCapture

#: OpenCV goes this many frames before the time it is sent to, and decodes up to it: only from
#: further behind a key frame does it begin at that key frame and not at the one before.
LEAD = 18
#: A damaged frame ends OpenCV's reading as the end of the file does, but one may read on.
TRIES = 4
#: Decoders at most, and the bytes that all but the first may take.
MOST, ROOM = 16, 96 * 2**20
#: Bytes of a decoded pixel, and frames that a decoder holds besides one for each of its threads.
PIXEL, HELD = 1.5, 12
#: Frames from key frame to key frame up to which one decoder is enough.
SHORT = 60


class Decoder:
    """One place in a video, from which frames are decoded one after the other."""

    def __init__(self, path: Path, index: Index) -> None:
        self._path, self._index = path, index
        self._capture = open_video(path)
        self.at = -1  # the frame that was decoded last; -1 before the first one
        self.lost = False  # whether it is where no frame is known

    @property
    def lead(self) -> int:
        """How many frames before the time it is sent to the decoder begins."""
        return 0 if isinstance(self._capture, PyAvCapture) else LEAD

    def get(self, what: int) -> float:
        """A property of the video, by OpenCV's number of it."""
        value: float = self._capture.get(what)
        return value

    def seek(self, time: float) -> bool:
        """Go to a time (s); where that came out the next step shows. False if it went nowhere."""
        self.at, self.lost = -1, True
        stamp = 1000 * (time + self._index.origin) if time else 0.0
        moved: bool = self._capture.set(opencv().CAP_PROP_POS_MSEC, stamp)
        return moved

    def step(self) -> bool:
        """Decode the next frame that is in the index; False where there is none."""
        cv2 = opencv()
        failed = 0
        while failed < TRIES:
            if not self._capture.grab():  # the end, or a frame that is damaged
                failed += 1
                continue
            at = self._index.number_at(self._capture.get(cv2.CAP_PROP_POS_MSEC) / 1000)
            if at >= 0:
                self.at, self.lost = at, False
                return True
        return False

    def picture(self) -> NDArray[np.uint8] | None:
        """The frame it is at, as OpenCV gives it; None where that fails."""
        read, picture = self._capture.retrieve()
        return picture if read else None

    def restart(self) -> None:
        """Go to the beginning, whatever went wrong."""
        self.close()
        self._capture = open_video(self._path)
        self.at, self.lost = -1, False

    def close(self) -> None:
        self._capture.release()


class DecoderPool:
    """The decoders of one video; never empty. All but the first take about `room` bytes."""

    def __init__(self, path: Path, index: Index, room: int = ROOM) -> None:
        self._path, self._index = path, index
        self._keys: list[int] = index.keys.tolist()
        self._all = [Decoder(path, index)]
        self.most = self._affordable(room)

    def __len__(self) -> int:
        return len(self._all)

    def __getitem__(self, place: int) -> Decoder:
        return self._all[place]

    def close(self) -> None:
        for decoder in self._all:
            decoder.close()

    def start(self, number: int) -> int:
        """The place among the key frames where one begins that comes out at or before a frame."""
        return max(bisect_right(self._keys, number - self._all[0].lead - 2) - 1, 0)

    def near(self, number: int, last: Decoder, behind: int) -> Decoder | None:
        """The one that is nearest before a frame; None where its key frame is nearer.

        So many of the frames `behind` are wanted, too: another than the `last` has to come by them.
        """
        first = self._keys[self.start(number)] - last.lead
        fit = [
            decoder
            for decoder in self._all
            if not decoder.lost
            and first <= decoder.at < (number if decoder is last else number - behind)
        ]
        return max(fit, key=lambda decoder: decoder.at, default=None)

    def spare(self) -> Decoder:
        """One to send elsewhere: a new one, or the one that is least missed where it is."""
        if len(self._all) < self.most and not any(decoder.lost for decoder in self._all):
            try:
                self._all.append(Decoder(self._path, self._index))
            except InputError:  # those that are open still read what has been moved or deleted
                self.most = len(self._all)
            else:
                return self._all[-1]
        ranked = sorted(self._all, key=lambda decoder: decoder.at)
        places = [decoder.at for decoder in ranked]
        worths = [-1 if d.lost else self._worth(i, places) for i, d in enumerate(ranked)]
        return ranked[int(np.argmin(worths))]

    def _worth(self, i: int, places: Sequence[int]) -> int:
        """How many frames a decoder saves, over all that it is the nearest one before."""
        place = self.start(places[i] + 1)
        before = max(places[i - 1] if i else -1, self._keys[place])
        behind = [len(self._index.times), *places[i + 1 : i + 2]]
        if place + 1 < len(self._keys):
            behind.append(self._keys[place + 1] + self._all[0].lead + 2)
        return max(min(behind) - places[i], 0) * max(places[i] - before, 0)

    def _affordable(self, room: int) -> int:
        cv2 = opencv()
        if max(np.diff([*self._keys, len(self._index.times)]), default=0) <= SHORT:
            return 1
        first = self._all[0]
        pixels = first.get(cv2.CAP_PROP_FRAME_WIDTH) * first.get(cv2.CAP_PROP_FRAME_HEIGHT)
        each = PIXEL * max(pixels, 1.0) * (HELD + (os.cpu_count() or 1))
        return min(1 + int(room / each), MOST)


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
    up in the index of timestamps, which is read unless it is given. Kept frames take `cache` bytes,
    but at least two are kept. Not for several threads at once.
    """

    def __init__(self, path: Path, index: Index | None = None, cache: int = CACHE) -> None:
        cv2 = opencv()
        self.path = Path(path)
        self.index = finish(indexing(self.path)) if index is None else index
        self.times = self.index.times
        self.remark = self.index.remark
        self._decoders = DecoderPool(self.path, self.index)
        self._decoder = self._decoders[0]  # the one that goes on
        rate = self._decoder.get(cv2.CAP_PROP_FPS)
        self._period = 1 / rate if rate > 0 else 1 / 30
        self._room = cache
        self._bytes = 0
        self._cache: OrderedDict[int, Frame] = OrderedDict()
        self._requested = -1

    def __len__(self) -> int:
        return len(self.times)

    def __enter__(self) -> VideoReader:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Let go of the file and of what is kept."""
        self._decoders.close()
        self._cache.clear()
        self._bytes = 0

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the frames in pixels, as shown."""
        height, width = self.frame(0).shape[:2]
        return width, height

    @property
    def position(self) -> int:
        """The frame that was decoded last; -1 if that is not known."""
        return self._decoder.at

    @property
    def capacity(self) -> int:
        """How many frames are kept at most."""
        frame = next(iter(self._cache.values()), None)
        return max(2, self._room // frame.nbytes) if frame is not None else 2

    def index_at(self, time: float) -> int:
        """The last frame at or before a time (s); -1 before the first."""
        return last_at(self.times, time)

    def cached_frame(self, number: int) -> Frame | None:
        """A frame if it is decoded already."""
        frame = self._cache.get(number)
        if frame is not None:
            self._cache.move_to_end(number)
        return frame

    def frame(self, number: int) -> Frame:
        """One frame, (height, width, 3): red, green, blue; contiguous and read-only.

        Numbers count from 0, in the order of the times. `IndexError` if there is no such frame.
        """
        return finish(self.reaching(number))

    def reaching(self, number: int, passed: int | None = None) -> Generator[None, None, Frame]:
        """Decode up to a frame, as of :meth:`frame`, as a job that yields after each one it passes.

        To stop iterating loses nothing: the next request goes on from there. So many of the frames
        `passed` are kept; by default a few, and many once requests go backwards.
        """
        if not 0 <= number < len(self):
            raise IndexError(f"no frame {number} in a video of {len(self)}")
        back = 0 < self._requested - number <= BACKWARDS
        self._requested = number
        cached_frame = self.cached_frame(number)
        if cached_frame is not None:
            return cached_frame
        behind = 0 if passed is None else passed
        if passed is None:
            behind = self.capacity // 2 if back else 0
            passed = behind or min(PASSED, self.capacity // 4)
        near = self._decoders.near(number, self._decoder, behind)
        decoder = self._decoder = near or self._decoders.spare()
        if near is None:
            yield from self._seek_before(decoder, number, passed)
        while number not in self._cache:
            if not self._step(decoder, number - passed, number) or decoder.at > number:
                decoder.lost = True
                raise InputError(
                    f"Frame {number + 1} of '{self.path}', at {self.times[number]:.3f} s, cannot "
                    f"be decoded; copy the video again, or convert it to H.264."
                )
            yield
        return self._cache[number]

    def _seek_before(
        self, decoder: Decoder, number: int, passed: int
    ) -> Generator[None, None, None]:
        """Bring a decoder to a frame at or before the wanted one, as near as may be."""
        keys = self.index.keys
        ahead = max(decoder.lead - 0.4, 0.0) * self._period
        for place in range(self._decoders.start(number), 0, -1):
            if decoder.seek(float(self.times[keys[place]]) + ahead):
                yield
                if self._step(decoder, number - passed, number) and decoder.at <= number:
                    return
            yield
        began = decoder.seek(0.0) and self._step(decoder, number - passed, number)
        if not began or decoder.at > number:
            decoder.restart()
        yield

    def _step(self, decoder: Decoder, low: int, high: int) -> bool:
        """Decode the next frame, and keep it if it is in low .. high."""
        if not decoder.step():
            return False
        if low <= decoder.at <= high and decoder.at not in self._cache:
            self._keep(decoder.at, decoder.picture())
        return True

    def _keep(self, number: int, picture: NDArray[np.uint8] | None) -> None:
        """Keep a frame as OpenCV gives it; the ones longest unused make room."""
        if picture is None:
            return
        frame = as_rgb(picture)
        frame.flags.writeable = False
        self._cache[number] = frame
        self._bytes += frame.nbytes
        while self._bytes > self._room and len(self._cache) > 2:
            self._bytes -= self._cache.popitem(last=False)[1].nbytes


#: Bytes that the sketches of one video may take: room for some minutes.
THUMBNAIL_ROOM = 128 * 2**20
#: Pixels that a sketch is wide, about, and how well JPEG keeps it.
WIDE, QUALITY = 800, 85
#: Bytes that JPEG takes for a pixel, about, and pixels that a sketch is wide at least.
DENSITY, NARROW = 0.25, 240
#: Frames from key frame to key frame up to which decoding is fast enough without sketches.
SHORT_VIDEO = 30


class Thumbnails:
    """Small pictures of the frames of a video, which may take `room` bytes."""

    def __init__(self, path: Path, index: Index, room: int = THUMBNAIL_ROOM) -> None:
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
        return bool(np.diff(starts).max() > SHORT_VIDEO)

    def making(self) -> Generator[None, None, None]:
        """Go through the video once as a job that yields after each frame; ends where room does."""
        cv2 = opencv()
        with opened_video(self.path) as capture:
            while self._bytes < self._room and capture.grab():
                number = self.index.number_at(capture.get(cv2.CAP_PROP_POS_MSEC) / 1000)
                if number >= 0:
                    read, picture = capture.retrieve()
                    if read:
                        self._pack(number, picture)
                yield

    def get(self, number: int) -> Frame | None:
        """The sketch of a frame, if there is one: uint8, shape (height, width, 3), RGB."""
        packed = self._packed.get(number)
        cv2 = opencv()
        return None if packed is None else as_rgb(cv2.imdecode(packed, cv2.IMREAD_COLOR))

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
