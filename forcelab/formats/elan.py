"""ELAN files: read (EAF 2.7 to 3.0), and written (EAF 3.0) with a tier for each author."""

from __future__ import annotations

import math
import mimetypes
import os
import re
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import datetime, timezone
from pathlib import Path
from typing import BinaryIO
from urllib.parse import unquote
from xml.etree import ElementTree as ET
from xml.parsers import expat

import numpy as np

from forcelab.demonstration import Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.formats.label_files import LabelOptions, LabelSet, own_stem
from forcelab.formats.tiers import Annotation, Tier, tracks_of_tiers
from forcelab.labels import Track
from forcelab.text import counted
from forcelab.vocabulary import COLOURS

_SCHEMA = "http://www.mpi.nl/tools/elan/EAFv3.0.xsd"
_XSI = "http://www.w3.org/2001/XMLSchema-instance"
#: What XML 1.0 cannot hold, not even escaped.
_UNPRINTABLE = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_TYPE, _VOCABULARY, _LANGUAGE = "action", "actions", "und"
#: The part of ELAN that reads a time series from a table.
_TABLE_READER = "mpi.eudico.client.annotator.timeseries.csv.CSVServiceProvider"
#: Samples of a demonstration that ELAN gets at most.
MOST_SAMPLES = 600_000
#: Who made our files, by which their times are known to be on the force clock.
AUTHOR = "forcelab"


def to_elan(
    tracks: Iterable[Track],
    videos: Iterable[VideoReference],
    folder: Path,
    vocabulary: Iterable[str] = (),
    linked: Iterable[str] = (),
) -> bytes:
    """All tracks of a demonstration as an ELAN file, with a link to each of its videos.

    Annotations are on the force clock; its zero in a video is the time origin of that media. The
    links start from `folder`, where the file will lie. The actions of the `vocabulary`, and those
    of the tracks, are what ELAN offers for an annotation. `linked` are the names of files that lie
    beside it, such as of a time series.
    """
    tracks = tuple(tracks)
    used = (action for track in tracks for action in track.actions)
    entries = dict.fromkeys([*vocabulary, *used])
    entry_ids = {action: f"cve{number}" for number, action in enumerate(entries, start=1)}
    root = ET.Element(
        "ANNOTATION_DOCUMENT",
        {
            "AUTHOR": AUTHOR,
            "DATE": _now(),
            "FORMAT": "3.0",
            "VERSION": "3.0",
            "xmlns:xsi": _XSI,
            "xsi:noNamespaceSchemaLocation": _SCHEMA,
        },
    )
    header = ET.SubElement(root, "HEADER", MEDIA_FILE="", TIME_UNITS="milliseconds")
    for video in videos:
        _link(header, video, folder)
    for name in linked:
        ET.SubElement(
            header,
            "LINKED_FILE_DESCRIPTOR",
            LINK_URL=_xml_text(_url(folder / name)),
            MIME_TYPE="text/xml" if name.endswith(".xml") else "text/plain",
            RELATIVE_LINK_URL=_xml_text(f"./{name}"),
        )
    order = ET.SubElement(root, "TIME_ORDER")
    number = 0
    for track in tracks:
        tier = ET.SubElement(
            root,
            "TIER",
            ANNOTATOR=_xml_text(track.author),
            LINGUISTIC_TYPE_REF=_TYPE,
            TIER_ID=_xml_text(track.author),
        )
        for segment in track.segments:
            start, end = (_milliseconds(float(time)) for time in (segment.start, segment.end))
            if start >= end:
                raise InputError(
                    f"'{segment.action}' of {track.author} at {segment.start:.4f} s is shorter "
                    f"than a millisecond, which ELAN files cannot hold; lengthen or delete it."
                )
            number += 1
            slots = {f"ts{2 * number - 1}": str(start), f"ts{2 * number}": str(end)}
            for slot, time in slots.items():
                ET.SubElement(order, "TIME_SLOT", TIME_SLOT_ID=slot, TIME_VALUE=time)
            first, last = slots
            annotation = ET.SubElement(
                ET.SubElement(tier, "ANNOTATION"),
                "ALIGNABLE_ANNOTATION",
                ANNOTATION_ID=f"a{number}",
                CVE_REF=entry_ids[segment.action],
                TIME_SLOT_REF1=first,
                TIME_SLOT_REF2=last,
            )
            ET.SubElement(annotation, "ANNOTATION_VALUE").text = _xml_text(segment.action)
    ET.SubElement(header, "PROPERTY", NAME="lastUsedAnnotationId").text = str(number)
    ET.SubElement(
        root,
        "LINGUISTIC_TYPE",
        CONTROLLED_VOCABULARY_REF=_VOCABULARY,
        GRAPHIC_REFERENCES="false",
        LINGUISTIC_TYPE_ID=_TYPE,
        TIME_ALIGNABLE="true",
    )
    ET.SubElement(root, "LANGUAGE", LANG_ID=_LANGUAGE, LANG_LABEL="undetermined (und)")
    words = ET.SubElement(root, "CONTROLLED_VOCABULARY", CV_ID=_VOCABULARY)
    ET.SubElement(words, "DESCRIPTION", LANG_REF=_LANGUAGE)
    for action, id_ in entry_ids.items():
        entry = ET.SubElement(words, "CV_ENTRY_ML", CVE_ID=id_)
        value = ET.SubElement(entry, "CVE_VALUE", DESCRIPTION="", LANG_REF=_LANGUAGE)
        value.text = _xml_text(action)
    return _xml_bytes(root)


