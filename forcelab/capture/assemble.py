"""A journal becomes a demonstration: its samples, the live track, the raw stamps."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.camera import SILENT
from forcelab.capture.clock_smoother import Stamped, spread, stamped
from forcelab.capture.device import Block
from forcelab.capture.journal import Contents, Kind, Record, Samples, json_of
from forcelab.capture.reader import PLUGGED, UNPLUGGED
from forcelab.capture.sample_counter import missed
from forcelab.clock import ClockMap
from forcelab.demonstration import GAP_PERIODS, Channel, Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.labels import Segment, Track, ordered
from forcelab.project.media import Camera


@dataclass(eq=False)
class DeviceLog:
    """What was recorded of one device.

    Parameters
    ----------
    samples : Samples
    breaks : list of int
        Samples before which it was plugged in again.
    away : list of (float, float)
        From when to when (host's clock, s) it was unplugged.
    """

    samples: Samples
    breaks: list[int] = field(default_factory=list)
    away: list[tuple[float, float]] = field(default_factory=list)
    _since: float | None = None

    def event(self, what: object, at: float) -> None:
        """It was unplugged or plugged in again."""
        if what == UNPLUGGED and self._since is None:
            self._since = at
        elif what == PLUGGED:
            self.breaks.append(len(self.samples))
            if self._since is not None:
                self.away.append((self._since, at))
            self._since = None

    def end(self) -> None:
        """There are no more records."""
        if self._since is not None:
            self.away.append((self._since, np.inf))
            self._since = None


@dataclass(eq=False)
class JournalIndex:
    """All that a journal holds.

    Parameters
    ----------
    devices : list of Recorded
    frames : list of ndarray, shape (m, 3)
        Of each camera: arrived, the camera's own stamp, and the file's own stamp of each frame (s).
    marks : list of dict
        Keys of actions that went down or up.
    """

    devices: list[DeviceLog]
    frames: list[NDArray[np.float64]]
    marks: list[dict[str, Any]]


def sorted_records(records: Iterable[Record], columns: Sequence[int], cameras: int) -> JournalIndex:
    """Sort records.

    Parameters
    ----------
    records : iterable of Record
        In their order; gone through once.
    columns : sequence of int
        Channels of each device.
    cameras : int
        How many there are.

    Raises
    ------
    InputError
        If a record is not what it says.
    """
    devices = [DeviceLog(Samples(number)) for number in columns]
    rows: list[list[float]] = [[] for _ in range(cameras)]
    marks = []
    for record in records:
        if record.kind == Kind.BLOCK and record.device < len(devices):
            devices[record.device].samples.add(record.payload)
        elif record.kind == Kind.EVENT and record.device < len(devices):
            event = json_of(record)
            devices[record.device].event(event.get("what"), float(event.get("at", np.nan)))
        elif record.kind == Kind.MARK:
            marks.append(json_of(record))
        elif record.kind == Kind.FRAME and record.device < cameras:
            for stamps in json_of(record)["frames"]:
                rows[record.device] += [np.nan if x is None else float(x) for x in stamps]
    for device in devices:
        device.end()
    return JournalIndex(devices, [np.array(row).reshape(-1, 3) for row in rows], marks)


_EDGE = 0.25  # s by which devices may begin or end apart and be cut to what they share
_AT_ONCE = 1 << 16  # stamps; more would only take memory
_MISSED = 1.5  # periods apart: a sample is missing between two neighbours that were stamped evenly


@dataclass(frozen=True, eq=False)
class Stream:
    """The samples of one device, on the host's clock.

    Parameters
    ----------
    host : ndarray of float64, shape (n,)
        When each was taken, s.
    values : ndarray of float64, shape (n, c)
    holds : bool
        Whether a value holds until the next one.
    even : bool
        Whether the stamps come from a clock; else from arrivals.
    away : tuple of (float, float)
        From when to when (s) it was unplugged.
    before : bool
        Whether the first value of one that holds was there before anything was recorded: then it
        holds for samples, too, that were on their way when recording began.
    """

    host: NDArray[np.float64]
    values: NDArray[np.float64]
    holds: bool = False
    even: bool = True
    away: tuple[tuple[float, float], ...] = ()
    before: bool = False


@dataclass(frozen=True, eq=False)
class Joined:
    """All channels on the stamps of one device.

    Parameters
    ----------
    times : ndarray of float64, shape (n,)
        Seconds from the first sample, strictly increasing.
    signals : ndarray of float64, shape (n, c)
        The channels of all devices in their order; NaN where one has no sample near.
    start : float
        Host time (s) of time 0.
    lead : int
        The device that gives the stamps.
    within : slice
        Which of its samples these are: all but those of the moments at the ends in which not all
        devices had begun, or some had ended.
    """

    times: NDArray[np.float64]
    signals: NDArray[np.float64]
    start: float
    lead: int
    within: slice


def joined(streams: Sequence[Stream], names: Sequence[str]) -> Joined:
    """Bring all channels onto the stamps of the first device that samples evenly, and did.

    Parameters
    ----------
    streams, names
        One for each device.

    Returns
    -------
    Joined

    Raises
    ------
    InputError
        If no device that could lead has two samples.
    """
    even = [i for i, stream in enumerate(streams) if not stream.holds]
    # One that was silent all the time takes nothing away from the others.
    lead = next((i for i in even if len(streams[i].host) > 1), -1)
    if lead < 0 and not even and streams and len(streams[0].host) > 1:
        lead = 0
    if lead < 0:
        which = f" of {names[even[0] if even else 0]}" if names else ""
        raise InputError(
            f"Fewer than two samples{which} were recorded; look at its channels live first."
        )
    first = streams[lead]
    host = _increasing(first.host)
    begin, end = _shared(host, [s for s in streams if not s.holds and len(s.host)])
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
            _onto(host, stream, part)
        column += part.shape[1]
    start = float(host[0])
    times = host - start
    times.flags.writeable = signals.flags.writeable = False  # so that nobody needs a copy
    return Joined(times, signals, start, lead, within)


def _increasing(host: NDArray[np.float64]) -> NDArray[np.float64]:
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


def _shared(host: NDArray[np.float64], streams: Sequence[Stream]) -> tuple[float, float]:
    """The time that all devices share, where they begin and end a moment apart."""
    begins = [float(s.host[0]) for s in streams if abs(s.host[0] - host[0]) < _EDGE]
    ends = [float(s.host[-1]) for s in streams if abs(s.host[-1] - host[-1]) < _EDGE]
    return max(begins, default=-np.inf), min(ends, default=np.inf)


def onto(host: NDArray[np.float64], stream: Stream) -> NDArray[np.float64]:
    """A device's channels at other stamps.

    Parameters
    ----------
    host : ndarray of float64, shape (n,)
        The stamps, in seconds of the host's clock.
    stream : Stream
        The device.

    Returns
    -------
    ndarray of float64, shape (n, c)
        NaN where it has no sample near.
    """
    out = np.empty((len(host), stream.values.shape[1]))
    _onto(host, stream, out)
    return out


def _onto(host: NDArray[np.float64], stream: Stream, out: NDArray[np.float64]) -> None:
    """As :func:`onto`, into an array."""
    own, values = stream.host, stream.values
    if len(own):
        own = _increasing(own)
    out[:] = np.nan
    if len(own) == 0:
        return
    if stream.holds:
        after = np.searchsorted(own, host, side="right")
        if stream.before:
            after = np.maximum(after, 1)
        known = after > 0
        out[known] = values[after[known] - 1]
        for gone, back in stream.away:
            # Until it has something to say again, for what it held may have changed unseen.
            again = own[own >= back]
            out[(host >= gone) & (host < (again[0] if len(again) else np.inf))] = np.nan
        return
    if len(own) == 1:
        return
    apart = (_MISSED if stream.even else GAP_PERIODS) * float(np.median(np.diff(own)))
    for first in range(0, len(host), _AT_ONCE):
        part = slice(first, first + _AT_ONCE)
        _between(host[part], own, values, apart, out[part])


def _between(
    host: NDArray[np.float64],
    own: NDArray[np.float64],
    values: NDArray[np.float64],
    apart: float,
    out: NDArray[np.float64],
) -> None:
    """Interpolate between neighbours that are not too far apart (s), into an array."""
    after = np.searchsorted(own, host, side="right")
    after = np.where(host == own[-1], len(own) - 1, after)
    inside = (after > 0) & (after < len(own))
    right = after[inside]
    left = right - 1
    step = own[right] - own[left]
    share = (host[inside] - own[left]) / step
    mixed = values[left] + share[:, None] * (values[right] - values[left])
    mixed[step > apart] = np.nan
    exact = share == 0.0
    mixed[exact] = values[left][exact]
    out[inside] = mixed


#: Seconds between a key going up and down again that no finger is as fast as. On X a held key
#: repeats as a release and a press; where these are read one by one, nothing tells what they are.
BRIDGE = 0.03


class LiveMarks:
    """Grows while keys go down and up, in any clock's seconds that never run back.

    Attributes
    ----------
    segments : list of Segment
        Those that have ended.
    """

    def __init__(self) -> None:
        self.segments: list[Segment] = []
        self._held: list[str] = []
        self._since = 0.0
        self._lifted: tuple[str, float] | None = None  # may come down again at once

    def press(self, action: str, down: bool, now: float) -> None:
        """The key of an action went down or up."""
        lifted = self._lifted
        if down and lifted is not None and lifted[0] == action and now - lifted[1] <= BRIDGE:
            self._lifted = None
            return
        self._settle()
        if down:
            self._take(action, now)
            self._held.append(action)
        else:
            self._lifted = action, now

    def growing(self) -> tuple[str, float] | None:
        """The action that counts now, and since when; None where no key is down."""
        self._settle()
        return (self._held[-1], self._since) if self._held else None

    def end(self, now: float) -> None:
        """No key is heard any more."""
        self._settle()
        self._until(now)
        self._held.clear()

    def track(self, now: float, since: float = 0.0) -> list[Segment]:
        """All segments that end after a time, with the one that grows."""
        seen = []
        for segment in reversed(self.segments):
            if segment.end <= since:
                break
            seen.append(segment)
        seen.reverse()
        lifted, until = self._lifted or ("", now)
        if self._held and until > self._since:
            seen.append(Segment(self._since, until, self._held[-1]))
        below = [action for action in self._held if action != lifted]
        if below and now > until:
            seen.append(Segment(until, now, below[-1]))
        return seen

    def _settle(self) -> None:
        """What went up stays up."""
        if self._lifted is not None:
            (action, at), self._lifted = self._lifted, None
            self._take(action, at)

    def _take(self, action: str, now: float) -> None:
        """Hold an action no more, from a time on."""
        self._until(now)
        if action in self._held:
            self._held.remove(action)

    def _until(self, now: float) -> None:
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
_FORCE = re.compile(r"([ft][xyz])(\d*)")


@dataclass(frozen=True, eq=False)
class AssembledRecording:
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


def gather(contents: Contents, folder: Path) -> AssembledRecording:
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
    return AssembledRecording(
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
