"""TDMS files of LabVIEW: the channels of each group, by their waveforms' times or a time channel.

Words in a channel are labels.
"""

from __future__ import annotations

import logging
import math
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Final

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Channel
from forcelab.errors import InputError, UnclearRateError
from forcelab.extras import load_extra
from forcelab.formats.recording import ColumnUse, ReadOptions, Recording
from forcelab.formats.signatures import naming_damage
from forcelab.formats.streams import Events, Stream, make_recording, preview_streams
from forcelab.formats.table_sniff import Column, is_time_name, unit_of_time
from forcelab.formats.timestamps import TimestampReader
from forcelab.text import listed, unique_names

_MAGIC: Final = b"TDSm"
#: Bytes with which a segment begins, and the bit that says which end of its numbers comes first.
_LEAD, _BIG_ENDIAN = 28, 1 << 6
#: Values of a channel that a preview reads.
_SAMPLE: Final = 400
#: Bytes that a file holds of each word, however short: where it ends.
_WORD_BYTES: Final = 4
_CURE: Final = "copy it again from where it is from, without its .tdms_index"


def sniff(_path: Path, head: bytes) -> bool:
    """Whether a file begins as TDMS does."""
    return head.startswith(_MAGIC)


def read(path: Path, options: ReadOptions) -> list[Recording]:
    """Read all groups as one demonstration, called like the file.

    A channel's times are those of its waveform, else those of the time channel in its group, else
    by the rate in the options.
    """
    streams, events, remarks = _load(path, options)
    return [make_recording(path, streams, events, options, remarks)]


def preview(path: Path, options: ReadOptions) -> tuple[ColumnUse, ...]:
    """What the channels would be read as."""
    streams, events, _ = _load(path, options, most=_SAMPLE)
    return preview_streams(streams, events, options)


def _load(
    path: Path, options: ReadOptions, most: int | None = None
) -> tuple[list[Stream], list[Events], list[str]]:
    """The streams and words of a file, at most so many samples, and remarks on what is left out."""
    load_extra("nptdms", "tdms", f"'{path}' is a TDMS file, which")
    from nptdms import TdmsFile
    from nptdms.log import log_manager

    log_manager.set_level(logging.CRITICAL)  # remarks tell what is left out
    parts: dict[_Key, list[tuple[Channel, NDArray[np.float64]]]] = {}
    words: list[tuple[str, _Key, list[str]]] = []
    left: list[str] = []
    clocks = _Clocks(path, options, most)
    # An index that lies beside the file is not looked at: it may be of another one.
    with (
        path.open("rb") as source,
        naming_damage(path, "TDMS file", _CURE),
        TdmsFile.open(source, raw_timestamps=True) as file,
    ):
        _check_sizes(path, file)
        for group in file.groups():
            clock = _time_channel(group, options)
            for channel in group.channels():
                if channel is clock:
                    continue
                name = f"{group.name}.{channel.name}"
                key = clocks.key(channel, clock)
                if key is None or channel.dtype.kind not in "fiubOUS":
                    left.append(name)
                elif channel.dtype.kind in "OUS":
                    words.append((name, key, [" ".join(str(w).split()) for w in channel[:most]]))
                else:
                    unit = " ".join(str(channel.properties.get("unit_string", "")).split())
                    values = np.asarray(channel[:most], np.float64)
                    parts.setdefault(key, []).append((Channel(channel.name, unit), values))
        cut_off = not _ends_with_segment(source, path.stat().st_size)
    if cut_off and options.strict:
        raise InputError(
            f"'{path}' ends in the middle of a segment; {_CURE}, or let the rest be left out."
        )
    if left and not parts:
        raise UnclearRateError(
            f"'{path}' tells no times of {listed(left)}; name the channel of times, or say "
            "how many samples there are a second."
        )
    names = unique_names([key.group for key in parts])
    streams = [
        Stream(
            name,
            clocks.times[key],
            np.column_stack([values for _, values in channels]),
            tuple(channel for channel, _ in channels),
        )
        for name, (key, channels) in zip(names, parts.items(), strict=True)
    ]
    events = [Events(name, clocks.times[key], texts) for name, key, texts in words]
    remarks = [f"Nothing was read from {listed(left)}."] if left else []
    if cut_off:
        remarks.append("The file ends in the middle of a segment; what is there was read.")
    return streams, events, remarks


