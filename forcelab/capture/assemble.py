"""A journal becomes a demonstration: its samples, the live track, the raw stamps."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

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
from forcelab.clock import ClockMap, farthest_drift
from forcelab.demonstration import GAP_PERIODS, Channel, Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.labels import Segment, Track, ordered
from forcelab.signals.grid import interpolate


@dataclass(eq=False)
class DeviceLog:
    """The recorded samples and breaks of one device."""

    samples: SampleBuffer
    #: Samples before which it was plugged in again.
    breaks: list[int] = field(default_factory=list)
    #: From when to when (host's clock, s) it was unplugged.
    away: list[tuple[float, float]] = field(default_factory=list)
    #: Whether it was unplugged when the recording ended.
    gone: bool = False
    _since: float | None = None

    def event(self, record: object, at: float) -> None:
        """It was unplugged or plugged in again, or the recording ended meanwhile."""
        if record == UNPLUGGED and self._since is None:
            self._since = at
        elif record == PLUGGED:
            self.breaks.append(len(self.samples))
            if self._since is not None:
                self.away.append((self._since, at))
            self._since = None
        elif record == ENDED and self._since is not None:
            self.away.append((self._since, at))
            self._since, self.gone = None, True

    def end(self) -> None:
        """There are no more records."""
        if self._since is not None:
            self.away.append((self._since, np.inf))
            self._since, self.gone = None, True


@dataclass(eq=False)
class JournalIndex:
    devices: list[DeviceLog]
    #: Of each camera, shape (m, 3): arrived, the camera's own stamp, and the file's own stamp of
    #: each frame (s).
    frames: list[NDArray[np.float64]]
    #: Keys of actions that went down or up.
    marks: list[dict[str, Any]]
    #: Of each device, the times (s, host's clock) and texts of markers.
    markers: list[list[tuple[float, str]]]


def index_records(records: Iterable[Record], columns: Sequence[int], cameras: int) -> JournalIndex:
    """Sort records by device, of so many `columns` each, and by camera."""
    devices = [DeviceLog(SampleBuffer(number)) for number in columns]
    rows: list[list[float]] = [[] for _ in range(cameras)]
    marks: list[dict[str, Any]] = []
    markers: list[list[tuple[float, str]]] = [[] for _ in columns]
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
                markers[record.device].append((float(mark["at"]), str(mark["marker"])))
        elif record.kind == RecordKind.FRAME and record.device < cameras:
            for stamps in decode_json(record)["frames"]:
                rows[record.device] += [np.nan if x is None else float(x) for x in stamps]
    for device in devices:
        device.end()
    frames = [np.array(row).reshape(-1, 3) for row in rows]
    return JournalIndex(devices, frames, marks, markers)


_EDGE = 0.25  # s by which devices may begin or end apart and be cut to what they share
_STAMPS_AT_ONCE = 1 << 16  # stamps; more would only take memory
_MISSING_PERIODS = (
    1.5  # periods apart: a sample is missing between two neighbours that were stamped evenly
)


@dataclass(frozen=True, eq=False)
class DeviceStream:
    """The samples of one device, on the host's clock."""

    #: When each was taken (s), shape (n,).
    host: NDArray[np.float64]
    #: Shape (n, c).
    values: NDArray[np.float64]
    #: Whether a value holds until the next one.
    holds: bool = False
    #: Whether the stamps come from a clock; else from arrivals, or with the samples.
    even: bool = True
    #: From when to when (s) it was unplugged.
    away: tuple[tuple[float, float], ...] = ()
    #: Whether the first value of one that holds was there before anything was recorded: then it
    #: holds for samples, too, that were on their way when recording began.
    before: bool = False
    #: Missing by the stamps that came with the samples, and how many gaps that are.
    lost: int = 0
    gaps: int = 0
    #: Whether it stayed away the last time until the recording ended.
    gone: bool = False


@dataclass(frozen=True, eq=False)
class AlignedChannels:
    """All channels on the stamps of one device."""

    #: Seconds from the first sample, strictly increasing, shape (n,).
    times: NDArray[np.float64]
    #: The channels of all devices in their order, shape (n, c); NaN where one has no sample near.
    signals: NDArray[np.float64]
    #: Host time (s) of time 0.
    start: float
    #: The device that gives the stamps.
    lead: int
    #: Which of its samples these are: all but those of the moments at the ends in which not all
    #: devices had begun, or some had ended.
    within: slice


