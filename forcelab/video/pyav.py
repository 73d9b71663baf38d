"""PyAV in place of OpenCV, for the codec that OpenCV opens and gives no frame of."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.extras import load_extra
from forcelab.video.codecs import opencv

#: Four letters of AV1, of which OpenCV's wheels have no decoder.
AV1 = "av01"
#: Damaged packets after which a decoder stops looking for a whole one.
_TRIES = 64


class PyAvCapture:
    """A video, with what this room uses of OpenCV's `VideoCapture`."""

    def __init__(self, path: Path, opened: Any) -> None:
        """Open a video that OpenCV has opened: what the file states, that still tells."""
        av = load_extra("av", "video", f"The video '{path}' (AV1)")
        self._opened, self._error = opened, av.FFmpegError
        # Tags in an old alphabet are no error from PyAV 19 on, which has no such option any more.
        major = int(av.__version__.partition(".")[0])
        options = {"metadata_errors": "ignore"} if major < 19 else {}
        try:
            self._container = av.open(str(path.absolute()), **options)
            self._stream = self._container.streams.video[0]
        except (av.FFmpegError, IndexError) as error:
            raise InputError(
                f"'{path}' cannot be read as a video: it is damaged or cut short; copy it again."
            ) from error
        self._origin = self._stream.start_time or 0
        self._frames = self._container.decode(self._stream)
        self._frame: Any = None

    def get(self, what: int) -> float:
        """A property by OpenCV's number."""
        if what != opencv().CAP_PROP_POS_MSEC:
            return float(self._opened.get(what))
        if self._frame is None:
            return 0.0
        # As OpenCV reckons, so that packets that it lists have the very same times.
        return float((self._frame.pts - self._origin) * float(self._stream.time_base) * 1000)

    def set(self, what: int, value: float) -> bool:
        """Go to the key frame at or before a time (CAP_PROP_POS_MSEC); nothing else can be set."""
        assert what == opencv().CAP_PROP_POS_MSEC
        stamp = self._origin + round(value / 1000 / self._stream.time_base)
        self._frame = None
        try:
            self._container.seek(stamp, stream=self._stream)
        except self._error:
            return False
        self._frames = self._container.decode(self._stream)
        return True

    def grab(self) -> bool:
        """Decode the next frame; False at the end. Packets that are damaged are passed over."""
        for _ in range(_TRIES):
            try:
                self._frame = next(self._frames)
            except StopIteration:
                return False
            except self._error:
                self._frames = self._container.decode(self._stream)
                continue
            if self._frame.pts is not None:
                return True
        return False

    def retrieve(self) -> tuple[bool, NDArray[np.uint8] | None]:
        """The picture of the frame that was decoded: blue, green, red; turned as the file says."""
        if self._frame is None:
            return False, None
        try:
            picture = self._frame.to_ndarray(format="bgr24")
        except (self._error, ValueError):  # of a kind that cannot be converted
            return False, None
        turns = self._frame.rotation // 90
        return True, np.ascontiguousarray(np.rot90(picture, turns)) if turns else picture

    def read(self) -> tuple[bool, NDArray[np.uint8] | None]:
        return self.retrieve() if self.grab() else (False, None)

    def release(self) -> None:
        self._frames.close()
        self._container.close()
        self._opened.release()
