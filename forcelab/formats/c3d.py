"""C3D files of motion capture: analog channels, such as those of force platforms, and events.

Read here and not by a library: the one that there is for Python ends the program over damaged files
(13 of 600 with a byte or four changed). Times count from the first frame that was ever captured, as
those of the events do, so that a part that was cut out keeps its own.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Channel
from forcelab.errors import InputError
from forcelab.formats.recording import ColumnUse, ReadOptions, Recording
from forcelab.formats.signatures import naming_damage
from forcelab.formats.streams import Events, Stream, make_recording, preview_streams
from forcelab.text import unique_names

_BLOCK: Final = 512
_KEY: Final = 0x50
#: Processors in whose format numbers are written; the fourth byte of the parameters says which.
_INTEL, _DEC, _MIPS = 84, 85, 86
#: NumPy's types by the kinds of parameters; other kinds are texts.
_KINDS: Final = {1: "u1", 2: "i2", 4: "f4"}
_ANALOG, _POINTS = "analog", "points"
_CURE: Final = "copy it again from where it is from"

#: Values of parameters by the name of their group and their own, both in capitals.
_Parameters = Mapping[tuple[str, str], Any]


def sniff(_path: Path, head: bytes) -> bool:
    """Whether a file begins as C3D does, and its parameters too."""
    if len(head) < 2 * _BLOCK or head[1] != _KEY or head[0] < 2:
        return False
    start = (head[0] - 1) * _BLOCK
    return len(head) > start + 3 and head[start + 3] in {_INTEL, _DEC, _MIPS}


def read(path: Path, options: ReadOptions) -> list[Recording]:
    """Read a file as one demonstration, called like it.

    Analog channels are signals, points only where they are asked for. Events are labels: each lasts
    until the next one of its context.
    """
    streams, events, remarks = _load(path)
    if remarks and options.strict:
        raise InputError(
            f"'{path}': {remarks[0].removesuffix('.')}; {_CURE}, or let the rest be left out."
        )
    return [make_recording(path, streams, events, options, remarks)]


def preview(path: Path, options: ReadOptions) -> tuple[ColumnUse, ...]:
    """What the channels, points and events would be read as."""
    streams, events, _ = _load(path)
    return preview_streams(streams, events, options)


@dataclass(frozen=True, slots=True)
class _Numbers:
    """How numbers are written."""

    processor: int

    def read(self, data: bytes, kind: str) -> NDArray[Any]:
        """Numbers of a NumPy type without byte order."""
        order = ">" if self.processor == _MIPS else "<"
        if kind == "f4" and self.processor == _DEC:
            # Its halves are the other way round, and its exponent is two more.
            halves = np.frombuffer(data, "<u2").reshape(-1, 2)[:, ::-1]
            return np.ascontiguousarray(halves).view("<f4").ravel() / 4
        return np.frombuffer(data, order + kind)


def _load(path: Path) -> tuple[list[Stream], list[Events], list[str]]:
    """Analog channels and points of a file, the events of each context, and remarks."""
    # Damaged numbers may be none.
    with path.open("rb") as file, np.errstate(invalid="ignore", over="ignore"):
        size = file.seek(0, os.SEEK_END)
        file.seek(0)
        header = file.read(_BLOCK)
        with naming_damage(path, "C3D file", _CURE):
            file.seek((header[0] - 1) * _BLOCK)
            # Parameters tell how many blocks they have; 255 are more than there is room for.
            numbers, parameters = _parameters(file.read(255 * _BLOCK))
            layout = _layout(header, numbers, parameters, size)
            if not layout.frame_bytes:
                raise InputError(
                    f"'{path}' holds neither analog channels nor points; there is nothing to "
                    "import."
                )
            file.seek(layout.start)
            data = file.read(layout.frames * layout.frame_bytes)
            streams = _streams(data, layout, numbers, parameters)
    remarks = []
    if layout.frames < layout.stated:
        remarks.append(f"The file ends after {layout.frames:,} of its {layout.stated:,} frames.")
    elif size - layout.start - layout.frames * layout.frame_bytes >= _BLOCK:
        remarks.append(
            f"The file says that it has {layout.frames:,} frames, and has room for more, which "
            "were not read."
        )
    return streams, _events(parameters), remarks


def _parameters(block: bytes) -> tuple[_Numbers, _Parameters]:
    """How numbers are written, and the parameters."""
    numbers = _Numbers(block[3])
    if numbers.processor not in {_INTEL, _DEC, _MIPS}:
        raise ValueError(f"numbers of an unknown processor, {numbers.processor}")
    names: dict[int, str] = {}
    values: dict[tuple[int, str], Any] = {}
    at = 4
    while at + 2 <= len(block):
        length, group = struct.unpack_from("<bb", block, at)
        if length == 0 or group == 0:
            break
        length = abs(length)
        name = block[at + 2 : at + 2 + length].decode("latin-1").strip().upper()
        place = at + 2 + length
        (offset,) = struct.unpack_from(">H" if numbers.processor == _MIPS else "<H", block, place)
        if group < 0:
            names[-group] = name
        else:
            values[group, name] = _value(block, place + 2, numbers)
        if offset == 0:
            break
        at = place + offset
    return numbers, {(names.get(group, ""), name): value for (group, name), value in values.items()}


def _value(block: bytes, at: int, numbers: _Numbers) -> list[str] | NDArray[Any]:
    """The value of a parameter: texts, or numbers with the first index running fastest."""
    kind, dimensions = struct.unpack_from("<bB", block, at)
    shape = list(block[at + 2 : at + 2 + dimensions])
    start = at + 2 + dimensions
    count = int(np.prod(shape, dtype=object)) if shape else 1
    if kind not in {-1, *_KINDS}:
        raise ValueError(f"a parameter of an unknown type, {kind}")
    size = count * abs(kind)
    if start + size > len(block):
        raise ValueError(f"a parameter of {size:,} bytes")
    content = block[start : start + size]
    if kind == -1:
        width = shape[0] if shape else 1
        texts = [content[i : i + width] for i in range(0, size, width)] if width else []
        return [
            " ".join(text.decode("utf-8", "replace").replace("\0", " ").split()) for text in texts
        ]
    return numbers.read(content, _KINDS[kind]).reshape(shape or [1], order="F")


@dataclass(frozen=True, slots=True)
class _Layout:
    """Where the samples are: in each frame those of the points, then those of analog channels."""

    start: int  #: byte of the first frame
    frames: int  #: that are there
    stated: int  #: frames that there should be
    first: int  #: number of the first frame, counted from 1
    rate: float  #: frames a second
    points: int
    channels: int
    times: int  #: analog samples of a channel in a frame
    real: bool  #: whether samples are float numbers, as against whole ones

    @property
    def frame_bytes(self) -> int:
        return (4 if self.real else 2) * (4 * self.points + self.channels * self.times)


def _layout(header: bytes, numbers: _Numbers, parameters: _Parameters, size: int) -> _Layout:
    """Where the samples are; header and parameters have to agree with the size of the file."""
    words = [int(word) for word in numbers.read(header, "u2")]
    points, measured, first, last = words[1:5]
    times = words[9]
    scale, rate = numbers.read(header[12:16], "f4")[0], numbers.read(header[20:24], "f4")[0]
    rate = _number(parameters, "POINT", "RATE", float(rate))
    if rate == 0 and times:
        rate = _number(parameters, "ANALOG", "RATE", 0) / times
    if not 1e-3 < rate < 1e6:
        raise ValueError(f"{rate:g} frames a second")
    channels = measured // times if times else 0
    if times > 1 and measured == _number(parameters, "ANALOG", "USED", 0):
        channels = measured  # The MotionMonitor counts its channels, not the samples of a frame
    frames = last - first + 1
    long = parameters.get(("POINT", "FRAMES"), ())
    if last == 0xFFFF and len(long):  # more than the header has room for
        stated = int(long[0]) & 0xFFFF
        frames = max(frames, int(_number(parameters, "POINT", "LONG_FRAMES", stated)))
        ends = parameters.get(("TRIAL", "ACTUAL_END_FIELD"), ())
        starts = parameters.get(("TRIAL", "ACTUAL_START_FIELD"), ())
        if len(ends) == len(starts) == 2:
            frames = max(frames, _long(ends) - _long(starts) + 1)
    start, real = (words[8] - 1) * _BLOCK, bool(scale < 0)
    layout = _Layout(start, frames, frames, first, rate, points, channels, times, real)
    if not layout.frame_bytes:
        return layout
    if start < _BLOCK or frames < 1:
        raise ValueError("no samples")
    room = max(0, size - start) // layout.frame_bytes
    if not room:
        raise ValueError(f"no room for {frames:,} frames")
    return replace(layout, frames=min(frames, room))


def _long(words: Sequence[Any]) -> int:
    """A number in two words, the lower one first."""
    return (int(words[0]) & 0xFFFF) + (int(words[1]) & 0xFFFF) * 0x10000


def _number(parameters: _Parameters, group: str, name: str, default: float) -> float:
    """The first number of a parameter, or the default where it has none."""
    value = parameters.get((group, name))
    if isinstance(value, np.ndarray) and value.size and np.isfinite(value.flat[0]):
        return float(value.flat[0])
    return default


def _listing(
    parameters: _Parameters, group: str, name: str, count: int, filler: Any = ""
) -> list[Any]:
    """So many values of a parameter; beyond 255 they go on in NAME2, NAME3 and so on."""
    values: list[Any] = []
    for number in ("", *range(2, 100)):
        more = parameters.get((group, f"{name}{number}"))
        if more is None:
            break
        values += more if isinstance(more, list) else more.ravel(order="F").tolist()
    return [*values, *[filler] * count][:count]


def _streams(
    data: bytes, layout: _Layout, numbers: _Numbers, parameters: _Parameters
) -> list[Stream]:
    """The analog channels in their units, and the points."""
    kind = "f4" if layout.real else "i2"
    samples = numbers.read(data, kind).reshape(layout.frames, -1)
    start = (layout.first - 1) / layout.rate
    streams = []
    width = 4 * layout.points
    if count := layout.channels:
        raw = samples[:, width:].reshape(-1, count)
        (text,) = _listing(parameters, "ANALOG", "FORMAT", 1)
        unsigned = text.upper() == "UNSIGNED"
        words = unsigned and not layout.real
        values = (raw.astype(np.int16).view(np.uint16) if words else raw).astype(np.float64)
        offsets = _listing(parameters, "ANALOG", "OFFSET", count, 0)
        scales = _listing(parameters, "ANALOG", "SCALE", count, 1)
        if unsigned:
            offsets = [int(offset) & 0xFFFF for offset in offsets]
        values = (values - offsets) * scales * _number(parameters, "ANALOG", "GEN_SCALE", 1)
        labels = _listing(parameters, "ANALOG", "LABELS", count)
        units = _listing(parameters, "ANALOG", "UNITS", count)
        named = unique_names([label or f"channel {i}" for i, label in enumerate(labels, 1)])
        streams.append(
            Stream(
                _ANALOG,
                start + np.arange(len(values)) / (layout.rate * layout.times),
                values,
                tuple(Channel(name, unit) for name, unit in zip(named, units, strict=True)),
            )
        )
    if layout.points:
        points = samples[:, :width].reshape(layout.frames, layout.points, 4).astype(np.float64)
        if not layout.real:
            points[:, :, :3] *= abs(_number(parameters, "POINT", "SCALE", 1))
        points[points[:, :, 3] < 0] = np.nan  # was not seen
        labels = _listing(parameters, "POINT", "LABELS", layout.points)
        (unit,) = _listing(parameters, "POINT", "UNITS", 1)
        named = unique_names([label or f"point {i}" for i, label in enumerate(labels, 1)])
        streams.append(
            Stream(
                _POINTS,
                start + np.arange(layout.frames) / layout.rate,
                points[:, :, :3].reshape(layout.frames, -1),
                tuple(Channel(f"{name}.{axis}", unit) for name in named for axis in "xyz"),
                chosen=False,
            )
        )
    return streams


def _events(parameters: _Parameters) -> list[Events]:
    """The events of each context, such as Left and Right."""
    times = parameters.get(("EVENT", "TIMES"))
    if not isinstance(times, np.ndarray) or times.ndim != 2 or times.shape[0] != 2:
        return []
    count = times.shape[1]
    seconds = times[0].astype(np.float64) * 60 + times[1]
    labels = _listing(parameters, "EVENT", "LABELS", count)
    contexts = [str(name or "General") for name in _listing(parameters, "EVENT", "CONTEXTS", count)]
    rows: dict[str, list[int]] = {}
    for row, name in enumerate(contexts):
        rows.setdefault(name, []).append(row)
    return [
        Events(name, seconds[places], [str(labels[i]) for i in places])
        for name, places in rows.items()
    ]
