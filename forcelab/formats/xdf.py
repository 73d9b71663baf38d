"""XDF files of the Lab Streaming Layer: several streams, each on a clock of its own.

Their clocks are corrected by the offsets that were measured while recording. A regular stream is
stamped by when its samples came, which jitters: its stamps are evened out, which leaves less than a
hundredth of the error, unless samples were lost. A loss in the middle would make even stamps wrong
by half of its length everywhere; there, and in irregular streams, stamps are kept as they are.
"""

from __future__ import annotations

import io
import logging
import math
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, Final
from xml.etree.ElementTree import ParseError, fromstring

import numpy as np
from numpy.typing import NDArray

from forcelab.clock import farthest_drift
from forcelab.demonstration import Channel
from forcelab.errors import InputError
from forcelab.extras import load_extra
from forcelab.formats.fields import numbered
from forcelab.formats.recording import ColumnUse, ReadOptions, Recording
from forcelab.formats.signatures import naming_damage
from forcelab.formats.streams import Events, Stream, make_recording, preview_streams
from forcelab.text import listed, unique_names

_MAGIC: Final = b"XDF:"
_FILE_HEADER, _STREAM_HEADER, _SAMPLES, _CLOCK, _BOUNDARY, _FOOTER = range(1, 7)
#: Bytes of a value of each format; of a text those that tell its length.
_SIZES: Final = {
    **{"int8": 1, "int16": 2, "int32": 4, "int64": 8, "float32": 4, "double64": 8, "string": 2}
}
#: Channels of a stream, and bytes of a header, at most.
_MOST_CHANNELS: Final = 10_000
_MOST_HEADER: Final = 1 << 24
#: Seconds between two stamps that end an even run of samples.
_BREAK: Final = 1.0
#: Seconds by which a packet may be late; beyond that a clock was set back.
_LONGEST_BURST: Final = 10.0
_CURE: Final = "copy it again from where it is from"


def sniff(_path: Path, head: bytes) -> bool:
    """Whether a file begins as XDF does."""
    return head.startswith(_MAGIC)


def read(path: Path, options: ReadOptions) -> list[Recording]:
    """Read all streams as one demonstration, called like the file.

    Marker streams are labels. What stands behind damage, as of a recorder that was ended, is left
    out with a remark.
    """
    streams, events, remarks = _load(path, options)
    return [make_recording(path, streams, events, options, remarks)]


def preview(path: Path, options: ReadOptions) -> tuple[ColumnUse, ...]:
    """What the channels and markers would be read as."""
    streams, events, _ = _load(path, options)
    return preview_streams(streams, events, options)


def _load(path: Path, options: ReadOptions) -> tuple[list[Stream], list[Events], list[str]]:
    """The streams and markers in a file, and remarks on what was left out or repaired."""
    load_extra("pyxdf", "xdf", f"'{path}' is an XDF file, which")
    import pyxdf

    remarks = []
    with path.open("rb") as file:
        end, damage = _whole_part(file)
        file.seek(0)
        if damage:
            text = f"the file is damaged at byte {end:,} ({damage})"
            if options.strict:
                raise InputError(f"'{path}': {text}; {_CURE}, or let it be repaired.")
            remarks.append(f"{text.capitalize()}; what stands behind that was left out.")
        source = io.BytesIO(file.read(end)) if damage else file
        with naming_damage(path, "XDF file", _CURE), _refusing_logged():
            found, _ = pyxdf.load_xdf(source, dejitter_timestamps=False)
            names = unique_names([_text(stream["info"], "name") or "stream" for stream in found])
            filled = [
                (name, stream)
                for name, stream in zip(names, found, strict=True)
                if len(stream["time_stamps"])
            ]
            events = [_events(name, stream) for name, stream in filled if _is_events(stream)]
            pairs = [_stream(name, stream) for name, stream in filled if not _is_events(stream)]
    empty = [name for name in names if name not in {name for name, _ in filled}]
    if empty:
        remarks.append(f"No samples came from {listed(empty)}.")
    remarks += [f"{stream.name}: {remark}" for stream, remark in pairs if remark]
    return [stream for stream, _ in pairs], events, remarks


