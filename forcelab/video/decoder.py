"""Where decoding goes on in a video: at one place in it, or at several that were left as they were.

Where key frames are far apart, a frame costs the decoding of all since the one before it. Who jumps
about in a video comes near places where he was before: decoders that were left there are nearer to
what is wanted than the key frame is. With sixteen of them half of the jumps in a video of 1500
frames, 250 from key frame to key frame, decode fewer than 42 frames, and one in twenty more than
135; with a single one it is 129 and 251.
"""

from __future__ import annotations

import os
from bisect import bisect_right
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.video.index import Index, open_video
from forcelab.video.opencv import opencv

__all__ = ["LEAD", "Decoder", "Decoders"]

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
    """One place in a video, from which frames are decoded one after the other.

    Parameters
    ----------
    path : Path
        The video.
    index : Index
        Its index.

    Attributes
    ----------
    at : int
        The frame that was decoded last; -1 before the first one.
    lost : bool
        Whether it is where no frame is known.

    Raises
    ------
    InputError
        If there is no such file, or it is no video.
    """

    def __init__(self, path: Path, index: Index) -> None:
        self._path, self._index = path, index
        self._capture = open_video(path)
        self.at, self.lost = -1, False

    def get(self, what: int) -> float:
        """A property of the video, by OpenCV's number of it."""
        value: float = self._capture.get(what)
        return value

    def send(self, time: float) -> bool:
        """Go to a time (s); where that came out the next step shows. False if it went nowhere."""
        self.at, self.lost = -1, True
        stamp = 1000 * (time + self._index.origin) if time else 0.0
        sent: bool = self._capture.set(opencv().CAP_PROP_POS_MSEC, stamp)
        return sent

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
        """Go to the beginning, whatever went wrong.

        Raises
        ------
        InputError
            If the file is not there any more.
        """
        self.close()
        self._capture = open_video(self._path)
        self.at, self.lost = -1, False

    def close(self) -> None:
        """Let go of the file."""
        self._capture.release()


class Decoders:
    """The decoders of one video; never empty.

    Parameters
    ----------
    path : Path
        The video.
    index : Index
        Its index.
    room : int
        Bytes that all but the first may take, about.

    Raises
    ------
    InputError
        If there is no such file, or it is no video.
    """

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
        """Let go of the file."""
        for decoder in self._all:
            decoder.close()

    def start(self, number: int) -> int:
        """The place among the key frames where one begins that comes out at or before a frame."""
        return max(bisect_right(self._keys, number - LEAD - 2) - 1, 0)

    def near(self, number: int, last: Decoder, behind: int) -> Decoder | None:
        """The one that is nearest before a frame; None where its key frame is nearer.

        Parameters
        ----------
        number : int
            The frame.
        last : Decoder
            That went on last.
        behind : int
            How many of the frames before are wanted, too: another decoder has to come by them.
        """
        first = self._keys[self.start(number)] - LEAD
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
            behind.append(self._keys[place + 1] + LEAD + 2)
        return max(min(behind) - places[i], 0) * max(places[i] - before, 0)

    def _affordable(self, room: int) -> int:
        """How many there may be."""
        cv2 = opencv()
        if max(np.diff([*self._keys, len(self._index.times)]), default=0) <= SHORT:
            return 1
        first = self._all[0]
        pixels = first.get(cv2.CAP_PROP_FRAME_WIDTH) * first.get(cv2.CAP_PROP_FRAME_HEIGHT)
        each = PIXEL * max(pixels, 1.0) * (HELD + (os.cpu_count() or 1))
        return min(1 + int(room / each), MOST)
