"""Stretches of videos as files of their own, without decoding them."""

from __future__ import annotations

import errno
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.extras import load_extra

#: Seconds by which metadata may be off the time of a frame; frames are never that close.
_SAME = 5e-4
#: Key frames that are tried, one before the other, until decoding can begin before a stretch.
_TRIES = 8


@dataclass(frozen=True, slots=True)
class VideoCut:
    first: float  #: what the video it was cut from calls the time of the first frame, s
    times: NDArray[np.float64]  #: of the frames in the stretch, by the same clock, s, increasing


def cut_video(source: Path, start: float, end: float, target: Path) -> VideoCut:
    """Copy the packets shown from `start` to before `end` (s) of an MP4 file into a new one.

    Decoding begins at the key frame at or before the start, so that earlier frames may come first.
    The extra `lerobot` has the library that this takes.
    """
    av = load_extra("av", "lerobot", f"'{source}', a stretch of which is a video,")
    if not source.is_file():
        raise InputError(f"the video '{source}' is missing; copy or download it again")
    try:
        # Of this kind alone: lists of other files, which FFmpeg would open, are none.
        with av.open(str(source.absolute()), format="mp4") as read:
            stream = read.streams.video[0]
            first = _seek(read, stream, start)
            with av.open(str(target.absolute()), "w", format="mp4") as write:
                cut = _copy(read, stream, first, write, (start, end))
    except (av.FFmpegError, IndexError, ValueError) as error:
        if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
            raise
        raise InputError(
            f"the video '{source}' is damaged or no MP4 file; copy or download it again"
        ) from error
    if not len(cut.times):
        raise InputError(f"the video '{source}' has no frame between {start:g} s and {end:g} s")
    return cut


def _seek(read: Any, stream: Any, start: float) -> int:
    """Go to the last key frame at or before a time; gives its stamp."""
    latest = place = round((start + _SAME) / stream.time_base)
    for _ in range(_TRIES):
        read.seek(place, stream=stream)
        packet = next((p for p in read.demux(stream) if p.pts is not None), None)
        if packet is None or packet.pts <= latest:
            break
        place = min(place, packet.dts) - 1  # it is decoded before the start, but shown after it
    else:
        packet = None
    read.seek(place if packet is not None else 0, stream=stream)
    return int(packet.pts) if packet is not None else 0


def _copy(read: Any, stream: Any, first: int, write: Any, stretch: tuple[float, float]) -> VideoCut:
    """Copy packets from where a file stands; the first frame gets the time 0."""
    start, end = (edge - _SAME for edge in stretch)
    copied = write.add_stream_from_template(stream, opaque=True)  # copying needs no encoder
    copied.time_base = stream.time_base
    times = []
    for packet in read.demux(stream):
        if packet.pts is None or packet.dts is None or packet.pts < first:
            continue  # the end, or what is shown before the key frame and needs what is before it
        if packet.dts * stream.time_base >= end:
            break
        stamp = float(packet.pts * stream.time_base)
        if start <= stamp < end:
            times.append(stamp)
        packet.pts, packet.dts, packet.stream = packet.pts - first, packet.dts - first, copied
        write.mux(packet)
    return VideoCut(float(first * stream.time_base), np.unique(np.array(times)))
