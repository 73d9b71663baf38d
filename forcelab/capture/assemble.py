"""A journal becomes a demonstration: its samples, the live track, the raw stamps."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.align import DeviceStream, align, channels_of_all
from forcelab.capture.camera import SILENT_SECONDS
from forcelab.capture.clock import missing_by_stamps, missing_samples
from forcelab.capture.clock_smoother import Timestamps, fit_timestamps, spread_deliveries
from forcelab.capture.device import Block
from forcelab.capture.journal import (
    ENDED,
    PLUGGED,
    UNPLUGGED,
    JournalReader,
    Record,
    RecordKind,
    SampleBuffer,
    decode_json,
)
from forcelab.capture.live_marks import marks_track
from forcelab.clock import ClockMap, farthest_drift
from forcelab.demonstration import Channel, Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.labels import Track


@dataclass(eq=False)
class DeviceLog:
    """The recorded samples, breaks and markers of one device."""

    samples: SampleBuffer
    #: Samples before which it was plugged in again.
    breaks: list[int] = field(default_factory=list)
    #: From when to when (host's clock, s) it was unplugged.
    away: list[tuple[float, float]] = field(default_factory=list)
    #: Whether it was unplugged when the recording ended.
    gone: bool = False
    #: Times (s, host's clock) and texts of markers.
    markers: list[tuple[float, str]] = field(default_factory=list)
    _since: float | None = None

    def event(self, what: object, at: float) -> None:
        """Note that it was unplugged or plugged in again, or that the recording ended."""
        if what == UNPLUGGED and self._since is None:
            self._since = at
        elif what == PLUGGED:
            self.breaks.append(len(self.samples))
        if what in (PLUGGED, ENDED) and self._since is not None:
            self.away.append((self._since, at))
            self._since, self.gone = None, what == ENDED


@dataclass(eq=False)
class JournalIndex:
    devices: list[DeviceLog]
    #: Of each camera, shape (m, 3): arrived, the camera's own stamp, and the file's own stamp of
    #: each frame (s).
    frames: list[NDArray[np.float64]]
    #: Keys of actions that went down or up.
    marks: list[dict[str, Any]]


def index_records(records: Iterable[Record], columns: Sequence[int], cameras: int) -> JournalIndex:
    """Sort records by device, of so many `columns` each, and by camera."""
    devices = [DeviceLog(SampleBuffer(number)) for number in columns]
    rows: list[list[float]] = [[] for _ in range(cameras)]
    marks: list[dict[str, Any]] = []
    for record in records:
        if record.kind == RecordKind.BLOCK and record.device < len(devices):
            devices[record.device].samples.add(record.payload)
        elif record.kind == RecordKind.EVENT and record.device < len(devices):
            event = decode_json(record)
            devices[record.device].event(event.get("what"), float(event.get("at", np.nan)))
        elif record.kind == RecordKind.MARK:
            mark = decode_json(record)
            if "marker" not in mark:
                marks.append(mark)
            elif record.device < len(devices):
                marker = float(mark["at"]), str(mark["marker"])
                devices[record.device].markers.append(marker)
        elif record.kind == RecordKind.FRAME and record.device < cameras:
            for stamps in decode_json(record)["frames"]:
                rows[record.device] += [np.nan if x is None else float(x) for x in stamps]
    for device in devices:
        device.event(ENDED, np.inf)  # what is away stays away
    return JournalIndex(devices, [np.array(row).reshape(-1, 3) for row in rows], marks)


#: Share of a period by which arrivals of a device without a counter may be off before they are
#: taken as they came, instead of evenly.
_UNEVEN = 1.0
#: Stamps from which a stream's even times are told, and the share by which its usual step may
#: differ from the mean one: by more, samples are missing again and again.
_FEWEST_STAMPS, _ALIKE = 16, 0.005


@dataclass(frozen=True, eq=False)
class AssembledRecording:
    """A journal's demonstration, and what is stored beside it."""

    demonstration: Demonstration
    #: What was marked live; and the markers of streams, each a track of its stream.
    tracks: tuple[Track, ...]
    #: Sentences for the user.
    remarks: tuple[str, ...]
    #: The raw stamps: ``devices`` (names), and of device i ``arrived_i`` (s, host's monotonic
    #: clock), ``ticks_i`` (where it has a counter) and ``clock_i``: offset (s), rate (s a tick) and
    #: residual (s); of camera i ``frames_i``, shape (m, 2): arrived and the camera's own stamp (s;
    #: NaN where it has none); ``start`` (s, host's monotonic clock) of time 0.
    stamps: dict[str, NDArray[Any]]
    #: What the device that gave the stamps sent in the time of the demonstration, shape (n, c), and
    #: the place of its first channel in that.
    lead_values: NDArray[np.float64]
    lead_column: int
    #: To how many seconds the stamps are known, those of the worst device: the residual of its
    #: clock, or where only arrivals tell the longest time over which a delivery was spread.
    precision: float


class _RecordedDevice(NamedTuple):
    """A device as the journal's header has it."""

    name: str
    channels: tuple[Channel, ...]
    rate: float
    holds: bool
    counted: bool
    stamped: bool


