"""When each frame of a video is shown, read from the file without decoding it."""

from __future__ import annotations

import math
import re
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.video.codecs import opencv
from forcelab.video.pyav import AV1, PyAvCapture

#: Packets, and frames, between two reports of progress, after which the job can be cancelled.
STRETCH, DECODED = 500, 50
#: Frames at the beginning that are decoded to see that their timestamps are the packets'.
COMPARED = 24
#: Codecs whose packets are not all shown: their frames have to be decoded to be counted.
HIDING = ("VP80",)
#: How files begin that hold a video themselves: MP4 and QuickTime, Matroska and WebM, AVI, MPEG
#: program and transport streams (also as cameras write them), Windows Media, Ogg, Flash.
_CONTAINERS = tuple(
    re.compile(signature, re.DOTALL)
    for signature in (
        rb".{4}(?:ftyp|moov|mdat|free|skip|wide|pnot)",
        rb"\x1a\x45\xdf\xa3",
        rb"RIFF.{4}AVI ",
        rb"\x00\x00\x01[\xba\xb3]",
        rb"G.{187}G.{187}G",
        rb".{4}G.{191}G",
        rb"\x30\x26\xb2\x75\x8e\x66\xcf\x11",
        rb"OggS",
        rb"FLV\x01",
    )
)
#: Names that FFmpeg takes for a row of pictures.
_PATTERN = re.compile(r"%\d*d")
#: Seconds below which two timestamps are the same; files keep no finer than 1/1000000 s, and
#: OpenCV hands them on as milliseconds in floating point.
SAME = 1e-6


@dataclass(frozen=True, eq=False)
class Index:
    """The frames of a video in the order in which they are shown; n of them."""

    #: (n,), timestamp of each frame, s, strictly increasing, from 0.
    times: NDArray[np.float64]
    #: (m,), numbers of the frames from which decoding can begin, rising; the first is 0.
    keys: NDArray[np.int64]
    origin: float = 0.0  # what the file itself calls the first frame's time, s
    #: What is to be said about the file, such as where it ends too early; empty where nothing is.
    remark: str = ""

    def number_at(self, stamp: float) -> int:
        """The frame that has a timestamp (s) in the file; -1 where none has it."""
        time = stamp - self.origin
        number = last_at(self.times, time)
        return number if number >= 0 and time - float(self.times[number]) <= SAME else -1


def last_at(times: NDArray[np.float64], time: float) -> int:
    """The last frame at or before a time (s); -1 before the first.

    A frame's own time gives that frame, also when it is off by up to a microsecond from being
    carried to another clock and back.
    """
    return int(np.searchsorted(times, time + SAME, side="right")) - 1


def stated_rate_and_length(path: Path) -> tuple[float, float]:
    """Frames a second and seconds that a video says it has; 0 where it does not say."""
    try:
        with opened_video(path) as capture:
            frames = float(capture.get(opencv().CAP_PROP_FRAME_COUNT))
            rate = float(capture.get(opencv().CAP_PROP_FPS))
    except InputError:
        return 0.0, 0.0
    if not 0 < rate < 1e6:
        return 0.0, 0.0
    return rate, frames / rate if 0 < frames < 1e9 else 0.0


def open_video(path: Path, *, packets: bool = False) -> Any:
    """Open a video, to read its frames or its compressed packets, which needs no decoder.

    What is given is OpenCV's `VideoCapture`, or what takes its place where it has no decoder.
    """
    if not path.is_file():
        raise InputError(
            f"The video '{path}' is not there; put it back or add the demonstration again."
        )
    _refuse_unless_container(path)
    cv2 = opencv()
    options = [cv2.CAP_PROP_FORMAT, -1] if packets else []
    # With its folder before it no name is taken for an address.
    name = str(path.absolute())
    capture = cv2.VideoCapture(name, cv2.CAP_FFMPEG, options)
    if not capture.isOpened():
        raise InputError(
            f"'{path}' cannot be read as a video: it is damaged, cut short or of another kind; "
            f"copy it again, or convert it to H.264 in mp4."
        )
    if packets or codec_of(capture).casefold() != AV1:
        return capture
    if not capture.grab():
        return PyAvCapture(path, capture)
    capture.release()  # of a build of OpenCV that has a decoder
    return cv2.VideoCapture(name, cv2.CAP_FFMPEG, options)


@contextmanager
def opened_video(path: Path, *, packets: bool = False) -> Iterator[Any]:
    """A video as of :func:`open_video`, which is released afterwards."""
    capture = open_video(path, packets=packets)
    try:
        yield capture
    finally:
        capture.release()


def codec_of(capture: Any) -> str:
    """The four letters of an open video's codec."""
    letters = int(capture.get(opencv().CAP_PROP_FOURCC)).to_bytes(4, "little")
    return letters.decode("ascii", "replace").strip("\0 ")


