"""A journal becomes a demonstration, the track that was marked live, and the raw stamps."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.joining import Stream, joined
from forcelab.capture.journal import Contents, Kind, Record, block_of_all, json_of
from forcelab.capture.reader import PLUGGED, UNPLUGGED
from forcelab.capture.smoothing import Stamped, stamped
from forcelab.clock import ClockMap
from forcelab.demonstration import Channel, Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.labels import Segment, Track, ordered

__all__ = ["Gathered", "channels_of_all", "gather"]

#: Share of a period by which arrivals of a device without a counter may be off before they are
#: taken as they came, instead of evenly.
_UNEVEN = 1.0
_FORCE = re.compile(r"([ft][xyz])(\d*)")


@dataclass(frozen=True, eq=False)
class Gathered:
    """What a journal held.

    Parameters
    ----------
    demonstration : Demonstration
    track : Track or None
        What was marked live; None where nothing was.
    remarks : tuple of str
        What is to be said, a sentence each.
    stamps : dict of str to ndarray
        The raw stamps: ``devices`` (names), and of device i ``arrived_i`` (s, host's monotonic
        clock), ``ticks_i`` (where it has a counter) and ``clock_i``: offset (s), rate (s a tick)
        and residual (s); of camera i ``frames_i``, shape (m, 2): arrived and the camera's own
        stamp (s; NaN where it tells none); ``start`` (s, host's monotonic clock) of time 0.
    """

    demonstration: Demonstration
    track: Track | None
    remarks: tuple[str, ...]
    stamps: dict[str, NDArray[Any]]


@dataclass(frozen=True, eq=False)
class _Recorded:
    """All samples of one device, put together."""

    arrived: NDArray[np.float64]
    ticks: NDArray[np.int64] | None
    values: NDArray[np.float64]
    breaks: NDArray[np.int64]


def gather(contents: Contents, folder: Path) -> Gathered:
    """Make a demonstration of a recording that has ended, however it ended.

    Parameters
    ----------
    contents : Contents
        What the journal holds.
    folder : Path
        Where the videos lie that it names.

    Raises
    ------
    InputError
        If there are fewer than two samples of a device that samples evenly, or the journal is not
        what it says.
    """
    header = contents.header
    try:
        name, task, author = (str(header[key]) for key in ("name", "task", "author"))
        told: list[Mapping[str, Any]] = list(header["devices"])
        channels = [tuple(Channel(*pair) for pair in one["channels"]) for one in told]
        names, holds = [str(one["name"]) for one in told], [bool(one["holds"]) for one in told]
        cameras: list[Mapping[str, Any]] = list(header["cameras"])
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"The journal does not say what was recorded ({error}).") from error
    remarks = [] if not contents.torn else [_torn(contents.torn)]
    stamps: dict[str, NDArray[Any]] = {"devices": np.array(names, dtype=np.str_)}
    streams = []
    for i, each in enumerate(channels):
        recorded = _recorded(contents.records, i, len(each))
        stamps[f"arrived_{i}"] = recorded.arrived
        if recorded.ticks is not None:
            stamps[f"ticks_{i}"] = recorded.ticks
        when = _stamped(recorded, holds[i])
        if when is not None:
            stamps[f"clock_{i}"] = np.array([when.offset, when.rate, when.residual])
        host = recorded.arrived if when is None else when.host
        away = _away(contents.records, i)
        streams.append(Stream(host, recorded.values, holds[i], when is not None, away))
    told_lost = [_lost(names[i], streams[i], stamps.get(f"ticks_{i}")) for i in range(len(names))]
    remarks += [sentence for sentence in told_lost if sentence]
    times, signals, start = joined(streams, names)
    stamps["start"] = np.array(start)
    video = None
    for i, camera in enumerate(cameras):
        frames = _frames(contents.records, i)
        stamps[f"frames_{i}"] = frames[:, :2]
        file = folder / str(camera["file"])
        if len(frames) and file.is_file() and video is None:
            video = VideoReference(file, _video_clock(frames, start))
        elif not len(frames):
            remarks.append(f"{camera['name']} gave no picture.")
    demonstration = Demonstration(
        name, task, times, signals, channels_of_all(channels), video=video
    )
    track = _marked(contents.records, start, demonstration.end, author)
    return Gathered(demonstration, track, tuple(remarks), stamps)


def _torn(count: int) -> str:
    return f"The last {count} bytes of the journal were torn and are left out."


def _recorded(records: Sequence[Record], device: int, columns: int) -> _Recorded:
    """All samples of a device, and where it was plugged in again."""
    pieces: list[list[bytes]] = [[]]
    for record in records:
        if record.device != device:
            continue
        if record.kind == Kind.BLOCK:
            pieces[-1].append(record.payload)
        elif record.kind == Kind.EVENT and json_of(record).get("what") == PLUGGED:
            pieces.append([])
    blocks = [block_of_all(piece, columns) for piece in pieces]
    ticked = [block.ticks for block in blocks if block.ticks is not None]
    whole = bool(ticked) and sum(map(len, ticked)) == sum(map(len, blocks))
    return _Recorded(
        np.concatenate([block.arrived for block in blocks]),
        np.concatenate(ticked) if whole else None,
        np.concatenate([block.values for block in blocks]),
        np.cumsum([len(block) for block in blocks[:-1]], dtype=np.int64),
    )


def _stamped(recorded: _Recorded, holds: bool) -> Stamped | None:
    """When the samples were taken; None where only the arrivals tell."""
    if holds or not len(recorded.arrived):
        return None
    if recorded.ticks is not None:
        return stamped(recorded.arrived, recorded.ticks, recorded.breaks)
    # Without a counter the samples count themselves, if they come evenly.
    found = stamped(recorded.arrived, np.arange(len(recorded.arrived)), recorded.breaks)
    even = found.residual <= _UNEVEN * found.rate and len(found.stretches) < 0.1 * len(found.host)
    return found if even else None


def _away(records: Sequence[Record], device: int) -> tuple[tuple[float, float], ...]:
    """From when to when (host's clock, s) a device was unplugged."""
    spans, since = [], None
    for record in records:
        if record.kind != Kind.EVENT or record.device != device:
            continue
        event = json_of(record)
        if event.get("what") == UNPLUGGED and since is None:
            since = float(event["at"])
        elif event.get("what") == PLUGGED and since is not None:
            spans.append((since, float(event["at"])))
            since = None
    return (*spans, *(() if since is None else ((since, np.inf),)))


def _lost(name: str, stream: Stream, ticks: NDArray[Any] | None) -> str:
    """What is said of samples that are missing."""
    sentences = []
    if stream.even and ticks is not None and len(ticks) > 1:
        period = float(np.median(np.diff(stream.host)))
        missing = np.round(np.diff(stream.host) / period) - 1
        lost = int(np.minimum(missing, np.diff(ticks) - 1)[missing > 0].clip(0).sum())
        if lost:
            sentences.append(f"{lost} samples of {name} were lost")
    if stream.away:
        number = len(stream.away)
        sentences.append(f"{name} was unplugged {'once' if number == 1 else f'{number} times'}")
    return f"{' and '.join(sentences)}; they are gaps." if sentences else ""


def channels_of_all(devices: Sequence[Sequence[Channel]]) -> tuple[Channel, ...]:
    """The channels of all devices: ``fx1 fy1 fz1 fx2 ...``, others numbered where they clash.

    Parameters
    ----------
    devices : sequence of sequence of Channel
        Of each device, in the order of a demonstration's columns.
    """
    forces = [c.name for each in devices for c in each if _FORCE.fullmatch(c.name)]
    clash = len(set(forces)) < len(forces)
    found: dict[str, Channel] = {}
    sensors = 0
    for each in devices:
        most = 0
        for channel in each:
            match = _FORCE.fullmatch(channel.name)
            name = channel.name
            if match is not None and (clash or not match[2]):
                number = int(match[2] or 1)
                most = max(most, number)
                name = f"{match[1]}{number + (sensors if clash else 0)}"
            base, count = name, 1
            while name in found:
                count += 1
                name = f"{base} {count}"
            found[name] = Channel(name, channel.unit)
        sensors += most
    return tuple(found.values())


def _frames(records: Sequence[Record], camera: int) -> NDArray[np.float64]:
    """Arrived, the camera's own stamp, and the file's own stamp of each frame (s), shape (m, 3)."""
    rows = [
        json_of(record)["frames"]
        for record in records
        if record.kind == Kind.FRAME and record.device == camera
    ]
    flat = [[np.nan if x is None else float(x) for x in row] for part in rows for row in part]
    return np.array(flat, dtype=np.float64).reshape(-1, 3)


def _video_clock(frames: NDArray[np.float64], start: float) -> ClockMap:
    """From the video's own stamps, which are made of the arrivals, to force time."""
    return ClockMap(float(np.median(frames[:, 0] - start - frames[:, 2])))


def _marked(records: Sequence[Record], start: float, end: float, author: str) -> Track | None:
    """The track that keys made that were held down: of several, the last one pressed counts."""
    marks = [json_of(record) for record in records if record.kind == Kind.MARK]
    held: list[str] = []
    segments: list[Segment] = []
    since = 0.0

    def until(time: float) -> None:
        nonlocal since
        time = float(np.clip(time, 0.0, end))
        if held and time > since:
            segments.append(Segment(since, time, held[-1]))
        since = max(since, time)

    for mark in sorted(marks, key=lambda mark: float(mark["at"])):
        until(float(mark["at"]) - start)
        action = str(mark["action"])
        if action in held:
            held.remove(action)
        if mark["down"]:
            held.append(action)
    until(end)
    return Track(author, ordered(_merged(segments))) if segments else None


def _merged(segments: Sequence[Segment]) -> list[Segment]:
    """Touching segments of one action are one."""
    result: list[Segment] = []
    for segment in segments:
        if result and (result[-1].end, result[-1].action) == (segment.start, segment.action):
            result[-1] = Segment(result[-1].start, segment.end, segment.action)
        else:
            result.append(segment)
    return result