def _recorded_device(header: Mapping[str, Any]) -> _RecordedDevice:
    return _RecordedDevice(
        str(header["name"]),
        tuple(Channel(*pair) for pair in header["channels"]),
        float(header.get("rate", 0.0)),
        bool(header["holds"]),
        bool(header.get("counted", True)),
        bool(header.get("stamped", False)),
    )


def assemble(contents: JournalReader, folder: Path) -> AssembledRecording:
    """Make a demonstration of a journal that has ended, with the videos in `folder`.

    InputError if no device that samples evenly gave two samples, or the journal is invalid.
    """
    header = contents.header
    try:
        name, task, author = (str(header[key]) for key in ("name", "task", "author"))
        devices = [_recorded_device(device) for device in header["devices"]]
        begun = float(header.get("monotonic", -np.inf))
        cameras: list[Mapping[str, Any]] = list(header["cameras"])
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"The journal does not say what was recorded ({error}).") from error
    names = [device.name for device in devices]
    index = index_records(contents, [len(device.channels) for device in devices], len(cameras))
    remarks = []
    if contents.torn:
        remarks.append(f"The last {contents.torn} bytes of the journal were torn and are left out.")
    stamps: dict[str, NDArray[Any]] = {"devices": np.array(names, dtype=np.str_)}
    streams, precision = [], 0.0
    for i, (device, log) in enumerate(zip(devices, index.devices, strict=True)):
        stream, device_precision, raw = _time_samples(device, log, begun)
        streams.append(stream)
        precision = max(precision, device_precision)
        stamps |= {f"{key}_{i}": values for key, values in raw.items()}
    aligned = align(streams, names)
    for i, (device, stream) in enumerate(zip(devices, streams, strict=True)):
        if device.channels:
            ticks, leads = stamps.get(f"ticks_{i}"), i == aligned.lead
            remarks.append(loss_remark(device.name, stream, ticks, device.counted, leads))
    start = aligned.start
    stamps["start"] = np.array(start)
    stamps |= {f"frames_{i}": frames[:, :2] for i, frames in enumerate(index.frames)}
    videos, of_cameras = _assemble_videos(cameras, index.frames, folder, start)
    remarks += of_cameras
    demonstration = Demonstration(
        name,
        task,
        aligned.times,
        aligned.signals,
        channels_of_all([device.channels for device in devices]),
        videos=videos,
    )
    marked = marks_track(index.marks, start, demonstration.end, author)
    tracks = [] if marked is None else [marked]
    for device, log in zip(devices, index.devices, strict=True):
        if log.markers:
            found, sentences = _marker_tracks(device.name, log.markers, start, demonstration)
            tracks += found
            remarks += sentences
    return AssembledRecording(
        demonstration,
        tuple(tracks),
        tuple(remark for remark in remarks if remark),
        stamps,
        streams[aligned.lead].values[aligned.within],
        sum(len(device.channels) for device in devices[: aligned.lead]),
        precision,
    )


def _time_samples(
    device: _RecordedDevice, log: DeviceLog, begun: float
) -> tuple[DeviceStream, float, dict[str, NDArray[Any]]]:
    """A device's samples on the host's clock, to how many seconds, and its raw stamps."""
    block, precision = log.samples.block(), 0.0
    raw: dict[str, NDArray[Any]] = {"arrived": block.arrived}
    if block.ticks is not None and len(block):
        raw["ticks"] = block.ticks
    host, breaks = block.arrived, np.array(log.breaks, dtype=np.int64)
    if device.holds:
        fitted = None
    elif device.stamped:
        fitted = _even_stamps(block.arrived, breaks, device.rate)
    else:
        fitted = _fit_device(block, breaks, device.counted, device.rate)
    if fitted is not None:
        raw["clock"] = np.array([fitted.offset, fitted.rate, fitted.residual])
        host, precision = fitted.host, fitted.residual
    elif len(host) and not (device.holds or device.stamped):
        host, precision = spread_deliveries(host, breaks)
    before = device.holds and len(host) > 0 and bool(host[0] <= begun)
    missing = np.zeros(0, dtype=np.int64)
    if device.stamped and device.rate > 0:
        # What was missed while it was away is said by how long that was.
        parts = np.split(host, breaks)
        missing = np.concatenate([missing_by_stamps(part, device.rate) for part in parts])
    stream = DeviceStream(
        host,
        block.values,
        holds=device.holds,
        even=fitted is not None,
        away=tuple(log.away),
        before=before,
        lost=int(missing.sum()),
        gaps=int(np.count_nonzero(missing)),
        gone=log.gone,
    )
    return stream, precision, raw


def _marker_tracks(
    name: str,
    markers: Sequence[tuple[float, str]],
    start: float,
    demonstration: Demonstration,
) -> tuple[tuple[Track, ...], list[str]]:
    """What markers of a device (s, host's clock) say, as a track of it, and how that was read."""
    # Only recordings with markers need what reads them, the same as of files.
    from forcelab.formats.recording import ReadOptions
    from forcelab.formats.streams import Events, event_tracks

    times, words = zip(*markers, strict=True)
    events = Events(name, np.array(times), list(words))
    return event_tracks([events], ReadOptions(author=name), start, demonstration)


