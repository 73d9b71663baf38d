"""Tracks of one demonstration as an ELAN file (EAF 3.0): a tier for each author."""

from __future__ import annotations

import math
import mimetypes
import os
import re
from collections.abc import Iterable
from contextlib import suppress
from datetime import datetime, timezone
from pathlib import Path
from xml.etree import ElementTree as ET

from forcelab.demonstration import VideoReference
from forcelab.errors import InputError
from forcelab.labels import Track

__all__ = ["to_elan"]

_SCHEMA = "http://www.mpi.nl/tools/elan/EAFv3.0.xsd"
_XSI = "http://www.w3.org/2001/XMLSchema-instance"
#: What XML 1.0 cannot hold, not even escaped.
_UNPRINTABLE = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_TYPE = "action"


def to_elan(tracks: Iterable[Track], videos: Iterable[VideoReference], folder: Path) -> bytes:
    """All tracks of a demonstration as an ELAN file, with a link to each of its videos.

    Annotations are on the force clock; its zero in a video is the time origin of that media. The
    links start from `folder`, where the file will lie.
    """
    root = ET.Element(
        "ANNOTATION_DOCUMENT",
        {
            "AUTHOR": "forcelab",
            "DATE": datetime.now(timezone.utc).isoformat(timespec="seconds"),
            "FORMAT": "3.0",
            "VERSION": "3.0",
            "xmlns:xsi": _XSI,
            "xsi:noNamespaceSchemaLocation": _SCHEMA,
        },
    )
    header = ET.SubElement(root, "HEADER", MEDIA_FILE="", TIME_UNITS="milliseconds")
    for video in videos:
        _link(header, video, folder)
    order = ET.SubElement(root, "TIME_ORDER")
    slots = 0
    number = 0
    for track in tracks:
        tier = ET.SubElement(
            root,
            "TIER",
            ANNOTATOR=_plain(track.author),
            LINGUISTIC_TYPE_REF=_TYPE,
            TIER_ID=_plain(track.author),
        )
        for segment in track.segments:
            ends = [_milliseconds(float(time)) for time in (segment.start, segment.end)]
            if ends[0] >= ends[1]:
                raise InputError(
                    f"'{segment.action}' of {track.author} at {segment.start:.4f} s is shorter "
                    f"than a millisecond, which ELAN files cannot hold; lengthen or delete it."
                )
            names = []
            for end in ends:
                slots += 1
                names.append(f"ts{slots}")
                ET.SubElement(order, "TIME_SLOT", TIME_SLOT_ID=names[-1], TIME_VALUE=str(end))
            number += 1
            annotation = ET.SubElement(
                ET.SubElement(tier, "ANNOTATION"),
                "ALIGNABLE_ANNOTATION",
                ANNOTATION_ID=f"a{number}",
                TIME_SLOT_REF1=names[0],
                TIME_SLOT_REF2=names[1],
            )
            ET.SubElement(annotation, "ANNOTATION_VALUE").text = _plain(segment.action)
    ET.SubElement(header, "PROPERTY", NAME="lastUsedAnnotationId").text = str(number)
    ET.SubElement(
        root,
        "LINGUISTIC_TYPE",
        GRAPHIC_REFERENCES="false",
        LINGUISTIC_TYPE_ID=_TYPE,
        TIME_ALIGNABLE="true",
    )
    ET.indent(root)
    written: bytes = ET.tostring(root, encoding="UTF-8", xml_declaration=True)
    return written


def _milliseconds(seconds: float) -> int:
    """The nearest whole number; halves go up, as 1.5 and 2.5 would both round to the even 2."""
    return math.floor(round(1000 * seconds, 3) + 0.5)


def _link(header: ET.Element, video: VideoReference, folder: Path) -> None:
    """Link the video, with the video time at which the force clock reads zero."""
    path = video.path.resolve()
    link = {
        "MEDIA_URL": path.as_uri(),
        "MIME_TYPE": mimetypes.guess_type(path.name)[0] or "video/unknown",
    }
    with suppress(ValueError):  # on another drive
        relative = Path(os.path.relpath(path, folder.resolve())).as_posix()
        link["RELATIVE_MEDIA_URL"] = _plain(relative if relative[0] == "." else f"./{relative}")
    origin = _milliseconds(float(video.clock.to_device(0.0)))
    if origin:
        link["TIME_ORIGIN"] = str(origin)
    ET.SubElement(header, "MEDIA_DESCRIPTOR", link)


def _plain(text: str) -> str:
    """The text, once it is known that XML can hold it."""
    if _UNPRINTABLE.search(text):
        raise InputError(f"The name {text!a} holds a character that ELAN files cannot; rename it.")
    return text