def align(streams: Sequence[DeviceStream], names: Sequence[str]) -> AlignedChannels:
    """Bring all channels onto the stamps of the first device that samples evenly, and did."""
    even = [i for i, stream in enumerate(streams) if not stream.holds]
    # One that was silent all the time takes nothing away from the others.
    lead = next((i for i in even if len(streams[i].host) > 1), -1)
    if lead < 0 and not even and streams and len(streams[0].host) > 1:
        lead = 0
    if lead < 0:
        of_device = f" of {names[even[0] if even else 0]}" if names else ""
        raise InputError(
            f"Fewer than two samples{of_device} were recorded; look at its channels live first."
        )
    first = streams[lead]
    host = _make_increasing(first.host)
    begin, end = _shared_time(host, [s for s in streams if not s.holds and len(s.host)])
    within = slice(*np.searchsorted(host, [begin, np.nextafter(end, np.inf)]).tolist())
    if within.stop - within.start < 2:
        within = slice(0, len(host))
    host = host[within]
    signals = np.empty((len(host), sum(stream.values.shape[1] for stream in streams)))
    column = 0
    for i, stream in enumerate(streams):
        part = signals[:, column : column + stream.values.shape[1]]
        if i == lead:
            part[:] = stream.values[within]
        else:
            resample(host, stream, part)
        column += part.shape[1]
    start = float(host[0])
    times = host - start
    times.flags.writeable = signals.flags.writeable = False  # so that no copy is needed
    return AlignedChannels(times, signals, start, lead, within)


def _make_increasing(host: NDArray[np.float64]) -> NDArray[np.float64]:
    """Stamps that go on increasing; two stretches may overlap by a delay.

    Those that would go back follow the one before by half a period, until they have caught up.
    """
    steps = np.diff(host)
    if not (steps <= 0).any():
        return host
    forward = steps[steps > 0]
    passed = (0.5 * float(np.median(forward)) if len(forward) else 1e-6) * np.arange(len(host))
    increasing: NDArray[np.float64] = np.maximum.accumulate(host - passed) + passed
    return increasing


def _shared_time(host: NDArray[np.float64], streams: Sequence[DeviceStream]) -> tuple[float, float]:
    """The time that all devices share, where they begin and end a moment apart."""
    begins = [float(s.host[0]) for s in streams if abs(s.host[0] - host[0]) < _EDGE]
    ends = [float(s.host[-1]) for s in streams if abs(s.host[-1] - host[-1]) < _EDGE]
    return max(begins, default=-np.inf), min(ends, default=np.inf)