def _assemble_videos(
    cameras: Sequence[Mapping[str, Any]],
    frames_of: Sequence[NDArray[np.float64]],
    folder: Path,
    start: float,
) -> tuple[tuple[VideoReference, ...], list[str]]:
    """The cameras' videos on the clock that reads zero at `start`, and remarks."""
    videos: list[VideoReference] = []
    remarks = []
    for camera, frames in zip(cameras, frames_of, strict=True):
        file, name = folder / str(camera["file"]), str(camera["name"])
        if len(frames) and file.is_file():
            # Of two cameras of one model the second has no name of its own.
            own = "" if name in [video.name for video in videos] else name
            # The video's own stamps are made of the arrivals.
            clock = ClockMap(float(np.median(frames[:, 0] - start - frames[:, 2])))
            videos.append(VideoReference(file, clock, own))
        elif not len(frames):
            remarks.append(f"{name} gave no picture.")
        remarks += away_remarks(name, frames[:, 0])
    return tuple(videos), remarks


def away_remarks(name: str, arrived: NDArray[np.float64]) -> list[str]:
    """A sentence about a camera that was away for a while."""
    away = np.diff(arrived)
    away = away[away > SILENT_SECONDS]
    if not len(away):
        return []
    times = "once" if len(away) == 1 else f"{len(away)} times"
    return [f"{name} was away {times}, {away.sum():.1f} s in all; its video has no frames then."]


def _fit_device(
    block: Block, breaks: NDArray[np.int64], counted: bool, rate: float
) -> Timestamps | None:
    """When the samples were taken; None where only the arrivals tell."""
    if not len(block):
        return None
    if block.ticks is not None and counted:
        return fit_timestamps(block.arrived, block.ticks, breaks, rate)
    # Without a counter the samples count themselves, if they come evenly.
    ticks = np.arange(len(block)) if block.ticks is None else block.ticks
    fitted = fit_timestamps(block.arrived, ticks, breaks, rate, counted=False)
    few_stretches = len(fitted.stretches) < 0.1 * len(block)
    return fitted if fitted.residual <= _UNEVEN * fitted.rate and few_stretches else None


def _even_stamps(
    stamps: NDArray[np.float64], breaks: NDArray[np.int64], rate: float
) -> Timestamps | None:
    """Even times of a stream whose sender stamped unevenly what was sampled evenly.

    None where the stamps say that samples are missing, which even times would move all others for:
    they are kept then.
    """
    if len(stamps) < _FEWEST_STAMPS:
        return None
    fitted = fit_timestamps(stamps, np.arange(len(stamps)), breaks, rate, counted=False)
    usual = float(np.median(np.diff(stamps))) or fitted.rate  # those of a delivery may be alike
    window = int(np.clip(1.0 / fitted.rate, 1, len(stamps) // 4))
    complete = farthest_drift(stamps - fitted.host, window) <= 0.5 * fitted.rate
    return fitted if complete and abs(fitted.rate - usual) <= _ALIKE * usual else None


def loss_remark(
    name: str,
    stream: DeviceStream,
    ticks: NDArray[Any] | None,
    counted: bool = True,
    leads: bool = True,
) -> str:
    """A sentence about samples that are missing; empty where none are.

    With the device that `leads` the recording ends.
    """
    if not len(stream.host):
        return f"{name} gave nothing while it was recorded; its channels are empty."
    away = stream.away[:-1] if stream.gone else stream.away
    sentences, results, gaps = [], [], len(away)
    lost, how = stream.lost, "lost"
    if ticks is not None and len(ticks) > 1:
        steps, seconds = np.diff(ticks), np.diff(stream.host)
        wide = np.flatnonzero(steps > 1)
        if counted:
            period = float(np.median(seconds))
            pairs = zip(steps[wide].tolist(), seconds[wide].tolist(), strict=True)
            lost = sum(missing_samples(step, apart, period) for step, apart in pairs)
        else:  # each of them was seen
            lost, how = int((steps[wide] - 1).sum()), "in torn lines and lost"
    if lost:
        gaps += stream.gaps or lost
        were = "1 sample of {} was" if lost == 1 else f"{lost} samples of {{}} were"
        sentences.append(f"{were.format(name)} {how}")
    if away:
        which_device = "the device" if sentences else name
        times = "once" if len(away) == 1 else f"{len(away)} times, in all"
        seconds_away = sum(back - gone for gone, back in away)
        sentences.append(f"{which_device} was unplugged {times} for {seconds_away:.1f} s")
    if gaps:
        results.append("that is a gap" if gaps == 1 else "these are gaps")
    if stream.gone:
        short = stream.away[-1][1] - float(stream.host[-1])
        which_device = "the device" if sentences else name
        known = f", for the last {short:.1f} s" if np.isfinite(short) else ""
        sentences.append(f"{which_device} was unplugged until the end{known}")
        results.append(
            "the recording is shorter by that" if leads else "its channels are empty from then on"
        )
    return f"{' and '.join(sentences)}; {' and '.join(results)}." if sentences else ""
