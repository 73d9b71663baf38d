"""A journal becomes a demonstration, the track that was marked live, and the raw stamps."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.blocks import Block
from forcelab.capture.counting import missed
from forcelab.capture.frames import SILENT
from forcelab.capture.joining import Stream, joined
from forcelab.capture.journal import Contents
from forcelab.capture.marking import LiveMarks
from forcelab.capture.smoothing import Stamped, spread, stamped
from forcelab.capture.sorting import sorted_records
from forcelab.clock import ClockMap
from forcelab.demonstration import Channel, Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.labels import Track, ordered
from forcelab.project.loading import Camera

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
    filmed : tuple of Camera
        The cameras that gave pictures; the first one's video is the demonstration's.
    recorded : ndarray of float64, shape (n, c)
        What the device that gave the stamps sent in the time of the demonstration.
    column : int
        Of its first channel in the demonstration.
    precision : float
        To how many seconds the stamps are known, those of the worst device: the residual of its
        clock, or where only arrivals tell the longest time over which a delivery was spread.
    """

    demonstration: Demonstration
    track: Track | None
    remarks: tuple[str, ...]
    stamps: dict[str, NDArray[Any]]
    filmed: tuple[Camera, ...]
    recorded: NDArray[np.float64]
    column: int
    precision: float


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
        If no device that samples evenly gave two samples, or the journal is not what it says.
    """
    header = contents.header
    try:
        name, task, author = (str(header[key]) for key in ("name", "task", "author"))
        told: list[Mapping[str, Any]] = list(header["devices"])
        channels = [tuple(Channel(*pair) for pair in one["channels"]) for one in told]
        names, holds = [str(one["name"]) for one in told], [bool(one["holds"]) for one in told]
        rates = [float(one.get("rate", 0.0)) for one in told]
        counted = [bool(one.get("counted", True)) for one in told]
        begun = float(header.get("monotonic", -np.inf))
        cameras: list[Mapping[str, Any]] = list(header["cameras"])
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"The journal does not say what was recorded ({error}).") from error
    found = sorted_records(contents, [len(each) for each in channels], len(cameras))
    remarks = [] if not contents.torn else [_torn(contents.torn)]
    stamps: dict[str, NDArray[Any]] = {"devices": np.array(names, dtype=np.str_)}
    streams, precision = [], 0.0
    for i, recorded in enumerate(found.devices):
        block = recorded.samples.block()
        stamps[f"arrived_{i}"] = block.arrived
        if block.ticks is not None and len(block):
            stamps[f"ticks_{i}"] = block.ticks
        host, breaks = block.arrived, np.array(recorded.breaks, dtype=np.int64)
        when = None if holds[i] else _stamped(block, breaks, counted[i], rates[i])
        if when is not None:
            stamps[f"clock_{i}"] = np.array([when.offset, when.rate, when.residual])
            host, precision = when.host, max(precision, when.residual)
        elif len(host) and not holds[i]:
            host, bound = spread(host, breaks)
            precision = max(precision, bound)
        before = holds[i] and len(host) > 0 and bool(host[0] <= begun)
        away = tuple(recorded.away)
        streams.append(Stream(host, block.values, holds[i], when is not None, away, before))
    for i, stream in enumerate(streams):
        remarks.append(_lost(names[i], stream, stamps.get(f"ticks_{i}"), counted[i]))
    all_channels = joined(streams, names)
    start, lead = all_channels.start, streams[all_channels.lead]
    stamps["start"] = np.array(start)
    filmed: list[Camera] = []
    for i, camera in enumerate(cameras):
        frames = found.frames[i]
        stamps[f"frames_{i}"] = frames[:, :2]
        file = folder / str(camera["file"])
        if len(frames) and file.is_file():
            video = VideoReference(file, _video_clock(frames, start))
            filmed.append(Camera(str(camera["name"]), video))
        elif not len(frames):
            remarks.append(f"{camera['name']} gave no picture.")
        remarks += _unseen(str(camera["name"]), frames[:, 0])
    first = filmed[0].video if filmed else None
    demonstration = Demonstration(
        name,
        task,
        all_channels.times,
        all_channels.signals,
        channels_of_all(channels),
        video=first,
    )
    return Gathered(
        demonstration,
        _marked(found.marks, start, demonstration.end, author),
        tuple(remark for remark in remarks if remark),
        stamps,
        tuple(filmed),
        lead.values[all_channels.within],
        sum(len(each) for each in channels[: all_channels.lead]),
        precision,
    )


def _unseen(name: str, arrived: NDArray[np.float64]) -> list[str]:
    """What is said of a camera that was away for a while."""
    away = np.diff(arrived)
    away = away[away > SILENT]
    if not len(away):
        return []
    times = "once" if len(away) == 1 else f"{len(away)} times"
    return [f"{name} was away {times}, {away.sum():.1f} s in all; its video has no frames then."]


def _torn(count: int) -> str:
    return f"The last {count} bytes of the journal were torn and are left out."


def _stamped(block: Block, breaks: NDArray[np.int64], counted: bool, rate: float) -> Stamped | None:
    """When the samples were taken; None where only the arrivals tell."""
    if not len(block):
        return None
    if block.ticks is not None and counted:
        return stamped(block.arrived, block.ticks, breaks, rate)
    # Without a counter the samples count themselves, if they come evenly.
    ticks = np.arange(len(block)) if block.ticks is None else block.ticks
    found = stamped(block.arrived, ticks, breaks, rate, counted=False)
    even = found.residual <= _UNEVEN * found.rate and len(found.stretches) < 0.1 * len(found.host)
    return found if even else None


def _lost(name: str, stream: Stream, ticks: NDArray[Any] | None, counted: bool = True) -> str:
    """What is said of samples that are missing."""
    if not len(stream.host):
        return f"{name} gave nothing while it was recorded; its channels are empty."
    sentences, gaps = [], len(stream.away)
    if ticks is not None and len(ticks) > 1:
        steps, seconds = np.diff(ticks), np.diff(stream.host)
        wide = np.flatnonzero(steps > 1)
        if counted:
            period = float(np.median(seconds))
            pairs = zip(steps[wide].tolist(), seconds[wide].tolist(), strict=True)
            lost, how = sum(missed(step, apart, period) for step, apart in pairs), "lost"
        else:  # each of them was seen
            lost, how = int((steps[wide] - 1).sum()), "in torn lines and lost"
        if lost:
            gaps += lost
            were = "1 sample of {} was" if lost == 1 else f"{lost} samples of {{}} were"
            sentences.append(f"{were.format(name)} {how}")
    if stream.away:
        number, last = len(stream.away), float(stream.host[-1])
        seconds_away = sum(max(min(back, last) - gone, 0.0) for gone, back in stream.away)
        which_device = "the device" if sentences else name
        times = "once" if number == 1 else f"{number} times, in all"
        sentences.append(f"{which_device} was unplugged {times} for {seconds_away:.1f} s")
    which = "that is a gap" if gaps == 1 else "these are gaps"
    return f"{' and '.join(sentences)}; {which}." if sentences else ""


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


def _video_clock(frames: NDArray[np.float64], start: float) -> ClockMap:
    """From the video's own stamps, which are made of the arrivals, to force time."""
    return ClockMap(float(np.median(frames[:, 0] - start - frames[:, 2])))


def _marked(
    marks: Sequence[Mapping[str, Any]], start: float, end: float, author: str
) -> Track | None:
    """The track that keys made that were held down."""
    marked = LiveMarks()
    for mark in sorted(marks, key=lambda mark: float(mark["at"])):
        at = min(float(mark["at"]) - start, end)  # none before 0 either
        marked.press(str(mark["action"]), bool(mark["down"]), at)
    marked.end(end)
    return Track(author, ordered(marked.segments)) if marked.segments else None