def to_time_series(demonstration: Demonstration, table: Path) -> bytes:
    """What tells ELAN how to show the forces of :func:`write_time_series` in the file `table`."""
    root = ET.Element("timeseries", date=_now(), version="1.0")
    source = ET.SubElement(
        root,
        "tracksource",
        {
            "sample-type": "Discontinuous Rate",  # each sample with its own time
            "source-url": _xml_text(_url(table)),
            "time-column": "0",
        },
    )
    ET.SubElement(source, "property", key="provider", value=_TABLE_READER)
    signals = demonstration.signals[:: _stride(demonstration)]
    for column, channel in enumerate(demonstration.channels):
        track = ET.SubElement(source, "track", derivative="0", name=_xml_text(channel.name))
        ET.SubElement(track, "property", {"key": "detect-range", "value": "true"})
        position = ET.SubElement(track, "sample-position")
        ET.SubElement(position, "pos", row="0", col=str(column + 1))
        ET.SubElement(track, "description")
        ET.SubElement(track, "units").text = _xml_text(channel.unit)
        measured = signals[:, column][np.isfinite(signals[:, column])]
        low, high = (measured.min(), measured.max()) if measured.size else (0.0, 1.0)
        ET.SubElement(track, "range", min=f"{low:.6g}", max=f"{high:.6g}")
        colour = COLOURS[column % len(COLOURS)]
        ET.SubElement(track, "color").text = ",".join(
            str(int(colour[place : place + 2], 16)) for place in (1, 3, 5)
        )
    return _xml_bytes(root)


def write_time_series(demonstration: Demonstration, stream: BinaryIO) -> None:
    """Write the forces as a table that ELAN draws: times (s) and channels, separated by tabs.

    ELAN holds times in milliseconds and the whole table in memory: of more than a thousand samples
    a second, and of very long recordings, only every second, third or further one is written.
    """
    stride = _stride(demonstration)
    names = [f"{c.name} [{c.unit}]" if c.unit else c.name for c in demonstration.channels]
    heading = " ".join("\t".join(["time [s]", *names]).splitlines())
    signals = demonstration.signals[::stride]
    table = np.column_stack([demonstration.times[::stride], signals])
    table[:, 1:][~np.isfinite(signals)] = np.nan
    formats = ["%.6f", *["%.6g"] * len(names)]
    # A row that begins with '#' is none to ELAN.
    np.savetxt(stream, table, formats, "\t", header=heading, encoding="utf-8")


