"""Pictures as they come from elsewhere, and videos of them.

JPEG is checked and stays as it is; PNG and raw pixels are decoded, and encoded as JPEG.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from forcelab.video.codecs import opencv
from forcelab.video.jpeg_writer import JpegVideoWriter, encode_jpeg

#: Pixels of a picture at most, 8192 x 8192: what is decoded takes three bytes for each.
MOST_PIXELS: Final = 2**26


class PictureError(ValueError):
    """Why a picture cannot be used, as the end of a sentence."""


class UnknownPictureError(PictureError):
    """Why no picture of its kind can be."""


@dataclass(frozen=True, slots=True)
class JpegPicture:
    """A picture as JPEG."""

    data: bytes
    size: tuple[int, int]  #: width and height in pixels
    source: str  #: what it was: JPEG, PNG, or the encoding of raw pixels


class PictureVideo:
    """A video of pictures that come one by one; all have the size of the first."""

    def __init__(self, path: Path) -> None:
        """The file is written from the first picture on."""
        self.path = path
        self.count, self.size = 0, (0, 0)
        self.start = 0.0  #: time of the first picture, s
        self._writer: JpegVideoWriter | None = None

    def write(self, picture: JpegPicture, time: float) -> None:
        """Write a picture taken at a time (s); `PictureError` if it is of another size."""
        if self._writer is None:
            self._writer = JpegVideoWriter(self.path, *picture.size)
            self.size, self.start = picture.size, time
        elif picture.size != self.size:
            raise PictureError(f"it is of {size_text(picture.size)}, others {size_text(self.size)}")
        self._writer.write(picture.data, time - self.start)
        self.count += 1

    def close(self) -> None:
        """Finish the file, if one was begun."""
        if self._writer is not None:
            self._writer.close()


def size_text(size: tuple[int, int]) -> str:
    """Width and height in words."""
    return f"{size[0]} x {size[1]}"


_JPEG, _PNG = b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n"
_JPEG_END, _PNG_END = b"\xff\xd9", b"IEND\xaeB`\x82"
#: Markers of JPEG: without content, of a frame (its size; the first three can be decoded in a
#: video), and of the scan, which is at the end of the headers.
_BARE: Final = frozenset([0x01, *range(0xD0, 0xD9)])
_FRAMES: Final = frozenset({*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC})
_DECODED: Final = frozenset([0xC0, 0xC1, 0xC2])
_SCAN: Final = 0xDA


def read_picture(data: bytes) -> JpegPicture:
    """The picture in a file of JPEG or PNG; `PictureError` if it is damaged.

    Of JPEG only the headers and the end are looked at; what is behind the end is cut off.
    """
    return _encode(_decode_png(data), "PNG") if data.startswith(_PNG) else _check_jpeg(data)


def _encode(picture: NDArray[np.uint8], source: str) -> JpegPicture:
    return JpegPicture(encode_jpeg(picture), (picture.shape[1], picture.shape[0]), source)


def _check_jpeg(data: bytes) -> JpegPicture:
    if not data:
        raise PictureError("it is empty")
    if not data.startswith(_JPEG):
        raise UnknownPictureError("it is neither JPEG nor PNG")
    data = _whole(data, _JPEG_END)
    at = 2
    try:
        while data[at] == 0xFF:
            marker = data[at + 1]
            if marker == 0xFF or marker in _BARE:
                at += 1 if marker == 0xFF else 2
                continue
            if marker in _FRAMES:
                height, width = struct.unpack_from(">HH", data, at + 5)
                if marker not in _DECODED:
                    raise UnknownPictureError("it is JPEG of a kind that videos do not hold")
                return JpegPicture(data, _checked_size(width, height), "JPEG")
            if marker == _SCAN:
                break
            at += 2 + struct.unpack_from(">H", data, at + 2)[0]
    except (IndexError, struct.error):
        pass
    raise PictureError("its headers are damaged")


def _whole(data: bytes, end: bytes) -> bytes:
    """The data of a picture up to its end, behind which drivers leave zeros."""
    data = data.rstrip(b"\0")
    if not data.endswith(end):
        raise PictureError("it ends too early")
    return data


def _checked_size(width: int, height: int) -> tuple[int, int]:
    if not (width and height):
        raise PictureError("it has no pixels")
    if width * height > MOST_PIXELS:
        raise PictureError(f"it is of {width:,} x {height:,} pixels, which no camera has")
    return width, height


def _decode_png(data: bytes) -> NDArray[np.uint8]:
    """A PNG picture: grey (height, width), or (height, width, 3) in blue, green, red."""
    width, height, bits, colours = struct.unpack_from(">IIBB", _whole(data, _PNG_END).ljust(26), 16)
    _checked_size(width, height)
    if (bits, colours) == (16, 0):
        raise UnknownPictureError("it is of 16 bits and one channel, as depths are")
    cv2 = opencv()
    how = cv2.IMREAD_COLOR if colours else cv2.IMREAD_GRAYSCALE
    try:
        picture: NDArray[np.uint8] | None = cv2.imdecode(np.frombuffer(data, np.uint8), how)
    except cv2.error:
        picture = None
    if picture is None:
        raise PictureError("it is damaged")
    return picture


@dataclass(frozen=True, slots=True)
class _Layout:
    """How the pixels of a raw picture lie."""

    channels: int
    bits: int = 8
    #: OpenCV's name of the conversion to grey or blue, green, red; empty where it is that.
    convert: str = ""


#: By the names of ROS; OpenCV names a mosaic by its second row, where ROS names the first.
_LAYOUTS: Final = {
    "bgr8": _Layout(3),
    "rgb8": _Layout(3, 8, "RGB2BGR"),
    "bgra8": _Layout(4, 8, "BGRA2BGR"),
    "rgba8": _Layout(4, 8, "RGBA2BGR"),
    "bgr16": _Layout(3, 16),
    "rgb16": _Layout(3, 16, "RGB2BGR"),
    "bgra16": _Layout(4, 16, "BGRA2BGR"),
    "rgba16": _Layout(4, 16, "RGBA2BGR"),
    "mono8": _Layout(1),
    "mono16": _Layout(1, 16),
    "8UC1": _Layout(1),
    "8UC3": _Layout(3),
    "yuv422": _Layout(2, 8, "YUV2BGR_UYVY"),
    "uyvy": _Layout(2, 8, "YUV2BGR_UYVY"),
    "yuv422_yuy2": _Layout(2, 8, "YUV2BGR_YUY2"),
    "yuyv": _Layout(2, 8, "YUV2BGR_YUY2"),
} | {
    f"bayer_{ros}{bits}": _Layout(1, bits, f"Bayer{opencv_order}2BGR")
    for ros, opencv_order in (("rggb", "BG"), ("bggr", "RG"), ("gbrg", "GR"), ("grbg", "GB"))
    for bits in (8, 16)
}


def read_pixels(
    encoding: str, width: int, height: int, step: int, big_endian: bool, data: NDArray[np.uint8]
) -> JpegPicture:
    """A raw picture of ROS; `PictureError` if it is damaged.

    Of 16 bits the upper eight are taken. `step` is the bytes from row to row.
    """
    layout = _LAYOUTS.get(encoding)
    if layout is None:
        depth = encoding in ("16UC1", "32FC1")
        is_what = "holds depths" if depth else "is not known"
        raise UnknownPictureError(f"its encoding '{encoding[:40]}' {is_what}")
    _checked_size(width, height)
    row = width * layout.channels * layout.bits // 8
    if step < row or data.size < step * height:
        raise PictureError(
            f"it has {data.size:,} bytes in rows of {step:,}, too few for {width} x {height} "
            f"pixels of {encoding}"
        )
    rows = data[: step * height].reshape(height, step)[:, :row]
    if layout.bits == 16:
        rows = rows[:, 0 if big_endian else 1 :: 2]
    shape = (height, width, layout.channels) if layout.channels > 1 else (height, width)
    picture = np.ascontiguousarray(rows).reshape(shape)
    if layout.convert:
        cv2 = opencv()
        try:
            picture = cv2.cvtColor(picture, getattr(cv2, f"COLOR_{layout.convert}"))
        except cv2.error as error:  # such as a mosaic of a single column
            raise PictureError(f"{width} x {height} pixels cannot be {encoding}") from error
    return _encode(picture, encoding)