def _ends_with_segment(file: BinaryIO, size: int) -> bool:
    """Whether segments, each of which tells its length, fill the file."""
    at = 0
    while at < size:
        file.seek(at)
        lead = file.read(_LEAD)
        if len(lead) < _LEAD or not lead.startswith(_MAGIC):
            return False
        big = struct.unpack_from("<I", lead, 4)[0] & _BIG_ENDIAN
        (length,) = struct.unpack_from(">Q" if big else "<Q", lead, 12)
        at += _LEAD + length
    return at == size


def _check_sizes(path: Path, file: Any) -> None:
    """Refuse channels that have more values than the file has room for: TDMS packs nothing."""
    size = path.stat().st_size
    for group in file.groups():
        for channel in group.channels():
            kind = channel.dtype
            width = kind.itemsize if kind.kind not in "OUS" else _WORD_BYTES
            raw = 1 if channel.properties.get("NI_Scaling_Status") else width  # scaled from less
            if len(channel) * raw > size:
                raise ValueError(f"{len(channel):,} values in {size:,} bytes")


def _time_channel(group: Any, options: ReadOptions) -> Any:
    """The channel of times in a group: the one asked for, else dates, else one that is named so."""
    channels = [channel for channel in group.channels() if len(channel)]
    if options.time is not None:
        name = options.time.removeprefix(f"{group.name}.")
        return next((channel for channel in channels if channel.name == name), None)
    channels = [channel for channel in channels if not _step(channel)]
    dates = (channel for channel in channels if channel.dtype.kind == "M")
    named = (c for c in channels if c.dtype.kind in "fiu" and is_time_name(c.name))
    return next(dates, None) or next(named, None)


def _step(channel: Any) -> float:
    """Seconds between two samples of a waveform; 0 of what is none."""
    step = channel.properties.get("wf_increment")
    return float(step) if isinstance(step, int | float) and 0 < step < math.inf else 0.0


@dataclass(frozen=True, slots=True)
class _Key:
    """What the times of channels depend on that have the same."""

    group: str
    length: int
    step: float = 0.0  #: seconds between two samples; 0 where a time channel tells
    start: float = 0.0


class _Clocks:
    """The times of all channels, in seconds from the first absolute time in the file."""

    def __init__(self, path: Path, options: ReadOptions, most: int | None) -> None:
        self._path, self._options, self._most = path, options, most
        self._zero: int | None = None  # seconds since 1970
        self.times: dict[_Key, NDArray[np.float64]] = {}

    def key(self, channel: Any, clock: Any) -> _Key | None:
        """What tells the times of a channel in whose group is that time channel; None if nothing.

        The times are in `times` then.
        """
        group, length, properties = channel.group_name, len(channel), channel.properties
        step = _step(channel)
        if not length:
            return None
        if step and self._options.time is None:
            start = float(properties.get("wf_start_offset", 0))
            if (moment := properties.get("wf_start_time")) is not None:
                nanoseconds = int(moment.as_datetime64("ns").astype(np.int64))
                start += self._since_zero(nanoseconds // 10**9) + nanoseconds % 10**9 / 1e9
            key = _Key(group, length, step, start)
        elif clock is not None and len(clock) == length:
            key = _Key(group, length)
        elif self._options.rate:
            key = _Key(group, length, 1 / self._options.rate)
        else:
            return None
        if key not in self.times:
            even = np.asarray(key.start + np.arange(length)[: self._most] * key.step, np.float64)
            self.times[key] = even if key.step else self._stamps(clock)
        return key

    def _since_zero(self, seconds: int) -> int:
        """Seconds since 1970 as those since the first absolute time."""
        self._zero = seconds if self._zero is None else self._zero
        return seconds - self._zero

    def _stamps(self, clock: Any) -> NDArray[np.float64]:
        """What a time channel tells."""
        stamps = clock[: self._most]
        stamps = stamps.as_datetime64("ns") if clock.dtype.kind == "M" else np.asarray(stamps)
        unit = unit_of_time(Column(clock.name, str(clock.properties.get("unit_string", ""))))
        reader = TimestampReader([str(stamp) for stamp in stamps[:_SAMPLE]], ".")
        raw = reader.finish(reader.from_array(stamps), unit, self._path, clock.name)
        whole = int(raw.base / raw.per_second)
        rest = (raw.values + (raw.base - whole * raw.per_second)) / raw.per_second
        result: NDArray[np.float64] = rest + (self._since_zero(whole) if raw.absolute else whole)
        return result
