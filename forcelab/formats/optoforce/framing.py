"""Frames in a stream of bytes: a header, a known length, and the sum of all bytes at the end.

A stream is read from the left. Where no frame starts, or one with a wrong checksum, the reading
goes on by one byte only, as the bytes of a header may lie inside a payload. That order is kept
although a whole stretch is looked at together: numpy searches the headers, and the sums of all that
were found are differences of one cumulative sum.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

__all__ = ["FrameType", "Frames", "clean_run", "find_frames", "is_start", "sealed"]

#: The first byte of every header, and the number of bytes of one.
_START, _HEADER = 170, 4


@dataclass(frozen=True, slots=True)
class FrameType:
    """One type of frame.

    Parameters
    ----------
    header : bytes, length 4
        The first of them is 170.
    size : int
        Its bytes, header and checksum included.
    """

    header: bytes
    size: int


@dataclass(frozen=True)
class Frames:
    """What was found in a stretch of bytes.

    Parameters
    ----------
    starts, sizes : ndarray of int64, shape (n,)
        Place and length of each valid frame, in bytes; they never overlap.
    types : ndarray of int64, shape (n,)
        Which of the types that were looked for.
    bad : ndarray of int64, shape (m,)
        Places of the headers that the reading stood at and whose checksum was wrong.
    used : int
        Bytes that were read; what follows may be the start of a frame.
    """

    starts: NDArray[np.int64]
    sizes: NDArray[np.int64]
    types: NDArray[np.int64]
    bad: NDArray[np.int64]
    used: int

    @property
    def skipped(self) -> int:
        """Bytes that were read and are in no frame."""
        return self.used - int(self.sizes.sum())

    def before(self, place: int) -> Frames:
        """What was found before a place that lies in no frame, or at the start of one."""
        keep = self.starts < place
        return Frames(
            self.starts[keep],
            self.sizes[keep],
            self.types[keep],
            self.bad[self.bad < place],
            place,
        )


def sealed(body: bytes) -> bytes:
    """A header and payload with their checksum behind them."""
    return body + (sum(body) & 0xFFFF).to_bytes(2, "big")


def find_frames(array: NDArray[np.uint8], types: Sequence[FrameType], *, final: bool) -> Frames:
    """Find the valid frames in a stretch of bytes, from the left.

    Parameters
    ----------
    array : ndarray of uint8, shape (n,)
        The bytes.
    types : sequence of FrameType
        With distinct headers.
    final : bool
        Whether nothing follows. If something may follow, the reading stops at the first frame that
        is not complete, as nobody knows yet whether it is one.
    """
    places, kinds, sizes = _headers(array, types)
    complete = places + sizes <= len(array)
    valid = complete.copy()
    valid[complete] = _sums_agree(array, places[complete], sizes[complete])
    chosen = _never_overlapping(places[valid], sizes[valid])
    starts, lengths = places[valid][chosen], sizes[valid][chosen]
    frames = Frames(starts, lengths, kinds[valid][chosen], starts[:0], len(array))
    frames = replace(frames, bad=_outside(frames, places[complete & ~valid]))
    if not final:
        torn = _torn_header(array, types)
        unfinished = _outside(frames, np.concatenate([places[~complete], torn]))
        if unfinished.size:
            frames = frames.before(int(unfinished[0]))
    return frames


def clean_run(data: bytes, frame: FrameType) -> int:
    """How many valid packets stand at the start, one right behind the other.

    A device that is read live gives a few packets at a time: this is tenfold faster for them.
    """
    place, size = 0, frame.size
    while place + size <= len(data) and data.startswith(frame.header, place):
        end = place + size
        total = sum(data[place : end - 2]) & 0xFFFF
        if total != data[end - 2] << 8 | data[end - 1]:
            break
        place = end
    return place // size


def is_start(data: bytes, frame: FrameType) -> bool:
    """Whether all that is left is the unfinished start of a packet, or nothing."""
    return len(data) < frame.size and data[:4] == frame.header[: len(data)]


def _headers(
    array: NDArray[np.uint8], types: Sequence[FrameType]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Places of all whole headers, which type each has, and how long its frame is."""
    places = np.flatnonzero(array[: max(len(array) - _HEADER + 1, 0)] == _START)
    rest = array[places + 1].astype(np.int64) << 16
    rest |= array[places + 2].astype(np.int64) << 8
    rest |= array[places + 3]
    kinds = np.full(len(places), -1, np.int64)
    for number, known in enumerate(types):
        kinds[rest == int.from_bytes(known.header[1:], "big")] = number
    known_ones = kinds >= 0
    kinds = kinds[known_ones]
    lengths = np.array([known.size for known in types], np.int64)
    return places[known_ones], kinds, lengths[kinds]


def _torn_header(array: NDArray[np.uint8], types: Sequence[FrameType]) -> NDArray[np.int64]:
    """Places at the very end where the first bytes of a header stand."""
    first = max(len(array) - _HEADER + 1, 0)
    end = array[first:].tobytes()
    return np.array(
        [
            first + i
            for i in range(len(end))
            if any(known.header.startswith(end[i:]) for known in types)
        ],
        np.int64,
    )


def _sums_agree(
    array: NDArray[np.uint8], places: NDArray[np.int64], sizes: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Whether each frame ends with the sum of its bytes, modulo 65,536."""
    if not places.size:
        return np.zeros(0, np.bool_)
    # A sum that wraps at 2 ** 32 leaves differences right.
    sums = np.cumsum(array, dtype=np.uint32)
    ends = places + sizes
    total = sums[ends - 3] - sums[places] + array[places]
    told = array[ends - 2].astype(np.uint32) * 256 + array[ends - 1]
    agree: NDArray[np.bool_] = (total & 0xFFFF) == told
    return agree


def _never_overlapping(places: NDArray[np.int64], sizes: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which frames are met when each is followed by the next one that starts behind its end."""
    chosen = np.ones(len(places), np.bool_)
    if np.any(places[1:] < places[:-1] + sizes[:-1]):
        free = 0
        for i, (place, size) in enumerate(zip(places.tolist(), sizes.tolist(), strict=True)):
            chosen[i] = place >= free
            if place >= free:
                free = place + size
    return chosen


def _outside(frames: Frames, places: NDArray[np.int64]) -> NDArray[np.int64]:
    """Those of some places that lie inside no valid frame."""
    if not frames.starts.size or not places.size:
        return places
    before = np.searchsorted(frames.starts, places, side="right") - 1
    ends = frames.starts[before] + frames.sizes[before]
    outside: NDArray[np.int64] = places[(before < 0) | (places >= ends)]
    return outside