def _first(info: Any, name: str) -> Any:
    """The first of a name in a header, of which the library holds a list; empty where it is not."""
    return info[name][0] if isinstance(info, dict) and info.get(name) else ""


def _text(info: Any, name: str) -> str:
    text = _first(info, name)
    return " ".join(text.split()) if isinstance(text, str) else ""


def _is_events(stream: Any) -> bool:
    """Whether a stream tells what happens: words, or irregular numbers that are called markers."""
    info = stream["info"]
    kind = f"{_text(info, 'type')} {_text(info, 'name')}".lower()
    called = "marker" in kind or "event" in kind
    irregular = float(_text(info, "nominal_srate")) == 0
    single = _text(info, "channel_count") == "1"
    text = _text(info, "channel_format") == "string"
    return text or (called and irregular and single)


def _events(name: str, stream: Any) -> Events:
    """The markers of a stream."""
    words = [" ".join(" ".join(map(str, sample)).split()) for sample in stream["time_series"]]
    return Events(name, np.asarray(stream["time_stamps"], np.float64), words)


def _stream(name: str, stream: Any) -> tuple[Stream, str]:
    """A stream of numbers, and a remark on its stamps if there is one."""
    values = np.asarray(stream["time_series"], np.float64)
    times = np.asarray(stream["time_stamps"], np.float64)
    info, width = stream["info"], values.shape[1]
    channels_info = _first(_first(info, "desc"), "channels")
    listing = channels_info.get("channel", []) if isinstance(channels_info, dict) else []
    headers = [*listing, *[{}] * width][:width]
    labels = [_text(header, "label") for header in headers]
    pairs = zip(labels, numbered(name, width), strict=True)
    named = unique_names([label or default for label, default in pairs])
    units = [_text(header, "unit") for header in headers]
    channels = tuple(map(Channel, named, units))
    remark = ""
    rate = float(_text(info, "nominal_srate"))
    if rate > 0 and times.size > 2 and np.isfinite(times).all():
        even = _even_times(times, rate)
        if even is None and (even := _spread_bursts(times, rate)) is not None:
            remark = (
                "its stamps come in bursts, which were spread at its rate, by up to "
                f"{float((times - even).max()):.3g} s."
            )
        elif even is None:
            remark = "samples are missing between its stamps, which were kept as they are."
        elif (moved := float(np.abs(even - times).max())) > 1e-6:
            remark = (
                f"its samples come at an even rate, and its stamps were evened out, by up to "
                f"{moved:.3g} s."
            )
        times = times if even is None else even
    return Stream(name, times, values, channels), remark


