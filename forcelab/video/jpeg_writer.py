"""Writes a video of JPEG pictures, each with its own time, that is whole whenever writing ends.

Matroska (RFC 9559): clusters of unknown size, so that nothing written has to be changed later; what
ended is read up to its last whole picture. Closing adds the cues by which players jump.
"""

from __future__ import annotations

import contextlib
import struct
from io import FileIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forcelab.video.codecs import opencv

_SCALE = 1000  # ns, the unit of stamps: what is rounded to it is still the same time to the reader
_PER_SECOND = 1_000_000_000 // _SCALE
_CLUSTER = 2**15 - 1  # longest cluster; a picture's time in it has 16 bits with a sign
_QUALITY = 90  # of pictures that are encoded, in percent
_UNKNOWN = b"\x01\xff\xff\xff\xff\xff\xff\xff"

_EBML, _SEGMENT, _SEEK_HEAD, _VOID = 0x1A45DFA3, 0x18538067, 0x114D9B74, 0xEC
_SEEK, _SEEK_ID, _SEEK_POSITION = 0x4DBB, 0x53AB, 0x53AC
_INFO, _TIMESTAMP_SCALE, _DURATION = 0x1549A966, 0x2AD7B1, 0x4489
_MUXING_APP, _WRITING_APP = 0x4D80, 0x5741
_TRACKS, _TRACK, _NUMBER, _UID, _TYPE = 0x1654AE6B, 0xAE, 0xD7, 0x73C5, 0x83
_LACING, _CODEC, _VIDEO, _WIDTH, _HEIGHT = 0x9C, 0x86, 0xE0, 0xB0, 0xBA
_CLUSTER_ID, _TIMESTAMP, _BLOCK = 0x1F43B675, 0xE7, 0xA3
_CUES, _CUE, _CUE_TIME, _CUE_PLACES, _CUE_TRACK, _CUE_CLUSTER = (
    0x1C53BB6B, 0xBB, 0xB3, 0xB7, 0xF7, 0xF1,
)  # fmt: skip
_EBML_VERSION, _EBML_READ, _EBML_IDS, _EBML_SIZES = 0x4286, 0x42F7, 0x42F2, 0x42F3
_DOC_TYPE, _DOC_VERSION, _DOC_READ = 0x4282, 0x4287, 0x4285


def _element(identity: int, content: bytes) -> bytes:
    name = identity.to_bytes((identity.bit_length() + 7) // 8, "big")
    return name + (len(content) | 1 << 56).to_bytes(8, "big") + content


def _number(identity: int, value: int) -> bytes:
    """An element that is an unsigned number of eight bytes, however small it is."""
    return _element(identity, value.to_bytes(8, "big"))


class JpegVideoWriter:
    """Writes pictures as they come; its methods raise OSError if the file cannot be written."""

    def __init__(self, path: Path, width: int, height: int) -> None:
        """Begin a new file, of which nothing is left where that fails."""
        self._file = FileIO(path, "x")
        self._cues: list[tuple[int, int]] = []
        self._begun = self._last = 0
        video = _number(_WIDTH, width) + _number(_HEIGHT, height)
        track = (
            _number(_NUMBER, 1) + _number(_UID, 1) + _number(_TYPE, 1) + _number(_LACING, 0)
            + _element(_CODEC, b"V_MJPEG") + _element(_VIDEO, video)
        )  # fmt: skip
        head = (
            _number(_EBML_VERSION, 1) + _number(_EBML_READ, 1)
            + _number(_EBML_IDS, 4) + _number(_EBML_SIZES, 8)
            + _element(_DOC_TYPE, b"matroska") + _number(_DOC_VERSION, 4) + _number(_DOC_READ, 2)
        )  # fmt: skip
        start = _element(_EBML, head) + _SEGMENT.to_bytes(4, "big") + _UNKNOWN
        self._segment = len(start)
        room = len(self._seek_head(0))
        start += _element(_VOID, bytes(room - 9))
        self._info = len(start)
        start += self._info_element(0.0) + _element(_TRACKS, _element(_TRACK, track))
        try:
            self._write(start)
        except OSError:
            self._file.close()
            with contextlib.suppress(OSError):
                path.unlink()  # or the next try would find the name taken
            raise

    def write(self, jpeg: bytes, time: float) -> float:
        """Write a picture taken `time` s after the first; gives the time (s) as written."""
        stamp = max(round(time * _PER_SECOND), self._last + 1 if self._cues else 0)
        begun, cluster = self._begun, not self._cues or stamp - self._begun >= _CLUSTER
        place, out = self._file.tell() - self._segment, b""
        if cluster:
            begun = stamp
            out = _CLUSTER_ID.to_bytes(4, "big") + _UNKNOWN + _number(_TIMESTAMP, stamp)
        head = b"\x81" + struct.pack(">hB", stamp - begun, 0x80)
        self._write(out + _element(_BLOCK, head + jpeg))
        if cluster:
            self._cues.append((stamp, place))
        self._begun, self._last = begun, stamp
        return stamp / _PER_SECOND

    def close(self) -> None:
        """Write what helps players to jump, and release the file; closing twice is fine."""
        if self._file.closed:
            return
        try:
            place = self._file.tell() - self._segment
            cues = b"".join(self._cue(stamp, cluster) for stamp, cluster in self._cues)
            self._write(_element(_CUES, cues))
            self._file.truncate()  # of what a full disk once refused
            self._file.seek(self._segment)
            self._write(self._seek_head(place))
            self._file.seek(self._info)
            self._write(self._info_element(float(self._last)))
        finally:
            self._file.close()

    def _write(self, data: bytes) -> None:
        """Write all of it or fail."""
        begin, rest = self._file.tell(), data
        try:
            while rest:
                rest = rest[self._file.write(rest) or 0 :]
        except OSError:
            self._file.seek(begin)  # the next picture replaces what stands there
            raise

    @staticmethod
    def _cue(stamp: int, cluster: int) -> bytes:
        places = _number(_CUE_TRACK, 1) + _number(_CUE_CLUSTER, cluster)
        return _element(_CUE, _number(_CUE_TIME, stamp) + _element(_CUE_PLACES, places))

    @staticmethod
    def _seek_head(place: int) -> bytes:
        """Where the cues are."""
        identity = _element(_SEEK_ID, _CUES.to_bytes(4, "big"))
        return _element(_SEEK_HEAD, _element(_SEEK, identity + _number(_SEEK_POSITION, place)))

    @staticmethod
    def _info_element(duration: float) -> bytes:
        """The file's facts; the duration (in stamps) is known at the end only."""
        content = _number(_TIMESTAMP_SCALE, _SCALE) + _element(_MUXING_APP, b"forcelab")
        content += _element(_WRITING_APP, b"forcelab")
        lasts = _element(_DURATION, struct.pack(">d", duration))
        # A length of zero would be believed.
        return _element(_INFO, content + (lasts if duration else _element(_VOID, bytes(9))))


def encode_jpeg(picture: NDArray[np.uint8]) -> bytes:
    """A picture as JPEG: grey (height, width), or (height, width, 3) in blue, green, red."""
    cv2 = opencv()
    _, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    jpeg: bytes = data.tobytes()
    return jpeg