def _stride(demonstration: Demonstration) -> int:
    """Every how many-th sample ELAN gets."""
    by_memory = math.ceil(len(demonstration.times) / MOST_SAMPLES)
    return max(1, by_memory, round(0.001 / demonstration.period))


def _url(path: Path) -> str:
    """A file as ELAN writes links to it, which it compares as texts: nothing is escaped."""
    return f"file:///{path.resolve().as_posix().lstrip('/')}"


def _now() -> str:
    return datetime.now(timezone.utc).isoformat(timespec="seconds")


def _xml_bytes(root: ET.Element) -> bytes:
    ET.indent(root)
    content: bytes = ET.tostring(root, encoding="UTF-8", xml_declaration=True)
    return content


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
        link["RELATIVE_MEDIA_URL"] = _xml_text(relative if relative[0] == "." else f"./{relative}")
    origin = _milliseconds(float(video.clock.to_device(0.0)))
    if origin:
        link["TIME_ORIGIN"] = str(origin)
    ET.SubElement(header, "MEDIA_DESCRIPTOR", link)


def _xml_text(text: str) -> str:
    """The text, once it is known that XML can hold it."""
    if _UNPRINTABLE.search(text):
        raise InputError(f"The name {text!a} holds a character that ELAN files cannot; rename it.")
    return text


#: Bytes of the longest file that is read: a million annotations.
LONGEST = 128_000_000
_TIME = re.compile(r"-?\d{1,12}")


def sniff_labels(_path: Path, head: bytes) -> bool:
    """Whether a file is one of ELAN."""
    return b"<ANNOTATION_DOCUMENT" in head.replace(b"\0", b"")


def read_labels(path: Path, options: LabelOptions) -> list[LabelSet]:
    """Read the tiers of an ELAN file whose annotations have times of their own.

    Times of files that this program wrote are seconds of the force clock, whatever the media.
    """
    if path.stat().st_size > LONGEST:
        raise InputError(f"'{path}' is larger than any ELAN file of labels; check what it is.")
    document = _Document(path)
    tiers = document.tiers()
    tracks, remarks = tracks_of_tiers(tiers, options)
    media = {} if document.on_force_clock else document.media
    name = next(filter(None, (Path(file).stem for file in media)), own_stem(path))
    remarks = [*document.remarks, *remarks]
    names = tuple(tier.name for tier in tiers)
    return [LabelSet(name, tracks, None, tuple(remarks), media, resolution=0.001, tiers=names)]


@dataclass(slots=True)
class _TierElement:
    """A tier as it stands in the file: its annotations lie between time slots."""

    name: str
    annotator: str
    #: first and last time slot, text, entry of a controlled vocabulary
    annotations: list[tuple[str, str, str, str]] = field(default_factory=list)
    references: int = 0