def _even_times(times: NDArray[np.float64], rate: float) -> NDArray[np.float64] | None:
    """Even stamps nearest to some, run by run between breaks; None where samples are missing.

    Samples are missing where stamps drift from even ones by more than a period.
    """
    even = times.copy()
    for run in np.split(np.arange(times.size), np.flatnonzero(np.diff(times) > _BREAK) + 1):
        if run.size < 3:
            continue
        places = run - run.mean()
        middle = float(times[run].mean())
        slope = float(places @ (times[run] - middle) / (places @ places))
        if slope <= 0:
            return None
        even[run] = middle + slope * places
        window = max(1, min(max(20, round(rate)), run.size // 4))
        if farthest_drift(times[run] - even[run], window) > slope:
            return None
    return even


def _spread_bursts(times: NDArray[np.float64], rate: float) -> NDArray[np.float64] | None:
    """The latest stamps at most `rate` a second that are no later than some; None if no bursts.

    A device that sends packets, as by Bluetooth, has its samples stamped when they arrive, so that
    most steps are far too short, or packets overlap.
    """
    steps = np.diff(times)
    if np.median(steps) > 0.5 / rate and (steps > 0).all():
        return None
    places = np.arange(times.size, dtype=np.float64) * min(
        1 / rate, float(times[-1] - times[0]) / steps.size
    )
    spread: NDArray[np.float64] = places + np.minimum.accumulate((times - places)[::-1])[::-1]
    return spread if float((times - spread).max()) <= _LONGEST_BURST else None


def _whole_part(file: BinaryIO) -> tuple[int, str]:
    """How many bytes of a file are whole chunks that can be read, and what is wrong behind them.

    The library believes every number, and allocates as much.
    """
    size = file.seek(0, io.SEEK_END)
    end = file.seek(len(_MAGIC))
    streams: dict[int, int] = {}  # the least bytes of a sample
    while end < size:
        try:
            length = _read_length(file)
            start = file.tell()
            if not 2 <= length <= size - start:
                raise ValueError(f"a chunk of {length:,} bytes")
            _check_chunk(file, length, streams)
        except (struct.error, ValueError, LookupError, TypeError, ParseError) as error:
            return end, " ".join(str(error).split())[:160]
        end = file.seek(start + length)
    return size, ""


def _check_chunk(file: BinaryIO, length: int, streams: dict[int, int]) -> None:
    """Raise a ValueError or the like if a chunk cannot be read; learn what streams there are."""
    start = file.tell()
    (tag,) = struct.unpack("<H", file.read(2))
    number = 0
    if tag in {_STREAM_HEADER, _SAMPLES, _CLOCK, _FOOTER}:
        (number,) = struct.unpack("<I", file.read(4))
        if tag != _STREAM_HEADER and number not in streams:
            raise ValueError(f"stream {number} without a header")
    if tag in {_FILE_HEADER, _STREAM_HEADER, _FOOTER}:
        size = start + length - file.tell()
        if size > _MOST_HEADER:
            raise ValueError(f"a header of {size:,} bytes")
        header = fromstring(file.read(size).decode("utf-8", "replace"))
        if tag == _STREAM_HEADER:
            channels = int(_required_text(header, "channel_count"))
            rate = float(_required_text(header, "nominal_srate"))
            width = _SIZES[_required_text(header, "channel_format")]
            if not 1 <= channels <= _MOST_CHANNELS or not 0 <= rate < math.inf:
                raise ValueError(f"a stream of {channels} channels at {rate} Hz")
            streams[number] = 1 + channels * width
    elif tag == _CLOCK and length != 22:
        raise ValueError("a clock offset of a wrong size")
    elif tag == _SAMPLES and (count := _read_length(file)) * streams[number] > length:
        raise ValueError(f"{count:,} samples in {length:,} bytes")


def _required_text(header: Any, name: str) -> str:
    """A text that a stream's header has to have."""
    text = header.findtext(name)
    if text is None:
        raise ValueError(f"a stream without {name}")
    return str(text)


def _read_length(file: BinaryIO) -> int:
    """A number that is preceded by how many bytes it has."""
    (width,) = struct.unpack("<B", file.read(1))
    if width not in {1, 4, 8}:
        raise ValueError("no length where one should be")
    number = file.read(width)
    if len(number) != width:
        raise ValueError("the end of the file in a length")
    return int.from_bytes(number, "little")


@contextmanager
def _refusing_logged() -> Iterator[None]:
    """Raise what the library would only log, as of a part that it skips."""
    logger = logging.getLogger("pyxdf.pyxdf")
    refusing = _Refusing(logging.ERROR)
    before = logger.propagate
    logger.addHandler(refusing)
    logger.propagate = False  # its warnings are of clocks and rates, of which remarks tell
    try:
        with np.errstate(invalid="ignore", over="ignore"):
            yield
    finally:
        logger.removeHandler(refusing)
        logger.propagate = before


class _Refusing(logging.Handler):
    """Raises what is logged."""

    def emit(self, record: logging.LogRecord) -> None:
        raise ValueError(record.getMessage())