def _refuse_unless_container(path: Path) -> None:
    """Refuse what is not itself a video before a decoder sees it.

    FFmpeg goes by the content, whatever the file is called, and opens what a playlist or a list
    names, on this machine or another; a name with a number in it stands for many pictures.
    """
    try:
        with path.open("rb") as stream:
            start = stream.read(400)
    except OSError as error:
        raise InputError(f"'{path}' cannot be read: {error.strerror}.") from error
    if _PATTERN.search(path.name):
        raise InputError(
            f"The name '{path.name}' stands for a row of pictures; rename the video without '%'."
        )
    if not any(signature.match(start) for signature in _CONTAINERS):
        raise InputError(
            f"'{path}' cannot be read as a video: it is damaged, cut short, or a playlist or "
            f"another kind of file; copy it again, or convert it to H.264 in mp4."
        )


def indexing(path: Path) -> Generator[Progress, None, Index]:
    """Find out when each frame is shown.

    Packets are listed, which takes microseconds each; where they do not tell the frames'
    timestamps, all frames are decoded.
    """
    listed = yield from _list_packets(path, packets=True)
    shown, codec = _beginning(path)
    if not shown:
        _refuse(path, codec, bool(listed.stamps))
    known = np.unique(np.array(listed.stamps))
    exact = (
        codec not in HIDING
        and len(known) == len(listed.stamps)
        and len(known) >= len(shown)
        and bool(np.allclose(known[: len(shown)], shown, rtol=0.0, atol=SAME))
    )
    if not exact:
        decoded = yield from _list_packets(path, packets=False)
        decoded.keys = sorted(set(listed.keys) & set(decoded.stamps))
        listed = decoded
    elif _is_cut(listed):
        # The last packets may be cut or lack what they refer to. What is shown after the first of
        # them is left out too: there is no telling what should be between.
        decoded = yield from _list_packets(path, packets=False)
        lost = set(listed.stamps) - set(decoded.stamps) | {listed.stamps[-1]}
        listed.stamps = [stamp for stamp in listed.stamps if stamp < min(lost)]
    return _index(path, listed)


@dataclass
class _PacketList:
    """What was read from a file from its beginning to its end, in the file's order."""

    stamps: list[float]
    keys: list[float]
    rate: float
    length: float


def _list_packets(path: Path, *, packets: bool) -> Generator[Progress, None, _PacketList]:
    """Read all timestamps (s), and those of the key frames."""
    cv2 = opencv()
    with opened_video(path, packets=packets) as capture:
        rate, count = capture.get(cv2.CAP_PROP_FPS), capture.get(cv2.CAP_PROP_FRAME_COUNT)
        rate = rate if math.isfinite(rate) and rate > 0 else 30.0
        listed = _PacketList([], [], rate, length=max(count, 0.0) / rate)
        stretch = STRETCH if packets else DECODED
        while capture.grab():
            stamp = capture.get(cv2.CAP_PROP_POS_MSEC) / 1000
            listed.stamps.append(stamp)
            if packets and capture.get(cv2.CAP_PROP_LRF_HAS_KEY_FRAME):
                listed.keys.append(stamp)
            done = len(listed.stamps)
            if done % stretch == 0:
                yield Progress(done, max(int(count), done), f"reading the times of {path.name}")
    return listed


def _beginning(path: Path) -> tuple[list[float], str]:
    """Timestamps (s) of the first frames as they are decoded, and the codec's four letters."""
    cv2 = opencv()
    stamps: list[float] = []
    with opened_video(path) as capture:
        codec = codec_of(capture)
        while len(stamps) < COMPARED and capture.grab():
            if not stamps and not capture.retrieve()[0]:
                break
            stamps.append(capture.get(cv2.CAP_PROP_POS_MSEC) / 1000)
    return stamps, codec


def _refuse(path: Path, codec: str, packets: bool) -> NoReturn:
    """Say why there is no frame."""
    if not packets:
        raise InputError(f"The video '{path}' has no frame; record or copy it again.")
    kind = "AV1" if codec.casefold() == AV1 else codec or "unknown"
    raise InputError(
        f"The video '{path}' cannot be decoded (codec {kind}); convert it to H.264, for example "
        f"with: ffmpeg -i {path.name} -c:v libx264 {path.stem}-h264.mp4"
    )


def _is_cut(listed: _PacketList) -> bool:
    """Whether a file ends clearly before what it says is its length."""
    end = max(listed.stamps) + 1 / listed.rate
    return len(listed.stamps) > 1 and listed.length - end > max(0.5, 3 / listed.rate)


def _index(path: Path, listed: _PacketList) -> Index:
    """The index of what was read, with what is to be said of it."""
    times = np.unique(np.array(listed.stamps))
    if not len(times):
        _refuse(path, "", packets=False)
    remark = ""
    if _is_cut(listed):
        remark = (
            f"'{path.name}' is cut short: it ends at {times[-1] - times[0]:.2f} s of "
            f"{listed.length:.2f} s; copy it again if there is a whole one."
        )
    origin = float(times[0])
    keys = np.unique(np.searchsorted(times, np.array([*listed.keys, origin]) - SAME))
    times = times - origin
    times.flags.writeable = False
    return Index(times, keys[keys < len(times)].astype(np.int64), origin, remark)