class _Document:
    """What an ELAN file holds, read element by element: no entity is ever expanded."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.media: dict[str, float] = {}
        self.on_force_clock = False
        self.remarks: list[str] = []
        self._slots: dict[str, float | None] = {}
        self._tiers: list[_TierElement] = []
        self._values: dict[str, str] = {}  # of controlled vocabularies
        self._entry = ""
        self._annotation = ("", "", "")  # slots and entry of the one that is being read
        self._text: list[str] = []  # since the last element began
        self._value = ""
        self._parser = parser = expat.ParserCreate()
        parser.buffer_text = True
        parser.StartDoctypeDeclHandler = self._refuse_doctype
        parser.StartElementHandler = self._start_root
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self._text.append
        try:
            with path.open("rb") as file:
                parser.ParseFile(file)
        except expat.ExpatError as error:
            why = expat.ErrorString(error.code)
            raise self._error(f"it is not well-formed XML ({why})") from error
        except (LookupError, ValueError) as error:  # of an encoding that it claims to have
            raise self._error("it is not in the encoding that it states") from error

    def tiers(self) -> list[Tier]:
        """The tiers, with the annotations that have times of their own."""
        return [
            Tier(tier.name.strip(), tuple(self._annotations(tier)), tier.annotator.strip())
            for tier in self._tiers
        ]

    def _annotations(self, tier: _TierElement) -> Iterator[Annotation]:
        timeless = tier.references
        for first, last, text, entry in tier.annotations:
            for slot in (first, last):
                if slot not in self._slots:
                    raise InputError(
                        f"'{self._path}': an annotation of tier '{tier.name}' is at the time slot "
                        f"{slot[:40]!a}, which does not exist; open it in ELAN and save it anew."
                    )
            start, end = self._slots[first], self._slots[last]
            if start is None or end is None:
                timeless += 1
                continue
            if end < start:
                raise InputError(
                    f"'{self._path}': an annotation of tier '{tier.name}' goes from {start:g} back "
                    f"to {end:g} s; open it in ELAN and save it anew."
                )
            yield Annotation(start, end, text if text.strip() else self._values.get(entry, ""))
        if timeless:
            was = "has no time of its own and was" if timeless == 1 else "have no times and were"
            self.remarks.append(
                f"{counted(timeless, 'annotation')} of tier '{tier.name}' {was} left out."
            )

    def _error(self, why: str) -> InputError:
        line = self._parser.CurrentLineNumber
        return InputError(f"'{self._path}', line {line}: {why}; open it in ELAN and save it anew.")

    def _refuse_doctype(self, *_: object) -> None:
        raise self._error("it declares a document type, as no ELAN file does")

    def _start_root(self, name: str, attributes: dict[str, str]) -> None:
        if name != "ANNOTATION_DOCUMENT":
            raise self._error(f"it is XML of another kind ('{name[:40]}')")
        self.on_force_clock = attributes.get("AUTHOR") == AUTHOR
        self._parser.StartElementHandler = self._start

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        get = attributes.get
        self._text.clear()
        if name == "HEADER":
            if (unit := get("TIME_UNITS", "milliseconds")) != "milliseconds":
                raise self._error(f"its times are {unit[:40]}, not milliseconds")
        elif name == "MEDIA_DESCRIPTOR":
            url = get("RELATIVE_MEDIA_URL") or get("MEDIA_URL", "")
            media = unquote(url).replace("\\", "/").rpartition("/")[2]
            self.media.setdefault(media, self._seconds(get("TIME_ORIGIN", "0")))
        elif name == "TIME_SLOT":
            value = get("TIME_VALUE")
            self._slots[get("TIME_SLOT_ID", "")] = None if value is None else self._seconds(value)
        elif name == "TIER":
            self._tiers.append(_TierElement(get("TIER_ID", ""), get("ANNOTATOR", "")))
        elif name == "ALIGNABLE_ANNOTATION":
            slots = get("TIME_SLOT_REF1", ""), get("TIME_SLOT_REF2", "")
            self._annotation, self._value = (*slots, get("CVE_REF", "")), ""
        elif name == "REF_ANNOTATION" and self._tiers:
            self._tiers[-1].references += 1
        elif name == "CV_ENTRY_ML":
            self._entry = get("CVE_ID", "")

    def _end(self, name: str) -> None:
        if name == "ANNOTATION_VALUE":
            self._value = "".join(self._text)
        elif name == "CVE_VALUE":
            self._values.setdefault(self._entry, "".join(self._text))
        elif name == "ALIGNABLE_ANNOTATION" and self._tiers:
            first, last, entry = self._annotation
            self._tiers[-1].annotations.append((first, last, self._value, entry))

    def _seconds(self, milliseconds: str) -> float:
        if not _TIME.fullmatch(milliseconds):
            raise self._error(f"{milliseconds[:40]!a} is no whole number of milliseconds")
        return int(milliseconds) / 1000