def resample(
    host: NDArray[np.float64], stream: DeviceStream, out: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """A device's channels at other stamps (s, host's clock): NaN where no sample is near.

    Shape (n, c); written into `out` if that is given.
    """
    host_times, values = stream.host, stream.values
    if out is None:
        out = np.empty((len(host), values.shape[1]))
    out[:] = np.nan
    if len(host_times) == 0:
        return out
    host_times = _make_increasing(host_times)
    if stream.holds:
        after = np.searchsorted(host_times, host, side="right")
        if stream.before:
            after = np.maximum(after, 1)
        known = after > 0
        out[known] = values[after[known] - 1]
        for gone, back in stream.away:
            # Until it has something to say again, for what it held may have changed unseen.
            times_after = host_times[host_times >= back]
            out[(host >= gone) & (host < (times_after[0] if len(times_after) else np.inf))] = np.nan
        return out
    if len(host_times) == 1:
        return out
    apart = (_MISSING_PERIODS if stream.even else GAP_PERIODS) * float(
        np.median(np.diff(host_times))
    )
    for first in range(0, len(host), _STAMPS_AT_ONCE):
        part = slice(first, first + _STAMPS_AT_ONCE)
        out[part] = interpolate(host[part], host_times, values, longest=apart, beyond=0.0)
    return out


#: Seconds between a key going up and down again that no finger is as fast as. On X a held key
#: repeats as a release and a press; where these are read one by one, nothing tells what they are.
AUTOREPEAT_SECONDS = 0.03


class LiveMarks:
    """Grows while keys go down and up, in any clock's seconds that never run back."""

    def __init__(self) -> None:
        self.segments: list[Segment] = []
        self._held: list[str] = []
        self._since = 0.0
        self._released: tuple[str, float] | None = None  # may come down again at once

    def press(self, action: str, down: bool, now: float) -> None:
        """The key of an action went down or up."""
        released = self._released
        if (
            down
            and released is not None
            and released[0] == action
            and now - released[1] <= AUTOREPEAT_SECONDS
        ):
            self._released = None
            return
        self._settle()
        if down:
            self._release(action, now)
            self._held.append(action)
        else:
            self._released = action, now

    def current(self) -> tuple[str, float] | None:
        """The action that counts now, and since when; None where no key is down."""
        self._settle()
        return (self._held[-1], self._since) if self._held else None

    def end(self, now: float) -> None:
        """Keys mark nothing any more."""
        self._settle()
        self._extend(now)
        self._held.clear()

    def track(self, now: float, since: float = 0.0) -> list[Segment]:
        """All segments that end after a time, with the one that grows."""
        segments = []
        for segment in reversed(self.segments):
            if segment.end <= since:
                break
            segments.append(segment)
        segments.reverse()
        released, released_at = self._released or ("", now)
        if self._held and released_at > self._since:
            segments.append(Segment(self._since, released_at, self._held[-1]))
        below = [action for action in self._held if action != released]
        if below and now > released_at:
            segments.append(Segment(released_at, now, below[-1]))
        return segments

    def _settle(self) -> None:
        """What went up stays up."""
        if self._released is not None:
            (action, at), self._released = self._released, None
            self._release(action, at)

    def _release(self, action: str, now: float) -> None:
        """Hold an action no more, from a time on."""
        self._extend(now)
        if action in self._held:
            self._held.remove(action)

    def _extend(self, now: float) -> None:
        """The action that counts has lasted until a time."""
        if self._held and now > self._since:
            action, start = self._held[-1], self._since
            last = self.segments[-1] if self.segments else None
            if last is not None and (last.end, last.action) == (start, action):
                start = self.segments.pop().start
            self.segments.append(Segment(start, now, action))
        self._since = max(now, self._since)


#: Share of a period by which arrivals of a device without a counter may be off before they are
#: taken as they came, instead of evenly.
_UNEVEN = 1.0
#: Stamps from which a stream's even times are told, and the share by which its usual step may
#: differ from the mean one: by more, samples are missing again and again.
_FEWEST_STAMPS, _ALIKE = 16, 0.005
_FORCE = re.compile(r"([ft][xyz])(\d*)")


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
        stream, device_precision, kept = _time_samples(device, log, begun)
        streams.append(stream)
        precision = max(precision, device_precision)
        stamps |= {f"{key}_{i}": values for key, values in kept.items()}
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
    for device, markers in zip(devices, index.markers, strict=True):
        if markers:
            found, sentences = _marker_tracks(device.name, markers, start, demonstration)
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
    kept: dict[str, NDArray[Any]] = {"arrived": block.arrived}
    if block.ticks is not None and len(block):
        kept["ticks"] = block.ticks
    host, breaks = block.arrived, np.array(log.breaks, dtype=np.int64)
    if device.holds:
        fitted = None
    elif device.stamped:
        fitted = _even_stamps(block.arrived, breaks, device.rate)
    else:
        fitted = _fit_device(block, breaks, device.counted, device.rate)
    if fitted is not None:
        kept["clock"] = np.array([fitted.offset, fitted.rate, fitted.residual])
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
        device.holds,
        fitted is not None,
        tuple(log.away),
        before,
        int(missing.sum()),
        int(np.count_nonzero(missing)),
        log.gone,
    )
    return stream, precision, kept


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
            videos.append(VideoReference(file, _video_clock(frames, start), own))
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


def channels_of_all(devices: Sequence[Sequence[Channel]]) -> tuple[Channel, ...]:
    """The channels of all devices: ``fx1 fy1 fz1 fx2 ...``, others numbered where they clash."""
    forces = [c.name for device in devices for c in device if _FORCE.fullmatch(c.name)]
    clash = len(set(forces)) < len(forces)
    channels: dict[str, Channel] = {}
    sensors = 0
    for device in devices:
        sensors_here = 0
        for channel in device:
            match = _FORCE.fullmatch(channel.name)
            name = channel.name
            if match is not None and (clash or not match[2]):
                number = int(match[2] or 1)
                sensors_here = max(sensors_here, number)
                name = f"{match[1]}{number + (sensors if clash else 0)}"
            base, count = name, 1
            while name in channels:
                count += 1
                name = f"{base} {count}"
            channels[name] = Channel(name, channel.unit)
        sensors += sensors_here
    return tuple(channels.values())


def _video_clock(frames: NDArray[np.float64], start: float) -> ClockMap:
    """From the video's own stamps, which are made of the arrivals, to force time."""
    return ClockMap(float(np.median(frames[:, 0] - start - frames[:, 2])))


def marks_track(
    marks: Sequence[Mapping[str, Any]], start: float, end: float, author: str
) -> Track | None:
    """The track of the keys that were held down."""
    marked = LiveMarks()
    for mark in sorted(marks, key=lambda mark: float(mark["at"])):
        at = min(float(mark["at"]) - start, end)  # none before 0 either
        marked.press(str(mark["action"]), bool(mark["down"]), at)
    marked.end(end)
    return Track(author, ordered(marked.segments)) if marked.segments else None
