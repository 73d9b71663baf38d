"""Pictures in the messages of a bag, written as a video each topic.

JPEG goes into the video as it is; PNG and raw pixels are encoded as JPEG.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, Final

import numpy as np

from forcelab.clock import ClockMap
from forcelab.demonstration import VideoReference
from forcelab.errors import InputError
from forcelab.formats.alignment import TimedRows
from forcelab.formats.fields import values_within
from forcelab.formats.recording import ColumnUse, ReadOptions, Use
from forcelab.formats.rosbag_topics import Topic, TopicData
from forcelab.jobs import Progress
from forcelab.project.files import file_errors
from forcelab.text import amount, counted, left_out
from forcelab.video.pictures import (
    JpegPicture,
    PictureError,
    PictureVideo,
    UnknownPictureError,
    read_picture,
    read_pixels,
    size_text,
)

_RAW: Final = "sensor_msgs/msg/Image"
#: Fields of each type that holds pictures, besides header and data, and what the library makes of
#: them; a bag may define them otherwise.
_TYPES: Final[dict[str, dict[str, type]]] = {
    _RAW: {"encoding": str, "width": int, "height": int, "step": int, "is_bigendian": int},
    "sensor_msgs/msg/CompressedImage": {"format": str},
}
#: Letters of a format or encoding that a sentence has room for.
_LONGEST: Final = 40


def is_picture(message: Any) -> bool:
    """Whether a message of the library holds a picture."""
    data, kinds = getattr(message, "data", None), _TYPES.get(message.__msgtype__)
    return (
        kinds is not None
        and isinstance(data, np.ndarray)
        and data.dtype == np.uint8
        and all(isinstance(getattr(message, name, None), kind) for name, kind in kinds.items())
    )


def select_pictures(
    topics: Sequence[Topic], options: ReadOptions
) -> tuple[list[TopicData], dict[str, str]]:
    """The topics of pictures to make videos of, empty yet, and a sentence on each that is none."""
    selected: list[TopicData] = []
    left: dict[str, str] = {}
    for topic in topics:
        if not is_picture(topic.first) or _left_out(topic, topics, options):
            continue
        kind, trouble = _describe(topic.first)
        pictures = f"Pictures of {topic.name} ({kind})"
        if options.unpack is None:
            left[topic.name] = f"{pictures} become a video when the bag is imported."
        elif trouble:
            left[topic.name] = f"{pictures} were left out: {trouble}."
        else:
            selected.append(TopicData(topic))
    return selected, left


def preview_pictures(topic: Topic, topics: Sequence[Topic], options: ReadOptions) -> ColumnUse:
    """What the pictures of a topic are read as."""
    kind, trouble = _describe(topic.first)
    if trouble:
        return ColumnUse(topic.name, "", "left out", (kind,), choices=("left out",))
    use: Use = "left out" if _left_out(topic, topics, options) else "video"
    return ColumnUse(topic.name, "", use, (kind,), choices=("video", "left out"))


def _left_out(topic: Topic, topics: Sequence[Topic], options: ReadOptions) -> bool:
    """Whether a topic is to be left out: by its own name, or by that of what it lies in.

    The name of another topic stands for that alone: ``/camera/compressed`` lies beside ``/camera``.
    """
    others = {other.name.removeprefix("/") for other in topics if other is not topic}
    return values_within(
        topic.name, *(name for name in options.leave_out if name.removeprefix("/") not in others)
    )


def _describe(message: Any) -> tuple[str, str]:
    """What a message's picture is, such as ``"rgb8, 640 x 480"``.

    Also why no picture like it becomes part of a video; empty where they do.
    """
    trouble = ""
    try:
        picture = _read(message)
        return f"{picture.source}, {size_text(picture.size)}", ""
    except UnknownPictureError as error:
        trouble = str(error)
    except PictureError:  # which others need not be
        pass
    if message.__msgtype__ != _RAW:
        return str(message.format[:_LONGEST]), trouble
    return f"{message.encoding[:_LONGEST]}, {size_text((message.width, message.height))}", trouble


def write_video(
    messages: Iterator[tuple[int, Any]],
    frames: TimedRows,
    path: Path,
    count: Callable[[str], Progress],
    *,
    strict: bool,
) -> Generator[Progress, None, tuple[VideoReference | None, tuple[str, ...]]]:
    """Write the pictures of a topic into a new file, one after the other; also gives remarks.

    `count` counts those of a topic. Pictures that are damaged, or of another size than the first,
    are left out; `strict` refuses them.
    """
    topic, times = frames.name, dict(zip(frames.rows.tolist(), frames.times.tolist(), strict=True))
    fault, bad_count = "", 0
    sources: dict[str, None] = {}
    with (
        file_errors(f"The pictures of {topic} were not written to '{path}'"),
        closing(PictureVideo(path)) as video,
    ):
        for row, (_, message) in enumerate(messages):
            yield count(topic)
            if row not in times:
                continue
            try:
                picture = _read(message)
                video.write(picture, times[row])
            except PictureError as error:
                bad_count, fault = bad_count + 1, fault or f"message {row + 1:,}: {error}"
                if strict:
                    raise InputError(
                        f"{topic}, {fault}; leave the topic out (--leave-out {topic})."
                    ) from error
            else:
                sources[picture.source] = None
    remarks = list(frames.remarks)
    if bad_count:
        remarks.append(f"{left_out(bad_count, f'picture of {topic}')}; {fault}.")
    if not video.count:
        return None, tuple(remarks)
    how = "as in the bag" if list(sources) == ["JPEG"] else f"{', '.join(sources)} encoded as JPEG"
    frame_count, size = counted(video.count, "frame"), size_text(video.size)
    file_size = amount(path.stat().st_size)
    remarks.insert(0, f"{topic} became a video: {frame_count} of {size} ({how}), {file_size}.")
    return VideoReference(path, ClockMap(video.start), topic), tuple(remarks)


def _read(message: Any) -> JpegPicture:
    """The picture in a message."""
    if message.__msgtype__ != _RAW:
        return read_picture(message.data.tobytes())
    return read_pixels(
        message.encoding,
        message.width,
        message.height,
        message.step,
        bool(message.is_bigendian),
        message.data,
    )
